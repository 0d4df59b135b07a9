"""O-word subroutines of LinuxCNC that compensate on the control; no Python runs there."""

from __future__ import annotations

from functools import partial

from pretravel.base import DEGREE, INCH, PretravelError
from pretravel.controls.control import (
    Control,
    ExportedFiles,
    ExportSettings,
    coarse_table_warnings,
    own_formula,
    without_a_table,
)
from pretravel.controls.control_table import head_statement
from pretravel.controls.gcode import render
from pretravel.controls.linuxcnc_cycles import linuxcnc_cycles, sphere_subroutines
from pretravel.controls.linuxcnc_state import check_line_lengths
from pretravel.controls.lookup import Lookup, describe_form
from pretravel.controls.lookup_formula import exact_lookup
from pretravel.controls.lookup_table import lookup_table
from pretravel.controls.map_identity import map_identity
from pretravel.controls.program_log import (
    FAULTS,
    LOG_HEAD,
    SUBROUTINE_TOUCH_COLUMNS,
    SURFACE_POINT_COLUMNS,
)
from pretravel.controls.steps import same_steps
from pretravel.files import USUAL_STYLUS_LENGTH
from pretravel.maps import PretravelMap
from pretravel.touches import GLANCING

# Probe Basic keeps its settings in 3000 to 3058 and 3973 to 4024, its results in 1001 to 1012.
_FIRST, _MOST_VALUES = 1050, 1900
_TABLE_FILE = "pretravel_table.ngc"
_ROOM_FOR_A_TABLE = 500
"""Fewest parameters that must remain for a table."""
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
    base: int = _FIRST,
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
        "source": ", ".join(
            filter(None, [pretravel_map.provenance.source, head_statement(pretravel_map)])
        ),
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


def exported(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    """The subroutines, with the formula of the map where it has one, else with a table."""
    base = _FIRST if settings.base is None else settings.base
    if not 31 <= base < LAST_FREE - _ROOM_FOR_A_TABLE:
        raise PretravelError(
            f"first variable {base}: the parameters for users are 31 to {LAST_FREE}",
            inputs=("base",),
        )
    subroutines = partial(
        linuxcnc_subroutines,
        base=base,
        tool=settings.tool,
        stylus_length=USUAL_STYLUS_LENGTH
        if settings.stylus_length is None
        else settings.stylus_length,
        written=settings.written,
    )
    exact = None if settings.form == "table" else exact_lookup(pretravel_map)
    if exact is not None:
        texts = subroutines(pretravel_map, exact)
        idle = without_a_table(first_variable=settings.base, largest_deviation=settings.tolerance)
        return ExportedFiles(texts, (_TABLE_FILE,), (describe_form(exact),), idle, exact)
    if settings.form == "formula":
        own_formula(pretravel_map)
    table = lookup_table(
        pretravel_map,
        tolerance=settings.largest_deviation,
        most_values=min(_MOST_VALUES, LAST_FREE - base),
    )
    return ExportedFiles(
        subroutines(pretravel_map, table),
        remarks=(describe_form(table),),
        warnings=coarse_table_warnings(pretravel_map, table, settings),
        form=table,
    )


TO_LINUXCNC = Control(
    exported,
    "LinuxCNC (subroutines)",
    same_steps(
        "Copy all .ngc files to a folder of SUBROUTINE_PATH (see [RS274NGC] in the INI file).",
        "pretravel_point makes a whole touch and its surface point; pretravel_bore, pretravel_boss "
        "and others measure a feature from MDI. The first lines of each file give its arguments.",
    ),
    folder=True,
    uses_feed=True,
    options=frozenset({"base", "form", "tolerance", "tool", "stylus_length"}),
    usual={"base": f"{_FIRST}"},
)
