"""Tables as text in the forms that people have: separators, headers, comments, units, encodings."""

from __future__ import annotations

import itertools
import logging
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from pretravel.base import InputError
from pretravel.files.column_names import (
    MOST_COLUMNS,
    column_name,
    is_unit_row,
    names_known_columns,
    unit_of,
)
from pretravel.files.lines_of_tables import (
    COMMENT,
    FEWEST_NUMBERS,
    FEWEST_ROWS,
    IS_NUMBER,
    IS_WORD,
    SAMPLE,
    SEPARATORS,
    is_data,
    is_header,
    is_number_cell,
    not_a_table,
    numbers_columns,
    plain_number,
    separator_of,
    split_cells,
    with_groups,
    without_addresses,
)
from pretravel.files.row_statements import Record, changes_rows, comments_among
from pretravel.files.source_file import COUNTED, SourceFile, first_few, shortened
from pretravel.files.words_of_lines import together, units_in_text

_LOG = logging.getLogger(__name__)
_RULE_SIGNS = re.compile(r"[-=_*~\s;,|+:]+")
_DRAWN = re.compile(r"[-=_*~]+")
_COUNT = 9
"""Digits of the number of a row, and more."""
_LONGEST_CELL = 5
"""Lines over which a quoted cell can run."""


@dataclass(frozen=True)
class TextTable:
    """The cells of a table, and how the file was understood.

    Attributes
    ----------
    file : SourceFile
    names : tuple of str or None
        None: the file has no header.
    rows : tuple of tuple of str
        Cells, of one length.
    lines : tuple of int
        Line of the file of each row.
    header_line : int
        0 without a header.
    separator : str
        A key of `SEPARATORS`.
    encoding : str
    units : tuple of str
        The row of units below the header; empty where there is none.
    unit : str or None
        Unit of length that a comment or a line before the table states.
    preamble : tuple of Record
        Lines before the table that are not comments.
    disabled : tuple of int
        Lines of comments that look like rows.
    among : tuple of Record
        Other comments between the rows.
    around : tuple of Record
        Comments before and after the rows, and other lines before them, without the header.
    """

    file: SourceFile
    names: tuple[str, ...] | None
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    header_line: int = 0
    separator: str = ","
    encoding: str = "UTF-8"
    units: tuple[str, ...] = ()
    unit: str | None = None
    preamble: tuple[Record, ...] = ()
    disabled: tuple[int, ...] = ()
    among: tuple[Record, ...] = ()
    around: tuple[Record, ...] = ()

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.rows[0])

    def column(self, index: int) -> tuple[str, ...]:
        """Cells of a column."""
        return tuple(row[index] for row in self.rows)

    def title(self, index: int) -> str:
        """Name of a column in messages: its own, or its number."""
        own = "" if self.names is None else self.names[index]
        return own or f"column {index + 1}"


def read_text_table(
    file: SourceFile, left_out: Collection[str] = (), fewest: int = FEWEST_NUMBERS
) -> TextTable:
    r"""Read a table with any usual separator, with or without a header.

    Parameters
    ----------
    file : SourceFile
    left_out : collection of str
        Numbers of lines that are not read.
    fewest : int
        Numbers that a row has or more: three coordinates.

    Raises
    ------
    InputError
        The file is no text, is empty, is not a table, has no rows or rows of another length.
        The message contains the line.

    >>> table = read_text_table(SourceFile("a.txt", b"Nr;X;Y;Z\n;mm;mm;mm\n1;0,5;1,5;2\n"))
    >>> table.names, table.units, table.rows
    (('Nr', 'X', 'Y', 'Z'), ('', 'mm', 'mm', 'mm'), (('1', '0,5', '1,5', '2'),))
    """
    text, encoding = file.text("a table of touches")
    records = _records(file, text)
    stated = re.fullmatch(r"\"?sep=(.)\"?", records[0][1]) if records else None
    if stated is not None:
        records = records[1:]
    records = [
        (number, together(line))
        for number, line in _counted(records, file.name, "lines")
        if not _is_rule(line)
    ]
    plain = [record for record in records if not COMMENT.match(record[1])]
    comments = [record for record in records if COMMENT.match(record[1])]
    absent = set(left_out) - {str(number) for number, _ in plain}
    if absent:
        raise file.error(
            f"there is no touch with the label or on the line '{min(absent)}'", inputs=("exclude",)
        )
    plain = [record for record in plain if str(record[0]) not in left_out]
    if not plain:
        raise file.error(
            "all lines are excluded"
            if left_out
            else "the file is empty; a header line with column names and rows are needed"
            if not comments
            else "the file is empty except for comments; rows are needed"
        )
    separator = separator_of(plain, fewest) if stated is None else stated[1]
    if separator is None:
        raise file.error(not_a_table([plain[0][1]]), plain[0][0])
    # In a table with semicolons one of them begins an empty cell, or a comment of one cell.
    noted = re.compile(r";[^;]*[A-Za-z][^;]*" if separator == ";" else ";.*", re.DOTALL)
    comments += [record for record in plain if noted.fullmatch(record[1])]
    split = [
        (number, split_cells(line, separator))
        for number, line in _counted(plain, file.name, "rows")
        if not noted.fullmatch(line)
    ]
    split = [(number, cells) for number, cells in split if any(cells)]
    split = _header_in_wide_blanks(split, dict(plain), separator, fewest)
    if not separator.strip():
        _refuse_signs_between(file, split)
    return _table(file, split, sorted(comments), (separator, encoding, fewest))


def _counted(records: list[Record], name: str, of_what: str) -> Iterator[Record]:
    """The lines of a file; of a long one it is logged how many are read."""
    for count, record in enumerate(records):
        if count and count % COUNTED == 0:
            _LOG.info("%s: %d of %d %s read", name, count, len(records), of_what)
        yield record
    if len(records) > COUNTED:
        _LOG.info("%s: %d %s, what they mean", name, len(records), of_what)


def _is_rule(line: str) -> bool:
    """Whether a line is drawn below a header: of strokes that have three characters or more."""
    if not _RULE_SIGNS.fullmatch(line):
        return False
    strokes = _DRAWN.findall(line)
    return bool(strokes) and min(map(len, strokes)) >= 3


def _records(file: SourceFile, text: str) -> list[Record]:
    """Lines that are not blank; a quoted cell can run over several."""
    lines = re.split(r"\r\n|\r|\n", text)
    records: list[Record] = []
    number = 0
    while number < len(lines):
        first, line = number, lines[number]
        while _open_quote(line) and number - first < _LONGEST_CELL and number + 1 < len(lines):
            number += 1
            line += "\n" + lines[number]
        if _open_quote(line) and number > first:
            raise file.error("a quoted cell does not end", first + 1)
        number += 1
        if line.strip():
            records.append((first + 1, line.strip(" \n\ufeff")))
    return records


_QUOTE_BEGINS = re.compile(r'(?:^\s*|[;,\t|][^\S\t]*)"')


def _open_quote(line: str) -> bool:
    """Whether a quote at the beginning of a cell is not closed."""
    return line.count('"') % 2 == 1 and _QUOTE_BEGINS.search(line) is not None


_SPREADSHEET_ERROR = re.compile(r"#[A-ZÄÖÜ/0-9]+[!?]")
"""What spreadsheets write in a cell that they could not compute, such as #REF! and #NAME?."""


def _refuse_spreadsheet_errors(file: SourceFile, comments: list[Record]) -> None:
    for number, line in comments:
        if _SPREADSHEET_ERROR.match(line):
            raise file.error(
                f"'{line[:30]}' begins with an error of the spreadsheet, not with a value: correct "
                "it there, or delete the line",
                number,
            )


def _table(
    file: SourceFile,
    split: list[tuple[int, list[str]]],
    comments: list[Record],
    how: tuple[str, str, int],
) -> TextTable:
    """Find header, row of units and rows among the lines that were split into cells."""
    separator, encoding, fewest = how
    for number, cells in split:
        if len(cells) > MOST_COLUMNS:
            raise file.error(
                f"the line has {len(cells)} cells; a table of touches has at most {MOST_COLUMNS}",
                number,
            )
    first = next((i for i, (_, cells) in enumerate(split) if is_data(cells, fewest)), len(split))
    if first + 1 < len(split) and numbers_columns(split[first][1], split[first + 1][1]):
        first += 1
    header = _header(split, first)
    body = split[first:] if header is None else split[header + 1 :]
    _refuse_spreadsheet_errors(file, comments)
    before = split[: first if header is None else header]
    names = None if header is None else [" ".join(cell.split()) for cell in split[header][1]]
    if header and names is not None:
        names = with_groups(split[header - 1][1], names)
    header_line = 0 if header is None else split[header][0]
    if names is None and body and (found := _commented_header(comments, body[0], separator)):
        header_line, names = found
    units: list[str] = []
    if header is not None and body and is_unit_row(body[0][1]):
        units = body.pop(0)[1]
    results = _results_below(body) + _breaks_of_pages(
        body, None if header is None else split[header][1]
    )
    if not body:
        raise _without_rows(file, header_line, _disabled(comments, separator))
    if names is None:
        _refuse_lone_signs(file, body)
        names, body = _words_taken(file, body)
        _refuse_row_before(file, before, body)
    width = _width(names, body)
    if header is not None:
        _refuse_second_header(file, split[header][1], body)
        _refuse_header_of_other_width(file, split[header], body, separator)
    rows = [_cells_of_width(file, cells, width, names, number) for number, cells in body]
    without_addresses(names or (), rows)
    lines = tuple(number for number, _ in body)
    rows, units = _without_units(file, rows, lines, units)
    among = comments_among(file, comments, lines, _is_row(separator))
    titles = tuple((number, " ".join(cells)) for number, cells in before)
    notes = [line for _, line in comments] + [line for _, line in titles]
    return TextTable(
        file=file,
        names=None if names is None else tuple(_padded(names, width)),
        rows=tuple(map(tuple, rows)),
        lines=lines,
        header_line=header_line,
        separator=separator,
        encoding=encoding,
        units=tuple(_padded(units, width)) if units else (),
        unit=_stated_unit(file, notes),
        preamble=titles,
        disabled=_disabled(comments, separator),
        among=(*among, *((number, separator.join(cells)) for number, cells in results)),
        around=(*(one for one in comments if not lines[0] <= one[0] <= lines[-1]), *titles),
    )


def _disabled(comments: list[Record], separator: str) -> tuple[int, ...]:
    """Lines of the comments that look like rows."""
    return tuple(n for n, line in comments if is_data(split_cells(line[1:], separator)))


def _without_rows(file: SourceFile, header_line: int, disabled: Sequence[int]) -> InputError:
    if disabled:
        return file.error(
            "the file has no rows; comments that look like rows are not read (line "
            f"{first_few(disabled)}): if they are touches, remove the sign before them",
            disabled[0],
        )
    return file.error("the file has a header but no rows", header_line or None)


_RESULT = re.compile(
    r"(?:mean|average|avg|max(?:imum)?|min(?:imum)?|range|std|st(?:andar)?d?\W*dev\w*|sigma|median|"
    r"sum|total|count|rms|result|mittel(?:wert)?|spannweite|stabw\w*|streuung|summe|anzahl|moyenne|"
    r"[ée]cart\W?type|[ée]tendue|media|promedio|rango)\W*",
    re.IGNORECASE,
)
"""A cell of rows below a table that are computed from it."""
_END = re.compile(
    r"\W*(?:end|eof|end of (?:file|report|data|list|table)|fin|ende|done|finished|M0?2|M30|"
    r"\d{1,9} (?:points?|touches|rows|lines|records|punkte|puntos))\W*",
    re.IGNORECASE,
)
"""A line below a table that ends it."""


_PAGE_BEGINS = {*"pPsS-=*["}
_PAGE = re.compile(r"\W*(?:page|seite|pagina|p[áa]gina)\W*\d+(?:\W*(?:of|von|/)\W*\d+)?\W*", re.I)


def _breaks_of_pages(
    body: list[tuple[int, list[str]]], header: list[str] | None
) -> list[tuple[int, list[str]]]:
    """Numbers of pages, and headers that are repeated where the numbers of rows go on.

    They are taken from the rows.
    """
    pages = {
        number for number, cells in body
        if cells[0][:1] in _PAGE_BEGINS and _PAGE.fullmatch(" ".join(cells))
    }  # fmt: skip
    again = {number for number, cells in body if cells == header}
    if not (pages or again):
        return []
    goes_on = False
    if header is not None and column_name(header[0]).role == "label":
        counts = [cells[0] for number, cells in body if number not in pages | again]
        goes_on = all(cell.isdecimal() and len(cell) < _COUNT for cell in counts) and all(
            int(b) == int(a) + 1 for a, b in itertools.pairwise(counts)
        )
    taken = pages | again if goes_on else pages
    found = [row for row in body if row[0] in taken]
    body[:] = [row for row in body if row[0] not in taken]
    return found


def _results_below(body: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Rows at the end that are not readings: their mean, range …; they are taken from the rows."""
    last = len(body)
    while last and (
        any(map(_RESULT.fullmatch, filter(None, body[last - 1][1])))
        or _END.fullmatch(" ".join(body[last - 1][1]))
    ):
        last -= 1
    if not last:  # names of points
        return []
    results = body[last:]
    del body[last:]
    return results


def _without_units(
    file: SourceFile, rows: list[list[str]], lines: Sequence[int], units: list[str]
) -> tuple[list[list[str]], list[str]]:
    """Rows whose numbers have no unit and no sign behind them, and the unit of each column.

    Columns in which not all filled cells are numbers stay as they are: they are words.
    """
    found = _padded(units, len(rows[0])) if units else [""] * len(rows[0])
    for i in range(len(rows[0])):
        if all(IS_NUMBER.fullmatch(row[i]) for row in rows[:SAMPLE]):
            continue
        plain = [plain_number(row[i]) for row in rows]
        if not all(IS_NUMBER.fullmatch(cell) for cell, _ in plain if cell):
            continue
        here = {unit for cell, unit in plain if cell}
        if len(here - {""}) > 1 or (len(here) > 1 and "" in here):
            other = next(k for k, (cell, unit) in enumerate(plain) if unit != plain[0][1] and cell)
            raise file.error("this row has another unit than the rows before it", lines[other])
        unit = here.pop() if here else ""
        if unit and unit_of(found[i]) not in (None, "1", unit):
            raise file.error(
                f"the cells have the unit {unit}, and their title {found[i]}", lines[0]
            )
        found[i] = unit or found[i]
        for row, (cell, _) in zip(rows, plain, strict=True):
            row[i] = cell
    return rows, found if any(found) else units


def _is_row(separator: str) -> Callable[[str], bool]:
    """Whether a comment without its sign is a row of the table."""
    return lambda text: is_data(split_cells(text, separator))


def _header(split: list[tuple[int, list[str]]], first: int) -> int | None:
    """Index of the header: the line that names known columns; else the last before the numbers."""
    for index, (_, cells) in enumerate(split[: first + 1]):
        if is_header(cells):
            return index
    if first == len(split) or first == 0:
        return None
    width = len(split[first][1])
    for index in range(first - 1, -1, -1):
        cells = split[index][1]
        if is_unit_row(cells):
            continue
        texts = [cell for cell in cells if cell and not is_number_cell(cell)]
        named = len(texts) >= min(width, 3) or numbers_columns(cells, split[first][1])
        return index if len(cells) == width and named else None
    return None


def _header_in_wide_blanks(
    split: list[tuple[int, list[str]]], texts: Mapping[int, str], separator: str, fewest: int
) -> list[tuple[int, list[str]]]:
    """Rows of a table with blanks; names such as "Meas X" are separated by two blanks or more."""
    if separator != " ":
        return split
    first = next((i for i, (_, cells) in enumerate(split) if is_data(cells, fewest)), len(split))
    found = _header(split, first)
    if first in (0, len(split)):
        return split
    header = first - 1 if found is None else found
    number, cells = split[header]
    width = len(split[first][1])
    wide = split_cells(texts[number], "  ")
    if len(cells) == width or len(wide) != width or any(map(is_number_cell, wide)):
        return split
    if found is None and not any(column_name(cell).role for cell in wide):
        return split
    return [*split[:header], (number, wide), *split[header + 1 :]]


def _commented_header(
    comments: list[Record], row: tuple[int, list[str]], separator: str
) -> tuple[int, list[str]] | None:
    """Header in the last comment before the rows, as CloudCompare and NumPy write it."""
    for number, line in reversed([c for c in comments if c[0] < row[0]]):
        text = re.sub(r"^(#|%|//|!|\$\$|;)+\s*", "", line)
        tried = [(separator, line), *((candidate, text) for candidate in (separator, *SEPARATORS))]
        for candidate, words in tried:
            cells = split_cells(words, candidate)
            if len(cells) == len(row[1]) and names_known_columns(cells):
                return number, cells
    return None


_UNTITLED = {
    re.compile(r"\d{1,4}([-/.])\d{1,2}\1\d{1,4}"): "date",
    re.compile(r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d{1,9})?)?"): "time",
    re.compile(r"T\d{1,8}[_/.-]?D\d{1,2}", re.IGNORECASE): "tip",
    re.compile(r"[^\w+-]+"): "sign",
}
"""What a cell without a name is by its form, among cells such as X=1.0."""


def _name_of_cell(cell: str) -> str:
    """The name of a cell without one: by its form, or that of a label."""
    return next((name for form, name in _UNTITLED.items() if form.fullmatch(cell)), "label")


def _words_taken(
    file: SourceFile, body: list[tuple[int, list[str]]]
) -> tuple[list[str] | None, list[tuple[int, list[str]]]]:
    """Rows such as ``P1, X=1.0, Y=2.0``: their words become the names of the columns."""
    words = [IS_WORD.fullmatch(cell) for cell in body[0][1]]
    if sum(word is not None for word in words) < FEWEST_NUMBERS:
        return None, body
    names = [
        _name_of_cell(cell) if word is None else word[1] or word[3]
        for cell, word in zip(body[0][1], words, strict=True)
    ]
    if words[0] is not None and column_name(names[0]).role is None:  # P1 is a label
        names[0] = "label"
    labels = [i for i, name in enumerate(names) if name == "label"]
    if len(labels) > 1 and any(IS_NUMBER.fullmatch(body[0][1][i]) for i in labels):
        return None, body  # Q151 = 1.5, with blanks
    for i in labels[1:]:
        names[i] = f"column {i + 1}"
    taken = []
    for number, cells in body:
        if len(cells) < len(names):  # another statement, such as T7 D2
            taken.append((number, cells))
            continue
        row = []
        for name, own, cell in zip(names, words, cells, strict=False):
            word = IS_WORD.fullmatch(cell)
            whole = own is None or name == "label"
            if not whole and (word is None or (word[1] or word[3]) != name):
                raise file.error(f"'{cell}' is not {name} with a number, as in other lines", number)
            value = "" if word is None else "".join((word[2] or word[4]).split())
            row.append(cell if word is None or whole else value)
        taken.append((number, row + cells[len(names) :]))
    return names, taken


def _refuse_lone_signs(file: SourceFile, body: list[tuple[int, list[str]]]) -> None:
    """Refuse signs apart from their numbers, which would be lost with a column of their own."""
    for number, cells in body:
        for sign, after in itertools.pairwise(cells):
            if sign in {"-", "+", "−"} and IS_NUMBER.fullmatch(after):
                raise file.error(
                    f"the sign '{sign}' is separated from {after}: write them together ({sign}"
                    f"{after}), or 0 where the sign is an empty cell",
                    number,
                )


_SIGN_BEHIND = re.compile(r"[\d.,]+[-−]")


def _refuse_signs_between(file: SourceFile, split: list[tuple[int, list[str]]]) -> None:
    """Refuse a minus at the end of a number among blanks, which can be that of the next number.

    Controls print -   91.200 for -91.200, next to the number before. Where the last number of a
    row has a minus at its end, the minus belongs to the number before it.
    """
    signed = [(n, cells) for n, cells in split if any(map(_SIGN_BEHIND.fullmatch, cells))]
    if not signed or any(_SIGN_BEHIND.fullmatch(cells[-1]) for _, cells in signed):
        return
    number, cells = signed[0]
    place = next(i for i, cell in enumerate(cells) if _SIGN_BEHIND.fullmatch(cell))
    raise file.error(
        f"is the minus of '{cells[place]} {cells[place + 1]}' that of the first or of the second "
        "number? Write each sign together with its number",
        number,
    )


def _refuse_row_before(
    file: SourceFile,
    before: list[tuple[int, list[str]]],
    body: list[tuple[int, list[str]]],
) -> None:
    """Refuse a line before the numbers that can be a row with a bad cell, not a title."""
    for number, cells in before:
        if len(cells) == len(body[0][1]) and any(map(is_number_cell, cells)):
            bad = next(cell for cell in cells if not is_number_cell(cell))
            raise file.error(
                f"'{bad}' is not a number, and the line is not a header; correct it, or exclude it",
                number,
                inputs=("exclude",),
            )


def _refuse_second_header(
    file: SourceFile, header: list[str], body: list[tuple[int, list[str]]]
) -> None:
    """Refuse a header among the rows: of other columns, or of the rows of another series."""
    words = {cell.lower() for cell in header if cell}
    for number, cells in body:
        if not (cells[0].lower() in words and is_header(cells)):
            continue
        if cells == header:
            raise file.error(
                "the header occurs again here: do rows of another part, tip or run begin? Then "
                "split the table there. If not, leave this line out",
                number,
                inputs=("exclude",),
            )
        raise file.error(
            "another header is among the rows: the columns after it differ. Split the table there",
            number,
        )


def _refuse_header_of_other_width(
    file: SourceFile,
    header: tuple[int, list[str]],
    body: list[tuple[int, list[str]]],
    separator: str,
) -> None:
    """Refuse a header where every row has another number of cells: the fault is in the header."""
    if all(len(cells) == len(header[1]) for _, cells in body):
        return  # the last column is empty
    counts = {_filled(cells) for _, cells in body}
    names = _filled(header[1])
    if len(counts) > 1 or names in counts or len(body) < FEWEST_ROWS:
        return
    count = counts.pop()
    if count > names and not any("." in cell for _, cells in body for cell in cells):
        return  # decimal commas, perhaps: each row says so
    how = (
        "complete the header"
        if separator.strip()
        else "put names that contain blanks into quotes, or two blanks between names"
    )
    raise file.error(
        f"the header has {names} names, and all rows have {count} cells: {how}; or leave this line "
        f"out (line {header[0]}) and give the columns by their numbers: {suggested_columns(body)}",
        header[0],
        inputs=("exclude", "columns"),
    )


def suggested_columns(rows: Sequence[tuple[int, Sequence[str]]]) -> str:
    """The columns of three coordinates, as an example of a statement.

    Parameters
    ----------
    rows : sequence of line number and cells

    Returns
    -------
    str
        The first three columns next to each other whose numbers have decimals and differ.

    >>> suggested_columns([(1, ["7", "face", "1.5", "2.5", "3.0"]), (2, ["8", "", "1", "2", "3"])])
    'x=3,y=4,z=5'
    """
    width = min(len(cells) for _, cells in rows)
    columns = [[cells[i] for _, cells in rows[:SAMPLE]] for i in range(width)]
    measured = [
        all(map(is_number_cell, cells)) and any("." in c or "," in c for c in cells)
        for cells in columns
    ]
    for start in range(width - 2):
        if all(measured[start : start + 3]):
            return ",".join(f"{axis}={start + i + 1}" for i, axis in enumerate("xyz"))
    return "x=1,y=2,z=3"


def _width(names: list[str] | None, body: list[tuple[int, list[str]]]) -> int:
    """Number of columns, without empty ones after the last separator."""
    widths = Counter(_filled(cells) for _, cells in body)
    usual = widths.most_common(1)[0][0] if names is None else _filled(names)
    return max(usual, 1)


def _filled(cells: Sequence[str]) -> int:
    """Number of cells up to the last that is not empty."""
    if cells and cells[-1]:  # most rows of a long table
        return len(cells)
    return max((i + 1 for i, cell in enumerate(cells) if cell), default=0)


def _padded(cells: Sequence[str], width: int) -> list[str]:
    return [*cells[:width], *[""] * (width - len(cells))]


def _cells_of_width(
    file: SourceFile, cells: list[str], width: int, names: list[str] | None, number: int
) -> list[str]:
    if _filled(cells) <= width <= len(cells) or (len(cells) == width):
        return cells[:width]
    count = max(_filled(cells), len(cells) if len(cells) < width else 0)
    expected = (
        f"the header names {width} columns" if names is not None else f"other lines have {width}"
    )
    line = " ".join(filter(None, cells))
    if _filled(cells) < FEWEST_NUMBERS and changes_rows(line):
        raise file.error(
            f"'{shortened(line)}' is between the rows, and may change the meaning of the rows "
            "after it: give its content in a column, or split the table there",
            number,
        )
    decimal = count > width and not any("." in cell for cell in cells)
    raise file.error(
        f"{count} values, but {expected}"
        + (
            "; are there decimal commas? They look like the separators: save the table "
            "with semicolons"
            if decimal
            else "; correct the line, or exclude it"
        ),
        number,
        inputs=() if decimal else ("exclude",),
    )


def _stated_unit(file: SourceFile, notes: Sequence[str]) -> str | None:
    """Unit of length that comments and lines before the table state."""
    found = units_in_text(notes)
    if len(found) > 1:
        raise file.error(
            f"the comments give several units: {', '.join(sorted(found))}",
            inputs=("units",),
        )
    return found.pop() if found else None
