"""The stylus-tip offset of a machine's probe after ISO 230-10, clause 6.3.

That the clause is the test of the stylus-tip offset is public; how it is made and what its figures
are called is not checked against its text: every figure states it, and reports repeat it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, FloatArray, IntArray, PretravelError, polar_angle, probe_rotation
from pretravel.laboratory.standards.iso230_10 import PLANE_TOLERANCE, check_diameter
from pretravel.laboratory.standards.standard_check import (
    ALONG_Z,
    UNCHECKED,
    CalibratedSphere,
    FittedSet,
    Standard,
    StandardCheck,
    StandardFigure,
    refuse_other_unit,
)
from pretravel.laboratory.standards.tip_offset import TipOffset, fit_tip_offset, turns_the_other_way
from pretravel.maps import PretravelMap
from pretravel.touches import Touches
from pretravel.uncertainty import Component, SphereFit, fit_sphere

_SAME_ORIENTATION = 0.01  # ° of the spindle
_SAME_DIRECTION = 2.0 * DEGREE
_RELEVANT, _BY_CHANCE = 1e-3, 0.05
"""Share of a variance that matters; probability of residuals beyond the repeats by chance."""
_FEWEST, _ENOUGH = 4, 8
"""Directions of a circle: with fewer than eight, lobes of three count as an offset."""


def check_tip_offset(
    touches: Touches,
    sphere: CalibratedSphere,
    *,
    tip_diameter: float | None = None,
    pretravel_map: PretravelMap | None = None,
    axis: npt.ArrayLike = ALONG_Z,
    limits: Mapping[str, float] | None = None,
) -> StandardCheck:
    """Determine the offset of the tip from the axis of the spindle, and its run-out.

    Parameters
    ----------
    touches : Touches
        On the equator of a sphere or in a ring, in the same directions at two or more
        orientations of the spindle, best 0° and 180°; they state these orientations. Each once,
        or each equally often for several runs.
    sphere : CalibratedSphere
        Of the ring its diameter. It does not enter the result.
    tip_diameter : float, optional
        It does not enter the result; with it the diameter of the circles is checked. [mm]
    pretravel_map : PretravelMap, optional
        Refused: the probe is turned, and its map is not.
    axis : (3,) float
        The probe's +z in the machine frame.
    limits : mapping, optional
        By "offset" and "repeatability". [mm]

    Returns
    -------
    StandardCheck
        Its `tip_offset` is from the axis of the spindle to the tip, with the spindle at 0.

    Raises
    ------
    PretravelError
        Touches that do not state the orientations, or too few; a map.

    Notes
    -----
    The machine reports the axis of the spindle. The centre of one circle is found at its place
    less the offset, which turns with the spindle (`pretravel.laboratory.standards.tip_offset`);
    place and form of the reference cancel. What the machine sees as an offset contains the part of
    the pretravel that shifts a circle's centre, which turns as well.

    >>> from pretravel.laboratory.standards.iso230_10 import plane_pattern_36
    >>> n = plane_pattern_36()
    >>> positions = np.vstack([n * 15.5 - [0.004, 0.003, 0.0], n * 15.5 + [0.004, 0.003, 0.0]])
    >>> turned = Touches(positions, np.vstack([n, n]), spindle=np.repeat([0.0, math.pi], 36))
    >>> check = check_tip_offset(turned, CalibratedSphere(25.0))
    >>> [(f.name, round(f.value * 1e3, 6)) for f in check.figures[:3]]
    [('tip offset, x', 4.0), ('tip offset, y', 3.0), ('tip offset', 5.0)]
    """
    if pretravel_map is not None:
        raise PretravelError(
            "a map holds for one orientation of the spindle, and this test turns the spindle; "
            "the stylus-tip offset follows from the touches as the machine reports them: leave "
            "the map out",
            inputs=("map",),
        )
    refuse_other_unit(touches, sphere)
    circles, notes = _circles(touches, axis)
    if tip_diameter is not None:
        inwards = points_inwards(touches)
        for fit in circles.fits:
            off = tip_diameter if inwards else -tip_diameter
            check_diameter(2.0 * fit.radius + off, sphere.diameter)
    found = fit_tip_offset(circles.angles, np.array([fit.center for fit in circles.fits]))
    if turns_the_other_way(found):
        notes.append(
            "the centres fit an offset that turns the other way: if the angles are counted "
            "clockwise, seen from the spindle, give them with the other sign"
        )
    if len(circles.angles) == 2:
        notes.append(
            "two orientations do not check the offset: four (0°, 90°, 180°, 270°) or repeats show "
            "errors that do not turn with the spindle"
        )
    sets = tuple(
        FittedSet(f"spindle at {angle / DEGREE:g}°", fit, places, frame="probe")
        for angle, fit, places in zip(circles.angles, circles.fits, circles.means, strict=True)
    )
    figures = _figures(circles, found, limits or {})
    name = "ISO 230-10, stylus-tip offset"
    return StandardCheck(name, figures, sets, tuple(notes), tip_offset=found)


def points_inwards(touches: Touches) -> bool:
    """Whether the touches are in a ring, whose outward normals point to its middle."""
    offset = touches.positions - touches.positions.mean(axis=0)
    return bool(np.sum(offset * touches.normals) < 0.0)


@dataclass(frozen=True, eq=False)
class _Circles:
    """Touches of the same directions at each orientation of the spindle.

    Attributes
    ----------
    angles : (k,) float
        [rad]
    places : (k, runs, directions, 2) float
        Spindle points across the probe's axis. [mm]
    fits : tuple of SphereFit
        Of each orientation, through the means of the runs.
    """

    angles: FloatArray
    places: FloatArray
    fits: tuple[SphereFit, ...]

    @property
    def runs(self) -> int:
        return int(self.places.shape[1])

    @property
    def means(self) -> FloatArray:
        """Of the runs, (k, directions, 2). [mm]"""
        return np.asarray(self.places.mean(axis=1))

    def scatter(self) -> tuple[float, float]:
        """Variance of a touch along its direction, and its degrees of freedom. [mm²]

        Of repeats where there are some; else of the residuals of the circles, which contain the
        probe's lobes and the form of the reference too.
        """
        if self.runs > 1:
            outward = self.means - np.array([fit.center for fit in self.fits])[:, None]
            outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
            off = np.sum((self.places - self.means[:, None]) * outward[:, None], axis=-1)
            dof = off.size - off.shape[0] * off.shape[2]
            return float(np.sum(off**2)) / dof, float(dof)
        dof = sum(fit.dof for fit in self.fits)
        return sum(float(np.sum(fit.residuals**2)) for fit in self.fits) / dof, float(dof)

    @cached_property
    def offsets(self) -> FloatArray:
        """The offset of each run, (runs, 2). [mm]"""
        return np.array(
            [
                fit_tip_offset(
                    self.angles, np.array([fit_sphere(places).center for places in run])
                ).offset
                for run in np.moveaxis(self.places, 1, 0)
            ]
        )


def _circles(touches: Touches, axis: npt.ArrayLike) -> tuple[_Circles, list[str]]:
    """Touches by orientation, run and direction, and notes of what was left out."""
    if touches.spindle is None:
        raise PretravelError(
            "the touches do not say at which orientation of the spindle they were made: add a "
            "column spindle_deg, or give the orientation of each file",
            inputs=("spindle",),
        )
    rotation, notes = probe_rotation(axis), []
    polar = polar_angle(touches.normals @ rotation)
    equator = np.flatnonzero(np.abs(polar - 90.0 * DEGREE) <= PLANE_TOLERANCE)
    if len(equator) < len(touches):
        count = len(touches) - len(equator)
        notes.append(f"{count} touches off the equator are not used")
    steps = np.round(touches.spindle[equator] / DEGREE / _SAME_ORIENTATION)
    steps %= round(360.0 / _SAME_ORIENTATION)
    turns, of_turn = np.unique(steps, return_inverse=True)
    directions = _grouped(touches.normals[equator])
    cells = [
        [equator[(of_turn == turn) & (directions == one)] for turn in range(len(turns))]
        for one in range(int(directions.max(initial=-1)) + 1)
    ]
    complete = [rows for rows in cells if all(len(row) for row in rows)]
    if len(complete) < _FEWEST:
        raise PretravelError(
            f"{len(complete)} directions across the axis were touched at each of the {len(turns)} "
            f"orientations of the spindle; {_FEWEST} are needed, the same at each",
            inputs=("axis",),
        )
    runs = min(len(row) for rows in complete for row in rows)
    table = np.array([[row[:runs] for row in rows] for rows in complete])
    if table.size < len(equator):
        notes.append(
            f"{len(equator) - table.size} touches have no partner at another orientation or in "
            "another run, and are not used"
        )
    if len(complete) < _ENOUGH:
        notes.append(
            f"with {len(complete)} directions a part of the probe's lobes counts as an offset; "
            f"{_ENOUGH} or more separate lobes and offset"
        )
    points = (touches.positions @ rotation)[:, :2]
    places = points[np.transpose(table, (1, 2, 0))]
    fits = tuple(fit_sphere(single) for single in places.mean(axis=1))
    return _Circles(turns * _SAME_ORIENTATION * DEGREE, places, fits), notes


def _grouped(normals: FloatArray) -> IntArray:
    """The direction of each touch, by number; touches within the tolerance have one."""
    numbers = np.full(len(normals), -1)
    count = 0
    while (numbers < 0).any():
        first = normals[int(np.argmax(numbers < 0))]
        same = (numbers < 0) & (normals @ first > math.cos(_SAME_DIRECTION))
        numbers[same] = count
        count += 1
    return numbers


def _components(circles: _Circles, found: TipOffset) -> list[tuple[str, FloatArray, float]]:
    """Sources of the offset's uncertainty: name, covariance (2, 2) [mm²], degrees of freedom."""
    variance, dof = circles.scatter()
    of_centers = [variance / circles.runs * fit.cofactor[:2, :2] for fit in circles.fits]
    by_touches = found.covariance(of_centers)
    sources = [("scatter of the touches", by_touches, dof)]
    if found.dof > 0:
        expected = float(np.mean([np.trace(single) for single in of_centers])) / 2.0
        beyond = max(float(np.sum(found.residuals**2)) / found.dof - expected, 0.0)
        moved = found.covariance([beyond * np.eye(2)] * len(found.angles))
        sources.append(("what does not turn with the spindle", moved, float(found.dof)))
    if circles.runs > 1:
        spread = float(np.mean(np.var(circles.offsets, axis=0, ddof=1))) / circles.runs
        beyond = max(spread - float(np.trace(by_touches)) / 2.0, 0.0)
        sources.append(
            ("differences between the runs", beyond * np.eye(2), 2.0 * (circles.runs - 1))
        )
        by_lobes = _by_lobes(circles, found, variance / circles.runs, dof)
        if float(np.trace(by_lobes)) > _RELEVANT * float(np.trace(by_touches)):
            sources.append(("lobes, at unequal steps", by_lobes, math.inf))
    return sources


def _by_lobes(circles: _Circles, found: TipOffset, variance: float, repeats: float) -> FloatArray:
    """Covariance of the offset by three lobes of the probe, (2, 2). [mm²]

    Directions at equal steps, eight or more, separate them from the centre; others do not. Their
    size is that of the residuals beyond the variance of the means, which has the degrees of freedom
    of the repeats; their phase is any, and they turn with the probe.
    """
    from scipy.special import fdtrc

    dof = sum(fit.dof for fit in circles.fits)
    square = sum(float(np.sum(fit.residuals**2)) for fit in circles.fits) / max(dof, 1)
    if fdtrc(max(dof, 1), repeats, square / max(variance, 1e-18)) > _BY_CHANCE:
        return np.zeros((2, 2))
    shifts = []
    for angle, fit, places in zip(circles.angles, circles.fits, circles.means, strict=True):
        outward = places - fit.center
        azimuth = np.arctan2(outward[:, 1], outward[:, 0])
        circle = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.ones(len(azimuth))])
        lobes = np.exp(3j * (azimuth - angle))
        both = np.column_stack([lobes.real, lobes.imag])
        shifts.append((np.linalg.pinv(circle) @ both)[:2])
    moved = found.carried[2:] @ np.vstack(shifts)
    return np.asarray((square - variance) * moved @ moved.T)


def _figures(
    circles: _Circles, found: TipOffset, limits: Mapping[str, float]
) -> tuple[StandardFigure, ...]:
    sources = _components(circles, found)

    def figure(
        name: str, meaning: str, value: float, along: FloatArray, limit: float | None = None
    ) -> StandardFigure:
        parts = tuple(
            Component(source, "A", math.sqrt(max(float(along @ covariance @ along), 0.0)), dof=dof)
            for source, covariance, dof in sources
        )
        u = math.sqrt(math.fsum(part.contribution**2 for part in parts))
        return StandardFigure(name, meaning, value, u, limit, UNCHECKED, "the touches", parts)

    x, y = np.eye(2)
    towards = found.offset / found.size if found.size > 0.0 else x
    beside = "from the axis of the spindle to the tip, along the probe's"
    shown = [
        figure("tip offset, x", f"{beside} x, with the spindle at 0°", float(found.offset[0]), x),
        figure("tip offset, y", f"{beside} y, with the spindle at 0°", float(found.offset[1]), y),
        figure(
            "tip offset",
            f"distance of the tip from the axis of the spindle, {len(circles.angles)} orientations",
            found.size,
            towards,
            limits.get("offset"),
        ),
        figure("run-out of the tip", "twice the offset, as an indicator shows it in a turn",
               2.0 * found.size, 2.0 * towards),
    ]  # fmt: skip
    if circles.runs > 1:
        range_ = float(np.ptp(circles.offsets, axis=0).max())
        meaning = f"larger range of the offset's x and y over {circles.runs} runs"
        limit = limits.get("repeatability")
        shown.append(
            StandardFigure("repeatability of the offset", meaning, range_, 0.0, limit, UNCHECKED)
        )
    return tuple(shown)


ISO230_10_TIP_OFFSET = Standard(
    check_tip_offset,
    limits=frozenset({"offset", "repeatability"}),
    uses=frozenset({"spindle", "ring"}),
)
