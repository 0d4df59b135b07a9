"""Map files: other files are refused, damage is detected, tables keep their values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import grid
from pretravel.base.errors import InputError, PretravelError
from pretravel.files.map_file import read_map
from pretravel.files.touches_csv import read_touches
from pretravel.qualification.qualify import qualify
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.examples import EXAMPLES


def test_not_a_map(tmp_path: Path) -> None:
    text, other, half = tmp_path / "a.nc", tmp_path / "b.nc", tmp_path / "c.nc"
    text.write_text("hello")
    import h5py

    with h5py.File(other, "w") as file:
        file["x"] = 1.0
    import pretravel

    good = qualify(read_touches(EXAMPLES / "sphere_touches.csv"), 24.9987, kind="mean")
    pretravel.write_map(half, good.pretravel_map)
    half.write_bytes(half.read_bytes()[:2000])
    for path in (text, other, half):
        with pytest.raises(InputError, match="not a"):
            read_map(path)
    with pytest.raises(InputError, match="no such file"):
        read_map(tmp_path / "none.nc")
    table = tmp_path / "t.csv"
    table.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5\n")
    with pytest.raises(InputError, match="give the tip's diameter"):
        read_map(table)
    table.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5\n90,360,6\n")
    with pytest.raises(InputError, match="line 3: this direction is in the table twice"):
        read_map(table, tip_diameter=6.0)


def _example() -> Touches:
    return read_touches(EXAMPLES / "sphere_touches.csv")


class TestMapFiles:
    def _written(self, tmp_path: Path, **options: object) -> Path:
        import pretravel

        made = qualify(_example(), 24.9987, tip_diameter=6.0, kind="mean", **options)  # type: ignore[arg-type]
        path = tmp_path / "map.nc"
        pretravel.write_map(path, made.pretravel_map)
        return path

    def test_damage_is_noticed(self, tmp_path: Path) -> None:
        """The eight bytes of a coefficient, found by value, change in the last place but two."""
        path = self._written(tmp_path)
        value = read_map(path).coefficients[0]
        raw = path.read_bytes()
        assert raw.count(value.tobytes()) == 1
        path.write_bytes(raw.replace(value.tobytes(), (value * 1.001).tobytes()))
        with pytest.raises(InputError, match="damaged"):
            read_map(path)

    def test_a_qualified_map_is_good_with_its_own_tip_only(self, tmp_path: Path) -> None:
        path = self._written(tmp_path)
        assert read_map(path, tip_diameter=6.0).tip_radius == 3.0
        with pytest.raises(PretravelError, match="qualified with a tip of 6 mm"):
            read_map(path, tip_diameter=3.0)

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

    def test_a_table_with_two_tips(self, tmp_path: Path) -> None:
        path = tmp_path / "t.csv"
        path.write_text("polar_deg,azimuth_deg,pretravel_um,tip_radius_mm\n90,0,5,3\n90,9,5,2\n")
        with pytest.raises(InputError, match=r"line 3: tip_radius_mm is 2, but 3"):
            read_map(path)

    def test_a_table_in_the_wrong_unit(self, tmp_path: Path) -> None:
        path = tmp_path / "t.csv"
        path.write_text("polar_deg,azimuth_deg,pretravel_um\n90,0,5000\n")
        with pytest.raises(InputError, match="line 2: pretravel_um is 5000"):
            read_map(path, tip_diameter=6.0)
