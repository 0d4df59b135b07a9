"""The slide of a compensated touch, against the contact model that simulates touches."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.measurement.compensation import apply
from pretravel.measurement.contact_slide import contact_slide
from pretravel.prediction.described_map import described_map
from pretravel.probing.simulation import simulate_some
from pretravel.probing.targets import Targets
from pretravel.surface.shapes import Plane


@pytest.mark.parametrize("polar", [5.0, 40.0, 75.0])
@pytest.mark.parametrize("tilt", [0.0, 20.0])
def test_slide_on_a_plane_is_that_of_the_simulated_touch(polar: float, tilt: float) -> None:
    """The simulation solves the contact; on a plane without friction both are exact."""
    normal = from_angles(np.radians(polar), np.radians(25.0))[0]
    approach = -from_angles(np.radians(polar + tilt), np.radians(25.0))[0]
    made = described_map("omp40-2", "analytic")
    targets = Targets([[0.0, 0.0, 0.0]], [normal], [approach])
    simulated = simulate_some(made, Plane([0.0, 0.0, 0.0], normal), targets)
    assert simulated.touches is not None
    points = apply(simulated.touches, made, extrapolate=True)
    slide = contact_slide(simulated.touches, points, made)[0]
    assert slide @ normal == pytest.approx(0.0, abs=1e-9)
    # The map's iteration of the contact ends below a nanometre.
    expected = simulated.outcomes.slide[0]
    assert np.linalg.norm(slide) == pytest.approx(expected, abs=2e-6)
    if tilt:
        assert expected > 1e-4
