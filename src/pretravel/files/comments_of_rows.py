"""Comments between the rows of a table: what they can change of the rows after them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TypeAlias

from pretravel.files.source_file import SourceFile, shortened

Record: TypeAlias = tuple[int, str]
"""Line number and text."""
_THINGS = (
    r"(?:tips?|stylus|styli|probe|sensor|tool|taster|tastkugel|werkzeug|part|serial|teil|"
    r"werkst(?:ü|ue)ck|workpiece|series|serie|set|pass|fixture|orientation)"
)
"""What a comment between rows can state or change."""
_CHANGES_ROWS = re.compile(
    rf"\b{_THINGS}(?:\s?(?:no|nr|number|nummer|name|id)\b\.?)?\s*"
    rf"(?:[:=#]|[A-Z]?\d|[A-Z]\b(?!\W+\w)|\bis (?:now )?\w*\d)|"
    rf"\b{_THINGS}\W+(?:(?:is|was|now|has been)\W+)*(?:chang|swap|exchang|replac|gewechsel|wechsel|"
    r"getauscht|turned|flipped|moved|shifted|rotated)\w*|"
    rf"\b(?:new|next|other|another|second|third|chang\w*|swap\w*|switch\w*|neue[rs]?|nächste[rs]?|"
    rf"andere[rs]?|zweite[rs]?|with|mit)\W+(?:(?:the|a|to|of)\W+)*{_THINGS}\b|"
    r"\b(?:units?|einheit(?:en)?)\W*(?:[:=]|mm|in\b|cm\b|µm|inch|zoll|metric|imperial)|"
    r"\b(?:inch|inches|zoll|G2[01]|G5[4-9](?:\.\d)?|G92|G68|wcs|work ?offset|rotat\w*|alignment|"
    r"datum|re-?clamp\w*|umgespannt|(?:serial|series|part|tip|tool) (?:no|number)\b)|"
    rf"\b(?:turn|flipp|mov|shift)ed\W+(?:(?:the|a)\W+)*{_THINGS}\b|"
    r"\b\d+(?:[.,]\d+)? ?mm (?:ball|tip|stylus|kugel|taster)\b|"
    r"^\W*(?:fast|slow|schnell|langsam)(?:ly)?(?: (?:pass|touch)\w*)?\W*$|"
    r"^\W*T\d+\b",
    re.IGNORECASE,
)
"""Comments that change what rows mean. One that only speaks of a tip or a part is named."""


def comments_among(
    file: SourceFile,
    comments: list[Record],
    lines: Sequence[int],
    is_row: Callable[[str], bool],
) -> tuple[Record, ...]:
    """Comments between the rows, without rows that are comments.

    Parameters
    ----------
    file : SourceFile
    comments : list of line and text
    lines : sequence of int
        Of the rows.
    is_row : function of a text
        Whether a comment without its sign is a row.

    Returns
    -------
    tuple of line and text

    Raises
    ------
    InputError
        One of them speaks of the tip, the part, the unit or the coordinates of the rows.
    """
    among = [
        (number, line)
        for number, line in comments
        if lines[0] < number < lines[-1] and not is_row(line[1:])
    ]
    for number, line in among:
        if _CHANGES_ROWS.search(line):
            raise file.error(
                f"'{shortened(line)}' is between the rows, and may change the meaning of the rows "
                "after it: give its content in a column, or split the table there",
                number,
            )
    return tuple((number, line) for number, line in among if re.search(r"\w", line))
