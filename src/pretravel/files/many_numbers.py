"""Very many numbers as text, and as columns of pyarrow: where it is installed."""

from __future__ import annotations

import io
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray, IntArray

SIGNIFICANT_DIGITS = 12
"""Of the numbers that are written."""
_MANY = 300_000
"""So many numbers take more time than the import of pyarrow."""
_BELOW = 9.5
"""Smaller numbers are listed with twelve decimals: as many digits, or fewer."""
_ROWS_IN_CACHE = 1000


def takes_arrow(count: int) -> bool:
    """Whether so many numbers are written by pyarrow."""
    return count >= _MANY and find_spec("pyarrow") is not None


def listed_rows(columns: Sequence[FloatArray]) -> Any:
    """Each row of columns of numbers as a list in one cell: a list, of many a column of pyarrow.

    >>> listed_rows([np.array([0.5, 1.0 / 3.0]), np.array([-2.0, 4.0])])
    ['[0.5 -2]', '[0.333333333333 4]']
    """
    if not takes_arrow(sum(map(len, columns))):
        form = f"[{' '.join(len(columns) * [f'%.{SIGNIFICANT_DIGITS}g'])}]"
        return [form % row for row in zip(*(each.tolist() for each in columns), strict=True)]
    if all(bool(np.all(np.abs(each) < _BELOW)) for each in columns):
        return _listed_with_decimals(columns)
    stream = io.BytesIO()
    rows_by_arrow(stream, columns, len(columns) * [True], " ")
    content = b"[" + stream.getvalue().replace(b"\n", b"][")[:-1]
    starts = np.flatnonzero(np.frombuffer(content, dtype=np.uint8) == ord("["))
    return _column_of(content, np.append(starts, len(content)))


def _listed_with_decimals(columns: Sequence[FloatArray]) -> Any:
    """The same with twelve decimals each, in a quarter of the time: four digits at a time.

    A number has sixteen bytes: blank or bracket, sign, digit, point, decimals.
    """
    count, width = len(columns[0]), 16 * len(columns) + 1
    rows = np.full((count, width), ord("]"), dtype=np.uint8)
    begins = [f"{sign}{digit}." for sign in " -" for digit in range(10)]
    begin = np.array([f" {each}" for each in begins], dtype="S4").view(np.uint32)
    digits = np.array([f"{i:04d}" for i in range(10**4)], dtype="S4").view(np.uint32)
    for start in range(0, count, _ROWS_IN_CACHE):
        part = np.column_stack([each[start : start + _ROWS_IN_CACHE] for each in columns])
        whole = np.rint(np.abs(part) * 1e12).astype(np.int64)
        words = np.empty((*part.shape, 4), dtype=np.uint32)
        for word in (3, 2, 1):
            left = whole // 10**4
            words[..., word] = digits[whole - 10**4 * left]
            whole = left
        words[..., 0] = begin[whole + 10 * (part < 0.0)]
        rows[start : start + _ROWS_IN_CACHE, :-1] = words.view(np.uint8).reshape(len(part), -1)
    rows[:, 0] = ord("[")
    return _column_of(rows, width * np.arange(count + 1))


def _column_of(content: bytes | npt.NDArray[np.uint8], ends: IntArray) -> Any:
    """A column of texts in UTF-8, from the ends of each, behind a zero."""
    import pyarrow as pa

    short = ends[-1] < 2**31
    kind, offsets = (pa.string(), ends.astype(np.int32)) if short else (pa.large_string(), ends)
    buffers = [None, pa.py_buffer(offsets), pa.py_buffer(content)]
    return pa.Array.from_buffers(kind, len(ends) - 1, buffers)


def rows_by_arrow(
    stream: BinaryIO, arrays: Sequence[Any], numbers: Sequence[bool], separator: str = ","
) -> None:
    """Write rows of numbers and of texts that need no quotes, each with its end of line."""
    import pyarrow as pa
    import pyarrow.csv

    columns = [
        arrow_column(_rounded(array) if number else array)
        for array, number in zip(arrays, numbers, strict=True)
    ]
    table = pa.Table.from_arrays(columns, names=[str(i) for i in range(len(columns))])
    options = pa.csv.WriteOptions(include_header=False, quoting_style="none", delimiter=separator)
    pa.csv.write_csv(table, stream, options)


def is_column(values: object) -> bool:
    """Whether this is a column of pyarrow, as `listed_rows` makes it of many numbers."""
    return type(values).__module__.partition(".")[0] == "pyarrow"


def arrow_column(values: npt.ArrayLike | Sequence[str]) -> Any:
    """A column of numbers or texts for pyarrow, whose own conversion imports pandas.

    >>> arrow_column(["a", "bc"]).to_pylist(), arrow_column([0.5, 2.0]).to_pylist()
    (['a', 'bc'], [0.5, 2.0])
    """
    import pyarrow as pa

    if is_column(values):
        return values
    texts = isinstance(values, list) and len(values) > 0 and isinstance(values[0], str)
    array = np.asarray(values, dtype=object if texts else None)
    if array.dtype.kind == "f":
        content = pa.py_buffer(np.ascontiguousarray(array, dtype=np.float64))
        return pa.Array.from_buffers(pa.float64(), len(array), [None, content])
    cells = array.tolist()
    if set(map(type, cells)) != {str}:
        return pa.array(cells)
    together = "".join(cells)
    if together.isascii():
        return _column_of(together.encode(), np.cumsum([0, *map(len, cells)]))
    encoded = [cell.encode() for cell in cells]
    return _column_of(b"".join(encoded), np.cumsum([0, *map(len, encoded)]))


def floats_of_arrow(column: Any) -> Any:
    """A column as one of float64. Integers need the functions of pyarrow, which load slowly."""
    from pyarrow import float64

    return column if column.type == float64() else column.cast(float64())


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
