"""Touches in a ring gauge, from a table: their outward normals point to its axis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.demo.demonstration import ring_touches
from pretravel.files.file_format import ReadingOptions
from pretravel.files.readings import read_readings
from pretravel.files.touches_csv import write_touches
from tests.support.commands import run


def test_the_normals_of_a_ring_are_not_taken_for_directions_of_travel(tmp_path: Path) -> None:
    azimuth = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    touches = ring_touches(azimuth, np.full(12, 0.01))
    write_touches(tmp_path / "ring.csv", touches)
    options = ReadingOptions(reference_diameter=50.0, ring=True)
    found = read_readings(tmp_path / "ring.csv", options).touches
    assert np.allclose(found.normals, touches.normals)


@pytest.mark.long
@pytest.mark.parametrize(("shape", "side"), [("pin", 1.0), ("ring", -1.0)])
def test_a_log_of_one_round_reference_needs_no_offset(
    shape: str, side: float, tmp_path: Path
) -> None:
    """Machine coordinates of a pin or ring of 20 mm, tip 3 mm, pretravel 6 µm."""
    azimuths = np.radians(np.tile(np.arange(0, 360, 30), 3))
    radius = 10.0 + side * (1.5 - 0.006) + np.random.default_rng(1).normal(0.0, 3e-4, 36)
    lines = [
        f"[PRB:{r * np.cos(a) - 215:.3f},{r * np.sin(a) - 120:.3f},-50.112:1]"
        for r, a in zip(radius, azimuths, strict=True)
    ]
    log = tmp_path / "round.log"
    log.write_text("$13=0\n" + "\n".join(lines) + "\n")
    said = run("qualify", log, "--reference", f"p={shape}:20", "--tip-diameter", 3)
    assert "noise of a touch" in said
    assert "offset" not in said
