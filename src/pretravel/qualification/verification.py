"""Test whether a probe has changed since it was qualified, with a stated false-alarm rate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.observe import observe
from pretravel.touches import Touches, at_rest
from pretravel.units import DEGREE

_RESOLUTION = 2e-5
"""A repeatability below this is that of the last digit of a reading. [mm]"""
_TURN = 0.5 * DEGREE
_TESTS = 3
_POWER = 0.95
_DISTINCT = 1e-4
"""Changes that are more alike than this are not separated."""


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
class Verification:
    """New touches on the reference, compared with a map.

    Attributes
    ----------
    changed : bool
        Whether any of the three tests finds a change.
    false_alarm_rate : float
        Probability that an unchanged probe is reported as changed, all tests together.
    p_form, p_map, p_repeatability : float
        Of the tests: size, amplitude and turn together; all directions together; scatter of
        repeats (nan without repeats).
    size, amplitude, turn : Change
        Pretravel in all directions alike [mm]; of the map's variation, as a share; about the
        probe's axis [rad].
    repeatability : float
        Of the new touches; nan without repeats. [mm]
    repeatability_dof : float
    largest : float
        Largest difference of a direction's mean from the map, centre fitted. [mm]
    directions : (g, 3) float
        Probe frame.
    differences, u_differences : (g,) float
        Mean pretravel less map, and its standard uncertainty. [mm]
    touches : int
    warnings : tuple of str
    """

    changed: bool
    false_alarm_rate: float
    p_form: float
    p_map: float
    p_repeatability: float
    size: Change
    amplitude: Change
    turn: Change
    repeatability: float
    repeatability_dof: float
    largest: float
    directions: FloatArray
    differences: FloatArray
    u_differences: FloatArray
    touches: int
    warnings: tuple[str, ...]


def verify(
    touches: Touches,
    pretravel_map: PretravelMap,
    diameter: float,
    *,
    ring: bool = False,
    false_alarm_rate: float = 0.01,
) -> Verification:
    """Test whether a probe is still that of its map.

    Parameters
    ----------
    touches : Touches
        New ones on the reference, wherever it stands now.
    pretravel_map : PretravelMap
        Qualified, of the same tip, at the same feed (or with its signal delay separated).
    diameter : float
        Of the reference, that of the qualification. [mm]
    ring : bool
    false_alarm_rate : float
        For all tests together.

    Returns
    -------
    Verification

    Raises
    ------
    PretravelError
        A map that states no uncertainty; a rate outside its range; fewer than 5 directions (4 on
        a ring); touches that cannot be of this reference; another feed than the map's.
    ExtrapolationError
        Directions outside the map.

    Notes
    -----
    The centre is fitted. Differences of direction means from the map have the covariance of
    the map plus that of the repeatability. A probe is reported as changed if one of three tests,
    each at a third of the rate, rejects: size, amplitude and turn against F with 3, all
    directions against F with their number less the centre's, the variance of repeats
    (two-sided); with the degrees of freedom of the map's repeatability in the denominator.
    """
    _refuse_unusable(pretravel_map, false_alarm_rate)
    warnings = _feed_warnings(touches, pretravel_map)
    if touches.source and touches.source == pretravel_map.provenance.touches_file:
        warnings.append(
            f"the map was made from touches of a file of this name, {touches.source}: on its own "
            "touches a map shows no change. Touch the reference anew"
        )
    if pretravel_map.delay is not None:
        touches = at_rest(touches, pretravel_map.delay)
    setup = QualificationSetup(diameter, 2.0 * pretravel_map.tip_radius, ring)
    comparison = _compared(observe(touches, setup, pretravel_map.rotation), pretravel_map)
    rate = false_alarm_rate / _TESTS
    p_map, shift = _test_of_all_directions(comparison)
    p_form, changes = _test_of_form(comparison, rate)
    repeats, p_repeatability = _test_of_repeatability(comparison)
    tests = [p for p in (p_form, p_map, p_repeatability) if not math.isnan(p)]
    differences = comparison.differences - comparison.center @ shift
    return Verification(
        changed=min(tests) < rate,
        false_alarm_rate=false_alarm_rate,
        p_form=p_form,
        p_map=p_map,
        p_repeatability=p_repeatability,
        size=changes[0],
        amplitude=changes[1],
        turn=changes[2],
        repeatability=repeats.deviation if repeats.dof > 0.0 else math.nan,
        repeatability_dof=repeats.dof,
        largest=float(np.max(np.abs(differences))),
        directions=comparison.observation.group_directions,
        differences=differences,
        u_differences=np.sqrt(np.diagonal(comparison.covariance)),
        touches=len(touches),
        warnings=tuple(warnings),
    )


def _refuse_unusable(pretravel_map: PretravelMap, false_alarm_rate: float) -> None:
    if not 0.0 < false_alarm_rate < 0.5:
        raise PretravelError(
            f"the false-alarm rate is {false_alarm_rate:g}; it lies between 0 and 0.5 (0.01 is "
            "usual)",
            inputs=("false_alarm_rate", "false_alarms"),
        )
    if not pretravel_map.states_uncertainty:
        raise PretravelError(
            "this map states no uncertainty (a prediction, or a table), so there is no limit "
            "beyond which a difference is a change; use a map of pretravel qualify"
        )
    if not pretravel_map.basis.follows_probe:
        raise PretravelError(
            f"a map of kind {pretravel_map.kind} does not follow the probe closely enough: the "
            "part of pretravel that it does not represent would look like a change. Qualify with "
            "kind harmonic or physical"
        )


@dataclass(frozen=True, eq=False)
class _Compared:
    """Mean touches of each direction beside the map, and the ways in which they can differ."""

    observation: Observation
    differences: FloatArray
    """Mean less map, (g,). [mm]"""
    mean: FloatArray
    center: FloatArray
    """Columns of a shift of the centre, (g, axes)."""
    covariance: FloatArray
    """Of the differences, (g, g). [mm²]"""
    whitened_design: FloatArray
    """Columns of centre, size, amplitude and turn."""
    whitened_differences: FloatArray
    sigma: float
    """Repeatability of the map. [mm]"""
    dof: float


def _compared(observation: Observation, pretravel_map: PretravelMap) -> _Compared:
    count = np.bincount(observation.groups)
    axes = observation.axes
    if len(count) < axes + 2:
        raise PretravelError(
            f"{len(count)} directions: the centre takes {axes}, and at least {axes + 2} are needed "
            "to detect a change"
        )
    directions = observation.group_directions
    machine = directions @ pretravel_map.rotation.T
    value = pretravel_map.pretravel(machine)
    # Directions within a group differ by 0.1° at most: the map's slope within it is left out.
    mean = np.bincount(observation.groups, observation.values) / count
    sigma = max(pretravel_map.repeatability, _RESOLUTION)
    noise = sigma**2 / count
    variation = value - float(np.mean(value))
    turned = directions @ probe_rotation(rotation=_TURN).T @ pretravel_map.rotation.T
    slope = (pretravel_map.pretravel(turned, extrapolate=True) - value) / _TURN
    center = directions[:, :axes]
    # A probe turned by +a has the map that it had a before.
    design = np.column_stack([center, np.ones(len(value)), variation, -slope])
    covariance = pretravel_map.value_covariance(machine) + np.diag(noise)
    turn_variance = pretravel_map.basis.turn_variance(design, noise)
    if turn_variance:
        covariance = covariance + turn_variance * np.outer(slope, slope)
    root = np.linalg.cholesky(covariance)
    return _Compared(
        observation=observation,
        differences=mean - value,
        mean=mean,
        center=center,
        covariance=covariance,
        whitened_design=np.linalg.solve(root, design),
        whitened_differences=np.linalg.solve(root, mean - value),
        sigma=sigma,
        dof=pretravel_map.repeatability_dof,
    )


def _test_of_all_directions(compared: _Compared) -> tuple[float, FloatArray]:
    """P of all differences together, the centre fitted; and the shift of the centre. [mm]"""
    only_center = compared.whitened_design[:, : compared.center.shape[1]]
    y = compared.whitened_differences
    shift = np.linalg.lstsq(only_center, y, rcond=None)[0]
    left = y - only_center @ shift
    freedom = len(y) - compared.center.shape[1]
    p_value = _p_value(float(left @ left), freedom, compared.dof)
    return p_value, np.asarray(shift, dtype=np.float64)


def _test_of_form(compared: _Compared, rate: float) -> tuple[float, list[Change]]:
    """P of size, amplitude and turn together, and each of them."""
    axes, x = compared.center.shape[1], compared.whitened_design
    usable = _separable(x, axes)
    estimate, own_covariance = _least_squares(
        x[:, [*range(axes), *usable]], compared.whitened_differences
    )
    b, c = estimate[axes:], own_covariance[axes:, axes:]
    p_form = _p_value(float(b @ np.linalg.solve(c, b)), len(b), compared.dof)
    detectable = _noncentrality(len(b), rate)
    changes = [Change(0.0, math.inf, math.inf)] * 3
    for i, column in enumerate(usable):
        changes[column - axes] = Change(
            float(b[i]), math.sqrt(c[i, i]), math.sqrt(detectable * c[i, i])
        )
    return p_form, changes


def _test_of_repeatability(compared: _Compared) -> tuple[Scatter, float]:
    """Scatter of the new repeats, and its two-sided p; nan without repeats."""
    from scipy import stats

    groups, dof = compared.observation.groups, compared.dof
    free = int(np.sum(np.bincount(groups) - 1))
    if free == 0:
        return Scatter(0.0, 0.0), math.nan
    scatter = compared.observation.values - compared.mean[groups]
    deviation = math.sqrt(float(scatter @ scatter) / free)
    ratio = (max(deviation, _RESOLUTION) / compared.sigma) ** 2
    law = stats.f(free, dof) if math.isfinite(dof) else stats.chi2(free, scale=1.0 / free)
    p_value = float(2.0 * min(law.sf(ratio), law.cdf(ratio), 0.5))
    return Scatter(deviation, float(free)), p_value


def _feed_warnings(touches: Touches, pretravel_map: PretravelMap) -> list[str]:
    if pretravel_map.delay is not None or pretravel_map.feed is None:
        return []
    if touches.feeds is None:
        return [
            (
                "the touches do not state their feed; another feed than that of the map "
                f"({pretravel_map.feed:g} mm/min) looks like a change of size"
            ),
        ]
    if np.any(np.abs(touches.feeds / pretravel_map.feed - 1.0) > 0.01):
        raise PretravelError(
            f"the map was made at {pretravel_map.feed:g} mm/min, these touches at "
            f"{touches.feeds.min():g} to {touches.feeds.max():g}: feed × signal delay would look "
            "like a change. Touch at the map's feed, or qualify at two feeds"
        )
    return []


def _separable(x: FloatArray, axes: int) -> list[int]:
    """Columns beside the centre's that the directions separate: size, then amplitude, then turn.

    A flat map has no amplitude and no turn; few directions do not determine them.
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


def _least_squares(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    information = np.linalg.pinv(x.T @ x, hermitian=True)
    return np.asarray(information @ x.T @ y), np.asarray(information)


def _p_value(statistic: float, freedom: int, dof: float) -> float:
    from scipy import stats

    if math.isfinite(dof):
        return float(stats.f.sf(statistic / freedom, freedom, dof))
    return float(stats.chi2.sf(statistic, freedom))


def _noncentrality(freedom: int, rate: float) -> float:
    """Of the chi-square that is above its limit with 95 % probability."""
    from scipy import stats
    from scipy.optimize import brentq

    limit = stats.chi2.isf(rate, freedom)
    return float(brentq(lambda x: stats.ncx2.sf(limit, freedom, x) - _POWER, 1e-3, 1e4))
