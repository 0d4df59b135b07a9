"""Values and programs for the control: choice, settings, download."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from pretravel.jobs.export import makes_folder, settings_of, takes_feed, write_export
from pretravel.workbench.components.downloads import download_button, download_folder_button
from pretravel.workbench.components.fields import choice_field, number_field
from pretravel.workbench.components.layout import folded, live, note, panel, text, warning
from pretravel.workbench.components.outcome import outcome
from pretravel.workbench.project import ScreenState
from pretravel.workbench.screens.control_steps import control_steps
from pretravel.workbench.screens.engineer_settings import EXPORT_DEFAULTS, export_name
from pretravel.workbench.screens.engineer_work import EXPORT, FIT, ExportResult, FitResult
from pretravel.workbench.tasks import WORKS

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
        outcome(state, EXPORT, _download)
        fit = WORKS.of(state, FIT)
        live(
            [fit.listen],
            # After an error the old result is not that of the fields.
            lambda: _map_files(None if fit.error else fit.result),
            lambda: (fit.result, fit.error),
        )


def _settings(state: ScreenState) -> None:
    to = state.settings.get("control")
    if to is None:
        return
    used = settings_of(to)
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


def _download(result: ExportResult) -> None:
    """The files of the control."""
    for words in result.files.warnings:
        warning(words[0].upper() + words[1:])

    def write(path: Path) -> None:
        write_export(path, result.files)

    name = export_name(result.to)
    if makes_folder(result.to):
        button = download_folder_button(f"Download {name}.zip", f"{name}.zip", write)
    else:
        button = download_button(f"Download {name}", name, write)
    button.props(remove="outline", add="unelevated").classes("main-download")
    text("h3", "At the control")
    with ui.element("ol").classes("steps"):
        for step in control_steps(result.to, result.files.texts):
            text("li", step)


def _map_files(result: FitResult | None) -> None:
    """The map and the page of the qualification."""
    if result is None:
        note("The map and the report can be downloaded here when the probe is qualified.")
        return
    from pretravel.formats.map_file import write_map
    from pretravel.report.page import write_page

    made = result.qualified.pretravel_map
    with folded("Map and report"):
        for ending, words in (
            ("nc", "Map for pretravel (.nc)"),
            ("csv", "Map as table"),
            ("json", "Map, JSON"),
        ):
            download_button(words, f"map.{ending}", lambda path: write_map(path, made))

        def page(path: Path) -> None:
            write_page(path, result.report, record=result.record)

        download_button("Report (page)", "qualification.html", page)
