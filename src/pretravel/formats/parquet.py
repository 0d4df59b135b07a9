"""Tables as Parquet: the same columns as CSV with every digit, for data tools."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.errors import PretravelError
from pretravel.formats.csv_table import CsvTable
from pretravel.formats.source_file import Source, opened
from pretravel.whole_file import whole_file

_MISSING = "Parquet files need the package pyarrow: pip install pyarrow"


def read_parquet_table(source: Source) -> CsvTable:
    """Read a Parquet file as a table of cells. In messages, the number of a row is its line.

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    CsvTable

    Raises
    ------
    InputError
        The file does not exist, is not Parquet or has no rows.
    PretravelError
        pyarrow is not installed.
    """
    try:
        from pyarrow import ArrowException, BufferReader, parquet
    except ModuleNotFoundError:
        raise PretravelError(_MISSING) from None
    file = opened(source)
    try:
        table = parquet.read_table(BufferReader(file.content))
    except (ArrowException, OSError) as error:
        raise file.error(f"not a Parquet file: {error}") from None
    if table.num_rows == 0:
        raise file.error("the file has columns but no rows")
    columns = {
        name: tuple("" if value is None else str(value) for value in table[name].to_pylist())
        for name in table.column_names
    }
    return CsvTable(file.path, columns, tuple(range(1, table.num_rows + 1)), 0)


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
    PretravelError
        pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ModuleNotFoundError:
        raise PretravelError(_MISSING) from None
    table = pa.table({name: np.asarray(values).tolist() for name, values in columns.items()})
    with whole_file(path) as temporary:
        parquet.write_table(table, str(temporary))
