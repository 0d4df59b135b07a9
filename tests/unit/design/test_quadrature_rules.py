"""The rules of scikit-fem that are used have positive weights; others of it do not."""

from __future__ import annotations

import numpy as np
import pytest
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTet, RefTri

from pretravel.design.fem.quadrature import ELEMENT_DEGREE, FACE_DEGREE


@pytest.mark.parametrize(
    ("shape", "degree", "size", "points"),
    [(RefTet, ELEMENT_DEGREE, 1 / 6, 4), (RefTri, FACE_DEGREE, 1 / 2, 12)],
)
def test_rules_have_positive_weights(shape: type, degree: int, size: float, points: int) -> None:
    """A negative weight would be taken for an element that is turned inside out, and would pull
    where a load pushes."""
    _, weights = get_quadrature(shape, degree)
    assert len(weights) == points
    assert np.all(weights > 0.0)
    assert weights.sum() == pytest.approx(size, rel=1e-12)


def test_the_next_degree_has_a_negative_weight() -> None:
    """Why the degrees above are not raised: Keast's rule for tetrahedra has -4/5 of the volume."""
    _, weights = get_quadrature(RefTet, 3)
    assert weights.min() == pytest.approx(-4 / 5 / 6)
