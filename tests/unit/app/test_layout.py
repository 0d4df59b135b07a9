"""Places that are built again: what stood there hears nothing more, and is not kept."""

from __future__ import annotations

import asyncio

from nicegui import Client, ui

from pretravel.app.components.layout import here, live
from pretravel.app.project import Listener


class Source:
    """Something that changes, as the work of a screen."""

    def __init__(self) -> None:
        self.listeners: list[Listener] = []

    def listen(self, listener: Listener) -> Listener:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener) if listener in self.listeners else None

    def change(self) -> None:
        for listener in tuple(self.listeners):
            listener()


def test_a_place_that_is_built_again_keeps_no_handler_of_its_former_content() -> None:
    source, heard = Source(), []
    built = 0

    def build() -> None:
        nonlocal built
        built += 1
        mine = built
        live([source.listen], lambda: None)
        here([source.listen], lambda: heard.append(mine))

    async def changes() -> list[int]:
        client = Client(ui.page(""), request=None)
        with client:
            live([source.listen], build)
        counts = []
        for _ in range(5):
            source.change()
            counts.append(len(source.listeners))
        kept = len(client.delete_handlers)
        client.delete()
        assert kept == 1, "NiceGUI keeps each of them until the tab closes"
        return counts

    assert asyncio.run(changes()) == [3] * 5
    assert 1 not in heard[1:], "the first content is gone after the first change"
    assert not source.listeners, "the tab is closed"
