"""Work that follows a slider."""

from __future__ import annotations

import asyncio
import threading

from pretravel.app.jobs import Inputs, Job, Work
from pretravel.app.project import ScreenState


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
