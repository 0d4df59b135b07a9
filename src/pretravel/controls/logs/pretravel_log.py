"""The log of a probing program that pretravel wrote, or of its subroutines."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray
from pretravel.controls.program_log import (
    FAULTS,
    LOG_ENDING,
    LOG_HEAD,
    SUBROUTINE_LINE,
    SUBROUTINE_TOUCH_COLUMNS,
    SURFACE_POINT_COLUMNS,
    TOUCH_COLUMNS,
)
from pretravel.files import FileFormat, FileReadings, Source, SourceFile, opened
from pretravel.touches import Touches

_SCALES = {"um": MICROMETRE, "millionths": 1e-6}
"""Factor to the unit inside, by the ending of a column."""


def read_own_log(source: Source) -> FileReadings:
    r"""Read the log of a program written by pretravel.

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    FileReadings
        The touches with contact, in work coordinates, and the surface points that the control
        compensated.

    Raises
    ------
    InputError
        Lines that are cut off, a second run in the same file, a label that occurs twice, text in
        place of numbers: with the line.

    >>> text = (
    ...     "pretravel-log,1,one,1,end\nwork,G54,0.0,end\ncolumns," + ",".join(TOUCH_COLUMNS)
    ...     + ",end\ntouch,top,0,0,2990.0,0,0,1,0,0,-1,50,0,0,0,1.0,end\ndone,1,end\n")
    >>> read_own_log(SourceFile("one.log", text.encode())).touches.positions.tolist()
    [[0.0, 0.0, 2.99]]
    """
    file = opened(source)
    log = _Log(file)
    for number, text in enumerate(file.lines("a log of a probing program"), start=1):
        line = text.strip()
        # The lines with which LinuxCNC reads the log back as a subroutine.
        if line and not line.startswith(SUBROUTINE_LINE):
            log.take(line, number)
    return log.readings()


class _Log:
    """What the lines of a log have stated so far."""

    def __init__(self, file: SourceFile) -> None:
        self.file = file
        self.planned: int | None = None
        """Touches of the program; None before the first line, 0 where no line states them."""
        self.finished = False
        self.stopped = ""
        """Label and cause, where the program stopped at a touch."""
        self.rotation: float | None = None
        self.spindle: float | None = None
        self.columns: tuple[str, ...] = ()
        self.touched: dict[str, list[float]] = {}
        self.lines: list[int] = []
        self.missed: dict[str, int] = {}
        """Line by label."""
        self.points: dict[str, FloatArray] = {}
        self._takers: dict[str, Callable[[list[str], int], None]] = {
            LOG_HEAD: self._take_head,
            "work": self._take_work,
            "columns": self._take_columns,
            "touch": self._take_touch,
            "point": self._take_point,
            "stopped": self._take_stopped,
            "run": self._take_run,
            "spindle": self._take_spindle,
        }

    def take(self, line: str, number: int) -> None:
        """Add one line to the state."""
        cells = [cell.strip() for cell in line.split(",")]
        if cells[-1] != "end":
            raise self.file.error(
                f"this line is cut off ('…{line[-20:]}' does not end in ',end'): the program was "
                "stopped, or the disk was full. Run the program again, or delete the line to use "
                "the lines before it",
                number,
            )
        kind, values = cells[0], cells[1:-1]
        if self.planned is None and kind != LOG_HEAD:
            raise self.file.error(
                f"not the log of a program of pretravel: its first line must begin with {LOG_HEAD}",
                number,
            )
        if kind in self._takers:
            self._takers[kind](values, number)
        elif kind == "done":
            self.finished = True
        elif kind not in ("point-columns", "correction"):
            raise self.file.error(f"'{kind}' is not a line of such a log", number)

    def _take_head(self, values: list[str], number: int) -> None:
        if self.planned is not None:
            raise self.file.error(
                "a second run begins here; keep each run in a separate file", number
            )
        if values[:1] != ["1"] or len(values) != 3:
            raise self.file.error(
                f"a log of another version ('{','.join([LOG_HEAD, *values])[:40]}'); this "
                "pretravel reads version 1",
                number,
            )
        self.planned = int(self.file.numbers(values[-1:], number)[0])

    def _take_work(self, values: list[str], number: int) -> None:
        if len(values) != 2 or self.rotation is not None:
            raise self.file.error("one line 'work' with offset and turn is needed", number)
        self.rotation = self.file.numbers(values[1:], number)[0] * DEGREE

    def _take_columns(self, values: list[str], number: int) -> None:
        self.columns = tuple(values)
        if self.columns not in (TOUCH_COLUMNS, SUBROUTINE_TOUCH_COLUMNS):
            raise self.file.error(
                f"columns {', '.join(values)} are not those of this version "
                f"({', '.join(TOUCH_COLUMNS)})",
                number,
            )

    def _take_touch(self, values: list[str], number: int) -> None:
        self._check_values(values, TOUCH_COLUMNS, number)
        label = values[0]
        if label in self.touched or label in self.missed:
            raise self.file.error(f"the touch {label} occurs twice", number)
        row = self.file.numbers(values[1:], number)
        if round(row[-1]) == 0:
            self.missed[label] = number
        else:
            self.touched[label] = row
            self.lines.append(number)

    def _take_point(self, values: list[str], number: int) -> None:
        self._check_values(values, SURFACE_POINT_COLUMNS, number)
        self.points[values[0]] = MICROMETRE * np.array(self.file.numbers(values[1:4], number))

    def _take_stopped(self, values: list[str], number: int) -> None:
        if len(values) != 2:
            raise self.file.error("a line 'stopped' has a label and the number of a cause", number)
        cause = int(self.file.numbers(values[1:], number)[0])
        words = FAULTS[cause - 1] if 1 <= cause <= len(FAULTS) else f"cause {cause}"
        self.stopped = f" (stopped at {values[0]}: {words})"

    def _take_run(self, values: list[str], number: int) -> None:
        if len(values) != 2:
            raise self.file.error("a line 'run' has a number and the day of the program", number)
        self.file.numbers(values[:1], number)

    def _take_spindle(self, values: list[str], number: int) -> None:
        if len(values) != 1 or self.touched or self.spindle is not None:
            raise self.file.error(
                "one line 'spindle' with its angle in degrees, before the touches, is needed",
                number,
            )
        self.spindle = self.file.numbers(values, number)[0] * DEGREE

    def _check_values(self, values: list[str], columns: Sequence[str], number: int) -> None:
        if self.rotation is None or not self.columns:
            raise self.file.error(
                "the lines 'work' and 'columns' must come before the first touch: they give the "
                "turn of the work coordinates and the units",
                number,
            )
        if len(values) != len(columns):
            raise self.file.error(f"{len(values)} values, {len(columns)} are needed", number)

    def readings(self) -> FileReadings:
        """All that the log contains."""
        if not self.touched or self.rotation is None:
            missed = f"; {len(self.missed)} were missed" if self.missed else ""
            raise self.file.error(f"the log contains no touch{missed}{self.stopped}")
        scales = [_SCALES.get(name.rpartition("_")[2], 1.0) for name in self.columns[1:]]
        table = np.array(list(self.touched.values())) * np.array(scales)
        with self.file.named_in_errors(self.lines):
            touches = Touches(
                positions=table[:, 0:3],
                normals=table[:, 3:6],
                approaches=table[:, 6:9],
                feeds=table[:, 9],
                labels=tuple(self.touched),
                nominal_points=table[:, 10:13],
                source=self.file.name,
                lines=tuple(self.lines),
                spindle=None if self.spindle is None else np.full(len(table), self.spindle),
            )
        return FileReadings(
            touches,
            tuple(self.missed),
            self.rotation,
            tuple(filter(None, (self._unfinished(),))),
            self.points,
            unfinished=self._unfinished(),
        )

    def _unfinished(self) -> str:
        """Whether touches of the program are missing in its log."""
        there = len(self.touched) + len(self.missed)
        found = f"{there} of its {self.planned} touches are in the log"
        if self.finished and there != self.planned:
            return f"lines have been lost: {found}, though the program ran to its end"
        # A program of the user's own states no number of touches, and no end.
        if self.stopped or (not self.finished and self.planned):
            return f"the program did not run to its end{self.stopped}: {found}"
        return ""


def _is_own_log(lines: list[str]) -> bool:
    first = next((line for line in lines if not line.startswith(SUBROUTINE_LINE)), "")
    return first.startswith(f"{LOG_HEAD},") or any(
        # A log that has lost its first line.
        line.startswith("touch,") and line.endswith(",end")
        for line in lines
    )


PRETRAVEL_LOG = FileFormat(
    name="linuxcnc",
    what="log of a program that pretravel wrote for LinuxCNC",
    own_unit="mm",
    reads="touches",
    writes="the programs",
    verified="LinuxCNC 2.9 (Debian 12), running",
    endings=(LOG_ENDING,),
    recognises=_is_own_log,
    parse=lambda file, _: read_own_log(file),
    self_contained=True,
    other_lines="refused",
)
