"""Random plausible probes: six-seat ones, and ones that no six seats make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .tripod import FLAT, SimulatedProbe, Tripod, scaled

MICROMETRE = 1e-3
MakeProbe = Callable[[np.random.Generator], SimulatedProbe]


def orientation(generator: np.random.Generator, tilt: float = np.radians(0.2)) -> np.ndarray:
    """Any turn about the axis, and a small tilt of the axis, (3, 3)."""
    turn = generator.uniform(0.0, 2.0 * np.pi)
    about_z = np.array(
        [[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]]
    )
    x, y = generator.normal(0.0, tilt, 2)
    small = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    q, r = np.linalg.qr(np.eye(3) + small)
    return np.asarray((q * np.sign(np.diag(r))) @ about_z)


def six_seats(
    generator: np.random.Generator,
    *,
    rod_out: float = 0.0,
    axial: float | None = None,
    largest: tuple[float, float] = (8.0, 25.0),
    friction: float = 0.0,
) -> Tripod:
    """A probe as workshops have them; rods up to 2° out, the spring a little beside the axis.

    `rod_out` turns one rod further [rad], `axial` is its pretravel along the axis, `largest` the
    range of the largest across it, both in µm.
    """
    rods = np.radians(np.array([0.0, 120.0, 240.0]) + generator.uniform(-2.0, 2.0, 3))
    rods[generator.integers(3)] += rod_out * generator.choice([-1.0, 1.0])
    seat_radius = generator.uniform(7.0, 11.0)
    angle = np.radians(generator.uniform(26.0, 40.0))
    probe = Tripod(
        rod_azimuths=rods,
        support_angles=angle + np.radians(generator.normal(0.0, 0.4, 6)),
        seat_radius=seat_radius,
        preload=generator.uniform(3.0, 7.0),
        spring=generator.normal(0.0, 0.02 * seat_radius, 2),
        tip=np.array([0.0, 0.0, -generator.uniform(40.0, 80.0)]),
        compliance=np.zeros((3, 3)),
        seat_approach=0.0,
        tip_approach=0.0,
        friction=friction,
        rotation=orientation(generator),
    )
    along = generator.uniform(1.0, 2.0)
    shares = (generator.uniform(0.2, 0.45), generator.uniform(0.15, 0.35))
    return scaled(
        probe,
        generator.uniform(*largest) * MICROMETRE,
        (along if axial is None else axial) * MICROMETRE,
        shares,
    )


def rod_out(generator: np.random.Generator) -> Tripod:
    return six_seats(generator, rod_out=np.radians(10.0))


def stiff_pole_assumed(generator: np.random.Generator) -> Tripod:
    return six_seats(generator, axial=2.5)


def rubbing_tip(generator: np.random.Generator) -> Tripod:
    return six_seats(generator, friction=0.2)


def long_stylus(generator: np.random.Generator) -> Tripod:
    """200 mm: four times the lever, and a stylus that bends far more."""
    probe = six_seats(generator, largest=(40.0, 80.0))
    return replace(probe, tip=np.array([0.0, 0.0, -200.0]))


def uneven(generator: np.random.Generator) -> Tripod:
    """A stylus of 100 mm on seats 2° out, the spring 6 % of the radius beside the axis."""
    probe = six_seats(generator, largest=(30.0, 60.0))
    return replace(
        probe,
        tip=np.array([0.0, 0.0, -115.0]),
        spring=generator.normal(0.0, 0.06 * probe.seat_radius, 2),
        support_angles=probe.support_angles + generator.normal(0.0, np.radians(2.0), 6),
    )


def yielding(generator: np.random.Generator) -> Tripod:
    """A pretravel of 30 to 60 µm, as with a stylus of 100 mm."""
    return six_seats(generator, largest=(30.0, 60.0))


def turned(probe: SimulatedProbe, degrees: float) -> SimulatedProbe:
    """The probe after a turn in its spindle."""
    if degrees == 0.0:
        return probe
    assert isinstance(probe, Tripod)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return replace(probe, rotation=probe.rotation @ about_z)


def with_rod_out(probe: SimulatedProbe, degrees: float) -> SimulatedProbe:
    """The probe after one rod has turned."""
    assert isinstance(probe, Tripod)
    azimuths = probe.rod_azimuths + np.radians([0.0, degrees, 0.0])
    return replace(probe, rod_azimuths=azimuths)


def with_preload(probe: SimulatedProbe, factor: float) -> SimulatedProbe:
    """The probe after its spring has settled."""
    assert isinstance(probe, Tripod)
    return replace(probe, preload=factor * probe.preload)


def aged(probe: SimulatedProbe, generator: np.random.Generator) -> SimulatedProbe:
    """The probe after days: its spring 1 % weaker or stronger, its seat in the spindle 0.3° off.

    Each seat also turns by 0.1°, and the spring moves by 0.2 % of the radius of the seats. All are
    standard deviations.
    """
    if not isinstance(probe, Tripod):
        return probe
    turn = generator.normal(0.0, np.radians(0.3))
    about_z = np.array(
        [[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]]
    )
    return replace(
        probe,
        preload=probe.preload * generator.normal(1.0, 0.01),
        support_angles=probe.support_angles + generator.normal(0.0, np.radians(0.1), 6),
        spring=probe.spring + generator.normal(0.0, 0.002 * probe.seat_radius, 2),
        rotation=probe.rotation @ about_z,
    )


@dataclass(frozen=True, eq=False)
class SmoothLobes:
    """p = a + b sin²θ + c sin³θ cos 3φ [mm]: lobes without edges, which no six seats make."""

    level: float
    across: float
    lobe: float
    rotation: np.ndarray

    @property
    def stem(self) -> np.ndarray:
        return self.axis

    @property
    def axis(self) -> np.ndarray:
        return self.rotation[:, 2]

    @property
    def rods(self) -> np.ndarray:
        turn = np.arctan2(self.rotation[1, 0], self.rotation[0, 0])
        return np.asarray(turn + np.radians([60.0, 180.0, 300.0]))

    def pretravel(self, normals: np.ndarray, curvature: float = FLAT) -> np.ndarray:  # noqa: ARG002
        x, y, _ = (np.asarray(normals) @ self.rotation).T
        # sin³θ cos 3φ = x³ - 3 x y²
        lobes = self.lobe * (x**3 - 3.0 * x * y**2)
        return np.asarray(self.level + self.across * (x**2 + y**2) + lobes)

    def force(self, normals: np.ndarray) -> np.ndarray:
        return np.full(len(normals), 0.1)


def smooth_lobes(generator: np.random.Generator) -> SmoothLobes:
    """Lobes of 8 µm from valley to peak."""
    level = generator.uniform(1.0, 2.0)
    across = generator.uniform(5.0, 10.0)
    return SmoothLobes(
        level * MICROMETRE, across * MICROMETRE, 4.0 * MICROMETRE, orientation(generator)
    )


def strain_gauge(generator: np.random.Generator) -> SmoothLobes:
    """Triggers at nearly the same small force in all directions."""
    level, across = generator.uniform(0.3, 0.8), generator.uniform(0.2, 0.8)
    lobe = generator.uniform(0.0, 0.1)
    return SmoothLobes(
        level * MICROMETRE, across * MICROMETRE, lobe * MICROMETRE, orientation(generator)
    )


def bent_stylus(generator: np.random.Generator) -> Tripod:
    """The tip 0.5 to 1.5 mm beside the axis."""
    probe = six_seats(generator)
    beside = generator.uniform(0.5, 1.5)
    turn = generator.uniform(0.0, 2.0 * np.pi)
    tip = probe.tip + beside * np.array([np.cos(turn), np.sin(turn), 0.0])
    return replace(probe, tip=tip)


def star_stylus(generator: np.random.Generator) -> Tripod:
    """A stylus of 20 mm that leaves a centre piece sideways, 30 mm below the rods."""
    probe = six_seats(generator)
    across, along = probe.compliance[0, 0], probe.compliance[2, 2]
    compliance = np.diag([0.3 * across, 0.5 * across, along + 0.2 * across])
    return replace(probe, tip=np.array([20.0, 0.0, -30.0]), compliance=compliance)
