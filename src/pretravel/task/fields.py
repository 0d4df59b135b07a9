"""Settings that several tasks share, described once; and what these settings mean together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, TypeAlias

from pretravel.base import (
    ANGLE,
    FEED,
    REFERENCE_DIAMETER,
    SLOWEST_USUAL_FEED,
    TIP_BALL,
    InputError,
    PretravelError,
)
from pretravel.task.task import (
    PAGES,
    PICTURES,
    SILENT,
    Field,
    Progress,
    Task,
    by_name,
    unused,
)
from pretravel.task.values import StatedColumns, UnitVector

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pretravel.base import Placement
    from pretravel.files import FileReadings, LaboratoryStatements, ReadingOptions
    from pretravel.touches import Targets


# Names of registries, which are read when a command runs


def existing(value: object) -> list[Path]:
    """The file that a value names; a name of a catalogue is none."""
    return [Path(str(value))]


def placement_files(place: str) -> list[Path]:
    """The file of a placement; none for ``x,y,z,a,b,c``."""
    return [Path(place)] if place.lower().endswith(".json") else []


def is_placement(text: str) -> bool:
    """Whether a text is a placement as it is typed, ``x,y,z,a,b,c``."""
    from pretravel.base import parse_placement

    try:
        parse_placement(text)
    except PretravelError:
        return False
    return not placement_files(text)


def files_meant(places: Sequence[Path]) -> list[Path]:
    """The files of an argument that takes files, a folder or a name with ``*``."""
    from pretravel.files import files_of

    return files_of(places)


# Reference, tip, probe

Diameter: TypeAlias = Annotated[
    float,
    Field(
        help="Calibrated diameter of the sphere (or ring), in mm.",
        range=REFERENCE_DIAMETER,
        label="Diameter of the reference",
        hint="On the certificate of the sphere or ring",
    ),
]
Ring: TypeAlias = Annotated[
    bool, Field(help="The reference is a ring gauge.", label="The reference is a ring gauge")
]
Turn: TypeAlias = Annotated[
    float, Field(help="Rotation of the pattern about the probe axis, in degrees.", range=ANGLE)
]
QualifiedMap: TypeAlias = Annotated[
    Path,
    Field(help="Map of pretravel qualify, .json.", option="--map", label="Map", reads=True),
]
ProbeAxis: TypeAlias = Annotated[
    UnitVector,
    Field(
        help="Direction of the probe axis, from the tip to the spindle, in the machine's frame.",
        label="Axis of the probe, tip to spindle",
        metavar="X,Y,Z",
    ),
]
UPRIGHT = UnitVector(0, 0, 1)
Units: TypeAlias = Literal["mm", "inch"]
StatedUnits: TypeAlias = Annotated[
    Units | None,
    Field(
        help="Unit of length, for a file that does not give it.",
        label="Unit of the file",
        words={"": "as the file shows it"},
    ),
]
TipOfMap: TypeAlias = Annotated[
    float | None,
    Field(
        help="Diameter of the tip, in mm; the default is the diameter in the map.",
        range=TIP_BALL,
        label="Diameter of the tip",
        hint="Empty: that of the map",
    ),
]


# Where the part is


class PlacedPart(Task):
    """Settings of tasks on a part that is not in the machine's frame."""

    place: Annotated[
        str | None,
        Field(
            help="Placement of the part in the machine (mm, degrees, or the .json file of "
            "pretravel align). Where it is typed, also state the frame. Rotations are about the "
            "machine's axes, in that order; the probe is not rotated.",
            metavar="X,Y,Z,A,B,C",
            reads=placement_files,
            word=is_placement,
        ),
    ] = None
    frame: Annotated[
        Literal["part", "machine"] | None,
        Field(
            help="Frame of the touches, needed where the placement is typed; with the file of a "
            "placement the default is the frame of the machine.",
            words={
                "": "With a file: the machine's",
                "part": "Frame of the part",
                "machine": "Frame of the machine",
            },
            only=("place",),
        ),
    ] = None

    @property
    def in_machine(self) -> bool:
        """Whether the touches are in the machine's frame."""
        of_file = self.frame is None and bool(self.place and placement_files(self.place))
        return self.frame == "machine" or of_file

    def placement(self) -> Placement:
        """The placement that is stated.

        Raises
        ------
        PretravelError
            Touches in the machine's frame without a placement of the part; a typed placement
            without the frame of the touches.
        """
        from pretravel.base import Placement, parse_placement
        from pretravel.files import read_placement

        if self.place is not None:
            files = placement_files(self.place)
            typed = None if files else parse_placement(self.place)
            if typed is not None and self.frame is None:
                raise PretravelError(
                    "are the touches in the frame of the part, or of the machine? A turn of the "
                    "part gives them other normals in the machine. Give the frame: part or machine",
                    inputs=("place", "frame"),
                )
            return read_placement(files[0]) if typed is None else typed
        if self.frame == "machine":
            raise PretravelError(
                "touches in the machine's frame need the placement of the part: x,y,z,a,b,c",
                inputs=("place",),
            )
        return Placement()


# Reports

Verbose: TypeAlias = Annotated[bool, Field(help="Print the full report, not only the key figures.")]


class Reported(Task):
    """Settings of tasks that show a report."""

    section: ClassVar[str] = "Output"

    plot: Annotated[Path | None, Field(help="Picture: .png, .svg or .pdf.", writes=PICTURES)] = None
    verbose: Verbose = False


def output(text: str, *endings: str, report: bool = False) -> Field:
    """The description of the main output, ``-o``.

    Parameters
    ----------
    text : str
        Help.
    endings : str
        Of the files; `PAGES` among them for a page.
    report : bool
        Whether the report is written too, as values (.json) or as a page.
    """
    endings = (*endings, ".json", *PAGES) if report else endings
    return Field(help=text, writes=endings, short="-o", report_json=report)


class LaboratoryReport(Reported):
    """Settings of tasks whose reports a laboratory keeps."""

    section: ClassVar[str] = "Output"

    lab: Annotated[
        Path | None,
        Field(
            help="File with laboratory, instrument and its serial numbers, reference, environment "
            "and operator, for the report: .toml, as pretravel laboratory prints it.",
            reads=True,
        ),
    ] = None

    def statements(self, **read: float | None) -> LaboratoryStatements | None:
        """What the file of the laboratory states; None without a file.

        Parameters
        ----------
        **read : float or None
            What files give in the place of settings, such as a feed.

        Raises
        ------
        PretravelError
            It contradicts a setting.
        """
        if self.lab is None:
            return None
        from pretravel.files import read_laboratory

        found = read_laboratory(self.lab)
        self.compare_statements(found, **read)
        return found

    def compare_statements(self, found: LaboratoryStatements, **read: float | None) -> None:
        """Refuse what the laboratory states against a setting or a file, as `statements`."""
        every = {name: getattr(self, name) for name in by_name(type(self))}
        used = {key: value for key, value in every.items() if not unused(type(self), key, every)[0]}
        used |= {key: value for key, value in read.items() if used.get(key) is None}
        for setting, said in found.contradictions(used):
            raise PretravelError(
                f"{self.lab.name if self.lab else 'the laboratory'} contradicts {said}. Correct "
                "the one that is wrong",
                inputs=tuple(dict.fromkeys(("lab", setting))),
            )

    def statement_warnings(self) -> list[str]:
        """Warnings about the laboratory's statements: of a warm reference, of what is not shown."""
        return [*self._warm_reference(), *self._statements_left_out()]

    def _warm_reference(self) -> list[str]:
        diameter, u = (getattr(self, name, None) for name in ("diameter", "u_temperature"))
        found = None if diameter is None or u is None else self.statements()
        if found is None or diameter is None or u is None:
            return []
        said = found.warm_reference(diameter, u)
        return [f"{self.lab.name}: {said}"] if said and self.lab else []

    def _statements_left_out(self) -> list[str]:
        """A warning where nothing that is shown or written contains the laboratory's statements."""
        setting = by_name(type(self))["output"]
        output: Path | None = getattr(self, "output", None)
        if self.lab is None or self.verbose or (output is not None and setting.is_report(output)):
            return []
        contained = "a page (-o page.html) and the full report (--verbose) contain these data"
        if output is None:
            return [f"{self.lab.name} was given, but is not shown: {contained}"]
        return [f"{output.name} does not contain what {self.lab.name} gives: {contained}"]


# Touches from files


def _formats() -> Iterable[str]:
    from pretravel.files import FORMATS

    return FORMATS


FileFormatName: TypeAlias = Annotated[
    str | None,
    Field(
        help="Format of the file (pretravel formats lists them); the default is detected.",
        option="--from",
        names=_formats,
        metavar="FORMAT",
        label="Format",
    ),
]
Series: TypeAlias = Annotated[
    tuple[str, ...],
    Field(
        help="Use only the touches of this part, pass or orientation (columns part, pass, "
        "orientation of the file). May be repeated. all: the touches of all parts and passes are "
        "one series.",
        metavar="NAME",
        label="Part or series",
    ),
]


class OfOneTip(Task):
    """Settings of tasks that take the touches of one tip."""

    section: ClassVar[str] = "Reading a file"

    tip: Annotated[
        str | None,
        Field(
            help="Use only the touches of this tip (column tip of the file).",
            metavar="NAME",
            label="Tip",
        ),
    ] = None


class TouchTables(Task):
    """Settings of tasks that read tables of touches: what a file does not state itself."""

    section: ClassVar[str] = "Reading a file"

    units: StatedUnits = None
    file_format: FileFormatName = None
    series: Series = ()
    columns: Annotated[
        StatedColumns | None,
        Field(
            help="Columns of a table by name or number, for x,y,z,nx,ny,nz,ax,ay,az,feed,spindle,"
            "label,tip,part,pass,orientation,a,b,c,nominal_x…; nx=-I changes the sign; label=none: "
            "no column is used as label. Other columns are found by their names.",
            metavar="x=X,nx=I,…",
        ),
    ] = None
    decimal: Annotated[
        Literal["comma", "point"] | None,
        Field(help="Decimal sign of a table whose numbers do not show it."),
    ] = None
    plan: Annotated[
        Path | None,
        Field(
            help="The targets that were touched, for files that contain positions only.",
            reads=True,
        ),
    ] = None
    plan_columns: Annotated[
        StatedColumns | None,
        Field(
            help="Columns of the table with the plan, written as in --columns.",
            only=("plan",),
            metavar="x=X,nx=I,…",
        ),
    ] = None
    join: Annotated[
        Literal["line", "label", "feature"],
        Field(
            help="How positions are assigned to the targets of the plan. line: a position lies on "
            "the line of its target; label: both have the same label; feature: both have the same "
            "label without the number at its end.",
            only=("plan",),
        ),
    ] = "line"
    double_touches: Annotated[
        Literal["last", "all"] | None,
        Field(
            help="Each place was touched twice, first fast and then slowly. last: use the slow "
            "touches alone; all: use both, and determine the signal delay from their feeds.",
        ),
    ] = None
    normal: Annotated[
        UnitVector | None,
        Field(
            help="Outward normal of the surface at all touches, for files that contain positions "
            "only: 0,0,1 for heights.",
            metavar="X,Y,Z",
        ),
    ] = None

    def reading_options(
        self,
        *,
        tip_diameter: float | None = None,
        reference_diameter: float | None = None,
        ring: bool = False,
        exclude: Sequence[str] = (),
    ) -> ReadingOptions:
        """What the settings state about the files."""
        from pretravel.files import ReadingOptions

        return ReadingOptions(
            plan=None if self.plan is None else self._run_plan(self.plan),
            units=self.units,
            tip_radius=None if tip_diameter is None else 0.5 * tip_diameter,
            columns=self.columns,
            decimal=self.decimal,
            double_touches=self.double_touches,
            join=self.join,
            normal=self.normal,
            exclude=tuple(exclude),
            reference_diameter=reference_diameter,
            ring=ring,
            pin=ring and getattr(self, "pin", False),
            tip=self.chosen_tip,
            series=self.series,
        )

    @property
    def chosen_tip(self) -> str | None:
        """The tip whose touches are used; None: the file states none, or one."""
        tip = getattr(self, "tip", None)
        return tip if isinstance(tip, str) else None

    def _run_plan(self, path: Path) -> Targets:
        """The plan that was run; the unit of the touches is also its unit, if it states none."""
        from pretravel.files import ReadingOptions, read_plan

        options = ReadingOptions(columns=self.plan_columns)
        try:
            try:
                return read_plan(path, options)
            except InputError as error:
                if self.units is None or "units" not in error.inputs:
                    raise
                return read_plan(path, replace(options, units=self.units))
        except InputError as error:
            # Rows of the plan cannot be excluded; its columns have an option of their own.
            others = tuple(name for name in error.inputs if name not in ("columns", "exclude"))
            own = ("plan_columns",) if "columns" in error.inputs else ()
            raise PretravelError(str(error), inputs=(*own, *others)) from None


class TouchFiles(TouchTables):
    """Settings of tasks on touches from files."""

    section: ClassVar[str] = "Reading a file"

    touches: Annotated[
        tuple[Path, ...],
        Field(
            help="Table of any usual form (X;Y;Z;I;J;K or x_mm,y_mm,z_mm,nx,ny,nz …), or a file in "
            "one of the formats of 'pretravel formats'; several files, a folder or a name with * "
            "are read as one series.",
            positional=True,
            metavar="TOUCHES",
            reads=files_meant,
        ),
    ]
    exclude: Annotated[
        tuple[str, ...],
        Field(
            help="Label or line of a touch to leave out, or FILE:LINE of one of several files; may "
            "be repeated."
        ),
    ] = ()

    @property
    def files(self) -> list[Path]:
        """The files that the argument means."""
        return files_meant(self.touches)

    @property
    def touches_name(self) -> str:
        """Their name in titles."""
        files = self.files
        return files[0].name if len(files) == 1 else f"{files[0].name} … {files[-1].name}"

    def read_touches(
        self,
        progress: Progress = SILENT,
        *,
        tip_diameter: float | None = None,
        reference_diameter: float | None = None,
        ring: bool = False,
        spindle: Sequence[float] | None = None,
    ) -> FileReadings:
        """Read the touches; how the files were understood is said where that is not plain.

        Parameters
        ----------
        progress : Progress
        tip_diameter, reference_diameter : float or None
            [mm]
        ring : bool
        spindle : sequence of float or None
            Orientation of the spindle in each file. [rad]
        """
        options = self.reading_options(
            tip_diameter=tip_diameter,
            reference_diameter=reference_diameter,
            ring=ring,
            exclude=self.exclude,
        )
        return self.read_with(options, progress, spindle=spindle)

    def read_with(
        self,
        options: ReadingOptions,
        progress: Progress = SILENT,
        *,
        file_format: str | None = None,
        spindle: Sequence[float] | None = None,
    ) -> FileReadings:
        """Read the touches as `read_touches` does, with more that is stated about the files.

        Parameters
        ----------
        options : ReadingOptions
        progress : Progress
        file_format : str, optional
            Detected when not given.
        spindle : sequence of float or None
            Orientation of the spindle in each file. [rad]
        """
        from pretravel.files import read_series

        if self.columns and self.file_format not in (None, "csv", "parquet"):
            raise PretravelError(
                f"columns are those of a table, and {self.file_format} is none: leave one of them "
                "out",
                inputs=("columns", "file_format"),
            )
        known = file_format or (None if self.columns else self.file_format)
        readings = read_series(self.files, options, file_format=known, spindle=spindle)
        if readings.touches.reading:
            progress.say(f"read: {readings.touches.reading}")
        feed = getattr(self, "feed", None)
        said = []
        if feed is not None and feed < SLOWEST_USUAL_FEED:
            said = [f"a feed of {feed:g} mm/min is unusually slow: is it in mm/s or m/min?"]
        return replace(
            readings,
            touches=readings.touches.with_feed(feed),
            warnings=(*readings.warnings, *said),
        )


FeedOfTouches: TypeAlias = Annotated[
    float | None,
    Field(
        help="Feed of the touches, in mm/min, for a file without a column feed_mm_min.",
        range=FEED,
        label="Feed of the touches",
        hint="Only where the file does not give it",
    ),
]


class TouchFilesWithFeed(TouchFiles):
    """Settings of tasks on touches from files, which can state the feed of all touches."""

    section: ClassVar[str] = "Reading a file"

    feed: FeedOfTouches = None
