"""Equilibrium of the tripod on seats with Coulomb friction, for a prescribed deflection.

The tangential forces at the seats depend on the state before, so the load is applied in steps;
each step is solved by a semi-smooth Newton method for all directions at once. Directions that are
solved leave the iteration; a step that fails is halved in the directions in which it fails.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pretravel.base import BoolArray, ConvergenceError, FloatArray, IntArray, PretravelError
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.interface_loads import (
    INTERFACE,
    SEATS,
    SPRING_FORCE,
    TANGENTIAL,
    TIP_FORCE,
)
from pretravel.prediction import Probe, SeatStatics, seat_coefficient, seat_frame, stylus_compliance

_TOLERANCE = 1e-10  # of residuals, relative to preload and rest indentation
_ITERATIONS = 60
_HALVINGS = 10  # of a step in which Newton's method fails
_SIZE = 25  # unknowns: 6 normal and 12 tangential forces, the rigid motion, the tip's force


@dataclass(frozen=True, eq=False)
class SeatState:
    """Forces and displacements in n directions, after the steps so far.

    Attributes
    ----------
    normal : (n, 6) float
        Seat forces. [N]
    tangential : (n, 12) float
        Friction at the seats. [N]
    rigid : (n, 6) float
        Rigid motion. [mm], [rad]
    force : (n,) float
        On the tip. [N]
    moved : (n, 22) float
        Displacements of the interface, from rest. [mm]
    """

    normal: FloatArray
    tangential: FloatArray
    rigid: FloatArray
    force: FloatArray
    moved: FloatArray

    def rows(self, rows: BoolArray | IntArray) -> SeatState:
        """The state of some of the directions."""
        return SeatState(*(getattr(self, entry.name)[rows] for entry in fields(self)))

    def replaced(self, rows: BoolArray | IntArray, other: SeatState) -> SeatState:
        """The state, with that of some directions replaced."""
        values = {entry.name: np.array(getattr(self, entry.name)) for entry in fields(self)}
        for name, value in values.items():
            value[rows] = getattr(other, name)
        return SeatState(**values)


@dataclass(frozen=True, eq=False)
class SeatMechanism:
    """The tripod on its seats, loaded along n directions; it is constant during a cycle.

    Attributes
    ----------
    directions : (n, 3) float
    flexibility : (22, 22) float
        Of the interface, without the patches' half-spaces. [mm/N]
    resultants : (6, 22) float
        Force and moment of each interface force.
    rest : (22,) float
        Interface forces at rest. [N]
    coefficient : float
        Indentation of a seat per N^(2/3). [mm/N^(2/3)]
    tangential_stiffness : (6,) float
        Of the seats, after Mindlin. [N/mm]
    friction : float
    """

    directions: FloatArray
    flexibility: FloatArray
    resultants: FloatArray
    rest: FloatArray
    coefficient: float
    tangential_stiffness: FloatArray
    friction: float

    def rows(self, rows: BoolArray | IntArray) -> SeatMechanism:
        """The mechanism in some of the directions."""
        return replace(self, directions=self.directions[rows])

    @cached_property
    def rest_depth(self) -> FloatArray:
        """Indentation of each seat by the spring alone, before a touch, (6,). [mm]"""
        return np.asarray(self.coefficient * np.cbrt(self.rest[SEATS] ** 2))

    @property
    def at_rest(self) -> SeatState:
        """The state before the first cycle: without tangential forces."""
        n = len(self.directions)
        return SeatState(
            np.tile(self.rest[SEATS], (n, 1)),
            np.zeros((n, 12)),
            np.zeros((n, 6)),
            np.zeros(n),
            np.zeros((n, len(INTERFACE))),
        )

    def interface(self, state: SeatState) -> FloatArray:
        """All interface forces, (n, 22). [N]"""
        forces = np.tile(self.rest, (len(self.directions), 1))
        forces[:, SEATS], forces[:, TANGENTIAL] = state.normal, state.tangential
        forces[:, TIP_FORCE] = state.force[:, None] * self.directions
        return forces

    def displacements(self, state: SeatState) -> FloatArray:
        """Of the interface against rest, (n, 22). [mm]"""
        change = self.interface(state) - self.rest
        return np.asarray(change @ self.flexibility + state.rigid @ self.resultants)

    def depth(self, state: SeatState) -> FloatArray:
        """Indentation of rods and balls; a negative one is a gap, (n, 6). [mm]"""
        return np.asarray(self.rest_depth - state.moved[:, SEATS])

    def deflection(self, state: SeatState) -> FloatArray:
        """Displacement of the tip along the normals, (n,). [mm]"""
        return np.asarray(np.sum(state.moved[:, TIP_FORCE] * self.directions, axis=1))


def seat_mechanism(
    probe: Probe,
    statics: SeatStatics,
    directions: FloatArray,
    friction: float,
    body: ReducedModel | str,
) -> SeatMechanism:
    """The mechanism of a probe; parameters as of `friction_cycle`.

    Normal: Hertz. Tangential: Mindlin's stiffness at the rest load.
    """
    frame = seat_frame(probe)
    tangents = np.stack([frame.along, frame.around], axis=1).reshape(12, 3)
    # Friction acts where rod and ball touch, not on the rod's axis.
    arms = np.repeat(frame.contacts(probe.tripod.rod_radius), 2, axis=0)
    resultants = np.zeros((6, len(INTERFACE)))
    resultants[:, SEATS] = statics.wrenches
    resultants[:, TIP_FORCE] = statics.tip_wrenches
    resultants[2, SPRING_FORCE] = -1.0
    resultants[:, TANGENTIAL] = np.concatenate([tangents, np.cross(arms, tangents)], axis=1).T
    flexibility = np.zeros(2 * (len(INTERFACE),))
    ratio = probe.tripod.material.poissons_ratio
    softer = (2.0 - ratio) / (2.0 * (1.0 - ratio))  # Mindlin: tangentially against normally
    if isinstance(body, ReducedModel):
        flexibility = np.array(body.flexibility)
        flexibility[SEATS, SEATS] += body.seat_correction * np.eye(6)
        flexibility[TANGENTIAL, TANGENTIAL] += softer * body.seat_correction * np.eye(12)
    elif body == "analytic":
        flexibility[TIP_FORCE, TIP_FORCE] = np.diag(stylus_compliance(probe.stylus))
    elif body != "rigid":
        raise PretravelError(
            f"the body of the probe is '{body}'; it must be 'rigid', 'analytic' (an elastic "
            "stylus), or a reduced finite-element model"
        )
    coefficient = seat_coefficient(probe)
    rest = np.zeros(len(INTERFACE))
    rest[SEATS], rest[SPRING_FORCE] = statics.rest_reactions, probe.preload
    normal_stiffness = 1.5 * np.cbrt(statics.rest_reactions) / coefficient
    return SeatMechanism(
        directions,
        flexibility,
        resultants,
        rest,
        coefficient,
        normal_stiffness / softer,
        friction,
    )


def equilibrium(
    mechanism: SeatMechanism, before: SeatState, target: FloatArray, halvings: int = _HALVINGS
) -> SeatState:
    """The state at prescribed deflections, (n,). [mm]

    A step that fails in some directions is halved in these.

    Raises
    ------
    ConvergenceError
        No equilibrium, even with the smallest steps.
    """
    state, merit = _newton(mechanism, before, target)
    failed = merit >= _TOLERANCE
    if not np.any(failed):
        return state
    if halvings == 0:
        raise ConvergenceError(
            f"no equilibrium was found with friction {mechanism.friction:g} at the seats (residual "
            f"{merit.max():.1e} of the preload after {_ITERATIONS} iterations): take more steps, "
            "or less friction"
        )
    part, start, end = mechanism.rows(failed), before.rows(failed), target[failed]
    halfway = 0.5 * (part.deflection(start) + end)
    middle = equilibrium(part, start, halfway, halvings - 1)
    return state.replaced(failed, equilibrium(part, middle, end, halvings - 1))


class _Residual(NamedTuple):
    scaled: FloatArray  # (n, 25), relative to the preload
    moved: FloatArray  # (n, 22) displacements of the interface
    trial: FloatArray  # (n, 12) tangential forces if no seat slid

    def rows(self, rows: BoolArray) -> _Residual:
        """The residual of some of the directions."""
        return _Residual(*(part[rows] for part in self))


@dataclass(frozen=True, eq=False)
class _Equations:
    """The equations of one step: seat laws, balance of the tripod, and the target."""

    mechanism: SeatMechanism
    before: SeatState
    target: FloatArray

    @cached_property
    def scales(self) -> tuple[float, float, float]:
        """Of indentations [mm], forces [N] and arms [mm]."""
        mechanism = self.mechanism
        lever = float(np.linalg.norm(mechanism.resultants[3:, 6]))
        return float(mechanism.rest_depth.mean()), float(mechanism.rest[SPRING_FORCE]), lever

    @cached_property
    def rows(self) -> FloatArray:
        """Scale of each equation."""
        rows = np.ones(_SIZE)
        rows[21:24] = self.scales[2]
        return rows

    @cached_property
    def columns(self) -> FloatArray:
        """Scale of each unknown."""
        depth, _, lever = self.scales
        columns = np.ones(_SIZE)
        columns[18:24] = np.repeat([depth, depth / lever], 3)
        return columns

    @cached_property
    def stiffness(self) -> FloatArray:
        """Tangential, of each direction of each seat, (12,). [N/mm]"""
        return np.repeat(self.mechanism.tangential_stiffness, 2)

    @cached_property
    def balance(self) -> FloatArray:
        """Force and moment on the tripod by unknowns, (n, 6, 25)."""
        resultants, d = self.mechanism.resultants, self.mechanism.directions
        balance = np.zeros((len(d), 6, _SIZE))
        balance[:, :, 0:6], balance[:, :, 6:18] = resultants[:, SEATS], resultants[:, TANGENTIAL]
        balance[:, :, 24] = d @ resultants[:, TIP_FORCE].T
        return balance

    @cached_property
    def moved(self) -> FloatArray:
        """Interface displacements by unknowns, (n, 22, 25)."""
        flexibility, d = self.mechanism.flexibility, self.mechanism.directions
        moved = np.zeros((len(d), len(INTERFACE), _SIZE))
        moved[:, :, 0:6], moved[:, :, 6:18] = flexibility[:, SEATS], flexibility[:, TANGENTIAL]
        moved[:, :, 18:24] = self.mechanism.resultants.T
        moved[:, :, 24] = d @ flexibility[TIP_FORCE]
        return moved

    @cached_property
    def target_row(self) -> FloatArray:
        """The target's equation by unknowns, (n, 25)."""
        depth, force, _ = self.scales
        along = np.einsum("ni,nik->nk", self.mechanism.directions, self.moved[:, TIP_FORCE])
        return np.asarray(along * force / depth)

    @property
    def start(self) -> FloatArray:
        """The unknowns before the step, (n, 25)."""
        b = self.before
        return np.concatenate([b.normal, b.tangential, b.rigid, b.force[:, None]], axis=1)

    def state(self, x: FloatArray, moved: FloatArray | None = None) -> SeatState:
        """The state of given unknowns."""
        state = SeatState(x[:, :6], x[:, 6:18], x[:, 18:24], x[:, 24], self.before.moved)
        return replace(state, moved=self.mechanism.displacements(state) if moved is None else moved)

    def residual(self, x: FloatArray) -> _Residual:
        """Residuals of the equations."""
        mechanism, state = self.mechanism, self.state(x)
        closed = np.maximum(mechanism.depth(state), 0.0)
        slid = state.moved[:, TANGENTIAL] - self.before.moved[:, TANGENTIAL]
        trial = self.before.tangential - self.stiffness * slid
        depth, force, _ = self.scales
        off = (mechanism.deflection(state) - self.target) * force / depth
        parts = [
            state.normal - (closed / mechanism.coefficient) ** 1.5,
            state.tangential - _on_cone(trial, state.normal, mechanism.friction),
            mechanism.interface(state) @ mechanism.resultants.T,
            off[:, None],
        ]
        return _Residual(
            np.concatenate(parts, axis=1) / self.rows / force, state.moved, np.asarray(trial)
        )

    def jacobian(self, x: FloatArray, residual: _Residual) -> FloatArray:
        """Derivatives of the scaled residual by the scaled unknowns, (n, 25, 25)."""
        mechanism = self.mechanism
        c = mechanism.coefficient
        closed = np.maximum(mechanism.rest_depth - residual.moved[:, SEATS], 0.0)
        slope = 1.5 * np.sqrt(closed) / c**1.5
        by_trial, by_normal = _slopes_on_cone(residual.trial, x[:, :6], mechanism.friction)
        jacobian = np.zeros((len(x), _SIZE, _SIZE))
        jacobian[:, :6] = slope[:, :, None] * self.moved[:, SEATS]
        jacobian[:, :6, :6] += np.eye(6)
        jacobian[:, 6:18] = (by_trial * self.stiffness) @ self.moved[:, TANGENTIAL]
        jacobian[:, 6:18, 6:18] += np.eye(12)
        jacobian[:, 6:18, 0:6] -= by_normal
        jacobian[:, 18:24] = self.balance
        jacobian[:, 24] = self.target_row
        return np.asarray(jacobian / self.rows[:, None] / self.scales[1] * self.columns)


def _newton(
    mechanism: SeatMechanism, before: SeatState, target: FloatArray
) -> tuple[SeatState, FloatArray]:
    """Semi-smooth Newton with backtracking.

    Directions that are solved leave the iteration.

    Returns
    -------
    state : SeatState
    merit : (n,) float
        Norm of the scaled residual: above the tolerance where no equilibrium was found.
    """
    equations = _Equations(mechanism, before, target)
    x = equations.start
    residual = equations.residual(x)
    merit = np.linalg.norm(residual.scaled, axis=1)
    state = equations.state(x, residual.moved)
    active = np.arange(len(x))
    for _ in range(_ITERATIONS):
        kept = merit[active] >= _TOLERANCE
        if not np.any(kept):
            break
        if not np.all(kept):
            active, x, residual = active[kept], x[kept], residual.rows(kept)
            equations = _Equations(mechanism.rows(active), before.rows(active), target[active])
        jacobian = equations.jacobian(x, residual)
        held = mechanism.friction > 0.0
        step = _least_norm(jacobian, residual.scaled, held=held) * equations.columns
        x = x - _share(equations, x, step, merit[active])[:, None] * step
        residual = equations.residual(x)
        merit[active] = np.linalg.norm(residual.scaled, axis=1)
        state = state.replaced(active, equations.state(x, residual.moved))
    return state, merit


def _share(equations: _Equations, x: FloatArray, step: FloatArray, merit: FloatArray) -> FloatArray:
    """The share of a Newton step that reduces the residual in each direction, (n,)."""
    share = np.ones(len(x))
    for _ in range(12):
        attempt = equations.residual(x - share[:, None] * step).scaled
        better = np.linalg.norm(attempt, axis=1) <= (1.0 - 1e-4 * share) * merit
        done = better | (merit < _TOLERANCE)
        if np.all(done):
            break
        share = np.where(done, share, 0.5 * share)
    return share


def _least_norm(matrix: FloatArray, right: FloatArray, *, held: bool) -> FloatArray:
    """Solutions; a motion that nothing constrains (the yaw of an unloaded rod) is zero.

    With friction nearly every motion is constrained and a plain solution is used where it is
    sound. Without friction the least of many solutions is needed, or Newton's method diverges.
    """
    found, sound = np.zeros_like(right), np.zeros(len(right), dtype=np.bool_)
    if held:
        try:
            found = np.asarray(
                np.linalg.solve(matrix, right[:, :, None])[:, :, 0], dtype=np.float64
            )
            off = np.linalg.norm(np.einsum("nij,nj->ni", matrix, found) - right, axis=1)
            sound = off <= 1e-9 * np.linalg.norm(right, axis=1)
            sound &= np.abs(found).max(axis=1) < 100.0
        except np.linalg.LinAlgError:
            pass
    if not np.all(sound):
        inverse = np.linalg.pinv(matrix[~sound], rcond=1e-12)
        found[~sound] = np.einsum("nij,nj->ni", inverse, right[~sound])
    return np.asarray(found)


def _on_cone(trial: FloatArray, normal: FloatArray, friction: float) -> FloatArray:
    """Coulomb: trial forces brought back to the cone, (n, 12)."""
    pairs = trial.reshape(len(trial), 6, 2)
    size = np.sqrt(np.sum(pairs**2, axis=2))
    bound = friction * np.maximum(normal, 0.0)
    factor = np.where(size > bound, bound / np.maximum(size, 1e-300), 1.0)
    return np.asarray((pairs * factor[:, :, None]).reshape(trial.shape))


def _slopes_on_cone(
    trial: FloatArray, normal: FloatArray, friction: float
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of `_on_cone` by trial forces (n, 12, 12) and normal forces (n, 12, 6)."""
    n = len(trial)
    pairs = trial.reshape(n, 6, 2)
    size = np.maximum(np.sqrt(np.sum(pairs**2, axis=2)), 1e-300)
    bound = friction * np.maximum(normal, 0.0)
    slips = size > bound
    unit = pairs / size[:, :, None]
    across = np.eye(2) - unit[:, :, :, None] * unit[:, :, None, :]
    sliding = (bound / size)[:, :, None, None] * across
    local = np.where(slips[:, :, None, None], sliding, np.eye(2))
    pushed = np.where(slips & (normal > 0.0), friction, 0.0)[:, :, None] * unit
    by_trial, by_normal = np.zeros((n, 6, 2, 6, 2)), np.zeros((n, 6, 2, 6))
    seats = np.arange(6)
    by_trial[:, seats, :, seats] = local.swapaxes(0, 1)
    by_normal[:, seats, :, seats] = pushed.swapaxes(0, 1)
    return by_trial.reshape(n, 12, 12), by_normal.reshape(n, 12, 6)
