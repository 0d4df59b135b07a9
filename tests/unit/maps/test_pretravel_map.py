"""Refusals of a pretravel map, and the data that it keeps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.sectors import SectorBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.spherical_harmonics import degrees_and_orders
from pretravel.maps.support import DirectionSupport
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.predict import predict
from pretravel.uncertainty.covariance import Covariance


class TestMapValidation:
    SUPPORT = DirectionSupport(sphere_pattern_25())

    @pytest.mark.parametrize(
        "numbers",
        [
            {"tip_radius": -3.0},
            {"u_tip_radius": math.inf},
            {"repeatability": -3e-4},
            {"fixed_scatter": math.nan},
            {"feed": -60.0},
            {"delay": math.nan, "u_delay": 1e-5},
            {"repeatability_dof": -1.0},
        ],
    )
    def test_numbers_that_no_map_has(self, numbers: dict[str, float]) -> None:
        with pytest.raises(PretravelError):
            PretravelMap(
                MeanBasis(), np.array([0.01]), Covariance.none(1), self.SUPPORT,
                **{"tip_radius": 3.0, **numbers},
            )  # fmt: skip

    def test_one_coefficient_that_is_not_finite(self) -> None:
        with pytest.raises(PretravelError, match="coefficients of a map must be finite"):
            PretravelMap(
                HarmonicBasis(np.array([[0, 0], [1, 0]])), np.array([0.01, math.nan]),
                Covariance.none(2), self.SUPPORT, tip_radius=3.0,
            )  # fmt: skip

    @pytest.mark.parametrize("terms", [[[1, 2]], [[-1, 0]], [[2, 0], [2, 0]], [[0.5, 0.0]], [0, 0]])
    def test_harmonics_that_no_map_has(self, terms: list[list[float]]) -> None:
        with pytest.raises(PretravelError, match="orders from -degree to degree, each once"):
            HarmonicBasis(np.array(terms))

    @pytest.mark.parametrize(
        ("coefficients", "covariance", "words"),
        [
            (np.zeros(2), np.zeros(1), "needs 1 coefficients"),
            (np.zeros(1), np.zeros((2, 2)), "covariance is of 2 coefficients; the map has 1"),
            (np.array([np.nan]), np.zeros(1), "must be finite"),
            (np.zeros(1), np.array([-1.0]), "cannot be negative"),
        ],
    )
    def test_sizes(self, coefficients: np.ndarray, covariance: np.ndarray, words: str) -> None:
        made = Covariance.full if covariance.ndim == 2 else Covariance.independent
        with pytest.raises(PretravelError, match=words):
            PretravelMap(MeanBasis(), coefficients, made(covariance), self.SUPPORT, tip_radius=3.0)

    def test_not_a_covariance(self) -> None:
        bad = np.array([[1e-8, -9e-8], [-9e-8, 1e-8]])
        with pytest.raises(PretravelError, match="not a covariance"):
            Covariance.full(bad)

    def test_shared_errors_are_interpolated_as_uncertainties(self) -> None:
        """Halfway between sectors of 2 and 4 µm u is 3 µm, not less than the share of either."""
        variances = np.full(10, 4e-6)
        variances[3] = 16e-6
        shared = Covariance.fully_shared(variances)
        made = PretravelMap(SectorBasis(), np.zeros(10), shared, self.SUPPORT, tip_radius=3.0)
        between = from_angles(np.pi / 2, np.radians([45.0, 30.0]))
        assert np.allclose(made.standard_uncertainty(between), [3e-3, 2e-3])
        assert np.allclose(made.value_covariance(between), np.outer([3e-3, 2e-3], [3e-3, 2e-3]))

    def test_values_cannot_be_written_to(self) -> None:
        made = PretravelMap(
            MeanBasis(), np.zeros(1), Covariance.none(1), self.SUPPORT, tip_radius=3.0
        )
        with pytest.raises(ValueError, match="read-only"):
            made.coefficients[0] = 1.0  # type: ignore[index]

    def test_many_directions_are_the_same_as_few(self) -> None:
        """Chunks: values do not depend on the number of directions in one call."""
        basis = HarmonicBasis(degrees_and_orders(12))
        rng = np.random.default_rng(0)
        half = rng.normal(size=(basis.size, basis.size)) * 1e-5
        made = PretravelMap(
            basis,
            rng.normal(size=basis.size),
            Covariance.full(half @ half.T),
            self.SUPPORT,
            tip_radius=3.0,
        )
        n = fibonacci_cap(50_001, 1.5)
        assert np.allclose(made.pretravel(n)[-3:], made.pretravel(n[-3:]), atol=1e-13)
        assert np.allclose(
            made.standard_uncertainty(n)[-3:], made.standard_uncertainty(n[-3:]), rtol=1e-9
        )

    @pytest.mark.parametrize("polar", [20.0, 45.0, 70.0])
    def test_the_tip_moves_as_on_a_stem_that_is_stiff_along_its_axis(self, polar: float) -> None:
        """The displacement of a map without one: along the normal the pretravel, and aside what
        compliances of 1, 1 and 0.05 give. Beams and seats of a described probe with a 50 mm stylus
        have 0.02 to 0.05, which changes the slide by a fifth of itself at the most."""
        normals = from_angles(np.radians(polar), np.radians([0.0, 100.0, 230.0]))
        turn = probe_rotation((1.0, 0.0, 0.0))
        made = PretravelMap(
            MeanBasis(), np.array([0.010]), Covariance.none(1), self.SUPPORT, tip_radius=3.0,
            rotation=turn,
        )  # fmt: skip
        moved = made.tip_displacement(normals @ turn.T) @ turn
        assert np.sum(moved * normals, axis=1) == pytest.approx(0.010, rel=1e-12)
        down = from_angles(np.radians(polar + 90.0), np.radians([0.0, 100.0, 230.0]))
        aside = np.sum(moved * down, axis=1) / 0.010
        s, c = np.sin(np.radians(polar)), np.cos(np.radians(polar))
        assert aside == pytest.approx(0.95 * s * c / (s**2 + 0.05 * c**2), rel=1e-12)
        described = predict(load_probe("omp40-2"), normals).deflection
        slide = np.sum(described * down, axis=1) / np.sum(described * normals, axis=1)
        assert aside == pytest.approx(slide, rel=0.21)

    def test_sector_basis_sums_to_one(self) -> None:
        assert np.allclose(SectorBasis().design(fibonacci_cap(500, 3.0)).sum(axis=1), 1.0)
