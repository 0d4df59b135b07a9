"""How the errors of points move a feature: those of each point, and those that points share."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr, stdtrit

from pretravel.base import FloatArray, IntArray, PretravelError
from pretravel.drawing.features.extreme_association import CIRCUMSCRIBED, INSCRIBED, TANGENT
from pretravel.drawing.features.form_of_part import (
    NO_FORM,
    Family,
    FormOfPart,
    form_at_places,
    form_of_part,
)
from pretravel.measurement import FIXED_SCATTER, Association, Points, places_of
from pretravel.uncertainty import COVERAGE_FACTOR, EXPANDED_COVERAGE

OWN = "repeatability of the touches"
UNKNOWN_CORRELATION = "points, correlation not given"
STEP_OF_COORDINATES = "step of the coordinates"
FORM_OF_PART = "form of the part"
ONE_SIDED = "noise at extreme points"
PLACES_ON_DATUMS = "places of the touches on tilted datums"
MACHINE = "machine"
MAP = "map"
_SAME_DIRECTION = np.radians(1.0)
_CELLS = 128  # of one degree and more, from -1 to 1
_DOFS = (0.5, 1e4)  # of Student's t: fewer are a bound, more are normal


@dataclass(frozen=True, eq=False)
class FeatureErrors:
    """The errors of a feature's points along the outward normals of the feature.

    Attributes
    ----------
    association : Association
    own : (n,) float
        Standard uncertainty of each point by errors of its own; where it is not stated which
        errors are common, by all errors. [mm]
    shared : mapping of str to (m, n) float
        Factors of the errors that points have in common, by cause. [mm]
    fixed : (n,) float
        Errors that the points of one direction have in common. [mm]
    direction : (n,) int
        Number of the direction of each point, the same in all features.
    correlation_known : bool
        Whether the points state which errors are common.
    machine : float
        Standard uncertainty of a length by other causes than the probe. [mm]
    form : FormOfPart
        What the residuals show beyond the errors, or cannot show.
    one_sided : (n,) float or None
        Movement of all points together by the noise that a feature of extreme points takes for its
        surface, one standard uncertainty. [mm]
    rounded : (n,) int or None
        Where the step of coordinates is the only known error: points that can be rounded alike
        have the same number.
    """

    association: Association
    own: FloatArray
    shared: dict[str, FloatArray]
    fixed: FloatArray
    direction: IntArray
    correlation_known: bool
    machine: float = 0.0
    form: FormOfPart = NO_FORM
    one_sided: FloatArray | None = None
    rounded: IntArray | None = None

    @property
    def excess(self) -> float:
        """Standard deviation of the residuals beyond that of the errors: form of the part. [mm]"""
        return self.form.excess

    @property
    def map_is_stated(self) -> bool:
        """Whether the uncertainty of the map is in the points; that of a prediction is not."""
        if not self.correlation_known:
            return self.rounded is None and bool(self.own.any())
        return MAP in self.shared

    def parts(self, rows: FloatArray) -> dict[str, FloatArray]:
        """Covariance of linear functions of the parameters, source by source.

        Parameters
        ----------
        rows : (m, k) float
            Of lengths or angles, by the parameters of the feature.

        Returns
        -------
        dict of str to (m, m) float
            As `covariance_by_source`.
        """
        return covariance_by_source([(self, rows)])

    def dof(self, row: FloatArray, u: float) -> float:
        """Degrees of freedom of the standard uncertainty of a linear function of the parameters.

        Parameters
        ----------
        row : (k,) float
            Of a length or an angle, by the parameters of the feature.
        u : float
            Its standard uncertainty, with that of the machine. [mm or rad]

        Returns
        -------
        float
            As `dof_of_features`.
        """
        return dof_of_features([(self, row[None])], u)

    def sums_by_direction(self, weights: FloatArray) -> FloatArray:
        """Weighted sums of the fixed errors of each direction, (m, directions), from (m, n)."""
        return _sums(weights * self.fixed, self.direction)

    def noise_trials(self, generator: np.random.Generator, trials: int) -> FloatArray:
        """Residuals that the errors of the points alone produce, drawn, (trials, n). [mm]

        Errors whose correlation is not stated are drawn as independent.
        """
        count = len(self.own)
        moved = self.own * generator.standard_normal((trials, count))
        for factors in self.shared.values():
            moved += generator.standard_normal((trials, len(factors))) @ factors
        if self.fixed.any():
            names, of_point = np.unique(self.direction, return_inverse=True)
            moved += generator.standard_normal((trials, len(names)))[:, of_point] * self.fixed
        return self.association.residual_change(moved)

    def opposed_trials(
        self, signs: FloatArray, generator: np.random.Generator, trials: int
    ) -> FloatArray:
        """Errors that move the points at both ends of a zone apart, drawn, (trials, n). [mm]

        No correlation that the points' uncertainties allow makes its width more uncertain.
        """
        names, of_point = np.unique(_alike([self]), return_inverse=True)
        return np.asarray(
            generator.standard_normal((trials, len(names)))[:, of_point] * self.own * signs
        )


def feature_errors(
    points: Points,
    association: Association,
    *,
    u_machine: float = 0.0,
    families: Sequence[Family] = (),
) -> FeatureErrors:
    """The errors of points as errors of a feature through them.

    Parameters
    ----------
    points : Points
    association : Association
        Through these points.
    u_machine : float
        Standard uncertainty of a length by other causes than the probe. [mm]
    families : sequence of Family
        Smooth shapes that the form of the part may have.
    """
    along = np.sum(association.outward * points.normals, axis=1)
    covariance, outward = points.covariance, association.outward
    u = np.sqrt(np.maximum(np.einsum("ni,nij,nj->n", outward, covariance, outward), 0.0))
    stated = dict(points.shared or {})
    fixed = stated.pop(FIXED_SCATTER, np.zeros(len(points))) * along
    shared: dict[str, list[FloatArray]] = {}
    for name, moved in stated.items():
        cause = name.rstrip("0123456789 ") or name
        shared.setdefault(cause, []).append(moved * along)
    factors = {cause: np.array(rows) for cause, rows in shared.items()}
    common = sum((np.sum(rows**2, axis=0) for rows in factors.values()), fixed**2)
    own = np.sqrt(np.maximum(u**2 - common, 0.0))
    known = points.shared is not None
    errors = FeatureErrors(
        association, own, factors, fixed, _directions(points.normals), known, machine=u_machine
    )
    if not points.state_uncertainty and _shows(association, points.step):
        by_step = np.full(len(points), points.step / math.sqrt(12.0))
        errors = replace(errors, own=by_step, rounded=_rounded_alike(association, points.step))
    if association.dof < 1 and not points.state_uncertainty:
        return errors
    return replace(errors, form=_form(errors, points, families))


def _form(errors: FeatureErrors, points: Points, families: Sequence[Family]) -> FormOfPart:
    """What the residuals show of the form, each place once."""
    association = errors.association
    residuals, jacobian = association.residuals, association.jacobian
    place = places_of(points.positions, association.outward)
    touches = np.bincount(place)
    if len(touches) == len(place) or not jacobian.shape[1]:
        return form_of_part(residuals, jacobian, _expected_squares(errors), families)
    first = np.unique(place, return_index=True)[1]

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(place, values) / touches)

    of_places = replace(
        errors,
        own=np.sqrt(mean(errors.own**2) / touches),
        shared={cause: np.array([mean(row) for row in f]) for cause, f in errors.shared.items()},
        fixed=mean(errors.fixed),
        direction=errors.direction[first],
    )
    expected = _expected_squares(of_places, jacobian[first])
    return form_at_places(mean(residuals), jacobian[first], expected, families, place)


def errors_of_extreme(
    errors: FeatureErrors, found: Association, moved: FloatArray | float, *, stated: bool
) -> FeatureErrors:
    """The errors of the same points as errors of an extreme feature.

    It is that of the touched places, so that the form of the part is no error of it. Noise moves
    an inscribed, circumscribed or tangent feature to one side, from that of least squares: by the
    share of the residuals that is noise, which follows from the errors and the form that all
    residuals show.

    Parameters
    ----------
    errors : FeatureErrors
        Of the feature of least squares.
    found : Association
        The extreme feature through the same points.
    moved : float or (n,) float
        How far the surface at each point lies outside that of least squares, the mean of its face.
        [mm]
    stated : bool
        Whether the points state their uncertainty. If not, their scatter about the feature of least
        squares stands for it, and any share between none and all is alike.
    """
    one_sided = None
    if found.criterion in _TO_ONE_SIDE:
        dof = max(errors.association.dof, 1)
        noise = math.sqrt(max(_expected_squares(errors), 0.0) / dof)
        share = errors.form.share_of_noise(noise) if stated else 1.0 / math.sqrt(3.0)
        one_sided = np.full(len(errors.own), share * moved)
    form = NO_FORM if stated else errors.form
    return replace(errors, association=found, form=form, one_sided=one_sided)


_TO_ONE_SIDE = (INSCRIBED, CIRCUMSCRIBED, TANGENT)


def _directions(normals: FloatArray) -> IntArray:
    """Number of the direction of each normal: those in one cell of about a degree have the same."""
    # The offset keeps the usual directions (0, ±1, halves) away from the borders of the cells.
    cells = np.floor(normals / _SAME_DIRECTION + 0.37).astype(np.int64) + _CELLS // 2
    return np.asarray((cells[:, 0] * _CELLS + cells[:, 1]) * _CELLS + cells[:, 2])


def _sums(values: FloatArray, direction: IntArray) -> FloatArray:
    """Sums over the points of each direction, (m, directions), from (m, n)."""
    of_point = np.unique(direction, return_inverse=True)[1].reshape(-1)
    return np.array([np.bincount(of_point, row) for row in values])


def _shows(association: Association, step: float) -> bool:
    """Whether coordinates along the normals differ, so that their step is not that of targets."""
    along = np.argmax(np.abs(association.outward), axis=1)
    measured = [association.points[along == axis, axis] for axis in range(3)]
    return step > 0.0 and any(len(each) and np.ptp(each) > 0.5 * step for each in measured)


def _rounded_alike(association: Association, step: float) -> IntArray:
    """Numbers of points; those with the same number may have been rounded by the same amount.

    At a round place this is so for the points of a bore at 0, 90, 180 and 270 degrees. Residuals
    that differ show where it is not.
    """
    symmetric = _directions(np.sort(np.abs(association.outward), axis=1))
    left = np.rint(association.residuals / (0.5 * step)).astype(np.int64)
    pairs = np.stack([symmetric, left], axis=1)
    return np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1)


def _alike(features: Sequence[FeatureErrors]) -> IntArray:
    """Numbers of the points of features; any correlation is possible among those with the same."""
    groups = [np.zeros(len(f.own), int) if f.rounded is None else f.rounded for f in features]
    return np.concatenate(groups)


_Terms = Sequence[tuple[FeatureErrors, FloatArray]]


def covariance_by_source(terms: _Terms) -> dict[str, FloatArray]:
    """Covariance of linear functions of the parameters of one or several features, by source.

    Parameters
    ----------
    terms : sequence of (FeatureErrors, (m, k) float)
        Each feature with the change of the m functions by its parameters. The points are those of
        one compensation.

    Returns
    -------
    dict of str to (m, m) float
        Where it is not stated which errors are common: the largest covariance that any
        correlation of the points' errors can produce; of a step, of the points that can be rounded
        alike.

    Raises
    ------
    PretravelError
        Features whose points do not have the same causes of common errors.

    Notes
    -----
    Of one sum Σ w e with standard uncertainties u, this largest variance is (Σ |w| u)². Of
    several, with vectors w, Σ |w| u · Σ w w' u/|w| is not below the covariance in any
    direction (Cauchy-Schwarz inequality).
    """
    weights = np.hstack([rows @ each.association.response for each, rows in terms])
    return covariance_by_weights([errors for errors, _ in terms], weights)


def covariance_by_weights(
    features: Sequence[FeatureErrors], weights: FloatArray
) -> dict[str, FloatArray]:
    """Covariance of weighted sums of the movements of points along their normals, by source.

    Parameters
    ----------
    features : sequence of FeatureErrors
        One after the other; their points are those of one compensation.
    weights : (m, n) float
        Of all points of these features.

    Returns
    -------
    dict of str to (m, m) float
        As `covariance_by_source`.
    """
    known = check_same_causes(features)

    def of_points(name: str) -> FloatArray:
        return np.concatenate([getattr(each, name) for each in features])

    own, found = of_points("own"), {}
    if known:
        found[OWN] = (weights * own**2) @ weights.T
        for cause in features[0].shared:
            moved = weights @ np.hstack([each.shared[cause] for each in features]).T
            found[cause] = moved @ moved.T
        fixed = of_points("fixed")
        if fixed.any():
            sums = _sums(weights * fixed, np.concatenate([each.direction for each in features]))
            found[FIXED_SCATTER] = sums @ sums.T
    else:
        length, alike = np.linalg.norm(weights, axis=0), _alike(features)
        share = own / np.maximum(length, 1e-300)
        most = _sums((length * own)[None], alike)[0, np.unique(alike, return_inverse=True)[1]]
        cause = UNKNOWN_CORRELATION if features[0].rounded is None else STEP_OF_COORDINATES
        found[cause] = (weights * share * most) @ weights.T
    form, start = np.zeros((len(weights), len(weights))), 0
    one_sided = np.zeros_like(form)
    for each in features:
        mine = slice(start, start + len(each.own))
        form, start = form + each.form.covariance(weights[:, mine]), mine.stop
        if each.one_sided is not None:
            moved = weights[:, mine] @ each.one_sided
            one_sided += np.outer(moved, moved)
    if form.any():
        found[FORM_OF_PART] = form
    if one_sided.any():
        found[ONE_SIDED] = one_sided
    return {cause: np.asarray(part) for cause, part in found.items()}


def check_same_causes(features: Sequence[FeatureErrors]) -> bool:
    """Whether the points of features state their common errors; all do, or none.

    Raises
    ------
    PretravelError
        Features whose points do not have the same causes of common errors.
    """
    causes = [{cause: len(rows) for cause, rows in each.shared.items()} for each in features]
    known = [each.correlation_known for each in features]
    if any(each != causes[0] for each in causes) or len(set(known)) > 1:
        raise PretravelError(
            "the points of these features have different lists of shared errors, so the "
            "correlation between the features is unknown; compensate the touches of both together"
        )
    return known[0]


def noise_of_features(
    features: Sequence[FeatureErrors], trials: int, generator: np.random.Generator
) -> list[FloatArray]:
    """Movements of the points of features along their normals by their errors, drawn.

    Parameters
    ----------
    features : sequence of FeatureErrors
        Errors that they have in common are the same in one trial. Errors whose correlation is not
        stated are drawn as independent.
    trials : int
    generator : Generator

    Returns
    -------
    list of (trials, n) float
        [mm]
    """
    check_same_causes(features)
    drawn = [
        each.own * generator.standard_normal((trials, len(each.own)))
        + each.form.drawn_by_size(trials, generator, len(each.own))
        for each in features
    ]
    for own, each in zip(drawn, features, strict=True):
        if each.one_sided is not None:
            own += generator.standard_normal((trials, 1)) * each.one_sided
    for cause, rows in features[0].shared.items():
        amounts = generator.standard_normal((trials, len(rows)))
        for own, each in zip(drawn, features, strict=True):
            own += amounts @ each.shared[cause]
    names, of_point = np.unique(
        np.concatenate([each.direction for each in features]), return_inverse=True
    )
    amounts = generator.standard_normal((trials, len(names)))
    start = 0
    for own, each in zip(drawn, features, strict=True):
        mine = of_point[start : start + len(each.own)]
        if each.fixed.any():
            own += amounts[:, mine] * each.fixed
        start += len(mine)
    return drawn


def dof_of_features(terms: _Terms, u: float) -> float:
    """Degrees of freedom of the standard uncertainty of a function of one or two features.

    They are those with which Student's t gives the expanded uncertainty of an error that is normal
    for each size of the form of the part, with the probabilities of these sizes. Few residuals of
    roughness often look like a smooth shape that moves the feature less. So the expanded
    uncertainty covers as much if the part is rough alone, unless the residuals exclude that.

    Parameters
    ----------
    terms : sequence of (FeatureErrors, (1, k) float)
        As of `covariance_by_source`.
    u : float
        The standard uncertainty, with that of the machine. [mm or rad]

    Returns
    -------
    float
        Infinite where the form of the part does not matter.
    """
    found = _dof_of_form(terms, u, rough=False)
    if not any(errors.form.may_be_rough for errors, _ in terms):
        return found
    return min(found, _dof_of_form(terms, u, rough=True))


def _dof_of_form(terms: _Terms, u: float, *, rough: bool) -> float:
    """By the probabilities of all forms; rough: of roughness alone in parts that may be so."""
    variance, probability, by_form = np.zeros(1), np.ones(1), 0.0
    for errors, rows in terms:
        weights = rows @ errors.association.response
        by_form += float(errors.form.covariance(weights)[0, 0])
        alone = rough and errors.form.may_be_rough
        variances, likely = errors.form.variances(weights[0], rough=alone)
        variance = np.add.outer(variance, variances).ravel()
        probability = np.multiply.outer(probability, likely).ravel()
    return dof_of_mixture(np.sqrt(max(u**2 - by_form, 0.0) + variance), probability, u)


def _expected_squares(errors: FeatureErrors, jacobian: FloatArray | None = None) -> float:
    """Sum of the squared residuals that the errors of the points produce, on average. [mm²]"""
    # The errors of points after the fit: their covariance, projected off the feature.
    basis = np.linalg.qr(errors.association.jacobian if jacobian is None else jacobian)[0]
    expected = float(np.sum(errors.own**2 * (1.0 - np.sum(basis**2, axis=1))))
    for factors in errors.shared.values():
        left = factors - (factors @ basis) @ basis.T
        expected += float(np.sum(left**2))
    return expected + float(
        np.sum(errors.fixed**2) - np.sum(errors.sums_by_direction(basis.T) ** 2)
    )


def dof_of_mixture(deviations: FloatArray, weights: FloatArray, u: float) -> float:
    """Degrees of freedom with which Student's t gives the U of a mixture of normal errors.

    Parameters
    ----------
    deviations : (s,) float
        Standard deviations of the normal errors.
    weights : (s,) float
        Their probabilities.
    u : float
        The standard uncertainty that is stated.

    Returns
    -------
    float
        Infinite where 2 u is enough.

    >>> dof_of_mixture(np.array([1.0]), np.array([1.0]), 1.0)
    inf
    >>> round(dof_of_mixture(np.array([1.0, 3.0]), np.array([0.9, 0.1]), 1.0), 1)  # k = 2.64
    5.1
    """
    outside = 1.0 - EXPANDED_COVERAGE

    def beyond(limit: float) -> float:
        scaled = np.maximum(deviations, 1e-300)
        return float(np.sum(weights * 2.0 * ndtr(-limit / scaled)) - outside)

    most = float(np.max(deviations))
    if u <= 0.0 or beyond(COVERAGE_FACTOR * u * (1.0 + 1e-3)) <= 0.0:
        return math.inf
    factor = _zero_between(beyond, 0.0, 4.0 * most) / u

    def short(dof: float) -> float:
        return float(stdtrit(dof, 1.0 - 0.5 * outside)) - factor

    fewest, most_dof = _DOFS
    if short(fewest) <= 0.0:
        return fewest
    return math.inf if short(most_dof) >= 0.0 else _zero_between(short, fewest, most_dof)


def _zero_between(falling: Callable[[float], float], low: float, high: float) -> float:
    """Where a falling function is zero, between an argument before and one behind it."""
    above, below = falling(low), falling(high)
    while True:
        # A secant, or the middle where it does not halve the bracket.
        width, secant = high - low, low + (high - low) * above / (above - below)
        for place in (secant, 0.5 * (low + high)):
            if not low < place < high:
                return min(max(place, low), high)
            value = falling(place)
            if value >= 0.0:
                low, above = place, value
            else:
                high, below = place, value
            if high - low <= 0.5 * width:
                break
