"""The touches that the tolerances of a drawing need: how many, where, in which order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray, PretravelError
from pretravel.drawing.tolerances.drawing_on_part import drawing_on_part
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature
from pretravel.probing import InspectionPlan, InspectionRegion, plan_inspection
from pretravel.surface import Part, face_triangles, feet_on_faces
from pretravel.task import tolerance

SHARE_OF_TOLERANCE = 0.1
"""Of a tolerance that U may be."""
MOST_OF_FEATURE = 60
"""Touches of one feature: more take longer than they help."""
_FEWEST = {"plane": 9, "cylinder": 15, "cone": 15, "sphere": 13, "torus": 15, "slot": 12}
_RINGS = 3
"""Heights at which a cylinder is touched: two show its axis, three its form."""
_PARTS = {"plane": 2.0}
_PART = 2.0 * math.sqrt(2.0)
"""U of a zone for one touch, in U of this touch: a plane moves with the mean of its touches, and a
zone is twice a distance; a diameter or an axis is determined by half of them."""
_AROUND = 8
"""Lines along the stylus that must be free."""
_INSIDE = 1e-3  # how deep a tip may seem to be in another face, by rounding [mm]


@dataclass(frozen=True)
class ReachingStylus:
    """What must reach a touch.

    Attributes
    ----------
    tip_radius, stem_radius : float
        [mm]
    axis : (3,) float
        Direction from the tip to the spindle, in the frame of the part; not normalised.
    """

    tip_radius: float
    stem_radius: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class NeededTouches:
    """The touches of a drawing.

    Attributes
    ----------
    plan : InspectionPlan
        In the order in which they are taken: datums first, each feature along a short way.
    rows : tuple of (str, int, float, float)
        Of each feature: its name, number of touches, U that they give [mm], and the narrowest
        tolerance that needs it; not a number where it has none. [mm]
    warnings : tuple of str
    """

    plan: InspectionPlan
    rows: tuple[tuple[str, int, float, float], ...]
    warnings: tuple[str, ...]


def needed_touches(
    drawing: Drawing, part: Part, stylus: ReachingStylus, u_touch: float, region: InspectionRegion
) -> NeededTouches:
    """Choose the touches that the tolerances of a drawing need.

    Parameters
    ----------
    drawing : Drawing
        With faces.
    part : Part
    stylus : ReachingStylus
    u_touch : float
        Standard uncertainty of one touch. [mm]
    region : InspectionRegion
        Of each face.

    Raises
    ------
    PretravelError
        A feature that states no faces; no touch that the stylus reaches.
    """
    drawing = drawing_on_part(drawing, part)
    widths = _narrowest(drawing)
    pieces, rows, warnings = [], [], []
    last = np.zeros(3)
    for row in _in_order(drawing):
        if not row.faces:
            raise PretravelError(f"feature '{row.name}' has no faces: give them to plan it")
        width = widths.get(row.name, math.nan)
        part_of_u = _PARTS.get(row.kind, _PART)
        few = _FEWEST.get(row.kind, _FEWEST["cylinder"])
        wanted = few if math.isnan(width) else _count(width, part_of_u * u_touch, few)
        found = _touches_of(row, part, wanted, region)
        seen = found if found is None else _at(found, _reached(part, found, stylus))
        if found is None or seen is None or not len(seen):
            warnings.append(f"{row.name}: the stylus reaches no place on it")
            continue
        if len(seen) < len(found):
            hidden = len(found) - len(seen)
            warnings.append(f"{row.name}: {hidden} of {len(found)} places are not reached")
        seen = _along_a_short_way(seen, row, last, np.array(stylus.axis))
        last = seen.point[-1]
        pieces.append(seen)
        expanded = 2.0 * part_of_u * u_touch / math.sqrt(len(seen))
        rows.append((row.name, len(seen), expanded, width))
        if expanded > 1.05 * SHARE_OF_TOLERANCE * width:
            warnings.append(
                f"{row.name}: U is about {1e3 * expanded:.2g} µm, {100 * expanded / width:.0f} % "
                f"of the tolerance of {width:.4g} mm: more touches would take longer than they help"
            )
    if not pieces:
        raise PretravelError("the stylus reaches no place of the features", inputs=("axis",))
    return NeededTouches(_joined(pieces), tuple(rows), tuple(warnings))


def _narrowest(drawing: Drawing) -> dict[str, float]:
    """The narrowest tolerance that needs each feature, also as a datum. [mm]"""
    found: dict[str, float] = {}

    def need(names: Sequence[str], width: float) -> None:
        for name in names:
            found[name] = min(width, found.get(name, math.inf))

    def datums(words: Sequence[str]) -> list[str]:
        return [n for word in words for n in word.replace("(M)", "").split("-")]

    for row in drawing.feature:
        if row.tolerance is not None:
            limits = tolerance(row.tolerance)
            if limits.low is not None and limits.high is not None:
                need([row.name], limits.high - limits.low)
        for width in (row.form_tolerance, row.position_tolerance):
            if width is not None:
                need([row.name], width)
        for one in row.geometric:
            need([row.name, *datums(one.datums)], one.zone)
    for pattern in drawing.pattern:
        need([*pattern.features, *datums(pattern.datums)], pattern.position_tolerance)
    for between in drawing.between:
        limits = tolerance(between.tolerance)
        if between.quantity == "distance" and None not in (limits.low, limits.high):
            assert limits.low is not None
            assert limits.high is not None
            need(between.features, limits.high - limits.low)
    return found


def _in_order(drawing: Drawing) -> list[DrawnFeature]:
    """Datums in the order of the frames, then the others."""
    words = [w for row in drawing.feature for one in row.geometric for w in one.datums]
    words += [w for pattern in drawing.pattern for w in pattern.datums]
    letters = dict.fromkeys(n for w in words for n in w.replace("(M)", "").split("-"))
    rows = {row.name: row for row in drawing.feature}
    first = [rows[name] for name in letters if name in rows]
    needs = set(_narrowest(drawing))
    return first + [row for row in drawing.feature if row not in first and row.name in needs]


def _count(width: float, u: float, few: int) -> int:
    """Touches with which U = 2 u / √n is a tenth of the tolerance."""
    return min(max(few, math.ceil((2.0 * u / (SHARE_OF_TOLERANCE * width)) ** 2)), MOST_OF_FEATURE)


def _touches_of(
    row: DrawnFeature, part: Part, count: int, region: InspectionRegion
) -> InspectionPlan | None:
    """About so many places on the faces of a feature, evenly; None where none is usable."""
    each = math.ceil(count / len(row.faces))
    pieces = []
    for number in row.faces:
        chosen = part.select(str(number))
        face = part.faces[chosen.chosen[0]]
        for more in range(4):  # a face that does not fill its rectangle
            try:
                found = plan_inspection(
                    chosen, grid=_grid(face.kind, each * (1 + more), face.box), region=region
                )
            except PretravelError:
                continue
            if len(found) >= each or more == 3:
                pieces.append(found)
                break
    return _joined(pieces) if pieces else None


def _grid(kind: str, count: int, box: tuple[FloatArray, FloatArray]) -> tuple[int, int]:
    if kind == "plane":
        wide, high = (float(side) for side in box[1] - box[0])
        along = max(2, round(math.sqrt(count * wide / max(high, 1e-9))))
        along = min(along, math.ceil(count / 2))
        return along, max(2, math.ceil(count / along))
    around = math.ceil(count / _RINGS)
    return around + 1 - around % 2, _RINGS  # an odd number shows lobes of an even one, too


def _at(plan: InspectionPlan, rows: BoolArray | IntArray) -> InspectionPlan:
    return replace(
        plan, face=plan.face[rows], uv=plan.uv[rows], point=plan.point[rows],
        normal=plan.normal[rows],
    )  # fmt: skip


def _joined(pieces: Sequence[InspectionPlan]) -> InspectionPlan:
    names = ("face", "uv", "point", "normal")
    left: dict[str, int] = {}
    for piece in pieces:
        for reason, number in piece.left_out.items():
            left[reason] = left.get(reason, 0) + number
    values = {name: np.concatenate([getattr(p, name) for p in pieces]) for name in names}
    return InspectionPlan(**values, left_out=left)


def _reached(part: Part, plan: InspectionPlan, stylus: ReachingStylus) -> BoolArray:
    """Whether the tip finds room at each place, and the stem above it."""
    centres = plan.point + stylus.tip_radius * plan.normal
    room = feet_on_faces(part, centres).distance
    free = room > stylus.tip_radius - _INSIDE
    axis = np.array(stylus.axis) / np.linalg.norm(stylus.axis)
    across = np.linalg.svd(axis[None])[2][1:]
    turn = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    rim = np.vstack([np.zeros(3), stylus.stem_radius * np.column_stack(
        [np.cos(turn), np.sin(turn)]) @ across])  # fmt: skip
    shown = [face_triangles(face, faces=len(part.faces)) for face in part.faces]
    corners = np.concatenate([each.points[each.corners] for each in shown])
    basis = np.vstack([across, axis]).T
    flat = corners @ basis
    for row in np.flatnonzero(free).tolist():
        free[row] = not any(_blocked((centres[row] + each) @ basis, flat) for each in rim)
    return np.asarray(free)


def _blocked(place: FloatArray, corners: FloatArray) -> bool:
    """Whether a triangle is above a place, along the third coordinate."""
    a = corners[:, 0]
    b, c, off = corners[:, 1] - a, corners[:, 2] - a, place - a
    area = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (off[:, 0] * c[:, 1] - off[:, 1] * c[:, 0]) / area
        t = (b[:, 0] * off[:, 1] - b[:, 1] * off[:, 0]) / area
        height = a[:, 2] + s * b[:, 2] + t * c[:, 2]
        return bool(np.any((s >= 0) & (t >= 0) & (s + t <= 1) & (height > place[2] + _INSIDE)))


def _along_a_short_way(
    plan: InspectionPlan, row: DrawnFeature, start: FloatArray, axis: FloatArray
) -> InspectionPlan:
    """From place to nearest place; a round feature ring by ring, from above."""
    left = list(range(len(plan)))
    order: list[int] = []
    here = start
    heights = np.round(plan.point @ (axis / np.linalg.norm(axis)), 3)
    round_ = row.kind not in ("plane", "slot")
    while left:
        top = max(heights[k] for k in left)
        among = [k for k in left if heights[k] == top] if round_ else left
        nearest = min(among, key=lambda k: float(np.linalg.norm(plan.point[k] - here)))
        order.append(nearest)
        left.remove(nearest)
        here = plan.point[nearest]
    return _at(plan, np.array(order, dtype=np.int64))
