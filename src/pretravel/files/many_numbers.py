"""Very many numbers as text, and as columns of pyarrow: where it is installed."""

from __future__ import annotations

import io
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray

SIGNIFICANT_DIGITS = 12
"""Of the numbers that are written."""
_MANY = 300_000
"""So many numbers take more time than the import of pyarrow."""


def takes_arrow(count: int) -> bool:
    """Whether so many numbers are written by pyarrow."""
    return count >= _MANY and find_spec("pyarrow") is not None


def listed_rows(columns: Sequence[FloatArray]) -> list[str]:
    """Each row of columns of numbers as a list in one cell.

    >>> listed_rows([np.array([0.5, 1.0 / 3.0]), np.array([-2.0, 4.0])])
    ['[0.5 -2]', '[0.333333333333 4]']
    """
    if not takes_arrow(sum(map(len, columns))):
        form = f"[{' '.join(len(columns) * [f'%.{SIGNIFICANT_DIGITS}g'])}]"
        return [form % row for row in zip(*(each.tolist() for each in columns), strict=True)]
    rows = rows_by_arrow(columns, len(columns) * [True], " ").splitlines()
    return [f"[{row}]" for row in rows]


def rows_by_arrow(arrays: Sequence[Any], numbers: Sequence[bool], separator: str = ",") -> str:
    """Rows of a table of numbers and of texts that need no quotes, each with its end of line."""
    import pyarrow as pa
    import pyarrow.csv

    columns = [
        arrow_column(_rounded(array) if number else array)
        for array, number in zip(arrays, numbers, strict=True)
    ]
    table = pa.Table.from_arrays(columns, names=[str(i) for i in range(len(columns))])
    text = io.BytesIO()
    options = pa.csv.WriteOptions(include_header=False, quoting_style="none", delimiter=separator)
    pa.csv.write_csv(table, text, options)
    return text.getvalue().decode()


def arrow_column(values: npt.ArrayLike | Sequence[str]) -> Any:
    """A column of numbers or texts for pyarrow, whose own conversion imports pandas.

    >>> arrow_column(["a", "bc"]).to_pylist(), arrow_column([0.5, 2.0]).to_pylist()
    (['a', 'bc'], [0.5, 2.0])
    """
    import pyarrow as pa

    texts = isinstance(values, list) and len(values) > 0 and isinstance(values[0], str)
    array = np.asarray(values, dtype=object if texts else None)
    if array.dtype.kind == "f":
        content = pa.py_buffer(np.ascontiguousarray(array, dtype=np.float64))
        return pa.Array.from_buffers(pa.float64(), len(array), [None, content])
    cells = array.tolist()
    if not all(type(cell) is str for cell in cells):
        return pa.array(cells)
    encoded = [cell.encode() for cell in cells]
    ends = np.cumsum([0, *map(len, encoded)])
    short = ends[-1] < 2**31
    kind, offsets = (pa.string(), ends.astype(np.int32)) if short else (pa.large_string(), ends)
    buffers = [None, pa.py_buffer(offsets), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(kind, len(cells), buffers)


def numbers_of_arrow(column: Any) -> FloatArray:
    """The numbers of a column of pyarrow; nan where a cell is empty. As `arrow_column`."""
    if column.null_count:
        return np.asarray(column.to_numpy(zero_copy_only=False))
    chunks = [chunk for chunk in getattr(column, "chunks", [column]) if len(chunk)]
    parts = [np.from_dlpack(chunk) for chunk in chunks]
    return np.asarray(parts[0] if len(parts) == 1 else np.concatenate([np.zeros(0), *parts]))


def _rounded(values: FloatArray) -> FloatArray:
    """Finite numbers with twelve significant digits: the shortest text of a number has no more."""
    size = np.abs(values)
    exponent = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    scale = 10.0 ** np.clip(SIGNIFICANT_DIGITS - 1 - exponent, -280.0, 280.0)
    return np.asarray(np.rint(values * scale) / scale)
