"""Logs of Grbl: work coordinates, repeats, misses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.controls.logs.grbl import read_grbl_log
from pretravel.files import ReadingOptions, SourceFile, read_readings
from pretravel.files.logs.joining import join
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
        found = read_grbl_log(written(tmp_path, GRBL_LOG + block))
        assert found.lines == (4, 6, 11)
        # The last touch of the log was at -75, not at -90: the report repeats another one.
        assert sum("repeats a touch that is not in this log" in w for w in found.warnings) == 1

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            (GRBL_LOG.replace("$13=0", ""), "does not show whether reports are in inches"),
            (GRBL_LOG.replace("WCO", "MPX").replace("[G54", "[X"), "give the offset"),
            ("[G54:-100.0,50,-20]\n" + GRBL_LOG.replace("WCO", "MPX"), "neither the active one"),
            (
                GRBL_LOG + "<Idle|WCO:0.000,0.000,0.000>\n[PRB:1.0,2.0,3.0:1]\n",
                "line 12: WCO was .* among the touches; split the log there",
            ),
            (
                GRBL_LOG.replace("<Idle", "[PRB:1,2,3:1]\n<Idle", 1).replace("[G54", "[X"),
                "before the first",
            ),
            (
                "[GC:G0 G54 G21]\n" + GRBL_LOG + "[GC:G0 G55 G21]\n[PRB:1.0,2.0,3.0:1]\n",
                "line 13: G55 became active here, among the touches",
            ),
            (
                GRBL_LOG + "[GC:G0 G54]\n[GC:G0 G55]\n[PRB:1.0,2.0,3.0:1]\n",
                "line 13: G55 became active here",
            ),
            (GRBL_LOG + "[PRB:1.0,2.0,3.0]\n", "logs of two machines"),
            (GRBL_LOG + "<Probe,MPos:1.0,2.0\n", "cut off"),
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

    def test_another_offset_than_that_of_the_log_is_refused(self, tmp_path: Path) -> None:
        file = written(tmp_path, GRBL_LOG)
        found = read_grbl_log(file, offset=(-100.0, 50.0, -20.0))
        assert np.array_equal(found.positions, read_grbl_log(file).positions)
        with pytest.raises(InputError, match="the log states the offset -100,50,-20 mm"):
            read_grbl_log(file, offset=(-100.0, 50.0, 0.0))

    def test_offset_of_the_active_coordinates(self, tmp_path: Path) -> None:
        text = (
            "$13=1\n[GC:G0 G55 G17 G21]\n[G55:1.0000,2.0000,3.0000]\n[G92:0.0000,0.0000,1.0000]\n"
            "[TLO:0.5000]\nok\n[PRB:2.0000,2.0000,5.5000:1]\n"
        )
        found = read_grbl_log(written(tmp_path, text))
        assert found.positions[0] == pytest.approx(np.array([1.0, 0.0, 1.0]) * 25.4)

    def test_what_changes_after_the_last_touch_does_not_matter(self, tmp_path: Path) -> None:
        """Senders set the origin after the probing; and the first $G can be the last command."""
        text = GRBL_LOG + "[GC:G0 G55 G21]\n<Idle|MPos:0,0,0|WCO:0.000,0.000,0.000>\n"
        assert read_grbl_log(written(tmp_path, text)).lines == (4, 6, 11)

    def test_a_work_system_stated_after_the_touches_is_not_taken_for_theirs(
        self, tmp_path: Path
    ) -> None:
        text = "$13=0\n[PRB:1.000,2.000,3.000:1]\n[GC:G0 G54 G21]\n[G54:1.000,1.000,1.000]\n"
        with pytest.raises(InputError, match="before the first report where the work"):
            read_grbl_log(written(tmp_path, text))
        found = read_grbl_log(written(tmp_path, text), offset=(1.0, 1.0, 1.0))
        assert found.positions.tolist() == [[0.0, 1.0, 2.0]]

    @pytest.mark.parametrize("more", ["", ",0.0000,0.0000"])
    def test_carvera_states_both_positions_and_its_rotary_axes(
        self, tmp_path: Path, more: str
    ) -> None:
        """The form of `ZProbe::probe_XYZ` and of the status line of this firmware."""
        text = (
            f"<Idle|MPos:-10.0000,-20.0000,-3.0000{more}|WPos:5.0000,5.0000,10.0000{more}|F:0.0>\n"
            "[PRB:-10.000,-20.000,-5.012:1]\nok\n[PRB:-10.000,-20.000,-5.014:0]\nok\n"
        )
        found = read_grbl_log(written(tmp_path, text), "mm")
        np.testing.assert_allclose(found.positions, [[5.0, 5.0, 7.988], [5.0, 5.0, 7.986]])
        assert found.contact is not None
        assert list(found.contact) == [True, False]

    @pytest.mark.parametrize(
        "report",
        [
            "[PRB:5.000,5.000,5.000]",
            "[Probe:5.000,5.000,5.000]",
            "<Probe,MPos:5.000,5.000,5.000,WPos:4.000,3.000,2.000>",
        ],
    )
    def test_old_reports_do_not_state_a_contact(self, tmp_path: Path, report: str) -> None:
        """The origin is MPos less WPos, within the last digit of both."""
        text = (
            f"$13=0\n<Idle,MPos:1.000,2.000,3.000,WPos:0.000,0.000,0.000>\nok\n{report}\nok\n"
            "<Run,MPos:1.001,2.000,3.000,WPos:0.000,0.000,0.001,Buf:0,RX:0>\n"
        )
        found = read_grbl_log(written(tmp_path, 2 * text))
        assert found.contact is None
        assert found.lines == (4, 10)
        assert found.positions.tolist() == 2 * [[4.0, 3.0, 2.0]]

    @pytest.mark.parametrize(
        ("second", "lines", "told"),
        [("G38.2 Z-9", (2, 4), 0), ("G38.4 Z9", (2,), 1), ("G38.5 Z9", (2,), 1)],
    )
    def test_where_a_contact_ends_is_no_touch(
        self, tmp_path: Path, second: str, lines: tuple[int, ...], told: int
    ) -> None:
        text = f"G38.2 Z-9 F90\n[PRB:1.0,2.0,3.0:1]\n{second} F9\n[PRB:1.0,2.0,3.1:1]\n"
        found = read_grbl_log(written(tmp_path, text), "mm", (0.0, 0.0, 0.0))
        assert found.lines == lines
        assert len(found.warnings) == told


@pytest.mark.parametrize(
    ("move", "normal", "axes"),
    [
        ("Z-5 F100", (1.0, 0.0, 0.0), "Z"),
        ("X50 Y3", (0.0, 0.0, 1.0), "X, Y"),
        ("X50", (1, 0, 0), ""),
    ],
)
def test_a_normal_across_the_moves_is_refused(
    move: str, normal: tuple[float, float, float], axes: str
) -> None:
    """A wall is not touched along z, nor a face from above along x and y."""
    rows = "".join(f"> G38.2 {move}\n[PRB:{x}.000,2.000,-3.001:1]\n" for x in (1, 2))
    file = SourceFile("grbl.log", f"$13=0\n{rows}".encode())
    options = ReadingOptions(offset=(0.0, 0.0, 0.0), normal=normal)
    if not axes:
        assert len(read_readings(file, options).touches) == 2
        return
    with pytest.raises(InputError, match=f"line 3: the move to this touch went along {axes}, and"):
        read_readings(file, options)
