"""Compensated points and their covariances, against Monte Carlo and by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.compensation.compensation import apply, compensation_warnings
from pretravel.directions import fibonacci_cap, unit
from pretravel.errors import ExtrapolationError
from pretravel.formats.csv_table import read_csv_table
from pretravel.formats.point_files import write_points
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.surface.shapes import Plane, Sphere
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance


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
            warnings = compensation_warnings(touches, apply(touches, pretravel_map), pretravel_map)
            assert any("off the normal" in warning for warning in warnings) == expected

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
