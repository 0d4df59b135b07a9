"""Plan of a multi-step test: orientations and repeats for a required uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import (
    COUNT,
    MICROMETRE,
    UNCERTAINTY,
    VARIANCE,
    FloatArray,
    IntArray,
    PretravelError,
    checked,
)
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.multi_step_touches import FEWEST_TOUCHED, circles_of_setups
from pretravel.laboratory.separation.variances import direction_variance_uncertainty

MOST_DIRECTIONS = 72
MOST_REPEATS = 50


@dataclass(frozen=True)
class SeparationPlan:
    """A multi-step test.

    Attributes
    ----------
    directions : int
        Number of equally spaced directions, the same for machine and probe.
    steps : tuple of int
        Orientations of the probe, in steps of 360° / directions. In orientation s machine
        direction i is touched with probe direction i - s.
    repeats : int
        Of every reading.
    u_error : float
        Standard uncertainty of each systematic error about their mean, for the expected
        variance. [mm]
    u_variance : float
        Relative standard uncertainty of each direction's variance, for a fixed share of machine
        and probe; infinite where too few degrees of freedom are left.
    """

    directions: int
    steps: tuple[int, ...]
    repeats: int
    u_error: float
    u_variance: float

    @property
    def readings(self) -> int:
        """Number of touches."""
        return self.directions * len(self.steps) * self.repeats

    def pairs(self) -> tuple[IntArray, IntArray]:
        """Machine and probe index (from 1) of every reading, with repeats one after another."""
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
    """Magnitude of the Fourier transform of the steps at each frequency but zero."""
    frequency = np.arange(1, directions)
    angles = 2.0 * np.pi * np.outer(frequency, steps) / directions
    return np.asarray(np.abs(np.exp(1j * angles).sum(axis=1)))


def error_factor(directions: int, steps: tuple[int, ...]) -> float:
    """Standard uncertainty of a systematic error about their mean, for readings of unit variance.

    The orientations make the normal matrix circulant: at each frequency the Fourier transform of
    the steps couples the errors of machine and probe. Infinite where the readings form
    groups without a common direction.

    >>> round(error_factor(24, tuple(range(24))) * 24**0.5, 3)  # complete: root of 23 / 24
    0.979
    """
    count = float(len(steps))
    left = count**2 - _spectrum(directions, steps) ** 2
    if np.any(left < 1e-9 * count**2):
        return math.inf
    return math.sqrt(float(np.sum(count / left)) / directions)


def variance_factor(directions: int, steps: tuple[int, ...], repeats: int) -> float:
    """Relative standard uncertainty of the variance of a direction, where all are equal.

    It is relative to the variance one half of a machine's or probe's direction.
    """
    machine, probe = turned_pairs(directions, steps)
    readings = MultiStepReadings(machine, probe, np.zeros(len(machine)))
    return direction_variance_uncertainty(readings, repeats)


def touches_determine(directions: int, steps: tuple[int, ...], repeats: int) -> bool:
    """Whether touches, of which the circle of each setup takes three numbers, determine variances.

    Readings without circles need fewer orientations; fewer than six directions are not touched.

    >>> touches_determine(8, (0, 1, 3), 1), touches_determine(8, (0, 1, 3), 2)
    (False, True)
    """
    if directions < FEWEST_TOUCHED:
        return True
    machine, probe = turned_pairs(directions, steps)
    setup = np.repeat(np.arange(len(steps)), directions)
    azimuth = np.asarray(2.0 * np.pi / directions * (machine - 1), dtype=np.float64)
    circles = circles_of_setups(setup, azimuth)
    try:
        readings = MultiStepReadings(machine, probe, np.zeros(len(machine)), circles=circles)
        return math.isfinite(direction_variance_uncertainty(readings, repeats))
    except PretravelError:
        return False


def best_steps(directions: int, orientations: int) -> tuple[int, ...]:
    """Orientations, each chosen to reduce the uncertainty of systematic errors most.

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
    """Plan the test with the fewest touches that reaches the required uncertainties.

    Parameters
    ----------
    directions : int
        Number of directions of machine and probe.
    variance : float
        Expected variance of a single touch, of machine and probe together. [mm²]
    u_error : float, optional
        Required standard uncertainty of systematic errors. [mm]
    u_variance : float, optional
        Required relative standard uncertainty of the variance of each direction.

    Raises
    ------
    PretravelError
        No requirement, or a requirement that no test reaches.

    Notes
    -----
    Touches must determine the variances too: the circle of each setup takes three numbers.
    A new orientation costs more than a repeat, so that of tests with the same number of
    touches the one with fewer orientations is taken. But repeats in one orientation contribute
    less to variances than readings in another one, which combine more pairs.

    >>> plan = plan_separation(12, 1e-6, u_error=0.4e-3)
    >>> len(plan.steps) * plan.repeats >= 6
    True
    """
    wanted = _Requirement(directions, variance, u_error, u_variance)
    lowest_error, lowest_variance = wanted.lowest()
    best: SeparationPlan | None = None
    if wanted.reached_by(lowest_error, lowest_variance):
        for orientations in range(2, directions + 1):
            steps = best_steps(directions, orientations)
            best = _fewest_repeats(wanted, steps, best) or best
    if best is None:
        raise PretravelError(
            f"no test with up to {directions} orientations and {MOST_REPEATS} repeats reaches this "
            f"uncertainty; the lowest ones are {lowest_error / MICROMETRE:.3g} µm of errors and "
            f"{100.0 * lowest_variance:.0f} % of variances"
        )
    return best


@dataclass(frozen=True)
class _Requirement:
    """The expected variance of a test and its required uncertainties; see `plan_separation`."""

    directions: int
    variance: float
    u_error: float | None
    u_variance: float | None

    def __post_init__(self) -> None:
        if not 3 <= self.directions <= MOST_DIRECTIONS:
            raise PretravelError(
                f"the number of directions is {self.directions}; it must be 3 to {MOST_DIRECTIONS}",
                inputs=("directions",),
            )
        checked(self.variance, "the expected variance", VARIANCE, inputs=("variance",))
        if self.u_error is not None:
            checked(self.u_error, "the uncertainty to reach", UNCERTAINTY, inputs=("u_systematic",))
        if self.u_variance is not None:
            checked(self.u_variance, "the uncertainty to reach", COUNT, inputs=("u_variance",))
        if self.variance == 0.0:
            raise PretravelError(
                f"the expected variance is {self.variance / MICROMETRE**2:g} µm²; it must be "
                "positive",
                inputs=("variance",),
            )
        if self.u_error is None and self.u_variance is None:
            raise PretravelError(
                "no uncertainty is required: give that of the errors, of the variances, or both",
                inputs=("u_systematic", "u_variance"),
            )
        for name, value in (("errors", self.u_error), ("variances", self.u_variance)):
            if value is not None and not value > 0.0:
                raise PretravelError(
                    f"the required uncertainty of the {name} is {value:g}; it must be positive"
                )

    @property
    def deviation(self) -> float:
        """Expected standard deviation of a single touch. [mm]"""
        return math.sqrt(self.variance)

    def lowest(self) -> tuple[float, float]:
        """The uncertainties of errors and variances of the largest test."""
        steps = tuple(range(self.directions))
        return (
            error_factor(self.directions, steps) * self.deviation / math.sqrt(MOST_REPEATS),
            variance_factor(self.directions, steps, MOST_REPEATS),
        )

    def reached_by(self, u_error: float, u_variance: float) -> bool:
        """Whether these uncertainties are small enough."""
        return (self.u_error is None or u_error <= self.u_error) and (
            self.u_variance is None or u_variance <= self.u_variance
        )


def _fewest_repeats(
    wanted: _Requirement, steps: tuple[int, ...], best: SeparationPlan | None
) -> SeparationPlan | None:
    """The test with these orientations that reaches the requirement with fewer touches than `best`.

    None where there is no such test.
    """
    single = error_factor(wanted.directions, steps) * wanted.deviation
    repeats = 1
    if wanted.u_error is not None:
        repeats = max(math.ceil((single / wanted.u_error) ** 2 - 1e-9), 1)
    while repeats <= MOST_REPEATS:
        if best is not None and len(steps) * repeats * wanted.directions >= best.readings:
            return None
        if not touches_determine(wanted.directions, steps, repeats):
            repeats += 1
            continue
        relative = variance_factor(wanted.directions, steps, repeats)
        if wanted.u_variance is None or relative <= wanted.u_variance:
            u_error = single / math.sqrt(repeats)
            return SeparationPlan(wanted.directions, steps, repeats, u_error, relative)
        # Each repeat adds degrees of freedom about in proportion.
        ratio = (relative / wanted.u_variance) ** 2 if math.isfinite(relative) else 2.0
        repeats = max(repeats + 1, min(math.floor(0.8 * repeats * ratio), 2 * repeats))
    return None
