"""Normals from neighbouring tip centres: surfaces in closed form, and the edge that is named."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.measurement.normals_from_neighbours import neighbour_normals

RADIUS = 40.0


def _ball(noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    x, y = (
        each.ravel() for each in np.meshgrid(np.linspace(-15, 15, 16), np.linspace(-15, 15, 16))
    )
    flat = np.column_stack([x, y]) + 0.3 * rng.uniform(-1.0, 1.0, (len(x), 2))
    normals = np.column_stack([flat, np.sqrt(RADIUS**2 - np.sum(flat**2, axis=1))]) / RADIUS
    return (RADIUS + noise * rng.standard_normal((len(x), 1))) * normals, normals


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_a_ball(noise: float) -> None:
    """Points 2 mm apart on a ball of 40 mm: the error is covered by the stated uncertainty."""
    points, normals = _ball(noise)
    found = neighbour_normals(points)
    error = np.linalg.norm(np.cross(found.normals, normals), axis=1)
    assert found.spacing == pytest.approx(1.7, abs=0.3)
    assert np.mean(error <= 2.45 * found.turn) > 0.94  # two directions: 95 % within 2.45 u
    assert not found.doubtful.any()
    assert error.max() < np.radians(0.5)


def test_an_edge_is_doubtful() -> None:
    x, y = (each.ravel() for each in np.meshgrid(np.arange(-10.0, 10.5), np.arange(6.0)))
    roof = np.column_stack([x, y, -0.5 * np.abs(x + 0.3)])
    found = neighbour_normals(roof)
    assert found.doubtful[np.abs(x + 0.3) < 1.0].all()
    assert not found.doubtful[np.abs(x) > 4.0].any()
    flat = found.normals[x > 4.0]
    assert flat == pytest.approx(np.tile([0.447214, 0.0, 0.894427], (len(flat), 1)), abs=1e-6)


def test_refused() -> None:
    with pytest.raises(PretravelError, match="too few"):
        neighbour_normals(np.eye(3))
    with pytest.raises(PretravelError, match="in a row"):
        neighbour_normals(np.column_stack([np.arange(20.0), np.zeros((20, 2))]))
