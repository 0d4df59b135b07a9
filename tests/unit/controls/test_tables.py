"""Tables and macros of controls."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, ring_pattern
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls.control_table import TableSettings, check_radii
from pretravel.controls.exports import CONTROLS, ExportSettings
from pretravel.controls.gcode import plain_number
from pretravel.controls.haas import HAAS, haas_macro
from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.lookup_table import LookupTable, lookup_table
from pretravel.controls.macro_b import fanuc_macro, free_variables, renishaw_variables
from pretravel.controls.map_identity import map_identity
from pretravel.controls.siemens import siemens_cycle
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from tests.support.example_maps import example_map, lobes, mean_map
from tests.support.macro_b_interpreter import (
    NGC_ALIASES,
    MacroAlarm,
    MacroControl,
    MacroSyntaxError,
)
from tests.support.siemens_interpreter import SiemensAlarm, SiemensControl, SiemensSyntaxError

# Scattered directions, and the axes and the borders of octants, where angles change their branch.
DIRECTIONS = np.vstack(
    [
        fibonacci_cap(60, 94.0 * DEGREE),
        ring_pattern(np.array([0.0, 1.0, 45.0, 90.0, 94.9]) * DEGREE, 8),
    ]
)


@cache
def _table(pretravel_map: PretravelMap, most_values: int) -> LookupTable:
    return lookup_table(pretravel_map, tolerance=5e-4, most_values=most_values)


def _first(texts: Mapping[str, str]) -> str:
    return next(iter(texts.values()))


def _macro_control(
    made_for: str, pretravel_map: PretravelMap, table: LookupTable, settings: TableSettings
) -> MacroControl:
    """A control with both programs, the first of which has run."""
    control = MacroControl(
        two_value_atan=made_for != "haas",
        signed_atan=made_for == "fanuc, signed angles",
        aliases=NGC_ALIASES if made_for == "haas" else (),
    )
    control.variables[4006] = 20.0 if settings.units == "inch" else 21.0
    programs = haas_macro if made_for == "haas" else fanuc_macro
    for text in programs(pretravel_map, table, settings).values():
        control.load(text)
    control.run(7750)
    return control


def _looked_up(control: MacroControl, normal: np.ndarray) -> float:
    control.run(7751, dict(zip("IJK", normal.tolist(), strict=True)))
    value = control.variables[100]
    assert value is not None
    return value


def _alarm(control: MacroControl, normal: np.ndarray) -> tuple[int, str]:
    with pytest.raises(MacroAlarm) as alarm:
        _looked_up(control, normal)
    return alarm.value.number, alarm.value.text


def _siemens_control(
    pretravel_map: PretravelMap, table: LookupTable, settings: TableSettings
) -> SiemensControl:
    texts = siemens_cycle(pretravel_map, table, settings)
    control = SiemensControl()
    control.define(texts["PRETRAVEL_GUD.DEF"])
    control.load(texts["PRETRAVEL_TABLE.SPF"])
    control.load(texts["PRETRAVEL.SPF"])
    control.run("PRETRAVEL_TABLE")
    return control


def _assigned(text: str) -> dict[int, float]:
    return {int(n): float(v) for n, v in re.findall(r"^#(\d+)=(-?[\d.]+)", text, re.M)}


class TestHeidenhain:
    def test_default_template_says_that_it_is_unverified(self) -> None:
        text = heidenhain_table(lobes(3))
        assert "UNVERIFIED" in text.splitlines()[0]
        last = text.splitlines()[-1].split()
        assert float(last[1]) == 90.0
        assert float(last[2]) == pytest.approx(-10.0, abs=1e-6)  # the mean over the azimuth

    def test_a_tilted_probe_has_its_own_angles(self) -> None:
        """Angles are measured from the axis of the probe, in every orientation of the probe."""
        tilted = lobes(3, rotation=probe_rotation((np.sin(0.5), 0.0, np.cos(0.5)), 0.3))
        assert heidenhain_table(tilted) == heidenhain_table(lobes(3))

    def test_own_template_and_azimuth(self) -> None:
        text = heidenhain_table(
            lobes(3), "A;B\n{angle_deg:.1f};{deviation_mm:.3f}\n", azimuth=0.0, step_deg=30.0
        )
        assert text.splitlines() == ["A;B", "0.0;-10.000", "30.0;-10.125", "60.0;-10.650",
                                     "90.0;-11.000"]  # fmt: skip

    @pytest.mark.parametrize(
        ("template", "words"),
        [
            ("{title[a]} {angle_deg}", "not known"),
            ("{title.__class__.__mro__} {angle_deg}", "not known"),
            ("{angle_deg:>9999999999}", "the form of"),
            ("{angle_deg:>{number}}", "the form of"),
            ("{angle_deg!r}", "the form of"),
            ("{title:.2f}\n{angle_deg}", "line 1"),
            ("{angel_deg}\n", r"line 1: .angel_deg. is not known"),
            ("hello\n", "no line with"),
            ("{\n", "line 1"),
        ],
    )
    def test_templates_refused(self, template: str, words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            heidenhain_table(lobes(3), template)


class TestMacroPrograms:
    """The files as written, run by an interpreter that refuses what some control refuses."""

    @pytest.mark.parametrize("made_for", ["fanuc", "fanuc, signed angles", "haas"])
    @pytest.mark.parametrize("units", [pytest.param("mm", marks=pytest.mark.slow), "inch"])
    def test_lookup_is_that_of_the_table(self, made_for: str, units: str) -> None:
        table = _table(example_map(), 399)
        settings = TableSettings(units=units, travel=0.002)
        control = _macro_control(made_for, example_map(), table, settings)
        found = [_looked_up(control, n) for n in DIRECTIONS]
        in_mm = np.array(found) * (25.4 if units == "inch" else 1.0)
        # Seven decimals of the nodes, times the sum of the weights.
        last_digit = 1.3e-7 * (25.4 if units == "inch" else 1.0)
        assert in_mm == pytest.approx(table.value(DIRECTIONS) + 0.002, abs=last_digit)

    @pytest.mark.parametrize("made_for", ["fanuc", "haas"])
    def test_a_tilted_probe(self, made_for: str) -> None:
        """Directions on the control are those of the machine, the table is that of the probe."""
        rotation = probe_rotation((np.sin(0.4), 0.0, np.cos(0.4)), 0.3)
        tilted = lobes(3, rotation=rotation)
        table = lookup_table(tilted, tolerance=0.1, most_values=399)
        control = _macro_control(made_for, tilted, table, TableSettings())
        inside = DIRECTIONS[(DIRECTIONS @ rotation)[:, 2] > 0.0]
        found = [_looked_up(control, n) for n in inside]
        # Seven decimals of the axes, at most 3 mm/rad of this map, and six of 10 mm.
        assert found == pytest.approx(table.value(inside @ rotation), abs=2e-6)

    @pytest.mark.parametrize("made_for", ["fanuc", "haas"])
    def test_alarms_instead_of_values(self, made_for: str) -> None:
        table = _table(example_map(), 399)
        control = _macro_control(made_for, example_map(), table, TableSettings())
        # The map holds to 95° from the probe's axis.
        just = np.array([np.sin(95 * DEGREE), 0.0, np.cos(95 * DEGREE)])
        assert _looked_up(control, just) == pytest.approx(table.value(just[None])[0], abs=1e-6)
        beyond = np.array([np.sin(95.1 * DEGREE), 0.0, np.cos(95.1 * DEGREE)])
        assert _alarm(control, beyond) == (104, "OUTSIDE PRETRAVEL MAP")
        assert _alarm(control, np.array([0.0, 0.0, -1.0]))[0] == 104
        assert control.variables[100] is None  # not the value of the call before
        assert _alarm(control, np.array([1.0, 0.1, 0.0])) == (103, "NORMAL NOT A UNIT VECTOR")
        # I1 without a decimal point is a thousandth on many controls.
        assert _alarm(control, np.array([0.001, 0.0, 0.0]))[0] == 103
        control.variables[4006] = 20.0
        assert _alarm(control, just) == (101, "PRETRAVEL TABLE IS IN MM")

    def test_a_map_that_does_not_hold_at_the_pole(self) -> None:
        """A ring from 60° to 90°: nearer to the axis there is an alarm on every control."""
        support = DirectionSupport(
            ring_pattern(np.array([70.0, 75.0, 80.0, 85.0, 90.0]) * DEGREE, 72)
        )
        ring = replace(example_map(), support=support, touched=None)
        table = lookup_table(ring, tolerance=0.1, most_values=399)
        assert table.band.lowest > 20 * DEGREE
        near = from_angles(table.band.lowest - 0.1 * DEGREE, np.array([0.7]))[0]
        for made_for in ("fanuc", "haas"):
            control = _macro_control(made_for, ring, table, TableSettings())
            assert _alarm(control, near)[0] == 104
        siemens = _siemens_control(ring, table, TableSettings())
        with pytest.raises(SiemensAlarm, match="65004"):
            siemens.run("PRETRAVEL", *near)
        edge = from_angles(table.band.lowest, np.array([0.7]))[0]
        siemens.run("PRETRAVEL", *edge)
        expected = table.value(edge[None])[0]
        assert siemens.data["PT_VALUE"].values[0] == pytest.approx(expected, abs=1.3e-7)
        assert _looked_up(control, edge) == pytest.approx(expected, abs=1.3e-7)

    @pytest.mark.parametrize(
        ("control", "call"),
        [("fanuc", "(CALL G65 P"), ("haas", "(CALL G65 P"), ("siemens", "; Call: PRETRAVEL(")],
    )
    def test_users_are_told_how_the_lookup_is_called(self, control: str, call: str) -> None:
        """The remarks of an export are those of the file with the lookup, not of the table."""
        remarks = CONTROLS[control].files(example_map(), ExportSettings(tolerance=1e-3)).remarks
        assert any(remark.startswith(call) for remark in remarks)

    def test_variables_of_the_probe_and_of_the_control_are_not_used_on_haas(self) -> None:
        """150 to 199 and 550 to 599 belong to the probe, 700 to 749 to the control; those of the
        Next Generation Control are the same, plus 10000."""
        for added in (0, 10_000):
            for base, room in ((149, 1), (500, 50), (600, 100), (800, 200)):
                assert free_variables(HAAS.free, added + base) == room
            for taken in (150, 199, 550, 599, 700, 749):
                with pytest.raises(PretravelError, match="does not belong to the user"):
                    free_variables(HAAS.free, added + taken)

    def test_programs_of_others_do_not_reach_the_table_of_haas(self) -> None:
        """#500 to #549 are #10500 to #10549 too, as #600 and #800 are: the table ends before."""
        files = CONTROLS["haas"].files(example_map(), ExportSettings())
        assert max(_assigned(files.texts["O07750.nc"])) <= 10499
        control = MacroControl(two_value_atan=False, aliases=NGC_ALIASES)
        for text in files.texts.values():
            control.load(text)
        control.run(7750)
        before = [_looked_up(control, n) for n in DIRECTIONS]
        user = [*range(100, 200), *range(500, 1000)]
        lines = "\n".join(f"#{number}=0.14" for number in user)
        control.load(f"%\nO1000\n{lines}\nM99\n%\n")
        control.run(1000)
        assert [_looked_up(control, n) for n in DIRECTIONS] == before

    @pytest.mark.parametrize("made_for", ["fanuc", "haas"])
    @pytest.mark.parametrize("units", ["mm", "inch"])
    def test_a_table_that_another_program_changed_is_an_alarm(
        self, made_for: str, units: str
    ) -> None:
        table = _table(example_map(), 199)
        settings = TableSettings(base=10800 if made_for == "haas" else 800, units=units)
        control = _macro_control(made_for, example_map(), table, settings)
        known = _looked_up(control, DIRECTIONS[0])
        control.load("%\nO1000\n#850=0\nM99\n%\n")
        control.run(1000)
        assert _alarm(control, DIRECTIONS[0]) == (107, "PRETRAVEL TABLE CHANGED")
        control.run(7750)
        assert _looked_up(control, DIRECTIONS[0]) == known

    def test_a_missing_or_another_table_is_an_alarm(self) -> None:
        table = _table(example_map(), 399)
        texts = list(fanuc_macro(example_map(), table).values())
        control = MacroControl()
        control.load(texts[1])
        assert _alarm(control, DIRECTIONS[0]) == (102, "PRETRAVEL TABLE IS MISSING")
        later = fanuc_macro(example_map(), table, TableSettings(travel=0.001))
        control.load(_first(later))
        control.run(7750)
        assert _alarm(control, DIRECTIONS[0])[0] == 102

    def test_default_ranges_do_not_meet(self) -> None:
        """Renishaw's radii, the table and the result have variables of their own."""
        radii = _assigned(renishaw_variables(example_map()))
        table = _assigned(_first(fanuc_macro(example_map(), _table(example_map(), 399))))
        assert not set(radii) & set(table)
        assert 100 not in table
        assert max(table) <= 999

    @pytest.mark.parametrize("value", [np.nan, np.inf, 1e7])
    def test_numbers_that_no_control_reads(self, value: float) -> None:
        with pytest.raises(PretravelError, match="cannot be written"):
            plain_number(value)
        with pytest.raises(PretravelError):
            fanuc_macro(example_map(), _table(example_map(), 399), TableSettings(travel=value))

    def test_pretravel_beyond_the_radius_is_refused(self) -> None:
        small = replace(lobes(3), tip_radius=5.0)
        with pytest.raises(PretravelError, match="not smaller than the tip radius"):
            renishaw_variables(small)


class TestInterpreters:
    """They refuse what a control refuses; otherwise the tests above would show little."""

    @pytest.mark.parametrize(
        "line",
        [
            "#100=1.5e-3",
            "#100=0.012345678",
            "#100=sqrt[4]",
            "#100=[[[[[[1]]]]]]",
            "#100=1+",
            "#100=ACOS[0.5]",
            "#1000=1",
            "IF #1 GT 0 THEN #100=1",
            "M3 S20000",
            "(one (two))",
        ],
    )
    def test_macro_b(self, line: str) -> None:
        control = MacroControl()
        control.load(f"%\nO1000\n{line}\nM99\n%\n")
        with pytest.raises(MacroSyntaxError):
            control.run(1000)

    @pytest.mark.parametrize(
        "line",
        ["OTHER=1", "PT_VALUE[1]=1", "PT_VALUE=1+", "G1 X5", "IF PT_VALUE>1", "PT_VALUE=[1]"],
    )
    def test_siemens(self, line: str) -> None:
        control = SiemensControl()
        control.define("DEF CHAN REAL PT_VALUE\nM17\n")
        control.load(f"PROC TRY\n{line}\nRET\n")
        with pytest.raises(SiemensSyntaxError):
            control.run("TRY")


class TestSiemens:
    @pytest.mark.parametrize("units", ["mm", "inch"])
    def test_lookup_is_that_of_the_table(self, units: str) -> None:
        table = _table(example_map(), 800)
        control = _siemens_control(example_map(), table, TableSettings(units=units))
        control.group13 = 2 if units == "mm" else 1
        found = []
        for n in DIRECTIONS:
            control.run("PRETRAVEL", *n)
            found.append(control.data["PT_VALUE"].values[0])
        factor = 25.4 if units == "inch" else 1.0
        assert np.array(found) * factor == pytest.approx(
            table.value(DIRECTIONS), abs=1.3e-7 * factor
        )

    def test_a_tilted_probe(self) -> None:
        rotation = probe_rotation((np.sin(0.4), 0.0, np.cos(0.4)), 0.3)
        tilted = lobes(3, rotation=rotation)
        table = lookup_table(tilted, tolerance=0.1, most_values=800)
        control = _siemens_control(tilted, table, TableSettings())
        inside = DIRECTIONS[(DIRECTIONS @ rotation)[:, 2] > 0.0]
        for n in inside:
            control.run("PRETRAVEL", *n)
            found = control.data["PT_VALUE"].values[0]
            assert found == pytest.approx(table.value(n[None] @ rotation)[0], abs=2e-6)

    @pytest.mark.parametrize(
        ("normal", "group13", "number"),
        [
            ((1.0, 0.0, 0.0), 1, 65001),
            ((1.0, 0.0, 0.0), 3, 65001),
            ((0.9, 0.0, 0.0), 2, 65003),
            ((0.0, 0.0, -1.0), 2, 65004),
            ((np.sin(95.1 * DEGREE), 0.0, np.cos(95.1 * DEGREE)), 4, 65004),
        ],
    )
    def test_alarms_instead_of_values(
        self, normal: tuple[float, ...], group13: int, number: int
    ) -> None:
        control = _siemens_control(example_map(), _table(example_map(), 800), TableSettings())
        control.run("PRETRAVEL", 1.0, 0.0, 0.0)
        control.group13 = group13
        with pytest.raises(SiemensAlarm) as alarm:
            control.run("PRETRAVEL", *normal)
        assert alarm.value.number == number
        # Nobody takes this for a pretravel.
        assert control.data["PT_VALUE"].values[0] == 9999.0

    @pytest.mark.parametrize("starts", [1, 20])
    def test_start_after_an_alarm_does_not_go_on(self, starts: int) -> None:
        """It went on with a pretravel of 9999 mm."""
        control = _siemens_control(example_map(), _table(example_map(), 800), TableSettings())
        control.starts = starts
        with pytest.raises(SiemensAlarm, match="65003"):
            control.main("EXTERN PRETRAVEL(REAL,REAL,REAL)\nPRETRAVEL(0.9,0,0)\nR1=PT_VALUE\n", {})
        assert control.starts == 0
        assert len(control.alarms) == starts + 1

    def test_a_table_that_another_program_changed_is_an_alarm(self) -> None:
        control = _siemens_control(example_map(), _table(example_map(), 800), TableSettings())
        control.data["PT_TABLE"].values[7] += 0.0005
        with pytest.raises(SiemensAlarm, match="65005"):
            control.run("PRETRAVEL", 1.0, 0.0, 0.0)

    def test_a_missing_table_is_an_alarm(self) -> None:
        texts = siemens_cycle(example_map(), _table(example_map(), 800))
        control = SiemensControl()
        control.define(texts["PRETRAVEL_GUD.DEF"])
        control.load(texts["PRETRAVEL.SPF"])
        with pytest.raises(SiemensAlarm) as alarm:
            control.run("PRETRAVEL", 1.0, 0.0, 0.0)
        assert alarm.value.number == 65002


class TestVectorRadii:
    def test_travel_is_the_opposite_of_the_normal(self) -> None:
        """A touch toward 30° meets a surface whose normal points to 210°."""
        normals = _assigned(renishaw_variables(lobes(3)))
        travel = _assigned(renishaw_variables(lobes(3), angles="travel"))
        opposite = {510: 514, 511: 515, 512: 516, 513: 517}
        for one, other in opposite.items():
            assert travel[one] == normals[other]
            assert travel[other] == normals[one]
        assert (travel[500], travel[501]) == (normals[500], normals[501])

    @pytest.mark.parametrize("angles", ["normals", "travel"])
    def test_residuals_of_both_meanings(self, angles: str) -> None:
        """By a lookup of the nearest radius along the angle that the head names."""
        text = renishaw_variables(example_map(), angles=angles)
        variables = _assigned(text)
        order = [500, 510, 511, 501, 512, 513, 500, 514, 515, 501, 516, 517]
        azimuth = np.arange(0.1, 360.0, 0.2)
        normals = from_angles(np.pi / 2, azimuth * DEGREE)
        truth = 3.0 - example_map().pretravel(normals)
        turns = {"normals": 0.0, "travel": 180.0}
        left = {}
        for meaning, turn in turns.items():
            sector = np.floor((azimuth + turn + 15.0) / 30.0).astype(int) % 12
            radius = np.array([variables[order[i]] for i in sector])
            left[meaning] = float(np.max(np.abs(radius - truth)) * 1e3)
        told = [float(x) for x in re.findall(r"([\d.]+) UM AT MOST", text)]
        other = "travel" if angles == "normals" else "normals"
        # Two decimals, and 0.1° beside the borders of sectors.
        assert told[0] == pytest.approx(left[angles], abs=0.03)
        assert told[1] == pytest.approx(left[other], abs=0.03)
        assert told[1] > 1.5 * told[0]

    def test_inch(self) -> None:
        mm = _assigned(renishaw_variables(example_map()))
        inch = _assigned(renishaw_variables(example_map(), TableSettings(units="inch")))
        for number, radius in mm.items():
            assert inch[number] * 25.4 == pytest.approx(radius, abs=25.4 * 5e-8 + 5e-8)

    def test_a_control_reads_it(self) -> None:
        control = MacroControl()
        control.load(renishaw_variables(example_map(), TableSettings(base=10550)))
        control.run(7799)
        assert control.variables[10567] == pytest.approx(2.983, abs=1e-3)


class TestDelayTravel:
    def test_in_every_table_a_later_trigger(self) -> None:
        """With 10 µm more travel, pretravel grows and radii and deviations shrink by 10 µm."""
        pretravel_map = lobes(3)
        slow, fast = (heidenhain_table(pretravel_map, travel=t).splitlines()[-1].split()[2]
                      for t in (0.0, 0.01))  # fmt: skip
        assert float(fast) - float(slow) == pytest.approx(-0.01, abs=2e-5)
        table = lookup_table(pretravel_map, tolerance=1.0, most_values=399)
        first = [
            _assigned(_first(fanuc_macro(pretravel_map, table, TableSettings(travel=t))))[601]
            for t in (0.0, 0.01)
        ]
        # Six decimals of 10 mm.
        assert first[1] - first[0] == pytest.approx(0.01, abs=2e-6)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_pretravel_that_is_not_finite_is_named(value: float) -> None:
    with pytest.raises(PretravelError, match="must be finite"):
        check_radii(mean_map(0.01), np.array([0.01, value]))


@pytest.mark.parametrize(
    ("first", "last"),
    [(101, 149), (500, 549), (600, 699), (800, 999), (10001, 10149), (10200, 10499),
     (10500, 10549), (10600, 10699), (10800, 10999)],
)  # fmt: skip
def test_haas_keeps_150_to_199_550_to_599_and_700_to_799(first: int, last: int) -> None:
    """Of its global variables these are the probe's and the control's, in both number ranges."""
    assert free_variables(HAAS.free, first) == last - first + 1
    assert free_variables(HAAS.free, last) == 1
    for beyond in {first - 1, last + 1} - {10499, 10500}:
        with pytest.raises(PretravelError, match=f"variable {beyond} does not belong"):
            free_variables(HAAS.free, beyond)


@pytest.mark.parametrize("name", ["feed", "delay"])
def test_a_map_without_a_feed_or_delay_is_another_one_than_with(name: str) -> None:
    numbers = [
        map_identity(replace(example_map(), **{"feed": 0.0, "delay": None, name: value})).number
        for value in (None, 0.0, 1e-3, 1.0)
        if name == "feed" or value is None or value < 0.03
    ]
    assert len(set(numbers)) == len(numbers)
