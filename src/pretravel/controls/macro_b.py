"""Macro B programs for Fanuc-like controls."""

from __future__ import annotations

from dataclasses import dataclass

from pretravel.base import PretravelError
from pretravel.controls.control import (
    OF_TABLES,
    Control,
    ExportedFiles,
    ExportSettings,
    files_of_form,
    table_or_formula,
)
from pretravel.controls.control_formula import formula_values
from pretravel.controls.control_table import (
    TableSettings,
    control_table,
    table_statements,
)
from pretravel.controls.gcode import render
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries
from pretravel.controls.lookup_table import LookupTable, catmull_rom_text
from pretravel.controls.steps import macro_b_steps
from pretravel.maps import (
    PretravelMap,
)

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


def free_variables(ranges: tuple[tuple[int, int], ...], base: int) -> int:
    """Number of variables from a first one to the end of its range.

    Parameters
    ----------
    ranges : tuple of (int, int)
        First and last variables that may be used.
    base : int

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


def check_room(room: int, base: int, count: int) -> None:
    """Refuse more variables than belong to the user."""
    if count > room:
        raise PretravelError(
            f"{count} variables from #{base} would end at #{base + count - 1}; the last one that "
            f"belongs to the user is #{base + room - 1}. Choose another first variable",
            inputs=("base",),
        )


def check_program(program: int, count: int) -> None:
    """Refuse the number of the first of some programs, where one of them has no number."""
    if not 1 <= program <= 9999 - count + 1:
        raise PretravelError(
            f"program number {program}: it must be from 1 to {9999 - count + 1}",
            inputs=("program",),
        )


def macro_formula(
    pretravel_map: PretravelMap,
    form: LookupSeries | LookupSeats,
    settings: TableSettings,
    *,
    dialect: MacroDialect,
) -> dict[str, str]:
    """One program that computes the map by its formula, without a table: see `macro_programs`."""
    first = dialect.program if settings.program is None else settings.program
    check_program(first, 2)
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
    pretravel_map: PretravelMap,
    form: LookupTable,
    settings: TableSettings | None = None,
    *,
    dialect: MacroDialect,
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
    dialect : MacroDialect

    Returns
    -------
    dict of str to str
        A program for each file name. Not tried on a control; other interpreters have run the
        arithmetic.

    Raises
    ------
    PretravelError
        The variables do not belong to the user.
    """
    settings = settings or TableSettings()
    base = dialect.base if settings.base is None else settings.base
    first = dialect.program if settings.program is None else settings.program
    table = control_table(pretravel_map, form, settings)
    check_room(dialect.room(base), base, 1 + len(table.values))
    check_program(first, 2)
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


_MOST_VALUES = 399


def macro_b_control(dialect: MacroDialect, base: str) -> Control:
    """A control with Macro B: with a table, or with the formula where the table would be coarse.

    Parameters
    ----------
    dialect : MacroDialect
    base : str
        Its first variable, in words.
    """

    def files(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
        first = dialect.base if settings.base is None else settings.base
        # One variable contains the number of the table.
        most_values = min(dialect.room(first) - 1, _MOST_VALUES)
        form = table_or_formula(pretravel_map, settings, most_values)
        if isinstance(form, LookupTable):
            texts = macro_programs(pretravel_map, form, settings.table, dialect=dialect)
        else:
            texts = macro_formula(pretravel_map, form, settings.table, dialect=dialect)
        return files_of_form(pretravel_map, texts, form, settings)

    return Control(
        files,
        f"{dialect.name} (macro programs)",
        macro_b_steps(dialect.name),
        folder=True,
        options=OF_TABLES | {"base", "program", "form"},
        usual={
            "base": base,
            "program": f"{dialect.program} (table, if needed; lookup {dialect.program + 1})",
        },
    )
