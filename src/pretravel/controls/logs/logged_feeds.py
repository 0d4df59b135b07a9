"""Probing moves that a sender wrote into a log: feeds of touches, and moves away from a surface."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import INCH, FloatArray
from pretravel.files import FilePositions, RowStatement, first_few, without_comments

SPINDLE = RowStatement(
    "`M19` with an angle",
    r"[^;(]*?(?<![A-Z\d])(M19\s*+[A-Z]\s*+[-+]?[\d.]+|S\s*+[\d.]++\s*+M19\b)",
    "orientation", "carried", "M19 S90",
)  # fmt: skip
"""Orientation of the spindle, in a line that was sent."""

_REPORTS = re.compile(r"<[^<>]*>|\[(?!GC:)[A-Za-z0-9.]+:[^\[\]]*\]")
"""What the control reports, in which F has another meaning."""
_MOVE = re.compile(r"G38\.([2-5])(?!\d)", re.IGNORECASE)
_AWAY = "45"
"""G38.4 and G38.5 move until the contact ends."""
_ORDER = re.compile(r"(?<![A-Z])G\d|^\W*F\s*\d", re.IGNORECASE)
_FEED = re.compile(r"(?<![A-Z])F\s*(\d{1,9}(?:\.\d{0,9})?)(?![\d.])", re.IGNORECASE)
_AXIS = re.compile(r"(?<![A-Z])([XYZ])\s*[-+.\d]")
_UNITS = re.compile(r"(?<![A-Z])G2([01])(?![\d.])", re.IGNORECASE)


@dataclass
class LoggedFeeds:
    """The probing moves of a log, each with the feed that was active.

    A sender may write several moves before the first of them is reported.

    Attributes
    ----------
    moves : list of line and feed
        The feed is None where the log has not stated one yet. [unit of the program per minute]
    inch : bool or None
        Unit of the program; None: not stated.
    away : set of int
        Lines of the moves that end where the contact does.
    axes : dict of int to str
        Letters of the axes that each move names, by its line.
    """

    moves: list[tuple[int, float | None]] = field(default_factory=list)
    inch: bool | None = None
    active: float | None = None
    away: set[int] = field(default_factory=set)
    axes: dict[int, str] = field(default_factory=dict)

    def take(self, text: str, number: int) -> None:
        """Read a line of the log.

        >>> feeds = LoggedFeeds()
        >>> feeds.take(">>> G21 G38.2 Z-10 F500", 1)
        >>> feeds.take("[PRB:0.000,0.000,-5.012:1]", 2)
        >>> feeds.moves, feeds.inch
        ([(1, 500.0)], False)
        """
        code = without_comments(_REPORTS.sub(" ", text)).partition(";")[0]
        if not _ORDER.search(code):
            return
        for unit in _UNITS.findall(code):
            self.inch = unit == "0"
        for feed in _FEED.findall(code):
            self.active = float(feed) or None
        if move := _MOVE.search(code):
            self.moves.append((number, self.active))
            self.axes[number] = "".join(sorted({*_AXIS.findall(code[move.end() :].upper())}))
            self.away |= {number} if move[1] in _AWAY else set()

    def _of_each(self, reports: Sequence[int]) -> list[list[tuple[int, float | None]]]:
        """The moves to which each report can belong."""
        if len(self.moves) == len(reports) and all(
            move <= report for (move, _), report in zip(self.moves, reports, strict=True)
        ):
            return [[move] for move in self.moves]
        before = (0, *reports)
        return [
            [move for move in self.moves if start < move[0] <= report]
            for start, report in zip(before, reports, strict=False)
        ]

    def applied(self, found: FilePositions) -> FilePositions:
        """Positions without those at which a contact ended, and what was understood of the moves.

        Where all are such, they stay: the probe's signal is inverted, perhaps.
        """
        moves = self._of_each(found.lines)
        away = [bool(of) and all(line in self.away for line, _ in of) for of in moves]
        told: tuple[str, ...] = ()
        if away and all(away):
            told = ("all moves are G38.4 or G38.5: the positions are where a contact ended",)
        elif any(away):
            lines = first_few(line for line, left in zip(found.lines, away, strict=True) if left)
            told = (f"left out, since a contact ended there (G38.4, G38.5): line {lines}",)
            found = found.take(~np.array(away))
        warnings = (*found.warnings, *told)
        letters = [{self.axes[line] for line, _ in of} for of in self._of_each(found.lines)]
        axes = tuple(each.pop() if len(each) == 1 else "" for each in letters)
        understood = self.sentence(found.feeds)
        return replace(found, understood=understood, axes=axes, warnings=warnings)

    def of(self, reports: Sequence[int], scale: float) -> FloatArray | None:
        """Return the feed of each report, (n,); None where one of them is not known. [mm/min]

        Moves and reports belong together in turn where there are as many, each report after its
        move; else a report has the feed of the moves since the report before, if that is one.

        Parameters
        ----------
        reports : sequence of int
            Lines of the reports.
        scale : float
            Millimetres in the unit of the reports: that of the feeds, where the log states none.

        >>> LoggedFeeds([(1, 500.0), (2, 100.0)]).of([3, 4], 1.0).tolist()
        [500.0, 100.0]
        """
        feeds = [{feed for _, feed in moves} for moves in self._of_each(reports)]
        found = [each.pop() if len(each) == 1 else None for each in feeds]
        known = [feed for feed in found if feed is not None]
        if len(known) < len(reports):
            return None
        unit = scale if self.inch is None else INCH if self.inch else 1.0
        return unit * np.array(known)

    def sentence(self, feeds: FloatArray | None) -> str:
        """How the feeds were understood, in one line; empty for a log without probing moves."""
        if not self.moves:
            return ""
        if feeds is None:
            return "the log does not give the feed of each touch: feeds are not read"
        values = ", ".join(f"{value:g}" for value in sorted(set(feeds.round(6).tolist()))[:8])
        unit = "" if self.inch is not None else " (taken in the unit of the reports)"
        return f"feeds of the moves G38: {values} mm/min{unit}"
