"""Colours of all pictures, by what they mean; safe for colour-blind readers, light and dark.

The colours of series are those of Okabe and Ito (2008, "Color Universal Design"), darker on white
and lighter on dark, so that lines and marks keep a contrast of 3:1 to the background (WCAG 2.2,
1.4.11).
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Literal, TypeAlias, get_args

Colour: TypeAlias = Literal[
    "series1", "series2", "series3", "series4", "series5", "series6", "series7", "series8",
    "after", "before", "limit", "zone", "reference", "ink", "paper", "grid", "body",
]  # fmt: skip
"""What a colour means: `after` and `before` compensation, a `limit` and the `zone` inside it, a
`reference` that a result is compared with; `series1` … for things that are alike."""

SERIES: tuple[Colour, ...] = get_args(Colour)[:8]

_SERIES_LIGHT = (
    "#0072b2", "#d55e00", "#007d5c", "#b0578d", "#9a6a00", "#3a86b8", "#6c757d", "#5b4a9e",
)  # fmt: skip
_SERIES_DARK = (
    "#56b4e9", "#ff9a4d", "#2ed3a3", "#e6a5c8", "#f0c03c", "#a8d8f5", "#b4bcc4", "#b3a4f0",
)  # fmt: skip
LIGHT = MappingProxyType(
    dict(zip(SERIES, _SERIES_LIGHT, strict=True))
    | {"after": "#0072b2", "before": "#d55e00", "limit": "#9b2226", "zone": "#007d5c"}
    | {"reference": "#6c757d", "ink": "#1d2730", "paper": "#ffffff", "grid": "#d5dbe1"}
    | {"body": "#b8c4ce"}
)
DARK = MappingProxyType(
    dict(zip(SERIES, _SERIES_DARK, strict=True))
    | {"after": "#56b4e9", "before": "#ff9a4d", "limit": "#ff7b7b", "zone": "#2ed3a3"}
    | {"reference": "#b4bcc4", "ink": "#e9eef2", "paper": "#14191f", "grid": "#3a444e"}
    | {"body": "#66737f"}
)
SEQUENTIAL, SIGNED = "viridis", "RdBu_r"
"""Scales of colours, as matplotlib names them: from low to high; about zero, which is white."""


def series(index: int) -> Colour:
    """The colour of the n-th of several alike things; it repeats after eight.

    >>> series(0), series(9)
    ('series1', 'series2')
    """
    return SERIES[index % len(SERIES)]


def transparent(colour: str, opacity: float) -> str:
    """A colour such as #0072b2 with an opacity, as CSS writes it.

    >>> transparent("#0072b2", 0.2)
    'rgba(0,114,178,0.2)'
    """
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity:g})"
