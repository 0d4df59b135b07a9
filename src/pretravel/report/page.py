"""A document as one HTML file that opens anywhere: text, tables and pictures in it."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.report.document import Document, Picture, Table
from pretravel.report.formatting import addition_text, cell_texts, heading_text, value_text
from pretravel.whole_file import whole_file

if TYPE_CHECKING:
    from jinja2 import Environment
    from matplotlib.figure import Figure


def write_page(path: str | Path, document: Document, files: Sequence[str] = ()) -> None:
    """Write a page with the full report, whole or not at all.

    Parameters
    ----------
    path : str or Path
    document : Document
    files : strings
        Names of files beside the page, to link to.
    """
    write_template(path, "page.html", document=document, files=files)


def page_text(document: Document, files: Sequence[str] = ()) -> str:
    """The page of a document as HTML.

    >>> "<h1>Touches &amp; points</h1>" in page_text(Document("Touches & points"))
    True
    """
    return _environment().get_template("page.html").render(document=document, files=files)


def write_template(path: str | Path, template: str, **values: Any) -> None:
    """Write a page from a template of this package, whole or not at all.

    Parameters
    ----------
    path : str or Path
    template : str
        Name of a file in the folder templates.
    **values
        What the template shows.
    """
    text = _environment().get_template(template).render(**values)
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


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
    data = io.BytesIO()
    picture.draw().savefig(data, format="png")
    return f"data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}"


_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem;"
    "color:#222}img{max-width:100%}pre{background:#f4f4f2;padding:1rem;overflow-x:auto}"
    "h1,h2{color:#1b4965}figure{margin:1rem 0}figcaption{color:#555;font-size:.9em}"
)


def write_text_page(
    path: str | Path,
    title: str,
    sections: Sequence[tuple[str, str]],
    figures: Mapping[str, Figure],
    files: Sequence[str] = (),
) -> None:
    """Write a page, whole or not at all.

    Parameters
    ----------
    path : str or Path
    title : str
    sections : pairs of heading and text
        A section without a heading is running text, others are set as they are.
    figures : mapping of caption to matplotlib.figure.Figure
        Held in the page itself.
    files : strings
        Names of files beside the page, to link to.
    """
    blocks = [
        f"<h2>{html.escape(heading)}</h2><pre>{html.escape(text)}</pre>"
        if heading
        else f"<p>{html.escape(text)}</p>"
        for heading, text in sections
    ]
    blocks += [figure_block(caption, figure) for caption, figure in figures.items()]
    links = ", ".join(f'<a href="{name}">{html.escape(name)}</a>' for name in files)
    heading = [f"<h1>{html.escape(title)}</h1>", *([f"<p>Files: {links}</p>"] if files else [])]
    write_html(path, title, _STYLE, [*heading, *blocks])


def figure_block(caption: str, figure: Figure) -> str:
    """A figure with its caption, held in the page itself."""
    picture = io.BytesIO()
    figure.savefig(picture, format="png")
    data = base64.b64encode(picture.getvalue()).decode()
    words = html.escape(caption)
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{words}">'
        f"<figcaption>{words}</figcaption></figure>"
    )


def write_html(path: str | Path, title: str, style: str, blocks: Sequence[str]) -> None:
    """Write blocks of HTML as a page, whole or not at all."""
    page = "\n".join(
        [
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">',
            f"<title>{html.escape(title)}</title><style>{style}</style></head><body>",
            *blocks,
            "</body></html>\n",
        ]
    )
    with whole_file(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
