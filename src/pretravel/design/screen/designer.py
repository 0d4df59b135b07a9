"""Design a probe: its description as a form, two designs over all directions, finite elements."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

from nicegui import ui

from pretravel.app import (
    WORKS,
    ColouredPlot,
    ScreenState,
    StoredFile,
    Work,
    bare_slider,
    choice_field,
    error_view,
    file_drop,
    folded,
    folded_until_opened,
    here,
    live,
    note,
    number_field,
    panel,
    plot,
    result_button,
    screen_places,
    table_view,
    text,
    text_field,
    verdict_card,
    without_folder,
)
from pretravel.base import PretravelError, temporary_folder
from pretravel.design.screen.description import (
    description_button,
    is_saved,
    same_of_design,
)
from pretravel.design.screen.elements import elements_view, one_at_a_time
from pretravel.design.screen.form import (
    DesignField,
    FieldGroup,
    form_groups,
    setting_names,
    start_values,
)
from pretravel.design.screen.slide import slide_panel
from pretravel.design.screen.work import (
    DESIGN_FILE,
    DESIGNS,
    FINITE_ELEMENTS,
    FIRST_START,
    THE_START,
    ComparedDesigns,
    FiniteElementDesigns,
    digest_of,
    probe_figure,
    start_text,
)
from pretravel.show import InputFile, input_file, record_now
from pretravel.task import Task, task_named

_Designs: TypeAlias = Work[ComparedDesigns]
_FIXED_WORDS = {
    "first_contact": "first contact: one seat loses its force",
    "arm_lift": "arm lift: both seats of a rod lose their force",
    "piezo_stage": "piezo stage: the force on the tip is the threshold",
    "hertz": "elastic (Hertz): rod and ball deform",
    "rigid": "rigid: rod and ball do not deform",
}


_PICTURES = {
    "probe": "The probe in space",
    "pretravel": "Pretravel around, both designs",
    "force": "Trigger force around, both designs",
    "parts": "Contributions to the pretravel, both designs",
}


def show(state: ScreenState) -> None:
    """Build the screen."""
    work = WORKS.of(state, DESIGNS)
    places = screen_places("designer")
    with places.inputs:
        _start_panel(state)
        live([state.listen], lambda: _form(state, work), lambda: _start_of(state))
        with ui.element("div").classes("design-strip"):  # where the pictures are out of sight
            live([work.listen], lambda: _strip(work), lambda: id(work.result))
    with places.status:
        live([work.listen], lambda: _show_error(state, work), lambda: work.error)
    with places.answer, _pale_with_error(work):
        live([work.listen], lambda: _verdict(work), lambda: id(work.result))
    plots: dict[str, ColouredPlot] = {}
    with places.picture, _pale_with_error(work), ui.element("div").classes("charts"):
        plots |= _empty_plots("probe", "pretravel")
    with places.tab("Comparison"), _pale_with_error(work):
        _comparison(state, work)
    with places.tab("Force and parts"), _pale_with_error(work), ui.element("div").classes("charts"):
        plots |= _empty_plots("force", "parts")
    with places.tab("Finite elements"):
        elements_view(state)
    with places.tab("Step by step"):
        folded_until_opened("How the tip slides until the trigger", lambda: slide_panel(state))
    with places.tab("Files"):
        _downloads(state, work)
    _follow_work(state, work, plots)


@contextmanager
def _pale_with_error(work: _Designs) -> Iterator[None]:
    """A place that shows the last design that was possible."""
    with ui.element("div").classes("live") as place:
        yield

    def grey() -> None:
        place.classes(add="stale" if work.error else "", remove="" if work.error else "stale")

    grey()
    here([work.listen], grey)


def _empty_plots(*names: str) -> dict[str, ColouredPlot]:
    return {name: plot({"data": [], "layout": {}}, _PICTURES[name]) for name in names}


def _catalogue() -> dict[str, str]:
    from pretravel.prediction import catalogue_names, load_probe

    return {name: load_probe(name).name for name in catalogue_names()}


def _start_of(state: ScreenState) -> tuple[str, tuple[StoredFile, ...]]:
    return state.settings.get("start", FIRST_START), state.files["description"]


@lru_cache(maxsize=8)
def _text_of_start(name: str, files: tuple[StoredFile, ...]) -> str:
    """The description of the start.

    Raises
    ------
    PretravelError
        A file that is not a description.
    """
    if not files:
        return start_text(name, None)
    with temporary_folder() as folder:
        path = Path(folder / files[0].name)
        path.write_bytes(files[0].content)
        try:
            return start_text(name, path)
        except PretravelError as error:
            raise PretravelError(without_folder(str(error), folder)) from error


def _start_panel(state: ScreenState) -> None:
    with panel("1. Start from a probe"):
        choice = choice_field(
            state, "start", "Probe of the catalogue", _catalogue(), default=FIRST_START
        )
        file_drop(
            state,
            "description",
            "Or your own description",
            endings=(".toml",),
            limit=1_000_000,
            hint="Drop or choose a description (.toml), as the tab Files gives it",
        )

        def follow_file() -> None:
            choice.set_enabled(not state.files["description"])

        follow_file()
        here([state.listen], follow_file)


def _form(state: ScreenState, work: _Designs) -> None:
    """The fields of the start; a new start has a new form."""
    try:
        start = _text_of_start(*_start_of(state))
    except PretravelError as error:
        error_view(str(error))
        return
    if state.settings.get("form_of") != digest_of(start):
        _take_back(state)
        state.settings["form_of"] = digest_of(start)
    defaults = start_values(start)
    with panel("2. Change it"):
        for group in form_groups(start):
            _group(state, work, group, defaults)
        ui.button("Back to the start", icon="undo", on_click=lambda: _take_back(state)).props(
            "no-caps flat"
        )


def _take_back(state: ScreenState) -> None:
    for name in setting_names():
        state.settings.pop(name, None)


def _group(
    state: ScreenState, work: _Designs, group: FieldGroup, defaults: Mapping[str, float | str]
) -> None:
    if group.opened:
        text("h3", group.heading)
        if group.remark:
            note(group.remark)
        for field in group.fields:
            _field(state, work, field, defaults[field.name])
        return
    with folded(group.heading):
        for field in group.fields:
            _field(state, work, field, defaults[field.name])


def _field(state: ScreenState, work: _Designs, field: DesignField, default: float | str) -> None:
    if isinstance(default, str):
        choice_field(state, field.name, field.label, _words(field), default=default)
    else:
        with ui.element("div").classes("slider-field"):
            # The library says what a probe can be; the slider has the usual values.
            number_field(state, field.name, field.label, unit=field.unit, default=default)
            bare_slider(
                state, field.name, field.label, limits=field.ends, step=field.step, default=default
            )

    def problem() -> str:
        return work.error if field.name in work.error_inputs else ""

    def show_problem() -> None:
        if problem():
            text("p", problem(), "field-problem").props('role="alert"')

    live([work.listen], show_problem, problem)


def _words(field: DesignField) -> dict[str, str]:
    from pretravel.prediction import known_materials

    known = known_materials()
    return {
        choice: f"{choice} (E = {known[choice].youngs_modulus / 1e3:g} GPa)"
        if choice in known
        else _FIXED_WORDS.get(choice, choice)
        for choice in field.choices
    }


def _show_error(state: ScreenState, work: _Designs) -> None:
    with suppress(PretravelError):  # a description that cannot be read: `_form` says so
        _text_of_start(*_start_of(state))
        if not work.error:
            return
        error_view(work.error)
        if work.result is not None:
            note("The pictures show the last design that was possible.")


def _comparison(state: ScreenState, work: _Designs) -> None:
    with ui.element("div").classes("field-row"):
        choice_field(
            state,
            "against",
            "Compare with (A)",
            {THE_START: "the start, unchanged", **_catalogue()},
            default=THE_START,
        )
        choice_field(
            state,
            "polar",
            "Polar angle of the surface",
            {float(angle): _polar_words(angle) for angle in range(0, 91, 5)},
            default=90.0,
        )
    live([work.listen], lambda: _tables(work), lambda: id(work.result))


def _follow_work(state: ScreenState, work: _Designs, plots: Mapping[str, ColouredPlot]) -> None:
    """Change the pictures in place with each design."""
    last: list[Any] = []

    def redraw() -> None:
        now = _shown(state, work)
        if work.result is None or now == last:
            return
        last[:] = now
        for name, figure in _figures(state, work).items():
            plots[name].update_figure(figure)

    _draw_probe(work, plots["probe"])
    redraw()
    here([work.listen, WORKS.of(state, FINITE_ELEMENTS).listen, state.listen], redraw)


def _draw_probe(work: _Designs, picture: ColouredPlot) -> None:
    """The probe in space, when a slider rests: it takes longer than the other pictures."""
    drawn: list[Any] = [None]

    async def draw() -> None:
        await asyncio.sleep(0.1)
        result: ComparedDesigns | None = work.result
        if result is None or result.design.probe == drawn[0]:
            return
        drawn[0] = result.design.probe
        figure = await asyncio.to_thread(probe_figure, drawn[0])
        if not picture.is_deleted:
            picture.update_figure(figure)

    request = one_at_a_time(draw)
    request()
    here([work.listen], lambda: None if work.running else request())


def _polar_words(angle: int) -> str:
    return {90: "90° (vertical wall)", 0: "0° (floor)"}.get(angle, f"{angle}°")


def _shown(state: ScreenState, work: _Designs) -> list[Any]:
    """What the pictures depend on."""
    elements = WORKS.of(state, FINITE_ELEMENTS)
    return [
        id(work.result),
        state.settings.get("polar", 90.0),
        id(elements.result),
        elements.stale,
    ]


def _figures(state: ScreenState, work: _Designs) -> dict[str, Any]:
    from pretravel.design.screen.pictures import design_figures

    result: ComparedDesigns = work.result
    elements = WORKS.of(state, FINITE_ELEMENTS)
    models: FiniteElementDesigns | None = None if elements.stale else elements.result
    polar = float(state.settings.get("polar", 90.0))
    against = state.settings.get("against", THE_START)
    other = "A: the start" if against == THE_START else "A: compared with"
    predicted = (models.other.predicted, models.design.predicted) if models else None
    return dict(design_figures((other, result.other), result.design, predicted, polar))


def _strip(work: _Designs) -> None:
    from pretravel.design.screen.pictures import change_in_words

    if work.result is not None:
        for line in change_in_words(work.result.other, work.result.design):
            text("p", line)


def _verdict(work: _Designs) -> None:
    result: ComparedDesigns | None = work.result
    if result is None:
        note("Predicting …")
    elif result.changes or result.other.probe != result.design.probe:
        verdict_card(result.document().verdict)
    else:
        note("B is still equal to the start: move a slider to change B.")


def _tables(work: _Designs) -> None:
    result: ComparedDesigns | None = work.result
    if result is None:
        return
    document = result.document()
    for table in document.tables:
        table_view(table)
    for remark in document.notes:
        note(remark)


def _downloads(state: ScreenState, work: _Designs) -> None:
    text_field(state, "name", "Name of the design", hint="Empty: the name of the start, changed")
    with ui.element("div").classes("button-row"):
        description_button(state, work)
        for ending in ("nc", "csv"):
            result_button(work, f"Map (.{ending})", f"design-map.{ending}", _write_map)
        result_button(
            work,
            "Page (.html)",
            "design.html",
            lambda path, result: _write_page(path, result, _has_file(state, result)),
        )

    def of_files() -> object:
        result: ComparedDesigns | None = work.result
        return result and (result.other_name, result.source, _has_file(state, result))

    live([work.listen, state.listen], lambda: _same(state, work.result), of_files)


def _has_file(state: ScreenState, result: ComparedDesigns) -> bool:
    return is_saved(state, digest_of(result.text()))


def _same(state: ScreenState, result: ComparedDesigns | None) -> None:
    from pretravel.design.tasks.predict.task import Predict

    if result is not None:
        predict = Predict(probe=result.source, output=Path("design-map.csv"))
        same_of_design(state, result.source, digest_of(result.text()), _comparing(result), predict)


def _comparing(result: ComparedDesigns) -> Task:
    compare: Callable[..., Task] = task_named("compare")
    return compare(map_file=result.other_name, other=result.source, output=Path("design.html"))


def _write_map(path: Path, result: ComparedDesigns) -> None:
    result.design.write("output", path)


def _write_page(path: Path, result: ComparedDesigns, saved: bool) -> None:
    """The command and the file are stated where they are: a design can be without a file."""
    from pretravel.show import write_page

    there = saved or result.source != DESIGN_FILE
    command = _comparing(result).command_line() if there else ""
    write_page(path, result.document(), record=record_now(command, _read_by_page(result, there)))


def _read_by_page(result: ComparedDesigns, there: bool) -> list[InputFile]:
    """The description with its checksum; a probe of the catalogue is no file."""
    if not result.source.endswith(".toml"):
        return []
    with temporary_folder() as folder:
        description = folder / DESIGN_FILE
        description.write_text(result.text(), encoding="utf-8")
        name = result.source if there else "the design, not saved as a file"
        return [replace(input_file(description, "PROBE"), name=name)]
