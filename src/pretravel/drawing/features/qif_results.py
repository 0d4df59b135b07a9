"""Measured features as the results of a QIF 3 document.

The order of elements is that of the public schema of QIF 3.0; documents of all kinds of quantities
were validated against it.
"""

from __future__ import annotations

import math
import uuid
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pretravel.base import PretravelError, installed_version, whole_file

_NAMESPACE = "http://qifstandards.org/xsd/qif3"
_SIZES = {"diameter": "Diameter", "width": "Width"}
_FORMS = {
    "roundness": "Circularity",
    "flatness": "Flatness",
    "straightness": "Straightness",
    "cylindricity": "Cylindricity",
}
"""Characteristics of QIF by the name of a quantity; others are user-defined."""
_STATUS = {
    "conforms": "PASS",
    "does not conform": "FAIL",
    "cannot be decided": "INDETERMINATE",
}
"""By the first words of a verdict. Others contain no errors of the machine, and stay words."""
_STANDARD = 1
"""The id of the standard that characteristics name."""


def write_qif_results(
    path: str | Path,
    rows: Sequence[Mapping[str, Any]],
    *,
    part: str,
    nominals: Mapping[tuple[str, str], float] | None = None,
) -> None:
    """Write quantities as characteristics with their measured values.

    Parameters
    ----------
    path : str or Path
    rows : sequence of mapping
        As of `pretravel.drawing.features.feature_results.result_rows`.
    part : str
        What was measured.
    nominals : mapping of (feature, quantity) to float, optional
        Nominal values, in mm or degrees.

    Notes
    -----
    ``combinedUncertainty`` of a value is its standard uncertainty, ``meanError`` 0, since known
    errors are corrected. Status is PASS or FAIL only where a verdict contains the errors of the
    machine; else it is the verdict in words.
    """
    nominals = nominals or {}
    root = ET.Element("QIFDocument", xmlns=_NAMESPACE, versionQIF="3.0.0")
    _texts(root, QPId=str(uuid.uuid4()))
    header = ET.SubElement(root, "Header")
    program = ET.SubElement(header, "Application")
    _texts(program, Name=f"pretravel {installed_version()}")
    _texts(header, Description=f"Quantities of {_printable(part)}")
    _write_standard(root)
    _write_units(root)
    characteristics = ET.SubElement(root, "Characteristics")
    _texts(characteristics, FormalStandardId=str(_STANDARD))
    count = str(len(rows))
    lists = {
        each: ET.SubElement(characteristics, f"Characteristic{each}s", n=count)
        for each in ("Definition", "Nominal", "Item")
    }
    results = ET.SubElement(ET.SubElement(root, "Results"), "MeasurementResultsSet", n="1")
    result = ET.SubElement(results, "MeasurementResults", id=str(_STANDARD + 1))
    measured = ET.SubElement(result, "MeasuredCharacteristics")
    lists["Measurement"] = ET.SubElement(measured, "CharacteristicMeasurements", n=count)
    last = _STANDARD + 1
    for row in rows:
        nominal = nominals.get((row["feature"], row["quantity"]))
        last = _write_characteristic(lists, row, nominal, last)
    status = ET.SubElement(result, "InspectionStatus")
    _texts(status, InspectionStatusEnum=_of_all(rows))
    root.set("idMax", str(last))
    ET.indent(root)
    with whole_file(path) as temporary:
        ET.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)


def _write_characteristic(
    lists: Mapping[str, ET.Element], row: Mapping[str, Any], nominal: float | None, last: int
) -> int:
    """Definition, nominal, item and measurement of one quantity; returns the last id used."""
    kind, tolerance = _kind(row), "ToleranceValue"
    ids = {each: str(last + 1 + i) for i, each in enumerate(lists)}
    elements = {
        each: ET.SubElement(where, f"{kind}Characteristic{each}", id=ids[each])
        for each, where in lists.items()
    }
    name = _printable(" ".join(filter(None, (row["feature"], row["quantity"]))))
    definition = elements["Definition"]
    if kind in _FORMS.values():
        _texts(definition, **{tolerance: _decimal(row["upper"])})
    else:
        _write_limits(definition, row)
    if kind.startswith("UserDefined"):
        _texts(definition, WhatToMeasure=f"{row['quantity']} of {row['kind']}")
    _texts(elements["Nominal"], CharacteristicDefinitionId=ids["Definition"])
    if nominal is not None and kind not in _FORMS.values():
        _texts(elements["Nominal"], TargetValue=_decimal(nominal))
    _texts(elements["Item"], Name=name, CharacteristicNominalId=ids["Nominal"])
    measurement = elements["Measurement"]
    _write_status(measurement, row["verdict"])
    _texts(measurement, CharacteristicItemId=ids["Item"])
    value = ET.SubElement(measurement, "Value")
    value.text = _decimal(row["value"])
    if row["u"] is not None:
        value.set("combinedUncertainty", _decimal(row["u"]))
        value.set("meanError", "0")
    return last + len(lists)


def _kind(row: Mapping[str, Any]) -> str:
    quantity = row["quantity"]
    if quantity in _SIZES:
        return "SphericalDiameter" if row["kind"] == "sphere" else _SIZES[quantity]
    if quantity in _FORMS and row["upper"] is not None:  # QIF has no form without a tolerance
        return _FORMS[quantity]
    return "UserDefinedAngular" if row["unit"] == "deg" else "UserDefinedLinear"


def _write_limits(definition: ET.Element, row: Mapping[str, Any]) -> None:
    limits = {"MaxValue": row["upper"], "MinValue": row["lower"]}
    stated = {name: _decimal(value) for name, value in limits.items() if value is not None}
    if not stated:
        _texts(definition, NonTolerance="MEASURED")
        return
    _texts(ET.SubElement(definition, "Tolerance"), **stated, DefinedAsLimit="true")


def _write_status(measurement: ET.Element, verdict: str | None) -> None:
    status = ET.SubElement(measurement, "Status")
    if verdict is None:
        _texts(status, CharacteristicStatusEnum="NOT_ANALYZED")
    elif (word := _status(verdict)) is not None:
        _texts(status, CharacteristicStatusEnum=word)
    else:
        _texts(status, OtherCharacteristicStatus=verdict)


def _status(verdict: str) -> str | None:
    return next((word for start, word in _STATUS.items() if verdict.startswith(start)), None)


def _of_all(rows: Sequence[Mapping[str, Any]]) -> str:
    found = {_status(row["verdict"]) for row in rows if row["verdict"] is not None}
    if not found:
        return "NOT_CALCULATED"
    if "FAIL" in found:
        return "FAIL"
    return "PASS" if found == {"PASS"} else "UNKNOWN"


def _write_standard(root: ET.Element) -> None:
    standard = ET.SubElement(
        ET.SubElement(root, "StandardsDefinitions", n="1"), "Standard", id=str(_STANDARD)
    )
    _texts(ET.SubElement(standard, "Organization"), StandardsOrganizationEnum="ISO")
    _texts(standard, Designator="1101")


def _write_units(root: ET.Element) -> None:
    units = ET.SubElement(ET.SubElement(root, "FileUnits"), "PrimaryUnits")
    for element, base, name, factor in (
        ("AngularUnit", "radian", "degree", math.radians(1.0)),
        ("LinearUnit", "meter", "mm", 1e-3),
    ):
        unit = ET.SubElement(units, element)
        _texts(unit, SIUnitName=base, UnitName=name)
        _texts(ET.SubElement(unit, "UnitConversion"), Factor=f"{factor:.18f}")


def _decimal(value: float) -> str:
    """A number without an exponent, as XML's decimals are."""
    return f"{value:.9f}"


def _texts(parent: ET.Element, **texts: str) -> None:
    for name, text in texts.items():
        ET.SubElement(parent, name).text = text


def _printable(text: str) -> str:
    text = " ".join(text.split())
    if not text.isprintable():
        raise PretravelError(
            f"{text!r}: an XML file cannot carry control characters; use another name",
            inputs=("output",),
        )
    return text
