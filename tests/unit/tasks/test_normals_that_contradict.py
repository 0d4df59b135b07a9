"""Normals stated from the expected centre of a bore that lies elsewhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.drawing.tasks.measure import Measure
from pretravel.files.map_file import write_map
from pretravel.files.touches_csv import write_touches
from pretravel.maps.support import DirectionSupport
from pretravel.tasks.compensate import Compensate
from pretravel.touches import Touches
from tests.support.example_maps import mean_map

OFF = 0.5
"""Of the centre, along x. [mm]"""


def _touched(folder: Path, off: float) -> Path:
    """A bore of 20 mm, touched with a ball of 6 mm and 10 µm of pretravel, normals from beside."""
    azimuth = np.arange(12) * np.pi / 6.0
    outward = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    centres = outward * (10.0 - 3.0 + 0.010)
    beside = centres - [off, 0.0, 0.0]
    stated = -beside / np.linalg.norm(beside, axis=1)[:, None]
    labels = tuple(f"bore{i}" for i in range(12))
    write_touches(folder / "touches.csv", Touches(centres, stated, labels=labels))
    write_map(
        folder / "map.json",
        replace(mean_map(0.010), support=DirectionSupport(fibonacci_cap(200, 1.8))),
    )
    return folder


def _diameter(folder: Path, **settings: str) -> tuple[float, str]:
    files = {"map_file": folder / "map.json", "output": folder / "points.csv"}
    made = Compensate(touches=str(folder / "touches.csv"), **files, **settings).run()  # type: ignore[arg-type]
    made.write("output", folder / "points.csv")
    found = Measure(points=folder / "points.csv", feature="bore").run()
    said = " ".join([*made.document().warnings, *found.document().warnings])
    return found.features[0].feature.quantity("diameter").value, said


@pytest.mark.parametrize(("off", "said"), [(0.0, False), (0.1, False), (OFF, True)])
def test_normals_beside_the_feature_are_said(off: float, said: bool, tmp_path: Path) -> None:
    """Half a millimetre beside the centre, normals are up to 4° off the true ones, 2.9° root mean
    square; a tenth turns them by 0.6°, which moves a point by a tenth of a micrometre."""
    diameter, told = _diameter(_touched(tmp_path, off))
    assert ("off those of the feature (root mean square)" in told) == said
    assert (abs(diameter - 20.0) > 2e-3) == said


def test_normals_of_another_feature_are_no_wrong_centre(tmp_path: Path) -> None:
    """Four touches on the walls of a slot lie on a circle; its normals are 68° beside theirs."""
    corners = np.array([[x, y, 0.0] for x in (-10.0, 10.0) for y in (-4.0, 4.0)])
    walls = np.array([[0.0, -np.sign(y), 0.0] for _, y, _ in corners])
    folder = _touched(tmp_path, 0.0)
    labels = tuple(f"slot{i}" for i in range(4))
    write_touches(folder / "touches.csv", Touches(corners + 2.99 * walls, walls, labels=labels))
    told = _diameter(folder)[1]
    assert "the walls of a slot?" in told
    assert "as happens with a wrong expected centre" not in told


def test_the_normals_of_a_named_feature_are_fitted(tmp_path: Path) -> None:
    """The centre that the touches show is the true one."""
    diameter, told = _diameter(_touched(tmp_path, OFF), feature="bore")
    assert diameter == pytest.approx(20.0, abs=1e-6)
    assert "the file gives others, up to 4.1° off" in told
    assert "root mean square" not in told
