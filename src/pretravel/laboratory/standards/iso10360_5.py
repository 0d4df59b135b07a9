"""Form and size errors of a single stylus after ISO 10360-5.

None of this was checked against the text of the standard: every figure states that its definition
is not checked against its text, and reports repeat it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    FloatArray,
    IntArray,
    PretravelError,
    azimuth_angle,
    polar_angle,
    probe_rotation,
    sphere_pattern_25,
)
from pretravel.laboratory.standards.standard_check import (
    ALONG_Z,
    DIAMETER_OF_REFERENCE,
    FORM_OF_REFERENCE,
    RANGE_AS_DEFINED,
    U_WITHOUT_NOISE,
    UNCHECKED,
    CalibratedSphere,
    FittedSet,
    Standard,
    StandardCheck,
    StandardFigure,
    refuse_other_unit,
    refuse_turned_spindle,
    surface_points,
)
from pretravel.maps import PretravelMap
from pretravel.touches import Touches
from pretravel.uncertainty import SphereFit, fit_sphere

PATTERN_TOLERANCE = 10.0 * DEGREE
"""Largest angle between a touch and the nearest direction of the pattern. [rad]"""
_LARGEST_SIZE_ERROR = 0.5  # mm
_SPHERE_DIAMETERS = (10.0, 50.0)  # mm
_READINGS = {
    False: "the standard's pattern can be understood in two ways; both are accepted. In these "
    "touches every second ring is turned by 22.5°, so that the rings at 22.5° and 67.5° begin at "
    "the same azimuth",
    True: "the standard's pattern can be understood in two ways; both are accepted. In these "
    "touches each ring is turned by 22.5° further than the ring before (cumulatively), so that "
    "the ring at 67.5° begins 45° after the ring at 22.5°",
}
"""What the touches follow, by whether the pattern is read cumulatively."""


@dataclass(frozen=True, eq=False)
class _Nearest:
    """The direction of a pattern that is nearest to each touch.

    Attributes
    ----------
    index : (n,) int
    off : (n,) float
        Angle between the touch and that direction. [rad]
    """

    index: IntArray
    off: FloatArray

    @property
    def worst(self) -> float:
        return float(self.off.max())

    @classmethod
    def of(cls, touches: Touches, directions: FloatArray) -> _Nearest:
        index = np.argmax(touches.normals @ directions.T, axis=1)
        cosine = np.sum(touches.normals * directions[index], axis=1)
        return cls(index, np.arccos(np.clip(cosine, -1.0, 1.0)))


def check_iso10360_5(
    touches: Touches,
    sphere: CalibratedSphere,
    *,
    tip_diameter: float | None = None,
    pretravel_map: PretravelMap | None = None,
    axis: npt.ArrayLike = ALONG_Z,
    limits: Mapping[str, float] | None = None,
) -> StandardCheck:
    """Determine the form and size errors of a single stylus from 25 touches on a sphere.

    Parameters
    ----------
    touches : Touches
        In the 25 directions of `sphere_pattern_25` about the axis, each touched once, or each
        equally often. Both readings of the pattern are accepted, and any turn about the axis; a
        note states the reading.
    sphere : CalibratedSphere
    tip_diameter : float, optional
        Of the tip as the machine uses it (the effective one after qualification). Without
        it, and without a map, there is no size error. [mm]
    pretravel_map : PretravelMap, optional
        Compensates the touches instead of the tip's diameter.
    axis : (3,) float
        The probe's +z in the machine frame.
    limits : mapping, optional
        Maximum permissible errors by "form" and "size". [mm]

    Raises
    ------
    PretravelError
        Touches that are not the pattern.

    Notes
    -----
    From memory, not compared: form is the largest less the smallest distance from the centre of
    the least-squares sphere, size its diameter less the calibrated one. The uncertainty of the
    test value follows ISO/TS 23165 (unchecked): half the sphere's form error for the form, the
    calibration of the diameter for the size.

    >>> n = sphere_pattern_25()
    >>> check = check_iso10360_5(Touches(n * 15.5, n), CalibratedSphere(25.0), tip_diameter=6.001)
    >>> [(f.name[:6], round(f.value * 1e3, 6) + 0.0) for f in check.figures]
    [('P_Form', 0.0), ('P_Size', -1.0)]
    """
    refuse_other_unit(touches, sphere)
    refuse_turned_spindle(touches)
    runs, reading = _runs(touches, axis)
    points = surface_points(touches, tip_diameter, pretravel_map)
    fits = tuple(fit_sphere(points[rows]) for rows in runs)
    given = limits or {}
    form = StandardFigure(
        "P_Form.Sph.1x25:SS:Tact (P_FTU in the edition of 2010)",
        "probing error of form: range of the distances from the centre of the least-squares sphere",
        max(fit.form for fit in fits),
        sphere.u_of_form,
        given.get("form"),
        UNCHECKED,
        FORM_OF_REFERENCE,
    )
    figures, notes = [form], [reading]
    if len(fits) > 1:
        notes.append(
            f"there are {len(fits)} runs of 25 touches: the largest of each test value is reported"
        )
    if tip_diameter is not None or pretravel_map is not None:
        figures.append(_size_figure(fits, sphere, given.get("size")))
    else:
        notes.append("a size error needs the tip's diameter, or a map")
    smallest, largest = _SPHERE_DIAMETERS
    if not smallest <= sphere.diameter <= largest:
        notes.append(
            f"the diameter of this sphere is {sphere.diameter:g} mm; the standard asks, from "
            f"memory, for {smallest:g} to {largest:g} mm (or to 51 mm, with a 2-inch sphere): "
            "check your edition of the standard"
        )
    notes.append(RANGE_AS_DEFINED + ("" if form.u_test is None else U_WITHOUT_NOISE))
    sets = tuple(
        FittedSet(f"run {run}", fit, points[rows], form.limit)
        for run, (fit, rows) in enumerate(zip(fits, runs, strict=True), start=1)
    )
    return StandardCheck("ISO 10360-5, single stylus", tuple(figures), sets, tuple(notes))


def _size_figure(
    fits: tuple[SphereFit, ...], sphere: CalibratedSphere, limit: float | None
) -> StandardFigure:
    """The largest size error of all runs."""
    worst = max((2.0 * fit.radius - sphere.diameter for fit in fits), key=abs)
    if abs(worst) > _LARGEST_SIZE_ERROR:
        raise PretravelError(
            f"the diameter of the touched sphere differs by {worst:+.4f} mm from the calibrated "
            f"{sphere.diameter:g} mm: check the two diameters, and that x, y, z are "
            "positions of the tip centre (not of the surface) in mm",
            inputs=("diameter", "tip_diameter"),
        )
    return StandardFigure(
        "P_Size.Sph.1x25:SS:Tact (P_STU in the edition of 2010)",
        "probing error of size: diameter of the least-squares sphere minus the calibrated diameter",
        worst,
        sphere.u_diameter,
        limit,
        UNCHECKED,
        DIAMETER_OF_REFERENCE,
    )


def _angle_of_pattern(directions: FloatArray) -> float:
    """Angle by which the pattern of the touches is rotated about the axis. [rad]

    The standard leaves the azimuth of the pattern to the user. The rings of four determine it.
    """
    ring = np.abs(polar_angle(directions) - 22.5 * DEGREE) < PATTERN_TOLERANCE
    if not ring.any():
        return 0.0
    # Four points 90° apart: their common phase, from the fourth harmonic.
    return float(np.angle(np.mean(np.exp(4j * azimuth_angle(directions[ring]))))) / 4.0


def _runs(touches: Touches, axis: npt.ArrayLike) -> tuple[list[IntArray], str]:
    """The rows of the touches of each run, and a note that states the reading of the pattern.

    The first run has the first touch of each direction, the second run the second touch, and so on.
    """
    angle = _angle_of_pattern(touches.normals @ probe_rotation(axis))
    turned = probe_rotation(axis, angle).T
    readings = [
        _Nearest.of(touches, sphere_pattern_25(cumulative=cumulative) @ turned)
        for cumulative in (False, True)
    ]
    cumulative = readings[1].worst < readings[0].worst
    found = readings[cumulative]
    if found.worst > PATTERN_TOLERANCE:
        row = int(np.argmax(found.off))
        raise PretravelError(
            f"the normal of {touches.where(row)} is {found.worst / DEGREE:.0f}° from the nearest "
            f"direction of the pattern, in both of its forms; {PATTERN_TOLERANCE / DEGREE:.0f}° "
            "is allowed. Either these are not the 25 points of the test, or the given axis is not "
            "the probe's axis",
            inputs=("axis",),
        )
    counts = np.bincount(found.index, minlength=25)
    if counts.min() != counts.max():
        raise PretravelError(
            f"directions of the pattern were touched {counts.min()} to {counts.max()} times; the "
            "test needs each once, or each equally often for several runs"
        )
    order = np.argsort(found.index, kind="stable").reshape(25, -1)
    return [order[:, run] for run in range(order.shape[1])], _READINGS[cumulative]


ISO10360_5 = Standard(
    check_iso10360_5,
    limits=frozenset({"form", "size"}),
    uses=frozenset({"u_diameter", "sphere_form", "map"}),
    patterns={
        "iso10360-5": sphere_pattern_25,
        "iso10360-5-cumulative": partial(sphere_pattern_25, cumulative=True),
    },
)
