"""Loads on the free body: one newton on each seat, on the tip and on the spring's face."""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.quadrature import (
    FaceQuadrature,
    element_basis,
    face_quadrature,
    skfem_mesh,
)
from pretravel.design.fem.regions import SPRING, TIP, seat_face
from pretravel.prediction import Material, Probe
from pretravel.six_seats import SEAT_NAMES, seat_frame

INTERFACE = (
    *(f"seat {name}" for name in SEAT_NAMES),
    "tip x",
    "tip y",
    "tip z",
    "spring",
    *(f"{way} {name}" for name in SEAT_NAMES for way in ("along", "around")),
)
"""The loads of the condensed model: six seats, tip, spring; then the two tangential
directions of each seat, which only friction loads."""

SEATS = slice(0, 6)

TIP_FORCE = slice(6, 9)

SPRING_FORCE = 9

TANGENTIAL = slice(10, 22)


def interface_loads(
    probe: Probe, mesh: FiniteElementMesh, radius: float, sixth: bool = False
) -> FloatArray:
    """Nodal forces of one newton on each entry of `INTERFACE`, (3 n, 22).

    Parameters
    ----------
    probe : Probe
    mesh : FiniteElementMesh
    radius : float
        Of the patches under the seats. [mm]
    sixth : bool
        The mesh is the first sixth of a body with threefold symmetry: it carries the first seat's
        forces, and a sixth of those of tip and spring.
    """
    loads = np.zeros((len(mesh.points), 3, len(INTERFACE)))
    frame = seat_frame(probe)
    contacts = frame.contacts(probe.tripod.rod_radius)
    for seat in range(1 if sixth else 6):
        nodal = hertz_pressure(
            mesh,
            seat_face(seat),
            contacts[seat],
            (frame.along[seat], frame.around[seat]),
            radius,
        )
        loads[:, :, seat] = nodal[:, None] * frame.normals[seat]
        loads[:, :, 10 + 2 * seat] = nodal[:, None] * frame.along[seat]
        loads[:, :, 11 + 2 * seat] = nodal[:, None] * frame.around[seat]
    tip = _tip_weights(mesh, np.array([0.0, 0.0, -probe.lever]), sixth)
    for axis in range(3):
        loads[:, axis, 6 + axis] = tip
    loads[:, 2, SPRING_FORCE] = -_spring_weights(mesh, sixth)
    return loads.reshape(-1, len(INTERFACE))


def half_space_compliance(material: Material, radius: float) -> float:
    """Mean displacement of a half-space under a newton of Hertz's pressure, weighted by it.

    Parameters
    ----------
    material : Material
    radius : float
        Of the loaded circle. [mm]

    Returns
    -------
    float
        0.6 (1 - nu²) / (E a). [mm/N]

    References
    ----------
    From Johnson, Contact Mechanics, equation 3.41a.

    >>> from pretravel.prediction.materials import material
    >>> round(half_space_compliance(material("tungsten carbide"), 0.2) * 1e6, 2)  # nm/N
    4.16
    """
    return 0.6 * material.plane_strain_compliance / radius


def hertz_pressure(
    mesh: FiniteElementMesh,
    face: str,
    contact: FloatArray,
    tangents: tuple[FloatArray, FloatArray],
    radius: float,
) -> FloatArray:
    """Nodal weights of one newton, spread as Hertz's pressure over a round patch.

    Parameters
    ----------
    mesh : FiniteElementMesh
    face : str
        The patch.
    contact : (3,) float
        Its middle, through which the force acts. [mm]
    tangents : two (3,) float
        Unit directions in the plane of contact.
    radius : float
        [mm]

    Returns
    -------
    (n,) float
        They add up to one.
    """
    points = face_quadrature(mesh, face)
    arms = np.stack([(points.positions - contact) @ way for way in tangents])
    pressure = np.sqrt(np.maximum(1.0 - np.sum(arms**2, axis=0) / radius**2, 0.0))
    return _on_face(points, _exact(pressure, points.areas, arms), len(mesh.points))


def _spring_weights(mesh: FiniteElementMesh, sixth: bool) -> FloatArray:
    """Even pressure over the spring's face, on the probe axis."""
    points = face_quadrature(mesh, SPRING)
    arms = _arms(np.moveaxis(points.positions, 2, 0), range(2), sixth)
    forces = _exact(np.ones(points.areas.shape), points.areas, arms)
    return _on_face(points, forces, len(mesh.points)) / (6.0 if sixth else 1.0)


def _tip_weights(mesh: FiniteElementMesh, centre: FloatArray, sixth: bool) -> FloatArray:
    """Even body force over the tip, through its centre."""
    chosen = np.flatnonzero(mesh.regions == mesh.region_names.index(TIP))
    basis = element_basis(skfem_mesh(mesh), elements=chosen)
    away = np.asarray(basis.global_coordinates()) - centre[:, None, None]
    arms = _arms(away, range(3), sixth)
    forces = _exact(np.ones(basis.dx.shape), basis.dx, arms)
    nodal = np.zeros(len(mesh.points))
    for node in range(10):
        values = np.sum(np.asarray(basis.basis[node][0]) * forces, axis=1)
        np.add.at(nodal, basis.element_dofs[node], values)
    return nodal / (6.0 if sixth else 1.0)


def _arms(away: FloatArray, axes: range, sixth: bool) -> FloatArray:
    """Distances along some axes; of a sixth those along z, for its images cancel the others."""
    return away[[axis for axis in axes if axis == 2 or not sixth]]


def _exact(density: FloatArray, measure: FloatArray, arms: FloatArray) -> FloatArray:
    """Forces of a density at each point: one newton in all, no moment over any of the arms.

    Parameters
    ----------
    density, measure : (e, k) float
        Wanted density, and area or volume of each point.
    arms : (j, e, k) float
        Distances over which the moments vanish. [mm]
    """
    size = np.sqrt(np.mean(arms**2)) if len(arms) else 1.0
    shapes = np.concatenate([np.ones((1, *density.shape)), arms / size])
    moments = np.einsum("iek,jek,ek,ek->ij", shapes, shapes, density, measure)
    factors = np.linalg.solve(moments, np.eye(len(shapes))[0])
    return np.asarray(np.einsum("i,iek->ek", factors, shapes) * density * measure)


def _on_face(points: FaceQuadrature, forces: FloatArray, count: int) -> FloatArray:
    nodal = np.zeros(count)
    np.add.at(nodal, points.nodes, forces @ points.shapes)
    return nodal
