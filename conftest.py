"""For tests and doctests alike: the order of the files, and reduced models that workers share."""

from __future__ import annotations

import os
from typing import Any

import pytest
from xdist.scheduler import LoadFileScheduling

MACHINE = "tests/machine/"
LONGEST_FIRST = (MACHINE, "tests/validation/", "tests/laws/")
"""Folders of long tests. Started last, they would leave the other workers without work."""


class FilesAndOneMachine(LoadFileScheduling):
    """The tests of a file run in one worker; those on the one LinuxCNC all in the same one."""

    def _split_scope(self, nodeid: str) -> str:
        return MACHINE if nodeid.startswith(MACHINE) else super()._split_scope(nodeid)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadFileScheduling:
    """Distribute the tests as `FilesAndOneMachine` states."""
    return FilesAndOneMachine(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the long tests."""

    def rank(item: pytest.Item) -> int:
        places = [n for n, folder in enumerate(LONGEST_FIRST) if item.nodeid.startswith(folder)]
        return places[0] if places else len(LONGEST_FIRST)

    items.sort(key=rank)


@pytest.fixture(scope="session", autouse=True)
def _kept_models(tmp_path_factory: pytest.TempPathFactory) -> None:
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    os.environ["PRETRAVEL_CACHE"] = str(shared / "reduced-models")
