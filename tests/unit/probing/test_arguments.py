"""Arguments of simulations reach what they are for, and advice counts targets."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.materials import material
from pretravel.probing.simulation import Latch, PartSetup, _advice, simulate, simulate_some
from pretravel.probing.slide import SlideSettings
from pretravel.probing.surface_touches import TouchStatus
from pretravel.probing.targets import Targets
from pretravel.surface.shapes import Plane, Sphere

BALL = Sphere([0, 0, 0], 20.0)
NORMALS = np.array([[0.6, 0.0, 0.8], [0.0, 0.8, 0.6], [-0.8, 0.0, 0.6]])
TARGETS = Targets(20.0 * NORMALS, NORMALS)


@pytest.mark.parametrize(
    "changes",
    [
        {"model": "shen"},
        {"gravity": (0.0, 1.0, 0.0)},
        {"setup": PartSetup(material=material("aluminium"))},
        {"latch": Latch(feed=300.0, delay=1e-3)},
        {"latch": Latch(noise=1e-4, rng=3)},
    ],
)
def test_every_argument_of_a_simulation_has_an_effect(changes: dict[str, Any]) -> None:
    """The same in both functions, and another one than without the argument."""
    probe = load_probe("omp40-2")
    plain = simulate(probe, BALL, TARGETS).positions
    found = simulate(probe, BALL, TARGETS, **changes).positions
    some = simulate_some(probe, BALL, TARGETS, **changes).touches
    assert some is not None
    assert np.array_equal(found, some.positions)
    # More than 1 nm: effects of a tenth of a micrometre and more.
    assert np.all(np.linalg.norm(found - plain, axis=1) > 1e-6)


def test_advice_counts_normals_that_point_inwards() -> None:
    """Two of three: slightly, beside one that points outwards along the normal of the surface."""
    slight = [0.0, np.sqrt(1.0 - 0.01), -0.1]
    targets = Targets([[0, 0, 0], [5, 0, 0], [9, 0, 0]], [slight, slight, [0, 0, 1]])
    status = np.full(3, TouchStatus.MISSED)
    failed = SimpleNamespace(converged=np.zeros(3, dtype=bool), status=status)
    floor = Plane([0, 0, 0], [0, 0, 1])
    assert "point into the part" in _advice(failed, targets, floor)  # type: ignore[arg-type]


def test_steps_of_a_slide_are_a_number() -> None:
    for steps in ("many", float("nan"), -3):
        with pytest.raises(PretravelError, match="steps"):
            SlideSettings(steps=steps)  # type: ignore[arg-type]
