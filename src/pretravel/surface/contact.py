"""Where a ball on a flexible stem touches a surface: one system of equations for all touches.

Everything that comes to rest on a surface, first contact, trigger, nearest point,
compensation of a reading, is the same three equations in two surface parameters
and one length, solved here for any number of rows by a safeguarded Newton method in
the tangent plane, so that the parametrisation does not matter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pretravel.arrays import BoolArray, FloatArray, IntArray
from pretravel.surface.local_geometry import LocalGeometry, Surface, parameter_step, tangent_basis

Reach: TypeAlias = Callable[[IntArray, LocalGeometry], FloatArray]
"""From surface point to spindle point, for the given rows: (m,) rows, geometry -> (m, 3). [mm]"""

_CLOSED = 1e-12
"""Residual at which a row is done, beside what rounding allows. [mm]"""
_ROUNDING = 4e-15
"""Residual that rounding alone leaves, relative to the coordinates."""
TANGENCY = 1e-9
"""Residual below which a row counts as solved. [mm]"""
_MOST_ITERATIONS = 40
_MOST_HALVINGS = 12
_DIFFERENCES = (
    (1e-8, False),
    (1e-6, True),
    (1e-8, True),
    (1e-10, False),
    (1e-10, True),
    (1e-12, False),
    (1e-7, True),
    (1e-11, False),
)
"""Tangential step of the numerical derivative of the reach, as a turn or a length, and whether
it is taken to both sides. The later ones are for reaches with a cusp, where seats open."""
_LARGEST_TURN = 0.5
"""The normal may turn by no more than this in one step. [rad]"""


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
        What the equations still miss. [mm]
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
        """Replace rows by another solution's, in place: while solutions are being collected."""
        self.uv[rows], self.length[rows] = other.uv, other.length
        self.residual[rows] = other.residual
        self.iterations[rows] += other.iterations
        _put(self.local, rows, other.local)

    @property
    def solved(self) -> BoolArray:
        """Where the residual is below `TANGENCY`."""
        return np.asarray(self.residual < TANGENCY)


def ball_center(radius: float) -> Reach:
    """The reach of a rigid ball on a rigid stem: its centre, or with no radius the point itself.

    >>> from pretravel.surface.shapes import Plane
    >>> floor = Plane([0, 0, 0], [0, 0, 1]).local(np.zeros((1, 2)))
    >>> ball_center(3.0)(np.array([0]), floor).tolist()
    [[0.0, 0.0, 3.0]]
    """

    def reach(_rows: IntArray, local: LocalGeometry) -> FloatArray:
        return np.asarray(radius * local.normal)

    return reach


def solve_contact(
    surface: Surface,
    start: FloatArray,
    anchor: FloatArray,
    direction: FloatArray | None,
    reach: Reach,
) -> Contact:
    """Points of a surface from which the reach leads onto given lines.

    Parameters
    ----------
    surface : Surface
    start : (n, 2) float
        Parameters to start from.
    anchor : (n, 3) float
        Points of the lines. [mm]
    direction : (n, 3) float or None
        Unit directions of the lines; None: along the surface's own normal, which
        with a reach of zero gives nearest points.
    reach : Reach
        From the surface point to the line. [mm]

    Returns
    -------
    Contact
        Rows that did not converge have a residual above `TANGENCY`; nothing is raised.

    >>> from pretravel.surface.shapes import Sphere
    >>> ball, up = Sphere([0.0, 0.0, 0.0], 10.0), np.array([[0.0, 0.0, 1.0]])
    >>> touch = solve_contact(ball, np.array([[0.0, 0.3]]), 20.0 * up, -up,
    ...                       lambda rows, local: 3.0 * local.normal)
    >>> touch.length.round(9).tolist(), bool(touch.solved[0])
    ([7.0], True)
    """
    n = len(anchor)
    uv = surface.domain.confined(np.asarray(start, dtype=np.float64))
    rows = np.arange(n)
    local = surface.local(uv)
    offset = local.point + reach(rows, local) - anchor
    ways = -local.normal if direction is None else direction
    length = np.sum(offset * ways, axis=1)
    residual = offset - length[:, None] * ways
    size = np.linalg.norm(residual, axis=1)
    best = local.take(np.arange(n))
    scale = np.maximum(np.abs(anchor).max(axis=1, initial=0.0), np.abs(local.point).max(axis=1))
    goal = np.maximum(_CLOSED, _ROUNDING * scale)
    iterations = np.zeros(n, dtype=np.int64)
    for way_of_differences in _DIFFERENCES:
        first = way_of_differences is _DIFFERENCES[0]
        active = np.flatnonzero(size > (goal if first else TANGENCY))
        for _ in range(_MOST_ITERATIONS):
            if len(active) == 0:
                break
            here = best.take(active)
            towards = None if direction is None else direction[active]
            shift = _newton_step(
                here,
                active,
                residual[active],
                towards,
                length[active],
                reach,
                *way_of_differences,
            )
            fraction = np.ones(len(active))
            waiting = np.arange(len(active))
            better = np.zeros(len(active), dtype=bool)
            for _ in range(_MOST_HALVINGS):
                trial_rows = active[waiting]
                part = fraction[waiting, None]
                new_uv = _moved(surface, uv[trial_rows], here.take(waiting), part * shift[waiting])
                new = surface.local(new_uv)
                offset = new.point + reach(trial_rows, new) - anchor[trial_rows]
                way = -new.normal if direction is None else direction[trial_rows]
                # The length enters linearly: along the line nothing is ever missed.
                new_length = np.sum(offset * way, axis=1)
                new_residual = offset - new_length[:, None] * way
                new_size = np.linalg.norm(new_residual, axis=1)
                with np.errstate(invalid="ignore"):
                    good = new_size < size[trial_rows]
                taken = trial_rows[good]
                uv[taken], length[taken] = new_uv[good], new_length[good]
                residual[taken], size[taken] = new_residual[good], new_size[good]
                _put(best, taken, new.take(good))
                better[waiting[good]] = True
                waiting = waiting[~good]
                if len(waiting) == 0:
                    break
                fraction[waiting] *= 0.5
            iterations[active] += 1
            active = active[better & (size[active] > goal[active])]
    return Contact(uv, length, best, size, iterations)


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
    """The geometry a little further along the surface."""
    normal = local.normal + turn
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return LocalGeometry(local.point + displacement, normal, local.curvature)


def _newton_step(
    local: LocalGeometry,
    rows: IntArray,
    residual: FloatArray,
    direction: FloatArray | None,
    length: FloatArray,
    reach: Reach,
    difference: float,
    to_both_sides: bool,
) -> FloatArray:
    """Tangential displacement that, with some change of length, would close the residual."""
    tangents = tangent_basis(local.normal)
    at_rest = reach(rows, local)
    columns = np.empty((len(rows), 3, 3))
    for axis in (0, 1):
        along = tangents[:, axis]
        turn = np.einsum("nij,nj->ni", local.curvature, along)
        step = difference / np.maximum(np.linalg.norm(turn, axis=1), 1.0)[:, None]
        ahead = reach(rows, _beside(local, step * along, step * turn))
        if to_both_sides:
            back = reach(rows, _beside(local, -step * along, -step * turn))
            columns[:, :, axis] = along + (ahead - back) / (2.0 * step)
        else:
            columns[:, :, axis] = along + (ahead - at_rest) / step
        if direction is None:
            columns[:, :, axis] += length[:, None] * turn
    columns[:, :, 2] = local.normal if direction is None else -direction
    usable = np.asarray(np.isfinite(columns).all(axis=(1, 2)))
    usable &= np.isfinite(residual).all(axis=1)
    with np.errstate(all="ignore"):
        usable &= np.abs(np.linalg.det(np.where(usable[:, None, None], columns, np.eye(3)))) > 1e-9
    columns[~usable] = np.eye(3)
    solution = np.linalg.solve(columns, -np.where(usable[:, None], residual, 0.0)[:, :, None])
    solution = solution[:, :, 0]
    shift = np.einsum("nk,nki->ni", solution[:, :2], tangents)
    # Without a usable system: towards the line, as on a plane.
    fallback = -residual + np.sum(residual * local.normal, axis=1)[:, None] * local.normal
    shift = np.where(usable[:, None], shift, fallback)
    turn = np.linalg.norm(np.einsum("nij,nj->ni", local.curvature, shift), axis=1)
    limit = np.minimum(1.0, _LARGEST_TURN / np.maximum(turn, 1e-300))
    return np.asarray(shift * limit[:, None])
