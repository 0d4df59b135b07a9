"""A probe under load: forces on its tip, and the reactions of its seats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import Material
from pretravel.prediction.seats import SeatStatics, lifted_heights, seat_coefficient
from pretravel.six_seats import PIEZO_STAGE, ball_on_flat, trigger_force, watched_loads


@dataclass(frozen=True, eq=False)
class Loading:
    """Forces on the tip of a probe in n directions, with the seat reactions that balance them.

    Attributes
    ----------
    probe : Probe
    statics : SeatStatics
    directions : (n, 3) float
        Unit directions of the force on the tip, probe frame.
    force : (n,) float
        [N]
    unit_reactions : (n, 6) float
        Change of the seat reactions per newton on the tip.
    workpiece : Material
        Of the part that the tip touches.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.materials import material
    >>> from pretravel.prediction.seats import seat_statics
    >>> probe = load_probe("omp40-2")
    >>> loading = loaded(probe, seat_statics(probe), np.eye(3), np.zeros(3), material("steel"))
    >>> bool(np.all(loading.seat_indentations == 0.0))
    True
    """

    probe: Probe
    statics: SeatStatics
    directions: FloatArray
    force: FloatArray
    unit_reactions: FloatArray
    workpiece: Material

    @property
    def tip_loads(self) -> FloatArray:
        """Force on the tip per newton along the normal, (n, 3): with the friction of the tip."""
        return rubbed_loads(self.directions, self.probe.tip.friction)

    @property
    def reaction_change(self) -> FloatArray:
        """Seat reactions less those at rest, (n, 6). [N]"""
        return np.asarray(self.force[:, None] * self.unit_reactions)

    @property
    def reactions(self) -> FloatArray:
        """Seat reactions, (n, 6). [N]"""
        return np.asarray(self.statics.rest_reactions + self.reaction_change)

    @property
    def seat_indentations(self) -> FloatArray:
        """Indentation of each rod and ball, less that at rest, (n, 6). [mm]

        c (N^(2/3) - N_rest^(2/3)); zero for seats described as rigid. An open seat (N < 0, possible
        with the criterion arm_lift) counts as just touching. Johnson, Contact Mechanics,
        equations 4.26.
        """
        if self.probe.seats.contact == "rigid":
            return np.zeros((len(self.force), 6))
        coefficient = seat_coefficient(self.probe)
        reactions = np.maximum(self.reactions, 0.0)
        rest = self.statics.rest_reactions
        return np.asarray(coefficient * (np.cbrt(reactions**2) - np.cbrt(rest**2)))

    @property
    def tip_approach(self) -> FloatArray:
        """Approach of the tip's centre and a flat part by Hertz's law, as vectors (n, 3). [mm]"""
        tip = self.probe.tip
        modulus = tip.material.contact_modulus(self.workpiece)
        return np.asarray(ball_on_flat(self.force, tip.radius, modulus)[:, None] * self.directions)


def loaded(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    force: FloatArray,
    workpiece: Material,
) -> Loading:
    """A probe under given forces; parameters as of `Loading`."""
    unit_reactions = statics.unit_reactions(directions)
    return Loading(probe, statics, directions, force, unit_reactions, workpiece)


def loaded_to_trigger(
    probe: Probe, statics: SeatStatics, directions: FloatArray, workpiece: Material
) -> tuple[Loading, IntArray]:
    """A probe under the forces at which it triggers, and the seat that opens.

    Returns
    -------
    loading : Loading
        With infinite forces in directions in which no seat ever opens.
    seat : (n,) int
    """
    unit_reactions = statics.unit_reactions(rubbed_loads(directions, probe.tip.friction))
    if probe.seats.friction > 0.0 or probe.tip.friction > 0.0:
        force, seat = _lifted_with_friction(probe, statics, directions, unit_reactions)
    else:
        force, seat = trigger_force(
            statics.rest_reactions, unit_reactions, probe.criterion, probe.threshold
        )
    return Loading(probe, statics, directions, force, unit_reactions, workpiece), seat


def rubbed_loads(directions: FloatArray, friction: float) -> FloatArray:
    """Force on the tip per newton along the normal, with friction against its slide.

    Parameters
    ----------
    directions : (n, 3) float
        Outward surface normals, probe frame.
    friction : float
        Coulomb's coefficient of tip and part.

    Returns
    -------
    (n, 3) float
        The tip is displaced across the axis and slides along the surface by the rest; on a wall it
        does not slide. Where it would stick, friction turns the force into the axis, no further.

    References
    ----------
    Woźniak, the friction in his equation 3.

    >>> rubbed_loads(np.array([[0.6, 0.0, 0.8], [1.0, 0.0, 0.0]]), 0.1).round(3).tolist()
    [[0.52, 0.0, 0.86], [1.0, 0.0, 0.0]]
    """
    across, along = np.hypot(directions[:, 0], directions[:, 1]), np.abs(directions[:, 2])
    slides = (friction > 0.0) & (along > _WALL) & (across > _WALL)
    steep = np.where(slides, along, 1.0)
    acting = np.where(slides, np.minimum(friction, across / steep), 0.0)
    sideways = directions * np.array([1.0, 1.0, 0.0]) / np.where(slides, across, 1.0)[:, None]
    slide = (sideways - across[:, None] * directions) / steep[:, None]
    return np.asarray(directions - acting[:, None] * slide)


_WALL = 1e-9
_SUBSTITUTIONS = 200


def _lifted_with_friction(
    probe: Probe, statics: SeatStatics, directions: FloatArray, unit_reactions: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Trigger where the seats that remain resist the turn of the tripod about them.

    The moment is friction times rod radius times what they carry, which depends on the force: the
    equation of moments is solved by repeated substitution.
    """
    lever = lifted_heights(probe) * np.sin(probe.seats.support_angle)
    resistance = probe.seats.friction * probe.tripod.rod_radius / lever
    change = -watched_loads(unit_reactions, "arm_lift")
    held = watched_loads(statics.rest_reactions[None], "arm_lift")
    threshold = 0.0 if probe.criterion == PIEZO_STAGE else probe.threshold
    unloads = change > _NEVER
    unloading = np.where(unloads, change, 1.0)
    forces, before = np.zeros_like(change), np.full_like(change, np.inf)
    at_rest, per_newton = statics.rest_reactions @ statics.normals, unit_reactions @ statics.normals
    for _ in range(_SUBSTITUTIONS):
        if np.allclose(forces, before, rtol=1e-14, atol=0.0):
            break
        before = forces
        carried = np.linalg.norm(at_rest + forces[..., None] * per_newton[:, None], axis=-1)
        forces = (held - threshold + resistance * carried) / unloading
    lifts = unloads & (np.abs(forces - before) <= 1e-9 * forces)
    forces = np.where(lifts, forces, np.inf)
    force = forces.min(axis=1)
    # A tip that sticks loads all rods evenly: the one lifts that the normal alone would lift.
    tied = forces <= force[:, None] * (1.0 + 1e-9)
    by_normal = -watched_loads(statics.unit_reactions(directions), "arm_lift")
    rod = np.where(tied, by_normal, -np.inf).argmax(axis=1)
    rows = np.arange(len(force))
    right_first = unit_reactions[rows, 2 * rod + 1] < unit_reactions[rows, 2 * rod]
    if probe.criterion == PIEZO_STAGE:
        force = np.where(force > probe.threshold, probe.threshold, np.inf)
    return np.asarray(force), np.asarray(2 * rod + right_first, dtype=np.int64)


_NEVER = 1e-12
"""Unloading per newton below which a rod never lifts."""
