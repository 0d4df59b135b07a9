"""Sentences and reports about touches, from both sides of each limit; tips in closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement, probe_rotation
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.described_map import described_map
from pretravel.prediction.materials import material
from pretravel.probing.inspection import InspectionRegion, plan_inspection
from pretravel.probing.simulation import (
    Latch,
    PartSetup,
    _advice,
    refuse_failures,
    reported,
    simulate,
    target_warnings,
    travel_since_contact,
)
from pretravel.probing.surface_touches import (
    MEANING,
    SurfaceTouches,
    TouchStatus,
    describe_failures,
)
from pretravel.probing.targets import Targets
from pretravel.probing.tip import MeasuredTip, PredictedTip, mapped_tip, predicted_tip, tip_of
from pretravel.surface.cad.part import Part
from pretravel.surface.shapes import Plane
from pretravel.touches import Touches
from tests.support.example_maps import lobes, mean_map

UP = [0.0, 0.0, 1.0]
FLOOR = Plane([0, 0, 0], [0, 0, 1])


def _outcomes(**fields: Any) -> SurfaceTouches:
    """Three converged touches with numbers that are all different."""
    rng = np.random.default_rng(3)
    vectors = ("first_point", "first_normal", "point", "normal", "force_direction", "deflection")
    numbers = ("first_travel", "travel", "force", "residual", "trigger_residual")
    values: dict[str, Any] = {name: rng.normal(size=(3, 3)) for name in vectors}
    values |= {name: rng.normal(size=3) for name in numbers}
    whole = {name: np.zeros(3, dtype=np.int64) for name in ("status", "face", "iterations")}
    return SurfaceTouches(**(values | whole | fields))


def test_pretravel_and_slide_are_from_first_contact_to_trigger() -> None:
    found = _outcomes(status=np.array([0, 1, 0]))
    assert found.converged.tolist() == [True, False, True]
    for row in range(3):
        assert found.pretravel[row] == found.travel[row] - found.first_travel[row]
        way = math.dist(found.point[row], found.first_point[row])
        assert found.slide[row] == pytest.approx(way)


def test_outcomes_have_numbers_of_their_own() -> None:
    """Eleven of them, as files and other programs know them."""
    assert {status.name: int(status) for status in TouchStatus} == {
        "CONVERGED": 0, "MISSED": 1, "EDGE": 2, "OTHER_FACE": 3, "STEM": 4, "NEVER_TRIGGERS": 5,
        "DOES_NOT_FIT": 6, "NOT_CONVERGED": 7, "OUTSIDE_MAP": 8,
        "NOT_DETERMINED": 9, "APEX": 10,
    }  # fmt: skip
    assert set(MEANING) == set(TouchStatus)


class TestSentences:
    def test_up_to_five_targets_and_faces_are_named(self) -> None:
        """Of seven touches of each kind, on faces of numbers 18 to 11; faces of obstacles only."""
        part = object.__new__(Part)
        faces = tuple(SimpleNamespace(number=18 - index) for index in range(8))
        object.__setattr__(part, "faces", faces)
        count = 7
        targets = Targets(np.zeros((count, 3)), [UP] * count)
        for status in TouchStatus:
            failed = SimpleNamespace(status=np.full(count, status), face=np.arange(1, 8))
            sentences = describe_failures(failed, targets, part)  # type: ignore[arg-type]
            if status == TouchStatus.CONVERGED:
                assert sentences == []
                continue
            which = ""
            if status in (TouchStatus.OTHER_FACE, TouchStatus.STEM):
                which = " (face 11, 12, 13, 14, 15)"
            named = ", ".join(f"target {n}" for n in range(1, 6))
            assert sentences == [f"7 {MEANING[status]}{which}: {named} and 2 more"]
            (on_a_shape,) = describe_failures(failed, targets, FLOOR)  # type: ignore[arg-type]
            assert on_a_shape == f"7 {MEANING[status]}: {named} and 2 more"

    def test_exactly_five_have_no_more(self) -> None:
        failed = SimpleNamespace(status=np.full(5, TouchStatus.MISSED), face=np.full(5, -1))
        targets = Targets(np.zeros((5, 3)), [UP] * 5, labels=("a", "", "c", "d", "e"))
        (told,) = describe_failures(failed, targets, FLOOR)  # type: ignore[arg-type]
        assert told.endswith("target 1 (a), target 2, target 3 (c), target 4 (d), target 5 (e)")
        (few,) = describe_failures(failed, targets, FLOOR, most=1)  # type: ignore[arg-type]
        assert few.endswith("target 1 (a) and 4 more")


class TestWarnings:
    def _told(self, off: list[float], degrees: list[float]) -> list[str]:
        """Targets beside the first contact, whose normals are turned; the last one failed."""
        count = len(off)
        targets = Targets(np.zeros((count, 3)), [UP] * count)
        done = SimpleNamespace(
            converged=np.arange(count) < count - 1,
            first_point=np.column_stack(
                [0.6 * np.array(off), 0.8 * np.array(off), np.zeros(count)]
            ),
            first_normal=from_angles(np.radians(degrees), 0.7),
        )
        return target_warnings(targets, done)  # type: ignore[arg-type]

    def test_near_targets_with_the_right_normals_are_quiet(self) -> None:
        assert self._told([0.0, 0.049, 5.0], [0.0, 0.98, 40.0]) == []

    def test_targets_away_from_the_surface(self) -> None:
        (told,) = self._told([0.051, 0.02, 0.8, 7.0], [0.0] * 4)
        assert told.startswith("2 of 4 targets are up to 0.8 mm away from the point")
        assert told.endswith("that point is used")
        (far,) = self._told([0.051, 1.01, 7.0], [0.0] * 3)
        assert far.endswith("Are they in mm, in the part's frame, and for this surface?")
        (near,) = self._told([0.051, 0.99, 7.0], [0.0] * 3)
        assert near.endswith("that point is used")

    def test_normals_beside_those_of_the_surface(self) -> None:
        (told,) = self._told([0.0] * 3, [1.02, 0.5, 80.0])
        assert "differ from the surface's by up to 1.0°" in told
        (told,) = self._told([0.0] * 4, [1.02, 12.34, 3.0, 80.0])
        assert "by up to 12.3°" in told


class TestAdvice:
    def _advice(self, height: list[float], tilt: list[float], status: int) -> str:
        """On failed targets above a floor; a last one did not fail, and lies far away."""
        n = from_angles(np.radians([*tilt, 175.0]), 0.3)
        points = [[3.0 * k, 0.0, z] for k, z in enumerate([*height, 50.0])]
        converged = np.arange(len(points)) == len(height)
        failed = SimpleNamespace(
            converged=converged, status=np.where(converged, TouchStatus.CONVERGED, status)
        )
        return _advice(failed, Targets(points, n), FLOOR)  # type: ignore[arg-type]

    def test_more_than_a_millimetre_is_a_doubt_about_units(self) -> None:
        told = self._advice([0.5, -1.02, 0.1], [0.0] * 3, TouchStatus.MISSED)
        assert "up to 1.02 mm from the surface: are they in mm" in told
        told = self._advice([0.5, -0.98, 0.1], [0.0] * 3, TouchStatus.MISSED)
        assert told.startswith("Check the points, normals and approaches")

    def test_most_normals_point_inwards(self) -> None:
        told = self._advice([0.0] * 3, [100.0, 100.0, 20.0], TouchStatus.MISSED)
        assert told == "Their normals point into the part; they must point out of it"
        for tilts in ([100.0, 20.0], [100.0, 20.0, 20.0]):
            told = self._advice([0.0] * len(tilts), tilts, TouchStatus.MISSED)
            assert told.startswith("Check the points, normals and approaches")

    def test_only_where_no_other_failed_the_solver_is_limited(self) -> None:
        told = self._advice([0.0] * 2, [0.0] * 2, TouchStatus.NOT_CONVERGED)
        assert "a limit of the solver" in told
        targets = Targets([[0, 0, 0], [1, 0, 0]], [UP, UP])
        status = np.array([TouchStatus.NOT_CONVERGED, TouchStatus.EDGE])
        mixed = SimpleNamespace(
            converged=np.zeros(2, dtype=bool), status=status, face=np.full(2, -1)
        )
        with pytest.raises(PretravelError, match="2 of 2 targets cannot be touched: 1 edge") as no:
            refuse_failures(mixed, targets, FLOOR)  # type: ignore[arg-type]
        assert "limit of the solver" not in str(no.value)
        good = replace(_outcomes(), status=np.zeros(3, dtype=np.int64))
        refuse_failures(good, Targets(np.zeros((3, 3)), [UP] * 3), FLOOR)


class TestSetups:
    def test_a_vector_of_the_machine_is_turned_into_the_part(self) -> None:
        turn = probe_rotation(from_angles(0.5, 1.0)[0], rotation=0.3)
        placed = PartSetup(placement=Placement(turn, np.zeros(3)))
        assert placed.to_part @ turn == pytest.approx(np.eye(3))
        assert not np.allclose(placed.to_part, turn, atol=0.1)
        assert PartSetup().to_part.tolist() == np.eye(3).tolist()

    def test_no_stylus_is_checked_and_no_friction_acts_without_a_wish(self) -> None:
        """A map has neither stylus nor forces: with one of them it would be refused."""
        targets = Targets(np.zeros((1, 3)), [UP])
        assert len(simulate(mean_map(0.01), FLOOR, targets)) == 1
        for setup in (PartSetup(check_stylus=True), PartSetup(friction=0.1)):
            with pytest.raises(PretravelError, match="described probe"):
                simulate(mean_map(0.01), FLOOR, targets, setup=setup)
        with pytest.raises(PretravelError, match="the clearance"):
            simulate(mean_map(0.01), FLOOR, targets, setup=PartSetup(clearance=-1.0))


class TestReports:
    A = np.array([[0.6, 0.0, -0.8], [0.0, 0.28, -0.96], [0.0, 0.0, -1.0]])
    TARGETS = Targets(
        [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]], [UP] * 3, A, ("a", "b", "c")
    )

    def test_every_field_of_what_a_machine_latches(self) -> None:
        """300 mm/min for 2 ms are 10 µm of travel on; the second touch failed."""
        done = _outcomes(status=np.array([0, 2, 0]))
        found = reported(done, self.TARGETS, 2.5, Latch(feed=300.0, delay=2e-3))
        assert found is not None
        for row, own in enumerate((0, 2)):
            at = self.TARGETS.points[own] + [0.0, 0.0, 2.5]
            at = at + (done.travel[own] + 0.010) * self.A[own]
            assert found.positions[row] == pytest.approx(at)
            assert found.nominal_points is not None
            assert found.nominal_points[row].tolist() == done.first_point[own].tolist()
            assert found.approach_directions[row] == pytest.approx(self.A[own])
        assert found.labels == ("a", "c")
        assert found.feeds is not None
        assert found.feeds.tolist() == [300.0, 300.0]
        plain = reported(done, replace(self.TARGETS, labels=None), 2.5, Latch())
        assert plain is not None
        assert (plain.labels, plain.feeds) == (None, None)
        assert reported(_outcomes(status=np.ones(3)), self.TARGETS, 2.5, Latch()) is None

    def test_noise_is_drawn_with_its_size_from_a_number_or_a_generator(self) -> None:
        travel = np.linspace(0.0, 1.0, 4000)
        noise = Latch(noise=2e-3, rng=4).latched(travel) - travel
        assert noise.std() == pytest.approx(2e-3, rel=0.05)
        assert abs(noise.mean()) < 2e-4
        again = Latch(noise=2e-3, rng=4).latched(travel) - travel
        assert np.array_equal(noise, again)
        assert not np.any(noise == Latch(noise=2e-3, rng=5).latched(travel) - travel)
        begun = Latch(noise=2e-3, rng=np.random.default_rng(4))
        assert np.array_equal(noise, begun.latched(travel) - travel)
        assert not np.any(noise == begun.latched(travel) - travel)  # it goes on
        assert np.array_equal(Latch(feed=300.0).latched(travel), travel)

    def test_a_delay_needs_a_feed(self) -> None:
        with pytest.raises(PretravelError, match="state the feed too"):
            Latch(delay=1e-3)
        for wrong in ({"noise": -1e-3}, {"feed": -1.0}, {"feed": 60.0, "delay": -1e-3}):
            with pytest.raises(PretravelError):
                Latch(**wrong)
        assert Latch(feed=60.0, delay=1e-3).delay == 1e-3

    def test_travel_is_measured_from_first_contact_along_the_approach(self) -> None:
        n = from_angles(np.radians([10.0, 60.0, 30.0]), np.radians([0.0, 100.0, 200.0]))
        a = -from_angles(np.radians([30.0, 40.0, 60.0]), np.radians([10.0, 90.0, 180.0]))
        nominal, travel = np.arange(9.0).reshape(3, 3), np.array([0.010, 0.020, 0.015])
        touches = Touches(nominal + 2.0 * n + travel[:, None] * a, n, a, nominal_points=nominal)
        assert travel_since_contact(touches, 2.0) == pytest.approx(travel)
        with pytest.raises(PretravelError, match="no nominal points"):
            travel_since_contact(replace(touches, nominal_points=None), 2.0)


class TestTips:
    def test_shear_of_the_contact_in_closed_form(self) -> None:
        """Johnson, 7.42b: E* Lambda / 4. Of two equal materials (2 - ν) / (2 (1 - ν))."""
        probe = load_probe("omp40-2")
        ball = probe.tip.material
        nu = ball.poissons_ratio
        same = predicted_tip(probe, workpiece=ball)
        assert same.shear_ratio == pytest.approx((2.0 - nu) / (2.0 * (1.0 - nu)), rel=1e-9)
        part = material("aluminium")
        stiff = [(1.0 - m.poissons_ratio**2) / m.youngs_modulus for m in (ball, part)]
        soft = [
            (2.0 - m.poissons_ratio) * 2.0 * (1.0 + m.poissons_ratio) / m.youngs_modulus
            for m in (ball, part)
        ]
        expected = sum(soft) / sum(stiff) / 4.0
        assert predicted_tip(probe, workpiece="aluminium").shear_ratio == pytest.approx(expected)
        steel = predicted_tip(probe, workpiece="steel").shear_ratio
        assert predicted_tip(probe).shear_ratio == steel != pytest.approx(expected)

    def test_where_the_probe_never_triggers_nothing_is_known(self) -> None:
        turn = probe_rotation(from_angles(0.5, 1.0)[0], rotation=0.3)
        tip = predicted_tip(load_probe("omp40-2")).turned(turn)
        n = np.vstack([turn[:, 2], -turn[:, 2]])
        state = tip.state(n)
        assert np.isfinite(state.force).tolist() == [True, False]
        assert np.isinf(state.force[1])
        assert np.isfinite(state.deflection).all(axis=1).tolist() == [True, False]
        assert np.isnan(state.deflection[1]).all()
        assert np.isfinite(state.compression).tolist() == [True, False]
        assert tip.supports(n).tolist() == [True, True]
        half = tip.excess(n[:1], 0.5 * state.force[:1])
        assert abs(half[0]) > 1e-3
        assert tip.excess(n[:1], state.force[:1]) == pytest.approx([0.0], abs=1e-12)

    def test_a_predicted_map_contains_its_forces_and_a_measured_one_does_not(self) -> None:
        turn = probe_rotation(from_angles(0.5, 1.0)[0], rotation=0.3)
        whole = replace(described_map("omp40-2", "analytic"), rotation=turn)
        known = mapped_tip(whole)
        assert isinstance(known, PredictedTip)
        assert known.has_forces
        n = from_angles(np.radians([20.0, 60.0]), [0.3, 2.0])
        expected = predicted_tip(load_probe("omp40-2")).state(n @ turn)
        assert known.state(n).force == pytest.approx(expected.force)
        assert known.state(n).deflection == pytest.approx(expected.deflection @ turn.T)
        assert (known.radius, known.shear_ratio) == (3.0, 0.0)

    def test_every_answer_of_a_measured_tip(self) -> None:
        made = replace(mean_map(0.01), tip_radius=2.5)
        tip = mapped_tip(made)
        assert isinstance(tip, MeasuredTip)
        assert (tip.radius, tip.shear_ratio, tip.has_forces) == (2.5, 0.0, False)
        n = np.array([UP, [0.0, 0.0, -1.0]])
        state = tip.state(n)
        assert np.isnan(state.force).all()
        assert state.compression.tolist() == [0.0, 0.0]
        assert state.deflection == pytest.approx(made.tip_displacement(n, extrapolate=True))
        assert tip.excess(n, np.ones(2)).tolist() == [0.0, 0.0]
        assert tip.supports(n).tolist() == [True, False]
        assert tip.supports(n[:0]).tolist() == []
        everywhere = tip_of(made, extrapolate=True)
        assert everywhere.supports(n).tolist() == [True, True]
        assert tip_of(made).supports(n).tolist() == [True, False]

    def test_only_a_probe_has_a_tip(self) -> None:
        ready = MeasuredTip(lobes(3))
        assert tip_of(ready) is ready
        with pytest.raises(PretravelError, match="a probe is needed, not a float"):
            tip_of(3.0)  # type: ignore[arg-type]
        almost = SimpleNamespace(state=1, radius=1, has_forces=1, supports=1)
        with pytest.raises(PretravelError, match="a probe is needed"):
            tip_of(almost)  # type: ignore[arg-type]

    def test_model_part_and_gravity_reach_the_tip(self) -> None:
        n = from_angles(np.radians([20.0, 60.0, 80.0]), [0.3, 2.0, 4.0])
        plain = tip_of("omp40-2").state(n)
        shen = tip_of("omp40-2", "shen").state(n)
        assert np.all(np.abs(shen.deflection - plain.deflection).max(axis=1) > 1e-5)
        soft = tip_of("omp40-2", workpiece=material("aluminium")).state(n)
        assert np.all(soft.compression > 1.05 * plain.compression)
        hung = tip_of("omp40-2", gravity=(0.0, 1.0, 0.0)).state(n)
        assert np.all(np.abs(hung.force - plain.force) > 1e-6)


class TestTargets:
    def test_targets_of_a_plan_have_its_points_normals_and_labels(self) -> None:
        region = InspectionRegion(u=(0.0, 6.0), v=(10.0, 14.0))
        plan = plan_inspection(FLOOR, grid=(2, 1), region=region)
        found = Targets.of(plan)
        assert found.points.tolist() == plan.point.tolist()
        assert found.normals.tolist() == [UP, UP]
        assert found.labels == ("point-1", "point-2")

    def test_points_are_finite_and_within_a_kilometre(self) -> None:
        Targets([[1e6, 0, 0]], [UP])
        for value, words in (
            (1.0001e6, "beyond a kilometre"), (math.inf, "not finite"), (math.nan, "not finite"),
        ):  # fmt: skip
            with pytest.raises(PretravelError, match=f"target 2: its point is {words}"):
                Targets([[0, 0, 0], [0, value, 0], [value, 0, 0]], [UP] * 3)
        with pytest.raises(PretravelError, match=r"shape \(2, 3\) and normals of shape \(1, 3\)"):
            Targets([[0, 0, 0], [0, 0, 1]], [UP])

    def test_targets_keep_what_they_were_given(self) -> None:
        a = [[0.6, 0.0, -0.8]]
        found = Targets([[1, 2, 3]], [UP], a, ("x",))
        assert found.approaches is not None
        assert found.approaches.tolist() == a
        assert Targets([[1, 2, 3]], [UP]).approaches.tolist() == [[0.0, 0.0, -1.0]]  # type: ignore[union-attr]
        assert len(Targets(np.zeros((4, 3)), [UP] * 4)) == 4
        for values in (found.points, found.normals, found.approaches):
            assert not values.flags.writeable
        assert Targets([[0, 0, 0], [1, 0, 0]], [UP, UP]).name(1) == "target 2"
