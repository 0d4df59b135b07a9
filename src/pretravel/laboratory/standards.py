"""Probing performance after ISO 10360-5 and ISO 230-10.

None of this was checked against the texts of the standards: every figure states whether its
definition is verified or recalled, and reports repeat it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, IntArray
from pretravel.compensation.compensation import apply
from pretravel.directions import azimuth_angle, polar_angle, sphere_pattern_25, unit
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.touches import Touches
from pretravel.uncertainty.fitting.sphere import SphereFit, fit_sphere
from pretravel.units import DEGREE

PATTERN_TOLERANCE = 10.0 * DEGREE
"""Largest angle between a touch and the nearest direction of the pattern. [rad]"""
PLANE_TOLERANCE = 5.0 * DEGREE
"""Largest angle between the equator and a touch of the plane test. [rad]"""
_SAME_DIRECTION = 0.1 * DEGREE
_LARGEST_SIZE_ERROR = 0.5  # mm
_LARGEST_DIAMETER_DIFFERENCE = 1.0  # mm
_SPHERE_DIAMETERS = (10.0, 50.0)  # mm
_TOUCHES_2D, _FEWEST_2D = 36, 8
_TOUCHES_3D, _FEWEST_3D = 25, 9
_REPEATS = 10
_ORIGIN = "recalled"
_ALONG_Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class CalibratedSphere:
    """The reference sphere of a test.

    Attributes
    ----------
    diameter : float
        [mm]
    u_diameter : float
        Standard uncertainty of the diameter. [mm]
    form : float
        Form error. [mm]
    """

    diameter: float
    u_diameter: float = 0.0
    form: float = 0.0

    def __post_init__(self) -> None:
        if not self.diameter > 0.0:
            raise PretravelError(
                f"the sphere's diameter is {self.diameter:g} mm; it must be positive",
                inputs=("diameter",),
            )

    @property
    def u_of_form(self) -> float:
        """Standard uncertainty of a form error's test value (ISO/TS 23165 as recalled). [mm]"""
        return 0.5 * self.form


@dataclass(frozen=True)
class StandardFigure:
    """One quantity that a standard defines.

    Attributes
    ----------
    name : str
        The name in the standard, as far as known.
    meaning : str
    value : float
        [mm]
    u_test : float
        Standard uncertainty of the test value, from the reference's calibration. [mm]
    limit : float or None
        Maximum permissible error, where one was given. [mm]
    status : str
        ``verified`` or ``recalled``, of the definition used here.
    """

    name: str
    meaning: str
    value: float
    u_test: float
    limit: float | None
    status: str

    @property
    def verdict(self) -> str:
        """By the rule of ISO 14253-1: a verdict needs a value outside the uncertainty zone."""
        if self.limit is None:
            return "no limit given"
        expanded = 2.0 * self.u_test
        if abs(self.value) <= self.limit - expanded:
            return "conforms"
        if abs(self.value) > self.limit + expanded:
            return "does not conform"
        return "undecided within U (k = 2)"


@dataclass(frozen=True, eq=False)
class StandardCheck:
    """The quantities of a standard, from touches on a reference sphere.

    Attributes
    ----------
    standard : str
    figures : tuple of StandardFigure
    sets : tuple of SphereFit
        One for each run of the pattern; the figures state the worst of them.
    notes : tuple of str
    """

    standard: str
    figures: tuple[StandardFigure, ...]
    sets: tuple[SphereFit, ...]
    notes: tuple[str, ...]


def check_iso10360_5(
    touches: Touches,
    sphere: CalibratedSphere,
    *,
    tip_diameter: float | None = None,
    pretravel_map: PretravelMap | None = None,
    axis: npt.ArrayLike = _ALONG_Z,
    limits: Mapping[str, float] | None = None,
) -> StandardCheck:
    """Determine the form and size errors of a single stylus from 25 touches on a sphere.

    Parameters
    ----------
    touches : Touches
        The 25 directions of `sphere_pattern_25` about the axis, once, or each equally often.
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

    Returns
    -------
    StandardCheck

    Raises
    ------
    PretravelError
        Touches that are not the pattern.

    Notes
    -----
    Recalled, not verified: form is the largest less the smallest distance from the centre of
    the least-squares sphere, size its diameter less the calibrated one. The uncertainty of the
    test value follows ISO/TS 23165 as recalled: half the sphere's form error for the form, the
    calibration of the diameter for the size.

    >>> n = sphere_pattern_25()
    >>> check = check_iso10360_5(Touches(n * 15.5, n), CalibratedSphere(25.0), tip_diameter=6.001)
    >>> [(f.name[:6], round(f.value * 1e3, 6) + 0.0) for f in check.figures]
    [('P_Form', 0.0), ('P_Size', -1.0)]
    """
    angle = _angle_of_pattern(touches.normals @ probe_rotation(axis))
    runs = _runs(touches, sphere_pattern_25() @ probe_rotation(axis, angle).T)
    points = _surface_points(touches, tip_diameter, pretravel_map)
    fits = tuple(fit_sphere(points[rows]) for rows in runs)
    given = limits or {}
    form = StandardFigure(
        "P_Form.Sph.1x25:SS:Tact (P_FTU in the edition of 2010)",
        "largest less smallest distance from the centre of the least-squares sphere",
        max(fit.form for fit in fits),
        sphere.u_of_form,
        given.get("form"),
        _ORIGIN,
    )
    figures, notes = [form], []
    if len(fits) > 1:
        notes.append(f"there are {len(fits)} runs of 25 touches; the worst of them is stated")
    if tip_diameter is not None or pretravel_map is not None:
        figures.append(_size_figure(fits, sphere, given.get("size")))
    else:
        notes.append("a size error needs the tip's diameter, or a map")
    smallest, largest = _SPHERE_DIAMETERS
    if not smallest <= sphere.diameter <= largest:
        notes.append(
            f"the test sphere should have a diameter of {smallest:g} to {largest:g} mm (recalled); "
            f"this one has {sphere.diameter:g} mm"
        )
    return StandardCheck("ISO 10360-5, single stylus", tuple(figures), fits, tuple(notes))


def _size_figure(
    fits: tuple[SphereFit, ...], sphere: CalibratedSphere, limit: float | None
) -> StandardFigure:
    """The largest size error of all runs."""
    worst = max((2.0 * fit.radius - sphere.diameter for fit in fits), key=abs)
    if abs(worst) > _LARGEST_SIZE_ERROR:
        raise PretravelError(
            f"the diameter of the touched sphere differs by {worst:+.4f} mm from the calibrated "
            f"{sphere.diameter:g} mm: check the diameters of sphere and tip, and that the "
            "positions are those of the tip centre in mm",
            inputs=("diameter", "tip_diameter"),
        )
    return StandardFigure(
        "P_Size.Sph.1x25:SS:Tact (P_STU in the edition of 2010)",
        "diameter of the least-squares sphere less the calibrated one",
        worst,
        sphere.u_diameter,
        limit,
        _ORIGIN,
    )


def _surface_points(
    touches: Touches, tip_diameter: float | None, pretravel_map: PretravelMap | None
) -> FloatArray:
    """Tip centres moved to the surface, by one radius as a machine does, or by a map, (n, 3)."""
    if pretravel_map is not None:
        return apply(touches, pretravel_map).positions
    return np.asarray(touches.positions - 0.5 * (tip_diameter or 0.0) * touches.normals)


def _angle_of_pattern(directions: FloatArray) -> float:
    """Angle by which the pattern of the touches is rotated about the axis. [rad]

    The standard leaves the azimuth of the pattern to the user. The rings of four determine it.
    """
    ring = np.abs(polar_angle(directions) - 22.5 * DEGREE) < PATTERN_TOLERANCE
    if not ring.any():
        return 0.0
    # Four points 90° apart: their common phase, from the fourth harmonic.
    return float(np.angle(np.mean(np.exp(4j * azimuth_angle(directions[ring]))))) / 4.0


def _runs(touches: Touches, directions: FloatArray) -> list[IntArray]:
    """Rows of each run through the directions: the first touch of each, then the second, …"""
    nearest = np.argmax(touches.normals @ directions.T, axis=1)
    off = np.arccos(np.clip(np.sum(touches.normals * directions[nearest], axis=1), -1.0, 1.0))
    if off.max() > PATTERN_TOLERANCE:
        row = int(np.argmax(off))
        raise PretravelError(
            f"{touches.where(row)} lies {off[row] / DEGREE:.0f}° from the nearest direction of the "
            f"pattern (the tolerance is {PATTERN_TOLERANCE / DEGREE:.0f}°): these are not the 25 "
            "points of the test, or the axis is not that of the probe",
            inputs=("axis",),
        )
    counts = np.bincount(nearest, minlength=len(directions))
    if counts.min() != counts.max():
        raise PretravelError(
            f"directions of the pattern were touched {counts.min()} to {counts.max()} times; the "
            "test needs each once, or each equally often for several runs"
        )
    order = np.argsort(nearest, kind="stable").reshape(len(directions), -1)
    return [order[:, run] for run in range(order.shape[1])]


@dataclass(frozen=True, eq=False)
class _ProbingTest:
    """One test of ISO 230-10: its figure and fit, where the touches allow it, and a note."""

    figure: StandardFigure | None = None
    fit: SphereFit | None = None
    note: str = ""


def check_iso230_10(
    touches: Touches,
    sphere: CalibratedSphere,
    *,
    tip_diameter: float | None = None,
    pretravel_map: PretravelMap | None = None,
    axis: npt.ArrayLike = _ALONG_Z,
    limits: Mapping[str, float] | None = None,
) -> StandardCheck:
    """Determine the probing errors of a machine tool that touches on a sphere allow.

    Parameters
    ----------
    touches, sphere, tip_diameter, pretravel_map, axis
        As for `check_iso10360_5`; any directions.
    limits : mapping, optional
        By "form2d", "form3d" and "repeatability". [mm]

    Returns
    -------
    StandardCheck

    Raises
    ------
    PretravelError
        Touches that allow none of the tests.

    Notes
    -----
    Recalled, not verified: P_FTU,2D is the range of distances from the centre of the
    least-squares circle through touches on the equator (36 in the standard), P_FTU,3D
    the same of a sphere over the hemisphere (25), and single-point repeatability the
    range of repeats in one direction (10). Tool location, and tests of the workpiece's
    position, need other touches and are not evaluated.

    >>> n = sphere_pattern_25()
    >>> check = check_iso230_10(Touches(n * 15.5, n), CalibratedSphere(25.0), tip_diameter=6.0)
    >>> [(f.name, round(f.value * 1e3, 6)) for f in check.figures]
    [('P_FTU,2D', 0.0), ('P_FTU,3D', 0.0)]
    """
    rotation = probe_rotation(axis)
    polar = polar_angle(touches.normals @ rotation)
    points = _surface_points(touches, tip_diameter, pretravel_map) @ rotation
    given = limits or {}
    tests = (
        _plane_form(points, polar, sphere, given.get("form2d")),
        _space_form(points, polar, sphere, given.get("form3d")),
        _single_point_repeatability(touches, given.get("repeatability")),
    )
    figures = tuple(test.figure for test in tests if test.figure is not None)
    fits = tuple(test.fit for test in tests if test.fit is not None)
    notes = tuple(test.note for test in tests if test.note)
    if not figures:
        raise PretravelError("these touches allow none of the tests: " + "; ".join(notes))
    if tip_diameter is not None and fits:
        _check_diameter(2.0 * fits[-1].radius, sphere.diameter)
    return StandardCheck("ISO 230-10, probing", figures, fits, notes)


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
        f"range of distances from the least-squares circle, {count} touches",
        fit.form,
        sphere.u_of_form,
        limit,
        _ORIGIN,
    )
    few = f"P_FTU,2D has {_TOUCHES_2D} touches as recalled; these are {count}"
    return _ProbingTest(figure, fit, few if count < _TOUCHES_2D else "")


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
        f"range of distances from the least-squares sphere, {count} touches",
        fit.form,
        sphere.u_of_form,
        limit,
        _ORIGIN,
    )
    other = f"P_FTU,3D has {_TOUCHES_3D} touches as recalled; these are {count}"
    return _ProbingTest(figure, fit, other if count != _TOUCHES_3D else "")


def _single_point_repeatability(touches: Touches, limit: float | None) -> _ProbingTest:
    """The largest range of repeats in one direction."""
    ranges, most = _repeat_ranges(touches)
    if not ranges:
        return _ProbingTest(
            note="no direction was repeated, so there is no single-point repeatability"
        )
    figure = StandardFigure(
        "R_SPT",
        f"largest range of repeats in one direction, up to {most} touches",
        max(ranges),
        0.0,
        limit,
        _ORIGIN,
    )
    other = f"R_SPT has {_REPEATS} repeats as recalled; these are up to {most}"
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


def _check_diameter(found: float, calibrated: float) -> None:
    if abs(found - calibrated) > _LARGEST_DIAMETER_DIFFERENCE:
        raise PretravelError(
            f"the touches lie on a sphere of {found:.4f} mm, not of {calibrated:g} mm: check the "
            "diameters of sphere and tip",
            inputs=("diameter", "tip_diameter"),
        )


class StandardProcedure(Protocol):
    """The evaluation of a standard."""

    def __call__(
        self,
        touches: Touches,
        sphere: CalibratedSphere,
        *,
        tip_diameter: float | None = None,
        pretravel_map: PretravelMap | None = None,
        axis: npt.ArrayLike = _ALONG_Z,
        limits: Mapping[str, float] | None = None,
    ) -> StandardCheck: ...


CHECKS: Mapping[str, StandardProcedure] = {
    "iso10360-5": check_iso10360_5,
    "iso230-10": check_iso230_10,
}
"""Evaluations by the name of the standard."""


def plane_pattern_36() -> FloatArray:
    """36 directions on the equator, 10° apart (ISO 230-10 as recalled), (36, 3).

    >>> plane_pattern_36().shape
    (36, 3)
    """
    azimuth = np.arange(36) * 10.0 * DEGREE
    return np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(36)], axis=1)


PATTERNS: Mapping[str, Callable[[], FloatArray]] = {
    "iso10360-5": sphere_pattern_25,
    "iso230-10": plane_pattern_36,
}
"""Directions of the touches by the name of the standard."""
