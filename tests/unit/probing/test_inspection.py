"""Inspection plans have the requested number of points at the requested places."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pretravel.errors import PretravelError
from pretravel.probing.inspection import InspectionRegion, plan_inspection
from pretravel.surface.cad.step_part import read_step_part
from pretravel.surface.shapes import Plane, Sphere
from pretravel.surface.shapes_of_revolution import Cylinder, Torus
from tests.support.examples import EXAMPLES

PART = EXAMPLES / "part.step"
WHOLE = InspectionRegion(margin=0.0)


def test_a_grid_is_even_in_the_parameters() -> None:
    plan = plan_inspection(read_step_part(PART), grid=(5, 4), region=WHOLE)
    assert len(plan) == 20
    assert np.unique(plan.uv[:, 0].round(9)) == pytest.approx(np.linspace(0, 60, 5))
    assert np.unique(plan.uv[:, 1].round(9)) == pytest.approx(np.linspace(0, 40, 4))
    face = read_step_part(PART).faces[0]
    assert np.abs(face.local(plan.uv).point - plan.point).max() < 1e-12
    assert plan.labels[:2] == ("face1-1", "face1-2")


def test_a_margin_keeps_off_the_edges_and_says_so() -> None:
    plan = plan_inspection(read_step_part(PART), grid=(21, 15), region=InspectionRegion(margin=2.0))
    (reason, count), *_ = plan.left_out.items()
    assert "margin" in reason
    assert count == 21 * 15 - len(plan) > 0
    face = read_step_part(PART).faces[0]
    edge = face.derivatives(face.edge_samples(0.05))[0]
    assert cKDTree(edge).query(plan.point)[0].min() >= 2.0 * (1 - 1e-6)


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
    assert plan.left_out["turned away"] == 12 * 4
    sideways = plan_inspection(
        ball, grid=(12, 9), region=InspectionRegion(margin=0.0, axis=(1.0, 0.0, 0.0))
    )
    assert sideways.normal[:, 0].min() >= -1e-9


def test_a_full_turn_has_its_seam_once() -> None:
    rod = Cylinder([0, 0, 0], 5.0)
    region = InspectionRegion(margin=0.0, v=(0.0, 10.0), max_polar=math.pi)
    plan = plan_inspection(rod, grid=(6, 2), region=region)
    assert len(plan) == 12
    assert cKDTree(plan.point).query(plan.point, k=2)[0][:, 1].min() > 1.0


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
    [({"margin": -1.0}, "cannot be negative"), ({"u": (3.0, 1.0)}, "must increase")],
)
def test_regions_that_cannot_be(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        InspectionRegion(**arguments)  # type: ignore[arg-type]


def test_a_plane_has_no_end() -> None:
    floor = Plane([0, 0, 0], [0, 0, 1])
    with pytest.raises(PretravelError, match=r"no end along u: state a range of u"):
        plan_inspection(floor, grid=(2, 2))
    plan = plan_inspection(floor, grid=(3, 2), region=InspectionRegion(u=(0, 2), v=(0, 1)))
    assert plan.point[:, :2].max(axis=0) == pytest.approx([2.0, 1.0])


def test_rows_of_a_region_have_the_spacing_of_the_region_alone() -> None:
    """3 x 4 mm of a plane far from the origin of its parameters, at most 1.1 mm apart: 3 x 4."""
    region = InspectionRegion(margin=0.0, u=(20.0, 23.0), v=(-14.0, -10.0))
    plan = plan_inspection(Plane([0, 0, 0], [0, 0, 1]), spacing=1.1, region=region)
    assert len(plan) == 12
    assert np.unique(plan.uv[:, 0].round(9)).tolist() == [20.5, 21.5, 22.5]
    assert np.unique(plan.uv[:, 1].round(9)).tolist() == [-13.5, -12.5, -11.5, -10.5]


def test_a_spacing_that_makes_too_many_points_is_refused() -> None:
    region = InspectionRegion(margin=0.0, u=(20.0, 23.0), v=(-14.0, -10.0))
    with pytest.raises(PretravelError, match=r"0\.002 mm on 3 x 4 mm makes more than 1000000"):
        plan_inspection(Plane([0, 0, 0], [0, 0, 1]), spacing=0.002, region=region)
