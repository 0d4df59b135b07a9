"""Detection of outliers among touches and directions. They are named, not removed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.directions import describe
from pretravel.maps.kinds.harmonic import HarmonicMapFit, fit_harmonic
from pretravel.maps.observation import Observation
from pretravel.touches import Touches
from pretravel.units import MICROMETRE

FEWEST_OTHER_DIRECTIONS = 8
"""With fewer directions left, the others do not predict one well enough."""
OUTLIER_LEVEL = 0.01
"""Probability that any touch is named although all are good (Bonferroni)."""
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
    """A touch or direction that does not fit the others. It is named, not removed.

    Attributes
    ----------
    rows : tuple of int
        Of the touches, from 0: one touch, or all of a direction.
    distance : float
        From the other touches of its direction, or from the map. [mm]
    limit : float
        Largest distance that repeatability explains. [mm]
    message : str
    """

    rows: tuple[int, ...]
    distance: float
    limit: float
    message: str


def _outlier_factor(count: int) -> float:
    from scipy.stats import norm

    # 1.2 because the scales are themselves estimated from the data.
    return 1.2 * float(norm.isf(OUTLIER_LEVEL / (2.0 * count)))


def repeat_outliers(touches: Touches, observation: Observation) -> list[Outlier]:
    """Touches far from the median of their direction, and pairs that lie far apart."""
    from scipy.stats import chi2

    values, groups = observation.values, observation.groups
    count = np.bincount(groups)
    repeated = np.flatnonzero(count >= 2)
    if len(repeated) < 3:
        return []
    median = np.array([np.median(values[groups == g]) for g in repeated])
    variance = np.array([np.var(values[groups == g], ddof=1) for g in repeated])
    # A few bad touches do not move the median over directions.
    unbias = np.median(chi2.ppf(0.5, count[repeated] - 1) / (count[repeated] - 1))
    noise = math.sqrt(float(np.median(variance) / unbias))
    limit = max(_outlier_factor(len(values)) * noise, 1e-9)
    found = []
    for group, middle in zip(repeated, median, strict=True):
        rows = np.flatnonzero(groups == group)
        place = describe(observation.directions[rows[0]])
        if len(rows) == 2:
            # Of two touches either may be wrong; their difference scatters by the root of two more.
            apart = float(values[rows[0]] - values[rows[1]])
            if abs(apart) > math.sqrt(2.0) * limit:
                names = " and ".join(touches.where(int(row)) for row in rows)
                message = (
                    f"{names} at {place} lie {abs(apart) / MICROMETRE:.1f} µm apart; repeatability "
                    f"explains {math.sqrt(2.0) * limit / MICROMETRE:.1f} µm. Both were kept: "
                    "remove the wrong one, or both, and qualify again"
                )
                pair = (int(rows[0]), int(rows[1]))
                found.append(Outlier(pair, apart, math.sqrt(2.0) * limit, message))
            continue
        for row in rows:
            distance = float(values[row] - middle)
            if abs(distance) > limit:
                message = (
                    f"{touches.where(int(row))} at {place} lies {distance / MICROMETRE:+.1f} µm "
                    f"from the median of the {len(rows)} touches of its direction; "
                    f"repeatability explains {limit / MICROMETRE:.1f} µm. It was kept: remove the "
                    "line and qualify again if it is wrong"
                )
                found.append(Outlier((int(row),), distance, limit, message))
    return found


def direction_outliers(
    touches: Touches, observation: Observation, fit: HarmonicMapFit, named: Sequence[int] = ()
) -> list[Outlier]:
    """Directions far from the prediction of the others: a chip, dirt, a wrong normal.

    A conspicuous direction is left out, amplitudes are estimated again, and its touches are
    compared with the prediction of the rest: otherwise a wrong direction would be fitted as a map
    with large variation. With hundreds of directions the neighbours suffice for the prediction.
    """
    found: list[Outlier] = []
    kept = np.ones(len(observation.groups), dtype=bool)
    current, part = fit, observation
    if len(named):  # touches that were named already must not conceal others
        kept[list(named)] = False
        part = observation.take(kept)
        current = fit_harmonic(part)
    for _ in range(MOST_WRONG_DIRECTIONS):
        suspect = _most_suspect(part, current)
        if suspect is None:
            break
        out = kept & (observation.groups == np.unique(observation.groups[kept])[suspect])
        if len(np.unique(observation.groups[kept & ~out])) < FEWEST_OTHER_DIRECTIONS:
            break
        kept = kept & ~out
        part = observation.take(kept)
        current = fit_harmonic(part)
        design = current.basis.design(observation.directions[out])
        # The posterior before the centre is separated: about the same centre as the others.
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
                f"lie{'' if rows[1:] else 's'} {distance / MICROMETRE:+.1f} µm from the prediction "
                f"of the other directions; noise and kinks explain {limit / MICROMETRE:.1f} µm. "
                f"Kept: remove the line{'s' if rows[1:] else ''} and qualify again if wrong",
            )
        )
    return found


def _most_suspect(observation: Observation, fit: HarmonicMapFit) -> int | None:
    """The direction with the largest left-out error, if it is large enough for a test."""
    groups = np.unique(observation.groups, return_inverse=True)[1]
    count = np.bincount(groups)
    mean = np.bincount(groups, fit.residuals) / count
    free = np.clip(1.0 - np.bincount(groups, fit.leverage), 1e-9, 1.0)
    score = np.abs(mean) / np.sqrt(fit.noise**2 / count * free)
    if score.max() >= SUSPICION:
        return int(np.argmax(score))
    # A gross error increases the estimated variation of the map, and so reduces its own score.
    error = np.abs(mean) / free
    return int(np.argmax(error)) if error.max() > GROSS * fit.noise else None
