"""Kind physical for probes that no six seats make, touched once in each direction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pretravel.directions import fibonacci_cap, sphere_pattern_25
from pretravel.identification.kind_registry import qualify
from pretravel.qualification.qualification import Qualification
from tests.support.made_up_probes import NOISE, made_up_response, touches_of
from tests.support.reference_touches import sphere_touches

PATTERN = sphere_pattern_25()
BETWEEN = fibonacci_cap(200, np.radians(85.0))
LOBES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "four smooth lobes": lambda across, azimuth: 4.0 * across**4 * np.cos(4.0 * azimuth),
    "five smooth lobes": lambda across, azimuth: 3.0 * across**5 * np.cos(5.0 * azimuth),
    "four edges": lambda across, azimuth: 5.0 * across**2 * np.abs(np.cos(2.0 * azimuth)),
}
SAID = "perhaps not of the six-seat kind"


def _pretravel(lobes: str, n: np.ndarray) -> np.ndarray:
    """1.5 µm along the axis, 9 µm across it, and lobes. [mm]"""
    across = np.hypot(n[:, 0], n[:, 1])
    azimuth = np.arctan2(n[:, 1], n[:, 0]) - 0.2
    return np.asarray(1e-3 * (1.5 + 7.5 * across**2 + LOBES[lobes](across, azimuth)))


def _error_over_u(found: Qualification, truth: np.ndarray) -> float:
    """Of the map between the touches; a shift of the reference is no error of distances."""
    value, u = found.pretravel_map.pretravel_and_uncertainty(BETWEEN)
    error = value - truth
    error -= BETWEEN @ np.linalg.lstsq(BETWEEN, error, rcond=None)[0]
    return float(np.sqrt(np.mean((error / u) ** 2)))


@pytest.mark.parametrize("lobes", LOBES)
def test_u_covers_another_kind_of_probe(lobes: str) -> None:
    """Before, error over u was 2.0 to 3.0, without a warning."""
    rng = np.random.default_rng(16)
    pretravel = _pretravel(lobes, PATTERN) + rng.normal(0.0, NOISE, len(PATTERN))
    found = qualify(sphere_touches(pretravel), 25.0, tip_diameter=6.0, kind="physical")
    assert _error_over_u(found, _pretravel(lobes, BETWEEN)) < 1.5
    # Four lobes look like none in rings of four and eight touches, at some azimuths.
    assert any(SAID in warning for warning in found.warnings) or lobes == "four smooth lobes"


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_six_seat_probe_keeps_its_uncertainty(seed: int) -> None:
    rng = np.random.default_rng([seed, 9])
    response = made_up_response(rng, 1.0)
    found = qualify(touches_of(response, PATTERN, rng), 25.0, tip_diameter=6.0, kind="physical")
    assert not any(SAID in warning for warning in found.warnings)
    assert 0.3 < _error_over_u(found, response.pretravel(BETWEEN)) < 1.8
