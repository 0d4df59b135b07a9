"""The most probable six-seat probe for touches on a reference, at given scales of its priors.

Unknowns are the shift of the centre, the tip radius where it was not given, and the parameters of
`uneven_seats`, the seats' angle by the logarithm of its tangent. The part of pretravel that a
six-seat probe does not represent has a covariance between directions, which weights the residuals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    BoolArray,
    FloatArray,
    IntArray,
    fibonacci_cap,
    from_angles,
    polar_angle,
)
from pretravel.maps import Observation, degrees_and_orders, real_spherical_harmonics
from pretravel.six_seats.hertz import curved_part_factor
from pretravel.six_seats.six_seat_slopes import pretravel_of_seats
from pretravel.six_seats.uneven_seats import IDEAL, PARAMETERS, SixSeats, seats_of_probes
from pretravel.uncertainty import SharedCovariance

CORRECTION_DEGREE = 8
"""Largest degree of the harmonics that correct a six-seat probe."""
_DECAY = 1.5  # of their amplitudes with the degree: smoother than noise, rougher than kinks (2.5)
ASYMMETRIC = slice(len(IDEAL), None)
"""The parameters of the asymmetry."""
_NAMES = [parameter.name for parameter in PARAMETERS]
_ANGLE = _NAMES.index("support_angle")
_PRIOR = np.array([parameter.prior_of_unknown for parameter in PARAMETERS])
_SPREAD = np.array([parameter.spread for parameter in PARAMETERS])
_AZIMUTH = _NAMES.index("rod_azimuth")
_STEEPEST = 7.0
"""Of the logarithm of the tangent of the seats' angle, which is then 0.05° from upright."""
_FIRST_DAMPING = 1e-3
_NOTHING = 1e-8
"""Promised gain at which a search ends, of the logarithm of a probability: the mode is then found
to a ten-thousandth of its uncertainty, which is as exact as the slopes are."""
_STUCK = 1e12  # damping at an edge where the seat that lifts first changes
_BLOCK = 2048
SEARCHED = 500
"""Directions in which a search begins, of more than twice as many."""
_AZIMUTHS = np.arange(0.0, 120.0, 15.0) * DEGREE
_WIDE_ASYMMETRIES = (3.0, 1.0)
_UNEVENNESS = (0.0, 1.0, 2.0)
"""Of the tripods that a search begins with, at each azimuth; the even one is the typical probe."""
_FIRST_STEPS, _STEPS = 8, 40
_FOLLOWED = 8
"""Of the searches with one scale of asymmetry, how many go on after the first steps."""
_NEARLY = 1e-3
"""Gain at which a wide search ends."""
_POSSIBLE = 12.0
"""Modes that are less probable than the best by more, a logarithm, are not followed."""
_SAME = 0.03 * MICROMETRE
"""Largest difference of the maps of one mode."""
_KICKS = 8
_WIDE_CORRECTION = 0.1
"""Share of the standard deviation of pretravel over the touched directions."""


@dataclass(frozen=True)
class PriorScales:
    """Scales of what is not known in advance.

    Attributes
    ----------
    asymmetry : float
        Multiple of the spreads of `pretravel.six_seats.uneven_seats.ASYMMETRIES`.
    correction : float
        Root mean square, over the sphere, of what a six-seat probe does not represent. [mm]
    fixed_scatter : float
        Standard deviation between directions that repeats do not reduce. [mm]
    noise : float
        Standard deviation of a single touch. [mm]
    """

    asymmetry: float
    correction: float
    fixed_scatter: float
    noise: float


class SixSeatProblem:
    """Mean touches of each direction, and a six-seat probe next to them.

    Parameters
    ----------
    observation : Observation
    """

    def __init__(self, observation: Observation) -> None:
        self.observation = observation
        self.axes = observation.axes
        self.extra = self.axes + (0 if observation.tip_known else 1)
        self.size = self.extra + len(PARAMETERS)
        self.count = np.bincount(observation.groups).astype(np.float64)
        total = [np.bincount(observation.groups, axis) for axis in observation.positions.T]
        self._positions = np.stack(total, axis=1) / self.count[:, None]
        radius = observation.reference_radius
        # A ring is concave; on its axis it is straight.
        bends = (-1.0 / radius, 0.0) if observation.ring else (1.0 / radius, 1.0 / radius)
        factor = float(curved_part_factor(observation.tip_radius, np.array([bends]))[0])
        self._compression = factor if math.isfinite(factor) else 1.0
        self.azimuth = self.extra + _AZIMUTH

    @property
    def prior(self) -> FloatArray:
        """Prior means of the unknowns, (u,)."""
        return np.concatenate([np.zeros(self.extra), _PRIOR])

    def parameters(self, x: FloatArray) -> FloatArray:
        """The numbers of the probe with these unknowns, in the order of `PARAMETERS`, (..., 18)."""
        found = np.array(x[..., self.extra :])
        found[..., _ANGLE] = np.arctan(np.exp(np.clip(found[..., _ANGLE], -_STEEPEST, _STEEPEST)))
        return found

    def rates(self, x: FloatArray) -> FloatArray:
        """Derivative of each parameter by its unknown, (..., 18)."""
        found = np.ones((*x.shape[:-1], len(PARAMETERS)))
        found[..., _ANGLE] = 1.0 / (2.0 * np.cosh(x[..., self.extra + _ANGLE]))
        return found

    def spread(self, asymmetry: float) -> FloatArray:
        """Prior standard deviations of the parameters at a scale of asymmetry, (18,)."""
        spread = _SPREAD.copy()
        spread[ASYMMETRIC] *= asymmetry
        return spread

    @cached_property
    def terms(self) -> IntArray:
        """Degree and order of the correction: without a first harmonic, which is a shift."""
        if self.observation.ring:
            orders = range(2, 2 * CORRECTION_DEGREE + 1)
            return np.array([(0, 0), *((m, s * m) for m in orders for s in (1, -1))])
        terms = degrees_and_orders(CORRECTION_DEGREE)
        return np.asarray(terms[terms[:, 0] != 1])

    @cached_property
    def harmonics(self) -> FloatArray:
        """Values of the correction's harmonics in the touched directions, (g, k)."""
        return real_spherical_harmonics(self.observation.group_directions, self.terms)

    def correction_variances(self, correction: float) -> FloatArray:
        """Prior variances of the coefficients of the correction, (k,). [mm²]

        A constant part of observed pretravel is uncertain; see `Observation.u_constant`.
        """
        variances = correction**2 * self.correction_shares()
        variances[0] += self.observation.u_constant**2
        return np.asarray(variances)

    def correction_shares(self) -> FloatArray:
        """Share of each harmonic in the mean square of a correction, (k,); they add up to one."""
        share = np.maximum(self.terms[:, 0], 2.0) ** (-2.0 * _DECAY)
        return np.asarray(share / share.sum())

    def covariance(self, scales: PriorScales) -> SharedCovariance:
        """Of the mean touches about a six-seat probe. [mm²]"""
        return SharedCovariance(
            scales.fixed_scatter**2
            + self.observation.step_scatter**2
            + scales.noise**2 / self.count,
            self.harmonics * np.sqrt(self.correction_variances(scales.correction)),
        )

    def moved(self, x: FloatArray) -> Observation:
        """The touches about the centre of these unknowns."""
        center = self.observation.center.copy()
        center[: self.axes] += x[: self.axes]
        return replace(self.observation, center=center)

    def misses(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Observed less modelled pretravel (..., g), and its derivatives (..., g, u). [mm]

        Parameters
        ----------
        x : (..., u) float
            Unknowns. Misses of unknowns that do not describe a probe are not finite.
        """
        together = self.slopes_and_misses(x)
        return together[..., -1], together[..., :-1]

    def slopes_and_misses(self, x: FloatArray) -> FloatArray:
        """As `misses`, in one array whose last column are the misses, (..., g, u + 1)."""
        seen = self.observation
        offset = self._positions[:, : self.axes] - seen.center[: self.axes]
        offset = offset - x[..., None, : self.axes]
        distance = np.sqrt(np.einsum("...i,...i->...", offset, offset))
        directions = np.zeros((*offset.shape[:-1], 3))
        np.divide(offset, distance[..., None], out=directions[..., : self.axes])
        if seen.ring:
            directions = -directions
            values = distance - (seen.reference_radius - seen.tip_radius)
        else:
            values = seen.reference_radius + seen.tip_radius - distance
        modelled, slopes = self._modelled(self.parameters(x), directions)
        level = x[..., self.axes : self.extra].sum(axis=-1, keepdims=True)
        # A centre moved by s adds n·s to the observed pretravel, on a sphere as in a ring.
        found = np.empty((*values.shape, self.size + 1))
        found[..., : self.axes] = directions[..., : self.axes]
        found[..., self.axes : self.extra] = 1.0
        np.multiply(slopes, -self.rates(x)[..., None, :], out=found[..., self.extra : -1])
        found[..., -1] = values + level - modelled
        return found

    def covariance_at(self, x: FloatArray, scales: PriorScales) -> FloatArray:
        """Of the unknowns, with the model linear about x, (u, u)."""
        _, _, matrix = _Weighted(self, [scales]).evaluated(x[None], np.zeros(1, dtype=np.int64))
        size = 1.0 / np.sqrt(np.diag(matrix[0]))
        return np.asarray(np.linalg.inv(matrix[0] * np.outer(size, size)) * np.outer(size, size))

    def _modelled(
        self, parameters: FloatArray, directions: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Pretravel (..., g) and its slopes (..., g, 18), in blocks that the cache holds."""
        seats = seats_of_probes(parameters)
        parts = [
            pretravel_of_seats(seats, directions[..., start : start + _BLOCK, :], self._compression)
            for start in range(0, directions.shape[-2], _BLOCK)
        ]
        pretravel, slopes = parts[0]
        if len(parts) > 1:
            pretravel = np.concatenate([part[0] for part in parts], axis=-1)
            slopes = np.concatenate([part[1] for part in parts], axis=-2)
        possible = seats.hold & _possible(seats)
        return np.where(possible[..., None], pretravel, np.nan), slopes


def _possible(seats: SixSeats) -> BoolArray:
    """Seats that push up and inwards, rods that rest outside of the axis."""
    steep = np.all((seats.angles > 0.0) & (seats.angles < 0.5 * np.pi), axis=-1)
    return np.asarray(steep & np.all(seats.radii > 0.0, axis=-1))


class _Weighted:
    """Residuals of touches and priors together, in units of their spreads, for several starts.

    With `rows` each start uses some of the directions only.
    """

    def __init__(
        self,
        problem: SixSeatProblem,
        scales: Sequence[PriorScales],
        rows: Sequence[IntArray] | None = None,
    ) -> None:
        self.problem = problem
        count = len(problem.count)
        parts = [np.arange(count)] * len(scales) if rows is None else rows
        keys = [(each, part.tobytes()) for each, part in zip(scales, parts, strict=True)]
        different = {key: number for number, key in enumerate(dict.fromkeys(keys))}
        self._of_start = np.array([different[key] for key in keys])
        first = dict(reversed(list(zip(keys, parts, strict=True))))
        self._rows = [first[key] for key in different]
        whole = {each: problem.covariance(each) for each in dict.fromkeys(scales)}
        self._covariances = [
            SharedCovariance(whole[each].own[part], whole[each].shared[part])
            for (each, _), part in zip(different, self._rows, strict=True)
        ]
        self._spread = np.array([problem.spread(each.asymmetry) for each, _ in different])
        self._used = np.zeros((len(different), count), dtype=bool)
        for used, part in zip(self._used, self._rows, strict=True):
            used[part] = True
        matrices = [each.whitening for each in self._covariances]
        self._whitening: FloatArray | None = None
        if all(matrix is not None for matrix in matrices):
            self._whitening = np.zeros((len(different), count, count))
            for whole_matrix, matrix, part in zip(
                self._whitening, matrices, self._rows, strict=True
            ):
                whole_matrix[np.ix_(part, part)] = matrix

    def evaluated(
        self, x: FloatArray, starts: IntArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Cost (s,), its gradient (s, u) and the Gauss-Newton matrix (s, u, u) of some starts.

        The cost is half the sum of squares; infinite where the unknowns are not a probe.
        """
        problem, used = self.problem, self._of_start[starts]
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            together = problem.slopes_and_misses(x)
            finite = np.isfinite(together @ np.ones(problem.size + 1))
        bad = ~np.all(finite | ~self._used[used], axis=-1)
        if not finite.all():
            together[~finite] = 0.0
        whitened = self._whitened(together, used)
        product = np.swapaxes(whitened, -1, -2) @ whitened
        product[bad] = 0.0
        spread = self._spread[used]
        own = (x - problem.prior)[:, problem.extra :] / spread
        gradient, matrix = product[:, :-1, -1].copy(), product[:, :-1, :-1].copy()
        gradient[:, problem.extra :] += own / spread
        diagonal = np.arange(problem.extra, problem.size)
        matrix[:, diagonal, diagonal] += spread**-2
        matrix[bad] += np.eye(problem.size)
        cost = 0.5 * (product[:, -1, -1] + np.sum(own**2, axis=-1))
        return np.where(bad, np.inf, cost), gradient, matrix

    def _whitened(self, together: FloatArray, used: IntArray) -> FloatArray:
        """Columns (s, g, c) of some starts, independent with variance one; zero in other rows."""
        if self._whitening is not None:
            return np.asarray(self._whitening[used] @ together)
        whitened = np.zeros_like(together)
        for number in np.unique(used):
            alike, rows = np.flatnonzero(used == number), self._rows[number]
            columns = np.moveaxis(together[np.ix_(alike, rows)], 1, 0)  # (g, s, c)
            flat = self._covariances[number].whitened(columns.reshape(len(columns), -1))
            whitened[np.ix_(alike, rows)] = np.moveaxis(flat.reshape(columns.shape), 0, 1)
        return whitened

    def evidence(self, cost: FloatArray, matrix: FloatArray) -> FloatArray:
        """Laplace's evidence at modes of all starts, (s,), without a common constant."""
        size = np.sqrt(matrix.diagonal(axis1=-2, axis2=-1))
        factor = np.linalg.cholesky(matrix / (size[:, :, None] * size[:, None, :]))
        volume = np.log(factor.diagonal(axis1=-2, axis2=-1) * size).sum(axis=-1)
        before = np.log(self._spread).sum(axis=-1)
        before += 0.5 * np.array([each.log_determinant for each in self._covariances])
        return np.asarray(-cost - volume - before[self._of_start])


class Modes(NamedTuple):
    """Where searches ended, each at the scales of its own."""

    x: FloatArray
    """(s, u)"""
    cost: FloatArray
    """Half the sum of squares of residuals and priors, (s,): less the logarithm of a probability.
    Infinite where a start was not a probe."""
    evidence: FloatArray
    """Logarithm of the probability of the touches at the scales, by Laplace's method, (s,)."""


def modes(
    problem: SixSeatProblem,
    scales: Sequence[PriorScales],
    starts: FloatArray,
    evaluations: int = 100,
    nothing: float = _NOTHING,
    rows: Sequence[IntArray] | None = None,
) -> Modes:
    """Posterior modes at given scales, from several starts at a time.

    Parameters
    ----------
    problem : SixSeatProblem
    scales : sequence of PriorScales
        Of each start.
    starts : (s, u) float
    evaluations : int
        A search stops after these.
    nothing : float
        A search also stops where no more than this is gained.
    rows : sequence of (r,) int, optional
        Directions that each search uses; all when not given.

    Notes
    -----
    Levenberg's and Marquardt's method, each start with a damping of its own (Nielsen 1999). All
    starts that still move are evaluated together.
    """
    weighted = _Weighted(problem, scales, rows)
    x, going = starts.copy(), np.arange(len(starts))
    cost, gradient, matrix = weighted.evaluated(x, going)
    going = going[np.isfinite(cost)]
    damping, growth = np.full(len(x), _FIRST_DAMPING), np.full(len(x), 2.0)
    diagonal = np.arange(problem.size)
    for _ in range(evaluations - 1):
        if not len(going):
            break
        slope, inner, damp = gradient[going], matrix[going], damping[going, None]
        size = inner[:, diagonal, diagonal]
        inner[:, diagonal, diagonal] += damp * size
        step = -np.linalg.solve(inner, slope[..., None])[..., 0]
        promised = -0.5 * np.sum(step * (slope - damp * size * step), axis=-1)
        tried = x[going] + step
        found = weighted.evaluated(tried, going)
        ratio = (cost[going] - found[0]) / np.maximum(promised, _NOTHING)
        better = ratio > 0.0
        taken, failed = going[better], going[~better]
        x[taken] = tried[better]
        cost[taken], gradient[taken], matrix[taken] = (part[better] for part in found)
        damping[taken] *= np.maximum(1.0 / 3.0, 1.0 - (2.0 * ratio[better] - 1.0) ** 3)
        growth[taken] = 2.0
        damping[failed] *= growth[failed]
        growth[failed] *= 2.0
        going = going[(promised > nothing) & (damping[going] < _STUCK)]
    return Modes(x, cost, weighted.evidence(cost, matrix))


def most_probable(
    problem: SixSeatProblem, scales: PriorScales, start: FloatArray, evaluations: int = 100
) -> tuple[FloatArray, float]:
    """The posterior mode at given scales from one start, and its cost: see `modes`."""
    found = modes(problem, [scales], start[None], evaluations)
    return found.x[0], float(found.cost[0])


def promised_gain(problem: SixSeatProblem, scales: PriorScales, x: FloatArray) -> float:
    """How much smaller the cost would be if the model were linear about x.

    Zero at a mode. Where the seat that lifts first changes, slopes jump, and a search can stop at
    such an edge: what it finds there depends on rounding, and the linear model promises what no
    probe keeps.

    Parameters
    ----------
    problem : SixSeatProblem
    scales : PriorScales
    x : (u,) float

    Returns
    -------
    float
        As the cost of `most_probable`, a logarithm of a probability.
    """
    weighted = _Weighted(problem, [scales])
    _, gradient, matrix = weighted.evaluated(x[None], np.zeros(1, dtype=np.int64))
    size = np.sqrt(np.diag(matrix[0]))
    scaled = gradient[0] / size
    return 0.5 * float(scaled @ np.linalg.solve(matrix[0] / np.outer(size, size), scaled))


def oriented_starts(problem: SixSeatProblem, scales: PriorScales) -> FloatArray:
    """Modes of very uneven probes, from many tripods: places from which a search goes on.

    Rods repeat after a third of a turn, so that the azimuths of one third are sufficient. The
    asymmetry decides which seat lifts first in a direction: each azimuth has several solutions.
    The search begins with typical tripods and with tripods drawn from the priors (with a fixed
    seed). At the usual scales a search would miss the right solution. The asymmetry is
    therefore free, and a correction represents the remaining difference. One of the two scales
    alone misses very uneven probes.

    Parameters
    ----------
    problem : SixSeatProblem
    scales : PriorScales
        The usual ones.

    Returns
    -------
    (s, u) float
        Those with different maps, the most probable first.
    """
    observation = problem.observation
    values = np.bincount(observation.groups, observation.values) / problem.count
    correction = max(_WIDE_CORRECTION * float(np.std(values)), scales.correction)
    begun, wide = _drawn_tripods(problem, scales, correction)
    begun, cost, _ = modes(problem, wide, begun, _FIRST_STEPS, _NEARLY)
    kept = np.concatenate(
        [np.flatnonzero(own)[np.argsort(cost[own])[:_FOLLOWED]] for own in _alike(wide)]
    )
    followed = [wide[number] for number in kept]
    ends, cost, _ = modes(problem, followed, begun[kept], _STEPS, _NEARLY)
    for own in _alike(followed):
        cost[own] -= cost[own].min()
    ends = ends[np.argsort(cost, kind="stable")[: int(np.sum(cost < _POSSIBLE))]]
    return ends[different(problem, ends)]


def different(problem: SixSeatProblem, found: FloatArray) -> list[int]:
    """Rows of several unknowns (s, u) whose maps are not alike; of alike ones the first.

    A probe has three descriptions, each beginning with another rod, and unknowns that touches
    hardly determine differ where maps do not: maps are compared.
    """
    seen = problem.observation
    if seen.ring:
        directions = from_angles(0.5 * np.pi, np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False))
    else:
        directions = fibonacci_cap(96, float(polar_angle(seen.group_directions).max()))
    with np.errstate(invalid="ignore"):
        maps = pretravel_of_seats(
            seats_of_probes(problem.parameters(found)), np.tile(directions, (len(found), 1, 1))
        )[0]
    maps -= found[:, : problem.axes] @ directions[:, : problem.axes].T
    kept: list[int] = []
    for number, own in enumerate(maps):
        if all(np.abs(own - maps[other]).max() > _SAME for other in kept):
            kept.append(number)
    return kept


def _drawn_tripods(
    problem: SixSeatProblem, scales: PriorScales, correction: float
) -> tuple[FloatArray, list[PriorScales]]:
    """Tripods at all azimuths, (s, u), and the scales that each is sought with."""
    generator = np.random.default_rng(0)
    starts, wide = [], []
    for asymmetry in _WIDE_ASYMMETRIES:
        spread = problem.spread(asymmetry)
        spread[_AZIMUTH] = 0.0
        for azimuth in _AZIMUTHS:
            for size in _UNEVENNESS:
                start = problem.prior
                start[problem.axes : problem.extra] = 10.0 * MICROMETRE
                start[problem.azimuth] = azimuth
                drawn = spread * generator.standard_normal(len(spread))
                drawn[ASYMMETRIC] *= size
                start[problem.extra :] += drawn if size > 0.0 else 0.0
                starts.append(start)
                wide.append(replace(scales, asymmetry=asymmetry, correction=correction))
    return np.array(starts), wide


def _alike(scales: Sequence[PriorScales]) -> list[BoolArray]:
    """Masks of equal scales."""
    return [np.array([each == one for each in scales]) for one in dict.fromkeys(scales)]


def beside(problem: SixSeatProblem, scales: PriorScales, x: FloatArray) -> FloatArray:
    """Places about a mode, drawn from the posterior of the linear model (seeded), (s, u).

    At an edge, where the seat that lifts first changes, a search stops for lack of a slope along
    the edge. The search then goes on.
    """
    _, _, matrix = _Weighted(problem, [scales]).evaluated(x[None], np.zeros(1, dtype=np.int64))
    size = 1.0 / np.sqrt(np.diag(matrix[0]))
    root = np.linalg.cholesky(matrix[0] * np.outer(size, size))
    drawn = np.random.default_rng(0).standard_normal((len(x), _KICKS))
    return np.asarray(x + (size[:, None] * np.linalg.solve(root.T, drawn)).T)
