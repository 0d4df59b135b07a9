"""For tests and doctests alike: the order of the files, and reduced models that workers share."""

from __future__ import annotations

import gc
import os
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from _pytest.doctest import DoctestModule
from xdist.scheduler import LoadFileScheduling

from tests.support.coarse_models import models_by_name_are_coarse

TESTS = Path(__file__).parent / "tests"

TOGETHER = {
    "tests/validation/test_rodrigues_2021_finite_elements.py": "finite elements of the catalogue",
    "tests/validation/test_gallery.py": "finite elements of the catalogue",
    "tests/laws/test_finite_elements.py": "coarse mesh of a whole probe",
    "tests/laws/test_threefold_symmetry.py": "coarse mesh of a whole probe",
    "tests/laws/test_full_contact.py": "coarse mesh of a whole probe",
    "tests/unit/design/test_reduction_cache.py": "coarse mesh of a whole probe",
}
"""Files whose tests run in the same worker, by what they share."""

LONGEST_FIRST = (
    "tests/machine/",
    "tests/validation/",
    "tests/laws/",
    "tests/browser/",
    "tests/unit/cli/",
)
"""Folders of long tests. Started last, they would leave the other workers without work."""


class FilesTogether(LoadFileScheduling):
    """The tests of a file run in one worker; so do the files of `TOGETHER`."""

    def _split_scope(self, nodeid: str) -> str:
        shared = [what for begin, what in TOGETHER.items() if nodeid.startswith(begin)]
        return shared[0] if shared else super()._split_scope(nodeid)


@pytest.hookimpl(optionalhook=True)  # also without the plug-in
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadFileScheduling:
    """Distribute the tests as `FilesTogether` states."""
    return FilesTogether(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without the garbage collector: nothing that is made here goes before the end.

    Afterwards it runs less often, for a tenth of the time of the tests.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(50_000, 20, 20)
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path) -> Generator[None, list[pytest.Collector], object]:
    """Search for doctests in files of the package that have some: each search takes its time."""
    found = yield
    none = file_path.is_relative_to(TESTS) or b">>>" not in file_path.read_bytes()
    return [each for each in found if not (none and isinstance(each, DoctestModule))]


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


COARSE_IN_CHECK = ("finite_elements.md", "test_every_compliance_model.py")
"""Whose statements hold with a coarse mesh, to the printed digits."""


@pytest.fixture(autouse=True)
def _coarse_models(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The default mesh is taken with the slow tests, a coarse one in make check."""
    quick = "not slow" in request.config.option.markexpr
    if quick and request.node.path.name in COARSE_IN_CHECK:
        models_by_name_are_coarse(monkeypatch)
