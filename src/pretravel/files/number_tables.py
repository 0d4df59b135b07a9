"""Tables whose rows are numbers alone: pyarrow reads them, after their first rows were understood.

The first rows state how the table is understood, as in any table.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pretravel.base import LARGEST_NUMBER, FloatArray, InputError
from pretravel.files.csv_table import CsvTable, cell_content
from pretravel.files.file_format import ReadingOptions
from pretravel.files.many_numbers import floats_of_arrow, numbers_of_arrow
from pretravel.files.source_file import SourceFile
from pretravel.files.touch_columns import TouchColumns, read_touch_columns

NEEDED = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")
LABEL = "label"
_HEAD_ROWS = 2_000
_HEAD_BYTES = 120_000
_FEWEST_BYTES = 1_000_000
"""Of a file below which each row is read separately: that is as quick as the import of pyarrow."""
_NUMERALS = b"0123456789+-.eE \r\n"
_KEPT = ("path", "header_line", "decimal", "scales", "titles", "unread")
"""What each part has of the head."""


@dataclass(frozen=True)
class NumberTable(CsvTable):
    """A table whose columns are numbers already, in addition to the labels.

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


def number_table(
    file: SourceFile, head: TouchColumns, columns: Mapping[str, Any], first_line: int, decimals: int
) -> NumberTable:
    """The numbers and labels of rows that pyarrow has read.

    Parameters
    ----------
    file : SourceFile
        For messages.
    head : TouchColumns
        Of the first rows.
    columns : mapping of str to pyarrow.Array
    first_line : int
        Of the file, or row.
    decimals : int
        Of the normals in the head.

    Raises
    ------
    InputError
        A cell is empty, or no number of this size.
    """
    values: dict[str, FloatArray] = {}
    cells: dict[str, tuple[str, ...]] = {}
    for name, column in columns.items():
        if name == LABEL:
            stripped = ((cell or "").strip() for cell in column.to_pylist())
            cells[name] = tuple(map(cell_content, stripped) if head.separator else stripped)
            continue
        cells[name] = ()
        values[name] = numbers_of_arrow(column)
        if np.any(odd := ~(np.abs(values[name]) <= LARGEST_NUMBER)):
            row = int(np.argmax(odd))
            what = "is empty" if column[row].as_py() is None else "is not a number of this size"
            raise file.error(f"{head.table.titles.get(name, name)} {what}", first_line + row)
        if (scale := head.table.scales.get(name, 1.0)) != 1.0:
            values[name] = scale * values[name] + 0.0
    count = len(next(iter(values.values())))
    return NumberTable(
        **{name: getattr(head.table, name) for name in _KEPT},
        columns=cells,
        lines=tuple(range(first_line, first_line + count)),
        values=values,
        printed_decimals=decimals,
        of_touches=True,
    )


def csv_options(head: TouchColumns, block: int | None = None) -> dict[str, Any]:
    """How pyarrow reads the rows of a text, as keywords.

    Parameters
    ----------
    head : TouchColumns
        Of the first rows.
    block : int, optional
        Bytes that are read at a time.
    """
    from pyarrow import csv, float64, string

    places = head.places
    names = [f"{i}" for i in range(len(places) + len(head.table.unread))]
    used = {f"{i}": string() if name == LABEL else float64() for name, i in places.items()}
    return {
        "read_options": csv.ReadOptions(
            use_threads=False,  # with threads it does not name the line
            block_size=block,
            skip_rows=head.table.lines[0] - 1,
            column_names=names,
        ),
        "parse_options": csv.ParseOptions(delimiter=head.separator),
        "convert_options": csv.ConvertOptions(
            include_columns=list(used),
            column_types=used,
            decimal_point="," if head.table.decimal == "," else ".",
            null_values=[],
            strings_can_be_null=False,
        ),
    }


def columns_of_numbers(file: SourceFile, options: ReadingOptions) -> TouchColumns | None:
    """The columns of a table whose rows are numbers alone, all of them read.

    Returns
    -------
    TouchColumns or None
        None: the table is short, is not of this kind, has columns that are not read, or pyarrow is
        not installed. `read_touch_columns` then reads it, and says what is wrong with it.
    """
    if len(file.content) < _FEWEST_BYTES or options.exclude:
        return None
    try:
        import pyarrow as pa
        import pyarrow.csv
    except ModuleNotFoundError:
        return None
    try:
        is_text = file.ending != ".parquet"
        content, _ = (head_of_text if is_text else head_of_parquet)(file.content)
        if not content:
            return None
        head = read_touch_columns(SourceFile(file.path, content), options)
        if head.whole or head.notes or head.table.unread or not head.table.has(*NEEDED):
            return None
        if is_text:
            if not has_plain_separator(head) or not _numbers_alone(file.content, head):
                return None
            rows = pa.csv.read_csv(io.BytesIO(file.content), **csv_options(head))
            read = dict(zip(head.places, rows.columns, strict=True))
        else:
            read = _stored(file.content, head)
        first = head.table.lines[0]
        decimals = head.table.decimals(*NEEDED[3:])
        return replace(head, table=number_table(file, head, read, first, decimals))
    except (InputError, pa.ArrowException, ValueError):
        return None


def _numbers_alone(content: bytes, head: TouchColumns) -> bool:
    """Whether all lines from the first row on have numerals and separators only."""
    signs = _NUMERALS + head.separator.encode()
    if head.table.decimal == ",":
        signs = signs.replace(b".", b",")
    lines = content.split(b"\n", head.table.lines[0] - 1)
    return not lines[-1].translate(None, signs)


def _stored(content: bytes, head: TouchColumns) -> dict[str, Any]:
    """The columns of Parquet."""
    from pyarrow import parquet

    # parquet.read_table would import pandas.
    with parquet.ParquetFile(io.BytesIO(content)) as stored:
        rows = stored.read(use_threads=False).combine_chunks()
    return {
        name: rows.column(i) if name == LABEL else floats_of_arrow(rows.column(i))
        for name, i in head.places.items()
    }


def has_plain_separator(head: TouchColumns) -> bool:
    """Whether cells are separated by one sign, and no cell of a row may be absent."""
    width = len(head.places) + len(head.table.unread)
    return len(head.separator.strip(" ")) == 1 and max(head.places.values()) < width


def head_of_text(source: Path | bytes) -> tuple[bytes, int]:
    """The first lines, which are in UTF-8, and the estimated number of all lines."""
    if isinstance(source, bytes):
        content, size = source[:_HEAD_BYTES], len(source)
    else:
        with source.open("rb") as stream:
            content, size = stream.read(_HEAD_BYTES), source.stat().st_size
    content = content[: content.rfind(b"\n") + 1]
    content.decode("utf-8")
    return content, size * content.count(b"\n") // max(len(content), 1)


def head_of_parquet(source: Path | bytes) -> tuple[bytes, int]:
    """The first rows as a file of their own, and the number of all rows; 0: not all are numbers."""
    import pyarrow as pa
    from pyarrow import parquet

    stream = io.BytesIO()
    with parquet.ParquetFile(io.BytesIO(source) if isinstance(source, bytes) else source) as stored:
        kinds = [field.type for field in stored.schema_arrow]
        plain = (pa.types.is_float64, pa.types.is_integer, pa.types.is_string)
        if not all(any(is_kind(kind) for is_kind in plain) for kind in kinds):
            return b"", 0
        first = next(stored.iter_batches(batch_size=_HEAD_ROWS), None)
        if first is None:
            return b"", 0
        parquet.write_table(pa.Table.from_batches([first]), stream)
        return stream.getvalue(), int(stored.metadata.num_rows)
