"""Logs of g2core and TinyG: reports ``{"prb":{"e":1,"x":…,"y":…,"z":…}}``; reading."""

from __future__ import annotations

import re

import numpy as np

from pretravel.controls.logs.logged_feeds import SPINDLE, LoggedFeeds
from pretravel.files import (
    FileFormat,
    FilePositions,
    ReadingOptions,
    RowStatement,
    RowStatements,
    Source,
    SourceFile,
    StatedRows,
    opened,
)

_BEGINS = re.compile(r'"?\bprb"?\s*:\s*\{\s*"?e"?\s*:')
_REPORT = re.compile(r'"?\bprb"?\s*:\s*\{([^{}]*)\}')
_QUERY = re.compile(r'\{\s*"?prb"?\s*:\s*(?:n|null|"")\s*\}')
_OTHER_AXES = "abcuvw"
_MOVED = 2e-3
"""Other axes that differ by more than this have moved. [deg or mm, reports have three digits]"""


_TABLE = (
    RowStatement(
        "tool: `T` number, `tool`",
        r"(?:M0?6\s*)?T(\d+)\s*(?:M0?6)?\s*$|.*?\btool\W{1,4}(\d+)",
        "tip", "carried", '{"sr":{"tool":2}}',
    ),
    RowStatement(
        "work offset: `G54` …, `coor`, `g55` …, `G92`, `G43`; homing, restart, steps of the axes",
        r".*?(\bcoor\W{1,4}\d+|\bg(?:5[4-9]|92|43|49|28\.[1-4])[xyz]?(?!\w).*|G10\s*L20?\b.*|"
        r"\btof\W.*|SYSTEM READY|\b[1-6](?:tr|sa|mi|po|su)\W{1,4}\d.*)",
        "frame", "refused", '{"sr":{"coor":2}}',
    ),
    SPINDLE,
    RowStatement(
        "status, answers, moves, `ok`",
        r"\W*[{\[]|\W*$|(?:ok|system|tinyg|g2core)\b|[$?!~%;(*]|(?:N\d+\s*)?[GMFSXYZABC]\s*[-+.\d]",
        example='{"sr":{"vel":0.00}}',
    ),
)  # fmt: skip
_STATEMENTS = RowStatements(_TABLE)


def read_g2core_log(
    source: Source,
    units: str | None = None,
    offset: tuple[float, float, float] | None = None,
) -> FilePositions:
    r"""Read probe reports from the log of a sender, in work coordinates.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str, optional
        mm alone: the control reports millimetres, also where the program is in inches.
    offset : (3,) float
        Origin of the work coordinates in the machine's, in which the reports are. [mm]

    Returns
    -------
    FilePositions
        Each report states whether it is a contact (e is 1) or a miss (0). The answer to a query
        ``{"prb":n}`` repeats the last report and is left out. With the feeds, where the log
        contains the probing moves (G38.2 … F…) of all reports.

    Raises
    ------
    InputError
        The offset is missing, inches are given, a report is cut off or lacks an axis, another axis
        has moved. The message contains the line.

    >>> text = b'{"r":{"prb":{"e":1,"x":1.000,"y":2.000,"z":-8.804}},"f":[1,0,9]}\n'
    >>> read_g2core_log(SourceFile("g2.log", text), offset=(0, 0, -10)).positions.round(6).tolist()
    [[1.0, 2.0, 1.196]]
    """
    file = opened(source)
    lines = file.lines("a log of g2core or TinyG")
    if units == "inch":
        raise file.error(
            "g2core and TinyG report probe positions in mm, whatever the units of the program",
            inputs=("units",),
        )
    if offset is None:
        raise file.error(
            "the reports of g2core and TinyG are in machine coordinates; give the offset x,y,z of "
            "the work coordinates in the machine's, in mm",
            inputs=("offset",),
        )
    reports, numbers, moves = [], [], LoggedFeeds()
    stated = StatedRows(file, of_centres=True)
    answered = False
    for number, line in enumerate(lines, start=1):
        text = line.replace('\\"', '"')  # some senders quote what they log
        moves.take(re.sub(r'[{}":]', " ", text), number)
        found = _reports(file, text, number)
        if not found:
            stated.take(_STATEMENTS.of(text.strip()), text, number)
        if not answered:
            for _ in found:
                stated.row(number)
            reports += found
            numbers += [number] * len(found)
        answered = bool(_QUERY.search(text)) or (answered and not found)
    if not reports:
        raise file.error('the file contains no report {"prb":{"e":…,"x":…,"y":…,"z":…}}')
    _check_other_axes(file, reports, numbers)
    positions = np.array([[report[axis] for axis in "xyz"] for report in reports])
    contact = tuple(report["e"] == 1.0 for report in reports)
    feeds = moves.of(numbers, 1.0)
    read = FilePositions(
        file.path,
        positions - np.asarray(offset),
        tuple(numbers),
        contact,
        feeds=feeds,
        words=stated.columns(),
        warnings=stated.warnings(),
    )
    return moves.applied(read)


def _reports(file: SourceFile, text: str, number: int) -> list[dict[str, float]]:
    """Return the reports of a line, as values by their keys."""
    bodies = [body for body in _REPORT.findall(text) if re.search(r'"?\be"?\s*:', body)]
    if len(_BEGINS.findall(text)) != len(bodies):
        raise file.error(
            'this report is cut off; {"prb":{"e":1,"x":…,"y":…,"z":…}} is needed', number
        )
    return [_report(file, body, number) for body in bodies]


def _report(file: SourceFile, body: str, number: int) -> dict[str, float]:
    pairs = [cell.partition(":") for cell in body.split(",")]
    values = file.numbers([value.strip() for _, _, value in pairs], number)
    keys = [key.strip().strip('"') for key, _, _ in pairs]
    report = dict(zip(keys, values, strict=True))
    missing = [axis for axis in "xyz" if axis not in report]
    if missing:
        raise file.error(f"the report has no {', '.join(missing)}", number)
    if report.get("e") not in (0.0, 1.0):
        raise file.error(
            "the report's e must be 1 (contact) or 0 (no contact): this probing has not ended",
            number,
        )
    return report


def _check_other_axes(
    file: SourceFile, reports: list[dict[str, float]], numbers: list[int]
) -> None:
    for report, number in zip(reports, numbers, strict=True):
        for axis in _OTHER_AXES:
            if abs(report.get(axis, 0.0) - reports[0].get(axis, 0.0)) > _MOVED:
                raise file.error(f"the axis {axis} has moved since the first report", number)


def _offset(options: ReadingOptions) -> tuple[float, float, float] | None:
    """The offset; none is needed where it does not matter where the touches lie."""
    unneeded = options.offset is None and options.moves_as_a_whole
    return (0.0, 0.0, 0.0) if unneeded else options.offset


G2CORE = FileFormat(
    name="g2core",
    what='log of a sender for g2core, TinyG: {"prb":{"e":1,…}}',
    reads="positions",
    needs="plan, offset",
    takes=("offset",),
    verified="the syntax of public logs of two senders and of the wiki of g2core",
    recognises=lambda lines: any(_BEGINS.search(line.replace('\\"', '"')) for line in lines),
    parse=lambda file, options: read_g2core_log(file, options.units, _offset(options)),
    statements=_TABLE,
    other_lines="named",
)
