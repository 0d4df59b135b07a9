"""The table of tolerances: feature, characteristic and limits are edited, next to the results."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeAlias

from nicegui import ui

from pretravel.app import (
    ScreenState,
    ShownResult,
    Work,
    here,
    live,
    note,
    problem_said,
    rebuild,
    sign_and_word,
    text,
)
from pretravel.base import PretravelError
from pretravel.drawing.screen.rows import (
    CHARACTERISTICS,
    ToleranceRow,
    restored,
    rows_of_faces,
    stored,
)
from pretravel.drawing.screen.work import TOLERANCES, PartResult, filled_rows
from pretravel.drawing.tasks.measure.lines import ToleranceLine
from pretravel.drawing.tasks.measure.task import MeasuredFeatures
from pretravel.show import Judgement

_HEADINGS = ("feature", "characteristic", "limits", "datums", "value", "U", "k", "verdict", "")
_WORDS = {"": "datum alone", "size": "size (diameter, width)", "form": "form (flatness, …)"}


def in_one_line(number: str) -> str:
    r"""A number that keeps its unit in its line: words before it may stand above.

    >>> in_one_line("at most 0.002 mm")
    'at most 0.002\xa0mm'
    """
    words, _, unit = number.rpartition(" ")
    return f"{words}\xa0{unit}" if words else number


def rows_in(state: ScreenState) -> list[ToleranceRow]:
    """The rows that the project has."""
    return restored(str(state.settings.get(TOLERANCES) or ""))


def tolerance_table(
    state: ScreenState,
    points: Work[PartResult],
    measured: Callable[[], Work[ShownResult[MeasuredFeatures]]],
) -> None:
    """The buttons that fill the table, and the table.

    Parameters
    ----------
    state : ScreenState
    points : Work
        The compensation.
    measured : callable
        Gives the work whose newest result stands next to the rows.
    """
    _fill_buttons(state, points)

    def show() -> None:
        rows = rows_in(state)
        if rows:
            _table(state, rows, measured())
        else:
            note(
                "Fill the table from the model or the drawing, or take a row for each touched "
                "face; then type the limits."
            )

    live([state.listen], show, lambda: [row.feature for row in rows_in(state)])


def _fill_buttons(state: ScreenState, points: Work[PartResult]) -> None:
    result: PartResult = points.result

    def put(rows: Sequence[ToleranceRow]) -> None:
        state.settings[TOLERANCES] = stored(rows)

    async def fill() -> None:
        files = [next(iter(state.files[name]), None) for name in ("part", "drawing")]
        try:
            put(await asyncio.to_thread(filled_rows, *files))
        except PretravelError as error:
            problem_said(str(error))

    def by_faces() -> None:
        result: PartResult = points.result
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


def _table(
    state: ScreenState, rows: list[ToleranceRow], work: Work[ShownResult[MeasuredFeatures]]
) -> None:
    """A line for each row; its fields stay while the results next to them come."""
    lines: list[_Line] = []
    with ui.element("div").classes("table-frame").props(
        'tabindex="0" role="region" aria-label="Tolerances to edit"'
    ), ui.element("table").classes("tolerance-rows"):  # fmt: skip
        with ui.element("thead"), ui.element("tr"):
            for heading in _HEADINGS:
                text("th", heading).props('scope="col"')
        with ui.element("tbody"):
            for place, row in enumerate(rows):
                with ui.element("tr"):
                    lines.append(_Line(state, place, row))

    shown: list[object] = []

    def show() -> None:
        now, found = rows_in(state), work.result
        for line, row in zip(lines, now, strict=False):
            line.show_row(row)
        key = (id(found), [row.characteristic for row in now])
        if shown == [key]:
            return
        shown[:] = [key]
        results = [] if found is None else found.made.lines
        kinds = {row.feature: str(row.stated.get("kind", "")) for row in now if row.stated}
        for line, row in zip(lines, now, strict=False):
            line.show_result(_line_of(row, kinds.get(row.feature, ""), results))

    show()
    here([state.listen, work.listen], show)


def _line_of(row: ToleranceRow, kind: str, lines: Sequence[ToleranceLine]) -> ToleranceLine | None:
    """The result of a row."""
    called = row.called(kind)
    names = (row.feature, row.feature.partition(" (")[0])
    own = [one for one in lines if one.feature in names or one.feature.partition(" (")[0] in names]
    return next((one for one in own if one.characteristic == called), None)


_Typed: TypeAlias = Literal["characteristic", "limits", "datums"]
_BOXES: tuple[tuple[_Typed, str], ...] = (("limits", "11.95..12.05 or 0.02"), ("datums", "A|B|C"))


class _Line:
    """A line of the table: what a person types, and the result."""

    def __init__(self, state: ScreenState, place: int, row: ToleranceRow) -> None:
        self._state, self._place, self._feature = state, place, row.feature
        self._fields: dict[_Typed, Any] = {}
        text("th", row.feature).props('scope="row"')
        with ui.element("td"):
            box: Any = ui.select(
                {word: _WORDS.get(word, word) for word in CHARACTERISTICS},
                value=row.characteristic, on_change=self._change("characteristic"),
            ).props(f'dense borderless aria-label="Characteristic of {row.feature}"')  # fmt: skip
            self._fields["characteristic"] = box
        for name, hint in _BOXES:
            with ui.element("td"):
                typed = getattr(row, name)
                box = ui.input(value=typed, placeholder=hint, on_change=self._change(name))
                box.props(f'dense debounce="600" aria-label="{name} of {row.feature}"')
                self._fields[name] = box
        self._numbers = [text("td", "", "number") for _ in range(3)]
        self._verdict = ui.element("td").classes("row-verdict")
        with ui.element("td"):
            more = ui.button(icon="add", on_click=self._another).props("flat dense")
            more.props(f'aria-label="Another tolerance of {row.feature}"')

    def show_row(self, row: ToleranceRow) -> None:
        """Show what another tab has typed."""
        for name, field in self._fields.items():
            if str(field.value or "") != getattr(row, name):
                field.set_value(getattr(row, name))

    def show_result(self, line: ToleranceLine | None) -> None:
        """Show the newest result."""
        words = ("", "", "") if line is None else (line.value_text, line.u_text, line.k_text)
        for cell, content in zip(self._numbers, words, strict=True):
            cell.text = in_one_line(content)
        rebuild(self._verdict, lambda: self._judge(line))

    @staticmethod
    def _judge(line: ToleranceLine | None) -> None:
        if line is not None:
            with ui.element("span").classes(f"row-judgement {line.level}"):
                sign_and_word(Judgement(line.level, line.words), "span")

    def _change(self, name: _Typed) -> Callable[[Any], None]:
        def to(event: Any) -> None:
            rows, typed = rows_in(self._state), str(event.value or "")
            if self._is_there(rows) and getattr(rows[self._place], name) != typed:
                rows[self._place] = rows[self._place].with_typed(name, typed)
                self._state.settings[TOLERANCES] = stored(rows)

        return to

    def _is_there(self, rows: Sequence[ToleranceRow]) -> bool:
        """Whether the row is where it was: others can have come before it."""
        place = self._place
        return place < len(rows) and rows[place].feature == self._feature

    def _another(self) -> None:
        rows = rows_in(self._state)
        if self._is_there(rows):
            rows.insert(self._place + 1, ToleranceRow(self._feature, "position"))
            self._state.settings[TOLERANCES] = stored(rows)
