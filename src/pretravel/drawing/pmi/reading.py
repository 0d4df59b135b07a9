"""Read the semantic PMI of AP242 from the text of a STEP file (ISO 10303-242, -47)."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

from pretravel.base import PretravelError
from pretravel.drawing.pmi.bound_faces import (
    LOCATIONS,
    OF_PMI,
    SIZES,
    TARGETS,
    BoundFaces,
    numbers_in,
)
from pretravel.drawing.pmi.items import (
    DatumReference,
    DatumTarget,
    Place,
    Pmi,
    PmiDatum,
    Size,
    Tolerance,
    Triple,
    Unread,
)
from pretravel.drawing.pmi.measures import (
    ANGLE_UNIT,
    LENGTH_UNIT,
    StatedMeasure,
    measure_in_context,
    measure_of,
)
from pretravel.drawing.pmi.model_faces import placed_axes
from pretravel.drawing.pmi.part21 import Instance, Part21, TextRecord, TextReference, Word
from pretravel.drawing.tolerances.iso286 import class_of_fit, limits_of_fit

TOLERANCE_ENTITIES = {
    "POSITION": "position", "SURFACE_PROFILE": "profile", "LINE_PROFILE": "line profile",
    "FLATNESS": "flatness", "STRAIGHTNESS": "straightness", "ROUNDNESS": "roundness",
    "CYLINDRICITY": "cylindricity", "PARALLELISM": "parallelism",
    "PERPENDICULARITY": "perpendicularity", "ANGULARITY": "angularity",
    "CONCENTRICITY": "concentricity", "COAXIALITY": "coaxiality", "SYMMETRY": "symmetry",
    "CIRCULAR_RUNOUT": "run-out", "TOTAL_RUNOUT": "total run-out",
}  # fmt: skip
"""Tolerances by the names of their entities, without _TOLERANCE."""
SIGNS = {
    "MAXIMUM_MATERIAL_REQUIREMENT": "M", "MAXIMUM_MATERIAL_CONDITION": "M",
    "LEAST_MATERIAL_REQUIREMENT": "L", "LEAST_MATERIAL_CONDITION": "L", "FREE_STATE": "F",
    "TANGENT_PLANE": "T", "RECIPROCITY_REQUIREMENT": "R", "COMMON_ZONE": "CZ",
    "ALL_AROUND": "all around", "EACH_RADIAL_ELEMENT": "each radial element",
}  # fmt: skip
"""Modifiers as on a drawing; regardless of feature size is none."""
_NO_MODIFIER = "REGARDLESS_OF_FEATURE_SIZE"
_UPPER = ("upper limit", "upper bound", "upper limit value", "maximum value")
_LOWER = ("lower limit", "lower bound", "lower limit value", "minimum value")
_ANNOTATIONS = ("ANNOTATION_OCCURRENCE", "DRAUGHTING_ANNOTATION_OCCURRENCE", "DRAUGHTING_CALLOUT",
                "TESSELLATED_ANNOTATION_OCCURRENCE", "ANNOTATION_CURVE_OCCURRENCE")  # fmt: skip
_MALFORMED = (PretravelError, ValueError, TypeError, IndexError, AttributeError)


def read_pmi(part21: Part21) -> Pmi:
    """The datums, sizes and tolerances of a model.

    Returns
    -------
    Pmi
        An instance of PMI that is not understood is listed by its text.
    """
    reading = _Reading(part21)
    datums = reading.each(reading.datum, reading.single_datums())
    sizes = reading.each(reading.size, part21.named(*SIZES, *LOCATIONS))
    found = [each for each in part21.instances.values() if _is_tolerance(each)]
    tolerances = reading.each(reading.tolerance, found)
    return Pmi(
        tuple(datums),
        tuple(sizes),
        tuple(tolerances),
        reading.unread(),
        _standard(part21),
        len(part21.named(*_ANNOTATIONS)),
        _texts(part21),
    )


def _texts(part21: Part21) -> tuple[str, ...]:
    """What the model says in words, such as general tolerances: its semantic texts."""
    named = [each.values("REPRESENTATION_ITEM", "DESCRIPTIVE_REPRESENTATION_ITEM")
             for each in part21.named("DESCRIPTIVE_REPRESENTATION_ITEM")
             if "semantic text" in each.text.lower()]  # fmt: skip
    texts = (str(values[1]) for values in named if len(values) > 1 and values[1])
    return tuple(dict.fromkeys(" ".join(text.split()) for text in texts))


def _standard(part21: Part21) -> str:
    """ASME or ISO, where documents of the file name one of them."""
    texts = [each.text.upper() for each in part21.named("DOCUMENT", "DOCUMENT_FILE")]
    named = {
        name
        for name, words in (
            ("ASME", ("ASME", "Y14")),
            ("ISO", ("ISO 1101", "ISO 8015", "ISO 5459")),
        )
        if any(word in text for word in words for text in texts)
    }
    return named.pop() if len(named) == 1 else ""


def _is_tolerance(each: Instance) -> bool:
    return "GEOMETRIC_TOLERANCE" in each.names or any(
        name.endswith("_TOLERANCE") and name.removesuffix("_TOLERANCE") in TOLERANCE_ENTITIES
        for name in each.names
    )


class _Reading:
    """What refers to what, and which instances were used."""

    def __init__(self, part21: Part21) -> None:
        self.part21 = part21
        self.used: set[int] = set()
        self.failed: dict[int, str] = {}
        self.bound = BoundFaces(part21, self.used)
        self.place, self.above, self.below = self.bound.place, self.bound.above, self.bound.below
        self.composite = self.composites()
        self.zones: dict[int, list[Instance]] = defaultdict(list)
        self.of_zones: dict[int, list[Instance]] = defaultdict(list)
        for each in part21.instances.values():
            if any("TOLERANCE_ZONE" in name and "FORM" not in name and "DEFINITION" not in name
                   for name in each.names):  # fmt: skip
                for number in numbers_in(each.values("SHAPE_ASPECT", "TOLERANCE_ZONE")[4:5]):
                    self.zones[number].append(each)
            elif any("ZONE_DEFINITION" in name for name in each.names):
                for number in numbers_in(each.values("TOLERANCE_ZONE_DEFINITION")[:1]):
                    self.of_zones[number].append(each)

    def composites(self) -> dict[int, int]:
        """The upper segment of each lower segment of a composite frame."""
        found = {}
        for each in self.part21.named("GEOMETRIC_TOLERANCE_RELATIONSHIP"):
            try:
                name, words, upper, lower = each.values("GEOMETRIC_TOLERANCE_RELATIONSHIP")[:4]
                if "composite" in f"{name or ''} {words or ''}".lower():
                    found[lower.number] = upper.number
                    self.used.add(each.number)
            except _MALFORMED as error:
                self.failed[each.number] = str(error)
        return found

    def each(self, read: Any, instances: Iterable[Instance]) -> list[Any]:
        """Read each instance; one that does not have the form of its entity is listed instead."""
        found = []
        for instance in instances:
            before = set(self.used)
            try:
                found.append(read(instance))
                self.used.add(instance.number)
            except _MALFORMED as error:
                self.used.intersection_update(before)
                self.failed[instance.number] = str(error)
        return found

    def unread(self) -> tuple[Unread, ...]:
        """Instances of PMI that nothing has used, by their text."""
        left = [
            each
            for each in self.part21.instances.values()
            if each.number not in self.used
            if each.number in self.failed or any(OF_PMI.match(name) for name in each.names)
        ]
        below = {number for each in left for number in each.references}
        return tuple(
            Unread(
                each.number,
                _short(each.text),
                self.failed.get(each.number, ""),
                self.states_a_tolerance(each) and each.number not in below,
            )
            for each in left
        )

    def states_a_tolerance(self, each: Instance) -> bool:
        """Whether it is a tolerance, a size, or refers to limits: the answer has a line for it."""
        if _is_tolerance(each) or each.names & {*SIZES, *LOCATIONS}:
            return True
        below = (self.part21.instances.get(number) for number in each.references)
        return any(
            ("TOLERANCE" in name and "ZONE" not in name) or name == "LIMITS_AND_FITS"
            for one in (each, *below) if one is not None and one.number not in self.used
            for name in one.names
        )  # fmt: skip

    # Datums

    def single_datums(self) -> list[Instance]:
        """The datums without those that are made of others (A-B of AP203 and AP214)."""
        found = self.part21.named("DATUM", "COMMON_DATUM")
        return [each for each in found if not self.parts_of_datum(each)]

    def parts_of_datum(self, datum: Instance) -> list[Instance]:
        """The datums of a common datum, in the order of its letters."""
        if "COMMON_DATUM" not in datum.names:
            return []
        self.used.add(datum.number)
        related = [*self.below[datum.number], *self.above[datum.number]]
        found = {each.number: each for each in related if each.names & {"DATUM", "COMMON_DATUM"}}
        own = _identification(datum)
        return sorted(found.values(), key=lambda each: own.find(_identification(each)))

    def datum(self, instance: Instance) -> PmiDatum:
        letter = _identification(instance)
        faces: dict[int, None] = {}
        others: dict[str, None] = {}
        targets = []
        related = (*self.above[instance.number], *self.below[instance.number])
        for each in (instance, *related, *self.targets_by_name(letter)):
            if each.names & set(TARGETS):
                targets.append(self.target(each))
                continue
            if "DATUM" in each.names and each is not instance:
                continue
            place = self.place(TextReference(each.number))
            faces |= dict.fromkeys(place.faces)
            others |= dict.fromkeys(place.others)
        return PmiDatum(instance.number, letter, Place(tuple(faces), tuple(others)), tuple(targets))

    def targets_by_name(self, letter: str) -> list[Instance]:
        """Targets that nothing relates to a datum, with the letter of one: ``A1``."""
        return [
            each
            for each in self.part21.named(*TARGETS)
            if re.fullmatch(rf"{re.escape(letter)}\d+", _identification_of_target(each))
            and not any("DATUM" in own.names for own in
                        (*self.above[each.number], *self.below[each.number]))
        ]  # fmt: skip

    def target(self, instance: Instance) -> DatumTarget:
        values = instance.values("SHAPE_ASPECT", "DATUM_TARGET", "PLACED_DATUM_TARGET_FEATURE")
        place = self.place(TextReference(instance.number))
        for each in self.above[instance.number]:
            if "DATUM" not in each.names:
                more = self.place(TextReference(each.number))
                place = Place((*place.faces, *more.faces), (*place.others, *more.others))
        sizes, at, axes, movable = self.parameters(instance)
        ends = () if at is not None or len(place.others) != 1 else self.bound.ends(place.others[0])
        if len(ends) == 1:
            (at,), ends = ends, ()
        self.used.add(instance.number)
        form = str(values[1] or "").strip().lower()
        return DatumTarget(
            instance.number, str(values[4]), form, place, tuple(sizes), at, axes, ends, movable
        )

    def parameters(
        self, target: Instance
    ) -> tuple[list[StatedMeasure], Triple | None, tuple[Triple, ...], bool]:
        """The sizes of a target, its place, its axes, and whether it moves.

        Of the representations of its properties; a movable target has a direction there.
        """
        own = {
            each.number
            for each in self.part21.named("PROPERTY_DEFINITION")
            if target.number in numbers_in(each.values("PROPERTY_DEFINITION")[2:3])
        }
        sizes: list[StatedMeasure] = []
        at: Triple | None = None
        axes: tuple[Triple, ...] = ()
        movable = False
        for each in self.part21.named("PROPERTY_DEFINITION_REPRESENTATION",
                                      "SHAPE_DEFINITION_REPRESENTATION"):  # fmt: skip
            definition, representation = each.values("PROPERTY_DEFINITION_REPRESENTATION")[:2]
            if definition.number not in own:
                continue
            for item in self.part21[representation].values("REPRESENTATION")[1]:
                instance = self.part21[item]
                placement = instance.names == {"AXIS2_PLACEMENT_3D"}
                if instance.names == {"DIRECTION"} or (
                    placement and "movable" in str(instance.values()[0]).lower()
                ):
                    movable = True
                elif placement:
                    at, axes = placed_axes(self.part21, instance)
                elif (measure := measure_of(self.part21, instance)) is not None:
                    sizes.append(measure)
        return sizes, at, axes, movable

    def datum_references(self, systems: Any) -> tuple[tuple[DatumReference, ...], list[str]]:
        """The compartments of a datum system, and further systems in words.

        Of AP203 and AP214 references by precedence.
        """
        by_precedence: list[tuple[float, DatumReference]] = []
        found: list[tuple[DatumReference, ...]] = []
        for system in systems:
            instance = self.part21[system]
            self.used.add(instance.number)
            if "DATUM_SYSTEM" in instance.names:
                parts = instance.values("SHAPE_ASPECT", "DATUM_SYSTEM")[4]
                found.append(tuple(self.compartment(each) for each in parts))
            elif instance.names & {"DATUM_REFERENCE", "REFERENCED_MODIFIED_DATUM"}:
                order, datum, *more = instance.values(
                    "DATUM_REFERENCE", "REFERENCED_MODIFIED_DATUM"
                )
                signs = tuple(sign for each in more if (sign := _sign(each)))
                by_precedence.append((order, DatumReference(self.letters(datum), signs)))
            else:
                raise PretravelError(f"#{instance.number} is not a datum system")
        if by_precedence:
            ordered = sorted(by_precedence, key=lambda pair: pair[0])
            found.insert(0, tuple(each for _, each in ordered))
        more = [f"and to {'|'.join(each.text for each in parts)}" for parts in found[1:]]
        return (found[0] if found else ()), more

    def compartment(self, reference: Any) -> DatumReference:
        instance = self.part21[reference]
        self.used.add(instance.number)
        base, *modifiers = instance.values(
            "SHAPE_ASPECT", "GENERAL_DATUM_REFERENCE", "DATUM_REFERENCE_COMPARTMENT",
            "DATUM_REFERENCE_ELEMENT",
        )[4:6]  # fmt: skip
        signs = tuple(self.datum_modifier(each) for each in (modifiers[0] or ()))
        if isinstance(base, TextRecord):  # COMMON_DATUM_LIST((…))
            elements = [self.compartment(each) for each in base.values[0]]
            letters = tuple(letter for each in elements for letter in each.letters)
            inner = tuple(sign for each in elements for sign in each.modifiers)
            return DatumReference(letters, (*inner, *signs))
        if isinstance(base, tuple) and not isinstance(base, TextReference):
            return DatumReference(
                tuple(letter for each in base for letter in self.compartment(each).letters), signs
            )
        own = self.part21[base]
        if own.names & {"DATUM_REFERENCE_ELEMENT", "DATUM_REFERENCE_COMPARTMENT"}:
            inside = self.compartment(base)
            return DatumReference(inside.letters, (*inside.modifiers, *signs))
        return DatumReference(self.letters(base), signs)

    def letters(self, datum: Any) -> tuple[str, ...]:
        instance = self.part21[datum]
        parts = self.parts_of_datum(instance)
        return tuple(map(_identification, parts)) or (_identification(instance),)

    def datum_modifier(self, value: Any) -> str:
        if isinstance(value, TextReference):
            instance = self.part21[value]
            self.used.add(instance.number)
            name, values = next(iter(instance.records))
        elif isinstance(value, TextRecord):
            name, values = value
        else:
            return _sign(value)
        if name == "DATUM_REFERENCE_MODIFIER_WITH_VALUE":
            measure = measure_of(self.part21, self.part21[values[1]])
            return f"{_sign(values[0])} {measure.value:.10g}" if measure else _sign(values[0])
        return _sign(values[0])

    # Sizes

    def size(self, instance: Instance) -> Size:
        if instance.names & set(SIZES):
            aspect, name = instance.values("DIMENSIONAL_SIZE")[:2]
            place = self.place(aspect)
            places: tuple[Place, ...] = (self.bound.round_faces(place),)
        else:
            name, _, first, second = instance.values("SHAPE_ASPECT_RELATIONSHIP")[:4]
            places = (self.place(first), self.place(second))
        measures, notes = self.values_of(instance)
        nominal = _named(measures, "nominal value")
        lower, upper = _named(measures, *_LOWER), _named(measures, *_UPPER)
        plain = [each for each in measures if each not in (lower, upper)]
        if nominal is None and plain:
            nominal = plain[0]
        for each in plain:  # 5 MAX, R2 MIN; a pair of both is the limits
            if each.end == "maximum" and upper is None:
                upper = each
            elif each.end == "minimum" and lower is None:
                lower = each
        if lower is not None and upper is not None and nominal in (lower, upper):
            nominal = None
        if lower is not None and upper is not None:
            notes = [note for note in notes if note not in ("maximum", "minimum")]
        deviations, fit, unclear = self.deviations(instance, nominal)
        angle = any("ANGULAR" in each for each in instance.names)
        unit = next((each.unit for each in (nominal, lower, upper) if each is not None),
                    ANGLE_UNIT if angle else LENGTH_UNIT)  # fmt: skip
        notes += [f"{each.name} {each.value:.10g} {each.unit}" for each in measures
                  if each not in (nominal, lower, upper)]  # fmt: skip
        stated = lower is not None and (upper is not None or deviations == (None, None))
        return Size(
            instance.number,
            " ".join(str(name or "size").lower().split()),
            unit,
            places,
            None if nominal is None else nominal.value,
            lower.value if lower and (stated or deviations[0] is None) else deviations[0],
            upper.value if upper and (stated or deviations[1] is None) else deviations[1],
            fit,
            tuple(notes),
            unclear,
        )

    def values_of(self, dimension: Instance) -> tuple[list[StatedMeasure], list[str]]:
        """The measures of a dimension, and words about it."""
        measures, notes, ranges = [], [], [False]
        for each in self.part21.named("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            own, representation = each.values()[:2]
            if own.number != dimension.number:
                continue
            self.used |= {each.number, representation.number}
            _, items, context = self.part21[representation].values("REPRESENTATION")[:3]
            waiting = list(items)
            while waiting:
                item = self.part21[waiting.pop(0)]
                if "DESCRIPTIVE_REPRESENTATION_ITEM" in item.names:
                    notes.append(str(item.values(
                        "REPRESENTATION_ITEM", "DESCRIPTIVE_REPRESENTATION_ITEM")[1]))  # fmt: skip
                elif item.names & {"COMPOUND_REPRESENTATION_ITEM", "VALUE_RANGE"}:
                    waiting += [TextReference(number) for number in item.references]
                    ranges += ["VALUE_RANGE" in item.names]
                elif (measure := measure_in_context(self.part21, item, context)) is not None:
                    ends = self.qualifiers(item)
                    end = next((one for one in ends if one in ("maximum", "minimum")), "")
                    measures.append(measure._replace(end=end))
                    notes += ends
                else:
                    notes.append(f"#{item.number} {_short(item.text)}")
        if any(ranges) and len(measures) == 2 and not any(each.name.strip() for each in measures):
            low, high = sorted(measures, key=lambda each: each.value)  # a range without names
            measures = [low._replace(name=_LOWER[0]), high._replace(name=_UPPER[0])]
        return measures, notes

    def qualifiers(self, item: Instance) -> list[str]:
        """maximum, minimum, average: how a value is meant."""
        own = [each for record in item.records if record.name == "QUALIFIED_REPRESENTATION_ITEM"
               for each in record.values[-1]]  # fmt: skip
        for each in self.part21.named("MEASURE_QUALIFICATION"):
            measure, qualifiers = each.values()[2:4]
            own += qualifiers if measure.number == item.number else ()
        types = [self.part21[each] for each in own]
        words = [str(each.values()[0]) for each in types if each.names == {"TYPE_QUALIFIER"}]
        return [word for word in dict.fromkeys(words) if word != "designed"]

    def deviations(
        self, dimension: Instance, nominal: StatedMeasure | None
    ) -> tuple[tuple[float | None, float | None], str, str]:
        """Limits by the nominal value and its deviations; the class of a fit; why none."""
        own = [each for each in self.part21.named("PLUS_MINUS_TOLERANCE")
               if each.values()[1].number == dimension.number]  # fmt: skip
        if not own:
            return (None, None), "", ""
        spans = [self.part21[each.values()[0]] for each in own]
        self.used |= {each.number for each in (*own, *spans)}
        if len({span.text for span in spans}) > 1:
            return (None, None), "", "the text has several pairs of deviations"
        span = spans[0]
        if span.names == {"LIMITS_AND_FITS"}:
            fit = class_of_fit(*(str(each or "") for each in span.values()[:3]))
            found = None if nominal is None else limits_of_fit(nominal.value, fit)
            return found or (None, None), fit, ""
        low, high = (measure_of(self.part21, self.part21[end]) for end in span.values()[:2])
        if low is None or high is None or nominal is None:
            raise PretravelError("a deviation without a value")
        if low.value == high.value:
            return (None, None), "", f"both deviations are {low.value:+.10g} {low.unit}"
        ends = sorted((nominal.value + low.value, nominal.value + high.value))
        return (round(ends[0], 9), round(ends[1], 9)), "", ""

    # Tolerances

    def tolerance(self, instance: Instance) -> Tolerance:
        own = {record.name: record.values for record in instance.records}
        kinds = [TOLERANCE_ENTITIES[name.removesuffix("_TOLERANCE")] for name in own
                 if name.removesuffix("_TOLERANCE") in TOLERANCE_ENTITIES]  # fmt: skip
        if len(kinds) != 1:
            raise PretravelError("a tolerance of an unknown kind")
        values = instance.values("GEOMETRIC_TOLERANCE", "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE")
        magnitude, aspect = values[2:4]
        zone = None if magnitude is None else measure_of(self.part21, self.part21[magnitude])
        form, projected, notes, end = self.zone(instance)
        signs, displacement, more = self.added(own)
        datums, further = self.datum_references((values[4] or ()) if len(values) > 4 else ())
        return Tolerance(
            number=instance.number,
            kind=kinds[0],
            zone=None if zone is None else zone.value,
            place=self.place(aspect),
            datums=datums,
            modifiers=tuple(signs),
            form=form,
            projected=projected,
            displacement=displacement,
            notes=(*further, *more, *notes),
            composite=self.composite.get(instance.number),
            projected_from=end,
        )

    def added(self, own: dict[str, Any]) -> tuple[list[str], float | None, list[str]]:
        """Modifiers, displacement, and other statements of a complex instance."""
        signs: list[str] = []
        displacement, notes = None, []
        for name, values in own.items():
            if name == "GEOMETRIC_TOLERANCE_WITH_MODIFIERS":
                signs += [sign for each in values[0] if (sign := _sign(each))]
            elif name == "MODIFIED_GEOMETRIC_TOLERANCE":
                signs += [sign for each in values if (sign := _sign(each))]
            elif name == "UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE":
                displacement = self.length(values[0])
            elif name == "GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT":
                notes.append(f"on each {self.length(values[0]):.10g} mm")
            elif name == "GEOMETRIC_TOLERANCE_WITH_DEFINED_AREA_UNIT":
                form = values[0].name.lower()
                second = "" if values[1] is None else f" by {self.length(values[1]):.10g} mm"
                notes.append(f"{form} area{second}")
            elif name == "GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE":
                notes.append(f"at most {self.length(values[0]):.10g} mm")
            elif name not in _KNOWN and name.removesuffix("_TOLERANCE") not in TOLERANCE_ENTITIES:
                notes.append(f"{name} (not understood)")
        return signs, displacement, notes

    def length(self, reference: Any) -> float:
        measure = measure_of(self.part21, self.part21[reference])
        if measure is None:
            raise PretravelError("a length without a value")
        return measure.value

    def zone(self, tolerance: Instance) -> tuple[str, float | None, list[str], Place]:
        """Form of the zone, length of a projected one, what else is stated of it, its beginning."""
        form, projected, notes, end = "", None, [], Place()
        for each in self.zones[tolerance.number]:
            shape = self.part21[each.values("SHAPE_ASPECT", "TOLERANCE_ZONE")[5]]
            form = str(shape.values()[0] or "").strip().lower()
            self.used |= {each.number, shape.number}
            if each.names - {"TOLERANCE_ZONE", "SHAPE_ASPECT"}:
                notes.append(f"#{each.number} {_short(each.text)}")
            for more in self.of_zones[each.number]:
                self.used.add(more.number)
                if more.names <= {"TOLERANCE_ZONE_DEFINITION", "PROJECTED_ZONE_DEFINITION"}:
                    own = more.values("TOLERANCE_ZONE_DEFINITION", "PROJECTED_ZONE_DEFINITION")
                    projected = self.length(own[3])
                    end = self.place(own[2])
                else:
                    self.used.update(more.references[1:])
                    notes.append(f"#{more.number} {_short(more.text)}")
        return form, projected, notes, end


_KNOWN = {"GEOMETRIC_TOLERANCE", "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE"}


def _identification(datum: Instance) -> str:
    return str(datum.values("SHAPE_ASPECT", "DATUM", "COMMON_DATUM")[4]).strip()


def _identification_of_target(target: Instance) -> str:
    values = target.values("SHAPE_ASPECT", "DATUM_TARGET", "PLACED_DATUM_TARGET_FEATURE")
    return str(values[4]) if len(values) > 4 else ""


def _named(measures: Iterable[StatedMeasure], *names: str) -> StatedMeasure | None:
    return next((each for each in measures if each.name.strip().lower() in names), None)


def _sign(value: Any) -> str:
    """A modifier as on a drawing, else in the words of the text."""
    name = value.name if isinstance(value, Word | TextRecord) else str(value)
    if isinstance(value, TextRecord) and value.values:
        name = value.values[0].name
    return "" if name == _NO_MODIFIER else SIGNS.get(name, name.lower().replace("_", " "))


def _short(text: str) -> str:
    return text if len(text) <= 160 else f"{text[:157]}…"
