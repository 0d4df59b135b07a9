"""Values of options as they are typed, read by the settings of the task.

typer would read them with pydantic, whose import takes a third of the time of a short command.
"""

from __future__ import annotations

import re
from typing import Any

import typer
from typer.core import TyperGroup

from pretravel.base import PretravelError, decimal_point_advice
from pretravel.task import Setting

_WHOLE = re.compile(r"[+-]?\d+(?:\.0*)?", re.ASCII)
_NOT = "unable to parse string as"


class HelpUnread:
    """A command whose option ``--help`` is false where it is not typed: it needs no reading."""

    def get_help_option(self, ctx: Any) -> Any:
        """The option, or None."""
        option = super().get_help_option(ctx)  # type: ignore[misc]
        if option is not None:
            option.default = False
        return option


class Group(HelpUnread, TyperGroup):
    """The commands that begin with the same word."""


def read_here(parameter: Any, setting: Setting) -> None:
    """Let a parameter of typer read its values by its setting.

    Parameters
    ----------
    parameter : typer.core.TyperOption or TyperArgument
    setting : Setting
    """
    usual = parameter.process_value

    def process_value(context: typer.Context, value: Any) -> Any:
        if value is None or value in ((), []):
            if parameter.required:
                return usual(context, value)  # its message
            return () if setting.several else None
        return (
            [_value(setting, each) for each in value] if setting.several else _value(setting, value)
        )

    parameter.process_value = process_value


def _value(setting: Setting, typed: Any) -> Any:
    """A value of the type of a setting; a default passes.

    Raises
    ------
    typer.BadParameter
        With the value and what is wrong with it.
    """
    if not isinstance(typed, str):
        return typed
    try:
        if setting.parse is not None:
            return setting.parse(typed)
    except PretravelError as error:
        raise typer.BadParameter(f"{typed}: {error}") from error
    if setting.field.names is not None:
        if not setting.is_choice(typed):
            known = ", ".join(setting.choices)
            raise typer.BadParameter(f"{typed}: it is not known; there are {known}")
        return typed
    if setting.choices:
        if typed not in setting.choices:
            known = ", ".join(map(repr, setting.choices))
            raise typer.BadParameter(f"{typed}: {typed!r} is not one of {known}.")
        return typed
    if setting.kind in (float, int):
        return _in_range(setting, typed, _number(setting.kind, typed))
    return setting.kind(typed)  # a text or a path


def _number(kind: type, typed: str) -> float | int:
    text = typed.strip()
    if kind is int:
        if _WHOLE.fullmatch(text) is None:
            raise typer.BadParameter(f"{typed}: it should be a valid integer, {_NOT} an integer")
        return int(text.partition(".")[0])
    try:
        if text.isascii():  # Python reads the digits of every script
            return float(text)
    except ValueError:
        pass
    reason = decimal_point_advice(typed) or f"it should be a valid number, {_NOT} a number"
    raise typer.BadParameter(f"{typed}: {reason}")


def _in_range(setting: Setting, typed: str, value: float | int) -> float | int:
    if setting.field.range is None:
        return value
    low, high = setting.limits
    if value != value:
        raise typer.BadParameter(f"{typed}: it should be a finite number")
    for outside, word, limit in ((value < low, "greater", low), (value > high, "less", high)):
        if outside:
            raise typer.BadParameter(
                f"{typed}: it should be {word} than or equal to {_plain(limit)}"
            )
    return value


def _plain(limit: float) -> str:
    """A limit without an exponent.

    >>> _plain(1e-6), _plain(1e6)
    ('0.000001', '1000000')
    """
    return f"{limit:.12f}".rstrip("0").rstrip(".")
