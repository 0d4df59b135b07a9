"""pretravel program and machine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

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

    def test_plan_and_program_of_a_part(self, tmp_path: Path) -> None:
        mill, plan, out = (tmp_path / name for name in ("mill.toml", "plan.csv", "p.ngc"))
        mill.write_text(run("machine"))
        run("plan", PART, "--spacing", 25, "--margin", 5, "-o", plan)
        told = run("program", "part", mill, plan, "--surface", PART, "-o", out)
        assert "checked: moves" in told
        text = out.read_text()
        assert all(f"(touch {row['label']})" in text for row in rows(plan))

    def test_a_map_without_feed_is_named(self, tmp_path: Path) -> None:
        """The feed of the qualification cannot be compared with that of the program."""
        mill, plan, out = (tmp_path / name for name in ("mill.toml", "plan.csv", "p.ngc"))
        mill.write_text(run("machine"))
        plan.write_text("label,x_mm,y_mm,z_mm,nx,ny,nz\ntop,0,0,0,0,0,1\n")
        given = ["program", "part", mill, plan, "-o", out, "--compensated", tmp_path / "map.json"]
        write_map(tmp_path / "map.json", mean_map(0.010))
        assert "map.json states no feed" in both_outputs(*given)[1]
        feed = read_machine(mill).measuring_feed
        write_map(tmp_path / "map.json", replace(mean_map(0.010), feed=feed))
        assert "states no feed" not in both_outputs(*given)[1]
