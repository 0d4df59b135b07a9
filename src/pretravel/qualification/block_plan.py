"""Touches on a block that separate scale, squareness, backlash and pretravel.

The block stands on a plate and is touched at several turns:

- at 0° and 90°, its sides and its top: lengths along both axes, squareness with the block reversed;
- at 180°: squareness to the axis of the probe, with the block reversed;
- at 30°: each side once along its normal, and along a machine axis with the other axis arriving
  from either side. The contact and its pretravel are the same; the readings differ by the backlash.

Faces alternate, so that a drift does not look like a length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import (
    DEGREE,
    REFERENCE_DIAMETER,
    FloatArray,
    PretravelError,
    checked,
    frozen,
    turned_about_axes,
    unit,
)

TURNS_DEG = (0.0, 90.0, 180.0)
OBLIQUE_DEG = 30.0
_ARRIVAL = 0.04
"""Share of the approach along the axis that arrives: 0.2 mm over 5 mm, more than usual backlash."""
_INSIDE = 0.35
"""Touches lie this share of a length from the middle of a face."""
_BESIDE = 8.0
"""Distance of the touches on the plate from the faces of the block. [mm]"""
_HEIGHTS = (0.15, 0.55)
"""Depths of the touches on the sides below the top, as shares of the height."""


@dataclass(frozen=True, eq=False)
class BlockPlan:
    """Touches on a block, about its middle.

    Attributes
    ----------
    points, normals, approaches : (n, 3) float
        On the surface; the middle of the block is the origin at each turn. [mm, –, –]
    references : tuple of str
        ``block@30``, ``plate@30``.
    turns : (n,) float
        [rad]
    faces : (n, 2) int
        Axis of the face in the block, and its side.
    """

    points: FloatArray
    normals: FloatArray
    approaches: FloatArray
    references: tuple[str, ...]
    turns: FloatArray
    faces: FloatArray

    @property
    def labels(self) -> tuple[str, ...]:
        """Reference and number: the log of a program keeps what was touched."""
        return tuple(f"{name}/{i + 1}" for i, name in enumerate(self.references))


def plan_block(lengths: tuple[float, ...]) -> BlockPlan:
    """Plan the touches on a block.

    Parameters
    ----------
    lengths : tuple of float
        One, of a cube, or those along x, y and z at a turn of zero. [mm]

    Raises
    ------
    PretravelError
        Another number of lengths; a length outside its range.

    >>> plan = plan_block((25.4, 50.8, 76.2))
    >>> len(plan.points), sorted(set(plan.references))[:3]
    (96, ['block@0', 'block@180', 'block@30'])
    """
    if len(lengths) not in (1, 3):
        raise PretravelError(
            f"{len(lengths)} lengths of a block: one of a cube, or three along x, y and z",
            inputs=("block",),
        )
    for length in lengths:
        checked(length, "the length of the block", REFERENCE_DIAMETER, inputs=("block",))
    size = np.array(lengths * 3 if len(lengths) == 1 else lengths)
    rows: list[tuple[FloatArray, FloatArray, FloatArray, str, float, tuple[int, int]]] = []
    for turn in (*TURNS_DEG[:2], OBLIQUE_DEG, TURNS_DEG[2]):
        own = _oblique(size) if turn == OBLIQUE_DEG else _square(size)
        about = turned_about_axes(0.0, 0.0, turn * DEGREE)
        for point, normal, way, what, face in own:
            outward = about @ normal
            approach = -outward if way is None else _arriving(outward, way)
            rows.append((about @ point, outward, approach, f"{what}@{turn:g}",
                         turn * DEGREE, face))  # fmt: skip
    return BlockPlan(
        points=frozen([row[0] for row in rows]),
        normals=frozen([row[1] for row in rows]),
        approaches=frozen([row[2] for row in rows]),
        references=tuple(row[3] for row in rows),
        turns=frozen([row[4] for row in rows]),
        faces=np.array([row[5] for row in rows], dtype=np.int64),
    )


_Touch = tuple[FloatArray, FloatArray, int | None, str, tuple[int, int]]


def _square(size: FloatArray) -> list[_Touch]:
    """Four touches on each side, on the top and on the plate, in turn."""
    found: list[_Touch] = []
    for along, depth in ((-1, 0), (1, 1), (1, 0), (-1, 1)):
        for axis, side in ((0, 1), (1, 1), (0, -1), (1, -1)):
            found.append(_on_side(size, axis, side, along * side, _HEIGHTS[depth], None))
        across = along * (1 if depth else -1)
        top = np.array([_INSIDE * along, _INSIDE * across, 0.5]) * size
        found.append((top, np.array([0.0, 0.0, 1.0]), None, "block", (2, 1)))
        plate = np.array(
            [along * (0.5 * size[0] + _BESIDE), across * _INSIDE * size[1], -0.5 * size[2]]
        )
        found.append((plate, np.array([0.0, 0.0, 1.0]), None, "plate", (2, -1)))
    return found


def _oblique(size: FloatArray) -> list[_Touch]:
    """Each side along its normal, and with the other axis arriving from both sides."""
    found: list[_Touch] = []
    for along in (-1, 1):
        for way in (None, 1, -1):
            for axis, side in ((0, 1), (1, 1), (0, -1), (1, -1)):
                found.append(_on_side(size, axis, side, along, _HEIGHTS[0], way))
    return found


def _on_side(
    size: FloatArray, axis: int, side: int, along: float, depth: float, way: int | None
) -> _Touch:
    point, normal = np.zeros(3), np.zeros(3)
    point[axis], normal[axis] = 0.5 * side * size[axis], side
    point[1 - axis] = along * _INSIDE * size[1 - axis]
    point[2] = (0.5 - depth) * size[2]
    return point, normal, way, "block", (axis, side)


def _arriving(normal: FloatArray, way: int) -> FloatArray:
    """Along the machine axis that is nearest to the normal; the other one arrives from a side."""
    main = int(np.argmax(np.abs(normal[:2])))
    approach = np.zeros(3)
    approach[main] = -np.sign(normal[main])
    approach[1 - main] = way * _ARRIVAL
    return np.asarray(unit(approach))
