"""pretravel faces and plan, whose files simulate reads."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES

PART = EXAMPLES / "part.step"


class TestFacesAndPlan:
    def test_faces(self, tmp_path: Path) -> None:
        out, picture = tmp_path / "faces.csv", tmp_path / "faces.png"
        text = run("faces", PART, "-o", out, "--plot", picture)
        assert "1 face, 60.00 x 40.00" in text
        (row,) = rows(out)
        assert (row["face"], row["type"]) == ("1", "B-spline")
        assert float(row["nz"]) > 0.5
        assert picture.exists()

    def test_plan_is_read_by_simulate(self, tmp_path: Path) -> None:
        plan, touches = tmp_path / "plan.csv", tmp_path / "touches.csv"
        text = run("plan", f"{PART}#1", "--spacing", 6, "-o", plan,
                   "--plot", tmp_path / "p.png")  # fmt: skip
        count = len(rows(plan))
        assert f"{count} targets" in text
        run("simulate", "omp40-2", "--surface", PART, "--targets", plan, "-o", touches)
        assert [row["label"] for row in rows(touches)] == [row["label"] for row in rows(plan)]

    def test_a_feed_of_the_targets_is_that_of_the_touches(self, tmp_path: Path) -> None:
        targets, touches = tmp_path / "t.csv", tmp_path / "s.csv"
        targets.write_text("nx,ny,nz,feed_mm_min\n0,0,1,400\n")
        given = ("simulate", "omp40-2", "--surface", "sphere:radius=10", "--targets", targets,
                 "--delay", 2, "-o", touches)  # fmt: skip
        run(*given)
        assert [row["feed_mm_min"] for row in rows(touches)] == ["400"]
        assert "t.csv has 400 mm/min" in run(*given, "--feed", 100, code=2)

    def test_by_curvature_and_grid(self, tmp_path: Path) -> None:
        for way in (["--curvature", 50], ["--grid", "6x4"]):
            run("plan", PART, *way, "-o", tmp_path / "plan.csv")
        assert len(rows(tmp_path / "plan.csv")) == 8  # its rim lies within the margin

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--grid", "6"], "the points along u and the points along v"),
            ([], "one way to choose"),
            (["--grid", "2x2", "--max-polar", "0"], "greater than or equal to 0.001"),
            (["--grid", "2x2", "--u", "5"], "expected two numbers"),
        ],
    )
    def test_errors_teach(self, arguments: list[str], words: str, tmp_path: Path) -> None:
        out = tmp_path / "plan.csv"
        assert words in run("plan", PART, *arguments, "-o", out, code=2)
        assert not out.exists()

    def test_surfaces_that_cannot_be(self, tmp_path: Path) -> None:
        out = tmp_path / "plan.csv"
        for surface, words in (
            (f"{PART}#2", "has no face 2; it has 1"),
            (f"{PART}#top", "no face named 'top'"),
            ("nowhere.step", "cannot be opened"),
            ("nowhere.py", "no such file"),
            ("cone:radius=5,half_angle=95", "between 0 and 90"),
        ):
            assert words in run("plan", surface, "--grid", "2x2", "-o", out, code=2)

    def test_a_surface_of_ones_own(self, tmp_path: Path) -> None:
        mine = tmp_path / "mine.py"
        mine.write_text(
            "import numpy as np\nfrom pretravel import FunctionSurface\n"
            "dome = FunctionSurface(lambda u, v: (u, v, 5 * np.cos(0.1 * u)), (-9, 9), (-9, 9))\n"
        )
        out = tmp_path / "plan.csv"
        run("plan", f"{mine}#dome", "--grid", "5x5", "-o", out)
        assert len(rows(out)) == 9
        assert "does not define 'surface'" in run("plan", mine, "--grid", "3x3", "-o", out, code=2)
        mine.write_text("surface = 1 / 0")
        assert "ZeroDivisionError" in run("plan", mine, "--grid", "3x3", "-o", out, code=2)
