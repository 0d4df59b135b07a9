"""The largest of some distances from nominal places, which noise alone enlarges."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray
from pretravel.uncertainty import COVERAGE_FACTOR, EXPANDED_COVERAGE, coverage_factor

_TRIALS, _MOST_DRAWS = 8_000, 400_000
_SEED = 1
_FAR = 5.0  # standard uncertainties: no error exceeds it
_STEPS = 60  # of a bisection


@dataclass(frozen=True)
class LargestDistance:
    """Twice the largest distance of some places from their nominal ones.

    Attributes
    ----------
    value : float
        As measured, less what errors add to it; not below zero. [mm]
    ends : pair of float
        Where it lies with 95 %; from zero where only an upper bound is known. [mm]
    u : float
        Far from zero that along the distance; near it, half of the larger distance of an end from
        the value. [mm]
    dof : float
        Degrees of freedom of `u`; near zero they are in the ends.
    """

    value: float
    ends: tuple[float, float]
    u: float
    dof: float = math.inf


def largest_distance(
    located: FloatArray, covariance: FloatArray, dof: float, left: FloatArray | None = None
) -> LargestDistance:
    """Twice the largest distance of places whose distances have errors.

    Parameters
    ----------
    located : (g, m) float
        Measured distances from the nominal places, by direction. [mm]
    covariance : (g m, g m) float
        Of all. [mm²]
    dof : float
        Degrees of freedom of the covariance.
    left : (g m, g m) float, optional
        What of errors is left by a fit of free motions.

    Notes
    -----
    A distance is never negative, and errors across it make it longer: of a true zero, errors of u
    in two directions are measured as 1.25 u on average. The value is that of which as often more
    as less would be measured. The interval of a place holds the true
    distances that would be measured as here with no small probability (2.5 % on each side, or 5 %
    where it begins at zero), and from zero at least what errors alone give with 95 %; the largest
    of several lies between the largest of their ends, of which the lower ones share the 2.5 %.

    >>> far = largest_distance(np.array([[0.03, 0.04]]), 1e-6 * np.eye(2), math.inf)
    >>> round(far.value, 4), round(far.u, 4)
    (0.1, 0.002)
    >>> near = largest_distance(np.array([[0.0006, 0.0008]]), 1e-6 * np.eye(2), math.inf)
    >>> near.ends[0], near.value < 0.002
    (0.0, True)
    """
    count = located.size
    keep = np.eye(count) if left is None else left
    if not np.any(covariance):
        size = _size(located)
        return LargestDistance(size, (size, size), 0.0)
    rest = np.asarray(keep @ covariance @ keep.T)
    far = _far_from_zero(located, rest, dof)
    if far is not None:
        return far
    trials = max(min(_TRIALS, _MOST_DRAWS // len(covariance)), 2000)
    errors = (drawn_errors(covariance, dof, trials) @ keep.T).reshape(-1, *located.shape)
    measured, length = _size(located), 2.0 * np.linalg.norm(located, axis=1)
    # A place that is shorter than the largest by more than the errors says nothing.
    spread = float(np.quantile(np.linalg.norm(errors, axis=2), 0.99))
    near = np.flatnonzero(length >= measured - 4.0 * spread)
    own = [_one_place(located[g], errors[:, g], len(near)) for g in near]
    shape = np.zeros_like(located)
    for g, (value, *_) in zip(near, own, strict=True):
        shape[g] = located[g] * (value / max(float(length[g]), 1e-300))
    value = max(each[0] for each in own)
    if len(near) > 1:
        usual = float(np.median(2.0 * np.linalg.norm(shape + errors, axis=2).max(axis=1)))
        value = measured - usual + _size(shape)
    low, high = max(each[1] for each in own), max(each[2] for each in own)
    value = min(max(value, low), high)
    return LargestDistance(value, (low, high), max(value - low, high - value) / COVERAGE_FACTOR)


def _one_place(located: FloatArray, errors: FloatArray, count: int) -> tuple[float, float, float]:
    """Value and ends of twice the distance of one place of several, (m,), with errors (t, m)."""
    measured = 2.0 * float(np.linalg.norm(located))
    direction = located / max(measured, 1e-300)

    def below(size: float) -> float:
        """Probability that no more than this is measured where it is of this size."""
        return float(np.mean(2.0 * np.linalg.norm(size * direction + errors, axis=1) <= measured))

    noise = 2.0 * np.linalg.norm(errors, axis=1)
    outside = 1.0 - EXPANDED_COVERAGE
    # Of many places errors make one long by chance, so that each end is less probable (Bonferroni).
    side, zero = 1.0 - 0.5 * outside / count, below(0.0)
    most = measured + 2.0 * float(np.quantile(noise, 1.0 - 0.1 * outside))
    digits = 1e-3 * float(np.median(noise))
    value = _crossing(below, 0.5, measured, digits) if zero > 0.5 else 0.0
    low = _crossing(below, side, measured, digits) if zero > side else 0.0
    high = _crossing(below, 0.5 * outside if low > 0.0 else outside, most, digits)
    # Where by chance hardly anything is measured, what errors alone give is the bound: the place
    # is known no better for it.
    return value, low, max(high, float(np.quantile(noise, EXPANDED_COVERAGE)), value)


def _far_from_zero(
    located: FloatArray, covariance: FloatArray, dof: float
) -> LargestDistance | None:
    """Where one place is farther away than all others, and errors across it change nothing."""
    length = np.linalg.norm(located, axis=1)
    worst = int(np.argmax(length))
    others = float(np.delete(length, worst).max(initial=0.0))
    u = math.sqrt(float(np.linalg.eigvalsh(covariance)[-1]))
    if length[worst] - others < _FAR * u or length[worst] < _FAR**2 * u:
        return None
    mine = slice(worst * located.shape[1], (worst + 1) * located.shape[1])
    along = located[worst] / length[worst]
    value, u = 2.0 * float(length[worst]), math.sqrt(float(along @ covariance[mine, mine] @ along))
    expanded = 2.0 * u * coverage_factor(dof, whole_dof=False)
    return LargestDistance(value, (value - expanded, value + expanded), 2.0 * u, dof)


def drawn_errors(covariance: FloatArray, dof: float, trials: int) -> FloatArray:
    """Errors of Student's t with a covariance, (k, k): (trials, k)."""
    sizes, vectors = np.linalg.eigh(covariance)
    generator = np.random.default_rng(_SEED)
    draws = generator.standard_normal((trials, len(covariance)))
    if math.isfinite(dof):
        draws /= np.sqrt(generator.chisquare(dof, (trials, 1)) / dof)
    return np.asarray((draws * np.sqrt(np.maximum(sizes, 0.0))) @ vectors.T)


def _size(places: FloatArray) -> float:
    return 2.0 * float(np.linalg.norm(places, axis=1).max())


def _crossing(
    below: Callable[[float], float], probability: float, most: float, digits: float
) -> float:
    """The size from which `below` is smaller than a probability, to these digits. [mm]"""
    low, high = 0.0, most
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) >= probability else (low, middle)
        if high - low < digits:
            break
    return 0.5 * (low + high)
