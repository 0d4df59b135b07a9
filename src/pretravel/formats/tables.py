"""Tables by the ending of their file: CSV, Parquet, JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.formats.csv_table import CsvTable, read_csv_table, write_csv_table
from pretravel.formats.parquet import read_parquet_table, write_parquet_table
from pretravel.whole_file import whole_file


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

    JSON is a list of rows.

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
