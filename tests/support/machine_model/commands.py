"""G and M codes of one line, in LinuxCNC's order of execution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from tests.support.machine_model.control import Control
from tests.support.machine_model.coordinates import WORK_OFFSETS, WorkOffset, turned
from tests.support.machine_model.errors import StopError
from tests.support.machine_model.expressions import whole
from tests.support.machine_model.modes import (
    ZERO,
    Modes,
    Vector,
    after_program_end,
    restored,
)

_GROUPS: dict[str, tuple[str, ...]] = {
    "": ("G4", "G10", "G28", "G28.1", "G30", "G30.1", "G52", "G53", "G92", "G92.1", "G92.2",
         "G92.3"),
    "motion": ("G0", "G1", "G80", "G38.2", "G38.3", "G38.4", "G38.5"),
    "plane": ("G17", "G18", "G19"),
    "distance": ("G90", "G91"),
    "arcs": ("G90.1", "G91.1"),
    "feed_mode": ("G93", "G94", "G95"),
    "units": ("G20", "G21"),
    "cutter": ("G40",),
    "tool": ("G43", "G43.1", "G49"),
    "work_offset": WORK_OFFSETS,
    "path": ("G61", "G61.1", "G64"),
    "retract": ("G98", "G99"),
    "spindle": ("G97",),
    "lathe": ("G7", "G8"),  # programs refuse G7; moves in it are not modelled
}  # fmt: skip
_GROUP = {code: group for group, codes in _GROUPS.items() for code in codes}
_M_GROUP = {
    0: "stop", 1: "stop", 2: "stop", 30: "stop",
    3: "spindle", 4: "spindle", 5: "spindle", 19: "spindle",
    6: "tool", 7: "coolant", 8: "coolant", 9: "coolant", 48: "override", 49: "override",
    50: "override", 51: "override", 52: "override", 53: "override", 66: "input", 70: "state",
    71: "state", 72: "state", 73: "state",
}  # fmt: skip
_AXES = "xyz"
_USES_P = ("G4", "G10", "G64")


def _named(code: float) -> str:
    tenths = whole(10.0 * code)
    if not 0 <= tenths < 1000:
        raise StopError("G-code out of range")
    name = f"G{tenths // 10}" + (f".{tenths % 10}" if tenths % 10 else "")
    if name not in _GROUP:
        raise StopError("Unknown g code used")
    return name


class Commands:
    """Executes lines of words. `saved` are the modes that M70 kept at this level."""

    def __init__(self, control: Control) -> None:
        self.control = control
        self.level = 0
        self.saved: Modes | None = None
        self.restore_at_return = False

    def execute(
        self, words: dict[str, float], g_codes: Sequence[float], m_codes: Sequence[float]
    ) -> bool:
        """Execute a line; true where the program ends."""
        codes = self._grouped(g_codes)
        functions = self._functions(m_codes)
        self._check_words(words, codes, functions)
        control = self.control
        if "feed_mode" in codes:
            control.change(feed_mode=codes["feed_mode"])
            if codes["feed_mode"] != "G93":
                # Even where the mode was the same: G94 takes the feed away.
                control.change(feed=0.0)
        if words.get("f", 0.0) < 0.0:
            raise StopError("Negative f word used")
        if "f" in words and control.modes.feed_mode != "G93":
            control.change(feed=words["f"] * control.modes.unit)
        if "s" in words:
            if words["s"] < 0.0:
                raise StopError("Negative spindle speed used")
            control.change(speed=words["s"])
        if "t" in words:
            self._select(whole(words["t"]))
        if "lathe" in codes:
            control.change(lathe=codes["lathe"])
        self._m_codes(functions, words)
        self._g_codes(codes, words)
        return self._stop(functions)

    def _grouped(self, g_codes: Sequence[float]) -> dict[str, str]:
        codes: dict[str, str] = {}
        for code in g_codes:
            name = _named(code)
            group = _GROUP[name]
            if group in codes:
                raise StopError("Two g codes used from same modal group")
            codes[group] = name
        return codes

    def _functions(self, m_codes: Sequence[float]) -> dict[str, int]:
        found: dict[str, int] = {}
        for code in m_codes:
            number = whole(code)
            if number not in _M_GROUP:
                raise StopError(f"Unknown m code used: M{number}")
            if _M_GROUP[number] in found:
                raise StopError("Two m codes used from same modal group")
            found[_M_GROUP[number]] = number
        return found

    def _check_words(
        self, words: dict[str, float], codes: dict[str, str], functions: dict[str, int]
    ) -> None:
        """Words that nothing on the line uses are errors."""
        user = codes.get("", "")
        if "p" in words and not (
            user in _USES_P or codes.get("path") == "G64" or functions.get("override", 0) >= 50
            or "input" in functions
        ):  # fmt: skip
            raise StopError("P word with no G code or M code to use it")
        if "l" in words and user != "G10" and "input" not in functions:
            raise StopError("L word with no g code that uses it")
        if "h" in words and codes.get("tool") != "G43":
            raise StopError("H word with no g43")
        if "r" in words and user != "G10" and functions.get("spindle") != 19:
            raise StopError("R word with no g code that uses it")
        for letter in "abcuvw":
            if letter in words:
                raise StopError(f"Bad character '{letter}' used: the machine has no such axis")

    def _select(self, number: int) -> None:
        if number < 0:
            raise StopError("Negative tool id used")
        if number and number not in self.control.tools:
            raise StopError(f"Requested tool {number} not found in the tool table")
        self.control.selected = number

    def _m_codes(self, functions: dict[str, int], words: dict[str, float]) -> None:
        control = self.control
        if "input" in functions:
            control.parameters.numbered[5399] = 0.0
        if functions.get("tool") == 6:
            control.tool = control.selected
            control.change(spindle="M5")
        if "spindle" in functions:
            code = f"M{functions['spindle']}"
            if code == "M19":  # it turns to one place and holds
                return
            if code != "M5":
                control.spindle_starts.append(control.line)
            control.change(spindle=code)
        self._state(functions.get("state", 0))
        coolant = functions.get("coolant", 0)
        if coolant == 9:
            control.change(mist=False, flood=False)
        elif coolant:
            control.change(**{"mist" if coolant == 7 else "flood": True})
        if "override" in functions:
            self._override(functions["override"], words.get("p", 1.0) > 0.0)

    def _state(self, code: int) -> None:
        if code in (70, 73):
            self.saved = self.control.modes
            self.restore_at_return = code == 73 and self.level > 0
        elif code == 71:
            self.saved = None
        elif code == 72:
            self.restore()

    def restore(self) -> None:
        """What M72 does."""
        if self.saved is None:
            raise StopError("Cannot restore context from invalid stack frame - missing M70/M73?")
        control = self.control
        before = control.modes.spindle
        control.modes = restored(control.modes, self.saved, control.tool_length)
        if control.modes.spindle not in ("M5", before):
            control.spindle_starts.append(control.line)

    def _override(self, code: int, on: bool) -> None:
        changes = {
            48: {"feed_override": True, "speed_override": True},
            49: {"feed_override": False, "speed_override": False},
            50: {"feed_override": on},
            51: {"speed_override": on},
            52: {"adaptive_feed": on},
            53: {"feed_hold": on},
        }
        self.control.change(**changes[code])

    def _stop(self, functions: dict[str, int]) -> bool:
        code = functions.get("stop")
        if code in (2, 30):
            self.control.modes = after_program_end(self.control.modes)
            return True
        return False

    def _g_codes(self, codes: dict[str, str], words: dict[str, float]) -> None:
        control = self.control
        if "plane" in codes:
            control.change(plane=codes["plane"])
        if "units" in codes:
            control.change(units=codes["units"])
        if "tool" in codes:
            self._tool_offset(codes["tool"], words)
        if "work_offset" in codes:
            control.change(work_offset=codes["work_offset"])
        if "path" in codes:
            details = "".join(f" {w.upper()}{words[w]:g}" for w in "pq" if w in words)
            control.change(path=codes["path"] + (details if codes["path"] == "G64" else ""))
        if "distance" in codes:
            control.change(distance=codes["distance"])
        other = codes.get("", "")
        axes_used = codes.get("tool") == "G43.1"
        if other and other != "G53":
            axes_used |= self._other(other, words)
        self._motion(codes.get("motion", ""), words, axes_used, machine=other == "G53")

    def _tool_offset(self, code: str, words: dict[str, float]) -> None:
        control = self.control
        offset = ZERO
        if code == "G43":
            offset = control.tool_length
            if "h" in words:
                number = whole(words["h"])
                if number and number not in control.tools:
                    raise StopError(f"Requested tool {number} not found in the tool table")
                if number:
                    offset = (0.0, 0.0, control.tools[number].length)
        elif code == "G43.1":
            given = control.modes.tool_offset
            unit = control.modes.unit
            x, y, z = (words[a] * unit if a in words else given[i] for i, a in enumerate(_AXES))
            offset = (x, y, z)
        control.change(tool_offset=offset)

    def _other(self, code: str, words: dict[str, float]) -> bool:
        """Codes that are not modal; true where they use the axis words."""
        control = self.control
        if code == "G4":
            if "p" not in words:
                raise StopError("Dwell time missing with g4")
            return False
        if code == "G10":
            self._set_offset(words)
            return True
        if code in ("G28.1", "G30.1"):
            control.homes[code[:-2]] = control.motion.position
            return False
        if code in ("G28", "G30"):
            self._home(code, words)
            return True
        if code in ("G92", "G52"):
            self._shift(code, words)
            return True
        control.change(shift=ZERO)
        return False

    def _set_offset(self, words: dict[str, float]) -> None:
        control = self.control
        kind = whole(words.get("l", -1.0))
        if kind not in (2, 20):
            raise StopError(f"the model does not know G10 L{kind}")
        if "p" not in words:
            raise StopError("P word missing with G10")
        number = whole(words["p"])
        if not 0 <= number <= 9:
            raise StopError("P value out of range with G10 L2")
        name = WORK_OFFSETS[number - 1] if number else control.modes.work_offset
        old, unit = control.offsets[name], control.modes.unit
        given = {i: words[a] * unit for i, a in enumerate(_AXES) if a in words}
        if kind == 2:
            x, y, z = (given.get(i, old.origin[i]) for i in range(3))
            control.set_offset(name, WorkOffset((x, y, z), words.get("r", old.turn_deg)))
            return
        if "r" in words:
            raise StopError("R not allowed in G10 L20")
        here = replace(control.frame, offset=old).to_work(control.motion.position)
        change = turned(
            tuple(here[i] - given.get(i, here[i]) for i in range(3)),  # type: ignore[arg-type]
            old.turn_deg,
        )
        x, y, z = (o + c for o, c in zip(old.origin, change, strict=True))
        control.set_offset(name, WorkOffset((x, y, z), old.turn_deg))

    def _home(self, code: str, words: dict[str, float]) -> None:
        control = self.control
        named = [i for i, a in enumerate(_AXES) if a in words]
        if named:
            control.motion.straight(self._end(words), 0.0, control)
        home, here = control.homes[code], control.motion.position
        x, y, z = (home[i] if i in named or not named else here[i] for i in range(3))
        control.motion.straight((x, y, z), 0.0, control)

    def _shift(self, code: str, words: dict[str, float]) -> None:
        control = self.control
        unit, place, old = control.modes.unit, control.place, control.modes.shift
        if not any(a in words for a in _AXES):
            raise StopError("All axes missing with g52 or g92")
        shift = list(old)
        for i, a in enumerate(_AXES):
            if a in words:
                given = words[a] * unit
                shift[i] = given if code == "G52" else place[i] + old[i] - given
        control.change(shift=tuple(shift))

    def _end(self, words: dict[str, float], *, machine: bool = False) -> Vector:
        """The end of a move in machine coordinates. [mm]"""
        control = self.control
        unit = control.modes.unit
        if machine:
            if control.modes.distance == "G91":
                raise StopError("Cannot use g53 incremental")
            here = control.motion.position
            x, y, z = (words[a] * unit if a in words else here[i] for i, a in enumerate(_AXES))
            return (x, y, z)
        place = control.place
        add = control.modes.distance == "G91"
        x, y, z = (
            place[i] if a not in words else words[a] * unit + (place[i] if add else 0.0)
            for i, a in enumerate(_AXES)
        )
        return control.frame.to_machine((x, y, z))

    def _motion(
        self, code: str, words: dict[str, float], axes_used: bool, *, machine: bool
    ) -> None:
        control = self.control
        axes = not axes_used and any(a in words for a in _AXES)
        if code == "G80":
            if axes:
                raise StopError("Cannot use axis values with g80")
            control.change(motion="G80")
            return
        if code.startswith("G38") and axes_used:
            raise StopError("Cannot use two g codes that both use axis values")
        if not axes:
            if code.startswith("G38"):
                raise StopError("All axes missing with motion code")
            if code:
                control.change(motion=code)
            return
        code = code or control.modes.motion
        if code == "G80":
            raise StopError("Cannot use axis values without a g code that uses them")
        if machine and code not in ("G0", "G1"):
            raise StopError("Must use g0 or g1 with g53")
        end = self._end(words, machine=machine)
        if code == "G0":
            control.motion.straight(end, 0.0, control)
        elif code == "G1":
            control.motion.straight(end, self._feed(end, words), control)
        else:
            self._probe(code, end, words)
        control.change(motion=code)

    def _feed(self, end: Vector, words: dict[str, float]) -> float:
        modes = self.control.modes
        if modes.feed_mode != "G93":
            if modes.feed == 0.0:
                raise StopError("Cannot do g1 with zero feed rate")
            return modes.feed
        if "f" not in words:
            raise StopError("F word missing with inverse time g1 move")
        return words["f"] * math.dist(self.control.motion.position, end)

    def _probe(self, code: str, end: Vector, words: dict[str, float]) -> None:
        control = self.control
        if control.modes.feed == 0.0:
            raise StopError("Cannot probe with zero feed rate")
        if control.modes.feed_mode == "G95":
            raise StopError("Cannot probe with feed per rev mode")
        here = control.motion.position
        if code in ("G38.2", "G38.4") and math.dist(here, end) < 1e-12:
            raise StopError("Start point too close to probe point")
        frame = control.frame
        result = control.motion.probe(end, self._feed(end, words), code, control)
        unit = control.modes.unit
        row = [value / unit for value in frame.to_work(result.place)] + [0.0] * 6
        numbered = control.parameters.numbered
        numbered.update(enumerate(row, start=5061))
        numbered[5070] = float(result.touched)
        control.outputs.probe_result(" ".join(f"{value:.6f}" for value in row))
