"""Six-seat statics: the reactions of a kinematic tripod follow from equilibrium alone."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from pretravel.base import STANDARD_GRAVITY, DescriptionError, FloatArray, checked_unit, frozen
from pretravel.prediction.description import Probe
from pretravel.six_seats import (
    PIEZO_STAGE,
    SEAT_NAMES,
    SEAT_SIDES,
    SeatFrame,
    rod_on_ball_coefficient,
    seat_triads,
    tip_wrenches,
    watched_loads,
)


@dataclass(frozen=True, eq=False)
class SeatStatics:
    """The places of the seats, and the reactions that hold the tripod.

    Seat forces act on the tripod along `normals` through the rod axes. Six
    frictionless seats and six equilibrium equations leave nothing to elasticity.

    Attributes
    ----------
    points : (6, 3) float
        Points of the rod axes through which the seat forces act, probe frame. [mm]
    normals : (6, 3) float
        Unit directions of the seats' push on the tripod.
    wrenches : (6, 6) float
        Columns: force and moment about the origin of a unit reaction of each seat.
    rest_reactions : (6,) float
        Reactions under spring (and weight) without a touch. [N]
    tip : (3,) float
        Tip centre at rest. [mm]
    """

    points: FloatArray
    normals: FloatArray
    wrenches: FloatArray
    rest_reactions: FloatArray
    tip: FloatArray

    @property
    def tip_wrenches(self) -> FloatArray:
        """Columns: force and moment about the origin of a unit force on the tip, (6, 3)."""
        return tip_wrenches(self.tip)

    def unit_reactions(self, directions: npt.ArrayLike) -> FloatArray:
        """Change of the six reactions per newton of force on the tip.

        Parameters
        ----------
        directions : (n, 3) float
            Unit directions of the force on the tip (outward surface normals).

        Returns
        -------
        (n, 6) float
        """
        d = np.asarray(directions, dtype=np.float64)
        applied = np.concatenate([d, np.cross(self.tip, d)], axis=1)
        return np.asarray(-np.linalg.solve(self.wrenches, applied.T).T)

    def reactions(self, directions: npt.ArrayLike, forces: npt.ArrayLike) -> FloatArray:
        """Reactions with forces on the tip: rest + F * unit.

        Parameters
        ----------
        directions : (n, 3) float
        forces : (n,) float
            [N]

        Returns
        -------
        (n, 6) float
            [N]
        """
        f = np.asarray(forces, dtype=np.float64)
        return np.asarray(self.rest_reactions + f[:, None] * self.unit_reactions(directions))

    def tip_displacement(self, indentations: npt.ArrayLike) -> FloatArray:
        """Displacement of the tip if the rigid tripod indents its seats.

        Parameters
        ----------
        indentations : (n, 6) float
            How much deeper each seat is pressed in than at rest. [mm]

        Returns
        -------
        (n, 3) float
            [mm]

        Notes
        -----
        A rigid motion q moves the seat points by wrenches^T q along the seat
        normals (virtual work); that must be minus the indentations.
        """
        q = -np.linalg.solve(self.wrenches.T, np.asarray(indentations, dtype=np.float64).T).T
        return np.asarray(q[:, :3] + np.cross(q[:, 3:], self.tip))


def seat_statics(probe: Probe, gravity: npt.ArrayLike | None = None) -> SeatStatics:
    """The seats of a probe and their reactions at rest.

    Parameters
    ----------
    probe : Probe
    gravity : (3,) float, optional
        Unit direction of gravity, probe frame. When not given, weight is
        neglected, or contained in the preload.

    Raises
    ------
    DescriptionError
        The seats do not hold the tripod: a reaction at rest that is not positive,
        or at the trigger's threshold already.

    References
    ----------
    Shen & Zhang 1997, as used by Rodrigues 2021, section 2.9.1.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> seat_statics(load_probe("omp40-2")).rest_reactions.round(4).tolist()
    [2.1501, 2.1501, 2.1501, 2.1501, 2.1501, 2.1501]
    """
    frame = seat_frame(probe)
    wrenches = frame.wrenches
    x, y = probe.spring_offset
    load = probe.preload * np.array([0.0, 0.0, -1.0, -y, x, 0.0])
    if gravity is not None:
        if probe.moving.mass == 0.0:
            raise DescriptionError(
                "a direction of gravity was given, but the description has no moving mass; "
                "add [moving] with mass_g and height_mm"
            )
        down = checked_unit(np.atleast_2d(np.asarray(gravity, dtype=np.float64)), "gravity")[0]
        weight = probe.moving.mass * STANDARD_GRAVITY * down
        arm = np.array([0.0, 0.0, probe.moving.height])
        load = load + np.concatenate([weight, np.cross(arm, weight)])
    rest = np.asarray(np.linalg.solve(wrenches, -load), dtype=np.float64)
    worst = int(np.argmin(rest))
    # No seat may pull, and the loads that the criterion watches must be above its threshold.
    opens = probe.criterion != PIEZO_STAGE and (
        watched_loads(rest[None], probe.criterion).min() <= probe.threshold + 1e-12
    )
    if rest[worst] <= 1e-12 or opens:
        raise DescriptionError(
            f"at rest seat {SEAT_NAMES[worst]} carries {rest[worst]:.3f} N; with the trigger "
            f"threshold of {probe.threshold:g} N ({probe.criterion}) the probe would never be "
            "seated. "
            "Raise the preload, lower the threshold"
            + (" or the moving mass" if gravity is not None else " or spread the rods evenly")
        )
    return SeatStatics(
        points=frame.points,
        normals=frame.normals,
        wrenches=frozen(wrenches),
        rest_reactions=frozen(rest),
        tip=frozen([0.0, 0.0, -probe.lever]),
    )


def seat_doubts(probe: Probe) -> tuple[str, ...]:
    """Whether balls of the described seats overlap, as a sentence; else nothing.

    A seat touches the rod at one place of its ball: ground balls, or arcs, can be so near.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> seat_doubts(load_probe("omp40-2"))
    ()
    """
    frame = seat_frame(probe)
    radius = probe.seats.ball_radius
    centres = frame.points - (probe.tripod.rod_radius + radius) * frame.normals
    pairs = list(combinations(range(6), 2))
    # Rounded: of equal distances the first is named.
    apart = [round(float(np.linalg.norm(centres[a] - centres[b])), 9) for a, b in pairs]
    nearest = int(np.argmin(apart))
    if apart[nearest] >= 2.0 * radius:
        return ()
    first, second = (SEAT_NAMES[index] for index in pairs[nearest])
    return (
        (
            f"the seat balls {first} and {second}, of radius {radius:g} mm, overlap: their centres "
            f"are {apart[nearest]:.3g} mm apart. Whole balls need a smaller radius or support "
            "angle, or thicker rods"
        ),
    )


def lifted_tip_motion(probe: Probe) -> FloatArray:
    """Displacement of the tip per opening of the contact of a rod that lifts, (3, 3).

    A row for each rod: the tripod turns as a rigid body about the line through the two others.

    References
    ----------
    Woźniak, equation 2: the part of the transducer.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> lifted_tip_motion(load_probe("omp40-2")).shape
    (3, 3)
    """
    rods, first, line = _lines_of_the_others(probe)
    up = np.cross(line, rods - first)[:, 2:]
    return np.asarray(np.cross(line, np.array([0.0, 0.0, -probe.lever]) - first) / up)


def lifted_heights(probe: Probe) -> FloatArray:
    """Distance of each rod from the line through the two others, (3,). [mm]

    >>> from pretravel.prediction.catalogue import load_probe
    >>> lifted_heights(load_probe("omp40-2")).round(3).tolist()  # 1.5 times the radius
    [24.51, 24.51, 24.51]
    """
    rods, first, line = _lines_of_the_others(probe)
    up = np.cross(line, rods - first)[:, 2]
    return np.asarray(np.abs(up) / np.linalg.norm(line, axis=1))


def _lines_of_the_others(probe: Probe) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Each rod, and the line through the two others: its start and its way, (3, 3) each."""
    radii = probe.tripod.radius + np.array(probe.tripod.radius_deviations)
    azimuths = np.array(probe.tripod.rod_azimuths)
    rods = radii[:, None] * np.stack([np.cos(azimuths), np.sin(azimuths), 0.0 * azimuths], axis=1)
    first, second = np.roll(rods, -1, axis=0), np.roll(rods, -2, axis=0)
    return rods, first, second - first


def statics_in_machine(probe: Probe, gravity: npt.ArrayLike | None = None) -> SeatStatics:
    """As `seat_statics`, with gravity's direction in the machine's frame."""
    if gravity is None:
        return seat_statics(probe)
    return seat_statics(probe, np.asarray(gravity, dtype=np.float64) @ probe.orientation.matrix)


def seat_coefficient(probe: Probe) -> float:
    """The c in delta = c N^(2/3) for the approach of a rod and its ball. [mm/N^(2/3)]

    >>> from pretravel.prediction.catalogue import load_probe
    >>> bool(1e-4 < seat_coefficient(load_probe("omp40-2")) < 2e-4)
    True
    """
    return rod_on_ball_coefficient(
        probe.tripod.rod_radius,
        probe.seats.ball_radius,
        probe.tripod.material.contact_modulus(probe.seats.material),
    )


def seat_frame(probe: Probe) -> SeatFrame:
    """The seats of a probe.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> frame = seat_frame(load_probe("omp40-2"))
    >>> frame.points[0].tolist(), frame.normals[0].round(3).tolist()
    ([16.34, 0.0, 0.0], [0.0, -0.889, 0.458])
    """
    tripod, seats = probe.tripod, probe.seats
    radii = tripod.radius + np.array(tripod.radius_deviations)
    angles = seats.support_angle + 0.5 * seats.right_less_left * SEAT_SIDES
    return seat_triads(tripod.rod_azimuths, radii, angles)
