"""Part: touches on a part → before and after, single points, features, points to download."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from pretravel.app.components.document_view import (
    document_view,
    key_figures,
    table_view,
)
from pretravel.app.components.downloads import result_button
from pretravel.app.components.fields import choice_field, switch_field
from pretravel.app.components.file_drop import file_drop
from pretravel.app.components.from_project import from_project
from pretravel.app.components.layout import (
    folded,
    inputs_and_results,
    live,
    note,
    panel,
)
from pretravel.app.components.outcome import kept, outcome
from pretravel.app.components.page_button import page_button
from pretravel.app.components.plot import plot
from pretravel.app.components.same_elsewhere import same_elsewhere
from pretravel.app.components.task_fields import described_fields
from pretravel.app.jobs import WORKS, Job, Work
from pretravel.app.project import Inputs, ScreenState, StoredFile
from pretravel.app.screens.part_work import (
    ALIGN_FORM,
    FEATURE_FORM,
    PART_FORM,
    PartFeatures,
    PartResult,
    compensate_part,
    example_map,
    lacking_for_points,
    measure_face,
    measure_part,
)
from pretravel.base.errors import PretravelError
from pretravel.base.units import MICROMETRE
from pretravel.prediction.catalogue import catalogue_names
from pretravel.show.chart_plotly import plotly_figure
from pretravel.show.document import KeyFigure
from pretravel.show.formatting import decimals, signed_decimals
from pretravel.tasks.example_data import example_folder
from pretravel.tasks.reports.budget_report import budget_table
from pretravel.tasks.task import command_line

COMPENSATION = Job(
    "compensate",
    compensate_part,
    "Compensating the touches",
    settings=("probe", "aligned", *PART_FORM.stored, *ALIGN_FORM.stored),
    files=("touches", "map", "part"),
    needs=("touches",),
    lacks=lacking_for_points,
    own_process=True,
)
ENDINGS_OF_POINTS = (".csv", ".json", ".nc", ".qif", ".msr")
_USUAL = ("feature", "select", "by_prefix", "size_tolerance", "form_tolerance", "u_machine_um")
_MORE = tuple(name for name in FEATURE_FORM.names if name not in _USUAL)


def show(state: ScreenState) -> None:
    """Build the screen."""
    with inputs_and_results() as (inputs, results):
        with inputs:
            _inputs(state)
        with results:
            work = outcome(
                state,
                COMPENSATION,
                lambda result: _show_result(state, result),
                missing="1. Drop the touches on the part.  2. Drop the map of the probe (from "
                "Qualify a probe), or choose a probe.  3. With the part as a STEP file the contact "
                "is computed on its faces.",
            )
            kept(work, lambda: _to_keep(work))
            live([work.listen], lambda: _same(work.result), lambda: work.result)


def _inputs(state: ScreenState) -> None:
    file_drop(
        state, "touches", "1. Touches on the part",
        hint="A table (X;Y;Z;I;J;K, x_mm,y_mm,z_mm,nx,ny,nz …) or a log of the control",
    )  # fmt: skip
    file_drop(state, "map", "2. Map of the probe", endings=(".json", ".csv", ".toml"))
    from_project(state, "map", takes_map=True)
    probes = {"": "the map above"} | {name: name for name in catalogue_names()}
    choice_field(state, "probe", "Without a map: a probe of the catalogue", probes, default="")
    file_drop(
        state, "part", "3. The part (if you have it)",
        endings=(".step", ".stp", ".iges", ".igs"),
    )  # fmt: skip
    switch_field(state, "aligned", "The part lies anywhere: find it from the touches")
    _example(state)
    with folded("More settings"):
        described_fields(state, PART_FORM, PART_FORM.names)
    with folded("Settings of the alignment"):
        described_fields(state, ALIGN_FORM, ALIGN_FORM.names)


def _example(state: ScreenState) -> None:
    async def fill() -> None:
        folder = example_folder()
        button.disable()
        name, content = await asyncio.to_thread(example_map, folder)
        state.settings["probe"], state.settings["aligned"] = "", False
        for purpose, file in (("part", "part.step"), ("touches", "part_touches.csv")):
            state.files[purpose] = (StoredFile(file, (folder / file).read_bytes()),)
        state.files["map"] = (StoredFile(name, content),)
        button.enable()

    async def fill_bores() -> None:
        """The same map; labelled touches in two bores, and what is measured of them."""
        await fill()
        state.settings["feature"], state.settings["by_prefix"] = "bore", True
        state.files["part"] = ()
        state.files["touches"] = (
            StoredFile("bore_touches.csv", (example_folder() / "bore_touches.csv").read_bytes()),
        )

    async def fill_bracket() -> None:
        """Touches on a bracket that lies anywhere, without normals, and its STEP file."""
        await fill()
        state.settings["aligned"] = True
        for purpose, file in (("part", "bracket.step"), ("touches", "bracket_touches.csv")):
            state.files[purpose] = (StoredFile(file, (example_folder() / file).read_bytes()),)

    button = ui.button("Try it with example data", icon="school", on_click=fill)
    button.props("no-caps flat")
    bores = ui.button("Example with two bores to measure", icon="school", on_click=fill_bores)
    bores.props("no-caps flat")
    bracket = ui.button(
        "Example of a part that lies anywhere", icon="school", on_click=fill_bracket
    )
    bracket.props("no-caps flat")


def _show_result(state: ScreenState, result: PartResult) -> None:
    document_view(replace(result.document, pictures=()))
    with panel("On the part"):
        note(
            "Click a point for its slide and its budget, and a face of the part to measure it."
            if result.part is not None
            else "Click a point for its slide and its budget."
        )
        for picture in result.document.pictures:
            with ui.element("div").classes("charts"):
                for chart in picture.charts:
                    _clickable(
                        state, result, plotly_figure(chart), f"{picture.caption}: {chart.title}"
                    )
    with panel("One point"):
        live(
            [state.listen],
            lambda: _show_point(state, result),
            key=lambda: state.settings.get("point"),
        )
    if result.part is not None:
        with panel("The face that was clicked"):
            live(
                [state.listen],
                lambda: _show_face(state, result),
                key=lambda: state.settings.get("face"),
            )
    with panel("Features"):
        _show_features(state, result)


def _to_keep(work: Work) -> None:
    def write(path: Path, result: PartResult) -> None:
        result.write_points(path)

    def write_place(path: Path, result: PartResult) -> None:
        assert result.aligned is not None
        result.aligned.write("output", path)

    with panel("Points to download"), ui.element("div").classes("buttons"):
        if work.result is not None and work.result.aligned is not None:
            result_button(work, "place.json", "place.json", write_place)
        for ending in ENDINGS_OF_POINTS:
            result_button(work, f"points{ending}", f"points{ending}", write)
        page_button(
            work, lambda result: result.document,
            lambda result: "\n".join(map(command_line, result.same)),
            name="points.html",
        )  # fmt: skip


def _same(result: PartResult | None) -> None:
    if result is not None:
        same_elsewhere(*result.same)


def _clickable(
    state: ScreenState, result: PartResult, figure: dict[str, Any], description: str
) -> None:
    """A chart whose points, and faces of the part, can be chosen with a click."""

    def choose(event: Any) -> None:
        for point in event.args.get("points", ()):
            rows = figure["data"][point["curveNumber"]].get("customdata", ())
            if point["pointNumber"] < len(rows):
                row = rows[point["pointNumber"]]
                state.settings["point"] = row
                if result.face is not None:
                    state.settings["face"] = int(result.face[row])
                return
            place = [point.get(axis) for axis in "xyz"]
            if all(isinstance(value, int | float) for value in place):
                face = result.face_at(np.array(place, dtype=np.float64))
                if face is not None:
                    state.settings["face"] = face
                    return

    plot(figure, description).on("plotly_click", choose)


def _show_point(state: ScreenState, result: PartResult) -> None:
    points = result.compensated.points
    names = {row: f"{row + 1}: {label}" for row, label in enumerate(points.labels[:5000])}
    choice_field(state, "point", "Point", names, default=0)
    row = state.settings.get("point", 0)
    if not isinstance(row, int) or not 0 <= row < len(points):
        row = 0
    budget = result.budget(row)
    figures = [
        KeyFigure("position", tuple(points.positions[row].tolist()), "mm", decimals(4)),
        KeyFigure("pretravel", float(points.pretravel[row]) / MICROMETRE, "µm"),
        KeyFigure("u", float(points.standard_uncertainty[row]) / MICROMETRE, "µm"),
    ]
    if points.deviation is not None:
        deviation = float(points.deviation[row]) / MICROMETRE
        figures.insert(1, KeyFigure("deviation", deviation, "µm", signed_decimals(2)))
    if result.slide is not None:
        slide = float(result.slide[row]) / MICROMETRE
        figures.append(
            KeyFigure("slide", slide, "µm", remark="of the contact, from first contact to trigger")
        )
    key_figures(figures)
    if budget.components:
        table_view(replace(budget_table(budget, title="Budget of this point"), detail=False))
    else:
        note("The map states no uncertainty, so there is no budget.")


def _show_face(state: ScreenState, result: PartResult) -> None:
    """The feature of a face, from the touches on it."""
    index, part = state.settings.get("face"), result.part
    assert part is not None
    assert result.face is not None
    names: dict[Any, str] = {None: "click a face, or a point on it"}
    for touched in np.unique(result.face).tolist():
        face = part.faces[touched]
        words = " ".join(word for word in (f"{face.number}: {face.kind}", face.name) if word)
        names[touched] = f"{words}, {int(np.sum(result.face == touched))} touches"
    choice_field(state, "face", "Face", names, default=None)
    if not isinstance(index, int) or not 0 <= index < len(part.faces):
        return
    try:
        found = measure_face(result, index)
    except PretravelError as error:
        note(str(error))
        return
    document_view(found.document)
    if found.same is not None:
        note(command_line(found.same))


def _features_job(state: ScreenState) -> Job:
    """The measurement of features; it uses the points of the newest compensation."""

    def compute(inputs: Inputs) -> PartFeatures:
        result = WORKS.of(state, COMPENSATION).result
        if result is None:
            raise PretravelError("there are no compensated points yet")
        return measure_part(result, inputs)

    return Job(
        "features",
        compute,
        "Measuring the features",
        settings=(*COMPENSATION.settings, *FEATURE_FORM.stored),  # of its points too
        files=(*COMPENSATION.files, "drawing"),
        needs=("touches",),
        automatic=False,
    )


def _show_features(state: ScreenState, result: PartResult) -> None:
    with ui.element("div").classes("field-grid"):
        described_fields(state, FEATURE_FORM, _USUAL)
    with folded("More settings"):
        described_fields(state, FEATURE_FORM, _MORE)
    file_drop(
        state, "drawing", "Or all features and tolerances of the drawing",
        endings=(".toml", ".qif", ".dmi"),
        hint="A table [[feature]] for each, as for pretravel measure --features; or a plan",
    )  # fmt: skip
    labels = ", ".join(result.compensated.points.labels[:8])
    note(f"Labels of the points: {labels} …")
    job = _features_job(state)
    work = outcome(state, job, lambda result: document_view(result.document), button="Measure")
    kept(work, lambda: _features_to_keep(work))
    live([work.listen], lambda: _command_of_features(work.result), lambda: work.result)


def _features_to_keep(work: Work) -> None:
    def write(path: Path, result: PartFeatures) -> None:
        result.features.write("output", path)

    with ui.element("div").classes("buttons"):
        result_button(work, "features.csv", "features.csv", write)
        page_button(
            work, lambda result: result.document, _command_of,
            name="features.html",
        )  # fmt: skip


def _command_of(result: PartFeatures) -> str:
    return "" if result.same is None else command_line(result.same)


def _command_of_features(result: PartFeatures | None) -> None:
    if result is not None:
        note(_command_of(result))
