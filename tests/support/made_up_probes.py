"""Probes with drawn dimensions, and touches of a reference sphere with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pretravel.base.directions import sphere_pattern_25
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.seats import seat_statics
from pretravel.six_seats.response import ProbeResponse, probe_response
from pretravel.touches import Touches

NOISE = 0.3e-3
PATTERN = np.repeat(sphere_pattern_25(), 3, axis=0)


def made_up_response(rng: np.random.Generator, asymmetry: float) -> ProbeResponse:
    """A probe of the catalogue with other preload, seats, stiffness, orientation; its rods
    displaced by 0.6° times the asymmetry, its spring displaced from the axis by 2 % of the tripod's
    radius.
    """
    probe = load_probe(rng.choice(["omp40-2-100mm", "omp40-2", "omp40-2-100mm-carbide"]))
    azimuths = np.radians([0.0, 120.0, 240.0]) + rng.uniform(0.0, 2.0 * np.pi)
    azimuths += asymmetry * rng.normal(0.0, np.radians(0.6), 3)
    probe = replace(
        probe,
        preload=probe.preload * rng.uniform(0.5, 1.5),
        tripod=replace(
            probe.tripod,
            rod_azimuths=tuple(azimuths),
            radius=probe.tripod.radius * rng.uniform(0.7, 1.2),
        ),
        seats=replace(
            probe.seats,
            support_angle=np.radians(rng.uniform(20.0, 50.0)),
            ball_radius=probe.seats.ball_radius * rng.uniform(0.4, 1.0),
        ),
    )
    return _off_axis(probe, asymmetry * rng.normal(0.0, 0.02, 2) * probe.tripod.radius)


def _off_axis(probe: Probe, offset: np.ndarray) -> ProbeResponse:
    response = probe_response(probe)
    moment = np.array([0, 0, 0, -probe.preload * offset[1], probe.preload * offset[0], 0])
    change = np.linalg.solve(seat_statics(probe).wrenches, moment)
    return replace(response, rest_reactions=response.rest_reactions - change)


def touches_of(
    response: ProbeResponse, n: np.ndarray, rng: np.random.Generator, noise: float = NOISE
) -> Touches:
    distance = 15.5 - response.pretravel(n) + rng.normal(0.0, noise, len(n))
    return Touches(np.array([120.0, -40.0, 7.0]) + n * distance[:, None], n)
