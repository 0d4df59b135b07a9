"""A server for a worker, a browser for the files here; they skip where chromium is missing."""

from __future__ import annotations

import contextlib
from collections.abc import Generator, Iterator
from typing import Any

import pytest

import pretravel
from pretravel.app.project import Project
from tests.browser.workbench_server import (
    CHROMIUM,
    WITHOUT_SCENES,
    RunningWorkbench,
    new_context,
    open_project,
    running_browser,
    running_workbench,
)


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
def _tab(browser: Any) -> Iterator[tuple[Any, list[str]]]:
    """One for the tests of a file, and the errors of the scripts of all tabs beside it.

    The process of a tab compiles the scripts of the page once; that is half the time of a page.
    """
    context, errors = _watched_context(browser)
    yield context.new_page(), errors
    context.close()


def _watched_context(browser: Any) -> tuple[Any, list[str]]:
    """A context, and the errors of the scripts of its pages.

    With less motion: pages change at once, and no time goes into pictures between.
    """
    size = {"width": 1280, "height": 900}
    context = new_context(browser, viewport=size, reduced_motion="reduce")
    errors: list[str] = []
    context.on("weberror", lambda fault: errors.append(str(fault.error)))
    return context, errors


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """What the page shows where a test of it fails, which its error does not say."""
    report = yield
    if report.failed:
        used = getattr(item, "funcargs", {}).values()
        tab = next((each for each in used if hasattr(each, "inner_text")), None)
        with contextlib.suppress(Exception):
            report.sections.append(("The page", f"{tab.url}\n{tab.inner_text('body')[:5000]}"))
    return report


@pytest.fixture
def page(_tab: tuple[Any, list[str]]) -> Iterator[Any]:
    """The tab, with no page of the workbench; an error of a script of a page fails the test."""
    tab, errors = _tab
    yield tab
    for other in tab.context.pages[1:]:
        other.close()
    if tab.url.startswith("http"):  # another origin would take another process
        tab.goto(f"{tab.evaluate('location.origin')}/static/{pretravel.__version__}/workbench.js")
    found = list(errors)
    errors.clear()
    assert found == []


@pytest.fixture
def fresh_tab(browser: Any) -> Iterator[Any]:
    """A tab that no test has used; an error of a script of its page fails the test."""
    context, errors = _watched_context(browser)
    yield context.new_page()
    context.close()
    assert errors == []
