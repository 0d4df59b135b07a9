"""Inspection plans and lists of faces as CSV."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.drawing.inspection import InspectionPlan
from pretravel.surface import Part


def plan_table(plan: InspectionPlan) -> dict[str, npt.ArrayLike]:
    """The targets of a plan as `read_targets` reads them, with the face and parameters of each.

    Returns
    -------
    mapping of str to (n,) values
        label, x_mm, y_mm, z_mm, nx, ny, nz, face, u, v.
    """
    columns: dict[str, npt.ArrayLike] = {"label": list(plan.labels)}
    columns |= {f"{axis}_mm": plan.point[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"n{axis}": plan.normal[:, i] for i, axis in enumerate("xyz")}
    return columns | {"face": plan.face, "u": plan.uv[:, 0], "v": plan.uv[:, 1]}


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
