"""Positions in coarse steps: what they hide is in U, refused or said by name."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, five_point_pattern, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.measurement.compensation import apply
from pretravel.qualification.qualification import Qualification
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.verification import verify
from pretravel.tasks.qualify.summary import judgement, summary_figures
from pretravel.touches import Touches
from pretravel.touches.quantisation import quantisation_step

PLACE = np.array([212.34471, -87.91233, -301.45612])
BETWEEN = fibonacci_cap(200)


def _touched(normals: np.ndarray, step: float, rng: np.random.Generator, turn: float) -> Touches:
    """A probe with three lobes of 4 µm, between highest and lowest, and 0.3 µm of noise."""
    azimuth = np.arctan2(normals[:, 1], normals[:, 0])
    across = np.hypot(normals[:, 0], normals[:, 1])
    lobes = 2e-3 * across**3 * np.cos(3.0 * (azimuth - turn))
    pretravel = 2e-3 + 8e-3 * across**2 + lobes + rng.normal(0.0, 3e-4, len(normals))
    positions = PLACE + normals * (15.5 - pretravel)[:, None]
    return Touches(step * np.round(positions / step), normals)


def _qualified(normals: np.ndarray, step: float, seed: int = 1) -> tuple[Qualification, float]:
    """A qualification, and the share of points on the sphere within U = 2 u."""
    rng = np.random.default_rng([51, seed])
    turn = rng.uniform(0.0, 2.0)
    touches = _touched(normals, step, rng, turn)
    made = qualify(touches, 25.0, tip_diameter=6.0, kind="harmonic")
    points = apply(_touched(BETWEEN, step, rng, turn), made.pretravel_map, extrapolate=True)
    away = np.sum((points.positions - made.center) * BETWEEN, axis=1) - 12.5
    return made, float(np.mean(np.abs(away) <= 2.0 * points.standard_uncertainty))


@pytest.mark.parametrize("seed", range(6))
def test_one_residual_of_five_touches_is_no_scale(seed: int) -> None:
    """In steps of 1 µm it is often zero: U was 0.6 µm for lobes of 4 µm."""
    _, covered = _qualified(five_point_pattern(), 0.001, seed)
    assert covered >= 0.9


def test_a_step_of_ten_micrometres_is_in_u_and_said() -> None:
    made, covered = _qualified(np.repeat(sphere_pattern_25(), 3, axis=0), 0.01)
    assert covered >= 0.93
    assert made.effects.step == pytest.approx(0.01)
    assert any("in steps of 10 µm" in warning for warning in made.warnings)
    assert judgement(made).level != "good"
    # Not the scatter of the probe, which nobody sees.
    assert "with more digits" in str(summary_figures(made, (), True)[-1].value)


@pytest.mark.parametrize("step", [0.0254, 0.1])
@pytest.mark.parametrize("normals", [five_point_pattern(), sphere_pattern_25()])
def test_a_step_larger_than_pretravel_is_refused(normals: np.ndarray, step: float) -> None:
    with pytest.raises(PretravelError, match="the positions are in steps of"):
        _qualified(np.repeat(normals, 3, axis=0), step)


def test_equal_repeats_are_verified() -> None:
    """Their scatter is below the digits: the eigenvalues of a covariance were not finite."""
    made, _ = _qualified(sphere_pattern_25(), 1e-6)
    once = _touched(five_point_pattern(), 1e-6, np.random.default_rng(3), 0.1)
    equal = Touches(np.repeat(once.positions, 3, axis=0), np.repeat(once.normals, 3, axis=0))
    assert np.isfinite(verify(equal, made.pretravel_map, 25.0).largest)


@pytest.mark.parametrize("decimals", [3, 4, 5])
def test_inches_are_seen_in_millimetres_of_few_decimals(decimals: int) -> None:
    """0.001 inch converted and printed with three decimals is no step of 0.001 mm."""
    touched = _touched(sphere_pattern_25(), 1e-9, np.random.default_rng(51), 0.0).positions
    inches = np.round(0.0254 * np.round(touched / 0.0254), decimals)
    assert quantisation_step(inches) == pytest.approx(0.0254)
    assert quantisation_step(np.round(touched, decimals)) == pytest.approx(10.0**-decimals)
