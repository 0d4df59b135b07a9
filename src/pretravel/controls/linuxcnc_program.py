"""G-code for LinuxCNC: a probing program that logs every touch."""

from __future__ import annotations

from dataclasses import dataclass

from pretravel.arrays import FloatArray
from pretravel.controls.gcode import render
from pretravel.controls.program import ProbingProgram
from pretravel.controls.program_log import LOG_HEAD, SURFACE_POINT_COLUMNS, TOUCH_COLUMNS
from pretravel.errors import PretravelError

TRIPPED_AT_START = 0.002
"""A touch nearer to its start than this was no touch: the probe was tripped before. [mm]"""
_LONGEST_LINE = 250
"""Characters of a line; the interpreter accepts 255."""


def linuxcnc_program(program: ProbingProgram, log: str, *, compensated: bool = False) -> str:
    """G-code that makes the touches of a program and logs each of them.

    Parameters
    ----------
    program : ProbingProgram
    log : str
        Name of the log file, relative to the INI file of the machine.
    compensated : bool
        Also log surface points, with the subroutines of `linuxcnc_subroutines`.

    Returns
    -------
    str

    Raises
    ------
    PretravelError
        The log's name contains characters that a G-code comment must not contain; a line is too
        long for the control.

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
            f"log file '{log}': the name may contain letters, digits and -_./ only, because it "
            "stands in a comment of the program",
            inputs=("log",),
        )
    height = program.machine.safe_height
    text = render(
        "linuxcnc/program.ngc",
        program=program,
        machine=program.machine,
        log=log,
        compensated=compensated,
        ways=[_moves(way, height) for way in program.ways],
        leave=_moves(program.leave, height),
        tripped=TRIPPED_AT_START,
        log_head=LOG_HEAD,
        touch_columns=TOUCH_COLUMNS,
        surface_point_columns=SURFACE_POINT_COLUMNS,
    )
    check_line_lengths(text)
    return text


@dataclass(frozen=True, eq=False)
class _Move:
    """One straight move: its end (3,) [mm], and whether it is a rapid one."""

    place: FloatArray
    rapid: bool


def _moves(places: FloatArray, safe_height: float) -> list[_Move]:
    """Straight moves through places; rapid between two places at the safe height."""
    moves, was_high = [], False
    for place in places:
        high = float(place[2]) == safe_height
        moves.append(_Move(place, rapid=high and was_high))
        was_high = high
    return moves


def check_line_lengths(text: str) -> None:
    """Refuse G-code with a line that LinuxCNC's interpreter does not accept.

    Parameters
    ----------
    text : str

    Raises
    ------
    PretravelError
    """
    longest = max(text.splitlines(), key=len)
    if len(longest) > _LONGEST_LINE:
        raise PretravelError(
            f"a line of {len(longest)} characters is too long for the control, which accepts "
            f"{_LONGEST_LINE}; shorten the texts in it: {longest}"
        )
