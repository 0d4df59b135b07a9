"""A touch as one system of equations: first contact, slide and trigger, without steps.

For all touches together: where the ball first meets the surface, and where spindle, deflected
stylus and surface are when the trigger's criterion is met.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import DISTANCE, BoolArray, FloatArray, IntArray, PretravelError, checked
from pretravel.design.probing.obstacles import (
    StylusOutline,
    first_obstacle,
    stylus_obstacle,
    sweeps_surface,
)
from pretravel.design.probing.surface_touches import SurfaceTouches, TouchStatus
from pretravel.design.probing.tip import TipBehaviour, TipState, tip_of
from pretravel.maps import PretravelMap
from pretravel.prediction import Probe
from pretravel.six_seats import curved_part_factor
from pretravel.surface import (
    LEAST_PLAY,
    ContactProblem,
    ContactSearch,
    Lines,
    LocalGeometry,
    Part,
    PartContacts,
    Reach,
    Surface,
    apexes_of,
    ball_center,
    distance_from_apexes,
    faces_to_touch,
    play_of_ball,
    surface_of,
)
from pretravel.touches import Targets

_ROUNDING = 1e-6
"""Share of the radius by which a hollow of the radius of the ball can seem to be smaller."""
_SMALLEST_SLIP = 1e-5
"""Displacement before slip of a contact that has none of its own. [mm]"""
_SOFTER = (1000.0, 300.0, 100.0, 50.0, 25.0, 12.0, 6.0, 4.0, 2.8, 2.0, 1.6, 1.3, 1.1, 1.0)
"""Multiples of the displacement before slip by which the solution with friction is approached."""
CLEARANCE = 2.0
"""Length of way before the contact on which the ball must meet nothing else. [mm]"""


def touch(
    tip: TipBehaviour | Probe | PretravelMap | str,
    surface: Surface | Part | str,
    targets: Targets,
    *,
    friction: float = 0.0,
    clearance: float = CLEARANCE,
    stylus: StylusOutline | None = None,
) -> SurfaceTouches:
    """Touch a surface at every target.

    Parameters
    ----------
    tip : TipBehaviour, Probe, PretravelMap or str
        Of a described or a measured probe. A description (or its name in the catalogue) is used
        with the model ``analytic``; for other models see
        `pretravel.design.probing.tip.predicted_tip`.
    surface : Surface, Part or str
        Machine frame; a str is a specification as on the command line. Of a part the chosen
        faces are touched; all faces are obstacles.
    targets : Targets
        The spindle moves along the approach through the tip centre's place above each target.
    friction : float
        Coulomb's coefficient at the tip; infinite: the tip sticks.
    clearance : float
        Length of way before the contact on which the ball must meet nothing else. [mm]
    stylus : StylusOutline, optional
        If given, the stylus must not meet the part either.

    Returns
    -------
    SurfaceTouches

    Raises
    ------
    PretravelError
        A negative friction or clearance; friction with a tip without forces.

    Notes
    -----
    The unknowns are two surface parameters and the spindle's travel s. For a given normal
    and slide, the force at the trigger has a closed form:
    S(u, v) + (r - compression) n = P(s) + deflection. With friction, the force is inclined
    from the normal, against the slide of the tip's centre since first contact, by Mindlin's law:
    the tip sticks at first, and slips when the angle reaches the friction angle. Two effects are
    neglected: the rotation of the ball with the bent stylus, and the moment of the friction force
    about the ball's centre.

    References
    ----------
    Rodrigues 2021, sections 3.2 to 3.4, as one system; K. L. Johnson, Contact
    Mechanics, section 7.2, for the tip that sticks or slips.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.design.probing.tip import predicted_tip
    >>> from pretravel.surface.shapes import Sphere
    >>> pole = Targets([[0.0, 0.0, 12.5]], [[0.0, 0.0, 1.0]])
    >>> at = touch(predicted_tip(load_probe("omp40-2")), Sphere([0, 0, 0], 12.5), pole)
    >>> at.status.tolist(), bool(at.pretravel[0] > 0.0)
    ([0], True)
    """
    tip, surface = tip_of(tip), surface_of(surface)
    _check(tip, friction, clearance)
    solution = _solve(tip, surface, targets, friction)
    status = _status(tip, surface, solution)
    face = np.where(solution.last.solved, solution.last.face, -1)
    if isinstance(surface, Part):
        rows = np.flatnonzero(status == TouchStatus.CONVERGED)
        obstacle = _ball_obstacles(surface, tip.radius, solution, rows, clearance)
        blocked = obstacle >= 0
        status[rows[blocked]], face[rows[blocked]] = TouchStatus.OTHER_FACE, obstacle[blocked]
        if stylus is not None:
            rows = rows[~blocked]
            obstacle = _stylus_obstacles(surface, stylus, solution, rows, clearance)
            blocked = obstacle >= 0
            status[rows[blocked]], face[rows[blocked]] = TouchStatus.STEM, obstacle[blocked]
    return _result(tip, solution, status, face)


def _check(tip: TipBehaviour, friction: float, clearance: float) -> None:
    if not friction >= 0.0:
        raise PretravelError(f"the friction is {friction:g}; it cannot be negative")
    checked(clearance, "the clearance", DISTANCE, inputs=("clearance",))
    if friction > 0.0 and not tip.has_forces:
        raise PretravelError("friction needs a described probe: a map contains no forces")


@dataclass(frozen=True, eq=False)
class _Solution:
    """First contact and trigger of every touch, before obstacles are considered.

    `fits` says where the ball fits into the surface; `state` and `direction` are the tip and the
    direction of the force on it at the trigger.
    """

    targets: FloatArray
    lines: Lines
    approach: FloatArray
    first: PartContacts
    last: PartContacts
    fits: BoolArray
    state: TipState
    direction: FloatArray


def _solve(
    tip: TipBehaviour, surface: Surface | Part, targets: Targets, friction: float
) -> _Solution:
    """Find first contact, then the trigger from there."""
    approach = np.asarray(targets.approaches)
    lines = Lines(targets.points + tip.radius * targets.normals, approach)
    search = ContactSearch(surface, len(lines))
    rigid = ball_center(tip.radius)
    search.solve(targets.points, ContactProblem(lines, lambda _rows: rigid, against=approach))
    first = search.contacts()
    usable = np.flatnonzero(first.solved)
    factor = np.full(len(lines), np.nan)
    factor[usable] = curved_part_factor(tip.radius, first.local.take(usable).principal_curvatures)
    fits = np.isfinite(factor)
    center = first.local.point + tip.radius * first.local.normal
    equilibrium = _TriggerEquilibrium(tip, friction, center, factor)
    search.restrict(fits)
    search.solve(first.local.point, ContactProblem(lines, equilibrium.reach))
    if friction > 0.0 and not np.all(search.solved[search.open]):
        # From a contact that is soft along the surface, step by step, to the real one.
        for softer in _SOFTER:
            equilibrium.softer = softer
            search.solve(first.local.point, ContactProblem(lines, equilibrium.reach))
    last = search.contacts()
    state, direction = _at_contacts(equilibrium, np.flatnonzero(last.solved), last.local)
    return _Solution(
        np.asarray(targets.points), lines, approach, first, last, fits, state, direction
    )


class _TriggerEquilibrium:
    """From surface point to spindle point at the trigger, with or without friction."""

    def __init__(
        self, tip: TipBehaviour, friction: float, first_center: FloatArray, factor: FloatArray
    ) -> None:
        self.tip, self.friction = tip, friction
        self.first_center, self.factor = first_center, factor
        self.softer = 1.0

    def reach(self, rows: IntArray) -> Reach:
        """For `solve_contact` on the given touches."""

        def reach(own: IntArray, local: LocalGeometry) -> FloatArray:
            state, direction = self.at(rows[own], local)
            cosine = np.sum(direction * local.normal, axis=1)
            compression = self.factor[rows[own]] * state.compression * np.cbrt(cosine**2)
            height = self.tip.radius - compression
            return np.asarray(height[:, None] * local.normal - state.deflection)

        return reach

    def at(self, rows: IntArray, local: LocalGeometry) -> tuple[TipState, FloatArray]:
        """The tip at the trigger and the direction of the force on it."""
        n = local.normal
        if self.friction == 0.0:
            return self.tip.state(n), n
        slide = local.point + self.tip.radius * n - self.first_center[rows]
        slide = slide - np.sum(slide * n, axis=1)[:, None] * n
        distance = np.linalg.norm(slide, axis=1)
        compression = self.factor[rows] * self.tip.state(n).compression
        ratio = self._force_ratio(distance, np.where(np.isfinite(compression), compression, 0.0))
        sliding = slide / np.maximum(distance, 1e-300)[:, None]
        inclined = n - ratio[:, None] * sliding
        direction = inclined / np.linalg.norm(inclined, axis=1, keepdims=True)
        return self.tip.state(direction), direction

    def _force_ratio(self, distance: FloatArray, compression: FloatArray) -> FloatArray:
        """Ratio of tangential to normal force for a tip that has moved along the surface.

        Johnson, equation 7.42: (1 - Q/(mu N))^(2/3) = 1 - d/d_slip, solved for Q/N; d_slip is the
        displacement at full slip.
        """
        own = np.maximum(self.tip.shear_ratio * compression, _SMALLEST_SLIP)
        per_friction = own * self.softer
        if np.isinf(self.friction):
            return 1.5 * distance / per_friction
        share = np.minimum(distance / (self.friction * per_friction), 1.0)
        return np.asarray(self.friction * (1.0 - (1.0 - share) ** 1.5))


def _at_contacts(
    equilibrium: _TriggerEquilibrium, rows: IntArray, local: LocalGeometry
) -> tuple[TipState, FloatArray]:
    """Tip and direction of the force at the solved contacts; not numbers elsewhere."""
    n = len(local.point)
    found, direction = equilibrium.at(rows, local.take(rows))
    state = TipState(np.full(n, np.nan), np.full((n, 3), np.nan), np.full(n, np.nan))
    state.force[rows], state.deflection[rows] = found.force, found.deflection
    state.compression[rows] = found.compression
    everywhere = np.full((n, 3), np.nan)
    everywhere[rows] = direction
    return state, everywhere


def _status(tip: TipBehaviour, surface: Surface | Part, solution: _Solution) -> IntArray:
    """The outcome of every touch, without obstacles."""
    first, last = solution.first, solution.last
    status = np.full(len(solution.lines), int(TouchStatus.CONVERGED))
    failed = ~last.solved
    status[failed] = TouchStatus.NOT_CONVERGED
    status[failed & (last.beyond_edge | first.beyond_edge)] = TouchStatus.EDGE
    status[first.solved & ~solution.fits] = TouchStatus.DOES_NOT_FIT
    met = np.flatnonzero(first.solved)
    never = np.isinf(tip.state(first.local.normal[met]).force)
    status[met[never]] = TouchStatus.NEVER_TRIGGERS
    triggered = np.flatnonzero(last.solved)
    outside = ~tip.supports(solution.direction[triggered])
    status[triggered[outside]] = TouchStatus.OUTSIDE_MAP
    _undetermined(tip.radius, surface, solution, status)
    lost = np.flatnonzero(~first.solved)
    start, approach = solution.lines.anchor[lost], solution.approach[lost]
    meets = sweeps_surface(surface, start, approach, tip.radius)
    status[lost] = np.where(meets, TouchStatus.EDGE, TouchStatus.MISSED)
    return status


def _undetermined(
    radius: float, surface: Surface | Part, solution: _Solution, status: IntArray
) -> None:
    """Mark touches near apexes, and in hollows with the radius of the ball, in place."""
    first, last = solution.first, solution.last
    for contacts in (first, last):
        met = np.flatnonzero(contacts.solved)
        play = play_of_ball(radius, contacts.local.take(met).principal_curvatures)
        tight = (play > -_ROUNDING * radius) & (play < LEAST_PLAY)
        status[met[tight]] = TouchStatus.NOT_DETERMINED
    for index, face in faces_to_touch(surface):
        places = apexes_of(face)
        if len(places) == 0:
            continue
        target = solution.targets
        for points, where in (
            (target, np.ones(len(status), dtype=bool)),
            (first.local.point, first.solved & (first.face == index)),
            (last.local.point, last.solved & (last.face == index)),
        ):
            near = where & (distance_from_apexes(points, places) < radius)
            status[near] = TouchStatus.APEX


def _ball_obstacles(
    part: Part, radius: float, solution: _Solution, rows: IntArray, clearance: float
) -> IntArray:
    """Faces that the balls of some touches meet on their way; -1 for none."""
    approach = solution.approach[rows]
    centers = solution.lines.anchor[rows] + solution.first.length[rows, None] * approach
    return first_obstacle(part, centers, approach, solution.last.face[rows], radius, clearance)


def _stylus_obstacles(
    part: Part, stylus: StylusOutline, solution: _Solution, rows: IntArray, clearance: float
) -> IntArray:
    """Faces that the stylus meets at some touches; -1 for none."""
    approach = solution.approach[rows]
    spindle = solution.lines.anchor[rows] + solution.last.length[rows, None] * approach
    return stylus_obstacle(part, spindle, approach, stylus, clearance)


def _result(
    tip: TipBehaviour, solution: _Solution, status: IntArray, face: IntArray
) -> SurfaceTouches:
    first, last, state = solution.first, solution.last, solution.state
    failed = status != TouchStatus.CONVERGED
    trigger_residual = np.zeros(len(status))
    good = np.flatnonzero(~failed)
    trigger_residual[good] = tip.excess(solution.direction[good], state.force[good])

    def without(values: FloatArray, where: BoolArray) -> FloatArray:
        result = np.array(values, dtype=np.float64)
        result[where] = np.nan
        return result

    return SurfaceTouches(
        status=status,
        face=face,
        first_point=without(first.local.point, ~first.solved),
        first_normal=without(first.local.normal, ~first.solved),
        first_travel=without(first.length, ~first.solved),
        point=without(last.local.point, failed),
        normal=without(last.local.normal, failed),
        travel=without(last.length, failed),
        force=without(state.force, failed),
        force_direction=without(solution.direction, failed),
        deflection=without(state.deflection, failed),
        residual=without(last.residual, failed),
        trigger_residual=without(trigger_residual, failed),
        iterations=first.iterations + last.iterations,
    )
