"""Events of an ideal rod, whose numbers follow by hand, and of a rod with noise.

The ideal rod goes 0.1 µm in each sample of 1 ms: at rest to sample 100, out to 28 µm at sample 380,
at rest for 60 samples, and back. It meets the tip at 20 µm; on the way back the tip stays 0.4 µm
further out.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig.events import rig_touch
from pretravel.laboratory.rig.marks import with_marks
from pretravel.laboratory.rig.signals import rod_motion
from pretravel.laboratory.rig.trace import (
    RigTouch,
    RigTrace,
    at_reference_temperature,
    notes_of_touches,
)

UM = 1e-3
STEP = 0.1 * UM
RULER = np.concatenate(
    [np.zeros(100), STEP * np.arange(280), np.full(61, 280 * STEP), STEP * np.arange(279, -1, -1),
     np.zeros(100)]
)  # fmt: skip
OUT = np.arange(len(RULER)) < 410
MEETS = np.where(OUT, 20.0, 20.4) * UM
LASER = 3.0 * UM + np.maximum(RULER - MEETS, 0.0) + np.where(OUT, 0.0, 0.4 * UM)
TIME = 1e-3 * np.arange(float(len(RULER)))
# Away from the grid of samples, so that no sample is exactly at an event.
CONTACT = RULER < MEETS + 0.01 * UM
TRIGGER = ~(RULER > 24.01 * UM)
SILENT = np.ones(len(RULER), dtype=bool)
U_EDGE = STEP / math.sqrt(12.0)


def _low(level: np.ndarray, *parts: slice) -> np.ndarray:
    changed = level.copy()
    for part in parts:
        changed[part] = False
    return changed


def _high(level: np.ndarray, *parts: slice) -> np.ndarray:
    return ~_low(~level, *parts)


def _trace(
    *, laser: FloatArray = LASER, contact: np.ndarray = CONTACT, trigger: np.ndarray = TRIGGER
) -> RigTrace:
    return RigTrace(TIME, RULER, laser, contact, trigger, "rig_030_1")


def _some(trace: RigTrace, kept: slice | np.ndarray) -> RigTrace:
    """A trace of which some samples are missing."""
    names = ("time", "ruler", "laser", "contact", "trigger")
    return replace(trace, **{name: getattr(trace, name)[kept] for name in names})


class TestEvents:
    @pytest.mark.published(
        "Ren 2020", "Equation 2",
        what="pretravel r1 − r0",
        ours="4.000 µm of an ideal rod, as by hand",
        theirs="the same",
        verdict="agrees",
        command="pretravel rig",
    )  # fmt: skip
    @pytest.mark.published(
        "Ren 2020", "Equation 3",
        what="hysteresis r3 − r0",
        ours="0.400 µm of an ideal rod, as by hand",
        theirs="the same",
        verdict="agrees",
    )  # fmt: skip
    @pytest.mark.published(
        "Ren 2020", "Figure 4",
        what="sequence of signals",
        ours="r0 to r3 of an ideal rod, as by hand; with noise within u",
        theirs="drawing",
        verdict="agrees",
    )  # fmt: skip
    def test_every_field(self) -> None:
        touch = rig_touch(_trace())
        assert touch.trace == "rig_030_1"
        # Edges are half-way between samples 301 and 300, 341 and 340.
        assert touch.r0 == pytest.approx(20.05 * UM, abs=1e-9)
        assert touch.r1 == pytest.approx(24.05 * UM, abs=1e-9)
        assert touch.r2 == pytest.approx(28.0 * UM, abs=1e-9)
        assert touch.r3 == pytest.approx(20.45 * UM, abs=1e-9)
        for u in (touch.u_r0, touch.u_r1, touch.u_r3):
            assert u == pytest.approx(U_EDGE, rel=1e-6)
        assert touch.tip_displacement == pytest.approx(4.05 * UM, abs=1e-9)
        assert touch.zero_shift == pytest.approx(0.4 * UM, abs=1e-9)
        assert touch.feed == pytest.approx(6.0, rel=1e-9)  # 0.1 mm/s
        assert touch.notes == ()
        assert touch.pretravel == pytest.approx(4.0 * UM, abs=1e-9)
        assert touch.hysteresis == pytest.approx(0.4 * UM, abs=1e-9)
        assert touch.tip_compression == pytest.approx(-0.05 * UM, abs=1e-9)
        assert touch.u_pretravel == pytest.approx(math.sqrt(2.0) * U_EDGE, rel=1e-6)

    @pytest.mark.published("Ren 2020", "Figure 4")
    @pytest.mark.parametrize(("rate", "speed"), [(1000.0, 0.05), (5000.0, 0.5)])
    def test_uncertainty_is_that_of_sampling(self, rate: float, speed: float) -> None:
        """An edge lies anywhere in a sample: a rectangle of 0.05 µm, 14 nm, or of twice as much.
        The ruler has 5 nm of noise, the laser 2 nm."""
        step, off = speed / rate, []
        for seed in range(30):
            rng = np.random.default_rng(seed)
            r0 = 0.03 + 1e-3 * rng.random()
            top = r0 + 8.0 * UM
            there = top / speed
            time = np.arange(0.0, 2.0 * there + 0.4, 1.0 / rate)
            rod = np.interp(time, [0.0, there, there + 0.2, 2.0 * there + 0.2], [0, top, top, 0])
            pressed = np.maximum(rod - r0, 0.0)
            trace = RigTrace(
                time, rod + 5e-6 * rng.standard_normal(len(time)),
                pressed + 2e-6 * rng.standard_normal(len(time)), pressed == 0.0, rod < r0 + 4 * UM,
            )  # fmt: skip
            touch = rig_touch(trace)
            assert touch.notes == ()
            assert touch.feed == pytest.approx(60.0 * speed, rel=0.02)
            off += [touch.r0 - r0, touch.r1 - r0 - 4.0 * UM, touch.r3 - r0]
        assert touch.u_r0 == pytest.approx(step / math.sqrt(12.0), rel=0.05)
        # 90 draws of a rectangle know its deviation to 5 %; its mean to 6 % of a step.
        assert np.std(off) == pytest.approx(touch.u_r0, rel=0.2)
        assert abs(np.mean(off)) < 0.12 * step

    def test_a_gap_in_the_samples_widens_u(self) -> None:
        kept = np.ones(len(RULER), dtype=bool)
        kept[296:306] = False
        touch = rig_touch(_some(_trace(), kept))
        assert touch.u_r0 == pytest.approx(11.0 * U_EDGE, rel=1e-3)
        assert abs(touch.r0 - 20.0 * UM) < 2.0 * touch.u_r0

    def test_the_trigger_falls_twice_or_bounces(self) -> None:
        touch = rig_touch(_trace(trigger=_high(TRIGGER, slice(355, 370))))
        assert touch.notes == ("the trigger signal fell 2 times on the way; the first counts",)
        assert touch.r1 == pytest.approx(24.05 * UM, abs=1e-9)
        touch = rig_touch(_trace(trigger=_high(TRIGGER, slice(343, 345))))
        assert touch.notes == ("the trigger signal bounced; its first edge counts",)
        assert touch.r1 == pytest.approx(24.05 * UM, abs=1e-9)

    def test_a_trigger_before_the_way_back_counts(self) -> None:
        """The rod leaves its stand, 28 µm, with sample 442: one step below it is still there."""
        stop = rod_motion(_trace()).standing.stop
        assert stop in (442, 443)
        at = rig_touch(_trace(trigger=_low(SILENT, slice(stop - 1, 480))))
        assert at.r1 == pytest.approx(28.0 * UM, abs=2 * STEP)
        assert at.notes == ()
        beyond = rig_touch(_trace(trigger=_low(SILENT, slice(stop, 480))))
        assert math.isnan(beyond.r1)
        assert math.isnan(beyond.tip_displacement)
        assert beyond.notes == (
            "no trigger: the signal changes only on the way back, so r1 is unknown",
        )
        silent = rig_touch(_trace(trigger=SILENT))
        assert silent.notes == ("no trigger: the signal never changes, so r1 is unknown",)
        assert math.isnan(silent.u_r1)
        assert math.isnan(silent.pretravel)

    def test_a_contact_before_the_way_back_counts(self) -> None:
        stop = rod_motion(_trace()).standing.stop
        for first, known in ((stop - 1, True), (stop, False)):
            contact = _low(SILENT, slice(first, 600))
            notes = rig_touch(_trace(contact=contact)).notes
            assert any("signal and laser differ" in note for note in notes[:1]) == known
            words = "the contact signal has no edge; r0 is where the laser starts to move"
            assert (words in notes) == (not known)

    def test_a_contact_lost_after_the_way_out_counts(self) -> None:
        start = rod_motion(_trace()).standing.start
        assert start in (379, 380)
        for first, known in ((start, True), (start - 1, False)):
            contact = _low(SILENT, slice(301, first))
            notes = rig_touch(_trace(contact=contact)).notes
            words = "the contact signal has no edge on the way back; r3 is where the laser stops"
            assert (words in notes) == (not known)

    @pytest.mark.parametrize(("earlier", "told"), [(2, False), (5, True), (20, True)])
    def test_where_contact_and_laser_differ_u_covers_both(self, earlier: int, told: bool) -> None:
        """The laser starts at 20 µm; a rectangle of half the width of the distance, over √3."""
        touch = rig_touch(_trace(contact=_low(CONTACT, slice(301 - earlier, 310))))
        r0 = 20.05 - 0.1 * earlier
        assert touch.r0 == pytest.approx(r0 * UM, abs=1e-9)
        if not told:
            assert (touch.notes, touch.u_r0) == ((), pytest.approx(U_EDGE, rel=1e-6))
            return
        expected = math.hypot(U_EDGE, (20.0 - r0) * UM / math.sqrt(3.0))
        assert touch.u_r0 == pytest.approx(expected, rel=1e-3)
        (note,) = touch.notes
        assert note == (
            f"where contact is made, contact signal and laser differ by {20.0 - r0:.2f} µm; the "
            "signal counts, u covers both"
        )

    def test_contact_and_its_loss_without_the_signal(self) -> None:
        """The laser starts at 20 µm and stops at 20.4 µm; a rectangle of ±0.3 µm."""
        touch = rig_touch(_trace(contact=SILENT))
        assert (touch.r0, touch.r3) == pytest.approx((20.0 * UM, 20.4 * UM), abs=1e-9)
        assert (touch.u_r0, touch.u_r3) == pytest.approx((0.3 * UM / math.sqrt(3.0),) * 2)
        assert touch.notes == (
            "the contact signal has no edge; r0 is where the laser starts to move",
            "the contact signal has no edge on the way back; r3 is where the laser stops",
        )

    def test_contact_and_its_loss_without_the_laser(self) -> None:
        still = _trace(laser=np.full(len(RULER), 3.0 * UM))
        touch = rig_touch(still)
        assert touch.notes == (
            "the laser does not show where contact is made; only the signal does",
            "the laser does not show where contact is lost; only the signal does",
        )
        assert (touch.r0, touch.r3) == pytest.approx((20.05 * UM, 20.45 * UM), abs=1e-9)
        assert touch.u_r0 == pytest.approx(U_EDGE, rel=1e-6)
        dead = rig_touch(replace(still, contact=SILENT))
        assert dead.notes == (
            "no contact: neither the signal nor the laser shows one",
            "contact is not lost within the trace, so r3 is unknown",
        )
        assert math.isnan(dead.r0)
        assert math.isnan(dead.r3)
        twice = replace(still, contact=_low(_high(CONTACT, slice(450, 470)), slice(600, 620)))
        assert "contact was lost more than once on the way back; the first counts" in (
            rig_touch(twice).notes
        )

    def test_a_trace_that_ends_before_contact_is_lost(self) -> None:
        touch = rig_touch(_some(_trace(), slice(450)))
        assert touch.notes == ("contact is not lost within the trace, so r3 is unknown",)
        assert math.isnan(touch.r3)
        assert (touch.r0, touch.r1) == pytest.approx((20.05 * UM, 24.05 * UM), abs=1e-9)

    def test_contact_is_lost_more_than_once(self) -> None:
        touch = rig_touch(_trace(contact=_high(CONTACT, slice(450, 470))))
        words = "contact was lost more than once on the way back; the one where the laser stops co"
        assert touch.notes == (f"{words}unts",)
        assert touch.r3 == pytest.approx(20.45 * UM, abs=1e-9)

    @pytest.mark.published("Ren 2020", "Figure 4")
    def test_bounces_of_the_contact(self) -> None:
        made = rig_touch(_trace(contact=_high(CONTACT, slice(303, 305))))
        assert made.notes == ("the contact signal bounced; its first edge counts",)
        assert made.r0 == pytest.approx(20.05 * UM, abs=1e-9)
        lost = rig_touch(_trace(contact=_high(CONTACT, slice(512, 514))))
        assert lost.notes == ("the contact signal bounced when it was lost; its last edge counts",)
        assert lost.r3 == pytest.approx(20.45 * UM, abs=1e-9)

    @pytest.mark.parametrize("part", [slice(250, 265), slice(296, 297)])
    def test_an_excursion_before_the_tip_moved(self, part: slice) -> None:
        """15 ms low, 5 µm before the tip, which alone is no bounce of the contact; or 1 ms just
        before it, which is one by its time."""
        touch = rig_touch(_trace(contact=_low(CONTACT, part)))
        assert touch.notes == (
            "an excursion of the contact signal before the tip moved was ignored",
        )
        assert touch.r0 == pytest.approx(20.05 * UM, abs=1e-9)

    @pytest.mark.parametrize(("count", "words"), [(1, "1 short excursion of"), (2, "2 short exc")])
    def test_short_excursions_are_counted(self, count: int, words: str) -> None:
        parts = [slice(30, 32), slice(60, 61)][:count]
        for name in ("contact", "trigger"):
            trace = _trace()
            found = rig_touch(replace(trace, **{name: _low(getattr(trace, name), *parts)}))
            (note,) = found.notes
            assert note.startswith(words)
            assert note.endswith(f"{'s' * (count - 1)} of the {name} signal ignored")

    def test_a_signal_that_is_low_at_rest(self) -> None:
        """For 20 samples; the first of them high is enough to be at rest."""
        for part, told in ((slice(0, 20), True), (slice(1, 20), False), (slice(0, 19), False)):
            for name in ("contact", "trigger"):
                trace = _trace()
                found = rig_touch(replace(trace, **{name: _low(getattr(trace, name), part)}))
                words = f"the {name} signal is low at rest; it should be high: is it inverted?"
                assert (words in found.notes) == told

    def test_a_trigger_before_the_contact(self) -> None:
        early = rig_touch(_trace(trigger=_low(TRIGGER, slice(290, 350))))
        assert early.notes == (
            "the trigger comes before the contact: check the wiring of the signals",
        )
        at_once = rig_touch(_trace(trigger=_low(TRIGGER, slice(301, 350))))
        assert at_once.notes == ()

    def test_the_laser_at_rest(self) -> None:
        """Its level is a median: before the contact, and of the last twentieth, 41 samples."""
        late = LASER.copy()
        late[-15:] += 5.0 * UM
        late[530:775] -= 2.0 * UM
        assert rig_touch(_trace(laser=late)).zero_shift == pytest.approx(0.4 * UM, abs=1e-9)
        early = LASER.copy()
        early[:25] -= 5.0 * UM
        for contact in (CONTACT, SILENT):
            found = rig_touch(_trace(laser=early, contact=contact))
            assert found.zero_shift == pytest.approx(0.4 * UM, abs=1e-9)

    @pytest.mark.parametrize(("noise", "shown"), [(0.245, True), (0.255, False)])
    def test_the_laser_shows_five_samples_beyond_ten_deviations(
        self, noise: float, shown: bool
    ) -> None:
        """Up to 3 µm, in steps of 0.1 µm: the fifth last is 2.51 µm. The 300 readings at rest are
        on either side of the level by their median deviation, 1 / 1.4826 of the deviation."""
        laser = LASER.copy()
        laser[300:410] += 0.01 * UM
        laser[:300] += np.tile([1.0, -1.0], 150) * noise / 1.4826 * UM
        words = "the laser does not show where contact is made; only the signal does"
        assert (words in rig_touch(_trace(laser=laser)).notes) == (not shown)


class TestTraces:
    def test_samples_and_travel_that_are_enough(self) -> None:
        level = np.ones(100, dtype=bool)
        ruler = np.linspace(0.0, 20.001 * UM, 100)
        time = 1e-3 * np.arange(100.0)
        made = RigTrace(time, ruler, ruler, level, level)
        assert made.name == "trace"
        assert replace(made, time=time**2 + time).interval == pytest.approx(
            np.median(np.diff(time**2 + time))
        )
        with pytest.raises(PretravelError, match="trace: 99 samples are too few"):
            RigTrace(time[1:], ruler[1:], ruler[1:], level[1:], level[1:])
        with pytest.raises(PretravelError, match=r"moves by 19\.99 µm only"):
            replace(made, ruler=ruler * 19.99 / 20.001)
        for name in ("time", "ruler", "laser"):
            wrong = np.array(getattr(made, name))
            wrong[7] = math.inf
            with pytest.raises(PretravelError, match=f"trace: {name} is not finite"):
                replace(made, **{name: wrong})
        still = time.copy()
        still[8] = still[7]
        with pytest.raises(PretravelError, match=r"at sample 9 \(0\.007 s after 0\.007 s\)"):
            replace(made, time=still)

    @pytest.mark.published(
        "Ren 2020", "Equation 16",
        what="length at 20 °C",
        ours="L₀ (1 + α ΔT)",
        theirs="L₀ (1 − α ΔT)",
        verdict="differs: sign; 0.04 nm on 5 µm",
    )  # fmt: skip
    def test_a_cold_ruler(self) -> None:
        """At 17 °C 12 ppm / K: 36 ppm less."""
        found = at_reference_temperature(_trace(), 17.0, 12e-6)
        assert found.ruler == pytest.approx(RULER * (1.0 - 36e-6), rel=1e-12)
        assert np.array_equal(found.laser, LASER)
        assert at_reference_temperature(_trace(), 17.0, 0.0).ruler == pytest.approx(RULER)
        trace = _trace()
        assert at_reference_temperature(trace, 20.0, 8e-6) is trace


class TestMovedMarks:
    """Events that a person moves."""

    TOUCH = RigTouch("rig_030_1", 1.0, 1.004, 1.008, 1.0003, 2e-5, 3e-5, 4e-5, 4e-3, 0, 3.0, ())

    @pytest.mark.parametrize(("name", "u"), [("r0", 2e-5), ("r1", 3e-5), ("r3", 4e-5)])
    @pytest.mark.parametrize("way", [0.7, -0.7])
    def test_u_covers_both_positions(self, name: str, u: float, way: float) -> None:
        """GUM 4.3.7: the half width of a rectangle over √3, beside the event's own u."""
        old = getattr(self.TOUCH, name)
        moved = with_marks(self.TOUCH, {name: old + way * UM})
        assert getattr(moved, name) == old + way * UM
        expected = math.sqrt(u**2 + (0.7 * UM) ** 2 / 3.0)
        assert getattr(moved, f"u_{name}") == pytest.approx(expected, rel=1e-9)
        (note,) = moved.notes
        assert note == f"{name} was moved by hand by {way:+.2f} µm; its u covers both positions"
        # The laser at a moved trigger is not known.
        assert math.isnan(moved.tip_displacement) == (name == "r1")
        assert with_marks(self.TOUCH, {name: old}) == self.TOUCH

    def test_the_stop_has_no_u_to_cover(self) -> None:
        moved = with_marks(self.TOUCH, {"r2": self.TOUCH.r2 - 1.0 * UM})
        note = "r2 was moved by hand by -1.00 µm"
        assert moved == replace(self.TOUCH, r2=self.TOUCH.r2 - 1.0 * UM, notes=(note,))

    def test_the_order_is_judged_with_the_moved_events(self) -> None:
        (note, _) = with_marks(self.TOUCH, {"r1": self.TOUCH.r0 - 0.5 * UM}).notes
        assert note.startswith("the trigger comes before the contact")
        wrong = rig_touch(_trace(trigger=_low(TRIGGER, slice(290, 350))))
        assert note in wrong.notes
        assert note not in with_marks(wrong, {"r1": wrong.r0 + 4.0 * UM}).notes
        assert note in with_marks(wrong, {"r3": wrong.r3 + UM}).notes

    def test_u_of_an_event_that_the_trace_does_not_show(self) -> None:
        """That of a contact by signal and by laser, which may differ by 0.3 µm."""
        blank = replace(self.TOUCH, r3=math.nan, u_r3=math.nan)
        assert math.isnan(blank.hysteresis)
        found = with_marks(blank, {"r3": 1.0005})
        assert found.hysteresis == pytest.approx(0.5 * UM, rel=1e-9)
        assert found.u_r3 == pytest.approx(0.3 * UM / math.sqrt(3.0), rel=1e-12)
        assert (found.r0, found.u_r0, found.r1, found.u_r1) == (1.0, 2e-5, 1.004, 3e-5)
        assert found.notes == ("r3 was set by hand",)

    def test_a_trace_at_another_feed_is_named(self) -> None:
        others = [replace(self.TOUCH, trace=f"rig_{i}", feed=3.0 + 0.1 * i) for i in range(3)]
        assert not notes_of_touches(others)
        (note,) = notes_of_touches([*others, replace(self.TOUCH, feed=6.0)])
        assert note.startswith("rig_030_1: touched at 6 mm/min, most traces at 3.2")

    def test_other_events_and_positions_are_refused(self) -> None:
        for marks in ({"r4": 1.0}, {"r0": math.inf}):
            with pytest.raises(PretravelError, match="a mark is r0, r1, r2, r3"):
                with_marks(self.TOUCH, marks)
