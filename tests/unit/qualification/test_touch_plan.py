"""Plans of few touches: the problem as sums over places, choices by trying them all."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.probe_drift import DriftedMap, ProbeDrift, drifted_map
from pretravel.qualification.touch_plan import (
    _candidates,
    _exchanged,
    _greedy,
    _in_one_plane,
    _Problem,
    _refuse_count,
    _varied_order,
    plan_touches,
)
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map
from tests.support.reference_touches import sphere_touches

UM = 1e-3
TERMS = np.array([[0, 0], [1, 0], [1, 1], [1, -1], [2, 0], [3, 3], [3, -3]])


def _map(**changes: object) -> PretravelMap:
    """With a shift among its functions."""
    root = np.random.default_rng(3).normal(0.0, 0.4 * UM, (7, 7))
    made = PretravelMap(
        HarmonicBasis(TERMS), np.array([10.0, 0.3, 0.2, -0.4, -2.0, 1.5, 0.8]) * UM,
        Covariance.full(root @ root.T), DirectionSupport(sphere_pattern_25()), tip_radius=3.0,
        repeatability=0.3 * UM, fixed_scatter=0.4 * UM,
    )  # fmt: skip
    return replace(made, **changes)  # type: ignore[arg-type]


def _prior(ring: bool) -> DriftedMap:
    return drifted_map(_map(), ProbeDrift(), ring=ring)


def test_the_plan_promises_what_the_update_keeps() -> None:
    """Variances do not depend on the readings: u of the plan is that of the updated map."""
    for old in (_map(), example_map("physical")):
        still = ProbeDrift(change=0.0)  # a plan does not expect larger changes than the drift
        plan = plan_touches(old, 7, drift=still)
        touches = sphere_touches(old.pretravel(plan.normals), plan.normals)
        made = old.provenance.setup  # another reference would have an error of its own
        diameter = 25.0 if made is None else made.diameter
        new = update_map(touches, old, diameter, drift=still).pretravel_map
        np.testing.assert_allclose(plan.u_updated, new.over_support()[2], rtol=2e-3, atol=1e-7)
        u = np.sqrt(plan.prior.variance(plan.places, new.covariance.matrix))
        # The normals of touches and plan differ by 1e-4 rad; tiny u at the pole are rounding.
        np.testing.assert_allclose(u, plan.u_after, rtol=2e-3, atol=1e-7)
        assert np.all(plan.u_after <= plan.u_before + 1e-9)


def test_in_a_ring_all_touches_are_on_its_equator() -> None:
    """Also where the map holds over a part of it alone: its edge is touched, nothing beyond."""
    whole = plan_touches(example_map(), 6, ring=True)
    assert np.abs(whole.directions[:, 2]).max() < 1e-3
    assert whole.prior.axes == 2
    # The centre needs touches on all sides.
    assert np.linalg.norm(whole.directions.mean(axis=0)) < 0.5
    assert np.all(whole.u_after <= whole.u_before + 1e-12)
    azimuth = np.arange(-80.0, 81.0, 20.0) * DEGREE
    nodes = np.concatenate([from_angles(polar * DEGREE, azimuth) for polar in (30.0, 60.0, 90.0)])
    half = replace(example_map(), support=DirectionSupport(nodes), touched=None)
    touched = plan_touches(half, 5, ring=True).directions
    assert np.abs(np.degrees(np.arctan2(touched[:, 1], touched[:, 0]))).max() < 80.1
    assert np.abs(touched[:, 2]).max() < 1e-3


def test_a_plan_states_u_before_and_after_and_of_the_old_map() -> None:
    """By sums over the coefficients: the map without the shift that it contains."""
    tilt = probe_rotation((0.48, 0.6, 0.64), rotation=0.7)
    old = _map(rotation=tilt)
    walls = from_angles(np.full(7, 80.0 * DEGREE), np.linspace(-0.5, 0.5, 7))
    plan = plan_touches(old, 6, normals=walls @ tilt.T)
    assert plan.places == pytest.approx(walls)
    assert plan.normals == pytest.approx(plan.directions @ tilt.T)
    prior = drifted_map(old)
    assert plan.prior.drift == ProbeDrift()
    functions = HarmonicBasis(TERMS).design(walls) @ prior.without_shift
    for u, covariance in ((plan.u_before, prior.covariance), (plan.u_old, old.covariance.matrix)):
        assert u == pytest.approx(np.sqrt(np.diag(functions @ covariance @ functions.T)), rel=1e-9)
    problem = _Problem.of(prior, plan.directions, walls)
    after = problem.covariance_after(np.arange(6))[:7, :7]
    assert plan.u_after == pytest.approx(np.sqrt(np.diag(functions @ after @ functions.T)))


def test_touches_are_planned_at_the_edge_of_a_map_and_not_beyond_it() -> None:
    """A cap down to 60°; in a ring the horizontal directions alone, 3° apart."""
    nodes = from_angles(np.repeat([0.0, 30.0, 60.0], 24) * DEGREE, np.arange(72) * 15.0 * DEGREE)
    capped = _map(support=DirectionSupport(nodes))
    polar = np.degrees(np.arccos(np.clip(_candidates(capped, False)[:, 2], -1.0, 1.0)))
    assert 59.9 < polar.max() < 60.001
    assert len(_candidates(capped, True)) == 0
    ring = _candidates(_map(), True)
    assert np.abs(ring[:, 2]).max() < 1e-3
    azimuth = np.degrees(np.arctan2(ring[-120:, 1], ring[-120:, 0])) % 360.0
    assert azimuth == pytest.approx(np.arange(120) * 3.0, abs=1e-9)


@pytest.mark.parametrize(("axes", "fewest"), [(3, 5), (2, 4)])
def test_counts_are_refused_from_both_sides(axes: int, fewest: int) -> None:
    _refuse_count(fewest, axes, 400)
    _refuse_count(10, axes, 20)
    with pytest.raises(PretravelError, match=f"alone takes {axes}; plan at least {fewest}"):
        _refuse_count(fewest - 1, axes, 400)
    with pytest.raises(PretravelError, match=r"11 touches are more .* plan at most 10, or"):
        _refuse_count(11, axes, 21)


# The problem, and choices in it.


@pytest.mark.parametrize("ring", [False, True])
def test_the_aim_is_the_mean_variance_of_the_map_and_a_hundredth_of_the_centre_s(
    ring: bool,
) -> None:
    """Of coefficients and a centre drawn at random: what is left of the map without its shift, in
    the mean of squares over the places; the centre less the shift that it takes from the map."""
    prior, candidates = _prior(ring), fibonacci_cap(30, 1.5)
    places = fibonacci_cap(17, 1.4)
    problem = _Problem.of(prior, candidates, places)
    axes = 2 if ring else 3
    basis = HarmonicBasis(TERMS)
    rng = np.random.default_rng(1)
    for _ in range(3):
        coefficients, centre = rng.normal(size=7), rng.normal(size=axes)
        unknown = np.concatenate([coefficients, centre])
        seen = basis.design(candidates) @ coefficients - candidates[:, :axes] @ centre
        assert problem.rows @ unknown == pytest.approx(seen, abs=1e-12)
        shift = prior.shift_of @ coefficients
        left = basis.design(places) @ (coefficients - prior.shift @ shift)
        aim = float(np.mean(left**2)) + 0.01 * float(np.sum((centre - shift) ** 2))
        assert unknown @ problem.aim @ unknown == pytest.approx(aim, rel=1e-9)
    assert np.abs(prior.shift_of).max() > 0.1
    assert problem.covariance[:7, :7] == pytest.approx(prior.covariance)
    assert problem.covariance[7:, 7:] == pytest.approx(np.eye(axes))
    assert np.all(problem.covariance[:7, 7:] == 0.0)
    assert np.all(problem.covariance[7:, :7] == 0.0)
    assert problem.noise == pytest.approx((0.5 * UM) ** 2, rel=1e-12)
    still = drifted_map(_map(repeatability=1e-9, fixed_scatter=0.0))
    assert _Problem.of(still, candidates, places).noise == 1e-12


@pytest.mark.parametrize("ring", [False, True])
def test_gains_are_what_touches_take_from_the_aim(ring: bool) -> None:
    """Updates one at a time, all at once, and by adding information are the same."""
    problem = _Problem.of(_prior(ring), fibonacci_cap(30, 1.5), fibonacci_cap(17, 1.4))
    start = problem.covariance
    gains = problem.gains(start)
    for candidate in (0, 5, 11):
        after = problem.touched(start, candidate)
        taken = problem.value(start) - problem.value(after)
        assert gains[candidate] == pytest.approx(taken, rel=1e-6)
        assert after == pytest.approx(problem.covariance_after(np.array([candidate])), abs=1e-12)
    both = problem.touched(problem.touched(start, 3), 8)
    assert both == pytest.approx(problem.covariance_after(np.array([8, 3])), abs=1e-10)
    rows = problem.rows[[8, 3]]
    regular = start + 1e-6 * np.eye(len(start))
    stated = replace(problem, covariance=regular).covariance_after(np.array([8, 3]))
    information = np.linalg.inv(regular) + rows.T @ rows / problem.noise
    assert stated == pytest.approx(np.linalg.inv(information), abs=1e-6)


def test_no_direction_is_chosen_twice() -> None:
    """Of five values that are read one by one with a large noise, the least known would be read
    again and again: each is read once, the least known first."""
    variances = np.array([0.3, 9.0, 0.1, 0.2, 4.0])
    problem = _Problem(fibonacci_cap(5, 1.5), np.eye(5), np.diag(variances), np.eye(5), 100.0)
    gains = variances**2 / (variances + 100.0)
    assert problem.gains(problem.covariance) == pytest.approx(gains, rel=1e-12)
    assert _greedy(problem, 3).tolist() == [1, 4, 0]
    assert sorted(_exchanged(problem, np.array([2, 1, 3])).tolist()) == [0, 1, 4]


def test_of_equal_directions_the_first_is_chosen() -> None:
    """Equal but for rounding, which is another one on another processor."""
    candidates, variances = fibonacci_cap(5, 1.5), np.array([1.0, 3.0, 2.0, 3.0, 3.0])
    for later in (1.0 - 1e-13, 1.0 + 1e-13):
        prior = np.diag(variances * np.array([1.0, 1.0, 1.0, later, later]))
        problem = _Problem(candidates, np.eye(5), prior, np.eye(5), 0.1)
        assert _greedy(problem, 4).tolist() == [1, 3, 4, 2]
        assert _exchanged(problem, np.array([0])).tolist() == [1]


def test_a_plan_cannot_be_made_better_by_any_single_exchange() -> None:
    """All exchanges of one direction that do not put everything into a plane are tried."""
    problem = _Problem.of(_prior(False), fibonacci_cap(24, 1.5), fibonacci_cap(17, 1.4))
    chosen = _exchanged(problem, np.arange(6))
    best = problem.value(problem.covariance_after(chosen))
    assert best < 0.99 * problem.value(problem.covariance_after(np.arange(6)))
    for position in range(6):
        others = np.delete(chosen, position)
        planar = _in_one_plane(problem.candidates, others)
        for candidate in set(range(24)) - set(chosen.tolist()):
            if not planar[candidate]:
                tried = np.append(others, candidate)
                assert problem.value(problem.covariance_after(tried)) > best * (1.0 - 1e-6)
    assert sorted(_exchanged(problem, chosen).tolist()) == sorted(chosen.tolist())
    greedy = _greedy(problem, 6)
    assert best <= 1.2 * problem.value(problem.covariance_after(greedy))


def test_an_exchange_leaves_no_plan_in_one_plane() -> None:
    """Five directions of one circle and the pole, which is known best: the others are exchanged for
    the least known ones, and the pole stays."""
    ring = from_angles(np.full(5, 1.0), 2.0 * np.pi / 5.0 * np.arange(5.0))
    candidates = np.vstack([ring, [[0.0, 0.0, 1.0]]])
    covariance = np.diag([5.0, 3.0, 2.0, 6.0, 9.0, 1.0])
    problem = _Problem(candidates, np.eye(6), covariance, np.eye(6), 0.1)
    assert sorted(_exchanged(problem, np.array([0, 1, 2, 5])).tolist()) == [0, 3, 4, 5]


def test_directions_within_a_twentieth_of_their_extent_are_in_one_plane() -> None:
    """Four of a square with the side of 1, two opposite corners higher by h and two lower: their
    singular values are 1, 1 and 2 h. Another lies in their plane within 0.15 of it."""
    square = 0.5 * np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    for h, planar in ((0.0249, True), (0.0251, False)):
        high = 0.7 + h * np.array([1.0, -1.0, 1.0, -1.0])
        others = np.column_stack([square, high])
        candidates = np.vstack([others, [[0.2, 0.1, 0.849], [0.2, 0.1, 0.851], [0.2, 0.1, 0.549]]])
        found = _in_one_plane(candidates, np.arange(4))
        assert found.tolist() == [planar] * 5 + [False] + [False]
    flat = np.column_stack([square, np.full(4, 0.0099)])
    assert not _in_one_plane(flat, np.arange(3)).any()
    flat[:, 2] = 0.0101
    assert _in_one_plane(flat, np.arange(3)).all()


@pytest.mark.parametrize("count", [4, 5, 6])
def test_the_order_has_the_most_even_turns_of_all_orders(count: int) -> None:
    """The sum over the first three harmonics of the mean phase of the turns, squared; 4000 orders
    are all of up to six directions."""
    azimuth = np.array([0.1, 0.9, 2.0, 2.8, 4.0, 5.5])[:count]
    directions = from_angles(np.linspace(0.3, 1.5, count), azimuth)
    order = _varied_order(directions)
    assert sorted(order.tolist()) == list(range(count))

    def uneven(one: tuple[int, ...]) -> float:
        turns = [azimuth[b] - azimuth[a] for a, b in pairwise(one)]
        phases = [sum(np.exp(1j * k * t) for t in turns) / len(turns) for k in (1, 2, 3)]
        return float(sum(abs(phase) ** 2 for phase in phases))

    least = min(uneven(one) for one in permutations(range(count)))
    assert uneven(tuple(order.tolist())) == pytest.approx(least, abs=1e-9)
