"""Points with a gross error are named, and what belongs to the part is not taken for one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.measurement.gross_points import gross_points, gross_points_sentence
from tests.support.commands import both_outputs
from tests.support.examples import EXAMPLES
from tests.support.feature_points import block_points

CHANCE = np.random.default_rng(7)
GROSS = 0.146
"""A wrong digit of a session that tried the program. [mm]"""


def _named(positions: np.ndarray, normals: np.ndarray, deviation: np.ndarray) -> list[str]:
    u = np.full(len(deviation), 5e-4)
    return [point.name for point in gross_points(positions, normals, deviation, u, str)]


@pytest.mark.parametrize("count", [8, 24, 60])
def test_a_wrong_digit_is_named(count: int) -> None:
    """Deviations of the part of 1 µm; in simulation 99 to 100 % of 500 parts."""
    positions, normals = block_points(CHANCE, count)
    deviation = CHANCE.normal(0.0, 1e-3, count)
    assert _named(positions, normals, deviation) == []
    deviation[5] -= GROSS
    assert _named(positions, normals, deviation) == ["5"]


def test_a_wrong_digit_is_named_on_a_part_that_lies_elsewhere() -> None:
    """Deviations of 0.5 mm by its place conceal nothing."""
    positions, normals = block_points(CHANCE, 60)
    deviation = normals @ [0.3, -0.4, 0.1] + np.cross(positions, normals) @ [0.003, 0.0, 0.004]
    deviation = deviation + CHANCE.normal(0.0, 1e-3, 60)
    assert _named(positions, normals, deviation) == []
    deviation[7] += GROSS
    assert _named(positions, normals, deviation) == ["7"]


@pytest.mark.parametrize("count", [60, 200])
def test_a_side_of_the_part_is_no_gross_error(count: int) -> None:
    """One of six sides 0.1 mm off; the same side with 20 times the roughness of the others."""
    positions, normals = block_points(CHANCE, count)
    fine = CHANCE.normal(0.0, 1e-3, count)
    side = np.arange(count) % 6 == 0
    assert _named(positions, normals, fine + 0.1 * side) == []
    assert _named(positions, normals, np.where(side, 20.0 * fine, fine)) == []


def test_many_wrong_points_are_another_part() -> None:
    """Of 60 points 12 are a fifth; 13 are more."""
    positions, normals = block_points(CHANCE, 60)
    for wrong, named in ((12, 12), (13, 0)):
        deviation = np.zeros(60)
        deviation[:wrong] = GROSS * 2.0 ** np.arange(wrong)
        assert len(_named(positions, normals, deviation)) == named


def test_of_four_points_none_is_named() -> None:
    positions, normals = block_points(CHANCE, 4)
    assert _named(positions, normals, np.array([0.0, 0.0, 0.0, 1.0])) == []


def test_a_long_list_is_shortened() -> None:
    positions, normals = block_points(CHANCE, 60)
    deviation = np.zeros(60)
    deviation[:8] = 0.1 * 2.0 ** np.arange(8)
    found = gross_points(positions, normals, deviation, np.full(60, 5e-4), str)
    said = gross_points_sentence(found)
    assert said.startswith("0 lies +100.0 µm off the nominal, its neighbours about +0.0 µm; 1 lies")
    assert "; 3 more: a wrong digit" in said
    assert said.endswith("They are among the points: touch there again, or leave them out")
    assert gross_points_sentence(()) == ""


def _example_with_wrong_digits(folder: Path) -> Path:
    """The touches of the example's part, with two wrong coordinates."""
    lines = (EXAMPLES / "part_touches.csv").read_text(encoding="utf-8").splitlines()
    for line, column, error in ((21, 2, GROSS), (41, 0, 12.0)):
        cells = lines[line - 1].split(",")
        cells[column] = f"{float(cells[column]) + error:.7f}"
        lines[line - 1] = ",".join(cells)
    path = folder / "part.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_compensate_names_wrong_digits(tmp_path: Path) -> None:
    """Points with +93 µm (of 146 µm along z) and 8 mm were written with u of 0.5 µm, and
    nothing was said. They stay among the points, with their labels."""
    options = ("--map", "omp40-2", "-o", tmp_path / "points.csv")
    good = both_outputs("compensate", EXAMPLES / "part_touches.csv", *options)
    assert "off the nominal" not in "".join(good)
    said = "".join(both_outputs("compensate", _example_with_wrong_digits(tmp_path), *options))
    assert "touch 20 (line 21) lies +" in " ".join(said.split())
    assert "; touch 40 (line 41) lies " in " ".join(said.split())
    assert len((tmp_path / "points.csv").read_text().splitlines()) > 140
