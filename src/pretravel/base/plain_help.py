"""Signatures as `help` shows them: names of types without quotes, numbers without rounding."""

from __future__ import annotations

import inspect
from typing import Any, TypeVar

Shown = TypeVar("Shown")
_DIGITS = 12


class _Words(str):
    """An annotation that is shown as it was written."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


class _Number(float):
    """A default that is shown without its rounding to binary digits; a float everywhere else."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"{float(self):.{_DIGITS}g}"


def plainly_shown(value: Shown) -> Shown:
    """A function, or a class with its methods, whose signature `help` shows as it was written.

    >>> def area(width: float, height: float = 0.13 * 1e-3) -> float: ...
    >>> inspect.signature(plainly_shown(area))
    <Signature (width: float, height: float = 0.00013) -> float>
    """
    if inspect.isfunction(value):
        _show(value)
    elif inspect.isclass(value):
        for member in vars(value).values():
            if inspect.isfunction(member):
                _show(member)
    return value


def _show(function: Any) -> None:
    try:
        found = inspect.signature(function)
    except (TypeError, ValueError):  # none that Python can tell
        return
    function.__signature__ = found.replace(
        parameters=[
            one.replace(annotation=_words(one.annotation), default=_number(one.default))
            for one in found.parameters.values()
        ],
        return_annotation=_words(found.return_annotation),
    )


def _words(annotation: Any) -> Any:
    return _Words(annotation) if isinstance(annotation, str) else annotation


def _number(default: Any) -> Any:
    return _Number(default) if type(default) is float else default
