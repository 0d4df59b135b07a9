"""Detection of gross errors among touches and directions. They are named and left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pretravel.base.directions import describe
from pretravel.base.errors import PretravelError
from pretravel.base.units import MICROMETRE
from pretravel.maps.kind import KindOfMap, MapFit
from pretravel.maps.kinds.harmonic import HarmonicKind, HarmonicMapFit, fit_harmonic
from pretravel.maps.observation import Observation
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.machine_effects import MachineEffects
from pretravel.qualification.repeat_outliers import (
    FEWEST_LEFT,
    Outlier,
    outlier_factor,
    repeat_outliers,
)

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


def gross_errors(
    observation: Observation,
    where: Callable[[int], str],
    effects: MachineEffects,
    confirm: KindOfMap | None,
) -> tuple[tuple[Outlier, ...], HarmonicMapFit]:
    """Touches that cannot be right, beside their repeats or beside the other directions.

    Parameters
    ----------
    observation : Observation
    where : callable
        The name of a touch in messages, from its row: `Touches.where`.
    effects : MachineEffects
        Their scatter is in the limits.
    confirm : KindOfMap, optional
        Its prediction must contradict a direction too.

    Returns
    -------
    tuple of Outlier
        Not left out where more than a fifth of the touches would be: another surface, or a kind
        of probe that is not known.
    HarmonicMapFit
        Of the touches that are not named.
    """
    repeats = repeat_outliers(observation, where, effects.step)
    named = [row for outlier in repeats for row in outlier.rows]
    directions, detail = direction_outliers(observation, where, named, effects, confirm)
    found = (*repeats, *directions)
    out = {row for outlier in found for row in outlier.rows}
    touches = len(observation.groups)
    if (touches - len(out)) / touches < FEWEST_LEFT:
        found = tuple(replace(outlier, left_out=False) for outlier in found)
    return found, detail


def direction_outliers(
    observation: Observation,
    where: Callable[[int], str],
    named: Sequence[int],
    effects: MachineEffects,
    confirm: KindOfMap | None,
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
    effects : MachineEffects
        Their scatter is in the limits.
    confirm : KindOfMap, optional
        Its prediction must contradict the direction too.

    Returns
    -------
    list of Outlier
    HarmonicMapFit
        Of the touches that are not named.
    """
    kept = np.ones(len(observation.groups), dtype=bool)
    kept[list(named)] = False
    part = observation if kept.all() else observation.take(kept)
    current = good = fit_harmonic(part)
    found: list[Outlier] = []
    for _ in range(MOST_WRONG_DIRECTIONS):
        suspect = _most_suspect(part, current, effects.fixed_scatter)
        if suspect is None:
            break
        out = kept & (observation.groups == np.unique(observation.groups[kept])[suspect])
        if len(np.unique(observation.groups[kept & ~out])) < FEWEST_OTHER_DIRECTIONS:
            break
        part = observation.take(kept & ~out)
        here = observation.directions[out][:1]
        if not DirectionSupport(part.group_directions).supports(here)[0]:
            break  # the others do not surround it, so they do not predict it
        kept = kept & ~out
        current = fit_harmonic(part, near=current.posterior.amplitudes)
        wrong = observation.take(out)
        distance, u = _left_out_distance(HarmonicKind(), current, wrong, effects)
        limit = KINKS * outlier_factor(len(np.unique(observation.groups))) * u
        if abs(distance) <= limit:
            break
        if confirm is not None and not confirm.fits_harmonics:
            other = _confirmed(confirm, part, wrong, effects)
            if other is not None and abs(other) <= 1.0:
                break
        rows = tuple(int(row) for row in np.flatnonzero(out))
        names = where(rows[0]) + (f" to {where(rows[-1])}" if rows[1:] else "")
        found.append(
            Outlier(
                rows,
                distance,
                limit,
                f"{names} at {describe(observation.directions[rows[0]])} "
                f"lie{'' if rows[1:] else 's'} {distance / MICROMETRE:+.1f} µm from the prediction "
                f"of the other directions; noise and kinks explain {limit / MICROMETRE:.1f} µm",
            )
        )
        good = current
    return found, good


def _left_out_distance(
    kind: KindOfMap, fit: MapFit, wrong: Observation, effects: MachineEffects
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
    variance += fit.fixed_scatter**2 + effects.fixed_scatter**2 + effects.step**2 / 12.0
    return distance, math.sqrt(variance + fit.noise**2 / len(wrong.groups))


def _confirmed(
    kind: KindOfMap, others: Observation, wrong: Observation, effects: MachineEffects
) -> float | None:
    """Distance over its limit by another kind of map; None where this kind cannot be fitted."""
    try:
        fit = kind.fit(others, others.repeats)
    except PretravelError:
        return None
    if not fit.basis.follows_probe:
        return None
    distance, u = _left_out_distance(kind, fit, wrong, effects)
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
