"""The results of touches on a surface, and the reasons where a touch failed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray
from pretravel.surface import LEAST_PLAY, Part, Surface
from pretravel.touches import Targets


class TouchStatus(IntEnum):
    """The outcome of a touch."""

    CONVERGED = 0
    MISSED = 1
    EDGE = 2
    OTHER_FACE = 3
    STEM = 4
    NEVER_TRIGGERS = 5
    DOES_NOT_FIT = 6
    NOT_CONVERGED = 7
    OUTSIDE_MAP = 8
    NOT_DETERMINED = 9
    APEX = 10


MEANING = {
    TouchStatus.CONVERGED: "converged",
    TouchStatus.MISSED: "missed: the ball does not meet the outside of the surface on its way",
    TouchStatus.EDGE: "edge: the ball meets an edge or slides to one, where there is no normal",
    TouchStatus.OTHER_FACE: "other face: the ball meets another face first",
    TouchStatus.STEM: "stem: the stylus meets the part",
    TouchStatus.NEVER_TRIGGERS: "never triggers: a force in this direction loads every seat",
    TouchStatus.DOES_NOT_FIT: "does not fit: the ball is larger than the hollow at the target",
    TouchStatus.NOT_CONVERGED: "not converged: no solution was found",
    TouchStatus.OUTSIDE_MAP: "outside the map: no touch or prediction supports this direction",
    TouchStatus.NOT_DETERMINED: "not determined: the hollow has the radius of the ball "
    f"(up to {LEAST_PLAY:g} mm more), which touches it at no definite point",
    TouchStatus.APEX: "apex: nearer to the tip of a cone than the ball's radius; there the surface "
    "has no definite normal",
}
"""The outcomes in words, for messages."""


@dataclass(frozen=True, eq=False)
class SurfaceTouches:
    """The results of n touches; values are not numbers where a touch did not converge.

    Attributes
    ----------
    status : (n,) int
        See `TouchStatus`.
    face : (n,) int
        Index of the touched face, or of the obstacle; -1 for none.
    first_point, first_normal : (n, 3) float
        Of the surface at first contact. [mm]
    first_travel : (n,) float
        Of the spindle along the approach, from the place above the target to first contact. [mm]
    point, normal : (n, 3) float
        Of the surface at the trigger. [mm]
    travel : (n,) float
        Of the spindle along the approach, from the same place to the trigger. [mm]
    force : (n,) float
        [N]
    force_direction : (n, 3) float
        Of the force on the tip: the normal, unless there is friction.
    deflection : (n, 3) float
        C - P. [mm]
    residual : (n,) float
        Remaining error of the tangency. [mm]
    trigger_residual : (n,) float
        Remaining error of the trigger's criterion. [N]
    iterations : (n,) int
        For first contact and trigger together.
    """

    status: IntArray
    face: IntArray
    first_point: FloatArray
    first_normal: FloatArray
    first_travel: FloatArray
    point: FloatArray
    normal: FloatArray
    travel: FloatArray
    force: FloatArray
    force_direction: FloatArray
    deflection: FloatArray
    residual: FloatArray
    trigger_residual: FloatArray
    iterations: IntArray

    @property
    def converged(self) -> BoolArray:
        """Which touches reached the trigger."""
        return np.asarray(self.status == TouchStatus.CONVERGED)

    @property
    def pretravel(self) -> FloatArray:
        """Travel from first contact to trigger, (n,). [mm]"""
        return self.travel - self.first_travel

    @property
    def slide(self) -> FloatArray:
        """Distance between the points of first contact and trigger, (n,). [mm]"""
        return np.asarray(np.linalg.norm(self.point - self.first_point, axis=1))


def describe_failures(
    touches: SurfaceTouches, targets: Targets, surface: Surface | Part, most: int = 5
) -> list[str]:
    """Sentences that name the failed targets, one for each kind of failure.

    Parameters
    ----------
    touches : SurfaceTouches
    targets : Targets
    surface : Surface or Part
        As given to `touch`.
    most : int
        Largest number of targets that are named for each kind.
    """
    sentences = []
    for status in TouchStatus:
        rows = np.flatnonzero(touches.status == status)
        if status == TouchStatus.CONVERGED or len(rows) == 0:
            continue
        names = ", ".join(targets.name(int(row)) for row in rows[:most])
        more = f" and {len(rows) - most} more" if len(rows) > most else ""
        which = ""
        if isinstance(surface, Part) and status in (TouchStatus.OTHER_FACE, TouchStatus.STEM):
            numbers = sorted({surface.faces[i].number for i in touches.face[rows]})
            which = f" (face {', '.join(str(i) for i in numbers[:most])})"
        sentences.append(f"{len(rows)} {MEANING[status]}{which}: {names}{more}")
    return sentences
