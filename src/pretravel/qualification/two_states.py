"""A tip that rests in one of two places: a seat with dirt, wear or a loose ball.

Repeats of a direction then lie on two levels, apart by the part of one and the same movement along
the normal. A memory of the push before and a drift explain such repeats worse.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.qualification.within_directions import centred_within

_MOST_REPEATS = 8
"""Of a direction, whose 2⁸ assignments are compared."""
_FEWEST_DIRECTIONS = 8
_ROUNDS = 40
_LEAST_SHARE = 0.15
"""Of the touches in the rarer state: fewer are single errors, or the tails of the noise."""
_NOISE_FLOOR = 1e-8  # mm


@dataclass(frozen=True)
class TwoStates:
    """Two places in which the tip rests.

    Attributes
    ----------
    movement : (3,) float
        From the one to the other, as columns of directions explain it. [mm]
    share : float
        Of touches in the rarer one.
    noise : float
        Standard deviation of a touch in one state. [mm]
    logarithm : float
        Of the likelihood, less the cost of four free numbers (BIC).
    """

    movement: FloatArray
    share: float
    noise: float
    logarithm: float

    @property
    def size(self) -> float:
        """Distance of the places. [mm]"""
        return float(np.linalg.norm(self.movement))

    def variance(self, directions: FloatArray) -> float:
        """Mean square of a touch about its mean, over directions (g, 3). [mm²]"""
        along = directions @ self.movement
        return self.noise**2 + self.share * (1.0 - self.share) * float(np.mean(along**2))


def two_states(values: FloatArray, directions: FloatArray, groups: IntArray) -> TwoStates | None:
    """The two states that explain touches best, by their differences within directions.

    Parameters
    ----------
    values : (n,) float
        Pretravel. [mm]
    directions : (n, 3) float
    groups : (n,) int

    Returns
    -------
    TwoStates or None
        None with too few repeated directions, or where the rarer state has too few touches.

    Notes
    -----
    A mixture over all assignments of the touches of each direction to two states, by expectation
    and maximisation, with a free mean for each direction.

    >>> rng, groups = np.random.default_rng(1), np.repeat(np.arange(40), 3)
    >>> n = rng.standard_normal((40, 3))[groups]
    >>> n /= np.linalg.norm(n, axis=1, keepdims=True)
    >>> later = rng.integers(0, 2, 120) * (n @ [0.002, 0.0, 0.0])
    >>> found = two_states(later + rng.normal(0.0, 2e-4, 120), n, groups)
    >>> round(found.size, 4), found.share > 0.25
    (0.002, True)
    """
    sets = _assignments(values, directions, groups)
    if sum(len(part.normals) for part in sets) < _FEWEST_DIRECTIONS:
        return None
    free = sum(part.seen.size - len(part.seen) for part in sets)
    start = math.sqrt(sum(float(np.sum(part.seen**2)) for part in sets) / free) + _NOISE_FLOOR
    axes = _axes_of_scatter(sets)
    best: TwoStates | None = None
    for axis in axes:
        found = _maximised(sets, 2.0 * start * axis, start, free)
        if best is None or found.logarithm > best.logarithm:
            best = found
    return best if best is not None and best.share >= _LEAST_SHARE else None


@dataclass(frozen=True)
class _Repeats:
    """Directions with equally many touches: centred values, and those of each assignment."""

    normals: FloatArray  # (g, 3)
    seen: FloatArray  # (g, m), centred
    states: FloatArray  # (a, m), centred
    later: FloatArray  # (a,), touches in the second state


def _assignments(values: FloatArray, directions: FloatArray, groups: IntArray) -> list[_Repeats]:
    order = np.argsort(groups, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(groups))[:-1])
    found = []
    for count in sorted({min(len(part), _MOST_REPEATS) for part in parts if len(part) > 1}):
        rows = np.array(
            [part[:count] for part in parts if min(len(part), _MOST_REPEATS) == count],
            dtype=np.intp,
        )
        seen = values[rows]
        states = np.array(list(product((0.0, 1.0), repeat=count)))
        found.append(
            _Repeats(
                directions[rows[:, 0]],
                seen - seen.mean(axis=1, keepdims=True),
                states - states.mean(axis=1, keepdims=True),
                states.sum(axis=1),
            )
        )
    return found


def _axes_of_scatter(sets: list[_Repeats]) -> FloatArray:
    """Directions along which repeats scatter most, (3, 3): squares as a quadratic of normals."""
    normals = np.vstack([part.normals for part in sets])
    squares = np.concatenate([np.mean(part.seen**2, axis=1) for part in sets])
    x, y, z = normals.T
    columns = np.column_stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z])
    a, b, c, d, e, f = np.linalg.lstsq(columns, squares, rcond=1e-3)[0]
    axes = np.linalg.eigh(np.array([[a, d, e], [d, b, f], [e, f, c]]))[1]
    return np.asarray(axes.T[::-1])


def _maximised(sets: list[_Repeats], movement: FloatArray, noise: float, free: int) -> TwoStates:
    share, logarithm = 0.5, -math.inf
    noise = 0.5 * noise
    touches = sum(part.seen.size for part in sets)
    for _ in range(_ROUNDS):
        before = logarithm
        found = [_expected(part, movement, share, noise) for part in sets]
        logarithm = sum(logs for logs, _ in found) - free * math.log(noise)
        if logarithm - before < 1e-6 * abs(logarithm):
            break
        normal, right, later = 1e-12 * np.eye(3), np.zeros(3), 0.0
        for part, (_, weights) in zip(sets, found, strict=True):
            own = weights @ np.sum(part.states**2, axis=1)
            normal += (part.normals * own[:, None]).T @ part.normals
            right += np.einsum("ga,am,gm->g", weights, part.states, part.seen) @ part.normals
            later += float(np.sum(weights @ part.later))
        normal += 1e-6 * float(np.trace(normal)) * np.eye(3)
        movement = np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
        share = min(max(later / touches, 1e-3), 1.0 - 1e-3)
        rest = sum(
            float(np.sum(weights * _squares(part, movement)))
            for part, (_, weights) in zip(sets, found, strict=True)
        )
        noise = math.sqrt(rest / free) + _NOISE_FLOOR
    cost = 2.0 * math.log(free)
    return TwoStates(movement, min(share, 1.0 - share), noise, logarithm - cost)


def _squares(part: _Repeats, movement: FloatArray) -> FloatArray:
    """What each assignment leaves of each direction, (g, a). [mm²]"""
    along = part.normals @ movement
    left = part.seen[:, None, :] - along[:, None, None] * part.states
    return np.asarray(np.sum(left**2, axis=2))


def _expected(
    part: _Repeats, movement: FloatArray, share: float, noise: float
) -> tuple[float, FloatArray]:
    """Logarithm of the likelihood, and the probability of each assignment, (g, a)."""
    count = part.seen.shape[1]
    prior = part.later * math.log(share) + (count - part.later) * math.log(1.0 - share)
    each = prior - 0.5 * _squares(part, movement) / noise**2
    top = each.max(axis=1, keepdims=True)
    weights = np.exp(each - top)
    total = weights.sum(axis=1, keepdims=True)
    return float(np.sum(top + np.log(total))), np.asarray(weights / total)


def logarithm_of_columns(values: FloatArray, columns: FloatArray, groups: IntArray) -> float:
    """The same logarithm for effects of time or order that add up, with their columns (n, k)."""
    seen = centred_within(values, groups)
    free = len(seen) - len(np.unique(groups))
    count = columns.shape[1]
    if count:
        within = centred_within(columns, groups)
        seen = seen - within @ np.linalg.lstsq(within, seen, rcond=1e-6)[0]
    variance = float(seen @ seen) / free + _NOISE_FLOOR**2
    return float(-0.5 * free * (math.log(variance) + 1.0) - 0.5 * count * math.log(free))
