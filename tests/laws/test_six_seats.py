"""The six-seat probe of a few numbers agrees with the described probe.

Forces, deflections and asymmetry are compared.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.directions import fibonacci_cap
from pretravel.errors import PretravelError
from pretravel.probe.catalogue import load_probe
from pretravel.probe.description import Probe
from pretravel.trigger.response import ProbeResponse, probe_response
from pretravel.trigger.seats import seat_statics
from pretravel.trigger.six_seat_basis import SixSeatBasis
from pretravel.trigger.six_seat_slopes import six_seat_pretravel
from pretravel.trigger.six_seats import PARAMETERS, six_seat_response, six_seats

CAP = fibonacci_cap(200, np.radians(88.0))
PROBE = load_probe("omp40-2-100mm")


def _numbers(probe: Probe, response: ProbeResponse, **asymmetry: float) -> np.ndarray:
    """The numbers of a described probe, computed by hand from their definitions."""
    ratio = probe.lever / probe.tripod.radius
    lateral = probe.preload / ratio
    at_rest = probe.preload / (6.0 * np.sin(probe.seats.support_angle))
    named = {
        "lever_ratio": ratio,
        "support_angle": probe.seats.support_angle,
        "rod_azimuth": probe.tripod.rod_azimuths[0],
        "lateral_deflection": response.compliance[0, 0] * lateral,
        "seat_indentation": response.seat_coefficient * at_rest ** (2 / 3),
        "axial_ratio": response.compliance[2, 2] / response.compliance[0, 0],
        "tip_approach": response.tip_coefficient * lateral ** (2 / 3),
    } | asymmetry
    values = [named.get(p.name, 0.0) for p in PARAMETERS]
    return np.array(
        [np.log(v) if p.logarithmic else v for p, v in zip(PARAMETERS, values, strict=True)]
    )


def test_an_ideal_probe() -> None:
    probe = replace(
        PROBE, tripod=replace(PROBE.tripod, rod_azimuths=tuple(np.radians([17.0, 137.0, 257.0])))
    )
    described = probe_response(probe)
    fitted = six_seat_response(_numbers(probe, described), probe.tip.radius)
    assert fitted.pretravel(CAP) == pytest.approx(described.pretravel(CAP), rel=1e-12)
    force = fitted.force(CAP)[0] * probe.preload
    assert force == pytest.approx(described.force(CAP)[0], rel=1e-12)
    moved = fitted.deflection(CAP, fitted.force(CAP)[0])
    assert moved == pytest.approx(described.deflection(CAP, described.force(CAP)[0]), abs=1e-14)


def test_a_spring_beside_the_axis() -> None:
    """Its moment about the centre of the tripod, applied to the described seats by hand."""
    described = probe_response(PROBE)
    x, y = 0.03, -0.02
    radius, preload = PROBE.tripod.radius, PROBE.preload
    moment = np.cross([x * radius, y * radius, 0.0], [0.0, 0.0, -preload])
    added = -np.linalg.solve(seat_statics(PROBE).wrenches, np.concatenate([np.zeros(3), moment]))
    shifted = replace(described, rest_reactions=described.rest_reactions + added)
    fitted = six_seat_response(_numbers(PROBE, described, spring_x=x, spring_y=y), PROBE.tip.radius)
    # By definition, the law of the seats is that of the ideal probe at rest.
    assert fitted.pretravel(CAP) == pytest.approx(shifted.pretravel(CAP), rel=1e-12)


def test_rods_out_of_their_places() -> None:
    """Contrasts (1, -1, 0)/√2 and (1, 1, -2)/√6 of the three azimuths, their mean the first
    rod's."""
    off = np.array([0.02, -0.03, 0.01])  # adds up to zero
    ideal = np.radians([10.0, 130.0, 250.0])
    probe = replace(PROBE, tripod=replace(PROBE.tripod, rod_azimuths=tuple(ideal + off)))
    described = probe_response(probe)
    contrasts = {
        "rod_azimuth_1": float(off @ [1, -1, 0]) / np.sqrt(2.0),
        "rod_azimuth_2": float(off @ [1, 1, -2]) / np.sqrt(6.0),
        "rod_azimuth": float(ideal[0]),
    }
    fitted = six_seat_response(_numbers(probe, described, **contrasts), probe.tip.radius)
    assert fitted.pretravel(CAP) == pytest.approx(described.pretravel(CAP), rel=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_slopes_are_those_of_the_values(seed: int) -> None:
    """Against central differences of the response, for probes drawn from the priors.

    Their error: curvature times step², and rounding of 1e-16 mm over the step, 1e-9 of the largest
    slope together; less than 1e-8. Where another seat opens within the step there is a kink.
    """
    rng = np.random.default_rng(seed)
    spread = np.array([min(p.spread, 1.0) for p in PARAMETERS])
    values = np.array([p.prior for p in PARAMETERS]) + 0.5 * spread * rng.standard_normal(18)
    compression, step = 0.9, 1e-5

    def along(numbers: np.ndarray) -> np.ndarray:
        response = six_seat_response(numbers, 3.0)
        force, _ = response.force(CAP)
        moved = np.sum(response.deflection(CAP, force) * CAP, axis=1)
        return np.asarray(moved + compression * response.tip_approach(force))

    pretravel, slopes = six_seat_pretravel(values, CAP, compression)
    differences = [
        (along(values + step * unit) - along(values - step * unit)) / (2.0 * step)
        for unit in np.eye(18)
    ]
    # The response smooths Hertz's law below a micronewton, at the seat that opens.
    assert pretravel == pytest.approx(along(values), abs=1e-12)
    off = np.abs(np.transpose(differences) - slopes).max(axis=1)
    assert np.quantile(off, 0.97) < 1e-8 * np.abs(slopes).max() + 1e-9


def test_basis_sums_as_its_functions_do() -> None:
    described = probe_response(PROBE)
    basis = SixSeatBasis(_numbers(PROBE, described), 3.0)
    coefficients = np.random.default_rng(2).standard_normal(basis.size)
    assert basis.value(CAP, coefficients) == pytest.approx(basis.design(CAP) @ coefficients)


@pytest.mark.parametrize("azimuth", [0.0, 2.0])
def test_a_spring_beyond_half_of_the_radius_lifts_the_opposite_rod(azimuth: float) -> None:
    """The rod at azimuth a carries (1 + 2 s · e(a)) / 3 of a spring at s, in radii of the rods."""
    described = probe_response(PROBE)
    for distance, held in ((0.499, True), (0.501, False)):
        x, y = -distance * np.cos(azimuth), -distance * np.sin(azimuth)
        values = _numbers(PROBE, described, rod_azimuth=azimuth, spring_x=x, spring_y=y)
        if held:
            carried = six_seats(values).at_rest.reshape(3, 2).sum(axis=1)
            sine = np.sin(PROBE.seats.support_angle)
            assert carried[0] * sine == pytest.approx((1.0 - 2.0 * distance) / 3.0, abs=1e-12)
        else:
            with pytest.raises(PretravelError, match="do not hold the tripod"):
                six_seats(values)
