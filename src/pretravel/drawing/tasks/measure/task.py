"""Measure features: compensated points to sizes, forms and conformity, and their report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

from pretravel.base import TIP_BALL, PretravelError
from pretravel.drawing.tasks.measure.settings_of_features import (
    BY_LABEL,
    Criterion,
    FormCriterion,
)
from pretravel.drawing.tolerances.tolerance_text import ToleranceText
from pretravel.task import (
    ANSWER,
    PAGES,
    SILENT,
    Field,
    LaboratoryReport,
    Progress,
    Result,
    Series,
    StatedUnits,
    UnitVector,
    Vector,
    output,
)

if TYPE_CHECKING:
    from pretravel.drawing.features.between_features import FeatureRelation
    from pretravel.drawing.tasks.measure.lines import ToleranceLine
    from pretravel.drawing.tolerances.features_file import Drawing
    from pretravel.drawing.tolerances.tolerances import (
        FeatureTolerances,
        InspectedFeature,
        OpenTolerance,
        Together,
    )
    from pretravel.measurement import Points
    from pretravel.show import Document, Picture, Table, View, WorkRecord
    from pretravel.surface import Part


def _features() -> list[str]:
    from pretravel.measurement import ASSOCIATIONS

    return [*ASSOCIATIONS, BY_LABEL]


class Measure(LaboratoryReport):
    """Measure features from compensated points: form, size, position, distances, conformity.

    Exit code 3: a feature does not conform to its tolerances, or this cannot be decided.
    Without --u-machine only the errors of probing are counted: exit code 0 is then no statement of
    conformity.
    """

    name = "measure"
    example = (
        'pretravel measure points.csv --feature bore --select "bore1*" --tolerance 20..20.021 '
        "-o bore.html"
    )

    points: Annotated[
        Path,
        Field(
            help="Points from compensate (.csv, .parquet, .json or .nc), or a table of coordinates "
            "of points that other software compensated.",
            positional=True,
            reads=True,
        ),
    ]
    feature: Annotated[
        str | None,
        Field(
            help="Kind of feature, such as bore or plane; or by-label: each label names its kind "
            "(bore1-1 is of a bore). All kinds: circle, bore, boss, sphere, plane, line, "
            "cylinder, cone, torus, slot. A bore or boss at several heights is a cylinder.",
            words={BY_LABEL: "what the labels say (bore1-1, plane2-1)"},
            names=_features,
            metavar="FEATURE",
            without=("drawing",),
        ),
    ] = None
    association: Annotated[
        Criterion,
        Field(
            help="How a feature is fitted. gaussian: least squares. minimum-zone: smallest range. "
            "inscribed: largest feature with no point inside. circumscribed: smallest feature with "
            "no point outside. tangent: outside the material.",
            words={
                "gaussian": "least squares (Gaussian)",
                "minimum-zone": "minimum zone",
                "inscribed": "maximum inscribed",
                "circumscribed": "minimum circumscribed",
                "tangent": "tangent, outside the material",
            },
        ),
    ] = "gaussian"
    drawing: Annotated[
        Path | None,
        Field(
            help="All features of a drawing with their tolerances: .toml, as pretravel drawing "
            "writes it, or a plan, .qif or .dmi. In the .toml a table [[feature]] for each, with "
            "kind, faces or select, label, association, axis, at_mm, tolerance, nominal_mm, "
            "position_tolerance_mm, form_tolerance_mm, form_association; [[feature.geometric]] "
            "with kind, tolerance_mm, datums, material; [[pattern]]; [[between]].",
            label="Drawing",
            reads=True,
            states="the file gives it for each feature",
        ),
    ] = None
    part: Annotated[
        Path | None,
        Field(
            help="The part (.step or .iges), in whose frame the points are: its faces give the "
            "nominal surface of a profile, and nominal positions that the drawing does not give.",
            label="Part",
            reads=True,
            only=("drawing",),
        ),
    ] = None
    select: Annotated[
        tuple[str, ...],
        Field(
            help="Points of one feature, by label with wildcards * and ?, "
            '"bore1*", or by number, 10..21. Each --select is one feature; with --group, several.',
            metavar="LABELS",
            label="Points by label",
            hint="bore1* bore2*: each is one feature; empty: all points",
            without=("drawing",),
        ),
    ] = ()
    by_prefix: Annotated[
        bool,
        Field(
            help="Make a feature of each group of labels that differ in the last number only "
            "(bore1-1, bore1-2 … are bore1).",
            option="--group",
            label="One feature for each group of labels",
            without=("drawing",),
        ),
    ] = False
    axis: Annotated[
        UnitVector | None,
        Field(
            help="Axis of a circle, bore or boss; the default is the normal of the plane of the "
            "points. Of a cylinder or cone: where the search starts.",
            hint="0,0,1; empty: across the plane of the points",
            metavar="X,Y,Z",
            without=("drawing",),
        ),
    ] = None
    at: Annotated[
        Vector | None,
        Field(
            help="Nominal position, in mm. Axes, planes and the diameter of a cone are evaluated "
            "at their point nearest to it.",
            metavar="X,Y,Z",
            label="Nominal position",
            hint="10,20,0 in mm",
            without=("drawing",),
        ),
    ] = None
    size_tolerance: Annotated[
        ToleranceText | None,
        Field(
            help="Limits of the diameter, in mm (20.000..20.021, 20.., ..20.021 or 20H7; with "
            "--nominal also +0.021/0 or ±0.01).",
            option="--tolerance",
            metavar="LIMITS",
            label="Tolerance of the diameter",
            hint="20.000..20.021, 20.., ..20.021 or 20H7",
            without=("drawing",),
        ),
    ] = None
    nominal: Annotated[
        float | None,
        Field(
            help="Nominal diameter, in mm, for limits such as +0.021/0.",
            range=(0.0, 1e5),
            unit="mm",
            label="Nominal diameter",
            without=("drawing",),
        ),
    ] = None
    position_tolerance: Annotated[
        float | None,
        Field(
            help="Diameter of the zone around the nominal position, in mm; of a plane or line its "
            "width.",
            range=(1e-6, 1e3),
            unit="mm",
            label="Tolerance of the position",
            without=("drawing",),
        ),
    ] = None
    form_tolerance: Annotated[
        float | None,
        Field(
            help="Form tolerance (roundness, flatness, straightness, cylindricity), in mm.",
            range=(1e-6, 1e3),
            unit="mm",
            label="Tolerance of the form",
            without=("drawing",),
        ),
    ] = None
    form_association: Annotated[
        FormCriterion,
        Field(
            help="Association that decides a form tolerance: minimum-zone (ISO 1101), or "
            "gaussian, least squares.",
            words={"minimum-zone": "minimum zone (ISO 1101)", "gaussian": "least squares"},
            label="Association that decides the form",
        ),
    ] = "minimum-zone"
    probability: Annotated[
        float,
        Field(
            help="Probability required to accept or to reject (ISO 14253-1).",
            range=(0.5, 0.9999),
            label="Probability required for a decision",
        ),
    ] = 0.95
    units: StatedUnits = None
    series: Series = ()
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the tip, in mm, where the table contains tip centres, not surface "
            "points, of a bore, boss or sphere.",
            range=TIP_BALL,
            label="Diameter of the tip, for tip centres",
        ),
    ] = None
    u_machine_um: Annotated[
        float,
        Field(
            help="Standard uncertainty of a length due to the machine's geometry, temperature and "
            "clamping, in µm. It also raises the 'at most' values of form and position.",
            range=(0.0, 1e4),
            label="u of the machine",
            hint="Geometry, temperature and clamping, for one length",
        ),
    ] = 0.0
    output: Annotated[
        Path | None,
        output(
            "Quantities: .csv, .parquet; for statistics programs .dfq (Q-DAS), .qif (QIF 3); the "
            "report: .json, or a page, .html or .pdf.",
            ".csv",
            ".parquet",
            ".dfq",
            ".qif",
            report=True,
        ),
    ] = None

    trials: Annotated[
        int | None,
        Field(
            help="Number of Monte Carlo trials, in addition to the analytic U. Each trial draws "
            "new errors of the points (by direction, of machine and probe, where compensate had "
            "them), and fits again.",
            range=(100, 1_000_000),
            label="Monte Carlo trials, in addition to U",
            hint="Empty: none; 2000 takes seconds",
        ),
    ] = None
    annex: Annotated[
        bool,
        Field(
            help="Append all quantities, budgets, settings and hashes to a .pdf, which otherwise "
            "has one or two pages.",
            label="All quantities, budgets and settings on the PDF",
        ),
    ] = False
    residuals: Annotated[
        Path | None,
        Field(
            help="Distance of each point from its feature: .csv or .parquet.",
            writes=(".csv", ".parquet"),
        ),
    ] = None

    def run(self, progress: Progress = SILENT) -> MeasuredFeatures:
        """Read the points and measure their features."""
        from pretravel.drawing.tasks.measure.features_of_points import not_in_u, other_maps
        from pretravel.files import ReadingOptions, points_and_notes

        if self.feature is None and self.drawing is None:
            raise PretravelError(
                "give the kind of feature, or the file with all features of the drawing",
                inputs=("feature", "drawing"),
            )
        if self.annex and (self.output is None or self.output.suffix.lower() != ".pdf"):
            raise PretravelError(
                "only a PDF has an annex; a page already contains everything: write the report "
                "as .pdf, or leave the annex out",
                inputs=("annex",),
            )
        part = None
        if self.part is not None:
            from pretravel.surface import read_part

            part = read_part(self.part)
        wanted = self.wanted(part)  # what is wrong there is said before the points are read
        radius = None if self.tip_diameter is None else 0.5 * self.tip_diameter
        options = ReadingOptions(units=self.units, series=self.series, tip_radius=radius)
        points, notes = points_and_notes(self.points, options)
        if self.tip_diameter is not None and points.state_uncertainty:
            raise PretravelError(
                f"{self.points}: the points are compensated, so the tip's radius is already "
                "subtracted: leave the tip's diameter out",
                inputs=("tip_diameter",),
            )
        notes += (*other_maps(points, self.points), *not_in_u(points))
        with progress.working(f"measuring the features of {len(points)} points"):
            found = self.measured(points, wanted, part)
        return replace(found, left_out=(*notes, *found.left_out))

    def wanted(self, part: Part | None = None) -> Wanted:
        """What is to be measured: the drawing is read, and its tolerances are checked."""
        drawing, left_out = self.read_drawing()
        return self.wanted_of(drawing, left_out, part)

    def wanted_of(
        self, drawing: Drawing | None, left_out: tuple[str, ...] = (), part: Part | None = None
    ) -> Wanted:
        """What is to be measured of a drawing."""
        if drawing is not None:
            from pretravel.drawing.tolerances.drawing_on_part import drawing_on_part

            try:
                drawing = drawing_on_part(drawing, part)
            except PretravelError as error:
                raise PretravelError(f"{self.drawing}: {error}", inputs=error.inputs) from None
        return Wanted(drawing, left_out, self._tasks_of(drawing))

    def _tasks_of(self, drawing: Drawing | None) -> dict[str, Measure]:
        """A task for each feature of the drawing by its name, or this one alone.

        Raises
        ------
        PretravelError
            Tolerances that contradict each other, with the name of the feature.
        """
        from pretravel.drawing.features.measured_feature import BARE_SURFACE
        from pretravel.drawing.tolerances.tolerances import refuse_other_nominal

        if drawing is None:
            self._refuse_other_sizes()
            self._refuse_nothing_to_decide()
            return {"": self}
        tasks = {}
        for row in drawing.feature:
            name = row.name
            try:
                limits = None if row.tolerance is None else ToleranceText.parse(row.tolerance)
                from_nominal = limits is not None and not limits.are_limits
                if limits is not None:
                    limits.refuse_other_side(row.kind)
                if limits is not None and limits.are_limits:
                    refuse_other_nominal(row.nominal, self.limits_of(str(row.tolerance), None))
                tasks[name] = replace(
                    self,
                    feature=None if row.kind == BARE_SURFACE else row.kind,
                    drawing=None,
                    part=None,
                    select=(row.select,) if row.select else (),
                    association=cast("Criterion", row.association or self.association),
                    axis=None if row.axis is None else UnitVector.parse(_typed(row.axis)),
                    at=None if row.at is None else Vector.parse(_typed(row.at)),
                    size_tolerance=limits,
                    nominal=row.nominal if from_nominal else None,
                    position_tolerance=row.position_tolerance,
                    form_tolerance=row.form_tolerance,
                    form_association=cast(
                        "FormCriterion", row.form_association or self.form_association
                    ),
                )
                tasks[name]._refuse_other_sizes()
            except PretravelError as error:
                raise PretravelError(f"{self.drawing}: {name}: {error}") from None
        return tasks

    def read_drawing(self) -> tuple[Drawing | None, tuple[str, ...]]:
        """What the file of features states, None without one; and what of a plan was left out."""
        if self.drawing is None:
            return None, ()
        from pretravel.drawing.pmi.model import read_drawing
        from pretravel.drawing.tolerances.plan_features import PLAN_ENDINGS, read_plan_features

        if self.drawing.suffix.lower() in PLAN_ENDINGS:
            return read_plan_features(self.drawing)
        return read_drawing(self.drawing), ()

    def tolerances(self) -> FeatureTolerances:
        """The tolerances of each feature.

        Raises
        ------
        PretravelError
            Deviations without a nominal diameter, or the contrary.
        """
        from pretravel.drawing.tolerances.tolerances import FeatureTolerances

        return FeatureTolerances(
            self._limits(),
            self.position_tolerance,
            self.form_tolerance,
            self.probability,
            self.form_association,
        )

    def _refuse_nothing_to_decide(self) -> None:
        """Refuse what decides about tolerances where none is given."""
        form, others = self.form_tolerance, (self.size_tolerance, self.position_tolerance)
        for name, decided in (("form_association", (form,)), ("probability", (form, *others))):
            if self.stated(name) and all(each is None for each in decided):
                raise PretravelError(
                    f"{name.replace('_', ' ')} decides about a tolerance, and none is given",
                    inputs=(name, "form_tolerance"),
                )

    def _refuse_other_sizes(self) -> None:
        """Refuse tolerances that contradict each other, or deviations that are those in µm."""
        from pretravel.drawing.tolerances.tolerances import refuse_wide_deviations

        self.tolerances()
        if self.size_tolerance is not None:
            self.size_tolerance.refuse_other_side(self.feature)
            if not self.size_tolerance.are_limits:
                refuse_wide_deviations(self.nominal, *self.size_tolerance[:2])

    def limits_of(self, text: str, nominal: float | None) -> tuple[float, float]:
        """The limits that a tolerance of a drawing states, with its nominal value.

        Raises
        ------
        PretravelError
            Deviations without a nominal value, or the contrary.
        """
        stated = ToleranceText.parse(text)
        limits = replace(
            self, drawing=None, part=None, size_tolerance=stated,
            nominal=None if stated.are_limits else nominal,
        ).tolerances().size  # fmt: skip
        assert limits is not None
        return limits

    def _limits(self) -> tuple[float, float] | None:
        """The limits of a diameter, in mm."""
        size, nominal = self.size_tolerance, self.nominal
        inputs = ("nominal", "tolerance")
        if size is None:
            if nominal is not None:
                raise PretravelError(
                    "the nominal diameter needs the deviations from it, for example +0.021/0",
                    inputs=inputs,
                )
            return None
        if size.are_limits:
            if nominal is not None:
                raise PretravelError(
                    "the tolerance has limits already; leave out the nominal diameter",
                    inputs=inputs,
                )
            return (-math.inf if size.low is None else size.low,
                    math.inf if size.high is None else size.high)  # fmt: skip
        if nominal is None:
            raise PretravelError(
                "deviations need the nominal diameter, for example 20", inputs=inputs
            )
        assert size.low is not None
        assert size.high is not None
        return nominal + size.low, nominal + size.high

    def measured(
        self, points: Points, wanted: Wanted | None = None, part: Part | None = None
    ) -> MeasuredFeatures:
        """Measure the features of points that have been read.

        Parameters
        ----------
        points : Points
        wanted : Wanted, optional
            Of this task, where it was read before.
        part : Part, optional
            Whose faces are the nominal places that a drawing leaves out.

        Raises
        ------
        PretravelError
            A feature that its points do not determine, with its label; a nominal position for
            several features.
        """
        from pretravel.drawing.tasks.measure.features_of_points import (
            inspected,
            kinds_of,
            nominals_of,
            refuse_one_place_for_many,
            with_names_of_features,
        )
        from pretravel.drawing.tasks.measure.missed import several_features, without_missed
        from pretravel.drawing.tolerances.compared_with_drawing import far_from_place
        from pretravel.measurement import nearly_chosen, points_of_features

        wanted = wanted or self.wanted(part)
        if wanted.drawing is not None:
            return self._measured_drawing(points, wanted, part)
        found: list[InspectedFeature] = []
        nominals: dict[tuple[str, str], float] = {}
        left_out: list[str] = []
        misses: list[str] = []
        for task in wanted.tasks.values():
            by_label = task.feature == BY_LABEL
            chosen = points_of_features(points, task.select, by_prefix=task.by_prefix or by_label)
            if by_label:
                chosen, left_out = with_names_of_features(chosen)
            refuse_one_place_for_many(task, list(chosen))
            of_task = []
            misses += several_features(chosen[""]) if "" in chosen else []
            misses += nearly_chosen(points.labels, task.select)
            for label, mine in chosen.items():
                kept, said = without_missed(mine, kinds_of(label, task), task.axis)
                of_task.append(inspected(label, kept, task))
                misses += [*said, *far_from_place(of_task[-1].feature, task.at)]
            nominals |= nominals_of(of_task, task)
            found += of_task
        result = replace(_result(self, tuple(found), ()), left_out=(*left_out, *misses))
        return replace(result, nominals=nominals)

    def _measured_drawing(
        self, points: Points, wanted: Wanted, part: Part | None
    ) -> MeasuredFeatures:
        """The features of a drawing; those whose faces were not touched are named."""
        from pretravel.drawing.tasks.measure.drawn_features import DrawnFeatures
        from pretravel.drawing.tasks.measure.features_of_points import (
            inspected,
            kinds_of,
            nominals_of,
            of_no_feature,
            off_the_drawing,
            points_at_targets,
        )
        from pretravel.drawing.tasks.measure.missed import without_missed
        from pretravel.drawing.tolerances.compared_with_drawing import far_from_nominal
        from pretravel.drawing.tolerances.drawing_on_part import differences_from_part, faces_words
        from pretravel.measurement import points_of_features, points_on_faces

        drawing = wanted.drawing
        assert drawing is not None
        drawn = DrawnFeatures(self, drawing, wanted.tasks, {}, {}, part)
        nominals: dict[tuple[str, str], float] = {}
        said: list[str] = []
        used: list[Points] = []
        for row in drawing.feature:
            task = wanted.tasks[row.name]
            if row.faces:
                mine = points_on_faces(points, row.faces)
            else:
                (mine,) = points_of_features(points, task.select).values()
            used.append(mine)
            if not len(mine):
                drawn.reasons[row.name] = f"no touch is on {faces_words(row.faces)}"
                continue
            far: list[str] = []
            try:
                if row.targets or row.target_lines:
                    mine = points_at_targets(mine, row)
                kept, far = without_missed(mine, kinds_of(row.name, task), task.axis)
                drawn.found[row.name] = inspected(row.name, kept, task)
            except PretravelError as error:
                if not row.faces:
                    raise _with_far_points(error, far) from None
                drawn.reasons[row.name] = str(error).removeprefix(f"{row.name}: ")
                continue
            said += far
            nominals |= nominals_of([drawn.found[row.name]], task, row.nominal)
            said += far_from_nominal(drawn.found[row.name].feature, row)
        features, together = drawn.decide()
        said += off_the_drawing(drawn.found, wanted.tasks)
        nominals |= {
            (", ".join(row.features), row.quantity): row.nominal
            for row in drawing.between if row.nominal is not None
        }  # fmt: skip
        said += of_no_feature(points, used)
        if part is not None:
            said += differences_from_part(drawing, part, points)
        said += [
            f"{row.name} is not measured: {drawn.reasons[row.name]}"
            for row in drawing.feature if row.name in drawn.reasons and not row.has_tolerances
        ]  # fmt: skip
        result = _result(self, features, together, tuple(drawn.open))
        left_out = (*wanted.left_out, *said)
        return replace(result, left_out=left_out, nominals=nominals, part=part)


def _typed(numbers: tuple[float, float, float]) -> str:
    return ",".join(map(repr, numbers))


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a task is to measure.

    Attributes
    ----------
    drawing : Drawing or None
    left_out : tuple of str
        What of a plan is not measured, and why.
    tasks : mapping of str to Measure
        One for each feature of the drawing; without a drawing the task itself.
    """

    drawing: Drawing | None
    left_out: tuple[str, ...]
    tasks: Mapping[str, Measure]


@dataclass(frozen=True, eq=False)
class MeasuredFeatures(Result):
    """The features of points, with what was wanted.

    Attributes
    ----------
    task : Measure
    features : tuple of InspectedFeature
    relations : tuple of FeatureRelation
        Distances and angles between the features.
    together : tuple of Together
        Decisions about several features.
    exit_code : int
        `ANSWER` where a feature does not conform to its tolerances, or this cannot be decided.
    left_out : tuple of str
        What of a plan is not measured, and why.
    nominals : mapping of (feature, quantity) to float
        Nominal values that were stated. [mm or degrees]
    open : tuple of OpenTolerance
        Tolerances of the drawing whose features were not measured.
    part : Part or None
    """

    task: Measure
    features: tuple[InspectedFeature, ...]
    relations: tuple[FeatureRelation, ...] = ()
    together: tuple[Together, ...] = ()
    exit_code: int = 0
    left_out: tuple[str, ...] = ()
    nominals: Mapping[tuple[str, str], float] = field(default_factory=dict)
    open: tuple[OpenTolerance, ...] = ()
    part: Part | None = None

    @property
    def lines(self) -> list[ToleranceLine]:
        """One for each tolerance: what fails, what cannot be decided, the others."""
        from pretravel.drawing.tasks.measure.lines import tolerance_lines

        return tolerance_lines(self.features, self.together, self.open)

    def __getitem__(self, label: str) -> InspectedFeature:
        """A feature by its label.

        Raises
        ------
        PretravelError
            No feature is called so.
        """
        for each in self.features:
            if each.feature.label == label:
                return each
        known = ", ".join(each.feature.label for each in self.features)
        raise PretravelError(f"no feature is called '{label}'; there are {known}")

    def document(self) -> Document:
        """The report, with what the laboratory states."""
        from pretravel.drawing.tasks.measure.report import features_document
        from pretravel.task import with_laboratory

        task = self.task
        warnings = []
        if any(each.conformities for each in self.features) and not task.u_machine_um:
            warnings.append(
                "u contains only the errors of probing. For a statement of conformity, give the u "
                "of the machine as well (geometry, temperature, clamping)"
            )
        if self.features and not any(
            each.feature.points.state_uncertainty for each in self.features
        ):
            warnings.append(_taken_for(task.tip_diameter))
        warnings += [*self.left_out, *task.statement_warnings()]
        statements = task.statements()
        report = features_document(
            self.features,
            self.relations,
            self.together,
            left_open=self.open,
            points_name=task.points.name,
            statements=statements,
            warnings=warnings,
        )
        pictures = (*self._part_picture(), *report.pictures)
        report = replace(report, pictures=pictures)
        if task.drawing is not None and self.part is not None:
            report = replace(report, title=f"{self.part.name}: tolerances, from {task.points.name}")
        report = replace(report, tables=(*report.tables, *self._by_trials()))
        return with_laboratory(report, statements)

    def _part_picture(self) -> tuple[Picture, ...]:
        """The part with its verdicts, where it and the faces of the points are known."""
        from pretravel.show import Picture

        part, lines = self.part, self.lines
        if part is None or all(each.feature.points.face is None for each in self.features):
            return ()

        def drawn() -> View:
            from pretravel.drawing.tasks.measure.picture import verdicts_view

            return verdicts_view(part, self.features, lines)

        return (Picture("Deviations of the touched faces, and the verdicts", drawn),)

    def _by_trials(self) -> tuple[Table, ...]:
        """The quantities by Monte Carlo, where that is wanted."""
        from pretravel.drawing.features.feature_trials import feature_by_trials
        from pretravel.drawing.tasks.measure.tables_of_features import trials_table

        if self.task.trials is None:
            return ()
        found = {
            each.feature.label or each.feature.kind: feature_by_trials(
                each.feature, self.task.trials
            )
            for each in self.features
        }
        return (trials_table(found, self.task.trials),)

    def in_brief(self, report: Document) -> Document:
        """Sizes and forms with their verdicts."""
        from pretravel.drawing.tasks.measure.report import features_summary
        from pretravel.drawing.tasks.measure.tables_of_features import TRIALS

        page = self.task.output is not None and self.task.output.suffix in PAGES
        more = {"more_in": "the page or --verbose"} if page else {}
        brief = features_summary(report, self.features, self.relations, **more)
        by_trials = [table for table in report.tables if table.title == TRIALS]
        return replace(brief, tables=(*brief.tables, *by_trials))

    def write_report(self, path: Path, record: WorkRecord | None = None) -> None:
        """Write the report; a PDF has one or two pages where nothing more is asked for."""
        task = self.task
        whole = task.annex or task.lab is not None or not self.lines
        if path.suffix.lower() != ".pdf" or whole:
            super().write_report(path, record)
            return
        from pretravel.drawing.tasks.measure.report import short_report
        from pretravel.show import write_report

        write_report(path, short_report(self.document()), template=self.template)

    def write(self, output: str, path: Path) -> None:
        """Write the features, quantities as columns or for statistics; or the residuals."""
        from pretravel.drawing.features.feature_results import (
            features_table,
            residuals_table,
            result_rows,
        )
        from pretravel.drawing.features.qdas_results import write_qdas_results
        from pretravel.drawing.features.qif_results import write_qif_results
        from pretravel.files import write_table

        if not self.features:
            reasons = {each.reason: None for each in self.open}
            raise PretravelError(
                f"no feature was measured, so {path.name} would be empty: {'; '.join(reasons)}"
            )
        ending = path.suffix.lower()
        if output == "residuals":
            write_table(path, residuals_table([each.feature for each in self.features]))
        elif ending in (".dfq", ".qif"):
            rows = result_rows(self.features, self.relations, self.together)
            write = write_qdas_results if ending == ".dfq" else write_qif_results
            write(path, rows, part=self.task.points.stem, nominals=self.nominals)
        else:
            write_table(path, features_table(self.features, self.relations, self.together))


def _result(
    task: Measure,
    features: tuple[InspectedFeature, ...],
    together: tuple[Together, ...],
    left_open: tuple[OpenTolerance, ...] = (),
) -> MeasuredFeatures:
    from pretravel.drawing.features.between_features import relations_between
    from pretravel.drawing.features.conformity import ConformityVerdict

    relations = relations_between([each.feature for each in features])
    # A script must not take "cannot be decided" for "conforms".
    proven = (None, ConformityVerdict.CONFORMS)
    verdicts = [each.verdict for each in features]
    verdicts += [each.conformity.verdict for each in together]
    all_proven = all(verdict in proven for verdict in verdicts) and not left_open
    return MeasuredFeatures(
        task, features, relations, together, 0 if all_proven else ANSWER, open=left_open
    )


def _with_far_points(error: PretravelError, far: Sequence[str]) -> PretravelError:
    """The fault of a fit, with the points that are far from the feature of the others."""
    return PretravelError(f"{error} ({far[0]})", inputs=error.inputs) if far else error


def _taken_for(tip_diameter: float | None) -> str:
    """What points of another origin were taken for."""
    if tip_diameter is None:
        return (
            "the points were taken as points of the surface, and nothing was subtracted: if they "
            "are tip centres, give the tip's diameter"
        )
    return (
        f"the points were taken as tip centres: the radius of the tip, {0.5 * tip_diameter:g} mm, "
        "was subtracted, and no pretravel"
    )
