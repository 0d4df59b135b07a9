"""What a page contains."""

from __future__ import annotations

import base64
import gzip
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from pretravel.show.as_json import document_values
from pretravel.show.chart import SpaceChart
from pretravel.show.chart_plotly import plotly_figure
from pretravel.show.document import Document, Picture, Table
from pretravel.show.plotly_parts import PlotlyFigure
from pretravel.show.style import png_content
from pretravel.show.work_record import WorkRecord, inputs_table, settings_table

TEMPLATES = ("page.html", "certificate.html")
"""The forms of a report on a page."""


@dataclass(frozen=True)
class PageContent:
    """A report on a page.

    Attributes
    ----------
    document : Document
    record : WorkRecord or None
        The command and its input files.
    files : tuple of str
        Names of files next to the page.
    template : str
        One of `TEMPLATES`.
    """

    document: Document
    record: WorkRecord | None = None
    files: tuple[str, ...] = ()
    template: str = "page.html"


def picture_figures(picture: Picture) -> list[PlotlyFigure]:
    """A picture for Plotly, chart by chart; empty where it has no charts."""
    return [plotly_figure(chart) for chart in picture.charts]


def image_address(picture: Picture) -> str:
    """The image of a picture as an address that contains it.

    WebP is smaller than PNG; Pillow, which matplotlib needs, can lack it. Lines keep their colours
    without losses; surfaces in space have small losses and a third of the size.
    """
    from PIL import Image, features

    kind, content = "png", io.BytesIO()
    if features.check("webp"):
        from PIL import WebPImagePlugin  # noqa: F401  # Pillow would load all of its formats

        kind = "webp"
        in_space = any(isinstance(chart, SpaceChart) for chart in picture.charts)
        form = {"quality": 88} if in_space else {"lossless": True, "quality": 0}
        Image.fromarray(picture.pixels).convert("RGB").save(content, kind, method=1, **form)
    else:
        content.write(png_content(picture.pixels))
    return f"data:image/{kind};base64,{base64.b64encode(content.getvalue()).decode()}"


def packed_values(values: Any) -> str:
    """Values as compressed JSON in letters."""
    text = json.dumps(values, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


def picture_name(report: int, picture: int) -> str:
    """The name of a picture within a page.

    >>> picture_name(0, 2)
    'picture-0-2'
    """
    return f"picture-{report}-{picture}"


def content_values(contents: Sequence[PageContent]) -> dict[str, Any]:
    """The values of a page for its scripts: its tables with all digits.

    >>> content_values([PageContent(Document("Probe"))])["reports"][0]["document"]
    {'title': 'Probe'}
    """
    return {"reports": [_report_values(content) for content in contents]}


def _report_values(content: PageContent) -> dict[str, Any]:
    plain = replace(content.document, pictures=(), data=())
    values: dict[str, Any] = {"document": document_values(plain)}
    if content.record is not None:
        tables = {
            "inputs": inputs_table(content.record.inputs),
            "settings": settings_table(content.record.settings),
        }
        values |= {
            name: _table_values(table) for name, table in tables.items() if table.columns[0].values
        }
    return values


def _table_values(table: Table) -> dict[str, Any]:
    values: dict[str, Any] = document_values(Document("", tables=(table,)))["tables"][0]
    return values
