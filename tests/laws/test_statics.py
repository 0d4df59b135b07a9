"""Laws of six-seat statics, which hold for every probe, direction and load."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.base.errors import DescriptionError
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Moving, Probe
from pretravel.prediction.seats import seat_statics
from pretravel.prediction.trigger import predict
from pretravel.six_seats.event import trigger_force

UPPER = fibonacci_cap(400, np.radians(95.0))


@st.composite
def probes(draw: st.DrawFn) -> Probe:
    """Probes with proportions other than those of the catalogue, also with uneven rods."""
    base = load_probe("omp40-2")
    azimuths = tuple(
        np.radians(nominal + draw(st.floats(-15.0, 15.0))) for nominal in (0.0, 120.0, 240.0)
    )
    return replace(
        base,
        tripod=replace(
            base.tripod,
            radius=draw(st.floats(4.0, 30.0)),
            rod_azimuths=azimuths,
            rod_radius=1.5,
        ),
        seats=replace(
            base.seats, ball_radius=2.0, support_angle=np.radians(draw(st.floats(15.0, 70.0)))
        ),
        preload=draw(st.floats(0.2, 12.0)),
        hub_offset=draw(st.floats(0.0, 40.0)),
    )


@given(probes(), st.floats(0.0, np.pi), st.floats(0.0, 2.0 * np.pi))
def test_force_and_moment_balance(probe: Probe, polar: float, azimuth: float) -> None:
    """Spring, weight, touch and six reactions add up to zero, summed vector by vector; a fiftieth
    of the preload at 2 mm above the rods is too light to unseat any of these probes."""
    probe = replace(probe, moving=Moving(mass=0.02 * probe.preload / 9.80665, height=2.0))
    down = from_angles(polar, azimuth)[0]
    trigger = predict(probe, UPPER, gravity=down)
    statics, weight = seat_statics(probe, down), 0.02 * probe.preload * down
    for row in range(0, len(UPPER), 57):
        forces = trigger.reactions[row][:, None] * statics.normals
        touch = trigger.force[row] * trigger.directions[row]
        total = forces.sum(axis=0) + touch + weight + [0.0, 0.0, -probe.preload]
        moment = np.cross(statics.points, forces).sum(axis=0)
        moment += np.cross([0.0, 0.0, -probe.lever], touch)
        moment += np.cross([0.0, 0.0, 2.0], weight)
        # 1e-9 relative to the forces and lever arms: rounding of a 6 x 6 solution.
        scale = probe.preload + trigger.force[row]
        assert np.abs(total).max() <= 1e-9 * scale
        assert np.abs(moment).max() <= 1e-9 * scale * probe.lever


@given(probes())
def test_a_rod_lifts_no_earlier_than_its_first_seat_opens(probe: Probe) -> None:
    statics = seat_statics(probe)
    unit = statics.unit_reactions(UPPER)
    first, _ = trigger_force(statics.rest_reactions, unit)
    lift, seat = trigger_force(statics.rest_reactions, unit, "arm_lift")
    assert np.all(lift >= first * (1.0 - 1e-12))
    pairs = statics.reactions(UPPER, lift).reshape(-1, 3, 2).sum(axis=2)
    assert np.allclose(pairs.min(axis=1), 0.0, atol=1e-9 * probe.preload)
    assert np.array_equal(pairs.argmin(axis=1), seat // 2)


def test_force_does_not_depend_on_elasticity(omp40: Probe) -> None:
    """Rodrigues 2021, sections 4.6.2 and 4.6.3: stem diameter and material do not change it."""
    from pretravel.prediction.materials import material

    thin = replace(
        omp40,
        stylus=tuple(
            replace(s, diameter=0.5 * s.diameter, material=material("aluminium"))
            for s in omp40.stylus
        ),
    )
    assert np.array_equal(predict(omp40, UPPER).force, predict(thin, UPPER).force)
    assert np.all(predict(thin, UPPER).pretravel > predict(omp40, UPPER).pretravel)


def test_force_is_proportional_to_preload(omp40: Probe) -> None:
    weaker = replace(omp40, preload=4.0)
    ratio = predict(weaker, UPPER).force / predict(omp40, UPPER).force
    assert np.allclose(ratio, 4.0 / 5.91, rtol=1e-12)


def test_along_the_axis_the_whole_preload_is_lifted(omp40: Probe) -> None:
    assert predict(omp40, [[0.0, 0.0, 1.0]]).force[0] == pytest.approx(5.91, rel=1e-12)


def test_pushed_along_x_the_rod_at_x_lifts(omp40: Probe) -> None:
    loads = predict(omp40, [[1.0, 0.0, 0.0]]).reactions[0].reshape(3, 2).sum(axis=1)
    assert loads.argmin() == 0


def test_seat_motion_does_the_work_of_the_seat_forces(omp40: Probe) -> None:
    """Virtual work: F·displacement of the tip equals the sum of reaction changes times
    indentations, for any indentations. This does not depend on the solution of the motion."""
    statics = seat_statics(omp40)
    rng = np.random.default_rng(5)
    indentations = rng.normal(0.0, 1e-3, (50, 6))
    directions = UPPER[:50]
    tip = statics.tip_displacement(indentations)
    outer = np.sum(tip * directions, axis=1)
    inner = np.sum(statics.unit_reactions(directions) * indentations, axis=1)
    assert np.allclose(outer, inner, atol=1e-15)


class TestGravity:
    def test_upright_weight_adds_to_the_preload(self, omp40: Probe) -> None:
        heavy = replace(omp40, moving=Moving(mass=0.1, height=-20.0))
        force = predict(heavy, UPPER, gravity=(0.0, 0.0, -1.0)).force
        expected = predict(replace(omp40, preload=5.91 + 0.980665), UPPER).force
        assert np.allclose(force, expected, rtol=1e-12)

    def test_lying_probe_triggers_easier_away_from_the_floor(self, omp40: Probe) -> None:
        """Spindle along +x, gravity along -z. The weight acts below the plane of the rods
        like a push on the tip towards -z, so a smaller force triggers in this direction."""
        lying = replace(
            omp40,
            orientation=replace(omp40.orientation, axis=(1.0, 0.0, 0.0)),
            moving=Moving(mass=0.02, height=-25.0),
        )
        floor, ceiling = np.array([[0.0, 0.0, -1.0]]), np.array([[0.0, 0.0, 1.0]])
        machine = (0.0, 0.0, -1.0)
        from pretravel.base.frames import probe_rotation

        rotation = probe_rotation((1.0, 0.0, 0.0))
        # Pushes are in the machine frame, as normals of surfaces are; here in the probe frame.
        down = predict(lying, floor @ rotation, gravity=machine).force[0]
        down_weightless = predict(lying, floor @ rotation).force[0]
        up = predict(lying, ceiling @ rotation, gravity=machine).force[0]
        up_weightless = predict(lying, ceiling @ rotation).force[0]
        assert down < down_weightless
        assert up > up_weightless

    def test_moment_of_the_weight_is_that_of_a_tip_force(self, omp40: Probe) -> None:
        """On a horizontal probe, a mass at the tip acts as a force on the tip: F adds to m g in
        the same direction."""
        mass = 0.01
        at_tip = replace(omp40, moving=Moving(mass=mass, height=-omp40.lever))
        direction = np.array([[1.0, 0.0, 0.0]])
        with_weight = predict(at_tip, direction, gravity=(1.0, 0.0, 0.0)).force[0]
        without = predict(omp40, direction).force[0]
        assert with_weight + mass * 9.80665 == pytest.approx(without, rel=1e-12)

    def test_without_a_mass(self, omp40: Probe) -> None:
        with pytest.raises(DescriptionError, match="no moving mass"):
            predict(replace(omp40, moving=Moving()), UPPER, gravity=(0.0, 0.0, -1.0))


def test_a_left_seat_is_on_the_counter_clockwise_side(omp40: Probe) -> None:
    """Rod A lies along +x; its left seat is at +y and pushes the rod towards -y, and up."""
    from pretravel.prediction.seats import SEAT_NAMES

    statics = seat_statics(omp40)
    left = SEAT_NAMES.index("A-left")
    assert np.allclose(statics.points[left], [16.34, 0.0, 0.0])
    angle = np.radians(27.266)
    assert np.allclose(statics.normals[left], [0.0, -np.cos(angle), np.sin(angle)])
