"""Pictures of measured features: residuals before and after compensation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.drawing.features.measured_feature import MeasuredFeature
from pretravel.drawing.tasks.measure.lines import VERDICT_SIGNS, ToleranceLine
from pretravel.drawing.tolerances.tolerances import InspectedFeature
from pretravel.show import (
    Area,
    Axis,
    Chart,
    Colour,
    Dots,
    LineMark,
    Mark,
    PlaneChart,
    PolarChart,
    Rule,
    Scale,
    SpaceChart,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpaceNotes,
    View,
)
from pretravel.uncertainty import across

if TYPE_CHECKING:
    from pretravel.surface import Face, Part

_MOST_CHARTS = 12
_NEARLY = np.cos(np.radians(1.0))  # nearer to an axis than this: it has the name of the axis
_GAP = 0.5 * np.pi  # a larger one between the first and the last point is not closed by a line


def features_view(features: Sequence[InspectedFeature], title: str = "") -> View:
    """Distances of the points from the compensated feature, with the tolerance.

    Returns
    -------
    View
        A chart for each of the first twelve features. Features of revolution are seen along their
        axis; planes and lines along their longest extent.
    """
    shown = features[:_MOST_CHARTS]
    more = f" (the first {len(shown)} of {len(features)})" if len(features) > len(shown) else ""
    charts: list[Chart] = [
        _straight(one) if one.feature.kind in ("plane", "line", "slot") else _round(one)
        for one in shown
    ]
    return View(f"{title}{more}", tuple(charts))


_ELEVATION, _AZIMUTH = 35.0, -55.0
_POLE = 0.12  # height of a flag, of the size of the part
_SIDEWAYS = 0.2  # largest mean of the normals of a feature that is seen from all sides
_ROUND = ("circle", "bore", "boss", "cylinder", "cone", "torus")
_NEAREST = 3
"""Touches of a face that give the colour of a place on it."""


def verdicts_view(
    part: Part,
    features: Sequence[InspectedFeature],
    lines: Sequence[ToleranceLine],
) -> View:
    """The part, its faces coloured by the deviations of their touches, with a flag at each feature.

    Parameters
    ----------
    part : Part
    features : sequence of InspectedFeature
        With the faces of their points.
    lines : sequence of ToleranceLine
        The worst one gives a feature its sign.
    """
    from pretravel.show import body_marks

    touched: dict[int, list[tuple[FloatArray, FloatArray]]] = {}
    for each in features:
        points = each.feature.points
        if points.face is None or points.deviation is None:
            continue
        for number in np.unique(points.face).tolist():
            mine = points.face == number
            row = (points.positions[mine], points.deviation[mine] / MICROMETRE)
            touched.setdefault(number, []).append(row)
    every = [values for rows in touched.values() for _, values in rows]
    marks: list[SpaceMark] = [
        *_untouched(part, touched),
        *(
            _coloured(face, len(part.faces), touched[face.number])
            for face in part.faces if face.number in touched
        ),
        *body_marks(part, opacity=0.0)[1:],
    ]  # fmt: skip
    scale = Scale.of("deviation", "µm", np.concatenate(every or [np.zeros(1)]), signed=True)
    marks += _flags(part, features, lines)
    chart = SpaceChart(
        "Deviations of the touched faces", tuple(marks), "part", scale=scale,
        elevation=_ELEVATION, azimuth=_AZIMUTH, bare=True,
    )  # fmt: skip
    return View("", (chart,))


def _untouched(part: Part, touched: Mapping[int, object]) -> list[SpaceMark]:
    """The faces that were not touched, and their edges."""
    from pretravel.show import body_marks

    rest = tuple(face for face in part.faces if face.number not in touched)
    marks = body_marks(replace(part, faces=rest, chosen=()), opacity=1.0)
    return [
        replace(mark, name="not touched") if isinstance(mark, SpaceMesh) else mark for mark in marks
    ]


def _coloured(face: Face, count: int, rows: Sequence[tuple[FloatArray, FloatArray]]) -> SpaceMesh:
    """A face with the deviations of its nearest touches, weighted by their distance."""
    from pretravel.surface import face_triangles

    shown = face_triangles(face, faces=count)
    places = np.vstack([places for places, _ in rows])
    values = np.concatenate([values for _, values in rows])
    away = np.linalg.norm(shown.points[:, None] - places[None], axis=2)
    near = np.argsort(away, axis=1)[:, :_NEAREST]
    weight = 1.0 / (np.take_along_axis(away, near, axis=1) ** 2 + 1e-6)
    found = np.sum(weight * values[near], axis=1) / np.sum(weight, axis=1)
    return SpaceMesh(shown.points, shown.corners, values=found)


def _flags(
    part: Part, features: Sequence[InspectedFeature], lines: Sequence[ToleranceLine]
) -> list[SpaceMark]:
    """The name of each feature that is seen, with the sign of its worst verdict."""
    elevation, azimuth = np.radians([_ELEVATION, _AZIMUTH])
    eye = np.array([
        np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
    ])  # fmt: skip
    found: dict[Colour, list[tuple[FloatArray, FloatArray, str]]] = {}
    for each in features:
        feature = each.feature
        own = [line for line in lines if feature.label in line.feature.split(", ")]
        direction = _towards(feature, eye)
        if direction @ eye < 0.0 and not (own and own[0].level in _ALWAYS):
            continue
        foot = _foot(part, feature, direction)
        tip = foot + _POLE * part.size * direction
        sign = f"{VERDICT_SIGNS[own[0].level]} " if own else ""
        colour: Colour = _FLAGS[own[0].level] if own else "ink"
        found.setdefault(colour, []).append((foot, tip, f"{sign}{feature.label}"))
    if sum(map(len, found.values())) > _MOST_FLAGS and len(found) > 1:
        found.pop("ink", None)  # names of what conforms would hide the others
    marks: list[SpaceMark] = []
    for colour, rows in found.items():
        feet, tips, words = (list(each) for each in zip(*rows, strict=True))
        marks.append(SpaceLines(np.array(feet), np.array(tips), colour=colour, width=1.2))
        marks.append(SpaceNotes(np.array(tips), tuple(f" {word}" for word in words), colour))
    return marks


def _towards(feature: MeasuredFeature, eye: FloatArray) -> FloatArray:
    """Where the flag of a feature goes: out of a face, along the axis of what is round."""
    axis, normals = feature.association.direction, feature.points.normals
    if feature.kind in _ROUND and axis is not None:
        return axis if axis @ eye > 0.0 else -axis
    mean = normals.mean(axis=0)
    size = float(np.linalg.norm(mean))
    return np.array([0.0, 0.0, 1.0]) if size <= _SIDEWAYS else mean / size


def _foot(part: Part, feature: MeasuredFeature, direction: FloatArray) -> FloatArray:
    """In the middle of its touches; of what is round at the end of its faces that is seen."""
    from pretravel.surface import face_triangles

    middle = feature.points.positions.mean(axis=0)
    own = feature.points.face
    if feature.kind not in _ROUND or own is None:
        return np.asarray(middle)
    shown = [
        face_triangles(face, faces=len(part.faces)).points
        for face in part.faces if face.number in own
    ]  # fmt: skip
    above = max((float(((points - middle) @ direction).max()) for points in shown), default=0.0)
    return np.asarray(middle + above * direction)


_MOST_FLAGS = 8
"""Flags that have room on a part; of more, those that conform have none."""
_ALWAYS = ("bad", "caution")
"""What fails has its flag on faces that are not seen, too."""
_FLAGS: Mapping[str, Colour] = {"bad": "limit", "caution": "series2", "good": "ink"}


def _deviations(feature: MeasuredFeature) -> tuple[FloatArray, FloatArray | None]:
    """Of compensated and uncompensated points from the compensated feature. [µm]"""
    found = feature.association
    after = found.residuals / MICROMETRE
    if feature.uncompensated is None:
        return after, None
    moved = np.sum((feature.uncompensated.points - found.points) * found.outward, axis=1)
    return after, after + moved / MICROMETRE


def _zone(inspected: InspectedFeature) -> tuple[float, float, str] | None:
    """The tolerance as deviations from the compensated feature. [µm]"""
    feature = inspected.feature
    for conformity in inspected.conformities:
        if conformity.name == feature.size_name and math.isfinite(
            conformity.lower + conformity.upper
        ):
            slant = (
                1.0
                if feature.association.half_angle is None
                else math.cos(feature.association.half_angle)
            )
            ends = (0.5 * slant * (x - conformity.value) / MICROMETRE
                    for x in (conformity.lower, conformity.upper))  # fmt: skip
            return (*ends, f"tolerance of the {conformity.name}")  # type: ignore[return-value]
    for conformity in inspected.conformities:
        if conformity.name == feature.form_name:
            residuals = feature.association.residuals / MICROMETRE
            middle, half = 0.5 * (residuals.max() + residuals.min()), 0.5 * conformity.upper
            return (
                middle - half / MICROMETRE,
                middle + half / MICROMETRE,
                f"tolerance of {conformity.name}",
            )
    return None


def _round(inspected: InspectedFeature) -> PolarChart:
    feature = inspected.feature
    found = feature.association
    direction = np.array([0.0, 0.0, 1.0]) if found.direction is None else found.direction
    first, second = _upright(direction)
    offset = found.points - found.point
    angle = np.arctan2(offset @ second, offset @ first)
    after, before = _deviations(feature)
    zone = _zone(inspected)
    everything = [after, np.zeros(1)] + ([] if before is None else [before])
    everything += [np.array(zone[:2])] if zone else []
    low = min(float(part.min()) for part in everything)
    high = max(float(part.max()) for part in everything)
    span = max(high - low, 1e-3)
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    marks: list[LineMark | Dots | Area | Rule] = []
    if zone:
        low_edge, high_edge = (np.full(len(circle), end) for end in zone[:2])
        marks.append(Area(circle, low_edge, high_edge, zone[2], "zone"))
    marks.append(Rule(0.0, _rule_name(feature)))
    order = np.argsort(angle)
    labels = _labels(feature)
    one_ring = feature.kind in ("circle", "bore", "boss")
    closed = np.append(order, order[0]) if 2.0 * np.pi - np.ptp(angle) < _GAP else order
    for name, values, colour in _before_after(before, after):
        if one_ring:
            marks.append(_ring_line(angle[closed], values[closed], colour))
        marks.append(Dots(angle, values, name, colour, size=3.5, labels=labels))
    return PolarChart(
        f"{feature.label or feature.kind}: deviation, seen along its axis",
        Axis(
            "deviation from the fit to the compensated points",
            "µm",
            low - 0.9 * span,
            high + 0.1 * span,
        ),
        tuple(marks),
        "",
        directions=(_axis_name(first), _axis_name(second)),
    )


def _before_after(
    before: FloatArray | None, after: FloatArray
) -> list[tuple[str, FloatArray, Colour]]:
    shown: list[tuple[str, FloatArray, Colour]] = [("compensated", after, "after")]
    return shown if before is None else [("uncompensated", before, "before"), *shown]


def _rule_name(feature: MeasuredFeature) -> str:
    """What the line of no deviation is."""
    return feature.association.criterion if feature.is_extreme else "least squares"


def _labels(feature: MeasuredFeature) -> tuple[str, ...]:
    count = len(feature.association.points)
    given = feature.points.labels if len(feature.points.labels) == count else ("",) * count
    return tuple(name or f"point {row + 1}" for row, name in enumerate(given))


def _ring_line(angle: FloatArray, values: FloatArray, colour: Colour) -> LineMark:
    """A thin line from point to point, as an arc where a chord would cut across."""
    turn = np.unwrap(angle)
    fine = np.arange(turn[0], turn[-1], np.radians(2.0))
    return LineMark(fine, np.interp(fine, turn, values), "", colour, 0.8)


def _axis_name(direction: FloatArray) -> str:
    """The axis that a direction points along; words where it is oblique.

    >>> _axis_name(np.array([0.0, 0.0, -1.0]))
    '-Z'
    """
    index = int(np.argmax(np.abs(direction)))
    sign = "+" if direction[index] > 0.0 else "-"
    near = "" if abs(float(direction[index])) > _NEARLY else "about "
    return f"{near}{sign}{'XYZ'[index]}"


def _upright(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two directions across an axis; x and y where it is along z."""
    x = np.array([1.0, 0.0, 0.0]) - direction[0] * direction
    if np.linalg.norm(x) < 0.1:
        first, second = across(direction)
        return first, second
    first = x / np.linalg.norm(x)
    second = np.cross(direction, first)
    return first, second * (1.0 if second[int(np.argmax(np.abs(second)))] > 0.0 else -1.0)


def _straight(inspected: InspectedFeature) -> PlaneChart:
    feature = inspected.feature
    points = feature.association.points
    centred = points - points.mean(axis=0)
    direction = np.linalg.svd(centred, full_matrices=False)[2][0]
    direction = direction * (1.0 if direction[int(np.argmax(np.abs(direction)))] > 0.0 else -1.0)
    along = centred @ direction
    order = np.argsort(along)
    after, before = _deviations(feature)
    zone = _zone(inspected)
    marks: list[Mark] = []
    if zone:
        ends = along[order][[0, -1]]
        low_edge, high_edge = (np.full(2, end) for end in zone[:2])
        marks.append(Area(ends, low_edge, high_edge, zone[2], "zone"))
    marks.append(Rule(0.0, _rule_name(feature)))
    labels = _labels(feature)
    for name, values, colour in _before_after(before, after):
        if feature.kind == "line":
            marks.append(LineMark(along[order], values[order], "", colour, 0.8))
        marks.append(Dots(along, values, name, colour, size=4.0, labels=labels))
    return PlaneChart(
        f"{feature.label or feature.kind}: deviation",
        Axis(f"along its longest extent, towards {_axis_name(direction)}", "mm"),
        Axis("deviation", "µm"),
        tuple(marks),
    )


def feature_view(feature: MeasuredFeature) -> View:
    """The picture of one feature without tolerances."""
    return features_view([InspectedFeature(feature, ())])
