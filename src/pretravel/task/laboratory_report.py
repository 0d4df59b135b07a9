"""What a laboratory states with a result: laboratory, instrument, reference, environment."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pretravel.files import REPORT_TABLES
from pretravel.show import Document, KeyFigure, Section

if TYPE_CHECKING:
    from pretravel.files import LaboratoryStatement, LaboratoryStatements

NOT_STATED = "not stated"
"""Shown for a field that the laboratory left empty."""


def with_laboratory(document: Document, statements: LaboratoryStatements | None) -> Document:
    """A document with the section of what the laboratory states.

    Parameters
    ----------
    document : Document
    statements : LaboratoryStatements or None
        None: nothing is stated.

    Returns
    -------
    Document
        The section is the first one; where nothing is stated it is the last one, and short.

    >>> from pretravel.files import LaboratoryStatements
    >>> with_laboratory(Document("Probe"), LaboratoryStatements()).sections[0].heading
    'Laboratory and instrument'
    >>> [figure.name for figure in with_laboratory(Document("Probe"), None).sections[0].figures]
    ['laboratory', 'instrument', 'reference', 'conditions', 'measurement']
    """
    if statements is None:
        return replace(document, sections=(*document.sections, _NOTHING_STATED))
    return replace(document, sections=(laboratory_section(statements), *document.sections))


HEADING = "Laboratory and instrument"
_NOTHING_STATED = Section(
    HEADING, figures=tuple(KeyFigure(table, NOT_STATED) for table in REPORT_TABLES), detail=True
)


def laboratory_section(statements: LaboratoryStatements) -> Section:
    """What the laboratory states, field by field; an open field is shown as not stated.

    Returns
    -------
    Section
        It belongs to the full report: to pages, and to the terminal where that is asked for.
    """
    return Section(
        HEADING,
        figures=tuple(map(stated_figure, statements.of_report())),
        detail=True,
    )


def stated_figure(statement: LaboratoryStatement) -> KeyFigure:
    """One statement; an open one is shown as not stated."""
    return KeyFigure(
        statement.meaning,
        statement.text or NOT_STATED,
        statement=f"{statement.table}.{statement.key}",
    )
