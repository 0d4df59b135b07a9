"""The part of pretravel that simpler corrections do not remove."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles, ring_pattern
from pretravel.base.errors import ExtrapolationError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.files.map_file import write_map
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.sector_tables import touched_sectors
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.comparison import (
    UNCORRECTED,
    _supported,
    compare_corrections,
)
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import both_outputs, rows, run
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
        # The file of the table says the same as the comparison.
        table = touched_sectors(lobes(3, phase=90 * DEGREE))
        assert left["eight sectors", "equator"].rms == table.rms
        # All directions contain the equator.
        for (method, where), row in left.items():
            assert left[method, "all"].largest >= row.largest, where

    @pytest.mark.parametrize("lobe", [0.0, 17.0, 119.0])
    def test_wozniak_finds_itself(self, lobe: float) -> None:
        """Every azimuth that is a whole number of degrees, up to that at which lobes repeat."""
        basis = WozniakBasis(lobe * DEGREE)
        own = PretravelMap(
            basis, np.array([0.004, 0.0, 0.0]), Covariance.none(3),
            DirectionSupport(ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24)), tip_radius=3.0,
            rotation=probe_rotation(rotation=25 * DEGREE),
        )  # fmt: skip
        left = {(r.method, r.where): r for r in compare_corrections(own).rows}
        assert left["Woźniak", "all"].largest < 1e-12
        assert left["eight sectors", "equator"].largest > 1e-4

    @pytest.mark.parametrize("level", [0.2, -0.05])
    def test_wozniak_s_lobes_are_fitted_by_least_squares(self, level: float) -> None:
        """No other azimuth and constant leave less, over all directions, of lobes of a harmonic;
        also where the level lies below zero, so that the constant is negative."""
        small = lobes(3, phase=50 * DEGREE)
        small = replace(small, coefficients=small.coefficients * [level, 1.0, 1.0])
        (left,) = (
            r.rms
            for r in compare_corrections(small).rows
            if (r.method, r.where) == ("Woźniak", "all")
        )
        n = _supported(small)
        truth = small.pretravel(n)
        for lobe in np.arange(0.5, 120.0, 5.0) * DEGREE:
            shape = WozniakBasis(float(lobe)).design(n)[:, :1]
            other = truth - shape @ np.linalg.lstsq(shape, truth, rcond=None)[0]
            # The search has steps of a degree; between them little is gained.
            assert left <= np.sqrt(np.mean(other**2)) * (1.0 + 1e-4), lobe

    def test_a_further_correction_is_compared_where_it_is_one(self) -> None:
        """0.25 mm too much on one half of the equator, an alarm on the other."""
        made = lobes(3)

        def half(normals: FloatArray) -> FloatArray:
            late = made.pretravel(normals) + 0.25
            return np.where(normals[:, 0] > 1e-6, late, np.nan)

        found = compare_corrections(made, [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], {"control": half})
        left = {r.where: r for r in found.rows if r.method == "control"}
        assert [row.method for row in found.rows][-4:-3] == ["control"]
        assert (left["equator"].largest, left["equator"].rms) == pytest.approx((0.25, 0.25))
        assert (left["equator"].count, left["part"].count) == (179, 1)
        nothing = compare_corrections(made, others={"alarm": lambda n: np.full(len(n), np.nan)})
        (row,) = (r for r in nothing.rows if (r.method, r.where) == ("alarm", "equator"))
        assert (row.count, row.largest) == (0, 0.0)

    def test_between_axis_and_plane_radii_are_interpolated_by_the_normal(self) -> None:
        """Pretravel 10 mm and 1 mm of lobes on the equator, 10 mm along the axis; at 30° above the
        plane, half of the way. A map without the axis has the radii of the plane above it too."""
        way = np.array([44.0, 46.0, 134.0, 136.0, 224.0, 226.0, 314.0, 316.0])
        for rings, polar, share in (([0, 30, 60, 90], 60.0, 0.5), ([90], 87.0, 1.0)):
            n = from_angles(polar * DEGREE, way * DEGREE)
            held_along = DirectionSupport(ring_pattern(np.array(rings) * DEGREE, 24))
            made = replace(lobes(3, phase=20 * DEGREE), support=held_along)
            truth = 10.0 + np.sin(polar * DEGREE) ** 3 * np.cos(3.0 * way * DEGREE - 20.0 * DEGREE)
            held = 10.0 + np.cos(np.array([0.0, 270.0, 180.0, 90.0]) * DEGREE - 20.0 * DEGREE)
            nearest = held[np.array([0, 1, 1, 2, 2, 3, 3, 0])]
            both = 0.5 * (held[:2] + held[2:])[np.array([0, 1, 1, 0, 0, 1, 1, 0])]
            part = {r.method: r for r in compare_corrections(made, n).rows if r.where == "part"}
            for method, across in (
                ("four directions", nearest), ("two axis radii", both), ("mean radius", 10.0),
            ):  # fmt: skip
                left = 10.0 + share * (across - 10.0) - truth
                assert part[method].largest == pytest.approx(np.abs(left).max(), abs=1e-9), method
                rms = np.sqrt(np.mean(left**2))
                assert part[method].rms == pytest.approx(rms, abs=1e-9), method
                assert part[method].count == 8

    def test_all_directions_turn_with_the_probe(self) -> None:
        """Of a probe tilted by 8°, which is more than the margin of the map."""
        flat = replace(lobes(3), covariance=Covariance.independent([9.0, 0.0, 0.0]))
        mean_of_one = HarmonicBasis(np.array([[0, 0]])).design(np.eye(3)[2:])[0, 0]
        found = compare_corrections(flat)
        assert found.u_map == pytest.approx(3.0 * mean_of_one)
        assert compare_corrections(lobes(3)).u_map == 0.0
        assert np.array_equal(found.azimuth_deg, np.arange(360.0))
        azimuth = np.arange(360.0) * DEGREE
        assert found.curves[UNCORRECTED] == pytest.approx(-10.0 - np.cos(3.0 * azimuth))
        assert found.curves["mean radius"] == pytest.approx(-np.cos(3.0 * azimuth))
        counts = {(r.method, r.where): r.count for r in found.rows}
        assert counts["full map", "equator"] == 360
        tilted = replace(flat, rotation=probe_rotation(from_angles(8.0 * DEGREE, 0.0)[0]))
        normals = _supported(tilted)
        assert counts["full map", "all"] == len(normals)
        assert tilted.supports(normals).all()
        assert not tilted.supports(normals @ np.diag([-1.0, 1.0, 1.0])).all()

    def test_a_map_that_does_not_hold_on_the_equator(self) -> None:
        cap = PretravelMap(
            HarmonicBasis(np.array([[0, 0]])), np.array([0.01]), Covariance.none(1),
            DirectionSupport(ring_pattern(np.array([0, 30, 60]) * DEGREE, 24)), tip_radius=3.0,
        )  # fmt: skip
        with pytest.raises(ExtrapolationError):
            compare_corrections(cap)

    def test_extremes_and_u_are_those_of_a_qualification(self) -> None:
        """Of a map with cusps, whose largest value lies between whole degrees of azimuth."""
        pretravel_map = example_map("physical")
        _, value, u = pretravel_map.over_support()
        result = compare_corrections(pretravel_map)
        (alone,) = (r for r in result.rows if (r.method, r.where) == (UNCORRECTED, "all"))
        assert alone.largest == pytest.approx(np.abs(value).max(), rel=1e-9)
        # All around the equator u may be larger than over the touched directions; here it is not.
        assert result.largest_u("all") == pytest.approx(u.max(), rel=1e-12)
        assert result.u_map == pytest.approx(float(np.sqrt(np.mean(u**2))), rel=1e-12)

    def test_command_and_its_picture(self, tmp_path: Path) -> None:
        small = lobes(3, phase=90 * DEGREE)
        small = replace(small, coefficients=1e-3 * small.coefficients, tip_radius=3.0)
        write_map(tmp_path / "map.json", small)
        part = EXAMPLES / "part_touches.csv"
        told = run("compare", tmp_path / "map.json", "--part", part, "-o", tmp_path / "c.csv",
                   "--plot", tmp_path / "c.png")  # fmt: skip
        assert "part: max" in told
        # The map left "full map 0.00" of itself: what it leaves is its u, of this one unknown.
        assert re.search(r"^u of the map \(max: 2 × the largest u\) *$", told, re.MULTILINE)
        write_map(tmp_path / "known.json", example_map())
        known = run("compare", tmp_path / "known.json")
        # A mean that is not known, and odd lobes that means have not, are in no error and no file.
        wide = replace(example_map(), u_tip_radius=0.025)
        wide = replace(wide, provenance=replace(wide.provenance, orientation="reversal"))
        write_map(tmp_path / "wide.json", wide)
        for command in (("compare",), ("export", "--to", "csv", "-o", tmp_path / "e.csv")):
            warned = both_outputs(*command, tmp_path / "wide.json")[1]
            assert "u = 25 µm" in warned
            assert "odd lobes" in warned
        numbers = r"\) +[1-9]\.\d\d +0\.[1-9]\d"
        assert re.search(r"^u of the map \(max: 2 × the largest u" + numbers, known, re.MULTILINE)
        assert "one radius, mean around the equator" in told
        table = rows(tmp_path / "c.csv")
        assert {row["where"] for row in table} == {"equator", "all", "part"}
        full = [float(row["largest_um"]) for row in table if row["method"] == "full map"]
        assert full == [0.0, 0.0, 0.0]
        # Three lobes of 1 µm, which one radius leaves as they are; their mean square is a half.
        (left,) = (r for r in table if r["method"] == "mean radius" and r["where"] == "equator")
        assert float(left["largest_um"]) == pytest.approx(1.0, rel=1e-8)
        assert float(left["rms_um"]) == pytest.approx(np.sqrt(0.5), rel=1e-8)
        assert coloured_share(tmp_path / "c.png") > 0.001
