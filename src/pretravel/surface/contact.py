"""Where a ball on a flexible stylus touches a surface: one system of equations for all touches.

First contact, trigger, nearest point and the compensation of a reading are the same three
equations in two surface parameters and one length. They are solved here for any number of rows
together, by a safeguarded Newton method in the tangent plane, so that the result does not depend
on the parametrisation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from pretravel.base import BoolArray, FloatArray, IntArray
from pretravel.surface.local_geometry import LocalGeometry, Surface, parameter_step, tangent_basis

Reach: TypeAlias = Callable[[IntArray, LocalGeometry], FloatArray]
"""From surface point to spindle point, for the given rows: (m,) rows, geometry -> (m, 3). [mm]"""

_CLOSED = 1e-12
"""Residual at which a row is finished, in addition to the effect of rounding. [mm]"""
_ROUNDING = 4e-15
"""Residual that rounding alone causes, relative to the coordinates."""
TANGENCY = 1e-9
"""Residual below which a row counts as solved. [mm]"""
_MOST_ITERATIONS = 40
_MOST_HALVINGS = 12
_LARGEST_TURN = 0.5
"""Largest turn of the normal in one step. [rad]"""


class _Difference(NamedTuple):
    """How the reach is differentiated numerically."""

    step: float
    """Tangential step, as a turn of the normal or as a length. [rad or mm]"""
    central: bool
    """Whether the step is taken to both sides."""


_DIFFERENCES = (
    _Difference(1e-8, False),
    _Difference(1e-6, True),
    _Difference(1e-8, True),
    _Difference(1e-10, False),
    _Difference(1e-10, True),
    _Difference(1e-12, False),
    _Difference(1e-7, True),
    _Difference(1e-11, False),
)
"""In the order of trial. The later ones are for reaches with a cusp, where seats open."""


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines on which the ends of the reaches must lie: anchor + length * direction.

    Parameters
    ----------
    anchor : (n, 3) float
        Points of the lines. [mm]
    direction : (n, 3) float or None
        Unit directions of the lines; None: against the surface's own normal, so that a
        reach of zero leads to nearest points.

    >>> down = Lines(np.array([[0.0, 0.0, 9.0]]), np.array([[0.0, 0.0, -1.0]]))
    >>> len(down), down.directions_at(np.eye(3)[:1]).tolist()
    (1, [[0.0, 0.0, -1.0]])
    """

    anchor: FloatArray
    direction: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.anchor)

    def take(self, rows: IntArray) -> Lines:
        """The given rows."""
        direction = None if self.direction is None else self.direction[rows]
        return Lines(self.anchor[rows], direction)

    def directions_at(self, normals: FloatArray) -> FloatArray:
        """Directions of the lines to points with the given normals, (n, 3)."""
        return -normals if self.direction is None else self.direction


@dataclass(frozen=True, eq=False)
class Contact:
    """Solutions of S(u, v) + reach = anchor + length * direction.

    Attributes
    ----------
    uv : (n, 2) float
    length : (n,) float
        [mm]
    local : LocalGeometry
        Of the surface at the contact.
    residual : (n,) float
        Remaining error of the equations. [mm]
    iterations : (n,) int
    """

    uv: FloatArray
    length: FloatArray
    local: LocalGeometry
    residual: FloatArray
    iterations: IntArray

    def take(self, rows: IntArray) -> Contact:
        """The given rows."""
        return Contact(
            self.uv[rows],
            self.length[rows],
            self.local.take(rows),
            self.residual[rows],
            self.iterations[rows],
        )

    def put(self, rows: IntArray, other: Contact) -> None:
        """Replace rows by those of another solution, in place, while solutions are collected."""
        self.uv[rows], self.length[rows] = other.uv, other.length
        self.residual[rows] = other.residual
        self.iterations[rows] += other.iterations
        _put(self.local, rows, other.local)

    @property
    def solved(self) -> BoolArray:
        """Where the residual is below `TANGENCY`."""
        return np.asarray(self.residual < TANGENCY)


def ball_center(radius: float) -> Reach:
    """The reach of a rigid ball on a rigid stylus: its centre; with radius zero the point itself.

    >>> from pretravel.surface.shapes import Plane
    >>> floor = Plane([0, 0, 0], [0, 0, 1]).local(np.zeros((1, 2)))
    >>> ball_center(3.0)(np.array([0]), floor).tolist()
    [[0.0, 0.0, 3.0]]
    """

    def reach(_rows: IntArray, local: LocalGeometry) -> FloatArray:
        return np.asarray(radius * local.normal)

    return reach


def solve_contact(surface: Surface, start: FloatArray, lines: Lines, reach: Reach) -> Contact:
    """Points of a surface from which the reach ends on given lines.

    Parameters
    ----------
    surface : Surface
    start : (n, 2) float
        Parameters to start from.
    lines : Lines
    reach : Reach
        From the surface point to the line. [mm]

    Returns
    -------
    Contact
        Rows that did not converge have a residual above `TANGENCY`; nothing is raised.

    >>> from pretravel.surface.shapes import Sphere
    >>> ball, up = Sphere([0.0, 0.0, 0.0], 10.0), np.array([[0.0, 0.0, 1.0]])
    >>> touch = solve_contact(ball, np.array([[0.0, 0.3]]), Lines(20.0 * up, -up),
    ...                       ball_center(3.0))
    >>> touch.length.round(9).tolist(), bool(touch.solved[0])
    ([7.0], True)
    """
    return _solve(surface, start, lines, reach, _DIFFERENCES)


def nearest_contact(surface: Surface, start: FloatArray, points: FloatArray) -> Contact:
    """Points of a surface at which its normal leads through given points.

    As `solve_contact` with a reach of zero, whose slopes are exact: other differences would repeat
    the same steps where the nearest point lies on the border of the parameters.

    Parameters
    ----------
    surface : Surface
    start : (n, 2) float
        Parameters to start from.
    points : (n, 3) float
        [mm]

    Returns
    -------
    Contact
        Its length is that against the normal, from the point to the surface. [mm]
    """
    return _solve(surface, start, Lines(points), ball_center(0.0), _DIFFERENCES[:1])


def _solve(
    surface: Surface,
    start: FloatArray,
    lines: Lines,
    reach: Reach,
    differences: Sequence[_Difference],
) -> Contact:
    iteration = _Iteration(surface, np.asarray(start, dtype=np.float64), lines, reach)
    for difference in differences:
        first = difference is _DIFFERENCES[0]
        active = np.flatnonzero(iteration.size > (iteration.goal if first else TANGENCY))
        for _ in range(_MOST_ITERATIONS):
            if len(active) == 0:
                break
            better = iteration.advance(active, iteration.newton_step(active, difference))
            active = active[better & (iteration.size[active] > iteration.goal[active])]
    return iteration.best()


class _Iteration:
    """The best solution found so far for every row."""

    def __init__(self, surface: Surface, start: FloatArray, lines: Lines, reach: Reach) -> None:
        self.surface, self.lines, self.reach = surface, lines, reach
        n = len(lines)
        self.uv = surface.domain.confined(start)
        local, self.length, self.residual = self._at(np.arange(n), self.uv)
        self.size = np.linalg.norm(self.residual, axis=1)
        self.local = local.take(np.arange(n))
        scale = np.maximum(
            np.abs(lines.anchor).max(axis=1, initial=0.0), np.abs(local.point).max(axis=1)
        )
        self.goal = np.maximum(_CLOSED, _ROUNDING * scale)
        self.iterations = np.zeros(n, dtype=np.int64)

    def best(self) -> Contact:
        return Contact(self.uv, self.length, self.local, self.size, self.iterations)

    def _at(self, rows: IntArray, uv: FloatArray) -> tuple[LocalGeometry, FloatArray, FloatArray]:
        """Geometry, length and residual of rows at the given parameters."""
        local, lines = self.surface.local(uv), self.lines.take(rows)
        offset = local.point + self.reach(rows, local) - lines.anchor
        directions = lines.directions_at(local.normal)
        # The length enters linearly: along the line there is never an error.
        length = np.sum(offset * directions, axis=1)
        return local, length, offset - length[:, None] * directions

    def advance(self, rows: IntArray, shift: FloatArray) -> BoolArray:
        """Move rows by tangential displacements, halved until the error decreases; where it did."""
        here = self.local.take(rows)
        fraction = np.ones(len(rows))
        waiting = np.arange(len(rows))
        better = np.zeros(len(rows), dtype=bool)
        for _ in range(_MOST_HALVINGS):
            trial = rows[waiting]
            displacement = fraction[waiting, None] * shift[waiting]
            uv = _moved(self.surface, self.uv[trial], here.take(waiting), displacement)
            moves = np.any(uv != self.uv[trial], axis=1)  # not over the border of the parameters
            if not moves.all():
                waiting, trial, uv = waiting[moves], trial[moves], uv[moves]
                if len(waiting) == 0:
                    break
            local, length, residual = self._at(trial, uv)
            size = np.linalg.norm(residual, axis=1)
            with np.errstate(invalid="ignore"):
                good = size < self.size[trial]
            taken = trial[good]
            self.uv[taken], self.length[taken] = uv[good], length[good]
            self.residual[taken], self.size[taken] = residual[good], size[good]
            _put(self.local, taken, local.take(good))
            better[waiting[good]] = True
            waiting = waiting[~good]
            if len(waiting) == 0:
                break
            fraction[waiting] *= 0.5
        self.iterations[rows] += 1
        return better

    def newton_step(self, rows: IntArray, difference: _Difference) -> FloatArray:
        """Tangential displacements that, with a change of length, close the residual."""
        local, residual = self.local.take(rows), self.residual[rows]
        tangents = tangent_basis(local.normal)
        columns = self._slopes(rows, local, tangents, difference)
        usable = np.asarray(np.isfinite(columns).all(axis=(1, 2)))
        usable &= np.isfinite(residual).all(axis=1)
        with np.errstate(all="ignore"):
            regular = np.where(usable[:, None, None], columns, np.eye(3))
            usable &= np.abs(np.linalg.det(regular)) > 1e-9
        columns[~usable] = np.eye(3)
        solution = np.linalg.solve(columns, -np.where(usable[:, None], residual, 0.0)[:, :, None])
        shift = np.einsum("nk,nki->ni", solution[:, :2, 0], tangents)
        # Without a usable system: towards the line, as on a plane.
        fallback = -residual + np.sum(residual * local.normal, axis=1)[:, None] * local.normal
        shift = np.where(usable[:, None], shift, fallback)
        turn = np.linalg.norm(np.einsum("nij,nj->ni", local.curvature, shift), axis=1)
        limit = np.minimum(1.0, _LARGEST_TURN / np.maximum(turn, 1e-300))
        return np.asarray(shift * limit[:, None])

    def _slopes(
        self, rows: IntArray, local: LocalGeometry, tangents: FloatArray, difference: _Difference
    ) -> FloatArray:
        """Derivatives of the residual by two tangential displacements and the length."""
        at_rest = self.reach(rows, local)
        directions = self.lines.take(rows).directions_at(local.normal)
        columns = np.empty((len(rows), 3, 3))
        for axis in (0, 1):
            along = tangents[:, axis]
            turn = np.einsum("nij,nj->ni", local.curvature, along)
            step = difference.step / np.maximum(np.linalg.norm(turn, axis=1), 1.0)[:, None]
            ahead = self.reach(rows, _beside(local, step * along, step * turn))
            if difference.central:
                back = self.reach(rows, _beside(local, -step * along, -step * turn))
                columns[:, :, axis] = along + (ahead - back) / (2.0 * step)
            else:
                columns[:, :, axis] = along + (ahead - at_rest) / step
            if self.lines.direction is None:
                columns[:, :, axis] += self.length[rows][:, None] * turn
        columns[:, :, 2] = -directions
        return columns


def _moved(
    surface: Surface, uv: FloatArray, local: LocalGeometry, displacement: FloatArray
) -> FloatArray:
    """Parameters after a displacement, within the domain."""
    if local.along_parameters is None:
        return surface.domain.confined(surface.moved(uv, displacement))
    du, dv = local.along_parameters[:, 0], local.along_parameters[:, 1]
    return surface.domain.confined(uv + parameter_step(du, dv, displacement))


def _put(into: LocalGeometry, rows: IntArray, new: LocalGeometry) -> None:
    into.point[rows], into.normal[rows] = new.point, new.normal
    into.curvature[rows] = new.curvature
    if into.along_parameters is not None and new.along_parameters is not None:
        into.along_parameters[rows] = new.along_parameters


def _beside(local: LocalGeometry, displacement: FloatArray, turn: FloatArray) -> LocalGeometry:
    """The geometry after a small displacement along the surface."""
    normal = local.normal + turn
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return LocalGeometry(local.point + displacement, normal, local.curvature)
