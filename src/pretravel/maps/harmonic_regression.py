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
from functools import lru_cache

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, IntArray
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import DirectionMeans, Smoothing
from pretravel.uncertainty import classes_of, reduced_rows

_SMALLEST_NOISE = 1e-5  # um: the last digit of a position in mm with eight decimals
_DECAY, _DECAY_SPREAD = 2.5, 0.7  # kinks on a sphere: power 2.5
_ASYMMETRY, _ASYMMETRY_SPREAD = -2.0, 1.5  # log of asymmetry over lobes, vague
_TYPICAL_NOISE, _NOISE_SPREAD = math.log(0.3), 2.0  # log um, vague
_TYPICAL_AMPLITUDE, _AMPLITUDE_SPREAD = -0.6, 0.6  # log um, of degree 3
_TYPICAL_SHARE = math.log(0.055)
"""Logarithm of the amplitude over the mean pretravel. A tripod that triggers where the first seat
lifts has 0.066 for its lobes and 0.043 for its zonal harmonics, within 15 %."""
_SMALLEST_LEVEL = 0.3  # um: without the tip's diameter the mean of the touches is zero
_TYPICAL_FIXED, _FIXED_SPREAD = math.log(0.06), 1.0  # log um
_AMPLITUDES = 8
"""Logarithms of the amplitudes of zonal, lobed and other terms; decays of zonal and lobed ones;
logarithm of the noise; azimuth of the lobes; logarithm of the fixed scatter."""
_NOISE, _AZIMUTH, _FIXED = 5, 6, 7
_FEW_RESIDUALS = 8
"""Fewer of them can all be near zero by chance, or by the step of the positions: they are no scale
of amplitudes that they do not show."""
_EXACT = 1e-2  # um: scatter from which normal equations are exact enough
_WIDEST = 1e5
"""Standard deviation of terms without a prior, so that one that no touch shows has a covariance,
though none that says anything: four touches at one polar angle do not tell height from mean. Wider
ones would leave no digits of those that are shown. [um]"""
_DETERMINED = 1e-6
"""Share of the largest singular value above which touches determine a combination of terms."""
_TOGETHER = 50_000  # elements of the matrices of all points that are inverted in one step
_MANY_ROWS = 2  # rows for each column from which equations for the columns are fewer
_NEGLIGIBLE = 1e-3  # share of the largest weight
_AZIMUTHS = np.arange(0.0, 60.0, 7.5) * DEGREE
_MOST_CORRECTED = 2.0  # logarithm of the largest weight over the median one
_SOBOL = (
    (307271798, 174628328, 631746294, 307996591, 549404812, 934479949, 553954181, 14368825),
    (680168256, 833182303, 404013618, 867970132, 261199633, 201321069, 483954224, 981947520),
    (1047282702, 456927173, 874550651, 259766712, 303655366, 397374883, 1029551146, 628322504),
    (79058744, 553508978, 160692671, 781988419, 1027063387, 736335747, 8491423, 523199601),
    (182938005, 278534694, 283941116, 613480762, 837287670, 1000465337, 878683667, 761941845),
    (809335459, 727440785, 761263160, 91714241, 516499819, 132972953, 159613862, 389438444),
    (651933165, 30318603, 23831409, 967894829, 54646716, 465411671, 671529404, 146964388),
    (469870299, 974088124, 1020841909, 408382678, 745472033, 670137463, 366648329, 849242909),
)  # fmt: skip
"""A sequence of Sobol', scrambled, in steps of 2^-30: for the points that the posterior is averaged
over. `scipy.stats.qmc` gives it with ``rng=1``, but takes half a second to load."""


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
        at_degree_1 = asymmetry * 3.0 ** (2.0 * _DECAY)
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


class _Problem:
    """The regression, reduced to the terms of the likelihood; lengths in um."""

    def __init__(
        self,
        places: Places,
        values: FloatArray,
        groups: IntArray,
        free: IntArray,
        terms: IntArray,
    ) -> None:
        split, self.step_variance = len(free), places.step_variance / MICROMETRE**2
        # Repeats of a direction enter by their mean and their scatter.
        means = DirectionMeans(places, np.concatenate([free, terms]))
        count = np.bincount(groups).astype(np.float64)
        y = np.bincount(groups, values) / count
        self.means, self.direction_count = means, count
        self.within = float(np.sum((values - y[groups]) ** 2))
        self.within_dof = float(len(values) - len(count))
        self.repeated = self.within_dof > 0.0
        self.left, self.left_dof = 0.0, 0.0
        self.class_count, self.classes = classes_of(count)
        root = np.sqrt(count)[:, None]
        width = split + len(terms) + 1
        if len(count) <= width:
            rows = root * np.column_stack([means.rows(), y])
            small, self.count, self.small_count = rows, count, count
        else:  # an orthogonal reduction is exact
            blocks = (
                (root[part] * np.column_stack([own, y[part]]), self.classes[part])
                for part, own in means.blocks()
            )
            reduced = reduced_rows(blocks, len(self.class_count))
            rows, self.count = reduced.rows, self.class_count[reduced.classes]
            # What no column explains is scatter of directions.
            small, self.left, self.left_dof = reduced.together
            # Of directions with unequal repeats the mean number: hundreds of them, one each mostly.
            self.small_count = np.full(len(small), count.mean())
        self.free, self.design, self.y = rows[:, :split], rows[:, split:-1], rows[:, -1]
        # The mean does not depend on where the centre was assumed: a translation is fitted with it.
        level = float(np.linalg.lstsq(self.free, self.y, rcond=None)[0][0])
        known = level > _SMALLEST_LEVEL
        self.typical_amplitude = _TYPICAL_SHARE + math.log(level) if known else _TYPICAL_AMPLITUDE
        # The likelihood does not depend on combinations of free terms that no touch shows.
        span, sizes, _ = np.linalg.svd(small[:, :split], full_matrices=False)
        shown = sizes > _DETERMINED * sizes[0]
        self.free_is_determined = bool(shown.all())
        self.small_free = small[:, :split] if self.free_is_determined else span[:, shown]
        self.small_design = small[:, split:-1]
        self.small_y = small[:, -1]
        self.left_count = float(count.mean())
        degree, order = terms[:, 0], terms[:, 1]
        self.log_degree = np.log(degree / 3.0)
        self.zonal = order == 0
        self.even = np.flatnonzero((order % 3 == 0) & (order > 0))
        partner = {(int(d), int(m)): i for i, (d, m) in enumerate(terms)}
        self.odd = np.array(
            [partner[(int(degree[i]), -int(order[i]))] for i in self.even], dtype=np.int64
        )
        self.order = order[self.even]
        self.partner = np.arange(len(terms))
        self.partner[self.even], self.partner[self.odd] = self.odd, self.even
        self.turning_order = np.zeros(len(terms))
        """By which a turn about the axis adds a term's partner to it; zero where it has none."""
        self.turning_order[self.even], self.turning_order[self.odd] = self.order, -self.order
        lobe = np.zeros(len(terms), dtype=bool)
        lobe[self.even] = True
        self.amplitude = np.where(self.zonal, 0, np.where(lobe, 1, 2))
        """Of each term: the number of its amplitude."""
        self.members = (np.arange(3)[:, None] == self.amplitude).astype(np.float64)
        """Zonal, lobed and other terms: 1 for those that belong to it, (3, k)."""

    def turned(self, design: FloatArray, azimuth: float) -> FloatArray:
        """Columns of lobes even and odd about an azimuth, instead of about +x."""
        angle = self.turning_order * azimuth
        return np.asarray(design * np.cos(angle) + design[:, self.partner] * np.sin(angle))

    def prior_variances(self, h: FloatArray) -> FloatArray:
        decays = np.array([h[3], h[4], _DECAY])
        exponents = h[self.amplitude] - decays[self.amplitude] * self.log_degree
        return np.asarray(np.exp(2.0 * exponents))

    def cost_and_slopes(self, h: FloatArray) -> tuple[float, FloatArray]:
        """Minus log restricted likelihood and log prior of the amplitudes, and its derivatives.

        With P the inverse covariance of y after the free terms are removed, the derivative by a
        parameter of the covariance M is tr(P M')/2 - (Py)'M'(Py)/2.
        """
        noise, fixed = math.exp(2.0 * h[_NOISE]), self.fixed_variance(h)
        estimated = fixed - self.step_variance
        of_left = noise + fixed * self.left_count
        design = self.turned(self.small_design, h[_AZIMUTH])
        prior = self.prior_variances(h)
        total = (design * prior) @ design.T
        _diagonal(total)[:] += noise + fixed * self.small_count
        try:
            inverse = _inverse_of_factor(total)
        except np.linalg.LinAlgError:
            return 1e12, np.zeros(_AMPLITUDES)
        free = inverse @ self.small_free
        normal = np.linalg.inv(free.T @ free)
        projected = inverse.T @ (inverse - free @ (normal @ (free.T @ inverse)))
        weighted = projected @ self.small_y
        cost = (
            0.5 * float(self.small_y @ weighted)
            - float(np.log(_diagonal(inverse)).sum())
            - 0.5 * float(np.linalg.slogdet(normal)[1])
            + self.within_dof * h[_NOISE]
            + 0.5 * self.within / noise
            + 0.5 * (self.left_dof * math.log(of_left) + self.left / of_left)
        )
        slopes = self._prior_slopes(h)
        on_design, seen = projected @ design, design.T @ weighted
        by_variance = (np.einsum("ij,ij->j", design, on_design) - seen**2) * prior
        slopes[:3] += self.members @ by_variance
        slopes[3:5] -= self.members[:2] @ (by_variance * self.log_degree)
        on_diagonal = _diagonal(projected) - weighted**2
        by_left = (self.left_dof - self.left / of_left) / of_left
        slopes[_NOISE] += noise * (on_diagonal.sum() + by_left)
        slopes[_NOISE] += self.within_dof - self.within / noise
        slopes[_FIXED] += estimated * (self.small_count @ on_diagonal + self.left_count * by_left)
        turning = self.turn_slopes(design)
        by_turning = np.einsum("ij,ij->j", turning, on_design) - seen * (weighted @ turning)
        slopes[_AZIMUTH] += float(prior @ by_turning)
        return cost + self._minus_log_prior(h), slopes

    def own_variances(self, h: FloatArray, count: FloatArray) -> FloatArray:
        """Variances of weighted mean touches about the map, by their number of touches. [um²]"""
        return np.asarray(math.exp(2.0 * h[_NOISE]) + self.fixed_variance(h) * count)

    def turn_slopes(self, turned: FloatArray) -> FloatArray:
        """Derivative of turned columns by the azimuth."""
        return np.asarray(turned[:, self.partner] * self.turning_order)

    def fixed_variance(self, h: FloatArray) -> float:
        """Variance of a direction that repeats do not reduce; without repeats it is noise.

        That of the step of the positions is known, and not smaller where residuals are.
        """
        return self.step_variance + (math.exp(2.0 * h[_FIXED]) if self.repeated else 0.0)

    def _minus_log_prior(self, h: FloatArray) -> float:
        return 0.5 * float(np.sum(self._from_usual(h) ** 2))

    def _from_usual(self, h: FloatArray) -> FloatArray:
        """Distances of the amplitudes from usual ones, in standard deviations of their priors."""
        return np.array(
            [
                (h[0] - self.typical_amplitude) / _AMPLITUDE_SPREAD,
                (h[1] - self.typical_amplitude) / _AMPLITUDE_SPREAD,
                (h[2] - h[1] - _ASYMMETRY) / _ASYMMETRY_SPREAD,
                (h[3] - _DECAY) / _DECAY_SPREAD,
                (h[4] - _DECAY) / _DECAY_SPREAD,
                (h[_NOISE] - _TYPICAL_NOISE) / _NOISE_SPREAD,
                (h[_FIXED] - _TYPICAL_FIXED) / _FIXED_SPREAD,
            ]
        )

    def _prior_slopes(self, h: FloatArray) -> FloatArray:
        off = self._from_usual(h)
        between = off[2] / _ASYMMETRY_SPREAD
        return np.array(
            [
                off[0] / _AMPLITUDE_SPREAD,
                off[1] / _AMPLITUDE_SPREAD - between,
                between,
                off[3] / _DECAY_SPREAD,
                off[4] / _DECAY_SPREAD,
                off[5] / _NOISE_SPREAD,
                0.0,
                off[6] / _FIXED_SPREAD,
            ]
        )


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

    Returns
    -------
    HarmonicFit

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
    problem = _Problem(places, values / MICROMETRE, groups, free, terms)
    if amplitudes is None:
        amplitudes = _averaged_over(problem, _most_probable(problem, near))
    return _posterior(problem, amplitudes, free, terms)


def _most_probable(problem: _Problem, near: Amplitudes | None) -> FloatArray:
    """The most probable amplitudes, from the best azimuths of the lobes or an earlier fit, (8,)."""
    from scipy.optimize import minimize

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
        most = max(amplitude, problem.typical_amplitude, _TYPICAL_NOISE)
    bounds = [(low, most + 4.0)] * 3 + [(1.0, 5.0)] * 2 + [(low, most + 2.0)]
    bounds += [(-math.inf, math.inf), (low, most + 2.0)]
    if near is None:
        common = [amplitude, amplitude, amplitude - 2.0, _DECAY, _DECAY, noise_start]
        starts = [np.array([*common, azimuth, _TYPICAL_FIXED]) for azimuth in _AZIMUTHS]
        starts.sort(key=lambda start: problem.cost_and_slopes(start)[0])
        starts = starts[:2]
    else:
        starts = [near.mode]
    found = [
        minimize(problem.cost_and_slopes, start, jac=True, method="L-BFGS-B", bounds=bounds)
        for start in starts
    ]
    return np.asarray(min(found, key=lambda result: float(result.fun)).x)


def _inverse_of_factor(covariance: FloatArray) -> FloatArray:
    """Inverse of the lower Cholesky factor, (n, n); several times cheaper than a general inverse.

    Raises
    ------
    numpy.linalg.LinAlgError
        The matrix is not positive definite.
    """
    from scipy.linalg.lapack import dpotrf, dtrtri

    factor, fault = dpotrf(covariance.T, lower=1)  # symmetric, and in LAPACK's order
    if fault:
        raise np.linalg.LinAlgError("the covariance is not positive definite")
    inverse, _ = dtrtri(factor, lower=1, overwrite_c=1)
    return np.asarray(inverse)


def _diagonal(matrix: FloatArray) -> FloatArray:
    """The diagonal of a square matrix, a view of it."""
    view: FloatArray = np.einsum("ii->i", matrix)
    return view


def _averaged_over(problem: _Problem, mode: FloatArray) -> Amplitudes:
    """Points spread over the posterior of the amplitudes, weighted by its density.

    They are drawn from the normal distribution about the mode, in pairs on both sides of it.
    """
    step = 1e-3
    rows = [
        (problem.cost_and_slopes(mode + step * e)[1] - problem.cost_and_slopes(mode - step * e)[1])
        / (2.0 * step)
        for e in np.eye(_AMPLITUDES)
    ]
    curvature = 0.5 * (np.array(rows) + np.array(rows).T)
    values, axes = np.linalg.eigh(curvature)
    # No prior is wider than two: flat or hollow directions come from bounds and kinks.
    deviations = 1.0 / np.sqrt(np.maximum(values, 0.25))
    # The symmetric root: signs of axes, and axes of equal curvature, differ between computers.
    draws = _spread_points()
    points = mode + draws @ (axes * deviations) @ axes.T
    costs = np.array([problem.cost_and_slopes(point)[0] for point in points])
    # All draws have the same length, and so the same density in the normal distribution.
    weights = np.exp(np.minimum(np.median(costs) - costs, _MOST_CORRECTED))
    kept = weights > _NEGLIGIBLE * weights.max()
    return Amplitudes(mode, points[kept], np.asarray(weights[kept] / weights[kept].sum()))


@lru_cache(maxsize=1)
def _spread_points() -> FloatArray:
    """Standard normal points in pairs, (p, 8), with mean zero and unit covariance.

    As many pairs as dimensions: all of them then have the same length.
    """
    from scipy.special import ndtri

    half = ndtri(np.array(_SOBOL) / 2.0**30)
    both = np.concatenate([half, -half])
    root = np.linalg.cholesky(both.T @ both / len(both))
    return np.asarray(np.linalg.solve(root, both.T).T)


def _posterior(
    problem: _Problem, amplitudes: Amplitudes, free: IntArray, terms: IntArray
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
    variance = weights @ np.exp(2.0 * points[:, _NOISE])
    fixed = weights @ np.array([problem.fixed_variance(h) for h in points])
    return HarmonicFit(
        terms=np.concatenate([free, terms]),
        coefficients=weights @ means * MICROMETRE,
        covariance=0.5 * (covariance + covariance.T) * MICROMETRE**2,
        noise=math.sqrt(variance) * MICROMETRE,
        fixed_scatter=math.sqrt(fixed) * MICROMETRE,
        lobe_azimuth=float(np.mod(amplitudes.mode[_AZIMUTH], 60.0 * DEGREE)),
        smoothing=Smoothing(problem.means, problem.direction_count, gains, problem.classes),
        amplitudes=amplitudes,
    )


def _touches_suffice(problem: _Problem, h: FloatArray) -> bool:
    """Whether equations for the mean touches are exact enough, and fewer than those for terms."""
    own = problem.own_variances(h, problem.count)
    exact_enough = own.min() > _EXACT**2 and problem.free_is_determined
    return bool(exact_enough and len(own) < _MANY_ROWS * problem.design.shape[1])


def _turned_back(problem: _Problem, rows: FloatArray, azimuth: float) -> FloatArray:
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
    problem: _Problem, points: FloatArray, weights: FloatArray
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
        _diagonal(found)[split:] += each @ prior
        for row, column in ((problem.even, problem.odd), (problem.odd, problem.even)):
            found[split + row, split + column] += each @ block
        return found

    by_class = np.array([problem.own_variances(h, problem.class_count) for h in points])
    gains = np.array([summed(weights / variances) for variances in by_class.T])
    return np.asarray(means), summed(weights), gains


def _priors_turned_back(
    problem: _Problem, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Prior covariances of the terms at some points, for cosine and sine about +x.

    Variances (p, k), the covariance matrices times the design (p, k, g), and the covariances of the
    lobes' cosines with their sines (p, e).
    """
    own = np.array([problem.prior_variances(h) for h in points])
    angle = points[:, _AZIMUTH, None] * problem.order
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


def _by_terms(problem: _Problem, h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least squares on data and prior together: as many equations as terms, exact without noise."""
    variance = math.exp(2.0 * h[_NOISE])
    prior = problem.prior_variances(h)
    ratio = 1.0 + problem.fixed_variance(h) / variance * problem.count
    lighter = 1.0 / np.sqrt(ratio)[:, None]
    design = lighter * problem.turned(problem.design, h[_AZIMUTH])
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
    root = _turned_back(problem, math.sqrt(variance) * scale[:, None] * inverse, h[_AZIMUTH])
    return _turned_back(problem, to_coefficients, h[_AZIMUTH]), np.asarray(root @ root.T)
