"""The part of touches that the machine causes: what is subtracted, and what scatter it leaves.

The step of the latch, a drift of the reference and a memory of the push before are estimated from
the touches themselves. Drift and memory are subtracted; their uncertainty, and what cannot be
subtracted on a part, is scatter that repeats do not reduce.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, PretravelError
from pretravel.maps import Observation, QualificationSetup
from pretravel.qualification.first_touches import FirstTouches, first_touches
from pretravel.qualification.outliers import FEWEST_LEFT, repeat_outliers
from pretravel.qualification.sudden_changes import SuddenChange, sudden_change
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
_MOVED = 5.0 * MICROMETRE
"""A reference that is moved by hand lies farther away; less is a slip of its clamping or of an
axis, which is treated as a drift."""


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
        Standard deviation that all directions can have in common, by the step, by first touches
        that are apart and by a change of the level. [mm]
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
    observation, changed, apart, first, said = _of_one_state(observation, order)
    warnings += said
    noise = observation.repeats.deviation
    in_common = math.hypot(kept_by_directions(step, noise), apart)
    variance = sphere_form**2 / 12.0  # uniform between lowest and highest
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


def _of_one_state(
    observation: Observation, order: FloatArray
) -> tuple[Observation, FloatArray, float, FirstTouches | None, list[str]]:
    """Touches half way between two states, and what was subtracted for it.

    Returns
    -------
    observation : Observation
    change : (n,) float
        What was subtracted from the pretravel of each touch. [mm]
    apart : float
        Standard uncertainty that all directions have in common by it. [mm]
    first : FirstTouches or None
    warnings : list of str
    """
    warnings: list[str] = []
    first = first_touches(observation.values, observation.directions, observation.groups)
    changed, apart = np.zeros(len(order)), 0.0
    if first is not None:
        warnings.append(_first_warning(first))
        changed, apart = first.change, first.u_in_common
        observation = _changed(observation, changed)
    if drift_is_separable(observation.groups, order):
        found = sudden_change(observation.values, observation.directions, observation.groups)
        if found is not None and observation.repeats.deviation > _USUAL_NOISE:
            _refuse_moved_reference(found, len(order))
        if found is not None and found.level:
            warnings.append(_level_warning(found, len(order)))
            half_way = found.level * (np.asarray(order >= found.first, dtype=np.float64) - 0.5)
            changed, apart = changed + half_way, math.hypot(apart, 0.5 * found.level)
            observation = _changed(observation, half_way)
    return observation, changed, apart, first, warnings


def _drift(observation: Observation, order: FloatArray) -> tuple[FloatArray, FloatArray, list[str]]:
    """Movement of the reference, what is subtracted for it, and what to say of it."""
    groups, count = observation.groups, len(observation.groups)
    drift: FloatArray = np.zeros(3)
    change: FloatArray = np.zeros(count)
    warnings: list[str] = []
    if drift_is_separable(groups, order):
        found = estimated_drift(observation.values, observation.directions, groups, order)
        if found.p_value < DRIFT_LEVEL:
            drift = np.asarray(-found.value)
            change = drift_columns(observation.directions, order) @ found.value
            size = float(np.linalg.norm(drift)) / MICROMETRE
            warnings.append(
                f"the reference drifted by {size:.1f} µm against the machine during the touches; a "
                "steady drift was subtracted. Let the machine warm up"
            )
    return drift, change, warnings


def _refuse_moved_reference(found: SuddenChange, count: int) -> None:
    """Refuse touches of a reference that was moved in between, as by another clamping."""
    if float(np.linalg.norm(found.shift)) > _MOVED:
        x, y, z = found.shift / MICROMETRE
        raise PretravelError(
            f"from touch {found.first + 1} of {count} on, the reference lies ({x:+.1f}, {y:+.1f}, "
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


def _changed(observation: Observation, change: FloatArray) -> Observation:
    """The touches with a change of their pretravel subtracted."""
    moved = observation.directions * change[:, None]
    return replace(observation, positions=observation.positions + moved)


def _level_warning(found: SuddenChange, count: int) -> str:
    return (
        f"from touch {found.first + 1} of {count} on, the pretravel of all directions differs by "
        f"{found.level / MICROMETRE:+.1f} µm from that of the touches before. Another feed, "
        "another force or a changed probe explains this better than a drift of the reference. The "
        "map is half way between both states, and u of the tip's radius contains half of the "
        "difference. Give the feeds (column feed_mm_min), or qualify with the touches of one state"
    )


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
