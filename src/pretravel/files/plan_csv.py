"""Targets on a sphere and on a block as CSV."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, probe_rotation
from pretravel.qualification import BlockPlan


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
