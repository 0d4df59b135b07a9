"""Long tables of touches, read in blocks.

The head of the file states how it is understood, and each block is read in that way. A block with
a damaged cell is read by the usual reader, which has the usual message.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from pretravel.base.errors import InputError
from pretravel.files import table_blocks
from pretravel.files.csv_table import CsvTable
from pretravel.files.file_format import FileReadings, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.source_file import SourceFile
from pretravel.files.table_blocks import (
    BLOCK_ROWS,
    TableBlock,
    TableInBlocks,
    head_of_long_table,
    in_blocks,
)
from pretravel.files.table_formats import CSV, PARQUET
from pretravel.files.touch_columns import (
    TouchColumns,
    read_touch_columns,
    refuse_control_characters,
)
from pretravel.files.touches_csv import touches_of_columns

_NEEDED = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")


@dataclass(frozen=True)
class LongTable:
    """A long table of touches, and how it is understood.

    Attributes
    ----------
    rows : TableInBlocks
    head : TouchColumns
        Of its first rows.
    options : ReadingOptions
    """

    rows: TableInBlocks
    head: TouchColumns
    options: ReadingOptions

    @property
    def path(self) -> Path:
        """Of the file."""
        return self.rows.path

    @property
    def count(self) -> int:
        """Touches: of Parquet exact, of text estimated from its size."""
        return self.rows.count

    @property
    def is_parquet(self) -> bool:
        """Whether the file is Parquet, not text."""
        return self.rows.is_parquet

    @property
    def understood(self) -> str:
        """How the table is understood, where it has another form than this package's own."""
        return "" if self.head.own_form else self.head.understood

    def blocks(self, rows: int = BLOCK_ROWS) -> Iterator[TableBlock]:
        """The blocks of the file; see `TableInBlocks.blocks`."""
        return self.rows.blocks(rows)

    def read(self, block: TableBlock) -> FileReadings:
        """Read the touches of a block.

        Parameters
        ----------
        block : TableBlock

        Returns
        -------
        FileReadings
            The touches are numbered from the row of the block in the file.

        Raises
        ------
        InputError
            As `read_touches`.
        """
        file = SourceFile(str(self.path), b"")
        table = self.rows.numbers(block)
        columns = self._read_with_care(block) if table is None else replace(self.head, table=table)
        refuse_control_characters(columns.table)
        self._refuse_other_lines(file, block, columns.table)
        touches, found = touches_of_columns(file, columns, self.options)
        numbered = replace(touches, reading="", numbered_from=block.first_row + 1)
        return FileReadings(numbered, warnings=found)

    def _refuse_other_lines(self, file: SourceFile, block: TableBlock, table: CsvTable) -> None:
        """Touches without labels are numbered: each line of a block must then be a row."""
        if self.is_parquet or table.has("label") or block.is_last:
            return
        if len(table) != block.content.count(b"\n"):
            rows = set(table.lines)
            odd = next(line for line in itertools.count(block.first_line) if line not in rows)
            raise file.error(
                "this line is no row; a table of more than "
                f"{table_blocks.LONG_TABLE:,} rows is read in blocks, and without labels its rows "
                "are numbered: remove the line, or add a column of labels",
                odd,
            )

    def _read_with_care(self, block: TableBlock) -> TouchColumns:
        """The columns of a block as the usual reader reads them, which names what is wrong."""
        file = self.rows.file_of(block)
        columns = read_touch_columns(file, self.options)
        columns.table.require(*_NEEDED, what="touches")
        if columns.titles != self.head.titles:
            raise file.error(
                "from here on, the columns are understood in another way than at the beginning; "
                "state the columns",
                block.first_line,
                inputs=("columns",),
            )
        return columns


def long_table(path: str | Path, options: ReadingOptions | None = None) -> LongTable | None:
    """Open a long table of touches, for reading in blocks.

    Parameters
    ----------
    path : str or Path
    options : ReadingOptions, optional
        Columns, unit and decimal sign.

    Returns
    -------
    LongTable or None
        None: the file is short, is no table with normals (CSV or Parquet), cannot be understood by
        its first rows, or the options need all of its touches at once. It is then read whole.

    Raises
    ------
    PretravelError
        pyarrow is not installed.
    """
    path, options = Path(path), options or ReadingOptions()
    if options.exclude or options.plan or options.reference_diameter or options.look_only:
        return None
    try:
        found = head_of_long_table(path)
        if found is None:
            return None
        file, count = found
        if not options.columns and format_of(file) not in (CSV, PARQUET):
            return None
        head = read_touch_columns(file, options)
    except (InputError, OSError):
        return None
    if not head.table.has(*_NEEDED):
        return None
    decimals = head.table.decimals(*_NEEDED[3:])
    rows = in_blocks(file, count, head.table, head.places, head.separator, decimals)
    return LongTable(rows, head, options)
