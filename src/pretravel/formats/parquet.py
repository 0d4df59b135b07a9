"""Tables as Parquet: the same columns as CSV, every digit, for data tools."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import CsvTable
from pretravel.whole_file import whole_file

_MISSING = "Parquet files need the package pyarrow: pip install pyarrow"


def read_parquet_table(path: str | Path) -> CsvTable:
    """A Parquet file as a table of cells; its rows stand for lines.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    CsvTable

    Raises
    ------
    InputError
        No such file, not Parquet, no rows.
    PretravelError
        pyarrow is not installed.
    """
    try:
        from pyarrow import ArrowException, parquet
    except ModuleNotFoundError:
        raise PretravelError(_MISSING) from None
    if not Path(path).is_file():
        raise InputError("there is no such file", path=path)
    try:
        table = parquet.read_table(str(path))
    except (ArrowException, OSError) as error:
        raise InputError(f"not a Parquet file: {error}", path=path) from None
    if table.num_rows == 0:
        raise InputError("there are columns but no rows", path=path)
    columns = {
        name: tuple("" if value is None else str(value) for value in table[name].to_pylist())
        for name in table.column_names
    }
    return CsvTable(str(path), columns, tuple(range(1, table.num_rows + 1)), 0)


def write_parquet_table(
    path: str | Path, columns: Mapping[str, npt.ArrayLike | Sequence[str]]
) -> None:
    """Columns of equal length as a Parquet file, whole or not at all.

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
