"""Likely causes of a change of a probe, with their probabilities.

Every cause is a pattern over the directions, or a change of the scatter, with a prior for its
size. The probability of the touches under each is an integral over the size (Bayes); the centre of
the reference is unknown throughout. A bent stylus and a moved tip shift the centre only, and
touches on a sphere do not show them. A reference that drifts while it is touched is no change of
the probe, but differs from the map in a pattern of its own: it is a cause, too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray
from pretravel.maps import PretravelMap
from pretravel.qualification.change_tests import (
    TouchesAndMap,
    covariance_if_turned,
    turned_value,
    without_center,
)
from pretravel.qualification.touch_order import drift_columns


class Cause(StrEnum):
    """What can have changed, in the words of reports."""

    PRELOAD = "spring preload"
    STYLUS_LENGTH = "stylus length"
    TURNED = "turn about the axis"
    TIP_SIZE = "tip size"
    LOOSE = "loose stylus or tip"
    SOFT_SIDE = "softer to one side"
    ONE_DIRECTION = "one direction"
    DRIFT = "drift of the reference"
    STEADIER = "steadier touches"
    UNKNOWN = "unknown"
    CHANCE = "chance"


CAUSES = {
    Cause.PRELOAD: 0.15,
    Cause.STYLUS_LENGTH: 0.15,
    Cause.TURNED: 0.20,
    Cause.TIP_SIZE: 0.15,
    Cause.LOOSE: 0.10,
    Cause.SOFT_SIDE: 0.05,
    Cause.ONE_DIRECTION: 0.05,
    Cause.DRIFT: 0.05,
    Cause.STEADIER: 0.02,
    Cause.UNKNOWN: 0.08,
}
"""Causes of a change and their prior probabilities; `Cause.CHANCE`, no change, has that of all."""

_LOWER_PRELOAD = 0.8
"""Probability that a changed preload is a lower one: springs relax."""
_SIZES = {Cause.PRELOAD: 0.2, Cause.STYLUS_LENGTH: 0.3, Cause.TIP_SIZE: 3.0 * MICROMETRE}
"""Standard deviations of the sizes before the touches: relative, and of the tip's radius."""
_TURNS = 20.0 * DEGREE
_LOG_ANY_TURN = math.log(0.05 * math.sqrt(2.0 * math.pi) * _TURNS / (2.0 * math.pi))
"""Density of any angle in a twentieth of all turns, over that of no angle: the spindle stood at
another orientation."""
_SOFT = 2.0 * MICROMETRE
_ONE_DIRECTION = 10.0 * MICROMETRE
_DRIFT = 5.0 * MICROMETRE
_SCATTER = 2.0
"""Of the logarithm of the ratio of variances: a factor of 2.7 in the standard deviation."""
_UNKNOWN_SIZES = MICROMETRE * np.geomspace(0.1, 30.0, 9)
_UNKNOWN_ANGLE = 0.6
"""Directions closer than this change alike, in an unknown smooth change. [rad]"""
_SCATTER_ALSO = 0.1
"""Probability that the scatter changes with another cause."""
_MODEL = {Cause.PRELOAD: 0.05, Cause.STYLUS_LENGTH: 0.1}
"""Relative uncertainty of a size from what the patterns leave out."""
_TYPICAL_LEVEL = 10.0 * MICROMETRE
"""Mean pretravel of a map whose level is not known."""
_BENDING_POWER, _BENDING_SHARE = 2.3, 0.9
"""Pretravel grows with this power of the stylus's length, and changes by this share of a change of
preload (bending is linear, Hertz's contacts are not); 2.0 to 2.5 and 0.86 to 0.94 in the
catalogue."""
_AXIAL_RATIO = 0.03
_MENTIONED = 0.1
"""Causes with a smaller probability are not in a report."""


@dataclass(frozen=True)
class LikelyCause:
    """A cause of a change, with its probability.

    Attributes
    ----------
    name : Cause
        One of `CAUSES`, or `Cause.CHANCE`: a false alarm.
    probability : float
        Among all causes.
    value, u : float
        Size of the change and its standard uncertainty if this is the cause: relative (preload,
        length), angle [rad], radius of the tip [mm], scatter over that of the map, largest
        difference of a soft side or of one direction [mm], drift from the first touch to the last
        [mm]; nan where there is no size.
    direction : tuple of float
        Where one direction alone has changed, probe frame; else empty.
    """

    name: Cause
    probability: float
    value: float = math.nan
    u: float = math.nan
    direction: tuple[float, ...] = ()

    @property
    def mentioned(self) -> bool:
        """Whether it is probable enough to be in a report."""
        return self.probability >= _MENTIONED


@dataclass(frozen=True)
class _Evidence:
    """Logarithm of the probability of the touches, over that without a change."""

    log: float
    value: float = math.nan
    u: float = math.nan
    direction: tuple[float, ...] = ()


def likely_causes(compared: TouchesAndMap, pretravel_map: PretravelMap) -> tuple[LikelyCause, ...]:
    """Causes that explain a change, the most probable first.

    Parameters
    ----------
    compared : TouchesAndMap
        New touches and map.
    pretravel_map : PretravelMap

    Returns
    -------
    tuple of LikelyCause
        All of them; their probabilities add up to one.

    Notes
    -----
    A pattern g of size b has the prior N(0, s²), for the preload with 0.8 of its probability below
    zero. With weights W (the inverse covariance, free of the centre), the touches y have the
    evidence exp(½ (gᵀW y)² v) √(v / s²), v = 1 / (gᵀW g + 1 / s²), over that of no change. An
    unknown change has independent or smooth differences of any size from 0.1 to 30 µm.
    """
    patterns = _of_patterns(compared, pretravel_map)
    same, larger, smaller = _of_scatter(compared)
    also = np.logaddexp(
        same + math.log(1.0 - _SCATTER_ALSO),
        np.logaddexp(larger, smaller) + math.log(0.5 * _SCATTER_ALSO),
    )
    found = {
        name: _Evidence(e.log + also, e.value, e.u, e.direction) for name, e in patterns.items()
    }
    factor = math.exp(0.5 * compared.scatter_ratio)
    u_factor = 0.5 * factor * compared.u_scatter_ratio
    found[Cause.LOOSE] = _Evidence(larger, factor, u_factor)
    found[Cause.STEADIER] = _Evidence(smaller, factor, u_factor)
    logs = {name: e.log + math.log(CAUSES[name]) for name, e in found.items()}
    found[Cause.CHANCE], logs[Cause.CHANCE] = _Evidence(same), same
    total = np.logaddexp.reduce(list(logs.values()))
    causes = [
        LikelyCause(name, math.exp(logs[name] - total), e.value, e.u, e.direction)
        for name, e in found.items()
    ]
    return tuple(sorted(causes, key=lambda cause: -cause.probability))


def _of_patterns(compared: TouchesAndMap, pretravel_map: PretravelMap) -> dict[Cause, _Evidence]:
    weights = compared.weights
    preload, length = _patterns_of_forces(compared, pretravel_map)
    found = {
        Cause.PRELOAD: _of_size(compared, weights, preload, _SIZES[Cause.PRELOAD], _LOWER_PRELOAD),
        Cause.STYLUS_LENGTH: _of_size(compared, weights, length, _SIZES[Cause.STYLUS_LENGTH]),
        # A smaller tip touches later, which looks like a larger pretravel.
        Cause.TIP_SIZE: _of_size(compared, weights, -np.ones(len(preload)), _SIZES[Cause.TIP_SIZE]),
        Cause.TURNED: _of_turn(compared, weights, pretravel_map),
        Cause.SOFT_SIDE: _of_soft_side(compared, weights),
        Cause.ONE_DIRECTION: _of_one_direction(compared, weights),
        Cause.DRIFT: _of_drift(compared, weights),
        Cause.UNKNOWN: _Evidence(_of_unknown(compared)),
    }
    for name, relative in _MODEL.items():
        e = found[name]
        found[name] = _Evidence(e.log, e.value, math.hypot(e.u, relative * e.value))
    return found


def _patterns_of_forces(
    compared: TouchesAndMap, pretravel_map: PretravelMap
) -> tuple[FloatArray, FloatArray]:
    """Change of pretravel per relative change of preload and of stylus length, (g,) each. [mm]"""
    directions = compared.observation.group_directions
    known = pretravel_map.basis.sensitivities(directions)
    if known:
        return known["preload"], known["stylus_length"]
    value = compared.value
    if not pretravel_map.provenance.level_known:
        value = value - float(np.mean(value)) + _TYPICAL_LEVEL
    along = directions[:, 2] ** 2
    across = 1.0 - along
    lateral = across / (across + _AXIAL_RATIO * along)
    return _BENDING_SHARE * value, _BENDING_POWER * lateral * value


def _of_size(
    compared: TouchesAndMap,
    weights: FloatArray,
    pattern: FloatArray,
    spread: float,
    below: float = 0.5,
) -> _Evidence:
    """Of one pattern with a size N(0, spread²); `below` is the probability of a negative size."""
    from scipy.special import log_ndtr

    slope = float(pattern @ weights @ compared.differences)
    variance = 1.0 / (float(pattern @ weights @ pattern) + 1.0 / spread**2)
    mean = variance * slope
    log = 0.5 * slope * mean + 0.5 * math.log(variance / spread**2)
    score = mean / math.sqrt(variance)
    sides = np.logaddexp(
        math.log(2.0 * below) + log_ndtr(-score), math.log(2.0 - 2.0 * below) + log_ndtr(score)
    )
    return _Evidence(log + float(sides), mean, math.sqrt(variance))


def _of_turn(
    compared: TouchesAndMap, weights: FloatArray, pretravel_map: PretravelMap
) -> _Evidence:
    """Of a turn: the map turned by the best of many angles, and its slope there (Laplace)."""
    observation, y = compared.observation, compared.differences
    step = 2.5 * DEGREE
    angles = np.arange(-71, 73) * step
    steps = np.stack(
        [turned_value(observation, pretravel_map, angle) - compared.value for angle in angles]
    )
    apart = y - steps
    prior = np.minimum(0.5 * (angles / _TURNS) ** 2, -_LOG_ANY_TURN)
    best = angles[np.argmin(0.5 * np.einsum("ag,gh,ah->a", apart, weights, apart) + prior)]
    for _ in range(2):
        ahead, there, behind = (
            turned_value(observation, pretravel_map, best + shift * DEGREE) - compared.value
            for shift in (0.5, 0.0, -0.5)
        )
        covariance = covariance_if_turned(compared, pretravel_map, best)
        slope, left = (ahead - behind) / DEGREE, y - there
        weights = without_center(covariance, compared.center)
        # Beyond, the spindle stood elsewhere: all angles are alike.
        tight = 0.0 if 0.5 * (best / _TURNS) ** 2 > -_LOG_ANY_TURN else _TURNS**-2
        variance = 1.0 / (float(slope @ weights @ slope) + tight)
        push = float(slope @ weights @ left) - best * tight
        log = _log_probability(compared.center, left, covariance) - _log_probability(
            compared.center, y, compared.covariance
        )
        log += 0.5 * push**2 * variance + 0.5 * math.log(variance / _TURNS**2)
        log += max(-0.5 * (best / _TURNS) ** 2, _LOG_ANY_TURN)
        best = best + variance * push
    return _Evidence(log, best, math.sqrt(variance))


def _of_soft_side(compared: TouchesAndMap, weights: FloatArray) -> _Evidence:
    """Of a stylus or seat that yields more across one axis: a second harmonic of the azimuth."""
    x, y, _ = compared.observation.group_directions.T
    pattern = np.column_stack([x**2 - y**2, 2.0 * x * y])
    return _of_vector(compared, weights, pattern, _SOFT)


def _of_drift(compared: TouchesAndMap, weights: FloatArray) -> _Evidence:
    """Of a reference that moves while it is touched, steadily or as a machine that warms up."""
    seen = compared.observation
    counts, order = np.bincount(seen.groups), np.arange(len(seen.groups))
    found = []
    for slows in (False, True):
        moved = drift_columns(seen.directions[:, : seen.axes], order, slows=slows)
        means = np.stack([np.bincount(seen.groups, column) for column in moved.T], axis=1)
        found.append(_of_vector(compared, weights, means / counts[:, None], _DRIFT))
    likelier = max(found, key=lambda each: each.log)
    both = float(np.logaddexp.reduce([each.log for each in found])) - math.log(len(found))
    return replace(likelier, log=both)


def _of_vector(
    compared: TouchesAndMap, weights: FloatArray, pattern: FloatArray, spread: float
) -> _Evidence:
    """Of a size along each column, N(0, spread²) each; the whole size and its u."""
    slope = pattern.T @ weights @ compared.differences
    columns = pattern.shape[1]
    precision = pattern.T @ weights @ pattern + np.eye(columns) / spread**2
    covariance = np.linalg.inv(precision)
    mean = covariance @ slope
    log = (
        0.5 * float(slope @ mean)
        + 0.5 * math.log(np.linalg.det(covariance))
        - columns * math.log(spread)
    )
    size = float(np.linalg.norm(mean))
    along = mean / size if size else np.eye(columns)[0]
    return _Evidence(log, size, math.sqrt(float(along @ covariance @ along)))


def _of_one_direction(compared: TouchesAndMap, weights: FloatArray) -> _Evidence:
    """Of a difference in one direction alone, any of them: dirt or a chip on the reference."""
    precision = np.diagonal(weights) + 1.0 / _ONE_DIRECTION**2
    slope = weights @ compared.differences
    logs = 0.5 * slope**2 / precision - 0.5 * np.log(precision * _ONE_DIRECTION**2)
    best = int(np.argmax(logs))
    return _Evidence(
        float(np.logaddexp.reduce(logs)) - math.log(len(logs)),
        float(slope[best] / precision[best]),
        1.0 / math.sqrt(precision[best]),
        tuple(float(x) for x in compared.observation.group_directions[best]),
    )


def _of_unknown(compared: TouchesAndMap) -> float:
    """Of differences without a known pattern: independent or smooth ones, of any size."""
    directions = compared.observation.group_directions
    angle = np.arccos(np.clip(directions @ directions.T, -1.0, 1.0))
    center, y = compared.center, compared.differences
    smooth = np.exp(-0.5 * (angle / _UNKNOWN_ANGLE) ** 2)
    none = _log_probability(center, y, compared.covariance)
    logs = [
        _log_probability(center, y, compared.covariance + size**2 * shape) - none
        for shape in (np.eye(len(angle)), smooth)
        for size in _UNKNOWN_SIZES
    ]
    return float(np.logaddexp.reduce(logs)) - math.log(len(logs))


def _log_probability(center: FloatArray, y: FloatArray, covariance: FloatArray) -> float:
    """Of the differences, the centre integrated out (restricted likelihood)."""
    root = np.linalg.cholesky(covariance)
    center, y = np.linalg.solve(root, center), np.linalg.solve(root, y)
    q, r = np.linalg.qr(center)
    left = y - q @ (q.T @ y)
    logs = np.log(np.diagonal(root)).sum() + np.log(np.abs(np.diagonal(r))).sum()
    return float(-0.5 * left @ left - logs)


def _of_scatter(compared: TouchesAndMap) -> tuple[float, float, float]:
    """Logarithms of the probability of the scatter if it is the same, larger, smaller."""
    from scipy.special import log_ndtr

    if math.isnan(compared.scatter_ratio):
        return 0.0, -math.inf, -math.inf
    ratio, variance = compared.scatter_ratio, compared.u_scatter_ratio**2
    same = -0.5 * (ratio**2 / variance + math.log(variance))
    wide = variance + _SCATTER**2
    changed = -0.5 * (ratio**2 / wide + math.log(wide)) + math.log(2.0)
    score = ratio * _SCATTER / math.sqrt(variance * wide)
    return same, changed + float(log_ndtr(score)), changed + float(log_ndtr(-score))
