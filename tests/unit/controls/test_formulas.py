"""The formula of a map in the languages of Fanuc, Haas and Siemens, run by our interpreters."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, ring_pattern
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls.exports import CONTROLS, ExportSettings
from pretravel.files.touches_csv import read_touches
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.qualification.qualify import qualify
from tests.support.example_maps import mean_map
from tests.support.examples import EXAMPLES
from tests.support.macro_b_interpreter import MacroAlarm, MacroControl
from tests.support.siemens_interpreter import SiemensAlarm, SiemensControl

# Scattered directions, and the axes and the borders of octants, where angles change their branch.
DIRECTIONS = np.vstack(
    [fibonacci_cap(60, 89.0 * DEGREE), ring_pattern(np.array([0.0, 45.0, 90.0]) * DEGREE, 8)]
)
ROUNDING = 6e-6
"""Of constants with eight digits, seven decimals: nanometres, a hundredth of the u. [mm]"""


@cache
def example(kind: str) -> PretravelMap:
    touches = read_touches(EXAMPLES / "sphere_touches.csv")
    made = qualify(touches, 24.9987, tip_diameter=6.0, kind=kind).pretravel_map
    # Tilted and turned in its holder.
    return replace(made, rotation=probe_rotation((0.02, -0.01, 1.0), 0.3))


def macro(made: PretravelMap, control: str, units: str) -> MacroControl:
    files = CONTROLS[control].files(made, ExportSettings(form="formula", units=units)).texts
    assert len(files) == 1
    found = MacroControl(two_value_atan=control != "haas")
    found.variables[4006] = 20.0 if units == "inch" else 21.0
    for text in files.values():
        found.load(text)
    return found


def siemens(made: PretravelMap, units: str) -> SiemensControl:
    files = CONTROLS["siemens"].files(made, ExportSettings(form="formula", units=units)).texts
    found = SiemensControl(group13=1 if units == "inch" else 2)
    found.define(files["PRETRAVEL_GUD.DEF"])
    found.load(files["PRETRAVEL.SPF"])
    assert len(files) == 2
    return found


@pytest.mark.parametrize("units", ["mm", pytest.param("inch", marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["physical", "harmonic", "mean"])
class TestValues:
    """Tables of the physical map were wrong by 1.24 µm (Haas) and 0.59 (Siemens); its u is 0.13."""

    def truth(self, kind: str) -> np.ndarray:
        return np.asarray(example(kind).pretravel(DIRECTIONS))

    @pytest.mark.parametrize("control", ["fanuc", "haas"])
    def test_of_macro_b(self, control: str, kind: str, units: str) -> None:
        made = macro(example(kind), control, units)
        found = []
        for normal in DIRECTIONS:
            made.run(7751, dict(zip("IJK", normal.tolist(), strict=True)))
            found.append(made.variables[100] or 0.0)
        unit = 25.4 if units == "inch" else 1.0
        assert np.array(found) * unit == pytest.approx(self.truth(kind), abs=ROUNDING)

    def test_of_siemens(self, kind: str, units: str) -> None:
        made = siemens(example(kind), units)
        found = []
        for normal in DIRECTIONS:
            made.run("PRETRAVEL", *normal)
            found.append(made.data["PT_VALUE"].values[0])
        unit = 25.4 if units == "inch" else 1.0
        assert np.array(found) * unit == pytest.approx(self.truth(kind), abs=ROUNDING)


@pytest.mark.parametrize("control", ["fanuc", "haas"])
def test_alarms_of_macro_b(control: str) -> None:
    made = macro(example("physical"), control, "mm")
    for normal, number in (((0.0, 0.0, -1.0), 104), ((0.9, 0.0, 0.0), 103)):
        with pytest.raises(MacroAlarm, match=str(number)):
            made.run(7751, dict(zip("IJK", normal, strict=True)))
    made.variables[4006] = 20.0
    with pytest.raises(MacroAlarm, match="101"):
        made.run(7751, {"I": 0.0, "J": 0.0, "K": 1.0})


def test_alarms_of_siemens() -> None:
    made = siemens(example("physical"), "mm")
    made.starts = 3
    for normal, number in (((0.0, 0.0, -1.0), 65004), ((0.9, 0.0, 0.0), 65003)):
        with pytest.raises(SiemensAlarm, match=str(number)):
            made.run("PRETRAVEL", *normal)
    made.group13 = 1
    with pytest.raises(SiemensAlarm, match="65001"):
        made.run("PRETRAVEL", 0.0, 0.0, 1.0)


def test_the_travel_at_a_feed_is_in_it() -> None:
    """A signal delay of 4 ms at 60 mm/min: 4 µm."""
    settings = ExportSettings(form="formula", travel=0.004, feed=60.0)
    made = MacroControl()
    delayed = replace(mean_map(0.01), delay=0.004, u_delay=1e-5, feed=None)
    for text in CONTROLS["fanuc"].files(delayed, settings).texts.values():
        made.load(text)
    made.run(7751, {"I": 0.0, "J": 0.0, "K": 1.0})
    assert made.variables[100] == pytest.approx(0.014, abs=1e-7)


@pytest.mark.parametrize("control", ["fanuc", "haas", "siemens", "linuxcnc"])
def test_a_map_without_a_formula_is_refused(control: str) -> None:
    made = qualify(
        read_touches(EXAMPLES / "sphere_touches.csv"), 24.9987, tip_diameter=6.0, kind="sectors"
    ).pretravel_map
    with pytest.raises(PretravelError, match="has no formula for a control"):
        CONTROLS[control].files(made, ExportSettings(form="formula"))
