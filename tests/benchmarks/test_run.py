"""The benchmarks compare what they time; here with few touches and directions."""

from __future__ import annotations

import pytest
from benchmarks import run


@pytest.mark.parametrize("benchmark", ["directions", "touches"])
def test_both_ways_give_the_same(benchmark: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DIRECTIONS", "TOUCHES", "LOOPED"):
        monkeypatch.setattr(run, name, 20)
    getattr(run, benchmark)()
