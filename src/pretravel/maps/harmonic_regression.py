"""Harmonics from few touches: a regression with priors that describe kinematic probes.

A map of spherical harmonics has more coefficients than a sphere has touches. Each coefficient
therefore has a prior variance, whose size is estimated from the data (empirical Bayes, restricted
likelihood):

- zonal harmonics, and harmonics with three lobes around the axis (orders 3, 6, 9,
  ...) that are even about one azimuth, belong to the ideal three-rod probe; their
  amplitudes and that azimuth are estimated;
- all others describe the asymmetry of the probe; they share one amplitude, which is usually small;
- amplitudes decrease with the degree. Trigger force has kinks where another seat opens first, and
  the coefficients of a function with kinks decrease with the power 2.5.

The centre of the reference and the mean have no prior.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray, IntArray
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics
from pretravel.units import DEGREE, MICROMETRE

LOBE_DEGREES = (15, 24)
"""Largest degree of zonal and three-lobed harmonics, for few and for many directions.

Twenty-five directions resolve degree 15 at most. Kinks contribute 0.2 um of a 25 um map above it,
which hundreds of directions resolve."""
ASYMMETRY_DEGREE = 8
"""Largest degree of all others on a sphere."""
RING_DEGREE = 30
"""Largest order on a ring, where all orders are resolved."""

_SMALLEST_NOISE = 1e-5  # um: the last digit of a position in mm with eight decimals
_DECAY, _DECAY_SPREAD = 2.5, 0.7  # kinks on a sphere: power 2.5
_ASYMMETRY, _ASYMMETRY_SPREAD = -2.0, 1.5  # log of asymmetry over lobes, vague
_TYPICAL_NOISE, _NOISE_SPREAD = math.log(0.3), 2.0  # log um, vague


@dataclass(frozen=True, eq=False)
class HarmonicFit:
    """Result of the regression, in mm.

    Attributes
    ----------
    terms : (k, 2) int
        Degree and order; the first is (0, 0), then those of a translation, then the harmonics
        with a prior.
    coefficients : (k,) float
        Posterior mean.
    covariance : (k, k) float
        Posterior covariance.
    noise : float
        Standard deviation of a single touch, estimated by the likelihood.
    lobe_azimuth : float
        About which the lobes are even, in [0, 60°). [rad]
    hat : (n, n) float
        Fitted values per observed value.
    amplitudes : (7,) float
        Estimated by the likelihood; with them a fit can be repeated without a new estimate.
    """

    terms: IntArray
    coefficients: FloatArray
    covariance: FloatArray
    noise: float
    lobe_azimuth: float
    hat: FloatArray
    amplitudes: FloatArray


def sphere_terms(directions: int) -> IntArray:
    """Degrees and orders used on a sphere: without degrees 0 and 1.

    Parameters
    ----------
    directions : int
        Number of touched directions.

    Returns
    -------
    (k, 2) int

    >>> sphere_terms(25).max(), sphere_terms(1000).max()
    (np.int64(15), np.int64(24))
    """
    lowest, highest = LOBE_DEGREES
    terms = degrees_and_orders(min(max(12 + directions // 8, lowest), highest))
    lobed = terms[:, 1] % 3 == 0
    return np.asarray(terms[(terms[:, 0] > 1) & (lobed | (terms[:, 0] <= ASYMMETRY_DEGREE))])


def ring_terms() -> IntArray:
    """Orders used on a ring: harmonics of degree = order, from 2.

    >>> ring_terms()[:2].tolist()
    [[2, 2], [2, -2]]
    """
    return np.array(
        [(m, sign * m) for m in range(2, RING_DEGREE + 1) for sign in (1, -1)], dtype=np.int64
    )


class _Problem:
    """The regression, reduced to the terms of the likelihood; lengths in um."""

    def __init__(
        self,
        directions: FloatArray,
        values: FloatArray,
        groups: IntArray,
        free: IntArray,
        terms: IntArray,
    ) -> None:
        free_design = real_spherical_harmonics(directions, free)
        design = real_spherical_harmonics(directions, terms)
        # Repeats of a direction enter by their mean and their scatter.
        count = np.bincount(groups).astype(np.float64)
        self.mean = np.zeros((len(count), len(groups)))
        self.mean[groups, np.arange(len(groups))] = 1.0 / count[groups]
        root = np.sqrt(count)[:, None]
        self.root = root
        y = self.mean @ values
        self.within = float(np.sum((values - y[groups]) ** 2))
        self.within_dof = float(len(values) - len(count))
        self.free = root * (self.mean @ free_design)
        self.design = root * (self.mean @ design)
        self.y = root[:, 0] * y
        self.rows = (free_design, design)
        stacked = np.hstack([self.free, self.design, self.y[:, None]])
        if len(stacked) > stacked.shape[1]:  # an orthogonal reduction is exact
            stacked = np.asarray(np.linalg.qr(stacked, mode="r"))
            # Its last row is the part that no column explains: scatter, as among repeats.
            self.within += float(stacked[-1, -1] ** 2)
            self.within_dof += float(len(count) - (stacked.shape[1] - 1))
            stacked = stacked[:-1]
        split = free_design.shape[1]
        self.small_free = stacked[:, :split]
        self.small_design = stacked[:, split:-1]
        self.small_y = stacked[:, -1]
        degree, order = terms[:, 0], terms[:, 1]
        self.degree = degree / 3.0
        self.zonal = order == 0
        self.even = np.flatnonzero((order % 3 == 0) & (order > 0))
        partner = {(int(d), int(m)): i for i, (d, m) in enumerate(terms)}
        self.odd = np.array(
            [partner[(int(degree[i]), -int(order[i]))] for i in self.even], dtype=np.int64
        )
        self.order = order[self.even]
        self.lobe = np.zeros(len(terms), dtype=bool)
        self.lobe[self.even] = True

    def turned(self, design: FloatArray, azimuth: float) -> FloatArray:
        """Columns of lobes even and odd about an azimuth, instead of about +x."""
        cosine, sine = np.cos(self.order * azimuth), np.sin(self.order * azimuth)
        result = design.copy()
        even, odd = design[:, self.even], design[:, self.odd]
        result[:, self.even] = even * cosine + odd * sine
        result[:, self.odd] = odd * cosine - even * sine
        return result

    def prior_variances(self, h: FloatArray) -> FloatArray:
        zonal, lobe, other = np.exp(2.0 * h[:3])
        log_degree = np.log(self.degree)
        return np.asarray(
            np.where(
                self.zonal,
                zonal * np.exp(-2.0 * h[3] * log_degree),
                np.where(
                    self.lobe,
                    lobe * np.exp(-2.0 * h[4] * log_degree),
                    other * np.exp(-2.0 * _DECAY * log_degree),
                ),
            )
        )

    def cost(self, h: FloatArray) -> float:
        """Minus log restricted likelihood and log prior of the amplitudes."""
        variance = math.exp(2.0 * h[5])
        design = self.turned(self.small_design, h[6])
        total = (design * self.prior_variances(h)) @ design.T
        total[np.diag_indices_from(total)] += variance
        try:
            factor = np.linalg.cholesky(total)
        except np.linalg.LinAlgError:
            return 1e12
        right = np.linalg.solve(factor, np.column_stack([self.small_free, self.small_y]))
        free, y = right[:, :-1], right[:, -1]
        normal = free.T @ free
        residual = y - free @ np.linalg.solve(normal, free.T @ y)
        likelihood = (
            0.5 * float(residual @ residual)
            + float(np.log(np.diag(factor)).sum())
            + 0.5 * float(np.linalg.slogdet(normal)[1])
            + self.within_dof * h[5]
            + 0.5 * self.within / variance
        )
        prior = (
            ((h[3] - _DECAY) / _DECAY_SPREAD) ** 2
            + ((h[4] - _DECAY) / _DECAY_SPREAD) ** 2
            + ((h[2] - h[1] - _ASYMMETRY) / _ASYMMETRY_SPREAD) ** 2
            + ((h[5] - _TYPICAL_NOISE) / _NOISE_SPREAD) ** 2
        )
        return float(likelihood + 0.5 * prior)


def fit_harmonics(
    directions: FloatArray,
    values: FloatArray,
    groups: IntArray,
    free: IntArray,
    terms: IntArray,
    amplitudes: FloatArray | None = None,
) -> HarmonicFit:
    """Fit harmonics of pretravel; the mean and the position of the reference have no prior.

    Parameters
    ----------
    directions : (n, 3) float
        Contact normals in the probe frame.
    values : (n,) float
        Observed pretravel; it contains a translation of the reference. [mm]
    groups : (n,) int
        Number of the direction of each touch, 0 to g - 1.
    free : (f, 2) int
        Terms without a prior: the mean, and those of a translation (degree 1).
    terms : (k, 2) int
        Terms with a prior.
    amplitudes : (7,) float, optional
        Of an earlier fit, which are kept.

    Returns
    -------
    HarmonicFit

    >>> from pretravel.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> values = 0.010 + 0.002 * real_spherical_harmonics(n, [(3, 3)])[:, 0]
    >>> fit = fit_harmonics(n, values, np.arange(25), degrees_and_orders(1), sphere_terms(25))
    >>> found = fit.coefficients[(fit.terms == (3, 3)).all(axis=1)]
    >>> bool(abs(found[0] - 0.002) < 1e-4)
    True
    """
    problem = _Problem(directions, values / MICROMETRE, groups, free, terms)
    if amplitudes is None:
        amplitudes = _estimated_amplitudes(problem)
    return _posterior(problem, amplitudes, free, terms)


def _estimated_amplitudes(problem: _Problem) -> FloatArray:
    """Amplitudes of greatest restricted likelihood, from the best azimuths of the lobes, (7,)."""
    from scipy.optimize import minimize
    from threadpoolctl import threadpool_limits

    # Start from the scatter: repeats determine the noise, the residual the amplitudes.
    residual = (
        problem.small_y
        - problem.small_free @ np.linalg.lstsq(problem.small_free, problem.small_y, rcond=None)[0]
    )
    spread = max(float(np.sqrt(np.mean(residual**2))), 10.0 * _SMALLEST_NOISE)
    noise = (
        math.sqrt(problem.within / problem.within_dof) if problem.within_dof > 0 else 0.3 * spread
    )
    low = math.log(_SMALLEST_NOISE)
    noise_start = min(max(math.log(max(noise, _SMALLEST_NOISE)), low), math.log(spread) + 1.0)
    amplitude = math.log(spread)

    def start(azimuth: float) -> FloatArray:
        return np.array(
            [amplitude, amplitude, amplitude - 2.0, _DECAY, _DECAY, noise_start, azimuth]
        )

    azimuths = np.arange(0.0, 60.0, 7.5) * DEGREE
    bounds = [(low, amplitude + 4.0)] * 3 + [(1.0, 5.0)] * 2 + [(low, amplitude + 2.0)]
    bounds += [(-math.inf, math.inf)]
    # For matrices of this size threads gain nothing, and cost much on a busy machine.
    with threadpool_limits(1, user_api="blas"):
        costs = [problem.cost(start(azimuth)) for azimuth in azimuths]
        found = min(
            (
                minimize(problem.cost, start(azimuths[i]), method="L-BFGS-B", bounds=bounds)
                for i in np.argsort(costs)[:2]
            ),
            key=lambda result: float(result.fun),
        )
    return np.asarray(found.x)


def _posterior(problem: _Problem, h: FloatArray, free: IntArray, terms: IntArray) -> HarmonicFit:
    """Coefficients and covariance at given amplitudes."""
    variance = math.exp(2.0 * h[5])
    prior = problem.prior_variances(h)
    design = problem.turned(problem.design, h[6])
    # Least squares on data and prior together, by QR, which stays exact without noise, where
    # normal equations lose all digits.
    count, split, size = len(design), problem.free.shape[1], len(terms)
    stacked = np.zeros((count + size, split + size))
    stacked[:count, :split] = problem.free
    stacked[:count, split:] = design * np.sqrt(prior)
    stacked[count:, split:] = math.sqrt(variance) * np.eye(size)
    q, r = np.linalg.qr(stacked)
    inverse = np.linalg.inv(r)
    scale = np.concatenate([np.ones(split), np.sqrt(prior)])
    to_coefficients = scale[:, None] * (inverse @ q[:count].T)
    root = math.sqrt(variance) * scale[:, None] * inverse
    # Back from lobes about their own azimuth to cosine and sine about +x.
    turn = np.eye(split + size)
    even, odd = split + problem.even, split + problem.odd
    cosine, sine = np.cos(problem.order * h[6]), np.sin(problem.order * h[6])
    turn[even, even], turn[even, odd] = cosine, -sine
    turn[odd, even], turn[odd, odd] = sine, cosine
    to_coefficients, root = turn @ to_coefficients, turn @ root
    rows = np.hstack(problem.rows)
    hat = rows @ to_coefficients @ (problem.root * problem.mean)
    return HarmonicFit(
        terms=np.concatenate([free, terms]),
        coefficients=to_coefficients @ problem.y * MICROMETRE,
        covariance=root @ root.T * MICROMETRE**2,
        noise=math.sqrt(variance) * MICROMETRE,
        lobe_azimuth=float(np.mod(h[6], 60.0 * DEGREE)),
        hat=np.asarray(hat),
        amplitudes=h,
    )
