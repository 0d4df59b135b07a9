"""The benchmarks compare what they time; here with small sizes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5netcdf
import numpy as np
import pytest

from benchmarks import load, long_tables, ratios, run, studies
from benchmarks.commands import python_file, spent
from benchmarks.results import Growth
from benchmarks.sizes import SMALL
from pretravel.design.studies.definition import load_study
from pretravel.design.studies.packed_outcome import packed, unpacked
from pretravel.design.studies.plan import Plan
from pretravel.design.studies.run import Workers, run_study
from pretravel.design.studies.workers import in_this_process
from pretravel.maps.pretravel_map import PretravelMap

QUICK = ("directions", "touches", "surface-touches", "trials", "qualification")
SLOW = tuple(name for name in run.BENCHMARKS if name not in (*QUICK, "long-tables"))


def _complete(names: tuple[str, ...]) -> None:
    found = run.run(names, SMALL)
    assert found.rows or found.growths
    for row in found.rows:
        assert row.ours is None or row.ours > 0.0
        assert (row.theirs is None) == (row.ratio is None)
        assert row.ours is not None or row.note
    for growth in found.growths:
        assert len(growth.sizes) == len(growth.seconds) >= 2
        assert np.isfinite(growth.time_exponent)


@pytest.mark.parametrize("name", QUICK)
def test_both_ways_give_the_same(name: str) -> None:
    _complete((name,))


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_both_ways_give_the_same_in_processes_of_their_own(name: str) -> None:
    _complete((name,))


def test_a_fast_wrong_prediction_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    right = ratios.LoopedProbe.pretravel
    monkeypatch.setattr(ratios.LoopedProbe, "pretravel", lambda self, n: right(self, n) + 1e-9)
    with pytest.raises(AssertionError):
        ratios.directions(SMALL)


def test_a_fast_wrong_compensation_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    made = ratios._example_map()

    def wrong(touches: object, pretravel_map: PretravelMap) -> object:
        return right(touches, replace(made, tip_radius=made.tip_radius + 1e-9))

    right = ratios.apply
    monkeypatch.setattr(ratios, "apply", wrong)
    with pytest.raises(AssertionError):
        ratios.touches(SMALL)


@pytest.mark.slow
def test_long_tables_are_compared_row_by_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of the benchmark, and its comparison of points with one wrong point."""
    seen: list[Path] = []
    compare = long_tables.compare_points

    def compare_twice(touches: Path, points: Path, made: Path, count: int) -> None:
        compare(touches, points, made, count)
        lines = points.read_text().splitlines()
        cells = lines[1].split(",")
        at = lines[0].split(",").index("x_mm")
        cells[at] = str(float(cells[at]) + 1e-6)
        wrong = tmp_path / "wrong.csv"
        wrong.write_text("\n".join([lines[0], ",".join(cells), *lines[2:]]) + "\n")
        with pytest.raises(AssertionError):
            compare(touches, wrong, made, count)
        wrong.write_text("\n".join(lines[:-1]) + "\n")
        with pytest.raises(AssertionError, match="1999 points of 2000"):
            compare(touches, wrong, made, count)
        seen.append(wrong)

    monkeypatch.setattr(long_tables, "compare_points", compare_twice)
    found = long_tables.long_tables(SMALL)
    assert seen
    (row,) = found.rows
    assert row.ratio is not None
    assert "MB" in row.note


def _study(folder: Path, name: str, designs: int) -> Path:
    study = load_study(str(studies.write_study(folder / f"{name}.toml", designs)))
    run_study(study, folder / f"{name}.nc", Workers(1))
    return folder / f"{name}.nc"


def test_studies_are_compared_to_the_last_bit(tmp_path: Path) -> None:
    one, other = (_study(tmp_path, name, 2) for name in ("one", "other"))
    studies.compare_results(one, other)
    with h5netcdf.File(other, "a") as file:
        values = file.variables["pretravel_range"]
        values[0] = np.nextafter(values[0], np.inf)
    with pytest.raises(AssertionError, match="pretravel_range"):
        studies.compare_results(one, other)


def test_blocks_of_workers_are_compared_to_the_last_bit(tmp_path: Path) -> None:
    plan = Plan(load_study(str(studies.write_study(tmp_path / "study.toml", 2))))
    blocks = list(in_this_process(plan, [[0], [1]]))
    studies.compare_blocks(blocks, blocks[::-1])
    number, content = blocks[0][0]
    outcome = unpacked(content)
    numbers = {name: float(np.nextafter(v, np.inf)) for name, v in outcome.numbers.items()}
    with pytest.raises(AssertionError):
        studies.compare_blocks(
            blocks, [[(number, packed(replace(outcome, numbers=numbers)))], blocks[1]]
        )


def test_memory_is_that_of_all_processes(tmp_path: Path) -> None:
    """A process of 60 MB that starts two of 60 MB more than an interpreter."""
    text = """
import subprocess, sys, time
held = bytearray(60_000_000)
if len(sys.argv) == 1:
    others = [subprocess.Popen([sys.executable, __file__, "1"]) for _ in range(2)]
    for other in others:
        other.wait()
else:
    time.sleep(1.5)
"""
    found = spent(python_file(tmp_path, "holds.py", text))
    assert 60e6 < found.largest < 100e6
    assert 180e6 < found.together < 300e6
    assert found.seconds > 1.5


def test_a_command_that_fails_is_told(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="broken on purpose"):
        spent(python_file(tmp_path, "fails.py", "raise SystemExit('broken on purpose')"))


@pytest.mark.slow
def test_memory_of_a_job_is_not_that_of_the_process_that_started_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    held = bytearray(400_000_000)
    assert len(held)
    found = load._apart("predict", 100_000)
    # 100,000 directions with 3 coordinates take 2.4 MB; some tens of arrays of that size.
    assert 5e6 < found["memory"] < 400e6


def test_nothing_is_written_where_less_than_everything_ran(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "benchmarks.md"
    growth = Growth("`read`", "points", (1, 10), (1.0, 10.0))
    monkeypatch.setattr(run, "PAGE", page)
    only = {"read": lambda sizes: run.Figures(growths=(growth,))}
    monkeypatch.setattr(run, "BENCHMARKS", only)
    for options in (["--only", "read"], ["--small"], ["--print"]):
        run.main(options)
        assert not page.exists()
    assert "time^1.00" in capsys.readouterr().out
    run.main([])
    assert "generated: results growth" in page.read_text()
    written = (tmp_path / "results" / "growth.csv").read_text()
    assert "`read`,points,1: 1 s; 10: 10 s,1.00,–" in written
