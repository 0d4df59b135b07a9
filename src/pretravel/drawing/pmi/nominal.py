"""Nominal places of features, and what is between them, by the faces of the text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import FloatArray
from pretravel.drawing.pmi.items import DatumTarget, Place, Pmi, Size
from pretravel.drawing.pmi.model_faces import ModelFace, triple
from pretravel.measurement import SHORTEST

SAME = 1e-3
"""Between a nominal value of the PMI and that of its faces. [mm or degrees]"""
_OF_NO_DIAMETER = {"depth", "length", "height", "width", "thickness", "thread", "pitch", "major",
                   "minor", "toroidal"}  # fmt: skip
"""Words in the name of a size that is none of the cylinder or sphere to which it is bound."""


def two_planes(groups: Sequence[Sequence[ModelFace]]) -> bool:
    """Whether these are two surfaces, both plane."""
    return len(groups) == 2 and all(each[0].kind == "plane" for each in groups)


def opposite(groups: Sequence[Sequence[ModelFace]]) -> bool:
    """Whether two planes face one another or away from one another."""
    a, b = (each[0].direction for each in groups)
    return a is not None and b is not None and float(a @ b) < -1.0 + 1e-6


def faces_away(groups: Sequence[Sequence[ModelFace]]) -> bool:
    """Whether two opposite planes have the material between them, as a rib, unlike a slot."""
    a, b = (each[0] for each in groups)
    assert a.point is not None
    assert b.point is not None
    assert a.direction is not None
    return float((b.point - a.point) @ a.direction) < 0.0


def nominal_place(
    faces: Sequence[ModelFace],
) -> tuple[tuple[float, float, float] | None, tuple[float, float, float] | None]:
    """The middle of a feature on its axis or plane, and its direction. [mm]"""
    first = faces[0]
    if first.point is None or first.direction is None:
        return None, None
    corners = np.concatenate([face.corners for face in faces])
    if len(corners) == 0 or first.kind in ("sphere", "torus"):
        middle = first.point
    elif first.kind == "plane":  # or the two planes of a slot
        places = [float(face.point @ first.direction) for face in faces if face.point is not None]
        middle = corners.mean(axis=0)
        between = 0.5 * (min(places) + max(places))
        middle = middle + (between - middle @ first.direction) * first.direction
    else:
        heights = (corners - first.point) @ first.direction
        middle = first.point + 0.5 * (heights.min() + heights.max()) * first.direction
    return triple(middle, 6), triple(first.direction)


def is_short(faces: Sequence[ModelFace]) -> bool:
    """Whether a cylinder is shorter than what shows its direction."""
    corners = np.concatenate([face.corners for face in faces])
    if faces[0].direction is None or not len(corners):
        return False
    return float(np.ptp(corners @ faces[0].direction)) < SHORTEST * faces[0].radius


def projected_ends(
    faces: Sequence[ModelFace], begins: Sequence[ModelFace], length: float
) -> tuple[float, float] | None:
    """Ends of a projected zone on the axis of a feature, from its nominal point. [mm]"""
    point, direction = (None if each is None else np.array(each) for each in nominal_place(faces))
    if point is None or direction is None or not begins:
        return None
    first = begins[0]
    if first.kind != "plane" or first.point is None or first.direction is None:
        return None
    cosine = float(first.direction @ direction)
    if abs(cosine) < 1.0 - 1e-6:
        return None
    start = float((first.point - point) @ direction)
    return round(start, 6), round(start + math.copysign(length, cosine), 6)


def angle_between(a: ModelFace, b: ModelFace, *, obtuse: bool = False) -> float | None:
    """The acute angle of two normals or axes, or what it lacks of 180°. [degrees]"""
    if a.direction is None or b.direction is None:
        return None
    acute = math.degrees(math.acos(min(1.0, abs(float(a.direction @ b.direction)))))
    return 180.0 - acute if obtuse else acute


def distance_between(a: ModelFace, b: ModelFace) -> float | None:
    """Of parallel planes, of parallel axes, of a centre or a parallel axis from a plane. [mm]"""
    if a.point is None or b.point is None or a.direction is None or b.direction is None:
        return None
    apart = b.point - a.point
    if a.kind == b.kind == "sphere":
        return float(np.linalg.norm(apart))
    if (a.kind == "plane") != (b.kind == "plane"):
        flat, other = (a, b) if a.kind == "plane" else (b, a)
        away = flat.direction
        assert away is not None
        assert other.direction is not None
        if other.kind != "sphere" and abs(float(away @ other.direction)) > 1e-6:
            return None
        return abs(float(apart @ away))
    parallel = np.linalg.norm(np.cross(a.direction, b.direction)) < 1e-6
    if not parallel:
        return None
    along = float(apart @ a.direction)
    return abs(along) if a.kind == "plane" else math.sqrt(max(float(apart @ apart) - along**2, 0.0))


def diameters_of(size: Size, groups: Sequence[tuple[ModelFace, ...]]) -> float | None:
    """How many of a size a diameter is: by its name, else by the diameter of the model.

    Parameters
    ----------
    size : Size
    groups : sequence of tuple of ModelFace
        The surfaces of its place.

    Returns
    -------
    float or None
        2 of a radius; None: it is not a diameter of them.
    """
    words = size.quantity.split()
    kinds = {group[0].kind for group in groups}
    if _OF_NO_DIAMETER.intersection(words) or ("spherical" in words and kinds != {"sphere"}):
        return None
    if "diameter" in words:
        return 1.0
    if "radius" in words:
        return 2.0
    radii = {round(group[0].radius, 6) for group in groups}
    if size.nominal is None or len(radii) != 1 or not kinds <= {"cylinder", "sphere"}:
        return None
    radius = radii.pop()
    known = ((factor, 2.0 * radius / factor) for factor in (1.0, 2.0))
    return next((factor for factor, own in known if abs(own - size.nominal) < SAME), None)


def targets_on_planes(pmi: Pmi, faces: Mapping[int, ModelFace]) -> Pmi:
    """The PMI with datum targets that the text binds to nothing on the one plane where they lie."""
    found = []
    for datum in pmi.datums:
        targets = tuple(_on_plane(each, faces.values()) for each in datum.targets)
        own = dict.fromkeys(number for each in targets for number in each.place.faces)
        place = datum.place if datum.place.faces or datum.place.others else Place(tuple(own))
        found.append(replace(datum, targets=targets, place=place))
    return replace(pmi, datums=tuple(found))


def _on_plane(target: DatumTarget, faces: Iterable[ModelFace]) -> DatumTarget:
    if target.place.faces or target.place.others or target.at is None:
        return target
    here = [face.number for face in faces if lies_on(np.array(target.at), face)]
    return replace(target, place=Place(tuple(here))) if len(here) == 1 else target


def lies_on(at: FloatArray, face: ModelFace) -> bool:
    """Whether a place is in a plane, and between the corners of its face.

    Parameters
    ----------
    at : (3,) float
    face : ModelFace
    """
    if face.kind != "plane" or not len(face.corners):
        return False
    assert face.point is not None
    assert face.direction is not None
    low, high = face.corners.min(axis=0) - SAME, face.corners.max(axis=0) + SAME
    near = abs(float((at - face.point) @ face.direction)) < SAME
    return near and bool(np.all(low <= at) and np.all(at <= high))
