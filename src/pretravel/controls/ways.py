"""Free ways of the tip to, between and from touches.

Between two touches the tip moves straight where that is checked and free; else up to the safe
height, across, and down again. Where the way straight down is not free, the tip comes in from the
side to which the normal points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.controls.surroundings import Surroundings
from pretravel.files import Machine
from pretravel.touches import Targets

_SIDEWAYS = (0.0, 2.0, 5.0, 10.0, 20.0, 40.0)
"""Distances along the normal's horizontal part at which a way down is tried. [mm]"""


@dataclass(frozen=True, eq=False)
class TouchMoves:
    """The move of the tip's centre that touches each target.

    Attributes
    ----------
    targets : Targets
    approaches : (n, 3) float
        Unit directions of travel.
    starts, contacts, ends : (n, 3) float
        The start, the contact with the nominal surface, and where a touch counts as missed. [mm]
    """

    targets: Targets
    approaches: FloatArray
    starts: FloatArray
    contacts: FloatArray
    ends: FloatArray


def touch_moves(targets: Targets, machine: Machine) -> TouchMoves:
    """The moves that touch targets with the probe of a machine.

    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    >>> touch_moves(up, Machine()).starts.tolist()
    [[0.0, 0.0, 5.0]]
    """
    approaches = np.asarray(targets.approaches)
    contacts = targets.points + machine.tip_radius * targets.normals
    return TouchMoves(
        targets,
        approaches,
        starts=contacts - machine.start_distance * approaches,
        contacts=contacts,
        ends=contacts + machine.overtravel * approaches,
    )


def check_height(touches: TouchMoves, surroundings: Surroundings) -> None:
    """Refuse a safe height at which the tip would meet targets, starts or obstacles."""
    machine = surroundings.machine
    highest = max(
        float(touches.starts[:, 2].max()),
        float(touches.targets.points[:, 2].max()) + machine.tip_radius + machine.clearance,
        surroundings.lowest_travel,
    )
    if machine.safe_height < highest:
        raise PretravelError(
            f"safe_height_mm = {machine.safe_height:g}: the tip's centre must be at {highest:.3f} "
            "mm at least to travel over the obstacles (work coordinates)"
        )


def ways_down(touches: TouchMoves, surroundings: Surroundings) -> list[FloatArray | None]:
    """For each touch the first free way from the safe height to its start.

    Returns
    -------
    list of (k, 3) float, or None
        Places to pass, without the start; None where no way is free. [mm]
    """
    starts = touches.starts
    sideways = _horizontal(touches.targets.normals)
    ways: list[FloatArray | None] = [None] * len(starts)
    open_rows = np.arange(len(starts))
    for distance in _SIDEWAYS:
        corner = starts[open_rows] + distance * sideways[open_rows]
        top = corner.copy()
        top[:, 2] = surroundings.machine.safe_height
        blocked = surroundings.block(top, corner)
        if distance > 0.0:
            blocked |= surroundings.block(corner, starts[open_rows])
        for i in np.flatnonzero(~blocked):
            places = [top[i]] if distance == 0.0 else [top[i], corner[i]]
            ways[int(open_rows[i])] = frozen(places)
        open_rows = open_rows[blocked]
        if not len(open_rows):
            break
    return ways


def _horizontal(normals: FloatArray) -> FloatArray:
    """Unit vectors along the horizontal parts of normals; zero where there is none."""
    across = np.array(normals)
    across[:, 2] = 0.0
    length = np.linalg.norm(across, axis=1)
    unit = across / np.maximum(length, 1e-12)[:, None]
    return np.asarray(np.where((length > 1e-3)[:, None], unit, 0))


def ways_between(
    touches: TouchMoves, down: Sequence[FloatArray], surroundings: Surroundings
) -> list[FloatArray]:
    """The way to each start from the start before it, the first one from the safe height.

    Returns
    -------
    list of (k, 3) float
        Places to pass; none where the tip moves straight. [mm]
    """
    starts = touches.starts
    straight = np.full(len(starts) - 1, surroundings.known)
    if surroundings.known and len(straight):
        moves = np.linalg.norm(np.diff(starts, axis=0), axis=1) > 0.0
        straight &= ~surroundings.block(starts[:-1], starts[1:]) | ~moves
    ways = [down[0]]
    for row in range(1, len(starts)):
        over = np.vstack([down[row - 1][::-1], down[row]])
        ways.append(np.empty((0, 3)) if straight[row - 1] else frozen(over))
    return ways


def check_limits(touches: TouchMoves, down: Sequence[FloatArray], machine: Machine) -> str:
    """Refuse moves beyond the limits of a machine.

    Returns
    -------
    str
        Why the limits could not be checked; empty where they were.

    Raises
    ------
    PretravelError
        A move beyond a limit.
    """
    if machine.limits is None:
        return "the machine file has no [limits]"
    if machine.work is None:
        return "[work] does not give the place of the work coordinates"
    for row, way in enumerate(down):
        places = machine.work.points(np.vstack([way, touches.starts[row], touches.ends[row]]))
        outside = (places < machine.limits[:, 0]) | (places > machine.limits[:, 1])
        if outside.any():
            place, axis = np.argwhere(outside)[0]
            raise PretravelError(
                f"{touches.targets.name(row)}: the tip would go to {'xyz'[axis]} = "
                f"{places[place, axis]:.3f} mm in machine coordinates, beyond the limits "
                f"{machine.limits[axis, 0]:g} to {machine.limits[axis, 1]:g} mm"
            )
    return ""
