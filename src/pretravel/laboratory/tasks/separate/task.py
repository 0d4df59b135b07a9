"""Separate machine and probe: multi-step readings to errors and variances; the plan of a test."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, Self

from pretravel.base import MICROMETRE, NOISE, TIP_BALL, PretravelError
from pretravel.task import (
    MAPS,
    PAGES,
    SILENT,
    UPRIGHT,
    Angles,
    Field,
    LaboratoryReport,
    ProbeAxis,
    Progress,
    Result,
    Task,
    files_meant,
    output,
    typed_numbers,
)

if TYPE_CHECKING:
    from pretravel.files import LaboratoryStatements
    from pretravel.laboratory.separation.multi_step_readings import RepeatedPair
    from pretravel.laboratory.separation.plan import SeparationPlan
    from pretravel.laboratory.separation.separation import Separation
    from pretravel.show import Document

_VARIANCE = (0.0, 1e6)
"""[µm²]"""
_PAIR = "MACHINE,PROBE"
_REPEATS = 10
"""Where their number is not given."""
_ASSUMED = f"the number of repeats, {_REPEATS}, is assumed; give yours (--repeat-count)"
_NO_TIP = "a map needs the diameter of the tip, in mm"


class Indices(NamedTuple):
    """The index of a machine and that of a probe direction."""

    machine: int
    probe: int

    def __str__(self) -> str:
        return f"{self.machine},{self.probe}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """Two whole numbers from ``machine,probe``.

        >>> Indices.parse("1,2")
        Indices(machine=1, probe=2)
        """
        expected = "two whole numbers, for example 1,1"
        first, second = typed_numbers(text.replace(":", ","), 2, expected)
        if first != round(first) or second != round(second):
            raise PretravelError(f"expected {expected}")
        return cls(int(first), int(second))


class Separate(LaboratoryReport):
    """Separate the errors and variances of machine and probe, from multi-step readings.

    A reading is the error of the machine minus that of the probe, for one pair of directions.
    """

    name = "separate"
    example = "pretravel separate readings.csv --repeat-variance 0.8 --repeat-pair 1,1 -o s.csv"

    readings: Annotated[
        tuple[Path, ...],
        Field(
            help="CSV with machine_index,probe_index,error_um (distance of the tip centre from "
            "that of the sphere, minus the radii of sphere and tip, in µm), or touches of the "
            "reference's equator at each orientation of the probe "
            "(x_mm,y_mm,z_mm,nx,ny,nz,spindle_deg), in one file or in one "
            "for each setup: files, a folder or a name with *.",
            positional=True,
            metavar="READINGS",
            reads=files_meant,
        ),
    ]
    spindle: Annotated[
        Angles | None,
        Field(
            help="Orientation of the probe in each file, in degrees, where the touches do not "
            "give it: 0:345:15.",
            metavar="ANGLES",
            label="Orientation of the probe in each file",
            hint="0:345:15 in °",
        ),
    ] = None
    axis: ProbeAxis = UPRIGHT
    repeat_variance: Annotated[
        float | None,
        Field(
            help="Variance of one pair of directions, measured by repeats, in µm².",
            range=_VARIANCE,
            unit="µm²",
            label="Variance of one pair, by repeats",
        ),
    ] = None
    repeat_pair: Annotated[
        Indices | None,
        Field(
            help="Indices of the repeated pair.",
            label="Indices of the repeated pair",
            only=("repeat_variance",),
            hint="Machine and probe: 1,1",
            metavar=_PAIR,
        ),
    ] = None
    repeat_count: Annotated[
        int | None,
        Field(
            help="Number of repeats from which --repeat-variance was estimated; default: 10.",
            range=(2, 1_000_000),
            label="Number of these repeats",
            only=("repeat_variance",),
        ),
    ] = None
    method: Annotated[
        Literal["reml", "least-squares", "paper"],
        Field(
            help="How variances are estimated. reml: restricted maximum likelihood. least-squares. "
            "paper: the equations of Nafi and Mayer 2011 as printed.",
            label="Method of the variances",
            words={
                "reml": "restricted maximum likelihood",
                "least-squares": "least squares",
                "paper": "the paper's equations as printed",
            },
        ),
    ] = "reml"
    clockwise: Annotated[
        bool,
        Field(
            help="The orientations of the probe are counted clockwise, seen from the spindle.",
            label="Orientations are counted clockwise",
            hint="A warning says where they seem to be",
        ),
    ] = False
    pair: Annotated[
        tuple[Indices, ...],
        Field(
            help="Print the variance of this pair too.",
            label="Pairs whose variance is shown too",
            hint="1,1 2,5",
            metavar=_PAIR,
        ),
    ] = ()
    exclude: Annotated[
        tuple[Indices, ...],
        Field(
            help="Leave the readings of this pair out; may be repeated.",
            label="Pairs whose readings are left out",
            hint="1,1 2,5",
            metavar=_PAIR,
        ),
    ] = ()
    map_file: Annotated[
        Path | None,
        Field(
            help="Map of the probe's errors across its axis, for touches on vertical walls: .json "
            "or .csv.",
            option="--map",
            writes=MAPS,
        ),
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Effective diameter of the tip by the machine's qualification, in mm.",
            range=TIP_BALL,
            only=("map_file",),
        ),
    ] = None
    output: Annotated[
        Path | None,
        output(
            "Errors and variances: .csv; the report: .json, or a page, .html or .pdf.",
            ".csv",
            report=True,
        ),
    ] = None

    def run(self, progress: Progress = SILENT) -> SeparatedErrors:
        """Read the readings and separate their errors.

        Raises
        ------
        PretravelError
            A variance of repeats without its configuration; as `separate`.
        """
        import numpy as np

        from pretravel.laboratory.separation.multi_step_readings import counted_the_other_way
        from pretravel.laboratory.separation.separation import separate
        from pretravel.laboratory.separation.separation_csv import read_multi_step_test

        if self.map_file is not None and self.tip_diameter is None:
            raise PretravelError(_NO_TIP, inputs=("tip_diameter",))
        statements = self.statements()
        repeated = self._repeated()
        measured, notes, warnings = read_multi_step_test(
            self.files,
            axis=self.axis,
            spindle=None if self.spindle is None else np.radians(self.spindle.degrees).tolist(),
        )
        if self.clockwise:
            measured = counted_the_other_way(measured)
        with progress.working(f"separating {len(measured)} readings"):
            found = separate(measured, method=self.method, repeated=repeated, exclude=self.exclude)
        assumed = repeated is not None and self.repeat_count is None
        found = replace(found, notes=(*notes, *found.notes, *((_ASSUMED,) if assumed else ())))
        return SeparatedErrors(self, found, statements, warnings)

    @property
    def files(self) -> list[Path]:
        """The files that the argument means."""
        return files_meant(self.readings)

    def _repeated(self) -> RepeatedPair | None:
        """The configuration that was repeated."""
        from pretravel.laboratory.separation.multi_step_readings import RepeatedPair

        variance, repeated = self.repeat_variance, self.repeat_pair
        if variance is None:
            return None
        if repeated is None:
            raise PretravelError(
                "the variance of repeats needs the indices of its pair",
                inputs=("repeat_variance", "repeat_pair"),
            )
        count = _REPEATS if self.repeat_count is None else self.repeat_count
        return RepeatedPair(*repeated, variance * MICROMETRE**2, count=count)


@dataclass(frozen=True, eq=False)
class SeparatedErrors(Result):
    """The separated errors of machine and probe.

    Attributes
    ----------
    task : Separate
    separation : Separation
    statements : LaboratoryStatements or None
    warnings : tuple of str
        Of the reader of touches.
    """

    task: Separate
    separation: Separation
    statements: LaboratoryStatements | None = None
    warnings: tuple[str, ...] = ()

    def document(self) -> Document:
        """The report, with what the laboratory states."""
        from pretravel.laboratory.tasks.separate.report import separation_document
        from pretravel.maps import TIP_AS_STATED, doubts_between
        from pretravel.task import with_laboratory

        task = self.task
        between = doubts_between(self.separation.probe_azimuth) if task.map_file else ()
        report = separation_document(
            self.separation,
            readings_name=task.files[0].name,
            pairs=task.pair,
            warnings=[*self.warnings, *between, *task.statement_warnings()],
        )
        if task.map_file is not None:
            report = replace(report, notes=(*report.notes, TIP_AS_STATED))
        return with_laboratory(report, self.statements)

    def write(self, output: str, path: Path) -> None:
        """Write the errors and variances, or the map of the probe."""
        from pretravel.files import write_csv_table, write_map
        from pretravel.laboratory.separation.probe_map import separation_map
        from pretravel.laboratory.separation.separation_csv import separation_table

        if output == "map_file":
            if self.task.tip_diameter is None:
                raise PretravelError(_NO_TIP, inputs=("tip_diameter",))
            made = separation_map(
                self.separation, 0.5 * self.task.tip_diameter, axis=self.task.axis
            )
            write_map(path, made)
            return
        write_csv_table(path, separation_table(self.separation))


class PlanSeparation(Task):
    """Plan a multi-step test: orientations and repeats for a required uncertainty."""

    name = "separation-plan"
    example = (
        "pretravel separation-plan --directions 24 --variance 0.4 --u-systematic 0.2 -o form.csv"
    )

    directions: Annotated[
        int,
        Field(help="Directions of machine and probe, equally spaced.", range=(2, 3600)),
    ] = 24
    variance: Annotated[
        float,
        Field(
            help="Expected variance of a touch, machine and probe together, in µm².",
            range=_VARIANCE,
            unit="µm²",
        ),
    ] = 0.5
    u_systematic_um: Annotated[
        float | None,
        Field(help="Standard uncertainty to reach for each error, in µm.", range=NOISE),
    ] = None
    u_variance: Annotated[
        float | None,
        Field(
            help="Relative standard uncertainty to reach for each direction's variance, in %.",
            range=(0.001, 1000.0),
            unit="%",
        ),
    ] = None
    output: Annotated[
        Path | None,
        output(
            "Form with all touches in order, to fill in: .csv; or a page, .html or .pdf.",
            ".csv",
            *PAGES,
        ),
    ] = None

    def run(self, progress: Progress = SILENT) -> PlannedSeparation:
        """Plan the test.

        Raises
        ------
        PretravelError
            As `plan_separation`.
        """
        from pretravel.laboratory.separation.plan import plan_separation

        u_error, u_variance = self.u_systematic_um, self.u_variance
        with progress.working("planning"):
            plan = plan_separation(
                self.directions,
                self.variance * MICROMETRE**2,
                u_error=None if u_error is None else u_error * MICROMETRE,
                u_variance=None if u_variance is None else u_variance / 100.0,
            )
        return PlannedSeparation(plan)


@dataclass(frozen=True, eq=False)
class PlannedSeparation(Result):
    """A planned multi-step test."""

    plan: SeparationPlan

    def document(self) -> Document:
        """The orientations and the repeats."""
        from pretravel.laboratory.tasks.separate.report import separation_plan_document

        return separation_plan_document(self.plan)

    def write(self, output: str, path: Path) -> None:
        """Write the form."""
        del output
        from pretravel.files import write_csv_table
        from pretravel.laboratory.separation.separation_csv import separation_plan_table

        write_csv_table(path, separation_plan_table(self.plan))
