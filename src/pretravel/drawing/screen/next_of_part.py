"""What to do next on the screen of a part: one sentence at the top."""

from __future__ import annotations

from nicegui import ui

from pretravel.app import WORKS, ScreenState, live, text
from pretravel.drawing.screen.tolerance_table import rows_in
from pretravel.drawing.screen.work import COMPENSATION, FEATURES, lacking_for_points


def guide_of_part(state: ScreenState) -> None:
    """Show what to do next; it changes with what is there."""
    works = [WORKS.of(state, job) for job in (COMPENSATION, FEATURES)]
    with ui.element("div").classes("next-step").props('role="status" aria-live="polite"'):
        live(
            [state.listen, *(work.listen for work in works)],
            lambda: _sentence(state),
            lambda: next_of_part(state),
        )


def _sentence(state: ScreenState) -> None:
    heading, words = next_of_part(state)
    text("strong", heading)
    text("span", words)


def next_of_part(state: ScreenState) -> tuple[str, str]:
    """Heading and sentence of the next step."""
    points, features = (WORKS.of(state, job) for job in (COMPENSATION, FEATURES))
    if not state.files["touches"]:
        return _TOUCHES
    lacking = lacking_for_points(state)
    if lacking:
        words = lacking.removeprefix("Next: ")
        return ("Next", words[:1].upper() + words[1:])
    if points.error:
        elsewhere = state.files["part"] and not state.settings.get("aligned")
        return _ELSEWHERE if elsewhere else _REFUSED
    if points.running or points.result is None:
        return _WAIT
    if not rows_in(state) and not state.files["drawing"] and features.result is None:
        return _TOLERANCES if points.result.part is not None else _LABELS
    if features.running:
        return _WAIT
    if features.error:
        return _CORRECT
    if features.result is None or features.outdated:
        return _MEASURE
    if not state.settings.get("measure_u_machine_um"):
        return _MACHINE
    return _READY


_TOUCHES = (
    "Step 1",
    (
        "Drop the touches on the part: a log of the control, or a table. "
        "No file yet? Press “Example of a part that lies anywhere”."
    ),
)
_ELSEWHERE = (
    "Step 3",
    (
        "The touches are not on the part where it lies in its file. "
        "Press “Find the part”, or see the message."
    ),
)
_REFUSED = ("Step 1", "The touches cannot be used yet: the message says what to correct.")
_WAIT = ("Please wait", "The touches are being computed.")
_TOLERANCES = (
    "Step 4",
    (
        "Fill the table from the model or the drawing, or take a row for each touched face "
        "and type its limits."
    ),
)
_LABELS = ("Step 4", "Choose what is measured, type the limits, and press “Measure”.")
_MEASURE = ("Step 5", "Press “Measure”.")
_CORRECT = ("Step 4", "A tolerance cannot be read: the message says what to correct.")
_MACHINE = (
    "Step 5",
    (
        "Type u of the machine: without it U contains the errors of probing alone, "
        "and nothing is called conforming."
    ),
)
_READY = ("Ready", "The verdict is above the table, and the PDF below it.")
