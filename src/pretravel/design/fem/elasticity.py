"""Linear elasticity on the mesh: stiffness and stresses of the free body."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DescriptionError, FloatArray, frozen
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh, element_unknowns
from pretravel.design.fem.geometry import ProbeSolids
from pretravel.design.fem.interface_loads import half_space_compliance, interface_loads
from pretravel.design.fem.quadrature import quadrature
from pretravel.design.fem.regions import part_name, seat_face
from pretravel.design.fem.symmetry import ThreefoldSymmetry
from pretravel.prediction import Material, Probe

if TYPE_CHECKING:  # a model from the cache does not need it, and loads faster without
    from scipy import sparse

log = logging.getLogger(__name__)


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
        Deflection of the half-space under a seat's patch, which Hertz's law contains too. [mm/N]
    ball_correction : float
        Deflection of a ball in excess of Hertz's half-space. [mm/N]
    seat_part : str
        The part on which the seats push.
    symmetry : ThreefoldSymmetry, optional
        If mesh, elements, stiffness and loads are those of one sixth of the body.
    """

    mesh: FiniteElementMesh
    materials: Mapping[str, Material]
    elements: FloatArray
    stiffness: sparse.csr_matrix
    loads: FloatArray
    patch_compliance: float
    ball_correction: float
    seat_part: str
    symmetry: ThreefoldSymmetry | None = None


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
        `pretravel.design.fem.seat_ball.ball_correction`; half-spaces when not given. [mm/N]

    Notes
    -----
    A seat's newton is spread as Hertz's pressure (1 - (r/a)²)^(1/2) over its patch of
    radius a. The tip's newton is spread over the tip's volume, so that its displacement is the
    ball's mean displacement: the displacement under a force on one node would grow without limit
    as the mesh is refined. Force and line of action of all loads are exact on any mesh.

    >>> from pretravel.design.fem.interface_loads import TIP_FORCE
    >>> from pretravel.design.fem.mesh import MeshSettings, mesh_probe
    >>> from pretravel.prediction.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> solids, mesh = mesh_probe(probe, MeshSettings(refinement=0.4))
    >>> model = finite_element_model(probe, solids, mesh)
    >>> total = rigid_motions(mesh.points).T @ model.loads[:, TIP_FORCE]
    >>> (6.0 * total[:3]).round(9).tolist()  # one sixth is meshed, and carries one sixth
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    regions = _seat_regions(mesh)
    for region in regions:
        material = solids.materials[region]
        if material != probe.tripod.material:
            raise DescriptionError(
                f"'{region}' carries seats and is of {material.name}, but contact is computed "
                f"with the material of [tripod], {probe.tripod.material.name}: make them the same"
            )
    # Parts of the whole: measured with 127 and 291 thousand unknowns, for the progress.
    log.info("assembling %d unknowns", mesh.unknowns, extra={"done": 0.48})
    elements = element_stiffness(mesh, solids.materials)
    radius = solids.patch_radius
    return FiniteElementModel(
        mesh=mesh,
        materials=solids.materials,
        elements=frozen(elements),
        stiffness=upper_stiffness(mesh, elements),
        loads=frozen(interface_loads(probe, mesh, radius, sixth=solids.symmetry is not None)),
        patch_compliance=half_space_compliance(probe.tripod.material, radius),
        ball_correction=ball,
        seat_part=part_name(regions[0]),
        symmetry=solids.symmetry,
    )


def _seat_regions(mesh: FiniteElementMesh) -> list[str]:
    """The regions, of one part, on which the seats push."""
    found: set[str] = set()
    for name in {seat_face(seat) for seat in range(6)} & set(mesh.faces):
        face = mesh.faces[name][:, :3]
        touching = np.isin(mesh.elements[:, :4], face).sum(axis=1) == 3
        found |= {mesh.region_names[index] for index in np.unique(mesh.regions[touching])}
    return sorted(found)


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


def upper_stiffness(mesh: FiniteElementMesh, elements: FloatArray) -> sparse.csr_matrix:
    """The upper triangle of the whole body's stiffness, which is all that the solvers need."""
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


def stress_of(
    mesh: FiniteElementMesh, materials: Mapping[str, Material]
) -> Callable[[FloatArray], FloatArray]:
    """Von Mises stress, mean over each element's four points, as a function of the displacement.

    Returns
    -------
    callable
        (n, 3) [mm] to (m,) [MPa].
    """
    gradients, _ = quadrature(mesh)
    first, second = lame(materials, mesh)
    return lambda displacement: _von_mises(mesh, gradients, (first, second), displacement)


def _von_mises(
    mesh: FiniteElementMesh,
    gradients: FloatArray,
    moduli: tuple[FloatArray, FloatArray],
    displacement: FloatArray,
) -> FloatArray:
    first, second = moduli
    gradient = np.einsum("eai,eqaj->eqij", displacement[mesh.elements], gradients)
    strain = 0.5 * (gradient + gradient.transpose(0, 1, 3, 2))
    volume = np.einsum("eqii->eq", strain)
    stress = 2.0 * second[:, None, None, None] * strain
    stress += (first[:, None] * volume)[:, :, None, None] * np.eye(3)
    deviator = stress - np.einsum("eqii->eq", stress)[:, :, None, None] / 3.0 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("eqij,eqij->eq", deviator, deviator)).mean(axis=1))
