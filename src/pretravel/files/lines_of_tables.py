"""Lines of text as rows of a table: separators, cells, headers, titles."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence

from pretravel.files.column_names import column_name, names_known_columns, unit_of
from pretravel.files.csv_table import cell_content
from pretravel.files.row_statements import Record
from pretravel.files.words_of_lines import APART, NUMERAL, together

SEPARATORS = {";": "';'", "\t": "tab", "|": "'|'", ",": "','", " ": "blanks", "  ": "wide blanks"}
"""The separators that are tried, in this order, each with its name for people."""
IS_NUMBER = re.compile(NUMERAL)
IS_WORD = re.compile(rf"([A-Za-z]{{1,8}})\s*[=:]\s*({APART})|([A-Za-z])\s*({APART})")
COMMENT = re.compile(r"#(?!\d+\s*:|\s*+[;,\t|])|%|//|!|\$\$|\(.*\)$")
"""But #03: numbers a point, and a header can begin with # alone."""
SAMPLE = 300
"""Rows from which the separator is determined."""
FEWEST_NUMBERS = 3
"""A row of a table of touches has three coordinates or more."""
FEWEST_ROWS = 2
"""Rows from which a header with another number of cells is the odd one."""
_TITLES = 6
"""Most lines above a table without a header."""
_VECTORS = ({"i", "j", "k"}, {"nx", "ny", "nz"})
_QUOTED = 60
"""Most characters of a line that a message quotes."""


def header_cells(lines: Sequence[str]) -> list[str]:
    """The cells of the first line near the head that names three columns or more in words.

    >>> header_cells(["Report", "Name;Nominal;Actual;Dev", "D1;10;10.01;0.01"])
    ['Name', 'Nominal', 'Actual', 'Dev']
    """
    found: list[str] = []
    for line in lines[:20]:
        for separator in (";", "\t", "|", ",", "  ", " "):
            cells = split_cells(line, separator)
            words = [cell for cell in cells if cell and not is_number_cell(cell)]
            if len(cells) > 2 and len(words) == len([cell for cell in cells if cell]):
                if not found and "" in cells[:-1]:  # names of groups, perhaps
                    found = cells
                    break
                return with_groups(found, cells) if found else cells
        else:
            if found:
                return found
    return found


def is_table(lines: Sequence[str]) -> bool:
    """Whether lines of text are a table of touches: they have a header, or rows of three numbers.

    >>> is_table(["1.0 2.0 3.0"]), is_table(["Dear all,", "the probe is new."])
    (True, False)
    """
    plain = [(0, line) for line in lines if not COMMENT.match(line)]
    return bool(plain) and not _is_json(lines) and separator_of(plain) is not None


def _is_json(lines: Sequence[str]) -> bool:
    return lines[0].startswith(("{", "[{")) or lines[0] == "["


def has_known_header(lines: Sequence[str]) -> bool:
    """Whether a line near the head names the columns of touches.

    >>> has_known_header(["Probe 1", "Nr;X;Y;Z"])
    True
    """
    return not _is_json(lines) and any(
        is_header(split_cells(line, separator))
        for line in lines[:20]
        for separator in SEPARATORS
        if not COMMENT.match(line)
    )


def rows_below_a_title(lines: Sequence[str]) -> bool:
    """Whether all lines but a few at the head are rows of numbers, of one width.

    >>> rows_below_a_title(["Measuring log", "1;0;0;3", "2;5;0;3"])
    True
    >>> rows_below_a_title(["Measuring log", "X : 50.001", "Y : 20.002"])
    False
    """
    plain = [line for line in lines if not COMMENT.match(line)]
    separator = separator_of([(0, line) for line in plain])
    if separator is None:
        return False
    cells = [split_cells(line, separator) for line in plain]
    first = next((i for i, row in enumerate(cells) if is_data(row)), len(cells))
    rows = cells[first:]
    return (
        first <= _TITLES
        and len(rows) >= FEWEST_ROWS
        and all(map(is_data, rows))
        and len({len(row) for row in rows}) == 1
    )


def has_worded_rows(lines: Sequence[str]) -> bool:
    """Whether a line near the head has words such as X1.5, with separators or with I, J, K.

    >>> has_worded_rows(["X=1.5, Y=2, Z=3"]), has_worded_rows(["N1 X1 Y2 Z3 I0 J0 K1"])
    (True, True)
    >>> has_worded_rows(["G1 X1 Y2 Z3"]), has_worded_rows(["X 1 Y 2 Z- 3 I 0 J 0 K 1"])
    (False, True)
    """
    if _is_json(lines):
        return False
    plain = [together(line) for line in lines[: 2 * _TITLES] if not COMMENT.match(line)]
    for line in plain[: _TITLES + 1]:
        for separator in SEPARATORS:
            words = [IS_WORD.fullmatch(cell) for cell in split_cells(line, separator)]
            names = {(word[1] or word[3]).lower() for word in words if word is not None}
            if {"x", "y", "z"} <= names and "g" not in names:
                return bool(separator.strip()) or any(vector <= names for vector in _VECTORS)
    return False


def not_a_table(lines: Sequence[str]) -> str:
    """A sentence about text that is not a table; it quotes a line.

    >>> not_a_table(["Dear all,"])[:58]
    "the text is not a table of touches: 'Dear all,' is neither"
    """
    if _is_json(lines):
        return (
            "this is JSON, from which no touches are read: write them as CSV, a row for each touch "
            "below a header (x_mm, y_mm, z_mm, nx, ny, nz)"
        )
    line = lines[0]
    shown = line if len(line) <= _QUOTED else line[: _QUOTED - 1] + "…"
    return (
        f"the text is not a table of touches: '{shown}' is neither a header (X, Y, Z …) nor a row "
        "of three numbers or more"
    )


def split_cells(line: str, separator: str) -> list[str]:
    """Split a line into cells, without the blanks and quotes around them.

    >>> split_cells('"a";1,5 ; 2', ";"), split_cells('a  "b c"', " ")
    (['a', '1,5', '2'], ['a', 'b c'])
    """
    if separator == "  ":
        return [cell.strip(' "') for cell in re.split(r"\s{2,}|\t", line.strip())]
    if separator == " ":
        cells = re.findall(r'"(?:[^"]|"")*"|[^\s"]\S*|"\S*', line)
        cells = [c[1:-1] if len(c) > 1 and c[0] == c[-1] == '"' else c for c in cells]
        return _units_joined(cells)
    if line and '"' not in line:  # as the reader would, in a fraction of its time
        return [cell_content(cell.strip()) for cell in line.split(separator)]
    try:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:
        cells = line.split(separator)
    return [cell_content(cell.strip()) for cell in cells]


def _units_joined(cells: list[str]) -> list[str]:
    """Cells of a header with blanks, where "X [mm]" is one name."""
    joined: list[str] = []
    has_unit = True  # a name has one; joined to a second, it would grow along the line
    for cell in cells:
        if (
            not has_unit
            and cell.startswith(("[", "("))
            and unit_of(cell)
            and unit_of(joined[-1]) is None
        ):
            joined[-1] += " " + cell
            has_unit = True
        else:
            joined.append(cell)
            has_unit = False
    return joined


def separator_of(records: Sequence[Record], fewest: int = FEWEST_NUMBERS) -> str | None:
    """The separator that splits the most rows into numbers; else the one of a header."""
    lines = [line for _, line in records[:SAMPLE]]
    counts = {
        separator: sum(
            len(cells) > 1 and is_data(cells, fewest)
            for cells in (split_cells(line, separator) for line in lines)
        )
        for separator in SEPARATORS
    }
    best = max(counts, key=lambda separator: counts[separator])
    if counts[best]:
        return best
    for separator in SEPARATORS:
        if any(is_header(split_cells(line, separator)) for line in lines):
            return separator
    return None


def is_data(cells: Sequence[str], fewest: int = FEWEST_NUMBERS) -> bool:
    """Whether cells are a row of a table of touches: three numbers, and half of all.

    >>> is_data(["top", "1.5", "2", "3"]), is_data(["top", "1.5", "2"])
    (True, False)
    """
    numbers = sum(is_number_cell(cell) for cell in cells)
    filled = sum(bool(cell) for cell in cells)
    return numbers >= fewest and 2 * numbers >= filled


def is_header(cells: list[str]) -> bool:
    """Whether cells name the columns of touches; a row "X 1.5 Y 2.5 Z 3.5" does not."""
    return names_known_columns(cells) and not any(map(IS_NUMBER.fullmatch, cells))


_NUMBERED = re.compile(r"([^\W\d]{1,12}[ _#]?)(\d{1,3})(?:[ _\[(]{1,2}(?:mm|in|inch|[uµ]m)[\])]?)?")


def numbers_columns(cells: Sequence[str], below: Sequence[str]) -> bool:
    """Whether cells are names with numbers that rise, M1, M2 …, or that are one number, X1, Y1 …,
    or both, X1, Y1 … X2, Y2 …, above numbers without letters.

    >>> numbers_columns(["#", "Z1", "Z2"], ["1", "12.5", "12.6"])
    True
    >>> numbers_columns(["X1", "Y1", "Z1"], ["12.5", "12.6", "1.0"])
    True
    >>> numbers_columns(["X1", "Y2", "Z3"], ["X1", "Y3", "Z3"])
    False
    """
    found = [_NUMBERED.fullmatch(cell) for cell in cells]
    names = [match for match in found if match is not None]
    stems = {match[1] for match in names}
    numbers = [int(match[2]) for match in names]
    plain = [IS_NUMBER.fullmatch(cell) for cell, match in zip(below, found, strict=False) if match]
    rising = len(stems) == 1 and numbers == sorted({*numbers})
    different = len({match[0] for match in names})
    each = len(stems) > 1 and different == len(names) == len(stems) * len({*numbers})
    return len(names) > 1 and (rising or each) and all(plain)


_DRESSED = re.compile(rf"({NUMERAL})(?:([-+−])|\s?([A-Za-zµμ°\"/]{{1,8}}))")
"""A number with its sign or its unit behind it."""
_APART = re.compile(r"([-+−])\s+(?=[\d.,])")
"""A sign with blanks between it and its number."""
_SIGNED = re.compile(r"\s*[-+−]")


def plain_number(cell: str) -> tuple[str, str]:
    """A cell with its sign in front of the number, and the unit that stood behind it.

    >>> plain_number("12.5 mm"), plain_number("0.01-"), plain_number("P1"), plain_number("-1-")
    (('12.5', 'mm'), ('-0.01', ''), ('P1', ''), ('-1-', ''))
    >>> plain_number("- 12.5")
    ('-12.5', '')
    """
    cell = _APART.sub(r"\1", cell, count=1) if _APART.match(cell) else cell
    found = _DRESSED.fullmatch(cell)
    if found is None or (found[2] and _SIGNED.match(cell)) or (found[3] and not unit_of(found[3])):
        return cell, ""
    sign = "-" if found[2] and found[2] != "+" else ""
    return sign + found[1], unit_of(found[3] or "") or ""


_ADDRESS = re.compile(r"([A-Za-z])\s*+[=:]?+\s*+(?=[-+−.\d])")
_ADDRESSES = {
    **{axis: axis.upper() for axis in "xyzabc"},
    **{f"n{axis}": letter for axis, letter in zip("xyz", "IJK", strict=True)},
    "feed": "F",
    "spindle": "SCR",
}
"""Letters of words of controls, by the role of the column in which they stand."""


def without_addresses(names: Sequence[str], rows: Sequence[list[str]]) -> None:
    """Take the letters of words, X1.5 under X or F100 under Feed, from the cells of all rows.

    >>> rows = [["X1.5", "F100", "P1"], ["X-2", "F50", "P2"]]
    >>> without_addresses(["X", "Feed", "Point"], rows)
    >>> rows
    [['1.5', '100', 'P1'], ['-2', '50', 'P2']]
    """
    for i, title in enumerate(names):
        letters = _ADDRESSES.get(column_name(title).role or "", "")
        if not letters or any(IS_NUMBER.fullmatch(row[i]) for row in rows[:1]):
            continue
        found = [_ADDRESS.match(row[i]) for row in rows]
        if all(word is not None and word[1].upper() in letters for word in found):
            for row, word in zip(rows, found, strict=True):
                row[i] = row[i][word.end() :] if word else row[i]


def is_number_cell(cell: str) -> bool:
    """Whether a cell is a number, or a letter with its number.

    >>> is_number_cell("1,5"), is_number_cell("X1.5"), is_number_cell("Dev")
    (True, True, False)
    """
    return bool(IS_NUMBER.fullmatch(cell) or IS_WORD.fullmatch(cell)) or (
        cell[:1] in "+-−.0123456789" and plain_number(cell)[0] != cell
    )


def with_groups(groups: list[str], names: list[str]) -> list[str]:
    """Names of columns below names of groups, such as Nominal and Actual above X, Y, Z twice.

    >>> with_groups(["", "Nominal", "", "Actual", ""], ["Nr", "X", "Y", "X", "Y"])
    ['Nr', 'Nominal X', 'Nominal Y', 'Actual X', 'Actual Y']
    """
    counts = Counter(filter(None, names))
    twice = any(count > 1 for count in counts.values())
    if not twice or len(groups) != len(names) or any(map(is_number_cell, groups)):
        return names
    held, found = "", []
    for group, name in zip(groups, names, strict=True):
        held = group or held
        found.append(f"{held} {name}".strip() if counts[name] > 1 else name or group)
    return found
