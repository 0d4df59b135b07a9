"""Has a probe changed since it was qualified? A test with a stated rate of false alarms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.maps.bases import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.qualification.observation import observe
from pretravel.touches import Touches, at_rest
from pretravel.units import DEGREE

_RESOLUTION = 2e-5
"""Repeatabilities below this are that of the last digit of a reading. [mm]"""
_TURN = 0.5 * DEGREE
_TESTS = 3
_POWER = 0.95
_DISTINCT = 1e-4
"""Ways to change that are more alike than this are not told apart."""
_COARSE = ("mean", "sectors", "wozniak")


@dataclass(frozen=True)
class Change:
    """One way in which a probe can have changed, with what was found of it.

    Attributes
    ----------
    value, u : float
        Estimate and standard uncertainty.
    seen : float
        Size that the test would see with 95 % probability.
    """

    value: float
    u: float
    seen: float


@dataclass(frozen=True, eq=False)
class Verification:
    """New touches on the reference held against a map.

    Attributes
    ----------
    changed : bool
        Whether any of the three tests says so.
    false_alarm_rate : float
        Probability that an unchanged probe is called changed, all tests together.
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
        Mean pretravel less map, and what is expected of it. [mm]
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
        Qualified, of the same tip, at the same feed (or with its signal delay told apart).
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
        A map that states no uncertainty; a rate that is none; fewer than 5 directions (4 on a
        ring); touches that cannot be of this reference; a feed that is not the map's.
    ExtrapolationError
        Directions outside the map.

    Notes
    -----
    The centre is fitted. Differences of direction means from the map have the covariance of
    the map plus that of the repeatability. An unchanged probe is called changed if one of three
    tests at a third of the rate each says so: size, amplitude and turn against F with 3, all
    directions against F with their number less the centre's, the variance of repeats
    (two-sided); with the degrees of freedom of the map's repeatability in the denominator.
    """
    from scipy import stats

    if not 0.0 < false_alarm_rate < 0.5:
        raise PretravelError(
            f"false-alarm rate {false_alarm_rate:g}: it lies between 0 and 0.5 (0.01 is usual)"
        )
    if not pretravel_map.states_uncertainty:
        raise PretravelError(
            "this map states no uncertainty (a prediction, or a table), so what counts as a change "
            "cannot be said; use a map of pretravel qualify"
        )
    if pretravel_map.kind in _COARSE:
        raise PretravelError(
            f"a map of kind {pretravel_map.kind} does not follow the probe closely enough: what it "
            "misses would look like a change. Qualify with --kind harmonic or physical"
        )
    warnings = _feed_warnings(touches, pretravel_map)
    if touches.source and f"from {touches.source}" in pretravel_map.provenance.get("touches", ""):
        warnings.append(
            f"the map was made from touches of a file of this name, {touches.source}: on its own "
            "touches a map shows no change. Touch the reference anew"
        )
    if pretravel_map.delay is not None:
        touches = at_rest(touches, pretravel_map.delay)
    seen = observe(touches, diameter, ring, 2.0 * pretravel_map.tip_radius, pretravel_map.rotation)
    groups = seen.groups
    count = np.bincount(groups)
    directions = seen.group_directions
    if len(count) < seen.axes + 2:
        raise PretravelError(
            f"{len(count)} directions: the centre takes {seen.axes}, and at least {seen.axes + 2} "
            "are needed to see a change"
        )
    machine = directions @ pretravel_map.rotation.T
    value = pretravel_map.pretravel(machine)
    # Single values less the map's own slope within a group: directions differ by 0.1° at most.
    mean = np.bincount(groups, seen.values) / count
    sigma = max(pretravel_map.repeatability, _RESOLUTION)
    dof = pretravel_map.repeatability_dof
    noise = sigma**2 / count
    variation = value - float(np.mean(value))
    turned = directions @ probe_rotation(rotation=_TURN).T @ pretravel_map.rotation.T
    slope = (pretravel_map.pretravel(turned, extrapolate=True) - value) / _TURN
    center = directions[:, : seen.axes]
    # A probe turned by +a has the map that it had a before.
    design = np.column_stack([center, np.ones(len(value)), variation, -slope])
    covariance = pretravel_map.value_covariance(machine) + np.diag(noise)
    if isinstance(pretravel_map.basis, HarmonicBasis):
        # Its covariance holds for the lobes' azimuth that was found, whose own variance is about
        # what touches like the new ones leave of a turn.
        information = np.linalg.pinv((design.T / noise) @ design, hermitian=True)
        covariance += information[-1, -1] * np.outer(slope, slope)
    whitened = np.linalg.cholesky(covariance)
    y = np.linalg.solve(whitened, mean - value)
    x = np.linalg.solve(whitened, design)
    only_center = x[:, : seen.axes]
    shift = np.linalg.lstsq(only_center, y, rcond=None)[0]
    left = y - only_center @ shift
    p_map = _p_value(float(left @ left), len(value) - seen.axes, dof)
    usable = _told_apart(x, seen.axes)
    used = [*range(seen.axes), *usable]
    estimate, own_covariance = _least_squares(x[:, used], y)
    wanted = slice(seen.axes, None)
    b, c = estimate[wanted], own_covariance[wanted, wanted]
    p_form = _p_value(float(b @ np.linalg.solve(c, b)), len(b), dof)
    rate = false_alarm_rate / _TESTS
    detectable = _noncentrality(len(b), rate)
    changes = {
        index: Change(float(b[i]), math.sqrt(c[i, i]), math.sqrt(detectable * c[i, i]))
        for i, index in enumerate(usable)
    }
    unseen = Change(0.0, math.inf, math.inf)
    free = int(np.sum(count - 1))
    repeatability, p_repeatability = math.nan, math.nan
    if free > 0:
        scatter = seen.values - mean[groups]
        repeatability = math.sqrt(float(scatter @ scatter) / free)
        ratio = (max(repeatability, _RESOLUTION) / sigma) ** 2
        law = stats.f(free, dof) if math.isfinite(dof) else stats.chi2(free, scale=1.0 / free)
        p_repeatability = float(2.0 * min(law.sf(ratio), law.cdf(ratio), 0.5))
    tests = [p for p in (p_form, p_map, p_repeatability) if not math.isnan(p)]
    differences = mean - value - center @ shift
    return Verification(
        changed=min(tests) < rate,
        false_alarm_rate=false_alarm_rate,
        p_form=p_form,
        p_map=p_map,
        p_repeatability=p_repeatability,
        size=changes.get(seen.axes, unseen),
        amplitude=changes.get(seen.axes + 1, unseen),
        turn=changes.get(seen.axes + 2, unseen),
        repeatability=repeatability,
        repeatability_dof=float(free),
        largest=float(np.max(np.abs(differences))),
        directions=directions,
        differences=differences,
        u_differences=np.sqrt(np.diagonal(covariance)),
        touches=len(touches),
        warnings=tuple(warnings),
    )


def _feed_warnings(touches: Touches, pretravel_map: PretravelMap) -> list[str]:
    if pretravel_map.delay is not None or pretravel_map.feed is None:
        return []
    if touches.feeds is None:
        return [
            (
                "the touches do not tell their feed, and another than that of the map "
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


def _told_apart(x: FloatArray, axes: int) -> list[int]:
    """Columns beside the centre's that the directions tell apart: size, then amplitude, then turn.

    A flat map has no amplitude and no turn; few directions leave no room for them.
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
