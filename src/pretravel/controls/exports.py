"""The controls that a map can be exported to, and what each of them will subtract."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pretravel.base import DEGREE, FloatArray, Plugins, PretravelError, delay_travel, polar_angle
from pretravel.controls.control import Control, ExportSettings
from pretravel.controls.control_table import SLACK_DEG
from pretravel.controls.lookup_table import LookupTable
from pretravel.maps import PretravelMap

CONTROLS: Plugins[Control] = Plugins(
    "pretravel.controls",
    own={
        "linuxcnc": "pretravel.controls.linuxcnc_subroutines:TO_LINUXCNC",
        "renishaw": "pretravel.controls.renishaw:TO_RENISHAW",
        "fanuc": "pretravel.controls.fanuc:TO_FANUC",
        "haas": "pretravel.controls.haas:TO_HAAS",
        "siemens": "pretravel.controls.siemens:TO_SIEMENS",
        "heidenhain": "pretravel.controls.heidenhain:TO_HEIDENHAIN",
        "radii": "pretravel.controls.axis_radii:TO_RADII",
    },
)
"""Controls by name."""


def correction_on_control(
    pretravel_map: PretravelMap, to: str, settings: ExportSettings
) -> tuple[str, Callable[[FloatArray], FloatArray]]:
    """The pretravel that a control will subtract, by its own formula or interpolation.

    Parameters
    ----------
    pretravel_map : PretravelMap
    to : str
        Name of the control.
    settings : ExportSettings
        Those of the export.

    Returns
    -------
    name : str
        The control and its form, in words.
    correction : callable
        Pretravel (n,) of outward normals (n, 3), machine frame; nan where there is an alarm. [mm]

    Raises
    ------
    PretravelError
        A control that takes radii off; an unknown one.
    """
    if to not in CONTROLS:
        known = ", ".join(CONTROLS)
        raise PretravelError(f"control '{to}' is not known; there are {known}", inputs=("for",))
    form = CONTROLS[to].files(pretravel_map, settings).form
    if form is None:
        raise PretravelError(
            f"the files for {to} contain radii, not a map. The errors that the radii leave are in "
            "the rows 'two axis radii' and 'sector table'",
            inputs=("for",),
        )

    def correction(normals: FloatArray) -> FloatArray:
        directions = pretravel_map.probe_directions(normals)
        polar, slack = polar_angle(directions), SLACK_DEG * DEGREE
        held = (polar >= form.band.lowest - slack) & (polar <= form.band.highest + slack)
        return np.where(held, form.value(directions), np.nan)

    table = isinstance(form, LookupTable)
    return f"{to}, {form.description.partition(',')[0] if table else 'formula'}", correction


def table_travel(pretravel_map: PretravelMap, feed: float | None) -> float:
    """Delay travel that a table for one feed contains.

    Parameters
    ----------
    pretravel_map : PretravelMap
    feed : float or None
        Measuring feed; necessary where the map contains the signal delay. [mm/min]

    Returns
    -------
    float
        [mm]

    Raises
    ------
    PretravelError
        The map contains the signal delay and no feed is given, or the other way round.
    """
    if pretravel_map.delay is None:
        if feed is not None:
            raise PretravelError(
                "a feed is only necessary for a map that contains the signal delay; this map "
                "contains none",
                inputs=("feed",),
            )
        return 0.0
    if feed is None:
        raise PretravelError(
            "this map does not contain the travel during the signal delay of "
            f"{1e3 * pretravel_map.delay:.3f} ms, which a table contains for one feed: give the "
            "measuring feed",
            inputs=("feed",),
        )
    return delay_travel(feed, pretravel_map.delay)
