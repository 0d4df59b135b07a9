"""Probing errors of machine tools after ISO 230-10.

None of this was checked against the text of the standard: every figure states that its definition
is not checked against its text, and reports repeat it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, FloatArray, PretravelError, polar_angle, probe_rotation, unit
from pretravel.laboratory.standards.standard_check import (
    ALONG_Z,
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
from pretravel.uncertainty import fit_sphere

PLANE_TOLERANCE = 5.0 * DEGREE
"""Largest angle between the equator and a touch of the plane test. [rad]"""
_SAME_DIRECTION = 0.1 * DEGREE
_LARGEST_DIAMETER_DIFFERENCE = 1.0  # mm
_TOUCHES_2D, _FEWEST_2D = 36, 8
_TOUCHES_3D, _FEWEST_3D = 25, 9
_REPEATS = 10


@dataclass(frozen=True, eq=False)
class _ProbingTest:
    """One test of ISO 230-10: its figure and set, where the touches allow it, and a note."""

    figure: StandardFigure | None = None
    fitted: FittedSet | None = None
    note: str = ""


def check_iso230_10(
    touches: Touches,
    sphere: CalibratedSphere,
    *,
    tip_diameter: float | None = None,
    pretravel_map: PretravelMap | None = None,
    axis: npt.ArrayLike = ALONG_Z,
    limits: Mapping[str, float] | None = None,
) -> StandardCheck:
    """Determine the probing errors of a machine tool that touches on a sphere allow.

    Parameters
    ----------
    touches, sphere, tip_diameter, pretravel_map, axis
        As for `pretravel.laboratory.standards.iso10360_5.check_iso10360_5`; any directions.
    limits : mapping, optional
        By "form2d", "form3d" and "repeatability". [mm]

    Raises
    ------
    PretravelError
        Touches that allow none of the tests.

    Notes
    -----
    From memory, not compared: P_FTU,2D is the range of distances from the centre of the
    least-squares circle through touches on the equator (36 in the standard), P_FTU,3D
    the same of a sphere over the hemisphere (25), and single-point repeatability the
    range of repeats in one direction (10). Tool location, and tests of the workpiece's
    position, need other touches and are not evaluated.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> check = check_iso230_10(Touches(n * 15.5, n), CalibratedSphere(25.0), tip_diameter=6.0)
    >>> [(f.name, round(f.value * 1e3, 6)) for f in check.figures]
    [('P_FTU,2D', 0.0), ('P_FTU,3D', 0.0)]
    """
    rotation = probe_rotation(axis)
    polar = polar_angle(touches.normals @ rotation)
    refuse_other_unit(touches, sphere)
    refuse_turned_spindle(touches)
    points = surface_points(touches, tip_diameter, pretravel_map) @ rotation
    given = limits or {}
    tests = (
        _plane_form(points, polar, sphere, given.get("form2d")),
        _space_form(points, polar, sphere, given.get("form3d")),
        _single_point_repeatability(touches, given.get("repeatability")),
    )
    figures = tuple(test.figure for test in tests if test.figure is not None)
    sets = tuple(test.fitted for test in tests if test.fitted is not None)
    notes = tuple(test.note for test in tests if test.note)
    if sets:
        notes += (RANGE_AS_DEFINED + ("" if sphere.u_of_form is None else U_WITHOUT_NOISE),)
    if not figures:
        raise PretravelError("these touches allow none of the tests: " + "; ".join(notes))
    if tip_diameter is not None and sets:
        check_diameter(2.0 * sets[-1].fit.radius, sphere.diameter)
    return StandardCheck("ISO 230-10, probing", figures, sets, notes)


def _plane_form(
    points: FloatArray, polar: FloatArray, sphere: CalibratedSphere, limit: float | None
) -> _ProbingTest:
    """The probing error in the plane of the equator."""
    equator = np.abs(polar - 90.0 * DEGREE) <= PLANE_TOLERANCE
    count = int(equator.sum())
    if count < _FEWEST_2D:
        return _ProbingTest(note=f"P_FTU,2D needs touches on the equator; there are {count}")
    fit = fit_sphere(points[equator, :2])
    figure = StandardFigure(
        "P_FTU,2D",
        f"probing error of form in a plane: range about the least-squares circle, {count} touches",
        fit.form,
        sphere.u_of_form,
        limit,
        UNCHECKED,
        FORM_OF_REFERENCE,
    )
    few = f"P_FTU,2D needs {_TOUCHES_2D} touches; there are {count}"
    fitted = FittedSet("circle of P_FTU,2D", fit, points[equator, :2], limit, "probe")
    return _ProbingTest(figure, fitted, few if count < _TOUCHES_2D else "")


def _space_form(
    points: FloatArray, polar: FloatArray, sphere: CalibratedSphere, limit: float | None
) -> _ProbingTest:
    """The probing error over the hemisphere, where the touches cover a part of it."""
    count = len(points)
    if np.ptp(polar) <= 45.0 * DEGREE or count < _FEWEST_3D:
        return _ProbingTest()
    fit = fit_sphere(points)
    figure = StandardFigure(
        "P_FTU,3D",
        f"probing error of form in space: range about the least-squares sphere, {count} touches",
        fit.form,
        sphere.u_of_form,
        limit,
        UNCHECKED,
        FORM_OF_REFERENCE,
    )
    other = f"P_FTU,3D needs {_TOUCHES_3D} touches; there are {count}"
    fitted = FittedSet("sphere of P_FTU,3D", fit, points, limit, "probe")
    return _ProbingTest(figure, fitted, other if count != _TOUCHES_3D else "")


def _single_point_repeatability(touches: Touches, limit: float | None) -> _ProbingTest:
    """The largest range of repeats in one direction."""
    ranges, most = _repeat_ranges(touches)
    if not ranges:
        return _ProbingTest(
            note="no direction was repeated, so there is no single-point repeatability"
        )
    figure = StandardFigure(
        "R_SPT",
        f"single-point repeatability: largest range of up to {most} touches in one direction",
        max(ranges),
        0.0,
        limit,
        UNCHECKED,
    )
    other = (
        f"R_SPT (single-point repeatability) is defined for {_REPEATS} repeats; there are at most "
        f"{most}"
    )
    return _ProbingTest(figure, note=other if most != _REPEATS else "")


def _repeat_ranges(touches: Touches) -> tuple[list[float], int]:
    """Range along the normal of each repeated direction, and the largest number of repeats."""
    ranges, most = [], 0
    left = np.arange(len(touches))
    while len(left):
        same = touches.normals[left] @ touches.normals[left[0]] > math.cos(_SAME_DIRECTION)
        rows = left[same]
        if len(rows) > 1:
            along = touches.positions[rows] @ unit(touches.normals[rows].mean(axis=0))
            ranges.append(float(np.ptp(along)))
            most = max(most, len(rows))
        left = left[~same]
    return ranges, most


def check_diameter(found: float, calibrated: float) -> None:
    """Refuse touches on a sphere or in a ring of another diameter than the reference's. [mm]"""
    if abs(found - calibrated) > _LARGEST_DIAMETER_DIFFERENCE:
        raise PretravelError(
            f"the touches lie on a diameter of {found:.4f} mm, not of {calibrated:g} mm: check the "
            "diameters of reference and tip",
            inputs=("diameter", "tip_diameter"),
        )


def plane_pattern_36() -> FloatArray:
    """36 directions on the equator, 10° apart (ISO 230-10, unchecked), (36, 3).

    >>> plane_pattern_36().shape
    (36, 3)
    """
    azimuth = np.arange(36) * 10.0 * DEGREE
    return np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(36)], axis=1)


ISO230_10 = Standard(
    check_iso230_10,
    limits=frozenset({"form2d", "form3d", "repeatability"}),
    uses=frozenset({"sphere_form", "map"}),
    patterns={"iso230-10": plane_pattern_36},
)
