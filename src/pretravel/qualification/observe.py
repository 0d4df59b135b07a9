"""Touches on a reference become an observation: directions, their repeats, the centre."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pretravel.base import (
    USUAL_DELAY,
    USUAL_FEED,
    ConvergenceError,
    FloatArray,
    IntArray,
    PretravelError,
    connected,
    delay_travel,
    near_pairs,
)
from pretravel.maps import Observation, QualificationSetup, of_means
from pretravel.qualification.impossible_touches import (
    refuse_contradictions,
    refuse_too_little,
    refuse_wrong_normals,
)
from pretravel.touches import Touches
from pretravel.uncertainty import SphereFit, fit_sphere

_SAME_DIRECTION = 1e-3
_CROWD = 16  # normals within one direction from which not each is compared with each


def observe(touches: Touches, setup: QualificationSetup, rotation: FloatArray) -> Observation:
    """Touches about their least-squares centre, after a check that everything fits together.

    Parameters
    ----------
    touches : Touches
    setup : QualificationSetup
    rotation : (3, 3) float
        Probe to machine frame.

    Raises
    ------
    PretravelError
        Too few touches, all in one plane, diameters or units that do not fit, normals that do not
        fit.
    """
    groups = _repeats(touches.normals)
    refuse_too_little(touches, int(groups.max()) + 1, setup)
    in_probe = touches.positions @ rotation
    fit = _least_squares(in_probe, setup, touches.source)
    refuse_contradictions(touches, in_probe, fit, setup)
    observation = _about(fit, in_probe, groups, setup, _u_constant(touches, setup))
    observation = replace(observation, of_means=of_means(touches))
    refuse_wrong_normals(touches, observation.directions @ rotation.T, setup.reference)
    return observation


def observed_again(
    touches: Touches, before: Observation, setup: QualificationSetup, rotation: FloatArray
) -> Observation:
    """Touches of `observe`, corrected since then, about their new centre; not checked again."""
    in_probe = touches.positions @ rotation
    fit = _least_squares(in_probe, setup, touches.source)
    found = _about(fit, in_probe, before.groups, setup, before.u_constant)
    return replace(found, of_means=before.of_means)


def _least_squares(
    in_probe: FloatArray, setup: QualificationSetup, source: str | None
) -> SphereFit:
    begin = f"{source}: " if source else ""
    try:
        return fit_sphere(in_probe[:, :2] if setup.ring else in_probe)
    except ConvergenceError as error:
        hint = "" if not setup.ring else " (is this a ring, touched inside at one height?)"
        raise PretravelError(f"{begin}{error}{hint}") from None
    except PretravelError as error:
        raise PretravelError(f"{begin}{error}") from None


def _u_constant(touches: Touches, setup: QualificationSetup) -> float:
    """Standard uncertainty of what all touches have in common: radius, travel in the delay. [mm]"""
    feed = USUAL_FEED if touches.feeds is None else float(np.mean(touches.feeds))
    return math.hypot(0.5 * setup.u_reference_diameter, delay_travel(feed, USUAL_DELAY))


def _about(
    fit: SphereFit,
    in_probe: FloatArray,
    groups: IntArray,
    setup: QualificationSetup,
    u_constant: float,
) -> Observation:
    """Touches about the centre of their sphere or circle."""
    radius, tip = 0.5 * setup.diameter, setup.tip_diameter
    return Observation(
        positions=in_probe,
        groups=groups,
        center=np.append(fit.center, in_probe[:, 2].mean()) if setup.ring else np.array(fit.center),
        reference_radius=radius,
        tip_radius=abs(fit.radius - radius) if tip is None else 0.5 * tip,
        ring=setup.ring,
        tip_known=tip is not None,
        u_constant=u_constant,
    )


def _repeats(normals: FloatArray) -> IntArray:
    """Number the directions in order of appearance; touches of one direction share the number."""
    # The number of pairs would grow with the square of the repeats.
    places, place = _different(normals)
    label = connected(len(places), near_pairs(places, _SAME_DIRECTION))[place]
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[inverse.ravel()], dtype=np.int64)


def _different(normals: FloatArray) -> tuple[FloatArray, IntArray]:
    """Normals whose distances are compared, and which of them stands for each normal.

    Each for itself; where many are within `_SAME_DIRECTION`, one for each cell of a finer grid.
    """
    crowd = _numbered_cells(normals, _SAME_DIRECTION)
    crowded = np.bincount(crowd)[crowd] > _CROWD
    fine = _numbered_cells(normals, 0.25 * _SAME_DIRECTION)
    number = np.where(crowded, fine, len(normals) + np.arange(len(normals)))
    _, first, place = np.unique(number, return_index=True, return_inverse=True)
    return np.asarray(normals[first]), np.asarray(place.ravel(), dtype=np.int64)


def _numbered_cells(normals: FloatArray, size: float) -> IntArray:
    """The cell of a cubic grid in which each normal lies, as a number from zero, (n,)."""
    cell = np.floor((normals + 1.0) / size).astype(np.int64)
    along = np.int64(2.0 / size) + 2
    _, number = np.unique(
        (cell[:, 0] * along + cell[:, 1]) * along + cell[:, 2], return_inverse=True
    )
    return np.asarray(number.ravel(), dtype=np.int64)
