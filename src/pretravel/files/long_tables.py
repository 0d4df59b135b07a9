"""Long tables of touches, CSV or Parquet: pyarrow reads and writes them part by part.

The first rows state how the table is understood, as in any table; the other rows are numbers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy.typing as npt

from pretravel.base import InputError, PretravelError, whole_file
from pretravel.files.csv_table import write_csv_header, write_csv_rows
from pretravel.files.file_format import FileReadings, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.many_numbers import arrow_column, floats_of_arrow
from pretravel.files.number_tables import (
    LABEL,
    NEEDED,
    csv_options,
    has_plain_separator,
    head_of_parquet,
    head_of_text,
    number_table,
)
from pretravel.files.source_file import SourceFile
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
_MISSING = (
    f"a table of more than {LONG_TABLE:,} rows is read with the package pyarrow: "
    'pip install "pretravel[tables]"'
)
_Columns: TypeAlias = Mapping[str, npt.ArrayLike | Sequence[str]]


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
        decimals = self.head.table.decimals(*NEEDED[3:])
        first_line = self.head.table.lines[0] if self.is_text else 1
        try:
            for batch in self._lines(rows) if self.is_text else self._stored(rows):
                table = number_table(file, self.head, batch, first_line + row, decimals)
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
        from pyarrow import csv

        block = max(rows * self.path.stat().st_size // max(self.count, 1), 1000)
        reader = csv.open_csv(self.path, **csv_options(self.head, block))
        for batch in reader:
            yield dict(zip(self.head.places, batch.columns, strict=True))

    def _stored(self, rows: int) -> Iterator[Any]:
        """Rows of Parquet."""
        from pyarrow import parquet

        with parquet.ParquetFile(self.path) as stored:
            # One group of rows after the other: of all groups at once, pyarrow keeps what it read.
            for group in range(stored.num_row_groups):
                for batch in stored.iter_batches(batch_size=rows, row_groups=[group]):
                    yield {
                        name: batch.column(i) if name == LABEL else floats_of_arrow(batch.column(i))
                        for name, i in self.head.places.items()
                    }


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
        or options.tip
        or options.series
        or options.reference_diameter
        or options.look_only
    ):
        return None
    if not path.is_file() or path.stat().st_size < LONG_TABLE:  # a row has more than one byte
        return None
    is_text = path.suffix.lower() != ".parquet"
    try:
        content, count = (head_of_text if is_text else head_of_parquet)(path)
        file = SourceFile(str(path), content)
        if count < LONG_TABLE or not (options.columns or format_of(file) in (CSV, PARQUET)):
            return None
        head = read_touch_columns(file, options)
        if not head.table.has(*NEEDED) or (is_text and not has_plain_separator(head)):
            return None
        if head.whole:
            return None
        import pyarrow.csv  # noqa: F401
    except ModuleNotFoundError:
        raise PretravelError(_MISSING) from None
    except (InputError, OSError, ValueError):  # the usual reader says what is wrong
        return None
    return LongTable(path, head, options, count)


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
        stream = stack.enter_context(temporary.open("wb"))

        def append(columns: _Columns) -> None:
            if not stream.tell():
                write_csv_header(stream, columns)
            write_csv_rows(stream, columns)

        yield append


def _parquet_appender(path: Path, stack: ExitStack) -> Callable[[_Columns], None]:
    import pyarrow as pa
    from pyarrow import parquet

    writers: list[Any] = []

    def append(columns: _Columns) -> None:
        part = pa.table({name: arrow_column(values) for name, values in columns.items()})
        if not writers:
            made = parquet.ParquetWriter(str(path), part.schema, use_dictionary=False)
            writers.append(stack.enter_context(made))
        writers[0].write_table(part)

    return append
