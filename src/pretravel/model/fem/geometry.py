"""The moving part of the probe as solids: hub, rods, stylus, tip, cut where the seats push.

The CAD kernel is OpenCASCADE as netgen brings it; lengths are in mm.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import DescriptionError, InputError
from pretravel.probe.description import Probe, StepGeometry
from pretravel.probe.materials import Material
from pretravel.probe.seat_frame import SEAT_NAMES, seat_frame
from pretravel.surface.cad.step_reader import read_step_solids
from pretravel.whole_file import whole_file

SPRING = "spring"
"""Name of the face that the spring presses on."""
TIP = "tip"
"""Name of the region that touches the part."""
PATCH = 0.13
"""Radius of the patch that a seat's force is spread over, over the rod's radius."""
_SEAT_TOLERANCE = 0.02
"""How far the rods' surface may be from where the description puts the seats. [mm]"""


def seat_face(index: int) -> str:
    """Name of the face that a seat pushes on.

    >>> seat_face(0)
    'seat A-left'
    """
    return f"seat {SEAT_NAMES[index]}"


@dataclass(frozen=True, eq=False)
class ProbeSolids:
    """Solids that share their faces, ready for a mesh.

    Attributes
    ----------
    shape : OpenCASCADE compound
        Solids named by region, faces named `seat_face` and `SPRING`.
    materials : mapping of region to Material
    thickness : mapping of region to float
        What the element size is measured by: sqrt(4 volume / (pi length)). [mm]
    refined : sequence of (edges, float)
        Edges where stresses peak: of faces where two regions meet, and re-entrant ones;
        with the diameter that their elements are measured by. [mm]
    patch_radius : float
        Of the patches that the seats' forces are spread over. [mm]
    """

    shape: Any
    materials: Mapping[str, Material]
    thickness: Mapping[str, float]
    refined: Sequence[tuple[Any, float]]
    patch_radius: float


@dataclass(frozen=True)
class Part:
    """One solid before the parts are joined."""

    name: str
    solid: Any
    material: Material
    carries_seats: bool = False


def probe_solids(probe: Probe, patch_radius: float | None = None) -> ProbeSolids:
    """The solids of a probe, from its description or its STEP file.

    Parameters
    ----------
    probe : Probe
        With a hub, or a STEP geometry.
    patch_radius : float, optional
        Of the patches under the seats; `PATCH` of the rod's radius when not given. [mm]

    Returns
    -------
    ProbeSolids

    Raises
    ------
    DescriptionError
        No hub described; parts that overlap, float, or miss the seats.
    InputError
        A STEP file that cannot be read, or has no such solid.

    >>> from pretravel.probe.catalogue import load_probe
    >>> sorted(probe_solids(load_probe("omp40-2")).materials)
    ['holder', 'hub', 'rods', 'stylus 1', 'stylus 2', 'tip']
    """
    patch = PATCH * probe.tripod.rod_radius if patch_radius is None else patch_radius
    if not 0.0 < patch <= 0.5 * probe.tripod.rod_radius:
        raise DescriptionError(
            f"a seat patch of radius {patch:g} mm does not fit on rods of radius "
            f"{probe.tripod.rod_radius:g} mm; take at most half of it"
        )
    parts = described_parts(probe) if probe.step is None else _step_parts(probe, probe.step)
    _check_overlaps(parts)
    spring, uncut = _spring_face(parts), parts
    parts = _with_seat_patches(probe, parts, patch)
    from netgen.occ import Glue

    for part in parts:
        part.solid.solids.name = part.name
    spring.name = SPRING
    shape = Glue([part.solid for part in parts])
    owners: dict[Any, list[str]] = {}
    for solid in shape.solids:
        for face in solid.faces:
            owners.setdefault(face, []).append(solid.name)
    _check_joined([part.name for part in parts], owners, parts)
    meeting = [face for face, names in owners.items() if len(set(names)) > 1]
    _check_names(shape)
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


def write_step(path: str | Path, probe: Probe) -> None:
    """Write the solids that the finite-element model is made of, for CAD.

    Parameters
    ----------
    path : str or Path
    probe : Probe
    """
    from netgen.occ import Glue

    parts = described_parts(probe) if probe.step is None else _step_parts(probe, probe.step)
    for part in parts:
        part.solid.solids.name = part.name
    with whole_file(path) as temporary:
        Glue([part.solid for part in parts]).WriteStep(str(temporary))


def described_parts(probe: Probe) -> list[Part]:
    """The solids of a description, before the seats' patches are cut.

    Raises
    ------
    DescriptionError
        No hub described; dimensions that cannot be.
    """
    from netgen.occ import Cylinder, Dir, Pnt, Sphere, Z

    hub = probe.hub
    if hub is None:
        raise DescriptionError(
            "the finite-element model needs the hub's shape: add radius_mm, height_mm, "
            "holder_diameter_mm and material to [hub] (pretravel probes omp40-2 shows one), or "
            "name the solids of a STEP file in [geometry]"
        )
    tripod, root = probe.tripod, -probe.hub_offset
    below = -0.5 * hub.height
    if root >= below - 1e-6:
        raise DescriptionError(
            f"[hub]: a disc of height {hub.height:g} mm around the rod axes reaches {-below:g} mm "
            f"down, but the stylus's root is only {-root:g} mm below them; lower height_mm or "
            "raise offset_mm"
        )
    if hub.radius >= tripod.radius - 2.0 * tripod.rod_radius:
        raise DescriptionError(
            f"[hub]: a disc of radius {hub.radius:g} mm reaches the seats at "
            f"{tripod.radius:g} mm; rods of radius {tripod.rod_radius:g} mm need room there: "
            f"radius_mm below {tripod.radius - 2.0 * tripod.rod_radius:g}"
        )
    if 0.5 * hub.height <= tripod.rod_radius:
        raise DescriptionError(
            f"[hub]: rods of radius {tripod.rod_radius:g} mm do not fit into a disc of height "
            f"{hub.height:g} mm; raise height_mm above {2.0 * tripod.rod_radius:g}"
        )
    if 0.5 * hub.holder_diameter > hub.radius:
        raise DescriptionError(
            f"[hub]: the holder of diameter {hub.holder_diameter:g} mm is wider than the disc of "
            f"radius {hub.radius:g} mm that carries it"
        )
    if probe.tip.radius < 0.505 * probe.stylus[-1].diameter:
        raise DescriptionError(
            f"a tip of radius {probe.tip.radius:g} mm on a stem of diameter "
            f"{probe.stylus[-1].diameter:g} mm: the stem's side touches the ball like a tangent, "
            f"which no mesh fills; make the tip at least {0.505 * probe.stylus[-1].diameter:g} mm"
        )
    apart = 2.0 * tripod.rod_radius * math.cos(probe.seats.support_angle)
    if apart < 2.2 * PATCH * tripod.rod_radius:
        raise DescriptionError(
            f"[seats]: at a support angle of {math.degrees(probe.seats.support_angle):.3g}° the "
            f"two seats of a rod are only {apart:.3g} mm apart, which the finite-element model "
            "cannot tell from one; lower support_angle_deg"
        )
    disc = Cylinder(Pnt(0, 0, below), Z, r=hub.radius, h=hub.height)
    holder = Cylinder(Pnt(0, 0, root), Z, r=0.5 * hub.holder_diameter, h=below - root)
    # The rods end one radius beyond the seats: what lies further out carries nothing.
    rods = None
    for azimuth in tripod.rod_azimuths:
        axis = Dir(math.cos(azimuth), math.sin(azimuth), 0.0)
        length = tripod.radius + tripod.rod_radius
        rod = Cylinder(Pnt(0, 0, 0), axis, r=tripod.rod_radius, h=length) - disc
        rods = rod if rods is None else rods + rod
    parts = [
        Part("hub", disc, hub.material),
        Part("holder", holder, hub.material),
        Part("rods", rods, tripod.material, carries_seats=True),
    ]
    centre = Pnt(0, 0, -probe.lever)
    ball = Sphere(centre, probe.tip.radius)
    top = root
    for number, segment in enumerate(probe.stylus, start=1):
        bottom = Pnt(0, 0, top - segment.length)
        piece = Cylinder(bottom, Z, r=0.5 * segment.diameter, h=segment.length)
        if number == len(probe.stylus):
            piece = piece - ball
        parts.append(Part(f"stylus {number}", piece, segment.material))
        top -= segment.length
    return [*parts, Part(TIP, ball, probe.tip.material)]


def _step_parts(probe: Probe, step: StepGeometry) -> list[Part]:
    path = Path(step.path)
    if not path.is_file():
        raise InputError("no such file; [geometry] step is looked for beside the TOML", path=path)
    solids = read_step_solids(path)
    listing = "; ".join(
        f"#{number} '{solid.name or ''}' {solid.mass:.0f} mm³"
        for number, solid in enumerate(solids, start=1)
    )
    counted = Counter(solid.name for solid in solids)

    def picked(selector: str) -> list[Any]:
        """One solid by number, or all of a name (three rods, say)."""
        if selector.startswith("#") and selector[1:].isdigit():
            number = int(selector[1:])
            if 1 <= number <= len(solids):
                return [solids[number - 1]]
        elif counted[selector]:
            return [solid for solid in solids if solid.name == selector]
        raise InputError(f"there is no solid '{selector}'; there are {listing}", path=path)

    chosen = [*step.tripod, *step.stylus, *step.tip]
    twice = [name for name, count in Counter(chosen).items() if count > 1]
    if twice:
        raise DescriptionError(f"[geometry]: solid '{twice[0]}' is named for two parts")
    unknown = [name for name in step.materials if name not in chosen]
    if unknown:
        raise DescriptionError(
            f"[geometry] materials: '{unknown[0]}' is none of the chosen solids, "
            f"{', '.join(chosen)}"
        )
    if len(step.tip) != 1 or len(picked(step.tip[0])) != 1:
        raise DescriptionError("[geometry] tip: the tip is one solid")
    usual = {
        "tripod": [probe.tripod.material] * len(step.tripod),
        "stylus": _stylus_materials(probe, step),
        TIP: [probe.tip.material],
    }
    parts = []
    for role, selectors in (("tripod", step.tripod), ("stylus", step.stylus), (TIP, step.tip)):
        for selector, material in zip(selectors, usual[role], strict=True):
            name = TIP if role == TIP else f"{role}: {selector}"
            parts += [
                Part(name, solid, step.materials.get(selector, material), role == "tripod")
                for solid in picked(selector)
            ]
    _check_tip(probe, parts[-1].solid, path)
    return parts


def _stylus_materials(probe: Probe, step: StepGeometry) -> list[Material]:
    """The described segments' materials in order; where numbers differ, only if all are one."""
    described = [segment.material for segment in probe.stylus]
    if len(step.stylus) == len(described):
        return described
    missing = [selector for selector in step.stylus if selector not in step.materials]
    if missing and len(set(described)) > 1:
        raise DescriptionError(
            f"[geometry]: the stylus has {len(step.stylus)} solids and [[stylus]] {len(described)} "
            f"segments of several materials; say of what '{missing[0]}' is: "
            f'materials = {{ "{missing[0]}" = "ceramic" }}'
        )
    return [described[0]] * len(step.stylus)


def _check_tip(probe: Probe, solid: Any, path: Path) -> None:
    """The tip of a STEP file must be where and as large as the description says."""
    low, high = solid.bounding_box
    centre = np.array([0.5 * (low[i] + high[i]) for i in range(3)])
    radius = 0.5 * max(high[i] - low[i] for i in range(3))
    for factor, unit in ((25.4, "inch"), (10.0, "cm"), (1000.0, "m")):
        if abs(radius * factor / probe.tip.radius - 1.0) < 0.02:
            raise DescriptionError(
                f"{path}: the tip has a radius of {radius:.4g} mm, {factor:g} times less than the "
                f"{probe.tip.radius:g} mm described: are its numbers in {unit}? Export it in mm"
            )
    if abs(radius - probe.tip.radius) > 0.01 * probe.tip.radius:
        raise DescriptionError(
            f"{path}: the tip has a radius of {radius:.4g} mm, but [tip] says "
            f"{probe.tip.radius:g} mm, which points would be compensated with: correct one of them"
        )
    away = math.dist(centre, (0.0, 0.0, -probe.lever))
    if away > 0.05 * probe.tip.radius:
        raise DescriptionError(
            f"{path}: the tip's centre lies at ({centre[0]:.3f}, {centre[1]:.3f}, "
            f"{centre[2]:.3f}) mm, but the description puts it at (0, 0, {-probe.lever:g}): move "
            "the solids into the probe's frame (origin on the axis in the plane of the rods, z "
            "upwards) or correct stylus lengths and hub offset"
        )


def part_name(region: str) -> str:
    """The part that a region belongs to: tripod, stylus, tip; or hub, holder, rods.

    >>> part_name("stylus 2"), part_name("tripod: hub")
    ('stylus', 'tripod')
    """
    return region.partition(":")[0].rstrip(" 0123456789")


def _check_overlaps(parts: Sequence[Part]) -> None:
    for first, second in combinations(parts, 2):
        try:
            volume = (first.solid * second.solid).mass
        except Exception:  # nothing in common at all
            continue
        smaller = min(first.solid.mass, second.solid.mass)
        if volume > 1e-6 * smaller:
            raise DescriptionError(
                f"'{first.name}' and '{second.name}' overlap by {volume:.3g} mm³: the same place "
                "cannot have two materials; cut one away or correct its dimensions"
            )


def _check_joined(
    names: Sequence[str], owners: Mapping[Any, Sequence[str]], parts: Sequence[Part]
) -> None:
    """Every part must hang together with the first, by whole faces."""
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
        "they meet in an edge or point only; give them a face in common"
        if gap < 1e-6
        else f"the nearest part, '{nearest}', is {gap:.3g} mm away; close the gap"
    )
    raise DescriptionError(f"'{loose.name}' floats: no face joins it to the rest; {remedy}")


def _spring_face(parts: Sequence[Part]) -> Any:
    """The highest face of the tripod (of whichever part): the spring stands on it."""
    carriers = {part.name for part in parts if part.carries_seats} | {"hub"}
    faces = [face for part in parts if part.name in carriers for face in part.solid.faces]
    return max(faces, key=lambda face: (round(face.center.z, 9), face.mass))


def _with_seat_patches(probe: Probe, parts: Sequence[Part], patch: float) -> list[Part]:
    """Cut a small plug out under each seat, so that a face of its own takes the force."""
    from netgen.occ import Cylinder, Dir, Pnt, Vertex

    frame = seat_frame(probe)
    whole = list(parts)
    plugs: list[Part] = []
    for index, (contact, normal) in enumerate(
        zip(frame.contacts(probe.tripod.rod_radius), frame.normals, strict=True)
    ):
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
        whole[carrier] = Part(host.name, host.solid - tool, host.material, carries_seats=True)
        plugs.append(Part(host.name, plug, host.material))
    return [*whole, *plugs]


def _cut_by(tool: Any, parts: Sequence[Part]) -> tuple[int | None, Any]:
    for number, part in enumerate(parts):
        if not part.carries_seats:
            continue
        try:
            plug = part.solid * tool
            if plug.mass > 0.2 * tool.mass:
                return number, plug
        except Exception:  # nothing in common
            continue
    return None, None


def _surface_offset(face: Any, contact: FloatArray, normal: FloatArray) -> float:
    """How far below the described contact point the face begins, along the normal. [mm]"""
    centre = np.array([face.center.x, face.center.y, face.center.z])
    return float((centre - contact) @ normal)


def _misses(index: int, contact: FloatArray, part: str, distance: float) -> NoReturn:
    raise DescriptionError(
        f"seat {SEAT_NAMES[index]} should touch the tripod at ({contact[0]:.3f}, {contact[1]:.3f}, "
        f"{contact[2]:.3f}) mm, but the surface of '{part}' is {distance:.3g} mm away: correct "
        "radius_mm, rod_azimuths_deg, rod_radius_mm or support_angle_deg, or move the solids"
    )


def _check_names(shape: Any) -> None:
    names = {face.name for face in shape.faces}
    missing = [name for name in [SPRING, *(seat_face(k) for k in range(6))] if name not in names]
    if missing:
        raise DescriptionError(
            f"the face '{missing[0]}' was lost while the parts were joined; two parts may nearly "
            "coincide there: correct their dimensions"
        )


def _reentrant_edges(shape: Any, parts: Sequence[Part], patch: float) -> list[tuple[Any, float]]:
    """Edges around which more than half is solid, with length / pi as their diameter.

    Sixteen points on a small circle around the middle of each edge are asked whether
    they lie inside.
    """
    from netgen.occ import Pnt, Vertex

    found = []
    bodies = [part.solid for part in parts]
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
        inside = 0
        for x, y, z in circle:
            vertex = Vertex(Pnt(float(x), float(y), float(z)))
            inside += any(body.Distance(vertex) < 1e-9 for body in bodies)
        if 0.55 * len(turns) < inside < 0.95 * len(turns):
            found.append((edge, edge.mass / math.pi))
    return found


def _thickness(parts: Sequence[Part]) -> dict[str, float]:
    """By region: diameter of a cylinder of the same volume and length (thickest solid)."""
    thickness: dict[str, float] = {}
    for part in parts:
        for solid in part.solid.solids:
            inertia = np.array([[solid.inertia[i, j] for j in range(3)] for i in range(3)])
            spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia
            length = math.sqrt(12.0 * np.linalg.eigvalsh(spread)[-1] / solid.mass)
            size = math.sqrt(4.0 * solid.mass / (math.pi * length))
            thickness[part.name] = max(thickness.get(part.name, 0.0), size)
    return thickness
