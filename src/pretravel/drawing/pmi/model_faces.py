"""Faces of a STEP file as its text states them: kind, place, axis and radius in mm."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pretravel.base import FloatArray, PretravelError
from pretravel.drawing.pmi.items import Triple
from pretravel.drawing.pmi.measures import LENGTH_UNIT, unit_factor
from pretravel.drawing.pmi.part21 import Instance, Part21, TextReference, Word
from pretravel.surface import Part
from pretravel.uncertainty import across

FACE_ENTITIES = ("ADVANCED_FACE", "FACE_SURFACE")
SHELL_ENTITIES = ("CLOSED_SHELL", "OPEN_SHELL")
SOLID_ENTITIES = ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "SHELL_BASED_SURFACE_MODEL")
SURFACE_KINDS = {
    "PLANE": "plane",
    "CYLINDRICAL_SURFACE": "cylinder",
    "CONICAL_SURFACE": "cone",
    "SPHERICAL_SURFACE": "sphere",
    "TOROIDAL_SURFACE": "torus",
}
"""Surfaces that are measured as features; others are compared with a profile only."""
_SAME = 1e-4
"""Between faces of one surface: distance [mm], and sine of an angle."""
_ON_FACE = 0.02
"""Largest distance of a corner of a face from the same face as the CAD kernel has it. [mm]"""


@dataclass(frozen=True, eq=False)
class ModelFace:
    """A face of the text.

    Attributes
    ----------
    number : int
        Of its instance.
    kind : str
        plane, cylinder, cone, sphere, torus; another surface by the name of its entity.
    corners : (m, 3) float
        [mm]
    point, direction : (3,) float or None
        Of a plane a point and the normal away from the material; else centre and axis. [mm]
    radius : float
        Zero where it has none. [mm]
    inward : bool
        Whether the material is outside, as around a bore.
    """

    number: int
    kind: str
    corners: FloatArray
    point: FloatArray | None = None
    direction: FloatArray | None = None
    radius: float = 0.0
    inward: bool = False


def length_factor(part21: Part21) -> float:
    """What one unit of the geometry is in mm.

    Raises
    ------
    PretravelError
        It is not stated, or two geometries of the file have different ones.
    """
    found = set()
    for solid in part21.named(*SOLID_ENTITIES):
        for each in part21.instances.values():
            if not any(name.endswith("SHAPE_REPRESENTATION") for name in each.names):
                continue
            values = each.values("REPRESENTATION")
            if len(values) > 2 and TextReference(solid.number) in (values[1] or ()):
                found |= set(_lengths(part21, values[2]))
    if len(found) != 1:
        raise PretravelError(
            f"{part21.path}: the unit of the geometry is "
            f"{'not stated' if not found else 'not one: ' + str(sorted(found)) + ' mm'}"
        )
    return found.pop()


def _lengths(part21: Part21, context: Any) -> Iterable[float]:
    for record in part21[context].records:
        if record.name == "GLOBAL_UNIT_ASSIGNED_CONTEXT":
            for unit in record.values[0]:
                factor = unit_factor(part21, unit)
                if factor is not None and factor[1] == LENGTH_UNIT:
                    yield factor[0]


def model_faces(part21: Part21) -> dict[int, ModelFace]:
    """All faces of the text by the numbers of their instances, in the order of their shells."""
    factor = length_factor(part21)
    ordered = [item.number for shell in part21.named(*SHELL_ENTITIES) for item in shell.values()[1]]
    rest = [each.number for each in part21.named(*FACE_ENTITIES)]
    numbers = [number for number in dict.fromkeys([*ordered, *rest]) if number in set(rest)]
    return {number: _face(part21, part21[number], factor) for number in numbers}


def _face(part21: Part21, face: Instance, factor: float) -> ModelFace:
    _, bounds, surface, sense = face_values(face)
    corners = factor * np.array(list(_corners(part21, bounds)), dtype=np.float64).reshape(-1, 3)
    own = part21[surface]
    name = next(iter(own.names & set(SURFACE_KINDS)), "")
    if not name or own.text.startswith("("):
        kind = min(own.names, key=len).lower().replace("_", " ")
        return ModelFace(face.number, SURFACE_KINDS.get(name, kind), corners)
    _, placement, *sizes = own.values()
    point, direction = _placement(part21, placement)
    with_surface = sense == Word("T")
    if name == "PLANE" and not with_surface:
        direction = -direction
    radius = factor * float(sizes[-1 if name == "TOROIDAL_SURFACE" else 0]) if sizes else 0.0
    place = factor * point
    return ModelFace(
        face.number, SURFACE_KINDS[name], corners, place, direction, radius, not with_surface
    )


def face_values(face: Instance) -> tuple[Any, ...]:
    """Name, bounds, surface and sense of a face."""
    return face.values("REPRESENTATION_ITEM", "FACE", "FACE_SURFACE", "ADVANCED_FACE")[:4]


def edges_of_face(part21: Part21, face: Instance) -> Iterable[int]:
    """Numbers of the edges of a face."""
    for bound in face_values(face)[1]:
        loop = part21[part21[bound].values()[1]]
        if loop.names == {"EDGE_LOOP"}:
            for oriented in loop.values()[1]:
                yield part21[oriented].values()[3].number


def _corners(part21: Part21, bounds: Any) -> Iterable[tuple[float, ...]]:
    for bound in bounds:
        loop = part21[part21[bound].values()[1]]
        if loop.names == {"VERTEX_LOOP"}:
            yield part21[part21[loop.values()[1]].values()[1]].values()[1]
        elif loop.names == {"EDGE_LOOP"}:
            for oriented in loop.values()[1]:
                edge = part21[part21[oriented].values()[3]]
                for vertex in edge.values("EDGE", "EDGE_CURVE")[1:3]:
                    yield part21[part21[vertex].values()[1]].values()[1]


def _placement(part21: Part21, placement: Any) -> tuple[FloatArray, FloatArray]:
    _, point, axis, *_ = part21[placement].values()
    place = np.array(part21[point].values()[1], dtype=np.float64)
    if axis is None:
        return place, np.array([0.0, 0.0, 1.0])
    direction = np.array(part21[axis].values()[1], dtype=np.float64)
    return place, direction / np.linalg.norm(direction)


def placed_axes(part21: Part21, placement: Instance) -> tuple[Triple, tuple[Triple, Triple]]:
    """Origin of a placement [mm], and its x and z axes."""
    point, z = _placement(part21, TextReference(placement.number))
    stated = placement.values()[3]
    x = np.array([1.0, 0.0, 0.0] if stated is None else part21[stated].values()[1], dtype=float)
    x = x - (x @ z) * z
    if np.linalg.norm(x) < 1e-9:  # no direction, or that of z: any across it
        x = across(z)[0]
    return (
        triple(length_factor(part21) * point),
        (triple(x / np.linalg.norm(x)), triple(z)),
    )


def triple(values: Iterable[float], digits: int = 9) -> Triple:
    """Three numbers without noise beyond some digits."""
    x, y, z = (round(float(value), digits) + 0.0 for value in values)
    return x, y, z


def numbers_of_faces(faces: dict[int, ModelFace], part: Part) -> dict[int, int]:
    """The numbers that `pretravel faces` lists, by the numbers of the instances.

    A face is found where the corners of the text lie on it: first by the order, else among all
    faces of its kind. A face that lies elsewhere, or that two could be, is left out.

    Parameters
    ----------
    faces : mapping of int to ModelFace
    part : Part
    """
    by_number = {face.number: face for face in part.faces}
    found: dict[int, int] = {}
    for order, (number, own) in enumerate(faces.items(), start=1):
        first = by_number.get(order)
        if first is not None and _is(own, first):
            found[number] = order
            continue
        others = [face.number for face in part.faces if _is(own, face)]
        if len(others) == 1:
            found[number] = others[0]
    return found


def _is(own: ModelFace, face: Any) -> bool:
    if own.kind in SURFACE_KINDS.values() and own.kind != face.kind:
        return False
    if not len(own.corners):
        return own.kind in SURFACE_KINDS.values()
    low, high = face.bounds
    if ((own.corners < low - _ON_FACE) | (own.corners > high + _ON_FACE)).any():
        return False
    return bool((face.distance(own.corners, 1.0) < _ON_FACE).all())


def surfaces_of(faces: Iterable[ModelFace]) -> list[tuple[ModelFace, ...]]:
    """Faces in groups of one surface each: the halves of a bore, the pieces of a plane.

    Two bores of one axis and one radius are two where there is room between them.
    """
    groups: list[list[ModelFace]] = []
    for face in faces:
        same = [g for g in groups if any(_one_surface(face, other) for other in g)]
        groups = [g for g in groups if g not in same] + [[*(f for g in same for f in g), face]]
    return [tuple(sorted(g, key=lambda f: f.number)) for g in groups]


def _one_surface(a: ModelFace, b: ModelFace) -> bool:
    if a.kind != b.kind or (a.inward != b.inward and a.kind != "plane"):
        return False
    if a.point is None or b.point is None or a.direction is None or b.direction is None:
        return False
    if abs(a.radius - b.radius) > _SAME:
        return False
    apart = b.point - a.point
    if a.kind == "sphere":
        return bool(np.linalg.norm(apart) < _SAME)
    if a.kind == "plane":
        return bool(a.direction @ b.direction > 1.0 - _SAME and abs(apart @ a.direction) < _SAME)
    if np.linalg.norm(np.cross(a.direction, b.direction)) > _SAME:
        return False
    if np.linalg.norm(apart - (apart @ a.direction) * a.direction) > _SAME:
        return False
    if a.kind == "torus":
        return bool(np.linalg.norm(apart) < _SAME)
    (a0, a1), (b0, b1) = (_along(each, a.direction) for each in (a, b))
    return a0 <= b1 + _SAME and b0 <= a1 + _SAME


def _along(face: ModelFace, direction: FloatArray) -> tuple[float, float]:
    """From where to where it reaches."""
    heights = face.corners @ direction
    return (float(heights.min()), float(heights.max())) if len(heights) else (0.0, 0.0)
