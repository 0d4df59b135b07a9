"""How the errors of points move a feature: those of each point, and those that points share."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.measurement.association import Association
from pretravel.measurement.points import FIXED_SCATTER, Points

OWN = "repeatability of the touches"
UNKNOWN_CORRELATION = "points, correlation not stated"
FORM_OF_PART = "form of the part"
MACHINE = "machine"
MAP = "map"
_RARE = 0.01  # probability that noise alone is taken for form
_SAME_DIRECTION = np.radians(1.0)
_TRIALS = 4000
_MOST_DRAWS = 4_000_000
_SEED = 1


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
        Index of the direction of each point.
    correlation_known : bool
        Whether the points state which errors are common.
    excess : float
        Standard deviation of the residuals beyond that of the errors: form of the part. [mm]
    machine : float
        Standard uncertainty of a length by other causes than the probe. [mm]
    """

    association: Association
    own: FloatArray
    shared: dict[str, FloatArray]
    fixed: FloatArray
    direction: IntArray
    correlation_known: bool
    excess: float = 0.0
    machine: float = 0.0

    @property
    def map_is_stated(self) -> bool:
        """Whether the uncertainty of the map is in the points; that of a prediction is not."""
        return not self.correlation_known or MAP in self.shared

    def parts(self, rows: FloatArray) -> dict[str, FloatArray]:
        """Covariance of linear functions of the parameters, source by source.

        Parameters
        ----------
        rows : (m, k) float
            Of lengths or angles, by the parameters of the feature.

        Returns
        -------
        dict of str to (m, m) float
            Where it is not stated which errors are common: the largest covariance that any
            correlation of the points' errors can produce.

        Notes
        -----
        Of one sum Σ w e with standard uncertainties u, this largest variance is (Σ |w| u)². Of
        several, with vectors w, Σ |w| u · Σ w w' u/|w| is not below the covariance in any
        direction (Cauchy-Schwarz inequality).
        """
        weights = rows @ self.association.response
        found = {}
        if self.correlation_known:
            found[OWN] = (weights * self.own**2) @ weights.T
            for cause, factors in self.shared.items():
                found[cause] = (weights @ factors.T) @ (weights @ factors.T).T
            if self.fixed.any():
                sums = self.sums_by_direction(weights)
                found[FIXED_SCATTER] = sums @ sums.T
        else:
            length = np.linalg.norm(weights, axis=0)
            share = self.own / np.maximum(length, 1e-300)
            found[UNKNOWN_CORRELATION] = (length @ self.own) * (weights * share) @ weights.T
        if self.excess > 0.0:
            found[FORM_OF_PART] = self.excess**2 * weights @ weights.T
        return {cause: np.asarray(part) for cause, part in found.items()}

    def sums_by_direction(self, weights: FloatArray) -> FloatArray:
        """Weighted sums of the fixed errors of each direction, (m, directions), from (m, n)."""
        return np.array([np.bincount(self.direction, row * self.fixed) for row in weights])

    def noise_trials(self, generator: np.random.Generator) -> FloatArray:
        """Residuals that the errors of the points alone produce, drawn, (trials, n). [mm]

        Errors whose correlation is not stated are drawn as independent, which gives the largest
        residuals.
        """
        count = len(self.own)
        trials = max(min(_TRIALS, _MOST_DRAWS // count), 200)
        moved = self.own * generator.standard_normal((trials, count))
        for factors in self.shared.values():
            moved += generator.standard_normal((trials, len(factors))) @ factors
        if self.fixed.any():
            drawn = generator.standard_normal((trials, int(self.direction.max()) + 1))
            moved += drawn[:, self.direction] * self.fixed
        return self.association.residual_change(moved)


def feature_errors(
    points: Points, association: Association, *, u_machine: float = 0.0
) -> FeatureErrors:
    """The errors of points as errors of a feature through them.

    Parameters
    ----------
    points : Points
    association : Association
        Through these points.
    u_machine : float
        Standard uncertainty of a length by other causes than the probe. [mm]

    Returns
    -------
    FeatureErrors
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
    return replace(errors, excess=_excess(errors))


def _directions(normals: FloatArray) -> IntArray:
    """Index of the direction of each normal: those in one cell of about a degree have the same."""
    # The offset keeps the usual directions (0, ±1, halves) away from the borders of the cells.
    cells = np.floor(normals / _SAME_DIRECTION + 0.37)
    return np.asarray(np.unique(cells, axis=0, return_inverse=True)[1]).reshape(-1)


def _excess(errors: FeatureErrors) -> float:
    """Standard deviation of residuals that the errors of the points do not explain. [mm]

    Zero where the errors alone exceed the observed sum of squares in more than one of a hundred
    cases (chi-squared distribution).
    """
    association = errors.association
    if association.dof < 1:
        return 0.0
    # The errors of points after the fit: their covariance, projected off the feature.
    basis = np.linalg.qr(association.jacobian)[0]
    expected = float(np.sum(errors.own**2 * (1.0 - np.sum(basis**2, axis=1))))
    for factors in errors.shared.values():
        left = factors - (factors @ basis) @ basis.T
        expected += float(np.sum(left**2))
    expected += float(np.sum(errors.fixed**2) - np.sum(errors.sums_by_direction(basis.T) ** 2))
    observed = float(np.sum(association.residuals**2))
    limit = expected * float(chdtri(association.dof, _RARE)) / association.dof
    if observed <= limit:
        return 0.0
    return float(np.sqrt((observed - expected) / association.dof))


@dataclass(frozen=True)
class FormResult:
    """The range of the residuals of a feature, with its uncertainty by the errors of the points.

    Attributes
    ----------
    value : float
        Largest less smallest residual. [mm]
    u : float
        Standard uncertainty. [mm]
    bias : float
        By which the errors of the points enlarge this range on average. [mm]
    noise : float
        Mean range that the errors of the points produce on a perfect feature. [mm]
    most_noise : float
        Range that they exceed in 5 of 100 cases. [mm]
    """

    value: float
    u: float
    bias: float
    noise: float
    most_noise: float


def form_result(errors: FeatureErrors) -> FormResult:
    """The form of a feature, by trials of the points' errors.

    Parameters
    ----------
    errors : FeatureErrors

    Returns
    -------
    FormResult

    Notes
    -----
    The uncertainty is the scatter of the range when the errors of the points are added to the
    observed residuals once more (JCGM 101). The difference of the mean is the bias.
    """
    residuals = errors.association.residuals
    noise = errors.noise_trials(np.random.default_rng(_SEED))
    alone, with_noise = np.ptp(noise, axis=1), np.ptp(residuals + noise, axis=1)
    value = float(np.ptp(residuals))
    return FormResult(
        value=value,
        u=float(np.hypot(with_noise.std(), errors.machine)),
        bias=float(with_noise.mean() - value),
        noise=float(alone.mean()),
        most_noise=float(np.quantile(alone, 0.95)),
    )
