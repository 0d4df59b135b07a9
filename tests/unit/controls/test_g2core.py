"""Logs of g2core and TinyG."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.controls.logs.g2core import read_g2core_log
from pretravel.files.logs.joining import join
from tests.support.control_logs import G2CORE_LOG, PLAN, written

OFFSET = (-100.0, 50.0, -20.0)


class TestG2core:
    def test_strict_and_relaxed_reports_misses_and_answers_to_queries(self, tmp_path: Path) -> None:
        found = read_g2core_log(written(tmp_path, G2CORE_LOG), offset=OFFSET)
        assert found.lines == (2, 5, 6)
        assert found.contact == (True, True, False)
        assert found.positions == pytest.approx(
            np.array([[0, 0, 2.99], [10, 0, 2.98], [25, 0, -5]]), abs=1e-9
        )
        joined = join(found, PLAN, 3.0)
        assert joined.touches.labels == ("a", "b.1")
        assert joined.missed == ("wall",)

    def test_reports_that_a_sender_quotes(self, tmp_path: Path) -> None:
        quoted = G2CORE_LOG.replace('"', '\\"')
        assert read_g2core_log(written(tmp_path, quoted), offset=OFFSET).lines == (2, 5, 6)

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            (G2CORE_LOG + '{"prb":{"e":1,"x":1.0,"y":2.0\n', "line 7: this report is cut off"),
            (G2CORE_LOG + '{"prb":{"e":1,"x":1.0,"y":2.0}}\n', "the report has no z"),
            (G2CORE_LOG + '{"prb":{"e":2,"x":1,"y":2,"z":3}}\n', "has not ended"),
            (G2CORE_LOG + '{"prb":{"e":1,"x":1,"y":2,"z":3,"a":9}}\n', "the axis a has moved"),
            (G2CORE_LOG + '{"prb":{"e":1,"x":1,"y":2,"z":nan}}\n', "not a finite number"),
            ('{"prbz":-8.8}\n', "contains no report"),
        ],
    )
    def test_refused(self, tmp_path: Path, text: str, words: str) -> None:
        with pytest.raises(InputError, match=words):
            read_g2core_log(written(tmp_path, text), offset=OFFSET)

    def test_what_the_log_does_not_state(self, tmp_path: Path) -> None:
        path = written(tmp_path, G2CORE_LOG)
        with pytest.raises(InputError, match="give the offset"):
            read_g2core_log(path)
        with pytest.raises(InputError, match="positions in mm"):
            read_g2core_log(path, units="inch", offset=OFFSET)
