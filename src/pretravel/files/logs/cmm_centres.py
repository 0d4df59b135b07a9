"""Tip centres of a CMM without any compensation, one a line with its feature; reading.

A line is ``127;117;0 no compensation;1;59.9957;157.9280;148.2766;;0.0000``: number of the point,
number of the feature, name of the feature and the subtracted radius, a column that is not read,
and x, y, z. The plan states the feature's normal (join by feature).
"""

from __future__ import annotations

import re

import numpy as np

from pretravel.files.file_format import FileFormat, FilePositions
from pretravel.files.source_file import Source, opened, shortened

_HEAD = re.compile(r"(\d{1,9});(\d{1,9});([\w.#-]{1,60}) (no )?compensation;", re.IGNORECASE)
_CELLS = 7
"""Cells up to z."""


def read_cmm_centres(source: Source, units: str | None = None) -> FilePositions:
    r"""Read the positions of a CMM that took no radius off.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str
        mm or inch; the file does not state it.

    Returns
    -------
    FilePositions
        Labels are the name of the feature and the number of the point, ``0-127``.

    Raises
    ------
    InputError
        The units are missing; a line is another one, or states that a radius was subtracted; a
        number of a point occurs twice. The message contains the line.

    >>> from pretravel.files.source_file import SourceFile
    >>> text = b"127;117;0 no compensation;1;59.9957;157.9280;148.2766;;0.0000\n"
    >>> found = read_cmm_centres(SourceFile("a.dat", text), "mm")
    >>> found.labels, found.positions.tolist()
    (('0-127',), [[59.9957, 157.928, 148.2766]])
    """
    file = opened(source)
    rows, labels, lines = [], [], []
    seen: set[str] = set()
    for number, text in enumerate(file.lines("a file of tip centres"), start=1):
        line = text.strip()
        if not line:
            continue
        head, cells = _HEAD.match(line), line.split(";")
        if head is None or len(cells) < _CELLS:
            raise file.error(
                f"'{shortened(line)}' is not a line of tip centres: number;number;feature no "
                "compensation;1;x;y;z",
                number,
            )
        if head[4] is None:
            raise file.error(
                "the point was compensated: the subtracted radius is not known, and tip centres "
                "(no compensation) are needed",
                number,
            )
        if head[1] in seen:
            raise file.error(f"the point {head[1]} occurs twice", number)
        seen.add(head[1])
        rows.append(file.numbers(cells[4:_CELLS], number))
        labels.append(f"{head[3]}-{head[1]}")
        lines.append(number)
    scale = file.scale(units, "a file of tip centres does not give its units")
    return FilePositions(
        file.path,
        scale * np.array(rows),
        tuple(lines),
        labels=tuple(labels),
        understood=f"{len(rows)} tip centres; the column 4 and those after z are not read",
    )


CMM_CENTRES = FileFormat(
    name="cmm-centres",
    what="tip centres of a CMM: number;number;feature no compensation;1;x;y;z",
    reads="positions",
    needs="units; plan by features",
    verified=(
        "the syntax of twelve public files of one CMM, and the join with lists of their faces"
    ),
    recognises=lambda lines: all(map(_HEAD.match, lines)),
    parse=lambda file, options: read_cmm_centres(file, options.units),
    other_lines="refused",
)
