"""Replaced controls hear a click that was on its way, also where the server was busy."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest

from pretravel.app.components import layout


class _Element:
    """What `rebuild` uses of an element, and of its client."""

    def __init__(self) -> None:
        self.default_slot = self.client = self
        self.children: list[_Element] = []
        self.is_deleted = False
        self.removed: list[object] = []

    def descendants(self, *, include_self: bool) -> list[_Element]:
        assert include_self
        return [self]

    def update(self) -> None: ...

    def remove_elements(self, elements: list[object]) -> None:
        self.removed += elements

    def __enter__(self) -> None: ...

    def __exit__(self, *_: object) -> None: ...


def test_after_a_busy_server_they_stay_a_moment_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layout, "_ON_ITS_WAY", 0.05)
    monkeypatch.setattr(layout, "_LATE", 0.05)

    async def run() -> None:
        place: Any = _Element()
        button = _Element()
        place.children = [button]
        layout.rebuild(place, lambda: None)
        assert place.children == []
        time.sleep(0.15)  # the loop hears nothing
        await asyncio.sleep(0.0)
        assert place.removed == []
        while place.removed != [button]:
            await asyncio.sleep(0.01)

    asyncio.run(asyncio.wait_for(run(), 60.0))
