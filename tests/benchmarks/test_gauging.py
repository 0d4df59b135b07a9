"""The simulated shop: what is corrected with the map conforms, with the tip radius it does not."""

from __future__ import annotations

import numpy as np

from benchmarks.gauging import TOLERANCE, shop


def test_the_map_decides_whether_a_correction_is_right() -> None:
    found = shop(6)
    # The simulated pretravel is 9 µm and more: twice of it goes into the diameter.
    assert np.all(np.abs(found.map_) < TOLERANCE)
    assert np.all(np.abs(found.tip_radius) > TOLERANCE)
