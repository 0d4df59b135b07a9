"""For tests and doctests alike: reduced models are kept for this run, and shared by its workers."""

from __future__ import annotations

import os

import pytest


@pytest.fixture(scope="session", autouse=True)
def _kept_models(tmp_path_factory: pytest.TempPathFactory) -> None:
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    os.environ["PRETRAVEL_CACHE"] = str(shared / "reduced-models")
