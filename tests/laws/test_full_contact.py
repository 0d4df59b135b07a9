"""The condensed model against full nonlinear contact: elastic rods and balls, no Hertz."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import sparse

from pretravel.base.directions import from_angles
from pretravel.base.errors import ConvergenceError, DescriptionError
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import condense
from pretravel.design.fem.elasticity import rigid_motions
from pretravel.design.fem.interface_loads import (
    INTERFACE,
    SPRING_FORCE,
    TIP_FORCE,
    half_space_compliance,
    hertz_pressure,
)
from pretravel.design.fem.mesh import MeshSettings
from pretravel.design.fem.regions import PATCH
from pretravel.design.fem.seat_ball import CONTACT, ball_correction, ball_mesh
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance.base import TIP_ON_PART
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import loaded
from pretravel.prediction.materials import material
from pretravel.prediction.seats import seat_frame, seat_statics
from pretravel.six_seats.event import trigger_force
from pretravel.six_seats.uneven_seats import SEAT_NAMES
from tests.support import full_contact as full
from tests.support.coarse_models import coarse_model
from tests.support.full_contact import FullContact, contact_state, full_contact

pytestmark = pytest.mark.long  # meshes of whole probes

DIRECTIONS = from_angles(
    np.radians([90.0, 90.0, 50.0, 90.0, 20.0]), np.radians([0.0, 60.0, 20.0, 180.0, 100.0])
)


@pytest.mark.slow
def test_condensed_and_full_contact_agree_in_five_directions() -> None:
    """0.2 % of the tip's deflection from rest to 98 % of the trigger force, 1e-4 N in reactions.

    Both use the same mesh of the moving part, so that only the treatment of contact differs. At
    the trigger itself the contact of a seat vanishes, and no mesh resolves it.
    """
    probe = load_probe("omp40-2")
    statics = seat_statics(probe)
    contact = full_contact(probe, 0.042, 0.0045, MeshSettings(refinement=0.5))
    reduced = condense(contact.model)
    reduced = replace(reduced, ball_correction=ball_correction(probe))
    model = FiniteElements(reduced)
    rest = contact_state(contact, probe.preload, np.zeros(3))
    assert rest.reactions == pytest.approx(statics.rest_reactions, abs=1e-4)
    assert rest.bearing.min() > 15  # the contacts are resolved, and lie inside their zones
    assert rest.bearing.max() < 0.9 * np.bincount(contact.seat_of).min()
    force, _ = trigger_force(statics.rest_reactions, statics.unit_reactions(DIRECTIONS))
    force = 0.98 * force
    loading = loaded(probe, statics, DIRECTIONS, force, material("steel"))
    parts = model.displacements(loading)
    ours = sum(vector for name, vector in parts.items() if name != TIP_ON_PART)
    for row, direction in enumerate(DIRECTIONS):
        state = contact_state(contact, probe.preload, force[row] * direction)
        reactions = loading.reactions[row]
        assert state.reactions == pytest.approx(reactions, abs=1e-4)
        full = state.tip - rest.tip
        assert np.linalg.norm(ours[row] - full) < 2e-3 * np.linalg.norm(full)


@cache
def coarse_contact() -> FullContact:
    """Few pressures on the patches of the coarse mesh, and bodies whose nodes give by 1 mm/N each.

    Statics do not depend on how bodies give; their elasticity takes most of the time.
    """
    probe = load_probe("omp40-2")
    zone = PATCH * probe.tripod.rod_radius
    ball = ball_mesh(probe.seats.ball_radius, 1.1 * zone, 0.5 * zone)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(full, "resolved_bodies", lambda *_: (coarse_model(), ball))
        patch.setattr(full, "free_body", lambda *_: lambda right: right)
        patch.setattr(full, "factorise", lambda *_: lambda right: right)
        return full_contact(probe, zone)


def test_unit_pressures_carry_the_areas_and_gaps_of_their_patches(omp40: Probe) -> None:
    """A pressure of one on a patch: pi a² of force along the normal, and the volume of its gap.

    The gap of a rod of radius R on a ball of radius r opens as v²/2R + (u² + v²)/2r. Within 3 %:
    the coarse mesh has few edges around a patch.
    """
    contact, frame = coarse_contact(), seat_frame(omp40)
    rod, ball = omp40.tripod.rod_radius, omp40.seats.ball_radius
    a = PATCH * rod
    contacts = frame.contacts(rod)
    for seat in range(6):
        own = contact.seat_of == seat
        assert contact.areas[own].sum() == pytest.approx(np.pi * a**2, rel=0.03)
        volume = np.pi * a**4 / 8.0 * (1.0 / rod + 2.0 / ball)
        assert contact.gaps[own].sum() == pytest.approx(volume, rel=0.06)
        resultant = contact.rigid_gaps[own].sum(axis=0)
        force = np.pi * a**2 * frame.normals[seat]
        assert resultant[:3] == pytest.approx(force, abs=0.03 * np.pi * a**2)
        # The middle of a patch is known to a small part of its radius.
        moment = np.cross(contacts[seat], force)
        assert resultant[3:] == pytest.approx(moment, abs=0.03 * np.linalg.norm(moment))


def test_flexibilities_are_products_of_the_loads_of_pressures_and_interface() -> None:
    """Of bodies whose nodes give by 1 mm/N: rods and balls take the same forces, so both alike."""
    contact, model = coarse_contact(), coarse_model()
    assert contact.interface_flexibility == pytest.approx(model.loads.T @ model.loads, abs=1e-12)
    motions = rigid_motions(model.mesh.points)
    assert contact.resultants == pytest.approx(motions.T @ model.loads, abs=1e-9)
    assert contact.compliance == pytest.approx(contact.compliance.T, rel=1e-12)
    coupled = contact.compliance[contact.seat_of[:, None] != contact.seat_of]
    assert not coupled.any()
    assert contact.interface_compliance.shape == (len(contact.gaps), len(INTERFACE))
    # A seat's own load and its pressures push on the same nodes, the same way.
    for seat in range(6):
        shares = contact.interface_compliance[contact.seat_of == seat, :6].sum(axis=0)
        assert shares.argmax() == seat
        assert np.all(np.delete(shares, seat) == pytest.approx(0.0, abs=1e-12))


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (0.1, 0.05, 0.02)])
def test_reactions_of_a_coarse_contact_are_statics(
    omp40: Probe, force: tuple[float, float, float]
) -> None:
    """Six seats are determined by statics; the middle of few pressures moves them by per cent."""
    state = contact_state(coarse_contact(), omp40.preload, force)
    wrenches = seat_frame(omp40).wrenches
    spring = [0.0, 0.0, -omp40.preload, 0.0, 0.0, 0.0]
    tip = [*force, *np.cross([0.0, 0.0, -omp40.lever], force)]
    reactions = np.linalg.solve(wrenches, -np.add(spring, tip))
    assert state.reactions == pytest.approx(reactions, rel=0.02)


def test_flexibility_is_that_of_a_dense_inverse_for_many_loads() -> None:
    """More loads than are solved together."""
    generator = np.random.default_rng(1)
    root = generator.standard_normal((30, 30))
    inverse = np.linalg.inv(root @ root.T + np.eye(30))
    loads = generator.standard_normal((30, full._AT_ONCE + 20))
    found = full._flexibility(lambda right: inverse @ right, sparse.csc_matrix(loads))
    assert found == pytest.approx(loads.T @ inverse @ loads, rel=1e-9, abs=1e-12)


def test_the_balls_give_as_the_ball_of_hertzs_law_does(omp40: Probe) -> None:
    """Under Hertz's pressure, for more loads than are solved together; seats do not couple."""
    radius = omp40.seats.ball_radius
    patch = PATCH * radius
    mesh = ball_mesh(radius, patch, 0.4 * patch)
    nodal = hertz_pressure(mesh, CONTACT, np.zeros(3), (np.eye(3)[0], np.eye(3)[1]), patch)
    sizes = 1.0 + np.arange(full._AT_ONCE + 2) / 8.0
    loads = [sparse.csc_matrix(np.outer(nodal, some)) for some in (sizes, 2.0 * sizes[:1])]
    found = full._ball_compliance(omp40, mesh, loads, "auto")
    unit = half_space_compliance(omp40.seats.material, patch) + ball_correction(omp40)
    assert found[:-1, :-1] == pytest.approx(unit * np.outer(sizes, sizes), rel=1e-9)
    assert found[-1, -1] == pytest.approx(4.0 * unit, rel=1e-9)
    assert not found[-1, :-1].any()


def test_points_lie_on_the_ball_where_the_shape_functions_put_them() -> None:
    mesh = ball_mesh(2.0, 0.3, 0.1)
    u, v = np.meshgrid(np.linspace(-0.13, 0.12, 7), np.linspace(-0.11, 0.13, 5))
    nodes, weights = full._on_ball(mesh, u, v)
    assert weights.sum(axis=-1) == pytest.approx(np.ones(u.shape))
    found = np.einsum("rck,rcki->rci", weights, mesh.points[nodes])
    # In the plane a triangle's sides are straight but for the slope of the ball: 0.1² * 0.2 / 32.
    assert np.abs(found[..., 0] - u).max() < 2e-4
    assert np.abs(found[..., 1] - v).max() < 2e-4
    assert found[..., 2] == pytest.approx(np.sqrt(4.0 - u**2 - v**2) - 2.0, abs=2e-4)
    with pytest.raises(DescriptionError, match="reaches beyond the balls"):
        full._on_ball(mesh, u + 0.4, v)


def _bed(stiffness: float, heights: list[float]) -> FullContact:
    """The seats of an OMP40-2, each with springs of different heights, on a rigid tripod."""
    probe = load_probe("omp40-2")
    wrench = seat_frame(probe).wrenches.T
    each = len(heights)
    areas = np.tile(np.linspace(1.0, 2.0, each), 6)
    rigid_gaps = areas[:, None] * np.repeat(wrench, each, axis=0)
    resultants = np.zeros((6, len(INTERFACE)))
    resultants[2, SPRING_FORCE] = -1.0
    resultants[:3, TIP_FORCE] = np.eye(3)
    resultants[3:, TIP_FORCE] = np.cross([0.0, 0.0, -probe.lever], np.eye(3)).T
    return FullContact(
        model=coarse_model(),
        seat_of=np.repeat(np.arange(6), each),
        areas=areas,
        gaps=areas * np.tile(heights, 6),
        compliance=np.diag(areas**2 / stiffness),
        interface_compliance=np.zeros((6 * each, len(INTERFACE))),
        interface_flexibility=np.zeros((len(INTERFACE), len(INTERFACE))),
        rigid_gaps=rigid_gaps,
        resultants=resultants,
    )


def test_springs_of_different_heights_close_one_after_the_other() -> None:
    """Preload P on six seats that push up by n: P / 6n each, and the springs that it reaches.

    With an approach d, springs of heights h carry k (d - h). Two of five are closed where
    d = (P / 6nk + sum of their h) / 2; the tip then sinks by d / n.
    """
    stiffness, heights = 50.0, [0.0, 1e-3, 4e-3, 8e-3, 20e-3]
    upwards = seat_frame(load_probe("omp40-2")).normals[0, 2]
    preload = 1.2 * upwards
    state = contact_state(_bed(stiffness, heights), preload, np.zeros(3))
    approach = (0.2 / stiffness + 1e-3) / 2
    assert 1e-3 < approach < 4e-3
    assert state.reactions == pytest.approx(np.full(6, 0.2), rel=1e-9)
    assert state.bearing.tolist() == [2] * 6
    assert state.tip == pytest.approx([0.0, 0.0, -approach / upwards], abs=1e-12)


def test_a_bed_of_springs_is_in_balance_under_a_force_on_the_tip() -> None:
    """Two equal springs a seat are a linear tripod: statics, and a tip as soft as they say."""
    bed = _bed(50.0, [0.0, 1e-9, 1.0, 1.0, 1.0])
    external = np.zeros(len(INTERFACE))
    external[SPRING_FORCE], external[TIP_FORCE] = 1.2, [0.02, -0.01, 0.03]
    state = contact_state(bed, 1.2, external[TIP_FORCE])
    wrench = bed.resultants @ external
    normals = seat_frame(load_probe("omp40-2")).wrenches
    assert state.reactions == pytest.approx(np.linalg.solve(normals, -wrench), rel=1e-9)
    motion = np.linalg.solve(100.0 * normals @ normals.T, wrench)
    assert state.tip == pytest.approx((bed.resultants.T @ motion)[TIP_FORCE], rel=1e-6)


def test_elastic_bodies_add_to_the_motion_of_a_bed_of_springs() -> None:
    """Interface loads that open gaps and move the tip: gaps stay shut, and the tip adds both."""
    bed = _bed(50.0, [0.0, 1e-9, 1.0, 1.0, 1.0])
    generator = np.random.default_rng(4)
    external = np.zeros(len(INTERFACE))
    external[SPRING_FORCE], external[TIP_FORCE] = 1.2, [0.02, -0.01, 0.03]
    opening = 1e-4 * generator.standard_normal((6, len(INTERFACE)))
    flexibility = 1e-3 * np.diag(1.0 + np.arange(len(INTERFACE)))
    soft = replace(
        bed,
        interface_compliance=bed.areas[:, None] * np.repeat(opening, 5, axis=0),
        interface_flexibility=flexibility,
    )
    plain = contact_state(bed, 1.2, external[TIP_FORCE])
    state = contact_state(soft, 1.2, external[TIP_FORCE])
    assert state.reactions == pytest.approx(plain.reactions, rel=1e-9)  # statics
    normals = seat_frame(load_probe("omp40-2")).wrenches
    lifted = -np.linalg.solve(normals.T, opening @ external)
    expected = (
        plain.tip
        + (flexibility @ external + opening.T @ state.reactions + bed.resultants.T @ lifted)[
            TIP_FORCE
        ]
    )
    assert state.tip == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("preload", "force", "seats"),
    [
        (-1.2, (0.0, 0.0, 0.0), ", ".join(SEAT_NAMES)),
        (1.2, (0.0, 0.0, 2.0), ", ".join(SEAT_NAMES)),
    ],
)
def test_a_tripod_that_lifts_off_is_refused(
    preload: float, force: tuple[float, float, float], seats: str
) -> None:
    """Pulled up by the spring, or at the tip by more than the spring presses."""
    bed = _bed(50.0, [0.0, 1e-3, 4e-3, 8e-3, 20e-3])
    with pytest.raises(ConvergenceError, match=f"no pressure acts at seat {seats}: .* lower the"):
        contact_state(bed, preload, force)


def test_a_tripod_that_tilts_is_refused_above_the_trigger_force(omp40: Probe) -> None:
    """A force sideways: statics say at which the first seat is free, and which one it is."""
    bed = _bed(50.0, [0.0, 1e-9, 1.0, 1.0, 1.0])
    statics = seat_statics(omp40)
    direction = np.array([[0.8, 0.6, 0.0]])
    force, first = trigger_force(statics.rest_reactions, statics.unit_reactions(direction))
    below = contact_state(bed, omp40.preload, 0.999 * force[0] * direction[0])
    assert below.bearing.min() > 0
    assert below.reactions.argmin() == first[0]
    with pytest.raises(ConvergenceError, match=f"at seat .*{SEAT_NAMES[first[0]]}"):
        contact_state(bed, omp40.preload, 1.001 * force[0] * direction[0])


def test_a_step_file_has_no_full_contact(omp40: Probe) -> None:
    with pytest.raises(DescriptionError, match="not by a STEP file"):
        full_contact(replace(omp40, step=object()), 0.04)  # type: ignore[arg-type]
