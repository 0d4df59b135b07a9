"""Places that were touched twice, fast to find them and then slowly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import BoolArray, FloatArray, InputError
from pretravel.files.file_format import FilePositions, FileReadings

_ONE_PLACE = 1.0
"""The two touches of a place differ by less: 3000 mm/min for 10 ms are 0.5 mm. [mm]"""
_FEWEST_PAIRS = 4
_TO_ASK = 2
"""Of fewer pairs nothing is said; of fewer than `_FEWEST_PAIRS` it is asked."""
_APART = 0.005
"""First and second touches of places that differ by less are repeats: the steps of positions and
the noise of a probe are smaller. [mm]"""
_ALIKE = 1.0 / 3.0
"""Standard deviation of the differences, over their mean, below which they are one difference."""
_ONE_WAY = 0.99
"""Cosine between directions of travel below which they are two."""
_TIMES = 5.0
"""The first touch of several at a place is another pass from this many times the noise."""
_SLOWER = 0.95
"""A feed below this share of the one before is slower."""


def without_searches(found: FileReadings | FilePositions) -> FileReadings | FilePositions:
    """Keep the last touch of each place that was touched twice, one after the other.

    Where the feeds are known, a touch is left out if the next one is slower at the same place. Else
    the touches must be pairs, and the second one of each is kept; or each place was touched three
    times (five …), and the last one of each is kept.

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
        left_out = _left_out(keep, by_feeds=touches.feeds is not None)
        told = (*found.warnings, left_out)
        return replace(found, touches=touches.take(keep), warnings=told)
    keep = _last_ones(found.positions, found.feeds, found.contact, found.lines, found.path)
    left_out = _left_out(keep, by_feeds=found.feeds is not None)
    understood = "; ".join(filter(None, (found.understood, left_out)))
    return replace(found.take(keep), understood=understood)


def _left_out(keep: BoolArray, *, by_feeds: bool) -> str:
    count = int(np.sum(~keep))
    touches = f"touch{'es' if count != 1 else ''}"
    if not by_feeds:
        return f"{count} earlier {touches} of their places left out"
    return f"{count} fast {touches} before slow ones left out"


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


def with_passes(
    found: FileReadings | FilePositions, *, asks: bool = True
) -> FileReadings | FilePositions:
    """Readings with their passes, where places were touched twice: fast to find them, then slowly.

    The feeds distinguish the passes. Where they are not known, the positions do: the first touches
    of at least `_FEWEST_PAIRS` pairs all lie on one side of the second ones, by about the same. Of
    fewer a warning asks, where `asks`.

    >>> pairs = np.array([[0, 0, 5.0 + 0.04 * (row % 2)] for row in range(8)])
    >>> with_passes(FilePositions("a.log", pairs, tuple(range(8)))).words["pass"][:2]
    ('first', 'second')
    """
    rows = found if isinstance(found, FilePositions) else found.touches
    if "pass" in rows.words:
        return found
    contact = found.contact if isinstance(found, FilePositions) else None
    if _turns(rows.approaches):
        return found  # both directions of an axis are no passes
    if rows.feeds is not None:
        if not isinstance(found, FilePositions):
            return found  # the feed of each touch says it
        names = _passes_of_feeds(rows.positions, rows.feeds, contact)
    else:
        normals = None if isinstance(found, FilePositions) else found.touches.normals
        names = _passes_of_places(rows.positions, normals, contact)
    if not names:
        return _with_few_pairs(found, contact) if asks else found
    if isinstance(found, FilePositions):
        return replace(found, words={**found.words, "pass": names})
    return replace(found, touches=replace(found.touches, passes=names))


def _with_few_pairs(
    found: FileReadings | FilePositions, contact: Sequence[bool] | None
) -> FileReadings | FilePositions:
    """Readings with a question where two or three places look as if touched fast, then slowly."""
    rows = found if isinstance(found, FilePositions) else found.touches
    if rows.feeds is not None:
        return found
    normals = None if isinstance(found, FilePositions) else found.touches.normals
    names = _passes_of_places(rows.positions, normals, contact, _TO_ASK)
    if not names:
        return found
    places = sum(each == "first" for each in names)
    first = np.array(names) == "first"
    # Touches follow the first one of their place.
    away = rows.positions - rows.positions[first][np.cumsum(first) - 1]
    apart = 1e3 * float(np.linalg.norm(away[~first], axis=1).mean())
    asked = (
        f"at each of {places} places the first touch lies about {apart:.1f} µm from the next, to "
        "the same side, as after a fast touch that only finds the place. So few touches do not "
        "decide this, and all are used. If the first ones are fast, keep the last touch of each "
        "place, or give the feeds"
    )
    return replace(found, warnings=(*found.warnings, asked))


def without_passes(found: FileReadings | FilePositions) -> FileReadings | FilePositions:
    """Readings of one pass, without the words that named several."""
    if isinstance(found, FilePositions):
        words = {name: each for name, each in found.words.items() if name != "pass"}
        return replace(found, words=words)
    return replace(found, touches=replace(found.touches, passes=None))


def _turns(directions: FloatArray | None) -> bool:
    """Whether the two touches of each pair went in other directions."""
    if directions is None or len(directions) < 2:
        return False
    pairs = len(directions) // 2 * 2
    return bool(np.all(np.sum(directions[0:pairs:2] * directions[1:pairs:2], axis=1) < _ONE_WAY))


def _passes_of_feeds(
    positions: FloatArray, feeds: FloatArray, contact: Sequence[bool] | None
) -> tuple[str, ...]:
    slow = follows_its_search(positions, feeds, contact)
    if not slow.any():
        return ()
    fast = np.append(slow[1:], False) & ~slow
    between = 0.5 * (float(feeds[slow].max()) + float(feeds[fast].min()))
    slow |= ~fast & (feeds <= between)
    return tuple("slow" if on else "fast" for on in slow)


def _passes_of_places(
    positions: FloatArray,
    normals: FloatArray | None,
    contact: Sequence[bool] | None,
    fewest: int = _FEWEST_PAIRS,
) -> tuple[str, ...]:
    count = len(positions)
    touched = contact is None or all(contact)
    if touched and (names := _first_of_several(positions, normals, fewest)):
        return names
    if not touched or count < 2 * fewest or count % 2:
        return ()
    step = positions[1:] - positions[:-1]
    within, between = step[::2], step[1::2]
    near = np.linalg.norm(within, axis=1) < _ONE_PLACE
    if not near.all():
        return ()
    if normals is None:
        axis = int(np.argmax(np.median(np.abs(within), axis=0)))
        signs = np.sign(np.median(within[:, axis]))
        along, back = signs * within[:, axis], signs * between[:, axis]
    else:
        along = np.sum(within * normals[::2], axis=1)
        sign = np.sign(np.median(along))
        along, back = sign * along, sign * np.sum(between * normals[1:-1:2], axis=1)
    same_place = np.linalg.norm(between, axis=1) < _ONE_PLACE
    turns_back = bool(np.all(back[same_place] < 0.0))
    apart = float(np.median(along)) > _APART and float(np.std(along)) < _ALIKE * float(along.mean())
    if not (along.min() > 0.0 and apart and turns_back):
        return ()
    return ("first", "second") * (count // 2)


def _first_of_several(
    positions: FloatArray, normals: FloatArray | None, fewest: int
) -> tuple[str, ...]:
    """Passes of places that were touched three times or more, first fast; empty: none are."""
    count = len(positions)
    far = np.linalg.norm(np.diff(positions, axis=0), axis=1) >= _ONE_PLACE
    size = int(np.argmax(far)) + 1 if far.any() else 0
    places = count // size if size > 2 and count % size == 0 else 0
    ends = np.arange(1, count) % size == 0 if places else far
    if places < fewest or not np.array_equal(far, ends):
        return ()
    of = positions.reshape(places, size, 3)
    later = of[:, 1:]
    away = of[:, 0] - later.mean(axis=1)
    if normals is None:
        axis = int(np.argmax(np.median(np.abs(away), axis=0)))
        along, within = away[:, axis], later[:, :, axis]
    else:
        outward = normals.reshape(places, size, 3)
        along = np.sum(away * outward[:, 0], axis=1)
        within = np.sum(later * outward[:, 1:], axis=2)
    step, noise = abs(float(along.mean())), float(np.sqrt(within.var(axis=1, ddof=1).mean()))
    alike = float(np.std(along)) < _ALIKE * step and bool(np.all(along * along.mean() > 0.0))
    if step <= max(_APART, _TIMES * noise) or not alike:
        return ()
    return (("first",) + ("second",) * (size - 1)) * places


def _odd_size(positions: FloatArray) -> int:
    """How often each place was touched in turn, where the number is the same and odd; otherwise 0.

    Of an even number, half can be searches: they are pairs.
    """
    apart = np.linalg.norm(np.diff(positions, axis=0), axis=1) >= _ONE_PLACE
    ends = np.concatenate([[-1], np.flatnonzero(apart), [len(positions) - 1]])
    sizes = set(np.diff(ends).tolist())
    size = int(sizes.pop())
    return size if not sizes and size > 1 and size % 2 else 0


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
    size = _odd_size(positions[touched])
    if size:
        keep[[row for place, row in enumerate(touched) if (place + 1) % size]] = False
        return keep
    while touched:
        first, second = touched[0], touched[1] if len(touched) > 1 else touched[0]
        far = float(np.linalg.norm(positions[second] - positions[first]))
        if first == second or far >= _ONE_PLACE:
            raise InputError(
                "this touch is not followed by a second touch of the same place. The file has no "
                "feeds: each place needs a pair of touches, first fast, then slow",
                path=path,
                line=lines[first],
                inputs=("double_touches",),
            )
        keep[first] = False
        touched = touched[2:]
    return keep
