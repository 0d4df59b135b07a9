"""pretravel export: files of controls, refusals."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from pretravel.formats.map_file import write_map
from tests.support.commands import rows, run
from tests.support.example_maps import example_map


class TestExportCommand:
    @pytest.fixture
    def map_file(self, tmp_path: Path) -> Path:
        path = tmp_path / "map.nc"
        write_map(path, example_map())
        return path

    def test_csv_of_effective_radii(self, tmp_path: Path, map_file: Path) -> None:
        run("export", map_file, "--to", "csv", "-o", tmp_path / "r.csv")
        for row in rows(tmp_path / "r.csv")[:5]:
            radius = 3.0 - float(row["pretravel_um"]) * 1e-3
            assert float(row["effective_radius_mm"]) == pytest.approx(radius, abs=1e-9)

    def test_linuxcnc_folder_without_stale_tables(self, tmp_path: Path, map_file: Path) -> None:
        out = tmp_path / "subs"
        run("export", map_file, "--to", "linuxcnc", "--form", "table", "-o", out)
        assert (out / "pretravel_table.ngc").exists()
        run("export", map_file, "--to", "linuxcnc", "-o", out)
        assert not (out / "pretravel_table.ngc").exists()
        lookup = (out / "pretravel_lookup.ngc").read_text()
        assert "largest error against the map 0.000 um" in lookup
        for text in (path.read_text() for path in out.iterdir()):
            assert max(map(len, text.splitlines())) <= 250

    def test_a_delay_wants_the_feed(self, tmp_path: Path) -> None:
        path = tmp_path / "rest.nc"
        write_map(path, replace(example_map(), delay=0.01, u_delay=1e-4, feed=None))
        out = tmp_path / "r.txt"
        assert "--feed" in run("export", path, "--to", "renishaw", "-o", out, code=2)
        run("export", path, "--to", "renishaw", "-o", out, "--feed", 60)
        slow = re.search(r"^#500=([\d.]+)", out.read_text(), re.M)
        run("export", path, "--to", "renishaw", "-o", out, "--feed", 120)
        fast = re.search(r"^#500=([\d.]+)", out.read_text(), re.M)
        # 1 mm/s more for 10 ms.
        assert slow is not None
        assert fast is not None
        assert float(slow[1]) - float(fast[1]) == pytest.approx(0.010, abs=1.1e-5)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--to", "siemens", "-o", "x"], "--to siemens: it is not known; there are linuxcnc"),
            (["--to", "renishaw"], "no output was given"),
            (["--to", "linuxcnc", "-o", "x.ngc"], "a folder is needed"),
            (["--to", "renishaw", "-o", "/nowhere/x.txt"], "does not exist"),
            (["--to", "renishaw", "-o", "x.txt", "--base", "5"], "not all common ones"),
            (["--to", "fanuc", "-o", "x.txt", "--base", "900"], "not all common ones"),
            (["--to", "renishaw", "-o", "x.txt", "--criterion", "best"], "not one of 'max', 'rms'"),
            (["--to", "linuxcnc", "-o", "x", "--tolerance", "0"], "greater than or equal to"),
        ],
    )
    def test_refused(
        self, tmp_path: Path, map_file: Path, monkeypatch: pytest.MonkeyPatch,
        options: list[str], words: str,
    ) -> None:  # fmt: skip
        monkeypatch.chdir(tmp_path)
        assert words in run("export", map_file, *options, code=2)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["map.nc"]
