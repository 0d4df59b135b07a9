"""Tables in the format of their file's ending: CSV, Parquet, JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.base import whole_file
from pretravel.files.csv_table import CsvTable, read_csv_table, write_csv_table
from pretravel.files.parquet import read_parquet_table, write_parquet_table
from pretravel.files.source_file import Source, opened


def read_table(source: Source) -> CsvTable:
    """Read a table of cells from a Parquet file (.parquet) or a CSV file (any other ending).

    Parameters
    ----------
    source : str, Path or SourceFile

    Returns
    -------
    CsvTable

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
