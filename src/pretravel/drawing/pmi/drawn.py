"""From the PMI of a model to the features of a drawing that `measure` reads."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import PretravelError
from pretravel.drawing.pmi.items import Place, Pmi, PmiDatum, Size, Tolerance
from pretravel.drawing.pmi.measures import ANGLE_UNIT
from pretravel.drawing.pmi.model_faces import SURFACE_KINDS, ModelFace, surfaces_of
from pretravel.drawing.tolerances.features_file import (
    Drawing,
    DrawnFeature,
    DrawnPattern,
    DrawnRelation,
)
from pretravel.drawing.tolerances.tolerance_frame import (
    ORIENTATION,
    POSITION,
    PROFILE,
    SYMMETRY,
    TOLERANCE_KINDS,
    GeometricTolerance,
)

FORMS = {"flatness": "plane", "cylindricity": "cylinder", "roundness": "sphere"}
"""The kind whose form a tolerance of form is."""
_ROUND = "cylindrical or circular"
_SAME = 1e-3
"""Between a nominal value of the PMI and that of its faces. [mm or degrees]"""
_WITHOUT_TOLERANCE = ("theoretical", "auxiliary")
_DIAMETERS = {"diameter": 1.0, "spherical diameter": 1.0, "radius": 2.0, "spherical radius": 2.0}
"""Sizes of round features, and how many of them a diameter is."""


class _NotStatedError(Exception):
    """Why the file of features cannot state an item."""


@dataclass
class FeatureInWork:
    """A feature with what was found of it so far.

    Attributes
    ----------
    label, kind : str
    faces : tuple of ModelFace
    numbers : tuple of int
        Of the faces, as `pretravel faces` lists them; empty where one of them has none.
    """

    label: str
    kind: str
    faces: tuple[ModelFace, ...]
    numbers: tuple[int, ...] = ()
    tolerance: str | None = None
    nominal: float | None = None
    form: float | None = None
    geometric: list[GeometricTolerance] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    @property
    def drawn(self) -> DrawnFeature:
        """As in the file."""
        point, direction = _nominal_place(self.faces)
        return DrawnFeature(
            kind=self.kind,
            select="" if self.numbers else f"{_plain(self.label)}-*",
            faces=self.numbers,
            label=self.label,
            axis=None if self.kind == "sphere" else direction,
            at=point,
            tolerance=self.tolerance,
            nominal=self.nominal,
            form_tolerance=self.form,
            geometric=tuple(self.geometric),
        )


@dataclass(frozen=True)
class DrawnPmi:
    """The PMI of a model as a file of features.

    Attributes
    ----------
    features : tuple of FeatureInWork
    patterns : tuple of DrawnPattern
    between : tuple of DrawnRelation
    left_out : mapping of int to str
        Items that the file cannot state, by their instances, and why.
    """

    features: tuple[FeatureInWork, ...]
    patterns: tuple[DrawnPattern, ...]
    between: tuple[DrawnRelation, ...]
    left_out: dict[int, str]

    @property
    def drawing(self) -> Drawing:
        """As `read_drawing` gives it."""
        return Drawing(tuple(each.drawn for each in self.features), self.patterns, self.between)


def drawn_pmi(pmi: Pmi, faces: dict[int, ModelFace], numbers: dict[int, int]) -> DrawnPmi:
    """The features of a model with the tolerances that the file of features can state.

    Parameters
    ----------
    pmi : Pmi
    faces : mapping of int to ModelFace
    numbers : mapping of int to int
        Of the faces, as `pretravel faces` lists them.

    Returns
    -------
    DrawnPmi
        What the file cannot state is in `left_out`, with the reason.
    """
    work = _Work(pmi, faces, numbers)
    for datum in pmi.datums:
        work.trying(datum.number, lambda one=datum: work.add_datum(one))
    for size in pmi.sizes:
        work.trying(size.number, lambda one=size: work.add_size(one))
    for tolerance in pmi.tolerances:
        work.trying(tolerance.number, lambda one=tolerance: work.add_tolerance(one))
    return DrawnPmi(
        tuple(work.features.values()), tuple(work.patterns), tuple(work.between), work.left_out
    )


class _Work:
    def __init__(self, pmi: Pmi, faces: dict[int, ModelFace], numbers: dict[int, int]) -> None:
        self.faces, self.numbers = faces, numbers
        places = [each.place for each in pmi.datums] + [each.place for each in pmi.tolerances]
        places += [place for size in pmi.sizes for place in size.places]
        used = dict.fromkeys(number for place in places for number in place.faces)
        round_ = [faces[n] for n in used if faces[n].kind in SURFACE_KINDS.values()
                  and faces[n].kind != "plane"]  # fmt: skip
        self.round = {face.number: group for group in surfaces_of(round_) for face in group}
        self.features: dict[tuple[int, ...], FeatureInWork] = {}
        self.datums: dict[str, list[FeatureInWork]] = {}
        self.patterns: list[DrawnPattern] = []
        self.between: list[DrawnRelation] = []
        self.left_out: dict[int, str] = {}

    def trying(self, number: int, add) -> None:  # type: ignore[no-untyped-def]
        try:
            add()
        except (_NotStatedError, PretravelError) as error:
            self.left_out[number] = str(error)

    def groups(self, place: Place) -> list[tuple[ModelFace, ...]]:
        """The surfaces of a place.

        Raises
        ------
        _NotStatedError
            It has no face, or one of no kind that is measured as a feature.
        """
        if place.others:
            raise _NotStatedError(f"it is of {', '.join(place.others)}, not of a face alone")
        if not place.faces:
            raise _NotStatedError("the text binds it to no face")
        own = [self.faces[number] for number in place.faces]
        other = [face for face in own if face.kind not in SURFACE_KINDS.values()]
        if other:
            raise _NotStatedError(f"face {self.number(other[0])} is a {other[0].kind}")
        found: dict[tuple[int, ...], tuple[ModelFace, ...]] = {}
        for group in surfaces_of(own):
            whole = self.round.get(group[0].number, group)
            found[tuple(face.number for face in whole)] = whole
        return list(found.values())

    def number(self, face: ModelFace) -> str:
        return str(self.numbers.get(face.number, f"#{face.number}"))

    def feature(
        self, group: tuple[ModelFace, ...], kind: str = "", label: str = ""
    ) -> FeatureInWork:
        key = tuple(face.number for face in group)
        if key not in self.features:
            kind = kind or group[0].kind
            name = label or f"{kind}{self.number(group[0])}".replace("#", "_")
            taken = {each.label for each in self.features.values()}
            while name in taken:
                name += "x"
            known = [self.numbers.get(number, 0) for number in key]
            self.features[key] = FeatureInWork(
                name, kind, group, tuple(sorted(known)) if all(known) else ()
            )
        return self.features[key]

    # Items

    def add_datum(self, datum: PmiDatum) -> None:
        if not datum.place.faces and datum.targets:
            raise _NotStatedError(
                "it is made by datum targets, which the file of features cannot express"
            )
        groups = self.groups(datum.place)
        several = len(groups) > 1
        self.datums[datum.letter] = [
            self.feature(group, label=f"{datum.letter}{k if several else ''}")
            for k, group in enumerate(groups, start=1)
        ]
        if datum.targets:
            raise _NotStatedError("its targets are not given: the whole faces are its feature")

    def add_size(self, size: Size) -> None:
        if size.nominal is None and size.lower is None and size.upper is None:
            raise _NotStatedError("the text has no value")
        stated = set(size.notes) & set(_WITHOUT_TOLERANCE)
        if stated:
            raise _NotStatedError(f"it has no tolerance: it is {', '.join(sorted(stated))}")
        if size.fit and size.lower is None:
            raise _NotStatedError(f"give the limits of {size.fit} by ISO 286 as tolerance")
        if size.lower is None or size.upper is None:
            raise _NotStatedError("the text has no lower and upper limit")
        groups = [self.groups(place) for place in size.places]
        if len(groups) == 2:
            self.add_distance(size, groups)
            return
        own = groups[0]
        if _two_planes(own) and size.quantity not in _DIAMETERS:
            self.add_width(size, own)
            return
        factor = _DIAMETERS.get(size.quantity)
        if factor is None or any(g[0].kind not in ("cylinder", "sphere") for g in own):
            kinds = ", ".join(dict.fromkeys(g[0].kind for g in own))
            raise _NotStatedError(f"a {size.quantity} of a {kinds} is not decided here")
        features = [self.feature(group) for group in own]
        if any(each.tolerance for each in features):
            raise _NotStatedError("its feature has a tolerance of size before")
        for each in features:
            each.tolerance = f"{factor * size.lower:.10g}..{factor * size.upper:.10g}"
            each.nominal = None if size.nominal is None else round(factor * size.nominal, 9)
            each.remarks += [f"size: {note}" for note in size.notes]
            modelled = 2.0 * each.faces[0].radius
            if each.nominal is not None and abs(modelled - each.nominal) > _SAME:
                each.remarks.append(f"the model has a diameter of {modelled:.10g} mm")

    def add_width(self, size: Size, groups: Sequence[tuple[ModelFace, ...]]) -> None:
        assert size.lower is not None
        assert size.upper is not None
        if not _opposite(groups):
            raise _NotStatedError("its planes do not face one another")
        each = self.feature((*groups[0], *groups[1]), "slot")
        if each.tolerance:
            raise _NotStatedError("its feature has a tolerance of size before")
        each.tolerance = f"{size.lower:.10g}..{size.upper:.10g}"
        each.nominal = size.nominal
        each.remarks += [f"size: {note}" for note in size.notes]

    def add_distance(self, size: Size, groups: Sequence[Sequence[tuple[ModelFace, ...]]]) -> None:
        if any(len(each) != 1 for each in groups):
            raise _NotStatedError("it is between groups of several surfaces")
        first, second = (each[0] for each in groups)
        quantity = "angle" if size.unit == ANGLE_UNIT else "distance"
        here = _angle(first[0], second[0]) if quantity == "angle" else _apart(first[0], second[0])
        nominal = size.nominal
        if here is None or nominal is None or abs(here - nominal) > _SAME:
            raise _NotStatedError(
                f"its faces have no such {quantity}"
                if here is None
                else f"its faces have the {quantity} {here:.10g} {size.unit}, not that of the text"
            )
        pair = (self.feature(first).label, self.feature(second).label)
        relation = DrawnRelation(pair, f"{size.lower:.10g}..{size.upper:.10g}", quantity, nominal)
        self.between.append(relation)

    def add_tolerance(self, tolerance: Tolerance) -> None:
        if tolerance.zone is None:
            raise _NotStatedError("the text has no value")
        others = [sign for sign in tolerance.signs if sign not in ("M", "L", "all around")]
        if others:
            raise _NotStatedError(f"'{', '.join(others)}' is not decided here")
        kind = FORMS.get(tolerance.kind)
        if kind is None and tolerance.kind not in TOLERANCE_KINDS:
            raise _NotStatedError(f"a {tolerance.kind} is not decided here")
        groups = self.groups(tolerance.place)
        if kind is not None:
            self.add_form(tolerance, kind, groups)
            return
        datums = tuple(self.datum_words(tolerance))
        material = "".join(tolerance.modifiers)
        groups = self.toleranced(tolerance, groups)
        own = GeometricTolerance(tolerance.kind, tolerance.zone, datums, material)
        sizes = [self.features.get(tuple(face.number for face in g)) for g in groups]
        if material and not all(each is not None and each.tolerance for each in sizes):
            raise _NotStatedError(f"({material}) needs the limits of the size of its feature")
        if tolerance.kind == POSITION and len(groups) > 1:
            names = tuple(self.feature(group).label for group in groups)
            label = f"position{tolerance.number}"
            self.patterns.append(DrawnPattern(label, names, tolerance.zone, datums, material))
            return
        if not datums and tolerance.kind != PROFILE:
            raise _NotStatedError(f"a {tolerance.kind} of one feature needs a datum")
        for group in groups:
            self.feature(group).geometric.append(own)

    def toleranced(
        self, tolerance: Tolerance, groups: list[tuple[ModelFace, ...]]
    ) -> list[tuple[ModelFace, ...]]:
        """The surfaces of the features of a tolerance: two opposite planes are one slot."""
        if tolerance.kind == PROFILE and len(groups) > 1 and len(tolerance.datums) < 3:
            raise _NotStatedError(
                f"the profile is of {len(groups)} surfaces together, which the datums leave free"
            )
        if _two_planes(groups) and tolerance.kind != PROFILE:
            if tolerance.kind not in (POSITION, SYMMETRY) or not _opposite(groups):
                raise _NotStatedError("it can be of two planes, or of the plane between them")
            slot = self.feature((*groups[0], *groups[1]), "slot")
            groups = [slot.faces]
        elif tolerance.kind == POSITION and len(groups) > 1 and groups[0][0].kind == "plane":
            raise _NotStatedError("the position of several planes is not decided here")
        axes = [g for g in groups if g[0].kind in ("cylinder", "cone")]
        if axes and tolerance.kind in (POSITION, *ORIENTATION) and tolerance.form != _ROUND:
            raise _NotStatedError(
                "the zone of an axis is decided as a cylinder, and the text "
                + (f"calls it '{tolerance.form}'" if tolerance.form else "has no form of it")
            )
        return groups

    def add_form(
        self, tolerance: Tolerance, kind: str, groups: Iterable[tuple[ModelFace, ...]]
    ) -> None:
        groups = list(groups)
        if tolerance.modifiers or tolerance.datums:
            raise _NotStatedError("a form with modifiers or datums is not decided here")
        if any(group[0].kind != kind for group in groups):
            found = ", ".join(dict.fromkeys(group[0].kind for group in groups))
            raise _NotStatedError(f"the {tolerance.kind} of a {found} is not decided here")
        for group in groups:
            own = self.feature(group)
            own.form = min(tolerance.zone or math.inf, own.form or math.inf)

    def datum_words(self, tolerance: Tolerance) -> Iterable[str]:
        marked = sum(bool(each.modifiers) for each in tolerance.datums)
        for each in tolerance.datums:
            unknown = [letter for letter in each.letters if letter not in self.datums]
            if unknown:
                raise _NotStatedError(f"its datum {unknown[0]} is not in the file")
            names = [one.label for letter in each.letters for one in self.datums[letter]]
            if each.modifiers and (each.modifiers != ("M",) or len(names) > 1 or marked > 1):
                raise _NotStatedError(
                    f"datums {'|'.join(one.text for one in tolerance.datums)}: one single datum "
                    "of a frame may be at maximum material, none otherwise modified"
                )
            yield "-".join(names) + ("(M)" if each.modifiers else "")


def _two_planes(groups: Sequence[Sequence[ModelFace]]) -> bool:
    return len(groups) == 2 and all(each[0].kind == "plane" for each in groups)


def _opposite(groups: Sequence[Sequence[ModelFace]]) -> bool:
    """Whether two planes face one another or away from one another."""
    a, b = (each[0].direction for each in groups)
    return a is not None and b is not None and float(a @ b) < -1.0 + 1e-6


def _plain(label: str) -> str:
    """A label without wildcards."""
    return "".join(f"[{sign}]" if sign in "*?[" else sign for sign in label)


def _nominal_place(
    faces: Sequence[ModelFace],
) -> tuple[tuple[float, float, float] | None, tuple[float, float, float] | None]:
    """The middle of a feature on its axis or plane, and its direction. [mm]"""
    first = faces[0]
    if first.point is None or first.direction is None:
        return None, None
    corners = np.concatenate([face.corners for face in faces])
    if len(corners) == 0 or first.kind in ("sphere", "torus"):
        middle = first.point
    elif first.kind == "plane":  # or the two planes of a slot
        places = [float(face.point @ first.direction) for face in faces if face.point is not None]
        middle = corners.mean(axis=0)
        between = 0.5 * (min(places) + max(places))
        middle = middle + (between - middle @ first.direction) * first.direction
    else:
        heights = (corners - first.point) @ first.direction
        middle = first.point + 0.5 * (heights.min() + heights.max()) * first.direction
    return _triple(middle, 6), _triple(first.direction)


def _triple(values: Iterable[float], digits: int = 9) -> tuple[float, float, float]:
    x, y, z = (round(float(value), digits) + 0.0 for value in values)
    return x, y, z


def _angle(a: ModelFace, b: ModelFace) -> float | None:
    if a.direction is None or b.direction is None:
        return None
    return math.degrees(math.acos(min(1.0, abs(float(a.direction @ b.direction)))))


def _apart(a: ModelFace, b: ModelFace) -> float | None:
    """Of parallel planes, or of parallel axes. [mm]"""
    if a.point is None or b.point is None or a.direction is None or b.direction is None:
        return None
    apart = b.point - a.point
    if a.kind == b.kind == "sphere":
        return float(np.linalg.norm(apart))
    parallel = np.linalg.norm(np.cross(a.direction, b.direction)) < 1e-6
    if not parallel or (a.kind == "plane") != (b.kind == "plane"):
        return None
    along = float(apart @ a.direction)
    return abs(along) if a.kind == "plane" else math.sqrt(max(float(apart @ apart) - along**2, 0.0))


def skeleton(
    faces: dict[int, ModelFace], numbers: dict[int, int], turns: dict[int, float]
) -> DrawnPmi:
    """Each feature of a model without PMI that can carry a size, without a tolerance.

    Parameters
    ----------
    faces : mapping of int to ModelFace
    numbers : mapping of int to int
    turns : mapping of int to float
        The angle about its axis that a face covers. A cylinder that covers half a turn or less is a
        fillet, which has no size. [rad]
    """
    work = _Work(Pmi((), (), (), ()), faces, numbers)
    for group in surfaces_of(f for f in faces.values() if f.kind in ("cylinder", "sphere")):
        if sum(turns.get(face.number, 0.0) for face in group) > 1.01 * math.pi:
            own = work.feature(group)
            own.nominal = round(2.0 * group[0].radius, 6)
    alike: dict[tuple[object, ...], list[str]] = {}
    for own in work.features.values():
        first = own.faces[0]
        assert first.direction is not None
        line = _triple(np.round(np.abs(first.direction), 6))
        alike.setdefault((own.kind, own.nominal, first.inward, line), []).append(own.label)
    for names in alike.values():
        for name in names if len(names) > 1 else ():
            one = next(each for each in work.features.values() if each.label == name)
            one.remarks.append(f"one of {len(names)} alike: {', '.join(names)}")
    return replace(DrawnPmi((), (), (), {}), features=tuple(work.features.values()))
