"""Tables and formulas in the languages of Fanuc, Haas and Siemens, run by our interpreters; vector
radii of Renishaw's macros."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, ring_pattern
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls.control import ExportSettings
from pretravel.controls.control_table import TableSettings
from pretravel.controls.exports import CONTROLS
from pretravel.controls.fanuc import FANUC
from pretravel.controls.haas import HAAS
from pretravel.controls.lookup import Band
from pretravel.controls.lookup_table import LookupTable
from pretravel.controls.macro_b import macro_programs
from pretravel.controls.renishaw import renishaw_variables
from pretravel.controls.siemens import siemens_cycle
from pretravel.maps.pretravel_map import PretravelMap
from tests.support.example_maps import example_map, lobes, mean_map
from tests.support.macro_b_interpreter import (
    NGC_ALIASES,
    MacroAlarm,
    MacroControl,
    MacroSyntaxError,
)
from tests.support.siemens_interpreter import SiemensAlarm, SiemensControl, SiemensSyntaxError

# In the frame of a probe that is tilted and turned in its holder: scattered directions, and the
# axes and the borders of octants, where angles change their branch.
ROTATION = probe_rotation((0.02, -0.01, 1.0), 0.3)
DIRECTIONS = np.vstack(
    [
        fibonacci_cap(12, 94.0 * DEGREE),
        ring_pattern(np.array([0, 1]) * DEGREE, 4),
        ring_pattern(np.array([45, 90, 94.9]) * DEGREE, 8),
    ]
)
MADE = replace(mean_map(0.016), rotation=ROTATION)
UPRIGHT = mean_map(0.016)
VALUES = 0.012 + 0.004 * np.random.default_rng(3).random((7, 12))
TABLE = LookupTable(Band(0.0, 95.0 * DEGREE), np.where(np.arange(7)[:, None] < 2, 0.014, VALUES))
"""At the pole the same for all azimuths."""
EQUATOR = np.array([1.0, 0.0, 0.0])
# I1 without a decimal point is a thousandth on many controls.
WRONG = (np.array([1.0, 0.1, 0.0]), np.array([0.9, 0.0, 0.0]), np.array([0.001, 0.0, 0.0]))


@dataclass
class _Macro:
    """A control that runs Macro B, with the programs of an export."""

    made_for: str
    texts: Mapping[str, str]
    units: str = "mm"

    def __post_init__(self) -> None:
        self.control = MacroControl(
            two_value_atan=self.made_for != "haas",
            signed_atan=self.made_for == "fanuc, signed angles",
            aliases=NGC_ALIASES if self.made_for == "haas" else (),
        )
        self.control.variables[4006] = 20.0 if self.units == "inch" else 21.0
        for text in self.texts.values():
            self.control.load(text)
        if len(self.texts) == 2:
            self.control.run(7750)

    def value(self, normal: FloatArray) -> float:
        self.control.run(7751, dict(zip("IJK", normal.tolist(), strict=True)))
        found = self.control.variables[100]
        assert found is not None
        return found

    def alarm(self, normal: FloatArray) -> int:
        with pytest.raises(MacroAlarm) as alarm:
            self.value(normal)
        # Not the value of the call before.
        assert self.control.variables[100] is None
        return alarm.value.number % 100

    def other_unit(self) -> None:
        self.control.variables[4006] = 20.0

    def disturb(self) -> None:
        """Another program writes into the table."""
        first = min(n for n in _assigned(next(iter(self.texts.values()))) if n >= 200)
        self.control.load(f"%\nO1000\n#{first + 50}=0\nM99\n%\n")
        self.control.run(1000)

    def fill(self) -> None:
        self.control.run(7750)


@dataclass
class _Siemens:
    """The same of Siemens; it stands at M0 after an alarm."""

    made_for: str
    texts: Mapping[str, str]
    units: str = "mm"

    def __post_init__(self) -> None:
        self.control = SiemensControl(group13=1 if self.units == "inch" else 2)
        self.control.define(self.texts["PRETRAVEL_GUD.DEF"])
        for name in self.texts.keys() - {"PRETRAVEL_GUD.DEF"}:
            self.control.load(self.texts[name])
        if len(self.texts) == 3:
            self.fill()

    def value(self, normal: FloatArray) -> float:
        self.control.run("PRETRAVEL", *normal)
        return self.control.data["PT_VALUE"].values[0]

    def alarm(self, normal: FloatArray) -> int:
        with pytest.raises(SiemensAlarm) as alarm:
            self.value(normal)
        # Nobody takes this for a pretravel.
        assert self.control.data["PT_VALUE"].values[0] == 9999.0
        return alarm.value.number % 100

    def other_unit(self) -> None:
        self.control.group13 = 1

    def disturb(self) -> None:
        self.control.data["PT_TABLE"].values[50] += 0.0005

    def fill(self) -> None:
        self.control.run("PRETRAVEL_TABLE")


def _with_table(
    made_for: str, made: PretravelMap, table: LookupTable = TABLE, **settings: object
) -> _Macro | _Siemens:
    """A control with the program that fills a table, which has run, and the one that reads it."""
    given = TableSettings(**settings)  # type: ignore[arg-type]
    if made_for == "siemens":
        return _Siemens(made_for, siemens_cycle(made, table, given), given.units)
    programs = partial(macro_programs, dialect=HAAS if made_for == "haas" else FANUC)
    return _Macro(made_for, programs(made, table, given), given.units)


def _with_formula(made_for: str, made: PretravelMap, **settings: object) -> _Macro | _Siemens:
    given = ExportSettings(form="formula", **settings)  # type: ignore[arg-type]
    files = CONTROLS[made_for].files(made, given).texts
    assert len(files) == (2 if made_for == "siemens" else 1)
    return (_Siemens if made_for == "siemens" else _Macro)(made_for, files, given.units)


def _assigned(text: str) -> dict[int, float]:
    return {int(n): float(v) for n, v in re.findall(r"^#(\d+)=(-?[\d.]+)", text, re.M)}


every_control = pytest.mark.parametrize("made_for", ["fanuc", "haas", "siemens"])


class TestTables:
    """The files as written, run by an interpreter that refuses what some control refuses."""

    @pytest.mark.parametrize("made_for", ["fanuc", "fanuc, signed angles", "haas", "siemens"])
    @pytest.mark.parametrize("units", ["mm", "inch"])
    def test_lookup_is_that_of_the_table(self, made_for: str, units: str) -> None:
        """Directions on the control are those of the machine, the table is that of the probe."""
        control = _with_table(made_for, MADE, units=units, travel=0.002)
        unit = 25.4 if units == "inch" else 1.0
        found = [unit * control.value(n) for n in DIRECTIONS @ ROTATION.T]
        # Seven decimals of the nodes times the sum of the weights, and of the axes times 0.02 mm.
        assert found == pytest.approx(TABLE.value(DIRECTIONS) + 0.002, abs=1.4e-7 * unit)

    @every_control
    def test_alarms_instead_of_values(self, made_for: str) -> None:
        """101 for the unit, 103 for what is no unit vector, 104 outside: the map holds from 20° to
        95° from the probe's axis."""
        band = Band(20.0 * DEGREE, 95.0 * DEGREE)
        table = LookupTable(band, VALUES)
        control = _with_table(made_for, UPRIGHT, table)
        for edge, beyond in ((95.0, 95.1), (20.0, 19.9)):
            just, off = from_angles(np.array([edge, beyond]) * DEGREE, np.full(2, 0.7))
            assert control.value(just) == pytest.approx(table.value(just[None])[0], abs=1e-6)
            assert control.alarm(off) == 4
        assert control.alarm(np.array([0.0, 0.0, -1.0])) == 4
        for normal in WRONG:
            assert control.alarm(normal) == 3
        control.other_unit()
        assert control.alarm(EQUATOR) == 1

    @every_control
    @pytest.mark.parametrize("units", ["mm", "inch"])
    def test_a_table_that_another_program_changed_is_an_alarm(
        self, made_for: str, units: str
    ) -> None:
        control = _with_table(made_for, UPRIGHT, units=units)
        known = control.value(EQUATOR)
        control.disturb()
        assert control.alarm(EQUATOR) == (5 if made_for == "siemens" else 7)
        control.fill()
        assert control.value(EQUATOR) == known

    @every_control
    def test_a_missing_or_another_table_is_an_alarm(self, made_for: str) -> None:
        control = _with_table(made_for, UPRIGHT)
        texts = dict(control.texts)
        fills = "PRETRAVEL_TABLE.SPF" if made_for == "siemens" else next(iter(texts))
        del texts[fills]
        missing = type(control)(made_for, texts)
        assert missing.alarm(EQUATOR) == 2
        missing.control.load(_with_table(made_for, UPRIGHT, travel=0.001).texts[fills])
        missing.fill()
        assert missing.alarm(EQUATOR) == 2

    def test_programs_of_others_do_not_reach_the_table_of_haas(self) -> None:
        """#500 to #549 are #10500 to #10549 too, as #600 and #800 are: the table ends before."""
        control = _with_table("haas", UPRIGHT)
        before = [control.value(n) for n in DIRECTIONS[:9]]
        lines = "\n".join(f"#{number}=0.14" for number in [*range(100, 200), *range(500, 1000)])
        control.control.load(f"%\nO1000\n{lines}\nM99\n%\n")
        control.control.run(1000)  # type: ignore[arg-type]
        assert [control.value(n) for n in DIRECTIONS[:9]] == before

    @pytest.mark.parametrize(("units", "allowed"), [("mm", (2, 4)), ("inch", (1, 3))])
    def test_siemens_runs_in_the_unit_of_the_table_only(
        self, units: str, allowed: tuple[int, int]
    ) -> None:
        """The 13th group of G functions: 1 is G70, 2 G71, 3 G700, 4 G710; inch are the odd ones."""
        control = _with_table("siemens", UPRIGHT, units=units)
        for group in (1, 2, 3, 4):
            control.control.group13 = group  # type: ignore[union-attr]
            if group in allowed:
                control.value(EQUATOR)
            else:
                assert control.alarm(EQUATOR) == 1

    @pytest.mark.parametrize("starts", [1, 20])
    def test_start_after_an_alarm_does_not_go_on(self, starts: int) -> None:
        """It went on with a pretravel of 9999 mm."""
        control = _with_table("siemens", UPRIGHT).control
        assert isinstance(control, SiemensControl)
        control.starts = starts
        with pytest.raises(SiemensAlarm, match="65003"):
            control.main("EXTERN PRETRAVEL(REAL,REAL,REAL)\nPRETRAVEL(0.9,0,0)\nR1=PT_VALUE\n", {})
        assert control.starts == 0
        assert len(control.alarms) == starts + 1


@cache
def _example(kind: str) -> PretravelMap:
    return replace(example_map(kind), rotation=ROTATION)


class TestFormulas:
    """Tables of the physical map were wrong by 1.24 µm (Haas) and 0.59 (Siemens); its u is 0.13."""

    @every_control
    @pytest.mark.parametrize(
        ("kind", "units", "each"),
        [("physical", "mm", 2), ("harmonic", "mm", 1), ("harmonic", "inch", 5)],
    )
    def test_values(self, made_for: str, kind: str, units: str, each: int) -> None:
        n = DIRECTIONS[DIRECTIONS[:, 2] > -0.01][::each] @ ROTATION.T
        unit = 25.4 if units == "inch" else 1.0
        control = _with_formula(made_for, _example(kind), units=units)
        found = [unit * control.value(normal) for normal in n]
        # Constants of eight digits, seven decimals: nanometres, a hundredth of the u.
        assert found == pytest.approx(_example(kind).pretravel(n), abs=6e-6)

    @every_control
    def test_alarms(self, made_for: str) -> None:
        control = _with_formula(made_for, UPRIGHT)
        assert control.value(EQUATOR) == pytest.approx(0.016)
        assert control.alarm(np.array([0.0, 0.0, -1.0])) == 4
        assert control.alarm(np.array([0.9, 0.0, 0.0])) == 3
        control.other_unit()
        assert control.alarm(EQUATOR) == 1

    @every_control
    def test_the_travel_at_a_feed_is_in_it(self, made_for: str) -> None:
        """A signal delay of 4 ms at 60 mm/min: 4 µm."""
        delayed = replace(mean_map(0.01), delay=0.004, u_delay=1e-5, feed=None)
        control = _with_formula(made_for, delayed, travel=0.004, feed=60.0)
        assert control.value(EQUATOR) == pytest.approx(0.014, abs=1e-7)

    @pytest.mark.parametrize("control", ["fanuc", "haas", "siemens", "linuxcnc"])
    def test_a_map_without_a_formula_is_refused(self, control: str) -> None:
        with pytest.raises(PretravelError, match="has no formula for a control"):
            CONTROLS[control].files(example_map("sectors"), ExportSettings(form="formula"))


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
        assert not re.search(r"\([^)]*_", text)  # the sign for what Macro B cannot print
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
