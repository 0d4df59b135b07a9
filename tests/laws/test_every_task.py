"""Laws of all tasks: a new task or setting is tested once it is described."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable
from dataclasses import MISSING
from pathlib import Path
from typing import Any

import pytest

from pretravel.base.errors import PretravelError
from pretravel.cli.app import App
from pretravel.cli.derived import command_of, task_of
from pretravel.task import values as texts
from pretravel.task.listed import PLACES, task_named
from pretravel.task.task import Setting, Task, by_name, command_line, settings_of
from pretravel.tasks.qualify.references import block_lengths, stated_reference
from pretravel.tasks.qualify.several_tips import stated_tip

TASKS = {**{name: task_named(name) for name in PLACES}, App.name: App}
SAMPLES: dict[Callable[[str], Any], str] = {
    texts.angles: "0:30:10", texts.polar_angles: "10,20.5", texts.pair: "0.5,-0.25",
    texts.indices: "1,2", texts.trace_mark: "rig_000_1:r0=1.25", texts.feeds_list: "50,200",
    texts.stated_columns: "x=X pos,nx=-I,label=2", texts.length_or_none: "1.5",
    texts.counts: "10x8", texts.vector: "1,-2.5,3", texts.unit_vector: "0,1,0",
    texts.tolerance: "20..20.021",
    block_lengths: "25.4,50.8,76.2", stated_tip: "front=4@0,1,0",
    stated_reference: "r50=ring:50.0003:0.3",
}  # fmt: skip
"""What can be typed, by the function that reads it."""
every_task = pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)


def _sample(setting: Setting) -> Any:
    """A value that differs from the default."""
    if setting.field.parse is not None:
        return setting.field.parse(SAMPLES[setting.field.parse])
    if setting.choices:
        return next(choice for choice in reversed(setting.choices) if choice != setting.default)
    if setting.kind is bool:
        return not setting.default
    if setting.kind is Path:
        return Path("a b" + (setting.field.writes or (".csv",))[0])
    if setting.kind in (float, int):
        low, high = (max(-1e6, min(1e6, end)) for end in setting.limits)
        between = low + 0.2371 * (high - low)
        return math.ceil(between) if setting.kind is int else between
    return "a 'quoted' text"


def _full(task: type[Task]) -> Task:
    return task(
        **{
            setting.name: (_sample(setting),) if setting.several else _sample(setting)
            for setting in settings_of(task)
        }
    )


@every_task
def test_the_command_line_of_a_task_means_the_task(task: type[Task]) -> None:
    full = _full(task)
    words = shlex.split(command_line(full))[1 + len(task.name.split()) :]
    command = command_of(task)
    context = command.make_context(task.name, words)
    assert task_of(task, context.params) == full


@every_task
def test_what_is_described(task: type[Task]) -> None:
    """Each setting has a sentence, each number has limits, each default lies within them."""
    assert task.example.startswith(f"pretravel {task.name}")
    assert (task.__doc__ or "").partition("\n")[0].endswith(".")
    for setting in settings_of(task):
        assert setting.field.help.rstrip().endswith((".", "…", ")")), setting.name
        if setting.kind in (float, int) and setting.field.parse is None:
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
        if setting.kind in (float, int) and setting.field.parse is None:
            low, high = setting.limits
            wrong = [low - 1.0 - abs(low), high + 1.0 + abs(high), math.nan, "x", True]
        if setting.choices and setting.field.parse is None:
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
