"""Residuals of bores that follow the pretravel, in closed form: lobes of three rods."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.measurement.pretravel_left import PretravelLeft

AZIMUTH = np.arange(16) * np.pi / 8.0
CIRCLE = np.column_stack([np.ones(16), np.cos(AZIMUTH), np.sin(AZIMUTH)])
LOBES = np.cos(3.0 * AZIMUTH)
NOISE = 3e-4 * np.random.default_rng(1).standard_normal(16)


@pytest.mark.parametrize(
    ("left", "said"),
    [
        (0.0 * LOBES, ""),
        (2.0 * LOBES, "(+2.03 times, 5.1 µm"),  # turned by 60° or 180°
        (LOBES - np.cos(3.0 * AZIMUTH + np.pi / 2), ""),  # by 30°: half of the residuals are others
        (1.0 * LOBES, "(+1.03 times, 2.6 µm"),  # no lobes in the touches
        (-0.6 * LOBES, "stylus longer"),  # it yields 1.6 times as much
        (0.2 * LOBES, ""),  # errors of a map
        (6.0 * LOBES, ""),  # of a part: no map leaves so much
        (2.0 * np.cos(2.0 * AZIMUTH), ""),  # an oval part
    ],
)
def test_what_the_residuals_show_of_the_map(left: np.ndarray, said: str) -> None:
    """Lobes of 3.2 µm, of which the circle takes nothing; rms is over its 13 degrees of freedom."""
    pretravel = 0.010 + 3.2e-3 * LOBES
    found = PretravelLeft.of(3.2e-3 * left + NOISE, pretravel, CIRCLE)
    assert (said in found.sentence()) if said else found.sentence() == ""


def test_features_too_small_alone_show_it_together() -> None:
    """Six touches leave three degrees of freedom; at every 60° their lobes are ±1."""
    six = AZIMUTH[:6] * 8.0 / 3.0
    circle, lobes = CIRCLE[:6].copy(), 3e-3 * np.cos(3.0 * six)
    circle[:, 1:] = np.column_stack([np.cos(six), np.sin(six)])
    alone = PretravelLeft.of(2.0 * lobes + NOISE[:6], lobes, circle)
    assert alone.sentence() == ""
    assert alone.joined(alone).sentence()


def test_a_plane_shows_no_map() -> None:
    flat = PretravelLeft.of(5e-3 * LOBES, np.full(16, 0.010), np.ones((16, 1)))
    assert flat == PretravelLeft()


def test_errors_of_the_map_are_in_u() -> None:
    """A map of few directions can be wrong by its lobes."""
    lobes = 3.2e-3 * LOBES
    assert PretravelLeft.of(lobes, lobes, CIRCLE, 0.1 * lobes[None]).sentence()
    assert PretravelLeft.of(lobes, lobes, CIRCLE, 0.5 * lobes[None]).sentence() == ""
