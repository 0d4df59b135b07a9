"""Full nonlinear contact on resolved meshes: slow, used to check the condensed model.

The elements of rods and of six elastic balls are a fraction of the contact ellipses; Hertz's
law is not used. Contact pressures are continuous and linear over the rods' triangles, gaps
are weighted by them (a mortar method), and an active set determines which of them carry load.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import sparse

from pretravel.base.arrays import FloatArray, IntArray, frozen
from pretravel.base.errors import ConvergenceError, DescriptionError
from pretravel.design.fem.condensation import free_body
from pretravel.design.fem.elasticity import (
    FiniteElementModel,
    element_stiffness,
    finite_element_model,
    rigid_motions,
    upper_stiffness,
)
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.geometry import probe_solids
from pretravel.design.fem.interface_loads import INTERFACE, SPRING_FORCE, TIP_FORCE
from pretravel.design.fem.linear_solvers import Solve, factorise
from pretravel.design.fem.mesh import MeshSettings, mesh_solids
from pretravel.design.fem.quadrature import face_quadrature, triangle_shapes
from pretravel.design.fem.regions import seat_face
from pretravel.design.fem.seat_ball import CONTACT, ball_held, ball_mesh
from pretravel.prediction.description import Probe
from pretravel.prediction.seats import seat_frame
from pretravel.six_seats.uneven_seats import SEAT_NAMES, SeatFrame

log = logging.getLogger(__name__)

_AT_ONCE = 96  # right-hand sides solved together
_ROUNDS = 100


@dataclass(frozen=True, eq=False)
class FullContact:
    """The data of the active-set method.

    Attributes
    ----------
    model : FiniteElementModel
        The moving part, resolved at the seats.
    seat_of : (m,) int
        Seat of each pressure.
    areas : (m,) float
        Force of a unit of each pressure. [mm²]
    gaps : (m,) float
        Weighted by the pressures, undeformed. [mm³]
    compliance : (m, m) float
        Weighted gap by pressure, moving part and balls. [mm³/MPa]
    interface_compliance : (m, 22) float
        Weighted gap by interface force. [mm³/N]
    interface_flexibility : (22, 22) float
        [mm/N]
    rigid_gaps : (m, 6) float
        Weighted gap by rigid motion; transposed, resultants of the pressures.
    resultants : (6, 22) float
    """

    model: FiniteElementModel
    seat_of: IntArray
    areas: FloatArray
    gaps: FloatArray
    compliance: FloatArray
    interface_compliance: FloatArray
    interface_flexibility: FloatArray
    rigid_gaps: FloatArray
    resultants: FloatArray


def full_contact(
    probe: Probe,
    zone: float,
    element: float = 0.006,
    settings: MeshSettings | None = None,
    solver: str = "auto",
) -> FullContact:
    """Mesh, factorise and condense onto the pressures of the contact zones.

    Parameters
    ----------
    probe : Probe
        Described by dimensions.
    zone : float
        Radius of the patches in which contact can occur; 1.3 times the longest
        half-axis of the contact ellipses is enough. [mm]
    element : float
        Element size in the zones. [mm]
    settings : MeshSettings, optional
        For the rest of the mesh.
    """
    if probe.step is not None:
        raise DescriptionError(
            "the full contact model needs a probe described by dimensions, not by a STEP file"
        )
    model, ball = resolved_bodies(probe, zone, element, settings)
    mesh, frame = model.mesh, seat_frame(probe)
    loads, ball_loads, gaps, seats = [], [], [], []
    for seat in range(6):
        on_rod, on_ball, gap = _pressures(probe, frame, seat, mesh, ball)
        loads.append(on_rod)
        ball_loads.append(on_ball)
        gaps.append(gap)
        seats.append(np.full(len(gap), seat))
    pressures = sparse.hstack(loads, format="csc")
    log.info("%d unknowns, %d pressures", mesh.unknowns, pressures.shape[1])
    everything = sparse.hstack([sparse.csc_matrix(model.loads), pressures], format="csc")
    flexibility = _flexibility(free_body(model, solver), everything)
    size = len(INTERFACE)
    compliance = flexibility[size:, size:] + _ball_compliance(probe, ball, ball_loads, solver)
    motions = rigid_motions(mesh.points)
    seat_of = np.concatenate(seats)
    return FullContact(
        model=model,
        seat_of=seat_of,
        areas=frozen(np.einsum("ji,ji->j", pressures.T @ motions[:, :3], frame.normals[seat_of])),
        gaps=frozen(np.concatenate(gaps)),
        compliance=frozen(compliance),
        interface_compliance=frozen(flexibility[size:, :size]),
        interface_flexibility=frozen(flexibility[:size, :size]),
        rigid_gaps=frozen(pressures.T @ motions),
        resultants=frozen(motions.T @ model.loads),
    )


def resolved_bodies(
    probe: Probe, zone: float, element: float, settings: MeshSettings | None = None
) -> tuple[FiniteElementModel, FiniteElementMesh]:
    """The moving part and one ball, fine at the contact; parameters as in `full_contact`.

    The ball lies below the origin and is touched there from above: its x, y, z are a
    seat's ``along``, ``around`` and ``normals``.
    """
    base = settings or MeshSettings()
    fine = replace(
        base,
        patch_radius=zone / probe.tripod.rod_radius,
        patch=base.refinement * element / zone,
    )
    solids = probe_solids(probe, zone)
    model = finite_element_model(probe, solids, mesh_solids(solids, fine))
    return model, ball_mesh(probe.seats.ball_radius, 1.1 * zone, element)


def _flexibility(solve: Solve, loads: sparse.csc_matrix) -> FloatArray:
    """loads^T K+ loads, in blocks that fit into memory."""
    result = np.empty(2 * (loads.shape[1],))
    for first in range(0, loads.shape[1], _AT_ONCE):
        block = slice(first, first + _AT_ONCE)
        result[:, block] = loads.T @ solve(loads[:, block].toarray())
    return np.asarray(0.5 * (result + result.T))


def _pressures(
    probe: Probe, frame: SeatFrame, seat: int, mesh: FiniteElementMesh, ball: FiniteElementMesh
) -> tuple[sparse.csc_matrix, sparse.csc_matrix, FloatArray]:
    """Nodal forces of each unit pressure on rod and ball, and its weighted gap."""
    points = face_quadrature(mesh, seat_face(seat))
    rod, radius = probe.tripod.rod_radius, probe.seats.ball_radius
    away = points.positions - frame.contacts(rod)[seat]
    u, v = away @ frame.along[seat], away @ frame.around[seat]
    projected = np.abs(points.normals @ frame.normals[seat])
    opening = (rod - np.sqrt(rod**2 - v**2)) + (radius - np.sqrt(radius**2 - u**2 - v**2))
    # Linear functions of the corners, from the quadratic ones.
    linear = points.shapes[:, :3].copy()
    for place, pair in enumerate(((0, 1), (1, 2), (0, 2)), start=3):
        linear[:, pair] += 0.5 * points.shapes[:, place, None]
    vertices = np.unique(points.nodes[:, :3])
    where, weights = _on_ball(ball, u, v)
    rod_entries: list[tuple[IntArray, IntArray, FloatArray]] = []
    ball_entries: list[tuple[IntArray, IntArray, FloatArray]] = []
    gap = np.zeros(len(vertices))
    for a in range(3):
        column = np.searchsorted(vertices, points.nodes[:, a])
        density = linear[:, a] * projected
        np.add.at(gap, column, np.sum(density * opening, axis=1))
        columns = np.broadcast_to(column[:, None], points.nodes.shape)
        rod_entries.append((points.nodes, columns, density @ points.shapes))
        columns = np.broadcast_to(column[:, None, None], where.shape)
        ball_entries.append((where, columns, density[:, :, None] * weights))
    on_rod = _gathered(rod_entries, (len(mesh.points), len(vertices)))
    on_ball = _gathered(ball_entries, (len(ball.points), len(vertices)))
    pushed = sparse.kron(on_rod, frame.normals[seat][:, None], format="csc")
    return pushed, on_ball, gap


def _gathered(
    entries: list[tuple[IntArray, IntArray, FloatArray]], shape: tuple[int, int]
) -> sparse.csc_matrix:
    rows, columns, values = (
        np.concatenate([np.ravel(entry[i]) for entry in entries]) for i in range(3)
    )
    return sparse.csc_matrix((values, (rows, columns)), shape=shape)


def _on_ball(ball: FiniteElementMesh, u: FloatArray, v: FloatArray) -> tuple[IntArray, FloatArray]:
    """Ball nodes above which points lie, with their quadratic shape functions, (e, k, 6) each."""
    six = ball.faces[CONTACT]
    corners = six[:, :3]
    origin = ball.points[corners[:, 0], :2]
    sides = np.stack([ball.points[corners[:, i], :2] - origin for i in (1, 2)], axis=2)
    points = np.stack([u.ravel(), v.ravel()], axis=1)
    # Barycentric coordinates in every triangle; a point lies in the one where none is negative.
    local = np.einsum("tij,ptj->pti", np.linalg.inv(sides), points[:, None] - origin)
    bary = np.concatenate([1.0 - local.sum(axis=2, keepdims=True), local], axis=2)
    found = np.argmax(bary.min(axis=2), axis=1)
    own = bary[np.arange(len(points)), found]
    if own.min() < -0.05:
        raise DescriptionError("the rods' contact zone reaches beyond the balls'")
    shapes = triangle_shapes(own[:, 1], own[:, 2])[0]
    return six[found].reshape(*u.shape, 6), shapes.reshape(*u.shape, 6)


def _ball_compliance(
    probe: Probe, ball: FiniteElementMesh, loads: list[sparse.csc_matrix], solver: str
) -> FloatArray:
    """Weighted indentation of the balls by pressure: one factorisation for all six."""
    stiffness = upper_stiffness(ball, element_stiffness(ball, {"ball": probe.seats.material}))
    fixed = ball_held(probe.seats.ball_radius, ball)
    free = np.setdiff1d(np.arange(ball.unknowns), (3 * fixed[:, None] + np.arange(3)).ravel())
    solve = factorise(stiffness[free][:, free].tocsr(), solver)
    blocks = []
    for nodal in loads:
        vertical = np.zeros((ball.unknowns, nodal.shape[1]))
        vertical[2::3] = nodal.toarray()
        block = np.empty(2 * (nodal.shape[1],))
        for first in range(0, nodal.shape[1], _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            block[:, part] = vertical[free].T @ solve(vertical[free][:, part])
        blocks.append(0.5 * (block + block.T))
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*blocks))


@dataclass(frozen=True, eq=False)
class ContactState:
    """Equilibrium of the tripod under a force on the tip.

    Attributes
    ----------
    reactions : (6,) float
        [N]
    tip : (3,) float
        Displacement of the tip against the undeformed, unloaded state. [mm]
    bearing : (6,) int
        Number of pressures of each seat that carry load.
    """

    reactions: FloatArray
    tip: FloatArray
    bearing: IntArray


def contact_state(contact: FullContact, preload: float, tip_force: npt.ArrayLike) -> ContactState:
    """Solve the contact problem under the spring and a force on the tip.

    Parameters
    ----------
    contact : FullContact
    preload : float
        [N]
    tip_force : (3,) float
        [N]

    Raises
    ------
    ConvergenceError
        The pressures that are left do not hold the tripod; the active set did not converge.
    """
    external = np.zeros(len(INTERFACE))
    external[SPRING_FORCE], external[TIP_FORCE] = preload, tip_force
    count = len(contact.gaps)
    offset = contact.gaps + contact.interface_compliance @ external
    demand = -contact.resultants @ external
    # Scales that make pressures, lengths and rotations comparable.
    active = contact.gaps < np.quantile(contact.gaps / contact.areas, 0.3) * contact.areas
    for _ in range(_ROUNDS):
        inner = np.flatnonzero(active)
        size = len(inner)
        if size < 6 or np.linalg.matrix_rank(contact.rigid_gaps[inner]) < 6:
            raise _lifts_off(contact, active, preload, tip_force)
        system = np.zeros((size + 6, size + 6))
        system[:size, :size] = contact.compliance[np.ix_(inner, inner)]
        system[:size, size:] = contact.rigid_gaps[inner]
        system[size:, :size] = contact.rigid_gaps[inner].T
        scale = np.ones(size + 6)
        scale[:size] = 1.0 / np.sqrt(np.diag(system)[:size])
        scale[size:] = 1.0 / np.abs(system[:size, size:] * scale[:size, None]).max(axis=0)
        right = np.concatenate([-offset[inner], demand]) * scale
        solution = scale * np.linalg.solve(system * scale[:, None] * scale, right)
        pressure = np.zeros(count)
        pressure[inner], rigid = solution[:size], solution[size:]
        gap = offset + contact.compliance @ pressure + contact.rigid_gaps @ rigid
        following = np.where(active, pressure > 0.0, gap < -1e-12 * contact.areas)
        if np.array_equal(following, active):
            break
        active = following
    else:
        raise ConvergenceError(f"the contact's active set did not converge in {_ROUNDS} rounds")
    reactions = np.bincount(contact.seat_of, contact.areas * pressure, 6)
    tip = (
        contact.interface_flexibility @ external
        + contact.interface_compliance.T @ pressure
        + contact.resultants.T @ rigid
    )[TIP_FORCE]
    return ContactState(
        reactions=frozen(reactions),
        tip=frozen(tip),
        bearing=np.bincount(contact.seat_of[active], minlength=6),
    )


def _lifts_off(
    contact: FullContact, active: npt.NDArray[np.bool_], preload: float, tip_force: npt.ArrayLike
) -> ConvergenceError:
    """The error of a tripod that lifts off some of its seats."""
    bearing = np.bincount(contact.seat_of[active], minlength=6)
    free = ", ".join(name for name, count in zip(SEAT_NAMES, bearing, strict=True) if count == 0)
    force = ", ".join(f"{value:g}" for value in np.asarray(tip_force, dtype=np.float64))
    return ConvergenceError(
        f"under a preload of {preload:g} N and a force of ({force}) N on the tip no pressure acts "
        f"at seat {free}: the tripod is held by all six; lower the force below that of the trigger"
    )
