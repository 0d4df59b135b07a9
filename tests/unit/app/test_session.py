"""A project is saved after each change, and a fault of saving is not silent."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest

from pretravel.app import session as sessions
from pretravel.app.project_file import read_project
from pretravel.app.session import Session, recent_projects
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


def test_a_change_is_saved_and_the_last_project_opened_again(tmp_path: Path) -> None:
    async def use() -> None:
        session = Session()
        session.start(None, "http://127.0.0.1:1/")
        session.project.name = "First"
        session.project.screen("part").settings["lever"] = 50.0
        path = session.path
        assert path is not None
        await until(path.exists)
        session.new()
        session.project.name = "Second"
        session.project.screen("part").settings["lever"] = 60.0
        session.save_now()
        assert [one.name for one in recent_projects()] == ["Second", "First"]
        session.open(path)
        assert session.project.screen("part").settings["lever"] == 50.0
        with pytest.raises(PretravelError, match=r"open in another workbench, at .*:1/: use"):
            Session().start(path, "http://127.0.0.1:2/")
        await until(lambda: not session.unsaved)
        session.new()  # lets the first one go
        again = Session()
        again.start(None, "http://127.0.0.1:2/")
        assert again.project.name == "First"  # used last

    asyncio.run(use())


def test_a_project_that_cannot_be_saved_says_so_until_it_can(tmp_path: Path) -> None:
    async def use() -> None:
        folder = tmp_path / "stick"
        folder.mkdir()
        session = Session()
        session.start(folder / "a.pretravel", "")
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
    session = Session()
    session.start(None, "", said.append)
    assert len(said) == 1
    assert f"{damaged}: this project is damaged" in said[0]
    assert session.path != damaged
    assert damaged.read_bytes() == b"PK damaged"
