"""The screens of the workbench, one module each with a function ``show(state)``."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pretravel.app.project import ScreenState


@dataclass(frozen=True)
class Screen:
    """A screen of the workbench.

    Attributes
    ----------
    name : str
        Of its module, its address, and its place in the project.
    person : str
        Whom it serves.
    title : str
        The job.
    summary : str
        What goes in and what comes out.
    icon : str
        Of Material Icons.
    """

    name: str
    person: str
    title: str
    summary: str
    icon: str

    def show(self, state: ScreenState) -> None:
        """Build the screen on the page that is open."""
        import_module(f"{__name__}.{self.name}").show(state)


SCREENS = (
    Screen(
        "engineer",
        "Engineer",
        "Qualify a probe",
        "Touches on a reference sphere in; the probe's lobes, a verdict, and values or programs "
        "for your control out.",
        "radar",
    ),
    Screen(
        "metrologist",
        "Metrologist",
        "Check against a standard",
        "Touches on a calibrated sphere or ring and your limits in; the standard's figures, the "
        "budget and a certificate out.",
        "verified",
    ),
    Screen(
        "laboratory",
        "Laboratory",
        "Calibration rig and separation",
        "Traces of a calibration rig or reversal readings in; pretravel, hysteresis and a "
        "certificate, or machine and probe apart, out.",
        "science",
    ),
    Screen(
        "designer",
        "Designer",
        "Design a probe",
        "Stylus, preload, materials and seats in; force, pretravel and stress over all "
        "directions out, two designs beside each other.",
        "architecture",
    ),
    Screen(
        "part",
        "Part",
        "Measure a part",
        "A part (STEP) and touches on it in; compensated points, deviations and features with "
        "uncertainty out.",
        "view_in_ar",
    ),
)
