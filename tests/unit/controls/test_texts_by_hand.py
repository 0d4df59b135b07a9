"""Numbers and texts of files for controls: their form, their limits, what they are told."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls import heidenhain
from pretravel.controls.axis_radii import axis_radii, axis_radii_text
from pretravel.controls.control_table import (
    TableSettings,
    control_table,
    feed_statement,
    map_statement,
    table_identity,
)
from pretravel.controls.exports import ExportSettings, table_travel
from pretravel.controls.gcode import coordinate, exact
from pretravel.controls.haas import haas_macro
from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.linuxcnc_cycles import sphere_subroutines
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup import Band
from pretravel.controls.lookup_formula import LookupSeries
from pretravel.controls.lookup_table import LookupTable
from pretravel.controls.macro_b import fanuc_macro, free_variables, renishaw_variables
from pretravel.controls.map_identity import check_map_of_program, map_identity
from pretravel.controls.program_log import FAULTS
from pretravel.controls.siemens import siemens_cycle
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import mean_map
from tests.support.siemens_interpreter import SiemensAlarm, SiemensControl

TABLE = LookupTable(
    Band(0.0, 60.0 * DEGREE), 0.01 + 1e-4 * np.arange(24.0).reshape(4, 6), largest_error=3e-4
)
MEAN = LookupSeries(np.full((1, 1), 0.016), np.zeros((1, 1)), Band(0.0, 1.0))


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

    def interpolation(self, directions: Any) -> Any:
        far = np.where(np.abs(np.asarray(directions)[:, :2]).max(axis=1) > 0.98, 0.0, 1.0)
        return np.zeros((len(far), 3), dtype=np.int64), np.full((len(far), 3), 1.0 / 3.0), far

    def supports(self, directions: Any, margin: float = 0.0) -> Any:
        return self.interpolation(directions)[2] <= margin


class TestRadii:
    def test_every_number_by_hand(self) -> None:
        """Radii are 3 mm minus the pretravel of the opposite normal; eight decimals, both units;
        the worst side is named in nanometres, the calibration offset is the tip minus the mean."""
        made = _map()
        found = axis_radii(made)
        r = {
            "x+": 3.0 - _pretravel(-1, 0, 0), "x-": 3.0 - _pretravel(1, 0, 0),
            "y+": 3.0 - _pretravel(0, -1, 0), "y-": 3.0 - _pretravel(0, 1, 0),
        }  # fmt: skip
        for name, radius in (*r.items(), ("z-", 3.0 - _pretravel(0, 0, 1))):
            entry = found["travel"][name]
            assert entry["radius_mm"] == round(entry["radius_mm"], 8)
            assert entry["radius_mm"] == pytest.approx(radius, abs=6e-9)
            assert entry["diameter_mm"] == pytest.approx(2.0 * radius, abs=6e-9)
            assert entry["diameter_inch"] == pytest.approx(2.0 * radius / 25.4, abs=6e-9)
            assert (entry["u_mm"], entry["u_inch"]) == (None, None)
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

    def test_what_is_typed_by_hand(self) -> None:
        found = axis_radii(_map())
        mean, typed = found["diameter"]["mean"]["diameter_mm"], found["what_to_type"]
        assert "Set the probing feed to 47.1235 mm/min (1.855 in/min)." in typed["NativeCAM"]
        assert f"{mean:.5f} mm ({mean / 25.4:.6f} in)" in typed["QtDragon, QtVCP"]
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

    def test_the_text_is_indented_json_without_escapes(self) -> None:
        text = axis_radii_text(_map())
        assert json.loads(text) == axis_radii(_map())
        assert text.startswith('{\n  "format": "pretravel radii",\n  "version": 1,\n')
        assert text.endswith("}\n")
        assert " µm." in text
        moved = axis_radii_text(_map(), 0.002)
        assert json.loads(moved) == axis_radii(_map(), 0.002)

    def test_feeds_have_six_decimals(self) -> None:
        """1 µm in 7 ms are 60 / 7 mm/min."""
        at_rest = replace(_map(), feed=None, delay=7e-3, u_delay=1e-4)
        assert axis_radii(at_rest, 1e-3)["feed_mm_min"] == 8.571429


class TestNumbers:
    @pytest.mark.parametrize("sign", [-1.0, 1.0])
    @pytest.mark.parametrize(
        "value",
        [0.0, 0.25, 100.0, 123456789.0, 1 / 3, 2e-5 / 3, 2e-9 / 3, 2e-11 / 3, 2e-13 / 3, 2e-16 / 3],
    )
    def test_all_digits_and_no_exponent(self, value: float, sign: float) -> None:
        """Down to 1e-16 to twelve digits; whole numbers have no point."""
        text = exact(sign * value)
        assert re.fullmatch(r"-?\d+(\.\d*[1-9])?", text)
        assert float(text) == pytest.approx(sign * value, rel=1.01e-12, abs=0.0)
        if value == 0.0:
            assert text == "0"

    def test_coordinates_have_nine_decimals_and_no_point_at_the_end(self) -> None:
        values = {-0.0: "0", 4e-10: "0", -6e-10: "-0.000000001", 100.0: "100", 0.5: "0.5"}
        assert {value: coordinate(value) for value in values} == values

    def test_identities_of_tables_have_six_digits(self) -> None:
        numbers = {table_identity(["0.01", f"0.{i:03d}"]) for i in range(60)}
        assert len(numbers) == 60
        assert all(100_000 <= number < 1_000_000 for number in numbers)
        assert table_identity(["1.0", "2.0"]) != table_identity(["2.0", "1.0"])

    def test_defaults_of_an_export(self) -> None:
        """0.02 µm of tolerance, no travel; a feed where, and only where, the map has a delay."""
        assert ExportSettings().largest_deviation == pytest.approx(2e-5)
        assert ExportSettings().travel == 0.0
        assert TableSettings().travel == 0.0
        with pytest.raises(PretravelError, match="contains none"):
            table_travel(mean_map(0.01), 60.0)
        with pytest.raises(PretravelError, match=r"4\.000 ms; a table holds for one feed"):
            table_travel(replace(mean_map(0.01), delay=4e-3), None)

    def test_feeds_just_within_two_percent_of_that_of_the_map(self) -> None:
        made = replace(mean_map(0.01), feed=50.0)
        check_map_of_program(made, 3.0, np.array([51.0, 49.0]))


class TestHeads:
    def test_the_feed_of_a_table(self) -> None:
        made = mean_map(0.01)
        delayed = replace(made, delay=4e-3)
        told = {
            feed_statement(made, TableSettings()): "the map states no feed",
            feed_statement(replace(made, feed=55.0), TableSettings()): "made at 55 mm/min",
            feed_statement(delayed, TableSettings(feed=70.0)): "delay at 70 mm/min",
            feed_statement(delayed, TableSettings()): "delay at one feed",
        }
        for text, words in told.items():
            assert words in text
        assert len(told) == 4

    def test_the_source_of_a_map_stands_as_it_is(self) -> None:
        """Signs that a control reads are replaced; nothing is written as a web page would."""
        made = replace(mean_map(0.01), provenance=Provenance(source='5 mm Bob\'s & <x> "y"'))
        assert map_statement(made).endswith('of kind mean - 5 mm Bob\'s & <x> "y"')
        assert map_statement(mean_map(0.01)).endswith("of kind mean")
        for files in (siemens_cycle(made, TABLE), linuxcnc_subroutines(made, MEAN)):
            for text in files.values():
                assert not re.search(r"&\w+;|&#", text)
        unchecked = "".join(linuxcnc_subroutines(made, MEAN).values())
        assert "Bob_s" in unchecked or "Bob's" in unchecked

    @pytest.mark.parametrize("made_for", ["fanuc", "haas", "siemens", "linuxcnc"])
    def test_files_have_no_blanks_around_lines_and_end_with_a_line(self, made_for: str) -> None:
        makers = {"fanuc": fanuc_macro, "haas": haas_macro, "siemens": siemens_cycle}
        if made_for == "linuxcnc":
            files = linuxcnc_subroutines(mean_map(0.01), TABLE)
        else:
            files = makers[made_for](mean_map(0.01), TABLE)
        for text in files.values():
            assert text.endswith("\n")
            assert not re.search(r"^[ \t]|[ \t]$|\n\n\n", text, re.M)

    def test_the_subroutines_of_a_map(self) -> None:
        """Those of the cycles and of the sphere are among them; a table only where it is needed,
        from parameter 1050 on, or from the one that is chosen."""
        cycles = {
            f"pretravel_{name}.ngc"
            for name in ("bore", "boss", "pocket", "web", "edge", "surface", "angle", "corner")
        }
        own = {f"pretravel_{name}.ngc" for name in
               ("lookup", "compensate", "identity", "radius", "point", "head")}  # fmt: skip
        others = {
            f"pretravel_{name}.ngc"
            for name in ("sphere", "move", "touch", "keep", "restore", "log_check")
        }
        formula = linuxcnc_subroutines(mean_map(0.01), MEAN)
        assert set(formula) == cycles | own | others
        assert set(sphere_subroutines()) == others
        table = linuxcnc_subroutines(mean_map(0.01), TABLE)
        assert set(table) == set(formula) | {"pretravel_table.ngc"}
        for base, files in (
            (1050, table), (2000, linuxcnc_subroutines(mean_map(0.01), TABLE, base=2000)),
        ):  # fmt: skip
            used = [int(n) for n in re.findall(r"^#(\d+) =", files["pretravel_table.ngc"], re.M)]
            assert (min(used), max(used)) == (base, base + 24)
        assert all(len(line) <= 250 for text in table.values() for line in text.splitlines())
        with pytest.raises(PretravelError, match="too long for the control"):
            linuxcnc_subroutines(mean_map(0.01), MEAN, written="x" * 250)

    def test_a_macro_names_its_variables_and_its_call(self) -> None:
        text = renishaw_variables(mean_map(0.01), TableSettings(10000))
        assert "(SETS #10000 TO #10017," in text
        assert "#10002 AND #10003" in text
        numbers = [int(n) for n in re.findall(r"^#(\d+)=", text, re.M)]
        assert numbers == [10000, 10001, *range(10010, 10018)]
        assert renishaw_variables(mean_map(0.01)).splitlines()[1].startswith("O7799 ")
        for number, first in ((None, 7750), (8123, 8123)):
            files = haas_macro(mean_map(0.01), TABLE, TableSettings(program=number))
            assert list(files) == [f"O0{first}.nc", f"O0{first + 1}.nc"]
            assert f"(CALL G65 P{first + 1} I1." in files[f"O0{first + 1}.nc"]
            assert "IN #10200 TO #10224)" in files[f"O0{first + 1}.nc"]

    def test_pretravel_and_travel_are_together_smaller_than_the_tip(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """0.01 + 2.985 mm are, 0.01 + 2.995 mm are not smaller than 3 mm."""
        monkeypatch.setattr(heidenhain, "supported_band", lambda made: Band(0.0, 1.0))
        made = mean_map(0.01)
        form = LookupTable(Band(0.0, 1.0), np.full((4, 6), 0.01))
        fits, beyond = TableSettings(travel=2.985), TableSettings(travel=2.995)
        assert renishaw_variables(made, fits)
        assert control_table(made, form, fits)
        assert heidenhain_table(made, travel=2.985)
        for refused in (
            lambda: renishaw_variables(made, beyond),
            lambda: control_table(made, form, beyond),
            lambda: heidenhain_table(made, travel=2.995),
        ):
            with pytest.raises(PretravelError, match="not smaller than the tip radius"):
                refused()

    def test_unknown_angles_of_vector_radii(self) -> None:
        with pytest.raises(PretravelError, match="angles 'steps': they are normals or travel"):
            renishaw_variables(mean_map(0.01), angles="steps")

    def test_the_ends_of_a_range_belong_to_it(self) -> None:
        for base, room in ((5, 3), (7, 1), (20, 11), (30, 1)):
            assert free_variables(((5, 7), (20, 30)), base) == room
        for base in (4, 8, 19, 31):
            with pytest.raises(PretravelError, match="#5 to #7, #20 to #30"):
                free_variables(((5, 7), (20, 30)), base)


@pytest.mark.parametrize(("units", "allowed"), [("mm", (2, 4)), ("inch", (1, 3))])
def test_siemens_runs_in_the_unit_of_the_table_only(units: str, allowed: tuple[int, int]) -> None:
    """The 13th group of G functions: 1 is G70, 2 G71, 3 G700, 4 G710; inch are the odd ones."""
    texts = siemens_cycle(mean_map(0.01), TABLE, TableSettings(units=units))
    control = SiemensControl()
    control.define(texts["PRETRAVEL_GUD.DEF"])
    control.load(texts["PRETRAVEL_TABLE.SPF"])
    control.load(texts["PRETRAVEL.SPF"])
    control.run("PRETRAVEL_TABLE")
    for group in (1, 2, 3, 4):
        control.group13 = group
        if group in allowed:
            control.run("PRETRAVEL", 0.0, 0.0, 1.0)
        else:
            with pytest.raises(SiemensAlarm, match="65001"):
                control.run("PRETRAVEL", 0.0, 0.0, 1.0)


class TestHeidenhain:
    TEMPLATE = "{title} {residual_um:.3f} {where}\n{number} {angle_deg:g} {deviation_mm:.6f}"

    def test_rows_are_the_steps_within_the_band(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """From 12 to 104 degrees: each row has the mean of its own circle; the map is asked
        outside of its support too, where the band's edge may lie."""
        band = Band(12.0 * DEGREE, 104.0 * DEGREE)
        monkeypatch.setattr(heidenhain, "supported_band", lambda made: band)
        made = replace(_map(), rotation=probe_rotation((0.6, 0.0, 0.8), 0.2))
        lines = heidenhain_table(made, self.TEMPLATE, step_deg=20.0, travel=0.001).splitlines()
        assert lines[0].startswith("pretravel ")
        for number, polar in enumerate((20.0, 40.0, 60.0, 80.0, 100.0)):
            value = 0.0111234567 + math.sqrt(3.0) * 0.0007 * math.cos(polar * DEGREE)
            assert lines[1 + number] == f"{number} {polar:g} {-value:.6f}"
        assert len(lines) == 6
        # All around, the part that depends on the azimuth is largest at 80° or 100°.
        a = np.arange(0.0, 360.0, 5.0) * DEGREE
        rest = max(
            np.abs(
                math.sqrt(3.0) * math.sin(p) * (0.001 * np.sin(a) - 0.0003 * np.cos(a))
                + 0.002 * math.sqrt(35.0 / 8.0) * math.sin(p) ** 3 * np.cos(3.0 * a)
            ).max()
            for p in (80.0 * DEGREE, 100.0 * DEGREE)
        )
        assert lines[0] == f"pretravel {1e3 * rest:.3f} the mean over the azimuth"

    def test_steps_below_a_degree_and_of_five(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(heidenhain, "supported_band", lambda made: Band(0.0, 10.1 * DEGREE))
        assert len(heidenhain_table(mean_map(0.01), "{angle_deg}", step_deg=0.5).split()) == 21
        angles = heidenhain_table(mean_map(0.01), "{angle_deg:g}").split()
        assert angles == ["0", "5", "10"]

    def test_the_line_of_an_error_is_counted_from_one(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(heidenhain, "supported_band", lambda made: Band(0.0, 1.0))
        with pytest.raises(PretravelError, match="template, line 3: "):
            heidenhain_table(mean_map(0.01), "a\n{angle_deg}\n{number:d} {title:d}")


def test_numbers_of_maps_have_nine_digits() -> None:
    numbers = {map_identity(replace(mean_map(0.01), tip_radius=2.0 + i)).number for i in range(9)}
    assert len(numbers) == 9
    assert all(100_000_000 <= number < 1_000_000_000 for number in numbers)


def test_causes_of_a_stop_are_numbered_from_one() -> None:
    """As the subroutines number them: 1 is a miss, which a program can allow."""
    text = sphere_subroutines()["pretravel_sphere.ngc"]
    told = re.findall(r"#<_pretravel_fault> EQ (\d)\]\n\(ABORT,.*cause (\d), (.*)\)", text)
    assert [(int(a), int(b), words) for a, b, words in told] == [
        (number, number, words) for number, words in enumerate(FAULTS, start=1)
    ]
    assert FAULTS[:2] == ("no contact", "contact too early")
