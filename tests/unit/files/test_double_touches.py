"""Places that were touched twice, fast and then slowly: feeds of logs, and what is kept.

The search here is at 500 mm/min, the slow touch at 100; between trigger and latch are 10.8 ms, so
that they differ by 72 µm (400 mm/min × 10.8 ms).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import FilePositions, ReadingOptions
from pretravel.files.logs.double_touches import without_searches
from pretravel.files.logs.joining import join
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.touches.targets import Targets
from tests.support.commands import both_outputs, rows, run
from tests.support.control_logs import written

STEP = 0.072  # mm
PLACES = [(float(x), float(y)) for x in (0, 10, 20) for y in (0, 10)]
PLAN = Targets(
    [[x, y, 0.0] for x, y in PLACES],
    [[0.0, 0, 1]] * len(PLACES),
    labels=tuple(f"p{i}" for i in range(len(PLACES))),
)
TWICE = Targets(
    np.repeat(PLAN.points, 2, axis=0),
    np.repeat(PLAN.normals, 2, axis=0),
    labels=tuple(f"p{i}.{k}" for i in range(len(PLACES)) for k in (1, 2)),
)
STATED = ReadingOptions(plan=PLAN, tip_radius=3.0)
HEAD = "$13=0\n<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\n"


def _log(*, ahead: bool = False, feeds: bool = True, unit: str = "G21 ") -> SourceFile:
    """A sender's log; one that writes all moves of a place before the first is reported."""
    lines = []
    for x, y in PLACES:
        fast, slow = ("F500", "F100") if feeds else ("", "")
        moves = [f">>> {unit}G38.2 Z-10 {fast}", ">>> G0 Z4", f">>> G38.2Z-10{slow}"]
        reports = [f"[PRB:{x:.3f},{y:.3f},{z:.3f}:1]" for z in (3.0 - STEP, 3.0)]
        status = "<Run|MPos:0.000,0.000,1.000|FS:40,0|WCO:0.000,0.000,0.000>"
        if ahead:
            lines += [*moves, status, reports[0], "ok", reports[1]]
        else:
            lines += [moves[0], status, reports[0], *moves[1:], reports[1]]
    return SourceFile("a.log", (HEAD + "\n".join(lines) + "\n").encode())


@pytest.mark.parametrize("ahead", [False, True])
def test_the_last_of_each_is_kept(*, ahead: bool) -> None:
    found = read_readings(_log(ahead=ahead), replace(STATED, double_touches="last")).touches
    assert found.positions[:, 2].tolist() == [3.0] * 6
    assert found.feeds is not None
    assert found.feeds.tolist() == [100.0] * 6
    assert found.labels == PLAN.labels
    assert "6 fast touches before slow ones left out" in found.reading


@pytest.mark.parametrize("ahead", [False, True])
def test_both_are_kept_with_their_feeds(*, ahead: bool) -> None:
    found = read_readings(_log(ahead=ahead), replace(STATED, double_touches="all")).touches
    assert found.feeds is not None
    assert found.feeds.tolist() == [500.0, 100.0] * 6
    assert found.labels is not None
    assert found.labels[:2] == ("p0 F500", "p0 F100")
    assert "feeds of the moves G38: 100, 500 mm/min" in found.reading


def test_feeds_of_a_program_in_inches() -> None:
    options = replace(STATED, double_touches="last")
    assert read_readings(_log(unit="G20 "), options).touches.feeds[0] == pytest.approx(2540.0)
    told = read_readings(_log(unit=""), options).touches
    assert told.feeds[0] == 100.0
    assert "taken in the unit of the reports" in told.reading


def test_a_search_and_its_slow_touch_are_no_repeats() -> None:
    """A plan with two touches of each place would take them as equals: 72 µm between them."""
    with pytest.raises(InputError, match=r"line 8: .*p0\.1 was touched at 500 mm/min \(line 5\)"):
        read_readings(_log(), replace(STATED, plan=TWICE))
    found = read_readings(_log(), replace(STATED, plan=TWICE, double_touches="last"))
    assert found.touches.positions[:, 2].tolist() == [3.0] * 6
    with pytest.raises(InputError) as caught:
        read_readings(_log(), STATED)
    assert caught.value.inputs == ("double_touches",)


def test_without_feeds_pairs_are_kept_and_unequal_ones_are_told() -> None:
    log = _log(feeds=False)
    assert read_readings(log, replace(STATED, plan=TWICE)).touches.feeds is None
    notes = " ".join(read_readings(log, replace(STATED, plan=TWICE)).notes())
    assert "is -72.0 µm from the first along the approach, at 6 targets" in notes
    found = read_readings(log, replace(STATED, double_touches="last"))
    assert found.touches.positions[:, 2].tolist() == [3.0] * 6
    with pytest.raises(InputError, match="does not give the feeds"):
        read_readings(log, replace(STATED, double_touches="all"))
    with pytest.raises(InputError, match=r"more readings than the plan.*touched twice"):
        read_readings(log, STATED)
    odd = SourceFile("a.log", log.content + b"[PRB:20.000,0.000,3.000:1]\n")
    with pytest.raises(InputError, match=r"line 39: this touch is not followed by a second"):
        read_readings(odd, replace(STATED, double_touches="last"))


def test_repeats_are_repeats() -> None:
    """Twice at one feed, with 1 µm of scatter: no warning, and none is left out."""
    rng = np.random.default_rng(3)
    seen = np.repeat(PLAN.points, 2, axis=0) + np.array([0.0, 0.0, 3.0])
    seen[:, 2] += rng.normal(0.0, 0.001, len(seen))
    lines = tuple(range(1, len(seen) + 1))
    assert "not repeats" not in " ".join(join(FilePositions("a", seen, lines), TWICE, 3.0).notes())
    same = FilePositions("a", seen, lines, feeds=np.full(len(seen), 100.0))
    assert len(join(same, TWICE, 3.0).touches) == 12


def test_moves_that_the_log_does_not_show_give_no_feeds() -> None:
    """One move more than reports (an alarm), and one report without a move."""
    log = _log()
    extra = SourceFile("a", log.content + b">>> G38.2 Z-20 F100\nALARM:5\n")
    found = read_readings(extra, replace(STATED, double_touches="last")).touches
    assert found.feeds is not None
    lost = SourceFile("a", log.content.replace(b"G38.2Z-10F100", b"(lost)", 1))
    with pytest.raises(InputError, match="more readings"):
        read_readings(lost, STATED)
    kept = read_readings(lost, replace(STATED, double_touches="last")).touches
    assert "feeds are not read" in kept.reading


def test_g2core_and_lines_of_a_log() -> None:
    text = "".join(
        f'{{"gc":"G38.2 Z-10 F{feed}"}}\n'
        f'{{"r":{{"prb":{{"e":1,"x":{x:.3f},"y":{y:.3f},"z":{z:.3f}}}}},"f":[1,0,9]}}\n'
        for x, y in PLACES
        for feed, z in ((500, 3.0 - STEP), (100, 3.0))
    )
    options = replace(STATED, double_touches="last", offset=(0.0, 0.0, 0.0))
    found = read_readings(SourceFile("g2.log", text.encode()), options).touches
    assert found.feeds.tolist() == [100.0] * 6
    lines = "G21\n" + "".join(
        f"G1 X{x} Y{y} Z{z:.3f} F{feed}\n"
        for x, y in PLACES
        for feed, z in ((500, 3.0 - STEP), (100, 3.0))
    )
    options = replace(options, offset=None)
    found = read_readings(SourceFile("p.txt", lines.encode()), options).touches
    assert found.feeds.tolist() == [100.0] * 6


def test_the_command_and_a_table(tmp_path: Path) -> None:
    """The message names the option; a table with a column of feeds is treated alike."""
    plan = "label,x_mm,y_mm,z_mm,nx,ny,nz\n" + "".join(
        f"p{i},{x},{y},0,0,0,1\n" for i, (x, y) in enumerate(PLACES)
    )
    table = "X;Y;Z;F\n" + "".join(
        f"{x};{y};{z:.3f};{feed}\n"
        for x, y in PLACES
        for feed, z in ((500, 3.0 - STEP), (100, 3.0))
    )
    call: list[object] = [
        "convert", written(tmp_path, table, "t.txt"), "--units", "mm", "--plan",
        written(tmp_path, plan, "plan.csv"), "--tip-diameter", 6, "-o", tmp_path / "out.csv",
    ]  # fmt: skip
    assert "--double-touches" in run(*call, code=2)
    run(*call, "--double-touches", "all")
    assert [row["feed_mm_min"] for row in rows(tmp_path / "out.csv")][:2] == ["500", "100"]
    run(*call, "--double-touches", "last")
    assert len(rows(tmp_path / "out.csv")) == 6


def test_the_last_of_three_touches_of_each_place_is_kept() -> None:
    """A search, a first slow touch and a second one, in a log without feeds."""
    heights = (3.0 - STEP, 3.0 - 0.001, 3.0)
    text = "$13=0\n" + "".join(
        f"[PRB:{x:.3f},{y:.3f},{z:.3f}:1]\n" for x, y in PLACES for z in heights
    )
    options = replace(STATED, double_touches="last", offset=(0.0, 0.0, 0.0))
    found = read_readings(SourceFile("three.log", text.encode()), options)
    assert found.touches.positions[:, 2].tolist() == [3.0] * 6
    assert "12 earlier touches of their places left out" in found.touches.reading
    one_more = f"{text}[PRB:20.000,10.000,3.000:1]\n"  # 19 touches
    with pytest.raises(InputError, match="not followed by a second touch"):
        read_readings(SourceFile("three.log", one_more.encode()), options)


def test_no_touch_is_kept_of_none() -> None:
    empty = FilePositions("a.log", np.empty((0, 3)), ())
    assert without_searches(empty).lines == ()


def _pairs(places: int, touches: int, apart: float) -> str:
    noise = 1e-3 * np.random.default_rng(places).standard_normal((places, touches))
    return "x_mm,y_mm,z_mm\n" + "".join(
        f"{10 * place},{7 * (place % 2)},{noise[place, n] - apart * (n == 0):.4f}\n"
        for place in range(places)
        for n in range(touches)
    )


@pytest.mark.parametrize(("places", "touches"), [(2, 2), (3, 2), (2, 3), (3, 3)])
def test_few_places_that_look_like_passes_are_asked_about(places: int, touches: int) -> None:
    file = SourceFile("a.csv", _pairs(places, touches, 0.030).encode())
    up = ReadingOptions(normal=(0.0, 0.0, 1.0))
    asked = read_readings(file, up)
    assert len(asked.touches) == places * touches
    assert any("first touch lies about" in note for note in asked.notes())
    kept = read_readings(file, replace(up, double_touches="last"))
    assert len(kept.touches) == places
    assert not any("first touch lies about" in note for note in kept.notes())
    repeats = SourceFile("a.csv", _pairs(places, touches, 0.0).encode())
    assert not any("first touch" in note for note in read_readings(repeats, up).notes())


def test_measure_tells_passes_apart(tmp_path: Path) -> None:
    grid = written(tmp_path, _pairs(8, 2, 0.030), "grid.csv")
    assert "2 passes" in run("measure", grid, "--feature", "plane", code=2)
    out, _ = both_outputs("measure", grid, "--feature", "plane", "--series", "second")
    assert "8 points" in out
    few = written(tmp_path, _pairs(3, 2, 0.030), "few.csv")
    assert "first touch lies about" in both_outputs("measure", few, "--feature", "plane")[1]
