"""Figures of a calibration on the rig, of touches whose results follow by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from scipy import stats

from pretravel.base.errors import PretravelError
from pretravel.laboratory.rig.budget import (
    own_repeatability,
    repeatability_doubts,
    shared_by_directions,
)
from pretravel.laboratory.rig.calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig.trace import RigTouch
from pretravel.laboratory.tasks.rig.report import performance_figures

UM = 1e-3
BLANK = RigTouch("", 0.0, 3e-3, 8e-3, 4e-4, 1e-5, 2e-5, 3e-5, 0.0, 0.0, 3.0, ())


def _made(pretravel: dict[str, list[float]]) -> list[RigTouch]:
    """Touches with a pretravel in µm, all from one start; r3 is 0.4 µm, 0.1 µm more each time."""
    return [
        replace(BLANK, trace=f"{name}_{k + 1}", r1=value * UM, r3=(0.4 + 0.1 * k) * UM)
        for name, values in pretravel.items()
        for k, value in enumerate(values)
    ]


class TestFigures:
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

    def test_of_all_directions(self) -> None:
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

    def test_spread_of_a_direction(self) -> None:
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

    def test_passes_that_differ(self) -> None:
        """By 0.3 µm each, in three directions alike: the mean of three passes has the standard
        deviation 0.3 µm / √3 in all directions, with k = 4.5265 of two degrees of freedom over 2
        (Student's t for 95.45 %). Passes that differ by what directions do are in the scatter."""
        alike = {"p_000": [3.0, 3.31, 3.6], "p_090": [4.01, 4.3, 4.6], "p_180": [5.0, 5.3, 5.59]}
        found = calibrate_rig(_made(alike), search_outliers=False)
        assert found.passes is not None
        assert found.passes.numbers == (1, 2, 3)
        assert found.passes.differences == pytest.approx(np.array([-0.3, 0, 0.3]) * UM, abs=1e-5)
        u = 4.5265 / 2.0 * np.std(found.passes.differences, ddof=1) / math.sqrt(3.0)
        assert found.passes.u == pytest.approx(u, rel=1e-4)
        s = found.repeatability.value
        assert found.u_pretravel == pytest.approx(math.hypot(s / 3.0, u), rel=1e-3)
        for d in found.directions:
            assert d.u_pretravel == pytest.approx(math.hypot(s / math.sqrt(3.0), u), rel=1e-3)
        names = [line.source for line in shared_by_directions(found)]
        assert names == ["differences of 3 passes"]
        assert "0.3 µm from the mean of all" in repeatability_doubts(found, ())[0]
        for made in (self.MADE, {**alike, "p_090": [4.6, 4.3, 4.01]}):
            other = calibrate_rig(_made(made), search_outliers=False)
            assert (other.passes, shared_by_directions(other)) == (None, ())

    def test_a_direction_that_scatters(self) -> None:
        """Ten times as much as five others: its u is that of its own repeats, theirs is not."""
        made = {f"p_{60 * k:03d}": [3.0, 3.02, 3.01, 3.03] for k in range(5)}
        touches = _made({**made, "p_300": [3.3, 3.2, 3.0, 3.1]})
        for found in (calibrate_rig(touches, search_outliers=False), calibrate_rig(touches)):
            rough = found.directions[-1]
            assert [d.scatters_more for d in found.directions] == [False] * 5 + [True]
            s = math.sqrt(0.05 / 3.0) * UM
            assert rough.u_pretravel == pytest.approx(s / 2.0, rel=1e-9)
            own = own_repeatability(found, rough)
            assert own is not None
            assert (own.constant, own.dof) == (pytest.approx(s / 2.0), 3.0)
            assert found.directions[0].u_pretravel < 0.5 * rough.u_pretravel
            assert "touches of p_300 scatter more" in repeatability_doubts(found, ())[0]

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
        # Equal shifts do not undo the edges, √(0.3² + 0.4²) µm; without repeats none is known.
        rough = [replace(t, u_r0=0.3 * UM, u_r3=0.4 * UM) for t in _made(self.MADE)]
        assert [d.u_hysteresis for d in calibrate_rig(rough, search_outliers=False).directions] == (
            pytest.approx(0.5 * UM / np.sqrt([2, 4, 3, 1]), rel=1e-9)
        )
        single = calibrate_rig([rough[0], rough[3]])
        assert all(math.isnan(d.u_hysteresis) for d in single.directions)

    def test_largest_hysteresis_has_its_sign(self) -> None:
        touches = [replace(t, r3=-2.0 * t.r3) for t in _made({"p_000": [3.0, 3.1]})]
        assert calibrate_rig(touches).largest_hysteresis == pytest.approx(-1.0 * UM, rel=1e-9)
        without = calibrate_rig([replace(t, r3=math.nan) for t in touches])
        assert math.isnan(without.hysteresis)
        assert math.isnan(without.largest_hysteresis)

    def test_anisotropies_of_hysteresis_and_repeatability(self) -> None:
        """Ren 2020, section 2.2, names them beside that of pretravel: largest minus smallest."""
        touches = _made({"p_000": [4.0, 4.04], "p_090": [4.0, 4.1, 4.2], "p_180": [4.0, 4.06]})
        found = calibrate_rig(touches, search_outliers=False)
        # Mean shifts 0.45, 0.5, 0.45; deviations 0.04 / √2, 0.1, 0.06 / √2 µm.
        assert found.hysteresis_anisotropy == pytest.approx(0.05 * UM)
        assert found.repeatability_anisotropy == pytest.approx((0.1 - 0.04 / math.sqrt(2.0)) * UM)
        once = calibrate_rig([touches[0], touches[2]], search_outliers=False)
        assert math.isnan(once.repeatability_anisotropy)

    @pytest.mark.published(
        "Ren 2020", "Equation 4",
        what="range of r1",
        ours="the same, beside a standard deviation",
        theirs="the same",
        verdict="agrees; a repeatability only where all touches start at one place",
    )  # fmt: skip
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

    def test_negative_azimuths_and_halves(self) -> None:
        found = calibrate_rig(_made({"p_22.5": [3.0], "p_-90": [4.0], "p_7": [5.0]}))
        assert [math.degrees(d.azimuth) for d in found.directions] == pytest.approx([-90, 7, 22.5])


class TestAnisotropy:
    def test_interval_is_that_of_the_direction_touched_least(self) -> None:
        """Studentised range of three means with 6 degrees of freedom, 95 %: 4.34 (tables)."""
        made = {name: values for name, values in TestFigures.MADE.items() if name != "q"}
        found = calibrate_rig(_made(made), search_outliers=False)
        half = 4.339 * math.sqrt(0.28 / 6.0 / 2.0) * UM
        assert found.anisotropy == pytest.approx(2.1 * UM, rel=1e-9)
        assert found.anisotropy_interval == pytest.approx(
            [2.1 * UM - half, 2.1 * UM + half], rel=1e-3
        )
        # Two nearly alike: studentised range of two means with two degrees of freedom, 6.085.
        alike = calibrate_rig(_made({"p_000": [3.0, 3.2], "p_090": [3.1, 3.3]}))
        half = 6.085 * 0.1 * UM
        assert alike.anisotropy_interval == pytest.approx([0.0, 0.1 * UM + half], rel=1e-3)

    def test_of_one_direction_or_without_repeats(self) -> None:
        """The report said "1 traces, 1 directions" and "anisotropy 0.000 µm"."""
        for made in ({"p_000": [3.0, 3.1]}, {"p_000": [3.0], "p_090": [3.5]}):
            found = calibrate_rig(_made(made), search_outliers=False)
            assert np.all(np.isnan(found.anisotropy_interval))
            differ = 0.5 * UM if len(made) > 1 else math.nan
            assert found.anisotropy == pytest.approx(differ, rel=1e-9, nan_ok=True)
        one = calibrate_rig(_made({"p_000": [4.0]}))
        assert math.isnan(one.hysteresis_anisotropy)
        assert "anisotropy unknown; repeatability unknown" in repr(one)
        figures = {figure.name: str(figure.value) for figure in performance_figures(one)}
        for name in ("anisotropy", "anisotropy of hysteresis", "anisotropy of repeatability"):
            assert figures[name].startswith("unknown")

    def test_of_equal_repeats_contains_the_sampling(self) -> None:
        """Edges of √5 · 10 nm; Tukey's quantile of two means with a known s is 1.96 √2."""
        touches = _made({"p_000": [4.0, 4.001], "p_090": [4.09, 4.091]})
        half = 1.96 * math.sqrt(2.0) * math.sqrt(5.0) * 1e-5 / math.sqrt(2.0)
        found = calibrate_rig(touches, search_outliers=False).anisotropy_interval
        assert found == pytest.approx([9e-5 - half, 9e-5 + half], rel=1e-3)


def test_a_repeatability_is_not_below_the_sampling() -> None:
    """Each edge lies between samples: a pretravel has u = √5 · 10 nm here. Three touches of 1 nm
    scatter fell between the same samples: a certificate stated s = 0.001 µm. The lower end of the
    interval stays that of the touches, since a probe may repeat better than the rig can show."""
    sampling = math.sqrt(5.0) * 1e-5
    found = calibrate_rig(_made({"a_000": [4.0, 4.001, 4.002]}), search_outliers=False)
    for spread in (found.repeatability, found.directions[0].repeatability):
        assert spread.measured == pytest.approx(1e-6, rel=1e-6)
        assert (spread.value, spread.high) == pytest.approx((sampling, sampling))
        assert spread.low == pytest.approx(1e-6 / math.sqrt(7.378 / 2.0), rel=1e-3)  # chi-square
        assert spread.of_sampling
    # They fell between the same samples, so that the mean has the error of one edge: all but 1 %.
    assert found.directions[0].u_pretravel == pytest.approx(sampling, rel=0.01)
    assert found.directions[0].expanded_pretravel == pytest.approx(2.0 * sampling, rel=0.01)
    rough = calibrate_rig(_made({"a_000": [4.0, 4.05, 4.1]}), search_outliers=False)
    assert not rough.repeatability.of_sampling


def test_repeats_at_any_phase_of_the_samples_average_their_edges() -> None:
    """Both ends scatter by the way between two samples: the mean of three has u of one / √3."""
    between = math.sqrt(12.0) * 2e-5
    touches = [
        replace(touch, r0=k * between / 3.0, r1=4.0 * UM + k * between * 2.0 / 3.0)
        for k, touch in enumerate(_made({"a_000": [4.0, 4.0, 4.0]}))
    ]
    (direction,) = calibrate_rig(touches, search_outliers=False).directions
    assert direction.u_pretravel == pytest.approx(direction.repeatability.value / math.sqrt(3.0))


class TestRefusals:
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
        assert calibrate_rig(touches, exclude=["x_1"]).excluded == ("x_1",)

    def test_traces_without_pretravel_are_listed_with_their_notes(self) -> None:
        first = replace(BLANK, trace="a_1", r1=math.nan, notes=("no trigger", "noisy"))
        second = replace(BLANK, trace="b_1", r1=math.nan)
        with pytest.raises(PretravelError, match="a_1: no trigger, noisy; b_1: no events"):
            calibrate_rig([first, second])

    @pytest.mark.parametrize(
        ("names", "words"),
        [
            (("a_030", "a_30"), "a_030 and a_30 are the same direction"),
            (("a_090", "a_Y"), "a_090 and a_Y are the same direction"),
            (("a_0p0", "a_Z"), "a_0p0 and a_Z are the same direction"),
            (("a_90p0", "a_Z"), "a_90p0 and a_Z are the same direction"),
            (("a_-30", "a_330"), "a_-30 and a_330 are the same direction"),
            (("a_000p190",), "polar angle is 190°"),
            (("a_20260101",), "azimuth is 2.02601e[+]07°"),
        ],
    )
    def test_one_direction_has_one_name(self, names: tuple[str, ...], words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            calibrate_rig(_made({name: [3.0] for name in names}))
        assert len(calibrate_rig(_made({"left": [3.0], "right": [3.1]})).directions) == 2

    def test_a_trace_twice(self) -> None:
        with pytest.raises(PretravelError, match="p_000_1 is given twice"):
            calibrate_rig(2 * _made({"p_000": [3.0]}))

    def test_excluded_traces_that_are_not_there(self) -> None:
        names = {f"p_{k:03d}": [3.0] for k in range(0, 130, 10)}
        with pytest.raises(PretravelError, match=r"no trace 'x' .* are p_000_1, .*, p_110_1, …$"):
            calibrate_rig(_made(names), exclude=["x"])
        fewer = _made(dict(list(names.items())[:12]))
        with pytest.raises(PretravelError, match=r"no trace 'x' .* p_110_1$"):
            calibrate_rig(fewer, exclude=["x", "y"])
        with pytest.raises(PretravelError, match="no trace is left"):
            calibrate_rig(fewer, exclude=[touch.trace for touch in fewer])

    @pytest.mark.parametrize("probability", [0.0, 1.0, -0.5, 1.5, math.nan])
    def test_a_probability_is_between_zero_and_one(self, probability: float) -> None:
        with pytest.raises(PretravelError, match="the probability"):
            calibrate_rig(_made({"p_000": [3.0]}), probability=probability)


@pytest.mark.slow
def test_intervals_cover_with_the_search_for_outliers() -> None:
    """95 % over 200 calibrations of twelve directions, five touches each: with that probability the
    hits are within the quantiles of one in ten thousand, 177 and 199. Tukey's interval of a range
    covers more: for the two means that are apart by it, as that of every pair does. No wider: half
    of it is the studentised range of twelve means over sqrt(5), by tables 4.90 for 40 degrees of
    freedom and 4.81 for 60, which gives 4.855 for 48."""
    hits, widths = np.zeros(2), []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        made = {
            f"rig_{azimuth:03d}": rng.normal(3.0 + math.cos(math.radians(3 * azimuth)), 0.03, 5)
            for azimuth in range(0, 360, 30)
        }
        calibration = calibrate_rig(_made({name: v.tolist() for name, v in made.items()}))
        repeatability, (low, high) = calibration.repeatability, calibration.anisotropy_interval
        widths.append((high - low) / repeatability.value)
        hits += [repeatability.low <= 0.03 * UM <= repeatability.high, low <= 2.0 * UM <= high]
    fewest, most = stats.binom.ppf([1e-4, 1.0 - 1e-4], 200, 0.95)
    assert fewest <= hits[0] <= most < 200
    assert hits[1] >= fewest
    # Where a good touch is left out as an outlier, the interval is a little wider.
    assert np.median(widths) == pytest.approx(2.0 * 4.855 / math.sqrt(5.0), rel=2e-3)
