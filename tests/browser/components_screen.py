"""A workbench with one more screen that has every component; run as a program by the tests."""

from __future__ import annotations

import logging
import math
import os
import sys
import threading
import time
import warnings
from pathlib import Path
from typing import Any

from nicegui import ui

from pretravel.app.components.document_view import document_view, table_view
from pretravel.app.components.downloads import download_button, result_button
from pretravel.app.components.fields import (
    choice_field,
    number_field,
    slider_field,
    switch_field,
    text_field,
)
from pretravel.app.components.file_drop import file_drop
from pretravel.app.components.layout import live, panel, screen_places, text
from pretravel.app.components.outcome import follow, kept, outcome
from pretravel.app.components.plot import plot
from pretravel.app.components.same_elsewhere import same_elsewhere
from pretravel.app.jobs import Job, Work
from pretravel.app.project import Inputs, ScreenState
from pretravel.app.screens import Screen
from pretravel.app.shell import screen_page
from pretravel.base.errors import PretravelError
from pretravel.cli.main import app
from pretravel.show.document import Column, Document, KeyFigure, Table
from pretravel.tasks.qualify import Qualify


def count_lines(inputs: Inputs) -> Document:
    """The lines of the files; a line "bad" is an error as the readers raise it."""
    rows = []
    for path in inputs.files["texts"]:
        lines = path.read_text().splitlines()
        if "bad" in lines:
            raise PretravelError(f"{path}, line {lines.index('bad') + 1}: 'bad' is not a number")
        if "flaw" in lines:
            raise RuntimeError("a flaw")
        rows.append((path.name, len(lines)))
    factor = inputs.settings.get("factor", 2.0)
    if factor == 13.0:
        warnings.warn("13 is an unusual factor", stacklevel=1)
    total = sum(count for _, count in rows)
    return Document(
        "Lines",
        verdict=f"{total} lines, times {factor:g} are {total * factor:g}",
        figures=(KeyFigure("lines", float(total), "", u=0.5),),
        tables=(
            Table(
                (
                    Column.of("file", [name for name, _ in rows]),
                    Column.of("lines", [float(count) for _, count in rows]),
                ),
                "Files",
            ),
        ),
        warnings=("this is an example",),
    )


def wait_long(inputs: Inputs) -> str:
    """Work of a minute, with stages."""
    for n in range(600):
        logging.getLogger("pretravel").info("stage %d", n)
        time.sleep(0.1)
    return "done"


def hold(inputs: Inputs) -> str:
    """Work that does not end by itself where the file has this name."""
    file = inputs.file("held")
    while file.name == "waits.txt":
        time.sleep(0.1)
    return f"{len(file.read_text().splitlines())} line of {file.name}"


def quick(inputs: Inputs) -> int:
    """Work in another process that prints, as some libraries do."""
    os.write(1, b"noise of a library\n")
    warnings.warn("from another process", stacklevel=1)
    return len(inputs.files["texts"])


LINES = Job(
    "lines", count_lines, "Counting", settings=("factor",), files=("texts",), needs=("texts",)
)
LONG = Job("long", wait_long, "Waiting", automatic=False, own_process=True)
HELD = Job("held", hold, "Holding", files=("held",), needs=("held",), own_process=True)
QUICK = Job("quick", quick, needs=("texts",), automatic=False, own_process=True)


def show(state: ScreenState) -> None:
    places = screen_places()
    with places.inputs:
        file_drop(state, "texts", "Texts", endings=(".txt",), several=True, limit=100_000)
        file_drop(state, "held", "Held", endings=(".txt",))
        with panel("Settings"):
            number_field(state, "factor", "Factor", unit="mm", default=2.0, limits=(0.0, 100.0))
            slider_field(
                state, "level", "Level", limits=(0.0, 10.0), step=0.5, default=5.0, unit="N"
            )
            text_field(state, "label", "Label")
            choice_field(state, "kind", "Kind", {"a": "First", "b": "Second"}, default="a")
            switch_field(state, "fine", "Fine")
    with places.tab("Results"):
        work = outcome(state, LINES, show_lines, missing="Drop texts on the left.")
        kept(work, lambda: lines_to_keep(work))
        picture = plot({"data": [], "layout": {}}, "Product")
        follow(state, LINES, lambda document: picture.update_figure(product(document)))
        with panel("Long work"):
            outcome(state, LONG, lambda result: None, button="Wait")
        outcome(state, HELD, lambda said: text("p", said))
        outcome(state, QUICK, lambda result: None, button="Count files")
        replaced_button(state)
        count = 1050
        values = [math.nan if n == 0 else float(n - 525) for n in range(count)]
        columns = (Column.of("row", [f"{n}" for n in range(count)]), Column.of("value", values))
        table_view(Table(columns, "Long table"))


def replaced_button(state: ScreenState) -> None:
    """A button that is another one after each change of the factor."""

    def press() -> None:
        state.settings["presses"] = state.settings.get("presses", 0) + 1

    def said() -> str:
        return f"pressed {state.settings.get('presses', 0)} times with {factor()}"

    def factor() -> float:
        return float(state.settings.get("factor", 2.0))

    live([state.listen], lambda: ui.button("Press", on_click=press), factor)
    live([state.listen], lambda: text("p", said()), said)


def refused(path: Path) -> None:
    raise PretravelError(f"{path}: nothing to write")


def show_lines(document: Document) -> None:
    document_view(document)
    same_elsewhere(Qualify(touches="a b.csv", diameter=25.0))


def product(document: Document) -> dict[str, Any]:
    """The last number of the verdict as a bar, in a colour of the page."""
    bar = {"type": "bar", "x": [1.0], "y": [float(document.verdict.split()[-1])]}
    return {"data": [bar | {"marker": {"color": "@ink"}}], "layout": {}}


def lines_to_keep(work: Work) -> None:
    result_button(
        work, "Report", "lines.txt", lambda path, document: path.write_text(document.verdict)
    )
    download_button("Refused", "no.txt", refused)
    download_button("Flawed", "no.txt", lambda path: 1 / 0)
    go_on = threading.Event()
    download_button("Slow", "slow.txt", lambda path: path.write_text(f"{go_on.wait(300.0)}"))
    ui.button("Go on", on_click=go_on.set)


class ComponentsScreen(Screen):
    def show(self, state: ScreenState) -> None:
        show(state)


def main() -> None:
    screen = ComponentsScreen(
        "components", "Tests", "Every component", "What screens have.", "apps"
    )
    ui.page("/components")(lambda: screen_page(screen))
    app(["app", *sys.argv[1:]])


if __name__ == "__main__":
    # Another process finds the functions of tasks by the name of their module.
    from tests.browser import components_screen

    components_screen.main()
