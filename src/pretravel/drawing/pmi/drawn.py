"""From the PMI of a model to the features of a drawing that `measure` reads."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import PretravelError
from pretravel.drawing.features.extreme_association import check_criterion
from pretravel.drawing.features.measured_feature import BARE_SURFACE
from pretravel.drawing.pmi.frames import (
    AREA,
    FORMS,
    LINE,
    DecidedAs,
    NotStatedError,
    check_size,
    check_zone,
    decided_as,
    determine_a_plane,
    target_place,
)
from pretravel.drawing.pmi.items import DatumReference, Place, Pmi, PmiDatum, Size, Tolerance
from pretravel.drawing.pmi.measures import ANGLE_UNIT
from pretravel.drawing.pmi.model_faces import SURFACE_KINDS, ModelFace, surfaces_of, triple
from pretravel.drawing.pmi.nominal import (
    SAME,
    angle_between,
    diameters_of,
    distance_between,
    faces_away,
    is_short,
    nominal_place,
    opposite,
    projected_ends,
    two_planes,
)
from pretravel.drawing.pmi.not_decided import lines_not_decided
from pretravel.drawing.tolerances.features_file import (
    Drawing,
    DrawnFeature,
    DrawnPattern,
    DrawnRelation,
    NotDecided,
)
from pretravel.drawing.tolerances.tolerance_frame import (
    COAXIALITY,
    FORM_KINDS,
    POSITION,
    PROFILE,
    SYMMETRY,
    GeometricTolerance,
)

_ENVELOPE = "envelope requirement"
_CRITERIA = {
    "least square": "gaussian", "maximum inscribed": "inscribed",
    "minimum circumscribed": "circumscribed", "minimax": "minimum-zone",
}  # fmt: skip
"""Associations of a size (ISO 14405-1), by the beginning of their words."""


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
    association: str | None = None
    targets: tuple[tuple[float, ...], ...] = ()
    target_lines: tuple[tuple[float, ...], ...] = ()
    geometric: list[GeometricTolerance] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    @property
    def drawn(self) -> DrawnFeature:
        """As in the file."""
        point, direction = (None, None) if self.kind == BARE_SURFACE else nominal_place(self.faces)
        return DrawnFeature(
            kind=self.kind,
            select="" if self.numbers else f"{_plain(self.label)}-*",
            faces=self.numbers,
            label=self.label,
            association=self.association,
            axis=None if self.kind == "sphere" else direction,
            at=point,
            tolerance=self.tolerance,
            nominal=self.nominal,
            form_tolerance=self.form,
            geometric=tuple(self.geometric),
            targets=self.targets,  # type: ignore[arg-type]
            target_lines=self.target_lines,  # type: ignore[arg-type]
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
    not_decided : tuple of NotDecided
        The tolerances among them.
    """

    features: tuple[FeatureInWork, ...]
    patterns: tuple[DrawnPattern, ...]
    between: tuple[DrawnRelation, ...]
    left_out: dict[int, str]
    not_decided: tuple[NotDecided, ...] = ()

    @property
    def drawing(self) -> Drawing:
        """As `read_drawing` gives it."""
        features = tuple(each.drawn for each in self.features)
        return Drawing(features, self.patterns, self.between, self.not_decided)


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
        tuple(work.features.values()),
        tuple(work.patterns),
        tuple(work.between),
        work.left_out,
        lines_not_decided(pmi, numbers, work.left_out),
    )


class _Work:
    def __init__(self, pmi: Pmi, faces: dict[int, ModelFace], numbers: dict[int, int]) -> None:
        self.faces, self.numbers, self.standard = faces, numbers, pmi.standard
        places = [each.place for each in pmi.datums] + [each.place for each in pmi.tolerances]
        places += [place for size in pmi.sizes for place in size.places]
        used = dict.fromkeys(number for place in places for number in place.faces)
        round_ = [faces[n] for n in used if faces[n].kind in SURFACE_KINDS.values()
                  and faces[n].kind != "plane"]  # fmt: skip
        self.round = {face.number: group for group in surfaces_of(round_) for face in group}
        self.features: dict[tuple[int, ...], FeatureInWork] = {}
        self.datums: dict[str, list[FeatureInWork]] = {}
        letters = [each.letter for each in pmi.datums]
        self.twice = {letter for letter in letters if letters.count(letter) > 1}
        self.patterns: list[DrawnPattern] = []
        self.between: list[DrawnRelation] = []
        self.left_out: dict[int, str] = {}

    def trying(self, number: int, add) -> None:  # type: ignore[no-untyped-def]
        try:
            add()
        except (NotStatedError, PretravelError) as error:
            self.left_out[number] = str(error)

    def groups(self, place: Place) -> list[tuple[ModelFace, ...]]:
        """The surfaces of a place.

        Raises
        ------
        NotStatedError
            It has no face, or one of no kind that is measured as a feature.
        """
        if place.others:
            raise NotStatedError(f"it is of {', '.join(place.others)}, not of a face alone")
        if not place.faces:
            raise NotStatedError("the file does not assign it to a face")
        own = [self.faces[number] for number in place.faces]
        other = [face for face in own if face.kind not in SURFACE_KINDS.values()]
        if other:
            raise NotStatedError(f"face {self.number(other[0])} is a {other[0].kind}")
        found: dict[tuple[int, ...], tuple[ModelFace, ...]] = {}
        for group in surfaces_of(own):
            whole = self.round.get(group[0].number, group)
            found[tuple(face.number for face in whole)] = whole
        return list(found.values())

    def number(self, face: ModelFace) -> str:
        return str(self.numbers.get(face.number, f"#{face.number}"))

    def feature(
        self,
        group: tuple[ModelFace, ...],
        kind: str = "",
        label: str = "",
        key: tuple[int, ...] = (),
    ) -> FeatureInWork:
        numbers = tuple(face.number for face in group)
        key = (*numbers, *key)
        if key not in self.features:
            kind = kind or group[0].kind
            word = kind
            if kind == "cylinder" and is_short(group):
                kind = "circle"  # too short to show its direction
            name = label or f"{word}{self.number(group[0])}".replace("#", "_")
            taken = {each.label for each in self.features.values()}
            while name in taken:
                name += "x"
            known = [self.numbers.get(number, 0) for number in numbers]
            self.features[key] = FeatureInWork(
                name, kind, group, tuple(sorted(known)) if all(known) else ()
            )
        return self.features[key]

    # Items

    def add_datum(self, datum: PmiDatum) -> None:
        if datum.letter in self.twice:
            raise NotStatedError(f"the model has several datums {datum.letter}, as assemblies have")
        if datum.targets:
            self.datums[datum.letter] = [self.of_targets(datum)]
            return
        groups = self.groups(datum.place)
        several = len(groups) > 1
        self.datums[datum.letter] = [
            self.feature(group, label=_as_label(f"{datum.letter}{k if several else ''}"))
            for k, group in enumerate(groups, start=1)
        ]

    def of_targets(self, datum: PmiDatum) -> FeatureInWork:
        """What rests on the touches at its targets, next to the feature of its face.

        A plane where they lie on one and show its direction; else the touched places themselves.

        Raises
        ------
        NotStatedError
            A target of another form, or on no face.
        """
        faces = dict.fromkeys(datum.place.faces)
        for each in datum.targets:
            faces |= dict.fromkeys(each.place.faces)
        if datum.place.others or not faces:
            self.groups(Place(tuple(faces), datum.place.others))  # says why not
        own = tuple(self.faces[number] for number in faces)
        whole = [each.place.faces for each in datum.targets
                 if each.form == "area" and each.at is None and each.place.faces]  # fmt: skip
        if 0 < len(whole) < len(datum.targets):
            raise NotStatedError("some of its targets are whole faces, and others are not")
        places = [] if whole else [target_place(datum.letter, each, own) for each in datum.targets]
        plane = own[0].kind == "plane" and len(surfaces_of(own)) == 1
        kind = "plane" if plane and (whole or determine_a_plane(places)) else BARE_SURFACE
        feature = self.feature(own, kind, _as_label(datum.letter), key=(-datum.number,))
        feature.targets = tuple(each for each in places if len(each) == AREA)
        feature.target_lines = tuple(each for each in places if len(each) == LINE)
        feature.association = "tangent"
        return feature

    def add_size(self, size: Size) -> None:
        check_size(size)
        groups = [self.groups(place) for place in self.of_edges(size)]
        if len(groups) == 2:
            self.add_distance(size, groups)
            return
        own = groups[0]
        factor = diameters_of(size, own)
        if two_planes(own) and factor is None:
            if opposite(own):
                self.add_width(size, own)
            else:
                self.add_distance(size, [[own[0]], [own[1]]])
            return
        if factor is None or any(g[0].kind not in ("cylinder", "sphere") for g in own):
            kinds = ", ".join(dict.fromkeys(g[0].kind for g in own))
            raise NotStatedError(f"a {size.quantity} of a {kinds} is not decided here")
        features = [self.feature(group) for group in own]
        if any(each.tolerance for each in features):
            raise NotStatedError("its feature already has a tolerance of size")
        asked = next((name for words, name in _CRITERIA.items()
                      if any(note.startswith(words) for note in size.notes)), None)  # fmt: skip
        for each in features if asked else ():
            check_criterion(str(asked), each.kind)
        for each in features:
            each.tolerance = size.limits(factor)
            each.nominal = None if size.nominal is None else round(factor * size.nominal, 9)
            each.association = asked
            each.remarks += [f"size: {note}" for note in size.notes]
            self.add_envelope(each, size, each.faces[0].inward, factor)
            modelled = 2.0 * each.faces[0].radius
            if each.nominal is not None and abs(modelled - each.nominal) > SAME:
                each.remarks.append(f"the model has a diameter of {modelled:.10g} mm")

    def of_edges(self, size: Size) -> tuple[Place, ...]:
        """The places of a size; of a distance between edges the one pair of planes next to them."""
        if len(size.places) != 2 or not any(place.beside for place in size.places):
            return size.places
        first, second = (
            [self.faces[number] for number in place.beside or place.faces] for place in size.places
        )
        pairs = {
            (a.number, b.number)
            for a in first for b in second
            if a.kind == b.kind == "plane" and size.nominal is not None
            and abs((distance_between(a, b) or 0.0) - size.nominal) < SAME
        }  # fmt: skip
        if len(pairs) != 1:
            return size.places
        return tuple(Place((number,)) for number in pairs.pop())

    def add_width(self, size: Size, groups: Sequence[tuple[ModelFace, ...]]) -> None:
        each = self.feature((*groups[0], *groups[1]), "slot")
        if each.tolerance:
            raise NotStatedError("its feature already has a tolerance of size")
        each.tolerance = size.limits()
        each.nominal = size.nominal
        each.remarks += [f"size: {note}" for note in size.notes]
        self.add_envelope(each, size, not faces_away(groups))

    def add_envelope(
        self, sized: FeatureInWork, size: Size, inward: bool, factor: float = 1.0
    ) -> None:
        """The envelope requirement (E): what fits into a bore or around a boss has a limit too."""
        limit = size.lower if inward else size.upper
        if _ENVELOPE not in size.notes or limit is None:
            return
        each = self.feature(sized.faces, sized.kind, f"{sized.label}_envelope", key=(-size.number,))
        each.association = "inscribed" if inward else "circumscribed"
        each.tolerance = replace(
            size, lower=limit if inward else None, upper=None if inward else limit
        ).limits(factor)
        each.remarks.append(f"size: {_ENVELOPE} of {sized.label}")

    def add_distance(self, size: Size, groups: Sequence[Sequence[tuple[ModelFace, ...]]]) -> None:
        if any(len(each) != 1 for each in groups):
            raise NotStatedError("it is between groups of several surfaces")
        first, second = (each[0] for each in groups)
        quantity = "angle" if size.unit == ANGLE_UNIT else "distance"
        low, high = size.ends
        here = (
            angle_between(first[0], second[0], obtuse=low > 90.0)
            if quantity == "angle"
            else distance_between(first[0], second[0])
        )
        if here is None or not low - SAME < here < high + SAME:
            raise NotStatedError(
                f"its faces have no such {quantity}"
                if here is None
                else f"its faces have the {quantity} {here:.10g} {size.unit}, not that of the text"
            )
        pair = (self.feature(first).label, self.feature(second).label)
        relation = DrawnRelation(pair, size.limits(), quantity, size.nominal)
        self.between.append(relation)

    def add_tolerance(self, tolerance: Tolerance) -> None:
        if tolerance.zone is None:
            raise NotStatedError("the text has no value")
        if tolerance.kind == "roundness" and self.kinds(tolerance.place) == {"sphere"}:
            self.add_form(tolerance)
            return
        found = decided_as(tolerance, self.kinds(tolerance.place), self.standard)
        plain = not (found.instead_of or found.remarks or found.material or tolerance.datums)
        plain = plain and "CZ" not in tolerance.modifiers
        if found.kind in FORMS and plain:
            self.add_form(tolerance)
            return
        if found.kind == PROFILE:
            features = [self.surface(tolerance.place)]
        else:
            groups = self.groups(tolerance.place)
            if len(groups) > 1 and "CZ" in tolerance.modifiers and found.kind != POSITION:
                raise NotStatedError(
                    f"one zone (CZ) for the {tolerance.kind} of several features is not decided"
                )
            groups = self.toleranced(found, groups)
            of_axis = any(group[0].kind in ("cylinder", "cone") for group in groups)
            check_zone(found, tolerance, of_axis)
            features = [self.feature(group) for group in groups]
        found.datums = tuple(self.datum_words(tolerance, found))
        if found.material and not all(each.tolerance for each in features):
            found.instead_of.append(f"({found.material}), without limits of the size")
            found.material = ""
        frame = GeometricTolerance(
            found.kind,
            tolerance.zone,
            found.datums,
            found.material,
            found.offset,
            self.projected(tolerance, features),
            ", ".join(found.instead_of),
            ", ".join(found.remarks),
            found.tangent,
        )
        if found.kind == POSITION and len(features) > 1 and found.together:
            self.patterns.append(
                DrawnPattern(
                    f"position{tolerance.number}",
                    tuple(each.label for each in features),
                    *(frame.zone, frame.datums, frame.material),
                    *(frame.between, frame.instead_of, frame.remark),
                )
            )
            return
        if not found.datums and found.kind not in (PROFILE, *FORM_KINDS):
            raise NotStatedError(f"a {tolerance.kind} of one feature needs a datum")
        for feature in features:  # halves of one cylinder can each have its tolerance
            if frame not in feature.geometric:
                feature.geometric.append(frame)

    def kinds(self, place: Place) -> set[str]:
        return {self.faces[number].kind for number in place.faces}

    def surface(self, place: Place) -> FeatureInWork:
        """The feature of a profile: one surface as it is, or all faces together as one."""
        if place.whole:
            return self.feature(tuple(self.faces.values()), BARE_SURFACE)
        if place.others:
            raise NotStatedError(f"it is of {', '.join(place.others)}, not of a face alone")
        if not place.faces:
            raise NotStatedError("the file does not assign it to a face")
        own = tuple(self.faces[number] for number in place.faces)
        measured = {face.kind for face in own} <= set(SURFACE_KINDS.values())
        if measured and len(found := self.groups(place)) == 1:
            return self.feature(found[0])
        return self.feature(own, BARE_SURFACE)

    def toleranced(
        self, found: DecidedAs, groups: list[tuple[ModelFace, ...]]
    ) -> list[tuple[ModelFace, ...]]:
        """The surfaces of the features of a tolerance: two opposite planes are one slot."""
        if two_planes(groups) and found.kind not in FORM_KINDS:
            if found.kind not in (POSITION, SYMMETRY) or not opposite(groups):
                raise NotStatedError("it can be of two planes, or of the plane between them")
            slot = self.feature((*groups[0], *groups[1]), "slot")
            return [slot.faces]
        if found.kind == POSITION and len(groups) > 1 and groups[0][0].kind == "plane":
            raise NotStatedError("the position of several planes is not decided here")
        return groups

    def projected(
        self, tolerance: Tolerance, features: Sequence[FeatureInWork]
    ) -> tuple[float, float] | None:
        """The ends of a projected zone on the axes, from the nominal points. [mm]"""
        if tolerance.projected is None:
            return None
        begins = [self.faces[number] for number in tolerance.projected_from.faces]
        places = {projected_ends(each.faces, begins, tolerance.projected) for each in features}
        ends = places.pop()
        if ends is None or places:
            raise NotStatedError(
                f"the zone is projected by {tolerance.projected:.10g} mm, and the plane across the "
                "axis from which it is projected is not stated, or not one for all features"
            )
        return ends

    def add_form(self, tolerance: Tolerance) -> None:
        for group in self.groups(tolerance.place):
            own = self.feature(group)
            own.form = min(tolerance.zone or math.inf, own.form or math.inf)

    def datum_words(self, tolerance: Tolerance, found: DecidedAs) -> list[str]:
        """The datums in words of the file; several at their material sizes as they are.

        A frame on the datums as they are is one of those that their material sizes allow, so that
        what conforms to it conforms.
        """
        groups = []
        for each in tolerance.datums:
            unknown = [letter for letter in each.letters if letter not in self.datums]
            if self.twice.intersection(unknown):
                raise NotStatedError(
                    f"the model has several datums {unknown[0]}, and which of them is meant is not "
                    "read: give the tolerance by hand"
                )
            if unknown:
                raise NotStatedError(f"its datum {unknown[0]} is not in the file")
            if set(each.modifiers) - {"M", "L"}:
                raise NotStatedError(f"datum {each.text} has a modifier that is not decided here")
            names = [one.label for letter in each.letters for one in self.datums[letter]]
            groups.append(("-".join(names), bool(each.modifiers)))
        marked = [each for each in tolerance.datums if each.modifiers]
        single = len(marked) == 1 and marked[0].modifiers == ("M",)
        if marked and not (single and self.can_float(marked[0], found)):
            found.instead_of.append(f"datums {'|'.join(each.text for each in tolerance.datums)}")
            return [name for name, _ in groups]
        return [f"{name}(M)" if at_maximum else name for name, at_maximum in groups]

    def can_float(self, datum: DatumReference, found: DecidedAs) -> bool:
        """Whether `measure` moves the frame by the room of a datum at maximum material."""
        own = [each for letter in datum.letters for each in self.datums[letter]]
        return (
            len(own) == 1
            and own[0].kind == "cylinder"
            and own[0].tolerance is not None
            and found.kind in (POSITION, COAXIALITY)
        )


def _as_label(letter: str) -> str:
    """A datum's letter without signs that have a meaning in frames: A-B, B(M)."""
    return re.sub(r"[^\w.]", "_", letter)


def _plain(label: str) -> str:
    """A label without wildcards."""
    return "".join(f"[{sign}]" if sign in "*?[" else sign for sign in label)


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
        line = triple(np.round(np.abs(first.direction), 6))
        alike.setdefault((own.kind, own.nominal, first.inward, line), []).append(own.label)
    for names in alike.values():
        for name in names if len(names) > 1 else ():
            one = next(each for each in work.features.values() if each.label == name)
            one.remarks.append(f"one of {len(names)} alike: {', '.join(names)}")
    return replace(DrawnPmi((), (), (), {}), features=tuple(work.features.values()))
