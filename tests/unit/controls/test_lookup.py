"""Maps in the form of tables and series that a control evaluates."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.directions import (
    fibonacci_cap,
    from_angles,
    grid,
    ring_pattern,
    sphere_pattern_25,
)
from pretravel.base.errors import PretravelError
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.controls.lookup import supported_band
from pretravel.controls.lookup_formula import (
    LookupSeats,
    LookupSeries,
    exact_lookup,
    recurrence,
    sectoral_factor,
)
from pretravel.controls.lookup_table import LookupTable, lookup_table
from pretravel.files.touches_csv import read_touches
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics
from pretravel.maps.support import DirectionSupport
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.predict import predict
from pretravel.prediction.response import probe_response, response_map
from pretravel.qualification.qualify import qualify
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import example_map, lobes
from tests.support.examples import EXAMPLES


def predicted() -> PretravelMap:
    probe = load_probe("omp40-2")
    trigger = predict(probe, ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24))
    return response_map(probe, probe_response(probe), trigger)


class TestGrid:
    @pytest.mark.parametrize(("values", "error_um"), [(399, 0.13), (299, 0.18)])
    def test_few_variables_are_used_up(self, values: int, error_um: float) -> None:
        """For a harmonic map of the example's touches a ladder of steps gave 7 x 36 and 0.44 µm on
        Fanuc; 13 x 30 of the same 399 variables has 0.12."""
        made = qualify(
            read_touches(EXAMPLES / "sphere_touches.csv"), 24.9987, tip_diameter=6.0,
            kind="harmonic",
        ).pretravel_map  # fmt: skip
        table = lookup_table(made, tolerance=2e-5, most_values=values)
        assert table.values.size <= values
        assert table.largest_error < error_um * MICROMETRE


class TestLookup:
    def test_recurrence_is_the_spherical_harmonics(self) -> None:
        """The recursion for a control against SciPy's associated Legendre functions."""
        directions = fibonacci_cap(200, np.pi)
        across = np.hypot(directions[:, 0], directions[:, 1])
        for order in range(9):
            before, now = np.zeros(200), sectoral_factor(order) * across**order
            for degree in range(order, 25):
                if degree > order:
                    a, b = recurrence(degree, order)
                    before, now = now, a * directions[:, 2] * now - b * before
                phase = np.cos(order * np.arctan2(directions[:, 1], directions[:, 0]))
                expected = real_spherical_harmonics(directions, [(degree, order)])[:, 0]
                assert now * phase == pytest.approx(expected, abs=1e-11)

    def test_series_is_exact(self) -> None:
        pretravel_map = example_map()
        series = exact_lookup(pretravel_map)
        assert isinstance(series, LookupSeries)
        assert series.largest_error < 1e-12
        directions = fibonacci_cap(500, 90 * DEGREE)
        assert series.value(directions) == pytest.approx(
            pretravel_map.pretravel(directions), abs=1e-12
        )

    def test_six_seats_are_exact(self) -> None:
        for pretravel_map in (example_map("physical"), predicted()):
            seats = exact_lookup(pretravel_map)
            assert isinstance(seats, LookupSeats)
            assert seats.largest_error < 1e-12
            directions = fibonacci_cap(300, 85 * DEGREE)
            machine = directions @ pretravel_map.rotation.T
            assert seats.value(directions) == pytest.approx(
                pretravel_map.pretravel(machine), abs=1e-12
            )
        assert exact_lookup(example_map("wozniak")) is None

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

    @pytest.mark.parametrize("kind", ["harmonic", "physical", "wozniak"])
    def test_table_errs_no_more_than_its_header_says(self, kind: str) -> None:
        pretravel_map = example_map(kind)
        table = lookup_table(pretravel_map, tolerance=5e-4, most_values=1900)
        polar = np.random.default_rng(1).uniform(table.band.lowest, table.band.highest, 4000)
        azimuth = np.random.default_rng(2).uniform(0, 2 * np.pi, 4000)
        directions = from_angles(polar, azimuth)
        error = np.abs(
            table.value(directions) - pretravel_map.pretravel(directions, extrapolate=True)
        )
        # Searched in 200 000 directions; the error may be larger at kinks between them.
        assert error.max() < 1.1 * table.largest_error + 1e-9
        assert error.max() > 0.2 * table.largest_error
        nodes = grid(
            np.linspace(table.band.lowest, table.band.highest, table.rows),
            np.arange(table.values.shape[1]) * table.azimuth_step,
        )
        assert table.value(nodes) == pytest.approx(
            pretravel_map.pretravel(nodes, extrapolate=True), abs=1e-9
        )

    def test_where_no_table_is_within_the_tolerance_none_is_more_accurate(self) -> None:
        """A tolerance below the error of the most accurate table is met by no other one."""
        most = lookup_table(example_map("wozniak"), tolerance=0.0, most_values=700)
        error = most.largest_error
        again = lookup_table(example_map("wozniak"), tolerance=0.999 * error, most_values=700)
        assert again.largest_error == error
        assert again.number == most.number

    def test_a_table_just_within_the_tolerance_is_taken(self) -> None:
        coarse = lookup_table(example_map(), tolerance=1e-3, most_values=1900)
        assert coarse.largest_error > 1e-4
        tight = 1.001 * coarse.largest_error
        again = lookup_table(example_map(), tolerance=tight, most_values=1900)
        assert again.number == coarse.number

    def test_finer_tables_err_less(self) -> None:
        """Cubic: half the step, about an eighth of the error, or less (here: a smooth map)."""
        smooth = lobes(3)
        errors = [
            lookup_table(smooth, tolerance=1e-12, most_values=count).largest_error
            for count in (110, 400, 1700)
        ]
        assert errors[1] < errors[0] / 4.0
        assert errors[2] < errors[1] / 4.0

    def test_border_rows_are_on_the_parabola_of_the_nearest(self) -> None:
        """Third differences of a parabola vanish: of a border row and the three rows beside it."""
        values = lookup_table(example_map(), tolerance=1.0, most_values=399).values
        for rows in (values[:4], values[-4:]):
            assert np.abs(np.diff(rows, n=3, axis=0)).max() < 1e-15

    def test_table_of_a_ring(self) -> None:
        around = ring_pattern(np.array([90.0]) * DEGREE, 72)
        ring = PretravelMap(
            HarmonicBasis(np.array([[0, 0], [3, 3]])), np.array([0.01, 0.002]), Covariance.none(2),
            DirectionSupport(around), tip_radius=3.0,
        )  # fmt: skip
        band = supported_band(ring)
        assert band.lowest / DEGREE == pytest.approx(85.0, abs=0.3)
        assert band.highest / DEGREE == pytest.approx(95.0, abs=0.3)
        table = lookup_table(ring, tolerance=1e-5, most_values=1900)
        assert table.largest_error <= 1e-5

    def test_half_a_ring_is_no_table(self) -> None:
        half = from_angles(np.pi / 2, np.arange(0, 181, 10) * DEGREE)
        with pytest.raises(PretravelError, match="does not hold all around"):
            supported_band(
                PretravelMap(
                    HarmonicBasis(np.array([[0, 0]])), np.array([0.01]), Covariance.none(1),
                    DirectionSupport(half), tip_radius=3.0,
                )
            )  # fmt: skip

    def test_azimuth_has_no_seam(self) -> None:
        table = lookup_table(example_map(), tolerance=1e-4, most_values=400)
        near = np.array([-1e-9, 0.0, 1e-9])
        values = table.value(from_angles(60 * DEGREE, near))
        assert np.ptp(values) < 1e-9
        assert isinstance(table, LookupTable)
