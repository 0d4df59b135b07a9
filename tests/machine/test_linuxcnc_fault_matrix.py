"""On the real LinuxCNC: the page of faults says what the machine does."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.machine.fault_matrix import CASES, PAGE, FaultCase, outcome_of

OVERTRAVEL = 2.1
"""The end of a touch is 2 mm below the nominal surface; the sphere lies 0.03 mm off. [mm]"""


def without_depth(row: str) -> str:
    return re.sub(r"\d+\.\d\d mm", "", row)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=[] if case.fault in (9, 11) else pytest.mark.slow, id=case.words)
        for case in CASES
    ],
)
def test_every_row_is_what_the_machine_did(case: FaultCase, tmp_path: Path) -> None:
    found = outcome_of(case, tmp_path / "run")
    assert found.as_before
    assert found.depth < OVERTRAVEL
    told = [row for row in PAGE.read_text().splitlines() if row.startswith(f"| {case.words} |")]
    assert [without_depth(row) for row in told] == [without_depth(found.row(case))]
    depth = re.search(r"(\d+\.\d\d) mm \| as ", told[0])
    if depth is not None:
        # The way to stop depends on the cycle of the servo in which the signal comes.
        assert found.depth == pytest.approx(float(depth[1]), abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_every_fault_at_random_touches(seed: int, tmp_path: Path) -> None:
    random = np.random.default_rng(100 + seed)
    for number, case in enumerate(CASES):
        after = 0 if case.fault == 4 else int(random.integers(1, 11))
        # Beyond the clearance of 1 mm; nearer than that, a fault is an error of measurement.
        size = float(random.uniform(1.1, 1.9))
        changed = FaultCase(case.words, case.fault, case.did, size, after, case.clamp)
        found = outcome_of(changed, tmp_path / str(number))
        assert found.as_before, (changed, found)
        assert found.depth < OVERTRAVEL, (changed, found)
        assert found.message != "no message", (changed, found)
