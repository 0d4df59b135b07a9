"""Logs of LinuxCNC: that of pretravel and that of PROBEOPEN."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.controls.logs.pretravel_log import read_own_log
from pretravel.controls.logs.probeopen import read_probeopen
from pretravel.files.readings import read_readings
from tests.support.commands import run
from tests.support.control_logs import (
    OWN_LOG,
    OWN_LOG_HEAD,
    OWN_LOG_TOUCH,
    PROBEOPEN_ROW,
    written,
)


class TestOwnLog:
    @pytest.mark.parametrize(
        "change",
        [
            lambda text: text,
            lambda text: text.replace("\n", "\r\n"),
            lambda text: "\ufeff" + text,
            lambda text: text.replace("\n", "\n\n"),
        ],
    )
    def test_touches_misses_and_turn(self, tmp_path: Path, change: object) -> None:
        found = read_own_log(written(tmp_path, change(OWN_LOG)))  # type: ignore[operator]
        assert found.touches.labels == ("a",)
        assert found.missed == ("b",)
        assert np.degrees(found.rotation) == pytest.approx(30.0)
        assert found.touches.feeds is not None
        assert found.touches.feeds.tolist() == [50.0]
        assert found.notes() == ["1 touch missed: b"]

    def test_lost_lines_are_noticed(self, tmp_path: Path) -> None:
        lost = OWN_LOG.replace(OWN_LOG_TOUCH.format(label="b", touched="0.0000000"), "")
        assert "1 of its 2 touches" in read_own_log(written(tmp_path, lost)).notes()[0]
        for line in ("work", "columns"):
            kept = [text for text in OWN_LOG.splitlines() if not text.startswith(line)]
            with pytest.raises(InputError, match="before the first touch"):
                read_own_log(written(tmp_path, "\n".join(kept)))

    def test_that_ended_early_says_so(self, tmp_path: Path) -> None:
        early = OWN_LOG.replace("done,2,end\n", "").replace(
            OWN_LOG_TOUCH.format(label="b", touched="0.0000000"), ""
        )
        notes = read_own_log(written(tmp_path, early)).notes()
        assert notes == ["the program did not run to its end: 1 of its 2 touches are in the log"]

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            (OWN_LOG_HEAD + OWN_LOG_TOUCH.format(label="a", touched="1")[:-9], 4, "cut off"),
            (OWN_LOG_HEAD + OWN_LOG_TOUCH.format(label="a", touched="1") * 2, 5, "occurs twice"),
            (
                OWN_LOG_HEAD + OWN_LOG_TOUCH.format(label="a", touched="1") + OWN_LOG_HEAD,
                5,
                "a second run begins",
            ),
            (
                OWN_LOG_HEAD + "touch,a,0,0,nan,0,0,1,0,0,-1,50,0,0,0,1,end\n",
                4,
                "'nan' is not a finite",
            ),
            (OWN_LOG_HEAD + "touch,a,0,0,end\n", 4, "3 values, 15 are needed"),
            (OWN_LOG_HEAD + "work,G54,0.0,end\n", 4, "one line 'work'"),
            (OWN_LOG_HEAD.replace("log,1,", "log,2,"), 1, "another version"),
            ("pretravel-log,end\n", 1, "another version"),
            (OWN_LOG_HEAD + "speech,a,end\n", 4, "'speech' is not a line"),
            (
                OWN_LOG_HEAD.replace("nominal_x_mm", "nominal_x_in"),
                3,
                "are not those of this version",
            ),
            (OWN_LOG_TOUCH.format(label="a", touched="1"), 1, "must begin with pretravel-log"),
            (
                OWN_LOG_HEAD + OWN_LOG_TOUCH.format(label="a", touched="0"),
                None,
                "no touch; 1 were missed",
            ),
        ],
    )
    def test_refused_with_its_line(
        self, tmp_path: Path, text: str, line: int | None, words: str
    ) -> None:
        with pytest.raises(InputError, match=words) as caught:
            read_own_log(written(tmp_path, text))
        assert (f"line {line}:" in str(caught.value)) == (line is not None)

    def test_turned_work_coordinates_reach_every_command(self, tmp_path: Path) -> None:
        log = written(tmp_path, OWN_LOG, "turned.log")
        message = run("convert", log, "-o", tmp_path / "t.csv", code=2)
        assert "turned by 30°" in message
        assert not (tmp_path / "t.csv").exists()
        run("convert", log, "-o", tmp_path / "m.csv", "--frame", "machine")
        run("convert", log, "-o", tmp_path / "w.csv", "--frame", "work")
        side = OWN_LOG.replace(",0,0,1,0,0,-1,", ",1,0,0,-1,0,0,")
        found = read_readings(written(tmp_path, side, "side.log")).in_machine_axes()
        # Counter-clockwise: the work's x axis points 30° towards the machine's y.
        assert found.touches.normals[0] == pytest.approx([np.cos(np.pi / 6), 0.5, 0.0])


class TestProbeOpen:
    def test_units_must_be_told(self, tmp_path: Path) -> None:
        path = written(tmp_path, PROBEOPEN_ROW.format(x=0.0))
        with pytest.raises(InputError, match="give the units, mm or inch"):
            read_probeopen(path)
        assert read_probeopen(path, "inch").positions[0, 2] == pytest.approx(2.99 * 25.4)

    @pytest.mark.parametrize(
        ("text", "line", "words"),
        [
            (
                PROBEOPEN_ROW.format(x=0.0) + "1.0 2.0 3.",
                2,
                "3 values where PROBEOPEN writes 9; the last",
            ),
            (
                PROBEOPEN_ROW.format(x=0.0) + PROBEOPEN_ROW.format(x=1.0)[:-4],
                2,
                "'0.000' is cut off|cut off",
            ),
            (
                PROBEOPEN_ROW.format(x=0.0) + "(PROBEOPEN b.txt)\n" + PROBEOPEN_ROW.format(x=0.0),
                2,
                "2 values",
            ),
            (
                PROBEOPEN_ROW.format(x=0.0) + "nan" + PROBEOPEN_ROW.format(x=0.0)[8:],
                2,
                "'nan' is not a finite",
            ),
            (PROBEOPEN_ROW.format(x=0.0) + "0 0 2.99 90 0 0 0 0 0\n", 2, "a rotary axis"),
        ],
    )
    def test_refused_with_its_line(self, tmp_path: Path, text: str, line: int, words: str) -> None:
        with pytest.raises(InputError, match=words) as caught:
            read_probeopen(written(tmp_path, text), "mm")
        assert f"line {line}:" in str(caught.value)
