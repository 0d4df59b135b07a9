"""Places of a screen: steps on the left; answer, picture and tabs on the right."""

from __future__ import annotations

import asyncio
import re
import weakref
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from nicegui import Client, ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement
from nicegui.slot import Slot

from pretravel.app.project import Listener


@dataclass(frozen=True)
class ScreenPlaces:
    """The places of a screen; all screens have the same ones.

    Attributes
    ----------
    inputs : Element
        Steps, on the left.
    status : Element
        On top of what comes out: progress and errors.
    answer : Element
        Below it: the verdict with its key figures, in view whatever tab is chosen.
    picture : Element
        Below the answer.
    """

    inputs: Element
    status: Element
    answer: Element
    picture: Element
    _tabs: ui.tabs
    _panels: ui.tab_panels

    @contextmanager
    def tab(self, name: str) -> Iterator[Element]:
        """The content of a tab below the picture; the first one is chosen."""
        with self._tabs:
            ui.tab(name).props("no-caps")
        if self._tabs.value is None:
            self._tabs.set_value(name)
        with self._panels, ui.tab_panel(name) as content:
            yield content


def screen_places(name: str = "") -> ScreenPlaces:
    """The places of a screen: steps; status, answer, picture and tabs below each other.

    Parameters
    ----------
    name : str
        By which the style sheet knows a screen with rules of its own.
    """
    with ui.element("div").classes(f"two-columns {name}"):
        inputs = ui.element("section").classes("inputs").props('aria-label="What goes in"')
        with ui.element("section").classes("results").props('aria-label="What comes out"'):
            status = ui.element("div").classes("screen-status")
            answer = ui.element("div").classes("screen-answer")
            picture = ui.element("div").classes("screen-picture")
            with ui.element("div").classes("screen-tabs"):
                tabs = ui.tabs().props("dense align=left inline-label")
                panels = ui.tab_panels(tabs, animated=False).props('tabindex="0" role="region"')
                panels.props["aria-label"] = "Results"
    return ScreenPlaces(inputs, status, answer, picture, tabs, panels)


def problem_said(words: str) -> None:
    """A problem that has no place of its own on the page; it stays until it is closed."""
    ui.notify(words, type="negative", multi_line=True, close_button="Close", timeout=0)


def empty_state(icon: str, words: str) -> Element:
    """What will stand in a place, while nothing does."""
    with ui.element("div").classes("empty-state") as made:
        ui.icon(icon).props('aria-hidden="true"')
        text("p", words)
    return made


@contextmanager
def panel(heading: str = "", *, level: int = 2) -> Iterator[Element]:
    """A part of a screen with a heading."""
    with ui.element("div").classes("panel") as made:
        if heading:
            text(f"h{level}", heading)
        yield made


@contextmanager
def folded(heading: str, *, opened: bool = False) -> Iterator[Element]:
    """A part that opens with a click or with the Enter key."""
    with ui.element("details").classes("folded") as made:
        if opened:
            made.props("open")
        text("summary", heading)
        yield made


def folded_until_opened(heading: str, build: Callable[[], None]) -> Element:
    """As `folded`, with content that is made when it is opened first: a page is there sooner."""
    with ui.element("details").classes("folded") as made:
        text("summary", heading)
    done: list[bool] = []

    def fill() -> None:
        if not done:
            done.append(True)
            with made:
                build()

    made.on("toggle", fill)
    return made


def text(tag: str, content: str, classes: str = "") -> TextElement:
    """An HTML element with text; nothing in the text is read as HTML."""
    made = TextElement(tag=tag, text=content)
    if classes:
        made.classes(classes)
    return made


_COLUMN = re.compile(r"(?:\S {2,}|^ {8,})(?=\S)")


def printed(content: str) -> Element:
    """Text as a command prints it: a line goes on below its second column, if it is not far.

    On a phone the second column stands below the first, as the comments of a file below its lines.
    """
    made = ui.element("pre").classes("file-text").props('tabindex="0"')
    with made:
        for line in content.splitlines():
            second = _COLUMN.search(line)
            if second is None:
                _hanging(text("span", line), min(len(line) - len(line.lstrip()), 16))
                continue
            with ui.element("span").classes("columns") as both:
                text("span", line[: second.end()], "" if line[: second.end()].strip() else "gap")
                text("span", line[second.end() :], "second")
            _hanging(both, second.end() if second.end() <= 24 else 0)
    return made


def _hanging(line: Element, column: int) -> None:
    line.style(f"padding-left: {column}ch; text-indent: -{column}ch")


def note(content: str) -> Element:
    """A remark in a quiet colour."""
    return text("p", content, "note")


def warning(content: str) -> Element:
    """What limits the trust in a result."""
    return text("p", content, "warning-note")


_ON_ITS_WAY = 3.0
"""Time for which replaced controls still hear the click that a slow browser sent to them. [s]"""
_LATE = 0.5
_of_place: weakref.WeakKeyDictionary[Element, list[Listener]] = weakref.WeakKeyDictionary()
"""By rebuilt place, what ends the handlers of its content: the place itself stays."""
_replaced: weakref.WeakSet[Element] = weakref.WeakSet()
"""What is not on the page any more, and follows no changes."""


def rebuild(place: Element, build: Callable[[], object]) -> None:
    """Build the content of a place again, without losing a click or typing that is on its way.

    What stood there leaves the page at once, and is deleted a moment later: until the browser has
    drawn what is new, a person clicks and types in what was there before. `workbench.js` does the
    rest, for a control that is replaced between the press and the release of the mouse.
    """
    for end in _of_place.pop(place, ()):
        end()
    _of_place[place] = []
    before = list(place.default_slot.children)
    inner = [each for child in before for each in child.descendants(include_self=True)]
    _replaced.update(inner)
    place.default_slot.children.clear()
    place.update()
    with place:
        build()
    client, loop = place.client, asyncio.get_running_loop()

    def delete_at(due: float) -> None:
        loop.call_at(due, delete, due)

    def delete(due: float) -> None:
        if loop.time() > due + _LATE:  # the server was busy: the clicks that wait are heard first
            delete_at(loop.time() + _ON_ITS_WAY)
        elif not client.is_deleted:
            client.remove_elements(
                [each for child in before for each in child.descendants(include_self=True)]
            )

    if before:
        delete_at(loop.time() + _ON_ITS_WAY)


def _is_gone(slot: Slot) -> bool:
    """Whether the place was deleted or replaced: NiceGUI raises once nothing else holds it."""
    try:
        return bool(slot.parent.is_deleted) or slot.parent in _replaced
    except RuntimeError:
        return True


_ends: weakref.WeakKeyDictionary[Client, set[Listener]] = weakref.WeakKeyDictionary()
"""By tab, what ends its handlers. NiceGUI forgets none of its own until the tab closes: with each
new result of a screen that is open all day, the old one would stay in memory."""


def here(subscribe: Iterable[Callable[[Listener], Listener]], handler: Listener) -> None:
    """Call a handler in this place of this tab on changes, until the tab closes.

    Parameters
    ----------
    subscribe : iterable of callable
        Each takes a listener and returns the function that ends it, as `ScreenState.listen` does.
    handler : callable
    """
    slot = ui.context.slot
    client = ui.context.client

    def called() -> None:
        if end not in _ends.get(client, ()):  # ended by another handler of the same change
            return
        if client.is_deleted or _is_gone(slot):
            end()
            return
        with slot:
            handler()

    listening = [add(called) for add in subscribe]

    def end() -> None:
        for one in listening:
            one()
        _ends.get(client, set()).discard(end)

    if client not in _ends:
        _ends[client] = set()
        client.on_delete(lambda: [one() for one in tuple(_ends.pop(client, ()))])
    _ends[client].add(end)
    if slot.parent in _of_place:
        _of_place[slot.parent].append(end)


def live(
    subscribe: Iterable[Callable[[Listener], Listener]],
    build: Callable[[], None],
    key: Callable[[], object] = lambda: object(),
) -> Element:
    """A place whose content is built again when something changes.

    Parameters
    ----------
    subscribe : iterable of callable
        For example ``[state.listen]``.
    build : callable
        Makes the content.
    key : callable
        What the content depends on; built again only when it has changed.

    Returns
    -------
    Element
        The place; it stays.
    """
    place = ui.element("div").classes("live")
    last: list[object] = []

    def refresh() -> None:
        now = key()
        if last and last[0] == now:
            return
        last[:] = [now]
        rebuild(place, build)

    refresh()
    here(subscribe, refresh)
    return place
