"""Which direction is suspected of a gross error."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.qualification.outliers import _most_suspect

NOISE = 3e-4  # mm


def _suspect(means: list[float], counts: list[int], leverage: list[float], fixed: float) -> Any:
    """The suspect of residuals that are equal within each direction, in units of the noise."""
    groups = np.repeat(np.arange(len(counts)), counts)
    fit: Any = SimpleNamespace(
        residuals=NOISE * np.array(means)[groups],
        smoothing=SimpleNamespace(leverage=np.array(leverage)),
        noise=NOISE,
        fixed_scatter=0.6 * fixed * NOISE,
    )
    observation: Any = SimpleNamespace(groups=groups)
    return _most_suspect(observation, fit, 0.8 * fixed * NOISE)


@pytest.mark.parametrize(
    ("means", "counts", "leverage", "fixed", "suspect"),
    [
        ([2.4, 2.3, 0.0], [1, 1, 1], [0.0, 0.0, 0.0], 0.0, None),  # 2.4 and 2.3
        ([2.6, 2.3, 0.0], [1, 1, 1], [0.0, 0.0, 0.0], 0.0, 0),  # 2.6 and 2.3
        ([2.6, 2.3, 0.0], [1, 1, 1], [0.0, 0.5, 0.0], 0.0, 1),  # 2.6 and 2.3 / √0.5 = 3.3
        ([2.6, 1.6, 0.0], [1, 4, 1], [0.0, 0.0, 0.0], 0.0, 1),  # 2.6 and 1.6 / √(1/4) = 3.2
        ([3.0, 0.0, 0.0], [1, 1, 1], [0.0, 0.0, 0.0], 1.0, None),  # 3.0 / √2 = 2.1
    ],
)
def test_the_suspect_has_the_largest_studentised_residual(
    means: list[float], counts: list[int], leverage: list[float], fixed: float, suspect: int | None
) -> None:
    """The mean residual of n touches with the leverage h has the variance (σ²/n + f²)(1 - h), f
    being what touches of a direction have in common; 2.5 standard deviations are suspect."""
    assert _suspect(means, counts, leverage, fixed) == suspect


def test_a_gross_error_is_suspect_beside_a_large_variation() -> None:
    """30 times the noise, where the scatter in common would explain it."""
    assert _suspect([0.0, 30.0, 1.0], [1, 1, 1], [0.0, 0.0, 0.0], 100.0) == 1
    assert _suspect([0.0, 15.0, 1.0], [1, 1, 1], [0.0, 0.0, 0.0], 100.0) is None
