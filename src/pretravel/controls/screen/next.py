"""The next step, always in sight, so that nobody has to look for it."""

from __future__ import annotations

from nicegui import ui

from pretravel.app import WORKS, ScreenState, live, text
from pretravel.controls.screen.settings import CONTROL
from pretravel.controls.screen.work import EXPORT, FIT, LOOK


def next_step(state: ScreenState) -> None:
    """Show what to do next; it changes with what is there."""
    works = [WORKS.of(state, job) for job in (LOOK, FIT, EXPORT)]
    with ui.element("div").classes("next-step").props('role="status" aria-live="polite"'):
        live(
            [state.listen, *(work.listen for work in works)],
            lambda: _sentence(state),
            lambda: next_sentence(state),
        )


def _sentence(state: ScreenState) -> None:
    heading, words = next_sentence(state)
    text("strong", heading)
    text("span", words)


def next_sentence(state: ScreenState) -> tuple[str, str]:
    """Heading and sentence of the next step."""
    look, fit, export = (WORKS.of(state, job) for job in (LOOK, FIT, EXPORT))
    if not state.files["touches"]:
        return _FILE
    held = dict.fromkeys((*fit.held, *export.held))
    if held:
        return ("Correct", f"{', '.join(held)}: the value in this field is not valid.")
    if look.error:
        return _UNREADABLE
    diameter = state.settings.get("diameter")
    # With a diameter, that of the touches shows the unit.
    open_question = look.result is not None and (
        look.result.question or (look.result.asked and diameter is None)
    )
    if open_question:
        return _QUESTION
    if diameter is None:
        return _DIAMETER
    if fit.error:
        return _PROBLEM
    if fit.running or fit.result is None:
        return _WAIT
    if state.settings.get("tip_diameter") is None:
        return _TIP
    if CONTROL.value(state.settings, "to") is None:
        return _CONTROL
    if export.error:
        return _FILES_PROBLEM
    return _FILES_WAIT if export.outdated or export.result is None else _READY


_FILE = (
    "Step 1",
    (
        "Drop the file with your touches on the reference sphere. "
        "No file yet? Press “Try it with example data”."
    ),
)
_UNREADABLE = ("Step 1", "The file cannot be read: see the message, or drop another file.")
_QUESTION = ("Step 1", "Answer the question about your file in panel 1.")
_DIAMETER = (
    "Step 2",
    (
        "Type the diameter of the reference sphere in panel 2. "
        "It is on the certificate of the sphere."
    ),
)
_PROBLEM = ("Step 2", "The probe cannot be qualified yet: the message says what to correct.")
_WAIT = ("Please wait", "The probe is being qualified.")
_TIP = (
    "Step 2",
    ("Type the diameter of the tip too: heights are then more certain. Or go on with step 3."),
)
_CONTROL = (
    "Step 3",
    (
        "Choose your control in panel 3. Before that, look at the touches: "
        "a bad one can be unticked."
    ),
)
_FILES_WAIT = ("Please wait", "The files for the control are being made.")
_FILES_PROBLEM = ("Step 3", "The files for the control cannot be made: see the message in panel 3.")
_READY = ("Ready", "Download the values for your control in panel 3.")
