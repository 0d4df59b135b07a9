"""Data of a machine: the limits of its numbers, and their relations."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.files.machine import WORK_OFFSETS, Machine, work_placement, work_turn

MACHINE = Machine()

BOUNDS = {
    "tip_diameter": (0.05, 50.0), "stem_diameter": (0.02, 50.0), "stylus_length": (1.0, 1000.0),
    "body_diameter": (0.1, 500.0), "measuring_feed": (0.5, 3000.0),
    "positioning_feed": (1.0, 60000.0), "travel_feed": (1.0, 60000.0),
    "acceleration": (1.0, 1e6), "safe_height": (-1e4, 1e4), "start_distance": (0.01, 100.0),
    "overtravel": (0.01, 100.0), "clearance": (0.001, 100.0), "tool_length": (-2000.0, 2000.0),
    "change_height": (-1e4, 1e4),
}  # fmt: skip  # fmt: skip


def _told(**numbers: Any) -> str:
    """Why a machine is refused; empty where it is not."""
    try:
        replace(MACHINE, **numbers)
    except PretravelError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", BOUNDS)
def test_bounds_of_every_number(name: str) -> None:
    """At a bound a number can be refused for its relation to others, but not by itself."""
    for bound, outwards in zip(BOUNDS[name], (-1.0, 1.0), strict=True):
        beyond = bound + outwards * max(1e-3 * abs(bound), 1e-6)
        assert "must lie between" not in _told(**{name: bound})
        words = f"must lie between {BOUNDS[name][0]:g} and {BOUNDS[name][1]:g}"
        assert words in _told(**{name: beyond})


@pytest.mark.parametrize(
    ("good", "bad", "words"),
    [
        ({"stem_diameter": 5.999}, {"stem_diameter": 6.0}, "stem diameter 6 mm: it must be"),
        ({"body_diameter": 4.5}, {"body_diameter": 4.49}, "not thinner than the stem"),
        ({"clearance": 1.999}, {"clearance": 2.0}, "less than the start distance"),
        # A fifth of the stylus, and 10 mm at the most.
        (
            {"overtravel": 10.0},
            {"overtravel": 10.01},
            "stylus of 50 mm can deflect by 10 mm at most",
        ),
        (
            {"overtravel": 4.0, "stylus_length": 20.0},
            {"overtravel": 4.01, "stylus_length": 20.0},
            "stylus of 20 mm can deflect by 4 mm at most",
        ),
        (
            {"overtravel": 10.0, "stylus_length": 200.0},
            {"overtravel": 10.01, "stylus_length": 200.0},
            "stylus of 200 mm can deflect by 10 mm at most",
        ),
        # The distance to stop, v² / 50 mm/s² + 3 ms · v, is 10 mm at 22.286 mm/s, 1337.2 mm/min.
        (
            {"acceleration": 50.0, "positioning_feed": 600.0, "measuring_feed": 1337.0},
            {"acceleration": 50.0, "positioning_feed": 600.0, "measuring_feed": 1338.0},
            "measuring feed 1338 mm/min: after a contact.*override up to 100 %",
        ),
        # Other feeds can be doubled by the override.
        (
            {"acceleration": 50.0, "positioning_feed": 668.0},
            {"acceleration": 50.0, "positioning_feed": 669.0},
            "positioning feed 669 mm/min: after a contact.*override up to 200 %",
        ),
        (
            {"acceleration": 50.0, "positioning_feed": 600.0, "travel_feed": 668.0},
            {"acceleration": 50.0, "positioning_feed": 600.0, "travel_feed": 669.0},
            "travel feed 669 mm/min: after a contact",
        ),
        ({"tool": 1}, {"tool": 0}, "tool 0: the tool table numbers tools from 1"),
        ({"tool": 1, "tool_length": 80.0}, {"tool_length": 80.0}, "need the number of a tool"),
        ({"tool": 1, "change_height": 5.0}, {"change_height": 5.0}, "need the number"),
        ({"work_offset": "G59.3"}, {"work_offset": "G59.4"}, "it is one of G54, G55"),
        (
            {"limits": np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 1e-3]])},
            {"limits": np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 0.0]])},
            "the first number must be below the second",
        ),
    ],
)
def test_relations_of_numbers(good: dict[str, Any], bad: dict[str, Any], words: str) -> None:
    assert _told(**({"travel_feed": 0.0} | good)) == ""
    assert re.search(words, _told(**({"travel_feed": 0.0} | bad)))


def test_what_is_not_stated() -> None:
    """The travel feed is that of positioning; the work coordinates are those of the machine."""
    assert MACHINE.travel_feed == MACHINE.positioning_feed
    assert replace(MACHINE, travel_feed=2000.0).travel_feed == 2000.0
    assert work_turn(work_placement(1.0, 2.0, 3.0)) == 0.0
    assert WORK_OFFSETS[5:7] == ("G59", "G59.1")


@pytest.mark.parametrize("angle", [-2.5, -0.3, 0.0, 0.3, 2.5])
def test_turns_of_work_coordinates(angle: float) -> None:
    placed = work_placement(1.0, 2.0, 3.0, angle)
    assert work_turn(placed) == pytest.approx(angle)
    expected = [1.0 + math.cos(angle), 2.0 + math.sin(angle), 3.0]
    assert placed.points(np.array([[1.0, 0.0, 0.0]]))[0] == pytest.approx(expected)
