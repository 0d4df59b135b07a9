"""CSV with a header line and # comments: reading that knows its lines, and writing."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.errors import InputError
from pretravel.whole_file import whole_file

SIGNIFICANT_DIGITS = 12
"""Of numbers written; the contract asks for at least nine."""


@dataclass(frozen=True)
class CsvTable:
    """Cells as text, by column, with the line of the file that each row stands on.

    Attributes
    ----------
    path : str
    columns : mapping of str to tuple of str
    lines : tuple of int
        Line numbers of the rows, from 1.
    header_line : int
    """

    path: str
    columns: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]
    header_line: int

    def __len__(self) -> int:
        return len(self.lines)

    def has(self, *names: str) -> bool:
        """Whether all these columns are there."""
        return all(name in self.columns for name in names)

    def require(self, *names: str, what: str) -> None:
        """Columns that must be there, or an error that lists what is there.

        Raises
        ------
        InputError
        """
        missing = [name for name in names if name not in self.columns]
        if not missing:
            return
        there = ", ".join(self.columns)
        hint = ""
        inches = [n for n in self.columns if n.endswith(("_in", "_inch"))]
        cased = [n for n in self.columns if n.lower() in missing]
        if cased:
            hint = f" ({cased[0]} differs only in case: write {cased[0].lower()})"
        elif inches:
            hint = f" ({inches[0]} looks like inches: convert to mm, columns x_mm, y_mm, z_mm)"
        raise InputError(
            f"{what} need{'' if what.endswith('s') else 's'} the column"
            f"{'s' if len(missing) > 1 else ''} {', '.join(missing)}; the file has {there}{hint}",
            path=self.path,
            line=self.header_line,
        )

    def numbers(self, *names: str) -> FloatArray:
        """Columns as numbers, (rows, len(names)).

        Raises
        ------
        InputError
            A cell that is empty, not a number or not finite, with its line.
        """
        result = np.empty((len(self), len(names)))
        for index, name in enumerate(names):
            cells = self.columns[name]
            try:
                result[:, index] = np.array(cells, dtype=np.float64)
            except ValueError:
                self._complain(name)
            if not np.all(np.isfinite(result[:, index])):
                self._complain(name)
        return result

    def _complain(self, name: str) -> None:
        for cell, line in zip(self.columns[name], self.lines, strict=True):
            try:
                good = bool(np.isfinite(float(cell)))
            except ValueError:
                good = False
            if not good:
                what = "is empty" if not cell else f"is '{cell}', which is not a finite number"
                decimal = (
                    "; use a point as decimal sign" if "," in cell or cell.count(".") > 1 else ""
                )
                raise InputError(f"{name} {what}{decimal}", path=self.path, line=line)

    def number(self, row: int, name: str) -> float:
        """One cell as a number."""
        return float(self.columns[name][row])


def read_csv_table(path: str | Path) -> CsvTable:
    r"""Read a CSV file: comma-separated, a header line, # comments, blank lines skipped.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    CsvTable

    Raises
    ------
    InputError
        No such file, not text, empty, no header, rows of another length, other
        separators.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "a.csv"
    >>> _ = file.write_text("# note\nx_mm,y_mm\n1,2\n")
    >>> read_csv_table(file).numbers("x_mm", "y_mm").tolist()
    [[1.0, 2.0]]
    """
    place = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError("there is no such file", path=place) from None
    except UnicodeDecodeError as error:
        if error.object[:2] in (b"\xff\xfe", b"\xfe\xff"):
            hint = "this file is UTF-16 text; save it as CSV UTF-8"
        elif b"\0" in error.object:
            hint = "this is not a text file; a CSV file is needed"
        else:
            hint = "this file is not UTF-8 text (Latin-1, perhaps); save it as CSV UTF-8"
        raise InputError(hint, path=place) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=place) from error
    if "\0" in text:
        raise InputError("this is not a text file; a CSV file is needed", path=place)

    header: list[str] | None = None
    header_line = 0
    rows: list[list[str]] = []
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if not stripped or stripped.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([line]))]
        if header is None:
            header, header_line = cells, number
            _check_header(header, stripped, place, number)
            continue
        if len(cells) != len(header):
            decimal = len(cells) > len(header) and ("." not in line)
            raise InputError(
                f"{len(cells)} values, but the header names {len(header)} columns"
                + ("; are there decimal commas? Use points" if decimal else ""),
                path=place,
                line=number,
            )
        rows.append(cells)
        lines.append(number)
    if header is None:
        raise InputError(
            "the file is empty; a header line with column names and rows are needed", path=place
        )
    if not rows:
        raise InputError("there is a header but no rows", path=place, line=header_line)
    return CsvTable(
        path=place,
        columns=dict(zip(header, zip(*rows, strict=True), strict=True)),
        lines=tuple(lines),
        header_line=header_line,
    )


def _check_header(header: list[str], line: str, place: str, number: int) -> None:
    if len(header) == 1 and (";" in line or "\t" in line):
        separator = "semicolons" if ";" in line else "tabs"
        raise InputError(
            f"the columns are separated by {separator}; save the file with commas, and points as "
            "decimal signs",
            path=place,
            line=number,
        )
    numeric = 0
    for cell in header:
        try:
            float(cell)
            numeric += 1
        except ValueError:
            pass
    if numeric == len(header):
        raise InputError(
            "the first line holds numbers; a header with the column names is needed "
            "(x_mm,y_mm,z_mm,nx,ny,nz for touches)",
            path=place,
            line=number,
        )
    repeated = sorted({name for name in header if header.count(name) > 1})
    if repeated:
        raise InputError(f"the column {repeated[0]} is there twice", path=place, line=number)


def format_number(value: float) -> str:
    """A number for a CSV cell, with twelve significant digits; nothing for what is not a number.

    >>> format_number(1.0 / 3.0), format_number(25.0), format_number(math.nan)
    ('0.333333333333', '25', '')
    """
    if math.isnan(value):
        return ""
    return f"{value:.{SIGNIFICANT_DIGITS}g}"


def exact_number(value: float) -> str:
    """Every digit, without an exponent: reads back the same.

    >>> exact_number(0.1), exact_number(-0.0), exact_number(1e-7)
    ('0.1', '0', '0.0000001')
    """
    return np.format_float_positional(value + 0.0, trim="-")


def write_csv_table(path: str | Path, columns: Mapping[str, npt.ArrayLike | Sequence[str]]) -> None:
    """Write columns of equal length as CSV, whole or not at all.

    No comment lines are written: spreadsheets and most readers stumble over them.

    Parameters
    ----------
    path : str or Path
    columns : mapping of str to (n,) numbers or strings
    """
    cells = []
    for values in columns.values():
        array = np.asarray(values)
        if array.dtype.kind == "f":
            cells.append([format_number(value) for value in array.tolist()])
        else:
            cells.append([str(value) for value in array.tolist()])
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*cells, strict=True))
    with whole_file(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")
