"""Qualification with all kinds of map at once: an average, weighted by left-out directions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base.arrays import FloatArray, frozen
from pretravel.base.directions import describe
from pretravel.base.errors import PretravelError
from pretravel.base.units import MICROMETRE
from pretravel.identification.kind_choice import KindScore, compare_kinds
from pretravel.maps.kind import KindOfMap, MapFit
from pretravel.maps.kinds.averaged import averaged_map
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.map_warnings import over_support
from pretravel.qualification.prepare import prepare
from pretravel.qualification.qualification import Qualification, qualified
from pretravel.touches import Touches

AUTO = "auto"
"""The word for an average of kinds, instead of one of them."""
_BEYOND = 3.0  # standard uncertainties from which kinds disagree
_DOUBT = 0.25  # weight of the second kind from which people are warned that kinds disagree
_LEAST_DISAGREEMENT = 0.5 * MICROMETRE


@dataclass(frozen=True, eq=False)
class Choice:
    """A qualification, with the comparison of kinds that led to it.

    Attributes
    ----------
    qualification : Qualification
    kind : str
        Of the map: one kind, or averaged.
    scores : tuple of KindScore
        The largest weight first; empty where the kind was given.
    """

    qualification: Qualification
    kind: str
    scores: tuple[KindScore, ...]


def qualify_on_average(
    touches: Touches,
    setup: QualificationSetup,
    kinds: Mapping[str, KindOfMap],
) -> Choice:
    """Qualify with every kind of map, and average those that predict left-out directions.

    Parameters
    ----------
    touches : Touches
    setup : QualificationSetup
    kinds : mapping of name to KindOfMap

    Returns
    -------
    Choice

    Raises
    ------
    PretravelError
        As `pretravel.qualification.qualification.qualify`; no kind of map fits.
    """
    fine = [kind for kind in kinds.values() if kind.prior_weight > 1.0]
    ready = prepare(touches, setup, fine[0] if fine else None)
    made: dict[str, Qualification] = {}
    fits: dict[str, tuple[KindOfMap, MapFit | PretravelError]] = {}
    for name, kind in kinds.items():
        try:
            made[name] = qualified(ready, kind)
            fits[name] = (kind, made[name].fit)
        except PretravelError as error:
            fits[name] = (kind, error)
    scores = tuple(compare_kinds(ready, fits))
    parts = [score for score in scores if score.weight > 0.0]
    if not parts:
        raise PretravelError(f"no kind of map fits these touches: {scores[0].problem}")
    results = [made[score.kind] for score in parts]
    if len(parts) == 1:
        return Choice(results[0], parts[0].kind, scores)
    result = _averaged(results, parts)
    return Choice(result, result.pretravel_map.kind, scores)


def _averaged(results: Sequence[Qualification], parts: Sequence[KindScore]) -> Qualification:
    weights = np.array([part.weight for part in parts])
    weights = weights / weights.sum()
    maps, best = [result.pretravel_map for result in results], results[0]
    basis, coefficients, covariance = averaged_map(
        maps, [result.center for result in results], weights.tolist()
    )
    shares = {part.kind: round(float(w), 3) for part, w in zip(parts, weights, strict=True)}
    pretravel_map = replace(
        maps[0],
        basis=basis,
        coefficients=coefficients,
        covariance=covariance,
        fixed_scatter=math.sqrt(float(weights @ [each.fixed_scatter**2 for each in maps])),
        delay_effect=_delay_effect(maps, weights, basis.size),
        provenance=replace(maps[0].provenance, kind_settings=shares),
    )
    value = pretravel_map.pretravel(best.contact_normals, extrapolate=True)
    return replace(
        best,
        pretravel_map=pretravel_map,
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
    directions, value, u = over_support(first)
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
