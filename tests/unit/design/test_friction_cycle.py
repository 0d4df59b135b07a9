"""One short run of two cycles with friction: every field of its result, from the others."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.errors import ConvergenceError, PretravelError
from pretravel.design.fem.interface_loads import TANGENTIAL
from pretravel.design.friction import seat_friction as friction_module
from pretravel.design.friction.friction_equilibrium import equilibrium, seat_mechanism
from pretravel.design.friction.seat_friction import (
    FrictionCycle,
    _frictionless_deflection,
    _History,
    _located,
    check_conditions,
    friction_cycle,
)
from pretravel.prediction.beam import stylus_compliance
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.seats import seat_statics
from pretravel.prediction.trigger import predict

DIRECTIONS = np.array([[0.8, 0.36, 0.48], [-0.28, 0.96, 0.0], [0.48, -0.64, 0.6]])
THRESHOLD = 0.05
STEPS = 12
OVERTRAVEL = 0.004


@pytest.fixture(scope="module")
def probe() -> Probe:
    return replace(load_probe("omp40-2"), threshold=THRESHOLD)


@pytest.fixture(scope="module")
def cycle(probe: Probe) -> FrictionCycle:
    return friction_cycle(probe, DIRECTIONS, 0.12, cycles=2, steps=STEPS, overtravel=OVERTRAVEL)


def rows_of(cycle: FrictionCycle, number: int, *, loading: bool) -> np.ndarray:
    """Steps of one way of one cycle, with the state in which it begins."""
    rows = np.flatnonzero((cycle.cycle == number) & (cycle.loading == loading))
    return rows if rows[0] == 0 else np.concatenate([[rows[0] - 1], rows])


def base(probe: Probe, directions: np.ndarray = DIRECTIONS) -> np.ndarray:
    """Deflection at the frictionless trigger, from which the overtravel counts."""
    statics = seat_statics(probe)
    mechanism = seat_mechanism(probe, statics, directions, 0.0, "analytic")
    return _frictionless_deflection(mechanism, statics, probe.threshold)


def test_without_friction_the_first_seat_opens_at_the_stated_deflection(probe: Probe) -> None:
    """Newton's method on all laws of the seats comes to the trigger of statics there: for a body of
    any flexibility, and a circuit that opens before the seat does."""
    statics = seat_statics(probe)
    root = np.random.default_rng(6).normal(size=(22, 22))
    root[TANGENTIAL] = 0.0
    mechanism = replace(
        seat_mechanism(probe, statics, DIRECTIONS, 0.0, "analytic"),
        flexibility=2e-6 * root @ root.T,
    )
    deflection = _frictionless_deflection(mechanism, statics, THRESHOLD)
    state = equilibrium(mechanism, mechanism.at_rest, deflection)
    trigger = predict(probe, DIRECTIONS, "shen")
    assert state.force == pytest.approx(trigger.force, rel=1e-7)
    assert state.normal == pytest.approx(trigger.reactions, abs=1e-7)
    with pytest.raises(PretravelError, match="never triggers"):
        base(probe, np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]))


def test_deflections_rise_and_fall_in_equal_steps(probe: Probe, cycle: FrictionCycle) -> None:
    """From where the tip is to the overtravel beyond the frictionless trigger, and back until the
    force has vanished."""
    reach = base(probe) + OVERTRAVEL
    along = np.einsum("nti,ni->nt", cycle.displacement, DIRECTIONS)
    assert cycle.deflection == pytest.approx(along, abs=1e-14)
    assert cycle.displacement[:, 0] == pytest.approx(np.zeros((3, 3)), abs=0)
    for number in (0, 1):
        up, down = (rows_of(cycle, number, loading=way) for way in (True, False))
        assert len(up) == STEPS + 1
        for row in range(3):
            start = cycle.deflection[row, up[0]]
            expected = np.linspace(start, reach[row], STEPS + 1)
            assert cycle.deflection[row, up] == pytest.approx(expected, abs=1e-13)
            step = (reach[row] - start) / STEPS
            moving = np.flatnonzero(cycle.force[row, down] > 1e-5)
            assert len(moving) >= STEPS - 4
            falls = reach[row] - step * np.arange(len(moving))
            assert cycle.deflection[row, down[moving]] == pytest.approx(falls, abs=1e-13)
            # Within the next step the force vanishes, and then the tip rests.
            rest = cycle.deflection[row, down[len(moving)]]
            assert falls[-1] - step <= rest < falls[-1]
            assert cycle.deflection[row, down[-1]] == rest
            assert abs(cycle.force[row, down[-1]]) < 1e-6
        last = cycle.displacement[:, down[-1]]
        assert cycle.rest_displacement[:, number] == pytest.approx(last, abs=0)
    assert np.all(np.diff(cycle.cycle) >= 0)
    assert cycle.loading[0]


def test_a_seat_opens_and_closes_at_the_threshold(probe: Probe, cycle: FrictionCycle) -> None:
    """Its load there is the circuit's, and the state is on the way between two steps."""
    assert cycle.trigger_reactions.min(axis=2) == pytest.approx(
        np.full((3, 2), THRESHOLD), abs=1e-6
    )
    lowest = cycle.reactions.min(axis=2) - THRESHOLD
    for number in (0, 1):
        for loading, force, deflection in (
            (True, cycle.trigger_force, cycle.trigger_deflection),
            (False, cycle.reseat_force, cycle.reseat_deflection),
        ):
            rows = rows_of(cycle, number, loading=loading)
            for row in range(3):
                signs = np.sign(lowest[row, rows])
                crossed = np.flatnonzero(np.diff(signs) != 0)
                at = rows[crossed[0] if loading else crossed[-1]]
                for values, found in ((cycle.deflection, deflection), (cycle.force, force)):
                    ends = sorted(values[row, [at, at + 1]])
                    assert ends[0] <= found[row, number] <= ends[1]
    # The stylus bends as a beam under the force at the trigger; the rest is the tripod's motion.
    bent = cycle.trigger_force[..., None] * DIRECTIONS[:, None] * stylus_compliance(probe.stylus)
    tripod = cycle.trigger_displacement - bent
    assert cycle.tripod_displacement == pytest.approx(tripod, abs=1e-13)


def test_what_a_cycle_is_judged_by(cycle: FrictionCycle) -> None:
    """Components along each normal, and the distance between one rest and the next."""
    for row, d in enumerate(DIRECTIONS):
        at_rest = np.zeros(3)
        for number in (0, 1):
            opens = cycle.trigger_displacement[row, number] @ d
            closes = cycle.reseat_displacement[row, number] @ d
            rest = cycle.rest_displacement[row, number]
            assert cycle.trigger_deflection[row, number] == pytest.approx(opens, abs=1e-15)
            assert cycle.reseat_deflection[row, number] == pytest.approx(closes, abs=1e-15)
            assert cycle.hysteresis[row, number] == pytest.approx(opens - closes, abs=1e-15)
            assert cycle.zero_drift[row, number] == pytest.approx(rest @ d, abs=1e-15)
            moved = math.dist(rest, at_rest)
            assert cycle.reseat_error[row, number] == pytest.approx(moved, rel=1e-9)
            at_rest = rest
    assert cycle.friction == 0.12
    assert cycle.directions == pytest.approx(DIRECTIONS, abs=1e-15)


@pytest.mark.parametrize("scale", [1.0, 60.0])
def test_the_usual_overtravel(probe: Probe, scale: float) -> None:
    """10 um, or twice the deflection at the trigger where that is more: a soft stylus."""
    stylus = tuple(replace(part, length=part.length * scale**0.25) for part in probe.stylus)
    soft, d = replace(probe, stylus=stylus), DIRECTIONS[:1]
    trigger = base(soft, d)[0]
    assert (trigger > 0.005) == (scale > 1.0)
    found = friction_cycle(soft, d, 0.1, steps=5)
    assert found.trigger_force.shape == (1, 1)  # one cycle where no number is stated
    assert found.deflection[0, 5] == pytest.approx(trigger + max(0.01, 2.0 * trigger), rel=1e-9)


def test_limits_of_friction(probe: Probe) -> None:
    """0.5 at most, and 0.95 of the tangent of the support angle, beyond which rods jam."""
    for degrees, largest in ((20.0, 0.95 * math.tan(math.radians(20.0))), (40.0, 0.5)):
        some = replace(probe, seats=replace(probe.seats, support_angle=math.radians(degrees)))
        check_conditions(some, largest, None, 1, 5)
        for friction in (largest * (1.0 + 1e-9), -1e-9):
            with pytest.raises(PretravelError, match=f"between 0 and {largest:.3g}|friction"):
                check_conditions(some, friction, None, 1, 5)
    check_conditions(probe, 0.1, None, 1, 500_000)
    with pytest.raises(PretravelError, match=r"1 direction are"):
        check_conditions(probe, 0.1, None, 1, 500_001)
    with pytest.raises(PretravelError, match="2 directions are"):
        check_conditions(probe, 0.1, None, 1, 250_001, 2)


def test_a_cycle_in_which_no_seat_opens_is_refused(probe: Probe) -> None:
    """Friction opens seats later than the overtravel reaches: the first such direction is named."""
    with pytest.raises(PretravelError, match=r"friction 0\.4 holds the rods: in 3 of 3") as refused:
        friction_cycle(probe, DIRECTIONS, 0.4, steps=5, overtravel=1e-6)
    assert "azimuth 24.2°" in str(refused.value)


def test_a_force_that_does_not_vanish_is_refused(
    probe: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After twice the steps of the return, in the directions in which it does not."""
    real, asked = equilibrium, list[int]()

    def stuck(mechanism, before, target, *rest):  # type: ignore[no-untyped-def]
        asked.append(len(target))
        state = real(mechanism, before, target, *rest)
        held = mechanism.directions[:, 0] < 0.0
        return replace(state, force=np.where(held, np.maximum(state.force, 1e-3), state.force))

    monkeypatch.setattr(friction_module, "equilibrium", stuck)
    monkeypatch.setattr(friction_module, "_located", lambda mechanism, before, *_: before)
    with pytest.raises(ConvergenceError, match="on the return in 1 of 3 directions"):
        friction_cycle(probe, DIRECTIONS, 0.1, steps=5)
    assert len(asked) == 5 + 10
    assert asked[:5] == [3] * 5
    assert asked[-1] == 1  # those at rest have left


def test_the_first_opening_and_the_last_closing_count(
    probe: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a seat that opens, closes and opens again on the same way."""
    mechanism = seat_mechanism(probe, seat_statics(probe), DIRECTIONS[:1], 0.1, "rigid")
    monkeypatch.setattr(friction_module, "_located", lambda mechanism, before, *_: before)
    history = _History(mechanism, 1, THRESHOLD)
    closed = mechanism.at_rest
    moved = np.zeros((1, 22))
    moved[0, 2] = mechanism.rest_depth[2]  # this seat is lifted from its ball
    for loading in (True, False):
        for number, lifted in enumerate([moved, 0.0 * moved, moved, 0.0 * moved]):
            force = np.array([10.0 * loading + number])
            state = replace(closed, moved=lifted, force=force)
            history.step(state, loading=loading, cycle=0)
    # The state before each step is the one that is kept here.
    assert history.triggers.force.tolist() == [[0.0]]
    assert history.reseats.force.tolist() == [[2.0]]


def test_without_a_change_of_sign_the_end_of_the_step_is_kept(probe: Probe) -> None:
    mechanism = seat_mechanism(probe, seat_statics(probe), DIRECTIONS, 0.1, "rigid")
    end = np.array([1e-4, 2e-4, 3e-4])
    kept = _located(mechanism, mechanism.at_rest, end, lambda m, _: np.ones(len(m.directions)))
    assert mechanism.deflection(kept) == pytest.approx(end, rel=1e-9)
    halfway = _located(
        mechanism, mechanism.at_rest, end, lambda m, s: m.deflection(s) - 0.3 * end.min()
    )
    assert mechanism.deflection(halfway) == pytest.approx(np.full(3, 3e-5), rel=1e-5)
