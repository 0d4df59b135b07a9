"""Patterns and figures of standards: pretravel pattern and check."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.laboratory.standards.iso230_10 import plane_pattern_36
from pretravel.show.result_file import read_result
from pretravel.touches import Touches
from tests.support.commands import both_outputs, rows, run
from tests.support.examples import EXAMPLES, PART, SPHERE
from tests.support.results import data_of

NO_TOUCHES = EXAMPLES / "README.md"
"""A file that exists and has no touches."""


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
        assert "not checked" in text
        assert "within the limit" in text
        assert "exceeds the limit" in text  # wrong by a mean pretravel

    def test_the_other_reading_of_the_pattern(self, tmp_path: Path) -> None:
        targets, touches = tmp_path / "t.csv", tmp_path / "s.csv"
        run("pattern", "iso10360-5-cumulative", "--diameter", 25, "--turn", 30, "-o", targets)
        run("simulate", "omp40-2", "--surface", "sphere:radius=12.5", "--targets",
            targets, "-o", touches)  # fmt: skip
        text = run("check", "iso10360-5", touches, "--diameter", 25, "--tip-diameter", 6)
        assert "(cumulatively)" in text.replace("\n", " ")

    @pytest.mark.parametrize(("feed", "named"), [(100, False), (300, True)])
    def test_touches_at_two_feeds_are_named(self, tmp_path: Path, feed: int, named: bool) -> None:
        """A delay of 5 ms at 300 mm/min is 17 µm more than at 100: it looks like form."""
        touches = tmp_path / "s.csv"
        head, *lines = SPHERE.read_text("utf-8").splitlines()
        feeds = [100] * (len(lines) // 2) + [feed] * (len(lines) - len(lines) // 2)
        own = [f"{line},{each}" for line, each in zip(lines, feeds, strict=True)]
        touches.write_text("\n".join([f"{head},feed_mm_min", *own]) + "\n", "utf-8")
        _, said = both_outputs("check", "iso10360-5", touches, "--diameter", 24.9987)
        assert ("the touches are at 100 to 300 mm/min" in " ".join(said.split())) is named

    def test_map_puts_form_and_size_right(self, tmp_path: Path) -> None:
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "physical",
            "-o", tmp_path / "map.json")  # fmt: skip
        with_map = run("check", "iso10360-5", SPHERE, "--diameter", 24.9987,
            "--map", tmp_path / "map.json", "-o", tmp_path / "after.csv")  # fmt: skip
        alone = run("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6,
            "-o", tmp_path / "before.csv")  # fmt: skip
        assert "as the machine reports them" in alone
        assert "as the machine reports them" not in with_map
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

    @pytest.mark.parametrize("stated", [True, False])
    def test_the_verdict_says_what_is_not_certified(self, tmp_path: Path, stated: bool) -> None:
        """Definitions are unchecked: nothing conforms to a standard, with or without u."""
        options = ["--u-diameter", 0.1, "--sphere-form", 0.1] if stated else []
        page = tmp_path / "c.html"
        text, warned = both_outputs(
            "check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 5.967,
            "--form-limit", 20, "--size-limit", 20, *options, "-o", page,
        )  # fmt: skip
        verdict = text.replace("\n  ", " ").splitlines()[0]
        assert "2 of 2 figures are within their limits" in verdict
        assert "not a statement of conformity" in verdict
        assert "not been checked" in verdict
        assert ("uncertainty of the reference is not given" in verdict) != stated
        assert ("--u-diameter and --sphere-form" in warned) != stated
        for shown in (text, page.read_text(encoding="utf-8")):
            assert "conforms" not in shown

    def test_only_the_missing_part_of_the_reference_is_asked_for(self) -> None:
        _, warned = both_outputs(
            "check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 5.967,
            "--form-limit", 20, "--sphere-form", 0.1, "--size-limit", 20,
        )  # fmt: skip
        assert "--u-diameter" in warned
        assert "--sphere-form" not in warned

    @pytest.mark.long
    def test_budget_on_page_and_in_json(self, tmp_path: Path) -> None:
        """The same budget as `check --verbose` prints."""
        made, page, values = (tmp_path / name for name in ("map.json", "c.html", "c.json"))
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "mean",
            "-o", made)  # fmt: skip
        command = ["check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--map", made,
                   "--form-limit", 30, "--u-diameter", 0.1, "--sphere-form", 0.1]  # fmt: skip
        text = run(*command, "--verbose")
        (shown,) = (line for line in text.splitlines() if line.startswith("tip radius"))
        run(*command, "-o", page)
        html = page.read_text(encoding="utf-8")
        assert "Uncertainty of the diameter" in html
        run(*command, "-o", values)
        found = data_of(values)
        assert any(
            "not been checked" in row["reason"] for row in found["Why no conformity is stated"]
        )
        combined = {row["result"]: row["combined_um"] for row in found["Budgets"]}
        budgets = {budget.result: budget for budget in read_result(values).document.budgets}
        name = "diameter of the sphere, compensated"
        parts = {part.name: 1e3 * part.contribution for part in budgets[name].components}
        printed = f"{parts['tip radius']:.4f}"
        assert printed in shown
        assert printed in html
        assert combined[name] == pytest.approx(np.linalg.norm(list(parts.values())))
        (form,) = (u for name, u in combined.items() if name.startswith("P_Form"))
        # Half of the stated form error of the reference (ISO/TS 23165 unchecked).
        assert form == pytest.approx(0.05)

    def test_a_map_checked_on_its_own_touches_is_warned_of(self, tmp_path: Path) -> None:
        made, copy, new = (tmp_path / name for name in ("map.json", "copy.csv", "new.csv"))
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "mean",
            "-o", made)  # fmt: skip
        copy.write_bytes(SPHERE.read_bytes())
        page = tmp_path / "c.html"
        command = ["check", "iso10360-5", copy, "--diameter", 24.9987, "--map", made]
        warned = both_outputs(*command, "-o", page)[1]
        assert "all 75 touches are identical to touches that the map was made from" in warned
        assert "touches that the map was made from" in page.read_text(encoding="utf-8")
        touched = read_touches(SPHERE)
        scatter = 0.3e-3 * np.random.default_rng(1).standard_normal(75)
        positions = touched.positions + scatter[:, None] * touched.normals
        write_touches(new, replace(touched, positions=positions))
        command[2] = new
        assert "the map was made from" not in both_outputs(*command)[1]

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
            (
                ["iso10360-5", SPHERE, "--diameter", 25, "--size-limit", 1],
                "give one of them (--tip-diameter",
            ),
            (["iso230-10", SPHERE, "--diameter", 25, "--size-limit", 1], "only for iso10360-5"),
            # Refused before the touches are read: that there are none is not the first thing told.
            (["iso230-10", NO_TOUCHES, "--diameter", 25, "--size-limit", 1], "only for iso10360-5"),
            (["iso10360-5", NO_TOUCHES, "--diameter", 25, "--size-limit", 1], "or a map"),
        ],
    )
    def test_errors_teach(self, arguments: list[object], words: str) -> None:
        assert words in run("check", *arguments, code=2)


class TestTipOffset:
    """A tip that is 4 µm in x and -3 µm in y beside the axis of the spindle."""

    def _touches(self, degrees: float) -> Touches:
        normals = plane_pattern_36()
        half_turn = -1.0 if degrees else 1.0
        return Touches(15.5 * normals - half_turn * np.array([0.004, -0.003, 0.0]), normals)

    def test_a_file_for_each_orientation(self, tmp_path: Path) -> None:
        files = [tmp_path / "at_0.csv", tmp_path / "at_180.csv"]
        for path, degrees in zip(files, (0.0, 180.0), strict=True):
            write_touches(path, self._touches(degrees))
        command = ["check", "iso230-10-tip-offset", *files, "--diameter", 25, "--tip-diameter", 6]
        result = tmp_path / "offset.json"
        text = run(*command, "--spindle", "0,180", "--offset-limit", 4, "-o", result, code=3)
        assert "tip offset exceeds the limit" in text.replace("\n  ", " ")
        assert "not a statement of conformity" in text.replace("\n  ", " ")
        found = data_of(result)
        by_name = {figure["figure"]: figure for figure in found["Figures"]}
        assert by_name["tip offset, x"]["value_um"] == pytest.approx(4.0)
        assert by_name["tip offset, y"]["value_um"] == pytest.approx(-3.0)
        assert by_name["run-out of the tip"]["value_um"] == pytest.approx(10.0)
        assert found["Why no conformity is stated"]
        run(*command, "--spindle", "0,180", "--offset-limit", 6, "-o", tmp_path / "c.html")
        assert "column spindle_deg" in run(*command, code=2)
        assert "3 orientations of the spindle were given for 2 files" in run(
            *command, "--spindle", "0,90,180", code=2
        )

    def test_one_file_with_a_column(self, tmp_path: Path) -> None:
        both = tmp_path / "both.csv"
        parts = [self._touches(degrees) for degrees in (0.0, 180.0)]
        touches = Touches(
            np.vstack([part.positions for part in parts]),
            np.vstack([part.normals for part in parts]),
            spindle=np.repeat([0.0, np.pi], 36),
        )
        write_touches(both, touches)
        assert rows(both)[40]["spindle_deg"] == "180"
        assert read_touches(both).spindle == pytest.approx(touches.spindle)
        command = ["check", "iso230-10-tip-offset", both, "--diameter", 25]
        assert "tip offset" in run(*command)
        assert "already contains the orientation" in run(*command, "--spindle", "0", code=2)
        assert "is the reference a sphere?" in run(*command, "--ring", code=2)
        assert "do not determine what this limit" in run(*command, "--repeat-limit", 1, code=2)
        assert "2 orientations" in run("check", "iso230-10", both, "--diameter", 25, code=2)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["iso230-10-tip-offset", "--map", NO_TOUCHES], "map is only for"),
            (["iso230-10-tip-offset", "--form-limit", 1], "form limit is only for"),
            (["iso230-10-tip-offset", "--sphere-form", 1], "sphere form is only for"),
            (["iso230-10", "--offset-limit", 1], "offset limit is only for iso230-10-tip-offset"),
            (["iso10360-5", "--spindle", "0"], "spindle is only for"),
            (["iso230-10", "--ring"], "ring is only for"),
        ],
    )
    def test_refused_before_touches_are_read(self, options: list[object], words: str) -> None:
        told = run("check", options[0], NO_TOUCHES, "--diameter", 25, *options[1:], code=2)
        assert words in told.replace("\n  ", " ")
