"""pretravel identify: a description from a map."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pretravel.prediction.catalogue import load_probe
from tests.support.commands import run


class TestIdentify:
    @pytest.mark.parametrize("ending", ["json", pytest.param("csv", marks=pytest.mark.slow)])
    def test_description_from_a_map(self, tmp_path: Path, ending: str) -> None:
        """From a map predicted with a changed description, that description is identified."""
        from pretravel.prediction.catalogue import description_text, rewritten

        changed = tmp_path / "changed.toml"
        text = rewritten(
            description_text("omp40-2-100mm"),
            {"spring.preload_N": (7.0, ""), "orientation.rotation_deg": (17.0, ""),
             "tripod.radius_mm": (15.0, "")},
        )  # fmt: skip
        changed.write_text(text, encoding="utf-8")
        run("predict", changed, "--azimuth", "0:350:10", "--polar", "0:90:10",
            "-o", tmp_path / f"map.{ending}")  # fmt: skip
        told = run("identify", tmp_path / f"map.{ending}", "--probe", "omp40-2-100mm", "--free",
                   "preload,tripod_radius,rotation", "-o", tmp_path / "found.toml",
                   "--plot", tmp_path / "left.png")  # fmt: skip
        # What the catalogue describes, next to what was found.
        assert re.search(r"spring\.preload_N +5\.91 +7 ", told)
        found = load_probe(tmp_path / "found.toml")
        assert found.preload == pytest.approx(7.0, rel=1e-4)
        assert found.tripod.radius == pytest.approx(15.0, rel=1e-4)
        assert np.degrees(found.orientation.rotation) % 120.0 == pytest.approx(17.0, abs=0.01)
        written = (tmp_path / "found.toml").read_text(encoding="utf-8")
        assert "# axis to the points where the rods rest" in written
        assert f"identified from map.{ending}" in written

    @pytest.mark.parametrize(
        ("free", "words"), [("magic", "there are preload"), ("", "no number is free")]
    )
    def test_errors_teach(self, tmp_path: Path, free: str, words: str) -> None:
        run("predict", "omp40-2", "--azimuth", "0:350:30", "--polar", "0:90:30",
            "-o", tmp_path / "map.json")  # fmt: skip
        text = run("identify", tmp_path / "map.json", "--probe", "omp40-2", "--free", free, code=2)
        assert words in text
