"""Readings that are no contacts, where the file does not mark them: what stands in their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import BoolArray, FloatArray
from pretravel.files.file_format import FilePositions, FileReadings, labels_or_numbers

_FILLED_IN = (999.0, 999.9, 999.99, 999.999, 9999.0, 9999.9, 9999.99, 9999.999, 99999.0, 999999.0)
"""Values that programs write in the place of a coordinate that was not measured. [file's unit]"""
_FEWEST = 5
_MOST = 0.2
"""Share of the readings above which the part has another level there."""
_FAR = 0.3
"""A height that is this far from the plane of the others is no deviation of a surface. [mm]"""
_TIMES = 50.0
"""Beyond this many times the scatter of the others."""
_MAD = 1.4826
_ROUNDS = 20
_SHOWN = 5


def filled_in(values: FloatArray) -> BoolArray:
    """Whether each value is one that programs write where nothing was measured.

    >>> filled_in(np.array([-9999.0, 9.0])).tolist()
    [True, False]
    """
    return np.asarray(np.isin(np.round(np.abs(values), 3), _FILLED_IN))


def missed_rows(positions: FloatArray) -> BoolArray:
    """Whether a value was filled in for each position (n, 3), instead of a contact.

    Filled in are -9999 and the like, and 0, 0, 0 away from all others or more than once.

    >>> missed_rows(np.array([[1.0, 2, 3], [1, 2, -9999], [1.1, 2, 3], [0, 0, 0]])).tolist()
    [False, True, False, True]
    """
    filled = filled_in(positions).any(axis=1)
    zero = ~positions.any(axis=1)
    others = positions[~(filled | zero)]
    if zero.any() and len(others) >= 2:
        outside = (others.min(axis=0) > 0.0) | (others.max(axis=0) < 0.0)
        filled |= zero & bool(np.sum(zero) > 1 or np.sum(outside) > 1 or _stands_twice(others))
    return np.asarray(filled)


def _stands_twice(others: FloatArray) -> bool:
    """Whether a grid, each of whose places was touched once, has its touch at x = y = 0 already."""
    places = others[:, :2]
    once = len(np.unique(places, axis=0)) == len(places) >= _FEWEST
    return bool(once and (~places.any(axis=1)).any())


def far_heights(positions: FloatArray, axis: int = 2) -> FloatArray:
    """How far each position is from the plane of most of the others, along an axis, (n,). [mm]

    Zero where it is not far, and for all where they do not lie about a plane.

    >>> z = np.array([0.012, 0.013, 0.011, 0.014, -2.5, 0.012, 0.010, 0.013, 0.015])
    >>> x, y = np.meshgrid([0.0, 10.0, 20.0], [0.0, 10.0, 20.0])
    >>> far_heights(np.column_stack([x.ravel(), y.ravel(), z])).nonzero()[0].tolist()
    [4]
    """
    count = len(positions)
    none = np.zeros(count)
    if count < _FEWEST:
        return none
    heights = positions[:, axis]
    across = np.delete(positions, axis, axis=1)
    across = across - across.mean(axis=0)
    across = across / max(float(np.abs(across).max()), 1e-9)
    rows = np.column_stack([np.ones(count), across])
    weights: FloatArray = np.ones(count)
    left = heights - np.median(heights)
    for _ in range(_ROUNDS):  # least absolute deviations by weights
        weights = 1.0 / np.maximum(np.abs(left), 1e-4)
        weighted = rows * weights[:, None]
        fitted = np.linalg.lstsq(weighted.T @ rows, weighted.T @ heights, rcond=1e-9)[0]
        left = heights - rows @ fitted
    scatter = _MAD * float(np.median(np.abs(left)))
    far = np.abs(left) > max(_FAR, _TIMES * scatter)
    if not far.any() or np.mean(far) > _MOST:
        return none
    return np.where(far, left, 0.0)


def named_misses(found: FileReadings | FilePositions) -> FileReadings | FilePositions:
    """Readings without the values that were filled in, and with words about heights far off.

    Parameters
    ----------
    found : FileReadings or FilePositions

    Returns
    -------
    FileReadings or FilePositions
        Those that are filled in are no contacts; what is only far off stays, and is named.
    """
    if isinstance(found, FilePositions):
        contact = np.array(found.contact or (True,) * len(found.positions))
        filled = missed_rows(found.positions) & contact
        if filled.any() and not (filled | ~contact).all():
            contact &= ~filled
            found = replace(found, contact=tuple(contact.tolist()))
        told = far_sentence(
            found.positions[contact], [found.lines[i] for i in np.flatnonzero(contact)]
        )
        return replace(found, warnings=(*found.warnings, *told))
    touches = found.touches
    # Other formats mark their misses, and the own form of a table has none.
    filled = missed_rows(touches.positions) & bool(touches.reading)
    if filled.any() and not filled.all():
        names = labels_or_numbers(touches.labels, len(touches))
        missed = tuple(names[row] for row in np.flatnonzero(filled))
        kept = replace(touches, labels=tuple(names)).take(~filled)
        found = replace(found, touches=kept, missed=(*found.missed, *missed))
        touches = kept
    lines = touches.lines or tuple(range(1, len(touches) + 1))
    same = float(np.ptp(touches.normals, axis=0).max()) < 1e-6
    axis = int(np.argmax(np.abs(touches.normals[0])))
    told = far_sentence(touches.positions, lines, axis) if same else ()
    return replace(found, warnings=(*found.warnings, *told)) if told else found


def far_sentence(positions: FloatArray, lines: Sequence[int], axis: int = 2) -> tuple[str, ...]:
    """A sentence that names heights far from the others; none where there are none."""
    left = far_heights(positions, axis)
    rows = np.flatnonzero(left)
    if not len(rows):
        return ()
    named = ", ".join(
        f"that of line {lines[row]} ({left[row]:+.3f} mm)" for row in rows[:_SHOWN].tolist()
    )
    more = "…" if len(rows) > _SHOWN else ""
    what = "height is" if len(rows) == 1 else "heights are"
    sentence = (
        f"{len(rows)} {what} far from the plane of the others: {named}{more}. A miss, which ends "
        "where its move ended, or a gross error? Leave it out, if so"
    )
    return (sentence,)
