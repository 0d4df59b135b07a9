"""The result of the inputs as they are at this moment, which buttons give."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable

import pytest

from pretravel.app import jobs
from pretravel.app.jobs import LARGE, Finished, Job, Work, Works
from pretravel.app.project import Inputs, ScreenState, StoredFile
from pretravel.base.errors import PretravelError


def length(inputs: Inputs) -> float:
    """The setting; it is refused where it is negative."""
    given: float = inputs.settings["length"]
    if given < 0.0:
        raise PretravelError("the length is negative")
    return given


def finished_after(
    change: Callable[[Work], None], compute: Callable[[Inputs], float] = length, **options: bool
) -> Finished:
    """What is given at once after a change of a work that has the result 1."""

    async def run() -> Finished:
        state = ScreenState("screen")
        work = Work(Job("length", compute, settings=("length",), **options), state)
        state.listen(work.inputs_changed)
        state.settings["length"] = 1.0
        work.start()
        assert (await work.finished()).result == 1.0
        change(work)
        return await work.finished()

    return asyncio.run(asyncio.wait_for(run(), 60.0))


def typed(value: float) -> Callable[[Work], None]:
    def change(work: Work) -> None:
        work.state.settings["length"] = value

    return change


@pytest.mark.parametrize("live", [False, True])
def test_a_run_that_begins_soon_is_waited_for(live: bool) -> None:
    found = finished_after(typed(2.0), live=live)
    assert found.result == 2.0
    assert found.settings == {"length": 2.0}


def test_an_error_is_said_instead_of_the_old_result() -> None:
    with pytest.raises(PretravelError, match="the length is negative"):
        finished_after(typed(-1.0))


def test_a_cancelled_run_leaves_what_was_before() -> None:
    """The result of before, with its settings."""
    go_on = threading.Event()

    def slow(inputs: Inputs) -> float:
        assert inputs.settings["length"] == 1.0 or go_on.wait(20.0)
        return length(inputs)

    def cancelled(work: Work) -> None:
        typed(2.0)(work)
        work.start()
        work.cancel()
        go_on.set()

    found = finished_after(cancelled, slow)
    assert found.result == 1.0
    assert found.settings == {"length": 1.0}


def test_a_cancelled_first_run_gives_nothing() -> None:
    async def run() -> None:
        state = ScreenState("screen")
        work = Work(Job("length", length, settings=("length",)), state)
        state.settings["length"] = 1.0
        work.start()
        work.cancel()
        await work.finished()

    with pytest.raises(PretravelError, match=r"Cancelled after 0 s. There is no new result"):
        asyncio.run(asyncio.wait_for(run(), 60.0))


def test_work_with_a_button_gives_no_result_of_other_settings() -> None:
    with pytest.raises(PretravelError, match="have changed since this result: compute it again"):
        finished_after(typed(2.0), automatic=False)


def test_a_field_that_holds_nothing_valid_gives_no_result() -> None:
    def unfinished(work: Work) -> None:
        work.state.mark("length", "Length of the stylus")

    with pytest.raises(PretravelError, match="Length of the stylus is not a valid value"):
        finished_after(unfinished)


def test_what_is_typed_back_needs_no_new_run() -> None:
    runs = []

    def counted(inputs: Inputs) -> float:
        runs.append(inputs.settings["length"])
        return length(inputs)

    def there_and_back(work: Work) -> None:
        typed(2.0)(work)
        assert work.outdated
        typed(1.0)(work)
        assert not work.outdated

    assert finished_after(there_and_back, counted).result == 1.0
    assert runs == [1.0]


def test_without_a_result_it_says_what_to_do() -> None:
    work = Work(Job("length", length, automatic=False), ScreenState("screen"))
    with pytest.raises(PretravelError, match="no result yet"):
        asyncio.run(work.finished())


def doubled(inputs: Inputs) -> float:
    return 2.0 * float(inputs.results["length"])


FIRST = Job("length", length, settings=("length",))
SECOND = Job("double", doubled, after=(FIRST,))


def test_work_that_comes_after_another_waits_for_it_and_is_stale_with_it() -> None:
    async def run() -> None:
        works, state = Works(), ScreenState("screen")
        state.settings["length"] = 1.0
        second = works.of(state, SECOND)
        first = works.of(state, FIRST)
        assert (await second.finished()).result == 2.0
        state.settings["length"] = 3.0
        assert second.outdated  # before the first one has begun
        assert (await first.finished()).result == 3.0
        assert (await second.finished()).result == 6.0
        state.mark("length", "Length")
        assert second.outdated
        state.mark("length", "")
        assert not second.outdated
        state.settings["length"] = -1.0
        with pytest.raises(PretravelError, match="negative"):
            await first.finished()
        assert second.result is None  # nothing of an old length is left

    asyncio.run(asyncio.wait_for(run(), 60.0))


def test_large_files_are_worked_on_in_a_process_of_their_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Cancel ends it, and it keeps no memory of the server."""
    begun = []

    class Process:
        def __init__(self, compute: object, *inputs: object) -> None:
            begun.append(compute)

        def kill(self) -> None:
            pass

        def result(self, *_: object) -> float:
            return 7.0

    monkeypatch.setattr(jobs, "TaskProcess", Process)

    async def run(size: int) -> object:
        state = ScreenState("screen")
        state.files["touches"] = (StoredFile("large.csv", b"x" * size),)
        work = Work(Job("size", size_of, files=("touches",), needs=("touches",)), state)
        work.start()
        return (await work.finished()).result

    assert asyncio.run(asyncio.wait_for(run(LARGE), 60.0)) == LARGE
    assert begun == []
    assert asyncio.run(asyncio.wait_for(run(LARGE + 1), 60.0)) == 7.0
    assert begun == [size_of]


def size_of(inputs: Inputs) -> int:
    return inputs.file("touches").stat().st_size


def test_a_result_is_old_where_the_settings_changed_while_it_was_computed() -> None:
    go_on = threading.Event()

    def slow(inputs: Inputs) -> float:
        assert go_on.wait(20.0)
        return length(inputs)

    async def run() -> None:
        state = ScreenState("screen")
        work = Work(Job("length", slow, settings=("length",), automatic=False), state)
        state.listen(work.inputs_changed)
        state.settings["length"] = 1.0
        work.start()
        state.settings["length"] = 2.0
        go_on.set()
        with pytest.raises(PretravelError, match="have changed since this result"):
            await work.finished()
        assert (work.result, work.outdated) == (1.0, True)
        state.settings["length"] = 1.0
        assert not work.outdated

    asyncio.run(asyncio.wait_for(run(), 60.0))


def test_a_start_is_not_lost_while_what_comes_before_is_computed() -> None:
    """A button that is pressed then has its result as soon as that is there."""
    go_on = threading.Event()

    def slow(inputs: Inputs) -> float:
        assert inputs.settings["length"] == 1.0 or go_on.wait(20.0)
        return length(inputs)

    first_job = Job("length", slow, settings=("length",))
    second_job = Job("double", doubled, after=(first_job,), automatic=False)

    async def run() -> None:
        works, state = Works(), ScreenState("screen")
        state.settings["length"] = 1.0
        second = works.of(state, second_job)
        first = works.of(state, first_job)
        await first.finished()
        state.settings["length"] = 3.0
        second.start()
        assert second.outdated
        go_on.set()
        assert (await second.finished()).result == 6.0

    asyncio.run(asyncio.wait_for(run(), 60.0))
