"""Inspection plans and lists of faces as CSV."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.drawing.inspection import InspectionPlan
from pretravel.surface import Part

_EVERY = {"cylinder": 100, "sphere": 100, "cone": 5, "torus": 5}
"""Of these kinds a few samples, at least some in each row along v, have all curvatures."""
_PROGRESS = 50
"""Number of faces after which progress is reported."""
_logger = logging.getLogger("pretravel")


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
    for count, face in enumerate(part.faces, start=1):
        if count % _PROGRESS == 0:
            _logger.info("describing face %d of %d", count, len(part.faces))
        # The first row is the point in the middle; the others show the curvature.
        flat = face.kind == "plane"
        others = face.coarse.uv[: 0 if flat else face.coarse.inner : _EVERY.get(face.kind, 1)]
        local = face.local(np.concatenate([face.middle[None], others]))
        box = np.ptp(face.coarse.points, axis=0)
        bend = 0.0 if flat else float(np.nanmax(np.abs(local.principal_curvatures)))
        low, high = face.box
        rows.append(
            {
                "face": face.number,
                "name": face.name,
                **({"part": face.part} if several else {}),
                "type": face.kind,
                **{f"{a}_mm": local.point[0, i] for i, a in enumerate("xyz")},
                **{f"n{a}": local.normal[0, i] for i, a in enumerate("xyz")},
                "size_mm": float(np.linalg.norm(box)),
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
