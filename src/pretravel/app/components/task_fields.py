"""Fields of a form that are made from the description of a task."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from nicegui import ui

from pretravel.app.components.fields import choice_field, number_field, switch_field, text_field
from pretravel.app.project import ScreenState
from pretravel.app.task_form import TaskForm
from pretravel.tasks.task import by_name
from pretravel.tasks.values import Length

_LENGTHS = (0.0, 100.0)
"""Of a setting that is a length or none. [µm]"""


def described_fields(state: ScreenState, form: TaskForm, names: Iterable[str]) -> None:
    """Fields for several settings, as `described_field` makes them."""
    for name in names:
        described_field(state, form, name)


def described_field(
    state: ScreenState,
    form: TaskForm,
    name: str,
    *,
    choices: Mapping[Any, str] | None = None,
) -> ui.element:
    """A field for a setting: label, unit, limits, default and hint are those of the description.

    Parameters
    ----------
    state : ScreenState
    form : TaskForm
    name : str
        In the task.
    choices : mapping of value to str, optional
        The values that the form offers, with their words.
    """
    setting = by_name(form.task)[name]
    label, hint, default = setting.label, setting.field.hint, form.default(name)
    stored = form.stored_name(name)
    if choices is not None or setting.choices:
        words = setting.field.words or {}
        options: dict[Any, str] = {None: words.get("", "not stated")} if default is None else {}
        ordered = sorted(
            setting.choices, key=list({**words, **dict.fromkeys(setting.choices)}).index
        )
        options |= choices or {choice: words.get(choice, choice) for choice in ordered}
        return choice_field(state, stored, label, options, default=default, hint=hint)
    if setting.kind is bool:
        return switch_field(state, stored, label, default=bool(default))
    if setting.kind in (float, int, Length):
        return number_field(
            state,
            stored,
            label,
            unit=setting.unit,
            default=default,
            limits=_LENGTHS if setting.kind is Length else setting.limits,
            hint=hint,
        )
    return text_field(state, stored, label, default=default or "", hint=hint)
