"""Each field of compensated points, of their summaries and of their budgets, by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, unit
from pretravel.base.errors import ExtrapolationError, PretravelError
from pretravel.base.frames import Placement
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply, embed
from pretravel.measurement.contact_slide import contact_slide
from pretravel.measurement.measured_sphere import measured_sphere
from pretravel.measurement.point_budget import budget_of_variances, point_budget
from pretravel.measurement.point_errors import PointErrors, errors_of_points
from pretravel.measurement.points import Points, joined_points, placed
from pretravel.measurement.points_summary import Moments, PointsSummary, TouchSummary
from pretravel.prediction.described_map import described_map
from pretravel.probing.simulation import simulate
from pretravel.probing.targets import Targets
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.fitting.sphere import fit_sphere
from tests.support.errors_by_trials import map_by_trials, sphere_by_trials
from tests.support.example_maps import mean_map

UP = np.array([[0.0, 0.0, 1.0]])


def _points(seed: int, count: int, **others: object) -> Points:
    """Points whose numbers are all different."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count, 3, 3))
    return replace(
        Points(
            rng.normal(size=(count, 3)), unit(rng.normal(size=(count, 3))), rng.normal(size=count),
            root @ root.transpose(0, 2, 1), rng.normal(size=count),
            tuple(f"{seed}.{i}" for i in range(count)), {"tip radius": rng.normal(size=count)},
            rng.normal(size=(count, 3)),
        ),
        **others,
    )  # fmt: skip


ARRAYS = ("positions", "normals", "pretravel", "covariance", "deviation", "uncompensated")


class TestPoints:
    def test_joined_points_are_those_of_the_parts_in_order(self) -> None:
        one, other = _points(1, 2), _points(2, 3)
        both = joined_points([one, other])
        for name in ARRAYS:
            expected = [*getattr(one, name), *getattr(other, name)]
            assert np.array_equal(getattr(both, name), expected), name
        assert both.labels == ("1.0", "1.1", "2.0", "2.1", "2.2")
        assert one.shared is not None
        assert other.shared is not None
        assert both.shared is not None
        expected = [*one.shared["tip radius"], *other.shared["tip radius"]]
        assert np.array_equal(both.shared["tip radius"], expected)

    @pytest.mark.parametrize("name", ["deviation", "uncompensated", "shared"])
    @pytest.mark.parametrize("first", [False, True])
    def test_what_one_part_does_not_state_the_whole_does_not(self, name: str, first: bool) -> None:
        parts = [_points(1, 2), _points(2, 3, **{name: None})]
        assert getattr(joined_points(parts[::-1] if first else parts), name) is None

    def test_one_part_is_the_whole(self) -> None:
        one = _points(1, 2)
        for name in ARRAYS:
            assert np.array_equal(getattr(joined_points([one]), name), getattr(one, name)), name

    def test_shared_errors_of_different_causes_are_not_joined(self) -> None:
        other = _points(2, 3, shared={"signal delay": np.ones(3)})
        assert joined_points([_points(1, 2), other]).shared is None

    def test_placed_points_turn_with_the_part(self) -> None:
        """By a quarter about z, (x, y, z) becomes (-y, x, z); then all points are moved."""
        part = _points(3, 4)
        turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        offset = np.array([10.0, 20.0, 30.0])
        found = placed(part, Placement(turn, offset))
        for name, shift in (("positions", offset), ("normals", 0.0), ("uncompensated", offset)):
            own = getattr(part, name)
            expected = np.column_stack([-own[:, 1], own[:, 0], own[:, 2]]) + shift
            assert np.allclose(getattr(found, name), expected, atol=1e-14), name
        c, of_turned = part.covariance, found.covariance
        assert np.allclose(of_turned[:, 0, 0], c[:, 1, 1], atol=1e-14)
        assert np.allclose(of_turned[:, 0, 1], -c[:, 1, 0], atol=1e-14)
        assert np.allclose(of_turned[:, 1, 2], c[:, 0, 2], atol=1e-14)
        assert found.standard_uncertainty == pytest.approx(part.standard_uncertainty)
        for name in ("pretravel", "deviation"):
            assert np.array_equal(getattr(found, name), getattr(part, name))
        assert placed(replace(part, uncompensated=None), Placement(turn, offset)).uncompensated is (
            None
        )

    def test_every_field_of_a_compensated_touch(self) -> None:
        """A map of 10 µm, a tip of 3 mm, an approach 60° off the normal: 20 µm of travel. A
        control takes the radius off along the normal alone."""
        a = np.array([[math.sqrt(0.75), 0.0, -0.5]])
        touches = Touches([[5.0, 6.0, 7.0]], UP, a, nominal_points=[[4.0, 4.0, 4.0]])
        found = apply(touches, mean_map(0.010))
        position = np.array([[5.0 - 0.020 * a[0, 0], 6.0, 7.0 + 0.010 - 3.0]])
        assert found.positions == pytest.approx(position, abs=1e-12)
        assert np.array_equal(found.normals, UP)
        assert found.pretravel == pytest.approx([0.010])
        assert found.deviation == pytest.approx([0.010], abs=1e-12)
        assert found.uncompensated is not None
        assert found.uncompensated == pytest.approx(np.array([[5.0, 6.0, 4.0]]))
        assert found.labels == ("1",)
        assert found.shared == {}
        assert apply(touches, mean_map(0.010), shared=False).shared is None
        assert apply(replace(touches, labels=("top",)), mean_map(0.010)).labels == ("top",)
        assert apply(replace(touches, numbered_from=7), mean_map(0.010)).labels == ("7",)
        two = Touches([[0.0, 0.0, 3.0]] * 2, UP[[0, 0]], numbered_from=7)
        assert apply(two, mean_map(0.010)).labels == ("7", "8")

    def test_delay_is_taken_off_the_point_but_not_off_what_the_control_reports(self) -> None:
        """60 mm/min for 4 ms are 4 µm of travel on."""
        made = replace(mean_map(0.010), delay=4e-3)
        found = apply(Touches([[0.0, 0.0, 2.986]], UP, feeds=[60.0]), made)
        assert found.positions == pytest.approx(np.zeros((1, 3)), abs=1e-12)
        assert found.uncompensated is not None
        assert found.uncompensated[0, 2] == pytest.approx(-0.014)

    def test_embedded_touches_state_what_they_were_given(self) -> None:
        a = unit([[0.3, 0.1, -1.0], [0.0, 0.0, -1.0]])
        n = np.repeat(UP, 2, axis=0)
        made = replace(mean_map(0.010), delay=4e-3)
        here = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
        touches = embed(here, n, made, approaches=a, feeds=[60.0, 120.0])
        assert touches.approaches == pytest.approx(a)
        assert touches.feeds == pytest.approx([60.0, 120.0])
        travel = 0.010 / -a[:, 2] + [0.004, 0.008]
        expected = here + travel[:, None] * a + 3.0 * n
        assert touches.positions == pytest.approx(expected, abs=1e-12)
        at_rest = embed(here, n, made, approaches=a)
        assert at_rest.feeds is None
        expected = here + (0.010 / -a[:, 2])[:, None] * a + 3.0 * n
        assert at_rest.positions == pytest.approx(expected, abs=1e-12)
        with pytest.raises(ExtrapolationError):
            embed([[0.0, 0.0, 0.0]], -UP, made)
        below = embed([[0.0, 0.0, 0.0]], -UP, made, extrapolate=True)
        assert below.positions == pytest.approx(-2.990 * UP)


class TestNominal:
    def test_touches_that_miss_are_named_up_to_five(self) -> None:
        """Approaches along a plane's outside never meet it: above, moving up."""
        floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        for lost in (1, 5, 6):
            normals = np.repeat(-UP, lost, axis=0)
            both = np.vstack([UP, normals])
            touches = Touches(3.0 * both, both)
            with pytest.raises(PretravelError) as told:
                apply(touches, mean_map(0.0), nominal=floor)
            named = ", ".join(f"touch {row}" for row in range(2, 2 + min(lost, 5)))
            assert f"{lost} of {lost + 1} touches do not" in str(told.value)
            assert f": {named}{'…' if lost > 5 else ''}. Is" in str(told.value)
            assert "beyond its edges" not in str(told.value)

    def test_touches_beyond_the_edges_of_the_nominal_are_counted(self, tmp_path: Path) -> None:
        """Two over the missing corner of an L, within its length and width; one far away."""
        from netgen.occ import Box

        solid = Box((0, 0, 0), (20, 20, 5)) - Box((8, 8, -1), (21, 21, 6))
        solid.WriteStep(str(tmp_path / "corner.step"))
        part = read_step_part(tmp_path / "corner.step")
        (top,) = (f.number for f in part.faces if f.bounds[:, 2].min() > 4.9)
        places = [[5.0, 5.0, 8.0], [9.0, 15.0, 8.0], [18.0, 9.2, 8.0], [50.0, 20.0, 8.0]]
        touches = Touches(places, np.repeat(UP, 4, axis=0))
        words = r"3 of 4 touches do not touch the nominal surface \(2 of them beyond its edges\)"
        with pytest.raises(PretravelError, match=words):
            apply(touches, mean_map(0.0), nominal=part.select(str(top)))

    def test_directions_outside_the_map_where_the_contact_is(self) -> None:
        floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        side = replace(mean_map(0.01), support=DirectionSupport([[1.0, 0.0, 0.0]]))
        touches = Touches([[0.0, 0.0, 2.99]], UP)
        with pytest.raises(ExtrapolationError, match="1 of 1 directions"):
            apply(touches, side, nominal=floor)
        found = apply(touches, side, nominal=floor, extrapolate=True)
        assert found.deviation == pytest.approx([0.0], abs=1e-12)
        assert contact_slide(touches, found, side) == pytest.approx(np.zeros((1, 3)), abs=1e-12)

    def test_a_deviation_moves_the_point_along_the_normal_of_a_curved_nominal(self) -> None:
        """A ball of 2.02 mm, touched and then compensated with a nominal one of 2 mm. Its
        compression is (1 + 3 / 2)^(1/3) times that on a plane, 0.3 µm more: found to a nanometre.
        """
        real, nominal = (Sphere([1.0, 2.0, 3.0], radius) for radius in (2.02, 2.0))
        n = from_angles(np.radians([20.0, 60.0, 85.0]), np.radians([10.0, 140.0, 260.0]))
        touches = simulate("omp40-2", real, Targets([1.0, 2.0, 3.0] + 2.02 * n, n))
        found = apply(touches, described_map("omp40-2", "analytic"), nominal=nominal)
        assert found.deviation == pytest.approx(np.full(3, 0.02), abs=1e-6)
        assert found.positions == pytest.approx([1.0, 2.0, 3.0] + 2.02 * found.normals, abs=1e-6)
        # Between first contact and trigger the ball slides down: the contact lies below.
        assert np.all(found.normals[:, 2] < n[:, 2])

    def test_directions_in_which_the_probe_never_triggers_are_refused(self) -> None:
        """Two of three, from below: the force lifts the whole probe."""
        below = from_angles(np.radians([10.0, 179.0, 178.0]), np.radians([0.0, 40.0, 80.0]))
        touches = Touches(15.0 * below, below, labels=("up", "one", "two"))
        with pytest.raises(ExtrapolationError, match=r"touch 2 \(one\).*not trigger \(2 such"):
            apply(touches, described_map("omp40-2", "analytic"), extrapolate=True)


class TestSlideOnThePart:
    def test_each_contact_slides_along_its_own_surface(self) -> None:
        """The way of the tip's centre: its displacement in the probe and a travel along the
        approach, so that it stays on the surface; touch by touch, with unequal directions."""
        made = described_map("omp40-2", "analytic")
        n = from_angles(np.radians([20.0, 50.0, 80.0]), np.radians([10.0, 140.0, 260.0]))
        a = unit(-n + [[0.3, 0.0, 0.1], [0.0, -0.4, 0.0], [0.1, 0.2, -0.3]])
        touches = Touches(15.0 * n, n, a)
        slide = contact_slide(touches, apply(touches, made), made)
        assert np.sum(slide * n, axis=1) == pytest.approx(np.zeros(3), abs=1e-12)
        back = slide - made.tip_displacement(n)
        assert np.cross(back, a) == pytest.approx(np.zeros((3, 3)), abs=1e-12)
        assert np.linalg.norm(slide, axis=1).min() > 1e-4


class TestSummaries:
    def test_deviations_before_compensation(self) -> None:
        """A point 5 µm above the nominal, pretravel 10 µm: by the radius alone, 5 µm below it."""
        touches = Touches(
            [[0.0, 0.0, 2.995], [0.0, 0.0, 2.996]], UP[[0, 0]], nominal_points=np.zeros((2, 3))
        )
        made = replace(mean_map(0.010), repeatability=3e-4)
        found = PointsSummary.of(apply(touches, made))
        assert found.pretravel == Moments.of(np.array([0.010, 0.010]))
        assert found.u.mean == pytest.approx(3e-4)
        for moments, low in ((found.deviation, 0.005), (found.before, -0.005)):
            assert moments is not None
            assert (moments.low, moments.high) == pytest.approx((low, low + 0.001), abs=1e-12)
        plain = PointsSummary.of(apply(replace(touches, nominal_points=None), made))
        assert plain.deviation is None
        assert plain.before is not None
        assert (plain.before.low, plain.before.high) == pytest.approx((-0.010, -0.010))
        assert PointsSummary.of(replace(apply(touches, made), uncompensated=None)).before is None

    def test_joined_summaries_are_those_of_joined_points(self) -> None:
        one, other = _points(1, 2), _points(2, 3)
        found = PointsSummary.of(one).joined(PointsSummary.of(other))
        expected = PointsSummary.of(joined_points([one, other]))
        assert len(found) == len(expected) == 5
        for name in ("pretravel", "u", "deviation", "before"):
            own, all_ = getattr(found, name), getattr(expected, name)
            for part in ("count", "low", "high", "mean", "squares"):
                assert getattr(own, part) == pytest.approx(getattr(all_, part)), (name, part)
        without = PointsSummary.of(_points(2, 3, deviation=None, uncompensated=None))
        for joined in (found.joined(without), without.joined(found)):
            assert joined.deviation is None
            assert joined.before is None

    def test_touches_state_range_obliqueness_middle_and_how_many_are_outside(self) -> None:
        n = from_angles(np.radians([0.0, 0.0, 120.0, 150.0, 140.0]), np.zeros(5))
        a = -n.copy()
        a[1] = [0.6, 0.0, -0.8]
        touches = Touches(3.0 * n, n, a, feeds=[60.0, 50.0, 80.0, 70.0, 55.0])
        made = mean_map(0.0)
        points = apply(touches, made, extrapolate=True)
        deviation = np.array([0.3, 0.1, 0.9, 0.2, 0.25])
        found = TouchSummary.of(touches, replace(points, deviation=deviation), made)
        assert [each.name for each in found.gross] == ["touch 3"]
        found = replace(found, gross=())
        assert found == TouchSummary(5, pytest.approx(0.8), (50.0, 80.0), pytest.approx(0.25), 3)
        bare = TouchSummary.of(replace(touches, feeds=None), points, made)
        assert bare.feeds is None
        assert bare.middle is None

    def test_what_both_state_is_joined(self) -> None:
        whole = TouchSummary(2, 0.9, (60.0, 80.0), 0.5, 1)
        for joined in (
            whole.joined(TouchSummary(3, 0.95, None, 0.1)),
            TouchSummary(3, 0.95, None, 0.1).joined(whole),
        ):
            assert joined == TouchSummary(5, 0.9, None, pytest.approx(0.26), 1)
        for joined in (
            whole.joined(TouchSummary(3, 0.7, (70.0, 90.0))),
            TouchSummary(3, 0.7, (70.0, 90.0)).joined(whole),
        ):
            assert joined == TouchSummary(5, 0.7, (60.0, 90.0), None, 1)


def _errors() -> PointErrors:
    n = from_angles(np.radians([10.0, 30.0, 50.0]), np.radians([0.0, 100.0, 200.0]))
    made = replace(
        mean_map(0.01), covariance=Covariance.independent([4e-8]), repeatability=3e-4,
        u_tip_radius=5e-4, repeatability_dof=17.0, fixed_scatter=2e-4,
    )  # fmt: skip
    a = -from_angles(np.radians([20.0, 60.0, 10.0]), np.radians([0.0, 100.0, 200.0]))
    closing = -np.sum(a * n, axis=1)
    return PointErrors(
        made, n, a, closing, np.array([1e-5, 2e-5, 3e-5]), np.array([4e-4, 5e-4, 6e-4])
    )


class TestErrors:
    def test_errors_of_some_points_are_their_rows(self) -> None:
        errors = _errors()
        rows = np.array([2, 0])
        some = errors.at(rows)
        for name in ("normals", "approaches", "closing", "by_delay", "delay_along_approach"):
            assert np.array_equal(getattr(some, name), getattr(errors, name)[[2, 0]]), name
        assert some.pretravel_map is errors.pretravel_map

    def test_budget_of_one_point_and_of_all(self) -> None:
        errors = _errors()
        delay = errors.delay_along_approach * errors.closing
        by_hand = np.array(
            [
                9e-8 * errors.closing**2, 4e-8 * errors.closing**2, 4e-8 - errors.by_delay**2,
                np.full(3, 25e-8), delay**2,
            ]
        )  # fmt: skip
        for row, which in ((None, "rms of 3 points"), (1, "point 2"), (0, "point 1")):
            budget = point_budget(errors, row)
            variances = by_hand.mean(axis=1) if row is None else by_hand[:, row]
            assert budget.result == f"a point along its normal, {which}"
            names = ("repeatability", "fixed scatter", "map", "tip radius", "signal delay")
            assert tuple(c.name for c in budget.components) == names
            assert [c.evaluation for c in budget.components] == ["A", "B", "B", "B", "B"]
            assert [c.standard_uncertainty for c in budget.components] == pytest.approx(
                np.sqrt(variances)
            )
            assert [c.dof for c in budget.components] == [17.0, *[math.inf] * 4]
            assert budget.combined == pytest.approx(math.sqrt(variances.sum()))

    @pytest.mark.parametrize("dof", [0.0, 1.0, 24.0])
    def test_unknown_degrees_of_freedom_are_infinite(self, dof: float) -> None:
        (noise, made) = budget_of_variances({"repeatability": 1.0, "map": 1.0}, dof, "x").components
        assert noise.dof == (dof or math.inf)
        assert made.dof == math.inf

    def test_factors_are_judged_by_the_whole_variance(self) -> None:
        """Mean and lobes as shares 0.965 and 0.035 of the map's variance: with a tip radius of the
        same variance as the map, the lobes are 0.0175 of the whole, less than a fiftieth; likewise
        with a repeatability of that variance, along the normal. With less, they count."""
        n = from_angles(0.5 * np.pi, np.arange(12) * np.pi / 6.0)
        basis = HarmonicBasis(np.array([[0, 0], [3, 3]]))
        mean, lobe = basis.design(n[:1])[0]
        variances = np.array([0.965 / mean**2, 0.035 / lobe**2]) * 4e-8
        made = PretravelMap(
            basis, np.array([0.012, 0.0]), Covariance.independent(variances),
            DirectionSupport(n), tip_radius=3.0,
        )  # fmt: skip
        touches = Touches(15.49 * n, n)
        for name in ("u_tip_radius", "repeatability"):
            for size, count in ((2e-4, 1), (1e-4, 2)):
                shared = apply(touches, replace(made, **{name: size})).shared  # type: ignore[arg-type]
                assert shared is not None
                assert sum(cause.startswith("map") for cause in shared) == count, (name, size)
        scattered = apply(touches, replace(made, fixed_scatter=2e-4)).shared
        assert scattered is not None
        assert list(scattered) == ["fixed scatter", "map 1"]
        assert scattered["fixed scatter"] == pytest.approx(np.full(12, 2e-4))

    def test_a_delay_that_is_known_moves_points_by_its_own_uncertainty(self) -> None:
        """60 mm/min for 3 ms are 3 µm of travel; the map is 1 µm less, over the cosine 0.8 of the
        approach 1.25 µm."""
        a = np.array([[0.6, 0.0, -0.8]])
        made = replace(
            mean_map(0.01), covariance=Covariance.independent([4e-8]), feed=60.0, delay=0.1,
            u_delay=3e-3, delay_effect=np.array([-1e-3]),
        )  # fmt: skip
        errors = errors_of_points(Touches([[0.0, 0.0, 3.0]], UP, a, feeds=[60.0]), UP, made)
        assert errors.by_delay == pytest.approx([-1e-3])
        assert errors.delay_along_approach == pytest.approx([3e-3 - 1.25e-3])
        assert errors.closing == pytest.approx([0.8])

    def test_one_trial_is_no_distribution(self) -> None:
        with pytest.raises(PretravelError, match="1 trials do not make a distribution"):
            map_by_trials(mean_map(0.01), UP, trials=1)
        assert map_by_trials(mean_map(0.01), UP, trials=2).tolist() == [[0.01], [0.01]]


class TestSphere:
    N = fibonacci_cap(6, 0.5 * np.pi)

    def _measured(self) -> tuple[Points, PretravelMap, Touches]:
        made = replace(
            mean_map(0.010), covariance=Covariance.independent([1e-8]), repeatability=3e-4,
            u_tip_radius=2e-4,
        )  # fmt: skip
        touches = Touches(np.array([5.0, 6.0, 7.0]) + 15.49 * self.N, self.N)
        return apply(touches, made), made, touches

    def test_every_field(self) -> None:
        """Against the design matrix by hand: an error along n moves centre and radius by the least
        squares of n and one. Errors common to all points move the radius alone."""
        points, made, touches = self._measured()
        ball = measured_sphere(touches, points, made)
        assert ball.center == pytest.approx([5.0, 6.0, 7.0])
        assert ball.diameter == pytest.approx(25.0)
        assert ball.points is points
        assert list(ball.sources) == ["repeatability", "map", "tip radius"]
        design = np.column_stack([self.N, np.ones(6)])
        expected = 9e-8 * np.linalg.inv(design.T @ design)
        expected[3, 3] += 1e-8 + 4e-8
        assert ball.covariance == pytest.approx(expected, abs=1e-13)
        assert [c.evaluation for c in ball.budget.components] == ["A", "B", "B"]
        assert [c.sensitivity for c in ball.budget.components] == [2.0, 2.0, 2.0]
        assert ball.budget.result == "diameter of the sphere, compensated"

    def test_every_trial_is_fitted_by_itself(self) -> None:
        """More trials than are fitted at once; against the fit of single spheres."""
        from tests.support.errors_by_trials import sphere_radii

        rng = np.random.default_rng(4)
        whole = 12.5 * self.N
        moved = whole + 1e-3 * rng.normal(size=(4100, 6, 3))
        radii = sphere_radii(moved, fit_sphere(whole))
        for row in (0, 1, 1999, 2000, 2001, 3999, 4000, 4099):
            assert radii[row] == pytest.approx(fit_sphere(moved[row]).radius, abs=1e-9), row

    def test_trials_are_as_asked_for(self) -> None:
        """Half of a normal distribution lies within 0.6745 standard deviations; of 20 000 trials
        the quartiles of 1.36 standard errors each are known to 0.0136 / 0.6745, 2 %: here 6 %."""
        points, made, touches = self._measured()
        ball = measured_sphere(touches, points, made)
        asked = {"probability": 0.5, "digits": 1, "most_trials": 20_000}
        first, judged = sphere_by_trials(ball, seed=3, **asked)  # type: ignore[arg-type]
        assert first.trials == 20_000
        low, high = first.symmetric_interval[0]
        assert (high - low) / 2.0 == pytest.approx(0.6745 * ball.budget.combined, rel=0.06)
        assert judged.difference.shape == (1, 2)
