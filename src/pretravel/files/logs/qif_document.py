"""A QIF document: its root, its unit of length, its numbers."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass
from xml.parsers import expat

import numpy as np

from pretravel.base import INCH, LARGEST_NUMBER, FloatArray, InputError
from pretravel.files.source_file import SourceFile, shortened

NAMESPACE = "http://qifstandards.org/xsd/qif3"
NAMESPACE_2 = "http://qifstandards.org/xsd/qif2"
METRE = 1000.0
"""The unit of lengths where a document states none. [mm]"""
UNIT_NAMES = {"mm": 1.0, "millimeter": 1.0, "millimetre": 1.0, "inch": INCH, "in": INCH,
              "m": METRE, "meter": METRE, "metre": METRE}  # fmt: skip

COMPENSATED = {"true": True, "1": True, "false": False, "0": False}
"""Words that state whether a probe radius was subtracted."""
_MOST_TAGS = 5_000_000
"""A tag takes up to 220 bytes of memory."""
_ROUNDED = 5e-3
"""Normals whose length differs from one by less are scaled to length one."""


@dataclass(frozen=True, eq=False)
class PointSet:
    """Measured points of a document: a MeasuredPointSet, or the MeasurePoints of QIF 2.

    Attributes
    ----------
    points : (n, 3) float
        Tip centres, or surface points where they are compensated. [mm]
    compensated : (n,) bool
        Whether the probe radius was subtracted.
    normals : (n, 3) float or None
    radii : (n,) float or None
        Effective radii of the probe. [mm]
    labels : tuple of str
        From the comment that pretravel writes, or the set's id and the number of the point in it;
        in QIF 2, the ids of the points.
    lines : tuple of int
        Line of the file that each point begins in.
    part : str
        The results that the set belongs to: those of one part.
    tips : tuple of str
        The identifiers of sensor and tip of each point, where the set has them.
    unread : str
        What the set states and nothing reads.
    """

    points: FloatArray
    compensated: tuple[bool, ...]
    normals: FloatArray | None
    radii: FloatArray | None
    labels: tuple[str, ...]
    lines: tuple[int, ...]
    part: str = ""
    tips: tuple[str, ...] = ()
    unread: str = ""


class QifDocument:
    """A QIF document of version 2 or 3.

    Attributes
    ----------
    file : SourceFile
    root : Element
        QIFDocument.
    prefix : str
        The namespace in braces, before the names of elements.
    """

    def __init__(self, file: SourceFile) -> None:
        """Parse the document; InputError where it is not QIF 2 or 3."""
        self.file = file
        text = "\n".join(file.lines("a QIF document"))
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise file.error("a QIF document must not contain a document type or entities")
        if text.count("<") > _MOST_TAGS:
            raise file.error(f"the document has more than {_MOST_TAGS:,} tags: split it")
        self._lines: dict[ET.Element, int] = {}
        try:
            self.root = self._parsed(text)
        except expat.ExpatError as error:
            raise file.error(f"not well-formed XML: {error}") from None
        space, _, name = str(self.root.tag).rpartition("}")
        self.prefix = f"{space}}}"
        if name != "QIFDocument" or space.lstrip("{") not in (NAMESPACE, NAMESPACE_2):
            raise file.error(
                f"{name} in {space.lstrip('{') or 'no namespace'}: QIF 3 and 2 are read "
                f"(QIFDocument in {NAMESPACE} or {NAMESPACE_2})"
            )

    def _parsed(self, text: str) -> ET.Element:
        """Parse a text, and keep the line of each element."""
        builder = ET.TreeBuilder(insert_comments=True)
        parser = expat.ParserCreate("utf-8", "}")  # the text was decoded already
        parser.buffer_text = True

        def start(name: str, attributes: dict[str, str]) -> None:
            element = builder.start(_bracketed(name), attributes)
            self._lines[element] = parser.CurrentLineNumber

        def comment(text: str) -> None:
            self._lines[builder.comment(text)] = parser.CurrentLineNumber

        parser.StartElementHandler = start
        parser.EndElementHandler = lambda name: builder.end(_bracketed(name))
        parser.CharacterDataHandler = builder.data
        parser.CommentHandler = comment
        parser.Parse(text.encode(), True)
        return builder.close()

    def lines(self, element: ET.Element) -> list[int]:
        """Return the line of each word of an element's text."""
        line = self._lines[element]
        found = []
        parts = [(element.text or "", True)]
        for child in element:
            parts += [(child.text or "", False), (child.tail or "", True)]
        for text, counts in parts:
            for row, content in enumerate(text.split("\n")):
                found += [line + row] * (len(content.split()) if counts else 0)
            line += text.count("\n")
        return found

    def notes(self) -> list[tuple[int, str]]:
        """Return line and text of each comment and temperature, and of the header's description."""
        found, head = [], self.root.find(self.path("Header", "Description"))
        for element in self.root.iter():
            name = "" if callable(element.tag) else str(element.tag).rpartition("}")[2]
            text = " ".join((element.text or "").split())
            if text and (not name or element is head or name.endswith("Temperature")):
                found.append((self._lines[element], f"{name} {text}".strip()))
        return found

    @property
    def is_version_2(self) -> bool:
        """Whether the document has version 2."""
        return NAMESPACE_2 in self.prefix

    def path(self, *names: str) -> str:
        """Return the path of elements below each other, with their namespace."""
        return "/".join(f"{self.prefix}{name}" for name in names)

    def main_unit(self) -> str | None:
        """Return the name of the document's unit of length."""
        return self.root.findtext(self.path("FileUnits", "PrimaryUnits", "LinearUnit", "UnitName"))

    def scale(self) -> float:
        """Return the millimetres in the document's unit of length."""
        unit = self.root.find(self.path("FileUnits", "PrimaryUnits", "LinearUnit"))
        return METRE if unit is None else self._millimetres(unit)

    def declared_units(self) -> dict[str, float]:
        """Return the millimetres of each unit of length that FileUnits/OtherUnits declares."""
        others = self.root.find(self.path("FileUnits", "OtherUnits"))
        return {} if others is None else self.units_in(others)

    def units_in(self, units: ET.Element) -> dict[str, float]:
        """Return the millimetres of each unit of length in an element of units, by its name."""
        found = {}
        for unit in units.iter(self.path("LinearUnit")):
            name = (unit.findtext(self.path("UnitName")) or own_text(unit) or "").strip()
            if name:
                found[name] = self._millimetres(unit, name)
        return found

    def _millimetres(self, unit: ET.Element, name: str = "") -> float:
        """Return the millimetres in a unit of length."""
        if finite_number(unit.findtext(self.path("UnitConversion", "Offset")) or "0") != 0.0:
            raise self.file.error("a length unit with an offset is not read")
        factor = unit.findtext(self.path("UnitConversion", "Factor"))
        if factor is not None:
            metres = finite_number(factor)
            if not 1e-12 <= metres <= 1e6:
                raise self.file.error(
                    f"the factor '{shortened(factor)}' of the length unit is not a number of metres"
                )
            return metres * METRE
        name = (unit.findtext(self.path("UnitName")) or name or "meter").strip().lower()
        if name not in UNIT_NAMES:
            raise self.file.error(f"the length unit '{name}' is not known and has no factor")
        return UNIT_NAMES[name]


def _bracketed(name: str) -> str:
    """A name of an element with its namespace as ElementTree writes it: {namespace}name."""
    return f"{{{name}" if "}" in name else name


def own_text(element: ET.Element | None) -> str | None:
    """Return the text of an element, also that after comments in it; None without the element.

    >>> own_text(ET.fromstring("<Points>1 2<!-- next --> 3</Points>"))
    '1 2 3'
    """
    if element is None:
        return None
    return (element.text or "") + "".join(child.tail or "" for child in element)


def finite_number(word: str) -> float:
    """Return a word as a number; NaN where it is not finite, or larger than any measured value.

    >>> finite_number("7.6e-006"), finite_number("INF")
    (7.6e-06, nan)
    """
    try:
        value = np.nan if "_" in word else float(word)  # 1_0 is ten in Python alone
    except ValueError:
        return np.nan
    return value if abs(value) <= LARGEST_NUMBER else np.nan


def unit_normals(normals: FloatArray, error: Callable[[int, str], InputError]) -> FloatArray:
    """Return normals scaled to length one, (n, 3).

    Parameters
    ----------
    normals : (n, 3) float
    error : function of a row and a message
        Makes the error for a normal whose length is not one, apart from its last printed digits.
    """
    length = np.linalg.norm(normals, axis=1)
    bad = np.flatnonzero(np.abs(length - 1.0) > _ROUNDED)
    if len(bad):
        raise error(
            int(bad[0]),
            f"normal {bad[0] + 1} has length {length[bad[0]]:.4g}; unit vectors are needed",
        )
    rounded = np.abs(length - 1.0) > 1e-15
    return np.where(rounded[:, None], normals / length[:, None], normals)
