"""pretravel slide: columns, the thesis, faces of parts, errors."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.design.probing.touching import touch
from pretravel.surface.parametric import Convex
from pretravel.touches.targets import Targets
from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES

PART = EXAMPLES / "part.step"


class TestSlide:
    COLUMNS = ("step", "feed_mm", "deflection_mm", "Cx", "Cy", "Cz", "Tx", "Ty", "Tz",
               "nx", "ny", "nz", "force_N", "triggered")  # fmt: skip

    def test_the_contract(self, tmp_path: Path) -> None:
        out, picture = tmp_path / "slide.csv", tmp_path / "slide.png"
        text = run("slide", "omp40-2", "--surface", "convex", "--at", "0.5,-0.5", "--step", 0.001,
                   "--steps", 20, "-o", out, "--plot", picture)  # fmt: skip
        table = rows(out)
        assert set(self.COLUMNS) <= set(table[0])
        assert len(table) == 20
        assert float(table[19]["deflection_mm"]) == pytest.approx(0.023993, rel=1e-3)
        triggered = [int(row["triggered"]) for row in table]
        assert triggered == sorted(triggered)
        assert triggered[0] == 0
        assert triggered[-1] == 1
        first = triggered.index(1)
        assert f"triggers in step {first + 1}" in text
        at_once = [line for line in text.splitlines() if "without steps, " in line]
        assert "2.98" in at_once[0]
        assert "(pretravel if the tip deflects across the" in at_once[0]
        local = Convex().local(np.array([[0.5, -0.5]]))
        whole = touch("omp40-2", "convex", Targets(local.point, local.normal)).pretravel[0]
        assert f"{1e3 * whole:.3f} µm (pretravel with every elastic part" in at_once[1]
        # Force is known until the trigger; then a seat is open and the cell is empty.
        assert all(
            (row["force_N"] == "") == (t == 1) for row, t in zip(table, triggered, strict=True)
        )
        for row in table:
            c, t, n = (
                np.array([float(row[f"{letter}{axis}"]) for axis in "xyz"]) for letter in "CTn"
            )
            assert np.abs(c - t - 3.0 * n).max() < 1e-9
        assert picture.read_bytes()[:4] == b"\x89PNG"

    @pytest.mark.published("Rodrigues 2021", "Figures 4.1 to 4.6")
    def test_the_force_of_every_trial_on_an_inclined_face(self, tmp_path: Path) -> None:
        """Section 4.2: bounds 0 and 5 N, inner points at 0.382 and 0.618 of what is left."""
        out = tmp_path / "slide.csv"
        run("slide", "omp40-2", "--surface", "plane:polar=40", "--at", "0,0", "--process",
            "inclined", "--search", "golden", "--steps", 12, "-o", out)  # fmt: skip
        table = rows(out)
        golden, low, high, trials = (math.sqrt(5.0) - 1.0) / 2.0, 0.0, 5.0, iter(table)
        for row in trials:
            inner = high - golden * (high - low), low + golden * (high - low)
            assert float(row["applied_force_N"]) == pytest.approx(inner[0], rel=1e-9)
            if row["triggered"] == "1":
                assert (row["force_N"], row["open_seat"] != "") == ("", True)
                high = inner[0]
                continue
            assert row["open_seat"] == ""
            low, other = inner[0], next(trials, None)
            if other is None:
                break
            assert float(other["applied_force_N"]) == pytest.approx(inner[1], rel=1e-9)
            low, high = (low, inner[1]) if other["triggered"] == "1" else (inner[1], high)
        assert {row["triggered"] for row in table} == {"0", "1"}
        assert all((row["penetration_A-left_mm"] == "") == (row["force_N"] == "") for row in table)

    def test_the_ellipsoid_as_in_the_thesis(self, tmp_path: Path) -> None:
        out = tmp_path / "slide.csv"
        run("slide", "omp40-2", "--surface", "ellipsoid:a=10,b=10,c=6", "--at",
            f"0,{math.radians(40.0)}", "-o", out)  # fmt: skip
        assert float(rows(out)[19]["deflection_mm"]) == pytest.approx(0.044346, abs=1e-6)

    def test_a_face_of_a_part(self, tmp_path: Path) -> None:
        text = run("slide", "omp40-2", "--surface", f"{PART}#1", "--at", "10,10",
                   "--kinematics", "full", "--model", "shen")  # fmt: skip
        assert "triggers in step" in text

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--surface", "convex", "--at", "2,0"], "is not on the surface"),
            (["--surface", "convex", "--at", "middle"], "expected two numbers"),
            (["--surface", "convex", "--at", "0,0", "--step", "0"], "--step 0: it should be"),
            (["--surface", "convex", "--at", "0,0", "--steps", "0"], "--steps 0: it should be"),
            (["--surface", "convex", "--at", "0,0", "--process", "odd"], "not one of 'curved'"),
            (["--surface", "convex", "--at", "0,0", "--search", "golden"], "vertical and inclined"),
            (["--surface", "convex", "--at", "0.5,0.5", "--process", "vertical"], "for walls"),
            (
                [
                    "--surface",
                    "plane:polar=40",
                    "--at",
                    "0,0",
                    "--process",
                    "inclined",
                    "--kinematics",
                    "full",
                ],
                "are for the process curved",
            ),
            (["--surface", "plane:polar=40", "--at", "0,0", "--process", "sideways"], "vertical"),
            (
                ["--surface", "plane:polar=0", "--at", "0,0"],
                "full kinematics let it move along the axis (--kinematics)",
            ),
            (["--surface", "sphere:radius=5", "--at", "0,0"], "perpendicular to the probe axis"),
        ],
    )
    def test_errors_teach(self, arguments: list[str], words: str, tmp_path: Path) -> None:
        out = tmp_path / "slide.csv"
        assert words in run("slide", "omp40-2", *arguments, "-o", out, code=2)
        assert not out.exists()

    def test_golden_section(self) -> None:
        text = run("slide", "omp40-2", "--surface", "plane:polar=40", "--at", "0,0", "--process",
                   "inclined", "--search", "golden", "--steps", 80)  # fmt: skip
        assert "trials of a golden section" in text
        at_once = text.split("without steps, lateral")[1].split()[0]
        assert f"{at_once} µm (travel from first contact to trigger" in text
        # From first contact to the trigger the contact slides down 40°: feed / tan(40°).
        slide = float(text.split("  slide ")[1].split()[0])
        assert slide == pytest.approx(float(at_once) / math.tan(math.radians(40.0)), rel=1e-3)
