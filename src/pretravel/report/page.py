"""A document as one HTML file that opens anywhere: text, tables and pictures in it."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.report.document import Document, Picture, Table
from pretravel.report.formatting import addition_text, cell_texts, heading_text, value_text
from pretravel.report.page_pdf import write_pdf
from pretravel.report.work_record import WorkRecord, record_section
from pretravel.whole_file import whole_file

if TYPE_CHECKING:
    from jinja2 import Environment


def write_page(
    path: str | Path,
    document: Document,
    files: Sequence[str] = (),
    *,
    record: WorkRecord | None = None,
    template: str = "page.html",
) -> None:
    """Write a page with the full report, whole or not at all.

    Parameters
    ----------
    path : str or Path
        Ending in .html; or in .pdf, where a browser prints it.
    document : Document
    files : sequence of str
        Names of files beside the page, to link to.
    record : WorkRecord or None
        What was done with what.
    template : str
        Name of a file in the folder templates.

    Raises
    ------
    PretravelError
        No program for a PDF was found.
    """
    text = page_text(document, files, record=record, template=template)
    if Path(path).suffix.lower() == ".pdf":
        write_pdf(path, text)
        return
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def page_text(
    document: Document,
    files: Sequence[str] = (),
    *,
    record: WorkRecord | None = None,
    template: str = "page.html",
) -> str:
    """The page of a document as HTML.

    >>> "<h1>Touches &amp; points</h1>" in page_text(Document("Touches & points"))
    True
    """
    return (
        _environment()
        .get_template(template)
        .render(
            document=document,
            files=files,
            record=None if record is None else record_section(record),
        )
    )


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("pretravel.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "addition": addition_text,
        "heading": heading_text,
        "png": _png,
        "rows": _rows,
        "value": lambda figure: value_text(figure.value, figure.unit, figure.digits),
    }
    return environment


def _rows(table: Table) -> list[tuple[str, ...]]:
    """The cells of a table, row by row."""
    return list(zip(*(cell_texts(column) for column in table.columns), strict=True))


def _png(picture: Picture) -> str:
    """A picture as an address that contains it."""
    return f"data:image/png;base64,{base64.b64encode(picture.png).decode()}"
