"""A server and a browser for the tests of a file; they skip where chromium is missing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.browser.workbench_server import (
    CHROMIUM,
    RunningWorkbench,
    running_browser,
    running_workbench,
)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    if not CHROMIUM.exists():
        pytest.skip(
            "chromium is missing (tools/install_browser installs it): the page is NOT tested"
        )
    with running_browser() as started:
        yield started


@pytest.fixture(scope="module")
def workbench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningWorkbench]:
    with running_workbench(tmp_path_factory.mktemp("data")) as started:
        yield started


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A tab of a browser without history; an error of a script of the page fails the test."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    opened_page = context.new_page()
    errors: list[str] = []
    opened_page.on("pageerror", lambda error: errors.append(str(error)))
    yield opened_page
    context.close()
    assert errors == []
