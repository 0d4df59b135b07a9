"""Heights that a firmware logs while it touches along z: collected line by line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pretravel.files.file_format import FileReadings
from pretravel.files.source_file import SourceFile
from pretravel.touches import Touches


@dataclass
class LoggedHeights:
    """Touches of a log so far; each belongs to a series, such as one order to touch ten times.

    Attributes
    ----------
    file : SourceFile
    positions : list of x, y, z
        [mm]
    labels : list of str
        Series, a slash, and the number in it from 1.
    lines : list of int
    unplaced : int or None
        The first line of a height without x and y, which are zero then.
    """

    file: SourceFile
    positions: list[list[float]] = field(default_factory=list)
    labels: list[str] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    unplaced: int | None = None
    _series: Counter[str] = field(default_factory=Counter)
    _touches: Counter[str] = field(default_factory=Counter)

    def new_series(self, kind: str) -> str:
        """Name of another series of a kind: accuracy 1, accuracy 2 …."""
        self._series[kind] += 1
        return f"{kind} {self._series[kind]}"

    def take(self, series: str, cells: Sequence[str], line: int) -> None:
        """Take a touch: x, y and z, or z alone."""
        values = self.file.numbers(cells, line)
        if len(values) == 1:
            values = [0.0, 0.0, *values]
            self.unplaced = self.unplaced or line
        self._touches[series] += 1
        self.positions.append(values)
        self.labels.append(f"{series}/{self._touches[series]}")
        self.lines.append(line)

    def readings(self, nothing: str, *, look_only: bool = True) -> FileReadings:
        """The touches, with normals along z.

        Parameters
        ----------
        nothing : str
            The message where there are none.
        look_only : bool
            Whether the place of the touches does not matter.

        Raises
        ------
        InputError
            No touches; heights without a place where it matters.
        """
        if not self.positions:
            raise self.file.error(nothing)
        if self.unplaced is not None and not look_only:
            raise self.file.error(
                "the log states a height without x and y, so that no point can be made of it. "
                "pretravel repeat judges how such touches repeat",
                self.unplaced,
            )
        with self.file.named_in_errors(self.lines):
            touches = Touches(
                np.array(self.positions),
                np.tile([0.0, 0.0, 1.0], (len(self.positions), 1)),
                labels=tuple(self.labels),
                source=self.file.name,
                lines=tuple(self.lines),
            )
        return FileReadings(touches)
