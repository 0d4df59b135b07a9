"""Variables and Macro B programs for Fanuc-like controls."""

from __future__ import annotations

from pretravel.controls.gcode import render
from pretravel.controls.lookup import describe_form
from pretravel.controls.lookup_table import LookupTable
from pretravel.errors import PretravelError
from pretravel.maps.kinds.sectors import SECTOR_NAMES
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.sector_tables import resampled_sectors, touched_sectors
from pretravel.units import DEGREE, MICROMETRE

_COMMON = ((101, 199), (500, 999))
"""Common variables; #100 holds the result of the lookup."""
_VECTORS = 10
"""Distance of the first of the eight vector radii from the base variable."""


def _check_variables(base: int, count: int) -> None:
    last = base + count - 1
    if not any(low <= base and last <= high for low, high in _COMMON):
        raise PretravelError(
            f"variables {base} to {last} are not all common ones (#101 to #199, #500 to #999); "
            "the others belong to the control. Choose another first variable",
            inputs=("base",),
        )


def renishaw_variables(
    pretravel_map: PretravelMap,
    *,
    base: int = 500,
    program: int = 9799,
    criterion: str = "max",
    travel: float = 0.0,
) -> str:
    """A program that sets the macro variables of a vector calibration.

    These are two axis radii and eight vector radii.

    Parameters
    ----------
    pretravel_map : PretravelMap
    base : int
        Variable of the X radius, as set in the probing macros.
    program : int
        Number of the program that sets them.
    criterion : str
        See `resampled_sectors`.
    travel : float
        Travel of the machine during the signal delay, for a map of the probe at rest. [mm]

    Returns
    -------
    str
        A program to run once on the control. It does not change the offsets of the stylus
        (base + 2, base + 3).

    Raises
    ------
    PretravelError
        The base is not a common variable; the map does not hold all around the equator.
    """
    _check_variables(base, _VECTORS + 8)
    table = resampled_sectors(pretravel_map, criterion)
    variables = [base, base + 1, *range(base + _VECTORS, base + _VECTORS + 8)]
    names = ["X radius", "Y radius", *(f"{name} degrees" for name in SECTOR_NAMES[2:])]
    radii = pretravel_map.tip_radius - table.pretravel - travel
    return render(
        "renishaw/vector_radii.nc",
        map=pretravel_map,
        program=program,
        base=base,
        last=variables[-1],
        resampled=table,
        touched=touched_sectors(pretravel_map),
        micrometre=MICROMETRE,
        radii=list(zip(variables, radii, names, strict=True)),
    )


def fanuc_macro(
    pretravel_map: PretravelMap,
    form: LookupTable,
    *,
    base: int = 500,
    program: int = 9750,
    travel: float = 0.0,
) -> str:
    """Two Macro B programs: one fills a table, one interpolates it for a direction.

    Parameters
    ----------
    pretravel_map : PretravelMap
    form : LookupTable
        The table of that map.
    base : int
        First common variable of the table.
    program : int
        Number of the program that fills the table; the next number interpolates:
        G65 P9751 I.. J.. K.. (outward unit normal) sets #100 to the pretravel in mm,
        or to -1 where the map does not hold.
    travel : float
        Travel of the machine during the signal delay, for a map of the probe at rest. [mm]

    Returns
    -------
    str
        Not tried on a Fanuc control; another interpreter has run its arithmetic.
    """
    rows, columns = form.values.shape
    _check_variables(base, rows * columns)
    return render(
        "fanuc/lookup.nc",
        map=pretravel_map,
        form=form,
        description=describe_form(form),
        base=base,
        program=program,
        travel=travel,
        lowest_deg=form.band.lowest / DEGREE,
        highest_deg=form.band.highest / DEGREE,
        **form.template_values(),
    )
