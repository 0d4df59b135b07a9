"""Values and programs for the control: choice, settings, download."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from pretravel.app.components.downloads import result_button, result_folder_button
from pretravel.app.components.fields import choice_field, number_field
from pretravel.app.components.layout import folded, live, note, panel, text, warning
from pretravel.app.components.outcome import kept, outcome
from pretravel.app.project import ScreenState
from pretravel.app.screens.control_steps import control_steps
from pretravel.app.screens.engineer_settings import EXPORT_DEFAULTS, export_name
from pretravel.app.screens.engineer_work import EXPORT, FIT, ExportResult, FitResult
from pretravel.app.tasks import WORKS, Work
from pretravel.base.errors import PretravelError
from pretravel.tasks.export import makes_folder, settings_used, takes_feed

CONTROL_WORDS = {
    None: "Choose …",
    "fanuc": "Fanuc (macro programs)",
    "haas": "Haas (macro programs)",
    "siemens": "Siemens 840D (cycle)",
    "heidenhain": "Heidenhain (table, not verified)",
    "renishaw": "Renishaw cycles (vector radii)",
    "linuxcnc": "LinuxCNC (subroutines)",
    "radii": "Probing screens (radii to type)",
    "csv": "Other: table of effective radii",
}


def control_panel(state: ScreenState) -> None:
    """The choice of the control, and the files to download."""
    with panel("3 Values for your control"):
        choice_field(state, "control", "Your control", CONTROL_WORDS, default=None)
        live([state.listen], lambda: _settings(state), lambda: state.settings.get("control"))
        export = outcome(state, EXPORT, _warnings)
        kept(export, lambda: _download(export), lambda result: result.to)
        live([export.listen], lambda: _steps(export.result), lambda: export.result)
        fit = WORKS.of(state, FIT)
        live([fit.listen], lambda: _nothing_yet(fit), lambda: fit.result is None)
        kept(fit, lambda: _map_files(fit))


def _settings(state: ScreenState) -> None:
    to = state.settings.get("control")
    if to is None:
        return
    used = settings_used(to)
    with folded("Settings of the control"):
        if "units" in used:
            names = {"mm": "Millimetres", "inch": "Inches"}
            choice_field(state, "export_units", "Unit of the table", names, default="mm")
        if "tolerance" in used:
            number_field(
                state, "export_tolerance_um", "Largest deviation from the map", unit="µm",
                default=EXPORT_DEFAULTS["export_tolerance_um"], limits=(1e-6, 1000.0),
            )  # fmt: skip
        if "base" in used:
            number_field(state, "export_base", "First variable", limits=(0, 100_000),
                         hint="Empty: the usual one")  # fmt: skip
        if "program" in used:
            number_field(state, "export_program", "Number of the first program",
                         limits=(1, 99_999), hint="Empty: the usual one")  # fmt: skip
        if "angles" in used:
            names = {"normals": "Outward normals", "travel": "Directions of travel"}
            choice_field(state, "export_angles", "Angles are those of", names, default="normals")
        if "criterion" in used:
            names = {"max": "Largest error", "rms": "Mean square error"}
            choice_field(state, "export_criterion", "What is made small", names, default="max")
        if "form" in used:
            names = {"auto": "Automatic", "formula": "Formula (exact)", "table": "Table"}
            choice_field(state, "export_form", "Form", names, default="auto")
        if "azimuth" in used:
            number_field(state, "export_azimuth_deg", "Azimuth of all touches", unit="°",
                         limits=(-3600.0, 3600.0), hint="Empty: the mean around")  # fmt: skip
        if takes_feed(to):
            number_field(state, "export_feed", "Measuring feed", unit="mm/min", limits=(0.0, 1e6),
                         hint="Only for touches at several feeds")  # fmt: skip


def _warnings(result: ExportResult) -> None:
    for words in result.files.warnings:
        warning(words[0].upper() + words[1:])


def _download(work: Work) -> None:
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
        for step in control_steps(result.to, result.files.texts):
            text("li", step)


def _nothing_yet(work: Work) -> None:
    if work.result is None:
        note("The map and the report can be downloaded here when the probe is qualified.")


def _map_files(work: Work) -> None:
    """The map and the page of the qualification."""

    def write(path: Path, result: FitResult) -> None:
        from pretravel.files.map_file import write_map

        write_map(path, result.qualified.pretravel_map)

    def page(path: Path, result: FitResult) -> None:
        from pretravel.show.page import write_page

        write_page(path, result.report, record=result.record)

    with folded("Map and report"):
        for ending, words in (
            ("json", "Map for pretravel (.json)"),
            ("csv", "Map as table"),
        ):
            result_button(work, words, f"map.{ending}", write)
        result_button(work, "Report (page)", "qualification.html", page)
