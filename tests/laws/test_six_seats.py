"""The six-seat probe of a few numbers agrees with the described probe.

Forces, deflections and asymmetry are compared.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.base.errors import PretravelError
from pretravel.maps.basis import StoredArray, StoredBasis
from pretravel.maps.spherical_harmonics import real_spherical_harmonics
from pretravel.maps.support import DirectionSupport
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.response import probe_response
from pretravel.prediction.seats import seat_statics
from pretravel.prediction.trigger import predict
from pretravel.six_seats.response import ProbeResponse
from pretravel.six_seats.six_seat_basis import SixSeatBasis
from pretravel.six_seats.six_seat_slopes import six_seat_pretravel
from pretravel.six_seats.uneven_seats import PARAMETERS, six_seat_response, six_seats
from tests.support.six_seat_unknowns import PRIORS, parameters_of

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
        "axial_deflection": response.compliance[2, 2] * probe.preload,
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
    values = parameters_of(np.array(PRIORS) + 0.5 * spread * rng.standard_normal(18))
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


@pytest.mark.parametrize("name", ["omp40-2", "omp40-2-100mm"])
def test_typical_numbers_are_those_of_described_probes(name: str) -> None:
    """Within three of their standard deviations."""
    probe = load_probe(name)
    for parameter, value in zip(PARAMETERS, _numbers(probe, probe_response(probe)), strict=True):
        sought = np.log(np.tan(value)) if parameter.acute else value
        assert abs(sought - parameter.prior_of_unknown) < 3.0 * parameter.spread


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


def test_a_preload_changes_the_map_as_the_probe() -> None:
    """Per logarithm of the preload: against predictions with a thousandth more and less."""
    basis = SixSeatBasis(_numbers(PROBE, probe_response(PROBE)), PROBE.tip.radius)
    ends = [
        predict(replace(PROBE, preload=PROBE.preload * f), CAP).pretravel for f in (0.999, 1.001)
    ]
    change = (ends[1] - ends[0]) / np.log(1.001 / 0.999)
    # Central differences: curvature times step² is a millionth.
    assert basis.sensitivities(CAP)["preload"] == pytest.approx(change, rel=1e-5)


@pytest.mark.parametrize("name", ["omp40-2", "omp40-2-100mm"])
def test_a_stylus_length_changes_the_map_about_as_the_probe(name: str) -> None:
    """The powers are means of probes; these two have a socket of steel that is shorter by itself.
    Along the axis only compression changes, which is linear in the length."""
    probe = load_probe(name)
    basis = SixSeatBasis(_numbers(probe, probe_response(probe)), probe.tip.radius)
    directions = np.concatenate([[[0.0, 0.0, 1.0]], CAP])
    longer, shorter = (
        predict(
            replace(probe, stylus=tuple(replace(s, length=s.length * f) for s in probe.stylus)),
            directions,
        ).pretravel
        for f in (1.01, 0.99)
    )
    change = (longer - shorter) / np.log(1.01 / 0.99)
    found = basis.sensitivities(directions)["stylus_length"]
    assert found == pytest.approx(change, rel=0.15)
    assert set(basis.sensitivities(directions)) == {"preload", "stylus_length"}


class TestBasisWithACorrection:
    """The functions of a map of kind physical, and their coefficients in files and on controls."""

    values = np.array([p.prior for p in PARAMETERS]) + 0.01 * np.arange(18)
    terms = np.array([[2, 0], [3, -3], [3, 2]])
    basis = SixSeatBasis(values, 2.5, terms)

    def test_its_functions_are_those_stated(self) -> None:
        """Pretravel, a constant, the direction, the slopes, the harmonics; in this order."""
        assert self.basis.size == 1 + 1 + 3 + 18 + 3
        response = six_seat_response(self.values, 2.5)
        pretravel, slopes = six_seat_pretravel(self.values, CAP)
        harmonics = real_spherical_harmonics(CAP, self.terms)
        functions = [pretravel[:, None], np.ones((200, 1)), CAP, slopes, harmonics]
        expected = np.concatenate(functions, axis=1)
        assert self.basis.design(CAP) == pytest.approx(expected, rel=1e-12)
        assert pretravel == pytest.approx(response.pretravel(CAP), abs=1e-11)
        assert self.basis.constant.tolist() == [0.0, 1.0] + 24 * [0.0]
        coefficients = np.random.default_rng(3).standard_normal(26)
        own = [{place} for place in (5, 22, 23, 25)]
        kept = (range(26), range(5), {*range(5), *range(23, 26)}, range(23), *own)
        for places in kept:
            some = np.zeros(26)
            some[list(places)] = coefficients[list(places)]
            assert self.basis.value(CAP, some) == pytest.approx(expected @ some, abs=1e-10)
        moved = response.deflection(CAP, response.force(CAP)[0])
        moved = moved + response.tip_approach(response.force(CAP)[0])[:, None] * CAP
        assert self.basis.displacement(CAP) == pytest.approx(moved, rel=1e-9, abs=1e-15)
        for parameter, value in zip(PARAMETERS, self.values, strict=True):
            physical = np.exp(value) if parameter.logarithmic else value
            assert self.basis.named[parameter.name] == pytest.approx(physical, rel=1e-12)

    def test_its_form_on_a_control(self) -> None:
        """Slopes cannot be programmed; a correction of zeros is none."""
        coefficients = np.zeros(26)
        coefficients[:5] = 1.1, 0.2, 0.3, 0.4, 0.5
        form = self.basis.form_on_control(coefficients)
        assert form is not None
        assert (form.scale, form.constant, form.shift.tolist()) == (1.1, 0.2, [0.3, 0.4, 0.5])
        assert form.correction is None
        assert form.probe is self.basis.response
        coefficients[23:] = 1.0, 0.0, 3.0
        form = self.basis.form_on_control(coefficients)
        assert form is not None
        assert form.correction is not None
        assert np.array_equal(form.correction.terms, self.terms)
        assert form.correction.coefficients.tolist() == [1.0, 0.0, 3.0]
        for slope in (5, 22):
            assert self.basis.form_on_control(np.eye(26)[slope] + coefficients) is None

    def test_it_is_stored_whole(self) -> None:
        support = DirectionSupport(CAP)
        plain = SixSeatBasis(self.values, 2.5)
        for basis in (self.basis, plain):
            read = SixSeatBasis.restored(StoredBasis(support, 2.5, basis.arrays()))
            assert read is not None
            assert np.array_equal(read.values, self.values)
            assert np.array_equal(read.terms, basis.terms)
            assert read.tip_radius == 2.5
            for array in basis.arrays().values():
                assert len(array.axes) == 1
        assert SixSeatBasis.restored(StoredBasis(support, 2.5)) is None
        names = StoredArray(("parameter",), [p.name for p in PARAMETERS][::-1])
        other = StoredBasis(support, 2.5, {**plain.arrays(), "parameter": names})
        with pytest.raises(PretravelError, match="other parameters than this version"):
            SixSeatBasis.restored(other)

    def test_numbers_of_unusual_size_are_refused(self) -> None:
        for sign in (1.0, -1.0):
            usual = np.where(np.arange(18) == 2, sign * 49.9, self.values)
            SixSeatBasis(usual, 2.5)
            with pytest.raises(PretravelError, match="of usual size"):
                SixSeatBasis(np.where(np.arange(18) == 2, sign * 50.0, self.values), 2.5)

    def test_its_correction_has_harmonics_that_exist(self) -> None:
        assert SixSeatBasis(self.values, 2.5).size == 23
        with pytest.raises(PretravelError):
            SixSeatBasis(self.values, 2.5, np.array([[2, 3]]))  # an order above its degree
