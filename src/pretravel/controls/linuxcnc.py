"""G-code of LinuxCNC: a probing program that logs every touch.

Log lines are made for `pretravel.formats.logs.linuxcnc`: comma-separated, each with its kind first
and the word ``end`` last, so that nothing has to be counted and nothing can be cut off unseen.
"""

from __future__ import annotations

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.controls.machine import Machine
from pretravel.controls.program import ProbingProgram
from pretravel.errors import PretravelError

_BASE = (
    "label", "x", "y", "z", "nx", "ny", "nz", "ax", "ay", "az", "feed_mm_min",
    "nominal_x", "nominal_y", "nominal_z", "touched",
)  # fmt: skip


def _with_units(measured: str, direction: str, nominal: str) -> tuple[str, ...]:
    return tuple(
        f"{name}{measured}" if name in ("x", "y", "z")
        else f"{name}{direction}" if name in ("nx", "ny", "nz", "ax", "ay", "az")
        else f"{name}{nominal}" if name.startswith("nominal")
        else name
        for name in _BASE
    )  # fmt: skip


LOG_COLUMNS = _with_units("_um", "", "_mm")
"""Of lines ``touch``: the tip's centre as it was latched, work coordinates. What the control puts
in is in micrometres: it prints parameters below 1e-4 as zero. What the program knows is text."""
POINT_LOG_COLUMNS = _with_units("_um", "_millionths", "_um")
"""Of lines ``touch`` of the subroutine pretravel_point, which has all of it in parameters."""
POINT_COLUMNS = ("label", "x_um", "y_um", "z_um", "pretravel_um", "deviation_um")
"""Of lines ``point``: the surface point, as the control compensated it."""
LOG_HEAD = "pretravel-log"
MEASURED = "#<_touch_x_um>,#<_touch_y_um>,#<_touch_z_um>"
"""What `TO_MICROMETRES` made of the last touch."""
COMPENSATED = ",".join(
    f"#<_pretravel_{name}_um>" for name in ("x", "y", "z", "travel", "deviation")
)
TO_MICROMETRES = """\
#<_touch_x_um> = [#5061*1000]
#<_touch_y_um> = [#5062*1000]
#<_touch_z_um> = [#5063*1000]
"""
"""For programs in mm."""
_LONGEST = 250  # characters of a line: the interpreter takes 255
_TRIPPED = 0.002  # nearer to its start than this a touch was none. [mm]

_TOUCH = f"""\
(one touch: #1 #2 #3 its start, #4 #5 #6 where it counts as missed, #7 and #8 the feeds)
o<pretravel_touch> sub
G1 X#1 Y#2 Z#3 F#8
G38.3 X#4 Y#5 Z#6 F#7
o<pretravel_open> if [#5070 EQ 1 AND ABS[#5061-#1]+ABS[#5062-#2]+ABS[#5063-#3] LT {_TRIPPED}]
(ABORT,the probe was tripped where the touch should start: it has not reseated or touches something)
o<pretravel_open> endif
{TO_MICROMETRES}G1 X#1 Y#2 Z#3 F#8
o<pretravel_touch> endsub
"""


def linuxcnc_program(program: ProbingProgram, log: str, *, compensated: bool = False) -> str:
    """G-code that touches, and logs each touch.

    Parameters
    ----------
    program : ProbingProgram
    log : str
        Name of the log file, relative to the INI file of the machine.
    compensated : bool
        Also log surface points, by the subroutines of `pretravel export --to linuxcnc`.

    Returns
    -------
    str

    Raises
    ------
    PretravelError
        A name or a label that makes a line too long, or cannot stand in a comment.

    >>> from pretravel.controls.machine import Machine
    >>> from pretravel.controls.program import plan_program
    >>> from pretravel.probing.targets import Targets
    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], labels=("top",))
    >>> text = linuxcnc_program(plan_program(up, Machine(), title="one"), "one.log")
    >>> [line for line in text.splitlines() if "call" in line]
    ['o<pretravel_touch> call [0] [0] [5] [0] [0] [1] [50] [1000]']
    """
    if not log or not all(c.isascii() and (c.isalnum() or c in "-_./") for c in log):
        raise PretravelError(
            f"log file '{log}': letters, digits and -_./ can stand in a program's comment"
        )
    machine = program.machine
    minutes = program.duration / 60.0
    lines = [
        f"({comment(program.title)}: {len(program)} touches, about {minutes:.1f} min)",
        f"(for {comment(machine.name)}, written by pretravel for LinuxCNC)",
        f"(log: {log}, beside the machine's INI file; safe height {machine.safe_height:g} mm)",
        *(f"(checked: {comment(text)})" for text in program.checked),
        *(f"(NOT checked: {comment(text)})" for text in program.unchecked),
        _TOUCH,
        "G21 G17 G40 G80 G90 G94 G61",
        "M5 M9",
        *([f"T{machine.tool} M6", "G43"] if machine.tool else []),
        machine.work_offset,
        f"(LOGOPEN,{log})",
        f"(LOG,{LOG_HEAD},1,{comment(program.title).replace(',', ' ')},{len(program)},end)",
        "#<base> = [5210+20*#5220]",
        "#<turn> = #[#<base>]",
        f"(LOG,%.9fwork,{machine.work_offset},#<turn>,end)",
        f"(LOG,columns,{','.join(LOG_COLUMNS)},end)",
        *([f"(LOG,point-columns,{','.join(POINT_COLUMNS)},end)"] if compensated else []),
        f"G0 Z{_number(machine.safe_height)}",
        # At that height to over the first touch.
        "G0 "
        + " ".join(f"{a}{_number(v)}" for a, v in zip("XY", program.ways[0][0], strict=False)),
    ]
    for row, label in enumerate(program.labels):
        lines += _touch(program, row, label, compensated)
    lines += [
        *_moves(program.leave, machine),
        f"(LOG,done,{len(program)},end)",
        "(LOGCLOSE)",
        "M2",
    ]
    longest = max(lines, key=len)
    if len(longest) > _LONGEST and longest != _TOUCH:
        raise PretravelError(f"this line is too long for the control: {longest}")
    return "\n".join(lines) + "\n"


def _touch(program: ProbingProgram, row: int, label: str, compensated: bool) -> list[str]:
    machine = program.machine
    lines = [f"(touch {label})", *_moves(program.ways[row], machine)]
    call = [*program.starts[row], *program.ends[row], program.feeds[row], machine.positioning_feed]
    lines.append("o<pretravel_touch> call " + " ".join(f"[{_number(value)}]" for value in call))
    told = ",".join(
        _number(value)
        for value in (
            *program.normals[row],
            *program.approaches[row],
            program.feeds[row],
            *program.points[row],
        )
    )
    lines.append(f"(LOG,%.4ftouch,{label},{MEASURED},{told},#5070,end)")
    if compensated:
        known = [*program.normals[row], *program.approaches[row], program.feeds[row]]
        lines += [
            f"o<pretravel_touched_{row + 1}> if [#5070 EQ 1]",
            "o<pretravel_compensate> call "
            + " ".join(f"[{_number(value)}]" for value in [*known, *program.points[row]]),
            f"(LOG,%.4fpoint,{label},{COMPENSATED},end)",
            f"o<pretravel_touched_{row + 1}> endif",
        ]
    return lines


def _moves(places: FloatArray, machine: Machine) -> list[str]:
    """Through these places; at the safe height as fast as the machine goes."""
    lines, high = [], False
    for place in places:
        words = " ".join(
            f"{axis}{_number(value)}" for axis, value in zip("XYZ", place, strict=True)
        )
        was_high, high = high, float(place[2]) == machine.safe_height
        quick = was_high and high
        lines.append(f"G0 {words}" if quick else f"G1 {words} F{_number(machine.positioning_feed)}")
    return lines


def _number(value: float) -> str:
    """Nine decimals, without the zeros at the end: a coordinate or a direction."""
    text = f"{float(np.round(value, 9)) + 0.0:.9f}".rstrip("0").rstrip(".")
    return text or "0"


def comment(text: str) -> str:
    """Text that can stand in a comment: plain letters, no brackets, no signs of parameters."""
    plain = text.encode("ascii", "replace").decode()
    return "".join("_" if sign in "()#%;[]{}" else sign for sign in plain)
