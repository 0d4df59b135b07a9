"""Data and cycles for Siemens 840D controls."""

from __future__ import annotations

from pretravel.controls.control import (
    OF_TABLES,
    Control,
    ExportedFiles,
    ExportSettings,
    files_of_form,
    table_or_formula,
)
from pretravel.controls.control_formula import formula_values
from pretravel.controls.control_table import TableSettings, control_table, table_statements
from pretravel.controls.gcode import render
from pretravel.controls.lookup_formula import LookupSeats, LookupSeries
from pretravel.controls.lookup_table import LookupTable, catmull_rom_text
from pretravel.controls.steps import siemens_steps
from pretravel.maps import PretravelMap

MOST_SIEMENS_VALUES = 800
"""Values of a table in the user data of a channel."""
_WRONG_CODES = {"mm": (1, 3), "inch": (2, 4)}
"""Members of the 13th group of G functions (G70, G71, G700, G710) that a unit does not allow."""
_VERIFIED = (
    "not yet tried on a Siemens control - test with care",
    "its arithmetic was tested with the interpreter of pretravel",
)


def siemens_cycle(
    pretravel_map: PretravelMap, form: LookupTable, settings: TableSettings | None = None
) -> dict[str, str]:
    """User data, a program that fills them, and a cycle that interpolates for a direction.

    Parameters
    ----------
    pretravel_map : PretravelMap
    form : LookupTable
        The table of that map.
    settings : TableSettings, optional
        Travel, feed and units are used.

    Returns
    -------
    dict of str to str
        Texts by file name. ``PRETRAVEL(NX,NY,NZ)`` with the outward unit normal sets PT_VALUE to
        the pretravel, or raises an alarm where `macro_b.macro_programs` do. Not tried on a Siemens
        control.

    Raises
    ------
    PretravelError
        Numbers that are not those of a touch-trigger probe.
    """
    settings = settings or TableSettings()
    table = control_table(pretravel_map, form, settings)
    common: dict[str, object] = {
        "statements": [*table_statements(pretravel_map, table, settings), *_VERIFIED],
        "table": table,
        "units": settings.units,
        "wrong_codes": _WRONG_CODES[settings.units],
        "catmull_rom": _weights,
    }
    return {
        "PRETRAVEL_GUD.DEF": render("siemens/gud.def", **common),
        "PRETRAVEL_TABLE.SPF": render("siemens/table.spf", **common),
        "PRETRAVEL.SPF": render("siemens/lookup.spf", **common),
    }


def siemens_formula(
    pretravel_map: PretravelMap,
    form: LookupSeries | LookupSeats,
    settings: TableSettings | None = None,
) -> dict[str, str]:
    """The cycle of `siemens_cycle`, which computes the map by its formula, and its user data."""
    settings = settings or TableSettings()
    values = formula_values(pretravel_map, form, settings)
    statements = values["statements"]
    assert isinstance(statements, list)
    values["statements"] = [*statements, *_VERIFIED]
    values["wrong_codes"] = _WRONG_CODES[settings.units]
    return {
        "PRETRAVEL_GUD.DEF": render("siemens/gud.def", table=None, **values),
        "PRETRAVEL.SPF": render("siemens/formula.spf", **values),
    }


def _weights(share: str) -> list[str]:
    return [text.replace("[", "(").replace("]", ")") for text in catmull_rom_text(share)]


def _siemens(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    form = table_or_formula(pretravel_map, settings, MOST_SIEMENS_VALUES)
    if isinstance(form, LookupTable):
        texts = siemens_cycle(pretravel_map, form, settings.table)
        return files_of_form(pretravel_map, texts, form, settings)
    texts = siemens_formula(pretravel_map, form, settings.table)
    return files_of_form(pretravel_map, texts, form, settings, obsolete=("PRETRAVEL_TABLE.SPF",))


TO_SIEMENS = Control(
    _siemens, "Siemens 840D (cycle)", siemens_steps, folder=True, options=OF_TABLES | {"form"}
)
