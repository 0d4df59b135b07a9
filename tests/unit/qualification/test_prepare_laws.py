"""Touches made ready: limits from both sides, tilted probes, and directions that others predict."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import describe, fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicKind, fit_harmonic
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.delay import several_feeds, signal_delay, travel_per_second
from pretravel.qualification.machine_effects import machine_effects, without_machine
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import (
    Outlier,
    _confirmed,
    _left_out_distance,
    direction_outliers,
)
from pretravel.qualification.qualify import prepare
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance

UM = 1e-3
N = sphere_pattern_25()
AXIS = (0.48, 0.6, 0.64)
TILT = probe_rotation(AXIS)
UPRIGHT = QualificationSetup(25.0, tip_diameter=6.0, sphere_form=0.0)
TILTED = replace(UPRIGHT, axis=AXIS)


# What the machine adds


@pytest.mark.parametrize("setup", [UPRIGHT, TILTED])
def test_a_drift_is_taken_off_all_but_gross_touches(setup: QualificationSetup) -> None:
    """The reference moves by 4 µm in three passes; the touch that is 60 µm off stays where it is,
    and tells nothing of the drift: the estimate is that without it."""
    rng = np.random.default_rng(4)
    tilt = probe_rotation(setup.axis)
    groups = np.concatenate([rng.permutation(25) for _ in range(3)])
    n, time = N[groups], np.linspace(-0.5, 0.5, 75)
    drift = time[:, None] * np.array([0.004, -0.003, 0.002])
    radius = 15.49 + 1e-4 * rng.standard_normal(75)
    radius[30] += 0.06
    given = Touches((n * radius[:, None] + drift) @ tilt.T, n @ tilt.T)
    seen = observe(given, setup, tilt)
    found, effects = without_machine(given, seen, setup, tilt)
    others = np.arange(75) != 30
    alone = machine_effects(seen.take(others), given.positions[others])
    assert effects.drift == pytest.approx(alone.drift, abs=1e-12)
    assert effects.change[others] == pytest.approx(alone.change, abs=1e-12)
    assert np.linalg.norm(effects.drift) == pytest.approx(math.sqrt(29.0) * UM, rel=0.05)
    assert effects.change[30] == 0.0
    assert found.positions[30].tolist() == given.positions[30].tolist()
    along = np.sum((found.positions @ tilt) * n, axis=1)[others]
    mean = np.bincount(groups[others], along) / np.bincount(groups[others])
    left = along - mean[groups[others]]
    assert np.sqrt(np.sum(left**2) / 49.0) == pytest.approx(1e-4, rel=0.3)
    assert found.normals == pytest.approx(given.normals, abs=1e-15)


def _many_wrong(clean: int) -> tuple[Touches, Observation]:
    """Four directions nine times, of which the first touch is 8 µm inside and the last three 8 µm
    outside; between them others twice, `clean` touches in all."""
    n = fibonacci_cap(40, 1.5)
    between = np.concatenate([np.arange(4, 26), np.arange(4, 26)])[:clean]
    order = [*[0, 1, 2, 3] * 4, *between, *[0, 1, 2, 3] * 5]
    groups = np.array(order)
    rng = np.random.default_rng(1)
    error = 1e-4 * rng.standard_normal(len(groups))
    error[:4] -= 8.0 * UM
    error[-12:] += 8.0 * UM
    positions = n[groups] * (15.49 + error)[:, None]
    compact = np.unique(groups, return_inverse=True)[1]
    return Touches(positions, n[groups]), Observation(
        positions, compact, np.zeros(3), 12.5, 3.0, ring=False
    )


def test_beyond_a_fifth_wrong_touches_are_no_errors_but_a_movement() -> None:
    """16 of 80 are left out; 16 of 79 are more than a fifth: all are used, as without a search."""
    given, seen = _many_wrong(44)
    same, effects = without_machine(given, seen, UPRIGHT, np.eye(3))
    assert same is given
    assert np.all(effects.change == 0.0)
    given, seen = _many_wrong(43)
    changed, effects = without_machine(given, seen, UPRIGHT, np.eye(3))
    every = machine_effects(seen, given.positions)
    assert np.abs(every.change[[0, 1, 78]]).min() > UM
    assert effects.change == pytest.approx(every.change, abs=1e-12)
    off = seen.directions * every.change[:, None]
    assert changed.positions == pytest.approx(given.positions + off, abs=1e-12)
    silent = replace(UPRIGHT, search_outliers=False)
    given, seen = _many_wrong(44)
    effects = without_machine(given, seen, silent, np.eye(3))[1]
    assert effects.change == pytest.approx(machine_effects(seen, given.positions).change)


def test_the_step_is_that_of_the_latched_positions() -> None:
    """They come in steps of 1 µm; taken to rest by a travel that is not a multiple, they do not."""
    rng = np.random.default_rng(2)
    n = np.repeat(N, 3, axis=0)
    latched = np.round(n * (15.49 + 2e-4 * rng.standard_normal(75))[:, None], 3)
    resting = Touches(latched + n * (0.7071 + 1e-5 * np.arange(75))[:, None] * UM, n)
    seen = observe(resting, UPRIGHT)
    with_step = without_machine(resting, seen, UPRIGHT, np.eye(3), latched=latched)[1]
    assert with_step.step == pytest.approx(1e-3)
    assert without_machine(resting, seen, UPRIGHT, np.eye(3))[1].step == 0.0


@pytest.mark.parametrize(("clean", "out"), [(44, 16), (43, 0)])
def test_four_fifths_of_the_touches_remain_or_all(clean: int, out: int) -> None:
    """Errors that no movement explains: inside and outside by turns."""
    given, _ = _many_wrong(clean)
    rows = [*range(4), *range(len(given) - 12, len(given))]
    positions = given.normals * 15.49
    positions += 1e-4 * np.random.default_rng(5).standard_normal((len(given), 1)) * given.normals
    signs = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0] * 2)
    positions[rows] += (9.0 * UM * signs)[:, None] * given.normals[rows]
    found = prepare(replace(given, positions=positions), UPRIGHT)
    assert sorted(row for one in found.outliers for row in one.rows) == rows
    assert (~found.used).sum() == out
    assert [one.left_out for one in found.outliers] == [out > 0] * 16
    assert len(found.observation.values) == len(given) - out


# Signal delay


def _fed(delay: float, noise: float = 0.3 * UM) -> Touches:
    """At 50 and 150 mm/min with the same noise: the delay is as made. On a tilted probe."""
    feeds = np.tile(np.repeat([50.0, 150.0], 25), 2)
    errors = np.random.default_rng(3).standard_normal((2, 1, 25))
    errors = noise * np.tile(errors, (1, 2, 1)).ravel()
    n = np.tile(N, (4, 1))
    distance = 15.49 + errors - feeds / 60.0 * delay
    return Touches((n * distance[:, None]) @ TILT.T, n @ TILT.T, feeds=feeds)


def test_a_delay_may_be_three_u_below_zero() -> None:
    quick = replace(TILTED, search_outliers=False)
    first = prepare(_fed(0.0), quick).delay
    assert first is not None
    found = prepare(_fed(-2.8 * first.u_delay), quick)
    assert found.delay is not None
    assert found.delay.delay == pytest.approx(-2.8 * first.u_delay, rel=0.02)
    still = np.linalg.norm(_fed(0.0).positions, axis=1)
    assert np.linalg.norm(found.touches.positions, axis=1) == pytest.approx(still, abs=5e-6)
    with pytest.raises(PretravelError, match="cannot come before its trigger"):
        prepare(_fed(-3.2 * first.u_delay), quick)


@pytest.mark.parametrize(("noise", "told"), [(1.9, False), (3.3, True)])
def test_a_delay_that_moves_the_map_by_half_a_micrometre_is_not_separated(
    noise: float, told: bool
) -> None:
    """u is the noise over 8.33 mm/s; the map moves by 1.67 mm/s times that: limit 2.5 µm."""
    found = prepare(_fed(20e-3, noise * UM), replace(TILTED, search_outliers=False))
    assert (found.delay is None) == told
    assert any("not determine the signal delay" in words for words in found.warnings) == told


def test_feeds_within_a_hundredth_are_one_feed() -> None:
    def fed(*feeds: float) -> bool:
        n = np.eye(3)[: len(feeds)]
        return several_feeds(Touches(n, n, feeds=feeds))

    assert not fed(99.01, 100.0)
    assert fed(98.99, 100.0)
    assert not several_feeds(Touches(np.eye(3), np.eye(3)))


def test_delay_travel_is_that_along_the_normal() -> None:
    """60° and 0° off the normal, and away from it."""
    n = np.tile([[0.0, 0.0, 1.0]], (2, 1))
    oblique = np.array([[math.sqrt(0.75), 0.0, -0.5], [0.0, 0.0, -1.0]])
    found = travel_per_second(Touches(n, n, approaches=oblique, feeds=[120.0, 90.0]))
    assert found == pytest.approx([1.0, 1.5], rel=1e-12)


def test_residuals_of_few_touches_count_as_one_degree_of_freedom() -> None:
    """A map that leaves 1.4 degrees: one of them, of repeats 2, of the usual noise four."""
    feeds = np.array([60.0, 60.0, 120.0, 240.0])
    given = Touches(N[:4] * 15.5, N[:4], feeds=feeds)
    residuals = np.array([0.5, -0.3, 0.1, 0.9]) * UM
    fit: Any = SimpleNamespace(
        residuals=residuals,
        smoothing=SimpleNamespace(fitted=lambda f, _: np.full(4, f.mean())),
        observation=SimpleNamespace(groups=np.arange(4)),
        dof=1.4,
    )
    f = feeds / 60.0
    left = f - f.mean()
    delay = float(f @ residuals / (f @ left))
    found = signal_delay(given, fit, Scatter(0.2 * UM, 2.0))
    assert found.delay == pytest.approx(delay, rel=1e-9)
    squares = float(np.sum((residuals - left * delay) ** 2)) + 2.0 * (0.2 * UM) ** 2
    squares += 4.0 * (0.3 * UM) ** 2
    assert found.u_delay == pytest.approx(math.sqrt(squares / 7.0 / float(f @ left)), rel=1e-9)
    assert (found.slowest, found.fastest) == (60.0, 240.0)


# Directions that the others predict


class _Kind:
    """A kind of map that is given."""

    def __init__(self, fit: Any, centered: Any) -> None:
        self._fit, self._centered = fit, centered

    def fit(self, others: Observation, repeats: Scatter) -> Any:
        assert repeats.dof >= 0.0
        if self._fit is None:
            raise PretravelError("too few")
        assert len(others.groups)
        return self._fit

    def centered(self, fit: Any, axial: float | None) -> Any:
        assert fit is self._fit
        assert axial is None
        return self._centered


def _predicted() -> tuple[Any, Any, Observation, FloatArray]:
    """A fit about a centre of its own with a tip that it determined, and three touches."""
    rng = np.random.default_rng(6)
    basis = HarmonicBasis(np.array([[0, 0], [2, 0], [3, 3]]))
    root = rng.normal(0.0, UM, (3, 3))
    centered = SimpleNamespace(
        center=np.array([0.02, -0.01, 0.03]), coefficients=np.array([9.0, -2.0, 1.0]) * UM,
        covariance=Covariance.full(root @ root.T),
    )  # fmt: skip
    fit = SimpleNamespace(
        basis=basis, tip_radius=3.004, observation=SimpleNamespace(tip_radius=3.0),
        fixed_scatter=0.3 * UM, noise=0.5 * UM,
    )  # fmt: skip
    n = N[[8, 8, 8]] + 1e-4 * rng.normal(size=(3, 3))
    positions = n * np.array([15.47, 15.48, 15.472])[:, None]
    wrong = Observation(positions, np.zeros(3, dtype=int), np.zeros(3), 12.5, 3.0, ring=False)
    return fit, centered, wrong, positions


@pytest.mark.parametrize("tip", [3.004, None])
def test_the_distance_from_a_prediction_has_the_u_of_all_its_parts(tip: float | None) -> None:
    """About the centre of the others: map, scatter that repeats share, step, and noise over three
    touches. A tip that is larger by 4 µm makes the observed pretravel larger by that."""
    fit, centered, wrong, positions = _predicted()
    fit.tip_radius = tip
    found, u = _left_out_distance(
        _Kind(fit, centered),  # type: ignore[arg-type]
        fit, wrong, UM * math.hypot(0.7, 2.0 / math.sqrt(12.0)),
    )  # fmt: skip
    away = positions - centered.center
    distance = np.linalg.norm(away, axis=1)
    functions = fit.basis.design(away / distance[:, None])
    seen = 12.5 + (tip or 3.0) - distance - functions @ centered.coefficients
    assert found == pytest.approx(float(seen.mean()), rel=1e-9)
    variance = float(np.mean(np.diag(functions @ centered.covariance.matrix @ functions.T)))
    variance += UM**2 * (0.3**2 + 0.7**2 + 4.0 / 12.0 + 0.5**2 / 3.0)
    assert u == pytest.approx(math.sqrt(variance), rel=1e-9)


def _factor(directions: int) -> float:
    """One of a hundred sets by Bonferroni; 1.2 of an estimated scale, 1.4 of kinks."""
    return 1.4 * 1.2 * float(stats.norm.ppf(1.0 - 0.005 / directions))


def test_another_kind_confirms_by_its_own_limit() -> None:
    """Of the others and one direction more; a kind that cannot tell says nothing."""
    fit, centered, wrong, _ = _predicted()
    others = Observation(15.5 * N[:12], np.arange(12), np.zeros(3), 12.5, 3.0, ring=False)
    kind: Any = _Kind(fit, centered)
    distance, u = _left_out_distance(kind, fit, wrong, 0.0)
    found = _confirmed(kind, others, wrong, 0.0)
    assert found == pytest.approx(distance / (_factor(13) * u), rel=1e-9)
    silent: Any = _Kind(None, centered)
    assert _confirmed(silent, others, wrong, 0.0) is None
    fit.basis = SimpleNamespace(follows_probe=False)
    assert _confirmed(kind, others, wrong, 0.0) is None


def _seen(n: FloatArray, repeats: int = 3, seed: int = 1) -> tuple[Touches, Observation]:
    """A probe with one radius about the centre zero, noise of 0.3 µm."""
    normals = np.repeat(n, repeats, axis=0)
    rng = np.random.default_rng(seed)
    positions = normals * (15.49 + 0.3 * UM * rng.standard_normal(len(normals)))[:, None]
    groups = np.repeat(np.arange(len(n)), repeats)
    return Touches(positions, normals), Observation(
        positions, groups, np.zeros(3), 12.5, 3.0, ring=False
    )


def _off(pair: tuple[Touches, Observation], rows: Any, size: float) -> tuple[Touches, Observation]:
    touches, seen = pair
    positions = touches.positions.copy()
    positions[rows] -= size * touches.normals[rows]
    return replace(touches, positions=positions), replace(seen, positions=positions)


def _found(
    pair: tuple[Touches, Observation], named: list[int] | None = None, confirm: Any = None,
    fixed: float = 0.0,
) -> tuple[list[Outlier], Any]:  # fmt: skip
    return direction_outliers(pair[1], pair[0].where, named or [], confirm, fixed_scatter=fixed)


@pytest.mark.parametrize(("repeats", "sign"), [(1, -1.0), (3, 1.0)])
def test_a_direction_is_named_beyond_its_limit(repeats: int, sign: float) -> None:
    """The others do not depend on it: its distance grows as it moves, its limit does not. It is
    the prediction's u with the factors of noise and kinks."""
    pair = _seen(N, repeats)
    wrong = slice(10 * repeats, 11 * repeats)
    ((one,), detail) = _found(_off(pair, wrong, sign * 0.03))
    assert one.rows == tuple(range(10 * repeats, 11 * repeats))
    others = np.ones(25 * repeats, dtype=bool)
    others[wrong] = False
    alone = fit_harmonic(pair[1].take(others))
    moved = _off(pair, wrong, sign * 0.03)[1].take(~others)
    distance, u = _left_out_distance(HarmonicKind(), alone, moved, 0.0)
    assert one.distance == pytest.approx(distance, abs=0.05 * UM)
    assert one.limit == pytest.approx(_factor(25) * u, rel=0.02)
    assert len(detail.observation.values) == 24 * repeats
    first = 10 * repeats + 1
    names = f"touch {first}" + (f" to touch {first + 2} at" if repeats == 3 else " at")
    verb = "lie" if repeats == 3 else "lies"
    assert one.message == (
        f"{names} {describe(N[10])} {verb} {one.distance / UM:+.1f} µm from the prediction of the "
        f"other directions; noise and kinks explain {one.limit / UM:.1f} µm"
    )
    for factor, number in ((0.97, 0), (1.03, 1)):
        size = sign * 0.03 + sign * factor * one.limit - one.distance
        found, detail = _found(_off(pair, wrong, size))
        assert len(found) == number
        assert len(detail.observation.values) == (25 - number) * repeats
    # Scatter of the machine that is larger than the distance explains it.
    assert _found(_off(pair, wrong, 0.006), fixed=0.01)[0] == []


def test_three_directions_at_most_are_named_and_named_touches_do_not_count() -> None:
    pair = _seen(fibonacci_cap(60, 1.5))
    for row, size in ((12, -0.3), (24, 0.06), (36, -0.02), (48, 0.008)):
        pair = _off(pair, slice(3 * row, 3 * row + 3), size)
    found, detail = _found(pair)
    assert {one.rows[0] for one in found} == {36, 72, 108}
    assert len(detail.observation.values) == 180 - 9
    # Those of one direction are named already: the numbers of the others move by one.
    found, detail = _found(pair, named=[36, 37, 38])
    assert {one.rows[0] for one in found} == {72, 108, 144}
    assert len(detail.observation.values) == 180 - 12


@pytest.mark.parametrize(("directions", "named"), [(9, 1), (8, 0)])
def test_eight_other_directions_are_needed(directions: int, named: int) -> None:
    """The pole amid seven or eight directions around it."""
    azimuth = np.arange(directions - 1) * (2.0 * np.pi / (directions - 1))
    polar = np.where(np.arange(directions - 1) % 2, 1.5, 0.6)
    n = np.column_stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    )
    pair = _off(_seen(np.vstack([[[0.0, 0.0, 1.0]], n]), 5), slice(0, 5), 0.4)
    found, detail = _found(pair)
    assert len(found) == named
    assert len(detail.observation.values) == 5 * (directions - named)


def test_a_direction_outside_the_others_is_not_predicted() -> None:
    """A cap of 40° and one direction at 100°."""
    n = np.vstack([fibonacci_cap(30, 0.7), [[math.sin(1.745), 0.0, math.cos(1.745)]]])
    found, detail = _found(_off(_seen(n), slice(90, 93), 0.3))
    assert found == []
    assert len(detail.observation.values) == 93


@pytest.mark.parametrize("rests", [True, False])
def test_a_kind_that_explains_a_direction_keeps_it(rests: bool) -> None:
    """A second kind of map, with a harmonic fit of its own: one that has seen the wrong touches
    explains them, one of the others does not."""
    pair = _seen(N)
    wrong = np.zeros(75, dtype=bool)
    wrong[30:33] = True
    bad = _off(pair, slice(30, 33), 0.012)
    fit = fit_harmonic(pair[1])
    if rests:
        fit = replace(fit, coefficients=fit.coefficients, noise=0.01)
    kind: Any = _Kind(fit, HarmonicKind().centered(fit, None))
    kind.fits_harmonics = False
    found, detail = _found(bad, confirm=kind)
    assert len(found) == (0 if rests else 1)
    assert len(detail.observation.values) == (75 if rests else 72)
    kind.fits_harmonics = True  # which is no other kind
    assert len(_found(bad, confirm=kind)[0]) == 1
