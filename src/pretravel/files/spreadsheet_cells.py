"""Text in CSV files that a spreadsheet would execute as a formula."""

from __future__ import annotations

import re

_FORMULA = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")
"""Begins a formula in a spreadsheet (OWASP, CSV injection), perhaps marked as text already."""
_FORMULA_WITHIN = re.compile(r"([;\t])('*[=+\-@＝＋－＠])")
"""Begins one in a sheet that splits lines at semicolons, as some languages do."""
_MARKED_WITHIN = re.compile(r"([;\t])'('*[=+\-@＝＋－＠])")
_MARK = "'"
"""Marks a cell as text in spreadsheets."""


def harmless_cell(text: str) -> str:
    """A text as a cell: one that begins like a formula is marked as text, a number is not.

    >>> harmless_cell("=HYPERLINK(A1)"), harmless_cell("-1.5"), harmless_cell("P1")
    ("'=HYPERLINK(A1)", '-1.5', 'P1')
    >>> harmless_cell("a;=1+1")
    "a;'=1+1"
    """
    text = _FORMULA_WITHIN.sub(r"\1'\2", text)
    return _MARK + text if _FORMULA.match(text) and not _is_number(text) else text


def cell_content(cell: str) -> str:
    """The text that `harmless_cell` wrote.

    >>> cell_content("'=HYPERLINK(A1)"), cell_content("'quoted'")
    ('=HYPERLINK(A1)', "'quoted'")
    >>> cell_content("a;'=1+1")
    'a;=1+1'
    """
    if _MARK not in cell:
        return cell
    within = _MARKED_WITHIN.sub(r"\1\2", cell)
    texts = (within.removeprefix(_MARK), within)
    return next((text for text in texts if text != cell and harmless_cell(text) == cell), cell)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text == text.strip()
