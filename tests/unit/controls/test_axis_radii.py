"""Radii for probing screens, and the subroutine that computes one."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.controls.axis_radii import TRAVELS, axis_radii
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.files.map_file import write_map
from pretravel.maps.support import DirectionSupport
from tests.support.commands import run
from tests.support.example_maps import example_map, lobes

# The file has eight decimals.
WRITTEN = 5.1e-9


class TestRadii:
    def test_a_direction_of_travel_meets_the_opposite_normal(self) -> None:
        """Pretravel 10 + cos(azimuth) mm: 11 mm where the normal is +x, which travel x- meets."""
        found = axis_radii(lobes(1))["travel"]
        assert found["x-"]["radius_mm"] == pytest.approx(30.0 - 11.0, abs=WRITTEN)
        assert found["x+"]["radius_mm"] == pytest.approx(30.0 - 9.0, abs=WRITTEN)
        assert found["y+"]["radius_mm"] == pytest.approx(20.0, abs=WRITTEN)
        assert found["x-"]["normal"] == [1.0, 0.0, 0.0]
        assert found["z-"]["normal"] == [0.0, 0.0, 1.0]

    def test_both_units_and_diameters(self) -> None:
        found = axis_radii(lobes(1))
        one = found["travel"]["x+"]
        assert one["radius_inch"] * 25.4 == pytest.approx(one["radius_mm"], abs=25.4 * WRITTEN)
        assert one["diameter_mm"] == pytest.approx(2.0 * one["radius_mm"], abs=2 * WRITTEN)
        # 19 + 21 mm along x; all four sides 20 mm in the mean, the worst off by 1 mm.
        assert found["diameter"]["x"]["diameter_mm"] == pytest.approx(40.0, abs=WRITTEN)
        assert found["diameter"]["mean"]["diameter_mm"] == pytest.approx(40.0, abs=WRITTEN)
        assert found["diameter"]["mean"]["largest_error_of_a_side_um"] == pytest.approx(1000.0)
        assert found["calibration_offset"]["offset_mm"] == pytest.approx(10.0, abs=WRITTEN)

    def test_the_plane_is_that_of_the_map(self) -> None:
        pretravel_map = example_map()
        for entry in axis_radii(pretravel_map)["plane"]:
            angle = np.radians(entry["travel_azimuth_deg"])
            normal = [[-np.cos(angle), -np.sin(angle), 0.0]]
            true = pretravel_map.tip_radius - pretravel_map.pretravel(normal)[0]
            assert entry["radius_mm"] == pytest.approx(true, abs=WRITTEN)
            u = np.hypot(pretravel_map.standard_uncertainty(normal)[0], pretravel_map.u_tip_radius)
            assert entry["u_mm"] == pytest.approx(u, abs=WRITTEN)

    def test_a_delay_shrinks_all_radii_alike(self) -> None:
        slow, fast = (axis_radii(example_map(), t)["travel"] for t in (0.0, 0.01))
        for name in slow:
            assert slow[name]["radius_mm"] - fast[name]["radius_mm"] == pytest.approx(
                0.01, abs=2 * WRITTEN
            )

    def test_a_map_of_a_ring_has_no_radius_downwards(self) -> None:
        """A ring is touched on the equator only: nothing is invented for the axis."""
        angle = np.radians(np.arange(0, 360, 15))
        equator = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(24)])
        found = axis_radii(replace(lobes(1), support=DirectionSupport(equator)))
        assert found["travel"]["z-"] is None
        assert found["travel"]["x+"]["radius_mm"] == pytest.approx(21.0, abs=WRITTEN)

    def test_without_the_equator_refused(self) -> None:
        upper = DirectionSupport(np.array([[0.0, 0, 1], [0.1, 0, 0.995], [0, 0.1, 0.995]]))
        with pytest.raises(PretravelError, match="equator"):
            axis_radii(replace(lobes(1), support=upper))


class TestCommand:
    def test_json_with_the_feed(self, tmp_path: Path) -> None:
        path, out = tmp_path / "rest.json", tmp_path / "radii.json"
        write_map(path, replace(example_map(), delay=0.01, u_delay=1e-4, feed=None))
        assert "--feed" in run("export", path, "--to", "radii", "-o", out, code=2)
        said = run("export", path, "--to", "radii", "-o", out, "--feed", 60)
        found = json.loads(out.read_text())
        assert found["feed_mm_min"] == 60.0
        # 1 mm/s for 10 ms.
        true = 3.0 - example_map().pretravel([[-1.0, 0, 0]])[0] - 0.010
        assert found["travel"]["x+"]["radius_mm"] == pytest.approx(true, abs=WRITTEN)
        diameter = found["diameter"]["mean"]["diameter_mm"]
        assert f"QtDragon, QtVCP: Probe diameter: {diameter:.5f} mm" in said
        assert "60 mm/min" in said


class TestSubroutine:
    def test_parameters_do_not_overlap_those_of_probe_basic(self, tmp_path: Path) -> None:
        """Probe Basic keeps settings in #1001-1012, #3000-3058 and #3973-4024."""
        path, out = tmp_path / "map.json", tmp_path / "subs"
        write_map(path, example_map())
        run("export", path, "--to", "linuxcnc", "--form", "table", "--tolerance", 1e-5, "-o", out)
        text = (out / "pretravel_table.ngc").read_text()
        used = {int(number) for number in re.findall(r"^#(\d+) =", text, re.M)}
        theirs = {*range(1000, 1013), *range(3000, 3059), *range(3973, 4025)}
        assert len(used) > 1000  # as fine as the parameters allow
        assert not used & theirs
        assert min(used) >= 31
        assert max(used) <= 5000

    def test_another_feed_than_that_of_the_map_stops(self) -> None:
        pretravel_map = replace(example_map(), feed=50.0)
        form = exact_lookup(pretravel_map)
        assert form is not None
        text = linuxcnc_subroutines(pretravel_map, form)["pretravel_radius.ngc"]
        assert "GT 1]" in text  # 2 % of 50 mm/min
        assert "(ABORT,pretravel_radius: the map is for 50 mm/min" in text


def test_travels_are_those_that_probing_screens_name() -> None:
    """Unit vectors along the axes with the sign of their names; the probe is not pulled upwards."""
    assert set(TRAVELS) == {"x+", "x-", "y+", "y-", "z-"}
    for name, way in TRAVELS.items():
        expected = np.zeros(3)
        expected["xyz".index(name[0])] = 1.0 if name[1] == "+" else -1.0
        assert list(way) == expected.tolist(), name
