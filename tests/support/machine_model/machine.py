"""Runs a program on a machine with a probe, and reports all that happened."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Literal

from tests.support.machine_model.control import Control, ProbeResult, Tool
from tests.support.machine_model.control_files import Outputs
from tests.support.machine_model.coordinates import WorkOffset
from tests.support.machine_model.errors import StopError
from tests.support.machine_model.interpreter import Interpreter
from tests.support.machine_model.modes import Modes, Vector
from tests.support.machine_model.parameters import EQUAL
from tests.support.machine_model.probe import Edge, Probe
from tests.support.machine_model.program import Files
from tests.support.machine_model.world import Depths, Path, World

HANDLER = "pretravel_restore"
"""The subroutine that the INI file states as ON_ABORT_COMMAND; it need not be there."""
_CODES = ("G38.2", "G38.3", "G38.4", "G38.5")


@dataclass(frozen=True)
class Move:
    """One straight move. Places are those of the spindle in machine coordinates. [mm]

    Attributes
    ----------
    kind : str
        "rapid", "feed" or "probe".
    code : str
        G0, G1, G38.2 …
    start, planned, reached : tuple
    tip_start, tip_planned, tip_reached : tuple
        The same of the middle of the ball, wherever the control believes it to be.
    feed : float
        As programmed; 0 for a rapid move. [mm/min]
    speed : float
        The machine's, with the override. [mm/s]
    override : bool
        The feed override had influence.
    tripped_at_start, tripped_during, tripped_at_end : bool
        The probe's signal; `during`: it closed while the tip moved.
    touched : bool or None
        What a probe move told the program, #5070.
    depths : Depths
        The deepest places of ball, stem and body.
    depths_at_start : Depths
    line : int
    file : str
    """

    kind: Literal["rapid", "feed", "probe"]
    code: str
    start: Vector
    planned: Vector
    reached: Vector
    tip_start: Vector
    tip_planned: Vector
    tip_reached: Vector
    feed: float
    speed: float
    override: bool
    tripped_at_start: bool
    tripped_during: bool
    tripped_at_end: bool
    touched: bool | None
    depths: Depths
    depths_at_start: Depths
    contacts: int
    line: int
    file: str

    @property
    def length(self) -> float:
        return math.dist(self.start, self.reached)


@dataclass(frozen=True)
class Trace:
    """What happened when a program ran.

    Attributes
    ----------
    moves : tuple of Move
    logs : mapping of str to tuple of str
        Lines by the name of the log.
    messages : tuple of str
        Messages of the program, then the error of the control, if there was one.
    ended : str
        "end", "abort" (the program stopped itself) or "error" (the control stopped it).
    error : str
    line : int
        Line of the program's main file or subroutine at which it ended.
    before, after : Modes
    offsets_before, offsets_after : mapping of str to WorkOffset
    tool_before : int
    tool : int
        In the spindle at the end.
    spindle_starts : tuple of int
        Lines.
    contacts : int
        How often the ball touched something.
    parameters : mapping of str to float
        Named global parameters at the end.
    """

    moves: tuple[Move, ...]
    logs: Mapping[str, tuple[str, ...]]
    messages: tuple[str, ...]
    printed: tuple[str, ...]
    ended: Literal["end", "abort", "error"]
    error: str
    line: int
    before: Modes
    after: Modes
    offsets_before: Mapping[str, WorkOffset]
    offsets_after: Mapping[str, WorkOffset]
    tool_before: int
    tool: int
    spindle_starts: tuple[int, ...]
    contacts: int
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Machine:
    """A machine with a probe on it.

    Attributes
    ----------
    world : World
    position : tuple
        Of the spindle at the start, in machine coordinates. [mm]
    modes : Modes
        At the start.
    offsets : mapping of str to WorkOffset
    tools : mapping of int to Tool
    tool : int
        In the spindle at the start.
    override : float
        The operator's feed override; 1 is 100 %.
    adaptive : float
        The input of the adaptive feed, where a program or operator switched it on.
    rapid_feed : float
        [mm/min]
    acceleration : float
        [mm/s²]
    reaction : float
        The control begins to stop so much after a change of the signal; 2.6 ms were seen on
        LinuxCNC with a period of 1 ms. [s]
    limits : tuple or None
        Lowest and highest place of each axis. [mm]
    folders : tuple of str or None
        Folders that exist for logs; None: all.
    equal : float
        See `parameters.EQUAL`.
    logs : mapping of str to tuple of str
        Files that are there.
    disk_full : bool
        See `Outputs.full`.
    calls_on_abort : bool
        Whether the INI file states `HANDLER`.
    aborted_at : int or None
        The operator presses Esc instead of this move.
    """

    world: World = field(default_factory=World)
    position: Vector = (0.0, 0.0, 100.0)
    modes: Modes = field(default_factory=Modes)
    offsets: Mapping[str, WorkOffset] = field(default_factory=dict)
    tools: Mapping[int, Tool] = field(default_factory=dict)
    tool: int = 0
    override: float = 1.0
    adaptive: float = 1.0
    rapid_feed: float = 12000.0
    acceleration: float = 1000.0
    reaction: float = 0.0026
    limits: tuple[Vector, Vector] | None = None
    folders: tuple[str, ...] | None = None
    equal: float = EQUAL
    logs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    disk_full: bool = False
    calls_on_abort: bool = True
    aborted_at: int | None = None


class _Moving:
    """What moves do on the machine; records them."""

    def __init__(self, machine: Machine, probe: Probe) -> None:
        self.machine = machine
        self.probe_signal = probe
        self.position = machine.position
        self.moves: list[Move] = []

    def straight(self, end: Vector, feed: float, control: Control) -> None:
        if math.dist(self.position, end) < 1e-12:
            return
        self._check_limits(end, "Linear", control)
        speed = self._speed(feed, control)
        path, edges = self._path(end)
        delay = speed * self.probe_signal.delay
        rising = next((e.way + delay for e in edges if e.closed), math.inf)
        made = min(path.length, rising + self._stopping(speed))
        tripped = rising <= path.length
        kind: Literal["rapid", "feed"] = "feed" if feed else "rapid"
        self._make(kind, "G1" if feed else "G0", path, made, (feed, speed), None, control)
        if tripped:
            raise StopError("Probe tripped during non-probe move.")

    def probe(self, end: Vector, feed: float, code: str, control: Control) -> ProbeResult:
        self._check_limits(end, "Probe", control)
        wanted = code in _CODES[:2]
        strict = code in ("G38.2", "G38.4")
        signal = self.probe_signal
        if strict and signal.closed == wanted:
            if wanted:
                raise StopError("Probe is already tripped when starting G38.2 or G38.3 move")
            raise StopError("Probe is already clear when starting G38.4 or G38.5 move")
        speed = self._speed(feed, control)
        path, edges = self._path(end)
        changed = self._change(edges, wanted=wanted, delay=speed * signal.delay)
        found = changed <= path.length
        made = min(path.length, changed + (self._stopping(speed) if changed > 0.0 else 0.0))
        place = path_place(path, changed) if found else path.end
        self._make("probe", code, path, made, (feed, speed), found, control)
        if strict and not found:
            word = "making" if wanted else "breaking"
            raise StopError(f"{code} move finished without {word} contact.")
        return ProbeResult(found, self._spindle(place))

    def _change(self, edges: list[Edge], *, wanted: bool, delay: float) -> float:
        """Where a probe move sees the state that it waits for."""
        if self.probe_signal.closed == wanted:
            return 0.0
        return next((e.way + delay for e in edges if e.closed == wanted), math.inf)

    def _path(self, end: Vector) -> tuple[Path, list[Edge]]:
        stylus = self.machine.world.stylus
        path = Path(stylus.tip(self.position), stylus.tip(end))
        return path, self.probe_signal.edges(self.machine.world, path)

    def _spindle(self, tip: Vector) -> Vector:
        return (tip[0], tip[1], tip[2] + self.machine.world.stylus.length)

    def _speed(self, feed: float, control: Control) -> float:
        """[mm/s]"""
        machine, modes = self.machine, control.modes
        if feed == 0.0:
            return machine.rapid_feed / 60.0
        speed = feed
        if modes.feed_override:
            speed *= machine.override
        if modes.adaptive_feed:
            speed *= machine.adaptive
        return min(speed, machine.rapid_feed) / 60.0

    def _stopping(self, speed: float) -> float:
        return speed * self.machine.reaction + speed * speed / (2.0 * self.machine.acceleration)

    def _check_limits(self, end: Vector, kind: str, control: Control) -> None:
        limits = self.machine.limits
        if limits is None:
            return
        for axis in range(3):
            for bound, side in ((limits[0][axis], -1.0), (limits[1][axis], 1.0)):
                if side * (end[axis] - bound) > 1e-9:
                    which = "negative" if side < 0.0 else "positive"
                    raise StopError(
                        f"{kind} move on line {control.line} would exceed "
                        f"{'XYZ'[axis]}'s {which} limit"
                    )

    def _make(
        self,
        kind: Literal["rapid", "feed", "probe"],
        code: str,
        path: Path,
        made: float,
        feeds: tuple[float, float],
        touched: bool | None,
        control: Control,
    ) -> None:
        """Go along a path, as far as it is made."""
        if len(self.moves) == self.machine.aborted_at:
            raise StopError("Esc")
        world, signal = self.machine.world, self.probe_signal
        tripped_at_start = signal.closed
        edges = signal.edges(world, path)
        signal.commit(world, path, made)
        start, end = self.position, self._spindle(path.end)
        reached_tip = path.at(made) if made < path.length else path.end
        self.position = self._spindle(reached_tip)
        self.moves.append(
            Move(
                kind=kind,
                code=code,
                start=start,
                planned=end,
                reached=self.position,
                tip_start=path.start,
                tip_planned=path.end,
                tip_reached=reached_tip,
                feed=feeds[0],
                speed=feeds[1],
                override=control.modes.feed_override or control.modes.adaptive_feed,
                tripped_at_start=tripped_at_start,
                tripped_during=any(e.closed and e.way <= made for e in edges),
                tripped_at_end=signal.closed,
                touched=touched,
                depths=world.deepest(path.start, reached_tip),
                depths_at_start=world.deepest(path.start, path.start),
                contacts=signal.contacts,
                line=control.line,
                file=control.file,
            )
        )


def path_place(path: Path, way: float) -> Vector:
    """A place of a path that may be its end."""
    return path.end if way >= path.length else path.at(way)


def run(
    machine: Machine,
    text: str,
    *,
    probe: Probe | None = None,
    subroutines: Mapping[str, str] | FilePath | None = None,
) -> Trace:
    """Run a program to its end, or until it is stopped.

    Parameters
    ----------
    machine : Machine
    text : str
    probe : Probe or None
        A healthy one, unless it is given. A probe is used for one run.
    subroutines : mapping of str to str, or Path
        Texts by file name, or a folder.
    """
    probe = probe or Probe()
    moving = _Moving(machine, probe)
    logs = {name: list(lines) for name, lines in machine.logs.items()}
    outputs = Outputs(folders=machine.folders, logs=logs, full=machine.disk_full)
    control = Control(
        moving,
        modes=machine.modes,
        offsets=machine.offsets,
        tools=machine.tools,
        tool=machine.tool,
        outputs=outputs,
        equal=machine.equal,
    )
    offsets_before = dict(control.offsets)
    handled = machine.calls_on_abort and Files("", subroutines).has(HANDLER)
    if handled:  # The control has called it when the machine came up.
        control.parameters.globals["_pretravel_guard"] = 1.0
    ended: Literal["end", "abort", "error"] = "end"
    error = ""
    try:
        Interpreter(control, text, subroutines).run()
    except StopError as stop:
        ended, error = ("abort" if stop.own else "error"), stop.text
        if handled:
            control.parameters.locals = [{}]
            Interpreter(control, f"%\no<{HANDLER}> call [3]\n%\n", subroutines).run()
    return Trace(
        moves=tuple(moving.moves),
        logs={name: tuple(lines) for name, lines in outputs.logs.items()},
        messages=(*outputs.messages, *([error] if error else [])),
        printed=tuple(outputs.printed),
        ended=ended,
        error=error,
        line=control.line,
        before=machine.modes,
        after=control.modes,
        offsets_before=offsets_before,
        offsets_after=dict(control.offsets),
        tool_before=machine.tool,
        tool=control.tool,
        spindle_starts=tuple(control.spindle_starts),
        contacts=probe.contacts,
        parameters=dict(control.parameters.globals),
    )
