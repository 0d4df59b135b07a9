"""What each control is given: its files, their numbers and heads, the variables that they use."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls import control as of_controls
from pretravel.controls import heidenhain
from pretravel.controls import linuxcnc_subroutines as linuxcnc
from pretravel.controls.axis_radii import axis_radii
from pretravel.controls.control import ExportedFiles, ExportSettings
from pretravel.controls.control_table import (
    TableSettings,
    check_radii,
    conditions_statements,
    control_table,
    feed_statement,
    map_statement,
    table_identity,
)
from pretravel.controls.exports import (
    CONTROLS,
    correction_on_control,
    table_travel,
)
from pretravel.controls.fanuc import FANUC
from pretravel.controls.gcode import coordinate, exact, plain_number
from pretravel.controls.haas import HAAS
from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.linuxcnc_cycles import sphere_subroutines
from pretravel.controls.linuxcnc_subroutines import linuxcnc_subroutines
from pretravel.controls.lookup import Band
from pretravel.controls.lookup_formula import LookupSeries
from pretravel.controls.lookup_table import LookupTable
from pretravel.controls.macro_b import free_variables, macro_programs
from pretravel.controls.program_log import FAULTS
from pretravel.controls.renishaw import renishaw_variables
from pretravel.controls.siemens import siemens_cycle
from pretravel.controls.tasks.export.task import Export
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Provenance
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map, mean_map

fanuc_macro = partial(macro_programs, dialect=FANUC)
haas_macro = partial(macro_programs, dialect=HAAS)
MEAN = LookupSeries(np.full((1, 1), 0.016), np.zeros((1, 1)), Band(0.0, 1.0))
# A map without a formula for a control.
WOZNIAK = replace(
    mean_map(0.01), basis=WozniakBasis(0.3), coefficients=np.array([0.008, 0.0, 0.001]),
    covariance=Covariance.none(3),
)  # fmt: skip


def _replace(monkeypatch: pytest.MonkeyPatch, name: str, made: object) -> None:
    """What makes a table or a formula, for all controls."""
    for module in (of_controls, linuxcnc):
        monkeypatch.setattr(module, name, made, raising=module is of_controls)


def _values(form: Band, rows: int, columns: int) -> LookupTable:
    values = 0.01 + 1e-4 * np.arange(float((rows + 2) * columns)).reshape(rows + 2, columns)
    return LookupTable(form, values, largest_error=5e-4)


TABLE = _values(Band(0.0, 60.0 * DEGREE), 2, 6)


def _exported(
    monkeypatch: pytest.MonkeyPatch, control: str, **settings: object
) -> tuple[ExportedFiles, dict[str, float]]:
    """Files with a small table of an error of 0.5 µm, and what was asked for to make it."""
    asked: dict[str, float] = {}

    def made(of: PretravelMap, **wanted: float) -> LookupTable:
        assert of.kind == "wozniak"
        asked.update(wanted)
        return TABLE

    _replace(monkeypatch, "lookup_table", made)
    chosen = ExportSettings(**settings)  # type: ignore[arg-type]
    return CONTROLS[control].files(WOZNIAK, chosen), asked


def _assigned(text: str) -> list[int]:
    return [int(number) for number in re.findall(r"^#(\d+) ?=", text, re.M)]


def _where_allowed(table: LookupTable, *_: object, allowed: float, **__: object) -> object:
    return table if table.largest_error <= allowed else None


class TestControls:
    def test_what_each_control_needs_and_uses(self) -> None:
        """A folder where there are several programs; LinuxCNC subtracts the delay travel itself;
        options that would change nothing are refused by the command."""
        tables = {"units", "tolerance"}
        expected = {
            "linuxcnc": (True, True, {"base", "form", "tolerance", "tool", "stylus_length"}),
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
        assert "from the map 0.500 um" in " ".join(files.remarks).lower()
        coarse, asked = _exported(monkeypatch, name, base=base, tolerance=4e-4)
        assert asked["tolerance"] == 4e-4
        (warned,) = coarse.warnings
        assert "by up to 0.500 µm, more than the 0.4 µm that are allowed" in warned
        (warned,) = _exported(monkeypatch, name, base=base, form="table")[0].warnings
        assert "by up to 0.500 µm: there are too few variables" in warned

    @pytest.mark.parametrize("name", ["fanuc", "haas", "siemens"])
    def test_a_table_is_written_where_it_is_fine_enough(
        self, name: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The limit is half of the map's u, or the tolerance that is stated."""
        made = replace(mean_map(0.016), covariance=Covariance.independent([0.4e-3**2]))
        _replace(monkeypatch, "exact_lookup", lambda made: MEAN)
        for error, stated, form, expected in (
            (0.19e-3, None, "auto", True), (0.21e-3, None, "auto", False),
            (0.21e-3, None, "table", True), (0.19e-3, None, "formula", False),
            (0.19e-3, 0.18e-3, "auto", False), (0.30e-3, 0.31e-3, "auto", True),
        ):  # fmt: skip
            off = replace(TABLE, largest_error=error)
            _replace(monkeypatch, "lookup_table", lambda *_, off=off, **__: off)
            _replace(monkeypatch, "lookup_table_within", partial(_where_allowed, off))
            files = CONTROLS[name].files(made, ExportSettings(tolerance=stated, form=form))
            assert isinstance(files.form, LookupTable) is expected, (error, stated, form)
            assert (len(files.texts) == {"siemens": 3}.get(name, 2)) is expected
            # Where the table is chosen for its accuracy, no warning denies it.
            assert bool(files.warnings) is (form == "table")
            assert all("The form 'formula' is exact" in each for each in files.warnings)

    def test_what_a_control_takes_off(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """A formula as the map; nothing where the control has an alarm; radii are refused."""
        _replace(monkeypatch, "exact_lookup", lambda made: MEAN)
        _replace(monkeypatch, "lookup_table", lambda *_, **__: TABLE)
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
        table, _ = _exported(monkeypatch, "linuxcnc", written="2026-01-02")
        _replace(monkeypatch, "exact_lookup", lambda made: MEAN)
        made = mean_map(0.016)
        files = CONTROLS["linuxcnc"].files(made, ExportSettings(written="2026-01-02"))
        assert files.obsolete == ("pretravel_table.ngc",)
        assert "pretravel_table.ngc" not in files.texts
        assert files.warnings == ()
        assert "2026-01-02" in "".join(files.texts.values())
        (remark,) = files.remarks
        assert remark == "harmonic series of 1 terms; largest difference from the map 0.000 um"
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
        _replace(monkeypatch, "exact_lookup", lambda made: None)
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
            assert min(set(_assigned(text)) - set(range(200))) == first
        made = WOZNIAK
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
        files = CONTROLS["radii"].files(WOZNIAK, ExportSettings(travel=0.004))
        typed = axis_radii(WOZNIAK, 0.004)["what_to_type"]
        assert files.remarks[1:] == tuple(f"{screen}: {text}" for screen, text in typed.items())
        assert '"format": "pretravel radii"' in files.texts[""]

    @pytest.mark.parametrize(
        ("control", "call"),
        [("fanuc", "(CALL G65 P"), ("haas", "(CALL G65 P"), ("siemens", "; Call: PRETRAVEL(")],
    )
    def test_users_are_told_how_the_lookup_is_called(
        self, control: str, call: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """The remarks of an export are the first comments of the file with the lookup."""
        files, _ = _exported(monkeypatch, control)
        assert any(remark.startswith(call) for remark in files.remarks)
        text = list(files.texts.values())[-1]
        comments = [line for line in text.splitlines()[:13] if line.startswith(("(", ";"))]
        assert list(files.remarks) == comments

    def test_delay_travel_of_a_table(self) -> None:
        """60 mm/min for 4 ms are 4 µm; a feed where, and only where, the map has a delay."""
        delayed = replace(mean_map(0.01), delay=4e-3)
        assert table_travel(delayed, 60.0) == pytest.approx(4e-3)
        assert table_travel(mean_map(0.01), None) == 0.0
        with pytest.raises(PretravelError, match=r"4\.000 ms, which a table contains for one feed"):
            table_travel(delayed, None)
        assert ExportSettings().largest_deviation == pytest.approx(2e-5)

    @pytest.mark.parametrize("control", ["heidenhain", "renishaw"])
    def test_the_files_name_the_feed_that_was_given(self, control: str) -> None:
        """They said: at one feed."""
        task = Export(map_file="m.json", to=control, feed=60.0)  # type: ignore[arg-type]
        text = task.exported(replace(mean_map(0.01), delay=4e-3)).files.texts[""]
        assert re.search("contains the signal delay at 60 mm.min", text, re.IGNORECASE)

    @pytest.mark.parametrize(
        ("control", "given"),
        [("fanuc", {"base": 700}), ("linuxcnc", {"base": 1200}), ("linuxcnc", {"tolerance": 1e-3})],
    )
    def test_settings_of_a_table_where_there_is_none(
        self, control: str, given: dict[str, float]
    ) -> None:
        settings = ExportSettings(form="formula", **given)  # type: ignore[arg-type]
        said = CONTROLS[control].files(mean_map(0.01), settings).warnings
        assert len(said) == 1
        assert "is not used: the files contain the formula" in said[0]


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

    def test_settings_that_no_table_has(self) -> None:
        for travel in (math.inf, math.nan):
            with pytest.raises(PretravelError, match="it must be finite"):
                TableSettings(travel=travel)
        assert TableSettings(units="inch").scaled(25.4) == pytest.approx(1.0)
        assert TableSettings().scaled(25.4) == 25.4

    def test_pretravel_and_travel_are_together_smaller_than_the_tip(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """0.01 + 2.985 mm are, 0.01 + 2.995 mm are not smaller than 3 mm."""
        made = mean_map(0.01)
        check_radii(made, np.array([2.999, -2.999, 0.0]))
        for value in (3.0, -3.0):
            with pytest.raises(PretravelError, match=r"pretravel of 3\.0000 mm is not smaller"):
                check_radii(made, np.array([0.0, value, 0.1]))
        for value in (math.nan, math.inf):
            with pytest.raises(PretravelError, match="must be finite"):
                check_radii(made, np.array([0.01, value]))
        monkeypatch.setattr(heidenhain, "supported_band", lambda made: Band(0.0, 1.0))
        form = LookupTable(Band(0.0, 1.0), np.full((4, 6), 0.01))
        for check in (
            lambda travel: renishaw_variables(made, TableSettings(travel=travel)),
            lambda travel: control_table(made, form, TableSettings(travel=travel)),
            lambda travel: heidenhain_table(made, travel=travel),
        ):
            assert check(2.985)
            with pytest.raises(PretravelError, match="not smaller than the tip radius"):
                check(2.995)

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
        ("first", "last"),
        [(101, 149), (500, 549), (600, 699), (800, 999), (10001, 10149), (10200, 10499),
         (10500, 10549), (10600, 10699), (10800, 10999)],
    )  # fmt: skip
    def test_haas_keeps_150_to_199_550_to_599_and_700_to_799(self, first: int, last: int) -> None:
        """Of its global variables these are the probe's and the control's, in both ranges. The ends
        of a range belong to it."""
        assert free_variables(HAAS.free, first) == last - first + 1
        assert free_variables(HAAS.free, last) == 1
        for beyond in {first - 1, last + 1} - {10499, 10500}:
            with pytest.raises(PretravelError, match=f"variable {beyond} does not belong.*#101 to"):
                free_variables(HAAS.free, beyond)

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
        assert fanuc_macro(mean_map(0.01), TABLE, TableSettings(975))
        with pytest.raises(PretravelError, match="25 variables from #976 would end at #1000"):
            fanuc_macro(mean_map(0.01), TABLE, TableSettings(976))

    def test_numbers_of_programs(self) -> None:
        """Two of a table, one of vector radii."""
        for number in (1, 9998):
            found = fanuc_macro(mean_map(0.01), TABLE, TableSettings(program=number))
            assert list(found) == [f"O{number:04d}.nc", f"O{number + 1:04d}.nc"]
        assert "O9999" in renishaw_variables(mean_map(0.01), TableSettings(program=9999))
        for number in (0, 9999):
            with pytest.raises(PretravelError, match="it must be from 1 to 9998"):
                fanuc_macro(mean_map(0.01), TABLE, TableSettings(program=number))
        for number in (0, 10000):
            with pytest.raises(PretravelError, match="it must be from 1 to 9999"):
                renishaw_variables(mean_map(0.01), TableSettings(program=number))


class TestHeads:
    def test_the_feed_of_a_table(self) -> None:
        made = mean_map(0.01)
        delayed = replace(made, delay=4e-3)
        told = {
            feed_statement(made, TableSettings()): "the map has no feed",
            feed_statement(replace(made, feed=55.0), TableSettings()): "made at 55 mm/min",
            feed_statement(delayed, TableSettings(feed=70.0)): "delay at 70 mm/min",
            feed_statement(delayed, TableSettings()): "delay at one feed",
        }
        for text, words in told.items():
            assert words in text
        assert len(told) == 4

    def test_the_orientation_of_a_table(self) -> None:
        """Of a map without lobes the orientation does not matter."""
        made = mean_map(0.01)
        turned = replace(made, provenance=Provenance(spindle_deg=30.0))
        told = conditions_statements(turned, TableSettings())
        assert told[1:] == ["made at spindle 30 degrees - measure at that orientation"]
        assert len(conditions_statements(made, TableSettings())) == 1
        _, lobed = conditions_statements(example_map(), TableSettings())
        assert lobed.startswith("the map does not state the spindle orientation")
        head = replace(made, provenance=Provenance(tip="T1 (A0;B0)", orientation="A0B0"))
        _, told_of_head = conditions_statements(head, TableSettings())
        assert told_of_head == "of tip T1 A0 B0 and orientation A0B0 - for no other"
        texts = linuxcnc_subroutines(head, MEAN)
        assert "of tip T1 A0 B0 and orientation A0B0" in texts["pretravel_lookup.ngc"]

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
            for name in (
                "bore",
                "boss",
                "pocket",
                "web",
                "edge",
                "surface",
                "angle",
                "corner",
                "correct",
            )
        }
        own = {f"pretravel_{name}.ngc" for name in
               ("lookup", "compensate", "identity", "radius", "point", "head")}  # fmt: skip
        others = {
            f"pretravel_{name}.ngc"
            for name in ("sphere", "move", "touch", "keep", "restore", "limits")
        }
        formula = linuxcnc_subroutines(mean_map(0.01), MEAN)
        assert set(formula) == cycles | own | others
        assert set(sphere_subroutines()) == others
        table = linuxcnc_subroutines(mean_map(0.01), TABLE)
        assert set(table) == set(formula) | {"pretravel_table.ngc"}
        # Probe Basic keeps settings in #1001-1012, #3000-3058 and #3973-4024.
        most = LookupTable(Band(0.0, 1.0), np.full((38, 50), 0.01))
        for base, form in ((1050, TABLE), (2000, TABLE), (1050, most)):
            given = {} if base == 1050 else {"base": base}
            files = linuxcnc_subroutines(mean_map(0.01), form, **given)
            used = _assigned(files["pretravel_table.ngc"])
            assert (min(used), max(used)) == (base, base + form.values.size)
        assert 1013 <= min(used) < max(used) < 3000
        assert all(len(line) <= 250 for text in table.values() for line in text.splitlines())
        with pytest.raises(PretravelError, match="too long for the control"):
            linuxcnc_subroutines(mean_map(0.01), MEAN, written="x" * 250)
        at_feed = linuxcnc_subroutines(replace(mean_map(0.01), feed=50.0), MEAN)
        text = at_feed["pretravel_radius.ngc"]
        assert "GT 1]" in text  # 2 % of 50 mm/min
        assert "(ABORT,pretravel_radius: the map is for 50 mm/min" in text
        assert "(made at 50 mm/min; measure at that feed)" in text
        assert "(the map does not state the spindle orientation" in text
        assert "(the map has no feed; measure at the feed" in formula["pretravel_lookup.ngc"]
        late = linuxcnc_subroutines(replace(mean_map(0.01), delay=0.002), MEAN)
        said = "(without the travel during the signal delay"
        assert [name for name in late if said in late[name]] == ["pretravel_lookup.ngc"]
        assert said not in formula["pretravel_lookup.ngc"]

    def test_a_macro_names_its_variables_and_its_call(self) -> None:
        text = renishaw_variables(mean_map(0.01), TableSettings(10000))
        assert "(SETS #10000, #10001 AND #10010 TO #10017," in text
        assert "#10002 AND #10003" in text
        assert _assigned(text) == [10000, 10001, *range(10010, 10018)]
        assert renishaw_variables(mean_map(0.01)).splitlines()[1].startswith("O7799 ")
        for number, first in ((None, 7750), (8123, 8123)):
            files = haas_macro(mean_map(0.01), TABLE, TableSettings(program=number))
            assert list(files) == [f"O0{first}.nc", f"O0{first + 1}.nc"]
            assert f"(CALL G65 P{first + 1} I1." in files[f"O0{first + 1}.nc"]
            assert "IN #10200 TO #10224)" in files[f"O0{first + 1}.nc"]

    def test_unknown_angles_of_vector_radii(self) -> None:
        with pytest.raises(PretravelError, match="angles 'steps': they are normals or travel"):
            renishaw_variables(mean_map(0.01), angles="steps")


def test_causes_of_a_stop_are_numbered_from_one() -> None:
    """As the subroutines number them: 1 is a miss, which a program can allow."""
    text = sphere_subroutines()["pretravel_sphere.ngc"]
    told = re.findall(r"#<_pretravel_fault> EQ (\d)\]\n\(ABORT,.*cause (\d), (.*)\)", text)
    assert [(int(a), int(b), words) for a, b, words in told] == [
        (number, number, words) for number, words in enumerate(FAULTS, start=1)
    ]
    assert FAULTS[:2] == ("no contact", "contact too early")
