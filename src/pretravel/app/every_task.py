"""Every task of the command line on a screen, made from its description alone."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import MISSING, dataclass
from functools import partial

from nicegui import ui

from pretravel.app.components.document_view import (
    document_answer,
    document_details,
    document_picture,
    no_result,
)
from pretravel.app.components.downloads import download_button
from pretravel.app.components.fields import switch_field, text_field
from pretravel.app.components.file_drop import file_drop
from pretravel.app.components.from_project import from_project, take_reference
from pretravel.app.components.layout import (
    empty_state,
    folded,
    live,
    note,
    panel,
    printed,
    screen_places,
    text,
    warning,
)
from pretravel.app.components.outcome import kept, result_place, work_status
from pretravel.app.components.page_button import CERTIFICATES, page_button
from pretravel.app.components.same_elsewhere import same_elsewhere
from pretravel.app.components.statements import statements_form
from pretravel.app.components.task_fields import described_field
from pretravel.app.jobs import Job, Work
from pretravel.app.links import OF_TASK
from pretravel.app.page_words import page_words, title_of
from pretravel.app.project import OF_ALL_SCREENS, ScreenState
from pretravel.app.screens import Screen
from pretravel.app.session import address_in
from pretravel.app.task_run import (
    NAME,
    TaskRun,
    file_settings,
    form_of,
    outputs_of_run,
    run_task,
    takes_a_face,
    tasks_on_screens,
    typed_too,
)
from pretravel.task import REPORT_VALUES, LaboratoryReport, Setting, Task, by_name, task_named

_SHOWN_AT_FIRST = 8
"""Fields that are not folded."""
_TABLE_OF_TOML = re.compile(r"^#? ?\[[a-z]", re.MULTILINE)
_MAPS = ("map", "map_file", "prior")


@dataclass(frozen=True)
class TaskScreen(Screen):
    """The screen of a task."""

    task: str = ""

    def show(self, state: ScreenState) -> None:
        """Build it."""
        show(self.task, state)


def address_of(name: str) -> str:
    """Of the screen of a task."""
    return f"/task/{name.replace(' ', '-')}"


def screen_of_task(word: str) -> TaskScreen | None:
    """The screen of a task by the end of its address; None where there is none."""
    for tasks in tasks_on_screens().values():
        for name, kind in tasks.items():
            if name.replace(" ", "-") == word:
                title = title_of(name)
                return TaskScreen(
                    f"task-{word}", title, title, summary_of(kind), "terminal", task=name
                )
    return None


def summary_of(kind: type[Task]) -> str:
    """The first sentences of the description.

    >>> summary_of(task_named("verify"))
    'Test whether a probe has changed since its qualification.'
    """
    first = (inspect.getdoc(kind) or "").partition("\n\n")[0]
    return page_words(kind, " ".join(first.split()))


def job_of(name: str) -> Job[TaskRun]:
    """The work of the screen of a task."""
    kind = task_named(name)
    files = tuple(setting.name for setting in file_settings(kind))
    return Job(
        "run",
        run_task,
        title_of(name),
        settings=(NAME, *form_of(kind).stored, *files, *outputs_of_run(kind), *_shared(kind)),
        files=files,
        automatic=False,
        own_process=True,
        report=lambda made: made.report,
        keeps=lambda made: made.grown,
        gives=lambda made: made.files,
    )


def job_of_screen_of_task(screen: str) -> Job[TaskRun] | None:
    """The work of the screen of a task by the name of the screen; None where there is none."""
    found = screen_of_task(screen.removeprefix(OF_TASK))
    return None if found is None else job_of(found.task)


def _shared(kind: type[Task]) -> tuple[str, ...]:
    """What a task takes of what all screens have in common."""
    return OF_ALL_SCREENS if issubclass(kind, LaboratoryReport) else ()


def show(name: str, state: ScreenState) -> None:
    """Build the screen of a task."""
    kind = task_named(name)
    if state.settings.get(NAME) != name:
        state.settings[NAME] = name
    places = screen_places()
    with places.inputs:
        if "diameter" in by_name(kind):
            take_reference(state)
        files = [s for s in file_settings(kind) if s.name != "lab" or state.files[s.name]]
        needed = [setting for setting in files if setting.default is MISSING] or files[:1]
        for setting in needed:
            _file(kind, state, setting)
        others = [setting for setting in files if setting not in needed]
        if others:
            given = any(state.files[setting.name] for setting in others)
            with folded("More files", opened=given):
                for setting in others:
                    _file(kind, state, setting)
        _fields(kind, state)
        if _shared(kind):
            statements_form(state)
    with places.status:
        work = work_status(state, job_of(name), button="Run")
    with places.answer:
        result_place(work, _answer)
    with places.picture:
        result_place(
            work, _picture, says_warnings=False,
            empty=lambda: empty_state("terminal", "Fill in what it needs, then press Run."),
        )  # fmt: skip
    with places.tab("Details"):
        result_place(work, _details, empty=no_result, says_warnings=False)
    with places.tab("Files"):
        kept(work, lambda: _to_keep(work), lambda made: (*made.files, _states_laboratory(made)))
        live([work.listen], lambda: _same(work.result), lambda: work.result)


def _file(kind: type[Task], state: ScreenState, setting: Setting) -> None:
    hint = page_words(kind, setting.help)
    file_drop(state, setting.name, setting.label, several=setting.several, hint=hint)
    from_project(state, setting.name, takes_map=setting.name in _MAPS)
    if typed_too(setting):
        text_field(
            state,
            setting.name,
            f"{setting.label}, as a word" + (", or #3: a face" if takes_a_face(setting) else ""),
        )


def _fields(kind: type[Task], state: ScreenState) -> None:
    form = form_of(kind)
    names = [name for name in form.names if name != "verbose"]
    if not (names or outputs_of_run(kind)):
        return
    with panel("Settings"):
        for name in names[:_SHOWN_AT_FIRST]:
            described_field(state, form, name)
        for name in outputs_of_run(kind):
            setting = by_name(kind)[name]
            switch_field(state, name, setting.label)
            note(page_words(kind, setting.help))
    if len(names) > _SHOWN_AT_FIRST:
        with folded("More settings"):
            for name in names[_SHOWN_AT_FIRST:]:
                described_field(state, form, name)


def _picture(made: TaskRun) -> None:
    if made.report is not None and made.report.pictures:
        document_picture(made.report)


def _answer(made: TaskRun) -> None:
    for caution in made.cautions:
        warning(page_words(type(made.task), caution))
    if made.report is not None:
        document_answer(made.report)


def _details(made: TaskRun) -> None:
    if made.text:
        printed(made.text if _is_file(made.text) else page_words(type(made.task), made.text))
    if made.report is not None:
        document_details(made.report)


def _is_file(printed_text: str) -> bool:
    """Whether what a command prints is a file (TOML): it is shown as it is, and can be taken."""
    return _TABLE_OF_TOML.search(printed_text) is not None


def _same(made: TaskRun | None) -> None:
    if made is not None:
        same_elsewhere(made.task)


def _states_laboratory(made: TaskRun) -> bool:
    return isinstance(made.task, LaboratoryReport) and made.task.lab is not None


def _to_keep(work: Work[TaskRun]) -> None:
    made: TaskRun = work.result
    with ui.element("div").classes("buttons"):
        if made.page is not None:
            page_button(work, lambda result: result.page, lambda result: result.command)
            page_button(
                work, lambda result: result.page, lambda result: result.command,
                name=f"{type(made.task).name.replace(' ', '-')}{REPORT_VALUES}",
                label="Values (JSON)",
            )  # fmt: skip
            if _states_laboratory(made):
                page_button(
                    work, lambda result: result.page, lambda result: result.command,
                    name="certificate.pdf", label=CERTIFICATES["certificate.pdf"],
                    template=made.template,
                )  # fmt: skip
        for name in made.files:
            download_button(name, name, partial(_write, work, name))
        if _is_file(made.text) and not made.files:
            name = f"{type(made.task).name}.toml"
            download_button(name, name, lambda path: path.write_text(work.result.text, "utf-8"))


def _write(work: Work[TaskRun], name: str, path: object) -> None:
    path.write_bytes(work.result.files[name])  # type: ignore[attr-defined]


def tasks_page() -> None:
    """All tasks, in the groups of the command line."""
    for group, tasks in tasks_on_screens().items():
        with panel(group):
            task_links({name: summary_of(kind) for name, kind in tasks.items()})


def task_links(words: Mapping[str, str]) -> None:
    """A list of screens of tasks: the name of each, and what it is for."""
    with ui.element("ul").classes("task-list"):
        for name, summary in words.items():
            with ui.element("li"):
                text("a", title_of(name)).props["href"] = address_in(address_of(name))
                text("span", summary)
