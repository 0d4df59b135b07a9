"""Console output of RepRapFirmware and Smoothieware: heights of G30; reading.

G30 S-1 of RepRapFirmware reports ``Stopped at height Z mm``, a series of G30 P… its heights in one
line, ``G32 bed probe heights: …``; G30 of Smoothieware ``Z:1.2345 C:1234``, in mm and steps. None
of them states x and y.
"""

from __future__ import annotations

import re

from pretravel.controls.logs.heights_of_log import TERMINAL, TERMINAL_LINES, LoggedHeights
from pretravel.files import FileFormat, FileReadings, ReadingOptions, Source, opened

_STOPPED = re.compile(r"\bStopped at height (-?[\d.]+) mm")
_SMOOTHIE = re.compile(r"(?<![\w:])Z:(-?\d+\.\d{4}) C:-?\d+\s*$")
_HEIGHTS = re.compile(r"\b(?:G32 )?bed probe heights:([^,]*)", re.IGNORECASE)
_BEGINS = re.compile(r"\bStopped at height |\bbed probe heights:", re.IGNORECASE)


def read_reprap_log(source: Source, *, look_only: bool = False) -> FileReadings:
    r"""Read the heights that RepRapFirmware or Smoothieware reports.

    Parameters
    ----------
    source : str, Path or SourceFile
    look_only : bool
        The heights may lack their place; they always do.

    Returns
    -------
    FileReadings
        In mm, with normals along z and x, y zero. Labels: G30/1 …; heights 1/1 … of each line of
        heights.

    Raises
    ------
    InputError
        No heights; a height that was not probed; the place of the heights matters.

    >>> from pretravel.files.source_file import SourceFile
    >>> text = b"G32 bed probe heights: -0.005 0.001 0.002, mean 0.001, deviation from mean 0.004\n"
    >>> found = read_reprap_log(SourceFile("duet.txt", text), look_only=True)
    >>> found.touches.positions[:, 2].tolist()
    [-0.005, 0.001, 0.002]
    """
    file = opened(source)
    found = LoggedHeights(file, statements=TERMINAL_LINES)
    for number, line in enumerate(file.lines("console output of RepRapFirmware"), start=1):
        if stopped := _STOPPED.search(line) or _SMOOTHIE.search(line):
            found.take("G30", stopped.groups(), number)
        elif heights := _HEIGHTS.search(line):
            name = found.new_series("heights")
            for cell in heights[1].split():
                found.take(name, (cell,), number)
        elif _BEGINS.search(line):
            raise file.error("the line is cut off: Stopped at height Z mm is needed", number)
        else:
            found.read_statement(line, number)
    return found.readings("the file contains no height of G30", look_only=look_only)


def _parsed(file: Source, options: ReadingOptions) -> FileReadings:
    return read_reprap_log(file, look_only=options.look_only)


REPRAP = FileFormat(
    name="reprap",
    what="console output of RepRapFirmware, Smoothieware: heights of G30, without x and y",
    own_unit="mm",
    reads="heights, for pretravel repeat",
    needs="nothing that could be given: no x and y",
    verified="one public macro with its output, and the lines of both firmwares that write it",
    recognises=lambda lines: any(_BEGINS.search(li) or _SMOOTHIE.search(li) for li in lines),
    parse=_parsed,
    statements=TERMINAL,
    other_lines="named",
)
