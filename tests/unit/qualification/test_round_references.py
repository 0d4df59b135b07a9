"""Pins as rings, heights with a tilted axis, sizes that are not known."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.round_references import as_ring_touches, unknown_diameter, without_tilt
from pretravel.touches import Touches

PHI = np.radians(np.arange(0.0, 360.0, 15.0))
NORMALS = np.stack([np.cos(PHI), np.sin(PHI), np.zeros(len(PHI))], axis=1)
TILT = np.array([0.004, -0.002])
RADIUS, TIP_RADIUS = 12.5, 3.0


def _travel(normals: FloatArray) -> FloatArray:
    return np.asarray(0.012 + 0.004 * np.cos(3.0 * np.arctan2(normals[:, 1], normals[:, 0])))


def _touched(*, ring: bool, heights: tuple[float, ...] = (0.0,)) -> Touches:
    """A ring or pin whose axis is tilted by `TILT`, with 0.2 µm of noise."""
    rng = np.random.default_rng(3)
    rows = []
    for z in heights:
        noise = rng.normal(0.0, 0.2e-3, len(PHI))
        reach = (
            -(RADIUS - TIP_RADIUS + _travel(NORMALS))
            if ring
            else RADIUS + TIP_RADIUS - _travel(NORMALS)
        )
        rows.append(NORMALS * (reach + noise)[:, None] + np.append(TILT * z, z) + [30.0, 20.0, 5.0])
    return Touches(np.vstack(rows), np.tile(NORMALS, (len(heights), 1)))


@pytest.mark.parametrize("ring", [True, False])
@pytest.mark.parametrize("heights", [(0.0,), (0.0, 8.0, -4.0)])
def test_ring_and_pin_give_the_same_map(ring: bool, heights: tuple[float, ...]) -> None:
    """At one height or three. A tilt of 4 mrad over 12 mm would move the centre by 48 µm."""
    touches = without_tilt(_touched(ring=ring, heights=heights), ring=ring)
    if not ring:
        touches = as_ring_touches(touches, 2.0 * RADIUS)
    found = qualify(
        touches, 2.0 * RADIUS, tip_diameter=2.0 * TIP_RADIUS, ring=True, kind="harmonic"
    )
    between = np.radians(np.arange(7.5, 360.0, 15.0))
    normals = np.stack([np.cos(between), np.sin(between), 0.0 * between], axis=1)
    value, u = found.pretravel_map.pretravel_and_uncertainty(normals)
    assert np.abs(value - _travel(normals)).max() < 0.4e-3
    assert found.repeatability < 0.3e-3
    assert u.max() < 0.3e-3


@pytest.mark.parametrize("ring", [True, False])
def test_a_size_that_is_not_known(ring: bool) -> None:
    """It is that of no pretravel: off by twice the mean, 24 µm; half of u = 50 µm."""
    tip = 2.0 * TIP_RADIUS
    found = unknown_diameter(_touched(ring=True), tip, ring=True)
    assert found == pytest.approx(25.0 + 0.024, abs=0.5e-3)
    if not ring:
        outside = unknown_diameter(_touched(ring=False), 0.0, ring=True) - tip
        assert outside == pytest.approx(25.0 - 0.024, abs=0.5e-3)


def test_refused() -> None:
    touches = _touched(ring=False)
    with pytest.raises(PretravelError, match="does not point out of the pin"):
        as_ring_touches(_touched(ring=True), 25.0)
    with pytest.raises(PretravelError, match="at least 3 directions"):
        unknown_diameter(touches.take([0, 12]), 6.0, ring=True)
    with pytest.raises(PretravelError, match="is not a touch on an upright wall"):
        as_ring_touches(Touches(touches.positions, np.tile([0.0, 0.0, 1.0], (24, 1))), 25.0)


def test_few_touches_at_two_heights_stay() -> None:
    """Five touches show no tilt: a quick update of a map takes them as they are."""
    touches = _touched(ring=True, heights=(0.0, 8.0)).take([0, 9, 18, 30, 45])
    assert without_tilt(touches, ring=True) is touches
