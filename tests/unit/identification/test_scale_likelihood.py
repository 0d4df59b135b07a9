"""The likelihood from reduced rows is that of the matrix of all pairs of directions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from pretravel.identification.scale_weights import log_likelihoods


@pytest.mark.parametrize("counts", [(3,), (2, 3, 5)])
@pytest.mark.parametrize("directions", [6, 30])
def test_likelihood_is_that_of_the_normal_distribution(counts, directions):
    rng = np.random.default_rng(5)
    count = rng.choice(counts, directions).astype(float)
    columns, values = rng.standard_normal((directions, 8)), rng.standard_normal(directions)
    # Columns that tell much, and columns beside which the noise is large; more than one block.
    variances = np.concatenate([rng.uniform(0.01, 2.0, (14, 8)), rng.uniform(1e-6, 1e-4, (5, 8))])
    scatters = np.array([[0.1, 0.5], [0.02, 0.3], [0.0, 1.0]])
    found = log_likelihoods(columns, variances, values, count, scatters)
    expected = [
        multivariate_normal(
            cov=(columns * prior) @ columns.T + np.diag(fixed + noise / count)
        ).logpdf(values)
        for prior in variances
        for fixed, noise in scatters
    ]
    # Without a constant, which is the same for all.
    assert np.allclose(found - found[0], np.array(expected) - expected[0], rtol=1e-9, atol=1e-9)
    constant = 0.5 * directions * np.log(2.0 * np.pi)
    assert found[0] == pytest.approx(expected[0] + constant, rel=1e-9)
