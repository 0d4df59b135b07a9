"""One touch step by step, as the thesis takes it: spindle forward, tip along the surface.

`pretravel.probing.touching` finds the same end at once; here the way there is seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray, frozen
from pretravel.errors import ConvergenceError, PretravelError
from pretravel.model.hertz import curved_part_factor
from pretravel.probe.description import Probe
from pretravel.probing.tip import LateralTip, PredictedTip, tip_of
from pretravel.surface.contact import TANGENCY, Contact, ball_center, solve_contact
from pretravel.surface.local_geometry import LocalGeometry, Surface
from pretravel.surface.specification import face_of

PROCESSES = ("curved", "inclined", "vertical")
"""Section 3.4, 3.3 and 3.2 of the thesis."""
SEARCHES = ("steps", "golden")
KINEMATICS = ("lateral", "full")

_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
_SETTLED = 1e-12
_WALL = 0.01
"""Cosine between a wall's normal and the probe axis, at the most."""
_LARGEST_FORCE = 5.0
"""Upper bound of the thesis's golden section search. [N]"""


@dataclass(frozen=True, eq=False)
class SlideHistory:
    """What happened at each of k steps.

    Attributes
    ----------
    step : (k,) int
        From 1; for a golden section search the number of the trial.
    feed : (k,) float
        Travel of the spindle along the approach since first contact. [mm]
    deflection : (k,) float
        Of the stylus; for lateral kinematics across the probe axis. [mm]
    spindle : (k, 3) float
        P, where the tip centre were with the stylus straight. [mm]
    center : (k, 3) float
        C, the tip's centre. [mm]
    contact : (k, 3) float
        T. [mm]
    normal : (k, 3) float
        Of the surface at T.
    force : (k,) float
        Not a number beyond the trigger, where a seat is open. [N]
    reactions : (k, 6) float
        Of the seats; not numbers beyond the trigger. [N]
    triggered : (k,) bool
    trigger_feed : float
        Where between two steps the trigger falls, or the end of the search; not a number when it
        does not trigger. [mm]
    start : (3,) float
        First contact. [mm]
    search : str
        ``steps`` or ``golden``.
    """

    step: IntArray
    feed: FloatArray
    deflection: FloatArray
    spindle: FloatArray
    center: FloatArray
    contact: FloatArray
    normal: FloatArray
    force: FloatArray
    reactions: FloatArray
    triggered: BoolArray
    trigger_feed: float
    start: FloatArray
    search: str = "steps"

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            if isinstance(value, np.ndarray) and value.dtype == np.float64:
                object.__setattr__(self, entry.name, frozen(value))

    def __len__(self) -> int:
        return len(self.step)


def slide(
    tip: PredictedTip | Probe | str,
    surface: Surface | str,
    at: tuple[float, float],
    *,
    step: float | None = None,
    steps: int = 20,
    process: str = "curved",
    search: str = "steps",
    kinematics: str = "lateral",
) -> SlideHistory:
    """Probe one point of a surface along its normal, step by step.

    Parameters
    ----------
    tip : PredictedTip, Probe or str
        A description (or its name in the catalogue) is taken with model ``analytic``.
    surface : Surface or str
        Machine frame; a face of a part, or a specification as on the command line.
    at : pair of float
        Parameters u, v of the first contact.
    step : float
        Feed of each step for ``curved``, deflection for ``vertical``, 1 µm if not given
        [mm]; force for ``inclined``, 0.1 N if not given [N].
    steps : int
        How many; for a golden section search, how many trials at most.
    process : str
        ``curved``: sub-processes, in each of which the force keeps the direction of the
        normal before; the ray, tangency and force against deflection. ``vertical``:
        deflection is raised until the probe triggers. ``inclined``: force is raised.
    search : str
        ``steps``; or ``golden``: golden section between zero and 5 N (``inclined``) or
        between zero and step times steps (``vertical``).
    kinematics : str
        For ``curved``: ``lateral``, as in the thesis, where the stylus gives across its
        axis only and nothing is compressed; ``full``, with all that the model gives.

    Returns
    -------
    SlideHistory

    Raises
    ------
    PretravelError
        Words that are not known; a surface across the probe axis, on which a stylus that
        gives only sideways cannot give; a point outside the surface.

    References
    ----------
    Rodrigues 2021, sections 3.2 to 3.4 and 4.2; Tables 4.10 and 4.11.

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.probing.tip import predicted_tip
    >>> from pretravel.surface.parametric import Convex
    >>> history = slide(predicted_tip(load_probe("omp40-2")), Convex(), (0.5, 0.5), steps=2)
    >>> history.deflection.round(6).tolist()
    [0.003608, 0.007214]
    """
    if step is None:
        step = 0.1 if process == "inclined" else 0.001
    _check(step, steps, process, search, kinematics)
    described = tip_of(tip)
    if not isinstance(described, PredictedTip):
        raise PretravelError("a slide needs a described probe: a map does not know forces")
    tip, surface = described, face_of(surface)
    uv = np.array([at], dtype=np.float64)
    if not surface.inside(uv)[0]:
        low, high = surface.domain.lower, surface.domain.upper
        raise PretravelError(
            f"u, v = {at[0]:g}, {at[1]:g} is not on the surface: u goes from {low[0]:g} to "
            f"{high[0]:g}, v from {low[1]:g} to {high[1]:g}, less what its edges cut off"
        )
    first = surface.local(uv)
    if not np.all(np.isfinite(first.normal)):
        raise PretravelError(f"the surface has no normal at u, v = {at[0]:g}, {at[1]:g}")
    lateral = LateralTip(tip)
    if kinematics == "lateral" and not np.any(lateral.across(first.normal)):
        raise PretravelError(
            f"at u, v = {at[0]:g}, {at[1]:g} the surface lies across the probe axis: a stylus that "
            "gives only sideways cannot give there; --kinematics full lets it"
        )
    upright = abs(float(first.normal[0] @ lateral.axis))
    if process == "vertical" and upright > _WALL:
        polar = math.degrees(math.acos(upright))
        raise PretravelError(
            f"vertical is for walls; here the normal is {polar:.1f}° from the probe axis: take "
            "inclined or curved"
        )
    if process != "curved":
        return _one_normal(tip, first, step, steps, process, search)
    if kinematics == "full":
        return _curved_full(tip, surface, uv, first, step, steps)
    return _curved(lateral, surface, uv, first, step, steps)


def _check(step: float, steps: int, process: str, search: str, kinematics: str) -> None:
    for name, value, known in (
        ("process", process, PROCESSES),
        ("search", search, SEARCHES),
        ("kinematics", kinematics, KINEMATICS),
    ):
        if value not in known:
            raise PretravelError(f"{name} '{value}' is not known; there are {', '.join(known)}")
    if not (math.isfinite(step) and step > 0.0):
        raise PretravelError(f"the step is {step:g}; it must be above zero")
    if not 1 <= steps <= 100_000:
        raise PretravelError(f"{steps} steps; there can be 1 to 100000")
    if kinematics == "full" and process != "curved":
        raise PretravelError(
            f"{process} is the thesis's, where the stylus gives across its axis only; --kinematics "
            "full is for curved, which takes any surface"
        )
    if search == "golden" and process == "curved":
        raise PretravelError(
            "golden section is for vertical and inclined surfaces; on curved ones the force "
            "changes its direction from step to step"
        )


def _curved(
    tip: LateralTip,
    surface: Surface,
    uv: FloatArray,
    first: LocalGeometry,
    step: float,
    steps: int,
) -> SlideHistory:
    """Section 3.4: a ray from P along the last normal's projection, the ball tangent on it."""
    radius = tip.radius
    start = first.point + radius * first.normal
    into = -first.normal
    before = first
    rows, event = [], math.nan
    for k in range(1, steps + 1):
        spindle = start + k * step * into
        ray = tip.across(before.normal)
        contact = solve_contact(surface, uv, spindle, ray, ball_center(radius))
        _refuse_lost(contact, surface, k)
        uv = contact.uv
        deflection = float(contact.length[0])
        at_trigger = tip.state(before.normal)
        limit = float(np.linalg.norm(at_trigger.deflection))
        triggered = deflection >= limit
        if triggered and math.isnan(event):
            event = _event(surface, uv, start, into, radius, at_trigger.deflection)
        force = math.nan if triggered else _force_at(tip, before.normal, deflection)
        center = (spindle + deflection * ray)[0]
        rows.append(_Row(k * step, deflection, spindle[0], center, contact.local, force, triggered))
        before = contact.local
    return _history(tip.tip, rows, first, event)


def _curved_full(
    tip: PredictedTip,
    surface: Surface,
    uv: FloatArray,
    first: LocalGeometry,
    step: float,
    steps: int,
) -> SlideHistory:
    """As `_curved`, but the tip moves as the model says: in all directions, compressed."""
    radius = tip.radius
    start = first.point + radius * first.normal
    into = -first.normal
    factor = float(curved_part_factor(radius, first.principal_curvatures)[0])
    before, force, rows, event = first, 0.0, [], math.nan
    for k in range(1, steps + 1):
        spindle = start + k * step * into
        at_trigger = tip.state(before.normal)
        limit = float(at_trigger.force[0])
        contact, force, center = _full_step(
            tip, surface, uv, spindle, before.normal, force, factor, limit
        )
        _refuse_lost(contact, surface, k)
        uv = contact.uv
        deflection = float(np.linalg.norm(center - spindle[0]))
        triggered = force >= limit
        if triggered and math.isnan(event):
            height = radius - factor * float(at_trigger.approach[0])
            event = _event(surface, uv, start, into, height, at_trigger.deflection)
        known = math.nan if triggered else force
        rows.append(_Row(k * step, deflection, spindle[0], center, contact.local, known, triggered))
        before = contact.local
    return _history(tip, rows, first, event)


def _full_step(
    tip: PredictedTip,
    surface: Surface,
    uv: FloatArray,
    spindle: FloatArray,
    direction: FloatArray,
    force: float,
    factor: float,
    limit: float,
) -> tuple[Contact, float, FloatArray]:
    """Force along the last normal at which the deflected, compressed ball is tangent.

    Newton in the force: what the tip and its compression do with a little more of it is a line
    along which the contact is looked for.
    """
    response = tip.response
    normal, little = direction, 1e-6 * limit
    for _ in range(60):
        here = _tip_at(tip, direction, force)
        approach, ahead = factor * response.tip_approach(np.array([force, force + little]))
        along = _tip_at(tip, direction, force + little) - here + (ahead - approach) * normal
        speed = float(np.linalg.norm(along)) / little
        contact = solve_contact(
            surface,
            uv,
            spindle + here,
            along / (speed * little),
            ball_center(tip.radius - float(approach)),
        )
        # Force cannot be negative; at zero the law of Hertz has a vertical tangent.
        new = max(force + float(contact.length[0]) / speed, 0.1 * force, 1e-9)
        if not math.isfinite(new):
            break
        moved, force, uv, normal = abs(new - force), new, contact.uv, contact.local.normal
        if moved <= _SETTLED * limit:
            break
    return contact, force, (spindle + _tip_at(tip, direction, force))[0]


def _event(
    surface: Surface,
    uv: FloatArray,
    start: FloatArray,
    into: FloatArray,
    height: float,
    deflection: FloatArray,
) -> float:
    """Feed at which a tip deflected as at the trigger is tangent: where in its step it falls."""

    def reach(_rows: IntArray, local: LocalGeometry) -> FloatArray:
        return np.asarray(height * local.normal - deflection)

    return float(solve_contact(surface, uv, start, into, reach).length[0])


def _tip_at(tip: PredictedTip, direction: FloatArray, force: float) -> FloatArray:
    own = direction @ tip.rotation
    return np.asarray(tip.response.deflection(own, np.array([force])) @ tip.rotation.T)


def _force_at(tip: LateralTip, direction: FloatArray, deflection: float) -> float:
    """The force along a direction that gives a deflection across the axis."""
    from scipy.optimize import brentq

    limit = float(tip.tip.state(direction).force[0])

    def miss(force: float) -> float:
        moved = _tip_at(tip.tip, direction, force)
        sideways = moved - (moved @ tip.axis)[:, None] * tip.axis
        return float(np.linalg.norm(sideways)) - deflection

    return float(brentq(miss, 0.0, limit, xtol=1e-14 * limit, rtol=1e-14))


def _one_normal(
    tip: PredictedTip,
    first: LocalGeometry,
    step: float,
    steps: int,
    process: str,
    search: str,
) -> SlideHistory:
    """Sections 3.2, 3.3: one normal throughout; deflection or force is raised or searched."""
    lateral = LateralTip(tip)
    normal = first.normal
    state = lateral.state(normal)
    limit = float(np.linalg.norm(state.deflection))
    limit_force = float(state.force[0])
    by_force = process == "inclined"
    goal = limit_force if by_force else limit
    if search == "steps":
        values = step * np.arange(1, steps + 1)
        end = goal if values[-1] >= goal else math.nan
    else:
        highest = _LARGEST_FORCE if by_force else step * steps
        values, end = _golden_section(goal, highest, steps)
    across = lateral.across(normal)
    # Equation 3.2: across the axis the tip moves 1/sin(polar) times as far as the spindle.
    slope = float(np.linalg.norm(normal - (normal @ lateral.axis)[:, None] * lateral.axis))
    start = first.point + tip.radius * normal
    rows = []
    for value in values.tolist():
        triggered = value >= goal
        if not by_force:
            deflection = value
            force = math.nan if triggered else _force_at(lateral, normal, deflection)
        elif triggered:
            deflection, force = limit, math.nan
        else:
            moved = _tip_at(tip, normal, value)
            sideways = moved - (moved @ lateral.axis)[:, None] * lateral.axis
            deflection, force = float(np.linalg.norm(sideways)), value
        feed = deflection * slope
        spindle = (start - feed * normal)[0]
        center = spindle + deflection * across[0]
        local = LocalGeometry(center[None] - tip.radius * normal, normal, first.curvature)
        rows.append(_Row(feed, deflection, spindle, center, local, force, triggered))
    if math.isfinite(end) and search == "golden":
        # The search stops a little beyond the trigger: that little is its own error.
        limit *= end / goal
    event = limit * slope if math.isfinite(end) else math.nan
    return _history(tip, rows, first, event, search)


def _golden_section(goal: float, highest: float, trials: int) -> tuple[FloatArray, float]:
    """The thesis's search for the smallest value that triggers: trials in order, and the end.

    Of the two inner points one is asked for at a time; the interval shrinks to 0.618 of itself.
    """
    if highest < goal:
        raise ConvergenceError(
            f"the search goes up to {highest:g} and nothing triggers there (it takes {goal:.4g}); "
            "raise step or steps"
        )
    low, high = 0.0, highest
    asked: list[float] = []
    while len(asked) < trials and high - low > 1e-9 * highest:
        inner = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        asked.append(inner[0])
        if inner[0] >= goal:
            high = inner[0]
            continue
        low = inner[0]
        asked.append(inner[1])
        if inner[1] >= goal:
            high = inner[1]
        else:
            low = inner[1]
    return np.array(asked), high


def _refuse_lost(contact: Contact, surface: Surface, step: int) -> None:
    if contact.residual[0] > TANGENCY or not np.isfinite(contact.residual[0]):
        raise ConvergenceError(
            f"step {step}: the ball is not tangent to the surface anywhere on its way "
            f"({contact.residual[0]:.2g} mm are left); the steps may be too large"
        )
    if not surface.inside(contact.uv)[0]:
        raise PretravelError(f"step {step}: the tip has slid over the edge of the surface")


@dataclass(frozen=True, eq=False)
class _Row:
    """One step."""

    feed: float
    deflection: float
    spindle: FloatArray
    center: FloatArray
    local: LocalGeometry
    force: float
    triggered: bool


def _history(
    tip: PredictedTip,
    rows: list[_Row],
    first: LocalGeometry,
    trigger_feed: float,
    search: str = "steps",
) -> SlideHistory:
    normal = np.concatenate([row.local.normal for row in rows])
    force = np.array([row.force for row in rows])
    # The force of a step is along the normal before it.
    direction = np.concatenate([first.normal, normal[:-1]])
    return SlideHistory(
        step=np.arange(1, len(rows) + 1),
        feed=np.array([row.feed for row in rows]),
        deflection=np.array([row.deflection for row in rows]),
        spindle=np.array([row.spindle for row in rows]),
        center=np.array([row.center for row in rows]),
        contact=np.concatenate([row.local.point for row in rows]),
        normal=normal,
        force=force,
        reactions=tip.response.reactions(direction @ tip.rotation, force),
        triggered=np.array([row.triggered for row in rows]),
        trigger_feed=trigger_feed,
        start=first.point[0],
        search=search,
    )
