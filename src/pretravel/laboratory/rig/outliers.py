"""Gross errors among the touches of a rig, against repeats and against the fitted map."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, IntArray

FALSE_ALARM_LEVEL = 0.01
"""Probability that any touch of a good set is named (Bonferroni over all touches)."""
_MOST_NAMED = 0.2  # of the touches; more of them are no gross errors, but the probe's scatter
_ORDERS = ((1, 2, 3, 6, 9), (1, 2, 3, 6), (1, 2, 3), (1, 2), (1,))
"""Of the map around the axis, the first that the directions determine; a tripod has three lobes."""
_FEWEST_DOF = 4  # of the map's residuals
_LARGEST_LEVERAGE = 0.8  # a direction with more is not predicted by the others
_LARGEST_CONDITION = 10.0
_CLEAR = math.log(100.0)  # log likelihood ratio from which the map tells which of two is wrong


@dataclass(frozen=True)
class OutlyingRows:
    """A touch that does not fit the others; or two repeats, one of which is wrong.

    Attributes
    ----------
    rows : tuple of int
        Of the touches, from 0.
    distance : float
        From the other touches of its direction, or from the map. [mm]
    limit : float
        Largest distance that scatter explains. [mm]
    against_map : bool
        Whether the touch has no repeat, so that the map of the other directions judges it.
    """

    rows: tuple[int, ...]
    distance: float
    limit: float
    against_map: bool = False


@dataclass(frozen=True, eq=False)
class _Step:
    """The touch that fits worst, after those of the steps before were left out."""

    rows: IntArray
    distance: float
    limit: float


def outlying_rows(
    values: FloatArray, groups: IntArray, azimuths: FloatArray, floor: float
) -> list[OutlyingRows]:
    """Touches that scatter does not explain.

    Parameters
    ----------
    values : (n,) float
        Pretravel. [mm]
    groups : (n,) int
        Number of the direction of each touch.
    azimuths : (n,) float
        nan where they are unknown. [rad]
    floor : float
        Standard deviation of a touch that is known without repeats: that of edges between
        samples. [mm]

    Returns
    -------
    list of OutlyingRows
        Largest distance first. Empty in 99 % of the sets with normal scatter.

    Notes
    -----
    A touch with repeats is compared with the mean of the other touches of its direction, a touch
    without repeats with a harmonic map of the other directions. The scatter is that of the touches
    without the one tested, and the limit a quantile of Student's distribution for the level
    `FALSE_ALARM_LEVEL` over the number of touches. They are left out one after the other, the
    worst first; all repeats up to the last one that exceeds its limit are named, so that they do
    not hide each other. Where half of three or more touches of a direction exceed it, this
    direction scatters more than others, and none of them is named.

    References
    ----------
    Rosner 1983, Technometrics 25, 165: the generalized extreme Studentized deviate test.

    >>> values = np.array([3.00, 3.02, 3.01, 2.99, 7.50, 3.00]) * 1e-3
    >>> [found.rows for found in outlying_rows(values, np.zeros(6, int), np.zeros(6), 1e-5)]
    [(4,)]
    """
    repeated = np.bincount(groups)[groups] > 1
    named = [
        _decided(step, values, groups, azimuths, floor)
        for step in _exceeding(repeated, lambda kept: _worst_repeat(values, groups, kept, floor))
    ]
    named = _without_scattering_directions(named, groups)
    wrong = [row for outlier in named for row in outlier.rows]
    single = ~repeated & np.isfinite(azimuths)
    if np.any(single):
        means = _Means.of(values, groups, azimuths, wrong)
        named += [
            OutlyingRows((int(step.rows[0]),), step.distance, step.limit, against_map=True)
            for step in _exceeding(
                single, lambda kept: _worst_single(means, single, kept, floor), until_first=True
            )
        ]
    return sorted(named, key=lambda outlier: -abs(outlier.distance))


def _without_scattering_directions(
    named: list[OutlyingRows], groups: IntArray
) -> list[OutlyingRows]:
    """Without touches of a direction of which half or more do not fit: this is how it scatters."""
    rows = [row for outlier in named for row in outlier.rows]
    count = np.bincount(groups[rows], minlength=int(groups.max()) + 1)
    of_direction = np.bincount(groups)
    scatters = (2 * count >= of_direction) & (of_direction > 2)
    return [outlier for outlier in named if not scatters[groups[outlier.rows[0]]]]


def _exceeding(
    candidates: BoolArray,
    worst: Callable[[BoolArray], _Step | None],
    *,
    until_first: bool = False,
) -> list[_Step]:
    """The steps up to the last (or the first) one whose distance exceeds its limit.

    The kinks of a map are several equal deviations. Without them the rest fits too well, so that a
    search up to the last would name them; the search up to the first does not.
    """
    kept = np.ones(len(candidates), dtype=bool)
    steps: list[_Step] = []
    last = 0
    for number in range(1, 1 + max(int(_MOST_NAMED * np.sum(candidates)), 1)):
        step = worst(kept)
        if step is None:
            break
        steps.append(step)
        kept[step.rows] = False
        if abs(step.distance) > step.limit:
            last = number
        elif until_first:
            break
    return steps[:last]


def _limit(count: int, dof: int) -> float:
    """Two-sided quantile of Student's distribution for one of `count` tests."""
    from scipy.special import stdtrit

    return -float(stdtrit(dof, FALSE_ALARM_LEVEL / (2.0 * count)))


def _worst_repeat(
    values: FloatArray, groups: IntArray, kept: BoolArray, floor: float
) -> _Step | None:
    """The kept touch that is farthest from the others of its direction."""
    own = np.where(kept, values, 0.0)
    count = np.bincount(groups, kept)
    sums = np.bincount(groups, own)
    testable = kept & (count[groups] > 1)
    dof = int(np.sum(np.maximum(count - 1, 0))) - 1
    if dof < 1:
        return None
    n = np.where(testable, count[groups], 2.0)
    residual = np.where(testable, values - sums[groups] / n, 0.0)
    # The sum of squares falls by n / (n - 1) r² when a touch is left out.
    studentized = np.abs(residual) * np.sqrt(n / (n - 1.0))
    row = int(np.argmax(studentized))
    scatter = math.sqrt(max(float(residual @ residual) - studentized[row] ** 2, 0.0) / dof)
    rows = np.flatnonzero(kept & (groups == groups[row])) if n[row] == 2 else np.array([row])
    unit = math.sqrt(n[row] / (n[row] - 1.0))
    limit = _limit(int(np.sum(kept)), dof) * max(scatter, floor) * unit
    return _Step(rows, float(residual[row] * n[row] / (n[row] - 1.0)), limit)


def _decided(
    step: _Step, values: FloatArray, groups: IntArray, azimuths: FloatArray, floor: float
) -> OutlyingRows:
    """Of two repeats the one that the map of the other directions contradicts, or both."""
    rows = tuple(int(row) for row in step.rows)
    if len(rows) == 1:
        return OutlyingRows(rows, step.distance, step.limit)
    means = _Means.of(values, groups, azimuths, list(rows))
    at = float(azimuths[rows[0]])
    design = _harmonics(np.append(means.azimuth, at)) if math.isfinite(at) else None
    if design is not None:
        from scipy.stats import t

        known, inverse = design[:-1], np.linalg.pinv(design[:-1])
        solution = inverse @ means.value
        dof = len(known) - known.shape[1]
        own = design[-1] @ inverse
        squares = float(np.sum((means.value - known @ solution) ** 2))
        scatter = math.sqrt(squares / dof * (1.0 + float(own @ own)))
        deviation = (values[list(rows)] - design[-1] @ solution) / max(scatter, floor)
        likelihood = t.logpdf(deviation, dof)
        wrong = int(np.argmin(likelihood))
        if float(np.ptp(likelihood)) > _CLEAR:
            return OutlyingRows(
                (rows[wrong],), float(values[rows[wrong]] - values[rows[1 - wrong]]), step.limit
            )
    return OutlyingRows(rows, abs(step.distance), step.limit)


@dataclass(frozen=True, eq=False)
class _Means:
    """Mean pretravel of the directions with an azimuth.

    Attributes
    ----------
    value, azimuth : (d,) float
        [mm], [rad]
    row : (d,) int
        First touch of each.
    """

    value: FloatArray
    azimuth: FloatArray
    row: IntArray

    @classmethod
    def of(
        cls, values: FloatArray, groups: IntArray, azimuths: FloatArray, left_out: list[int]
    ) -> _Means:
        kept = np.isfinite(azimuths)
        kept[left_out] = False
        rows = np.flatnonzero(kept)
        _, first, place, count = np.unique(
            groups[rows], return_index=True, return_inverse=True, return_counts=True
        )
        value = np.bincount(place, values[rows]) / count if len(rows) else values[rows]
        return cls(np.asarray(value), azimuths[rows[first]], rows[first])


def _harmonics(azimuths: FloatArray) -> FloatArray | None:
    """Design of the highest harmonics that these directions determine; None where none does."""
    for orders in _ORDERS:
        if len(azimuths) - 2 * len(orders) - 1 < _FEWEST_DOF + 1:
            continue
        angles = np.multiply.outer(azimuths, orders)
        design = np.concatenate(
            [np.ones((len(azimuths), 1)), np.cos(angles), np.sin(angles)], axis=1
        )
        # Directions in one part of the circle do not determine the rest of it.
        if np.linalg.cond(design) < _LARGEST_CONDITION:
            return design
    return None


def _worst_single(means: _Means, single: BoolArray, kept: BoolArray, floor: float) -> _Step | None:
    """The kept touch without repeats that is farthest from the map of the other directions."""
    inside = kept[means.row]
    value, rows = means.value[inside], means.row[inside]
    design = _harmonics(means.azimuth[inside])
    if design is None:
        return None
    hat = design @ np.linalg.pinv(design)
    residual, free = value - hat @ value, 1.0 - np.diag(hat)
    testable = single[rows] & (free > 1.0 - _LARGEST_LEVERAGE)
    if not np.any(testable):
        return None
    # The sum of squares falls by r² / (1 - h) when a direction is left out.
    studentized = np.where(testable, np.abs(residual) / np.sqrt(np.where(testable, free, 1.0)), 0.0)
    place = int(np.argmax(studentized))
    dof = len(value) - design.shape[1] - 1
    scatter = math.sqrt(max(float(residual @ residual) - studentized[place] ** 2, 0.0) / dof)
    limit = _limit(int(np.sum(kept)), dof) * max(scatter, floor) / math.sqrt(free[place])
    return _Step(rows[[place]], float(residual[place] / free[place]), limit)


@dataclass(frozen=True)
class TraceOutlier:
    """A trace that was left out, since scatter does not explain its pretravel.

    Attributes
    ----------
    trace : str
    distance : float
        From the other touches of its direction, or from the map of the other directions. [mm]
    limit : float
        Largest distance that scatter explains. [mm]
    message : str
    """

    trace: str
    distance: float
    limit: float
    message: str


def outlier_messages(found: OutlyingRows, traces: list[str], others: int) -> list[TraceOutlier]:
    """The traces of an outlier, each with a sentence.

    Parameters
    ----------
    found : OutlyingRows
    traces : list of str
        Names of all touches.
    others : int
        Number of the other touches of its direction.
    """
    names = [traces[row] for row in found.rows]
    size = f"{found.distance / MICROMETRE:+.3g} µm"
    explained = f"scatter explains {found.limit / MICROMETRE:.3g} µm"
    if len(names) == 2:
        text = (
            f"{names[0]} and {names[1]} lie {abs(found.distance) / MICROMETRE:.3g} µm apart; "
            f"{explained}. It is unknown which is wrong, so both are left out: touch the "
            "direction again"
        )
        return [TraceOutlier(name, found.distance, found.limit, text) for name in names]
    place = (
        "from the map of the other directions"
        if found.against_map
        else f"from the other touch{'es' * (others > 1)} of its direction"
    )
    text = f"{names[0]} lies {size} {place}; {explained}. It is left out"
    return [TraceOutlier(names[0], found.distance, found.limit, text)]
