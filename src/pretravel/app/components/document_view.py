"""A `Document` of the report room on a screen."""

from __future__ import annotations

import asyncio
import base64
from collections.abc import Iterable, Sequence

from nicegui import background_tasks, ui
from nicegui.element import Element

from pretravel.app.components.layout import folded, text, warning
from pretravel.app.components.plot import plot
from pretravel.show.chart import Chart
from pretravel.show.chart_plotly import plotly_figure
from pretravel.show.document import Document, KeyFigure, Picture, Table
from pretravel.show.formatting import addition_text, cell_texts, heading_text, value_text
from pretravel.show.plotly_parts import PlotlyFigure

__all__ = ["document_view", "key_figures", "picture_view", "plot", "table_view"]


def document_view(document: Document, *, pictures: bool = True) -> None:
    """Show a report: verdict, warnings, key figures, pictures, tables, sections, notes.

    Parameters
    ----------
    document : Document
    pictures : bool
        Whether its pictures are shown; a screen with pictures of its own leaves them out.
    """
    with ui.element("article").classes("document"):
        if document.verdict:
            text("p", document.verdict, "verdict")
        for content in document.warnings:
            warning(content)
        key_figures(figure for figure in document.figures if not figure.detail)
        if pictures:
            for picture in document.pictures:
                picture_view(picture)
        for table in document.tables:
            if not table.detail:
                table_view(table)
        for content in document.notes:
            text("p", content, "note")
        _details(document)


def _details(document: Document) -> None:
    figures = [figure for figure in document.figures if figure.detail]
    tables = [table for table in document.tables if table.detail]
    if not (figures or tables or document.sections):
        return
    with folded("All figures and tables"):
        key_figures(figures)
        for table in tables:
            table_view(table)
        for section in document.sections:
            if section.heading:
                text("h3", section.heading)
            for paragraph in section.paragraphs:
                text("p", paragraph)
            key_figures(section.figures)
            for table in section.tables:
                table_view(table)


def key_figures(figures: Iterable[KeyFigure]) -> None:
    """Quantities with their units and uncertainties."""
    listed = list(figures)
    if not listed:
        return
    with ui.element("dl").classes("key-figures"):
        for figure in listed:
            with ui.element("div"):
                text("dt", figure.name)
                with ui.element("dd"):
                    text("span", value_text(figure.value, figure.unit, figure.digits), "value")
                    text("span", addition_text(figure).removeprefix(", "), "addition")


class DataTable(Element, component="data_table.js"):
    """A table whose headings sort it; long ones are shown in parts.

    Parameters
    ----------
    headings : sequence of str
    rows : sequence of sequence of str
    numbers : sequence of bool
        The columns of numbers.
    label : str
    """

    def __init__(
        self,
        headings: Sequence[str],
        rows: Sequence[Sequence[str]],
        numbers: Sequence[bool],
        label: str,
    ) -> None:
        super().__init__()
        self._props["headings"] = list(headings)
        self._props["rows"] = [list(row) for row in rows]
        self._props["numbers"] = list(numbers)
        self._props["label"] = label


def table_view(table: Table) -> None:
    """A table; a click on a heading sorts it."""
    if table.title:
        text("h3", table.title)
    cells = [cell_texts(column) for column in table.columns]
    numbers = [any(isinstance(value, float) for value in c.values) for c in table.columns]
    headings = [heading_text(column) for column in table.columns]
    DataTable(headings, list(zip(*cells, strict=True)), numbers, table.title or "Table")
    if table.explanation:
        text("p", table.explanation, "note")


def picture_view(picture: Picture) -> None:
    """A picture with its caption; charts can be turned, zoomed and read off.

    What it shows is computed in a thread: the page does not wait for it.
    """
    place = ui.element("div").classes("live picture-place")

    async def fill() -> None:
        charts, png = await asyncio.to_thread(_computed, picture)
        if place.is_deleted:
            return
        with place:
            for chart, figure in charts:
                plot(figure, chart.title or picture.caption)
            if png:
                _image(png, picture.caption)
        place.classes(remove="picture-place", add="charts" if charts else "")

    background_tasks.create(fill(), name="picture")


def _computed(picture: Picture) -> tuple[list[tuple[Chart, PlotlyFigure]], bytes]:
    charts = [(chart, plotly_figure(chart)) for chart in picture.charts]
    return charts, b"" if charts else picture.png


def _image(png: bytes, caption: str) -> None:
    with ui.element("figure").classes("picture"):
        image = ui.element("img").props('loading="lazy"')
        image.props["src"] = f"data:image/png;base64,{base64.b64encode(png).decode()}"
        image.props["alt"] = caption
        text("figcaption", caption)
