"""Inspection plans have the requested number of points at the requested places."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import cKDTree

from pretravel.base.errors import PretravelError
from pretravel.design.probing.simulation import simulate_some
from pretravel.design.probing.surface_touches import TouchStatus
from pretravel.drawing.inspection import InspectionRegion, _grid, plan_inspection
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.local_geometry import Domain
from pretravel.surface.parametric import Convex, FunctionSurface
from pretravel.surface.shapes import Ellipsoid, Plane, Sphere
from pretravel.surface.shapes_of_revolution import Cylinder, Torus
from pretravel.touches.targets import Targets
from tests.support.examples import EXAMPLES

PART = EXAMPLES / "part.step"
WHOLE = InspectionRegion(margin=0.0)


def test_spacing_is_the_largest_distance_of_neighbours() -> None:
    """Every point of the face, except for the margin, has a point of the plan within the diagonal
    of a square of this side."""
    part, spacing = read_step_part(PART), 3.0
    plan = plan_inspection(part, spacing=spacing, region=WHOLE)
    face = part.faces[0]
    low, high = face.box
    anywhere = face.derivatives(np.random.default_rng(0).uniform(low, high, (3000, 2)))[0]
    assert cKDTree(plan.point).query(anywhere)[0].max() < spacing
    steps = np.linalg.norm(np.diff(plan.point, axis=0), axis=1)
    row = np.diff(plan.uv[:, 1]) == 0.0
    assert steps[row].max() <= spacing * 1.001


def test_by_curvature_chords_stay_low() -> None:
    """The tube of a torus is curved more than the ring: points are closer by the square root."""
    ring = Torus([0, 0, 0], 20.0, 5.0)
    chord, region = 0.05, InspectionRegion(margin=0.0, v=(0.1, 3.0))
    plan = plan_inspection(ring, chord=chord, region=region)
    distance = cKDTree(plan.point).query(plan.point, k=2)[0][:, 1]
    wanted = math.sqrt(8.0 * chord * 5.0)
    assert distance.min() >= 0.999 * wanted
    assert np.median(distance) < 1.5 * wanted
    finer = plan_inspection(ring, chord=chord / 4, region=region)
    assert len(finer) == pytest.approx(4 * len(plan), rel=0.2)


def test_what_looks_away_is_left_out() -> None:
    ball = Sphere([0, 0, 0], 10.0)
    plan = plan_inspection(ball, grid=(12, 9), region=WHOLE)
    assert plan.normal[:, 2].min() >= -1e-9
    # The 12 points of each pole are one place.
    assert plan.left_out == {"at the same place as another one": 22, "turned away": 12 * 3 + 1}
    sideways = plan_inspection(
        ball, grid=(12, 9), region=InspectionRegion(margin=0.0, axis=(1.0, 0.0, 0.0))
    )
    assert sideways.normal[:, 0].min() >= -1e-9


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 3.0, 4.0), (-0.2, 0.1, -0.05)])
def test_normals_are_turned_away_from_the_largest_angle_to_the_axis(
    axis: tuple[float, float, float],
) -> None:
    """Whatever the length of the axis; normals at the largest angle are kept."""
    up = np.asarray(axis) / np.linalg.norm(axis)
    aside = np.cross(up, [1.0, 2.0, 3.0])
    aside /= np.linalg.norm(aside)
    degrees = np.arange(0.0, 181.0, 7.5)
    angles = np.radians(degrees)
    normals = np.cos(angles)[:, None] * up + np.sin(angles)[:, None] * aside
    for largest in (0.0, 7.5, 90.0, 97.5, 180.0):
        region = InspectionRegion(max_polar=math.radians(largest), axis=axis)
        assert (
            region.turned_away(normals)[degrees != largest].tolist()
            == (degrees[degrees != largest] > largest).tolist()
        )
        if largest > 0.0:
            assert not region.turned_away(normals)[degrees == largest].any()


def test_a_full_turn_has_its_seam_once() -> None:
    rod = Cylinder([0, 0, 0], 5.0)
    region = InspectionRegion(margin=0.0, v=(0.0, 10.0), max_polar=math.pi)
    plan = plan_inspection(rod, grid=(6, 2), region=region)
    assert len(plan) == 12
    assert cKDTree(plan.point).query(plan.point, k=2)[0][:, 1].min() > 1.0
    half = InspectionRegion(margin=0.0, u=(0.5, 2.5), v=(0.0, 10.0), max_polar=math.pi)
    ends = plan_inspection(rod, grid=(3, 2), region=half).uv[:, 0]
    assert ends == pytest.approx([0.5, 1.5, 2.5] * 2)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "one way"),
        ({"grid": (2, 2), "spacing": 1.0}, "grid and spacing"),
        ({"grid": (2, 2), "chord": 1.0}, "grid and chord"),
        ({"spacing": 0.0}, "must be positive"),
        ({"spacing": 0.01}, "more than 1000000 points"),
        ({"chord": 1e-6}, "more than 400000 points"),
        ({"chord": 1e-9}, "must lie between 1e-06 and 100000 mm"),
        ({"grid": (0, 2)}, "0 x 2"),
        ({"grid": (2, 2), "region": InspectionRegion(margin=100.0)}, "no point is left"),
    ],
)
def test_errors_teach(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        plan_inspection(read_step_part(PART), **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"margin": -1.0}, "cannot be negative"),
        ({"u": (3.0, 1.0)}, "range of u .* must increase"),
        ({"v": (1.0, 1.0)}, "range of v .* must increase"),
        ({"v": (0.0, 2e6)}, "the range of v"),
        ({"axis": (0.0, math.nan, 1.0)}, "the axis"),
        ({"axis": (0.0, 0.0, 0.0)}, "has no direction"),
    ],
)
def test_regions_that_cannot_be(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        InspectionRegion(**arguments)  # type: ignore[arg-type]


def test_rows_of_a_region_have_the_spacing_of_the_region_alone() -> None:
    """3 x 4 mm of a plane far from the origin of its parameters, at most 1.1 mm apart: 3 x 4."""
    region = InspectionRegion(margin=0.0, u=(20.0, 23.0), v=(-14.0, -10.0))
    plan = plan_inspection(Plane([0, 0, 0], [0, 0, 1]), spacing=1.1, region=region)
    assert len(plan) == 12
    assert np.unique(plan.uv[:, 0].round(9)).tolist() == [20.5, 21.5, 22.5]
    assert np.unique(plan.uv[:, 1].round(9)).tolist() == [-13.5, -12.5, -11.5, -10.5]


def test_points_of_a_row_lie_in_the_middle_of_equal_arcs() -> None:
    """Rows of an ellipsoid, whose parameter is no arc: the arc before a point, by integration.

    The plan measures arcs by 200 chords, which are short by 1e-4 of them where they bend most.
    """
    a, b, spacing = 10.0, 4.0, 2.5
    region = InspectionRegion(margin=0.0, u=(0.2, 2.9), v=(1.0, 1.5))
    plan = plan_inspection(Ellipsoid([0, 0, 0], [a, b, 3.0]), spacing=spacing, region=region)
    rows = np.unique(plan.uv[:, 1])
    assert np.diff(rows) == pytest.approx(0.5 / len(rows))
    assert rows[0] == pytest.approx(1.0 + 0.25 / len(rows))
    for height in rows:

        def speed(u: float, width: float = math.sin(height)) -> float:
            return width * math.hypot(a * math.sin(u), b * math.cos(u))

        whole = quad(speed, 0.2, 2.9)[0]
        count = math.ceil(whole / spacing)
        arcs = [quad(speed, 0.2, u)[0] for u in plan.uv[plan.uv[:, 1] == height, 0]]
        middles = (np.arange(count) + 0.5) * whole / count
        assert arcs == pytest.approx(middles, abs=1e-3 * whole)


def test_grids_have_their_numbers_along_their_parameters() -> None:
    """u changes first; a single point lies in the middle; the largest number is of both."""
    floor = Plane([0, 0, 0], [0, 0, 1])
    region = InspectionRegion(u=(0.0, 6.0), v=(10.0, 14.0))
    uv = plan_inspection(floor, grid=(3, 2), region=region).uv
    assert uv.tolist() == [[0, 10], [3, 10], [6, 10], [0, 14], [3, 14], [6, 14]]
    uv = plan_inspection(floor, grid=(1, 3), region=region).uv
    assert uv.tolist() == [[3, 10], [3, 12], [3, 14]]
    plan = plan_inspection(floor, grid=(2, 1), region=region)
    assert plan.uv.tolist() == [[0, 12], [6, 12]]
    assert plan.labels == ("point-1", "point-2")
    assert plan.face.tolist() == [0, 0]
    for counts in ((1001, 1000), (1000, 1001), (1_000_001, 1), (1, 1_000_001), (2, 0)):
        with pytest.raises(PretravelError, match=r"it can have 1 to 1000000 points"):
            plan_inspection(floor, grid=counts, region=region)
    low, high = region.box(floor)
    assert len(_grid(low, high, (1000, 1000), [False, False])) == 1_000_000


def test_one_end_is_not_enough() -> None:
    """A plane with a range of v has no end along u, and the other way round."""
    floor = Plane([0, 0, 0], [0, 0, 1])
    for ranges, axis in (({}, "u: give a range of u"), ({"v": (0, 1)}, "u"), ({"u": (0, 1)}, "v")):
        with pytest.raises(PretravelError, match=f"no end along {axis}"):
            plan_inspection(floor, grid=(2, 2), region=InspectionRegion(**ranges))  # type: ignore[arg-type]
    for low, high in ((0.0, math.inf), (-math.inf, 1.0)):
        half = SimpleNamespace(domain=Domain((0.0, low), (1.0, high), (math.inf, math.inf)))
        with pytest.raises(PretravelError, match="no end along v"):
            InspectionRegion().box(half)  # type: ignore[arg-type]


@pytest.mark.parametrize("margin", [0.25, 1.0, None])
def test_margins_of_any_size_are_kept(margin: float | None) -> None:
    """Every point of a grid that is as far from the edges is kept, and no other."""
    part = read_step_part(PART)
    region = InspectionRegion() if margin is None else InspectionRegion(margin=margin)
    kept = 1.0 if margin is None else margin
    face = part.faces[0]
    edge = face.derivatives(face.edge_samples(0.02))[0]
    plan = plan_inspection(part, grid=(61, 41), region=region)
    away = cKDTree(edge).query(plan.point)[0]
    assert kept * (1.0 - 1e-6) <= away.min() < kept + 1.0
    everything = plan_inspection(part, grid=(61, 41), region=WHOLE)
    distance = cKDTree(edge).query(everything.point)[0]
    # An edge is sampled every fifth of the margin: distances are too long by at most 0.5 %.
    assert np.sum(distance >= 1.005 * kept) <= len(plan) <= np.sum(distance >= 0.995 * kept)
    (reason, count), *_ = plan.left_out.items()
    assert "margin" in reason
    assert count == 61 * 41 - len(plan)
    assert np.abs(face.local(plan.uv).point - plan.point).max() < 1e-12


def test_a_face_without_points_leaves_those_of_others(tmp_path: Path) -> None:
    """Of a block only the top looks up."""
    from netgen.occ import Box

    file = tmp_path / "block.step"
    Box((0, 0, 0), (10, 20, 30)).WriteStep(str(file))
    region = InspectionRegion(margin=0.0, max_polar=0.1)
    plan = plan_inspection(read_step_part(file), grid=(3, 2), region=region)
    assert plan.point[:, 2].tolist() == [30.0] * 6
    assert plan.left_out == {"turned away": 30}
    (number,) = set(plan.face.tolist())
    assert plan.labels == tuple(f"face{number}-{n}" for n in range(1, 7))


@pytest.mark.parametrize(("counts", "left"), [((6, 6), 16), ((3, 3), 1), ((5, 5), 9)])
@pytest.mark.parametrize("margin", [0.0, 1.0])
def test_points_on_the_ends_of_the_parameters_are_not_planned(
    counts: tuple[int, int], left: int, margin: float
) -> None:
    """The convex surface ends at u, v = ±1: a touch there slides off. All that is planned can be
    touched."""
    region = InspectionRegion(margin=margin)
    plan = plan_inspection(Convex(), grid=counts, region=region)
    assert len(plan) == left
    assert np.abs(plan.uv).max() < 1.0
    assert sum(plan.left_out.values()) == counts[0] * counts[1] - left
    touched = simulate_some("omp40-2", Convex(), Targets.of(plan)).outcomes
    assert touched.converged.all()


def test_margin_of_a_surface_with_ends_is_a_distance() -> None:
    """A strip of 40 x 2 mm with a margin of 0.5 mm, by hand: what is left lies in 39 x 1 mm. A
    sphere ends nowhere: its pole is kept, once, beside the four points of the equator."""
    strip = FunctionSurface(lambda u, v: (40.0 * u, 2.0 * v, 0.0 * u), (0.0, 1.0), (0.0, 1.0))
    region = InspectionRegion(margin=0.5)
    plan = plan_inspection(strip, grid=(81, 9), region=region)
    assert len(plan) == 79 * 5
    assert plan.point[:, 0].min() == pytest.approx(0.5)
    assert plan.point[:, 1].max() == pytest.approx(1.5)
    ball = plan_inspection(Sphere([0, 0, 0], 10.0), grid=(4, 3), region=region)
    assert len(ball) == 5


def test_a_target_on_the_end_of_the_parameters_is_said_to_lie_on_an_edge() -> None:
    end = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 0.0]])
    local = Convex().local(end)
    outcome = simulate_some("omp40-2", Convex(), Targets(local.point, local.normal)).outcomes
    status = [TouchStatus(value) for value in outcome.status.tolist()]
    assert status == [TouchStatus.EDGE, TouchStatus.EDGE, TouchStatus.CONVERGED]
