"""Compensation with the results of a calibration rig."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pretravel.base import PretravelError, from_angles
from pretravel.laboratory.rig.budget import (
    LengthComponent,
    length_budget,
    own_repeatability,
    rig_sources,
    shared_by_directions,
)
from pretravel.laboratory.rig.calibration import RigCalibration
from pretravel.maps import DirectionSupport, Origin, PretravelMap, Provenance, TabulatedBasis
from pretravel.uncertainty import COVERAGE_FACTOR, Covariance, coverage_factor


def rig_map(
    calibration: RigCalibration, components: Sequence[LengthComponent], tip_radius: float
) -> PretravelMap:
    """A map for compensation from a calibration: in the plane across the axis, or all around.

    Parameters
    ----------
    calibration : RigCalibration
        Its directions are those in which the rod pushes the tip: those of surface normals.
    components : sequence of LengthComponent
        Of the rig.
    tip_radius : float
        [mm]

    Returns
    -------
    PretravelMap
        Linear between the directions, with what this misses as `fixed_scatter`. The repeatability
        of each direction is independent, that of the budget where none was measured; the rest of
        the budget is common to all directions.

    Raises
    ------
    PretravelError
        Names of traces without an azimuth.
    """
    directions = calibration.directions
    azimuths = np.array([d.azimuth for d in directions])
    if np.any(np.isnan(azimuths)):
        raise PretravelError(
            "a map needs the angles of each direction; the names of the traces must end in "
            "_AZIMUTH_REPEAT (rig_030_1), _AZIMUTHpPOLAR_REPEAT (rig_030p45_1) or an axis "
            "(rig_+Z_1)"
        )
    support = DirectionSupport(from_angles(np.array([d.polar for d in directions]), azimuths))
    shared = (*rig_sources(components), *shared_by_directions(calibration))
    common = length_budget(shared, abs(calibration.pretravel)).combined
    own = [own_repeatability(calibration, d) for d in directions]
    stated = length_budget([c for c in components if c.repeatability], 0.0).combined
    # What uses a map takes k = 2: of few repeats, that of Student's t is in the standard deviation.
    variances = [
        stated**2 / d.count
        if source is None
        else (coverage_factor(source.dof) / COVERAGE_FACTOR * source.constant) ** 2
        for d, source in zip(directions, own, strict=True)
    ]
    spread = calibration.repeatability
    known = math.isfinite(spread.value)
    basis, means = TabulatedBasis(support), np.array([d.pretravel for d in directions])
    covariance = Covariance.full(np.diag(variances) + common**2)
    return PretravelMap(
        basis=basis,
        coefficients=means,
        covariance=covariance,
        support=support,
        tip_radius=tip_radius,
        repeatability=spread.value if known else stated,
        repeatability_dof=spread.dof if known else math.inf,
        fixed_scatter=basis.u_between_nodes(means, covariance),
        feed=float(np.mean([t.feed for t in calibration.touches])),
        provenance=Provenance(
            Origin.CALIBRATED,
            "qualified on a calibration rig",
            touches=f"{sum(d.count for d in directions)} in {len(directions)} directions",
            gauge="pretravel is absolute: rod against laser",
        ),
    )
