"""Uncertainty according to the GUM: budgets as data, coverage factors, limits of gross errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pretravel.base import PretravelError

COVERAGE = 0.95
"""Coverage probability of intervals that is used where none is given."""
COVERAGE_FACTOR = 2.0
"""k of an expanded uncertainty U = k · u whose degrees of freedom are infinite or not known."""
EXPANDED_COVERAGE = math.erf(COVERAGE_FACTOR / math.sqrt(2.0))
"""Coverage probability of an expanded uncertainty: 95.45 %, that of k = 2 where errors are normally
distributed. Fewer degrees of freedom need a larger k (GUM, Table G.2)."""

OUTLIER_LEVEL = 0.01
"""Probability that any touch is named although all are good (Bonferroni)."""


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
    whole_dof : bool
        Whether its degrees of freedom are rounded down for k, as in the GUM (G.4.1).

    References
    ----------
    JCGM 100 (GUM), equations 10 and G.2b.

    >>> budget = Budget((Component("scale", "B", 0.3), Component("repeats", "A", 0.4, dof=9)))
    >>> budget.combined, round(budget.effective_dof, 1), round(budget.coverage_factor(), 2)
    (0.5, 22.0, 2.13)
    """

    components: tuple[Component, ...]
    result: str = ""
    whole_dof: bool = True

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
        self, probability: float = EXPANDED_COVERAGE, *, whole_dof: bool | None = None
    ) -> float:
        """Coverage factor k of the expanded uncertainty, from Student's t.

        Parameters
        ----------
        probability : float
        whole_dof : bool, optional
            Whether degrees of freedom are rounded down, as in the GUM (G.4.1); else as the budget
            states.
        """
        whole = self.whole_dof if whole_dof is None else whole_dof
        return coverage_factor(self.effective_dof, probability, whole_dof=whole)

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


def outlier_factor(count: int, dof: float = math.inf) -> float:
    """Limit of errors, in standard deviations.

    Parameters
    ----------
    count : int
        Of the errors that are tested together.
    dof : float
        Degrees of freedom of Student's distribution, that of the errors.

    >>> round(outlier_factor(75), 2)
    4.58
    """
    from scipy.special import ndtri, stdtrit

    level = OUTLIER_LEVEL / (2.0 * count)
    limit = -ndtri(level) if math.isinf(dof) else -stdtrit(dof, level)
    # 1.2 because the scales are themselves estimated from the data.
    return 1.2 * float(limit)


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
    if math.isinf(dof) and probability == EXPANDED_COVERAGE:
        return COVERAGE_FACTOR
    if not 0.0 < probability < 1.0:
        raise PretravelError(
            f"the coverage probability is {probability:g}; it must lie between 0 and 1"
        )
    if whole_dof and dof < _SUMMED:
        return _student(max(math.floor(dof + 1e-9), 1), probability)
    from scipy.special import ndtri, stdtrit

    if math.isinf(dof):
        return float(ndtri(0.5 + 0.5 * probability))
    # As a float: some versions of scipy take no whole number beyond 64 bits.
    used = float(max(math.floor(dof + 1e-9), 1)) if whole_dof else dof
    return float(stdtrit(used, 0.5 + 0.5 * probability))


_SUMMED = 300.0
"""Degrees of freedom up to which t is found from its sum of half as many terms: for one number no
command loads SciPy."""


def _student(dof: int, probability: float) -> float:
    """The t within which Student's distribution with whole degrees of freedom has a probability.

    References
    ----------
    Abramowitz, Stegun, Handbook of Mathematical Functions, 26.7.3 and 26.7.4.
    """
    odd = dof % 2
    ratio = math.lgamma(0.5 * (dof + 1)) - math.lgamma(0.5 * dof)
    slope = 2.0 / math.sqrt(math.pi) * math.exp(ratio)
    angle, before = 0.0, -1.0
    while angle > before:  # from below: the probability bends down over the angle
        cosine = math.cos(angle)
        total = term = (cosine if odd else 1.0) if dof > 1 else 0.0
        for k in range(2 + odd, dof - 1, 2):
            term *= (k - 1.0) / k * cosine**2
            total += term
        found = math.sin(angle) * total
        if odd:
            found = 2.0 / math.pi * (angle + found)
        before = angle
        angle += (probability - found) / (slope * cosine ** (dof - 1))
    return math.sqrt(dof) * math.tan(angle)
