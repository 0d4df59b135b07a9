"""pretravel program and machine."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from pretravel.files.machine_file import read_machine
from pretravel.files.map_file import write_map
from tests.support.commands import both_outputs, rows, run
from tests.support.example_maps import mean_map
from tests.support.examples import ROOT

PART = ROOT / "examples" / "linuxcnc" / "part.step"


class TestCommands:
    def test_sphere_program_and_its_patterns(self, tmp_path: Path) -> None:
        mill, out = tmp_path / "mill.toml", tmp_path / "s.ngc"
        mill.write_text(run("machine"))
        run("program", "sphere", mill, "--diameter", 25, "--pattern", "iso10360-5", "-o", out)
        assert out.read_text().count("(LOG,%.4ftouch") == 25
        assert "0 and 180" in run(
            "program", "sphere", mill, "--diameter", 25, "--polar", "200", "-o", out, code=2
        )
        assert "there are rings" in run(
            "program", "sphere", mill, "--diameter", 25, "--pattern", "x", "-o", out, code=2
        )
        assert "pretravel machine >" in run(
            "program", "sphere", tmp_path / "no.toml", "--diameter", 25, "-o", out, code=2
        )

    def test_a_sphere_is_touched_in_passes_of_different_order(self, tmp_path: Path) -> None:
        """Repeats in a row do not show a drift, and passes in one order no hysteresis."""
        mill, out = tmp_path / "mill.toml", tmp_path / "s.ngc"
        mill.write_text(run("machine"))
        iso = ("--diameter", 25, "--pattern", "iso10360-5")
        run("program", "sphere", mill, *iso, "--repeats", 3, "-o", out)
        touched = re.findall(r"\(touch s(\d+)\.(\d)\)", out.read_text())
        assert [number for _, number in touched] == [*"1" * 25, *"2" * 25, *"3" * 25]
        orders = [[int(row) for row, _ in touched[first : first + 25]] for first in (0, 25, 50)]
        assert all(sorted(order) == list(range(1, 26)) for order in orders)
        before = [set(pairwise(order)) for order in orders]
        assert len(before[0] & before[1]) + len(before[1] & before[2]) < 12
        assert orders[0][-1] != orders[1][0]

    @pytest.mark.long
    def test_plan_and_program_of_a_part(self, tmp_path: Path) -> None:
        mill, plan, out = (tmp_path / name for name in ("mill.toml", "plan.csv", "p.ngc"))
        mill.write_text(run("machine"))
        run("plan", PART, "--spacing", 25, "--margin", 5, "-o", plan)
        told = run("program", "part", mill, plan, "--surface", PART, "-o", out)
        assert "checked: the moves" in told
        text = out.read_text()
        assert all(f"(touch {row['label']})" in text for row in rows(plan))

    def test_a_map_without_feed_is_named(self, tmp_path: Path) -> None:
        """The feed of the qualification cannot be compared with that of the program."""
        mill, plan, out = (tmp_path / name for name in ("mill.toml", "plan.csv", "p.ngc"))
        mill.write_text(run("machine"))
        plan.write_text("label,x_mm,y_mm,z_mm,nx,ny,nz\ntop,0,0,0,0,0,1\n")
        given = ["program", "part", mill, plan, "-o", out, "--compensated", tmp_path / "map.json"]
        write_map(tmp_path / "map.json", mean_map(0.010))
        assert "map.json has no feed" in both_outputs(*given)[1]
        feed = read_machine(mill).measuring_feed
        write_map(tmp_path / "map.json", replace(mean_map(0.010), feed=feed))
        assert "has no feed" not in both_outputs(*given)[1]
        head = "label,x_mm,y_mm,z_mm,nx,ny,nz,feed_mm_min,spindle_deg"
        plan.write_text(f"{head}\ntop,0,0,0,0,0,1,37,90\n")
        told = " ".join(both_outputs(*given)[1].split())
        assert f"feed of 37 mm/min (feed_mm_min), the program touches at {feed:g}" in told
        assert "the targets state spindle_deg 90, which is not used" in told
        rows = (
            "nx,ny,nz,x_mm,y_mm,z_mm,Temperature\n0,0,1,0,0,0,25\n0,0,1,9,0,0,26\n# offset Z 0.5\n"
        )
        plan.write_text(f"# tip diameter 4 mm\n{rows}")
        told = " ".join(both_outputs(*given)[1].split())
        for stated in ("tip a diameter of 4 mm", "Temperature is 25 to 26", "line 5 '# offset Z"):
            assert stated in told


class TestAxis:
    C = ("--axis", "C", "--diameter", 25, "--center", "60,0,0", "--about", "0,0,0")
    A = ("--axis", "A", "--diameter", 25, "--center", "0,30,-20", "--about", "0,0,-60")

    def _program(self, tmp_path: Path, *words: object, code: int = 0) -> str:
        mill, out = tmp_path / "mill.toml", tmp_path / "a.ngc"
        mill.write_text(run("machine"))
        said = run("program", "axis", mill, *words, "-o", out, code=code)
        return said if code else out.read_text()

    def test_the_sphere_turns_against_the_angle(self, tmp_path: Path) -> None:
        """60 mm from C, at 0, 90 and 180 degrees: +X, -Y, -X; with the angle at 90: +Y."""
        stated = (*self.C, "--angles", "0,90,180", "--polar", "0")
        text = self._program(tmp_path, *stated)
        places = re.findall(r"touch,(at\d+)_s1,.*?,50,([-\d.]+),([-\d.]+),12.5,#5070", text)
        assert places == [("at0", "60", "0"), ("at90", "0", "-60"), ("at180", "-60", "0")]
        assert "\nG1 C90 F1000\n" in text
        # The turn is at the safe height: after the way up, before the way across.
        before, after = text.split("\nG1 C90 F1000\n")
        assert re.findall(r"o<pretravel_move> call (.*)", before)[-1].startswith("[60] [0] [50]")
        assert re.findall(r"o<pretravel_move> call (.*)", after)[0].startswith("[0] [-60] [50]")
        text = self._program(tmp_path, *stated, "--sense", "with")
        assert re.search(r"touch,at90_s1,.*,50,0,60,12.5,#5070", text)

    def test_what_cannot_be_planned(self, tmp_path: Path) -> None:
        assert "needs 3" in self._program(tmp_path, *self.C, "--angles", "0,90", code=2)
        twice = self._program(tmp_path, *self.C, "--angles", "0,90,180,0", code=2)
        assert "occurs twice" in twice
        # Radians: 60 mm · 2 sin(1.047°) = 2.19 mm.
        radians = self._program(tmp_path, *self.C, "--angles", "0,1.047,2.094", code=2)
        assert "moves by 2.2 mm: that shows no axis" in radians
        small = [0.98 if word == 25 else word for word in self.C]  # in inches
        told = self._program(tmp_path, *small, "--angles", "0,90,180", code=2)
        assert "the tip (6 mm) is larger than the sphere (0.98 mm)" in told
        # 98.5 mm from A at an elevation of 23.96 degrees: its top is 38.5 mm high 66.04 further.
        high = ("--axis", "A", "--diameter", 25, "--center", "0,90,-20", "--about", "0,0,-60")
        swung = self._program(tmp_path, *high, "--angles=0,-130,-150", code=2)
        assert "comes up to the tip at -66 degrees" in swung
        assert "must be at 54.98" in swung  # 38.488 + 12.5 + 3 + 1
        shank = self._program(tmp_path, *self.A, "--angles", "0,20,40", "--shank", 5, code=2)
        assert "shank" in shank
