"""pretravel export: files of controls, refusals."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel import qualify
from pretravel.base.directions import ring_pattern
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls.exports import CONTROLS
from pretravel.files.map_file import write_map
from pretravel.maps.support import DirectionSupport
from tests.support.commands import rows, run
from tests.support.example_maps import example_map
from tests.support.examples import EXAMPLES


def texts(path: Path) -> list[str]:
    """Of a file, or of the files of a folder."""
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    return [file.read_text() for file in files]


@pytest.fixture(scope="module")
def map_content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("map") / "map.json"
    write_map(path, example_map())
    return path.read_bytes()


class TestExportCommand:
    @pytest.fixture
    def map_file(self, tmp_path: Path, map_content: bytes) -> Path:
        path = tmp_path / "map.json"
        path.write_bytes(map_content)
        return path

    def test_help_names_every_control(self) -> None:
        shown = run("export", "--help")
        for name in [*CONTROLS, "csv"]:
            assert name in shown

    def test_csv_of_effective_radii(self, tmp_path: Path, map_file: Path) -> None:
        text = run("export", map_file, "--to", "csv", "-o", tmp_path / "r.csv")
        assert " ".join(text.split()).endswith(
            "r.csv: radii in the directions in which the map holds"
        )
        assert ":\n" not in text
        for row in rows(tmp_path / "r.csv")[:5]:
            radius = 3.0 - float(row["pretravel_um"]) * 1e-3
            assert float(row["effective_radius_mm"]) == pytest.approx(radius, abs=1e-9)
        # Touches of the equator lie up to 0.04° below it: there was a row of 90.039526044.
        assert {float(row["polar_deg"]) % 5.0 for row in rows(tmp_path / "r.csv")} == {0.0}
        # The azimuths of a lying probe are not those of the machine.
        lying = replace(example_map(), rotation=probe_rotation((0.0, -1.0, 0.0)))
        write_map(tmp_path / "y.json", lying)
        text = " ".join(
            run("export", tmp_path / "y.json", "--to", "csv", "-o", tmp_path / "y2.csv").split()
        )
        assert "azimuth 0° is (1, 0, 0) and 90° is (0, 0, 1), in axes of the machine" in text

    def test_linuxcnc_folder_without_stale_tables(self, tmp_path: Path, map_file: Path) -> None:
        out = tmp_path / "subs"
        run("export", map_file, "--to", "linuxcnc", "--form", "table", "-o", out)
        assert (out / "pretravel_table.ngc").exists()
        run("export", map_file, "--to", "linuxcnc", "-o", out)
        assert not (out / "pretravel_table.ngc").exists()
        lookup = (out / "pretravel_lookup.ngc").read_text()
        assert "largest difference from the map 0.000 um" in lookup
        for text in (path.read_text() for path in out.iterdir()):
            assert max(map(len, text.splitlines())) <= 250

    @pytest.mark.long
    def test_a_text_of_the_map_is_no_line_of_a_program(self, tmp_path: Path) -> None:
        """No line of any file moves or switches anything, whatever the map says of its source."""
        path = tmp_path / "smuggled.json"
        # A narrow range of directions, because errors of tables are found by trying them all.
        support = DirectionSupport(ring_pattern(np.array([85.0, 90.0]) * DEGREE, 24))
        usual = replace(example_map(), support=support, touched=None)
        source = 'x\nM3 S20000\nG0 Z-80\n)(G0 Z-90)\r\n#3000=1\n%\n"SETAL(1)'
        smuggled = replace(usual, provenance=replace(usual.provenance, source=source))
        write_map(path, smuggled)
        write_map(tmp_path / "plain.json", usual)
        # The JSON of radii is no program; it escapes its texts.
        for to, control in [item for item in CONTROLS.items() if item[0] != "radii"]:
            out = tmp_path / (to if control.folder else f"{to}.txt")
            coarse = ["--tolerance", 50] if "tolerance" in control.options else []
            run("export", path, "--to", to, "-o", out, *coarse)
            plain = tmp_path / f"plain-{out.name}"
            run("export", tmp_path / "plain.json", "--to", to, "-o", plain, *coarse)
            for one, other in zip(texts(out), texts(plain), strict=True):
                changed = [
                    line
                    for line, before in zip(one.splitlines(), other.splitlines(), strict=True)
                    if line != before
                ]
                assert len(changed) <= 1
                for line in changed:
                    assert re.fullmatch(r"\([^()]*\)|; [^;]*", line)
                assert one.count("%") == other.count("%")

    def test_console_and_file_state_angles_units_and_residual(
        self, tmp_path: Path, map_file: Path
    ) -> None:
        out = tmp_path / "radii.nc"
        printed = run("export", map_file, "--to", "renishaw", "-o", out)
        assert "THE ANGLES ARE OUTWARD NORMALS" in printed
        assert "UNITS MM" in printed
        assert "UM AT MOST" in printed
        options = ["--angles", "travel", "--units", "inch", "--base", 600, "--program", 1234]
        printed = run("export", map_file, "--to", "renishaw", "-o", out, *options)
        assert "THE ANGLES ARE DIRECTIONS OF TRAVEL" in printed
        assert "UNITS INCH" in printed
        text = out.read_text()
        assert all(line in text for line in printed.splitlines()[1:])
        assert "O1234 (" in text
        assert "#617=" in text
        for to in ("fanuc", "haas", "siemens"):
            printed = run("export", map_file, "--to", to, "-o", tmp_path / to, "--tolerance", 50)
            assert "NOT YET TRIED ON A" in printed.upper()
            assert "UNITS MM" in printed.upper()
            # The filter of comments has found nothing to replace in our own sentences.
            assert "_" not in re.sub(r"PT_[A-Z]+|PRETRAVEL_[A-Z]+", "", printed.partition("\n")[2])
        printed = run("export", map_file, "--to", "heidenhain", "-o", tmp_path / "h.3DTC")
        assert "UNVERIFIED" in printed.splitlines()[1]

    def test_a_delay_wants_the_feed(self, tmp_path: Path) -> None:
        path = tmp_path / "rest.json"
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
            (["--to", "fagor", "-o", "x"], "--to fagor: it is not known; there are linuxcnc"),
            (["--to", "renishaw"], "no output was given"),
            (["--to", "linuxcnc", "-o", "x.ngc"], "a folder is needed"),
            (["--to", "renishaw", "-o", "/nowhere/x.txt"], "does not exist"),
            (["--to", "renishaw", "-o", "x.txt", "--base", "5"], "5 does not belong to the user"),
            (["--to", "renishaw", "-o", "x.txt", "--base", "990"], "would end at #1007"),
            (["--to", "renishaw", "-o", "x.txt", "--program", "10000"], "--program"),
            (["--to", "fanuc", "-o", "x", "--base", "100"], "lose their values at power-off"),
            (["--to", "fanuc", "-o", "x", "--base", "990"], "variables are too few for a table"),
            (["--to", "fanuc", "-o", "x", "--program", "9999"], "program number 9999"),
            (
                ["--to", "fanuc", "-o", "x", "--angles", "travel"],
                "angles is only for renishaw",
            ),
            (["--to", "haas", "-o", "x", "--base", "560"], "560 does not belong to the user"),
            (["--to", "siemens", "-o", "x", "--base", "500"], "base is only for"),
            (["--to", "haas", "-o", "x", "--template", "none.txt"], "template is only for"),
            (["--to", "heidenhain", "-o", "x.txt", "--template", "none.txt"], "none.txt: cannot"),
            (["--to", "haas", "-o", "x", "--azimuth", "5"], "only for heidenhain"),
            (["--to", "fanuc", "-o", "x", "--criterion", "max"], "only for renishaw"),
            (["--to", "renishaw", "-o", "x", "--form", "table"], "only for linuxcnc"),
            (["--to", "linuxcnc", "-o", "x", "--units", "inch"], "only for renishaw, fanuc, haas"),
            (["--to", "fanuc", "-o", "x.nc"], "a folder is needed"),
            (["--to", "renishaw", "-o", "x.txt", "--criterion", "best"], "not one of 'max', 'rms'"),
            (
                ["--to", "renishaw", "-o", "x.txt", "--tolerance", "1"],
                "tolerance is only for linuxcnc, fanuc, haas or siemens",
            ),
            (["--to", "linuxcnc", "-o", "x", "--tolerance", "0"], "greater than or equal to"),
        ],
    )
    def test_refused(
        self, tmp_path: Path, map_file: Path, monkeypatch: pytest.MonkeyPatch,
        options: list[str], words: str,
    ) -> None:  # fmt: skip
        monkeypatch.chdir(tmp_path)
        assert words in run("export", map_file, *options, code=2)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["map.json"]


@pytest.mark.long
def test_compare_says_what_a_control_will_have(tmp_path: Path) -> None:
    """A table rounds off the kinks of six seats; the formula that export writes does not."""
    map_file = tmp_path / "map.json"
    touches = EXAMPLES / "sphere_touches.csv"
    write_map(map_file, qualify(touches, 24.9987, tip_diameter=6.0, kind="physical").pretravel_map)
    left = {}
    for form in ("table", "formula"):
        output = tmp_path / f"{form}.csv"
        run("compare", map_file, "--for", "haas", "--form", form, "-o", output)
        (left[form],) = (
            float(row["largest_um"])
            for row in rows(output)
            if row["method"].startswith("haas, ") and row["where"] == "all"
        )
    assert left["formula"] < 0.001 < 0.1 < left["table"]
    assert "form is only for control" in run("compare", map_file, "--form", "table", code=2)
