"""Contacts of many balls with a part of several faces: which face, and where on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.contact import Contact, Lines, Reach, solve_contact
from pretravel.surface.local_geometry import LocalGeometry, Surface

_NEIGHBOURS = 32
"""Points of the part around a ball among which the face is searched."""
_MOST_FACES = 6
"""Faces tried for one row."""
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
        Where the only contact lies on the continuation of a face beyond its edges.
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
    """Contacts of many touches with several faces: the likely face first, then its neighbours."""

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
            index, uv = self._nearest_samples(near[fresh], 1)
            self.face[fresh], self.uv[fresh] = index[:, 0], uv[:, 0]
        first, start = self.face[rows].copy(), self.uv[rows].copy()
        for face in np.unique(first):
            mine = first == face
            self._on_face(int(face), rows[mine], start[mine], problem, expected=True)
        waiting = ~self.solved[rows]
        if self.part is not None and np.any(waiting):
            self._on_neighbours(rows[waiting], first[waiting], near, problem)

    def _on_neighbours(
        self, rows: IntArray, tried: IntArray, near: FloatArray, problem: ContactProblem
    ) -> None:
        """Try the faces around, for rows without a contact on the expected face."""
        faces_tried = [tried[:, None]]
        index, uv = self._nearest_samples(near[rows], _NEIGHBOURS)
        for _ in range(_MOST_FACES - 1):
            known = np.concatenate(faces_tried, axis=1)
            new = (index[:, :, None] != known[:, None, :]).all(axis=2)
            pick = np.argmax(new, axis=1)
            available = new[np.arange(len(rows)), pick] & ~self.solved[rows]
            if not available.any():
                break
            chosen = np.where(available, index[np.arange(len(rows)), pick], -1)
            for face in np.unique(chosen[available]):
                mine = chosen == face
                self._on_face(int(face), rows[mine], uv[np.flatnonzero(mine), pick[mine]], problem)
            faces_tried.append(chosen[:, None])

    def _nearest_samples(self, points: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
        assert self.part is not None
        cloud = self.part.cloud_of_chosen
        count = min(count, len(cloud.points))
        _, at = cloud.tree.query(points, k=count, workers=-1)
        at = at.reshape(len(points), count)
        return cloud.face[at], cloud.uv[at]

    def _on_face(
        self,
        face: int,
        rows: IntArray,
        start: FloatArray,
        problem: ContactProblem,
        *,
        expected: bool = False,
    ) -> None:
        """Solve on one face; a contact counts where it lies within the face."""
        if len(rows) == 0:
            return
        surface = self.faces[face]
        contact = problem.solve(surface, rows, start)
        if isinstance(surface, Face):
            _retry_around_poles(surface, contact, rows, problem)
        inside = surface.inside(contact.uv)
        solved = contact.solved & problem.faces_approach(rows, contact.local.normal)
        good = solved & inside
        if expected:  # an almost solved contact is a better start for the next search
            near = inside & (contact.residual < _NEARLY)
            self.uv[rows[near]] = contact.uv[near]
            self.beyond_edge[rows] = solved & ~inside
        self.iterations[rows] += contact.iterations
        put = rows[good]
        self.face[put], self.uv[put] = face, contact.uv[good]
        self.point[put], self.normal[put] = contact.local.point[good], contact.local.normal[good]
        self.curvature[put] = contact.local.curvature[good]
        self.length[put], self.residual[put] = contact.length[good], contact.residual[good]
        self.solved[put] = True
        self.beyond_edge[put] = False


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
