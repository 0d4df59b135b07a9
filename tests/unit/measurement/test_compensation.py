"""Compensated touches: every field by hand, the inverse, and contacts on a nominal surface."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import from_angles, unit
from pretravel.base.errors import ExtrapolationError, PretravelError
from pretravel.design.probing.simulation import simulate, simulate_some
from pretravel.drawing.features.contact_slides import contact_slide
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply, embed
from pretravel.prediction.described_maps import described_map
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches import Touches
from pretravel.touches.targets import Targets
from tests.support.example_maps import mean_map

UP = np.array([[0.0, 0.0, 1.0]])
FLOOR = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])


def test_every_field_of_a_compensated_touch() -> None:
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
    bare = apply(replace(touches, labels=("top",), nominal_points=None), mean_map(0.010))
    assert (bare.labels, bare.deviation) == (("top",), None)
    two = Touches([[0.0, 0.0, 3.0]] * 2, UP[[0, 0]], numbered_from=7)
    assert apply(two, mean_map(0.010)).labels == ("7", "8")


def test_delay_is_taken_off_the_point_but_not_off_what_the_control_reports() -> None:
    """60 mm/min for 4 ms are 4 µm of travel on."""
    made = replace(mean_map(0.010), delay=4e-3)
    found = apply(Touches([[0.0, 0.0, 2.986]], UP, feeds=[60.0]), made)
    assert found.positions == pytest.approx(np.zeros((1, 3)), abs=1e-12)
    assert found.uncompensated is not None
    assert found.uncompensated[0, 2] == pytest.approx(-0.014)


def test_embedded_touches_state_what_they_were_given() -> None:
    a = unit([[0.3, 0.1, -1.0], [0.0, 0.0, -1.0]])
    n = np.repeat(UP, 2, axis=0)
    made = replace(mean_map(0.010), delay=4e-3)
    here = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    for feeds, delay in (([60.0, 120.0], [0.004, 0.008]), (None, [0.0, 0.0])):
        touches = embed(here, n, made, approaches=a, feeds=feeds)
        assert touches.approaches == pytest.approx(a)
        assert touches.feeds is None if feeds is None else touches.feeds == pytest.approx(feeds)
        travel = 0.010 / -a[:, 2] + delay
        expected = here + travel[:, None] * a + 3.0 * n
        assert touches.positions == pytest.approx(expected, abs=1e-12)
    with pytest.raises(ExtrapolationError):
        embed([[0.0, 0.0, 0.0]], -UP, made)
    below = embed([[0.0, 0.0, 0.0]], -UP, made, extrapolate=True)
    for points in ([[0.0, 0.0, 0.0]], [[0.0, 0.0]] * 2):
        with pytest.raises(PretravelError, match=r"expected \(n, 3\) each"):
            embed(points, np.repeat(UP, 2, axis=0), made)
    assert below.positions == pytest.approx(-2.990 * UP)


@pytest.mark.parametrize("nominal", [None, FLOOR])
def test_directions_outside_the_map(nominal: Plane | None) -> None:
    side = replace(mean_map(0.01), support=DirectionSupport([[1.0, 0.0, 0.0]]))
    touches = Touches([[0.0, 0.0, 2.99]], UP, nominal_points=[[0.0, 0.0, 0.0]])
    with pytest.raises(ExtrapolationError, match="1 of 1 directions"):
        apply(touches, side, nominal=nominal)
    found = apply(touches, side, nominal=nominal, extrapolate=True)
    assert found.deviation == pytest.approx([0.0], abs=1e-12)
    assert contact_slide(touches, found, side) == pytest.approx(np.zeros((1, 3)), abs=1e-12)


class TestNominal:
    @pytest.mark.parametrize("lost", [1, 5, 6])
    def test_touches_that_miss_are_named_up_to_five(self, lost: int) -> None:
        """Approaches along a plane's outside never meet it: above, moving up."""
        both = np.vstack([UP, np.repeat(-UP, lost, axis=0)])
        with pytest.raises(PretravelError) as told:
            apply(Touches(3.0 * both, both), mean_map(0.0), nominal=FLOOR)
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


class TestSlide:
    @pytest.mark.parametrize(("polar", "tilt"), [(5.0, 20.0), (40.0, 0.0), (75.0, 20.0)])
    def test_on_a_plane_it_is_that_of_the_simulated_touch(self, polar: float, tilt: float) -> None:
        """The simulation solves the contact; on a plane without friction both are exact."""
        normal = from_angles(np.radians(polar), np.radians(25.0))[0]
        approach = -from_angles(np.radians(polar + tilt), np.radians(25.0))[0]
        made = described_map("omp40-2", "analytic")
        targets = Targets([[0.0, 0.0, 0.0]], [normal], [approach])
        simulated = simulate_some(made, Plane([0.0, 0.0, 0.0], normal), targets)
        assert simulated.touches is not None
        points = apply(simulated.touches, made, extrapolate=True)
        slide = contact_slide(simulated.touches, points, made)[0]
        # The map's iteration of the contact ends below a nanometre.
        expected = simulated.outcomes.slide[0]
        assert np.linalg.norm(slide) == pytest.approx(expected, abs=2e-6)
        assert not tilt or expected > 1e-4

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


def test_a_nominal_surface_in_words_is_refused_by_name() -> None:
    touches = Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]])
    with pytest.raises(PretravelError, match="read_part or parse_surface makes it"):
        apply(touches, mean_map(0.005), nominal="plane:polar=0,azimuth=0")  # type: ignore[arg-type]
