"""A pretravel map: what it refuses, its values, their uncertainties and displacements."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, ring_pattern
from pretravel.base.errors import ExtrapolationError, PretravelError
from pretravel.base.frames import Placement, probe_rotation
from pretravel.maps import basis as basis_module
from pretravel.maps import observation, pretravel_map
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.sectors import SectorBasis
from pretravel.maps.provenance import Provenance
from pretravel.maps.support import DirectionSupport
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import made_up_map

TURN = probe_rotation((0.6, 0.0, 0.8), 0.3)


class TestRefusals:
    @pytest.mark.parametrize(
        "numbers",
        [
            {"tip_radius": 0.0}, {"tip_radius": 501.0}, {"u_tip_radius": -1e-9},
            {"repeatability": 1001.0}, {"fixed_scatter": -1e-9}, {"feed": 1.1e6},
            {"delay": 10.1}, {"delay": -10.1}, {"u_delay": -1e-9}, {"u_delay": 10.1},
            {"u_delay": math.nan}, {"repeatability_dof": math.nan}, {"repeatability_dof": -1e-9},
        ],
    )  # fmt: skip
    def test_beyond_their_limits(self, numbers: dict[str, float]) -> None:
        with pytest.raises(PretravelError):
            made_up_map(MeanBasis(), **numbers)

    def test_within_their_limits(self) -> None:
        made = made_up_map(
            MeanBasis(), tip_radius=5e-4, u_tip_radius=0.0, repeatability=0.0, fixed_scatter=0.0,
            feed=0.0, delay=-10.0, u_delay=10.0, repeatability_dof=0.0,
        )  # fmt: skip
        assert made.repeatability_dof == 0.0
        plain = made_up_map(MeanBasis())
        assert (plain.u_tip_radius, plain.repeatability, plain.fixed_scatter) == (0.0, 0.0, 0.0)
        assert (plain.feed, plain.delay, plain.repeatability_dof) == (None, None, math.inf)
        assert np.array_equal(plain.rotation, np.eye(3))

    @pytest.mark.parametrize(
        ("given", "words"),
        [
            ({"coefficients": np.zeros(2)}, "needs 3 coefficients"),
            ({"covariance": Covariance.none(2)}, "covariance is of 2 coefficients; the map has 3"),
            ({"coefficients": np.array([0.0, np.nan, 0.0])}, "coefficients of a map must be fin"),
            ({"delay_effect": np.zeros(2)}, "effect of the delay must be 3 finite"),
            ({"delay_effect": np.array([np.nan, 0.0, 0.0])}, "delay must be 3 finite"),
        ],
    )  # fmt: skip
    def test_sizes(self, given: dict[str, Any], words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            made_up_map(_Sliding(), **given)

    def test_not_a_covariance(self) -> None:
        with pytest.raises(PretravelError, match="not a covariance"):
            Covariance.full(np.array([[1e-8, -9e-8], [-9e-8, 1e-8]]))
        with pytest.raises(PretravelError, match="cannot be negative"):
            Covariance.independent([-1.0])

    def test_values_cannot_be_written_to(self) -> None:
        with pytest.raises(ValueError, match="read-only"):
            made_up_map(MeanBasis()).coefficients[0] = 1.0  # type: ignore[index]


def test_the_source_is_told_where_there_is_one() -> None:
    made = made_up_map(MeanBasis(), repeatability=3e-4)
    assert repr(made) == (
        "PretravelMap(mean; 58 directions; tip radius 3.0000 mm; repeatability 0.30 µm)"
    )
    sourced = replace(made, provenance=Provenance(source="made by hand"))
    assert repr(sourced).endswith("repeatability 0.30 µm; made by hand)")


class TestOutside:
    """Polar angles up to 90° hold, and 5° more."""

    MADE = made_up_map(MeanBasis(), rotation=TURN)

    def test_the_first_one_outside_is_told_with_its_distance(self) -> None:
        """In the frame of the probe: 97° is 7° from the nearest touch."""
        n = from_angles(np.radians([50.0, 97.0, 99.0]), np.radians([0.0, 45.0, 60.0]))
        words = "2 of 3 directions lie outside the map, the first at polar 97.0°, azimuth 45.0° "
        with pytest.raises(ExtrapolationError, match=words + r"\(7.0° away from the nearest supp"):
            self.MADE.pretravel(n @ TURN.T)

    @pytest.mark.parametrize(
        ("down", "up", "opposite"),
        [(10, 0, True), (4, 0, False), (5, 0, True), (20, 3, False), (9, 1, False), (5, 1, False),
         (18, 2, False), (19, 2, True)],
    )  # fmt: skip
    def test_normals_that_point_inwards(self, down: int, up: int, opposite: bool) -> None:
        """More than four, and more than nine of ten, of all directions lie outside."""
        inside = fibonacci_cap(max(down, up), 1.0)
        n = np.vstack([inside[:up], -inside[:down]])
        with pytest.raises(ExtrapolationError) as told:
            self.MADE.pretravel(n @ TURN.T)
        assert f"{down} of {down + up} directions lie outside the map" in str(told.value)
        assert ("turn the signs" in str(told.value)) == opposite
        assert ("Touch the reference there too" in str(told.value)) != opposite

    @pytest.mark.parametrize(("beside", "expected"), [(0, True), (1, False), (2, False)])
    def test_directions_whose_opposites_lie_outside_too(self, beside: int, expected: bool) -> None:
        """Of ten directions outside, more than nine must have an opposite inside."""
        cap = DirectionSupport(ring_pattern(np.radians([0.0, 20.0, 40.0]), 12))
        made = made_up_map(MeanBasis(), support=cap)
        n = np.vstack(
            [
                -fibonacci_cap(10 - beside, 0.6),
                from_angles(np.full(beside, 0.5 * np.pi), np.arange(float(beside))),
            ]
        )
        with pytest.raises(ExtrapolationError) as told:
            made.pretravel(n)
        assert ("turn the signs" in str(told.value)) == expected


@dataclass(frozen=True)
class _Sliding(MapBasis):
    """1, n_x and n_x n_y, of which the first `own` exist; displaced along n and along z, more on a
    curved part."""

    own: int = 3
    kind: ClassVar[str] = "sliding"

    @property
    def size(self) -> int:
        return self.own

    @property
    def constant(self) -> FloatArray:
        return np.eye(self.own)[0]

    def design(self, directions: FloatArray) -> FloatArray:
        x, y = directions[:, 0], directions[:, 1]
        return np.stack([np.ones(len(x)), x, x * y], axis=1)[:, : self.own]

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None
    ) -> FloatArray | None:
        size = 0.004 if curvatures is None else 0.004 + 0.1 * curvatures.sum(axis=1)[:, None]
        return np.asarray(size * directions + [0.0, 0.0, 0.002])

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        del stored
        return cls()


class TestDisplacement:
    N = from_angles(np.radians([20.0, 50.0, 80.0]), np.array([0.4, 2.0, 4.0]))
    CURVED = np.array([[0.01, 0.02], [0.0, 0.05], [0.03, 0.01]])

    def test_on_a_flat_part_its_component_along_the_normal_is_the_pretravel(self) -> None:
        made = made_up_map(_Sliding(), rotation=TURN)
        moved = made.tip_displacement(self.N @ TURN.T) @ TURN
        value = made.pretravel(self.N @ TURN.T)
        assert np.sum(moved * self.N, axis=1) == pytest.approx(value, rel=1e-12)
        beside = moved - value[:, None] * self.N
        along_z = np.array([0.0, 0.0, 0.002]) - 0.002 * self.N[:, 2:] * self.N
        assert beside == pytest.approx(along_z, abs=1e-15)
        # A curved part changes it as it does the probe's own displacement.
        curved = made.tip_displacement(self.N @ TURN.T, self.CURVED) @ TURN
        more = 0.1 * np.array([0.03, 0.05, 0.04])[:, None] * self.N
        assert curved - moved == pytest.approx(more, abs=1e-15)

    def test_a_prediction_is_the_probe_itself(self) -> None:
        """One coefficient alone: the scale of the predicted probe; nothing is missing."""
        made = made_up_map(_Sliding(1), rotation=TURN)
        moved = made.tip_displacement(self.N @ TURN.T) @ TURN
        assert moved == pytest.approx(0.004 * self.N + [0.0, 0.0, 0.002], abs=1e-15)

    @pytest.mark.parametrize("polar", [20.0, 45.0, 70.0])
    def test_without_one_it_is_that_of_a_stem_that_is_stiff_along_its_axis(
        self, polar: float
    ) -> None:
        """Along the normal the pretravel, and aside what compliances of 1, 1 and 0.05 give. Beams
        and seats of a described probe with a 50 mm stylus have 0.02 to 0.05, which changes the
        slide by a fifth of itself at the most."""
        normals = from_angles(np.radians(polar), np.radians([0.0, 100.0, 230.0]))
        made = made_up_map(MeanBasis(), rotation=TURN)
        moved = made.tip_displacement(normals @ TURN.T) @ TURN
        assert np.sum(moved * normals, axis=1) == pytest.approx(0.010, rel=1e-12)
        down = from_angles(np.radians(polar + 90.0), np.radians([0.0, 100.0, 230.0]))
        aside = np.sum(moved * down, axis=1) / 0.010
        s, c = np.sin(np.radians(polar)), np.cos(np.radians(polar))
        assert aside == pytest.approx(0.95 * s * c / (s**2 + 0.05 * c**2), rel=1e-12)
        described = predict(load_probe("omp40-2"), normals).deflection
        slide = np.sum(described * down, axis=1) / np.sum(described * normals, axis=1)
        assert aside == pytest.approx(slide, rel=0.21)


class TestValues:
    def test_they_do_not_depend_on_blocks(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Each value has the errors of its coefficients, and of the delay in common."""
        half = 1e-4 * np.random.default_rng(3).normal(size=(3, 3))
        made = made_up_map(
            _Sliding(), covariance=Covariance.full(half @ half.T), repeatability=3e-4,
            fixed_scatter=4e-4, delay=1e-3, u_delay=1e-5,
            delay_effect=np.array([1e-4, -2e-4, 3e-4]),
        )  # fmt: skip
        n = fibonacci_cap(23, 1.5)
        x, y = n[:, 0], n[:, 1]
        rows = np.stack([np.ones(23), x, x * y], axis=1)
        value, by_delay = rows @ made.coefficients, rows @ [1e-4, -2e-4, 3e-4]
        covariance = rows @ half @ half.T @ rows.T + np.outer(by_delay, by_delay)
        deviation = np.sqrt(np.diag(covariance))
        for numbers, block in ((9, 8192), (1, 8192), (4_000_000, 5)):
            monkeypatch.setattr(pretravel_map, "_CHUNK_VALUES", numbers)
            monkeypatch.setattr(pretravel_map, "BLOCK", block)
            monkeypatch.setattr(basis_module, "BLOCK", block)
            found, u = made.pretravel_and_uncertainty(n)
            assert found == pytest.approx(value, rel=1e-12)
            assert u == pytest.approx(deviation, rel=1e-9)
            assert made.standard_uncertainty(n) == pytest.approx(u, rel=1e-12)
            assert made.pretravel(n) == pytest.approx(value, rel=1e-12)
            by_basis = made.basis.values_in_blocks(n, made.coefficients)
            assert by_basis == pytest.approx(value, rel=1e-12)
        assert made.value_covariance(n) == pytest.approx(covariance, rel=1e-9, abs=1e-18)
        assert made.change_by_delay(n) == pytest.approx(by_delay)
        assert replace(made, delay_effect=None).change_by_delay(n).tolist() == [0.0] * 23
        assert made.single_touch == pytest.approx(5e-4)
        assert made.states_uncertainty

    def test_a_map_without_an_uncertainty_has_none(self) -> None:
        made = made_up_map(_Sliding(), delay_effect=np.ones(3))
        value, u = made.pretravel_and_uncertainty(fibonacci_cap(4, 1.5))
        assert not made.states_uncertainty
        assert u.tolist() == [0.0] * 4
        assert value == pytest.approx(made.pretravel(fibonacci_cap(4, 1.5)))

    def test_shared_errors_are_interpolated_as_uncertainties(self) -> None:
        """Halfway between sectors of 2 and 4 µm u is 3 µm, not less than the share of either."""
        variances = np.full(10, 4e-6)
        variances[3] = 16e-6
        made = made_up_map(SectorBasis(), covariance=Covariance.fully_shared(variances))
        between = from_angles(np.pi / 2, np.radians([45.0, 30.0]))
        assert np.allclose(made.standard_uncertainty(between), [3e-3, 2e-3])
        assert np.allclose(made.value_covariance(between), np.outer([3e-3, 2e-3], [3e-3, 2e-3]))

    def test_seen_from_a_turned_part(self) -> None:
        made = made_up_map(_Sliding(), rotation=TURN)
        part = Placement(probe_rotation((0.0, 0.6, 0.8), 0.7), np.array([1.0, 2.0, 3.0]))
        n = fibonacci_cap(20, 0.5)
        assert made.seen_from(part).pretravel(n, extrapolate=True) == pytest.approx(
            made.pretravel(part.vectors(n), extrapolate=True), abs=1e-12
        )


def test_the_largest_pretravel_grows_with_the_feed() -> None:
    """0.15 mm, and 0.03 s of travel: 600 mm/min are 10 mm/s."""
    assert observation.largest_plausible(None) == 0.15
    assert observation.largest_plausible(0.0) == 0.15
    assert observation.largest_plausible(600.0) == pytest.approx(0.45)
