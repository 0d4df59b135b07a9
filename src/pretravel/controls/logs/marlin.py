"""Console output of Marlin: touches of M48 V4 and of G30, G29 (``Bed X: Y: Z:``); reading."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from pretravel.controls.logs.heights_of_log import TERMINAL, TERMINAL_LINES, LoggedHeights
from pretravel.files import FileFormat, FileReadings, ReadingOptions, Source, opened

_NUMBER = r"(-?\d[\d.]*|-?\.\d+)(?![\d._])"
_PLACED = re.compile(rf"\bBed X: ?{_NUMBER} ?Y: ?{_NUMBER} ?Z: ?{_NUMBER}", re.IGNORECASE)
_PLACED_BEGINS = re.compile(r"\bBed X: ?-?[\d.]", re.IGNORECASE)
_TEST_BEGINS = re.compile(r"\bM48 Z-Probe Repeatability Test", re.IGNORECASE)
_TEST = re.compile(rf"\b(\d+) of (\d+): \W*z: ?{_NUMBER}", re.IGNORECASE)
_TEST_NOT_WHOLE = re.compile(r"\b\d+ of \d+: \W*z: ?-?[\d.]", re.IGNORECASE)
_TEST_ENDS = re.compile(r"\bStandard Deviation:", re.IGNORECASE)


def read_marlin_log(source: Source, *, look_only: bool = False) -> FileReadings:
    r"""Read the touches of Marlin's console output.

    Parameters
    ----------
    source : str, Path or SourceFile
    look_only : bool
        Heights of M48 may lack their place.

    Returns
    -------
    FileReadings
        In mm, with normals along z. Labels: M48 1/1 … of each M48, bed/1 … of the others. The
        height that M48 V4 reports before it counts is the first touch of its series; a touch
        that is reported twice is read once.

    Raises
    ------
    InputError
        No touches: M48 without V4 reports their mean and standard deviation alone. A line that is
        cut off. The message contains the line.

    >>> from pretravel.files.source_file import SourceFile
    >>> text = (b"M48 Z-Probe Repeatability Test\nBed X: 68.000 Y: 100.000 Z: -0.042\n"
    ...     b"1 of 2: z: -0.036 mean: -0.0363 sigma: 0.0\n2 of 2: z: -0.037 mean: -0.0366\n")
    >>> found = read_marlin_log(SourceFile("marlin.log", text)).touches
    >>> found.positions[:, 2].tolist(), found.labels[0]
    ([-0.042, -0.036, -0.037], 'M48 1/1')
    """
    file = opened(source)
    found = LoggedHeights(file, statements=TERMINAL_LINES)
    name, testing = "bed", False
    place: tuple[str, ...] = ()
    lines = file.lines("console output of Marlin")
    twice = _reported_twice(lines)
    for number, line in enumerate(lines, start=1):
        if _TEST_BEGINS.search(line):
            name, place, testing = found.new_series("M48"), (), True
        elif _TEST_ENDS.search(line):
            name, testing = "bed", False
        elif touch := _PLACED.search(line):
            place = touch.groups()[:2]
            if number not in twice:
                found.take(name, touch.groups(), number)
        elif _PLACED_BEGINS.search(line):
            raise file.error("the line is cut off: Bed X: … Y: … Z: … is needed", number)
        elif touch := _TEST.search(line):
            if not testing:
                name, place, testing = found.new_series("M48"), (), True
            found.take(name, (*place, touch[3]), number)
        elif _TEST_NOT_WHOLE.search(line):
            raise file.error("the height is not a number: 1 of 10: z: Z is needed", number)
        else:
            found.read_statement(line, number)
    return found.readings(
        "the file contains no touch: M48 reports each one with V4 (M48 P20 V4), without it their "
        "mean and standard deviation alone",
        look_only=look_only,
    )


def _reported_twice(lines: Sequence[str]) -> set[int]:
    """Lines of touches in M48 whose height is repeated in the next line, with a count.

    M48 touches once before it counts. By chance this height can equal that of the first counted
    touch: if no other height is repeated, they are two touches.
    """
    found: set[int] = set()
    series: list[int] = []
    bed: tuple[int, float] | None = None
    for number, line in enumerate(lines, start=1):
        if _TEST_BEGINS.search(line) or _TEST_ENDS.search(line):
            series, bed = [], None
        elif touch := _PLACED.search(line):
            bed = (number, _height(touch[3]))
        elif touch := _TEST.search(line):
            if bed is not None and bed[1] == _height(touch[3]):
                series.append(bed[0])
                found |= {*series} if len(series) > 1 else set()
            bed = None
    return found


def _height(text: str) -> float:
    """A height; not a number where the reader refuses it."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def _parsed(file: Source, options: ReadingOptions) -> FileReadings:
    return read_marlin_log(file, look_only=options.look_only)


def _is_marlin(lines: list[str]) -> bool:
    words = (_PLACED_BEGINS, _TEST_BEGINS, _TEST)
    return any(word.search(line) for line in lines for word in words)


MARLIN = FileFormat(
    name="marlin",
    what="console output of Marlin: M48 V4, and Bed X: Y: Z: of G30 and G29",
    own_unit="mm",
    reads="touches",
    verified="the syntax of lines in five public threads",
    self_contained=True,
    recognises=_is_marlin,
    parse=_parsed,
    statements=TERMINAL,
    other_lines="named",
)
