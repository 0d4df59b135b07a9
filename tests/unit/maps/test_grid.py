"""Maps as grids of angles and as tables of effective radii."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.frames import probe_rotation
from pretravel.maps.grid import effective_radius_table, map_grid
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import mean_map


def test_steps_that_are_not_stated() -> None:
    found = map_grid(mean_map(0.01))
    assert found["polar_deg"] == pytest.approx(np.arange(0.0, 91.0, 5.0))
    assert found["azimuth_deg"] == pytest.approx(np.arange(0.0, 360.0, 10.0))
    assert found["pretravel_um"].shape == found["u_um"].shape == (19, 36)


@pytest.mark.parametrize(
    ("largest", "last"),
    [
        (59.985, 59.985),
        (59.995, 60.0),
        (60.005, 60.0),
        (60.015, 60.015),
        (164.0, 164.0),
        (168.0, 165.0),
    ],
)
def test_the_last_row(largest: float, last: float) -> None:
    """A hundredth of a degree more is no row of its own; below 165° no table goes."""
    polar = np.radians([*np.arange(0.0, largest, 30.0), largest])
    support = DirectionSupport(from_angles(polar, np.zeros(len(polar))))
    rows = map_grid(replace(mean_map(0.01), support=support), 30.0, 90.0)["polar_deg"]
    assert rows[-1] == pytest.approx(last)
    assert np.diff(rows).min() > 1e-3


@pytest.mark.parametrize("largest", [89.985, 90.04])
def test_a_table_for_people_has_the_row_of_the_equator(largest: float) -> None:
    """A fitted centre that is 4 µm lower moves touches of the equator to 89.985°."""
    polar = np.radians(np.repeat([5.0, 45.0, largest], 8))
    support = DirectionSupport(from_angles(polar, np.tile(np.arange(8.0) * np.pi / 4.0, 3)))
    table = effective_radius_table(replace(mean_map(0.01), support=support))
    assert np.max(table["polar_deg"]) == 90.0
    assert np.sum(np.equal(table["polar_deg"], 90.0)) == 36


def test_values_belong_to_their_angles() -> None:
    """n_x of the harmonic (1, 1) over sqrt(3), in the frame of the probe."""
    made = replace(
        mean_map(0.01), basis=HarmonicBasis(np.array([[0, 0], [1, 1]])),
        coefficients=np.array([0.010, 0.002 / math.sqrt(3.0)]),
        covariance=Covariance.full(np.diag([0.0, 1e-8 / 3.0])),
        rotation=probe_rotation((0.6, 0.0, 0.8), 0.3),
    )  # fmt: skip
    found = map_grid(made, 45.0, 120.0)
    polar = np.radians([0.0, 45.0, 90.0])[:, None]
    x = np.sin(polar) * np.cos(np.radians([0.0, 120.0, 240.0]))
    assert found["pretravel_um"] == pytest.approx(10.0 + 2.0 * x, abs=1e-9)
    assert found["u_um"] == pytest.approx(0.1 * np.abs(x), abs=1e-9)
    table = {name: np.asarray(v) for name, v in effective_radius_table(made).items()}
    row = np.flatnonzero((table["polar_deg"] == 90.0) & (table["azimuth_deg"] == 120.0))
    assert table["pretravel_um"][row] == pytest.approx([9.0])
    assert table["effective_radius_mm"][row] == pytest.approx([2.991])
    assert table["u_um"][row] == pytest.approx([0.05])


def test_only_what_is_supported_has_a_value() -> None:
    """An arc of 57° at 93°: the margin of 5° contains 90°, and azimuths of 60°."""
    arc = DirectionSupport(from_angles(np.radians([93.0] * 3), np.array([0.0, 0.5, 1.0])))
    part = replace(
        mean_map(0.01, tip_radius=2.0), covariance=Covariance.independent([4e-8]), support=arc
    )
    grid = map_grid(part, 90.0, 30.0)
    assert grid["polar_deg"] == pytest.approx([0.0, 90.0, 93.0])
    held = [[False] * 12, *[[True, True, True, *[False] * 9]] * 2]
    assert np.isfinite(grid["pretravel_um"]).tolist() == held
    assert np.isfinite(grid["u_um"]).tolist() == held
    for travel in (0.0, 0.005):
        table = {k: np.asarray(v) for k, v in effective_radius_table(part, travel).items()}
        assert table["polar_deg"] == pytest.approx(np.repeat([90.0, 93.0], 7))
        assert table["azimuth_deg"] == pytest.approx(np.tile(np.arange(7) * 10.0, 2))
        assert table["pretravel_um"] == pytest.approx(np.full(14, 10.0 + 1e3 * travel))
        assert table["effective_radius_mm"] == pytest.approx(np.full(14, 1.99 - travel))
        assert table["u_um"] == pytest.approx(np.full(14, 0.2))
