"""pretravel qualify: kinds of map, errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.commands import rows, run
from tests.support.examples import PART, SPHERE


class TestQualify:
    def test_physical_then_compensate(self, tmp_path: Path) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind",
                   "physical", "--verbose", "-o", tmp_path / "map.nc")  # fmt: skip
        assert "Six-seat probe" in text
        assert "first harmonic" in text
        run("compensate", PART, "--map", tmp_path / "map.nc", "-o", tmp_path / "points.csv")
        u = np.array([float(row["u_um"]) for row in rows(tmp_path / "points.csv")])
        assert len(u) == 140
        assert np.all((u > 0.3) & (u < 0.5))

    def test_wozniak(self, tmp_path: Path) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind",
                   "wozniak", "-o", tmp_path / "map.csv", "--plot",
                   tmp_path / "map.png", "--verbose")  # fmt: skip
        assert "lobes found at azimuth" in text
        assert (tmp_path / "map.png").stat().st_size > 10_000

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--kind", "magic"], "there are mean, sectors, wozniak, harmonic, physical, auto"),
            (["--kind", "wozniak", "--transducer", "laser"], "not one of 'contact', 'piezo'"),
            (["--kind", "mean", "--lobe-azimuth", "30"], "only for kind wozniak (--lobe-azimuth"),
        ],
    )
    def test_errors_teach(self, options: list[str], words: str) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, *options, code=2)
        assert words in text
