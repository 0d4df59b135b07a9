"""Uncertainty after the GUM: propagation by slopes, with a budget as data."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.errors import PretravelError

COVERAGE = 0.95
"""Coverage probability where none is named."""


@dataclass(frozen=True)
class Component:
    """One source of uncertainty in a budget.

    Attributes
    ----------
    name : str
    evaluation : str
        ``A``, from statistics, or ``B``, from other knowledge.
    standard_uncertainty : float
        Of the source, in its own unit.
    sensitivity : float
        How much the result changes per unit of the source.
    dof : float
        Degrees of freedom; infinite where the uncertainty is taken as known.
    """

    name: str
    evaluation: str
    standard_uncertainty: float
    sensitivity: float = 1.0
    dof: float = math.inf

    def __post_init__(self) -> None:
        if self.evaluation not in ("A", "B"):
            raise PretravelError(
                f"{self.name}: an evaluation is of type A or B, not '{self.evaluation}'"
            )
        if not 0.0 <= self.standard_uncertainty < math.inf:
            raise PretravelError(
                f"{self.name}: a standard uncertainty is not negative, "
                f"got {self.standard_uncertainty:g}"
            )
        if not self.dof > 0.0:
            raise PretravelError(f"{self.name}: degrees of freedom must be positive")

    @property
    def contribution(self) -> float:
        """|sensitivity| times standard uncertainty, in the result's unit."""
        return abs(self.sensitivity) * self.standard_uncertainty


@dataclass(frozen=True)
class Budget:
    """Independent sources of uncertainty of one result, and what they come to.

    Parameters
    ----------
    components : tuple of Component

    References
    ----------
    JCGM 100 (GUM), equations 10 and G.2b.

    >>> budget = Budget((Component("scale", "B", 0.3), Component("repeats", "A", 0.4, dof=9)))
    >>> budget.combined, round(budget.effective_dof, 1), round(budget.coverage_factor(), 2)
    (0.5, 22.0, 2.08)
    """

    components: tuple[Component, ...]

    @property
    def combined(self) -> float:
        """Combined standard uncertainty."""
        return math.sqrt(math.fsum(c.contribution**2 for c in self.components))

    @property
    def effective_dof(self) -> float:
        """Welch and Satterthwaite's degrees of freedom; infinite where all are."""
        spread = math.fsum(
            c.contribution**4 / c.dof for c in self.components if math.isfinite(c.dof)
        )
        return self.combined**4 / spread if spread > 0.0 else math.inf

    def coverage_factor(self, probability: float = COVERAGE, *, whole_dof: bool = True) -> float:
        """K of the expanded uncertainty, from Student's t.

        Parameters
        ----------
        probability : float
        whole_dof : bool
            Degrees of freedom rounded down, as the GUM has it (G.4.1).
        """
        return coverage_factor(self.effective_dof, probability, whole_dof=whole_dof)

    def expanded(self, probability: float = COVERAGE) -> float:
        """Coverage factor times combined standard uncertainty."""
        return self.coverage_factor(probability) * self.combined

    def rows(self) -> list[dict[str, float | str]]:
        """The budget as a table: a row for each source, the largest share first."""
        total = self.combined**2
        ordered = sorted(self.components, key=lambda c: -c.contribution)
        return [
            {
                "source": c.name,
                "evaluation": c.evaluation,
                "standard_uncertainty": c.standard_uncertainty,
                "sensitivity": c.sensitivity,
                "contribution": c.contribution,
                "share": c.contribution**2 / total if total > 0.0 else 0.0,
                "dof": c.dof,
            }
            for c in ordered
        ]


def coverage_factor(dof: float, probability: float = COVERAGE, *, whole_dof: bool = True) -> float:
    """Half-width of an interval of that probability, in standard uncertainties.

    Parameters
    ----------
    dof : float
        Degrees of freedom; infinite for a normal distribution.
    probability : float
    whole_dof : bool
        Rounded down first (GUM G.4.1).

    >>> round(coverage_factor(math.inf), 3), round(coverage_factor(16.7, 0.99), 2)
    (1.96, 2.92)
    """
    from scipy.stats import norm, t

    if not 0.0 < probability < 1.0:
        raise PretravelError(f"a coverage probability lies between 0 and 1, got {probability:g}")
    if math.isinf(dof):
        return float(norm.ppf(0.5 + 0.5 * probability))
    used = max(math.floor(dof + 1e-9), 1) if whole_dof else dof
    return float(t.ppf(0.5 + 0.5 * probability, used))


Model = Callable[[FloatArray], npt.ArrayLike]
"""From (n, m) rows of inputs to (n,) or (n, k) outputs, all rows at once."""


@dataclass(frozen=True, eq=False)
class Propagated:
    """Result of a model with the uncertainty that its inputs bring.

    Attributes
    ----------
    value : (k,) float
    covariance : (k, k) float
    jacobian : (k, m) float
    effective_dof : (k,) float
        Infinite also where inputs are correlated: Welch and Satterthwaite say nothing then.
    budgets : tuple of Budget
        One for each output; of correlated inputs each one's own part only.
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

    def expanded(self, probability: float = COVERAGE) -> FloatArray:
        """Expanded uncertainty of each output, (k,)."""
        factors = [coverage_factor(float(dof), probability) for dof in self.effective_dof]
        return np.asarray(factors * self.standard_uncertainty)

    def interval(self, probability: float = COVERAGE) -> FloatArray:
        """Coverage interval of each output, (k, 2)."""
        half = self.expanded(probability)
        return np.stack([self.value - half, self.value + half], axis=1)


def slopes(model: Model, estimates: FloatArray, steps: FloatArray) -> FloatArray:
    """Jacobian of a vectorised model by central differences, all in one call.

    Parameters
    ----------
    model : callable
    estimates : (m,) float
    steps : (m,) float
        Zero steps give zero slopes.

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
    uncertainty: npt.ArrayLike,
    *,
    names: Sequence[str] | None = None,
    dof: npt.ArrayLike | None = None,
    evaluations: Sequence[str] | None = None,
) -> Propagated:
    """The law of propagation of uncertainty, J S J', for any vectorised model.

    Parameters
    ----------
    model : callable
        (n, m) inputs to (n,) or (n, k) outputs.
    estimates : (m,) float
    uncertainty : (m,) standard uncertainties, or (m, m) covariance
    names : m strings, optional
        Of the inputs, for the budget.
    dof : (m,) float, optional
        Degrees of freedom of the inputs' uncertainties; infinite when not given.
    evaluations : m of "A" or "B", optional
        B when not given; A where degrees of freedom are finite.

    Returns
    -------
    Propagated

    Raises
    ------
    PretravelError
        Shapes that do not fit, a covariance that is none, a model that gives nan.

    References
    ----------
    JCGM 100, equations 13 and G.2b; JCGM 102, section 6 for several outputs.

    >>> area = propagate(lambda x: x[:, 0] * x[:, 1], [2.0, 3.0], [0.01, 0.02])
    >>> area.value.tolist(), area.standard_uncertainty.round(4).tolist()
    ([6.0], [0.05])
    """
    x = np.asarray(estimates, dtype=np.float64)
    given = np.asarray(uncertainty, dtype=np.float64)
    count = len(x)
    if x.ndim != 1 or given.shape not in ((count,), (count, count)):
        raise PretravelError(
            f"{x.shape} estimates with uncertainties of shape {given.shape}: expected (m,) with "
            "(m,) or (m, m)"
        )
    if count == 0:
        raise PretravelError("a model without inputs has no uncertainty to propagate")
    if given.ndim == 1 and np.any(given < 0.0):
        raise PretravelError("a standard uncertainty is not negative")
    covariance = np.diag(given**2) if given.ndim == 1 else given
    if not np.allclose(covariance, covariance.T, rtol=1e-9, atol=0.0):
        raise PretravelError("this is not a covariance: it is not symmetric")
    u = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    finite = bool(np.all(np.isfinite(covariance)))
    lowest = np.linalg.eigvalsh(covariance)[0] if finite else -math.inf
    if lowest < -1e-9 * max(float(np.max(u**2)), 1e-300):
        raise PretravelError("this is not a covariance: symmetric, finite, no negative variance")
    degrees = np.full(count, np.inf) if dof is None else np.asarray(dof, dtype=np.float64)
    value = np.asarray(model(x[None, :]), dtype=np.float64).reshape(-1)
    # A hundredth of u: small against what curves, large against rounding.
    floor = 1e-8 * np.maximum(np.abs(x), 1e-8)
    steps = np.where(u > 0.0, np.maximum(1e-2 * u, floor), 0.0)
    jacobian = slopes(model, x, steps)
    if not (np.all(np.isfinite(value)) and np.all(np.isfinite(jacobian))):
        raise PretravelError("the model gives no finite value at (or near) the estimates")
    total = jacobian @ covariance @ jacobian.T
    kinds = (
        list(evaluations)
        if evaluations is not None
        else ["A" if math.isfinite(nu) else "B" for nu in degrees]
    )
    labels = list(names) if names is not None else [f"input {i + 1}" for i in range(count)]
    budgets = tuple(
        Budget(
            tuple(
                Component(labels[i], kinds[i], float(u[i]), float(row[i]), float(degrees[i]))
                for i in range(count)
            )
        )
        for row in jacobian
    )
    independent = not np.any(covariance - np.diag(np.diag(covariance)))
    effective = [b.effective_dof if independent else math.inf for b in budgets]
    return Propagated(
        value=frozen(value),
        covariance=frozen(total),
        jacobian=frozen(jacobian),
        effective_dof=frozen(effective),
        budgets=budgets,
    )
