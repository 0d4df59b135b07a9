"""What screens are made of, driven in a browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.browser.workbench_server import (
    RunningWorkbench,
    opened,
    running_workbench,
    serious_problems,
)

PROGRAM = str(Path(__file__).with_name("components_screen.py"))


@pytest.fixture(scope="module")
def workbench(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningWorkbench]:
    with running_workbench(tmp_path_factory.mktemp("data"), program=(PROGRAM,)) as started:
        yield started


def drop(page: Any, name: str, content: bytes) -> None:
    page.set_input_files(
        ".file-drop-input", {"name": name, "mimeType": "text/plain", "buffer": content}
    )


def test_a_file_becomes_a_result_in_every_tab(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}components")
    other = page.context.new_page()
    opened(other, f"{workbench.address}components")
    drop(page, "a.txt", b"1\n2\n3\n")
    for tab in (page, other):
        tab.wait_for_selector("text=3 lines, times 2 are 6")
    page.get_by_label("Factor [mm]").fill("4")
    for tab in (page, other):
        tab.wait_for_selector("text=3 lines, times 4 are 12")
    assert other.get_by_label("Factor [mm]").input_value() == "4"
    other.reload()
    other.wait_for_selector("text=3 lines, times 4 are 12")
    assert serious_problems(page) == []


def test_a_fault_is_said_as_the_library_says_it(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}components")
    drop(page, "a.txt", b"1\nbad\n")
    page.wait_for_selector("text=a.txt, line 2: 'bad' is no number")
    assert "/tmp" not in page.inner_text("main")
    drop(page, "a.txt", b"flaw\n")
    page.wait_for_selector("text=this is a flaw of pretravel")
    assert "Traceback" not in page.inner_text("main")


def test_long_work_shows_its_stage_and_is_cancelled(page: Any, workbench: RunningWorkbench) -> None:
    opened(page, f"{workbench.address}components")
    page.get_by_role("button", name="Wait").click()
    page.wait_for_selector("text=stage 5")
    page.get_by_role("button", name="Cancel").click()
    page.wait_for_selector("text=cancelled after")
