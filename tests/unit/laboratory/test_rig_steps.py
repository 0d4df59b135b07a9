"""A ruler with a coarse step: traces of a rod that goes 0.02 µm in each sample."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig.budget import calibration_budget, length_budget
from pretravel.laboratory.rig.calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig.events import rig_touch
from pretravel.laboratory.rig.map import rig_map
from pretravel.laboratory.rig.trace import RigTrace

UM = 1e-3
RATE = 0.02 * UM
AZIMUTHS = (0, 60, 120, 180)


def _trace(name: str, pretravel: float, start: float, step: float) -> RigTrace:
    """Contact 20 µm after the start; 60 µm beyond the trigger the rod turns back."""
    out = start + RATE * np.arange(round((80 * UM + pretravel) / RATE))
    rod = np.concatenate(
        [np.full(100, start), out, np.full(61, out[-1]), out[::-1], np.full(100, start)]
    )
    meets = start + 20 * UM
    return RigTrace(
        time=1e-3 * np.arange(len(rod)),
        ruler=step * np.round(rod / step) if step else rod,
        laser=3 * UM + np.maximum(rod - meets, 0.0),
        contact=rod <= meets,
        trigger=rod <= meets + pretravel,
        name=name,
    )


def _calibrated(step: float, start: float) -> tuple[RigCalibration, np.ndarray]:
    true = 5 * UM + 2 * UM * np.cos(np.radians(AZIMUTHS))
    touches = [
        rig_touch(_trace(f"rig_{azimuth:03d}_{repeat}", pretravel, start, step))
        for azimuth, pretravel in zip(AZIMUTHS, true, strict=True)
        for repeat in (1, 2)
    ]
    found = calibrate_rig(touches)
    return found, np.array([d.pretravel for d in found.directions]) - true


@pytest.mark.parametrize("step", [2 * UM, 5 * UM, 10 * UM])
def test_the_step_is_in_u_although_repeats_are_alike(step: float) -> None:
    """Both ends of a pretravel are rounded: u = q / √6, which repeats do not reduce."""
    inside = []
    for start in (0.3 * UM, 1.7 * UM, 4.1 * UM, 6.4 * UM, 8.8 * UM):
        found, errors = _calibrated(step, start)
        budget = length_budget(calibration_budget(found), found.pretravel)
        assert found.u_step == pytest.approx(step / math.sqrt(6.0))
        assert any("step of the ruler" in line.name for line in budget.components)
        inside += [abs(error) <= 2.0 * budget.combined for error in errors]
        u_of_map = np.sqrt(np.diag(rig_map(found, (), 3.0).covariance.matrix))
        assert np.all(u_of_map >= found.u_step)
        assert all(d.u_pretravel >= found.u_step for d in found.directions)
    assert np.mean(inside) >= 0.93


@pytest.mark.parametrize("step", [0.0, 0.5 * UM])
def test_a_step_that_the_line_through_an_edge_averages_is_no_line_of_the_budget(
    step: float,
) -> None:
    found, errors = _calibrated(step, 1.7 * UM)
    assert found.u_step == 0.0
    assert np.max(np.abs(errors)) < 0.1 * UM


def test_a_step_that_hides_the_pretravel_is_refused() -> None:
    with pytest.raises(PretravelError, match="steps of 25 µm"):
        _calibrated(25 * UM, 1.7 * UM)
