"""What long work shows on stderr, and that it shows nothing elsewhere."""

from __future__ import annotations

import io
import logging
import sys

import pytest

from pretravel.cli.progress import WorkClock, working
from pretravel.design.fem.mesh import MeshSettings
from pretravel.design.fem.reduction_cache import reduced_model
from pretravel.prediction.catalogue import load_probe


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_what_is_left_follows_from_the_part_that_is_done() -> None:
    clock = WorkClock(0.0, "work")
    clock.next_stage("a", 0.05, 1.0)
    assert clock.text(3.0) == "3 s · work: a"  # too little is known
    clock.next_stage("b", 0.5, 10.0)
    assert clock.text(12.0) == "12 s, about 8 s left · work: b"
    assert clock.text(25.0) == "25 s · work: b"  # longer than expected


def test_another_count_begins_anew() -> None:
    """Cycles after a finite-element model that took a minute: the minute is no measure of them."""
    clock = WorkClock(0.0, "work")
    clock.next_stage("factorising", 0.6, 60.0)
    clock.next_stage("cycle 1 of 4", 0.0, 100.0)
    clock.next_stage("cycle 3 of 4", 0.5, 110.0)
    assert clock.text(110.0) == "1 min 50 s, about 10 s left · work: cycle 3 of 4"


def test_a_terminal_shows_the_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    logger = logging.getLogger("pretravel")
    before = (list(logger.handlers), logger.level)
    with working("solving"):
        logging.getLogger("pretravel.somewhere").info("stage [2] of x", extra={"done": 0.5})
    assert "solving: stage [2] of x" in shown.getvalue()
    assert (list(logger.handlers), logger.level) == before


def test_a_pipe_shows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.StringIO()
    monkeypatch.setattr(sys, "stderr", shown)
    with working("solving"):
        logging.getLogger("pretravel.somewhere").info("stage")
    assert shown.getvalue() == ""


@pytest.mark.long
def test_finite_elements_state_how_much_is_done(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path))
    with caplog.at_level(logging.INFO, logger="pretravel"):
        reduced_model(load_probe("omp40-2"), MeshSettings(refinement=0.3))
    stages = [(r.getMessage().split()[0], r.done) for r in caplog.records if hasattr(r, "done")]
    # The symmetric probe has three kinds of displacements, each with a factorisation.
    assert [name for name, _ in stages] == [
        "meshing", "assembling", "factorising", "factorising", "factorising", "storing",
    ]  # fmt: skip
    assert [done for _, done in stages] == sorted({done for _, done in stages})
