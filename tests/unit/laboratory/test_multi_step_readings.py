"""Equations of multi-step readings against dense matrices, and what readings must be.

S has a row for each reading: +1 at its machine direction, -1 at its probe direction.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.laboratory.separation.multi_step_readings import (
    MultiStepReadings,
    RepeatedPair,
    check_connected,
    direction_place,
    direction_sums,
    multi_step_design,
    normal_matrix,
    weighted_fit,
    weighted_residuals,
)
from pretravel.laboratory.separation.separation_csv import read_multi_step_test

MACHINE = np.array([11, 11, 12, 12, 12, 13, 14, 14, 15, 15, 13, 13])
PROBE = np.array([31, 32, 33, 34, 31, 32, 32, 34, 33, 34, 31, 31])
READINGS = MultiStepReadings(MACHINE, PROBE, 1e-3 * np.cos(np.arange(12) ** 2))
"""Five machine and four probe directions; some pairs lack, and one is there twice."""
SIGNED = np.hstack(
    [(MACHINE[:, None] == np.arange(11, 16)) * 1.0, (PROBE[:, None] == np.arange(31, 35)) * -1.0]
)


def test_a_design_is_made_of_indicators() -> None:
    design = multi_step_design(READINGS)
    assert np.array_equal(design.incidence, np.abs(SIGNED))
    assert np.array_equal(design.incidence * design.signs, SIGNED)
    assert (design.split, design.size) == (5, 9)
    assert design.basis.T @ design.basis == pytest.approx(np.eye(8), abs=1e-12)
    assert design.basis[:5].sum(axis=0) == pytest.approx(0.0, abs=1e-12)
    assert design.columns == pytest.approx(SIGNED, abs=1e-12)
    assert np.array_equal(design.machines[design.row], MACHINE)
    assert np.array_equal(design.probes[design.column], PROBE)
    assert (design.machine_place(13), design.probe_place(32)) == (2, 6)


def test_sums_normal_equations_and_weighted_fit() -> None:
    design = multi_step_design(READINGS)
    weights = np.random.default_rng(1).uniform(0.5, 2.0, 12)
    assert direction_sums(design, weights) == pytest.approx(np.abs(SIGNED).T @ weights)
    fixed = np.concatenate([np.ones(5), np.zeros(4)])
    dense = SIGNED.T @ np.diag(weights) @ SIGNED + weights.mean() * np.outer(fixed, fixed)
    assert normal_matrix(design, weights) == pytest.approx(dense, abs=1e-12)
    root = np.sqrt(weights)
    expected = np.linalg.lstsq(SIGNED * root[:, None], READINGS.errors * root, rcond=None)[0]
    found = weighted_fit(design, READINGS.errors, weights)
    assert found[:5].sum() == pytest.approx(0.0, abs=1e-12)
    left = READINGS.errors - SIGNED @ expected
    assert READINGS.errors - SIGNED @ found == pytest.approx(left, abs=1e-12)
    assert weighted_residuals(design, READINGS.errors, weights) == pytest.approx(left, abs=1e-12)


def test_a_direction_has_a_place() -> None:
    assert direction_place(np.array([4, 7, 9]), 7, "probe") == 1
    many = np.arange(20, 40)
    with pytest.raises(PretravelError, match=r"there are 20, .*, 31, …$"):
        direction_place(many, 5, "probe")
    with pytest.raises(PretravelError, match=r"there are 20, .*, 31$"):
        direction_place(many[:12], 5, "probe")


def test_readings_are_checked() -> None:
    for machine, probe, errors in (
        ([1, 1, 2], [1, 2, 1], [0.0] * 3), ([1.5, 1, 2, 2], [1, 2, 1, 2], [0.0] * 4),
        ([1, 1, 2, 2], [1, 2, 1, 2.2], [0.0] * 4), ([1, 1, 2, 2], [1, 2, 1], [0.0] * 4),
        ([1, 1, 2, 2], [1, 2, 1, 2], [0.0] * 5), ([1, 1, 2, 2], [1, 2, 1, 2], [math.nan] * 4),
        ([[1, 1, 2, 2]], [[1, 2, 1, 2]], [[0.0] * 4]),
    ):  # fmt: skip
        with pytest.raises(PretravelError):
            MultiStepReadings(machine, probe, errors)
    made = MultiStepReadings([2, 2, 1, 5], [7, 9, 9, 7], [0.0] * 4)
    assert (made.machines.tolist(), made.probes.tolist()) == ([1, 2, 5], [7, 9])
    assert len(made) == 4


def test_azimuths_of_directions() -> None:
    """As stated: twelve from 0.2 rad; else all around from +x, where both count from 1 to n."""
    stated = replace(READINGS, directions=12, first_azimuth=0.2)
    turn = 2.0 * math.pi / 12.0
    assert stated.azimuths_of(np.array([1, 4, 12])) == pytest.approx(
        0.2 + turn * np.array([0, 3, 11])
    )
    i, j = np.divmod(np.arange(9), 3)
    all_around = MultiStepReadings(i + 1, j + 1, np.zeros(9))
    assert np.degrees(all_around.azimuths_of(np.array([1, 3]))) == pytest.approx([0.0, 240.0])
    for machine, probe in ((i, j), (i + 1, j + 2), (i + 2, j + 1), (i + 1, np.minimum(j, 1) + 1)):
        readings = MultiStepReadings(machine, probe, np.zeros(9))
        assert np.isnan(readings.azimuths_of(np.array([1, 2]))).all()


@pytest.mark.parametrize(
    ("variance", "count"), [(0.0, 5), (-1e-6, 5), (0.8, 5), (1e-6, 1), (1e-6, 0)]
)
def test_repeats_that_determine_no_variance(variance: float, count: int) -> None:
    with pytest.raises(PretravelError):
        RepeatedPair(1, 2, variance, count)
    assert RepeatedPair(1, 2, 1e-6).count == 10
    with pytest.raises(PretravelError, match="Were µm meant"):
        MultiStepReadings([1, 1, 2, 2], [1, 2, 1, 2], [0.3, -1.1, 0.8, 2.0])
    assert RepeatedPair(1, 2, 1e-6, 2).count == 2


def test_groups_of_readings_without_a_common_direction_are_listed() -> None:
    """Machine 1 and 2 with probe 5 and 6; 3 with 7; each of the others with one of its own."""
    machines, probes = np.array([1, 1, 2, 3, 3, 4, 8]), np.array([5, 6, 6, 7, 7, 9, 11])
    three = multi_step_design(MultiStepReadings(machines[:6], probes[:6], np.zeros(6)))
    with pytest.raises(PretravelError) as refused:
        check_connected(three)
    assert (
        "3 groups that share no direction (machine 1, 2 with probe 5, 6; machine 3 with probe 7; "
        "machine 4 with probe 9): each"
    ) in str(refused.value)
    four = multi_step_design(MultiStepReadings(machines, probes, np.zeros(7)))
    with pytest.raises(PretravelError, match=r"4 groups .*machine 4 with probe 9; …\): each"):
        check_connected(four)
    check_connected(multi_step_design(MultiStepReadings([1, 1, 2, 2], [5, 6, 6, 5], np.zeros(4))))


class TestTables:
    HEAD = "machine_index,probe_index,error_um"
    ROWS = tuple(f"{i},{j},{i - 2 * j + 0.25 * i * j}" for i in (1, 2, 3) for j in (1, 2, 3))

    def _read(self, folder: Path, *lines: str) -> tuple[str, ...]:
        path = folder / "readings.csv"
        path.write_text("\n".join(lines) + "\n")
        return read_multi_step_test(path)[2]

    def test_comments(self, tmp_path: Path) -> None:
        (said,) = self._read(tmp_path, "# tip 4 mm", self.HEAD, *self.ROWS)
        assert said == "not read: line 1 '# tip 4 mm'"
        with pytest.raises(InputError, match="line 1: '# errors in nm' gives the unit nm"):
            self._read(tmp_path, "# errors in nm", self.HEAD, *self.ROWS)
        with pytest.raises(InputError, match="line 3: '# tip changed' is between the rows"):
            self._read(tmp_path, self.HEAD, self.ROWS[0], "# tip changed", *self.ROWS[1:])

    def test_a_column_of_units(self, tmp_path: Path) -> None:
        for unit in ("µm", "nm"):
            lines = [f"{self.HEAD},unit", *(f"{row},{unit}" for row in self.ROWS)]
            if unit == "µm":
                assert self._read(tmp_path, *lines) == ()
                continue
            with pytest.raises(InputError, match="unit is 'nm', and error_um is in µm"):
                self._read(tmp_path, *lines)

    def test_readings_in_mm(self, tmp_path: Path) -> None:
        rows = [f"{i},{j},{1e-3 * (i - j)}" for i in (1, 2, 3) for j in (1, 2, 3)]
        with pytest.raises(InputError, match=r"differs by 0\.004 over the readings"):
            self._read(tmp_path, self.HEAD, *rows)
