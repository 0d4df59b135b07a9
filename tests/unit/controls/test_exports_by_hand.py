"""What each control is given, and the numbers of tables at their limits, by hand."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import from_angles, ring_pattern
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls import exports, heidenhain
from pretravel.controls.axis_radii import axis_radii
from pretravel.controls.control_table import TableSettings, check_radii, control_table
from pretravel.controls.exports import (
    CONTROLS,
    ExportedFiles,
    ExportSettings,
    correction_on_control,
    table_travel,
)
from pretravel.controls.gcode import plain_number
from pretravel.controls.haas import HAAS
from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.lookup import Band, supported_band
from pretravel.controls.lookup_formula import LookupSeries
from pretravel.controls.lookup_table import LookupTable
from pretravel.controls.macro_b import FANUC, fanuc_macro, renishaw_variables
from pretravel.controls.map_identity import check_map_of_program, map_identity
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import mean_map

AROUND = DirectionSupport(ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24))


def _wozniak() -> PretravelMap:
    """A map without a formula for a control."""
    return PretravelMap(
        WozniakBasis(0.3), np.array([0.008, 0.0, 0.001]), Covariance.none(3), AROUND, tip_radius=3.0
    )


def _exported(
    monkeypatch: pytest.MonkeyPatch, control: str, **settings: object
) -> tuple[ExportedFiles, dict[str, float]]:
    """Files with a small table of an error of 0.5 µm, and what was asked for to make it."""
    asked: dict[str, float] = {}

    def made(of: PretravelMap, **wanted: float) -> LookupTable:
        assert of.kind == "wozniak"
        asked.update(wanted)
        return replace(_values(Band(0.0, 60.0 * DEGREE), 2, 6), largest_error=5e-4)

    monkeypatch.setattr(exports, "lookup_table", made)
    chosen = ExportSettings(**settings)  # type: ignore[arg-type]
    return CONTROLS[control].files(_wozniak(), chosen), asked


def _values(form: Band, rows: int, columns: int) -> LookupTable:
    values = 0.01 + 1e-4 * np.arange(float((rows + 2) * columns)).reshape(rows + 2, columns)
    return LookupTable(form, values)


class TestControls:
    def test_what_each_control_needs_and_uses(self) -> None:
        """A folder where there are several programs; LinuxCNC subtracts the delay travel itself;
        options that would change nothing are refused by the command."""
        tables = {"units", "tolerance"}
        expected = {
            "linuxcnc": (True, True, {"base", "form", "tolerance", "tool"}),
            "renishaw": (False, False, {"base", "program", "units", "angles", "criterion"}),
            "fanuc": (True, False, tables | {"base", "program", "form"}),
            "haas": (True, False, tables | {"base", "program", "form"}),
            "siemens": (True, False, tables | {"form"}),
            "heidenhain": (False, False, {"template", "azimuth"}),
            "radii": (False, False, set()),
        }
        found = {k: (c.folder, c.uses_feed, set(c.options)) for k, c in CONTROLS.items()}
        assert found == expected

    @pytest.mark.parametrize(
        ("name", "base", "most"),
        [
            # Of each range of variables one contains the number of the table.
            ("fanuc", None, 399), ("fanuc", 800, 199), ("fanuc", 500, 399), ("haas", None, 299),
            ("haas", 10800, 199), ("siemens", None, 800), ("linuxcnc", None, 1900),
            ("linuxcnc", 4000, 1000),
        ],
    )  # fmt: skip
    def test_a_table_has_the_variables_that_are_free(
        self, name: str, base: int | None, most: int, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        files, asked = _exported(monkeypatch, name, base=base, tolerance=5e-4)
        assert asked == {"tolerance": 5e-4, "most_values": most}
        assert files.warnings == ()
        assert files.obsolete == ()
        assert len(files.texts) > 1
        assert "against the map 0.500 um" in " ".join(files.remarks).lower()
        coarse, asked = _exported(monkeypatch, name, base=base, tolerance=4e-4)
        assert asked["tolerance"] == 4e-4
        (warned,) = coarse.warnings
        assert "by up to 0.500 µm, more than the tolerance of 0.4 µm" in warned

    @pytest.mark.parametrize("name", ["fanuc", "haas", "siemens"])
    def test_a_table_is_written_where_it_is_fine_enough(
        self, name: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The limit is half of the map's u, or the tolerance that is stated."""
        made = replace(mean_map(0.016), covariance=Covariance.independent([0.4e-3**2]))
        table = replace(_values(Band(0.0, 1.0), 4, 12))
        for error, stated, form, expected in (
            (0.19e-3, None, "auto", True), (0.21e-3, None, "auto", False),
            (0.21e-3, None, "table", True), (0.19e-3, None, "formula", False),
            (0.19e-3, 0.18e-3, "auto", False), (0.30e-3, 0.31e-3, "auto", True),
        ):  # fmt: skip
            off = replace(table, largest_error=error)
            monkeypatch.setattr(exports, "lookup_table", lambda *_, off=off, **__: off)
            files = CONTROLS[name].files(made, ExportSettings(tolerance=stated, form=form))
            assert isinstance(files.form, LookupTable) is expected, (error, stated, form)
            assert (len(files.texts) == {"siemens": 3}.get(name, 2)) is expected

    def test_what_a_control_takes_off(self) -> None:
        """A formula as the map; nothing where the control has an alarm; radii are refused."""
        made = replace(mean_map(0.016), rotation=probe_rotation([0.0, 1.0, 0.0]))
        form = CONTROLS["haas"].files(made, ExportSettings(form="formula")).form
        assert form is not None
        name, correction = correction_on_control(made, "haas", ExportSettings(form="formula"))
        assert name == "haas, formula"
        polar = np.array([0.5 * form.band.highest, form.band.highest + 0.01, 3.0])
        found = correction(from_angles(polar, 1.0) @ made.rotation.T)
        assert found == pytest.approx([0.016, np.nan, np.nan], nan_ok=True)
        name, _ = correction_on_control(made, "siemens", ExportSettings(form="table"))
        assert name.startswith("siemens, table of ")
        for control, words in (("renishaw", "contain radii"), ("radii", "radii"), ("x", "known")):
            with pytest.raises(PretravelError, match=words):
                correction_on_control(mean_map(0.016), control, ExportSettings())

    def test_a_formula_replaces_the_table_of_an_earlier_export(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        mean = LookupSeries(np.full((1, 1), 0.016), np.zeros((1, 1)), Band(0.0, 1.0))
        table, _ = _exported(monkeypatch, "linuxcnc", written="2026-01-02")
        monkeypatch.setattr(exports, "exact_lookup", lambda made: mean)
        made = mean_map(0.016)
        files = CONTROLS["linuxcnc"].files(made, ExportSettings(written="2026-01-02"))
        assert files.obsolete == ("pretravel_table.ngc",)
        assert "pretravel_table.ngc" not in files.texts
        assert files.warnings == ()
        assert "2026-01-02" in "".join(files.texts.values())
        (remark,) = files.remarks
        assert remark == "harmonic series of 1 terms; largest error against the map 0.000 um"
        again, _ = _exported(monkeypatch, "linuxcnc", written="2026-01-02", form="table")
        assert again.texts == table.texts
        assert re.search(r"^#1050 =", table.texts["pretravel_table.ngc"], re.M)
        assert not re.search(r"^#10[0-4]\d =", table.texts["pretravel_table.ngc"], re.M)
        assert "2026-01-02" in "".join(table.texts.values())
        moved, _ = _exported(monkeypatch, "linuxcnc", base=2000, form="table")
        assert "#2000 =" in moved.texts["pretravel_table.ngc"]
        assert "#1050 =" not in moved.texts["pretravel_table.ngc"]
        formula, _ = _exported(monkeypatch, "linuxcnc", form="formula")
        assert formula.texts.keys() == files.texts.keys()
        monkeypatch.setattr(exports, "exact_lookup", lambda made: None)
        with pytest.raises(PretravelError, match="kind wozniak has no formula for a control"):
            _exported(monkeypatch, "linuxcnc", form="formula")

    @pytest.mark.parametrize(
        ("base", "refused"), [(30, True), (31, False), (4499, False), (4500, True)]
    )
    def test_first_parameters_of_linuxcnc(
        self, base: int, refused: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """31 to 5000 belong to users; 500 must remain for a table."""
        if refused:
            with pytest.raises(PretravelError, match=f"first variable {base}: the parameters"):
                _exported(monkeypatch, "linuxcnc", base=base)
        else:
            assert _exported(monkeypatch, "linuxcnc", base=base)[0].texts

    def test_settings_are_passed_on(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Base, program, travel, feed and unit of a table; criterion and angles of vector radii."""
        settings = ExportSettings(700, program=8000, travel=0.002, feed=60.0, units="inch")
        assert settings.table == TableSettings(700, 8000, 0.002, 60.0, "inch")
        for name, numbers in (
            ("fanuc", ["O8000.nc", "O8001.nc"]), ("haas", ["O08000.nc", "O08001.nc"]),
        ):  # fmt: skip
            files, _ = _exported(monkeypatch, name, program=8000)
            assert list(files.texts) == numbers
        for base, first in ((None, 600), (700, 700)):
            text = next(iter(_exported(monkeypatch, "fanuc", base=base)[0].texts.values()))
            assigned = {int(n) for n in re.findall(r"^#(\d+)=", text, re.M)}
            assert min(assigned - set(range(200))) == first
        made = _wozniak()
        changes = {"criterion": "rms", "travel": 0.001}, {"angles": "travel"}
        expected = (
            renishaw_variables(made, TableSettings(travel=0.001), criterion="rms"),
            renishaw_variables(made, angles="travel"),
        )
        for changed, text in zip(changes, expected, strict=True):
            files = CONTROLS["renishaw"].files(made, replace(ExportSettings(), **changed))
            assert files.texts[""] == text
        assert expected[0] != expected[1]
        monkeypatch.setattr(heidenhain, "supported_band", lambda made: Band(0.0, 1.0))
        template = "{where}\n{angle_deg} {deviation_mm}"
        settings = ExportSettings(azimuth=0.5, travel=0.003, template=template)
        files = CONTROLS["heidenhain"].files(made, settings)
        assert files.texts[""] == heidenhain_table(made, template, azimuth=0.5, travel=0.003)
        assert files.texts[""] != heidenhain_table(made, template)
        assert "not verified" in files.warnings[0]

    def test_radii_are_remarked_as_what_to_type(self) -> None:
        made = _wozniak()
        files = CONTROLS["radii"].files(made, ExportSettings(travel=0.004))
        typed = axis_radii(made, 0.004)["what_to_type"]
        assert files.remarks == tuple(f"{screen}: {text}" for screen, text in typed.items())
        assert '"format": "pretravel radii"' in files.texts[""]

    def test_remarks_are_the_comments_of_the_first_lines(self) -> None:
        lines = ["(one)", "; two", "three", *["x"] * 8, "(twelve)", "(thirteen)"]
        assert exports._remarks("\n".join(lines)) == ("(one)", "; two", "(twelve)")

    def test_delay_travel_of_a_table(self) -> None:
        """60 mm/min for 4 ms are 4 µm."""
        assert table_travel(replace(mean_map(0.01), delay=4e-3), 60.0) == pytest.approx(4e-3)
        assert table_travel(mean_map(0.01), None) == 0.0


class TestNumbers:
    @pytest.mark.parametrize(
        ("value", "text"),
        [
            (0.00812345678, "0.0081235"), (12.3456789, "12.345679"), (-0.0, "0.0"),
            (9999998.44, "9999998.4"), (-9999998.44, "-9999998.4"), (1234567.0, "1234567.0"),
            (0.125, "0.125"), (-3.0, "-3.0"), (99.9999999, "100.0"),
        ],
    )  # fmt: skip
    def test_eight_digits(self, value: float, text: str) -> None:
        assert plain_number(value) == text

    @pytest.mark.parametrize("value", [9999999.0, -9999999.0, math.inf, math.nan])
    def test_more_than_seven_digits_before_the_point(self, value: float) -> None:
        with pytest.raises(PretravelError, match="too many digits"):
            plain_number(value)

    def test_settings_that_no_table_has(self) -> None:
        with pytest.raises(PretravelError, match="units 'feet': a table is in mm or inch"):
            TableSettings(units="feet")
        for travel in (math.inf, math.nan):
            with pytest.raises(PretravelError, match="it must be finite"):
                TableSettings(travel=travel)
        assert TableSettings(units="inch").scaled(25.4) == pytest.approx(1.0)
        assert TableSettings().scaled(25.4) == 25.4

    def test_pretravel_as_large_as_the_tip(self) -> None:
        made = mean_map(0.01)
        check_radii(made, np.array([2.999, -2.999, 0.0]))
        for value in (3.0, -3.0):
            with pytest.raises(PretravelError, match=r"pretravel of 3\.0000 mm is not smaller"):
                check_radii(made, np.array([0.0, value, 0.1]))

    def test_a_table_in_the_numbers_of_a_control(self) -> None:
        band = Band(15.0 * DEGREE, 75.0 * DEGREE)
        form = _values(band, 4, 6)
        made = replace(mean_map(0.01), rotation=probe_rotation(rotation=0.5 * math.pi))
        found = control_table(made, form, TableSettings(travel=0.002, units="inch"))
        expected = (form.values.ravel() + 0.002) / 25.4
        assert np.array(found.values, dtype=float) == pytest.approx(expected, abs=5e-8)
        assert (found.rows, found.columns) == (6, 6)
        assert found.form is form
        assert found.axes == (("0.0", "1.0", "0.0"), ("-1.0", "0.0", "0.0"), ("0.0", "0.0", "1.0"))
        assert (found.lowest_deg, found.polar_step_deg, found.azimuth_step_deg) == (
            "15.0", "20.0", "60.0"
        )  # fmt: skip
        assert found.within_deg == ("14.999", "75.001")
        assert 100_000 <= found.number < 1_000_000
        others = [
            control_table(made, form, TableSettings(travel=0.002)),
            control_table(made, form, TableSettings(units="inch")),
            control_table(mean_map(0.01), form, TableSettings(travel=0.002, units="inch")),
            control_table(made, _values(Band(15.0 * DEGREE, 78.0 * DEGREE), 4, 6),
                          TableSettings(travel=0.002, units="inch")),
        ]  # fmt: skip
        assert len({found.number, *(other.number for other in others)}) == 5

    def test_between_nodes_a_table_is_the_cubic_of_four(self) -> None:
        """A parabola over the polar angle and a constant azimuth: exact everywhere, by borders on
        the parabola; over the azimuth, the Catmull-Rom spline written as in its paper, with slopes
        of half the difference of both neighbours."""
        band = Band(20.0 * DEGREE, 80.0 * DEGREE)
        polar = np.radians([0.0, 20.0, 40.0, 60.0, 80.0, 100.0])
        around = np.array([1.0, 3.0, 2.0, 7.0, 5.0])
        form = LookupTable(band, (polar**2)[:, None] + 0.0 * around)
        at = np.radians([20.0, 31.0, 47.0, 79.0, 80.0])
        n = from_angles(at, np.radians([0.0, 10.0, 200.0, 355.0, 90.0]))
        assert form.value(n) == pytest.approx(at**2)
        assert form.rows == 4
        assert form.polar_step == pytest.approx(20.0 * DEGREE)
        assert form.azimuth_step == pytest.approx(72.0 * DEGREE)
        wave = LookupTable(band, np.tile(around, (6, 1)))
        for place in (0.25, 1.5, 3.9, 4.3):
            i, f = int(place), place % 1.0
            p = [around[(i + k) % 5] for k in (-1, 0, 1, 2)]
            slopes = (p[2] - p[0]) / 2.0, (p[3] - p[1]) / 2.0
            expected = (
                (2 * f**3 - 3 * f**2 + 1) * p[1] + (f**3 - 2 * f**2 + f) * slopes[0]
                + (-2 * f**3 + 3 * f**2) * p[2] + (f**3 - f**2) * slopes[1]
            )  # fmt: skip
            n = from_angles(np.radians([33.0]), np.radians([72.0 * place]))
            assert wave.value(n)[0] == pytest.approx(expected)

    def test_the_widest_band_of_several(self) -> None:
        """A cap of 5°, and rings of touches at 157° to 165°, beyond a hole: with a margin of 5°
        the bands are 0 to 10° and 152 to 170°."""
        polar = np.radians([4.0, 5.0, 157.0, 161.0, 165.0])
        both = ring_pattern(polar, 72)
        made = replace(mean_map(0.01), support=DirectionSupport(both))
        held = made.support.supports(from_angles(np.radians([80.0, 120.0]), np.zeros(2)))
        assert not held.any()
        band = supported_band(made)
        assert band.lowest / DEGREE == pytest.approx(152.0, abs=0.3)
        assert band.highest / DEGREE == pytest.approx(170.0, abs=0.3)


class TestVariables:
    def test_variables_of_fanuc(self) -> None:
        assert FANUC.room(500) == 500
        assert FANUC.room(999) == 1
        for base in (99, 200, 499, 1000):
            with pytest.raises(PretravelError, match=f"variable {base} does not belong"):
                FANUC.room(base)
        for base in (100, 110, 199):
            with pytest.raises(PretravelError, match="lose their values at power-off"):
                FANUC.room(base)
        assert HAAS.room(110) == 40

    @pytest.mark.parametrize(
        ("base", "refused"), [(982, False), (983, True), (10982, False), (10983, True)]
    )
    def test_vector_radii_end_in_their_range(self, base: int, refused: bool) -> None:
        """X and Y radius, and eight from the tenth variable on: the last is base + 17."""
        if refused:
            with pytest.raises(PretravelError, match=f"from #{base} would end at #{base + 17}"):
                renishaw_variables(mean_map(0.01), TableSettings(base))
        else:
            text = renishaw_variables(mean_map(0.01), TableSettings(base))
            assert f"#{base + 17}=2.99" in text

    def test_a_table_that_does_not_fit(self) -> None:
        """24 values and the number of the table from 975 on: exactly up to 999."""
        form = _values(Band(0.0, 60.0 * DEGREE), 2, 6)
        assert fanuc_macro(mean_map(0.01), form, TableSettings(975))
        with pytest.raises(PretravelError, match="25 variables from #976 would end at #1000"):
            fanuc_macro(mean_map(0.01), form, TableSettings(976))

    @pytest.mark.parametrize(
        ("number", "refused"), [(0, True), (1, False), (9998, False), (9999, True)]
    )
    def test_numbers_of_two_programs(self, number: int, refused: bool) -> None:
        form = _values(Band(0.0, 60.0 * DEGREE), 2, 6)
        if refused:
            with pytest.raises(PretravelError, match="it must be from 1 to 9998"):
                fanuc_macro(mean_map(0.01), form, TableSettings(program=number))
        else:
            found = fanuc_macro(mean_map(0.01), form, TableSettings(program=number))
            assert list(found) == [f"O{number:04d}.nc", f"O{number + 1:04d}.nc"]

    def test_numbers_of_one_program(self) -> None:
        assert "O9999" in renishaw_variables(mean_map(0.01), TableSettings(program=9999))
        for number in (0, 10000):
            with pytest.raises(PretravelError, match="it must be from 1 to 9999"):
                renishaw_variables(mean_map(0.01), TableSettings(program=number))


class TestMapOfProgram:
    def test_tips_and_feeds_that_are_the_same(self) -> None:
        """A radius within 0.05 mm, feeds within 2 %, where the map does not contain the delay."""
        made = replace(mean_map(0.01), feed=50.0)
        check_map_of_program(made, 3.0499, np.array([50.0, 50.9, 49.1]))
        check_map_of_program(made, 2.9501, np.array([50.0]))
        for radius in (3.051, 2.949):
            with pytest.raises(PretravelError, match=r"tip of 6\.000 mm diameter"):
                check_map_of_program(made, radius, np.array([50.0]))
        for feed in (51.1, 48.9):
            with pytest.raises(PretravelError, match=f"but the program measures at {feed}"):
                check_map_of_program(made, 3.0, np.array([50.0, feed]))
        check_map_of_program(replace(made, feed=None), 3.0, np.array([80.0]))
        check_map_of_program(replace(made, delay=1e-3), 3.0, np.array([80.0]))

    def test_every_part_of_a_map_makes_another_number(self) -> None:
        basis = HarmonicBasis(np.array([[0, 0], [3, 3]]))
        made = PretravelMap(
            basis, np.array([0.01, 0.002]), Covariance.none(2), AROUND, tip_radius=3.0
        )
        others = [
            made,
            replace(made, coefficients=np.array([0.01, 0.0021])),
            replace(made, rotation=probe_rotation(rotation=0.1)),
            replace(made, tip_radius=3.001),
            replace(made, feed=60.0),
            replace(made, delay=2e-3),
            replace(made, basis=HarmonicBasis(np.array([[0, 0], [3, -3]]))),
            _wozniak(),
            replace(_wozniak(), basis=WozniakBasis(0.31)),
            replace(_wozniak(), basis=WozniakBasis(0.3, "piezo")),
        ]
        numbers = [map_identity(other).number for other in others]
        assert len(set(numbers)) == len(others)
        assert all(100_000_000 <= number < 1_000_000_000 for number in numbers)
        same = replace(made, repeatability=1e-4, u_tip_radius=1e-4)
        assert map_identity(same).number == numbers[0]
        text = map_identity(replace(made, feed=60.0)).text
        assert text.endswith("tip radius 3.0000 mm, at 60 mm per min")
        assert map_identity(made).text == f"number {numbers[0]}, tip radius 3.0000 mm"


class TestHeidenhain:
    def test_rows_and_residuals(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """0.01 + 0.002 sqrt(35/8) sin³ cos 3 azimuth: the mean leaves the lobes, at 90° largest;
        at an azimuth of 60°, where they are least, twice as much remains."""
        monkeypatch.setattr(heidenhain, "supported_band", lambda made: Band(0.0, 94.9 * DEGREE))
        factor = math.sqrt(35.0 / 8.0)
        basis = HarmonicBasis(np.array([[0, 0], [3, 3]]))
        made = PretravelMap(
            basis, np.array([0.01, 0.002]), Covariance.none(2), AROUND, tip_radius=3.0,
            rotation=probe_rotation((0.6, 0.0, 0.8), 0.2),
        )  # fmt: skip
        template = "{residual_um:.3f} {where}\n{number} {angle_deg:.2f} {deviation_mm:.6f}"
        lines = heidenhain_table(made, template, travel=0.003).splitlines()
        at_equator = 2.0 * factor * math.sin(90.0 * DEGREE) ** 3
        assert lines[0] == f"{at_equator:.3f} the mean over the azimuth"
        expected = [f"{i} {5.0 * i:.2f} -0.013000" for i in range(len(lines) - 1)]
        assert lines[1:] == expected
        assert len(lines) == 20  # 0 to 90° and one line more
        lines = heidenhain_table(made, template, azimuth=60.0 * DEGREE, step_deg=30.0).splitlines()
        assert lines[0] == f"{2.0 * at_equator:.3f} the probe touched at azimuth 60 degrees"
        for i, line in enumerate(lines[1:]):
            value = 0.01 - 0.002 * factor * math.sin(30.0 * i * DEGREE) ** 3
            assert line == f"{i} {30.0 * i:.2f} {-value:.6f}"
        assert len(lines) == 5
        for step in (0.0, -1.0, math.nan):
            with pytest.raises(PretravelError, match="it must be positive"):
                heidenhain_table(made, step_deg=step)
        with pytest.raises(PretravelError, match="not smaller than the tip radius"):
            heidenhain_table(made, travel=2.99)


def test_uncertainties_of_radii_contain_map_tip_and_delay_together() -> None:
    """The map has 3 µm, of which 1 µm is by the delay; 60 mm/min, 1 mm/s, and 4 ms of delay with u
    0.5 ms, 0.5 µm: sqrt(9 - 1 + (1 + 0.5)² + 2²)."""
    made = replace(
        mean_map(0.01), covariance=Covariance.independent([8e-6]), delay=4e-3, u_delay=5e-4,
        delay_effect=np.array([1e-3]), u_tip_radius=2e-3,
    )  # fmt: skip
    found = axis_radii(made, 4e-3)
    for entry in (*found["travel"].values(), *found["plane"]):
        assert entry["u_mm"] == pytest.approx(1e-3 * math.sqrt(8.0 + 1.5**2 + 4.0), abs=1e-8)
        assert entry["radius_mm"] == pytest.approx(3.0 - 0.014, abs=1e-8)
    assert found["feed_mm_min"] == 60.0
    assert [entry["travel_azimuth_deg"] for entry in found["plane"]] == [
        15.0 * i for i in range(24)
    ]
    assert axis_radii(replace(mean_map(0.01), feed=50.0))["feed_mm_min"] == 50.0
    assert axis_radii(mean_map(0.01))["feed_mm_min"] is None
    assert axis_radii(mean_map(0.01))["travel"]["x+"]["u_mm"] is None
