"""Features and tolerances of measuring plans: QIF (ISO 23952) and DMIS (ISO 22093) as a drawing."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import InputError, PretravelError
from pretravel.drawing.features.measured_feature import FORM_NAMES
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature, DrawnRelation
from pretravel.drawing.tolerances.tolerance_frame import (
    ANGULARITY,
    CONCENTRICITY,
    CYLINDRICITY,
    FLATNESS,
    LEAST,
    MAXIMUM,
    PARALLELISM,
    PERPENDICULARITY,
    POSITION,
    PROFILE,
    ROUNDNESS,
    RUN_OUT,
    SYMMETRY,
    TOTAL_RUN_OUT,
    GeometricTolerance,
)
from pretravel.files import QifDocument, SourceFile, finite_number, opened, statements

QIF_ENDINGS, DMIS_ENDINGS = (".qif",), (".dmi", ".dmis", ".dmo")
PLAN_ENDINGS = (*QIF_ENDINGS, *DMIS_ENDINGS)
"""Names of plans end so."""
_MOST_NOTES = 12
_FORMS = ("flatness", "roundness", "cylindricity", "straightness", "sphericity", "conicity")


def read_plan_features(path: str | Path) -> tuple[Drawing, tuple[str, ...]]:
    """Read the features and tolerances that a plan names.

    Parameters
    ----------
    path : str or Path
        .qif, .dmi, .dmis or .dmo.

    Returns
    -------
    Drawing
        The points of a feature are those whose labels begin with its name, followed by no digit:
        ``HOLE1-1``, ``HOLE1_2`` belong to ``HOLE1``.
    tuple of str
        What was left out, and why.

    Raises
    ------
    InputError
        Neither QIF nor DMIS, no features, or a value that is not a number.

    >>> import tempfile
    >>> plan = Path(tempfile.mkdtemp()) / "plan.dmi"
    >>> text = '''UNITS/MM,ANGDEC
    ... F(HOLE)=FEAT/CYLNDR,INNER,CART,10,20,0,0,0,1,8
    ... T(D1)=TOL/DIAM,-0.01,0.02
    ... OUTPUT/FA(HOLE),TA(D1)
    ... '''
    >>> drawing, notes = read_plan_features(plan.write_text(text) and plan)
    >>> drawing.feature[0].kind, drawing.feature[0].tolerance, drawing.feature[0].at
    ('cylinder', '7.99..8.02', (10.0, 20.0, 0.0))
    """
    file = opened(path)
    plan = _Plan(file)
    if Path(path).suffix.lower() in QIF_ENDINGS:
        _read_qif(file, plan)
    else:
        _read_dmis(file, plan)
    return plan.drawing()


@dataclass
class _Feature:
    """A feature of a plan, with what was found of it so far."""

    name: str
    kind: str
    at: tuple[float, float, float] | None = None
    axis: tuple[float, float, float] | None = None
    diameter: float | None = None
    size: tuple[float, float] | None = None
    form: float | None = None
    position: float | None = None
    geometric: list[GeometricTolerance] = field(default_factory=list)


@dataclass
class _Plan:
    """What was read of a plan so far: features by name, datums by letter."""

    file: SourceFile
    features: dict[str, _Feature] = field(default_factory=dict)
    datums: dict[str, str] = field(default_factory=dict)
    between: list[DrawnRelation] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    taken: list[str] = field(default_factory=list)

    def datum(self, letter: str) -> str:
        """The name of a datum's feature: stated, or that of the feature that is called so."""
        if letter not in self.datums:
            words = (letter, f"DATUM_{letter}", f"DAT_{letter}", f"DATUM {letter}")
            called = [name for name in words
                      if name in self.features]  # fmt: skip
            if not called:
                raise PretravelError(f"datum {letter} has no feature")
            self.datums[letter] = called[0]
            self.taken.append(f"datum {letter} is taken to be {called[0]}, by its name")
        return self.datums[letter]

    def add_datum(self, letter: str | None, names: list[str]) -> None:
        """Add a datum of one feature, or note that it has several."""
        if letter and len(names) > 1:
            self.notes.append(f"datum {letter} of several features: {', '.join(names)}")
        elif letter and names:
            self.datums[letter] = names[0]

    def allow(
        self,
        name: str,
        kind: str,
        zone: float,
        datums: list[str],
        material: str = "",
    ) -> None:
        """Add a tolerance, or note why it is left out."""
        feature = self.features[name]
        try:
            if kind in _FORMS:
                self._allow_form(feature, kind, zone)
            elif kind == POSITION and not datums:
                _refuse_second(kind, feature.position, zone)
                feature.position = zone
            else:
                feature.geometric.append(GeometricTolerance(kind, zone, tuple(datums), material))
        except PretravelError as error:
            self.notes.append(f"{name}: {error}")

    def _allow_form(self, feature: _Feature, kind: str, zone: float) -> None:
        """The form of the whole feature, that of its sections, or a stricter one of its lines."""
        own = FORM_NAMES.get(feature.kind, {"sphere": "sphericity", "cone": "conicity"}.get(
            feature.kind, ""))  # fmt: skip
        if kind == own:
            _refuse_second(kind, feature.form, zone)
            feature.form = zone
        elif kind == ROUNDNESS and feature.kind in ("cylinder", "cone"):
            feature.geometric.append(GeometricTolerance(ROUNDNESS, zone))
        elif kind == "straightness" and own in (FLATNESS, CYLINDRICITY):
            feature.geometric.append(GeometricTolerance(own, zone, instead_of="straightness"))
        else:
            raise PretravelError(f"the {kind} of a {feature.kind} is not read")

    def drawing(self) -> tuple[Drawing, tuple[str, ...]]:
        if not self.features:
            raise self.file.error(
                "the plan names no feature that is measured here (circle, cylinder, cone, sphere, "
                "plane)"
            )
        features = tuple(
            DrawnFeature(
                kind=each.kind,
                select=_select(each.name),
                label=each.name,
                axis=each.axis,
                at=each.at,
                tolerance=None
                if each.size is None
                else f"{each.size[0]:.10g}..{each.size[1]:.10g}",
                nominal=each.diameter,
                position_tolerance=each.position,
                form_tolerance=each.form,
                geometric=tuple(each.geometric),
            )
            for each in self.features.values()
        )
        more = [f"{len(self.notes) - _MOST_NOTES} more"] if len(self.notes) > _MOST_NOTES else []
        notes = tuple(f"{self.file.path}: left out: {note}"
                      for note in [*self.notes[:_MOST_NOTES], *more])  # fmt: skip
        taken = tuple(f"{self.file.path}: {each}" for each in self.taken)
        return Drawing(features, (), tuple(self.between)), (*taken, *notes)


def _refuse_second(kind: str, known: object, value: object) -> None:
    """Refuse a second tolerance of the same quantity, with other limits."""
    if known not in (None, value):
        raise PretravelError(f"a second {kind} with another tolerance is not read")


def _select(name: str) -> str:
    """Labels that begin with a name, followed by no digit."""
    return "".join(f"[{sign}]" if sign in "*?[" else sign for sign in name) + "[!0-9]*"


def _unit(values: list[float]) -> tuple[float, float, float]:
    length = float(np.linalg.norm(values))
    x, y, z = np.array(values) / (length or 1.0)
    return float(x), float(y), float(z)


# DMIS

_DEFINED = re.compile(r"^F\s*\(([^)]+)\)\s*=\s*FEAT\s*/\s*(.*)$", re.I)
_TOLERANCE = re.compile(r"^T\s*\(([^)]+)\)\s*=\s*TOL\s*/\s*(.*)$", re.I)
_DATUM = re.compile(r"^DATDEF\s*/\s*FA?\s*\(([^)]+)\)\s*,\s*DAT\s*\(([^)]+)\)", re.I)
_OUTPUT = re.compile(r"^(?:OUTPUT|EVAL)\s*/\s*(.*)$", re.I)
_NAMED = re.compile(r"^(FA|F|TA|T|DAT)\s*\(([^)]+)\)$", re.I)
_MOVED = re.compile(r"^(?:D\s*\([^)]*\)\s*=\s*)?(?:TRANS|ROTATE|DATSET|BESTFIT|LOCATE)\s*/", re.I)
_UNITS = re.compile(r"^UNITS\s*/\s*(\w+)", re.I)
_DMIS_KINDS = {"CYLNDR": "cylinder", "CONE": "cone", "SPHERE": "sphere", "PLANE": "plane"}
_DMIS_TOLERANCES = {
    "FLAT": FLATNESS, "CIRLTY": ROUNDNESS, "CYLCTY": CYLINDRICITY, "STRGHT": "straightness",
    "POS": POSITION,
    "PARLEL": PARALLELISM, "PERP": PERPENDICULARITY, "ANGLR": ANGULARITY, "PROFS": PROFILE,
    "CONCEN": CONCENTRICITY, "SYM": SYMMETRY, "CRNOUT": RUN_OUT, "TRNOUT": TOTAL_RUN_OUT,
}  # fmt: skip


def _read_dmis(file: SourceFile, plan: _Plan) -> None:
    scale: float | None = None
    tolerances: dict[str, tuple[list[str], int]] = {}
    outputs: list[list[str]] = []
    moved: list[int] = []
    for number, statement in statements(file.lines("a DMIS file")):
        if found := _UNITS.match(statement):
            scale = _dmis_units(file, found[1].upper(), scale, number)
        elif found := _DEFINED.match(statement):
            if scale is None:
                raise file.error("the file has no UNITS before its features", number)
            _dmis_feature(plan, found[1].strip(), _words(found[2]), (scale, number))
        elif found := _TOLERANCE.match(statement):
            name, words = found[1].strip(), _words(found[2])
            known = tolerances.setdefault(name, (words, number))
            _refuse_twice(file, f"T({name})", known[0] == words, number)
        elif found := _DATUM.match(statement):
            letter, own = found[2].strip(), found[1].strip()
            same = plan.datums.setdefault(letter, own) == own
            _refuse_twice(file, f"DAT({letter})", same, number)
        elif found := _OUTPUT.match(statement):
            outputs.append(_words(found[1]))
        elif plan.features and _MOVED.match(statement):
            moved.append(number)
    if scale is None:
        raise file.error("this is not a DMIS plan: it has no UNITS")
    if moved:
        plan.taken.append(
            f"line {moved[0]}: the coordinates change behind the first feature. All nominal places "
            "are taken as those of one frame, that of the points"
        )
    _dmis_outputs(plan, tolerances, outputs, scale)


def _dmis_units(file: SourceFile, word: str, before: float | None, number: int) -> float:
    scale = file.scale({"MM": "mm", "INCH": "inch"}.get(word), "the UNITS")
    if before not in (None, scale):
        raise file.error("the UNITS change: numbers before and after differ", number)
    return scale


def _refuse_twice(file: SourceFile, name: str, same: bool, number: int) -> None:
    if not same:
        raise file.error(f"{name} is defined twice", number)


def _dmis_outputs(
    plan: _Plan,
    tolerances: dict[str, tuple[list[str], int]],
    outputs: list[list[str]],
    scale: float,
) -> None:
    """Give each feature the tolerances with which it is put out."""
    asked: set[tuple[str, str]] = set()
    for words in outputs:
        named = [(found[1].upper(), found[2].strip())
                 for word in words if (found := _NAMED.match(word))]  # fmt: skip
        names = [name for kind, name in named if kind in ("F", "FA")]
        for kind, name in named:
            if kind in ("T", "TA") and names and (names[0], name) not in asked:
                asked.add((names[0], name))
                if name not in tolerances:
                    plan.notes.append(f"T({name}), which is not defined")
                elif names[0] in plan.features:
                    own, number = tolerances[name]
                    _dmis_tolerance(plan, names[0], name, own, (scale, number))
    plan.notes += [
        f"T({name}), with which no feature is put out"
        for name in tolerances if name not in {name for _, name in asked}
    ]  # fmt: skip


def _words(text: str) -> list[str]:
    return [word.strip() for word in re.split(r",(?![^(]*\))", text)]


def _dmis_feature(plan: _Plan, name: str, words: list[str], where: tuple[float, int]) -> None:
    scale, number = where
    shape = words[0].upper()
    sides = [word.upper() for word in words[1:] if word.upper() in ("INNER", "OUTER")]
    kind = _DMIS_KINDS.get(shape)
    if shape in ("CIRCLE", "ARC"):
        kind = {"INNER": "bore", "OUTER": "boss"}.get(sides[0] if sides else "", "circle")
    if kind is None:
        if shape != "POINT":
            plan.notes.append(f"F({name}), a {shape}")
        return
    if "CART" not in [word.upper() for word in words]:
        plan.notes.append(f"F({name}), which is not given in CART")
        return
    start = [word.upper() for word in words].index("CART") + 1
    numbers = plan.file.numbers([word for word in words[start:] if word], number)
    if len(numbers) < (3 if kind == "sphere" else 6):
        raise plan.file.error(f"F({name}) has {len(numbers)} numbers; x, y, z, i, j, k are needed",
                              number)  # fmt: skip
    at = tuple(scale * value for value in numbers[:3])
    if name in plan.features:
        raise plan.file.error(f"F({name}) is defined twice", number)
    own = _Feature(name, kind, at)  # type: ignore[arg-type]
    rest = numbers[3:]
    if kind != "sphere":
        own.axis, rest = _unit(numbers[3:6]), numbers[6:]
    if rest and kind not in ("plane", "cone"):
        own.diameter = scale * rest[0]
    plan.features[name] = own


def _dmis_tolerance(
    plan: _Plan, feature: str, name: str, words: list[str], where: tuple[float, int]
) -> None:
    scale, number = where
    shape, own = words[0].upper(), plan.features[feature]
    plain = [
        word for word in words[1:] if re.match(r"^[+-]?[\d.]", word) and "D" not in word.upper()
    ]
    values = [scale * value for value in plan.file.numbers(plain, number)]
    try:
        if shape in ("DIAM", "RAD") and len(values) >= 2:
            if own.diameter is None:
                raise PretravelError("the feature has no diameter")
            factor = 1.0 if shape == "DIAM" else 2.0
            size = (own.diameter + factor * values[0], own.diameter + factor * values[1])
            _refuse_second("size", own.size, size)
            own.size = size
            return
        kind = _DMIS_TOLERANCES.get(shape)
        if kind is None or not values:
            raise PretravelError(f"{shape} is not read")
        _refuse_other_words(words[1:], values, kind)
        zone = values[-1] if kind == ANGULARITY else values[0]
        if kind == PROFILE and len(values) > 1:
            zone = abs(values[1] - values[0])
            if abs(values[0] + values[1]) > 1e-9 * zone:
                raise PretravelError("a profile with unequal sides is not read")
        datums, material, upper = [], "", [word.upper() for word in words]
        for index, word in enumerate(words):
            if not (found := _NAMED.match(word)) or found[1].upper() in ("T", "TA"):
                continue
            letter = found[2].strip()
            one = plan.datum(letter) if found[1].upper() == "DAT" else letter
            after = upper[index + 1] if index + 1 < len(words) else ""
            if after == "LMC":
                raise PretravelError(f"datum {letter} at least material is not read")
            datums.append(f"{one}(M)" if after == "MMC" else one)
        first = next((i for i, word in enumerate(words) if _NAMED.match(word)), len(words))
        if "MMC" in upper[:first]:
            material = MAXIMUM
        elif "LMC" in upper[:first]:
            material = LEAST
        plan.allow(feature, kind, zone, datums, material)
    except PretravelError as error:
        if isinstance(error, InputError):
            raise
        plan.notes.append(f"T({name}) of {feature}: {error}")


def _refuse_other_words(words: list[str], values: list[float], kind: str) -> None:
    """Refuse what changes the zone of a tolerance, and is not read."""
    more = [
        word for word in words
        if not _NAMED.match(word) and not re.match(r"^[+-]?[\d.]", word)
        and word.upper() not in _DMIS_WORDS
    ]  # fmt: skip
    if more:
        raise PretravelError(f"{more[0]} is not read")
    if len(values) > (2 if kind in (PROFILE, ANGULARITY) else 1):
        raise PretravelError(f"the second number, {values[1]:g} mm, is not read")


_DMIS_WORDS = ("", "MMC", "LMC", "RFS", "2D", "3D")

# QIF

_QIF_KINDS = {
    "Circle": "circle", "Cylinder": "cylinder", "Cone": "cone", "Sphere": "sphere",
    "Plane": "plane", "Torus": "torus",
}  # fmt: skip
_QIF_NOT_READ = re.compile(
    "IntersectionPlane|OrientationPlane|ToPoint|OrientationOnly|MaximumTolerance|Elongated|"
    "BoundaryZone|OuterDisposition|Projected|Tangent|FreeState|Statistical|UnitLength|UnitArea"
)
"""What changes the zone of a tolerance (QIF 3, CharacteristicTypes)."""
_QIF_SIDES = {"INTERNAL": "bore", "EXTERNAL": "boss"}
_QIF_TOLERANCES = {
    "Flatness": FLATNESS, "Circularity": ROUNDNESS, "Cylindricity": CYLINDRICITY,
    "Straightness": "straightness", "Sphericity": "sphericity", "Conicity": "conicity",
    "Position": POSITION,
    "Perpendicularity": PERPENDICULARITY, "Parallelism": PARALLELISM, "Angularity": ANGULARITY,
    "SurfaceProfile": PROFILE, "Concentricity": CONCENTRICITY, "Coaxiality": "coaxiality",
    "Symmetry": SYMMETRY, "CircularRunout": RUN_OUT, "TotalRunout": TOTAL_RUN_OUT,
}  # fmt: skip
_PRECEDENCE = ("PRIMARY", "SECONDARY", "TERTIARY")


def _read_qif(file: SourceFile, plan: _Plan) -> None:
    document = QifDocument(file)
    scale, root, path = document.scale(), document.root, document.path

    def children(*names: str) -> Iterator[ET.Element]:
        for parent in root.iter(path(names[-1])):
            yield from (child for child in parent if not callable(child.tag))

    def text(element: ET.Element | None, *names: str) -> str | None:
        found = None if element is None else element.findtext(path(*names))
        return None if found is None else found.strip()

    def by_id(group: str) -> dict[str, ET.Element]:
        return {each.get("id", ""): each for each in children(group)}

    definitions, nominals, items = map(
        by_id, ("FeatureDefinitions", "FeatureNominals", "FeatureItems")
    )
    names: dict[str, str] = {}  # of items and of nominals
    for identity, item in (items or nominals).items():  # a drawing without a plan has no items
        nominal_id = text(item, "FeatureNominalId") or "" if items else identity
        name = text(item, "FeatureName") or text(item, "Name") or f"feature {identity}"
        if name in plan.features:
            raise file.error(f"two features are called '{name}'")
        _qif_feature(plan, name, item, nominals.get(nominal_id), (definitions, text, scale))
        names[identity] = name
        names.setdefault(nominal_id, name)
    for datum in children("DatumDefinitions"):
        ids = [each.text or "" for part in ("FeatureNominalIds", "FeatureItemIds")
               for each in datum.iterfind(path(part, "Id"))]  # fmt: skip
        known = [names[identity.strip()] for identity in ids if identity.strip() in names]
        plan.add_datum(text(datum, "DatumLabel"), list(dict.fromkeys(known)))
    labels = {
        each.get("id", ""): text(each, "DatumLabel") or "" for each in children("DatumDefinitions")
    }
    frames = {each.get("id", ""): each for each in children("DatumReferenceFrames")}
    kinds, targets = by_id("CharacteristicDefinitions"), by_id("CharacteristicNominals")
    for item in list(children("CharacteristicItems")) or list(targets.values()):
        nominal = targets.get(text(item, "CharacteristicNominalId") or "", item)
        kind = kinds.get(text(nominal, "CharacteristicDefinitionId") or "")
        named = ((item, "FeatureItemIds"), (nominal, "FeatureNominalIds"))
        ids = [each.text or "" for one, part in named
               for each in one.iterfind(path(part, "Id"))]  # fmt: skip
        own = list(dict.fromkeys(names[i.strip()] for i in ids if i.strip() in names))
        if kind is None or not own:
            plan.notes.append(
                f"characteristic {text(item, 'Name') or item.get('id')}: it names no feature"
            )
            continue
        for name in own:
            if name in plan.features:
                _qif_tolerance(plan, name, kind, (nominal, frames, labels, text, path, scale))


_Text = Callable[..., "str | None"]


def _vector(value: str | None) -> list[float] | None:
    numbers = [finite_number(word) for word in (value or "").split()]
    return numbers if len(numbers) == 3 and np.all(np.isfinite(numbers)) else None


def _qif_feature(
    plan: _Plan,
    name: str,
    item: ET.Element,
    nominal: ET.Element | None,
    known: tuple[dict[str, ET.Element], _Text, float],
) -> None:
    definitions, text, scale = known
    shape = str(item.tag).rpartition("}")[2].removesuffix("FeatureItem")
    shape = shape.removesuffix("FeatureNominal")
    kind = _QIF_KINDS.get(shape)
    definition = definitions.get(text(nominal, "FeatureDefinitionId") or "")
    if kind is None:
        if not shape.endswith("Point"):
            plan.notes.append(f"{name}, a {shape}")
        return
    if kind == "circle":
        kind = _QIF_SIDES.get(text(definition, "InternalExternal") or "", kind)
    own = _Feature(name, kind)
    place = _vector(text(nominal, "Location") or text(nominal, "Axis", "AxisPoint"))
    axis = _vector(text(nominal, "Normal") or text(nominal, "Axis", "Direction"))
    if place is not None:
        x, y, z = (scale * value for value in place)
        own.at = (x, y, z)
    if axis is not None and kind != "sphere" and float(np.linalg.norm(axis)) > 0.0:
        own.axis = _unit(axis)
    size = finite_number(text(definition, "Diameter") or "")
    own.diameter = None if np.isnan(size) else scale * size
    plan.features[name] = own


def _qif_tolerance(plan: _Plan, name: str, kind: ET.Element, known: tuple[Any, ...]) -> None:
    nominal, frames, labels, text, path, scale = known
    own = plan.features[name]
    word = str(kind.tag).rpartition("}")[2].removesuffix("CharacteristicDefinition")
    try:
        if word in ("Diameter", "Radius"):
            if kind.find(path("Tolerance")) is None:
                return  # measured or set, without a tolerance
            ends = [
                finite_number(text(kind, "Tolerance", end) or "")
                for end in ("MinValue", "MaxValue")
            ]
            factor = scale if word == "Diameter" else 2.0 * scale
            target = finite_number(text(nominal, "TargetValue") or "")
            middle = factor * target if not np.isnan(target) else own.diameter
            if (text(kind, "Tolerance", "DefinedAsLimit") or "").lower() in ("true", "1"):
                middle = 0.0
            if middle is None or np.isnan(ends).any():
                raise PretravelError("its limits are not known")
            size = (middle + factor * ends[0], middle + factor * ends[1])
            _refuse_second("size", own.size, size)
            own.size = size
            return
        meant = _QIF_TOLERANCES.get(word)
        zone = finite_number(text(kind, "ToleranceValue") or "")
        if meant is None or np.isnan(zone):
            raise PretravelError(f"{word} is not read")
        for child in kind:
            if "CompositeSegment" in str(child.tag):
                plan.notes.append(f"{word} of {name}: the lower segment of its frame is not read")
            else:
                _refuse_other_zone(child, own.kind)
        frame = frames.get(text(kind, "DatumReferenceFrameId") or "")
        material = {"MAXIMUM": MAXIMUM, "LEAST": LEAST}.get(
            text(kind, "MaterialCondition") or "", ""
        )
        datums = _qif_datums(plan, frame, (labels, text, path))
        plan.allow(name, meant, scale * zone, datums, material)
    except PretravelError as error:
        if isinstance(error, InputError):
            raise
        plan.notes.append(f"{word} of {name}: {error}")


def _refuse_other_zone(part: ET.Element, kind: str) -> None:
    """Refuse what changes the zone of a tolerance, and is not read."""
    for element in part.iter():
        if element.get("linearUnit") is not None:
            raise PretravelError("its own unit is not read")
        tag = str(element.tag).rpartition("}")[2]
        off = (element.text or "").strip().lower() in ("false", "0")
        flat = tag in ("NonDiametricalZone", "PlanarZone") and kind != "plane"
        if (flat or _QIF_NOT_READ.search(tag)) and not off:
            raise PretravelError(f"{tag} is not read")


def _qif_datums(plan: _Plan, frame: ET.Element | None, known: tuple[Any, ...]) -> list[str]:
    labels, text, path = known
    found: dict[str, str] = {}
    for datum in [] if frame is None else frame.iterfind(path("Datums", "Datum")):
        order = text(datum, "Precedence", "PrecedenceEnum") or ""
        simple = datum.find(path("SimpleDatum"))
        if simple is None or order not in _PRECEDENCE:
            raise PretravelError("a compound datum is not read")
        name = plan.datum(labels.get(text(simple, "DatumDefinitionId") or "", "?"))
        modifier = text(simple, "MaterialModifier") or ""
        if modifier == "LEAST":
            raise PretravelError("a datum at least material is not read")
        found[order] = f"{name}(M)" if modifier == "MAXIMUM" else name
    return [found[order] for order in _PRECEDENCE if order in found]
