"""Compensated points and their covariances, against Monte Carlo and by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, from_angles, unit
from pretravel.base.errors import ExtrapolationError
from pretravel.files.csv_table import read_csv_table
from pretravel.files.point_files import write_points
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Origin, Provenance
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply, compensation_warnings
from pretravel.measurement.measured_sphere import measured_sphere
from pretravel.measurement.point_budget import variances_along_normals
from pretravel.measurement.point_errors import errors_of_points
from pretravel.measurement.points_summary import TouchSummary
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance


def _warned(touches: Touches, made: PretravelMap) -> list[str]:
    """What compensation with a map warns about."""
    return compensation_warnings(TouchSummary.of(touches, apply(touches, made), made), made)


class TestCompensation:
    SUPPORT = DirectionSupport(fibonacci_cap(60, np.pi / 2))

    def _map(self) -> PretravelMap:
        return PretravelMap(
            MeanBasis(), np.array([0.012]), Covariance.independent([4e-8]), self.SUPPORT,
            tip_radius=3.0, u_tip_radius=1.5e-4, repeatability=3e-4,
        )  # fmt: skip

    def test_covariance_against_monte_carlo(self) -> None:
        """Reading, map and tip radius drawn at random; 20 000 draws determine variances to 1 %."""
        rng = np.random.default_rng(7)
        n = np.array([[0.6, 0.0, 0.8]])
        a = unit([[-0.2, 0.1, -1.0]])
        pretravel_map = self._map()
        points = apply(Touches([[10.0, 20.0, 30.0]], n, a), pretravel_map)
        closing = -(a @ n.T).item()
        draws = 20_000
        reading = [10.0, 20.0, 30.0] + rng.normal(0.0, 3e-4, (draws, 1)) * a
        travel = (0.012 + rng.normal(0.0, 2e-4, (draws, 1))) / closing
        radius = 3.0 + rng.normal(0.0, 1.5e-4, (draws, 1))
        sample = np.cov((reading - travel * a - radius * n).T)
        assert np.allclose(sample, points.covariance[0], atol=0.04 * np.trace(sample))
        along = (n @ sample @ n.T).item()
        assert points.standard_uncertainty[0] == pytest.approx(np.sqrt(along), rel=0.03)

    def test_oblique_map_uncertainty_in_closed_form(self) -> None:
        """Approach 60° off the normal: the uncertainty of the travel is that of the map over cos
        60°, and along the normal that of the map again. Repeatability acts along the approach.
        """
        n = np.array([[0.0, 0.0, 1.0]])
        a = np.array([[math.sqrt(0.75), 0.0, -0.5]])
        quiet = replace(self._map(), repeatability=0.0, u_tip_radius=0.0)
        points = apply(Touches([[0.0, 0.0, 3.0]], n, a), quiet)
        assert np.allclose(points.covariance[0], 4.0 * 4e-8 * np.outer(a[0], a[0]), atol=1e-18)
        assert points.standard_uncertainty[0] == pytest.approx(2e-4)
        noisy = replace(quiet, repeatability=3e-4, covariance=Covariance.none(1))
        along = apply(Touches([[0.0, 0.0, 3.0]], n, a), noisy).standard_uncertainty[0]
        assert along == pytest.approx(0.5 * 3e-4)

    def test_oblique_approaches_are_warned_of(self) -> None:
        """Only for a measured map, because it can contain a delay."""
        n = np.array([[0.0, 0.0, 1.0]])
        for tilt, noise, expected in ((30.0, 3e-4, True), (5.0, 3e-4, False), (30.0, 0.0, False)):
            a = [[math.sin(math.radians(tilt)), 0.0, -math.cos(math.radians(tilt))]]
            touches = Touches([[0.0, 0.0, 3.0]], n, a)  # type: ignore[arg-type]
            pretravel_map = replace(self._map(), repeatability=noise)
            warnings = _warned(touches, pretravel_map)
            assert any("off the normal" in warning for warning in warnings) == expected

    def test_an_unknown_delay_acts_along_the_approach(self) -> None:
        """300 mm/min between map and touches, for 2 ms: 10 µm of travel, beside the others."""
        n, a = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, -0.8]])
        made = replace(self._map(), feed=60.0)
        same, other = (Touches([[0.0, 0.0, 3.0]], n, a, feeds=[feed]) for feed in (60.0, 360.0))
        added = apply(other, made).covariance - apply(same, made).covariance
        assert np.allclose(added[0], 0.010**2 * np.outer(a[0], a[0]), atol=1e-15)

    @pytest.mark.parametrize(
        ("made_at", "feed", "expected"),
        [
            (None, None, ""),
            (None, 60.0, "the touches state a feed, the map does not"),
            (60.0, None, "the map states a feed, the touches do not"),
            (60.0, 60.0, ""),
        ],
    )
    def test_feeds_that_are_not_known_are_said(
        self, made_at: float | None, feed: float | None, expected: str
    ) -> None:
        """Of a qualified map, unless its delay is known."""
        n = np.array([[0.0, 0.0, 1.0]])
        touches = Touches([[0.0, 0.0, 3.0]], n, feeds=None if feed is None else [feed])
        qualified = Provenance(origin=Origin.QUALIFIED)
        made = replace(self._map(), feed=made_at, provenance=qualified)
        told = " ".join(_warned(touches, made))
        assert expected in told
        assert ("feed" in told) == bool(expected)
        if feed is not None:
            known = replace(made, feed=60.0, delay=1e-3, u_delay=1e-5, delay_effect=np.zeros(1))
            told = " ".join(_warned(touches, known))
            assert "state" not in told

    def test_sources_of_a_point_add_up(self) -> None:
        n, a = np.array([[0.0, 0.0, 1.0]]), np.array([[0.6, 0.0, -0.8]])
        touches = Touches([[0.0, 0.0, 3.0]], n, a, feeds=[360.0])
        made = replace(self._map(), feed=60.0, fixed_scatter=1e-4)
        sources = variances_along_normals(errors_of_points(touches, n, made))
        # By hand: noise, fixed scatter and 10 µm of delay act along the approach, 0.8 of them.
        expected = [(0.8 * 3e-4) ** 2, (0.8 * 1e-4) ** 2, 4e-8, 1.5e-4**2, (0.8 * 0.010) ** 2]
        assert [value.item() for value in sources.values()] == pytest.approx(expected, rel=1e-9)
        u = apply(touches, made).standard_uncertainty[0]
        assert u == pytest.approx(math.sqrt(sum(expected)), rel=1e-9)

    @pytest.mark.parametrize(("share", "count"), [(0.018, 1), (0.022, 2), (0.035, 2)])
    def test_factors_below_a_fiftieth_of_every_variance_are_left_out(
        self, share: float, count: int
    ) -> None:
        """Mean and three lobes at twelve equal azimuths are orthogonal, so each is a principal
        component: of the variance at the top of a lobe, the lobes are the share given."""
        n = from_angles(0.5 * np.pi, np.arange(12) * np.pi / 6.0)
        basis = HarmonicBasis(np.array([[0, 0], [3, 3]]))
        mean, lobe = basis.design(n[:1])[0]
        variances = np.array([(1.0 - share) / mean**2, share / lobe**2]) * 4e-8
        made = PretravelMap(
            basis, np.array([0.012, 0.0]), Covariance.independent(variances),
            DirectionSupport(n), tip_radius=3.0,
        )  # fmt: skip
        shared = apply(Touches(15.49 * n, n), made).shared
        assert shared is not None
        assert sorted(shared) == [f"map {k + 1}" for k in range(count)]
        assert shared["map 1"] ** 2 == pytest.approx(np.full(12, 4e-8 * (1.0 - share)))

    def test_repeatability_alone_has_degrees_of_freedom(self) -> None:
        n = fibonacci_cap(25, 1.5)
        touches = Touches(n * 15.49, n)
        made = replace(self._map(), repeatability_dof=50.0)
        budget = measured_sphere(touches, apply(touches, made), made).budget
        assert {c.name: c.dof for c in budget.components} == {
            "repeatability": 50.0, "map": math.inf, "tip radius": math.inf,
        }  # fmt: skip

    def test_deviation_has_a_sign_and_only_the_normal_part(self) -> None:
        n = np.array([[0.0, 0.0, 1.0]])
        low = Touches([[6.0, 5.0, 3.0 - 0.012 - 0.005]], n, nominal_points=[[5.0, 5.0, 0.0]])
        deviation = apply(low, self._map()).deviation
        assert deviation is not None
        assert deviation[0] == pytest.approx(-0.005, abs=1e-12)

    def test_u_um_in_the_file_is_along_the_normal(self, tmp_path: Path) -> None:
        n = np.array([[0.0, 0.6, 0.8]])
        a = unit([[0.3, -0.1, -1.0]])
        points = apply(Touches([[0.0, 0.0, 3.0]], n, a), self._map())
        write_points(tmp_path / "p.csv", points)
        written = read_csv_table(tmp_path / "p.csv").numbers("u_um")[0, 0]
        assert written == pytest.approx(1e3 * math.sqrt((n @ points.covariance[0] @ n.T).item()))

    def test_deviation_from_nominal_points_and_surfaces(self) -> None:
        n = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]])
        surface = np.array([[5.0, 5.0, 0.0], [0.0, 6.0, 8.0]])
        positions = surface + (3.0 - 0.012 + 0.005) * n
        touches = Touches(positions, n, nominal_points=surface)
        assert np.allclose(apply(touches, self._map()).deviation, 0.005, atol=1e-12)
        ball = apply(touches, self._map(), nominal=Sphere([0.0, 0.0, 0.0], 10.0)).deviation
        # The stem deflects 16 µm along the ball: the slide has an effect of 16² / (2 · 13 mm), 10
        # nm.
        assert ball[1] == pytest.approx(0.005, abs=2e-5)
        floor = apply(touches, self._map(), nominal=Plane([0, 0, 0], [0, 0, 1])).deviation
        assert floor[0] == pytest.approx(0.005, abs=1e-12)
        assert apply(Touches(positions, n), self._map()).deviation is None

    def test_outside_the_map(self) -> None:
        down = unit([[0.0, 0.5, -0.8]])
        with pytest.raises(ExtrapolationError, match="1 of 1 directions"):
            apply(Touches([[0.0, 0.0, 0.0]], down), self._map())
        apply(Touches([[0.0, 0.0, 0.0]], down), self._map(), extrapolate=True)
