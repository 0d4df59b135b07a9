"""The machine data that a probing program uses: probe, feeds, distances, work offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.frames import Placement, probe_rotation

WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
"""Coordinate systems of LinuxCNC, in the order of their numbers 1 to 9."""

_POSITIVE = (
    "tip_diameter", "stem_diameter", "stylus_length", "body_diameter", "measuring_feed",
    "positioning_feed", "start_distance", "overtravel", "clearance",
)  # fmt: skip


@dataclass(frozen=True)
class Machine:
    """The machine data that a probing program uses. The probe axis is the machine's z.

    Attributes
    ----------
    name : str
    tool : int
        Number of the probe in the tool table; 0 when the probe is in the spindle already and
        its length is active.
    tip_diameter, stem_diameter : float
        Diameters of the ball, and of the stylus above it. [mm]
    stylus_length : float
        Length from the ball's centre up to the body of the probe. [mm]
    body_diameter : float
        Diameter of the probe above the stylus. [mm]
    measuring_feed, positioning_feed : float
        Feeds while a touch is expected, and to the starts of touches and back. [mm/min]
    safe_height : float
        Height of the tip's centre at which the tip may travel anywhere, work coordinates. [mm]
    start_distance : float
        Distance from the ball to the surface at the start of a touch. [mm]
    overtravel : float
        Travel beyond the nominal surface before a touch counts as missed. [mm]
    clearance : float
        Distance from obstacles on the way to the starts of touches. It must be larger than the
        errors of the work offset and of the drawing. [mm]
    work_offset : str
        The active work offset, G54 to G59.3.
    work : Placement or None
        Place of the work coordinates in the machine, where it is known. [mm]
    limits : (3, 2) float or None
        Lowest and highest position of the tip along each axis, in machine coordinates with the
        tool's length subtracted. [mm]

    Raises
    ------
    PretravelError
        A size, feed or distance is not positive; the work offset is unknown.

    >>> Machine().measuring_feed
    50.0
    """

    name: str = "machine"
    tool: int = 0
    tip_diameter: float = 6.0
    stem_diameter: float = 4.5
    stylus_length: float = 50.0
    body_diameter: float = 40.0
    measuring_feed: float = 50.0
    positioning_feed: float = 1000.0
    safe_height: float = 50.0
    start_distance: float = 2.0
    overtravel: float = 2.0
    clearance: float = 1.0
    work_offset: str = "G54"
    work: Placement | None = None
    limits: FloatArray | None = None

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            if not 0.0 < getattr(self, name) < 1e6:
                raise self._error(name, "a positive number is needed")
        if not -1e5 < self.safe_height < 1e5:
            raise self._error("safe_height", "it must lie between -100000 and 100000 mm")
        if self.stem_diameter >= self.tip_diameter:
            raise self._error(
                "stem_diameter",
                f"it must be smaller than the tip's ({self.tip_diameter:g} mm), or the stem "
                "touches first",
            )
        if self.clearance >= self.start_distance:
            raise self._error(
                "clearance",
                f"it must be less than the start distance ({self.start_distance:g} mm), because "
                "the tip comes as close as that",
            )
        if self.tool < 0:
            raise self._error("tool", "a tool number is not negative")
        if self.work_offset not in WORK_OFFSETS:
            raise PretravelError(
                f"work offset '{self.work_offset}': it is one of {', '.join(WORK_OFFSETS)}",
                inputs=("work_offset",),
            )
        if self.limits is not None and not np.all(self.limits[:, 0] < self.limits[:, 1]):
            raise PretravelError(
                "limits of an axis: the first number must be below the second",
                inputs=("limits",),
            )

    def _error(self, name: str, need: str) -> PretravelError:
        unit = " mm/min" if name.endswith("feed") else "" if name == "tool" else " mm"
        words = name.replace("_", " ")
        return PretravelError(f"{words} {getattr(self, name):g}{unit}: {need}", inputs=(name,))

    @property
    def tip_radius(self) -> float:
        """[mm]"""
        return 0.5 * self.tip_diameter


def work_placement(x: float, y: float, z: float, rotation: float = 0.0) -> Placement:
    """The place of work coordinates in the machine: an offset, and a turn about z.

    Parameters
    ----------
    x, y, z : float
        Work origin in machine coordinates. [mm]
    rotation : float
        Turn about z, counter-clockwise (G10 L2 R). [rad]

    Returns
    -------
    Placement

    >>> turned = work_placement(1.0, 2.0, 3.0, np.pi / 2)
    >>> turned.points(np.array([[1.0, 0.0, 0.0]])).round(9).tolist()
    [[1.0, 3.0, 3.0]]
    """
    return Placement(probe_rotation(rotation=rotation), np.array([x, y, z]))


def work_turn(work: Placement) -> float:
    """The turn about z of work coordinates in the machine. [rad]

    >>> round(work_turn(work_placement(0.0, 0.0, 0.0, 0.3)), 12)
    0.3
    """
    return float(np.arctan2(work.rotation[1, 0], work.rotation[0, 0]))
