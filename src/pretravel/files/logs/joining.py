"""Joining: positions that a control latched, matched with the plan that it ran."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.base.arrays import BoolArray, FloatArray, IntArray
from pretravel.base.errors import InputError
from pretravel.files.file_format import FilePositions, FileReadings, labels_or_numbers
from pretravel.probing.targets import Targets
from pretravel.touches import Touches

ACROSS = 0.05
"""A position further than this from the line of a target does not belong to it. [mm]"""
ALONG = 10.0
"""A position further than this from a target along its line does not belong to it. [mm]"""
AT_THE_END = 0.02
"""A position this close to the end of its move is a miss, where contacts are not marked. [mm]"""

_NEAR, _FAR_RATIO, _SMALLEST = 1.0, 3.0, 0.3
"""Where lines cross, the nearest target is taken if its distance is below `_NEAR` and the next
distance is above `_FAR_RATIO` times it; a smaller distance counts as `_SMALLEST`. [mm, –, mm]"""
_OUTLYING = 0.5
"""A position this much further along its line than the median is named in a warning. [mm]"""
_SHOWN = 10
"""Most labels that a message shows."""
_NO_TARGET = -1
"""Stands for the row of the plan of a miss that lies on no target's line."""


def join(
    found: FilePositions, plan: Targets, tip_radius: float, *, overtravel: float | None = None
) -> FileReadings:
    """Join positions with a plan: each belongs to the target on whose line it lies.

    Nothing is counted: positions can be in any order, and some can be absent.

    Parameters
    ----------
    found : FilePositions
    plan : Targets
        The targets that were run, in the same coordinates. Targets of the same place and direction
        are repeats; they take positions in turn.
    tip_radius : float
        [mm]
    overtravel : float, optional
        Distance from the nominal surface to the end of each move. A position there is a miss,
        where the file does not mark the contacts. [mm]

    Returns
    -------
    FileReadings

    Raises
    ------
    InputError
        A position belongs to no target or to several; a target has more positions than repeats;
        no position is a contact. The message contains the line.

    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], labels=("top",))
    >>> found = join(FilePositions("a.log", np.array([[0.0, 0.0, 2.99]]), (1,)), up, 3.0)
    >>> found.touches.labels
    ('top',)
    """
    lines = _lines_of(plan, tip_radius, found.path)
    owners, beyond = _owners(found, lines)
    contact = _contacts(found, beyond, overtravel)
    if not np.any(contact):
        raise InputError("none of the readings is a contact", path=found.path)
    rows = np.flatnonzero(contact)
    warnings = _absent(lines, owners) + _misses_elsewhere(found, owners)
    if found.contact is None and overtravel is None:
        warnings.append(_possible_misses(lines, owners, beyond))
    return FileReadings(
        _touches(found, plan, lines, owners[rows], rows),
        missed=tuple(lines.labels[owner] for owner in owners[~contact] if owner != _NO_TARGET),
        warnings=tuple(warnings),
        unfinished=_untouched(lines, owners),
    )


@dataclass(frozen=True, eq=False)
class _TargetLines:
    """The lines along which the tip's centre approached; repeats share one.

    Attributes
    ----------
    centers : (k, 3) float
        Tip centre in contact with each target. [mm]
    directions : (k, 3) float
    repeats : k tuples of int
        Rows of the plan that share the line.
    labels : tuple of str
        Of the plan.
    """

    centers: FloatArray
    directions: FloatArray
    repeats: tuple[tuple[int, ...], ...]
    labels: tuple[str, ...]

    def label(self, line: int) -> str:
        """Label of the first of a line's repeats."""
        return self.labels[self.repeats[line][0]]


def _lines_of(plan: Targets, tip_radius: float, path: str) -> _TargetLines:
    labels = labels_or_numbers(plan.labels, len(plan))
    if len(set(labels)) < len(labels):
        twice = Counter(labels).most_common(1)[0][0]
        raise InputError(f"the plan has two targets called '{twice}'", path=path)
    approaches = np.asarray(plan.approaches)
    keys = np.round(np.hstack([plan.points, plan.normals, approaches]), 6)
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    repeats: list[list[int]] = [[] for _ in first]
    for target, line in enumerate(group.ravel().tolist()):
        repeats[line].append(target)
    centers = plan.points + tip_radius * plan.normals
    return _TargetLines(
        centers[first], approaches[first], tuple(tuple(rows) for rows in repeats), labels
    )


def _owners(found: FilePositions, lines: _TargetLines) -> tuple[IntArray, FloatArray]:
    """Return for each position its row of the plan, and its distance beyond the target. [mm]

    A control can report any position for a miss, for example zeros.
    """
    from scipy.spatial import cKDTree

    reach = float(np.hypot(ALONG, ACROSS))
    tree = cKDTree(lines.centers)
    waiting = [list(rows) for rows in lines.repeats]
    owners, beyond = [], []
    for row, position in enumerate(found.positions):
        near = np.sort(np.asarray(tree.query_ball_point(position, reach), dtype=np.int64))
        stated_miss = found.contact is not None and not found.contact[row]
        try:
            if stated_miss and not len(near):
                raise found.error("a miss far from all targets", row)
            line, along = _line_through(found, row, lines, near)
        except InputError:
            if not stated_miss:
                raise
            owners.append(_NO_TARGET)
            beyond.append(np.nan)
            continue
        if not waiting[line]:
            raise found.error(
                f"the target {lines.label(line)} has more readings than the plan has touches of "
                "it: is this the log of two runs?",
                row,
            )
        owners.append(waiting[line].pop(0))
        beyond.append(along)
    return np.array(owners, dtype=np.int64), np.array(beyond)


def _line_through(
    found: FilePositions, row: int, lines: _TargetLines, near: IntArray
) -> tuple[int, float]:
    """Return the line on which a position lies, and its distance beyond the target. [mm]

    `near` are the lines whose targets are within reach.
    """
    position = found.positions[row]
    place = ", ".join(f"{value:.4f}" for value in position)
    if not len(near):
        near = np.arange(len(lines.centers))
    seen = position - lines.centers[near]
    along = np.sum(seen * lines.directions[near], axis=1)
    across = np.linalg.norm(seen - along[:, None] * lines.directions[near], axis=1)
    which = np.flatnonzero((across < ACROSS) & (np.abs(along) < ALONG))
    if len(which) == 0:
        nearest = int(np.argmin(across + np.maximum(np.abs(along) - ALONG, 0.0)))
        raise found.error(
            f"the reading ({place}) mm lies on the line of no target; the nearest is "
            f"{lines.label(near[nearest])}, {across[nearest]:.3f} mm beside it. Is this the plan "
            "that was run, in the same work offset and units?",
            row,
            inputs=("plan", "units"),
        )
    if len(which) > 1:
        which = _much_nearer(which, along)
    if len(which) > 1:
        names = ", ".join(lines.label(near[i]) for i in which[:3])
        raise found.error(
            f"the reading ({place}) mm can belong to several targets ({names}); only a log with "
            "labels can distinguish them",
            row,
        )
    return int(near[which[0]]), float(along[which[0]])


def _much_nearer(which: IntArray, along: FloatArray) -> IntArray:
    """Where lines cross: return the line whose target is much nearer, or all lines."""
    order = which[np.argsort(np.abs(along[which]))]
    near, next_ = np.abs(along[order[:2]])
    decided = near < _NEAR and next_ > _FAR_RATIO * max(near, _SMALLEST)
    return order[:1] if decided else which


def _contacts(found: FilePositions, beyond: FloatArray, overtravel: float | None) -> BoolArray:
    """Return which positions are contacts: as the file marks them, or before the move's end."""
    if found.contact is not None:
        return np.array(found.contact, dtype=bool)
    if overtravel is not None:
        return beyond < overtravel - AT_THE_END
    return np.ones(len(beyond), dtype=bool)


def _touches(
    found: FilePositions, plan: Targets, lines: _TargetLines, owners: IntArray, rows: IntArray
) -> Touches:
    """Return the touches of some rows of the positions; `owners` are their rows of the plan."""
    return Touches(
        positions=found.positions[rows],
        normals=plan.normals[owners],
        approaches=np.asarray(plan.approaches)[owners],
        labels=tuple(lines.labels[owner] for owner in owners),
        nominal_points=plan.points[owners],
        source=Path(found.path).name,
        lines=tuple(found.lines[row] for row in rows),
    )


def _absent(lines: _TargetLines, owners: IntArray) -> list[str]:
    """Return a warning about the touches of the plan that have no position."""
    seen = set(owners.tolist())
    absent = [lines.labels[row] for rows in lines.repeats for row in rows if row not in seen]
    if not absent:
        return []
    shown = ", ".join(absent[:_SHOWN]) + ("…" if len(absent) > _SHOWN else "")
    warning = (
        f"{len(absent)} touches of the plan have no reading: {shown}. (A control may leave out a "
        "reading that equals the one before; or the run ended early.)"
    )
    return [warning]


def _untouched(lines: _TargetLines, owners: IntArray) -> str:
    """What is missing of the plan; a control leaves out repeats that are equal, but no target."""
    seen = set(owners.tolist())
    empty = [rows for rows in lines.repeats if not seen.intersection(rows)]
    if not empty:
        return ""
    return f"{len(empty)} of {len(lines.repeats)} places of the plan have no reading"


def _misses_elsewhere(found: FilePositions, owners: IntArray) -> list[str]:
    """Return a warning about stated misses whose position tells no target."""
    rows = np.flatnonzero(owners == _NO_TARGET)[:_SHOWN]
    if not len(rows):
        return []
    lines = ", ".join(str(found.lines[row]) for row in rows)
    return [f"misses whose position lies on the line of no target, or of several: line {lines}"]


def _possible_misses(lines: _TargetLines, owners: IntArray, beyond: FloatArray) -> str:
    """Return a warning that misses look like touches; it names outlying positions."""
    warning = (
        "a miss leaves a reading like a touch does, at the end of its move; the overtravel of the "
        "moves (in the machine file) distinguishes them"
    )
    further = beyond - np.median(beyond)
    outlying = [
        f"{lines.labels[owner]} ({distance:+.2f} mm)"
        for owner, distance in zip(owners, further, strict=True)
        if abs(distance) > _OUTLYING
    ]
    if not outlying:
        return warning
    return (
        f"{warning}. These lie further along than the others, as a miss does: "
        f"{', '.join(outlying[:_SHOWN])}"
    )
