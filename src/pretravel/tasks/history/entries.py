"""What the entries of a history say: values, and the decision about the map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pretravel.files import Entry


def decision_words(decision: str) -> str:
    """Which new map was accepted, from the word of a history.

    Parameters
    ----------
    decision : str
        "kept", or "accepted NEW_MAP".

    >>> decision_words("accepted new.json"), decision_words("kept")
    ('new.json; the history continues with it', 'none accepted')
    """
    if decision == "kept":
        return "none accepted"
    return f"{decision.removeprefix('accepted ')}; the history continues with it"


def entry_value(entry: Entry, column: str) -> float:
    """The number in a column; not a number where it was not determined."""
    value = entry[column]
    return math.nan if value is None else float(value)
