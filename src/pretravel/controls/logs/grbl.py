"""Logs of grbl, grblHAL and FluidNC: reports ``[PRB:x,y,z:1]``, as senders log them; reading.

Older versions report ``[PRB:x,y,z]``, ``[Probe:x,y,z]`` or ``<Probe,MPos:x,y,z,WPos:x,y,z>``, which
do not state whether the probe made contact.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from pretravel.base import InputError
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

# Every class leaves out the bracket that begins: a line of beginnings alone is read once.
_PROBE = re.compile(r"\[(?:PRB|Probe):([^\[\]:]*)(?::([^\[\]]*))?\]")
_MESSAGE = re.compile(r"\[MSG:([^\[\]]*)\]", re.IGNORECASE)
_PROBE_BEGINS = re.compile(r"\[(?:PRB|Probe):|<Probe,")
_BOTH_POSITIONS = re.compile(
    r"<(\w+)[,|]MPos:([-\d.,]+)[,|]WPos:([-\d.]+,[-\d.]+,[-\d.]+)(?![-\d.])[^<>]*>"
)
_OFFSET = re.compile(r"\[(G5[4-9](?:\.[123])?|G92|TLO):([^\[\]]*)\]")
_STATUS_LINE = re.compile(r"<\w+[|,][^<>]*>")
_STATUS_OFFSET = re.compile(r"WCO:([-\d.,]+)")
_INCHES = re.compile(r"\$13\s*=\s*([01])")
_STATE = re.compile(r"\[GC:([^\[\]]*)\]")
_TOOL_OF_STATE = re.compile(r"\bT([1-9]\d*)\b")
_WORK_OFFSET = re.compile(r"\bG5[4-9](?:\.[123])?\b")
_TIME = re.compile(
    r"\W*(?:\d{4}[-./]\d\d[-./]\d\d[T ,]*)?\d{1,2}:\d\d(?::\d\d(?:[.,]\d+)?)?(?:\s?[AP]M)?\W*\s",
    re.IGNORECASE,
)
"""What a sender writes before a line."""
_REPORTED = re.compile(r"<[^<>]*>|\[[^\[\]]*\]")
_PARAMETERS = ("[TLO:", "[T:", "[HOME:", "[G92:", "[G51:", "[G30:", "[G28:", "[G59")
"""Parameters after which ``$#`` repeats the last report."""
_HOMING = "homing: `$H`, `G28.1`, `G30.1`"
_LOST = "alarms with which the position is lost: `ALARM:1`, `3`, `6` …"
_HOMED = re.compile(r"(?:INFO:\s*)?hom(?:ed|ing)\b", re.IGNORECASE)
_STARTS = re.compile(r"(?:Grbl|grblHAL|FluidNC)\s+v?\d", re.IGNORECASE)
_TABLE = (
    RowStatement("`[PRB:…]`, `<…>`, `[…]`", r"[<\[]|\W*$", example="[MSG:Pgm End]"),
    RowStatement(
        "tool: `T` number with or without `M6`, `M61 Q`",
        r"(?:M0?6\s*)?T(\d+)\s*(?:M0?6)?\s*$|M61\s*Q(\d+)|G65\s*P5\s*Q(\d+)", "tip",
        "carried", "> T2 M6",
    ),
    RowStatement(
        "work offset: `G54` … `G59`, `G10 L2`, `G10 L20`, `G92`, `G43.1`, `G49`, `G52`, in a line "
        "that was sent",
        r"[^;(]*?(?<![A-Z\d])(G(?:5[4-9]|10\s*L20?|92|43|49|52)(?:\.\d)?(?!\d).*)",
        "frame", "refused", "> G10 L20 P1 Z0",
    ),
    RowStatement(
        "turn and scale: `G68`, `G69`, `G51`, `G50`",
        r"[^;(]*?(?<![A-Z\d])(G(?:68|69|51|50)(?![\d.]).*)", "frame", "refused", "> G68 X0 Y0 R30",
    ),
    SPINDLE,
    RowStatement(
        "rotary axes: `A`, `B`, `C` with a number, in a line that was sent",
        r"[^;(]*?(?<![A-Z\d])([ABC]\s*[-+]?[\d.]+(?:\s*[ABC]\s*[-+]?[\d.]+)*)",
        "orientation", "refused", "> G0 A90",
    ),
    RowStatement(
        _LOST, r"(ALARM:\s*(?:[136-9]|1\d)\b.*)", "frame", "refused", "ALARM:3",
    ),
    RowStatement(
        "`$3=`, `$100=` to `$105=`: senses and steps of the axes", r".*?(\$(?:3|10[0-5])\s*=.*)",
        "frame", "refused", "> $100=80",
    ),
    RowStatement(
        _HOMING, r"(\$H\w?|G28\.[13]|G30\.1)\s*$", "frame", "refused", "> $H",
    ),
    RowStatement("`$13=`", r".*?\$13\s*=\s*([01])", "unit", "refused", "$13=1"),
    RowStatement(
        "results of Carvera's cycles: `Probing …`, `Center …`, `Point 1: …`, `--- … ---`",
        r"(?:Probing|Probed|Calibrating Probe|Distance (?:Point|Betwe+n)|Center (?:of|Point)|"
        r"Corner found|Angle from|Measurement \d|Average|Final Posi|New Probe Tip|This value|"
        r"and will nee|config-set|Point \d+:|Min Z|Max Z|---)",
        example="Point 1: X: 1.000, Y: 2.000, Z: -3.000",
    ),
    RowStatement(
        "`ok`, `error:`, `ALARM:`, `$…`, moves, comments",
        r"(?:ok|error|alarm|Grbl|grblHAL|FluidNC)\b|[$?!~%/;(*]|"
        r"(?:N\d+\s*)?[GMFSXYZABCIJKRPLTHDQ]\s*[-+.\d#\[]",
        example="ok",
    ),
)  # fmt: skip
_STATEMENTS = RowStatements(_TABLE)
_MOVED = 2e-3
"""Other axes that differ by more than this have moved. [deg or mm, reports have two digits]"""
_ROUNDED = 2e-3
"""MPos less WPos differs by less than this when the work coordinates are the same. [log's unit]"""


def read_grbl_log(
    source: Source,
    units: str | None = None,
    offset: tuple[float, float, float] | None = None,
    *,
    anywhere: bool = False,
) -> FilePositions:
    r"""Read probe reports from the log of a sender, in work coordinates.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str, optional
        mm or inch: the units of the reports, where the log does not contain ``$13``.
    offset : (3,) float, optional
        Origin of the work coordinates in the machine's, where the log contains neither ``WCO:``
        or ``WPos:`` nor ``$#`` with ``$G``. [mm]
    anywhere : bool
        Where the touches lie does not matter, as on a sphere or in a ring: positions are those of
        the machine, which no work offset changes.

    Returns
    -------
    FilePositions
        Each report marks whether it is a contact, except those of old versions of grbl. With the
        feeds, where the log contains the probing moves (G38.2 … F…) of all reports.

    Raises
    ------
    InputError
        The units or the offset are neither in the log nor given; offsets change among the touches;
        a report is cut off. The message contains the line.

    >>> file = SourceFile("grbl.log", b"$13=0\n<Idle|WCO:1,2,3>\n[PRB:1.000,2.000,5.500:1]\n")
    >>> read_grbl_log(file).positions.tolist()
    [[0.0, 0.0, 2.5]]
    """
    file = opened(source)
    log, moves = _GrblLog(file, units, anywhere), LoggedFeeds()
    previous = ""
    for number, text in enumerate(file.lines("a grbl log"), start=1):
        log.read_units(text, number)
        moves.take(text, number)
        log.read_offsets(text, number)
        log.read_statement(text.strip(), number)
        repeated = any(parameter in previous for parameter in _PARAMETERS)
        log.read_reports(text, number, repeated=repeated)
        # Senders ask for the status at any time, also among the lines of $#.
        if text.strip() and not _STATUS_LINE.search(text):
            previous = text
    if not log.positions:
        raise file.error(
            "the file contains no report [PRB:…] of a touch (the one among the parameters, $#, "
            "repeats an earlier one)"
        )
    scale = file.scale(
        log.units, "the log does not show whether reports are in inches ($13=0 or $13=1)"
    )
    origin = np.zeros(3)
    if offset is not None:
        origin = log.given_offset(np.asarray(offset, dtype=np.float64), scale)
    elif not anywhere:
        origin = scale * log.work_offset()
    feeds = moves.of(log.lines, scale)
    read = FilePositions(
        file.path,
        scale * np.array(log.positions) - origin,
        tuple(log.lines),
        log.contacts(),
        feeds=feeds,
        words=log.stated.columns(),
        warnings=log.warnings(),
    )
    return moves.applied(read)


@dataclass
class _GrblLog:
    """What was read of a log so far.

    Attributes
    ----------
    positions, contact, lines
        Of the reports, in machine coordinates and the log's units; contact is None where a report
        does not state it.
    offsets : mapping of str to values and line
        WCO, G54 …, G92 and TLO, as last stated.
    first_offsets
        The same when the first report came.
    active : str or None
        The work offset that was active when the first report came.
    stated_later : str or None
        The work offset that the log first states among the touches.
    other_axes
        Values of the first report beyond x, y and z.
    changed : message and line, or None
        A change of the work coordinates after a report: an error once another report follows.
    """

    file: SourceFile
    units: str | None
    anywhere: bool = False
    positions: list[list[float]] = field(default_factory=list)
    contact: list[bool | None] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    offsets: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    first_offsets: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    active: str | None = None
    stated_later: str | None = None
    other_axes: list[float] | None = None
    changed: tuple[str, int] | None = None
    homed: int | None = None
    restarted: int | None = None
    of_before: int | None = None
    stated: StatedRows = field(init=False)

    def warnings(self) -> tuple[str, ...]:
        """What to know of the lines between the reports."""
        told = list(self.stated.warnings())
        if self.homed is not None:
            homed = f"the machine was homed among the touches (line {self.homed}): its coordinates "
            told.append(homed + "are those of the switches again, with their scatter")
        if self.restarted is not None:
            again = f"the control started again among the touches (line {self.restarted}): if it "
            told.append(again + "lost its position, split the log there")
        if self.of_before is not None:
            told.append(
                f"line {self.of_before}: the report among the parameters ($#) repeats a touch that "
                "is not in this log; it is not counted"
            )
        return tuple(told)

    def __post_init__(self) -> None:
        self.stated = StatedRows(self.file, of_centres=True)

    def read_statement(self, line: str, number: int) -> None:
        """Read what a line states in addition to the reports: a tool, a work offset …."""
        for message in _MESSAGE.findall(line):
            if _HOMED.match(message):
                self.read_statement("$H", number)
            else:
                self.stated.take(_STATEMENTS.of(";"), f"; {message}", number)
        sent = _sent(line)
        known = _STATEMENTS.of(sent)
        if known is not None and known[0].means == "frame" and self.anywhere:
            if known[0].words == _HOMING and self.positions:
                self.homed = number
            if known[0].words != _LOST:
                return  # reports are in machine coordinates
        self.stated.take(known, line, number, sent)
        if _STARTS.match(sent) and self.positions:
            self.restarted = number

    def read_units(self, text: str, number: int) -> None:
        """Read the setting $13: whether reports are in inches."""
        if not (found := _INCHES.search(text)):
            return
        own = "inch" if found[1] == "1" else "mm"
        if self.units not in (None, own):
            raise self.file.error(
                f"the log's units are {own} here ($13={found[1]}), before they were {self.units}",
                number,
                inputs=("units",),
            )
        self.units = own

    def read_offsets(self, text: str, number: int) -> None:
        """Read work offsets, the tool length and the active work offset."""
        if found := _STATUS_OFFSET.search(text):
            self._keep_offset("WCO", self._offset("WCO", found[1], number), number)
        if found := _BOTH_POSITIONS.search(text):
            machine, work = (self._offset("MPos, WPos", found[i], number)[:3] for i in (2, 3))
            origin = [round(m - w, 4) for m, w in zip(machine, work, strict=True)]
            self._keep_offset("WCO", origin, number, rounded=_ROUNDED)
        for name, values in _OFFSET.findall(text):
            self._keep_offset(name, self._offset(name, values, number), number)
        if (state := _STATE.search(text)) and (active := _WORK_OFFSET.findall(state[1])):
            self._keep_active(active[-1], number)
        if state and (tool := _TOOL_OF_STATE.search(state[1])):
            self.stated.state("tip", tool[1])

    def _offset(self, name: str, text: str, number: int) -> list[float]:
        values = self.file.numbers([cell for cell in text.split(",") if cell], number)
        if name == "TLO" and len(values) in (0, 2):
            raise self.file.error(
                f"TLO has {len(values)} values; the length along z, or x, y and z, is needed",
                number,
            )
        if name != "TLO" and len(values) < 3:
            raise self.file.error(f"{name} has {len(values)} values; x, y and z are needed", number)
        return values

    def _keep_active(self, name: str, number: int) -> None:
        if not self.positions:
            self.active = name
            return
        known = self.active or self.stated_later
        if known is not None and known != name:
            self._changed(f"{name} became active here", number)
        self.stated_later = name

    def _keep_offset(
        self, name: str, values: list[float], number: int, rounded: float = 0.0
    ) -> None:
        before, line = self.offsets.get(name, (values, number))
        same = len(values) == len(before) and np.allclose(values, before, rtol=0.0, atol=rounded)
        if self.positions and not same:
            self._changed(f"{name} was {before} (line {line}) and is {values} here", number)
        if not (self.positions and same):
            self.offsets[name] = (values, number)

    def _changed(self, what: str, number: int) -> None:
        self.changed = (f"{what}, among the touches; split the log there", number)

    def read_reports(self, text: str, number: int, *, repeated: bool) -> None:
        """Read the probe reports of a line; repeated ones ($#) are checked and left out."""
        reports: list[tuple[str, str]] = _PROBE.findall(text)
        reports += [(machine, "") for state, machine, _ in _BOTH_POSITIONS.findall(text)
                    if state == "Probe"]  # fmt: skip
        if len(_PROBE_BEGINS.findall(text)) != len(reports):
            raise self.file.error("this report is cut off; [PRB:x,y,z:1] is needed", number)
        for cells, flag in reports:
            if flag not in ("0", "1", ""):
                raise self.file.error(
                    "this report does not end in :1 or :0; [PRB:x,y,z:1] is needed", number
                )
            values = self.file.numbers(cells.split(","), number)
            if len(values) < 3:
                raise self.file.error(
                    f"a report of {len(values)} axes; x, y and z are needed", number
                )
            if not repeated:
                self._keep_report(values, flag == "1" if flag else None, number)
            elif flag != "0" and values[:3] != (self.positions or [[]])[-1]:
                self.of_before = self.of_before or number

    def _keep_report(self, values: list[float], contact: bool | None, number: int) -> None:
        if self.changed is not None and not self.anywhere:
            raise self.file.error(*self.changed)
        self.stated.row(number)
        self._check_other_axes(values[3:], number)
        if not self.positions:
            self.first_offsets = dict(self.offsets)
        elif (contact is None) != (self.contact[0] is None):
            raise self.file.error(
                "this report says whether there was contact (:1 or :0), the first one does not, "
                "or the reverse: are these logs of two machines?",
                number,
            )
        self.positions.append(values[:3])
        self.contact.append(contact)
        self.lines.append(number)

    def _check_other_axes(self, values: list[float], number: int) -> None:
        if self.other_axes is None:
            self.other_axes = values
        if len(values) != len(self.other_axes) or np.any(
            np.abs(np.subtract(values, self.other_axes)) > _MOVED
        ):
            raise self.file.error("a fourth axis has moved since the first report", number)

    def contacts(self) -> tuple[bool, ...] | None:
        """Return whether each report is a contact; None where the log does not state it."""
        stated = tuple(contact for contact in self.contact if contact is not None)
        return stated if len(stated) == len(self.contact) else None

    def given_offset(
        self, offset: npt.NDArray[np.float64], scale: float
    ) -> npt.NDArray[np.float64]:
        """The offset that the user gives, refused where the log states another one. [mm]"""
        try:
            own = scale * self.work_offset()
        except InputError:  # the log does not state it
            return offset
        if np.abs(own - offset).max() > scale * _ROUNDED:
            shown = ",".join(f"{value:.6g}" for value in own)
            raise self.file.error(
                f"the log states the offset {shown} mm of the work coordinates in the machine's; "
                "leave out the one that you gave",
                inputs=("offset",),
            )
        return offset

    def work_offset(self) -> npt.NDArray[np.float64]:
        """Return the origin of the work coordinates in the machine's, in the log's units, (3,)."""
        known = {name: np.array(values) for name, (values, _) in self.first_offsets.items()}
        if "WCO" in known:
            return known["WCO"][:3]
        if self.active is None and "G54" in known:
            raise self.file.error(
                "the log contains offsets ($#), but neither the active one ($G) nor WCO; give the "
                "offset x,y,z of the work coordinates in the machine's, in mm",
                inputs=("offset",),
            )
        if self.active is None or self.active not in known:
            raise self.file.error(
                "reports are in machine coordinates, and the log does not show before the first "
                "report where the work coordinates are (a status line with WCO or WPos, or the "
                "answers to $# and $G); give the offset x,y,z of the work coordinates in the "
                "machine's, in mm",
                inputs=("offset",),
            )
        origin = known[self.active][:3]
        if "G92" in known:
            origin = origin + known["G92"][:3]
        if "TLO" in known:
            length = known["TLO"]
            # grbl states the length along z; grblHAL states a value for each axis.
            origin = origin + (np.array([0.0, 0.0, length[0]]) if len(length) == 1 else length[:3])
        return origin


def _sent(line: str) -> str:
    """What a line of a log has without reports and what senders write before it: >>> , a time."""
    code = _REPORTED.sub(" ", _TIME.sub("", line, count=1) if _TIME.match(line) else line)
    return code[max(code.rfind("> "), code.rfind(">>"), code.rfind("]: ")) + 1 :].strip(" >\"':")


def _parsed(file: SourceFile, options: ReadingOptions) -> FilePositions:
    """Positions of a log; one that is looked at may lack its offset, and so may a reference."""
    anywhere = options.moves_as_a_whole
    try:
        return read_grbl_log(file, options.units, options.offset, anywhere=anywhere)
    except InputError as error:
        if not options.look_only or error.inputs != ("offset",):
            raise
        found = read_grbl_log(file, options.units, anywhere=True)
        lacking = "the offset of the work coordinates (these are the machine's), except on a "
        lacking += "reference or for repeats"
        return replace(found, lacks=(lacking,))


GRBL = FileFormat(
    name="grbl",
    what="log of a sender for grbl, grblHAL, FluidNC, Carvera: [PRB:…], <Probe,MPos:…>",
    reads="positions",
    needs="plan; units without $13; offset without WCO or WPos",
    takes=("offset",),
    verified="the syntax of public logs of seven senders and of the firmware of Carvera",
    recognises=lambda lines: any(_PROBE_BEGINS.search(line) for line in lines),
    parse=lambda file, options: _parsed(file, options),
    statements=_TABLE,
    other_lines="named",
)
