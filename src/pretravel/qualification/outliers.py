"""Gross errors: touches far from their repeats, and directions far from the others.

They are named and left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, IntArray, PretravelError, describe
from pretravel.qualification.within_directions import centred_within, dof_of_tails
from pretravel.uncertainty import outlier_factor

if TYPE_CHECKING:
    from pretravel.maps import HarmonicMapFit, KindOfMap, MapFit, Observation

FEWEST_LEFT = 0.8
"""Share of the touches that must remain; else it is not single touches that are wrong."""
FEWEST_OTHER_DIRECTIONS = 8
"""With fewer directions left, the others do not predict one well enough."""
MOST_WRONG_DIRECTIONS = 3
"""Largest number of directions that are named: more of them are another surface."""
KINKS = 1.4
"""Factor on the limits for directions: kinks of a map exceed the limits more often than noise.

With it, one or two of 60 simulated good probes have a direction named."""
GROSS = 20.0
"""Errors beyond this many standard deviations of a touch are tested in any case."""
SUSPICION = 2.5
"""Left-out error of a direction, in standard deviations, from which it is tested."""


@dataclass(frozen=True)
class Outlier:
    """A touch or direction that does not fit the others.

    Attributes
    ----------
    rows : tuple of int
        Of the touches, from 0: one touch, or all of a direction.
    distance : float
        From the other touches of its direction, or from the map. [mm]
    limit : float
        Largest distance that repeatability explains. [mm]
    message : str
        What it is and how far it lies off; `outcome` says what became of it.
    left_out : bool
        Whether the map was made without it.
    """

    rows: tuple[int, ...]
    distance: float
    limit: float
    message: str
    left_out: bool = True

    @property
    def outcome(self) -> str:
        """What became of it, as a sentence."""
        if self.left_out:
            return "Left out: touch there again"
        return "Kept, because too many touches look wrong: is it the right reference?"


def repeat_outliers(
    observation: Observation, where: Callable[[int], str], step: float = 0.0
) -> list[Outlier]:
    """Touches far from the median of their direction, and pairs that lie far apart.

    Parameters
    ----------
    observation : Observation
    where : callable
        The name of a touch in messages, from its row: `Touches.where`.
    step : float
        Of the latched positions: readings of one place can be two steps apart. [mm]
    """
    from scipy.special import gammaincinv

    values, groups = observation.values, observation.groups
    count = np.bincount(groups)
    repeated = np.flatnonzero(count >= 2)
    if len(repeated) < 3:
        return []
    median = median_of_groups(values, groups)
    within = centred_within(values, groups)
    tails = dof_of_tails(values, groups, within)
    squares = np.bincount(groups, within**2)[repeated]
    free = count[repeated] - 1
    variance = squares / free
    # A few bad touches do not move the median over directions.
    unbias = np.median(2.0 * gammaincinv(0.5 * free, 0.5) / free)
    noise = math.sqrt(float(np.median(variance) / unbias))
    noise = math.hypot(noise, step / math.sqrt(12.0))
    factor = outlier_factor(len(values), tails)
    limit = max(factor * noise, 2.0 * step, 1e-9)
    # Of two touches either may be wrong; their difference scatters by the root of two more.
    apart = (
        np.abs(values - median[groups])
        > np.where(count == 2, limit / math.sqrt(2.0), limit)[groups]
    )
    by_group, start = np.argsort(groups, kind="stable"), np.cumsum(count) - count
    found = []
    for group in np.unique(groups[apart]):
        rows = by_group[start[group] : start[group] + count[group]]
        if count[group] == 2:
            found.append(_pair_apart(observation, where, rows, math.sqrt(2.0) * limit))
            continue
        for row in rows[apart[rows]]:
            distance = float(values[row] - median[group])
            message = (
                f"{where(int(row))} at {describe(observation.directions[rows[0]])} "
                f"{triggered(distance)} the median of the {len(rows)} touches of its direction; "
                f"repeatability explains {limit / MICROMETRE:.1f} µm"
            )
            found.append(Outlier((int(row),), distance, limit, message))
    return found


def triggered(distance: float) -> str:
    """How much earlier or later than others a touch triggered, in words, from its pretravel. [mm]

    >>> triggered(-0.0126)
    'triggered 12.6 µm earlier than'
    """
    return (
        f"triggered {abs(distance) / MICROMETRE:.1f} µm {'later' if distance > 0.0 else 'earlier'} "
        "than"
    )


def median_of_groups(values: FloatArray, groups: IntArray) -> FloatArray:
    """Median of the values of each group, (g,).

    Parameters
    ----------
    values : (n,) float
    groups : (n,) int
        From 0 to g - 1, none without a value.

    >>> median_of_groups(np.array([1.0, 5.0, 2.0, 4.0]), np.array([0, 0, 0, 1])).tolist()
    [2.0, 4.0]
    """
    ordered = values[np.lexsort((values, groups))]
    count = np.bincount(groups)
    start = np.cumsum(count) - count
    return np.asarray(0.5 * (ordered[start + (count - 1) // 2] + ordered[start + count // 2]))


def _pair_apart(
    observation: Observation, where: Callable[[int], str], rows: IntArray, limit: float
) -> Outlier:
    first, second = int(rows[0]), int(rows[1])
    apart = float(observation.values[first] - observation.values[second])
    message = (
        f"{where(first)} and {where(second)} at "
        f"{describe(observation.directions[first])} lie {abs(apart) / MICROMETRE:.1f} µm apart; "
        f"repeatability explains {limit / MICROMETRE:.1f} µm"
    )
    return Outlier((first, second), apart, limit, message)


def gross_errors(
    observation: Observation,
    where: Callable[[int], str],
    confirm: KindOfMap | None = None,
    *,
    step: float = 0.0,
    fixed_scatter: float = 0.0,
) -> tuple[tuple[Outlier, ...], HarmonicMapFit]:
    """Touches that contradict their repeats or the other directions.

    Parameters
    ----------
    observation : Observation
    where : callable
        The name of a touch in messages, from its row: `Touches.where`.
    confirm : KindOfMap, optional
        Its prediction must contradict a direction too.
    step : float
        Of the latched positions. [mm]
    fixed_scatter : float
        Standard deviation of a touch that repeats do not show. [mm]

    Returns
    -------
    tuple of Outlier
        Not left out where more than a fifth of the touches would be: another surface, or a kind
        of probe that is not known.
    HarmonicMapFit
        Of the touches that are not named.
    """
    repeats = repeat_outliers(observation, where, step)
    named = [row for outlier in repeats for row in outlier.rows]
    directions, detail = direction_outliers(
        observation, where, named, confirm, step=step, fixed_scatter=fixed_scatter
    )
    found = (*repeats, *directions)
    out = {row for outlier in found for row in outlier.rows}
    touches = len(observation.groups)
    if (touches - len(out)) / touches < FEWEST_LEFT:
        found = tuple(replace(outlier, left_out=False) for outlier in found)
    return found, detail


def direction_outliers(
    observation: Observation,
    where: Callable[[int], str],
    named: Sequence[int] = (),
    confirm: KindOfMap | None = None,
    *,
    step: float = 0.0,
    fixed_scatter: float = 0.0,
) -> tuple[list[Outlier], HarmonicMapFit]:
    """Directions far from the prediction of the others: a chip, dirt, a wrong normal.

    A conspicuous direction is left out, amplitudes are estimated again, and its touches are
    compared with the prediction of the rest: otherwise a wrong direction would be fitted as a map
    with large variation. With hundreds of directions the neighbours suffice for the prediction.

    Parameters
    ----------
    observation : Observation
    where : callable
        The name of a touch in messages, from its row: `Touches.where`.
    named : sequence of int
        Touches that were named already: they must not conceal others.
    confirm : KindOfMap, optional
        Its prediction must contradict the direction too.
    step, fixed_scatter : float
        As of `gross_errors`. [mm]

    Returns
    -------
    list of Outlier
    HarmonicMapFit
        Of the touches that are not named.
    """
    scatter = math.hypot(fixed_scatter, step / math.sqrt(12.0))
    kept = np.ones(len(observation.groups), dtype=bool)
    kept[list(named)] = False
    part = observation if kept.all() else observation.take(kept)
    from pretravel.maps import HarmonicKind, fit_harmonic

    current = good = fit_harmonic(part)
    found: list[Outlier] = []
    for _ in range(MOST_WRONG_DIRECTIONS):
        suspect = _most_suspect(part, current, fixed_scatter)
        if suspect is None:
            break
        out = kept & (observation.groups == np.unique(observation.groups[kept])[suspect])
        if len(np.unique(observation.groups[kept & ~out])) < FEWEST_OTHER_DIRECTIONS:
            break
        part = observation.take(kept & ~out)
        here = observation.directions[out][:1]
        if not part.support.supports(here)[0]:
            break  # the others do not surround it, so they do not predict it
        kept = kept & ~out
        current = fit_harmonic(part, near=current.posterior.amplitudes)
        wrong = observation.take(out)
        distance, u = _left_out_distance(HarmonicKind(), current, wrong, scatter)
        limit = KINKS * outlier_factor(len(np.unique(observation.groups))) * u
        if abs(distance) <= limit:
            break
        if confirm is not None and not confirm.fits_harmonics:
            other = _confirmed(confirm, part, wrong, scatter)
            if other is not None and abs(other) <= 1.0:
                break
        rows = tuple(int(row) for row in np.flatnonzero(out))
        names = where(rows[0]) + (f" to {where(rows[-1])}" if rows[1:] else "")
        found.append(
            Outlier(
                rows,
                distance,
                limit,
                f"{names} at {describe(observation.directions[rows[0]])} {triggered(distance)} "
                "the other directions predict; noise and kinks explain "
                f"{limit / MICROMETRE:.1f} µm",
            )
        )
        good = current
    return found, good


def _left_out_distance(
    kind: KindOfMap, fit: MapFit, wrong: Observation, scatter: float
) -> tuple[float, float]:
    """Mean distance of the touches of a direction from the prediction of others, and its u. [mm]

    About the centre of the others, as the uncertainty of the map is.
    """
    centered = kind.centered(fit, None)
    about = replace(wrong, center=centered.center)
    level = 0.0 if fit.tip_radius is None else fit.tip_radius - fit.observation.tip_radius
    design = fit.basis.design(about.directions)
    distance = float(np.mean(about.values + level - design @ centered.coefficients))
    variance = float(np.mean(centered.covariance.variance_of(design)))
    variance += fit.fixed_scatter**2 + scatter**2
    return distance, math.sqrt(variance + fit.noise**2 / len(wrong.groups))


def _confirmed(
    kind: KindOfMap, others: Observation, wrong: Observation, scatter: float
) -> float | None:
    """Distance over its limit by another kind of map; None where this kind cannot be fitted."""
    try:
        fit = kind.fit(others, others.repeats)
    except PretravelError:
        return None
    if not fit.basis.follows_probe:
        return None
    distance, u = _left_out_distance(kind, fit, wrong, scatter)
    return distance / (KINKS * outlier_factor(others.direction_count + 1) * u)


def _most_suspect(observation: Observation, fit: HarmonicMapFit, scatter: float) -> int | None:
    """The direction with the largest left-out error, if it is large enough for a test."""
    groups = np.unique(observation.groups, return_inverse=True)[1]
    count = np.bincount(groups)
    mean = np.bincount(groups, fit.residuals) / count
    free = np.clip(1.0 - fit.smoothing.leverage, 1e-9, 1.0)
    own = fit.noise**2 / count + fit.fixed_scatter**2 + scatter**2
    score = np.abs(mean) / np.sqrt(own * free)
    if score.max() >= SUSPICION:
        return int(np.argmax(score))
    # A gross error increases the estimated variation of the map, and so reduces its own score.
    error = np.abs(mean) / free
    return int(np.argmax(error)) if error.max() > GROSS * fit.noise else None
