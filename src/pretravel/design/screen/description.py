"""The description of a design as a file, and the lines that read it once it is saved."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from pretravel.app import ScreenState, Work, note, prepared_button, same_elsewhere
from pretravel.design.screen.work import DESIGN_FILE, ComparedDesigns, digest_of
from pretravel.task import Task

_SAVED = "saved_description"
_BUTTON = "Description (.toml)"


def description_button(state: ScreenState, work: Work[ComparedDesigns]) -> None:
    """A button that saves the description of the design; the page knows then that it is a file.

    Parameters
    ----------
    state : ScreenState
    work : Work
        With `ComparedDesigns`.
    """

    async def newest() -> Callable[[Path], object]:
        result: ComparedDesigns = (await work.finished()).result
        state.settings[_SAVED] = [digest_of(result.text()), result.digest()]
        return lambda path: path.write_text(result.text(), encoding="utf-8")

    prepared_button(_BUTTON, DESIGN_FILE, newest)


def is_saved(state: ScreenState, digest: str) -> bool:
    """Whether somebody has saved a design as it is now.

    Parameters
    ----------
    state : ScreenState
    digest : str
        Of its description, or of the one without a name that the user gave it.
    """
    return digest in (state.settings.get(_SAVED) or ())


def same_of_design(state: ScreenState, source: str, digest: str, *tasks: Task) -> None:
    """The commands and Python lines that do the same; not before the file that they read is there.

    Parameters
    ----------
    state : ScreenState
    source : str
        How the commands call the design.
    digest : str
        See `is_saved`.
    tasks : Task
    """
    if source == DESIGN_FILE and not is_saved(state, digest):
        note(
            "The same on the command line and in Python: commands read the design from a file. "
            f"Save it first, with the button {_BUTTON}; the lines then appear here."
        )
    else:
        same_elsewhere(*tasks)
