"""Compensate touches: readings and a map to surface points, and their report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base.quantities import TIP_BALL
from pretravel.tasks.fields import (
    ModelName,
    PlacedPart,
    Reported,
    TouchFilesWithFeed,
    existing,
    output,
    surface_files,
    with_reading,
)
from pretravel.tasks.task import PAGES, SILENT, Field, Progress, Result

if TYPE_CHECKING:
    from pretravel.files.file_format import FileReadings
    from pretravel.maps.pretravel_map import PretravelMap
    from pretravel.measurement.point_errors import PointErrors
    from pretravel.measurement.points import Points
    from pretravel.measurement.points_summary import TouchSummary
    from pretravel.show.document import Document
    from pretravel.surface.cad.part import Part
    from pretravel.surface.local_geometry import Surface
    from pretravel.tasks.long_tables import LongCompensation
    from pretravel.touches import Touches


class Compensate(TouchFilesWithFeed, PlacedPart, Reported):
    """Compensate touches to surface points with uncertainties."""

    name = "compensate"
    group = "Measure"
    example = (
        "pretravel compensate part.csv --map map.json --nominal part.step -o points.csv "
        "--plot points.png"
    )

    map_file: Annotated[
        str,
        Field(
            help="Map from qualify or predict: .json, or a .csv table; or a probe (catalogue name "
            "or .toml), whose map is predicted.",
            option="--map",
            label="Map",
            reads=existing,
        ),
    ]
    output: Annotated[
        Path,
        output(
            "Surface points: .csv, .parquet, .nc, .json, .qif, .msr (Fusion); or a page, .html or "
            ".pdf.",
            ".csv",
            *PAGES,
        ),
    ]
    nominal: Annotated[
        str | None,
        Field(
            help="Nominal surface: part.step, part.step#face, plane:…, sphere:… (as in simulate); "
            "the contact is computed on it. Without it, the normals are those of the touches, and "
            "deviations refer to the columns nominal_x_mm…, where these exist.",
            reads=surface_files,
        ),
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the tip, in mm; the default is that of the map.",
            range=TIP_BALL,
            label="Diameter of the tip",
            hint="Empty: that of the map",
        ),
    ] = None
    extrapolate: Annotated[
        bool,
        Field(help="Allow directions outside the map.", label="Allow directions outside the map"),
    ] = False
    model: ModelName = "analytic"

    def endings(self, output: str) -> tuple[str, ...]:
        """Points are written in each format that is known."""
        from pretravel.files.point_files import point_endings

        return (*point_endings(), *PAGES) if output == "output" else super().endings(output)

    def run(self, progress: Progress = SILENT) -> CompensatedTouches | LongCompensation:
        """Read the touches and the map, and determine the points.

        Returns
        -------
        CompensatedTouches
            Or `LongCompensation`, of a table that is too long for the memory.
        """
        self.placement()
        pretravel_map, nominal = self.pretravel_map(), self.nominal_surface()
        long = self._long_table_compensated(pretravel_map, nominal, progress)
        if long is not None:
            return long
        readings = self.read_touches(progress, tip_diameter=2.0 * pretravel_map.tip_radius)
        with progress.working(f"compensating {len(readings.touches)} touches"):
            return self.compensated(readings, pretravel_map, nominal)

    def pretravel_map(self) -> PretravelMap:
        """The map, in the axes of the machine."""
        from pretravel.tasks.map_argument import map_or_prediction

        return map_or_prediction(self.map_file, self.model, tip_diameter=self.tip_diameter)

    def nominal_surface(self) -> Surface | Part | None:
        """The surface on which contacts are computed; a Python file that has it is executed."""
        from pretravel.surface.specification import parse_surface

        return None if self.nominal is None else parse_surface(self.nominal)

    def compensated(
        self,
        readings: FileReadings,
        pretravel_map: PretravelMap,
        nominal: Surface | Part | None = None,
        *,
        shared: bool = True,
    ) -> CompensatedTouches:
        """Compensate touches that have been read.

        Parameters
        ----------
        readings : FileReadings
            From `read_touches`.
        pretravel_map : PretravelMap
            In the axes of the machine.
        nominal : Surface, Part or None
            The contact is computed on it; None: the normals are those of the touches.
        shared : bool
            The points state which errors they have in common.

        Raises
        ------
        PretravelError
            Touches without normals or nominal, directions outside the map.
        """
        from pretravel.measurement.compensation import apply, compensation_warnings
        from pretravel.measurement.point_errors import errors_of_points
        from pretravel.measurement.points import placed
        from pretravel.measurement.points_summary import TouchSummary
        from pretravel.touches import moved

        measured = readings.touches
        # Without --place, a log states the rotation of its work coordinates.
        placement = readings.placement if self.place is None else self.placement()
        in_machine = self.frame == "machine"
        if in_machine:
            measured = moved(measured, placement.inverse)
        seen = pretravel_map.seen_from(placement)
        points = apply(
            measured,
            seen,
            nominal=nominal,
            extrapolate=self.extrapolate,
            shared=shared,
        )
        errors = errors_of_points(measured, points.normals, seen)
        summary = TouchSummary.of(measured, points, seen)
        if in_machine:
            points = placed(points, placement)
        warnings = tuple(compensation_warnings(summary, pretravel_map))
        return CompensatedTouches(
            self, readings, measured, pretravel_map, nominal, points, errors, summary, warnings
        )

    def _long_table_compensated(
        self, pretravel_map: PretravelMap, nominal: Surface | Part | None, progress: Progress
    ) -> LongCompensation | None:
        """Compensate one long table part by part; the points are then in the output."""
        from pretravel.tasks.long_tables import compensate_long_table, long_table_of

        tip_diameter = 2.0 * pretravel_map.tip_radius
        options = self.reading_options(tip_diameter=tip_diameter, exclude=self.exclude)
        table = long_table_of(self.files, options, self.output)
        if table is None:
            return None
        with progress.working(f"compensating about {table.count:,} touches"):
            found = compensate_long_table(table, pretravel_map, self, nominal)
        if found.reading:
            progress.say(f"read: {found.reading}")
        return found


@dataclass(frozen=True, eq=False)
class CompensatedTouches(Result):
    """Surface points with the touches and the map that they come from.

    Attributes
    ----------
    task : Compensate
    readings : FileReadings
    touches : Touches
        In the frame of the part.
    pretravel_map : PretravelMap
    nominal : Surface, Part or None
    points : Points
        In the frame of the touches as they were given.
    errors : PointErrors
        Sources of error of the points, in the frame of the part; `point_budget` makes budgets.
    summary : TouchSummary
        Of the touches, which the warnings come from.
    warnings : tuple of str
    """

    task: Compensate
    readings: FileReadings
    touches: Touches
    pretravel_map: PretravelMap
    nominal: Surface | Part | None
    points: Points
    errors: PointErrors
    summary: TouchSummary
    warnings: tuple[str, ...] = ()

    def document(self) -> Document:
        """The report."""
        from pretravel.measurement.point_budget import point_budget
        from pretravel.tasks.reports.points_report import points_document

        task = self.task
        return points_document(
            self.points,
            touches_name=task.touches_name,
            nominal=self.nominal,
            placement=task.placement() if task.frame == "machine" else None,
            warnings=[*self.readings.notes(), *self.warnings],
            budgets=[point_budget(self.errors)],
        )

    def page(self) -> Document:
        """The report, with how the files were understood."""
        return with_reading(self.document(), self.readings)

    def write(self, output: str, path: Path) -> None:
        """Write the points, with the names of the files that they come from."""
        del output
        from pretravel.files.point_files import write_points

        made, name = self.pretravel_map, self.task.touches_name
        source = made.provenance.source or "unknown"
        read = self.touches.reading
        reading = f"; {name} was read as {read}" if read else ""
        map_name = Path(self.task.map_file).name
        write_points(
            path,
            self.points,
            f"{name} compensated with {map_name} ({made.kind}; {source}){reading}",
            nominal_points=self.touches.nominal_points,
            tip_radius=made.tip_radius,
        )
