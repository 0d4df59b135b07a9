"""Widths of zones of many drawn errors together, and the form that lies behind a measured one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from pretravel.base import FloatArray
from pretravel.drawing.features.feature_form import zone_load, zone_widths
from pretravel.drawing.features.measured_feature import measure_feature
from tests.support.feature_points import OWN, feature_points


def _ring(count: int) -> FloatArray:
    angle = 2.0 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angle), np.sin(angle), np.ones(count)])


def _grid(side: int) -> FloatArray:
    return np.array([[x, y, 1.0] for x in range(side) for y in range(side)], dtype=float)


@pytest.mark.parametrize(
    "columns",
    [
        _ring(7),
        _ring(8),  # points opposite to each other, of which four carry with three loads
        _grid(3),  # three in a row carry as well as four
        np.hstack([_ring(20), np.ones((20, 1)), 1e-4 * _ring(20)[:, :1]]),  # dependent columns
        np.zeros((5, 0)),
        np.eye(3),  # nothing is left
    ],
    ids=["7", "8", "grid", "dependent", "nothing free", "all free"],
)
def test_widths_are_those_of_a_linear_program(columns: FloatArray) -> None:
    rows = 1e-3 * np.random.default_rng(5).standard_normal((12, len(columns)))
    found = zone_widths(rows, columns)
    one = np.ones((len(columns), 1))
    for row, width in zip(rows, found, strict=True):
        exact = linprog(
            np.append(np.zeros(columns.shape[1]), 2.0),
            A_ub=np.vstack([np.hstack([columns, -one]), np.hstack([-columns, -one])]),
            b_ub=1e3 * np.concatenate([-row, row]),
            bounds=[(None, None)] * (columns.shape[1] + 1),
        )
        # The program's own tolerance is 1e-7, of distances in micrometres.
        assert width == pytest.approx(1e-3 * exact.fun, abs=1e-9)
        # A width is the sum of what its points carry.
        assert zone_load(row, columns) @ row == pytest.approx(width, abs=1e-12)


def test_u_of_a_flatness_is_that_of_the_few_points_that_carry_the_zone() -> None:
    """A bow of 6 µm, touched at 16 places. Twice the scatter of the zone's width from one series of
    touches to the next is not enough, since errors widen it by about one more. Bounds of the
    largest difference of any two points, and of the noise of all, are 4.4 of them: 99.9 %."""
    rng = np.random.default_rng(8)
    at = np.column_stack([rng.uniform(-30.0, 30.0, (16, 2)), np.zeros(16)])
    at[:, 2] = 6e-3 * np.sum(at[:, :2] ** 2, axis=1) / 1800.0
    columns = np.column_stack([at[:, :2], np.ones(16)])
    noise = OWN * rng.standard_normal((2000, 16))
    scatter = float(np.std(zone_widths(at[:, 2] + noise, columns)))
    normals = np.tile([0.0, 0.0, 1.0], (16, 1))
    truth, inside = float(zone_widths(at[None, :, 2], columns)[0]), 0
    for row in noise[:6]:
        points = feature_points(at + row[:, None] * normals, normals)
        form = measure_feature(points, "plane", association="minimum-zone").form
        low, high = form.interval
        assert 2.0 * scatter < 0.5 * (high - low) < 3.7 * scatter
        inside += low <= truth <= high
    assert inside >= 4  # fewer have a probability of 0.2 % at 95 % each
