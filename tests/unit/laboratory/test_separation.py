"""Stated uncertainties of a separation against trials."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.laboratory.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation import separate
from pretravel.laboratory.separation_trials import separation_by_trials

TRIALS = 20_000


def test_separation() -> None:
    i, j = np.divmod(np.arange(12 * 12), 12)
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(144) * np.sqrt(0.2 + 0.1 * np.cos(j))
    readings = MultiStepReadings(i, j, 1e-3 * (np.sin(i) - np.cos(j) + noise))
    result = separate(readings, method="least-squares")
    errors, variances = separation_by_trials(readings, result, trials=TRIALS)
    stated = np.sqrt(np.diag(result.error_covariance))
    # Where least squares finds a pair's variance negative, trials have none: 3 %.
    assert errors.std(axis=0) == pytest.approx(stated, rel=0.03)
    assert errors.mean(axis=0) == pytest.approx(
        np.concatenate([result.machine_error, result.probe_error]), abs=5e-6
    )
    stated = np.sqrt(np.diag(result.variance_covariance))
    assert variances.std(axis=0) == pytest.approx(stated, rel=0.1)
