"""The share of each compliance, computed by hand: every share is tested by itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.frames import probe_rotation
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance import analytic
from pretravel.prediction.compliance.ren import RenProbe, ren_pretravel
from pretravel.prediction.description import Moving, Orientation, Probe
from pretravel.prediction.event import trigger_force
from pretravel.prediction.hertz import contact_modulus, rod_on_ball_coefficient
from pretravel.prediction.loading import loaded
from pretravel.prediction.materials import material
from pretravel.prediction.predict import predict, predicted_map
from pretravel.prediction.seats import SeatStatics, seat_statics
from pretravel.probing.simulation import PartSetup, Targets, simulate
from pretravel.surface.shapes import Plane, Sphere

UP = np.array([[0.0, 0.0, 1.0]])
STEEL, ALUMINIUM = material("steel"), material("aluminium")


class TestPushedAlongTheAxis:
    """All six seats open at once under 5.91 N: every share is a closed form."""

    def test_stylus_axial(self, omp40: Probe) -> None:
        """F sum l / (E A): 12 mm of steel Ø 8, 38 mm of ceramic Ø 4.5."""
        expected = 5.91 * (12.0 / (193e3 * math.pi * 4.0**2) + 38.0 / (413e3 * math.pi * 2.25**2))
        share = predict(omp40, UP).shares["stylus_axial"][0]
        assert share == pytest.approx(expected, rel=1e-12)

    @pytest.mark.parametrize("workpiece", [STEEL, ALUMINIUM])
    def test_tip_on_part(self, omp40: Probe, workpiece) -> None:  # type: ignore[no-untyped-def]
        """(9 F² / 16 R E*²)^(1/3), ruby ball of 3 mm on the part."""
        modulus = 1.0 / (
            (1.0 - 0.29**2) / 400e3 + (1.0 - workpiece.poissons_ratio**2) / workpiece.youngs_modulus
        )
        expected = (9.0 * 5.91**2 / (16.0 * 3.0 * modulus**2)) ** (1.0 / 3.0)
        share = predict(omp40, UP, workpiece=workpiece).shares["tip_on_part"][0]
        assert share == pytest.approx(expected, rel=1e-12)

    def test_seats(self, omp40: Probe) -> None:
        """Each seat rises by c N^(2/3) along its normal: the tripod by this over the sine of the
        support angle. N = 5.91 / (6 sin)."""
        sine = math.sin(math.radians(27.266))
        modulus = 686e3 / (2.0 * (1.0 - 0.22**2))
        c = rod_on_ball_coefficient(2.75, 3.5, modulus)
        expected = c * (5.91 / (6.0 * sine)) ** (2.0 / 3.0) / sine
        assert predict(omp40, UP).shares["seats"][0] == pytest.approx(expected, rel=1e-9)


def test_axial_share_is_positive_below_the_equator_too(omp40: Probe) -> None:
    """Under a slight pull (polar 100°), the stylus extends along the force."""
    trigger = predict(omp40, from_angles(np.radians(100.0), 0.3))
    assert trigger.displacements["stylus_axial"][0, 2] < 0.0
    assert trigger.shares["stylus_axial"][0] > 0.0


def test_shear_by_hand(omp40: Probe) -> None:
    trigger = predict(omp40, np.array([[1.0, 0.0, 0.0]]))
    expected = 0.0
    for length, diameter, modulus, nu in ((12.0, 8.0, 193e3, 0.30), (38.0, 4.5, 413e3, 0.23)):
        factor = 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu)
        area = math.pi * diameter**2 / 4.0
        expected += length / (factor * modulus / (2.0 * (1.0 + nu)) * area)
    share = trigger.shares["stylus_shear"][0]
    assert share == pytest.approx(trigger.force[0] * expected, rel=1e-12)


def test_segments_count_from_the_hub(omp40: Probe) -> None:
    """The stiff head belongs to the clamped end; at the tip it would hardly reduce bending."""
    turned_round = replace(omp40, stylus=omp40.stylus[::-1], tip=replace(omp40.tip, radius=4.0))
    side = np.array([[1.0, 0.0, 0.0]])
    ratio = (
        predict(turned_round, side).shares["stylus_bending"]
        / predict(omp40, side).shares["stylus_bending"]
    )
    # By hand: [(50³-12³)/E_c I_c + 12³/E_s I_s] / [(50³-38³)/E_s I_s + 38³/E_c I_c].
    soft, stiff = 413e3 * 4.5**4, 193e3 * 8.0**4
    expected = ((50**3 - 12**3) / soft + 12**3 / stiff) / ((50**3 - 38**3) / stiff + 38**3 / soft)
    assert ratio[0] == pytest.approx(expected, rel=1e-12)


def test_nothing_moves_without_a_force(omp40: Probe) -> None:
    """Holds also for uneven reactions at rest: a horizontal probe."""
    lying = replace(omp40, moving=Moving(0.02, -25.0))
    statics = seat_statics(lying, (1.0, 0.0, 0.0))
    assert np.ptp(statics.rest_reactions) > 0.1
    zero = analytic.MODEL.displacements(loaded(lying, statics, UP, np.zeros(1), STEEL))
    assert all(np.abs(vector).max() < 1e-18 for vector in zero.values())


def test_an_open_seat_is_just_touching(omp40: Probe) -> None:
    """With arm_lift one seat is past opening; its indentation is only -c N_rest^(2/3)."""
    probe = replace(omp40, criterion="arm_lift")
    trigger = predict(probe, from_angles(np.pi / 2.0, 0.4))
    assert trigger.reactions.min() < -0.01
    statics = seat_statics(probe)
    c = rod_on_ball_coefficient(2.75, 3.5, contact_modulus(*[material("tungsten carbide")] * 2))
    reactions = np.where(trigger.reactions < 0.0, 0.0, trigger.reactions)
    sunk = c * (reactions ** (2 / 3) - statics.rest_reactions ** (2 / 3))
    expected = statics.tip_displacement(sunk)
    assert np.allclose(trigger.displacements["seats"], expected, atol=1e-15)


def test_both_materials_count_in_a_seat(omp40: Probe) -> None:
    steel_balls = replace(omp40, seats=replace(omp40.seats, material=STEEL))
    steel_rods = replace(omp40, tripod=replace(omp40.tripod, material=STEEL))
    a, b, both = (
        predict(probe, UP).shares["seats"][0]
        for probe in (
            steel_balls,
            steel_rods,
            replace(steel_balls, tripod=steel_rods.tripod),
        )
    )
    assert a == pytest.approx(b, rel=1e-12)
    assert predict(omp40, UP).shares["seats"][0] < a < both


def test_shen_bends_the_whole_lever(omp40: Probe) -> None:
    """F L³ / 3EI with L = 64.4 mm, including the hub, E = 413 GPa, d = 4.5 mm."""
    trigger = predict(omp40, np.array([[1.0, 0.0, 0.0]]), "shen")
    expected = trigger.force[0] * 64.4**3 / (3.0 * 413e3 * math.pi * 4.5**4 / 64.0)
    assert trigger.pretravel[0] == pytest.approx(expected, rel=1e-12)


def test_ren_equation_6_with_unequal_radii() -> None:
    """(2 R2 + R1) / (R2 R1) with ball R1 = 1 and rod R2 = 2: 5/2."""
    terms = ren_pretravel(
        1.0,
        RenProbe(
            lever=18.0, lever_ratio=1.5, stylus_diameter=2.0, stylus_modulus=200e3,
            contact_coefficient=0.9744, seat_radii=(1.0, 2.0), seat_moduli=(200e3, 200e3),
            tip_radius=4.0, tip_modulus=620e3, part_modulus=200e3,
        ),
    )  # fmt: skip
    expected = 1.5 * 0.655 * 0.9744 * (2.5 * (2.0 / 200e3) ** 2) ** (1.0 / 3.0)
    assert float(terms.rigid) == pytest.approx(expected, rel=1e-12)


class TestEvents:
    def test_arm_lift_threshold(self) -> None:
        """Rest 2 N a seat, a rod unloaded by 4 N per newton, threshold 1 N: (4 - 1) / 4."""
        unit = np.array([[1.0, 1.0, 1.0, 1.0, -1.0, -3.0]])
        force, seat = trigger_force(np.full(6, 2.0), unit, "arm_lift", 1.0)
        assert force[0] == 0.75
        assert seat[0] == 5

    def test_arm_lift_may_ask_for_more_than_a_seat_carries(self, omp40: Probe) -> None:
        """Rod sums are 4.30 N at rest: 2.5 N is a threshold for rods, not for seats."""
        probe = replace(omp40, criterion="arm_lift", threshold=2.5)
        assert predict(probe, np.array([[1.0, 0.0, 0.0]])).force[0] > 0.0

    def test_of_two_that_open_together_the_first_is_named(self) -> None:
        unit = np.array([[-1.0, -1.0 - 1e-13, 1.0, 1.0, 1.0, 1.0]])
        assert trigger_force(np.full(6, 2.0), unit)[1][0] == 0


class TestPredictedMapOfATurnedProbe:
    def test_values_and_tip(self, omp40: Probe) -> None:
        probe = replace(
            omp40, orientation=Orientation(axis=(0.6, 0.0, 0.8), rotation=math.radians(17.0))
        )
        directions = from_angles(
            np.radians([20.0, 50.0, 80.0, 80.0]), np.radians([0, 100, 40, 300])
        )
        trigger = predict(probe, directions)
        made = predicted_map(probe, trigger)
        rotation = probe_rotation((0.6, 0.0, 0.8), math.radians(17.0))
        assert np.allclose(made.pretravel(directions @ rotation.T), trigger.pretravel, atol=1e-15)
        assert made.u_tip_radius == pytest.approx(0.2e-3)


class TestSimulation:
    def test_the_workpiece_counts(self, omp40: Probe) -> None:
        floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        touched = simulate(
            omp40, floor, Targets([[0, 0, 0]], UP), setup=PartSetup(material=ALUMINIUM)
        )  # type: ignore[arg-type]
        pretravel = predict(omp40, UP, workpiece=ALUMINIUM).pretravel[0]
        assert touched.positions[0, 2] == pytest.approx(3.0 - pretravel, abs=1e-12)

    def test_an_oblique_touch_on_a_sphere(self, omp40: Probe) -> None:
        """The path passes through the position of the tip centre above the target, along the
        approach; the nominal point is where the ball touches first, on the sphere.
        """
        n = np.array([[0.6, 0.0, 0.8]])
        a = np.array([[0.0, 0.0, -1.0]])
        touched = simulate(
            omp40, Sphere([1.0, 2.0, 3.0], 12.5), Targets([1, 2, 3] + 12.5 * n, n, a)
        )
        start = [1.0, 2.0, 3.0] + 15.5 * n[0]
        assert np.allclose(touched.positions[0, :2], start[:2], atol=1e-12)
        assert touched.positions[0, 2] < start[2]
        nominal = touched.nominal_points
        assert nominal is not None
        assert np.linalg.norm(nominal[0] - [1, 2, 3]) == pytest.approx(12.5, abs=1e-12)

    def test_slow_and_frictionless_means_the_force_is_along_the_true_normal(self) -> None:
        """On a sphere of 3 mm the tip slides to another normal; the deflected ball still touches:
        |C - c| = R + r - approach, with C = P + deflection(n), n = (C - c)/|C - c|. Two balls
        of 3 mm approach like one of 1.5 mm and a flat: 2^(1/3) times as far."""
        probe = load_probe("omp40-2-100mm")
        n = from_angles(np.radians([35.0, 60.0]), np.radians([20.0, 130.0]))
        touched = simulate(probe, Sphere([0, 0, 0], 3.0), Targets(3.0 * n, n))
        normal = n
        for _ in range(30):
            trigger = predict(probe, normal)
            center = touched.positions + trigger.deflection
            normal = center / np.linalg.norm(center, axis=1, keepdims=True)
        gap = np.linalg.norm(center, axis=1) - (6.0 - 2.0 ** (1.0 / 3.0) * trigger.tip_approach)
        assert np.abs(gap).max() < 1e-9
        turned = np.degrees(np.arccos(np.sum(normal * n, axis=1)))
        assert np.all(turned > 0.05)


@pytest.mark.parametrize("model", ["analytic", "ren", "shen"])
def test_reactions_are_solved_once_for_a_prediction(
    omp40: Probe, model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, calls = SeatStatics.unit_reactions, []

    def counted(statics: SeatStatics, directions: FloatArray) -> FloatArray:
        calls.append(len(directions))
        return solve(statics, directions)

    monkeypatch.setattr(SeatStatics, "unit_reactions", counted)
    predict(omp40, UP, model)
    assert calls == [len(UP)]
