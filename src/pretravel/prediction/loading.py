"""A probe under load: forces on its tip, and the reactions of its seats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.prediction.description import Probe
from pretravel.prediction.hertz import ball_on_flat, contact_modulus
from pretravel.prediction.materials import Material
from pretravel.prediction.seats import SeatStatics, seat_coefficient
from pretravel.six_seats import trigger_force


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
        modulus = contact_modulus(tip.material, self.workpiece)
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
    unit_reactions = statics.unit_reactions(directions)
    force, seat = trigger_force(
        statics.rest_reactions, unit_reactions, probe.criterion, probe.threshold
    )
    return Loading(probe, statics, directions, force, unit_reactions, workpiece), seat
