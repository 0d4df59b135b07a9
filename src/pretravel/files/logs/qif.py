"""QIF 3 (ISO 23952): MeasuredPointSet; reading and writing. QIF 2: reading of its points."""

from __future__ import annotations

import math
import re
import uuid
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import FloatArray, InputError, whole_file
from pretravel.files.column_names import LENGTH_UNITS
from pretravel.files.csv_table import exact_number
from pretravel.files.file_format import (
    FeatureResult,
    FileFormat,
    FilePositions,
    FileReadings,
    PointsOrigin,
    ReadingOptions,
    labels_or_numbers,
    refuse_contradicted_unit,
)
from pretravel.files.logs.plain_labels import plain_labels
from pretravel.files.logs.qif_characteristics import read_characteristics
from pretravel.files.logs.qif_document import (
    COMPENSATED,
    NAMESPACE,
    UNIT_NAMES,
    PointSet,
    QifDocument,
    finite_number,
    own_text,
    unit_normals,
)
from pretravel.files.logs.qif_measure_points import read_measure_points
from pretravel.files.row_statements import RowStatement, StatedRows
from pretravel.files.source_file import Source, SourceFile, opened, shortened
from pretravel.touches import Touches, word_fields

if TYPE_CHECKING:
    from pretravel.measurement import Points

_Q = f"{{{NAMESPACE}}}"
_SETS = "Results", "MeasurementResultsSet", "MeasurementResults", "MeasuredPointSets"
_RADIUS_DIGITS = 9
"""Radii are compared to this digit of a millimetre: systems print them with their rounding."""
_READ_OF_SET = {
    "Points", "Normals", "Compensated", "Compensations", "ProbeRadius", "ProbeRadii", "Units",
    "SensorId", "SensorIds", "TipId", "TipIds", "MeasurementDeviceId", "Deviations", "Colors",
    "PointIndices", "NumberOfFacets", "MeasurePointNominalIds", "TimeStamp", "TimeStamps",
}  # fmt: skip
"""Elements of a set that are read, or change no point."""
_LABELS = "labels:"
"""Begins the comment that contains the labels of a set."""


def read_point_sets(source: Source) -> list[PointSet]:
    """Read every MeasuredPointSet of a QIF 3 document, or the MeasurePoints of QIF 2 as one set.

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        The file is not XML or has another version of QIF; a list has not the length of the count;
        a number is not finite; a list is binary.
    """
    file = opened(source)
    document = QifDocument(file)
    if document.is_version_2:
        found = read_measure_points(document)
        sets = [] if found is None else [found]
    else:
        scale, main_unit = document.scale(), document.main_unit()
        results = document.root.findall(document.path(*_SETS[:-1]))
        sets = []
        for number, result in enumerate(results, start=1):
            elements = result.findall(document.path(_SETS[-1], "MeasuredPointSet"))
            for each in elements:
                device = each.findtext(document.path("MeasurementDeviceId"), "").strip()
                part = f"part {number}" + (f" device {device}" if device else "")
                made = _SetElement(document, each).point_set(scale, main_unit)
                sets.append(replace(made, part=part))
    if not sets:
        raise file.error(
            "the document contains no measured points (QIF 3: Results/MeasurementResultsSet/"
            "MeasurementResults/MeasuredPointSets; QIF 2: MeasurePoint), at most features and "
            "characteristics, from which no touches can be made. Let the system that wrote it "
            "export its points too; its characteristics can be written as a table"
        )
    return sets


def read_qif(source: Source) -> FileReadings | FilePositions:
    """Read touches of a QIF document from its points that are not compensated.

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    FileReadings, or FilePositions
        Positions where there are no normals: they must be joined with a plan.

    Raises
    ------
    InputError
        As `read_point_sets`; the points are already compensated.
    """
    file = opened(source)
    sets = read_point_sets(file)
    for point_set in sets:
        if any(point_set.compensated):
            label = point_set.labels[point_set.compensated.index(True)]
            raise file.error(
                f"the probe radius was already subtracted from point {label} (Compensated true); "
                "tip centres are needed. In Python, pretravel.files.logs.qif.read_point_sets reads "
                "such points"
            )
    points = np.concatenate([s.points for s in sets])
    lines = tuple(line for s in sets for line in s.lines)
    normals = [s.normals for s in sets if s.normals is not None]
    told = _not_read(file, sets)
    if len(normals) < len(sets):
        return FilePositions(file.path, points, lines, words=_words(sets), warnings=told)
    radii = np.unique(np.concatenate([_radii(s) for s in sets]).round(_RADIUS_DIGITS))
    with file.named_in_errors(lines):
        touches = Touches(
            positions=points,
            normals=np.concatenate(normals),
            labels=tuple(label for s in sets for label in s.labels),
            source=file.name,
            lines=lines,
            **word_fields(_words(sets)),
        )
    common = len(radii) == 1 and radii[0] > 0.0
    return FileReadings(touches, tip_radius=float(radii[0]) if common else None, warnings=told)


def _not_read(file: SourceFile, sets: list[PointSet]) -> tuple[str, ...]:
    """Sentences about what the sets, and notes of the document, state and nothing reads."""
    stated = StatedRows(file)
    for line, text in QifDocument(file).notes():
        if not text.startswith(_LABELS):
            stated.note(text, line)
    unread = dict.fromkeys(s.unread for s in sets if s.unread)
    return (*(f"not read: {each}" for each in unread), *stated.warnings())


def _words(sets: list[PointSet]) -> dict[str, tuple[str, ...]]:
    """Tip and part of each point, where there are several of them."""
    radii = [each for s in sets for each in _radii(s).round(_RADIUS_DIGITS).tolist()]
    names = [name for s in sets for name in s.tips or ("",) * len(s.points)]
    tips = tuple(
        f"{name} R{radius:.9g}".strip() if np.isfinite(radius) else name
        for name, radius in zip(names, radii, strict=True)
    )
    parts = tuple(s.part for s in sets for _ in s.lines)
    words = {"tip": tips, "part": parts}
    return {name: each for name, each in words.items() if len(set(each)) > 1}


def _radii(point_set: PointSet) -> FloatArray:
    """Return the probe radii of a set, NaN where it states no radius."""
    unknown = np.full(len(point_set.points), np.nan)
    return unknown if point_set.radii is None else point_set.radii


class _SetElement:
    """The element of a MeasuredPointSet, and errors that name it."""

    def __init__(self, document: QifDocument, element: ET.Element) -> None:
        self.document = document
        self.element = element
        self.name = f"MeasuredPointSet {element.get('id', '?')}"

    def error(self, message: str) -> InputError:
        return self.document.file.error(f"{self.name}: {message}")

    def _own_scale(self, scale: float, main_unit: str | None) -> float:
        """Return the millimetres in the set's own unit, or else in the document's.

        A set states it in Units, or as linearUnit; a name may be one that FileUnits declares.
        """
        units = self.element.find(f"{_Q}Units")
        own = {} if units is None else self.document.units_in(units)
        attributes = [] if units is None else [e.get("linearUnit") for e in units.iter()]
        named = [self.element.get("linearUnit"), *attributes]
        words = {*own, *(word.strip() for word in named if word and word.strip())}
        if units is not None and not words:
            plain = (own_text(units) or "").strip()
            if not plain and len(units):
                return scale  # units of other quantities
            words = {plain} if plain else words
        if len(words) > 1:
            raise self.error(f"it gives several units of length: {', '.join(sorted(words))}")
        unit = words.pop() if words else None
        if unit is None or (unit == main_unit and unit not in own):
            return scale
        known = {**UNIT_NAMES, **self.document.declared_units(), **own}
        for word in (unit, unit.lower()):
            if word in known:
                return known[word]
        raise self.error(f"its length unit '{unit}' is not known, and FileUnits does not define it")

    def point_set(self, scale: float, main_unit: str | None) -> PointSet:
        """Read the whole set; the unit's millimetres and its name are the document's."""
        scale = self._own_scale(scale, main_unit)
        self._refuse_what_is_not_read()
        count = self._count()
        points = self._numbers("Points", 3 * count)
        if points is None:
            raise self.error("it has no Points")
        normals = self._numbers("Normals", 3 * count)
        radii = self._radii(count)
        return PointSet(
            scale * points.reshape(-1, 3),
            self._compensated(count),
            None
            if normals is None
            else unit_normals(normals.reshape(-1, 3), lambda _, message: self.error(message)),
            None if radii is None else scale * radii,
            self._labels(count),
            self._lines(),
            tips=self._tips(count),
            unread=self._unread(),
        )

    def _tips(self, count: int) -> tuple[str, ...]:
        """Read the sensor and the tip of each point: one for all points, or one for each."""
        words = [""] * count
        for tag, name in (("SensorId", "sensor"), ("TipId", "tip")):
            found = (self._text(tag) or self._text(f"{tag}s") or "").split()
            if len(found) not in (0, 1, count):
                raise self.error(f"it has {len(found)} {tag}s for its count of {count}")
            own = found * (count if len(found) == 1 else 1)
            words = [f"{a} {name} {b}".strip() for a, b in zip(words, own, strict=False)] or words
        return tuple(words)

    def _unread(self) -> str:
        """What the set states and nothing reads."""
        tags = [str(child.tag)[len(_Q) :] for child in self.element if not callable(child.tag)]
        found = [tag for tag in dict.fromkeys(tags) if tag not in _READ_OF_SET]
        validity = self.element.get("validity", "MEASURED")
        found += [f"validity {validity}"] * (validity != "MEASURED")
        return f"{', '.join(found)} of a MeasuredPointSet" if found else ""

    def _count(self) -> int:
        """Read the number of points; a file cannot have more of them than characters."""
        stated = self.element.get("count", "")
        if not re.fullmatch("[0-9]{1,12}", stated.strip()):
            raise self.error("it does not give its count") from None
        if not 1 <= int(stated) <= len(self.document.file.content):
            raise self.error(f"its count is {stated}, which cannot be its number of points")
        return int(stated)

    def _refuse_what_is_not_read(self) -> None:
        for child in ("CoordinateSystemId", "TranformId", "TransformId"):  # the first without s
            if self.element.find(f"{_Q}{child}") is not None:
                raise self.error(
                    f"it has its own coordinate system ({child}); points in the common one are read"
                )
        tags = [str(child.tag) for child in self.element]
        binary = [tag[len(_Q) :] for tag in tags if tag.startswith(f"{_Q}Binary")]
        if binary:
            raise self.error(
                f"it has {', '.join(binary)}; lists of numbers are read, binary forms are not"
            )

    def _numbers(self, tag: str, count: int) -> FloatArray | None:
        text = self._text(tag)
        if text is None:
            return None
        values = np.array([self._number(word) for word in text.split()])
        if len(values) != count:
            raise self.error(f"{tag} has {len(values)} numbers, its count asks for {count}")
        return values

    def _text(self, tag: str) -> str | None:
        return own_text(self.element.find(f"{_Q}{tag}"))

    def _number(self, word: str) -> float:
        value = finite_number(word)
        if np.isnan(value):
            raise self.error(f"'{shortened(word)}' is not a finite number of usual size")
        return value

    def _radii(self, count: int) -> FloatArray | None:
        radii = self._numbers("ProbeRadii", count)
        common = self._text("ProbeRadius")
        return radii if common is None else np.full(count, self._number(common.strip()))

    def _compensated(self, count: int) -> tuple[bool, ...]:
        """Read whether each point is compensated: one flag for all points, or one for each."""
        words = (self._text("Compensated") or self._text("Compensations") or "").split()
        if len(words) not in (1, count) or any(word not in COMPENSATED for word in words):
            raise self.error(
                "it does not say whether its points are compensated (Compensated true or false)"
            )
        return tuple(COMPENSATED[word] for word in words) * (count if len(words) == 1 else 1)

    def _lines(self) -> tuple[int, ...]:
        points = self.element.find(f"{_Q}Points")
        return () if points is None else tuple(self.document.lines(points)[::3])

    def _labels(self, count: int) -> tuple[str, ...]:
        comments = [str(c.text or "").strip() for c in self.element if callable(c.tag)]
        stated = next((comment for comment in comments if comment.startswith(_LABELS)), "")
        labels = tuple(stated[len(_LABELS) :].split())
        if len(labels) == count:
            return labels
        return tuple(f"{self.element.get('id', '')}-{i + 1}" for i in range(count))


def write_qif(
    path: str | Path,
    points: FloatArray,
    normals: FloatArray,
    labels: tuple[str, ...],
    *,
    compensated: bool,
    tip_radius: float | None,
    deviations: FloatArray | None = None,
) -> None:
    """Write one MeasuredPointSet as a QIF 3 document, in mm.

    Parameters
    ----------
    path : str or Path
    points : (n, 3) float
        Tip centres, or surface points. [mm]
    normals : (n, 3) float
    labels : tuple of str
        Written as a comment, in plain characters without spaces.
    compensated : bool
        Whether they are surface points.
    tip_radius : float or None
        [mm]
    deviations : (n,) float, optional
        From the nominal, along the normal. [mm]
    """
    ET.register_namespace("", NAMESPACE)
    root = ET.Element(f"{_Q}QIFDocument", {"versionQIF": "3.0.0", "idMax": "2"})
    # The same points have the same identifier.
    seed = repr((points.tolist(), normals.tolist(), labels, compensated))
    _child(root, "QPId", str(uuid.uuid5(uuid.NAMESPACE_URL, seed)))
    unit = _child(_child(_child(root, "FileUnits"), "PrimaryUnits"), "LinearUnit")
    _child(unit, "SIUnitName", "meter")
    _child(unit, "UnitName", "mm")
    _child(_child(unit, "UnitConversion"), "Factor", "0.001")
    results = _child(_child(root, "Results"), "MeasurementResultsSet", n="1")
    results = _child(results, "MeasurementResults", id="1")
    sets = _child(results, "MeasuredPointSets", n="1")
    own = _child(sets, "MeasuredPointSet", count=str(len(points)), id="2")
    # The set has no element for the labels of points; a comment is valid anywhere.
    plain = plain_labels(tuple(re.sub(r" |(?<=-)-", "_", label) for label in labels))
    own.append(ET.Comment(f" {_LABELS} {' '.join(plain)} "))
    _child(own, "Points", _text(points))
    _child(own, "Normals", _text(normals))
    _child(own, "Compensated", "true" if compensated else "false")
    if tip_radius is not None:
        _child(own, "ProbeRadii", _text(np.full(len(points), tip_radius)))
    if deviations is not None:
        _child(own, "Deviations", _text(deviations))
    _child(_child(results, "InspectionStatus"), "InspectionStatusEnum", "NOT_CALCULATED")
    ET.indent(root)
    with whole_file(path) as temporary:
        ET.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)


def _child(parent: ET.Element, tag: str, text: str | None = None, **attributes: str) -> ET.Element:
    made = ET.SubElement(parent, f"{_Q}{tag}", attributes)
    made.text = text
    return made


def _text(values: FloatArray) -> str:
    return " ".join(exact_number(value) for value in np.ravel(values))


def _is_qif(lines: list[str]) -> bool:
    # A comment of any length can stand before the root.
    return lines[0].startswith("<") and any("QIFDocument" in line for line in lines)


def _write_touches(path: Path, touches: Touches, tip_radius: float | None) -> None:
    write_qif(
        path,
        touches.positions,
        touches.normals,
        labels_or_numbers(touches.labels, len(touches)),
        compensated=False,
        tip_radius=tip_radius,
    )


def _write_points(path: Path, points: Points, _: PointsOrigin) -> None:
    write_qif(
        path,
        points.positions,
        points.normals,
        points.labels,
        compensated=True,
        tip_radius=None,
        deviations=points.deviation,
    )


_STATED = (
    RowStatement("`ProbeRadius`, `SensorId`, `TipId` that differ", "", "tip", "carried"),
    RowStatement("`MeasurementResults`, `MeasurementDeviceId` that differ", "", "part", "carried"),
    RowStatement("`CoordinateSystemId`, `TranformId` of a set", "", "frame", "refused"),
    RowStatement("`Compensated` true", "", "radius", "refused"),
)


def _touches_in_unit(file: SourceFile, options: ReadingOptions) -> FileReadings | FilePositions:
    _refuse_unit(file, options)
    return read_qif(file)


def _characteristics_in_unit(file: SourceFile, options: ReadingOptions) -> list[FeatureResult]:
    _refuse_unit(file, options)
    return read_characteristics(file)


def _refuse_unit(file: SourceFile, options: ReadingOptions) -> None:
    """Refuse a unit that is not that of the document."""
    if options.units is not None:
        millimetres = QifDocument(file).scale()
        alike = (n for n, size in LENGTH_UNITS.items() if math.isclose(size, millimetres))
        own = next(alike, "mm")
        refuse_contradicted_unit(file, own, options.units)


QIF = FileFormat(
    name="qif",
    what="QIF 3 MeasuredPointSet, QIF 2 MeasurePoint (.qif)",
    reads="touches, positions; results of features",
    writes="touches, points",
    needs="plan without normals",
    verified="public files of a CMM in versions 2.0, 2.1 and 3: deviations and features were "
    "computed again from the points; the schema's path to the set, transcribed (not the whole "
    "schema)",
    endings=(".qif",),
    recognises=_is_qif,
    parse=_touches_in_unit,
    parse_features=_characteristics_in_unit,
    self_contained=True,
    write_touches=_write_touches,
    write_points=_write_points,
    columns=_STATED,
)
