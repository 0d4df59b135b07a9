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
from pretravel.qualification.quantisation import step_of_measured
from pretravel.tasks.compensate import Compensate, CompensatedTouches
from pretravel.touches import Touches
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
