"""Any task, from what a form states to its report and its files; nothing here is a page.

A task that the command line has is on a screen with this, without a line of its own.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.app.components.statements import laboratory_file
from pretravel.app.jobs import without_folder
from pretravel.app.project import Inputs, StoredFile
from pretravel.app.task_form import TaskForm, with_file_names
from pretravel.base import PretravelError, own_files_alone, temporary_folder
from pretravel.task import (
    FOLDER,
    GROUPS,
    PAGES,
    PICTURES,
    LaboratoryReport,
    Reported,
    Result,
    Setting,
    Task,
    by_name,
    settings_of,
    surface_files,
    task_named,
)

if TYPE_CHECKING:
    from pretravel.show import Document

NOT_HERE = {"demo": "it writes a folder of examples; the buttons with example data do the same"}
"""Tasks without a screen, with the reason."""
NAME = "task"
"""The setting of a screen that names its task."""


def tasks_on_screens() -> dict[str, dict[str, type[Task]]]:
    """The tasks by the group of the command line and by their commands."""
    return {
        group: found
        for group, tasks in GROUPS.items()
        if (found := {name: task_named(name) for name in tasks if name not in NOT_HERE})
    }


def form_of(task: type[Task]) -> TaskForm:
    """All settings of a task that name no file.

    >>> form_of(task_named("repeat")).names[:3]
    ('units', 'axis', 'step_um')
    """
    return TaskForm(task, shared=tuple(by_name(task)))


def file_settings(task: type[Task]) -> tuple[Setting, ...]:
    """The settings that name files which are read.

    >>> [setting.name for setting in file_settings(task_named("repeat"))]
    ['log']
    """
    return tuple(setting for setting in settings_of(task) if setting.field.reads)


def outputs_of_run(task: type[Task]) -> tuple[str, ...]:
    """The outputs that a run writes itself where they are asked for.

    >>> outputs_of_run(task_named("verify"))
    ('accept',)
    """
    return tuple(
        setting.name
        for setting in settings_of(task)
        if setting.field.in_run and setting.default is None
    )


def typed_too(setting: Setting) -> bool:
    """Whether what names a file can also be a word, such as a probe of the catalogue."""
    return setting.field.word is not None


def takes_a_face(setting: Setting) -> bool:
    """Whether a face of the file can be chosen, with its number, as in ``part.step#3``."""
    return setting.field.reads is surface_files


def given_file(setting: Setting, files: tuple[Path, ...], typed: str) -> Any:
    """The value of a setting that reads: files of the project, else a word, else nothing.

    Parameters
    ----------
    setting : Setting
    files : tuple of Path
    typed : str
        What the settings of the project state.

    Raises
    ------
    PretravelError
        The project states a path, which could be any of this computer; or a file has a name with
        which the task does not read it.
    """
    if files:
        name, sign, face = typed.rpartition("#")
        if sign and takes_a_face(setting) and name in ("", files[0].name):
            return f"{files[0]}#{face}"
        values = tuple(files if setting.kind is Path else map(str, files))
        reads = setting.field.reads
        if callable(reads) and not setting.several and list(reads(values[0])) != [files[0]]:
            raise PretravelError(
                f"{setting.label}: {files[0].name} cannot be used here: its name does not fit. "
                f"{setting.help}",
                inputs=(setting.name,),
            )
        return values if setting.several else values[0]
    if not typed:
        return None
    if setting.field.word is None or not setting.field.word(typed):
        word = "" if setting.field.word is None else ", or give a word that the help names"
        raise PretravelError(
            f"{setting.label}: the project contains the path '{typed[:80]}', and a project cannot "
            f"use files of this computer: drop the file{word}",
            inputs=(setting.name,),
        )
    return typed


@dataclass(frozen=True, eq=False)
class TaskRun:
    """What a task made.

    Attributes
    ----------
    command : str
        The command that does the same.
    task : Task
        With the names of the files.
    report : Document or None
    page : Document or None
        The report of a page, which can contain more.
    text : str
        Printed as it is.
    template : str
        The form of the page.
    cautions : tuple of str
    files : mapping of str to bytes
        The other outputs, by their names.
    grown : mapping of str to tuple of StoredFile
        Files of the screen to which the run has added, by their settings.
    """

    command: str
    task: Task
    report: Document | None
    page: Document | None
    text: str = ""
    template: str = "page.html"
    cautions: tuple[str, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    grown: Mapping[str, tuple[StoredFile, ...]] = field(default_factory=dict)


def run_task(inputs: Inputs) -> TaskRun:
    """Run the task that the settings name.

    Raises
    ------
    PretravelError
        As the task; a setting that must be stated and is not.
    """
    kind = task_named(inputs.settings[NAME])
    stated: dict[str, Any] = {}
    for setting in file_settings(kind):
        typed = str(inputs.settings.get(setting.name) or "").strip()
        value = given_file(setting, inputs.files.get(setting.name, ()), typed)
        if value is not None:
            stated[setting.name] = value
    stated = {**form_of(kind).given(inputs.settings, stated), **stated}
    _refuse_missing(kind, stated)
    asked = [name for name in outputs_of_run(kind) if inputs.settings.get(name)]
    with own_files_alone(), temporary_folder() as folder:
        growing = {s.name: s.field.grows for s in file_settings(kind) if s.field.grows}
        given = stated.keys() & growing
        stated = {n: folder / f"{n}{growing[n]}" for n in growing} | stated
        if issubclass(kind, LaboratoryReport) and "lab" not in stated:
            stated["lab"] = laboratory_file(inputs.settings, folder)
        names = {
            setting.name: f"{kind.name.replace(' ', '-')}{ending}"
            for setting in settings_of(kind)
            if setting.name in (*kind.needed_outputs(stated), *asked)
            for ending in setting.field.writes[:1]
        }
        stated |= {name: folder / file for name, file in names.items()}
        task = kind(**stated)
        # A screen shows the full report.
        full = replace(task, verbose=True) if isinstance(task, Reported) else task
        result = full.run()
        report = result.document()
        grown = {name: _stored(getattr(task, name)) for name in growing}
        return TaskRun(
            with_file_names(task, **_shown(names)).command_line(),
            with_file_names(task, **_shown(names)),
            report,
            result.page() if report is not None else None,
            _as_named(result.text, inputs, folder),
            result.template,
            tuple(_as_named(words, inputs, folder) for words in result.cautions),
            _written(task, result, folder) | {file.name: file.content for file in grown.values()},
            {name: (grown[name],) for name in given},
        )


def _as_named(words: str, inputs: Inputs, folder: Path) -> str:
    """Words with the user's names of files, not those of temporary folders."""
    own = {path.parent for files in inputs.files.values() for path in files}
    for place in (*own, folder):
        words = without_folder(words, place)
    return words


def _stored(path: Path) -> StoredFile:
    return StoredFile(path.name, path.read_bytes())


def _shown(names: Mapping[str, str]) -> dict[str, Path]:
    return {name: Path(file) for name, file in names.items()}


def _refuse_missing(kind: type[Task], stated: Mapping[str, Any]) -> None:
    for setting in settings_of(kind):
        needed = setting.default is MISSING and not setting.field.writes
        if needed and stated.get(setting.name) in (None, "", ()):
            what = "drop the file" if setting.field.reads else "fill in the field"
            raise PretravelError(
                f"{setting.label} is missing: {what}, then run again", inputs=(setting.name,)
            )


def _written(task: Task, result: Result, folder: Path) -> dict[str, bytes]:
    """The outputs that are neither pictures nor pages; those that there are not, left out."""
    found: dict[str, bytes] = {}
    for setting in settings_of(type(task)):
        endings = task.endings(setting.name) if setting.field.writes else ()
        if not endings or endings == PICTURES:
            continue
        stem = type(task).name.replace(" ", "-") + (
            "" if setting.name == "output" else f"-{setting.name}"
        )
        for ending in endings if endings != FOLDER else ("",):
            is_page = ending in PAGES and not setting.field.in_run  # the page has its own button
            if is_page or (ending == ".json" and setting.field.report_json):
                continue
            path = folder / f"{stem}{ending}"
            try:
                if not (setting.field.in_run and path.exists()):
                    result.write(setting.name, path)
            except (PretravelError, NotImplementedError, ImportError):
                continue
            if path.exists():
                found |= _contents(path)
                break
    return found


def _contents(path: Path) -> dict[str, bytes]:
    if not path.is_dir():
        return {path.name: path.read_bytes()}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(path.rglob("*")):
            archive.write(file, file.relative_to(path))
    return {f"{path.name}.zip": packed.getvalue()}
