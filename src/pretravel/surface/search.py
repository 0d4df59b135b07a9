"""Contacts of many balls on a part of several faces: which face, and where on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.contact import Contact, Reach, solve_contact
from pretravel.surface.local_geometry import LocalGeometry, Surface

_NEIGHBOURS = 32
"""Points of the part around a ball among which the face is looked for."""
_MOST_FACES = 6
"""Faces tried for one row."""
_STARTS = 12
"""Points around a pole from which a contact is looked for."""

_NEARLY = 1e-6
"""Residual of a contact that is worth starting from. [mm]"""

ReachOfRows: TypeAlias = Callable[[IntArray], Reach]
"""A reach for some of the rows: its own rows are counted within those."""


@dataclass(frozen=True, eq=False)
class Found:
    """Contacts of all touches, each on the face it was found on."""

    local: LocalGeometry
    length: FloatArray
    residual: FloatArray
    face: IntArray
    solved: BoolArray
    beyond_edge: BoolArray
    iterations: IntArray


class ContactSearch:
    """Contacts of many touches on several faces: the likely face first, then its neighbours."""

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
        """Go on with these touches only, of those that were solved."""
        self.open = self.solved & which

    def state(self) -> Found:
        """What was found so far."""
        return Found(
            LocalGeometry(self.point.copy(), self.normal.copy(), self.curvature.copy()),
            self.length.copy(),
            self.residual.copy(),
            self.face.copy(),
            self.solved.copy(),
            self.beyond_edge.copy(),
            self.iterations.copy(),
        )

    def solve(
        self,
        near: FloatArray,
        anchor: FloatArray,
        direction: FloatArray | None,
        reach: ReachOfRows,
        *,
        against: FloatArray | None = None,
    ) -> None:
        """Find the contact of every open row, on the face near which it is looked for.

        Parameters
        ----------
        near : (n, 3) float
            Points near which the surface is looked for. [mm]
        anchor, direction
            As for `solve_contact`.
        reach : ReachOfRows
        against : (n, 3) float, optional
            Contacts whose normal does not point against this do not count.
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
            self._on_face(
                int(face), rows[mine], start[mine], anchor, direction, reach, against, own=True
            )
        waiting = rows[~self.solved[rows]]
        if len(waiting) == 0 or self.part is None:
            return
        been = [first[~self.solved[rows]][:, None]]
        index, uv = self._nearest_samples(near[waiting], _NEIGHBOURS)
        for _ in range(_MOST_FACES - 1):
            known = np.concatenate(been, axis=1)
            new = (index[:, :, None] != known[:, None, :]).all(axis=2)
            pick = np.argmax(new, axis=1)
            there = new[np.arange(len(waiting)), pick] & ~self.solved[waiting]
            if not there.any():
                break
            chosen = np.where(there, index[np.arange(len(waiting)), pick], -1)
            for face in np.unique(chosen[there]):
                mine = chosen == face
                guess = uv[np.flatnonzero(mine), pick[mine]]
                self._on_face(int(face), waiting[mine], guess, anchor, direction, reach, against)
            been.append(chosen[:, None])

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
        uv: FloatArray,
        anchor: FloatArray,
        direction: FloatArray | None,
        reach: ReachOfRows,
        against: FloatArray | None,
        *,
        own: bool = False,
    ) -> None:
        """Solve on one face; what was found counts where it lies within the face."""
        if len(rows) == 0:
            return
        surface = self.faces[face]
        contact = solve_contact(
            surface,
            uv,
            anchor[rows],
            None if direction is None else direction[rows],
            reach(rows),
        )
        if isinstance(surface, Face):
            self._from_elsewhere(surface, contact, rows, anchor, direction, reach)
        inside = surface.inside(contact.uv)
        solved = contact.solved
        if against is not None:
            solved = solved & (np.sum(contact.local.normal * against[rows], axis=1) < 0.0)
        good = solved & inside
        if own:  # nearly there is a better start for the next search than where this one began
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

    def _from_elsewhere(
        self,
        surface: Face,
        contact: Contact,
        rows: IntArray,
        anchor: FloatArray,
        direction: FloatArray | None,
        reach: ReachOfRows,
    ) -> None:
        """Try again, where nothing was found, from points around: across a pole parameters
        do not lead.
        """
        stuck = np.flatnonzero(~contact.solved)
        if len(stuck) == 0 or not surface.has_poles:
            return
        for start in surface.starts_near(contact.local.point[stuck], _STARTS):
            left = ~contact.solved[stuck]
            if not left.any():
                return
            again = stuck[left]
            trial = solve_contact(
                surface,
                start[left],
                anchor[rows[again]],
                None if direction is None else direction[rows[again]],
                reach(rows[again]),
            )
            contact.put(again[trial.solved], trial.take(np.flatnonzero(trial.solved)))
