"""A touch as one system of equations: from first contact, sliding, to the trigger.

For every touch at once: where the ball first meets the surface, and where spindle,
deflected stylus and surface are when the trigger's criterion is met. Nothing is stepped.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.errors import PretravelError
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.model.hertz import curved_part_factor
from pretravel.probe.description import Probe
from pretravel.probing.obstacles import StylusOutline, first_obstacle, stem_obstacle, sweeps_surface
from pretravel.probing.targets import Targets
from pretravel.probing.tip import Tip, TipState, tip_of
from pretravel.surface.cad.part import Part
from pretravel.surface.contact import Reach, ball_center
from pretravel.surface.local_geometry import LocalGeometry, Surface
from pretravel.surface.search import ContactSearch, Found
from pretravel.surface.specification import surface_of

_SMALLEST_SLIP = 1e-5
"""Displacement before slip that a contact without any of its own is given. [mm]"""
_SOFTER = (1000.0, 300.0, 100.0, 50.0, 25.0, 12.0, 6.0, 4.0, 2.8, 2.0, 1.6, 1.3, 1.1, 1.0)
"""Times the displacement before slip with which a contact that sticks is approached."""
_CLEARANCE = 2.0
"""Way before the contact on which nothing else must be met, if not told. [mm]"""


class TouchStatus(IntEnum):
    """What became of a touch."""

    CONVERGED = 0
    MISSED = 1
    EDGE = 2
    OTHER_FACE = 3
    STEM = 4
    NEVER_TRIGGERS = 5
    DOES_NOT_FIT = 6
    NOT_CONVERGED = 7
    OUTSIDE_MAP = 8


MEANING = {
    TouchStatus.CONVERGED: "converged",
    TouchStatus.MISSED: "missed: the ball never meets the surface on its way",
    TouchStatus.EDGE: "edge: the ball meets or reaches an edge, where there is no normal",
    TouchStatus.OTHER_FACE: "other face: something else is met first",
    TouchStatus.STEM: "stem: the stylus runs into the part",
    TouchStatus.NEVER_TRIGGERS: "never triggers: a force that way presses every seat on",
    TouchStatus.DOES_NOT_FIT: "does not fit: the ball is larger than the hollow it is to touch",
    TouchStatus.NOT_CONVERGED: "not converged: no solution was found",
    TouchStatus.OUTSIDE_MAP: "outside the map: no touch or prediction supports this direction",
}
"""In words, for messages."""


@dataclass(frozen=True, eq=False)
class SurfaceTouches:
    """What happened at each of n touches; values are not numbers where it did not converge.

    Attributes
    ----------
    status : (n,) int
        See `TouchStatus`.
    face : (n,) int
        Index of the face that was touched, or of the one in the way; -1 for none.
    first_point, first_normal : (n, 3) float
        Of the surface at first contact. [mm]
    first_travel : (n,) float
        Of the spindle along the approach from the place above the target. [mm]
    point, normal : (n, 3) float
        Of the surface at the trigger. [mm]
    travel : (n,) float
        Of the spindle, to the trigger. [mm]
    force : (n,) float
        [N]
    force_direction : (n, 3) float
        Of the force on the tip: the normal, but for friction.
    deflection : (n, 3) float
        C - P. [mm]
    residual : (n,) float
        What the tangency still misses. [mm]
    trigger_residual : (n,) float
        What the trigger's criterion still misses. [N]
    iterations : (n,) int
        Of first contact and trigger together.
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
        """Which touches came to a trigger."""
        return np.asarray(self.status == TouchStatus.CONVERGED)

    @property
    def pretravel(self) -> FloatArray:
        """Travel from first contact to trigger, (n,). [mm]"""
        return self.travel - self.first_travel

    @property
    def slide(self) -> FloatArray:
        """Distance between the points of first contact and trigger, (n,). [mm]"""
        return np.asarray(np.linalg.norm(self.point - self.first_point, axis=1))


def touch(
    tip: Tip | Probe | PretravelMap | str,
    surface: Surface | Part | str,
    targets: Targets,
    *,
    friction: float = 0.0,
    clearance: float = _CLEARANCE,
    stylus: StylusOutline | None = None,
) -> SurfaceTouches:
    """Touch a surface at every target.

    Parameters
    ----------
    tip : Tip, Probe, PretravelMap or str
        Of a described or a measured probe; a description (or its name in the catalogue) is taken
        with model ``analytic``, see `pretravel.probing.tip.predicted_tip` for others.
    surface : Surface, Part or str
        Machine frame; a specification as on the command line. Of a part the chosen faces are
        touched; all are in the way.
    targets : Targets
        The spindle moves along the approach through the tip centre's place above each.
    friction : float
        Coulomb's coefficient at the tip; infinite: the tip sticks.
    clearance : float
        Way before the contact on which the ball must meet nothing else. [mm]
    stylus : StylusOutline, optional
        Given: the stylus, too, must not run into the part.

    Returns
    -------
    SurfaceTouches

    Notes
    -----
    Unknown are two surface parameters and the spindle's travel s; for given normal
    and slide the force at the trigger is a closed form:
    S(u, v) + (r - compression) n = P(s) + deflection. With friction the force leaves the
    normal against the slide of the tip's centre since first contact, as Mindlin's law
    says: sticking at first, by the friction angle once it slips. The turn of the ball with the
    bent stem, and friction's moment about the ball's centre, are left out.

    References
    ----------
    Rodrigues 2021, sections 3.2 to 3.4, as one system; K. L. Johnson, Contact
    Mechanics, section 7.2, for the tip that sticks or slips.

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.probing.tip import predicted_tip
    >>> from pretravel.surface.shapes import Sphere
    >>> pole = Targets([[0.0, 0.0, 12.5]], [[0.0, 0.0, 1.0]])
    >>> at = touch(predicted_tip(load_probe("omp40-2")), Sphere([0, 0, 0], 12.5), pole)
    >>> at.status.tolist(), bool(at.pretravel[0] > 0.0)
    ([0], True)
    """
    tip, surface = tip_of(tip), surface_of(surface)
    if not friction >= 0.0:
        raise PretravelError(f"friction is {friction:g}; it cannot be negative")
    if not (math.isfinite(clearance) and clearance >= 0.0):
        raise PretravelError(f"the clearance is {clearance:g} mm; it cannot be negative")
    if friction > 0.0 and not _knows_forces(tip):
        raise PretravelError("friction needs a described probe: a map does not know forces")
    approach = np.asarray(targets.approaches)
    start = targets.points + tip.radius * targets.normals
    n = len(start)
    found = ContactSearch(surface, n)
    rigid = ball_center(tip.radius)
    found.solve(targets.points, start, approach, lambda _rows: rigid, against=approach)
    first = found.state()
    usable = np.flatnonzero(found.solved)
    factor = np.full(n, np.nan)
    factor[usable] = curved_part_factor(tip.radius, first.local.take(usable).principal_curvatures)
    fits = np.isfinite(factor)
    slipping = _Slip(tip, friction, first.local.point + tip.radius * first.local.normal, factor)
    found.restrict(fits)
    found.solve(first.local.point, start, approach, slipping.reach)
    if friction > 0.0 and not np.all(found.solved[found.open]):
        # From a contact that gives way along the surface, step by step, to the real one.
        for softer in _SOFTER:
            slipping.softer = softer
            found.solve(first.local.point, start, approach, slipping.reach)
    last = found.state()
    there = np.flatnonzero(last.solved)
    state, direction = _at_contacts(slipping, there, last.local)
    status = np.full(n, int(TouchStatus.CONVERGED))
    failed = ~last.solved
    status[failed] = TouchStatus.NOT_CONVERGED
    status[failed & (last.beyond_edge | first.beyond_edge)] = TouchStatus.EDGE
    status[first.solved & ~fits] = TouchStatus.DOES_NOT_FIT
    status[usable[np.isinf(tip.state(first.local.normal[usable]).force)]] = (
        TouchStatus.NEVER_TRIGGERS
    )
    status[there[~tip.supports(direction[there])]] = TouchStatus.OUTSIDE_MAP
    lost = np.flatnonzero(~first.solved)
    meets = sweeps_surface(surface, start[lost], approach[lost], tip.radius)
    status[lost] = np.where(meets, TouchStatus.EDGE, TouchStatus.MISSED)
    face = np.where(last.solved, last.face, -1)
    if isinstance(surface, Part):
        _blocked(
            surface,
            tip.radius,
            start,
            approach,
            first.length,
            last,
            status,
            face,
            clearance,
            stylus,
        )
    bad = status != TouchStatus.CONVERGED
    trigger_residual = np.zeros(n)
    good = np.flatnonzero(~bad)
    trigger_residual[good] = tip.excess(direction[good], state.force[good])

    def known(values: FloatArray, where: BoolArray = bad) -> FloatArray:
        result = np.array(values, dtype=np.float64)
        result[where] = np.nan
        return result

    return SurfaceTouches(
        status=status,
        face=face,
        first_point=known(first.local.point, ~first.solved),
        first_normal=known(first.local.normal, ~first.solved),
        first_travel=known(first.length, ~first.solved),
        point=known(last.local.point),
        normal=known(last.local.normal),
        travel=known(last.length),
        force=known(state.force),
        force_direction=known(direction),
        deflection=known(state.deflection),
        residual=known(last.residual),
        trigger_residual=known(trigger_residual),
        iterations=first.iterations + last.iterations,
    )


def _at_contacts(
    slipping: _Slip, rows: IntArray, local: LocalGeometry
) -> tuple[TipState, FloatArray]:
    """Tip and direction of the force at the contacts that were found; not numbers elsewhere."""
    n = len(local.point)
    found, direction = slipping.at_rest(rows, local.take(rows))
    state = TipState(np.full(n, np.nan), np.full((n, 3), np.nan), np.full(n, np.nan))
    state.force[rows], state.deflection[rows] = found.force, found.deflection
    state.approach[rows] = found.approach
    everywhere = np.full((n, 3), np.nan)
    everywhere[rows] = direction
    return state, everywhere


def _blocked(
    part: Part,
    radius: float,
    start: FloatArray,
    approach: FloatArray,
    first_travel: FloatArray,
    last: Found,
    status: IntArray,
    face: IntArray,
    clearance: float,
    stylus: StylusOutline | None,
) -> None:
    """Mark the touches on whose way something else is, and what: in `status` and `face`."""
    done = np.flatnonzero(status == TouchStatus.CONVERGED)
    centers = start[done] + first_travel[done, None] * approach[done]
    obstacle = first_obstacle(part, centers, approach[done], last.face[done], radius, clearance)
    blocked = obstacle >= 0
    status[done[blocked]] = TouchStatus.OTHER_FACE
    face[done[blocked]] = obstacle[blocked]
    if stylus is None:
        return
    free = done[~blocked]
    spindle = start[free] + last.length[free, None] * approach[free]
    hit = stem_obstacle(part, spindle, approach[free], stylus, clearance)
    status[free[hit >= 0]] = TouchStatus.STEM
    face[free[hit >= 0]] = hit[hit >= 0]


def describe_failures(
    touches: SurfaceTouches, targets: Targets, surface: Surface | Part, most: int = 5
) -> list[str]:
    """What went wrong, in sentences: one for each kind, with the first few targets named.

    Parameters
    ----------
    touches : SurfaceTouches
    targets : Targets
    surface : Surface or Part
        As they were given to `touch`.
    most : int
        Targets named for each kind.

    Returns
    -------
    list of str
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


def _knows_forces(tip: Tip) -> bool:
    return bool(np.isfinite(tip.state(np.array([[0.0, 0.0, 1.0]])).force[0]))


class _Slip:
    """From surface point to spindle point at the trigger, with friction or without."""

    def __init__(
        self, tip: Tip, friction: float, first_center: FloatArray, factor: FloatArray
    ) -> None:
        self.tip, self.friction = tip, friction
        self.first_center, self.factor = first_center, factor
        self.softer = 1.0

    def reach(self, rows: IntArray) -> Reach:
        """For `solve_contact` on the given touches."""

        def reach(own: IntArray, local: LocalGeometry) -> FloatArray:
            state, direction = self.at_rest(rows[own], local)
            cosine = np.sum(direction * local.normal, axis=1)
            approach = self.factor[rows[own]] * state.approach * np.cbrt(cosine**2)
            height = self.tip.radius - approach
            return np.asarray(height[:, None] * local.normal - state.deflection)

        return reach

    def at_rest(self, rows: IntArray, local: LocalGeometry) -> tuple[TipState, FloatArray]:
        """The tip at the trigger and the direction of the force on it."""
        n = local.normal
        if self.friction == 0.0:
            return self.tip.state(n), n
        slide = local.point + self.tip.radius * n - self.first_center[rows]
        slide = slide - np.sum(slide * n, axis=1)[:, None] * n
        way = np.linalg.norm(slide, axis=1)
        approach = self.factor[rows] * self.tip.state(n).approach
        pull = self._pull(way, np.where(np.isfinite(approach), approach, 0.0))
        toward = slide / np.maximum(way, 1e-300)[:, None]
        leaning = n - pull[:, None] * toward
        direction = leaning / np.linalg.norm(leaning, axis=1, keepdims=True)
        return self.tip.state(direction), direction

    def _pull(self, way: FloatArray, approach: FloatArray) -> FloatArray:
        """Tangential over normal force for a tip that has moved along the surface.

        Johnson, equation 7.42: (1 - Q/mu N)^(2/3) = 1 - displacement / that at full slip.
        """
        per_friction = np.maximum(self.tip.shear_ratio * approach, _SMALLEST_SLIP) * self.softer
        if np.isinf(self.friction):
            return 1.5 * way / per_friction
        share = np.minimum(way / (self.friction * per_friction), 1.0)
        return np.asarray(self.friction * (1.0 - (1.0 - share) ** 1.5))
