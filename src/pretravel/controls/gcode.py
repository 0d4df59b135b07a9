"""G-code from the template files of this folder, in the number formats of the controls."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from pretravel.base import PretravelError

_DIGITS = 8
"""A Fanuc control accepts this number of digits in an assignment, zeros included."""


def render(template: str, **values: object) -> str:
    """Fill a template.

    Parameters
    ----------
    template : str
        Path of a file in the folder ``templates``, such as ``linuxcnc/program.ngc``.
    **values : object
        The names that the template uses.

    >>> print(render("linuxcnc/unit.ngc", inch=25.4).splitlines()[2])
    #<unit> = [1/25.4]
    """
    return _environment().get_template(template).render(values)


@cache
def _environment() -> Environment:
    # Autoescape is for HTML; G-code has no such characters to escape.
    environment = Environment(
        loader=PackageLoader("pretravel.controls", "templates"),
        undefined=StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "coordinate": coordinate,
        "cells": lambda vector: ",".join(map(coordinate, vector)),
        "arguments": arguments,
        "exact": exact,
        "plain": plain_number,
        "comment": comment,
        "sentence": sentence,
    }
    return environment


def coordinate(value: float) -> str:
    """A coordinate or a component of a direction: nine decimals without the zeros at the end.

    >>> coordinate(-1.5), coordinate(-1e-12)
    ('-1.5', '0')
    """
    return f"{float(np.round(value, 9)) + 0.0:.9f}".rstrip("0").rstrip(".")


def arguments(vector: Iterable[float]) -> str:
    """The components of a vector as arguments of a subroutine.

    >>> arguments([0.0, 0.5, -1.0])
    '[0] [0.5] [-1]'
    """
    return " ".join(f"[{coordinate(value)}]" for value in vector)


def exact(value: float) -> str:
    """All digits of a number, without an exponent: interpreters do not read exponents.

    >>> exact(0.25), exact(1e-7)
    ('0.25', '0.0000001')
    """
    text = f"{float(value) + 0.0:.20f}".rstrip("0").rstrip(".")
    if math.isclose(float(text), value, rel_tol=1e-12):
        return text
    return f"{float(value):.30f}".rstrip("0").rstrip(".")


def plain_number(value: float) -> str:
    """A number of at most eight digits, with a decimal point and without an exponent.

    Raises
    ------
    PretravelError
        The number is not finite, or has more than seven digits before the point.

    >>> plain_number(0.00812345), plain_number(-3.0), plain_number(-1e-9), plain_number(359.9999996)
    ('0.0081235', '-3.0', '0.0', '360.0')
    """
    if not (math.isfinite(value) and abs(value) < 10 ** (_DIGITS - 1) - 1):
        raise PretravelError(f"{value} cannot be written for a control: it has too many digits")
    decimals = _DIGITS - len(str(int(abs(value))))
    text = f"{round(value, decimals) + 0.0:.{decimals}f}".rstrip("0")
    return text + "0" if text.endswith(".") else text


def comment(text: str) -> str:
    r"""Text from outside for a comment, on one line: only letters, digits, blank, _ . and -.

    Every other sign could end the comment, begin a parameter, or begin another line on one control
    or another; it becomes an underscore.

    >>> comment("mill (3)\nM3 S20000, 5 µm")
    'mill _3__M3 S20000_ 5 _m'
    """
    return "".join(sign if sign.isascii() and (sign.isalnum() or sign in " _.-") else "_"
                   for sign in text)  # fmt: skip


def sentence(text: str) -> str:
    """A sentence of ours for a comment: without brackets and characters that a control would read.

    >>> sentence("limits: the file has no [limits]; 5 %")
    'limits: the file has no [limits], 5 _'
    """
    plain = text.encode("ascii", "replace").decode().replace(";", ",")
    return "".join(sign if sign.isprintable() and sign not in "()#%{}" else "_"
                   for sign in plain)  # fmt: skip
