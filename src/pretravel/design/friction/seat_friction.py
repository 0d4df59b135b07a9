"""Hysteresis from Coulomb friction at the seats: load beyond the trigger, return, rest.

Without friction, seats obey statics, and loading and unloading follow one line. With friction
the tangential forces at the seats depend on history: the probe triggers later, reseats at
another place, and comes to rest elsewhere than it started.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    FRICTION,
    REAL,
    BoolArray,
    ConvergenceError,
    FloatArray,
    IntArray,
    PretravelError,
    checked,
    checked_unit,
    describe,
    frozen,
)
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.interface_loads import INTERFACE, SEATS, TIP_FORCE
from pretravel.design.friction.friction_equilibrium import (
    SeatMechanism,
    SeatState,
    equilibrium,
    seat_mechanism,
)
from pretravel.prediction import LARGEST_FRICTION, Probe, SeatStatics, seat_statics
from pretravel.six_seats import trigger_force

log = logging.getLogger(__name__)

USUAL_FRICTION = 0.2
"""Where a description has none: two measured probes require 0.1 to 0.27 (docs/validation.md)."""
LARGEST_OVERTRAVEL = 1.0
"""Beyond a millimetre the tripod turns too far for its equations. [mm]"""
MOST_STEPS = 1_000_000
"""Steps of all cycles and directions together that are kept: each is about a kilobyte."""
_LOCATED = 2.0**-24
"""Where a seat opens or closes: to this share of a step."""


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
    trigger_force, reseat_force : (n, cycles) float
        At which the first seat's load falls to the threshold, and at which the last open seat
        closes during the return. [N]
    trigger_displacement, reseat_displacement : (n, cycles, 3) float
        Of the tip there, from rest before the first cycle. [mm]
    tripod_displacement : (n, cycles, 3) float
        The part of the displacement at the trigger that is a rigid motion of the tripod: the
        seats give way. [mm]
    trigger_reactions : (n, cycles, 6) float
        Normal seat forces at the trigger. [N]
    rest_displacement : (n, cycles, 3) float
        Of the tip after the force is removed, from rest before the first cycle. [mm]
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
    reseat_force: FloatArray
    trigger_displacement: FloatArray
    reseat_displacement: FloatArray
    tripod_displacement: FloatArray
    trigger_reactions: FloatArray
    rest_displacement: FloatArray

    def _along_normals(self, displacement: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("nci,ni->nc", displacement, self.directions))

    @property
    def trigger_deflection(self) -> FloatArray:
        """Component of the displacement at the trigger along the normal, (n, cycles). [mm]"""
        return self._along_normals(self.trigger_displacement)

    @property
    def reseat_deflection(self) -> FloatArray:
        """Component of the displacement at reseating along the normal, (n, cycles). [mm]"""
        return self._along_normals(self.reseat_displacement)

    @property
    def hysteresis(self) -> FloatArray:
        """Deflection at opening less that at reseating, (n, cycles). [mm]

        Usually positive. Before the seats have settled, and where two open together, a seat
        may close again at a larger deflection.
        """
        return np.asarray(self.trigger_deflection - self.reseat_deflection)

    @property
    def zero_drift(self) -> FloatArray:
        """Component of the rest displacement along the normal, (n, cycles). [mm]

        Ren 2020: the drift of zero position.
        """
        return self._along_normals(self.rest_displacement)

    @property
    def reseat_error(self) -> FloatArray:
        """Distance of the tip's rest after the cycle from that before, (n, cycles). [mm]"""
        start = np.zeros_like(self.rest_displacement[:, :1])
        moved = np.diff(np.concatenate([start, self.rest_displacement], axis=1), axis=1)
        return np.asarray(np.linalg.norm(moved, axis=2))


def friction_cycle(
    probe: Probe,
    directions: npt.ArrayLike,
    friction: float,
    *,
    body: ReducedModel | str = "analytic",
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
    body : ReducedModel or str
        Elasticity of the moving part: ``rigid``; ``analytic``, a stylus that bends as a stepped
        beam on a rigid tripod; or finite elements.
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
    there are no tangential forces.

    References
    ----------
    R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; Ren 2020, section 2 (hysteresis, drift
    of zero position).

    >>> from pretravel.prediction.catalogue import load_probe
    >>> cycle = friction_cycle(load_probe("omp40-2"), [[1.0, 0.0, 0.0]], 0.0, steps=10)
    >>> round(float(cycle.trigger_force[0, 0]), 4), bool(abs(cycle.zero_drift[0, 0]) < 1e-9)
    (0.7498, True)
    """
    d = checked_unit(directions, "directions")
    check_conditions(probe, friction, overtravel, cycles, steps, len(d))
    statics = seat_statics(probe)
    mechanism = seat_mechanism(probe, statics, d, friction, body)
    base = _frictionless_deflection(mechanism, statics, probe.threshold)
    reach = base + (np.maximum(0.01, 2.0 * base) if overtravel is None else overtravel)
    history = _History(mechanism, cycles, probe.threshold)
    for number in range(cycles):
        log.info("cycle %d of %d", number + 1, cycles, extra={"done": number / cycles})
        start = history.deflection
        history.load(reach, number, steps)
        _check_opened(history, number, reach, base)
        history.unload(start, number, steps)
    return history.cycle()


def check_conditions(
    probe: Probe,
    friction: float,
    overtravel: float | None,
    cycles: int,
    steps: int,
    directions: int = 1,
) -> None:
    """Check the conditions of `friction_cycle`, before long work is done for them.

    Parameters
    ----------
    probe, friction, overtravel, cycles, steps
        As of `friction_cycle`.
    directions : int
        Their number.
    """
    checked(friction, "the friction at the seats", FRICTION, inputs=("friction",))
    if overtravel is not None:
        checked(overtravel, "the overtravel", REAL, inputs=("overtravel",))
    largest = min(LARGEST_FRICTION, 0.95 * math.tan(probe.seats.support_angle))
    if not (math.isfinite(friction) and 0.0 <= friction <= largest):
        raise PretravelError(
            f"the friction coefficient at the seats is {friction:g}; it must lie between 0 and "
            f"{largest:.3g} (polished carbide 0.1 to 0.2; beyond the tangent of the support angle "
            "rods jam between their balls)"
        )
    if overtravel is not None and not 0.0 < overtravel <= LARGEST_OVERTRAVEL:
        raise PretravelError(
            f"the overtravel is {overtravel:g} mm; it must be positive and at most "
            f"{LARGEST_OVERTRAVEL:g} mm"
        )
    if cycles < 1 or steps < 5:
        raise PretravelError(
            f"{cycles} cycles of {steps} steps are too few: at least 1 cycle of 5 steps is needed"
        )
    if 2 * cycles * steps * directions > MOST_STEPS:
        raise PretravelError(
            f"{cycles} cycles of {steps} steps, there and back, in {directions} "
            f"direction{'s' if directions > 1 else ''} are too many: every step is kept, and at "
            f"most {MOST_STEPS} steps fit (1 GB). After the first few cycles nothing changes",
            inputs=("cycles", "steps"),
        )
    probe.refuse_uneven("a cycle with friction")
    probe.refuse_tip_friction("a cycle with friction at the seats")
    if probe.criterion != "first_contact":
        raise PretravelError(
            f"cycles with friction determine when the first seat opens; the criterion "
            f"'{probe.criterion}' of [trigger] is not supported: make it 'first_contact'"
        )
    if probe.seats.contact != "hertz":
        raise PretravelError(
            "friction needs elastic seats: [seats] contact is 'rigid', make it 'hertz'"
        )


@dataclass(frozen=True, eq=False)
class _Step:
    state: SeatState
    loading: bool
    cycle: int


class _Events:
    """The states in which seats open or close: nan until it happens."""

    def __init__(self, directions: int, cycles: int) -> None:
        self.force = np.full((directions, cycles), np.nan)
        self.displacement = np.full((directions, cycles, 3), np.nan)
        self.of_tripod = np.full((directions, cycles, 3), np.nan)
        self.reactions = np.full((directions, cycles, 6), np.nan)

    def record(self, rows: BoolArray, cycle: int, place: SeatState, of_tripod: FloatArray) -> None:
        """Enter the states of some directions."""
        self.force[rows, cycle] = place.force
        self.displacement[rows, cycle] = place.moved[:, TIP_FORCE]
        self.of_tripod[rows, cycle] = of_tripod
        self.reactions[rows, cycle] = place.normal


class _History:
    """The steps of a run, with the events found in them: a seat opens, the last seat closes."""

    def __init__(self, mechanism: SeatMechanism, cycles: int, threshold: float) -> None:
        n = len(mechanism.directions)
        self.mechanism = mechanism
        self.level = mechanism.coefficient * np.cbrt(threshold**2)
        self.steps = [_Step(mechanism.at_rest, True, 0)]
        self.triggers, self.reseats = _Events(n, cycles), _Events(n, cycles)
        self.resting = np.zeros((n, cycles, 3))

    @property
    def state(self) -> SeatState:
        return self.steps[-1].state

    @property
    def deflection(self) -> FloatArray:
        return self.mechanism.deflection(self.state)

    def step(self, state: SeatState, *, loading: bool, cycle: int) -> None:
        """Append a state; where a seat opens or the last one closes on the way, locate it."""
        before = self.state
        self.steps.append(_Step(state, loading, cycle))
        margin = [self.opening_margin(self.mechanism, s) for s in (before, state)]
        if loading:
            crossing = (margin[0] > 0.0) & (margin[1] <= 0.0)
            crossing &= np.isnan(self.triggers.force[:, cycle])
        else:
            crossing = (margin[0] <= 0.0) & (margin[1] > 0.0)
        if not np.any(crossing):
            return
        mechanism = self.mechanism.rows(crossing)
        end = mechanism.deflection(state.rows(crossing))
        place = _located(mechanism, before.rows(crossing), end, self.opening_margin)
        events = self.triggers if loading else self.reseats
        of_tripod = place.rigid @ mechanism.resultants[:, TIP_FORCE]
        events.record(crossing, cycle, place, of_tripod)

    def opening_margin(self, mechanism: SeatMechanism, state: SeatState) -> FloatArray:
        """Smallest indentation of a seat less that at which the circuit opens, (n,). [mm]"""
        return np.asarray(mechanism.depth(state).min(axis=1) - self.level)

    def load(self, reach: FloatArray, cycle: int, steps: int) -> None:
        """Deflect the tip from where it is to `reach`."""
        start = self.deflection
        for fraction in np.linspace(0.0, 1.0, steps + 1)[1:]:
            target = start + fraction * (reach - start)
            state = equilibrium(self.mechanism, self.state, target)
            self.step(state, loading=True, cycle=cycle)

    def unload(self, end: FloatArray, cycle: int, steps: int) -> None:
        """Let the tip return, past `end` where needed, until its force vanishes."""
        top = self.deflection
        returning = np.arange(len(top))
        for fraction in np.arange(1, 2 * steps + 1) / steps:
            mechanism, before = self.mechanism.rows(returning), self.state.rows(returning)
            wanted = (top + fraction * (end - top))[returning]
            trial = equilibrium(mechanism, before, wanted)
            free = trial.force <= 0.0
            if np.any(free):
                rest = _located(
                    mechanism.rows(free), before.rows(free), wanted[free], lambda _, s: s.force
                )
                trial = trial.replaced(free, rest)
            self.step(self.state.replaced(returning, trial), loading=False, cycle=cycle)
            returning = returning[~free]
            if len(returning) == 0:
                break
        else:
            raise ConvergenceError(
                f"the force on the tip did not vanish on the return in {len(returning)} of "
                f"{len(top)} directions: take more steps, or less friction"
            )
        self.resting[:, cycle] = self.state.moved[:, TIP_FORCE]

    def cycle(self) -> FrictionCycle:
        """The whole history as a value."""
        d = self.mechanism.directions
        states = [step.state for step in self.steps]
        tip = np.stack([state.moved[:, TIP_FORCE] for state in states], axis=1)
        tangential = np.stack([state.tangential for state in states], axis=1)
        return FrictionCycle(
            directions=frozen(d),
            friction=self.mechanism.friction,
            deflection=frozen(np.einsum("nti,ni->nt", tip, d)),
            force=frozen(np.stack([state.force for state in states], axis=1)),
            reactions=frozen(np.stack([state.normal for state in states], axis=1)),
            tangential=frozen(tangential.reshape(len(d), -1, 6, 2)),
            displacement=frozen(tip),
            loading=np.array([step.loading for step in self.steps]),
            cycle=np.array([step.cycle for step in self.steps]),
            trigger_force=frozen(self.triggers.force),
            reseat_force=frozen(self.reseats.force),
            trigger_displacement=frozen(self.triggers.displacement),
            reseat_displacement=frozen(self.reseats.displacement),
            tripod_displacement=frozen(self.triggers.of_tripod),
            trigger_reactions=frozen(self.triggers.reactions),
            rest_displacement=frozen(self.resting),
        )


def _located(
    mechanism: SeatMechanism,
    before: SeatState,
    end: FloatArray,
    quantity: Callable[[SeatMechanism, SeatState], FloatArray],
) -> SeatState:
    """The state between `before` and the deflection `end` at which a quantity changes its sign."""
    from scipy.optimize.elementwise import find_root

    origin = mechanism.deflection(before)

    def state_at(share: FloatArray, rows: IntArray) -> SeatState:
        target = origin[rows] + share * (end - origin)[rows]
        return equilibrium(mechanism.rows(rows), before.rows(rows), target)

    def quantity_at(share: FloatArray, rows: IntArray) -> FloatArray:
        return quantity(mechanism.rows(rows), state_at(share, rows))

    every = np.arange(len(origin))
    found = find_root(
        quantity_at, (np.zeros(len(origin)), np.ones(len(origin))), args=(every,),
        tolerances={"xatol": _LOCATED, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0},
    )  # fmt: skip
    return state_at(np.where(found.success, found.x, 1.0), every)


def _check_opened(history: _History, cycle: int, reach: FloatArray, base: FloatArray) -> None:
    shut = np.flatnonzero(np.isnan(history.triggers.force[:, cycle]))
    if len(shut):
        d = history.mechanism.directions
        raise PretravelError(
            f"friction {history.mechanism.friction:g} holds the rods: in {len(shut)} of {len(d)} "
            f"directions, first at {describe(d[shut[0]])}, no seat opened up to a deflection of "
            f"{reach[shut[0]] * 1e3:.1f} um ({base[shut[0]] * 1e3:.1f} um without friction); "
            "raise the overtravel or lower the friction"
        )


def _frictionless_deflection(
    mechanism: SeatMechanism, statics: SeatStatics, threshold: float
) -> FloatArray:
    """Deflection at the frictionless trigger: the scale of the loading. [mm]"""
    d = mechanism.directions
    unit = statics.unit_reactions(d)
    forces, _ = trigger_force(statics.rest_reactions, unit, threshold=threshold)
    if not np.all(np.isfinite(forces)):
        raise PretravelError(
            "a force along one of the directions unloads no seat: the probe never triggers"
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
