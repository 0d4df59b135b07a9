"""Long tables of compensated points, read in blocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pretravel.base.errors import InputError
from pretravel.files.csv_table import CsvTable, read_csv_table
from pretravel.files.parquet import read_parquet_table
from pretravel.files.points_reading import points_of_table
from pretravel.files.source_file import SourceFile
from pretravel.files.table_blocks import (
    BLOCK_ROWS,
    TableInBlocks,
    head_of_long_table,
    in_blocks,
)
from pretravel.measurement.points import Points


@dataclass(frozen=True)
class LongPoints:
    """A long table of points.

    Attributes
    ----------
    rows : TableInBlocks
    """

    rows: TableInBlocks

    def blocks(self, rows: int = BLOCK_ROWS) -> Iterator[Points]:
        """Read the points block by block.

        Parameters
        ----------
        rows : int
            Of a block; of text about so many.

        Yields
        ------
        Points

        Raises
        ------
        InputError
            As `read_points`.
        """
        first = 1
        for block in self.rows.blocks(rows):
            table = self.rows.numbers(block)
            file = (
                self.rows.file_of(block) if table is None else SourceFile(self.rows.head.path, b"")
            )
            points = points_of_table(file, table or _read(file), first)
            first += len(points)
            yield points


def _read(file: SourceFile) -> CsvTable:
    return read_parquet_table(file) if file.ending == ".parquet" else read_csv_table(file)


def long_points(path: str | Path) -> LongPoints | None:
    """Open a long table of points, for reading in blocks.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    LongPoints or None
        None: the file is short or no table (.csv, .parquet). It is then read whole.

    Raises
    ------
    PretravelError
        pyarrow is not installed.
    """
    path = Path(path)
    if path.suffix.lower() not in (".csv", ".parquet"):
        return None
    try:
        found = head_of_long_table(path)
        if found is None:
            return None
        file, count = found
        head = _read(file)
    except InputError:
        return None
    places = {name: place for place, name in enumerate(head.columns)}
    return LongPoints(in_blocks(file, count, head, places))
