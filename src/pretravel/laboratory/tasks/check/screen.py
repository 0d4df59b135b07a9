"""Metrologist: touches on a calibrated sphere → figures of a standard, budget, certificate."""

from __future__ import annotations

import asyncio
from functools import partial

from nicegui import ui

from pretravel.app import (
    CERTIFICATES,
    Job,
    ScreenState,
    ShownResult,
    StoredFile,
    Work,
    described_field,
    described_fields,
    document_screen,
    file_drop,
    folded,
    from_project,
    kept,
    live,
    note,
    own_data_back,
    page_button,
    panel,
    result_button,
    same_elsewhere,
    screen_places,
    statements_form,
    take_reference,
    work_status,
)
from pretravel.files import comparison_sentence, write_csv_table
from pretravel.laboratory.standards.standard_figures import standard_table
from pretravel.laboratory.tasks.check.screen_work import (
    EXAMPLE_SETTINGS,
    FORM,
    check_by_standard,
    example_touches,
)
from pretravel.laboratory.tasks.check.task import CheckedProbe

CHECK = Job(
    "check",
    check_by_standard,
    "Determining the figures of the standard",
    settings=(*FORM.stored, "statements"),
    files=("touches", "map"),
    needs=("touches",),
)
_REFERENCE = ("diameter", "u_diameter_um", "sphere_form_um", "ring", "tip_diameter")
_LIMITS = tuple(name for name in FORM.names if name.endswith("_limit_um"))
_PLACED = ("standard", *_REFERENCE, *_LIMITS)
_MORE = tuple(name for name in FORM.names if name not in _PLACED)


def show(state: ScreenState) -> None:
    """Build the screen."""
    places = screen_places()
    with places.inputs:
        _inputs(state)
    with places.status:
        work = work_status(
            state,
            CHECK,
            missing="Drop the touches on the sphere, in the pattern of the standard. Those of the "
            "stylus-tip offset have a column spindle_deg.",
        )
    document_screen(
        places, work, lambda result: result.document,
        empty="The residuals of your touches on the sphere, and the figures of the standard below",
    )  # fmt: skip
    with places.tab("Files"):
        kept(work, lambda: _to_keep(work))
        live([work.listen], lambda: _definitions(work.result), lambda: work.result)


def _inputs(state: ScreenState) -> None:
    take_reference(state)
    described_field(state, FORM, "standard")
    file_drop(state, "touches", "Touches on the calibrated sphere")
    ui.button("Try it with example data", icon="school", on_click=partial(_fill, state)).props(
        "no-caps flat"
    )
    own_data_back(state)
    with panel("Reference"):
        described_fields(state, FORM, _REFERENCE)
    with panel("Limits"):
        described_fields(state, FORM, _LIMITS)
    file_drop(
        state, "map", "Map of the probe, to check the compensated touches",
        endings=(".json", ".csv"),
    )  # fmt: skip
    from_project(state, "map", takes_map=True)
    with folded("More settings"):
        described_fields(state, FORM, _MORE)
    statements_form(state)


def _standard(state: ScreenState) -> str:
    return str(FORM.value(state.settings, "standard"))


async def _fill(state: ScreenState) -> None:
    name, content = await asyncio.to_thread(example_touches, _standard(state))
    state.fill(EXAMPLE_SETTINGS, {"map": (), "touches": (StoredFile(name, content),)})


def _to_keep(work: Work[ShownResult[CheckedProbe]]) -> None:
    with ui.element("div").classes("buttons"):
        for name, label in CERTIFICATES.items():
            page_button(
                work, lambda result: result.document, lambda result: result.command,
                name=name, label=label,
            )  # fmt: skip
        page_button(
            work, lambda result: result.document, lambda result: result.command,
            name="check.json", label="check.json",
        )  # fmt: skip
        result_button(
            work, "check.csv", "check.csv",
            lambda path, result: write_csv_table(path, standard_table(result.made.result)),
        )  # fmt: skip


def _definitions(result: ShownResult[CheckedProbe] | None) -> None:
    if result is not None and result.same is not None:
        checked = result.made
        note(comparison_sentence(checked.result.standard, checked.statements))
        same_elsewhere(result.same)
