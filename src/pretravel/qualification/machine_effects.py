"""The part of touches that the machine causes: what is subtracted, and what scatter it leaves.

The step of the latch, a drift of the reference and a memory of the push before are estimated from
the touches themselves. Drift and memory are subtracted; their uncertainty, and what cannot be
subtracted on a part, is scatter that repeats do not reduce.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, IntArray, PretravelError
from pretravel.maps import Observation, QualificationSetup
from pretravel.qualification.first_touches import FirstTouches, first_touches
from pretravel.qualification.outliers import FEWEST_LEFT, repeat_outliers
from pretravel.qualification.touch_order import (
    between_predecessors,
    drift_columns,
    drift_is_separable,
    estimated_drift,
    estimated_hysteresis,
    hysteresis_columns,
    predecessors,
    previous_directions,
)
from pretravel.qualification.two_states import TwoStates, logarithm_of_columns, two_states
from pretravel.qualification.within_directions import centred_within
from pretravel.touches import (
    Touches,
    coarse_warnings,
    kept_by_directions,
    kept_by_repeats,
    quantisation_step,
    refuse_coarse,
    step_of_touches,
)

DRIFT_LEVEL = 0.01
"""Probability that a drift is subtracted although there is none."""
_HYSTERESIS_LEVEL = 0.01
_HYSTERESES = {0.4 * MICROMETRE: 0.25, 1.0 * MICROMETRE: 0.10, 3.0 * MICROMETRE: 0.02}
"""Sizes of a hysteresis, with their shares of machines and probes; most have none."""
_USUAL_HYSTERESIS = 0.4 * MICROMETRE
_COMMON = sum(_HYSTERESES.values())
_LIKELY = 0.8
"""Probability of a hysteresis from which people are warned: u contains it below, too. Of 100 sets
without hysteresis 4 have more, of sets with 0.5 µm half, with 1 µm 99."""
_SURE = 0.95  # probability of a hysteresis from which it is subtracted
_NOISE_FLOOR = 1e-5 * MICROMETRE
_USUAL_NOISE = 0.5 * MICROMETRE
"""Repeats that scatter less do not hide two states that matter."""
_MOST_FOR_STATES = 2000
_STATES_BETTER = 4.0
"""Logarithm of the odds against other causes: of 900 sets without two states one has more, of
sets with two states 2 µm apart and noise of 0.3 µm half."""
_FEWEST_AFTER = 5
"""Touches before and after a change of the level."""
_BY_FAR = 10.0
"""Times what other courses leave: a step leaves a fifth of a wave."""
_MOVED = 5.0 * MICROMETRE
"""A reference that is moved by hand lies farther away; less is a slip of its clamping or of an
axis, which is treated as a drift."""
_MUCH_BETTER = 10.0
"""Logarithm of the odds from which a drift is not the cause: the first touch was chosen, too."""


@dataclass(frozen=True, eq=False)
class MachineEffects:
    """What the machine adds to the touches of a reference.

    Attributes
    ----------
    step : float
        Of the latched positions; zero where none is seen. [mm]
    step_scatter : float
        Standard deviation by the step that repeats do not reduce: their noise is below it. [mm]
    in_common : float
        Standard deviation that all directions can have in common, by the step and by first touches
        that are apart. [mm]
    drift : (3,) float
        Movement of the reference over the run that was subtracted, probe frame. [mm]
    hysteresis : (2,) float
        Expected movement of the tip's rest position by the push before, lateral and axial. [mm]
    fixed_scatter : float
        Standard deviation of a touch that repeats do not show, by hysteresis and form. [mm]
    change : (n,) float
        What was subtracted from the pretravel of each touch. [mm]
    warnings : tuple of str
    """

    step: float
    step_scatter: float
    in_common: float
    drift: FloatArray
    hysteresis: FloatArray
    fixed_scatter: float
    change: FloatArray
    warnings: tuple[str, ...]


def machine_effects(
    observation: Observation, machine_positions: FloatArray, sphere_form: float = 0.0
) -> MachineEffects:
    """Estimate what the machine adds to touches.

    Parameters
    ----------
    observation : Observation
        In the order in which the touches were made.
    machine_positions : (n, 3) float
        As they were latched, machine frame. [mm]
    sphere_form : float
        Deviation of the reference from its form, between highest and lowest point. [mm]

    Returns
    -------
    MachineEffects

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> n = np.repeat(sphere_pattern_25(), 2, axis=0)
    >>> positions = n * (15.49 + np.random.default_rng(1).normal(0.0, 1e-4, 50))[:, None]
    >>> seen = Observation(positions, np.repeat(np.arange(25), 2), np.zeros(3), 12.5, 3.0, False)
    >>> machine_effects(seen, positions).step
    0.0
    """
    groups, count = observation.groups, len(observation.groups)
    order = np.arange(count, dtype=np.float64)
    step = step_of_touches(machine_positions, observation.values, groups)
    warnings = coarse_warnings(step)
    first = first_touches(observation.values, observation.directions, groups)
    if first is not None:
        warnings.append(_first_warning(first))
        moved = observation.directions * first.change[:, None]
        observation = replace(observation, positions=observation.positions + moved)
    noise = observation.repeats.deviation
    in_common = kept_by_directions(step, noise)
    in_common = in_common if first is None else math.hypot(in_common, first.u_in_common)
    changed = np.zeros(count) if first is None else first.change
    variance = sphere_form**2 / 12.0  # uniform between lowest and highest
    if noise > _USUAL_NOISE and count <= _MOST_FOR_STATES and drift_is_separable(groups, order):
        _refuse_moved_reference(observation)
    states = _states(observation, order)
    if states is not None:
        seen = states.variance(observation.group_directions) - noise**2
        return MachineEffects(
            step=step,
            step_scatter=kept_by_repeats(step, noise),
            in_common=in_common,
            drift=np.zeros(3),
            hysteresis=np.zeros(2),
            fixed_scatter=math.sqrt(variance + max(seen, 0.0)),
            change=changed,
            warnings=(*warnings, _states_warning(states)),
        )
    drift, change, said = _drift(observation, order)
    warnings += said
    hysteresis, moments, probability = _memory(observation, change, order, first)
    before = previous_directions(observation.directions, predecessors(order))
    columns = hysteresis_columns(observation.directions, before)[:, :2]
    change = change + columns @ hysteresis
    between = between_predecessors(observation.values - change, groups, order)
    remaining = between.variance if between.p_value < _HYSTERESIS_LEVEL else 0.0
    variance += remaining
    if probability == _COMMON and between.warning:  # nothing was determined
        warnings.append(between.warning)
    if probability:
        sums = np.column_stack([np.bincount(groups, column) for column in columns.T])
        own = np.asarray(sums / np.bincount(groups)[:, None])
        left = moments - np.outer(hysteresis, hysteresis)
        variance += _scatter_by_memory(observation.group_directions, moments, own, left)
    warnings.extend(_memory_warnings(probability, hysteresis, moments))
    return MachineEffects(
        step=step,
        step_scatter=kept_by_repeats(step, noise),
        in_common=in_common,
        drift=drift,
        hysteresis=hysteresis,
        fixed_scatter=math.sqrt(variance),
        change=changed + change,
        warnings=tuple(warnings),
    )


def _drift(observation: Observation, order: FloatArray) -> tuple[FloatArray, FloatArray, list[str]]:
    """Movement of the reference, what is subtracted for it, and what to say of it."""
    groups, count = observation.groups, len(observation.groups)
    drift: FloatArray = np.zeros(3)
    change: FloatArray = np.zeros(count)
    warnings: list[str] = []
    if drift_is_separable(groups, order):
        found = estimated_drift(observation.values, observation.directions, groups, order)
        level = level_change(observation.values, observation.directions, groups)
        if found.p_value < DRIFT_LEVEL and level is not None:
            first, size = level[0], level[1] / MICROMETRE
            warnings.append(
                f"from touch {first + 1} of {count} on, the pretravel of all directions differs by "
                f"{size:+.1f} µm from that of the touches before. Another feed, another force or "
                "a changed probe explains this better than a drift of the reference. The map is "
                "between both states, and U does not contain half of the difference: give the "
                "feeds (column feed_mm_min), or qualify with the touches of one state"
            )
        elif found.p_value < DRIFT_LEVEL:
            drift = np.asarray(-found.value)
            change = drift_columns(observation.directions, order) @ found.value
            size = float(np.linalg.norm(drift)) / MICROMETRE
            warnings.append(
                f"the reference drifted by {size:.1f} µm against the machine during the touches; a "
                "steady drift was subtracted. Let the machine warm up"
            )
    return drift, change, warnings


def _refuse_moved_reference(observation: Observation) -> None:
    """Refuse touches of a reference that was moved in between, as by another clamping.

    Raises
    ------
    PretravelError
    """
    values, directions, groups = observation.values, observation.directions, observation.groups
    jump = reference_jump(values, directions, groups)
    if jump is not None and float(np.linalg.norm(jump[1])) > _MOVED:
        first, (x, y, z) = jump[0], jump[1] / MICROMETRE
        raise PretravelError(
            f"from touch {first + 1} of {len(values)} on, the reference lies ({x:+.1f}, {y:+.1f}, "
            f"{z:+.1f}) µm from where it lay before: it was moved, the tip rests elsewhere "
            "since, or these are touches of two days or clampings. Use the touches before or after "
            "this touch alone",
            inputs=("touches",),
        )


def _states(observation: Observation, order: FloatArray) -> TwoStates | None:
    """Two places in which the tip rests, where they explain repeats better than other causes."""
    values, directions, groups = observation.values, observation.directions, observation.groups
    if not observation.repeats.deviation > _USUAL_NOISE or len(values) > _MOST_FOR_STATES:
        return None
    found = two_states(values, directions, groups)
    if found is None:
        return None
    before = previous_directions(directions, predecessors(order))
    memory = hysteresis_columns(directions, before)[:, :2]
    steady = drift_columns(directions, order)
    both = np.hstack([memory, steady])
    others = [
        logarithm_of_columns(values, columns, groups)
        for columns in (memory[:, :0], memory, steady, both)
    ]
    return found if found.logarithm > max(others) + _STATES_BETTER else None


def _first_warning(first: FirstTouches) -> str:
    apart = first.apart / MICROMETRE
    return (
        f"the first touch of a direction has {abs(apart):.1f} µm "
        f"{'more' if apart > 0.0 else 'less'} pretravel than the touches after it in the same "
        "direction: this explains the repeats better than a hysteresis or a drift. Does a slide or "
        "a seat settle after a long move? The map is half way between both, and u of the tip's "
        "radius contains half of the difference. Discard the first touch of each place here and on "
        "the part, or repeat in passes, where all touches are first ones"
    )


def _states_warning(states: TwoStates) -> str:
    return (
        f"the tip rests in one of two places, {states.size / MICROMETRE:.1f} µm apart, "
        f"{states.share:.0%} of the touches in the rarer one: this explains the repeats better "
        "than a hysteresis, a drift or noise. Dirt or wear at a seat, or a loose stylus? The map "
        "is between both, and u of every point contains them as scatter. Clean the probe, and "
        "qualify again"
    )


def level_change(
    values: FloatArray, directions: FloatArray, groups: IntArray
) -> tuple[int, float] | None:
    """From which touch on all directions read more alike, where a drift explains that worse.

    A feed that was changed does this, or a probe that changed. Both are fitted within directions,
    and their residuals are compared, with the Bayesian information criterion.

    Parameters
    ----------
    values : (n,) float
        In the order of the touches. [mm]
    directions : (n, 3) float
    groups : (n,) int

    Returns
    -------
    first, size : int, float, or None
        The first touch that differs, and by how much. [mm]

    >>> n = np.tile([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]], (4, 1))
    >>> later = np.arange(20) >= 10
    >>> level_change(0.01 * later + 1e-5 * np.cos(np.arange(20) ** 2), n, np.tile(np.arange(5), 4))
    (10, 0.010001)
    """
    count = len(values)
    seen = centred_within(values, groups)
    steady = np.stack(
        [centred_within(c, groups) for c in drift_columns(directions, np.arange(count)).T], axis=1
    )
    by_drift = float(np.sum((seen - steady @ np.linalg.lstsq(steady, seen, rcond=None)[0]) ** 2))
    best = (math.inf, 0, 0.0)
    for first in range(_FEWEST_AFTER, count - _FEWEST_AFTER + 1):
        later = centred_within(np.arange(count) >= first, groups)
        square = float(later @ later)
        if square > 1.0:
            size = float(later @ seen) / square
            best = min(best, (float(np.sum((seen - size * later) ** 2)), first, size))
    if not best[1]:
        return None
    free = count - len(np.unique(groups))
    floor = free * _NOISE_FLOOR**2
    gain = 0.5 * free * math.log((by_drift + floor) / (best[0] + floor)) + 0.5 * math.log(count)
    return (best[1], round(best[2], 6)) if gain > _MUCH_BETTER else None


def reference_jump(
    values: FloatArray, directions: FloatArray, groups: IntArray
) -> tuple[int, FloatArray] | None:
    """From which touch on the reference lies elsewhere, where a drift or a level explains worse.

    Parameters
    ----------
    values : (n,) float
        Pretravel, in the order of the touches. [mm]
    directions : (n, 3) float
    groups : (n,) int

    Returns
    -------
    first, shift : int, (3,) float, or None
        The first touch on the moved reference, and its movement, probe frame. [mm]

    >>> n = np.tile([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]], (4, 1))
    >>> moved = -0.05 * n.sum(axis=1) * (np.arange(20) >= 7)
    >>> first, shift = reference_jump(moved, n, np.tile(np.arange(5), 4))
    >>> first, shift.round(4).tolist()
    (7, [0.05, 0.05, 0.05])
    """
    count = len(values)
    seen = centred_within(values, groups)

    def left(columns: FloatArray) -> tuple[float, FloatArray]:
        within = centred_within(columns, groups)
        found = np.asarray(np.linalg.lstsq(within, seen, rcond=None)[0], dtype=np.float64)
        return float(np.sum((seen - within @ found) ** 2)), found

    by_drift = min(
        left(drift_columns(directions, np.arange(count), slows=slows))[0] for slows in (False, True)
    )
    steps = range(_FEWEST_AFTER, count - _FEWEST_AFTER + 1)
    later = [np.arange(count) >= first for first in steps]
    if not later:
        return None
    by_level = min(left(each[:, None].astype(float))[0] for each in later)
    found = [left(directions * each[:, None]) for each in later]
    best = min(range(len(found)), key=lambda index: found[index][0])
    free = count - len(np.unique(groups))
    floor = free * _NOISE_FLOOR**2
    ratio = (min(by_drift, by_level) + floor) / (found[best][0] + floor)
    gain = 0.5 * free * math.log(ratio) - 1.5 * math.log(count)
    # Pretravel is smaller where the reference comes towards the tip.
    return (steps[best], -found[best][1]) if ratio > _BY_FAR and gain > _MUCH_BETTER else None


def without_machine(
    touches: Touches,
    observation: Observation,
    setup: QualificationSetup,
    rotation: FloatArray,
    *,
    latched: FloatArray | None = None,
) -> tuple[Touches, MachineEffects]:
    """Touches without what the machine adds, as far as it can be subtracted.

    Parameters
    ----------
    touches : Touches
        In the order in which they were made.
    observation : Observation
        Of the same touches.
    setup : QualificationSetup
    rotation : (3, 3) float
        Probe to machine frame, of the observation.
    latched : (n, 3) float, optional
        Positions as the machine latched them; those of the touches when not given. [mm]

    Returns
    -------
    Touches
    MachineEffects
        Estimated without gross errors.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.qualification.observe import observe
    >>> n = sphere_pattern_25()
    >>> touches, setup = Touches(n * 15.49, n), QualificationSetup(25.0, tip_diameter=6.0)
    >>> upright = np.eye(3)
    >>> seen = observe(touches, setup, upright)
    >>> without_machine(touches, seen, setup, upright)[0].positions.shape
    (25, 3)
    """
    positions = touches.positions if latched is None else latched
    step = quantisation_step(positions)
    source = f"{touches.source}: " if touches.source else ""
    refuse_coarse(step, f"{source}the touches do not show the pretravel of a probe")
    kept = np.ones(len(touches), dtype=bool)
    if setup.search_outliers:
        wrong = repeat_outliers(observation, touches.where, step)
        kept[[row for outlier in wrong for row in outlier.rows]] = False
    if kept.mean() < FEWEST_LEFT:
        kept[:] = True
    part = observation if kept.all() else observation.take(kept)
    effects = machine_effects(part, positions[kept], setup.sphere_form)
    change = np.zeros(len(kept))
    change[kept] = effects.change
    if not change.any():
        return touches, replace(effects, change=change)
    moved = (observation.directions * change[:, None]) @ rotation.T
    corrected = replace(touches, positions=touches.positions + moved)
    return corrected, replace(effects, change=change)


def _memory_warnings(probability: float, expected: FloatArray, moments: FloatArray) -> list[str]:
    """What people must know of a hysteresis that is likely."""
    if probability > _SURE:
        return [
            (
                f"hysteresis of about {float(np.abs(expected).max()) / MICROMETRE:.1f} µm: touches "
                "depend on the direction of the touch before. It is subtracted here, and adds to u "
                "of every point on a part"
            )
        ]
    if probability > _LIKELY:
        size = math.sqrt(float(np.diag(moments).max()) / probability) / MICROMETRE
        return [
            (
                "touches may depend on the direction of the touch before: a hysteresis of about "
                f"{size:.1f} µm has a probability of {probability:.0%}. Repeat in passes, each in "
                "another order, to find out"
            )
        ]
    return []


def _memory(
    observation: Observation,
    change: FloatArray,
    order: FloatArray,
    first: FirstTouches | None = None,
) -> tuple[FloatArray, FloatArray, float]:
    """Expected memory of the push before, (2,), its second moments, (2, 2), and its probability.

    A memory of zero is likely in advance; the estimate is taken as far as it speaks against that.
    """
    nothing = np.zeros(2), np.zeros((2, 2)), 0.0
    if len(observation.groups) - observation.direction_count < 6:
        return nothing
    values, beside = observation.values - change, None if first is None else first.first[:, None]
    found = estimated_hysteresis(values, observation.directions, observation.groups, order, beside)
    known = np.asarray(found.determined)
    if not known.any():
        return np.zeros(2), _COMMON * _USUAL_HYSTERESIS**2 * np.eye(2), _COMMON
    value, count = found.value[known], int(known.sum())
    own = found.covariance[np.ix_(known, known)] + _NOISE_FLOOR**2 * np.eye(count)
    nothing_there = math.log(1.0 - sum(_HYSTERESES.values())) + _log_density(value, own)
    logarithms, means, seconds = [nothing_there], [np.zeros(count)], [np.zeros((count, count))]
    for size, weight in _HYSTERESES.items():
        prior = size**2 * np.eye(count)
        gain = prior @ np.linalg.inv(own + prior)
        mean = gain @ value
        logarithms.append(math.log(weight) + _log_density(value, own + prior))
        means.append(mean)
        seconds.append(np.outer(mean, mean) + prior - gain @ prior)
    weights = np.exp(np.array(logarithms) - max(logarithms))
    weights /= weights.sum()
    share = float(1.0 - weights[0])
    expected, moments = np.zeros(2), np.zeros((2, 2))
    # In doubt nothing is subtracted: the estimate would add its noise to every touch.
    if share > _SURE:
        expected[known] = weights @ np.array(means)
    moments[np.ix_(known, known)] = np.tensordot(weights, np.array(seconds), 1)
    return expected, moments, share


def _log_density(value: FloatArray, covariance: FloatArray) -> float:
    """Of a normal distribution about zero, without its constant."""
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), value)
    return -0.5 * float(whitened @ whitened + np.linalg.slogdet(covariance)[1])


def _scatter_by_memory(
    directions: FloatArray, moments: FloatArray, own: FloatArray, left: FloatArray
) -> float:
    """Mean square by which a touch after one in any other direction differs from the map. [mm²]

    The map contains the memory of the touches that it was made of, as far as it was not
    subtracted: in a row of repeats most of them follow a touch in the same direction.

    Parameters
    ----------
    directions : (g, 3) float
    moments, left : (2, 2) float
        Second moments of the memory, and of what was not subtracted of it. [mm²]
    own : (g, 2) float
        Mean columns of the touches of each direction.
    """
    # The columns are products of components of two directions, and so are the means over pairs
    # products of the mean products of components: all pairs in one small matrix.
    squares = (directions.T @ directions / len(directions)) ** 2
    lateral = float(squares[:2, :2].sum())
    mixed = float(squares[:2, 2].sum())
    any_before = float(
        moments[0, 0] * lateral + 2.0 * moments[0, 1] * mixed + moments[1, 1] * squares[2, 2]
    )
    mean_before = hysteresis_columns(directions, directions.mean(axis=0))[:, :2]
    in_map = np.sum((own - 2.0 * mean_before) @ left * own, axis=1)
    return any_before + float(np.mean(in_map))
