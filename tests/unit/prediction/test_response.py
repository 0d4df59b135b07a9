"""A probe condensed to its response: made-up numbers by hand, and a described probe."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import ConvergenceError, PretravelError
from pretravel.maps.basis import StoredBasis
from pretravel.maps.support import DirectionSupport
from pretravel.prediction.compliance import analytic
from pretravel.prediction.compliance.base import TIP_ON_PART, ComplianceModel
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import Loading
from pretravel.prediction.response import probe_response, response_map
from pretravel.prediction.trigger import predict
from pretravel.six_seats.response import (
    ProbeResponse,
    ResponseBasis,
    hertz_power,
    hertz_power_and_slope,
)
from pretravel.six_seats.six_seat_basis import SixSeatBasis
from pretravel.six_seats.six_seat_slopes import six_seat_pretravel
from pretravel.six_seats.uneven_seats import PARAMETERS

DIRECTIONS = np.array([[0.6, 0.48, 0.64], [-0.8, 0.6, 0.0], [0.28, -0.96, 0.0], [0.0, 0.0, 1.0]])
TIP_RADIUS = 2.5


def made_up(criterion: str = "first_contact") -> ProbeResponse:
    """No two numbers are equal, and no matrix is symmetric."""
    random = np.random.default_rng(12)
    return ProbeResponse(
        reaction_change=random.normal(size=(6, 3)),
        rest_reactions=random.uniform(1.0, 3.0, 6),
        criterion=criterion,
        threshold=0.2,
        compliance=random.normal(size=(3, 3)) * 1e-3,
        seat_motion=random.normal(size=(3, 6)),
        seat_coefficient=2e-4,
        tip_coefficient=3e-4,
        tip_radius=TIP_RADIUS,
    )


def test_hertz_law_is_a_parabola_below_a_micronewton() -> None:
    """From zero, with the value and the slope of N^(2/3) at 1e-6 N."""
    end, value, slope = 1e-6, 1e-4, 2.0 / 3.0 * 100.0
    square, linear = np.linalg.solve([[end**2, end], [2.0 * end, 1.0]], [value, slope])
    low = np.linspace(0.0, 0.999, 7) * end
    assert hertz_power(low) == pytest.approx(square * low**2 + linear * low, rel=1e-9, abs=1e-20)
    assert hertz_power_and_slope(low)[1] == pytest.approx(2.0 * square * low + linear, rel=1e-9)
    high = np.array([1.0001e-6, 1e-3, 1.0, 27.0])
    assert hertz_power(high) == pytest.approx(high ** (2.0 / 3.0), rel=1e-12)
    assert hertz_power_and_slope(high)[1] == pytest.approx(
        2.0 / 3.0 * high ** (-1.0 / 3.0), rel=1e-12
    )


@pytest.mark.parametrize("criterion", ["first_contact", "arm_lift"])
def test_the_numbers_of_a_response_mean_what_is_stated(criterion: str) -> None:
    """Direction by direction, seat by seat."""
    response = made_up(criterion)
    force, opening = response.force(DIRECTIONS)
    tried = 0.5 * force
    reactions = response.reactions(DIRECTIONS, tried)
    moved = response.deflection(DIRECTIONS, tried)
    excess = response.excess(DIRECTIONS, tried)
    approach = response.tip_approach(tried)
    for row, d in enumerate(DIRECTIONS):
        loads = [response.rest_reactions[s] + tried[row] * response.reaction_change[s] @ d
                 for s in range(6)]  # fmt: skip
        assert reactions[row] == pytest.approx(loads, rel=1e-12)
        watched = loads if criterion == "first_contact" else np.reshape(loads, (3, 2)).sum(axis=1)
        assert excess[row] == pytest.approx(min(watched) - 0.2, rel=1e-12)
        assert excess[row] > 0.0
        expected = tried[row] * (response.compliance @ d)
        for seat in range(6):
            deeper = max(loads[seat], 0.0) ** (2 / 3) - response.rest_reactions[seat] ** (2 / 3)
            expected = expected + 2e-4 * deeper * response.seat_motion[:, seat]
        assert moved[row] == pytest.approx(expected, rel=1e-9, abs=1e-15)
        assert approach[row] == pytest.approx(3e-4 * tried[row] ** (2 / 3), rel=1e-12)
    assert response.excess(DIRECTIONS, force) == pytest.approx(np.zeros(4), abs=1e-12)
    assert np.all((opening >= 0) & (opening < 6))
    along = np.sum(response.deflection(DIRECTIONS, force) * DIRECTIONS, axis=1)
    pretravel = along + response.tip_approach(force)
    assert response.pretravel(DIRECTIONS) == pytest.approx(pretravel, rel=1e-12)
    assert not response.compliance.flags.writeable


def test_a_direction_that_never_triggers_has_no_pretravel() -> None:
    """Infinite forces, and infinite displacements of either sign: not a number, and no warning."""
    random, d = made_up(), DIRECTIONS[:1]
    against = replace(random, compliance=-np.eye(3), seat_motion=-np.ones((3, 6)))
    for some in (random, against):
        response = replace(some, reaction_change=np.ones((6, 3)))
        assert response.force(d)[0].tolist() == [math.inf]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert not np.isfinite(response.pretravel(d))[0]
            assert not np.any(np.isfinite(ResponseBasis(response).displacement(d)))


def test_a_curved_part_gives_way_by_hertz() -> None:
    """On a sphere of radius R the approach is (1 + r/R)^(1/3) of that on a flat; where the ball
    does not fit into a hollow, that on a flat."""
    response = made_up()
    basis = ResponseBasis(response)
    force, _ = response.force(DIRECTIONS)
    flat = response.deflection(DIRECTIONS, force) + (
        response.tip_approach(force)[:, None] * DIRECTIONS
    )
    assert basis.displacement(DIRECTIONS) == pytest.approx(flat, rel=1e-12)
    assert basis.design(DIRECTIONS) == pytest.approx(
        np.sum(flat * DIRECTIONS, axis=1)[:, None], rel=1e-9
    )
    radii = np.array([4.0, -10.0, -2.0, math.inf])
    factor = np.array([(1.0 + 2.5 / 4.0) ** (1 / 3), 0.75 ** (1 / 3), 1.0, 1.0])
    curved = basis.displacement(DIRECTIONS, np.stack([1.0 / radii, 1.0 / radii], axis=1))
    more = (factor - 1.0) * response.tip_approach(force)
    assert curved - flat == pytest.approx(more[:, None] * DIRECTIONS, rel=1e-6, abs=1e-12)


def test_a_response_is_stored_whole() -> None:
    """What is read again is what was written; each number changes the checksum."""
    response = made_up("arm_lift")
    basis = ResponseBasis(response)
    support = DirectionSupport(DIRECTIONS)
    stored = StoredBasis(support, TIP_RADIUS, basis.arrays(), basis.attributes())
    read = ResponseBasis.restored(stored)
    assert read is not None
    for entry in fields(ProbeResponse):
        written, found = getattr(response, entry.name), getattr(read.response, entry.name)
        assert np.array_equal(written, found)
        if entry.name != "criterion":
            other = ResponseBasis(replace(response, **{entry.name: 2.0 * written}))
            same = [
                np.array_equal(array.values, other.arrays()[name].values)
                for name, array in basis.arrays().items()
            ]
            assert same.count(False) == 1
    assert all(len(array.axes) == np.ndim(array.values) for array in basis.arrays().values())
    units = {name.removeprefix("response_"): a.unit for name, a in basis.arrays().items()}
    assert units == {
        "reaction_change": "1", "rest_reactions": "N", "compliance": "mm/N", "seat_motion": "1",
        "threshold": "N", "seat_coefficient": "mm/N^(2/3)", "tip_coefficient": "mm/N^(2/3)",
        "tip_radius": "mm",
    }  # fmt: skip
    assert ResponseBasis.restored(StoredBasis(support, TIP_RADIUS)) is None


def test_the_form_on_a_control_is_the_probe_itself() -> None:
    """For circuits that watch each seat; a lift of rods is not programmed there."""
    assert ResponseBasis(made_up("arm_lift")).form_on_control(np.ones(1)) is None
    basis = ResponseBasis(made_up())
    form = basis.form_on_control(np.array([1.25]))
    assert form is not None
    assert (form.scale, form.constant, form.shift.tolist()) == (1.25, 0.0, [0.0, 0.0, 0.0])
    assert form.probe is basis.response is basis.condensed_probe
    assert form.correction is None
    assert basis.size == 1
    assert basis.constant is None


def test_seats_and_tip_of_a_described_probe(omp40: Probe) -> None:
    """What the law of `tests/laws/test_touches_on_surfaces.py` does not show, which compares
    pretravel: rigid seats give way by no force, and Shen's tip neither."""
    probe = replace(omp40, threshold=0.1)
    response = probe_response(probe)
    assert (response.criterion, response.threshold) == ("first_contact", 0.1)
    assert response.tip_radius == probe.tip.radius
    rigid = replace(probe, seats=replace(probe.seats, contact="rigid"))
    assert probe_response(rigid).seat_coefficient == 0.0
    shen = probe_response(probe, "shen")
    assert shen.seat_coefficient == shen.tip_coefficient == 0.0


class Uneven(ComplianceModel):
    """The analytic model, with an error in all directions but those of the unit forces."""

    name = "uneven"

    def __init__(self, share: str, error: float) -> None:
        self.share, self.error = share, error

    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        shares = dict(analytic.MODEL.displacements(loading))
        if len(loading.directions) > 3:
            shares[self.share] = shares[self.share] + self.error * loading.directions
        return shares


@pytest.mark.parametrize("share", [TIP_ON_PART, "seats"])
def test_a_model_of_another_form_is_refused(omp40: Probe, share: str) -> None:
    """Beyond a ten-millionth of a micrometre; below it is rounding."""
    for error in (1.1e-10, -1.1e-10, math.nan):
        with pytest.raises(ConvergenceError, match="model uneven differs from this form"):
            probe_response(omp40, Uneven(share, error))
    # The largest component of a unit vector among 64 is at least 0.9.
    probe_response(omp40, Uneven(share, 0.9e-10))


def test_the_map_of_a_response_is_exact_between_directions(omp40: Probe) -> None:
    response, trigger = probe_response(omp40), predict(omp40, fibonacci_cap(40))
    made = response_map(omp40, response, trigger)
    between = fibonacci_cap(57, math.radians(70.0))
    normals = between @ made.rotation.T
    expected = predict(omp40, between).pretravel
    assert made.pretravel(normals) == pytest.approx(expected, rel=1e-9)
    assert made.coefficients.tolist() == [1.0]
    assert np.asarray(made.covariance.matrix).tolist() == [[0.0]]
    assert made.tip_radius == omp40.tip.radius
    assert made.support.nodes == pytest.approx(trigger.directions)


class TestSixSeats:
    VALUES = np.array([p.prior for p in PARAMETERS]) + 0.002 * np.arange(18)

    @pytest.mark.filterwarnings("error")
    def test_a_direction_that_never_triggers_has_no_pretravel_and_no_warning(self) -> None:
        directions = np.array([[0.0, 0.0, -1.0], [0.0, 0.6, 0.8]])
        found, slopes = six_seat_pretravel(self.VALUES, directions)
        assert np.isfinite(found).tolist() == [False, True]
        assert np.all(np.isfinite(slopes[1]))

    def test_numbers_of_a_basis_are_eighteen_and_its_own(self) -> None:
        for wrong in (self.VALUES[:17], np.append(self.VALUES, 0.0), self.VALUES[:, None]):
            with pytest.raises(PretravelError, match="has 18 parameters"):
                SixSeatBasis(wrong, 2.0)
        mine = self.VALUES.copy()
        basis = SixSeatBasis(mine, 2.0)
        mine[:] = 0.0
        assert np.array_equal(basis.values, self.VALUES)
        assert not basis.values.flags.writeable
