"""What pretravel repeat prints and writes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.commands import run

OTHERS = (1.3206, 1.3194, 1.3206, 1.3219, 1.3206, 1.3225, 1.3181, 1.3200, 1.3188)


def _log(path: Path, first: float = 1.3, series: int = 1) -> Path:
    heights = "".join(f"// probe at 5.000,5.000 is z={z:.6f}\n" for z in (first, *OTHERS))
    path.write_text(f"// PROBE_ACCURACY at X:5.000 Y:5.000\n{heights}" * series)
    return path


def test_the_answer_and_its_parts(tmp_path: Path) -> None:
    out = " ".join(run("repeat", _log(tmp_path / "a.log")).split())
    assert out.startswith("the next touch will differ by less than")
    assert "first touch differs yes, by -2" in out
    assert "contains the first touch" in out
    assert "no drift is detected" in out
    assert "discard the first touch" in out


@pytest.mark.long
def test_files_and_picture(tmp_path: Path) -> None:
    log, table, page = _log(tmp_path / "a.log"), tmp_path / "a.csv", tmp_path / "a.html"
    run("repeat", log, "-o", table, "--plot", tmp_path / "a.png")
    rows = table.read_text().splitlines()
    assert rows[0] == "series,touch,line,position_mm,usual,level_mm,left_um"
    assert rows[1].startswith("1,1,2,1.3,0,")
    assert len(rows) == 11
    run("repeat", log, "-o", page)
    assert "next touch" in page.read_text(encoding="utf-8")
    run("repeat", log, "-o", tmp_path / "a.report.json")
    assert json.loads((tmp_path / "a.report.json").read_text(encoding="utf-8"))


def test_series_of_a_log_and_of_two_files(tmp_path: Path) -> None:
    _log(tmp_path / "a.log", series=2)
    _log(tmp_path / "b.log", first=1.32)
    out = run("repeat", tmp_path / "a.log", tmp_path / "b.log")
    table = [line for line in out.splitlines() if "yes" in line or "no " in line]
    assert any("a.log, accuracy 1" in line and "yes" in line for line in table)
    assert any("b.log" in line and "yes" not in line for line in table)


@pytest.mark.parametrize("step", [(), ("--step", 12.5)])
def test_equal_touches(tmp_path: Path, step: tuple[object, ...]) -> None:
    """They say that the noise is below the step; only a stated step gives an answer."""
    path = tmp_path / "z.txt"
    path.write_text("z_mm\n" + "4.7\n" * 10)
    out = " ".join(run("repeat", path, *step).split())
    assert ("differ by less than 12 µm" in out or "differ by less than 13 µm" in out) == bool(step)
    assert ("Give the step" in out) != bool(step)


def test_what_is_missing_is_named_as_an_option(tmp_path: Path) -> None:
    path = tmp_path / "z.txt"
    path.write_text("4.7\n" * 10)
    assert "--units" in run("repeat", path, code=2)
