"""Maps in the form of tables of sectors."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.controls.macro_b import renishaw_variables
from pretravel.maps.kinds.sectors import SECTOR_NAMES
from pretravel.maps.sector_tables import resampled_sectors, touched_sectors
from tests.support.example_maps import example_map, lobes


class TestSectors:
    def test_touched_at_their_angles(self) -> None:
        table = touched_sectors(lobes(3))
        expected = {name: 10.0 + np.cos(3 * float(name) * DEGREE) for name in SECTOR_NAMES[2:]}
        assert table.pretravel[2:] == pytest.approx(list(expected.values()))
        # Opposite directions share a radius, and three lobes have opposite signs there: mean zero.
        assert table.pretravel[:2] == pytest.approx([10.0, 10.0])
        assert table.largest == pytest.approx(1.0)

    def test_resampled_is_the_best_there_is(self) -> None:
        """No other radii have a smaller residual, by an optimiser that uses only the residual."""
        from scipy.optimize import linprog

        from pretravel.maps.kinds.sectors import SectorBasis

        pretravel_map = example_map()
        found = resampled_sectors(pretravel_map)
        azimuth = np.arange(0.0, 360.0, 0.5) * DEGREE
        design = SectorBasis().design(from_angles(np.pi / 2, azimuth))
        truth = pretravel_map.pretravel(from_angles(np.pi / 2, azimuth))
        # At ties either sector may be taken: the bound must hold for both.
        i, j = np.nonzero(design)
        a = np.zeros((2 * len(i), 11))
        a[np.arange(len(i)), j], a[len(i) + np.arange(len(i)), j] = 1.0, -1.0
        a[:, 10] = -1.0
        b = np.concatenate([truth[i], -truth[i]])
        best = linprog([0.0] * 10 + [1.0], A_ub=a, b_ub=b, bounds=[(None, None)] * 11)
        assert found.largest == pytest.approx(best.fun, abs=1e-9)
        assert found.largest < touched_sectors(pretravel_map).largest
        assert resampled_sectors(pretravel_map, "rms").rms < found.rms

    def test_within_a_sector_071_of_a_lobe_is_left(self) -> None:
        """15° from the centre of a sector, the phase of three lobes has changed by 45°."""
        pretravel_map = lobes(3, phase=90 * DEGREE)
        table = touched_sectors(pretravel_map)
        azimuth = np.concatenate([float(n) + np.arange(-15, 16) for n in SECTOR_NAMES[2:]])
        around = from_angles(np.pi / 2, azimuth * DEGREE)
        value = np.repeat(table.pretravel[2:], 31)
        left = np.max(np.abs(pretravel_map.pretravel(around) - value))
        assert left == pytest.approx(np.sin(45 * DEGREE), abs=1e-9)
        # If opposite directions share one radius, the residual can be a whole lobe.
        assert table.largest == pytest.approx(1.0)

    def test_rms_of_three_lobes_in_closed_form(self) -> None:
        """Of 1 + cos 3a over sectors of 30°: beside a zero of the lobes (the sectors of 30°, 150°,
        210°, 330° and both of Y) the mean square is 1/2 - 1/pi. Both sectors of X share their mean,
        zero, and have 1/2 + 1/pi. At the other four summits a touched value is the summit, whose
        difference has the mean square 3/2 + 1/pi - 4 sqrt(2)/pi; the mean of a sector,
        4 sin 45°/pi, leaves 1/2 + 1/pi - 8/pi². Samples of 0.5° have an error of 5e-5.
        """
        zeros, shared = 6.0 * (0.5 - 1.0 / np.pi), 2.0 * (0.5 + 1.0 / np.pi)
        for table, at_summit in (
            (touched_sectors(lobes(3)), 1.5 + 1.0 / np.pi - 4.0 * np.sqrt(2.0) / np.pi),
            (resampled_sectors(lobes(3), "rms"), 0.5 + 1.0 / np.pi - 8.0 / np.pi**2),
        ):
            mean_square = (zeros + shared + 4.0 * at_summit) / 12.0
            assert table.rms == pytest.approx(np.sqrt(mean_square), rel=2e-4)

    def test_variables_in_the_order_of_the_control(self) -> None:
        text = renishaw_variables(lobes(3))
        values = {int(n): float(v) for n, v in re.findall(r"^#(\d+)=([\d.]+)", text, re.M)}
        assert sorted(values) == [500, 501, *range(510, 518)]
        # The effective radius is largest where the pretravel is smallest.
        assert values[511] > values[510]  # 60°: cos 180°; 30°: cos 90°
        assert 502 not in values
        assert 503 not in values

    def test_tables_are_in_the_machine_s_axes(self) -> None:
        """With the probe rotated by 30°, its sector at 30° is now at 60°."""
        turned = renishaw_variables(lobes(3, rotation=probe_rotation(rotation=30 * DEGREE)))
        straight = renishaw_variables(lobes(3))
        of = [dict(re.findall(r"^#(\d+)=([\d.]+)", t, re.M)) for t in (turned, straight)]
        assert of[0]["511"] == of[1]["510"]
