"""Results as tables of pandas and datasets of xarray: names, units and values."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import pretravel
from pretravel.base.directions import grid
from pretravel.files.other_libraries import dataframe, dataset
from tests.support.examples import EXAMPLES


def _header(path: Path) -> list[str]:
    return path.read_text("utf-8").splitlines()[0].split(",")


@pytest.fixture(scope="module")
def touches() -> pretravel.Touches:
    return pretravel.read_touches(EXAMPLES / "sphere_touches.csv")


@pytest.fixture(scope="module")
def points(touches: pretravel.Touches) -> pretravel.Points:
    found = pretravel.qualify(touches, diameter=24.9987, tip_diameter=6.0, kind="mean")
    return pretravel.apply(
        pretravel.read_touches(EXAMPLES / "part_touches.csv"), found.pretravel_map
    )


@pytest.fixture(scope="module")
def trigger() -> pretravel.Trigger:
    return pretravel.predict(
        pretravel.load_probe("omp40-2"), grid([np.pi / 4, np.pi / 2], np.radians([0.0, 100.0]))
    )


def test_touches_have_the_columns_of_their_file(tmp_path: Path, touches: pretravel.Touches) -> None:
    full = replace(
        touches,
        feeds=np.full(len(touches), 50.0),
        spindle=np.full(len(touches), np.pi),
        labels=tuple(f"t{i}" for i in range(len(touches))),
        nominal_points=touches.positions,
    )
    pretravel.write_touches(tmp_path / "touches.csv", full)
    table = full.to_dataframe()
    assert list(table.columns) == _header(tmp_path / "touches.csv")
    assert table["spindle_deg"].tolist() == [180.0] * len(touches)  # π is 180°
    np.testing.assert_array_equal(table[["x_mm", "y_mm", "z_mm"]], touches.positions)
    assert table["label"].tolist()[:2] == ["t0", "t1"]


def test_points_have_the_columns_of_their_file(tmp_path: Path, points: pretravel.Points) -> None:
    pretravel.write_points(tmp_path / "points.csv", points)
    table = points.to_dataframe()
    assert list(table.columns) == _header(tmp_path / "points.csv")
    np.testing.assert_allclose(table["pretravel_um"], points.pretravel * 1e3, rtol=1e-12)


def test_a_prediction_has_the_columns_of_the_command(trigger: pretravel.Trigger) -> None:
    table = trigger.to_dataframe()
    assert list(table.columns)[:6] == [
        "polar_deg",
        "azimuth_deg",
        "trigger_force_N",
        "sensing_distance_um",
        "pretravel_um",
        "seat",
    ]
    assert table["polar_deg"].tolist() == [45.0, 45.0, 90.0, 90.0]
    assert table["azimuth_deg"].tolist() == [0.0, 100.0, 0.0, 100.0]


def test_shares_of_a_prediction_add_up_along_their_dimension(trigger: pretravel.Trigger) -> None:
    found = trigger.to_xarray()
    np.testing.assert_allclose(
        found["share"].sum("compliance"), found["pretravel"], rtol=1e-12, atol=0.0
    )
    # Pretravel is travel along the normal: deflection · normal and the compression of the tip.
    along = (found["deflection"] * found["normal"]).sum("axis")
    rest = found["share"].sel(compliance="tip_on_part")
    np.testing.assert_allclose(along + rest, found["pretravel"], rtol=1e-12)
    assert found.sizes == {"direction": 4, "axis": 3, "seat": 6, "compliance": 5}


def test_the_units_of_a_prediction_are_those_of_its_values(trigger: pretravel.Trigger) -> None:
    """mm and N as in Python: the same numbers as in the table, in other units."""
    found, table = trigger.to_xarray(), trigger.to_dataframe()
    assert found["pretravel"].attrs["units"] == "mm"
    np.testing.assert_allclose(found["pretravel"] * 1e3, table["pretravel_um"], rtol=1e-12)
    np.testing.assert_array_equal(found["trigger_force"], table["trigger_force_N"])
    np.testing.assert_allclose(found["polar"], table["polar_deg"])


def test_every_number_of_a_dataset_states_its_unit(
    points: pretravel.Points, trigger: pretravel.Trigger, touches: pretravel.Touches
) -> None:
    found = pretravel.qualify(touches, diameter=24.9987, tip_diameter=6.0, kind="mean")
    for value in (points, trigger, found.pretravel_map):
        for name, variable in value.to_xarray().variables.items():
            if variable.dtype.kind == "f":
                assert variable.attrs.get("units"), name


def test_the_dataset_of_a_map_has_its_numbers(tmp_path: Path, touches: pretravel.Touches) -> None:
    """Also from a NetCDF file that xarray writes of it."""
    found = pretravel.qualify(touches, diameter=24.9987, tip_diameter=6.0, kind="wozniak")
    found.pretravel_map.to_xarray().to_netcdf(tmp_path / "map.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "map.nc", engine="h5netcdf") as again:
        np.testing.assert_array_equal(again["coefficients"], found.pretravel_map.coefficients)
        np.testing.assert_array_equal(again["covariance"], found.pretravel_map.covariance.values)
        assert again.attrs["kind"] == "wozniak"
        assert again.attrs["tip_radius_mm"] == found.pretravel_map.tip_radius


def test_other_values_are_refused() -> None:
    with pytest.raises(TypeError, match="a str is not a table"):
        dataframe("text")
    with pytest.raises(TypeError, match="a str is not a dataset"):
        dataset("text")


def test_the_types_load_no_library_before_they_are_asked() -> None:
    program = (
        "import sys, pretravel; pretravel.Touches; pretravel.Points; pretravel.PretravelMap; "
        "print(sorted({'pandas', 'xarray', 'jinja2', 'pretravel.show'} & set(sys.modules)))"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "[]"
