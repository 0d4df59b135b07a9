"""Compensate long tables of touches part by part: the memory does not grow with them."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.files.file_format import ReadingOptions
from pretravel.files.long_table import WRITTEN_IN_PARTS, LongTable, long_table, written_in_parts
from pretravel.files.point_tables import points_table
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import compensation_warnings
from pretravel.measurement.point_budget import budget_of_variances, variances_along_normals
from pretravel.measurement.points import Points, joined_points
from pretravel.measurement.points_summary import PointsSummary, TouchSummary
from pretravel.measurement.selection import points_at
from pretravel.show.document import Document, Picture
from pretravel.surface.cad.part import Part
from pretravel.surface.local_geometry import Surface
from pretravel.tasks.compensate import Compensate, CompensatedTouches
from pretravel.tasks.reports.points_picture import points_view
from pretravel.tasks.reports.points_report import summary_document
from pretravel.tasks.task import Result
from pretravel.touches import with_feed

_DRAWN = 5000
"""Points that pictures show."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class CompensatedPart:
    """What reports need of a part of a table, or of several.

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

    def joined(self, other: CompensatedPart) -> CompensatedPart:
        """Of both."""
        return CompensatedPart(
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
    found : CompensatedPart
        Of the whole table.
    warnings : tuple of str
        Of the reader.
    """

    task: Compensate
    table: LongTable
    pretravel_map: PretravelMap
    nominal: Surface | Part | None
    found: CompensatedPart
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
        """Nothing: the points were written part by part."""


def long_table_of(files: list[Path], options: ReadingOptions, output: Path) -> LongTable | None:
    """The one long table that the files are, where the output can be written in parts too.

    Parameters
    ----------
    files : list of Path
    options : ReadingOptions
    output : Path
    """
    if len(files) > 1 or output.suffix.lower() not in WRITTEN_IN_PARTS:
        return None
    return long_table(files[0], options)


def compensate_long_table(
    table: LongTable,
    pretravel_map: PretravelMap,
    task: Compensate,
    nominal: Surface | Part | None = None,
) -> LongCompensation:
    """Compensate a long table of touches part by part, and write the points.

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

    Returns
    -------
    LongCompensation

    Raises
    ------
    PretravelError
        As `Compensate.compensated`; the output is then not written.
    """
    found: CompensatedPart | None = None
    warnings: dict[str, None] = {}
    with written_in_parts(task.output) as append:
        for read in table.readings():
            readings = replace(read, touches=with_feed(read.touches, task.feed))
            result = task.compensated(readings, pretravel_map, nominal, shared=False)
            append(points_table(result.points))
            done = 0 if found is None else len(found.points)
            part = _part_of(result, done, max(table.count // _DRAWN, 1))
            found = part if found is None else found.joined(part)
            warnings |= dict.fromkeys(readings.warnings)
            done = len(found.points)
            ratio = min(done / max(table.count, 1), 0.99)
            log.info("%d touches of about %d", done, table.count, extra={"done": ratio})
    assert found is not None  # a table has rows
    return LongCompensation(task, table, pretravel_map, nominal, found, tuple(warnings))


def _part_of(result: CompensatedTouches, first_row: int, apart: int) -> CompensatedPart:
    some = np.arange(-first_row % apart, len(result.points), apart)
    return CompensatedPart(
        PointsSummary.of(result.points),
        result.summary,
        (points_at(result.points, some),) if len(some) else (),
        (variances_along_normals(result.errors.at(some)),) if len(some) else (),
    )
