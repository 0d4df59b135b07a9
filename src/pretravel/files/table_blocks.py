"""Long tables, CSV of any separator or Parquet, in blocks of some ten thousand rows.

Blocks that contain numbers and plain labels alone are read by numpy, and the rows of Parquet files
are numbers already; all other blocks are for the usual reader, as a small file of their own.
"""

from __future__ import annotations

import io
import itertools
import warnings
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.extras import needed
from pretravel.base.units import LARGEST_NUMBER
from pretravel.files.csv_table import CsvTable
from pretravel.files.source_file import SourceFile

BLOCK_ROWS = 100_000
"""Rows of a block: its touches, points and text take about 200 MB."""
LONG_TABLE = 400_000
"""Rows from which a table is read in blocks."""
_HEAD_ROWS = 2_000
_HEAD_BYTES = 400_000
_TEXT = "label"
_IN_NUMBERS = b"0123456789+-eE\r\n"
_IN_WORDS = b" ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_."


@dataclass(frozen=True)
class NumberTable(CsvTable):
    """A table whose columns are numbers already, beside the labels.

    Attributes
    ----------
    values : mapping of str to (n,) float
    printed_decimals : int
        What `decimals` returns.
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
class TableBlock:
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
class TableInBlocks:
    """A long table, and where its columns are.

    Attributes
    ----------
    path : Path
    head : CsvTable
        Of the first rows; the columns of all blocks are understood as these.
    places : mapping of str to int
        The place of each column of `head` in the file, from 0.
    separator : str
        Of the cells of text.
    before : bytes
        Of text: the lines before the first row.
    lines_before : int
    count : int
        Rows: of Parquet exact, of text estimated from its size.
    printed_decimals : int
        What the tables of blocks return as their `decimals`.
    """

    path: Path
    head: CsvTable
    places: Mapping[str, int]
    separator: str
    before: bytes
    lines_before: int
    count: int
    printed_decimals: int = 9

    @property
    def is_parquet(self) -> bool:
        """Whether the file is Parquet, not text."""
        return self.path.suffix.lower() == ".parquet"

    def blocks(self, rows: int = BLOCK_ROWS) -> Iterator[TableBlock]:
        """Read the blocks of the file one after the other.

        Parameters
        ----------
        rows : int
            Of a block; of text about so many.

        Yields
        ------
        TableBlock
        """
        yield from self._batches(rows) if self.is_parquet else self._texts(rows)

    def _batches(self, rows: int) -> Iterator[TableBlock]:
        from pyarrow import parquet

        first = 0
        with parquet.ParquetFile(self.path) as stored:
            # One group of rows after the other: of all groups at once, pyarrow keeps what it read.
            for group in range(stored.num_row_groups):
                for batch in stored.iter_batches(batch_size=rows, row_groups=[group]):
                    yield TableBlock(first, first + 1, batch)
                    first += batch.num_rows

    def _texts(self, rows: int) -> Iterator[TableBlock]:
        size = max(rows * self.path.stat().st_size // max(self.count, 1), 1)
        first_row, first_line = 0, self.lines_before + 1
        with self.path.open("rb") as stream:
            stream.seek(len(self.before))
            content = stream.read(size) + stream.readline()
            while content:
                following = stream.read(size) + stream.readline()
                yield TableBlock(first_row, first_line, content, is_last=not following)
                ends = content.count(b"\n")
                first_row, first_line = first_row + ends, first_line + ends
                content = following

    def file_of(self, block: TableBlock) -> SourceFile:
        """A block as a small file of its own, in which messages name the lines of the whole."""
        if self.is_parquet:
            return SourceFile(str(self.path), _parquet_bytes([block.content]), (0, block.first_row))
        absent = (self.lines_before, block.first_line - self.lines_before - 1)
        return SourceFile(str(self.path), self.before + block.content, absent)

    def numbers(self, block: TableBlock) -> NumberTable | None:
        """The numbers and labels of a block; None where the usual reader must read it."""
        return self._of_batch(block) if self.is_parquet else self._of_text(block)

    def _of_text(self, block: TableBlock) -> NumberTable | None:
        """The numbers of a block of text; None where it is not plain."""
        content = block.content
        rows = content.count(b"\n") + (not content.endswith(b"\n"))
        has_words = self.head.has(_TEXT) or bool(self.head.unread)
        separator = self.separator
        decimal = b"," if self.head.decimal == "," else b"."
        plain = _IN_NUMBERS + separator.encode() + decimal + (_IN_WORDS if has_words else b"")
        width = len(self.places) + len(self.head.unread)
        unclear = (
            len(separator) != 1 or not separator.strip(" ") or max(self.places.values()) >= width
        )
        other_characters = content.translate(None, plain)
        if unclear or other_characters:
            return None
        if content.count(separator.encode()) != rows * (width - 1):
            return None
        lines = content.decode("ascii").splitlines()
        numbers = {name: i for name, i in self.places.items() if name != _TEXT}
        cells = _parsed(lines, separator, decimal.decode(), set(numbers.values()), width)
        if cells is None or len(cells) != rows:
            return None
        values = {name: np.ascontiguousarray(cells[f"f{i}"]) for name, i in numbers.items()}
        labels = None
        if self.head.has(_TEXT):
            place = self.places[_TEXT]
            labels = tuple(line.split(separator)[place].strip() for line in lines)
        return self._number_table(values, labels, block.first_line, rows)

    def _of_batch(self, block: TableBlock) -> NumberTable | None:
        """The numbers of rows of a Parquet file; None where a column has other values."""
        import pyarrow as pa

        batch, values, labels = block.content, {}, None
        for name, i in self.places.items():
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
    ) -> NumberTable | None:
        head = self.head
        if not all(np.all(np.abs(column) <= LARGEST_NUMBER) for column in values.values()):
            return None  # the usual reader names the line
        columns: dict[str, tuple[str, ...]] = dict.fromkeys(values, ())
        if labels is not None:
            columns[_TEXT] = labels
        return NumberTable(
            path=head.path,
            columns=columns,
            lines=tuple(range(first_line, first_line + rows)),
            header_line=head.header_line,
            decimal=head.decimal,
            scales=head.scales,
            titles=head.titles,
            unread=head.unread,
            values=values,
            printed_decimals=self.printed_decimals,
        )


def _parsed(
    lines: list[str], separator: str, decimal: str, numbers: Set[int], width: int
) -> np.ndarray[Any, Any] | None:
    """The numbers of plain rows as fields f0, f1, …; None where a cell is no number."""
    kinds = ",".join("f8" if i in numbers else "U1" for i in range(width))
    if decimal != ".":
        lines = [line.replace(decimal, ".") for line in lines]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return np.loadtxt(lines, np.dtype(kinds), delimiter=separator, comments=None, ndmin=1)
    except (ValueError, Warning):  # the usual reader names the line
        return None


def in_blocks(
    file: SourceFile,
    count: int,
    head: CsvTable,
    places: Mapping[str, int],
    separator: str = ",",
    printed_decimals: int = 9,
) -> TableInBlocks:
    """A long table whose head was read.

    Parameters
    ----------
    file : SourceFile
        The head, from `head_of_long_table`.
    count : int
        Rows of the table.
    head : CsvTable
        Its first rows.
    places : mapping of str to int
    separator : str
    printed_decimals : int
        As for `TableInBlocks`.

    Returns
    -------
    TableInBlocks
    """
    lines_before = 0 if file.ending == ".parquet" else head.lines[0] - 1
    before = b"".join(itertools.islice(io.BytesIO(file.content), lines_before))
    path = Path(file.path)
    return TableInBlocks(
        path, head, places, separator, before, lines_before, count, printed_decimals
    )


def head_of_long_table(path: Path) -> tuple[SourceFile, int] | None:
    """Read the head of a long table.

    Parameters
    ----------
    path : Path
        Parquet by its ending, else text.

    Returns
    -------
    SourceFile and int, or None
        The head as a file of its own, and the number of all rows, of text estimated. None: there is
        no such file, it is short, or it is no text in UTF-8.

    Raises
    ------
    InputError
        The file is not Parquet, or has no rows.
    PretravelError
        pyarrow is not installed.
    """
    if not path.is_file() or path.stat().st_size < LONG_TABLE:  # a row has more than one byte
        return None
    is_parquet = path.suffix.lower() == ".parquet"
    found = _head_of_parquet(path) if is_parquet else _head_of_text(path)
    return None if found is None or found[1] < LONG_TABLE else found


def _head_of_text(path: Path) -> tuple[SourceFile, int] | None:
    """The first lines, and the estimated number of all lines; None: it is no text in UTF-8."""
    with path.open("rb") as stream:
        content = stream.read(_HEAD_BYTES)
    content = content[: content.rfind(b"\n") + 1]
    lines = content.count(b"\n")
    if not lines or b"\0" in content or not _is_utf8(content):
        return None
    return SourceFile(str(path), content), path.stat().st_size * lines // len(content)


def _is_utf8(content: bytes) -> bool:
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _head_of_parquet(path: Path) -> tuple[SourceFile, int]:
    """The first rows as a file of their own, and the number of all rows."""
    needed("pyarrow", "tables")
    from pyarrow import ArrowException, parquet

    file = SourceFile(str(path), b"")
    try:
        with parquet.ParquetFile(path) as stored:
            count = int(stored.metadata.num_rows)
            first = next(stored.iter_batches(batch_size=_HEAD_ROWS), None)
    except (ArrowException, OSError, ValueError) as error:
        raise file.error(f"not a Parquet file that can be read: {error}") from None
    if first is None:
        raise file.error("the file has columns but no rows")
    return SourceFile(str(path), _parquet_bytes([first])), count


def _parquet_bytes(batches: list[Any]) -> bytes:
    import pyarrow as pa
    from pyarrow import parquet

    stream = io.BytesIO()
    parquet.write_table(pa.Table.from_batches(batches), stream)
    return stream.getvalue()
