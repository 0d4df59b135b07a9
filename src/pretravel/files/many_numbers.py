"""Very many numbers as text: by pyarrow, where it is installed."""

from __future__ import annotations

import io
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

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
    import pyarrow as pa
    import pyarrow.compute as pc

    cells = [pc.cast(pa.array(_rounded(each)), pa.large_string()) for each in columns]
    joined: list[str] = pc.binary_join_element_wise(
        *cells, pa.scalar(" ", pa.large_string())
    ).to_pylist()
    return [f"[{row}]" for row in joined]


def rows_by_arrow(arrays: Sequence[Any], numbers: Sequence[bool]) -> str:
    """Rows of a table of numbers and of texts that need no quotes, each with its end of line."""
    import pyarrow as pa
    import pyarrow.csv

    table = pa.table(
        {
            str(i): pa.array(_rounded(array) if number else array.tolist())
            for i, (array, number) in enumerate(zip(arrays, numbers, strict=True))
        }
    )
    text = io.BytesIO()
    options = pa.csv.WriteOptions(include_header=False, quoting_style="none")
    pa.csv.write_csv(table, text, options)
    return text.getvalue().decode()


def _rounded(values: FloatArray) -> FloatArray:
    """Finite numbers with twelve significant digits: the shortest text of a number has no more."""
    size = np.abs(values)
    exponent = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    scale = 10.0 ** np.clip(SIGNIFICANT_DIGITS - 1 - exponent, -280.0, 280.0)
    return np.asarray(np.rint(values * scale) / scale)
