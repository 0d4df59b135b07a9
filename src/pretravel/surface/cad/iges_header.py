"""The global section of IGES files, which states the unit."""

from __future__ import annotations

import re

from pretravel.base import PretravelError

_WIDTH = 72
"""Columns of a line that contain text; the section's letter follows."""
_UNIT_FLAG = 14
"""Number of the parameter with the unit, from 1 (IGES 5.3, section 2.2.4.3)."""
_UNITS = range(1, 12)
_MOST_DIGITS = 9
_STRING = re.compile(rb"(\d+)[Hh]")
"""The begin of a string: its length and H."""


def check_iges_header(lines: list[bytes]) -> None:
    """Check that the global section can be read, so that the unit is that of the file.

    Parameters
    ----------
    lines : list of bytes
        Of the file.

    Raises
    ------
    PretravelError
        A string whose stated length is not its own, a section without an end, or no known unit.

    Notes
    -----
    In files that were edited by hand, a string can be shorter than its stated length. The CAD
    kernel then counts parameters wrongly, without a message, and takes millimetres for inches.
    """
    section = [line[:_WIDTH].ljust(_WIDTH) for line in lines if line[_WIDTH : _WIDTH + 1] == b"G"]
    parameters = _parameters(b"".join(section))
    flag = parameters[_UNIT_FLAG - 1] if len(parameters) >= _UNIT_FLAG else b""
    if flag and not (len(flag) <= _MOST_DIGITS and flag.isdigit() and int(flag) in _UNITS):
        raise PretravelError(
            f"its unit (parameter {_UNIT_FLAG} of the global section) is "
            f"'{flag[:24].decode('ascii', 'replace')}'; it must be a number from 1 to {_UNITS[-1]}"
        )


def _parameters(text: bytes) -> list[bytes]:
    """The parameters of a global section; the first two can state other delimiters."""
    delimiter, end = b",", b";"
    found: list[bytes] = []
    at = 0
    while True:
        at = _after_blanks(text, at)
        count = _STRING.match(text, at)
        if count:
            length = int(count[1]) if len(count[1]) <= _MOST_DIGITS else len(text)
            stop = count.end() + length
            if length == 1 and len(found) < 2:
                mark = text[stop - 1 : stop]
                delimiter, end = (mark, end) if not found else (delimiter, mark)
        else:
            stop = at
            while stop < len(text) and text[stop : stop + 1] not in (delimiter, end):
                stop += 1
        found.append(text[at:stop].strip())
        at = _after_blanks(text, stop)
        mark = text[at : at + 1]
        # The first parameter may make the usual end of a section the delimiter.
        if mark == end != delimiter:
            return found
        if mark != delimiter:
            raise PretravelError(
                f"parameter {len(found)} of its global section "
                f"('{text[stop - min(stop, 24) : stop].decode('ascii', 'replace').strip()}') has "
                "another length than it declares, so that the unit would be read wrongly. Correct "
                "the number before H, or export the part again"
            )
        at += 1


def _after_blanks(text: bytes, at: int) -> int:
    while text[at : at + 1] == b" ":
        at += 1
    return at
