"""Help texts have an example; a missing option is named."""

from __future__ import annotations

from typing import Any

import pytest
import typer

from pretravel.cli import main
from tests.support.commands import run
from tests.support.examples import SPHERE


def test_help_everywhere() -> None:
    for command in ((), ("predict",), ("simulate",), ("qualify",), ("compensate",), ("probes",)):
        text = run(*command, "--help")
        assert "Example:" in text


def test_a_missing_option_is_named() -> None:
    assert "--diameter" in run("qualify", SPHERE, code=2)


def _commands() -> list[tuple[str, ...]]:
    """The words of every command, groups too."""
    top: Any = typer.main.get_command(main.app)
    found: list[tuple[str, ...]] = [()]
    for name, command in top.commands.items():
        found.append((name,))
        found += [(name, inner) for inner in getattr(command, "commands", {})]
    return found


@pytest.mark.parametrize("words", _commands(), ids=" ".join)
def test_h_is_help_everywhere(words: tuple[str, ...]) -> None:
    assert run(*words, "-h") == run(*words, "--help")


def test_help_is_in_groups_with_the_first_path_on_top() -> None:
    top: Any = typer.main.get_command(main.app)
    assert all(command.rich_help_panel in main.GROUPS for command in top.commands.values())
    text = run("--help")
    groups = ("Start", "Qualify", "Measure", "Control", "Predict", "Laboratory", "Files")
    places = [text.index(f"\n{group}:\n") for group in groups]
    assert places == sorted(places)
    first = [text.index(f"\n  {name}  ") for name in ("demo", "qualify", "compensate", "measure")]
    assert first == sorted(first)
    assert first[-1] < text.index("\n  export  ")
