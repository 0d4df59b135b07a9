"""The command that runs: as it was typed, its settings and its input files."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pretravel.show import InputFile, StatedSetting, WorkRecord


@dataclass
class RunningCommand:
    """A command while it runs.

    Attributes
    ----------
    context : Any
        The context of typer.
    typed : tuple of str
        The arguments as they were typed.
    inputs : dict
        Input files by their real path.
    """

    context: Any
    typed: tuple[str, ...]
    inputs: dict[Path, InputFile] = field(default_factory=dict)


_running: ContextVar[RunningCommand | None] = ContextVar("running command", default=None)


@contextmanager
def running(context: Any, typed: Sequence[str]) -> Iterator[None]:
    """Note the command that runs."""
    token = _running.set(RunningCommand(context, tuple(typed)))
    try:
        yield
    finally:
        _running.reset(token)


def note_inputs(paths: Iterable[Path | str | None]) -> None:
    """Note files that the running command reads, with the checksums that they have now.

    Names that are no files (of a catalogue) are left out; a stream cannot be read twice.
    """
    from pretravel.show import input_file

    command = _running.get()
    if command is None:
        return
    for path in (Path(given) for given in paths if given is not None):
        if path.is_file() and path.resolve() not in command.inputs:
            command.inputs[path.resolve()] = input_file(path, _role(command.context, path))


def record_of_command() -> WorkRecord:
    """The record of the running command; without a command, that of the software alone."""
    from pretravel.show import record_now

    command = _running.get()
    if command is None:
        return record_now()
    return record_now(
        shlex.join(["pretravel", *names_of_command(command.context), *command.typed]),
        command.inputs.values(),
        _settings(command.context),
    )


def names_of_command(context: Any) -> list[str]:
    """The names of command and subcommand."""
    names: list[str] = []
    while context.parent is not None:
        names.insert(0, context.info_name)
        context = context.parent
    return names


def _settings(context: Any) -> Iterator[StatedSetting]:
    """All options and arguments with their values."""
    from pretravel.show import StatedSetting

    for parameter in context.command.params:
        if parameter.name not in context.params:  # --help
            continue
        source = context.get_parameter_source(parameter.name)
        yield StatedSetting(
            typed_name(parameter),
            _value_text(context.params[parameter.name]),
            given="DEFAULT" not in source.name,
            meaning=_meaning(parameter),
        )


def _meaning(parameter: Any) -> str:
    """The first sentence of the help."""
    text = getattr(parameter, "help", None) or ""
    sentence: str = text.partition(". ")[0].partition("; ")[0]
    return sentence.rstrip(".")


def typed_name(parameter: Any) -> str:
    """An option as it is typed; an argument as the help shows it."""
    longest: str = max(parameter.opts, key=len)
    if longest.startswith("-"):
        return longest
    return str(parameter.metavar or longest).upper()


def _value_text(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return repr(value).removesuffix(".0")
    if isinstance(value, list | tuple) and type(value).__str__ is object.__str__:
        return ", ".join(map(_value_text, value))
    if isinstance(value, dict):
        return ", ".join(f"{name}={text}" for name, text in value.items())
    return str(value)


def _role(context: Any, path: Path) -> str:
    """The option or argument that names a file or its folder; empty where none does."""
    for parameter in context.command.params:
        value = context.params.get(parameter.name)
        values = value if isinstance(value, list) else [value]
        for one in (one for one in values if isinstance(one, str | Path)):
            if Path(one) in (path, path.parent) or str(one).partition("#")[0] == str(path):
                return typed_name(parameter)
    return ""
