"""Coverage of a rotary axis: 40 sets of four values tell a share of 95 % to 1.7 %."""

from __future__ import annotations

import pytest

from benchmarks.rotary_axis import CASES, Case, covered


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_interval_contains_the_axis(case: Case) -> None:
    assert 0.90 <= covered(case, 40) <= 1.0
