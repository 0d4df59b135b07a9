"""What all files for LinuxCNC need: the state of the control is kept, lines have their length."""

from __future__ import annotations

from pretravel.base import PretravelError
from pretravel.controls.gcode import render

HANDLER = "ON_ABORT_COMMAND = O <pretravel_restore> call"
"""The line for the section RS274NGC of the INI file of a machine."""
_LONGEST_LINE = 250
"""Characters of a line; the interpreter accepts 255."""


def state_subroutines() -> dict[str, str]:
    """The subroutines that all programs and cycles need, around their moves.

    pretravel_keep and pretravel_restore: a program keeps what is active before its first move. At
    its end, and after an abort or an emergency stop, it comes back: units, distances, feed mode
    and feed, plane, work offset, tool length, overrides. The control calls pretravel_restore after
    an abort, where its INI file has the line `HANDLER`; a program stops before its first move where
    it does not.

    Returns
    -------
    dict of str to str
        Text by file name, for the folder that SUBROUTINE_PATH states.

    >>> sorted(state_subroutines())
    ['pretravel_keep.ngc', 'pretravel_restore.ngc']
    """
    names = ("pretravel_keep.ngc", "pretravel_restore.ngc")
    return {name: render(f"linuxcnc/{name}", handler=HANDLER) for name in names}


def check_line_lengths(text: str) -> None:
    """Refuse G-code with a line that LinuxCNC's interpreter does not accept."""
    longest = max(text.splitlines(), key=len)
    if len(longest) > _LONGEST_LINE:
        raise PretravelError(
            f"a line of {len(longest)} characters is too long for the control, which accepts "
            f"{_LONGEST_LINE}; shorten the texts in it: {longest}"
        )
