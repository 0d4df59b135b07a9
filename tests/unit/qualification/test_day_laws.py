"""Left-out touches, digests, a day's terms and verdicts against made-up maps and least squares."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.maps.kinds.harmonic import HarmonicBasis, fit_harmonic
from pretravel.maps.observation import Scatter
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance, QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.change_tests import changes_of, touches_and_map
from pretravel.qualification.day_terms import _fitted, _form, day_terms
from pretravel.qualification.delay import several_feeds, signal_delay, travel_per_second
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import Outlier
from pretravel.qualification.own_touches import (
    _by_chance,
    own_touches_warnings,
    touch_digests,
    touches_that_made,
)
from pretravel.qualification.probe_drift import (
    ProbeDrift,
    drift_of_changes,
    drifted_map,
    slope_around_axis,
    spread_of,
)
from pretravel.qualification.qualify import prepare
from pretravel.qualification.touch_order import (
    drift_columns,
    drift_is_separable,
    relative_times,
    time_within_directions,
)
from pretravel.qualification.verification import _gross_warnings, touches_beside_map, verify
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance

UM = 1e-3
N = sphere_pattern_25()
NORMALS = np.repeat(N, 3, axis=0)
SETUP = QualificationSetup(25.0, tip_diameter=6.0)
TERMS = np.array([[0, 0], [2, 0], [3, 3], [3, -3]])
COEFFICIENTS = np.array([10.0, -2.0, 1.5, 0.8]) * UM


def made_map(**changes: object) -> PretravelMap:
    made = PretravelMap(
        HarmonicBasis(TERMS), COEFFICIENTS,
        Covariance.independent(np.array([0.05, 0.1, 0.08, 0.08]) ** 2 * UM**2),
        DirectionSupport(N), tip_radius=3.0, repeatability=0.3 * UM, repeatability_dof=50.0,
    )  # fmt: skip
    return replace(made, **changes)  # type: ignore[arg-type]


def value_of(n: np.ndarray) -> np.ndarray:
    return np.asarray(HarmonicBasis(TERMS).design(n) @ COEFFICIENTS)


def touches(seed: int = 1, normals: np.ndarray = NORMALS, noise: float = 0.3 * UM) -> Touches:
    rng = np.random.default_rng(seed)
    distance = 15.5 - value_of(normals) + noise * rng.standard_normal(len(normals))
    return Touches(normals * distance[:, None] + [5.0, -7.0, 9.0], normals)


def moved(given: Touches, rows: list[int], off: float) -> Touches:
    positions = given.positions.copy()
    positions[rows] += off * given.normals[rows]
    return replace(given, positions=positions)


# Touches made ready


def test_a_touch_that_is_left_out_counts_nowhere() -> None:
    """Centre, radius, scatter and digests are those of the others alone; all touches stay beside
    the same centre."""
    given = moved(touches(), [40], 0.03)
    ready = prepare(given, SETUP)
    others = np.arange(75) != 40
    assert ready.used.tolist() == others.tolist()
    alone = observe(given.take(others), SETUP)
    assert ready.observation.values == pytest.approx(alone.values, abs=1e-12)
    assert ready.observation.groups.tolist() == alone.groups.tolist()
    assert ready.whole.values[others] == pytest.approx(alone.values, abs=1e-12)
    for one in (ready.observation, ready.whole):
        assert one.center == pytest.approx(alone.center, abs=1e-12)
        assert one.tip_radius == alone.tip_radius
    assert len(ready.whole.values) == 75
    assert ready.whole.values[40] - np.mean(alone.values) < -0.025
    assert ready.observation.repeats == alone.repeats
    assert ready.digests == touch_digests(given.positions[others])
    assert [one.rows for one in ready.outliers] == [(40,)]
    assert ready.outliers[0].left_out
    assert ready.setup is SETUP
    assert ready.touches is given
    assert ready.delay is None


@pytest.mark.parametrize("wrong", [False, True])
def test_without_a_gross_error_or_a_search_all_touches_are_used(wrong: bool) -> None:
    given = moved(touches(), [40], 0.03) if wrong else touches()
    ready = prepare(given, replace(SETUP, search_outliers=not wrong))
    assert ready.used.all()
    assert ready.observation is ready.whole
    assert ready.observation.values == pytest.approx(observe(given, SETUP).values, abs=1e-12)
    assert ready.digests == touch_digests(given.positions)
    assert ready.outliers == ()
    assert (ready.detail is None) == wrong


def fed(delay: float, feeds: tuple[float, float] = (50.0, 150.0)) -> Touches:
    """Of a probe with one radius; the noise does not change with the feed."""
    feed = np.tile(np.repeat(feeds, 25), 2)
    noise = np.tile(0.3 * UM * np.random.default_rng(3).standard_normal((2, 1, 25)), (1, 2, 1))
    distance = 15.49 + noise.ravel() - feed / 60.0 * delay
    n = np.tile(N, (4, 1))
    return Touches(n * distance[:, None], n, feeds=feed)


def test_a_signal_does_not_come_before_its_trigger_beyond_three_u() -> None:
    """u is 0.04 ms: 0.3 µm of 100 touches at ±0.83 mm/s."""
    quick = replace(SETUP, search_outliers=False)
    assert several_feeds(fed(0.0))
    for delay in (-0.05e-3, 2e-3):
        found = prepare(fed(delay), quick)
        assert found.delay is not None
        assert found.delay.delay == pytest.approx(delay, abs=1e-6)
        assert found.delay.u_delay == pytest.approx(0.3e-3 / (10.0 * 50.0 / 60.0), rel=0.3)
        assert np.linalg.norm(found.touches.positions, axis=1) == pytest.approx(
            np.linalg.norm(fed(0.0).positions, axis=1), abs=1e-5
        )
        assert (found.delay.slowest, found.delay.fastest) == (50.0, 150.0)
    with pytest.raises(PretravelError, match=r"signal delay of -0.200 ms \(u = 0.03\d\)"):
        prepare(fed(-0.2e-3), quick)
    near = prepare(fed(2e-3, (50.0, 51.0)), quick)
    assert near.delay is None
    assert near.touches.positions == pytest.approx(fed(2e-3, (50.0, 51.0)).positions)
    assert near.warnings[0].startswith("the touches were made at 50 to 51 mm/min, which does not")


@pytest.mark.parametrize("repeats", [Scatter(0.2 * UM, 10.0), Scatter(0.2 * UM, 9.0)])
def test_a_delay_is_generalised_least_squares_with_the_map_integrated_out(repeats: Scatter) -> None:
    """f M y / f M f with the hat matrix column by column; noise from ten repeats on is theirs, of
    fewer it is pooled with what is left of the map and with 0.3 µm, which counts four."""
    given = fed(1e-3)
    fit = fit_harmonic(observe(given, SETUP))
    hat = np.stack(
        [fit.smoothing.fitted(row, fit.observation.groups) for row in np.eye(100)], axis=1
    )
    f = np.repeat(1.0, 100) * np.tile(np.repeat([50.0, 150.0], 25), 2) / 60.0
    assert travel_per_second(given) == pytest.approx(f, rel=1e-12)
    left = f - hat @ f
    found = signal_delay(given, fit, repeats)
    delay = f @ fit.residuals / (f @ left)
    assert found.delay == pytest.approx(delay, rel=1e-9)
    sigma = 0.2 * UM
    if repeats.dof < 10.0:
        rest = float(np.sum((fit.residuals - left * delay) ** 2))
        squares = rest + 9.0 * sigma**2 + 4.0 * (0.3 * UM) ** 2
        sigma = math.sqrt(squares / (fit.dof - 1.0 + 9.0 + 4.0))
    assert found.u_delay == pytest.approx(sigma / math.sqrt(f @ left), rel=1e-9)


# Digests


def split_mix(state: int) -> int:
    """Steele, Lea and Flood 2014, with integers of Python."""
    z = (state + 0x9E3779B97F4A7C15) % 2**64
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
    return z ^ (z >> 31)


def test_digests_are_those_of_stored_maps() -> None:
    """A map of an earlier version keeps them: coordinates in 1e-9 mm, mixed one after the other,
    of which 48 bits are kept. The first value is that of published tests of SplitMix64."""
    assert split_mix(1234567) == 6457827717110365317
    positions = np.array([[1.25, -3.5, 1e-9], [0.0, 0.0, 3.1], [-7.0, 2.0, 0.4]])
    expected = []
    for place in positions:
        mixed = 0
        for step in np.rint(place * 1e9).astype(int).tolist():
            mixed = split_mix((mixed + step) % 2**64)
        expected.append(f"{mixed >> 16:012x}")
    assert touch_digests(positions) == "".join(sorted(expected))
    assert touch_digests(positions[:1], touch_digests(positions[1:])) == "".join(sorted(expected))
    assert touches_that_made(Touches(positions, N[:3]), "no digests at all") == (0, 3)


def test_of_a_thousand_digests_the_touches_below_the_last_are_compared() -> None:
    positions = np.random.default_rng(1).uniform(-9.0, 9.0, (1600, 3))
    normals = np.tile([0.0, 0.0, 1.0], (1600, 1))
    each = [touch_digests(row[None]) for row in positions]
    for count in (999, 1000, 1300):
        kept = sorted(each[:count])[:1000]
        digests = touch_digests(positions[:count])
        assert digests == "".join(kept)
        last = kept[-1] if count >= 1000 else "g"
        below = [row for row, own in enumerate(each) if own <= last]
        found = sum(row < count for row in below)
        assert touches_that_made(Touches(positions, normals), digests) == (found, len(below))


def rounded(count: int) -> np.ndarray:
    return np.asarray(np.round(np.random.default_rng(5).uniform(-9.0, 9.0, (count, 3)), 3))


@pytest.mark.parametrize(("sigma", "made"), [(3.0, 40), (5.0, 25), (5.0, 10), (500.0, 3000)])
def test_touches_alike_by_chance_are_a_binomial_number(sigma: float, made: int) -> None:
    """Two normal values fall into one cell of 1 µm with the sum of the squares of the cells'
    probabilities; each touch has as many chances as a direction was touched. Four standard
    deviations above; the number that a thousand kept digests are of is known to 3 %."""
    kept = touch_digests(rounded(made))
    known = made_map(repeatability=sigma * UM, provenance=Provenance(touch_digests=kept))
    cells = np.diff(stats.norm(scale=sigma).cdf(np.arange(-8.0 * sigma - 0.5, 8.0 * sigma + 1.0)))
    chance = min(max(made / 25.0, 1.0) * float(np.sum(cells**2)), 1.0)
    expected = 50.0 * chance + 4.0 * math.sqrt(50.0 * chance * (1.0 - chance))
    near = 0.01 if made < 1000 else 0.05  # steps are not quite fine
    assert _by_chance(rounded(50), known, 50) == pytest.approx(min(expected, 45.0), rel=near)


def test_only_more_touches_than_by_chance_are_named() -> None:
    """Steps of 1 µm at 0.3 µm: any touch can be alike. Nine of ten are then still by chance; those
    of positions without a step are never."""
    kept = rounded(50)
    known = made_map(provenance=Provenance(touch_digests=touch_digests(kept)))
    other = kept + 1.0
    for count, named in ((45, 0), (46, 1)):
        mixed = np.vstack([kept[:count], other[count:]])
        given = Touches(mixed, NORMALS[:50])
        assert len(own_touches_warnings(given, known, "why.")) == named
    smooth = np.random.default_rng(2).uniform(-9.0, 9.0, (50, 3))
    known = made_map(provenance=Provenance(touch_digests=touch_digests(smooth[:1])))
    (found,) = own_touches_warnings(Touches(smooth, NORMALS[:50]), known, "why.")
    assert found == (
        "1 of 50 touches are touches that the map was made from, to the last digit: why."
    )


# Drift of reference and probe


def test_time_within_directions_is_an_analysis_of_variance() -> None:
    rng = np.random.default_rng(3)
    groups, times = rng.integers(0, 6, 30), np.cumsum(rng.uniform(0.1, 2.0, 30))
    within = sum(len(t) * np.var(t) for t in (times[groups == group] for group in range(6)))
    assert time_within_directions(groups, times) == pytest.approx(within / (30.0 * np.var(times)))
    assert time_within_directions([0, 0, 1], [4.0, 4.0, 4.0]) == 0.0
    share = (times - times[0]) / (times[-1] - times[0]) - 0.5
    assert relative_times(times[::-1]) == pytest.approx(share[::-1], abs=1e-12)
    n = fibonacci_cap(30)
    rows = np.array([t * row for t, row in zip(share, n, strict=True)])
    assert drift_columns(n, times) == pytest.approx(rows)


def test_a_drift_needs_six_repeats_and_a_fifth_of_the_time() -> None:
    for count, known in ((6, True), (5, False)):
        groups = np.concatenate([np.arange(8), np.arange(count)])
        assert drift_is_separable(groups, np.arange(8.0 + count)) == known
    # Six pairs, d apart in each, of directions that begin at 0, 1, 2, …: 6 d²/2 within.
    groups = np.repeat(np.arange(6), 2)
    for share, known in ((0.21, True), (0.19, False)):
        begun = np.repeat(np.arange(6.0), 2)
        between = 12.0 * np.var(np.arange(6.0))
        apart = math.sqrt(share * between / (1.0 - share) / 3.0)
        times = begun + np.tile([-0.5, 0.5], 6) * apart
        assert time_within_directions(groups, times) == pytest.approx(share)
        assert drift_is_separable(groups, times) == known


def test_a_drifted_map_is_wider_by_its_ways() -> None:
    """Scale: the map itself; level: 1 in all directions; turn: less the slope around the axis, in
    closed form of lobes. Their variances add to that of the map."""
    made = made_map()
    drift = ProbeDrift(scale=0.03, level=0.4 * UM, turn=0.02, form=0.0)
    found = drifted_map(made, drift)
    design = HarmonicBasis(TERMS).design(N)
    lobes = design[:, 2:] @ np.array([[0.0, 3.0], [-3.0, 0.0]])  # cos 3φ → -3 sin 3φ
    slope = (
        lobes @ COEFFICIENTS[2:] * np.sign(lobes @ COEFFICIENTS[2:] @ slope_around_axis(made, N))
    )
    # A difference over 0.4°: sin(3 · 0.2°) over its angle.
    assert slope_around_axis(made, N) == pytest.approx(slope, rel=3e-5, abs=1e-9)
    assert design @ found.ways.T == pytest.approx(
        np.column_stack([value_of(N), np.ones(25), -slope]), rel=1e-4, abs=1e-8
    )
    spread = [0.03, 0.4 * UM, 0.02]
    assert spread_of(drift) == pytest.approx(spread)
    by_ways = sum(s**2 * np.outer(way, way) for s, way in zip(spread, found.ways, strict=True))
    assert found.covariance == pytest.approx(made.covariance.matrix + by_ways, rel=1e-12)
    assert (found.pretravel_map, found.drift, found.axes) == (made, drift, 3)
    assert drifted_map(made, drift, ring=True).axes == 2
    variance = np.diag(design @ found.covariance @ design.T)
    assert found.variance(N, found.covariance) == pytest.approx(variance, rel=1e-9)
    # The basis has no first harmonic: nothing of it is a shift.
    assert found.without_shift == pytest.approx(np.eye(4))
    assert not found.from_center


def test_the_drift_of_verifications_is_their_variance_less_that_of_their_u() -> None:
    """By hand: three times 0.3² of the default, and 1² + 2² - 2 · 0.5² µm² of two; five of them."""
    found = drift_of_changes(
        [1.0 * UM, -2.0 * UM, np.nan], np.full(3, 0.5 * UM), [0.01, np.nan, np.nan], np.zeros(3)
    )
    assert found.level == pytest.approx(UM * math.sqrt((0.27 + 4.5) / 5.0), rel=1e-12)
    default = math.radians(0.3)
    assert found.turn == pytest.approx(math.sqrt((3.0 * default**2 + 1e-4) / 4.0), rel=1e-12)
    assert (found.scale, found.form) == (ProbeDrift().scale, ProbeDrift().form)
    assert found.source == "level and turn from 2 verifications, the rest assumed"
    one = drift_of_changes([0.1 * UM], [0.5 * UM], [np.nan], [1.0])
    assert one.level == pytest.approx(0.3 * UM * math.sqrt(0.75), rel=1e-12)
    assert one.source == "level and turn from 1 verification, the rest assumed"
    assert drift_of_changes([np.nan], [1.0], [0.1], [0.0]) == ProbeDrift()
    for name in ("scale", "level", "turn", "form"):
        assert getattr(ProbeDrift(**{name: 0.0}), name) == 0.0
        for value in (-1e-9, math.inf):
            with pytest.raises(PretravelError, match=f"drift of {name} is"):
                ProbeDrift(**{name: value})


# One day


def test_terms_of_a_day_are_least_squares_with_equal_weights() -> None:
    """Their covariance is that of unweighted least squares of the touches' means (the sandwich)."""
    given = touches(2)
    beside = touches_beside_map(given, made_map(), 25.0).kept
    change, covariance, rest = _fitted(beside)
    found, *_ = np.linalg.lstsq(beside.design, beside.differences)
    assert change == pytest.approx(found[3:], rel=1e-9)
    of_touches = np.diag(beside.covariance - beside.of_map)
    gain = np.linalg.inv(beside.design.T @ beside.design) @ beside.design.T
    sandwich = gain @ np.diag(of_touches) @ gain.T
    assert covariance == pytest.approx(sandwich[3:, 3:], rel=1e-7)
    left = beside.differences - beside.design @ found
    assert rest @ beside.differences == pytest.approx(left, abs=1e-12)
    terms = day_terms(given, made_map(), SETUP)
    assert [terms.level, terms.scale, terms.turn] == pytest.approx(change)
    assert [terms.u_level, terms.u_scale, terms.u_turn] == pytest.approx(
        np.sqrt(np.diag(sandwich)[3:])
    )
    assert (terms.form, terms.u_form) == _form(beside, rest)
    assert (terms.touches, terms.directions) == (75, 25)
    assert terms.gross == ()
    assert np.isnan([terms.delay, terms.u_delay, terms.feed]).all()
    feeds = np.where(np.arange(75) % 2, 50.0, 80.0)
    own = day_terms(replace(given, feeds=feeds), made_map(), SETUP, own=True)
    assert own.feed == 80.0
    assert np.isnan([own.form, own.u_form]).all()
    flat = made_map(coefficients=np.array([10.0 * UM, 0.0, 0.0, 0.0]))
    only, u_only, _ = _fitted(touches_beside_map(given, flat, 25.0).kept)
    assert np.isfinite(only).tolist() == [True, False, False]
    assert np.isfinite(u_only).tolist() == [[True, False, False], [False] * 3, [False] * 3]


@pytest.mark.parametrize("size", [0.0, 3.0])
def test_the_form_of_days_scatters_as_its_u(size: float) -> None:
    """1000 draws of touches with the stated noise beside a change of form of 0 or 3 µm: its square
    is unbiased, and the deviation of its signed root is u: to 10 % far from zero. Near zero u is
    that of the root of a normal quantity, which this one is nearly: 25 %."""
    beside = touches_beside_map(touches(2), made_map(), 25.0).kept
    beside = replace(
        beside, of_map=0.0 * beside.of_map, covariance=beside.covariance - beside.of_map
    )
    _, _, rest = _fitted(beside)
    rng = np.random.default_rng(3)
    pattern = size * UM * rng.standard_normal(25)
    noise = np.sqrt(np.diag(beside.covariance)) * rng.standard_normal((1000, 25))
    forms, u = np.transpose([_form(replace(beside, differences=pattern + e), rest) for e in noise])
    true = float(np.mean((rest @ pattern) ** 2))
    squares = forms * np.abs(forms)
    assert np.mean(squares) == pytest.approx(true, abs=4.0 * np.std(squares) / math.sqrt(1000.0))
    assert np.std(forms) == pytest.approx(np.mean(u), rel=0.1 if size else 0.25)
    # An uncertain map makes differences too, which are no change of form.
    uncertain = replace(beside, covariance=2.0 * beside.covariance, of_map=beside.covariance)
    lower = _form(replace(uncertain, differences=pattern + noise[0]), rest)[0]
    expected = squares[0] - np.trace(rest @ beside.covariance @ rest.T) / 25.0
    assert lower * abs(lower) == pytest.approx(expected, rel=1e-9)


# Verification


def test_a_verification_states_what_its_tests_found() -> None:
    given, made = touches(5), made_map()
    found = verify(given, made, 25.0, false_alarm_rate=0.03)
    observation = observe(given, SETUP, made.rotation)
    beside = touches_and_map(observation, made, 0.0)
    tests = changes_of(beside, 0.03)
    for name in ("changed", "false_alarm_rate", "p_form", "p_map", "p_repeatability", "size",
                 "amplitude", "turn", "largest"):  # fmt: skip
        assert getattr(found, name) == getattr(tests, name)
    assert found.differences == pytest.approx(tests.differences)
    assert found.u_differences == pytest.approx(np.sqrt(np.diag(beside.covariance)))
    assert found.directions == pytest.approx(N, abs=1e-3)
    repeats = beside.scatter_of_touches
    assert (found.repeatability, found.repeatability_dof) == (repeats.deviation, repeats.dof)
    assert (found.step, found.touches, found.gross, found.warnings) == (0.0, 75, (), ())
    assert (found.causes, found.changed_with_gross) == ((), False)
    single = verify(touches(2, N), made, 25.0)
    assert np.isnan(single.repeatability)
    assert single.repeatability_dof == 0.0


@pytest.mark.parametrize(("step", "matters"), [(1.0, True), (0.1, True), (0.05, False)])
def test_a_step_matters_from_three_tenths_of_the_repeatability(step: float, matters: bool) -> None:
    given = touches(2)
    coarse = replace(given, positions=np.round(given.positions / (step * UM)) * (step * UM))
    found = verify(coarse, made_map(), 25.0)
    assert found.step == pytest.approx(step * UM if matters else 0.0)


@pytest.mark.parametrize(("bad", "left_out"), [(7, 7), (8, 0)])
def test_a_tenth_of_the_touches_at_most_is_left_out(bad: int, left_out: int) -> None:
    rows = [3 * direction for direction in range(4, 4 + bad)]
    given = moved(touches(2), rows, 0.05)
    beside = touches_beside_map(given, made_map(), 25.0)
    assert sorted(row for one in beside.gross for row in one.rows) == rows[:left_out]
    assert len(beside.kept.observation.values) == 75 - left_out
    assert len(beside.all.observation.values) == 75


def test_what_gross_touches_do_to_the_verdict_is_said() -> None:
    one = Outlier((3,), 0.02, 0.001, "t4 lies off")
    assert _gross_warnings((), True, False) == []
    assert _gross_warnings((one,), True, True) == [
        "t4 lies off. It was left out", "the verdict is the same with it"]  # fmt: skip
    assert _gross_warnings((one, one), False, False)[2] == "the verdict is the same with them"
    assert _gross_warnings((one,), False, True)[1] == (
        "without it the verdict is: no change; with: changed. Touch there again"
    )
    assert _gross_warnings((one, one), True, False)[2].startswith("without them the verdict is: ch")


@pytest.mark.parametrize("feed", [49.4, 49.6, 50.4, 50.6])
def test_a_hundredth_is_the_same_feed(feed: float) -> None:
    given = replace(touches(5), feeds=np.full(75, feed))
    made = made_map(feed=50.0)
    if abs(feed - 50.0) < 0.5:
        assert verify(given, made, 25.0).warnings == ()
    else:
        with pytest.raises(PretravelError, match=f"made at 50 mm/min, these touches at {feed} to"):
            verify(given, made, 25.0)
