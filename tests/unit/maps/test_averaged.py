"""Averages of maps: mean and mixture by hand, their form on a control, what a file keeps."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.averaged import averaged_map
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import made_up_map

HALF = DirectionSupport(sphere_pattern_25())
TURN = probe_rotation((0.6, 0.0, 0.8), 0.3)
_map = partial(made_up_map, support=HALF)


def test_mean_and_mixture_by_hand() -> None:
    """Three maps about centres and with tips of their own, in a turned frame: about the first
    centre each is n·s more, and the difference of the radii."""
    centers = [np.array([1.0, 2.0, 3.0]) + 1e-3 * np.array(s) for s in
               ([0.0, 0.0, 0.0], [2.0, -1.0, 0.5], [-1.0, 3.0, 2.0])]  # fmt: skip
    half = 1e-3 * np.array([[1.0, 0.5], [-0.3, 2.0]])
    maps = [
        _map(MeanBasis(), rotation=TURN, covariance=Covariance.independent([4e-6])),
        _map(HarmonicBasis(np.array([[2, 0], [3, 3]])), rotation=TURN, tip_radius=3.02,
             covariance=Covariance.full(half @ half.T)),
        _map(WozniakBasis(0.2), rotation=TURN, tip_radius=2.95),
    ]  # fmt: skip
    weights = [0.5, 0.3, 0.2]
    basis, coefficients, covariance = averaged_map(maps, centers, weights)
    n = fibonacci_cap(30, 1.5)
    own = np.stack(
        [
            each.basis.design(n) @ each.coefficients
            + n @ (TURN.T @ (centers[0] - center)) + 3.0 - each.tip_radius
            for each, center in zip(maps, centers, strict=True)
        ]
    )  # fmt: skip
    mean = np.array(weights) @ own
    assert basis.design(n) @ coefficients == pytest.approx(mean, abs=1e-12)
    assert basis.value(n, coefficients) == pytest.approx(mean, abs=1e-12)
    within = 0.5 * 4e-6 + 0.3 * np.sum((maps[1].basis.design(n) @ half) ** 2, axis=1)
    between = np.array(weights) @ (own - mean) ** 2
    assert covariance.variance_of(basis.design(n)) == pytest.approx(within + between, rel=1e-9)
    constant = basis.constant
    assert basis.design(n) @ constant == pytest.approx(np.ones(30))
    assert basis.size == 4 + 1 + 2 + 3


@pytest.mark.parametrize("which", [0, 1, 2])
def test_frames_must_be_the_same(which: int) -> None:
    maps = [_map(MeanBasis(), rotation=TURN if k == which else np.eye(3)) for k in range(3)]
    with pytest.raises(PretravelError, match="maps of different frames"):
        averaged_map(maps, [np.zeros(3)] * 3, [0.5, 0.25, 0.25])
