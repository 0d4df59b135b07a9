"""Which faces can be near a point, and where on them the nearest point is: blades of B-splines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_file import read_part
from pretravel.surface.foot_points import foot_points
from pretravel.surface.parametric import FunctionSurface, Parametric
from tests.support.large_parts import blades_around

POINTS = 60


@pytest.fixture(scope="module")
def blades(tmp_path_factory: pytest.TempPathFactory) -> Part:
    """Sixty blades around x, 240 faces."""
    return read_part(blades_around(tmp_path_factory.mktemp("blades") / "blades.step", 60))


def _around(part: Part) -> np.ndarray:
    """Points up to 4 mm away from points of faces."""
    chance = np.random.default_rng(3)
    places = []
    for face in part.faces:
        low, high = face.box
        uv = chance.uniform(low, high, (4, 2))
        local = face.local(uv[face.inside(uv)])
        places.append(local.point + chance.uniform(0.0, 4.0, (len(local.point), 1)) * local.normal)
    return np.concatenate(places)[:POINTS]


@pytest.mark.slow
def test_no_face_within_reach_is_left_out_and_few_others_are_taken(blades: Part) -> None:
    """Against the distances of all faces, right to half a micrometre: 0.05 mm aside of a sample of
    an edge, 3 mm away. The boxes overlap: of the pairs that they allow, most are none."""
    points = _around(blades)[::4]
    reach = np.full(len(points), 3.0)
    cloud = blades.cloud_of_spacing(1.5)
    boxes = len(blades.boxes.within(points, reach)[0])
    rows, faces = blades.near(points, reach, cloud, blades.boxes)
    taken = set(zip(rows.tolist(), faces.tolist(), strict=True))
    true = {
        (row, index)
        for index, face in enumerate(blades.faces)
        for row in np.flatnonzero(face.distance(points, 0.1) <= 3.0).tolist()
    }
    assert true
    assert true <= taken
    assert len(taken) < 0.5 * boxes


def _samples(face: Face, points: np.ndarray) -> np.ndarray:
    """Distance from the nearest of 400 x 400 points of the parameters."""
    from scipy.spatial import cKDTree

    low, high = face.domain.lower, face.domain.upper
    u, v = np.meshgrid(*(np.linspace(low[k], high[k], 400) for k in (0, 1)))
    grid = face.derivatives(np.column_stack([u.ravel(), v.ravel()]))[0]
    return np.asarray(cKDTree(grid).query(points)[0])


def test_the_nearest_point_of_a_blade(tmp_path: Path) -> None:
    """No point of a fine grid is nearer; the perpendicular meets within 1e-9 mm, except where the
    nearest point lies on the border of the parameters."""
    blades = read_part(blades_around(tmp_path / "blades.step", 5))
    face = blades.faces[0]
    points = _around(blades)[:20]
    uv = face.nearest(points)
    local = face.local(uv)
    apart = local.point - points
    assert np.all(np.linalg.norm(apart, axis=1) <= _samples(face, points) + 1e-9)
    low, high = np.array(face.domain.lower), np.array(face.domain.upper)
    inner = np.all((uv > low) & (uv < high), axis=1)
    along = apart - np.sum(apart * local.normal, axis=1)[:, None] * local.normal
    assert inner.sum() > 5
    assert np.linalg.norm(along[inner], axis=1).max() < 1e-9


class TestFootPoints:
    def _surface(self) -> Parametric:
        return FunctionSurface(
            lambda u, v: (u, v, 0.3 * np.sin(u) * np.cos(v)), u=(-2, 2), v=(-2, 2)
        )

    def test_within_and_on_borders(self) -> None:
        """Points above known places; beside the borders the other parameter is that of the
        constrained minimum, and at a corner both are held."""
        surface = self._surface()
        uv = np.random.default_rng(1).uniform(-1.8, 1.8, (50, 2))
        local = surface.local(uv)
        found, solved = foot_points(
            surface, surface.domain, uv + 0.1, local.point + 0.7 * local.normal
        )
        assert solved.all()
        assert np.abs(found - uv).max() < 1e-9
        beside = np.array([[9.0, 0.5, 0.0], [0.5, -9.0, 0.2], [9.0, 9.0, 9.0]])
        found, solved = foot_points(surface, surface.domain, np.zeros((3, 2)), beside)
        assert solved.all()
        assert (found[0, 0], found[1, 1], *found[2]) == (2.0, -2.0, 2.0, 2.0)
        line = np.linspace(-2.0, 2.0, 40_001)
        edge = np.column_stack([np.full_like(line, 2.0), line])
        best = np.linalg.norm(surface.derivatives(edge)[0] - beside[0], axis=1).argmin()
        assert found[0, 1] == pytest.approx(line[best], abs=1e-4)
