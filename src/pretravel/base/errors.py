"""The errors that pretravel raises: what is wrong, what was given, what to do."""

from __future__ import annotations

from pathlib import Path

_HALF = 1000
"""Signs of each half of the longest message."""


class PretravelError(ValueError):
    """A fault that the user can correct; the text says what is wrong and what to do.

    The command line prints the text without a traceback and exits with code 2.

    Parameters
    ----------
    message : str
        It speaks of quantities, not of options of the command line. It can quote a file: control
        characters are shown as text, and a long message loses its middle.
    inputs : tuple of str
        Names of the inputs that can correct the fault, as the parameters of the Python functions
        are called. The command line adds its options of these names to the message.

    >>> PretravelError("the tip's diameter is -3 mm", inputs=("tip_diameter",)).inputs
    ('tip_diameter',)
    """

    exit_code = 2
    """Of the command line."""

    def __init__(self, message: str = "", *, inputs: tuple[str, ...] = ()) -> None:
        super().__init__(_for_people(message))
        self.inputs = inputs


def _for_people(message: str) -> str:
    """A message without control characters, which a terminal would obey, and of bounded length."""
    if len(message) > 2 * _HALF:
        message = f"{message[:_HALF]} … {message[-_HALF:]}"
    if message.replace("\n", "").isprintable():
        return message
    return "".join(
        sign if sign.isprintable() or sign == "\n" else sign.encode("unicode_escape").decode()
        for sign in message
    )


class InputError(PretravelError):
    """A file that cannot be used as it is; the message names the file and the line.

    >>> print(InputError("column 'nx' is missing", path="touches.csv", line=1))
    touches.csv, line 1: column 'nx' is missing
    """

    def __init__(
        self,
        message: str,
        *,
        path: str | Path | None = None,
        line: int | None = None,
        inputs: tuple[str, ...] = (),
    ) -> None:
        place = "" if path is None else str(path)
        if line is not None:
            place += f"{', ' if place else ''}line {line}"
        super().__init__(f"{place}: {message}" if place else message, inputs=inputs)


class StaleTouchesError(InputError):
    """Touches that are not those of a new, whole run: they say nothing of the probe today.

    The command line exits with code 3: a script that checks the probe must notice it.
    """

    exit_code = 3


class RowError(PretravelError):
    """A row of an array that cannot be used.

    A reader of files replaces the row by the line of its file.

    Parameters
    ----------
    message : str
        It names the row.
    row : int
        From 0.
    in_file : str
        The message in addition to a file and its line, which name the row.

    >>> error = RowError("normals: row 2 is zero", 1, in_file="the normal is zero")
    >>> error.row, error.in_file
    (1, 'the normal is zero')
    """

    def __init__(self, message: str, row: int, *, in_file: str) -> None:
        super().__init__(message)
        self.row = row
        self.in_file = in_file


class DescriptionError(PretravelError):
    """A probe that cannot exist as described."""


class ExtrapolationError(PretravelError):
    """A direction outside those that the touches or the prediction of a map cover."""


class ConvergenceError(PretravelError):
    """An iteration that did not converge; the text states the residual that it reached."""


class MeshError(PretravelError):
    """Solids that cannot be meshed, or a mesh that cannot be used."""


class CapacityError(PretravelError):
    """A computation that needs more memory than there is; the text states both numbers."""
