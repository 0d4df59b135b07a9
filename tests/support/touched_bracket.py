"""A bracket without any symmetry, with bores and a slope, and random touches on its faces."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.base.frames import Placement
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.measurement.compensation import embed
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_file import read_part
from pretravel.surface.search import feet_on_faces

FROM_EDGES = 1.0
"""Smallest distance between a touch and the edges of its face. [mm]"""


def write_bracket(path: Path) -> Path:
    """A block of 80 x 50 x 20 mm with a pocket, two bores (12 and 8 mm), a boss and a slope."""
    from netgen.occ import Axis, Box, Cylinder, Y, Z

    block = Box((0, 0, 0), (80, 50, 20)) - Box((20, 30, 10), (60, 50, 20))
    block -= Cylinder((12, 12, 0), Z, r=6, h=20)
    block -= Cylinder((65, 14, 0), Z, r=4, h=20)
    block += Cylinder((40, 14, 20), Z, r=7, h=12)
    block -= Box((70, -5, 15), (100, 55, 40)).Rotate(Axis((70, 0, 15), Y), 25)
    block.WriteStep(str(path))
    return path


@cache
def bracket() -> Part:
    """The bracket, read from its file."""
    with tempfile.TemporaryDirectory() as folder:
        return read_part(write_bracket(Path(folder) / "bracket.step"))


def faces_of_kind(part: Part, kind: str) -> list[int]:
    """Indices of the faces of a kind."""
    return [index for index, face in enumerate(part.faces) if face.kind == kind]


def random_targets(
    part: Part,
    count: int,
    rng: np.random.Generator,
    tip_radius: float = 2.0,
    on: Sequence[int] = (),
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Points of the part where the tip has room, their normals, and the indices of their faces.

    On all faces, or on those of the indices `on`.
    """
    points, normals, faces = np.empty((0, 3)), np.empty((0, 3)), np.empty(0, dtype=int)
    while len(points) < count:
        tried = []
        for index in rng.permutation(on or range(len(part.faces))):
            low, high = part.faces[index].box
            uv = low + rng.random((4, 2)) * (high - low)
            tried.append((index, part.faces[index].local(uv[part.faces[index].inside(uv)])))
        centres = [local.point + tip_radius * local.normal for _, local in tried]
        feet, first = feet_on_faces(part, np.vstack(centres)), 0
        for index, local in tried:
            own = slice(first, first + len(local.point))
            first = own.stop
            good = feet.face[own] == index
            good &= np.abs(feet.distance[own] - tip_radius) < 1e-6
            if not good.any():
                continue
            edges = part.faces[index].derivatives(part.faces[index].edge_samples(0.2))[0]
            away = np.linalg.norm(local.point[:, None] - edges, axis=2).min(axis=1)
            rows = np.flatnonzero(good & (away > FROM_EDGES))[:1]
            points = np.vstack([points, local.point[rows]])
            normals = np.vstack([normals, local.normal[rows]])
            faces = np.append(faces, np.full(len(rows), index))
    order = rng.permutation(len(points))[:count]
    return points[order], normals[order], faces[order]


def random_placement(rng: np.random.Generator) -> Placement:
    """Any turn, and up to 500 mm along each axis."""
    turn = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    return Placement(turn, rng.uniform(-500.0, 500.0, 3))


def beside(placement: Placement, rng: np.random.Generator, turn: float, shift: float) -> Placement:
    """A placement that is off by about a turn and a shift. [rad, mm]"""
    small = Rotation.from_rotvec(rng.normal(0.0, turn, 3)).as_matrix()
    return Placement(small @ placement.rotation, placement.shift + rng.normal(0.0, shift, 3))


def tip_centres(
    placement: Placement, points: FloatArray, normals: FloatArray, pretravel_map: object
) -> TipCentres:
    """What a machine reports of touches on a placed part, without normals and approaches."""
    touches = embed(
        placement.points(points), placement.vectors(normals), pretravel_map, extrapolate=True  # type: ignore[arg-type]
    )  # fmt: skip
    return TipCentres(touches.positions)
