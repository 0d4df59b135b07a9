"""Friction at the seats: what Coulomb and thermodynamics demand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from pretravel.directions import from_angles
from pretravel.errors import PretravelError
from pretravel.probe.catalogue import load_probe
from pretravel.probe.description import Probe
from pretravel.trigger.friction import FrictionCycle, friction_cycle
from pretravel.trigger.predict import predict

DIRECTIONS = from_angles(
    np.radians([90.0, 90.0, 90.0, 50.0, 25.0]), np.radians([0.0, 20.0, 60.0, 100.0, 213.0])
)


@cache
def rubbed(friction: float, cycles: int = 2, steps: int = 25) -> FrictionCycle:
    """A rigid tripod on Hertz seats: elasticity of the body adds nothing to these laws."""
    return friction_cycle(load_probe("omp40-2"), DIRECTIONS, friction, cycles=cycles, steps=steps)


def test_without_friction_it_is_statics(omp40: Probe) -> None:
    cycle = rubbed(0.0)
    force = predict(omp40, DIRECTIONS, "shen").force
    assert cycle.trigger_force == pytest.approx(np.repeat(force[:, None], 2, axis=1), rel=1e-6)
    assert np.abs(cycle.hysteresis).max() < 1e-8
    assert np.abs(cycle.zero_drift).max() < 1e-8
    assert np.abs(cycle.tangential).max() < 1e-12


def test_without_friction_the_deflection_is_that_of_the_seats(omp40: Probe) -> None:
    """The rigid tripod on its Hertz seats is the model `analytic` with a rigid stylus."""
    trigger = predict(omp40, DIRECTIONS, "analytic")
    seats = np.sum(trigger.displacements["seats"] * DIRECTIONS, axis=1)
    assert rubbed(0.0).trigger_deflection[:, 0] == pytest.approx(seats, rel=1e-6)


@pytest.mark.parametrize("friction", [0.05, 0.15])
def test_coulombs_cone(friction: float) -> None:
    cycle = rubbed(friction)
    size = np.linalg.norm(cycle.tangential, axis=3)
    assert np.all(size <= friction * np.maximum(cycle.reactions, 0.0) + 1e-7)
    assert np.any(size > 0.99 * friction * cycle.reactions + 1e-3)  # and somewhere it slides


@pytest.mark.parametrize("friction", [0.05, 0.15])
def test_a_cycle_costs_work(friction: float) -> None:
    """Once it has settled, force over deflection goes round the right way."""
    cycle = rubbed(friction)
    last = np.flatnonzero(cycle.cycle == 1)
    rows = np.concatenate([[last[0] - 1], last])
    work = np.trapezoid(cycle.force[:, rows], cycle.deflection[:, rows], axis=1)
    assert np.all(work > 0.0)


def test_equilibrium_at_every_step(omp40: Probe) -> None:
    """Forces and moments of seats, friction, spring and tip, reckoned anew."""
    from pretravel.probe.seat_frame import seat_frame

    cycle, frame = rubbed(0.15), seat_frame(omp40)
    contacts = frame.contacts(omp40.tripod.rod_radius)
    seat = cycle.reactions[..., None] * frame.normals
    rub = cycle.tangential[..., :1] * frame.along + cycle.tangential[..., 1:] * frame.around
    tip = cycle.force[..., None] * cycle.directions[:, None]
    total = (seat + rub).sum(axis=2) + tip + np.array([0.0, 0.0, -omp40.preload])
    moment = np.cross(contacts, seat + rub).sum(axis=2)
    moment += np.cross(np.array([0.0, 0.0, -omp40.lever]), tip)
    assert np.abs(total).max() < 1e-7
    assert np.abs(moment).max() < 1e-6


def test_friction_delays_the_trigger_on_average() -> None:
    """Friction resists: more force to open a seat; how much more grows with friction."""
    forces = [rubbed(friction).trigger_force[:, 0] for friction in (0.0, 0.05, 0.15)]
    assert np.all(forces[1] >= forces[0] * (1.0 - 1e-6))
    assert np.mean(forces[2]) > np.mean(forces[1]) > np.mean(forces[0])


def test_the_zero_drifts_at_first_and_then_settles() -> None:
    """Ren's drift of zero position: the first touch moves the rest, the next ones hardly."""
    cycle = rubbed(0.15, cycles=3, steps=20)
    assert np.all(cycle.reseat_error[:, 0] > 5.0 * cycle.reseat_error[:, 2])
    assert np.all(cycle.zero_drift[:, 0] > 0.0)


def test_threefold_symmetry(omp40: Probe) -> None:
    turned = from_angles(np.radians([90.0, 90.0]), np.radians([20.0, 140.0]))
    cycle = friction_cycle(omp40, turned, 0.1, steps=15)
    assert cycle.trigger_force[0] == pytest.approx(cycle.trigger_force[1], rel=1e-6)
    assert cycle.zero_drift[0] == pytest.approx(cycle.zero_drift[1], rel=1e-4)


def test_bad_values_are_explained(omp40: Probe) -> None:
    with pytest.raises(PretravelError, match=r"between 0 and 0\.5"):
        friction_cycle(omp40, DIRECTIONS, 0.8)
    with pytest.raises(PretravelError, match="overtravel"):
        friction_cycle(omp40, DIRECTIONS, 0.1, overtravel=0.0)
    rigid = replace(omp40, seats=replace(omp40.seats, contact="rigid"))
    with pytest.raises(PretravelError, match="rigid"):
        friction_cycle(rigid, DIRECTIONS, 0.1)
