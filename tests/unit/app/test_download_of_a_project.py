"""The project as a file: its name is a user's or a stranger's text, and stands in a header."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace

import pytest

from pretravel.app import server
from pretravel.app.project import Project


@pytest.mark.parametrize("name", ["a\r\nSet-Cookie: x=1", 'a"; filename="b.exe', "../../Größe 7"])
def test_the_name_of_a_project_adds_no_header(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    session = SimpleNamespace(project=Project(name))
    monkeypatch.setattr(server, "SESSION", SimpleNamespace(of=lambda identity: session))
    answer = asyncio.run(server.send_project("0" * 16))
    stated = answer.headers["content-disposition"]
    assert stated.startswith("attachment; filename*=UTF-8''")
    kept = stated.partition("''")[2]
    assert set(kept) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789%-._~")
    assert kept.endswith(".pretravel")
    assert "set-cookie" not in answer.headers
