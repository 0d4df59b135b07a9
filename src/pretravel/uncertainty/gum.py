"""Uncertainty according to the GUM: the law of propagation, and budgets as data."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray, frozen
from pretravel.base.errors import PretravelError
from pretravel.uncertainty.covariance import Covariance

COVERAGE = 0.95
"""Coverage probability of intervals that is used where none is given."""
COVERAGE_FACTOR = 2.0
"""k of an expanded uncertainty U = k · u whose degrees of freedom are infinite or not known."""
EXPANDED_COVERAGE = math.erf(COVERAGE_FACTOR / math.sqrt(2.0))
"""Coverage probability of an expanded uncertainty: 95.45 %, that of k = 2 where errors are normally
distributed. Fewer degrees of freedom need a larger k (GUM, Table G.2)."""


@dataclass(frozen=True)
class Component:
    """One source of uncertainty in a budget.

    Attributes
    ----------
    name : str
    evaluation : str
        ``A``, by statistics, or ``B``, by other means.
    standard_uncertainty : float
        Of the source, in its own unit.
    sensitivity : float
        Change of the result per unit of the source.
    dof : float
        Degrees of freedom; infinite where the uncertainty is taken as exact.
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
                f"{self.name}: the standard uncertainty is {self.standard_uncertainty:g}; it must "
                "be finite and not negative"
            )
        if not self.dof > 0.0:
            raise PretravelError(f"{self.name}: degrees of freedom must be positive")

    @property
    def contribution(self) -> float:
        """|sensitivity| times standard uncertainty, in the unit of the result."""
        return abs(self.sensitivity) * self.standard_uncertainty


@dataclass(frozen=True)
class Budget:
    """Independent sources of uncertainty of one result, and their combination.

    Parameters
    ----------
    components : tuple of Component
    result : str
        The quantity that it is the budget of, in words.

    References
    ----------
    JCGM 100 (GUM), equations 10 and G.2b.

    >>> budget = Budget((Component("scale", "B", 0.3), Component("repeats", "A", 0.4, dof=9)))
    >>> budget.combined, round(budget.effective_dof, 1), round(budget.coverage_factor(), 2)
    (0.5, 22.0, 2.13)
    """

    components: tuple[Component, ...]
    result: str = ""

    @property
    def combined(self) -> float:
        """Combined standard uncertainty."""
        return math.sqrt(math.fsum(c.contribution**2 for c in self.components))

    @property
    def effective_dof(self) -> float:
        """Degrees of freedom after Welch and Satterthwaite; infinite where all sources' are."""
        spread = math.fsum(
            c.contribution**4 / c.dof for c in self.components if math.isfinite(c.dof)
        )
        return self.combined**4 / spread if spread > 0.0 else math.inf

    def coverage_factor(
        self, probability: float = EXPANDED_COVERAGE, *, whole_dof: bool = True
    ) -> float:
        """Coverage factor k of the expanded uncertainty, from Student's t.

        Parameters
        ----------
        probability : float
        whole_dof : bool
            Whether degrees of freedom are rounded down, as in the GUM (G.4.1).
        """
        return coverage_factor(self.effective_dof, probability, whole_dof=whole_dof)

    def expanded(self, probability: float = EXPANDED_COVERAGE) -> float:
        """Coverage factor times combined standard uncertainty."""
        return self.coverage_factor(probability) * self.combined

    def rows(self) -> list[dict[str, float | str]]:
        """The budget as a table: one row for each source, the largest share first."""
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


def coverage_factor(
    dof: float, probability: float = EXPANDED_COVERAGE, *, whole_dof: bool = True
) -> float:
    """Half-width of a coverage interval, in standard uncertainties.

    Parameters
    ----------
    dof : float
        Degrees of freedom; infinite for a normal distribution.
    probability : float
    whole_dof : bool
        Whether the degrees of freedom are rounded down first (GUM G.4.1).

    >>> round(coverage_factor(math.inf), 3), round(coverage_factor(16.7, 0.99), 2)
    (2.0, 2.92)
    """
    from scipy.special import ndtri, stdtrit

    if not 0.0 < probability < 1.0:
        raise PretravelError(
            f"the coverage probability is {probability:g}; it must lie between 0 and 1"
        )
    if math.isinf(dof):
        return float(ndtri(0.5 + 0.5 * probability))
    used = max(math.floor(dof + 1e-9), 1) if whole_dof else dof
    return float(stdtrit(used, 0.5 + 0.5 * probability))


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

    Returns
    -------
    Propagated

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
