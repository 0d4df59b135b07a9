"""Which kind of map suits a probe: each kind predicts touches that it was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.compensation.compensation import apply
from pretravel.errors import PretravelError
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.map_fit import Kind
from pretravel.qualification.qualification import FitMap, Qualification, qualify
from pretravel.touches import Touches
from pretravel.units import MICROMETRE

FOLDS = 5
_SHUFFLE = 12  # seed: the same touches are always left out together


@dataclass(frozen=True, eq=False)
class KindScore:
    """How one kind of map predicts directions that were left out of its fit.

    Attributes
    ----------
    kind : str
    rms : float
        Root mean square of the left-out touches' distance from the reference. [mm]
    u_rms : float
        Standard error of that, from the scatter over directions. [mm]
    honesty : float
        Mean of (distance / stated uncertainty)², near one where u is right.
    surprise : float
        Mean of ln(u / µm) + (distance / u)² / 2, what the kinds are chosen by: it rewards
        being close, and saying how close. Smaller is better.
    problem : str
        Why this kind cannot be fitted; empty where it can.
    """

    kind: str
    rms: float
    u_rms: float
    honesty: float
    surprise: float
    problem: str = field(default="")


def compare_kinds(
    touches: Touches,
    diameter: float,
    kinds: Mapping[str, Kind | FitMap],
    **settings: Any,
) -> list[KindScore]:
    """Cross-validation over directions: fit on four fifths, predict the rest.

    Parameters
    ----------
    touches : Touches
    diameter : float
        Of the reference. [mm]
    kinds : mapping of name to kind
        As `qualify` takes them.
    **settings
        Other arguments of `qualify`.

    Returns
    -------
    list of KindScore
        The best first, those that cannot be fitted last.

    Notes
    -----
    A left-out touch is compensated with the map of the others; its distance from their sphere
    (or ring) holds repeatability and the map's error there. Directions at the edge of the
    pattern, which the others do not surround, are not judged: maps refuse to extrapolate.
    Kinds are compared by the logarithmic score, which is proper: no kind gains by stating
    another uncertainty than its own.
    """
    settings = {name: value for name, value in settings.items() if name != "search_outliers"}
    whole = qualify(touches, diameter, **settings, kind="mean", search_outliers=False)
    groups = whole.groups
    directions = whole.contact_normals @ whole.pretravel_map.rotation
    count = int(groups.max()) + 1
    fold = np.random.default_rng(_SHUFFLE).permutation(count) % min(FOLDS, count)
    scores = []
    for name, kind in kinds.items():
        distance, u = np.full(len(touches), np.nan), np.full(len(touches), np.nan)
        problem = ""
        for left_out in range(int(fold.max()) + 1):
            out = fold[groups] == left_out
            judged = out.copy()
            judged[out] = DirectionSupport(directions[~out]).supports(directions[out])
            try:
                fitted = qualify(
                    touches.take(~out),
                    diameter,
                    **settings,
                    kind=kind,
                    search_outliers=False,
                )
                if judged.any():
                    distance[judged], u[judged] = distances_from_reference(
                        fitted, touches.take(judged), diameter, bool(settings.get("ring", False))
                    )
            except PretravelError as error:
                problem = f"with a fifth of the directions left out: {error}"
                break
        if problem:
            scores.append(KindScore(name, math.inf, math.nan, math.nan, math.inf, problem))
            continue
        told = np.isfinite(distance)
        touched = np.bincount(groups, told)
        squares_of = np.bincount(groups[told], distance[told] ** 2, count)[touched > 0]
        square = np.asarray(squares_of / touched[touched > 0], dtype=np.float64)
        rms = math.sqrt(float(square.mean()))
        u_mean = float(square.std(ddof=1)) / math.sqrt(len(square))
        squares = (distance[told] / u[told]) ** 2
        surprise = float(np.mean(np.log(u[told] / MICROMETRE) + 0.5 * squares))
        scores.append(KindScore(name, rms, 0.5 * u_mean / rms, float(np.mean(squares)), surprise))
    return sorted(scores, key=lambda score: score.surprise)


def distances_from_reference(
    fitted: Qualification, touches: Touches, diameter: float, ring: bool
) -> tuple[FloatArray, FloatArray]:
    """Compensated touches against the sphere (or ring) that a qualification found.

    Returns
    -------
    distance : (n,) float
        From the reference's surface, away from its centre. [mm]
    standard_uncertainty : (n,) float
        As compensation states it. [mm]
    """
    points = apply(touches, fitted.pretravel_map, extrapolate=True)
    offset = points.positions - fitted.center
    if ring:
        axis = fitted.pretravel_map.rotation[:, 2]
        offset = offset - (offset @ axis)[:, None] * axis
    distance = np.linalg.norm(offset, axis=1) - 0.5 * diameter
    return distance, points.standard_uncertainty
