"""Subroutines of LinuxCNC that keep the state of the control."""

from __future__ import annotations

from pretravel.controls.gcode import render

HANDLER = "ON_ABORT_COMMAND = O <pretravel_restore> call"
"""The line for the section RS274NGC of the INI file of a machine."""


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
