"""Harmonics from few touches: a regression with priors that describe kinematic probes.

A map of spherical harmonics has more coefficients than a sphere has touches. Each coefficient
therefore has a prior variance, whose size is estimated from the data (empirical Bayes, restricted
likelihood):

- zonal harmonics, and harmonics with three lobes around the axis (orders 3, 6, 9,
  ...) that are even about one azimuth, belong to the ideal three-rod probe; their
  amplitudes, usually a share of the mean pretravel, and that azimuth are estimated;
- all others describe the asymmetry of the probe; they share one amplitude, which is usually small;
- amplitudes decrease with the degree. Trigger force has kinks where another seat opens first, and
  the coefficients of a function with kinks decrease with the power 2.5;
- directions scatter by more than their repeats do: hysteresis, the step of a scale.

The centre of the reference and the mean have no prior. Touches determine amplitudes and scatter
badly. The posterior is therefore averaged over them, and its uncertainty contains theirs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, IntArray
from pretravel.maps.harmonic_likelihood import (
    DECAY,
    OF_NOISE,
    OF_TURN,
    TYPICAL_FIXED,
    TYPICAL_NOISE,
    RestrictedLikelihood,
    diagonal,
)
from pretravel.maps.likelihood_search import bounded_mode, spread_points
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import Smoothing

_SMALLEST_NOISE = 1e-5  # um: the last digit of a position in mm with eight decimals
_FEW_RESIDUALS = 8
"""Fewer of them can all be near zero by chance, or by the step of the positions: they are not scale
of amplitudes that they do not show."""
_EXACT = 1e-2  # um: scatter from which normal equations are exact enough
_EXACT_SHARE = 1e-6  # of the variance of the map before the touches, of many touches: rounding
_WIDEST = 1e5
"""Standard deviation of terms without a prior, so that one that no touch shows has a covariance,
though none that says anything: four touches at one polar angle do not tell height from mean. Wider
ones would leave no digits of those that are shown. [um]"""
_TOGETHER = 50_000  # elements of the matrices of all points that are inverted in one step
_MANY_ROWS = 2  # rows for each column from which equations for the columns are fewer
_NEGLIGIBLE = 1e-3  # share of the largest weight
_AZIMUTHS = np.arange(0.0, 60.0, 7.5) * DEGREE
_MOST_CORRECTED = 2.0  # logarithm of the largest weight over the median one


@dataclass(frozen=True, eq=False)
class Amplitudes:
    """Amplitudes, decays, noise and azimuth of the regression that its posterior is averaged over.

    Attributes
    ----------
    mode : (8,) float
        The most probable ones.
    points : (p, 8) float
    weights : (p,) float
        Their posterior probabilities.
    """

    mode: FloatArray
    points: FloatArray
    weights: FloatArray

    @property
    def first_harmonic_variance(self) -> float:
        """Variance of a first harmonic across the axis, which touches take for a shift. [mm²]

        As a shift, along each of two axes. Its size follows from that of the asymmetric harmonics
        that touches do determine, by the same decay with the degree.
        """
        asymmetry = float(self.weights @ np.exp(2.0 * self.points[:, 2]))
        at_degree_1 = asymmetry * 3.0 ** (2.0 * DECAY)
        return float(3.0 * at_degree_1 * MICROMETRE**2)  # n_x is 1/sqrt(3) of a harmonic


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
        Standard deviation of a single touch, averaged.
    fixed_scatter : float
        Standard deviation of a direction that repeats do not reduce; zero without repeats.
    lobe_azimuth : float
        About which the lobes are even, in [0, 60°). [rad]
    smoothing : Smoothing
        Fitted values per observed value.
    amplitudes : Amplitudes
        With them a fit can be repeated without a new estimate.
    """

    terms: IntArray
    coefficients: FloatArray
    covariance: FloatArray
    noise: float
    fixed_scatter: float
    lobe_azimuth: float
    smoothing: Smoothing
    amplitudes: Amplitudes


def fit_harmonics(
    places: Places,
    values: FloatArray,
    groups: IntArray,
    free: IntArray,
    terms: IntArray,
    amplitudes: Amplitudes | None = None,
    near: Amplitudes | None = None,
) -> HarmonicFit:
    """Fit harmonics of pretravel; the mean and the position of the reference have no prior.

    Parameters
    ----------
    places : Places
        Contact normals in the probe frame.
    values : (n,) float
        Observed pretravel; it contains a translation of the reference. [mm]
    groups : (n,) int
        Number of the direction of each touch, 0 to g - 1.
    free : (f, 2) int
        Terms without a prior: the mean, and those of a translation (degree 1).
    terms : (k, 2) int
        Terms with a prior.
    amplitudes : Amplitudes, optional
        Of an earlier fit, which are kept.
    near : Amplitudes, optional
        Of an earlier fit to similar touches, at which the search begins.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.spherical_harmonics import (
    ...     degrees_and_orders, real_spherical_harmonics, sphere_terms
    ... )
    >>> n = sphere_pattern_25()
    >>> values = 0.010 + 0.002 * real_spherical_harmonics(n, [(3, 3)])[:, 0]
    >>> each = np.arange(25)
    >>> places = Places(n, each, each)
    >>> fit = fit_harmonics(places, values, each, degrees_and_orders(1), sphere_terms(25))
    >>> found = fit.coefficients[(fit.terms == (3, 3)).all(axis=1)]
    >>> bool(abs(found[0] - 0.002) < 1e-4)
    True
    """
    problem = RestrictedLikelihood(places, values / MICROMETRE, groups, free, terms)
    if amplitudes is None:
        amplitudes = _averaged_over(problem, _most_probable(problem, near))
    return _posterior(problem, amplitudes, free, terms)


def _most_probable(problem: RestrictedLikelihood, near: Amplitudes | None) -> FloatArray:
    """The most probable amplitudes, from the best azimuths of the lobes or an earlier fit, (8,)."""
    # Start from the scatter: repeats determine the noise, the residual the amplitudes.
    residual = (
        problem.small_y
        - problem.small_free @ np.linalg.lstsq(problem.small_free, problem.small_y, rcond=None)[0]
    )
    spread = max(float(np.sqrt(np.mean(residual**2))), 10.0 * _SMALLEST_NOISE)
    dof = problem.within_dof + problem.left_dof
    noise = math.sqrt((problem.within + problem.left) / dof) if dof > 0.0 else 0.3 * spread
    low = math.log(_SMALLEST_NOISE)
    noise_start = min(max(math.log(max(noise, _SMALLEST_NOISE)), low), math.log(spread) + 1.0)
    amplitude = most = math.log(spread)
    if len(residual) - problem.small_free.shape[1] + problem.left_dof < _FEW_RESIDUALS:
        most = max(amplitude, problem.typical_amplitude, TYPICAL_NOISE)
    least = np.array([low, low, low, 1.0, 1.0, low, -math.inf, low])
    largest = np.array([*3 * [most + 4.0], 5.0, 5.0, most + 2.0, math.inf, most + 2.0])
    if near is None:
        common = [amplitude, amplitude, amplitude - 2.0, DECAY, DECAY, noise_start]
        starts = _turned(problem, np.array([*common, 0.0, TYPICAL_FIXED]))[:2]
    else:
        starts = [near.mode, *_turned(problem, near.mode)[:1]]
    found = [bounded_mode(problem.at, start, least, largest) for start in starts]
    return min(found, key=lambda each: each[1])[0]


def _turned(problem: RestrictedLikelihood, start: FloatArray) -> list[FloatArray]:
    """A start at the azimuths of the lobes that are more probable than their neighbours, the most
    probable first: each is in the valley of another mode.
    """
    starts = [np.array([*start[:OF_TURN], azimuth, *start[OF_TURN + 1 :]]) for azimuth in _AZIMUTHS]
    cost = np.array([problem.cost_and_slopes(each)[0] for each in starts])
    valleys = np.flatnonzero((cost <= np.roll(cost, 1)) & (cost <= np.roll(cost, -1)))
    return [starts[place] for place in valleys[np.argsort(cost[valleys], kind="stable")]]


def _averaged_over(problem: RestrictedLikelihood, mode: FloatArray) -> Amplitudes:
    """Points spread over the posterior of the amplitudes, weighted by its density.

    They are drawn from the normal distribution about the mode, in pairs on both sides of it.
    """
    values, axes = np.linalg.eigh(problem.at(mode).curvature)
    # No prior is wider than two: flat or hollow directions come from bounds and kinks.
    deviations = 1.0 / np.sqrt(np.maximum(values, 0.25))
    # The symmetric root: signs of axes, and axes of equal curvature, differ between computers.
    draws = spread_points()
    points = mode + draws @ (axes * deviations) @ axes.T
    costs = np.array([problem.cost_and_slopes(point)[0] for point in points])
    # All draws have the same length, and so the same density in the normal distribution.
    weights = np.exp(np.minimum(np.median(costs) - costs, _MOST_CORRECTED))
    kept = weights > _NEGLIGIBLE * weights.max()
    return Amplitudes(mode, points[kept], np.asarray(weights[kept] / weights[kept].sum()))


def _posterior(
    problem: RestrictedLikelihood, amplitudes: Amplitudes, free: IntArray, terms: IntArray
) -> HarmonicFit:
    """Coefficients and covariance, averaged over the amplitudes."""
    points, weights = amplitudes.points, amplitudes.weights
    size = len(free) + len(terms)
    means, covariance = np.empty((len(points), size)), np.zeros((size, size))
    gains = np.zeros((len(problem.class_count), size, size))
    by_touches = np.array([_touches_suffice(problem, h) for h in points])
    for place in np.flatnonzero(~by_touches):
        h, weight = points[place], weights[place]
        to_coefficients, own = _by_terms(problem, h)
        means[place] = to_coefficients @ problem.y
        covariance += weight * own
        gains += (weight / problem.own_variances(h, problem.class_count))[:, None, None] * own
    together = max(1, _TOGETHER // problem.design.shape[0] ** 2)
    rows = np.flatnonzero(by_touches)
    for first in range(0, len(rows), together):
        mine = rows[first : first + together]
        found = _by_touches(problem, points[mine], weights[mine])
        means[mine] = found[0]
        covariance += found[1]
        gains += found[2]
    between = means - weights @ means
    covariance += (between.T * weights) @ between
    variance = weights @ np.exp(2.0 * points[:, OF_NOISE])
    fixed = weights @ np.array([problem.fixed_variance(h) for h in points])
    return HarmonicFit(
        terms=np.concatenate([free, terms]),
        coefficients=weights @ means * MICROMETRE,
        covariance=0.5 * (covariance + covariance.T) * MICROMETRE**2,
        noise=math.sqrt(variance) * MICROMETRE,
        fixed_scatter=math.sqrt(fixed) * MICROMETRE,
        lobe_azimuth=float(np.mod(amplitudes.mode[OF_TURN], 60.0 * DEGREE)),
        smoothing=Smoothing(problem.means, problem.direction_count, gains, problem.classes),
        amplitudes=amplitudes,
    )


def _touches_suffice(problem: RestrictedLikelihood, h: FloatArray) -> bool:
    """Whether equations for the mean touches are exact enough, and fewer than those for terms."""
    own = problem.own_variances(h, problem.count)
    before = float(np.sum(problem.prior_variances(h))) * float(np.max(problem.count))
    exact_enough = own.min() > max(_EXACT**2, _EXACT_SHARE * before) and problem.free_is_determined
    return bool(exact_enough and len(own) < _MANY_ROWS * problem.design.shape[1])


def _turned_back(problem: RestrictedLikelihood, rows: FloatArray, azimuth: float) -> FloatArray:
    """Rows for lobes about their own azimuth, as rows for cosine and sine about +x."""
    split = problem.free.shape[1]
    even, odd = split + problem.even, split + problem.odd
    cosine = np.cos(problem.order * azimuth)[:, None]
    sine = np.sin(problem.order * azimuth)[:, None]
    result = rows.copy()
    result[even] = cosine * rows[even] - sine * rows[odd]
    result[odd] = sine * rows[even] + cosine * rows[odd]
    return result


def _by_touches(
    problem: RestrictedLikelihood, points: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Generalised least squares at all points together: as many equations as directions.

    Returns
    -------
    means : (p, k) float
        Coefficients. [um]
    covariance : (k, k) float
        The weighted sum of their covariances. [um²]
    gains : (c, k, k) float
        That of their covariances over the variance of a touch, for each class of directions.
    """
    prior, carried, block = _priors_turned_back(problem, points)
    free, split, size = problem.free, problem.free.shape[1], len(problem.amplitude)
    own = np.array([problem.own_variances(h, problem.count) for h in points])
    total = problem.design @ carried
    total[:, np.arange(len(free)), np.arange(len(free))] += own
    inverse = np.linalg.inv(total)
    of_free = np.linalg.inv(free.T @ inverse @ free)
    free_of = of_free @ free.T @ inverse
    projected = inverse - inverse @ free @ free_of
    mixed = -carried @ np.swapaxes(free_of, -1, -2)
    onto = carried @ projected
    means = np.concatenate([free_of, onto], axis=1) @ problem.y

    def summed(each: FloatArray) -> FloatArray:
        found = np.empty((split + size, split + size))
        found[:split, :split] = np.tensordot(each, of_free, axes=1)
        found[split:, :split] = np.tensordot(each, mixed, axes=1)
        found[:split, split:] = found[split:, :split].T
        weighted = np.moveaxis(each[:, None, None] * onto, 0, 1).reshape(size, -1)
        found[split:, split:] = -weighted @ np.moveaxis(carried, 0, 1).reshape(size, -1).T
        diagonal(found)[split:] += each @ prior
        for row, column in ((problem.even, problem.odd), (problem.odd, problem.even)):
            found[split + row, split + column] += each @ block
        return found

    by_class = np.array([problem.own_variances(h, problem.class_count) for h in points])
    gains = np.array([summed(weights / variances) for variances in by_class.T])
    return np.asarray(means), summed(weights), gains


def _priors_turned_back(
    problem: RestrictedLikelihood, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Prior covariances of the terms at some points, for cosine and sine about +x.

    Variances (p, k), the covariance matrices times the design (p, k, g), and the covariances of the
    lobes' cosines with their sines (p, e).
    """
    own = np.array([problem.prior_variances(h) for h in points])
    angle = points[:, OF_TURN, None] * problem.order
    cosine, sine = np.cos(angle), np.sin(angle)
    even, odd = own[:, problem.even], own[:, problem.odd]
    variances = own.copy()
    variances[:, problem.even] = cosine**2 * even + sine**2 * odd
    variances[:, problem.odd] = sine**2 * even + cosine**2 * odd
    block = cosine * sine * (even - odd)
    carried = variances[:, :, None] * problem.design.T
    carried[:, problem.even] += block[:, :, None] * problem.design.T[problem.odd]
    carried[:, problem.odd] += block[:, :, None] * problem.design.T[problem.even]
    return variances, carried, block


def _by_terms(problem: RestrictedLikelihood, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least squares on data and prior together: as many equations as terms, exact without noise."""
    variance = math.exp(2.0 * h[OF_NOISE])
    prior = problem.prior_variances(h)
    ratio = 1.0 + problem.fixed_variance(h) / variance * problem.count
    lighter = 1.0 / np.sqrt(ratio)[:, None]
    design = lighter * problem.turned(problem.design, h[OF_TURN])
    # By QR, which stays exact without noise, where normal equations lose all digits.
    count, split, size = len(design), problem.free.shape[1], design.shape[1]
    stacked = np.zeros((count + split + size, split + size))
    stacked[:count, :split] = lighter * problem.free
    stacked[:count, split:] = design * np.sqrt(prior)
    scales = np.concatenate([np.full(split, 1.0 / _WIDEST), np.ones(size)])
    stacked[count:] = np.diag(math.sqrt(variance) * scales)
    q, r = np.linalg.qr(stacked)
    inverse = np.linalg.inv(r)
    scale = np.concatenate([np.ones(split), np.sqrt(prior)])
    to_coefficients = scale[:, None] * (inverse @ q[:count].T) * lighter[:, 0]
    root = _turned_back(problem, math.sqrt(variance) * scale[:, None] * inverse, h[OF_TURN])
    return _turned_back(problem, to_coefficients, h[OF_TURN]), np.asarray(root @ root.T)
