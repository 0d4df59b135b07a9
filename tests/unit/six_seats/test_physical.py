"""The physical kind: every field of a six-seat map from its unknowns, and what it says of a fit."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import f as fisher

from benchmarks.departures.patterns import USUAL_25, spread
from benchmarks.departures.probes import uneven
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.files.touches_csv import read_touches
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.spherical_harmonics import real_spherical_harmonics
from pretravel.qualification.qualifying import qualify
from pretravel.six_seats import physical
from pretravel.six_seats.physical import PhysicalKind, PhysicalMapFit, fit_physical
from pretravel.six_seats.scale_weights import WeightedScales, correction_at, covariance_over_scales
from pretravel.six_seats.six_seat_fit import PriorScales, SixSeatProblem, most_probable
from pretravel.six_seats.six_seat_slopes import six_seat_pretravel
from pretravel.six_seats.uneven_seats import PARAMETERS
from pretravel.touches import Touches
from tests.support.example_maps import example_qualification
from tests.support.examples import PART as PART_TOUCHES
from tests.support.examples import SPHERE as SPHERE_TOUCHES
from tests.support.made_up_probes import PATTERN, made_up_response, touches_of
from tests.support.six_seat_unknowns import parameters_of, rates_of

PART = read_touches(PART_TOUCHES).normals
UM = 1e-3
CASES = ["sphere", "tip unknown", "ring"]
REPEATS = Scatter(0.35 * UM, 9.0)
CENTER = np.array([30.0, -20.0, 10.0])


def test_example_probe() -> None:
    """The truth of the example is unknown here. The residuals of the fit are as large as the
    scatter of the repeats, so no lack of fit is detected, and the report states this."""
    result = example_qualification("physical")
    fit = result.fit
    assert isinstance(fit, PhysicalMapFit)
    assert fit.misfit > 0.05
    assert result.residuals.std() == pytest.approx(0.30e-3, rel=0.1)
    assert list(result.warnings) == []
    assert result.pretravel_map.kind == "physical"


@pytest.mark.parametrize("error", [2e-3, -4e-3])
def test_a_wrong_diameter_within_its_uncertainty_is_a_level(error: float) -> None:
    """At 4 µm with u = 2 µm the report said "not quite of the six-seat kind" (probability 4e-31):
    the error is common to all touches. The probability stays as large as that of the right
    diameter, 0.46; 4 µm are two u, and curve the model a little."""
    result = qualify(
        read_touches(SPHERE_TOUCHES), 24.9987 + error, tip_diameter=6.0, u_diameter=2e-3,
        kind="physical",
    )  # fmt: skip
    assert isinstance(result.fit, PhysicalMapFit)
    assert result.fit.misfit > 0.2
    assert list(result.warnings) == []


def _departing_touches(seed: int) -> tuple[Touches, np.ndarray]:
    """Touches of a probe with lobes of 1 um that no tripod has, and its pretravel on the part."""
    rng = np.random.default_rng(seed)
    response = made_up_response(rng, 0.0)

    def lobes(n: np.ndarray) -> np.ndarray:
        return np.asarray(1e-3 * np.cos(2.0 * np.arctan2(n[:, 1], n[:, 0])) * n[:, 2])

    touches = touches_of(response, PATTERN, rng)
    positions = touches.positions - lobes(PATTERN)[:, None] * PATTERN
    return replace(touches, positions=positions), response.pretravel(PART) + lobes(PART)


@pytest.mark.slow
def test_u_contains_what_the_model_misses() -> None:
    """Errors on the part, from the centre that was found, over their u: the mean square of 12 sets
    is near one. A set alone scatters by 0.5, because its points share a map: twelve by 0.15. Of the
    usual map, which weighs another kind too where the six seats miss something."""
    squares = []
    for seed in range(12):
        touches, truth = _departing_touches(seed)
        result = qualify(touches, 25.0, tip_diameter=6.0, search_outliers=False)
        shift = result.center - np.array([120.0, -40.0, 7.0])
        error = result.pretravel_map.pretravel(PART) - truth - PART @ shift
        u = np.hypot(
            result.pretravel_map.standard_uncertainty(PART), result.pretravel_map.fixed_scatter
        )
        squares.append(float(np.mean((error / u) ** 2)))
    assert 0.5 < np.mean(squares) < 1.6


def test_too_few_directions() -> None:
    n = sphere_pattern_25()[:7]
    with pytest.raises(PretravelError, match="touch at least 8"):
        qualify(Touches(n * 15.49, n), 25.0, tip_diameter=6.0, kind="physical")


@pytest.mark.parametrize("seed", [11, 17])
def test_a_very_uneven_probe_is_found(seed: int) -> None:
    """Of the tripod of `benchmarks.departures`, which has none of the package's physics. With a
    search at the usual asymmetry other modes were found: 0.37 and 0.52 µm.

    The mean of three touches has 0.17 µm, and between the touches nothing is better known.
    """
    generator, directions = np.random.default_rng([21, seed]), spread(150, 85.0)
    probe, normals = uneven(generator), np.repeat(USUAL_25, 3, axis=0)
    travel = probe.pretravel(normals, 2.0 / 25.0) + 3e-4 * generator.standard_normal(len(normals))
    touches = Touches(normals * (15.5 - travel)[:, None], normals)
    result = qualify(touches, 25.0, tip_diameter=6.0, kind="physical")
    found = result.pretravel_map.pretravel(directions) - directions @ result.center
    assert np.sqrt(np.mean((found - probe.pretravel(directions)) ** 2)) < 0.3e-3


@cache
def _observed(case: str) -> Observation:
    """Thirteen directions, one to three touches in each, with a noise of 0.3 µm."""
    rng = np.random.default_rng([7, 2])
    response = made_up_response(rng, 0.3)
    groups = np.repeat(np.arange(13), 1 + np.arange(13) % 3)
    if case == "ring":
        azimuth = 0.2 + 0.48 * groups
        outward = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
        values = response.pretravel(-outward) + 0.3 * UM * rng.standard_normal(len(groups))
        positions = CENTER + outward * (20.0 - 3.0 + values)[:, None]
        return Observation(positions, groups, CENTER, 20.0, 3.0, ring=True)
    n = fibonacci_cap(13, math.radians(95.0))[groups]
    values = response.pretravel(n) + 0.3 * UM * rng.standard_normal(len(groups))
    positions = CENTER + n * (15.5 - values)[:, None]
    known = case == "sphere"
    return Observation(positions, groups, CENTER, 12.5, 3.0, ring=False, tip_known=known)


@cache
def _fitted(case: str) -> PhysicalMapFit:
    problem = SixSeatProblem(_observed(case))
    start = problem.prior
    start[problem.axes : problem.extra] = 10.0 * UM
    start[problem.azimuth] = 1.1
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(physical, "_with_disagreement", lambda *_: pytest.fail("of a near start"))
        return fit_physical(_observed(case), REPEATS, start)


def _averaged(case: str) -> tuple[SixSeatProblem, np.ndarray, np.ndarray]:
    problem, fit = SixSeatProblem(_observed(case)), _fitted(case)
    x, scales = fit.unknowns, fit.scales
    covariance = covariance_over_scales(problem, x, scales)
    return problem, correction_at(problem, x, scales.scales[0]), covariance


@pytest.mark.parametrize("case", CASES)
def test_the_map_is_that_of_the_unknowns(case: str) -> None:
    """The six-seat probe, the correction, and a shift that the centre has already."""
    (problem, correction, _), fit = _averaged(case), _fitted(case)
    x = fit.unknowns
    axes = 2 if case == "ring" else 3
    level = float(x[3]) if case == "tip unknown" else 0.0
    assert fit.basis.values == pytest.approx(parameters_of(x))
    assert fit.basis.tip_radius == 3.0
    assert np.array_equal(fit.basis.terms, problem.terms)
    expected = np.concatenate([[1.0], np.zeros(4 + 18), correction])
    assert fit.coefficients == pytest.approx(expected, abs=1e-12)
    assert fit.shift == pytest.approx(-x[:axes])
    assert fit.tip_radius is None or fit.tip_radius == pytest.approx(3.0 + level)
    assert (fit.tip_radius is None) == (case != "tip unknown")
    assert fit.observation is problem.observation
    assert math.isnan(fit.misfit)
    assert fit.disagreement == 0.0
    # Each touch about the centre that was found, less the map there.
    seen = fit.observation
    offset = seen.positions - CENTER - np.append(x[:axes], np.zeros(3 - axes))
    offset = offset[:, :axes]
    distance = np.sqrt(np.sum(offset**2, axis=1))
    n = np.zeros((len(distance), 3))
    n[:, :axes] = (-1.0 if case == "ring" else 1.0) * offset / distance[:, None]
    values = distance - 17.0 if case == "ring" else 15.5 + level - distance
    left = values - six_seat_pretravel(parameters_of(x), n)[0]
    left -= real_spherical_harmonics(n, problem.terms) @ correction
    # The response smooths Hertz's law below a micronewton, by less than 0.01 nm.
    assert fit.residuals == pytest.approx(left, abs=1e-10)
    # The mean is that of the least-squares sphere or circle about the first centre.
    design = np.column_stack([np.ones(len(n)), seen.directions[:, :axes]])
    inverse = np.linalg.inv(design.T @ design)
    assert fit.mean == pytest.approx(float((inverse @ design.T @ seen.values)[0]), rel=1e-9)
    assert fit.u_mean == pytest.approx(fit.noise * math.sqrt(inverse[0, 0]), rel=1e-9)


@pytest.mark.parametrize("case", CASES)
def test_the_uncertainty_is_that_of_distances(case: str) -> None:
    """A shift of the centre moves a touched point against the map's error, and a larger tip means
    less pretravel; parameters and correction act as their slopes and harmonics."""
    (problem, _, covariance), fit = _averaged(case), _fitted(case)
    axes, extra = problem.axes, problem.extra
    n = fibonacci_cap(40, math.radians(90.0))
    if case == "ring":
        n = np.stack([np.cos(np.arange(9.0)), np.sin(np.arange(9.0)), np.zeros(9)], axis=1)
    rates = rates_of(fit.unknowns)
    slopes = six_seat_pretravel(parameters_of(fit.unknowns), n)[1] * rates
    tip = -np.ones((len(n), extra - axes))
    rows = np.hstack([-n[:, :axes], tip, slopes, real_spherical_harmonics(n, problem.terms)])
    expected = np.sum((rows @ covariance) * rows, axis=1)
    found = fit.covariance.variance_of(fit.basis.design(n))
    assert found == pytest.approx(expected, rel=1e-6)
    assert fit.shift_covariance == pytest.approx(covariance[:axes, :axes])
    parameters = covariance[extra : extra + 18, extra : extra + 18]
    assert fit.parameter_covariance == pytest.approx(parameters * np.outer(rates, rates))
    scale = fit.scales.mean("asymmetry")
    prior = [(p.spread * (scale if i >= 7 else 1.0)) ** 2 for i, p in enumerate(PARAMETERS)]
    assert fit.learned == pytest.approx(1.0 - np.diag(parameters) / prior, abs=1e-12)


@pytest.mark.parametrize("case", CASES)
def test_the_scatter_and_its_degrees_of_freedom(case: str) -> None:
    """Touches less the trace of the matrix from touches to fitted values, of the rows of touches
    and priors together; the trace by an orthonormal basis of their columns."""
    fit, problem = _fitted(case), SixSeatProblem(_observed(case))
    best, weights = fit.scales.scales[0], fit.scales.weights
    for name in ("noise", "fixed_scatter"):
        squares = [getattr(scales, name) ** 2 for scales in fit.scales.scales]
        assert getattr(fit, name) == pytest.approx(math.sqrt(np.average(squares, weights=weights)))
    assert fit.noise_is_repeatability
    own = np.sqrt(best.fixed_scatter**2 + best.noise**2 / problem.count)
    columns = np.hstack([problem.misses(fit.unknowns)[1], problem.harmonics])
    touches = columns / own[:, None]
    spread = np.concatenate(
        [problem.spread(best.asymmetry), np.sqrt(problem.correction_variances(best.correction))]
    )
    priors = np.hstack([np.zeros((len(spread), problem.extra)), np.diag(1.0 / spread)])
    spent = float(np.sum(np.linalg.qr(np.vstack([touches, priors]))[0][: len(own)] ** 2))
    assert fit.dof == pytest.approx(max(problem.count.sum() - spent, 1.0), rel=1e-5)
    assert problem.extra + 1 < spent < 13


def test_nearly_all_touches_can_be_spent_but_one() -> None:
    """One touch in each of eight directions, beside a correction without a limit."""
    groups = np.arange(8)
    n = fibonacci_cap(8, math.radians(95.0))
    seen = Observation(n * 15.49, groups, np.zeros(3), 12.5, 3.0, ring=False)
    problem = SixSeatProblem(seen)
    wide = PriorScales(1.0, 1.0, 0.0, 1e-4)
    weighted = WeightedScales((wide,), np.ones(1), 0.0)
    assert physical._effective_dof(problem, problem.prior, weighted) == 1.0


@pytest.mark.parametrize("case", CASES)
def test_a_misfit_is_the_probability_of_larger_residuals(case: str) -> None:
    """Fisher's test of the mean touches about the best six-seat probe without a correction, against
    the repeats; the error of the reference's radius is common to all. Nothing follows from less
    than ten degrees of freedom among the repeats."""
    fit, problem = _fitted(case), SixSeatProblem(_observed(case))
    repeats = Scatter(0.15 * UM, 10.0)
    asymmetry = fit.scales.scales[0].asymmetry
    alone = PriorScales(asymmetry, 1e-6, 0.0, 0.15 * UM)
    best, _ = most_probable(problem, alone, fit.unknowns)
    misses, slopes = problem.misses(best)
    scatter = np.diag((0.15 * UM) ** 2 / problem.count)
    common = problem.observation.u_constant**2 + np.zeros_like(scatter)
    root = np.linalg.inv(np.linalg.cholesky(scatter + common))
    priors = np.hstack([np.zeros((18, problem.extra)), np.diag(1.0 / problem.spread(asymmetry))])
    basis = np.linalg.qr(np.vstack([root @ slopes, priors]))[0]
    free = max(13.0 - float(np.sum(basis[:13] ** 2)), 1.0)
    expected = fisher.sf(float(np.sum((root @ misses) ** 2)) / free, free, 10.0)
    found = physical._misfit(problem, fit.unknowns, fit.scales, repeats)
    assert 1e-6 < expected < 0.9999
    # The program's covariance contains a correction of 1 nm: 0.03 % of the probability.
    assert found == pytest.approx(expected, rel=1e-3)
    less = physical._misfit(problem, fit.unknowns, fit.scales, Scatter(0.15 * UM, 9.9))
    assert math.isnan(less)


@pytest.mark.parametrize("case", CASES)
def test_the_gauge_is_told_in_micrometres(case: str) -> None:
    problem = SixSeatProblem(_observed(case))
    x = problem.prior
    x[problem.axes : problem.extra] = 7.0 * UM
    sizes = np.array([0.11, 0.34, 0.58, 0.9][: problem.extra]) * UM
    said = physical._gauge(problem, x, np.diag(np.append(sizes, np.full(18, 5.0)) ** 2))
    along = "" if case == "ring" else " and 0.58 µm along it"
    assert f"with u = 0.34 µm across the axis{along}. This error shifts" in said
    tip = ". The tip's diameter, 6.0140 mm, u = 1.8 µm, follows from the model"
    assert (tip in said) == (case == "tip unknown")
    assert ("tip" in said) == (case == "tip unknown")
    turned = np.diag(np.append(sizes[[1, 0, *range(2, len(sizes))]], np.full(18, 5.0)) ** 2)
    assert physical._gauge(problem, x, turned) == said


def test_what_people_are_told_of_a_fit() -> None:
    """Of few directions, of a difference from a harmonic map, of a misfit; of nothing else."""
    fit, groups = _fitted("sphere"), np.arange(15)
    seen = replace(fit.observation, positions=np.ones((15, 3)), groups=groups)
    few = replace(seen, groups=groups % 14)
    scales = WeightedScales((PriorScales(1.0, 1.26 * UM, 0.0, UM),), np.ones(1), 0.0)
    for changes, words in (
        ({}, None),
        ({"observation": few}, "14 directions are few"),
        ({"disagreement": 2.34 * UM}, "differs by 2.3 µm (root mean square)"),
        ({"misfit": 0.0101}, None),
        ({"misfit": 0.0099}, "probability 0.0099 for"),
        ({"misfit": 0.0, "scales": scales}, "a correction of 1.3 µm"),
    ):
        made = replace(fit, **({"observation": seen} | changes))  # type: ignore[arg-type]
        told = PhysicalKind().warnings(made, 0.0)
        assert len(told) == (words is not None)
        assert words is None or words in told[0]


@pytest.mark.parametrize("dof", [9.9, 10.0])
@pytest.mark.parametrize("searched", [5, 7])
def test_the_search_begins_in_some_directions(
    dof: float, searched: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of thirteen directions five, but all of up to twice as many as are searched; it goes on in
    all directions. Well known noise tells a misfit by itself."""
    repeats, calls = Scatter(0.3 * UM, dof), []

    def sought(problem: SixSeatProblem, *_: object) -> object:
        calls.append(problem.observation.direction_count)
        return [("found", SimpleNamespace(scales=("scales", "another")), 0.0)]

    def settled(problem: SixSeatProblem, x: str, scales: str, *_: object, **__: int) -> object:
        calls.append((problem.observation.direction_count, x, scales))
        return x, SimpleNamespace(scales=("scales",))

    def concluded(problem: SixSeatProblem, x: str, *given: object) -> object:
        assert given[1:] == ("misfit", repeats)
        return problem.observation, x

    monkeypatch.setattr(physical, "SEARCHED", searched)
    monkeypatch.setattr(physical, "_searched", sought)
    monkeypatch.setattr(physical, "_settled", settled)
    monkeypatch.setattr(physical, "_misfit", lambda part, x, *_: "misfit")
    monkeypatch.setattr(physical, "_concluded", concluded)
    monkeypatch.setattr(physical, "_with_disagreement", lambda fit, part: ("compared", fit, part))
    observation = _observed("sphere")
    found: Any = fit_physical(observation, repeats)
    if dof < 10.0:
        word, found, part = found
        assert word == "compared"
        assert part.observation.direction_count == (5 if searched == 5 else 13)
    assert found == (observation, "found")
    assert calls == ([5, (13, "found", "scales")] if searched == 5 else [13])


def test_fits_to_parts_in_one_search_are_those_of_each_alone() -> None:
    """Two parts of the example, without six directions each. Both ways end within 1e-4 standard
    deviations of the mode, some 0.03 nm."""
    fit = example_qualification("physical").fit
    seen, kind = fit.observation, PhysicalKind()
    kept = [seen.groups >= 6, seen.groups < seen.direction_count - 6]
    parts = [seen.take(mask) for mask in kept]
    together = kind.fits_of_parts(fit, seen, kept, parts)
    for part, own in zip(parts, together, strict=True):
        alone = kind.fit_near(fit, part, part.repeats)
        directions = seen.group_directions
        value = own.basis.value(directions, own.coefficients)
        assert value == pytest.approx(alone.basis.value(directions, alone.coefficients), abs=1e-7)
        assert own.covariance.variances == pytest.approx(alone.covariance.variances, rel=1e-3)
