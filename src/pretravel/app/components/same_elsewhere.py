"""The command and the Python lines that do the same as a screen."""

from __future__ import annotations

from nicegui import ui

from pretravel.app.components.layout import folded, text


def same_elsewhere(command: str, python: str) -> None:
    """Show the command and the Python lines, each with a button that copies it.

    Parameters
    ----------
    command : str
        A line for a shell; quote names with `shlex.join`.
    python : str
    """
    with folded("The same on the command line and in Python"):
        for heading, content in (("Command line", command), ("Python", python)):
            text("h3", heading)
            with ui.element("div").classes("code-block"):
                text("pre", content).props('tabindex="0"')
                button = ui.button("Copy", icon="content_copy").props("no-caps flat")
                button.props["aria-label"] = f"Copy: {heading}"
                button.props["data-copy"] = content
                button.classes("copy-button")
