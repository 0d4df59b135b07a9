"""Figures of standards for probing performance: ISO 10360-5 and ISO 230-10.

None of this was checked against the texts of the standards: every procedure says of itself
whether it is verified or recalled, and reports repeat it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

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
"""Touches further from the pattern's directions than this are not that pattern."""
_SAME = 3.0 * DEGREE
_RADIUS_MISMATCH = 0.5
EQUATORIAL = 5.0 * DEGREE
"""How far from the equator a touch of the plane test may lie."""


@dataclass(frozen=True)
class Figure:
    """One figure of a standard.

    Attributes
    ----------
    name : str
        As the standard calls it, as far as known.
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
        """By the rule of ISO 14253-1: only outside the uncertainty zone it is a verdict."""
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
    """A standard's figures for touches on a reference sphere.

    Attributes
    ----------
    standard : str
    figures : tuple of Figure
    sets : tuple of SphereFit
        One for each run of the pattern; the figures are the worst of them.
    notes : tuple of str
    """

    standard: str
    figures: tuple[Figure, ...]
    sets: tuple[SphereFit, ...]
    notes: tuple[str, ...]


def _sphere_points(
    touches: Touches, tip_radius: float, pretravel_map: PretravelMap | None
) -> FloatArray:
    """What the machine would call the surface: tip centres, brought in by one radius or a map."""
    if pretravel_map is not None:
        return apply(touches, pretravel_map).positions
    return np.asarray(touches.positions - tip_radius * touches.normals)


def _runs(touches: Touches, directions: FloatArray) -> list[IntArray]:
    """Rows of each run through the directions: first touch of each, then second, ..."""
    nearest = np.argmax(touches.normals @ directions.T, axis=1)
    off = np.arccos(np.clip(np.sum(touches.normals * directions[nearest], axis=1), -1.0, 1.0))
    if off.max() > PATTERN_TOLERANCE:
        row = int(np.argmax(off))
        raise PretravelError(
            f"{touches.where(row)} lies {off[row] / DEGREE:.0f}° from the pattern's nearest "
            f"direction ({PATTERN_TOLERANCE / DEGREE:.0f}° would pass): these are not the 25 "
            "points of the test (pretravel pattern iso10360-5 writes them); is --axis the probe's?"
        )
    counts = np.bincount(nearest, minlength=len(directions))
    if counts.min() != counts.max():
        raise PretravelError(
            f"directions of the pattern were touched {counts.min()} to {counts.max()} times; the "
            "test needs each once (or each equally often, which then are several runs)"
        )
    order = np.argsort(nearest, kind="stable").reshape(len(directions), -1)
    return [order[:, run] for run in range(order.shape[1])]


def check_iso10360_5(
    touches: Touches,
    diameter: float,
    *,
    tip_diameter: float | None = None,
    pretravel_map: PretravelMap | None = None,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    u_diameter: float = 0.0,
    sphere_form: float = 0.0,
    limits: Mapping[str, float] | None = None,
) -> StandardCheck:
    """Single-stylus form and size errors from 25 touches on a sphere.

    Parameters
    ----------
    touches : Touches
        The 25 directions of `sphere_pattern_25` about the axis, once, or each equally often.
    diameter : float
        Calibrated, of the sphere. [mm]
    tip_diameter : float, optional
        Of the tip as the machine uses it (the effective one after qualification); without
        it, and without a map, there is no size error. [mm]
    pretravel_map : PretravelMap, optional
        Compensate with this instead.
    axis : (3,) float
        The probe's +z in the machine frame.
    u_diameter, sphere_form : float
        Standard uncertainty of the diameter, and form error of the sphere. [mm]
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
    the least-squares sphere, size its diameter less the calibrated one. The test value's
    uncertainty after ISO/TS 23165 as recalled: half the sphere's form error, and the
    diameter's calibration.

    >>> n = sphere_pattern_25()
    >>> check = check_iso10360_5(Touches(n * 15.5, n), 25.0, tip_diameter=6.001)
    >>> [(f.name[:6], round(f.value * 1e3, 6) + 0.0) for f in check.figures]
    [('P_Form', 0.0), ('P_Size', -1.0)]
    """
    if not diameter > 0.0:
        raise PretravelError(f"--diameter {diameter:g}: the sphere's diameter is positive, in mm")
    turn = _turn_of_pattern(touches.normals @ probe_rotation(axis))
    runs = _runs(touches, sphere_pattern_25() @ probe_rotation(axis, turn).T)
    radius = 0.0 if tip_diameter is None else 0.5 * tip_diameter
    points = _sphere_points(touches, radius, pretravel_map)
    fits = tuple(fit_sphere(points[rows]) for rows in runs)
    notes = []
    if len(fits) > 1:
        notes.append(f"{len(fits)} runs of 25 touches were found; the worst of them is stated")
    form = max(fit.form for fit in fits)
    given = limits or {}
    figures = [
        Figure(
            "P_Form.Sph.1x25:SS:Tact (P_FTU in the edition of 2010)",
            "largest less smallest distance from the centre of the least-squares sphere",
            form,
            0.5 * sphere_form,
            given.get("form"),
            "recalled",
        )
    ]
    sized = tip_diameter is not None or pretravel_map is not None
    if sized:
        sizes = [2.0 * fit.radius - diameter for fit in fits]
        worst = max(sizes, key=abs)
        if abs(worst) > _RADIUS_MISMATCH:
            raise PretravelError(
                f"the touches lie on a sphere {worst:+.4f} mm off the calibrated "
                f"{diameter:g} mm: check --diameter and --tip-diameter, and that positions are "
                "those of the tip centre in mm"
            )
        figures.append(
            Figure(
                "P_Size.Sph.1x25:SS:Tact (P_STU in the edition of 2010)",
                "diameter of the least-squares sphere less the calibrated one",
                worst,
                u_diameter,
                given.get("size"),
                "recalled",
            )
        )
    else:
        notes.append("no size error without --tip-diameter (or --map)")
    if diameter < 10.0 or diameter > 50.0:
        notes.append(
            f"the test sphere should be of 10 to 50 mm diameter (recalled), this has {diameter:g}"
        )
    return StandardCheck("ISO 10360-5, single stylus", tuple(figures), fits, tuple(notes))


def _turn_of_pattern(inside: FloatArray) -> float:
    """How far the touches' pattern is turned about the axis: rings of four fix that. [rad]

    The standard leaves the azimuth of the pattern to the user.
    """
    ring = np.abs(polar_angle(inside) - 22.5 * DEGREE) < PATTERN_TOLERANCE
    if not ring.any():
        return 0.0
    # Four points 90° apart: their common phase, from the fourth harmonic.
    return float(np.angle(np.mean(np.exp(4j * azimuth_angle(inside[ring]))))) / 4.0


def check_iso230_10(
    touches: Touches,
    diameter: float,
    *,
    tip_diameter: float | None = None,
    pretravel_map: PretravelMap | None = None,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    sphere_form: float = 0.0,
    limits: Mapping[str, float] | None = None,
) -> StandardCheck:
    """Probing tests of machine tools that a reference sphere gives.

    Parameters
    ----------
    touches, diameter, tip_diameter, pretravel_map, axis, sphere_form
        As for `check_iso10360_5`; any directions.
    limits : mapping, optional
        By "form2d", "form3d" and "repeatability". [mm]

    Returns
    -------
    StandardCheck

    Raises
    ------
    PretravelError
        Touches that serve none of the tests.

    Notes
    -----
    Recalled, not verified: P_FTU,2D is the range of distances from the centre of the
    least-squares circle through touches on the equator (36 in the standard), P_FTU,3D
    the same of a sphere over the hemisphere (25), and single-point repeatability the
    range of repeats in one direction (10). Tool location, and tests of the workpiece's
    position, need other touches and are not made.
    """
    rotation = probe_rotation(axis)
    directions = touches.normals @ rotation
    polar = polar_angle(directions)
    radius = 0.0 if tip_diameter is None else 0.5 * tip_diameter
    points = _sphere_points(touches, radius, pretravel_map) @ rotation
    given, notes = limits or {}, []
    figures: list[Figure] = []
    fits: list[SphereFit] = []
    flat = np.abs(polar - 90.0 * DEGREE) <= EQUATORIAL
    u_form = 0.5 * sphere_form
    if flat.sum() >= 8:
        circle = fit_sphere(points[flat, :2])
        fits.append(circle)
        figures.append(
            Figure(
                "P_FTU,2D",
                f"range of distances from the least-squares circle, {int(flat.sum())} touches",
                circle.form,
                u_form,
                given.get("form2d"),
                "recalled",
            )
        )
        if flat.sum() < 36:
            notes.append(f"P_FTU,2D has 36 touches as recalled, these are {int(flat.sum())}")
    else:
        notes.append(f"P_FTU,2D needs touches on the equator; there are {int(flat.sum())}")
    if np.ptp(polar) > 45.0 * DEGREE and len(touches) >= 9:
        sphere = fit_sphere(points)
        fits.append(sphere)
        figures.append(
            Figure(
                "P_FTU,3D",
                f"range of distances from the least-squares sphere, {len(touches)} touches",
                sphere.form,
                u_form,
                given.get("form3d"),
                "recalled",
            )
        )
        if len(touches) != 25:
            notes.append(f"P_FTU,3D has 25 touches as recalled, these are {len(touches)}")
    ranges, most = _repeat_ranges(touches)
    if ranges:
        figures.append(
            Figure(
                "R_SPT",
                f"largest range of repeats in one direction, up to {most} touches",
                max(ranges),
                0.0,
                given.get("repeatability"),
                "recalled",
            )
        )
        if most != 10:
            notes.append(f"R_SPT has 10 repeats as recalled, these are up to {most}")
    else:
        notes.append("no direction was repeated, so there is no single-point repeatability")
    if not figures:
        raise PretravelError("these touches serve none of the tests: " + "; ".join(notes))
    if tip_diameter is not None and fits and abs(2.0 * fits[-1].radius - diameter) > 1.0:
        raise PretravelError(
            f"the touches lie on a sphere of {2.0 * fits[-1].radius:.4f} mm, not of "
            f"{diameter:g} mm: check --diameter and --tip-diameter"
        )
    return StandardCheck("ISO 230-10, probing", tuple(figures), tuple(fits), tuple(notes))


def _repeat_ranges(touches: Touches) -> tuple[list[float], int]:
    """Range along the normal of each direction that was repeated, and the most repeats."""
    ranges, most = [], 0
    left = np.arange(len(touches))
    while len(left):
        same = touches.normals[left] @ touches.normals[left[0]] > math.cos(_SAME / 30.0)
        rows = left[same]
        if len(rows) > 1:
            along = touches.positions[rows] @ unit(touches.normals[rows].mean(axis=0))
            ranges.append(float(np.ptp(along)))
            most = max(most, len(rows))
        left = left[~same]
    return ranges, most


CHECKS: Mapping[str, Callable[..., StandardCheck]] = {
    "iso10360-5": check_iso10360_5,
    "iso230-10": check_iso230_10,
}
"""By the name of the command line."""


def plane_pattern_36() -> FloatArray:
    """36 directions on the equator, 10° apart (ISO 230-10 as recalled), (36, 3).

    >>> plane_pattern_36().shape
    (36, 3)
    """
    azimuth = np.arange(36) * 10.0 * DEGREE
    return np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(36)], axis=1)


PATTERNS = {"iso10360-5": sphere_pattern_25, "iso230-10": plane_pattern_36}
"""Directions of touches by the name of the command line."""
