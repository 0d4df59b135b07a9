"""Logs that are not those of a new, whole run: `verify` tests nothing and says so."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from pretravel.controls.program_log import TOUCH_COLUMNS
from pretravel.files.map_file import write_map
from pretravel.files.probe_history import read_history
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.touches import Touches
from tests.support.commands import both_outputs, run
from tests.support.touches_of_days import SPHERE
from tests.unit.qualification.test_verification import old_map, touches


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stale")
    write_map(folder / "map.json", old_map())
    for day in (1, 2):
        write_touches(folder / f"day{day}.csv", touches(10 + day))
    return folder


def log_lines(made: Touches) -> list[str]:
    lines = [f"pretravel-log,1,today,{len(made)},end", "run,7,2026-11-25,end"]
    lines += ["work,G54,0.0,end", f"columns,{','.join(TOUCH_COLUMNS)},end"]
    assert made.approaches is not None
    for row in range(len(made)):
        values = [
            *(1e3 * made.positions[row]),
            *made.normals[row],
            *made.approaches[row],
            50,
            0,
            0,
            0,
        ]
        numbers = ",".join(f"{value:.9f}" for value in values)
        lines.append(f"touch,s{row + 1},{numbers},1.0000,end")
    return [*lines, f"done,{len(made)},end"]


def verified(folder: Path, *more: object, code: int = 0) -> str:
    common = ("--map", folder / "map.json", "--diameter", 25)
    return "".join(both_outputs("verify", *more, *common, code=code))


class TestLogs:
    def written(self, folder: Path, name: str, lines: list[str]) -> Path:
        path = folder / name
        path.write_text("\n".join(lines) + "\n")
        return path

    def test_a_whole_log(self, folder: Path, tmp_path: Path) -> None:
        verified(folder, self.written(tmp_path, "today.log", log_lines(touches(11))))

    def test_a_run_that_was_stopped(self, folder: Path, tmp_path: Path) -> None:
        lines = log_lines(touches(11))
        lines[-6:] = ["stopped,s9,1,end"]
        said = verified(folder, self.written(tmp_path, "today.log", lines), code=3)
        assert "the program did not run to its end (stopped at s9: no contact)" in said
        assert "The probe is not verified" in said

    @pytest.mark.parametrize("cut", [slice(10, 11), slice(-3, None)])
    def test_fewer_touches_than_the_plan(self, folder: Path, tmp_path: Path, cut: slice) -> None:
        lines = log_lines(touches(11))
        del lines[cut]
        path = self.written(tmp_path, "today.log", lines)
        assert "touches are in the log" in verified(folder, path, code=3)


def test_touches_that_are_older_than_the_map_are_named(tmp_path: Path) -> None:
    made = replace(old_map().provenance, touches_file="14.03.2026.csv")
    write_map(tmp_path / "map.json", replace(old_map(), provenance=made))
    for day, older in (("2026-03-13", True), ("2026-03-14", False)):
        write_touches(tmp_path / f"{day}.csv", touches(11))
        said = verified(tmp_path, tmp_path / f"{day}.csv")
        assert (f"these touches are of {day}, before those of the map, 2026" in said) == older


def test_the_touches_of_the_map_test_nothing(tmp_path: Path) -> None:
    """They were "no change found", exit code 0, and a row of the history."""
    made, history = tmp_path / "map.json", tmp_path / "probe.jsonl"
    sphere = ("--diameter", 24.9987)
    run("qualify", SPHERE, *sphere, "--tip-diameter", 6, "--kind", "harmonic", "-o", made)
    common = ("--map", made, *sphere, "--history", history)
    said = "".join(both_outputs("verify", SPHERE, *common, code=3))
    assert "nothing was tested: all 75 touches are identical to touches that the map" in said
    assert "no change found" not in said
    assert not history.exists()
    sphere_again = read_touches(SPHERE)
    for shift in (0.05, 0.01):  # of the centre, which is fitted: the probe has not changed
        moved = sphere_again.positions + np.array([shift, 0.0, 0.0])
        write_touches(tmp_path / "moved.csv", replace(sphere_again, positions=moved))
        said = "".join(both_outputs("verify", tmp_path / "moved.csv", *common[:-2]))
        assert ("centre moved       (+0.050, " in said) == (shift > 0.02)
        assert ("a bent stylus or a moved tip" in said) == (shift > 0.02)


class TestHistory:
    def test_the_same_touches_are_refused_with_their_entry(
        self, folder: Path, tmp_path: Path
    ) -> None:
        """Four runs on one old log gave four rows of "no change"."""
        history = ("--history", tmp_path / "probe.jsonl")
        verified(folder, folder / "day1.csv", *history)
        header, *rows = (folder / "day2.csv").read_text().splitlines()
        dated = [f"{header},date", *(f"{row},14.03.2026 10:30" for row in rows)]
        (tmp_path / "day2.csv").write_text("\n".join(dated))
        verified(folder, tmp_path / "day2.csv", *history)
        second = json.loads(history[1].read_text().splitlines()[1])
        time = datetime.fromisoformat(second["time"]).astimezone()
        assert f"{time:%Y-%m-%d %H:%M}" == "2026-03-14 10:30"
        kept = (tmp_path / "probe.jsonl").read_bytes()
        for _ in range(2):
            said = verified(folder, folder / "day1.csv", *history, code=3)
            assert "line 1: these touches are in the history already, from day1.csv" in said
        assert (tmp_path / "probe.jsonl").read_bytes() == kept
        verified(folder, folder / "day1.csv")

    def test_files_of_several_days(self, folder: Path, tmp_path: Path) -> None:
        """Together they were taken, though the history had one of them."""
        history, days = tmp_path / "probe.jsonl", []
        for day in (17, 14):
            days.append(tmp_path / f"2026-03-{day}.csv")
            moved = touches(13).positions + 1e-5 * day
            write_touches(days[-1], replace(touches(13), positions=moved))
        said = verified(folder, *days)
        assert "are of several days, 2026-03-14 to 2026-03-17 (the files)" in said
        verified(folder, days[0], "--history", history)
        said = verified(folder, *days, "--history", history, code=3)
        assert "line 1: these touches of one of the files are in the history" in said

    def test_those_of_the_last_entry_may_be_accepted(self, folder: Path, tmp_path: Path) -> None:
        history = ("--history", tmp_path / "probe.jsonl")
        verified(folder, folder / "day1.csv", *history)
        accept = ("--accept", tmp_path / "new.json")
        verified(folder, folder / "day1.csv", *history, *accept)
        once = read_history(tmp_path / "probe.jsonl")
        assert [entry["decision"] for entry in once] == ["accepted new.json"]
        said = verified(folder, folder / "day2.csv", *history)
        assert "the history has a later map of this probe, new.json (" in said
        verified(folder, folder / "day1.csv", *history, *accept, code=3)

    def test_an_entry_of_an_earlier_version_has_no_digest(
        self, folder: Path, tmp_path: Path
    ) -> None:
        history = tmp_path / "probe.jsonl"
        verified(folder, folder / "day1.csv", "--history", history)
        line = history.read_text()
        start = line.index(', "touches_id"')
        history.write_text(line[:start] + line[line.index("}", start) :])
        verified(folder, folder / "day1.csv", "--history", history)
