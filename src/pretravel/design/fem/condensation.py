"""Condensation of the mesh to its interface (seats, tip, spring), and the way back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.design.fem.elasticity import FiniteElementModel, rigid_motions
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh, element_unknowns
from pretravel.design.fem.free_body import free_solve
from pretravel.design.fem.interface_loads import INTERFACE
from pretravel.design.fem.linear_solvers import Solve
from pretravel.design.fem.sixth_modes import sixth_modes
from pretravel.design.fem.symmetry import COPIES, ThreefoldSymmetry
from pretravel.design.fem.unfolding import unfolded_mesh
from pretravel.prediction import Material


@dataclass(frozen=True, eq=False)
class ElasticField:
    """A mesh and its displacement under a newton on each entry of `INTERFACE`.

    Attributes
    ----------
    mesh : FiniteElementMesh
    materials : mapping of region to Material
    modes : (n, 3, 22) float
        Up to rigid motions. [mm/N]
    symmetry : ThreefoldSymmetry, optional
        If mesh and modes are those of one sixth of the body.
    """

    mesh: FiniteElementMesh
    materials: Mapping[str, Material]
    modes: FloatArray
    symmetry: ThreefoldSymmetry | None = None

    def whole(self) -> ElasticField:
        """The field of the whole body: itself, or a sixth with its images."""
        if self.symmetry is None:
            return self
        unfolded = unfolded_mesh(self.mesh, self.symmetry)
        modes = unfolded.modes(self.modes, self.symmetry)
        return ElasticField(unfolded.mesh, self.materials, frozen(modes))


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """The elastic body, condensed to its interface; exact for forces on seats, tip and spring.

    Attributes
    ----------
    flexibility : (22, 22) float
        Displacement of each entry of `INTERFACE` per newton on each, up to rigid
        motions; meant for forces in equilibrium. [mm/N]
    flexibility_by_region : mapping of str to (22, 22) float
        Its parts by strain energy; they add up to it. [mm/N]
    resultants : (6, 22) float
        Force and moment about the origin of a newton on each.
    patch_compliance : float
        Deflection of the half-space under a seat's patch per newton. Both `flexibility` and
        Hertz's law contain it, so it is subtracted once. [mm/N]
    ball_correction : float
        Deflection of a seat's ball in excess of Hertz's half-space, per newton. [mm/N]
    seat_part : str
        The part on which the seats push.
    summary : mapping of str to str
        Unknowns, elements, quality, and the refinements with their reasons.
    load_field : callable
        Mesh and modes of the part that was meshed: all of the body, or a sixth.
    """

    flexibility: FloatArray
    flexibility_by_region: Mapping[str, FloatArray]
    resultants: FloatArray
    patch_compliance: float
    ball_correction: float
    seat_part: str
    summary: Mapping[str, str]
    load_field: Callable[[], ElasticField] = field(repr=False)

    @property
    def seat_correction(self) -> float:
        """Correction of Hertz's approach per newton on a seat. [mm/N]"""
        return self.ball_correction - self.patch_compliance

    @cached_property
    def elastic_field(self) -> ElasticField:
        """Mesh and modes of the whole body, read at the first use."""
        return self.load_field().whole()

    def lift(self, forces: npt.ArrayLike, rigid: npt.ArrayLike | None = None) -> FloatArray:
        """Displacement of every node under forces on the interface.

        Parameters
        ----------
        forces : (22,) float
            In equilibrium, in the order of `INTERFACE`. [N]
        rigid : (6,) float, optional
            Rigid motion on top: three translations [mm], three rotations [rad].

        Returns
        -------
        (n, 3) float
            [mm]

        Raises
        ------
        PretravelError
            Forces that are not in equilibrium.
        """
        p = np.asarray(forces, dtype=np.float64)
        rest = self.resultants @ p
        size = float(np.abs(p).sum())
        lever = float(np.abs(self.resultants[3:]).max())
        if np.any(np.abs(rest[:3]) > 1e-6 * size) or np.any(np.abs(rest[3:]) > 1e-6 * size * lever):
            raise PretravelError(
                f"the interface forces leave a resultant of {np.abs(rest[:3]).max():.3g} N and "
                f"{np.abs(rest[3:]).max():.3g} N mm; a free body needs forces in equilibrium"
            )
        lifted = self.elastic_field.modes @ p
        if rigid is not None:
            points = self.elastic_field.mesh.points
            lifted = lifted + (rigid_motions(points) @ np.asarray(rigid)).reshape(-1, 3)
        return np.asarray(lifted)


def condense(model: FiniteElementModel, solver: str = "auto") -> ReducedModel:
    """Reduce the finite-element model to its interface: one factorisation.

    Parameters
    ----------
    model : FiniteElementModel
    solver : str
        See `pretravel.design.fem.linear_solvers.factorise`.

    Raises
    ------
    CapacityError
        Not enough memory.

    Notes
    -----
    The body is free: each unit load is balanced by a body force over its whole
    volume, six displacements are fixed (their reactions are then zero), and rigid
    motions are subtracted. Under forces in equilibrium the body forces
    cancel, and the result is exact for the mesh. Of a body with threefold symmetry one sixth
    is given; the result is the one that the mesh of all its images would have.

    >>> import numpy as np
    >>> from pretravel.design.fem.elasticity import finite_element_model
    >>> from pretravel.design.fem.mesh import MeshSettings, mesh_probe
    >>> from pretravel.prediction.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> solids, mesh = mesh_probe(probe, MeshSettings(refinement=0.4))
    >>> reduced = condense(finite_element_model(probe, solids, mesh))
    >>> bool(np.allclose(reduced.flexibility, reduced.flexibility.T))
    True
    """
    mesh, symmetry = model.mesh, model.symmetry
    if symmetry is None:
        modes = free_body(model, solver)(model.loads)
    else:
        modes = sixth_modes(model, symmetry, _nodal_volumes(model), solver)
    by_region = _flexibility_by_region(model, modes)
    return ReducedModel(
        flexibility=frozen(sum(by_region.values(), start=np.zeros(2 * (len(INTERFACE),)))),
        flexibility_by_region={name: frozen(part) for name, part in by_region.items()},
        resultants=frozen(_resultants(model)),
        patch_compliance=model.patch_compliance,
        ball_correction=model.ball_correction,
        seat_part=model.seat_part,
        summary=_summary(mesh, symmetry),
        load_field=lambda field=ElasticField(  # type: ignore[misc]
            mesh, model.materials, frozen(modes.reshape(-1, 3, len(INTERFACE))), symmetry
        ): field,
    )


def free_body(model: FiniteElementModel, solver: str = "auto") -> Solve:
    """Factorise the free body once; nodal loads (3 n, k) to displacements (3 n, k).

    Loads are balanced by a body force, displacements have no mean rigid motion.
    """
    motions = rigid_motions(model.mesh.points)
    return free_solve(model.stiffness, motions, _nodal_volumes(model), solver)


def _nodal_volumes(model: FiniteElementModel) -> FloatArray:
    """Positive weight of each displacement: element volumes, divided evenly among the nodes."""
    corners = model.mesh.points[model.mesh.elements[:, :4]]
    edges = corners[:, 1:] - corners[:, :1]
    volume = np.abs(np.linalg.det(edges)) / 6.0
    nodal = np.zeros(len(model.mesh.points))
    np.add.at(nodal, model.mesh.elements, np.repeat(volume[:, None] / 10.0, 10, axis=1))
    return np.repeat(nodal, 3)


def _flexibility_by_region(model: FiniteElementModel, modes: FloatArray) -> dict[str, FloatArray]:
    """modes^T K modes, region by region."""
    unknowns = element_unknowns(model.mesh)
    parts = {}
    for index, name in enumerate(model.mesh.region_names):
        chosen = np.flatnonzero(model.mesh.regions == index)
        local = modes[unknowns[chosen]]
        energy = np.einsum("eak,eab,ebl->kl", local, model.elements[chosen], local, optimize=True)
        parts[name] = _of_all_images(0.5 * (energy + energy.T), model.symmetry)
    return parts


def _of_all_images(energy: FloatArray, symmetry: ThreefoldSymmetry | None) -> FloatArray:
    """The sum of a sixth's images, (22, 22)."""
    if symmetry is None:
        return energy
    action = symmetry.interface
    return np.asarray(np.einsum("gab,bc,gdc->ad", action, energy, action, optimize=True))


def _resultants(model: FiniteElementModel) -> FloatArray:
    """Force and moment about the origin of the loads on the whole body, (6, 22)."""
    own = rigid_motions(model.mesh.points).T @ model.loads
    if model.symmetry is None:
        return np.asarray(own)
    rigid, action = model.symmetry.rigid, model.symmetry.interface
    return np.asarray(np.einsum("gab,bc,gdc->ad", rigid, own, action, optimize=True))


def _summary(mesh: FiniteElementMesh, symmetry: ThreefoldSymmetry | None) -> dict[str, str]:
    unknowns, elements, how = mesh.unknowns, len(mesh.elements), ""
    if symmetry is not None:
        images = COPIES / symmetry.fixing(mesh.points).sum(axis=0)
        unknowns, elements = 3 * round(images.sum()), COPIES * elements
        how = "; one sixth is meshed, the others are its images"
    worst = int(np.argmin(mesh.quality))
    x, y, z = mesh.points[mesh.elements[worst, :4]].mean(axis=0)
    return {
        "unknowns": f"{unknowns}",
        "elements": f"{elements} curved ten-node tetrahedra{how}",
        "quality": f"median {np.median(mesh.quality):.2f}, worst {mesh.quality[worst]:.2f} in "
        f"{mesh.region_names[mesh.regions[worst]]} at ({x:.2f}, {y:.2f}, {z:.2f}) mm; 1 is regular",
        "refined": "; ".join(mesh.notes),
    }
