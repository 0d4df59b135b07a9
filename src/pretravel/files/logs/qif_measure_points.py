"""QIF 2: a MeasurePoint for each point, in the list of points of its feature; reading."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from pretravel.base import FloatArray, InputError
from pretravel.files.logs.qif_document import (
    COMPENSATED,
    PointSet,
    QifDocument,
    finite_number,
    own_text,
    unit_normals,
)

_READ = ("Attributes", "Point", "Normal", "Compensated", "ProbeRadius")
"""Elements of a point that are read, or that say nothing about its place."""


def read_measure_points(document: QifDocument) -> PointSet | None:
    """Read every MeasurePoint of a QIF 2 document.

    Returns
    -------
    PointSet or None
        One set with the points of all features, in the document's order; None where the document
        has no points. There are normals where every point has one, and radii likewise.

    Raises
    ------
    InputError
        A point is not three finite numbers, does not state whether it is compensated, or contains
        an element that is not read.
    """
    elements = list(document.root.iter(document.path("MeasurePoint")))
    if not elements:
        return None
    points = [_MeasurePoint(document, element) for element in elements]
    scale = document.scale()
    normals = [point.vector("Normal") for point in points]
    radii = [point.radius() for point in points]
    return PointSet(
        scale * np.array([point.vector("Point", needed=True) for point in points]),
        tuple(point.compensated() for point in points),
        None if any(normal is None for normal in normals) else _normals(points, normals),
        None if any(radius is None for radius in radii) else scale * np.array(radii, dtype=float),
        tuple(str(element.get("id", row + 1)) for row, element in enumerate(elements)),
        tuple(point.line() for point in points),
    )


def _normals(points: list[_MeasurePoint], normals: list[FloatArray | None]) -> FloatArray:
    return unit_normals(np.array(normals), lambda row, message: points[row].error(message))


class _MeasurePoint:
    """The element of a MeasurePoint, and errors that name it."""

    def __init__(self, document: QifDocument, element: ET.Element) -> None:
        self.document = document
        self.element = element
        known = [document.path(name) for name in _READ]
        others = [str(c.tag) for c in element if not callable(c.tag) and c.tag not in known]
        if others:
            raise self.error(f"it contains {others[0].rpartition('}')[2]}, which is not read")

    def error(self, message: str) -> InputError:
        return self.document.file.error(f"MeasurePoint {self.element.get('id', '?')}: {message}")

    def _text(self, name: str) -> str | None:
        return own_text(self.element.find(self.document.path(name)))

    def _numbers(self, name: str, text: str, count: int) -> FloatArray:
        values = np.array([finite_number(word) for word in text.split()])
        if len(values) != count or not np.all(np.isfinite(values)):
            raise self.error(f"{name} '{text.strip()[:40]}' is not {count} finite number(s)")
        return values

    def line(self) -> int:
        """Return the line of the file that the coordinates begin in."""
        point = self.element.find(self.document.path("Point"))
        assert point is not None
        return self.document.lines(point)[0]

    def vector(self, name: str, *, needed: bool = False) -> FloatArray | None:
        """Return three numbers; None where the point does not have them."""
        text = self._text(name)
        if text is None and needed:
            raise self.error(f"it has no {name}")
        return None if text is None else self._numbers(name, text, 3)

    def radius(self) -> float | None:
        """Return the probe's radius in the document's unit; None where it is not stated."""
        text = self._text("ProbeRadius")
        return None if text is None else float(self._numbers("ProbeRadius", text, 1)[0])

    def compensated(self) -> bool:
        """Return whether the probe radius was subtracted."""
        word = (self._text("Compensated") or "").strip()
        if word not in COMPENSATED:
            raise self.error("it does not say whether it is compensated (Compensated)")
        return COMPENSATED[word]
