"""CSV with a header line and # comments: reading that keeps the line numbers, and writing."""

from __future__ import annotations

import csv
import io
import math
import re
import string
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np
import numpy.typing as npt

from pretravel.base import LARGEST_NUMBER, FloatArray, InputError, whole_file
from pretravel.files.many_numbers import (
    SIGNIFICANT_DIGITS,
    is_column,
    rows_by_arrow,
    takes_arrow,
)
from pretravel.files.source_file import Source, SourceFile, opened, shortened

_PLAIN_FIRST = f"{string.ascii_letters}{string.digits}_[".encode()
_PLAIN = _PLAIN_FIRST + b"]. :/#+-"


@dataclass(frozen=True)
class CsvTable:
    """Cells as text, by column, and the line of the file of each row.

    Attributes
    ----------
    path : str
    columns : mapping of str to tuple of str
    lines : tuple of int
        Line numbers of the rows, from 1.
    header_line : int
    decimal : str
        Decimal sign of the numbers.
    scales : mapping of str to float
        Factor of the numbers of a column, where it is not 1.
    titles : mapping of str to str
        The file's own name of a column, for messages, where it is another.
    unread : tuple of str
        Names of other columns of the file.
    of_touches : bool
        A line can be excluded where touches are read, and only there.
    comments : tuple of line and text
    """

    path: str
    columns: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]
    header_line: int
    decimal: str = "."
    scales: Mapping[str, float] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    unread: tuple[str, ...] = ()
    of_touches: bool = False
    comments: tuple[tuple[int, str], ...] = ()

    def __len__(self) -> int:
        return len(self.lines)

    def has(self, *names: str) -> bool:
        """Whether the table has all these columns."""
        return all(name in self.columns for name in names)

    def require(self, *names: str, what: str) -> None:
        """Check that the table has these columns.

        Raises
        ------
        InputError
            A column is missing; the message lists the columns of the file.
        """
        missing = [name for name in names if name not in self.columns]
        if not missing:
            return
        there = ", ".join([*(self.titles.get(name, name) for name in self.columns), *self.unread])
        cased = [n for n in self.columns if n.lower() in missing]
        hint = f" ({cased[0]} differs only in case: write {cased[0].lower()})" if cased else ""
        raise InputError(
            f"{what} need{'' if what.endswith('s') else 's'} the column"
            f"{'s' if len(missing) > 1 else ''} {', '.join(missing)}; the file has {there}{hint}",
            path=self.path,
            line=self.header_line or None,
            inputs=("columns",),
        )

    def others(self, *known: str) -> tuple[str, ...]:
        """Names of other columns that are not empty; one named remark is for people.

        >>> CsvTable("a.csv", {"u": ("1",), "k": ("2",), "remark": ("x",)}, (2,), 1).others("u")
        ('k',)
        """
        named = (*known, "remark")
        return tuple(
            name for name, cells in self.columns.items() if name not in named and any(cells)
        )

    def refuse_others(self, *known: str, what: str, hint: str = "") -> None:
        """Refuse what the table states in other columns.

        Raises
        ------
        InputError
            There is another column; the message names what is wrong and the columns that are known.
        """
        if others := self.others(*known):
            raise InputError(
                f"{what} has no column '{shortened(others[0])}'{hint}; it can have "
                f"{', '.join(known)}, and remark, which is not evaluated",
                path=self.path,
                line=self.header_line or None,
            )

    def numbers(self, *names: str) -> FloatArray:
        """Return columns as numbers, (rows, len(names)).

        Raises
        ------
        InputError
            A cell is empty, is not a finite number, or is larger than any measured value; the
            message contains the line.
        """
        result = np.empty((len(self), len(names)))
        for index, name in enumerate(names):
            cells: Sequence[str] = self.columns[name]
            if self.decimal != "." or any("−" in cell for cell in cells):
                cells = [self._plain(cell) for cell in cells]
            try:
                values = np.array(cells, dtype=np.float64)
            except ValueError:
                self._refuse_cells(name)
            if any("_" in cell for cell in cells):  # which numpy reads as Python does
                self._refuse_cells(name)
            if not np.all(np.abs(values) <= LARGEST_NUMBER):
                self._refuse_cells(name)
            scale = self.scales.get(name, 1.0)
            result[:, index] = values if scale == 1.0 else scale * values + 0.0
        return result

    def _plain(self, cell: str) -> str:
        """A cell with a point as decimal sign and the minus of ASCII."""
        if self.decimal != ".":
            cell = "not a number" if "." in cell else cell.replace(self.decimal, ".")
        return cell.replace("−", "-")

    def _refuse_cells(self, name: str) -> NoReturn:
        """Raise an error for the first cell of a column that is not a finite number."""
        cells = zip(self.columns[name], self.lines, strict=True)
        cell, line = next(pair for pair in cells if not _is_value(self._plain(pair[0])))
        if not cell:
            what = "is empty"
        elif _is_finite(self._plain(cell)):
            what = f"is '{shortened(cell)}', which is larger than any measured value"
        else:
            what = f"is '{shortened(cell)}', which is not a finite number"
        sign, other = ("comma", ".") if self.decimal == "," else ("point", ",")
        hint = f"; use a {sign} as decimal sign" if other in cell or cell.count(".") > 1 else ""
        if not hint:
            hint = "; correct it" + (", or exclude the line" if self.of_touches else "")
        raise InputError(
            f"{self.titles.get(name, name)} {what}{hint}",
            path=self.path,
            line=line,
            inputs=("exclude",) if self.of_touches else (),
        )

    def decimals(self, *names: str) -> int:
        """The most decimals that a number of these columns is printed with.

        >>> CsvTable("a.csv", {"nx": ("0.5", "1.25")}, (2, 3), 1).decimals("nx")
        2
        """
        return max(_decimals(cell, self.decimal) for name in names for cell in self.columns[name])

    def number(self, row: int, name: str) -> float:
        """Return one cell as a number."""
        return float(self.columns[name][row])


def read_csv_table(source: Source) -> CsvTable:
    r"""Read a CSV file: commas, a header line, # comments; blank lines are skipped.

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        The file does not exist, is not UTF-8 text, is empty, has no header, has rows of another
        length or other separators.

    >>> file = SourceFile("a.csv", b"# note\nx_mm,y_mm\n1,2\n")
    >>> read_csv_table(file).numbers("x_mm", "y_mm").tolist()
    [[1.0, 2.0]]
    """
    file = opened(source)
    header: list[str] | None = None
    header_line = 0
    rows: list[list[str]] = []
    lines: list[int] = []
    comments: list[tuple[int, str]] = []
    for number, line in enumerate(_text(file).splitlines(), start=1):
        if line.lstrip().startswith("#"):
            comments.append((number, line.strip()))
            continue
        if not line.strip():
            continue
        cells = _cells(file, line, number)
        if header is None:
            _check_header(file, cells, line.strip(), number)
            header, header_line = cells, number
            continue
        if len(cells) != len(header):
            decimal = len(cells) > len(header) and "." not in line
            raise file.error(
                f"{len(cells)} values, but the header names {len(header)} columns"
                + ("; are there decimal commas? Use points" if decimal else ""),
                number,
            )
        rows.append(cells)
        lines.append(number)
    if header is None:
        raise file.error("the file is empty; a header line with column names and rows are needed")
    if not rows:
        raise file.error("the file has a header but no rows", header_line)
    columns = dict(zip(header, zip(*rows, strict=True), strict=True))
    return CsvTable(file.path, columns, tuple(lines), header_line, comments=tuple(comments))


def _text(file: SourceFile) -> str:
    """Decode a CSV file. Other encodings than UTF-8 are refused: labels could change."""
    try:
        text = file.content.decode("utf-8-sig")
    except UnicodeDecodeError:
        if file.content[:2] in (b"\xff\xfe", b"\xfe\xff"):
            hint = "this file is UTF-16 text; save it as CSV UTF-8"
        elif b"\0" in file.content:
            hint = "this is not a text file; a CSV file is needed"
        else:
            hint = "this file is not UTF-8 text (Latin-1, perhaps); save it as CSV UTF-8"
        raise file.error(hint) from None
    if "\0" in text:
        raise file.error("this is not a text file; a CSV file is needed")
    return text


def _cells(file: SourceFile, line: str, number: int) -> list[str]:
    if '"' not in line and len(line) < csv.field_size_limit():
        found = [cell.strip() for cell in line.split(",")]
        return found if "'" not in line else [cell_content(cell) for cell in found]
    try:
        return [cell_content(cell.strip()) for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise file.error(
            f"the cells cannot be separated ({error}): is a quote that opens a cell not closed?",
            number,
        ) from None


def _check_header(file: SourceFile, header: list[str], line: str, number: int) -> None:
    if len(header) == 1 and (";" in line or "\t" in line):
        separator = "semicolons" if ";" in line else "tabs"
        raise file.error(
            f"the columns are separated by {separator}; save the file with commas, and points as "
            "decimal signs",
            number,
        )
    if all(_is_number(cell) for cell in header):
        raise file.error(
            "the first line holds numbers; a header with the column names is needed "
            "(x_mm,y_mm,z_mm,nx,ny,nz for touches)",
            number,
        )
    repeated = sorted(name for name, count in Counter(header).items() if count > 1)
    if repeated:
        raise file.error(f"the column {shortened(repeated[0])} occurs twice", number)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell  # a number of Python's programs, 1_0, but of no file


def _is_finite(cell: str) -> bool:
    return _is_number(cell) and math.isfinite(float(cell))


def _decimals(cell: str, sign: str) -> int:
    """Decimals that a number is printed with; many for one with an exponent."""
    if "e" in cell.lower():
        return 9
    return len(cell.partition(sign)[2])


def _is_value(cell: str) -> bool:
    return _is_number(cell) and abs(float(cell)) <= LARGEST_NUMBER


def format_number(value: float) -> str:
    """Format a number as a CSV cell, with twelve significant digits; an empty cell for NaN.

    >>> format_number(1.0 / 3.0), format_number(25.0), format_number(math.nan)
    ('0.333333333333', '25', '')
    """
    if math.isnan(value):
        return ""
    return f"{value:.{SIGNIFICANT_DIGITS}g}"


def exact_number(value: float) -> str:
    """Format a number with every digit, without an exponent; reading it returns the same number.

    >>> exact_number(0.1), exact_number(-0.0), exact_number(1e-7)
    ('0.1', '0', '0.0000001')
    """
    return np.format_float_positional(value + 0.0, trim="-")


def write_csv_table(path: str | Path, columns: Mapping[str, npt.ArrayLike | Sequence[str]]) -> None:
    """Write columns of equal length as CSV. An error leaves no partial file.

    No comment lines are written: spreadsheets and many other readers do not skip them. Text that a
    spreadsheet would execute is marked as text; `read_csv_table` returns it as it was.

    Parameters
    ----------
    path : str or Path
    columns : mapping of str to (n,) numbers or strings
    """
    with whole_file(path) as temporary, temporary.open("wb") as stream:
        write_csv_header(stream, columns)
        write_csv_rows(stream, columns)


def csv_table_text(columns: Mapping[str, npt.ArrayLike | Sequence[str]]) -> str:
    r"""The text of a file as `write_csv_table` writes it.

    >>> csv_table_text({"name": ["a"], "x_mm": [0.5]})
    'name,x_mm\na,0.5\n'
    """
    stream = io.BytesIO()
    write_csv_header(stream, columns)
    write_csv_rows(stream, columns)
    return stream.getvalue().decode()


def write_csv_header(stream: BinaryIO, names: Iterable[str]) -> None:
    """Write the names of columns."""
    header = io.StringIO()
    csv.writer(header, lineterminator="\n").writerow([harmless_cell(name) for name in names])
    stream.write(header.getvalue().encode())


def write_csv_rows(stream: BinaryIO, columns: Mapping[str, npt.ArrayLike | Sequence[str]]) -> None:
    """Write the rows alone of a file as `write_csv_table` writes it."""
    arrays = [_array(values) for values in columns.values()]
    numbers = [not is_column(array) and array.dtype.kind == "f" for array in arrays]
    if all(
        np.isfinite(a).all() if is_number else _is_plain(a)
        for a, is_number in zip(arrays, numbers, strict=True)
    ):
        if takes_arrow(len(arrays[0]) * sum(numbers) if arrays else 0):
            rows_by_arrow(stream, arrays, numbers)
            return
        form = ",".join(f"%.{SIGNIFICANT_DIGITS}g" if number else "%s" for number in numbers)
        rows = zip(*(array.tolist() for array in arrays), strict=True)
        stream.write("".join(map((form + "\n").__mod__, rows)).encode())
        return
    cells = [
        [format_number(value) for value in array.tolist()]
        if is_number
        else [harmless_cell(str(value)) for value in array.tolist()]
        for array, is_number in zip(arrays, numbers, strict=True)
    ]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(zip(*cells, strict=True))
    stream.write(text.getvalue().encode())


def _array(values: npt.ArrayLike | Sequence[str]) -> Any:
    """A column as an array; of texts without a copy, which would give each the longest's room."""
    if is_column(values):
        return values
    texts = isinstance(values, list) and len(values) > 0 and isinstance(values[0], str)
    return np.asarray(values, dtype=object if texts else None)


def _is_plain(cells: Any) -> bool:
    """Whether texts are written as they are: no quotes, no marks, none empty."""
    if is_column(cells):  # numbers in brackets
        return True
    texts = list(map(str, cells.tolist()))
    return all(texts) and not (
        "".join(texts).encode().translate(None, _PLAIN)
        or "".join([text[0] for text in texts]).encode().translate(None, _PLAIN_FIRST)
    )


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
    return _MARK + text if _FORMULA.match(text) and not _is_bare_number(text) else text


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


def _is_bare_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return text == text.strip()
