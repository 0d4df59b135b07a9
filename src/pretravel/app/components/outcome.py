"""The result of a job in a screen: what is missing, progress with cancel, error, or result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, TypeAlias

from nicegui import ui
from nicegui.element import Element

from pretravel.app.components.layout import folded, here, live, note, rebuild, text, warning
from pretravel.app.components.newer import newer_input
from pretravel.app.jobs import WORKS, Job, Made, Work
from pretravel.app.project import ScreenState

Answer: TypeAlias = Callable[[str, Any], None]
ANSWERS: Mapping[str, tuple[str, Mapping[str, str]]] = {
    "units": (
        "In which unit are the lengths of this file?",
        {"mm": "Millimetres", "inch": "Inches"},
    ),
    "decimal": (
        "What is the comma in the numbers of this file?",
        {"comma": "Comma: decimals", "point": "Point: decimals"},
    ),
}
"""Questions about a file, by the setting that answers them."""


def outcome(
    state: ScreenState,
    job: Job[Made],
    show: Callable[[Made], None],
    *,
    missing: str = "",
    button: str = "Compute",
    answer: Answer | None = None,
) -> Work[Made]:
    """Show the work of a job, and its result when it is there, in one place.

    Parameters
    ----------
    state : ScreenState
    job : Job
    show : callable
        Builds the content for a result. It is called again, in an empty place, for each new one.
    missing : str
        What to do while files are missing.
    button : str
        Text of the button of a job that does not start automatically.
    answer : callable, optional
        Takes the name of a setting and a value, which the user gives as an answer to an error; by
        default it is stored.

    Returns
    -------
    Work
    """
    work = work_status(state, job, missing=missing, button=button, answer=answer)
    result_place(work, show)
    return work


def work_status(
    state: ScreenState,
    job: Job[Made],
    *,
    missing: str = "",
    button: str = "Compute",
    answer: Answer | None = None,
) -> Work[Made]:
    """Show what is missing for a job, its progress with Cancel, and its error; see `outcome`."""
    work = WORKS.of(state, job)
    if not job.automatic:
        # Above the status, whose height changes: a click that ends the typing must not miss it.
        _start_button(work, button)
    status = ui.element("div").classes("work-status").props('role="status" aria-live="polite"')
    said: list[object] = []

    def refresh() -> None:
        now = (
            work.running, work.error, work.cancelled, work.stale, work.held,
            work.ready(), work.lacking,
        )  # fmt: skip
        if not said or said[0] != now:
            said[:] = [now]
            rebuild(status, lambda: _show_status(work, missing))

    refresh()
    here([work.listen], refresh)
    # They stay in the page while it computes, which it does as soon as it is opened.
    live([work.listen], lambda: _newer(work), lambda: tuple(work.newer.items()))
    _answers(work, answer or state.settings.__setitem__)
    return work


def _newer(work: Work[Any]) -> None:
    for name in work.newer:
        newer_input(work.state, name)


def result_place(
    work: Work[Made],
    show: Callable[[Made], None],
    *,
    empty: Callable[[], object] | None = None,
    says_warnings: bool = True,
) -> None:
    """A place for a result, greyed out where it is not that of the page; one of several of a job.

    Parameters
    ----------
    work : Work
    show : callable
        Builds the content for a result, in an empty place.
    empty : callable, optional
        Builds what is shown before the first result.
    says_warnings : bool
        Whether this place shows the warnings of the library.
    """
    place = ui.element("div").classes("live")
    shown: list[Any] = []

    def refresh() -> None:
        _mark(place, work)
        if shown and shown[0] is work.result:
            return
        shown[:] = [work.result]
        rebuild(place, build)

    def build() -> None:
        if work.result is not None:
            for said_by_library in work.warnings if says_warnings else ():
                warning(said_by_library)
            show(work.result)
        elif empty is not None:
            empty()

    refresh()
    here([work.listen], refresh)


def _mark(place: Element, *works: Work[Any]) -> None:
    """Show on a place with results whether they are old: not those of the fields."""
    outdated = any(work.outdated and work.result is not None for work in works)
    place.classes(add="stale" if outdated else "", remove="" if outdated else "stale")
    # The files of an old result are not those of the fields: they cannot be taken.
    wrong = any(work.wrong for work in works)
    place.props("inert" if wrong else "", remove="" if wrong else "inert")


@contextmanager
def belonging_to(*works: Work[Any]) -> Iterator[None]:
    """A place for what shows results of works: greyed out where one is not of the page."""
    place = ui.element("div").classes("live")
    with place:
        yield
    _mark(place, *works)
    here([work.listen for work in works], lambda: _mark(place, *works))


def kept(
    work: Work[Made], build: Callable[[], None], key: Callable[[Made], object] | None = None
) -> None:
    """A place for buttons of a result, there with the first one, that stays while others come.

    What `outcome` shows is recomputed for each result, and a button in it moves while a person
    presses it, as after a typed value: the click itself ends the typing.

    Parameters
    ----------
    work : Work
    build : callable
        Makes the buttons (`downloads.result_button`, `page_button`).
    key : callable
        Takes the result; the buttons are recomputed when what it returns has changed.
    """

    def filled() -> tuple[object, ...]:
        return () if work.result is None else (key(work.result) if key else "",)

    place = live([work.listen], lambda: build() if filled() else None, filled)
    _mark(place, work)
    here([work.listen], lambda: _mark(place, work))


def _start_button(work: Work[Any], label: str) -> None:
    """It stays while the status changes, for the same reason as those in `kept`."""
    button = ui.button(label, on_click=work.start).props("no-caps unelevated")

    def show() -> None:
        button.set_visibility(work.ready() and not work.running)

    show()
    here([work.listen], show)


def follow(state: ScreenState, job: Job[Made], handler: Callable[[Made], None]) -> Work[Made]:
    """Call a handler in this tab with the result, now if there is one, and with each new one.

    For pictures that are changed in place instead of built again (``plot.update_figure``).
    """
    work = WORKS.of(state, job)
    shown: list[Any] = []

    def refresh() -> None:
        if work.result is not None and (not shown or shown[0] is not work.result):
            shown[:] = [work.result]
            handler(work.result)

    refresh()
    here([work.listen], refresh)
    return work


def error_view(message: str) -> None:
    """An error as the library says it; the formats that can be read are folded."""
    from pretravel.files import FORMATS, READABLE_FORMATS

    words, formats, listed = message.partition(READABLE_FORMATS)
    with ui.element("div").classes("error-view").props('role="alert"'):
        text("strong", "This cannot be computed")
        text("p", words.strip())
        if formats:
            with folded("Formats that can be read"), ui.element("ul"):
                for name in listed.strip().split(", "):
                    text("li", f"{name}: {FORMATS[name].what}")


def _answers(work: Work[Any], answer: Answer) -> None:
    """The answers to an error that one click gives; they stay, for the same reason as in `kept`."""
    place = ui.element("div").classes("work-answers")
    asked: list[str] = []

    def ask() -> None:
        for name in asked:
            _question(name, answer)

    def refresh() -> None:
        names = [name for name in work.error_inputs if name in ANSWERS]
        if names and names != asked:
            asked[:] = names
            rebuild(place, ask)
        # Hidden for the eye alone: NiceGUI drops a click on what it holds to be invisible.
        shown = bool(names and work.error) and work.ready() and not work.running
        place.classes(add="" if shown else "hidden", remove="hidden" if shown else "")

    refresh()
    here([work.listen], refresh)


def _question(name: str, answer: Answer) -> None:
    words, values = ANSWERS[name]
    with ui.element("div").classes("question").props('role="group"') as group:
        group.props["aria-label"] = words
        text("p", words)
        for value, shown in values.items():
            button = ui.button(shown, on_click=partial(answer, name, value))
            button.props("no-caps outline")


def _show_status(work: Work[Any], missing: str) -> None:
    if work.running:
        _show_running(work)
        return
    if not work.ready():
        if work.lacking or missing:
            note(work.lacking or missing)
        return
    if work.error:
        error_view(work.error)
        if work.result is not None:
            note("The result below belongs to earlier inputs and cannot be used.")
    if work.held and work.result is not None:
        note(
            f"{', '.join(work.held)}: correct it first. The result below belongs to earlier inputs."
        )
    if work.cancelled:
        note(work.cancelled)
    if work.stale and not work.job.automatic:
        note("The settings have changed since this result.")


def _show_running(work: Work[Any]) -> None:
    """Progress of a run; hidden from readers of the screen except its title."""
    with ui.element("div").classes("running"):
        bar = ui.element("progress")
        bar.props["aria-label"] = work.job.title
        text("span", work.job.title, "running-title")
        stage = text("span", work.progress, "running-stage").props('aria-hidden="true"')
        clock = text("span", "", "running-clock").props('aria-hidden="true"')
        ui.button("Cancel", on_click=work.cancel).props("no-caps outline")

        def tick() -> None:
            stage.text = work.progress
            clock.text = f"{work.elapsed():.0f} s"

        ui.timer(0.5, tick)
        here([work.listen], tick)  # a stage can be short
