"""The history of a probe from the command line: a month of touches, and verifications."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.files.map_file import write_map
from pretravel.files.probe_history import add_verification
from pretravel.files.touches_csv import write_touches
from pretravel.touches import Touches
from tests.support.commands import both_outputs, rows, run
from tests.support.pictures import coloured_share
from tests.unit.files.test_files_of_version_1 import FOLDER
from tests.unit.qualification.test_verification import check, old_map, touches

SPHERE = ("--diameter", 25, "--tip-diameter", 6, "--kind", "harmonic")


def month(
    folder: Path, days: int, *, slope: float = 0.0, jump: tuple[int, float] = (99, 0.0)
) -> Path:
    """A file for each day from 1 March on; the level rises by `slope` a day. [mm]"""
    folder.mkdir()
    for day in range(days):
        size = slope * day + (jump[1] if day >= jump[0] else 0.0)
        name = f"sphere_{date(2026, 3, 1) + timedelta(days=day)}.csv"
        write_touches(folder / name, touches(200 + day, size=size))
    return folder


@pytest.mark.long
def test_a_month_with_drift(tmp_path: Path) -> None:
    """0.1 µm a day: the map is 2 µm off on 21 March. u of the slope is 0.009 µm/day (0.1 µm over
    12 days), so that the date is known to 3 days; the error of the first day's map is 1 day."""
    logs, table, picture = month(tmp_path / "logs", 12, slope=1e-4), tmp_path / "h.csv", "h.png"
    told = run("history", logs, *SPHERE, "--limit", 2, "-o", table, "--plot", tmp_path / picture)
    assert told.startswith("drift: size +0.")
    due = datetime.fromisoformat(told.partition("due on ")[2][:10])
    early = datetime.fromisoformat(told.partition("earliest on ")[2][:10])
    assert abs((due - datetime(2026, 3, 21)).days) <= 6
    assert datetime(2026, 3, 12) < early < due
    found = rows(table)
    assert [row["time"][:10] for row in found][:2] == ["2026-03-01", "2026-03-02"]
    level = np.array([float(row["level_um"]) for row in found])
    assert np.polyfit(np.arange(12.0), level, 1)[0] == pytest.approx(0.1, abs=0.03)
    assert {row["series"] for row in found} == {"1"}
    assert coloured_share(tmp_path / picture) > 0.001


@pytest.mark.long
def test_damaged_files_are_named_and_a_map_can_be_given(tmp_path: Path) -> None:
    logs = month(tmp_path / "logs", 5)
    (logs / "sphere_2026-03-02.csv").write_text("x_mm,y_mm\n1,2\n")
    header, _, *others = (logs / "sphere_2026-03-03.csv").read_text().splitlines()
    (logs / "sphere_late.csv").write_text("\n".join([header, *others]))
    write_map(tmp_path / "map.json", old_map())
    told, warned = both_outputs(
        "history", logs, "--diameter", 25, "--map", tmp_path / "map.json", "--limit", 5
    )
    assert "no drift is detected" in told
    assert "5, from 2026-03-01 to" in told
    # Days with u of 0.1 µm exclude no change of 0.01 µm.
    told, _ = both_outputs(
        "history",
        logs,
        "--diameter",
        25,
        "--map",
        tmp_path / "map.json",
        "--limit",
        0.01,
        "--verbose",
    )
    assert "5 days are too few to show a trend" in " ".join(told.split())
    assert "earliest due date (95 %) may already have passed" in " ".join(told.split())
    assert "compared with the map of map.json" in " ".join(told.split())
    assert "allowed change of the map 0.01 µm (given)" in " ".join(told.split())
    assert "Each day: difference from the map" in told
    assert "The map was made from" not in told
    assert "sphere_2026-03-02.csv is not used:" in warned
    assert "1 file has no date in the name or the rows (sphere_late.csv)" in warned


@pytest.mark.long
def test_copies_future_dates_and_conditions_of_days_are_named(tmp_path: Path) -> None:
    logs = month(tmp_path / "logs", 5)
    first, third = (logs / f"sphere_2026-03-0{day}.csv" for day in (1, 3))
    header, *rows = third.read_text().splitlines()
    (logs / "sphere_2026-03-04b.csv").write_text("\n".join([header, *sorted(rows)]))
    (logs / "sphere_2026-03-02.csv").write_text("# feed: 500\n" + first.with_stem(
        "sphere_2026-03-02").read_text())  # fmt: skip
    (logs / "sphere_2026-03-05.csv").rename(logs / "sphere_2099-03-05.csv")
    told = " ".join("".join(both_outputs("history", logs, *SPHERE)).split())
    assert "04b.csv is not used: its touches are those of sphere_2026-03-03.csv: a copy" in told
    assert "sphere_2099-03-05.csv: a date after today" in told
    assert "sphere_2026-03-02.csv: not read: line 1 '# feed: 500'" in told
    assert "sphere_2026-03-04.csv:" not in told


@pytest.mark.long
def test_a_jump_begins_the_trend_anew(tmp_path: Path) -> None:
    logs, table = month(tmp_path / "logs", 14, jump=(8, 0.005)), tmp_path / "h.csv"
    told, _ = both_outputs("history", logs, *SPHERE, "--limit", 3, "-o", table, "--verbose")
    jump = "since the jump of 2026-03-09 (qualify now if you have not since)"
    assert told.startswith(f"{jump}: no drift is detected")
    assert "jump: the trend starts again" in told
    assert "The map was made from sphere_2026-03-01.csv: the row" in " ".join(told.split())
    assert [row["series"] for row in rows(table)] == 8 * ["1"] + 6 * ["2"]


@pytest.mark.long
def test_verifications_have_a_trend_too(tmp_path: Path) -> None:
    probe, start = tmp_path / "probe.jsonl", datetime(2026, 3, 1, 8, tzinfo=UTC)
    for day in range(8):
        add_verification(
            probe, check(touches(300 + day, size=3e-4 * day)), pretravel_map=old_map(),
            map_name="m.json", touches_name="t", decision="kept", time=start + timedelta(days=day),
        )  # fmt: skip
        if day == 0:
            assert "too few days to distinguish drift" in run("history", probe)
    told = run(
        "history", probe, "--limit", 4, "--plot", tmp_path / "h.png", "-o", tmp_path / "h.csv"
    )
    assert "8 verifications" in told
    due = datetime.fromisoformat(told.partition("due on ")[2][:10])
    # 0.3 µm a day: 4 µm after 13.3 days. u of the slope: 0.1 µm / 6.5 days, 5 % of it.
    assert abs((due - datetime(2026, 3, 14)).days) <= 3
    assert len(rows(tmp_path / "h.csv")) == 8


@pytest.mark.long
def test_a_new_map_is_not_called_a_jump(tmp_path: Path) -> None:
    probe, start = tmp_path / "probe.jsonl", datetime(2026, 3, 1, 8, tzinfo=UTC)
    maps = {
        "old.json": old_map(),
        "new.json": replace(old_map(), coefficients=old_map().coefficients * 1.001),
    }
    for day in range(6):
        name = "old.json" if day < 3 else "new.json"
        add_verification(
            probe, check(touches(300 + day)), pretravel_map=maps[name], map_name=name,
            touches_name="t", decision="accepted new.json" if day == 2 else "kept",
            time=start + timedelta(days=day),
        )  # fmt: skip
    told = run("history", probe, "--limit", 4)
    assert "; since the new map of 2026-03-04: " in told
    assert told.count("new.json; the history continues with it") == 1
    assert "new map" in told


def test_what_a_terminal_would_obey_is_shown_as_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A history of somebody else, on a terminal: elsewhere the signs are left out."""
    content = (FOLDER / "history.jsonl").read_text().replace("physical.nc", "\\u001b]0;x\\u0007a")
    (tmp_path / "probe.jsonl").write_text(content)
    monkeypatch.setattr("click.utils.should_strip_ansi", lambda *_: False)
    told = run("history", tmp_path / "probe.jsonl", "--verbose")
    assert r"\x1b]0;x\x07a" in told
    assert told.replace("\n", "").isprintable()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("{0}/logs",), "needs the calibrated diameter.*--diameter"),
        (("{0}/probe.jsonl", "--diameter", 25), "with a file of verifications.*--diameter"),
        (("{0}/logs", "--diameter", 25, "--map", "{0}/m.json", "--kind", "harmonic"),
         "the map gives it"),
        (("{0}/empty", "--diameter", 25), "the folder has no file of touches"),
        (("{0}/bad", "--diameter", 25), "none of 1 file can be used. The first one:"),
        (("{0}/lying", "--diameter", 25, "--tip-diameter", 6),
         r"180° from the probe axis \(0,0,1\).*Give the axis.*from a map: qualify the "),
        (("{0}/logs", "--diameter", 25, "--limit", 0), "--limit"),
        (("{0}/no.jsonl",), "there is no such history"),
        (("{0}/logs", "--diameter", 20, "--map", "{0}/map.json"),
         "on a sphere of 20 mm, the map was made on a sphere of 25 mm"),
    ],
)  # fmt: skip
def test_refusals(tmp_path: Path, words: tuple[object, ...], message: str) -> None:
    for name in ("logs", "bad", "empty", "lying"):
        (tmp_path / name).mkdir()
    # A horizontal spindle, along x, and a touch from below.
    n = np.vstack([sphere_pattern_25()[:, ::-1], [[0.0, 0.0, -1.0]]])
    write_touches(tmp_path / "lying" / "2026-03-01.csv", Touches(15.49 * n, n))
    write_touches(tmp_path / "logs" / "2026-03-01.csv", touches(1))
    (tmp_path / "bad" / "2026-03-01.csv").write_text("nothing\n")
    write_map(tmp_path / "map.json", old_map())
    given = [w.format(tmp_path) if isinstance(w, str) else w for w in words]
    told = " ".join(run("history", *given, code=2).split())
    assert re.search(message, told), told


def test_what_is_doubtful_of_the_map_of_the_first_day_is_said(tmp_path: Path) -> None:
    """A history has no axis: here the spindle is along x, and the map along z."""
    n, logs = sphere_pattern_25()[:, ::-1], tmp_path / "logs"
    logs.mkdir()
    for day in (1, 2):
        write_touches(logs / f"2026-03-0{day}.csv", Touches((15.49 + 1e-6 * day) * n, n))
    warned = " ".join(both_outputs("history", logs, *SPHERE)[1].split())
    assert "2026-03-01.csv: the touches reach to polar 158°" in warned
