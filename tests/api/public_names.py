"""The public names as lines of text: what can be imported from pretravel, commands and options.

``python -m tests.api.public_names`` adds new lines to public_names.txt. It removes none: what
docs/stability.md asks for comes before.
"""

from __future__ import annotations

import dataclasses
import enum
import inspect
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, TypeGuard

import click
import typer.main

import pretravel
from pretravel.cli.main import app

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

FILE = Path(__file__).with_name("public_names.txt")


def current_lines(package: ModuleType = pretravel) -> list[str]:
    """A line for each name, method, property, command and option; sorted."""
    lines = set(_command_lines("pretravel", typer.main.get_command(app)))
    for name in package.__all__:
        lines |= set(_lines_of(name, getattr(package, name)))
    return sorted(lines)


def recorded_lines(text: str) -> list[str]:
    """The lines of public_names.txt without its comments."""
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def _lines_of(name: str, value: object) -> Iterator[str]:
    if isinstance(value, type):
        if issubclass(value, enum.Enum):
            yield name
            yield from (f"{name}.{member}" for member in value.__members__)
            return
        if _is_result(value):
            yield name
            yield from (f"{name}.{field.name}" for field in dataclasses.fields(value))
        else:
            yield name + _signature(value)
        for member in sorted(set(_own_members(value))):
            found = inspect.getattr_static(value, member)
            called = inspect.isfunction(found) or isinstance(found, staticmethod | classmethod)
            yield f"{name}.{member}" + (_signature(getattr(value, member)) if called else "")
    elif callable(value):
        yield name + _signature(value)
    else:
        yield name


def _is_result(kind: type) -> TypeGuard[type[DataclassInstance]]:
    """Whether users read its fields and do not make it: it has attributes, not parameters."""
    documented = (kind.__doc__ or "").partition("Parameters\n")[1]
    return dataclasses.is_dataclass(kind) and not documented


def _own_members(kind: type) -> Iterator[str]:
    """Public methods and properties that this package defines; fields are in the signature."""
    for each in kind.__mro__:
        if each.__module__.partition(".")[0] == "pretravel":
            yield from (
                name
                for name, value in vars(each).items()
                if not name.startswith("_")
                and (
                    inspect.isroutine(value)
                    or isinstance(value, property | staticmethod | classmethod)
                    or hasattr(value, "func")  # cached_property
                )
            )


def _signature(value: object) -> str:
    """Parameters without types; ``=`` after those that can be left out."""
    assert callable(value)
    words = []
    for parameter in inspect.signature(value).parameters.values():
        if parameter.name == "self":
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in words:
            words.append("*")
        star = {parameter.VAR_POSITIONAL: "*", parameter.VAR_KEYWORD: "**"}.get(parameter.kind, "")
        optional = "=" if parameter.default is not parameter.empty else ""
        words.append(f"{star}{parameter.name}{optional}")
    return f"({', '.join(words)})"


def _command_lines(path: str, command: click.Command) -> Iterator[str]:
    for parameter in command.params:
        for option in (*parameter.opts, *parameter.secondary_opts):
            if option.startswith("--"):
                yield f"{path} {option}"
        if isinstance(parameter, click.Argument):
            yield f"{path} {(parameter.name or '').upper()}"
    yield path
    for name, each in getattr(command, "commands", {}).items():
        yield from _command_lines(f"{path} {name}", each)


@dataclass(frozen=True)
class _Parameters:
    positional: tuple[str, ...]
    keywords: frozenset[str]
    required: frozenset[str]


def _split(line: str) -> tuple[str, _Parameters | None]:
    """Name and parameters of a line."""
    match = re.fullmatch(r"([\w.]+)\((.*)\)", line)
    if match is None:
        return line, None
    words = match[2].split(", ") if match[2] else []
    star = words.index("*") if "*" in words else len(words)
    plain = [word for word in words if not word.startswith("*")]
    names = [word.rstrip("=") for word in plain]
    positional = tuple(word.rstrip("=") for word in words[:star] if not word.startswith("*"))
    required = frozenset(word for word in plain if not word.endswith("="))
    return match[1], _Parameters(positional, frozenset(names), required)


def breaks(recorded: Iterable[str], current: Iterable[str]) -> list[str]:
    """What a program that uses the recorded names would notice, a sentence each.

    >>> breaks(["f(a, b=)"], ["f(a, b=, c=)"])
    []
    >>> breaks(["f(a, b=)", "g"], ["f(a, b)"])
    ['f: b must now be given', 'g is gone']
    """
    now = dict(_split(line) for line in current)
    found = []
    for line in recorded:
        name, before = _split(line)
        if name not in now:
            found.append(f"{name} is gone")
            continue
        after = now[name]
        if before is None or after is None:
            if (before is None) != (after is None):
                found.append(f"{name} can no longer be used as it was")
            continue
        gone = before.keywords - after.keywords
        found += [f"{name}: the parameter {each} is gone" for each in sorted(gone)]
        must = after.required - before.required
        found += [f"{name}: {each} must now be given" for each in sorted(must)]
        if not gone and after.positional[: len(before.positional)] != before.positional:
            found.append(f"{name}: the order of its parameters has changed")
    return found


def write() -> None:
    """Add the lines that are new; a line whose parameters grew is replaced."""
    text = FILE.read_text("utf-8") if FILE.exists() else ""
    head = [line for line in text.splitlines() if line.startswith("#")]
    recorded, current = recorded_lines(text), current_lines()
    names = {_split(line)[0] for line in current}
    kept = [line for line in recorded if _split(line)[0] not in names]
    broken = breaks(recorded, current)
    if broken:
        raise SystemExit("docs/stability.md comes first: " + "; ".join(broken))
    FILE.write_text("\n".join([*head, *sorted({*kept, *current})]) + "\n", "utf-8")


if __name__ == "__main__":
    write()
