"""Compensated points come back from every format as they were written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.drawing.tasks.measure.features_of_points import not_in_u
from pretravel.files.file_format import ReadingOptions
from pretravel.files.netcdf import write_dataset
from pretravel.files.points_reading import points_and_notes, read_points
from pretravel.files.points_writing import points_dataset, write_points
from pretravel.files.readings import ALL
from pretravel.files.source_file import SourceFile
from pretravel.files.touches_csv import read_touches
from pretravel.measurement.compensation import apply
from pretravel.measurement.point_errors import point_sources, total_covariance
from pretravel.measurement.points import FIXED_SCATTER, Points
from tests.support.commands import both_outputs
from tests.support.example_maps import example_map
from tests.support.examples import EXAMPLES

PART = read_touches(EXAMPLES / "part_touches.csv")


@pytest.fixture(scope="module")
def points() -> Points:
    return apply(PART, example_map())


def test_factors_make_up_the_covariance_of_all_points(points: Points) -> None:
    """Factors and own variances against the full covariance: 2 % of a variance may be missing."""
    assert points.shared is not None
    total = total_covariance(point_sources(PART, points, example_map())).matrix
    # Fixed scatter is common to points of one direction; all directions differ here.
    factors = np.array([v for k, v in points.shared.items() if k != FIXED_SCATTER])
    own = points.standard_uncertainty**2 - np.sum(factors**2, axis=0)
    found = factors.T @ factors + np.diag(own)
    assert np.abs(found - total).max() < 0.02 * np.diag(total).max()
    assert own == pytest.approx(example_map().single_touch ** 2, rel=0.1)


def test_a_map_that_is_far_better_than_the_touches_is_still_stated() -> None:
    """A repeatability of 1 mm: without a factor the map would look like a prediction."""
    rough = apply(PART, replace(example_map(), repeatability=1.0))
    assert rough.shared is not None
    assert list(rough.shared)[-1] == "map 1"


@pytest.mark.parametrize("ending", ["csv", "json", "parquet", "nc"])
def test_round_trip(points: Points, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"points.{ending}"
    points = replace(points, files="op1.csv, op2.csv")
    write_points(path, points)
    again = read_points(path)
    assert again.files == points.files
    assert "op1.csv, op2.csv: distances" in not_in_u(again)[0]
    near = {"rtol": 1e-11, "atol": 1e-12}  # CSV has twelve digits
    assert np.allclose(again.positions, points.positions, **near)
    assert np.allclose(again.normals, points.normals, **near)
    assert np.allclose(again.pretravel, points.pretravel, **near)
    assert np.allclose(again.standard_uncertainty, points.standard_uncertainty, **near)
    assert again.uncompensated is not None
    assert points.uncompensated is not None
    assert np.allclose(again.uncompensated, points.uncompensated, **near)
    assert again.labels == points.labels
    assert again.shared is not None
    assert points.shared is not None
    assert list(again.shared) == list(points.shared)
    for cause, moved in points.shared.items():
        assert np.allclose(again.shared[cause], moved, **near)


def _read(tmp_path: Path, text: str, name: str = "points.csv") -> Points:
    path = tmp_path / name
    path.write_text(text)
    return read_points(path)


def test_a_cause_with_several_parts_is_one_column(points: Points, tmp_path: Path) -> None:
    """A file of points has at most 20 columns, and says all the same which errors are common."""
    many = {f"map {k}": np.full(len(points), 1e-6 * k) for k in range(1, 16)}
    many |= {f"alignment {k}": np.full(len(points), -1e-6 * k) for k in range(1, 7)}
    path = tmp_path / "points.csv"
    write_points(path, replace(points, shared={"tip radius": np.full(len(points), 1e-4), **many}))
    header, first, *_ = path.read_text().splitlines()
    assert len(header.split(",")) <= 20
    assert "[-0.001 -0.002 -0.003 -0.004 -0.005 -0.006]" in first
    found = read_points(path).shared
    assert found is not None
    assert list(found) == ["tip radius", *many]
    for name, values in many.items():
        assert np.allclose(found[name], values, rtol=1e-11, atol=0.0)
    path.write_text(path.read_text().replace("-0.006]", "]", 1))
    with pytest.raises(InputError, match="shared_alignment_um has lists of different lengths"):
        read_points(path)


def test_columns_of_single_parts_are_read_as_before(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text(
        "x_mm,y_mm,z_mm,nx,ny,nz,u_um,shared_map_1_um,shared_map_2_um\n1,2,3,0,0,1,1,0.5,-0.25\n"
    )
    found = read_points(path).shared
    assert found is not None
    assert {name: part.tolist() for name, part in found.items()} == {
        "map 1": [0.5e-3], "map 2": [-0.25e-3]
    }  # fmt: skip


def test_older_files_do_not_state_what_is_common(tmp_path: Path) -> None:
    old = "label,x_mm,y_mm,z_mm,nx,ny,nz,pretravel_um,u_um\nA,1,2,3,0,0,1,12,0.5\n"
    found = _read(tmp_path, old)
    assert found.shared is None
    assert found.uncompensated is None
    assert found.labels == ("A",)


def test_points_without_common_errors_say_so(points: Points, tmp_path: Path) -> None:
    for name in ("points.csv", "points.nc"):
        write_points(tmp_path / name, replace(points, shared={}))
        assert read_points(tmp_path / name).shared == {}


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        ("x_mm,y_mm,z_mm,nx,ny,nz\n1,2,3,0,0,1\n", "p.csv", "no column u_um.*Compensate them"),
        ("x_mm,y_mm,z_mm,nx,ny,nz,u_um\n1,2,3,0,0,1,-1\n", "p.csv", "line 2: u_um is negative"),
        ("x_mm,y_mm,z_mm,nx,ny,nz,u_um\n1,2,3,0,0,0,1\n", "p.csv", "line 2"),
        (
            "x_mm,y_mm,z_mm,nx,ny,nz,u_um,shared_map_1_um\n1,2,3,0,0,1,1,2\n",
            "p.csv",
            r"shared errors \(2 µm\) are larger",
        ),
        ("[1, 2]", "p.json", "a list of rows"),
        ("{", "p.json", "not JSON"),
        ("", "p.qif", "not from .qif"),
        ("CDF", "p.nc", "not a NetCDF file"),
    ],
)
def test_what_is_refused(tmp_path: Path, text: str, name: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        _read(tmp_path, text, name)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("position", {"units": "m"}, "the array position must be in mm, and its units are 'm'"),
        ("covariance", {"times": 4.0}, "is not that of their covariance"),
        ("face", {"times": 1.5}, "not a number of a face"),
    ],
)
def test_a_dataset_that_was_changed(
    points: Points, tmp_path: Path, name: str, change: dict[str, Any], message: str
) -> None:
    path = tmp_path / "points.nc"
    numbered = replace(points, face=np.ones(len(points), dtype=np.int64))
    data = points_dataset(numbered)
    data[name] = (data[name].dims, change.pop("times", 1.0) * data[name].values, change)
    data["tip"] = ("point", np.ones(len(points)))
    write_dataset(path, data)
    with pytest.raises(InputError, match=message):
        read_points(path)
    write_dataset(path, data.assign({name: points_dataset(numbered)[name]}))
    assert "not read: tip" in points_and_notes(path)[1]


def test_keys_of_rows_that_are_not_read(tmp_path: Path) -> None:
    row = '{"x_mm": 1, "y_mm": 2, "z_mm": 3, "nx": 0, "ny": 0, "nz": 1, "u_um": 1, "part": "%s"}'
    path = tmp_path / "points.json"
    path.write_text(f"[{row % 'A'}, {row % 'A'}]")
    assert "not read: part" in points_and_notes(path)[1]
    path.write_text(f"[{row % 'A'}, {row % 'B'}]")
    with pytest.raises(InputError, match="the points are of part A and of part B"):
        read_points(path)


def test_coordinates_in_coarse_steps_are_named(tmp_path: Path) -> None:
    """Eight points of a bore at a round place are rounded alike, by up to half a step."""
    turn = np.arange(8) * np.pi / 4.0
    exact = np.column_stack([20.005 * np.cos(turn), 20.005 * np.sin(turn), np.full(8, -5.08)])
    for step, named in ((0.0254, True), (0.001, False)):
        path = tmp_path / f"{step}.csv"
        rounded = step * np.round(exact / step)
        lines = ["x_mm,y_mm,z_mm", *(",".join(f"{v:.4f}" for v in row) for row in rounded)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        said = "".join(both_outputs("measure", path, "--feature", "bore"))
        assert ("in steps of" in said) == named


@pytest.mark.parametrize(
    ("head", "names", "last", "message"),
    [
        ("", ",part", ("a", "b"), "line 3: the points are of part a and of part b"),
        ("", ",c_deg", ("0", "90"), "line 3: the rotary axis c_deg moves"),
        ("", ",outlier", ("0", "1"), "line 3: outlier is '1'"),
        ("# units: inch\n", "", None, "a line before it inch"),
        ("# part at 35 °C: temperature 35\n", "", None, "not read: line 1"),
        ("", ",U_um", ("8", "8"), "not read: U_um"),
    ],
)
def test_what_a_table_states_beside_its_points_is_named(
    head: str, names: str, last: tuple[str, str] | None, message: str
) -> None:
    one, other = ("", "") if last is None else (f",{cell}" for cell in last)
    rows = f"1,0,0,-1,0,0,0.5{one}\n-1,0,0,1,0,0,0.5{other}\n"
    text = f"{head}x_mm,y_mm,z_mm,nx,ny,nz,u_um{names}\n{rows}"
    file = SourceFile("points.csv", text.encode())
    if message.startswith("not read"):
        assert message in " ".join(points_and_notes(file)[1])
        return
    with pytest.raises(InputError, match=message):
        points_and_notes(file)
    if names == ",part":
        assert len(points_and_notes(file, ReadingOptions(series=(ALL,)))[0]) == 2


def test_a_table_of_coordinates_names_the_uncertainty_that_is_not_read() -> None:
    file = SourceFile("points.csv", b"x_mm,y_mm,z_mm,U_um\n1,0,0,8\n-1,0,0,8\n0,1,0,8\n")
    assert "not read: U_um" in points_and_notes(file)[1]
