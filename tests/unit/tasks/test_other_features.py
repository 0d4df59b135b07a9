"""Touches that lie on another feature than the one that is named, and rows that come twice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import PretravelError
from pretravel.drawing.tasks.measure import Measure
from pretravel.files.map_file import write_map
from pretravel.files.several_files import read_series
from pretravel.laboratory.tasks.repeat import Repeat
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.normals_of_features import normals_of_feature
from pretravel.tasks.compensate import Compensate
from pretravel.tasks.qualify import Qualify
from tests.support.example_maps import mean_map

RNG = np.random.default_rng(51)
SIDE = np.linspace(-10.0, 10.0, 5)
GRID = np.stack([*np.meshgrid(SIDE, SIDE), np.zeros((5, 5))], axis=-1).reshape(-1, 3)
ALONG = np.linspace(-8.0, 8.0, 4)
POCKET = np.concatenate(
    [[(a, s * 10.0, 0.0) for a in ALONG] + [(s * 10.0, a, 0.0) for a in ALONG] for s in (-1, 1)]
)
AZIMUTH = np.arange(12) * np.pi / 6.0
AROUND = np.stack([np.cos(AZIMUTH), np.sin(AZIMUTH), 0.0 * AZIMUTH], axis=1)
LOBES = 7.0 + 0.010 * np.cos(3.0 * AZIMUTH)
ROW = np.stack([np.linspace(0.0, 20.0, 9), np.zeros(9), np.zeros(9)], axis=1)


def _scattered(places: np.ndarray) -> np.ndarray:
    return places + RNG.normal(0.0, 5e-4, places.shape)


@pytest.mark.parametrize("kind", ["bore", "boss"])
@pytest.mark.parametrize("places", [GRID, POCKET, ROW], ids=["flat face", "square pocket", "row"])
def test_another_surface_has_no_normals_of_a_bore(kind: str, places: np.ndarray) -> None:
    """They were taken, 90° and 45° off the true ones, with u of 0.4 µm."""
    with pytest.raises(PretravelError, match="Use normals in the file") as refused:
        normals_of_feature(kind, _scattered(places), None)
    assert refused.value.inputs == ("feature",)


def test_a_flat_face_is_no_sphere() -> None:
    """The scatter alone bends it, to the one side or the other."""
    for _ in range(5):
        with pytest.raises(PretravelError, match="Use normals in the file"):
            normals_of_feature("sphere", GRID + RNG.normal(0.0, 0.02, GRID.shape), None)


@pytest.mark.parametrize("radius", [0.5, 7.0, 100.0])
def test_a_bore_with_lobes_of_pretravel_has_them(radius: float) -> None:
    """20 µm of pretravel over three directions turn no normal by more than 2°, at 7 mm."""
    found = normals_of_feature("bore", AROUND * (radius + LOBES - 7.0)[:, None], None)
    across = np.linalg.norm(np.cross(found, AROUND), axis=1)
    assert np.degrees(np.arcsin(across)).max() < 2.0
    assert np.all(np.sum(found * AROUND, axis=1) < 0.0)


def _compensated(folder: Path, rows: list[str], columns: str) -> Compensate:
    (folder / "touches.csv").write_text("\n".join([columns, *rows]) + "\n")
    everywhere = DirectionSupport(fibonacci_cap(200, 1.8))
    write_map(folder / "map.json", replace(mean_map(0.010), support=everywhere))
    return Compensate(
        touches=(folder / "touches.csv",),
        map_file=str(folder / "map.json"),
        output=folder / "points.csv",
        feature="bore",
    )


def test_the_normals_of_the_file_speak_against_a_feature(tmp_path: Path) -> None:
    """Eight touches of a square pocket, two on each side, lie on a circle exactly."""
    places = [(s, 10.0 * t) for t in (-1, 1) for s in (-5.0, 5.0)]
    rows = [f"{a},{b},0,0,{-np.sign(b):g},0" for a, b in places]
    rows += [f"{b},{a},0,{-np.sign(b):g},0,0" for a, b in places]
    task = _compensated(tmp_path, rows, "x_mm,y_mm,z_mm,nx,ny,nz")
    with pytest.raises(PretravelError, match=r"27° \(median\) off those that the file gives"):
        task.run()


def _log(count: int, digits: int, copies: int = 1) -> list[str]:
    """Touches on a sphere of 25 mm, with the tip of 6 mm, and the rows of the file again."""
    normals = fibonacci_cap(count, 1.5)
    places = np.array([31.27113, -8.91452, 3.41907]) + 15.492 * normals
    places += RNG.normal(0.0, 5e-4, (count, 1)) * normals
    rows = [
        ",".join(f"{v:.{digits}f}" for v in p) + "," + ",".join(f"{v:.9f}" for v in n)
        for p, n in zip(places, normals, strict=True)
    ]
    return rows * copies


def _table(folder: Path, rows: list[str]) -> Path:
    path = folder / "log.csv"
    path.write_text("\n".join(["x_mm,y_mm,z_mm,nx,ny,nz", *rows]) + "\n")
    return path


TWICE = "rows from .* are equal to those from .* appended twice"


@pytest.mark.parametrize("digits", [6, 4])
def test_a_log_that_was_appended_twice_is_named(digits: int, tmp_path: Path) -> None:
    """In qualify, compensate, measure and repeat; the scatter among repeats was 0.00 µm."""
    path = _table(tmp_path, _log(25, digits, 2))
    made = Qualify(touches=(path,), diameter=25.0, tip_diameter=6.0, kind="mean").run()
    said = " ".join(made.document().warnings)
    assert "25 of 50 rows, the first touch 26 (line 27), are copies of others" in said
    assert len(made.qualification.residuals) == 25
    places = AROUND * LOBES[:, None]
    rows = [f"{x:.6f},{y:.6f},{z + 1:.6f}" for x, y, z in _scattered(places)]
    done = _compensated(tmp_path, rows * 2, "x_mm,y_mm,z_mm").run()
    assert "12 rows from" in " ".join(done.document().warnings)
    done.write("output", tmp_path / "points.csv")
    measured = Measure(points=tmp_path / "points.csv", feature="bore").run()
    assert "12 rows from" in " ".join([*measured.document().warnings, *measured.document().notes])
    heights = [f"{v:.6f}" for v in RNG.normal(3.0, 5e-4, 10)]
    (tmp_path / "z.txt").write_text("\n".join(["z_mm", *heights, *heights]) + "\n")
    repeated = Repeat(log=(tmp_path / "z.txt",)).run()
    assert "10 rows from line 12 on are equal to those from line 2 on" in " ".join(
        [*repeated.document().warnings, *repeated.document().notes]
    )


@pytest.mark.parametrize("digits", [6, 4, 3])
def test_repeats_are_no_copies(digits: int, tmp_path: Path) -> None:
    """25 directions in three passes: in steps of 1 µm single touches repeat to the last digit."""
    normals = np.tile(fibonacci_cap(25, 1.5), (3, 1))
    for _ in range(20):
        places = 15.492 * normals + RNG.normal(0.0, 3e-4, (75, 1)) * normals
        rows = [
            ",".join(f"{v:.{digits}f}" for v in p) + "," + ",".join(f"{v:.9f}" for v in n)
            for p, n in zip(places, normals, strict=True)
        ]
        assert read_series([_table(tmp_path, rows)]).warnings == ()
