"""Normals, curvatures and parameters at a point of a surface, against linear algebra."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.directions import unit
from pretravel.surface.local_geometry import (
    Domain,
    LocalGeometry,
    from_second_order,
    parameter_step,
    tangent_basis,
    unit_or,
)

RNG = np.random.default_rng(12)
DU, DV, DUU, DUV, DVV = RNG.normal(size=(5, 20, 3))


def test_tangents_and_normal_are_a_right_handed_frame() -> None:
    """In both halves of space, at their border and at both poles."""
    special = [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [0.6, 0.8, 0]]
    normals = unit(np.concatenate([DU, np.array(special, dtype=float)]))
    first, second = np.swapaxes(tangent_basis(normals), 0, 1)
    frames = np.stack([first, second, normals], axis=1)
    assert frames @ np.swapaxes(frames, 1, 2) == pytest.approx(np.tile(np.eye(3), (25, 1, 1)))
    assert np.cross(first, second) == pytest.approx(normals, abs=1e-12)


def test_rows_and_the_other_side() -> None:
    local = from_second_order(DUU, DU, DV, DUU, DUV, DVV)
    other = local.take([3, 1]).flipped()
    assert np.array_equal(other.point, DUU[[3, 1]])
    assert np.array_equal(other.normal, -local.normal[[3, 1]])
    assert np.array_equal(other.curvature, -local.curvature[[3, 1]])
    assert other.along_parameters is not None
    assert np.array_equal(other.along_parameters, np.stack([DU, DV], axis=1)[[3, 1]])
    bare = LocalGeometry(local.point, local.normal, local.curvature)
    assert bare.take([0]).along_parameters is None


def test_a_step_of_parameters_moves_by_the_displacement() -> None:
    """Along both tangents; at a pole along the one that moves; nowhere where none does."""
    share = RNG.normal(size=(20, 2))
    displacement = share[:, :1] * DU + share[:, 1:] * DV
    assert parameter_step(DU, DV, displacement) == pytest.approx(share, rel=1e-8, abs=1e-8)
    none = np.zeros((20, 3))
    along = np.sum(DVV * DU, axis=1) / np.sum(DU**2, axis=1)
    assert parameter_step(DU, none, DVV) == pytest.approx(np.column_stack([along, 0.0 * along]))
    assert parameter_step(none, DU, DVV) == pytest.approx(np.column_stack([0.0 * along, along]))
    assert np.array_equal(parameter_step(none, none, DVV), np.zeros((20, 2)))
    # Parallel derivatives: the larger one alone.
    for one, other, column in ((DU, 0.5 * DU, 0), (0.5 * DU, DU, 1), (DU, DU, 0)):
        step = parameter_step(one, other, DVV)
        assert step[:, column] == pytest.approx(along)
        assert np.all(step[:, 1 - column] == 0.0)
    # One row at a pole does not change the others.
    mixed = DV.copy()
    mixed[4] = 0.0
    step = parameter_step(DU, mixed, displacement)
    assert np.delete(step, 4, 0) == pytest.approx(np.delete(share, 4, 0), rel=1e-8, abs=1e-8)


def test_a_domain_contains_what_rounding_puts_beyond_it() -> None:
    """By 1e-12 of the sum of both bounds, 4e-9 of 1000 to 3000; of one at the least."""
    for low, high, slack in ((1000.0, 3000.0, 4e-9), (-0.2, 0.3, 1e-12), (-30.0, -10.0, 4e-11)):
        v = np.array([low - 0.9 * slack, low - 1.2 * slack, high + 0.9 * slack, high + 1.2 * slack])
        for axis in (0, 1):
            uv = np.full((4, 2), 7.0)
            uv[:, axis] = v
            bounds = [(-math.inf, low), (math.inf, high)]
            domain = Domain(*(b if axis else b[::-1] for b in bounds))
            assert domain.contains(uv).tolist() == [True, False, True, False]
            assert np.array_equal(domain.confined(uv)[:, axis], np.clip(v, low, high))
            assert np.all(domain.confined(uv)[:, 1 - axis] == 7.0)


def test_a_periodic_parameter_is_moved_into_its_range() -> None:
    for axis in (0, 1):
        period, low, high = [math.inf, math.inf], [-1.0, -1.0], [1.0, 1.0]
        period[axis], low[axis], high[axis] = 4.0, 2.0, 6.0
        domain = Domain((low[0], low[1]), (high[0], high[1]), (period[0], period[1]))
        uv = np.full((3, 2), 0.5)
        uv[:, axis] = [1.0, 7.5, -8.5]
        assert domain.contains(uv).all()
        assert domain.confined(uv)[:, axis].tolist() == [5.0, 3.5, 3.5]
        assert uv[0, axis] == 1.0
        uv[1, 1 - axis] = 1.5
        assert domain.contains(uv).tolist() == [True, False, True]


def test_what_has_no_length_has_the_direction_of_the_fallback() -> None:
    units = unit_or(np.array([[0.0, 3e-9, 4e-9], [0.0, 0.0, 0.0]]), [0.0, 0.0, -2.0])
    assert units == pytest.approx(np.array([[0.0, 0.6, 0.8], [0.0, 0.0, -1.0]]))
