"""Maps of described probes."""

from __future__ import annotations

from pretravel.prediction.described_map import described_map


def test_another_tip_than_the_description_s() -> None:
    """A ball of 5 mm has a radius of 2.5 mm; the description's has 3 mm."""
    assert described_map("omp40-2", tip_diameter=5.0).tip_radius == 2.5
    assert described_map("omp40-2").tip_radius == 3.0
