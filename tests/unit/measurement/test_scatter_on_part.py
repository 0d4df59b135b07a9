"""Touches that scatter more on the part than on the reference: in u where repeats show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply
from pretravel.measurement.point_errors import point_sources, total_covariance
from pretravel.measurement.points import Points, joined_points
from pretravel.measurement.points_summary import TouchSummary
from pretravel.measurement.scatter_on_part import ScatterOnPart, ScatterSums, scatter_of_repeats
from pretravel.measurement.touch_scatter import TouchScatter
from pretravel.touches import Touches
from tests.support.example_maps import mean_map

OF_MAP, OF_PART = 3e-4, 1.5e-3
MAP = replace(
    mean_map(0.010),
    support=DirectionSupport(fibonacci_cap(200, 1.8)),
    repeatability=OF_MAP,
    repeatability_dof=50.0,
)
SIDES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def _compensated(
    places: np.ndarray, normals: np.ndarray, errors: np.ndarray
) -> tuple[Touches, Points]:
    """Of a ball of 6 mm and a pretravel of 10 µm."""
    at = places + (3.0 - 0.010 + errors)[:, None] * normals
    touches = Touches(at, normals)
    return touches, apply(touches, MAP)


def _said(touches: Touches, points: Points) -> str:
    return " ".join(TouchSummary.of(touches, points, MAP).warnings(MAP))


@pytest.mark.parametrize("scatter", [OF_MAP, OF_PART])
def test_repeated_places_show_the_scatter_of_the_part(scatter: float) -> None:
    """Twelve places twice. χ² was 20 with five times the scatter of the map, and nothing said."""
    rng, chi = np.random.default_rng(41), []
    for _ in range(20):
        normals = np.repeat(fibonacci_cap(12, 1.4), 2, axis=0)
        errors = scatter * rng.standard_normal(24)
        touches, points = _compensated(50.0 * normals, normals, errors)
        chi.append(np.mean((errors / points.standard_uncertainty) ** 2))
        assert ("same place" in _said(touches, points)) == (scatter > OF_MAP)
    # Of 20 sets with 12 degrees of freedom of s²: 1.2 ± 0.15; 0.9 with the u of the map's mean.
    assert 0.7 < np.mean(chi) < 1.6


@pytest.mark.parametrize("times", [1, 2])
def test_single_touches_leave_the_scatter_of_the_part_open(times: int) -> None:
    """On a curved surface; of repeats it is known."""
    normals = np.repeat(fibonacci_cap(12, 1.4), times, axis=0)
    touches, points = _compensated(50.0 * normals, normals, OF_MAP * np.ones(12 * times))
    said = " ".join(TouchSummary.of(touches, points, MAP).notes(MAP))
    assert ("repeatability on the reference (0.3 µm); that on the part" in said) == (times == 1)


@pytest.mark.parametrize(
    ("scatter", "bow", "touches", "said"),
    [
        (OF_MAP, 0.0, 8, False),
        (OF_PART, 0.0, 8, True),
        (OF_MAP, 3e-3, 16, False),
        (OF_PART, 3e-3, 16, True),
    ],
)
def test_faces_show_a_scatter_that_u_does_not_contain(
    scatter: float, bow: float, touches: int, said: bool
) -> None:
    """Four faces that are bowed or not: a bow of faces with many touches is no scatter."""
    rng = np.random.default_rng(43)
    normals = np.repeat(SIDES, touches, axis=0)
    beside = rng.uniform(-30.0, 30.0, normals.shape) * (1.0 - np.abs(normals))
    bulge = bow * np.sum((beside / 30.0) ** 2, axis=1)
    errors = bulge + scatter * rng.standard_normal(len(normals))
    given, points = _compensated(40.0 * normals + beside, normals, errors)
    assert ("about the plane faces" in _said(given, points)) == said
    assert points.standard_uncertainty.max() < 1.5 * OF_MAP


def test_one_wrong_repeat_is_not_the_scatter_of_all() -> None:
    """A false trigger of 20 µm at one of six places is no reason for u of all points."""
    rng, normals = np.random.default_rng(47), np.repeat(fibonacci_cap(6, 1.4), 2, axis=0)
    errors = OF_MAP * rng.standard_normal(12)
    errors[3] += 0.020
    _, points = _compensated(50.0 * normals, normals, errors)
    assert points.standard_uncertainty.max() < 1.5 * OF_MAP


def test_parts_of_a_table_show_it_together() -> None:
    """Three places twice with twice the scatter show nothing, twenty times as many do."""
    alone = ScatterOnPart(dof_of_map=50.0)
    few = replace(alone, repeats=replace(alone.repeats, squares=1.08e-6, expected=2.7e-7, dof=3.0))
    assert few.larger is None
    many = few
    for _ in range(19):
        many = many.joined(few)
    assert many.larger is not None
    assert many.larger.deviation == pytest.approx(few.repeats.deviation)


def test_a_map_of_few_touches_knows_its_scatter_less_well_than_the_part() -> None:
    """s² of 7 and of 12 degrees of freedom together, where 12 show twice the scatter by chance."""
    few = ScatterOnPart(ScatterSums(12 * 4e-6, 12 * 1e-6, 12.0), dof_of_map=7.0)
    assert few.larger is not None
    assert few.larger.deviation == pytest.approx(1e-3 * np.sqrt((7 * 1.0 + 12 * 4.0) / 19))
    assert not few.sentences()  # F(12, 7) exceeds 4 in one of 30
    assert replace(few, dof_of_map=13.0).larger is None
    assert replace(few, repeats=ScatterSums(12 * 0.9e-6, 12 * 1e-6, 12.0)).larger is None
    # Four places four times, off by 0.6 µm · (1, -1, 1, -1): dof 12, s = 0.69 µm.
    normals = np.repeat(fibonacci_cap(4, 1.4), 4, axis=0)
    at = 50.0 * normals + (2.99 + 0.6e-3 * np.resize([1.0, -1.0], 16))[:, None] * normals
    u = apply(Touches(at, normals), replace(MAP, repeatability_dof=7.0)).standard_uncertainty
    whole = np.sqrt((7 * OF_MAP**2 + 16 * 0.6e-3**2) / 19)
    others = apply(Touches(at, normals), replace(MAP, repeatability=0.0)).standard_uncertainty
    assert u == pytest.approx(np.hypot(whole, others), rel=0.01)


def _pairs(rng: np.random.Generator, count: int = 12) -> tuple[np.ndarray, np.ndarray]:
    """Normals of places that are touched twice, and errors with the scatter of the part."""
    normals = np.repeat(fibonacci_cap(count, 1.4), 2, axis=0)
    return normals, OF_PART * rng.standard_normal(2 * count)


def test_the_points_carry_what_their_repeats_showed() -> None:
    """Report, budgets and joined points use the comparison of the compensation."""
    normals, errors = _pairs(np.random.default_rng(53))
    touches, points = _compensated(50.0 * normals, normals, errors)
    assert points.scatter is not None
    assert points.scatter.larger is not None
    seen = points.scatter.larger.deviation
    own = np.sqrt(np.mean(np.diff(errors.reshape(-1, 2), axis=1) ** 2) / 2.0)
    assert seen == pytest.approx(own, rel=0.02)  # the pretravel of inclined touches is that of all
    summary = TouchSummary.of(touches, points, MAP)
    assert summary.scatter.larger == points.scatter.larger
    sources = point_sources(touches, points, MAP)
    whole = np.diag(total_covariance(sources).matrix)
    np.testing.assert_allclose(whole, points.standard_uncertainty**2, rtol=1e-9)
    both = joined_points([points, points]).scatter
    assert both is not None
    assert both.repeats.dof == 24.0


def test_a_separation_is_widened_by_the_repeats_of_the_part() -> None:
    """u of the points was that of the separation, and the report said that it was larger."""
    around = np.arange(4) * 0.5 * np.pi
    half = np.full(4, 0.5 * OF_MAP**2)
    separated = TouchScatter(around, half, around, half)
    normals, errors = _pairs(np.random.default_rng(59))
    touches, _ = _compensated(50.0 * normals, normals, errors)
    points = apply(touches, MAP, scatter=separated)
    assert points.scatter is not None
    assert "same place" in _said(touches, points)
    assert points.scatter.larger is not None
    seen = points.scatter.larger.deviation
    # The map and the tip radius add less than a tenth to the variance of a touch.
    assert points.standard_uncertainty.min() == pytest.approx(seen, rel=0.05)


UP = np.array([0.0, 0.0, 1.0])


def test_which_touches_repeat_a_place() -> None:
    """10 µm apart along the face, 30 µm along the normal, the same normal: squares by hand."""
    places = np.array(
        [
            [0.0, 0.0, 0.0], [0.004, 0.0, 0.003], [0.0, 0.004, 0.009],  # three of one place
            [1.0, 0.0, 0.0], [1.009, 0.0, 0.001],  # two
            [2.0, 0.0, 0.0], [2.011, 0.0, 0.001],  # beside each other
            [3.0, 0.0, 0.0], [3.0, 0.0, 0.040],  # one is a gross error
            [4.0, 0.0, 0.0], [4.0, 0.0, 0.0],  # other normals
        ]
    )  # fmt: skip
    normals = np.tile(UP, (11, 1))
    normals[10] = [0.0015, 0.0, np.sqrt(1.0 - 0.0015**2)]
    expected = np.full(11, 1e-6)
    expected[0] = 4e-6
    found = scatter_of_repeats(places, normals, expected, 50.0)
    assert found.dof_of_map == 50.0
    assert found.repeats.dof == 3.0
    # Of 0, 3 and 9 µm about 4 µm: 16 + 1 + 25; of 0 and 1 µm: a half.
    assert found.repeats.squares == pytest.approx(42.5e-6)
    assert found.repeats.expected == pytest.approx(4e-6 + 1e-6)  # two of three times 2, and 1
    assert found.repeats.of_map == pytest.approx(np.sqrt(5e-6 / 3.0))
    for empty in (np.zeros(11), np.append(np.zeros(1), expected[1:])):
        assert scatter_of_repeats(places, normals, empty, 50.0).repeats.dof == 0.0
    assert scatter_of_repeats(places[:1], normals[:1], expected[:1], 50.0).repeats.dof == 0.0


def test_a_wrong_repeat_is_left_out_of_three_places_not_of_two() -> None:
    for places, dof in ((2, 2.0), (3, 2.0), (12, 11.0)):
        at = np.repeat(np.arange(places), 2)[:, None] * np.array([5.0, 0.0, 0.0])
        at[1::2, 2] = 1e-3 * np.where(np.arange(places) == 0, 20.0, 1.0)
        found = scatter_of_repeats(
            at, np.tile(UP, (2 * places, 1)), np.full(2 * places, 5e-7), 50.0
        )
        assert found.repeats.dof == dof
    # Where all places scatter so, none is the odd one.
    at[1::2, 2] = 20e-3
    found = scatter_of_repeats(at, np.tile(UP, (24, 1)), np.full(24, 5e-7), 50.0)
    assert found.repeats.dof == 12.0


def test_a_scatter_is_larger_beyond_chance() -> None:
    """F with 4 and 20 degrees of freedom exceeds 7.10 in one of 1000 (tables)."""
    for ratio, larger in ((7.0, False), (7.2, True)):
        sums = ScatterSums(ratio * 4e-6, 4e-6, 4.0)
        assert sums.exceeds(20.0) == larger
        assert sums.exceeds(20.0, 2.7) is False  # 2.7 squared is 7.29
    # 4.62 (χ² / 4) where the dof of the map are not known.
    assert not ScatterSums(4.55 * 4e-6, 4e-6, 4.0).exceeds(0.0)
    assert ScatterSums(4.70 * 4e-6, 4e-6, 4.0).exceeds(0.0)
    assert not ScatterSums().exceeds(20.0)


def test_faces_are_told_by_their_normals_and_heights() -> None:
    """Two steps 0.09 mm apart and a side: tilts are no scatter, of 12 touches bows neither."""
    rng = np.random.default_rng(67)
    grid = rng.uniform(-20.0, 20.0, (36, 2))
    tilted = 1e-4 * grid[:, 0]  # of the steps: less than their gap
    heights = np.concatenate([0.001 * grid[:12, 0], 0.09 + 0.0 * grid[:12, 0], tilted[24:]])
    bows = np.concatenate([2e-5 * grid[:12, 1] ** 2, 1e-5 * grid[12:24, 0] * grid[12:24, 1]])
    points = np.column_stack([grid[:24], heights[:24] + bows])
    side = np.column_stack([heights[24:] - 30.0, grid[24:]])
    places, normals = np.vstack([points, side]), np.repeat([UP, -np.eye(3)[0]], [24, 12], axis=0)
    expected = np.full(36, 1e-8)
    none = ScatterOnPart(dof_of_map=50.0)
    found = none.with_faces(places, normals, expected)
    assert found.faces.dof == 3 * (12 - 6)
    assert found.faces.squares < 1e-16
    assert not found.sentences()
    rough = 2e-3 * rng.standard_normal(36)
    found = none.with_faces(places + rough[:, None] * normals, normals, expected)
    assert found.faces.deviation == pytest.approx(2e-3, rel=0.5)
    assert (
        f"scatter by {found.faces.deviation * 1e3:.2g} µm about the plane faces"
        in found.sentences()[0]
    )
    assert found.faces.of_map == pytest.approx(1e-4)
    # Fewer than 12 touches: planes alone; fewer than 5: no face.
    few = np.r_[0:4, 12:19]
    found = none.with_faces(places[few], normals[few], expected[few])
    assert found.faces.dof == 7 - 3
    assert found.faces.squares > 1e-8
    # Repeats that show as much explain it.
    known = replace(none, repeats=ScatterSums(12 * 4e-6, 12 * 1e-8, 12.0))
    found = known.with_faces(places + rough[:, None] * normals, normals, expected)
    assert found.faces.of_map == pytest.approx(2e-3)
    assert len(found.sentences()) == 1
    assert "same place" in found.sentences()[0]
