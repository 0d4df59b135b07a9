"""The record of the task of a command: as it was typed, its settings and its input files."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.task import Setting, Task, settings_of

if TYPE_CHECKING:
    from pretravel.show import InputFile, StatedSetting, WorkRecord


def input_files(task: Task) -> list[InputFile]:
    """The files that a task reads, with the checksums that they have now.

    Names that are not files (of a catalogue) are left out; a stream cannot be read twice.
    """
    from pretravel.show import input_file

    files = {path.resolve(): path for path in reversed(task.read_files()) if path.is_file()}
    return [input_file(path, _role(task, path)) for path in reversed(files.values())]


def record_of(task: Task, typed: Sequence[str], inputs: Sequence[InputFile]) -> WorkRecord:
    """The record of a task.

    Parameters
    ----------
    task : Task
    typed : sequence of str
        The arguments of its command.
    inputs : sequence of InputFile
    """
    from pretravel.show import record_now

    command = shlex.join(["pretravel", *task.name.split(), *typed])
    return record_now(command, inputs, _settings(task))


def _settings(task: Task) -> Iterator[StatedSetting]:
    """All options and arguments with their values."""
    from pretravel.show import StatedSetting

    for setting in settings_of(type(task)):
        yield StatedSetting(
            setting.option_or_argument,
            _text(setting, getattr(task, setting.name)),
            given=task.stated(setting.name),
            meaning=setting.help.partition(". ")[0].rstrip("."),
        )


def _text(setting: Setting, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(setting.text, value)) if setting.several else setting.text(value)


def _role(task: Task, path: Path) -> str:
    """The option or argument that names a file or its folder; empty where none does."""
    for setting in settings_of(type(task)):
        value = getattr(task, setting.name)
        for one in value if setting.several else (value,):
            names = isinstance(one, str | Path)
            if names and (
                Path(one) in (path, path.parent) or str(one).partition("#")[0] == str(path)
            ):
                return setting.option_or_argument
    return ""
