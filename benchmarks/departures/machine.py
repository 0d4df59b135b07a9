"""A machine: what it latches for a run of touches, with the departures acting."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .departure import Departure
from .patterns import reachable
from .tripod import FLAT, TIP_RADIUS, SimulatedProbe

DIAMETER = 25.0
RING_DIAMETER = 50.0
REFERENCE_AT = np.array([212.3447, -87.9123, -301.4561])
PART_AT = np.array([148.2312, 12.4478, -322.8719])
PART_SIZE = 20.0
"""Largest distance of a part's points from its datum. [mm]"""
# A usual workshop, as docs/qualification.md describes it: what u contains where nothing is stated.
U_DIAMETER, U_WARMER, FORM = 0.2e-3, 0.2, 0.13e-3  # mm, K, mm
EXPANSION = 11.5e-6
HYSTERESES = {0.0: 0.63, 0.4e-3: 0.25, 1.0e-3: 0.10, 3.0e-3: 0.02}
"""Standard deviations of a hysteresis, with their shares. [mm]"""


@dataclass(frozen=True, eq=False)
class Run:
    """Contacts in the order in which they are touched, machine frame without its errors.

    `centers` are those of the tip at first contact, `origin` the datum that machine errors are
    counted from: the scale and squareness of the way between two parts is not the probe's.
    """

    centers: np.ndarray
    normals: np.ndarray
    approaches: np.ndarray
    curvature: float
    feeds: np.ndarray
    origin: np.ndarray
    on_reference: bool


@dataclass(frozen=True, eq=False)
class Reference:
    """A run on the reference, and the truth about it."""

    run: Run
    nominal_normals: np.ndarray
    center: np.ndarray


def with_usual_errors(departure: Departure, generator: np.random.Generator) -> Departure:
    """Errors of reference and machine of a usual workshop."""
    size = RING_DIAMETER if departure.ring else DIAMETER
    diameter, warmer, memory = generator.standard_normal(3)
    usual = generator.choice(list(HYSTERESES), p=list(HYSTERESES.values()))
    return replace(
        departure,
        diameter_error=U_DIAMETER * diameter + EXPANSION * size * U_WARMER * warmer,
        form=FORM,
        hysteresis=usual * memory,
    )


def reference_run(
    departure: Departure, probe: SimulatedProbe, generator: np.random.Generator
) -> Reference:
    """Touches on the reference, along lines through a centre that is known to 10 µm."""
    directions = reachable(probe.stem, departure.directions)
    rows, feeds = _sequence(departure, directions, generator)
    outward = directions[rows]
    center = REFERENCE_AT + generator.uniform(-0.5, 0.5, 3)
    assumed = center + generator.normal(0.0, 0.010, 3)
    size = (RING_DIAMETER if departure.ring else DIAMETER) + departure.diameter_error
    distance = 0.5 * size + (-TIP_RADIUS if departure.ring else TIP_RADIUS)
    # The line assumed + s outward meets the sphere of tip centres (on a ring, the circle).
    offset = assumed - center
    if departure.ring:
        offset = offset * [1.0, 1.0, 0.0]
    along = outward @ offset
    reach = -along + np.sqrt(along**2 + distance**2 - offset @ offset)
    radial = (offset + reach[:, None] * outward) / distance
    if departure.form > 0.0:
        turn = np.arctan2(outward[:, 1], outward[:, 0]) - generator.uniform(0.0, np.pi)
        across = np.sum(outward[:, :2] ** 2, axis=1)
        reach = reach + 0.5 * departure.form * across * np.cos(2.0 * turn)
    side = -1.0 if departure.ring else 1.0
    during = np.linspace(-0.5, 0.5, len(rows))
    if departure.drift_slows:
        warmed = -np.exp(-3.0 * (during + 0.5)) / (1.0 - np.exp(-3.0))
        during = warmed - np.mean(warmed)
    toward = generator.normal(size=3)
    drifted = departure.drift * during[:, None] * toward / np.linalg.norm(toward)
    tip_at = assumed + reach[:, None] * outward + drifted
    curvature = -2.0 / RING_DIAMETER if departure.ring else 2.0 / DIAMETER
    run = Run(tip_at, side * radial, -side * outward, curvature, feeds, center, on_reference=True)
    return Reference(run, side * outward, center)


def _sequence(
    departure: Departure, directions: np.ndarray, generator: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Which direction each touch is in, and its feed, in the order of the touches."""
    count = len(directions)
    repeat, rows = np.divmod(np.arange(count * departure.repeats), count)
    if departure.order == "shuffled passes":
        rows = np.concatenate([generator.permutation(count) for _ in range(departure.repeats)])
    elif departure.order == "in a row":
        rows, repeat = np.divmod(np.arange(count * departure.repeats), departure.repeats)
    elif departure.order == "rings":
        ring = np.unique(np.round(-directions[:, 2], 6), return_inverse=True)[1]
        rows = rows[np.lexsort((repeat, ring[rows]))]
    second = departure.feed if departure.second_feed is None else departure.second_feed
    return rows, np.where(repeat % 2 == 1, second, departure.feed)


def part_run(
    departure: Departure, normals: np.ndarray, generator: np.random.Generator
) -> tuple[Run, np.ndarray]:
    """A run on flat faces of a part, one touch each, and their true points."""
    count = len(normals)
    out = generator.uniform(0.3, 0.9, count)[:, None]
    sideways = 0.3 * generator.uniform(-1.0, 1.0, (count, 3))
    surface = PART_AT + PART_SIZE * (out * normals + sideways) / 1.2
    tip_at = surface + TIP_RADIUS * normals
    feeds = np.full(count, departure.part_feed)
    run = Run(tip_at, normals, -normals, FLAT, feeds, PART_AT, on_reference=False)
    return run, surface


def latched(
    run: Run, probe: SimulatedProbe, departure: Departure, generator: np.random.Generator
) -> np.ndarray:
    """Positions that the machine reports, (n, 3). [mm]"""
    normals, approaches = run.normals, run.approaches
    closing = -np.sum(normals * approaches, axis=1)
    travel = probe.pretravel(normals, run.curvature)
    if run.on_reference and departure.stem_compliance > 0.0:
        across = normals[:, 0] ** 2 + normals[:, 1] ** 2
        travel = travel + departure.stem_compliance * probe.force(normals) * across
    travel = travel + np.sum(_memory(departure, probe, normals) * normals, axis=1)
    arrived = np.append(True, np.any(np.diff(run.approaches, axis=0) != 0.0, axis=1))
    apart = departure.first_apart[0] * arrived if run.on_reference else departure.first_apart[1]
    travel = travel + apart
    travel = travel / closing + departure.delay * run.feeds / 60.0
    travel = travel + _noise(departure, probe, normals, generator)
    at = run.centers + travel[:, None] * approaches
    at = at + 0.5 * departure.backlash * np.sign(np.round(approaches, 6))
    at = at + (at - run.origin) @ machine_errors(departure).T
    return at if departure.quantum == 0.0 else np.round(at / departure.quantum) * departure.quantum


def with_gross_errors(
    positions: np.ndarray, run: Run, sizes: tuple[float, ...], generator: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Positions with single touches latched early by `sizes`, and the rows of these."""
    rows = generator.choice(len(positions), len(sizes), replace=False)
    changed = positions.copy()
    changed[rows] -= np.reshape(sizes, (-1, 1)) * run.approaches[rows]
    return changed, rows


def machine_errors(departure: Departure) -> np.ndarray:
    """Squareness of each pair of axes, and one scale for all, (3, 3)."""
    s = departure.squareness
    return np.array([[0.0, s, s], [0.0, 0.0, s], [0.0, 0.0, 0.0]]) + departure.scale * np.eye(3)


def _memory(departure: Departure, probe: SimulatedProbe, normals: np.ndarray) -> np.ndarray:
    """Shift of the tip's rest position by the touch before, across the axis, (n, 3)."""
    across = normals - (normals @ probe.axis)[:, None] * probe.axis
    before = np.vstack([np.zeros((1, 3)), across[:-1]])
    return np.asarray(departure.hysteresis * before)


def _noise(
    departure: Departure,
    probe: SimulatedProbe,
    normals: np.ndarray,
    generator: np.random.Generator,
) -> np.ndarray:
    """Scatter of each touch along its approach, (n,)."""
    count = len(normals)
    drawn = (
        generator.standard_t(3.0, count) / np.sqrt(3.0)
        if departure.heavy_tails
        else generator.standard_normal(count)
    )
    azimuth = np.arctan2(normals[:, 1], normals[:, 0])
    toward = np.max(np.cos(azimuth[:, None] - probe.rods), axis=1)
    at_rod = np.hypot(normals[:, 0], normals[:, 1]) * np.clip(2.0 * toward - 1.0, 0.0, 1.0)
    return np.asarray(departure.noise * drawn * (1.0 + (departure.noise_at_rods - 1.0) * at_rod))
