"""Help texts have an example; a missing option is named."""

from __future__ import annotations

import re
from typing import Any

import pytest
import typer

from pretravel.cli import main
from pretravel.task.listed import PLACES, task_named
from pretravel.task.task import settings_of
from tests.support.commands import both_outputs, run
from tests.support.examples import SPHERE


def test_help_everywhere() -> None:
    for command in ((), ("predict",), ("simulate",), ("qualify",), ("compensate",), ("probes",)):
        text = run(*command, "--help")
        assert "Example:" in text


def test_a_missing_option_is_named() -> None:
    assert "--diameter" in run("qualify", SPHERE, code=2)


def test_an_unknown_option_has_options_that_are_alike_or_the_commands_that_have_it() -> None:
    assert "Possible options: --diameter" in run("qualify", SPHERE, "--diamter", 25, code=2)
    told = run("qualify", SPHERE, "--map", "map.json", code=2)
    assert "No such option: --map. It is an option of" in told
    assert "compensate" in told
    assert "Possible" not in told
    assert "It is" not in run("qualify", SPHERE, "--nothing-of-this-kind", code=2)


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
    text = run("--help")
    groups = ("Every day", "Qualify", "Measure", "Control", "Predict", "Laboratory", "Files")
    places = [text.index(f"\n{group}:\n") for group in groups]
    assert places == sorted(places)
    first = [text.index(f"\n  {name}  ") for name in ("demo", "qualify", "compensate", "measure")]
    assert first == sorted(first)
    assert first[-1] < text.index("\n  plan-touches  ")


def test_every_command_is_in_the_help_once() -> None:
    top: Any = typer.main.get_command(main.app)
    lines = run("--help").splitlines()
    for name in top.commands:
        assert sum(line.startswith(f"  {name}  ") for line in lines) == 1, name


def test_without_words_the_help_is_shown() -> None:
    # nothing was done, which a script must notice
    shown, errors = both_outputs(code=2)
    assert shown.index("\n  demo  ") < shown.index("\n  history  ")
    assert "plan-touches" not in shown
    assert shown.endswith("more: pretravel --help\n")
    assert not errors
    assert "sphere" in "".join(both_outputs("program", code=2))


@pytest.mark.parametrize("words", _commands(), ids=" ".join)
def test_what_is_written_is_what_is_shown(
    words: tuple[str, ...],
) -> None:
    """Each text of a description is in the whole help, letter by letter, brackets too."""
    name = " ".join(words)
    if name not in PLACES:  # the list of commands; a group
        return
    task = task_named(name)
    shown = _unbroken(run(*words, "--help-all"))
    written = [task.example, (task.__doc__ or "").partition("\n\nAttributes\n")[0]]
    written += [setting.help for setting in settings_of(task)]
    for text in written:
        for part in text.split("\n\n"):
            assert _unbroken(part) in shown


@pytest.mark.parametrize("words", _commands(), ids=" ".join)
def test_the_short_help_fits_on_a_page(words: tuple[str, ...]) -> None:
    """It is 80 lines at most, without words of Python, and names every option."""
    name = " ".join(words)
    lines = run(*words, "--help").splitlines()
    assert len(lines) <= 80
    assert not re.search(r"<(int|float|str|path|list)", "\n".join(lines))
    if name not in PLACES:
        return
    shown = _unbroken("\n".join(lines))
    for setting in settings_of(task_named(name)):
        assert setting.field.positional or setting.option.split("/")[0] in shown


def _unbroken(text: str) -> str:
    """A text without blanks, where lines are broken between words, in long ones and at hyphens."""
    return "".join(text.split())
