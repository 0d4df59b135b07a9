"""Whether deviations from a nominal are those of a part that lies elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray

_LARGE = 0.03
"""Root mean square of deviations that a frame of work explains: smaller ones are those of the part
and of its datums. [mm]"""
_SHARE = 0.9
"""Share of the squares of the deviations that a movement must explain."""
_RATIO = 30.0
"""Explained over unexplained squares, each by degrees of freedom: by chance above it in less than
2 % of cases with one parameter and three more points, and far less often with more points."""
_SEEN = 1e-8
"""Square of the smallest effect of a movement on the deviations that counts, over the largest."""


@dataclass(frozen=True, eq=False)
class MovementSums:
    """Sums over points from which the movement of a part follows; those of several sets add up.

    Attributes
    ----------
    count : int
    place : (3,) float
        Sum of the positions. [mm]
    squares : (7, 7) float
        Sum of products of the normal, the moment of the normal about the origin and the deviation.
    """

    count: int
    place: FloatArray
    squares: FloatArray

    @staticmethod
    def of(positions: FloatArray, normals: FloatArray, deviation: FloatArray) -> MovementSums:
        """Of points.

        Parameters
        ----------
        positions, normals : (n, 3) float
            [mm]
        deviation : (n,) float
            Along the normals. [mm]

        >>> up = np.array([[0.0, 0.0, 1.0]] * 4)
        >>> places = np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0], [9, 9, 0]])
        >>> MovementSums.of(places, up, np.full(4, 0.5)).count
        4
        """
        rows = np.column_stack([normals, np.cross(positions, normals), deviation])
        return MovementSums(len(rows), positions.sum(axis=0), rows.T @ rows)

    def joined(self, other: MovementSums) -> MovementSums:
        """Of both sets of points."""
        return MovementSums(
            self.count + other.count, self.place + other.place, self.squares + other.squares
        )

    @property
    def rms(self) -> float:
        """Root mean square of the deviations. [mm]"""
        return float(np.sqrt(self.squares[6, 6] / self.count))

    def sentence(self) -> str:
        """That the part lies elsewhere, where that explains most of the deviations; else empty.

        Notes
        -----
        Least squares of d = n·(t + w × p) for a small shift t and turn w. Movements that the points
        do not show (of a plane along itself) are left out.
        """
        before = float(self.squares[6, 6])
        if self.rms <= _LARGE:
            return ""
        matrix, seen = self.squares[:6, :6], self.squares[:6, 6]
        length = np.sqrt(
            max(np.trace(matrix[3:, 3:]) / max(np.trace(matrix[:3, :3]), 1e-300), 1e-6)
        )
        scale = np.repeat([1.0, 1.0 / length], 3)
        values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
        kept = values > _SEEN * values[-1]
        along = vectors[:, kept]
        solution = scale * (along @ ((along.T @ (scale * seen)) / values[kept]))
        after = max(before - float(solution @ seen), 1e-12 * before)
        rank = int(kept.sum())
        spare = self.count - rank
        if spare < max(3, rank) or after > (1.0 - _SHARE) * before:
            return ""
        if (before - after) / rank < _RATIO * after / spare:
            return ""
        shift = solution[:3] + np.cross(solution[3:], self.place / self.count)
        turn = float(np.linalg.norm(solution[3:])) / DEGREE
        rms = [np.sqrt(square / self.count) / MICROMETRE for square in (before, after)]
        return (
            "this looks like a part that lies elsewhere: a shift of "
            f"{np.linalg.norm(shift):.3f} mm and a turn of {turn:.3f}° of the whole part reduce "
            f"the root mean square of the deviations from {rms[0]:.3g} to {rms[1]:.2g} µm. "
            "Align the part first, and give its placement"
        )
