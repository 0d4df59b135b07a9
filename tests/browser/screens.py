"""What tests of screens share: dropping files, taking results, running the lines that are shown."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def drop(page: Any, screen: str, purpose: str, *paths: Path) -> None:
    """Give files to a place of a screen."""
    place = f'.file-drop-input[data-url$="/{screen}/{purpose}"]'
    page.set_input_files(place, [str(path) for path in paths])


def downloaded(page: Any, button: str, folder: Path) -> Path:
    """The file that a button gives."""
    with page.expect_download() as waiting:
        page.get_by_role("button", name=button, exact=True).click()
    path = folder / str(waiting.value.suggested_filename)
    waiting.value.save_as(path)
    return path


def settled(page: Any) -> None:
    """Wait until results belong to the inputs that are shown."""
    page.wait_for_function(
        "!document.querySelector('.live.stale') && !document.querySelector('.running')"
    )


def data_lines(path: Path) -> list[str]:
    """Lines without comments, which state the date."""
    return [line for line in path.read_text().splitlines() if not line.startswith("#")]


def run_shown_lines(page: Any, folder: Path, inputs: Iterable[Path]) -> None:
    """Run the command and the Python lines that a screen shows, in a folder with its inputs."""
    for path in inputs:
        (folder / path.name).write_bytes(path.read_bytes())
    command, python = (
        block.get_attribute("data-copy") for block in page.locator(".copy-button").all()[:2]
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    for words in ([sys.executable, "-m", *shlex.split(command)], [sys.executable, "-c", python]):
        done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True)
        assert done.returncode in (0, 3), done.stderr  # 3: an answer to notice
