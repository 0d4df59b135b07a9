"""QIF 3 (ISO 23952): MeasuredPointSet, reading and writing."""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import exact_number
from pretravel.formats.logs.joining import FileReadings, Rows, file_lines
from pretravel.touches import Touches
from pretravel.units import INCH
from pretravel.whole_file import whole_file

NAMESPACE = "http://qifstandards.org/xsd/qif3"
_Q = f"{{{NAMESPACE}}}"
_SETS = (
    f"{_Q}Results/{_Q}MeasurementResultsSet/{_Q}MeasurementResults/{_Q}MeasuredPointSets/"
    f"{_Q}MeasuredPointSet"
)
_METRE = 1000.0
_UNIT_NAMES = {"mm": 1.0, "millimeter": 1.0, "millimetre": 1.0, "inch": INCH, "in": INCH,
               "m": _METRE, "meter": _METRE, "metre": _METRE}  # fmt: skip
_ROUNDED = 5e-3  # of the length of normals
_LABELS = "labels:"


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
        Of the set's id and the number in it.
    """

    points: FloatArray
    compensated: tuple[bool, ...]
    normals: FloatArray | None
    radii: FloatArray | None
    labels: tuple[str, ...]


def read_point_sets(path: str | Path) -> list[PointSet]:
    """Every MeasuredPointSet of a QIF 3 document.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of PointSet

    Raises
    ------
    InputError
        Not XML, another version of QIF, lists whose length is not that of the count, numbers that
        are not finite, binary forms.
    """
    text = "\n".join(file_lines(path, "a QIF document"))
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError("a document type or entities do not belong in a QIF document", path=path)
    try:
        builder = ET.TreeBuilder(insert_comments=True)
        root = ET.fromstring(text, ET.XMLParser(target=builder))
    except ET.ParseError as error:
        raise InputError(f"not well-formed XML: {error}", path=path) from None
    if root.tag != f"{_Q}QIFDocument":
        space = root.tag.rpartition("}")[0].lstrip("{") or "no namespace"
        raise InputError(
            f"{root.tag.rpartition('}')[2]} in {space}: QIF 3 is read (QIFDocument in {NAMESPACE})",
            path=path,
        )
    scale = _file_scale(root, path)
    sets = [_point_set(element, scale, root, path) for element in root.findall(_SETS)]
    if not sets:
        raise InputError(
            "no MeasuredPointSet in it (Results/MeasurementResultsSet/MeasurementResults/"
            "MeasuredPointSets)",
            path=path,
        )
    return sets


def read_qif(path: str | Path) -> FileReadings | Rows:
    """Touches of a QIF document: its points that are not compensated.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    FileReadings, or Rows
        Rows where there are no normals: to be joined with a plan.

    Raises
    ------
    InputError
        As `read_point_sets`; points that are compensated already.
    """
    sets = read_point_sets(path)
    raw = [s for s in sets if not any(s.compensated)]
    if len(raw) < len(sets):
        done = next(s for s in sets if any(s.compensated))
        raise InputError(
            f"the set {done.labels[0].rpartition('-')[0]} holds points whose probe radius was "
            "taken off already (Compensated true); tip centres are needed. In Python "
            "pretravel.formats.logs.qif.read_point_sets gives them",
            path=path,
        )
    points = np.concatenate([s.points for s in raw])
    if any(s.normals is None for s in raw):
        return Rows(str(path), points, tuple(range(1, len(points) + 1)))
    radii = np.concatenate([np.full(len(s.points), np.nan) if s.radii is None else s.radii
                            for s in raw])  # fmt: skip
    one = np.unique(radii)
    try:
        touches = Touches(
            positions=points,
            normals=np.concatenate([np.asarray(s.normals) for s in raw]),
            labels=tuple(label for s in raw for label in s.labels),
            source=Path(path).name,
        )
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    return FileReadings(touches, tip_radius=float(one[0]) if len(one) == 1 and one[0] > 0 else None)


def _file_scale(root: ET.Element, path: str | Path) -> float:
    unit = root.find(f"{_Q}FileUnits/{_Q}PrimaryUnits/{_Q}LinearUnit")
    if unit is None:
        return _METRE  # the schema: metres where no unit is told
    if float(unit.findtext(f"{_Q}UnitConversion/{_Q}Offset") or 0.0) != 0.0:
        raise InputError("a length unit with an offset is not read", path=path)
    factor = unit.findtext(f"{_Q}UnitConversion/{_Q}Factor")
    if factor is not None:
        try:
            return float(factor) * _METRE
        except ValueError:
            raise InputError(
                f"the factor '{factor}' of the length unit is no number", path=path
            ) from None
    name = (unit.findtext(f"{_Q}UnitName") or "meter").strip().lower()
    if name not in _UNIT_NAMES:
        raise InputError(f"the length unit '{name}' has no factor and is not known", path=path)
    return _UNIT_NAMES[name]


def _point_set(element: ET.Element, scale: float, root: ET.Element, path: str | Path) -> PointSet:
    name = f"MeasuredPointSet {element.get('id', '?')}"
    own_unit = element.get("linearUnit")
    if own_unit is not None:
        main = root.findtext(f"{_Q}FileUnits/{_Q}PrimaryUnits/{_Q}LinearUnit/{_Q}UnitName")
        if own_unit != main:
            if own_unit.strip().lower() not in _UNIT_NAMES:
                raise InputError(f"{name}: its length unit '{own_unit}' is not known", path=path)
            scale = _UNIT_NAMES[own_unit.strip().lower()]
    for child in ("CoordinateSystemId", "TranformId"):
        if element.find(f"{_Q}{child}") is not None:
            raise InputError(
                f"{name} is in a coordinate system of its own ({child}); points in the common one "
                "are read",
                path=path,
            )
    binary = [str(c.tag)[len(_Q) :] for c in element if str(c.tag).startswith(f"{_Q}Binary")]
    if binary:
        raise InputError(
            f"{name} has {', '.join(binary)}; lists of numbers are read, binary forms are not",
            path=path,
        )
    try:
        count = int(element.get("count", ""))
    except ValueError:
        raise InputError(f"{name} does not tell its count", path=path) from None
    points = _list(element, "Points", 3 * count, name, path)
    if points is None:
        raise InputError(f"{name} has no Points", path=path)
    normals = _list(element, "Normals", 3 * count, name, path)
    if normals is not None:
        normals = normals.reshape(-1, 3)
        length = np.linalg.norm(normals, axis=1)
        bad = np.flatnonzero(np.abs(length - 1.0) > _ROUNDED)
        if len(bad):
            raise InputError(
                f"{name}: normal {bad[0] + 1} has length {length[bad[0]]:.4g}; unit vectors are "
                "needed",
                path=path,
            )
        normals = np.where((np.abs(length - 1.0) > 1e-15)[:, None], normals / length[:, None],
                           normals)  # fmt: skip
    radius = element.findtext(f"{_Q}ProbeRadius")
    radii = _list(element, "ProbeRadii", count, name, path)
    if radius is not None:
        radii = np.full(count, _number(radius, name, path))
    words = (
        element.findtext(f"{_Q}Compensated") or element.findtext(f"{_Q}Compensations") or ""
    ).split()
    meaning = {"true": True, "1": True, "false": False, "0": False}
    if len(words) not in (1, count) or any(word not in meaning for word in words):
        raise InputError(
            f"{name} does not say whether its points are compensated (Compensated true or false)",
            path=path,
        )
    flags = tuple(meaning[word] for word in words) * (count if len(words) == 1 else 1)
    notes = [str(c.text or "").strip() for c in element if callable(c.tag)]
    told = next((note for note in notes if note.startswith(_LABELS)), "")
    labels = tuple(told[len(_LABELS) :].split())
    if len(labels) != count:
        labels = tuple(f"{element.get('id', '')}-{i + 1}" for i in range(count))
    return PointSet(
        scale * points.reshape(-1, 3),
        flags,
        normals,
        None if radii is None else scale * radii,
        labels,
    )


def _list(
    element: ET.Element, tag: str, count: int, name: str, path: str | Path
) -> FloatArray | None:
    text = element.findtext(f"{_Q}{tag}")
    if text is None:
        return None
    values = np.array([_number(word, name, path) for word in text.split()])
    if len(values) != count:
        raise InputError(
            f"{name}: {len(values)} numbers in {tag}, its count asks for {count}", path=path
        )
    return values


def _number(word: str, name: str, path: str | Path) -> float:
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{name}: '{word}' is not a finite number", path=path)
    return value


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
    """One MeasuredPointSet as a QIF 3 document, in mm.

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

    def child(parent: ET.Element, tag: str, text: str | None = None, **attributes: str
              ) -> ET.Element:  # fmt: skip
        made = ET.SubElement(parent, f"{_Q}{tag}", attributes)
        made.text = text
        return made

    # The same points, the same identifier.
    seed = repr((points.tolist(), normals.tolist(), labels, compensated))
    child(root, "QPId", str(uuid.uuid5(uuid.NAMESPACE_URL, seed)))
    unit = child(child(child(root, "FileUnits"), "PrimaryUnits"), "LinearUnit")
    child(unit, "SIUnitName", "meter")
    child(unit, "UnitName", "mm")
    child(child(unit, "UnitConversion"), "Factor", "0.001")
    results = child(child(root, "Results"), "MeasurementResultsSet", n="1")
    results = child(results, "MeasurementResults", id="1")
    sets = child(results, "MeasuredPointSets", n="1")
    own = child(sets, "MeasuredPointSet", count=str(len(points)), id="2")
    # The set has no place for names of points; a comment is valid anywhere.
    if all(label and not set(label) & set(" \t\n") and "--" not in label for label in labels):
        own.append(ET.Comment(f" {_LABELS} {' '.join(labels)} "))
    child(own, "Points", _numbers(points))
    child(own, "Normals", _numbers(normals))
    child(own, "Compensated", "true" if compensated else "false")
    if tip_radius is not None:
        child(own, "ProbeRadii", _numbers(np.full(len(points), tip_radius)))
    if deviations is not None:
        child(own, "Deviations", _numbers(deviations))
    status = child(results, "InspectionStatus")
    child(status, "InspectionStatusEnum", "NOT_CALCULATED")
    ET.indent(root)
    with whole_file(path) as temporary:
        ET.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)


def _numbers(values: FloatArray) -> str:
    return " ".join(exact_number(value) for value in np.ravel(values))
