"""Map files: other files are refused, damage is detected, tables keep their values."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import grid
from pretravel.base.errors import InputError, PretravelError
from pretravel.files.map_file import read_map, write_map
from pretravel.files.touches_csv import read_touches
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map
from tests.support.examples import EXAMPLES


def test_not_a_map(tmp_path: Path) -> None:
    import pretravel

    half = tmp_path / "c.json"
    good = qualify(read_touches(EXAMPLES / "sphere_touches.csv"), 24.9987, kind="mean")
    pretravel.write_map(half, good.pretravel_map)
    half.write_bytes(half.read_bytes()[:2000])
    with pytest.raises(InputError, match="not a map"):
        read_map(half)
    with pytest.raises(InputError, match="no such file"):
        read_map(tmp_path / "none.json")
    with pytest.raises(InputError, match="this is a folder"):
        read_map(tmp_path)
    with pytest.raises(PretravelError, match=r"the ending must be \.json or \.csv"):
        pretravel.write_map(tmp_path / "map.nc", good.pretravel_map)
    table = tmp_path / "t.csv"
    table.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5\n")
    with pytest.raises(InputError, match="give the tip's diameter"):
        read_map(table)
    table.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5\n90,360,6\n")
    with pytest.raises(InputError, match="line 3: this direction is in the table twice"):
        read_map(table, tip_diameter=6.0)


@pytest.mark.parametrize("content", [b"\x89HDF\r\n\x1a\n", b"{}", b""])
def test_a_netcdf_map_is_refused_with_what_to_do(tmp_path: Path, content: bytes) -> None:
    """Whatever it contains; so is a file without an ending, which is no map."""
    for name, said in (
        ("map.nc", "qualify or predict again with -o map.json"),
        ("map.NC", "qualify or predict again with -o map.json"),
        ("map", "a map is read from .json, or from a .csv table, not from ''"),
        ("map.txt", "not from '.txt'"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=said):
            read_map(tmp_path / name)


def test_reading_a_map_imports_no_large_library(tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    write_map(path, example_map("physical"))
    program = (
        "import sys; from pretravel.files.map_file import read_map; "
        f"read_map({str(path)!r}); "
        "print(*sorted({'xarray', 'h5netcdf', 'h5py', 'pandas'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""


def _example() -> Touches:
    return read_touches(EXAMPLES / "sphere_touches.csv")


class TestMapFiles:
    def _written(self, tmp_path: Path, **options: object) -> Path:
        import pretravel

        made = qualify(_example(), 24.9987, tip_diameter=6.0, kind="mean", **options)  # type: ignore[arg-type]
        path = tmp_path / "map.json"
        pretravel.write_map(path, made.pretravel_map)
        return path

    def test_damage_is_noticed(self, tmp_path: Path) -> None:
        path = self._written(tmp_path)
        value = str(float(read_map(path).coefficients[0]))
        text = path.read_text("utf-8")
        assert text.count(value) == 1
        path.write_text(text.replace(value, value[:-3] + "999"), "utf-8")
        with pytest.raises(InputError, match="damaged"):
            read_map(path)

    def test_a_qualified_map_is_good_with_its_own_tip_only(self, tmp_path: Path) -> None:
        path = self._written(tmp_path)
        assert read_map(path, tip_diameter=6.0).tip_radius == 3.0
        with pytest.raises(PretravelError, match="qualified with a tip of 6 mm"):
            read_map(path, tip_diameter=3.0)

    def test_touches_are_no_map(self, tmp_path: Path) -> None:
        (tmp_path / "t.csv").write_text("T;X;Y;Z\n7;1,5;2;3\n")
        with pytest.raises(InputError, match="this is not a map: a table of a map has the columns"):
            read_map(tmp_path / "t.csv")

    @pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.6, 0.0, -0.8)])
    def test_a_table_keeps_axis_noise_and_tip(
        self, tmp_path: Path, axis: tuple[float, float, float]
    ) -> None:
        import pretravel
        from pretravel.base.frames import probe_rotation

        rotation = probe_rotation(axis, 0.4)
        nodes = grid(np.radians(np.arange(5, 90, 5)), np.radians(np.arange(0, 360, 10)))
        from pretravel.maps.kinds.tabulated import TabulatedBasis
        from pretravel.maps.pretravel_map import PretravelMap
        from pretravel.maps.support import DirectionSupport

        support = DirectionSupport(nodes)
        made = PretravelMap(
            TabulatedBasis(support), 0.01 + 0.002 * nodes[:, 0],
            Covariance.fully_shared(np.full(len(nodes), 4e-8)), support,
            tip_radius=3.0, u_tip_radius=2e-4, repeatability=3e-4, rotation=rotation,
        )  # fmt: skip
        pretravel.write_map(tmp_path / "map.csv", made)
        back = read_map(tmp_path / "map.csv")
        normals = nodes @ rotation.T
        # The table's grid of 5° by 10° holds the nodes: equal to its twelve digits.
        assert np.allclose(back.pretravel(normals), made.pretravel(normals), atol=1e-9)
        assert np.allclose(back.standard_uncertainty(normals), 2e-4, rtol=1e-6)
        assert back.repeatability == pytest.approx(3e-4)
        assert back.u_tip_radius == pytest.approx(2e-4)
        assert np.allclose(back.rotation, rotation, atol=1e-9)

    def test_a_measured_table_of_few_directions(self, tmp_path: Path) -> None:
        """Three lobes of 2 µm every 30°: each direction lies (1 - cos 90°) of its lobe, 2 µm / √2
        rms, off the straight line between its neighbours. A stated scatter adds to half of this;
        a prediction, without u, states none."""
        azimuths = np.arange(0, 360, 30)
        rows = [f"90,{a},{5.0 + 2.0 * np.cos(np.radians(3 * a)):.9f}" for a in azimuths]
        for columns, more, expected in (
            (",u_um,fixed_scatter_um", ",0.1,0.5", np.hypot(0.5e-3, 1e-3 / np.sqrt(2.0))),
            ("", "", 0.0),
        ):
            text = "\n".join(f"{row}{more}" for row in rows)
            (tmp_path / "t.csv").write_text(
                f"polar_deg,azimuth_deg,pretravel_um{columns}\n{text}\n"
            )
            found = read_map(tmp_path / "t.csv", tip_diameter=6.0)
            assert found.fixed_scatter == pytest.approx(expected, rel=1e-6)

    def test_a_table_with_two_tips(self, tmp_path: Path) -> None:
        path = tmp_path / "t.csv"
        path.write_text("polar_deg,azimuth_deg,pretravel_um,tip_radius_mm\n90,0,5,3\n90,9,5,2\n")
        with pytest.raises(InputError, match=r"line 3: tip_radius_mm is 2, but 3"):
            read_map(path)

    @pytest.mark.parametrize(
        ("columns", "rows", "said"),
        [
            ("", "90,0,5000", "line 2: pretravel_um is 5000"),
            ("", "90,0,0.005\n90,9,0.006", "line 3: the largest pretravel_um is 0.006.*in mm"),
            ("", "90,0,-5\n90,9,-6", "line 3: pretravel_um is negative in every row"),
            # It was passed over, and U lacked it.
            (",u_tip_radius_mm", "90,0,5,0.0002", "line 1: a map has no column 'u_tip_radius_mm'"),
            (",spindle_deg", "90,0,5,90", "a map has no column 'spindle_deg'"),
            (",effective_radius_mm", "90,0,5,2.995", "a table of radii to read"),
            # The axis was (0.6, 0, 0), and a rotation without an axis was passed over.
            (",probe_axis_x", "90,0,5,0.6", "probe_axis_z must all be there"),
        ],
    )
    def test_a_table_with_another_unit_sign_or_column(
        self, tmp_path: Path, columns: str, rows: str, said: str
    ) -> None:
        path = tmp_path / "t.csv"
        path.write_text(f"polar_deg,azimuth_deg,pretravel_um{columns}\n{rows}\n")
        with pytest.raises(InputError, match=said):
            read_map(path, tip_diameter=6.0)

    def test_a_rotation_about_the_vertical(self, tmp_path: Path) -> None:
        path = tmp_path / "t.csv"
        path.write_text("polar_deg,azimuth_deg,pretravel_um,probe_rotation_deg\n90,0,5,90\n")
        assert read_map(path, tip_diameter=6.0).rotation[:, 0] == pytest.approx([0.0, 1.0, 0.0])
