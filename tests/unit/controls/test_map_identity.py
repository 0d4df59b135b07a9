"""The number of a map on a control, and the program that it must belong to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.controls.map_identity import check_map_of_program, map_identity
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import mean_map


def test_tips_and_feeds_that_are_the_same() -> None:
    """A diameter within 0.18 mm, feeds within 2 %, where the map does not contain the delay."""
    made = replace(mean_map(0.01), feed=50.0)
    check_map_of_program(made, 3.0899, np.array([50.0, 51.0, 49.0]))
    check_map_of_program(made, 2.9101, np.array([50.0]))
    for radius in (3.091, 2.909):
        with pytest.raises(PretravelError, match=r"tip of 6\.000 mm diameter"):
            check_map_of_program(made, radius, np.array([50.0]))
    for feed in (51.1, 48.9):
        with pytest.raises(PretravelError, match=f"but the program measures at {feed}"):
            check_map_of_program(made, 3.0, np.array([50.0, feed]))
    check_map_of_program(replace(made, feed=None), 3.0, np.array([80.0]))
    check_map_of_program(replace(made, delay=1e-3), 3.0, np.array([80.0]))


def test_every_part_of_a_map_makes_another_number() -> None:
    """Of nine digits; what a control does not use makes none."""
    made = replace(
        mean_map(0.01), basis=HarmonicBasis(np.array([[0, 0], [3, 3]])),
        coefficients=np.array([0.01, 0.002]), covariance=Covariance.none(2),
    )  # fmt: skip
    wozniak = replace(
        mean_map(0.01), basis=WozniakBasis(0.3), coefficients=np.array([0.008, 0.0, 0.001]),
        covariance=Covariance.none(3),
    )  # fmt: skip
    others = [
        made, replace(made, coefficients=np.array([0.01, 0.0021])),
        replace(made, rotation=probe_rotation(rotation=0.1)),
        replace(made, basis=HarmonicBasis(np.array([[0, 0], [3, -3]]))),
        wozniak, replace(wozniak, basis=WozniakBasis(0.31)),
        replace(wozniak, basis=WozniakBasis(0.3, "piezo")),
        *(replace(made, tip_radius=2.0 + i) for i in range(9) if i != 1),
        # Without a feed or a delay it is another one than with.
        *(replace(made, feed=feed, delay=0.0) for feed in (None, 0.0, 1e-3, 1.0)),
        *(replace(made, feed=60.0, delay=delay) for delay in (None, 0.0, 1e-3)),
    ]  # fmt: skip
    numbers = [map_identity(other).number for other in others]
    assert len(set(numbers)) == len(others)
    assert all(100_000_000 <= number < 1_000_000_000 for number in numbers)
    same = replace(made, repeatability=1e-4, u_tip_radius=1e-4)
    assert map_identity(same).number == numbers[0]
    assert map_identity(made).text == f"number {numbers[0]}, tip radius 3.0000 mm"
    text = map_identity(replace(made, feed=60.0)).text
    assert text.endswith("tip radius 3.0000 mm, at 60 mm per min")
