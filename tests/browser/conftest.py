"""A server for a worker, a browser for the files here; they skip where chromium is missing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from pretravel.workbench.project import Project
from tests.browser.workbench_server import (
    CHROMIUM,
    WITHOUT_SCENES,
    RunningWorkbench,
    open_project,
    running_browser,
    running_workbench,
)

PATIENCE = 120_000
"""How long a state of a page is waited for: a loaded computer needs more than 30 s. [ms]"""


@pytest.fixture(scope="package")
def browser() -> Iterator[Any]:
    """Ended with the last file here: Playwright's event loop would be in the way of other tests.

    It draws no scene in space; test_pages has a test with a browser that does.
    """
    if not CHROMIUM.exists():
        pytest.skip(
            "chromium is missing (tools/install_browser installs it): the page is NOT tested"
        )
    with running_browser(WITHOUT_SCENES) as started:
        yield started


@pytest.fixture(scope="session")
def _server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningWorkbench]:
    """One for a worker: it takes seconds to start."""
    with running_workbench(tmp_path_factory.mktemp("data")) as started:
        yield started


@pytest.fixture
def workbench(_server: RunningWorkbench) -> RunningWorkbench:
    """With an empty project: a page need not show the results of an earlier test first."""
    open_project(_server.address, Project("Of a test"))
    return _server


@pytest.fixture(scope="module")
def _context(browser: Any) -> Iterator[Any]:
    """One for the tests of a file: it keeps the scripts of the page.

    With less motion: pages change at once, and no time goes into pictures between.
    """
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    context.set_default_timeout(PATIENCE)
    yield context
    context.close()


@pytest.fixture
def page(_context: Any) -> Iterator[Any]:
    """A tab; an error of a script of the page fails the test."""
    opened_page = _context.new_page()
    errors: list[str] = []
    opened_page.on("pageerror", lambda error: errors.append(str(error)))
    yield opened_page
    for tab in _context.pages:
        tab.close()
    assert errors == []
