"""Compensate touches: readings and a map to surface points, and their report."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import U_OF_FRICTION, PretravelError
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    InModes,
    ModelOfMap,
    OfOneTip,
    PlacedPart,
    Progress,
    Reported,
    Result,
    TipOfMap,
    TouchFilesWithFeed,
    When,
    existing,
    is_probe,
    is_shape,
    output,
    placement_files,
    surface_files,
)
from pretravel.tasks.qualify import CompensatedTips

if TYPE_CHECKING:
    from pretravel.base import FloatArray, Placement
    from pretravel.files import FileReadings, LongTable, NormalsFrom
    from pretravel.maps import PretravelMap
    from pretravel.measurement import (
        CompensatedRows,
        PointErrors,
        Points,
        TouchScatter,
        TouchSummary,
    )
    from pretravel.show import Document
    from pretravel.surface import Part, Surface
    from pretravel.touches import Touches
_LOG = logging.getLogger(__name__)
_NORMALS_TAKEN = (
    "the touches have no normals: the normals of the {} are used, and the approach is assumed "
    "to be opposite to these normals"
)
_SURFACE = "surface"
_OTHER_SURFACE = 20.0
"""Median angle from which the stated normals are those of another surface: a bore whose expected
centre is off by half the radius of its touches has it. [°]"""
_MOVED = 1e-3
"""Of a unit motion: a point that moves less along its normal shows no error of the motion."""
_DRAWN = 5000
"""Points of a long table that pictures show."""


def _of_several_tips(map_file: object) -> bool:
    from pretravel.files import is_star_file

    return is_star_file(str(map_file))


SEVERAL_TIPS = When("map_file", is_so=_of_several_tips, what="the maps of several tips")


class Compensate(
    TouchFilesWithFeed, OfOneTip, PlacedPart, Reported, without={"place": (SEVERAL_TIPS,)}
):
    """Compensate touches to surface points with uncertainties."""

    name = "compensate"
    example = (
        "pretravel compensate part.csv --map map.json --nominal part.step -o points.csv "
        "--plot points.png"
    )

    map_file: Annotated[
        str,
        Field(
            help="Map from qualify or predict (.json or .csv), or a probe (catalogue name or "
            ".toml) whose map is predicted. A map of several tips: the column tip of the "
            "touches chooses one.",
            option="--map",
            label="Map",
            reads=existing,
            word=is_probe,
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
            help="Nominal surface, which gives normals and deviations (part.step, part.step#face, "
            "plane:polar=40,z=5, sphere:radius=12.5,x=30,y=20 …). Without it, the normals are "
            "those of the touches, and deviations refer to the columns nominal_x_mm…, if the "
            "file has them.",
            reads=surface_files,
            word=is_shape,
        ),
    ] = None
    machine: Annotated[
        Path | None,
        Field(
            help="Variances of machine and probe by direction, from pretravel separate (.json or "
            ".csv; not the .toml of pretravel machine). They replace the map's repeatability in u.",
            label="Separation of machine and probe",
            reads=True,
            without=(SEVERAL_TIPS,),
        ),
    ] = None
    tip_diameter: Annotated[TipOfMap, InModes(without=(SEVERAL_TIPS,))] = None
    feature: Annotated[
        Literal["bore", "boss", "sphere", "surface"] | None,
        Field(
            help="Take the normals from this feature, fitted to the touches, even if the file has "
            "normals (surface: from neighbouring touches, only if it has none). "
            "Touches without normals in a bore, on a boss or a sphere need this. Labels that "
            "differ in the last "
            "number only (bore1-1, bore1-2, …) are one feature. surface is a digitised surface; "
            "its normals are on the side of +z.",
            label="Feature that gives the normals",
            words={"": "the touches give normals"},
            without=("nominal", SEVERAL_TIPS),
        ),
    ] = None
    u_friction: Annotated[
        float,
        Field(
            help="Standard uncertainty of the difference between the coefficients of friction of "
            "part and reference: 0.1 for another metal. It moves points of inclined faces.",
            range=U_OF_FRICTION,
            label="u of the part's friction",
            without=(SEVERAL_TIPS,),
        ),
    ] = 0.0
    extrapolate: Annotated[
        bool,
        Field(help="Allow directions outside the map.", label="Allow directions outside the map"),
    ] = False
    model: ModelOfMap = "analytic"

    def endings(self, output: str) -> tuple[str, ...]:
        """Points are written in each format that is known; the usual ones are known here."""
        usual = super().endings(output)
        if output != "output" or self.output.suffix.lower() in usual:
            return usual
        from pretravel.files import point_endings

        return (*point_endings(self.output.suffix.lower()), *PAGES)

    def run(
        self, progress: Progress = SILENT
    ) -> CompensatedTouches | LongCompensation | CompensatedTips:
        """Read the touches and the map, and determine the points.

        Returns
        -------
        CompensatedTouches
            Or `LongCompensation`, of a table that is too long for the memory.
        """
        self.placement()
        if _of_several_tips(self.map_file):
            return self._of_several_tips(progress)
        pretravel_map, nominal = self.pretravel_map(), self.nominal_surface()
        long = self._long_table_compensated(pretravel_map, nominal, progress)
        if long is not None:
            return long
        readings = self.read_on(nominal, pretravel_map, progress)
        with progress.working(f"compensating {len(readings.touches)} touches"):
            return self.compensated(readings, pretravel_map, nominal)

    def _of_several_tips(self, progress: Progress) -> CompensatedTips:
        """Each touch with the map of its tip, and the tip's offset."""
        from pretravel.files import read_star
        from pretravel.measurement import apply_star

        star = read_star(self.map_file)
        readings = self.read_touches(progress).in_machine_axes()
        with progress.working(f"compensating {len(readings.touches)} touches"):
            points = apply_star(
                readings.touches, star, nominal=self.nominal_surface(), extrapolate=self.extrapolate
            )
        return CompensatedTips(self.touches_name, readings, star, points)

    def read_on(
        self, nominal: Surface | Part | None, pretravel_map: PretravelMap, progress: Progress
    ) -> FileReadings:
        """The touches; those without normals take them from the nominal surface or the feature."""
        options = self.reading_options(
            tip_diameter=2.0 * pretravel_map.tip_radius, exclude=self.exclude
        )
        asked = replace(options, normals_from=self._normals_from(nominal))
        readings = self.read_with(asked, progress)
        if self.feature == _SURFACE and not readings.normals_taken:
            raise PretravelError(
                "the touches have normals, so none are computed from neighbouring touches; leave "
                "the feature out",
                inputs=("feature",),
            )
        return readings

    def _normals_from(self, nominal: Surface | Part | None) -> NormalsFrom | None:
        """Where touches without normals have theirs from, in the frame of the touches."""
        from pretravel.base import Placement
        from pretravel.measurement import neighbour_normals, normals_of_feature

        placement = self.placement() if self.in_machine else Placement()

        def near(tip_centres: FloatArray, labels: tuple[str, ...] | None) -> FloatArray:
            if nominal is None and self.feature == _SURFACE:
                return neighbour_normals(tip_centres).normals
            if nominal is None:
                return normals_of_feature(str(self.feature), tip_centres, labels)
            from pretravel.surface import normals_near

            found = normals_near(nominal, placement.inverse.points(tip_centres))
            return placement.vectors(found)

        return None if nominal is None and self.feature is None else near

    def pretravel_map(self) -> PretravelMap:
        """The map, in the axes of the machine."""
        from pretravel.task import map_or_prediction

        return map_or_prediction(self.map_file, self.model, tip_diameter=self.tip_diameter)

    def touch_scatter(self) -> TouchScatter | None:
        """The scatter of single touches by direction, where a separation is given."""
        from pretravel.files import read_touch_scatter

        return None if self.machine is None else read_touch_scatter(self.machine)

    def nominal_surface(self) -> Surface | Part | None:
        """The surface on which contacts are computed; a Python file that has it is executed."""
        if self.nominal is None:
            return None
        from pretravel.surface import parse_surface

        return parse_surface(self.nominal)

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
        from pretravel.files import first_few, map_word
        from pretravel.measurement import (
            TouchSummary,
            apply_with_errors,
            other_nominal_points,
            with_errors_of_neighbours,
            with_step_of_touches,
        )

        pretravel_map, coarse = with_step_of_touches(pretravel_map, readings.touches)

        measured, refitted = self._on_feature(readings, nominal)
        # Without --place, a log states the rotation of its work coordinates.
        placement = readings.placement if self.place is None else self.placement()
        in_machine = self.in_machine
        if in_machine:
            measured = measured.moved(placement.inverse)
        seen = pretravel_map.seen_from(placement)
        scatter = self.touch_scatter()
        if scatter is not None:
            scatter = scatter.seen_from(placement)
        points, errors = apply_with_errors(
            measured,
            seen,
            nominal=nominal,
            extrapolate=self.extrapolate,
            shared=shared,
            scatter=scatter,
            u_friction=self.u_friction,
        )
        of_neighbours: tuple[str, ...] = ()
        if readings.normals_taken and nominal is None and self.feature == _SURFACE:
            points, of_neighbours = with_errors_of_neighbours(measured, points, seen)
        several = first_few([path.name for path in self.files]) if len(self.files) > 1 else ""
        points = replace(points, map_used=map_word(self.map_file, pretravel_map), files=several)
        summary = TouchSummary.of(measured, points, seen)
        warnings = tuple(summary.warnings(pretravel_map))
        if in_machine:  # nominal points are where the part was expected
            points = points.placed(placement)
        elif nominal is not None:
            warnings += other_nominal_points(measured, points)
        warnings += (
            *coarse,
            *refitted,
            *_error_of_placement(placement, points),
            *self._other_part(),
        )
        if readings.normals_taken:
            source = (
                f"fitted {self.feature}" if nominal is None else f"nearest points of {self.nominal}"
            )
            source = "neighbouring touches (z > 0)" if of_neighbours else source
            warnings = (_NORMALS_TAKEN.format(source), *of_neighbours, *warnings)
        return CompensatedTouches(
            self, readings, measured, pretravel_map, nominal, points, errors, summary, warnings
        )

    def _other_part(self) -> tuple[str, ...]:
        """Whether the file of the placement names another part than the nominal surface is."""
        from pretravel.files import part_of_placement

        of_place = placement_files(self.place or "")
        own = [] if self.nominal is None else surface_files(self.nominal)
        named = part_of_placement(of_place[0]) if of_place and own else ""
        if not named or named == own[0].name:
            return ()
        said = f"{of_place[0].name} is the placement of {named}, and the nominal surface is that of"
        return (f"{said} {own[0].name}",)

    def _on_feature(
        self, readings: FileReadings, nominal: Surface | Part | None
    ) -> tuple[Touches, tuple[str, ...]]:
        """The touches with normals of the fitted feature, and how far those of the file were off.

        A normal from the expected centre of a bore that lies elsewhere points next to the contact.
        """
        import numpy as np

        from pretravel.base import DEGREE
        from pretravel.measurement import normals_of_feature

        touches = readings.touches
        plain = nominal is None and self.feature is not None and self.feature != _SURFACE
        if not plain or readings.normals_taken:
            return touches, ()
        normals = normals_of_feature(str(self.feature), touches.positions, touches.labels)
        apart = np.arccos(np.clip(np.sum(normals * touches.normals, axis=1), -1.0, 1.0)) / DEGREE
        if np.median(apart) > _OTHER_SURFACE:
            raise PretravelError(
                f"the normals of the fitted {self.feature} are {np.median(apart):.0f}° (median) "
                "off those that the file gives: the touches are of another surface. Leave the "
                "feature out, or choose the touches of the feature",
                inputs=("feature",),
            )
        said = (
            f"the normals are those of the fitted {self.feature}; the file gives others, up to "
            f"{apart.max():.2g}° off"
        )
        return replace(touches, normals=normals), (said,)

    def _long_table_compensated(
        self, pretravel_map: PretravelMap, nominal: Surface | Part | None, progress: Progress
    ) -> LongCompensation | None:
        """Compensate one long table part by part; the points are then in the output."""
        from pretravel.files import WRITTEN_IN_PARTS, long_table

        tip_diameter = 2.0 * pretravel_map.tip_radius
        options = self.reading_options(tip_diameter=tip_diameter, exclude=self.exclude)
        files, ending = self.files, self.output.suffix.lower()
        alone = len(files) == 1 and ending in WRITTEN_IN_PARTS
        table = long_table(files[0], options) if alone else None
        if table is None:
            return None
        with progress.working(f"compensating about {table.count:,} touches"):
            found = compensate_long_table(table, pretravel_map, self, nominal)
        if found.reading:
            progress.say(f"read: {found.reading}")
        return found


def _error_of_placement(placement: Placement, points: Points) -> tuple[str, ...]:
    """What a measured placement adds to the deviations, which u of the points does not contain."""
    import numpy as np

    from pretravel.base import MICROMETRE

    if placement.errors is None or points.deviation is None:
        return ()
    moves = placement.errors.factors(points.positions)
    along = ((moves * points.normals).sum(axis=2) ** 2).sum(axis=0) ** 0.5
    most = 2.0 * float(along.max()) / MICROMETRE
    said = (
        f"deviations also contain the error of the placement, U up to {most:.2g} µm at these "
        "points. u of these points is for the frame of the machine, without this error; u of "
        "the points that align writes is for the frame of the part, and contains it"
    )
    free = placement.errors.undetermined
    normals = placement.inverse.vectors(points.normals)
    arms = np.cross(placement.inverse.points(points.positions), normals)
    moved = np.linalg.norm(np.hstack([normals, arms]) @ free, axis=1) > _MOVED
    if not moved.any():
        return (said,)
    left = (
        f"the placement leaves {free.shape[1]} motions as they were at the start, which move "
        f"{int(moved.sum())} of {len(points)} points along their normals: the deviations of these "
        "contain an error that is not known, and not in U"
    )
    return said, left


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
        Sources of error of the points, in the frame of the part; with their budget.
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
        from pretravel.tasks.compensate.report import points_document

        task, notes = self.task, self.summary.notes(self.pretravel_map)
        document = points_document(
            self.points,
            touches_name=task.touches_name,
            nominal=self.nominal,
            placement=task.placement() if task.in_machine else None,
            warnings=[*self.readings.notes(), *self.warnings],
            budgets=[self.errors.budget()],
        )
        left_out = (f"left out as requested: {name}" for name in task.exclude)
        return replace(document, notes=(*left_out, *notes))

    def write(self, output: str, path: Path) -> None:
        """Write the points, with the names of the files that they come from."""
        del output
        from pretravel.files import write_points

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


@dataclass(frozen=True)
class LongCompensation(Result):
    """The compensation of a long table, without its points, which are in the output.

    Attributes
    ----------
    task : Compensate
    table : LongTable
    pretravel_map : PretravelMap
    nominal : Surface, Part or None
    found : CompensatedRows
        Of the whole table.
    warnings : tuple of str
        Of the reader.
    """

    task: Compensate
    table: LongTable
    pretravel_map: PretravelMap
    nominal: Surface | Part | None
    found: CompensatedRows
    warnings: tuple[str, ...]

    @property
    def reading(self) -> str:
        """How the table was understood, where that is not plain."""
        how = self.table.understood
        return f"{len(self.found.points)} touches; {how}" if how else ""

    def document(self) -> Document:
        """The report; its pictures and its budget are those of some of the points."""
        from pretravel.show import Picture
        from pretravel.tasks.compensate.picture import points_view
        from pretravel.tasks.compensate.report import summary_document

        task, drawn = self.task, self.found.drawn_points
        title = f"{task.touches_name}, compensated"
        placement = task.placement() if task.in_machine else None
        picture = Picture(
            f"{len(drawn)} of the {len(self.found.points)} points before and after compensation, "
            "pretravel and uncertainty",
            lambda: points_view(drawn, title, nominal=self.nominal, placement=placement),
        )
        stated = self.found.touches.warnings(self.pretravel_map)
        notes = self.found.touches.notes(self.pretravel_map)
        document = summary_document(
            self.found.points,
            picture,
            title=title,
            warnings=[*self.warnings, *stated],
            budgets=[self.found.budget()],
        )
        left_out = (f"left out as requested: {name}" for name in task.exclude)
        return replace(document, notes=(*left_out, *notes))

    def write(self, output: str, path: Path) -> None:
        """Nothing: the points were written part by part."""


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

    Raises
    ------
    PretravelError
        As `Compensate.compensated`; the output is then not written.
    """
    from pretravel.files import points_table, written_in_parts
    from pretravel.measurement import CompensatedRows

    found: CompensatedRows | None = None
    warnings: dict[str, None] = {}
    with written_in_parts(task.output) as append:
        for read in table.readings():
            readings = replace(read, touches=read.touches.with_feed(task.feed))
            result = task.compensated(readings, pretravel_map, nominal, shared=False)
            append(points_table(result.points))
            done = 0 if found is None else len(found.points)
            apart = max(table.count // _DRAWN, 1)
            part = CompensatedRows.of(result.points, result.summary, result.errors, done, apart)
            found = part if found is None else found.joined(part)
            warnings |= dict.fromkeys(readings.warnings)
            done = len(found.points)
            ratio = min(done / max(table.count, 1), 0.99)
            _LOG.info("%d touches of about %d", done, table.count, extra={"done": ratio})
    assert found is not None  # a table has rows
    return LongCompensation(task, table, pretravel_map, nominal, found, tuple(warnings))
