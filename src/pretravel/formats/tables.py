"""Tables by the ending of their file: CSV, or Parquet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy.typing as npt

from pretravel.formats.csv_table import CsvTable, read_csv_table, write_csv_table
from pretravel.formats.parquet import read_parquet_table, write_parquet_table


def read_table(path: str | Path) -> CsvTable:
    """A table of cells from a Parquet file (.parquet) or a CSV file (all others).

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    CsvTable

    Raises
    ------
    InputError
        As `read_csv_table` and `read_parquet_table`.
    """
    if Path(path).suffix.lower() == ".parquet":
        return read_parquet_table(path)
    return read_csv_table(path)


def write_table(path: str | Path, columns: Mapping[str, npt.ArrayLike | Sequence[str]]) -> None:
    """Columns of equal length, by the ending of the path, whole or not at all.

    Parameters
    ----------
    path : str or Path
    columns : mapping of str to (n,) numbers or strings
    """
    write = write_parquet_table if Path(path).suffix.lower() == ".parquet" else write_csv_table
    write(path, columns)
