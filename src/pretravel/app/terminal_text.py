"""What the server writes to its terminal: words of strangers move no cursor."""

from __future__ import annotations

import logging
import sys
import traceback


def printable(text: str) -> str:
    r"""A text for the terminal: what would move its cursor or colour it is written out.

    >>> printable("/x\x1b[31m"), printable("two\nlines")
    ('/x\\x1b[31m', 'two\nlines')
    """
    return "".join(c if c.isprintable() or c in "\n\t" else repr(c)[1:-1] for c in text)


class OneLine(logging.Filter):
    """Writes out newlines and control characters of what strangers ask for."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Change the message; it is always logged."""
        record.msg, record.args = printable(record.getMessage()).replace("\n", "\\n"), ()
        return True


def flaw_message(details: str = "") -> str:
    """Print the exception that is being handled in the terminal; what the page says instead."""
    sys.stderr.write(f"{printable(details or traceback.format_exc())}\n")
    return "this is an internal error of pretravel; please report it with what the terminal shows"
