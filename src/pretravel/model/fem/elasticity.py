"""Linear elasticity on the mesh: stiffness, the loads of seats, tip and spring, stresses."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pretravel.arrays import FloatArray, IntArray, frozen
from pretravel.errors import DescriptionError
from pretravel.model.fem.geometry import SPRING, TIP, ProbeSolids, part_name, seat_face
from pretravel.model.fem.mesh import FiniteElementMesh
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.probe.seat_frame import SEAT_NAMES, seat_frame

if TYPE_CHECKING:  # a kept model needs none of it, and is there the sooner
    from scipy import sparse

log = logging.getLogger(__name__)

INTERFACE = (
    *(f"seat {name}" for name in SEAT_NAMES),
    "tip x",
    "tip y",
    "tip z",
    "spring",
    *(f"{way} {name}" for name in SEAT_NAMES for way in ("along", "around")),
)
"""What the condensed model is loaded by: six seats, tip, spring; then the seats' two
tangential directions, which only friction loads."""
SEATS = slice(0, 6)
TIP_FORCE = slice(6, 9)
SPRING_FORCE = 9
TANGENTIAL = slice(10, 22)


class Quadrature(NamedTuple):
    """Four points in every element, exact for straight quadratic elements."""

    gradients: FloatArray
    """Of the ten shape functions, (elements, points, 10, 3). [1/mm]"""
    weights: FloatArray
    """Volume of each point, negative in an element turned inside out, (elements, points)."""


def quadrature(mesh: FiniteElementMesh) -> Quadrature:
    """Shape function gradients and weights, by scikit-fem."""
    basis = _basis(skfem_mesh(mesh))
    gradients = np.stack([basis.basis[node][0].grad for node in range(10)])
    signs = np.sign(basis.mapping.detDF(basis.X))
    return Quadrature(
        np.ascontiguousarray(gradients.transpose(2, 3, 0, 1)), np.asarray(signs * basis.dx)
    )


def skfem_mesh(mesh: FiniteElementMesh) -> Any:
    """The mesh as scikit-fem's, with the same numbering."""
    from skfem import MeshTet2

    return MeshTet2(
        np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.elements[:, :4].T)
    )


def _basis(grid: Any, **selection: Any) -> Any:
    from skfem import Basis, ElementTetP2

    return Basis(grid, ElementTetP2(), intorder=2, **selection)


def lame(materials: Mapping[str, Material], mesh: FiniteElementMesh) -> tuple[FloatArray, ...]:
    """Lamé's two constants of each element. [MPa]"""
    modulus = np.array([materials[name].youngs_modulus for name in mesh.region_names])
    ratio = np.array([materials[name].poissons_ratio for name in mesh.region_names])
    first = modulus * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio))
    second = 0.5 * modulus / (1.0 + ratio)
    return first[mesh.regions], second[mesh.regions]


def element_stiffness(mesh: FiniteElementMesh, materials: Mapping[str, Material]) -> FloatArray:
    """Stiffness matrices of all elements, (m, 30, 30). [N/mm]

    Node by node, three displacements each: B^T D B summed over four points.
    """
    gradients, weights = quadrature(mesh)
    first, second = lame(materials, mesh)
    count = len(weights)
    flat = gradients.reshape(count, -1, 30)
    # Sum over points of dNa/dxi dNb/dxj, as [element, a, i, b, j].
    products = np.matmul((flat * weights[:, :, None]).transpose(0, 2, 1), flat)
    products = products.reshape(count, 10, 3, 10, 3)
    stiffness = first[:, None, None, None, None] * products
    stiffness += second[:, None, None, None, None] * products.transpose(0, 1, 4, 3, 2)
    trace = second[:, None, None] * np.trace(products, axis1=2, axis2=4)
    for axis in range(3):
        stiffness[:, :, axis, :, axis] += trace
    return np.asarray(stiffness.reshape(count, 30, 30))


def element_unknowns(mesh: FiniteElementMesh) -> IntArray:
    """Indices of each element's thirty displacements, (m, 30)."""
    unknowns = 3 * mesh.elements[:, :, None] + np.arange(3)
    return np.asarray(unknowns.reshape(len(mesh.elements), 30))


def upper_stiffness(mesh: FiniteElementMesh, elements: FloatArray) -> sparse.csr_matrix:
    """The upper triangle of the whole body's stiffness: half the work, and all that solvers ask."""
    from scipy import sparse

    unknowns = element_unknowns(mesh).astype(np.int32)
    first, second = np.triu_indices(30)
    rows, columns = unknowns[:, first], unknowns[:, second]
    places = (np.minimum(rows, columns).ravel(), np.maximum(rows, columns).ravel())
    return sparse.csr_matrix(
        (elements[:, first, second].ravel(), places), shape=2 * (mesh.unknowns,)
    )


def rigid_motions(points: FloatArray) -> FloatArray:
    """Displacements of three unit translations and three unit rotations, (3 n, 6)."""
    motions = np.zeros((len(points), 3, 6))
    motions[:, :, :3] = np.eye(3)
    for axis in range(3):
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], points)
    return motions.reshape(-1, 6)


@dataclass(frozen=True, eq=False)
class FiniteElementModel:
    """The free elastic body with the loads that may act on it.

    Attributes
    ----------
    mesh : FiniteElementMesh
    materials : mapping of region to Material
    elements : (m, 30, 30) float
        Element stiffness matrices. [N/mm]
    stiffness : sparse (3 n, 3 n)
        Its upper triangle; the rest is its mirror image. [N/mm]
    loads : (3 n, 22) float
        Nodal forces of one newton on each entry of `INTERFACE`.
    patch_compliance : float
        What the half-space under a seat's patch gives per newton: Hertz has it too. [mm/N]
    ball_correction : float
        What a ball gives beyond Hertz's half-space. [mm/N]
    seat_part : str
        The part that the seats push on.
    """

    mesh: FiniteElementMesh
    materials: Mapping[str, Material]
    elements: FloatArray
    stiffness: sparse.csr_matrix
    loads: FloatArray
    patch_compliance: float
    ball_correction: float
    seat_part: str


def finite_element_model(
    probe: Probe, solids: ProbeSolids, mesh: FiniteElementMesh, ball: float = 0.0
) -> FiniteElementModel:
    """Assemble stiffness and loads.

    Parameters
    ----------
    probe : Probe
    solids : ProbeSolids
    mesh : FiniteElementMesh
    ball : float
        `pretravel.model.fem.seat_ball.ball_correction`; half-spaces when not given. [mm/N]

    Returns
    -------
    FiniteElementModel

    Notes
    -----
    A seat's newton is spread as Hertz's pressure (1 - (r/a)²)^(1/2) over its patch of
    radius a. The tip's newton is spread
    over the tip's volume, so that its displacement is the ball's mean one: a
    force on one node would sink in the deeper the finer the mesh. All are made
    exact in force and line of action, whatever the mesh.

    >>> from pretravel.model.fem.geometry import probe_solids
    >>> from pretravel.model.fem.mesh import MeshSettings, mesh_solids
    >>> from pretravel.probe.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> solids = probe_solids(probe)
    >>> model = finite_element_model(probe, solids, mesh_solids(solids, MeshSettings(0.5)))
    >>> total = rigid_motions(model.mesh.points).T @ model.loads[:, TIP_FORCE]
    >>> total[:3].round(9).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    log.info("assembling %d unknowns", mesh.unknowns)
    elements = element_stiffness(mesh, solids.materials)
    radius = solids.patch_radius
    regions = _seat_regions(mesh)
    for region in regions:
        material = solids.materials[region]
        if material != probe.tripod.material:
            raise DescriptionError(
                f"'{region}' carries seats and is of {material.name}, but [tripod] says "
                f"{probe.tripod.material.name}, which contact is reckoned with: make them the same"
            )
    radius = solids.patch_radius
    return FiniteElementModel(
        mesh=mesh,
        materials=solids.materials,
        elements=frozen(elements),
        stiffness=upper_stiffness(mesh, elements),
        loads=frozen(_interface_loads(probe, mesh, radius)),
        patch_compliance=half_space_compliance(probe.tripod.material, radius),
        ball_correction=ball,
        seat_part=part_name(regions[0]),
    )


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

    >>> from pretravel.probe.materials import material
    >>> round(half_space_compliance(material("tungsten carbide"), 0.2) * 1e6, 2)  # nm/N
    4.16
    """
    return 0.6 * material.plane_strain_compliance / radius


def _seat_regions(mesh: FiniteElementMesh) -> list[str]:
    """The regions, of one part, that the seats push on."""
    found: set[str] = set()
    for seat in range(6):
        face = mesh.faces[seat_face(seat)][:, :3]
        touching = np.isin(mesh.elements[:, :4], face).sum(axis=1) == 3
        found |= {mesh.region_names[index] for index in np.unique(mesh.regions[touching])}
    return sorted(found)


def _interface_loads(probe: Probe, mesh: FiniteElementMesh, radius: float) -> FloatArray:
    loads = np.zeros((len(mesh.points), 3, len(INTERFACE)))
    frame = seat_frame(probe)
    contacts = frame.contacts(probe.tripod.rod_radius)
    for seat in range(6):
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
    tip = _tip_weights(mesh, np.array([0.0, 0.0, -probe.lever]))
    for axis in range(3):
        loads[:, axis, 6 + axis] = tip
    loads[:, 2, SPRING_FORCE] = -_spring_weights(mesh)
    return loads.reshape(-1, len(INTERFACE))


class FaceQuadrature(NamedTuple):
    """Points on the curved triangles of a face."""

    nodes: IntArray
    """(k, 6)."""
    shapes: FloatArray
    """Of the six nodes at each point, (q, 6)."""
    positions: FloatArray
    """(k, q, 3). [mm]"""
    normals: FloatArray
    """Times the area of each point; which way round is not told, (k, q, 3). [mm²]"""

    @property
    def areas(self) -> FloatArray:
        """(k, q). [mm²]"""
        return np.asarray(np.linalg.norm(self.normals, axis=2))


def face_quadrature(mesh: FiniteElementMesh, face: str) -> FaceQuadrature:
    """Twelve points a triangle: exact to the sixth degree on flat ones."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefTri

    (b, c), weights = get_quadrature(RefTri, 6)
    shapes, by_b, by_c = triangle_shapes(b, c)
    nodes = mesh.faces[face]
    corners = mesh.points[nodes]
    tangents = [np.einsum("qa,kai->kqi", slope, corners) for slope in (by_b, by_c)]
    return FaceQuadrature(
        nodes,
        shapes,
        np.einsum("qa,kai->kqi", shapes, corners),
        np.cross(tangents[0], tangents[1]) * weights[:, None],
    )


def triangle_shapes(b: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Quadratic shape functions of a triangle and their slopes, (..., 6) each.

    Nodes: three corners, then the middles of edges 01, 12, 02; b and c are the second and
    third barycentric coordinates.

    >>> shapes, _, _ = triangle_shapes(np.array([0.5]), np.array([0.0]))
    >>> np.abs(shapes[0]).tolist()
    [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    """
    a, zero = 1.0 - b - c, np.zeros_like(b)
    values = [a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * a * c]
    by_b = [1 - 4 * a, 4 * b - 1, zero, 4 * (a - b), 4 * c, -4 * c]
    by_c = [1 - 4 * a, zero, 4 * c - 1, -4 * b, 4 * b, 4 * (a - c)]
    return np.stack(values, axis=-1), np.stack(by_b, axis=-1), np.stack(by_c, axis=-1)


def _exact(density: FloatArray, measure: FloatArray, arms: FloatArray) -> FloatArray:
    """Forces of a density at each point: one newton in all, no moment over any of the arms.

    Parameters
    ----------
    density, measure : (e, k) float
        Wanted density, and area or volume of each point.
    arms : (j, e, k) float
        Distances over which the moments vanish. [mm]
    """
    size = np.sqrt(np.mean(arms**2))
    shapes = np.concatenate([np.ones((1, *density.shape)), arms / size])
    moments = np.einsum("iek,jek,ek,ek->ij", shapes, shapes, density, measure)
    factors = np.linalg.solve(moments, np.eye(len(shapes))[0])
    return np.asarray(np.einsum("i,iek->ek", factors, shapes) * density * measure)


def _on_face(points: FaceQuadrature, forces: FloatArray, count: int) -> FloatArray:
    nodal = np.zeros(count)
    np.add.at(nodal, points.nodes, forces @ points.shapes)
    return nodal


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
        Its middle, which the force goes through. [mm]
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


def _spring_weights(mesh: FiniteElementMesh) -> FloatArray:
    """Even pressure over the spring's face, on the probe axis."""
    points = face_quadrature(mesh, SPRING)
    arms = np.moveaxis(points.positions[..., :2], 2, 0)
    forces = _exact(np.ones(points.areas.shape), points.areas, arms)
    return _on_face(points, forces, len(mesh.points))


def _tip_weights(mesh: FiniteElementMesh, centre: FloatArray) -> FloatArray:
    """Even body force over the tip, through its centre."""
    chosen = np.flatnonzero(mesh.regions == mesh.region_names.index(TIP))
    basis = _basis(skfem_mesh(mesh), elements=chosen)
    arms = np.asarray(basis.global_coordinates()) - centre[:, None, None]
    forces = _exact(np.ones(basis.dx.shape), basis.dx, arms)
    nodal = np.zeros(len(mesh.points))
    for node in range(10):
        values = np.sum(np.asarray(basis.basis[node][0]) * forces, axis=1)
        np.add.at(nodal, basis.element_dofs[node], values)
    return nodal


def von_mises(
    mesh: FiniteElementMesh, materials: Mapping[str, Material], displacement: FloatArray
) -> FloatArray:
    """Von Mises stress, mean over each element's four points.

    Parameters
    ----------
    mesh, materials
    displacement : (n, 3) float
        [mm]

    Returns
    -------
    (m,) float
        [MPa]

    >>> import numpy as np
    >>> from pretravel.model.fem.geometry import probe_solids
    >>> from pretravel.model.fem.mesh import MeshSettings, mesh_solids
    >>> from pretravel.probe.catalogue import load_probe
    >>> solids = probe_solids(load_probe("omp40-2"))
    >>> mesh = mesh_solids(solids, MeshSettings(0.5))
    >>> moved = np.ones_like(mesh.points)  # a translation stresses nothing
    >>> bool(von_mises(mesh, solids.materials, moved).max() < 1e-6)
    True
    """
    gradients, _ = quadrature(mesh)
    first, second = lame(materials, mesh)
    gradient = np.einsum("eai,eqaj->eqij", displacement[mesh.elements], gradients)
    strain = 0.5 * (gradient + gradient.transpose(0, 1, 3, 2))
    volume = np.einsum("eqii->eq", strain)
    stress = 2.0 * second[:, None, None, None] * strain
    stress += (first[:, None] * volume)[:, :, None, None] * np.eye(3)
    deviator = stress - np.einsum("eqii->eq", stress)[:, :, None, None] / 3.0 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("eqij,eqij->eq", deviator, deviator)).mean(axis=1))
