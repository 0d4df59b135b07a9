"""Points far from the feature of all others: a miss, or the touch of something else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray, PretravelError
from pretravel.measurement.association import (
    Association,
    associate,
    moved_association,
)
from pretravel.touches import label_prefix

_FAR = 0.3
"""A point that is this far from the feature of the others is no form of a surface. [mm]"""
_TIMES = 50.0
"""Beyond this many times the scatter of the others."""
_MOST = 0.2
"""Share of the points above which another feature was touched there."""
_MOST_AT_ONE_END = 0.45
"""The same of points at which moves ended, with one coordinate to the last digit."""
_FEW = 10
"""Single points are no more than this."""
_EACH = 4
"""With so few degrees of freedom each point is left out in turn."""
_MOST_IN_TURN = 30
_LIKELY = 2
"""With more, those that the residuals show."""
_WITH_AXIS = ("cylinder", "cone")
_FREE_SHARE = 0.05
"""Of the error of a point, what the feature of all must leave to be seen."""
_TO_RECOGNISE = 3
"""Degrees of freedom of the others that show which feature was touched."""
_GOOD = 0.05
"""Scatter about a feature that is recognised by its points alone. [mm]"""
_INSIDE = 0.45
"""A point about the middle, in diameters inward, is one of a pattern of places."""
_WIDE = 10.0
"""Diameter of a circle or sphere over the extent of its points, beyond which it is a plane."""
_NARROWEST = 0.05
"""Width over length of the points of a circle: an arc of 60° has 0.14."""
_RECOGNISED = 500
"""More points are scans of surfaces."""


@dataclass(frozen=True)
class MissedPoints:
    """Single points that lie far from the feature of the others.

    Attributes
    ----------
    rows : tuple of int
    off : tuple of float
        Distance of each from the feature of the others, positive outward. [mm]
    unclear : float
        Where one point is far, and several could be it: the largest distance from the feature of
        all; else 0. [mm]
    all_near : bool
        Whether all points lie about the feature.
    """

    rows: tuple[int, ...] = ()
    off: tuple[float, ...] = ()
    unclear: float = 0.0
    all_near: bool = False


@dataclass(frozen=True)
class _Trial:
    """The feature of some of the points, and the distances of all from it."""

    off: FloatArray
    scatter: float

    def explains(self, kept: BoolArray) -> bool:
        """Whether those that are kept lie on the feature, and the others far from it."""
        limit = max(_FAR, _TIMES * self.scatter)
        far = np.abs(self.off) > limit
        return bool(not far[kept].any() and far[~kept].all())


def missed_points(kind: str, points: FloatArray, axis: FloatArray | None = None) -> MissedPoints:
    """Points that are far from the feature of the others.

    Parameters
    ----------
    kind : str
        As of `associate`.
    points : (n, 3) float
        On the feature, or tip centres. [mm]
    axis : (3,) float, optional
        As of `associate`.

    Returns
    -------
    MissedPoints
        Empty where all lie about the feature, and where more than single points do not.

    Notes
    -----
    One point after the other is left out: that without which the others scatter least.

    >>> angles = np.arange(8) * np.pi / 4
    >>> bore = 20.0 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(8)])
    >>> bore[7] *= 0.9
    >>> found = missed_points("bore", bore)
    >>> found.rows, [round(off, 6) for off in found.off]
    ((7,), [-2.0])
    """
    kept = np.ones(len(points), dtype=bool)
    every = _fitted(kind, points, axis)
    if every is not None and np.abs(_left_to_each(every)).max() <= _FAR:
        return MissedPoints(all_near=True)
    if axis is None and kind in _WITH_AXIS:
        if every is None:  # as from points in one circle
            return MissedPoints()
        axis = every.direction  # where the search starts
    for ended in _at_one_end(points):
        trial = _trial(kind, points, ~ended, axis)
        if trial is not None and trial.explains(~ended):
            at_end = np.flatnonzero(ended)
            return MissedPoints(tuple(at_end.tolist()), tuple(trial.off[at_end].tolist()))
    for number in range(min(max(int(_MOST * len(points)), 1), _FEW)):
        rows = _suspects(kind, points, kept, axis)
        trials = {row: _trial(kind, points, _without(kept, row), axis) for row in rows}
        found = {row: trial for row, trial in trials.items() if trial is not None}
        if not found:
            return MissedPoints()
        right = [row for row, trial in found.items() if trial.explains(_without(kept, row))]
        if len(right) > 1:
            largest = 0.0 if every is None else float(np.abs(every.residuals).max())
            return MissedPoints(unclear=largest if number == 0 else 0.0)
        best = min(found, key=lambda row: found[row].scatter)
        kept = _without(kept, right[0] if right else best)
        if right:
            missed = np.flatnonzero(~kept)
            off = found[right[0]].off[missed]
            return MissedPoints(tuple(missed.tolist()), tuple(off.tolist()))
    return MissedPoints()


def _at_one_end(points: FloatArray) -> list[BoolArray]:
    """Points whose lowest or highest coordinate is one, to the last digit: ends of moves.

    >>> heights = np.column_stack([np.arange(5.0), np.arange(5.0), [0, 0.1, -5, -5, 0.2]])
    >>> [rows.nonzero()[0].tolist() for rows in _at_one_end(heights)]
    [[2, 3]]
    """
    found = []
    for coordinates in points.T:
        for end in (coordinates.min(), coordinates.max()):
            rows = coordinates == end
            if 1 < rows.sum() <= _MOST_AT_ONE_END * len(points):
                found.append(rows)
    return found


def missed_points_of_features(
    points: FloatArray, labels: Sequence[str] | None = None
) -> tuple[tuple[str, MissedPoints], ...]:
    """Points that are far from a feature, which the others show: plane, circle, sphere.

    Parameters
    ----------
    points : (n, 3) float
        [mm]
    labels : n strings or None
        Points whose labels differ only in the number at the end are one feature; without labels,
        and where no two are, all are.

    Returns
    -------
    tuple of (str, MissedPoints)
        The kind of feature, with rows among all points.

    >>> angles = np.arange(8) * np.pi / 4
    >>> bore = 20.0 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(8)])
    >>> bore[7] *= 0.9
    >>> [(kind, found.rows) for kind, found in missed_points_of_features(bore)]
    [('circle', (7,))]
    """
    if len(points) > _RECOGNISED:
        return ()
    names = [label_prefix(label) for label in labels] if labels else [""] * len(points)
    if labels and set(names) == set(labels):
        names = [""] * len(points)
    found = []
    for name in dict.fromkeys(names):
        rows = np.flatnonzero(np.array([own == name for own in names]))
        recognised = _recognised(points[rows])
        if recognised is not None:
            kind, missed = recognised
            mine = tuple(rows[list(missed.rows)].tolist())
            found.append((kind, MissedPoints(mine, missed.off)))
    return tuple(found)


def _recognised(points: FloatArray) -> tuple[str, MissedPoints] | None:
    """The feature that most of the points show, and those that are far from it."""
    trials: list[tuple[str, FloatArray, FloatArray | None]] = []
    for across in (2, 0, 1):  # bores and bosses along an axis of the machine, at any heights
        flat = points.copy()
        flat[:, across] = 0.0
        in_plane = np.delete(points, across, axis=1)
        if _is_wide(in_plane) and _circle_passes_most(in_plane):
            trials.append(("circle", flat, np.eye(3)[across]))
    if not _shown("plane", points, None):
        trials = [("plane", points, None), *trials, ("sphere", points, None)]
    if any(_shown(kind, places, axis) for kind, places, axis in trials):
        return None
    for kind, places, axis in trials:
        missed = missed_points(kind, places, axis)
        if not missed.rows:
            continue
        fit = _fitted(kind, np.delete(places, missed.rows, axis=0), axis)
        if fit is None or fit.dof < _TO_RECOGNISE or not _is_shown(fit):
            continue
        if fit.diameter is None or min(missed.off) > -_INSIDE * fit.diameter:
            return kind, missed
    return None


def _is_wide(points: FloatArray) -> bool:
    """Whether points of a plane are no line, as those of a flat face seen along it: a circle passes
    any two clusters of them.
    """
    size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(size[-1] > _NARROWEST * size[0])


def _circle_passes_most(points: FloatArray) -> bool:
    """Whether a circle through three points of a plane passes all but those that may be missed.

    Searches for circles in what is none, a grid of a flat face, take long.
    """
    count = len(points)
    if count < 3:
        return False
    third = count // 3
    spread = [(third, 2 * third), (third + 1, 2 * third + 1), (1, 2)]
    others = [np.stack([np.roll(points, -k, axis=0) for k in each], axis=1) for each in spread]
    first = np.tile(points, (len(spread), 1))
    chords = np.concatenate(others) - first[:, None]
    with np.errstate(all="ignore"):
        a, b, c, d = chords.reshape(-1, 4).T
        squares = 0.5 * np.sum(chords**2, axis=2)
        centres = (
            np.column_stack(
                [d * squares[:, 0] - b * squares[:, 1], a * squares[:, 1] - c * squares[:, 0]]
            )
            / (a * d - b * c)[:, None]
        )
        places = np.linalg.norm(points - (first + centres)[:, None], axis=2)
        radii = np.linalg.norm(centres, axis=1)
        off = np.quantile(np.abs(places - radii[:, None]), 1.0 - _MOST, axis=1)
    return bool(np.any(off <= _FAR))


def _shown(kind: str, points: FloatArray, axis: FloatArray | None) -> bool:
    fit = _fitted(kind, points, axis)
    return fit is not None and _is_shown(fit)


def _is_shown(fit: Association) -> bool:
    """Whether points show a feature; those of a plane lie on a huge circle, too."""
    wide = 0.0 if fit.diameter is None else fit.diameter / float(np.ptp(fit.points, axis=0).max())
    return _scatter(fit) <= _GOOD and wide <= _WIDE


def _fitted(kind: str, points: FloatArray, axis: FloatArray | None) -> Association | None:
    """The feature through points; None where they do not determine it."""
    try:
        with np.errstate(all="ignore"):
            fit = associate(kind, points, axis=axis)
    except (PretravelError, np.linalg.LinAlgError):
        return None
    return fit if np.isfinite(fit.residuals).all() and np.isfinite(fit.jacobian).all() else None


def _scatter(fit: Association) -> float:
    return float(np.sqrt(np.sum(fit.residuals**2) / max(fit.dof, 1)))


def _trial(
    kind: str, points: FloatArray, kept: BoolArray, axis: FloatArray | None
) -> _Trial | None:
    fit = _fitted(kind, points[kept], axis)
    if fit is None or fit.dof < 0:
        return None
    unmoved = np.zeros(fit.jacobian.shape[1])
    try:
        of_all = moved_association(kind, replace(fit, points=points), unmoved)
    except PretravelError:  # a point at the centre has no direction from it
        return None
    return _Trial(of_all.residuals, _scatter(fit))


def _without(kept: BoolArray, row: int) -> BoolArray:
    left = kept.copy()
    left[row] = False
    return left


def _left_to_each(fit: Association) -> FloatArray:
    """Distance of each point from the feature of the others, by what least squares left of it."""
    share = 1.0 - np.sum(np.linalg.qr(fit.jacobian)[0] ** 2, axis=1)
    return np.asarray(fit.residuals / np.maximum(share, _FREE_SHARE))


def _suspects(kind: str, points: FloatArray, kept: BoolArray, axis: FloatArray | None) -> IntArray:
    """Points that are left out in turn: each of few, those that the residuals show of many."""
    rows = np.flatnonzero(kept)
    fit = _fitted(kind, points[kept], axis)
    if fit is None or fit.dof <= _EACH:
        return rows if len(rows) <= _MOST_IN_TURN else rows[:0]
    # What the sum of squares becomes smaller by without each point.
    less = fit.residuals * _left_to_each(fit)
    # A point farther away than the feature is large turns the feature of all to itself.
    away = np.abs(points[kept] - np.median(points[kept], axis=0)).argmax(axis=0)
    return np.asarray(rows[np.unique([*np.argsort(less)[-_LIKELY:], *away])])
