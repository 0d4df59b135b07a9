"""Variables and Macro B programs for Fanuc-like controls."""

from __future__ import annotations

from dataclasses import dataclass

from pretravel.base import MICROMETRE, PretravelError
from pretravel.controls.control_formula import formula_values
from pretravel.controls.control_table import (
    TableSettings,
    check_radii,
    control_table,
    feed_statement,
    map_statement,
    table_statements,
)
from pretravel.controls.gcode import plain_number, render
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries
from pretravel.controls.lookup_table import LookupTable, catmull_rom_text
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

_VECTORS = 10
"""Distance of the first of the eight vector radii from the base variable."""
_SETTER = 7799
_UNIT_CODES = {"mm": 21, "inch": 20}
"""G codes of the units; #4006 contains the active one."""


@dataclass(frozen=True)
class MacroDialect:
    """What distinguishes a control with Macro B.

    Attributes
    ----------
    name : str
    free : tuple of (int, int)
        First and last variables that belong to the user and keep their values, without #100 for
        the result.
    base : int
        First variable of the table where none is chosen.
    digits : int
        Digits of a program number in the name of its file.
    angles : str
        Template of the lines that compute the azimuth and the polar angle.
    verified : tuple of str
        What the programs were tried on.
    program : int
        Number of the first program where none is chosen.
    volatile : tuple of (int, int), optional
        Variables that lose their values at power-off.
    """

    name: str
    free: tuple[tuple[int, int], ...]
    base: int
    digits: int
    angles: str
    verified: tuple[str, ...]
    program: int = 7750
    volatile: tuple[int, int] | None = None

    def room(self, base: int) -> int:
        """Number of variables from a first one to the end of its range.

        Raises
        ------
        PretravelError
            It does not belong to the user, or loses its value at power-off.
        """
        if self.volatile is not None and self.volatile[0] <= base <= self.volatile[1]:
            low, high = self.volatile
            raise PretravelError(
                f"variable {base}: #{low} to #{high} of {self.name} lose their values at "
                "power-off, and the table with them. Choose another first variable, such as "
                f"{self.base}",
                inputs=("base",),
            )
        return free_variables(self.free, base)


FANUC = MacroDialect(
    "Fanuc",
    free=((500, 999),),
    base=600,
    digits=4,
    volatile=(100, 199),
    angles="fanuc/angles.nc",
    verified=(
        "not yet tried on a Fanuc control - test with care",
        "its arithmetic was tested in LinuxCNC and with the interpreter of pretravel",
    ),
)
"""Macro B of Fanuc. The table starts above the variables of the usual probing macros."""

_RADII_RANGES = (*FANUC.free, (10000, 10999))


def free_variables(ranges: tuple[tuple[int, int], ...], base: int) -> int:
    """Number of variables from a first one to the end of its range.

    Parameters
    ----------
    ranges : tuple of (int, int)
        First and last variables that may be used.
    base : int

    Returns
    -------
    int

    Raises
    ------
    PretravelError
        The first variable is in no range.

    >>> free_variables(((101, 199), (500, 999)), 600)
    400
    """
    for low, high in ranges:
        if low <= base <= high:
            return high - base + 1
    names = ", ".join(f"#{low} to #{high}" for low, high in ranges)
    raise PretravelError(
        f"variable {base} does not belong to the user; these do: {names}. Choose another first "
        "variable",
        inputs=("base",),
    )


def _check_room(room: int, base: int, count: int) -> None:
    if count > room:
        raise PretravelError(
            f"{count} variables from #{base} would end at #{base + count - 1}; the last one that "
            f"belongs to the user is #{base + room - 1}. Choose another first variable",
            inputs=("base",),
        )


def _check_program(program: int, count: int) -> None:
    if not 1 <= program <= 9999 - count + 1:
        raise PretravelError(
            f"program number {program}: it must be from 1 to {9999 - count + 1}",
            inputs=("program",),
        )


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
    base = 500 if settings.base is None else settings.base
    program = _SETTER if settings.program is None else settings.program
    _check_room(free_variables(_RADII_RANGES, base), base, _VECTORS + 8)
    _check_program(program, 1)
    if angles not in VECTOR_ANGLES:
        raise PretravelError(
            f"angles '{angles}': they are {' or '.join(VECTOR_ANGLES)}", inputs=("angles",)
        )
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
        feed_statement(pretravel_map, settings),
        f"the angles are {meaning} - from X toward Y of the machine",
        f"so the nearest radius is wrong by {_residuals(table)} in the XY plane",
        f"a control that takes the angles as {other} is wrong by {misread} at most",
        f"radii touched at their angles are wrong by {_residuals(touched)}",
        "not yet tried on a control. Compare with a calibration by the control before use",
    ]


def _residuals(table: SectorTable) -> str:
    return f"{_um(table.largest)} at most and {_um(table.rms)} rms"


def _um(length: float) -> str:
    return f"{length / MICROMETRE:.2f} um"


def fanuc_macro(
    pretravel_map: PretravelMap, form: LookupTable, settings: TableSettings | None = None
) -> dict[str, str]:
    """Two Macro B programs: one fills a table, one interpolates it for a direction.

    Parameters
    ----------
    pretravel_map : PretravelMap
    form : LookupTable
        The table of that map.
    settings : TableSettings, optional
        The base is the first variable, which contains the number of the table. The second program
        has the next number: G65 P7751 I.. J.. K.. (outward unit normal) sets #100 to the pretravel.
        Where the map does not hold, where the table is missing, or where the active unit is not
        that of the table, it raises an alarm.

    Returns
    -------
    dict of str to str
        A program for each file name. Not tried on a Fanuc control; other interpreters have run the
        arithmetic.

    Raises
    ------
    PretravelError
        The variables do not belong to the user.
    """
    return macro_programs(pretravel_map, form, settings or TableSettings(), FANUC)


def macro_formula(
    pretravel_map: PretravelMap,
    form: LookupSeries | LookupSeats,
    settings: TableSettings,
    dialect: MacroDialect,
) -> dict[str, str]:
    """One program that computes the map by its formula, without a table: see `fanuc_macro`."""
    first = dialect.program if settings.program is None else settings.program
    _check_program(first, 2)
    name = f"{first + 1:0{dialect.digits}d}"
    text = render(
        "macro_b/formula.nc",
        **formula_values(pretravel_map, form, settings),
        verified=dialect.verified,
        second=name,
        call=first + 1,
        unit_code=_UNIT_CODES[settings.units],
        angles=dialect.angles,
    )
    return {f"O{name}.nc": text}


def macro_programs(
    pretravel_map: PretravelMap, form: LookupTable, settings: TableSettings, dialect: MacroDialect
) -> dict[str, str]:
    """The programs of `fanuc_macro` in a dialect of Macro B."""
    base = dialect.base if settings.base is None else settings.base
    first = dialect.program if settings.program is None else settings.program
    table = control_table(pretravel_map, form, settings)
    _check_room(dialect.room(base), base, 1 + len(table.values))
    _check_program(first, 2)
    first_name, second_name = (f"{number:0{dialect.digits}d}" for number in (first, first + 1))
    common: dict[str, object] = {
        "statements": table_statements(pretravel_map, table, settings),
        "verified": dialect.verified,
        "table": table,
        "base": base,
        "first": first_name,
        "second": second_name,
        "call": first + 1,
        "units": settings.units,
        "unit_code": _UNIT_CODES[settings.units],
        "angles": dialect.angles,
        "catmull_rom": catmull_rom_text,
    }
    return {
        f"O{first_name}.nc": render("macro_b/table.nc", **common),
        f"O{second_name}.nc": render("macro_b/lookup.nc", **common),
    }
