"""Progress of long work, on stderr: the stage, the time since its beginning, and what is left."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.text import Text

_SHORT = 2.0
"""Work that takes less shows no time. [s]"""
_ENOUGH = 0.25
"""Part of the work that must be done before the time that is left is estimated from it."""


@dataclass
class WorkClock:
    """The times of one piece of work.

    The library logs its stages. A stage whose record has ``extra={"done": 0.4}`` states the part of
    the work that is done when it begins; from this the time that is left is estimated.

    Attributes
    ----------
    began : float
        On a clock that does not jump. [s]
    what : str
        Description of the work.
    stage : str
        What is done now; empty at the beginning.
    end : float or None
        Estimate; None while nothing is known. [s]
    """

    began: float
    what: str
    stage: str = ""
    end: float | None = None
    _done: float = 0.0
    _counted_from: float = field(init=False)

    def __post_init__(self) -> None:
        self._counted_from = self.began

    def next_stage(self, stage: str, done: float | None, now: float) -> None:
        """Begin a stage.

        Parameters
        ----------
        stage : str
        done : float or None
            Part of the whole work, 0 to 1; None: not known.
        now : float
            [s]
        """
        self.stage = stage
        if done is None or done < self._done:  # other work than before
            self._counted_from = now
        self._done = done or 0.0
        counted = now - self._counted_from
        self.end = self._counted_from + counted / self._done if self._done >= _ENOUGH else None

    def text(self, now: float) -> str:
        """What is shown at a time.

        >>> clock = WorkClock(100.0, "solving")
        >>> clock.text(101.0), clock.text(107.0)
        ('solving', '7 s · solving')
        >>> clock.next_stage("assembling", 0.5, 110.0)
        >>> clock.text(113.0), clock.text(180.0)
        ('13 s, about 7 s left · solving: assembling', '1 min 20 s · solving: assembling')
        """
        words = f"{self.what}: {self.stage}" if self.stage else self.what
        elapsed = now - self.began
        if elapsed < _SHORT:
            return words
        left = 0.0 if self.end is None else self.end - now
        rest = f", about {_duration(left)} left" if left >= 1.0 else ""
        return f"{_duration(elapsed)}{rest} · {words}"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


@contextmanager
def working(what: str) -> Iterator[None]:
    """Show stage and time on stderr during long work; show nothing where it is not a terminal.

    Parameters
    ----------
    what : str
        Description of the work.
    """
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.text import Text

    clock = WorkClock(time.monotonic(), what)

    class Line:
        """The line next to the spinner, as it is when it is drawn."""

        def __rich__(self) -> Text:
            return Text(clock.text(time.monotonic()), no_wrap=True, overflow="ellipsis")

    class Stage(logging.Handler):
        """Takes the stages from the log messages of the library."""

        def emit(self, record: logging.LogRecord) -> None:
            done = getattr(record, "done", None)
            clock.next_stage(record.getMessage(), done, time.monotonic())

    logger, handler = logging.getLogger("pretravel"), Stage(logging.INFO)
    level = logger.level
    with Console(stderr=True).status(Line()):
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
        try:
            yield
        finally:
            logger.removeHandler(handler)
            logger.setLevel(level)
