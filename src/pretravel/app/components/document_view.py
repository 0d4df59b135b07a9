"""A `Document` of the report room on a screen."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Iterable, Sequence

from nicegui import background_tasks, ui
from nicegui.element import Element

from pretravel.app.components.layout import (
    ScreenPlaces,
    empty_state,
    folded,
    note,
    text,
    warning,
)
from pretravel.app.components.outcome import result_place
from pretravel.app.components.plot import plot
from pretravel.app.jobs import Made, Work
from pretravel.show import (
    Chart,
    Document,
    Judgement,
    KeyFigure,
    Picture,
    PlotlyFigure,
    Section,
    Table,
    addition_text,
    cell_texts,
    heading_text,
    image_address,
    plotly_figure,
    value_text,
)


def document_view(document: Document) -> None:
    """Show a report in one place: verdict, key figures, pictures, tables, notes, details."""
    with ui.element("article").classes("document"):
        _head(document)
        with ui.element("div").classes("pictures"):
            for picture in document.pictures:
                picture_view(picture)
        _tables(document)
        _details(document)


def document_answer(document: Document) -> None:
    """The part of a report that answers: verdict, warnings and key figures."""
    with ui.element("article").classes("document"):
        _head(document)


def document_picture(document: Document) -> None:
    """The main picture of a report, for the place that stays in view."""
    for picture in document.pictures[:1]:
        picture_view(picture)


def document_details(document: Document) -> None:
    """The rest of a report: main tables, notes, more pictures, and all figures and tables."""
    with ui.element("article").classes("document"):
        _tables(document)
        with ui.element("div").classes("pictures"):
            for picture in document.pictures[1:]:
                picture_view(picture)
        short = len(document.pictures) < 2 and all(table.detail for table in document.tables)
        _details(document, opened=short)
        if short and not (document.notes or _has_details(document)):
            note("There are no further details.")


def document_screen(
    places: ScreenPlaces, work: Work[Made], document_of: Callable[[Made], Document], *, empty: str
) -> None:
    """The answer, the picture and the tab Details of a screen whose result is a report.

    Parameters
    ----------
    places : ScreenPlaces
    work : Work
    document_of : callable
        Takes a result and returns its report.
    empty : str
        What will be seen in the place of the picture.
    """
    with places.answer:
        result_place(work, lambda result: document_answer(document_of(result)))
    with places.picture:
        result_place(
            work, lambda result: document_picture(document_of(result)),
            empty=lambda: empty_state("insert_chart_outlined", empty), says_warnings=False,
        )  # fmt: skip
    with places.tab("Details"):
        result_place(
            work, lambda result: document_details(document_of(result)), empty=no_result,
            says_warnings=False,
        )  # fmt: skip


def no_result() -> None:
    """Of a tab, before the first result."""
    note("No result yet: it will appear here.")


def _head(document: Document) -> None:
    if document.verdict:
        verdict_card(document.verdict, document.judgement)
    for content in document.warnings:
        warning(content)
    key_figures(figure for figure in document.figures if not figure.detail)


def _tables(document: Document) -> None:
    for table in document.tables:
        if not table.detail:
            table_view(table)
    for content in document.notes:
        text("p", content, "note")


_SIGNS = {"good": "check_circle", "caution": "warning", "bad": "cancel"}


def verdict_card(
    sentence: str,
    judgement: Judgement | None = None,
    *,
    figures: Sequence[KeyFigure] = (),
    prose: Sequence[str] = (),
) -> None:
    """The answer: colour with a sign and a word, some large numbers, and a sentence.

    Parameters
    ----------
    sentence : str
    judgement : Judgement, optional
    figures : sequence of KeyFigure
        That are shown large.
    prose : sequence of str
        Below.
    """
    level = judgement.level if judgement is not None else "neutral"
    with ui.element("div").classes(f"verdict-card {level}"):
        if judgement is not None:
            with text("p", "", "judgement"):
                sign_and_word(judgement, "strong")
        if figures:
            with ui.element("dl").classes("large-figures"):
                for figure in figures:
                    with ui.element("div"):
                        text("dt", figure.name)
                        text("dd", value_text(figure.value, figure.unit, figure.digits), "value")
                        if figure.remark:
                            text("dd", figure.remark, "addition")
        if rest := _after_word(sentence, judgement):
            text("p", rest, "verdict")
        for words in prose:
            text("p", words)


def _after_word(sentence: str, judgement: Judgement | None) -> str:
    """A sentence without the word that stands above it.

    >>> _after_word("no change found since March: 9 touches", Judgement("good", "No change found"))
    'Since March: 9 touches'
    >>> _after_word("goods", Judgement("good", "Good"))
    'goods'
    """
    word = "" if judgement is None else judgement.word
    rest = sentence[len(word) :]
    if not word or sentence[: len(word)].lower() != word.lower() or rest[:1].isalnum():
        return sentence
    rest = rest.lstrip(" :;,.")
    return rest[:1].upper() + rest[1:]


def sign_and_word(judgement: Judgement, tag: str) -> None:
    """The sign of a judgement, and its word in an HTML element."""
    ui.icon(_SIGNS[judgement.level]).props('aria-hidden="true"')
    text(tag, judgement.word)


def _has_details(document: Document) -> bool:
    figures = any(figure.detail for figure in document.figures)
    return bool(document.sections) or figures or any(table.detail for table in document.tables)


def _details(document: Document, *, opened: bool = False) -> None:
    figures = [figure for figure in document.figures if figure.detail]
    tables = [table for table in document.tables if table.detail]
    if not _has_details(document):
        return
    with folded("All figures and tables", opened=opened):
        key_figures(figures)
        for table in tables:
            table_view(table)
        for section in document.sections:
            if section.heading:
                text("h3", section.heading)
            section_view(section)


def section_view(section: Section) -> None:
    """A part of a report, without its heading."""
    for paragraph in section.paragraphs:
        text("p", paragraph)
    key_figures(section.figures)
    for table in section.tables:
        table_view(table)


_LONG_VALUE = 20
"""Characters above which a key figure has two places."""


def key_figures(figures: Iterable[KeyFigure]) -> None:
    """Quantities with their units and uncertainties."""
    listed = list(figures)
    if not listed:
        return
    with ui.element("dl").classes("key-figures"):
        for figure in listed:
            value = value_text(figure.value, figure.unit, figure.digits)
            with ui.element("div").classes("words" if len(value) > _LONG_VALUE else ""):
                text("dt", figure.name)
                with ui.element("dd"):
                    with ui.element("span").classes("value"):
                        for part in _whole_parts(value, figure.unit):
                            text("span", part, "whole")
                    text("span", addition_text(figure).removeprefix(", "), "addition")


def _whole_parts(value: str, unit: str) -> list[str]:
    """A value in parts that are not broken: a number with its unit, the numbers of a list.

    >>> _whole_parts("0.8 to 1.2 N", "N"), _whole_parts("12.5,-3.0,0.1", "")
    (['0.8 to ', '1.2 N'], ['12.5,', '-3.0,', '0.1'])
    """
    if unit and value.count(" ") > 1 and value.endswith(f" {unit}"):
        place = value.removesuffix(f" {unit}").rfind(" ") + 1
        return [value[:place], value[place:]]
    return re.findall(r"[^,]+,?", value) if "," in value and " " not in value else [value]


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
        charts, image = await asyncio.to_thread(_computed, picture)
        if place.is_deleted:
            return
        with place:
            for chart, figure in charts:
                plot(figure, chart.title or picture.caption)
            if image:
                _image(image, picture.caption)
        place.classes(remove="picture-place", add="charts" if charts else "")

    background_tasks.create(fill(), name="picture")


def _computed(picture: Picture) -> tuple[list[tuple[Chart, PlotlyFigure]], str]:
    charts = [(chart, plotly_figure(chart)) for chart in picture.charts]
    return charts, "" if charts else image_address(picture)


def _image(address: str, caption: str) -> None:
    with ui.element("figure").classes("picture"):
        image = ui.element("img").props('loading="lazy"')
        image.props["src"] = address
        image.props["alt"] = caption
        text("figcaption", caption)
