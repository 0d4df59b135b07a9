"""A probing program that touches a sphere at several angles of a rotary axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pretravel.base import DEGREE, FloatArray, PretravelError, frozen
from pretravel.controls.gcode import coordinate
from pretravel.controls.program import ProbingProgram, TableTurns, plan_program
from pretravel.controls.rotary_axes import AXIS_LETTERS, check_axis_angles
from pretravel.controls.surroundings import SphereObstacle
from pretravel.files import Machine, work_turn
from pretravel.touches import Targets

_FINE = 1.0 * DEGREE
"""Step at which the height of the sphere is looked at while the axis turns."""
_FARTHEST_APART = 5.0
"""Distance of two centres from which they show an axis to some micrometres. [mm]"""


@dataclass(frozen=True, eq=False)
class TurnedSphere:
    """A reference sphere on a rotary axis.

    Attributes
    ----------
    letter : str
        A, B or C: the axis lies along x, y or z of the machine.
    about : (3,) float
        A place on the axis, work coordinates, to about 1 mm; its coordinate along the axis has no
        meaning. [mm]
    sense : int
        -1 where the sphere turns against the angle, right-handed about the machine's axis, as on a
        table; 1 where it turns with it.
    obstacle : SphereObstacle
        The sphere at the first angle, work coordinates.
    """

    letter: str
    about: FloatArray
    sense: int
    obstacle: SphereObstacle

    def centers(self, turns: FloatArray, machine: Machine) -> FloatArray:
        """Centres after turns from the first angle [rad], (n, 3). [mm]"""
        from scipy.spatial.transform import Rotation

        along = np.zeros(3)
        along[AXIS_LETTERS[self.letter]] = 1.0
        if machine.work is not None:
            along = machine.work.rotation.T @ along
        rotations = Rotation.from_rotvec(self.sense * np.asarray(turns)[:, None] * along)
        return np.asarray(self.about + rotations.apply(self.obstacle.center - self.about))


def plan_axis_program(
    sphere: TurnedSphere,
    angles: Sequence[float],
    normals: FloatArray,
    machine: Machine,
    *,
    turning_feed: float,
    feeds: Sequence[float] = (),
    repeats: int = 1,
) -> ProbingProgram:
    """Plan touches of a sphere at several angles of a rotary axis, for `rotary_axis`.

    The axis turns while the tip is at the safe height; at each angle the same directions are
    touched. Labels begin with the angle in degrees, ``at60_s1``.

    Parameters
    ----------
    sphere : TurnedSphere
    angles : sequence of float
        [rad]
    normals : (n, 3) float
        Directions from the sphere's centre, work coordinates.
    machine : Machine
    turning_feed : float
        [deg/min]
    feeds, repeats
        As `plan_program` has them.

    Raises
    ------
    PretravelError
        Angles that do not determine an axis or occur twice; a sphere that hardly moves, or comes
        up to the tip at the safe height; as `plan_program`.

    >>> on_table = SphereObstacle(np.array([40.0, 0.0, 0.0]), 12.5)
    >>> sphere = TurnedSphere("C", np.zeros(3), -1, on_table)
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> angles = np.array([0.0, 90.0, 180.0]) * DEGREE
    >>> program = plan_axis_program(sphere, angles, up, Machine(), turning_feed=1000.0)
    >>> program.labels[1], program.points[1].round(9).tolist()
    ('at90_s1', [0.0, -40.0, 12.5])
    """
    turns = np.asarray(angles, dtype=np.float64)
    check_axis_angles(turns)
    if len(np.unique(turns)) < len(turns):
        raise PretravelError("an angle of the axis occurs twice", inputs=("angles",))
    _check_swing(sphere, turns, machine)
    _check_ways(sphere, turns, machine)
    parts = [
        plan_program(
            Targets(
                center + sphere.obstacle.radius * normals, normals,
                labels=tuple(
                    f"at{coordinate(angle / DEGREE)}_s{i + 1}" for i in range(len(normals))
                ),
            ),
            machine,
            title=f"axis {sphere.letter} by a sphere of {2 * sphere.obstacle.radius:g} mm at "
            f"{len(turns)} angles",
            feeds=feeds,
            repeats=repeats,
            obstacles=[replace(sphere.obstacle, center=center)],
        )
        for angle, center in zip(turns, sphere.centers(turns - turns[0], machine), strict=True)
    ]  # fmt: skip
    return _joined(parts, turns, sphere, turning_feed)


def _check_swing(sphere: TurnedSphere, turns: FloatArray, machine: Machine) -> None:
    """Refuse a safe height that the sphere reaches while the axis turns."""
    ends = pairwise(turns)
    passed = np.concatenate(
        [np.linspace(a, b, int(abs(b - a) / _FINE) + 2) for a, b in ends]
    )  # fmt: skip
    heights = sphere.centers(passed - turns[0], machine)[:, 2]
    need = float(heights.max()) + sphere.obstacle.radius + machine.tip_radius + machine.clearance
    if machine.safe_height < need:
        worst = passed[int(np.argmax(heights))] / DEGREE
        raise PretravelError(
            f"safe_height_mm = {machine.safe_height:g}: while {sphere.letter} turns, the sphere "
            f"comes up to the tip at {worst:.0f} degrees; the tip's centre must be at {need:.3f} "
            "mm at least (work coordinates)"
        )


def _check_ways(sphere: TurnedSphere, turns: FloatArray, machine: Machine) -> None:
    """Refuse angles between which the sphere hardly moves: its centres would show no axis."""
    centers = sphere.centers(turns - turns[0], machine)
    apart = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    if float(apart.max()) < _FARTHEST_APART:
        raise PretravelError(
            f"between these angles the sphere moves by {float(apart.max()):.2g} mm: that shows no "
            "axis. Put the sphere far from the axis, and turn all around or as far as it reaches "
            "(angles in degrees)",
            inputs=("center", "about", "angles"),
        )


def _joined(
    parts: Sequence[ProbingProgram], turns: FloatArray, sphere: TurnedSphere, feed: float
) -> ProbingProgram:
    """One program after the other, with a turn before each."""
    first, last = parts[0], parts[-1]
    rows = np.cumsum([0, *(len(part) for part in parts)])
    ways_up = [np.empty((0, 3)), *(part.leave for part in parts[:-1])]
    tilts = sphere.letter != "C"
    before = {
        int(row): (float(angle), way)
        for row, angle, way in zip(rows[:-1], turns, ways_up, strict=True)
    }
    unknown = f"parts and fixtures that turn with {sphere.letter} near the sphere" + (
        ", and the sphere's shank" if tilts else ""
    )
    if tilts and first.machine.work is not None:
        tilts = abs(work_turn(first.machine.work)) < 1e-9
    return replace(
        first,
        labels=tuple(label for part in parts for label in part.labels),
        points=frozen(np.vstack([part.points for part in parts])),
        normals=frozen(np.vstack([part.normals for part in parts])),
        approaches=frozen(np.vstack([part.approaches for part in parts])),
        starts=frozen(np.vstack([part.starts for part in parts])),
        ends=frozen(np.vstack([part.ends for part in parts])),
        feeds=frozen(np.concatenate([part.feeds for part in parts])),
        ways=tuple(way for part in parts for way in part.ways),
        leave=last.leave,
        unchecked=(*first.unchecked, unknown),
        turns=TableTurns(sphere.letter, feed, before, straight=tilts),
    )
