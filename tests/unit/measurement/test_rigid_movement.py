"""Deviations of a part that lies elsewhere are recognized, and others are not taken for them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pretravel.measurement.points_summary import TouchSummary
from pretravel.measurement.rigid_movement import MovementSums
from tests.support.commands import both_outputs, rows, run
from tests.support.example_maps import mean_map
from tests.support.examples import EXAMPLES
from tests.support.feature_points import block_points

CHANCE = np.random.default_rng(5)
SHIFT, TURN = np.array([0.3, -0.4, 0.1]), np.radians(0.3) * np.array([0.6, 0.0, 0.8])


def _moved(positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return np.sum(normals * (SHIFT + np.cross(TURN, positions)), axis=1)


@pytest.mark.parametrize(("scale", "said"), [(25.4, "the deviations are"), (1.0, "")])
def test_nominal_points_that_are_none_of_these(scale: float, said: str) -> None:
    """Touches in mm, nominal points in inches, about the middle of the part: no shift, no turn."""
    positions, normals = block_points(CHANCE, 60)
    middle = 0.5 * (positions.max(axis=0) + positions.min(axis=0))
    off = np.sum(normals * (positions - middle), axis=1) * (1.0 - 1.0 / scale)
    summary = TouchSummary(60, 1.0, movement=MovementSums.of(positions, normals, off))
    told = [words for words in summary.warnings(mean_map(0.010)) if "deviations" in words]
    assert [words[: len(said)] for words in told] == [said] * bool(said)


def test_a_shift_and_a_turn_are_found() -> None:
    """With deviations of the part itself of 5 µm, which turn it by 0.003°; the shift is that of the
    middle of the points."""
    positions, normals = block_points(CHANCE, 60)
    deviation = _moved(positions, normals) + CHANCE.normal(0.0, 0.005, len(positions))
    said = MovementSums.of(positions, normals, deviation).sentence()
    found = re.search(
        r"a shift of ([\d.]+) mm and a turn of ([\d.]+)° .* from ([\d.]+) to ([\d.]+) µm", said
    )
    assert found is not None
    shift, turn, before, after = (float(value) for value in found.groups())
    middle = SHIFT + np.cross(TURN, positions.mean(axis=0))
    assert shift == pytest.approx(np.linalg.norm(middle), abs=0.005)
    assert turn == pytest.approx(0.3, abs=0.012)  # four times its u
    assert before == pytest.approx(1e3 * np.sqrt(np.mean(deviation**2)), rel=0.01)
    assert after < 7.0


def test_sums_of_parts_of_a_table_are_those_of_the_whole() -> None:
    positions, normals = block_points(CHANCE, 60)
    deviation = _moved(positions, normals)
    whole = MovementSums.of(positions, normals, deviation)
    parts = [MovementSums.of(positions[k], normals[k], deviation[k])
             for k in (slice(0, 25), slice(25, None))]  # fmt: skip
    assert parts[0].joined(parts[1]).sentence() == whole.sentence() != ""


def test_a_plane_shows_three_of_the_movements() -> None:
    """A floor that is 0.2 mm higher at one end; movements along it are not seen."""
    positions = np.column_stack([CHANCE.uniform(0.0, 50.0, (20, 2)), np.zeros(20)])
    normals = np.tile([0.0, 0.0, 1.0], (20, 1))
    said = MovementSums.of(positions, normals, 0.004 * positions[:, 0]).sentence()
    assert "a turn of 0.229°" in said  # atan(0.004)


@pytest.mark.parametrize(
    "deviation",
    [
        lambda n: CHANCE.normal(0.0, 0.2, n),  # form
        lambda n: np.full(n, 0.1),  # size: on opposite sides no movement
        lambda n: 0.025 * np.ones(n),  # small
        lambda n: np.where(np.arange(n) == 7, 1.0, 0.001),  # one gross error
    ],
)
def test_other_deviations_are_none(deviation: object) -> None:
    positions, normals = block_points(CHANCE, 60)
    values = deviation(len(positions))  # type: ignore[operator]
    assert MovementSums.of(positions, normals, values).sentence() == ""


def test_by_chance_hardly_ever() -> None:
    """Of 500 sets of seven to fourteen touches with large deviations of their own: no more than
    2 % are taken for those of a part elsewhere."""
    told = 0
    for _ in range(500):
        positions, normals = block_points(CHANCE, int(CHANCE.integers(7, 15)))
        deviation = CHANCE.normal(0.0, 0.2, len(positions))
        told += MovementSums.of(positions, normals, deviation).sentence() != ""
    assert told <= 10


def test_the_command_says_so(tmp_path: Path) -> None:
    """Touches of the example part, 0.5 mm beside where they were; as they were nothing is said."""
    part = EXAMPLES / "part.step"
    plan, touches, off = (tmp_path / f"{name}.csv" for name in ("plan", "touches", "off"))
    run("plan", part, "--spacing", 8, "-o", plan)
    run("simulate", "omp40-2", "--surface", part, "--targets", plan, "-o", touches)
    _, printed = both_outputs("compensate", touches, "--map", "omp40-2", "--nominal", part, "-o",
                  tmp_path / "points.csv")  # fmt: skip
    assert "lies elsewhere" not in " ".join(printed.split())
    table = rows(touches)
    turn = Rotation.from_euler("z", 0.3, degrees=True).as_matrix()
    lines = ["x_mm,y_mm,z_mm,nx,ny,nz"]
    for row in table:
        place = turn @ [float(row[f"{a}_mm"]) for a in "xyz"] + [0.4, 0.3, 0.0]
        normal = turn @ [float(row[f"n{a}"]) for a in "xyz"]
        lines.append(",".join(f"{value:.9f}" for value in (*place, *normal)))
    off.write_text("\n".join(lines) + "\n")
    _, printed = both_outputs("compensate", off, "--map", "omp40-2", "--nominal", part, "-o",
                  tmp_path / "points.csv")  # fmt: skip
    printed = " ".join(printed.split())
    assert "this looks like a part that lies elsewhere: a shift of" in printed
    # 0.298: to first order; along the face the contacts move too.
    assert re.search(r"a turn of 0\.(29[5-9]|30[0-5])°", printed)
    assert "Align the part first" in printed
