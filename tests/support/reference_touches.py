"""Touches on a reference sphere with a given pretravel."""

from __future__ import annotations

import numpy as np

from pretravel.base.directions import sphere_pattern_25
from pretravel.touches import Touches


def sphere_touches(
    pretravel: np.ndarray,
    normals: np.ndarray | None = None,
    center: tuple[float, float, float] = (0.0, 0.0, 0.0),
    radius: float = 12.5,
    tip_radius: float = 3.0,
) -> Touches:
    """Touches along the normals of a sphere with given pretravel."""
    n = sphere_pattern_25() if normals is None else normals
    return Touches(np.asarray(center) + n * (radius + tip_radius - pretravel)[:, None], n)
