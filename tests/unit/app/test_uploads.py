"""Files that come while the project changes."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from types import SimpleNamespace
from typing import Any

import pytest

from pretravel.app import server
from pretravel.app.project import Project
from pretravel.app.uploads import Slot, Uploads


@pytest.mark.parametrize("closed", [False, True])
def test_a_file_for_a_project_that_was_closed_is_not_lost_silently(
    monkeypatch: pytest.MonkeyPatch, closed: bool
) -> None:
    """The project that was left is saved no more: a file would be in none."""
    project = Project()
    opened, uploads = {project.identity: SimpleNamespace(project=project)}, Uploads()
    state = project.screen("part")
    uploads.add(project.identity, Slot(state, "touches", (".csv",), several=False, limit=1000))
    monkeypatch.setattr(server, "SESSION", SimpleNamespace(of=opened.get))
    monkeypatch.setattr(server, "UPLOADS", uploads)

    class Sent:
        async def stream(self) -> AsyncIterator[bytes]:
            yield b"x_mm"
            if closed:
                opened.clear()

    sent: Any = Sent()
    answer = asyncio.run(server.receive_file(project.identity, "part", "touches", "a.csv", sent))
    said = json.loads(bytes(answer.body))["error"]
    assert ("the project was closed: load this page, and give a.csv again" in said) == closed
    assert len(state.files["touches"]) == (0 if closed else 1)
    assert project.name == ("Untitled" if closed else "a")
