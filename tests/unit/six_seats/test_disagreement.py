"""The difference of a six-seat probe from a harmonic map, from the two maps and least squares."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.maps.kinds.harmonic import fit_harmonic
from pretravel.maps.observation import Observation, Scatter
from pretravel.maps.provenance import QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.observe import observe
from pretravel.six_seats import physical
from pretravel.six_seats.physical import PhysicalMapFit
from pretravel.six_seats.six_seat_fit import SixSeatProblem
from pretravel.six_seats.uneven_seats import PARAMETERS
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.reference_touches import sphere_touches

CASES = ["sphere", "sphere, tip unknown", "ring"]


@cache
def _observed(case: str) -> Observation:
    """Five smooth lobes of 3 µm on a sphere, of 1.5 µm in a ring."""
    rng = np.random.default_rng(16)
    if case == "ring":
        azimuth = np.arange(24) * (np.pi / 12.0)
        outward = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
        value = 1e-3 * (9.0 + 1.5 * np.cos(5.0 * azimuth)) + 1e-4 * rng.standard_normal(24)
        touches = Touches(outward * (12.5 - 3.0 + value)[:, None], -outward)
        return observe(touches, QualificationSetup(25.0, 6.0, ring=True), np.eye(3))
    n = sphere_pattern_25()
    across, azimuth = np.hypot(n[:, 0], n[:, 1]), np.arctan2(n[:, 1], n[:, 0]) - 0.2
    value = 1e-3 * (1.5 + 7.5 * across**2 + 3.0 * across**5 * np.cos(5.0 * azimuth))
    value += 3e-4 * rng.standard_normal(25)
    tip = None if case == "sphere, tip unknown" else 6.0
    return observe(sphere_touches(value), QualificationSetup(25.0, tip), np.eye(3))


@cache
def _six_seats(case: str) -> PhysicalMapFit:
    """The fit before it is compared with a harmonic map; from one orientation, which is quick."""
    starts = physical.oriented_starts
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(physical, "oriented_starts", lambda *given: starts(*given)[:1])
        patch.setattr(physical, "_with_disagreement", lambda fit, _: fit)
        return physical.fit_physical(_observed(case), Scatter(0.0, 0.0))


def _compared(case: str) -> tuple[float, float, float]:
    """Mean square difference; mean variances of the six-seat and of the harmonic map."""
    observation = _observed(case)
    if case == "ring":
        azimuth = np.arange(180) * (np.pi / 90.0)
        n = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
        free = [n[:, 0], n[:, 1]]
    else:
        touched = observation.group_directions
        spread = fibonacci_cap(300, float(np.arccos(touched[:, 2].min())))
        n = np.concatenate([touched, spread[DirectionSupport(touched).supports(spread)]])
        free = list(n.T)
    if not observation.tip_known:
        free.append(np.ones(len(n)))
    apart, variances = np.zeros(len(n)), []
    for fit, sign in ((_six_seats(case), 1.0), (fit_harmonic(observation), -1.0)):
        design = fit.basis.design(n)
        covariance = fit.covariance.matrix
        variances.append(float(np.mean([row @ covariance @ row for row in design])))
        apart += sign * fit.basis.value(n, fit.coefficients)
    columns = np.stack(free, axis=1)
    apart -= columns @ np.linalg.solve(columns.T @ columns, columns.T @ apart)
    return float(np.mean(apart**2)), *variances


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("beside", "said"), [(0.99, True), (1.01, False)])
def test_is_stated_from_one_and_a_half_variances(case: str, beside: float, said: bool) -> None:
    """The six-seat map's covariance is made as large as the limit leaves, less or more 1 %."""
    square, own, other = _compared(case)
    fit, problem = _six_seats(case), SixSeatProblem(_observed(case))
    factor = (beside * square / 1.5 - other) / own
    assert factor > 0.0
    fit = replace(fit, covariance=Covariance.full(factor * fit.covariance.matrix))
    found = physical._with_disagreement(fit, problem)
    if not said:
        assert found is fit
        return
    assert found.disagreement == pytest.approx(np.sqrt(square), rel=1e-9)
    # The correction has it, shared over its harmonics as before the touches: the larger the
    # degree, the less, and in sum all of it.
    added = found.covariance.matrix - fit.covariance.matrix
    first = 5 + len(PARAMETERS)
    own_part = np.diag(added)[first:]
    assert added == pytest.approx(np.diag(np.diag(added)), abs=1e-9 * square)
    assert np.all(added[:first] == 0.0)
    assert own_part.sum() == pytest.approx(square, rel=1e-6)
    assert own_part == pytest.approx(square * problem.correction_shares(), rel=1e-4)
