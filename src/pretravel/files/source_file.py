"""A file that was opened once: its content, its lines of text, and errors that name it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from pretravel.base import INCH, LARGEST_NUMBER, InputError, PretravelError, RowError

UNITS = {"mm": 1.0, "inch": INCH}
"""Millimetres in each unit of length that a file can have."""
LARGEST_FILE = 1_000_000_000
"""More is not read: a million touches take a fifth of it. [bytes]"""
MOST_LINES = 5_000_000
"""More lines are not read: a line takes up to 500 bytes of memory."""
COUNTED = 20_000
"""Lines of a file after which it is said how many are read: a second of work, about."""
_QUOTED = 60
"""Most characters of a file's text that a message quotes."""


@dataclass(frozen=True)
class SourceFile:
    """The content of a file. The detection of its format and its reader share it.

    Attributes
    ----------
    path : str
        For messages.
    content : bytes
    """

    path: str
    content: bytes

    @property
    def name(self) -> str:
        """Name of the file without its folder."""
        return Path(self.path).name

    @property
    def ending(self) -> str:
        """Ending in lower case, with its dot."""
        return Path(self.path).suffix.lower()

    def error(
        self, message: str, line: int | None = None, *, inputs: tuple[str, ...] = ()
    ) -> InputError:
        """An error that names this file and the line.

        >>> print(SourceFile("a.log", b"").error("the line is cut off", 3))
        a.log, line 3: the line is cut off
        """
        return InputError(message, path=self.path, line=line, inputs=inputs)

    @contextmanager
    def named_in_errors(self, lines: Sequence[int] | None = None) -> Iterator[None]:
        """Errors about values of this file name the file, and the line where it is known.

        Parameters
        ----------
        lines : ints, optional
            The line of each row of the values.
        """
        try:
            yield
        except InputError:
            raise
        except RowError as error:
            if lines is None:
                raise self.error(str(error)) from None
            raise self.error(error.in_file, lines[error.row]) from None
        except PretravelError as error:
            raise self.error(str(error), inputs=error.inputs) from None

    def text(self, what: str) -> tuple[str, str]:
        r"""Return the content as text, and its encoding: UTF-8, UTF-16 or Windows-1252.

        Parameters
        ----------
        what : str
            What the file should be, for messages: "a grbl log".

        Raises
        ------
        InputError
            The file is not a text file, or has more lines than `MOST_LINES`.

        >>> SourceFile("a.csv", "\ufeffµ".encode("utf-16-le")).text("a table")
        ('µ', 'UTF-16')
        """
        if max(self.content.count(b"\n"), self.content.count(b"\r")) > MOST_LINES:
            raise self.error(f"the file has more than {MOST_LINES:,} lines: split it")
        for encoding, name in _encodings(self.content):
            try:
                text = self.content.decode(encoding)
            except UnicodeDecodeError:
                continue
            if "\0" not in text:
                return text.removeprefix("\ufeff"), name
        raise self.error(f"this is not a text file, so not {what}")

    def lines(self, what: str) -> list[str]:
        r"""Return the lines of a text file, without line ends and without a byte-order mark.

        Parameters
        ----------
        what : str
            What the file should be, for messages: "a grbl log".

        Returns
        -------
        list of str

        Raises
        ------
        InputError
            The file is empty or is not a text file.

        >>> SourceFile("a.log", b"G21\r\nG1 X1\n").lines("a log")
        ['G21', 'G1 X1', '']
        """
        text = self.text(what)[0]
        if not text.strip():
            raise self.error(f"the file is empty; {what} is needed")
        return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")

    def numbers(self, cells: Sequence[str], line: int) -> list[float]:
        """Read the cells of a line as finite numbers.

        Raises
        ------
        InputError
            A cell that is not a finite number, or larger than any measured value.

        >>> SourceFile("a.log", b"").numbers(["1", "-.5"], 1)
        [1.0, -0.5]
        """
        values = []
        for cell in cells:
            try:
                value = math.nan if "_" in cell else float(cell)  # 1_0 is ten in Python alone
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                hint = "; use a point as decimal sign" if "," in cell else ""
                raise self.error(f"'{shortened(cell)}' is not a finite number{hint}", line)
            if abs(value) > LARGEST_NUMBER:
                raise self.error(f"'{shortened(cell)}' is larger than any measured value", line)
            values.append(value)
        return values

    def scale(self, units: str | None, reason: str) -> float:
        """Return the millimetres in the unit of a file that does not state its unit.

        Parameters
        ----------
        units : str or None
            mm or inch, as the user states it.
        reason : str
            Why the user must state it, for the message.

        Raises
        ------
        InputError
            No unit is stated, or another one.

        >>> SourceFile("a.log", b"").scale("inch", "")
        25.4
        """
        if units not in UNITS:
            stated = "" if units is None else f"the unit '{units}' is not known: "
            raise self.error(f"{stated}{reason}; give the units, mm or inch", inputs=("units",))
        return UNITS[units]


def shortened(text: str) -> str:
    """A text as a message quotes it.

    >>> shortened("G1 X1"), len(shortened("9" * 5000))
    ('G1 X1', 60)
    """
    return text if len(text) <= _QUOTED else f"{text[: _QUOTED - 1]}…"


def first_few(words: Iterable[object], most: int = 5) -> str:
    """Words for a message: the first ones, and whether there are more.

    >>> first_few([3, 5, 8]), first_few(range(9), 2)
    ('3, 5, 8', '0, 1 …')
    """
    every = list(words)
    return ", ".join(map(str, every[:most])) + (" …" if len(every) > most else "")


def _encodings(content: bytes) -> list[tuple[str, str]]:
    """Encodings to try in turn, each with its name for people."""
    if content[:2] == b"\xff\xfe":
        return [("utf-16-le", "UTF-16")]
    if content[:2] == b"\xfe\xff":
        return [("utf-16-be", "UTF-16")]
    # In UTF-16 without its mark, every second byte of plain text is zero.
    for first, encoding in ((0, "utf-16-be"), (1, "utf-16-le")):
        zeros = content[first::2].count(0)
        if zeros > 0.5 * len(content[first::2]) and not content[1 - first :: 2].count(0):
            return [(encoding, "UTF-16")]
    return [("utf-8", "UTF-8"), ("cp1252", "Windows-1252"), ("latin-1", "Latin-1")]


Source: TypeAlias = str | Path | SourceFile
"""A path, or a file that was opened already."""


def opened(source: Source) -> SourceFile:
    """Open a file: read its content. A file that was opened already stays as it is.

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        The file does not exist, cannot be read or is larger than `LARGEST_FILE`.
    """
    if isinstance(source, SourceFile):
        return source
    try:
        with Path(source).open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise InputError("there is no such file", path=source) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=source) from error
    if len(content) > LARGEST_FILE:
        raise InputError(
            f"the file is larger than {LARGEST_FILE / 1e6:g} MB; no file of readings is: split it",
            path=source,
        )
    return SourceFile(str(source), content)
