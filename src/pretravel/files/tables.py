"""Tables in the format of their file's ending: CSV, Parquet, JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import PretravelError, needed, whole_file
from pretravel.files.csv_table import CsvTable, read_csv_table, write_csv_table
from pretravel.files.many_numbers import arrow_column
from pretravel.files.source_file import Source, SourceFile, opened


def read_table(source: Source) -> CsvTable:
    """Read a table of cells from a Parquet file (.parquet) or a CSV file (any other ending).

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        See `read_csv_table` and `read_parquet_table`.
    """
    file = opened(source)
    return read_parquet_table(file) if file.ending == ".parquet" else read_csv_table(file)


def write_table(path: str | Path, columns: Mapping[str, npt.ArrayLike | Sequence[str]]) -> None:
    """Write columns of equal length as CSV, Parquet (.parquet) or JSON (.json, a list of rows).

    An error leaves no partial file.

    Parameters
    ----------
    path : str or Path
    columns : mapping of str to (n,) numbers or strings
    """
    ending = Path(path).suffix.lower()
    if ending == ".parquet":
        write_parquet_table(path, columns)
    elif ending == ".json":
        lists = {name: np.asarray(values).tolist() for name, values in columns.items()}
        rows = [dict(zip(lists, row, strict=True)) for row in zip(*lists.values(), strict=True)]
        with whole_file(path) as temporary:
            temporary.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    else:
        write_csv_table(path, columns)


_MOST_BYTES = 200_000_000
"""Bytes of content up to which a file is read, however well it is compressed."""
_MOST_CELLS = 5_000_000
"""Cells up to which a file is read, whatever its size; larger ones have a byte for each cell."""


def read_parquet_table(source: Source) -> CsvTable:
    """Read a Parquet file as a table of cells. In messages, the number of a row is its line.

    Parameters
    ----------
    source : str, Path or SourceFile

    Raises
    ------
    InputError
        The file does not exist, is not Parquet or has no rows.
    MissingExtraError
        Without the extra ``tables``.
    """
    needed("pyarrow", "tables")
    import pyarrow as pa
    from pyarrow import BufferReader, parquet

    file = opened(source)
    try:
        stored = parquet.ParquetFile(BufferReader(file.content))
        _refuse_size(file, stored.metadata)
        names, schema = stored.schema_arrow.names, stored.schema_arrow
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise file.error(f"the column {twice[0]} is in the file {names.count(twice[0])} times")
        flat = [field.name for field in schema if not pa.types.is_nested(field.type)]
        # Equal texts stay one text: a few bytes can declare any number of them.
        texts = [name for name in flat if _is_text(schema.field(name).type)]
        stored = parquet.ParquetFile(BufferReader(file.content), read_dictionary=texts)
        table = stored.read(columns=flat)
        table.validate(full=True)
    except PretravelError:
        raise
    # Whatever a foreign file makes this library raise, the file is at fault.
    except Exception as error:
        text = " ".join(str(error).split())[:200]
        raise file.error(f"not a Parquet file that can be read: {text}") from None
    none = ("-",) * table.num_rows
    if table.num_rows == 0:
        raise file.error("the file has columns but no rows")
    columns = {name: _cells(table.column(name)) if name in flat else none for name in names}
    return CsvTable(file.path, columns, tuple(range(1, table.num_rows + 1)), 0)


def _refuse_size(file: SourceFile, metadata: Any) -> None:
    """A few bytes can declare any number of equal rows, of values in lists, and long texts."""
    parts = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    columns = [part.column(i) for part in parts for i in range(metadata.num_columns)]
    size = sum(column.total_uncompressed_size for column in columns)
    if size > max(_MOST_BYTES, 20 * len(file.content)):
        raise file.error(
            f"this file of {len(file.content):,} bytes declares {size:,} bytes of content; so "
            "much is not read"
        )
    cells = metadata.num_rows * max(metadata.num_columns, 1)
    cells = max(cells, sum(column.num_values for column in columns))
    if cells > max(_MOST_CELLS, len(file.content)):
        raise file.error(
            f"this file of {len(file.content):,} bytes declares {metadata.num_rows:,} rows of "
            f"{metadata.num_columns:,} columns; so many are not read"
        )


def _cells(column: Any) -> tuple[str, ...]:
    """Cells as in a CSV file; one that has no text, such as bytes or a list, stays a dash.

    Columns that nobody uses may contain anything: a dash in one that is used is refused there.
    """
    import pyarrow as pa

    kind = column.type
    if pa.types.is_dictionary(kind):
        return _texts(column)
    plain = pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind)
    if not plain and not pa.types.is_null(kind):
        try:
            column = column.cast(pa.string())
        except (pa.ArrowException, ValueError, OSError):
            return ("-",) * len(column)
    return tuple("" if value is None else str(value) for value in column.to_pylist())


def _texts(column: Any) -> tuple[str, ...]:
    """The cells of a column of texts; equal ones are one object."""
    cells: list[str] = []
    for chunk in column.chunks:
        known = [_text(value) for value in chunk.dictionary.to_pylist()]
        cells += ["" if row is None else known[row] for row in chunk.indices.to_pylist()]
    return tuple(cells)


def _text(value: object) -> str:
    if not isinstance(value, bytes):
        return str(value)
    try:
        return value.decode()
    except UnicodeDecodeError:
        return "-"


def _is_text(kind: Any) -> bool:
    import pyarrow as pa

    plain = pa.types.is_string(kind) or pa.types.is_binary(kind)
    return bool(plain or pa.types.is_large_string(kind) or pa.types.is_large_binary(kind))


def write_parquet_table(
    path: str | Path, columns: Mapping[str, npt.ArrayLike | Sequence[str]]
) -> None:
    """Write columns of equal length as a Parquet file. An error leaves no partial file.

    Parameters
    ----------
    path : str or Path
    columns : mapping of str to (n,) numbers or strings

    Raises
    ------
    MissingExtraError
        Without the extra ``tables``.
    """
    needed("pyarrow", "tables")
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.table({name: arrow_column(values) for name, values in columns.items()})
    with whole_file(path) as temporary:
        # Numbers that are measured do not repeat: a dictionary of them takes most of the time.
        parquet.write_table(table, str(temporary), use_dictionary=False)
