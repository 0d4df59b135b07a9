"""Touches and directions that do not belong: named, not dropped."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.directions import describe
from pretravel.metrology.map_fit import HarmonicMapFit, fit_harmonic
from pretravel.metrology.observation import Observation
from pretravel.touches import Touches
from pretravel.units import MICROMETRE

OUTLIER_LEVEL = 0.01
"""Chance of naming any touch an outlier when all are good (Bonferroni)."""
MOST_WRONG_DIRECTIONS = 3
"""How many directions are named at most: more are not outliers but another surface."""
KINKS = 1.4
"""Limits for directions are wider by this: a map's kinks surprise more often than noise does.

Of 60 simulated good probes one or two then have a direction named."""
GROSS = 20.0
"""Errors beyond this many standard deviations of a touch are looked into in any case."""
SUSPICION = 2.5
"""Standard deviations of a direction's left-out error from which it is looked into."""


@dataclass(frozen=True)
class Outlier:
    """A touch that does not belong. It was named, not dropped.

    Attributes
    ----------
    rows : tuple of int
        Of the touches, from 0: one touch, or all of a direction.
    distance : float
        From the other touches of its direction, or from the map. [mm]
    limit : float
        What repeatability would let pass. [mm]
    message : str
    """

    rows: tuple[int, ...]
    distance: float
    limit: float
    message: str


def _outlier_factor(count: int) -> float:
    from scipy.stats import norm

    # 1.2 for scales that are themselves estimated from the data.
    return 1.2 * float(norm.isf(OUTLIER_LEVEL / (2.0 * count)))


def repeat_outliers(touches: Touches, observation: Observation) -> list[Outlier]:
    """Touches far from the median of three or more of one direction."""
    from scipy.stats import chi2

    values, groups = observation.values, observation.groups
    count = np.bincount(groups)
    big = np.flatnonzero(count >= 3)
    if len(big) < 3:
        return []
    medians = np.array([np.median(values[groups == g]) for g in big])
    variances = np.array([np.var(values[groups == g], ddof=1) for g in big])
    # The median over directions is not moved by a few bad touches.
    unbias = np.median(chi2.ppf(0.5, count[big] - 1) / (count[big] - 1))
    limit = _outlier_factor(len(values)) * math.sqrt(float(np.median(variances) / unbias))
    limit = max(limit, 1e-9)
    found = []
    for group, median in zip(big, medians, strict=True):
        for row in np.flatnonzero(groups == group):
            distance = float(values[row] - median)
            if abs(distance) > limit:
                found.append(
                    Outlier(
                        (int(row),),
                        distance,
                        limit,
                        f"{touches.where(int(row))} at {describe(observation.directions[row])} "
                        f"lies {distance / MICROMETRE:+.1f} µm from the median of the "
                        f"{count[group]} touches of its direction; repeatability lets "
                        f"{limit / MICROMETRE:.1f} µm pass. It was kept: remove the line and "
                        "qualify again if it is wrong",
                    )
                )
    return found


def direction_outliers(
    touches: Touches, observation: Observation, fit: HarmonicMapFit
) -> list[Outlier]:
    """Directions far from what the others say of them: a chip, dirt, a wrong normal.

    A direction that stands out is left out, amplitudes are estimated again, and its
    touches are compared with what the rest predicts: a wrong direction would otherwise
    pass for a lively map. With hundreds of directions their neighbours say as much.
    """
    found: list[Outlier] = []
    kept = np.ones(len(observation.groups), dtype=bool)
    current, part = fit, observation
    for _ in range(MOST_WRONG_DIRECTIONS):
        suspect = _most_suspect(part, current)
        if suspect is None:
            break
        out = kept & (observation.groups == np.unique(observation.groups[kept])[suspect])
        kept = kept & ~out
        part = observation.take(kept)
        current = fit_harmonic(part)
        design = current.basis.design(observation.directions[out])
        # The posterior before the gauge: observed about the same centre as the others.
        expected = design @ current.posterior.coefficients
        variance = float(np.mean(design @ current.posterior.covariance @ design.T))
        variance += current.noise**2 / float(out.sum())
        distance = float(np.mean(observation.values[out] - expected))
        limit = KINKS * _outlier_factor(len(np.unique(observation.groups))) * math.sqrt(variance)
        if abs(distance) <= limit:
            break
        rows = tuple(int(row) for row in np.flatnonzero(out))
        names = touches.where(rows[0]) + (f" to {touches.where(rows[-1])}" if rows[1:] else "")
        found.append(
            Outlier(
                rows,
                distance,
                limit,
                f"{names} at {describe(observation.directions[rows[0]])} "
                f"lie{'' if rows[1:] else 's'} {distance / MICROMETRE:+.1f} µm from what the other "
                f"directions say; {limit / MICROMETRE:.1f} µm would pass. Kept: remove the "
                f"line{'s' if rows[1:] else ''} and qualify again if wrong",
            )
        )
    return found


def _most_suspect(observation: Observation, fit: HarmonicMapFit) -> int | None:
    """The direction that fits least when left out, if it is worth looking into."""
    groups = np.unique(observation.groups, return_inverse=True)[1]
    count = np.bincount(groups)
    mean = np.bincount(groups, fit.residuals) / count
    free = np.clip(1.0 - np.bincount(groups, fit.leverage), 1e-9, 1.0)
    score = np.abs(mean) / np.sqrt(fit.noise**2 / count * free)
    if score.max() >= SUSPICION:
        return int(np.argmax(score))
    # A gross error makes the map so lively that its score is small; it is large all the same.
    error = np.abs(mean) / free
    return int(np.argmax(error)) if error.max() > GROSS * fit.noise else None
