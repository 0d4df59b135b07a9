"""The form of a surface at its touched points: what is left of residuals without the noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import ndtri

from pretravel.base import FloatArray, IntArray, frozen
from pretravel.drawing.features.feature_uncertainty import FeatureErrors
from pretravel.measurement import Association
from pretravel.uncertainty import COVERAGE_FACTOR, EXPANDED_COVERAGE

_SEED = 1
_STEPS = 2000  # of probability: the ends of an interval of 95 % are 45 of them
_NOISE_DOF = 50  # of the repeatability: 25 directions touched three times, as is usual
_TRIALS = 1000  # an end of 2.5 % is 25 of them, and the steps of width are interpolated
_FEWEST_TRIALS = 200
_MOST_DRAWS = 4_000_000  # fewer trials of very many points
_BELOW = np.linspace(1.0, 0.0, 7)  # widths that are tried, from the measured one down to the …
_RARE = 0.999  # … quantile of what errors alone produce, and …
_ABOVE = np.array([0.0, 0.7, 1.4, 2.0, 2.6, 3.4, 5.0, 8.0])  # … above it in its uncertainties
_EXCHANGES = 200  # of points of one zone; as many as there are columns are usual
_ROUNDING = 1e-9
_DEPENDENT = 1e-9


@dataclass(frozen=True, eq=False)
class FormResult:
    """The form of a surface at its touched points, and the range that was measured.

    Attributes
    ----------
    measured : float
        Range of the residuals: largest minus smallest. The noise of the points enlarges it. [mm]
    value : float
        Form of the surface at the touched points: this range less its enlargement. [mm]
    quantiles : (q,) float
        Of that form, ascending, at the middles of equal steps of probability. [mm]
    noise : float
        Mean range that the errors of the points produce on a perfect feature. [mm]
    most_noise : float
        Range that they exceed in 5 of 100 cases. [mm]

    >>> equal_steps = np.linspace(1e-3, 2e-3, 1001)
    >>> form = FormResult(2.2e-3, 1.8e-3, equal_steps, 3e-4, 5e-4)
    >>> [round(end, 6) for end in form.interval], round(form.expanded_u, 6)
    ([0.001022, 0.001978], 0.000778)
    """

    measured: float
    value: float
    quantiles: FloatArray
    noise: float
    most_noise: float

    def at_most(self, probability: float) -> float:
        """The bound below which the form lies with a probability. [mm]"""
        steps = (np.arange(len(self.quantiles)) + 0.5) / len(self.quantiles)
        return float(np.interp(probability, steps, self.quantiles))

    def probability_of(self, tolerance: float) -> float:
        """The probability that the form is not larger than a tolerance."""
        return float(np.mean(self.quantiles <= tolerance))

    @property
    def interval(self) -> tuple[float, float]:
        """Where the form lies with 95 %; from zero where only an upper bound is known. [mm]"""
        outside = 1.0 - EXPANDED_COVERAGE
        low = self.at_most(0.5 * outside)
        return low, self.at_most(1.0 - (0.5 * outside if low > 0.0 else outside))

    @property
    def expanded_u(self) -> float:
        """U: the value plus and minus U contains the interval. [mm]"""
        low, high = self.interval
        return max(self.value - low, high - self.value)

    @property
    def u(self) -> float:
        """Half of U. [mm]"""
        return self.expanded_u / COVERAGE_FACTOR


def form_result(errors: FeatureErrors, zone: Association | None = None) -> FormResult:
    """The form of a surface at its touched points, from the residuals of a feature.

    Parameters
    ----------
    errors : FeatureErrors
        With the association of least squares.
    zone : Association, optional
        Of the minimum zone of the same points: the form is its width then (ISO 1101); else it is
        the range about the feature of least squares.

    Returns
    -------
    FormResult
        As `form_by_trials` finds it from the errors that the residuals have after the fit.
    """
    found = zone or errors.association
    left = np.asarray(found.residuals - 0.5 * (found.residuals.min() + found.residuals.max()))
    generator, count = np.random.default_rng(_SEED), trials_for(len(left))
    least_squares = errors.association.residual_change

    def range_of(rows: FloatArray) -> FloatArray:
        # Row by row over all trials at once: each trial has few points.
        return np.asarray(np.ptp(np.ascontiguousarray(least_squares(rows).T), axis=0))

    if zone is None:
        width, load = range_of, np.zeros(len(left))
        load[left.argmax()], load[left.argmin()] = 1.0, -1.0
    else:
        width, load = partial(zone_widths, columns=zone.jacobian), zone_load(left, zone.jacobian)
    signs = np.sign(load)
    return form_by_trials(
        left,
        errors.noise_trials(generator, count),
        width,
        load,
        opposed=None
        if errors.correlation_known
        else errors.opposed_trials(signs, generator, count),
        u_machine=errors.machine,
        generator=generator,
    )


def trials_for(count: int) -> int:
    """How often the errors of so many points are drawn."""
    return max(min(_TRIALS, _MOST_DRAWS // max(count, 1)), _FEWEST_TRIALS)


def form_by_trials(
    left: FloatArray,
    drawn: FloatArray,
    width: Callable[[FloatArray], FloatArray],
    load: FloatArray,
    *,
    u_machine: float,
    generator: np.random.Generator,
    opposed: FloatArray | None = None,
) -> FormResult:
    """A form, or another width of a zone, by trials of what errors make of it.

    Parameters
    ----------
    left : (n,) float
        Distances of the points from the middle of their zone. [mm]
    drawn : (t, n) float
        Errors of the points, drawn. [mm]
    width : callable
        From distances (t, n) to the widths of the zones that contain them, (t,).
    load : (n,) float
        Change of the width by a movement of each point: few points carry a zone.
    u_machine : float
        Standard uncertainty of a length by other causes than the probe. [mm]
    generator : Generator
    opposed : (t, n) float, optional
        Errors with the correlation that makes the width most uncertain, where none is given.

    Notes
    -----
    The ends of a zone are the largest of many distances, so that errors widen it: the measured
    width lies above the form, and the form's distribution is skewed. Widths are tried, each with
    a form of this width. Below the measured width it is the one nearest to the points, with all
    that is outside cut off: many points lie at its ends, and no form of this width is widened
    more. Above, the few points that carry the zone are at its ends. The others are where they were
    found, but nearer to the middle: their distances contain errors, which would count twice.
    Squares of form and errors add up to those that were found, so that the form has the root of
    its share. The probability that the form is at most so wide is that with which errors
    make at least the measured width of it.
    """
    measured = 2.0 * float(np.abs(left).max())
    alone = width(drawn)
    # How large the noise is was found with few touches itself.
    scale = np.sqrt(_NOISE_DOF / generator.chisquare(_NOISE_DOF, len(drawn)))[:, None]
    ways = [scale * each for each in (drawn, opposed) if each is not None]
    # Not the standard deviation, to which the rare large errors of few touches add most.
    u = max(float(np.quantile(np.abs(each @ load), EXPANDED_COVERAGE)) for each in ways)
    u /= COVERAGE_FACTOR
    down = min(float(np.quantile(alone, _RARE)), measured)
    tried = np.concatenate([measured - down * _BELOW, measured + u * _ABOVE])
    # Less than errors alone make is luck, or their uncertainty is too large: it proves nothing.
    seen = max(measured, float(np.median(alone)))
    share = np.zeros(len(tried))
    inner = left * math.sqrt(1.0 - min(float(alone.mean()) / max(measured, 1e-300), 1.0) ** 2)
    for k, goal in enumerate(tried):
        below = k < len(_BELOW)
        ends = np.clip(left if below else inner, -0.5 * goal, 0.5 * goal)
        if not below:
            ends = np.where(load == 0.0, ends, 0.5 * goal * np.sign(load))
        size = float(width(ends[None])[0])
        shape = ends * (goal / size) if size > 0.0 else ends
        wide = [
            float(np.mean(width(shape + each) >= (measured if below else seen))) for each in ways
        ]
        share[k] = max(wide) if below else min(wide)
    probability = (np.arange(_STEPS) + 0.5) / _STEPS
    few = len(_BELOW)
    least = _inverse(tried[:few], share[:few], probability, 0.5 / len(drawn))
    most = _inverse(tried[few:], share[few:], probability, 0.5 / len(drawn))
    quantiles = np.where(probability < 0.5, least, np.maximum(most, least))
    if u_machine > 0.0:
        quantiles = _widened(quantiles, u_machine, generator)
    return FormResult(
        measured=measured,
        value=float(np.interp(0.5, probability, least)),
        quantiles=frozen(quantiles),
        noise=float(alone.mean()),
        most_noise=float(np.quantile(alone, 0.95)),
    )


def _inverse(
    tried: FloatArray, share: FloatArray, probability: FloatArray, least: float
) -> FloatArray:
    """Quantiles from probabilities of some widths, between which they are as of a normal law."""
    z = ndtri(np.clip(np.maximum.accumulate(share), least, 1.0 - least))
    kept = np.concatenate([[True], np.diff(z) > 0.0])
    return np.asarray(np.interp(ndtri(probability), z[kept], tried[kept]))


def zone_widths(rows: FloatArray, columns: FloatArray) -> FloatArray:
    """Smallest widths of zones about zero that motions along columns leave.

    Parameters
    ----------
    rows : (t, n) float
        Distances. [mm]
    columns : (n, k) float

    Returns
    -------
    (t,) float
        Twice the smallest largest distance. [mm]

    >>> middle = np.ones((4, 1))
    >>> zone_widths(np.array([[0.0, 1.0, 3.0, 2.0]]), middle).tolist()
    [3.0]
    """
    return _zones(rows, columns)[0]


def zone_load(left: FloatArray, columns: FloatArray) -> FloatArray:
    """Change of the width of a zone by a movement of each point, (n,) from (n,) and (n, k).

    >>> zone_load(np.array([-1.5, -0.5, 1.5, 0.5]), np.ones((4, 1))).tolist()
    [-1.0, 0.0, 1.0, 0.0]
    """
    _, held, signed = _zones(left[None], columns)
    found = np.zeros(len(left))
    found[held[0]] = 2.0 * signed[0]
    return found


def _zones(rows: FloatArray, columns: FloatArray) -> tuple[FloatArray, IntArray, FloatArray]:
    """Widths, the points that carry each zone, and their loads with the sign of the side.

    Exchange of the points that carry, which is the dual simplex method, of all rows together.
    """
    columns = _independent(columns)
    count, k = columns.shape
    if k >= count:  # the zone follows all points
        nothing = np.zeros((len(rows), 1))
        return nothing[:, 0], nothing.astype(int), nothing
    first = _first_points(columns)
    balance = np.linalg.svd(columns[first].T)[2][-1]
    held = np.tile(first, (len(rows), 1))
    side = np.where(rows[:, first] @ balance >= 0.0, 1.0, -1.0)
    sign = np.where(balance >= 0.0, 1.0, -1.0) * side[:, None]
    width, load = np.zeros(len(rows)), np.zeros(held.shape)
    active = np.arange(len(rows))
    for _ in range(_EXCHANGES):
        own, points, signs = rows[active], held[active], sign[active]
        matrix = np.ones((len(active), k + 1, k + 1))
        matrix[:, :k] = (signs[:, :, None] * columns[points]).transpose(0, 2, 1)
        inverse = np.linalg.inv(matrix)
        solved = np.einsum("bji,bj->bi", inverse, -signs * np.take_along_axis(own, points, axis=1))
        height, share = -solved[:, k], np.maximum(inverse[:, :, k], 0.0)
        width[active], load[active] = 2.0 * height, share * signs
        distance = own + solved[:, :k] @ columns.T
        far = np.abs(distance).argmax(axis=1)
        most = np.take_along_axis(distance, far[:, None], axis=1)[:, 0]
        more = np.abs(most) > height * (1.0 + _ROUNDING) + 1e-300
        if not more.any():
            break
        active, far, inverse, share = active[more], far[more], inverse[more], share[more]
        side = np.sign(most[more])
        entering = np.column_stack([side[:, None] * columns[far], np.ones(len(active))])
        change = np.einsum("bij,bj->bi", inverse, entering)
        positive = change > _ROUNDING
        ratio = np.where(positive, share / np.where(positive, change, 1.0), np.inf)
        leaves = ratio.argmin(axis=1)
        held[active, leaves], sign[active, leaves] = far, side
    return width, held, load


def _independent(columns: FloatArray) -> FloatArray:
    """An orthogonal basis of the columns, whose entries are about as large as 1."""
    if columns.shape[1] == 0:
        return columns
    lengths = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    basis, size, _ = np.linalg.svd(columns / lengths, full_matrices=False)
    return np.asarray(basis[:, size > _DEPENDENT * size[0]] * np.sqrt(len(columns)))


def _first_points(columns: FloatArray) -> IntArray:
    """As many points as columns, which determine them, and one more."""
    from scipy.linalg import qr

    order = qr(columns.T, mode="economic", pivoting=True)[2]
    return np.asarray(order[: columns.shape[1] + 1])


def _widened(quantiles: FloatArray, u: float, generator: np.random.Generator) -> FloatArray:
    """Quantiles of a form whose lengths have a further standard uncertainty."""
    drawn = np.repeat(quantiles, 10)
    drawn = np.sort(np.maximum(drawn + u * generator.standard_normal(len(drawn)), 0.0))
    return np.asarray(np.mean(drawn.reshape(-1, 10), axis=1))
