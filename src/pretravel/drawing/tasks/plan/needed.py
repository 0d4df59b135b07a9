"""The touches that the tolerances of a drawing need: how many, where, in which order."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DEGREE, BoolArray, FloatArray, IntArray, PretravelError
from pretravel.drawing.features.measured_feature import BARE_SURFACE
from pretravel.drawing.inspection import InspectionPlan, InspectionRegion, plan_inspection
from pretravel.drawing.tolerances.drawing_on_part import drawing_on_part
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature
from pretravel.drawing.tolerances.tolerance_text import ToleranceText
from pretravel.measurement import associate
from pretravel.surface import Face, Part, feet_on_faces
from pretravel.uncertainty import across

if TYPE_CHECKING:
    from pretravel.files import Machine

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
_BESIDE_MARGIN = 1.001  # of a margin: its end itself counts as nearer than it
_MORE_PLACES = (1, 2, 3, 4, 8, 16, 32)
"""How many times more places than wanted are tried on the rectangle of a face."""
_FEW_TRIES = (1, 2, 8)  # for a direction that is only named
_IN_A_ROW = 0.02  # of the largest extent: less across it is a row, or a ring
_MOST_HIDDEN = 3  # times the places of which none is reached: the face is hidden
_MOST_OVER = 2  # times the wanted places of a round face are kept: it has whole rings
_SAME_AXIS = 0.9999  # cosine: less than one degree apart
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

    def reaches(self, part: Part, plan: InspectionPlan) -> BoolArray:
        """Whether the tip finds room at each place, and the stem above it, (n,)."""
        return _reached(part, plan, self)


@dataclass(frozen=True)
class ProbeOfMachine:
    """The probe of a machine file, whose body and free ways count as they do in its programs.

    Attributes
    ----------
    machine : Machine
        Its work coordinates are those of the part.
    """

    machine: Machine
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def tip_radius(self) -> float:
        """Radius of the ball. [mm]"""
        return self.machine.tip_radius

    @property
    def stem_radius(self) -> float:
        """Radius of the stylus above it. [mm]"""
        return 0.5 * self.machine.stem_diameter

    def reaches(self, part: Part, plan: InspectionPlan) -> BoolArray:
        """Whether a program of the machine gets to each place, (n,)."""
        from pretravel.controls import PartObstacle, unreached_targets
        from pretravel.touches import Targets

        blocked = unreached_targets(
            Targets(plan.point, plan.normal), self.machine, [PartObstacle(part)]
        )
        return np.asarray(~blocked)


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
    drawing: Drawing,
    part: Part,
    stylus: ReachingStylus | ProbeOfMachine,
    u_touch: float,
    region: InspectionRegion,
) -> NeededTouches:
    """Choose the touches that the tolerances of a drawing need.

    Parameters
    ----------
    drawing : Drawing
        With faces.
    part : Part
    stylus : ReachingStylus or ProbeOfMachine
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
    widths = _narrowest(drawing, part)
    pieces, rows, warnings = [], [], []
    hidden_rows: dict[str, list[str]] = {}
    last = np.zeros(3)
    for row in _in_order(drawing, widths):
        if not row.faces:
            raise PretravelError(f"feature '{row.name}' has no faces: give them to plan it")
        width = widths.get(row.name, math.nan)
        part_of_u = _PARTS.get(row.kind, _PART)
        few = _FEWEST.get(row.kind, _FEWEST["cylinder"])
        wanted = few if math.isnan(width) else _count(width, part_of_u * u_touch, few)
        if row.targets or row.target_lines:
            seen, hidden = _at_targets(row, part, stylus)
            wanted = few = (0 if seen is None else len(seen)) + hidden
        else:
            seen, hidden = _touches_of(row, part, wanted, (stylus, region))
        if seen is None:
            other = _other_axis(row, part, wanted, (stylus, region))
            hidden_rows.setdefault(other, []).append(_with_faces(row))
            continue
        if len(seen) < wanted and hidden:
            warnings.append(f"{row.name}: {hidden} places are not reached")
        seen = _along_a_short_way(seen, row, last, np.array(stylus.axis))
        last = seen.point[-1]
        pieces.append(seen)
        open_ = _undetermined(row.kind, seen)
        warnings += [f"{row.name}: {open_}"] if open_ else []
        expanded = 2.0 * part_of_u * u_touch / math.sqrt(len(seen))
        rows.append((row.name, len(seen), expanded, width))
        if expanded > 1.05 * SHARE_OF_TOLERANCE * width:
            warnings.append(
                f"{row.name}: U is about {1e3 * expanded:.2g} µm, {100 * expanded / width:.0f} % "
                f"of the tolerance of {width:.4g} mm: more touches would hardly reduce U"
            )
    warnings += _unreached(hidden_rows, stylus)
    if not pieces:
        raise PretravelError(
            f"the stylus reaches no place of the features: {'; '.join(warnings)}", inputs=("axis",)
        )
    return NeededTouches(_joined(pieces), tuple(rows), tuple(warnings))


def _unreached(
    rows: dict[str, list[str]], stylus: ReachingStylus | ProbeOfMachine
) -> Iterator[str]:
    """What is said of features without a touch, by the stylus direction that reaches them."""
    here = _axis_words(np.array(stylus.axis, dtype=float))
    for other, names in rows.items():
        way = (
            f"along {other} it reaches {'it' if len(names) == 1 else 'them'}: turn the part, or "
            "take a stylus in this direction"
            if other
            else "nor does it along the axes of the part or across these faces: take a smaller "
            "tip, or a thinner stem"
        )
        it = "it" if len(names) == 1 else "them"
        yield f"{', '.join(names)}: the stylus along {here} reaches no place on {it}; {way}"


def _with_faces(row: DrawnFeature) -> str:
    """The name of a feature with the numbers of its faces, unless it is called by them."""
    numbers = ", ".join(map(str, row.faces))
    known = row.name.endswith(f"face{numbers.replace(' ', '')}") or len(row.faces) > 4
    return row.name if known else f"{row.name} (face{'s' * (len(row.faces) > 1)} {numbers})"


def _other_axis(
    row: DrawnFeature,
    part: Part,
    count: int,
    where: tuple[ReachingStylus | ProbeOfMachine, InspectionRegion],
) -> str:
    """The direction of a stylus that reaches a feature, or most places of it; empty without one.

    The first of the candidates that reaches all places is taken.
    """
    stylus, region = where
    most, best = 0, ""
    for axis in _candidates(row, part):
        turned = ReachingStylus(stylus.tip_radius, stylus.stem_radius, axis)
        there = (turned, replace(region, axis=axis))
        seen, _ = _touches_of(row, part, count, there, _FEW_TRIES)
        if seen is not None and len(seen) > most and not _undetermined(row.kind, seen):
            most, best = len(seen), _axis_words(np.array(axis))
        if most >= count:
            break
    return best


def _candidates(row: DrawnFeature, part: Part) -> list[tuple[float, float, float]]:
    """Unit directions, each once: axes of the part, then normals of the faces in their middles.

    Of the axes those come first along which the faces lie open.
    """
    own = [face for face in part.faces if face.number in row.faces]
    middles = [face.local(0.5 * np.sum(face.box, axis=0)[None]).normal[0] for face in own]
    axes = sorted([*np.eye(3), *-np.eye(3)], key=lambda axis: -float(sum(middles) @ axis))
    tried = [*axes, *middles]
    kept: list[FloatArray] = []
    for each in tried:
        if all(float(each @ other) < _SAME_AXIS for other in kept):
            kept.append(each)
    return [(float(x), float(y), float(z)) for x, y, z in kept]


def _axis_words(axis: FloatArray) -> str:
    """``-z``, or its three numbers."""
    unit = axis / np.linalg.norm(axis)
    main = int(np.argmax(np.abs(unit)))
    if abs(unit[main]) > _SAME_AXIS:
        return f"{'+' if unit[main] > 0.0 else '-'}{'xyz'[main]}"
    return "(" + ", ".join(f"{value:.3g}" for value in unit) + ")"


def _undetermined(kind: str, plan: InspectionPlan) -> str:
    """Why touches at these places do not determine their feature; empty where they do."""
    if kind == BARE_SURFACE:
        return ""
    axis = np.linalg.svd(plan.normal, full_matrices=False)[2][0] if kind == "slot" else None
    try:
        associate(kind, plan.point, axis=axis)
    except PretravelError as error:
        return (
            f"its {len(plan)} places are too few, or lie so that they do not determine it: {error}"
        )
    return ""


def _narrowest(drawing: Drawing, part: Part) -> dict[str, float]:
    """The narrowest tolerance that needs each feature, also as a datum; NaN: one limit alone. [mm]

    An angle is a zone along the shorter of its features.
    """
    found: dict[str, float] = {}

    def need(names: Sequence[str], width: float) -> None:
        for name in names:
            found[name] = float(np.fmin(width, found.get(name, math.nan)))

    def datums(words: Sequence[str]) -> list[str]:
        return [n for word in words for n in word.replace("(M)", "").split("-")]

    for row in drawing.feature:
        if row.tolerance is not None:
            need([row.name], _width(row.tolerance))
        for width in (row.form_tolerance, row.position_tolerance):
            if width is not None:
                need([row.name], width)
        for one in row.geometric:
            need([row.name, *datums(one.datums)], one.zone)
    for pattern in drawing.pattern:
        need([*pattern.features, *datums(pattern.datums)], pattern.position_tolerance)
    rows = {row.name: row for row in drawing.feature}
    for between in drawing.between:
        width = _width(between.tolerance)
        if between.quantity == "angle":
            known = [rows[name] for name in between.features if name in rows]
            width *= DEGREE * min((_extent(row, part) for row in known), default=math.nan)
        need(between.features, width)
    return found


def _width(text: str) -> float:
    """Between the limits of a tolerance; NaN where it has one alone. [mm or degrees]"""
    limits = ToleranceText.parse(text)
    if limits.low is None or limits.high is None:
        return math.nan
    return limits.high - limits.low


def _extent(row: DrawnFeature, part: Part) -> float:
    """The diagonal of the box around the faces of a feature. [mm]"""
    boxes = [face.bounds for face in part.faces if face.number in row.faces]
    if not boxes:
        return math.nan
    low = np.min([low for low, _ in boxes], axis=0)
    return float(np.linalg.norm(np.max([high for _, high in boxes], axis=0) - low))


def _in_order(drawing: Drawing, needs: Collection[str]) -> list[DrawnFeature]:
    """Datums in the order of the frames, then the others."""
    words = [w for row in drawing.feature for one in row.geometric for w in one.datums]
    words += [w for pattern in drawing.pattern for w in pattern.datums]
    letters = dict.fromkeys(n for w in words for n in w.replace("(M)", "").split("-"))
    rows = {row.name: row for row in drawing.feature}
    first = [rows[name] for name in letters if name in rows]
    return first + [row for row in drawing.feature if row not in first and row.name in needs]


def _count(width: float, u: float, few: int) -> int:
    """Touches with which U = 2 u / √n is a tenth of the tolerance."""
    return min(max(few, math.ceil((2.0 * u / (SHARE_OF_TOLERANCE * width)) ** 2)), MOST_OF_FEATURE)


_OF_AREA = 0.7
"""Of the radius of a target's area: a touch there is within it, whatever the placement."""
_ON_LINE = (0.05, 0.5, 0.95)


def _at_targets(
    row: DrawnFeature, part: Part, stylus: ReachingStylus | ProbeOfMachine
) -> tuple[InspectionPlan | None, int]:
    """A touch in the middle of each target of a datum, three along a line, as `_touches_of`.

    Of fewer than three targets, areas have three each, which determine the plane.
    """
    faces = [k for k, face in enumerate(part.faces) if face.number in row.faces]
    lines = np.array(row.target_lines).reshape(-1, 2, 3)
    places = np.array(row.targets).reshape(-1, 4)[:, :3]
    if len(places) + len(lines) < 3:
        normal = feet_on_faces(part, places[:1], np.array(faces[:1])).local.normal
        of_areas = [_within_area(target, normal[0]) for target in row.targets]
        places = np.vstack([np.zeros((0, 3)), *of_areas])
    on_lines = [one[0] + share * (one[1] - one[0]) for one in lines for share in _ON_LINE]
    places = np.vstack([places, *on_lines])
    each = [feet_on_faces(part, places, np.full(len(places), k)) for k in faces]
    nearest = np.argmin([np.abs(feet.distance) + 1e9 * ~feet.inside for feet in each], axis=0)
    chosen = [(each[k], target) for target, k in enumerate(nearest.tolist())]
    found = InspectionPlan(
        face=np.array([part.faces[faces[k]].number for k in nearest.tolist()]),
        uv=np.full((len(places), 2), math.nan),
        point=np.array([feet.local.point[k] for feet, k in chosen]),
        normal=np.array([feet.local.normal[k] for feet, k in chosen]),
        left_out={},
    )
    seen = _at(found, stylus.reaches(part, found))
    return (seen if len(seen) else None), len(found) - len(seen)


def _within_area(target: Sequence[float], normal: FloatArray) -> FloatArray:
    """Three places around the middle of a target, far from each other; of a point itself."""
    turn = 2.0 * math.pi / 3.0 * np.arange(3)
    aside = np.column_stack([np.cos(turn), np.sin(turn)]) @ across(normal)
    if not target[3]:
        return np.array([target[:3]])
    return np.asarray(np.array(target[:3]) + _OF_AREA * 0.5 * target[3] * aside)


def _touches_of(
    row: DrawnFeature,
    part: Part,
    count: int,
    where: tuple[ReachingStylus | ProbeOfMachine, InspectionRegion],
    tries: Sequence[int] = _MORE_PLACES,
) -> tuple[InspectionPlan | None, int]:
    """About so many places on the faces of a feature that are reached, evenly; None without one.

    In addition to them how many places were not reached.
    """
    stylus, region = where
    each = math.ceil(count / len(row.faces))
    pieces, hidden = [], 0
    for k, number in enumerate(row.faces):
        chosen = part.select(str(number))
        face = part.faces[chosen.chosen[0]]
        inner = _within_margin(face, region)
        more_around = k % 2 if face.kind != "plane" else 0  # halves of a bore: no equal steps
        best: InspectionPlan | None = None
        for more in tries:  # a face that does not fill its rectangle, or is half hidden
            grid = _grid(face.kind, more * each, face.box)
            grid = (grid[0] + more_around, grid[1])
            try:
                found = plan_inspection(chosen, grid=grid, region=inner)
            except PretravelError:
                continue
            seen = _at(found, stylus.reaches(part, found))
            if best is None or (_spread(seen, face.kind), len(seen)) > (
                _spread(best, face.kind),
                len(best),
            ):
                best, lost = seen, len(found) - len(seen)
            whole = len(best) >= each and _spread(best, face.kind)
            if whole or (more > _MOST_HIDDEN and not len(best)):
                break
        if best is not None and len(best):
            most = each if face.kind == "plane" else _MOST_OVER * each
            pieces.append(_at(best, _far_apart(best.point, most)))
            hidden += lost
    return (_joined(pieces) if pieces else None), hidden


def _spread(plan: InspectionPlan, kind: str) -> bool:
    """Whether places lie in more than a row of a plane, or in more than a ring of another face."""
    if len(plan) < 3:
        return False
    extents = np.linalg.svd(plan.point - plan.point.mean(axis=0), compute_uv=False)
    return bool(extents[1 if kind == "plane" else 2] > _IN_A_ROW * extents[0])


def _within_margin(face: Face, region: InspectionRegion) -> InspectionRegion:
    """The region without the margins: the outer rows of a grid lie at its ends.

    A parameter that goes all around has none.
    """
    low, high = face.box
    lengths = [float(np.linalg.norm(d[0])) for d in face.derivatives(0.5 * (low + high)[None])[1:]]
    ends: list[tuple[float, float] | None] = []
    for k, stated in enumerate((region.u, region.v)):
        inset = _BESIDE_MARGIN * region.margin / max(lengths[k], 1e-9)
        around = face.kind != "plane" and high[k] - low[k] > 2.0 * np.pi - 1e-6
        wide = high[k] - low[k] > 2.0 * inset
        free = stated is None and wide and not (around and k == 0)
        ends.append((float(low[k] + inset), float(high[k] - inset)) if free else stated)
    return replace(region, u=ends[0], v=ends[1])


def _far_apart(points: FloatArray, count: int) -> IntArray:
    """Rows of the points that are furthest from those before them, in their order."""
    if len(points) <= count:
        return np.arange(len(points))
    chosen = [0]
    away = np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(sorted(chosen))


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
    basis = np.vstack([across, axis]).T
    flat = part.triangles @ basis
    low, high = flat.min(axis=1), flat.max(axis=1)
    for row in np.flatnonzero(free).tolist():
        places = (centres[row] + rim) @ basis
        beside = np.any(high < places.min(axis=0), axis=1)
        beside |= np.any(low[:, :2] > places.max(axis=0)[:2], axis=1)
        near = flat[~beside]
        free[row] = not any(_blocked(place, near) for place in places)
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
