"""The errors that pretravel raises: what was wrong, what came, what to do."""

from __future__ import annotations

from pathlib import Path


class PretravelError(ValueError):
    """Something that the user can put right; its text says what and how.

    The command line prints it without a traceback and exits with code 2.
    """


class InputError(PretravelError):
    """A file that cannot be used as it is, with the place in it.

    >>> print(InputError("column 'nx' is missing", path="touches.csv", line=1))
    touches.csv, line 1: column 'nx' is missing
    """

    def __init__(
        self, message: str, *, path: str | Path | None = None, line: int | None = None
    ) -> None:
        place = "" if path is None else str(path)
        if line is not None:
            place += f"{', ' if place else ''}line {line}"
        super().__init__(f"{place}: {message}" if place else message)


class DescriptionError(PretravelError):
    """A probe that cannot exist as described."""


class ExtrapolationError(PretravelError):
    """A map was asked for directions that no touch or prediction supports."""


class ConvergenceError(PretravelError):
    """An iteration did not keep its promise; the text gives the number it reached."""


class MeshError(PretravelError):
    """Solids that cannot be meshed, or a mesh that cannot be used."""


class CapacityError(PretravelError):
    """Work that this machine has not the memory for; the text gives both numbers."""
