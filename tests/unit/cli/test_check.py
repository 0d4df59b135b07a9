"""Patterns and figures of standards: pretravel pattern and check."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.commands import rows, run
from tests.support.examples import PART, SPHERE


class TestStandards:
    def test_pattern_simulate_check(self, tmp_path: Path) -> None:
        targets, touches = tmp_path / "t.csv", tmp_path / "s.csv"
        run("pattern", "iso10360-5", "--diameter", 25, "--center", "1,2,3", "-o", targets)
        assert len(rows(targets)) == 25
        run("simulate", "omp40-2", "--surface", "sphere:radius=12.5,x=1,y=2,z=3", "--targets",
            targets, "-o", touches)  # fmt: skip
        text = run("check", "iso10360-5", touches, "--diameter", 25, "--tip-diameter", 6,
                   "--form-limit", 3, "--size-limit", 3, "-o", tmp_path / "c.html",
                   code=3)  # fmt: skip
        assert "recalled" in text
        assert "conforms" in text
        assert "does not conform" in text  # wrong by a mean pretravel

    def test_map_puts_form_and_size_right(self, tmp_path: Path) -> None:
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "physical",
            "-o", tmp_path / "map.nc")  # fmt: skip
        run("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--map", tmp_path / "map.nc",
            "-o", tmp_path / "after.csv")  # fmt: skip
        run("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6,
            "-o", tmp_path / "before.csv")  # fmt: skip
        before, after = (
            [abs(float(row["value_um"])) for row in rows(tmp_path / f"{name}.csv")]
            for name in ("before", "after")
        )
        # The range of 25 touches of 0.3 um is 4 sigma, 1.2 um; the size has 0.1 um.
        assert before[0] > 5.0 > 2.0 > after[0]
        assert before[1] > 20.0 > 0.6 > after[1]

    def test_iso230_10(self) -> None:
        text = run("check", "iso230-10", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6)
        assert all(figure in text for figure in ("P_FTU,2D", "P_FTU,3D", "R_SPT"))

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["iso9999", SPHERE, "--diameter", 25], "there are iso10360-5, iso230-10"),
            (["iso10360-5", PART, "--diameter", 25], "not the 25 points"),
            (
                ["iso10360-5", SPHERE, "--diameter", 12.5, "--tip-diameter", 6],
                "(--diameter, --tip-diameter)",
            ),
            (
                ["iso10360-5", SPHERE, "--diameter", 25, "--u-diameter", -1],
                "greater than or equal to 0",
            ),
            (["iso10360-5", SPHERE, "--diameter", 25, "--size-limit", 1], "give --tip-diameter"),
            (["iso230-10", SPHERE, "--diameter", 25, "--size-limit", 1], "only for iso10360-5"),
        ],
    )
    def test_errors_teach(self, arguments: list[object], words: str) -> None:
        assert words in run("check", *arguments, code=2)
