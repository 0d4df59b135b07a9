"""Events and figures of the rig against made traces and touches whose results follow by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from scipy import stats

from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig import RigTouch, RigTrace
from pretravel.laboratory.rig_budget import LengthComponent, length_budget
from pretravel.laboratory.rig_calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig_left_out import left_out_sentences
from pretravel.laboratory.rig_outliers import outlying_rows
from pretravel.laboratory.rig_signals import (
    LevelChange,
    RulerPosition,
    laser_kink,
    level_changes,
    rod_motion,
    ruler_at_edge,
)

UM = 1e-3
BLANK = RigTouch("", 0.0, 3e-3, 8e-3, 4e-4, 1e-5, 2e-5, 3e-5, 0.0, 0.0, 3.0, ())


def _trace(ruler: np.ndarray, laser: np.ndarray | None = None) -> RigTrace:
    level = np.ones(len(ruler), dtype=bool)
    time = 1e-3 * np.arange(float(len(ruler)))
    return RigTrace(time, ruler, 0.0 * ruler if laser is None else laser, level, level)


class TestMotion:
    OUT: ClassVar = 0.005 + 0.01 * np.arange(50)
    """The rod is at rest at 0, goes on in steps of 10 µm, stands at 0.5 mm, and returns."""

    def test_phases_without_noise_begin_and_end_at_the_sample(self) -> None:
        """A sample belongs to a rest where it is within a step, 10 µm, of its level."""
        rest, stand = np.zeros(30), np.full(40, 0.5)
        trace = _trace(np.concatenate([rest, self.OUT, stand, self.OUT[::-1], rest]))
        motion = rod_motion(trace)
        # Samples 79 and 120 are 5 µm below the stand, 30 and 169 as much above the rest.
        assert motion.forward == slice(30, 79)
        assert motion.standing == slice(79, 121)
        assert motion.back == slice(121, 169)
        assert motion.speed == pytest.approx(10.0, rel=1e-9)
        assert motion.noise == pytest.approx(0.0, abs=1e-12)

    def test_a_trace_that_ends_on_the_way_back_or_at_the_stand(self) -> None:
        rest, stand = np.zeros(30), np.full(40, 0.5)
        cut = _trace(np.concatenate([rest, self.OUT, stand, self.OUT[:20:-1]]))
        # The last sample, 148, is the lowest; 147 is within a step of it, up to rounding.
        assert rod_motion(cut).back.start == 121
        assert rod_motion(cut).back.stop in (146, 147, 148)
        standing = rod_motion(_trace(np.concatenate([rest, self.OUT, stand])))
        assert standing.standing == slice(79, 120)
        assert standing.back == slice(120, 120)

    def test_a_way_back_far_below_the_start_does_not_move_the_start(self) -> None:
        rest, stand = np.zeros(30), np.full(40, 0.5)
        low = np.concatenate([rest, self.OUT, stand, self.OUT[::-1], rest - 0.1])
        assert rod_motion(_trace(low)).forward == slice(30, 79)

    def test_noise_is_the_deviation_of_the_readings(self) -> None:
        """Second differences of independent readings have six times their variance."""
        rng = np.random.default_rng(2)
        rest, stand = np.zeros(3000), np.full(3000, 0.5)
        ruler = np.concatenate([rest, self.OUT, stand, self.OUT[::-1], rest])
        # A median of 9000 absolute differences, some of them dependent: 2 % standard error.
        noisy = _trace(ruler + 2e-5 * rng.standard_normal(len(ruler)))
        assert rod_motion(noisy).noise == pytest.approx(2e-5, rel=0.08)


class TestLevels:
    def test_excursions_are_counted_one_by_one(self) -> None:
        """Two short falls before a fall, and one short rise after it: three that do not count."""
        level = np.ones(300, dtype=bool)
        level[[40, 41, 60]] = False
        level[100:] = False
        level[150:153] = True
        changes, excursions = level_changes(level, 1e-3 * np.arange(300.0))
        assert changes == [LevelChange(100, 100, (100,))]
        assert excursions == 3

    def test_a_level_has_settled_after_ten_milliseconds(self) -> None:
        for samples, found in ((9, 0), (10, 2)):
            level = np.ones(100, dtype=bool)
            level[40 : 40 + samples] = False
            changes, excursions = level_changes(level, 1e-3 * np.arange(100.0))
            assert (len(changes), excursions) == (found, 1 - found // 2)

    def test_a_bounce_has_all_its_edges(self) -> None:
        level = np.ones(100, dtype=bool)
        level[40:43] = level[45:47] = level[50:] = False
        ((change,), excursions) = level_changes(level, 1e-3 * np.arange(100.0))
        assert change == LevelChange(40, 50, (40, 43, 45, 47, 50))
        assert change.bounced
        assert excursions == 0


class TestEdge:
    RULER: ClassVar = np.arange(200.0) * UM

    @pytest.mark.parametrize("noise", [0.0, 0.02 * UM])
    def test_between_two_samples_of_a_steady_rod(self, noise: float) -> None:
        """Fifteen samples on either side, or fewer where the rod does not move: the middle of the
        edge's samples, and u of the mean of the line there, with a rectangle of one step."""
        for moving, n in ((slice(0, 200), 30), (slice(97, 103), 6), (slice(90, 105), 15)):
            found = ruler_at_edge(_trace(self.RULER), 100, moving, noise)
            assert found.value == pytest.approx(99.5 * UM, rel=1e-9)
            t = np.arange(max(85, moving.start), min(115, moving.stop)) - 99.5
            assert len(t) == n
            share = 1.0 / n + t.mean() ** 2 / np.sum((t - t.mean()) ** 2)
            expected = math.sqrt(noise**2 * share + UM**2 / 12.0)
            assert found.u == pytest.approx(expected, rel=1e-6)

    def test_scatter_about_the_line(self) -> None:
        ruler = self.RULER + 0.02 * UM * np.cos(np.arange(200.0) ** 2)
        found = ruler_at_edge(_trace(ruler), 100, slice(0, 200), 0.0)
        line = stats.linregress(np.arange(85, 115) - 99.5, ruler[85:115])
        assert found.value == pytest.approx(line.intercept, rel=1e-9)
        assert found.u == pytest.approx(math.hypot(line.intercept_stderr, line.slope / 12**0.5))

    def test_a_spike_is_left_out(self) -> None:
        """Cosines of one amplitude, and one sample 1 mm off: as if it were not there."""
        wave = 0.02 * UM * np.cos(np.arange(200.0) ** 2)
        ruler = self.RULER + wave
        ruler[104] += 1.0
        kept = np.delete(np.arange(85, 115), 104 - 85)
        line = stats.linregress(kept - 99.5, (self.RULER + wave)[kept])
        found = ruler_at_edge(_trace(ruler), 100, slice(0, 200), 0.0)
        assert found.value == pytest.approx(line.intercept, rel=1e-9)
        assert found.u == pytest.approx(math.hypot(line.intercept_stderr, line.slope / 12**0.5))

    @pytest.mark.parametrize("moving", [slice(98, 150), slice(50, 102)])
    def test_where_the_rod_starts_or_stops_the_samples_count(self, moving: slice) -> None:
        ruler = self.RULER.copy()
        ruler[98:102] = np.array([0.0, 1.0, 7.0, 8.0]) * UM  # with a step of 6 µm at the edge
        found = ruler_at_edge(_trace(ruler), 100, moving, 0.5 * UM)
        assert found.value == pytest.approx(4.0 * UM, rel=1e-9)
        assert found.u == pytest.approx(math.sqrt(0.25 / 4.0 + 36.0 / 12.0) * UM, rel=1e-9)

    def test_at_the_first_sample_fewer_count(self) -> None:
        ruler = self.RULER.copy()
        ruler[:3] = np.array([2.0, 4.0, 9.0]) * UM
        found = ruler_at_edge(_trace(ruler), 1, slice(0, 200), 0.5 * UM)
        assert found.value == pytest.approx(4.0 * UM, rel=1e-9)
        assert found.u == pytest.approx(math.sqrt(0.25 / 3.0 + 4.0 / 12.0) * UM, rel=1e-9)


class TestKink:
    REST, NOISE = 2.0 * UM, 0.02 * UM

    def _kink(
        self, displacement: np.ndarray, slope: float, scatter: float = 0.0
    ) -> tuple[RulerPosition | None, np.ndarray]:
        """Ruler 7 µm where the tip starts to move, and what it is at the displacements."""
        waves = scatter * np.cos(np.arange(len(displacement)) ** 2)
        ruler = np.concatenate([np.linspace(-200.0, -100.0, 100) * UM, 7.0 * UM + waves])
        ruler[100:] += slope * displacement
        laser = self.REST + np.concatenate([np.zeros(100), displacement])
        found = laser_kink(_trace(ruler, laser), slice(100, len(ruler)), self.REST, self.NOISE)
        return found, ruler[100:]

    @pytest.mark.parametrize("scatter", [0.0, 0.1 * UM])
    def test_is_the_line_of_the_ruler_by_the_laser(self, scatter: float) -> None:
        """u: that of the line, and a rectangle of ±0.3 µm, which a curve at the start makes."""
        displacement = np.linspace(0.07, 4.9, 97) * UM
        found, ruler = self._kink(displacement, 1.3, scatter)
        assert found is not None
        kept = (displacement > 0.2 * UM) & (displacement < 3.0 * UM)
        line = stats.linregress(displacement[kept], ruler[kept])
        assert found.value == pytest.approx(line.intercept, rel=1e-9)
        expected = math.hypot(line.intercept_stderr, 0.3 * UM / math.sqrt(3.0))
        assert found.u == pytest.approx(expected, rel=1e-6)

    def test_the_laser_counts_from_its_noise_or_a_tenth_of_a_micrometre(self) -> None:
        """Below the limit lies a sample that would move the line; ten deviations of 5 nm or 20 nm
        are 0.05 and 0.2 µm."""
        for noise, limit in ((0.005 * UM, 0.1), (0.02 * UM, 0.2)):
            displacement = np.array([0.98 * limit, 1.02 * limit, 0.5, 1.0, 1.5, 2.0, 2.99, 3.01])
            ruler = 7.0 + displacement
            ruler[[0, -1]] += 5.0
            long = np.concatenate([np.linspace(-200.0, -100.0, 100), ruler]) * UM
            laser = np.concatenate([np.zeros(100), displacement]) * UM
            found = laser_kink(_trace(long, laser), slice(100, 108), 0.0, noise)
            assert found is not None
            assert found.value == pytest.approx(7.0 * UM, rel=1e-9)

    def test_five_samples_are_enough(self) -> None:
        displacement = np.linspace(0.5, 2.5, 5) * UM
        assert self._kink(displacement, 1.0)[0] is not None
        assert self._kink(displacement[:4], 1.0)[0] is None

    def test_the_rod_goes_half_to_three_times_as_far_as_the_tip(self) -> None:
        displacement = np.linspace(0.5, 2.5, 20) * UM
        known = [self._kink(displacement, slope)[0] is not None for slope in (0.45, 0.55, 2.9, 3.1)]
        assert known == [False, True, True, False]


def _made(pretravel: dict[str, list[float]]) -> list[RigTouch]:
    """Touches with a pretravel in µm, all from one start; r3 is 0.4 µm, 0.1 µm more each time."""
    return [
        replace(BLANK, trace=f"{name}_{k + 1}", r1=value * UM, r3=(0.4 + 0.1 * k) * UM)
        for name, values in pretravel.items()
        for k, value in enumerate(values)
    ]


class TestCalibration:
    MADE: ClassVar = {
        "p_180": [5.0, 5.2, 5.4],
        "p_000": [3.0, 3.2],
        "q": [4.3],
        "p_090": [4.0, 4.0, 4.3, 4.5],
    }
    """Squares about the means, in 0.01 µm²: 8, 2, 0, 18; degrees of freedom 2, 1, 0, 3."""

    def _found(self) -> RigCalibration:
        touches = _made(self.MADE)
        touches[3] = replace(touches[3], r3=math.nan)
        touches += [replace(BLANK, trace="p_045_1", r1=math.nan)]
        touches += [replace(BLANK, trace="p_060_1", r1=9e-3)]
        return calibrate_rig(
            touches, exclude=["p_060_1.csv"], search_outliers=False, probability=0.9
        )

    def test_all_figures(self) -> None:
        found = self._found()
        s = math.sqrt(0.28 / 6.0) * UM
        assert [d.name for d in found.directions] == ["p_000", "p_090", "p_180", "q"]
        assert [d.count for d in found.directions] == [2, 4, 3, 1]
        assert [d.pretravel for d in found.directions] == pytest.approx(
            np.array([3.1, 4.2, 5.2, 4.3]) * UM, rel=1e-9
        )
        assert [d.u_pretravel for d in found.directions] == pytest.approx(
            s / np.sqrt([2, 4, 3, 1]), rel=1e-9
        )
        assert [d.pretravel_range for d in found.directions] == pytest.approx(
            np.array([0.2, 0.5, 0.4, 0.0]) * UM, rel=1e-9
        )
        assert found.pretravel == pytest.approx(4.2 * UM, rel=1e-9)
        assert found.u_pretravel == pytest.approx(
            s * math.sqrt(1 / 2 + 1 / 4 + 1 / 3 + 1) / 4.0, rel=1e-9
        )
        assert found.repeatability.value == pytest.approx(s, rel=1e-9)
        assert found.repeatability.dof == 6
        # Chi-square with 6 degrees of freedom, 5 % and 95 %: 1.635 and 12.592 (NIST tables).
        assert found.repeatability.low == pytest.approx(s * math.sqrt(6 / 12.592), rel=1e-3)
        assert found.repeatability.high == pytest.approx(s * math.sqrt(6 / 1.635), rel=1e-3)
        assert found.probability == 0.9
        assert found.left_out == ("p_045_1",)
        assert found.excluded == ("p_060_1",)
        assert found.outliers == ()
        assert found.with_outliers is None
        assert found.not_used == {"p_045_1": "no pretravel", "p_060_1": "excluded"}

    def test_spread_and_range_of_a_direction(self) -> None:
        first, second, third, single = self._found().directions
        # Chi-square with one, three and two degrees of freedom at 95 %: 3.841, 7.815, 5.991.
        for d, squares, dof, limit in (
            (first, 0.02, 1, 3.841), (second, 0.18, 3, 7.815), (third, 0.08, 2, 5.991),
        ):  # fmt: skip
            assert d.repeatability.value == pytest.approx(math.sqrt(squares / dof) * UM, rel=1e-9)
            assert d.repeatability.low == pytest.approx(math.sqrt(squares / limit) * UM, rel=1e-3)
            assert d.repeatability.dof == dof
        assert math.isnan(single.repeatability.value)
        assert single.repeatability.dof == 0.0
        assert math.isnan(single.azimuth)

    def test_hysteresis(self) -> None:
        """0.4, 0.5, 0.6; (missing), 0.5; 0.4; 0.4 to 0.7 µm: the mean of all nine, and of each."""
        found = self._found()
        assert found.hysteresis == pytest.approx(4.6 / 9.0 * UM, rel=1e-9)
        assert found.largest_hysteresis == pytest.approx(0.7 * UM, rel=1e-9)
        assert [d.hysteresis for d in found.directions] == pytest.approx(
            np.array([0.5, 0.55, 0.5, 0.4]) * UM, rel=1e-9
        )
        # 0.05 and 0.02 µm² with three and two degrees of freedom.
        s = math.sqrt(0.07 / 5.0) * UM
        assert [d.u_hysteresis for d in found.directions] == pytest.approx(
            s / np.sqrt([1, 4, 3, 1]), rel=1e-9
        )

    def test_largest_hysteresis_has_its_sign(self) -> None:
        touches = [replace(t, r3=-2.0 * t.r3) for t in _made({"p_000": [3.0, 3.1]})]
        assert calibrate_rig(touches).largest_hysteresis == pytest.approx(-1.0 * UM, rel=1e-9)
        without = calibrate_rig([replace(t, r3=math.nan) for t in touches])
        assert math.isnan(without.hysteresis)
        assert math.isnan(without.largest_hysteresis)

    def test_anisotropy_interval_is_that_of_the_direction_touched_least(self) -> None:
        """Studentised range of three means with 6 degrees of freedom, 95 %: 4.34 (tables)."""
        made = {name: values for name, values in self.MADE.items() if name != "q"}
        found = calibrate_rig(_made(made), search_outliers=False)
        half = 4.339 * math.sqrt(0.28 / 6.0 / 2.0) * UM
        assert found.anisotropy == pytest.approx(2.1 * UM, rel=1e-9)
        assert found.anisotropy_interval == pytest.approx(
            [2.1 * UM - half, 2.1 * UM + half], rel=1e-3
        )

    def test_no_anisotropy_interval_of_one_direction_or_without_repeats(self) -> None:
        for made in ({"p_000": [3.0, 3.1]}, {"p_000": [3.0], "p_090": [3.5]}):
            found = calibrate_rig(_made(made), search_outliers=False)
            assert np.all(np.isnan(found.anisotropy_interval))
            differ = 0.5 * UM if len(made) > 1 else math.nan
            assert found.anisotropy == pytest.approx(differ, rel=1e-9, nan_ok=True)

    @pytest.mark.parametrize(("range_um", "differ"), [(0.29, False), (0.31, True)])
    def test_starts_differ_by_three_ranges_of_pretravel(
        self, range_um: float, differ: bool
    ) -> None:
        """Pretravel within 0.1 µm; all starts but one are the same."""
        for spread, limit in ((0.1, range_um), (0.001, 0.1 * range_um)):  # at least 0.01 µm
            r1 = np.array([3.0, 3.0 + limit]) * UM
            touches = [
                replace(BLANK, trace=f"p_000_{k}", r1=end, r0=end - (3.0 + spread * k) * UM)
                for k, end in enumerate(r1)
            ]
            single = replace(BLANK, trace="p_090_1")
            assert calibrate_rig([*touches, single]).starts_differ == differ

    @pytest.mark.parametrize(
        ("value", "taken"), [(-1.9, True), (-2.1, False), (149, True), (151, False)]
    )
    @pytest.mark.parametrize("notes", [(), ("the contact signal bounced",)])
    def test_pretravel_of_a_plausible_size(
        self, value: float, taken: bool, notes: tuple[str, ...]
    ) -> None:
        touches = [
            *_made({"p_000": [3.0]}),
            replace(BLANK, trace="x_1", r1=value * UM, notes=notes),
        ]
        if taken:
            assert calibrate_rig(touches).directions[1].pretravel == pytest.approx(value * UM)
            return
        with pytest.raises(PretravelError) as refused:
            calibrate_rig(touches)
        told = str(refused.value)
        assert told.startswith(f"x_1: pretravel r1 - r0 is {value:.1f} µm")
        assert ("(the contact signal bounced)" in told) == bool(notes)
        assert ("high at rest? A false trigger" in told) == (not notes)
        assert refused.value.inputs == ("exclude",)

    def test_traces_without_pretravel_are_listed_with_their_notes(self) -> None:
        first = replace(BLANK, trace="a_1", r1=math.nan, notes=("no trigger", "noisy"))
        second = replace(BLANK, trace="b_1", r1=math.nan)
        with pytest.raises(PretravelError, match="a_1: no trigger, noisy; b_1: no events"):
            calibrate_rig([first, second])

    def test_two_names_of_one_azimuth(self) -> None:
        with pytest.raises(PretravelError, match="p_030 and p_30 are the same direction"):
            calibrate_rig(_made({"p_030": [3.0], "p_30": [3.1]}))
        assert len(calibrate_rig(_made({"left": [3.0], "right": [3.1]})).directions) == 2


def test_a_length_component_has_no_part_that_was_not_given() -> None:
    part = LengthComponent("scale", "B")
    assert (part.constant, part.per_length, part.dof) == (0.0, 0.0, math.inf)
    assert not part.repeatability
    both = LengthComponent("heat", "B", 2e-5, 1e-6, 7.0)
    (found,) = length_budget([both], 30.0).components
    assert found.standard_uncertainty == pytest.approx(5e-5)
    assert found.dof == 7.0
    with pytest.raises(PretravelError, match="the length is -1 mm"):
        length_budget([both], -1.0)


class TestOutliers:
    def test_a_repeat_is_judged_by_its_direction(self) -> None:
        """Five repeats, the last 1 µm off. Distance: from the mean of four. Limit: Student's
        quantile for one of five touches, 3 degrees of freedom, times s √(1 + 1/4)."""
        values = np.array([3.00, 3.02, 3.01, 2.97, 4.00]) * UM
        (found,) = outlying_rows(values, np.zeros(5, dtype=np.int64), np.full(5, math.nan), 1e-9)
        s = float(np.std(values[:4], ddof=1))
        limit = stats.t.isf(0.01 / 10.0, 3) * s * math.sqrt(5 / 4)
        assert found.rows == (4,)
        assert found.distance == pytest.approx(1.0 * UM, rel=1e-9)
        assert found.limit == pytest.approx(limit, rel=1e-9)
        assert not found.against_map

    def test_a_single_touch_is_judged_by_the_map(self) -> None:
        """Twelve directions, the third 1 µm off a constant with a third harmonic and noise of
        10 nm: prediction, limit and quantile from least squares of the eleven others."""
        azimuth = np.arange(12.0) * (np.pi / 6.0)
        rng = np.random.default_rng(5)
        values = (4.0 + np.cos(3.0 * azimuth) + 0.01 * rng.standard_normal(12)) * UM
        values[2] += 1.0 * UM
        (found,) = outlying_rows(values, np.arange(12), azimuth, 1e-9)
        orders = np.array([1.0, 2.0, 3.0])
        phases = azimuth[:, None] * orders
        design = np.hstack([np.ones((12, 1)), np.cos(phases), np.sin(phases)])
        known, own = np.delete(design, 2, axis=0), design[2]
        solution, squares = np.linalg.lstsq(known, np.delete(values, 2), rcond=None)[:2]
        beside = own @ np.linalg.inv(known.T @ known) @ own
        limit = stats.t.isf(0.01 / 24.0, 4) * math.sqrt(squares[0] / 4.0 * (1.0 + beside))
        assert found.rows == (2,)
        assert found.against_map
        assert found.distance == pytest.approx(values[2] - own @ solution, rel=1e-9)
        assert found.limit == pytest.approx(limit, rel=1e-6)


def test_what_leaving_out_changes_is_told_with_the_largest_u() -> None:
    """Directions touched twice and eight times: u of the former is twice that of the latter."""
    rng = np.random.default_rng(8)
    often = [3.0 + 0.02 * rng.standard_normal() for _ in range(8)]
    touches = _made({"p_000": often, "p_090": [3.1, 3.12], "p_180": [*often[:6], 7.0]})
    found = calibrate_rig(touches)
    assert [outlier.trace for outlier in found.outliers] == ["p_180_7"]
    told = " ".join(left_out_sentences(found))
    for calibration in (found, found.with_outliers):
        assert calibration is not None
        largest = calibration.directions[1].u_pretravel
        assert largest == pytest.approx(2.0 * calibration.directions[0].u_pretravel)
        assert f"{largest / UM:.3g} µm" in told
