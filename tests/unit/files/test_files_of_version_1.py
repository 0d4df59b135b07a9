"""Files of version 1 can still be read and give the same numbers.

Maps of every kind: qualified on a sphere of 25 mm (tip 6 mm, u of the diameter 0.25 µm, simulated
noise 0.3 µm). The axis of the harmonic and the sector map is (0.48, 0.64, 0.6); harmonic maps are
cut at degree 4, to be small. `values.csv` contains the values that the
version that wrote them computed.
"""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.map_file import read_map
from pretravel.files.probe_history import map_id, read_history
from pretravel.maps.pretravel_map import PretravelMap
from tests.support.commands import rows

FOLDER = Path(__file__).parent / "data" / "maps_version_1"
MAPS = sorted(
    path.name for path in FOLDER.iterdir() if path.suffix in (".nc", ".csv")
    and path.name != "values.csv"
)  # fmt: skip
KINDS = {
    "harmonic": "harmonic", "mean": "mean", "physical": "physical", "predicted": "physical",
    "sectors": "sectors", "tabulated": "tabulated", "wozniak": "wozniak",
}  # fmt: skip


def _read(name: str) -> PretravelMap:
    """Of a map in NetCDF the reader says that its checksum covers less than one of today."""
    if name.endswith(".csv"):
        return read_map(FOLDER / name)
    with pytest.warns(UserWarning, match=r"checksum does not cover"):
        return read_map(FOLDER / name)


@cache
def _values() -> dict[str, np.ndarray]:
    """Of each file: nx, ny, nz, pretravel [mm], u [mm], a row for each direction."""
    found: dict[str, list[list[float]]] = {}
    for row in rows(FOLDER / "values.csv"):
        name, *numbers = row.values()
        found.setdefault(name, []).append([float(number) for number in numbers])
    return {name: np.array(numbers) for name, numbers in found.items()}


def test_every_file_has_its_values() -> None:
    assert sorted(_values()) == MAPS


@pytest.mark.parametrize("name", MAPS)
def test_same_pretravel_and_uncertainty(name: str) -> None:
    made = _read(name)
    stem, _, ending = name.partition(".")
    assert made.kind == ("tabulated" if ending == "csv" else KINDS[stem.split("_")[0]])
    values = _values()[name]
    pretravel, u = made.pretravel_and_uncertainty(values[:, :3])
    # Another order of summation may change the last digits of a double.
    assert pretravel == pytest.approx(values[:, 3], rel=1e-12, abs=1e-16)
    # Slopes of a six-seat probe were central differences then, wrong by up to 5e-9.
    assert u == pytest.approx(values[:, 4], rel=1e-8, abs=1e-16)


def test_what_belongs_to_a_map_is_read() -> None:
    """The axis, the tip, the feed or the delay, the scatter of repeats."""
    turned = _read("harmonic.nc")
    assert turned.rotation[:, 2] == pytest.approx([0.48, 0.64, 0.6], abs=1e-12)
    assert (turned.tip_radius, turned.feed, turned.delay) == (3.0, 50.0, None)
    assert turned.repeatability == pytest.approx(3e-4, rel=0.3)
    assert turned.u_tip_radius > 0.0
    for name in ("harmonic_with_delay.nc", "harmonic_with_delay.csv", "physical_with_delay.nc"):
        resting = _read(name)
        assert resting.feed == 0.0
        assert resting.delay == pytest.approx(14.5e-3, abs=4e-4)
        assert resting.u_delay > 0.0
    for name in ("harmonic_with_delay.nc", "physical_with_delay.nc"):
        assert _read(name).delay_effect is not None


def test_history_of_a_probe(tmp_path: Path) -> None:
    path = tmp_path / "history.sqlite"
    shutil.copy(FOLDER / "history.sqlite", path)
    first, second = read_history(path)
    assert (first.number, second.number) == (1, 2)
    assert first["time"] == "2026-01-01T08:00:00+00:00"
    assert first["touches_file"] == "day1.csv"
    assert first["map_id"] == map_id(_read("physical.nc"))
    assert (first["changed"], second["changed"]) == (0, 1)
    # The second day's pretravel was 30 % more.
    assert second["amplitude_percent"] == pytest.approx(30.0, abs=3.0)


def test_damage_that_the_old_checksum_covers(tmp_path: Path) -> None:
    import h5py

    path = tmp_path / "map.nc"
    shutil.copy(FOLDER / "harmonic.nc", path)
    with h5py.File(path, "r+") as file:
        file["coefficients"][0] *= 1.001
    with pytest.raises(InputError, match="damaged or edited"):
        read_map(path)


@pytest.mark.parametrize(
    ("name", "new", "said"),
    [
        ("degree", np.array([10**9]), "degrees 0 to 60"),
        ("order", np.array([-4]), "orders from -degree"),
        ("tip_radius_mm", "3", "one number"),
        ("repeatability_mm", np.array([1.0, 2.0]), "one number"),
        ("feed_mm_min", -1.0, "finite and positive"),
        ("provenance", "[1]", "provenance"),
        ("provenance", '{"origin": "made", "source": [1]}', "source must be"),
        ("kind", np.array([1]), "not known"),
    ],
)
def test_wild_content_is_refused(tmp_path: Path, name: str, new: object, said: str) -> None:
    """The old checksum does not cover it, or everyone can make one that fits."""
    import h5py

    path = tmp_path / "map.nc"
    shutil.copy(FOLDER / "harmonic.nc", path)
    with h5py.File(path, "r+") as file:
        if name in file:
            file[name][1:2] = new
        else:
            del file.attrs[name]
            file.attrs[name] = new
    with pytest.raises(InputError, match=said):
        read_map(path)


def test_arrays_larger_than_the_file(tmp_path: Path) -> None:
    """8 TB that were never written take no place in an HDF5 file."""
    import h5netcdf

    path = tmp_path / "map.nc"
    with h5netcdf.File(path, "w") as file:
        file.dimensions = {"coefficient": 10**12}
        file.create_variable("coefficients", ("coefficient",), "<f8")
    with pytest.raises(InputError, match="declares arrays of 8,000,000,000,000 bytes"):
        read_map(path)
