"""The moving part of the probe as solids: hub, rods, stylus and tip, cut at the seats.

The CAD kernel is OpenCASCADE as netgen provides it; lengths are in mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from pretravel.base import DescriptionError, FloatArray, needed, whole_file
from pretravel.design.fem.described_solids import described_solids
from pretravel.design.fem.regions import PATCH, SPRING, ProbeSolid, seat_face
from pretravel.design.fem.step_solids import step_solids
from pretravel.design.fem.symmetry import COPIES, ThreefoldSymmetry, threefold_symmetry
from pretravel.prediction import Material, Probe, seat_frame
from pretravel.six_seats import SEAT_NAMES

_SEAT_TOLERANCE = 0.02
"""Largest distance between the rods' surface and the described seats. [mm]"""
_ON_MIRROR = 1e-6
"""Largest distance of points of a mirror plane from it, as the CAD kernel cuts. [mm]"""


@dataclass(frozen=True, eq=False)
class ProbeSolids:
    """Solids that share their faces, ready for a mesh.

    Attributes
    ----------
    shape : OpenCASCADE compound
        Solids named by region, faces named `seat_face` and `SPRING`.
    materials : mapping of region to Material
    thickness : mapping of region to float
        The length that element sizes refer to: sqrt(4 volume / (pi length)). [mm]
    refined : sequence of (edges, float)
        Edges where stresses peak: of faces where two regions meet, and re-entrant ones;
        with the diameter that the sizes of their elements refer to. [mm]
    patch_radius : float
        Of the patches over which the seat forces are spread. [mm]
    symmetry : ThreefoldSymmetry, optional
        If the solids are one sixth of the body, which consists of its images.
    """

    shape: Any
    materials: Mapping[str, Material]
    thickness: Mapping[str, float]
    refined: Sequence[tuple[Any, float]]
    patch_radius: float
    symmetry: ThreefoldSymmetry | None = None

    @property
    def seats(self) -> range:
        """The seats that push on these solids."""
        return range(6 if self.symmetry is None else 1)


def probe_solids(probe: Probe, patch_radius: float | None = None) -> ProbeSolids:
    """The solids of a probe, from its description or its STEP file.

    Parameters
    ----------
    probe : Probe
        With a hub, or a STEP geometry.
    patch_radius : float, optional
        Of the patches under the seats; `PATCH` of the rod's radius when not given. [mm]

    Raises
    ------
    DescriptionError
        No hub described; parts that overlap, are not joined, or do not reach the seats.
    InputError
        A STEP file that cannot be read, or that does not contain a solid.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> sorted(probe_solids(load_probe("omp40-2")).materials)
    ['holder', 'hub', 'rods', 'stylus 1', 'stylus 2', 'tip']
    """
    patch = _checked_patch(probe, patch_radius)
    uncut = described_solids(probe) if probe.step is None else step_solids(probe, probe.step)
    _check_overlaps(uncut)
    shape, parts, meeting = _joined(probe, uncut, patch, range(6))
    refined = [(face.edges, math.sqrt(4.0 * face.mass / math.pi)) for face in meeting]
    if probe.step is not None:  # in described parts every re-entrant edge is an interface
        refined += _reentrant_edges(shape, uncut, patch)
    return ProbeSolids(
        shape=shape,
        materials={part.name: part.material for part in parts},
        thickness=_thickness(parts),
        refined=refined,
        patch_radius=patch,
    )


def probe_body(probe: Probe, patch_radius: float | None = None) -> ProbeSolids:
    """The least that has to be meshed: one sixth of a symmetric probe, or all of another.

    Parameters and errors are those of `probe_solids`.

    Notes
    -----
    The sixth lies between the plane through the first rod's axis and the plane 60° further
    counter-clockwise, and contains the first seat.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> probe = load_probe("omp40-2")
    >>> sixth, whole = probe_body(probe).shape.mass, probe_solids(probe).shape.mass
    >>> bool(abs(6.0 * sixth / whole - 1.0) < 1e-6)
    True
    """
    patch = _checked_patch(probe, patch_radius)
    symmetry = threefold_symmetry(probe)
    if symmetry is None or not _patch_within_sixth(probe, patch):
        return probe_solids(probe, patch_radius)
    whole = described_solids(probe)
    wedge = _wedge(probe)
    uncut = [replace(part, solid=part.solid * wedge) for part in whole]
    _check_overlaps(uncut, COPIES)
    shape, parts, meeting = _joined(probe, uncut, patch, range(1))
    mirrored = {edge for face in shape.faces if _on_mirror(probe, face) for edge in face.edges}
    refined = []
    for face in meeting:
        diameter = math.sqrt(4.0 * face.mass * _images_joined(probe, face) / math.pi)
        refined += [(edge, diameter) for edge in face.edges if edge not in mirrored]
    return ProbeSolids(
        shape=shape,
        materials={part.name: part.material for part in parts},
        thickness=_thickness(whole),
        refined=refined,
        patch_radius=patch,
        symmetry=symmetry,
    )


def _checked_patch(probe: Probe, patch_radius: float | None) -> float:
    probe.refuse_uneven("a finite-element model")
    patch = PATCH * probe.tripod.rod_radius if patch_radius is None else patch_radius
    if not 0.0 < patch <= 0.5 * probe.tripod.rod_radius:
        raise DescriptionError(
            f"a seat patch of radius {patch:g} mm does not fit on rods of radius "
            f"{probe.tripod.rod_radius:g} mm; use at most half of it"
        )
    return patch


def _joined(
    probe: Probe, uncut: Sequence[ProbeSolid], patch: float, seats: range
) -> tuple[Any, list[ProbeSolid], list[Any]]:
    """The joined shape, its parts with the patches of some seats, the faces where they meet."""
    from netgen.occ import Glue

    spring = _spring_face(uncut)
    parts = _with_seat_patches(probe, uncut, patch, seats)
    for part in parts:
        part.solid.solids.name = part.name
    spring.name = SPRING
    shape = Glue([part.solid for part in parts])
    owners: dict[Any, list[str]] = {}
    for solid in shape.solids:
        for face in solid.faces:
            owners.setdefault(face, []).append(solid.name)
    _check_joined([part.name for part in parts], owners, parts)
    _check_names(shape, seats)
    return shape, parts, [face for face, names in owners.items() if len(set(names)) > 1]


def _wedge(probe: Probe) -> Any:
    """The space between the planes of azimuth 0 and 60° from the first rod."""
    from netgen.occ import Axes, Dir, Pnt, WorkPlane, Z

    tripod, hub = probe.tripod, probe.hub
    assert hub is not None  # described_solids has checked it
    widths = [hub.radius, tripod.radius, probe.tip.radius, *(s.diameter for s in probe.stylus)]
    side = 4.0 * max(widths)
    height = 2.0 * (hub.height + probe.lever + probe.tip.radius)
    azimuth = tripod.rod_azimuths[0]
    along = Dir(math.cos(azimuth), math.sin(azimuth), 0.0)
    plane = WorkPlane(Axes(Pnt(0, 0, -0.75 * height), n=Z, h=along))
    plane.MoveTo(0, 0).LineTo(side, 0).LineTo(0.5 * side, 0.5 * math.sqrt(3.0) * side).Close()
    return plane.Face().Extrude(height)


def _patch_within_sixth(probe: Probe, patch: float) -> bool:
    """Whether the plug under a seat stays clear of the mirror plane through the rod."""
    angle, rod = probe.seats.support_angle, probe.tripod.rod_radius
    return patch * (math.cos(angle) + math.sin(angle)) < 0.95 * rod * math.cos(angle)


def _mirror_normals(probe: Probe) -> FloatArray:
    """Unit normals of the two planes that bound the sixth, (2, 3)."""
    azimuths = probe.tripod.rod_azimuths[0] + np.array([0.0, math.pi / 3.0])
    return np.stack([-np.sin(azimuths), np.cos(azimuths), np.zeros(2)], axis=1)


def _on_mirror(probe: Probe, face: Any) -> bool:
    """Whether a face of the sixth is a cut through the body. The sixth is convex at its cuts:
    no other face has its centre there.
    """
    centre = np.array([face.center.x, face.center.y, face.center.z])
    return bool(np.any(np.abs(_mirror_normals(probe) @ centre) < _ON_MIRROR))


def _images_joined(probe: Probe, face: Any) -> int:
    """Number of images that a face of the sixth and those that it touches consist of."""
    points = np.array([[v.p.x, v.p.y, v.p.z] for v in face.vertices])
    touched = np.any(np.abs(points @ _mirror_normals(probe).T) < _ON_MIRROR, axis=0)
    return (1, 2, COPIES)[int(touched.sum())]


def write_step(path: str | Path, probe: Probe) -> None:
    """Write the solids of the finite-element model, for CAD."""
    needed("netgen", "fem")
    from netgen.occ import Glue

    parts = described_solids(probe) if probe.step is None else step_solids(probe, probe.step)
    for part in parts:
        part.solid.solids.name = part.name
    with whole_file(path) as temporary:
        Glue([part.solid for part in parts]).WriteStep(str(temporary))


def _check_overlaps(parts: Sequence[ProbeSolid], copies: int = 1) -> None:
    boxes = [_box(part.solid) for part in parts]
    for (first, one), (second, other) in combinations(zip(parts, boxes, strict=True), 2):
        if np.any(one[0] > other[1]) or np.any(other[0] > one[1]):
            continue  # to intersect two solids takes as long as to make them
        try:
            volume = (first.solid * second.solid).mass
        except Exception:  # the solids do not intersect
            continue
        smaller = min(first.solid.mass, second.solid.mass)
        if volume > 1e-6 * smaller:
            raise DescriptionError(
                f"'{first.name}' and '{second.name}' overlap by {copies * volume:.3g} mm³: the "
                "same place cannot have two materials; cut one away or correct its dimensions"
            )


def _box(solid: Any) -> FloatArray:
    """Corners of a box around a solid, (2, 3)."""
    return np.array([[corner.x, corner.y, corner.z] for corner in solid.bounding_box])


def _check_joined(
    names: Sequence[str], owners: Mapping[Any, Sequence[str]], parts: Sequence[ProbeSolid]
) -> None:
    """Check that a chain of common faces joins every part to the first."""
    reached, grown = {names[0]}, True
    while grown:
        grown = False
        for sharing in owners.values():
            if len(sharing) > 1 and reached & set(sharing) and not reached >= set(sharing):
                reached |= set(sharing)
                grown = True
    floating = [part for part in parts if part.name not in reached]
    if not floating:
        return
    loose = floating[0]
    gap, nearest = min(
        (loose.solid.Distance(part.solid), part.name) for part in parts if part.name in reached
    )
    remedy = (
        "they share only an edge or a point; give them a common face"
        if gap < 1e-6
        else f"the nearest part, '{nearest}', is {gap:.3g} mm away; close the gap"
    )
    raise DescriptionError(f"'{loose.name}' is loose: no face joins it to the rest; {remedy}")


def _spring_face(parts: Sequence[ProbeSolid]) -> Any:
    """The highest face of the tripod, on which the spring presses."""
    carriers = {part.name for part in parts if part.carries_seats} | {"hub"}
    faces = [face for part in parts if part.name in carriers for face in part.solid.faces]
    return max(faces, key=lambda face: (round(face.center.z, 9), face.mass))


def _with_seat_patches(
    probe: Probe, parts: Sequence[ProbeSolid], patch: float, seats: range
) -> list[ProbeSolid]:
    """Cut out a small plug under some seats, so that a separate face carries the force."""
    from netgen.occ import Cylinder, Dir, Pnt, Vertex

    frame = seat_frame(probe)
    whole = list(parts)
    plugs: list[ProbeSolid] = []
    contacts = frame.contacts(probe.tripod.rod_radius)
    for index in seats:
        contact, normal = contacts[index], frame.normals[index]
        start = contact - patch * normal
        tool = Cylinder(Pnt(*start), Dir(*map(float, normal)), r=patch, h=2.0 * patch)
        carrier, plug = _cut_by(tool, whole)
        if carrier is None or plug is None:
            vertex = Vertex(Pnt(*contact))
            part = min(
                (part for part in whole if part.carries_seats),
                key=lambda part: float(part.solid.Distance(vertex)),
            )
            _misses(index, contact, part.name, float(part.solid.Distance(vertex)))
        face = plug.faces.Nearest(Pnt(*contact))
        depth = _surface_offset(face, contact, normal)
        if abs(depth) > _SEAT_TOLERANCE:
            _misses(index, contact, whole[carrier].name, abs(depth))
        plug.faces.Nearest(Pnt(*contact)).name = seat_face(index)
        plug.edges.maxh = patch
        host = whole[carrier]
        whole[carrier] = ProbeSolid(host.name, host.solid - tool, host.material, carries_seats=True)
        plugs.append(ProbeSolid(host.name, plug, host.material))
    return [*whole, *plugs]


def _cut_by(tool: Any, parts: Sequence[ProbeSolid]) -> tuple[int | None, Any]:
    for number, part in enumerate(parts):
        if not part.carries_seats:
            continue
        try:
            plug = part.solid * tool
            if plug.mass > 0.2 * tool.mass:
                return number, plug
        except Exception:  # the solids do not intersect
            continue
    return None, None


def _surface_offset(face: Any, contact: FloatArray, normal: FloatArray) -> float:
    """Distance from the described contact point to the face, along the normal. [mm]"""
    centre = np.array([face.center.x, face.center.y, face.center.z])
    return float((centre - contact) @ normal)


def _misses(index: int, contact: FloatArray, part: str, distance: float) -> NoReturn:
    raise DescriptionError(
        f"seat {SEAT_NAMES[index]} should touch the tripod at ({contact[0]:.3f}, {contact[1]:.3f}, "
        f"{contact[2]:.3f}) mm, but the surface of '{part}' is {distance:.3g} mm away: correct "
        "radius_mm, rod_azimuths_deg, rod_radius_mm or support_angle_deg, or move the solids"
    )


def _check_names(shape: Any, seats: range) -> None:
    names = {face.name for face in shape.faces}
    missing = [name for name in [SPRING, *(seat_face(seat) for seat in seats)] if name not in names]
    if missing:
        raise DescriptionError(
            f"the face '{missing[0]}' was lost while the parts were joined; two parts may nearly "
            "coincide there: correct their dimensions"
        )


def _reentrant_edges(
    shape: Any, parts: Sequence[ProbeSolid], patch: float
) -> list[tuple[Any, float]]:
    """Edges around which more than half is solid, with length / pi as their diameter.

    Of sixteen points on a small circle around the middle of each edge, those inside are counted.
    """
    found = []
    is_inside = _inside_any([part.solid for part in parts])
    turns = np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False) + 0.1
    for edge in set(shape.edges):
        if edge.mass < 2.0 * math.pi * patch * 1.2:  # the seats' own patches
            continue
        middle = 0.5 * sum(edge.parameter_interval)
        point, tangent = edge.Value(middle), edge.Tangent(middle)
        centre = np.array([point.x, point.y, point.z])
        along = np.array([tangent.x, tangent.y, tangent.z])
        across = np.linalg.svd(along.reshape(1, 3))[2][1:]
        radius = min(0.02 * edge.mass, 0.05)
        circle = centre + radius * (
            np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1]
        )
        inside = sum(is_inside(place) for place in circle)
        if 0.55 * len(turns) < inside < 0.95 * len(turns):
            found.append((edge, edge.mass / math.pi))
    return found


def _inside_any(bodies: Sequence[Any]) -> Callable[[FloatArray], bool]:
    """Whether a point lies in one of the bodies; only those whose boxes contain it are asked."""
    from netgen.occ import Pnt, Vertex

    boxes = [
        (np.array([*low]), np.array([*high]))
        for low, high in (body.bounding_box for body in bodies)
    ]

    def is_inside(place: FloatArray) -> bool:
        near = [
            body
            for body, (low, high) in zip(bodies, boxes, strict=True)
            if np.all((low <= place) & (place <= high))
        ]
        vertex = Vertex(Pnt(*(float(value) for value in place)))
        return any(body.Distance(vertex) < 1e-9 for body in near)

    return is_inside


def _thickness(parts: Sequence[ProbeSolid]) -> dict[str, float]:
    """By region: diameter of a cylinder of the same volume and length (thickest solid)."""
    thickness: dict[str, float] = {}
    for part in parts:
        for solid in part.solid.solids:
            tensor = solid.inertia  # computed at each call
            inertia = np.array([[tensor[i, j] for j in range(3)] for i in range(3)])
            spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia
            length = math.sqrt(12.0 * np.linalg.eigvalsh(spread)[-1] / solid.mass)
            size = math.sqrt(4.0 * solid.mass / (math.pi * length))
            thickness[part.name] = max(thickness.get(part.name, 0.0), size)
    return thickness
