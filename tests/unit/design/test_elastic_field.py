"""Displacement and stress of a made-up body at the trigger: some loose tetrahedra.

Its modes and its flexibility are any numbers. The seats and the tip are those of a probe.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.design.fem.condensation import ElasticField, ReducedModel
from pretravel.design.fem.elastic_field import TriggerField, field_at_trigger, stress_by_direction
from pretravel.design.fem.elasticity import stress_of
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.interface_loads import SEATS, SPRING_FORCE, TIP_FORCE
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import material
from pretravel.prediction.seats import seat_frame, seat_statics
from pretravel.six_seats.event import trigger_force
from pretravel.six_seats.hertz import rod_on_ball_coefficient

DIRECTIONS = np.array([[0.6, 0.48, 0.64], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
REGIONS = np.array([0, 0, 1, 2, 1, 2, 2])
PRELOAD = 4.0
SPRING = [0, 1, 2, 28, 31, 29, 4, 5, 6, 34, 37, 35]


@pytest.fixture(scope="module")
def probe() -> Probe:
    return replace(load_probe("omp40-2"), preload=PRELOAD)


@pytest.fixture(scope="module")
def body(probe: Probe) -> ReducedModel:
    random = np.random.default_rng(3)
    count = len(REGIONS)
    corners = random.normal(size=(count, 4, 3)) * 5.0
    edges = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
    middles = corners[:, edges].mean(axis=2)
    first = 4 * np.arange(count)[:, None] + np.arange(4)
    then = 4 * count + 6 * np.arange(count)[:, None] + np.array([0, 3, 1, 2, 4, 5])
    mesh = FiniteElementMesh(
        points=np.concatenate([corners.reshape(-1, 3), middles.reshape(-1, 3)]),
        elements=np.concatenate([first, then], axis=1),
        regions=REGIONS,
        region_names=("rods", "stylus 1", "tip"),
        faces={"spring": np.array([SPRING[:6], SPRING[6:]])},
        boundary=np.zeros((0, 6), dtype=np.int64),
        quality=np.ones(len(REGIONS)),
    )
    names = ("tungsten carbide", "steel", "ruby")
    materials = dict(zip(mesh.region_names, map(material, names), strict=True))
    statics = seat_statics(probe)
    resultants = np.zeros((6, 22))
    resultants[:, SEATS], resultants[:, TIP_FORCE] = statics.wrenches, statics.tip_wrenches
    resultants[2, SPRING_FORCE] = -1.0
    field = ElasticField(mesh, materials, random.normal(size=(len(mesh.points), 3, 22)) * 1e-4)
    root = random.normal(size=(22, 22))
    return ReducedModel(
        flexibility=1e-6 * root @ root.T,
        flexibility_by_region={"rods": 1e-6 * root @ root.T},
        resultants=resultants,
        patch_compliance=3e-5,
        ball_correction=1e-5,
        seat_part="rods",
        summary={},
        load_field=lambda: field,
    )


def interface(probe: Probe, direction: FloatArray, share: float) -> FloatArray:
    """A share of the force at the trigger, the reactions that balance it, and the spring."""
    statics = seat_statics(probe)
    force, _ = trigger_force(statics.rest_reactions, statics.unit_reactions(direction[None]))
    forces = np.zeros(22)
    forces[:6] = statics.reactions(direction[None], share * force)[0]
    forces[6:9], forces[9] = share * force[0] * direction, PRELOAD
    return forces


@pytest.fixture(scope="module")
def field(probe: Probe, body: ReducedModel) -> TriggerField:
    return field_at_trigger(probe, DIRECTIONS[0], body)


def test_the_body_moves_with_its_modes_and_stays_on_its_seats(
    probe: Probe, body: ReducedModel, field: TriggerField
) -> None:
    """Each seat of the body approaches its ball by Hertz's law, and by what the mesh's patches and
    balls differ from half-spaces; the rest of the motion is rigid."""
    rest = interface(probe, DIRECTIONS[0], 0.0)
    touched = interface(probe, DIRECTIONS[0], 1.0)
    change = touched - rest
    mesh, modes = body.elastic_field.mesh, body.elastic_field.modes
    left = field.displacement - modes @ change
    # A rigid motion: translation, and rotation about the origin, by least squares over all nodes.
    columns = np.concatenate(
        [
            np.broadcast_to(np.eye(3), (len(mesh.points), 3, 3)),
            np.stack([np.cross(axis, mesh.points) for axis in np.eye(3)], axis=2),
        ],
        axis=2,
    ).reshape(-1, 6)
    motion, off, *_ = np.linalg.lstsq(columns, left.ravel())
    assert float(off[0]) < 1e-20
    modulus = probe.tripod.material.contact_modulus(probe.seats.material)
    c = rod_on_ball_coefficient(probe.tripod.rod_radius, probe.seats.ball_radius, modulus)
    hertz = c * (np.cbrt(np.maximum(touched[:6], 0.0) ** 2) - np.cbrt(rest[:6] ** 2))
    sunk = hertz + (1e-5 - 3e-5) * change[:6]
    seats = body.flexibility[:6] @ change + seat_statics(probe).wrenches.T @ motion
    assert seats == pytest.approx(-sunk, abs=1e-12)


def stress(probe: Probe, body: ReducedModel, direction: FloatArray, share: float) -> FloatArray:
    elastic = body.elastic_field
    moved = elastic.modes @ interface(probe, direction, share)
    return stress_of(elastic.mesh, elastic.materials)(moved)


def test_stress_is_that_of_all_forces_and_at_rest_of_the_spring(
    probe: Probe, body: ReducedModel, field: TriggerField
) -> None:
    for share, found in ((0.0, field.rest_stress), (1.0, field.stress)):
        assert found == pytest.approx(stress(probe, body, DIRECTIONS[0], share), rel=1e-9)
    assert field.elastic is body.elastic_field
    assert field.rest_reactions == pytest.approx(interface(probe, DIRECTIONS[0], 0.0)[:6])


def test_forces_on_the_body_are_in_equilibrium(
    probe: Probe, body: ReducedModel, field: TriggerField
) -> None:
    """Seats, tip and spring: no force and no moment is left, and the seats push where rods and
    balls touch."""
    assert field.points.shape == field.forces.shape == (8, 3)
    assert field.forces.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    moments = np.cross(field.points, field.forces)
    assert moments.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-10)
    frame = seat_frame(probe)
    gone = np.linalg.norm(field.points[:6] - frame.points, axis=1)
    assert gone == pytest.approx(np.full(6, probe.tripod.rod_radius), rel=1e-12)
    assert np.all(np.sum((field.points[:6] - frame.points) * field.forces[:6], axis=1) <= 1e-12)
    assert field.points[6] == pytest.approx([0.0, 0.0, -probe.lever])
    assert field.forces[6] == pytest.approx(field.trigger.force[0] * DIRECTIONS[0], rel=1e-12)
    top = body.elastic_field.mesh.points[SPRING, 2].max()
    assert field.points[7] == pytest.approx([0.0, 0.0, top], rel=1e-12)
    assert field.forces[7] == pytest.approx([0.0, 0.0, -PRELOAD], rel=1e-12)


def test_seats_that_carry_nothing_are_open(field: TriggerField) -> None:
    """Up to a millionth of the largest load at rest above the threshold; of a piezo stage none."""
    rest = field.rest_reactions * np.array([0.2, 1.0, 0.3, 2.0, 0.7, 1.2])
    largest = 2.0 * field.rest_reactions[3]
    loads = 0.01 + largest * np.array([0.9e-6, 1.0, 0.0, 1.1e-6, 0.5, 2e-6])
    trigger = replace(field.trigger, reactions=loads[None])
    some = replace(field, trigger=trigger, rest_reactions=rest, open_at=0.01)
    assert some.opened == ["A-left", "B-left"]
    assert replace(some, open_at=0.0).opened == []


def test_states_that_are_not_shown_are_refused_by_name(probe: Probe, body: ReducedModel) -> None:
    """The messages spoke of the model shen, and of a contact that carries tension."""
    for changed, words in (
        (probe.with_friction(0.1), r"\[seats\] has 0.1"),
        (replace(probe, tip=replace(probe.tip, friction=0.2)), r"\[tip\] has 0.2"),
        (replace(probe, criterion="arm_lift"), "criterion 'arm_lift'"),
    ):
        with pytest.raises(PretravelError, match=words):
            field_at_trigger(changed, DIRECTIONS[0], body)


def test_the_highest_stress_of_each_part_and_its_place(
    probe: Probe, body: ReducedModel, field: TriggerField
) -> None:
    """Part by part, element by element, direction by direction. A field of the first direction is
    taken as it is, and not for the others."""
    mesh = body.elastic_field.mesh
    centres = np.array([mesh.points[nodes].mean(axis=0) for nodes in mesh.elements])
    known = np.arange(1.0, len(REGIONS) + 1.0)
    stated = replace(field, stress=known, rest_stress=2.0 * known)
    rest = stress(probe, body, DIRECTIONS[0], 0.0)
    touched = np.array([stress(probe, body, direction, 1.0) for direction in DIRECTIONS])
    for given, at_rest, of_first in ((None, rest, touched[0]), (stated, 2.0 * known, known)):
        found = stress_by_direction(probe, DIRECTIONS, body, given)
        assert found.parts == ("rods", "stylus 1", "tip")
        assert found.directions == pytest.approx(DIRECTIONS)
        for part in range(3):
            own = np.flatnonzero(part == REGIONS)
            assert found.rest[part] == pytest.approx(at_rest[own].max(), rel=1e-9)
            for row, of_all in enumerate((of_first, *touched[1:])):
                highest = own[int(np.argmax(of_all[own]))]
                assert found.highest[row, part] == pytest.approx(of_all[highest], rel=1e-9)
                assert found.places[row, part] == pytest.approx(centres[highest], rel=1e-12)


@pytest.mark.parametrize("component", range(6))
def test_a_millionth_of_the_forces_may_be_left(body: ReducedModel, component: int) -> None:
    """Of their sum of amounts; of a moment, times the largest lever of the interface."""
    resultants = np.random.default_rng(4).normal(size=(6, 22)) * -np.repeat([1.0, 12.0], 3)[:, None]
    uneven, inverse = replace(body, resultants=resultants), np.linalg.pinv(resultants)
    balanced = np.random.default_rng(5).normal(size=22)
    balanced -= inverse @ (resultants @ balanced)
    allowed = 1e-6 * np.abs(balanced).sum()
    allowed *= np.abs(resultants[3:]).max() if component > 2 else 1.0
    left = inverse @ (-allowed * np.eye(6)[component])
    found = uneven.lift(balanced + 0.99 * left)
    modes = body.elastic_field.modes
    assert found == pytest.approx(modes @ (balanced + 0.99 * left), rel=1e-9, abs=1e-18)
    with pytest.raises(PretravelError, match="in equilibrium"):
        uneven.lift(balanced + 1.01 * left)
