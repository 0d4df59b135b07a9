"""Align a part: where it lies in the machine, from touches on its faces."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pretravel.base import PretravelError
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    OfOneTip,
    Progress,
    Reported,
    Result,
    TipOfMap,
    TouchFilesWithFeed,
    existing,
    is_placement,
    is_probe,
    output,
    placement_files,
)

if TYPE_CHECKING:
    from pretravel.base import Placement
    from pretravel.drawing.alignment.alignment import Alignment, Datum
    from pretravel.drawing.alignment.tip_centres import TipCentres
    from pretravel.files import FileReadings
    from pretravel.maps import PretravelMap
    from pretravel.show import Document
    from pretravel.surface import Part

_LETTERS = dict(zip("xyzabc", ("x", "y", "z", "about x", "about y", "about z"), strict=True))
_MORE = "--verbose or -o report.html"
_OFF = 1.0
"""Farther from the part than the radius of a tip, a target is not one on the part. [mm]"""


class Align(TouchFilesWithFeed, OfOneTip, Reported):
    """Determine where a part lies in the machine, from touches on its faces.

    Touches need no normals: the faces give the normals, the map gives the pretravel at these
    normals. Without --map the tip radius alone is subtracted. Without --start, --plan or nominal
    points in the file, all placements are searched.
    """

    name = "align"
    example = (
        "pretravel align touches.csv --part part.step --map map.json -o place.json "
        "--points points.csv"
    )

    part: Annotated[Path, Field(help="The part: .step, .stp, .igs or .iges.", reads=True)]
    map_file: Annotated[
        str | None,
        Field(
            help="Map from qualify or predict: .json, or a .csv table; or a probe (catalogue name "
            "or .toml). Without it the tip's radius alone is subtracted.",
            option="--map",
            label="Map",
            reads=existing,
            word=is_probe,
        ),
    ] = None
    tip_diameter: TipOfMap = None
    start: Annotated[
        str | None,
        Field(
            help="Approximate placement of the part (x,y,z in mm, then rotations in degrees about "
            "the machine's axes x, y, z, in this order, or a .json file of pretravel align). "
            "Without a start, the placement follows from the plan (--plan), or is searched.",
            metavar="X,Y,Z,A,B,C",
            reads=placement_files,
            word=is_placement,
        ),
    ] = None
    datum: Annotated[
        tuple[str, ...],
        Field(
            help="Faces of a datum, by number or name: A=3, then B=7,8, in the order of the "
            "drawing. Without it: best fit on all touched faces.",
            metavar="NAME=FACES",
            label="Datums",
            hint="A=3 B=7,8: numbers of faces, in the order of the drawing",
        ),
    ] = ()
    datum_association: Annotated[
        Literal["gaussian", "outside"],
        Field(
            help="How datums are fitted. gaussian: least squares of all touches. outside: from "
            "outside the material (ISO 5459): tangent planes, inscribed bores and circumscribed "
            "bosses (associations of these names in measure), which rest on a few touches.",
            label="Association of the datums",
            words={
                "gaussian": "by least squares (Gaussian)",
                "outside": "from outside the material (ISO 5459)",
            },
        ),
    ] = "gaussian"
    free: Annotated[
        str,
        Field(
            help="Motions to determine: shifts along x, y, z and rotations a, b, c about x, y, z "
            "of the machine. The other motions stay as in --start.",
            metavar="x,y,z,a,b,c",
        ),
    ] = "x,y,z,a,b,c"
    extrapolate: Annotated[
        bool,
        Field(
            help="Allow directions outside the map.",
            label="Allow directions outside the map",
            only=("map_file",),
        ),
    ] = False
    points: Annotated[
        Path | None,
        Field(
            help="Compensated points in the frame of the part, for measure: .csv, .parquet, .json, "
            ".nc, .qif, .msr.",
            writes=(".csv",),
            label="Points in the frame of the part",
        ),
    ] = None
    output: Annotated[
        Path | None,
        output(
            "Placement with its uncertainty, for compensate --place: .json; or a page, .html or "
            ".pdf.",
            ".json",
            *PAGES,
        ),
    ] = None

    def endings(self, output: str) -> tuple[str, ...]:
        """Points are written in each format that is known."""
        if output != "points":
            return super().endings(output)
        from pretravel.files import point_endings

        return point_endings()

    def run(self, progress: Progress = SILENT) -> AlignedPart:
        """Read touches, part and map, and determine the placement."""
        from pretravel.surface import read_part

        pretravel_map = self.pretravel_map()
        with progress.working(f"reading {self.part.name}"):
            part = read_part(self.part)
        readings = self.readings(progress, pretravel_map)
        with progress.working(f"aligning {len(readings.touches)} touches"):
            return self.aligned(readings, part, pretravel_map)

    def pretravel_map(self) -> PretravelMap:
        """The map, in the axes of the machine; the tip's radius alone where there is none."""
        from pretravel.drawing.alignment.alignment import radius_alone
        from pretravel.task import map_or_prediction

        if self.map_file is not None:
            return map_or_prediction(self.map_file, tip_diameter=self.tip_diameter)
        if self.tip_diameter is None:
            raise PretravelError(
                "the map, or the tip's diameter, is needed: the touches are tip centres",
                inputs=("map", "tip_diameter"),
            )
        if self.feed is not None:
            raise PretravelError(
                "without a map the feed is not used: give the map, or leave the feed out",
                inputs=("map_file", "feed"),
            )
        return radius_alone(0.5 * self.tip_diameter)

    def readings(self, progress: Progress, pretravel_map: PretravelMap) -> FileReadings:
        """The touches, in the axes of the machine; their normals are directions of approach."""
        from dataclasses import replace

        from pretravel.files import one_normal

        options = self.reading_options(
            tip_diameter=2.0 * pretravel_map.tip_radius, exclude=self.exclude
        )
        return self.read_with(
            replace(options, normals_from=one_normal([0.0, 0.0, 1.0])), progress
        ).in_machine_axes()

    def aligned(
        self, readings: FileReadings, part: Part, pretravel_map: PretravelMap
    ) -> AlignedPart:
        """Align touches that have been read.

        Parameters
        ----------
        readings : FileReadings
            In the axes of the machine; their normals are directions of approach alone.
        part : Part
        pretravel_map : PretravelMap

        Raises
        ------
        PretravelError
            Several placements explain the touches, or none does.
        """
        from pretravel.base import ExtrapolationError
        from pretravel.drawing.alignment.aligning import only_placement
        from pretravel.drawing.alignment.alignment_fit import align
        from pretravel.drawing.alignment.tip_centres import TipCentres
        from pretravel.files import map_word
        from pretravel.maps import refuse_other_orientation
        from pretravel.measurement import TouchSummary, with_step_of_touches

        pretravel_map, coarse = with_step_of_touches(pretravel_map, readings.touches)
        refuse_other_orientation(readings.touches, pretravel_map)
        tips = TipCentres.of(readings.touches, stated_approaches=not readings.normals_taken)
        extrapolate = self.extrapolate or self.map_file is None
        start, unused = self._start(tips, part, pretravel_map)
        found_from, notes = "as given", tuple[str, ...]()
        coarse += unused
        if start is None:
            start = only_placement(tips, part, pretravel_map, extrapolate=extrapolate)
            found_from = "a search over all placements"
        elif self.start is None:
            found_from = "the targets of the plan"
        try:
            alignment = align(
                tips,
                part,
                pretravel_map,
                start,
                datums=self.datums(part),
                free=self._free(),
                extrapolate=extrapolate,
            )
        except ExtrapolationError as error:
            if self.start is None:
                raise
            raise ExtrapolationError(
                f"{error} Is the start right (x, y, z in mm, then three angles in degrees)?",
                inputs=("start", *error.inputs),
            ) from None
        if self.map_file is not None:
            used = map_word(self.map_file, pretravel_map)
            alignment = replace(alignment, points=replace(alignment.points, map_used=used))
            summary = TouchSummary.of_conditions(readings.touches, pretravel_map)
            coarse += tuple(summary.conditions(pretravel_map))
            notes = tuple(summary.notes(pretravel_map))
        readings = replace(readings, warnings=(*readings.warnings, *coarse))
        return AlignedPart(self, readings, alignment, found_from, notes)

    def _start(
        self, tips: TipCentres, part: Part, pretravel_map: PretravelMap
    ) -> tuple[Placement | None, tuple[str, ...]]:
        """The start that is stated, or that of the targets; None where there is none.

        Targets off the part are those of another frame, such as the machine's: they say nothing
        of the place of the part, and a warning names them.
        """
        import numpy as np

        from pretravel.base import parse_placement
        from pretravel.drawing.alignment.alignment_fit import placement_onto
        from pretravel.files import read_placement
        from pretravel.surface import feet_on_faces

        if self.start is not None:
            files = placement_files(self.start)
            return read_placement(files[0]) if files else parse_placement(self.start), ()
        if tips.nominal_points is None or len(tips) < 3:
            return None, ()
        feet = feet_on_faces(part, tips.nominal_points)
        away = float(np.median(np.linalg.norm(tips.nominal_points - feet.local.point, axis=1)))
        if away > pretravel_map.tip_radius + _OFF:
            said = (
                f"the targets of the touches are {away:.3g} mm from the faces of {part.name} "
                "(median): they are in another frame, or of another part. They were not used"
            )
            return None, (said,)
        return placement_onto(tips.nominal_points, tips.positions), ()

    def datums(self, part: Part) -> list[Datum]:
        """The datums, with the indices of their faces.

        Raises
        ------
        PretravelError
            A datum without faces, or faces that the part does not have.
        """
        from pretravel.drawing.alignment.alignment import Datum

        found = []
        if self.datum_association == "outside" and not self.datum:
            raise PretravelError(
                "only datums can be associated from outside the material, and none is given: "
                "give the datums",
                inputs=("datum", "datum_association"),
            )
        for text in self.datum:
            name, sign, faces = text.partition("=")
            words = [word.strip() for word in faces.split(",") if word.strip()]
            if not (sign and name.strip() and words):
                raise PretravelError(
                    f"datum '{text}': expected a name and its faces, for example A=3 or B=7,8",
                    inputs=("datum",),
                )
            chosen = [index for word in words for index in part.select(word).chosen]
            found.append(Datum(name.strip(), tuple(chosen), self.datum_association == "outside"))
        return found

    def _free(self) -> tuple[str, ...]:
        letters = [word.strip() for word in self.free.split(",") if word.strip()]
        unknown = [letter for letter in letters if letter not in _LETTERS]
        if unknown or not letters:
            raise PretravelError(
                f"the free motions are '{self.free}'; they are some of x,y,z (shifts) and a,b,c "
                "(turns about x, y, z)",
                inputs=("free",),
            )
        return tuple(_LETTERS[letter] for letter in letters)


@dataclass(frozen=True, eq=False)
class AlignedPart(Result):
    """A part with its placement in the machine.

    Attributes
    ----------
    task : Align
    readings : FileReadings
    alignment : Alignment
    found_from : str
        Where the search began.
    notes : tuple of str
        What holds where touches or map do not state feed or orientation.
    """

    task: Align
    readings: FileReadings
    alignment: Alignment
    found_from: str
    notes: tuple[str, ...] = ()

    def document(self) -> Document:
        """The report."""
        from dataclasses import replace

        from pretravel.drawing.tasks.align.report import alignment_document

        task = self.task
        report = alignment_document(
            self.alignment,
            touches_name=task.touches_name,
            found_from=self.found_from,
            datums=task.datum,
            warnings=self.readings.notes(),
        )
        return replace(report, notes=(*self.notes, *report.notes))

    def in_brief(self, report: Document) -> Document:
        """Where the part lies, without the deviations."""
        from dataclasses import replace

        left = f"{len(report.tables) - 1} tables of deviations"
        output = self.task.output
        page = output is not None and output.suffix in PAGES
        note = f"not shown: {left} and notes (see {'the page or --verbose' if page else _MORE})"
        notes = (*self.notes, note)
        return replace(report, tables=report.tables[:1], sections=(), notes=notes)

    def write(self, output: str, path: Path) -> None:
        """Write the placement, or the points in the frame of the part."""
        task, alignment = self.task, self.alignment
        if output == "points":
            from pretravel.files import write_points

            write_points(
                path,
                alignment.in_part,
                f"{task.touches_name} aligned on {task.part.name}, in the frame of the part",
                nominal_points=alignment.feet.local.point,
            )
            return
        from pretravel.files import write_placement

        write_placement(
            path,
            alignment.measured_placement,
            part=task.part.name,
            touches=task.touches_name,
            note="; ".join(alignment.undetermined_motions),
        )
