"""Parts from the content of CAD files: every face as a surface, with its edges and its outside."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from pretravel.base import InputError, PretravelError
from pretravel.surface.cad.boundary import face_boundary
from pretravel.surface.cad.brep import Brep, ShapeUse
from pretravel.surface.cad.brep_geometry import SurfaceRecord
from pretravel.surface.cad.face import Face, lattice
from pretravel.surface.cad.kernel_process import CadContent
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_reader import read_step
from pretravel.surface.cad.trim import Trim
from pretravel.surface.local_geometry import Surface
from pretravel.surface.shapes_of_revolution import Torus
from pretravel.surface.swept import Offset, Placed

_logger = logging.getLogger("pretravel")

_PROGRESS = 50
"""Number of faces after which progress is reported."""


def read_step_part(path: str | Path) -> Part:
    """Read all faces of a STEP file, of all its parts in their places.

    Parameters
    ----------
    path : str or Path
        AP203, AP214 or AP242, in any unit of length.

    Returns
    -------
    Part
        In mm. `Part.unreadable` contains the faces that cannot be used, with the reasons.

    Raises
    ------
    InputError
        No STEP file, or one without faces.
    """
    path = Path(path)
    return part_from_content(read_step(path), path)


def part_from_content(content: CadContent, path: Path) -> Part:
    """The faces of a CAD file that was read.

    Parameters
    ----------
    content : CadContent
    path : Path
        Of the file, for its name and for messages.

    Raises
    ------
    InputError
        No faces, or none that can be used.
    """
    uses = list(_face_uses(content.brep))
    if not uses:
        raise InputError(
            "has no faces: it contains only wires, points or triangles; export the part as a solid "
            "or surface (AP214 or AP242 with exact geometry)",
            path=path,
        )
    names, parts = (
        words if len(words) == len(uses) else ("",) * len(uses)
        for words in (content.face_names, content.part_names)
    )
    faces, unreadable = [], {}
    named = zip(uses, names, parts, strict=True)
    for number, (use, name, part) in enumerate(named, start=1):
        if number % _PROGRESS == 0:
            _logger.info("face %d of %d", number, len(uses))
        try:
            faces.append(replace(_face(content, use, number, name), part=part))
        except (PretravelError, ValueError, FloatingPointError) as error:
            unreadable[number] = str(error)
    if not faces:
        number, reason = next(iter(unreadable.items()))
        raise InputError(
            f"none of its {len(uses)} faces can be used; face {number}: {reason}", path=path
        )
    return Part(path.name, tuple(faces), tuple(range(len(faces))), unreadable)


def _face_uses(brep: Brep) -> Iterator[ShapeUse]:
    """Every face once, in the kernel's order, with its placement and orientation in the part."""
    seen: set[tuple[int, bytes]] = set()
    stack = [ShapeUse(use.index, use.reverses, use.placement) for use in reversed(brep.roots)]
    while stack:
        use = stack.pop()
        shape = brep.shapes[use.index]
        if shape.kind == "Fa":
            key = (use.index, np.round(use.placement, 9).tobytes())
            if key not in seen:
                seen.add(key)
                yield use
            continue
        if shape.kind in ("Wi", "Ed", "Ve"):
            continue
        stack.extend(
            ShapeUse(part.index, use.reverses != part.reverses, use.placement @ part.placement)
            for part in reversed(shape.parts)
        )


def _face(content: CadContent, use: ShapeUse, number: int, name: str) -> Face:
    brep = content.brep
    shape = brep.shapes[use.index]
    record = brep.surfaces[shape.surface - 1]
    if record.surface is None:
        raise PretravelError(f"{record.kind}: {record.problem}")
    placement = use.placement @ shape.placement
    turn = placement[:3, :3]
    if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-6:
        raise PretravelError("its placement in the part changes its scale")
    mirrored = float(np.linalg.det(turn)) < 0.0
    if mirrored and not content.closed + content.open:
        raise PretravelError("its placement in the part mirrors it")
    rings, borders = face_boundary(brep, shape, record.surface)
    trim = Trim(rings, record.surface.domain.period) if rings else None
    if trim is not None and not borders and trim.covers(record.surface.domain):
        trim = None  # a closed surface, a whole sphere for example: its rings are seams
    record = _one_side(record, trim)
    assert record.surface is not None  # refused above
    surface: Surface = record.surface
    if np.abs(placement - np.eye(4)).max() > 0.0:
        surface = Placed(surface, turn, placement[:3, 3])
    if trim is None and not np.all(np.isfinite([*surface.domain.lower, *surface.domain.upper])):
        raise PretravelError(f"{record.kind} without edges, which is unbounded")
    against = record.along_parameters < 0
    # The kernel's normal is that of the placed derivatives, and a mirror turns it over.
    flips = use.reverses ^ against ^ mirrored
    return Face(number, name, record.kind, surface, trim, flips, tuple(borders))


def _one_side(record: SurfaceRecord, trim: Trim | None) -> SurfaceRecord:
    """The part of a self-intersecting surface on which the face lies.

    Across the intersection the outside of the surface changes, so a face on both parts has no
    outside.

    Raises
    ------
    PretravelError
        A face on both parts, or an offset beyond its centre of curvature.
    """
    surface = record.surface
    if isinstance(surface, Torus) and surface.radius < surface.tube_radius:
        # All of the face, not its edges alone: those of both whole parts are on the axis.
        low, high = (0.0, 2.0 * np.pi) if trim is None else (trim.lower[1], trim.upper[1])
        v = np.linspace(low, high, 721)
        from_axis = surface.radius + surface.tube_radius * np.cos(v)
        slack = 1e-6 * surface.tube_radius
        if from_axis.max() <= slack:
            barrel = Torus(
                surface.origin, surface.radius, surface.tube_radius, surface.axes, inner=True
            )
            return replace(record, surface=barrel, along_parameters=-record.along_parameters)
        if from_axis.min() < -slack:
            raise PretravelError(
                "torus whose tube crosses its own axis; the face lies on both sides of the axis"
            )
    if isinstance(surface, Offset):
        domain = surface.domain if trim is None else trim.domain(surface.domain)
        samples = lattice(np.array(domain.lower), np.array(domain.upper), np.array([15, 15]))
        bends = surface.basis.local(samples).principal_curvatures
        if np.nanmin(1.0 + surface.distance * bends) <= 0.0:
            raise PretravelError(
                f"{record.kind} by {surface.distance:g} mm, beyond its centre of curvature"
            )
    return record
