"""Pictures of a part: its faces and their numbers, its body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pretravel.base import FloatArray, Placement, PretravelError
from pretravel.measurement import associate
from pretravel.show.chart import SpaceChart, View
from pretravel.show.chart_marks import SpaceLines, SpaceMark, SpaceMesh, SpaceNotes, SpacePoints
from pretravel.show.colours import SERIES, Colour
from pretravel.surface import Face, FaceTriangles, Part, Surface, face_triangles

_EYE = np.array([0.5, -0.7, 0.5])
"""About from where a part is seen."""
_MOST_NUMBERS = 60
"""More numbers of faces than these hide each other."""


def part_view(part: Part) -> View:
    """A part's faces in colours, with their numbers."""
    shown = [face_triangles(face, faces=len(part.faces)) for face in part.faces]
    numbers = [str(face.number) for face in part.faces]
    outwards = np.array([face.local(face.middle[None]).normal[0] for face in part.faces])
    # A little above the faces, which would hide the half of each dot.
    middles = np.array([triangles.middle for triangles in shown]) + 0.01 * part.size * outwards
    marks: list[SpaceMark] = []
    for index, colour in enumerate(SERIES):
        if shown[index :: len(SERIES)]:
            marks.append(_mesh(shown[index :: len(SERIES)], colour, 1.0))
    labels = tuple(
        ", ".join(
            word for word in (f"face {face.number}: {face.kind}", face.name, face.part) if word
        )
        for face in part.faces
    )
    marks += [_edges(shown), SpacePoints(middles, colour="ink", size=3.0, labels=labels)]
    if len(numbers) <= _MOST_NUMBERS:
        above = middles.copy()  # the line of a number ends at the dot
        for row, face in enumerate(part.faces):
            above[row] = _above_bore(face, above[row], 0.02 * part.size)
        marks.append(SpaceNotes(above, tuple(f" {number}" for number in numbers)))
        note = ""
    else:
        note = "too many faces for their numbers: point at the middle of a face"
    count = f"{len(numbers)} face{'s' * (len(numbers) != 1)}"
    chart = SpaceChart("Faces and their numbers", tuple(marks), "part", note=note, bare=True)
    return View(f"{part.name}: {count}", (chart,))


def _above_bore(face: Face, middle: FloatArray, height: float) -> FloatArray:
    """Where the number of a bore is seen, above its end; of another face its middle."""
    if face.kind != "cylinder":
        return middle
    try:
        found = associate("cylinder", face.coarse.points)
    except PretravelError:  # too narrow a strip
        return middle
    assert found.direction is not None
    inwards = (found.point - middle) @ face.local(face.middle[None]).normal[0] > 0.0
    if not inwards:
        return middle
    towards = found.direction * (1.0 if found.direction @ _EYE > 0.0 else -1.0)
    end = float(((face.coarse.points - found.point) @ towards).max())
    return np.asarray(found.point + (end + height) * towards)


def body_marks(
    surface: Surface | Part | None,
    placement: Placement | None = None,
    *,
    opacity: float = 0.55,
) -> tuple[SpaceMark, ...]:
    """The faces of a part and their edges, as a background for points.

    Parameters
    ----------
    surface : Surface, Part or None
        Other surfaces than those of CAD files have no ends: nothing is shown of them.
    placement : Placement or None
        Of the part in the machine, where the picture is in the frame of the machine.
    opacity : float
    """
    faces: Sequence[Face] = ()
    if isinstance(surface, Part):
        faces = surface.faces
    elif isinstance(surface, Face):
        faces = (surface,)
    if not faces:
        return ()
    shown = [_placed(face_triangles(face, faces=len(faces)), placement) for face in faces]
    return (_mesh(shown, "body", opacity, "nominal part"), _edges(shown))


def _placed(triangles: FaceTriangles, placement: Placement | None) -> FaceTriangles:
    if placement is None:
        return triangles
    return FaceTriangles(
        placement.points(triangles.points),
        triangles.corners,
        tuple(placement.points(edge) for edge in triangles.edges),
        placement.points(triangles.middle[None])[0],
    )


def _mesh(
    shown: Sequence[FaceTriangles], colour: Colour, opacity: float, name: str = ""
) -> SpaceMesh:
    """The triangles of several faces in one colour."""
    firsts = np.cumsum([0, *(len(triangles.points) for triangles in shown)])
    corners = [
        triangles.corners + first for triangles, first in zip(shown, firsts[:-1], strict=True)
    ]
    points = np.concatenate([triangles.points for triangles in shown])
    return SpaceMesh(points, np.concatenate(corners), name, colour, opacity=opacity)


def _edges(shown: Sequence[FaceTriangles]) -> SpaceLines:
    lines = [edge for triangles in shown for edge in triangles.edges if len(edge) > 1]
    none = np.empty((0, 3))
    return SpaceLines(
        np.concatenate([none, *(line[:-1] for line in lines)]),
        np.concatenate([none, *(line[1:] for line in lines)]),
        colour="ink",
        width=0.6,
    )
