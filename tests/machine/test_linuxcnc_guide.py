"""On the real LinuxCNC: the guide exactly as written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pretravel.controls.logs.pretravel_log import read_own_log
from tests.machine.conftest import SIMULATOR, environment
from tests.support.commands import rows
from tests.support.pictures import coloured_share

# The last digit of a log is 1e-4 µm; three of them make a point.
SAME = 5e-7


def test_every_command_of_the_guide_in_order(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(SIMULATOR / "follow_guide"), str(tmp_path)],
        capture_output=True, text=True, check=False, env=environment(), timeout=900,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    log = read_own_log(tmp_path / "part_log.ngc")
    assert log.missed == ()
    assert len(log.touches) == len(rows(tmp_path / "plan.csv"))
    points = {row["label"]: row for row in rows(tmp_path / "points.csv")}
    assert set(points) == set(log.compensated)
    for label, on_the_control in log.compensated.items():
        here = [float(points[label][name]) for name in ("x_mm", "y_mm", "z_mm")]
        assert here == pytest.approx(on_the_control, abs=SAME)
    # The simulated part is nominal and the simulated latch exact. The remaining error is the
    # map's error between 51 directions, for which it states up to 0.08 µm.
    # Along its axis the probe has 1.3 µm; the qualification assumes 1. The 0.3 µm enter with
    # the component of the normal along the axis.
    upward = np.array([float(row["nz"]) for row in points.values()])
    deviation = np.array([float(row["deviation_um"]) for row in points.values()])
    assert np.max(np.abs(deviation + 0.3 * upward)) < 0.1
    for picture in ("map.png", "compare.png", "plan.png", "points.png", "verify.png"):
        assert coloured_share(tmp_path / picture) > 0.001
