"""What all pages share: header, navigation, and the place of a screen."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager

from nicegui import ui
from nicegui.element import Element

from pretravel.app.access import host_name, is_loopback
from pretravel.app.components.layout import here, panel, text, warning
from pretravel.app.project import ScreenState
from pretravel.app.screens import SCREENS, Screen
from pretravel.app.session import SESSION, address_in
from pretravel.app.terminal_text import flaw_message
from pretravel.base import installed_version
from pretravel.show import glossary

_KEPT = "What you typed is kept in this browser"
_NOT_CONNECTED = {
    "text": "Not connected: what you type is kept, and sent when the connection is back",
    "ended": "Not connected: the workbench is not running. Start it again (pretravel app), and "
    f"open the address that it prints. {_KEPT}",
    "again": "The workbench was started again, and does not know this tab: open the address that "
    f"it printed. {_KEPT}",
    "closed": "The workbench was started again with another project: open the address that it "
    f"printed, and this project in its list. {_KEPT}",
}
"""What the header says without a connection, by what the script finds out."""
THEMES = {"auto": "Theme: system", "light": "Theme: light", "dark": "Theme: dark"}
STATIC = f"/static/{installed_version()}"
"""Address of our own style sheet and script."""


@contextmanager
def page_frame(title: str, current: str = "") -> Iterator[None]:
    """The frame of a page; its content comes into ``main``.

    Parameters
    ----------
    title : str
        Of the page; its heading of level 1.
    current : str
        Name of the screen, for the navigation.
    """
    request = ui.context.client.request
    theme = request.cookies.get("pretravel_theme", "auto")
    ui.dark_mode({"dark": True, "light": False}.get(theme))
    ui.colors(primary="#0b5394", negative="#a4161a", positive="#1b6e3c", warning="#8a5a00")
    ui.page_title(f"{title} – pretravel")
    ui.add_head_html(f'<link rel="stylesheet" href="{STATIC}/workbench.css">')
    ui.add_head_html(f'<script src="{STATIC}/fit.js"></script>')
    ui.add_body_html(f'<script src="{STATIC}/workbench.js" defer></script>')
    client = ui.context.client
    main = client.content.parent_slot.parent if client.content.parent_slot else client.content
    main.props["tabindex"] = -1
    with client.layout:  # next to main, not in it
        skip = text("a", "Skip to the content", "skip")
        skip.props["href"] = f"#{main.html_id}"
        with ui.element("header").classes("top") as header:
            home = text("a", "pretravel", "brand")
            home.props["href"] = address_in("/")
            _project_name()
            _header_actions(theme)
        navigation = _navigation(current)
    for place, element in enumerate((skip, header, navigation)):
        element.move(target_index=place)
    text("h1", title)
    yield


def _project_name() -> None:
    project = SESSION.project
    field = ui.input(value=project.name).props('dense borderless debounce="400"')
    field.props["aria-label"] = "Name of the project"
    field.classes("project-name")

    def commit() -> None:
        project.name = str(field.value or "")

    def refresh() -> None:
        if field.value != project.name:
            field.set_value(project.name)

    field.on_value_change(commit)
    here([project.listen], refresh)
    lost = text("span", "", "saved problem lost").props('role="status"')
    lost.props["data-project"] = project.identity
    for state, said in _NOT_CONNECTED.items():
        lost.props[f"data-{state}"] = said
    saved = text("span", "", "saved").props('role="status"')

    session = SESSION.current

    def show_saved() -> None:
        problem = session.problem
        said = f"Not saved: {problem}" if problem else session.notice
        saved.text = said or "Saved"
        saved.classes(add="problem" if said else "", remove="" if said else "problem")

    show_saved()
    here([session.listen], show_saved)


def _header_actions(theme: str) -> None:
    with ui.element("div").classes("actions"):
        with ui.element("label").classes("theme"):
            text("span", "Theme", "visually-hidden")
            with ui.element("select").props('id="theme"'):
                for value, shown in THEMES.items():
                    option = text("option", shown)
                    option.props["value"] = value
                    if value == theme:
                        option.props["selected"] = True
        for label, address in (("Project", "/project"), ("Help", "/help")):
            link = text("a", label, "action")
            link.props["href"] = address_in(address)


def _navigation(current: str) -> Element:
    made = ui.element("nav").classes("side").props('aria-label="Screens"')
    with made, ui.element("ul"):
        _entry("/", "home", ("Home", "Home"), current == "")
        for screen in SCREENS:
            address = f"/{screen.name}"
            _entry(address, screen.icon, (screen.title, screen.short), screen.name == current)
        _entry("/tasks", "apps", ("Every task", "All"), current.startswith("task"))
    return made


def _entry(address: str, icon: str, names: tuple[str, str], chosen: bool) -> None:
    """A line of the menu: the job, or a word for it where there is little room."""
    title, short = names
    with ui.element("li"), ui.element("a") as link:
        link.props["href"], link.props["title"] = address_in(address), title
        if chosen:
            link.props["aria-current"] = "page"
        ui.icon(icon).props('aria-hidden="true"')
        link.props["aria-label"] = title
        text("span", title, "nav-title")
        text("span", short, "nav-short")


def home_page() -> None:
    """What the project holds and what comes next, and the jobs to choose from."""
    from pretravel.app.home import project_contents

    with page_frame("What do you want to do?"):
        project_contents()
        _jobs()


def _jobs() -> None:
    with ui.element("ul").classes("jobs"):
        for screen in SCREENS:
            with ui.element("li"), ui.element("a") as link:
                link.props["href"] = address_in(f"/{screen.name}")
                ui.icon(screen.icon).props('aria-hidden="true"')
                text("h2", screen.title)
                text("p", screen.summary)


def screen_page(screen: Screen) -> None:
    """A screen in its frame; settings that it cannot show can be taken away."""
    state = SESSION.project.screen(screen.name)
    with page_frame(screen.title, screen.name):
        text("p", screen.summary, "summary")
        slot = ui.context.slot
        before = len(slot.children)
        try:
            screen.show(state)
        except Exception:  # of a project that a stranger sent, settings can be anything
            flaw_message()
            for made in slot.children[before:]:
                made.delete()
            _without_settings(state)


def all_tasks_page() -> None:
    """Every task of the command line."""
    from pretravel.app.every_task import tasks_page

    with page_frame("Every task", "tasks"):
        tasks_page()


def task_page(name: str) -> None:
    """The screen of a task; the list of all where there is none of this name."""
    from pretravel.app.every_task import screen_of_task

    screen = screen_of_task(name)
    if screen is None:
        all_tasks_page()
    else:
        screen_page(screen)


def _without_settings(state: ScreenState) -> None:
    """What is said where a screen cannot be shown, with a way out."""

    def clear() -> None:
        state.settings.clear()
        ui.navigate.reload()

    with panel():
        warning(
            "This screen cannot be shown with the settings of this project: they are damaged, or "
            "this is an internal error of pretravel, which the terminal shows. The files stay."
        )
        ui.button(
            "Begin this screen with empty settings", icon="restart_alt", on_click=clear
        ).props("no-caps unelevated")


def help_page() -> None:
    """How the workbench is used."""
    with page_frame("Help", "help"), ui.element("div").classes("prose"):
        here_alone = is_loopback(host_name(ui.context.client.request.headers.get("host", "")))
        place = "this computer" if here_alone else f"the computer {socket.gethostname()}"
        for heading, paragraph in HELP.items():
            text("h2", heading)
            text("p", paragraph.format(place=place))
        text("h2", "Words").props('id="words"')
        with ui.element("dl").classes("words"):
            for entry in glossary():
                text("dt", entry.term).props["id"] = entry.anchor
                meaning = entry.meaning.replace("*", "")
                text("dd", f"{meaning} [{entry.unit}]" if entry.unit else meaning)


HELP = {
    "A screen": "Choose a job on the left. Drop your files, or choose them with the keyboard (Tab, "
    "then Enter), and fill in the fields. Results follow at once; long work shows its progress and "
    "can be cancelled.",
    "The project": (
        "Everything that you drop or type is one project. It is saved automatically: a "
        "reload or a new start shows it again. The address of a tab names its project: "
        "another tab or browser can show another project, and tabs with one address "
        "share theirs. A new project takes the name of its first file, and the one "
        "before stays, under “Other projects”."
    ),
    "Without a connection": "The header says so. What you type is kept in the browser, and sent "
    "when the connection is back.",
    "Privacy": "Your files stay on {place}, on which the workbench runs. The page loads nothing "
    "from elsewhere, and what you drop is read as data and never executed.",
    "The same elsewhere": "Each screen shows the command and the Python lines that give the same "
    "result.",
}
