"""Results of a QIF document: characteristics with their measured values; reading."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET

from pretravel.files.file_format import FeatureResult
from pretravel.files.logs.qif_document import UNIT_NAMES, QifDocument, finite_number
from pretravel.files.source_file import SourceFile, shortened

_MEASURED = "CharacteristicMeasurement"
_ANGULAR = re.compile(r"Angle|Angular")
_FORM_OF_ANGLE = "Angularity"
"""A geometric tolerance: a width, although its name speaks of an angle."""
_DEGREES = {"degree": 1.0, "deg": 1.0, "radian": math.degrees(1.0), "rad": math.degrees(1.0)}


def read_characteristics(file: SourceFile) -> list[FeatureResult]:
    """Read the measured characteristics of a QIF document.

    Returns
    -------
    list of FeatureResult
        NaN for a nominal, or a value, that the document does not state. The component is the number
        of the results, where there are several.

    Raises
    ------
    InputError
        There are none; a unit is not known.
    """
    document = QifDocument(file)
    by_id = {each.get("id"): each for each in document.root.iter() if each.get("id")}
    results = list(document.root.iter(document.path("MeasurementResults")))
    found = []
    for number, part in enumerate(results or [document.root], start=1):
        for each in part.iter():
            tag = str(each.tag).removeprefix(document.prefix)
            if tag.endswith(_MEASURED):
                component = number if len(results) > 1 else 0
                found.append(_result(document, each, tag.removesuffix(_MEASURED), by_id, component))
    if not found:
        raise file.error("the document contains no measured characteristics", inputs=("features",))
    return found


def _result(
    document: QifDocument,
    measured: ET.Element,
    kind: str,
    by_id: dict[str | None, ET.Element],
    component: int,
) -> FeatureResult:
    line = document.lines(measured)[0] if (measured.text or "").split() else 0
    item = by_id.get(measured.findtext(document.path("CharacteristicItemId")))
    nominal = None if item is None else by_id.get(
        item.findtext(document.path("CharacteristicNominalId")) or ""
    )  # fmt: skip
    target = None if nominal is None else nominal.find(document.path("TargetValue"))
    wanted = _value(document, target, kind)
    actual = _value(document, measured.find(document.path("Value")), kind)
    quantity = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind).lower()
    return FeatureResult(
        component, _name(document, item, by_id), quantity, wanted, actual, actual - wanted, None,
        line,
    )  # fmt: skip


def _name(
    document: QifDocument, item: ET.Element | None, by_id: dict[str | None, ET.Element]
) -> str:
    """The name of a characteristic, with that of its feature where only this is stated."""
    if item is None:
        return ""
    for path in (("Name",), ("CharacteristicDesignator", "Designator")):
        if name := (item.findtext(document.path(*path)) or "").strip():
            return name
    feature = by_id.get(item.findtext(document.path("FeatureItemIds", "Id")))
    named = None if feature is None else feature.findtext(document.path("FeatureName"))
    return (named or item.get("id") or "").strip()


def _value(document: QifDocument, element: ET.Element | None, kind: str) -> float:
    """A value in mm or degrees."""
    if element is None or not (element.text or "").strip():
        return math.nan
    value = finite_number((element.text or "").strip())
    if _ANGULAR.search(kind) and kind != _FORM_OF_ANGLE:
        return value * _degrees(document, element)
    unit = element.get("linearUnit")
    if unit is None or unit == document.main_unit():
        return value * document.scale()
    scales = {**UNIT_NAMES, **document.declared_units()}
    if unit not in scales:
        raise document.file.error(f"the length unit '{shortened(unit)}' is not declared")
    return value * scales[unit]


def _degrees(document: QifDocument, element: ET.Element) -> float:
    """Degrees in the unit of an angle."""
    primary = document.root.find(document.path("FileUnits", "PrimaryUnits", "AngularUnit"))
    stated = element.get("angularUnit")
    name = None if primary is None else primary.findtext(document.path("UnitName"))
    if primary is not None and stated in (None, name):
        factor = primary.findtext(document.path("UnitConversion", "Factor"))
        if factor is not None:
            return math.degrees(finite_number(factor))
    unit = (stated or name or "radian").strip().lower()
    if unit not in _DEGREES:
        raise document.file.error(f"the unit of angles '{shortened(unit)}' is not known")
    return _DEGREES[unit]
