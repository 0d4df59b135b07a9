"""Forms of maps on controls: how a table is chosen and sampled, and formulas in all their parts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, cast

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import (
    azimuth_angle,
    from_angles,
    polar_angle,
    sphere_pattern_25,
)
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls import lookup, lookup_formula, lookup_table
from pretravel.controls.lookup import (
    Band,
    Lookup,
    MapSamples,
    probe_frame_pretravel,
    supported_band,
)
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries, exact_lookup, recurrence
from pretravel.controls.lookup_table import LookupTable
from pretravel.maps.basis import CondensedProbe, SeriesForm, SixSeatForm
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from tests.support.example_maps import lobes, mean_map

BAND = Band(20.0 * DEGREE, 80.0 * DEGREE)
TILT = probe_rotation((0.6, 0.0, 0.8), 0.3)


@dataclass(frozen=True, eq=False)
class _Ranges(DirectionSupport):
    """Supports polar angles between limits; with a hole in azimuth where they are negative."""

    ranges: tuple[tuple[float, float], ...] = ()

    def supports(self, directions: Any, margin: float = 0.0) -> Any:
        polar, azimuth = polar_angle(directions) / DEGREE, azimuth_angle(directions) / DEGREE
        held = np.zeros(len(polar), dtype=bool)
        for low, high in self.ranges:
            hole = (low < 0.0) & (azimuth > 201.0) & (azimuth < 207.0)
            held |= (polar >= abs(low) - 1e-9) & (polar <= abs(high) + 1e-9) & ~hole
        return held


class TestBand:
    @pytest.mark.parametrize(
        ("ranges", "band"),
        [
            (((0.0, 180.0),), (0.0, 180.0)),
            (((60.1, 71.9),), (60.25, 71.75)),
            (((85.25, 95.0),), (85.25, 95.0)),
            # The widest one, wherever it lies.
            (((0.0, 25.0), (40.0, 45.0), (150.0, 160.0)), (0.0, 25.0)),
            (((0.0, 5.0), (40.0, 65.0), (150.0, 160.0)), (40.0, 65.0)),
            (((0.0, 5.0), (40.0, 45.0), (150.0, 180.0)), (150.0, 180.0)),
            # A hole at some azimuths: the upper part has a hole.
            (((-10.0, -80.0), (80.0, 95.0)), (80.0, 95.0)),
            (((90.0, 90.0),), (90.0, 90.0)),
        ],
    )
    def test_a_band_is_the_widest_range_that_holds_all_around(
        self, ranges: tuple[tuple[float, float], ...], band: tuple[float, float]
    ) -> None:
        """In steps of a quarter of a degree."""
        held = _Ranges(sphere_pattern_25(), ranges)
        found = supported_band(replace(mean_map(0.01), support=held))
        assert (found.lowest / DEGREE, found.highest / DEGREE) == pytest.approx(band)

    def test_a_map_with_a_hole_everywhere_has_no_band(self) -> None:
        held = _Ranges(sphere_pattern_25(), ((-10.0, -80.0),))
        with pytest.raises(PretravelError, match="does not hold all around the probe's axis"):
            supported_band(replace(mean_map(0.01), support=held))

    def test_directions_of_the_probe_are_turned_into_the_machine(self) -> None:
        """Lobes of a tilted probe: 10 + sin³ cos 3 azimuth in its own frame; also outside of what
        the map supports, which a table's border is."""
        tilted = lobes(3, rotation=TILT)
        polar, azimuth = np.radians([20.0, 70.0, 89.0, 120.0]), np.radians([10.0, 200.0, 77.0, 5.0])
        expected = 10.0 + np.sin(polar) ** 3 * np.cos(3.0 * azimuth)
        found = probe_frame_pretravel(tilted, from_angles(polar, azimuth))
        assert found == pytest.approx(expected)


@dataclass
class _Spy:
    """A form that keeps the directions at which it is asked."""

    error: Callable[[FloatArray], FloatArray]
    asked: FloatArray = field(default_factory=lambda: np.empty((0, 3)))

    def value(self, directions: FloatArray) -> FloatArray:
        self.asked = directions
        return 0.01 + self.error(directions)


def _at_one(directions: FloatArray, where: FloatArray, error: float) -> FloatArray:
    return error * np.all(np.abs(directions - where) < 1e-6, axis=1)


class TestSamples:
    def test_they_fill_the_band_and_do_not_leave_it(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Steps below half a degree in polar angle, both borders, all around, no place twice."""
        monkeypatch.setattr(lookup, "_AZIMUTH_STEP", 5.8 * DEGREE)
        spy = _Spy(lambda n: np.zeros(len(n)))
        band = Band(20.0 * DEGREE, 32.0 * DEGREE)
        samples = MapSamples(mean_map(0.01), band)
        assert samples.largest_error(cast("Lookup", spy)) == 0.0
        polar = np.unique(polar_angle(spy.asked).round(9))
        assert polar[0] == pytest.approx(band.lowest)
        assert polar[-1] == pytest.approx(band.highest)
        assert np.diff(polar).max() < 0.5 * DEGREE
        around = np.unique(azimuth_angle(spy.asked).round(9))
        gaps = np.diff(np.append(around, around[0] + 2.0 * np.pi))
        assert gaps.max() < 6.5 * DEGREE
        assert len(np.unique(spy.asked.round(9), axis=0)) == len(spy.asked)

    def test_the_largest_error_is_that_of_any_one(self) -> None:
        """A form that errs at one direction, more or less than the map, and nowhere else."""
        samples = MapSamples(mean_map(0.01), BAND)
        spy = _Spy(lambda n: np.zeros(len(n)))
        samples.largest_error(cast("Lookup", spy))
        asked = spy.asked
        for number, error in ((0, 0.002), (1, -0.003), (30, -0.001), (len(asked) - 2, 0.004)):
            one = _Spy(partial(_at_one, where=asked[number], error=error))
            assert samples.largest_error(cast("Lookup", one)) == pytest.approx(abs(error))
        all_wrong = _Spy(lambda n: np.full(len(n), -0.005))
        assert samples.error_at_least(cast("Lookup", all_wrong)) == pytest.approx(0.005)
        samples.error_at_least(cast("Lookup", spy))
        assert 20 * len(spy.asked) < len(asked) < 40 * len(spy.asked)


@dataclass
class _Judge:
    """Errors of tables by their columns: one that is seen at once, and the largest one."""

    errors: dict[int, tuple[float, float]]
    searched: list[int]

    def error_at_least(self, form: LookupTable) -> float:
        return self.errors[form.values.shape[1]][0]

    def largest_error(self, form: LookupTable) -> float:
        self.searched.append(form.values.shape[1])
        return self.errors[form.values.shape[1]][1]


def _chosen(
    monkeypatch: pytest.MonkeyPatch, errors: dict[int, tuple[float, float]], tolerance: float
) -> tuple[LookupTable, list[int]]:
    """The table that is chosen of some with so many columns, and those that were searched."""
    judge = _Judge(errors, [])
    monkeypatch.setattr(lookup_table, "MapSamples", lambda *_: judge)
    monkeypatch.setattr(lookup_table, "supported_band", lambda made: BAND)
    monkeypatch.setattr(lookup_table, "_sizes", lambda *_: [(3, columns) for columns in errors])
    found = lookup_table.lookup_table(mean_map(0.01), tolerance=tolerance, most_values=10)
    return found, judge.searched


class TestChoice:
    @pytest.mark.parametrize(
        ("errors", "columns", "error", "searched"),
        [
            # The first within the tolerance of 5, which it may reach.
            ({4: (6, 7), 5: (4, 6), 6: (5, 5), 7: (1, 1)}, 6, 5, [5, 6]),
            # None is: the least error, however it seemed; a table of 9 and more is not searched.
            ({4: (9, 9.5), 5: (7, 9), 6: (6, 11), 7: (6.5, 8), 8: (20, 21)}, 7, 8, [6, 7, 5]),
            # Two seem alike.
            ({4: (6, 9), 5: (6, 8)}, 5, 8, [4, 5]),
            ({4: (6, 9), 5: (9.1, 9.2)}, 4, 9, [4]),
        ],
    )
    def test_the_coarsest_within_the_tolerance_or_the_most_accurate(
        self,
        errors: dict[int, tuple[float, float]],
        columns: int,
        error: float,
        searched: list[int],
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        table, tried = _chosen(monkeypatch, errors, 5.0)
        assert table.values.shape[1] == columns
        assert table.largest_error == error
        assert tried == searched

    def test_too_few_variables(self, monkeypatch: pytest.MonkeyPatch) -> None:
        with pytest.raises(PretravelError, match="10 variables are too few for a table"):
            _chosen(monkeypatch, {}, 5.0)

    @pytest.mark.parametrize(
        ("most", "sizes"),
        [
            (59, []),
            (60, [(3, 12)]),
            (95, [(3, 12), (3, 18)]),
            # Steps of 30 degrees: 3 rows and two borders; of 20: 4 and two; of 15: 5 and two. The
            # azimuth has the same step, or down to a third of it: 36, 54 or 72 columns at most.
            (180, [(3, 12), (3, 18), (3, 24), (3, 36), (4, 18), (4, 24), (5, 24)]),
        ],
    )
    def test_sizes_of_tables(self, most: int, sizes: list[tuple[int, int]]) -> None:
        assert list(lookup_table._sizes(BAND, most)) == sizes

    def test_no_step_of_the_azimuth_is_finer_than_a_third(self) -> None:
        found = list(lookup_table._sizes(BAND, 1000))
        for rows, most in ((3, 36), (4, 48), (5, 72)):
            columns = [c for r, c in found if r == rows]
            assert (min(columns), max(columns)) == ({3: 12, 4: 18, 5: 24}[rows], most)

    def test_a_band_without_width_has_two_rows(self) -> None:
        """They are alike, and a direction on the band has their value."""
        flat = Band(1.5, 1.5)
        assert {rows for rows, _ in lookup_table._sizes(flat, 200)} == {2}
        table = LookupTable(flat, np.tile([1.0, 3.0, 2.0, 5.0], (4, 1)))
        assert table.value(from_angles(1.5, np.radians([90.0, 180.0]))).tolist() == pytest.approx(
            [3.0, 2.0]
        )


class TestTable:
    @pytest.mark.parametrize("count", [2, 3, 4, 5, 6])
    def test_borders_continue_a_parabola(self, count: int) -> None:
        """k² - 3 k and 2 k² + 1 at -1 and behind the last row; two rows have no parabola."""
        k = np.arange(float(count))

        def rows(at: FloatArray) -> FloatArray:
            return np.column_stack([at**2 - 3.0 * at, 2.0 * at**2 + 1.0])

        found = lookup_table._with_borders(rows(k))
        beside = np.array([0.0, 0.0, 1.0, 1.0] if count == 2 else np.arange(-1.0, count + 1.0))
        assert found == pytest.approx(rows(beside))

    def test_outside_the_band_the_value_is_that_of_its_edge(self) -> None:
        """Values that are the polar angle: rounding carries a direction over an edge."""
        table = LookupTable(BAND, np.tile(np.radians([[0.0], [20], [40], [60], [80], [100]]), 6))
        n = from_angles(np.radians([15.0, 19.9, 50.0, 80.1, 85.0]), np.zeros(5))
        assert table.value(n) == pytest.approx(np.radians([20.0, 20.0, 50.0, 80.0, 80.0]))

    def test_a_narrow_band_has_its_own_step(self) -> None:
        """From 85 to 95 degrees in five steps of two."""
        narrow = LookupTable(Band(85.0 * DEGREE, 95.0 * DEGREE), np.zeros((8, 4)))
        assert narrow.polar_step == pytest.approx(2.0 * DEGREE)

    def test_numbers_of_tables_have_six_digits(self) -> None:
        numbers = {LookupTable(BAND, np.full((5, 4), 0.001 * i)).number for i in range(60)}
        assert len(numbers) == 60
        assert all(100_000 <= number < 1_000_000 for number in numbers)

    def test_a_table_of_a_tilted_probe_is_in_its_own_frame(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """10 + sin³ cos 3 azimuth within the error that the table states, at all azimuths."""
        monkeypatch.setattr(lookup_table, "supported_band", lambda made: Band(0.0, 1.6))
        table = lookup_table.lookup_table(lobes(3, rotation=TILT), tolerance=0.02, most_values=900)
        assert 0.0 < table.largest_error <= 0.02
        polar, azimuth = np.radians([15.0, 44.0, 71.0, 88.0]), np.radians([17.0, 130.0, 211.0, 340])
        expected = 10.0 + np.sin(polar) ** 3 * np.cos(3.0 * azimuth)
        assert table.value(from_angles(polar, azimuth)) == pytest.approx(expected, abs=0.021)


def _series() -> LookupSeries:
    """Degree 3: orders 0, 1 and 3; the last coefficient of order 1 is a sine, of 0 a cosine."""
    cosines, sines = np.zeros((4, 4)), np.zeros((4, 4))
    cosines[0, 0], cosines[2, 0], cosines[1, 1] = 1.0, 0.3, 0.2
    sines[3, 1], sines[3, 3], cosines[3, 3] = 1.0, -0.4, 0.5
    return LookupSeries(cosines, sines, BAND)


def _series_by_hand(n: FloatArray) -> FloatArray:
    """The same in Cartesian form: real spherical harmonics of mean square one from a table."""
    x, y, z = n.T
    return np.asarray(
        1.0
        + 0.3 * math.sqrt(5.0) * (1.5 * z**2 - 0.5)
        + 0.2 * math.sqrt(3.0) * x
        + math.sqrt(21.0 / 8.0) * (5.0 * z**2 - 1.0) * y
        + math.sqrt(35.0 / 8.0) * (-0.4 * (3.0 * x**2 * y - y**3) + 0.5 * (x**3 - 3.0 * x * y**2))
    )


class _Response:
    """Stands for six seats: their pretravel is 0.01 + 0.002 z."""

    rest_reactions = (8.0, 27.0)

    def pretravel(self, directions: FloatArray) -> FloatArray:
        return np.asarray(0.01 + 0.002 * directions[:, 2])


RESPONSE = cast("CondensedProbe", _Response())


class TestFormulas:
    def test_a_series_by_hand(self) -> None:
        series = _series()
        assert series.orders == [0, 1, 3]
        assert [series.highest_degree(order) for order in series.orders] == [2, 3, 3]
        assert series.description == "harmonic series of 6 terms"
        n = sphere_pattern_25()
        assert series.value(n) == pytest.approx(_series_by_hand(n))

    def test_between_orders_the_recursion_begins_without_the_degree_before(self) -> None:
        for order in range(5):
            a, b = recurrence(order + 1, order)
            assert a == pytest.approx(math.sqrt(2.0 * order + 3.0))
            assert b == 0.0

    def test_six_seats_with_everything_that_can_be_added(self) -> None:
        """0.8 times their pretravel, plus 3 µm, a shift of (4, -5, 6) µm and a series."""
        shift = np.array([0.004, -0.005, 0.006])
        alone = LookupSeats(RESPONSE, 0.8, 0.003, shift, None, BAND)
        n = sphere_pattern_25()
        expected = 0.8 * (0.01 + 0.002 * n[:, 2]) + 0.003 + n @ shift
        assert alone.value(n) == pytest.approx(expected)
        whole = replace(alone, series=_series())
        assert whole.value(n) == pytest.approx(expected + _series_by_hand(n))
        assert alone.description == "six seats, in closed form"
        assert whole.description == alone.description + ", and a harmonic series of 6 terms"
        assert whole.template_values()["sunk_at_rest"] == pytest.approx([4.0, 9.0])
        assert (alone.largest_error, _series().largest_error) == (0.0, 0.0)
        assert not alone.needs_table
        assert not _series().needs_table
        assert LookupTable.needs_table

    @pytest.mark.parametrize("seats", [False, True])
    def test_the_form_of_a_map_becomes_the_form_on_the_control(
        self, seats: bool, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Cosines have orders of zero and above; the size is that of the highest degree, whatever
        its order; a term that occurs twice counts twice; the error is that of all samples."""
        terms = np.array([[0, 0], [2, -1], [3, 1], [3, 1], [1, 1]])
        form = SeriesForm(terms, np.array([0.5, 2.0, 3.0, 4.0, -1.0]))
        own = SixSeatForm(RESPONSE, 0.8, 0.003, np.zeros(3), form) if seats else form

        class _Basis:
            def form_on_control(self, coefficients: FloatArray) -> object:
                return own

        class _Map:
            basis, coefficients = _Basis(), np.zeros(1)

        class _Samples:
            def __init__(self, *_: object) -> None: ...

            def largest_error(self, form: Lookup) -> float:
                assert form.largest_error == 0.0
                return 7e-6

        monkeypatch.setattr(lookup_formula, "MapSamples", _Samples)
        monkeypatch.setattr(lookup_formula, "supported_band", lambda made: BAND)
        found = exact_lookup(cast("PretravelMap", _Map()))
        assert found is not None
        assert found.largest_error == 7e-6
        series = found.series if isinstance(found, LookupSeats) else found
        assert isinstance(found, LookupSeats) == seats
        assert isinstance(series, LookupSeries)
        cosines, sines = np.zeros((4, 4)), np.zeros((4, 4))
        cosines[0, 0], cosines[3, 1], cosines[1, 1], sines[2, 1] = 0.5, 7.0, -1.0, 2.0
        assert series.cosines.tolist() == cosines.tolist()
        assert series.sines.tolist() == sines.tolist()
        if isinstance(found, LookupSeats):
            assert (found.scale, found.constant) == (0.8, 0.003)
            bare = lookup_formula._seats(SixSeatForm(RESPONSE, 1.0, 0.0, np.zeros(3)), BAND)
            assert bare.series is None
