"""A document as plain values for JSON."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from pretravel.report.document import Document, KeyFigure, Section, Span, Table


def document_values(document: Document) -> dict[str, Any]:
    """A document as values that `json` can write; what is not known is null.

    Parameters
    ----------
    document : Document

    Returns
    -------
    dict

    >>> document_values(Document("Probe", figures=(KeyFigure("force", math.nan, "N"),)))["figures"]
    [{'name': 'force', 'value': None, 'unit': 'N'}]
    """
    return {
        "title": document.title,
        "verdict": document.verdict,
        "figures": [_figure(figure) for figure in document.figures],
        "tables": [_table(table) for table in document.tables],
        "sections": [_section(section) for section in document.sections],
        "pictures": [picture.caption for picture in document.pictures],
        "notes": list(document.notes),
        "warnings": list(document.warnings),
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Span):
        return {name: _plain(end) for name, end in dataclasses.asdict(value).items()}
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _figure(figure: KeyFigure) -> dict[str, Any]:
    values = {"name": figure.name, "value": _plain(figure.value), "unit": figure.unit}
    if figure.u is not None:
        values |= {"u": _plain(figure.u), "u_unit": figure.u_unit or figure.unit}
    if figure.interval is not None:
        values["interval"] = _plain(figure.interval)
    return values | ({"remark": figure.remark} if figure.remark else {})


def _table(table: Table) -> dict[str, Any]:
    return {
        "title": table.title,
        "columns": [
            {"name": column.name, "unit": column.unit, "values": _plain(column.values)}
            for column in table.columns
        ],
    }


def _section(section: Section) -> dict[str, Any]:
    return {
        "heading": section.heading,
        "paragraphs": list(section.paragraphs),
        "figures": [_figure(figure) for figure in section.figures],
        "tables": [_table(table) for table in section.tables],
    }
