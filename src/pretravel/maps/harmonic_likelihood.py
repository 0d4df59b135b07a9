"""The restricted likelihood of amplitudes, scatter and azimuth of a regression of harmonics.

Lengths in um. What the terms, the priors and the likelihood are: `harmonic_regression`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, IntArray
from pretravel.maps.likelihood_search import CostAt
from pretravel.maps.observation import Places
from pretravel.maps.spherical_harmonics import DirectionMeans
from pretravel.uncertainty import classes_of, reduced_rows

DECAY = 2.5
"""Power of the decrease of amplitudes with the degree: kinks on a sphere."""
TYPICAL_NOISE = math.log(0.3)
"""Logarithm of the scatter of touches, um."""
TYPICAL_FIXED = math.log(0.06)
"""Logarithm of the scatter of directions that repeats do not reduce, um."""
AMPLITUDES = 8
"""Logarithms of the amplitudes of zonal, lobed and other terms; decays of zonal and lobed ones;
logarithm of the noise; azimuth of the lobes; logarithm of the fixed scatter."""
OF_NOISE, OF_TURN, OF_FIXED = 5, 6, 7
_DECAY_SPREAD = 0.7
_ASYMMETRY, _ASYMMETRY_SPREAD = -2.0, 1.5  # log of asymmetry over lobes, vague
_NOISE_SPREAD, _FIXED_SPREAD = 2.0, 1.0  # the noise is vague
_TYPICAL_AMPLITUDE, _AMPLITUDE_SPREAD = -0.6, 0.6  # log um, of degree 3
_TYPICAL_SHARE = math.log(0.055)
"""Logarithm of the amplitude over the mean pretravel. A tripod that triggers where the first seat
lifts has 0.066 for its lobes and 0.043 for its zonal harmonics, within 15 %."""
_SMALLEST_LEVEL = 0.3  # um: without the tip's diameter the mean of the touches is zero
_DETERMINED = 1e-6
"""Share of the largest singular value above which touches determine a combination of terms."""
_OF_PRIOR = np.zeros((AMPLITUDES, AMPLITUDES))
"""Second derivatives of minus the logarithm of the prior."""
_OF_PRIOR[:3, :3] = np.diag([*2 * [_AMPLITUDE_SPREAD**-2], 0.0])
_OF_PRIOR[1:3, 1:3] += _ASYMMETRY_SPREAD**-2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
_OF_PRIOR[[3, 4], [3, 4]] = _DECAY_SPREAD**-2
_OF_PRIOR[OF_NOISE, OF_NOISE], _OF_PRIOR[OF_FIXED, OF_FIXED] = _NOISE_SPREAD**-2, _FIXED_SPREAD**-2


class _Products(NamedTuple):
    """With P the inverse covariance of y after the free terms are removed."""

    noise: float
    estimated: float
    """The part of the fixed variance that is not known."""
    prior: FloatArray
    """(k,)"""
    design: FloatArray
    """Columns about the azimuth of the lobes, (g, k)."""
    turning: FloatArray
    """Their derivative by the azimuth, (g, k)."""
    projected: FloatArray
    """P, (g, g)."""
    weighted: FloatArray
    """P y, (g,)."""
    on_design: FloatArray
    """P times the columns, (g, k)."""


class RestrictedLikelihood:
    """The regression, reduced to the terms of the likelihood."""

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
        self.small_design, self.small_y = small[:, split:-1], small[:, -1]
        self.left_count = float(count.mean())
        degree, order = terms.T
        self.log_degree = np.log(degree / 3.0)
        zonal = order == 0
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
        self.amplitude = np.where(zonal, 0, 2)
        """Of each term: the number of its amplitude."""
        self.amplitude[self.even] = 1
        self.members = (np.arange(3)[:, None] == self.amplitude).astype(np.float64)
        """Zonal, lobed and other terms: 1 for those that belong to it, (3, k)."""
        self.of_terms = np.vstack([self.members, -self.members[:2] * self.log_degree])
        """Derivatives of the logarithm of a term's amplitude by amplitudes and decays, (5, k)."""

    def turned(self, design: FloatArray, azimuth: float) -> FloatArray:
        """Columns of lobes even and odd about an azimuth, instead of about +x."""
        angle = self.turning_order * azimuth
        return np.asarray(design * np.cos(angle) + design[:, self.partner] * np.sin(angle))

    def prior_variances(self, h: FloatArray) -> FloatArray:
        decays = np.array([h[3], h[4], DECAY])
        exponents = h[self.amplitude] - decays[self.amplitude] * self.log_degree
        return np.asarray(np.exp(2.0 * exponents))

    def cost_and_slopes(self, h: FloatArray) -> tuple[float, FloatArray]:
        """Minus log restricted likelihood and log prior of the amplitudes, and its derivatives."""
        return self._evaluated(h)[:2]

    def at(self, h: FloatArray) -> CostAt:
        """As `cost_and_slopes`, with the second derivatives."""
        cost, slopes, products = self._evaluated(h)
        curvature = np.eye(AMPLITUDES) if products is None else self._curvature(products)
        return CostAt(cost, slopes, curvature)

    def _evaluated(self, h: FloatArray) -> tuple[float, FloatArray, _Products | None]:
        """The derivative by a parameter of the covariance M is tr(P M')/2 - (Py)'M'(Py)/2."""
        noise, fixed = math.exp(2.0 * h[OF_NOISE]), self.fixed_variance(h)
        estimated = fixed - self.step_variance
        of_left = noise + fixed * self.left_count
        design = self.turned(self.small_design, h[OF_TURN])
        prior = self.prior_variances(h)
        total = (design * prior) @ design.T
        diagonal(total)[:] += noise + fixed * self.small_count
        try:
            inverse = _inverse_of_factor(total)
        except np.linalg.LinAlgError:
            return 1e12, np.zeros(AMPLITUDES), None
        free = inverse @ self.small_free
        normal = np.linalg.inv(free.T @ free)
        projected = inverse.T @ (inverse - free @ (normal @ (free.T @ inverse)))
        weighted = projected @ self.small_y
        cost = (
            0.5 * float(self.small_y @ weighted)
            - float(np.log(diagonal(inverse)).sum())
            - 0.5 * float(np.linalg.slogdet(normal)[1])
            + self.within_dof * h[OF_NOISE]
            + 0.5 * self.within / noise
            + 0.5 * (self.left_dof * math.log(of_left) + self.left / of_left)
        )
        turning = self.turn_slopes(design)
        found = _Products(
            noise, estimated, prior, design, turning, projected, weighted, projected @ design
        )
        by_variance, by_turning, on_diagonal = _off(found)
        by_left = (self.left_dof - self.left / of_left) / of_left
        slopes = self._prior_slopes(h)
        slopes[:OF_NOISE] += self.of_terms @ by_variance
        slopes[OF_NOISE] += noise * (on_diagonal.sum() + by_left)
        slopes[OF_NOISE] += self.within_dof - self.within / noise
        slopes[OF_FIXED] += estimated * (self.small_count @ on_diagonal + self.left_count * by_left)
        slopes[OF_TURN] += float(by_turning.sum())
        return cost + self._minus_log_prior(h), slopes, found

    def _curvature(self, at: _Products) -> FloatArray:
        """Second derivatives, (8, 8).

        By two parameters: tr(P M'')/2 - (Py)'M''(Py)/2 + (Py)'M' P M'(Py) - tr(P M' P M')/2.
        """
        owns = {
            OF_NOISE: np.full(len(at.weighted), at.noise),
            OF_FIXED: at.estimated * self.small_count,
        }
        found = self._by_second_slopes(at, owns)
        # The products of first derivatives with Py.
        seen, seen_turning = at.design.T @ at.weighted, at.turning.T @ at.weighted
        moved = np.empty((len(at.weighted), AMPLITUDES))
        moved[:, :OF_NOISE] = 2.0 * at.design @ (self.of_terms * (at.prior * seen)).T
        moved[:, OF_TURN] = at.turning @ (at.prior * seen) + at.design @ (at.prior * seen_turning)
        for place, own in owns.items():
            moved[:, place] = 2.0 * own * at.weighted
        found += moved.T @ at.projected @ moved
        found -= self._information(at, owns)
        # What no column explains.
        total = at.noise + (at.estimated + self.step_variance) * self.left_count
        ratio = self.left / total
        own = np.zeros(AMPLITUDES)
        own[[OF_NOISE, OF_FIXED]] = at.noise / total, at.estimated * self.left_count / total
        found += 2.0 * (2.0 * ratio - self.left_dof) * np.outer(own, own)
        found += 2.0 * np.diag((self.left_dof - ratio) * own)
        found[OF_NOISE, OF_NOISE] += 2.0 * self.within / at.noise
        return np.asarray(found + _OF_PRIOR)

    def _by_second_slopes(self, at: _Products, owns: dict[int, FloatArray]) -> FloatArray:
        """tr(P M'')/2 - (Py)'M''(Py)/2, (8, 8)."""
        by_variance, by_turning, on_diagonal = _off(at)
        again = self.turn_slopes(at.turning)
        across = np.einsum("ij,ij->j", at.turning, at.projected @ at.turning)
        across -= (at.turning.T @ at.weighted) ** 2
        across += np.einsum("ij,ij->j", again, at.on_design)
        across -= (at.design.T @ at.weighted) * (again.T @ at.weighted)
        found = np.zeros((AMPLITUDES, AMPLITUDES))
        found[:OF_NOISE, :OF_NOISE] = 2.0 * (self.of_terms * by_variance) @ self.of_terms.T
        found[OF_TURN, :OF_NOISE] = found[:OF_NOISE, OF_TURN] = 2.0 * self.of_terms @ by_turning
        found[OF_TURN, OF_TURN] = at.prior @ across
        for place, own in owns.items():
            found[place, place] = 2.0 * own @ on_diagonal
        return found

    def _information(self, at: _Products, owns: dict[int, FloatArray]) -> FloatArray:
        """Fisher's, tr(P M' P M')/2, (8, 8)."""
        shares, on_turning = self.of_terms * at.prior, at.projected @ at.turning
        inner, across = at.design.T @ at.on_design, at.design.T @ on_turning
        both = across * across.T + inner * (at.turning.T @ on_turning)
        found = np.zeros((AMPLITUDES, AMPLITUDES))
        found[:OF_NOISE, :OF_NOISE] = 2.0 * shares @ inner**2 @ shares.T
        found[OF_TURN, :OF_NOISE] = found[:OF_NOISE, OF_TURN] = (
            2.0 * shares @ (inner * across) @ at.prior
        )
        found[OF_TURN, OF_TURN] = at.prior @ both @ at.prior
        of_terms, square = at.on_design**2 @ shares.T, at.projected**2
        turned = (at.on_design * on_turning) @ at.prior
        for place, own in owns.items():
            found[place, :OF_NOISE] = found[:OF_NOISE, place] = 2.0 * own @ of_terms
            found[place, OF_TURN] = found[OF_TURN, place] = 2.0 * own @ turned
            for other, its in owns.items():
                found[place, other] = 2.0 * own @ square @ its
        return found

    def own_variances(self, h: FloatArray, count: FloatArray) -> FloatArray:
        """Variances of weighted mean touches about the map, by their number of touches. [um²]"""
        return np.asarray(math.exp(2.0 * h[OF_NOISE]) + self.fixed_variance(h) * count)

    def turn_slopes(self, turned: FloatArray) -> FloatArray:
        """Derivative of turned columns by the azimuth."""
        return np.asarray(turned[:, self.partner] * self.turning_order)

    def fixed_variance(self, h: FloatArray) -> float:
        """Variance of a direction that repeats do not reduce; without repeats it is noise.

        That of the step of the positions is known, and not smaller where residuals are.
        """
        return self.step_variance + (math.exp(2.0 * h[OF_FIXED]) if self.repeated else 0.0)

    def _minus_log_prior(self, h: FloatArray) -> float:
        return 0.5 * float(np.sum(self._from_usual(h) ** 2))

    def _from_usual(self, h: FloatArray) -> FloatArray:
        """Distances of the amplitudes from usual ones, in standard deviations of their priors."""
        return np.array(
            [
                (h[0] - self.typical_amplitude) / _AMPLITUDE_SPREAD,
                (h[1] - self.typical_amplitude) / _AMPLITUDE_SPREAD,
                (h[2] - h[1] - _ASYMMETRY) / _ASYMMETRY_SPREAD,
                (h[3] - DECAY) / _DECAY_SPREAD,
                (h[4] - DECAY) / _DECAY_SPREAD,
                (h[OF_NOISE] - TYPICAL_NOISE) / _NOISE_SPREAD,
                (h[OF_FIXED] - TYPICAL_FIXED) / _FIXED_SPREAD,
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


def _off(at: _Products) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Differences of y from its expectation: of each term by variance and turn, (k,), and of
    each row, (g,).
    """
    seen = at.design.T @ at.weighted
    by_variance = at.prior * (np.einsum("ij,ij->j", at.design, at.on_design) - seen**2)
    by_turning = np.einsum("ij,ij->j", at.turning, at.on_design)
    by_turning = at.prior * (by_turning - seen * (at.weighted @ at.turning))
    return by_variance, by_turning, diagonal(at.projected) - at.weighted**2


def _inverse_of_factor(covariance: FloatArray) -> FloatArray:
    """Inverse of the lower Cholesky factor, (n, n): `scipy.linalg` would halve the time of a step,
    but takes as long to load as fifty of them.

    Raises
    ------
    numpy.linalg.LinAlgError
        The matrix is not positive definite.
    """
    return np.asarray(np.tril(np.linalg.inv(np.linalg.cholesky(covariance))))


def diagonal(matrix: FloatArray) -> FloatArray:
    """The diagonal of a square matrix, a view of it."""
    view: FloatArray = np.einsum("ii->i", matrix)
    return view
