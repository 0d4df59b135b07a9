"""Which forces on the interface are in equilibrium: a stand-in has resultants made by chance."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.prediction.fem.condensation import ReducedModel

GENERATOR = np.random.default_rng(4)
RESULTANTS = GENERATOR.standard_normal((6, 22)) * np.repeat([1.0, 12.0], 3)[:, None]
MODES = GENERATOR.standard_normal((5, 3, 22))
LEVER = float(np.abs(RESULTANTS[3:]).max())


def _balanced(size: float) -> np.ndarray:
    """Forces without a resultant, whose amounts have a sum."""
    free = GENERATOR.standard_normal(22)
    free -= np.linalg.pinv(RESULTANTS) @ (RESULTANTS @ free)
    return np.asarray(free * size / np.abs(free).sum())


@pytest.mark.parametrize("size", [0.01, 1.0, 50.0])
@pytest.mark.parametrize("component", range(6))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_millionth_of_the_forces_may_be_left(size: float, component: int, sign: float) -> None:
    """Of their sum of amounts; of a moment, times the largest lever of the interface."""
    model = cast(
        "Any", SimpleNamespace(resultants=RESULTANTS, elastic_field=SimpleNamespace(modes=MODES))
    )
    allowed = 1e-6 * size * (LEVER if component > 2 else 1.0)
    wanted = sign * allowed * np.eye(6)[component]
    left = np.linalg.pinv(RESULTANTS) @ wanted
    balanced = _balanced(size)
    found = ReducedModel.lift(model, balanced + 0.99 * left)
    assert found == pytest.approx(MODES @ (balanced + 0.99 * left), rel=1e-12)
    with pytest.raises(PretravelError, match="in equilibrium"):
        ReducedModel.lift(model, balanced + 1.01 * left)


def test_a_rigid_motion_is_on_top() -> None:
    """Translation plus rotation times place, at each node."""
    points = GENERATOR.standard_normal((5, 3))
    field = SimpleNamespace(modes=MODES, mesh=SimpleNamespace(points=points))
    model = cast("Any", SimpleNamespace(resultants=RESULTANTS, elastic_field=field))
    forces, motion = _balanced(2.0), np.array([0.1, -0.2, 0.3, 0.01, 0.05, -0.02])
    moved = ReducedModel.lift(model, forces, motion) - ReducedModel.lift(model, forces)
    assert moved == pytest.approx(motion[:3] + np.cross(motion[3:], points), abs=1e-12)
