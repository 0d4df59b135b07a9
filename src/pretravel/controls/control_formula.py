"""What the formulas of maps for controls have in common, where a table would be too coarse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, grid
from pretravel.controls.control_table import (
    SLACK_DEG,
    TableSettings,
    check_radii,
    conditions_statements,
    map_statement,
)
from pretravel.controls.gcode import plain_number
from pretravel.controls.lookup_formula import (
    LookupSeats,
    LookupSeries,
    recurrence,
    sectoral_factor,
)
from pretravel.maps import PretravelMap


@dataclass(frozen=True)
class FormulaNumbers:
    """Numbers of a formula as a control reads them: see `ControlTable`."""

    axes: tuple[tuple[str, ...], ...]
    within_deg: tuple[str, str]


def formula_values(
    pretravel_map: PretravelMap, form: LookupSeries | LookupSeats, settings: TableSettings
) -> dict[str, object]:
    """What the templates of a formula use.

    Parameters
    ----------
    pretravel_map : PretravelMap
    form : LookupSeries or LookupSeats
        The formula of that map.
    settings : TableSettings
        Travel, feed and units are used.

    Raises
    ------
    PretravelError
        Numbers that are not those of a touch-trigger probe.
    """
    polar = np.linspace(form.band.lowest, form.band.highest, 10)
    everywhere = grid(polar, np.linspace(0.0, 2.0 * np.pi, 37))
    check_radii(pretravel_map, form.value(everywhere) + settings.travel)
    seats = form if isinstance(form, LookupSeats) else None
    lowest, highest = form.band.lowest / DEGREE, form.band.highest / DEGREE
    rest: Mapping[str, object] = {} if seats is None else seats.template_values()
    return {
        "statements": _statements(pretravel_map, form, settings),
        "numbers": FormulaNumbers(
            tuple(tuple(plain_number(c) for c in axis) for axis in pretravel_map.rotation.T),
            (plain_number(lowest - SLACK_DEG), plain_number(highest + SLACK_DEG)),
        ),
        "units": settings.units,
        "travel": settings.travel,
        "seats": seats,
        "series": form if isinstance(form, LookupSeries) else form.series,
        "sectoral_factor": sectoral_factor,
        "recurrence": recurrence,
        "sunk_at_rest": rest.get("sunk_at_rest", []),
    }


def _statements(
    pretravel_map: PretravelMap, form: LookupSeries | LookupSeats, settings: TableSettings
) -> list[str]:
    band = form.band
    range_deg = f"{band.lowest / DEGREE:.2f} to {band.highest / DEGREE:.2f} degrees"
    error = f"{max(form.largest_error, _ROUNDING) / MICROMETRE:.3f} um"
    radius = float(np.asarray(settings.scaled(pretravel_map.tip_radius)))
    words = form.description.replace(",", " -")
    return [
        map_statement(pretravel_map),
        f"{words}. Largest difference from the map {error}",
        f"holds from {range_deg} from the probe axis. Outside there is an alarm",
        f"units {settings.units}. Tip radius {plain_number(radius)}",
        *conditions_statements(pretravel_map, settings),
        "the normal is a unit vector out of the part - along the axes of the machine",
    ]


_ROUNDING = 0.005 * MICROMETRE
"""Of constants with eight digits. [mm]"""
