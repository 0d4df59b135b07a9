"""The machine data that a probing program uses: probe, feeds, distances, work offset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import (
    REAL,
    FloatArray,
    Placement,
    PretravelError,
    check_numbers,
    probe_rotation,
)

WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
"""Coordinate systems of LinuxCNC, in the order of their numbers 1 to 9."""

_BOUNDS: Mapping[str, tuple[float, float]] = {
    "tip_diameter": (0.05, 50.0),
    "stem_diameter": (0.02, 50.0),
    "stylus_length": (1.0, 1000.0),
    "body_diameter": (0.1, 500.0),
    "measuring_feed": (0.5, 3000.0),
    "positioning_feed": (1.0, 60000.0),
    "travel_feed": (1.0, 60000.0),
    "acceleration": (1.0, 1e6),
    "safe_height": (-1e4, 1e4),
    "start_distance": (0.01, 100.0),
    "overtravel": (0.01, 100.0),
    "clearance": (0.001, 100.0),
    "tool_length": (-2000.0, 2000.0),
    "change_height": (-1e4, 1e4),
}
"""Lowest and highest value of each number, beyond which it is a mistake."""
_UNITS: Mapping[str, str] = {
    "measuring_feed": " mm/min",
    "positioning_feed": " mm/min",
    "travel_feed": " mm/min",
    "acceleration": " mm/s²",
    "tool": "",
}
_STYLUS_SHARE = 0.2
"""Touch probes tilt by 11 degrees and more before their stop: a fifth of the stylus length."""
_LARGEST_OVERRIDE = 2.0
"""Of the feed, on usual controls."""
_LARGEST_DEFLECTION = 10.0
"""No probe gives way further than this, however long its stylus is. [mm]"""
_REACTION = 3e-3
"""Between a contact and the first cycle that decelerates. [s]"""
USUAL_STYLUS_LENGTH = 50.0
"""Of a probe that is not described. [mm]"""


@dataclass(frozen=True)
class Machine:
    """The machine data that a probing program uses. The probe axis is the machine's z.

    Attributes
    ----------
    name : str
    tool : int or None
        Number of the probe in the tool table. None: the control has no length for the probe, and
        the work offset was set with the probe in the spindle.
    tool_length : float
        Length of the probe in the tool table; programs stop where the active length differs from
        it by more than the clearance. [mm]
    change_height : float or None
        Height, in machine coordinates, to which the spindle retracts before the program changes
        to the probe. None: programs do not change the tool, they stop where it is another one.
        [mm]
    tip_diameter, stem_diameter : float
        Diameters of the ball, and of the stylus above it. [mm]
    stylus_length : float
        Length from the tip's centre up to the body of the probe. [mm]
    body_diameter : float
        Diameter of the probe above the stylus. [mm]
    measuring_feed, positioning_feed : float
        Feeds while a touch is expected, and to the starts of touches and back. [mm/min]
    travel_feed : float
        Feed of moves at the safe height; the positioning feed where not given. [mm/min]
    acceleration : float
        Smallest acceleration of the axes, which gives how far the tip travels on after a contact.
        [mm/s²]
    safe_height : float
        Height of the tip's centre at which the tip may travel anywhere, work coordinates. [mm]
    start_distance : float
        Distance from the tip to the surface at the start of a touch. [mm]
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
        A number is not finite or not within what a stylus and a machine can bear; the work offset
        is unknown.

    >>> Machine().measuring_feed
    50.0
    """

    name: str = "machine"
    tool: int | None = None
    tool_length: float = 0.0
    change_height: float | None = None
    tip_diameter: float = 6.0
    stem_diameter: float = 4.5
    stylus_length: float = USUAL_STYLUS_LENGTH
    body_diameter: float = 40.0
    measuring_feed: float = 50.0
    positioning_feed: float = 1000.0
    travel_feed: float = field(default=0.0)
    acceleration: float = 500.0
    safe_height: float = 50.0
    start_distance: float = 2.0
    overtravel: float = 2.0
    clearance: float = 1.0
    work_offset: str = "G54"
    work: Placement | None = None
    limits: FloatArray | None = None

    def __post_init__(self) -> None:
        check_numbers(self, **dict.fromkeys(_BOUNDS, REAL))
        if self.travel_feed == 0.0:
            object.__setattr__(self, "travel_feed", self.positioning_feed)
        for name, (lowest, highest) in _BOUNDS.items():
            value = getattr(self, name)
            if value is not None and not lowest <= value <= highest:
                raise self._error(name, f"it must lie between {lowest:g} and {highest:g}")
        if self.stem_diameter >= self.tip_diameter:
            raise self._error(
                "stem_diameter",
                f"it must be smaller than the tip's ({self.tip_diameter:g} mm), or the stem "
                "touches first",
            )
        if self.body_diameter < self.stem_diameter:
            raise self._error(
                "body_diameter",
                f"the probe's body is not thinner than the stem ({self.stem_diameter:g} mm)",
            )
        if self.clearance >= self.start_distance:
            raise self._error(
                "clearance",
                f"it must be less than the start distance ({self.start_distance:g} mm), because "
                "the tip comes as close as that",
            )
        if self.overtravel > self.largest_deflection:
            raise self._error(
                "overtravel",
                f"a stylus of {self.stylus_length:g} mm can deflect by {self.largest_deflection:g} "
                "mm at most",
            )
        # Overrides are off during touches only.
        for name, override in (
            ("measuring_feed", 1.0),
            ("positioning_feed", _LARGEST_OVERRIDE),
            ("travel_feed", _LARGEST_OVERRIDE),
        ):
            self._check_stop(name, override)
        if self.tool is not None and self.tool < 1:
            raise self._error("tool", "the tool table numbers tools from 1")
        if self.tool is None and (self.tool_length != 0.0 or self.change_height is not None):
            raise self._error("tool_length", "a length and a tool change need the number of a tool")
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

    def _check_stop(self, name: str, override: float) -> None:
        """Refuse a feed from which the machine cannot stop before the probe is at its stop."""
        distance = self.stopping_distance(override * getattr(self, name))
        if distance > self.largest_deflection:
            raise self._error(
                name,
                f"after a contact the tip travels {distance:.3g} mm further (acceleration "
                f"{self.acceleration:g} mm/s², override up to {100 * override:g} %), but a stylus "
                f"of {self.stylus_length:g} mm can deflect by {self.largest_deflection:g} mm at "
                "most; choose a lower feed, or give the true acceleration",
            )

    def _error(self, name: str, need: str) -> PretravelError:
        unit, words = _UNITS.get(name, " mm"), name.replace("_", " ")
        return PretravelError(f"{words} {getattr(self, name):g}{unit}: {need}", inputs=(name,))

    def stopping_distance(self, feed: float) -> float:
        """Travel between a contact at a feed [mm/min] and the standstill. [mm]

        LinuxCNC up to 2.9 decelerates a probing move under G64 with half of the acceleration (its
        issue 4220), and begins after up to three cycles of its servo.

        >>> round(Machine(acceleration=500.0).stopping_distance(3000.0), 6)
        5.15
        """
        speed = feed / 60.0
        return speed**2 / self.acceleration + _REACTION * speed

    @property
    def largest_deflection(self) -> float:
        """The deflection of the stylus that the probe bears. [mm]"""
        return largest_deflection(self.stylus_length)

    @property
    def tip_radius(self) -> float:
        """[mm]"""
        return 0.5 * self.tip_diameter


def largest_deflection(stylus_length: float) -> float:
    """The deflection that a probe bears with a stylus of a length. [mm]

    >>> largest_deflection(30.0)
    6.0
    """
    return min(_STYLUS_SHARE * stylus_length, _LARGEST_DEFLECTION)


def work_placement(x: float, y: float, z: float, rotation: float = 0.0) -> Placement:
    """The place of work coordinates in the machine: an offset, and a turn about z.

    Parameters
    ----------
    x, y, z : float
        Work origin in machine coordinates. [mm]
    rotation : float
        Turn about z, counter-clockwise (G10 L2 R). [rad]

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
