"""Points of features whose truth is known, with errors of their own and common errors."""

from __future__ import annotations

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.measurement.points import Points

OWN = 0.4e-3
"""Standard uncertainty of each point by its own errors. [mm]"""
TIP = 0.3e-3
"""Standard uncertainty of the tip radius. [mm]"""


def feature_points(
    positions: FloatArray,
    normals: FloatArray,
    *,
    own: float = OWN,
    shared: dict[str, FloatArray] | None = None,
    stated: bool = True,
    pretravel: FloatArray | None = None,
) -> Points:
    """Points with own errors and, unless `shared` is given, an error of the tip radius."""
    count = len(positions)
    common = {"tip radius": np.full(count, TIP)} if shared is None else shared
    variance = own**2 + sum((part**2 for part in common.values()), np.zeros(count))
    taken = np.zeros(count) if pretravel is None else pretravel
    return Points(
        positions=positions,
        normals=normals,
        pretravel=taken,
        covariance=variance[:, None, None] * normals[:, :, None] * normals[:, None, :],
        deviation=None,
        labels=tuple(str(i + 1) for i in range(count)),
        shared=common if stated else None,
        uncompensated=positions - taken[:, None] * normals,
    )


def around(count: int, heights: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Unit vectors at equal angles about z, and heights along z, (n, 3) and (n,)."""
    angle = np.arange(count) * 2.0 * np.pi / count
    outward = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    return outward, np.zeros(count) if heights is None else np.resize(heights, count)


def features(count: int = 12) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Exact points and outward normals of the part, for every feature that is measured."""
    outward, height = around(count, np.array([-4.0, 4.0, 0.0]))
    z = np.array([0.0, 0.0, 1.0])
    slope = np.radians(20.0)
    wide = (6.0 + height * np.tan(slope))[:, None] * outward + height[:, None] * z
    grid = np.array([[x, y, 0.0] for x in (-9.0, 0.0, 9.0) for y in (-6.0, -2.0, 2.0, 6.0)])
    latitude = np.radians(np.resize([10.0, 40.0, 75.0], count))[:, None]
    ball = np.cos(latitude) * outward + np.sin(latitude) * z
    turn = (1.0 + 2.4 * np.arange(count))[:, None]
    tube = np.cos(turn) * outward + np.sin(turn) * z
    row = np.linspace(-10.0, 10.0, count)[:, None] * np.array([1.0, 0.0, 0.0])
    return {
        "circle": (10.0 * outward, -outward),
        "bore": (10.0 * outward, -outward),
        "boss": (10.0 * outward, outward),
        "sphere": (12.5 * ball, ball),
        "plane": (grid, np.tile(z, (len(grid), 1))),
        "line": (row, np.tile([0.0, -1.0, 0.0], (count, 1))),
        "cylinder": (10.0 * outward + height[:, None] * z, -outward),
        "cone": (wide, -np.cos(slope) * outward + np.sin(slope) * z),
        "torus": (10.0 * outward + 4.0 * tube, tube),
        "slot": (
            np.vstack([grid + 5.0 * z, grid - 5.0 * z]),
            np.repeat([-z, z], len(grid), axis=0),
        ),
    }


def block_points(chance: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    """Points on the six sides of a block of 80 x 60 x 40 mm beside the origin, and normals."""
    half = np.array([40.0, 30.0, 20.0])
    normals = np.array([*np.eye(3), *-np.eye(3)])[np.arange(count) % 6]
    inside = chance.uniform(-1.0, 1.0, (count, 3)) * half
    return np.where(normals != 0.0, normals * half, inside) + np.array([100.0, 20.0, 0.0]), normals
