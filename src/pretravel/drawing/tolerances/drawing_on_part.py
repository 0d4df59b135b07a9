"""What a drawing leaves to the part (kinds, datums that are faces), and where the two differ."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import DEGREE, PretravelError, unit
from pretravel.drawing.features.measured_feature import BARE_SURFACE
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature, face_name
from pretravel.drawing.tolerances.tolerance_text import ToleranceText
from pretravel.measurement import Association, Points, associate, points_on_faces
from pretravel.surface import Part, feet_on_faces

MEASURED_FACES = ("plane", "cylinder", "cone", "sphere", "torus")
"""Kinds of faces that are measured as features."""
_OPPOSITE = 1e-6  # of the sum of two unit normals
_ROUND = {"cylinder", "sphere", "torus", "cone"}
_FACES_OF = {"slot": {"plane"}, "bore": _ROUND, "boss": _ROUND}
"""Kinds of faces that suit a feature, where they are not those of its own kind."""
_SAME_PLACE = 0.01  # mm; drawings that are typed give two digits
_SAME_AXIS = 1e-3  # rad; typed directions give three digits
_ON_FACE = 1.0  # mm; parts that are measured are made better


def drawing_on_part(drawing: Drawing, part: Part | None) -> Drawing:
    """A drawing with the kinds of its features, and with the faces that it names as datums.

    Returns
    -------
    Drawing
        A datum ``face3`` that is not a feature of the drawing is added as one.

    Raises
    ------
    PretravelError
        A feature without a kind, and no part; faces that the part does not have, or that are no
        one feature.
    """
    names = set(drawing.names)
    datums = [word for row in drawing.feature for each in row.geometric for word in each.datums]
    datums += [word for pattern in drawing.pattern for word in pattern.datums]
    more = [
        DrawnFeature(faces=(number,), kind="")
        for number in _faces_of(datums)
        if face_name([number]) not in names and part is not None
    ]
    rows = tuple(_with_kind(row, part) for row in (*drawing.feature, *more))
    return replace(drawing, feature=rows)


def faces_words(numbers: Sequence[int]) -> str:
    """The numbers of faces in a sentence.

    >>> faces_words([3]), faces_words([3, 4])
    ('face 3', 'faces 3, 4')
    """
    return f"face{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"


def _faces_of(words: Iterable[str]) -> list[int]:
    """The numbers in words such as ``face3`` and ``face3-face4(M)``."""
    found = [
        int(number) for word in words for number in re.findall(r"(?:^|-)face([1-9]\d{0,8})\b", word)
    ]
    return list(dict.fromkeys(found))


def _with_kind(row: DrawnFeature, part: Part | None) -> DrawnFeature:
    if part is not None:
        for number in row.faces:
            part.select(str(number))  # refuses what the part does not have
    if row.kind:
        return row if part is None else _of_one_kind(row, part)
    if part is None:
        raise PretravelError(
            f"feature '{row.name}' has no kind (plane, cylinder, …): give it, or the part with "
            "its faces",
            inputs=("part",),
        )
    own = [face for face in part.faces if face.number in row.faces]
    kinds = list(dict.fromkeys(face.kind for face in own))
    if len(kinds) > 1 or kinds[0] not in MEASURED_FACES:
        raise PretravelError(
            f"feature '{row.name}': its faces are {' and '.join(kinds)}, which is not a feature to "
            "measure: give its kind"
        )
    kind = kinds[0]
    if kind == "plane" and len(own) == 2:
        normals = [face.local(0.5 * np.sum(face.box, axis=0)[None]).normal[0] for face in own]
        kind = "slot" if np.linalg.norm(normals[0] + normals[1]) < _OPPOSITE else kind
    return replace(row, kind=kind)


def _of_one_kind(row: DrawnFeature, part: Part) -> DrawnFeature:
    """The same feature, whose faces can be of its kind."""
    own = {face.kind for face in part.faces if face.number in row.faces}
    known = own <= set(MEASURED_FACES)  # other kinds of faces may have any shape
    sections = ("circle", "line", BARE_SURFACE)
    suits = _FACES_OF.get(row.kind, {row.kind}) if row.kind not in sections else own
    if own and known and not own & suits:
        raise PretravelError(
            f"feature '{row.name}' is a {row.kind}, but the kind of {faces_words(row.faces)} of "
            f"{part.name} is {' and '.join(sorted(own))}. If the part's file was changed since, "
            "write the drawing and the points again (pretravel drawing, pretravel align); else "
            "correct faces or kind"
        )
    return row


def differences_from_part(drawing: Drawing, part: Part, points: Points) -> list[str]:
    """Sentences about features of a drawing, or their touches, that lie elsewhere on the part.

    Parameters
    ----------
    drawing : Drawing
        From `drawing_on_part`.
    part : Part
    points : Points
        With their faces, in the frame of the part.

    Returns
    -------
    list of str
        As where the file of the part was changed after the drawing or the points were made.
    """
    found = []
    for row in drawing.feature:
        there = f"{faces_words(row.faces)} of {part.name}"
        found += [f"{row.name}: {word}" for word in _other_than(row, part, there)]
        off = _off_the_face(row, part, points)
        if off > _ON_FACE:
            found.append(
                f"{row.name}: its touches are {off:.3f} mm (median) from {there}. "
                "If the part's file was changed since, align the touches again "
                "(pretravel align)"
            )
    return found


def _other_than(row: DrawnFeature, part: Part, there: str) -> list[str]:
    """Where the stated place, axis and size are not those of the faces."""
    nominal = _feature_of_faces(row, part)
    if nominal is None:
        return []
    again = "if the part's file was changed since, write the drawing again (pretravel drawing)"
    found = []
    if row.at is not None:
        off = float(np.linalg.norm(nominal.located_along @ (nominal.point - np.array(row.at))))
        if off > _SAME_PLACE:
            found.append(
                f"its place in the drawing is {off:.3f} mm from {there}. The place in the drawing "
                f"counts; {again}"
            )
    if row.axis is not None and nominal.direction is not None:
        turned = float(np.linalg.norm(np.cross(nominal.direction, unit(np.array(row.axis)))))
        if turned > _SAME_AXIS:
            found.append(
                f"its axis in the drawing is {np.arcsin(min(turned, 1.0)) / DEGREE:.2g}° from that "
                f"of {there}. A profile is compared with the part, all else with the axis in the "
                f"drawing; {again}"
            )
    size = None if row.kind == "cone" else nominal.diameter
    if size is not None and _is_other_size(row, size):
        found.append(
            f"its nominal_mm is {row.nominal:g}, and the diameter of {there} {size:.6g} mm; {again}"
        )
    return found


def _is_other_size(row: DrawnFeature, size: float) -> bool:
    """Whether a size of the model is neither the nominal one nor within its limits. [mm]"""
    if row.nominal is None or abs(size - row.nominal) <= _SAME_PLACE:
        return False
    if row.tolerance is None:
        return True
    limits = ToleranceText.parse(row.tolerance)
    off = size if limits.are_limits else size - row.nominal
    return (limits.low is not None and off < limits.low) or (
        limits.high is not None and off > limits.high
    )


def _feature_of_faces(row: DrawnFeature, part: Part) -> Association | None:
    """The axis, plane or centre of the faces; None where they have no such thing."""
    own = [face for face in part.faces if face.number in row.faces]
    kind = own[0].kind if own and all(face.kind == own[0].kind for face in own) else ""
    if kind not in MEASURED_FACES or kind == "torus" or row.kind == "slot":
        return None
    surface = np.concatenate([face.coarse.points for face in own])
    try:
        return associate(kind, surface[np.isfinite(surface).all(axis=1)], at=row.at)
    except PretravelError:
        return None


def _off_the_face(row: DrawnFeature, part: Part, points: Points) -> float:
    """Median distance of the touches from their faces as they end; 0 without any. [mm]"""
    if not row.faces or points.face is None:
        return 0.0
    mine = points_on_faces(points, row.faces)
    if not len(mine) or mine.face is None:
        return 0.0
    numbers = [face.number for face in part.faces]
    index = np.array([numbers.index(int(number)) for number in mine.face])
    feet = feet_on_faces(part, mine.positions, index)
    away = np.linalg.norm(mine.positions - feet.local.point, axis=1)
    return float(np.median(away))
