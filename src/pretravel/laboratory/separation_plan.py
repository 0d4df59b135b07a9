"""How many orientations and repeats a separation needs for a wanted uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray, IntArray
from pretravel.errors import PretravelError
from pretravel.laboratory.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation_variances import direction_variance_uncertainty

MOST_DIRECTIONS = 72
MOST_REPEATS = 50


@dataclass(frozen=True)
class SeparationPlan:
    """A multi-step test.

    Attributes
    ----------
    directions : int
        Equally spaced, for machine and probe alike.
    steps : tuple of int
        Orientations of the probe, in steps of 360° / directions. In orientation s machine
        direction i is touched with probe direction i - s.
    repeats : int
        Of every reading.
    u_error : float
        Standard uncertainty of each systematic error about their mean, for the variance
        assumed. [mm]
    u_variance : float
        Relative standard uncertainty of each direction's variance, the share between machine
        and probe held; infinite where too little is left over.
    """

    directions: int
    steps: tuple[int, ...]
    repeats: int
    u_error: float
    u_variance: float

    @property
    def readings(self) -> int:
        """Touches in all."""
        return self.directions * len(self.steps) * self.repeats

    def pairs(self) -> tuple[IntArray, IntArray]:
        """Machine and probe index (from 1) of every reading, repeats in a row."""
        return turned_pairs(self.directions, self.steps, self.repeats)


def turned_pairs(
    directions: int, steps: tuple[int, ...], repeats: int = 1
) -> tuple[IntArray, IntArray]:
    """Machine and probe index (from 1) of every reading, orientation by orientation.

    >>> [index.tolist() for index in turned_pairs(3, (0, 1))]
    [[1, 2, 3, 1, 2, 3], [1, 2, 3, 3, 1, 2]]
    """
    machine = np.tile(np.arange(directions), len(steps))
    probe = (machine - np.repeat(steps, directions)) % directions
    return np.repeat(machine + 1, repeats), np.repeat(probe + 1, repeats)


def _spectrum(directions: int, steps: tuple[int, ...]) -> FloatArray:
    frequency = np.arange(1, directions)
    angles = 2.0 * np.pi * np.outer(frequency, steps) / directions
    return np.asarray(np.abs(np.exp(1j * angles).sum(axis=1)))


def error_factor(directions: int, steps: tuple[int, ...]) -> float:
    """U of a machine (or probe) error about the mean over all, for readings of unit variance.

    Turned orientations make the normal matrix circulant: at each frequency the machine's and
    the probe's errors are coupled by the Fourier transform of the steps. Infinite where
    the readings fall apart.

    >>> round(error_factor(24, tuple(range(24))) * 24**0.5, 3)  # complete: root of 23 / 24
    0.979
    """
    count = float(len(steps))
    left = count**2 - _spectrum(directions, steps) ** 2
    if np.any(left < 1e-9 * count**2):
        return math.inf
    return math.sqrt(float(np.sum(count / left)) / directions)


def variance_factor(directions: int, steps: tuple[int, ...], repeats: int) -> float:
    """Relative u of a direction's variance about the mean, variances alike.

    Both sorts of direction have variance one half; relative to it.
    """
    machine, probe = turned_pairs(directions, steps)
    readings = MultiStepReadings(machine, probe, np.zeros(len(machine)))
    return direction_variance_uncertainty(readings, repeats)


def best_steps(directions: int, orientations: int) -> tuple[int, ...]:
    """Orientations, one after the other where they help systematic errors most.

    >>> best_steps(8, 3)[:2]
    (0, 1)
    """
    chosen: tuple[int, ...] = (0, 1)
    while len(chosen) < orientations:
        rest = [s for s in range(directions) if s not in chosen]
        factors = [error_factor(directions, (*chosen, s)) for s in rest]
        chosen = (*chosen, rest[int(np.argmin(factors))])
    return tuple(sorted(chosen[:orientations]))


def plan_separation(
    directions: int,
    variance: float,
    *,
    u_error: float | None = None,
    u_variance: float | None = None,
) -> SeparationPlan:
    """The test with the fewest touches that reaches the wanted uncertainties.

    Parameters
    ----------
    directions : int
        Of machine and probe.
    variance : float
        Expected of a single touch, machine and probe together. [mm²]
    u_error : float, optional
        Wanted for systematic errors. [mm]
    u_variance : float, optional
        Wanted for each direction's variance, relative to it.

    Returns
    -------
    SeparationPlan

    Raises
    ------
    PretravelError
        Nothing is wanted, or nothing reaches it.

    Notes
    -----
    Turning the probe costs more than touching again, so of tests with the same number of
    touches the one with fewer orientations is taken. But repeats in one orientation say
    less of variances than readings in another, where more partners take part.

    >>> plan = plan_separation(12, 1e-6, u_error=0.4e-3)
    >>> len(plan.steps) * plan.repeats >= 6
    True
    """
    if not 3 <= directions <= MOST_DIRECTIONS:
        raise PretravelError(f"{directions} directions: between 3 and {MOST_DIRECTIONS}")
    if not 0.0 < variance < math.inf:
        raise PretravelError(
            f"the expected variance is {variance * 1e6:g} µm²; it must be positive"
        )
    if u_error is None and u_variance is None:
        raise PretravelError("say what is wanted: u of the errors, of the variances, or both")
    for name, wanted in (("u of the errors", u_error), ("u of the variances", u_variance)):
        if wanted is not None and not wanted > 0.0:
            raise PretravelError(f"the wanted {name} is {wanted:g}; it must be positive")
    deviation = math.sqrt(variance)
    best: SeparationPlan | None = None
    everything = tuple(range(directions))
    nearest = (
        error_factor(directions, everything) * deviation / math.sqrt(MOST_REPEATS),
        variance_factor(directions, everything, MOST_REPEATS),
    )
    possible = (u_error is None or nearest[0] <= u_error) and (
        u_variance is None or nearest[1] <= u_variance
    )
    for orientations in range(2, directions + 1) if possible else ():
        steps = best_steps(directions, orientations)
        factor = error_factor(directions, steps) * deviation
        needed = 1
        if u_error is not None:
            needed = max(math.ceil((factor / u_error) ** 2 - 1e-9), 1)
        while needed <= MOST_REPEATS:
            if best is not None and orientations * needed * directions >= best.readings:
                break
            of_variance = variance_factor(directions, steps, needed)
            plan = SeparationPlan(
                directions, steps, needed, factor / math.sqrt(needed), of_variance
            )
            if u_variance is None or of_variance <= u_variance:
                best = plan
                break
            # Each repeat adds degrees of freedom about in proportion.
            ratio = (of_variance / u_variance) ** 2 if math.isfinite(of_variance) else 2.0
            needed = max(needed + 1, min(math.floor(0.8 * needed * ratio), 2 * needed))
    if best is None:
        raise PretravelError(
            f"no test with up to {directions} orientations and {MOST_REPEATS} repeats reaches "
            f"this; the nearest has u = {nearest[0] * 1e3:.3g} µm of errors and "
            f"{100.0 * nearest[1]:.0f} % of variances"
        )
    return best
