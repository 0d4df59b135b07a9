"""A workbench in a process of its own, with a temporary data folder, and a browser to drive it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from pretravel.app.access import Access
from pretravel.app.project import Project
from pretravel.app.project_file import project_bytes
from tests.browser.screens import settled

CHROMIUM = Path("/usr/bin/chromium")
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking",
    "--disable-component-update", "--no-first-run", "--disable-extensions", "--disable-sync",
)  # fmt: skip
WITHOUT_SCENES = "--disable-3d-apis"
"""Scenes in space stay empty: without a graphics card their drawing takes most of a test's time."""
SIZES = {"phone": (390, 844), "tablet": (820, 1180), "desktop": (1440, 900)}
THEMES = ("light", "dark")
PATIENCE = 120.0
"""How long an answer or a state of a page is waited for: 30 s are short on a busy computer. [s]"""


_tokens: dict[str, str] = {}
"""By host and port."""


@dataclass
class RunningWorkbench:
    """A server that listens.

    Attributes
    ----------
    address : str
        With a slash at the end, without the token; see `cookie`.
    process : Popen
    data : Path
        The user's data folder.
    """

    address: str
    process: subprocess.Popen[str]
    data: Path

    def interrupt(self) -> int:
        """Ctrl-C; the exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=PATIENCE)


@contextmanager
def running_workbench(
    data: Path, *arguments: str, program: tuple[str, ...] = ("-m", "pretravel", "app")
) -> Iterator[RunningWorkbench]:
    """Start ``pretravel app``, or another program that has its options, and end it."""
    environment = {
        **os.environ,
        "XDG_DATA_HOME": str(data),
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        "PYTHONUNBUFFERED": "1",
    }
    environment.pop("PYTEST_CURRENT_TEST", None)  # NiceGUI behaves otherwise under pytest
    port = () if "--port" in arguments else ("--port", "0")
    command = [sys.executable, *program, "--no-browser", *port, *arguments]
    process = subprocess.Popen(
        command,
        cwd=data,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        yield RunningWorkbench(_address(process), process, data)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            process.kill()
        assert process.stdout is not None
        process.stdout.close()


def open_project(address: str, project: Project) -> None:
    """Open a project in a running workbench, as a person does who drops its file."""
    request = urllib.request.Request(
        f"{address}project/open?name=p.pretravel",
        project_bytes(project),
        {"X-Pretravel": "upload", **cookie(address)},
    )
    with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
        assert json.load(answer)["error"] == ""


def _address(process: subprocess.Popen[str]) -> str:
    """The address that the command prints."""
    assert process.stdout is not None
    said = ""
    for line in process.stdout:
        said += line
        found = re.search(r"(http://(\S+?)/)\?token=(\S+)", line)
        if found:
            _tokens[found[2]] = found[3]
            return found[1]
    raise AssertionError(f"the workbench did not start: {said}")


def cookie(address: str) -> dict[str, str]:
    """The header by which a running workbench knows its user."""
    parts = urlsplit(address)
    known = Access("", _tokens[parts.netloc]).cookie
    return {"Cookie": f"pretravel_{parts.port}={known}"}


@contextmanager
def running_browser(*more_flags: str) -> Iterator[Any]:
    """Debian's chromium without a window."""
    from playwright.sync_api import sync_playwright

    flags = [*FLAGS, *more_flags]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=flags)
        yield browser
        browser.close()


def new_context(browser: Any, **settings: Any) -> Any:
    """A context of a browser whose pages are waited for with `PATIENCE`."""
    context = browser.new_context(**settings)
    context.set_default_timeout(1000.0 * PATIENCE)
    return context


_SCROLLED = ".results, .screen-tabs, .q-tab-panels"
"""What scrolls by itself."""


def serious_problems(page: Any) -> list[str]:
    """What axe finds on a page that is serious or critical, with the elements."""
    from axe_playwright_python.sync_playwright import Axe

    settled(page)  # old results are pale on purpose, for the moment
    # In a place that scrolls by itself axe takes the colour behind the place for that of a button.
    styled = "(all, css) => all.forEach(one => { one.style.cssText = css; })"
    unrolled = "position: static; height: auto; max-height: none; flex: none; overflow: visible"
    page.eval_on_selector_all(_SCROLLED, styled, unrolled)
    found = Axe().run(page).response["violations"]
    page.eval_on_selector_all(_SCROLLED, styled, "")
    return [
        f"{v['id']} ({v['impact']}): {node['html'][:200]} – {node.get('failureSummary', '')[:300]}"
        for v in found
        if v["impact"] in ("serious", "critical")
        for node in v["nodes"]
    ]


def opened(page: Any, address: str) -> None:
    """Open an address and wait until the page is connected to the server."""
    page.goto(f"{address}?token={_tokens[urlsplit(address).netloc]}")
    page.wait_for_selector("main h1")
    page.wait_for_function("window.socket && window.socket.connected")


def screenshots(browser: Any, address: str, folder: Path, name: str, prepare: Any = None) -> None:
    """Take pictures of a page, light and dark, on phone, tablet and desktop.

    `prepare` is called with the page before its pictures, light and dark.
    """
    for theme in THEMES:
        context = new_context(browser, color_scheme=theme)
        page = context.new_page()
        opened(page, address)
        if prepare is not None:
            prepare(page)
        for size, (width, height) in SIZES.items():
            page.set_viewport_size({"width": width, "height": height})
            page.wait_for_timeout(3000)  # pictures follow, and those in space are drawn again
            page.screenshot(path=folder / f"{name}-{size}-{theme}.png", full_page=True)
        context.close()
