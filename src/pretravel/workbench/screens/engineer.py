"""Engineer: touches on a reference → map, verdict, values for the control."""

from __future__ import annotations

from pretravel.workbench.components.layout import note
from pretravel.workbench.project import ScreenState


def show(state: ScreenState) -> None:
    """Build the screen."""
    del state
    note("This screen is being made.")
