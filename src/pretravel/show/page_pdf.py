"""A page as a PDF: printed by a browser without a window, or by WeasyPrint."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from pretravel.base import PretravelError, temporary_folder, whole_file

BROWSERS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge",
    "microsoft-edge",
)  # fmt: skip
_FOLDERS = ("ProgramFiles", "ProgramFiles(x86)", "LocalAppData")
"""Variables of Windows that name folders of programs, which are not in PATH."""
_IN_FOLDERS = (
    "Google/Chrome/Application/chrome.exe", "Microsoft/Edge/Application/msedge.exe",
    "Chromium/Application/chrome.exe",
)  # fmt: skip
_ON_MACOS = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
_LONGEST = 300.0
"""Time after which a browser that does not end is stopped. [s]"""


def write_pdf(path: str | Path, page: str) -> None:
    """Print a page to a PDF file, whole or not at all.

    Parameters
    ----------
    path : str or Path
    page : str
        HTML that contains everything that it shows.

    Raises
    ------
    PretravelError
        Neither a browser nor WeasyPrint is there, or the browser failed.
    """
    program = _program((*BROWSERS, "weasyprint")) or _installed_browser()
    if program is None:
        raise PretravelError(
            f"cannot write {path}: a PDF is printed by chromium, chrome, edge or weasyprint, and "
            "none of them was found in the folders of PATH. Install one, or write a page (.html) "
            "and print it from any browser; a certificate has a button for it"
        )
    with temporary_folder() as folder:
        source, printed = folder / "page.html", folder / "page.pdf"
        source.write_text(page, encoding="utf-8")
        if program.stem == "weasyprint":
            _run([str(program), str(source), str(printed)], printed, path)
        else:
            _run(_browser_call(program, source, printed, folder), printed, path)
        with whole_file(path) as temporary:
            shutil.copyfile(printed, temporary)


def _program(names: tuple[str, ...]) -> Path | None:
    """The first program that is found; never one of the current folder."""
    for name in names:
        found = shutil.which(name)
        if found is not None and Path(found).is_absolute() and Path(found).parent != Path.cwd():
            return Path(found)
    return None


def _installed_browser() -> Path | None:
    """A browser where Windows and macOS install it."""
    folders = [Path(os.environ[name]) for name in _FOLDERS if os.environ.get(name)]
    usual = [
        *(folder / place for folder in folders for place in _IN_FOLDERS),
        *map(Path, _ON_MACOS),
    ]
    return next((path for path in usual if path.is_absolute() and path.is_file()), None)


def _browser_call(program: Path, source: Path, printed: Path, folder: Path) -> list[str]:
    """A call without window, network, or the user's profile."""
    root = hasattr(os, "geteuid") and os.geteuid() == 0  # the sandbox of chromium refuses root
    switches = [
        "headless",
        *(["no-sandbox"] if root else []),
        "disable-gpu",
        "disable-dev-shm-usage",
        "disable-extensions",
        "disable-background-networking",
        "disable-component-update",
        "disable-sync",
        "no-first-run",
        "proxy-server=http://127.0.0.1:9",  # the port "discard": nothing answers
        f"user-data-dir={folder / 'profile'}",
        "no-pdf-header-footer",
        f"print-to-pdf={printed}",
    ]
    return [str(program), *(f"--{switch}" for switch in switches), source.as_uri()]


def _run(call: list[str], printed: Path, path: str | Path) -> None:
    try:
        done = subprocess.run(
            call, capture_output=True, timeout=_LONGEST, check=False, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise PretravelError(f"cannot write {path}: {call[0]} failed: {error}") from error
    if done.returncode != 0 or not printed.is_file():
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
        raise PretravelError(
            f"cannot write {path}: {call[0]} ended with code {done.returncode} and made no PDF"
            + (f": {last[0]}" if last else "")
            + ". Write a page (.html) and print it from a browser"
        )
