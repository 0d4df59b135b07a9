"""What a drawing leaves to the part: kinds of features, and datums that are faces."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pretravel.base import PretravelError
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature, face_name
from pretravel.surface import Part

MEASURED_FACES = ("plane", "cylinder", "cone", "sphere", "torus")
"""Kinds of faces that are measured as features."""
_OPPOSITE = 1e-6  # of the sum of two unit normals


def drawing_on_part(drawing: Drawing, part: Part | None) -> Drawing:
    """A drawing with the kinds of its features, and with the faces that it names as datums.

    Parameters
    ----------
    drawing : Drawing
    part : Part or None

    Returns
    -------
    Drawing
        A datum ``face3`` that is no feature of the drawing is added as one.

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
        return row
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
            f"feature '{row.name}': its faces are {' and '.join(kinds)}, which is no feature to "
            "measure: give its kind"
        )
    kind = kinds[0]
    if kind == "plane" and len(own) == 2:
        normals = [face.local(0.5 * np.sum(face.box, axis=0)[None]).normal[0] for face in own]
        kind = "slot" if np.linalg.norm(normals[0] + normals[1]) < _OPPOSITE else kind
    return replace(row, kind=kind)
