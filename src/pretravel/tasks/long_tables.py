"""Compensate long tables of touches part by part: the memory does not grow with them."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.files.long_table import LongTable, written_in_parts
from pretravel.files.point_tables import points_table
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import compensation_warnings
from pretravel.measurement.point_budget import budget_of_variances, variances_along_normals
from pretravel.measurement.points import Points, joined_points
from pretravel.measurement.points_summary import PointsSummary, TouchSummary
from pretravel.measurement.selection import points_at
from pretravel.show.document import Document, Picture
from pretravel.tasks.compensate import CompensatedTouches, CompensationSetup, compensate_readings
from pretravel.tasks.reports.points_picture import points_view
from pretravel.tasks.reports.points_report import summary_document

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
class LongCompensation:
    """The compensation of a long table, without its points, which are in the output.

    Attributes
    ----------
    table : LongTable
    pretravel_map : PretravelMap
    setup : CompensationSetup
    found : CompensatedPart
        Of the whole table.
    warnings : tuple of str
        Of the reader.
    """

    table: LongTable
    pretravel_map: PretravelMap
    setup: CompensationSetup
    found: CompensatedPart
    warnings: tuple[str, ...]

    @property
    def reading(self) -> str:
        """How the table was understood, where that is not plain."""
        how = self.table.understood
        return f"{len(self.found.points)} touches; {how}" if how else ""

    def document(self, touches_name: str = "") -> Document:
        """The report; its pictures and its budget are those of some of the points.

        Parameters
        ----------
        touches_name : str
            Of the file.
        """
        title = f"{touches_name}, compensated" if touches_name else "Compensated points"
        setup, drawn = self.setup, joined_points(self.found.drawn)
        placement = setup.placement if setup.frame == "machine" else None
        picture = Picture(
            f"{len(drawn)} of the {len(self.found.points)} points before and after compensation, "
            "pretravel and uncertainty",
            lambda: points_view(drawn, title, nominal=setup.nominal, placement=placement),
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


def compensate_long_table(
    table: LongTable, pretravel_map: PretravelMap, setup: CompensationSetup, output: str | Path
) -> LongCompensation:
    """Compensate a long table of touches part by part, and write the points.

    Parameters
    ----------
    table : LongTable
        From `long_table`.
    pretravel_map : PretravelMap
        In the axes of the machine.
    setup : CompensationSetup
    output : str or Path
        .csv or .parquet. The points are those of `compensate_readings`. They do not state which
        errors they have in common, so that `measure` takes the largest uncertainty that any
        correlation produces.

    Returns
    -------
    LongCompensation

    Raises
    ------
    PretravelError
        As `compensate_readings`; the output is then not written.
    """
    setup = replace(setup, shared=False)
    found: CompensatedPart | None = None
    warnings: dict[str, None] = {}
    with written_in_parts(output) as append:
        for readings in table.readings():
            result = compensate_readings(readings, pretravel_map, setup)
            append(points_table(result.points))
            done = 0 if found is None else len(found.points)
            part = _part_of(result, done, max(table.count // _DRAWN, 1))
            found = part if found is None else found.joined(part)
            warnings |= dict.fromkeys(readings.warnings)
            done = len(found.points)
            ratio = min(done / max(table.count, 1), 0.99)
            log.info("%d touches of about %d", done, table.count, extra={"done": ratio})
    assert found is not None  # a table has rows
    return LongCompensation(table, pretravel_map, setup, found, tuple(warnings))


def _part_of(result: CompensatedTouches, first_row: int, apart: int) -> CompensatedPart:
    some = np.arange(-first_row % apart, len(result.points), apart)
    return CompensatedPart(
        PointsSummary.of(result.points),
        result.summary,
        (points_at(result.points, some),) if len(some) else (),
        (variances_along_normals(result.errors.at(some)),) if len(some) else (),
    )
