"""Curved quadratic tetrahedra in the probe's solids, by netgen."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pretravel.base import REAL, DescriptionError, IntArray, MeshError, checked, frozen, needed
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh, mesh_quality
from pretravel.design.fem.geometry import ProbeSolids, probe_body, probe_solids
from pretravel.design.fem.quadrature import volumes
from pretravel.design.fem.regions import PATCH, SPRING, seat_face
from pretravel.design.fem.symmetry import threefold_symmetry
from pretravel.prediction import Probe

log = logging.getLogger(__name__)

_NETGEN_EDGES = {(0, 1): 4, (0, 2): 5, (0, 3): 6, (1, 2): 7, (1, 3): 8, (2, 3): 9}
"""netgen's tenth-node order: middle node of each pair of corners."""
_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
"""The order used here, which is that of scikit-fem and VTK."""
MOST_ELEMENTS = 2_000_000
_SIXTH_GRADING = 0.85
"""Factor of the grading in a sixth, which then has a sixth of the unknowns of a whole mesh, and the
same error; without it, the planes that cut the body leave fewer elements around its edges."""
_GRADINGS = (1.0, 0.7, 0.5)
"""Factors of the requested grading: slower ones are tried if curved elements are inverted."""


@dataclass(frozen=True)
class MeshSettings:
    """Element sizes, relative to the dimensions that they must resolve.

    Parameters
    ----------
    refinement : float
        Divides every size below: 2 gives about eight times the elements.
    body : float
        Size relative to a part's thickness.
    interface : float
        Size relative to the diameter of a face where two parts meet: stresses peak at its edge.
    patch : float
        Size relative to the radius of a seat's patch.
    patch_radius : float
        Radius of a seat's patch relative to the rod's radius.
    grading : float
        Growth of sizes from fine to coarse: 0.1 is slow, 1 is immediate.
    """

    refinement: float = 1.0
    body: float = 0.35
    interface: float = 0.035
    patch: float = 0.8
    patch_radius: float = PATCH
    grading: float = 0.6

    def __post_init__(self) -> None:
        for name in ("refinement", "body", "interface", "patch", "patch_radius", "grading"):
            value = getattr(self, name)
            checked(value, f"the mesh setting {name}", REAL)
            if not value > 0.0:
                raise MeshError(f"the mesh setting {name} is {value:g}; it must be positive")


def mesh_probe(
    probe: Probe, settings: MeshSettings | None = None
) -> tuple[ProbeSolids, FiniteElementMesh]:
    """Solids and mesh of a probe: of one sixth if it is symmetric, and of the whole otherwise.

    A sixth that cannot be meshed (its cuts can leave slivers) is replaced by the whole.

    Raises
    ------
    DescriptionError, InputError, MeshError
        From `pretravel.design.fem.geometry.probe_solids` and `mesh_solids`.
    MissingExtraError
        Without the extra ``fem``.
    """
    needed("netgen", "fem")
    needed("skfem", "fem")
    settings = settings or MeshSettings()
    patch = settings.patch_radius * probe.tripod.rod_radius
    try:
        body = probe_body(probe, patch)
        return body, mesh_solids(body, settings)
    except (DescriptionError, MeshError) as error:
        if threefold_symmetry(probe) is None:
            raise
        log.info("the whole is meshed, because one sixth of it could not be: %s", error)
    whole = probe_solids(probe, patch)
    return whole, mesh_solids(whole, settings)


def mesh_solids(solids: ProbeSolids, settings: MeshSettings | None = None) -> FiniteElementMesh:
    """A mesh of the solids.

    Raises
    ------
    MeshError
        Too many elements for any machine; a solid that netgen cannot mesh; elements
        that the curved surface inverts.

    >>> from pretravel.design.fem.geometry import probe_body
    >>> from pretravel.prediction.catalogue import load_probe
    >>> sixth = mesh_solids(probe_body(load_probe("omp40-2")), MeshSettings(refinement=0.4))
    >>> bool(sixth.quality.min() > 0.05), sorted(sixth.faces)
    (True, ['seat A-left', 'spring'])
    """
    from netgen.meshing import NgException
    from netgen.occ import OCCGeometry

    settings = settings or MeshSettings()
    largest, notes = _set_sizes(solids, settings)
    faces = [SPRING, *(seat_face(seat) for seat in solids.seats)]
    for attempt in _GRADINGS:
        grading = attempt * settings.grading
        if solids.symmetry is not None:
            grading *= _SIXTH_GRADING
        log.info("meshing", extra={"done": 0.05})
        try:
            # One thread: netgen's wait busily for each other. Two use three times the processor
            # time, and ten times as long together with other work, for the same mesh.
            mesh = OCCGeometry(solids.shape).GenerateMesh(
                maxh=largest, grading=grading, parallel_meshing=False
            )
            mesh.SecondOrder()
        except NgException as error:
            raise MeshError(
                f"no mesh could be made of {', '.join(solids.materials)}: {error}. Look for "
                "slivers and nearly coincident faces, or use a finer mesh"
            ) from error
        try:
            return numbered(mesh, faces, tuple(notes))
        except MeshError:
            if attempt == _GRADINGS[-1]:
                raise
        notes.append(f"graded slower than {grading:.2g}: elements were inverted")
    raise AssertionError  # pragma: no cover


def _set_sizes(solids: ProbeSolids, settings: MeshSettings) -> tuple[float, list[str]]:
    scale, notes, expected = 1.0 / settings.refinement, [], 0.0
    sizes = {name: scale * settings.body * t for name, t in solids.thickness.items()}
    for solid in solids.shape.solids:
        size = sizes[solid.name]
        solid.maxh = size
        expected += 8.0 * solid.mass / size**3
    if expected > MOST_ELEMENTS:
        raise MeshError(
            f"elements this small would be about {expected:.2g}, more than {MOST_ELEMENTS:.0e}: "
            "lower the refinement"
        )
    for name, size in sizes.items():
        notes.append(
            f"{name} ({solids.materials[name].name}): elements up to {size:.2f} mm, "
            f"{settings.body * scale:.2g} of thickness"
        )
    for edges, diameter in solids.refined:
        edges.maxh = scale * settings.interface * diameter
    finest = min((d for _, d in solids.refined), default=0.0)
    notes.append(
        "edges where parts meet, and re-entrant ones: "
        f"{scale * settings.interface:.2g} of the diameter, from "
        f"{scale * settings.interface * finest:.2f} mm (stresses peak there)"
    )
    patch = scale * settings.patch * solids.patch_radius
    for face in solids.shape.faces:
        if face.name is not None and face.name.startswith("seat "):
            face.maxh = patch
            face.edges.maxh = patch
    notes.append(f"seats: {patch:.3f} mm on patches of {solids.patch_radius:.3f} mm radius")
    return max(sizes.values()), notes


def numbered(mesh: Any, faces: Sequence[str], notes: tuple[str, ...] = ()) -> FiniteElementMesh:
    """A second-order mesh of netgen in the numbering of this package, with the named faces.

    Raises
    ------
    MeshError
        No elements, inverted elements, or a face that is missing.
    """
    from skfem import MeshTet

    coordinates = np.asarray(mesh.Coordinates(), dtype=np.float64)
    volume, surface = mesh.Elements3D().NumPy(), mesh.Elements2D().NumPy()
    if len(volume) == 0:
        raise MeshError("netgen made no element: are the solids closed?")
    # netgen's first three corners have the opposite orientation.
    nodes = volume["nodes"].astype(np.int64)[:, [0, 2, 1, 3, 5, 4, 6, 7, 9, 8]] - 1
    old, corners = np.unique(nodes[:, :4], return_inverse=True)
    corners = corners.reshape(-1, 4)
    linear = MeshTet(np.ascontiguousarray(coordinates[old].T), np.ascontiguousarray(corners.T))
    corners = np.asarray(linear.t.T, dtype=np.int64)
    elements = np.concatenate([corners, len(old) + linear.t2e.T], axis=1).astype(np.int64)
    points = np.empty((len(old) + linear.edges.shape[1], 3))
    points[: len(old)] = coordinates[old]
    for place, (a, b) in enumerate(_EDGES, start=4):
        points[elements[:, place]] = coordinates[nodes[:, _NETGEN_EDGES[a, b]]]
    with_middles = six_nodes(linear)
    names = [mesh.GetMaterial(i) for i in range(1, int(volume["index"].max()) + 1)]
    region_names = tuple(dict.fromkeys(names))
    region_of = np.array([region_names.index(name) for name in names])
    back = np.full(len(coordinates), -1)
    back[old] = np.arange(len(old))
    triangles = back[surface["nodes"][:, :3].astype(np.int64) - 1]
    face_names = np.array(
        [mesh.GetBCName(i) for i in range(int(surface["index"].max()))], dtype=object
    )[surface["index"].astype(np.int64) - 1]
    made = FiniteElementMesh(
        points=frozen(points),
        elements=frozen_integers(elements),
        regions=frozen_integers(region_of[volume["index"].astype(np.int64) - 1]),
        region_names=region_names,
        faces={
            name: frozen_integers(with_middles(triangles[face_names == name])) for name in faces
        },
        boundary=frozen_integers(with_middles(linear.facets[:, linear.boundary_facets()].T)),
        quality=frozen(mesh_quality(points[corners])),
        notes=notes,
    )
    _check_elements(made)
    return made


def six_nodes(linear: Any) -> Callable[[Any], IntArray]:
    """A function that adds the middle nodes to triangles given by their corners.

    Parameters
    ----------
    linear : skfem.MeshTet
        The corners' mesh, whose edges number the middle nodes.
    """
    count = linear.nvertices
    edges = np.sort(linear.edges, axis=0).astype(np.int64)
    keys = edges[0] * count + edges[1]
    order = np.argsort(keys)

    def with_middles(corners: Any) -> IntArray:
        corners = np.asarray(corners, dtype=np.int64)
        middle = []
        for pair in ((0, 1), (1, 2), (0, 2)):
            ends = np.sort(corners[:, pair], axis=1)
            wanted = ends[:, 0] * count + ends[:, 1]
            middle.append(count + order[np.searchsorted(keys[order], wanted)])
        return np.concatenate([corners, np.stack(middle, axis=1)], axis=1)

    return with_middles


def _check_elements(mesh: FiniteElementMesh) -> None:
    flat = mesh.quality <= 0.0  # scikit-fem cannot integrate over them
    bad = np.flatnonzero(flat if flat.any() else volumes(mesh).min(axis=1) <= 0.0)
    if len(bad):
        centre = mesh.points[mesh.elements[bad[0], :4]].mean(axis=0)
        part = mesh.region_names[mesh.regions[bad[0]]]
        raise MeshError(
            f"the curved surface inverts {len(bad)} elements, the first in "
            f"'{part}' near ({centre[0]:.2f}, {centre[1]:.2f}, {centre[2]:.2f}) mm: refine the "
            "mesh, or round the sharp edges there"
        )
    for name, triangles in mesh.faces.items():
        if len(triangles) == 0:
            raise MeshError(f"the face '{name}' has no element: refine the mesh")


def frozen_integers(values: Any) -> IntArray:
    """A read-only copy."""
    array = np.array(values, dtype=np.int64)
    array.setflags(write=False)
    return array
