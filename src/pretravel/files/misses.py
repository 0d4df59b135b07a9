"""Readings that are not contacts, where the file does not mark them: what stands in their place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import BoolArray, FloatArray
from pretravel.files.file_format import FilePositions, FileReadings, labels_or_numbers

_FILLED_IN = (999.0, 999.9, 999.99, 999.999, 9999.0, 9999.9, 9999.99, 9999.999, 99999.0, 999999.0)
"""Values that programs write in the place of a coordinate that was not measured. [file's unit]"""
_FEWEST = 5
_MOST = 0.2
"""Share of the readings above which the part has another level there."""
_MOST_AT_ONE_END = 0.45
"""The same of heights that are equal to the last digit, as the end of a move is."""
_FAR = 0.3
"""A height that is this far from the plane of the others is no deviation of a surface. [mm]"""
_TIMES = 50.0
"""Beyond this many times the scatter of the others."""
_MAD = 1.4826
_LARGEST_MACHINE = 20_000.0
"""Longer machines measure with other sensors. [mm]"""
_INSIDE = 0.3
"""A surface is not as far behind its nominal place as this at every touch. [mm]"""
_FEWEST_OTHERS = 3
"""One touch in three can be a miss."""
_ALIKE = 0.99
"""Cosine of normals of one plane."""
_ODD = 6.0
"""A height of 0 farther than this many standard deviations from the plane of the others is named:
by chance 4 % of the zeros next to five others with normal errors, 0.3 % next to nine."""
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
    one_end = far.sum() > 1 and np.ptp(heights[far]) == 0.0
    if not far.any() or np.mean(far) > (_MOST_AT_ONE_END if one_end else _MOST):
        return none
    return np.where(far, left, 0.0)


def named_misses(
    found: FileReadings | FilePositions, *, unmarked: bool = False
) -> FileReadings | FilePositions:
    """Readings without the values that were filled in, and with words about heights far off.

    Parameters
    ----------
    found : FileReadings or FilePositions
    unmarked : bool
        The format is that of a CMM, which marks no misses; others do, and the own form of a table,
        whose `Touches.reading` is empty, has none.

    Returns
    -------
    FileReadings or FilePositions
        Those that are filled in are no contacts; what is only far off stays, and is named.
    """
    found = _with_size_named(found)
    if isinstance(found, FilePositions):
        contact = np.array(found.contact or (True,) * len(found.positions))
        filled = missed_rows(found.positions) & contact
        if filled.any() and not (filled | ~contact).all():
            contact &= ~filled
            found = replace(found, contact=tuple(contact.tolist()))
        told = far_sentence(
            found.positions[contact],
            [found.lines[i] for i in np.flatnonzero(contact)],
            labels=_labels_at(found.labels, contact),
        )
        return replace(found, warnings=(*found.warnings, *told))
    touches = found.touches
    filled = missed_rows(touches.positions) & (bool(touches.reading) or unmarked)
    if filled.any() and not filled.all():
        names = labels_or_numbers(touches.labels, len(touches))
        missed = tuple(names[row] for row in np.flatnonzero(filled))
        kept = replace(touches, labels=tuple(names)).take(~filled)
        found = replace(found, touches=kept, missed=(*found.missed, *missed))
        touches = kept
    lines = touches.lines or tuple(range(1, len(touches) + 1))
    if touches.nominal_points is not None:
        if len(touches) > 1 and np.array_equal(touches.positions, touches.nominal_points):
            said = "each position equals its nominal point: was anything measured?"
            return replace(found, warnings=(*found.warnings, said))
        along = np.sum((touches.positions - touches.nominal_points) * touches.normals, axis=1)
        if told := _far_from_nominal(along, lines):
            return replace(found, warnings=(*found.warnings, *told))
    same = float(np.ptp(touches.normals, axis=0).max()) < 1e-6
    axis = int(np.argmax(np.abs(touches.normals[0])))
    told = far_sentence(
        touches.positions, lines, axis if same else None, touches.labels, touches.normals
    )
    return replace(found, warnings=(*found.warnings, *told)) if told else found


def _with_size_named(found: FileReadings | FilePositions) -> FileReadings | FilePositions:
    """Readings with words about coordinates that no machine reaches."""
    positions = found.positions if isinstance(found, FilePositions) else found.touches.positions
    size = float(np.median(np.abs(positions).max(axis=1))) if len(positions) else 0.0
    if size < _LARGEST_MACHINE:
        return found
    said = (
        f"the coordinates are up to {size:.6g} mm, beyond any machine: are they in µm or steps, or "
        "numbers without their decimal point?"
    )
    return replace(found, warnings=(*found.warnings, said))


def _far_from_nominal(along: FloatArray, lines: Sequence[int]) -> tuple[str, ...]:
    """A sentence about touches that lie elsewhere on their normals than the others. [mm]"""
    if bool((along < -_INSIDE).all()):
        where = f"every touch lies behind its nominal surface, by {-np.median(along):.3g} mm"
        why = "do the normals point into the part, or are the nominal points those of another one?"
        return (f"{where}: {why}",)
    left = along - np.median(along)
    scatter = _MAD * float(np.median(np.abs(left)))
    rows = np.flatnonzero(np.abs(left) > max(_FAR, _TIMES * scatter))
    if not len(rows) or len(rows) > len(along) / _FEWEST_OTHERS:
        return ()
    named = ", ".join(f"line {lines[row]} ({left[row]:+.3f} mm)" for row in rows[:_SHOWN])
    said = "along the normal, the distance from the nominal point differs from that of the others"
    why = "Is it a miss (the end of a move) or a gross error? If so, leave it out"
    return (f"{said}: {named}. {why}",)


def _labels_at(labels: Sequence[str] | None, rows: BoolArray) -> Sequence[str] | None:
    return None if labels is None else [labels[int(row)] for row in np.flatnonzero(rows)]


def far_sentence(
    positions: FloatArray,
    lines: Sequence[int],
    axis: int | None = 2,
    labels: Sequence[str] | None = None,
    normals: FloatArray | None = None,
) -> tuple[str, ...]:
    """A sentence that names positions far from the others; none where there are none.

    Of heights (`axis`) far from their plane, of others far from the bore, sphere or plane that the
    others show.
    """
    left = np.zeros(len(positions)) if axis is None else far_heights(positions, axis)
    rows = np.flatnonzero(left)
    if len(rows):
        off = {int(row): float(left[row]) for row in rows}
        return (_far_words("height is", "heights are", "plane", off, lines),)
    if axis is not None and (odd := odd_zeros(positions, axis)):
        shown = ", ".join(str(lines[row]) for row in odd[:_SHOWN])
        said = "is exactly 0, apart from the others: was it probed? If not, leave it out"
        return (f"the height of line {shown} {said}",)
    from pretravel.measurement import missed_points_of_features

    return tuple(
        _far_words(
            "position is",
            "positions are",
            kind,
            dict(zip(found.rows, found.off, strict=True)),
            lines,
        )
        for kind, found in missed_points_of_features(positions, labels)
        if normals is None or not _is_other_face(normals, found.rows)
    )


def _is_other_face(normals: FloatArray, rows: Sequence[int]) -> bool:
    """Whether several touches have one normal, which none of the others has: another face."""
    own = normals[list(rows)]
    others = np.delete(normals, list(rows), axis=0)
    return len(own) > 1 and bool((own @ own[0]).min() > _ALIKE > (others @ own[0]).max())


def odd_zeros(positions: FloatArray, axis: int) -> list[int]:
    """Rows, but the first, whose height is 0 to the last digit, apart from a plane of the others.

    The first height of a grid is 0 where the grid was zeroed there.

    >>> z = [0.012, 0.011, 0.013, 0.0, 0.012, 0.011]
    >>> odd_zeros(np.array([[0, 0, z[0]], [9, 0, z[1]], [0, 9, z[2]], [9, 9, z[3]], [5, 5, z[4]],
    ...     [5, 0, z[5]]]), 2)
    [3]
    """
    zero = positions[:, axis] == 0.0
    others = np.flatnonzero(~zero)
    if not zero.any() or zero[0] or len(others) < _FEWEST or np.mean(zero) > _MOST:
        return []
    across = np.delete(positions, axis, axis=1)
    rows = np.column_stack([np.ones(len(across)), across - across.mean(axis=0)])
    plane, _, rank, _ = np.linalg.lstsq(rows[others], positions[others, axis], rcond=None)
    left = positions[:, axis] - rows @ plane
    scatter = float(np.sqrt(np.sum(left[others] ** 2) / max(len(others) - rank, 1)))
    return [int(row) for row in np.flatnonzero(zero) if abs(left[row]) > _ODD * scatter]


def _far_words(
    one: str, several: str, kind: str, off: Mapping[int, float], lines: Sequence[int]
) -> str:
    named = ", ".join(
        f"that of line {lines[row]} ({left:+.3f} mm)" for row, left in list(off.items())[:_SHOWN]
    )
    more = "…" if len(off) > _SHOWN else ""
    return (
        f"{len(off)} {one if len(off) == 1 else several} far from the {kind} of the others: "
        f"{named}{more}. Is it a miss (the end of a move) or a gross error? If so, leave it "
        "out"
    )
