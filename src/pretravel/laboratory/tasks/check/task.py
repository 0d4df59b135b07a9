"""Check a probe by a standard: touches on a calibrated sphere to figures, and their report.

Also the touches of a standard, as targets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import (
    DEGREE,
    DEVIATION_OF_FORM,
    MICROMETRE,
    TIP_BALL,
    U_OF_DIAMETER,
    UNCERTAINTY,
    PretravelError,
)
from pretravel.task import (
    ANSWER,
    SILENT,
    UPRIGHT,
    Angles,
    Diameter,
    Field,
    LaboratoryReport,
    OfOneTip,
    ProbeAxis,
    Progress,
    Result,
    SphereCenter,
    SphereDiameter,
    StartClearance,
    Task,
    TouchFiles,
    Turn,
    Vector,
    When,
    by_name,
    output,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from pretravel.files import FileReadings, LaboratoryStatements
    from pretravel.laboratory.measured_spheres import MeasuredSphere
    from pretravel.laboratory.standards.standard_check import (
        CalibratedSphere,
        Standard,
        StandardCheck,
    )
    from pretravel.maps import PretravelMap
    from pretravel.show import Document

_ON_ITS_OWN_TOUCHES = (
    "on its own touches a map looks better than it is, because it follows a part of their "
    "scatter. Check it on new touches"
)
_LIMITED: Mapping[str, tuple[str, ...]] = {
    "form_limit_um": ("form", "form2d", "form3d"),
    "size_limit_um": ("size",),
    "repeat_limit_um": ("repeatability",),
    "offset_limit_um": ("offset",),
}
"""Settings of limits, and the names of the figures that they limit."""


def _checks() -> Iterator[str]:
    from pretravel.task import STANDARDS

    yield from STANDARDS


def _patterns() -> list[str]:
    from pretravel.task import patterns

    return list(patterns())


def _standards(used: Callable[[Standard], bool]) -> tuple[When, ...]:
    """The standards that use a setting."""

    def names() -> list[str]:
        from pretravel.task import STANDARDS

        return [name for name, standard in STANDARDS.usable().items() if used(standard)]

    return (When("standard", names),)


def _uses(what: str) -> tuple[When, ...]:
    return _standards(lambda standard: what in standard.uses)


def _limit(name: str, label: str, text: str) -> Field:
    limited = _standards(lambda standard: not standard.limits.isdisjoint(_LIMITED[name]))
    return Field(help=text, range=UNCERTAINTY, label=label, only=limited)


class Check(TouchFiles, OfOneTip, LaboratoryReport):
    """Determine the probing errors that an ISO standard defines, from touches on a sphere.

    The definitions were written without the texts of the standards and have not been checked
    against them: there is no statement of conformity, unless the file of the laboratory (--lab)
    declares that the laboratory has checked them.
    Exit code 3: a test value exceeds its limit.
    """

    name = "check"
    example = (
        "pretravel check iso10360-5 touches.csv --diameter 25 --tip-diameter 5.967 -o check.html"
    )

    standard: Annotated[
        str,
        Field(
            help="iso10360-5 (25 touches on a sphere), iso230-10 (36 on the equator) or "
            "iso230-10-tip-offset (a circle at two or more orientations of the spindle).",
            names=_checks,
            positional=True,
            metavar="STANDARD",
            words={
                "iso10360-5": "ISO 10360-5: 25 touches on a sphere",
                "iso230-10": "ISO 230-10: 36 touches on the equator",
                "iso230-10-tip-offset": "ISO 230-10, stylus-tip offset: a circle at two "
                "orientations",
            },
        ),
    ]
    diameter: Diameter
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Effective diameter of the tip that the control uses after its calibration, in "
            "mm, for the size error. With the nominal diameter, this error contains the pretravel.",
            range=TIP_BALL,
            label="Diameter of the tip",
        ),
    ] = None
    map_file: Annotated[
        Path | None,
        Field(
            help="Compensate the touches with this map, which gives the diameter of the tip.",
            option="--map",
            reads=True,
            only=_uses("map"),
        ),
    ] = None
    form_limit_um: Annotated[
        float | None,
        _limit("form_limit_um", "Form error", "Maximum permissible form error, in µm."),
    ] = None
    size_limit_um: Annotated[
        float | None,
        _limit("size_limit_um", "Size error", "Maximum permissible size error, in µm."),
    ] = None
    repeat_limit_um: Annotated[
        float | None,
        _limit(
            "repeat_limit_um", "Range of repeats", "Maximum permissible range of repeats, in µm."
        ),
    ] = None
    offset_limit_um: Annotated[
        float | None,
        _limit(
            "offset_limit_um",
            "Offset of the tip",
            "Maximum permissible offset of the tip, in µm.",
        ),
    ] = None
    spindle: Annotated[
        Angles | None,
        Field(
            help="Orientation of the spindle in each file, in degrees, such as 0,180, where the "
            "files have no column spindle_deg.",
            only=_uses("spindle"),
            label="Orientation of the spindle in each file",
            hint="0,180 for example, where the files do not give it",
            metavar="ANGLES",
        ),
    ] = None
    ring: Annotated[
        bool,
        Field(help="The reference is a ring.", label="The reference is a ring", only=_uses("ring")),
    ] = False
    u_diameter_um: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the diameter, in µm: U of the certificate, divided by "
            "its k.",
            range=U_OF_DIAMETER,
            only=_uses("u_diameter"),
            label="u of the diameter",
            hint="Half of U (k = 2) on the certificate",
        ),
    ] = None
    sphere_form_um: Annotated[
        float | None,
        Field(
            help="Form error of the sphere, in µm.",
            range=DEVIATION_OF_FORM,
            only=_uses("sphere_form"),
            label="Form error of the sphere",
        ),
    ] = None
    axis: ProbeAxis = UPRIGHT
    output: Annotated[
        Path | None,
        output(
            "Test values: .csv; the report: .json, or a page, .html or .pdf.", ".csv", report=True
        ),
    ] = None

    @property
    def sphere(self) -> CalibratedSphere:
        """The reference."""
        from pretravel.laboratory.standards.standard_check import CalibratedSphere

        return CalibratedSphere(
            self.diameter, _millimetres(self.u_diameter_um), _millimetres(self.sphere_form_um)
        )

    @property
    def limits(self) -> dict[str, float]:
        """The maximum permissible errors that are stated, by figure. [mm]

        >>> task = Check(
        ...     standard="iso230-10", touches="t.csv", diameter=25,
        ...     form_limit_um=2, repeat_limit_um=1,
        ... )
        >>> task.limits
        {'form': 0.002, 'form2d': 0.002, 'form3d': 0.002, 'repeatability': 0.001}
        """
        stated = {
            figure: _millimetres(getattr(self, name))
            for name, figures in _LIMITED.items()
            for figure in figures
        }
        return {figure: limit for figure, limit in stated.items() if limit is not None}

    def _refuse_limit_without_size(self) -> None:
        known = self.tip_diameter is not None or self.map_file is not None
        if self.size_limit_um is not None and not known:
            raise PretravelError(
                "a limit of the size error needs the diameter of the tip, or a map: give one of "
                "them",
                inputs=("tip_diameter", "map"),
            )

    def _refuse_idle_limits(self, result: StandardCheck) -> None:
        """Refuse a limit of a figure that the touches do not determine."""
        from pretravel.task import STANDARDS

        limited = {figure.limit for figure in result.figures}
        for name, figures in _LIMITED.items():
            limit = _millimetres(getattr(self, name))
            own = not STANDARDS[self.standard].limits.isdisjoint(figures)
            if own and limit is not None and limit not in limited:
                raise PretravelError(
                    "the touches do not determine what this limit is for (repeats need several "
                    "touches of each direction): touch again, or leave the limit out",
                    inputs=(name.removesuffix("_um"),),
                )

    def run(self, progress: Progress = SILENT) -> CheckedProbe:
        """Read the touches and determine the figures.

        Raises
        ------
        PretravelError
            Touches that are not those of the pattern of the standard; a limit of the size without
            a size error.
        """
        from pretravel.files import read_map
        from pretravel.maps import QualificationSetup

        statements = self.statements()
        self._refuse_limit_without_size()
        QualificationSetup(self.diameter, self.tip_diameter, self.ring)  # exchanged diameters
        spindle = None if self.spindle is None else [a * DEGREE for a in self.spindle.degrees]
        pretravel_map, tip_diameter = None, self.tip_diameter
        if self.map_file is not None:
            pretravel_map = read_map(self.map_file, tip_diameter=tip_diameter)
            tip_diameter = 2.0 * pretravel_map.tip_radius
        readings = self.read_touches(
            progress,
            tip_diameter=tip_diameter,
            reference_diameter=self.diameter,
            ring=self.ring,
            spindle=spindle,
        ).in_machine_axes()
        return self._checked(readings, pretravel_map, statements)

    def _checked(
        self,
        readings: FileReadings,
        pretravel_map: PretravelMap | None,
        statements: LaboratoryStatements | None,
    ) -> CheckedProbe:
        from pretravel.laboratory.measured_spheres import measured_sphere
        from pretravel.laboratory.standards.iso230_10_tip_offset import points_inwards
        from pretravel.laboratory.standards.standard_check import LimitOutcome
        from pretravel.measurement import apply
        from pretravel.qualification import own_touches_warnings, several_feeds
        from pretravel.task import STANDARDS

        measured = readings.touches
        measured.refuse_several()
        if self.ring and not points_inwards(measured):
            raise PretravelError(
                "a ring is touched from inside, and these normals point away from its middle: is "
                "the reference a sphere?",
                inputs=("ring",),
            )
        result = STANDARDS[self.standard].procedure(
            measured,
            self.sphere,
            tip_diameter=self.tip_diameter,
            pretravel_map=pretravel_map,
            axis=self.axis,
            limits=self.limits,
        )
        self._refuse_idle_limits(result)
        if statements is not None and statements.compared(result.standard):
            result = result.compared()
        warnings, sphere = list(readings.notes()), None
        if measured.feeds is not None and several_feeds(measured):
            low, high = measured.feeds.min(), measured.feeds.max()
            warnings.append(
                f"the touches are at {low:g} to {high:g} mm/min: feed × signal delay makes the "
                "form larger, and belongs to no error of the probe. Touch at one feed"
            )
        if pretravel_map is not None:
            sphere = measured_sphere(measured, apply(measured, pretravel_map), pretravel_map)
            warnings += own_touches_warnings(measured, pretravel_map, _ON_ITS_OWN_TOUCHES)
        exceeds = any(figure.outcome is LimitOutcome.EXCEEDS for figure in result.figures)
        return CheckedProbe(
            self,
            readings,
            result,
            sphere,
            tuple(warnings),
            statements,
            exit_code=ANSWER if exceeds else 0,
        )


def _millimetres(micrometres: float | None) -> float | None:
    return None if micrometres is None else micrometres * MICROMETRE


def not_stated(result: StandardCheck, words: Mapping[str, str] | None = None) -> tuple[str, ...]:
    """A warning where figures have a limit and the reference has no uncertainty for them.

    Parameters
    ----------
    result : StandardCheck
    words : mapping of str to str, optional
        How the caller names ``u_diameter_um`` and ``sphere_form_um``, which state it.

    Returns
    -------
    tuple of str
        One sentence, or none.
    """
    from pretravel.laboratory.standards.standard_check import (
        DIAMETER_OF_REFERENCE,
        FORM_OF_REFERENCE,
    )

    names = words or {
        "u_diameter_um": "the standard uncertainty of the reference's diameter",
        "sphere_form_um": "the form error of the reference",
    }
    sources = {DIAMETER_OF_REFERENCE: "u_diameter_um", FORM_OF_REFERENCE: "sphere_form_um"}
    lacking = {f.u_source for f in result.figures if f.limit is not None and f.u_test is None}
    needed = " and ".join(names[each] for source, each in sources.items() if source in lacking)
    if not needed:
        return ()
    what = "the values are compared with their limits without an uncertainty zone"
    return (f"{what}, which needs {needed}",)


@dataclass(frozen=True, eq=False)
class CheckedProbe(Result):
    """The figures of a standard with the touches that they come from.

    Attributes
    ----------
    task : Check
    readings : FileReadings
    result : StandardCheck
    sphere : MeasuredSphere or None
        Through all touches, compensated; None without a map.
    warnings : tuple of str
        Of readings and map.
    statements : LaboratoryStatements or None
    exit_code : int
    """

    task: Check
    readings: FileReadings
    result: StandardCheck
    sphere: MeasuredSphere | None
    warnings: tuple[str, ...] = ()
    statements: LaboratoryStatements | None = None
    exit_code: int = 0

    def document(self) -> Document:
        """The report, with what the laboratory states, and what it does not."""
        left_out = self.task.statement_warnings()
        return self.with_warnings(self.task.touches_name, [*self._lacking(), *left_out])

    def with_warnings(self, touches_name: str = "", warnings: Sequence[str] = ()) -> Document:
        """The report with warnings of the caller."""
        from pretravel.laboratory.tasks.check.report import standards_document
        from pretravel.task import with_laboratory

        report = standards_document(
            self.result,
            touches_name=touches_name,
            sphere=self.sphere,
            method=(*self._method(), *self._comparisons()),
            warnings=[*self.warnings, *warnings],
        )
        report = replace(report, notes=(*self._notes(), *report.notes))
        return with_laboratory(report, self.statements)

    def _comparisons(self) -> Iterator[str]:
        """Whether the definitions, and the rule of decisions, were compared with their texts."""
        from pretravel.files import comparison_sentence

        yield comparison_sentence(self.result.standard, self.statements)
        if any(figure.limit is not None for figure in self.result.figures):
            yield comparison_sentence("ISO 14253-1", self.statements)

    def _method(self) -> Iterator[str]:
        """What was done, in sentences for a certificate."""
        task, count = self.task, len(self.readings.touches)
        what = "ring" if task.ring else "sphere"
        text = f"{count} touches on a calibrated {what} of {task.diameter:g} mm were evaluated."
        if task.map_file is not None:
            text += f" They were compensated with the map {task.map_file.name}."
        elif task.tip_diameter is not None:
            text += f" The effective diameter of the tip is {task.tip_diameter:g} mm."
        yield text

    def _notes(self) -> tuple[str, ...]:
        """What was tested, where no map is given."""
        if self.task.map_file is not None:
            return ()
        return (
            (
                "the touches were tested as the machine reports them. With a map (and without "
                "the tip's diameter), compensated points would be tested instead"
            ),
        )

    def write(self, output: str, path: Path) -> None:
        """Write the figures."""
        del output
        from pretravel.files import write_csv_table
        from pretravel.laboratory.standards.standard_figures import standard_table

        write_csv_table(path, standard_table(self.result))

    def _lacking(self) -> tuple[str, ...]:
        options = {name: setting.option for name, setting in by_name(Check).items()}
        return not_stated(self.result, options)


class Pattern(Task):
    """Write the touches that an ISO standard asks for, for simulate or for a machine's program.

    Each touch starts with the tip centre at start_x_mm,… and moves along -n.
    """

    name = "pattern"
    example = "pretravel pattern iso10360-5 --diameter 25 -o targets.csv"

    standard: Annotated[
        str,
        Field(
            help="iso10360-5 (25 touches on a sphere), iso10360-5-cumulative (the same, each ring "
            "turned further) or iso230-10 (36 on the equator); equator-12, "
            "equator-24, equator-36: around the equator, as a multi-step test touches it.",
            names=_patterns,
            positional=True,
            metavar="STANDARD",
        ),
    ]
    diameter: SphereDiameter
    output: Annotated[Path, output("Targets: .csv.", ".csv")]
    center: SphereCenter = Vector(0, 0, 0)
    tip_diameter: Annotated[
        float,
        Field(
            help="Diameter of the tip, in mm, for the positions where touches start.",
            range=TIP_BALL,
        ),
    ] = 6.0
    clearance: StartClearance = 5.0
    repeats: Annotated[
        int,
        Field(help="Touches of each direction, one after the other.", range=(1, 1000)),
    ] = 1
    turn_deg: Turn = 0.0
    axis: ProbeAxis = UPRIGHT

    def run(self, progress: Progress = SILENT) -> PatternTargets:
        """The targets."""
        del progress
        from pretravel.files import pattern_table
        from pretravel.task import patterns

        columns = pattern_table(
            patterns()[self.standard](),
            self.center,
            0.5 * self.diameter,
            0.5 * self.tip_diameter + self.clearance,
            axis=self.axis,
            turn=self.turn_deg * DEGREE,
            repeats=self.repeats,
        )
        count = len(columns["label"])  # type: ignore[arg-type]
        memory = " (the pattern has not been checked against the published standard)"
        plain = self.standard.startswith("equator-")
        return PatternTargets(
            columns,
            f"{count} targets on a sphere of {self.diameter:g} mm{'' if plain else memory}\n",
        )


@dataclass(frozen=True, eq=False)
class PatternTargets(Result):
    """The touches of a standard as targets.

    Attributes
    ----------
    columns : dict of str to array_like
        Of the table of targets.
    text : str
    """

    columns: dict[str, npt.ArrayLike]
    text: str

    def write(self, output: str, path: Path) -> None:
        """Write the table."""
        del output
        from pretravel.files import write_csv_table

        write_csv_table(path, self.columns)
