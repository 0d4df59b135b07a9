"""Touches in a ring gauge, from a table: their outward normals point to its axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pretravel.demo.demonstration import ring_touches
from pretravel.files.file_format import ReadingOptions
from pretravel.files.readings import read_readings
from pretravel.files.touches_csv import write_touches


def test_the_normals_of_a_ring_are_not_taken_for_directions_of_travel(tmp_path: Path) -> None:
    azimuth = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    touches = ring_touches(azimuth, np.full(12, 0.01))
    write_touches(tmp_path / "ring.csv", touches)
    options = ReadingOptions(reference_diameter=50.0, ring=True)
    found = read_readings(tmp_path / "ring.csv", options).touches
    assert np.allclose(found.normals, touches.normals)
