"""Comparison of kinds of map: each kind predicts touches that it was not fitted to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.compensation.compensation import apply
from pretravel.errors import PretravelError
from pretravel.maps.kind import KindOfMap
from pretravel.maps.kinds.mean import MeanKind
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.qualification import Qualification, qualify
from pretravel.touches import Touches
from pretravel.units import MICROMETRE

FOLDS = 5
_SHUFFLE = 12  # seed: the same touches are always left out together


@dataclass(frozen=True, eq=False)
class KindScore:
    """How well one kind of map predicts directions that were left out of its fit.

    Attributes
    ----------
    kind : str
    rms : float
        Root mean square of the distances of left-out touches from the reference. [mm]
    u_rms : float
        Standard error of that, from the scatter over directions. [mm]
    reduced_chi_square : float
        Mean of (distance / stated uncertainty)², near one where u is right.
    logarithmic_score : float
        Mean of ln(u / µm) + (distance / u)² / 2, by which the kinds are compared: it rewards
        a small distance and a correct uncertainty. Smaller is better.
    problem : str
        Why this kind cannot be fitted; empty where it can.
    """

    kind: str
    rms: float
    u_rms: float
    reduced_chi_square: float
    logarithmic_score: float
    problem: str = field(default="")


def compare_kinds(
    touches: Touches, setup: QualificationSetup, kinds: Mapping[str, KindOfMap]
) -> list[KindScore]:
    """Cross-validation over directions: fit four fifths, predict the rest.

    Parameters
    ----------
    touches : Touches
    setup : QualificationSetup
    kinds : mapping of name to KindOfMap

    Returns
    -------
    list of KindScore
        The best first, those that cannot be fitted last.

    Notes
    -----
    A left-out touch is compensated with the map of the others; its distance from their sphere
    (or ring) contains repeatability and the error of the map there. Directions at the edge of the
    pattern, which the others do not surround, are not used: maps refuse to extrapolate. Kinds are
    compared by the logarithmic score, which is proper: a kind cannot gain by stating another
    uncertainty than its own.
    """
    setup = replace(setup, search_outliers=False)
    whole = qualify(touches, setup, MeanKind())
    left_out = _left_out(whole)
    scores = [
        _score(name, kind, touches, setup, whole.groups, left_out) for name, kind in kinds.items()
    ]
    return sorted(scores, key=lambda score: score.logarithmic_score)


@dataclass(frozen=True, eq=False)
class _Fold:
    """Touches that are left out together, and those of them that the others surround."""

    out: BoolArray
    surrounded: BoolArray


def _left_out(whole: Qualification) -> list[_Fold]:
    groups = whole.groups
    directions = whole.contact_normals @ whole.pretravel_map.rotation
    count = int(groups.max()) + 1
    fold = np.random.default_rng(_SHUFFLE).permutation(count) % min(FOLDS, count)
    folds = []
    for number in range(int(fold.max()) + 1):
        out = fold[groups] == number
        surrounded = out.copy()
        surrounded[out] = DirectionSupport(directions[~out]).supports(directions[out])
        folds.append(_Fold(out, surrounded))
    return folds


def _score(
    name: str,
    kind: KindOfMap,
    touches: Touches,
    setup: QualificationSetup,
    groups: IntArray,
    folds: list[_Fold],
) -> KindScore:
    distance, u = np.full(len(touches), np.nan), np.full(len(touches), np.nan)
    for fold in folds:
        try:
            fitted = qualify(touches.take(~fold.out), setup, kind)
            if fold.surrounded.any():
                distance[fold.surrounded], u[fold.surrounded] = distances_from_reference(
                    fitted, touches.take(fold.surrounded)
                )
        except PretravelError as error:
            problem = f"with a fifth of the directions left out: {error}"
            return KindScore(name, math.inf, math.nan, math.nan, math.inf, problem)
    return _score_of(name, distance, u, groups)


def _score_of(name: str, distance: FloatArray, u: FloatArray, groups: IntArray) -> KindScore:
    used = np.isfinite(distance)
    count = int(groups.max()) + 1
    touched = np.bincount(groups, used)
    squares_of = np.bincount(groups[used], distance[used] ** 2, count)[touched > 0]
    square = np.asarray(squares_of / touched[touched > 0], dtype=np.float64)
    rms = math.sqrt(float(square.mean()))
    u_mean = float(square.std(ddof=1)) / math.sqrt(len(square))
    squares = (distance[used] / u[used]) ** 2
    score = float(np.mean(np.log(u[used] / MICROMETRE) + 0.5 * squares))
    return KindScore(name, rms, 0.5 * u_mean / rms, float(np.mean(squares)), score)


def distances_from_reference(
    fitted: Qualification, touches: Touches
) -> tuple[FloatArray, FloatArray]:
    """Distances of compensated touches from the sphere (or ring) that a qualification found.

    Parameters
    ----------
    fitted : Qualification
    touches : Touches
        On the same reference.

    Returns
    -------
    distance : (n,) float
        From the reference's surface, away from its centre. [mm]
    standard_uncertainty : (n,) float
        That compensation states. [mm]
    """
    points = apply(touches, fitted.pretravel_map, extrapolate=True)
    offset = points.positions - fitted.center
    if fitted.setup.ring:
        axis = fitted.pretravel_map.rotation[:, 2]
        offset = offset - (offset @ axis)[:, None] * axis
    distance = np.linalg.norm(offset, axis=1) - 0.5 * fitted.setup.diameter
    return distance, points.standard_uncertainty
