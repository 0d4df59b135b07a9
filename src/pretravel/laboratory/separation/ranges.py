"""Do the variances of a separation differ from direction to direction by more than chance?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepDesign,
    MultiStepReadings,
    multi_step_design,
    normal_matrix,
    weighted_residuals,
)
from pretravel.laboratory.separation.noise import TAILS
from pretravel.laboratory.separation.variances import likelihood_information, noise_of_readings

CHANCE = 0.05
"""Probability of a range by chance below which the variances are said to differ."""
_TRIALS = 2000
_BLOCK = 200


@dataclass(frozen=True)
class RangeOfVariances:
    """Largest less smallest variance of the directions of machine or probe.

    Attributes
    ----------
    value : float
        From sums of squared residuals, which have no bias. [mm²]
    by_chance : float
        What equal variances exceed in 5 of 100 tests. [mm²]
    probability : float
        Of such a range or a larger one, if all variances were equal.
    """

    value: float
    by_chance: float
    probability: float

    @property
    def differs(self) -> bool:
        """Whether the variances differ by more than chance."""
        return self.probability < CHANCE


def ranges_of_variances(
    readings: MultiStepReadings,
    *,
    trials: int = _TRIALS,
    rng: np.random.Generator | int | None = 1,
) -> tuple[RangeOfVariances, RangeOfVariances]:
    """The ranges of the variances of machine and probe, against those of equal variances.

    Parameters
    ----------
    readings : MultiStepReadings
        Without gross errors.
    trials : int
        Simulated tests of the same design, in which all pairs have the mean variance. Their noise
        has the tails that the readings show.
    rng : numpy.random.Generator or int, optional

    Returns
    -------
    two RangeOfVariances
        Of the machine, of the probe.

    References
    ----------
    Nafi and Mayer 2011, section V: ranges of 1.42 and 1.19 µm², without a test.

    >>> i, j = np.divmod(np.arange(144), 12)
    >>> noise = 1e-3 * np.random.default_rng(3).normal(size=144)
    >>> machine, probe = ranges_of_variances(MultiStepReadings(i, j, noise), trials=200)
    >>> machine.differs, probe.differs
    (False, False)
    """
    generator = np.random.default_rng(rng)
    design = multi_step_design(readings)
    carried = _carried(design)
    own = (
        carried @ weighted_residuals(design, readings.errors, np.ones(len(readings)))[:, None] ** 2
    )
    level = float(np.mean(design.incidence @ own[:, 0]))
    tails = noise_of_readings(design, readings.errors).of_tails
    ranges = []
    for start in range(0, trials, _BLOCK):
        count = min(_BLOCK, trials - start)
        noise = _noise(generator, generator.choice(TAILS, count, p=tails), len(readings))
        found = carried @ _residuals(design, noise) ** 2
        scale = level / np.mean(design.incidence @ found, axis=0)
        ranges.append(_ranges(design, found * scale))
    simulated = np.concatenate(ranges, axis=1)
    observed = _ranges(design, own)[:, 0]
    machine, probe = (
        RangeOfVariances(
            float(value),
            float(np.quantile(chance, 1.0 - CHANCE)),
            float((1 + np.sum(chance >= value)) / (1 + len(chance))),
        )
        for value, chance in zip(observed, simulated, strict=True)
    )
    return machine, probe


def _noise(generator: np.random.Generator, tails: FloatArray, count: int) -> FloatArray:
    """Noise of one scale with each of these tails, (n, trials)."""
    columns = [
        generator.standard_normal(count) if tail == 0.0 else generator.standard_t(1.0 / tail, count)
        for tail in tails
    ]
    return np.stack(columns, axis=1)


def _residuals(design: MultiStepDesign, noise: FloatArray) -> FloatArray:
    columns = design.columns
    matrix = normal_matrix(design, np.ones(len(noise)))
    return np.asarray(noise - columns @ np.linalg.solve(matrix, columns.T @ noise))


def _carried(design: MultiStepDesign) -> FloatArray:
    """Variances of all directions by squared residuals, (m + p, n)."""
    matrix = 2.0 * likelihood_information(design, np.ones(len(design.row))).matrix
    inverse = np.linalg.pinv(matrix, rcond=1e-9, hermitian=True)
    return np.asarray(inverse @ design.incidence.T)


def _ranges(design: MultiStepDesign, variances: FloatArray) -> FloatArray:
    """Of machine and probe, (2, trials)."""
    return np.stack(
        [np.ptp(variances[: design.split], axis=0), np.ptp(variances[design.split :], axis=0)]
    )
