"""Events of an ideal rod, and budgets, maps and certificates whose numbers follow by hand.

The rod goes 0.1 µm in each sample of 1 ms: at rest to sample 100, out to 28 µm at sample 380, at
rest for 60 samples, and back. It meets the tip at 20 µm; on the way back the tip stays 0.4 µm
further out.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.certificate import calibration_certificate
from pretravel.laboratory.laboratory_statements import (
    CalibratedItem,
    LaboratoryStatements,
    MeasuringInstrument,
    ReferenceIdentity,
)
from pretravel.laboratory.rig import RigTouch, RigTrace, at_reference_temperature
from pretravel.laboratory.rig_budget import (
    REN_BUDGET,
    LengthComponent,
    budget_doubts,
    calibration_budget,
    constant_and_slope,
    length_budget,
    own_repeatability,
)
from pretravel.laboratory.rig_calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig_events import _record, rig_touch
from pretravel.laboratory.rig_left_out import left_out_sentences
from pretravel.laboratory.rig_map import compensated_diameter, rig_map

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
TRIGGER = ~(OUT & (RULER > 24.01 * UM)) & ~(~OUT & (RULER > 24.01 * UM))
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


class TestEvents:
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

    def test_the_trigger_falls_twice(self) -> None:
        touch = rig_touch(_trace(trigger=_high(TRIGGER, slice(355, 370))))
        assert touch.notes == ("the trigger signal fell 2 times on the way; the first counts",)
        assert touch.r1 == pytest.approx(24.05 * UM, abs=1e-9)

    def test_the_trigger_bounces(self) -> None:
        touch = rig_touch(_trace(trigger=_high(TRIGGER, slice(343, 345))))
        assert touch.notes == ("the trigger signal bounced; its first edge counts",)

    def test_a_trigger_before_the_way_back_counts(self) -> None:
        """The rod leaves its stand, 28 µm, with sample 442: one step below it is still there."""
        stop = _record(_trace()).motion.standing.stop
        assert stop in (442, 443)
        at = rig_touch(_trace(trigger=_low(np.ones_like(TRIGGER), slice(stop - 1, 480))))
        assert at.r1 == pytest.approx(28.0 * UM, abs=2 * STEP)
        assert at.notes == ()
        beyond = rig_touch(_trace(trigger=_low(np.ones_like(TRIGGER), slice(stop, 480))))
        assert math.isnan(beyond.r1)
        assert math.isnan(beyond.tip_displacement)
        assert beyond.notes == (
            "no trigger: the signal changes only on the way back, so r1 is unknown",
        )
        silent = rig_touch(_trace(trigger=np.ones_like(TRIGGER)))
        assert silent.notes == ("no trigger: the signal never changes, so r1 is unknown",)
        assert math.isnan(silent.u_r1)

    def test_a_contact_before_the_way_back_counts(self) -> None:
        stop = _record(_trace()).motion.standing.stop
        for first, known in ((stop - 1, True), (stop, False)):
            contact = _low(np.ones_like(CONTACT), slice(first, 600))
            notes = rig_touch(_trace(contact=contact)).notes
            assert any("signal and laser differ" in note for note in notes[:1]) == known
            words = "the contact signal has no edge; r0 is where the laser starts to move"
            assert (words in notes) == (not known)

    def test_a_contact_lost_after_the_way_out_counts(self) -> None:
        start = _record(_trace()).motion.standing.start
        assert start in (379, 380)
        for first, known in ((start, True), (start - 1, False)):
            contact = _low(np.ones_like(CONTACT), slice(301, first))
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

    def test_contact_and_its_loss_without_the_laser(self) -> None:
        still = _trace(laser=np.full(len(RULER), 3.0 * UM))
        touch = rig_touch(still)
        assert touch.notes == (
            "the laser does not show where contact is made; only the signal does",
            "the laser does not show where contact is lost; only the signal does",
        )
        assert (touch.r0, touch.r3) == pytest.approx((20.05 * UM, 20.45 * UM), abs=1e-9)
        assert touch.u_r0 == pytest.approx(U_EDGE, rel=1e-6)
        dead = rig_touch(replace(still, contact=np.ones_like(CONTACT)))
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

    def test_contact_is_lost_more_than_once(self) -> None:
        touch = rig_touch(_trace(contact=_high(CONTACT, slice(450, 470))))
        words = "contact was lost more than once on the way back; the one where the laser stops co"
        assert touch.notes == (f"{words}unts",)
        assert touch.r3 == pytest.approx(20.45 * UM, abs=1e-9)

    def test_bounces_of_the_contact(self) -> None:
        made = rig_touch(_trace(contact=_high(CONTACT, slice(303, 305))))
        assert made.notes == ("the contact signal bounced; its first edge counts",)
        lost = rig_touch(_trace(contact=_high(CONTACT, slice(512, 514))))
        assert lost.notes == ("the contact signal bounced when it was lost; its last edge counts",)
        assert lost.r3 == pytest.approx(20.45 * UM, abs=1e-9)

    def test_an_excursion_before_the_tip_moved(self) -> None:
        """15 ms low, 5 µm before the tip; alone it is no bounce of the contact."""
        touch = rig_touch(_trace(contact=_low(CONTACT, slice(250, 265))))
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
        """Its level is a median: before the contact, and of the last twentieth, 41 samples. Its
        deviation is that of normal noise."""
        late = LASER.copy()
        late[-15:] += 5.0 * UM
        assert rig_touch(_trace(laser=late)).zero_shift == pytest.approx(0.4 * UM, abs=1e-9)
        early = LASER.copy()
        early[:25] -= 5.0 * UM
        for contact in (CONTACT, np.ones_like(CONTACT)):
            found = rig_touch(_trace(laser=early, contact=contact))
            assert found.zero_shift == pytest.approx(0.4 * UM, abs=1e-9)
        noise = 0.02 * UM * np.random.default_rng(1).standard_normal(len(RULER))
        record = _record(_trace(laser=LASER + noise))
        # 300 samples: a median absolute deviation has 7 %.
        assert record.laser_noise == pytest.approx(0.02 * UM, rel=0.2)
        assert record.laser_before == pytest.approx(3.0 * UM, abs=0.01 * UM)
        assert record.laser_after == pytest.approx(3.4 * UM, abs=0.02 * UM)


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

    def test_a_cold_ruler(self) -> None:
        """At 17 °C 12 ppm / K: 36 ppm less."""
        found = at_reference_temperature(_trace(), 17.0, 12e-6)
        assert found.ruler == pytest.approx(RULER * (1.0 - 36e-6), rel=1e-12)
        assert np.array_equal(found.laser, LASER)
        assert at_reference_temperature(_trace(), 17.0, 0.0).ruler == pytest.approx(RULER)


BLANK = RigTouch("", 0.0, 3e-3, 8e-3, 4e-4, 1e-5, 2e-5, 3e-5, 0.0, 0.0, 3.0, ())
MADE = {"p_090": [4.0, 4.0, 4.3, 4.5], "p_000": [3.0, 3.2], "p_200": [5.0]}


def _calibration(
    made: dict[str, list[float]] = MADE, u: float = 1e-5, **settings: object
) -> RigCalibration:
    touches = [
        replace(BLANK, trace=f"{name}_{k + 1}", r1=value * UM, feed=3.0 + k, u_r0=u, u_r1=u)
        for name, values in made.items()
        for k, value in enumerate(values)
    ]
    return calibrate_rig(touches, **{"search_outliers": False, **settings})  # type: ignore[arg-type]


S = math.sqrt((0.18 + 0.02) / 4.0) * UM
"""Of `MADE`: squares about the means over 3 + 1 + 0 degrees of freedom."""


class TestBudgets:
    def test_own_repeatability(self) -> None:
        """0.224 µm of the repeats, with k = 2.87 of four degrees of freedom 0.64 µm; edges of
        √2 · 0.01 µm, of √2 · 0.2 µm, with k = 2 0.57 µm, or of √2 · 0.25 µm, 0.71 µm."""
        own = own_repeatability(_calibration(), 4)
        assert own is not None
        assert (own.source, own.evaluation) == ("repeatability of pretravel, mean of 4", "A")
        assert own.constant == pytest.approx(S / 2.0, rel=1e-9)
        assert (own.per_length, own.dof, own.repeatability) == (0.0, 4.0, True)
        less = own_repeatability(_calibration(u=0.2 * UM), 4)
        assert less == own
        rough = own_repeatability(_calibration(u=0.25 * UM), 9)
        assert rough is not None
        assert (rough.source, rough.evaluation) == ("edges between samples, mean of 9", "B")
        assert rough.constant == pytest.approx(0.25 * UM * math.sqrt(2.0) / 3.0, rel=1e-9)
        assert (rough.dof, rough.repeatability) == (math.inf, True)
        assert own_repeatability(_calibration({"p_000": [3.0], "p_090": [4.0]}), 2) is None

    def test_touches_without_u_do_not_count(self) -> None:
        touches = list(_calibration(u=0.25 * UM).touches)
        touches[0] = replace(touches[0], u_r1=math.nan)
        own = own_repeatability(calibrate_rig(touches, search_outliers=False), 1)
        assert own is not None
        assert own.constant == pytest.approx(0.25 * UM * math.sqrt(2.0), rel=1e-9)

    def test_budget_of_a_calibration(self) -> None:
        """The fewest touches of a direction, one, where no number is given."""
        rig = [c for c in REN_BUDGET if not c.source.startswith("repeatability")]
        for count, divisor in ((None, 1.0), (4, 2.0)):
            found = calibration_budget(_calibration(), count=count)
            assert list(found[:-1]) == rig
            assert found[-1].constant == pytest.approx(S / divisor, rel=1e-9)
        single = _calibration({"p_000": [3.0], "p_090": [4.0]})
        assert calibration_budget(single) == REN_BUDGET

    def test_parts_of_one_source_are_added(self) -> None:
        parts = (LengthComponent("a", "B", 3e-5, 2e-6), LengthComponent("b", "A", 4e-5, dof=5.0))
        budget = length_budget(parts, 20.0)
        assert [c.standard_uncertainty for c in budget.components] == pytest.approx([7e-5, 4e-5])
        assert [(c.name, c.evaluation, c.dof) for c in budget.components] == [
            ("a", "B", math.inf), ("b", "A", 5.0),
        ]  # fmt: skip
        with pytest.raises(PretravelError, match="a constant part and a part per length"):
            constant_and_slope(parts)
        assert constant_and_slope(
            [LengthComponent("a", "B", 3e-5), LengthComponent("b", "B", 4e-5),
             LengthComponent("c", "B", 0.0, 5e-6), LengthComponent("d", "B", 0.0, 12e-6)]
        ) == pytest.approx((5e-5, 13e-6))  # fmt: skip

    def test_doubts(self) -> None:
        """One nanometre is less than any rig; a part per length is stated."""
        assert len(budget_doubts([LengthComponent("a", "B", 0.9e-6)])) == 1
        assert budget_doubts([LengthComponent("a", "B", 1.1e-6)]) == ()
        both = [LengthComponent("a", "B", 1e-5), LengthComponent("b", "B", 0.0, 1e-6)]
        assert budget_doubts(both) == ()
        repeats = LengthComponent("c", "A", repeatability=True)
        assert budget_doubts([*both, repeats]) == ()
        (only,) = budget_doubts([*both, LengthComponent("d", "B")])
        assert only == "the budget states no uncertainty for 'd': 0 or empty"

    def test_rens_table(self) -> None:
        """Ren 2020, Table 2, in µm and µm/m."""
        table = [(c.constant / UM, 1e6 * c.per_length) for c in REN_BUDGET]
        expected = [(c, 0.0) for c in (0.034, 0.030, 0.030, 0.020, 0.055, 0.060)]
        expected += [(0.0, slope) for slope in (0.058, 0.115, 0.010, 0.001)]
        assert np.array(table) == pytest.approx(np.array(expected), rel=1e-12)
        assert [c.repeatability for c in REN_BUDGET] == [k in (4, 5) for k in range(10)]


class TestMap:
    def test_every_field(self) -> None:
        """A quarter more µm² of the touches in each direction, with k = 2.8693 of four degrees of
        freedom (Student's t for 95.45 %) over 2, and what is common to all."""
        components = (LengthComponent("a", "B", 5e-5), LengthComponent("b", "B", 0.0, 1e-2))
        calibration = _calibration()
        found = rig_map(calibration, components, 1.5)
        # In order of the azimuth; the mean of the directions is 4.1333 µm.
        assert found.coefficients == pytest.approx(np.array([3.1, 4.2, 5.0]) * UM, rel=1e-9)
        common = 5e-5**2 + (1e-2 * (3.1 + 4.2 + 5.0) / 3.0 * UM) ** 2
        factor = stats.t.ppf(0.5 + 0.5 * math.erf(math.sqrt(2.0)), 4.0) / 2.0
        own = (factor * S) ** 2 / np.array([2.0, 4.0, 1.0])
        assert found.covariance.matrix == pytest.approx(np.diag(own) + common, rel=1e-9)
        azimuth = np.radians([0.0, 90.0, 200.0])
        directions = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(3)])
        assert found.support.nodes == pytest.approx(directions, abs=1e-12)
        assert found.tip_radius == 1.5
        assert (found.repeatability, found.repeatability_dof) == (pytest.approx(S), 4.0)
        assert found.feed == pytest.approx((3 + 4 + 5 + 6 + 3 + 4 + 3) / 7.0)
        assert found.provenance.touches == "7 in 3 directions"

    def test_without_repeats(self) -> None:
        single = _calibration({"p_000": [3.0], "p_090": [4.0]})
        found = rig_map(single, (LengthComponent("a", "B", 5e-5),), 1.5)
        assert found.covariance.matrix == pytest.approx(np.full((2, 2), 25e-10), rel=1e-9)
        assert (found.repeatability, found.repeatability_dof) == (0.0, math.inf)

    def test_needs_every_azimuth(self) -> None:
        with pytest.raises(PretravelError, match="must end in _AZIMUTH_REPEAT"):
            rig_map(_calibration({"p_000": [3.0], "left": [4.0]}), REN_BUDGET, 1.5)

    def test_a_diameter_has_both_pretravels(self) -> None:
        found = compensated_diameter([10.0, 12.0], 0.003, 0.005, 0.007)
        assert found == pytest.approx([10.0 + 0.003 + 0.005 - 0.014, 11.994], rel=1e-12)


class TestLeftOut:
    MADE = {  # noqa: RUF012
        "p_000": [3.0, 3.02, 3.01, 3.0], "p_090": [3.1, 3.12, 3.1, 3.11],
        "p_180": [3.0, 3.01, 3.02, 3.0], "q": [5.0, 9.0],
    }  # fmt: skip

    def test_nothing(self) -> None:
        assert left_out_sentences(_calibration(self.MADE)) == []

    def test_as_requested(self) -> None:
        found = _calibration(self.MADE, exclude=["q_1", "p_090_2"])
        assert left_out_sentences(found) == ["left out as requested: p_090_2, q_1"]

    def test_a_direction_of_which_nothing_is_left(self) -> None:
        """Two that are 4 µm apart and have no map: both have one sentence."""
        found = _calibration(self.MADE, search_outliers=True)
        one, effect, missing = left_out_sentences(found)
        assert one == found.outliers[0].message == found.outliers[1].message
        assert effect.startswith("with them, repeatability would be ")
        lost = found.with_outliers
        assert lost is not None
        for name, with_it, own in (
            ("repeatability", lost.repeatability.value, found.repeatability.value),
            ("anisotropy", 4.0 * UM - 0.0075 * UM, 0.1 * UM),
        ):
            words = f"{name} would be {with_it / UM:.3g} µm instead of {own / UM:.3g} µm"
            assert words in effect or name == "anisotropy"
        words = f"{lost.anisotropy / UM:.3g} µm instead of {found.anisotropy / UM:.3g} µm"
        assert f"anisotropy would be {words}" in effect
        u = [max(d.u_pretravel for d in c.directions) / UM for c in (lost, found)]
        assert f"u of a direction would be {u[0]:.3g} µm instead of {u[1]:.3g} µm" in effect
        assert missing == "no touch is left of q; touch again there"

    def test_a_single_touch_off_the_map(self) -> None:
        """Without repeats the lobes tell the repeatability: of 5 µm in one of 24 directions half is
        left, √(5² · 12 / 24 / 12) µm. The sine of a² is no lobe, but small."""
        azimuth = np.arange(0, 360, 15)
        made = {f"p_{a:03d}": [3.0 + 0.01 * math.sin(a * a)] for a in azimuth}
        made["p_075"] = [8.0]
        found = _calibration(made, search_outliers=True)
        _, effect, missing = left_out_sentences(found)
        assert effect.startswith("with it, repeatability would be 1.02 µm instead of 0.0141")
        assert missing == "no touch is left of p_075; touch again there"


class TestCertificates:
    def test_every_field(self) -> None:
        touches = list(_calibration().touches)
        touches[1] = replace(touches[1], feed=math.nan, notes=("noisy", "short"))
        touches[4] = replace(touches[4], feed=2.5, notes=("late",))
        calibration = calibrate_rig(touches, exclude=["p_090_1"], search_outliers=False)
        statements = LaboratoryStatements()
        found = calibration_certificate(
            calibration, REN_BUDGET, statements, budget_source="Ren", temperature=21.5
        )
        assert found.feeds == (2.5, 6.0)
        assert (found.budget_source, found.temperature) == ("Ren", 21.5)
        assert found.notes == (
            "p_090_2: noisy", "p_090_2: short", "p_000_1: late", "left out as requested: p_090_1",
        )  # fmt: skip
        own = calibration_budget(calibration)
        assert found.constant_and_slope == constant_and_slope(own)
        assert found.budget.components == length_budget(own, calibration.pretravel).components
        for one, count in zip(found.directions, (2, 3, 1), strict=True):
            assert one.performance.count == count
            budget = length_budget(
                calibration_budget(calibration, count=count), one.performance.pretravel
            )
            assert one.expanded == pytest.approx(budget.expanded())
            assert one.coverage_factor == pytest.approx(budget.coverage_factor())
        plain = calibration_certificate(calibration, REN_BUDGET, statements)
        assert (plain.budget_source, plain.temperature) == ("", 20.0)

    def test_a_false_start_has_a_negative_pretravel(self) -> None:
        """Its length in the budget is its magnitude."""
        calibration = _calibration({"p_000": [-1.0, -1.2], "p_090": [-1.1]})
        made = calibration_certificate(calibration, REN_BUDGET, LaboratoryStatements())
        assert made.budget.combined > 0.0
        assert rig_map(calibration, REN_BUDGET, 1.0).coefficients[0] == pytest.approx(-1.1 * UM)

    def test_statements_of_a_certificate_and_of_reports(self) -> None:
        """Tables of a certificate: 3 + 3 + 1 + 6 + 3 + 2 + 1 + 1 statements; four standards."""
        empty = LaboratoryStatements()
        assert empty.missing == len(list(empty.of_certificate())) == 20
        assert len(list(empty.statements())) == 20 + 6 + 3 + 2 + 4
        stated = LaboratoryStatements(
            item=CalibratedItem(serial_number="17"),
            instrument=MeasuringInstrument(probe="T", stylus="M"),
            reference=ReferenceIdentity(certificate="K-3"),
        )
        assert stated.missing == 19
        more = [(s.table, s.key, s.text) for s in stated.of_certificate()][20:]
        assert more == [
            ("instrument", "probe", "T"), ("instrument", "stylus", "M"),
            ("reference", "certificate", "K-3"),
        ]  # fmt: skip
        tables = list(dict.fromkeys(s.table for s in stated.of_report()))
        assert tables == [
            "laboratory", "instrument", "reference", "conditions", "measurement", "item",
        ]  # fmt: skip
        counts = [sum(s.table == table for s in stated.of_report()) for table in tables]
        assert counts == [3, 6, 3, 2, 2, 1]
        for statement in stated.statements():
            part = getattr(stated, statement.table)
            assert statement.text == getattr(part, statement.key)
            meanings = {f.name: f.metadata["meaning"] for f in fields(part)}
            assert statement.meaning == meanings[statement.key]


class TestCalibration:
    def test_traces_that_are_not_there(self) -> None:
        names = {f"p_{k:03d}": [3.0] for k in range(0, 130, 10)}
        with pytest.raises(PretravelError, match=r"no trace 'x' .* are p_000_1, .*, p_110_1, …$"):
            _calibration(names, exclude=["x"])
        fewer = dict(list(names.items())[:12])
        with pytest.raises(PretravelError, match=r"no trace 'x' .* p_110_1$"):
            _calibration(fewer, exclude=["x", "y"])

    @pytest.mark.parametrize("probability", [0.0, 1.0, -0.5, 1.5, math.nan])
    def test_a_probability_is_between_zero_and_one(self, probability: float) -> None:
        with pytest.raises(PretravelError, match="the probability"):
            _calibration(probability=probability)

    def test_ranges_of_one_direction(self) -> None:
        """All start elsewhere: r1 has a range of its own."""
        touches = [
            replace(BLANK, trace=f"p_030_{k}", r0=r0 * UM, r1=(r0 + 3.0 + 0.1 * k) * UM)
            for k, r0 in enumerate([80.0, 81.5, 79.9])
        ]
        found = calibrate_rig(touches, search_outliers=False)
        (only,) = found.directions
        assert only.trigger_range == pytest.approx(1.6 * UM, rel=1e-9)
        assert only.pretravel_range == pytest.approx(0.2 * UM, rel=1e-6)
        assert only.name == "p_030"
        assert only.azimuth == pytest.approx(math.radians(30.0))
        assert found.starts_differ

    def test_negative_azimuths_and_halves(self) -> None:
        found = _calibration({"p_22.5": [3.0], "p_-90": [4.0], "p_7": [5.0]})
        assert [math.degrees(d.azimuth) for d in found.directions] == pytest.approx([-90, 7, 22.5])

    def test_outliers_are_judged_beside_u_of_the_edges(self) -> None:
        """Equal repeats but one of 0.5 µm more: where edges have 0.2 µm, it is none."""
        made = {"p_000": [3.0, 3.001, 3.0, 3.5], "p_090": [4.0, 4.001, 4.0, 4.001]}
        assert [o.trace for o in _calibration(made, search_outliers=True).outliers] == ["p_000_4"]
        rough = _calibration(made, u=0.2 * UM, search_outliers=True)
        assert rough.outliers == ()
        named = _calibration(made, search_outliers=True, exclude=["p_090_1"])
        assert named.not_used == {"p_000_4": "outlier", "p_090_1": "excluded"}
        told = _calibration(made, search_outliers=True).outliers[0].message
        assert "from the other touches of its direction" in told
