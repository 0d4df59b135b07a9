"""The table of tolerances: a person edits feature, characteristic, limits; results stand beside."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, Literal

from nicegui import ui

from pretravel.app import ScreenState, Work, live, note, sign_and_word, text
from pretravel.base import PretravelError
from pretravel.drawing.screen.rows import (
    CHARACTERISTICS,
    ToleranceRow,
    restored,
    rows_of_faces,
    stored,
)
from pretravel.drawing.screen.work import TOLERANCES, PartFeatures, PartResult, filled_rows
from pretravel.drawing.tasks.measure.lines import ToleranceLine
from pretravel.show import Judgement

_HEADINGS = ("feature", "characteristic", "limits", "datums", "value", "U", "k", "verdict", "")
_WORDS = {"": "datum alone", "size": "size (diameter, width)", "form": "form (flatness, …)"}


def rows_in(state: ScreenState) -> list[ToleranceRow]:
    """The rows that the project has."""
    return restored(str(state.settings.get(TOLERANCES) or ""))


def tolerance_table(state: ScreenState, result: PartResult, measured: Callable[[], Work]) -> None:
    """The buttons that fill the table, and the table.

    Parameters
    ----------
    state : ScreenState
    result : PartResult
    measured : callable
        Gives the work whose newest result stands beside the rows.
    """
    _fill_buttons(state, result)

    def show() -> None:
        rows = rows_in(state)
        if rows:
            _table(state, rows, measured().result)
        else:
            note(
                "Fill the table from the model or the drawing, or take a row for each touched "
                "face; then type the limits."
            )

    live([state.listen, measured().listen], show, lambda: _shape(state, measured()))


def _shape(state: ScreenState, work: Work) -> object:
    """What makes the table be rebuilt: other rows or other results, no typing in a field."""
    rows = rows_in(state)
    return ([(row.feature, row.characteristic) for row in rows], id(work.result))


def _fill_buttons(state: ScreenState, result: PartResult) -> None:
    def put(rows: Sequence[ToleranceRow]) -> None:
        state.settings[TOLERANCES] = stored(rows)

    async def fill() -> None:
        files = [next(iter(state.files[name]), None) for name in ("part", "drawing")]
        try:
            put(await asyncio.to_thread(filled_rows, *files))
        except PretravelError as error:
            ui.notify(str(error), type="warning", multi_line=True, close_button="Close")

    def by_faces() -> None:
        assert result.part is not None
        assert result.face is not None
        touched = {result.part.faces[index].number for index in result.face.tolist()}
        known = {row.feature for row in rows_in(state)}
        more = [row for row in rows_of_faces(result.part, list(touched))
                if row.feature not in known]  # fmt: skip
        put([*rows_in(state), *more])

    with ui.element("div").classes("buttons"):
        fill_button = ui.button("Fill from the model or the drawing", icon="fact_check")
        fill_button.on_click(fill).props("no-caps outline")
        if result.part is not None and result.face is not None:
            row_button = ui.button("A row for each touched face", icon="add", on_click=by_faces)
            row_button.props("no-caps outline")
        clear = ui.button("Empty the table", icon="delete", on_click=lambda: put(()))
        clear.props("no-caps flat")


def _table(state: ScreenState, rows: list[ToleranceRow], found: PartFeatures | None) -> None:
    lines = [] if found is None else list(found.features.lines)
    kinds = {row.feature: str(row.stated.get("kind", "")) for row in rows if row.stated}
    with ui.element("div").classes("table-frame").props(
        'tabindex="0" role="region" aria-label="Tolerances to edit"'
    ), ui.element("table").classes("tolerance-rows"):  # fmt: skip
        with ui.element("thead"), ui.element("tr"):
            for heading in _HEADINGS:
                text("th", heading).props('scope="col"')
        with ui.element("tbody"):
            for place, row in enumerate(rows):
                line = _line_of(row, kinds.get(row.feature, ""), lines)
                _row(state, place, row, line)


def _line_of(row: ToleranceRow, kind: str, lines: Sequence[ToleranceLine]) -> ToleranceLine | None:
    """The result of a row."""
    called = row.called(kind)
    names = (row.feature, row.feature.partition(" (")[0])
    own = [one for one in lines if one.feature in names or one.feature.partition(" (")[0] in names]
    return next((one for one in own if one.characteristic == called), None)


def _row(state: ScreenState, place: int, row: ToleranceRow, line: ToleranceLine | None) -> None:
    def change(name: Literal["characteristic", "limits", "datums"]) -> Callable[[Any], None]:
        def to(event: Any) -> None:
            rows = rows_in(state)
            rows[place] = rows[place].with_typed(name, str(event.value or ""))
            state.settings[TOLERANCES] = stored(rows)

        return to

    def another() -> None:
        rows = rows_in(state)
        rows.insert(place + 1, ToleranceRow(row.feature, "position"))
        state.settings[TOLERANCES] = stored(rows)

    with ui.element("tr"):
        text("th", row.feature).props('scope="row"')
        with ui.element("td"):
            ui.select(
                {word: _WORDS.get(word, word) for word in CHARACTERISTICS},
                value=row.characteristic, on_change=change("characteristic"),
            ).props(f'dense borderless aria-label="Characteristic of {row.feature}"')  # fmt: skip
        boxes: tuple[tuple[Literal["limits", "datums"], str], ...]
        boxes = (("limits", "11.95..12.05 or 0.02"), ("datums", "A|B|C"))
        for name, hint in boxes:
            with ui.element("td"):
                box = ui.input(value=getattr(row, name), placeholder=hint, on_change=change(name))
                box.props(f'dense debounce="600" aria-label="{name} of {row.feature}"')
        for words in ("", "", "") if line is None else (line.value_text, line.u_text, line.k_text):
            text("td", words, "number")
        with ui.element("td").classes("row-verdict"):
            if line is not None:
                with ui.element("span").classes(f"row-judgement {line.level}"):
                    sign_and_word(Judgement(line.level, line.words), "span")
        with ui.element("td"):
            more = ui.button(icon="add", on_click=another).props("flat dense")
            more.props(f'aria-label="Another tolerance of {row.feature}"')
