"""Predictions of directions that were left out, against least squares without them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.stats import norm

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.maps.kind import KindOfMap, MapFit
from pretravel.maps.kinds import kind_named
from pretravel.maps.kinds.mean import MeanKind
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.qualification import kind_weights
from pretravel.qualification.kind_weights import (
    _folds,
    compare_kinds,
    stacking_weights,
)
from pretravel.qualification.qualification import KindScore, PreparedTouches
from pretravel.qualification.qualifying import prepare, qualified
from pretravel.six_seats.physical import PhysicalKind
from pretravel.touches import Touches

UM = 1e-3
STEP, FIXED = 0.3 * UM, 0.4 * UM  # scatter by a step of the scales and by hysteresis


class WellKnownMean(MeanKind):
    prior_weight: ClassVar[float] = 0.6  # three times that of a mean


def _prepared(directions: int, repeats: int) -> PreparedTouches:
    """A sphere touched from a cap, with a pretravel that a mean does not explain."""
    n = np.repeat(fibonacci_cap(directions, np.radians(100.0)), repeats, axis=0)
    rng = np.random.default_rng(4)
    pretravel = (10.0 + 2.0 * n[:, 0] * n[:, 1] + 0.3 * rng.standard_normal(len(n))) * UM
    touches = Touches(n * (15.5 - pretravel)[:, None] + [3.0, 4.0, 5.0], n)
    ready = prepare(touches, QualificationSetup(25.0, tip_diameter=6.0, search_outliers=False))
    effects = replace(ready.effects, step_scatter=STEP, fixed_scatter=FIXED)
    return replace(ready, effects=effects)


def _predicted(ready: PreparedTouches) -> tuple[np.ndarray, np.ndarray]:
    """Distances and variances from a plain regression on 1 and n without each fold."""
    observation = ready.observation
    every = np.column_stack([np.ones(len(observation.groups)), observation.directions])
    values, groups = observation.values, observation.groups
    distances, variances = [], []
    for fold in _folds(observation):
        kept = ~fold[groups]
        solution = np.linalg.lstsq(every[kept], values[kept], rcond=None)[0]
        left = values[kept] - every[kept] @ solution
        residual = float(left @ left) / (kept.sum() - 4)
        directions = (~fold).sum()  # the same in all repeats of one
        variance = float(np.mean(left**2)) * directions / (directions - 4)
        own = [values[groups == g] for g in np.flatnonzero(~fold)]
        dof = sum(len(v) - 1 for v in own)
        noise = sum(float(np.sum((v - v.mean()) ** 2)) for v in own) / dof if dof else residual
        nodes = observation.group_directions
        for g in np.flatnonzero(fold):
            inside = DirectionSupport(nodes[~fold]).supports(nodes[[g]])[0]
            if inside or len(nodes) < 15:
                of_g = groups == g
                distances.append(float(np.mean(values[of_g] - every[of_g] @ solution)))
                variances.append(variance + noise / of_g.sum() + STEP**2 + FIXED**2)
    return np.array(distances), np.array(variances)


def _score(
    ready: PreparedTouches,
    kinds: dict[str, tuple[KindOfMap, MapFit | PretravelError]] | None = None,
) -> list[KindScore]:
    fit = MeanKind().fit(ready.observation, ready.observation.repeats)
    return compare_kinds(ready, kinds or {"mean": (MeanKind(), fit)})


@pytest.mark.parametrize(("directions", "repeats"), [(11, 2), (14, 1), (15, 2), (33, 1)])
def test_scores_are_those_of_least_squares_without_each_fold(directions: int, repeats: int) -> None:
    ready = _prepared(directions, repeats)
    distance, variance = _predicted(ready)
    squares = distance**2 / variance
    (score,) = _score(ready)
    n = len(distance)
    assert n == directions or directions >= 15
    # Distances are not linear in the centre: 1 µm aside of 15 mm changes them by less than 0.1 nm.
    assert score.rms == pytest.approx(math.sqrt(np.mean(distance**2)), rel=1e-4)
    u_of_square = math.sqrt(np.sum((distance**2 - np.mean(distance**2)) ** 2) / (n - 1) / n)
    assert score.u_rms == pytest.approx(u_of_square / (2.0 * score.rms), rel=1e-3)
    assert score.reduced_chi_square == pytest.approx(np.mean(squares), rel=1e-3)
    logarithmic = np.mean(np.log(np.sqrt(variance) / UM) + 0.5 * squares)
    assert score.logarithmic_score == pytest.approx(logarithmic, rel=1e-3)
    assert (score.kind, score.weight, score.problem) == ("mean", 1.0, "")


@pytest.mark.parametrize(("directions", "folds"), [(5, 5), (14, 14), (15, 5), (33, 5)])
def test_each_direction_is_left_out_once(directions: int, folds: int) -> None:
    """In as many parts as directions, from fifteen on in five that are as equal as they can be."""
    found = _folds(_prepared(directions, 1).observation)
    assert len(found) == folds
    assert np.array_equal(np.sum(found, axis=0), np.ones(directions))
    sizes = [int(fold.sum()) for fold in found]
    assert max(sizes) - min(sizes) <= 1


def test_kinds_that_predict_the_same_share_by_their_priors() -> None:
    ready = _prepared(14, 1)
    fit = MeanKind().fit(ready.observation, ready.observation.repeats)
    refused = PretravelError("of no use here")
    scores = _score(
        ready,
        {
            "refused": (MeanKind(), refused),
            "mean": (MeanKind(), fit),
            "known": (WellKnownMean(), fit),
        },
    )
    assert [score.kind for score in scores] == ["known", "mean", "refused"]
    assert [score.weight for score in scores] == pytest.approx([0.75, 0.25, 0.0], abs=1e-6)
    *_, last = scores
    assert last.problem == "of no use here"
    assert last.rms == last.logarithmic_score == math.inf
    assert math.isnan(last.u_rms)
    assert math.isnan(last.reduced_chi_square)
    (alone,) = _score(ready, {"refused": (MeanKind(), refused)})
    assert alone.weight == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_weights_are_the_most_probable_ones(seed: int) -> None:
    """Of two models on a grid: the logarithm of the mixture, and of each weight times its prior."""
    rng = np.random.default_rng(seed)
    logs, prior = rng.normal(0.0, 1.0, (2, 9)), np.array([0.5, 2.0])
    share = np.linspace(1e-5, 1.0 - 1e-5, 20_001)
    density = np.exp(logs)
    posterior = np.log(np.outer(share, density[0]) + np.outer(1.0 - share, density[1])).sum(axis=1)
    posterior += prior[0] * np.log(share) + prior[1] * np.log(1.0 - share)
    best = float(share[np.argmax(posterior)])
    assert 0.12 < best < 0.88
    # A value that is improbable under both says as much as any other.
    logs -= 200.0 * np.arange(9)
    assert stacking_weights(logs, prior) == pytest.approx([best, 1.0 - best], abs=1e-4)


def test_a_weight_below_a_tenth_counts_for_nothing() -> None:
    """Models without a difference have the weights of their priors; of 0.09, 0.31 and 0.6 the
    first is left out, of 0.11 it is not."""
    same = np.zeros((3, 4))
    assert stacking_weights(same, np.array([0.09, 0.31, 0.6])) == pytest.approx(
        [0.0, 0.31 / 0.91, 0.6 / 0.91], abs=1e-6
    )
    assert stacking_weights(same, np.array([0.11, 0.29, 0.6])) == pytest.approx(
        [0.11, 0.29, 0.6], abs=1e-6
    )


def test_an_unknown_tip_changes_neither_the_distances_nor_the_scatter_of_a_map() -> None:
    """A simulated probe with noise of 0.1 µm, touched without its tip's diameter and with it: the
    level of 4 µm between the first guess of the tip and the fit is in no distance, and the tip's
    error is stated beside that of the map."""
    n = np.repeat(fibonacci_cap(18, np.radians(95.0)), 2, axis=0)
    pretravel = predict(load_probe("omp40-2"), n, "analytic").pretravel
    noise = 0.1 * UM * np.random.default_rng(4).standard_normal(len(n))
    touches = Touches(n * (15.5 - pretravel - noise)[:, None] + [3.0, 4.0, 5.0], n)
    u, maps, part = [], [], sphere_pattern_25()
    for tip in (None, 6.0):
        setup = QualificationSetup(25.0, tip_diameter=tip, search_outliers=False)
        ready = prepare(touches, setup)
        fit = PhysicalKind().fit(ready.observation, ready.observation.repeats)
        assert (fit.tip_radius is None) == (tip is not None)
        (score,) = compare_kinds(ready, {"physical": (PhysicalKind(), fit)})
        # Means of two touches scatter by 0.07 µm, and the prediction of each adds to it.
        assert 0.05 * UM < score.rms < 0.15 * UM
        u.append(np.sqrt(fit.covariance.variance_of(fit.basis.design(part))))
        maps.append(fit.basis.value(part, fit.coefficients) - (fit.tip_radius or 3.0))
    assert u[0] == pytest.approx(u[1], rel=0.5)
    # Points of a part are the same, but for a shift of the reference.
    apart = maps[1] - maps[0]
    apart -= part @ np.linalg.lstsq(part, apart)[0]
    assert apart.std() < 0.1 * UM


GIVEN = {
    # Distances of fourteen directions in µm, and their u. Two of the last three are improbable for
    # all, so that they count alike; the last one is a little above exp(-50) for one kind alone.
    "mean": ([0.5, -0.9, 0.2, 1.1, -0.3, 0.4, 0.8, -0.2, 0.1, 0.6, 1.2, 30.0, 22.4, 9.9], 0.7),
    "known": ([0.9, -0.4, 0.7, 0.2, 1.6, 0.1, -2.0, 0.9, -0.6, 0.3, 0.4, 90.0, 31.2, 14.6], 1.5),
    "poor": ([9.0] * 11 + [99.0] * 3, 1.0),
    "poorer": ([12.0] * 11 + [99.0] * 3, 1.0),
}


def _most_probable_share(first: np.ndarray, second: np.ndarray, priors: list[float]) -> float:
    share = np.linspace(1e-5, 1.0 - 1e-5, 40_001)
    mixture = np.logaddexp(np.log(share)[:, None] + first, np.log1p(-share)[:, None] + second)
    posterior = mixture.sum(axis=1) + priors[0] * np.log(share) + priors[1] * np.log1p(-share)
    return float(share[np.argmax(posterior)])


def test_weights_follow_from_the_densities_of_left_out_directions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Normal ones with the stated variances, per micrometre, of at least exp(-50). The best mixture
    of two kinds by a grid of their shares. Kinds far from both have no weight, the better first."""
    ready = _prepared(14, 1)
    seen: list[int] = []

    def given(part: PreparedTouches, _: KindOfMap, fit: str, splits: list[Any]) -> object:
        seen.append(part.observation.direction_count)
        first = splits[0]
        assert first.others.direction_count + first.hidden.direction_count == seen[-1]
        distance, u = GIVEN[fit]
        return UM * np.array(distance), np.full(14, (UM * u) ** 2)

    monkeypatch.setattr(kind_weights, "_left_out", given)
    kinds = {name: (MeanKind(), name) for name in ("poorer", "mean", "poor")}
    kinds["known"] = (WellKnownMean(), "known")
    scores = _score(ready, kinds)  # type: ignore[arg-type]
    assert [score.kind for score in scores][2:] == ["poor", "poorer"]
    logs = {
        name: np.maximum(norm.logpdf(distance, 0.0, u) + 0.5 * math.log(2.0 * math.pi), -50.0)
        for name, (distance, u) in GIVEN.items()
    }
    # Those without weight have at most a part of their priors, which are 0.2 of 15.2 touches.
    best = _most_probable_share(logs["mean"], logs["known"], [0.2, 0.6])
    assert 0.2 < best < 0.8
    weights = {score.kind: score.weight for score in scores}
    both = {"mean": kinds["mean"], "known": kinds["known"]}
    alone = {score.kind: score.weight for score in _score(ready, both)}  # type: ignore[arg-type]
    assert alone == pytest.approx({"mean": best, "known": 1.0 - best}, abs=2e-4)
    assert weights["poor"] == weights["poorer"] == 0.0
    assert weights["mean"] == pytest.approx(best, abs=0.03)
    monkeypatch.setattr(kind_weights, "MOST_COMPARED", 6)
    _score(ready, both)  # type: ignore[arg-type]
    assert seen == [14] * 6 + [6, 6]


def test_all_kinds_are_compared_in_the_same_directions() -> None:
    """Equator and pole: without some, the centre of each kind has another height, and what the
    others surround depended on it: the numbers of directions differed, and the command failed."""
    around = np.radians(np.arange(0.0, 360.0, 15.0))
    wall = np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
    n = np.tile(np.vstack([wall, [[0.0, 0.0, 1.0]]]), (2, 1))
    lobes = 4.0 + np.cos(3.0 * np.arctan2(n[:, 1], n[:, 0])) * (1.0 - n[:, 2]) - 3.0 * n[:, 2]
    noise = np.random.default_rng(3).normal(0.0, 0.3, len(n))
    touches = Touches(n * (15.5 - (lobes + noise) * UM)[:, None], n)
    kinds = [kind_named(name) for name in ("harmonic", "wozniak")]
    found = qualified(touches, QualificationSetup(25.0, tip_diameter=6.0), kinds)
    assert found.pretravel_map.kind == "harmonic"
