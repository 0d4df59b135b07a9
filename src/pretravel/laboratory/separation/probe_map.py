"""Compensation with the probe's errors of a separation."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, from_angles, probe_rotation
from pretravel.laboratory.separation.separation import Separation
from pretravel.maps import DirectionSupport, Origin, PretravelMap, Provenance, TabulatedBasis
from pretravel.uncertainty import Covariance


def separation_map(
    result: Separation, tip_radius: float, *, axis: npt.ArrayLike = (0.0, 0.0, 1.0)
) -> PretravelMap:
    """A map across the axis from the probe's errors, about their mean.

    Parameters
    ----------
    result : Separation
    tip_radius : float
        Effective radius of the machine's qualification, which contains the mean pretravel. [mm]
    axis : (3,) float
        The probe's +z in the machine frame.

    Returns
    -------
    PretravelMap
        Linear between the directions, with what this misses as `fixed_scatter`. Its repeatability
        is that of a touch, machine and probe together, on average over the pairs.

    Raises
    ------
    PretravelError
        Azimuths that are not known.

    References
    ----------
    Nafi and Mayer 2011, Figure 4b.

    >>> from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
    >>> from pretravel.laboratory.separation.separation import separate
    >>> i, j = np.divmod(np.arange(144), 12)
    >>> lobes = 1e-3 * np.cos(3 * j * np.pi / 6)
    >>> noise = 1e-5 * np.random.default_rng(1).normal(size=144)
    >>> found = separate(MultiStepReadings(i + 1, j + 1, noise - lobes))
    >>> made = separation_map(found, 2.0)
    >>> [round(float(each), 4) for each in made.pretravel([[1, 0, 0], [0.5, 0.75**0.5, 0]])]
    [0.001, -0.001]
    """
    if not np.all(np.isfinite(result.probe_azimuth)):
        raise PretravelError(
            "a map needs the azimuths of the probe's directions: separate touches, or number the "
            "directions 1 to n around the circle"
        )
    across = np.full(len(result.probes), 0.5 * math.pi)
    support = DirectionSupport(from_angles(across, result.probe_azimuth))
    split, count = len(result.machines), len(result.probes)
    centred: FloatArray = np.eye(count) - 1.0 / count
    covariance = Covariance.full(centred @ result.error_covariance[split:, split:] @ centred.T)
    variance = float(result.machine_variance.mean() + result.probe_variance.mean())
    basis, errors = TabulatedBasis(support), centred @ result.probe_error
    return PretravelMap(
        basis=basis,
        coefficients=errors,
        covariance=covariance,
        support=support,
        tip_radius=tip_radius,
        repeatability=math.sqrt(max(variance, 0.0)),
        repeatability_dof=result.dof,
        fixed_scatter=basis.u_between_nodes(errors, covariance),
        rotation=probe_rotation(axis, 0.0),
        provenance=Provenance(
            Origin.CALIBRATED,
            "separated from the machine by a multi-step test",
            touches=f"{len(result.residuals)} readings in {count} directions",
            gauge="pretravel is about its mean, which is in the effective radius of the tip",
            level_known=False,
        ),
    )
