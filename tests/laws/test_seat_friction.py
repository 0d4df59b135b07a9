"""Friction at the seats: the laws of Coulomb and of thermodynamics."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.interface_loads import TANGENTIAL
from pretravel.design.friction.predict_with_friction import rubbed_trigger
from pretravel.design.friction.seat_friction import FrictionCycle, check_conditions, friction_cycle
from pretravel.prediction.beam import stylus_compliance
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance.base import compliance_model
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import default_workpiece
from pretravel.prediction.response import probe_response
from pretravel.prediction.seats import seat_frame, seat_statics
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.six_seats.hertz import rod_on_ball_coefficient
from tests.support.coarse_models import coarse_reduced_sixth

pytestmark = pytest.mark.long  # meshes of whole probes

DIRECTIONS = from_angles(
    np.radians([90.0, 90.0, 90.0, 50.0, 25.0]), np.radians([0.0, 20.0, 60.0, 100.0, 213.0])
)


@cache
def rubbed(friction: float, cycles: int = 2, steps: int = 25) -> FrictionCycle:
    """A rigid tripod on Hertz seats: elasticity of the body does not affect these laws."""
    return friction_cycle(
        load_probe("omp40-2"), DIRECTIONS, friction, body="rigid", cycles=cycles, steps=steps
    )


def test_without_friction_it_is_statics(omp40: Probe) -> None:
    cycle = rubbed(0.0)
    force = predict(omp40, DIRECTIONS, "shen").force
    assert cycle.trigger_force == pytest.approx(np.repeat(force[:, None], 2, axis=1), rel=1e-6)
    assert np.abs(cycle.hysteresis).max() < 1e-8
    assert np.abs(cycle.zero_drift).max() < 1e-8
    assert np.abs(cycle.tangential).max() < 1e-12


def test_without_friction_the_deflection_is_that_of_the_seats(omp40: Probe) -> None:
    """The rigid tripod on Hertz seats is the model `analytic` with a rigid stylus."""
    trigger = predict(omp40, DIRECTIONS, "analytic")
    seats = np.sum(trigger.displacements["seats"] * DIRECTIONS, axis=1)
    assert rubbed(0.0).trigger_deflection[:, 0] == pytest.approx(seats, rel=1e-6)


def test_without_friction_seats_close_where_they_open(omp40: Probe) -> None:
    """At the threshold of the circuit, which statics gives with an equation of its own."""
    early, few = replace(omp40, threshold=0.1), DIRECTIONS[[1, 3]]
    cycle = friction_cycle(early, few, 0.0, body="rigid", steps=10)
    force = predict(early, few, "shen").force
    assert np.all(force < 0.98 * predict(omp40, few, "shen").force)
    assert cycle.trigger_force[:, 0] == pytest.approx(force, rel=1e-6)
    assert cycle.reseat_force[:, 0] == pytest.approx(force, rel=1e-6)
    assert cycle.trigger_reactions.min(axis=2)[:, 0] == pytest.approx(0.1, rel=1e-6)


def test_the_tip_is_pushed_as_far_as_stated_and_left_without_force() -> None:
    """10 um or twice the trigger's deflection beyond it; at rest the force has vanished."""
    plain = rubbed(0.0)
    base = plain.trigger_deflection[:, 0]
    reach = base + np.maximum(0.01, 2.0 * base)
    assert plain.deflection.max(axis=1) == pytest.approx(reach, rel=1e-6)
    cycle = rubbed(0.15)
    for number in (0, 1):
        last = np.flatnonzero(cycle.cycle == number)[-1]
        assert cycle.rest_displacement[:, number] == pytest.approx(cycle.displacement[:, last])
        # A bisection of one step, 1/25 of some newtons, in 24 halves.
        assert np.abs(cycle.force[:, last]).max() < 1e-6


@pytest.mark.parametrize("friction", [0.05, 0.15])
def test_coulombs_cone(friction: float) -> None:
    cycle = rubbed(friction)
    size = np.linalg.norm(cycle.tangential, axis=3)
    assert np.all(size <= friction * np.maximum(cycle.reactions, 0.0) + 1e-7)
    assert np.any(size > 0.99 * friction * cycle.reactions + 1e-3)  # and some seats slide


@pytest.mark.parametrize("friction", [0.05, 0.15])
def test_a_cycle_costs_work(friction: float) -> None:
    """After it has settled, the cycle of force over deflection has the right sense of rotation."""
    cycle = rubbed(friction)
    last = np.flatnonzero(cycle.cycle == 1)
    rows = np.concatenate([[last[0] - 1], last])
    work = np.trapezoid(cycle.force[:, rows], cycle.deflection[:, rows], axis=1)
    assert np.all(work > 0.0)


def test_equilibrium_at_every_step(omp40: Probe) -> None:
    """Forces and moments of seats, friction, spring and tip, computed independently."""
    cycle, frame = rubbed(0.15), seat_frame(omp40)
    contacts = frame.contacts(omp40.tripod.rod_radius)
    seat = cycle.reactions[..., None] * frame.normals
    rub = cycle.tangential[..., :1] * frame.along + cycle.tangential[..., 1:] * frame.around
    tip = cycle.force[..., None] * cycle.directions[:, None]
    total = (seat + rub).sum(axis=2) + tip + np.array([0.0, 0.0, -omp40.preload])
    moment = np.cross(contacts, seat + rub).sum(axis=2)
    moment += np.cross(np.array([0.0, 0.0, -omp40.lever]), tip)
    assert np.abs(total).max() < 1e-7
    assert np.abs(moment).max() < 1e-6


def test_friction_delays_the_trigger_on_average() -> None:
    """Friction increases the force that opens a seat, the more the larger it is."""
    forces = [rubbed(friction).trigger_force[:, 0] for friction in (0.0, 0.05, 0.15)]
    assert np.all(forces[1] >= forces[0] * (1.0 - 1e-6))
    assert np.mean(forces[2]) > np.mean(forces[1]) > np.mean(forces[0])


def test_the_zero_drifts_at_first_and_then_settles() -> None:
    """Ren's drift of the zero position: the first touch moves the rest, the next hardly do."""
    cycle = rubbed(0.15, cycles=3, steps=20)
    assert np.all(cycle.reseat_error[:, 0] > 5.0 * cycle.reseat_error[:, 2])
    assert np.all(cycle.zero_drift[:, 0] > 0.0)


def test_with_an_elastic_body_it_is_the_condensed_model(omp40: Probe) -> None:
    """Without friction, up to the trigger: the deflection along the normal is that of `fem`."""
    reduced = coarse_reduced_sixth()
    cycle = friction_cycle(omp40, DIRECTIONS, 0.0, body=reduced, steps=10)
    trigger = predict(omp40, DIRECTIONS, FiniteElements(reduced))
    along = np.sum(trigger.deflection * DIRECTIONS, axis=1)
    assert cycle.trigger_deflection[:, 0] == pytest.approx(along, rel=1e-6)
    assert np.abs(cycle.zero_drift).max() < 1e-8


def test_small_loads_meet_mindlins_stiffness(omp40: Probe) -> None:
    """Before sliding: linear springs at six seats, with a tangential stiffness of 2 (1 - nu) /
    (2 - nu) of the normal one, assembled here by hand. At some hundredths of the trigger's
    deflection, Hertz deviates from linear by less than 2 %."""
    frame = seat_frame(omp40)
    metal = omp40.tripod.material
    c = rod_on_ball_coefficient(2.75, 3.5, metal.contact_modulus(metal))
    normal = 1.5 * seat_statics(omp40).rest_reactions ** (1.0 / 3.0) / c
    nu = omp40.tripod.material.poissons_ratio
    tangential = normal * 2.0 * (1.0 - nu) / (2.0 - nu)
    stiffness = np.zeros((6, 6))
    for seat in range(6):
        contact = frame.contacts(omp40.tripod.rod_radius)[seat]
        for way, spring in (
            (frame.normals[seat], normal[seat]),
            (frame.along[seat], tangential[seat]),
            (frame.around[seat], tangential[seat]),
        ):
            wrench = np.concatenate([way, np.cross(contact, way)])
            stiffness += spring * np.outer(wrench, wrench)
    tip = np.array([0.0, 0.0, -omp40.lever])
    few = DIRECTIONS[[1, 3]]
    cycle = friction_cycle(omp40, few, 0.4, body="rigid", steps=100, overtravel=2e-3)
    for row, d in enumerate(few):
        push = np.concatenate([d, np.cross(tip, d)])
        compliance = push @ np.linalg.solve(stiffness, push)
        assert cycle.deflection[row, 1] / cycle.force[row, 1] == pytest.approx(compliance, rel=0.02)


def test_directions_do_not_know_of_each_other() -> None:
    together = rubbed(0.15)
    for row in (1, 3):
        alone = friction_cycle(
            load_probe("omp40-2"), DIRECTIONS[row : row + 1], 0.15, body="rigid", cycles=2, steps=25
        )
        assert together.zero_drift[row] == pytest.approx(alone.zero_drift[0], rel=1e-6)
        assert together.hysteresis[row] == pytest.approx(alone.hysteresis[0], rel=1e-6)


def test_on_the_way_back_seats_close_later() -> None:
    """Settled cycles, azimuth 20° and 60°: a seat opens at a larger deflection than it closes at.
    (At 0°, where two seats open at once, a rigid tripod may close them earlier.)"""
    cycle = friction_cycle(
        load_probe("omp40-2"), DIRECTIONS[1:3], 0.1, body="rigid", cycles=2, steps=60
    )
    assert np.all(cycle.hysteresis[:, 1] > 0.0)
    # Azimuth 60° by hand, from the steps with all seats closed: by Hertz the indentation is the
    # power 2/3 of the reaction, and it vanishes nearly linearly. A line through two steps, 0.19 µm
    # apart, is extended by at most one step; 5 nm is 1/40 of it, and of the hysteresis.
    row, last = 1, cycle.cycle == 1
    lowest, deflection = cycle.reactions[row].min(axis=1), cycle.deflection[row]
    opened = np.flatnonzero(last & cycle.loading & (lowest <= 1e-9))[0]
    closed = np.flatnonzero(last & ~cycle.loading & (lowest > 1e-9))[0]

    def vanishes(near: int, far: int) -> float:
        ends = np.cbrt(lowest[[near, far]] ** 2)
        slope = (deflection[far] - deflection[near]) / (ends[1] - ends[0])
        return float(deflection[near] - slope * ends[0])

    opens, closes = vanishes(opened - 1, opened - 2), vanishes(closed, closed + 1)
    assert cycle.trigger_deflection[row, 1] == pytest.approx(opens, abs=5e-6)
    assert cycle.reseat_deflection[row, 1] == pytest.approx(closes, abs=5e-6)
    assert cycle.hysteresis[row, 1] == pytest.approx(opens - closes, abs=5e-6)


def test_friction_forces_act_where_the_mesh_has_them(omp40: Probe) -> None:
    """Tangential wrenches of the mechanism, by hand, against those of the mesh's patches: the
    centre of a patch lies a little inside the rod, so moments differ by its depth, 0.01 mm."""
    frame = seat_frame(omp40)
    meshed = coarse_reduced_sixth().resultants[:, TANGENTIAL]
    for seat in range(6):
        contact = frame.contacts(omp40.tripod.rod_radius)[seat]
        for place, way in enumerate((frame.along[seat], frame.around[seat])):
            by_hand = np.concatenate([way, np.cross(contact, way)])
            assert meshed[:, 2 * seat + place] == pytest.approx(by_hand, abs=0.01)


def test_the_criterion_that_is_not_followed_is_refused(omp40: Probe) -> None:
    with pytest.raises(PretravelError, match="arm_lift"):
        friction_cycle(replace(omp40, criterion="arm_lift"), DIRECTIONS, 0.1)


def test_seats_that_would_jam_are_refused(omp40: Probe) -> None:
    steep = replace(omp40, seats=replace(omp40.seats, support_angle=0.2))
    with pytest.raises(PretravelError, match="jam"):
        friction_cycle(steep, DIRECTIONS, 0.3)


def test_threefold_symmetry(omp40: Probe) -> None:
    turned = from_angles(np.radians([90.0, 90.0]), np.radians([20.0, 140.0]))
    cycle = friction_cycle(omp40, turned, 0.1, body="rigid", steps=15)
    assert cycle.trigger_force[0] == pytest.approx(cycle.trigger_force[1], rel=1e-6)
    assert cycle.zero_drift[0] == pytest.approx(cycle.zero_drift[1], rel=1e-4)


def test_bad_values_are_explained(omp40: Probe) -> None:
    with pytest.raises(PretravelError, match=r"between 0 and 0\.4"):
        friction_cycle(omp40, DIRECTIONS, 0.8)
    with pytest.raises(PretravelError, match="overtravel"):
        friction_cycle(omp40, DIRECTIONS, 0.1, overtravel=0.0)
    rigid = replace(omp40, seats=replace(omp40.seats, contact="rigid"))
    with pytest.raises(PretravelError, match="rigid"):
        friction_cycle(rigid, DIRECTIONS, 0.1)


def test_limits_of_cycles_steps_and_overtravel(omp40: Probe) -> None:
    check_conditions(omp40, 0.1, 1.0, 1, 5)
    check_conditions(omp40, 0.1, None, 1, 250_000, directions=2)
    for overtravel, cycles, steps, directions in (
        (1.01, 1, 5, 1), (1.0, 0, 5, 1), (1.0, 1, 4, 1), (1.0, 1, 250_001, 2), (1.0, 2, 250_001, 1),
    ):  # fmt: skip
        with pytest.raises(PretravelError):
            check_conditions(omp40, 0.1, overtravel, cycles, steps, directions)


def test_more_steps_than_memory_holds_are_refused_before_any_work():
    probe = load_probe("omp40-2")
    for numbers in ({"cycles": 10**8}, {"steps": 10**9}):
        with pytest.raises(PretravelError, match="every step is kept") as refused:
            friction_cycle(probe, [[1.0, 0.0, 0.0]], 0.1, **numbers)
        assert refused.value.inputs == ("cycles", "steps")


def test_a_prediction_without_friction_is_that_of_statics(omp40: Probe) -> None:
    """Friction 0 goes another way to the same state: forces, displacements, both shares."""
    few = DIRECTIONS[[1, 3]]
    plain = predict(omp40, few, "analytic")
    cycle, shares = rubbed_trigger(omp40, few, compliance_model("analytic"), default_workpiece())
    assert cycle.trigger_force[:, -1] == pytest.approx(plain.force, rel=1e-6)
    assert cycle.trigger_reactions[:, -1] == pytest.approx(plain.reactions, abs=1e-5)
    assert shares["seats"] == pytest.approx(plain.displacements["seats"], abs=1e-8)
    body = plain.deflection - plain.displacements["seats"]
    assert shares["body"] == pytest.approx(body, abs=1e-8)
    assert shares["tip_on_part"] == pytest.approx(plain.displacements["tip_on_part"], rel=1e-6)


def test_a_prediction_uses_the_elements_that_it_was_given(
    omp40: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A coarse mesh, not that of the program: without friction, the deflection is that of `fem`.
    Without friction all touches are equal, and few steps are enough."""
    monkeypatch.setattr("pretravel.design.friction.predict_with_friction.TOUCHES", 1)
    monkeypatch.setattr("pretravel.design.friction.predict_with_friction.STEPS", 5)
    model, few = FiniteElements(coarse_reduced_sixth()), DIRECTIONS[1:2]
    plain = predict(omp40, few, model)
    cycle, shares = rubbed_trigger(omp40, few, model, default_workpiece())
    assert cycle.trigger_force[:, -1] == pytest.approx(plain.force, rel=1e-6)
    along = np.sum((shares["body"] + shares["seats"]) * few, axis=1)
    assert along == pytest.approx(np.sum(plain.deflection * few, axis=1), rel=1e-6)


def test_a_prediction_with_friction_is_the_settled_touch(omp40: Probe) -> None:
    sliding = omp40.with_friction(0.2)
    trigger = predict(sliding, DIRECTIONS[1:2], "analytic")
    cycle = friction_cycle(omp40, DIRECTIONS[1:2], 0.2, cycles=3, steps=25)
    assert trigger.force == pytest.approx(cycle.trigger_force[:, 2], rel=1e-9)
    along = cycle.trigger_deflection[:, 2]
    assert trigger.pretravel - trigger.tip_approach == pytest.approx(along, rel=1e-9)
    # The stylus bends as a beam under the force of the third touch; the seats make up the rest.
    bent = trigger.force[:, None] * DIRECTIONS[1:2] * stylus_compliance(omp40.stylus)
    assert trigger.displacements["body"] == pytest.approx(bent, abs=1e-12)
    seats = cycle.trigger_displacement[:, 2] - bent
    assert trigger.displacements["seats"] == pytest.approx(seats, abs=1e-12)
    # Hertz, tip on part: the power 2/3 of that force.
    plain = predict(omp40, DIRECTIONS[1:2], "analytic")
    hertz = np.cbrt(trigger.force / plain.force) ** 2 * plain.displacements["tip_on_part"]
    assert trigger.displacements["tip_on_part"] == pytest.approx(hertz, rel=1e-9)
    assert predicted_map(omp40, trigger).kind == "tabulated"


def test_friction_is_refused_where_it_is_not_contained(omp40: Probe) -> None:
    sliding = omp40.with_friction(0.2)
    with pytest.raises(PretravelError, match="'shen' does not contain friction"):
        predict(sliding, DIRECTIONS, "shen")
    with pytest.raises(PretravelError, match="gravity"):
        predict(sliding, DIRECTIONS, gravity=[0.0, 0.0, -1.0])
    with pytest.raises(PretravelError, match=r"friction of \[seats\] to 0"):
        probe_response(sliding)
    with pytest.raises(PretravelError, match="between 0 and 0"):
        omp40.with_friction(0.7)


def test_the_tripod_tilts_over_one_rod_without_loss(omp40: Probe) -> None:
    """Azimuth 60°, force along the third rod. With much friction this rod alone holds the tripod:
    the force of a rigid lever, preload times contact radius over the contact's height, at which
    nothing slides; with little friction the other rods slide, and the force is smaller on the way
    back. The lever's arms are those of the two contact points of the third rod."""
    contacts = seat_frame(omp40).contacts(omp40.tripod.rod_radius)[4:6]
    radius = np.linalg.norm(contacts.mean(axis=0)[:2])
    lever = omp40.preload * radius / (omp40.lever + contacts[0, 2])
    sixty = DIRECTIONS[2:3]
    with_much = friction_cycle(omp40, sixty, 0.3, body="rigid", steps=20)
    top = np.argmax(with_much.deflection[0])
    assert with_much.force[0, top] == pytest.approx(lever, rel=1e-6)
    assert with_much.force[0, top + 2] == pytest.approx(lever, rel=1e-6)
    with_little = friction_cycle(omp40, sixty, 0.1, body="rigid", steps=20)
    top = np.argmax(with_little.deflection[0])
    assert with_little.force[0, top] < lever
    assert with_little.force[0, top + 5] < 0.7 * with_little.force[0, top]
