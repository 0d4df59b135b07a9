"""Radii for probing screens, and the subroutine that computes one."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.controls.axis_radii import TRAVELS, axis_radii, axis_radii_text
from pretravel.controls.renishaw import renishaw_variables
from pretravel.files.map_file import write_map
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import run
from tests.support.example_maps import lobes, mean_map


@cache
def _map() -> PretravelMap:
    """1, y, z, x and sin³ cos 3 azimuth: all four sides and the axis have different pretravel."""
    terms = np.array([[0, 0], [1, -1], [1, 0], [1, 1], [3, 3]])
    return PretravelMap(
        HarmonicBasis(terms), np.array([0.0101234567, 0.001, 0.0007, -0.0003, 0.002]),
        Covariance.none(5), mean_map(0.01).support, tip_radius=3.0, feed=47.1234567,
    )  # fmt: skip


def _pretravel(x: float, y: float, z: float) -> float:
    linear = math.sqrt(3.0) * (0.001 * y + 0.0007 * z - 0.0003 * x)
    return 0.0101234567 + linear + 0.002 * math.sqrt(35.0 / 8.0) * (x**3 - 3.0 * x * y**2)


class _AboutAxes(DirectionSupport):
    """Supports directions near the axes of the plane."""

    def distance(self, directions: Any) -> Any:
        return np.where(np.abs(np.asarray(directions)[:, :2]).max(axis=1) > 0.98, 0.0, 1.0)


class TestRadii:
    def test_every_number_by_hand(self) -> None:
        """Radii are 3 mm minus the pretravel of the opposite normal; eight decimals, both units;
        the worst side is named in nanometres, the calibration offset is the tip minus the mean."""
        found = axis_radii(_map())
        r = {}
        for name, way in TRAVELS.items():
            entry = found["travel"][name]
            r[name] = 3.0 - _pretravel(*(-np.array(way)))
            assert entry["normal"] == [-value or 0.0 for value in way]
            assert entry["radius_mm"] == round(entry["radius_mm"], 8)
            assert entry["radius_mm"] == pytest.approx(r[name], abs=6e-9)
            assert entry["radius_inch"] == pytest.approx(r[name] / 25.4, abs=6e-9)
            assert entry["diameter_mm"] == pytest.approx(2.0 * r[name], abs=6e-9)
            assert entry["diameter_inch"] == pytest.approx(2.0 * r[name] / 25.4, abs=6e-9)
            assert (entry["u_mm"], entry["u_inch"]) == (None, None)
        del r["z-"]
        mean = sum(r.values()) / 4.0
        worst = max(abs(radius - mean) for radius in r.values())
        across = found["diameter"]
        assert across["x"]["diameter_mm"] == pytest.approx(r["x+"] + r["x-"], abs=2e-8)
        assert across["y"]["diameter_mm"] == pytest.approx(r["y+"] + r["y-"], abs=2e-8)
        assert across["mean"]["diameter_mm"] == pytest.approx(2.0 * mean, abs=2e-8)
        told = across["mean"]["largest_error_of_a_side_um"]
        assert told == round(told, 3)
        assert told == pytest.approx(1e3 * worst, abs=6e-4)
        offset = found["calibration_offset"]
        assert offset["offset_mm"] == pytest.approx(3.0 - mean, abs=2e-8)
        assert found["tip_radius_mm"] == 3.0
        assert (found["format"], found["version"]) == ("pretravel radii", 1)
        for i, entry in enumerate(found["plane"]):
            angle = math.radians(15.0 * i)
            assert entry["travel_azimuth_deg"] == 15.0 * i
            radius = 3.0 - _pretravel(-math.cos(angle), -math.sin(angle), 0.0)
            assert entry["radius_mm"] == pytest.approx(radius, abs=6e-9)
        assert len(found["plane"]) == 24

    def test_what_is_typed_by_hand(self) -> None:
        found = axis_radii(_map())
        mean, typed = found["diameter"]["mean"]["diameter_mm"], found["what_to_type"]
        assert "Set the probing feed to 47.1235 mm/min (1.855 in/min)." in typed["NativeCAM"]
        assert f"{mean:.5f} mm ({mean / 25.4:.6f} in)" in typed["QtDragon, QtVCP"]
        # The error by the map alone is zero for a mean; the map's own is what it does not follow.
        assert "By the map (no U) a face square" in typed["NativeCAM"]
        known = axis_radii(replace(_map(), covariance=Covariance.full(4e-6 * np.eye(5))))
        u = max(known["travel"][way]["u_mm"] for way in ("x+", "x-", "y+", "y-"))
        assert f"(U = {2e3 * u:.2f} µm)" in known["what_to_type"]["NativeCAM"]
        offset = 3.0 - 0.5 * mean
        basic = typed["Probe Basic"]
        assert f"6.00000 mm, calibration offset: {offset:.5f} mm ({offset / 25.4:.6f} in)" in basic
        assert (
            "Set the probing feed" not in axis_radii(mean_map(0.01))["what_to_type"]["Probe Basic"]
        )

    def test_normals_have_no_negative_zero_and_nine_decimals(self) -> None:
        found = axis_radii(_map())
        for entry in (*found["travel"].values(), *found["plane"]):
            for value in entry["normal"]:
                assert value == round(value, 9)
                assert value != 0.0 or math.copysign(1.0, value) == 1.0

    def test_directions_of_the_plane_without_a_touch_are_null(self) -> None:
        """A map that holds about the four axes only, and not between them."""
        found = axis_radii(replace(_map(), support=_AboutAxes(np.eye(3)[:1])))
        radii = {entry["travel_azimuth_deg"]: entry["radius_mm"] for entry in found["plane"]}
        assert len(radii) == 24
        assert radii[45.0] is None
        assert radii[90.0] == found["travel"]["y+"]["radius_mm"]
        assert found["travel"]["z-"] is None

    def test_without_the_equator_refused(self) -> None:
        upper = DirectionSupport(np.array([[0.0, 0, 1], [0.1, 0, 0.995], [0, 0.1, 0.995]]))
        with pytest.raises(PretravelError, match="equator"):
            axis_radii(replace(lobes(1), support=upper))
        # The equator of a horizontal probe is touched; that of Z cannot be.
        lying = replace(_map(), rotation=probe_rotation((0.0, -1.0, 0.0)))
        for radii in (axis_radii, renishaw_variables):
            with pytest.raises(PretravelError, match="90° to Z"):
                radii(lying)

    def test_the_text_is_indented_json_without_escapes(self) -> None:
        text = axis_radii_text(_map())
        assert json.loads(text) == axis_radii(_map())
        assert text.startswith('{\n  "format": "pretravel radii",\n  "version": 1,\n')
        assert text.endswith("}\n")
        assert " µm." in text
        moved = axis_radii_text(_map(), 0.002)
        assert json.loads(moved) == axis_radii(_map(), 0.002)

    def test_uncertainties_contain_map_tip_and_delay_together(self) -> None:
        """The map has 3 µm, of which 1 µm is by the delay; 60 mm/min, 1 mm/s, and 4 ms of delay
        with u 0.5 ms, 0.5 µm, 3 µm that repeats do not reduce: sqrt(9 - 1 + (1 + 0.5)² + 2² + 3²).
        """
        made = replace(
            mean_map(0.01), covariance=Covariance.independent([8e-6]), delay=4e-3, u_delay=5e-4,
            delay_effect=np.array([1e-3]), u_tip_radius=2e-3, fixed_scatter=3e-3,
        )  # fmt: skip
        found = axis_radii(made, 4e-3)
        for entry in (*found["travel"].values(), *found["plane"]):
            assert entry["u_mm"] == pytest.approx(1e-3 * math.sqrt(8.0 + 1.5**2 + 13.0), abs=1e-8)
            assert entry["radius_mm"] == pytest.approx(3.0 - 0.014, abs=1e-8)
        assert found["feed_mm_min"] == 60.0

    @pytest.mark.parametrize(
        ("map_feed", "delay", "travel", "feed"),
        # 1 µm in 7 ms are 60 / 7 mm/min, with six decimals.
        [(None, 7e-3, 1e-3, 8.571429), (50.0, None, 0.0, 50.0), (None, None, 0.0, None)],
    )
    def test_the_feed(
        self, map_feed: float | None, delay: float | None, travel: float, feed: float | None
    ) -> None:
        made = replace(mean_map(0.01), feed=map_feed, delay=delay)
        assert axis_radii(made, travel)["feed_mm_min"] == feed


def test_the_command_takes_the_feed(tmp_path: Path) -> None:
    path, out = tmp_path / "rest.json", tmp_path / "radii.json"
    write_map(path, replace(mean_map(0.016), delay=0.01, u_delay=1e-4))
    assert "--feed" in run("export", path, "--to", "radii", "-o", out, code=2)
    said = run("export", path, "--to", "radii", "-o", tmp_path / "r.csv", "--feed", 60, code=2)
    assert "the ending must be .json" in said  # JSON in a table would be read as nothing
    said = run("export", path, "--to", "radii", "-o", out, "--feed", 60)
    found = json.loads(out.read_text())
    assert found["feed_mm_min"] == 60.0
    # 1 mm/s for 10 ms.
    assert found["travel"]["x+"]["radius_mm"] == pytest.approx(3.0 - 0.016 - 0.010, abs=6e-9)
    diameter = found["diameter"]["mean"]["diameter_mm"]
    assert f"QtDragon, QtVCP: Probe diameter: {diameter:.5f} mm" in said
    assert "60 mm/min" in said


def test_travels_are_those_that_probing_screens_name() -> None:
    """Unit vectors along the axes with the sign of their names; the probe is not pulled upwards."""
    assert set(TRAVELS) == {"x+", "x-", "y+", "y-", "z-"}
    for name, way in TRAVELS.items():
        expected = np.zeros(3)
        expected["xyz".index(name[0])] = 1.0 if name[1] == "+" else -1.0
        assert list(way) == expected.tolist(), name
