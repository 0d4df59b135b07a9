"""The budget of Ren's rig, against his Table 2."""

from __future__ import annotations

import pytest

from pretravel.laboratory.rig_budget import REN_BUDGET, length_budget, rig_sources


def test_a_calibration_replaces_both_repeatabilities() -> None:
    """Without length: 0.034, 0.030, 0.030 and 0.020 µm; with both 0.055 and 0.060 more."""
    alone = length_budget(rig_sources(REN_BUDGET), 0.0).combined
    squares = 0.034**2 + 2.0 * 0.030**2 + 0.020**2
    assert alone == pytest.approx(1e-3 * squares**0.5, rel=1e-9)
    whole = length_budget(REN_BUDGET, 0.0).combined
    assert whole == pytest.approx(1e-3 * (squares + 0.055**2 + 0.060**2) ** 0.5, rel=1e-9)
