"""Rows of a file that each stand there several times, one after the other: a log of copies."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pretravel.qualification import fewest_copies, quantisation_step

EACH_ROW = "each row stands there "
"""The start of what is said of them."""


def rows_in_a_row(values: npt.ArrayLike) -> int:
    """How often each row stands there, one after the other and alike to the last digit.

    Parameters
    ----------
    values : (n, k) float
        Positions of touches, or their readings. [mm]

    Returns
    -------
    int
        One where rows differ, or too few are alike for steps of this length.

    >>> log = np.random.default_rng(1).random((5, 3))
    >>> rows_in_a_row(np.repeat(log, 3, axis=0)), rows_in_a_row(log)
    (3, 1)
    """
    rows = np.asarray(values, dtype=np.float64)
    if len(rows) < 2:
        return 1
    differs = np.flatnonzero(np.any(rows[1:] != rows[:-1], axis=1)) + 1
    lengths = np.diff(np.concatenate([[0], differs, [len(rows)]]))
    often = int(lengths[0])
    copies = len(rows) - len(lengths)
    if often == 1 or np.any(lengths != often):
        return 1
    return often if copies >= fewest_copies(quantisation_step(rows)) else 1


def rows_in_a_row_warnings(values: npt.ArrayLike) -> list[str]:
    """A warning where each row stands there several times; none where they do not.

    Parameters
    ----------
    values : (n, k) float
        As of `rows_in_a_row`.

    >>> log = np.random.default_rng(1).random((5, 3))
    >>> rows_in_a_row_warnings(np.repeat(log, 2, axis=0))[0][:49]
    'each row stands there 2 times, to the last digit:'
    """
    often = rows_in_a_row(values)
    if often == 1:
        return []
    return [
        (
            f"{EACH_ROW}{often} times, to the last digit: copies, not repeats. They count as "
            "touches of their own and make scatter and u too small: give each row once"
        )
    ]
