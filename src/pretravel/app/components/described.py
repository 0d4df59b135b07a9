"""Fields of a form that are made from the description of a task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Any

from nicegui import ui

from pretravel.app.components.fields import choice_field, number_field, switch_field, text_field
from pretravel.app.project import ScreenState
from pretravel.tasks.task import Setting, Task, by_name
from pretravel.tasks.values import Length

_LENGTHS = (0.0, 100.0)
"""Of a setting that is a length or none. [µm]"""


def form_settings(task: type[Task]) -> tuple[Setting, ...]:
    """The settings of a task itself that a form shows: not its files, nor those it shares.

    Parameters
    ----------
    task : type of Task

    >>> from pretravel.tasks.qualify import Qualify
    >>> [setting.name for setting in form_settings(Qualify)][:3]
    ['diameter', 'tip_diameter', 'kind']
    """
    own = vars(task)["__annotations__"]
    return tuple(
        setting
        for name, setting in by_name(task).items()
        if name in own and not (setting.field.reads or setting.field.writes)
    )


def stored_default(setting: Setting) -> Any:
    """The default of a setting as a project stores it: a number, a text, yes or no, or nothing.

    >>> from pretravel.tasks.qualify import Qualify
    >>> stored_default(by_name(Qualify)["axis"]), stored_default(by_name(Qualify)["diameter"])
    ('0,0,1', None)
    """
    default = None if setting.default is MISSING else setting.default
    if isinstance(default, Length):
        return default.micrometres
    return str(default) if isinstance(default, tuple) else default


def described_field(
    state: ScreenState,
    task: type[Task],
    name: str,
    *,
    choices: Mapping[Any, str] | None = None,
) -> ui.element:
    """A field for a setting: label, unit, limits, default and help are those of the description.

    Parameters
    ----------
    state : ScreenState
    task : type of Task
    name : str
    choices : mapping of value to str, optional
        The values that the form offers, with their words.
    """
    setting = by_name(task)[name]
    label, hint, default = setting.label, setting.field.hint, stored_default(setting)
    if choices is not None or setting.choices:
        words = setting.field.words or {}
        options = choices or {name: words.get(name, name) for name in setting.choices}
        return choice_field(state, name, label, options, default=default, hint=hint)
    if setting.kind is bool:
        return switch_field(state, name, label, default=bool(default))
    if setting.kind in (float, int, Length):
        return number_field(
            state,
            name,
            label,
            unit=setting.unit,
            default=default,
            limits=_LENGTHS if setting.kind is Length else setting.limits,
            hint=hint,
        )
    return text_field(state, name, label, default=default or "", hint=hint)
