"""Daily check: today's touches in; has the probe changed, all days, and when to qualify again."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui

from pretravel.app import (
    ScreenState,
    StoredFile,
    Work,
    described_fields,
    document_screen,
    file_drop,
    folded,
    follow_map,
    from_project,
    kept,
    live,
    note,
    page_button,
    panel,
    result_button,
    same_elsewhere,
    screen_places,
    take_reference,
    task_links,
    work_status,
)
from pretravel.tasks.verify.screen_work import (
    DAILY,
    DAILY_FORM,
    HISTORY,
    DailyResult,
    without_last_day,
)

_FIRST = ("diameter", "ring")
_OTHER_WAYS = {
    "plan-touches": "Which five touches show most of a change of this probe",
    "verify": "The same without a history, or with a new map of the new touches",
    "history": "A folder of touches, one file a day, without a project",
}


def show(state: ScreenState) -> None:
    """Build the screen."""
    places = screen_places()
    with places.inputs:
        with panel("Today"):
            file_drop(
                state, "touches", "Today's touches on the reference", several=True,
                hint="Five touches are enough, all are better. Files dropped together are one day.",
            )  # fmt: skip
        with panel("Map and reference"):
            follow_map(state, "map")
            file_drop(state, "map", "Map of the probe", endings=(".json",))
            from_project(state, "map", takes_map=True)
            take_reference(state)
            described_fields(state, DAILY_FORM, _FIRST)
            with folded("More settings"):
                described_fields(
                    state, DAILY_FORM, [n for n in DAILY_FORM.names if n not in _FIRST]
                )
        with folded("History of the probe"):
            _history(state)
        with folded("Other ways"):
            task_links(_OTHER_WAYS)
    with places.status:
        work = work_status(
            state, DAILY,
            missing="Drop today's touches. The map is that of “Qualify a probe” in this project, "
            "or a file.",
        )  # fmt: skip
    document_screen(
        places, work, lambda result: result.document, empty="All days, with today's touches"
    )
    with places.tab("Files"):
        kept(work, lambda: _to_keep(work))
        live([work.listen], lambda: _same(work.result), lambda: work.result)


def _history(state: ScreenState) -> None:
    """Where the days are kept, with the ways to begin again and to take a day out."""
    note(
        "Each day is a line of the history, which the project keeps. A history file of the command "
        "verify can be continued here, and the file of this history by the command."
    )
    file_drop(state, "history", "Go on with a history", endings=(".jsonl",))

    def build() -> None:
        stored = state.files["history"]
        if not stored:
            return
        with ui.element("div").classes("button-row"):
            _removing("Remove the last day", _shorter(stored[0]), state)
            _removing("Begin a new history", (), state)

    live([state.listen], build, lambda: state.files["history"])


def _shorter(file: StoredFile) -> tuple[StoredFile, ...]:
    rest = without_last_day(file.content)
    return (StoredFile(file.name, rest),) if rest.strip() else ()


def _removing(words: str, rest: tuple[StoredFile, ...], state: ScreenState) -> None:
    """A button that leaves a part of the history; today's touches, which made the line, go too."""

    def remove() -> None:
        state.files["touches"] = ()
        state.files["history"] = rest

    ui.button(words, on_click=remove).props("no-caps outline")


def _to_keep(work: Work[DailyResult]) -> None:
    def write(path: Path, result: DailyResult) -> None:
        path.write_bytes(result.history)

    with ui.element("div").classes("buttons"):
        result_button(work, HISTORY, HISTORY, write)
        page_button(
            work, lambda result: result.document, lambda result: result.same.command_line(),
            name="daily-check.html",
        )  # fmt: skip


def _same(result: DailyResult | None) -> None:
    if result is not None:
        same_elsewhere(result.same)
