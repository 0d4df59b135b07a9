"""No ball passes a wall, edges are at their places, and touches do not affect each other."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.base.errors import PretravelError
from pretravel.design.probing.obstacles import StylusOutline, stylus_outline
from pretravel.design.probing.simulation import simulate_some
from pretravel.design.probing.surface_touches import TouchStatus
from pretravel.design.probing.tip import PredictedTip, mapped_tip, predicted_tip
from pretravel.design.probing.touching import touch
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict, predicted_map
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.shapes import Sphere
from pretravel.surface.shapes_of_revolution import Torus
from pretravel.touches.targets import Targets


@cache
def _tip(radius: float = 3.0) -> PredictedTip:
    return replace(predicted_tip(load_probe("omp40-2")), radius=radius)


def _part(solid: Any, folder: Path) -> Part:
    file = folder / "made.step"
    solid.WriteStep(str(file))
    return read_step_part(file)


UP = np.array([[0.0, 0.0, 1.0]])


def _status(part: Part, points: np.ndarray, normal: Any, radius: float, **kwargs: Any) -> Any:
    normals = np.repeat(np.atleast_2d(normal), len(points), axis=0)
    return touch(_tip(radius), part, Targets(points, normals), **kwargs).status


class TestObstacles:
    """Parts much larger than the ball, which fits between points 1/150 of their size apart."""

    @pytest.mark.parametrize("radius", [1.0, 3.0])
    def test_beside_a_wall(self, radius: float, tmp_path: Path) -> None:
        """Floor targets nearer to the wall than the radius are blocked, more distant are free."""
        from netgen.occ import Box

        part = _part(Box((0, 0, 0), (400, 400, 5)) + Box((-5, 0, 0), (0, 400, 30)), tmp_path)
        rng = np.random.default_rng(0)
        y, five = rng.uniform(5, 395, 200), np.full(200, 5.0)
        near = np.column_stack([rng.uniform(0.05, 0.99, 200) * radius, y, five])
        assert np.all(_status(part, near, UP, radius) == TouchStatus.OTHER_FACE)
        far = np.column_stack([rng.uniform(1.001, 3.0, 200) * radius, y, five])
        assert np.all(_status(part, far, UP, radius) == TouchStatus.CONVERGED)

    @pytest.mark.parametrize("radius", [1.0, 3.0])
    def test_behind_a_rib(self, radius: float, tmp_path: Path) -> None:
        """The rib, 1 mm thick and 3 mm before the wall, is on the approach of five millimetres."""
        from netgen.occ import Box

        solid = Box((0, 0, 0), (300, 300, 5)) + Box((-5, 0, 0), (0, 300, 30))
        part = _part(solid + Box((3, 0, 0), (4, 300, 30)), tmp_path)
        rng = np.random.default_rng(1)
        wall = np.column_stack([np.zeros(50), rng.uniform(5, 295, 50), rng.uniform(12, 20, 50)])
        status = _status(part, wall, [1.0, 0.0, 0.0], radius, clearance=5.0)
        assert np.all(status == TouchStatus.OTHER_FACE)

    @pytest.mark.long
    def test_under_a_thin_roof(self, tmp_path: Path) -> None:
        """0.2 mm thick, 1 mm above the floor, on a part of 600 mm; for ball and stem."""
        from netgen.occ import Box

        solid = Box((0, 0, 0), (600, 600, 5)) + Box((-5, 0, 0), (0, 600, 30))
        part = _part(solid + Box((-5, 0, 9), (600, 600, 9.2)), tmp_path)
        rng = np.random.default_rng(2)
        floor = np.column_stack([rng.uniform(20, 590, (60, 2)), np.full(60, 5.0)])
        assert np.all(_status(part, floor, UP, 3.0) == TouchStatus.OTHER_FACE)
        # A ball of 1.5 mm fits under it; its stem of 1 mm would pass through it.
        free = _status(part, floor, UP, 0.75, clearance=0.5)
        assert np.all(free == TouchStatus.CONVERGED)
        stem = StylusOutline(UP[0], np.array([[0.0, 50.0]]), np.array([0.5]))
        blocked = _status(part, floor, UP, 0.75, clearance=0.5, stylus=stem)
        assert np.all(blocked == TouchStatus.STEM)

    @pytest.mark.long
    @pytest.mark.parametrize("clearance", [16.0, 20.0, 30.0])
    def test_down_a_slot_that_is_hardly_wider(self, clearance: float, tmp_path: Path) -> None:
        """2.004 mm for a ball of 2 mm: it can slide down along both walls as far as the bridge."""
        from netgen.occ import Box

        block = Box((0, 0, 0), (40, 40, 40)) - Box((10, -1, 10), (12.004, 41, 41))
        part = _part(block + Box((5, 10, 25), (20, 30, 30)), tmp_path)
        y = np.linspace(12, 28, 9)
        floor = np.column_stack([np.full(9, 11.002), y, np.full(9, 10.0)])
        assert np.all(_status(part, floor, UP, 1.0, clearance=5.0) == TouchStatus.CONVERGED)
        assert np.all(_status(part, floor, UP, 1.0, clearance=clearance) == TouchStatus.OTHER_FACE)

    def test_clearance_cannot_be_negative(self) -> None:
        ball, target = Sphere([0, 0, 0], 5.0), Targets([[0, 0, 5.0]], UP)
        for clearance in (-1.0, math.nan):
            with pytest.raises(PretravelError, match="clearance"):
                touch(_tip(), ball, target, clearance=clearance)


class TestStylus:
    """The OMP40-2 as described: from the ball's centre a stem of 4.5 mm up to 38 mm, a head of
    8 mm up to 50 mm, the holder of 10 mm up to 64.4 mm."""

    def test_outline_reaches_from_the_ball_to_the_rods(self) -> None:
        outline = stylus_outline(load_probe("omp40-2"), UP[0])
        assert outline.above == pytest.approx(np.array([[0.0, 38.0], [38.0, 50.0], [50.0, 64.4]]))
        assert (2.0 * outline.radii).tolist() == [4.5, 8.0, 10.0]

    @pytest.mark.long
    def test_down_bores(self, tmp_path: Path) -> None:
        """A bore too narrow for head or holder may be as deep as the length below them; the
        centre of the ball rests 3 mm above the floor of the bore."""
        from netgen.occ import Box, Cylinder, Fuse, Pnt, Z

        free, blocked = TouchStatus.CONVERGED, TouchStatus.STEM
        bores = [
            (7.0, 40.9, free), (7.0, 41.1, blocked), (9.0, 52.9, free), (9.0, 53.1, blocked),
            (9.96, 60.0, blocked), (10.04, 60.0, free),
        ]  # fmt: skip
        places = np.array([[20.0 * i, 0.0, 0.0] for i in range(len(bores))])
        blocks = [Box((-7, -7, -5), (107, 7, 0))]
        for (x, _, _), (diameter, depth, _) in zip(places, bores, strict=True):
            bore = Cylinder(Pnt(x, 0, -1), Z, 0.5 * diameter, depth + 2.0)
            blocks.append(Box((x - 7, -7, 0), (x + 7, 7, depth)) - bore)
        part = _part(Fuse(blocks), tmp_path)
        outline = stylus_outline(load_probe("omp40-2"), UP[0])
        found = _status(part, places, UP, 3.0, stylus=outline)
        assert found.tolist() == [expected for _, _, expected in bores]


class TestEdges:
    @pytest.mark.parametrize(("radius", "hole"), [(1000.0, 150.0), (100.0, 20.0)])
    def test_of_a_cross_hole_in_a_pipe(self, radius: float, hole: float, tmp_path: Path) -> None:
        """The hole's edge is y² + (z - h)² = hole² on the pipe, a closed form: points 1 µm
        inside and 1 µm outside are distinguished (edges are followed to 0.1 µm)."""
        from netgen.occ import Cylinder, Pnt, X, Z

        height = 2.5 * hole
        pipe = Cylinder(Pnt(0, 0, 0), Z, radius, 2.0 * height)
        part = _part(pipe - Cylinder(Pnt(0, 0, height), X, hole, 2.0 * radius), tmp_path)
        (face,) = (
            f for f in part.faces
            if f.kind == "cylinder" and abs(f.largest_convex_curvature - 1.0 / radius) < 1e-9
        )  # fmt: skip
        around = np.linspace(0.0, 2.0 * math.pi, 2001)
        for off, expected in ((1e-3, True), (-1e-3, False)):
            y = (hole + off) * np.cos(around)
            z = height + (hole + off) * np.sin(around)
            points = np.column_stack([np.sqrt(radius**2 - y**2), y, z])
            assert np.all(face.inside(face.nearest(points)) == expected)

    def test_seams_and_poles_are_none(self, tmp_path: Path) -> None:
        from netgen.occ import Axes, Axis, Cylinder, Pnt, Vec, WorkPlane, X, Z
        from netgen.occ import Sphere as Ball

        (ball,) = _part(Ball(Pnt(1, 2, 3), 5), tmp_path).faces
        assert ball.trim is None
        assert len(ball.edge_samples(0.1)) == 0
        ring = WorkPlane(Axes((0, 0, 0), Vec(0, -1, 0), X)).MoveTo(10, 0).Circle(3).Face()
        (torus,) = _part(ring.Revolve(Axis((0, 0, 0), Z), 360), tmp_path).faces
        assert torus.trim is None
        rod = _part(Cylinder(Pnt(0, 0, 0), Z, 5, 10), tmp_path)
        (side,) = (f for f in rod.faces if f.kind == "cylinder")
        points = side.derivatives(side.edge_samples(0.1))[0]
        assert set(np.round(points[:, 2], 9)) == {0.0, 10.0}


class TestFolded:
    """Surfaces that intersect themselves change sides: the side is determined or refused."""

    def test_a_barrel_from_a_file(self, tmp_path: Path) -> None:
        """An arc of 40 mm with a largest distance of 5 mm from the axis: a torus whose tube centre
        lies on the other side of the axis. Its normals point away from the axis."""
        from netgen.occ import ArcOfCircle, Axis, Face, Pnt, Segment, Wire, Z

        sag = 40.0 - math.sqrt(40.0**2 - 6.0**2)
        low, high = Pnt(5.0 - sag, 0, -6), Pnt(5.0 - sag, 0, 6)
        outline = [
            ArcOfCircle(low, Pnt(5, 0, 0), high), Segment(high, Pnt(0, 0, 6)),
            Segment(Pnt(0, 0, 6), Pnt(0, 0, -6)), Segment(Pnt(0, 0, -6), low),
        ]  # fmt: skip
        part = _part(Face(Wire(outline)).Revolve(Axis((0, 0, 0), Z), 360), tmp_path)
        (barrel,) = (f for f in part.faces if f.kind in ("torus", "revolution"))
        rng = np.random.default_rng(0)
        angle, height = rng.uniform(0, 6.28, 50), rng.uniform(-4, 4, 50)
        radius = np.sqrt(40.0**2 - height**2) - 35.0
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
        uv = barrel.nearest(points)
        local = barrel.local(uv)
        assert np.all(barrel.inside(uv))
        assert np.abs(local.point - points).max() < 1e-9
        away = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        assert np.sum(local.normal * away, axis=1).min() > 0.9
        assert local.principal_curvatures[:, 0] == pytest.approx(1.0 / 40.0)
        # A ball comes to rest on it.
        up = local.normal[:, 2] >= -0.05
        done = touch(_tip(), part, Targets(points[up], local.normal[up]))
        assert done.converged.all()


class TestEachForItself:
    def test_one_miss_changes_nothing_for_the_others(self, tmp_path: Path) -> None:
        from netgen.occ import Axes, Axis, Vec, WorkPlane, X, Z

        circle = WorkPlane(Axes((0, 0, 0), Vec(0, -1, 0), X)).MoveTo(20, 0).Circle(5).Face()
        part = _part(circle.Revolve(Axis((0, 0, 0), Z), 360), tmp_path)
        ring = Torus([0, 0, 0], 20.0, 5.0)
        rng = np.random.default_rng(0)
        local = ring.local(
            np.column_stack([rng.uniform(0, 6.28, 400), rng.uniform(-0.1, 3.1, 400)])
        )
        alone = touch(_tip(), part, Targets(local.point, local.normal))
        assert alone.converged.all()
        with_miss = Targets(
            np.concatenate([local.point, [[0.0, 0.0, 0.0]]]), np.concatenate([local.normal, UP])
        )
        both = touch(_tip(), part, with_miss)
        assert both.status[-1] == TouchStatus.MISSED
        assert np.array_equal(both.status[:-1], alone.status)
        assert np.abs(both.travel[:-1] - alone.travel).max() < 1e-12


class TestPoles:
    def test_of_a_spline(self, tmp_path: Path) -> None:
        """A ball as B-spline, as CAD writes ellipsoids: the pole is no special case."""
        from netgen.occ import Axes, Ellipsoid, Z

        part = _part(Ellipsoid(Axes((0, 0, 0), Z), 12.5, 12.5, 12.5), tmp_path)
        assert part.faces[0].kind == "B-spline"
        rng = np.random.default_rng(0)
        polar = np.concatenate([[0.0], 10.0 ** rng.uniform(-9, -1, 100)])
        n = from_angles(polar, rng.uniform(0, 2 * math.pi, 101))
        spline = touch(_tip(), part, Targets(12.5 * n, n))
        ball = touch(_tip(), Sphere([0, 0, 0], 12.5), Targets(12.5 * n, n))
        assert spline.converged.all()
        assert np.abs(spline.travel - ball.travel).max() < 1e-8
        assert np.abs(spline.point - ball.point).max() < 1e-8

    def test_of_a_revolved_dome(self, tmp_path: Path) -> None:
        from netgen.occ import Axis, BezierCurve, Pnt, Z

        profile = BezierCurve([Pnt(10, 0, 0), Pnt(10, 0, 6), Pnt(6, 0, 10), Pnt(0, 0, 10)])
        part = _part(profile.Revolve(Axis((0, 0, 0), Z), 360), tmp_path)
        rng = np.random.default_rng(1)
        off = np.concatenate([[0.0], 10.0 ** rng.uniform(-7, 0, 60)])
        angle = rng.uniform(0, 2 * math.pi, 61)
        points = np.column_stack([off * np.cos(angle), off * np.sin(angle), np.full(61, 10.0)])
        done = touch(_tip(), part, Targets(points, np.repeat(UP, 61, axis=0)))
        assert done.converged.all()
        assert done.residual.max() < 1e-9


def test_friction_where_two_seats_open_together() -> None:
    """In the symmetry planes of the probe the deflection has a cusp; the touch is still found."""
    polar = np.radians(np.linspace(1.0, 89.0, 60))
    for azimuth in (0.0, math.pi):
        n = from_angles(polar, azimuth)
        for friction in (0.1, 0.3, math.inf):
            done = touch(_tip(), Sphere([0, 0, 0], 12.5), Targets(12.5 * n, n), friction=friction)
            assert done.converged.all()


def test_outside_a_map_a_touch_says_so() -> None:
    probe = load_probe("omp40-2")
    table = predicted_map(probe, predict(probe, fibonacci_cap(200, math.radians(60.0))))
    n = from_angles(np.radians([10.0, 50.0, 85.0]), 0.3)
    targets = Targets(12.5 * n, n)
    ball = Sphere([0, 0, 0], 12.5)
    some = simulate_some(table, ball, targets)
    assert some.outcomes.status.tolist() == [0, 0, TouchStatus.OUTSIDE_MAP]
    assert some.touches is not None
    assert len(some.touches) == 2
    everywhere = simulate_some(mapped_tip(table, extrapolate=True), ball, targets)
    assert everywhere.outcomes.converged.all()


def test_numbers_of_other_scripts_are_no_face_numbers(tmp_path: Path) -> None:
    from netgen.occ import Box

    part = _part(Box((0, 0, 0), (1, 2, 3)), tmp_path)
    with pytest.raises(PretravelError, match="no face named"):
        part.select("²")
