"""Buttons that give result files to the user."""

from __future__ import annotations

import asyncio
import io
import zipfile
from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from pretravel.errors import PretravelError
from pretravel.whole_file import temporary_folder
from pretravel.workbench.tasks import flaw_message, without_folder


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

    async def give() -> None:
        client = ui.context.client  # the button is gone when a new result comes meanwhile
        button.disable()
        try:
            content = await asyncio.to_thread(written_file, name, write)
        except Exception as error:
            problem = str(error) if isinstance(error, PretravelError) else flaw_message()
            with client:
                ui.notify(problem, type="negative", multi_line=True, close_button="Close")
        else:
            client.download(content, name)
        finally:
            if not button.is_deleted:
                button.enable()

    button = ui.button(label, icon="download", on_click=give).props("no-caps outline")
    return button


def download_folder_button(label: str, name: str, write: Callable[[Path], object]) -> ui.button:
    """As `download_button`, for several files: `write` gets a folder; a .zip is downloaded."""

    def write_zip(path: Path) -> None:
        folder = path.parent / "files"
        folder.mkdir()
        write(folder)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(folder.rglob("*")):
                archive.write(file, file.relative_to(folder))

    return download_button(label, name, write_zip)


def written_file(name: str, write: Callable[[Path], object]) -> bytes:
    """What a writer of the library writes."""
    with temporary_folder() as folder:
        try:
            write(folder / name)
        except PretravelError as error:
            raise PretravelError(without_folder(str(error), folder)) from error
        return io.BytesIO((folder / name).read_bytes()).getvalue()
