"""Two measured probes against predictions: forces of an OMP40-2, trip and reseat of a KP-3."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.design.friction.seat_friction import FrictionCycle, friction_cycle
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import StylusSegment
from pretravel.prediction.materials import material
from pretravel.prediction.trigger import predict

REFERENCE = Path(__file__).parent / "reference"
FRICTION = 0.25
"""Common to both probes. Ratio of forces and sign of the reseat line ask for 0.2 to 0.3."""


def _experiment(quantity: str) -> FloatArray:
    """Smallest and largest measured value."""
    rows = np.genfromtxt(
        REFERENCE / "rodrigues_experiment.csv", delimiter=",", names=True, dtype=None, encoding=None
    )
    return np.array([row["experiment"] for row in rows if row["quantity"] == quantity])


@cache
def _equator(name: str, friction: float) -> tuple[FloatArray, FloatArray]:
    """Extremes of force and of sensing distance in µm: azimuth 10° to 20°, and 60°."""
    directions = from_angles(np.full(3, 0.5 * np.pi), np.radians([10.0, 20.0, 60.0]))
    trigger = predict(load_probe(name).with_friction(friction), directions)
    force, distance = trigger.force, 1e3 * trigger.sensing_distance
    return np.array([force.min(), force.max()]), np.array([distance.min(), distance.max()])


def test_forces_of_an_omp40() -> None:
    """Table 2.2 (Wozniak, Byszewski and Jankowski 2013): without friction the ratio is 1.64, that
    of the measurement 1.95; friction and one scale (preload times radius over lever) meet both."""
    measured = _experiment("trigger_force")
    statics, _ = _equator("omp40-2", 0.0)
    assert measured[1] / measured[0] == pytest.approx(1.949, abs=1e-3)
    assert statics[1] / statics[0] == pytest.approx(1.643, abs=2e-3)
    lifted = predict(
        replace(load_probe("omp40-2"), criterion="arm_lift"),
        from_angles([0.5 * np.pi] * 2, np.radians([0.0, 60.0])),
        "shen",
    ).force
    assert lifted[1] / lifted[0] == pytest.approx(2.0, rel=1e-9)
    rubbed, _ = _equator("omp40-2", FRICTION)
    scale = np.sqrt(np.prod(measured / rubbed))
    # A fit of one number; 2 %: the resolution of the friction, 0.05, changes the ratio by 3 %.
    assert scale * rubbed == pytest.approx(measured, rel=0.02)
    assert 0.85 < scale < 1.0


def test_distances_of_an_omp40_are_not_met_with_these_parameters() -> None:
    """Table 2.3, 100 mm: friction and scale of the forces make the smallest distance too small.

    Their ratio of 1.82 asks for less friction than the forces do: one friction does not reconcile
    the two measurements.
    """
    measured = _experiment("sensing_distance")
    ratio = measured[1] / measured[0]
    ratios = [
        float(np.divide(*_equator("omp40-2-100mm", friction)[1][::-1]))
        for friction in (0.0, FRICTION)
    ]
    assert ratios[0] < ratio < 0.95 * ratios[1]
    forces, _ = _equator("omp40-2", FRICTION)
    scale = np.sqrt(np.prod(_experiment("trigger_force") / forces))
    predicted = scale * _equator("omp40-2-100mm", FRICTION)[1]
    off = predicted / measured - 1.0
    assert -0.25 < off[0] < -0.10  # the smallest: too small by more than a measurement explains
    assert -0.15 < off[1] < 0.0


def _third_harmonic(values: FloatArray, azimuth: FloatArray) -> complex:
    """Amplitude and phase of three lobes around the axis; the azimuths are evenly spaced."""
    return complex(2.0 * np.mean(values * np.exp(3j * azimuth)))


def _kp3() -> tuple[FloatArray, FloatArray, FloatArray]:
    table = np.genfromtxt(REFERENCE / "kp3_trip_untrip.csv", delimiter=",", skip_header=3)
    return np.radians(table[:, 0]), table[:, 1], table[:, 2]


def test_the_reading_of_the_picture() -> None:
    """The picture prints the differences of trip and reseat: 5, 21 and 47 µm; read to 1 µm each."""
    _, trip, reseat = _kp3()
    difference = trip - reseat
    found = [difference.min(), difference.mean(), difference.max()]
    assert found == pytest.approx([5.0, 21.0, 47.0], abs=2.0)


@cache
def _stand_in(friction: float, stem: str) -> FrictionCycle:
    """A KP-3: its stylus is published, 35 mm with a stem of 2.5 mm; spring and seats are not."""
    probe = load_probe("omp40-2")
    probe = replace(
        probe,
        seats=replace(probe.seats, support_angle=np.radians(45.0)),
        tripod=replace(probe.tripod, radius=12.0),
        hub_offset=15.0,
        stylus=(StylusSegment(35.0, 2.5, material(stem)),),
        tip=replace(probe.tip, radius=2.5),
    )
    # Midpoints of a sector of 60°: with the mirror images they are evenly spaced around the axis.
    around = from_angles(np.full(6, 0.5 * np.pi), np.radians(np.arange(5.0, 60.0, 10.0)))
    return friction_cycle(probe, around, friction, cycles=2, steps=20)


def _lobes(values: FloatArray) -> float:
    """Three lobes of a mirrored sector: positive where the largest is at 60°, as of the trip."""
    return float(2.0 * np.mean(values * -np.cos(3.0 * np.radians(np.arange(5.0, 60.0, 10.0)))))


def test_hysteresis_of_a_kp3() -> None:
    """Sign and phase: the hysteresis has its lobes where the trip has them."""
    azimuth, trip, reseat = _kp3()
    lobes = [_third_harmonic(values, azimuth) for values in (trip, trip - reseat, reseat)]
    phases = np.degrees(np.angle(lobes)) / 3.0
    assert np.abs(lobes) == pytest.approx([5.9, 10.3, 4.4], abs=0.1)
    assert phases[0] == pytest.approx(26.4, abs=0.5)
    assert phases[1] == pytest.approx(phases[0], abs=1.0)  # in phase
    assert abs(phases[2] - phases[0]) == pytest.approx(60.0, abs=1.0)  # opposite
    for friction, stem in ((0.1, "tungsten carbide"), (FRICTION, "steel")):
        cycle = _stand_in(friction, stem)
        assert _lobes(cycle.trigger_deflection[:, 1]) > 0.0
        assert _lobes(cycle.hysteresis[:, 1]) > 0.0
        assert np.all(cycle.hysteresis[:, 1] > 0.0)


def test_sizes_of_a_kp3() -> None:
    """With the spring of an OMP40-2 and a stem of steel, the lobes of the trip (5.9 µm) and the
    mean hysteresis (20.9 µm) come out within a third; spring and seats are not published."""
    azimuth, trip, reseat = _kp3()
    cycle = _stand_in(FRICTION, "steel")
    ours = _lobes(1e3 * cycle.trigger_deflection[:, 1])
    assert ours == pytest.approx(abs(_third_harmonic(trip, azimuth)), rel=0.33)
    mean = float(np.mean(1e3 * cycle.hysteresis[:, 1]))
    assert mean == pytest.approx(float(np.mean(trip - reseat)), rel=0.33)


def test_the_reseat_line_is_opposite_only_with_friction() -> None:
    """The measured lobes of the reseat line are opposite to those of the trip, -0.74 of them
    (u 0.12, from the scatter of the readings). With little friction they are alike; with 0.25 and
    a stem of carbide they are opposite, in this measure."""
    azimuth, trip, reseat = _kp3()
    turned = _third_harmonic(reseat, azimuth) / _third_harmonic(trip, azimuth)
    measured = float(turned.real)
    assert measured == pytest.approx(-0.74, abs=0.01)

    def ratio(friction: float) -> float:
        cycle = _stand_in(friction, "tungsten carbide")
        return _lobes(cycle.reseat_deflection[:, 1]) / _lobes(cycle.trigger_deflection[:, 1])

    assert ratio(0.1) > 0.2
    assert ratio(FRICTION) == pytest.approx(measured, abs=2.0 * 0.12)
