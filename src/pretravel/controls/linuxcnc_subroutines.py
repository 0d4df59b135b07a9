"""O-word subroutines of LinuxCNC that compensate on the control; no Python runs there."""

from __future__ import annotations

from pretravel.base import DEGREE, INCH
from pretravel.controls.gcode import render
from pretravel.controls.linuxcnc_cycles import linuxcnc_cycles, sphere_subroutines
from pretravel.controls.linuxcnc_state import check_line_lengths
from pretravel.controls.lookup import Lookup, describe_form
from pretravel.controls.map_identity import map_identity
from pretravel.files import (
    FAULTS,
    LOG_HEAD,
    SUBROUTINE_TOUCH_COLUMNS,
    SURFACE_POINT_COLUMNS,
    USUAL_STYLUS_LENGTH,
)
from pretravel.maps import PretravelMap
from pretravel.touches import GLANCING

LAST_FREE = 5000
"""Parameters 31 to 5000 are the user's; the control keeps them while it runs."""
NO_RESULT = 9_999_999
"""What results are before a cycle has measured, and after it has stopped: no machine goes there."""
_SLACK = 1e-6
"""By so much a direction may lie outside the polar angles of a map. [degrees]"""


def linuxcnc_subroutines(
    pretravel_map: PretravelMap,
    form: Lookup,
    *,
    base: int = 1050,
    tool: int | None = None,
    stylus_length: float = USUAL_STYLUS_LENGTH,
    written: str = "",
) -> dict[str, str]:
    """Subroutines that evaluate a map, probe and compensate.

    Parameters
    ----------
    pretravel_map : PretravelMap
        Its supported directions, tip radius and signal delay are used.
    form : Lookup
        The form of that map that the control evaluates.
    base : int
        First parameter for a table.
    tool : int, optional
        Number of the probe in the tool table: cycles stop where another tool is in the spindle, or
        another length is active. Without it they stop where any tool length is active.
    stylus_length : float
        Cycles stop where the tip could go deeper than a stylus of this length bears. [mm]
    written : str
        The day, for the heads of the files.

    Returns
    -------
    mapping of str to str
        Text by file name. Each file is a subroutine with the file's name, for the folder that
        SUBROUTINE_PATH states.

    Raises
    ------
    PretravelError
        A line is too long for the control.
    """
    common = {
        "map": pretravel_map,
        "source": pretravel_map.provenance.source,
        "form": form,
        "description": describe_form(form),
        "lowest_deg": form.band.lowest / DEGREE,
        "highest_deg": form.band.highest / DEGREE,
        "base": base,
        "inch": INCH,
        "identity": map_identity(pretravel_map),
        "no_result": NO_RESULT,
        "tool": tool,
        "written": written,
    }
    texts: dict[str, dict[str, object]] = {
        "pretravel_lookup.ngc": {
            "form_template": form.template,
            "slack_deg": _SLACK,
            **form.template_values(),
        },
        "pretravel_compensate.ngc": {"glancing": GLANCING},
        "pretravel_identity.ngc": {},
        "pretravel_radius.ngc": {},
        "pretravel_point.ngc": {"causes": FAULTS},
        "pretravel_head.ngc": {
            "log_head": LOG_HEAD,
            "subroutine_touch_columns": SUBROUTINE_TOUCH_COLUMNS,
            "surface_point_columns": SURFACE_POINT_COLUMNS,
        },
    }
    if form.needs_table:
        texts["pretravel_table.ngc"] = {}
    files = {name: render(f"linuxcnc/{name}", **common, **values) for name, values in texts.items()}
    files |= linuxcnc_cycles(common) | sphere_subroutines(tool, stylus_length)
    for text in files.values():
        check_line_lengths(text)
    return files
