"""Pictures of a check: residuals at their places, and the offset of a tip."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, from_angles
from pretravel.laboratory.standards.standard_check import FittedSet, StandardCheck
from pretravel.laboratory.standards.tip_offset import TipOffset
from pretravel.show import (
    Axis,
    Chart,
    Dots,
    LineMark,
    Mark,
    Note,
    PlaneChart,
    PolarChart,
    Rule,
    Scale,
    SpaceChart,
    SpaceLines,
    SpacePoints,
    View,
    azimuth_axis,
    magnification,
    series,
    whiskers,
)


def check_view(check: StandardCheck, title: str = "") -> View:
    """Residuals of the fitted spheres or circles, at the places of their touches.

    Returns
    -------
    View
        The set with the largest range at its places, on a circle or in space (or the tip's offset
        from the axis of the spindle), and the residuals of all sets over the azimuth.
    """
    worst = int(np.argmax([fitted.fit.form for fitted in check.sets]))
    marks: list[Mark] = []
    for index, fitted in enumerate(check.sets):
        fit, residuals = fitted.fit, fitted.fit.residuals / MICROMETRE
        name = f"{fitted.name}, {len(residuals)} touches: range {fit.form / MICROMETRE:.2f} µm"
        azimuth = _azimuth(fitted) / DEGREE
        marks.append(Dots(azimuth, residuals, name, series(index), labels=_labels(fitted)))
    drawn = check.sets[worst]
    marks += [Rule(0.0, colour="ink"), *_limits(drawn)]
    around = PlaneChart(
        "residuals over the azimuth",
        azimuth_axis(drawn.frame),
        Axis("distance − radius", "µm"),
        tuple(marks),
        note="several polar angles may lie at one azimuth",
    )
    place: Chart
    if check.tip_offset is not None:
        place = tip_offset_chart(check.tip_offset)
    elif drawn.places.shape[1] == 2:
        place = _circle_chart(drawn, worst)
    else:
        place = _sphere_chart(drawn)
    return View(title or check.standard, (place, around), columns=2)


def _azimuth(fitted: FittedSet) -> FloatArray:
    """Of the places about the fitted centre, (n,). [rad]"""
    offset = fitted.places - fitted.fit.center
    return np.asarray(np.arctan2(offset[:, 1], offset[:, 0]) % (2.0 * np.pi))


def _labels(fitted: FittedSet) -> tuple[str, ...]:
    return tuple(f"touch {row + 1}" for row in range(len(fitted.places)))


def _limits(fitted: FittedSet) -> list[Rule]:
    """The limit of a set's range, laid about the middle of its residuals."""
    if fitted.limit is None:
        return []
    residuals = fitted.fit.residuals
    middle = 0.5 * float(residuals.max() + residuals.min())
    text = f"largest allowed range ({fitted.name}): {fitted.limit / MICROMETRE:g} µm"
    return [
        Rule((middle + side * 0.5 * fitted.limit) / MICROMETRE, text if side > 0 else "", "limit")
        for side in (-1.0, 1.0)
    ]


def _circle_chart(fitted: FittedSet, index: int) -> PolarChart:
    """Residuals of a circle over the azimuth, seen from the spindle."""
    residuals = fitted.fit.residuals / MICROMETRE
    rules = [Rule(0.0, "fitted circle", "ink"), *_limits(fitted)]
    ends = [*residuals, *(rule.value for rule in rules)]
    span = max(float(np.ptp(ends)), 1e-3)
    return PolarChart(
        f"{fitted.name}: residuals on the circle",
        Axis("distance − radius", "µm", min(ends) - 0.9 * span, max(ends) + 0.1 * span),
        (Dots(_azimuth(fitted), residuals, "touches", series(index), labels=_labels(fitted)),
         *rules),
        fitted.frame,
        note="about the centre of the fitted circle",
    )  # fmt: skip


def _sphere_chart(fitted: FittedSet) -> SpaceChart:
    """Residuals as whiskers on the fitted sphere."""
    fit, offset = fitted.fit, fitted.places - fitted.fit.center
    normals = offset / np.linalg.norm(offset, axis=1)[:, None]
    feet = fit.radius * normals
    factor = magnification(feet, fit.residuals)
    starts, ends = whiskers(feet, normals, factor * fit.residuals)
    residuals = fit.residuals / MICROMETRE
    return SpaceChart(
        f"{fitted.name}: residuals on the sphere",
        (
            _circles(fit.radius),
            SpaceLines(starts, ends, f"residual, magnified {factor:g} times", "ink", 1.4),
            SpacePoints(ends, values=residuals, size=6.0, labels=_labels(fitted)),
        ),
        fitted.frame,
        scale=Scale.of("distance − radius", "µm", residuals, signed=True),
        note="about the centre of the fitted sphere",
    )


def _circles(radius: float) -> SpaceLines:
    """Circles of a sphere at polar angles of 30, 60 and 90 degrees, and four meridians."""
    turn = np.linspace(0.0, 2.0 * np.pi, 61)
    lines = [from_angles(np.full(61, polar * DEGREE), turn) for polar in (30.0, 60.0, 90.0)] + [
        from_angles(turn[:16], np.full(16, azimuth * DEGREE)) for azimuth in range(0, 360, 45)
    ]
    return SpaceLines(
        radius * np.concatenate([line[:-1] for line in lines]),
        radius * np.concatenate([line[1:] for line in lines]),
        "fitted sphere",
        "reference",
        0.7,
    )


def tip_offset_chart(found: TipOffset) -> PlaneChart:
    """The tip off the axis of the spindle, as each orientation shows it.

    Returns
    -------
    PlaneChart
        Centres of a circle that turn with the spindle, across the probe's axis, seen from the
        spindle, which is at zero.
    """
    tips = (found.place - found.centers) / MICROMETRE
    names = tuple(f"spindle at {angle / DEGREE:g}°" for angle in found.angles)
    size = found.size / MICROMETRE
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = size * np.cos(around), size * np.sin(around)
    x, y = found.offset / MICROMETRE
    edge = 1.25 * max(float(np.abs(tips).max()), size, 1e-3)
    return PlaneChart(
        f"offset of the tip from the spindle axis: {size:.2f} µm",
        Axis("x of the probe at 0°", "µm", -edge, edge),
        Axis("y of the probe at 0°", "µm", -edge, edge),
        (
            LineMark(*circle, "offset that turns", "reference"),
            LineMark(np.array([0.0, x]), np.array([0.0, y]), "offset at 0°", "ink"),
            Dots(tips[:, 0], tips[:, 1], "tip as touched", size=7.0, labels=names),
            *(Note(float(tip[0]), float(tip[1]), name.removeprefix("spindle at "))
              for tip, name in zip(tips, names, strict=True)),
        ),
        equal=True,
        note="the axis of the spindle is at 0, 0",
    )  # fmt: skip
