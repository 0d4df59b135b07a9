"""Fields of a form that are made from the description of a task."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from nicegui import ui

from pretravel.app.components.fields import choice_field, number_field, switch_field, text_field
from pretravel.app.components.layout import live, text
from pretravel.app.page_words import page_words
from pretravel.app.project import ScreenState
from pretravel.app.session import address_in
from pretravel.app.task_form import TaskForm
from pretravel.show import Document, words_used
from pretravel.task import Length, Setting, by_name, settings_of

_LENGTHS = (0.0, 100.0)
"""Of a setting that is a length or none. [µm]"""
_MOST_WORDS = 4
"""Of the glossary, in the help of a field."""


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

    It is there while the task uses the setting together with the others.

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
    if not (setting.field.only or setting.field.without):
        return _with_help(state, form, setting, choices)

    def used() -> bool:
        files = {
            purpose: tuple(file.name for file in state.files[purpose]) for purpose in state.files
        }
        several = {each.name for each in settings_of(form.task) if each.several}
        named = {key: names if key in several else names[0] for key, names in files.items()}
        return name in form.used(state.settings, named)

    def build() -> None:
        if used():
            _with_help(state, form, setting, choices)
        else:
            state.mark(form.stored_name(name), "")  # the field is gone

    return live([state.listen], build, used)


def _with_help(
    state: ScreenState, form: TaskForm, setting: Setting, choices: Mapping[Any, str] | None
) -> ui.element:
    if setting.kind is bool:
        with ui.element("div").classes("switch-with-help"):
            stored, default = form.stored_name(setting.name), bool(form.default(setting.name))
            switch = switch_field(state, stored, setting.label, default=default)
            _help_button(form, setting)
        return switch
    field = _field(state, form, setting, choices)
    with field.add_slot("append"):
        _help_button(form, setting)
    return field


def _field(
    state: ScreenState, form: TaskForm, setting: Setting, choices: Mapping[Any, str] | None
) -> ui.element:
    name, label, hint = setting.name, setting.label, setting.field.hint
    stored, default = form.stored_name(name), form.default(name)
    if choices is not None or setting.choices:
        words = setting.shown_words
        options: dict[Any, str] = {None: words.get("", "not stated")} if default is None else {}
        ordered = sorted(
            setting.choices, key=list({**words, **dict.fromkeys(setting.choices)}).index
        )
        options |= choices or {choice: words.get(choice, choice) for choice in ordered}
        return choice_field(state, stored, label, options, default=default, hint=hint)
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


def _help_button(form: TaskForm, setting: Setting) -> None:
    """Opens what the description of the task says, with links to the words in it."""
    sentence = page_words(form.task, setting.help)
    if not sentence:
        return
    button = ui.button(icon="help_outline").props("flat round dense")
    button.props["aria-label"] = "Help"
    button.props["aria-description"] = setting.label
    typed = "" if setting.field.positional else f" On the command line: {setting.option}."
    with button, ui.menu().props("no-focus"), ui.element("div").classes("field-help"):
        text("p", f"{sentence}{typed}")
        with ui.element("p"):
            text("span", "Words: ")
            for entry in words_used([Document(f"{setting.label}. {sentence}")])[:_MOST_WORDS]:
                _help_link(entry.term, entry.anchor)
            _help_link("all", "words")


def _help_link(words: str, anchor: str) -> None:
    link = text("a", words).props('target="_blank" rel="noopener"')
    link.props["href"] = f"{address_in('/help')}#{anchor}"
