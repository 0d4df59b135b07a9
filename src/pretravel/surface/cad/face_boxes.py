"""Boxes around faces: which faces can be near a point, or in the way of a ball."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.surface.cad.face import Face

_PAIRS = 2_000_000
"""Pairs of point and box that are examined together."""


@dataclass(frozen=True, eq=False)
class FaceBoxes:
    """Boxes with sides along the axes, each around a whole face.

    No point of a face is nearer than its box, so that faces whose boxes are too far away need not
    be examined.

    Parameters
    ----------
    low, high : (k, 3) float
        Opposite corners. [mm]
    index : (k,) int
        Index of each face in its part.
    """

    low: FloatArray
    high: FloatArray
    index: IntArray

    @classmethod
    def around(cls, faces: Sequence[Face], chosen: Sequence[int]) -> FaceBoxes:
        """The boxes of the chosen ones of some faces."""
        boxes = np.array([faces[i].bounds for i in chosen])
        return cls(boxes[:, 0], boxes[:, 1], np.array(chosen, dtype=np.int64))

    def within(self, points: FloatArray, reach: FloatArray) -> tuple[IntArray, IntArray]:
        """Pairs of a point and a face that can be as near as its reach.

        Parameters
        ----------
        points : (n, 3) float
            [mm]
        reach : (n,) float
            [mm]

        Returns
        -------
        rows, faces : (m,) int
            Ordered by rows.

        >>> low, high = np.zeros((1, 3)), np.ones((1, 3))
        >>> boxes = FaceBoxes(low, high, np.array([7]))
        >>> rows, faces = boxes.within(np.array([[2.0, 0, 0], [9, 0, 0]]), np.array([1.5, 1.5]))
        >>> rows.tolist(), faces.tolist()
        ([0], [7])
        """
        found = []
        for rows in self._chunks(len(points)):
            outside = np.zeros((len(rows), len(self.index)))
            for axis in range(3):
                x = points[rows, axis, None]
                gap = np.maximum(np.maximum(self.low[:, axis] - x, x - self.high[:, axis]), 0.0)
                outside += gap * gap
            row, face = np.nonzero(outside <= reach[rows, None] ** 2)
            found.append((rows[row], self.index[face]))
        return _joined(found)

    def along(
        self, start: FloatArray, direction: FloatArray, reach: FloatArray
    ) -> tuple[IntArray, IntArray]:
        """Pairs of a line and a face that can be as near to it as its reach.

        Parameters
        ----------
        start, direction : (n, 3) float
            Of the lines, which have no ends. [mm]
        reach : (n,) float
            [mm]

        Returns
        -------
        rows, faces : (m,) int
            Ordered by rows.
        """
        found = []
        for rows in self._chunks(len(start)):
            enter = np.full((len(rows), len(self.index)), -np.inf)
            leave = np.full((len(rows), len(self.index)), np.inf)
            for axis in range(3):
                d = direction[rows, axis, None]
                x, wide = start[rows, axis, None], reach[rows, None]
                across = np.abs(d) < 1e-12
                with np.errstate(divide="ignore", invalid="ignore"):
                    one = (self.low[:, axis] - wide - x) / d
                    two = (self.high[:, axis] + wide - x) / d
                inside = (self.low[:, axis] - wide <= x) & (x <= self.high[:, axis] + wide)
                one = np.where(across, np.where(inside, -np.inf, np.inf), one)
                two = np.where(across, np.where(inside, np.inf, -np.inf), two)
                enter = np.maximum(enter, np.minimum(one, two))
                leave = np.minimum(leave, np.where(across, two, np.maximum(one, two)))
            row, face = np.nonzero(enter <= leave)
            found.append((rows[row], self.index[face]))
        return _joined(found)

    def _chunks(self, count: int) -> Iterator[IntArray]:
        size = max(_PAIRS // max(len(self.index), 1), 1)
        for begin in range(0, count, size):
            yield np.arange(begin, min(begin + size, count))


def _joined(found: list[tuple[IntArray, IntArray]]) -> tuple[IntArray, IntArray]:
    nothing = np.empty(0, dtype=np.int64)
    return (
        np.concatenate([nothing, *(rows for rows, _ in found)]),
        np.concatenate([nothing, *(faces for _, faces in found)]),
    )
