"""Tables that are written piece by piece, CSV or Parquet, completely or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base.extras import needed
from pretravel.base.whole_file import whole_file
from pretravel.files.csv_table import csv_rows_text, csv_table_text

APPENDED_ENDINGS = (".csv", ".parquet")
"""Endings of the files that can be written in pieces."""
TableColumnsByName: TypeAlias = Mapping[str, npt.ArrayLike | Sequence[str]]


def table_piece(ending: str, columns: TableColumnsByName, *, first: bool) -> Any:
    r"""Make a piece of a table as `appended_table` takes it: the slow part of writing.

    Parameters
    ----------
    ending : str
        Of the file, one of `APPENDED_ENDINGS`.
    columns : mapping of str to (n,) numbers or strings
    first : bool
        The piece begins the table.

    Returns
    -------
    bytes or pyarrow.Table

    >>> table_piece(".csv", {"x_mm": [0.5]}, first=True)
    b'x_mm\n0.5\n'
    """
    if ending == ".parquet":
        needed("pyarrow", "tables")
        import pyarrow as pa

        return pa.table({name: np.asarray(values) for name, values in columns.items()})
    text = csv_table_text(columns) if first else csv_rows_text(columns)
    return text.encode("utf-8")


@contextmanager
def appended_table(path: str | Path) -> Iterator[Callable[[Any], object]]:
    r"""A function that appends pieces of `table_piece` to a table; it replaces `path` at the end.

    Parameters
    ----------
    path : str or Path
        Its ending is one of `APPENDED_ENDINGS`.

    Yields
    ------
    callable

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.csv"
    >>> with appended_table(path) as append:
    ...     _ = append(b"x_mm\n")
    ...     _ = append(b"0.5\n")
    >>> path.read_text()
    'x_mm\n0.5\n'
    """
    with whole_file(path) as temporary:
        if Path(path).suffix.lower() == ".parquet":
            yield from _parquet_appender(temporary)
        else:
            with temporary.open("wb") as stream:
                yield stream.write


def _parquet_appender(path: Path) -> Iterator[Callable[[Any], object]]:
    from pyarrow import parquet

    writers: list[Any] = []

    def append(piece: Any) -> None:
        if not writers:
            writers.append(parquet.ParquetWriter(str(path), piece.schema))
        writers[0].write_table(piece)

    try:
        yield append
    finally:
        for writer in writers:
            writer.close()
