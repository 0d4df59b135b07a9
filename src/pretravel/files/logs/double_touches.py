"""Places that were touched twice, fast to find them and then slowly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import BoolArray, FloatArray, InputError
from pretravel.files.file_format import FilePositions, FileReadings

_ONE_PLACE = 1.0
"""The two touches of a place differ by less: 3000 mm/min for 10 ms are 0.5 mm. [mm]"""
_SLOWER = 0.95
"""A feed below this share of the one before is slower."""


def without_searches(found: FileReadings | FilePositions) -> FileReadings | FilePositions:
    """Keep the last touch of each place that was touched twice, one after the other.

    Where the feeds are known, a touch is left out if the next one is slower at the same place. Else
    the touches must be pairs, and the second one of each is kept.

    Parameters
    ----------
    found : FileReadings or FilePositions

    Returns
    -------
    FileReadings or FilePositions

    Raises
    ------
    InputError
        Feeds are not known, and a touch has no second one at its place.

    >>> log = FilePositions("a.log", np.array([[0, 0, 5.07], [0, 0, 5.0]]), (3, 5))
    >>> without_searches(log).lines
    (5,)
    """
    if isinstance(found, FileReadings):
        touches = found.touches
        lines = touches.lines or tuple(range(1, len(touches) + 1))
        keep = _last_ones(touches.positions, touches.feeds, None, lines, touches.source or "")
        told = (*found.warnings, _left_out(keep))
        return replace(found, touches=touches.take(keep), warnings=told)
    keep = _last_ones(found.positions, found.feeds, found.contact, found.lines, found.path)
    rows = np.flatnonzero(keep)
    return replace(
        found,
        positions=found.positions[rows],
        lines=tuple(found.lines[row] for row in rows),
        contact=None if found.contact is None else tuple(found.contact[row] for row in rows),
        labels=None if found.labels is None else tuple(found.labels[row] for row in rows),
        feeds=None if found.feeds is None else found.feeds[rows],
        spindle=None if found.spindle is None else found.spindle[rows],
        understood="; ".join(filter(None, (found.understood, _left_out(keep)))),
    )


def _left_out(keep: BoolArray) -> str:
    count = int(np.sum(~keep))
    return f"{count} fast touch{'es' if count != 1 else ''} before slow ones left out"


def follows_its_search(
    positions: FloatArray, feeds: FloatArray | None, contact: Sequence[bool] | None = None
) -> BoolArray:
    """Whether each touch is slower than the one before, at the same place, (n,).

    Parameters
    ----------
    positions : (n, 3) float
        [mm]
    feeds : (n,) float or None
        [mm/min]
    contact : n bool, optional

    >>> follows_its_search(np.array([[0, 0, 5.07], [0, 0, 5.0]]), np.array([500, 100])).tolist()
    [False, True]
    """
    follows = np.zeros(len(positions), dtype=bool)
    if feeds is None or len(positions) < 2:
        return follows
    near = np.linalg.norm(np.diff(positions, axis=0), axis=1) < _ONE_PLACE
    touched = np.ones(len(positions), bool) if contact is None else np.array(contact, dtype=bool)
    follows[1:] = near & (feeds[1:] < _SLOWER * feeds[:-1]) & touched[1:] & touched[:-1]
    return follows


def _last_ones(
    positions: FloatArray,
    feeds: FloatArray | None,
    contact: Sequence[bool] | None,
    lines: Sequence[int],
    path: str,
) -> BoolArray:
    keep = np.ones(len(positions), dtype=bool)
    if feeds is not None:
        keep[:-1] = ~follows_its_search(positions, feeds, contact)[1:]
        return keep
    touched = [row for row in range(len(positions)) if contact is None or contact[row]]
    while touched:
        first, second = touched[0], touched[1] if len(touched) > 1 else touched[0]
        far = float(np.linalg.norm(positions[second] - positions[first]))
        if first == second or far >= _ONE_PLACE:
            raise InputError(
                "this touch has no second one after it at its place, and the file states no feeds: "
                "touches are in pairs where each place was touched twice",
                path=path,
                line=lines[first],
                inputs=("double_touches",),
            )
        keep[first] = False
        touched = touched[2:]
    return keep
