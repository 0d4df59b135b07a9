"""Traces of the calibration rig with known truth: noise, bounce, spikes, gaps, missing edges."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from pretravel.base.errors import PretravelError
from pretravel.files.rig_csv import read_budget, read_rig_trace
from pretravel.laboratory.rig import RigTouch, RigTrace, at_reference_temperature
from pretravel.laboratory.rig_budget import (
    REN_BUDGET,
    LengthComponent,
    budget_doubts,
    calibration_budget,
    constant_and_slope,
    length_budget,
)
from pretravel.laboratory.rig_calibration import angles_of, calibrate_rig, spread_from
from pretravel.laboratory.rig_events import rig_touch
from pretravel.laboratory.rig_marks import with_marks
from pretravel.laboratory.rig_signals import laser_at_edge, rod_motion
from tests.support.examples import EXAMPLES

UM = 1e-3
# An edge lies anywhere in a sample of 1 ms at 0.05 mm/s, 0.05 um; the noise is 5 nm.
NEAR = 0.04 * UM


@dataclass(frozen=True)
class Made:
    """A rod advances at 0.05 mm/s, rests for 0.2 s, and returns."""

    r0: float = 0.083_213
    pretravel: float = 4.237 * UM
    beyond: float = 3.5 * UM
    hysteresis: float = 0.31 * UM
    compression: float = 0.0  # of tip and rod at the trigger
    rate: float = 1000.0
    speed: float = 0.05
    noise: float = 5e-6

    def trace(self, seed: int = 1) -> RigTrace:
        rng = np.random.default_rng(seed)
        top = self.r0 + self.pretravel + self.beyond
        there = top / self.speed
        time = np.arange(0.0, 2.0 * there + 0.4, 1.0 / self.rate)
        rod = np.interp(time, [0.0, there, there + 0.2, 2.0 * there + 0.2], [0.0, top, top, 0.0])
        out = time < there + 0.1
        zero = np.where(out, self.r0, self.r0 + self.hysteresis)
        pressed = np.maximum(rod - zero, 0.0)
        share = 1.0 - self.compression / self.pretravel
        laser = pressed * share + np.where(out, 0.0, self.hysteresis)
        contact = pressed == 0.0
        trigger = ~((rod >= self.r0 + self.pretravel) & (pressed > 0.0))
        return RigTrace(
            time,
            rod + rng.normal(0.0, self.noise, len(time)),
            laser + rng.normal(0.0, 2e-6, len(time)),
            contact,
            trigger,
            "rig_030_1",
        )

    def check(self, touch: RigTouch, near: float = NEAR) -> None:
        assert touch.r0 == pytest.approx(self.r0, abs=near)
        assert touch.r1 == pytest.approx(self.r0 + self.pretravel, abs=near)
        assert touch.r2 == pytest.approx(self.r0 + self.pretravel + self.beyond, abs=near)
        assert touch.r3 == pytest.approx(self.r0 + self.hysteresis, abs=near)


class TestEvents:
    @pytest.mark.parametrize("seed", range(4))
    def test_clean_trace(self, seed: int) -> None:
        made = replace(Made(), r0=0.08 + 1e-5 * np.random.default_rng(seed).random())
        touch = rig_touch(made.trace(seed))
        made.check(touch)
        assert touch.notes == ()
        assert touch.pretravel == pytest.approx(made.pretravel, abs=0.06 * UM)
        assert touch.hysteresis == pytest.approx(made.hysteresis, abs=0.06 * UM)
        assert touch.zero_shift == pytest.approx(made.hysteresis, abs=0.003 * UM)
        assert touch.feed == pytest.approx(3.0, rel=0.02)

    def test_uncertainty_is_that_of_sampling(self) -> None:
        """A rectangle of 0.05 um: 14 nm. Over many touches the errors have that deviation."""
        off = []
        for seed in range(40):
            made = replace(Made(), r0=0.08 + 1e-3 * np.random.default_rng(seed).random())
            touch = rig_touch(made.trace(seed))
            off.append(touch.r0 - made.r0)
        assert touch.u_r0 == pytest.approx(0.05 * UM / math.sqrt(12.0), rel=0.05)
        assert np.std(off) == pytest.approx(touch.u_r0, rel=0.35)
        assert abs(np.mean(off)) < 0.006 * UM

    def test_tip_that_is_compressed(self) -> None:
        """The laser sees only the tip: rod travel less tip travel is the deformation of both."""
        made = replace(Made(), compression=0.2 * UM)
        touch = rig_touch(made.trace())
        made.check(touch)
        assert touch.tip_compression == pytest.approx(0.2 * UM, abs=0.05 * UM)

    def test_the_laser_at_the_trigger_is_read_from_a_line(self) -> None:
        """Its noise of 2 nm over the root of the 30 samples of a line: 0.4 nm. One sample would
        have 2 nm, and half a sample's travel, 25 nm, of the 0.05 um between two of them."""
        made = replace(Made(), r0=0.083_230, pretravel=4.245 * UM)  # half-way between samples
        off = [rig_touch(made.trace(seed)).tip_displacement - 4.245 * UM for seed in range(30)]
        # The level at rest has over a thousand samples and adds little; 30 draws: 13 %.
        assert np.std(off) == pytest.approx(2e-6 / math.sqrt(30.0), rel=4 * 0.13)
        assert abs(np.mean(off)) < 4.0 * 2e-6 / 30.0

    def test_the_laser_where_a_line_has_too_few_samples(self) -> None:
        trace = Made().trace()
        straight = replace(trace, laser=2.0 * trace.time)
        assert laser_at_edge(straight, 100, slice(98, 101)) == straight.laser[100]
        middle = straight.time[99] + straight.time[100]
        assert laser_at_edge(straight, 100, slice(98, 102)) == pytest.approx(middle, rel=1e-12)

    def test_bounce(self) -> None:
        made = Made()
        trace = made.trace()
        contact, trigger = trace.contact.copy(), trace.trigger.copy()
        down = int(np.argmin(contact))
        contact[down + 1 : down + 6 : 2] = True
        fired = int(np.argmin(trigger))
        trigger[fired + 1 : fired + 7 : 2] = True
        up = len(contact) - int(np.argmin(contact[::-1]))  # first sample after contact is lost
        contact[up - 6 : up - 1 : 2] = True
        touch = rig_touch(replace(trace, contact=contact, trigger=trigger))
        made.check(touch)
        assert len(touch.notes) == 3

    def test_interference_is_not_a_touch(self) -> None:
        made = Made()
        trace = made.trace()
        contact, trigger = trace.contact.copy(), trace.trigger.copy()
        contact[[300, 301, 700]] = False
        trigger[[500, 1100]] = False
        touch = rig_touch(replace(trace, contact=contact, trigger=trigger))
        made.check(touch)
        assert "2 short excursions of the contact signal ignored" in touch.notes
        assert "2 short excursions of the trigger signal ignored" in touch.notes

    def test_interference_just_before_contact(self) -> None:
        """Within the duration of bounce; the laser shows that the tip was at rest."""
        made = replace(Made(), speed=0.2)
        trace = made.trace()
        contact = trace.contact.copy()
        down = int(np.argmin(contact))
        contact[down - 5] = False
        made.check(rig_touch(replace(trace, contact=contact)), near=0.16 * UM)

    def test_missing_contact_signal(self) -> None:
        made = Made()
        trace = made.trace()
        touch = rig_touch(replace(trace, contact=np.ones(len(trace.time), dtype=bool)))
        assert touch.r0 == pytest.approx(made.r0, abs=0.01 * UM)
        assert touch.r3 == pytest.approx(made.r0 + made.hysteresis, abs=0.01 * UM)
        assert any("where the laser starts" in note for note in touch.notes)
        assert any("where the laser stops" in note for note in touch.notes)

    def test_missing_trigger(self) -> None:
        trace = Made().trace()
        touch = rig_touch(replace(trace, trigger=np.ones(len(trace.time), dtype=bool)))
        assert math.isnan(touch.r1)
        assert math.isnan(touch.pretravel)
        assert any("no trigger" in note for note in touch.notes)

    def test_trace_that_ends_before_contact_is_lost(self) -> None:
        made, trace = Made(), Made().trace()
        cut = int(len(trace.time) * 0.48)
        short = RigTrace(
            trace.time[:cut], trace.ruler[:cut], trace.laser[:cut], trace.contact[:cut],
            trace.trigger[:cut],
        )  # fmt: skip
        touch = rig_touch(short)
        assert touch.r0 == pytest.approx(made.r0, abs=NEAR)
        assert math.isnan(touch.r3)
        assert any("not lost" in note for note in touch.notes)

    def test_gap_in_the_samples_widens_u(self) -> None:
        made, trace = Made(), Made().trace()
        down = int(np.argmin(trace.contact))
        keep = np.ones(len(trace.time), dtype=bool)
        keep[down - 10 : down + 10] = False
        gappy = RigTrace(
            trace.time[keep], trace.ruler[keep], trace.laser[keep], trace.contact[keep],
            trace.trigger[keep],
        )  # fmt: skip
        touch = rig_touch(gappy)
        assert touch.u_r0 == pytest.approx(21 * 0.05 * UM / math.sqrt(12.0), rel=0.1)
        assert abs(touch.r0 - made.r0) < 2.0 * touch.u_r0

    @pytest.mark.parametrize(("rate", "speed"), [(200.0, 0.02), (5000.0, 0.5), (1000.0, 0.01)])
    def test_other_rates_and_speeds(self, rate: float, speed: float) -> None:
        made = replace(Made(), rate=rate, speed=speed)
        step = speed / rate
        made.check(rig_touch(made.trace()), near=0.6 * step + 0.01 * UM)

    @pytest.mark.parametrize(("noise", "rest"), [(0.03 * UM, 0.3), (0.1 * UM, 3.0)])
    def test_noise_at_rest_is_no_motion(self, noise: float, rest: float) -> None:
        """A rest before the start, with noise whose velocities are larger than the rod's."""
        made = replace(Made(), noise=noise)
        trace = made.trace()
        count = int(rest * made.rate)
        rng = np.random.default_rng(2)
        still = RigTrace(
            np.arange(count + len(trace.time)) / made.rate,
            np.concatenate([rng.normal(0.0, noise, count), trace.ruler]),
            np.concatenate([rng.normal(0.0, 2e-6, count), trace.laser]),
            np.concatenate([np.ones(count, dtype=bool), trace.contact]),
            np.concatenate([np.ones(count, dtype=bool), trace.trigger]),
        )
        touch = rig_touch(still)
        assert touch.feed == pytest.approx(3.0, rel=0.02)
        made.check(touch, near=NEAR + 0.5 * noise)

    @pytest.mark.parametrize("late", [0, 5, 12, 40])
    def test_trigger_after_the_rod_has_stopped(self, late: int) -> None:
        """R1 is the position of the rod at this time, not that of its extrapolated motion."""
        made, trace = Made(), Made().trace()
        stop = round((made.r0 + made.pretravel + made.beyond) / made.speed * made.rate)
        trigger = np.ones(len(trace.time), dtype=bool)
        trigger[stop + 1 + late : stop + 150] = False
        touch = rig_touch(replace(trace, trigger=trigger))
        assert touch.r1 == pytest.approx(touch.r2, abs=0.06 * UM)

    def test_long_interference_is_told_by_the_laser(self) -> None:
        """15 ms low, long enough to be a contact, before and after the touch."""
        made, trace = Made(), Made().trace()
        contact = trace.contact.copy()
        contact[800:815] = contact[-300:-285] = False
        touch = rig_touch(replace(trace, contact=contact))
        made.check(touch)
        assert len(touch.notes) == 2

    def test_a_spike_of_the_ruler_beside_an_edge(self) -> None:
        made, trace = Made(), Made().trace()
        ruler = trace.ruler.copy()
        ruler[int(np.argmin(trace.contact)) + 4] += 0.5
        made.check(rig_touch(replace(trace, ruler=ruler)))

    def test_signals_and_laser_that_are_wrong_are_named(self) -> None:
        trace = Made().trace()
        inverted = rig_touch(replace(trace, contact=~trace.contact))
        assert any("is it inverted" in note for note in inverted.notes)
        dead = rig_touch(replace(trace, laser=0.0 * trace.laser))
        assert any("laser does not show" in note for note in dead.notes)

    def test_rod_that_does_not_go_forward(self) -> None:
        trace = Made().trace()
        with pytest.raises(PretravelError, match="does not go forward"):
            rig_touch(replace(trace, ruler=-np.sort(trace.ruler)))

    def test_bad_traces_are_refused(self) -> None:
        trace = Made().trace()
        with pytest.raises(PretravelError, match="time does not go forward"):
            replace(trace, time=np.zeros(len(trace.time)))
        with pytest.raises(PretravelError, match="moves"):
            replace(trace, ruler=trace.ruler * 1e-3)

    def test_example_traces(self) -> None:
        """Contact signal and laser, two independent ways to r0 (r3), agree to the sampling."""
        for path in sorted((EXAMPLES / "rig").glob("*.csv")):
            trace = read_rig_trace(path)
            by_signal = rig_touch(trace)
            by_laser = rig_touch(replace(trace, contact=np.ones(len(trace.time), dtype=bool)))
            assert by_signal.r0 == pytest.approx(by_laser.r0, abs=NEAR)
            assert by_signal.r3 == pytest.approx(by_laser.r3, abs=NEAR)

    def test_a_warm_ruler(self) -> None:
        """Grown by 8 ppm at 21 °C: an indicated length of 100 mm is 100.0008 mm."""
        trace = Made().trace()
        assert at_reference_temperature(trace, 21.0, 8e-6).ruler == pytest.approx(
            trace.ruler * 1.000008
        )
        assert at_reference_temperature(trace, 20.0, 8e-6) is trace


class TestMovedMarks:
    """Events that a person moves, of a trace with known events."""

    def test_a_moved_event_covers_both_positions(self) -> None:
        touch = rig_touch(Made().trace())
        moved = with_marks(touch, {"r3": touch.r3 + 0.3 * UM})
        # GUM 4.3.7: the half width of a rectangle, 0.3 µm, over √3, beside the event's own u.
        assert moved.u_r3 == pytest.approx(math.hypot(touch.u_r3, 0.3 * UM / math.sqrt(3.0)))
        assert moved.notes == ("r3 was moved by hand by +0.30 µm; its u covers both positions",)

    def test_the_stop_has_no_u_to_cover(self) -> None:
        touch = rig_touch(Made().trace())
        moved = with_marks(touch, {"r2": touch.r2 - 1.0 * UM})
        assert moved.notes == ("r2 was moved by hand by -1.00 µm",)
        assert (moved.u_r0, moved.u_r1, moved.u_r3) == (touch.u_r0, touch.u_r1, touch.u_r3)

    def test_the_laser_at_a_moved_trigger_is_not_known(self) -> None:
        touch = rig_touch(Made().trace())
        assert math.isnan(with_marks(touch, {"r1": touch.r1 + UM}).tip_displacement)
        assert with_marks(touch, {"r0": touch.r0 + UM}).tip_displacement == touch.tip_displacement

    def test_the_order_is_judged_with_the_moved_events(self) -> None:
        touch = rig_touch(Made().trace())
        (note, _) = with_marks(touch, {"r1": touch.r0 - 0.5 * UM}).notes
        assert note.startswith("the trigger comes before the contact")
        trace = Made().trace()
        trigger = trace.trigger.copy()
        trigger[int(np.argmin(trace.contact)) - 60 : int(np.argmin(trigger))] = False
        wrong = rig_touch(replace(trace, trigger=trigger))
        assert note in wrong.notes
        righted = with_marks(wrong, {"r1": wrong.r0 + 4.0 * UM})
        assert note not in righted.notes
        assert note in with_marks(wrong, {"r3": wrong.r3 + UM}).notes

    def test_an_event_that_the_trace_does_not_show(self) -> None:
        made, trace = Made(), Made().trace()
        silent = rig_touch(replace(trace, trigger=np.ones(len(trace.time), dtype=bool)))
        given = with_marks(silent, {"r1": made.r0 + made.pretravel})
        assert given.pretravel == pytest.approx(made.pretravel, abs=NEAR)
        assert given.notes[-1] == "r1 was set by hand"
        assert given.u_r1 > 0.0

    def test_other_events_and_positions_are_refused(self) -> None:
        touch = rig_touch(Made().trace())
        for marks in ({"r4": 1.0}, {"r0": math.inf}):
            with pytest.raises(PretravelError, match="a mark is r0, r1, r2, r3"):
                with_marks(touch, marks)

    TOUCH = RigTouch("rig_030_1", 1.0, 1.004, 1.008, 1.0003, 2e-5, 3e-5, 4e-5, 0, 0, 3.0, ())

    @pytest.mark.parametrize(("name", "u"), [("r0", 2e-5), ("r1", 3e-5), ("r3", 4e-5)])
    @pytest.mark.parametrize("way", [0.7 * UM, -0.7 * UM])
    def test_u_of_every_event_in_both_ways(self, name: str, u: float, way: float) -> None:
        old = getattr(self.TOUCH, name)
        moved = with_marks(self.TOUCH, {name: old + way})
        assert getattr(moved, name) == old + way
        expected = math.sqrt(u**2 + (0.7 * UM) ** 2 / 3.0)
        assert getattr(moved, f"u_{name}") == pytest.approx(expected, rel=1e-9)
        assert with_marks(self.TOUCH, {name: old}) == self.TOUCH

    def test_u_of_an_event_that_the_trace_does_not_show(self) -> None:
        """That of a contact by signal and by laser, which may differ by 0.3 µm."""
        blank = replace(self.TOUCH, r3=math.nan, u_r3=math.nan)
        assert math.isnan(blank.hysteresis)
        found = with_marks(blank, {"r3": 1.0005})
        assert found.hysteresis == pytest.approx(0.5 * UM, rel=1e-9)
        assert found.u_r3 == pytest.approx(0.3 * UM / math.sqrt(3.0), rel=1e-12)
        assert (found.r0, found.u_r0, found.r1, found.u_r1) == (1.0, 2e-5, 1.004, 3e-5)


class TestCalibration:
    @staticmethod
    def _touches(rng: np.random.Generator, scatter: float = 0.03 * UM) -> list[RigTouch]:
        blank = RigTouch("", 0, 0, 0, 0, 1e-5, 1e-5, 1e-5, 0, 0, 3.0, ())
        touches = []
        for azimuth in range(0, 360, 30):
            true = (3.0 + math.cos(math.radians(3 * azimuth))) * UM
            for k in range(5):
                r0 = 0.08 + 1e-3 * rng.random()
                r1 = r0 + true + rng.normal(0.0, scatter)
                touches.append(
                    replace(blank, trace=f"rig_{azimuth:03d}_{k + 1}", r0=r0, r1=r1, r3=r0 + 3e-4)
                )
        return touches

    def test_figures(self) -> None:
        calibration = calibrate_rig(self._touches(np.random.default_rng(1)))
        assert len(calibration.directions) == 12
        assert calibration.directions[1].azimuth == pytest.approx(math.radians(30.0))
        assert calibration.pretravel == pytest.approx(3.0 * UM, abs=0.02 * UM)
        assert calibration.anisotropy == pytest.approx(2.0 * UM, abs=0.06 * UM)
        # Tukey: 4.88 (12 means, 48 degrees of freedom, tables) s / √5 on either side.
        half = 4.88 * calibration.repeatability.value / math.sqrt(5.0)
        low, high = calibration.anisotropy_interval
        assert high - calibration.anisotropy == pytest.approx(half, rel=0.01)
        assert calibration.anisotropy - low == pytest.approx(half, rel=0.01)
        assert calibration.directions[0].u_pretravel == pytest.approx(
            calibration.repeatability.value / math.sqrt(5.0)
        )
        assert calibration.repeatability.dof == 48
        assert calibration.repeatability.low < 0.03 * UM < calibration.repeatability.high
        assert calibration.starts_differ

    def test_u_of_hysteresis_is_pooled_and_not_below_the_sampling(self) -> None:
        """Shifts 0.30, 0.30 and 0.28, 0.34 µm: s² = (0 + 2 · 0.03²) / 2, so that s is 0.03 µm for
        both. Edges of 0.04 µm each have √2 · 0.04 µm together, which equal shifts do not undo."""
        blank = RigTouch("", 0, 0, 3e-3, 0, 1e-5, 1e-5, 1e-5, 0, 0, 3.0, ())
        shifts = {"rig_000_1": 0.30, "rig_000_2": 0.30, "rig_090_1": 0.28, "rig_090_2": 0.34}
        touches = [replace(blank, trace=name, r1=3e-3, r3=r3 * UM) for name, r3 in shifts.items()]
        for direction in calibrate_rig(touches).directions:
            assert direction.u_hysteresis == pytest.approx(0.03 * UM / math.sqrt(2.0), rel=1e-9)
        rough = [replace(touch, u_r0=0.04 * UM, u_r3=0.04 * UM) for touch in touches]
        for direction in calibrate_rig(rough).directions:
            assert direction.u_hysteresis == pytest.approx(0.04 * UM, rel=1e-9)
        single = calibrate_rig([touches[0], touches[2]])
        assert all(math.isnan(direction.u_hysteresis) for direction in single.directions)

    def test_intervals_cover(self) -> None:
        """95 % over 200 calibrations: with that probability the hits are within the quantiles of
        one in ten thousand, 177 and 199. Tukey's interval of a range covers more: for the two means
        that are apart by it, as that of every pair does. No wider: half of it is the studentised
        range of twelve means over sqrt(5), by tables 4.90 for 40 degrees of freedom and 4.81 for
        60, which gives 4.855 for 48."""
        hits, widths = np.zeros(2), []
        for seed in range(200):
            calibration = calibrate_rig(self._touches(np.random.default_rng(seed)))
            low, high = calibration.anisotropy_interval
            widths.append((high - low) / calibration.repeatability.value)
            hits += [
                calibration.repeatability.low <= 0.03 * UM <= calibration.repeatability.high,
                low <= 2.0 * UM <= high,
            ]
        fewest, most = stats.binom.ppf([1e-4, 1.0 - 1e-4], 200, 0.95)
        assert most < 200
        assert fewest <= hits[0] <= most
        assert hits[1] >= fewest
        # Where a good touch is left out as an outlier, the interval is a little wider.
        assert np.median(widths) == pytest.approx(2.0 * 4.855 / math.sqrt(5.0), rel=2e-3)

    def test_chi_square_interval(self) -> None:
        """NIST's example form: s = 1, nu = 16 gives 0.745 to 1.522 (chi-square 28.845, 6.908)."""
        spread = spread_from(16.0, 16)
        assert spread.low == pytest.approx(math.sqrt(16 / 28.845), rel=1e-4)
        assert spread.high == pytest.approx(math.sqrt(16 / 6.908), rel=1e-4)

    def test_names(self) -> None:
        assert angles_of("rig_330_5")[0] == pytest.approx(math.radians(330.0))
        assert math.isnan(angles_of("trace")[0])

    def test_nothing_that_triggers(self) -> None:
        touches = [replace(t, r1=math.nan) for t in self._touches(np.random.default_rng(1))[:2]]
        with pytest.raises(PretravelError, match="no trace has a pretravel"):
            calibrate_rig(touches)

    def test_isotropic_probe(self) -> None:
        """No anisotropy at all: the interval reaches down to zero in 95 of 100."""
        hits = 0
        blank = RigTouch("", 0, 0, 0, 0, 1e-5, 1e-5, 1e-5, 0, 0, 3.0, ())
        for seed in range(100):
            rng = np.random.default_rng(seed)
            touches = [
                replace(blank, trace=f"rig_{30 * d:03d}_{k}", r1=3e-3 + rng.normal(0.0, 3e-4))
                for d in range(12)
                for k in range(5)
            ]
            hits += calibrate_rig(touches).anisotropy_interval[0] == 0.0
        assert hits >= 88

    def test_a_direction_touched_once_has_a_larger_uncertainty(self) -> None:
        calibration = calibrate_rig(self._touches(np.random.default_rng(1)))
        once, often = (
            length_budget(calibration_budget(calibration, count=count), 0.003).combined
            for count in (1, 20)
        )
        assert (
            once > calibration.repeatability.value > often - length_budget(REN_BUDGET, 0).combined
        )

    def test_own_repeatability_in_the_budget(self) -> None:
        calibration = calibrate_rig(self._touches(np.random.default_rng(1)))
        own = calibration_budget(calibration)
        sources = [c.source for c in own]
        assert not any(source.startswith("repeatability at") for source in sources)
        mean = next(c for c in own if "repeatability of pretravel, mean of 5" in c.source)
        assert mean.constant == pytest.approx(calibration.repeatability.value / math.sqrt(5.0))


def test_budget_file(tmp_path: Path) -> None:
    path = tmp_path / "budget.csv"
    path.write_text("source,type,uncertainty_um,per_metre_um\nscale,B,0.02,\nheat,A,,0.1\n")
    scale, heat = read_budget(path)
    assert (scale.constant, scale.per_length) == (pytest.approx(0.02 * UM), 0.0)
    assert (heat.constant, heat.per_length) == (0.0, pytest.approx(0.1e-6))
    path.write_text("source,type,uncertainty_um,per_metre_um\nscale,C,0.02,\n")
    with pytest.raises(PretravelError, match="line 2: type is 'C'"):
        read_budget(path)


def test_degrees_of_freedom_of_a_budget_file(tmp_path: Path) -> None:
    """A source of type A alone: U has Student's k, 95.45 % for 4 degrees (GUM, Table G.2)."""
    path = tmp_path / "budget.csv"
    head = "source,type,uncertainty_um,per_metre_um"
    path.write_text(f"{head},dof,remark\nscale,A,0.02,,4,five runs\nheat,A,,0.1,,\n")
    scale, heat = read_budget(path)
    assert (scale.dof, heat.dof) == (4.0, math.inf)
    assert length_budget([scale], 0.0).coverage_factor() == pytest.approx(2.87, abs=0.005)
    path.write_text(f"{head},dof\nscale,A,0.02,,0\n")
    with pytest.raises(PretravelError, match="line 2: dof is '0'"):
        read_budget(path)


@pytest.mark.parametrize("column", ["k", "divisor", "dof_eff"])
def test_a_column_that_a_budget_does_not_have_is_refused(tmp_path: Path, column: str) -> None:
    path = tmp_path / "budget.csv"
    path.write_text(f"source,type,uncertainty_um,per_metre_um,{column}\nscale,B,0.02,,2\n")
    with pytest.raises(PretravelError, match=f"a budget has no column '{column}'"):
        read_budget(path)


def test_a_budget_in_millimetres_is_doubted() -> None:
    """0.05 µm, written as 0.00005 into a column in µm; a source without a number is named."""
    assert not budget_doubts([LengthComponent("laser", "B", 0.05 * UM)])
    (small,) = budget_doubts([LengthComponent("laser", "B", 0.00005 * UM)])
    assert "5e-05 µm together" in small
    empty, _ = budget_doubts([LengthComponent("laser", "B")])
    assert "'laser'" in empty


def test_ren_budget_is_the_papers() -> None:
    """U = k sqrt(0.0999² + (0.129 L)²) um, L in m."""
    constant, slope = constant_and_slope(REN_BUDGET)
    assert constant / UM == pytest.approx(0.0999, abs=5e-5)
    assert slope * 1e6 == pytest.approx(0.129, abs=5e-4)
    for length in (0.0, 5.0, 1000.0):
        expected = math.hypot(0.0999, 0.129 * length / 1000.0)
        assert length_budget(REN_BUDGET, length).combined / UM == pytest.approx(expected, abs=5e-4)


def test_the_speed_of_a_rod_that_is_out_after_four_samples() -> None:
    """Speed is way over time from 20 % to 80 % of the way, to the top sample where it is quick."""
    steps = np.concatenate([np.zeros(60), [0.25, 0.5, 0.75], np.ones(60), np.zeros(60)])
    level = np.ones(len(steps), dtype=bool)
    time = 0.01 * np.arange(len(steps))
    trace = RigTrace(time, 0.4 * steps, np.zeros(len(steps)), level, level)
    assert rod_motion(trace).speed == pytest.approx(0.1 / 0.01, rel=1e-12)


def test_phases_of_the_rod_follow_one_another() -> None:
    """Out, at rest, back: no sample is lost between them, none counts twice."""
    made = Made()
    motion = rod_motion(made.trace())
    assert motion.forward.stop == motion.standing.start
    assert motion.standing.stop == motion.back.start
    there = (made.r0 + made.pretravel + made.beyond) / made.speed * made.rate
    ends = [motion.forward.start, motion.standing.start, motion.back.start, motion.back.stop]
    assert ends == pytest.approx([0.0, there, there + 200.0, 2.0 * there + 200.0], abs=4.0)
