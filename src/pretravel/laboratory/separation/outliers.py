"""Gross errors among multi-step readings, named by their machine and probe direction."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, IntArray, PretravelError
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepDesign,
    check_connected,
    direction_sums,
    normal_matrix,
    residuals_from,
    weighted_fit,
)
from pretravel.laboratory.separation.noise import (
    TAILS,
    NoiseTails,
    ReadingScale,
    noise_tails,
    student_weight,
)
from pretravel.laboratory.separation.variances import (
    ROBUST_TAIL,
    common_scale,
    likelihood_information,
    squared_scales,
)

READING_OUTLIER_LEVEL = 0.01
"""Probability that any reading of a good test is named (Bonferroni over all readings)."""
_FEWEST_READINGS = 2  # of each direction that must be left
_FEWEST_DOF = 10
_LEAST_FREE = 0.43
"""Share of degrees of freedom in the readings: below it a quarter of good tests had an outlier."""
_ROUNDS, _FIT_ROUNDS = 4, 6
_SUSPICION = 4.5  # standard deviations


@dataclass(frozen=True)
class ReadingOutlier:
    """A reading that was left out, since the noise of the others does not explain it.

    Attributes
    ----------
    row : int
        Of the readings, from 0.
    machine, probe : int
        Indices of its directions.
    distance : float
        From the reading that the others predict. [mm]
    limit : float
        Largest distance that noise explains. [mm]
    """

    row: int
    machine: int
    probe: int
    distance: float
    limit: float

    @property
    def message(self) -> str:
        """A sentence that names the reading and its size."""
        return (
            f"reading {self.row + 1}, machine {self.machine} with probe {self.probe}, lies "
            f"{self.distance / MICROMETRE:+.3g} µm from what the others predict; noise explains "
            f"{self.limit / MICROMETRE:.3g} µm. It is left out"
        )


def enough_for_outliers(design: MultiStepDesign) -> bool:
    """Whether readings leave enough degrees of freedom to tell a gross error from noise."""
    count = len(design.row)
    return count - design.rank >= max(_FEWEST_DOF, _LEAST_FREE * count)


def outlying_readings(design: MultiStepDesign, errors: FloatArray) -> list[ReadingOutlier]:
    """Readings that the noise of the others does not explain, the largest error first.

    Parameters
    ----------
    design : MultiStepDesign
    errors : (n,) float
        [mm]

    Returns
    -------
    list of ReadingOutlier
        Empty in 99 % of the tests without gross errors, also where the noise has heavy tails.

    Notes
    -----
    The distribution of the noise, from normal to Student's with three degrees of freedom, and the
    scales of all directions come from the readings that are not named; its heavy tails widen the
    limits. A reading is named where the probability of its distance is less than
    `READING_OUTLIER_LEVEL` over the number of readings.
    """
    if not enough_for_outliers(design):
        return []
    suspected = _first_suspects(design, errors)
    for _ in range(_ROUNDS):
        part = _part(design, np.flatnonzero(~suspected))
        if part is None:
            return []
        judged = _judged(design, part, errors, np.flatnonzero(~suspected))
        if judged is None:
            return []
        distance, limits = judged
        named = np.abs(distance) > limits
        if np.array_equal(named, suspected):
            break
        suspected = named
    rows = np.flatnonzero(named)
    return [
        ReadingOutlier(
            int(row),
            int(design.machines[design.row[row]]),
            int(design.probes[design.column[row]]),
            float(distance[row]),
            float(limits[row]),
        )
        for row in rows[np.argsort(-np.abs(distance[rows]))]
    ]


def _first_suspects(design: MultiStepDesign, errors: FloatArray) -> BoolArray:
    """Readings far off with one common scale; the first scales of directions are without them."""
    level = common_scale(design, errors)
    ones = np.ones(len(errors))
    distance = _distances(design, design, errors, level * ones, ROBUST_TAIL)
    return np.asarray(np.abs(distance) > _SUSPICION * np.sqrt(level))


def _judged(
    design: MultiStepDesign, part: MultiStepDesign, errors: FloatArray, rows: IntArray
) -> tuple[FloatArray, FloatArray] | None:
    """Distances of all readings from what a part of them predicts, and their limits. [mm]

    None where the part is so small that it does not determine the scale of its own readings.

    The scales come from the part; the distribution of the noise comes from all readings, since
    without the largest ones its tails would seem light.
    """
    try:
        total = design.incidence @ squared_scales(part, errors[rows])
    except PretravelError:  # the readings that are left do not determine all scales
        return None
    if not np.all(total[rows] > 0.0):
        return None
    leverage = likelihood_information(design, total).leverage
    tails = noise_tails(design, errors, ReadingScale(total, leverage), gross=True)
    distance = _distances(
        design, part, errors, total * float(tails.of_tails @ tails.levels), tails.mean_tail, rows
    )
    signed = design.columns
    cofactor = np.linalg.inv(normal_matrix(part, 1.0 / total[rows]))
    predicted = np.sum((signed @ cofactor) * signed, axis=1)
    own = total + predicted
    own[rows] = np.maximum(total[rows] - predicted[rows], 0.05 * total[rows])
    return distance, np.sqrt(own) * _largest_noise(tails, READING_OUTLIER_LEVEL / len(errors))


def _largest_noise(tails: NoiseTails, level: float) -> float:
    """Distance that noise exceeds with this probability, in scales of a reading."""
    from scipy.optimize import brentq
    from scipy.special import ndtr, stdtr

    shares, scales = tails.of_tails, np.sqrt(tails.levels)

    def excess(distance: float) -> float:
        z = -distance / scales
        below = np.append(ndtr(z[0]), stdtr(1.0 / TAILS[1:], z[1:]))
        return float(2.0 * shares @ below) / level - 1.0

    return float(brentq(excess, 0.0, 1e6 * float(scales.max())))


def _distances(
    design: MultiStepDesign,
    part: MultiStepDesign,
    errors: FloatArray,
    total: FloatArray,
    tail: float,
    rows: IntArray | None = None,
) -> FloatArray:
    """Distances of all readings from a robust fit to a part of them, (n,). [mm]"""
    used = np.arange(len(errors)) if rows is None else rows
    weights = 1.0 / total[used]
    factor = np.ones(len(used))
    for _ in range(_FIT_ROUNDS):
        solution = weighted_fit(part, errors[used], weights * factor)
        residuals = residuals_from(part, errors[used], solution)
        factor = student_weight(tail, residuals**2 / total[used])
    return residuals_from(design, errors, solution)


def _part(design: MultiStepDesign, rows: IntArray) -> MultiStepDesign | None:
    """The equations of some of the readings; None where they do not connect all directions."""
    part = replace(
        design,
        row=design.row[rows],
        column=design.column[rows],
        incidence=design.incidence[rows],
        columns=design.columns[rows],
    )
    if np.min(direction_sums(part, np.ones(len(rows)))) < _FEWEST_READINGS:
        return None
    try:
        check_connected(part)
    except PretravelError:
        return None
    if part.with_circles and np.linalg.matrix_rank(part.columns, tol=1e-9) < part.rank:
        return None
    return part
