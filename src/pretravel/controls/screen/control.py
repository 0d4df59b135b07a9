"""Values and programs for the control: choice, settings, download."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from pretravel.app import (
    WORKS,
    ScreenState,
    Work,
    described_field,
    described_fields,
    folded,
    kept,
    live,
    measure_with_map,
    note,
    outcome,
    panel,
    result_button,
    result_folder_button,
    text,
    warning,
)
from pretravel.base import PretravelError
from pretravel.controls.screen.settings import CONTROL, export_name
from pretravel.controls.screen.work import EXPORT, FIT, ExportResult, FitResult
from pretravel.controls.tasks.export.task import makes_folder, steps_at_control


def control_panel(state: ScreenState) -> None:
    """The choice of the control, and the files to download."""
    with panel("3 Values for your control"):
        described_field(state, CONTROL, "to")
        live([state.listen], lambda: _settings(state), lambda: _chosen(state) is None)
        export = outcome(state, EXPORT, _warnings)
        kept(export, lambda: _download(export), lambda result: result.to)
        live([export.listen], lambda: _steps(export.result), lambda: export.result)
        fit = WORKS.of(state, FIT)
        live([fit.listen], lambda: _nothing_yet(fit), lambda: fit.result is None)
        kept(fit, lambda: _map_files(fit))
        kept(fit, measure_with_map)


def _chosen(state: ScreenState) -> str | None:
    return CONTROL.value(state.settings, "to")  # type: ignore[no-any-return]


def _settings(state: ScreenState) -> None:
    if _chosen(state) is None:
        return
    with folded("Settings of the control"):
        described_fields(state, CONTROL, [name for name in CONTROL.names if name != "to"])


def _warnings(result: ExportResult) -> None:
    for words in result.files.warnings:
        warning(words[0].upper() + words[1:])


def _download(work: Work[ExportResult]) -> None:
    """The files of the control."""

    def write(path: Path, result: ExportResult) -> None:
        if result.to != to:  # chosen so shortly before that this button is still there
            raise PretravelError("You have chosen another control: press its button.")
        result.made.write("output", path)

    to = work.result.to
    name = export_name(to)
    if makes_folder(to):
        button = result_folder_button(work, f"Download {name}.zip", f"{name}.zip", write)
    else:
        button = result_button(work, f"Download {name}", name, write)
    button.props(remove="outline", add="unelevated").classes("main-download")


def _steps(result: ExportResult | None) -> None:
    if result is None:
        return
    text("h3", "At the control")
    with ui.element("ol").classes("steps"):
        for step in steps_at_control(result.to, result.files):
            text("li", step)


def _nothing_yet(work: Work[FitResult]) -> None:
    if work.result is None:
        note("The map and the report can be downloaded here when the probe is qualified.")


def _map_files(work: Work[FitResult]) -> None:
    """The map and the page of the qualification."""

    def write(path: Path, result: FitResult) -> None:
        from pretravel.files import write_map

        write_map(path, result.qualified.pretravel_map)

    def page(path: Path, result: FitResult) -> None:
        from pretravel.show import write_page

        write_page(path, result.report, record=result.record)

    with folded("Map and report"):
        for ending, words in (
            ("json", "Map for pretravel (.json)"),
            ("csv", "Map as table"),
        ):
            result_button(work, words, f"map.{ending}", write)
        result_button(work, "Report (page)", "qualification.html", page)
