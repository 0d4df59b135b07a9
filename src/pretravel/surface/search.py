"""Contacts of many balls with a part of several faces: which face, and where on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.contact import Contact, Lines, Reach, solve_contact
from pretravel.surface.local_geometry import LocalGeometry, Surface, at_open_end
from pretravel.surface.undetermined import apexes

_EDGE_SHARE = 1e-3
"""Distance between samples of an edge, as a share of the face's size, where faces are compared."""
_WIDER = 1.1
"""The reach of a ball on a bent stylus, as a multiple of that at rest."""
_DEFLECTION = 0.1
"""More than the deflection of a stylus. [mm]"""
_STARTS = 12
"""Points around a pole from which a contact is searched."""
_NEARLY = 1e-6
"""Residual of a contact that is worth starting from. [mm]"""

ReachOfRows: TypeAlias = Callable[[IntArray], Reach]
"""A reach for some of the rows: its own rows are counted within those."""


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """What a contact must satisfy, for every row.

    Parameters
    ----------
    lines : Lines
    reach : ReachOfRows
    against : (n, 3) float, optional
        Contacts count only where their normal points against these directions.
    """

    lines: Lines
    reach: ReachOfRows
    against: FloatArray | None = None

    def solve(self, surface: Surface, rows: IntArray, start: FloatArray) -> Contact:
        """Contacts of the given rows with one surface, from parameters to start from."""
        return solve_contact(surface, start, self.lines.take(rows), self.reach(rows))

    def faces_approach(self, rows: IntArray, normals: FloatArray) -> BoolArray:
        """Which contacts of the given rows have a normal against `against`, (m,)."""
        if self.against is None:
            return np.ones(len(rows), dtype=bool)
        return np.asarray(np.sum(normals * self.against[rows], axis=1) < 0.0)


@dataclass(frozen=True, eq=False)
class PartContacts:
    """Contacts of n balls, each on the face where it was found.

    Attributes
    ----------
    local : LocalGeometry
        Of the surface at the contacts; not numbers where there is none.
    length : (n,) float
        Along the lines. [mm]
    residual : (n,) float
        Remaining error of the equations. [mm]
    face : (n,) int
        Index of the face.
    solved : (n,) bool
    beyond_edge : (n,) bool
        Where the only contact lies on the continuation of a face beyond its edges, or would lie
        beyond the ends of the parameters.
    iterations : (n,) int
    """

    local: LocalGeometry
    length: FloatArray
    residual: FloatArray
    face: IntArray
    solved: BoolArray
    beyond_edge: BoolArray
    iterations: IntArray


class ContactSearch:
    """Contacts of many touches with several faces: the nearest face first, then all in the way."""

    def __init__(self, surface: Surface | Part, count: int) -> None:
        self.part = surface if isinstance(surface, Part) else None
        self.faces: list[Surface] = list(surface.faces) if isinstance(surface, Part) else [surface]
        self.open = np.ones(count, dtype=bool)
        self.face = np.full(count, -1)
        self.uv = np.zeros((count, 2))
        self._clear()

    def _clear(self) -> None:
        count = len(self.open)
        self.point, self.normal = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
        self.curvature = np.full((count, 3, 3), np.nan)
        self.length, self.residual = np.full(count, np.nan), np.full(count, np.nan)
        self.solved = np.zeros(count, dtype=bool)
        self.beyond_edge = np.zeros(count, dtype=bool)
        self.iterations = np.zeros(count, dtype=np.int64)

    def restrict(self, which: BoolArray) -> None:
        """Continue only with touches that are solved and marked in `which`."""
        self.open = self.solved & which

    def contacts(self) -> PartContacts:
        """The contacts found so far."""
        return PartContacts(
            LocalGeometry(self.point.copy(), self.normal.copy(), self.curvature.copy()),
            self.length.copy(),
            self.residual.copy(),
            self.face.copy(),
            self.solved.copy(),
            self.beyond_edge.copy(),
            self.iterations.copy(),
        )

    def solve(self, near: FloatArray, problem: ContactProblem) -> None:
        """Find the contact of every open row, on the face where it was found before or is expected.

        Parameters
        ----------
        near : (n, 3) float
            Points near which the contacts are expected. [mm]
        problem : ContactProblem
        """
        rows = np.flatnonzero(self.open)
        fresh = rows[self.face[rows] < 0]
        self._clear()
        if len(fresh) and self.part is None:
            self.face[fresh], self.uv[fresh] = 0, self.faces[0].nearest(near[fresh])
        elif len(fresh):
            self.face[fresh], self.uv[fresh] = self.nearest_faces(near[fresh])
        first, start = self.face[rows].copy(), self.uv[rows].copy()
        for face in np.unique(first):
            mine = first == face
            self._on_face(int(face), rows[mine], start[mine], problem)
        waiting = rows[~self.solved[rows]]
        if self.part is not None and len(waiting):
            self._on_other_faces(waiting, near, problem)

    def nearest_faces(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """The face nearest to each point, (n,), and parameters on it to start from, (n, 2)."""
        assert self.part is not None
        cloud = self.part.cloud_of_chosen
        distance, at = cloud.tree.query(points, workers=-1)
        best, uv = cloud.face[at].copy(), cloud.uv[at].copy()
        # A face with a distant sample can be the nearest one where boxes are as near as the sample.
        boxes = self.part.boxes_of_chosen
        rows, faces = self.part.near(points, distance, cloud, boxes)
        several = np.flatnonzero(np.bincount(rows) > 1)
        for face in np.unique(best[several]):
            mine = several[best[several] == face]
            distance[mine], uv[mine] = self._distance(int(face), points[mine])
        rows, faces = self.part.near(points[several], distance[several], cloud, boxes)
        rows = several[rows]
        for face in np.unique(faces):
            mine = rows[(faces == face) & (best[rows] != face)]
            found, start = self._distance(int(face), points[mine])
            nearer = found < distance[mine]
            distance[mine[nearer]], uv[mine[nearer]] = found[nearer], start[nearer]
            best[mine[nearer]] = face
        return best, uv

    def _distance(self, index: int, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distance of points from a face, and the parameters of the nearest points."""
        face = self.faces[index]
        assert isinstance(face, Face)
        uv = face.nearest(points)
        distance = np.linalg.norm(face.derivatives(uv)[0] - points, axis=1)
        beyond = np.flatnonzero(~face.inside(uv))
        if len(beyond):
            size = float(np.linalg.norm(face.bounds[1] - face.bounds[0]))
            distance[beyond] = face.distance(points[beyond], _EDGE_SHARE * size)
        return distance, uv

    def _on_other_faces(self, rows: IntArray, near: FloatArray, problem: ContactProblem) -> None:
        """Try every other face that the ball can meet near its place; the nearest contact counts.

        Near are faces up to the ball's reach further away than twice the expected face, so that a
        wrong target does not lead to a contact elsewhere. A ball on a line meets only faces whose
        boxes the line passes within the ball's reach.
        """
        assert self.part is not None
        points, lines, tried = near[rows], problem.lines.take(rows), self.face[rows]
        reach = _WIDER * np.linalg.norm(lines.anchor - points, axis=1) + _DEFLECTION
        far = np.empty(len(rows))
        for index in np.unique(tried):
            mine = tried == index
            far[mine] = self._distance(int(index), points[mine])[0]
        boxes, count = self.part.boxes_of_chosen, len(self.faces)
        pairs, faces = boxes.within(points, 2.0 * far + reach)
        if lines.direction is not None:
            on_line, hit = boxes.along(lines.anchor, lines.direction, reach)
            both = np.intersect1d(pairs * count + faces, on_line * count + hit, assume_unique=True)
            pairs, faces = both // count, both % count
        nearest = np.full(len(rows), np.inf)
        for index in np.unique(faces):
            mine = pairs[(faces == index) & (tried[pairs] != index)]
            face = self.faces[int(index)]
            if len(mine) == 0 or not isinstance(face, Face):
                continue
            start = next(face.starts_near(points[mine], 1))
            contact, good = self._contacts_on(face, rows[mine], start, problem)
            distance = np.linalg.norm(contact.local.point - points[mine], axis=1)
            better = np.flatnonzero(good & (distance < nearest[mine]))
            nearest[mine[better]] = distance[better]
            self.iterations[rows[mine]] += contact.iterations
            self._put(int(index), rows[mine[better]], contact.take(better))

    def _on_face(
        self, face: int, rows: IntArray, start: FloatArray, problem: ContactProblem
    ) -> None:
        """Solve on the expected face; a contact counts where it lies within the face."""
        surface = self.faces[face]
        contact, good = self._contacts_on(surface, rows, start, problem)
        inside = surface.inside(contact.uv)
        # An almost solved contact is a better start for the next search.
        near = inside & (contact.residual < _NEARLY)
        self.uv[rows[near]] = contact.uv[near]
        facing = problem.faces_approach(rows, contact.local.normal)
        beyond = contact.solved & ~inside
        if not isinstance(surface, Face):
            # It has no continuation where its parameters end: the search stops there.
            beyond |= ~contact.solved & at_open_end(surface, contact.uv)
        self.beyond_edge[rows] = facing & beyond
        self.iterations[rows] += contact.iterations
        self._put(face, rows[good], contact.take(np.flatnonzero(good)))

    def _contacts_on(
        self, surface: Surface, rows: IntArray, start: FloatArray, problem: ContactProblem
    ) -> tuple[Contact, BoolArray]:
        """Contacts with a surface, and which of them lie within its edges and face the approach."""
        contact = problem.solve(surface, rows, start)
        if isinstance(surface, Face):
            _retry_around_poles(surface, contact, rows, problem)
        good = contact.solved & problem.faces_approach(rows, contact.local.normal)
        return contact, good & surface.inside(contact.uv)

    def _put(self, face: int, rows: IntArray, contact: Contact) -> None:
        """Note contacts on a face."""
        self.face[rows], self.uv[rows] = face, contact.uv
        self.point[rows], self.normal[rows] = contact.local.point, contact.local.normal
        self.curvature[rows] = contact.local.curvature
        self.length[rows], self.residual[rows] = contact.length, contact.residual
        self.solved[rows] = True
        self.beyond_edge[rows] = False


def faces_to_touch(surface: Surface | Part) -> list[tuple[int, Surface]]:
    """The faces that can be touched, with their indices as in `PartContacts.face`."""
    if isinstance(surface, Part):
        return [(index, surface.faces[index]) for index in surface.chosen]
    return [(0, surface)]


def apexes_of(surface: Surface) -> FloatArray:
    """Points of a surface that have no normal, within its edges, (k, 3). [mm]"""
    if isinstance(surface, Face):
        return surface.apexes
    return apexes(surface, np.array(surface.domain.lower), np.array(surface.domain.upper))


@dataclass(frozen=True, eq=False)
class Feet:
    """The points of a part that are nearest to n given points.

    Attributes
    ----------
    local : LocalGeometry
        Of the surface there.
    face : (n,) int
        Index of the face.
    inside : (n,) bool
        False where the foot lies on the continuation of the face, beyond its edges.
    distance : (n,) float
        Along the normal, positive outside of the part. [mm]
    """

    local: LocalGeometry
    face: IntArray
    inside: BoolArray
    distance: FloatArray


def feet_on_faces(part: Part, points: FloatArray, face: IntArray | None = None) -> Feet:
    """The point of a part nearest to each point.

    Parameters
    ----------
    part : Part
        Its chosen faces are searched.
    points : (n, 3) float
        [mm]
    face : (n,) int, optional
        Index of the face of each point; the nearest face when not given.
    """
    if face is None:
        face = ContactSearch(part, len(points)).nearest_faces(points)[0]
    point, normal = np.empty((len(points), 3)), np.empty((len(points), 3))
    curvature, inside = np.empty((len(points), 3, 3)), np.empty(len(points), dtype=bool)
    order = np.argsort(face, kind="stable")
    for mine in np.split(order, np.flatnonzero(np.diff(face[order])) + 1):
        surface = part.faces[int(face[mine[0]])]
        uv = surface.nearest(points[mine])
        local = surface.local(uv)
        point[mine], normal[mine], curvature[mine] = local.point, local.normal, local.curvature
        inside[mine] = surface.inside(uv)
    distance = np.sum((points - point) * normal, axis=1)
    return Feet(LocalGeometry(point, normal, curvature), face, inside, distance)


def normals_near(surface: Surface | Part, points: FloatArray) -> FloatArray:
    """Outward normals of a surface, or of the nearest face of a part, near points.

    Parameters
    ----------
    surface : Surface or Part
    points : (n, 3) float
        [mm]

    Returns
    -------
    (n, 3) float
    """
    if isinstance(surface, Part):
        return feet_on_faces(surface, points).local.normal
    return surface.local(surface.nearest(points)).normal


def _retry_around_poles(
    surface: Face, contact: Contact, rows: IntArray, problem: ContactProblem
) -> None:
    """Start again from points around, where no contact was found on a face with poles.

    A step in the parameters does not lead across a pole.
    """
    unsolved = np.flatnonzero(~contact.solved)
    if len(unsolved) == 0 or not surface.has_poles:
        return
    for start in surface.starts_near(contact.local.point[unsolved], _STARTS):
        left = ~contact.solved[unsolved]
        if not left.any():
            return
        again = unsolved[left]
        trial = problem.solve(surface, rows[again], start[left])
        contact.put(again[trial.solved], trial.take(np.flatnonzero(trial.solved)))
