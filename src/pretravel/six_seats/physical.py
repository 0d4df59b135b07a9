"""Kind physical: a six-seat probe fitted to touches on a reference.

Its basis is `pretravel.six_seats.six_seat_basis.SixSeatBasis`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from pretravel.base import (
    MICROMETRE,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    fibonacci_cap,
    from_angles,
    polar_angle,
)
from pretravel.maps import (
    KindOfMap,
    MapBasis,
    MapFit,
    Observation,
    ReferenceDrift,
    Scatter,
    fit_harmonic,
    real_spherical_harmonics,
)
from pretravel.six_seats.drifting_reference import drift_beside_seats
from pretravel.six_seats.response import ResponseBasis
from pretravel.six_seats.scale_weights import (
    LEAST_NOISE,
    WELL_KNOWN_NOISE,
    WeightedScales,
    coarse_scales,
    correction_at,
    covariance_over_scales,
    usual_scales,
    weighted_scales,
)
from pretravel.six_seats.six_seat_basis import SixSeatBasis
from pretravel.six_seats.six_seat_fit import (
    SEARCHED,
    PriorScales,
    SixSeatProblem,
    beside,
    different,
    modes,
    most_probable,
    oriented_starts,
    promised_gain,
)
from pretravel.six_seats.uneven_seats import PARAMETERS
from pretravel.uncertainty import Covariance

FEWEST_FOR_SIX_SEATS = 8
"""Ideal probe, centre and level are ten numbers; with priors this many directions suffice."""
FEW_FOR_SIX_SEATS = 15
"""A physical map from fewer directions than this is warned about."""
MISFIT_LEVEL = 0.01
"""Probability that a good six-seat probe is reported as not of this kind."""
_DOUBTFUL_LEVEL = 0.05
"""Probability of the residuals, below which a drift of the reference is looked for."""
_WEIGHT_IF_MISFIT = 0.5
"""A probe that six seats do not explain has no more in advance for this kind than for another."""
_ROUNDS = 4
_NEAR_ROUNDS = 2
"""From a fit to similar touches."""
_MOST_TOGETHER = 200
"""Directions up to which fits to parts of the touches are one search: of more, arithmetic takes
longer than the steps themselves."""
_SETTLED, _SETTLED_WITHOUT_NOISE = 3, 8
_STEPS, _NEARLY = 40, 1e-3
_FAR_ABOVE = 3.0
"""Times the usual noise, from which a search is made again."""
_BEHIND = 8.0
"""Of modes: how many are settled (more where the noise is not known, on which their order depends),
and how much less evident than the best they may be."""
_WITHOUT_SHARE = 4.0
"""Less evidence than the best, from which a mode has no share in the average."""
_SMOOTHING = 1e-4
"""Of the difference of two modes: mean square that a harmonic series may leave, over its own."""
_SURELY_APART = 1.5
"""Mean square difference from a harmonic map over the variances of both, from which this is a
misfit: of 56 drawn six-seat probes two had more; lobes of other shapes have 1.5 to 4."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PhysicalMapFit(MapFit):
    """A map fitted as a six-seat probe with a correction.

    Attributes
    ----------
    basis : SixSeatBasis
    unknowns : (u,) float
        Shift of the centre, tip radius where it was not given, parameters: from here a fit to
        similar touches begins.
    parameter_covariance : (18, 18) float
        Of `PARAMETERS`, posterior.
    learned : (18,) float
        Share of the prior variance of each parameter that the touches removed: 0, the touches
        contain nothing about it; 1, the prior has no effect.
    scales : WeightedScales
        Of asymmetry, correction and scatter, with their probabilities.
    misfit : float
        Probability of residuals this large for a six-seat probe; nan without repeats, and where
        the fit began at an earlier one.
    disagreement : float
        Without repeats: root mean square difference from a harmonic map of the same touches, where
        it is larger than the uncertainties of both explain; else zero. It is in u of the map. [mm]
    """

    basis: SixSeatBasis
    unknowns: FloatArray
    parameter_covariance: FloatArray
    learned: FloatArray
    scales: WeightedScales
    misfit: float
    disagreement: float = 0.0


@dataclass(frozen=True)
class PhysicalKind(KindOfMap):
    """A six-seat probe: statics of the tripod, linear compliance, Hertz contact, a correction."""

    name: ClassVar[str] = "physical"
    title: ClassVar[str] = "physical map"
    summary: ClassVar[str] = "a fitted six-seat probe"
    bases: ClassVar[tuple[type[MapBasis], ...]] = (SixSeatBasis, ResponseBasis)
    prior_weight: ClassVar[float] = 3.0

    def fit(self, observation: Observation, repeats: Scatter) -> PhysicalMapFit:
        return fit_physical(observation, repeats)

    def fit_near(self, fit: MapFit, observation: Observation, repeats: Scatter) -> PhysicalMapFit:
        assert isinstance(fit, PhysicalMapFit)
        return fit_physical(observation, repeats, fit.unknowns, fit.scales.scales[0])

    def drift_of_reference(self, fit: MapFit, times: FloatArray) -> ReferenceDrift | None:
        assert isinstance(fit, PhysicalMapFit)
        few = fit.observation.direction_count <= SEARCHED
        if not (few and fit.misfit < _DOUBTFUL_LEVEL):
            return None
        return drift_beside_seats(fit.observation, times, fit.unknowns, fit.scales.scales[0])

    def fits_of_parts(
        self,
        fit: MapFit,
        observation: Observation,
        kept: Sequence[BoolArray],
        parts: Sequence[Observation],
    ) -> list[MapFit]:
        assert isinstance(fit, PhysicalMapFit)
        if observation.direction_count > _MOST_TOGETHER:
            return super().fits_of_parts(fit, observation, kept, parts)
        rows = [np.unique(observation.groups[touches]) for touches in kept]
        return list(_fitted_together(fit, observation, _Parts(list(map(_problem, parts)), rows)))

    def weight_in_advance(self, fit: MapFit) -> float:
        assert isinstance(fit, PhysicalMapFit)
        return _WEIGHT_IF_MISFIT if fit.misfit < MISFIT_LEVEL else self.prior_weight

    def warnings(self, fit: MapFit, repeatability: float) -> list[str]:
        del repeatability
        assert isinstance(fit, PhysicalMapFit)
        found = []
        count = fit.observation.direction_count
        if count < FEW_FOR_SIX_SEATS:
            found.append(
                f"{count} directions are few for the model of six seats: other values of its "
                "parameters may fit them equally well, which u of the map does not contain; touch "
                "25"
            )
        if fit.disagreement:
            found.append(
                "this probe is perhaps not of the six-seat kind: a harmonic map of the same "
                f"touches differs by {fit.disagreement / MICROMETRE:.1f} µm (root mean square), "
                "more than the uncertainties of both explain. u of the map contains the "
                "difference; repeats of each direction would show which is right, and kind auto "
                "weighs both"
            )
        if fit.misfit < MISFIT_LEVEL:
            found.append(
                "this probe is not quite of the six-seat kind: the residuals are larger than the "
                f"scatter of repeats (probability {fit.misfit:.2g} for a six-seat probe). The map "
                f"contains a correction of {fit.scales.mean('correction') / MICROMETRE:.1f} µm, "
                "and its u what the correction does not determine. A drift of the reference from "
                "ring to ring looks the same: touches in passes distinguish the two"
            )
        return found


def fit_physical(
    observation: Observation,
    repeats: Scatter,
    start: FloatArray | None = None,
    scales: PriorScales | None = None,
) -> PhysicalMapFit:
    """The six-seat probe that explains touches on a sphere or in a ring best.

    Parameters
    ----------
    observation : Observation
    repeats : Scatter
        Of repeated touches.
    start : (u,) float, optional
        Unknowns of a fit to similar touches; the orientation is then not searched for.
    scales : PriorScales, optional
        The most probable ones of that fit.

    Raises
    ------
    PretravelError
        Fewer than eight directions.

    Notes
    -----
    Posterior of touches and priors (`pretravel.six_seats.uneven_seats.PARAMETERS`), from several
    orientations of the tripod. Besides the six-seat probe pretravel has a part that it does not
    represent, a series of harmonics, and a scatter of directions that repeats do not reduce. Their
    sizes and the scale of asymmetry are averaged over (`identification.scale_weights`), so that u
    of the map contains what the map misses in directions that were not touched. The covariance of
    the map is that of distances: the part that a shift of the reference explains is removed from
    it and stated as `shift_covariance`.

    References
    ----------
    Shen & Springer 1998 and Estler 1996, 1997 fit such models; Woźniak and Rodrigues 2021
    use the same statics. The correction with its own covariance: Kennedy & O'Hagan 2001.
    """
    problem = _problem(observation)
    usual = usual_scales(repeats)
    if start is not None:
        near = usual if scales is None else replace(scales, noise=usual.noise)
        x, weighted = _settled(problem, start, near, repeats, rounds=_NEAR_ROUNDS)
        return _concluded(problem, x, weighted, math.nan, repeats)
    part = SixSeatProblem(observation.drawn(SEARCHED))
    sought = _searched(part, usual, repeats)
    x, weighted, _ = sought[0]
    misfit = _misfit(part, x, weighted, repeats)
    if part.observation is not observation:
        x, weighted = _settled(problem, x, weighted.scales[0], repeats, rounds=_NEAR_ROUNDS)
    found = _concluded(problem, x, weighted, misfit, repeats)
    if part.observation is observation and len(sought) > 1:
        others = [
            _concluded(problem, each.x, each.weighted, misfit, repeats) for each in sought[1:]
        ]
        found = _averaged(found, others, np.array([each.evidence for each in sought]), problem)
    return found if repeats.dof >= WELL_KNOWN_NOISE else _with_disagreement(found, part)


def _problem(observation: Observation) -> SixSeatProblem:
    """Touches in enough directions."""
    count = observation.direction_count
    if count < FEWEST_FOR_SIX_SEATS:
        raise PretravelError(
            f"{count} directions are too few for kind physical: a six-seat probe has seven "
            "parameters besides centre and asymmetry; touch at least "
            f"{FEWEST_FOR_SIX_SEATS} directions, 25 are good"
        )
    return SixSeatProblem(observation)


def _fitted_together(
    fit: PhysicalMapFit, observation: Observation, parts: _Parts
) -> list[PhysicalMapFit]:
    """Fits to parts of the touches that begin at the fit to all, in one search."""
    repeats = [problem.observation.repeats for problem in parts.problems]
    near = [replace(fit.scales.scales[0], noise=usual_scales(each).noise) for each in repeats]
    begun = np.repeat(fit.unknowns[None], len(near), axis=0)
    whole = SixSeatProblem(observation)
    x, weighted = _settled_together(whole, begun, near, repeats, _NEAR_ROUNDS, parts)
    return [
        _concluded(problem, own, scales, math.nan, scatter)
        for problem, own, scales, scatter in zip(parts.problems, x, weighted, repeats, strict=True)
    ]


class _Parts(NamedTuple):
    """Parts of the touches, of which each search uses one."""

    problems: Sequence[SixSeatProblem]
    rows: Sequence[IntArray]
    """Their directions among all."""


class _Mode(NamedTuple):
    """A six-seat probe that explains the touches, with the scales that belong to it."""

    x: FloatArray
    weighted: WeightedScales
    evidence: float


def _searched(problem: SixSeatProblem, usual: PriorScales, repeats: Scatter) -> list[_Mode]:
    """The most evident modes; where the noise turns out to be far above the usual, sought again.

    A search that takes noise for form ends in tripods that follow the noise.
    """
    found = _most_evident(problem, usual, repeats)
    noise = found[0].weighted.scales[0].noise
    if repeats.dof >= WELL_KNOWN_NOISE or noise < _FAR_ABOVE * usual.noise:
        return found
    again = _most_evident(problem, replace(usual, noise=noise), repeats)
    return _evident(problem, found + again)


def _evident(problem: SixSeatProblem, found: list[_Mode]) -> list[_Mode]:
    """Modes with different maps that have a share in the probability, the most evident first."""
    found = sorted(found, key=lambda mode: -mode.evidence)
    kept = different(problem, np.array([mode.x for mode in found]))
    least = found[0].evidence - _WITHOUT_SHARE
    return [found[place] for place in kept if found[place].evidence > least]


def _most_evident(problem: SixSeatProblem, usual: PriorScales, repeats: Scatter) -> list[_Mode]:
    """The modes with the largest evidence, of those that the starts lead to, the largest first.

    Each is sought at several scales: the usual asymmetry can lead into another mode.
    """
    starts = oriented_starts(problem, usual)
    if not len(starts):
        raise PretravelError("no probe on six seats deflects as these touches say")
    grid, log_priors = coarse_scales(usual)
    tried = list(grid) * len(starts)
    found = modes(problem, tried, np.repeat(starts, len(grid), axis=0), _STEPS, _NEARLY)
    evidence = found.evidence + np.tile(log_priors, len(starts))
    order = np.argsort(-evidence)
    order = order[evidence[order] > evidence.max() - _BEHIND]
    kept = different(problem, found.x[order])
    count = _SETTLED if repeats.dof >= WELL_KNOWN_NOISE else _SETTLED_WITHOUT_NOISE
    chosen = order[kept[:count]]
    settled = _settled_modes(problem, found.x[chosen], [tried[place] for place in chosen], repeats)
    first = max(settled, key=lambda mode: mode.evidence)
    best = first.weighted.scales[0]
    places = np.vstack([first.x, beside(problem, best, first.x)])
    around = modes(problem, [best] * len(places), places, _STEPS, _NEARLY)
    if around.cost.min() <= around.cost[0] - _NEARLY:
        nearer = _settled_modes(problem, around.x[[around.cost.argmin()]], [best], repeats)
        settled = [*nearer, *(mode for mode in settled if mode is not first)]
    return _evident(problem, settled)


def _settled(
    problem: SixSeatProblem,
    x: FloatArray,
    scales: PriorScales,
    repeats: Scatter,
    rounds: int = _ROUNDS,
) -> tuple[FloatArray, WeightedScales]:
    """Mode and scales by turns: each determines the other."""
    found, weighted = _settled_together(problem, x[None], [scales], [repeats], rounds)
    return found[0], weighted[0]


def _settled_modes(
    problem: SixSeatProblem, x: FloatArray, scales: Sequence[PriorScales], repeats: Scatter
) -> list[_Mode]:
    """Several modes (s, u), each with the scales that it is sought with, settled."""
    found, weighted = _settled_together(problem, x, scales, [repeats] * len(x), _ROUNDS)
    return [
        _Mode(own, scales, _reached_evidence(problem, own, scales))
        for own, scales in zip(found, weighted, strict=True)
    ]


def _settled_together(
    problem: SixSeatProblem,
    x: FloatArray,
    scales: Sequence[PriorScales],
    repeats: Sequence[Scatter],
    rounds: int,
    parts: _Parts | None = None,
) -> tuple[FloatArray, list[WeightedScales]]:
    """Several modes, those that still move in one search; of parts of the touches, or of all."""
    x, now = x.copy(), list(scales)
    weighted: dict[int, WeightedScales] = {}
    going = list(range(len(x)))
    for _ in range(rounds):
        rows = None if parts is None else [parts.rows[place] for place in going]
        x[going] = modes(problem, [now[place] for place in going], x[going], rows=rows).x
        for place in going:
            own = problem if parts is None else parts.problems[place]
            weighted[place] = weighted_scales(own, x[place], repeats[place])
        going = [place for place in going if weighted[place].scales[0] != now[place]]
        for place in going:
            now[place] = weighted[place].scales[0]
        if not going:
            break
    return x, [weighted[place] for place in range(len(x))]


def _reached_evidence(problem: SixSeatProblem, x: FloatArray, weighted: WeightedScales) -> float:
    """The evidence of the linear model about x, less what that model promises and x has not."""
    return weighted.evidence - promised_gain(problem, weighted.scales[0], x)


def _concluded(
    problem: SixSeatProblem,
    x: FloatArray,
    weighted: WeightedScales,
    misfit: float,
    repeats: Scatter,
) -> PhysicalMapFit:
    """The fit as a map, with a covariance over all scales."""
    observation, axes, extra = problem.observation, problem.axes, problem.extra
    covariance = covariance_over_scales(problem, x, weighted)
    spread = problem.spread(weighted.mean("asymmetry"))
    learned = 1.0 - np.diag(covariance)[extra : problem.size] / spread**2
    rates = np.ones(len(covariance))
    rates[extra : problem.size] = problem.rates(x)
    covariance *= np.outer(rates, rates)
    # The unknowns stay where the search ended, and the correction is that of this probe: where the
    # seat that lifts first changes, the linear model promises a change that no probe keeps.
    basis = SixSeatBasis(problem.parameters(x), observation.tip_radius, problem.terms)
    six_seats = np.eye(5 + len(PARAMETERS))[0]
    coefficients = np.concatenate([six_seats, correction_at(problem, x, weighted.scales[0])])
    moved = problem.moved(x)
    level = float(x[axes:extra].sum())
    places = moved.places
    modelled = basis.values_in_blocks(places.directions, coefficients)[places.of_touches]
    residuals = moved.values + level - modelled
    to_coefficients = _to_coefficients(problem)
    of_map = to_coefficients @ covariance @ to_coefficients.T
    gauge = covariance[:axes, :axes]
    to_mean = observation.to_sphere[0]
    noise = weighted.mean("noise")
    return PhysicalMapFit(
        observation=observation,
        basis=basis,
        coefficients=coefficients,
        covariance=Covariance.full(0.5 * (of_map + of_map.T)),
        mean=float(to_mean @ observation.values),
        u_mean=float(np.linalg.norm(to_mean)) * noise,
        shift=-x[:axes],
        shift_covariance=gauge,
        residuals=residuals,
        dof=_effective_dof(problem, x, weighted),
        noise=noise,
        gauge=_gauge(problem, x, covariance),
        noise_is_repeatability=repeats.dof < WELL_KNOWN_NOISE,
        fixed_scatter=weighted.mean("fixed_scatter"),
        tip_radius=None if observation.tip_known else observation.tip_radius + level,
        unknowns=x,
        parameter_covariance=covariance[extra : problem.size, extra : problem.size],
        learned=learned,
        scales=weighted,
        misfit=misfit,
    )


def _effective_dof(problem: SixSeatProblem, x: FloatArray, weighted: WeightedScales) -> float:
    """Number of touches less the effective number of fitted parameters."""
    best = weighted.scales[0]
    _, slopes = problem.misses(x)
    own = np.sqrt(best.fixed_scatter**2 + best.noise**2 / problem.count)
    rows = np.hstack([slopes, problem.harmonics]) / own[:, None]
    inverse_prior = np.zeros(rows.shape[1])
    inverse_prior[problem.extra : problem.size] = problem.spread(best.asymmetry) ** -2
    inverse_prior[problem.size :] = 1.0 / problem.correction_variances(best.correction)
    information = rows.T @ rows
    spent = np.trace(np.linalg.solve(information + np.diag(inverse_prior), information))
    return float(max(problem.count.sum() - spent, 1.0))


def _misfit(
    problem: SixSeatProblem, x: FloatArray, weighted: WeightedScales, repeats: Scatter
) -> float:
    """Lack of fit of a six-seat probe alone: its residuals against the scatter of repeats.

    The error of the reference's diameter is common to all touches: a level, not residuals.
    """
    if repeats.dof < WELL_KNOWN_NOISE:
        return math.nan
    from scipy.special import fdtrc

    noise = max(repeats.deviation, LEAST_NOISE)
    alone = PriorScales(weighted.scales[0].asymmetry, LEAST_NOISE, 0.0, noise)
    best, _ = most_probable(problem, alone, x)
    misses, slopes = problem.misses(best)
    covariance = problem.covariance(alone)
    rows = covariance.whitened(slopes)
    priors = np.zeros(problem.size)
    priors[problem.extra :] = problem.spread(alone.asymmetry) ** -2
    information = rows.T @ rows
    spent = float(np.trace(np.linalg.solve(information + np.diag(priors), information)))
    free = max(len(misses) - spent, 1.0)
    beyond = float(np.sum(covariance.whitened(misses) ** 2))
    return float(fdtrc(free, repeats.dof, beyond / free))


def _with_disagreement(fit: PhysicalMapFit, problem: SixSeatProblem) -> PhysicalMapFit:
    """The fit with the difference from a harmonic map, where that shows another kind of probe.

    Residuals alone do not distinguish noise from what a six-seat probe does not represent, unless
    directions are repeated. A map that knows nothing of seats takes the latter for lobes. `problem`
    has the touches of the fit, or some of very many.
    """
    observation = problem.observation
    other = fit_harmonic(observation)
    directions = _between_touches(observation)
    apart = fit.basis.value(directions, fit.coefficients)
    apart = apart - other.basis.value(directions, other.coefficients)
    free = directions[:, : observation.axes]  # a shift of the reference; and a level
    free = np.hstack([free, np.ones((len(free), 1))]) if not observation.tip_known else free
    apart = apart - free @ np.linalg.lstsq(free, apart, rcond=None)[0]
    explained = sum(
        each.covariance.variance_of(each.basis.design(directions)).mean() for each in (fit, other)
    )
    difference = float(np.mean(apart**2))
    if difference <= _SURELY_APART * explained:
        return fit
    own = 5 + len(PARAMETERS)
    share = problem.correction_shares()
    covariance = fit.covariance.matrix.copy()
    covariance[own:, own:] += difference * np.diag(share)
    return replace(fit, covariance=Covariance.full(covariance), disagreement=math.sqrt(difference))


def _between_touches(observation: Observation) -> FloatArray:
    """Directions spread over those that the touches support."""
    touched = observation.group_directions
    if observation.ring:
        return from_angles(0.5 * np.pi, np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False))
    spread = fibonacci_cap(300, float(polar_angle(touched).max()))
    return np.concatenate([touched, spread[observation.support.supports(spread)]])


def _averaged(
    fit: PhysicalMapFit,
    others: list[PhysicalMapFit],
    evidence: FloatArray,
    problem: SixSeatProblem,
) -> PhysicalMapFit:
    """The fit with the mean of several modes, and with their differences in its covariance.

    Each mode has a share by its evidence. Its difference from the first is written as harmonics of
    the correction, smoothed by their prior; a shift of the reference is no difference.
    """
    shares = np.exp(evidence - evidence.max())
    shares /= shares.sum()
    directions = _between_touches(problem.observation)
    values = [each.basis.value(directions, each.coefficients) for each in (fit, *others)]
    apart = np.stack(values) - values[0]
    free = directions[:, : problem.axes]
    if not problem.observation.tip_known:
        free = np.hstack([free, np.ones((len(free), 1))])
    apart -= (free @ np.linalg.lstsq(free, apart.T, rcond=None)[0]).T
    harmonics = real_spherical_harmonics(directions, problem.terms)
    damped = _SMOOTHING * len(directions) * np.diag(1.0 / problem.correction_shares())
    by_harmonics = np.linalg.solve(harmonics.T @ harmonics + damped, harmonics.T @ apart.T).T
    middle = shares @ by_harmonics
    off = by_harmonics - middle
    own = 5 + len(PARAMETERS)
    coefficients, covariance = fit.coefficients.copy(), fit.covariance.matrix.copy()
    coefficients[own:] += middle
    covariance[own:, own:] += (off.T * shares) @ off
    return replace(fit, coefficients=coefficients, covariance=Covariance.full(covariance))


def _to_coefficients(problem: SixSeatProblem) -> FloatArray:
    """Change of the map's coefficients with each unknown and correction, (k, u).

    Points are measured from the centre of the reference. An error of the map that looks like a
    shift moves this centre too, and leaves the distances as they are: the shift is subtracted.
    """
    count = len(PARAMETERS) + len(problem.terms)
    found = np.zeros((5 + count, problem.extra + count))
    found[2 : 2 + problem.axes, : problem.axes] = -np.eye(problem.axes)
    found[5:, problem.extra :] = np.eye(count)
    if not problem.observation.tip_known:
        found[1, problem.axes] = -1.0  # a larger tip means less pretravel
    return found


def _gauge(problem: SixSeatProblem, unknowns: FloatArray, covariance: FloatArray) -> str:
    """What pretravel is relative to, in words."""
    axes = problem.axes
    u_gauge = np.sqrt(np.diag(covariance)[:axes]) / MICROMETRE
    along = "" if axes == 2 else f" and {u_gauge[2]:.2f} µm along it"
    tip = ""
    if not problem.observation.tip_known:
        radius = problem.observation.tip_radius + float(unknowns[axes])
        u_tip = math.sqrt(covariance[axes, axes])
        tip = (
            f". The tip's diameter, {2.0 * radius:.4f} mm, u = {2.0 * u_tip / MICROMETRE:.1f} µm, "
            "follows from the model and is not measured"
        )
    return (
        "the six-seat model (a tripod that rests on six seats). Touches alone cannot show where "
        "the centre of the reference is: with the centre 1 µm further to +x, and 1 µm more "
        "pretravel on its +x side and 1 µm less on its -x side, the touches would be the same. The "
        f"model decides, with u = {float(np.max(u_gauge[:2])):.2f} µm across the axis{along}. This "
        "error shifts all points of a part alike and cancels in distances and diameters; u of "
        "the map and of a point contain only the part of it that comes from the scatter of the "
        f"touches{tip}"
    )
