"""From touches of a sphere to features of a part: the stated uncertainties contain the truth."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.measurement.compensation import apply
from pretravel.qualification.qualifying import qualify
from pretravel.touches import Touches
from tests.support.feature_points import features
from tests.support.made_up_probes import NOISE, PATTERN, made_up_response, touches_of

TRUTH = {"bore": 20.0, "boss": 20.0, "cylinder": 20.0, "sphere": 25.0}
U_DIAMETER = 2e-4


@pytest.mark.long
@pytest.mark.parametrize("probes", [3, pytest.param(16, marks=pytest.mark.slow)])
def test_errors_of_features_have_the_stated_size(probes: int) -> None:
    """Other probe, other sphere within its certificate and other noise in each run.

    Errors in units of u have a root mean square of 1; that of n runs scatters by 1/√(2n). Two and
    a half of that for every feature, and the mean uncompensated error for comparison.
    """
    allowed = 2.5 / np.sqrt(2.0 * probes)
    scores: dict[str, list[float]] = {name: [] for name in (*TRUTH, "x")}
    uncompensated = []
    for seed in range(probes):
        rng = np.random.default_rng(seed)
        response = made_up_response(rng, 0.0)
        pretravel_map = qualify(
            touches_of(response, PATTERN, rng), 25.0 + U_DIAMETER * rng.normal(),
            tip_diameter=6.0, u_diameter=U_DIAMETER, kind="physical", search_outliers=False,
        ).pretravel_map  # fmt: skip
        for name, truth in TRUTH.items():
            positions, normals = features(12)[name]
            distance = 3.0 - response.pretravel(normals) + rng.normal(0.0, NOISE, len(normals))
            touches = Touches(positions + normals * distance[:, None], normals)
            found = measure_feature(apply(touches, pretravel_map), name)
            size = found.quantity("diameter")
            scores[name].append((size.value - truth) / size.u)
            assert size.uncompensated is not None
            uncompensated.append(abs(size.uncompensated - truth) / size.u)
        x = found.quantity("x")
        scores["x"].append(x.value / x.u)
    for name, values in scores.items():
        assert abs(np.sqrt(np.mean(np.square(values))) - 1.0) < allowed, name
    # Pretravel of 5 to 50 µm, twice, against u of a third of a micrometre.
    assert np.median(uncompensated) > 15.0
