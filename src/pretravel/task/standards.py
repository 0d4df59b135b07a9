"""The standards whose probing tests can be evaluated, by name."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from pretravel.base import FloatArray, Plugins, ring_pattern

_PLACE = "pretravel.laboratory.standards."
STANDARDS: Plugins[Any] = Plugins(
    "pretravel.standards",
    own={
        "iso10360-5": f"{_PLACE}iso10360_5:ISO10360_5",
        "iso230-10": f"{_PLACE}iso230_10:ISO230_10",
        "iso230-10-tip-offset": f"{_PLACE}iso230_10_tip_offset:ISO230_10_TIP_OFFSET",
    },
)
"""Each a `Standard` of the laboratory, by name; others by entry points ``pretravel.standards``."""


def patterns() -> dict[str, Callable[[], FloatArray]]:
    """Directions of the touches of all standards, by the name of the pattern; then the equator.

    >>> list(patterns())[:3], len(patterns()["equator-24"]())
    (['iso10360-5', 'iso10360-5-cumulative', 'iso230-10'], 24)
    """
    return {
        name: pattern
        for standard in STANDARDS.values()
        for name, pattern in standard.patterns.items()
    } | {f"equator-{count}": partial(ring_pattern, 0.5 * math.pi, count) for count in _AROUND}


_AROUND = (12, 24, 36)
"""Directions around the equator: of a multi-step test (24 by Nafi and Mayer)."""
