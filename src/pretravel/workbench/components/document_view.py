"""A `Document` of the report room on a screen."""

from __future__ import annotations

import base64
from collections.abc import Iterable

from nicegui import ui

from pretravel.report.chart_plotly import plotly_figure
from pretravel.report.document import Document, KeyFigure, Picture, Table
from pretravel.report.formatting import addition_text, cell_texts, heading_text, value_text
from pretravel.workbench.components.layout import folded, note, text, warning
from pretravel.workbench.components.plot import plot

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


def table_view(table: Table) -> None:
    """A table; a click on a heading sorts it."""
    if table.title:
        text("h3", table.title)
    cells = [cell_texts(column) for column in table.columns]
    with ui.element("div").classes("table-frame").props('tabindex="0" role="region"') as frame:
        frame.props["aria-label"] = table.title or "Table"
        with ui.element("table").classes("sortable"):
            with ui.element("thead"), ui.element("tr"):
                for column in table.columns:
                    with ui.element("th").props('scope="col"'):
                        text("button", heading_text(column)).props('type="button"')
            with ui.element("tbody"):
                for row in zip(*cells, strict=True):
                    with ui.element("tr"):
                        for cell in row:
                            text("td", cell)
    if table.explanation:
        text("p", table.explanation, "note")


def picture_view(picture: Picture) -> None:
    """A picture with its caption; charts can be turned, zoomed and read off."""
    if picture.charts:
        with ui.element("div").classes("charts"):
            for chart in picture.charts:
                title = chart.title or picture.caption
                plot(plotly_figure(chart), title)
                if chart.note:
                    note(chart.note)
        return
    with ui.element("figure").classes("picture"):
        address = f"data:image/png;base64,{base64.b64encode(picture.png).decode()}"
        image = ui.element("img").props('loading="lazy"')
        image.props["src"] = address
        image.props["alt"] = picture.caption
        text("figcaption", picture.caption)
