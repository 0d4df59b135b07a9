"""An old map and a few new touches on the reference make a map of today."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    FloatArray,
    IntArray,
    PretravelError,
    describe,
    frozen,
    probe_rotation,
    range_text,
)
from pretravel.maps import (
    Observation,
    Origin,
    PretravelMap,
    QualificationSetup,
    Scatter,
    refuse_other_orientation,
    stated_by_one,
)
from pretravel.qualification.delay import several_feeds, travel_per_second
from pretravel.qualification.observe import observe
from pretravel.qualification.own_touches import own_touches_warnings, touch_digests
from pretravel.qualification.probe_drift import (
    DRIFT_OF_REFERENCE,
    LARGE_TURN,
    DriftedMap,
    ProbeDrift,
    drifted_map,
    possible_drifts,
    spread_of,
)
from pretravel.qualification.touch_order import drift_columns
from pretravel.qualification.unseen_turn import unseen_in
from pretravel.qualification.verification import other_reference
from pretravel.touches import Touches
from pretravel.uncertainty import Covariance

MOST_TOUCHES = 2000
"""With more touches the covariances of all their pairs need more than a gigabyte."""
REFUSED_FIT = 1e-4
"""Touches with a smaller probability than this do not belong to the old map and its drift."""
DOUBTFUL_FIT = 0.01
"""Touches with a smaller probability than this are warned about."""
FEWEST_TO_TEST = 4
"""Touches beyond those that determine the centre, below which a change can go unnoticed."""
LIKELY_CHANGE = 0.5
"""Probability of a change larger than the usual drift from which people are warned."""
_RESOLUTION = 2e-5
"""A repeatability below this is that of the last digit of a reading. [mm]"""
_TURNS = np.radians([-15.0, -12.0, -9.0, -6.0, -3.0, 3.0, 6.0, 9.0, 12.0, 15.0]).tolist()
"""Turns that are tried where the probe has changed: up to three standard deviations of `several
things`, as close as lobes of order nine need."""
_REFINED, _SAME_TURN = 3, 0.5 * DEGREE
_STILL = 1e-7
"""The centre has been found when it moves by less than this. [mm]"""


@dataclass(frozen=True)
class FoundDrift:
    """One way in which a probe has drifted, and its standard uncertainty."""

    value: float
    u: float


@dataclass(frozen=True, eq=False)
class MapUpdate:
    """An old map that new touches have brought up to date.

    Attributes
    ----------
    pretravel_map : PretravelMap
        Of today, of the basis and in the convention of the old one.
    prior_map : PretravelMap
        The old one.
    drift : ProbeDrift
        What was assumed of the time between.
    center : (3,) float
        Of the reference today, machine frame; on a ring the coordinate along the axis is the mean
        of the touches. [mm]
    center_covariance : (3, 3) float
        [mm²]
    p_value : float
        Probability that touches fit the old map and its drift worse than these; where the probe has
        turned, the old map after that turn.
    scale, level, turn : FoundDrift
        Share of the pretravel [1]; in all directions alike [mm]; about the axis [rad].
    changes : (n,) float
        Pretravel at each touch less that of the old map before any turn, centre fitted. [mm]
    residuals : (n,) float
        The same less that of the new map. [mm]
    contact_normals : (n, 3) float
        Machine frame.
    groups : (n,) int
        Which touches repeat each other's direction.
    repeatability, repeatability_dof : float
        Of the old map and of the new repeats together. [mm]
    warnings : tuple of str
    """

    pretravel_map: PretravelMap
    prior_map: PretravelMap
    drift: ProbeDrift
    center: FloatArray
    center_covariance: FloatArray
    p_value: float
    scale: FoundDrift
    level: FoundDrift
    turn: FoundDrift
    changes: FloatArray
    residuals: FloatArray
    contact_normals: FloatArray
    groups: IntArray
    repeatability: float
    repeatability_dof: float
    warnings: tuple[str, ...]


def update_map(
    touches: Touches,
    old_map: PretravelMap,
    diameter: float,
    *,
    ring: bool = False,
    drift: ProbeDrift = ProbeDrift(),
) -> MapUpdate:
    """Bring an old map up to date with a few touches on the reference.

    Parameters
    ----------
    touches : Touches
        New ones, wherever the reference stands now; of the same tip and at the same feed (or with
        a map that contains its signal delay). Five directions at least, on a ring four.
    old_map : PretravelMap
        It states its uncertainty and follows the probe: kind harmonic or physical.
    diameter : float
        Of the reference, that of the qualification. [mm]
    ring : bool
    drift : ProbeDrift
        What may have changed since the old map was made.

    Raises
    ------
    PretravelError
        A map that cannot be updated; touches that do not fit it (with a probability below
        `REFUSED_FIT`); as `observe`.
    ExtrapolationError
        Touches in directions outside the map.

    Notes
    -----
    A map is linear, so the update is that of Bayes in closed form: prior are the coefficients
    with their covariance and that of the drift; the position of the reference has none. Besides the
    drift that is assumed there are larger changes (`possible_drifts`); the result is the average
    over them, each with its probability after the touches, so that u contains their uncertainty.
    A turn about the axis by more than some degrees is not linear in the map: where something
    has changed, the probe's frame turns with it (`PretravelMap.rotation`). The map
    stays in the convention that separated it from the centre. Contact normals depend on the
    centre, which is therefore iterated.

    >>> from pretravel.base.directions import five_point_pattern, sphere_pattern_25
    >>> from pretravel.maps.kinds.harmonic import HarmonicBasis
    >>> from pretravel.maps.support import DirectionSupport
    >>> flat = PretravelMap(
    ...     HarmonicBasis(np.array([[0, 0]])), np.array([0.010]), Covariance.independent([1e-6]),
    ...     DirectionSupport(sphere_pattern_25()), tip_radius=3.0, repeatability=1e-4)
    >>> n = five_point_pattern()
    >>> found = update_map(Touches(n * (15.5 - 0.0102), n), flat, 25.0)
    >>> found.pretravel_map.coefficients.round(5).tolist()
    [0.0102]
    """
    if len(touches) > MOST_TOUCHES:
        raise PretravelError(
            f"{len(touches)} touches: an old map is brought up to date by a few, at most "
            f"{MOST_TOUCHES}, because every pair of them is compared. So many determine a map by "
            "themselves: qualify without the old map"
        )
    refuse_other_orientation(touches, old_map)
    noted = [*stated_by_one(touches, old_map), *_feed_warnings(touches, old_map)]
    setup = QualificationSetup(diameter, 2.0 * old_map.tip_radius, ring)
    u_size, said = other_reference(setup, old_map)
    noted += said
    state = _State.of(touches, old_map, drifted_map(old_map, drift, ring=ring), u_size)
    resting = old_map.without_machine(touches)
    usual = _settled(state, resting, setup)
    observation, posterior, noise = usual
    old_map.pretravel(observation.group_directions @ old_map.rotation.T)  # refuses extrapolation
    if 1.0 - posterior.probabilities[""] > LIKELY_CHANGE:
        observation, posterior, noise = _turned(state, resting, setup, usual)
    freedom = len(touches) - observation.axes
    p_value = _p_value(posterior.judged.statistic, freedom, noise.dof)
    if p_value < REFUSED_FIT:
        observation, posterior, noise = usual
        p_value = _p_value(posterior.assumed.statistic, freedom, noise.dof)
        raise PretravelError(_refusal(touches, observation, posterior, p_value, noise))
    if (unseen := unseen_in(usual[0], old_map)) is not None:
        noted.append(f"{unseen}. {_TOUCH_AROUND}")
    warnings = (*noted, *_warnings(p_value, posterior, old_map, observation.repeats))
    updated = _updated(touches, state, posterior, noise, setup)
    changes = usual[1].innovations
    return _result(updated, state, observation, posterior, (p_value, noise, warnings, changes))


_TOUCH_AROUND = (
    "A probe that has turned in its holder would fit these touches as well: touch the directions "
    "of a plan, or eight around the axis"
)


@dataclass(frozen=True, eq=False)
class _State:
    """Unknowns without the centre: coefficients and, where the map contains one, the delay."""

    prior: DriftedMap
    roots: dict[str, FloatArray]
    """Of the covariance, for each of `possible_drifts`: (k, m), or (k + 1, m + 1) with the delay in
    units of its standard uncertainty."""
    delay_column: FloatArray | None
    """Travel of each touch for a delay longer by one standard uncertainty, (n,). [mm]"""
    u_size: float
    """Of all touches together: of the radii of two references. [mm]"""

    @classmethod
    def of(
        cls, touches: Touches, old_map: PretravelMap, prior: DriftedMap, u_size: float
    ) -> _State:
        possible = possible_drifts(prior.drift)
        own = {name: prior.root_after(drift) for name, (_, drift) in possible.items()}
        if old_map.delay is None or old_map.delay_effect is None or touches.feeds is None:
            return cls(prior, own, None, u_size)
        with_delay = {name: np.pad(root, (0, 1)) for name, root in own.items()}
        for root in with_delay.values():
            root[-1, -1] = 1.0
        delayed = old_map.u_delay * travel_per_second(touches)
        return cls(prior, with_delay, delayed, u_size)

    def design(self, directions: FloatArray) -> FloatArray:
        """Columns of the unknowns in what touches observe, (n, k) or (n, k + 1)."""
        found = self.prior.pretravel_map.basis.design(directions)
        effect = self.prior.pretravel_map.delay_effect
        if self.delay_column is None or effect is None:
            return found
        return np.column_stack([found, found @ effect + self.delay_column])


_Settled = tuple[Observation, "_Posterior", Scatter]


def _settled(
    state: _State, touches: Touches, setup: QualificationSetup, turn: float = 0.0
) -> _Settled:
    """The state after the touches where the centre rests, linear about a turn of the probe."""
    old = state.prior.pretravel_map
    observation = observe(touches, setup, old.rotation @ probe_rotation(rotation=turn))
    noise = _pooled(old, observation.repeats)
    for _ in range(8):
        posterior = _posterior(state, observation, noise, turn)
        moved = observation.center.copy()
        moved[: observation.axes] += posterior.shift
        observation = replace(observation, center=moved)
        if np.abs(posterior.shift).max() < _STILL:
            break
    return observation, posterior, noise


def _turned(
    state: _State, touches: Touches, setup: QualificationSetup, usual: _Settled
) -> _Settled:
    """The same about the turn of the probe that the touches make most probable.

    A turn by more than some degrees is not linear in the map: the lobes of order m change by
    1 - cos(m·turn) of themselves besides.
    """
    observation, posterior, noise = usual
    starts = [_posterior(state, _seen_turned(observation, turn), noise, turn) for turn in _TURNS]
    posterior = max((posterior, *starts), key=lambda each: each.evidence)
    best = usual
    for _ in range(_REFINED):
        turn = posterior.turn_found
        best = _settled(state, touches, setup, turn)
        posterior = best[1]
        if abs(posterior.turn_found - turn) < _SAME_TURN:
            break
    return max((usual, best), key=lambda each: each[1].evidence)


def _seen_turned(observation: Observation, turn: float) -> Observation:
    """An observation from a probe that is turned about its axis."""
    back = probe_rotation(rotation=turn)
    return replace(
        observation, positions=observation.positions @ back, center=observation.center @ back
    )


@dataclass(frozen=True, eq=False)
class _Posterior:
    """The state after the touches, averaged over the drifts, and what the tests need. [mm]"""

    turn: float
    """Of the probe about its axis, about which the map is linear. [rad]"""
    turn_found: float
    """The whole turn, where that is what has changed. [rad]"""
    movement_found: float
    """Of the reference from the first touch to the last, where that has drifted. [mm]"""
    evidence: float
    """Logarithm of the probability of the touches under all drifts, and a constant."""
    before: FloatArray
    """The unknowns of the map before the turn, linear in it; zero without one."""
    innovations: FloatArray
    """Observed pretravel less that of the map before the turn, about the current centre, (n,)."""
    normals: FloatArray
    design: FloatArray
    parts: dict[str, _Part]
    """After each of `possible_drifts`; that which is assumed is the first."""
    probabilities: dict[str, float]
    change: FloatArray
    """Of the unknowns, in the convention of the map; from the map after the turn."""
    covariance: FloatArray
    shift: FloatArray
    """Still missing in the centre, (axes,)."""
    shift_covariance: FloatArray

    @property
    def assumed(self) -> _Part:
        return self.parts[""]

    @property
    def judged(self) -> _Part:
        """The drift that is assumed; where the probe has turned or the reference has drifted, that
        with a larger turn or with a movement.
        """
        for name in (LARGE_TURN, DRIFT_OF_REFERENCE):
            if self.probabilities.get(name, 0.0) > LIKELY_CHANGE:
                return self.parts[name]
        return self.assumed


@dataclass(frozen=True, eq=False)
class _Part:
    """The state after one of the drifts."""

    weight: FloatArray
    """Inverse covariance of the innovations, centre fitted, (n, n)."""
    change: FloatArray
    covariance: FloatArray
    shift: FloatArray
    shift_covariance: FloatArray
    statistic: float
    evidence: float
    """Logarithm of the probability of the touches, centre integrated out, and a constant."""


def _posterior(state: _State, observation: Observation, noise: Scatter, turn: float) -> _Posterior:
    old, axes = state.prior.pretravel_map, observation.axes
    design, normals = state.design(observation.directions), observation.directions[:, :axes]
    # The map before the turn, seen from the turned probe.
    before = np.zeros(design.shape[1])
    before[: old.basis.size] = -turn * state.prior.ways[2]
    innovations = observation.values - old.basis.value(observation.directions, old.coefficients)
    innovations = innovations - design @ before
    touch = _touch_covariance(old, observation, noise) + state.u_size**2
    possible = possible_drifts(state.prior.drift)
    order = np.arange(len(normals))
    courses = np.stack([drift_columns(normals, order, slows=slows) for slows in (False, True)])
    moving = np.mean(courses @ courses.mT, axis=0)
    parts = {}
    for name, root in state.roots.items():
        far = possible[name][1].reference
        own = touch + far**2 * moving if far else touch
        parts[name] = _after(state.prior, root, design, normals, innovations, own)
    logs = np.array([math.log(possible[name][0]) + part.evidence for name, part in parts.items()])
    shares = np.exp(logs - logs.max())
    evidence = float(logs.max() + np.log(shares.sum()))
    shares /= shares.sum()
    change, covariance = _mixed([(part.change, part.covariance) for part in parts.values()], shares)
    shift, of_shift = _mixed(
        [(part.shift, part.shift_covariance) for part in parts.values()], shares
    )
    turn_found = 0.0
    if LARGE_TURN in parts:
        seen = parts[LARGE_TURN].weight @ (design[:, : old.basis.size] @ state.prior.ways[2])
        turn_found = possible[LARGE_TURN][1].turn ** 2 * float(innovations @ seen)
    movement_found = 0.0
    if DRIFT_OF_REFERENCE in parts:
        seen = courses.mean(axis=0).T @ parts[DRIFT_OF_REFERENCE].weight @ innovations
        spread = possible[DRIFT_OF_REFERENCE][1].reference
        movement_found = spread**2 * float(np.linalg.norm(seen))
    return _Posterior(
        turn=turn,
        turn_found=turn_found,
        movement_found=movement_found,
        evidence=evidence,
        before=before,
        innovations=innovations,
        normals=normals,
        design=design,
        parts=parts,
        probabilities=dict(zip(parts, shares.tolist(), strict=True)),
        change=before + change,
        covariance=covariance,
        shift=shift,
        shift_covariance=of_shift,
    )


def _mixed(
    parts: Sequence[tuple[FloatArray, FloatArray]], shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Mean and covariance of a mixture of distributions."""
    means = np.array([mean for mean, _ in parts])
    middle = shares @ means
    apart = means - middle
    within = sum(share * each for share, (_, each) in zip(shares, parts, strict=True))
    return middle, _symmetric(np.asarray(within) + (apart.T * shares) @ apart)


def _after(
    prior: DriftedMap,
    root: FloatArray,
    design: FloatArray,
    normals: FloatArray,
    innovations: FloatArray,
    touch: FloatArray,
) -> _Part:
    """The state after the touches, from the root of its covariance before them.

    Unknowns are in units of that root, z with the covariance 1, and the touches y = B z - n·s + e:
    a centre moved by s adds n·s to the observed pretravel.
    """
    axes, size = normals.shape[1], prior.pretravel_map.basis.size
    seen = design @ root
    inverse: FloatArray = np.linalg.inv(touch).astype(np.float64)
    of_center = normals.T @ inverse @ normals
    alone: FloatArray = np.linalg.inv(of_center).astype(np.float64)
    to_shift = alone @ normals.T @ inverse
    without = inverse - inverse @ normals @ to_shift
    precision = np.eye(root.shape[1]) + seen.T @ without @ seen
    spread: FloatArray = np.linalg.inv(precision).astype(np.float64)
    found = spread @ seen.T @ without @ innovations
    change, after = root @ found, root @ spread @ root.T
    shift = -to_shift @ (innovations - seen @ found)
    on_shift = to_shift @ seen
    of_shift = alone + on_shift @ spread @ on_shift.T
    with_shift = root @ spread @ on_shift.T
    functional = np.zeros((axes, len(change)))
    functional[:, :size] = prior.shift_of
    turned = np.zeros((len(change), axes))
    turned[:size] = prior.shift
    keep = np.eye(len(change)) - turned @ functional
    # The covariance of the map, or of what is seen from the centre that was found.
    kept = keep @ root
    stated = kept @ spread @ kept.T
    if prior.from_center:
        seen_from = root - turned @ on_shift
        stated = seen_from @ spread @ seen_from.T + turned @ alone @ turned.T
    mixed = functional @ with_shift
    weight = without - without @ seen @ spread @ seen.T @ without
    statistic = float(innovations @ weight @ innovations)
    logs = sum(float(np.linalg.slogdet(each)[1]) for each in (touch, of_center, precision))
    return _Part(
        weight=weight,
        change=keep @ change,
        covariance=_symmetric(stated),
        shift=shift - functional @ change,
        shift_covariance=_symmetric(of_shift - mixed - mixed.T + functional @ after @ functional.T),
        statistic=statistic,
        evidence=-0.5 * (statistic + logs),
    )


def _symmetric(matrix: FloatArray) -> FloatArray:
    return np.asarray(0.5 * (matrix + matrix.T))


def _touch_covariance(old: PretravelMap, observation: Observation, noise: Scatter) -> FloatArray:
    """Of the touches: repeatability, and what the repeats of a direction share. [mm²]"""
    same = observation.groups[:, None] == observation.groups
    shared = float(getattr(old, "fixed_scatter", 0.0))
    return np.asarray(np.eye(len(same)) * noise.deviation**2 + shared**2 * same)


def _pooled(old: PretravelMap, repeats: Scatter) -> Scatter:
    """Repeatability of the old map and of the new repeats together."""
    own = max(old.repeatability, _RESOLUTION)
    if repeats.dof == 0.0 or not math.isfinite(old.repeatability_dof):
        return Scatter(own, old.repeatability_dof)
    dof = old.repeatability_dof + repeats.dof
    squares = old.repeatability_dof * own**2 + repeats.dof * repeats.deviation**2
    return Scatter(math.sqrt(squares / dof), dof)


def _p_value(statistic: float, freedom: int, dof: float) -> float:
    from scipy.special import chdtrc, fdtrc

    if math.isfinite(dof):
        return float(fdtrc(freedom, dof, statistic / freedom))
    return float(chdtrc(freedom, statistic))


def _found(state: _State, posterior: _Posterior) -> tuple[FoundDrift, FoundDrift, FoundDrift]:
    """Scale, level and turn, each with the others unknown within the prior."""
    possible, ways = possible_drifts(state.prior.drift), state.prior.ways
    columns = posterior.design[:, : ways.shape[1]] @ ways.T
    means, variances = [], []
    for name, part in posterior.parts.items():
        spread = spread_of(possible[name][1])
        seen = part.weight @ columns
        means.append(spread**2 * (posterior.innovations @ seen))
        left = spread**2 * (1.0 - spread**2 * np.einsum("ij,ij->j", columns, seen))
        variances.append(np.diag(np.maximum(left, 0.0)))
    shares = np.array(list(posterior.probabilities.values()))
    value, covariance = _mixed(list(zip(means, variances, strict=True)), shares)
    scale, level, turn = (
        FoundDrift(float(each), math.sqrt(variance))
        for each, variance in zip(value, np.diag(covariance), strict=True)
    )
    return scale, level, turn


def _updated(
    touches: Touches,
    state: _State,
    posterior: _Posterior,
    noise: Scatter,
    setup: QualificationSetup,
) -> PretravelMap:
    """The new map. What the touches say of a signal delay goes to the delay and to the map."""
    old = state.prior.pretravel_map
    size, made = old.basis.size, old.provenance
    change, covariance = posterior.change[:size], posterior.covariance[:size, :size]
    delay, u_delay, effect = old.delay, old.u_delay, old.delay_effect
    if state.delay_column is not None and delay is not None and effect is not None:
        spread = math.sqrt(posterior.covariance[size, size])
        common = posterior.covariance[:size, size] / spread
        change = change + effect * posterior.change[size]
        covariance = _symmetric(covariance - np.outer(common, common))
        delay, u_delay = delay + u_delay * float(posterior.change[size]), u_delay * spread
        effect = effect * spread + common
    origin = f", from {touches.source}" if touches.source else ""
    # Of many updates the last and the qualification that they began with.
    first = made.touches.rpartition("; first: ")[2]
    earlier = f"; first: {first}" if first else ""
    return replace(
        old,
        rotation=old.rotation @ probe_rotation(rotation=posterior.turn),
        coefficients=old.coefficients + change,
        covariance=Covariance.full(covariance),
        repeatability=noise.deviation,
        repeatability_dof=noise.dof,
        delay=delay,
        u_delay=u_delay,
        delay_effect=effect,
        touched=None,  # of the old map: the probe has drifted since then
        provenance=replace(
            made,
            origin=Origin.QUALIFIED,
            source=f"an old map, updated on a {setup.reference} of {setup.diameter:.9g} mm",
            touches=f"{len(touches)} touches{origin}{earlier}",
            touches_file=touches.source or "",
            reading=touches.reading,
            touch_digests=touch_digests(touches.positions, made.touch_digests),
            center=None,
        ),
    )


def _result(
    updated: PretravelMap,
    state: _State,
    observation: Observation,
    posterior: _Posterior,
    judged: tuple[float, Scatter, tuple[str, ...], FloatArray],
) -> MapUpdate:
    p_value, noise, warnings, changes = judged
    rotation = updated.rotation
    axes = rotation[:, : observation.axes]
    scale, level, turn = _found(state, posterior)
    return MapUpdate(
        pretravel_map=updated,
        prior_map=state.prior.pretravel_map,
        drift=state.prior.drift,
        center=frozen(rotation @ observation.center),
        center_covariance=frozen(axes @ posterior.shift_covariance @ axes.T),
        p_value=p_value,
        scale=scale,
        level=level,
        turn=turn,
        changes=frozen(changes),
        residuals=frozen(
            posterior.innovations - posterior.design @ (posterior.change - posterior.before)
        ),
        contact_normals=frozen(observation.directions @ rotation.T),
        groups=observation.groups,
        repeatability=noise.deviation,
        repeatability_dof=noise.dof,
        warnings=warnings,
    )


def _refusal(
    touches: Touches,
    observation: Observation,
    posterior: _Posterior,
    p_value: float,
    noise: Scatter,
) -> str:
    """Which touch is wrong, or how far the probe has changed; and what to do."""
    beginning = (
        f"these touches do not fit the old map (probability {p_value:.2g} for a probe that "
        "has only drifted): "
    )
    row, size, left = _one_direction(observation, posterior)
    others = np.sum(observation.groups != observation.groups[row])
    freedom = int(others) - observation.axes
    if freedom > 0 and _p_value(left, freedom, noise.dof) > DOUBTFUL_FIT:
        return beginning + (
            f"{touches.where(row)} alone is {size / MICROMETRE:+.1f} µm off what the old map and "
            "the other touches predict. Touch there again, or leave it out; if it stays, the probe "
            "has changed there"
        )
    design = posterior.normals
    changes = posterior.innovations
    changes = changes - design @ np.linalg.lstsq(design, changes, rcond=None)[0]
    largest = int(np.argmax(np.abs(changes)))
    return beginning + (
        f"the probe has changed, by up to {abs(changes[largest]) / MICROMETRE:.1f} µm "
        f"({describe(observation.directions[largest])}). An old map does not help here: qualify "
        "again, with about 75 touches (25 directions three times), and look for the cause (stylus "
        "loose or exchanged, another spring force, a collision, dirt)"
    )


def _one_direction(observation: Observation, posterior: _Posterior) -> tuple[int, float, float]:
    """The direction that fits the others worst: its first touch, how far it is off, and the
    statistic of the others. [mm]
    """
    part = posterior.assumed
    seen = part.weight @ posterior.innovations
    best = (0, 0.0, math.inf)
    for group in range(observation.direction_count):
        rows = np.flatnonzero(observation.groups == group)
        off = np.linalg.lstsq(part.weight[np.ix_(rows, rows)], seen[rows], rcond=None)[0]
        left = part.statistic - float(off @ seen[rows])
        if left < best[2]:
            best = (int(rows[0]), float(off.mean()), left)
    return best


def _warnings(
    p_value: float, posterior: _Posterior, old: PretravelMap, repeats: Scatter
) -> list[str]:
    found = []
    if 1.0 - posterior.probabilities[""] > LIKELY_CHANGE:
        found.append(_change_warning(posterior))
    elif p_value < DOUBTFUL_FIT:
        found.append(
            f"the touches fit the old map badly (probability {p_value:.2g}): the probe may have "
            "changed by more than its usual drift. Touch more directions, or qualify again"
        )
    beyond = len(posterior.innovations) - len(posterior.shift)
    if beyond < FEWEST_TO_TEST:
        found.append(
            f"{len(posterior.innovations)} touches leave {beyond} degrees of freedom to test the "
            "old map, because the centre takes the others: a probe that has turned by 10° goes "
            "unnoticed in every second case. Touch 9 directions, where the probe may have been "
            "moved"
        )
    own = max(old.repeatability, _RESOLUTION)
    if repeats.dof > 0.0:
        from scipy.special import fdtrc

        dof = min(old.repeatability_dof, 1e9)
        if fdtrc(repeats.dof, dof, (repeats.deviation / own) ** 2) < 1e-3:
            found.append(
                f"the new touches scatter by {repeats.deviation / MICROMETRE:.2f} µm, those of the "
                f"old map by {own / MICROMETRE:.2f} µm: the probe or the machine has become worse"
            )
    return found


def _change_warning(posterior: _Posterior) -> str:
    """What has changed most likely, and what to do."""
    changed = {name: share for name, share in posterior.probabilities.items() if name}
    what, likely = max(changed, key=lambda name: changed[name]), sum(changed.values())
    if what == DRIFT_OF_REFERENCE:
        return (
            f"the reference moved by about {posterior.movement_found / MICROMETRE:.1f} µm against "
            "the machine during the touches: this explains them better than a changed probe "
            f"(probability {changed[what]:.2f}). These touches do not determine the movement "
            "completely, and u of centre and map contains the rest. Let the machine warm up, and "
            "touch again"
        )
    if what == LARGE_TURN:
        what += f", by about {posterior.turn_found / DEGREE:+.0f}°"
    return (
        f"the probe has changed by more than its usual drift (probability {likely:.2f}), most "
        f"likely in {what}. These touches do not determine the change completely, and u of the "
        "map contains the rest. Touch more directions, or qualify again"
    )


def _feed_warnings(touches: Touches, old: PretravelMap) -> list[str]:
    consequence = "the same touches count twice. Touch the reference again"
    found = own_touches_warnings(touches, old, consequence)
    if old.delay is not None or old.feed is None:
        return found
    if touches.feeds is None:
        found.append(
            f"the touches do not give their feed; the old map is that at {old.feed:g} mm/min"
        )
    elif several_feeds(touches) or abs(touches.feeds.mean() / old.feed - 1.0) > 0.01:
        raise PretravelError(
            f"the old map was made at {old.feed:g} mm/min, these touches at "
            f"{range_text(touches.feeds.min(), touches.feeds.max())}: feed × signal delay would "
            "look like a change of the probe. Touch at the feed of the old map"
        )
    return found
