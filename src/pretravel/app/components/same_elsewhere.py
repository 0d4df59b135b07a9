"""The command and the Python lines that do the same as a screen."""

from __future__ import annotations

from nicegui import ui

from pretravel.app.components.layout import folded, text
from pretravel.task import Task


def same_elsewhere(*tasks: Task) -> None:
    """Show the commands and the Python lines of tasks, with buttons that copy them.

    Parameters
    ----------
    tasks : Task
        One after the other; their files have the names that the user knows.
    """
    commands = "\n".join(task.command_line() for task in tasks)
    lines = "\n".join(task.python_lines() for task in tasks)
    with folded("The same on the command line and in Python"):
        for heading, content in (("Command line", commands), ("Python", lines)):
            text("h3", heading)
            with ui.element("div").classes("code-block"):
                if content is commands:
                    _in_words(commands)
                else:
                    text("pre", content).props('tabindex="0"')
                button = ui.button("Copy", icon="content_copy").props("no-caps flat")
                button.props["aria-label"] = f"Copy: {heading}"
                button.props["data-copy"] = content
                button.classes("copy-button")


def _in_words(commands: str) -> None:
    """Lines that go on between two words: a browser would also break them within ``--option``."""
    with ui.element("pre").props('tabindex="0"'):
        for line in commands.splitlines():
            *words, last = line.split(" ")
            with ui.element("span").classes("line"):
                for word in (*(f"{word} " for word in words), last):
                    text("span", word, "word")
