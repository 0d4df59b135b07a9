"""The screens of the workbench: each is a function ``show(state)`` in the folder of its task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pretravel.app.page_words import title_of
from pretravel.base import object_at

if TYPE_CHECKING:
    from pretravel.app.project import ScreenState


@dataclass(frozen=True)
class Screen:
    """A screen of the workbench.

    Attributes
    ----------
    name : str
        Its address, and its place in the project.
    short : str
        The job in a word, for a narrow menu.
    title : str
        The job.
    summary : str
        What goes in and what comes out.
    icon : str
        Of Material Icons.
    place : str
        Module and function that builds it.
    jobs : tuple of str
        Places of the jobs whose progress the start page follows; the first makes a map.
    next_step : str
        Place of the function that states the next step, heading and words, where there is one.
    """

    name: str
    short: str
    title: str
    summary: str
    icon: str
    place: str = ""
    jobs: tuple[str, ...] = ()
    next_step: str = ""

    def show(self, state: ScreenState) -> None:
        """Build the screen on the page that is open."""
        object_at(self.place)(state)


SCREENS = (
    Screen(
        "engineer",
        "Qualify",
        "Qualify a probe",
        "From touches on a reference sphere: the probe's lobes, a verdict, and values or "
        "programs for your control.",
        "radar",
        "pretravel.controls.screen.engineer:show",
        ("pretravel.controls.screen:FIT", "pretravel.controls.screen:EXPORT"),
        "pretravel.controls.screen:next_sentence",
    ),
    Screen(
        "daily",
        "Daily",
        "Daily check",
        "From today's touches on the reference: whether the probe has changed, the chart of all "
        "days, and the date to qualify again.",
        "today",
        "pretravel.tasks.verify.screen:show",
        ("pretravel.tasks.verify:DAILY",),
    ),
    Screen(
        "metrologist",
        "Standard",
        "Check against a standard",
        "From touches on a calibrated sphere or ring: the values that a standard defines, with "
        "your limits, the budget and a certificate.",
        "verified",
        "pretravel.laboratory.tasks.check.screen:show",
    ),
    Screen(
        "laboratory",
        "Rig",
        "Calibration rig and separation",
        "From traces of a calibration rig: pretravel, hysteresis and a certificate. From "
        "reversal readings: the errors of machine and probe.",
        "science",
        "pretravel.laboratory.tasks.rig.screen:show",
    ),
    Screen(
        "designer",
        "Design",
        "Design a probe",
        "From stylus, preload, materials and seats: force, pretravel and stress over all "
        "directions, of two designs next to each other.",
        "architecture",
        "pretravel.design.screen.designer:show",
    ),
    Screen(
        "part",
        "Part",
        "Measure a part",
        "From a part (STEP) and touches on it: compensated points, deviations, and features with "
        "their uncertainty.",
        "view_in_ar",
        "pretravel.drawing.screen.part:show",
        next_step="pretravel.drawing.screen.next_of_part:next_of_part",
    ),
)


QUALIFYING = next(screen for screen in SCREENS if screen.name == "engineer")
"""The screen that makes a map of touches; other screens take it from there."""
EVERY_MORNING = next(screen for screen in SCREENS if screen.name == "daily")
"""The screen of every morning: it stands first on the start page when there is a map."""


def title_of_screen(name: str) -> str:
    """What a screen is called; those of tasks by the command.

    >>> title_of_screen("engineer"), title_of_screen("task-plan-touches")
    ('Qualify a probe', 'Plan touches')
    """
    titles = {screen.name: screen.title for screen in SCREENS}
    return titles.get(name) or title_of(name.removeprefix("task-"))
