"""The physical kind: a six-seat probe fitted to touches, tested on other directions.

Fitted: seven numbers of the ideal probe, eleven of its asymmetry (with priors), the centre.
Left out: the part's directions; in the ring, every other direction; in Shen and Springer's
benchmark, everything away from the equator.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.files.csv_table import read_csv_table
from pretravel.files.touches_csv import read_touches
from pretravel.measurement.compensation import apply
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.response import probe_response
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.six_seats.response import ProbeResponse
from pretravel.touches import Touches
from tests.support.examples import EXAMPLES
from tests.support.made_up_probes import NOISE, PATTERN, made_up_response, touches_of

PART = read_touches(EXAMPLES / "part_touches.csv").normals


def _judged(
    response: ProbeResponse, result: Qualification, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Errors over the part with the noise of its touches, without a translation; and u."""
    value, u = result.pretravel_map.pretravel_and_uncertainty(PART, extrapolate=True)
    error = value - response.pretravel(PART) + rng.normal(0.0, NOISE, len(PART))
    error -= PART @ np.linalg.lstsq(PART, error)[0]
    return error, np.hypot(u, result.pretravel_map.repeatability)


@pytest.fixture(scope="module")
def studied() -> list[tuple[np.ndarray, np.ndarray]]:
    found = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        response = made_up_response(rng, (0.0, 0.3, 1.0)[seed % 3])
        touches = touches_of(response, PATTERN, rng)
        result = qualify(touches, 25.0, tip_diameter=6.0, kind="physical", search_outliers=False)
        found.append(_judged(response, result, rng))
    return found


def test_errors_over_a_part(studied: list[tuple[np.ndarray, np.ndarray]]) -> None:
    """The limit is 0.345 um, of which 0.30 are the noise of the touches. The sample deviation of
    140 touches scatters by 6 %: a tenth of the sets may be above, three of twelve in 11 %."""
    spread = np.array([error.std() for error, _ in studied]) * 1e3
    assert np.median(spread) < 0.32
    assert np.sum(spread > 0.345) <= 2


def test_uncertainties_over_a_part_are_honest(studied: list[tuple[np.ndarray, np.ndarray]]) -> None:
    """Mean (error/u)²: of one data set it scatters by 20 % (repeatability from 67 degrees of
    freedom, 140 touches), of twelve by 6 %."""
    ratios = np.array([np.mean((error / u) ** 2) for error, u in studied])
    assert 0.82 < ratios.mean() < 1.18
    assert np.sum((ratios < 0.6) | (ratios > 1.6)) <= 1


def test_noise_free_touches_give_the_probe_back() -> None:
    """Only the priors cause a difference; with 10 nm of noise their influence is small."""
    rng = np.random.default_rng(1)
    response = made_up_response(rng, 0.0)
    touches = touches_of(response, PATTERN, rng, noise=1e-5)
    result = qualify(touches, 25.0, tip_diameter=6.0, kind="physical", search_outliers=False)
    value = result.pretravel_map.pretravel(PART, extrapolate=True)
    error = value - response.pretravel(PART)
    error -= PART @ np.linalg.lstsq(PART, error)[0]
    assert np.abs(error).max() < 0.05e-3


def test_shen_and_springer_1998() -> None:
    """Their benchmark: from 24 touches on the equator with 0.35 um of noise, 1561 directions over
    the half-sphere are predicted with a standard deviation of 0.6 um, over a range of 16 um.
    Their model has one parameter, and touches on the equator do not determine the height along
    the axis. Lever, support angle and tip are therefore as described here; preload and rotation
    are fitted. Predicted points are compared without a translation."""
    from pretravel.design.identification.probe_from_map import identify

    probe = load_probe("omp40-2-100mm-carbide")
    true = replace(
        probe,
        preload=1.15 * probe.preload,
        orientation=replace(probe.orientation, rotation=np.radians(21.0)),
    )
    equator = from_angles(np.full(24, np.pi / 2), np.radians(np.arange(0, 360, 15)))
    polar = np.radians(np.arange(0, 91, 90 / 39))
    grid = np.concatenate(
        [[[0.0, 0.0, 1.0]], *(from_angles(np.full(40, p), np.radians(np.arange(0, 360, 9)))
                              for p in polar[1:])]
    )  # fmt: skip
    assert len(grid) == 1561
    c, s = np.cos(np.radians(21.0)), np.sin(np.radians(21.0))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    response = probe_response(true)
    expected = response.pretravel(grid @ turn)
    assert np.ptp(expected) >= 16e-3
    spread = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        measured = response.pretravel(equator @ turn) + rng.normal(0.0, 0.35e-3, 24)
        touches = Touches(-equator * (12.5 - 3.0 + measured)[:, None], equator)
        ring = qualify(touches, 25.0, ring=True, tip_diameter=6.0)
        found = identify(ring.pretravel_map, probe, ["preload", "rotation"])
        value = probe_response(found.probe).pretravel(
            grid @ _turn(found.probe.orientation.rotation)
        )
        spread.append(float(np.std(value - expected)))
    assert max(spread) < 0.6e-3
    assert np.median(spread) < 0.3e-3


def _turn(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


KP3 = read_csv_table(EXAMPLES / "kp3_ring.csv").numbers("azimuth_deg", "pretravel_um")


def kp3_prediction(kind: str, half: int) -> float:
    """Rms error of the omitted directions, with the fitted centring, um."""
    azimuth, measured = np.radians(KP3[:, 0]), KP3[:, 1] * 1e-3
    outward = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    ring, tip = 25.0, 3.0
    touches = Touches(outward * (ring - tip + measured)[:, None], -outward)
    rows = np.arange(len(touches)) % 2
    result = qualify(
        touches.take(rows == half), 2.0 * ring, tip_diameter=2.0 * tip, ring=True, kind=kind,
        search_outliers=False,
    )  # fmt: skip
    points = apply(touches.take(rows != half), result.pretravel_map, extrapolate=True)
    distance = np.linalg.norm((points.positions - result.center)[:, :2], axis=1) - ring
    return float(np.sqrt(np.mean(distance**2))) * 1e3


def test_kp3_ring_halves() -> None:
    """Each half predicts the other; real readings, digitised from a picture to 0.5 um. In um, mean
    of both: mean 6.8, sectors 5.5, harmonic 4.9, physical 3.8: 4.6 where the noise is taken for the usual 0.3 um in the
    search, or the seats may be flat. The remaining error is the
    unevenness of the probe itself, which a model of few numbers does not contain."""
    rms = {
        kind: np.mean([kp3_prediction(kind, half) for half in (0, 1)])
        for kind in ("mean", "sectors", "harmonic", "physical")
    }
    assert rms["physical"] < rms["harmonic"] < rms["sectors"] < rms["mean"]
    assert rms["physical"] < 4.0
