"""Nine touches and an old map are as good as 75 fresh touches.

Probes and their drift are those of the simulator in `benchmarks`, which does not use the package.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.few_touches import one_set, point_error


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["physical", "harmonic"])
def test_few_touches_with_prior(kind: str) -> None:
    """The first 15 of the sets that `docs/qualification.md` tabulates."""
    sets = [one_set(number, kind, (5, 9)) for number in range(15)]
    fresh = point_error(sets, "75 without")
    assert point_error(sets, "9 with prior") < 1.15 * fresh
    assert point_error(sets, "5 with prior") < 1.25 * fresh
    if kind == "physical":  # u of a harmonic map does not contain the centre
        chi_squared = np.mean([one["9 with prior"].chi_squared for one in sets])
        assert 0.7 < chi_squared < 1.4
