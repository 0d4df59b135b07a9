"""Fields of a form, bound to settings of a screen: each tab shows what another one typed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from nicegui import ui

from pretravel.app.components.layout import here
from pretravel.app.project import ScreenState

_TYPING = 1000
"""Time without a key after which a number is finished; leaving the field finishes it at once. [ms]

Until then it is not a fault: 24 on the way to 24.9987 contradicts the touches on a sphere of 25."""


def typed_number(given: str) -> float:
    """A number as it was typed.

    Raises
    ------
    ValueError
        It is not a finite number; the text teaches.

    >>> typed_number(" 25.4 ")
    25.4
    >>> typed_number("25,4")
    25.4
    >>> typed_number("1,024.5")
    Traceback (most recent call last):
        ...
    ValueError: '1,024.5' is not a number: write for example 25.4
    """
    content = given.strip()
    single = content.count(",") == 1 and "." not in content
    try:
        value = float(content.replace(",", ".") if single else content)
    except ValueError:
        raise ValueError(f"{content!r} is not a number: write for example 25.4") from None
    if not math.isfinite(value):
        raise ValueError(f"{content} is not finite")
    return value


def number_text(value: float | None) -> str:
    """A number as it stands in a field."""
    return "" if value is None else f"{value:.12g}"


def _understood(given: str, unit: str) -> str:
    """What is said of a good number that has a decimal comma; nothing of another."""
    if "," not in given:
        return ""
    return f"understood as {number_text(typed_number(given))} {unit}".strip()


def _say_below(field: ui.element, words: str) -> None:
    field.props.pop("hint", None)  # an empty one would leave a gap
    if words:
        field.props["hint"] = words
    field.update()


def number_field(
    state: ScreenState,
    name: str,
    label: str,
    *,
    unit: str = "",
    default: float | None = None,
    limits: tuple[float, float] = (-math.inf, math.inf),
    hint: str = "",
) -> ui.input:
    """A field for a number; what is not a number within the limits is said below it and not stored.

    An empty field removes the setting, so that the default applies.

    Parameters
    ----------
    state : ScreenState
    name : str
        Of the setting.
    label, unit, hint : str
    default : float or None
        Shown where nothing is set. It is not stored.
    limits : tuple of float
        Smallest and largest value.
    """

    def problem(given: str) -> str | None:
        if not given.strip():
            return None
        try:
            value = typed_number(given)
        except ValueError as error:
            return str(error)
        if not limits[0] <= value <= limits[1]:
            return f"{value:g} {unit} is not between {limits[0]:g} and {limits[1]:g}".strip()
        return None

    def commit() -> None:
        given = str(field.value or "")
        good = problem(given) is None
        state.mark(name, "" if good else label)
        if good and given.strip():
            state.settings[name] = typed_number(given)
        elif good:
            state.settings.pop(name, None)
        _say_below(field, (_understood(given, unit) if good else "") or hint)

    def shown() -> str:
        return number_text(state.settings.get(name, default))

    state.mark(name, "")  # the field begins with what is stored
    field = ui.input(f"{label} [{unit}]" if unit else label, value=shown(), validation=problem)
    field.props(f'outlined stack-label inputmode="decimal" debounce="{_TYPING}" autocomplete="off"')
    field.classes("field").on_value_change(commit)
    _say_below(field, hint)

    def refresh() -> None:
        given = str(field.value or "")
        if problem(given) is not None:
            return  # what is being corrected is not taken away
        stored = state.settings.get(name, default)
        if (typed_number(given) if given.strip() else default) != stored:
            field.set_value(number_text(stored))

    here([state.listen], refresh)
    return field


def text_field(
    state: ScreenState, name: str, label: str, *, default: str = "", hint: str = ""
) -> ui.input:
    """A field for a line of text."""
    field = ui.input(label, value=state.settings.get(name, default))
    field.props('outlined stack-label debounce="250" autocomplete="off" maxlength="1000"').classes(
        "field"
    )
    _say_below(field, hint)

    def commit() -> None:
        state.settings[name] = str(field.value or "")

    field.on_value_change(commit)
    _follow(state, name, default, field)
    return field


def choice_field(
    state: ScreenState,
    name: str,
    label: str,
    options: Mapping[Any, str] | Sequence[Any],
    *,
    default: Any = None,
    hint: str = "",
) -> ui.select:
    """A choice of one among several; a mapping gives each value the text that is shown."""
    shown = dict(options) if isinstance(options, Mapping) else {value: value for value in options}
    value = state.settings.get(name, default)
    field = ui.select(shown, label=label, value=value if value in shown else default)
    field.props('outlined stack-label behavior="menu"').classes("field")
    _say_below(field, hint)

    def commit() -> None:
        if field.value != state.settings.get(name, default):  # a default is shown, not stored
            state.settings[name] = field.value

    field.on_value_change(commit)
    _follow(state, name, default, field)
    return field


def switch_field(state: ScreenState, name: str, label: str, *, default: bool = False) -> ui.switch:
    """Yes or no."""
    field = ui.switch(label, value=bool(state.settings.get(name, default))).classes("field")

    def commit() -> None:
        if bool(field.value) != bool(state.settings.get(name, default)):
            state.settings[name] = bool(field.value)

    field.on_value_change(commit)
    _follow(state, name, default, field)
    return field


def slider_field(
    state: ScreenState,
    name: str,
    label: str,
    *,
    limits: tuple[float, float],
    step: float,
    default: float,
    unit: str = "",
) -> ui.slider:
    """A number with a slider and, next to it, a field to type it."""
    with ui.element("div").classes("slider-field"):
        number_field(state, name, label, unit=unit, default=default, limits=limits)
        return bare_slider(state, name, label, limits=limits, step=step, default=default)


def bare_slider(
    state: ScreenState,
    name: str,
    label: str,
    *,
    limits: tuple[float, float],
    step: float,
    default: float,
) -> ui.slider:
    """A slider without a field; one next to it can take numbers beyond the ends of the slider."""
    slider = ui.slider(
        min=limits[0], max=limits[1], step=step, value=state.settings.get(name, default)
    )
    slider.props["aria-label"] = label

    def commit() -> None:
        if slider.value is not None:
            state.settings[name] = float(slider.value)

    slider.on("update:model-value", commit, throttle=0.1)
    _follow(state, name, default, slider)
    return slider


def _follow(state: ScreenState, name: str, default: Any, field: Any) -> None:
    """Show what another tab has set."""

    def refresh() -> None:
        value = state.settings.get(name, default)
        if field.value != value:
            field.set_value(value)

    here([state.listen], refresh)
