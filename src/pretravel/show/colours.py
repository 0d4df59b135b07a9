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

_SEQUENTIAL_LIGHT = (
    "#440154", "#482475", "#414487", "#355f8d", "#2a788e", "#21918c",
    "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725",
)  # fmt: skip
_SEQUENTIAL_DARK = (
    "#355f8d", "#2e6f8e", "#297b8e", "#238a8d", "#1f958b", "#20a386",
    "#32b67a", "#54c568", "#86d549", "#bddf26", "#fde725",
)  # fmt: skip
_SIGNED_LIGHT = (
    "#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7",
    "#fddbc7", "#f4a582", "#d6604d", "#b2182b", "#67001f",
)  # fmt: skip
_SIGNED_DARK = (
    "#9ccff5", "#6fb4ea", "#4a95d3", "#3874a8", "#3a5a76", "#46505a",
    "#6f5049", "#a65a4b", "#d4715c", "#f08f78", "#ffb199",
)  # fmt: skip


def scale_colours(*, dark: bool = False) -> dict[str, str]:
    """The colours of both scales by name: `low0` … `low10` and `signed0` … `signed10`.

    On light they are those of files. On dark large values are light, and low ones are not black:
    the ends of RdBu and the beginning of viridis would not be seen there.
    """
    both = (_SEQUENTIAL_DARK, _SIGNED_DARK) if dark else (_SEQUENTIAL_LIGHT, _SIGNED_LIGHT)
    return {
        f"{name}{place}": colour
        for name, scale in zip(("low", "signed"), both, strict=True)
        for place, colour in enumerate(scale)
    }


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
