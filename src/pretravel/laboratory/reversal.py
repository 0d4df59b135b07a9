"""Reversal: the same touches at 0° and 180° of the spindle; what averaging removes.

The probe turns with the spindle. With the tip off the spindle's axis by e, and a pretravel
d(n) that is fixed to the probe, a touch along -n on a wall reads ``s + r - d(n) - n·e`` at 0° and
``s + r - d(-n) + n·e`` at 180°. Half of the sum has no run-out e, and of d the even part about the
axis only: its mean and its lobes of order two, four, …. Half of the difference has the rest: the
run-out and the odd lobes, three of them first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import DEGREE, FloatArray, IntArray, PretravelError, azimuth_angle, frozen
from pretravel.maps import REVERSAL
from pretravel.touches import Touches

ORDERS = (1, 3, 5)
"""Lobes that half of the difference is fitted with: the run-out is in the first."""
_SAME_PLACE = 1.0
"""Touches of one target at both orientations are closer than that. [mm]"""
_SAME_TARGET = 0.02
"""Repeats of a target are closer than that. [mm]"""
_SAME_FEED = 0.01
"""Relative difference of feeds that are one, as in a qualification."""
_SAME_NORMAL = math.cos(1.0 * DEGREE)
_OPPOSITE = 1.0 * DEGREE
_FEWEST = 8
"""Directions for the lobes: six numbers and a noise."""
_ALL = tuple(range(1, 35, 2))
"""Odd orders that a probe has: a reversal shows no even ones."""
_ALIKE = 0.9
"""Share of a lobe that another one explains in the touched directions, if they are one number."""
_FREE = 1.0  # mm: far above any lobe and run-out
_TYPICAL_NOISE = 0.3e-3
_NOISE_ALONE = 3.0
"""Amplitude in u of its cosine and sine that noise exceeds with 1 % (Rayleigh's distribution)."""
_NOISES = tuple(_TYPICAL_NOISE * 1.25**step for step in range(-16, 17))


@dataclass(frozen=True, eq=False)
class ReversedPairs:
    """Means and differences of touches at two opposite orientations of the spindle.

    Attributes
    ----------
    means : Touches
        A touch for each target, at no orientation.
    half_differences : (n,) float
        Along the normals: reading at 0°, or at the orientation below 180°, less that at the
        opposite one, halved. [mm]
    amplitudes, u : (3,) float
        Of the lobes of `ORDERS`, and their standard uncertainty; not numbers where too few
        directions were touched, and of a lobe that they do not distinguish from one before. [mm]
    runout : (2,) float
        Along x and y, together with the lobe of order one of the pretravel: a tip off the axis
        and such a lobe are the same. [mm]
    noise : float
        Standard deviation of a single touch. [mm]
    dof : float
    together : tuple of tuple of int
        Higher orders that the directions do not distinguish from each of `ORDERS`: their usual size
        is in u.
    """

    means: Touches
    half_differences: FloatArray
    amplitudes: FloatArray
    u: FloatArray
    runout: FloatArray
    noise: float
    dof: float
    together: tuple[tuple[int, ...], ...]

    @property
    def u_mean(self) -> float:
        """Standard uncertainty of a mean by the noise. [mm]"""
        return self.noise / math.sqrt(2.0)

    @property
    def factor(self) -> float:
        """K of U; the uncertainty of the noise is in u."""
        return 2.0 if math.isfinite(self.noise) else math.nan

    @property
    def removed(self) -> float:
        """Root mean square of what averaging removes. [mm]"""
        return float(np.sqrt(np.mean(self.half_differences**2)))

    @property
    def shows_nothing(self) -> bool:
        """Whether noise explains all differences, as where the spindle was not turned."""
        size = np.append(self.amplitudes[1:], np.linalg.norm(self.runout))
        known = np.isfinite(size)
        u = np.append(self.u[1:], self.u[0])
        return bool(known.any() and np.all(size[known] < _NOISE_ALONE * u[known]))


def reversed_touches(touches: Touches) -> ReversedPairs:
    """Pair touches at two opposite orientations of the spindle.

    Parameters
    ----------
    touches : Touches
        With `Touches.spindle`; the spindle's axis is the z axis. Targets may be touched in any
        order, each as often at both orientations.

    Raises
    ------
    PretravelError
        No orientations, or others than two opposite ones; a touch without its counterpart;
        touches of several tips, parts or passes; a target at two feeds.

    >>> n = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    >>> both = Touches(np.vstack([n * 15.49, n * 15.47]), np.vstack([n, n]),
    ...                spindle=[0.0, 0.0, np.pi, np.pi])
    >>> found = reversed_touches(both)
    >>> found.means.positions[0].tolist(), found.half_differences.round(6).tolist()
    ([15.48, 0.0, 0.0], [0.01, 0.01])
    """
    first, second = _orientations(touches)
    touches.refuse_several()
    partners = _partners(touches, first, second)
    one, other = touches.take(first), touches.take(partners)
    _check_feeds(one, other)
    difference = one.positions - other.positions
    half = 0.5 * np.sum(one.normals * difference, axis=1)
    means = replace(
        one,
        positions=0.5 * (one.positions + other.positions),
        spindle=None,
        feeds=None if one.feeds is None or other.feeds is None else 0.5 * (one.feeds + other.feeds),
        lines=None,
        orientations=tuple(
            f"{own} {REVERSAL}".strip() for own in one.orientations or [""] * len(one)
        ),
        source=f"{touches.source or 'touches'}, means of both orientations",
    )
    return _with_lobes(means, np.asarray(half))


def _orientations(touches: Touches) -> tuple[IntArray, IntArray]:
    """Rows at the orientation from 0° to below 180°, and at the opposite one."""
    if touches.spindle is None:
        raise PretravelError(
            "the touches do not give the orientation of the spindle: a column spindle_deg is "
            "needed, or the orientation of each file",
            inputs=("spindle",),
        )
    turn = np.mod(touches.spindle - touches.spindle[0] + math.pi, 2.0 * math.pi) - math.pi
    at_first = np.abs(turn) < _OPPOSITE
    opposite = np.abs(np.abs(turn) - math.pi) < _OPPOSITE
    if not np.all(at_first | opposite) or not opposite.any():
        stated = sorted({f"{angle / DEGREE:.4g}°" for angle in touches.spindle})
        raise PretravelError(
            f"the orientations of the spindle are {', '.join(stated[:6])}; a reversal needs two "
            "that are 180° apart",
            inputs=("spindle",),
        )
    turned = float(np.mod(touches.spindle[0] + _OPPOSITE, 2.0 * math.pi)) >= math.pi
    found = np.flatnonzero(at_first), np.flatnonzero(opposite)
    return found[::-1] if turned else found


def _check_feeds(one: Touches, other: Touches) -> None:
    """Refuse targets at two feeds: half of the difference of their delay travel would look like
    noise, and the mean would be one of a feed that nobody drove.
    """
    if one.feeds is None or other.feeds is None:
        return
    differ = np.abs(one.feeds - other.feeds) > _SAME_FEED * np.maximum(one.feeds, other.feeds)
    if differ.any():
        row = int(np.argmax(differ))
        raise PretravelError(
            f"{one.where(row)} is at {one.feeds[row]:g} mm/min, its counterpart at the other "
            f"orientation, {other.where(row)}, at {other.feeds[row]:g} mm/min: feed × signal delay "
            "differs. Touch both at one feed"
        )


def _partners(touches: Touches, first: IntArray, second: IntArray) -> IntArray:
    """The row at the other orientation of each touch: of the nearest that are free, the first.

    The nearest of repeats alone would choose among their noise.
    """
    free = np.ones(len(second), dtype=bool)
    found = []
    for row in first:
        apart = np.linalg.norm(touches.positions[second] - touches.positions[row], axis=1)
        alike = touches.normals[second] @ touches.normals[row] > _SAME_NORMAL
        apart[~(free & alike)] = math.inf
        nearest = int(np.argmax(apart <= apart.min() + _SAME_TARGET))
        if not apart[nearest] < _SAME_PLACE:
            raise PretravelError(
                f"{touches.where(int(row))} has no touch at the other orientation of the spindle "
                f"within {_SAME_PLACE:g} mm and with its normal: touch the same targets at both"
            )
        free[nearest] = False
        found.append(int(second[nearest]))
    if free.any():
        row = int(second[int(np.argmax(free))])
        raise PretravelError(
            f"{touches.where(row)} has no touch at the first orientation of the spindle: touch the "
            "same targets at both"
        )
    return np.array(found)


def _with_lobes(means: Touches, half: FloatArray) -> ReversedPairs:
    level = np.abs(means.normals[:, 2]) < 0.1
    azimuth = azimuth_angle(means.normals[level])
    nothing = np.full(len(ORDERS), math.nan)
    if len(np.unique(np.round(azimuth / DEGREE))) < _FEWEST:
        return ReversedPairs(
            means, frozen(half), nothing, nothing, nothing[:2], math.nan, 0.0, ((),) * 3
        )
    together = _not_told_apart(azimuth)
    found, covariance, noise, dof = _lobes(azimuth, half[level], together)
    pairs = found.reshape(-1, 2)
    variances = np.diag(covariance).reshape(-1, 2).mean(axis=1)
    places = [_ALL.index(order) for order in ORDERS]
    hidden = [any(order in others for others in together[:row]) for row, order in enumerate(ORDERS)]
    size = np.hypot(pairs[places, 0], pairs[places, 1])
    return ReversedPairs(
        means,
        frozen(half),
        frozen(np.where(hidden, math.nan, size)),
        frozen(np.where(hidden, math.nan, np.sqrt(variances[places]))),
        frozen(-pairs[0]),
        noise,
        dof,
        together,
    )


def _columns(azimuth: FloatArray, orders: Sequence[int]) -> FloatArray:
    """Cosine and sine of each order, (n, 2 k)."""
    waves = [wave(order * azimuth) for order in orders for wave in (np.cos, np.sin)]
    return np.stack(waves, axis=1)


def _not_told_apart(azimuth: FloatArray) -> tuple[tuple[int, ...], ...]:
    """Higher orders that look like each of `ORDERS` in these directions: n directions at equal
    steps show the orders m and n - m, n + m, 2 n - m, … alike.
    """
    found = []
    for order in ORDERS:
        basis = np.linalg.qr(_columns(azimuth, [order]))[0]
        alike = []
        for other in _ALL[_ALL.index(order) + 1 :]:
            columns = _columns(azimuth, [other])
            size = float(np.sum(columns**2))
            explained = float(np.sum((basis.T @ columns) ** 2))
            if explained > _ALIKE * size:
                alike.append(other)
        found.append(tuple(alike))
    return tuple(found)


def _lobes(
    azimuth: FloatArray, half: FloatArray, together: Sequence[Sequence[int]]
) -> tuple[FloatArray, FloatArray, float, float]:
    """Cosines and sines of `_ALL` (2 k,), their covariance, noise of a touch, and its dof.

    Orders that are distinguished are free; of higher ones the size is known in advance, relative to
    all lobes beyond the run-out. The noise is averaged over (a normal prior of its logarithm).
    """
    columns = _columns(azimuth, _ALL)
    first = columns[:, :2]
    beyond = half - first @ np.linalg.lstsq(first, half, rcond=None)[0]
    size = math.sqrt(2.0 * float(np.mean(beyond**2)))
    hidden = {other for others in together for other in others}
    shares = [_share(order) for order in _ALL]
    spread = [
        _FREE if order in ORDERS and order not in hidden else share * size / math.sqrt(2.0)
        for order, share in zip(_ALL, shares, strict=True)
    ]
    prior = np.repeat(np.maximum(spread, 1e-9), 2) ** 2
    shared = (columns * prior) @ columns.T
    logs, means, covariances = [], [], []
    for noise in _NOISES:
        total = shared + 0.5 * noise**2 * np.eye(len(half))
        gain = np.linalg.solve(total, columns * prior).T
        means.append(gain @ half)
        covariances.append(np.diag(prior) - gain @ (columns * prior))
        log_determinant = float(np.linalg.slogdet(total)[1])
        log = -0.5 * (log_determinant + float(half @ np.linalg.solve(total, half)))
        logs.append(log - 0.5 * math.log(noise / _TYPICAL_NOISE) ** 2)
    weights = np.exp(np.array(logs) - max(logs))
    weights /= weights.sum()
    mean = np.tensordot(weights, means, axes=1)
    apart = np.array(means) - mean
    covariance = np.tensordot(weights, covariances, axes=1) + (apart.T * weights) @ apart
    squares = np.array(_NOISES) ** 2
    variance = float(weights @ squares)
    doubt = float(weights @ (squares - variance) ** 2)
    dof = min(2.0 * variance**2 / max(doubt, 1e-30), float(len(half)))
    return mean, covariance, math.sqrt(variance), max(dof, 1.0)


def _share(order: int) -> float:
    """Usual size of an odd lobe over that of three, root mean square of drawn six-seat probes.

    Of 450 drawn probes: 0.13 to 0.20, 0.05 to 0.08, 0.04 for orders 9, 15, 21, which an even probe
    has too; 0.07 to 0.27, 0.06 to 0.21, 0.04 to 0.12 for 5, 7, 11.
    """
    return (3.0 / order) ** 1.5 if order % 3 == 0 else 0.2 * 5.0 / order
