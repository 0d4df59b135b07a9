"""Long tables of touches, CSV or Parquet: pyarrow reads and writes them part by part.

The first rows state how the table is understood, as in any table; the other rows are numbers.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import LARGEST_NUMBER, FloatArray, InputError, PretravelError, whole_file
from pretravel.files.csv_table import CsvTable, csv_rows_text, csv_table_text
from pretravel.files.file_format import FileReadings, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.source_file import SourceFile
from pretravel.files.spreadsheet_cells import cell_content
from pretravel.files.table_formats import CSV, PARQUET
from pretravel.files.touch_columns import (
    TouchColumns,
    read_touch_columns,
    refuse_control_characters,
)
from pretravel.files.touches_csv import touches_of_columns

LONG_TABLE = 400_000
"""Rows from which a table is read part by part."""
WRITTEN_IN_PARTS = (".csv", ".parquet")
"""Endings of the files that are written part by part."""
_ROWS = 100_000
"""Rows of a part, about: its touches, points and text take about 200 MB."""
_HEAD_ROWS = 2_000
_HEAD_BYTES = 400_000
_NEEDED = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")
_TEXT = "label"
_MISSING = (
    f"a table of more than {LONG_TABLE:,} rows is read with the package pyarrow: "
    'pip install "pretravel[tables]"'
)
_Columns: TypeAlias = Mapping[str, npt.ArrayLike | Sequence[str]]


@dataclass(frozen=True)
class _NumberTable(CsvTable):
    """A table whose columns are numbers already, beside the labels.

    Attributes
    ----------
    values : mapping of str to (n,) float
        In the units of `TouchColumns`.
    printed_decimals : int
        What `decimals` returns.
    """

    values: Mapping[str, FloatArray] = field(default_factory=dict)
    printed_decimals: int = 9

    def numbers(self, *names: str) -> FloatArray:
        """Return columns as numbers, (rows, len(names))."""
        return np.column_stack([self.values[name] for name in names])

    def decimals(self, *_names: str) -> int:
        """The most decimals of the normals in the head of the file."""
        return self.printed_decimals


@dataclass(frozen=True)
class LongTable:
    """A long table of touches, and how it is understood.

    Attributes
    ----------
    path : Path
    head : TouchColumns
        Of its first rows.
    options : ReadingOptions
    count : int
        Touches: of Parquet exact, of text estimated from its size.
    """

    path: Path
    head: TouchColumns
    options: ReadingOptions
    count: int

    @property
    def understood(self) -> str:
        """How the table is understood, where it has another form than this package's own."""
        return "" if self.head.own_form else self.head.understood

    @property
    def is_text(self) -> bool:
        """Whether the file is text, not Parquet."""
        return self.path.suffix.lower() != ".parquet"

    def readings(self, rows: int = _ROWS) -> Iterator[FileReadings]:
        """Read the touches part by part.

        Parameters
        ----------
        rows : int
            Of a part, about.

        Yields
        ------
        FileReadings
            The touches are numbered from their row in the file.

        Raises
        ------
        InputError
            As `read_touches`; a cell is no number, or a line is no row.
        """
        from pyarrow import ArrowException

        file, row = SourceFile(str(self.path), b""), 0
        decimals = self.head.table.decimals(*_NEEDED[3:])
        first_line = self.head.table.lines[0] if self.is_text else 1
        try:
            for batch in self._lines(rows) if self.is_text else self._stored(rows):
                table = self._numbers(file, batch, first_line + row, decimals)
                columns = replace(self.head, table=table)
                refuse_control_characters(table)
                touches, warnings = touches_of_columns(file, columns, self.options)
                numbered = replace(touches, reading="", numbered_from=row + 1)
                yield FileReadings(numbered, warnings=warnings)
                row += len(table)
        except (ArrowException, UnicodeDecodeError) as error:
            reason = " ".join(str(error).split())[:200]
            found = re.fullmatch(r"(?:.*: )?Row #([0-9]+): (.*)", reason)
            raise file.error(
                f"{found[2] if found else reason} (a table of more than {LONG_TABLE:,} rows has "
                "numbers in its columns, and no comments behind its header)",
                int(found[1]) if found else None,
            ) from None

    def _lines(self, rows: int) -> Iterator[Any]:
        """Rows of text; pyarrow names the line where one is damaged."""
        from pyarrow import csv, float64, string

        head, places = self.head.table, self.head.places
        names = [f"{i}" for i in range(len(places) + len(head.unread))]
        used = {f"{i}": string() if name == _TEXT else float64() for name, i in places.items()}
        reader = csv.open_csv(
            self.path,
            csv.ReadOptions(
                use_threads=False,  # with threads it does not name the line
                block_size=max(rows * self.path.stat().st_size // max(self.count, 1), 1000),
                skip_rows=head.lines[0] - 1,
                column_names=names,
            ),
            csv.ParseOptions(delimiter=self.head.separator),
            csv.ConvertOptions(
                include_columns=list(used),
                column_types=used,
                decimal_point="," if head.decimal == "," else ".",
                null_values=[],
                strings_can_be_null=False,
            ),
        )
        for batch in reader:
            yield dict(zip(places, batch.columns, strict=True))

    def _stored(self, rows: int) -> Iterator[Any]:
        """Rows of Parquet."""
        from pyarrow import float64, parquet

        with parquet.ParquetFile(self.path) as stored:
            # One group of rows after the other: of all groups at once, pyarrow keeps what it read.
            for group in range(stored.num_row_groups):
                for batch in stored.iter_batches(batch_size=rows, row_groups=[group]):
                    yield {
                        name: batch.column(i) if name == _TEXT else batch.column(i).cast(float64())
                        for name, i in self.head.places.items()
                    }

    def _numbers(
        self, file: SourceFile, columns: Mapping[str, Any], first_line: int, decimals: int
    ) -> _NumberTable:
        """The numbers and labels of a part."""
        values: dict[str, FloatArray] = {}
        cells: dict[str, tuple[str, ...]] = {}
        for name, column in columns.items():
            if name == _TEXT:
                stripped = ((cell or "").strip() for cell in column.to_pylist())
                cells[name] = tuple(map(cell_content, stripped) if self.is_text else stripped)
                continue
            cells[name] = ()
            values[name] = column.to_numpy(zero_copy_only=False)
            if np.any(odd := ~(np.abs(values[name]) <= LARGEST_NUMBER)):
                row = int(np.argmax(odd))
                what = "is empty" if column[row].as_py() is None else "is no number of this size"
                raise file.error(
                    f"{self.head.table.titles.get(name, name)} {what}", first_line + row
                )
            if (scale := self.head.table.scales.get(name, 1.0)) != 1.0:
                values[name] = scale * values[name] + 0.0
        count = len(next(iter(values.values())))
        return _NumberTable(
            **{name: getattr(self.head.table, name) for name in _KEPT},
            columns=cells,
            lines=tuple(range(first_line, first_line + count)),
            values=values,
            printed_decimals=decimals,
        )


_KEPT = ("path", "header_line", "decimal", "scales", "titles", "unread")
"""What each part has of the head."""


def long_table(path: str | Path, options: ReadingOptions | None = None) -> LongTable | None:
    """Open a long table of touches, for reading part by part.

    Parameters
    ----------
    path : str or Path
    options : ReadingOptions, optional
        Columns, unit and decimal sign.

    Returns
    -------
    LongTable or None
        None: the file is short, is no table of numbers with normals (CSV or Parquet), cannot be
        understood by its first rows, or the options need all of its touches at once. It is then
        read whole.

    Raises
    ------
    PretravelError
        pyarrow is not installed.
    """
    path, options = Path(path), options or ReadingOptions()
    if (
        options.exclude
        or options.plan
        or options.normal
        or options.double_touches
        or options.reference_diameter
        or options.look_only
    ):
        return None
    if not path.is_file() or path.stat().st_size < LONG_TABLE:  # a row has more than one byte
        return None
    is_text = path.suffix.lower() != ".parquet"
    try:
        content, count = (_head_of_text if is_text else _head_of_parquet)(path)
        file = SourceFile(str(path), content)
        if count < LONG_TABLE or not (options.columns or format_of(file) in (CSV, PARQUET)):
            return None
        head = read_touch_columns(file, options)
        if not head.table.has(*_NEEDED) or (is_text and not _has_plain_separator(head)):
            return None
        import pyarrow.csv  # noqa: F401
    except ModuleNotFoundError:
        raise PretravelError(_MISSING) from None
    except (InputError, OSError, ValueError):  # the usual reader says what is wrong
        return None
    return LongTable(path, head, options, count)


def _head_of_text(path: Path) -> tuple[bytes, int]:
    """The first lines, which are in UTF-8, and the estimated number of all lines."""
    with path.open("rb") as stream:
        content = stream.read(_HEAD_BYTES)
    content = content[: content.rfind(b"\n") + 1]
    content.decode("utf-8")
    return content, path.stat().st_size * content.count(b"\n") // max(len(content), 1)


def _has_plain_separator(head: TouchColumns) -> bool:
    """Whether cells are separated by one sign, and no cell of a row may be absent."""
    width = len(head.places) + len(head.table.unread)
    return len(head.separator.strip(" ")) == 1 and max(head.places.values()) < width


def _head_of_parquet(path: Path) -> tuple[bytes, int]:
    """The first rows as a file of their own, and the number of all rows; 0: not all are numbers."""
    import pyarrow as pa
    from pyarrow import parquet

    stream = io.BytesIO()
    with parquet.ParquetFile(path) as stored:
        kinds = [field.type for field in stored.schema_arrow]
        plain = (pa.types.is_float64, pa.types.is_integer, pa.types.is_string)
        if not all(any(is_kind(kind) for is_kind in plain) for kind in kinds):
            return b"", 0
        first = next(stored.iter_batches(batch_size=_HEAD_ROWS), None)
        if first is None:
            return b"", 0
        parquet.write_table(pa.Table.from_batches([first]), stream)
        return stream.getvalue(), int(stored.metadata.num_rows)


@contextmanager
def written_in_parts(path: str | Path) -> Iterator[Callable[[_Columns], None]]:
    r"""A function that appends rows to a table; the table replaces `path` at the end.

    Parameters
    ----------
    path : str or Path
        Its ending is one of `WRITTEN_IN_PARTS`.

    Yields
    ------
    callable
        Takes columns of equal length, the same names each time.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.csv"
    >>> with written_in_parts(path) as append:
    ...     append({"x_mm": [0.5]})
    ...     append({"x_mm": [1.5]})
    >>> path.read_text()
    'x_mm\n0.5\n1.5\n'
    """
    with whole_file(path) as temporary, ExitStack() as stack:
        if Path(path).suffix.lower() == ".parquet":
            yield _parquet_appender(temporary, stack)
            return
        stream = stack.enter_context(temporary.open("w", encoding="utf-8", newline=""))

        def append(columns: _Columns) -> None:
            stream.write(csv_rows_text(columns) if stream.tell() else csv_table_text(columns))

        yield append


def _parquet_appender(path: Path, stack: ExitStack) -> Callable[[_Columns], None]:
    import pyarrow as pa
    from pyarrow import parquet

    writers: list[Any] = []

    def append(columns: _Columns) -> None:
        part = pa.table({name: np.asarray(values) for name, values in columns.items()})
        if not writers:
            writers.append(stack.enter_context(parquet.ParquetWriter(str(path), part.schema)))
        writers[0].write_table(part)

    return append
