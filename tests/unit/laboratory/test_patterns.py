"""Patterns of touches of the standards, and where they lie for a probe in any orientation."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.files.plan_csv import pattern_table
from pretravel.laboratory.standards.iso230_10 import plane_pattern_36
from tests.support.commands import rows, run


def normals_of(directions: np.ndarray, axis: list[float], turn: float = 0.0) -> np.ndarray:
    table = pattern_table(directions, (0.0, 0.0, 0.0), 12.5, 8.0, axis=axis, turn=turn)
    return np.column_stack([table[name] for name in ("nx", "ny", "nz")])


def test_plane_pattern_goes_around_the_equator() -> None:
    """36 directions, 10° apart, counter-clockwise from +x: as exponentials of complex numbers."""
    around = np.exp(1j * np.pi / 18.0) ** np.arange(36)
    expected = np.column_stack([around.real, around.imag, np.zeros(36)])
    assert plane_pattern_36() == pytest.approx(expected, abs=1e-12)


class TestPatternInTheMachine:
    @pytest.mark.parametrize(
        ("axis", "x_of_probe", "y_of_probe"),
        [
            # Tilted along the shortest way from +z to the axis: by hand.
            ([0.0, 0.0, 1.0], [1, 0, 0], [0, 1, 0]),
            ([1.0, 0.0, 0.0], [0, 0, -1], [0, 1, 0]),
            ([-1.0, 0.0, 0.0], [0, 0, 1], [0, 1, 0]),
            ([0.0, 1.0, 0.0], [1, 0, 0], [0, 0, -1]),
        ],
    )
    def test_axes_of_the_probe(
        self, axis: list[float], x_of_probe: list[float], y_of_probe: list[float]
    ) -> None:
        assert normals_of(np.eye(3), axis) == pytest.approx(
            np.array([x_of_probe, y_of_probe, axis], dtype=float), abs=1e-12
        )

    def test_turn_is_counter_clockwise_about_the_axis(self) -> None:
        """By a quarter: the probe's x becomes y, y becomes -x; then the tilt of above."""
        assert normals_of(np.eye(3), [0, 0, 1], math.pi / 2) == pytest.approx(
            np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]), abs=1e-12
        )
        assert normals_of(np.eye(3), [1, 0, 0], math.pi / 2) == pytest.approx(
            np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]), abs=1e-12
        )

    def test_polar_angles_are_those_from_the_axis(self) -> None:
        axis = np.array([2.0, -3.0, 6.0]) / 7.0
        pattern = sphere_pattern_25()
        assert normals_of(pattern, axis.tolist(), 0.4) @ axis == pytest.approx(pattern[:, 2])

    def test_command_touches_the_half_that_the_probe_reaches(self, tmp_path: Path) -> None:
        """A probe along -y, on a sphere at (1, 2, 3): starts lie outside, on the same ray."""
        run("pattern", "iso10360-5", "--diameter", 25, "--axis", "0,-1,0", "--turn", 30,
            "--center", "1,2,3", "-o", tmp_path / "t.csv")  # fmt: skip
        found = rows(tmp_path / "t.csv")
        places, normals, starts = (
            np.array([[float(row[name.format(a)]) for a in "xyz"] for row in found])
            for name in ("{}_mm", "n{}", "start_{}_mm")
        )
        assert -normals[:, 1] == pytest.approx(sphere_pattern_25()[:, 2], abs=1e-9)
        assert places == pytest.approx(np.array([1.0, 2, 3]) + 12.5 * normals)
        assert starts == pytest.approx(np.array([1.0, 2, 3]) + (12.5 + 3.0 + 5.0) * normals)
