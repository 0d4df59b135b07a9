"""A short run of the driver, and that it notices what it is for."""

from __future__ import annotations

import sys

import pytest

from tests.hard import nonsensical_options
from tests.hard.interrupted_writes import COMMANDS, WritingCommand
from tests.hard.nonsensical_options import MORE, options_of, try_options

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked")
BY_NAME = {command.name: command for command in (*COMMANDS, *MORE)}


@pytest.mark.parametrize(
    "name",
    [
        "pattern",
        "check",
        pytest.param("separation-plan", marks=pytest.mark.slow),
        pytest.param("plan", marks=pytest.mark.slow),
        pytest.param("predict", marks=pytest.mark.slow),
    ],
)
def test_values_that_mean_nothing_are_refused(name: str) -> None:
    result = try_options(BY_NAME[name], trials=8, seed=7)
    assert result.faults == []
    assert sum(result.codes.values()) == 8
    assert set(result.codes) <= {0, 2, 3}


def test_every_command_is_tried() -> None:
    commands = {
        " ".join([*path, name])
        for path, group in (((), nonsensical_options.commands()), (("program",), None))
        for name in (group or nonsensical_options.commands("program"))
    }
    # A server; minutes for each model; a text to edit; a search of thousands of designs; and two
    # that nobody has tried so far.
    untried = {"program", "program axis", "app", "fem", "laboratory", "design", "axis", "drawing"}
    assert commands - {n.split(":")[0] for n in BY_NAME} == untried


def test_an_exception_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("pretravel.cli.derived.check_files", fails)
    assert options_of("pattern")
    result = try_options(WritingCommand("pattern", "iso10360-5 --diameter 25 -o {0}/a.csv", ()), 12)
    assert any("ZeroDivisionError" in fault for fault in result.faults)
