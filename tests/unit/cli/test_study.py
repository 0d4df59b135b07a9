"""The commands study and studies."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pretravel.design.studies.definition import STUDIES, load_study
from pretravel.design.studies.plan import Plan
from tests.support.commands import both_outputs, run


@pytest.mark.parametrize("name", STUDIES.names())
def test_each_shipped_study_is_listed_and_can_be_computed(name: str) -> None:
    assert re.search(rf"^{name} ", run("studies"), re.M)
    assert len(Plan(load_study(name))) > 1


@pytest.mark.long
def test_the_report_names_what_decides_and_what_failed(tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    study.write_text(
        '[study]\nname = "tips"\n[directions]\nazimuth_deg = "0:330:30"\npolar_deg = 90\n'
        '[[factor]]\nkey = "spring.preload_N"\nvalues = [4.0, 8.0]\n'
        '[[factor]]\nkey = "tip.radius_mm"\nvalues = [3.0, 1.0]\n'
    )
    output = tmp_path / "study.nc"
    said, warned = both_outputs("study", study, "-o", output, "--page", tmp_path / "study.html")
    assert "tips: 4 designs of omp40-2: pretravel range" in said
    assert "2 of 4 designs cannot be computed" in warned
    assert re.search(r"smaller than the stem .* 2$", said, re.M)
    assert "tips" in (tmp_path / "study.html").read_text(encoding="utf-8")
    assert run("study", output) == said


def test_a_study_without_any_design_is_a_fault_and_writes_nothing(tmp_path: Path) -> None:
    """A mistyped key fails every design: it exited with 0, and wrote a file of nothing."""
    study, output = tmp_path / "study.toml", tmp_path / "study.nc"
    study.write_text(
        '[study]\nname = "preload"\n[directions]\nazimuth_deg = "0:330:30"\npolar_deg = 90\n'
        '[[factor]]\nkey = "spring.preloadd_N"\nvalues = [4.0, 8.0, 9.0]\n'
    )
    said = " ".join(run("study", study, "-o", output, code=2).split())
    assert "none of the 3 designs of this study can be computed: [spring] has no preloadd_N" in said
    assert "Did you mean preload_N? (3)" in said
    assert [file.name for file in tmp_path.iterdir()] == ["study.toml"]


def test_without_an_output_nothing_is_computed(tmp_path: Path) -> None:
    assert "-o study.nc" in run("study", "preload-and-seats", code=2)


def test_a_study_that_is_not_there() -> None:
    said = run("study", "preload", "-o", "study.nc", code=2)
    assert "neither a study of the package (preload-and-seats" in said
