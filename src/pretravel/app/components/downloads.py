"""Buttons that give result files to the user."""

from __future__ import annotations

import asyncio
import io
import time
import zipfile
from collections.abc import Awaitable, Callable
from pathlib import Path

from nicegui import Client, ui

from pretravel.app.components.layout import problem_said
from pretravel.app.jobs import Made, Work, without_folder
from pretravel.app.terminal_text import flaw_message
from pretravel.base import PretravelError, temporary_folder

_SOON = 0.8
"""Time after which it is said that a file is being made. [s]"""


def download_button(label: str, name: str, write: Callable[[Path], object]) -> ui.button:
    """A button that makes a file and gives it to the browser.

    Parameters
    ----------
    label : str
    name : str
        Of the file, with its ending.
    write : callable
        Writes the file to the path that it is given, as the writers of the library do:
        ``lambda path: write_map(path, result.map)``. It runs in a thread.
    """

    async def given() -> Callable[[Path], object]:
        return write

    return prepared_button(label, name, given)


def result_button(
    work: Work[Made], label: str, name: str, write: Callable[[Path, Made], object]
) -> ui.button:
    """As `download_button`, for the newest result of a work: a click during a run waits for it.

    So a file is never that of earlier inputs. `write` gets the path and the result. The button
    belongs into `outcome.kept`.
    """

    async def newest() -> Callable[[Path], object]:
        result = (await work.finished()).result
        return lambda path: write(path, result)

    return prepared_button(label, name, newest)


def prepared_button(
    label: str, name: str, prepare: Callable[[], Awaitable[Callable[[Path], object]]]
) -> ui.button:
    """As `download_button`, with a writer that is made at the click, on the event loop."""

    async def give() -> None:
        client = ui.context.client  # the button is gone when a new result comes meanwhile
        button.disable()
        button.props(add="loading")
        clock = asyncio.create_task(_say_time(client, name))
        try:
            content = await asyncio.to_thread(written_file, name, await prepare())
        except Exception as error:
            problem = str(error) if isinstance(error, PretravelError) else flaw_message()
            with client:
                problem_said(problem)
        else:
            client.download(content, name)
        finally:
            clock.cancel()
            if not button.is_deleted:
                button.props(remove="loading")
                button.enable()

    button = ui.button(label, icon="download", on_click=give).props("no-caps outline")
    return button


async def _say_time(client: Client, name: str) -> None:
    """Say that a file is being made, and for how long: a page or a PDF takes seconds."""
    await asyncio.sleep(_SOON)
    with client:
        said = ui.notification(f"Making {name} …", spinner=True, timeout=None)
    began = time.monotonic() - _SOON
    try:
        while True:
            await asyncio.sleep(1.0)
            said.message = f"Making {name} … {time.monotonic() - began:.0f} s"
    finally:
        said.dismiss()


def result_folder_button(
    work: Work[Made], label: str, name: str, write: Callable[[Path, Made], object]
) -> ui.button:
    """As `result_button`, for several files: `write` gets a folder; a .zip is downloaded."""

    def write_zip(path: Path, result: Made) -> None:
        folder = path.parent / "files"
        folder.mkdir()
        write(folder, result)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(folder.rglob("*")):
                archive.write(file, file.relative_to(folder))

    return result_button(work, label, name, write_zip)


def written_file(name: str, write: Callable[[Path], object]) -> bytes:
    """What a writer of the library writes."""
    with temporary_folder() as folder:
        try:
            write(folder / name)
        except PretravelError as error:
            raise PretravelError(without_folder(str(error), folder)) from error
        return io.BytesIO((folder / name).read_bytes()).getvalue()
