"""Maps in the form of tables of sectors, against sectors that are found by the nearest angle."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles, ring_pattern
from pretravel.base.frames import probe_rotation
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.sectors import SECTOR_NAMES, SectorBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.sector_tables import (
    SectorTable,
    resampled_sectors,
    taken_opposite,
    touched_sectors,
)
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance

# One, two, three and five waves around the equator, none symmetric; turned in the machine.
MADE = PretravelMap(
    HarmonicBasis(np.array([[0, 0], [1, 1], [1, -1], [2, 2], [2, -2], [3, 3], [5, -5]])),
    np.array([10.0, 1.0, -0.4, 0.7, 0.3, -0.9, 0.5]), Covariance.none(7),
    DirectionSupport(ring_pattern(np.radians([0.0, 30.0, 60.0, 90.0]), 24)), tip_radius=30.0,
    rotation=probe_rotation(rotation=0.3),
)  # fmt: skip
AZIMUTH = np.arange(720) / 2.0
VALUES = MADE.pretravel(from_angles(0.5 * np.pi, np.radians(AZIMUTH)))
ANGLES = [[0.0, 180.0], [90.0, 270.0], *([float(name)] for name in SECTOR_NAMES[2:])]
_AWAY = np.stack(
    [np.abs((AZIMUTH[:, None] - own + 180.0) % 360.0 - 180.0).min(axis=1) for own in ANGLES], axis=1
)
_NEAREST = _AWAY.min(axis=1, keepdims=True) == _AWAY
SHARES = _NEAREST / _NEAREST.sum(axis=1, keepdims=True)
"""Of each azimuth in the sectors: halfway between two, a half each, (720, 10)."""


def test_shares_of_sectors() -> None:
    """Of the nearest angle, halfway a half each; within half a degree of the axis all alike."""
    design = SectorBasis().design
    assert np.array_equal(design(from_angles(0.5 * np.pi, np.radians(AZIMUTH))), SHARES)
    for azimuth, sector in ((0.0, 0), (90.0, 1)):
        near = design(from_angles(np.radians([0.0, 0.49, 0.51]), np.radians([azimuth] * 3)))
        assert near == pytest.approx(np.vstack([np.full((2, 10), 0.1), np.eye(10)[sector]]))


def _check(table: SectorTable, pretravel: FloatArray) -> None:
    """Values, and the residuals that they leave: the larger one where either sector may count."""
    assert table.pretravel == pytest.approx(pretravel, rel=1e-9)
    off = np.abs(pretravel - VALUES[:, None])
    assert table.largest == pytest.approx(off[SHARES > 0.0].max())
    assert table.rms == pytest.approx(np.sqrt(np.sum(SHARES * off**2, axis=1).mean()))
    assert not table.pretravel.flags.writeable


def test_touched_at_their_angles() -> None:
    """Also where a control takes them for those of the opposite directions."""
    expected = [np.mean([VALUES[round(2.0 * angle)] for angle in own]) for own in ANGLES]
    table = touched_sectors(MADE)
    _check(table, np.array(expected))
    opposite = [own if len(own) == 2 else [(own[0] + 180.0) % 360.0] for own in ANGLES]
    swapped = np.array([expected[ANGLES.index(own)] for own in opposite])
    assert taken_opposite(table.pretravel) == pytest.approx(swapped)
    _check(table.misread(MADE), swapped)


@pytest.mark.parametrize("criterion", ["max", "rms"])
def test_resampled(criterion: str) -> None:
    """The middle of the range, or the mean: no other values have a smaller residual."""
    own = [(VALUES[share > 0.0], share[share > 0.0]) for share in SHARES.T]
    middle = [0.5 * (value.min() + value.max()) for value, _ in own]
    mean = [np.average(value, weights=share) for value, share in own]
    _check(resampled_sectors(MADE, criterion), np.array(middle if criterion == "max" else mean))
    if criterion == "max":
        assert resampled_sectors(MADE).largest == resampled_sectors(MADE, "max").largest
