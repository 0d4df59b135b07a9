"""Part: touches on a part → before and after, single points, features, points to download."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from pretravel.app import (
    WORKS,
    ScreenState,
    ShownResult,
    StoredFile,
    Work,
    choice_field,
    described_fields,
    document_view,
    empty_state,
    file_drop,
    folded,
    from_project,
    kept,
    key_figures,
    live,
    no_result,
    note,
    outcome,
    page_button,
    plot,
    result_button,
    result_place,
    same_elsewhere,
    screen_places,
    table_view,
    text,
    work_status,
)
from pretravel.base import MICROMETRE
from pretravel.drawing.screen.features import features_depend_on, features_tab, features_verdict
from pretravel.drawing.screen.next_of_part import guide_of_part
from pretravel.drawing.screen.work import (
    ALIGN_FORM,
    COMPENSATION,
    FACE,
    FEATURE_FORM,
    FEATURES,
    PART_FORM,
    PartResult,
    asks_where,
    example_map,
    with_own_scale,
)
from pretravel.drawing.tasks.measure.task import MeasuredFeatures
from pretravel.prediction import catalogue_names
from pretravel.show import KeyFigure, decimals, plotly_figure, signed_decimals
from pretravel.task import budget_table, example_folder

ENDINGS_OF_POINTS = (".csv", ".json", ".nc", ".qif", ".msr")


def show(state: ScreenState) -> None:
    """Build the screen."""
    guide_of_part(state)
    places = screen_places("part")
    with places.inputs:
        _inputs(state)
    with places.status:
        work = work_status(
            state,
            COMPENSATION,
            missing="1. Drop the touches on the part.  2. Drop the map of the probe (from Qualify "
            "a probe), or choose a probe.  3. With the part as a STEP file the contact is computed "
            "on its faces.",
        )
        result_place(WORKS.of(state, FEATURES), features_verdict, says_warnings=False)
    with places.picture:
        result_place(
            work, partial(_pictures, state), says_warnings=False,
            empty=lambda: empty_state("view_in_ar", "The points on the part, before and after"),
        )  # fmt: skip
    with places.tab("Features"):
        result_place(work, lambda _: None, empty=no_result)
        kept(work, lambda: features_tab(state, work), features_depend_on)
    with places.tab("One point"):
        result_place(work, partial(_one_point, state), empty=no_result, says_warnings=False)
    with places.tab("Compensation"):
        result_place(work, lambda result: document_view(replace(result.document, pictures=())),
                     empty=no_result)  # fmt: skip
    with places.tab("Files"):
        kept(work, lambda: _to_keep(work))
        live([work.listen], lambda: _same(work.result), lambda: work.result)


def _inputs(state: ScreenState) -> None:
    file_drop(
        state, "touches", "1. Touches on the part",
        hint="A table (X;Y;Z;I;J;K or x_mm,y_mm,z_mm,nx,ny,nz …) or a log of the control",
    )  # fmt: skip
    file_drop(state, "map", "2. Map of the probe", endings=(".json", ".csv", ".toml"))
    from_project(state, "map", takes_map=True)
    probes = {"": "the map above"} | {name: name for name in catalogue_names()}
    choice_field(state, "probe", "Without a map: a probe of the catalogue", probes, default="")
    file_drop(
        state, "part", "3. The part (if you have it)",
        endings=(".step", ".stp", ".iges", ".igs"),
    )  # fmt: skip
    live(
        [state.listen],
        lambda: _where(state),
        lambda: (state.settings.get("aligned"), bool(state.files["part"]), asks_where(state)),
    )
    _example(state)
    with folded("More settings"):
        described_fields(state, PART_FORM, PART_FORM.names)
    with folded("Settings of the alignment"):
        described_fields(state, ALIGN_FORM, ALIGN_FORM.names)


def _where(state: ScreenState) -> None:
    """Whether the touches are in the frame of the part, or the part is found from them."""
    if not state.files["part"]:
        return

    def answer(words: str, icon: str, *, aligned: bool) -> None:
        def found() -> None:
            state.settings["aligned"] = aligned

        ui.button(words, icon=icon, on_click=found).props("no-caps outline")

    stated = state.settings.get("aligned")
    if stated:
        note("The part may lie anywhere: it is found from the touches.")
    elif stated is None and asks_where(state):
        note("Does the part lie elsewhere than in its file, as on the table of a machine?")
    else:
        note("The touches are used in the frame of the part. Do they lie elsewhere?")
    with ui.element("div").classes("buttons"):
        if not stated:
            answer("Find the part", "my_location", aligned=True)
        if stated or (stated is None and asks_where(state)):
            answer("The touches are in the frame of the part", "filter_center_focus", aligned=False)


_EXAMPLES = {
    "Try it with example data": ("part_touches.csv", "part.step"),
    "Example with two bores to measure": ("bore_touches.csv", ""),
    "Example of a part that lies anywhere": ("bracket_touches.csv", "bracket.step"),
}
"""Touches and part; in two bores the touches have labels, and those on a bracket no normals."""


def _example(state: ScreenState) -> None:
    async def fill(touches: str, part: str) -> None:
        folder = example_folder()
        name, content = await asyncio.to_thread(example_map, folder)
        for setting in ("probe", *FEATURE_FORM.stored):
            state.settings.pop(setting, None)
        state.settings["aligned"] = part == "bracket.step"
        state.files["map"] = (StoredFile(name, content),)
        for purpose, file in (("part", part), ("touches", touches)):
            stored = StoredFile(file, (folder / file).read_bytes()) if file else None
            state.files[purpose] = (stored,) if stored else ()

    with ui.element("div").classes("examples"):
        for words, files in _EXAMPLES.items():
            ui.button(words, icon="school", on_click=partial(fill, *files)).props("no-caps flat")


def _pictures(state: ScreenState, result: PartResult) -> None:
    """Before and after side by side, turned together."""
    with ui.element("div").classes("charts turned-together"):
        _charts(state, result, slice(2))


def _charts(state: ScreenState, result: PartResult, which: slice) -> None:
    picture = result.document.pictures[0]
    for chart in map(with_own_scale, picture.charts[which]):
        _clickable(state, result, plotly_figure(chart), f"{picture.caption}: {chart.title}")


def _one_point(state: ScreenState, result: PartResult) -> None:
    note(
        "Click a point in the picture for its slide and its budget, and a face of the part to "
        "measure it."
        if result.part is not None
        else "Click a point in the picture for its slide and its budget."
    )
    live(
        [state.listen],
        lambda: _show_point(state, result),
        key=lambda: state.settings.get("point"),
    )
    if result.part is not None:
        text("h3", "The face that was clicked")
        live(
            [state.listen],
            lambda: _choose_face(state, result),
            key=lambda: state.settings.get("face"),
        )
        outcome(state, FACE, _show_face)
    with ui.element("div").classes("charts turned-together"):
        _charts(state, result, slice(2, None))


def _to_keep(work: Work[PartResult]) -> None:
    def write(path: Path, result: PartResult) -> None:
        result.write_points(path)

    def write_place(path: Path, result: PartResult) -> None:
        assert result.aligned is not None
        result.aligned.write("output", path)

    with ui.element("div").classes("buttons"):
        if work.result is not None and work.result.aligned is not None:
            result_button(work, "place.json", "place.json", write_place)
        for ending in ENDINGS_OF_POINTS:
            result_button(work, f"points{ending}", f"points{ending}", write)
        page_button(
            work, lambda result: result.document,
            lambda result: "\n".join(task.command_line() for task in result.same),
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
        note("The map has no uncertainty, so there is no budget.")


def _choose_face(state: ScreenState, result: PartResult) -> None:
    """The faces that were touched."""
    part = result.part
    assert part is not None
    assert result.face is not None
    names: dict[Any, str] = {None: "click a face, or a point on it"}
    for touched in np.unique(result.face).tolist():
        face = part.faces[touched]
        words = " ".join(word for word in (f"{face.number}: {face.kind}", face.name) if word)
        names[touched] = f"{words}, {int(np.sum(result.face == touched))} touches"
    choice_field(state, "face", "Face", names, default=None)


def _show_face(found: ShownResult[MeasuredFeatures]) -> None:
    document_view(found.document)
    if found.same is not None:
        note(found.same.command_line())
