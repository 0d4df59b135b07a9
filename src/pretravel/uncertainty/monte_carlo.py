"""Uncertainty by Monte Carlo after JCGM 101: adaptive, and a judge of the GUM's result."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from pretravel.arrays import BoolArray, FloatArray, frozen
from pretravel.errors import PretravelError
from pretravel.uncertainty.gum import COVERAGE, Model, Propagated

Draw = Callable[[np.random.Generator, int], FloatArray]
"""From a generator and a number of trials n to (n, m) rows of inputs."""

_MOST_TRIALS = 10_000_000
_KEPT = 5_000_000  # values of one output beyond which memory, not patience, is the limit

Shape = Literal["normal", "uniform", "triangular", "arcsine", "t"]


@dataclass(frozen=True)
class Input:
    """What is known of one input: an estimate and a distribution about it.

    Parameters
    ----------
    estimate : float
    standard_uncertainty : float
    shape : str
        normal, uniform, triangular, arcsine (U-shaped), or t, scaled and shifted, with
        `dof` degrees of freedom, for means of repeats.
    dof : float
        Of shape t; there `standard_uncertainty` is s / root n, as evaluated (the
        distribution's own is wider, JCGM 101, 6.4.9).

    >>> Input(1.0, 0.1, "uniform").draw(np.random.default_rng(0), 3).round(3).tolist()
    [1.047, 0.92, 0.841]
    """

    estimate: float
    standard_uncertainty: float
    shape: Shape = "normal"
    dof: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 <= self.standard_uncertainty < math.inf or not math.isfinite(self.estimate):
            raise PretravelError(
                f"an input has a finite estimate and an uncertainty that is not negative, got "
                f"{self.estimate:g} and {self.standard_uncertainty:g}"
            )
        if not self.dof > 0.0:
            raise PretravelError(f"degrees of freedom must be positive, got {self.dof:g}")
        if self.shape == "t" and math.isinf(self.dof):
            raise PretravelError("shape t needs its degrees of freedom (dof)")

    def draw(self, generator: np.random.Generator, count: int) -> FloatArray:
        """So many values, (count,)."""
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
    """Draws of inputs that know nothing of each other."""
    return lambda generator, count: np.stack([i.draw(generator, count) for i in inputs], axis=1)


def joint_normal(estimates: npt.ArrayLike, covariance: npt.ArrayLike) -> Draw:
    """Draws of inputs with a joint normal distribution.

    Parameters
    ----------
    estimates : (m,) float
    covariance : (m, m) float
        May be singular.
    """
    mean = np.asarray(estimates, dtype=np.float64)
    given = np.asarray(covariance, dtype=np.float64)
    values, vectors = np.linalg.eigh(given)
    if not np.allclose(given, given.T) or values[0] < -1e-9 * abs(values[-1]):
        raise PretravelError("this is not a covariance: symmetric, no negative variance")
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return lambda generator, count: np.asarray(
        mean + generator.standard_normal((count, len(mean))) @ root.T
    )


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Distribution of a model's outputs, by trials.

    Attributes
    ----------
    value : (k,) float
        Means.
    covariance : (k, k) float
    symmetric_interval : (k, 2) float
        Probabilistically symmetric: as much below as above.
    shortest_interval : (k, 2) float
    trials : int
    tolerance : (k,) float
        Numerical tolerance that was asked for.
    settled : (k,) bool
        Whether mean, u and both ends are known to that tolerance.
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
    """Half a unit in the last of so many significant digits of u.

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
    """Propagate distributions, with as many trials as the wanted digits need.

    Parameters
    ----------
    model : callable
        (n, m) inputs to (n,) or (n, k) outputs.
    draw : callable
        See `independent` and `joint_normal`.
    probability : float
    digits : int
        Significant digits of u that are to be right.
    share : float
        Of that tolerance: one fifth is asked for where a GUM result is to be judged.
    most_trials : int
        Where to stop; `settled` then says what was not reached. Two blocks are made in any
        case.
    seed : int or None
        None draws others each time.

    Returns
    -------
    MonteCarlo

    Raises
    ------
    PretravelError
        A model that gives values that are not finite.

    References
    ----------
    JCGM 101, 7.9: blocks of at least 10⁴ trials until twice the standard error of mean,
    u and both ends of the interval is below the tolerance.

    >>> two = independent([Input(0.0, 1.0), Input(0.0, 1.0)])
    >>> result = monte_carlo(lambda x: x[:, 0] + x[:, 1], two)
    >>> bool(abs(result.standard_uncertainty[0] - 2**0.5) < 0.05)
    True
    """
    if not 0.0 < probability < 1.0:
        raise PretravelError(f"a coverage probability lies between 0 and 1, got {probability:g}")
    if not 1 <= digits <= 4:
        raise PretravelError(f"between 1 and 4 significant digits make sense, got {digits}")
    generator = np.random.default_rng(seed)
    if 200.0 / (1.0 - probability) > _MOST_TRIALS:
        raise PretravelError(
            f"the ends of a {probability:g} interval need more than {_MOST_TRIALS} trials"
        )
    block = max(math.ceil(100.0 / (1.0 - probability)), 10_000)
    blocks: list[FloatArray] = []
    figures: list[FloatArray] = []
    settled = np.zeros(0, dtype=bool)
    tolerance = np.zeros(0)
    while True:
        values = np.asarray(model(draw(generator, block)), dtype=np.float64).reshape(block, -1)
        if not np.all(np.isfinite(values)):
            bad = int(np.sum(~np.isfinite(values).all(axis=1)))
            raise PretravelError(
                f"{bad} of {block} trials gave no finite value: the inputs' distributions reach "
                "where the model does not hold"
            )
        blocks.append(values)
        ordered = np.sort(values, axis=0)
        figures.append(
            np.stack(
                [
                    values.mean(axis=0),
                    values.std(axis=0, ddof=1),
                    *symmetric_interval(ordered, probability).T,
                    *shortest_interval(ordered, probability).T,
                ]
            )
        )
        done = len(blocks) * block
        if len(blocks) >= 2:
            pooled = np.concatenate(blocks).std(axis=0, ddof=1)
            tolerance = share * numerical_tolerance(pooled, digits)
            errors = np.std(figures, axis=0, ddof=1) / math.sqrt(len(figures))
            settled = np.all(2.0 * errors <= tolerance, axis=0)
            full = done + block > min(most_trials, _MOST_TRIALS) or done * values.shape[1] > _KEPT
            if settled.all() or full:
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


@dataclass(frozen=True, eq=False)
class Validation:
    """Whether the GUM's interval stands up to the Monte Carlo one.

    Attributes
    ----------
    difference : (k, 2) float
        Of lower and of upper ends.
    tolerance : (k,) float
    valid : (k,) bool
    """

    difference: FloatArray
    tolerance: FloatArray
    valid: BoolArray

    @property
    def message(self) -> str:
        """One sentence for people."""
        if self.valid.all():
            return "the GUM's intervals agree with Monte Carlo to the digits asked for"
        worst = int(np.argmax(self.difference.max(axis=1) / np.maximum(self.tolerance, 1e-300)))
        return (
            f"the GUM's interval is {self.difference[worst].max():.2g} off where "
            f"{self.tolerance[worst]:.2g} was allowed ({int((~self.valid).sum())} of "
            f"{len(self.valid)} results): the model curves too much, or is too far from normal; "
            "use the Monte Carlo interval"
        )


def validate(gum: Propagated, trials: MonteCarlo, digits: int = 2) -> Validation:
    """Compare the ends of the GUM's intervals with those of Monte Carlo.

    Parameters
    ----------
    gum : Propagated
    trials : MonteCarlo
        Made with a fifth of the tolerance (`share=0.2`), to be a judge.
    digits : int
        Significant digits of u that are to agree.

    Returns
    -------
    Validation

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
