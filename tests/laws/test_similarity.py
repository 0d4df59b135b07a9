"""Laws of similarity: what is larger, stiffer, moved or named differently gives what it must."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles
from pretravel.design.friction.seat_friction import FrictionCycle, friction_cycle
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.separation import METHODS, Method, Separation, separate
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance.base import MODELS, compliance_model
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import loaded
from pretravel.prediction.materials import Material, default_workpiece
from pretravel.prediction.seats import seat_statics
from pretravel.prediction.trigger import predict

UPPER = fibonacci_cap(60, np.radians(90.0))
AROUND = from_angles(0.5 * np.pi, np.radians([0.0, 40.0, 90.0, 190.0]))


def _similar(probe: Probe, size: float, stiffness: float) -> Probe:
    """All lengths times `size`, all moduli times `stiffness`, and forces that fit both."""

    def stiffer(material: Material) -> Material:
        return replace(material, youngs_modulus=stiffness * material.youngs_modulus)

    tripod, seats = probe.tripod, probe.seats
    return replace(
        probe,
        tripod=replace(
            tripod, radius=size * tripod.radius, rod_radius=size * tripod.rod_radius,
            material=stiffer(tripod.material),
        ),
        seats=replace(
            seats, ball_radius=size * seats.ball_radius, material=stiffer(seats.material)
        ),
        preload=size**2 * stiffness * probe.preload,
        hub_offset=size * probe.hub_offset,
        stylus=tuple(
            replace(s, length=size * s.length, diameter=size * s.diameter,
                    material=stiffer(s.material))
            for s in probe.stylus
        ),
        tip=replace(
            probe.tip, radius=size * probe.tip.radius, material=stiffer(probe.tip.material)
        ),
        hub=None,
    )  # fmt: skip


@pytest.mark.parametrize("model", sorted(set(MODELS) - {"fem"}))
@pytest.mark.parametrize(("size", "stiffness"), [(1.7, 1.0), (1.0, 0.6), (0.8, 1.3)])
def test_similar_probes_move_in_proportion_to_their_size(
    model: str, size: float, stiffness: float
) -> None:
    """Strains are the same where forces are as moduli times areas: Hertz, bending, statics."""
    probe, part = load_probe("omp40-2"), default_workpiece()
    own = predict(probe, UPPER, model, workpiece=part)
    stiff = replace(part, youngs_modulus=stiffness * part.youngs_modulus)
    other = predict(_similar(probe, size, stiffness), UPPER, model, workpiece=stiff)
    assert other.force == pytest.approx(size**2 * stiffness * own.force, rel=1e-9)
    assert other.pretravel == pytest.approx(size * own.pretravel, rel=1e-9)
    for name, share in own.shares.items():
        assert other.shares[name] == pytest.approx(size * share, rel=1e-9, abs=1e-15), name


@pytest.mark.long
def test_similar_probes_have_similar_friction() -> None:
    """Slip and stick follow from ratios of forces, so that a whole cycle is similar."""

    def cycle(probe: Probe, overtravel: float) -> FrictionCycle:
        return friction_cycle(probe, AROUND, 0.15, overtravel=overtravel, cycles=2, steps=12)

    probe = load_probe("omp40-2")
    own, other = cycle(probe, 0.01), cycle(_similar(probe, 1.6, 0.7), 0.016)
    scale = 1.6**2 * 0.7
    # Newton's method ends at residuals of 1e-10 of the preload, bisection at 1 / 2^24 of a step.
    assert other.deflection == pytest.approx(1.6 * own.deflection, rel=1e-5, abs=1e-7)
    assert other.force == pytest.approx(scale * own.force, abs=1e-8 * scale * own.force.max())
    assert other.trigger_force == pytest.approx(scale * own.trigger_force, rel=1e-6)
    largest = np.abs(own.rest_displacement).max()
    assert largest > 1e-5
    assert other.rest_displacement == pytest.approx(1.6 * own.rest_displacement, abs=1e-4 * largest)


@pytest.mark.long
def test_friction_is_determined_nearly_where_both_seats_of_a_rod_open_at_once() -> None:
    """A rod without load on both seats has no one place on them: which seat slips first after that
    follows from the rounding, and the force by less than 0.5 %."""

    def force(size: float) -> FloatArray:
        probe = _similar(load_probe("omp40-2"), size, 1.0)
        rod = from_angles(0.5 * np.pi, np.radians([60.0]))
        cycle = friction_cycle(probe, rod, 0.15, overtravel=0.01 * size, cycles=2, steps=12)
        return cycle.force / size**2

    own = force(1.0)
    assert force(1.6) == pytest.approx(own, abs=5e-3 * own.max())


@pytest.mark.parametrize("azimuth", [0.0, 30.0, 200.0])
@pytest.mark.parametrize("polar", [30.0, 60.0, 85.0])
def test_ren_tilts_and_bends_by_the_lateral_force(polar: float, azimuth: float) -> None:
    """An oblique force moves the tip as its component across the axis does, along that."""
    probe, angle = load_probe("omp40-2"), np.radians(polar)
    oblique = from_angles(angle, np.radians(azimuth))
    lateral = from_angles(0.5 * np.pi, np.radians(azimuth))
    statics = seat_statics(probe)
    model, part = compliance_model("ren"), default_workpiece()
    force = np.array([0.7])
    found = model.displacements(loaded(probe, statics, oblique, force, part))
    across = model.displacements(loaded(probe, statics, lateral, force * np.sin(angle), part))
    for name in ("seat_tilt", "stylus_bending"):
        assert found[name] == pytest.approx(across[name], rel=1e-12, abs=1e-18)
        assert np.linalg.norm(found[name]) > 1e-4


COUNT = 10
ROW, COLUMN = np.divmod(np.arange(COUNT**2), COUNT)


@cache
def _errors() -> np.ndarray:
    """Readings with a scatter that depends on the direction, and two with dirt. [mm]"""
    rng = np.random.default_rng(8)
    deviation = 0.3 + 0.2 * (COLUMN % 3)
    errors = np.sin(ROW) - 2.0 * np.cos(COLUMN) + deviation * rng.standard_normal(COUNT**2)
    errors[[17, 63]] += [9.0, -12.0]
    return 1e-3 * errors


@cache
def _separated(method: Method) -> Separation:
    return separate(MultiStepReadings(ROW, COLUMN, _errors()), method=method)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("factor", [-1.0, 0.1, 25.0])
def test_a_separation_is_in_the_unit_of_its_readings(method: Method, factor: float) -> None:
    own = _separated(method)
    other = separate(MultiStepReadings(ROW, COLUMN, factor * _errors()), method=method)
    assert [o.row for o in other.outliers] == [o.row for o in own.outliers]
    assert {o.row for o in own.outliers} == {17, 63}
    assert other.machine_error == pytest.approx(factor * own.machine_error, rel=1e-6)
    assert other.u_probe_error == pytest.approx(abs(factor) * own.u_probe_error, rel=1e-6)
    for name in ("machine_variance", "probe_variance", "u_machine_variance", "movable"):
        mine, theirs = getattr(own, name), getattr(other, name)
        assert theirs == pytest.approx(factor**2 * mine, rel=1e-5, abs=1e-6 * factor**2 * 1e-6)


@pytest.mark.parametrize("method", ["reml", "least-squares"])
def test_systematic_errors_do_not_change_variances(method: Method) -> None:
    """What machine and probe add in every reading is separated, whatever it is. The equations of
    the paper, as printed, do not obey this law (`tests/validation/test_nafi_mayer_2011.py`)."""
    own = _separated(method)
    machine, probe = 0.02 * np.cos(3.0 * np.arange(COUNT)), 0.05 * np.arange(COUNT) / COUNT
    errors = _errors() + machine[ROW] + probe[COLUMN]
    other = separate(MultiStepReadings(ROW, COLUMN, errors), method=method)
    added = machine - machine.mean()
    assert other.machine_error == pytest.approx(own.machine_error + added, abs=1e-9)
    assert other.machine_variance == pytest.approx(own.machine_variance, rel=1e-5, abs=1e-12)
    assert other.probe_variance == pytest.approx(own.probe_variance, rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_the_order_of_readings_and_the_names_of_directions_do_not_matter(method: Method) -> None:
    own, order = _separated(method), np.random.default_rng(2).permutation(COUNT**2)
    readings = MultiStepReadings(2 * ROW[order] + 5, 7 - COLUMN[order], _errors()[order])
    other = separate(readings, method=method)
    assert {int(order[o.row]) for o in other.outliers} == {17, 63}
    assert other.machine_error == pytest.approx(own.machine_error, rel=1e-6, abs=1e-9)
    assert other.probe_variance == pytest.approx(own.probe_variance[::-1], rel=1e-5, abs=1e-12)
    assert other.machine_variance == pytest.approx(own.machine_variance, rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_machine_and_probe_exchange_their_places(method: Method) -> None:
    own = _separated(method)
    other = separate(MultiStepReadings(COLUMN, ROW, -_errors()), method=method)
    assert other.machine_variance == pytest.approx(own.probe_variance, rel=1e-5, abs=1e-12)
    assert other.probe_variance == pytest.approx(own.machine_variance, rel=1e-5, abs=1e-12)
    # The mean of all readings stays with the probe.
    apart = other.probe_error - own.machine_error
    assert apart == pytest.approx(np.full(COUNT, apart[0]), abs=1e-9)
