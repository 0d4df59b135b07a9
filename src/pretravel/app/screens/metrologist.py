"""Metrologist: touches on a calibrated sphere → figures of a standard, budget, certificate."""

from __future__ import annotations

import asyncio
from functools import partial

from nicegui import ui

from pretravel.app.components.document_view import document_view
from pretravel.app.components.downloads import result_button
from pretravel.app.components.fields import choice_field, number_field, switch_field
from pretravel.app.components.file_drop import file_drop
from pretravel.app.components.layout import (
    folded,
    inputs_and_results,
    live,
    note,
    panel,
)
from pretravel.app.components.outcome import kept, outcome
from pretravel.app.components.page_button import page_button
from pretravel.app.components.same_elsewhere import same_elsewhere
from pretravel.app.components.statements import statements_form
from pretravel.app.project import ScreenState, StoredFile
from pretravel.app.screens.metrologist_work import (
    CHECK_SETTINGS,
    EXAMPLE_SETTINGS,
    CheckResult,
    check_by_standard,
    example_touches,
)
from pretravel.app.tasks import Task, Work
from pretravel.files.csv_table import write_csv_table
from pretravel.files.standard_figures import standard_table
from pretravel.tasks.check import applies

CHECK = Task(
    "check",
    check_by_standard,
    "Determining the figures of the standard",
    settings=CHECK_SETTINGS,
    files=("touches", "map"),
    needs=("touches",),
)
STANDARDS = {
    "iso10360-5": "ISO 10360-5: 25 touches on a sphere",
    "iso230-10": "ISO 230-10: 36 touches on the equator",
    "iso230-10-tip-offset": "ISO 230-10, stylus-tip offset: a circle at two orientations",
}


def show(state: ScreenState) -> None:
    """Build the screen."""
    with inputs_and_results() as (inputs, results):
        with inputs:
            _inputs(state)
        with results:
            work = outcome(
                state,
                CHECK,
                _show_result,
                missing="Drop the touches on the sphere, in the pattern of the standard. Those of "
                "the stylus-tip offset have a column spindle_deg.",
            )
            kept(work, lambda: _to_keep(work))
            live([work.listen], lambda: _definitions(work.result), lambda: work.result)


def _inputs(state: ScreenState) -> None:
    choice_field(state, "standard", "Standard", STANDARDS, default="iso10360-5")
    file_drop(state, "touches", "Touches on the calibrated sphere")
    ui.button("Try it with example data", icon="school", on_click=partial(_fill, state)).props(
        "no-caps flat"
    )
    with panel("Reference"):
        number_field(
            state, "diameter", "Diameter of the sphere", unit="mm", default=25.0,
            limits=(0.1, 1000.0),
        )  # fmt: skip
        live([state.listen], partial(_reference, state), key=partial(_standard, state))
        number_field(state, "tip_diameter", "Diameter of the tip", unit="mm", limits=(0.01, 100.0))
    with panel("Limits"):
        live([state.listen], partial(_limits, state), key=partial(_standard, state))
    file_drop(
        state, "map", "Map of the probe, to check the compensated touches",
        endings=(".json", ".csv"),
    )  # fmt: skip
    with folded("More settings"):
        units = {"": "as the file states", "mm": "mm", "inch": "inch"}
        choice_field(state, "units", "Unit of the touches", units, default="")
    statements_form(state)


def _standard(state: ScreenState) -> str:
    return str(state.settings.get("standard", "iso10360-5"))


def _reference(state: ScreenState) -> None:
    standard = _standard(state)
    for name, label in (
        ("u_diameter_um", "u of the diameter"),
        ("sphere_form_um", "Form error of the sphere"),
    ):
        if applies(standard, name):
            number_field(state, name, label, unit="µm", limits=(0.0, 1e3))
    if applies(standard, "ring"):
        switch_field(state, "ring", "The reference is a ring")


def _limits(state: ScreenState) -> None:
    for name, label in (
        ("form_limit_um", "Form error"),
        ("size_limit_um", "Size error"),
        ("repeat_limit_um", "Range of repeats"),
        ("offset_limit_um", "Offset of the tip"),
    ):
        if applies(_standard(state), name):
            number_field(state, name, label, unit="µm", limits=(0.0, 1e6))


async def _fill(state: ScreenState) -> None:
    name, content = await asyncio.to_thread(example_touches, _standard(state))
    for setting, value in EXAMPLE_SETTINGS.items():
        state.settings[setting] = value
    state.files["map"] = ()
    state.files["touches"] = (StoredFile(name, content),)


def _show_result(result: CheckResult) -> None:
    document_view(result.document)


def _to_keep(work: Work) -> None:
    with panel("To keep"), ui.element("div").classes("buttons"):
        page_button(
            work, lambda result: result.document, lambda result: result.command,
            name="certificate.html", label="Certificate (page)",
        )  # fmt: skip
        page_button(
            work, lambda result: result.document, lambda result: result.command,
            name="check.json", label="check.json",
        )  # fmt: skip
        result_button(
            work, "check.csv", "check.csv",
            lambda path, result: write_csv_table(path, standard_table(result.checked.result)),
        )  # fmt: skip


def _definitions(result: CheckResult | None) -> None:
    if result is not None:
        note("The definitions are recalled, not checked against the texts of the standards.")
        same_elsewhere(result.command, result.python)
