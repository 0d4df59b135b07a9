"""The narrow forms of a covariance say what the matrix of all pairs says."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.uncertainty.covariance import Covariance, SharedCovariance, classes_of, reduced_rows


@pytest.mark.parametrize("count", [5, 40])  # fewer than twice the shared errors, and more
def test_whitening_and_determinant_are_those_of_the_full_matrix(count):
    rng = np.random.default_rng(3)
    own, shared = rng.uniform(0.1, 2.0, count), rng.standard_normal((count, 6))
    total = np.diag(own) + shared @ shared.T
    covariance = SharedCovariance(own, shared)
    white = covariance.whitened(np.eye(count))
    assert np.allclose(white.T @ white, np.linalg.inv(total), rtol=1e-10, atol=1e-12)
    assert covariance.log_determinant == pytest.approx(np.linalg.slogdet(total)[1], rel=1e-12)
    values = rng.standard_normal(count)
    assert np.allclose(covariance.whitened(values), white @ values, rtol=1e-10, atol=1e-12)


def test_values_and_shared_errors_are_of_the_same_number_and_variances_above_zero():
    with pytest.raises(PretravelError, match="not of the same values"):
        SharedCovariance(np.ones(3), np.ones((2, 1)))
    with pytest.raises(PretravelError, match="above zero"):
        SharedCovariance(np.array([1.0, 0.0]), np.ones((2, 1)))


def test_reduced_rows_give_the_same_sums_for_every_class_whatever_the_blocks():
    rng = np.random.default_rng(4)
    rows, classes = rng.standard_normal((9000, 7)), rng.integers(0, 3, 9000)
    classes[classes == 2] = 0
    classes[:4] = 2  # a class with fewer rows than columns
    blocks = [(rows[at : at + 1000], classes[at : at + 1000]) for at in range(0, 9000, 1000)]
    reduced = reduced_rows(blocks, 3)
    for number in range(3):
        of_class, small = rows[classes == number], reduced.rows[reduced.classes == number]
        sums = small.T @ small
        sums[-1, -1] += reduced.unexplained[number]
        assert np.allclose(sums, of_class.T @ of_class, rtol=1e-10, atol=1e-9)
        assert len(small) + reduced.dof[number] == len(of_class)
    together, left, dof = reduced.together
    sums = together.T @ together
    sums[-1, -1] += left
    assert np.allclose(sums, rows.T @ rows, rtol=1e-10, atol=1e-9)
    assert dof + len(together) == 9000


def test_very_different_numbers_of_touches_are_put_into_classes_of_similar_ones():
    counts = np.arange(1.0, 1001.0)
    count, classes = classes_of(counts)
    assert len(count) <= 64
    # 63 steps of the logarithm from 1 to 1000: half a step is 5.6 %.
    assert np.all(np.abs(np.log(count[classes] / counts)) <= np.log(1000.0) / 63.0)


def test_errors_are_drawn_from_a_number_as_from_a_generator_that_begins_with_it():
    variances = np.array([1.0, 4.0])
    for covariance in (
        Covariance.independent(variances),
        Covariance.fully_shared(variances),
        Covariance.full(np.array([[1.0, 0.5], [0.5, 4.0]])),
    ):
        drawn = covariance.errors(5, 3)
        assert np.array_equal(drawn, covariance.errors(np.random.default_rng(5), 3))
        assert not np.any(drawn == covariance.errors(6, 3))
