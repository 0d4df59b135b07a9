"""Commands are run many times; how closely their tables follow a map has tests of its own."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from pretravel.base.units import DEGREE
from pretravel.controls import lookup


@pytest.fixture(scope="package", autouse=True)
def _forms_are_compared_in_fewer_directions() -> Iterator[None]:
    """A tenth of them; those of users are used in the tests of controls."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lookup, "_AZIMUTH_STEP", 4.1 * DEGREE)
        yield
