"""The most probable six-seat probe for touches on a reference, at given scales of its priors.

Unknowns are the shift of the centre, the tip radius where it was not given, and the parameters of
`pretravel.six_seats.uneven_seats`. The part of pretravel that a six-seat probe does not represent has
a covariance between directions, which weights the residuals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, IntArray, PretravelError, unit
from pretravel.maps import Observation, degrees_and_orders, real_spherical_harmonics
from pretravel.prediction import curved_part_factor
from pretravel.six_seats.six_seat_slopes import six_seat_pretravel
from pretravel.six_seats.uneven_seats import IDEAL, PARAMETERS
from pretravel.uncertainty import SharedCovariance

CORRECTION_DEGREE = 8
"""Largest degree of the harmonics that correct a six-seat probe."""
_DECAY = 1.5  # of their amplitudes with the degree: smoother than noise, rougher than kinks (2.5)
ASYMMETRIC = slice(len(IDEAL), None)
"""The parameters of the asymmetry."""
_NAMES = [parameter.name for parameter in PARAMETERS]
_PRIOR = np.array([parameter.prior for parameter in PARAMETERS])
_SPREAD = np.array([parameter.spread for parameter in PARAMETERS])
_AZIMUTH = _NAMES.index("rod_azimuth")
_FAR = 1.0  # mm: a residual where the parameters do not describe a probe
_BLOCK = 2048
SEARCHED = 500
"""Directions in which a search begins, of more than twice as many."""
_AZIMUTHS = np.arange(0.0, 120.0, 15.0) * DEGREE
_WIDE_ASYMMETRIES = (3.0, 1.0)
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
    """Mean touches of each direction, and a six-seat probe beside them.

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

        The reference's radius is uncertain, and its error is a constant part of pretravel.
        """
        variances = correction**2 * self.correction_shares()
        variances[0] += self.observation.u_reference_radius**2
        return np.asarray(variances)

    def correction_shares(self) -> FloatArray:
        """Share of each harmonic in the mean square of a correction, (k,); they add up to one."""
        share = np.maximum(self.terms[:, 0], 2.0) ** (-2.0 * _DECAY)
        return np.asarray(share / share.sum())

    def covariance(self, scales: PriorScales) -> SharedCovariance:
        """Of the mean touches about a six-seat probe. [mm²]"""
        return SharedCovariance(
            scales.fixed_scatter**2 + scales.noise**2 / self.count,
            self.harmonics * np.sqrt(self.correction_variances(scales.correction)),
        )

    def moved(self, x: FloatArray) -> Observation:
        """The touches about the centre of these unknowns."""
        center = self.observation.center.copy()
        center[: self.axes] += x[: self.axes]
        return replace(self.observation, center=center)

    def misses(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Observed less modelled pretravel (g,), and its derivatives by the unknowns (g, u). [mm]

        Raises
        ------
        PretravelError
            Parameters that do not describe a probe.
        """
        center = self.observation.center.copy()
        center[: self.axes] += x[: self.axes]
        offset = (self._positions - center)[:, : self.axes]
        distance = np.linalg.norm(offset, axis=1)
        outward = unit(offset)
        seen = self.observation
        if seen.ring:
            directions = np.hstack([-outward, np.zeros((len(outward), 1))])
            values = distance - (seen.reference_radius - seen.tip_radius)
        else:
            directions, values = outward, seen.reference_radius + seen.tip_radius - distance
        modelled, slopes = self._modelled(x[self.extra :], directions)
        level = x[self.axes : self.extra].sum()
        # A centre moved by s adds n·s to the observed pretravel, on a sphere as in a ring.
        ones = np.ones((len(values), self.extra - self.axes))
        found = np.hstack([directions[:, : self.axes], ones, -slopes])
        return values + level - modelled, found

    def _modelled(
        self, parameters: FloatArray, directions: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Pretravel (g,) and its slopes (g, 18), in blocks that the processor's cache holds."""
        pretravel = np.empty(len(directions))
        slopes = np.empty((len(directions), len(PARAMETERS)))
        for start in range(0, len(directions), _BLOCK):
            part = slice(start, start + _BLOCK)
            pretravel[part], slopes[part] = six_seat_pretravel(
                parameters, directions[part], self._compression
            )
        return pretravel, slopes


class _Weighted:
    """Residuals of touches and priors together, in units of their spreads."""

    def __init__(self, problem: SixSeatProblem, scales: PriorScales) -> None:
        self.problem = problem
        self._covariance = problem.covariance(scales)
        self._spread = problem.spread(scales.asymmetry)
        self._at: FloatArray | None = None
        self._found: tuple[FloatArray, FloatArray] | None = None

    def _evaluated(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Misses and slopes: values are asked for first, slopes at the same place after them."""
        if self._found is None or self._at is None or not np.array_equal(self._at, x):
            try:
                misses, slopes = self.problem.misses(x)
            except PretravelError:  # seats that do not hold the tripod: far from every prior
                count = len(self.problem.count)
                misses, slopes = np.full(count, _FAR), np.zeros((count, self.problem.size))
            self._at = x.copy()
            self._found = (
                np.where(np.isfinite(misses), misses, _FAR),
                np.where(np.isfinite(slopes), slopes, 0.0),
            )
        return self._found

    def residuals(self, x: FloatArray) -> FloatArray:
        own = (x - self.problem.prior)[self.problem.extra :] / self._spread
        return np.concatenate([self._covariance.whitened(self._evaluated(x)[0]), own])

    def jacobian(self, x: FloatArray) -> FloatArray:
        priors = np.zeros((len(self._spread), self.problem.size))
        priors[:, self.problem.extra :] = np.diag(1.0 / self._spread)
        return np.vstack([self._covariance.whitened(self._evaluated(x)[1]), priors])


def most_probable(
    problem: SixSeatProblem, scales: PriorScales, start: FloatArray, evaluations: int = 100
) -> tuple[FloatArray, float]:
    """The posterior mode at given scales, from a start.

    Parameters
    ----------
    problem : SixSeatProblem
    scales : PriorScales
    start : (u,) float
    evaluations : int
        The search stops after these.

    Returns
    -------
    x : (u,) float
    cost : float
        Half the sum of squares of residuals and priors.
    """
    from scipy.optimize import leastsq

    weighted = _Weighted(problem, scales)
    size = np.concatenate(
        [np.full(problem.extra, 1.0 * MICROMETRE), np.minimum(problem.spread(scales.asymmetry), 1)]
    )
    # MINPACK's Levenberg-Marquardt without the checks of `least_squares`, which take half the time.
    found = leastsq(
        weighted.residuals,
        start,
        Dfun=weighted.jacobian,
        diag=1.0 / size,
        maxfev=evaluations,
        ftol=1e-10,
        xtol=1e-10,
        full_output=True,
    )
    residuals = found[2]["fvec"]
    return np.asarray(found[0]), 0.5 * float(residuals @ residuals)


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
    weighted = _Weighted(problem, scales)
    residuals, slopes = weighted.residuals(x), weighted.jacobian(x)
    left = residuals - slopes @ np.linalg.lstsq(slopes, residuals, rcond=None)[0]
    return 0.5 * float(residuals @ residuals - left @ left)


def oriented_starts(problem: SixSeatProblem, scales: PriorScales) -> list[FloatArray]:
    """The best fits from eight azimuths of the tripod, for two scales of asymmetry.

    The search is wide: at the usual scales it stops beside the seats that lift first, and a very
    uneven probe is not found. So the asymmetry is free, and a correction stands for what is left.
    Either of the two scales alone misses one of six very uneven probes.

    Parameters
    ----------
    problem : SixSeatProblem
    scales : PriorScales
        The usual ones.

    Returns
    -------
    list of (u,) float
    """
    observation = problem.observation
    values = np.bincount(observation.groups, observation.values) / problem.count
    correction = max(_WIDE_CORRECTION * float(np.std(values)), scales.correction)
    start = problem.prior
    start[problem.axes : problem.extra] = 10.0 * MICROMETRE
    found = []
    for asymmetry in _WIDE_ASYMMETRIES:
        wide = replace(scales, asymmetry=asymmetry, correction=correction)
        first = []
        for azimuth in _AZIMUTHS:
            start[problem.azimuth] = azimuth
            first.append(most_probable(problem, wide, start, 8))
        first.sort(key=lambda each: each[1])
        followed = [most_probable(problem, wide, x) for x, _ in first[:2]]
        found.append(min(followed, key=lambda each: each[1])[0])
    return found
