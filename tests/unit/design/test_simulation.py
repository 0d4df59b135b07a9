"""Simulated touches: their arguments, sentences and reports, from both sides of each limit."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement, probe_rotation
from pretravel.design.probing.simulation import (
    Latch,
    PartSetup,
    refuse_failures,
    reported,
    simulate,
    simulate_some,
    target_warnings,
    travel_since_contact,
)
from pretravel.design.probing.surface_touches import (
    MEANING,
    SurfaceTouches,
    TouchStatus,
    describe_failures,
)
from pretravel.drawing.inspection import InspectionRegion, plan_inspection
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.materials import material
from pretravel.surface.cad.part import Part
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches import Touches
from pretravel.touches.targets import Targets
from tests.support.example_maps import mean_map

UP = [0.0, 0.0, 1.0]
FLOOR = Plane([0, 0, 0], UP)


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
    assert found.pretravel == pytest.approx(found.travel - found.first_travel)
    ways = [math.dist(a, b) for a, b in zip(found.point, found.first_point, strict=True)]
    assert found.slide == pytest.approx(ways)


def test_outcomes_have_numbers_of_their_own() -> None:
    """As files and other programs know them."""
    assert [f"{int(status)} {status.name}" for status in TouchStatus] == [
        "0 CONVERGED", "1 MISSED", "2 EDGE", "3 OTHER_FACE", "4 STEM", "5 NEVER_TRIGGERS",
        "6 DOES_NOT_FIT", "7 NOT_CONVERGED", "8 OUTSIDE_MAP", "9 NOT_DETERMINED", "10 APEX",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "changes",
    [
        {"model": "shen"},
        {"gravity": (0.0, 1.0, 0.0)},
        {"setup": PartSetup(material=material("aluminium"))},
        {"latch": Latch(feed=300.0, delay=1e-3)},
        {"latch": Latch(noise=1e-4, rng=3)},
    ],
    ids=["model", "gravity", "material", "delay", "noise"],
)
def test_every_argument_of_a_simulation_has_an_effect(changes: dict[str, Any]) -> None:
    """The same in both functions, and another one than without the argument."""
    normals = np.array([[0.6, 0.0, 0.8], [0.0, 0.8, 0.6], [-0.8, 0.0, 0.6]])
    probe, ball, targets = load_probe("omp40-2"), Sphere([0, 0, 0], 20.0), (20.0 * normals, normals)
    plain = simulate(probe, ball, Targets(*targets)).positions
    found = simulate(probe, ball, Targets(*targets), **changes).positions
    some = simulate_some(probe, ball, Targets(*targets), **changes).touches
    assert some is not None
    assert np.array_equal(found, some.positions)
    # More than 1 nm: effects of a tenth of a micrometre and more.
    assert np.all(np.linalg.norm(found - plain, axis=1) > 1e-6)


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

    @pytest.mark.parametrize(
        ("off", "degrees", "words"),
        [
            ([0.0, 0.049, 5.0], [0.0, 0.98, 40.0], []),
            ([0.051, 0.02, 0.8, 7.0], [0.0] * 4, ["^2 of 4 targets are up to 0.8 mm .*is used$"]),
            ([0.051, 0.99, 7.0], [0.0] * 3, ["that point is used$"]),
            ([0.051, 1.01, 7.0], [0.0] * 3, [r"Are they in mm, in the part's frame, and .*\?$"]),
            ([0.0] * 3, [1.02, 0.5, 80.0], ["differ from the surface's by up to 1.0°"]),
            ([0.0] * 4, [1.02, 12.34, 3.0, 80.0], ["by up to 12.3°"]),
        ],
    )
    def test_warnings_of_targets_beside_the_surface(
        self, off: list[float], degrees: list[float], words: list[str]
    ) -> None:
        """Beside the first contact, or with normals that are turned; the last one failed."""
        count, away = len(off), np.array(off)
        done = SimpleNamespace(
            converged=np.arange(count) < count - 1,
            first_point=np.column_stack([0.6 * away, 0.8 * away, 0.0 * away]),
            first_normal=from_angles(np.radians(degrees), 0.7),
        )
        targets = Targets(np.zeros((count, 3)), [UP] * count)
        told = target_warnings(targets, done)  # type: ignore[arg-type]
        assert len(told) == len(words)
        for sentence, expected in zip(told, words, strict=True):
            assert re.search(expected, sentence)
        # A stem along its own normal is free; a wall is, and faces that lean over it are not.
        for polar, more in ((0.0, 0), (90.5, 0), (92.0, 1)):
            stem = from_angles(math.radians(polar), 0.3)[0]
            assert len(target_warnings(targets, done, stem)) == len(words) + more  # type: ignore[arg-type]

    CHECK = r"\. Check the points, normals and approaches"

    @pytest.mark.parametrize(
        ("height", "tilt", "status", "words"),
        [
            ([0.5, -1.02, 0.1], [0.0] * 3, "MISSED", "up to 1.02 mm from the surface: are they in"),
            ([0.5, -0.98, 0.1], [0.0] * 3, "MISSED", CHECK),
            ([0.0] * 3, [100.0, 91.0, 20.0], "MISSED", "point into the part; they must point out"),
            ([0.0] * 2, [100.0, 20.0], "MISSED", CHECK),
            ([0.0] * 3, [100.0, 20.0, 20.0], "MISSED", CHECK),
            ([0.0] * 2, [0.0] * 2, "NOT_CONVERGED", "a limit of the solver"),
            ([0.0] * 2, [0.0] * 2, "EDGE", "plan with a margin"),
        ],
    )
    def test_advice_is_on_the_targets_that_failed(
        self, height: list[float], tilt: list[float], status: str, words: str
    ) -> None:
        """Above a slope; a last one did not fail, and lies far away with its normal inwards."""
        turn = probe_rotation(from_angles(0.5, 1.0)[0], rotation=0.3).T
        n = from_angles(np.radians([*tilt, 175.0]), 0.3) @ turn
        points = np.array([[3.0 * k, 0.0, z] for k, z in enumerate([*height, 50.0])]) @ turn
        converged = np.arange(len(points)) == len(height)
        failed = SimpleNamespace(
            converged=converged,
            status=np.where(converged, TouchStatus.CONVERGED, TouchStatus[status]),
        )
        counted = f"{len(height)} of {len(points)} targets cannot be touched: {len(height)} "
        with pytest.raises(PretravelError, match=f"{counted}.*{words}"):
            refuse_failures(failed, Targets(points, n), Plane([0, 0, 0], turn[2]))  # type: ignore[arg-type]

    def test_only_where_no_other_failed_the_solver_is_limited(self) -> None:
        targets = Targets([[0, 0, 0], [1, 0, 0]], [UP, UP])
        status = np.array([TouchStatus.NOT_CONVERGED, TouchStatus.EDGE])
        mixed = SimpleNamespace(converged=np.zeros(2, dtype=bool), status=status)
        with pytest.raises(PretravelError, match=r"1 edge.*Check the points"):
            refuse_failures(mixed, targets, FLOOR)  # type: ignore[arg-type]
        refuse_failures(_outcomes(), Targets(np.zeros((3, 3)), [UP] * 3), FLOOR)


class TestSetups:
    def test_a_vector_of_the_machine_is_turned_into_the_part(self) -> None:
        turn = probe_rotation(from_angles(0.5, 1.0)[0], rotation=0.3)
        placed = PartSetup(placement=Placement(turn, np.zeros(3)))
        assert placed.to_part @ turn == pytest.approx(np.eye(3))
        assert not np.allclose(placed.to_part, turn, atol=0.1)

    def test_no_stylus_is_checked_and_no_friction_acts_without_a_wish(self) -> None:
        """A map has neither stylus nor forces: with one of them it would be refused."""
        targets = Targets(np.zeros((1, 3)), [UP])
        assert len(simulate(mean_map(0.01), FLOOR, targets)) == 1
        for setup, words in (
            (PartSetup(check_stylus=True), "described probe"),
            (PartSetup(friction=0.1), "described probe"),
            (PartSetup(clearance=-1.0), "the clearance"),
        ):
            with pytest.raises(PretravelError, match=words):
                simulate(mean_map(0.01), FLOOR, targets, setup=setup)
        with pytest.raises(PretravelError, match="faces of a part"):
            simulate("omp40-2", FLOOR, targets, setup=PartSetup(check_stylus=True))


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
        own = [0, 2]
        start = self.TARGETS.points[own] + [0.0, 0.0, 2.5]
        travelled = (done.travel[own] + 0.010)[:, None] * self.A[own]
        assert found.positions == pytest.approx(start + travelled)
        assert np.array_equal(found.nominal_points, done.first_point[own])  # type: ignore[arg-type]
        assert found.approach_directions == pytest.approx(self.A[own])
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
        assert np.array_equal(noise, Latch(noise=2e-3, rng=4).latched(travel) - travel)
        begun = Latch(noise=2e-3, rng=np.random.default_rng(4))
        assert np.array_equal(noise, begun.latched(travel) - travel)
        assert not np.any(noise == begun.latched(travel) - travel)  # it goes on
        assert np.array_equal(Latch(feed=300.0).latched(travel), travel)

    @pytest.mark.parametrize(
        "wrong", [{"delay": 1e-3}, {"noise": -1e-3}, {"feed": -1.0}, {"feed": 60.0, "delay": -1e-3}]
    )
    def test_a_delay_needs_a_feed_and_nothing_is_negative(self, wrong: dict[str, Any]) -> None:
        words = "give the feed too" if "feed" not in wrong and "delay" in wrong else "must|cannot"
        with pytest.raises(PretravelError, match=words):
            Latch(**wrong)
        assert Latch(feed=60.0, delay=1e-3).delay == 1e-3

    def test_the_signal_delay_of_a_map_is_in_its_touches(self) -> None:
        """4 ms at 300 mm/min are 20 µm; they were passed over."""
        ball, targets = Sphere([0, 0, 0], 12.5), Targets([[0.0, 0.0, 12.5]], [[0.0, 0.0, 1.0]])
        still = mean_map(0.01)
        delayed, fed = replace(still, delay=4e-3), replace(still, feed=50.0)
        fast = Latch(feed=300.0)
        heights = [simulate(each, ball, targets, latch=fast).positions[0, 2]
                   for each in (delayed, still)]  # fmt: skip
        assert heights[1] - heights[0] == pytest.approx(0.02, abs=1e-12)
        for made, latch, said in (
            (delayed, None, "give the feed"),
            (delayed, replace(fast, delay=1e-3), "count it twice"),
            (fed, Latch(feed=50.0, delay=1e-3), "at its feed of 50 mm/min, and would count it"),
            (fed, fast, "what it is at 300 mm/min is not known"),
        ):
            with pytest.raises(PretravelError, match=said):
                simulate(made, ball, targets, latch=latch)

    def test_travel_is_measured_from_first_contact_along_the_approach(self) -> None:
        n = from_angles(np.radians([10.0, 60.0, 30.0]), np.radians([0.0, 100.0, 200.0]))
        a = -from_angles(np.radians([30.0, 40.0, 60.0]), np.radians([10.0, 90.0, 180.0]))
        nominal, travel = np.arange(9.0).reshape(3, 3), np.array([0.010, 0.020, 0.015])
        touches = Touches(nominal + 2.0 * n + travel[:, None] * a, n, a, nominal_points=nominal)
        assert travel_since_contact(touches, 2.0) == pytest.approx(travel)
        with pytest.raises(PretravelError, match="no nominal points"):
            travel_since_contact(replace(touches, nominal_points=None), 2.0)


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
