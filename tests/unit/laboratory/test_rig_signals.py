"""Phases of the rod, runs of levels, edges and kinks of made traces: both sides of each limit."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from scipy import stats

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig.signals import (
    LevelChange,
    RulerPosition,
    laser_at_edge,
    laser_kink,
    level_changes,
    rod_motion,
    ruler_at_edge,
)
from pretravel.laboratory.rig.trace import RigTrace

UM = 1e-3
REST, STAND = np.zeros(30), np.full(40, 0.5)
OUT = 0.005 + 0.01 * np.arange(50)
"""The rod is at rest at 0, goes on in steps of 10 µm, stands at 0.5 mm, and returns."""


def _trace(*ruler: FloatArray, laser: FloatArray | None = None) -> RigTrace:
    """Samples of 1 ms."""
    whole = np.concatenate(ruler)
    level = np.ones(len(whole), dtype=bool)
    time = 1e-3 * np.arange(float(len(whole)))
    return RigTrace(time, whole, 0.0 * whole if laser is None else laser, level, level)


class TestMotion:
    def test_phases_without_noise_begin_and_end_at_the_sample(self) -> None:
        """A sample belongs to a rest where it is within a step, 10 µm, of its level."""
        motion = rod_motion(_trace(REST, OUT, STAND, OUT[::-1], REST))
        # Samples 79 and 120 are 5 µm below the stand, 30 and 169 as much above the rest.
        assert motion.forward == slice(30, 79)
        assert motion.standing == slice(79, 121)
        assert motion.back == slice(121, 169)
        assert motion.speed == pytest.approx(10.0, rel=1e-9)
        assert motion.noise == pytest.approx(0.0, abs=1e-12)

    def test_a_trace_that_ends_on_the_way_back_or_at_the_stand(self) -> None:
        cut = rod_motion(_trace(REST, OUT, STAND, OUT[:20:-1]))
        # The last sample, 148, is the lowest; 147 is within a step of it, up to rounding.
        assert cut.back.start == 121
        assert cut.back.stop in (146, 147, 148)
        standing = rod_motion(_trace(REST, OUT, STAND))
        assert standing.standing == slice(79, 120)
        assert standing.back == slice(120, 120)

    def test_a_way_back_far_below_the_start_does_not_move_the_start(self) -> None:
        low = _trace(REST, OUT, STAND, OUT[::-1], REST - 0.1)
        assert rod_motion(low).forward == slice(30, 79)

    @pytest.mark.parametrize(("gap", "stop"), [(6, 121), (7, 90)])
    def test_a_stand_bridges_six_samples(self, gap: int, stop: int) -> None:
        stand = STAND.copy()
        stand[10 : 10 + gap] = 0.45
        motion = rod_motion(_trace(REST, OUT, stand, OUT[::-1], REST))
        assert motion.standing == slice(79, stop)

    def test_spikes_of_the_ruler_are_no_motion(self) -> None:
        """0.4 mm at rest, on the way and at the stand."""
        ruler = np.concatenate([REST, OUT, STAND, OUT[::-1], REST])
        spikes = ruler.copy()
        spikes[[10, 55, 100]] += 0.4
        found, plain = (rod_motion(_trace(samples)) for samples in (spikes, ruler))
        assert found.speed == plain.speed
        for phase in ("forward", "standing", "back"):
            assert getattr(found, phase) == getattr(plain, phase)

    def test_noise_is_the_deviation_of_the_readings(self) -> None:
        """Second differences of independent readings have six times their variance. A rest with
        noise is no motion, though its velocities are larger than the rod's."""
        rng = np.random.default_rng(2)
        rest, out = np.zeros(3000), 1e-5 * np.arange(1.0, 5001.0)
        ruler = np.concatenate([rest, out, rest + 0.05, out[::-1], rest])
        # A median of 19000 absolute differences, some of them dependent: 2 % standard error.
        motion = rod_motion(_trace(ruler + 2e-5 * rng.standard_normal(len(ruler))))
        assert motion.noise == pytest.approx(2e-5, rel=0.08)
        assert motion.speed == pytest.approx(0.01, rel=0.01)
        assert motion.forward.start == pytest.approx(3000, abs=12)
        assert motion.standing.start == motion.forward.stop == pytest.approx(8000, abs=12)
        assert motion.standing.stop == motion.back.start == pytest.approx(11000, abs=12)
        assert motion.back.stop == pytest.approx(16000, abs=12)

    def test_the_speed_is_that_from_a_fifth_to_four_fifths_of_the_way(self) -> None:
        """Of a rod that speeds up evenly from rest, y = 3 + 5 t²: from 0.40 s, the last sample that
        is not above 4 mm, to 0.90 s, the first one that is not below 7 mm, (4.05 - 0.8) / 0.5
        mm/s. A rod that is out after four samples: from the last one at rest to the top."""
        trace = _trace(np.full(50, 3.0), 3.0 + 5.0 * (0.05 * np.arange(21)) ** 2, np.full(50, 8.0))
        assert rod_motion(replace(trace, time=50.0 * trace.time)).speed == pytest.approx(6.5)
        quick = _trace(np.zeros(60), 0.4 * np.array([0.25, 0.5, 0.75]), np.full(60, 0.4), REST)
        assert rod_motion(quick).speed == pytest.approx(0.1 / 1e-3, rel=1e-12)

    def test_a_rod_must_go_forward(self) -> None:
        with pytest.raises(PretravelError, match=r"does not go forward.* sample 1 of 120"):
            rod_motion(_trace(STAND, OUT[::-1], REST))


def _level(*edges: int, start: bool = True) -> np.ndarray:
    level = np.full(200, start)
    for edge in edges:
        level[edge:] = ~level[edge:]
    return level


@pytest.mark.parametrize(
    ("edges", "changes", "excursions"),
    [
        # The first and the last run of the record count however short they are.
        ((3,), [(3,)], 0), ((197,), [(197,)], 0), ((3, 197), [(3,), (197,)], 0),
        # A level has settled after ten milliseconds.
        ((50, 59), [], 1), ((50, 60), [(50,), (60,)], 0),
        # Two that are settled, and a short one between them.
        ((50, 100, 104), [(50,)], 1),
        # Three short runs before the change are its bounce.
        ((50, 52, 55, 120), [(50, 52, 55), (120,)], 0),
        # Two short excursions, one of them with a bounce of its own, and a change.
        ((30, 33, 60, 62, 64, 66, 150), [(150,)], 3),
        # Two short excursions before the change, and one after it.
        ((40, 42, 60, 61, 100, 150, 153), [(100,)], 3),
    ],
)  # fmt: skip
@pytest.mark.parametrize("start", [True, False])
def test_changes_of_a_level(
    edges: tuple[int, ...], changes: list[tuple[int, ...]], excursions: int, start: bool
) -> None:
    found, ignored = level_changes(_level(*edges, start=start), 1e-3 * np.arange(200.0))
    assert found == [LevelChange(c[0], c[-1], c) for c in changes]
    assert ignored == excursions
    assert [change.bounced for change in found] == [len(c) > 1 for c in changes]


class TestEdge:
    RULER: ClassVar = np.arange(200.0) * UM
    WAVE: ClassVar = 0.02 * UM * np.cos(np.arange(200.0) ** 2)

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

    @staticmethod
    def _check_line(ruler: FloatArray, noise: float, left_out: int | None) -> None:
        """The line through the thirty samples but one, and its u by scipy."""
        found = ruler_at_edge(_trace(ruler), 100, slice(0, 200), noise)
        kept = [sample for sample in range(85, 115) if sample != left_out]
        line = stats.linregress(np.array(kept) - 99.5, ruler[kept])
        assert found.value == pytest.approx(line.intercept, rel=1e-9)
        if noise == 0.0:
            expected = math.hypot(line.intercept_stderr, line.slope / 12**0.5)
            assert found.u == pytest.approx(expected, rel=1e-6)

    @pytest.mark.parametrize("spike", [0.0, 1.0])
    def test_scatter_about_the_line_and_a_spike(self, spike: float) -> None:
        """Cosines of one amplitude; a sample that is 1 mm off is as if it were not there."""
        ruler = self.RULER + self.WAVE
        ruler[104] += spike
        self._check_line(ruler, 0.0, 104 if spike else None)

    @pytest.mark.parametrize("deviations", [5.9, 6.1, -5.9, -6.1])
    def test_a_spike_is_six_deviations_off(self, deviations: float) -> None:
        """Of the ruler's noise; or, where it is more, of 1.4826 times the median distance from the
        line. The waves are as far above as below it and none at its middle: its line is theirs."""
        left_out = 107 if abs(deviations) > 6.0 else None
        ruler = self.RULER.copy()
        ruler[107] += deviations * 0.02 * UM
        self._check_line(ruler, 0.02 * UM, left_out)
        waves = 0.01 * UM * np.where(np.arange(200) % 2, 1.0, -1.0) * np.sign(np.arange(200) - 99.5)
        waves[99:101] = 0.0
        waves[107] = 0.01 * UM * deviations / 6.0 * 1.4826 * 6.0
        waves[107] *= 1.1 if left_out else 0.9
        self._check_line(self.RULER + waves, 0.0, left_out)

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

    def test_the_laser_is_read_from_a_line_of_four_samples_and_more(self) -> None:
        """Of thirty where the rod moves for long: waves that a line takes out."""
        trace = _trace(self.RULER, laser=2.0 * self.RULER + self.WAVE)
        assert laser_at_edge(trace, 100, slice(98, 101)) == trace.laser[100]
        for moving in (slice(98, 102), slice(0, 200), slice(97, 180)):
            n = np.arange(max(moving.start, 85), min(moving.stop, 115))
            expected = stats.linregress(n - 99.5, trace.laser[n]).intercept
            assert laser_at_edge(trace, 100, moving) == pytest.approx(expected, rel=1e-9)


class TestKink:
    REST, NOISE = 2.0 * UM, 0.02 * UM

    def _kink(
        self, displacement: FloatArray, slope: float, scatter: float = 0.0
    ) -> tuple[RulerPosition | None, FloatArray]:
        """Ruler 7 µm where the tip starts to move, and what it is at the displacements."""
        waves = scatter * np.cos(np.arange(len(displacement)) ** 2)
        ruler = np.concatenate([np.linspace(-200.0, -100.0, 100) * UM, 7.0 * UM + waves])
        ruler[100:] += slope * displacement
        laser = self.REST + np.concatenate([np.zeros(100), displacement])
        trace = _trace(ruler, laser=laser)
        return laser_kink(trace, slice(100, len(ruler)), self.REST, self.NOISE), ruler[100:]

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
            found = laser_kink(_trace(long, laser=laser), slice(100, 108), 0.0, noise)
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
