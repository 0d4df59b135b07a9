"""A project is saved after each change, and a fault of saving is not silent."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

from pretravel.app import session as sessions
from pretravel.app.project_file import read_project
from pretravel.app.session import Sessions, recent_projects
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
