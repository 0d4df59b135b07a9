"""Laboratory: traces of a rig → calibration and certificate; readings → machine and probe apart."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import Any

from nicegui import ui

from pretravel.app import (
    CERTIFICATES,
    Job,
    ScreenState,
    ShownResult,
    Work,
    choice_field,
    described_field,
    described_fields,
    document_screen,
    example_button,
    file_drop,
    folded,
    kept,
    live,
    no_result,
    note,
    page_button,
    plot,
    result_button,
    result_place,
    same_elsewhere,
    screen_places,
    statements_form,
    work_status,
)
from pretravel.base import MICROMETRE
from pretravel.laboratory.rig.moved_marks import MovedMark
from pretravel.laboratory.tasks.rig.report import trace_view
from pretravel.laboratory.tasks.rig.screen_work import (
    RIG_FORM,
    SEPARATION_FORM,
    RigResult,
    calibrate_rig_traces,
    moved_marks,
    separate_readings,
    shown_events,
)
from pretravel.laboratory.tasks.rig.task import CalibratedRig
from pretravel.laboratory.tasks.separate.task import SeparatedErrors
from pretravel.show import Document, plotly_figure

RIG = Job(
    "rig",
    calibrate_rig_traces,
    "Evaluating the traces",
    settings=(*RIG_FORM.stored, "statements"),
    files=("traces", "budget"),
    needs=("traces",),
)
SEPARATION = Job(
    "separate",
    separate_readings,
    "Separating machine and probe",
    settings=(*SEPARATION_FORM.stored, "statements"),
    files=("readings",),
    needs=("readings",),
)
WORK = {"rig": "Traces of a calibration rig", "separation": "Machine and probe separated"}
EXAMPLE_TRACES = tuple(
    f"rig/rig_{azimuth:03d}_{repeat}.csv" for azimuth in (0, 60, 90) for repeat in (1, 2)
)
_MOVABLE = {
    "displaylogo": False,
    "responsive": False,
    "scrollZoom": False,
    "edits": {"shapePosition": True},
}


def show(state: ScreenState) -> None:
    """Build the screen."""
    choice_field(state, "work", "What do you have?", WORK, default="rig")
    live(
        [state.listen],
        lambda: _separation(state) if _work(state) == "separation" else _rig(state),
        key=partial(_work, state),
    )


def _work(state: ScreenState) -> str:
    return str(state.settings.get("work", "rig"))


def _rig(state: ScreenState) -> None:
    places = screen_places()
    with places.inputs:
        file_drop(
            state, "traces", "Traces of the rig", endings=(".csv",), several=True,
            hint="rig_AZIMUTH_REPEAT.csv with time_s,ruler_mm,laser_mm,contact,trigger",
        )  # fmt: skip
        example_button(state, {"traces": EXAMPLE_TRACES}, {"mark": [], "exclude": []})
        file_drop(state, "budget", "Budget of your rig", endings=(".csv",))
        with folded("Ruler"):
            of_traces = ("exclude", "mark")  # stated in the tab of the trace
            names = [name for name in RIG_FORM.names if name not in of_traces]
            described_fields(state, RIG_FORM, names)
        statements_form(state)
    with places.status:
        work = work_status(
            state, RIG, missing="Drop the traces of the rig, one file for each touch."
        )
    document_screen(
        places, work, _without_traces,
        empty="The pretravel in each direction of the rig, with its uncertainty",
    )  # fmt: skip
    with places.tab("One trace"):
        result_place(work, partial(_one_trace, state), empty=no_result, says_warnings=False)
    with places.tab("Files"):
        kept(work, lambda: _rig_to_keep(work))
        live([work.listen], lambda: _same(work.result), lambda: work.result)


def _without_traces(result: RigResult) -> Document:
    """The report without the pictures of traces, which have a tab of their own."""
    traces = {trace.name for trace in result.rig.traces}
    pictures = tuple(
        picture for picture in result.document.pictures if picture.view.title not in traces
    )
    return replace(result.document, pictures=pictures)


def _one_trace(state: ScreenState, result: RigResult) -> None:
    _trace_chooser(state, result)
    live(
        [state.listen],
        lambda: _show_trace(state, result),
        key=lambda: state.settings.get("trace"),
    )


def _rig_to_keep(work: Work[RigResult]) -> None:
    with ui.element("div").classes("buttons"):
        for name, label in CERTIFICATES.items():
            page_button(
                work, lambda result: result.certificate, lambda result: result.same.command_line(),
                name=name, label=label, template=CalibratedRig.template,
            )  # fmt: skip
        result_button(
            work, "rig.csv", "rig.csv",
            lambda path, result: result.rig.write("output", path),
        )  # fmt: skip
        page_button(
            work, lambda result: result.rig.page(), lambda result: result.same.command_line(),
            name="rig.json", label="rig.json", template=CalibratedRig.template,
        )  # fmt: skip


def _same(result: RigResult | ShownResult[SeparatedErrors] | None) -> None:
    if result is not None and result.same is not None:
        same_elsewhere(result.same)


def _trace_chooser(state: ScreenState, result: RigResult) -> None:
    names = {}
    for touch in result.rig.touches:
        why = result.rig.calibration.not_used.get(touch.trace)
        left_out = f", left out: {why}" if why else ""
        pretravel = f"{touch.pretravel / MICROMETRE:.2f} µm"
        names[touch.trace] = f"{touch.trace}: pretravel {pretravel}{left_out}"
    choice_field(state, "trace", "Trace", names, default=result.rig.touches[0].trace)


def _show_trace(state: ScreenState, result: RigResult) -> None:
    trace, touch = result.trace(str(state.settings.get("trace", "")))
    marks = [mark for mark in _marks(state) if MovedMark.parse(mark).trace == trace.name]
    whole, signals, contact = trace_view(trace, touch).charts
    note("Drag r0, r1, r2 or r3 to where you see it, or type its place below the picture.")
    figure = plotly_figure(contact) | {"config": _MOVABLE}
    shown = plot(figure, f"{trace.name}: {contact.title}")
    shown.on("plotly_relayout", partial(_dragged, state, trace.name, shown_events(touch)))
    with ui.element("div").classes("field-grid"):
        for event in shown_events(touch):
            _mark_field(state, trace.name, event, float(getattr(touch, event)))
    with ui.element("div").classes("buttons"):
        if marks:
            taken = partial(_without_marks, state, trace.name)
            ui.button("Take my marks away", icon="undo", on_click=taken).props("no-caps outline")
        excluded = trace.name in state.settings.get("exclude", [])
        ui.button(
            "Include this trace" if excluded else "Leave this trace out",
            icon="add" if excluded else "remove",
            on_click=partial(_exclude, state, trace.name, not excluded),
        ).props("no-caps outline")
    for line in touch.notes:
        note(line)
    with ui.element("div").classes("charts"):
        for chart in (whole, signals):
            plot(plotly_figure(chart), f"{trace.name}: {chart.title}")


def _dragged(state: ScreenState, trace: str, events: list[str], event: Any) -> None:
    """A line was dragged: shapes have the order of the events; places are in µm."""
    for key, place in event.args.items():
        found = re.fullmatch(r"shapes\[(\d+)\]\.x0", key)
        if found and int(found[1]) < len(events) and isinstance(place, (int, float)):
            _set_mark(state, trace, events[int(found[1])], round(place * MICROMETRE, 9))


def _marks(state: ScreenState) -> list[str]:
    return state.settings.get("mark", [])  # type: ignore[no-any-return]


def _set_mark(state: ScreenState, trace: str, event: str, place: float) -> None:
    state.settings["mark"] = moved_marks(_marks(state), trace, event, place)


def _without_marks(state: ScreenState, trace: str) -> None:
    state.settings["mark"] = [
        mark for mark in _marks(state) if MovedMark.parse(mark).trace != trace
    ]


def _exclude(state: ScreenState, trace: str, leave_out: bool) -> None:
    others = [name for name in state.settings.get("exclude", []) if name != trace]
    state.settings["exclude"] = [*others, trace] if leave_out else others


def _mark_field(state: ScreenState, trace: str, event: str, place: float) -> None:
    shown = f"{place / MICROMETRE:.4f}"
    field = ui.input(f"{event} [µm]", value=shown).props('outlined inputmode="decimal"')
    field.classes("field")

    def commit() -> None:
        try:
            typed = float(str(field.value))
        except ValueError:
            field.set_value(shown)
            return
        if str(field.value) != shown:
            _set_mark(state, trace, event, round(typed * MICROMETRE, 9))

    field.on("keydown.enter", commit).on("blur", commit)


def _separation(state: ScreenState) -> None:
    places = screen_places()
    with places.inputs:
        file_drop(
            state, "readings", "Multi-step readings", endings=(".csv",),
            hint="machine index, probe index, reading: the error of the machine minus that of "
            "the probe",
        )  # fmt: skip
        example_button(state, {"readings": ["redundancy_24x24.csv"]}, {})
        described_field(state, SEPARATION_FORM, "method")
        with folded("More settings"):
            names = [name for name in SEPARATION_FORM.names if name != "method"]
            described_fields(state, SEPARATION_FORM, names)
        statements_form(state)
    with places.status:
        work = work_status(state, SEPARATION, missing="Drop the readings of a multi-step test.")
    document_screen(
        places, work, lambda result: result.document,
        empty="The errors of the machine, and separately those of the probe",
    )  # fmt: skip
    with places.tab("Files"):
        kept(work, lambda: _separation_to_keep(work))
        live([work.listen], lambda: _same(work.result), lambda: work.result)


def _separation_to_keep(work: Work[ShownResult[SeparatedErrors]]) -> None:
    with ui.element("div").classes("buttons"):
        page_button(
            work, lambda result: result.document, lambda result: result.command,
            name="separation.html",
        )  # fmt: skip
        result_button(
            work, "separation.csv", "separation.csv",
            lambda path, result: result.made.write("output", path),
        )  # fmt: skip
        page_button(
            work, lambda result: result.document, lambda result: result.command,
            name="separation.json", label="separation.json",
        )  # fmt: skip
    note("A reading is the error of the machine minus that of the probe.")
