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
        "Touches on a reference sphere in; the probe's lobes, a verdict, and values or programs "
        "for your control out.",
        "radar",
        "pretravel.controls.screen.engineer:show",
        ("pretravel.controls.screen:FIT", "pretravel.controls.screen:EXPORT"),
        "pretravel.controls.screen:next_sentence",
    ),
    Screen(
        "daily",
        "Daily",
        "Daily check",
        "Today's touches on the reference in; whether the probe has changed, all days, and the "
        "date to qualify again out.",
        "today",
        "pretravel.tasks.verify.screen:show",
        ("pretravel.tasks.verify:DAILY",),
    ),
    Screen(
        "metrologist",
        "Standard",
        "Check against a standard",
        "Touches on a calibrated sphere or ring and your limits in; the standard's figures, the "
        "budget and a certificate out.",
        "verified",
        "pretravel.laboratory.tasks.check.screen:show",
    ),
    Screen(
        "laboratory",
        "Rig",
        "Calibration rig and separation",
        "Traces of a calibration rig or reversal readings in; pretravel, hysteresis and a "
        "certificate, or machine and probe apart, out.",
        "science",
        "pretravel.laboratory.tasks.rig.screen:show",
    ),
    Screen(
        "designer",
        "Design",
        "Design a probe",
        "Stylus, preload, materials and seats in; force, pretravel and stress over all "
        "directions out, two designs next to each other.",
        "architecture",
        "pretravel.design.screen.designer:show",
    ),
    Screen(
        "part",
        "Part",
        "Measure a part",
        "A part (STEP) and touches on it in; compensated points, deviations and features with "
        "uncertainty out.",
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
