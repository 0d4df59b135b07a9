"""The frame that all screens share."""

from __future__ import annotations

from typing import Any

import pytest

from pretravel.workbench.screens import SCREENS
from tests.browser.workbench_server import RunningWorkbench, opened, serious_problems

PAGES = ("", "help", *(screen.name for screen in SCREENS))


@pytest.mark.parametrize("name", PAGES)
def test_pages_are_accessible(page: Any, workbench: RunningWorkbench, name: str) -> None:
    opened(page, f"{workbench.address}{name}")
    assert serious_problems(page) == []
