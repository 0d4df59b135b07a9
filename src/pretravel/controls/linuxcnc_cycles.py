"""O-word subroutines of LinuxCNC that measure features, called from MDI or a program."""

from __future__ import annotations

from collections.abc import Mapping

from pretravel.base import INCH
from pretravel.controls.gcode import render
from pretravel.controls.linuxcnc_state import check_line_lengths, state_subroutines
from pretravel.controls.program_log import FAULTS, LOG_ENDING, LOG_HEAD, SUBROUTINE_TOUCH_COLUMNS
from pretravel.files import USUAL_STYLUS_LENGTH, largest_deflection

_TEMPLATES: Mapping[str, tuple[str, bool]] = {
    "pretravel_bore": ("round.ngc", False),
    "pretravel_boss": ("round.ngc", True),
    "pretravel_pocket": ("square.ngc", False),
    "pretravel_web": ("square.ngc", True),
    "pretravel_edge": ("pretravel_edge.ngc", False),
    "pretravel_surface": ("pretravel_surface.ngc", False),
    "pretravel_angle": ("pretravel_angle.ngc", False),
    "pretravel_corner": ("pretravel_corner.ngc", True),
    "pretravel_correct": ("pretravel_correct.ngc", False),
}
"""Template of each cycle, and whether it touches from outside, with moves above the part."""


def linuxcnc_cycles(common: Mapping[str, object]) -> dict[str, str]:
    """Cycles that measure a bore, boss, pocket, web, edge, face, angle or corner with a map.

    Parameters
    ----------
    common : mapping
        What the templates of `linuxcnc_subroutines` share: the map and its description.

    Returns
    -------
    mapping of str to str
        Text by file name.
    """
    return {
        f"{name}.ngc": render(
            f"linuxcnc/{template}",
            **{**common, "name": name, "outside": outside, "causes": FAULTS},
        )
        for name, (template, outside) in _TEMPLATES.items()
    }


def sphere_subroutines(
    tool: int | None = None, stylus_length: float = USUAL_STYLUS_LENGTH
) -> dict[str, str]:
    """The subroutine pretravel_sphere and those that it calls: they need no map.

    Parameters
    ----------
    tool : int, optional
    stylus_length : float
        See `pretravel.controls.linuxcnc_subroutines.linuxcnc_subroutines`. [mm]

    Returns
    -------
    mapping of str to str
        Text by file name, for the folder that SUBROUTINE_PATH states.

    Raises
    ------
    PretravelError
        A line is too long for the control.

    >>> [name[10:-4] for name in sorted(sphere_subroutines())]
    ['keep', 'limits', 'move', 'restore', 'sphere', 'touch']
    """
    files = {
        name: render(
            f"linuxcnc/{name}",
            name="pretravel_sphere",
            inch=INCH,
            tool=tool,
            bears=largest_deflection(stylus_length),
            causes=FAULTS,
            log_head=LOG_HEAD,
            log=f"pretravel_sphere{LOG_ENDING}",
            log_sub=f"pretravel_sphere{LOG_ENDING}".removesuffix(".ngc"),
            subroutine_touch_columns=SUBROUTINE_TOUCH_COLUMNS,
        )
        for name in (
            "pretravel_sphere.ngc",
            "pretravel_move.ngc",
            "pretravel_touch.ngc",
            "pretravel_limits.ngc",
        )
    }
    files |= state_subroutines()
    for text in files.values():
        check_line_lengths(text)
    return files
