"""Weights of kinds of map: each predicts directions that it was not fitted to; their average."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, PretravelError, describe, frozen
from pretravel.maps import (
    KindOfMap,
    MapFit,
    Observation,
    PretravelMap,
    averaged_map,
)
from pretravel.qualification.qualification import KindScore, PreparedTouches, Qualification

_LOG = logging.getLogger(__name__)
FOLDS = 5
FEW_DIRECTIONS = 15
"""With fewer directions each is left out alone."""
MOST_COMPARED = 2000
"""Directions, drawn at random, with which kinds are compared where there are many more."""
_SHUFFLE = 12  # seed: the same touches are always left out together
LEAST_WEIGHT = 0.1
"""Kinds with a smaller weight are left out of the average."""
_SMALLEST_DENSITY = -50.0  # logarithm, per direction: a gross error counts no more than this
_BEYOND = 3.0  # standard uncertainties from which kinds disagree
_DOUBT = 0.25  # weight of the second kind from which people are warned that kinds disagree
_LEAST_DISAGREEMENT = 0.5 * MICROMETRE


def compare_kinds(
    ready: PreparedTouches,
    fits: Mapping[str, tuple[KindOfMap, MapFit | PretravelError]],
) -> list[KindScore]:
    """Cross-validation over directions, and the weights of an average of the kinds.

    Parameters
    ----------
    ready : PreparedTouches
    fits : mapping of name to (KindOfMap, MapFit or PretravelError)
        Of all touches: fits without some of the directions begin there. The error of a kind that
        cannot be fitted.

    Returns
    -------
    list of KindScore
        The largest weight first, those that cannot be fitted, or not without some of the
        directions, last.

    Notes
    -----
    Directions that are left out are compared with the map of the others, about their centre. Of
    many directions, those at the edge of the pattern, which the others do not surround, are not
    used: maps refuse to extrapolate. The weights are those whose mixture gives the left-out
    directions the largest probability (stacking, Yao, Vehtari, Simpson & Gelman 2018), with
    `KindOfMap.weight_in_advance` touches in favour of each kind.
    """
    ready = replace(ready, observation=ready.observation.drawn(MOST_COMPARED))
    outs = [fold[ready.observation.groups] for fold in _folds(ready.observation)]
    splits = [
        _Split(~out, ready.observation.take(~out), ready.observation.take(out)) for out in outs
    ]
    scores: list[KindScore] = []
    densities: dict[str, FloatArray] = {}
    in_advance: list[float] = []
    for name, (kind, fit) in fits.items():
        _LOG.info("%s map, directions left out", name)
        try:
            if isinstance(fit, PretravelError):
                raise fit
            left_out = _left_out(ready, kind, fit, splits)
        except PretravelError as error:
            nothing = (math.inf, math.nan, math.nan, math.inf)
            fitted_to_all = not isinstance(fit, PretravelError)
            problem = f"{'in cross-validation, ' if fitted_to_all else ''}{error}"
            scores.append(KindScore(name, *nothing, problem=problem))
            continue
        distance, variance = left_out
        scores.append(_score_of(name, distance, variance))
        logarithm = -0.5 * (np.log(variance / MICROMETRE**2) + distance**2 / variance)
        densities[name] = np.maximum(logarithm, _SMALLEST_DENSITY)
        in_advance.append(kind.weight_in_advance(fit))
    fitted = [row for row, score in enumerate(scores) if score.kind in densities]
    if fitted:
        for row, weight in zip(
            fitted,
            stacking_weights(np.array(list(densities.values())), np.array(in_advance)),
            strict=True,
        ):
            scores[row] = replace(scores[row], weight=float(weight))
    return sorted(scores, key=lambda score: (-score.weight, score.logarithmic_score))


def stacking_weights(log_densities: FloatArray, prior: FloatArray) -> FloatArray:
    """Weights whose mixture gives left-out values the largest probability.

    Parameters
    ----------
    log_densities : (k, n) float
        Of each value under each model.
    prior : (k,) float
        Number of values that speak for each model in advance.

    Returns
    -------
    (k,) float
        They add up to one; those below `LEAST_WEIGHT` are zero.

    >>> stacking_weights(np.log([[0.9, 0.9], [0.1, 0.1]]), np.array([1.0, 1.0])).round(2).tolist()
    [0.73, 0.27]
    """
    density = np.exp(log_densities - log_densities.max(axis=0))
    weights = prior / prior.sum()
    for _ in range(2000):
        shares = weights[:, None] * density
        shares /= shares.sum(axis=0)
        following = (shares.sum(axis=1) + prior) / (density.shape[1] + prior.sum())
        settled = float(np.abs(following - weights).max()) < 1e-9
        weights = following
        if settled:
            break
    weights = np.where(weights < LEAST_WEIGHT, 0.0, weights)
    return np.asarray(weights / weights.sum())


def _folds(observation: Observation) -> list[BoolArray]:
    """Directions that are left out together, (g,) each; of those, only directions to compare."""
    count = observation.direction_count
    folds = count if count < FEW_DIRECTIONS else FOLDS
    fold = np.random.default_rng(_SHUFFLE).permutation(count) % folds
    return [fold == number for number in range(folds)]


@dataclass(frozen=True, eq=False)
class _Split:
    """Directions that are left out together, and the others, which all kinds are fitted to."""

    kept: BoolArray
    """Touches of the others, of all."""
    others: Observation
    hidden: Observation


def _left_out(
    ready: PreparedTouches, kind: KindOfMap, whole: MapFit, splits: Sequence[_Split]
) -> tuple[FloatArray, FloatArray]:
    """Distances of left-out directions from the prediction (m,), and variances. [mm], [mm²]"""
    observation, effects = ready.observation, ready.effects
    few = observation.direction_count < FEW_DIRECTIONS
    distances, variances = [], []
    parts = [split.others for split in splits]
    fits = kind.fits_of_parts(whole, observation, [split.kept for split in splits], parts)
    for split, fit in zip(splits, fits, strict=True):
        others, hidden, repeats = split.others, split.hidden, split.others.repeats
        centered = kind.centered(fit, ready.setup.axial_pretravel)
        level = 0.0 if fit.tip_radius is None else fit.tip_radius - observation.tip_radius
        about = replace(hidden, center=centered.center)
        count = np.bincount(about.groups)
        values = np.bincount(about.groups, about.values) / count + level
        directions = about.group_directions
        design = fit.basis.design(directions)
        noise = repeats.deviation if repeats.dof > 0.0 else fit.noise
        variance = centered.covariance.variance_of(design) + noise**2 / count
        variance += max(fit.fixed_scatter, effects.step_scatter) ** 2 + effects.fixed_scatter**2
        used = np.ones(len(values), dtype=bool)
        if not few:  # the same directions for all kinds, whose centres differ
            used = others.support.supports(hidden.group_directions)
        distances.append((values - design @ centered.coefficients)[used])
        variances.append(variance[used])
    return np.concatenate(distances), np.concatenate(variances)


def _score_of(name: str, distance: FloatArray, variance: FloatArray) -> KindScore:
    rms = math.sqrt(float(np.mean(distance**2)))
    u_mean = float(np.std(distance**2, ddof=1)) / math.sqrt(len(distance))
    squares = distance**2 / variance
    score = float(np.mean(0.5 * np.log(variance / MICROMETRE**2) + 0.5 * squares))
    return KindScore(name, rms, 0.5 * u_mean / rms, float(np.mean(squares)), score)


def averaged(results: Sequence[Qualification], parts: Sequence[KindScore]) -> Qualification:
    """The average of qualifications of the same touches with several kinds of map.

    Parameters
    ----------
    results : sequence of Qualification
        The one with the largest weight first.
    parts : sequence of KindScore
        Of the same kinds, with their weights.
    """
    if len(parts) == 1:
        return results[0]
    weights = np.array([part.weight for part in parts])
    weights = weights / weights.sum()
    maps, best = [result.pretravel_map for result in results], results[0]
    basis, coefficients, covariance = averaged_map(
        maps, [result.center for result in results], weights.tolist()
    )
    # About the centre of the best kind, which is not the mean of theirs.
    apart = np.array([result.center for result in results]) - best.center
    within = [result.center_covariance for result in results]
    of_center = np.tensordot(weights, within, axes=1) + (apart.T * weights) @ apart
    rotation = maps[0].rotation
    made = maps[0].provenance.with_center_covariance(rotation.T @ of_center @ rotation)
    shares = {part.kind: round(float(w), 3) for part, w in zip(parts, weights, strict=True)}
    pretravel_map = replace(
        maps[0],
        basis=basis,
        coefficients=coefficients,
        covariance=covariance,
        fixed_scatter=math.sqrt(float(weights @ [each.fixed_scatter**2 for each in maps])),
        delay_effect=_delay_effect(maps, weights, basis.size),
        provenance=replace(made, kind_settings=shares),
    )
    value = pretravel_map.pretravel(best.contact_normals, extrapolate=True)
    return replace(
        best,
        pretravel_map=pretravel_map,
        center_covariance=frozen(of_center),
        residuals=frozen(best.observed - value),
        effect_of_outliers=max(result.effect_of_outliers for result in results),
        warnings=(*best.warnings, *_disagreement(results[:2], parts)),
    )


def _delay_effect(
    maps: Sequence[PretravelMap], weights: FloatArray, size: int
) -> FloatArray | None:
    if maps[0].delay_effect is None:
        return None
    parts = [
        weight * (np.zeros(each.basis.size) if each.delay_effect is None else each.delay_effect)
        for each, weight in zip(maps, weights, strict=True)
    ]
    return np.concatenate([np.zeros(size - sum(len(part) for part in parts)), *parts])


def _disagreement(results: Sequence[Qualification], parts: Sequence[KindScore]) -> list[str]:
    """Where the two kinds with the largest weights differ by more than their uncertainties."""
    if parts[1].weight < _DOUBT:
        return []
    first, second = (result.pretravel_map for result in results)
    directions, value, u = first.over_support()
    normals = directions @ first.rotation.T
    other, u_other = second.pretravel_and_uncertainty(normals, extrapolate=True)
    shift = (results[0].center - results[1].center) @ first.rotation
    apart = other + directions @ shift + first.tip_radius - second.tip_radius - value
    size = np.hypot(np.hypot(u, u_other), first.fixed_scatter)
    excess = np.abs(apart) / np.maximum(size, 1e-12)
    worst = int(np.argmax(excess))
    if excess[worst] < _BEYOND or abs(apart[worst]) < _LEAST_DISAGREEMENT:
        return []
    found = (
        f"the kinds {parts[0].kind} and {parts[1].kind} disagree by "
        f"{abs(apart[worst]) / MICROMETRE:.1f} µm at {describe(directions[worst])}, more than "
        "their uncertainties explain; u of the map contains the difference. Touch the reference "
        "there too"
    )
    return [found]
