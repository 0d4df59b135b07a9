"""Inspection plans and lists of faces as CSV."""

from __future__ import annotations

import numpy.typing as npt

from pretravel.drawing.inspection import InspectionPlan


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
