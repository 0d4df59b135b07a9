"""pretravel separate: files, pictures, plans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES
from tests.support.results import data_of

READINGS = EXAMPLES / "redundancy_24x24.csv"


class TestSeparate:
    def test_csv(self, tmp_path: Path) -> None:
        text = run("separate", READINGS, "--repeat-variance", 0.74, "--repeat-pair", "1,1",
                   "--repeat-count", 200, "--pair", "2,5", "-o", tmp_path / "s.csv")  # fmt: skip
        found = rows(tmp_path / "s.csv")
        assert list(found[0]) == [
            "kind", "index", "systematic_um", "u_systematic_um", "variance_um2", "u_variance_um2",
            "azimuth_deg",
        ]  # fmt: skip
        assert [row["kind"] for row in found] == ["machine"] * 24 + ["probe"] * 24
        assert [int(row["index"]) for row in found] == [*range(1, 25)] * 2
        machine = np.array([float(row["systematic_um"]) for row in found[:24]])
        assert machine.sum() == pytest.approx(0.0, abs=1e-6)
        assert all(float(row["variance_um2"]) >= 0.0 for row in found)
        assert "rank 47 of 48" in text.replace("\n  ", " ")
        assert "variance of pair (2, 5)" in text
        assert "is assumed" not in text

    def test_a_number_of_repeats_that_is_not_given_is_said(self) -> None:
        text = run("separate", READINGS, "--repeat-variance", 0.74, "--repeat-pair", "1,1")
        assert "the number of repeats, 10, is assumed" in text.replace("\n  ", " ")

    @pytest.mark.long
    def test_page_json_and_picture(self, tmp_path: Path) -> None:
        run("separate", READINGS, "-o", tmp_path / "s.html", "--plot", tmp_path / "s.png")
        assert "data:image/" in (tmp_path / "s.html").read_text()
        run("separate", READINGS, "--method", "least-squares", "-o", tmp_path / "s.json")
        found = data_of(tmp_path / "s.json")
        machine, probe = found["Directions"][6], found["Directions"][24 + 11]
        (pair,) = (
            row
            for row in found["Variances of pairs"]
            if (row["machine_index"], row["probe_index"]) == (7, 12)
        )
        assert len(found["Variances of pairs"]) == 24 * 24
        assert pair["variance_um2"] == pytest.approx(
            machine["variance_um2"] + probe["variance_um2"], rel=1e-12
        )
        (overall,) = found["Separation"]
        assert (overall["method"], overall["readings_used"]) == ("least-squares", 24 * 24)

    @pytest.mark.long
    def test_a_gross_error_is_named_and_left_out(self, tmp_path: Path) -> None:
        lines = READINGS.read_text().splitlines()
        row = lines.index(next(line for line in lines if line.startswith("7,12,")))
        lines[row] = f"7,12,{float(lines[row].split(',')[2]) + 40.0:.4f}"
        dirty = tmp_path / "dirty.csv"
        dirty.write_text("\n".join(lines) + "\n")
        text = run("separate", dirty, "-o", tmp_path / "s.json").replace("\n  ", " ")
        assert "machine 7 with probe 12" in text
        found = data_of(tmp_path / "s.json")
        assert [(o["machine_index"], o["probe_index"]) for o in found["Outliers"]] == [(7, 12)]
        assert found["Outliers"][0]["distance_um"] == pytest.approx(40.0, abs=4.0)
        run("separate", dirty, "--exclude", "7,12", "-o", tmp_path / "e.json")
        excluded = data_of(tmp_path / "e.json")
        assert excluded["Directions"] == found["Directions"]
        assert len(excluded["Excluded readings"]) == 1
        assert "--exclude" in run("separate", READINGS, "--exclude", "7,99", code=2)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--repeat-variance", "0.8"], "needs the indices of its pair"),
            (["--repeat-variance", "0.8", "--repeat-pair", "25,1"], "no reading has machine"),
            (["--axis", "0,1,0"], "an axis of the probe is not used"),
            (["--method", "magic"], "not one of 'reml', 'least-squares'"),
            (["--pair", "1.5,2"], "whole numbers"),
            (["--repeat-variance", "-1", "--repeat-pair", "1,1"], "--repeat-variance -1"),
        ],
    )
    def test_errors_teach(self, options: list[str], words: str) -> None:
        assert words in run("separate", READINGS, *options, code=2)

    def test_plan_is_a_form_that_reads_back(self, tmp_path: Path) -> None:
        form = tmp_path / "form.csv"
        text = run("separation-plan", "--directions", 12, "--variance", 0.5, "--u-systematic", 0.3,
                   "-o", form)  # fmt: skip
        assert "turn the probe to" in text
        lines = form.read_text().splitlines()
        filled = [lines[0], *(f"{line}{0.1 * (i % 7):.2f}" for i, line in enumerate(lines[1:]))]
        form.write_text("\n".join(filled) + "\n")
        assert "12 machine and 12 probe" in run("separate", form).replace("\n  ", " ")
        # An empty cell is a reading that was not made.
        count = len(filled) - 1
        form.write_text("\n".join([*filled[:5], lines[5], *filled[6:]]) + "\n")
        assert f"{count - 1} readings" in run("separate", form)
        assert "no uncertainty is required" in run("separation-plan", code=2)
