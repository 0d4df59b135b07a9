"""G-code for LinuxCNC: a probing program that logs every touch."""

from __future__ import annotations

from dataclasses import dataclass

from pretravel.base import DEGREE, FloatArray, PretravelError
from pretravel.controls.gcode import render
from pretravel.controls.linuxcnc_state import HANDLER, check_line_lengths
from pretravel.controls.map_identity import check_map_of_program, map_identity
from pretravel.controls.program import ProbingProgram
from pretravel.controls.program_log import (
    FAULTS,
    LOG_ENDING,
    LOG_HEAD,
    SURFACE_POINT_COLUMNS,
    TOUCH_COLUMNS,
)
from pretravel.files import Machine, work_turn
from pretravel.maps import PretravelMap

_ANY_FAULT = "#<_pretravel_fault> NE 0"
_MISSES_ALLOWED = "#<_pretravel_fault> GT 1 OR [#<_pretravel_fault> EQ 1 AND #<misses> GE 1]"
_LOG_SIGNS = frozenset("abcdefghijklmnopqrstuvwxyz0123456789_-")
"""The interpreter makes names of subroutines small."""


def linuxcnc_program(
    program: ProbingProgram,
    log: str,
    *,
    compensated: PretravelMap | None = None,
    allow_misses: bool = False,
    spindle: float | None = None,
    by_hand: bool = False,
    written: str = "",
) -> str:
    """Write the G-code that makes the touches of a program and logs each of them.

    All moves stop at a contact. The program stops with a message, which
    contains the label of the touch, where a touch makes no contact, where the contact comes too
    early or too late by more than the clearance, and where the probe does not open again.

    Parameters
    ----------
    program : ProbingProgram
    log : str
        Name of the log file, which the control writes next to the INI file of the machine.
    compensated : PretravelMap, optional
        Also log surface points, with the subroutines of `linuxcnc_subroutines` of this map.
    allow_misses : bool
        Go on after a touch without contact; not after the first touch, and not after two in a row.
    spindle : float, optional
        Orientation of the spindle during the touches, which the log states, for
        `pretravel.laboratory.reversal`. [rad]
    by_hand : bool
        The program waits until somebody has turned the spindle, instead of M19.
    written : str
        The day, for head and log.

    Returns
    -------
    str

    Raises
    ------
    PretravelError
        The control cannot read back a log of this name; a line is too long for the control; the map
        belongs to another tip or another feed.

    >>> from pretravel.files.machine import Machine
    >>> from pretravel.controls.program import plan_program
    >>> from pretravel.touches.targets import Targets
    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], labels=("top",))
    >>> text = linuxcnc_program(plan_program(up, Machine(), title="one"), "one_log.ngc")
    >>> [line for line in text.splitlines() if "o<pretravel_touch> call" in line]
    ['o<pretravel_touch> call [0] [0] [5] [0] [0] [1] [50] [1000] [2] [1]']
    """
    _check_log(log)
    identity = None
    if compensated is not None:
        angle = None if spindle is None else spindle / DEGREE
        check_map_of_program(compensated, program.machine.tip_radius, program.feeds, angle)
        identity = map_identity(compensated)
    machine, turns = program.machine, program.turns
    text = render(
        "linuxcnc/program.ngc",
        program=program,
        machine=machine,
        work_turn_deg=0.0 if machine.work is None else work_turn(machine.work) / DEGREE,
        log=log,
        log_sub=log.removesuffix(".ngc"),
        identity=identity,
        allow_misses=allow_misses,
        spindle_deg=None if spindle is None else spindle / DEGREE % 360.0,
        by_hand=by_hand,
        held=spindle is not None and not by_hand,
        written=written,
        handler=HANDLER,
        stop_condition=_MISSES_ALLOWED if allow_misses else _ANY_FAULT,
        ways=[_moves(way, machine) for way in program.ways],
        leave=_moves(program.leave, machine),
        turns=turns,
        turn_ways={}
        if turns is None
        else {row: _moves(way, machine) for row, (_, way) in turns.before.items()},
        degree=DEGREE,
        causes=FAULTS,
        log_head=LOG_HEAD,
        touch_columns=TOUCH_COLUMNS,
        surface_point_columns=SURFACE_POINT_COLUMNS,
    )
    check_line_lengths(text)
    return text


def _check_log(log: str) -> None:
    stem = log.removesuffix(LOG_ENDING)
    if stem == log or not all(c in _LOG_SIGNS for c in stem):
        raise PretravelError(
            f"log file '{log}': give a name of small letters, digits, - and _ that ends with "
            f"{LOG_ENDING}, without a folder (the log is written next to the INI file). The "
            "control does not report that it cannot write a log. The program therefore reads the "
            "log back, which only works with such a name, and stops if touches are missing",
            inputs=("log",),
        )


@dataclass(frozen=True, eq=False)
class _Move:
    """One straight move: its end (3,) [mm], and its feed. [mm/min]"""

    place: FloatArray
    feed: float


def _moves(places: FloatArray, machine: Machine) -> list[_Move]:
    """Straight moves through places; faster between two places at the safe height."""
    moves, was_high = [], False
    for place in places:
        high = float(place[2]) == machine.safe_height
        feed = machine.travel_feed if high and was_high else machine.positioning_feed
        moves.append(_Move(place, feed))
        was_high = high
    return moves
