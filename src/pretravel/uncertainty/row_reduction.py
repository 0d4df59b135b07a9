"""Many rows of a regression, reduced to as many as it has columns without loss.

Rows with the same variance can be turned among each other by any orthogonal matrix: what a
regression with these variances says stays the same. A triangle of as many rows as columns then
contains all that 100,000 rows say, and a likelihood that needs a matrix of all pairs of rows needs
one of all pairs of columns.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, IntArray

MOST_CLASSES = 64
"""Different variances that are kept apart; more of them are put into classes of similar ones."""
_ROWS = 2048  # of a block that is reduced at once


@dataclass(frozen=True, eq=False)
class ReducedRows:
    """Triangles of the rows of each class, one under the other.

    Attributes
    ----------
    rows : (r, p) float
        The last column is the value that the others explain.
    classes : (r,) int
        Of the rows.
    unexplained : (c,) float
        Sum of squares of the values of each class that no column explains at all.
    dof : (c,) float
        Rows that it stands for: those of the class less those that remain.
    """

    rows: FloatArray
    classes: IntArray
    unexplained: FloatArray
    dof: FloatArray

    @property
    def together(self) -> tuple[FloatArray, float, float]:
        """All classes as one: rows (p - 1, p), unexplained sum of squares, rows it stands for."""
        triangle = _triangle(self.rows)
        explained = self.rows.shape[1] - 1
        left = float(np.sum(triangle[explained:, -1] ** 2) + self.unexplained.sum())
        dof = float(self.dof.sum() + len(self.rows) - explained)
        return triangle[:explained], left, dof


def reduced_rows(blocks: Iterable[tuple[FloatArray, IntArray]], classes: int) -> ReducedRows:
    """Reduce rows that are given in blocks.

    Parameters
    ----------
    blocks : iterable of (rows (b, p), classes (b,))
        The last column of the rows is the value that the others explain.
    classes : int
        Number of classes; rows of one class have the same variance.

    Returns
    -------
    ReducedRows
        Of a class with fewer rows than columns the rows themselves. Memory: p² numbers for each
        class, whatever the number of rows.

    >>> rows = np.random.default_rng(1).standard_normal((1000, 3))
    >>> small = reduced_rows([(rows, np.zeros(1000, dtype=int))], 1)
    >>> small.rows.shape, bool(np.allclose(small.rows.T @ small.rows, (rows.T @ rows)
    ...     - np.diag([0, 0, small.unexplained[0]])))
    ((2, 3), True)
    """
    parts: list[list[FloatArray]] = [[] for _ in range(classes)]
    waiting, seen = np.zeros(classes, dtype=np.int64), np.zeros(classes, dtype=np.int64)
    width = 0
    for rows, of_rows in blocks:
        width = rows.shape[1]
        for number in np.unique(of_rows):
            own = rows[of_rows == number]
            parts[number].append(own)
            waiting[number] += len(own)
            seen[number] += len(own)
            if waiting[number] > _ROWS + width:
                parts[number] = [_triangle(np.concatenate(parts[number]))]
                waiting[number] = len(parts[number][0])
    kept, unexplained = [], np.zeros(classes)
    for number, own_parts in enumerate(parts):
        own = np.concatenate(own_parts) if own_parts else np.zeros((0, width))
        if seen[number] > width:
            own = _triangle(own)
            # Its last row is the part that no column explains.
            unexplained[number] = float(own[-1, -1] ** 2)
            own = own[:-1]
        kept.append(own)
    remaining = np.array([len(own) for own in kept])
    return ReducedRows(
        rows=np.concatenate(kept),
        classes=np.repeat(np.arange(classes), remaining),
        unexplained=unexplained,
        dof=(seen - remaining).astype(np.float64),
    )


def _triangle(rows: FloatArray) -> FloatArray:
    """R of a QR decomposition, (min(r, p), p)."""
    return np.asarray(np.linalg.qr(rows, mode="r"))


def classes_of(counts: FloatArray) -> tuple[FloatArray, IntArray]:
    """Classes of directions by their number of touches.

    Parameters
    ----------
    counts : (g,) float

    Returns
    -------
    count : (c,) float
        Of each class: the number itself, or where there are more than `MOST_CLASSES` different
        numbers the mean of similar ones.
    classes : (g,) int

    >>> count, classes = classes_of(np.array([3.0, 2.0, 3.0]))
    >>> count.tolist(), classes.tolist()
    ([2.0, 3.0], [1, 0, 1])
    """
    count, classes = np.unique(counts, return_inverse=True)
    if len(count) <= MOST_CLASSES:
        return np.asarray(count), np.asarray(classes.ravel(), dtype=np.int64)
    # Equal steps of the logarithm: a variance of the mean is then nowhere far from that of a class.
    steps = np.log(counts / count[0]) / np.log(count[-1] / count[0]) * (MOST_CLASSES - 1)
    _, classes = np.unique(np.round(steps), return_inverse=True)
    classes = classes.ravel()
    mean = np.bincount(classes, counts) / np.bincount(classes)
    return np.asarray(mean), np.asarray(classes, dtype=np.int64)
