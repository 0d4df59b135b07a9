"""Tests of new touches against a map: size, amplitude and turn; all directions; scatter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, FloatArray, PretravelError, probe_rotation
from pretravel.maps import Observation, PretravelMap, Scatter
from pretravel.qualification.touch_noise import TouchNoise, fixed_part, touch_noise

_RESOLUTION = 2e-5
"""A repeatability below this is that of the last digit of a reading. [mm]"""
MOST_VERIFIED = 2000
"""With more directions the covariances of all their pairs need more than a gigabyte."""
_TURN = 0.5 * DEGREE
TESTS = 3
_POWER = 0.95
_DISTINCT = 1e-4
"""Changes that are more alike than this are not separated."""
_LARGER = 0.9
"""Share of false alarms of the test of scatter that say that it is larger.

A smaller scatter is no fault of a probe; a bad touch of the qualification causes it."""
_SAME_SCATTER = 0.05
"""With a p-value above this, the scatter of map and new touches is determined from both."""


@dataclass(frozen=True)
class Change:
    """One way in which a probe can have changed, with its estimate.

    Attributes
    ----------
    value, u : float
        Estimate and standard uncertainty.
    detectable : float
        Size that the test detects with 95 % probability.
    """

    value: float
    u: float
    detectable: float


@dataclass(frozen=True, eq=False)
class TouchesAndMap:
    """Mean touches of each of g directions, less the map.

    Attributes
    ----------
    observation : Observation
    noise : TouchNoise
        Of the new touches; with that of the map, unless they differ.
    scatter_of_touches : Scatter
        Of the new touches alone, among repeats.
    step : float
        Of the positions. [mm]
    value : (g,) float
        The map. [mm]
    differences : (g,) float
        Mean less map. [mm]
    design : (g, axes + 3) float
        Columns of centre, size, amplitude and turn.
    of_map, covariance : (g, g) float
        Covariance of the map, and of the differences. [mm²]
    scatter_of_map : Scatter
        Of a touch, as far as it is known from the map.
    scatter_ratio, u_scatter_ratio : float
        Logarithm of the variance among repeats over that of the map, and its standard
        uncertainty; nan without repeats.
    p_repeatability : float
        Two-sided; nan without repeats.
    """

    observation: Observation
    noise: TouchNoise
    scatter_of_touches: Scatter
    step: float
    value: FloatArray
    differences: FloatArray
    design: FloatArray
    of_map: FloatArray
    covariance: FloatArray
    scatter_of_map: Scatter
    scatter_ratio: float
    u_scatter_ratio: float
    p_repeatability: float

    @property
    def center(self) -> FloatArray:
        """Columns of a shift of the centre, (g, axes)."""
        return self.design[:, : self.observation.axes]

    @property
    def raw_covariance(self) -> FloatArray:
        """Covariance of the differences with the variances as each direction shows them, (g, g).

        It is uncertain, but unbiased also where directions that scatter most are those that a
        pattern depends on. [mm²]
        """
        noise = self.noise
        factor = np.sqrt(noise.raw_variances / float(np.mean(noise.raw_variances)) / noise.relative)
        of_means = np.diagonal(self.covariance) - np.diagonal(self.of_map)
        own = of_means + (noise.raw_variances - noise.variances) / noise.counts
        return np.asarray(self.of_map * np.outer(factor, factor) + np.diag(own))

    @property
    def weights(self) -> FloatArray:
        """Inverse of the covariance where any centre is allowed, (g, g). [1/mm²]"""
        return without_center(self.covariance, self.center)


def without_center(covariance: FloatArray, center: FloatArray) -> FloatArray:
    """Inverse of a covariance for differences whose centre is free, (g, g). [1/mm²]

    >>> without_center(np.eye(2), np.array([[1.0], [1.0]])).round(12).tolist()
    [[0.5, -0.5], [-0.5, 0.5]]
    """
    inverse = np.linalg.inv(covariance)
    seen = inverse @ center
    return np.asarray(inverse - seen @ np.linalg.pinv(center.T @ seen, hermitian=True) @ seen.T)


@dataclass(frozen=True)
class ChangeTests:
    """What the tests find.

    Attributes
    ----------
    changed : bool
        Whether any of them finds a change.
    false_alarm_rate : float
        Of all of them together.
    p_form, p_map, p_repeatability : float
        Size, amplitude and turn together; all directions together; scatter of repeats.
    size, amplitude, turn : Change
    largest : float
        Largest difference of a direction, centre fitted. [mm]
    differences : (g,) float
        Centre fitted. [mm]
    """

    changed: bool
    false_alarm_rate: float
    p_form: float
    p_map: float
    p_repeatability: float
    size: Change
    amplitude: Change
    turn: Change
    largest: float
    differences: FloatArray


def touches_and_map(
    observation: Observation, pretravel_map: PretravelMap, step: float, u_size: float = 0.0
) -> TouchesAndMap:
    """Compare the mean touches of each direction with a map.

    Parameters
    ----------
    observation : Observation
    pretravel_map : PretravelMap
    step : float
        Of the positions; zero where they have none. [mm]
    u_size : float
        Standard uncertainty of all differences together: of the radii of two references. [mm]

    Raises
    ------
    PretravelError
        Fewer directions than the centre and a change need, more than `MOST_VERIFIED`, or some
        outside the map.
    """
    counts = np.bincount(observation.groups)
    axes = observation.axes
    if len(counts) < axes + 2:
        raise PretravelError(
            f"{len(counts)} directions: the centre takes {axes}, and at least {axes + 2} are "
            "needed to detect a change"
        )
    if len(counts) > MOST_VERIFIED:
        raise PretravelError(
            f"{len(counts)} directions: a verification compares every pair of directions, of "
            f"{MOST_VERIFIED} directions at most; 25 are enough. Give a part of these touches, "
            "or qualify with all of them"
        )
    of_map = Scatter(max(pretravel_map.repeatability, _RESOLUTION), pretravel_map.repeatability_dof)
    noise = touch_noise(observation, of_map, step)
    own = noise.scatter
    ratio, u_ratio, p_repeatability = _scatter_ratio(noise, of_map, step)
    if p_repeatability > _SAME_SCATTER:
        noise = noise.pooled_with(of_map)
    # Directions within a group differ by 0.1° at most: the map's slope within it is left out.
    mean = np.bincount(observation.groups, observation.values) / counts
    directions = observation.group_directions
    machine = directions @ pretravel_map.rotation.T
    value = pretravel_map.pretravel(machine)
    slope = (turned_value(observation, pretravel_map, _TURN) - value) / _TURN
    center = directions[:, :axes]
    design = np.column_stack([center, np.ones(len(value)), value - float(np.mean(value)), slope])
    fixed = max(noise.fixed_variance, pretravel_map.fixed_scatter**2)
    of_means = noise.variances / noise.counts + fixed
    uncertain = _covariance_of_map(pretravel_map, machine, noise, of_map, step) + u_size**2
    return TouchesAndMap(
        observation=observation,
        noise=noise,
        scatter_of_touches=own,
        step=step,
        value=value,
        differences=mean - value,
        design=design,
        of_map=uncertain,
        covariance=uncertain + np.diag(of_means),
        scatter_of_map=of_map,
        scatter_ratio=ratio,
        u_scatter_ratio=u_ratio,
        p_repeatability=p_repeatability,
    )


def turned_value(observation: Observation, pretravel_map: PretravelMap, angle: float) -> FloatArray:
    """The map of the probe turned about its axis by an angle [rad], at the directions, (g,). [mm]

    A probe turned by +a has the pretravel at an azimuth that it had at the azimuth less a.
    """
    return pretravel_map.pretravel(_turned(observation, pretravel_map, angle), extrapolate=True)


def _turned(observation: Observation, pretravel_map: PretravelMap, angle: float) -> FloatArray:
    turned = observation.group_directions @ probe_rotation(rotation=angle)
    return np.asarray(turned @ pretravel_map.rotation.T)


def _covariance_of_map(
    pretravel_map: PretravelMap,
    normals: FloatArray,
    noise: TouchNoise,
    of_map: Scatter,
    step: float,
) -> FloatArray:
    """Covariance of the map at the directions, with the noise that touches show by direction.

    Touches of the qualification had the same noise by direction, on the same machine.
    """
    stated = pretravel_map.value_covariance(normals)
    larger = np.sqrt(noise.relative)
    covariance = stated * np.outer(larger, larger)
    fixed = fixed_part(of_map.deviation, step) - pretravel_map.fixed_scatter**2
    if fixed <= 0.0:
        return np.asarray(covariance)
    # The map was fitted as if its repeats reduced all of the noise. Its covariance over the
    # variance of its mean touches is how much of the noise the fit follows, at most all of it.
    repeats = 1.0
    if math.isfinite(of_map.dof):
        repeats += of_map.dof / len(pretravel_map.support.nodes)
    values, vectors = np.linalg.eigh(stated * repeats / of_map.deviation**2)
    followed = (vectors * np.clip(values, 0.0, 1.0)) @ vectors.T
    return np.asarray(covariance + fixed * followed)


def covariance_if_turned(
    compared: TouchesAndMap, pretravel_map: PretravelMap, angle: float
) -> FloatArray:
    """Covariance of the differences from the map of the probe turned by an angle [rad], (g, g).

    The map is less certain between the directions that were touched for it. [mm²]
    """
    normals = compared.observation.group_directions @ pretravel_map.rotation.T
    there = _turned(compared.observation, pretravel_map, angle)
    larger = np.sqrt(compared.noise.relative)
    change = pretravel_map.value_covariance(there) - pretravel_map.value_covariance(normals)
    return np.asarray(compared.covariance + change * np.outer(larger, larger))


def _scatter_ratio(noise: TouchNoise, of_map: Scatter, step: float) -> tuple[float, float, float]:
    """Logarithm of the ratio of variances, its standard uncertainty, and the p-value."""
    if noise.scatter.dof == 0.0:
        return math.nan, math.nan, math.nan
    # One touch on the other side of a step, which may or may not have occurred, counts in both.
    crossing = step**2 / 3.0 / len(noise.counts)
    new = max(noise.scatter.deviation, _RESOLUTION) ** 2 + crossing
    trimmed = max(noise.trimmed, _RESOLUTION) ** 2 + crossing
    old = of_map.deviation**2 + crossing
    # Heavy tails and different directions reduce the degrees of freedom of the map's as well.
    dof = noise.scatter.dof
    dof_of_map = of_map.dof * dof / float(np.sum(noise.counts - 1.0))
    larger = _p_value(min(new, trimmed) / old, dof, dof_of_map)
    smaller = 1.0 - _p_value(new / old, dof, dof_of_map)
    p_value = min(larger / _LARGER, smaller / (1.0 - _LARGER), 1.0)
    return math.log(new / old), math.sqrt(2.0 / dof + 2.0 / dof_of_map), p_value


def changes_of(compared: TouchesAndMap, false_alarm_rate: float) -> ChangeTests:
    """All tests, each at its share of the false-alarm rate.

    Parameters
    ----------
    compared : TouchesAndMap
    false_alarm_rate : float
        Of all tests together.
    """
    rate = false_alarm_rate / TESTS
    root = np.asarray(np.linalg.cholesky(compared.covariance), dtype=np.float64)
    design = np.linalg.solve(root, compared.design)
    y = np.linalg.solve(root, compared.differences)
    axes = compared.observation.axes
    shift = np.linalg.lstsq(design[:, :axes], y, rcond=None)[0]
    left = y - design[:, :axes] @ shift
    freedom = float(len(y) - axes)
    statistic = float(left @ left)
    spread, dof = _spread_of_statistic(compared, freedom)
    p_map = _p_value(statistic / freedom, 2.0 / spread, dof)
    p_form, changes = _test_of_form(compared, root, rate, dof)
    differences = compared.differences - compared.center @ shift
    tests = [p for p in (p_form, p_map, compared.p_repeatability) if not math.isnan(p)]
    return ChangeTests(
        changed=min(tests) < rate,
        false_alarm_rate=false_alarm_rate,
        p_form=p_form,
        p_map=p_map,
        p_repeatability=compared.p_repeatability,
        size=changes[0],
        amplitude=changes[1],
        turn=changes[2],
        largest=float(np.max(np.abs(differences))),
        differences=differences,
    )


def _spread_of_statistic(compared: TouchesAndMap, freedom: float) -> tuple[float, float]:
    """Relative variance of the sum of squares, and degrees of freedom of its scale.

    A direction whose variance is uncertain has heavier tails than a normal distribution: a normal
    scale mixture of relative variance c has the excess kurtosis 3 c.
    """
    noise, weights = compared.noise, compared.weights
    own = np.diagonal(weights)
    # The map follows its own touches, with the same noise by direction.
    both = own * np.diagonal(compared.covariance)
    spread = 2.0 / freedom + float(np.sum(3.0 * noise.spreads * both**2)) / freedom**2
    share = float(np.sum(own * noise.variances / noise.counts)) / freedom
    known = noise.scatter if noise.scatter.dof > 0.0 else compared.scatter_of_map
    relative = 2.0 * share**2 / known.dof
    if math.isfinite(compared.scatter_of_map.dof):
        relative += 2.0 * (1.0 - share) ** 2 / compared.scatter_of_map.dof
    return spread, 2.0 / relative if relative > 0.0 else math.inf


def _test_of_form(
    compared: TouchesAndMap, root: FloatArray, rate: float, dof: float
) -> tuple[float, list[Change]]:
    """P of size, amplitude and turn together, and each of them."""
    axes = compared.observation.axes
    x = np.asarray(np.linalg.solve(root, compared.design), dtype=np.float64)
    usable = separable_columns(x, axes)
    part = x[:, [*range(axes), *usable]]
    own_covariance = np.linalg.pinv(part.T @ part, hermitian=True)
    gain = np.linalg.solve(root.T, part @ own_covariance).T[axes:]
    b, c = gain @ compared.differences, own_covariance[axes:, axes:]
    if np.any(compared.noise.spreads > 0.0):
        raw = np.linalg.solve(c, gain @ compared.raw_covariance @ gain.T)
        c = c * max(float(np.trace(raw)) / len(b), 1.0)
    p_form = _p_value(float(b @ np.linalg.solve(c, b)) / len(b), float(len(b)), dof)
    detectable = noncentrality(len(b), rate)
    changes = [Change(0.0, math.inf, math.inf)] * 3
    for i, column in enumerate(usable):
        changes[column - axes] = Change(
            float(b[i]), math.sqrt(c[i, i]), math.sqrt(detectable * c[i, i])
        )
    return p_form, changes


def separable_columns(x: FloatArray, axes: int) -> list[int]:
    """Further columns that the directions separate: size, then amplitude, then turn.

    A flat map has no amplitude and no turn; few directions do not determine them.

    Parameters
    ----------
    x : (g, axes + 3) float
        Columns as those of `TouchesAndMap.design`, in any weights.
    axes : int
    """
    chosen = list(range(axes))
    scaled = x / np.maximum(np.linalg.norm(x, axis=0), 1e-300)
    weak = np.linalg.norm(x, axis=0) < 1e-6 * np.linalg.norm(x[:, axes])
    for column in range(axes, axes + 3):
        trial = [*chosen, column]
        values = np.linalg.svd(scaled[:, trial], compute_uv=False)
        if not weak[column] and len(values) == len(trial) and values[-1] > _DISTINCT * values[0]:
            chosen = trial
    return chosen[axes:]


def _p_value(ratio: float, freedom: float, dof: float) -> float:
    """P of a mean square over its expectation."""
    from scipy.special import chdtrc, fdtrc

    if math.isfinite(dof):
        return float(fdtrc(freedom, dof, ratio))
    return float(chdtrc(freedom, ratio * freedom))


def noncentrality(freedom: int, rate: float) -> float:
    """Of the chi-square that is above its limit with 95 % probability."""
    from scipy.special import chdtri, chndtrinc

    return float(chndtrinc(chdtri(freedom, rate), freedom, 1.0 - _POWER))
