"""Compensate and convert long tables of touches in blocks: the memory does not grow with them."""

from __future__ import annotations

import logging
import multiprocessing
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from pretravel.base.arrays import FloatArray
from pretravel.files.appended_table import APPENDED_ENDINGS, appended_table, table_piece
from pretravel.files.file_format import ReadingOptions
from pretravel.files.point_tables import points_table
from pretravel.files.table_blocks import BLOCK_ROWS, TableBlock
from pretravel.files.touch_blocks import LongTable, long_table
from pretravel.files.touches_csv import touches_table
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import compensation_warnings
from pretravel.measurement.point_budget import budget_of_variances, variances_along_normals
from pretravel.measurement.points import Points, joined_points
from pretravel.measurement.points_summary import PointsSummary, TouchSummary
from pretravel.measurement.selection import points_at
from pretravel.show.document import Document, Picture
from pretravel.surface.cad.part import Part
from pretravel.surface.local_geometry import Surface
from pretravel.tasks.compensate import Compensate
from pretravel.tasks.reports.points_picture import points_view
from pretravel.tasks.reports.points_report import summary_document
from pretravel.tasks.task import Result
from pretravel.touches import with_feed

_DRAWN = 5000
"""Points that pictures show."""
_AHEAD = 2
"""Blocks that wait for each process: few, so that the memory does not grow with the table."""

log = logging.getLogger(__name__)
_Found = TypeVar("_Found")


@dataclass(frozen=True)
class BlockResult(Generic[_Found]):
    """What is made of a block.

    Attributes
    ----------
    piece : bytes or pyarrow.Table
        Of the output.
    count : int
        Touches.
    found
        What the work returns beside the piece.
    warnings : tuple of str
        Of the reader.
    """

    piece: Any
    count: int
    found: _Found
    warnings: tuple[str, ...] = ()


_Work = Callable[[TableBlock], BlockResult[_Found]]


@dataclass(frozen=True)
class CompensatedBlock:
    """What reports need of a block, or of several.

    Attributes
    ----------
    points : PointsSummary
    touches : TouchSummary
    drawn : tuple of Points
        Some of the points, in equal distances, for pictures.
    variances : tuple of mapping of str to (k,) float
        Of these points along their normals, by source. [mm²]
    """

    points: PointsSummary
    touches: TouchSummary
    drawn: tuple[Points, ...]
    variances: tuple[Mapping[str, FloatArray], ...]

    def joined(self, other: CompensatedBlock) -> CompensatedBlock:
        """Of both."""
        return CompensatedBlock(
            self.points.joined(other.points),
            self.touches.joined(other.touches),
            self.drawn + other.drawn,
            self.variances + other.variances,
        )


@dataclass(frozen=True)
class LongCompensation(Result):
    """The compensation of a long table, without its points, which are in the output.

    Attributes
    ----------
    task : Compensate
    table : LongTable
    pretravel_map : PretravelMap
    nominal : Surface, Part or None
    found : CompensatedBlock
        Of all blocks.
    warnings : tuple of str
        Of the reader.
    """

    task: Compensate
    table: LongTable
    pretravel_map: PretravelMap
    nominal: Surface | Part | None
    found: CompensatedBlock
    warnings: tuple[str, ...]

    @property
    def reading(self) -> str:
        """How the table was understood, where that is not plain."""
        how = self.table.understood
        return f"{len(self.found.points)} touches; {how}" if how else ""

    def document(self) -> Document:
        """The report; its pictures and its budget are those of some of the points."""
        task, drawn = self.task, joined_points(self.found.drawn)
        title = f"{task.touches_name}, compensated"
        placement = task.placement() if task.frame == "machine" else None
        picture = Picture(
            f"{len(drawn)} of the {len(self.found.points)} points before and after compensation, "
            "pretravel and uncertainty",
            lambda: points_view(drawn, title, nominal=self.nominal, placement=placement),
        )
        variances = {
            name: float(np.mean(np.concatenate([part[name] for part in self.found.variances])))
            for name in self.found.variances[0]
        }
        dof = self.pretravel_map.repeatability_dof
        budget = budget_of_variances(variances, dof, f"rms of {len(drawn)} of the points")
        stated = compensation_warnings(self.found.touches, self.pretravel_map)
        return summary_document(
            self.found.points,
            picture,
            title=title,
            warnings=[*self.warnings, *stated],
            budgets=[budget],
        )

    def write(self, output: str, path: Path) -> None:
        """Nothing: the points were written block by block."""


@dataclass(frozen=True)
class _Compensation:
    """Compensates the blocks of a table."""

    table: LongTable
    pretravel_map: PretravelMap
    nominal: Surface | Part | None
    task: Compensate

    def __call__(self, block: TableBlock) -> BlockResult[CompensatedBlock]:
        readings = self.table.read(block)
        fed = replace(readings, touches=with_feed(readings.touches, self.task.feed))
        result = self.task.compensated(fed, self.pretravel_map, self.nominal, shared=False)
        points, errors = result.points, result.errors
        apart = max(self.table.count // _DRAWN, 1)
        some = np.arange(-block.first_row % apart, len(points), apart)
        found = CompensatedBlock(
            PointsSummary.of(points),
            result.summary,
            (points_at(points, some),) if len(some) else (),
            (variances_along_normals(errors.at(some)),) if len(some) else (),
        )
        ending = self.task.output.suffix.lower()
        piece = table_piece(ending, points_table(points), first=block.first_row == 0)
        return BlockResult(piece, len(points), found, readings.warnings)


@dataclass(frozen=True)
class _Conversion:
    """Converts the blocks of a table."""

    table: LongTable
    feed: float | None
    ending: str

    def __call__(self, block: TableBlock) -> BlockResult[None]:
        readings = self.table.read(block)
        columns = touches_table(with_feed(readings.touches, self.feed))
        piece = table_piece(self.ending, columns, first=block.first_row == 0)
        return BlockResult(piece, len(readings.touches), None, readings.warnings)


def table_in_blocks(files: list[Path], options: ReadingOptions, output: Path) -> LongTable | None:
    """The one long table that the files are, where the output can be written in blocks too.

    Parameters
    ----------
    files : list of Path
    options : ReadingOptions
    output : Path
    """
    if len(files) > 1 or output.suffix.lower() not in APPENDED_ENDINGS:
        return None
    return long_table(files[0], options)


def compensate_long_table(
    table: LongTable,
    pretravel_map: PretravelMap,
    task: Compensate,
    nominal: Surface | Part | None = None,
    *,
    workers: int = 1,
) -> LongCompensation:
    """Compensate a long table of touches block by block, and write the points.

    Parameters
    ----------
    table : LongTable
        From `long_table`.
    pretravel_map : PretravelMap
        In the axes of the machine.
    task : Compensate
        Its output is .csv or .parquet. The points are those of `Compensate.compensated`. They do
        not state which errors they have in common, so that `measure` takes the largest uncertainty
        that any correlation produces.
    nominal : Surface, Part or None
    workers : int
        Processes. More than one import the program that runs, which must then be a module, and
        take a surface only that can be sent to them: none of functions within functions.

    Returns
    -------
    LongCompensation

    Raises
    ------
    PretravelError
        As `Compensate.compensated`; the output is then not written.
    """
    work = _Compensation(table, pretravel_map, nominal, task)
    found: CompensatedBlock | None = None
    warnings: dict[str, None] = {}
    for result in _written(work, table, task.output, workers):
        found = result.found if found is None else found.joined(result.found)
        warnings |= dict.fromkeys(result.warnings)
    assert found is not None  # a table has rows
    return LongCompensation(task, table, pretravel_map, nominal, found, tuple(warnings))


def convert_long_table(
    table: LongTable, output: str | Path, *, feed: float | None = None, workers: int = 1
) -> tuple[int, tuple[str, ...]]:
    """Convert a long table of touches block by block.

    Parameters
    ----------
    table : LongTable
    output : str or Path
        .csv or .parquet.
    feed : float or None
        Of touches that do not state theirs. [mm/min]
    workers : int
        As for `compensate_long_table`.

    Returns
    -------
    int
        Touches.
    tuple of str
        Warnings.
    """
    work = _Conversion(table, feed, Path(output).suffix.lower())
    count, warnings = 0, dict[str, None]()
    for result in _written(work, table, Path(output), workers):
        count += result.count
        warnings |= dict.fromkeys(result.warnings)
    return count, tuple(warnings)


def _written(
    work: _Work[_Found], table: LongTable, output: Path, workers: int
) -> Iterator[BlockResult[_Found]]:
    """Results of the blocks, whose pieces are written to the output."""
    done = 0
    with appended_table(output) as append:
        for result in _in_order(work, table.blocks(BLOCK_ROWS), workers):
            append(result.piece)
            done += result.count
            part = min(done / max(table.count, 1), 0.99)
            log.info("%d touches of about %d", done, table.count, extra={"done": part})
            yield replace(result, piece=None)


def _in_order(
    work: _Work[_Found], blocks: Iterator[TableBlock], workers: int
) -> Iterator[BlockResult[_Found]]:
    """Results of the blocks in their order, by this process or by several."""
    if workers < 2:
        yield from map(work, blocks)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(work,)) as pool:
        waiting: deque[Future[BlockResult[_Found]]] = deque()
        try:
            for block in blocks:
                waiting.append(pool.submit(_work_on, block))
                if len(waiting) > _AHEAD * workers:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


_own_work: list[Any] = []
"""The work of this process, where it is one of several."""


def _begin(work: object) -> None:
    threadpool_limits(1)
    _own_work[:] = [work]


def _work_on(block: TableBlock) -> Any:
    return _own_work[0](block)
