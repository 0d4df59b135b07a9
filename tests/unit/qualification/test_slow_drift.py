"""A drift that repeats in a row do not show is named as one, and other probes are not."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.departures.patterns import USUAL_25
from benchmarks.departures.probes import six_seats, smooth_lobes
from benchmarks.departures.tripod import SimulatedProbe
from pretravel import Touches, qualify
from pretravel.base.arrays import FloatArray
from pretravel.qualification.qualification import Qualification

DRIFT = np.array([4e-3, -3e-3, 2e-3])
NOISE = 3e-4
SAID = "the reference drifted by"


def _qualified(probe: SimulatedProbe, drift: FloatArray, *, slows: bool = False) -> Qualification:
    """On a sphere of 25 mm that moves, each direction three times in a row."""
    normals = np.repeat(USUAL_25, 3, axis=0)
    noise = NOISE * np.random.default_rng(5).standard_normal(len(normals))
    travel = probe.pretravel(normals, 2.0 / 25.0) + noise
    time = np.linspace(-0.5, 0.5, len(normals))[:, None]
    if slows:  # with a time constant of a quarter of the run
        time = -np.exp(-4.0 * (time + 0.5)) / (1.0 - np.exp(-4.0))
    at = normals * (15.5 - travel)[:, None] + drift * time
    return qualify(Touches(at, normals), 25.0, tip_diameter=6.0, kind="physical")


@pytest.mark.long
def test_a_drift_from_ring_to_ring_is_found() -> None:
    """Within four u, which are 0.3 µm across the axis and 0.6 µm along it."""
    probe = six_seats(np.random.default_rng(3))
    found = _qualified(probe, DRIFT)
    assert any(SAID in words for words in found.warnings)
    assert not any("six-seat kind" in words for words in found.warnings)
    assert np.all(np.abs(found.effects.drift - DRIFT) < [1.2e-3, 1.2e-3, 2.4e-3])
    still = _qualified(probe, np.zeros(3))
    assert not any(SAID in words for words in still.warnings)
    apart = found.pretravel_map.pretravel(USUAL_25) - still.pretravel_map.pretravel(USUAL_25)
    apart -= USUAL_25 @ np.linalg.lstsq(USUAL_25, apart, rcond=None)[0]
    assert np.abs(apart).max() < 0.7e-3  # 1.45 µm if nothing is subtracted, else 0.22


def test_a_machine_that_warms_up() -> None:
    """A steady drift does not explain it: it was not found here."""
    probe = six_seats(np.random.default_rng(4))
    found = _qualified(probe, 0.7 * DRIFT, slows=True)
    assert any("drift that slows down was subtracted" in words for words in found.warnings)
    assert np.all(np.abs(found.effects.drift - 0.7 * DRIFT) < [1.2e-3, 1.2e-3, 2.4e-3])


@pytest.mark.long
def test_another_kind_of_probe_is_no_drift() -> None:
    found = _qualified(smooth_lobes(np.random.default_rng(3)), np.zeros(3))
    assert any("not quite of the six-seat kind" in words for words in found.warnings)
    assert not any(SAID in words for words in found.warnings)
