"""Data frames of pandas, polars and Arrow, read as files of tables are: by names and units."""

from __future__ import annotations

import csv
import io
from typing import Any

import narwhals.stable.v2 as nw

from pretravel.base import PretravelError
from pretravel.files.source_file import SourceFile

_NAME = "data frame"


def is_frame(given: object) -> bool:
    """Whether a value is a table with named columns of a library that is known.

    >>> is_frame([[1.0, 2.0]]), is_frame("touches.csv")
    (False, False)
    """
    return bool(nw.dependencies.is_into_dataframe(given))


def source_of_frame(frame: Any) -> SourceFile:
    """A data frame as the text of a table, with all digits.

    Parameters
    ----------
    frame : DataFrame of pandas, polars, modin, cuDF; Table of pyarrow

    Returns
    -------
    SourceFile

    Raises
    ------
    PretravelError
        Its columns have no names; it has no rows.
    """
    table = nw.from_native(frame, eager_only=True)
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


def _cell(value: object) -> str:
    """A value with all its digits; nothing where it is absent."""
    if value is None or value != value:  # NaN is not equal to itself
        return ""
    return repr(float(value)) if isinstance(value, float) else str(value)
