"""Names of the regions and faces of a probe's solids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pretravel.prediction import Material
from pretravel.six_seats import SEAT_NAMES

SPRING = "spring"
"""Name of the face on which the spring presses."""

TIP = "tip"
"""Name of the region that touches the part."""

PATCH = 0.13
"""Radius of the patch over which a seat's force is spread, relative to the rod's radius."""


@dataclass(frozen=True)
class ProbeSolid:
    """One solid of a probe, before the solids are joined."""

    name: str
    solid: Any
    material: Material
    carries_seats: bool = False


def seat_face(index: int) -> str:
    """Name of the face that a seat pushes on.

    >>> seat_face(0)
    'seat A-left'
    """
    return f"seat {SEAT_NAMES[index]}"


def part_name(region: str) -> str:
    """The part that a region belongs to: tripod, stylus, tip; or hub, holder, rods.

    >>> part_name("stylus 2"), part_name("tripod: hub")
    ('stylus', 'tripod')
    """
    return region.partition(":")[0].rstrip(" 0123456789")
