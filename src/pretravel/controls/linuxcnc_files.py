"""Files of LinuxCNC: the parameter file (.var) with work offsets, and the tool table."""

from __future__ import annotations

import re
from dataclasses import dataclass

from pretravel.base import DEGREE, Placement
from pretravel.files import UNITS, WORK_OFFSETS, Source, opened, work_placement

_FIRST, _APART, _TURN = 5221, 20, 9
"""Parameter of the x of G54; distance to the next offset; distance from x to the turn."""
_G92_ON, _G92 = 5210, 5211
"""Parameters of G92: whether it is active, and its x."""
_ACTIVE = 5220
"""Parameter of the number of the active offset."""
_PARAMETER = re.compile(r"[0-9]{1,9}")
_WORD = re.compile(r"([A-Za-z])\s*([-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))")
_LARGEST_TOOL = 99_999
_SHOWN = 20
"""Most tools that a message names."""


def read_work_offset(source: Source, offset: str | None = None, units: str = "mm") -> tuple[
    str, Placement
]:  # fmt: skip
    r"""Read a work offset from a parameter file.

    Parameters
    ----------
    source : str, Path or SourceFile
        The file that PARAMETER_FILE in the INI file states.
    offset : str, optional
        G54 to G59.3; the last active one when not given.
    units : str
        Units of the machine (LINEAR_UNITS): mm or inch.

    Returns
    -------
    str, Placement
        Its name, and the place of the work coordinates in the machine; this includes G92 where
        G92 is active.

    Raises
    ------
    InputError
        A line that is not a number and a value, with its line; an unknown offset.

    >>> from pretravel.files.source_file import SourceFile
    >>> text = b"5220\t1\n5221\t10\n5222\t20\n5223\t-30\n5230\t90\n"
    >>> file = SourceFile("linuxcnc.var", text)
    >>> name, work = read_work_offset(file)
    >>> name, work.shift.tolist()
    ('G54', [10.0, 20.0, -30.0])
    """
    file = opened(source)
    values: dict[int, float] = {}
    for number, line in enumerate(file.lines("a parameter file"), start=1):
        cells = line.split()
        if not cells:
            continue
        if len(cells) != 2 or not _PARAMETER.fullmatch(cells[0]):
            raise file.error(
                f"'{line.strip()[:40]}': the number of a parameter and its value are needed", number
            )
        values[int(cells[0])] = file.numbers(cells[1:], number)[0]
    if offset is None:
        index = int(values.get(_ACTIVE, 1.0)) - 1
        if not 0 <= index < len(WORK_OFFSETS):
            raise file.error(
                f"parameter {_ACTIVE} = {values[_ACTIVE]:g} is not the number of a work offset"
            )
        offset = WORK_OFFSETS[index]
    if offset.upper() not in WORK_OFFSETS:
        raise file.error(
            f"work offset '{offset}': it must be one of {', '.join(WORK_OFFSETS)}",
            inputs=("offset",),
        )
    base = _FIRST + _APART * WORK_OFFSETS.index(offset.upper())
    if any(base + i not in values for i in range(3)):
        raise file.error(f"the file has no parameters {base} to {base + 2} ({offset})")
    scale = UNITS[units]
    x, y, z = (scale * values[base + i] for i in range(3))
    placement = work_placement(x, y, z, values.get(base + _TURN, 0.0) * DEGREE)
    if values.get(_G92_ON, 0.0):
        # G92 is an offset in the turned coordinates.
        more = [scale * values.get(_G92 + i, 0.0) for i in range(3)]
        placement = Placement(placement.rotation, placement.shift + placement.rotation @ more)
    return offset.upper(), placement


@dataclass(frozen=True)
class Tool:
    """One tool of a table: number, length along z and diameter. [mm]"""

    number: int
    length: float
    diameter: float


def read_tool(source: Source, number: int, units: str = "mm") -> Tool:
    r"""Read one tool of a tool table.

    Parameters
    ----------
    source : str, Path or SourceFile
    number : int
    units : str
        Units of the machine: mm or inch.

    Raises
    ------
    InputError
        There is no such tool, or two; a line does not consist of letters with numbers.

    >>> from pretravel.files.source_file import SourceFile
    >>> file = SourceFile("tool.tbl", b"T99 P3 D6.0 Z101.5 ;probe\n")
    >>> read_tool(file, 99)
    Tool(number=99, length=101.5, diameter=6.0)
    """
    file = opened(source)
    scale = UNITS[units]
    known, found = [], None
    for line_number, line in enumerate(file.lines("a tool table"), start=1):
        text = line.partition(";")[0].strip()
        if not text:
            continue
        words = _WORD.findall(text)
        if not words or _WORD.sub("", text).strip():
            raise file.error(
                f"'{text[:40]}' is not a line of a tool table such as T1 P1 D6.0 Z100.0",
                line_number,
            )
        read = file.numbers([value for _, value in words], line_number)
        values = dict(zip((letter.upper() for letter, _ in words), read, strict=True))
        stated = values.get("T", 0.0)
        if not (stated.is_integer() and 0.0 <= stated <= _LARGEST_TOOL):
            raise file.error(
                f"T is {stated:g}; the number of a tool is a whole number up to {_LARGEST_TOOL}",
                line_number,
            )
        known += [int(stated)] if "T" in values else []
        if "T" in values and known[-1] == number:
            if found is not None:
                raise file.error(f"T{number} comes twice: delete one of the lines", line_number)
            found = Tool(number, scale * values.get("Z", 0.0), scale * values.get("D", 0.0))
    if found is not None:
        return found
    names = ", ".join(f"T{n}" for n in known[:_SHOWN]) + (" …" if len(known) > _SHOWN else "")
    raise file.error(
        f"there is no tool {number}; there {'are ' + names if known else 'is none'}",
        inputs=("tool",),
    )
