"""Probabilities of the causes of a change, against integrals over the sizes, summed on grids.

Priors are those of the table in docs/machine.md. The touches, their covariance and the map are made
by hand, so that each cause, and none, explains part of the differences.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import stats

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.change_causes import CAUSES, Cause, likely_causes
from pretravel.qualification.change_tests import TouchesAndMap
from pretravel.qualification.touch_noise import TouchNoise
from pretravel.uncertainty.covariance import Covariance

UM, DEGREE = 1e-3, math.pi / 180.0
COUNT = 17
N = fibonacci_cap(COUNT, 1.5)
LEVEL, LOBES = 9.0 * UM, 2.5 * UM  # of Y_00 and of Y_33
VARIANCES = np.array([0.02, 0.05]) ** 2 * UM**2
RELATIVE = np.where(np.arange(COUNT) % 4 == 1, 2.0, 1.0)
TURN = 1.5 * DEGREE


def _functions(n: np.ndarray, angle: float = 0.0) -> np.ndarray:
    """1, and sin³θ cos 3φ of a probe turned by an angle, each of mean square 1, (g, 2)."""
    across, azimuth = np.hypot(n[:, 0], n[:, 1]), np.arctan2(n[:, 1], n[:, 0]) - angle
    lobes = math.sqrt(35.0 / 8.0) * across**3 * np.cos(3.0 * azimuth)
    return np.stack([np.ones(len(n)), lobes], axis=1)


def _map(level_known: bool) -> PretravelMap:
    terms = np.array([[0, 0], [3, 3]])
    scale = HarmonicBasis(terms).design(N[3:4])[0] / _functions(N[3:4])[0]
    return PretravelMap(
        HarmonicBasis(terms),
        np.array([LEVEL, LOBES]) / scale,
        Covariance.independent(VARIANCES / scale**2),
        DirectionSupport(N),
        tip_radius=3.0,
        provenance=Provenance(level_known=level_known),
    )


def _value(angle: float = 0.0) -> np.ndarray:
    return np.asarray(_functions(N, angle) @ [LEVEL, LOBES])


def _map_covariance(angle: float = 0.0) -> np.ndarray:
    functions = _functions(N, angle)
    root = np.sqrt(RELATIVE)
    return np.asarray((functions * VARIANCES) @ functions.T * np.outer(root, root))


def _compared(ratio: float = 0.5, u_ratio: float = 0.3) -> TouchesAndMap:
    rng = np.random.default_rng(3)
    variances = (0.3 * UM) ** 2 * RELATIVE / RELATIVE.mean()
    noise = TouchNoise(
        Scatter(0.3 * UM, 30.0), 0.3 * UM, variances, variances, 0.0 * variances,
        np.full(COUNT, 3.0), 0.0,
    )  # fmt: skip
    x, y, _ = N.T
    differences = (
        _value(TURN) - _value()
        + 0.15 * UM
        + 0.2 * UM * (x**2 - y**2)
        + 0.4 * UM * (np.arange(COUNT) == 5)
        + N @ [0.01, -0.02, 0.005]  # the centre, which no evidence may depend on
        + 0.1 * UM * rng.standard_normal(COUNT)
    )  # fmt: skip
    covariance = _map_covariance() + np.diag(variances / 3.0)
    return TouchesAndMap(
        observation=Observation(15.5 * N, np.arange(COUNT), np.zeros(3), 12.5, 3.0, ring=False),
        noise=noise, scatter_of_touches=noise.scatter, step=0.0, value=_value(),
        differences=differences, design=np.column_stack([N, np.ones(COUNT), _value(), _value()]),
        of_map=_map_covariance(), covariance=covariance, scatter_of_map=noise.scatter,
        scatter_ratio=ratio, u_scatter_ratio=u_ratio, p_repeatability=0.5,
    )  # fmt: skip


def _quadratic(covariance: np.ndarray) -> tuple[np.ndarray, float]:
    """Matrix P and constant of the restricted likelihood exp(-½ yᵀP y + constant)."""
    inverse = np.linalg.inv(covariance)
    information = N.T @ inverse @ N
    free = inverse - inverse @ N @ np.linalg.inv(information) @ N.T @ inverse
    logs = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
    return free, -0.5 * float(logs)


def _log(y: np.ndarray, covariance: np.ndarray) -> float:
    free, constant = _quadratic(covariance)
    return float(-0.5 * y @ free @ y) + constant


def _mean_and_deviation(x: np.ndarray, density: np.ndarray) -> tuple[float, float]:
    mean = float(np.sum(x * density) / np.sum(density))
    return mean, math.sqrt(float(np.sum((x - mean) ** 2 * density) / np.sum(density)))


def _of_pattern(pattern: np.ndarray, spread: float, below: float) -> tuple[float, float, float]:
    """Evidence over that of no change; mean and deviation of the size with an even prior."""
    compared = _compared()
    free, _ = _quadratic(compared.covariance)
    size = np.linspace(-6.0 * spread, 6.0 * spread, 20_001)
    gain = size * float(pattern @ free @ compared.differences)
    likelihood = np.exp(gain - 0.5 * size**2 * float(pattern @ free @ pattern))
    prior = stats.norm.pdf(size, scale=spread)
    sided = prior * np.where(size < 0.0, 2.0 * below, 2.0 * (1.0 - below))
    step = size[1] - size[0]
    return float(np.sum(likelihood * sided)) * step, *_mean_and_deviation(size, likelihood * prior)


def _of_turn() -> tuple[float, float, float]:
    compared = _compared()
    angle = np.arange(-60.0, 60.0, 0.25) * DEGREE
    none = _log(compared.differences, compared.covariance)
    logs = [
        _log(
            compared.differences - (_value(a) - _value()),
            compared.covariance + _map_covariance(a) - _map_covariance(),
        )
        for a in angle
    ]
    density = np.exp(np.array(logs) - none) * stats.norm.pdf(angle, scale=20.0 * DEGREE)
    return float(np.sum(density)) * 0.25 * DEGREE, *_mean_and_deviation(angle, density)


def _of_soft_side() -> float:
    compared = _compared()
    free, _ = _quadratic(compared.covariance)
    x, y, _ = N.T
    spread = 2.0 * UM
    grid = np.linspace(-5.0 * spread, 5.0 * spread, 201)
    pattern = np.stack([x**2 - y**2, 2.0 * x * y])
    sizes = np.stack([a.ravel() for a in np.meshgrid(grid, grid)])
    gain = (pattern @ free @ compared.differences) @ sizes
    loss = 0.5 * np.einsum("ia,ij,ja->a", sizes, pattern @ free @ pattern.T, sizes)
    prior = np.prod(stats.norm.pdf(sizes, scale=spread), axis=0)
    return float(np.sum(np.exp(gain - loss) * prior) * (grid[1] - grid[0]) ** 2)


def _of_unknown() -> float:
    compared = _compared()
    none = _log(compared.differences, compared.covariance)
    angle = np.arccos(np.clip(N @ N.T, -1.0, 1.0))
    return float(
        np.mean(
            [
                math.exp(_log(compared.differences, compared.covariance + s**2 * shape) - none)
                for shape in (np.eye(COUNT), np.exp(-0.5 * (angle / 0.6) ** 2))
                for s in UM * 0.1 * 300.0 ** (np.arange(9) / 8.0)
            ]
        )
    )


def _of_drift() -> float:
    """A movement with the covariance s² adds s² P Pᵀ to that of the touches; 0 to 1 is the run."""
    compared = _compared()
    none = _log(compared.differences, compared.covariance)
    time = np.arange(COUNT) / (COUNT - 1.0)
    found = []
    for course in (time, (1.0 - np.exp(-3.0 * time)) / (1.0 - math.exp(-3.0))):
        moved = 5.0 * UM * course[:, None] * N
        found.append(_log(compared.differences, compared.covariance + moved @ moved.T) - none)
    return float(np.mean(np.exp(found)))


@cache
def _shapes(level_known: bool) -> dict[str, tuple[float, ...]]:
    """Evidence of each pattern, and where there are any its size and u, from the integrals."""
    value = _value() if level_known else _value() - _value().mean() + 10.0 * UM
    along = N[:, 2] ** 2
    bending = (1.0 - along) / (1.0 - along + 0.03 * along)
    ones = [_of_pattern(row, 10.0 * UM, 0.5) for row in np.eye(COUNT)]
    return {
        Cause.PRELOAD: _of_pattern(0.9 * value, 0.2, 0.8),
        Cause.STYLUS_LENGTH: _of_pattern(2.3 * bending * value, 0.3, 0.5),
        Cause.TIP_SIZE: _of_pattern(-np.ones(COUNT), 3.0 * UM, 0.5),
        Cause.TURNED: _of_turn(),
        Cause.SOFT_SIDE: (_of_soft_side(),),
        Cause.ONE_DIRECTION: (float(np.mean([one[0] for one in ones])), *max(ones)[1:]),
        Cause.DRIFT: (_of_drift(),),
        Cause.UNKNOWN: (_of_unknown(),),
    }


def _of_scatter(ratio: float, u_ratio: float) -> tuple[float, float, float]:
    """Probability densities of the ratio if it is the same, larger, smaller."""
    if math.isnan(ratio):
        return 1.0, 0.0, 0.0  # nothing was repeated: the scatter says nothing
    true = np.linspace(-16.0, 16.0, 32_001)
    seen = stats.norm.pdf(ratio - true, scale=u_ratio) * stats.norm.pdf(true, scale=2.0)
    step = true[1] - true[0]
    same = float(stats.norm.pdf(ratio, scale=u_ratio))
    sides = (float(np.sum(seen[part])) * 2.0 * step for part in (true > 0.0, true < 0.0))
    return same, *sides


def _expected(level_known: bool, ratio: float, u_ratio: float) -> dict[str, float]:
    same, larger, smaller = _of_scatter(ratio, u_ratio)
    also = 0.9 * same + 0.05 * larger + 0.05 * smaller
    share = {name: CAUSES[name] * values[0] * also for name, values in _shapes(level_known).items()}
    share |= {Cause.LOOSE: 0.1 * larger, Cause.STEADIER: 0.02 * smaller, Cause.CHANCE: same}
    total = sum(share.values())
    return {name: value / total for name, value in share.items()}


@pytest.mark.parametrize("level_known", [True, False])
@pytest.mark.parametrize(("ratio", "u_ratio"), [(0.5, 0.3), (-0.7, 0.4), (math.nan, math.nan)])
def test_probabilities_are_those_of_the_integrals(
    level_known: bool, ratio: float, u_ratio: float
) -> None:
    """1 %: the turn's integral is Laplace's approximation, the others' are exact."""
    causes = likely_causes(_compared(ratio, u_ratio), _map(level_known))
    expected = _expected(level_known, ratio, u_ratio)
    found = {cause.name: cause.probability for cause in causes}
    # Others are too small to see a wrong evidence.
    repeated = {name for name, share in expected.items() if share > 1e-6}
    assert {*found} - repeated == (set() if ratio == ratio else {Cause.LOOSE, Cause.STEADIER})
    assert found == pytest.approx(expected, rel=0.01)
    assert [c.probability for c in causes] == sorted((c.probability for c in causes), reverse=True)


@pytest.mark.parametrize("level_known", [True, False])
def test_sizes_and_their_u_are_those_of_the_integrals(level_known: bool) -> None:
    found = {cause.name: cause for cause in likely_causes(_compared(), _map(level_known))}
    # The patterns of preload and of length leave out 5 % and 10 % of a size.
    beside = {Cause.PRELOAD: 0.05, Cause.STYLUS_LENGTH: 0.1}
    for name, (_, *size) in _shapes(level_known).items():
        if size:
            value, u = size
            near = 0.01 if name == Cause.TURNED else 1e-4
            assert found[name].value == pytest.approx(value, rel=near)
            u = math.hypot(u, beside.get(name, 0.0) * value)
            assert found[name].u == pytest.approx(u, rel=3.0 * near)
    likeliest = int(np.argmax([_of_pattern(row, 10.0 * UM, 0.5)[0] for row in np.eye(COUNT)]))
    assert found[Cause.ONE_DIRECTION].direction == pytest.approx(tuple(N[likeliest]), abs=1e-12)
    # The deviation is the root of the variance: half of the relative uncertainty of its logarithm.
    assert found[Cause.LOOSE].value == found[Cause.STEADIER].value == pytest.approx(math.exp(0.25))
    assert (
        found[Cause.LOOSE].u == found[Cause.STEADIER].u == pytest.approx(0.5 * 0.3 * math.exp(0.25))
    )
    assert math.isnan(found[Cause.UNKNOWN].value)


def test_the_priors_are_those_of_the_page() -> None:
    assert sum(CAUSES.values()) == pytest.approx(1.0)
    assert CAUSES == {
        Cause.PRELOAD: 0.15,
        Cause.STYLUS_LENGTH: 0.15,
        Cause.TURNED: 0.2,
        Cause.TIP_SIZE: 0.15,
        Cause.LOOSE: 0.1,
        Cause.SOFT_SIDE: 0.05,
        Cause.ONE_DIRECTION: 0.05,
        Cause.DRIFT: 0.05,
        Cause.STEADIER: 0.02,
        Cause.UNKNOWN: 0.08,
    }


def test_a_softer_side_is_as_large_along_any_azimuth() -> None:
    """Directions in rings of eight: a pattern turned by 30° has the same size and u."""
    azimuth = np.arange(16) * (np.pi / 4.0)
    polar = np.where(np.arange(16) < 8, 1.5, 0.8)
    found = []
    for angle in (0.0, 30.0 * DEGREE):
        n = np.stack(
            [np.sin(polar) * np.cos(azimuth + angle), np.sin(polar) * np.sin(azimuth + angle),
             np.cos(polar)], axis=1,
        )  # fmt: skip
        base = _compared()
        noise = replace(
            base.noise, variances=np.full(16, 1e-7), raw_variances=np.full(16, 1e-7),
            spreads=np.zeros(16), counts=np.ones(16),
        )  # fmt: skip
        compared = replace(
            base,
            observation=Observation(15.5 * n, np.arange(16), np.zeros(3), 12.5, 3.0, ring=False),
            noise=noise, value=np.full(16, 0.01), design=np.column_stack([n, np.ones((16, 3))]),
            differences=2.0 * UM * np.sin(polar) ** 2 * np.cos(2.0 * azimuth),
            covariance=np.diag(np.full(16, 1e-7)), of_map=np.zeros((16, 16)),
        )  # fmt: skip
        soft = next(c for c in likely_causes(compared, _map(True)) if c.name == Cause.SOFT_SIDE)
        found.append((soft.value, soft.u))
    # A pattern whose eight touches in each ring sum to 4 (sin²θ)², with the prior of 2 µm.
    precision = 4.0 * float(np.sum(np.sin([1.5, 0.8]) ** 4)) / 1e-7 + 1.0 / (2.0 * UM) ** 2
    size = 2.0 * UM * (1.0 - 1.0 / (precision * (2.0 * UM) ** 2))
    assert found == [pytest.approx((size, precision**-0.5), rel=1e-9)] * 2


@pytest.mark.parametrize("turn", [12.0, -9.0])
def test_a_turn_that_noise_nearly_hides_is_drawn_to_zero_by_its_prior(turn: float) -> None:
    """3° from the touches, 20° before them, and a map without error: the most probable angle is on
    a grid, its u from the slope of sin³θ cos 3(φ - a), and the evidence from both (Laplace)."""
    certain = replace(_map(True), covariance=Covariance.independent([0.0, 0.0]))
    covariance = np.diag(np.full(COUNT, (1.7 * UM) ** 2))
    differences = _value(turn * DEGREE) - _value()
    compared = replace(_compared(), differences=differences, covariance=covariance)
    found = next(c for c in likely_causes(compared, certain) if c.name == Cause.TURNED)
    free, _ = _quadratic(covariance)
    angle = np.arange(-15.0, 15.0, 0.005) * DEGREE
    left = differences - np.stack([_value(a) - _value() for a in angle])
    logs = -0.5 * np.einsum("ag,gh,ah->a", left, free, left) - 0.5 * (angle / (20 * DEGREE)) ** 2
    best = float(angle[np.argmax(logs)])
    slope = 3.0 * (_functions(N, best - 30.0 * DEGREE) - [1.0, 0.0]) @ [0.0, LOBES]
    precision = float(slope @ free @ slope) + (20.0 * DEGREE) ** -2
    assert 0.02 * abs(turn) < abs(turn) - abs(best) / DEGREE < 0.05 * abs(turn)
    assert found.value == pytest.approx(best, rel=1e-3)
    assert found.u == pytest.approx(precision**-0.5, rel=1e-3)
    none = -0.5 * float(differences @ free @ differences)
    log = float(logs.max()) - none - 0.5 * math.log(precision * (20.0 * DEGREE) ** 2)
    same, larger, smaller = _of_scatter(0.5, 0.3)
    share = next(c.probability for c in likely_causes(compared, certain) if c.name == Cause.CHANCE)
    also = (0.9 * same + 0.05 * larger + 0.05 * smaller) / same
    assert found.probability / share == pytest.approx(0.2 * math.exp(log) * also, rel=2e-3)
