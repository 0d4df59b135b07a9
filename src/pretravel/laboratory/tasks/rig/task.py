"""Calibrate a probe on a rig: traces to pretravel and hysteresis, their report and certificate."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import TIP_BALL, InputError, PretravelError
from pretravel.laboratory.rig.moved_marks import MovedMark
from pretravel.task import (
    MAPS,
    SILENT,
    Field,
    LaboratoryReport,
    Pair,
    Progress,
    Result,
    by_name,
    existing,
    is_probe,
    output,
)

if TYPE_CHECKING:
    from pretravel.files import LaboratoryStatements
    from pretravel.laboratory.rig.budget import LengthComponent
    from pretravel.laboratory.rig.calibration import RigCalibration
    from pretravel.laboratory.rig.scale import ScaleCheck
    from pretravel.laboratory.rig.trace import RigTouch, RigTrace
    from pretravel.prediction import RenTerms
    from pretravel.show import Document
    from pretravel.uncertainty import Budget

_REN_SOURCE = "Ren 2020, Table 2: the paper's rig, NOT this laboratory's"


def _traces_meant(places: Sequence[Path]) -> list[Path]:
    from pretravel.laboratory.rig.rig_csv import rig_traces

    return rig_traces(places)


_ABBE = {"abbé", "abbe"}
FOREIGN_BUDGET = (
    "the budget is that of Ren 2020, Table 2, of another laboratory; give your own as a file"
)
"""A warning where none was given."""


class Rig(LaboratoryReport):
    """Evaluate traces of a calibration rig: pretravel, hysteresis, repeatability, uncertainty."""

    name = "rig"
    example = "pretravel rig rig_*.csv --lab lab.toml -o certificate.html"

    traces: Annotated[
        tuple[Path, ...],
        Field(
            help="Traces (files, a folder or a name with *) with time_s,ruler_mm,laser_mm,contact,"
            "trigger, named by direction and repeat, such as rig_030_1.csv (azimuth 30°), "
            "rig_030p45_1.csv (polar angle 45°) or rig_+Z_1.csv (along an axis).",
            positional=True,
            reads=_traces_meant,
        ),
    ]
    output: Annotated[
        Path | None,
        output(
            "Touches: .csv; the certificate: .json with all values, or a page, .html or .pdf.",
            ".csv",
            report=True,
        ),
    ] = None
    budget: Annotated[
        Path | None,
        Field(
            help="Uncertainty budget of the rig, .csv with source,type,uncertainty_um,"
            "per_metre_um (standard uncertainties, k = 1, in µm and in µm per metre of "
            "pretravel); default: that of Ren 2020, Table 2.",
            reads=True,
        ),
    ] = None
    map_file: Annotated[
        Path | None,
        Field(
            help="Map of the mean pretravel, for compensation: .json or .csv.",
            option="--map",
            writes=MAPS,
        ),
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(help="Diameter of the tip, in mm.", range=TIP_BALL, only=("map_file",)),
    ] = None
    temperature: Annotated[
        float,
        Field(
            help="Temperature of the ruler, in °C.",
            range=(-50.0, 100.0),
            unit="°C",
            label="Temperature of the ruler",
        ),
    ] = 20.0
    expansion: Annotated[
        float,
        Field(
            help="Thermal expansion coefficient of the ruler, in 1e-6/K.",
            range=(0.0, 100.0),
            unit="1e-6/K",
            label="Thermal expansion of the ruler",
        ),
    ] = 8.0
    u_temperature: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the ruler's temperature, in K; with --u-expansion it "
            "replaces that of the budget (Ren 2020, equation 17).",
            range=(0.0, 50.0),
            unit="K",
            label="Standard uncertainty of the temperature",
        ),
    ] = None
    u_expansion: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the expansion coefficient, in 1e-6/K.",
            range=(0.0, 100.0),
            unit="1e-6/K",
            label="Standard uncertainty of the expansion",
            only=("u_temperature",),
        ),
    ] = None
    abbe: Annotated[
        Pair | None,
        Field(
            help="Distance of the ruler from the line of measurement, in mm, and standard "
            "uncertainty of the guide's tilt over the pretravel, in µrad: a line of the budget.",
            label="Abbé offset and tilt",
            hint="10,2",
            metavar="MM,URAD",
        ),
    ] = None
    scale: Annotated[
        Path | None,
        Field(
            help="Check of the ruler against a reference, .csv: scale_mm,reference_mm and, for "
            "several runs, run. The slope, periodic part and scatter replace the source 'grating "
            "scale' of the budget.",
            label="Check of the ruler against a reference",
            reads=True,
        ),
    ] = None
    probe: Annotated[
        str | None,
        Field(
            help="Description of the probe, .toml or a name of the catalogue: trigger force of "
            "each touch from its pretravel (Ren 2020, equation 14), in the column force_N.",
            reads=existing,
            word=is_probe,
        ),
    ] = None
    exclude: Annotated[
        tuple[str, ...],
        Field(
            help="Leave out the trace with this file name; may be repeated.",
            metavar="LABEL",
        ),
    ] = ()
    mark: Annotated[
        tuple[MovedMark, ...],
        Field(
            help="The ruler's position at an event, in mm, where you see the event in the trace "
            "(r0 first contact, r1 trigger, r2 stop, r3 loss of contact). The uncertainty of a "
            "moved r0, r1 or r3 covers the old position too. May be repeated.",
            metavar="TRACE:r0=MM",
        ),
    ] = ()

    def run(self, progress: Progress = SILENT) -> CalibratedRig:
        """Read the traces and calibrate the probe.

        Raises
        ------
        PretravelError
            A trace that is given twice or cannot be evaluated; marks of a trace that is not there;
            a map without the diameter of the tip; as `calibrate_rig`.
        """
        from pretravel.laboratory.rig.calibration import calibrate_rig
        from pretravel.laboratory.rig.trace import usual_feed

        if self.map_file is not None and self.tip_diameter is None:
            raise PretravelError(
                "a map needs the diameter of the tip, in mm", inputs=("tip_diameter",)
            )
        statements = self.statements()
        terms = self._terms()
        components, checked, doubts = self._components_of_files()
        paths = _traces_meant(self.traces)
        unread = [path.stem for path in paths if self._is_excluded(path) and _is_damaged(path)]
        paths = [path for path in paths if path.stem not in unread]
        with progress.working(f"reading {len(paths)} traces"):
            traces, touches = self._read(paths)
        if statements is not None and math.isfinite(usual := usual_feed(touches)):
            self.compare_statements(statements, rod_feed=usual)
        if self.output is not None and self.output.suffix.lower() == ".csv":
            # Single touches need no calibration.
            _write_touches(self.output, touches, forces=_forces(touches, terms))
        exclude = [name for name in self.exclude if name.removesuffix(".csv") not in unread]
        calibration = calibrate_rig(touches, exclude=exclude)
        calibration = replace(calibration, excluded=(*calibration.excluded, *unread))
        return CalibratedRig(
            self,
            traces,
            touches,
            calibration,
            tuple(components),
            statements,
            terms,
            checked,
            doubts,
        )

    def _components_of_files(
        self,
    ) -> tuple[list[LengthComponent], ScaleCheck | None, tuple[str, ...]]:
        """The budget with the lines that are stated here, the check of the ruler, and doubts."""
        from pretravel.files import comments_not_read, read_csv_table
        from pretravel.laboratory.rig.budget import REN_BUDGET, budget_doubts, counted_twice
        from pretravel.laboratory.rig.rig_csv import budget_of, scale_check_of
        from pretravel.laboratory.rig.scale import SCALE_SOURCE

        doubts: list[str] = []
        budget, checked = REN_BUDGET, None
        if self.budget is not None:
            table = read_csv_table(self.budget)
            budget = budget_of(table)
            doubts += [f"{self.budget.name}: {s}" for s in comments_not_read(table)]
        if self.scale is not None:
            table = read_csv_table(self.scale)
            checked = scale_check_of(table)
            doubts += [f"{self.scale.name}: {s}" for s in comments_not_read(table)]
        components = self._components(budget, checked)
        if self.u_temperature is not None:
            doubts += counted_twice(components)
        if checked is not None and not any(
            c.source.casefold().startswith(SCALE_SOURCE) for c in budget
        ):
            doubts.append(
                f"the budget has no source '{SCALE_SOURCE} …' that the check of the ruler "
                "replaces: leave out what is there twice"
            )
        return components, checked, (*doubts, *budget_doubts(components))

    def _is_excluded(self, path: Path) -> bool:
        return path.stem in self.exclude or path.name in self.exclude

    def _terms(self) -> RenTerms | None:
        """What determines a force from a pretravel; None without a description."""
        from pretravel.maps import same_tip
        from pretravel.prediction import load_probe, ren_terms_of

        if self.probe is None:
            return None
        described = load_probe(self.probe)
        own, stated = 2.0 * described.tip.radius, self.tip_diameter
        if stated is not None and not same_tip(own, stated):
            raise PretravelError(
                f"the tip of the description has a diameter of {own:.6g} mm, and {stated:g} is "
                "given: correct the one that is wrong",
                inputs=("probe", "tip_diameter"),
            )
        return ren_terms_of(described)

    def _components(
        self, components: Sequence[LengthComponent], checked: ScaleCheck | None
    ) -> list[LengthComponent]:
        """The budget with the lines that are stated here."""
        from pretravel.laboratory.rig.budget import abbe_component, thermal_components
        from pretravel.laboratory.rig.scale import SCALE_SOURCE
        from pretravel.laboratory.rig.trace import REFERENCE_TEMPERATURE

        found = list(components)
        if self.u_temperature is not None:
            if self.u_expansion is None:
                raise PretravelError(
                    "the uncertainty of the ruler's temperature needs the uncertainty of its "
                    "expansion coefficient, too: give both",
                    inputs=("u_temperature", "u_expansion"),
                )
            found = [c for c in found if not c.thermal]
            found += thermal_components(
                expansion=self.expansion * 1e-6,
                deviation=self.temperature - REFERENCE_TEMPERATURE,
                u_expansion=self.u_expansion * 1e-6,
                u_temperature=self.u_temperature,
            )
        if checked is not None:
            found = [c for c in found if not c.source.casefold().startswith(SCALE_SOURCE)]
            found += checked.components()
        if self.abbe is not None:
            own = [c.source for c in found if {*re.findall(r"\w+", c.source.casefold())} & _ABBE]
            if own:
                raise PretravelError(
                    f"the budget already has the source '{own[0]}': the Abbé error would count "
                    "twice. Leave one out",
                    inputs=("abbe", "budget"),
                )
            found.append(abbe_component(self.abbe.first, self.abbe.second * 1e-6))
        return found

    def _read(self, paths: Sequence[Path]) -> tuple[tuple[RigTrace, ...], tuple[RigTouch, ...]]:
        """Traces, with the ruler at its reference temperature, and their events."""
        from pretravel.laboratory.rig.events import rig_touch
        from pretravel.laboratory.rig.marks import with_marks
        from pretravel.laboratory.rig.rig_csv import read_rig_trace
        from pretravel.laboratory.rig.stated_of_traces import with_comments
        from pretravel.laboratory.rig.trace import at_reference_temperature

        names = [path.stem for path in paths]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise PretravelError(f"trace {repeated[0]} is given twice; each file is one touch")
        marks: dict[str, dict[str, float]] = {}
        for mark in self.mark:
            marks.setdefault(mark.trace, {})[mark.event] = mark.position
        unknown = sorted(set(marks) - set(names))
        if unknown:
            raise PretravelError(
                f"there is no trace {unknown[0]} to mark; there are {', '.join(names[:8])}",
                inputs=("mark",),
            )
        try:
            read = [read_rig_trace(path) for path in paths]
        except InputError as error:
            raise PretravelError(f"{error}. Or leave this trace out", inputs=("exclude",)) from None
        traces = tuple(
            at_reference_temperature(trace, self.temperature, self.expansion * 1e-6)
            for trace in read
        )
        touches = [with_marks(rig_touch(trace), marks.get(trace.name, {})) for trace in traces]
        return traces, with_comments(read, _copies_noted(read, touches), self.temperature)


def _copies_noted(traces: Sequence[RigTrace], touches: Sequence[RigTouch]) -> tuple[RigTouch, ...]:
    """The touches; one whose readings are those of another trace says so."""
    first: dict[bytes, str] = {}
    found = []
    for trace, touch in zip(traces, touches, strict=True):
        same = first.setdefault(trace.ruler.tobytes() + trace.laser.tobytes(), trace.name)
        copy = (
            f"the readings are those of {same}, to the last digit: a copy counts as a touch of its "
            "own, and makes scatter and u too small. Leave it out"
        )
        found.append(touch if same == trace.name else replace(touch, notes=(*touch.notes, copy)))
    return tuple(found)


def _is_damaged(path: Path) -> bool:
    from pretravel.laboratory.rig.rig_csv import read_rig_trace

    try:
        read_rig_trace(path)
    except InputError:
        return True
    return False


def _forces(touches: Sequence[RigTouch], terms: RenTerms | None) -> list[float] | None:
    """Trigger force of each touch across the axis; nan where it does not follow. [N]"""
    from pretravel.laboratory.rig.calibration import angles_of

    if terms is None:
        return None
    found = terms.force([touch.pretravel for touch in touches], sensed="rod")
    polar = [angles_of(touch.trace)[1] for touch in touches]
    across = [math.isnan(angle) or abs(angle - 0.5 * math.pi) < 1e-3 for angle in polar]
    return [float(force) if used else math.nan for force, used in zip(found, across, strict=True)]


def _write_touches(
    path: Path,
    touches: Sequence[RigTouch],
    calibration: RigCalibration | None = None,
    forces: Sequence[float] | None = None,
) -> None:
    from pretravel.files import write_csv_table
    from pretravel.laboratory.rig.rig_csv import rig_table

    not_used = None if calibration is None else calibration.not_used or None
    write_csv_table(path, rig_table(touches, not_used, forces))


@dataclass(frozen=True, eq=False)
class CalibratedRig(Result):
    """A calibration with the traces that it comes from.

    Attributes
    ----------
    task : Rig
    traces : tuple of RigTrace
    touches : tuple of RigTouch
    calibration : RigCalibration
    components : tuple of LengthComponent
        Uncertainty budget of the rig.
    statements : LaboratoryStatements or None
    terms : RenTerms or None
        What determines a force from a pretravel.
    checked : ScaleCheck or None
        Of the ruler.
    doubts : tuple of str
        About the budget and its files.
    """

    task: Rig
    traces: tuple[RigTrace, ...]
    touches: tuple[RigTouch, ...]
    calibration: RigCalibration
    components: tuple[LengthComponent, ...]
    statements: LaboratoryStatements | None = None
    terms: RenTerms | None = None
    checked: ScaleCheck | None = None
    doubts: tuple[str, ...] = ()
    template = "certificate.html"
    """It prints on A4 (to PDF from any browser)."""

    @property
    def budget(self) -> Budget:
        """Of the mean pretravel. [mm]"""
        from pretravel.laboratory.rig.budget import calibration_budget, length_budget

        found = self.calibration
        return length_budget(calibration_budget(found, self.components), abs(found.pretravel))

    @property
    def forces(self) -> list[float] | None:
        """Trigger force of each touch; None without a description of the probe. [N]"""
        return _forces(self.touches, self.terms)

    @property
    def notes(self) -> list[str]:
        """Irregularities of the traces, and doubts about the budget."""
        from pretravel.laboratory.rig.budget import repeatability_doubts
        from pretravel.laboratory.rig.calibration import doubts_of_names
        from pretravel.laboratory.rig.scale import scale_doubts
        from pretravel.laboratory.rig.trace import doubts_of_ruler, notes_of_touches
        from pretravel.maps import doubts_between
        from pretravel.touches import coarse_warnings

        around = [d.azimuth for d in self.calibration.directions if d.across]
        task = self.task
        return [
            *doubts_of_names([touch.trace for touch in self.touches]),
            *doubts_of_ruler(task.temperature, task.expansion),
            *notes_of_touches(self.touches),
            *self.doubts,
            *(() if self.checked is None else scale_doubts(self.checked)),
            *repeatability_doubts(self.calibration, self.components),
            *coarse_warnings(self.calibration.step),
            *(() if self.task.map_file is None else doubts_between(around)),
        ]

    def document(self) -> Document:
        """The report, with what the laboratory states, and what it does not."""
        left_out = self.task.statement_warnings()
        return self.with_warnings([*self._lacking(), *left_out])

    def page(self) -> Document:
        """The calibration certificate, with what keeps it from being one to hand out."""
        from pretravel.laboratory.tasks.rig.report import rig_data

        data = rig_data(self.calibration, self.touches, self.budget, self.forces)
        return replace(self.certificate([*self._lacking()]), data=data)

    def with_warnings(self, warnings: Sequence[str] = ()) -> Document:
        """The report with warnings of the caller."""
        from pretravel.laboratory.tasks.rig.report import rig_document, with_scale_check
        from pretravel.maps import TIP_AS_STATED
        from pretravel.task import with_laboratory

        stated = [*self.notes, *warnings]
        report = rig_document(
            self.calibration, self.budget, self.traces, warnings=stated, forces=self.forces
        )
        report = with_scale_check(report, self.checked)
        if self.task.map_file is not None:
            report = replace(report, notes=(*report.notes, TIP_AS_STATED))
        return with_laboratory(report, self.statements)

    def certificate(self, warnings: Sequence[str] = ()) -> Document:
        """The calibration certificate with warnings of the caller."""
        from pretravel.files import LaboratoryStatements
        from pretravel.laboratory.certificate import calibration_certificate
        from pretravel.laboratory.tasks.rig.certificate_report import certificate_document
        from pretravel.laboratory.tasks.rig.report import with_scale_check

        budget = self.task.budget
        made = calibration_certificate(
            self.calibration,
            self.components,
            self.statements or LaboratoryStatements(),
            budget_source=_REN_SOURCE if budget is None else budget.name,
            temperature=self.task.temperature,
        )
        found = certificate_document(made, self.traces, warnings=[*self.notes, *warnings])
        return with_scale_check(found, self.checked)

    def write(self, output: str, path: Path) -> None:
        """Write the map, or the touches."""
        from pretravel.files import write_map
        from pretravel.laboratory.rig.map import rig_map

        if output == "map_file":
            tip_radius = 0.5 * (self.task.tip_diameter or 0.0)
            write_map(path, rig_map(self.calibration, self.components, tip_radius))
        else:
            _write_touches(path, self.touches, self.calibration, self.forces)

    def _lacking(self) -> Iterator[str]:
        """Statements that the laboratory did not make, as warnings."""
        from pretravel.files import LaboratoryStatements

        task = self.task
        if task.budget is None:
            yield FOREIGN_BUDGET
        if task.output is None or not by_name(Rig)["output"].is_report(task.output):
            return
        if fields := (self.statements or LaboratoryStatements()).missing:
            yield (
                f"{fields} fields of the certificate are empty; fill them in with --lab "
                "(pretravel laboratory > lab.toml)"
                if task.lab is None
                else f"{fields} fields of {task.lab.name} are empty"
            )
