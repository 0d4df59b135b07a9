"""The state of the control: modes, coordinates, tools, and what programs can ask of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from tests.support.machine_model.control_files import Outputs
from tests.support.machine_model.coordinates import WORK_OFFSETS, Frame, WorkOffset
from tests.support.machine_model.modes import ZERO, Modes, Vector
from tests.support.machine_model.parameters import EQUAL, Parameters


@dataclass(frozen=True)
class Tool:
    """An entry of the tool table. [mm]"""

    length: float = 0.0
    diameter: float = 0.0


@dataclass(frozen=True)
class ProbeResult:
    """How a probe move ended: whether the state changed, and the place latched. [mm]"""

    touched: bool
    place: Vector


class Motion(Protocol):
    """What moves do. Places are those of the machine, in mm, feeds in mm/min."""

    position: Vector

    def straight(self, end: Vector, feed: float, control: Control) -> None:
        """A move; feed 0 means rapid."""

    def probe(self, end: Vector, feed: float, code: str, control: Control) -> ProbeResult: ...


class Control:
    """A control with a program's state.

    Parameters
    ----------
    motion : Motion
    modes : Modes
        At the start.
    offsets : mapping of str to WorkOffset
        By G code.
    tools : mapping of int to Tool
    tool : int
        Number of the tool in the spindle; 0 for none.
    outputs : Outputs
    equal : float
        See `parameters.EQUAL`.
    """

    def __init__(
        self,
        motion: Motion,
        *,
        modes: Modes = Modes(),
        offsets: Mapping[str, WorkOffset] | None = None,
        tools: Mapping[int, Tool] | None = None,
        tool: int = 0,
        outputs: Outputs | None = None,
        equal: float = EQUAL,
    ) -> None:
        self.motion = motion
        self.modes = modes
        self.offsets = {name: WorkOffset() for name in WORK_OFFSETS} | dict(offsets or {})
        self.tools = dict(tools or {})
        self.tool = tool
        self.selected = 0
        self.outputs = outputs or Outputs()
        self.parameters = Parameters(equal)
        self.returned = 0.0
        self.value_returned = False
        self.line = 0
        self.file = "program"
        self.spindle_starts: list[int] = []
        self.homes: dict[str, Vector] = {"G28": ZERO, "G30": ZERO}
        self._tell()

    @property
    def frame(self) -> Frame:
        modes = self.modes
        return Frame(self.offsets[modes.work_offset], modes.shift, modes.tool_offset)

    @property
    def place(self) -> Vector:
        """Where the program is, in the active work offset. [mm]"""
        return self.frame.to_work(self.motion.position)

    @property
    def tool_length(self) -> Vector:
        """The length of the tool in the spindle, in the tool table. [mm]"""
        return (0.0, 0.0, self.tools.get(self.tool, Tool()).length)

    def change(self, **modes: object) -> None:
        self.modes = replace(self.modes, **modes)  # type: ignore[arg-type]

    def set_offset(self, name: str, offset: WorkOffset) -> None:
        self.offsets[name] = offset

    def _tell(self) -> None:
        """What programs can ask: parameters that follow the state."""
        live = self.parameters.live
        live[5220] = lambda: 1.0 + WORK_OFFSETS.index(self.modes.work_offset)
        live[5400] = lambda: float(self.tool)
        live[5403] = lambda: self.tool_length[2]
        live[5410] = lambda: self.tools.get(self.tool, Tool()).diameter
        live[5210] = lambda: float(self.modes.shift != ZERO)
        for row in range(3):
            self._tell_axis(row)
        for number in range(len(WORK_OFFSETS)):
            self._tell_offset(number)
        for other in "abcuvw":
            live[f"_{other}"] = live[f"_abs_{other}"] = lambda: 0.0
        self._tell_modes()

    def _tell_axis(self, row: int) -> None:
        live, name = self.parameters.live, "xyz"[row]
        live[5420 + row] = lambda: self.place[row] / self.modes.unit
        live[5211 + row] = lambda: self.modes.shift[row]
        live[5161 + row] = lambda: self.homes["G28"][row]
        live[5181 + row] = lambda: self.homes["G30"][row]
        live[f"_{name}"] = live[5420 + row]
        live[f"_abs_{name}"] = lambda: self.motion.position[row] / self.modes.unit

    def _tell_offset(self, number: int) -> None:
        live, name = self.parameters.live, WORK_OFFSETS[number]
        base = 5221 + 20 * number
        live[base] = lambda: self.offsets[name].origin[0]
        live[base + 1] = lambda: self.offsets[name].origin[1]
        live[base + 2] = lambda: self.offsets[name].origin[2]
        live[base + 9] = lambda: self.offsets[name].turn_deg

    def _tell_constant(self, name: str, value: float) -> None:
        self.parameters.live[name] = lambda: value

    def _tell_modes(self) -> None:
        live = self.parameters.live

        def tell(name: str, mode: str, value: object) -> None:
            live[name] = lambda: float(getattr(self.modes, mode) == value)

        for name, mode, value in (
            ("_metric", "units", "G21"), ("_imperial", "units", "G20"),
            ("_absolute", "distance", "G90"), ("_incremental", "distance", "G91"),
            ("_inverse_time", "feed_mode", "G93"), ("_units_per_minute", "feed_mode", "G94"),
            ("_units_per_rev", "feed_mode", "G95"), ("_lathe_diameter_mode", "lathe", "G7"),
            ("_lathe_radius_mode", "lathe", "G8"), ("_spindle_cw", "spindle", "M3"),
            ("_mist", "mist", True), ("_flood", "flood", True),
            ("_feed_override", "feed_override", True),
            ("_speed_override", "speed_override", True),
            ("_adaptive_feed", "adaptive_feed", True), ("_feed_hold", "feed_hold", True),
        ):  # fmt: skip
            tell(name, mode, value)
        live["_spindle_on"] = lambda: float(self.modes.spindle != "M5")
        live["_tool_offset"] = lambda: float(self.modes.tool_offset != ZERO)
        live["_feed"] = lambda: (
            self.modes.feed / (1.0 if self.modes.feed_mode == "G93" else self.modes.unit)
        )
        live["_rpm"] = lambda: self.modes.speed
        live["_current_tool"] = lambda: float(self.tool)
        live["_selected_tool"] = lambda: float(self.selected)
        live["_coord_system"] = lambda: 10.0 * float(self.modes.work_offset[1:])
        live["_plane"] = lambda: 10.0 * float(self.modes.plane[1:])
        live["_motion_mode"] = lambda: 10.0 * float(self.modes.motion[1:])
        live["_ccomp"] = lambda: 400.0
        for name, constant in (
            ("_retract_r_plane", 0.0), ("_retract_old_z", 1.0), ("_spindle_rpm_mode", 1.0),
            ("_spindle_css_mode", 0.0), ("_ijk_absolute_mode", 0.0),
            ("_task", 1.0), ("_remap_level", 0.0),
            ("_vmajor", 2.9), ("_vminor", 0.0), ("_selected_pocket", -1.0),
            ("_current_pocket", 0.0),
        ):  # fmt: skip
            self._tell_constant(name, constant)
