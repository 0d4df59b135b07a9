"""Joining: positions that a control latched, matched with the plan that it ran."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, InputError, IntArray, RowError
from pretravel.files.file_format import FilePositions, FileReadings, labels_or_numbers
from pretravel.files.logs.double_touches import follows_its_search
from pretravel.files.source_file import first_few
from pretravel.touches import Targets, Touches, label_prefix

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
_NEARER = 0.5
"""A target of a feature is the nearest where its distance is below this share of the next one."""
_ONE_FACE = 1e-3
"""Normals that differ by less are of one plane face: it does not matter which target is taken."""
_FEWEST_PAIRS, _UNEQUAL = 4, 8.6
"""Pairs, and Student's t of their mean step, from which the second touches differ from the first:
by chance in 0.3 % of files with four pairs, and less with more."""
_SHOWN = 10
"""Most labels that a message shows."""
_NO_TARGET = -1
"""Stands for the row of the plan of a miss that lies on no target's line."""


def join(
    found: FilePositions,
    plan: Targets,
    tip_radius: float,
    *,
    overtravel: float | None = None,
    by: str = "line",
    both: bool = False,
) -> FileReadings:
    """Join positions with a plan: each belongs to the target on whose line it lies.

    Nothing is counted: positions can be in any order, and some can be absent.

    By labels, a position belongs to the target with its label, or to the nearest one of its
    feature, wherever it lies across the line: a part that lies elsewhere, or a plan that states
    one point for each face. Its nominal point is then that of the target's tangent plane.

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
    by : str
        ``line``, ``label`` or ``feature``: the label without the number at its end.
    both : bool
        Both touches of a place that was touched fast and then slowly belong to one target; their
        labels state the feeds.

    Raises
    ------
    InputError
        A position belongs to no target or to several; a target has more positions than repeats;
        no position is a contact; there are no labels to join by. The message contains the line.

    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], labels=("top",))
    >>> found = join(FilePositions("a.log", np.array([[0.0, 0.0, 2.99]]), (1,)), up, 3.0)
    >>> found.touches.labels
    ('top',)
    """
    if by != "line":
        return _join_by_label(
            found, plan, tip_radius, overtravel, feature=by == "feature", both=both
        )
    lines = _lines_of(plan, tip_radius, found.path)
    second = follows_its_search(found.positions, found.feeds, found.contact)
    if both and not second.any():
        raise InputError(
            "no place was touched twice, fast and then slowly, or the file does not give the "
            "feeds: keep the last touch of each place, or give the column of the feeds",
            path=found.path,
            inputs=("double_touches", "columns"),
        )
    owners, beyond = _owners(found, lines, second, both=both)
    contact = _contacts(found, beyond, overtravel)
    if not np.any(contact):
        raise InputError("none of the readings is a contact", path=found.path)
    rows = np.flatnonzero(contact)
    warnings = _absent(lines, owners) + _misses_elsewhere(found, owners)
    if found.feeds is None:
        warnings += _unequal_pairs(lines, owners, beyond, contact)
    if found.contact is None and overtravel is None:
        warnings.append(_possible_misses(lines, owners, beyond))
    return FileReadings(
        _touches(found, plan, lines, owners[rows], rows),
        missed=tuple(lines.labels[owner] for owner in owners[~contact] if owner != _NO_TARGET),
        warnings=tuple(warnings),
        unfinished=_untouched(lines, owners),
    )


def _join_by_label(
    found: FilePositions,
    plan: Targets,
    tip_radius: float,
    overtravel: float | None,
    *,
    feature: bool,
    both: bool,
) -> FileReadings:
    if found.labels is None:
        raise InputError(
            "its readings have no labels to join by; give the column of the labels, or join by "
            "the lines of the targets",
            path=found.path,
            inputs=("columns", "join"),
        )
    names = labels_or_numbers(plan.labels, len(plan))
    rows_of: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        for own in {name, label_prefix(name)} if feature else {name}:
            rows_of.setdefault(own, []).append(row)
    owners = np.array([
        _target_of(found, row, plan, tip_radius, _candidates(found, row, rows_of, feature=feature))
        for row in range(len(found.lines))
    ])  # fmt: skip
    second = follows_its_search(found.positions, found.feeds, found.contact)
    doubled = np.flatnonzero(second[1:] & (owners[1:] == owners[:-1])) + 1
    if len(doubled) and not both:
        raise _double_touch(found, int(doubled[0]), names[owners[doubled[0]]])
    seen = found.positions - plan.points[owners] - tip_radius * plan.normals[owners]
    beyond = np.sum(seen * np.asarray(plan.approaches)[owners], axis=1)
    contact = _contacts(found, beyond, overtravel)
    if not np.any(contact):
        raise InputError("none of the readings is a contact", path=found.path)
    rows = np.flatnonzero(contact)
    kept = owners[rows]
    labels = _numbered(found.labels)
    height = np.sum(seen[rows] * plan.normals[kept], axis=1)
    try:
        touches = Touches(
            positions=found.positions[rows],
            normals=plan.normals[kept],
            approaches=np.asarray(plan.approaches)[kept],
            labels=tuple(labels[row] for row in rows),
            nominal_points=plan.points[kept] + seen[rows] - height[:, None] * plan.normals[kept],
            source=Path(found.path).name,
            lines=tuple(found.lines[row] for row in rows),
        )
    except RowError as error:
        raise found.error(error.in_file, int(rows[error.row])) from None
    used = {names[row] for row in owners}
    used |= {label_prefix(name) for name in used} if feature else set()
    absent = [name for name in names if not {name, label_prefix(name) if feature else name} & used]
    missed = tuple(labels[row] for row in np.flatnonzero(~contact))
    return FileReadings(touches, missed, warnings=tuple(_without_readings(absent)))


def _candidates(
    found: FilePositions, row: int, rows_of: Mapping[str, list[int]], *, feature: bool
) -> list[int]:
    """Rows of the plan that have the label of a reading, or the name of its feature."""
    label = (found.labels or ())[row]
    name = label_prefix(label) if feature and label not in rows_of else label
    if name not in rows_of:
        what = "target or feature" if feature else "target"
        known = ", ".join(list(rows_of)[:_SHOWN])
        raise found.error(
            f"the plan has no {what} called '{name}'; it has {known}", row, inputs=("plan", "join")
        )
    return rows_of[name]


def _target_of(
    found: FilePositions, row: int, plan: Targets, tip_radius: float, candidates: list[int]
) -> int:
    """The row of the plan that a reading belongs to, among those of its label or feature."""
    normals = plan.normals[candidates]
    seen = found.positions[row] - plan.points[candidates] - tip_radius * normals
    directions = np.asarray(plan.approaches)[candidates]
    along = np.sum(seen * directions, axis=1)
    away = np.linalg.norm(seen, axis=1)
    order = np.argsort(away)
    best = int(order[0])
    label = (found.labels or ())[row]
    if abs(along[best]) > ALONG:
        raise found.error(
            f"the reading {label} lies {abs(along[best]):.3f} mm along the approach from its "
            "target. Is this the plan that was run, in the same work offset and units?",
            row,
            inputs=("plan", "units"),
        )
    between = len(order) > 1 and away[best] > _NEARER * away[order[1]]
    if between and np.max(np.abs(normals - normals[0])) > _ONE_FACE:
        raise found.error(
            f"the reading {label} lies between several targets of its feature, "
            f"{away[best]:.3f} and {away[order[1]]:.3f} mm away, and their normals differ: give "
            "each reading the label of its target",
            row,
            inputs=("join",),
        )
    return candidates[best]


def _numbered(labels: Sequence[str]) -> list[str]:
    """Labels, with a number where several readings have one."""
    counts, so_far = Counter(labels), Counter[str]()
    numbered = []
    for label in labels:
        so_far[label] += 1
        numbered.append(f"{label}-{so_far[label]}" if counts[label] > 1 else label)
    return numbered


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


def _owners(
    found: FilePositions, lines: _TargetLines, second: BoolArray, *, both: bool
) -> tuple[IntArray, FloatArray]:
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
        if second[row] and owners[-1] in lines.repeats[line]:
            if not both:
                raise _double_touch(found, row, lines.label(line))
            owners.append(owners[-1])
        elif waiting[line]:
            owners.append(waiting[line].pop(0))
        else:
            raise found.error(
                f"the target {lines.label(line)} has more readings than the plan has touches of "
                "it: is this the log of two runs? Or was each place touched twice, fast and then "
                "slowly (double touches)?",
                row,
                inputs=("double_touches",),
            )
        beyond.append(along)
    return np.array(owners, dtype=np.int64), np.array(beyond)


def _double_touch(found: FilePositions, row: int, label: str) -> InputError:
    assert found.feeds is not None
    fast, slow = (f"{found.feeds[i]:g} mm/min (line {found.lines[i]})" for i in (row - 1, row))
    return found.error(
        f"the target {label} was touched at {fast}, and directly afterwards at {slow}: a search "
        "and its slow touch are not repeats of each other. Keep the last of them, or all with "
        "their feeds",
        row,
        inputs=("double_touches",),
    )


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
        named = bool(set(found.labels or ()) & set(lines.labels))
        raise found.error(
            f"the reading ({place}) mm is not on the line of any target; the nearest is "
            f"{lines.label(near[nearest])}, {across[nearest]:.3f} mm from it. Is this the plan "
            "that was run, in the same work offset and units?"
            + (" Its labels are also those of the plan: join by them" if named else ""),
            row,
            inputs=("plan", "units", *(("join",) if named else ())),
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
        labels=_with_feeds([lines.labels[owner] for owner in owners], found, rows),
        nominal_points=plan.points[owners],
        source=Path(found.path).name,
        lines=tuple(found.lines[row] for row in rows),
    )


def _with_feeds(labels: list[str], found: FilePositions, rows: IntArray) -> tuple[str, ...]:
    """Labels; those of two touches of one target state the feeds."""
    counts = Counter(labels)
    if found.feeds is None:
        return tuple(labels)
    return tuple(
        f"{label} F{found.feeds[row]:g}" if counts[label] > 1 else label
        for label, row in zip(labels, rows, strict=True)
    )


def _absent(lines: _TargetLines, owners: IntArray) -> list[str]:
    """Return a warning about the touches of the plan that have no position."""
    seen = set(owners.tolist())
    return _without_readings(
        [lines.labels[row] for rows in lines.repeats for row in rows if row not in seen]
    )


def _without_readings(absent: Sequence[str]) -> list[str]:
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
    shown = first_few(lines.labels[rows[0]] for rows in empty)
    return f"{len(empty)} of {len(lines.repeats)} places of the plan have no reading: {shown}"


def _misses_elsewhere(found: FilePositions, owners: IntArray) -> list[str]:
    """Return a warning about stated misses whose position tells no target."""
    rows = np.flatnonzero(owners == _NO_TARGET)[:_SHOWN]
    if not len(rows):
        return []
    lines = ", ".join(str(found.lines[row]) for row in rows)
    return [f"misses whose position is not on the line of exactly one target: line {lines}"]


def _unequal_pairs(
    lines: _TargetLines, owners: IntArray, beyond: FloatArray, contact: BoolArray
) -> list[str]:
    """Return a warning where the second of two touches at once differs from the first everywhere.

    A search and its slow touch differ by their feeds times the delay, much more than repeats do.
    """
    line_of = {row: k for k, rows in enumerate(lines.repeats) for row in rows}
    places = [line_of.get(owner, _NO_TARGET) for owner in owners.tolist()]
    sizes = Counter(places)
    steps = [
        beyond[row] - beyond[row - 1]
        for row in range(1, len(places))
        if places[row] == places[row - 1] != _NO_TARGET
        and sizes[places[row]] == 2
        and contact[row]
        and contact[row - 1]
    ]
    if len(steps) < _FEWEST_PAIRS:
        return []
    mean, scatter = float(np.mean(steps)), float(np.std(steps, ddof=1))
    if abs(mean) <= _UNEQUAL * max(scatter / math.sqrt(len(steps)), 0.1 * MICROMETRE):
        return []
    warning = (
        f"the second of two touches of a target is {1e3 * mean:+.1f} µm from the first along the "
        f"approach, at {len(steps)} targets (scatter {1e3 * scatter:.1f} µm): a search and its "
        "slow touch are not repeats of each other; keep the last of them"
    )
    return [warning]


def _possible_misses(lines: _TargetLines, owners: IntArray, beyond: FloatArray) -> str:
    """Return a warning that misses look like touches; it names outlying positions."""
    warning = (
        "a miss also gives a reading, at the end of its move: give the overtravel (in the machine "
        "file), which distinguishes misses from touches"
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
