"""Logs of Grbl: work coordinates, repeats, misses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.errors import InputError
from pretravel.formats.logs.grbl import read_grbl_log
from pretravel.formats.logs.joining import join
from tests.support.control_logs import (
    GRBL_LOG,
    PLAN,
    written,
)


class TestGrbl:
    def test_work_coordinates_repeats_and_misses(self, tmp_path: Path) -> None:
        rows_ = read_grbl_log(written(tmp_path, GRBL_LOG))
        # The report among the parameters of $# repeats the one before: it is no touch.
        assert rows_.lines == (4, 6, 11)
        assert rows_.contact == (True, True, False)
        assert rows_.positions == pytest.approx(
            np.array([[0, 0, 2.99], [10, 0, 2.98], [25, 0, -5]]), abs=1e-9
        )
        found = join(rows_, PLAN, 3.0)
        assert found.touches.labels == ("a", "b.1")
        assert found.missed == ("wall",)

    @pytest.mark.parametrize("before", ["[22:44:43] ", "< ", ""])
    def test_repeats_of_parameters_however_the_sender_puts_them(
        self, tmp_path: Path, before: str
    ) -> None:
        block = "".join(
            f"{before}{line}\n"
            for line in ("[TLO:0.000]", "<Idle|MPos:0,0,0>", "[PRB:-90.000,50.000,-17.020:1]", "ok")
        )
        assert read_grbl_log(written(tmp_path, GRBL_LOG + block)).lines == (4, 6, 11)

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            (GRBL_LOG.replace("$13=0", ""), "does not show whether reports are in inches"),
            (GRBL_LOG.replace("WCO", "MPX").replace("[G54", "[X"), "give the offset"),
            ("[G54:-100.0,50,-20]\n" + GRBL_LOG.replace("WCO", "MPX"), "neither the active one"),
            (GRBL_LOG + "<Idle|WCO:0.000,0.000,0.000>\n", "split the log there"),
            (
                GRBL_LOG.replace("<Idle", "[PRB:1,2,3:1]\n<Idle", 1).replace("[G54", "[X"),
                "before the first",
            ),
            (GRBL_LOG + "[GC:G0 G55 G21]\n", "became active among"),
            (GRBL_LOG + "[PRB:1.0,2.0,3.0,90.0:1]\n", "a fourth axis has moved"),
            (GRBL_LOG.replace("WCO:-100.000,50.000,-20.000", "WCO:1.0,2.0"), "WCO has 2 values"),
            (GRBL_LOG + "[PRB:1.0,2.0\n", "cut off"),
            (GRBL_LOG + "[PRB:1.0,2.0:1]\n", "a report of 2 axes"),
            (GRBL_LOG + "$13=1\n", "before they were mm"),
        ],
    )
    def test_refused(self, tmp_path: Path, text: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_grbl_log(written(tmp_path, text))

    def test_offset_of_the_active_coordinates(self, tmp_path: Path) -> None:
        text = (
            "$13=1\n[GC:G0 G55 G17 G21]\n[G55:1.0000,2.0000,3.0000]\n[G92:0.0000,0.0000,1.0000]\n"
            "[TLO:0.5000]\nok\n[PRB:2.0000,2.0000,5.5000:1]\n"
        )
        found = read_grbl_log(written(tmp_path, text))
        assert found.positions[0] == pytest.approx(np.array([1.0, 0.0, 1.0]) * 25.4)
