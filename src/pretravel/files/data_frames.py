"""Data frames of pandas, polars and Arrow, read as files of tables are: by names and units."""

from __future__ import annotations

import csv
import io
import re
from typing import Any

import narwhals.stable.v2 as nw

from pretravel.base import PretravelError
from pretravel.files.source_file import SourceFile

_NAME = "data frame"
_ABSENT = {"nan", "<NA>", "NaT"}
"""How pandas writes values that are absent."""


def is_frame(given: object) -> bool:
    """Whether a value is a table with named columns of a library that is known.

    >>> is_frame([[1.0, 2.0]]), is_frame("touches.csv")
    (False, False)
    """
    return bool(nw.dependencies.is_into_dataframe(given)) or _is_batch(given)


def _is_batch(given: object) -> bool:
    """Whether a value is a batch of rows of Arrow, which becomes a table."""
    arrow = nw.dependencies.get_pyarrow()
    return arrow is not None and isinstance(given, arrow.RecordBatch)


def source_of_frame(frame: Any) -> SourceFile:
    """A data frame as the text of a table, with all digits.

    Parameters
    ----------
    frame : DataFrame of pandas, polars, modin, cuDF; Table of pyarrow

    Raises
    ------
    PretravelError
        Its columns have no names; it has no rows.
    """
    if _is_batch(frame):
        frame = nw.dependencies.get_pyarrow().Table.from_batches([frame])
    if nw.dependencies.is_pandas_dataframe(frame):
        frame = _with_labels(frame)
    try:
        table = nw.from_native(frame, eager_only=True)
    except nw.exceptions.DuplicateError as error:
        twice = ", ".join(re.findall(r"'(.+)'", str(error)))
        raise PretravelError(f"columns of the data frame have the same name: {twice}") from None
    names = list(table.columns)
    if not names or any(str(name).isdecimal() for name in names):
        raise PretravelError(
            "the columns of the data frame have no names: call them x_mm, y_mm, z_mm, nx, ny, nz, "
            "or give an array (n, 6) in mm"
        )
    if not len(table):
        raise PretravelError("the data frame has no rows")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([str(name) for name in names])
    writer.writerows([_cell(value) for value in row] for row in table.iter_rows())
    return SourceFile(_NAME, text.getvalue().encode())


def _with_labels(frame: Any) -> Any:
    """A frame of pandas with its index as a column, where it has names of rows.

    >>> import pandas as pd
    >>> list(_with_labels(pd.DataFrame({"x_mm": [1.0]}, index=["a"])).columns)
    ['label', 'x_mm']
    """
    index = frame.index
    named = index.nlevels == 1 and (index.name is not None or index.dtype.kind not in "iuf")
    if not named or index.name in frame.columns or (index.name is None and "label" in frame):
        return frame
    return frame.reset_index(names="label" if index.name is None else index.name)


def _cell(value: object) -> str:
    """A value with all its digits; nothing where it is absent."""
    if value is None or str(value) in _ABSENT:
        return ""
    return repr(float(value)) if isinstance(value, float) else str(value)
