"""Conformity with a tolerance, with the uncertainty of the measurement: ISO 14253-1, JCGM 106."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial

import numpy as np
from scipy.special import ndtr, ndtri, stdtr, stdtrit

from pretravel.base import (
    COORDINATE,
    DISTANCE,
    PROBABILITY,
    UNCERTAINTY,
    FloatArray,
    PretravelError,
    checked,
)
from pretravel.drawing.features.feature_form import FormResult
from pretravel.drawing.features.largest_distance import drawn_errors
from pretravel.drawing.features.measured_feature import position_and_uncertainty

DEFAULT_PROBABILITY = 0.95
"""Probability at which conformity or nonconformity is proven: the default of ISO 14253-1:2017."""
_TRIALS, _FEWEST_TRIALS, _MOST_DRAWS = 40_000, 4_000, 800_000
_STEPS = 50  # of a bisection: to the last digit


class ConformityVerdict(Enum):
    """The three outcomes of the decision rule."""

    CONFORMS = "conforms"
    DOES_NOT_CONFORM = "does not conform"
    UNDECIDED = "cannot be decided"


_BY_PROBING_ALONE = {
    ConformityVerdict.CONFORMS: "within the tolerance",
    ConformityVerdict.DOES_NOT_CONFORM: "outside the tolerance",
}
MACHINE_NOT_IN_U = "machine not in u"
"""What a verdict adds where u contains the errors of probing alone."""

AT_TOUCHED_POINTS = " at the touched points"
"""What a verdict on a form adds: a larger form between the points is not seen."""


def verdict_words(verdict: ConformityVerdict, u_machine: float) -> str:
    """An outcome in words: conformity is stated only where the errors of the machine are in u.

    Parameters
    ----------
    verdict : ConformityVerdict
    u_machine : float
        Standard uncertainty of a length by the machine's geometry, temperature and clamping. [mm]

    >>> verdict_words(ConformityVerdict.CONFORMS, 0.002)
    'conforms'
    >>> verdict_words(ConformityVerdict.CONFORMS, 0.0)
    'within the tolerance'
    """
    return verdict.value if u_machine > 0.0 else _BY_PROBING_ALONE.get(verdict, verdict.value)


@dataclass(frozen=True)
class Conformity:
    """A quantity with its tolerance, and the decision about it.

    Attributes
    ----------
    name : str
    value, u : float
        [mm]
    lower, upper : float
        Limits of the tolerance; -inf where there is no lower one. [mm]
    guard_band : float
        Distance of the acceptance limits from the limits of the tolerance. Not a number where the
        tolerance is too narrow for the uncertainty: no value proves conformity. [mm]
    rejection_band : float
        Distance beyond a limit of the tolerance from which nonconformity is proven. [mm]
    probability : float
        That the true value conforms.
    required : float
        Probability at which conformity or nonconformity is proven.
    verdict : ConformityVerdict
    dof : float
        Degrees of freedom of `u`.
    of_touched_points : bool
        Whether the decision is about the touched points alone, as that about a form is: a larger
        form between them is not seen.
    bonus : float
        Part of `upper` by which the size of a feature enlarges the tolerance (ISO 2692). [mm]
    corrected : bool
        Whether the effect of noise near zero was subtracted from `value` after the decision.
    """

    name: str
    value: float
    u: float
    lower: float
    upper: float
    guard_band: float
    rejection_band: float
    probability: float
    required: float
    verdict: ConformityVerdict
    dof: float = math.inf
    of_touched_points: bool = False
    bonus: float = 0.0
    corrected: bool = False

    @property
    def coverage(self) -> float:
        """Factor of the standard uncertainty for a band at one limit, 1.645 for 95 %."""
        return _quantile(self.dof, self.required)

    def with_value(self, value: float, u: float) -> Conformity:
        """The same decision, with a value from which the effect of noise was subtracted. [mm]

        The bands stay those of values from which nothing was subtracted: they hold at the limit,
        where less is subtracted than near zero.
        """
        corrected = not math.isclose(value, self.value, rel_tol=1e-9)
        return replace(self, value=value, u=u, corrected=corrected)


def _quantile(dof: float, probability: float) -> float:
    """Of Student's t; of the normal distribution where the degrees of freedom are infinite."""
    return float(ndtri(probability) if math.isinf(dof) else stdtrit(dof, probability))


def conformity_words(conformity: Conformity, u_machine: float) -> str:
    """The outcome of one decision in words, with what it speaks of.

    Parameters
    ----------
    conformity : Conformity
    u_machine : float
        As of `verdict_words`. [mm]
    """
    words = verdict_words(conformity.verdict, u_machine)
    inside = conformity.verdict is ConformityVerdict.CONFORMS
    return words + AT_TOUCHED_POINTS if inside and conformity.of_touched_points else words


def size_conformity(
    name: str,
    value: float,
    u: float,
    limits: tuple[float, float],
    required: float,
    *,
    dof: float = math.inf,
) -> Conformity:
    """Decide about a quantity with limits on one or both sides.

    Parameters
    ----------
    name : str
    value, u : float
        [mm]
    limits : pair of float
        Lower and upper; infinite where there is none. [mm]
    required : float
        Probability for a decision, above 0.5.
    dof : float
        Degrees of freedom of `u`: the error over u has Student's distribution with them.

    Returns
    -------
    Conformity

    References
    ----------
    ISO 14253-1:2017 (from memory, not compared with its text): conformity is proven where its
    probability is at least 95 %. JCGM 106, section 7: this probability.

    >>> bore = size_conformity("diameter", 20.019, 0.001, (20.0, 20.021), 0.95)
    >>> bore.verdict.value, round(bore.guard_band, 6), round(bore.probability, 3)
    ('conforms', 0.001645, 0.977)
    """
    lower, upper = limits
    _check(required, u, lower, upper)

    def probability(y: float) -> float:
        if u == 0.0:
            return float(lower <= y <= upper)
        below = ndtr if math.isinf(dof) else partial(stdtr, dof)
        return float(below((upper - y) / u) - below((lower - y) / u))

    checked(value, "the value", COORDINATE)
    band = _quantile(dof, required) * u
    if math.isfinite(lower) and math.isfinite(upper):
        guard = _guard_band(lambda g: probability(upper - g), 0.5 * (upper - lower), required)
    else:
        guard = band
    found = probability(value)
    verdict = _verdict(found, required, u, beyond=not lower - band < value < upper + band)
    return Conformity(name, value, u, lower, upper, guard, band, found, required, verdict, dof)


def position_conformity(
    located: FloatArray,
    covariance: FloatArray,
    tolerance: float,
    required: float,
    *,
    dof: float = math.inf,
) -> Conformity:
    """Decide about a position with a tolerance zone around the nominal one.

    Parameters
    ----------
    located : (m,) float
        Distance from the nominal position, by direction. [mm]
    covariance : (m, m) float
        [mm²]
    tolerance : float
        Diameter of the zone; for a plane or a line, its width. [mm]
    required : float
    dof : float
        Degrees of freedom of the covariance.

    Returns
    -------
    Conformity
        That of one place in `zone_conformity`. Its value is twice the distance, which ISO 1101
        compares with the tolerance.

    >>> hole = position_conformity(np.array([0.01, 0.0]), 1e-6 * np.eye(2), 0.05, 0.95)
    >>> round(hole.value, 6), hole.verdict.value, round(hole.guard_band, 4)
    (0.02, 'conforms', 0.0033)
    """
    return zone_conformity(
        "position", located[None], covariance, (tolerance, 0.0, 0.0), required, dof=dof
    )


def zone_conformity(
    name: str,
    located: FloatArray,
    covariance: FloatArray,
    zone: tuple[float, float, float],
    required: float,
    *,
    dof: float = math.inf,
    refit: FloatArray | None = None,
) -> Conformity:
    """Decide about places of derived elements that must lie in zones of one size.

    Parameters
    ----------
    name : str
    located : (g, m) float
        Distances of the places from their nominal ones, by direction. [mm]
    covariance : (g m, g m) float
        Of all; with one row more where the size of a feature changes the tolerance. [mm²]
    zone : tuple of three float
        Diameter or width of the zone; its growth by the size, and the largest one (ISO 2692). [mm]
    required : float
    dof : float
        Degrees of freedom of the covariance.
    refit : (g m, g m) float, optional
        What of errors is left by a fit of the motions that the datums leave free, as many rows as
        the covariance. An error that the fit would take up does not count.

    Returns
    -------
    Conformity
        Its value is twice the largest distance, its upper limit the zone with its growth. The
        probability is found by trials, because a distance near zero has no normal distribution. It
        does not conform where this is so with the required probability and the value exceeds the
        limit by that quantile of its uncertainty along itself.

    >>> two = zone_conformity("position", np.array([[0.01, 0.0], [0.0, 0.005]]), 1e-6 * np.eye(4),
    ...                       (0.05, 0.0, 0.0), 0.95)
    >>> round(two.value, 6), two.verdict.value
    (0.02, 'conforms')
    """
    width, bonus, most_bonus = zone
    checked(width, "the tolerance", DISTANCE, inputs=("tolerance",))
    groups, count = located.shape, located.size
    trials = max(min(_TRIALS, _MOST_DRAWS // len(covariance)), _FEWEST_TRIALS)
    errors = drawn_errors(covariance, dof, trials)
    ways = [errors[:, :count].reshape(-1, *groups)]
    if refit is not None and not np.array_equal(refit, np.eye(len(refit))):
        ways.append((errors @ refit.T)[:, :count].reshape(-1, *groups))
    grown: float | FloatArray = bonus
    if len(covariance) > count:
        grown = np.clip(bonus + errors[:, -1], 0.0, most_bonus)
    worst = int(np.linalg.norm(located, axis=1).argmax())
    rows = slice(worst * groups[1], (worst + 1) * groups[1])
    value, u = position_and_uncertainty(located[worst], covariance[rows, rows])
    shape = located / value if value > 0.0 else _unlike_zero(groups, covariance)
    _check(required, u, -math.inf, width + most_bonus)

    # Of each drawn error, the values that it would leave inside: between two roots.
    inside = [_inside(shape, way, 0.5 * (width + grown)) for way in ways]

    def probability(y: float) -> float:
        return float(np.mean(np.any([(low <= y) & (y <= high) for low, high in inside], axis=0)))

    found = probability(value)
    limit = width + bonus
    guard = _guard_band(lambda g: probability(limit - g), limit, required)
    largest = 20.0 * math.sqrt(max(float(np.linalg.eigvalsh(covariance)[-1]), 0.0))
    band = _rejection_band(lambda g: probability(limit + g), largest, required)
    # A zone that is narrow against u contains no place with much probability: this proves nothing.
    band = max(band, _quantile(dof, required) * u)
    verdict = _verdict(found, required, u, beyond=not value < limit + band)
    return Conformity(
        name, value, u, -math.inf, limit, guard, band, found, required, verdict, dof, bonus=bonus
    )


def _inside(
    shape: FloatArray, errors: FloatArray, radius: float | FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Ends of the values y with |y shape + error| at most the radius in all groups, (t,) each."""
    square = np.sum(shape**2, axis=1)
    half = np.einsum("gm,tgm->tg", shape, errors)
    rest = np.sum(errors**2, axis=2) - np.asarray(radius)[..., None] ** 2
    root = half**2 - square * rest
    still = square == 0.0
    never = np.where(still, rest > 0.0, root < 0.0)
    size = np.sqrt(np.maximum(root, 0.0))
    divisor = np.where(still, 1.0, square)
    low = np.where(never, np.inf, np.where(still, -np.inf, (-half - size) / divisor))
    high = np.where(never, -np.inf, np.where(still, np.inf, (-half + size) / divisor))
    return low.max(axis=1), high.min(axis=1)


def _unlike_zero(groups: tuple[int, ...], covariance: FloatArray) -> FloatArray:
    """A shape of distances for places that are all at their nominal ones."""
    shape = np.zeros(groups)
    first = np.linalg.eigh(covariance[: groups[1], : groups[1]])[1][:, -1]
    shape[0] = 0.5 * first
    return shape


def form_conformity(name: str, form: FormResult, tolerance: float, required: float) -> Conformity:
    """Decide about the form of a feature.

    Parameters
    ----------
    name : str
    form : FormResult
    tolerance : float
        [mm]
    required : float

    Returns
    -------
    Conformity

    Notes
    -----
    The errors of the points enlarge a range, so that the form of the surface is compared, not the
    measured range. Conformity is proven where the form is at most the tolerance with the required
    probability, nonconformity where it is larger with this probability. Both speak of the touched
    points: a form between them is not seen, so that a surface may not conform as a whole.

    >>> form = FormResult(measured=0.004, value=0.0038, quantiles=np.linspace(0.0025, 0.0045, 201),
    ...                   noise=0.001, most_noise=0.0015)
    >>> form_conformity("roundness", form, 0.003, 0.95).verdict.value
    'cannot be decided'
    """
    _check(required, form.u, -math.inf, tolerance)
    found = form.probability_of(tolerance)
    guard = max(form.at_most(required) - form.value, 0.0)
    reject = max(form.value - form.at_most(1.0 - required), form.most_noise, guard)
    return Conformity(
        name, form.value, form.u, -math.inf, tolerance, guard if guard < tolerance else math.nan,
        reject, found, required, _verdict(found, required, form.u), of_touched_points=True,
    )  # fmt: skip


def _check(required: float, u: float, lower: float, upper: float) -> None:
    checked(required, "the probability for a decision", PROBABILITY, inputs=("probability",))
    if not 0.5 < required < 1.0:
        raise PretravelError(
            f"the probability for a decision is {required:g}; it must lie between 0.5 and 1",
            inputs=("probability",),
        )
    if not lower < upper or (math.isinf(lower) and not upper > 0.0):
        raise PretravelError(
            f"the tolerance from {lower:g} to {upper:g} mm is empty", inputs=("tolerance",)
        )
    checked(u, "the uncertainty of the quantity", UNCERTAINTY)


def _verdict(
    probability: float, required: float, u: float, *, beyond: bool = True
) -> ConformityVerdict:
    """`beyond`: the value is outside by the rejection band. If a tolerance is narrower than its
    bands, conformity is improbable for values inside, too: these are not decided.
    """
    if u == 0.0:  # nothing is known about the errors
        return ConformityVerdict.UNDECIDED
    if probability >= required:
        return ConformityVerdict.CONFORMS
    if beyond and probability <= 1.0 - required:
        return ConformityVerdict.DOES_NOT_CONFORM
    return ConformityVerdict.UNDECIDED


def _guard_band(probability: Callable[[float], float], largest: float, required: float) -> float:
    """The smallest distance from a limit at which conformity is proven; nan if there is none."""
    if probability(largest) < required:
        return math.nan
    low, high = 0.0, largest
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if probability(middle) >= required else (middle, high)
    return high


def _rejection_band(
    probability: Callable[[float], float], largest: float, required: float
) -> float:
    """The smallest distance beyond a limit at which nonconformity is proven."""
    return _guard_band(lambda g: 1.0 - probability(g), largest, required)
