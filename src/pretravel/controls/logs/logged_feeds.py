"""Feeds of the touches of a log: the F words of the probing moves that a sender wrote into it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import INCH, FloatArray
from pretravel.files import without_comments

_REPORTS = re.compile(r"<[^<>]*>|\[(?!GC:)[A-Za-z0-9.]+:[^\[\]]*\]")
"""What the control reports, in which F has another meaning."""
_MOVE = re.compile(r"G38\.[2-5](?!\d)", re.IGNORECASE)
_ORDER = re.compile(r"(?<![A-Z])G\d|^\W*F\s*\d", re.IGNORECASE)
_FEED = re.compile(r"(?<![A-Z])F\s*(\d{1,9}(?:\.\d{0,9})?)(?![\d.])", re.IGNORECASE)
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
    """

    moves: list[tuple[int, float | None]] = field(default_factory=list)
    inch: bool | None = None
    active: float | None = None

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
        if _MOVE.search(code):
            self.moves.append((number, self.active))

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
        found: list[float | None] = []
        if len(self.moves) == len(reports) and all(
            move <= report for (move, _), report in zip(self.moves, reports, strict=True)
        ):
            found = [feed for _, feed in self.moves]
        else:
            before = 0
            for report in reports:
                feeds = {feed for line, feed in self.moves if before < line <= report}
                found.append(feeds.pop() if len(feeds) == 1 else None)
                before = report
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
