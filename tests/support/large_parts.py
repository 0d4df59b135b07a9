"""Parts of many faces, made by the CAD kernel: a plate with holes, blades of B-splines."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any


def plate_with_holes(path: Path, columns: int, rows: int, pitch: float = 10.0) -> Path:
    """A plate with cylindrical holes on a grid, written as STEP. [mm]

    The outline with its holes is one face that is extruded, which takes the kernel seconds where
    single cuts would take hours.
    """
    from netgen.occ import Axes, WorkPlane, X, Z

    plane = WorkPlane(Axes((0, 0, 0), Z, X)).RectangleC(columns * pitch, rows * pitch)
    for i in range(columns):
        for j in range(rows):
            x = (i - 0.5 * (columns - 1)) * pitch
            y = (j - 0.5 * (rows - 1)) * pitch
            plane = plane.MoveTo(x, y).Circle(0.4 * pitch).Reverse()
    plane.Face().Extrude(20.0).WriteStep(str(path))
    return path


def _airfoil(z: float, chord: float, twist_deg: float) -> Any:
    """A section of a blade: a NACA 4-digit outline of 12 % with a sharp trailing edge."""
    from netgen.occ import Pnt, SplineApproximation, Wire

    c, s = math.cos(math.radians(twist_deg)), math.sin(math.radians(twist_deg))
    sides = []
    for side in (1.0, -1.0):
        points = []
        for i in range(25):
            x = 0.5 * (1.0 - math.cos(math.pi * i / 24))
            half = 0.6 * (
                0.2969 * math.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4
            )
            u, v = chord * (x - 0.5), chord * (0.32 * x * (1.0 - x) + side * half)
            points.append(Pnt(u * c - v * s, u * s + v * c, z))
        sides.append(SplineApproximation(points[:: int(side)], tol=1e-4))
    return Wire(sides)


def blade(chord: float = 30.0, height: float = 80.0) -> Any:
    """A twisted blade: two faces of B-splines and two flat ends. [mm]"""
    from netgen.occ import ThruSections

    return ThruSections(
        [_airfoil(0.25 * k * height, chord * (1.0 - 0.075 * k), 40.0 - 8.75 * k) for k in range(5)]
    )


def blades_around(path: Path, count: int) -> Path:
    """Blades around the x axis, written as STEP: each with faces of its own."""
    from netgen.occ import Axis, Compound, Vec, X

    one = blade().Move(Vec(0, 0, 150))
    about = Axis((0, 0, 0), X)
    Compound([one.Rotate(about, 360.0 * k / count) for k in range(count)]).WriteStep(str(path))
    return path
