"""Seats with Coulomb friction: the mechanism remembers where it came from.

Frictionless seats obey statics, so loading and unloading are one line. With friction the
tangential forces at the seats depend on history: the probe triggers later, reseats at
another place, and comes to rest elsewhere than it started.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray, frozen
from pretravel.directions import checked_unit, describe
from pretravel.errors import ConvergenceError, PretravelError
from pretravel.model.fem.condensation import ReducedModel
from pretravel.model.fem.interface_loads import (
    INTERFACE,
    SEATS,
    SPRING_FORCE,
    TANGENTIAL,
    TIP_FORCE,
)
from pretravel.probe.description import Probe
from pretravel.probe.seat_frame import seat_frame
from pretravel.trigger.event import trigger_force
from pretravel.trigger.seats import SeatStatics, seat_coefficient, seat_statics

LARGEST_FRICTION = 0.5
"""No seat has more; and rods jam between their balls from the tangent of the support angle on,
where the equations lose their one answer."""
LARGEST_OVERTRAVEL = 1.0
"""Beyond a millimetre the tripod turns too far for its equations. [mm]"""
_TOLERANCE = 1e-10  # of residuals, relative to preload and rest indentation
_ITERATIONS = 60
_BISECTIONS = 24  # of a step, where a seat opens or closes


@dataclass(frozen=True, eq=False)
class FrictionCycle:
    """Loading to the overtravel and back, for n directions, step by step.

    Attributes
    ----------
    directions : (n, 3) float
    friction : float
    deflection : (n, t) float
        Tip displacement along the surface normal, from rest before the first cycle. [mm]
    force : (n, t) float
        On the tip. [N]
    reactions : (n, t, 6) float
        Normal seat forces. [N]
    tangential : (n, t, 6, 2) float
        Friction on the rods, along and around them. [N]
    displacement : (n, t, 3) float
        Of the tip. [mm]
    loading : (t,) bool
    cycle : (t,) int
    trigger_force, trigger_deflection : (n, cycles) float
        Where the first seat falls to the threshold. [N], [mm]
    reseat_deflection : (n, cycles) float
        Where the last open seat closes on the way back. [mm]
    rest_displacement : (n, cycles, 3) float
        Tip once the force is gone, against rest before the first cycle. [mm]
    """

    directions: FloatArray
    friction: float
    deflection: FloatArray
    force: FloatArray
    reactions: FloatArray
    tangential: FloatArray
    displacement: FloatArray
    loading: BoolArray
    cycle: npt.NDArray[np.int64]
    trigger_force: FloatArray
    trigger_deflection: FloatArray
    reseat_deflection: FloatArray
    rest_displacement: FloatArray

    @property
    def hysteresis(self) -> FloatArray:
        """Deflection at opening less that at reseating, (n, cycles). [mm]

        Mostly positive; before the seats have settled, and where two open at once, a seat
        may close again at the larger deflection.
        """
        return np.asarray(self.trigger_deflection - self.reseat_deflection)

    @property
    def zero_drift(self) -> FloatArray:
        """Component of the rest displacement along the normal, (n, cycles). [mm]

        Ren 2020: the drift of zero position.
        """
        return np.asarray(np.einsum("nci,ni->nc", self.rest_displacement, self.directions))

    @property
    def reseat_error(self) -> FloatArray:
        """How far the tip rests from where it rested before the cycle, (n, cycles). [mm]"""
        start = np.zeros_like(self.rest_displacement[:, :1])
        moved = np.diff(np.concatenate([start, self.rest_displacement], axis=1), axis=1)
        return np.asarray(np.linalg.norm(moved, axis=2))


@dataclass(frozen=True, eq=False)
class _Mechanism:
    """Everything that does not change during a cycle."""

    flexibility: FloatArray  # (22, 22), patches taken off
    resultants: FloatArray  # (6, 22)
    rest: FloatArray  # (22,) interface forces
    coefficient: float  # Hertz
    tangential_stiffness: FloatArray  # (6,)
    friction: float


@dataclass
class _State:
    """One step's forces and history, n directions."""

    normal: FloatArray  # (n, 6)
    shear: FloatArray  # (n, 12)
    rigid: FloatArray  # (n, 6)
    force: FloatArray  # (n,)
    slid: FloatArray  # (n, 12) tangential displacement of the rods at the seats


def friction_cycle(
    probe: Probe,
    directions: npt.ArrayLike,
    friction: float,
    *,
    reduced: ReducedModel | None = None,
    overtravel: float | None = None,
    cycles: int = 1,
    steps: int = 100,
) -> FrictionCycle:
    """Deflect the tip past the trigger and let it return, with friction at the seats.

    Parameters
    ----------
    probe : Probe
        With seats of contact ``hertz``.
    directions : (n, 3) float
        Outward surface normals, probe frame; the part pushes along them, frictionless.
    friction : float
        Coulomb's coefficient at the seats, 0 to 0.5.
    reduced : ReducedModel, optional
        Elasticity of the moving part; rigid when not given.
    overtravel : float, optional
        Deflection beyond that of the frictionless trigger before the return; when not
        given 10 um, or twice the trigger's if that is more. [mm]
    cycles : int
    steps : int
        Of each loading, and of each return. Trigger forces hardly depend on it;
        hysteresis converges slowly, to about 5 % with 100.

    Returns
    -------
    FrictionCycle

    Raises
    ------
    PretravelError
        Friction out of range, rigid seats, a direction that never triggers.
    ConvergenceError
        A step that found no equilibrium.

    Notes
    -----
    Normal: Hertz. Tangential: Coulomb with Mindlin's stiffness at the rest load,
    2 (1 - nu) / (2 - nu) of the normal one, and return mapping. Before the first cycle
    there are no tangential forces: the tripod was set down without friction.

    References
    ----------
    R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; Ren 2020, section 2 (hysteresis, drift
    of zero position).

    >>> from pretravel.probe.catalogue import load_probe
    >>> cycle = friction_cycle(load_probe("omp40-2"), [[1.0, 0.0, 0.0]], 0.0, steps=20)
    >>> round(float(cycle.trigger_force[0, 0]), 4), bool(abs(cycle.zero_drift[0, 0]) < 1e-9)
    (0.7498, True)
    """
    d = checked_unit(directions, "directions")
    check_conditions(probe, friction, overtravel, cycles, steps)
    statics = seat_statics(probe)
    mechanism = _mechanism(probe, statics, reduced, friction)
    return _run(mechanism, probe, statics, d, overtravel, cycles, steps)


def check_conditions(
    probe: Probe, friction: float, overtravel: float | None, cycles: int, steps: int
) -> None:
    """Refuse what `friction_cycle` cannot work with, before long work is done for it.

    Raises
    ------
    PretravelError
    """
    largest = min(LARGEST_FRICTION, 0.95 * math.tan(probe.seats.support_angle))
    if not (math.isfinite(friction) and 0.0 <= friction <= largest):
        raise PretravelError(
            f"a friction coefficient of {friction:g} at the seats: it lies between 0 and "
            f"{largest:.3g} (polished carbide 0.1 to 0.2; beyond the tangent of the support angle "
            "rods jam between their balls)"
        )
    if overtravel is not None and not 0.0 < overtravel <= LARGEST_OVERTRAVEL:
        raise PretravelError(
            f"an overtravel of {overtravel:g} mm: it lies above 0 and up to {LARGEST_OVERTRAVEL:g}"
        )
    if cycles < 1 or steps < 5:
        raise PretravelError(f"{cycles} cycles of {steps} steps: at least 1 of 5 are needed")
    if probe.criterion != "first_contact":
        raise PretravelError(
            f"cycles with friction look for the first seat that opens; the criterion "
            f"'{probe.criterion}' of [trigger] is not followed: make it 'first_contact'"
        )
    if probe.seats.contact != "hertz":
        raise PretravelError(
            "friction needs seats that give: [seats] contact is 'rigid', make it 'hertz'"
        )


def _mechanism(
    probe: Probe, statics: SeatStatics, reduced: ReducedModel | None, friction: float
) -> _Mechanism:
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
    if reduced is not None:
        flexibility = np.array(reduced.flexibility)
        flexibility[SEATS, SEATS] += reduced.seat_correction * np.eye(6)
        flexibility[TANGENTIAL, TANGENTIAL] += softer * reduced.seat_correction * np.eye(12)
    coefficient = seat_coefficient(probe)
    rest = np.zeros(len(INTERFACE))
    rest[SEATS], rest[SPRING_FORCE] = statics.rest_reactions, probe.preload
    normal_stiffness = 1.5 * np.cbrt(statics.rest_reactions) / coefficient
    return _Mechanism(
        flexibility, resultants, rest, coefficient, normal_stiffness / softer, friction
    )


def _interface(mechanism: _Mechanism, state: _State, d: FloatArray) -> FloatArray:
    """All 22 interface forces, (n, 22). [N]"""
    forces = np.tile(mechanism.rest, (len(d), 1))
    forces[:, SEATS], forces[:, TANGENTIAL] = state.normal, state.shear
    forces[:, TIP_FORCE] = state.force[:, None] * d
    return forces


def _displacements(mechanism: _Mechanism, state: _State, d: FloatArray) -> FloatArray:
    """Of the interface against rest, (n, 22). [mm]"""
    change = _interface(mechanism, state, d) - mechanism.rest
    return np.asarray(change @ mechanism.flexibility + state.rigid @ mechanism.resultants)


def _solve(
    mechanism: _Mechanism,
    before: _State,
    d: FloatArray,
    target: FloatArray,
    by_force: bool = False,
    halvings: int = 6,
) -> _State:
    """Equilibrium at a prescribed deflection (or force); steps that fail are halved."""
    try:
        return _newton(mechanism, before, d, target, by_force)
    except ConvergenceError:
        if halvings == 0:
            raise
    start = before.force
    if not by_force:
        start = np.sum(_displacements(mechanism, before, d)[:, TIP_FORCE] * d, axis=1)
    middle = _solve(mechanism, before, d, 0.5 * (start + target), by_force, halvings - 1)
    return _solve(mechanism, middle, d, target, by_force, halvings - 1)


def _newton(
    mechanism: _Mechanism, before: _State, d: FloatArray, target: FloatArray, by_force: bool
) -> _State:
    """Semi-smooth Newton with backtracking, for all directions at once.

    Unknowns: six normal forces, twelve tangential ones, the rigid motion, the tip's force.
    """
    size = 25
    c, mu = mechanism.coefficient, mechanism.friction
    stiffness = np.repeat(mechanism.tangential_stiffness, 2)
    rest_depth = c * np.cbrt(mechanism.rest[SEATS] ** 2)
    depth_scale, force_scale = float(rest_depth.mean()), float(mechanism.rest[SPRING_FORCE])
    lever = float(np.linalg.norm(mechanism.resultants[3:, 6]))
    rows = np.ones(size)
    rows[21:24] = lever
    columns = np.ones(size)
    columns[18:21], columns[21:24] = depth_scale, depth_scale / lever
    loaded = np.zeros((len(d), len(INTERFACE), size))  # interface forces by unknowns
    loaded[:, SEATS, 0:6] = np.eye(6)
    loaded[:, TANGENTIAL, 6:18] = np.eye(12)
    loaded[:, TIP_FORCE, 24] = d
    moved = mechanism.flexibility @ loaded  # interface displacements by unknowns
    moved[:, :, 18:24] += mechanism.resultants.T
    tip_row = np.einsum("ni,nik->nk", d, moved[:, TIP_FORCE]) * force_scale / depth_scale

    def unpacked(x: FloatArray) -> _State:
        return _State(x[:, :6], x[:, 6:18], x[:, 18:24], x[:, 24], before.slid)

    def residual(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        state = unpacked(x)
        u = _displacements(mechanism, state, d)
        closed = np.maximum(rest_depth - u[:, SEATS], 0.0)
        trial = before.shear - stiffness * (u[:, TANGENTIAL] - before.slid)
        off = state.force - target
        if not by_force:
            off = (np.sum(u[:, TIP_FORCE] * d, axis=1) - target) * force_scale / depth_scale
        parts = [
            state.normal - (closed / c) ** 1.5,
            state.shear - _return_map(trial, state.normal, mu)[0],
            _interface(mechanism, state, d) @ mechanism.resultants.T,
            off[:, None],
        ]
        return np.concatenate(parts, axis=1) / rows / force_scale, u, trial

    x = np.concatenate([before.normal, before.shear, before.rigid, before.force[:, None]], axis=1)
    r, u, trial = residual(x)
    for _ in range(_ITERATIONS):
        merit = np.linalg.norm(r, axis=1)
        if float(merit.max()) < _TOLERANCE:
            state = unpacked(x)
            state.slid = u[:, TANGENTIAL]
            return state
        closed = np.maximum(rest_depth - u[:, SEATS], 0.0)
        slope = 1.5 * np.sqrt(closed) / c**1.5
        _, by_trial, by_normal = _return_map(trial, x[:, :6], mu)
        jacobian = np.zeros((len(d), size, size))
        jacobian[:, :6] = slope[:, :, None] * moved[:, SEATS]
        jacobian[:, :6, :6] += np.eye(6)
        jacobian[:, 6:18] = (by_trial * stiffness) @ moved[:, TANGENTIAL]
        jacobian[:, 6:18, 6:18] += np.eye(12)
        jacobian[:, 6:18, 0:6] -= by_normal
        jacobian[:, 18:24] = mechanism.resultants @ loaded
        jacobian[:, 24] = np.eye(size)[24] if by_force else tip_row
        scaled = jacobian / rows[:, None] / force_scale * columns
        step = _least_norm(scaled, r, held=mu > 0.0) * columns
        share = np.ones(len(d))
        for _ in range(12):
            attempt, u, trial = residual(x - share[:, None] * step)
            better = np.linalg.norm(attempt, axis=1) <= (1.0 - 1e-4 * share) * merit
            done = better | (merit < _TOLERANCE)
            if np.all(done):
                break
            share = np.where(done, share, 0.5 * share)
        x = x - share[:, None] * step
        r, u, trial = residual(x)
    raise ConvergenceError(
        f"the seats with friction {mu:g} found no equilibrium (residual {merit.max():.1e} of the "
        f"preload after {_ITERATIONS} iterations): take more steps, or less friction"
    )


def _least_norm(matrix: FloatArray, right: FloatArray, *, held: bool) -> FloatArray:
    """Solutions; where nothing holds something (the yaw of an unloaded rod), it stays.

    With friction nearly everything is held and a plain solution does where it is sound;
    without, the least one of many is needed, or Newton's method strays among them.
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


def _return_map(
    trial: FloatArray, normal: FloatArray, friction: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coulomb: trial forces brought back to the cone, with derivatives by trial and normal."""
    n = len(trial)
    pairs = trial.reshape(n, 6, 2)
    size = np.linalg.norm(pairs, axis=2)
    bound = friction * np.maximum(normal, 0.0)
    slips = size > bound
    unit = pairs / np.maximum(size, 1e-300)[:, :, None]
    factor = np.where(slips, bound / np.maximum(size, 1e-300), 1.0)
    shear = pairs * factor[:, :, None]
    block = np.einsum("nki,nkj->nkij", unit, unit)
    local = np.where(
        slips[:, :, None, None],
        factor[:, :, None, None] * (np.eye(2) - block),
        np.eye(2),
    )
    by_trial, by_normal = np.zeros((n, 12, 12)), np.zeros((n, 12, 6))
    for seat in range(6):
        rows = slice(2 * seat, 2 * seat + 2)
        by_trial[:, rows, rows] = local[:, seat]
        pushed = np.where(slips[:, seat] & (normal[:, seat] > 0.0), friction, 0.0)
        by_normal[:, rows, seat] = pushed[:, None] * unit[:, seat]
    return shear.reshape(n, 12), by_trial, by_normal


def _run(
    mechanism: _Mechanism,
    probe: Probe,
    statics: SeatStatics,
    d: FloatArray,
    overtravel: float | None,
    cycles: int,
    steps: int,
) -> FrictionCycle:
    n, threshold = len(d), probe.threshold
    rest = statics.rest_reactions
    state = _State(
        np.tile(rest, (n, 1)), np.zeros((n, 12)), np.zeros((n, 6)), np.zeros(n), np.zeros((n, 12))
    )
    kept: list[tuple[_State, FloatArray, bool, int]] = [
        (state, np.zeros((n, len(INTERFACE))), True, 0)
    ]
    triggers = np.full((n, cycles, 2), np.nan)
    reseats = np.full((n, cycles), np.nan)
    resting = np.zeros((n, cycles, 3))
    start = np.zeros(n)
    base = _frictionless_deflection(mechanism, statics, d, threshold)
    reach = base + (np.maximum(0.01, 2.0 * base) if overtravel is None else overtravel)

    def deflection(u: FloatArray) -> FloatArray:
        return np.asarray(np.sum(u[:, TIP_FORCE] * d, axis=1))

    def step(
        target: FloatArray,
        loading: bool,
        number: int,
        by_force: bool = False,
        solved: _State | None = None,
    ) -> None:
        """One step; where a seat opens or the last one closes in it, find the place."""
        nonlocal state
        before, u_before = kept[-1][:2]
        origin = before.force if by_force else deflection(u_before)
        state = _solve(mechanism, before, d, target, by_force) if solved is None else solved
        kept.append((state, _displacements(mechanism, state, d), loading, number))
        lowest = _depth(mechanism, before, d).min(axis=1), _depth(mechanism, state, d).min(axis=1)
        crossing = (lowest[0] > level) & (lowest[1] <= level)
        crossing &= np.isnan(triggers[:, number, 0])
        if not loading:
            crossing = (lowest[0] <= level) & (lowest[1] > level)
        if np.any(crossing):
            place = _locate(mechanism, before, d, origin, target, level, crossing, by_force)
            there = deflection(_displacements(mechanism, place, d))
            if loading:
                triggers[crossing, number, 0] = place.force[crossing]
                triggers[crossing, number, 1] = there[crossing]
            else:
                reseats[crossing, number] = there[crossing]

    level = mechanism.coefficient * np.cbrt(threshold**2)
    for number in range(cycles):
        for fraction in np.linspace(0.0, 1.0, steps + 1)[1:]:
            step(start + fraction * (reach - start), True, number)
        shut = np.flatnonzero(np.isnan(triggers[:, number, 0]))
        if len(shut):
            raise PretravelError(
                f"friction {mechanism.friction:g} holds the rods: in {len(shut)} of {n} directions,"
                f" first at {describe(d[shut[0]])}, no seat opened up to a deflection of "
                f"{reach[shut[0]] * 1e3:.1f} um ({base[shut[0]] * 1e3:.1f} um without friction); "
                "raise the overtravel or lower the friction"
            )
        top = deflection(kept[-1][1])
        returning = np.ones(n, dtype=np.bool_)
        for fraction in np.linspace(0.0, 1.0, steps + 1)[1:-1]:
            # Each direction goes back until its force would be gone, and waits there.
            here, wanted = deflection(kept[-1][1]), top + fraction * (start - top)
            target = np.where(returning, wanted, here)
            trial = _solve(mechanism, state, d, target)
            going_on = returning & (trial.force > 0.0)
            if not np.any(going_on):
                break
            as_it_was = np.array_equal(going_on, returning)
            returning = going_on
            step(
                np.where(returning, wanted, here), False, number,
                solved=trial if as_it_was else None,
            )  # fmt: skip
        # The last of the force is taken off by force: where the tip then is, is the answer.
        held = state.force
        for fraction in np.linspace(0.0, 1.0, 11)[1:]:
            step((1.0 - fraction) * held, False, number, by_force=True)
        resting[:, number] = kept[-1][1][:, TIP_FORCE]
        start = deflection(kept[-1][1])
    displacements = np.stack([entry[1] for entry in kept], axis=1)
    return FrictionCycle(
        directions=frozen(d),
        friction=mechanism.friction,
        deflection=frozen(np.einsum("nti,ni->nt", displacements[:, :, TIP_FORCE], d)),
        force=frozen(np.stack([entry[0].force for entry in kept], axis=1)),
        reactions=frozen(np.stack([entry[0].normal for entry in kept], axis=1)),
        tangential=frozen(
            np.stack([entry[0].shear for entry in kept], axis=1).reshape(n, -1, 6, 2)
        ),
        displacement=frozen(displacements[:, :, TIP_FORCE]),
        loading=np.array([entry[2] for entry in kept]),
        cycle=np.array([entry[3] for entry in kept]),
        trigger_force=frozen(triggers[:, :, 0]),
        trigger_deflection=frozen(triggers[:, :, 1]),
        reseat_deflection=frozen(reseats),
        rest_displacement=frozen(resting),
    )


def _depth(mechanism: _Mechanism, state: _State, d: FloatArray) -> FloatArray:
    """How deep rods and balls are pressed together; negative is a gap, (n, 6). [mm]"""
    rest = mechanism.coefficient * np.cbrt(mechanism.rest[SEATS] ** 2)
    return np.asarray(rest - _displacements(mechanism, state, d)[:, SEATS])


def _locate(
    mechanism: _Mechanism,
    before: _State,
    d: FloatArray,
    origin: FloatArray,
    target: FloatArray,
    level: float,
    crossing: BoolArray,
    by_force: bool,
) -> _State:
    """The state within a step in which the shallowest seat is at the level, by bisection."""
    low, high = np.zeros(len(d)), np.ones(len(d))
    falling = _depth(mechanism, before, d).min(axis=1) > level
    for _ in range(_BISECTIONS):
        share = np.where(crossing, 0.5 * (low + high), 1.0)
        state = _solve(mechanism, before, d, origin + share * (target - origin), by_force)
        first_half = (_depth(mechanism, state, d).min(axis=1) > level) != falling
        high = np.where(first_half, share, high)
        low = np.where(first_half, low, share)
    return state


def _frictionless_deflection(
    mechanism: _Mechanism, statics: SeatStatics, d: FloatArray, threshold: float
) -> FloatArray:
    """Deflection at the frictionless trigger: the scale of the loading. [mm]"""
    unit = statics.unit_reactions(d)
    forces, _ = trigger_force(statics.rest_reactions, unit, threshold=threshold)
    if not np.all(np.isfinite(forces)):
        raise PretravelError(
            "a force along one of the directions presses every seat on: the probe never triggers"
        )
    reactions = np.maximum(statics.rest_reactions + forces[:, None] * unit, 0.0)
    indentation = mechanism.coefficient * (
        np.cbrt(reactions**2) - np.cbrt(statics.rest_reactions**2)
    )
    change = np.zeros((len(d), len(INTERFACE)))
    change[:, SEATS] = forces[:, None] * unit
    change[:, TIP_FORCE] = forces[:, None] * d
    elastic = change @ mechanism.flexibility
    rigid = -np.linalg.solve(statics.wrenches.T, (elastic[:, SEATS] + indentation).T).T
    tip = elastic[:, TIP_FORCE] + rigid @ mechanism.resultants[:, TIP_FORCE]
    return np.asarray(np.sum(tip * d, axis=1))
