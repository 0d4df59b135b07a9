"""The finite-element core against laws that hold for any mesh, and against closed forms."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import sparse

from pretravel.base.directions import from_angles
from pretravel.design.fem import seat_ball
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import ReducedModel, condense
from pretravel.design.fem.elastic_field import field_at_trigger, stress_by_direction
from pretravel.design.fem.elasticity import (
    FiniteElementModel,
    finite_element_model,
    rigid_motions,
    stress_of,
)
from pretravel.design.fem.finite_element_mesh import (
    FiniteElementMesh,
    element_unknowns,
    mesh_quality,
)
from pretravel.design.fem.geometry import probe_solids
from pretravel.design.fem.interface_loads import (
    INTERFACE,
    SEATS,
    SPRING_FORCE,
    TANGENTIAL,
    TIP_FORCE,
)
from pretravel.design.fem.linear_solvers import SOLVERS, factorise
from pretravel.design.fem.mesh import MeshSettings, mesh_probe, mesh_solids
from pretravel.design.fem.quadrature import quadrature
from pretravel.design.fem.seat_ball import ball_correction, ball_mesh
from pretravel.prediction.beam import axial_compliance, bending_compliance, shear_compliance
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import material
from pretravel.prediction.seats import seat_frame, seat_statics
from pretravel.prediction.trigger import predict
from pretravel.six_seats.event import trigger_force
from tests.support.coarse_models import COARSE, coarse_model, coarse_reduced

pytestmark = pytest.mark.long  # meshes of whole probes

DIRECTIONS = from_angles(
    np.radians([90.0, 90.0, 50.0, 20.0, 70.0]), np.radians([0.0, 60.0, 20.0, 100.0, 213.0])
)

SPRING = 1e5
"""Of each seat. Any value gives the same reactions. [N/mm]"""


def whole(model: FiniteElementModel) -> sparse.csr_matrix:
    return model.stiffness + sparse.triu(model.stiffness, 1).T


@cache
def on_six_springs() -> np.ndarray:
    """Displacements of the whole mesh on springs at the seats, under three forces at the tip."""
    model = coarse_model()
    seats = sparse.csr_matrix(model.loads[:, SEATS])
    held = sparse.triu(whole(model) + SPRING * (seats @ seats.T)).tocsr()
    return factorise(held)(model.loads[:, TIP_FORCE])


def tip_motion(reduced: ReducedModel, forces: np.ndarray) -> np.ndarray:
    """Deflection of the tip, with the seats held in place."""
    moved = reduced.flexibility @ forces
    rigid = -np.linalg.solve(reduced.resultants[:, SEATS].T, moved[SEATS])
    return (moved + reduced.resultants.T @ rigid)[TIP_FORCE]


@pytest.mark.slow  # the whole stiffness matrix; each element by itself is below
def test_six_rigid_motions_cost_no_energy() -> None:
    model = coarse_model()
    stiffness, motions = whole(model), rigid_motions(model.mesh.points)
    forces = stiffness @ motions
    # Compared with the forces of a motion of the same size that is not rigid.
    size = np.abs(stiffness).max() * np.abs(motions).max(axis=0)
    assert np.all(np.abs(forces).max(axis=0) < 1e-11 * size)


def test_only_rigid_motions_cost_no_energy() -> None:
    """Each element has six zero eigenvalues and twenty-four positive ones."""
    elements = coarse_model().elements[::97]
    values = np.linalg.eigvalsh(elements)
    assert np.all(np.abs(values[:, :6]) < 1e-9 * values[:, -1:])
    assert np.all(values[:, 6] > 1e-6 * values[:, -1])


def test_patch_uniform_strain_is_met_exactly() -> None:
    """Law of a bar: u = strain * x in one material gives the stresses E * strain everywhere."""
    mesh = coarse_model().mesh
    steel = dict.fromkeys(mesh.region_names, material("steel"))
    strain = 1e-4
    nu = material("steel").poissons_ratio
    pulled = mesh.points * strain * np.array([-nu, -nu, 1.0])  # uniaxial stress along z
    stress = stress_of(mesh, steel)(pulled)
    assert stress == pytest.approx(strain * material("steel").youngs_modulus, rel=1e-9)


def test_volume_is_that_of_the_solids() -> None:
    """A quadratic edge over an angle of 2a, with its three nodes on a circle, loses a⁴/30 of the
    area, a straight one 2a²/3. Of the coarse mesh's edges of 22° on the hub that is 5e-5 instead
    of 2 %, and of its edges of 45° on the ball, curved two ways, 1e-3 instead of 10 %."""
    mesh = coarse_model().mesh
    weights = quadrature(mesh).weights
    hub = load_probe("omp40-2").hub
    assert hub is not None
    disc = weights[mesh.regions == mesh.region_names.index("hub")].sum()
    assert disc == pytest.approx(np.pi * hub.radius**2 * hub.height, rel=1e-4)
    ball = weights[mesh.regions == mesh.region_names.index("tip")].sum()
    assert ball == pytest.approx(4.0 / 3.0 * np.pi * 3.0**3, rel=1.2e-3)


def test_interface_loads_are_exact_in_force_and_moment(omp40: Probe) -> None:
    resultants = coarse_reduced().resultants
    statics = seat_statics(omp40)
    assert resultants[:, SEATS] == pytest.approx(statics.wrenches, abs=1e-9)
    lever = np.concatenate([np.eye(3), np.cross(statics.tip, np.eye(3)).T])
    assert resultants[:, TIP_FORCE] == pytest.approx(lever, abs=1e-9)
    assert resultants[:, SPRING_FORCE] == pytest.approx([0, 0, -1, 0, 0, 0], abs=1e-9)
    # Friction acts at the contacts, on the surface of the rods, not on their axes.
    assert np.linalg.norm(resultants[:3, TANGENTIAL], axis=0) == pytest.approx(1.0, abs=1e-9)


def test_flexibility_is_symmetric_and_positive(omp40: Probe) -> None:
    reduced = coarse_reduced()
    assert reduced.flexibility == pytest.approx(reduced.flexibility.T, abs=1e-15)
    assert np.linalg.eigvalsh(reduced.flexibility).min() > -1e-15
    parts = sum(reduced.flexibility_by_region.values())
    assert parts == pytest.approx(reduced.flexibility, abs=1e-15)


def test_reactions_of_a_direct_solution_are_statics(omp40: Probe) -> None:
    """Without the reduced model: the whole mesh on six stiff springs under a tip force."""
    statics = seat_statics(omp40)
    reactions = -SPRING * (coarse_model().loads[:, SEATS].T @ on_six_springs()).T
    assert reactions == pytest.approx(statics.unit_reactions(np.eye(3)), rel=1e-6, abs=1e-6)


def test_condensed_and_direct_solutions_agree(omp40: Probe) -> None:
    """The condensed model has the same tip deflection as the whole mesh, to rounding."""
    statics = seat_statics(omp40)
    direct = coarse_model().loads[:, TIP_FORCE].T @ on_six_springs()
    reduced = coarse_reduced()
    forces = np.zeros((3, len(INTERFACE)))
    forces[:, SEATS], forces[:, TIP_FORCE] = statics.unit_reactions(np.eye(3)), np.eye(3)
    for axis in range(3):
        elastic = tip_motion(reduced, forces[axis])
        sunk = statics.tip_displacement(forces[axis : axis + 1, SEATS] / SPRING)[0]
        assert elastic + sunk == pytest.approx(direct[axis], rel=1e-6, abs=1e-10)


@pytest.mark.parametrize("solver", list(SOLVERS))
def test_solvers_agree(solver: str) -> None:
    if solver == "cholmod":
        pytest.importorskip("cvxopt")
    if solver == "pardiso":
        pytest.importorskip("pypardiso")
    rng = np.random.default_rng(1)
    random = sparse.random(400, 400, 0.02, random_state=2, format="csr")
    matrix = (random @ random.T + 2.0 * sparse.eye(400)).tocsr()
    right = rng.normal(size=(400, 3))
    answer = factorise(sparse.triu(matrix).tocsr(), solver)(right)
    assert matrix @ answer == pytest.approx(right, abs=1e-9)


def test_stylus_is_a_timoshenko_beam(omp40: Probe) -> None:
    """A straight stem has the bending and shear of a beam and the axial stiffness of a bar.

    The remaining difference is due to the socket of the tip (the stem ends at the ball, 2 mm
    before its centre, where the bending moment is almost zero) and to the local deformation of
    the clamped end.
    """
    stem = replace(omp40.stylus[1], length=50.0)
    probe = replace(omp40, stylus=(stem,))
    # The 2 mm of the socket are ball material; they are 4 % of the bar.
    solids, mesh = mesh_probe(probe, COARSE)
    reduced = condense(finite_element_model(probe, solids, mesh))
    statics = seat_statics(probe)
    forces = np.zeros((3, len(INTERFACE)))
    forces[:, SEATS], forces[:, TIP_FORCE] = statics.unit_reactions(np.eye(3)), np.eye(3)
    part = reduced.flexibility_by_region["stylus 1"]
    lateral = forces[0] @ part @ forces[0]
    beam = bending_compliance([stem]) + shear_compliance([stem])
    assert lateral == pytest.approx(beam, rel=0.01)
    assert lateral == pytest.approx(forces[1] @ part @ forces[1], rel=1e-3)
    axial = forces[2] @ (part + reduced.flexibility_by_region["tip"]) @ forces[2]
    assert axial == pytest.approx(axial_compliance([stem]), rel=0.04)


def test_trigger_force_and_seat_are_statics_for_any_elasticity(omp40: Probe) -> None:
    statics = seat_statics(omp40)
    force, seat = trigger_force(statics.rest_reactions, statics.unit_reactions(DIRECTIONS))
    trigger = predict(omp40, DIRECTIONS, FiniteElements(coarse_reduced()))
    assert trigger.force == pytest.approx(force, rel=1e-12)
    assert trigger.seat.tolist() == seat.tolist()
    assert trigger.model == "fem"


def test_threefold_symmetry(omp40: Probe) -> None:
    """A rotation by 120° changes only the mesh, which is not symmetric."""
    model = FiniteElements(coarse_reduced())
    azimuth = np.radians(np.arange(0.0, 120.0, 17.0))
    first = predict(omp40, from_angles(np.radians(75.0), azimuth), model)
    for turn in (2.0, 4.0):
        turned = predict(omp40, from_angles(np.radians(75.0), azimuth + turn * np.pi / 3), model)
        assert turned.sensing_distance == pytest.approx(first.sensing_distance, rel=3e-3)
        assert turned.force == pytest.approx(first.force, rel=1e-9)


def test_shares_are_energies_so_none_is_negative_along_the_force(omp40: Probe) -> None:
    trigger = predict(omp40, DIRECTIONS, FiniteElements(coarse_reduced()))
    for name in ("hub", "holder", "rods", "stylus", "tip"):
        assert np.all(trigger.shares[name] > 0.0)
    assert sum(trigger.shares.values()) == pytest.approx(trigger.pretravel, rel=1e-12)


def test_rigid_seats_leave_linear_elasticity(omp40: Probe) -> None:
    """Twice the preload gives twice the deflection, and less than twice with Hertz seats."""
    model = FiniteElements(coarse_reduced())
    for contact, law in (("rigid", 2.0), ("hertz", None)):
        probe = replace(omp40, seats=replace(omp40.seats, contact=contact))
        once = predict(probe, DIRECTIONS, model).sensing_distance
        twice = predict(replace(probe, preload=2.0 * probe.preload), DIRECTIONS, model)
        ratio = twice.sensing_distance / once
        if law:
            assert ratio == pytest.approx(law, rel=1e-9)
        else:
            assert np.all((ratio > 1.6) & (ratio < 1.95))


def test_lift_gives_the_reduced_answer_back(omp40: Probe) -> None:
    """Lifted displacements, averaged with the weights of the loads, are the reduced ones."""
    model, reduced, statics = coarse_model(), coarse_reduced(), seat_statics(omp40)
    forces = np.zeros(len(INTERFACE))
    forces[SEATS], forces[6] = statics.unit_reactions(np.eye(3)[:1])[0], 1.0
    lifted = reduced.lift(forces)
    assert model.loads.T @ lifted.ravel() == pytest.approx(
        reduced.flexibility @ forces, rel=1e-9, abs=1e-12
    )
    unknowns = element_unknowns(model.mesh)
    local = lifted.ravel()[unknowns]
    energy = np.einsum("ea,eab,eb->", local, model.elements, local)
    assert energy == pytest.approx(forces @ reduced.flexibility @ forces, rel=1e-9)


def test_the_field_at_the_trigger_is_the_prediction(omp40: Probe) -> None:
    """The mean displacement of the tip, lifted and closed on the seats, is that of `predict`.
    At rest the spring stresses the tripod but not the stylus."""
    field = field_at_trigger(omp40, DIRECTIONS[2], coarse_reduced())
    trigger = predict(omp40, DIRECTIONS[2:3], FiniteElements(coarse_reduced()))
    tip = coarse_model().loads[:, TIP_FORCE].T @ field.displacement.ravel()
    assert tip == pytest.approx(trigger.deflection[0], rel=1e-9, abs=1e-12)
    mesh = field.elastic.mesh
    part = np.array(mesh.region_names)[mesh.regions]
    assert field.rest_stress[part == "stylus 2"].max() < 1e-3 * field.rest_stress.max()
    assert field.stress[part == "stylus 2"].max() > 0.05 * field.stress.max()


def test_the_highest_stress_of_each_part_is_that_of_the_field(omp40: Probe) -> None:
    """Direction by direction; everything but the seats' approach is linear in the preload."""
    found = stress_by_direction(omp40, DIRECTIONS, coarse_reduced())
    field = field_at_trigger(omp40, DIRECTIONS[3], coarse_reduced())
    once = stress_by_direction(omp40, DIRECTIONS[3:4], coarse_reduced(), field)
    assert once.highest[0] == pytest.approx(found.highest[3], rel=1e-9)  # of another lift
    assert once.rest == pytest.approx(found.rest, rel=1e-9)
    mesh = field.elastic.mesh
    centers = mesh.points[mesh.elements].mean(axis=1)
    for index in range(len(found.parts)):
        own = mesh.regions == index
        worst = np.flatnonzero(own)[np.argmax(field.stress[own])]
        assert found.highest[3, index] == pytest.approx(field.stress[worst], rel=1e-12)
        assert found.places[3, index] == pytest.approx(centers[worst])
        assert found.rest[index] == pytest.approx(field.rest_stress[own].max(), rel=1e-12)
    twice = replace(omp40, preload=2.0 * omp40.preload)
    stronger = stress_by_direction(twice, DIRECTIONS, coarse_reduced())
    assert stronger.highest == pytest.approx(2.0 * found.highest, rel=1e-6)
    assert stronger.rest == pytest.approx(2.0 * found.rest, rel=1e-6)


def test_the_stylus_is_bent_as_a_beam(omp40: Probe) -> None:
    """Force × lever / section modulus, half-way down the stem.

    The mean over an element lies below the stress of the outer fibre.
    """
    field = field_at_trigger(omp40, DIRECTIONS[0], coarse_reduced())
    mesh = field.elastic.mesh
    stem = omp40.stylus[-1]
    tip = -omp40.lever
    level = tip + 0.5 * stem.length
    centers = mesh.points[mesh.elements].mean(axis=1)
    near = mesh.regions == mesh.region_names.index("stylus 2")
    near &= abs(centers[:, 2] - level) < 3.0
    lever = centers[near, 2] - tip
    outer = 32.0 * field.trigger.force[0] * lever / (np.pi * stem.diameter**3)
    share = field.stress[near] / outer
    assert 0.5 < share.max() < 1.05


def test_patches_carry_hertzs_pressure(omp40: Probe) -> None:
    """Its mean square radius is 2/5 of the patch's (for a uniform pressure it would be 1/2)."""
    model, frame = coarse_model(), seat_frame(omp40)
    patch = COARSE.patch_radius * omp40.tripod.rod_radius
    contact = frame.contacts(omp40.tripod.rod_radius)[3]
    nodal = model.loads.reshape(-1, 3, len(INTERFACE))[:, :, 3] @ frame.normals[3]
    away = model.mesh.points - contact
    square = (away @ frame.along[3]) ** 2 + (away @ frame.around[3]) ** 2
    assert nodal.sum() == pytest.approx(1.0, rel=1e-9)
    assert nodal @ square == pytest.approx(0.4 * patch**2, rel=0.02)


def test_a_ball_gives_less_than_a_half_space(omp40: Probe) -> None:
    """A ball that is held by its lower half lacks the material below one to two radii. The
    half-space's displacement on the axis is (1 + nu) (3 - 2 nu) / (2 pi E z) at depth z."""
    found = ball_correction(omp40)
    carbide, radius = omp40.seats.material, omp40.seats.ball_radius
    nu = carbide.poissons_ratio
    missing = (1.0 + nu) * (3.0 - 2.0 * nu) / (2.0 * np.pi * carbide.youngs_modulus * radius)
    assert 0.4 * missing < -found < missing
    soft = replace(carbide, youngs_modulus=0.5 * carbide.youngs_modulus)
    softer = replace(omp40, seats=replace(omp40.seats, material=soft))
    assert ball_correction(softer) == pytest.approx(2.0 * found, rel=1e-6)


def test_the_ball_is_meshed_once_for_all_styli(
    omp40: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    meshed: list[float] = []

    def counted(radius: float, patch: float, element: float) -> FiniteElementMesh:
        meshed.append(radius)
        return ball_mesh(radius, patch, element)

    monkeypatch.setattr(seat_ball, "ball_mesh", counted)
    seat_ball._excess_over_half_space.cache_clear()
    short = replace(omp40, stylus=(omp40.stylus[0], replace(omp40.stylus[1], length=20.0)))
    assert ball_correction(short) == ball_correction(omp40)
    assert meshed == [3.5]
    ball_correction(replace(omp40, seats=replace(omp40.seats, ball_radius=3.0)))
    assert meshed == [3.5, 3.0]


def test_quality_of_a_regular_tetrahedron_is_one() -> None:
    regular = np.array([[[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]], dtype=float)
    assert mesh_quality(regular) == pytest.approx([1.0])
    flat = regular * [1.0, 1.0, 0.1]
    assert mesh_quality(flat)[0] < 0.35


def test_rods_and_seats_share_alike_for_any_patch(omp40: Probe) -> None:
    """Rigid seats do not deform: the half-space under the patch, part of Hertz, is removed."""
    rigid = replace(omp40, seats=replace(omp40.seats, contact="rigid"))
    reduced = replace(coarse_reduced(), ball_correction=0.0)
    assert np.abs(predict(rigid, DIRECTIONS, FiniteElements(reduced)).shares["seats"]).max() == 0.0
    analytic = predict(omp40, DIRECTIONS, "analytic").shares["seats"]
    elastic = predict(omp40, DIRECTIONS, FiniteElements(reduced)).shares["seats"]
    assert elastic == pytest.approx(analytic, rel=1e-9)


def test_a_push_along_the_axis_is_in_balance(omp40: Probe) -> None:
    """All six seats open together, at the preload; only rounding remains."""
    field = field_at_trigger(omp40, [0.0, 0.0, 1.0], coarse_reduced())
    assert field.trigger.force[0] == pytest.approx(omp40.preload, rel=1e-9)
    assert len(field.opened) == 6


def test_forces_out_of_balance_are_refused() -> None:
    forces = np.zeros(len(INTERFACE))
    forces[6] = 1.0
    with pytest.raises(ValueError, match="equilibrium"):
        coarse_reduced().lift(forces)


@pytest.mark.slow
def test_patch_radius_does_not_matter(omp40: Probe) -> None:
    """The half-space part is subtracted: 6 or 12 times the contact size gives the same."""
    found = []
    for patch_radius in (0.09, 0.18):
        solids, mesh = mesh_probe(omp40, replace(COARSE, patch_radius=patch_radius))
        assert solids.patch_radius == patch_radius * omp40.tripod.rod_radius
        reduced = condense(finite_element_model(omp40, solids, mesh))
        found.append(predict(omp40, DIRECTIONS, FiniteElements(reduced)).sensing_distance)
    # Meshes differ too, by about 0.1 %.
    assert found[0] == pytest.approx(found[1], rel=2e-3)


@pytest.mark.slow
def test_sensing_distance_converges(omp40: Probe) -> None:
    """Five meshes converge monotonically; the extrapolated error of the default is below 0.5 %."""
    refinements = [0.5, 0.7071, 1.0, 1.4142, 2.0]
    values = []
    for refinement in refinements:
        settings = MeshSettings(refinement=refinement)
        solids = probe_solids(omp40, settings.patch_radius * omp40.tripod.rod_radius)
        mesh = mesh_solids(solids, settings)
        reduced = condense(finite_element_model(omp40, solids, mesh))
        values.append(predict(omp40, DIRECTIONS[:2], FiniteElements(reduced)).sensing_distance)
    series = np.array(values)
    assert np.all(np.diff(series, axis=0) > 0.0)
    coarse, middle, fine = series[0], series[2], series[4]
    rate = np.log2((middle - coarse) / (fine - middle))
    limit = fine + (fine - middle) / (2.0**rate - 1.0)
    assert np.all(rate > 0.5)  # re-entrant edges: 0.5 to 1, not the 4 of smooth solutions
    assert np.all(np.abs(limit - middle) / limit < 0.005)
