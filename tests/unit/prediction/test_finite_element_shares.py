"""The shares of a finite-element probe whose body is rigid, by hand: only its seats give."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.prediction.compliance.fem import FiniteElements
from pretravel.prediction.description import Probe
from pretravel.prediction.fem.condensation import ElasticField, ReducedModel
from pretravel.prediction.fem.interface_loads import INTERFACE
from pretravel.prediction.predict import predict
from pretravel.prediction.seats import seat_statics

UP = np.array([[0.0, 0.0, 1.0]])
FORCE, SINE = 5.91, math.sin(math.radians(27.266))
"""The preload opens all six seats of an OMP40-2 at once; half of the angle between its balls."""


def _no_field() -> ElasticField:
    raise AssertionError("shares need no field")


def rigid(probe: Probe, *, patch: float = 0.0, ball: float = 0.0) -> FiniteElements:
    """Loads on the interface have resultants, and move nothing. [mm/N]"""
    statics, size = seat_statics(probe), len(INTERFACE)
    resultants = np.zeros((6, size))
    resultants[:, :9] = np.concatenate([statics.wrenches, statics.tip_wrenches], axis=1)
    still = np.zeros((size, size))
    reduced = ReducedModel(
        flexibility=still,
        flexibility_by_region={"rods": still, "stylus 1": still, "stylus 2": still},
        resultants=resultants,
        patch_compliance=patch,
        ball_correction=ball,
        seat_part="rods",
        summary={},
        load_field=_no_field,
    )
    return FiniteElements(reduced)


def test_the_half_space_under_the_patches_is_taken_off(omp40: Probe) -> None:
    """Each seat loses N = F / (6 sin): the tripod follows by p N / sin."""
    shares = predict(omp40, UP, rigid(omp40, patch=1e-4)).shares
    assert shares["rods"][0] == pytest.approx(-1e-4 * FORCE / (6.0 * SINE**2), rel=1e-9)
    assert shares["stylus"][0] == 0.0


def test_finite_balls_give_more_than_half_spaces(omp40: Probe) -> None:
    """Added to Hertz's approach, with the sign of a deflection."""
    hertz = predict(omp40, UP).shares["seats"][0]
    shares = predict(omp40, UP, rigid(omp40, ball=1e-4)).shares
    more = 1e-4 * FORCE / (6.0 * SINE**2)
    assert shares["seats"][0] == pytest.approx(hertz + more, rel=1e-9)
    assert shares["rods"][0] == 0.0


def test_parts_with_several_regions_are_one_share(omp40: Probe) -> None:
    assert set(predict(omp40, UP, rigid(omp40)).shares) == {
        "rods",
        "stylus",
        "seats",
        "tip_on_part",
    }
