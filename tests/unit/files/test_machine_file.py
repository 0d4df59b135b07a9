"""Machine files: written and read, refused with the line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.base.units import DEGREE
from pretravel.controls.linuxcnc_files import read_tool, read_work_offset
from pretravel.controls.machine_text import machine_text
from pretravel.files.machine import Machine, work_placement
from pretravel.files.machine_file import read_machine
from tests.support.commands import run


class TestMachineFile:
    def test_out_and_in_again(self, tmp_path: Path) -> None:
        machine = Machine(
            name='a "mill"\nM3 S20000', tool=3, tool_length=-81.25, change_height=5.0,
            tip_diameter=4.0, stem_diameter=2.0, work_offset="G55",
            work=work_placement(1.25, -2.5, 3.75, 30 * DEGREE),
            limits=np.array([[-1.0, 2.0], [-3.0, 4.0], [-5.0, 6.0]]),
        )  # fmt: skip
        path = tmp_path / "mill.toml"
        path.write_text(machine_text(machine))
        again = read_machine(path)
        assert again.work is not None
        assert machine.work is not None
        assert again.limits is not None
        assert again.work.rotation == pytest.approx(machine.work.rotation, abs=1e-12)
        assert again.limits.tolist() == [[-1, 2], [-3, 4], [-5, 6]]
        blank = {"work": None, "limits": None}
        assert replace(again, **blank) == replace(machine, **blank)  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            ("[probe] -> [probes]", True, r"there is no \[probes\]"),
            (
                "measuring_mm_min -> measuring",
                True,
                "has no measuring; .*Did you mean measuring_mm_min",
            ),
            (
                "measuring_mm_min = 50 -> measuring_mm_min = 'fast'",
                True,
                "must be a number, got 'fast'",
            ),
            (
                "measuring_mm_min = 50 -> measuring_mm_min = -3",
                True,
                "must lie between 0.5 and 3000",
            ),
            ("measuring_mm_min = 50 -> measuring_mm_min = 99999", True, "between 0.5 and 3000"),
            ("measuring_mm_min = 50 -> measuring_mm_min = nan", True, "finite"),
            ("measuring_mm_min = 50 -> measuring_mm_min = 2000", True, "are the two exchanged"),
            (
                "overtravel_mm = 2 -> overtravel_mm = 60",
                True,
                "stylus of 50 mm can deflect by 10 mm",
            ),
            ("overtravel_mm = 2 -> overtravel_mm = 900000", True, "between 0.01 and 100"),
            (
                "positioning_mm_min = 1000 -> positioning_mm_min = 12000",
                True,
                "travels 321 mm further .*can deflect by 10 mm",
            ),
            (
                'tool = "none" -> tool = 1.5',
                True,
                'number of the probe in the tool table, or "none"',
            ),
            ('tool = "none" -> tool = 7', True, "needs tool_length_mm, the length of T7"),
            ('tool = "none" -> tool = 0', True, "numbers tools from 1|needs tool_length_mm"),
            ('tool = "none" -> # tool', True, r"\[probe\] needs tool"),
            (
                "stem_diameter_mm = 4.5 -> stem_diameter_mm = 6",
                True,
                "must be smaller than the tip",
            ),
            ('"G54" -> "G53"', True, "it is one of G54"),
            ("# x_mm = 0 -> x_mm = 3", True, "without y_mm, z_mm"),
            ("# [limits] -> [limits]", True, r"\[limits\] needs x_mm"),
            (
                (
                    "# [limits]\n# x_mm = [-250, 250]\n# y_mm = [-200, 200]\n# z_mm -> "
                    "[limits]\nx_mm = [1, -250, 250]\ny_mm = [-200, 200]\nz_mm"
                ),
                True,
                "must be two numbers",
            ),
            ("safe_height_mm -> # safe", True, r"\[distances\] needs safe_height_mm"),
            ('offset = "G54" ->  #', True, r"\[work\] needs offset"),
            ("[probe] -> [probe", True, "not valid TOML"),
            ("", False, "are missing"),
        ],
    )
    def test_refused(self, tmp_path: Path, text: str, line: bool, words: str) -> None:
        """A line is appended to a valid file or replaces one of its lines."""
        path = tmp_path / "mill.toml"
        old, _, new = text.partition(" -> ")
        path.write_text(machine_text(Machine()).replace(old, new) if new else text)
        with pytest.raises(InputError, match=words) as caught:
            read_machine(path)
        assert ("line " in str(caught.value)) == line

    def test_printed_from_the_files_of_a_control(self, tmp_path: Path) -> None:
        var = tmp_path / "linuxcnc.var"
        var.write_text("5210\t1\n5211\t1\n5212\t0\n5213\t0\n5220\t2\n5241\t10\n5242\t20\n5243\t-30\n"
                       "5250\t90\n")  # fmt: skip
        name, work = read_work_offset(var)
        # G92 is in the rotated coordinates: its x is the y of the machine.
        assert name == "G55"
        assert work.shift == pytest.approx([10.0, 21.0, -30.0])
        table = tmp_path / "tool.tbl"
        table.write_text("; tools\nT1 P1 D+10.0 ;end mill\nT99 P2 Z101.5 D4.0 ;probe\n")
        assert read_tool(table, 99).length == 101.5
        text = run("machine", "--var", var, "--tools", table, "--tool", 99)
        path = tmp_path / "mill.toml"
        path.write_text(text)
        machine = read_machine(path)
        assert (machine.tool, machine.tip_diameter, machine.work_offset) == (99, 4.0, "G55")
        assert machine.tool_length == 101.5
        assert "--tools" in run("machine", "--tool", 99, code=2)
        assert machine.work is not None
        assert machine.work.shift == pytest.approx([10.0, 21.0, -30.0])
        table.write_text(table.read_text() + "T99 P3 Z80 D4.0\n")
        with pytest.raises(InputError, match="line 4: T99 comes twice"):
            read_tool(table, 99)

    @pytest.mark.parametrize(
        ("text", "words"),
        [("5220 1\nhello\n", "line 2: 'hello'"), ("5220 1\n", "no parameters 5221")],
    )
    def test_parameter_files_refused(self, tmp_path: Path, text: str, words: str) -> None:
        path = tmp_path / "a.var"
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            read_work_offset(path)
