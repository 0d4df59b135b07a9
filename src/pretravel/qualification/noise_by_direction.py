"""Repeatability that depends on the direction of a touch.

Probes with three rods can scatter more where one rod opens alone, and along the axis otherwise than
across it. A few touches of each direction show strong effects of this kind only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray, frozen
from pretravel.base.directions import azimuth_angle, polar_angle
from pretravel.qualification.within_directions import centred_within

UNEVEN_LEVEL = 0.01
"""Probability that even scatter is taken as uneven."""
_PERMUTATIONS = 999
_FEWEST_REPEATED = 8
"""With fewer directions that have repeats, scatter is not distinguished by direction."""
_SHRINKAGE = 1.0
"""Standard deviation of the coefficients before the touches are seen, of ln(variance)."""


@dataclass(frozen=True, eq=False)
class RepeatabilityByDirection:
    """Standard deviation of a touch as a function of its direction.

    Attributes
    ----------
    constant : float
        The same for all directions, pooled; nan without repeats. [mm]
    coefficients : (4,) float
        Of ln(variance) on 1, cos²θ, sin θ cos 3φ and sin θ sin 3φ (polar angle θ, azimuth φ); that
        of the constant alone if the touches show no dependence. [ln(mm²)]
    p_value : float
        Probability of so uneven scatter if it is even; nan with too few repeats.
    uneven : bool
        Whether the touches show a dependence: p below `UNEVEN_LEVEL`.
    dof : float
        Touches less directions.
    """

    constant: float
    coefficients: FloatArray
    p_value: float
    uneven: bool
    dof: float

    def at(self, directions: npt.ArrayLike) -> FloatArray:
        """Standard deviation of a touch in directions, (n, 3) float to (n,). [mm]"""
        functions = scatter_functions(directions)
        if not self.uneven:
            return np.full(len(functions), self.constant)
        return np.asarray(np.exp(0.5 * (functions @ self.coefficients)))


def scatter_functions(directions: npt.ArrayLike) -> FloatArray:
    """Functions that ln(variance) is a sum of: 1, cos²θ, sin θ cos 3φ, sin θ sin 3φ.

    Parameters
    ----------
    directions : (n, 3) float
        Probe frame.

    Returns
    -------
    (n, 4) float

    >>> scatter_functions([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]).round(9).tolist()
    [[1.0, 1.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0]]
    """
    normals = np.atleast_2d(np.asarray(directions, dtype=np.float64))
    theta, phi = polar_angle(normals), azimuth_angle(normals)
    across = np.sin(theta)
    return np.column_stack(
        [
            np.ones(len(normals)),
            np.cos(theta) ** 2,
            across * np.cos(3.0 * phi),
            across * np.sin(3.0 * phi),
        ]
    )


def repeatability_by_direction(
    values: npt.ArrayLike, groups: npt.ArrayLike, directions: npt.ArrayLike
) -> RepeatabilityByDirection:
    """The scatter of repeats, as a function of direction if the touches show that it is one.

    Parameters
    ----------
    values : (n,) float
        [mm]
    groups : (n,) int
        Number of the direction of each touch.
    directions : (n, 3) float
        Contact normals, probe frame.

    Returns
    -------
    RepeatabilityByDirection

    Notes
    -----
    The test exchanges the standard deviations of directions with equally many repeats at random
    (seeded) and compares the part of their variance that the functions explain: it holds its level
    for noise of any distribution, also for heavy tails. The estimate maximises the gamma likelihood
    of the variances with a normal prior of one on the coefficients of ln(variance). Scatter three
    times larger at three rods is found in 29 % of sets with 25 directions and 3 repeats, in 59 %
    with 5 and in 91 % with 10.

    >>> rng = np.random.default_rng(1)
    >>> normals = np.repeat(rng.standard_normal((40, 3)), 4, axis=0)
    >>> normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    >>> noise = 0.001 * np.exp(-2.0 * normals[:, 2] ** 2) * rng.standard_normal(160)
    >>> found = repeatability_by_direction(noise, np.repeat(np.arange(40), 4), normals)
    >>> found.uneven, found.at([[0, 0, 1], [1, 0, 0]]).round(4).tolist()
    (True, [0.0002, 0.0007])
    """
    number = np.unique(np.asarray(groups), return_inverse=True)[1]
    count = np.bincount(number)
    square = np.bincount(number, centred_within(values, number) ** 2)
    first = np.unique(number, return_index=True)[1]
    used = count >= 2
    dof = (count - 1)[used].astype(np.float64)
    total = float(np.sum(dof))
    constant = float(np.sqrt(np.sum(square[used]) / total)) if total > 0.0 else float("nan")
    p_value = float("nan")
    functions = scatter_functions(np.asarray(directions, dtype=np.float64)[first][used])
    variance = square[used] / dof
    if np.count_nonzero(used) >= _FEWEST_REPEATED and constant > 0.0:
        p_value = _exchange_test(np.sqrt(variance), dof, functions)
    uneven = p_value < UNEVEN_LEVEL
    coefficients = np.zeros(4)
    coefficients[0] = 2.0 * np.log(constant) if constant > 0.0 else -np.inf
    if uneven:
        coefficients = _gamma_fit(variance, dof, functions)
    return RepeatabilityByDirection(constant, frozen(coefficients), p_value, bool(uneven), total)


def _exchange_test(deviation: FloatArray, dof: FloatArray, functions: FloatArray) -> float:
    """Probability of so large an explained part when directions exchange their scatter."""
    root = np.sqrt(dof)
    base, _ = np.linalg.qr(root[:, None])
    columns = functions[:, 1:] * root[:, None]
    left, singular, _ = np.linalg.svd(columns - base @ (base.T @ columns), full_matrices=False)
    span = left[:, singular > 1e-6 * np.sqrt(np.sum(dof))]
    if span.shape[1] == 0:
        return float("nan")
    # The mean for each number of repeats is taken off: pairs have another mean than triples.
    level = np.zeros_like(deviation)
    drawn = np.tile(np.arange(len(dof)), (_PERMUTATIONS + 1, 1))
    generator = np.random.default_rng(0)
    for repeats in np.unique(dof):
        alike = np.flatnonzero(dof == repeats)
        level[alike] = np.mean(deviation[alike])
        drawn[1:, alike] = generator.permuted(drawn[1:, alike], axis=1)
    explained = np.sum((((deviation - level)[drawn] * root) @ span) ** 2, axis=1)
    # Sums in another order differ by rounding: the same arrangement counts as as large.
    return float(np.mean(explained >= explained[0] * (1.0 - 1e-9)))


def _gamma_fit(variance: FloatArray, dof: FloatArray, functions: FloatArray) -> FloatArray:
    """Coefficients of ln(variance) of largest gamma likelihood times prior, by Newton steps."""
    mean = float(np.sum(dof * variance) / np.sum(dof))
    ratio = variance / mean
    prior = np.diag([0.0, *[_SHRINKAGE**-2] * 3])
    coefficients = np.zeros(4)
    for _ in range(100):
        relative = ratio * np.exp(-(functions @ coefficients))
        slope = 0.5 * functions.T @ (dof * (relative - 1.0)) - prior @ coefficients
        # The expected curvature: steps are safe, and limited where a variance is far from the fit.
        curvature = 0.5 * (functions.T * dof * np.maximum(relative, 1.0)) @ functions + prior
        step = np.linalg.solve(curvature, slope)
        coefficients = coefficients + step
        if np.max(np.abs(step)) < 1e-9:
            break
    coefficients[0] += np.log(mean)
    return coefficients
