"""The standards whose probing tests can be evaluated, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from pretravel.base import FloatArray, Plugins
from pretravel.laboratory import Standard

STANDARDS: Mapping[str, Standard] = Plugins(
    "pretravel.standards", first=("iso10360-5", "iso230-10", "iso230-10-tip-offset")
)
"""Standards by name: the group of entry points ``pretravel.standards``."""


def patterns() -> dict[str, Callable[[], FloatArray]]:
    """Directions of the touches of all standards, by the name of the pattern.

    >>> list(patterns())[:3]
    ['iso10360-5', 'iso10360-5-cumulative', 'iso230-10']
    """
    return {
        name: pattern
        for standard in STANDARDS.values()
        for name, pattern in standard.patterns.items()
    }
