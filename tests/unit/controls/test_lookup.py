"""Maps in the form of tables and formulas that a control evaluates, and how tables are chosen."""

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
    fibonacci_cap,
    from_angles,
    grid,
    polar_angle,
    ring_pattern,
    sphere_pattern_25,
)
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.controls import lookup, lookup_table
from pretravel.controls.lookup import (
    Band,
    Lookup,
    MapSamples,
    probe_frame_pretravel,
    supported_band,
)
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries, exact_lookup
from pretravel.controls.lookup_table import LookupTable
from pretravel.maps.basis import CondensedProbe, SeriesForm, SixSeatForm
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.spherical_harmonics import degrees_and_orders
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map, lobes, mean_map

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

    def test_a_map_of_one_side_has_no_band(self) -> None:
        """A quarter of the reference was touched: no row holds at the first azimuths."""
        quarter = grid(np.radians([40.0, 60.0, 90.0]), np.radians([0.0, 30.0, 60.0, 90.0]))
        with pytest.raises(PretravelError, match="does not hold all around the probe's axis"):
            supported_band(replace(mean_map(0.01), support=DirectionSupport(quarter)))

    def test_of_a_ring(self) -> None:
        """Touched on the equator; the margin of 5° belongs to the band."""
        around = DirectionSupport(ring_pattern(np.array([90.0]) * DEGREE, 24))
        band = supported_band(replace(mean_map(0.01), support=around))
        assert band.lowest / DEGREE == pytest.approx(85.0, abs=0.3)
        assert band.highest / DEGREE == pytest.approx(95.0, abs=0.3)

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

    @pytest.mark.long
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

    errors: Callable[[int], tuple[float, float]]
    seen: list[tuple[int, int]] = field(default_factory=list)
    searched: list[int] = field(default_factory=list)

    def error_at_least(self, form: LookupTable, enough: float) -> float:
        self.seen.append((form.rows, form.values.shape[1]))
        return self.errors(form.values.shape[1])[0]

    def largest_error(self, form: LookupTable) -> float:
        self.searched.append(form.values.shape[1])
        return self.errors(form.values.shape[1])[1]


def _judged(
    monkeypatch: pytest.MonkeyPatch,
    errors: Callable[[int], tuple[float, float]],
    tolerance: float,
    most_values: int,
    band: Band = BAND,
) -> tuple[LookupTable, _Judge]:
    """The table that is chosen, and those that were looked at and searched."""
    judge = _Judge(errors)
    monkeypatch.setattr(lookup_table, "MapSamples", lambda *_: judge)
    monkeypatch.setattr(lookup_table, "supported_band", lambda made: band)
    table = lookup_table.lookup_table(mean_map(0.01), tolerance=tolerance, most_values=most_values)
    return table, judge


class TestChoice:
    @pytest.mark.parametrize(
        ("errors", "columns", "error", "searched"),
        [
            # The first within the tolerance of 5, which it may reach.
            ({12: (6, 7), 18: (4, 6), 24: (5, 5), 36: (1, 1)}, 24, 5, [18, 24]),
            # None is: the least error, however it seemed; a table of 9 and more is not searched.
            ({12: (7, 9), 18: (6, 11), 24: (6.5, 8), 36: (9, 9.5)}, 24, 8, [18, 24, 12]),
            # Two seem alike.
            ({12: (6, 9), 18: (6, 8), 24: (8.5, 9)}, 18, 8, [12, 18]),
            ({12: (6, 9), 18: (9.1, 9.2)}, 12, 9, [12]),
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
        """Other tables are far off."""
        table, judge = _judged(monkeypatch, lambda c: errors.get(c, (99.0, 99.0)), 5.0, 180)
        assert table.values.shape[1] == columns
        assert table.largest_error == error
        assert [c for c in dict.fromkeys(judge.searched) if c in errors] == searched

    @pytest.mark.parametrize(
        ("most", "sizes"),
        [
            (60, [(3, 12)]),
            (95, [(3, 12), (3, 18)]),
            # Steps of 30 degrees: 3 rows and two borders; of 20: 4 and two; of 15: 5 and two. The
            # azimuth has the same step, or down to a third of it: 36, 54 or 72 columns at most.
            (180, [(3, 12), (3, 18), (3, 24), (3, 36), (4, 18), (4, 24), (5, 24)]),
        ],
    )
    def test_sizes_of_tables(
        self, most: int, sizes: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Coarse ones first; then every number of rows with as many columns as there are
        variables, and with multiples of three and six."""
        _, judge = _judged(monkeypatch, lambda c: (9.0, 9.0), 0.0, most)
        assert judge.seen[: len(sizes)] == sizes
        full = set()
        for rows in range(3, most // 12 - 1):
            columns = most // (rows + 2)
            full |= {(rows, columns // each * each) for each in (1, 3, 6)}
        assert set(judge.seen[len(sizes) :]) == full
        with pytest.raises(PretravelError, match="59 variables are too few for a table"):
            _judged(monkeypatch, lambda c: (9.0, 9.0), 0.0, 59)

    def test_no_step_of_the_azimuth_is_finer_than_a_third(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """Steps of 30, 20 and 15 degrees over 60; a band without width has two rows."""
        _, judge = _judged(monkeypatch, lambda c: (9.0 if c < 72 else 0.0, 0.0), 0.0, 1000)
        for rows, most in ((3, 36), (4, 48), (5, 72)):
            columns = [c for r, c in judge.seen if r == rows]
            assert (min(columns), max(columns)) == ({3: 12, 4: 18, 5: 24}[rows], most)
        _, judge = _judged(monkeypatch, lambda c: (9.0, 9.0), 0.0, 200, Band(1.5, 1.5))
        assert {rows for rows, _ in judge.seen} == {2}

    def test_few_variables_are_used_up(self) -> None:
        """For a harmonic map of the example's touches a ladder of steps gave 7 x 36 and 0.44 µm on
        Fanuc; 13 x 30 of the same 399 variables has 0.12."""
        table = lookup_table.lookup_table(example_map(), tolerance=2e-5, most_values=399)
        assert table.values.size <= 399
        assert table.largest_error < 0.13 * MICROMETRE


class TestTable:
    def test_on_a_grid_it_is_the_same(self) -> None:
        """In both borders, at a node and near the end of the turn; the order of sums differs."""
        form = LookupTable(BAND, np.random.default_rng(1).normal(size=(6, 5)))
        polar, around = np.radians([20.0, 33.0, 60.0, 80.0]), np.radians([0.0, 71.0, 72.0, 359.9])
        at_each = form.value(grid(polar, around)).reshape(4, 4)
        assert form.on_grid(polar, around) == pytest.approx(at_each, abs=1e-14)

    def test_between_nodes_it_is_the_cubic_of_four(self) -> None:
        """A parabola over the polar angle and a constant azimuth: exact everywhere, by borders on
        the parabola; over the azimuth, the Catmull-Rom spline written as in its paper, with slopes
        of half the difference of both neighbours."""
        polar = np.radians([0.0, 20.0, 40.0, 60.0, 80.0, 100.0])
        around = np.array([1.0, 3.0, 2.0, 7.0, 5.0])
        form = LookupTable(BAND, (polar**2)[:, None] + 0.0 * around)
        at = np.radians([20.0, 31.0, 47.0, 79.0, 80.0])
        n = from_angles(at, np.radians([0.0, 10.0, 200.0, 355.0, 90.0]))
        assert form.value(n) == pytest.approx(at**2)
        assert form.rows == 4
        assert form.polar_step == pytest.approx(20.0 * DEGREE)
        assert form.azimuth_step == pytest.approx(72.0 * DEGREE)
        wave = LookupTable(BAND, np.tile(around, (6, 1)))
        for place in (0.25, 1.5, 3.9, 4.3):
            i, f = int(place), place % 1.0
            p = [around[(i + k) % 5] for k in (-1, 0, 1, 2)]
            slopes = (p[2] - p[0]) / 2.0, (p[3] - p[1]) / 2.0
            expected = (
                (2 * f**3 - 3 * f**2 + 1) * p[1] + (f**3 - 2 * f**2 + f) * slopes[0]
                + (-2 * f**3 + 3 * f**2) * p[2] + (f**3 - f**2) * slopes[1]
            )  # fmt: skip
            n = from_angles(np.radians([33.0]), np.radians([72.0 * place]))
            assert wave.value(n)[0] == pytest.approx(expected)

    def test_outside_the_band_the_value_is_that_of_its_edge(self) -> None:
        """Values that are the polar angle: rounding carries a direction over an edge."""
        table = LookupTable(BAND, np.tile(np.radians([[0.0], [20], [40], [60], [80], [100]]), 6))
        n = from_angles(np.radians([15.0, 19.9, 50.0, 80.1, 85.0]), np.zeros(5))
        assert table.value(n) == pytest.approx(np.radians([20.0, 20.0, 50.0, 80.0, 80.0]))

    def test_a_narrow_band_has_its_own_step(self) -> None:
        """From 85 to 95 degrees in five steps of two; without width both rows are alike."""
        narrow = LookupTable(Band(85.0 * DEGREE, 95.0 * DEGREE), np.zeros((8, 4)))
        assert narrow.polar_step == pytest.approx(2.0 * DEGREE)
        flat = LookupTable(Band(1.5, 1.5), np.tile([1.0, 3.0, 2.0, 5.0], (4, 1)))
        assert flat.value(from_angles(1.5, np.radians([90.0, 180.0]))) == pytest.approx([3.0, 2.0])

    @pytest.mark.parametrize(
        ("lowest", "highest", "rows"), [(80, 85, 2), (80, 140, 3), (40, 160, 5)]
    )
    def test_nodes_are_the_map_and_borders_continue_a_parabola(
        self, lowest: float, highest: float, rows: int, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """In steps of 30°. Third differences of a parabola vanish, of a border row and the three
        rows beside it; two rows have no parabola."""
        band = Band(lowest * DEGREE, highest * DEGREE)
        monkeypatch.setattr(lookup_table, "supported_band", lambda made: band)
        made = lobes(3, rotation=TILT)
        found = lookup_table.lookup_table(made, tolerance=50.0, most_values=12 * (rows + 2))
        assert found.rows == rows
        values = found.values
        polar = np.linspace(lowest, highest, rows) * DEGREE
        nodes = grid(polar, np.arange(values.shape[1]) * found.azimuth_step)
        assert values[1:-1].ravel() == pytest.approx(probe_frame_pretravel(made, nodes), abs=1e-12)
        if rows == 2:
            assert np.array_equal(values[[0, -1]], values[[1, -2]])
            return
        for part in (values[:4], values[-4:]):
            assert np.diff(part, n=3, axis=0) == pytest.approx(0.0, abs=1e-12)

    def test_numbers_of_tables_have_six_digits(self) -> None:
        numbers = {LookupTable(BAND, np.full((5, 4), 0.001 * i)).number for i in range(60)}
        assert len(numbers) == 60
        assert all(100_000 <= number < 1_000_000 for number in numbers)

    @pytest.mark.parametrize("kind", ["harmonic", "wozniak"])
    def test_it_errs_no_more_than_its_header_says(
        self, kind: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(lookup, "_AZIMUTH_STEP", 0.41 * DEGREE)
        made = example_map(kind)
        table = lookup_table.lookup_table(made, tolerance=5e-4, most_values=1900)
        polar = np.random.default_rng(1).uniform(table.band.lowest, table.band.highest, 4000)
        directions = from_angles(polar, np.random.default_rng(2).uniform(0, 2 * np.pi, 4000))
        error = np.abs(table.value(directions) - probe_frame_pretravel(made, directions))
        # Searched in 200 000 directions; the error may be larger at kinks between them.
        assert error.max() < 1.1 * table.largest_error + 1e-9
        assert error.max() > 0.2 * table.largest_error


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


class _Seats(MeanBasis):
    """Has the formula of six seats, with another value."""

    def form_on_control(self, coefficients: FloatArray) -> SixSeatForm:
        series = SeriesForm(np.array([[1, 1], [2, -1], [1, 1]]), np.array([1e-3, 2e-3, 3e-3]))
        return SixSeatForm(RESPONSE, 0.8, 0.003, np.array([1e-3, 0.0, 0.0]), series)


class TestFormulas:
    def test_a_series_by_hand(self) -> None:
        series = _series()
        assert series.orders == [0, 1, 3]
        assert [series.highest_degree(order) for order in series.orders] == [2, 3, 3]
        assert series.description == "harmonic series of 6 terms"
        n = sphere_pattern_25()
        assert series.value(n) == pytest.approx(_series_by_hand(n))

    def test_series_of_every_degree_and_order(self) -> None:
        terms = degrees_and_orders(6)
        rng = np.random.default_rng(0)
        whole = PretravelMap(
            HarmonicBasis(terms), rng.standard_normal(len(terms)), Covariance.none(len(terms)),
            DirectionSupport(sphere_pattern_25()), tip_radius=3.0,
        )  # fmt: skip
        series = exact_lookup(whole)
        assert isinstance(series, LookupSeries)
        assert series.largest_error < 1e-12

    def test_six_seats_with_everything_that_can_be_added(self) -> None:
        """0.8 times their pretravel, plus 3 µm, a shift of (4, -5, 6) µm and a series."""
        shift = np.array([0.004, -0.005, 0.006])
        alone = LookupSeats(RESPONSE, 0.8, 0.003, shift, None, BAND)
        n = sphere_pattern_25()
        expected = 0.8 * (0.01 + 0.002 * n[:, 2]) + 0.003 + n @ shift
        assert alone.value(n) == pytest.approx(expected)
        whole = replace(alone, series=_series())
        assert whole.value(n) == pytest.approx(expected + _series_by_hand(n))
        assert alone.description == "six-seat formula"
        assert whole.description == alone.description + " and harmonic series of 6 terms"
        assert whole.template_values()["sunk_at_rest"] == pytest.approx([4.0, 9.0])
        assert (alone.largest_error, _series().largest_error) == (0.0, 0.0)
        assert not alone.needs_table
        assert not _series().needs_table
        assert LookupTable.needs_table

    def test_the_formula_of_a_map_states_its_error(self) -> None:
        """That of all samples; a term that occurs twice counts twice."""
        made = replace(mean_map(0.01), basis=_Seats())
        found = exact_lookup(made)
        assert isinstance(found, LookupSeats)
        assert (found.scale, found.constant, found.shift[0]) == (0.8, 0.003, 1e-3)
        assert found.series is not None
        assert found.series.cosines[1, 1] == 4e-3
        assert found.series.sines[2, 1] == 2e-3
        n = fibonacci_cap(5000, found.band.highest)
        assert found.largest_error == pytest.approx(np.abs(found.value(n) - 0.01).max(), rel=0.01)
        assert exact_lookup(example_map("wozniak")) is None
