"""Read the semantic PMI of AP242 from the text of a STEP file (ISO 10303-242, -47)."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from typing import Any

from pretravel.base import PretravelError
from pretravel.drawing.pmi.iso286 import limits_of_fit
from pretravel.drawing.pmi.items import (
    DatumReference,
    DatumTarget,
    Place,
    Pmi,
    PmiDatum,
    Size,
    Tolerance,
    Unread,
)
from pretravel.drawing.pmi.measures import ANGLE_UNIT, LENGTH_UNIT, StatedMeasure, measure_of
from pretravel.drawing.pmi.model_faces import FACE_ENTITIES, length_factor
from pretravel.drawing.pmi.part21 import Instance, Part21, TextRecord, TextReference, Word

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
_OF_PMI = re.compile(
    r"(?!DIMENSIONAL_EXPONENTS|UNCERTAINTY_)\w*(?:TOLERANCE|DATUM|DIMENSION|LIMITS_AND_FITS|"
    r"ANGULAR_SIZE|ANGULAR_LOCATION|PROJECTED_ZONE|RUNOUT_ZONE|NON_UNIFORM_ZONE)\w*$"
)
"""Entities of PMI: each instance of them is read, or listed."""
_LOCATIONS = ("DIMENSIONAL_LOCATION", "ANGULAR_LOCATION", "DIRECTED_DIMENSIONAL_LOCATION",
              "DIMENSIONAL_LOCATION_WITH_PATH")  # fmt: skip
_SIZES = ("DIMENSIONAL_SIZE", "ANGULAR_SIZE", "DIMENSIONAL_SIZE_WITH_DATUM_FEATURE",
          "DIMENSIONAL_SIZE_WITH_PATH")  # fmt: skip
_TARGETS = ("PLACED_DATUM_TARGET_FEATURE", "DATUM_TARGET")
_SETS = {"SET_REPRESENTATION_ITEM", "LIST_REPRESENTATION_ITEM", "COMPOUND_REPRESENTATION_ITEM"}


def read_pmi(part21: Part21) -> Pmi:
    """The datums, sizes and tolerances of a model.

    Parameters
    ----------
    part21 : Part21

    Returns
    -------
    Pmi
        An instance of PMI that is not understood is listed by its text.
    """
    reading = _Reading(part21)
    datums = reading.each(reading.datum, part21.named("DATUM", "COMMON_DATUM"))
    sizes = reading.each(reading.size, part21.named(*_SIZES, *_LOCATIONS))
    found = [each for each in part21.instances.values() if _is_tolerance(each)]
    tolerances = reading.each(reading.tolerance, found)
    return Pmi(tuple(datums), tuple(sizes), tuple(tolerances), reading.unread(), _standard(part21))


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
        self.below: dict[int, list[Instance]] = defaultdict(list)
        self.above: dict[int, list[Instance]] = defaultdict(list)
        self.geometry: dict[int, list[int]] = defaultdict(list)
        self.composite = self.composites()
        for each in part21.instances.values():
            names = each.names
            if any(name.endswith("SHAPE_ASPECT_DERIVING_RELATIONSHIP")
                   or name == "SHAPE_ASPECT_RELATIONSHIP"
                   or name == "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP"
                   for name in names) and not names & set(_LOCATIONS):  # fmt: skip
                above, below = each.values("SHAPE_ASPECT_RELATIONSHIP")[2:4]
                self.below[above.number].append(part21[below])
                self.above[below.number].append(part21[above])
                if "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP" in names:
                    self.used.add(each.number)
            elif "GEOMETRIC_ITEM_SPECIFIC_USAGE" in names or (
                names == {"ITEM_IDENTIFIED_REPRESENTATION_USAGE"}
            ):
                values = each.values(
                    "ITEM_IDENTIFIED_REPRESENTATION_USAGE", "GEOMETRIC_ITEM_SPECIFIC_USAGE"
                )
                if isinstance(values[2], TextReference):
                    self.geometry[values[2].number] += _numbers(values[4])

    def composites(self) -> dict[int, int]:
        """The upper segment of each lower segment of a composite frame."""
        found = {}
        for each in self.part21.named("GEOMETRIC_TOLERANCE_RELATIONSHIP"):
            name, words, upper, lower = each.values()[:4]
            if "composite" in f"{name or ''} {words or ''}".lower():
                found[lower.number] = upper.number
                self.used.add(each.number)
        return found

    def each(self, read: Any, instances: Iterable[Instance]) -> list[Any]:
        """Read each instance; one that does not have the form of its entity is listed instead."""
        found = []
        for instance in instances:
            before = set(self.used)
            try:
                found.append(read(instance))
                self.used.add(instance.number)
            except (PretravelError, ValueError, TypeError, IndexError, AttributeError) as error:
                self.used = before
                self.failed[instance.number] = str(error)
        return found

    def unread(self) -> tuple[Unread, ...]:
        """Instances of PMI that nothing has used, by their text."""
        left = [
            each
            for each in self.part21.instances.values()
            if each.number not in self.used
            if each.number in self.failed or any(_OF_PMI.match(name) for name in each.names)
        ]
        return tuple(
            Unread(
                each.number,
                _short(each.text),
                self.failed.get(each.number, ""),
                _is_tolerance(each)
                or bool(each.names & {*_SIZES, *_LOCATIONS, "GEOMETRIC_TOLERANCE_RELATIONSHIP"}),
            )
            for each in left
        )

    # Places

    def place(self, aspect: Any) -> Place:
        """The faces of a shape aspect, of what it consists of and of what it is derived from."""
        faces: dict[int, None] = {}
        others: dict[str, None] = {}
        start = self.part21[aspect]
        waiting, seen = [start], set[int]()
        while waiting:
            own = waiting.pop(0)
            if own.number in seen:
                continue
            seen.add(own.number)
            if any(_OF_PMI.match(name) for name in own.names) and "DATUM" not in own.names:
                self.used.add(own.number)
            for number in self.geometry[own.number]:
                item = self.part21[number]
                if item.names & _SETS:
                    self.geometry[own.number].extend(item.references)
                elif item.names & set(FACE_ENTITIES):
                    faces[number] = None
                else:
                    others[f"#{number} {' '.join(sorted(item.names))}"] = None
            waiting += [each for each in self.below[own.number] if "DATUM" not in each.names]
        return Place(
            tuple(faces),
            tuple(others),
            "ALL_AROUND_SHAPE_ASPECT" in start.names,
            "BETWEEN_SHAPE_ASPECT" in start.names,
            "PRODUCT_DEFINITION_SHAPE" in start.names,
        )

    # Datums

    def datum(self, instance: Instance) -> PmiDatum:
        letter = instance.values("SHAPE_ASPECT", "DATUM")[4]
        faces: dict[int, None] = {}
        others: dict[str, None] = {}
        targets = []
        for each in (instance, *self.above[instance.number], *self.below[instance.number]):
            if each.names & set(_TARGETS):
                targets.append(self.target(each))
                continue
            if "DATUM" in each.names and each is not instance:
                continue
            place = self.place(TextReference(each.number))
            faces |= dict.fromkeys(place.faces)
            others |= dict.fromkeys(place.others)
        return PmiDatum(instance.number, letter, Place(tuple(faces), tuple(others)), tuple(targets))

    def target(self, instance: Instance) -> DatumTarget:
        values = instance.values("SHAPE_ASPECT", "DATUM_TARGET", "PLACED_DATUM_TARGET_FEATURE")
        place = self.place(TextReference(instance.number))
        for each in self.above[instance.number]:
            if "DATUM" not in each.names:
                more = self.place(TextReference(each.number))
                place = Place((*place.faces, *more.faces), (*place.others, *more.others))
        sizes, at = self.parameters(instance)
        self.used.add(instance.number)
        return DatumTarget(
            instance.number, str(values[4]), str(values[1] or ""), place, tuple(sizes), at
        )

    def parameters(
        self, target: Instance
    ) -> tuple[list[StatedMeasure], tuple[float, float, float] | None]:
        """The sizes of a target and its place: of the representations of its properties."""
        own = {
            each.number
            for each in self.part21.named("PROPERTY_DEFINITION")
            if target.number in _numbers(each.values("PROPERTY_DEFINITION")[2:3])
        }
        sizes: list[StatedMeasure] = []
        at = None
        for each in self.part21.named("PROPERTY_DEFINITION_REPRESENTATION",
                                      "SHAPE_DEFINITION_REPRESENTATION"):  # fmt: skip
            definition, representation = each.values("PROPERTY_DEFINITION_REPRESENTATION")[:2]
            if definition.number not in own:
                continue
            for item in self.part21[representation].values("REPRESENTATION")[1]:
                instance = self.part21[item]
                if instance.names == {"AXIS2_PLACEMENT_3D"}:
                    point = self.part21[instance.values()[1]].values()[1]
                    factor = length_factor(self.part21)
                    x, y, z = (round(factor * value, 9) for value in point)
                    at = (x, y, z)
                elif (measure := measure_of(self.part21, instance)) is not None:
                    sizes.append(measure)
        return sizes, at

    def datum_references(self, systems: Any) -> tuple[DatumReference, ...]:
        """The compartments of datum systems; of AP203 and AP214 references by precedence."""
        found: list[tuple[float, DatumReference]] = []
        for system in systems:
            instance = self.part21[system]
            self.used.add(instance.number)
            if "DATUM_SYSTEM" in instance.names:
                parts = instance.values("SHAPE_ASPECT", "DATUM_SYSTEM")[4]
                found += [(k, self.compartment(each)) for k, each in enumerate(parts)]
            elif instance.names & {"DATUM_REFERENCE", "REFERENCED_MODIFIED_DATUM"}:
                order, datum, *more = instance.values(
                    "DATUM_REFERENCE", "REFERENCED_MODIFIED_DATUM"
                )
                signs = tuple(sign for each in more if (sign := _sign(each)))
                found.append((order, DatumReference((self.letter(datum),), signs)))
            else:
                raise PretravelError(f"#{instance.number} is no datum system")
        return tuple(each for _, each in sorted(found, key=lambda pair: pair[0]))

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
        return DatumReference((self.letter(base),), signs)

    def letter(self, datum: Any) -> str:
        return str(self.part21[datum].values("SHAPE_ASPECT", "DATUM")[4])

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
        if instance.names & set(_SIZES):
            aspect, name = instance.values("DIMENSIONAL_SIZE")[:2]
            places: tuple[Place, ...] = (self.place(aspect),)
        else:
            name, _, first, second = instance.values("SHAPE_ASPECT_RELATIONSHIP")[:4]
            places = (self.place(first), self.place(second))
        measures, notes = self.values_of(instance)
        named = {measure.name: measure for measure in measures}
        nominal = named.get("nominal value")
        plain = [each for each in measures if "limit" not in each.name]
        if nominal is None and plain:
            nominal = plain[0]
        lower, upper = named.get("lower limit"), named.get("upper limit")
        deviations, fit = self.deviations(instance, nominal)
        angle = any("ANGULAR" in each for each in instance.names)
        unit = next((each.unit for each in (nominal, lower, upper) if each is not None),
                    ANGLE_UNIT if angle else LENGTH_UNIT)  # fmt: skip
        if lower is None and upper is None and deviations == (None, None) and nominal is not None:
            # One limit alone: 5 MAX, R2 MIN.
            lower = nominal if "minimum" in notes else None
            upper = nominal if "maximum" in notes else None
        known = {id(each) for each in (nominal, lower, upper)}
        notes += [f"{each.name} {each.value:.10g} {each.unit}" for each in measures
                  if id(each) not in known]  # fmt: skip
        return Size(
            instance.number,
            str(name or "size"),
            unit,
            places,
            None if nominal is None else nominal.value,
            lower.value if lower else deviations[0],
            upper.value if upper else deviations[1],
            fit,
            tuple(notes),
        )

    def values_of(self, dimension: Instance) -> tuple[list[StatedMeasure], list[str]]:
        """The measures of a dimension, and words about it."""
        measures, notes = [], []
        for each in self.part21.named("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            own, representation = each.values()[:2]
            if own.number != dimension.number:
                continue
            self.used |= {each.number, representation.number}
            waiting = list(self.part21[representation].values("REPRESENTATION")[1])
            while waiting:
                item = self.part21[waiting.pop(0)]
                if "DESCRIPTIVE_REPRESENTATION_ITEM" in item.names:
                    notes.append(str(item.values(
                        "REPRESENTATION_ITEM", "DESCRIPTIVE_REPRESENTATION_ITEM")[1]))  # fmt: skip
                elif "COMPOUND_REPRESENTATION_ITEM" in item.names:
                    waiting += [TextReference(number) for number in item.references]
                elif (measure := measure_of(self.part21, item)) is not None:
                    measures.append(measure)
                    notes += self.qualifiers(item)
                else:
                    notes.append(f"#{item.number} {_short(item.text)}")
        return measures, notes

    def qualifiers(self, item: Instance) -> list[str]:
        """maximum, minimum, average: how a value is meant."""
        found = []
        for record in item.records:
            if record.name == "QUALIFIED_REPRESENTATION_ITEM":
                for each in record.values[0]:
                    own = self.part21[each]
                    if own.names == {"TYPE_QUALIFIER"} and own.values()[0] != "designed":
                        found.append(str(own.values()[0]))
        return found

    def deviations(
        self, dimension: Instance, nominal: StatedMeasure | None
    ) -> tuple[tuple[float | None, float | None], str]:
        """Limits by the nominal value and its deviations; the class of a fit."""
        for each in self.part21.named("PLUS_MINUS_TOLERANCE"):
            range_, own = each.values()[:2]
            if own.number != dimension.number:
                continue
            span = self.part21[range_]
            if span.names == {"LIMITS_AND_FITS"}:
                self.used |= {each.number, span.number}
                form, _, grade, *_ = span.values()
                fit = f"{form or ''}{str(grade or '').removeprefix('IT')}"
                found = None if nominal is None else limits_of_fit(nominal.value, fit)
                return found or (None, None), fit
            low, high = (measure_of(self.part21, self.part21[end]) for end in span.values()[:2])
            if low is None or high is None or nominal is None:
                raise PretravelError("a deviation without a value")
            self.used |= {each.number, span.number}
            ends = sorted((nominal.value + low.value, nominal.value + high.value))
            return (round(ends[0], 9), round(ends[1], 9)), ""
        return (None, None), ""

    # Tolerances

    def tolerance(self, instance: Instance) -> Tolerance:
        own = {record.name: record.values for record in instance.records}
        kinds = [TOLERANCE_ENTITIES[name.removesuffix("_TOLERANCE")] for name in own
                 if name.removesuffix("_TOLERANCE") in TOLERANCE_ENTITIES]  # fmt: skip
        if len(kinds) != 1:
            raise PretravelError("a tolerance of no kind that is known")
        values = instance.values("GEOMETRIC_TOLERANCE", "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE")
        magnitude, aspect = values[2:4]
        zone = None if magnitude is None else measure_of(self.part21, self.part21[magnitude])
        form, projected, notes, end = self.zone(instance)
        signs, displacement, more = self.added(own)
        return Tolerance(
            number=instance.number,
            kind=kinds[0],
            zone=None if zone is None else zone.value,
            place=self.place(aspect),
            datums=self.datum_references(values[4] or ()) if len(values) > 4 else (),
            modifiers=tuple(signs),
            form=form,
            projected=projected,
            displacement=displacement,
            notes=(*more, *notes),
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
        for each in self.part21.instances.values():
            if not any(name.endswith("TOLERANCE_ZONE") or name.startswith("TOLERANCE_ZONE_WITH")
                       for name in each.names):  # fmt: skip
                continue
            values = each.values("SHAPE_ASPECT", "TOLERANCE_ZONE")
            if tolerance.number not in _numbers(values[4:5]):
                continue
            shape = self.part21[values[5]]
            form = str(shape.values()[0])
            self.used |= {each.number, shape.number}
            if each.names - {"TOLERANCE_ZONE", "SHAPE_ASPECT"}:
                notes.append(f"#{each.number} {_short(each.text)}")
            for more in self.part21.named("PROJECTED_ZONE_DEFINITION"):
                own = more.values("TOLERANCE_ZONE_DEFINITION", "PROJECTED_ZONE_DEFINITION")
                if own[0].number == each.number:
                    projected = self.length(own[3])
                    end = self.place(own[2])
                    self.used.add(more.number)
        return form, projected, notes, end


_KNOWN = {"GEOMETRIC_TOLERANCE", "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE"}


def _sign(value: Any) -> str:
    """A modifier as on a drawing, else in the words of the text."""
    name = value.name if isinstance(value, Word | TextRecord) else str(value)
    if isinstance(value, TextRecord) and value.values:
        name = value.values[0].name
    return "" if name == _NO_MODIFIER else SIGNS.get(name, name.lower().replace("_", " "))


def _numbers(values: Any) -> list[int]:
    """Numbers of the instances in a value or in a list of them."""
    if isinstance(values, TextReference):
        return [values.number]
    if isinstance(values, TextRecord):
        return _numbers(values.values)
    if isinstance(values, tuple) and not isinstance(values, Word):
        return [number for each in values for number in _numbers(each)]
    return []


def _short(text: str) -> str:
    return text if len(text) <= 160 else f"{text[:157]}…"
