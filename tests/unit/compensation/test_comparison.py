"""The part of pretravel that simpler corrections do not remove."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.compensation.comparison import UNCORRECTED, compare_corrections
from pretravel.directions import ring_pattern
from pretravel.errors import ExtrapolationError
from pretravel.formats.map_file import write_map
from pretravel.frames import probe_rotation
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from pretravel.units import DEGREE
from tests.support.commands import rows, run
from tests.support.example_maps import example_map, lobes
from tests.support.examples import EXAMPLES
from tests.support.pictures import coloured_share


class TestComparison:
    def test_three_lobes_in_closed_form(self) -> None:
        result = compare_corrections(lobes(3, phase=90 * DEGREE))
        left = {(row.method, row.where): row for row in result.rows}
        # One radius does not remove the lobes; their mean square over the azimuth is a half.
        assert left["mean radius", "equator"].largest == pytest.approx(1.0)
        assert left["mean radius", "equator"].rms == pytest.approx(np.sqrt(0.5), abs=1e-9)
        assert left["eight sectors", "equator"].largest == pytest.approx(1.0)
        assert left["four directions", "equator"].rms > left["eight sectors", "equator"].rms
        assert left["full map", "all"].largest == 0.0

    def test_all_directions_contain_the_equator(self) -> None:
        found = compare_corrections(lobes(3, phase=90 * DEGREE)).rows
        left = {(row.method, row.where): row.largest for row in found}
        for (method, where), largest in left.items():
            assert left[method, "all"] >= largest, where

    def test_touched_directions_are_right_where_they_were_touched(self) -> None:
        """Four radii along x and y; two, each the mean of both ways; one, the mean of all."""
        three = lobes(3, phase=20 * DEGREE)
        way = np.array([0.0, 90.0, 180.0, 270.0]) * DEGREE
        normals = np.column_stack([np.cos(way), np.sin(way), 0.0 * way])
        value = 10.0 + np.cos(3.0 * way - 20 * DEGREE)
        part = {r.method: r for r in compare_corrections(three, normals).rows if r.where == "part"}
        assert part["four directions"].largest == pytest.approx(0.0, abs=1e-9)
        half = 0.5 * (value[:2] - value[2:])
        assert part["two axis radii"].largest == pytest.approx(np.abs(half).max(), rel=1e-9)
        assert part["two axis radii"].rms == pytest.approx(np.sqrt(np.mean(half**2)), rel=1e-9)
        assert part["mean radius"].largest == pytest.approx(np.abs(value - 10.0).max(), rel=1e-9)
        assert part["full map"].largest == pytest.approx(0.0, abs=1e-12)
        assert part[UNCORRECTED].largest == pytest.approx(value.max(), rel=1e-9)

    def test_wozniak_finds_itself(self) -> None:
        basis = WozniakBasis(17 * DEGREE)
        own = PretravelMap(
            basis, np.array([0.004, 0.0, 0.0]), Covariance.none(3),
            DirectionSupport(ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24)), tip_radius=3.0,
            rotation=probe_rotation(rotation=25 * DEGREE),
        )  # fmt: skip
        left = {(r.method, r.where): r for r in compare_corrections(own).rows}
        assert left["Woźniak", "all"].largest < 1e-12
        assert left["eight sectors", "equator"].largest > 1e-4

    def test_along_the_axis_controls_have_their_length(self) -> None:
        up = np.array([[0.0, 0.0, 1.0]])
        result = compare_corrections(example_map(), up)
        part = {row.method: row.largest for row in result.rows if row.where == "part"}
        assert part["mean radius"] == pytest.approx(0.0, abs=1e-12)

    def test_a_map_that_does_not_hold_on_the_equator(self) -> None:
        cap = PretravelMap(
            HarmonicBasis(np.array([[0, 0]])), np.array([0.01]), Covariance.none(1),
            DirectionSupport(ring_pattern(np.array([0, 30, 60]) * DEGREE, 24)), tip_radius=3.0,
        )  # fmt: skip
        with pytest.raises(ExtrapolationError):
            compare_corrections(cap)

    def test_command_and_its_picture(self, tmp_path: Path) -> None:
        small = lobes(3, phase=90 * DEGREE)
        small = replace(small, coefficients=1e-3 * small.coefficients, tip_radius=3.0)
        write_map(tmp_path / "map.nc", small)
        part = EXAMPLES / "part_touches.csv"
        for ending in ("csv", "json", "html"):
            told = run("compare", tmp_path / "map.nc", "--part", part, "-o",
                       tmp_path / f"c.{ending}", "--plot", tmp_path / "c.png")  # fmt: skip
        assert "on the part: max" in told
        table = rows(tmp_path / "c.csv")
        assert {row["where"] for row in table} == {"equator", "all", "part"}
        full = [float(row["largest_um"]) for row in table if row["method"] == "full map"]
        assert full == [0.0, 0.0, 0.0]
        # Three lobes of 1 µm, which one radius leaves as they are; their mean square is a half.
        (left,) = (r for r in table if r["method"] == "mean radius" and r["where"] == "equator")
        assert float(left["largest_um"]) == pytest.approx(1.0, rel=1e-8)
        assert float(left["rms_um"]) == pytest.approx(np.sqrt(0.5), rel=1e-8)
        assert coloured_share(tmp_path / "c.png") > 0.001
