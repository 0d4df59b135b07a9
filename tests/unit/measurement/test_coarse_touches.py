"""Touches on a part in coarse steps: U of points, features and placements contains the step."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.files.map_file import write_map
from pretravel.files.touches_csv import write_touches
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.coarse_touches import with_step_of_touches
from pretravel.measurement.compensation import apply
from pretravel.measurement.points import Points
from pretravel.tasks.compensate import Compensate, CompensatedTouches
from pretravel.touches import Touches
from pretravel.touches.quantisation import step_of_measured
from tests.support.example_maps import mean_map

MAP = replace(
    mean_map(0.010), support=DirectionSupport(fibonacci_cap(200, 1.8)), repeatability=3e-4
)
AZIMUTH = np.arange(8) * np.pi / 4.0 + 0.1
AROUND = np.stack([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0 * AZIMUTH], axis=1)


def _bore(rng: np.random.Generator, step: float) -> Touches:
    """A bore of 20 mm at a random place, touched with a ball of 6 mm."""
    radius = 10.0 - 3.0 + 0.010 + rng.normal(0.0, 3e-4, (8, 1))
    places = rng.uniform(-300.0, 300.0, 3) + radius * AROUND
    return Touches(step * np.round(places / step), -AROUND)


def _compensated(folder: Path, touches: Touches) -> CompensatedTouches:
    write_touches(folder / "touches.csv", touches)
    write_map(folder / "map.json", MAP)
    made = Compensate(
        touches=(folder / "touches.csv",),
        map_file=str(folder / "map.json"),
        output=folder / "points.csv",
    ).run()
    assert isinstance(made, CompensatedTouches)
    return made


@pytest.mark.parametrize("step", [0.005, 0.0254])
def test_the_bore_is_within_u(step: float, tmp_path: Path) -> None:
    """A map with all digits, the part in coarse steps: u of a point was 0.3 µm."""
    rng, inside = np.random.default_rng(51), 0
    for _ in range(12):
        made = _compensated(tmp_path, _bore(rng, step))
        assert any("in steps of" in warning for warning in made.document().warnings)
        assert np.all(made.points.standard_uncertainty >= 0.999 * step / 12**0.5)
        diameter = measure_feature(made.points, "bore").quantity("diameter")
        inside += abs(diameter.value - 20.0) <= 2.0 * diameter.u
    assert inside >= 10


def test_digits_finer_than_the_scatter_change_nothing(tmp_path: Path) -> None:
    made = _compensated(tmp_path, _bore(np.random.default_rng(1), 1e-5))
    assert not any("in steps of" in warning for warning in made.document().warnings)
    assert made.pretravel_map.fixed_scatter == 0.0


def test_round_targets_are_no_step() -> None:
    """Faces, a grid and a bore of a simulation, at round places: without noise, and with it."""
    rng, up = np.random.default_rng(2), np.array([0.0, 0.0, 1.0])
    x, y = np.meshgrid(np.arange(6) * 2.5, np.arange(6) * 0.25)
    grid = np.stack([x, y, 0.0 * x], axis=-1).reshape(-1, 3) + np.array([0.0, 0.0, 12.99])
    noise = rng.normal(0.0, 3e-4, (36, 1)) * up
    normals = np.tile(up, (36, 1))
    ring = AROUND * 7.01
    box = np.vstack([grid, grid[:, [2, 0, 1]], grid[:, [0, 2, 1]] * [1, -1, 1]])
    of_box = np.vstack([normals, np.roll(normals, 1, axis=1), -np.roll(normals, 2, axis=1)])
    assert step_of_measured(grid, normals) == 0.0
    assert step_of_measured(grid + noise, normals) == 0.0
    assert step_of_measured(ring + np.array([100.0, 50.0, -5.0]), -AROUND) == 0.0
    assert step_of_measured(box, of_box) == 0.0
    assert with_step_of_touches(MAP, Touches(grid, normals)) == (MAP, ())


def test_python_has_the_step_of_the_command() -> None:
    points = apply(_bore(np.random.default_rng(51), 0.01), MAP)
    assert np.all(points.standard_uncertainty >= 0.999 * 0.01 / 12**0.5)


@pytest.mark.parametrize("count", [4, 8, 12, 25])
@pytest.mark.parametrize("is_round", [True, False])
def test_coordinates_alone_in_coarse_steps(count: int, is_round: bool) -> None:
    """A bore whose points something else compensated, noise 0.3 µm, in steps of 10 µm.

    At a round place the points of a symmetric pattern are rounded alike: nothing in their residuals
    shows it, and U contained it in 6 to 47 % of the sets. Without the step at generic azimuths, the
    scatter of few residuals was the only source: 47 to 98 %.
    """
    rng, step = np.random.default_rng([51, count, is_round]), 0.01
    inside = {"diameter": 0, "x": 0, "y": 0}
    for _ in range(20):
        azimuth = np.arange(count) * 2.0 * np.pi / count
        azimuth = azimuth if is_round else azimuth + rng.uniform(0.0, 6.0)
        outward = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
        place, size = rng.uniform(-300.0, 300.0, 3), 20.0 + rng.uniform(0.0, 0.1)
        place = step * np.round(place / step) if is_round else place
        touched = place + outward * (0.5 * size + rng.normal(0.0, 3e-4, (count, 1)))
        points = Points.plain(step * np.round(touched / step), tuple(map(str, range(count))))
        assert points.step >= 0.999 * step
        bore = measure_feature(points, "bore", axis=(0.0, 0.0, 1.0))
        for name, true in (("diameter", size), ("x", place[0]), ("y", place[1])):
            found = bore.quantity(name)
            inside[name] += abs(found.value - true) <= found.expanded_u
            assert "step of the coordinates" in found.parts
    assert min(inside.values()) >= 16, inside  # 0.95 of 20 less 3 of its standard deviation


def test_the_step_decides_no_tolerance() -> None:
    """It is the least that U contains: what the probe adds stays unknown."""
    azimuth = np.arange(12) * np.pi / 6.0
    ring = 10.0 * np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    points = Points.plain(0.01 * np.round(ring / 0.01), tuple("abcdefghijkl"))
    bore = measure_feature(points, "bore", axis=(0.0, 0.0, 1.0))
    assert points.step > 0.0
    assert not bore.errors.map_is_stated
    assert not bore.points.state_uncertainty


def test_digits_finer_than_the_scatter_change_no_feature() -> None:
    rng = np.random.default_rng(5)
    azimuth = rng.uniform(0.0, 6.28, 20)
    outward = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    touched = outward * (10.0 + rng.normal(0.0, 2e-3, (20, 1)))
    fine = measure_feature(Points.plain(touched, tuple(map(str, range(20)))), "bore")
    written = np.round(touched, 4)
    rounded = measure_feature(Points.plain(written, tuple(map(str, range(20)))), "bore")
    a, b = fine.quantity("diameter"), rounded.quantity("diameter")
    assert abs(b.expanded_u / a.expanded_u - 1.0) < 0.02  # 0.03 µm beside 2 µm


def test_targets_of_a_plane_are_no_step_of_its_heights() -> None:
    """Their distance of 5 mm was taken for a step of 0.25 mm where all heights are equal."""
    x, y = np.meshgrid(np.arange(3) * 5.0, np.arange(3) * 5.0)
    grid = np.stack([x.ravel(), y.ravel(), np.full(9, 2.0)], axis=1)
    plane = measure_feature(Points.plain(grid, tuple("abcdefghi")), "plane")
    assert all("step" not in cause for each in plane.quantities for cause in each.parts)
