"""Inspection plans and lists of faces as CSV."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, probe_rotation
from pretravel.probing import InspectionPlan
from pretravel.qualification import BlockPlan
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


def pattern_table(
    directions: FloatArray,
    center: npt.ArrayLike,
    radius: float,
    retreat: float,
    *,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    turn: float = 0.0,
    repeats: int = 1,
) -> dict[str, npt.ArrayLike]:
    """Targets on a sphere as `read_targets` reads them, with the start of each touch.

    Parameters
    ----------
    directions : (n, 3) float
        In the probe frame.
    center : (3,) float
        [mm]
    radius, retreat : float
        Radius of the sphere; distance from the sphere to the tip's centre at the start. [mm]
    axis : (3,) float
        Axis of the probe in the machine.
    turn : float
        Turn about the axis. [rad]
    repeats : int

    Returns
    -------
    mapping of str to values
        label, x_mm…, nx…, start_x_mm….
    """
    normals = np.repeat(directions @ probe_rotation(axis, turn).T, repeats, axis=0)
    points = np.asarray(center, dtype=np.float64) + radius * normals
    starts = points + retreat * normals
    labels = [f"{i + 1}.{k + 1}" if repeats > 1 else str(i + 1)
              for i in range(len(directions)) for k in range(repeats)]  # fmt: skip
    columns: dict[str, npt.ArrayLike] = {"label": labels}
    columns |= {f"{a}_mm": points[:, i] for i, a in enumerate("xyz")}
    columns |= {f"n{a}": normals[:, i] + 0.0 for i, a in enumerate("xyz")}
    return columns | {f"start_{a}_mm": starts[:, i] for i, a in enumerate("xyz")}


def block_table(plan: BlockPlan, center: npt.ArrayLike) -> dict[str, npt.ArrayLike]:
    """Targets on a block as `read_targets` reads them, with approaches of their own.

    Parameters
    ----------
    plan : BlockPlan
    center : (3,) float
        Middle of the block. [mm]

    Returns
    -------
    mapping of str to values
        label, reference, x_mm…, nx…, ax….
    """
    points = plan.points + np.asarray(center, dtype=np.float64)
    columns: dict[str, npt.ArrayLike] = {
        "label": list(plan.labels), "reference": list(plan.references)
    }  # fmt: skip
    columns |= {f"{a}_mm": points[:, i] for i, a in enumerate("xyz")}
    columns |= {f"n{a}": plan.normals[:, i] + 0.0 for i, a in enumerate("xyz")}
    return columns | {f"a{a}": plan.approaches[:, i] + 0.0 for i, a in enumerate("xyz")}
