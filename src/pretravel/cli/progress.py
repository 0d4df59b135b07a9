"""Progress of long work, on stderr."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def working(what: str) -> Iterator[None]:
    """Show a spinner on stderr during long work; show nothing where stderr is not a terminal.

    Parameters
    ----------
    what : str
        Description of the work, beside the spinner.
    """
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    class Stage(logging.Handler):
        """Shows the log messages of long work beside the spinner."""

        def emit(self, record: logging.LogRecord) -> None:
            status.update(f"{what}: {record.getMessage()}")

    logger, handler = logging.getLogger("pretravel"), Stage(logging.INFO)
    level = logger.level
    with Console(stderr=True).status(what) as status:
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
        try:
            yield
        finally:
            logger.removeHandler(handler)
            logger.setLevel(level)
