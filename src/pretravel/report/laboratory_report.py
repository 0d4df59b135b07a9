"""What a laboratory states with a result: laboratory, instrument, reference, environment."""

from __future__ import annotations

from dataclasses import replace

from pretravel.laboratory.certificate import LaboratoryStatements, Statement
from pretravel.report.document import Document, KeyFigure, Section

NOT_STATED = "not stated"
"""Shown for a field that the laboratory left empty."""


def with_laboratory(document: Document, statements: LaboratoryStatements | None) -> Document:
    """A document with the section of what the laboratory states.

    Parameters
    ----------
    document : Document
    statements : LaboratoryStatements or None
        None: no file of a laboratory was given, and the document stays as it is.

    Returns
    -------
    Document
        The section is the first one.

    >>> with_laboratory(Document("Probe"), LaboratoryStatements()).sections[0].heading
    'Laboratory and instrument'
    """
    if statements is None:
        return document
    return replace(document, sections=(laboratory_section(statements), *document.sections))


def laboratory_section(statements: LaboratoryStatements) -> Section:
    """What the laboratory states, field by field; an open field is shown as not stated.

    Parameters
    ----------
    statements : LaboratoryStatements

    Returns
    -------
    Section
        It belongs to the full report: to pages, and to the terminal where that is asked for.
    """
    return Section(
        "Laboratory and instrument",
        figures=tuple(map(stated_figure, statements.of_report())),
        detail=True,
    )


def stated_figure(statement: Statement) -> KeyFigure:
    """One statement; an open one is shown as not stated."""
    return KeyFigure(statement.meaning, statement.text or NOT_STATED)
