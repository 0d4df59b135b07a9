"""The law of propagation of uncertainty of the GUM, for comparisons."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray, frozen
from pretravel.base.errors import PretravelError
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.gum import (
    COVERAGE,
    EXPANDED_COVERAGE,
    Budget,
    Component,
    coverage_factor,
)

Model = Callable[[FloatArray], npt.ArrayLike]
"""From (n, m) rows of inputs to (n,) or (n, k) outputs, for all rows at once."""


@dataclass(frozen=True, eq=False)
class Propagated:
    """Result of a model, with the uncertainty that follows from its inputs.

    Attributes
    ----------
    value : (k,) float
    covariance : (k, k) float
    jacobian : (k, m) float
    effective_dof : (k,) float
        Infinite also where inputs are correlated: the formula of Welch and Satterthwaite does not
        apply then.
    budgets : tuple of Budget
        One for each output; where inputs are correlated it contains their variances only.
    """

    value: FloatArray
    covariance: FloatArray
    jacobian: FloatArray
    effective_dof: FloatArray
    budgets: tuple[Budget, ...]

    @property
    def standard_uncertainty(self) -> FloatArray:
        """Of each output, (k,)."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0.0)))

    def expanded(self, probability: float = EXPANDED_COVERAGE) -> FloatArray:
        """Expanded uncertainty of each output, (k,)."""
        factors = [coverage_factor(float(dof), probability) for dof in self.effective_dof]
        return np.asarray(factors * self.standard_uncertainty)

    def interval(self, probability: float = COVERAGE) -> FloatArray:
        """Coverage interval of each output, (k, 2)."""
        half = self.expanded(probability)
        return np.stack([self.value - half, self.value + half], axis=1)


def slopes(model: Model, estimates: FloatArray, steps: FloatArray) -> FloatArray:
    """Jacobian of a vectorised model by central differences, in one call of the model.

    Parameters
    ----------
    model : callable
    estimates : (m,) float
    steps : (m,) float
        The slope of an input with a zero step is zero.

    Returns
    -------
    (k, m) float

    >>> slopes(lambda x: x[:, 0] * x[:, 1], np.array([2.0, 3.0]), np.full(2, 1e-4)).round(9)
    array([[3., 2.]])
    """
    count = len(estimates)
    moves = np.diag(steps)
    rows = np.concatenate([estimates + moves, estimates - moves])
    values = np.asarray(model(rows), dtype=np.float64).reshape(2 * count, -1)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = (values[:count] - values[count:]) / (2.0 * steps[:, None])
    return np.asarray(np.where(steps[:, None] == 0.0, 0.0, found).T)


def propagate(
    model: Model,
    estimates: npt.ArrayLike,
    uncertainty: npt.ArrayLike | Covariance,
    *,
    names: Sequence[str] | None = None,
    dof: npt.ArrayLike | None = None,
    evaluations: Sequence[str] | None = None,
) -> Propagated:
    """Apply the law of propagation of uncertainty, J S J', to a vectorised model.

    Parameters
    ----------
    model : callable
        (n, m) inputs to (n,) or (n, k) outputs.
    estimates : (m,) float
    uncertainty : (m,) float or Covariance
        Standard uncertainties of independent inputs, or the covariance of the inputs.
    names : m strings, optional
        Of the inputs, for the budget.
    dof : (m,) float, optional
        Degrees of freedom of the inputs' uncertainties; infinite when not given.
    evaluations : m of "A" or "B", optional
        When not given: A where degrees of freedom are finite, else B.

    Raises
    ------
    PretravelError
        Shapes that differ, a negative uncertainty, a model without finite values.

    References
    ----------
    JCGM 100, equations 13 and G.2b; JCGM 102, section 6 for several outputs.

    >>> area = propagate(lambda x: x[:, 0] * x[:, 1], [2.0, 3.0], [0.01, 0.02])
    >>> area.value.tolist(), area.standard_uncertainty.round(4).tolist()
    ([6.0], [0.05])
    """
    x = np.asarray(estimates, dtype=np.float64)
    covariance = _covariance_of(x, uncertainty)
    u = np.sqrt(np.maximum(covariance.variances, 0.0))
    count = len(x)
    degrees = np.full(count, np.inf) if dof is None else np.asarray(dof, dtype=np.float64)
    value = np.asarray(model(x[None, :]), dtype=np.float64).reshape(-1)
    # A hundredth of u: small against curvature, large against rounding.
    floor = 1e-8 * np.maximum(np.abs(x), 1e-8)
    steps = np.where(u > 0.0, np.maximum(1e-2 * u, floor), 0.0)
    jacobian = slopes(model, x, steps)
    if not (np.all(np.isfinite(value)) and np.all(np.isfinite(jacobian))):
        raise PretravelError("the model has no finite value at (or near) the estimates")
    if evaluations is None:
        evaluations = ["A" if math.isfinite(nu) else "B" for nu in degrees]
    if names is None:
        names = [f"input {i + 1}" for i in range(count)]
    budgets = tuple(
        Budget(
            tuple(
                Component(names[i], evaluations[i], float(u[i]), float(row[i]), float(degrees[i]))
                for i in range(count)
            )
        )
        for row in jacobian
    )
    total = covariance.carried(jacobian)
    effective = [b.effective_dof if _independent(covariance) else math.inf for b in budgets]
    return Propagated(
        value=frozen(value),
        covariance=frozen(total),
        jacobian=frozen(jacobian),
        effective_dof=frozen(effective),
        budgets=budgets,
    )


def _covariance_of(estimates: FloatArray, uncertainty: npt.ArrayLike | Covariance) -> Covariance:
    """The covariance of the inputs, checked against the estimates."""
    if estimates.ndim != 1 or not len(estimates):
        raise PretravelError(f"estimates have the shape {estimates.shape}; expected (m,), m > 0")
    if isinstance(uncertainty, Covariance):
        covariance = uncertainty
    else:
        u = np.asarray(uncertainty, dtype=np.float64)
        if u.ndim != 1:
            raise PretravelError(
                f"uncertainties have the shape {u.shape}; expected standard uncertainties (m,), or "
                "a Covariance for correlated inputs"
            )
        if np.any(u < 0.0):
            raise PretravelError("a standard uncertainty is negative")
        covariance = Covariance.independent(u**2)
    if len(covariance) != len(estimates):
        raise PretravelError(
            f"{len(estimates)} estimates with {len(covariance)} uncertainties: expected one for "
            "each estimate"
        )
    return covariance


def _independent(covariance: Covariance) -> bool:
    """Whether no input is correlated with another one."""
    matrix = covariance.matrix
    return not np.any(matrix - np.diag(np.diag(matrix)))
