"""Test whether a probe has changed since it was qualified, with a stated false-alarm rate."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import (
    MICROMETRE,
    PROBABILITY,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    checked,
    describe,
    range_text,
)
from pretravel.maps import (
    MapLike,
    PretravelMap,
    QualificationSetup,
    as_map,
    refuse_other_orientation,
    stated_by_one,
)
from pretravel.qualification.change_causes import Cause, LikelyCause, likely_causes
from pretravel.qualification.change_tests import (
    Change,
    ChangeTests,
    TouchesAndMap,
    changes_of,
    touches_and_map,
)
from pretravel.qualification.machine_effects import without_machine
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import Outlier, median_of_groups, triggered
from pretravel.qualification.own_touches import own_touches_warnings, refuse_table
from pretravel.qualification.unseen_turn import UnseenTurn, unseen_turn
from pretravel.touches import (
    Touches,
    TouchesLike,
    as_touches,
    quantisation_step,
    repeat_step,
)

_MOST_GROSS = 0.1
"""Share of the touches that can be left out as gross errors; more of them are a change."""
_FINE_STEP = 0.3
"""A step below this share of the map's repeatability does not matter."""


_OF_ONE_DIRECTION = 10.0
"""Nine directions over the half sphere have 3 to 5, up to polar 60° 7, 45° 15, 30° 36 and more."""


@dataclass(frozen=True, eq=False)
class Verification:
    """New touches on the reference, compared with a map.

    Attributes
    ----------
    changed : bool
        Whether any of the three tests finds a change, without the touches in `gross`.
    false_alarm_rate : float
        Probability that an unchanged probe is reported as changed, all tests together.
    p_form, p_map, p_repeatability : float
        Of the tests: size, amplitude and turn together; all directions together; scatter of
        repeats (nan without repeats).
    size, amplitude, turn : Change
        Pretravel in all directions alike [mm]; of the map's variation, as a share; about the
        probe's axis [rad].
    causes : tuple of LikelyCause
        Of a change, the most probable first; none without a change.
    gross : tuple of Outlier
        Touches that were left out.
    changed_with_gross : bool
        The verdict if they are not left out.
    repeatability : float
        Of the new touches; nan without repeats. [mm]
    repeatability_dof : float
        Heavy tails and differences between the directions reduce it.
    step : float
        In which the positions come, if it matters; zero else. [mm]
    largest : float
        Largest difference of a direction's mean from the map, centre fitted. [mm]
    directions : (g, 3) float
        Probe frame.
    differences, u_differences : (g,) float
        Mean pretravel minus map, and its standard uncertainty. [mm]
    touches : int
    warnings : tuple of str
    touches_digest : str
        See `Touches.digest`.
    unseen_turn : UnseenTurn, optional
        Where nothing changed: a turn of the probe that these directions cannot show.
    """

    changed: bool
    false_alarm_rate: float
    p_form: float
    p_map: float
    p_repeatability: float
    size: Change
    amplitude: Change
    turn: Change
    causes: tuple[LikelyCause, ...]
    gross: tuple[Outlier, ...]
    changed_with_gross: bool
    repeatability: float
    repeatability_dof: float
    step: float
    largest: float
    directions: FloatArray
    differences: FloatArray
    u_differences: FloatArray
    touches: int
    warnings: tuple[str, ...]
    touches_digest: str = ""
    unseen_turn: UnseenTurn | None = None

    @property
    def size_is_unseen(self) -> bool:
        """Whether nothing changed, but a change of size looks like a shift of the reference.

        So it is of directions that lie close together, as those of a log that breaks off: the size
        is `_OF_ONE_DIRECTION` times as uncertain as the difference in one direction, or more.
        """
        of_one = float(np.median(self.u_differences))
        return not self.changed and not self.size.u <= _OF_ONE_DIRECTION * of_one


def verify(
    touches: TouchesLike,
    pretravel_map: MapLike,
    diameter: float,
    *,
    ring: bool = False,
    false_alarm_rate: float = 0.01,
) -> Verification:
    """Test whether a probe has changed since its map was made.

    Parameters
    ----------
    touches : Touches, str, Path or (n, 6) float
        New touches on the reference, which may stand anywhere.
    pretravel_map : PretravelMap, Qualification, str or Path
        Qualified, of the same tip, at the same feed (or with its signal delay separated).
    diameter : float
        Of the reference, that of the qualification. [mm]
    ring : bool
    false_alarm_rate : float
        For all tests together.

    Returns
    -------
    Verification

    Raises
    ------
    PretravelError
        A map without an uncertainty of its own, of a kind that does not follow the probe, of
        another feed; touches that are too few, or in directions outside the map.

    Notes
    -----
    The centre of the reference is fitted, so that a shift of it does not count. Three tests each
    take a third of the false-alarm rate: generalised least squares of the mean touches of each
    direction on size, amplitude and turn; their whole difference from the map; the variance of
    repeats (two-sided). The noise is that of the touches: by direction where the directions
    differ, with the degrees of freedom that heavy tails leave, and with q²/12 of a step q that
    repeats do not reduce.

    Touches far outside their noise are left out one at a time, and named.
    """
    touches = as_touches(touches, reference_diameter=diameter, ring=ring)
    pretravel_map = as_map(pretravel_map)
    _refuse_rate(false_alarm_rate)
    compared = touches_beside_map(touches, pretravel_map, diameter, ring=ring)
    tests = changes_of(compared.kept, false_alarm_rate)
    gross = compared.gross
    with_gross = changes_of(compared.all, false_alarm_rate).changed if gross else tests.changed
    consequence = "a map always agrees with its own touches. Touch the reference again"
    warnings = compared.feed_warnings
    warnings += tuple(own_touches_warnings(touches, pretravel_map, consequence))
    warnings += compared.machine_warnings
    unseen = None if tests.changed else unseen_turn(compared.kept, pretravel_map, false_alarm_rate)
    result = _result(
        compared.kept,
        tests,
        causes=likely_causes(compared.kept, pretravel_map) if tests.changed else (),
        gross=gross,
        changed_with_gross=with_gross,
        touches=len(touches),
        warnings=(*warnings, *_gross_warnings(gross, tests.changed, with_gross)),
    )
    return replace(result, touches_digest=touches.digest, unseen_turn=unseen)


@dataclass(frozen=True, eq=False)
class TouchesBesideMap:
    """New touches compared with a map, with and without those that are grossly wrong.

    Attributes
    ----------
    all, kept : TouchesAndMap
    gross : tuple of Outlier
        What `kept` is without.
    feed_warnings, machine_warnings : tuple of str
    """

    all: TouchesAndMap
    kept: TouchesAndMap
    gross: tuple[Outlier, ...]
    feed_warnings: tuple[str, ...]
    machine_warnings: tuple[str, ...]


def touches_beside_map(
    touches: Touches, pretravel_map: PretravelMap, diameter: float, *, ring: bool = False
) -> TouchesBesideMap:
    """Compare new touches with a map, at rest, without the machine's part and gross errors.

    Parameters
    ----------
    touches : Touches
    pretravel_map : PretravelMap
    diameter : float
        Of the reference. [mm]
    ring : bool

    Raises
    ------
    PretravelError
        As `verify`.
    """
    touches.refuse_several(one_reference=True)
    refuse_unverifiable(pretravel_map)
    refuse_other_orientation(touches, pretravel_map)
    conditions = stated_by_one(touches, pretravel_map)
    conditions += _feed_warnings(touches, pretravel_map)
    touches = pretravel_map.without_machine(touches)
    setup = QualificationSetup(diameter, 2.0 * pretravel_map.tip_radius, ring)
    u_size, said = other_reference(setup, pretravel_map)
    conditions += said
    rotation = pretravel_map.rotation
    touches, effects = without_machine(touches, observe(touches, setup, rotation), setup, rotation)
    new = _NewTouches(touches, pretravel_map, setup, u_size)
    everything = new.compared(np.ones(len(touches), dtype=bool))
    kept, gross = new.without_gross(everything)
    return TouchesBesideMap(everything, kept, gross, tuple(conditions), tuple(effects.warnings))


def _result(
    compared: TouchesAndMap,
    tests: ChangeTests,
    *,
    causes: tuple[LikelyCause, ...],
    gross: tuple[Outlier, ...],
    changed_with_gross: bool,
    touches: int,
    warnings: tuple[str, ...],
) -> Verification:
    repeats = compared.scatter_of_touches
    return Verification(
        changed=tests.changed,
        false_alarm_rate=tests.false_alarm_rate,
        p_form=tests.p_form,
        p_map=tests.p_map,
        p_repeatability=tests.p_repeatability,
        size=tests.size,
        amplitude=tests.amplitude,
        turn=_turn(tests.turn, causes),
        causes=causes,
        gross=gross,
        changed_with_gross=changed_with_gross,
        repeatability=repeats.deviation if repeats.dof > 0.0 else math.nan,
        repeatability_dof=repeats.dof,
        step=compared.step,
        largest=tests.largest,
        directions=compared.observation.group_directions,
        differences=tests.differences,
        u_differences=np.sqrt(np.diagonal(compared.covariance)),
        touches=touches,
        warnings=warnings,
    )


@dataclass(frozen=True, eq=False)
class _NewTouches:
    """New touches, at rest, and the map that they are compared with."""

    touches: Touches
    pretravel_map: PretravelMap
    setup: QualificationSetup
    u_size: float = 0.0
    """Of the radii of two references. [mm]"""

    def compared(self, kept: BoolArray) -> TouchesAndMap:
        """Those of a mask, compared with the map."""
        part = self.touches.take(np.flatnonzero(kept))
        observation = observe(part, self.setup, self.pretravel_map.rotation)
        step = max(
            quantisation_step(part.positions),
            repeat_step(observation.values, observation.groups),
        )
        if step < _FINE_STEP * self.pretravel_map.repeatability:
            step = 0.0
        return touches_and_map(observation, self.pretravel_map, step, self.u_size)

    def without_gross(self, compared: TouchesAndMap) -> tuple[TouchesAndMap, tuple[Outlier, ...]]:
        """Touches and map without gross errors, and the gross errors; too many are kept."""
        current, found = compared, list[Outlier]()
        kept = np.ones(len(self.touches), dtype=bool)
        while (worst := gross_touch(self.touches, current, np.flatnonzero(kept))) is not None:
            found.append(worst)
            kept[list(worst.rows)] = False
            if len(found) > max(_MOST_GROSS * len(kept), 1.0):
                return compared, ()
            current = self.compared(kept)
        return current, tuple(found)


def _turn(linear: Change, causes: tuple[LikelyCause, ...]) -> Change:
    """The turn by its best angle where it is a likely cause: the slope of a map ends at lobes."""
    for cause in causes:
        if cause.name == Cause.TURNED and cause.mentioned:
            return replace(linear, value=cause.value, u=cause.u)
    return linear


def _gross_warnings(gross: tuple[Outlier, ...], changed: bool, with_gross: bool) -> list[str]:
    if not gross:
        return []
    word = {True: "changed", False: "no change"}
    verdict = (
        f"the verdict is the same with {'this touch' if len(gross) == 1 else 'these touches'}"
        if changed == with_gross
        else f"without {'this touch' if len(gross) == 1 else 'these touches'} the verdict is: "
        f"{word[changed]}; with: {word[with_gross]}. Touch there again"
    )
    return [*(f"{outlier.message}. It was left out" for outlier in gross), verdict]


def _refuse_rate(false_alarm_rate: float) -> None:
    checked(false_alarm_rate, "the false-alarm rate", PROBABILITY, inputs=("false_alarms",))
    if not 0.0 < false_alarm_rate < 0.5:
        raise PretravelError(
            f"the false-alarm rate is {false_alarm_rate:g}; it must lie between 0 and 0.5 (0.01 "
            "is usual)",
            inputs=("false_alarm_rate", "false_alarms"),
        )


def refuse_unverifiable(pretravel_map: PretravelMap) -> None:
    """Refuse a map that new touches cannot be compared with.

    Raises
    ------
    PretravelError
        It states no uncertainty of its own, is a table, or of a kind that does not follow the
        probe.
    """
    if not pretravel_map.states_uncertainty:
        raise PretravelError(
            "this map has no uncertainty (a prediction, or a table), so there is no limit "
            "beyond which a difference is a change; use a map of pretravel qualify"
        )
    refuse_table(pretravel_map)
    if not pretravel_map.basis.follows_probe:
        raise PretravelError(
            f"a map of kind {pretravel_map.kind} does not follow the probe closely enough: the "
            "part of pretravel that it does not represent would look like a change. Qualify with "
            "kind harmonic or physical"
        )


def other_reference(
    setup: QualificationSetup, pretravel_map: PretravelMap
) -> tuple[float, list[str]]:
    """Standard uncertainty of sizes by the radii of two references, and a sentence about it.

    Parameters
    ----------
    setup : QualificationSetup
        Of the new touches.
    pretravel_map : PretravelMap

    Returns
    -------
    u : float
        In pretravel; zero on references of one diameter, which are one: its error is in both. [mm]
    said : list of str
    """
    made = pretravel_map.provenance.setup
    if made is None or (made.diameter, made.ring) == (setup.diameter, setup.ring):
        return 0.0, []
    u = 0.5 * math.hypot(made.u_reference_diameter, setup.u_reference_diameter)
    said = (
        f"these touches are on a {setup.reference} of {setup.diameter:.6g} mm, the map was made on "
        f"a {made.reference} of {made.diameter:.6g} mm: u of the size contains the u of both "
        f"diameters, {u / MICROMETRE:.2g} µm in pretravel. If it is the same reference, give one "
        "diameter: then its error cancels"
    )
    return u, [said]


def _feed_warnings(touches: Touches, pretravel_map: PretravelMap) -> list[str]:
    if pretravel_map.delay is not None or (pretravel_map.feed is None and touches.feeds is None):
        return []
    if pretravel_map.feed is None:
        return [
            (
                "the map does not state the feed of its touches: if it was another one than that "
                "of these touches, this looks like a change of size. Qualify with the feed"
            ),
        ]
    if touches.feeds is None:
        return [
            (
                "the touches do not give their feed; another feed than that of the map "
                f"({pretravel_map.feed:g} mm/min) looks like a change of size"
            ),
        ]
    if np.any(np.abs(touches.feeds / pretravel_map.feed - 1.0) > 0.01):
        raise PretravelError(
            f"the map was made at {pretravel_map.feed:g} mm/min, these touches at "
            f"{range_text(touches.feeds.min(), touches.feeds.max())}: feed × signal delay would "
            "look like a change. Touch at the map's feed, or qualify at two feeds"
        )
    return []


_LEVEL = 0.001
"""Probability that any touch is named although all are good."""
_HEAVY_TAILS = 1.5
"""Factor on the limits: touches have heavier tails than a normal distribution."""
_FEWEST_OTHERS = 3
"""Directions that remain beyond those that centre, size, amplitude and turn take."""


def gross_touch(touches: Touches, compared: TouchesAndMap, rows: IntArray) -> Outlier | None:
    """The touch that disagrees most with the others and the map, if noise does not explain it.

    A touch among three or more of its direction is compared with their median. Where a direction
    was touched once or twice, the map decides which touch is wrong, with size, amplitude and turn
    fitted to the other directions. Repeats that agree with each other are never named: that is a
    change, or dirt on the reference.

    Parameters
    ----------
    touches : Touches
    compared : TouchesAndMap
        Those of them that are compared with the map.
    rows : (n,) int
        Their rows in `touches`.
    """
    observation, step = compared.observation, compared.step
    values, groups = observation.values, observation.groups
    counts = np.bincount(groups)
    factor = _factor(len(values))
    median = median_of_groups(values, groups)
    among = values - median[groups]
    scatter = _robust_scatter(among, groups, compared)
    limit = max(factor * scatter, 1.5 * step)
    from_map, u_from_map = _left_out(compared, values, scatter)
    many, single = counts[groups] > 2, counts[groups] == 1
    pair = ~many & ~single
    map_limit = np.maximum(factor * u_from_map, 1.5 * step)
    excess = np.where(many, np.abs(among) / limit, 0.0)
    excess = np.where(single, np.abs(from_map) / map_limit, excess)
    apart = np.where(pair, 2.0 * np.abs(among) / (math.sqrt(2.0) * limit), 0.0)
    excess = np.where(pair, apart * _farther(np.abs(from_map), groups), excess)
    worst = int(np.argmax(excess))
    if excess[worst] <= 1.0:
        return None
    distance, allowed, base = from_map[worst], map_limit[worst], "the map"
    if not single[worst]:
        distance, allowed = (2.0 if pair[worst] else 1.0) * among[worst], limit
        base = (
            "the other touch"
            if pair[worst]
            else f"the median of the {counts[groups[worst]]} touches"
        )
        base += " of its direction"
    return Outlier(
        (int(rows[worst]),),
        float(distance),
        float(allowed),
        f"{touches.where(int(rows[worst]))} at {describe(observation.directions[worst])} "
        f"{triggered(float(distance))} {base}; noise explains "
        f"{allowed / MICROMETRE:.1f} µm",
    )


def _factor(count: int) -> float:
    from scipy.special import ndtri

    return _HEAVY_TAILS * -float(ndtri(_LEVEL / (2.0 * count)))


def _farther(distance: FloatArray, groups: IntArray) -> FloatArray:
    """One for the touch of each direction that is farthest away, zero for the others."""
    largest = np.zeros(int(groups.max()) + 1)
    np.maximum.at(largest, groups, distance)
    return np.where(distance >= largest[groups], 1.0, 0.0)


def _robust_scatter(among: FloatArray, groups: IntArray, compared: TouchesAndMap) -> float:
    """Of a touch, from the directions' median variances; at least that of the map. [mm]"""
    from scipy.special import gammaincinv

    counts = np.bincount(groups)
    free = counts - 1
    repeated = free > 0
    known = compared.scatter_of_map.deviation
    if not np.any(repeated):
        return known
    mean = np.bincount(groups, among) / counts
    squares = np.bincount(groups, (among - mean[groups]) ** 2)[repeated]
    expected = np.median(2.0 * gammaincinv(0.5 * free[repeated], 0.5))
    return max(math.sqrt(float(np.median(squares) / expected)), known)


def _left_out(
    compared: TouchesAndMap, values: FloatArray, scatter: float
) -> tuple[FloatArray, FloatArray]:
    """Distance of each touch from the map fitted to the other directions, and its u. [mm]"""
    design, y = compared.design, compared.differences
    groups = compared.observation.groups
    apart = values - compared.value[groups]
    if len(y) < design.shape[1] + _FEWEST_OTHERS:
        return np.zeros(len(values)), np.full(len(values), math.inf)
    inverse = np.linalg.inv(compared.covariance)
    seen = inverse @ design
    weights = inverse - seen @ np.linalg.pinv(design.T @ seen, hermitian=True) @ seen.T
    own = np.diagonal(weights)
    usable = own > 1e-6 * np.diagonal(inverse)
    safe = np.where(usable, own, 1.0)
    expected = y - weights @ y / safe
    variance = np.where(usable, 1.0 / safe, math.inf)
    noise = compared.noise.variances / compared.noise.counts
    single = np.maximum(variance - noise, 0.0) + scatter**2
    return apart - expected[groups], np.sqrt(single)[groups]
