"""QIF 3 (ISO 23952): MeasuredPointSet; reading and writing."""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.compensation.points import Points
from pretravel.errors import InputError
from pretravel.formats.csv_table import exact_number
from pretravel.formats.file_format import (
    FileFormat,
    FilePositions,
    FileReadings,
    PointsOrigin,
    labels_or_numbers,
)
from pretravel.formats.source_file import Source, SourceFile, opened
from pretravel.touches import Touches
from pretravel.units import INCH
from pretravel.whole_file import whole_file

NAMESPACE = "http://qifstandards.org/xsd/qif3"
_Q = f"{{{NAMESPACE}}}"
_SETS = (
    f"{_Q}Results/{_Q}MeasurementResultsSet/{_Q}MeasurementResults/{_Q}MeasuredPointSets/"
    f"{_Q}MeasuredPointSet"
)
_LINEAR_UNIT = f"{_Q}FileUnits/{_Q}PrimaryUnits/{_Q}LinearUnit"
_METRE = 1000.0
"""The unit of lengths where the file states none. [mm]"""
_UNIT_NAMES = {"mm": 1.0, "millimeter": 1.0, "millimetre": 1.0, "inch": INCH, "in": INCH,
               "m": _METRE, "meter": _METRE, "metre": _METRE}  # fmt: skip
_ROUNDED = 5e-3
"""Normals whose length differs from one by less are scaled to length one."""
_LABELS = "labels:"
"""Begins the comment that contains the labels of a set."""


@dataclass(frozen=True, eq=False)
class PointSet:
    """One MeasuredPointSet.

    Attributes
    ----------
    points : (n, 3) float
        Tip centres, or surface points where they are compensated. [mm]
    compensated : (n,) bool
        Whether the probe radius was taken off.
    normals : (n, 3) float or None
    radii : (n,) float or None
        Effective radii of the probe. [mm]
    labels : tuple of str
        From the comment that pretravel writes, or the set's id and the number of the point in it.
    """

    points: FloatArray
    compensated: tuple[bool, ...]
    normals: FloatArray | None
    radii: FloatArray | None
    labels: tuple[str, ...]


def read_point_sets(source: Source) -> list[PointSet]:
    """Read every MeasuredPointSet of a QIF 3 document.

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    list of PointSet

    Raises
    ------
    InputError
        The file is not XML or has another version of QIF; a list has not the length of the count;
        a number is not finite; a list is binary.
    """
    file = opened(source)
    root = _document(file)
    scale = _file_scale(file, root)
    main_unit = root.findtext(f"{_LINEAR_UNIT}/{_Q}UnitName")
    sets = []
    for element in root.findall(_SETS):
        element_set = _SetElement(file, element)
        own_scale = element_set.scale(main_unit)
        sets.append(element_set.point_set(scale if own_scale is None else own_scale))
    if not sets:
        raise file.error(
            "the document contains no MeasuredPointSet (Results/MeasurementResultsSet/"
            "MeasurementResults/MeasuredPointSets)"
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
            raise file.error(
                f"the set {point_set.labels[0].rpartition('-')[0]} contains points whose probe "
                "radius was already taken off (Compensated true); tip centres are needed. In "
                "Python, pretravel.formats.logs.qif.read_point_sets reads them"
            )
    points = np.concatenate([s.points for s in sets])
    normals = [s.normals for s in sets if s.normals is not None]
    if len(normals) < len(sets):
        return FilePositions(file.path, points, tuple(range(1, len(points) + 1)))
    radii = np.unique(np.concatenate([_radii(s) for s in sets]))
    with file.named_in_errors():
        touches = Touches(
            positions=points,
            normals=np.concatenate(normals),
            labels=tuple(label for s in sets for label in s.labels),
            source=file.name,
        )
    common = len(radii) == 1 and radii[0] > 0.0
    return FileReadings(touches, tip_radius=float(radii[0]) if common else None)


def _radii(point_set: PointSet) -> FloatArray:
    """Return the probe radii of a set, NaN where it states no radius."""
    unknown = np.full(len(point_set.points), np.nan)
    return unknown if point_set.radii is None else point_set.radii


def _document(file: SourceFile) -> ET.Element:
    """Return the root of a QIF 3 document."""
    text = "\n".join(file.lines("a QIF document"))
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise file.error("a QIF document must not contain a document type or entities")
    try:
        builder = ET.TreeBuilder(insert_comments=True)
        root = ET.fromstring(text, ET.XMLParser(target=builder))
    except ET.ParseError as error:
        raise file.error(f"not well-formed XML: {error}") from None
    if root.tag != f"{_Q}QIFDocument":
        space = root.tag.rpartition("}")[0].lstrip("{") or "no namespace"
        raise file.error(
            f"{root.tag.rpartition('}')[2]} in {space}: QIF 3 is read (QIFDocument in {NAMESPACE})"
        )
    return root


def _file_scale(file: SourceFile, root: ET.Element) -> float:
    """Return the millimetres in the document's unit of length."""
    unit = root.find(_LINEAR_UNIT)
    if unit is None:
        return _METRE
    if float(unit.findtext(f"{_Q}UnitConversion/{_Q}Offset") or 0.0) != 0.0:
        raise file.error("a length unit with an offset is not read")
    factor = unit.findtext(f"{_Q}UnitConversion/{_Q}Factor")
    if factor is not None:
        try:
            return float(factor) * _METRE
        except ValueError:
            raise file.error(f"the factor '{factor}' of the length unit is not a number") from None
    name = (unit.findtext(f"{_Q}UnitName") or "meter").strip().lower()
    if name not in _UNIT_NAMES:
        raise file.error(f"the length unit '{name}' is not known and has no factor")
    return _UNIT_NAMES[name]


class _SetElement:
    """The element of a MeasuredPointSet, and errors that name it."""

    def __init__(self, file: SourceFile, element: ET.Element) -> None:
        self.file = file
        self.element = element
        self.name = f"MeasuredPointSet {element.get('id', '?')}"

    def error(self, message: str) -> InputError:
        return self.file.error(f"{self.name}: {message}")

    def scale(self, main_unit: str | None) -> float | None:
        """Return the millimetres in the set's own unit; None if it has the document's unit."""
        unit = self.element.get("linearUnit")
        if unit is None or unit == main_unit:
            return None
        if unit.strip().lower() not in _UNIT_NAMES:
            raise self.error(f"its length unit '{unit}' is not known")
        return _UNIT_NAMES[unit.strip().lower()]

    def point_set(self, scale: float) -> PointSet:
        """Read everything that the set contains; `scale` is the millimetres in its unit."""
        self._refuse_what_is_not_read()
        try:
            count = int(self.element.get("count", ""))
        except ValueError:
            raise self.error("it does not state its count") from None
        points = self._numbers("Points", 3 * count)
        if points is None:
            raise self.error("it has no Points")
        normals = self._numbers("Normals", 3 * count)
        radii = self._radii(count)
        return PointSet(
            scale * points.reshape(-1, 3),
            self._compensated(count),
            None if normals is None else self._unit_normals(normals.reshape(-1, 3)),
            None if radii is None else scale * radii,
            self._labels(count),
        )

    def _refuse_what_is_not_read(self) -> None:
        for child in ("CoordinateSystemId", "TranformId"):  # the schema's own spelling
            if self.element.find(f"{_Q}{child}") is not None:
                raise self.error(
                    f"it has a coordinate system of its own ({child}); points in the common one "
                    "are read"
                )
        tags = [str(child.tag) for child in self.element]
        binary = [tag[len(_Q) :] for tag in tags if tag.startswith(f"{_Q}Binary")]
        if binary:
            raise self.error(
                f"it has {', '.join(binary)}; lists of numbers are read, binary forms are not"
            )

    def _numbers(self, tag: str, count: int) -> FloatArray | None:
        text = self.element.findtext(f"{_Q}{tag}")
        if text is None:
            return None
        values = np.array([self._number(word) for word in text.split()])
        if len(values) != count:
            raise self.error(f"{tag} has {len(values)} numbers, its count asks for {count}")
        return values

    def _number(self, word: str) -> float:
        try:
            value = float(word)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise self.error(f"'{word}' is not a finite number")
        return value

    def _unit_normals(self, normals: FloatArray) -> FloatArray:
        length = np.linalg.norm(normals, axis=1)
        bad = np.flatnonzero(np.abs(length - 1.0) > _ROUNDED)
        if len(bad):
            raise self.error(
                f"normal {bad[0] + 1} has length {length[bad[0]]:.4g}; unit vectors are needed"
            )
        rounded = np.abs(length - 1.0) > 1e-15
        return np.where(rounded[:, None], normals / length[:, None], normals)

    def _radii(self, count: int) -> FloatArray | None:
        radii = self._numbers("ProbeRadii", count)
        common = self.element.findtext(f"{_Q}ProbeRadius")
        return radii if common is None else np.full(count, self._number(common))

    def _compensated(self, count: int) -> tuple[bool, ...]:
        """Read whether each point is compensated: one flag for all points, or one for each."""
        single = self.element.findtext(f"{_Q}Compensated")
        words = (single or self.element.findtext(f"{_Q}Compensations") or "").split()
        meaning = {"true": True, "1": True, "false": False, "0": False}
        if len(words) not in (1, count) or any(word not in meaning for word in words):
            raise self.error(
                "it does not state whether its points are compensated (Compensated true or false)"
            )
        return tuple(meaning[word] for word in words) * (count if len(words) == 1 else 1)

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
    if all(label and not set(label) & set(" \t\n") and "--" not in label for label in labels):
        own.append(ET.Comment(f" {_LABELS} {' '.join(labels)} "))
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
    return lines[0].startswith("<") and any("QIFDocument" in line for line in lines[:50])


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


QIF = FileFormat(
    name="qif",
    what="QIF 3 MeasuredPointSet (.qif)",
    reads="touches, positions",
    writes="touches, points",
    needs="plan without normals",
    verified="one public file of a CMM, whose deviation was computed again; the schema's "
    "path to the set, transcribed (not the whole schema)",
    endings=(".qif",),
    recognises=_is_qif,
    parse=lambda file, _: read_qif(file),
    self_contained=True,
    write_touches=_write_touches,
    write_points=_write_points,
)
