"""Logs of grbl, grblHAL and FluidNC: reports ``[PRB:x,y,z:1]``, as senders log them; reading."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from pretravel.formats.file_format import FileFormat, FilePositions
from pretravel.formats.source_file import Source, SourceFile, opened

_PROBE = re.compile(r"\[PRB:([^\]:]*):?([^\]]*)\]")
_OFFSET = re.compile(r"\[(G5[4-9](?:\.[123])?|G92|TLO):([^\]]*)\]")
_STATUS_LINE = re.compile(r"<\w+\|[^>]*>")
_STATUS_OFFSET = re.compile(r"WCO:([-\d.,]+)")
_INCHES = re.compile(r"\$13\s*=\s*([01])")
_ACTIVE_OFFSET = re.compile(r"\[(?:GC:)?[^\]]*\b(G5[4-9](?:\.[123])?)\b[^\]]*\]")
_PARAMETERS = ("[TLO:", "[T:", "[HOME:", "[G92:", "[G51:", "[G30:", "[G28:", "[G59")
"""Parameters after which ``$#`` repeats the last report."""
_MOVED = 2e-3
"""Other axes that differ by more than this have moved. [deg or mm, reports have two digits]"""


def read_grbl_log(
    source: Source,
    units: str | None = None,
    offset: tuple[float, float, float] | None = None,
) -> FilePositions:
    r"""Read probe reports from the log of a sender, in work coordinates.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str, optional
        mm or inch: the units of the reports, where the log does not contain ``$13``.
    offset : (3,) float, optional
        Origin of the work coordinates in the machine's, where the log contains neither ``WCO:``
        nor ``$#`` with ``$G``. [mm]

    Returns
    -------
    FilePositions
        Each report marks whether it is a contact.

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
    log = _GrblLog(file, units)
    previous = ""
    for number, text in enumerate(file.lines("a grbl log"), start=1):
        log.read_units(text, number)
        log.read_offsets(text, number)
        repeated = any(parameter in previous for parameter in _PARAMETERS)
        log.read_reports(text, number, repeated=repeated)
        # Senders ask for the status at any time, also among the lines of $#.
        if text.strip() and not _STATUS_LINE.search(text):
            previous = text
    if not log.positions:
        raise file.error("the file contains no report [PRB:…]")
    scale = file.scale(
        log.units, "the log does not show whether reports are in inches ($13=0 or $13=1)"
    )
    origin = scale * log.work_offset() if offset is None else np.asarray(offset, dtype=np.float64)
    return FilePositions(
        file.path,
        scale * np.array(log.positions) - origin,
        tuple(log.lines),
        tuple(log.contact),
    )


@dataclass
class _GrblLog:
    """What was read of a log so far.

    Attributes
    ----------
    positions, contact, lines
        Of the reports, in machine coordinates and the log's units.
    offsets : mapping of str to values and line
        WCO, G54 …, G92 and TLO, as last stated.
    first_offsets
        The same when the first report came.
    active : str or None
        The work offset that is active.
    other_axes
        Values of the first report beyond x, y and z.
    """

    file: SourceFile
    units: str | None
    positions: list[list[float]] = field(default_factory=list)
    contact: list[bool] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    offsets: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    first_offsets: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    active: str | None = None
    other_axes: list[float] | None = None

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
            self._keep_offset("WCO", found[1], number)
        for name, values in _OFFSET.findall(text):
            self._keep_offset(name, values, number)
        if "[GC:" in text and (found := _ACTIVE_OFFSET.search(text)):
            if self.positions and self.active != found[1]:
                raise self.file.error(
                    f"{found[1]} became active among the touches; split the log there", number
                )
            self.active = found[1]

    def _keep_offset(self, name: str, text: str, number: int) -> None:
        values = self.file.numbers([cell for cell in text.split(",") if cell], number)
        if name != "TLO" and len(values) < 3:
            raise self.file.error(f"{name} has {len(values)} values; x, y and z are needed", number)
        if self.positions and name in self.offsets and self.offsets[name][0] != values:
            before, line = self.offsets[name]
            raise self.file.error(
                f"{name} was {before} (line {line}) and is {values} here, among the touches; split "
                "the log there",
                number,
            )
        self.offsets[name] = (values, number)

    def read_reports(self, text: str, number: int, *, repeated: bool) -> None:
        """Read the probe reports of a line; repeated ones ($#) are checked and left out."""
        reports = _PROBE.findall(text)
        if text.count("[PRB:") != len(reports):
            raise self.file.error("this report is cut off; [PRB:x,y,z:1] is needed", number)
        for cells, flag in reports:
            if flag not in ("0", "1"):
                raise self.file.error(
                    "this report does not end in :1 or :0; [PRB:x,y,z:1] is needed", number
                )
            values = self.file.numbers(cells.split(","), number)
            if len(values) < 3:
                raise self.file.error(
                    f"a report of {len(values)} axes; x, y and z are needed", number
                )
            if repeated:
                continue
            self._check_other_axes(values[3:], number)
            if not self.positions:
                self.first_offsets = dict(self.offsets)
            self.positions.append(values[:3])
            self.contact.append(flag == "1")
            self.lines.append(number)

    def _check_other_axes(self, values: list[float], number: int) -> None:
        if self.other_axes is None:
            self.other_axes = values
        if len(values) != len(self.other_axes) or np.any(
            np.abs(np.subtract(values, self.other_axes)) > _MOVED
        ):
            raise self.file.error("a fourth axis has moved since the first report", number)

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
                "report where the work coordinates are (WCO: in a status line, or $# and $G); give "
                "the offset x,y,z of the work coordinates in the machine's, in mm",
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


GRBL = FileFormat(
    name="grbl",
    what="log of a sender for grbl, grblHAL, FluidNC: [PRB:…]",
    reads="positions",
    needs="plan; units without $13; offset without WCO",
    verified="public logs of five senders: their form",
    recognises=lambda lines: any("[PRB:" in line for line in lines),
    parse=lambda file, options: read_grbl_log(file, options.units, options.offset),
)
