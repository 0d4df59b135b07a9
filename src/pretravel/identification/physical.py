"""The physical kind of qualification: a six-seat probe fitted to touches on a reference."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.model.hertz import curved_part_factor
from pretravel.qualification.map_fit import MapFit
from pretravel.qualification.observation import Observation
from pretravel.trigger.six_seats import (
    IDEAL,
    PARAMETERS,
    SixSeatBasis,
    along_normal,
    six_seat_response,
    six_seat_slopes,
)
from pretravel.units import DEGREE, MICROMETRE

FEWEST_DIRECTIONS = 8
"""Ideal probe, centre and level are ten numbers; priors help, but not below this."""
ASYMMETRY_SCALES = (0.03, 0.1, 0.3, 1.0, 3.0)
"""How asymmetric a probe may be, as multiples of the spreads of `ASYMMETRIES`; the likelihood
chooses."""
_TYPICAL_ASYMMETRY, _ASYMMETRY_SPREAD = math.log(0.3), 1.2
_TYPICAL_NOISE = 0.3 * MICROMETRE
_LEAST_NOISE = 1e-3 * MICROMETRE
_WELL_KNOWN_NOISE = 10.0
"""Degrees of freedom among repeats from which these alone give the noise."""
MISFIT_LEVEL = 0.01
"""Chance that a good six-seat probe is said to be none."""
_STEEPEST = (5.0 * DEGREE, 80.0 * DEGREE)
_ASYMMETRIC = slice(len(IDEAL), None)
_NAMES = [parameter.name for parameter in PARAMETERS]


@dataclass(frozen=True, eq=False, kw_only=True)
class PhysicalMapFit(MapFit):
    """A map fitted as a six-seat probe, with all that the fit says about itself.

    Attributes
    ----------
    basis : SixSeatBasis
    parameter_covariance : (18, 18) float
        Of `PARAMETERS`, posterior.
    learned : (18,) float
        Share of each number's prior variance that the touches took away: 0, nothing was
        learned; 1, the prior does not matter.
    asymmetry_scale : float
        Which of `ASYMMETRY_SCALES` the likelihood chose.
    gauge_uncertainty : (axes,) float
        Of the shift that touches cannot tell from the map. [mm]
    misfit : float
        Chance of residuals this large were the probe of this kind; nan without repeats.
    """

    basis: SixSeatBasis
    parameter_covariance: FloatArray
    learned: FloatArray
    asymmetry_scale: float
    gauge_uncertainty: FloatArray
    misfit: float


class _Problem:
    """Residuals and slopes of touches and priors together, in units of their spreads.

    Unknowns: shift of the centre (axes), tip radius where it was not told, `PARAMETERS`.
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
        seen, values = self.moved(x), x[self.extra :]
        response = six_seat_response(values, self.observation.tip_radius)
        modelled = along_normal(response, seen.directions, self.compression)
        return np.asarray(seen.values + self.level(x) - modelled)

    def residuals(self, x: FloatArray) -> FloatArray:
        try:
            misses = self.misses(x)
        except PretravelError:  # seats that hold nothing: far away from every prior
            misses = np.full(len(self.observation.groups), 1.0)
        misses = np.where(np.isfinite(misses), misses, 1.0)
        return np.concatenate([misses / self.noise, (x[self.extra :] - self.prior) / self.spread])

    def jacobian(self, x: FloatArray) -> FloatArray:
        seen, values = self.moved(x), x[self.extra :]
        slopes = six_seat_slopes(
            values, self.observation.tip_radius, seen.directions, self.compression
        )
        # Moving the centre by s adds n·s to what is observed (in a ring as on a sphere).
        shift = seen.directions[:, : self.axes]
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
    """Touches less the numbers they had to pay for."""
    jacobian = problem.jacobian(x)
    touches = jacobian[: len(problem.observation.groups)]
    spent = np.trace(np.linalg.solve(jacobian.T @ jacobian, touches.T @ touches))
    return float(max(len(touches) - spent, 1.0))


def fit_physical(observation: Observation, noise: float, noise_dof: float) -> PhysicalMapFit:
    """The six-seat probe that explains touches on a sphere or in a ring best.

    Parameters
    ----------
    observation : Observation
    noise, noise_dof : float
        Standard deviation among repeats [mm], and its degrees of freedom (0: none).

    Returns
    -------
    PhysicalMapFit

    Raises
    ------
    PretravelError
        Fewer than eight directions.

    Notes
    -----
    Posterior mode of touches and priors (`pretravel.trigger.six_seats.PARAMETERS`), from
    several orientations of the tripod. How asymmetric the probe may be is chosen by the
    likelihood. The map's covariance is that of distances: what a shift of the
    reference explains is taken out of it and stated as `gauge_uncertainty`.

    References
    ----------
    Shen & Springer 1998 and Estler 1996, 1997 fit such models; Woźniak and Rodrigues 2021
    have the same statics.
    """
    count = int(observation.groups.max()) + 1
    if count < FEWEST_DIRECTIONS:
        raise PretravelError(
            f"{count} directions are too few for kind physical: a six-seat probe has seven numbers "
            f"beside centre and asymmetry; touch at least {FEWEST_DIRECTIONS}, 25 are good"
        )
    sigma = max(noise, _LEAST_NOISE) if noise_dof >= _WELL_KNOWN_NOISE else _TYPICAL_NOISE
    starts = _oriented(_Problem(observation, sigma, ASYMMETRY_SCALES[0]))
    for _ in range(8):
        found = [_asymmetric(observation, sigma, start) for start in starts]
        _, scale, problem, x = min(found, key=lambda mode: mode[0])
        # From the second round on the better of two explanations alone.
        starts = [x]
        dof = _effective_dof(problem, x)
        misses = problem.misses(x)
        seen = math.sqrt(float(misses @ misses) / dof)
        if noise_dof >= _WELL_KNOWN_NOISE:
            break
        last, sigma = sigma, max(seen, _LEAST_NOISE)
        if abs(sigma / last - 1.0) < 0.02:
            break
    return _concluded(problem, x, scale, dof, sigma, noise_dof)


def _oriented(problem: _Problem) -> list[FloatArray]:
    """The ideal probe, from eight azimuths of the tripod: the best, and another like it."""
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
    """Between two azimuths of a tripod, of which every third of a turn is alike. [rad]"""
    third = 120.0 * DEGREE
    return abs((first - second + 0.5 * third) % third - 0.5 * third)


def _asymmetric(
    observation: Observation, sigma: float, start: FloatArray
) -> tuple[float, float, _Problem, FloatArray]:
    """Minus its log evidence, and the scale of asymmetry that is likeliest, with the fit at it."""
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


def _concluded(
    problem: _Problem, x: FloatArray, scale: float, dof: float, sigma: float, noise_dof: float
) -> PhysicalMapFit:
    observation, axes = problem.observation, problem.axes
    misses = problem.misses(x)
    seen = math.sqrt(float(misses @ misses) / dof)
    misfit = math.nan
    if noise_dof >= _WELL_KNOWN_NOISE:
        from scipy.stats import f as fisher

        # Lack of fit: what the residuals have beyond the scatter of repeats, against it.
        beyond = max(float(misses @ misses) - noise_dof * sigma**2, 0.0)
        free = max(dof - noise_dof, 1.0)
        misfit = float(fisher.sf(beyond / free / sigma**2, free, noise_dof))
    # As for the other kinds: what the model misses is its uncertainty in any direction.
    missed = max(seen**2 - sigma**2, 0.0) if misfit < MISFIT_LEVEL else 0.0
    jacobian = problem.jacobian(x)
    covariance: FloatArray = np.linalg.inv(jacobian.T @ jacobian).astype(np.float64)
    values, of_values = x[problem.extra :], slice(problem.extra, None)
    basis = SixSeatBasis(values, observation.tip_radius)
    moved = problem.moved(x)
    slopes = basis.slopes(moved.directions)
    # What a shift explains of each slope, as a least-squares reference would take it up.
    to_sphere = moved.to_sphere
    explained = np.zeros((5, len(PARAMETERS)))
    explained[2 : 2 + axes] = -(to_sphere @ slopes)[1:]
    to_coefficients = np.zeros((basis.size, len(x)))
    to_coefficients[:5, of_values] = explained
    to_coefficients[5:, of_values] = np.eye(len(PARAMETERS))
    if not observation.tip_known:
        to_coefficients[1, axes] = -1.0  # a larger tip is less pretravel
    of_map = to_coefficients @ covariance @ to_coefficients.T
    of_map[1, 1] += missed
    gauge = covariance[:axes, :axes]
    u_gauge = np.sqrt(np.diag(gauge))
    tip = ""
    if not observation.tip_known:
        u_tip = math.sqrt(covariance[axes, axes])
        tip = (
            f"; the tip's diameter, {2.0 * (observation.tip_radius + problem.level(x)):.4f} mm, "
            f"u = {2.0 * u_tip / MICROMETRE:.1f} µm, is what the model makes of it, no measurement"
        )
    along = "" if axes == 2 else f", {u_gauge[2] / MICROMETRE:.2f} along"
    to_mean = observation.to_sphere[0]
    prior_variance = problem.spread**2
    return PhysicalMapFit(
        basis=basis,
        coefficients=np.concatenate([[1.0], np.zeros(basis.size - 1)]),
        covariance=0.5 * (of_map + of_map.T),
        mean=float(to_mean @ observation.values),
        u_mean=float(np.linalg.norm(to_mean)) * sigma,
        shift=-x[:axes],
        shift_covariance=gauge,
        residuals=misses,
        dof=dof,
        noise=seen,
        gauge="the six-seat model: a shift of the reference looks like its first harmonic, which "
        f"the model and its priors tell to {float(np.max(u_gauge[:2])) / MICROMETRE:.2f} µm across "
        f"the axis{along} (u of the map is of distances, without that shift){tip}",
        noise_is_repeatability=not misfit < MISFIT_LEVEL,
        tip_radius=None if observation.tip_known else observation.tip_radius + problem.level(x),
        parameter_covariance=covariance[of_values, of_values],
        learned=1.0 - np.diag(covariance)[of_values] / prior_variance,
        asymmetry_scale=scale,
        gauge_uncertainty=u_gauge,
        misfit=misfit,
    )
