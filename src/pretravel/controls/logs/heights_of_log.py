"""Heights that a firmware logs while it touches along z: collected line by line."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pretravel.files import (
    FileReadings,
    RowStatement,
    RowStatements,
    SourceFile,
    StatedRows,
    filled_in,
    first_few,
)
from pretravel.touches import Touches, word_fields


@dataclass
class LoggedHeights:
    """Touches of a log so far; each belongs to a series, such as one order to touch ten times.

    Attributes
    ----------
    file : SourceFile
    positions : list of x, y, z
        [mm]
    labels : list of str
        Series, a slash, and the number in it from 1.
    lines : list of int
    unplaced : int or None
        The first line of a height without x and y, which are zero then.
    failed : list of int
        Lines in which the firmware says that a touch failed.
    """

    file: SourceFile
    positions: list[list[float]] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    unplaced: int | None = None
    statements: RowStatements | None = None
    stated: StatedRows = field(init=False)
    failed: list[int] = field(default_factory=list)
    _series: Counter[str] = field(default_factory=Counter)
    _touches: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self.stated = StatedRows(self.file)

    def read_statement(self, line: str, number: int) -> None:
        """Read a line without a height: a tool, a change of the coordinates …."""
        if _FAILED.search(line):
            self.failed.append(number)
        elif self.statements is not None:
            sent = sent_line(line)
            self.stated.take(self.statements.of(sent), line, number, sent)

    def new_series(self, kind: str) -> str:
        """Name of another series of a kind: accuracy 1, accuracy 2 …."""
        self._series[kind] += 1
        return f"{kind} {self._series[kind]}"

    def take(self, series: str, cells: Sequence[str], line: int) -> None:
        """Take a touch: x, y and z, or z alone."""
        values = self.file.numbers(cells, line)
        self.stated.row(line)
        if len(values) == 1:
            values = [0.0, 0.0, *values]
            self.unplaced = self.unplaced or line
        self._touches[series] += 1
        self.positions.append(values)
        self.labels.append(f"{series}/{self._touches[series]}")
        self.lines.append(line)

    def readings(self, nothing: str, *, look_only: bool = True) -> FileReadings:
        """The touches, with normals along z.

        Parameters
        ----------
        nothing : str
            The message where there are none.
        look_only : bool
            Whether the place of the touches does not matter.

        Raises
        ------
        InputError
            No touches; heights without a place where it matters.
        """
        if not self.positions:
            raise self.file.error(nothing)
        if self.unplaced is not None and not look_only:
            raise self.file.error(
                "the log states a height without x and y, so that no point can be made of it. "
                "pretravel repeat evaluates how such touches repeat",
                self.unplaced,
            )
        with self.file.named_in_errors(self.lines):
            touches = Touches(
                np.array(self.positions),
                np.tile([0.0, 0.0, 1.0], (len(self.positions), 1)),
                labels=tuple(self.labels),
                source=self.file.name,
                lines=tuple(self.lines),
                **word_fields(self.stated.columns()),
            )
        missed = filled_in(touches.positions[:, 2])
        if missed.all():
            raise self.file.error("no touch of the log made contact", self.lines[0])
        return FileReadings(
            touches.take(~missed),
            missed=tuple(np.array(self.labels)[missed].tolist()),
            warnings=(*self.stated.warnings(), *_failed_touches(self.failed)),
        )


def _failed_touches(lines: Sequence[int]) -> tuple[str, ...]:
    """A sentence about touches that failed, of which a firmware reports no height."""
    if not lines:
        return ()
    count = "1 touch" if len(lines) == 1 else f"{len(lines)} touches"
    shown = first_few(lines)
    return (f"{count} failed, as the firmware says (line {shown}): no height is read of them",)


def sent_line(line: str) -> str:
    """A line of a terminal without what it writes before it: a time, Recv: , // , >>> .

    >>> sent_line("10:14:03.21: Recv: // probe at 97,2 is z=1.3"), sent_line(">>> T1")
    ('probe at 97,2 is z=1.3', 'T1')
    """
    return _BEFORE.sub("", line.strip(), count=1)


_FAILED = re.compile(
    r"\bno trigger on\b|\bnot triggered\b|\bprobing failed\b|\bfailed to (?:trigger|probe)\b|"
    r"\balready triggered\b|\btriggered (?:prior to|before)\b|\bBLTouch (?:error|failed)|"
    r"\bprobe fail(?:ed|ure)\b",
    re.IGNORECASE,
)
_BEFORE = re.compile(
    r"(?:[\[(]?\d{1,4}[-.:/]\d[-\d.:/, T]*(?:[AP]M)?[\])]?\s*:?\s*)?"
    r"(?:(?:Send|Sent|Recv|Rcvd|READ|SENT|RECV|INFO|DEBUG|echo|TX|RX)\s*:\s*|[>$<]+\s*)?"
    r"(?://\s*|echo:\s*|!!\s*)?",
    re.IGNORECASE,
)
_TOOL = RowStatement(
    "tool: `T0`, `T1` …",
    r"(?:M0?6\s*)?T(\d+)\s*(?:M0?6)?\s*$|(?:ACTIVATE_EXTRUDER|SELECT_TOOL)\b.*?=\s*(\w+)|"
    r"(?:G30|G31|M558)\b.*?\b(K\d+)",
    "tip", "carried", "T1",
)  # fmt: skip
_SHIFTED = RowStatement(
    "`G92`, `M92`, `M206`, `M428`, `M851`, `SET_GCODE_OFFSET`, `SET_KINEMATIC_POSITION`, `M290`, "
    "`G31`",
    r"((?:G92(?:\.\d)?|G33|M92|M206|M290|M428|M66[56]|M851|SET_GCODE_OFFSET|"
    r"SET_KINEMATIC_POSITION|BABYSTEP\w*)\b.*|G31\b.*?\b[PZ]\s*[-\d].*)",
    "frame", "refused", "G92 Z0",
)  # fmt: skip
_HOMED = RowStatement(
    "homing: `G28`, `Z_TILT_ADJUST` …; restart",
    r"((?:(?:G28|G34|Z_TILT_ADJUST|QUAD_GANTRY_LEVEL|BEACON_CALIBRATE|SAVE_CONFIG|M999|"
    r"(?:FIRMWARE_)?RESTART)\b|Marlin [\d.]|Klipper state:|start\s*$).*)",
    "part", "carried", "G28 Z", event=True,
)  # fmt: skip
_FEED = RowStatement(
    "speed of the probe in a command",
    r"(?:PROBE|PROBE_ACCURACY|G30|G29|G38\.\d|M48|M558)\b.*?\b((?:PROBE_)?SPEED\s*=\s*[\d.]+|F\s*[\d.]+)",
    "pass",
    "carried",
    "PROBE_ACCURACY PROBE_SPEED=10",
)
_CONSOLE = RowStatement(
    "`ok`, temperatures, `echo:`, commands and settings of the firmware",
    r"\W*$|(?:ok|wait|busy|start|T:|B:|X:|Y:|Z:|E:|Count|Mean|Min|Max|Range|Standard|Sample|"
    r"Position|Finished|Done|Bed|Bilinear|probe|PROBE\w*|BED\w*|M48|mesh|Generating|Klipper|Marlin|"
    r"RepRap\w*|FIRMWARE\w*|Connect\w*|Change\w*|State\w*|Error|Warning|Info|Auto|Levell?ing|"
    r"Deploy\w*|Stow\w*|Home\w*|Homing|Endstop\w*|triggered|open|Restart\w*|Heat\w*|Fan|"
    r"[A-Z]\d+(?:\.\d+)?\b|[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+|PROBE|ACCURACY|QUERY\w*|GET\w*|STATUS|"
    r"Heightmap|G32|height|;|#|\*|-)",
    example="ok T:200.0 /200.0",
)
TERMINAL = (_TOOL, _SHIFTED, _HOMED, _FEED, _CONSOLE)
"""Statements in the console output of a printer's firmware."""
TERMINAL_LINES = RowStatements(TERMINAL)
