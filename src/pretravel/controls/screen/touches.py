"""The touches as a table with ticks: an unticked touch is left out, and the fit follows."""

from __future__ import annotations

import numpy as np
from nicegui import ui

from pretravel.app import WORKS, ScreenState, here, live, note, rebuild, text
from pretravel.base import describe
from pretravel.controls.screen.settings import EngineerSettings, file_mark
from pretravel.controls.screen.work import FIT, FitResult
from pretravel.show import number_text, signed_decimals

FEW_ROWS, MOST_ROWS = 10, 150
"""Of the table at first, and of all; of more touches those with the largest residuals."""


def set_used(state: ScreenState, name: str, *, used: bool) -> None:
    """Use a touch, or leave it out.

    Parameters
    ----------
    state : ScreenState
    name : str
        By which it is left out.
    used : bool
    """
    now = EngineerSettings.of(state.settings, state.files["touches"][0].content)
    others = [one for one in now.left_out if one != name]
    leave_out(state, others if used else [*others, name])


def leave_out(state: ScreenState, names: list[str]) -> None:
    """Leave out these touches of the file that is there, and no others."""
    mark = file_mark(state.files["touches"][0].content)
    state.settings["left_out"] = {"file": mark, "left_out": names}


def rows_shown(result: FitResult, most: int = MOST_ROWS) -> tuple[int, ...]:
    """Rows of the table: all; of many those left out, the outliers and the largest residuals."""
    count = len(result.names)
    if count <= most:
        return tuple(range(count))
    size = np.abs(result.touches.residuals)
    size[result.touches.outliers | result.touches.left_out] = np.inf
    return tuple(sorted(np.argsort(-size, kind="stable")[:most].tolist()))


class _Shown:
    """Rows of the table: those of the first fit stay while touches are ticked; all on demand."""

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        self.rows: tuple[int, ...] = ()
        self.most = FEW_ROWS

    def of(self, result: FitResult) -> tuple[int, ...]:
        rows = rows_shown(result, self.most)
        if result.names != self.names or self.most == MOST_ROWS:
            self.names, self.rows = result.names, rows
        special = np.flatnonzero(result.touches.outliers | result.touches.left_out)
        self.rows = tuple(sorted({*self.rows, *special[:MOST_ROWS].tolist()}))
        return self.rows


def touches_table(state: ScreenState) -> None:
    """The table, which keeps the keyboard's place while the fit follows."""
    fit, shown = WORKS.of(state, FIT), _Shown()

    def build() -> None:
        if fit.result is None:
            return
        count, rows = len(fit.result.names), shown.of(fit.result)
        if len(rows) < count:
            note(f"The {len(rows)} touches with the largest residuals of {count}:")
        _table(state, fit.result, rows)
        if shown.most == FEW_ROWS and len(rows) < count:
            ui.button(f"Show {min(count, MOST_ROWS)} touches", on_click=show_all).props(
                "no-caps outline"
            )

    def show_all() -> None:
        shown.most = MOST_ROWS
        rebuild(place, build)

    def key() -> object:
        return None if fit.result is None else (fit.result.names, shown.of(fit.result))

    def left_out() -> object:
        touches = None if fit.result is None else fit.result.touches.left_out
        given = state.settings.get("diameter") is not None
        return given if touches is None else (int(touches.sum()), len(touches))

    # Of one height: the rows below do not move while they are ticked.
    live([fit.listen, state.listen], lambda: _left_out(state, fit.result), left_out).classes(
        "left-out"
    )
    place = live([fit.listen], build, key)


def _left_out(state: ScreenState, result: FitResult | None) -> None:
    """How many are left out, with a button that uses all again."""
    if result is None:
        given = state.settings.get("diameter") is not None
        first = "When the probe is qualified" if given else "Give the diameter of the reference"
        note(f"{first}{',' if given else ': then'} a bad touch can be unticked.")
        return
    count = int(result.touches.left_out.sum())
    if not count:
        note("A bad touch? Untick it below, or click it in the picture.")
        return
    with ui.element("div").classes("question"):
        text("p", f"You left out {count} of {len(result.names)} touches.")

        def use_all() -> None:
            leave_out(state, [])

        ui.button("Use all touches again", on_click=use_all).props("no-caps outline")


def _table(state: ScreenState, result: FitResult, rows: tuple[int, ...]) -> None:
    with (
        ui.element("div")
        .classes("table-frame touches")
        .props('tabindex="0" role="region"') as frame
    ):
        frame.props["aria-label"] = "Touches"
        with ui.element("table").classes("sortable"):
            with ui.element("thead"), ui.element("tr"):
                for heading in ("use", "touch", "direction", "residual/µm", "remark"):
                    with ui.element("th").props('scope="col"'):
                        text("button", heading).props('type="button"')
            with ui.element("tbody"):
                lines = [_row(state, result, row) for row in rows]
    work = WORKS.of(state, FIT)

    def refresh() -> None:
        if work.result is not None and work.result.names == result.names:
            for row, line in zip(rows, lines, strict=True):
                line.show(work.result, row)

    here([work.listen], refresh)


class _Line:
    """A row of the table, whose cells follow the fit."""

    def __init__(self, box: ui.element, residual: ui.element, remark: ui.element) -> None:
        self.box, self.residual, self.remark = box, residual, remark

    def show(self, result: FitResult, row: int) -> None:
        """Show the newest fit; nothing is sent where nothing has changed."""
        self.box.props["checked"] = not result.touches.left_out[row]
        for cell, content in zip((self.residual, self.remark), _cells(result, row), strict=True):
            cell.text = content  # type: ignore[attr-defined]


def _cells(result: FitResult, row: int) -> tuple[str, str]:
    remark = "left out" if result.touches.left_out[row] else ""
    if not remark and result.touches.outliers[row]:
        remark = "outlier"
    return number_text(float(result.touches.residuals[row]), signed_decimals(2)), remark


def _row(state: ScreenState, result: FitResult, row: int) -> _Line:
    label, name = result.touches.labels[row], result.names[row]
    residual, remark = _cells(result, row)
    with ui.element("tr"):
        with ui.element("td"), ui.element("label").classes("tick"):
            box = ui.element("input").props('type="checkbox"')
            box.props["checked"] = not result.touches.left_out[row]
            box.props["aria-label"] = f"Use touch {label}"
            box.on(
                "change",
                lambda event: set_used(state, name, used=bool(event.args)),
                js_handler="(event) => emit(event.target.checked)",
            )
        text("td", label)
        text("td", describe(result.directions[row]))
        return _Line(box, text("td", residual), text("td", remark))
