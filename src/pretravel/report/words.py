"""Results as text: strings for people, made from values; nothing is printed here."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A plain text table: first column to the left, others to the right.

    >>> print(table(["kind", "um"], [["mean", "2.0"]]))
    kind   um
    mean  2.0
    """
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in cells
    )


def labelled(label: str, text: str) -> list[str]:
    """Lines of a label and a long text beside it."""
    lines = textwrap.wrap(text, width=78)
    return [f"  {label if i == 0 else '':17s}  {line}" for i, line in enumerate(lines)]
