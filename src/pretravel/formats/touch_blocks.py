"""Long tables of touches, read in blocks of some ten thousand rows.

The head of the file states how it is understood, and each block is read in that way. Blocks that
contain numbers and plain labels alone are read by pandas, and the rows of Parquet files are numbers
already; all other blocks are read as a small file of their own by the usual reader, so that a
damaged cell has the usual message.
"""

from __future__ import annotations

import io
import itertools
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import CsvTable
from pretravel.formats.file_format import FileReadings, ReadingOptions
from pretravel.formats.format_registry import format_of
from pretravel.formats.parquet import MISSING_PYARROW
from pretravel.formats.source_file import SourceFile
from pretravel.formats.table_formats import CSV
from pretravel.formats.touch_columns import (
    TouchColumns,
    read_touch_columns,
    refuse_control_characters,
)
from pretravel.formats.touches_csv import touches_of_columns
from pretravel.units import LARGEST_NUMBER

BLOCK_ROWS = 100_000
"""Rows of a block: its touches, points and text take about 200 MB."""
LONG_TABLE = 400_000
"""Rows from which a table is read in blocks."""
_HEAD_ROWS = 2_000
_HEAD_BYTES = 400_000
_NEEDED = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")
_TEXT = "label"
_IN_NUMBERS = b"0123456789+-eE\r\n"
_IN_WORDS = b" ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_."


@dataclass(frozen=True)
class _NumberTable(CsvTable):
    """A table whose columns are numbers already, beside the labels.

    Attributes
    ----------
    values : mapping of str to (n,) float
    printed_decimals : int
        Of the normals, in the head of the file.
    """

    values: Mapping[str, FloatArray] = field(default_factory=dict)
    printed_decimals: int = 9

    def numbers(self, *names: str) -> FloatArray:
        """Return columns as numbers, (rows, len(names))."""
        scaled = [
            self.values[name] if (scale := self.scales.get(name, 1.0)) == 1.0
            else scale * self.values[name] + 0.0
            for name in names
        ]  # fmt: skip
        return np.column_stack(scaled)

    def decimals(self, *_names: str) -> int:
        """The most decimals of the normals in the head of the file."""
        return self.printed_decimals


@dataclass(frozen=True)
class TouchBlock:
    """Rows of a long table that follow each other.

    Attributes
    ----------
    first_row : int
        From 0.
    first_line : int
        Of the file, from 1; of Parquet the number of the row.
    content : bytes or pyarrow.RecordBatch
    is_last : bool
    """

    first_row: int
    first_line: int
    content: Any
    is_last: bool = False


@dataclass(frozen=True)
class LongTable:
    """A long table of touches, and how it is understood.

    Attributes
    ----------
    path : Path
    options : ReadingOptions
    head : TouchColumns
        Of its first rows.
    before : bytes
        Of text: the lines before the first row.
    lines_before : int
    count : int
        Rows: of Parquet exact, of text estimated from its size.
    """

    path: Path
    options: ReadingOptions
    head: TouchColumns
    before: bytes
    lines_before: int
    count: int

    @property
    def is_parquet(self) -> bool:
        """Whether the file is Parquet, not text."""
        return self.path.suffix.lower() == ".parquet"

    @property
    def understood(self) -> str:
        """How the table is understood, where it has another form than this package's own."""
        return "" if self.head.own_form else self.head.understood

    def blocks(self, rows: int = BLOCK_ROWS) -> Iterator[TouchBlock]:
        """Read the blocks of the file one after the other.

        Parameters
        ----------
        rows : int
            Of a block; of text about so many.

        Yields
        ------
        TouchBlock
        """
        yield from self._batches(rows) if self.is_parquet else self._texts(rows)

    def _batches(self, rows: int) -> Iterator[TouchBlock]:
        from pyarrow import parquet

        first = 0
        with parquet.ParquetFile(self.path) as stored:
            for batch in stored.iter_batches(batch_size=rows):
                yield TouchBlock(first, first + 1, batch)
                first += batch.num_rows

    def _texts(self, rows: int) -> Iterator[TouchBlock]:
        size = max(rows * self.path.stat().st_size // max(self.count, 1), 1)
        first_row, first_line = 0, self.lines_before + 1
        with self.path.open("rb") as stream:
            stream.seek(len(self.before))
            content = stream.read(size) + stream.readline()
            while content:
                following = stream.read(size) + stream.readline()
                yield TouchBlock(first_row, first_line, content, is_last=not following)
                ends = content.count(b"\n")
                first_row, first_line = first_row + ends, first_line + ends
                content = following

    def read(self, block: TouchBlock) -> FileReadings:
        """Read the touches of a block.

        Parameters
        ----------
        block : TouchBlock

        Returns
        -------
        FileReadings
            The touches are numbered from the row of the block in the file.

        Raises
        ------
        InputError
            As `read_touches`.
        """
        file = SourceFile(str(self.path), b"")
        table = self._of_batch(block) if self.is_parquet else self._of_text(block)
        columns = self._read_with_care(block) if table is None else replace(self.head, table=table)
        refuse_control_characters(columns.table)
        self._refuse_other_lines(file, block, columns.table)
        touches, found = touches_of_columns(file, columns, self.options)
        numbered = replace(touches, reading="", numbered_from=block.first_row + 1)
        return FileReadings(numbered, warnings=found)

    def _refuse_other_lines(self, file: SourceFile, block: TouchBlock, table: CsvTable) -> None:
        """Touches without labels are numbered: each line of a block must then be a row."""
        if self.is_parquet or table.has(_TEXT) or block.is_last:
            return
        if len(table) != block.content.count(b"\n"):
            rows = set(table.lines)
            odd = next(line for line in itertools.count(block.first_line) if line not in rows)
            raise file.error(
                f"this line is no row; a table of more than {LONG_TABLE:,} rows is read in blocks, "
                "and without labels its rows are numbered: remove the line, or add a column of "
                "labels",
                odd,
            )

    def _read_with_care(self, block: TouchBlock) -> TouchColumns:
        """The columns of a block as the usual reader reads them, which names what is wrong."""
        if self.is_parquet:
            content, absent = _parquet_bytes([block.content]), (0, block.first_row)
        else:
            content = self.before + block.content
            absent = (self.lines_before, block.first_line - self.lines_before - 1)
        file = SourceFile(str(self.path), content, absent)
        columns = read_touch_columns(file, self.options)
        columns.table.require(*_NEEDED, what="touches")
        if columns.titles != self.head.titles:
            raise file.error(
                "from here on, the columns are understood in another way than at the beginning; "
                "state the columns",
                block.first_line,
                inputs=("columns",),
            )
        return columns

    def _of_text(self, block: TouchBlock) -> _NumberTable | None:
        """The numbers of a block of text; None where it is not plain."""
        head, content = self.head.table, block.content
        rows = content.count(b"\n") + (not content.endswith(b"\n"))
        has_words = head.has(_TEXT) or bool(head.unread)
        separator = self.head.separator
        decimal = b"," if head.decimal == "," else b"."
        plain = _IN_NUMBERS + separator.encode() + decimal + (_IN_WORDS if has_words else b"")
        width = len(self.head.places) + len(head.unread)
        unclear = (
            len(separator) != 1
            or not separator.strip(" ")
            or max(self.head.places.values()) >= width
        )
        if unclear or content.translate(None, plain):
            return None
        if content.count(separator.encode()) != rows * (width - 1):
            return None
        frame = _parsed(content, separator, decimal.decode(), self.head.places, width)
        if frame is None or len(frame) != rows:
            return None
        values = {
            name: frame[i].to_numpy() for name, i in self.head.places.items() if name != _TEXT
        }
        labels = None
        if head.has(_TEXT):
            labels = tuple(label.strip() for label in frame[self.head.places[_TEXT]])
        return self._number_table(values, labels, block.first_line, rows)

    def _of_batch(self, block: TouchBlock) -> _NumberTable | None:
        """The numbers of rows of a Parquet file; None where a column has other values."""
        import pyarrow as pa

        batch, values, labels = block.content, {}, None
        for name, i in self.head.places.items():
            column = batch.column(i)
            if column.null_count:
                return None
            if name == _TEXT and pa.types.is_string(column.type):
                labels = tuple(str(cell).strip() for cell in column.to_pylist())
            elif name != _TEXT and pa.types.is_float64(column.type):
                values[name] = column.to_numpy()
            else:
                return None
        return self._number_table(values, labels, block.first_line, batch.num_rows)

    def _number_table(
        self,
        values: dict[str, FloatArray],
        labels: tuple[str, ...] | None,
        first_line: int,
        rows: int,
    ) -> _NumberTable | None:
        head = self.head.table
        if not all(np.all(np.abs(column) <= LARGEST_NUMBER) for column in values.values()):
            return None  # the usual reader names the line
        columns: dict[str, tuple[str, ...]] = dict.fromkeys(values, ())
        if labels is not None:
            columns[_TEXT] = labels
        return _NumberTable(
            path=head.path,
            columns=columns,
            lines=tuple(range(first_line, first_line + rows)),
            header_line=head.header_line,
            decimal=head.decimal,
            scales=head.scales,
            titles=head.titles,
            unread=head.unread,
            values=values,
            printed_decimals=head.decimals(*_NEEDED[3:]),
        )


def _parsed(
    content: bytes, separator: str, decimal: str, places: Mapping[str, int], width: int
) -> Any:
    """The cells of plain rows as a data frame; None where a cell is no number."""
    import pandas as pd

    text = {i for i in range(width) if i not in places.values()} | {places.get(_TEXT, -1)}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return pd.read_csv(
                io.BytesIO(content),
                sep=separator,
                decimal=decimal,
                header=None,
                names=range(width),
                index_col=False,
                dtype={i: str if i in text else np.float64 for i in range(width)},
                na_filter=False,
                skip_blank_lines=False,
                # The default rounds as Python does from version 3 on.
                float_precision="round_trip" if pd.__version__.startswith("2.") else None,
            )
    except (ValueError, OverflowError, Warning):  # the usual reader names the line
        return None


def long_table(path: str | Path, options: ReadingOptions | None = None) -> LongTable | None:
    """Open a long table of touches, for reading in blocks.

    Parameters
    ----------
    path : str or Path
    options : ReadingOptions, optional
        Columns, unit and decimal sign.

    Returns
    -------
    LongTable or None
        None: the file is short, is no table with normals (CSV or Parquet), cannot be understood by
        its first rows, or the options need all of its touches at once. It is then read whole.

    Raises
    ------
    PretravelError
        pyarrow is not installed.
    """
    path, options = Path(path), options or ReadingOptions()
    if options.exclude or options.plan or options.reference_diameter or options.look_only:
        return None
    try:
        size = path.stat().st_size if path.is_file() else 0
    except OSError:
        return None
    if size < LONG_TABLE:  # a row has more than one byte
        return None
    is_parquet = path.suffix.lower() == ".parquet"
    try:
        found = _head_of_parquet(path) if is_parquet else _head_of_text(path, options)
        if found is None or found[1] < LONG_TABLE:
            return None
        file, count = found
        head = read_touch_columns(file, options)
    except InputError:
        return None
    if not head.table.has(*_NEEDED):
        return None
    lines_before = 0 if is_parquet else head.table.lines[0] - 1
    before = b"".join(itertools.islice(io.BytesIO(file.content), lines_before))
    return LongTable(path, options, head, before, lines_before, count)


def _head_of_text(path: Path, options: ReadingOptions) -> tuple[SourceFile, int] | None:
    """The first lines of a table, and the estimated number of its lines."""
    with path.open("rb") as stream:
        content = stream.read(_HEAD_BYTES)
    content = content[: content.rfind(b"\n") + 1]
    lines = content.count(b"\n")
    if not lines or b"\0" in content or not _is_utf8(content):
        return None
    if not options.columns and format_of(SourceFile(str(path), content)) is not CSV:
        return None
    return SourceFile(str(path), content), path.stat().st_size * lines // len(content)


def _is_utf8(content: bytes) -> bool:
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _head_of_parquet(path: Path) -> tuple[SourceFile, int]:
    """The first rows of a Parquet file as a file of their own, and the number of all rows."""
    try:
        from pyarrow import ArrowException, parquet
    except ModuleNotFoundError:
        raise PretravelError(MISSING_PYARROW) from None
    file = SourceFile(str(path), b"")
    try:
        with parquet.ParquetFile(path) as stored:
            count = int(stored.metadata.num_rows)
            first = next(stored.iter_batches(batch_size=_HEAD_ROWS), None)
    except (ArrowException, OSError, ValueError) as error:
        raise file.error(f"not a Parquet file that can be read: {error}") from None
    if first is None:
        raise file.error("the file has columns but no rows")
    return replace(file, content=_parquet_bytes([first])), count


def _parquet_bytes(batches: list[Any]) -> bytes:
    import pyarrow as pa
    from pyarrow import parquet

    stream = io.BytesIO()
    parquet.write_table(pa.Table.from_batches(batches), stream)
    return stream.getvalue()
