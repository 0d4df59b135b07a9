"""Logs of grbl, grblHAL and FluidNC: the reports ``[PRB:x,y,z:1]``, wherever senders put them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import InputError
from pretravel.formats.logs.joining import Rows, file_lines, finite, scale_of

_PROBE = re.compile(r"\[PRB:([^\]:]*):?([^\]]*)\]")
_OFFSET = re.compile(r"\[(G5[4-9](?:\.[123])?|G92|TLO):([^\]]*)\]")
_MOVED = 2e-3  # of other axes: degrees or mm, two digits of a report
_STATUS_LINE = re.compile(r"<\w+\|[^>]*>")
_STATUS = re.compile(r"WCO:([-\d.,]+)")
_INCHES = re.compile(r"\$13\s*=\s*([01])")
_MODE = re.compile(r"\[(?:GC:)?[^\]]*\b(G5[4-9](?:\.[123])?)\b[^\]]*\]")
_OF_PARAMETERS = ("[TLO:", "[T:", "[HOME:", "[G92:", "[G51:", "[G30:", "[G28:", "[G59")


def read_grbl_log(
    path: str | Path,
    units: str | None = None,
    offset: tuple[float, float, float] | None = None,
) -> Rows:
    r"""Probe reports from the log of a sender, in work coordinates.

    Parameters
    ----------
    path : str or Path
    units : str, optional
        mm or inch, those of the reports; needed where the log does not show ``$13``.
    offset : (3,) float, optional
        Of the work coordinates in the machine's; needed where the log shows no ``WCO:`` and no
        ``$#``. [mm]

    Returns
    -------
    Rows
        With what each report says of contact.

    Raises
    ------
    InputError
        Units or offset that neither the log nor the user tells; offsets that change; reports
        that are cut off: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "grbl.log"
    >>> _ = file.write_text("$13=0\n<Idle|MPos:0,0,0|WCO:1,2,3>\n[PRB:1.000,2.000,5.500:1]\n")
    >>> read_grbl_log(file).positions.tolist()
    [[0.0, 0.0, 2.5]]
    """
    lines = file_lines(path, "a grbl log")
    rows: list[list[float]] = []
    contact: list[bool] = []
    numbers: list[int] = []
    told: dict[str, tuple[list[float], int]] = {}
    offset_known: dict[str, tuple[list[float], int]] = {}
    active: str | None = None
    more: list[FloatArray] = []
    before = ""
    for number, text in enumerate(lines, start=1):
        if found := _INCHES.search(text):
            own = "inch" if found[1] == "1" else "mm"
            if units is not None and units != own:
                raise InputError(
                    f"the log says {own} ($13={found[1]}), before it was {units}",
                    path=path,
                    line=number,
                )
            units = own
        if found := _STATUS.search(text):
            _keep(told, "WCO", found[1], bool(rows), path, number)
        for name, value in _OFFSET.findall(text):
            _keep(told, name, value, bool(rows), path, number)
        if "[GC:" in text and (found := _MODE.search(text)):
            if rows and active != found[1]:
                raise InputError(
                    f"{found[1]} became active among the touches; split the log there",
                    path=path,
                    line=number,
                )
            active = found[1]
        reports = _PROBE.findall(text)
        if text.count("[PRB:") != len(reports):
            raise InputError(
                "this report is cut off; [PRB:x,y,z:1] is needed", path=path, line=number
            )
        for cells, flag in reports:
            if flag not in ("0", "1"):
                raise InputError(
                    "this report does not end in :1 or :0; [PRB:x,y,z:1] is needed",
                    path=path,
                    line=number,
                )
            values = finite(cells.split(","), path, number)
            if len(values) < 3:
                raise InputError(
                    f"a report of {len(values)} axes; x, y and z are needed",
                    path=path,
                    line=number,
                )
            if any(key in before for key in _OF_PARAMETERS):
                continue  # $# repeats the last report among its parameters
            others = np.array(values[3:])
            if more and (len(others) != len(more[0]) or np.any(np.abs(others - more[0]) > _MOVED)):
                raise InputError(
                    "a fourth axis has moved since the first report", path=path, line=number
                )
            more.append(others)
            if not rows:
                offset_known = dict(told)
            rows.append(values[:3])
            contact.append(flag == "1")
            numbers.append(number)
        # Status lines come at any time, between the lines of $# too.
        if text.strip() and not _STATUS_LINE.search(text):
            before = text
    if not rows:
        raise InputError("no report [PRB:…] in it", path=path)
    scale = scale_of(units, path, "the log does not show whether reports are in inches ($13=0)")
    if offset is not None:
        shift = np.asarray(offset, dtype=np.float64)
    else:
        shift = scale * np.array(_work_offset(offset_known, active, path))
    return Rows(str(path), scale * np.array(rows) - shift, tuple(numbers), tuple(contact))


def _keep(
    told: dict[str, tuple[list[float], int]],
    name: str,
    text: str,
    probed: bool,
    path: str | Path,
    line: int,
) -> None:
    values = finite([cell for cell in text.split(",") if cell], path, line)
    if name != "TLO" and len(values) < 3:
        raise InputError(
            f"{name} has {len(values)} values; x, y and z are needed", path=path, line=line
        )
    if probed and name in told and told[name][0] != values:
        raise InputError(
            f"{name} was {told[name][0]} (line {told[name][1]}) and is {values} now, among the "
            "touches; split the log there",
            path=path,
            line=line,
        )
    told[name] = (values, line)


def _work_offset(
    told: dict[str, tuple[list[float], int]], active: str | None, path: str | Path
) -> list[float]:
    if "WCO" in told:
        return told["WCO"][0][:3]
    if active is None and "G54" in told:
        raise InputError(
            "the log shows offsets ($#) but not which is active ($G) and no WCO; give --offset "
            "x,y,z of the work coordinates in the machine's, mm",
            path=path,
        )
    if active is None or active not in told:
        raise InputError(
            "reports are in machine coordinates, and before the first the log does not show "
            "where the work coordinates are (WCO: in a status line, or $# and $G); give --offset "
            "x,y,z, mm",
            path=path,
        )
    shift = np.array(told[active][0][:3])
    if "G92" in told:
        shift = shift + np.array(told["G92"][0][:3])
    if "TLO" in told:
        length = told["TLO"][0]
        # One value: along z (grbl); one for each axis: grblHAL.
        shift = shift + (np.array([0.0, 0.0, length[0]]) if len(length) == 1 else length[:3])
    return [float(value) for value in shift]
