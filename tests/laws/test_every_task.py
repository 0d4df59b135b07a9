"""Laws of all tasks: a new task or setting is tested once it is described."""

from __future__ import annotations

import math
import shlex
from dataclasses import MISSING
from typing import Any

import pytest

from pretravel.base.errors import PretravelError
from pretravel.cli.app import App
from pretravel.cli.derived import command_of, task_of
from pretravel.task.listed import PLACES, task_named
from pretravel.task.task import Task, by_name, settings_of, unused
from tests.support.task_samples import samples

TASKS = {**{name: task_named(name) for name in PLACES}, App.name: App}
every_task = pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)


def _full(task: type[Task], first: str = "") -> Task:
    """A task with every setting that goes together, stated; one of them before the others."""
    needed = {s.name: samples(s)[-1] for s in settings_of(task) if s.default is MISSING}
    names = [s.name for s in sorted(settings_of(task), key=lambda s: s.name != first)]
    for name in (name for name in names if name not in needed):
        values = {**needed, name: samples(by_name(task)[name])[-1]}
        if not any(unused(task, each, values)[0] for each in values):
            needed = values
    return task(**needed)


@every_task
def test_the_command_line_of_a_task_means_the_task(task: type[Task]) -> None:
    command = command_of(task)
    for first in ("", *_keys(task)):
        full = _full(task, first)
        words = shlex.split(full.command_line())[1 + len(task.name.split()) :]
        context = command.make_context(task.name, words)
        assert task_of(task, context.params) == full


def _keys(task: type[Task]) -> set[str]:
    """Settings that choose a mode."""
    fields = [setting.field for setting in settings_of(task)]
    modes = [mode for field in fields for mode in (*field.only, *field.without)]
    return {mode if isinstance(mode, str) else mode.key for mode in modes}


@every_task
def test_what_is_described(task: type[Task]) -> None:
    """Each setting has a sentence, each number has limits, each default lies within them."""
    assert task.example.startswith(f"pretravel {task.name}")
    assert (task.__doc__ or "").partition("\n")[0].endswith(".")
    for setting in settings_of(task):
        assert setting.help.rstrip().endswith((".", "…", ")")), setting.name
        if setting.kind in (float, int) and setting.parse is None:
            assert all(map(math.isfinite, setting.limits)), setting.name
        if setting.default is not MISSING:
            assert setting.checked(setting.checked(setting.default)) == setting.checked(
                setting.default
            )


@every_task
def test_limits_hold_in_python_too(task: type[Task]) -> None:
    full = _full(task)
    given = {setting.name: getattr(full, setting.name) for setting in settings_of(task)}
    for setting in settings_of(task):
        wrong: list[Any] = []
        if setting.kind in (float, int) and setting.parse is None:
            low, high = setting.limits
            wrong = [low - 1.0 - abs(low), high + 1.0 + abs(high), math.nan, "x", True]
        if setting.choices and setting.parse is None:
            wrong = ["no such word"]
        if setting.default is MISSING:
            wrong.append(None)
        for value in wrong:
            with pytest.raises(PretravelError) as refused:
                task(**{**given, setting.name: value})
            assert refused.value.inputs == (setting.plain_name,)


def test_what_several_tasks_ask_has_one_range() -> None:
    """The uncertainty of the reference, the tip …: by unit and plain name."""
    ranges: dict[tuple[str, str], set[tuple[float, float]]] = {}
    for task in TASKS.values():
        for name, setting in by_name(task).items():
            if setting.kind is float and name in ONE_RANGE:
                ranges.setdefault((name, setting.unit), set()).add(setting.limits)
    assert {name for name, found in ranges.items() if len(found) > 1} == set()
    assert len(ranges) >= len(ONE_RANGE)


ONE_RANGE = ("diameter", "tip_diameter", "u_diameter_um", "sphere_form_um")
