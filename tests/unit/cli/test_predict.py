"""pretravel predict: columns, units, errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.commands import rows, run
from tests.support.examples import PART


class TestPredict:
    COLUMNS = (
        "polar_deg",
        "azimuth_deg",
        "trigger_force_N",
        "sensing_distance_um",
        "pretravel_um",
        "seat",
    )

    @pytest.mark.parametrize("model", ["shen", "analytic"])
    def test_columns_and_order(self, tmp_path: Path, model: str) -> None:
        out = tmp_path / "map.csv"
        options = ["--azimuth", "0:60:10", "--polar", "10:90:10", "-o", out]
        lever = ["--lever", 50]
        run("predict", "omp40-2", "--model", model, *lever, *options)
        table = rows(out)
        assert list(table[0])[:6] == list(self.COLUMNS)
        shares = [name for name in table[0] if name.startswith("share_")]
        assert shares
        assert all(name.endswith("_um") for name in shares)
        angles = [(float(r["polar_deg"]), float(r["azimuth_deg"])) for r in table]
        assert angles == [(p, a) for p in range(10, 91, 10) for a in range(0, 61, 10)]
        for row in table:
            total = sum(float(row[name]) for name in shares)
            assert total == pytest.approx(float(row["pretravel_um"]), rel=1e-9, abs=1e-12)

    def test_force_at_90_degrees(self, tmp_path: Path) -> None:
        """0.9657 N: azimuth 0 of the first line of the reference notes, lever 50 mm."""
        out = tmp_path / "map.csv"
        run("predict", "omp40-2", "--model", "shen", "--lever", 50, "--azimuth", 0, "--polar", 90,
            "-o", out)  # fmt: skip
        assert float(rows(out)[0]["trigger_force_N"]) == pytest.approx(0.9657, abs=5e-5)

    def test_own_description(self, tmp_path: Path) -> None:
        text = run("probes", "omp40-2")
        mine = tmp_path / "mine.toml"
        mine.write_text(text.replace("preload_N = 5.91", "preload_N = 4.0"))
        out = tmp_path / "map.json"
        text = run("predict", mine, "--azimuth", 0, "--polar", 90, "-o", out)
        assert "0.507" in text
        assert "in the frame of the probe" in " ".join(text.split())

    def test_a_predicted_map_compensates(self, tmp_path: Path) -> None:
        for ending in (".json", ".csv"):
            out = tmp_path / f"map{ending}"
            run("predict", "omp40-2-100mm", "-o", out)
            run("compensate", PART, "--map", out, "-o", tmp_path / "points.csv")
            assert len(rows(tmp_path / "points.csv")) == 140

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["omp41"], "neither a probe of the catalogue"),
            (["omp40-2", "--model", "magic"], "there are analytic, fem, ren, shen, wozniak"),
            (["omp40-2", "--azimuth", "0:10"], "--azimuth 0:10"),
            (["omp40-2", "--azimuth", "0:10:0"], "step above 0"),
            (["omp40-2", "--polar", "178"], "never triggers"),
            (["omp40-2", "--polar", "200"], "between 0 and 180"),
            (["omp40-2", "--polar", "nan"], "--polar nan"),
            (["omp40-2", "--workpiece", "cheese"], "known are aluminium"),
            (["omp40-2", "--lever", "10"], "shorter than the stylus"),
            (["omp40-2", "--lever", "-10", "--model", "shen"], "--lever -10"),
            (["omp40-2", "-o", "map.xyz"], "the ending must be"),
            (["omp40-2", "-o", "no/such/folder/map.csv"], "does not exist"),
            (["omp40-2", "--plot", "map.bmp"], "the ending must be"),
            (["omp40-2", "--gravity", "down"], "three numbers"),
        ],
    )
    def test_errors_teach(
        self, arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        assert words in run("predict", *arguments, code=2)
        assert not list(tmp_path.iterdir())
