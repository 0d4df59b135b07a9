"""Condensation of the mesh to its interface (seats, tip, spring), and the way back."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.errors import CapacityError, PretravelError
from pretravel.model.fem.elasticity import FiniteElementModel, rigid_motions
from pretravel.model.fem.finite_element_mesh import FiniteElementMesh, element_unknowns
from pretravel.model.fem.interface_loads import INTERFACE
from pretravel.model.fem.linear_solvers import Solve, factorise
from pretravel.probe.materials import Material

log = logging.getLogger(__name__)

_BYTES_PER_UNKNOWN = 18e3
"""Memory per unknown of assembly and factor, measured; it grows slowly with the mesh. [B]"""


@dataclass(frozen=True, eq=False)
class ElasticField:
    """The mesh and its displacement under a newton on each entry of `INTERFACE`.

    Attributes
    ----------
    mesh : FiniteElementMesh
    materials : mapping of region to Material
    modes : (n, 3, 22) float
        Up to rigid motions. [mm/N]
    """

    mesh: FiniteElementMesh
    materials: Mapping[str, Material]
    modes: FloatArray


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
        """Mesh and modes, read at the first use."""
        return self.load_field()

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
        See `pretravel.model.fem.linear_solvers.factorise`.

    Returns
    -------
    ReducedModel

    Raises
    ------
    CapacityError
        Not enough memory.

    Notes
    -----
    The body is free: each unit load is balanced by a body force over its whole
    volume, six displacements are fixed (their reactions are then zero), and rigid
    motions are subtracted. Under forces in equilibrium the body forces
    cancel, and the result is exact for the mesh.

    >>> import numpy as np
    >>> from pretravel.model.fem.elasticity import finite_element_model
    >>> from pretravel.model.fem.geometry import probe_solids
    >>> from pretravel.model.fem.mesh import MeshSettings, mesh_solids
    >>> from pretravel.probe.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> solids = probe_solids(probe)
    >>> mesh = mesh_solids(solids, MeshSettings(0.5))
    >>> reduced = condense(finite_element_model(probe, solids, mesh))
    >>> bool(np.allclose(reduced.flexibility, reduced.flexibility.T))
    True
    """
    mesh = model.mesh
    modes = free_body(model, solver)(model.loads)
    by_region = _flexibility_by_region(model, modes)
    return ReducedModel(
        flexibility=frozen(sum(by_region.values(), start=np.zeros(2 * (len(INTERFACE),)))),
        flexibility_by_region={name: frozen(part) for name, part in by_region.items()},
        resultants=frozen(rigid_motions(mesh.points).T @ model.loads),
        patch_compliance=model.patch_compliance,
        ball_correction=model.ball_correction,
        seat_part=model.seat_part,
        summary=_summary(mesh),
        load_field=lambda field=ElasticField(  # type: ignore[misc]
            mesh, model.materials, frozen(modes.reshape(-1, 3, len(INTERFACE)))
        ): field,
    )


def free_body(model: FiniteElementModel, solver: str = "auto") -> Solve:
    """Factorise the free body once; nodal loads (3 n, k) to displacements (3 n, k).

    Loads are balanced by a body force, displacements have no mean rigid motion.
    """
    mesh = model.mesh
    _check_memory(mesh)
    motions = rigid_motions(mesh.points)
    weighted = _nodal_volumes(model)[:, None] * motions
    inertia = motions.T @ weighted
    free = np.setdiff1d(np.arange(mesh.unknowns), _held_unknowns(mesh))
    log.info("factorising %d unknowns", mesh.unknowns, extra={"done": 0.6})
    solve = factorise(model.stiffness[free][:, free].tocsr(), solver)

    def displacements(loads: FloatArray) -> FloatArray:
        balanced = loads - weighted @ np.linalg.solve(inertia, motions.T @ loads)
        modes = np.zeros_like(balanced)
        modes[free] = solve(balanced[free])
        return np.asarray(modes - motions @ np.linalg.solve(inertia, weighted.T @ modes))

    return displacements


def _held_unknowns(mesh: FiniteElementMesh) -> npt.NDArray[np.int64]:
    """Six displacements of three corners that hold the body without constraining it."""
    points = mesh.points[: mesh.corners]
    first = int(np.argmin(points[:, 2]))
    second = int(np.argmax(np.linalg.norm(points - points[first], axis=1)))
    axis = points[second] - points[first]
    axis = axis / np.linalg.norm(axis)
    away = points - points[first]
    third = int(np.argmax(np.linalg.norm(away - np.outer(away @ axis, axis), axis=1)))
    candidates = (3 * np.array([first, second, third])[:, None] + np.arange(3)).ravel()
    rows = rigid_motions(mesh.points)[candidates]
    rows[:, 3:] /= np.linalg.norm(points[second] - points[first])
    from scipy.linalg import qr

    _, _, order = qr(rows.T, mode="economic", pivoting=True)
    return np.asarray(np.sort(candidates[order[:6]]), dtype=np.int64)


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
        parts[name] = 0.5 * (energy + energy.T)
    return parts


def _summary(mesh: FiniteElementMesh) -> dict[str, str]:
    worst = int(np.argmin(mesh.quality))
    x, y, z = mesh.points[mesh.elements[worst, :4]].mean(axis=0)
    return {
        "unknowns": f"{mesh.unknowns}",
        "elements": f"{len(mesh.elements)} curved ten-node tetrahedra",
        "quality": f"median {np.median(mesh.quality):.2f}, worst {mesh.quality[worst]:.2f} in "
        f"{mesh.region_names[mesh.regions[worst]]} at ({x:.2f}, {y:.2f}, {z:.2f}) mm; 1 is regular",
        "refined": "; ".join(mesh.notes),
    }


def _check_memory(mesh: FiniteElementMesh) -> None:
    needed, available = _BYTES_PER_UNKNOWN * mesh.unknowns, available_memory()
    if available is not None and needed > available:
        raise CapacityError(
            f"{mesh.unknowns} unknowns need about {needed / 1e9:.1f} GB to factorise, and "
            f"{available / 1e9:.1f} GB are free: lower the refinement (half of it needs about a "
            "tenth), or close other programs"
        )


def available_memory() -> float | None:
    """Free memory in bytes; None on systems that do not report it."""
    try:
        with Path("/proc/meminfo").open(encoding="ascii") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * float(line.split()[1])
    except (OSError, ValueError, IndexError):
        pass
    return None
