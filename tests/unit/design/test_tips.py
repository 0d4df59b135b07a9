"""Tips of predicted and of measured probes: every answer, in closed form or by the prediction."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.design.probing.tip import (
    LateralTip,
    MeasuredTip,
    PredictedTip,
    mapped_tip,
    predicted_tip,
    tip_of,
)
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.described_maps import described_map
from pretravel.prediction.materials import material
from tests.support.example_maps import lobes, mean_map

PROBE = load_probe("omp40-2")
TURN = probe_rotation(from_angles(0.5, 1.0)[0], rotation=0.3)


def test_shear_of_the_contact_in_closed_form() -> None:
    """Johnson, 7.42b: E* Lambda / 4. Of two equal materials (2 - ν) / (2 (1 - ν))."""
    ball, part = PROBE.tip.material, material("aluminium")
    nu = ball.poissons_ratio
    same = predicted_tip(PROBE, workpiece=ball)
    assert same.shear_ratio == pytest.approx((2.0 - nu) / (2.0 * (1.0 - nu)), rel=1e-9)
    stiff = [(1.0 - m.poissons_ratio**2) / m.youngs_modulus for m in (ball, part)]
    soft = [
        (2.0 - m.poissons_ratio) * 2.0 * (1.0 + m.poissons_ratio) / m.youngs_modulus
        for m in (ball, part)
    ]
    expected = sum(soft) / sum(stiff) / 4.0
    assert predicted_tip(PROBE, workpiece="aluminium").shear_ratio == pytest.approx(expected)
    steel = predicted_tip(PROBE, workpiece="steel").shear_ratio
    assert predicted_tip(PROBE).shear_ratio == steel != pytest.approx(expected)


def test_where_the_probe_never_triggers_nothing_is_known() -> None:
    tip = predicted_tip(PROBE).turned(TURN)
    n = np.vstack([TURN[:, 2], -TURN[:, 2]])
    state = tip.state(n)
    assert np.isfinite(state.force[0])
    assert np.isinf(state.force[1])
    assert np.isfinite(state.deflection).all(axis=1).tolist() == [True, False]
    assert np.isnan(state.deflection[1]).all()
    assert np.isfinite(state.compression).tolist() == [True, False]
    assert tip.supports(n).tolist() == [True, True]
    assert abs(tip.excess(n[:1], 0.5 * state.force[:1])[0]) > 1e-3
    assert tip.excess(n[:1], state.force[:1]) == pytest.approx([0.0], abs=1e-12)


def test_a_predicted_map_contains_its_forces() -> None:
    known = mapped_tip(replace(described_map("omp40-2", "analytic"), rotation=TURN))
    assert isinstance(known, PredictedTip)
    assert known.has_forces
    n = from_angles(np.radians([20.0, 60.0]), [0.3, 2.0])
    expected = predicted_tip(PROBE).state(n @ TURN)
    assert known.state(n).force == pytest.approx(expected.force)
    assert known.state(n).deflection == pytest.approx(expected.deflection @ TURN.T)
    assert (known.radius, known.shear_ratio) == (3.0, 0.0)


def test_every_answer_of_a_measured_tip() -> None:
    made = replace(mean_map(0.01), tip_radius=2.5)
    tip = mapped_tip(made)
    assert isinstance(tip, MeasuredTip)
    assert (tip.radius, tip.shear_ratio, tip.has_forces) == (2.5, 0.0, False)
    n = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    state = tip.state(n)
    assert np.isnan(state.force).all()
    assert state.compression.tolist() == [0.0, 0.0]
    assert state.deflection == pytest.approx(made.tip_displacement(n, extrapolate=True))
    assert tip.excess(n, np.ones(2)).tolist() == [0.0, 0.0]
    assert tip.supports(n[:0]).tolist() == []
    for one, supported in (
        (tip, False),
        (tip_of(made), False),
        (mapped_tip(made, extrapolate=True), True),
    ):
        assert one.supports(n).tolist() == [True, supported]


def test_only_a_probe_has_a_tip() -> None:
    ready = MeasuredTip(lobes(3))
    assert tip_of(ready) is ready
    with pytest.raises(PretravelError, match="a probe is needed, not a float"):
        tip_of(3.0)  # type: ignore[arg-type]
    almost = SimpleNamespace(state=1, radius=1, has_forces=1, supports=1)
    with pytest.raises(PretravelError, match="a probe is needed"):
        tip_of(almost)  # type: ignore[arg-type]


def test_the_tip_of_the_thesis_moves_across_its_axis_alone() -> None:
    """The length is the sideways part of the model's, the direction that of the force."""
    tilted = probe_rotation(from_angles(math.radians(10.0), 2.0)[0], rotation=math.radians(25.0))
    tip, n = (
        predicted_tip(PROBE).turned(tilted),
        from_angles(np.radians([20.0, 50.0, 89.0]), np.radians([0.0, 100.0, 200.0])),
    )
    lateral, axis = LateralTip(tip), tilted[:, 2]
    assert lateral.axis == pytest.approx(axis)
    full, found = tip.state(n), lateral.state(n)
    sideways, way = (v - (v @ axis)[:, None] * axis for v in (full.deflection, n))
    length = np.linalg.norm(sideways, axis=1) / np.linalg.norm(way, axis=1)
    assert found.deflection == pytest.approx(length[:, None] * way, abs=1e-15)
    assert np.array_equal(found.force, full.force)
    assert found.compression.tolist() == [0.0, 0.0, 0.0]
    assert lateral.across(lateral.axis[None]).tolist() == [[0.0, 0.0, 0.0]]
    tiny = lateral.axis[None] + 1e-9 * tilted[:, 0]
    assert np.linalg.norm(lateral.across(tiny)) == pytest.approx(1.0)
    assert (lateral.radius, lateral.shear_ratio, lateral.has_forces) == (3.0, 0.0, True)
    assert lateral.supports(n).tolist() == [True] * 3
    assert lateral.excess(n, full.force) == pytest.approx(np.zeros(3), abs=1e-12)
    there = lateral.turned(TURN).state(n @ TURN.T)
    assert there.deflection == pytest.approx(found.deflection @ TURN.T, abs=1e-15)
