"""The variables of a vector calibration of Renishaw's cycles, set by a Macro B program."""

from __future__ import annotations

from pretravel.base import MICROMETRE, PretravelError
from pretravel.controls.control import Control, ExportedFiles, ExportSettings, single_file
from pretravel.controls.control_table import (
    TableSettings,
    check_across_z,
    check_radii,
    conditions_statements,
    map_statement,
)
from pretravel.controls.fanuc import FANUC
from pretravel.controls.gcode import plain_number, render
from pretravel.controls.macro_b import check_program, check_room, free_variables
from pretravel.controls.steps import same_steps
from pretravel.maps import (
    SECTOR_NAMES,
    PretravelMap,
    SectorTable,
    resampled_sectors,
    taken_opposite,
    touched_sectors,
)

VECTOR_ANGLES = {
    "normals": ("outward normals of the surface", "directions of travel"),
    "travel": ("directions of travel toward the surface", "outward normals"),
}
"""Meanings of the angles of a vector calibration: the words for it, and for the other one."""

_OF_SECTOR = {"max": "middle between largest and smallest", "rms": "mean"}
"""What a radius is, by criterion."""
_VECTORS = 10
"""Distance of the first of the eight vector radii from the base variable."""
_SETTER = 7799
_FIRST = 500
"""Variable of the X radius."""
_RADII_RANGES = (*FANUC.free, (10000, 10999))


def renishaw_variables(
    pretravel_map: PretravelMap,
    settings: TableSettings | None = None,
    *,
    criterion: str = "max",
    angles: str = "normals",
) -> str:
    """A program that sets the macro variables of a vector calibration.

    These are two axis radii and eight vector radii.

    Parameters
    ----------
    pretravel_map : PretravelMap
    settings : TableSettings, optional
        The base is the variable of the X radius, as set in the probing macros; 500 by default.
    criterion : str
        See `resampled_sectors`.
    angles : str
        What the angles of the radii are: azimuths of the outward ``normals``, or of the directions
        of ``travel`` toward the surface.

    Returns
    -------
    str
        A program to run once on the control. It does not change the offsets of the stylus
        (base + 2, base + 3).

    Raises
    ------
    PretravelError
        The variables do not belong to the user; the map does not hold all around the equator.
    """
    settings = settings or TableSettings()
    base = _FIRST if settings.base is None else settings.base
    program = _SETTER if settings.program is None else settings.program
    check_room(free_variables(_RADII_RANGES, base), base, _VECTORS + 8)
    check_program(program, 1)
    if angles not in VECTOR_ANGLES:
        raise PretravelError(
            f"angles '{angles}': they are {' or '.join(VECTOR_ANGLES)}", inputs=("angles",)
        )
    check_across_z(pretravel_map)
    table = resampled_sectors(pretravel_map, criterion)
    pretravel = table.pretravel if angles == "normals" else taken_opposite(table.pretravel)
    check_radii(pretravel_map, pretravel + settings.travel)
    radii = settings.scaled(pretravel_map.tip_radius - pretravel - settings.travel)
    variables = [base, base + 1, *range(base + _VECTORS, base + _VECTORS + 8)]
    names = ["X radius", "Y radius", *(f"{name} degrees" for name in SECTOR_NAMES[2:])]
    return render(
        "renishaw/vector_radii.nc",
        program=program,
        base=base,
        last=variables[-1],
        statements=_radii_statements(pretravel_map, settings, criterion, angles),
        radii=list(zip(variables, map(plain_number, radii), names, strict=True)),
    )


def _radii_statements(
    pretravel_map: PretravelMap, settings: TableSettings, criterion: str, angles: str
) -> list[str]:
    table = resampled_sectors(pretravel_map, criterion)
    touched = touched_sectors(pretravel_map)
    meaning, other = VECTOR_ANGLES[angles]
    radius = plain_number(float(settings.scaled(pretravel_map.tip_radius)))
    misread = _um(table.misread(pretravel_map).largest)
    return [
        map_statement(pretravel_map),
        f"units {settings.units}. Tip radius {radius} minus pretravel",
        f"each radius is the {_OF_SECTOR[criterion]} of its sector - not the radius at the angle",
        *conditions_statements(pretravel_map, settings),
        f"the angles are {meaning} - from X toward Y of the machine",
        f"XY points are wrong by {_residuals(table)} with the radius of the nearest angle",
        f"a control that takes the angles as {other} is wrong by {misread} at most",
        f"radii from a calibration by the control are wrong by {_residuals(touched)}",
        "not yet tried on a control. Compare with a calibration by the control before use",
    ]


def _residuals(table: SectorTable) -> str:
    return f"{_um(table.largest)} at most and {_um(table.rms)} rms"


def _um(length: float) -> str:
    return f"{length / MICROMETRE:.2f} um"


def _renishaw(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    text = renishaw_variables(
        pretravel_map, settings.table, criterion=settings.criterion, angles=settings.angles
    )
    return single_file(text)


TO_RENISHAW = Control(
    _renishaw,
    "Renishaw cycles (vector radii)",
    same_steps(
        "No control has run this file yet. Write down the ten variables first, so that you can "
        "restore them.",
        "Compare the eight radii with those of a vector calibration by the control: the pattern of "
        "large and small ones must be the same. If it is turned by 180°, choose directions of "
        "travel above.",
        "Copy the program to the control. In MDI: call it once with G65 P and its number.",
    ),
    options=frozenset({"base", "program", "units", "angles", "criterion"}),
    ending=".nc",
    usual={"base": f"{_FIRST}", "program": f"{_SETTER}"},
)
