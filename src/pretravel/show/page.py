"""A document as one HTML file that opens anywhere: text, tables, pictures and scripts in it.

The page needs no network: a policy in it forbids everything from elsewhere. Every text is escaped.
The values of its tables are also in it as JSON, for its scripts.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files as package_files
from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.base import installed_version, whole_file
from pretravel.show.chart import SpaceChart
from pretravel.show.chart_plotly import colour_names, plotly_script, plotly_script_gzip
from pretravel.show.document import Column, Document, KeyFigure, Section, Table
from pretravel.show.formatting import (
    addition_text,
    cell_texts,
    expanded_text,
    heading_text,
    number_text,
    remark_text,
    significant,
    value_text,
)
from pretravel.show.glossary_terms import words_used
from pretravel.show.page_content import (
    PageContent,
    content_values,
    image_address,
    packed_values,
    picture_figures,
    picture_name,
)
from pretravel.show.page_pdf import write_pdf
from pretravel.show.work_record import (
    InputFile,
    WorkRecord,
    inputs_table,
    record_figures,
    settings_table,
)
from pretravel.uncertainty import COVERAGE_FACTOR

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

LARGEST = 3_000_000
"""Most bytes of a page whose pictures can be turned; a larger page has still pictures."""
_BLOCK, _COLUMNS_OF_A_PAGE = 40, 16
"""Most rows of a block of a long table on a certificate; and columns of blocks side by side."""
_MANY_COLUMNS, _MOST_COLUMNS = 8, 12
"""Columns of a table that is printed in small type; and in several parts, one below the other."""


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
        Names of files next to the page, to link to.
    record : WorkRecord or None
        The command and its input files.
    template : str
        The form: page.html or certificate.html.

    Raises
    ------
    PretravelError
        No program for a PDF was found.
    """
    write_contents(path, [PageContent(document, record, tuple(files), template)])


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
    return contents_text([PageContent(document, record, tuple(files), template)])


def write_contents(path: str | Path, contents: Sequence[PageContent], *, title: str = "") -> None:
    """Write a page of one or several reports, whole or not at all; as `contents_text`."""
    if Path(path).suffix.lower() == ".pdf":
        write_pdf(path, contents_text(contents, title=title, scripts=False))
        return
    text = contents_text(contents, title=title)
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def contents_text(contents: Sequence[PageContent], *, title: str = "", scripts: bool = True) -> str:
    """A page of one or several reports as HTML.

    Parameters
    ----------
    contents : sequence of PageContent
    title : str
        Above all of them, with a table of contents; empty: there is one report.
    scripts : bool
        False: a page to print.
    """
    charts = _charts(contents) if scripts else ""
    reports = [_shown(index, content) for index, content in enumerate(contents)]
    values = {
        "reports": reports,
        "words": words_used(content.document for content in contents),
        "title": title or contents[0].document.title,
        "content": content_values(contents),
        "charts": charts,
        "version": installed_version(),
        "coverage_factor": number_text(COVERAGE_FACTOR, significant(3)),
    }
    form = "bound.html" if title else "page.html"
    if not (title or scripts) and reports[0].stated:
        form = "printed.html"
    page = page_environment().get_template(form)
    images = _images(contents)
    if charts:
        with_plotly = _assets(scripts=True, plotly=True)
        text = page.render(values, images=images, assets=with_plotly, still=False)
        if len(text.encode()) <= LARGEST:
            return text
    without = _assets(scripts=scripts, plotly=False)
    return page.render(values, images=images, assets=without, still=bool(charts))


def _images(contents: Sequence[PageContent]) -> dict[str, str]:
    """The addresses of all pictures by their names."""
    return {
        picture_name(report, index): image_address(picture)
        for report, content in enumerate(contents)
        for index, picture in enumerate(content.document.pictures)
    }


@dataclass(frozen=True)
class _ShownReport:
    """A report as the templates show it."""

    index: int
    document: Document
    files: tuple[str, ...]
    template: str
    done: tuple[KeyFigure, ...] = ()
    inputs: Table | None = None
    settings: Table | None = None
    given: int = 0
    input_files: tuple[InputFile, ...] = ()

    @property
    def stated(self) -> dict[str, str]:
        """What a laboratory states, by the places in its file; empty: it is not a certificate."""
        figures = (figure for section in self.document.sections for figure in section.figures)
        return {figure.statement: str(figure.value) for figure in figures if figure.statement}

    @property
    def certificate_title(self) -> str:
        """What it is called on paper."""
        of_calibration = self.template == "certificate.html"
        return "Calibration certificate" if of_calibration else "Certificate"

    @property
    def certificate_number(self) -> str:
        """Empty where it is not stated."""
        number = self.stated.get("certificate.number", "")
        return "" if number == "not stated" else number


def _shown(index: int, content: PageContent) -> _ShownReport:
    record = content.record
    if record is None:
        return _ShownReport(index, content.document, content.files, content.template)
    return _ShownReport(
        index,
        content.document,
        content.files,
        content.template,
        record_figures(record),
        inputs_table(record.inputs) if record.inputs else None,
        settings_table(record.settings) if record.settings else None,
        sum(setting.given for setting in record.settings),
        record.inputs,
    )


def _charts(contents: Sequence[PageContent]) -> str:
    """The figures of all pictures for Plotly, and the colours that they name; empty: none.

    Where nothing turns in space there are none: Plotly has four times the size of such a page.
    """
    pictures = (picture for content in contents for picture in content.document.pictures)
    if not any(isinstance(chart, SpaceChart) for picture in pictures for chart in picture.charts):
        return ""
    figures = {
        picture_name(report, index): made
        for report, content in enumerate(contents)
        for index, picture in enumerate(content.document.pictures)
        if (made := picture_figures(picture))
    }
    named = set(re.findall(r'"(@[\w~]+)"', json.dumps(figures)))
    light, dark = (
        {name: colour for name, colour in colour_names(dark=dark).items() if name in named}
        for dark in (False, True)
    )
    return packed_values({"figures": figures, "light": light, "dark": dark})


@dataclass(frozen=True)
class _Assets:
    """The style and the scripts of a page, and the policy that allows these alone."""

    policy: str
    style: Markup
    script: Markup
    plotly: Markup


@cache
def _assets(*, scripts: bool, plotly: bool) -> _Assets:
    from markupsafe import Markup

    style, fit, script = (
        package_files("pretravel.show").joinpath(f"templates/{name}").read_text(encoding="utf-8")
        for name in ("page.css", "fit.js", "page.js")
    )
    script = fit + script
    allowed = [_digest(script.encode()) if scripts else "'none'"]
    packed = ""
    if plotly:
        allowed.append(_digest(plotly_script()))
        packed = base64.b64encode(plotly_script_gzip()).decode()
    policy = (
        "default-src 'none'; base-uri 'none'; form-action 'none'; img-src data: blob:; "
        f"style-src 'unsafe-inline'; script-src {' '.join(allowed)}"
    )
    return _Assets(policy, Markup(style), Markup(script if scripts else ""), Markup(packed))


def _digest(script: bytes) -> str:
    """A script as the policy of a page names it."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script).digest()).decode()}'"


@cache
def page_environment() -> Environment:
    """The templates of pages, with the filters that turn values into text; texts are escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("pretravel.show"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {
        "allow_nan": False,
        "ensure_ascii": False,
        "separators": (",", ":"),
    }
    environment.filters |= {
        "addition": addition_text,
        "charts_of": lambda picture: len(picture.charts),
        "expanded": expanded_text,
        "file_name": lambda name: re.split(r"[/\\]", name)[-1],
        "heading": heading_text,
        "name_of": _name,
        "number": lambda figure: value_text(figure.value, "", figure.digits),
        "numeric": _is_numeric,
        "printed_blocks": _printed_blocks,
        "printed_parts": _printed_parts,
        "printed_sections": _printed_sections,
        "remark_of": remark_text,
        "rows": _rows,
        "sentence": _sentence,
        "style_text": _style_text,
        "width_class": lambda table: (
            "columns-many" if len(table.columns) >= _MANY_COLUMNS else "columns-few"
        ),
    }
    return environment


def _rows(columns: Sequence[Column]) -> list[tuple[str, ...]]:
    """The cells of columns, row by row."""
    return list(zip(*map(cell_texts, columns), strict=True))


def _is_numeric(column: Column) -> bool:
    """Whether most cells are numbers."""
    words = sum(isinstance(value, str) for value in column.values)
    return 2 * words < len(column.values)


def _name(table: Table) -> str:
    """What a reader of screens says for a table."""
    return table.title or f"Table: {', '.join(column.name for column in table.columns)}"


def _printed_parts(table: Table) -> list[tuple[Column, ...]]:
    """The columns of a table that fit on paper side by side, with the first one in each part."""
    columns = table.columns
    if len(columns) <= _MOST_COLUMNS:
        return [columns]
    step = _MOST_COLUMNS - 1
    return [(columns[0], *columns[k : k + step]) for k in range(1, len(columns), step)]


def _printed_blocks(table: Table) -> list[list[tuple[Column, ...]]]:
    """The rows of a table on a certificate: blocks that stand side by side, one group below the
    other.
    """
    columns, rows = table.columns, len(table.columns[0].values)
    beside = max(1, min(3, _COLUMNS_OF_A_PAGE // len(columns)))
    if beside == 1 or rows <= _BLOCK // 2:
        return [[columns]]
    groups = math.ceil(rows / (beside * _BLOCK))
    step = math.ceil(rows / (beside * groups))
    blocks = [
        tuple(replace(column, values=column.values[start : start + step]) for column in columns)
        for start in range(0, rows, step)
    ]
    return [blocks[start : start + beside] for start in range(0, len(blocks), beside)]


def _printed_sections(sections: Sequence[Section]) -> list[Section]:
    """The sections of a certificate, without the statements, which its first page has."""
    kept = [section for section in sections if section.certificate or not section.detail]
    own = [
        replace(section, figures=tuple(f for f in section.figures if not f.statement))
        for section in kept
    ]
    return [section for section in own if section.paragraphs or section.figures or section.tables]


def _sentence(note: str) -> str:
    """A note as a sentence; a name at its beginning stays as it is."""
    first = note[:1].upper() if re.match("[a-z]+ ", note) else note[:1]
    return first + note[1:] + ("" if note.endswith((".", "!", "?")) else ".")


def _style_text(text: str) -> Markup:
    """A text as a string of a style sheet; signs of the language are escaped."""
    from markupsafe import Markup

    signs = (c if c == " " or (c.isascii() and c.isalnum()) else f"\\{ord(c):x} " for c in text)
    return Markup(f'"{"".join(signs)}"')
