"""Misses in features of plain points, of every kind, are found by what the others show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.measurement.missed_points import missed_points, missed_points_of_features
from pretravel.measurement.normals_of_features import normals_of_feature
from tests.support.commands import both_outputs
from tests.support.control_logs import written

RNG = np.random.default_rng(7)
NOISE = 2e-3
"""Of a touch. [mm]"""
ROUND = np.arange(8) * np.pi / 4


def _circle(radius: float, angles: FloatArray = ROUND, z: float = -5.0) -> FloatArray:
    x, y = radius * np.cos(angles), radius * np.sin(angles)
    return np.column_stack([x, y, np.full(len(angles), z)])


def _sphere(count: int) -> FloatArray:
    away = RNG.standard_normal((count, 3))
    away[:, 2] = np.abs(away[:, 2])
    return 15.0 * away / np.linalg.norm(away, axis=1)[:, None]


def _plane() -> FloatArray:
    x, y = np.meshgrid([0.0, 12.0, 25.0, 40.0], [0.0, 10.0, 20.0])
    return np.column_stack([x.ravel(), y.ravel(), (0.3 * x + 0.2 * y).ravel()])


PLACES = {
    "bore": _circle(20.0),
    "sphere": _sphere(12),
    "plane": _plane(),
    "cylinder": np.vstack([_circle(20.0, z=z) for z in (0.0, -6.0, -12.0)]),
}
ACROSS = {
    "bore": lambda p: p * [1, 1, 0] / np.linalg.norm(p[:2]),
    "sphere": lambda p: p / np.linalg.norm(p),
    "plane": lambda _: np.array([-0.3, -0.2, 1.0]) / np.sqrt(1.13),
    "cylinder": lambda p: p * [1, 1, 0] / np.linalg.norm(p[:2]),
}


def _with_noise(places: FloatArray) -> FloatArray:
    return places + np.array([100.0, 50.0, 0.0]) + RNG.normal(0.0, NOISE, places.shape)


@pytest.mark.long
@pytest.mark.parametrize("kind", PLACES)
@pytest.mark.parametrize("off", [-10.0, -1.0, 2.5])
def test_each_point_that_missed_is_found(kind: str, off: float) -> None:
    places = PLACES[kind]
    for row in range(0, len(places), 3):  # of a cylinder in all its rings
        place, points = places[row], _with_noise(places)
        points[row] += off * ACROSS[kind](place)
        found = missed_points(kind, points)
        assert found.rows == (row,)
        # The others determine the feature there within about three times their noise.
        assert abs(found.off[0]) == pytest.approx(abs(off), abs=10 * NOISE)
        ((recognised, alike),) = missed_points_of_features(points)
        assert alike.rows == (row,)
        assert recognised == {"bore": "circle", "cylinder": "circle"}.get(kind, kind)


@pytest.mark.long
@pytest.mark.parametrize("kind", PLACES)
def test_good_points_are_all_kept(kind: str) -> None:
    """Also of a rough part, and of an oval."""
    for scatter in (NOISE, 0.05, 0.3):
        for _ in range(4):
            points = _with_noise(PLACES[kind])
            points += RNG.normal(0.0, scatter, points.shape)
            assert missed_points(kind, points).rows == ()
            assert missed_points_of_features(points) == ()
    oval = PLACES["bore"] * [1.0, 1.02, 1.0]
    assert missed_points("bore", oval).rows == ()


def test_two_misses_of_many() -> None:
    points = _with_noise(PLACES["cylinder"])
    points[3, :2] -= [0.0, 1.0]
    points[17, :2] += [1.0, 1.0]
    assert missed_points("cylinder", points).rows == (3, 17)


def test_which_of_few_points_missed_is_not_said() -> None:
    four = _circle(20.0, ROUND[::2])
    four[3] *= [1.1, 1.1, 1.0]
    found = missed_points("bore", four)
    assert found.rows == ()
    assert found.unclear == pytest.approx(0.5, abs=0.05)  # 2 mm, shared by four points
    assert missed_points("bore", _circle(20.0, ROUND[::2])).unclear == 0.0


def test_a_pattern_of_places_has_no_miss() -> None:
    """Heights on a circle of places and at its middle; heights on a grid."""
    pattern = np.vstack([_circle(20.0, z=0.0), np.zeros(3)])
    grid = np.array([[x, y, 0.0] for x in range(0, 40, 10) for y in range(0, 40, 10)])
    for places in (pattern, grid):
        assert missed_points_of_features(_with_noise(places)) == ()


def test_a_rough_face_is_not_a_circle() -> None:
    """Seen along x, a circle passes two of its three rows; the machine's other axes stand still."""
    face = np.array([[x, y, 0.0] for y in (4.0, 30.0, 56.0) for x in (5.0, 40.0, 75.0)])
    face[:, 2] = 3e-3 * np.random.default_rng(2).standard_normal(9)
    assert missed_points_of_features(face) == ()


@pytest.mark.long
def test_points_at_the_middle_of_others_have_no_feature() -> None:
    """A grid of three by three has one at the centre of a circle of the others, once or thrice."""
    grid = np.array([[x, y, 0.0] for x in (-40.0, 0, 40) for y in (-40.0, 0, 40)])
    for places in (grid, np.repeat(grid, 3, axis=0)):
        for kind in ("circle", "sphere", "plane", "cylinder"):
            assert missed_points(kind, places).rows == ()
        assert missed_points_of_features(places) == ()


def test_labels_tell_features_apart() -> None:
    points = np.vstack([_circle(20.0), _circle(5.0) + np.array([60.0, 0.0, 0.0])])
    points[12, 0] -= 1.5
    labels = [f"bore{1 + row // 8}-{row % 8 + 1}" for row in range(16)]
    ((kind, found),) = missed_points_of_features(points, labels)
    assert (kind, found.rows) == ("circle", (12,))


def test_measure_compensate_and_convert_name_it(tmp_path: Path) -> None:
    points = _circle(20.0) + np.array([100.0, 50.0, 0.0])
    points[7, :2] -= 2.5 * np.array([np.cos(ROUND[7]), np.sin(ROUND[7])])
    rows = "".join(f"{x:.4f},{y:.4f},{z:.4f}\n" for x, y, z in points)
    path = written(tmp_path, "x_mm,y_mm,z_mm\n" + rows, "a.csv")
    out, err = both_outputs("measure", path, "--feature", "bore")
    assert "diameter 39.9999" in out or "diameter 40.0000" in out
    assert "left out: 8 (-2.500 mm)" in err
    assert "that of line 9 (-2.500 mm)" in both_outputs("convert", path)[1]
    with pytest.raises(PretravelError, match=r"without touch 8 \(-2.500 mm\)"):
        normals_of_feature("bore", points, None)


def test_labels_that_name_a_bore_at_two_heights(tmp_path: Path) -> None:
    points = np.vstack([_circle(20.0, z=z) for z in (0.0, -12.0)])
    points[5, :2] *= 0.9
    rows = "".join(f"bore1-{i},{x:.4f},{y:.4f},{z}\n" for i, (x, y, z) in enumerate(points, 1))
    path = written(tmp_path, "label,x_mm,y_mm,z_mm\n" + rows, "a.csv")
    out, err = both_outputs("measure", path, "--feature", "by-label")
    assert "39.9999" in out or "40.0000" in out
    assert "bore1-6 (-2.000 mm)" in err


@pytest.mark.parametrize("height", [30.0, 100.0, -500.0])
@pytest.mark.parametrize("side", [3, 7])
def test_a_miss_farther_away_than_the_face_is_large_is_found(height: float, side: int) -> None:
    """The plane of all points stands upright then, through the one that is far."""
    x, y = np.meshgrid(10.0 * np.arange(side), 10.0 * np.arange(side))
    points = np.column_stack([x.ravel(), y.ravel(), 0.001 * np.cos(np.arange(side**2))])
    points[side + 1, 2] = height
    assert missed_points("plane", points).rows == (side + 1,)
