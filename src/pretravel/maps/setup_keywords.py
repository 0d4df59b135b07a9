"""The keywords of `QualificationSetup` in the signature of functions that take them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from dataclasses import fields
from difflib import get_close_matches
from typing import TypeVar

from pretravel.maps.provenance import QualificationSetup, SetupOptions

_Function = TypeVar("_Function", bound=Callable[..., object])
_DEFAULTS = {field.name: field.default for field in fields(QualificationSetup)}


def with_setup_keywords(function: _Function) -> _Function:
    """The function with its keywords in help and signature, in the place of ``**options``.

    >>> @with_setup_keywords
    ... def made(diameter, **options): ...
    >>> list(inspect.signature(made).parameters)[:3]
    ['diameter', 'tip_diameter', 'ring']
    """
    signature = inspect.signature(function)
    kept = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    types = SetupOptions.__annotations__
    keywords = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=_DEFAULTS[name],
            annotation=getattr(types[name], "__forward_arg__", types[name]),
        )
        for name in types
    ]
    shown = signature.replace(parameters=[*kept, *keywords])
    function.__signature__ = shown  # type: ignore[attr-defined]  # inspect reads it
    return function


def check_keywords(function: str, given: Iterable[str]) -> None:
    """Refuse a keyword that is none of `QualificationSetup`, and name the closest one.

    Parameters
    ----------
    function : str
        For the message.
    given : iterable of str

    Raises
    ------
    TypeError

    >>> check_keywords("qualify", {"tip_dia": 6.0})
    Traceback (most recent call last):
    ...
    TypeError: qualify() has no keyword 'tip_dia'. Did you mean tip_diameter? There are \
tip_diameter, ring, u_diameter, u_temperature, sphere_form, axial_pretravel, axis, search_outliers
    """
    known = list(SetupOptions.__annotations__)
    for name in given:
        if name not in known:
            close = get_close_matches(name, known, n=1)
            meant = f" Did you mean {close[0]}?" if close else ""
            raise TypeError(
                f"{function}() has no keyword '{name}'.{meant} There are {', '.join(known)}"
            )
