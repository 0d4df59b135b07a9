"""Kind physical: a six-seat probe fitted to touches on a reference.

Its basis is `pretravel.trigger.six_seats.SixSeatBasis`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.maps.kind import KindOfMap, MapFit
from pretravel.maps.observation import Observation, Scatter
from pretravel.model.hertz import curved_part_factor
from pretravel.trigger.six_seats import (
    IDEAL,
    PARAMETERS,
    SixSeatBasis,
    along_normal,
    six_seat_response,
    six_seat_slopes,
)
from pretravel.uncertainty.covariance import Covariance
from pretravel.units import DEGREE, MICROMETRE

FEWEST_FOR_SIX_SEATS = 8
"""Ideal probe, centre and level are ten numbers; with priors this many directions suffice."""
FEW_FOR_SIX_SEATS = 15
"""A physical map from fewer directions than this is warned about."""
ASYMMETRY_SCALES = (0.03, 0.1, 0.3, 1.0, 3.0)
"""Scales of asymmetry, as multiples of the spreads of `ASYMMETRIES`; the likelihood chooses
one."""
_TYPICAL_ASYMMETRY, _ASYMMETRY_SPREAD = math.log(0.3), 1.2
_TYPICAL_NOISE = 0.3 * MICROMETRE
_LEAST_NOISE = 1e-3 * MICROMETRE
_WELL_KNOWN_NOISE = 10.0
"""Degrees of freedom among repeats from which these alone determine the noise."""
MISFIT_LEVEL = 0.01
"""Probability that a good six-seat probe is reported as not of this kind."""
_STEEPEST = (5.0 * DEGREE, 80.0 * DEGREE)
_ASYMMETRIC = slice(len(IDEAL), None)
_NAMES = [parameter.name for parameter in PARAMETERS]


@dataclass(frozen=True, eq=False, kw_only=True)
class PhysicalMapFit(MapFit):
    """A map fitted as a six-seat probe.

    Attributes
    ----------
    basis : SixSeatBasis
    parameter_covariance : (18, 18) float
        Of `PARAMETERS`, posterior.
    learned : (18,) float
        Share of the prior variance of each parameter that the touches removed: 0, the touches
        contain nothing about it; 1, the prior has no effect.
    asymmetry_scale : float
        The one of `ASYMMETRY_SCALES` that the likelihood chose.
    gauge_uncertainty : (axes,) float
        Of the shift that touches cannot separate from the map. [mm]
    misfit : float
        Probability of residuals this large for a six-seat probe; nan without repeats.
    """

    basis: SixSeatBasis
    parameter_covariance: FloatArray
    learned: FloatArray
    asymmetry_scale: float
    gauge_uncertainty: FloatArray
    misfit: float


class _Problem:
    """Residuals and slopes of touches and priors together, in units of their spreads.

    Unknowns: shift of the centre (axes), tip radius where it was not given, `PARAMETERS`.
    """

    def __init__(self, observation: Observation, noise: float, scale: float) -> None:
        self.observation, self.noise = observation, noise
        self.axes = observation.axes
        self.extra = self.axes + (0 if observation.tip_known else 1)
        self.prior = np.array([p.prior for p in PARAMETERS])
        self.spread = np.array([p.spread for p in PARAMETERS])
        self.spread[_ASYMMETRIC] *= scale
        radius = observation.reference_radius
        # A ring is concave; on its axis it is straight.
        bends = (-1.0 / radius, 0.0) if observation.ring else (1.0 / radius, 1.0 / radius)
        factor = float(curved_part_factor(observation.tip_radius, np.array([bends]))[0])
        self.compression = factor if math.isfinite(factor) else 1.0

    def moved(self, x: FloatArray) -> Observation:
        center = self.observation.center.copy()
        center[: self.axes] += x[: self.axes]
        return replace(self.observation, center=center)

    def level(self, x: FloatArray) -> float:
        return 0.0 if self.observation.tip_known else float(x[self.axes])

    def misses(self, x: FloatArray) -> FloatArray:
        """Observed less modelled pretravel, (n,). [mm]"""
        moved, values = self.moved(x), x[self.extra :]
        response = six_seat_response(values, self.observation.tip_radius)
        modelled = along_normal(response, moved.directions, self.compression)
        return np.asarray(moved.values + self.level(x) - modelled)

    def residuals(self, x: FloatArray) -> FloatArray:
        try:
            misses = self.misses(x)
        except PretravelError:  # seats that do not hold the tripod: far from every prior
            misses = np.full(len(self.observation.groups), 1.0)
        misses = np.where(np.isfinite(misses), misses, 1.0)
        return np.concatenate([misses / self.noise, (x[self.extra :] - self.prior) / self.spread])

    def jacobian(self, x: FloatArray) -> FloatArray:
        moved, values = self.moved(x), x[self.extra :]
        slopes = six_seat_slopes(
            values, self.observation.tip_radius, moved.directions, self.compression
        )
        # A centre moved by s adds n·s to the observed pretravel, on a sphere as in a ring.
        shift = moved.directions[:, : self.axes]
        level = np.ones((len(shift), self.extra - self.axes))
        rows = np.hstack([shift, level, -slopes]) / self.noise
        priors = np.hstack([np.zeros((len(values), self.extra)), np.diag(1.0 / self.spread)])
        return np.vstack([np.where(np.isfinite(rows), rows, 0.0), priors])

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        size = self.extra + len(PARAMETERS)
        low, high = np.full(size, -np.inf), np.full(size, np.inf)
        angle = self.extra + _NAMES.index("support_angle")
        low[angle], high[angle] = _STEEPEST
        return low, high


def _solve(problem: _Problem, start: FloatArray, evaluations: int) -> tuple[FloatArray, float]:
    from scipy.optimize import least_squares

    scale = np.concatenate(
        [np.full(problem.extra, 1.0 * MICROMETRE), np.minimum(problem.spread, 1.0)]
    )
    found = least_squares(
        problem.residuals,
        start,
        problem.jacobian,
        bounds=problem.bounds(),
        x_scale=scale,
        max_nfev=evaluations,
        ftol=1e-7,
        xtol=1e-6,
    )
    return np.asarray(found.x), float(found.cost)


def _evidence(problem: _Problem, x: FloatArray, cost: float) -> float:
    """Minus the logarithm of the likelihood, parameters integrated out (Laplace)."""
    jacobian = problem.jacobian(x)
    _, determinant = np.linalg.slogdet(jacobian.T @ jacobian)
    return cost + 0.5 * float(determinant) + float(np.sum(np.log(problem.spread)))


def _effective_dof(problem: _Problem, x: FloatArray) -> float:
    """Number of touches less the effective number of fitted parameters."""
    jacobian = problem.jacobian(x)
    touches = jacobian[: len(problem.observation.groups)]
    spent = np.trace(np.linalg.solve(jacobian.T @ jacobian, touches.T @ touches))
    return float(max(len(touches) - spent, 1.0))


@dataclass(frozen=True)
class PhysicalKind(KindOfMap):
    """A six-seat probe: statics of the tripod, linear compliance, Hertz contact."""

    name: ClassVar[str] = "physical"
    title: ClassVar[str] = "six-seat probe"

    def fit(self, observation: Observation, repeats: Scatter) -> PhysicalMapFit:
        return fit_physical(observation, repeats)

    def warnings(self, fit: MapFit, repeatability: float) -> list[str]:
        del repeatability
        assert isinstance(fit, PhysicalMapFit)
        found = []
        count = fit.observation.direction_count
        if count < FEW_FOR_SIX_SEATS:
            found.append(
                f"{count} directions are few for a six-seat probe: another one may explain them "
                "as well, and u of the map does not contain that; touch 25"
            )
        if fit.misfit < MISFIT_LEVEL:
            found.append(
                "this probe is not quite of the six-seat kind: the residuals are larger than the "
                f"scatter of repeats (probability {fit.misfit:.2g} for a six-seat probe). The part "
                "of pretravel that the model does not represent is in u of the map; compare the "
                "kinds of map (auto)"
            )
        return found


def fit_physical(observation: Observation, repeats: Scatter) -> PhysicalMapFit:
    """The six-seat probe that explains touches on a sphere or in a ring best.

    Parameters
    ----------
    observation : Observation
    repeats : Scatter
        Of repeated touches.

    Returns
    -------
    PhysicalMapFit

    Raises
    ------
    PretravelError
        Fewer than eight directions.

    Notes
    -----
    Posterior mode of touches and priors (`pretravel.trigger.six_seats.PARAMETERS`), from several
    orientations of the tripod. The likelihood chooses the scale of asymmetry. The covariance of the
    map is that of distances: the part that a shift of the reference explains is removed from it
    and stated as `gauge_uncertainty`.

    References
    ----------
    Shen & Springer 1998 and Estler 1996, 1997 fit such models; Woźniak and Rodrigues 2021
    use the same statics.
    """
    count = observation.direction_count
    if count < FEWEST_FOR_SIX_SEATS:
        raise PretravelError(
            f"{count} directions are too few for kind physical: a six-seat probe has seven "
            "parameters beside centre and asymmetry; touch at least "
            f"{FEWEST_FOR_SIX_SEATS} directions, 25 are good"
        )
    well_known = repeats.dof >= _WELL_KNOWN_NOISE
    sigma = max(repeats.deviation, _LEAST_NOISE) if well_known else _TYPICAL_NOISE
    starts = _oriented(_Problem(observation, sigma, ASYMMETRY_SCALES[0]))
    for _ in range(8):
        found = [_asymmetric(observation, sigma, start) for start in starts]
        _, scale, problem, x = min(found, key=lambda mode: mode[0])
        # From the second round on the better of two explanations alone.
        starts = [x]
        dof = _effective_dof(problem, x)
        if well_known:
            break
        last, sigma = sigma, max(_deviation(problem, x, dof), _LEAST_NOISE)
        if abs(sigma / last - 1.0) < 0.02:
            break
    return _concluded(problem, x, scale, Scatter(sigma, repeats.dof))


def _deviation(problem: _Problem, x: FloatArray, dof: float) -> float:
    misses = problem.misses(x)
    return math.sqrt(float(misses @ misses) / dof)


def _oriented(problem: _Problem) -> list[FloatArray]:
    """The ideal probe from eight azimuths of the tripod: the best fit, and one nearly as good."""
    start = np.concatenate([np.zeros(problem.extra), problem.prior])
    start[problem.axes : problem.extra] = 10.0 * MICROMETRE
    turned = problem.extra + _NAMES.index("rod_azimuth")
    first = []
    for azimuth in np.arange(0.0, 120.0, 15.0) * DEGREE:
        start[turned] = azimuth
        first.append(_solve(problem, start, 12))
    first.sort(key=lambda found: found[1])
    followed = sorted((_solve(problem, x, 200) for x, _ in first[:3]), key=lambda found: found[1])
    best, cost = followed[0]
    others = [
        x
        for x, other in followed[1:]
        if other < 1.5 * cost + 10.0 and _apart(x[turned], best[turned]) > 3.0 * DEGREE
    ]
    return [best, *others[:1]]


def _apart(first: float, second: float) -> float:
    """Angle between two azimuths of a tripod, which repeats every third of a turn. [rad]"""
    third = 120.0 * DEGREE
    return abs((first - second + 0.5 * third) % third - 0.5 * third)


def _asymmetric(
    observation: Observation, sigma: float, start: FloatArray
) -> tuple[float, float, _Problem, FloatArray]:
    """The most likely scale of asymmetry: minus the log evidence, scale, problem, fit."""
    best: tuple[float, float, _Problem, FloatArray] | None = None
    x = start
    for scale in ASYMMETRY_SCALES:
        problem = _Problem(observation, sigma, scale)
        x, cost = _solve(problem, x, 200)
        judged = _evidence(problem, x, cost)
        judged += 0.5 * ((math.log(scale) - _TYPICAL_ASYMMETRY) / _ASYMMETRY_SPREAD) ** 2
        if best is None or judged < best[0]:
            best = (judged, scale, problem, x)
    assert best is not None  # there are scales
    return best


def _concluded(problem: _Problem, x: FloatArray, scale: float, repeats: Scatter) -> PhysicalMapFit:
    """The fit at the posterior mode as a map with covariance."""
    observation, axes = problem.observation, problem.axes
    misses, dof = problem.misses(x), _effective_dof(problem, x)
    deviation = _deviation(problem, x, dof)
    misfit = _misfit(misses, dof, repeats)
    # As for the other kinds: what the model does not represent is its uncertainty in any direction.
    missed = max(deviation**2 - repeats.deviation**2, 0.0) if misfit < MISFIT_LEVEL else 0.0
    jacobian = problem.jacobian(x)
    covariance: FloatArray = np.linalg.inv(jacobian.T @ jacobian).astype(np.float64)
    of_values = slice(problem.extra, None)
    basis = SixSeatBasis(x[of_values], observation.tip_radius)
    to_coefficients = _to_coefficients(problem, x, basis)
    of_map = to_coefficients @ covariance @ to_coefficients.T
    of_map[1, 1] += missed
    gauge = covariance[:axes, :axes]
    to_mean = observation.to_sphere[0]
    return PhysicalMapFit(
        observation=observation,
        basis=basis,
        coefficients=np.eye(basis.size)[0],
        covariance=Covariance.full(0.5 * (of_map + of_map.T)),
        mean=float(to_mean @ observation.values),
        u_mean=float(np.linalg.norm(to_mean)) * repeats.deviation,
        shift=-x[:axes],
        shift_covariance=gauge,
        residuals=misses,
        dof=dof,
        noise=deviation,
        gauge=_gauge(problem, x, covariance),
        noise_is_repeatability=not misfit < MISFIT_LEVEL,
        tip_radius=None if observation.tip_known else observation.tip_radius + problem.level(x),
        parameter_covariance=covariance[of_values, of_values],
        learned=1.0 - np.diag(covariance)[of_values] / problem.spread**2,
        asymmetry_scale=scale,
        gauge_uncertainty=np.sqrt(np.diag(gauge)),
        misfit=misfit,
    )


def _misfit(misses: FloatArray, dof: float, repeats: Scatter) -> float:
    """Lack of fit: the part of the residuals beyond the scatter of repeats, against it."""
    if repeats.dof < _WELL_KNOWN_NOISE:
        return math.nan
    from scipy.stats import f as fisher

    variance = repeats.deviation**2
    beyond = max(float(misses @ misses) - repeats.dof * variance, 0.0)
    free = max(dof - repeats.dof, 1.0)
    return float(fisher.sf(beyond / free / variance, free, repeats.dof))


def _to_coefficients(problem: _Problem, x: FloatArray, basis: SixSeatBasis) -> FloatArray:
    """Change of the map's coefficients with each unknown, (k, unknowns)."""
    moved = problem.moved(x)
    # The part of each slope that a least-squares reference takes up as a shift.
    explained = np.zeros((5, len(PARAMETERS)))
    explained[2 : 2 + problem.axes] = -(moved.to_sphere @ basis.slopes(moved.directions))[1:]
    found = np.zeros((basis.size, len(x)))
    found[:5, problem.extra :] = explained
    found[5:, problem.extra :] = np.eye(len(PARAMETERS))
    if not problem.observation.tip_known:
        found[1, problem.axes] = -1.0  # a larger tip means less pretravel
    return found


def _gauge(problem: _Problem, x: FloatArray, covariance: FloatArray) -> str:
    """What pretravel is relative to, in words."""
    axes = problem.axes
    u_gauge = np.sqrt(np.diag(covariance)[:axes]) / MICROMETRE
    along = "" if axes == 2 else f", {u_gauge[2]:.2f} along"
    tip = ""
    if not problem.observation.tip_known:
        radius = problem.observation.tip_radius + problem.level(x)
        u_tip = math.sqrt(covariance[axes, axes])
        tip = (
            f"; the tip's diameter, {2.0 * radius:.4f} mm, u = {2.0 * u_tip / MICROMETRE:.1f} µm, "
            "follows from the model and is not measured"
        )
    return (
        "the six-seat model: a shift of the reference looks like its first harmonic, which the "
        f"model and its priors determine to {float(np.max(u_gauge[:2])):.2f} µm across the "
        f"axis{along} (u of the map is of distances, without that shift){tip}"
    )
