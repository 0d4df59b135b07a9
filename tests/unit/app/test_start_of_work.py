"""When work starts: with a slider, with a file, after what was typed, and ahead of all."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

import pytest

import pretravel.app.jobs as module
from pretravel.app.jobs import Job, Work, do_ahead
from pretravel.app.project import Inputs, ScreenState, StoredFile


def test_changes_while_live_work_runs_are_taken_together_after_it() -> None:
    begun, go_on = threading.Event(), threading.Event()
    computed: list[float] = []
    shown: list[float | None] = []

    def compute(inputs: Inputs) -> float:
        computed.append(inputs.settings["length"])
        begun.set()
        assert go_on.wait(20.0)
        return computed[-1]

    async def drag() -> float:
        state = ScreenState("designer")
        state.settings["length"] = 50.0
        work = Work(Job("live", compute, settings=("length",), live=True), state)
        state.listen(work.inputs_changed)
        work.inputs_changed()
        work.listen(lambda: shown.append(work.result))
        await asyncio.to_thread(begun.wait, 20.0)
        for length in range(51, 61):
            state.settings["length"] = float(length)
            await asyncio.sleep(0.0)
        go_on.set()
        while work.result != 60.0 or work.running:
            await asyncio.sleep(0.01)
        return float(work.result)

    assert asyncio.run(asyncio.wait_for(drag(), 60.0)) == 60.0
    assert computed == [50.0, 60.0]
    assert 50.0 in shown  # a slider that moves on does not throw a picture away


def test_a_file_starts_at_once_and_what_is_typed_after_a_pause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    computed: list[float] = []

    def compute(inputs: Inputs) -> float:
        computed.append(inputs.settings["length"])
        return computed[-1]

    async def use() -> list[float]:
        state = ScreenState("engineer")
        state.settings["length"] = 20.0
        work = Work(Job("typed", compute, settings=("length",), files=("touches",)), state)
        state.listen(work.inputs_changed)
        work.inputs_changed()
        await work.finished()
        monkeypatch.setattr(module, "_PAUSE", 600.0)
        state.files["touches"] = (StoredFile("touches.csv", b"1"),)
        await work.finished()  # would not come within the minute of the test
        monkeypatch.setattr(module, "_PAUSE", 0.05)
        for length in (2.0, 24.0, 24.9):
            state.settings["length"] = length
        await work.finished()
        return computed

    assert asyncio.run(asyncio.wait_for(use(), 60.0)) == [20.0, 20.0, 24.9]


def test_work_ahead_is_done_once_with_the_results_before_it() -> None:
    done: list[object] = []
    jobs = (
        Job("ahead 1", lambda inputs: inputs.file("touches").name),
        Job("ahead 2", lambda inputs: done.append(inputs.results["ahead 1"])),
    )
    for _ in range(2):
        do_ahead(jobs, {}, {"touches": (Path("sphere.csv"),)})
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.join()
    assert done == ["sphere.csv"]
