"""What files of a rig state in comments, names and remarks: used, refused or named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.laboratory.rig.budget import (
    LengthComponent,
    abbe_component,
    budget_doubts,
    counted_twice,
    thermal_components,
)
from pretravel.laboratory.rig.calibration import calibrate_rig, doubts_of_names
from pretravel.laboratory.rig.events import rig_touch
from pretravel.laboratory.rig.rig_csv import read_budget, read_rig_trace, read_scale_check
from pretravel.laboratory.rig.signals import rod_motion
from pretravel.laboratory.rig.stated_of_traces import with_comments
from pretravel.laboratory.rig.trace import RigTouch, RigTrace, doubts_of_ruler, notes_of_touches
from tests.support.commands import both_outputs

UM = 1e-3
COLUMNS = "time_s,ruler_mm,laser_mm,contact,trigger\n"
BUDGET = "source,type,uncertainty_um,per_metre_um,remark\n"


def _trace(
    name: str = "rig_060_1",
    *,
    pretravel: float = 4 * UM,
    laser: float = 1.0,
    interval: float = 1e-3,
) -> RigTrace:
    """A rod that goes 0.1 µm in each sample; contact at 20 µm, turn 10 µm after the trigger."""
    out = 0.1 * UM * np.arange(round((30 * UM + pretravel) / (0.1 * UM)))
    rod = np.concatenate([np.zeros(100), out, np.full(61, out[-1]), out[::-1], np.zeros(100)])
    pressed = np.maximum(rod - 20.01 * UM, 0.0)
    time = interval * np.arange(len(rod))
    trigger = rod <= 20.01 * UM + pretravel
    return RigTrace(time, rod, 3 * UM + laser * pressed, pressed == 0.0, trigger, name)


def _written(folder: Path, trace: RigTrace, before: str = "", among: str = "") -> Path:
    rows = [
        f"{t:.4f},{r:.6f},{las:.6f},{int(c)},{int(g)}\n"
        for t, r, las, c, g in zip(
            trace.time, trace.ruler, trace.laser, trace.contact, trace.trigger, strict=True
        )
    ]
    path = folder / f"{trace.name}.csv"
    path.write_text(before + COLUMNS + "".join(rows[:200]) + among + "".join(rows[200:]))
    return path


def _noted(folder: Path, *comments: str, temperature: float = 20.0) -> list[str]:
    """Notes of traces that have these comments."""
    traces = [
        read_rig_trace(_written(folder, _trace(f"rig_060_{i}"), comment))
        for i, comment in enumerate(comments)
    ]
    return notes_of_touches(with_comments(traces, [*map(rig_touch, traces)], temperature))


class TestCommentsOfTraces:
    @pytest.mark.parametrize(
        ("comment", "said"),
        [
            ("# unit: µm\n", "line 1: '# unit: µm' gives the unit µm"),
            ("# laser in V, 10 µm/V\n", "line 1: '# laser in V, 10 µm/V' gives the unit V"),
        ],
    )
    def test_another_unit_is_refused(self, tmp_path: Path, comment: str, said: str) -> None:
        with pytest.raises(InputError, match=said):
            read_rig_trace(_written(tmp_path, _trace(), comment))

    def test_a_change_among_the_rows_is_refused(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="line 202: '# tip changed' is between the rows"):
            read_rig_trace(_written(tmp_path, _trace(), among="# tip changed\n"))

    @pytest.mark.parametrize(
        ("comment", "said"),
        [
            ("# sampling rate: 5 kHz\n", "time_s has a sample every 1 ms"),
            ("# feed 3 mm/min\n", "the rod has 6 mm/min"),
            ("# azimuth 120 deg\n", "the name gives the azimuth 60°"),
        ],
    )
    def test_what_the_trace_shows_otherwise_is_refused(
        self, tmp_path: Path, comment: str, said: str
    ) -> None:
        with pytest.raises(PretravelError, match=f"rig_060_0, line 1: .*{said}"):
            _noted(tmp_path, comment)

    def test_what_the_trace_shows_too_is_used(self, tmp_path: Path) -> None:
        """0.1 mm/s is 6 mm/min."""
        stated = "# sampling rate: 1 kHz\n# feed 0.1 mm/s\n# azimuth 60 deg\n# coffee\n"
        assert _noted(tmp_path, f"{stated}# temperature 24.2 °C\n", temperature=24.0) == []

    def test_everything_else_is_named(self, tmp_path: Path) -> None:
        tips = ["# tip diameter 6 mm\n", "# tip diameter 2 mm\n"]
        assert _noted(tmp_path, *tips) == [
            "rig_060_0: not read: '# tip diameter 6 mm'",
            "rig_060_1: not read: '# tip diameter 2 mm'",
        ]
        (warm,) = _noted(tmp_path, "# temperature 27 °C\n")
        assert warm.endswith("'# temperature 27 °C', and the ruler is taken to be at 20 °C")

    def test_numbers_of_each_trace_are_one_note(self, tmp_path: Path) -> None:
        (note,) = _noted(tmp_path, *(f"# probe SN 1 at {20 + i} mm\n" for i in range(4)))
        assert "and 1 more: not read: '# probe SN … at … mm'" in note

    def test_a_trace_of_another_day_is_named(self, tmp_path: Path) -> None:
        days = ["# 2026-03-02\n", "# 02.03.2026\n", "# 2024-01-02\n"]
        (note,) = _noted(tmp_path, *days)
        assert note.startswith("rig_060_2: dated 2024-01-02, most traces 2026-03-02")


class TestOtherTables:
    def test_a_scale_in_another_unit(self, tmp_path: Path) -> None:
        path = tmp_path / "scale.csv"
        rows = "".join(f"{x:.3f},{x:.3f}\n" for x in np.linspace(0.0, 1.0, 30))
        path.write_text(f"# readings in inch\nscale_mm,reference_mm\n{rows}")
        with pytest.raises(InputError, match=r"line 1: .* gives the unit inch"):
            read_scale_check(path)

    def test_comments_of_budget_and_scale_are_named(self, tmp_path: Path) -> None:
        for azimuth in (0, 60, 120):
            for repeat in (1, 2):
                _written(tmp_path, _trace(f"rig_{azimuth:03d}_{repeat}"))
        budget, scale = tmp_path / "budget.txt", tmp_path / "scale.txt"
        budget.write_text(f"# valid until 2024-12-31\n{BUDGET}ruler temperature,B,0.02,0.1,\n")
        rows = "".join(f"{x:.3f},{x:.5f}\n" for x in np.linspace(0.0, 1.0, 30))
        scale.write_text(f"# temperature 25 °C\nscale_mm,reference_mm\n{rows}")
        _, said = both_outputs(
            "rig", tmp_path, "--budget", budget, "--scale", scale,
            "--u-temperature", 0.01, "--u-expansion", 1,
        )  # fmt: skip
        said = " ".join(said.split())
        assert "budget.txt: not read: line 1 '# valid until 2024-12-31'" in said
        assert "scale.txt: not read: line 1 '# temperature 25 °C'" in said
        assert "'ruler temperature' of the budget counts in addition to the uncertainties" in said
        assert "the budget has no source 'grating scale …'" in said


class TestBudgets:
    def test_a_result_is_no_source(self, tmp_path: Path) -> None:
        path = tmp_path / "budget.csv"
        path.write_text(f"{BUDGET}probing,A,0.03,,\nExpanded U (k = 2),A,0.06,,\n")
        with pytest.raises(InputError, match=r"line 3: 'Expanded U \(k = 2\)' is a result"):
            read_budget(path)

    @pytest.mark.parametrize("remark", ["U, k = 3", "rectangular", "±0.03 µm", "5 %"])
    def test_words_of_another_uncertainty_are_named(self, tmp_path: Path, remark: str) -> None:
        path = tmp_path / "budget.csv"
        path.write_text(f'{BUDGET}probing,A,0.03,,"{remark}"\n')
        (doubt,) = budget_doubts(read_budget(path))
        assert doubt.startswith(f"the budget says 'probing, {remark}': its numbers are taken as")
        path.write_text(f'{BUDGET}probing,A,0.03,,"{remark}, divided"\n')
        assert budget_doubts(read_budget(path)) == ()

    def test_a_rig_that_measures_nothing(self) -> None:
        (doubt,) = budget_doubts([LengthComponent("probing", "A", 34 * UM)])
        assert "have u = 34 µm together, too much" in doubt

    def test_a_second_repeatability_is_named(self) -> None:
        (doubt,) = budget_doubts([LengthComponent("trigger repeatability", "A", 0.06 * UM)])
        assert doubt.startswith("'trigger repeatability' of the budget counts in addition")

    def test_only_the_same_temperature_counts_twice(self) -> None:
        own = thermal_components(
            expansion=8e-6, deviation=0.0, u_expansion=1e-6, u_temperature=0.01
        )
        apart = LengthComponent("temperature distribution (10 mK)", "A", 0.0, 1e-7)
        assert counted_twice((*own, apart)) == ()

    @pytest.mark.parametrize(("tilt", "shown"), [(-2e-6, "-2"), (2e-12, "2e-06")])
    def test_a_tilt_of_another_unit_is_refused(self, tilt: float, shown: str) -> None:
        with pytest.raises(PretravelError, match=f"tilt is {shown} µrad"):
            abbe_component(10.0, tilt)


class TestNames:
    def test_two_series(self) -> None:
        (doubt,) = doubts_of_names(["rig_000_1", "probeB_030_1", "top_1"])
        assert doubt.startswith("the names of the traces begin with 'probeB' and 'rig':")
        assert doubts_of_names(["rig_000_1", "rig_030p45_2", "rig_+Z_1", "top_1"]) == ()

    def test_an_azimuth_without_a_repeat(self) -> None:
        (doubt,) = doubts_of_names(["rig_060"])
        assert "touch 60 in the direction 'rig'" in doubt


class TestSignals:
    def test_time_in_ms(self) -> None:
        (note,) = rig_touch(_trace(interval=1.0)).notes
        assert note.startswith("the samples are 1000 ms apart")

    @pytest.mark.parametrize(("factor", "shown"), [(1000.0, "1000"), (-1.0, "-1")])
    def test_a_laser_of_another_unit_or_sign(self, factor: float, shown: str) -> None:
        notes = rig_touch(_trace(laser=factor)).notes
        assert notes[0].startswith(f"the laser moves by about {shown} µm for each µm of the rod")

    def test_a_record_that_begins_after_the_contact(self) -> None:
        trace, late = _trace(), 320  # sample 301 is the contact
        parts = (trace.time, trace.ruler, trace.laser, trace.contact, trace.trigger)
        with pytest.raises(PretravelError, match="the trace must begin before the contact"):
            rod_motion(RigTrace(*(part[late:] for part in parts), "rig_060_1"))

    def test_the_ruler_in_fahrenheit_or_per_kelvin(self) -> None:
        assert doubts_of_ruler(20.5, 8.0) == doubts_of_ruler(20.0, 0.0) == ()
        (doubt,) = doubts_of_ruler(20.0, 8e-6)
        assert "was 1/K meant?" in doubt


class TestRepeatsBetweenTheSameSamples:
    """Second touches 1 nm from the first ones say less than the sampling, 0.04 µm."""

    @staticmethod
    def _touches(**other: float) -> list[RigTouch]:
        found = []
        for azimuth in range(0, 360, 60):
            for repeat in (1, 2):
                name = f"rig_{azimuth:03d}_{repeat}"
                r1, u = 1.0 + 5 * UM + other.get(name, 1e-6 * repeat), 0.03 * UM
                found.append(RigTouch(name, 1.0, r1, 1.02, 1.0, u, u, u, 5 * UM, 0.0, 6.0, ()))
        return found

    def test_one_sample_more_is_no_worn_seat(self) -> None:
        found = calibrate_rig(self._touches(rig_240_2=0.1 * UM), search_outliers=False)
        assert not any(d.scatters_more for d in found.directions)

    def test_one_micrometre_more_is(self) -> None:
        found = calibrate_rig(self._touches(rig_240_2=1.0 * UM), search_outliers=False)
        assert [d.name for d in found.directions if d.scatters_more] == ["rig_240"]

    def test_passes_that_are_alike_do_not_drift(self) -> None:
        assert calibrate_rig(self._touches()[:-1]).passes is None
