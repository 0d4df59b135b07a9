"""Laws of all compliance models: a new model is tested once it is listed in `MODELS`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance import MODELS
from pretravel.prediction.compliance.base import TIP_ON_PART, compliance_model
from pretravel.prediction.description import Moving
from pretravel.prediction.materials import material
from pretravel.prediction.response import probe_response
from pretravel.prediction.trigger import predict

PROBE = load_probe("omp40-2")
UPPER = fibonacci_cap(400, np.radians(95.0))
EQUATOR = from_angles(np.pi / 2.0, np.radians(np.arange(0.0, 360.0, 7.0)))

BOUND_TO_AZIMUTHS = {
    "fem": "a mesh is of one position of the rods",
    "wozniak": "its five touches stay at 0, 90, 180 and 270° when the rods turn",
}

every_model = pytest.mark.parametrize("model", sorted(MODELS))
polars, azimuths = st.floats(0.0, np.radians(95.0)), st.floats(0.0, 2.0 * np.pi)


def test_every_name_is_that_of_its_model() -> None:
    assert [compliance_model(name).name for name in MODELS] == list(MODELS)


@every_model
def test_ideal_probe_repeats_every_120_degrees_and_mirrors(model: str) -> None:
    polar, azimuth = np.radians(63.0), np.radians(np.arange(0.0, 120.0, 7.0))
    reference = predict(PROBE, from_angles(polar, azimuth), model)
    turned = predict(PROBE, from_angles(polar, azimuth + np.radians(120.0)), model)
    mirrored = predict(PROBE, from_angles(polar, -azimuth), model)
    for other in (turned, mirrored):
        assert np.allclose(other.force, reference.force, rtol=1e-12)
        # The finite-element mesh is not symmetric: its re-entrant edges differ by about 0.1 %.
        exact = 1e-12 if model != "fem" else 2e-3
        assert np.allclose(other.pretravel, reference.pretravel, rtol=exact)
        assert np.allclose(other.sensing_distance, reference.sensing_distance, rtol=exact)


@pytest.mark.parametrize("model", sorted(set(MODELS) - set(BOUND_TO_AZIMUTHS)))
@settings(max_examples=10)
@given(azimuths)
def test_turned_rods_turn_the_pretravel(model: str, angle: float) -> None:
    rods = tuple(azimuth + angle for azimuth in PROBE.tripod.rod_azimuths)
    rotated = replace(PROBE, tripod=replace(PROBE.tripod, rod_azimuths=rods))
    rotation = probe_rotation(rotation=angle)
    reference, other = predict(PROBE, UPPER, model), predict(rotated, UPPER @ rotation.T, model)
    assert np.allclose(other.force, reference.force, rtol=1e-10)
    assert np.allclose(other.deflection, reference.deflection @ rotation.T, atol=1e-13)
    assert np.allclose(other.tip_approach, reference.tip_approach, atol=1e-13)


@every_model
@settings(max_examples=10)
@given(azimuths, azimuths)
def test_turned_probe_and_gravity_change_nothing(model: str, angle: float, lying: float) -> None:
    """A horizontal probe is turned together with gravity about its own axis."""
    light = replace(PROBE, moving=Moving(mass=0.01, height=-20.0))
    weight = from_angles(np.radians(100.0), lying)
    orientation = replace(light.orientation, rotation=light.orientation.rotation + angle)
    turned = replace(light, orientation=orientation)
    reference = predict(light, UPPER, model, gravity=weight)
    other = predict(turned, UPPER, model, gravity=weight @ probe_rotation(rotation=angle).T)
    assert np.allclose(other.force, reference.force, rtol=1e-10)
    assert np.allclose(other.pretravel, reference.pretravel, rtol=1e-10, atol=1e-13)


@every_model
@given(polars, azimuths)
def test_shares_add_up_to_the_pretravel(model: str, polar: float, azimuth: float) -> None:
    trigger = predict(PROBE, from_angles([polar], [azimuth]), model)
    assert set(trigger.shares) == set(trigger.displacements)
    assert np.allclose(sum(trigger.shares.values()), trigger.pretravel, atol=1e-15)
    across = sum(moved for name, moved in trigger.displacements.items() if name != TIP_ON_PART)
    assert np.allclose(across, trigger.deflection, atol=1e-15)


@every_model
def test_pushed_along_x_the_tip_bends_along_x(model: str) -> None:
    """The deflection has the direction of the push, and the pretravel is positive."""
    trigger = predict(PROBE, [[1.0, 0.0, 0.0]], model)
    assert trigger.deflection[0, 0] > 0.0
    # Rod A is in the plane of push and axis, which is one of symmetry: rounding is left, and of
    # the finite elements the asymmetry of the mesh as above.
    across = 1e-9 if model != "fem" else 2e-3
    assert abs(trigger.deflection[0, 1]) < across * trigger.deflection[0, 0]
    assert trigger.pretravel[0] > 0.0


@every_model
def test_pretravel_is_positive_around_the_equator_and_nowhere_negative(
    model: str,
) -> None:
    assert predict(PROBE, EQUATOR, model).pretravel.min() > 0.0
    assert predict(PROBE, UPPER, model).pretravel.min() > -1e-15


@every_model
@given(polars, azimuths)
def test_statics_do_not_depend_on_the_model(model: str, polar: float, azimuth: float) -> None:
    direction = from_angles([polar], [azimuth])
    reference, other = predict(PROBE, direction), predict(PROBE, direction, model)
    assert np.array_equal(other.force, reference.force)
    assert np.array_equal(other.reactions, reference.reactions)
    assert np.array_equal(other.seat, reference.seat)


@every_model
def test_a_response_is_its_model(model: str) -> None:
    """The response of a model is exact; a model without a response is refused."""
    part = material("aluminium")
    if not compliance_model(model).has_response:
        with pytest.raises(PretravelError):
            probe_response(PROBE, model)
        return
    response = probe_response(PROBE, model, workpiece=part)
    expected = predict(PROBE, UPPER, model, workpiece=part)
    assert np.allclose(response.force(UPPER)[0], expected.force, rtol=1e-12)
    assert np.allclose(response.pretravel(UPPER), expected.pretravel, rtol=1e-9, atol=1e-13)
