"""Measured sizes, places and axes that cannot be those of the drawing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, unit
from pretravel.drawing.features.measured_feature import MeasuredFeature
from pretravel.drawing.tolerances.features_file import DrawnFeature
from pretravel.drawing.tolerances.tolerances import InspectedFeature, is_far_from_nominal

_FEWEST = 3
_CHANCE = 0.005
"""That sizes with independent errors are off alike so much."""
_OF_A_TIP = 0.1
"""Distance along the normals that is not one of pretravel. [mm]"""
_LEAST = 2.0 * MICROMETRE
"""Distance along the normals that a report speaks of. [mm]"""
_OTHER_PLACE = 5.0
"""No feature of a part that is where it was expected is farther from its place. [mm]"""
_NEAR_PLACE, _TIMES_OTHERS, _FEWEST_OTHERS = 0.3, 20.0, 3
"""Distance from its place that is suspect where the others are near theirs. [mm], and times the
largest of these, of which there are as many at least."""
_OTHER_AXIS = 0.2 * DEGREE
"""Faces and bores of a part are perpendicular within 0.1° (ISO 2768-K, 100 mm). [rad]"""
_OPPOSITE = 0.5
_WITH_DIRECTION = ("plane", "cylinder", "cone", "slot", "line")


def far_from_nominal(feature: MeasuredFeature, row: DrawnFeature) -> list[str]:
    """Whether the measured size cannot be that of the drawing; that of a cone at no place can."""
    if row.nominal is None or (feature.kind == "cone" and row.at is None):
        return []
    size = feature.quantity(feature.size_name)
    if not is_far_from_nominal(row.nominal, size.value):
        return []
    said = f"the {size.name} is {size.value:.3f} mm, and the drawing's nominal_mm {row.nominal:g}"
    return [f"{feature.label}: {said}: are these its touches?"]


def far_from_place(
    feature: MeasuredFeature, at: Sequence[float] | None, others: Sequence[float] = ()
) -> list[str]:
    """Whether a feature lies too far from its nominal place to be the one that is meant.

    `others` are the distances of the other features: where these are near, so is this one.
    """
    away = distance_from_place(feature, at)
    limit = _OTHER_PLACE
    if len(others) >= _FEWEST_OTHERS:
        limit = min(limit, max(_NEAR_PLACE, _TIMES_OTHERS * max(others)))
    if away < limit:
        return []
    shown = f"{away:.1f}" if away >= _OTHER_PLACE else f"{away:.3f}"
    said = f"{feature.label or feature.kind} lies {shown} mm from its nominal position"
    near = f", the others {max(others):.3f} mm at most" if away < _OTHER_PLACE else ""
    return [f"{said}{near}: are these its touches, and is the position in the axes of the points?"]


def distance_from_place(feature: MeasuredFeature, at: Sequence[float] | None) -> float:
    """How far a feature lies from its nominal place, in the coordinates that it has. [mm]"""
    known = {each.name: each.value for each in feature.quantities}
    if at is None:
        return 0.0
    return math.hypot(
        *(known[axis] - place for axis, place in zip("xyz", at, strict=True) if axis in known)
    )


def far_from_places(
    features: Mapping[str, MeasuredFeature], places: Mapping[str, Sequence[float] | None]
) -> list[str]:
    """The features of a drawing that are too far from their places, each compared with the others.

    Features that are all away alike have another frame, or a large form: then only those that
    cannot be meant are named.
    """
    away = {name: distance_from_place(own, places[name]) for name, own in features.items()
            if places[name] is not None}  # fmt: skip
    said = []
    for name in away:
        others = sorted(each for other, each in away.items() if other != name)
        # One more of them may be away.
        said += far_from_place(features[name], places[name], others[:-1])
    return said


def other_axes(
    features: Mapping[str, MeasuredFeature], axes: Mapping[str, Sequence[float] | None]
) -> list[str]:
    """The features of a drawing whose measured direction is not the one that is stated."""
    turned, inward = [], []
    for name, own in features.items():
        stated, found = axes[name], own.association.direction
        if stated is None or found is None or own.kind not in _WITH_DIRECTION:
            continue
        wanted = unit(np.asarray(stated, dtype=np.float64))
        off = math.asin(min(float(np.linalg.norm(np.cross(found, wanted))), 1.0))
        if off > _OTHER_AXIS + 3.0 * (own.u_direction or 0.0):
            turned.append(f"{name} by {off / DEGREE:.2g}°")
        if own.kind == "plane" and float(np.mean(own.points.normals @ wanted)) < -_OPPOSITE:
            inward.append(name)
    said = []
    if turned:
        said.append(
            f"measured directions are off the axes in the drawing, {', '.join(turned)}. Is the "
            "part aligned, and are axes and touches those of these features?"
        )
    if inward:
        said.append(
            f"{', '.join(inward)}: the touches have normals against the axis in the drawing, which "
            "points out of the material: one of them is wrong. Compensation takes the tip radius "
            "off along the normals of the touches"
        )
    return said


def sizes_alike(features: Sequence[InspectedFeature]) -> list[str]:
    """A sentence if all sizes, inner and outer ones, differ alike from the middle of their limits.

    An error of the tip's effective radius does this, and a cutter of another radius.

    Parameters
    ----------
    features : sequence of InspectedFeature
        Those with two limits of a size, on a known side, are compared.
    """
    missing: dict[str, float] = {}
    sides = set()
    u = 0.0
    for each in features:
        own = each.feature
        limits = next((c for c in each.conformities if c.name == own.size_name), None)
        if limits is None or not own.side or not math.isfinite(limits.upper - limits.lower):
            continue
        off = 0.5 * (limits.value - 0.5 * (limits.lower + limits.upper))
        missing[own.label or own.kind] = off if own.side == "inside" else -off
        sides.add(own.side)
        u = max(u, own[own.size_name].u)
    if len(missing) < _FEWEST or len(sides) < 2:
        return []
    values = np.array(list(missing.values()))
    mean, spread = float(values.mean()), float(values.std(ddof=1))
    if abs(mean) < max(_LEAST, u) or abs(mean) < _limit(len(values)) * spread:
        return []
    low, high = sorted((abs(values.min()), abs(values.max())))
    what = "less" if mean > 0.0 else "more"
    said = (
        f"{', '.join(missing)}: all surfaces, inner and outer, have {low / MICROMETRE:.1f} to "
        f"{high / MICROMETRE:.1f} µm {what} material than in the middle of their limits"
    )
    if abs(mean) > _OF_A_TIP:
        return [f"{said}: was the radius of the tip that was used subtracted, and only once?"]
    return [
        (
            f"{said}. One cutter can have made them so. If not, the touches are not those of the "
            "map (another stylus, feed or trigger delay), or the diameter of the reference is "
            "wrong: U does not contain this"
        )
    ]


def _limit(count: int) -> float:
    """Mean over spread of independent sizes, which is larger by chance in `_CHANCE` of cases."""
    from scipy.special import stdtrit

    return float(stdtrit(count - 1, 1.0 - 0.5 * _CHANCE)) / math.sqrt(count)
