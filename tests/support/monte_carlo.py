"""Uncertainty by the adaptive Monte Carlo method of JCGM 101, and validation of GUM results."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import BoolArray, FloatArray, frozen
from pretravel.base.errors import PretravelError
from pretravel.base.quantities import REAL, check_numbers
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.gum import COVERAGE
from tests.support.propagation import Model, Propagated

Draw = Callable[[np.random.Generator, int], FloatArray]
"""From a generator and a number of trials n to (n, m) rows of inputs."""

_MOST_TRIALS = 10_000_000
_MOST_VALUES = 5_000_000  # of all outputs together: the limit of memory

Shape = Literal["normal", "uniform", "triangular", "arcsine", "t"]


@dataclass(frozen=True)
class Input:
    """One input: an estimate and the distribution about it.

    Parameters
    ----------
    estimate : float
    standard_uncertainty : float
    shape : str
        normal, uniform, triangular, arcsine (U-shaped), or t (scaled and shifted, with
        `dof` degrees of freedom) for means of repeats.
    dof : float
        Degrees of freedom of shape t; there `standard_uncertainty` is s / root n (the
        standard deviation of the distribution is larger, JCGM 101, 6.4.9).

    >>> Input(1.0, 0.1, "uniform").draw(np.random.default_rng(0), 3).round(3).tolist()
    [1.047, 0.92, 0.841]
    """

    estimate: float
    standard_uncertainty: float
    shape: Shape = "normal"
    dof: float = math.inf

    def __post_init__(self) -> None:
        check_numbers(self, estimate=REAL, standard_uncertainty=REAL)
        if not 0.0 <= self.standard_uncertainty < math.inf or not math.isfinite(self.estimate):
            raise PretravelError(
                f"an input has the estimate {self.estimate:g} and the standard uncertainty "
                f"{self.standard_uncertainty:g}; both must be finite, the second not negative"
            )
        if not self.dof > 0.0:
            raise PretravelError(f"degrees of freedom must be positive, not {self.dof:g}")
        if self.shape == "t" and math.isinf(self.dof):
            raise PretravelError("the shape t needs its degrees of freedom")

    def draw(self, generator: np.random.Generator, count: int) -> FloatArray:
        """Draw values, (count,)."""
        if self.shape == "normal":
            unit = generator.standard_normal(count)
        elif self.shape == "uniform":
            unit = math.sqrt(3.0) * generator.uniform(-1.0, 1.0, count)
        elif self.shape == "triangular":
            unit = math.sqrt(6.0) * generator.triangular(-1.0, 0.0, 1.0, count)
        elif self.shape == "arcsine":
            unit = math.sqrt(2.0) * np.sin(generator.uniform(-math.pi, math.pi, count))
        elif self.shape == "t":
            unit = generator.standard_t(self.dof, count)
        else:
            raise PretravelError(
                f"distribution '{self.shape}' is not known; there are normal, uniform, "
                "triangular, arcsine, t"
            )
        return np.asarray(self.estimate + self.standard_uncertainty * unit)


def independent(inputs: Sequence[Input]) -> Draw:
    """Draws of independent inputs."""
    return lambda generator, count: np.stack([i.draw(generator, count) for i in inputs], axis=1)


def joint_normal(estimates: npt.ArrayLike, covariance: Covariance) -> Draw:
    """Draws of inputs with a joint normal distribution.

    Parameters
    ----------
    estimates : (m,) float
    covariance : Covariance
        Of the m inputs.

    >>> draw = joint_normal([1.0, 2.0], Covariance.fully_shared([1.0, 4.0]))
    >>> x = draw(np.random.default_rng(0), 2)
    >>> bool(np.allclose(x[:, 1] - 2.0, 2.0 * (x[:, 0] - 1.0)))
    True
    """
    mean = np.asarray(estimates, dtype=np.float64)
    return lambda generator, count: mean + covariance.errors(generator, count)


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Distribution of the outputs of a model, from trials.

    Attributes
    ----------
    value : (k,) float
        Means.
    covariance : (k, k) float
    symmetric_interval : (k, 2) float
        Probabilistically symmetric: the same probability below as above.
    shortest_interval : (k, 2) float
    trials : int
    tolerance : (k,) float
        Requested numerical tolerance.
    settled : (k,) bool
        Whether mean, u and both ends of the interval reached that tolerance.
    probability : float
    """

    value: FloatArray
    covariance: FloatArray
    symmetric_interval: FloatArray
    shortest_interval: FloatArray
    trials: int
    tolerance: FloatArray
    settled: BoolArray
    probability: float

    @property
    def standard_uncertainty(self) -> FloatArray:
        """Of each output, (k,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def numerical_tolerance(standard_uncertainty: npt.ArrayLike, digits: int = 2) -> FloatArray:
    """Half a unit of the last significant digit of u.

    References
    ----------
    JCGM 101, 7.9.2.

    >>> numerical_tolerance([0.35, 32.0, 0.0], 2).tolist()
    [0.005, 0.5, 0.0]
    """
    u = np.asarray(standard_uncertainty, dtype=np.float64)
    with np.errstate(divide="ignore"):
        # Rounded to the digits first: 0.996 has the two digits 1.0.
        exponent = np.floor(np.log10(np.where(u > 0.0, u, 1.0)) + 1e-12)
        rounded = np.round(u / 10.0**exponent, digits - 1) * 10.0**exponent
        exponent = np.floor(np.log10(np.where(u > 0.0, rounded, 1.0)) + 1e-12)
    return np.asarray(np.where(u > 0.0, 0.5 * 10.0 ** (exponent - (digits - 1)), 0.0))


def symmetric_interval(sorted_values: FloatArray, probability: float = COVERAGE) -> FloatArray:
    """Probabilistically symmetric interval of sorted values, (n, k) to (k, 2) (JCGM 101, 7.7)."""
    count = len(sorted_values)
    inside = round(probability * count)
    low = (count - inside) // 2
    return np.stack([sorted_values[low], sorted_values[min(low + inside, count - 1)]], axis=1)


def shortest_interval(sorted_values: FloatArray, probability: float = COVERAGE) -> FloatArray:
    """Shortest interval of sorted values, (n, k) to (k, 2) (JCGM 101, 5.3.4)."""
    count = len(sorted_values)
    inside = min(round(probability * count), count - 1)
    lengths = sorted_values[inside:] - sorted_values[: count - inside]
    low = np.argmin(lengths, axis=0)
    columns = np.arange(sorted_values.shape[1])
    return np.stack([sorted_values[low, columns], sorted_values[low + inside, columns]], axis=1)


def monte_carlo(
    model: Model,
    draw: Draw,
    *,
    probability: float = COVERAGE,
    digits: int = 2,
    share: float = 1.0,
    most_trials: int = 1_000_000,
    seed: int | None = 1,
) -> MonteCarlo:
    """Propagate distributions with as many trials as the requested digits need.

    Parameters
    ----------
    model : callable
        (n, m) inputs to (n,) or (n, k) outputs.
    draw : callable
        See `independent` and `joint_normal`.
    probability : float
    digits : int
        Number of significant digits of u that must be correct.
    share : float
        Of that tolerance: one fifth is required for the validation of a GUM result.
    most_trials : int
        Limit of the number of trials; `settled` then states which outputs did not reach the
        tolerance. Two blocks are evaluated in any case.
    seed : int or None
        None draws other numbers each time.

    Raises
    ------
    PretravelError
        A model with values that are not finite.

    References
    ----------
    JCGM 101, 7.9: blocks of at least 10⁴ trials until twice the standard error of mean,
    u and both ends of the interval is below the tolerance.

    >>> two = independent([Input(0.0, 1.0), Input(0.0, 1.0)])
    >>> result = monte_carlo(lambda x: x[:, 0] + x[:, 1], two)
    >>> bool(abs(result.standard_uncertainty[0] - 2**0.5) < 0.05)
    True
    """
    block = _block_size(probability, digits)
    generator = np.random.default_rng(seed)
    blocks: list[FloatArray] = []
    figures: list[FloatArray] = []
    while True:
        values = _evaluated(model, draw(generator, block))
        blocks.append(values)
        figures.append(_block_figures(values, probability))
        if len(blocks) < 2:
            continue
        tolerance = share * numerical_tolerance(_pooled(figures, block), digits)
        errors = np.std(figures, axis=0, ddof=1) / math.sqrt(len(figures))
        settled = np.all(2.0 * errors <= tolerance, axis=0)
        done = len(blocks) * block
        full = done + block > min(most_trials, _MOST_TRIALS)
        if settled.all() or full or done * values.shape[1] > _MOST_VALUES:
            break
    everything = np.concatenate(blocks)
    ordered = np.sort(everything, axis=0)
    return MonteCarlo(
        value=frozen(everything.mean(axis=0)),
        covariance=frozen(np.atleast_2d(np.cov(everything, rowvar=False))),
        symmetric_interval=frozen(symmetric_interval(ordered, probability)),
        shortest_interval=frozen(shortest_interval(ordered, probability)),
        trials=len(everything),
        tolerance=frozen(tolerance),
        settled=settled,
        probability=probability,
    )


def _block_size(probability: float, digits: int) -> int:
    """Number of trials of a block (JCGM 101, 7.9.4), at least 100 of them outside the interval."""
    if not 0.0 < probability < 1.0:
        raise PretravelError(
            f"the coverage probability is {probability:g}; it must lie between 0 and 1"
        )
    if not 1 <= digits <= 4:
        raise PretravelError(f"the number of significant digits is {digits}; it must be 1 to 4")
    if 200.0 / (1.0 - probability) > _MOST_TRIALS:
        raise PretravelError(
            f"the ends of an interval of the probability {probability:g} need more than "
            f"{_MOST_TRIALS} trials"
        )
    return max(math.ceil(100.0 / (1.0 - probability)), 10_000)


def _evaluated(model: Model, inputs: FloatArray) -> FloatArray:
    """The outputs of one block, (n, k), all finite."""
    values = np.asarray(model(inputs), dtype=np.float64).reshape(len(inputs), -1)
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        raise PretravelError(
            f"{int(np.sum(~finite))} of {len(inputs)} trials have no finite value: the "
            "distributions of the inputs extend to where the model does not hold"
        )
    return values


def _pooled(figures: list[FloatArray], block: int) -> FloatArray:
    """Standard deviation of the trials of all blocks, (k,), from those of the blocks."""
    means, deviations = np.stack(figures)[:, :2].transpose(1, 0, 2)
    within = (block - 1) * np.sum(deviations**2, axis=0)
    between = block * np.sum((means - means.mean(axis=0)) ** 2, axis=0)
    return np.asarray(np.sqrt((within + between) / (block * len(figures) - 1)))


def _block_figures(values: FloatArray, probability: float) -> FloatArray:
    """Mean, u and the ends of both intervals of one block, (6, k)."""
    ordered = np.sort(values, axis=0)
    return np.stack(
        [
            values.mean(axis=0),
            values.std(axis=0, ddof=1),
            *symmetric_interval(ordered, probability).T,
            *shortest_interval(ordered, probability).T,
        ]
    )


@dataclass(frozen=True, eq=False)
class Validation:
    """Comparison of a GUM interval with the interval from Monte Carlo.

    Attributes
    ----------
    difference : (k, 2) float
        Of the lower and of the upper ends.
    tolerance : (k,) float
    valid : (k,) bool
    """

    difference: FloatArray
    tolerance: FloatArray
    valid: BoolArray

    @property
    def message(self) -> str:
        """The result in one sentence."""
        if self.valid.all():
            return "the GUM's intervals agree with Monte Carlo to the requested digits"
        worst = int(np.argmax(self.difference.max(axis=1) / np.maximum(self.tolerance, 1e-300)))
        return (
            f"the GUM's interval differs by {self.difference[worst].max():.2g} from Monte Carlo; "
            f"the tolerance is {self.tolerance[worst]:.2g} ({int((~self.valid).sum())} of "
            f"{len(self.valid)} results): the model is too nonlinear, or the distribution too far "
            "from normal; use the Monte Carlo interval"
        )


def validate(gum: Propagated, trials: MonteCarlo, digits: int = 2) -> Validation:
    """Compare the ends of the GUM's intervals with those of Monte Carlo.

    Parameters
    ----------
    gum : Propagated
    trials : MonteCarlo
        Made with a fifth of the tolerance (`share=0.2`).
    digits : int
        Number of significant digits of u that must agree.

    References
    ----------
    JCGM 101, 8.1.
    """
    tolerance = numerical_tolerance(gum.standard_uncertainty, digits)
    difference = np.abs(gum.interval(trials.probability) - trials.symmetric_interval)
    return Validation(
        difference=frozen(difference),
        tolerance=frozen(tolerance),
        valid=np.all(difference <= tolerance[:, None], axis=1),
    )
