"""A project is saved after each change, and a fault of saving is not silent."""

from __future__ import annotations

import asyncio
import gc
import os
import weakref
from collections.abc import Callable
from pathlib import Path

import pytest

from pretravel.app import session as sessions
from pretravel.app.jobs import WORKS, Job
from pretravel.app.project import Inputs, Project, StoredFile
from pretravel.app.project_file import read_project, write_project
from pretravel.app.session import Sessions, recent_projects
from pretravel.app.uploads import UPLOADS, Slot
from pretravel.base.errors import PretravelError


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "projects"
    folder.mkdir()
    monkeypatch.setattr(sessions, "projects_folder", lambda: folder)
    monkeypatch.setattr(sessions, "_PAUSE", 0.01)
    monkeypatch.setattr(sessions, "_PAUSE_AFTER_FAULT", 0.02)


async def until(reached: Callable[[], bool]) -> None:
    for _ in range(500):
        if reached():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("not reached in 5 s")


def test_projects_are_saved_and_the_last_one_opened_again(tmp_path: Path) -> None:
    async def use() -> None:
        opened = Sessions()
        opened.start(None, "http://127.0.0.1:1/")
        first = opened.current
        first.project.name = "First"
        first.project.screen("part").settings["lever"] = 50.0
        await until(first.path.exists)
        second = opened.new()
        second.project.name = "Second"
        second.project.screen("part").settings["lever"] = 60.0
        opened.save_now()
        assert [one.name for one in recent_projects()] == ["Second", "First"]
        # Both are open: another tab goes on with the first one.
        assert opened.open(first.path) is first
        assert opened.of(first.project.identity) is first
        assert first.project.screen("part").settings["lever"] == 50.0
        with pytest.raises(PretravelError, match=r"open in another workbench, at .*:1/: use"):
            Sessions().start(first.path, "http://127.0.0.1:2/")
        await until(lambda: not (first.unsaved or second.unsaved))
        for session in (first, second):
            session.close()
        again = Sessions()
        again.start(None, "http://127.0.0.1:2/")
        assert again.project.name == "Second"  # used last
        # A tab of a server that was started again shows its own project.
        found = again.of(first.project.identity)
        assert found is not None
        assert found.project.name == "First"
        assert again.of("0" * 16) is None

    asyncio.run(use())


@pytest.mark.long
def test_of_many_projects_those_that_no_tab_shows_are_closed() -> None:
    async def use() -> None:
        opened = Sessions()
        opened.start(None, "")
        first = opened.current
        first.project.name = "First"
        opened.save_now()
        for _ in range(8):
            opened.new()
        assert opened.of(first.project.identity) is not first  # it was closed, and opened again

    asyncio.run(use())


@pytest.mark.long
def test_closed_projects_do_not_wait_in_memory_for_the_collector() -> None:
    """Thirty projects of 20 MB took 742 MB: few objects are made, so that it seldom runs."""

    async def use() -> None:
        opened, projects = Sessions(), []
        gc.disable()
        try:
            for number in range(1, 15):
                project = Project("sent", f"{number:016x}")
                project.screen("part").files["touches"] = (StoredFile("a.csv", b"x_mm"),)
                projects.append(weakref.ref(opened.take(project).project))
                del project
                await asyncio.sleep(0.05)
            assert sum(each() is not None for each in projects) <= 9
        finally:
            gc.enable()

    asyncio.run(use())


def test_a_project_that_cannot_be_saved_says_so_until_it_can(tmp_path: Path) -> None:
    async def use() -> None:
        folder = tmp_path / "stick"
        folder.mkdir()
        opened = Sessions()
        opened.start(folder / "a.pretravel", "")
        session = opened.current
        folder.rmdir()
        session.project.screen("part").settings["lever"] = 50.0
        await until(lambda: "does not exist" in session.problem)
        folder.mkdir()
        await until(lambda: session.problem == "" and not session.unsaved)
        found = read_project(folder / "a.pretravel")
        assert found.screen("part").settings["lever"] == 50.0

    asyncio.run(use())


def test_a_last_project_that_is_damaged_is_said_and_kept(tmp_path: Path) -> None:
    damaged = tmp_path / "projects" / "0123456789abcdef.pretravel"
    damaged.write_bytes(b"PK damaged")
    said: list[str] = []
    opened = Sessions()
    opened.start(None, "", said.append)
    assert len(said) == 1
    assert f"{damaged}: this project is damaged" in said[0]
    assert opened.current.path != damaged
    assert damaged.read_bytes() == b"PK damaged"


def test_the_end_loses_nothing_that_was_dropped_while_something_was_computed() -> None:
    """The run of the file before is not brought back, as Cancel does."""

    def slow(inputs: Inputs) -> str:
        del inputs
        return "done"

    job = Job("slow", slow, files=("touches",), needs=("touches",), settings=("lever",))

    async def use() -> None:
        opened = Sessions()
        opened.start(None, "")
        session = opened.current
        state = session.project.screen("part")
        state.files["touches"] = (StoredFile("first.csv", b"x_mm"),)
        work = WORKS.of(state, job)
        await until(lambda: work.result == "done" and not work.running)
        state.files["touches"] = (StoredFile("second.csv", b"x_mm,y_mm"),)
        state.settings["lever"] = 60.0
        work.start()
        assert work.running
        assert opened.end() == []
        found = read_project(session.path).screen("part")
        assert [file.name for file in found.files["touches"]] == ["second.csv"]
        assert found.settings["lever"] == 60.0

    asyncio.run(use())


def test_what_another_computer_saved_stays_beside_what_is_here() -> None:
    """Two computers, or two caches, see no lock of each other."""

    async def use() -> None:
        opened = Sessions()
        opened.start(None, "")
        session = opened.current
        state = session.project.screen("part")
        state.settings["lever"] = 50.0
        opened.save_now()
        path = session.path
        theirs = read_project(path)
        theirs.screen("part").settings["lever"] = 70.0
        write_project(path, theirs)
        state.settings["lever"] = 60.0
        await until(lambda: session.path != path and session.path.exists())
        assert read_project(path).screen("part").settings["lever"] == 70.0
        assert read_project(session.path).screen("part").settings["lever"] == 60.0
        assert f"{path.name} was changed by another workbench" in session.notice
        state.settings["lever"] = 65.0  # and so on, beside it
        said = opened.end()
        assert said == [session.notice]
        assert read_project(path).screen("part").settings["lever"] == 70.0
        assert read_project(session.path).screen("part").settings["lever"] == 65.0

    asyncio.run(use())


def test_a_file_that_was_only_copied_back_is_no_change() -> None:
    async def use() -> None:
        opened = Sessions()
        opened.start(None, "")
        session = opened.current
        session.project.screen("part").settings["lever"] = 50.0
        opened.save_now()
        os.utime(session.path, (1e9, 1e9))
        session.project.screen("part").settings["lever"] = 60.0
        assert opened.end() == []
        assert read_project(session.path).screen("part").settings["lever"] == 60.0

    asyncio.run(use())


@pytest.mark.long
def test_what_cannot_be_saved_in_its_place_is_kept_elsewhere_and_said(tmp_path: Path) -> None:
    async def use() -> None:
        folder = tmp_path / "stick"
        folder.mkdir()
        opened = Sessions()
        opened.start(folder / "a.pretravel", "")
        session = opened.current
        folder.rmdir()
        session.project.screen("part").settings["lever"] = 50.0
        for _ in range(12):  # others are closed, this one is not
            opened.new()
        assert opened.of(session.project.identity) is session
        (said,) = opened.end()
        assert "does not exist" in said
        kept = Path(said.rpartition(" is kept in ")[2])
        assert read_project(kept).screen("part").settings["lever"] == 50.0

    asyncio.run(use())


def test_a_closed_project_writes_no_more_and_leaves_the_memory() -> None:
    async def use() -> None:
        opened = Sessions()
        opened.start(None, "")
        session = opened.current
        state = session.project.screen("part")
        UPLOADS.add(session.project.identity, Slot(state, "touches", (), False, 100))
        state.files["touches"] = (StoredFile("a.csv", b"x_mm"),)
        path, gone = session.path, weakref.ref(session.project)
        session.close()
        other = Project("other", session.project.identity)
        write_project(path, other)
        del session, state
        opened._open.clear()
        await asyncio.sleep(0.1)
        gc.collect()
        assert gone() is None
        assert read_project(path).name == "other"

    asyncio.run(use())


def test_names_are_listed_without_the_contents(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thirty projects of 30 MB are not read for a list of names."""

    async def use() -> None:
        opened = Sessions()
        opened.start(None, "")
        project = opened.project
        project.name = "Large"
        project.screen("part").files["touches"] = (
            StoredFile("a.csv", os.urandom(3_000_000)),
            StoredFile("b.csv", b"x_mm"),
        )
        opened.end()

    asyncio.run(use())
    monkeypatch.setattr(sessions, "read_project", lambda path: pytest.fail(f"{path} is read"))
    import tracemalloc

    tracemalloc.start()
    (found,) = recent_projects()
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (found.name, found.contents) == ("Large", ("a.csv", "b.csv"))
    assert most < 2_800_000  # its directory alone can have 2.2 MB
