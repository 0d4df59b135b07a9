"""A document as text for a terminal: verdict and key figures first, the rest where it is wanted."""

from __future__ import annotations

import re
import textwrap

from pretravel.show.document import Document, KeyFigure, Section, Table
from pretravel.show.formatting import cell_texts, figure_text, heading_text

_OBEYED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
_LABEL = 18
_WIDTH = 99


def terminal_text(document: Document, *, verbose: bool = False) -> str:
    """A document as lines of text; its warnings are not part of them.

    Parameters
    ----------
    document : Document
    verbose : bool
        The full report; else verdict, key figures, main tables and notes.

    >>> print(terminal_text(Document("Probe", "It conforms.", (KeyFigure("force", 0.75, "N"),))))
    It conforms.
      force              0.75 N
    """
    blocks = [
        "\n".join([document.verdict or document.title, *_figure_lines(document.figures, verbose)])
    ]
    blocks += _table_blocks(document.tables, verbose)
    for section in document.sections:
        blocks += _section_blocks(section, verbose)
    blocks.append("\n".join(_wrapped(f"Note: {note}", "") for note in document.notes))
    return printable("\n\n".join(block for block in blocks if block))


def printable(text: str) -> str:
    r"""A text without signs that a terminal obeys, or that turn the direction of reading.

    >>> print(printable("map\x1b[2J\nline 2"))
    map\x1b[2J
    line 2
    """
    return _OBEYED.sub(lambda sign: sign[0].encode("unicode_escape").decode(), text)


def table_text(table: Table) -> str:
    """A table as text: the first column to the left, the others to the right.

    >>> from pretravel.show.document import Column
    >>> print(table_text(Table((Column("kind", ("mean",)), Column("rms", (2.0,), "µm")))))
    kind  rms/µm
    mean    2.00
    """
    columns = [[heading_text(column), *cell_texts(column)] for column in table.columns]
    widths = [max(len(cell) for cell in cells) for cells in columns]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in zip(*columns, strict=True)
    )


def _figure_lines(figures: tuple[KeyFigure, ...], verbose: bool) -> list[str]:
    """Names to the left, values in one column next to them."""
    shown = [figure for figure in figures if verbose or not figure.detail]
    label = max([_LABEL, *(len(figure.name) for figure in shown)])
    indent = " " * (label + 3)
    return [_wrapped(figure_text(figure), f"  {figure.name:{label}s} ", indent) for figure in shown]


def _table_blocks(tables: tuple[Table, ...], verbose: bool) -> list[str]:
    blocks = []
    for table in tables:
        if verbose or not table.detail:
            explanation = _wrapped(table.explanation) if verbose and table.explanation else ""
            parts = [table.title, explanation, table_text(table)]
            blocks.append("\n".join(part for part in parts if part))
    return blocks


def _section_blocks(section: Section, verbose: bool) -> list[str]:
    if section.detail and not verbose:
        return []
    lines = [section.heading, *(_wrapped(paragraph) for paragraph in section.paragraphs)]
    lines += _figure_lines(section.figures, verbose)
    tables = _table_blocks(section.tables, verbose)
    head = "\n".join(line for line in lines if line)
    if head == section.heading and tables:
        return [f"{head}\n{tables[0]}", *tables[1:]]
    return [head, *tables]


def _wrapped(text: str, first: str = "  ", indent: str = "  ") -> str:
    """Lines of a text; a number and its unit stay on one line."""
    lines = textwrap.fill(
        re.sub(r"(?<=\d) (?=[%µm])", "\xa0", text),
        width=_WIDTH,
        initial_indent=first,
        subsequent_indent=indent,
        break_on_hyphens=False,
        break_long_words=False,
    )
    return lines.replace("\xa0", " ") or first.rstrip()
