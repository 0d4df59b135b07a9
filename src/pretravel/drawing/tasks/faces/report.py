"""The list of the faces of a part, and its report."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, PretravelError
from pretravel.show import (
    Column,
    Document,
    Picture,
    Table,
    decimals,
    signed_decimals,
    significant,
    value_text,
)
from pretravel.surface import Cylinder, Face, Part

if TYPE_CHECKING:
    from pretravel.show import View

_HALF = 0.99
"""Of half a turn: half a bore is named as a bore, a fillet is not."""
_UPRIGHT = 1e-6  # of a cosine: an axis along x, y or z
_APEX = 1e-6
"""A radius below this is the tip of a cone. [mm]"""


def faces_table(part: Part) -> dict[str, npt.ArrayLike]:
    """All faces of a part: kind, place and smallest radius of curvature.

    Returns
    -------
    mapping of str to values
        face, name, part (in a file of several), type, x_mm, y_mm, z_mm (the point farthest from
        its edges), nx, ny, nz (the normal at that point), size_mm (diagonal of the box around the
        face), u_from, u_to, v_from, v_to, smallest_radius_mm (empty for flat faces), problem (why
        a face cannot be used).
    """
    rows: list[dict[str, Any]] = []
    several = any(face.part for face in part.faces)
    numbers = part.numbers
    sizes = np.linalg.norm(numbers.box[:, 1] - numbers.box[:, 0], axis=1)
    for place, face in enumerate(part.faces):
        bend = float(numbers.bend[place])
        low, high = face.box
        rows.append(
            {
                "face": face.number,
                "name": face.name,
                **({"part": face.part} if several else {}),
                "type": face.kind,
                **{f"{a}_mm": numbers.point[place, i] for i, a in enumerate("xyz")},
                **{f"n{a}": numbers.normal[place, i] for i, a in enumerate("xyz")},
                "size_mm": float(sizes[place]),
                "u_from": low[0],
                "u_to": high[0],
                "v_from": low[1],
                "v_to": high[1],
                "smallest_radius_mm": 1.0 / bend if bend > 1e-9 else np.nan,
                "problem": "",
            }
        )
    names = list(rows[0])
    for number, reason in part.unreadable.items():
        blank = {key: "" if isinstance(rows[0][key], str) else np.nan for key in names}
        rows.append(blank | {"face": number, "problem": reason})
    rows.sort(key=lambda row: int(str(row["face"])))
    return {name: [row[name] for row in rows] for name in names}


def faces_document(part: Part, columns: Mapping[str, npt.ArrayLike]) -> Document:
    """The report of a part: its faces.

    Parameters
    ----------
    part : Part
    columns : mapping of str to values
        Of `faces_table`.
    """
    values = {name: np.asarray(column).tolist() for name, column in columns.items()}
    words = [_type_words(part, place) for place in range(len(part.faces))]
    values["type"] = words + values["type"][len(words) :]
    usable = [row for row, problem in enumerate(values["problem"]) if not problem]
    low, high = part.box
    size = " x ".join(value_text(float(length)) for length in high - low)
    count = len(values["face"])
    parts = len({face.part for face in part.faces})
    return Document(
        title=part.name,
        verdict=f"{part.name}: {count} face{'' if count == 1 else 's'}"
        f"{f' of {parts} parts' if parts > 1 else ''}, {size} mm, from "
        f"{value_text(tuple(low.tolist()))} to {value_text(tuple(high.tolist()))}",
        tables=(
            _faces_table({k: [column[row] for row in usable] for k, column in values.items()}),
        ),
        pictures=(Picture("Faces and their numbers", lambda: _faces_view(part)),),
        warnings=_size_warnings(part.size)
        + tuple(
            f"face {face} cannot be used: {problem}"
            for face, problem in zip(values["face"], values["problem"], strict=True)
            if problem
        ),
    )


_SMALL, _LARGE = 1.0, 10_000.0
"""Sizes of parts beyond which the unit of a file is doubtful. [mm]"""


def _faces_view(part: Part) -> View:
    from pretravel.show import part_view

    return part_view(part)


def _size_warnings(size: float) -> tuple[str, ...]:
    if _SMALL <= size <= _LARGE:
        return ()
    return (f"the part is {value_text(size, 'mm')} long: is the unit of the file correct?",)


def _type_words(part: Part, place: int) -> str:
    """What a face is; a bore or a boss by its diameter and its axis."""
    face, numbers = part.faces[place], part.numbers
    axis = _axis_of(face, numbers.mean[place])
    if axis is None:
        return face.kind
    point, direction, diameter = axis
    away = numbers.point[place] - point
    across = away - (away @ direction) * direction
    low, high = face.box
    turns = float(high[0] - low[0]) > _HALF * math.pi
    side = "bore" if float(across @ numbers.normal[place]) < 0.0 else "boss"
    main = int(np.argmax(np.abs(direction)))
    upright = abs(float(direction[main])) > 1.0 - _UPRIGHT
    way = "xyz"[main] if upright else value_text(tuple(direction.tolist()), "", decimals(2))
    kept = [axis for axis in range(3) if axis != main or not upright]
    at = value_text(tuple(float(point[axis]) for axis in kept), "", decimals(2))
    name = side if turns else f"part of a {side}"
    return f"{name} ⌀{diameter:.4g} about {way} at {at}"


def _axis_of(face: Face, mean: FloatArray) -> tuple[FloatArray, FloatArray, float] | None:
    """Point in the middle, direction and diameter of a cylinder; None of other faces."""
    if face.kind != "cylinder":
        return None
    if isinstance(face.base, Cylinder):
        direction, origin = np.asarray(face.base.axes)[2], np.asarray(face.base.origin)
        direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
        middle = origin + (mean - origin) @ direction * direction
        return middle, direction, 2.0 * face.base.radius
    from pretravel.measurement import associate

    try:  # moved or scaled: the normals of a cylinder lie across its axis, and no search is needed
        normals = face.local(face.coarse.uv).normal
        axis = np.linalg.svd(normals, full_matrices=False)[2][-1]
        found = associate(
            "cylinder", face.coarse.points, axis=axis * np.sign(axis[np.argmax(np.abs(axis))])
        )
    except PretravelError:  # too narrow a strip
        return None
    assert found.direction is not None
    assert found.diameter is not None
    return found.point, found.direction, found.diameter


def _without_rounding(low: list[float], high: list[float]) -> tuple[list[float], list[float]]:
    """Both ends of ranges, with zero for what rounding left of it: a file in inches has -7e-15.

    >>> _without_rounding([-7e-15, 1e-15, -0.5], [30.0, 2e-15, -1e-14])
    ([0.0, 1e-15, -0.5], [30.0, 2e-15, 0.0])
    """
    ends = np.array([low, high], dtype=np.float64)
    shown = np.where(np.abs(ends) < 1e-12 * (ends[1] - ends[0]), 0.0, ends)
    return shown[0].tolist(), shown[1].tolist()


def _faces_table(values: Mapping[str, list[Any]]) -> Table:
    angle = significant(4)
    radii = ["apex" if radius < _APEX else radius for radius in values["smallest_radius_mm"]]
    return Table(
        (
            Column.of("face", [str(face) for face in values["face"]]),
            Column.of("name", values["name"]),
            *((Column.of("part", values["part"]),) if "part" in values else ()),
            Column.of("type", values["type"]),
            *(Column.of(axis, values[f"{axis}_mm"], "mm") for axis in "xyz"),
            *(Column.of(f"n{axis}", values[f"n{axis}"], "", signed_decimals(2)) for axis in "xyz"),
            Column.of("smallest radius", radii, "mm", significant(3)),
            *(
                Column.of(f"{name} {end}", ends, "", angle)
                for axis, name in (("u", "coordinate 1"), ("v", "coordinate 2"))
                for end, ends in zip(
                    ("from", "to"),
                    _without_rounding(values[f"{axis}_from"], values[f"{axis}_to"]),
                    strict=True,
                )
            ),
        ),
        title="A point on each face, far from its edges, the normal there, and the ranges of the "
        "two parameters of the surface, coordinate 1 and 2 (lengths in mm, angles in rad)",
        explanation="type: a bore or boss with its diameter, and where its axis lies in mm; "
        "smallest radius: of curvature, anywhere on the face; empty where it is flat.",
    )
