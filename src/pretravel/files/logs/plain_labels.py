"""Labels and names as they are written into comments of files that programs and controls read."""

from __future__ import annotations

import re

_OTHER_SIGNS = re.compile(r"[^A-Za-z0-9 _.-]")


def plain_name(text: str) -> str:
    r"""Return a text of one line with the characters A-Z a-z 0-9 space _ . -; others become _.

    A line end in a label would begin a line of its own in the file, which a control could execute.

    >>> plain_name("hole 3 (Ø5)\nM3 S20000")
    'hole 3 __5__M3 S20000'
    """
    return _OTHER_SIGNS.sub("_", text).strip()


def plain_labels(labels: tuple[str, ...]) -> tuple[str, ...]:
    r"""Return labels of plain characters, each of them once, none empty.

    >>> plain_labels(("a\nb", "a_b", ""))
    ('a_b', 'a_b_2', '3')
    """
    seen: set[str] = set()
    plain = []
    for row, label in enumerate(labels, start=1):
        name = plain_name(label) or str(row)
        while name in seen:
            name = f"{name}_{row}"
        seen.add(name)
        plain.append(name)
    return tuple(plain)


def without_comments(line: str) -> str:
    """Return a line of G-code without its comments in brackets.

    >>> without_comments("G1 (to (the left) X1 (open")
    'G1  X1 (open'
    """
    kept, at = "", 0
    while (begin := line.find("(", at)) >= 0 and (end := line.find(")", begin)) >= 0:
        kept += line[at:begin]
        at = end + 1
    return kept + line[at:]
