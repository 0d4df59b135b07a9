"""How far a centre by convention lies from the true one, for pretravel of the usual shape.

A first harmonic of pretravel looks like a shift of the reference. A convention chooses; here is the
uncertainty of that choice.
"""

from __future__ import annotations

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.units import MICROMETRE
from pretravel.maps.observation import Observation
from pretravel.maps.provenance import AXIAL_PRETRAVEL

_USUAL_ACROSS = 10.0 * MICROMETRE
_MOST_ACROSS = 30.0 * MICROMETRE
"""Pretravel across the axis less that along it: usual (where the tip's diameter is not known and
so nothing is measured), and the most that follows from touches near the pole alone."""
_LOBES = 0.35
"""Lobes of three rods, over pretravel across the axis: the mean is 1.2 to 1.5 times the least."""
_FIRST_HARMONIC = 0.05
"""First harmonic across the axis, over pretravel across the axis: rods 2° out and a spring 2 % of
the radius of the seats beside the axis make 0.04."""


def usual_shift_covariance(observation: Observation, left: float = 1.0) -> FloatArray:
    """Covariance of the least-squares centre about the true one, by pretravel of usual shape.

    Parameters
    ----------
    observation : Observation
    left : float
        Share of the usual shape that the map does not represent: one for a map without shape.

    Returns
    -------
    (axes, axes) float
        [mm²]

    Notes
    -----
    Pretravel is usually A sin²θ + L sin³θ cos 3(φ - φ0) and a small first harmonic across the axis,
    beside a constant. The least-squares sphere takes a part of each for a shift. A follows from
    the level of that sphere and from pretravel along the axis, which is small.

    >>> from pretravel.base.directions import fibonacci_cap
    >>> n = fibonacci_cap(60, np.pi / 2)
    >>> x, y = n[:, 0], n[:, 1]
    >>> pretravel = 1e-3 * (1.0 + 9.0 * (x**2 + y**2) + 3.0 * (x**3 - 3.0 * x * y**2))
    >>> touches = n * (12.5 + 3.0 - pretravel)[:, None]
    >>> seen = Observation(touches, np.arange(60), np.zeros(3), 12.5, 3.0, ring=False)
    >>> u = np.sqrt(np.diag(usual_shift_covariance(seen))) / MICROMETRE
    >>> bool(np.all(np.abs(u - [0.5, 0.5, 9.0]) < [0.2, 0.2, 1.0]))
    True
    """
    axes, directions = observation.axes, observation.directions
    x, y = directions[:, 0], directions[:, 1]
    across = x**2 + y**2
    lobes = np.stack([x**3 - 3.0 * x * y**2, 3.0 * x**2 * y - y**3], axis=1)
    to_shift = observation.to_sphere[1:]
    amplitude = min(_by_level(observation, across), _by_residuals(observation, across, lobes))
    columns = [
        left * amplitude * (to_shift @ across)[:, None],
        left * amplitude * _LOBES / np.sqrt(2.0) * (to_shift @ lobes),  # of any azimuth
        amplitude * _FIRST_HARMONIC * np.eye(axes)[:, :2],
    ]
    found = np.hstack(columns)
    return np.asarray(found @ found.T)


def _by_level(observation: Observation, across: FloatArray) -> float:
    """Pretravel across the axis less that along it, from the level of the sphere. [mm]"""
    if not observation.tip_known:
        return _USUAL_ACROSS
    # Of the least-squares sphere: values are about any centre.
    to_mean = observation.to_sphere[0]
    beyond = abs(float(to_mean @ observation.values) - AXIAL_PRETRAVEL)
    return min(beyond / max(abs(float(to_mean @ across)), 1e-3), _MOST_ACROSS)


def _by_residuals(observation: Observation, across: FloatArray, lobes: FloatArray) -> float:
    """The same from what the least-squares sphere leaves: a shape cannot hide from it. [mm]"""
    shapes = np.column_stack([across, _LOBES / np.sqrt(2.0) * lobes, observation.values])
    left = shapes - observation.free_design @ (observation.to_sphere @ shapes)
    mean_square = np.mean(left**2, axis=0)
    return float(np.sqrt(mean_square[-1] / max(mean_square[:-1].sum(), 1e-6)))
