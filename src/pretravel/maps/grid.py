"""A map on a regular grid of angles, for tables and pictures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, grid, polar_angle
from pretravel.maps.pretravel_map import PretravelMap

_NEARLY = 0.5
"""Touches of one ring differ by less: a table for people has no row of 90.0397°. [deg]"""


def map_grid(
    pretravel_map: PretravelMap,
    polar_step: float = 5.0,
    azimuth_step: float = 10.0,
    *,
    least_rest: float = 0.01,
) -> dict[str, Any]:
    """A map on a regular grid of angles, nan where it is not supported.

    Parameters
    ----------
    pretravel_map : PretravelMap
    polar_step, azimuth_step : float
        [deg]
    least_rest : float
        The largest polar angle of the map is a row of its own where it lies this much beyond the
        last step; a step that lies less beyond this angle takes its place. [deg]

    Returns
    -------
    mapping
        polar_deg (p,), azimuth_deg (a,), pretravel_um (p, a), u_um (p, a); angles in
        the probe frame.
    """
    largest = math.degrees(float(polar_angle(pretravel_map.support.nodes).max()))
    largest = min(largest, 165.0)
    polar = np.arange(0.0, largest + max(least_rest, 1e-9), polar_step)
    if largest - polar[-1] > least_rest:
        polar = np.append(polar, largest)
    azimuth = np.arange(0.0, 360.0, azimuth_step)
    directions = grid(polar * DEGREE, azimuth * DEGREE)
    normals = directions @ pretravel_map.rotation.T
    value = pretravel_map.pretravel(normals, extrapolate=True) / MICROMETRE
    u = pretravel_map.standard_uncertainty(normals) / MICROMETRE
    outside = ~pretravel_map.support.supports(directions)
    value[outside] = np.nan
    u[outside] = np.nan
    shape = (len(polar), len(azimuth))
    return {
        "polar_deg": polar,
        "azimuth_deg": azimuth,
        "pretravel_um": value.reshape(shape),
        "u_um": u.reshape(shape),
    }


def effective_radius_table(
    pretravel_map: PretravelMap, travel: float = 0.0
) -> dict[str, npt.ArrayLike]:
    """A map as tip radius less pretravel over polar angle and azimuth, where it is supported.

    Parameters
    ----------
    pretravel_map : PretravelMap
    travel : float
        Of the machine during the signal delay, where the map is that of the probe at rest. [mm]

    Returns
    -------
    mapping of str to (n,) values
        polar_deg, azimuth_deg (probe frame), effective_radius_mm, pretravel_um, u_um.
    """
    values = map_grid(pretravel_map, least_rest=_NEARLY)
    polar, azimuth = np.meshgrid(values["polar_deg"], values["azimuth_deg"], indexing="ij")
    held = np.isfinite(values["pretravel_um"])
    pretravel = values["pretravel_um"][held] + travel / MICROMETRE
    return {
        "polar_deg": polar[held],
        "azimuth_deg": azimuth[held],
        "effective_radius_mm": pretravel_map.tip_radius - pretravel * MICROMETRE,
        "pretravel_um": pretravel,
        "u_um": values["u_um"][held],
    }
