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


@pytest.mark.parametrize("another", [False, True])
def test_a_file_for_a_project_that_was_closed_is_not_lost_silently(
    monkeypatch: pytest.MonkeyPatch, another: bool
) -> None:
    """The project that was left is saved no more: a file would be in none."""
    session, uploads = SimpleNamespace(project=Project()), Uploads()
    state = session.project.screen("part")
    uploads.add(Slot(state, "touches", (".csv",), several=False, limit=1000))
    monkeypatch.setattr(server, "SESSION", session)
    monkeypatch.setattr(server, "UPLOADS", uploads)

    class Sent:
        async def stream(self) -> AsyncIterator[bytes]:
            yield b"x_mm"
            if another:
                session.project = Project()

    sent: Any = Sent()
    answer = asyncio.run(server.receive_file("part", "touches", "a.csv", sent))
    said = json.loads(bytes(answer.body))["error"]
    assert ("another project is open now: give a.csv again" in said) == another
    assert len(state.files["touches"]) == (0 if another else 1)
