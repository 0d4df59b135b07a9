"""Engineer: touches on a reference → map, verdict, values for the control."""

from __future__ import annotations

from collections.abc import Mapping

from pretravel.app import (
    ScreenState,
    SettingValue,
    example_button,
    file_drop,
    folded,
    load_plots_ahead,
    panel,
    screen_places,
    task_links,
)
from pretravel.controls.screen.control import control_panel
from pretravel.controls.screen.inputs import no_touches_yet, reference_panel, understood
from pretravel.controls.screen.next import next_step
from pretravel.controls.screen.results import results
from pretravel.controls.screen.settings import QUALIFICATION
from pretravel.controls.screen.work import FIT, LOOK

EXAMPLE: Mapping[str, SettingValue] = {
    **QUALIFICATION.defaults,
    "diameter": 24.9987,
    "tip_diameter": 6.0,
}
"""Settings that belong to the example data."""
_OTHER_WAYS = {
    "qualify": "A ring, a pin or a bore, a block, several references in one fit, a star stylus",
    "plan-touches": "Which touches on a block, or for an old map",
    "repeat": "A log alone: noise, drift and what the next touch will be",
    "reversal": "Touches at 0° and 180° of the spindle: without run-out and odd lobes",
    "orientation": "An indexing head in another orientation",
    "verify": "Is the map of last week still true?",
}
"""Tasks with screens of their own, by what somebody has who has no sphere, or more than one tip."""


def show(state: ScreenState) -> None:
    """Build the screen."""
    load_plots_ahead()
    next_step(state)
    places = screen_places()
    with places.inputs:
        with panel("1 Touches"):
            file_drop(
                state,
                "touches",
                "Touches on the reference sphere",
                hint="Drop or choose a table (CSV, TXT …) or a log of the control",
            )
            example_button(state, {"touches": ["sphere_touches.csv"]}, EXAMPLE, ahead=(LOOK, FIT))
            understood(state)
            no_touches_yet()
        reference_panel(state)
        control_panel(state)
        with folded("No sphere, several tips, a log alone"):
            task_links(_OTHER_WAYS)
    results(state, places)
