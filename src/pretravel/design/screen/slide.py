"""A touch of a design as a picture that steps: contact, tip centre, spindle and force."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

from nicegui import ui

from pretravel.app import (
    ColouredPlot,
    ScreenState,
    choice_field,
    described_fields,
    here,
    kept,
    key_figures,
    live,
    note,
    outcome,
    plot,
    result_button,
    slider_field,
    text,
    verdict_card,
    with_file_names,
)
from pretravel.design.screen.description import is_saved, same_of_design
from pretravel.design.screen.elements import one_at_a_time
from pretravel.design.screen.work import (
    SLIDE,
    SLIDE_FORM,
    SURFACE,
    SURFACES,
    SlideOfDesign,
)

_SHOWN = "slide_shown"


def slide_panel(state: ScreenState) -> None:
    """The fields, the picture of a step with its slider, and the files of a slide."""
    note(
        "The spindle moves on after first contact: the tip stays on the surface, slides, and bends "
        "the stylus until the probe triggers. Model analytic, curved process of Rodrigues 2021."
    )
    with ui.element("div").classes("field-row"):
        choice_field(state, SURFACE, "Surface", dict(SURFACES), default="convex")
        described_fields(state, SLIDE_FORM, SLIDE_FORM.names)
    work = outcome(state, SLIDE, lambda result: _show(state, result))

    def files() -> None:
        with ui.element("div").classes("button-row"):
            result_button(
                work,
                "Steps (.csv)",
                "slide.csv",
                lambda path, result: result.made.write("output", path),
            )

    kept(work, files)

    def of_files() -> object:
        result: SlideOfDesign | None = work.result
        return result and (id(result), is_saved(state, result.digest))

    live([work.listen, state.listen], lambda: _same(state, work.result), of_files)


def _same(state: ScreenState, result: SlideOfDesign | None) -> None:
    if result is not None:
        task = with_file_names(result.made.task, output=Path("slide.csv"))
        same_of_design(state, result.made.task.probe, result.digest, task)


def shown_step(stored: Any, steps: int) -> int:
    """The step that is shown, for what a project has stored.

    >>> shown_step(None, 20), shown_step(7.0, 20), shown_step(30.0, 20)
    (1, 7, 20)
    """
    return min(max(int(stored or 1), 1), steps)


def _show(state: ScreenState, result: SlideOfDesign) -> None:
    from pretravel.design.tasks.slide.report import slide_step_figures

    history, surface = result.made.history, result.made.shape
    steps, radius = len(history), result.made.tip.radius
    verdict_card(result.document.verdict)
    key_figures(result.document.figures)
    for remark in result.document.notes:
        note(remark)
    if state.settings.get(_SHOWN, 1) > steps:
        state.settings[_SHOWN] = float(steps)

    def now() -> int:
        return shown_step(state.settings.get(_SHOWN), steps)

    def step(by: int) -> None:
        state.settings[_SHOWN] = float(shown_step(now() + by, steps))

    text("h3", "Step by step")
    if steps > 1:
        slider_field(state, _SHOWN, "Step", limits=(1.0, float(steps)), step=1.0, default=1.0)
    with ui.element("div").classes("button-row"):
        for name, icon, by in (("Previous", "chevron_left", -1), ("Next", "chevron_right", 1)):
            ui.button(name, icon=icon, on_click=lambda by=by: step(by)).props("no-caps outline")
    with ui.element("div").classes("charts"):
        titles = ("The contact on the surface, at this step", "The six seats, at this step",
                  "Deflection over the feed", "Force over the feed")  # fmt: skip
        places = [plot({"data": [], "layout": {}}, title) for title in titles]
    live([state.listen], lambda: key_figures(slide_step_figures(history, now())), now)
    last: list[int] = []

    async def draw() -> None:
        last[:] = [now()]
        figures = await asyncio.to_thread(_figures, history, surface, radius, last[0])
        _update(places, figures)

    request = one_at_a_time(draw)
    request()
    here([state.listen], lambda: request() if last != [now()] else None)


def _figures(history: Any, surface: Any, radius: float, step: int) -> list[dict[str, Any]]:
    from pretravel.design.tasks.slide.report import slide_step_view
    from pretravel.show import plotly_figure

    return [
        plotly_figure(chart) for chart in slide_step_view(history, surface, radius, step).charts
    ]


def _update(places: list[ColouredPlot], figures: list[dict[str, Any]]) -> None:
    for number, place in enumerate(places):
        if place.is_deleted:
            return
        if number < len(figures):
            place.update_figure(figures[number])
        else:  # no step is before the trigger: no force is known
            place.parent_slot.parent.set_visibility(False)  # type: ignore[union-attr]
