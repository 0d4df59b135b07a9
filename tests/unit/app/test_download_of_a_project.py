"""The project as a file: its name is a user's or a stranger's text, and stands in a header."""

from __future__ import annotations

import asyncio

import pytest

from pretravel.app.project import Project
from pretravel.app.server import send_project
from pretravel.app.session import SESSION


@pytest.mark.parametrize("name", ["a\r\nSet-Cookie: x=1", 'a"; filename="b.exe', "../../Größe 7"])
def test_the_name_of_a_project_adds_no_header(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SESSION, "project", Project(name))
    answer = asyncio.run(send_project())
    stated = answer.headers["content-disposition"]
    assert stated.startswith("attachment; filename*=UTF-8''")
    kept = stated.partition("''")[2]
    assert set(kept) <= set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789%-._~")
    assert kept.endswith(".pretravel")
    assert "set-cookie" not in answer.headers
