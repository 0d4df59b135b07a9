"""Trials of a separation, with its own results as the truth."""

from __future__ import annotations

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.laboratory.multi_step_readings import MultiStepReadings, multi_step_design
from pretravel.laboratory.separation import Separation, rows_of_readings
from pretravel.laboratory.separation_variances import equally_shared


def separation_by_trials(
    readings: MultiStepReadings, result: Separation, *, trials: int = 2000, seed: int | None = 1
) -> tuple[FloatArray, FloatArray]:
    """Simulate a separation's errors and variances, with its own results as the truth.

    Parameters
    ----------
    readings : MultiStepReadings
    result : Separation
        Of these readings; those that it left out are left out of the trials.
    trials : int
    seed : int or None

    Returns
    -------
    errors : (trials, m + p) float
        The machine's, then the probe's. [mm]
    variances : (trials, m + p) float
        From least squares, half each for machine and probe; they may be negative. [mm²]

    Notes
    -----
    All trials are evaluated at once: errors are linear in the readings, variances in squared
    residuals.
    """
    generator = np.random.default_rng(seed)
    rows = [*result.excluded, *(outlier.row for outlier in result.outliers)]
    used = rows_of_readings(readings, np.setdiff1d(np.arange(len(readings)), rows))
    design = multi_step_design(used)
    variances = np.concatenate([result.machine_variance, result.probe_variance])
    scatter = np.sqrt(np.maximum(design.incidence @ variances, 0.0))
    inverse = np.linalg.pinv(design.design)
    noise = scatter[:, None] * generator.standard_normal((len(used), trials))
    truth = np.concatenate([result.machine_error, result.probe_error])
    errors = truth + (design.basis @ (inverse @ noise)).T
    project = np.eye(len(used)) - design.design @ inverse
    matrix = design.incidence.T @ project**2 @ design.incidence
    found = np.linalg.pinv(matrix, rcond=1e-9) @ (design.incidence.T @ (project @ noise) ** 2)
    return errors, equally_shared(design, found).T
