"""Programs of controls are run; how closely their tables follow a map is tested in one test."""

from __future__ import annotations

import pytest

from pretravel.base.units import DEGREE
from pretravel.controls import lookup


@pytest.fixture(autouse=True)
def _forms_are_compared_in_fewer_directions(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth of them, but where the errors of tables are tested."""
    monkeypatch.setattr(lookup, "_AZIMUTH_STEP", 4.1 * DEGREE)
