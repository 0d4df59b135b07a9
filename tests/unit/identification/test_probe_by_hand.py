"""Independent errors among directions, the misfit of a model, and equal orientations, by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pretravel.identification.probe_from_map import (
    _directions_per_independent_error,
    _misfit,
    _uncertainty,
    _with_nearest_rotation,
)
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe

DEGREE = math.pi / 180.0


@pytest.mark.parametrize("variance", [1.0, 1e-8, 4.0])
def test_errors_that_groups_of_directions_share(variance: float) -> None:
    """Of twelve directions: each its own, all one, or four groups with one each."""
    groups = np.kron(np.eye(4), np.ones((3, 3)))
    for covariance, expected in ((np.eye(12), 1.0), (np.ones((12, 12)), 12.0), (groups, 3.0)):
        found = _directions_per_independent_error(variance * covariance)
        assert found == pytest.approx(expected, rel=1e-9)
    # Variances 3 and 1 in a common rotation: (3 + 1)² / (9 + 1) = 1.6 errors of two directions.
    assert _directions_per_independent_error(
        variance * np.array([[2.0, 1.0], [1.0, 2.0]])
    ) == pytest.approx(2.0 / 1.6, rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_residuals_beyond_twice_their_u_widen_it(sign: float) -> None:
    """Twelve directions in groups of three with one error each, of u 1 or 2 µm."""
    u = 1e-3 * np.repeat([1.0, 2.0, 1.0, 2.0], 3)
    covariance = np.kron(np.eye(4), np.ones((3, 3))) * np.outer(u, u)
    assert _misfit(1.99 * sign * u, covariance) == (1.0, [])
    factor, (sentence,) = _misfit(2.01 * sign * u, covariance)
    # Eigenvalues 3, 12, 3, 12: 12 (9 + 144 + 9 + 144) / 30² directions for each error.
    assert factor == pytest.approx(2.01 * math.sqrt(12.0 * 306.0 / 900.0), rel=1e-9)
    rms = 2.01 * math.sqrt(2.5)
    assert f"differ by {rms:.2f} µm (rms), 2.0 times as much" in sentence


def test_numbers_that_undo_each_other_are_named() -> None:
    """With b - a the same as a tenth of c, but for 1e-4: the third takes too small a part."""
    jacobian = np.array([[1.0, 1.0, 0.0], [0.0, 0.1, 1.0], [0.0, 1e-4, 0.0]])
    numbers = cast("Any", [SimpleNamespace(relative=True)] * 3)
    u, sentences = _uncertainty(jacobian, numbers, ("a", "b", "c"))
    assert u == pytest.approx(np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian))), rel=1e-6)
    told = [sentence.partition("undone by ")[2].partition(";")[0] for sentence in sentences]
    assert [set(names.split(", ")) for names in told] == [{"b"}, {"a"}, {"a", "b"}]
    assert _uncertainty(np.eye(3) / 0.29, numbers, ("a", "b", "c"))[1] == []
    assert len(_uncertainty(np.eye(3) / 0.31, numbers, ("a", "b", "c"))[1]) == 3


def _turned(probe: Probe, degrees: float) -> Probe:
    return replace(probe, orientation=replace(probe.orientation, rotation=degrees * DEGREE))


@pytest.mark.parametrize(
    ("found", "start", "even", "nearest"),
    [
        (100.0, 0.0, True, -20.0), (100.0, 50.0, True, 100.0), (-100.0, 0.0, True, 20.0),
        (365.0, 130.0, True, 125.0), (59.0, 0.0, True, 59.0), (61.0, 0.0, True, -59.0),
        (100.0, 0.0, False, 100.0), (300.0, 0.0, False, -60.0), (179.0, 0.0, False, 179.0),
        (181.0, 0.0, False, -179.0),
    ],
)  # fmt: skip
def test_the_nearest_of_equal_orientations(
    found: float, start: float, even: bool, nearest: float
) -> None:
    """A tripod with even rods looks the same after each third of a turn, another after a whole."""
    probe = load_probe("omp40-2")
    azimuths = (0.3, 0.3 + 120.0 * DEGREE, 0.3 + (240.0 + 6.0 * (not even)) * DEGREE)
    probe = replace(probe, tripod=replace(probe.tripod, rod_azimuths=azimuths))
    result = _with_nearest_rotation(_turned(probe, found), _turned(probe, start))
    assert result.orientation.rotation / DEGREE == pytest.approx(nearest, abs=1e-9)
    assert replace(result, orientation=probe.orientation) == probe
