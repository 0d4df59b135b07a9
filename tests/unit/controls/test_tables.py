"""Tables and macros of controls."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pretravel.controls.heidenhain import heidenhain_table
from pretravel.controls.lookup_table import lookup_table
from pretravel.controls.macro_b import fanuc_macro
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from tests.support.example_maps import lobes


class TestHeidenhain:
    def test_default_template_says_that_it_is_unverified(self) -> None:
        text = heidenhain_table(lobes(3))
        assert "UNVERIFIED" in text.splitlines()[0]
        last = text.splitlines()[-1].split()
        assert float(last[1]) == 90.0
        assert float(last[2]) == pytest.approx(-10.0, abs=1e-6)  # the mean over the azimuth

    def test_a_tilted_probe_has_its_own_angles(self) -> None:
        """Angles are measured from the axis of the probe, in every orientation of the probe."""
        tilted = lobes(3, rotation=probe_rotation((np.sin(0.5), 0.0, np.cos(0.5)), 0.3))
        assert heidenhain_table(tilted) == heidenhain_table(lobes(3))

    def test_own_template_and_azimuth(self) -> None:
        text = heidenhain_table(
            lobes(3), "A;B\n{angle_deg:.1f};{deviation_mm:.3f}\n", azimuth=0.0, step_deg=30.0
        )
        assert text.splitlines() == ["A;B", "0.0;-10.000", "30.0;-10.125", "60.0;-10.650",
                                     "90.0;-11.000"]  # fmt: skip

    @pytest.mark.parametrize(
        ("template", "words"),
        [("{angel_deg}\n", "line 1: 'angel_deg'"), ("hello\n", "no line with"), ("{\n", "line 1")],
    )
    def test_templates_refused(self, template: str, words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            heidenhain_table(lobes(3), template)


class TestDelayTravel:
    def test_in_every_table_a_later_trigger(self) -> None:
        """With 10 µm more travel, pretravel grows and radii and deviations shrink by 10 µm."""
        pretravel_map = lobes(3)
        slow, fast = (heidenhain_table(pretravel_map, travel=t).splitlines()[-1].split()[2]
                      for t in (0.0, 0.01))  # fmt: skip
        assert float(fast) - float(slow) == pytest.approx(-0.01, abs=2e-5)
        table = lookup_table(pretravel_map, tolerance=1e-3, most_values=400)
        first = [
            float(
                re.search(r"^#500=([\d.]+)", fanuc_macro(pretravel_map, table, travel=t), re.M)[1]
            )  # type: ignore[index]
            for t in (0.0, 0.01)
        ]
        assert first[1] - first[0] == pytest.approx(0.01, abs=2e-7)
