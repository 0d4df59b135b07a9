"""Measure features: compensated points to sizes, forms and conformity, and their report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias, cast

from pretravel.base import MICROMETRE, ConvergenceError, PretravelError
from pretravel.task import (
    ANSWER,
    PAGES,
    SILENT,
    Field,
    LaboratoryReport,
    Progress,
    Result,
    StatedUnits,
    ToleranceText,
    Vector,
    output,
    tolerance,
    unit_vector,
    vector,
)

if TYPE_CHECKING:
    from pretravel.drawing.features.between_features import FeatureRelation
    from pretravel.drawing.features.measured_feature import MeasuredFeature
    from pretravel.drawing.tolerances.features_file import Drawing
    from pretravel.drawing.tolerances.tolerance_frame import PlacedFeature
    from pretravel.drawing.tolerances.tolerances import (
        FeatureTolerances,
        InspectedFeature,
        Together,
    )
    from pretravel.measurement import Points
    from pretravel.show import Document
    from pretravel.surface import Part


BY_LABEL = "by-label"
"""Instead of a feature: that which the label of the points begins with, as in bore1-1, plane2-1."""


def _features() -> list[str]:
    from pretravel.measurement import ASSOCIATIONS

    return [*ASSOCIATIONS, BY_LABEL]


Criterion: TypeAlias = Literal["gaussian", "minimum-zone", "inscribed", "circumscribed", "tangent"]


class Measure(LaboratoryReport):
    """Measure features from compensated points: form, size, position, distances, conformity.

    Exit code 3: a feature does not conform to its tolerances, or this cannot be decided.
    """

    name = "measure"
    group = "Measure"
    example = (
        'pretravel measure points.csv --feature bore --select "bore1*" --tolerance 20..20.021 '
        "-o bore.html"
    )

    points: Annotated[
        Path,
        Field(
            help="Points from compensate: .csv, .parquet, .json or .nc; or a table of coordinates "
            "alone, of points that something else compensated.",
            positional=True,
            reads=True,
        ),
    ]
    feature: Annotated[
        str | None,
        Field(
            help="circle, bore, boss, sphere, plane, line, cylinder, cone, torus or slot; or "
            "by-label: each group of labels is the feature with which they begin, as bore1-1 (a "
            "bore or boss at several heights: a cylinder).",
            words={BY_LABEL: "what the labels say (bore1-1, plane2-1)"},
            names=_features,
            metavar="FEATURE",
        ),
    ] = None
    association: Annotated[
        Criterion,
        Field(
            help="gaussian: least squares. minimum-zone: smallest range of the distances. "
            "inscribed, circumscribed: largest feature with no point inside, smallest with none "
            "outside. tangent: outside the material.",
            words={
                "gaussian": "least squares (Gaussian)",
                "minimum-zone": "minimum zone",
                "inscribed": "maximum inscribed",
                "circumscribed": "minimum circumscribed",
                "tangent": "tangent, outside the material",
            },
        ),
    ] = "gaussian"
    features: Annotated[
        Path | None,
        Field(
            help="Instead of --feature: all features of a drawing with their tolerances: .toml, or "
            "a plan, .qif or .dmi. In the .toml a table [[feature]] for each, with kind, select, "
            "label, association, axis, at_mm, tolerance, nominal_mm, position_tolerance_mm, "
            "form_tolerance_mm; [[feature.geometric]] with kind, tolerance_mm, datums, material; "
            "[[pattern]]; [[between]].",
            label="Features of a drawing",
            reads=True,
        ),
    ] = None
    part: Annotated[
        Path | None,
        Field(
            help="The part, .step or .iges, in whose frame the points are: its faces are the "
            "nominal surface of a profile, and nominal places that the drawing's file leaves out.",
            label="Part",
            reads=True,
        ),
    ] = None
    select: Annotated[
        tuple[str, ...],
        Field(
            help='Points by label, with * and ?: "bore1*"; or by number: 10..21. Each --select is '
            "one feature.",
            metavar="LABELS",
            label="Points by label",
            hint="bore1* bore2*: each is one; empty: all points",
        ),
    ] = ()
    by_prefix: Annotated[
        bool,
        Field(
            help="One feature for each name before a number: bore1-1, …",
            option="--group",
            label="One feature for each name before a number",
        ),
    ] = False
    axis: Annotated[
        Vector | None,
        Field(
            help="Axis of a circle, bore or boss; without it, across the plane of the points. Of a "
            "cylinder or cone: where the search starts.",
            hint="0,0,1; empty: across the plane of the points",
            parse=unit_vector,
            metavar="X,Y,Z",
        ),
    ] = None
    at: Annotated[
        Vector | None,
        Field(
            help="Nominal position, in mm. Axes, planes and the diameter of a cone are evaluated "
            "at their point nearest to it.",
            parse=vector,
            metavar="X,Y,Z",
            label="Nominal position",
            hint="10,20,0 in mm",
        ),
    ] = None
    size_tolerance: Annotated[
        ToleranceText | None,
        Field(
            help="Of the diameter, in mm: 20.000..20.021, 20.. or ..20.021; or with --nominal "
            "+0.021/0, ±0.01.",
            parse=tolerance,
            option="--tolerance",
            metavar="LIMITS",
            label="Tolerance of the diameter",
            hint="20.000..20.021, 20.. or ..20.021",
        ),
    ] = None
    nominal: Annotated[
        float | None,
        Field(
            help="Nominal diameter, in mm.", range=(0.0, 1e5), unit="mm", label="Nominal diameter"
        ),
    ] = None
    position_tolerance: Annotated[
        float | None,
        Field(
            help="Diameter of the zone around the nominal position (plane, line: width), in mm.",
            range=(1e-6, 1e3),
            unit="mm",
            label="Tolerance of the position",
        ),
    ] = None
    form_tolerance: Annotated[
        float | None,
        Field(
            help="Roundness, flatness, straightness, cylindricity, form, in mm.",
            range=(1e-6, 1e3),
            unit="mm",
            label="Tolerance of the form",
        ),
    ] = None
    probability: Annotated[
        float,
        Field(
            help="At which a decision is proven (ISO 14253-1).",
            range=(0.5, 0.9999),
            label="Probability at which a decision is proven",
        ),
    ] = 0.95
    units: StatedUnits = None
    u_machine_um: Annotated[
        float,
        Field(
            help="Standard uncertainty of a length by the machine's geometry, temperature and "
            "clamping, in µm.",
            range=(0.0, 1e4),
            label="u of the machine",
            hint="Geometry, temperature and clamping, for one length",
        ),
    ] = 0.0
    output: Annotated[
        Path | None,
        output(
            "Quantities: .csv, .parquet; the report: .json, or a page, .html or .pdf.",
            ".csv",
            ".parquet",
            ".json",
            *PAGES,
            report_json=True,
        ),
    ] = None

    residuals: Annotated[
        Path | None,
        Field(
            help="Distance of each point from its feature: .csv or .parquet.",
            writes=(".csv", ".parquet"),
        ),
    ] = None

    def run(self, progress: Progress = SILENT) -> MeasuredFeatures:
        """Read the points and measure their features."""
        from pretravel.files import read_points

        if (self.feature is None) == (self.features is None):
            raise PretravelError(
                "state the feature of the points, or the file with all features of the drawing",
                inputs=("feature", "features"),
            )
        if self.part is not None and self.features is None:
            raise PretravelError(
                "the part serves the tolerances of a file of features; state this file",
                inputs=("features", "part"),
            )
        wanted = self.wanted()  # what is wrong there is said before the points are read
        points = read_points(self.points, units=self.units)
        with progress.working(f"measuring the features of {len(points)} points"):
            return self.measured(points, wanted)

    def wanted(self) -> Wanted:
        """What is to be measured: the drawing is read, and its tolerances are checked."""
        drawing, left_out = self.drawing()
        return Wanted(drawing, left_out, self._tasks_of(drawing))

    def _tasks_of(self, drawing: Drawing | None) -> dict[str, Measure]:
        """A task for each feature of the drawing by its name, or this one alone.

        Raises
        ------
        PretravelError
            Tolerances that contradict each other, with the name of the feature.
        """
        if drawing is None:
            self.tolerances()
            return {"": self}
        tasks = {}
        for row in drawing.feature:
            name = row.label or row.select
            try:
                tasks[name] = replace(
                    self,
                    feature=row.kind,
                    features=None,
                    select=(row.select,),
                    association=cast("Criterion", row.association or self.association),
                    axis=None if row.axis is None else unit_vector(_typed(row.axis)),
                    at=None if row.at is None else vector(_typed(row.at)),
                    size_tolerance=None if row.tolerance is None else tolerance(row.tolerance),
                    nominal=row.nominal,
                    position_tolerance=row.position_tolerance,
                    form_tolerance=row.form_tolerance,
                )
                tasks[name].tolerances()
            except PretravelError as error:
                raise PretravelError(f"{self.features}: {name}: {error}") from None
        return tasks

    def drawing(self) -> tuple[Drawing | None, tuple[str, ...]]:
        """What the file of features states, None without one; and what of a plan was left out."""
        from pretravel.drawing.tolerances.features_file import read_features
        from pretravel.drawing.tolerances.plan_features import PLAN_ENDINGS, read_plan_features

        if self.features is None:
            return None, ()
        if self.features.suffix.lower() in PLAN_ENDINGS:
            return read_plan_features(self.features)
        return read_features(self.features), ()

    def tolerances(self) -> FeatureTolerances:
        """The tolerances of each feature.

        Raises
        ------
        PretravelError
            Deviations without a nominal diameter, or the contrary.
        """
        from pretravel.drawing.tolerances.tolerances import FeatureTolerances

        return FeatureTolerances(
            self._limits(), self.position_tolerance, self.form_tolerance, self.probability
        )

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

    def measured(self, points: Points, wanted: Wanted | None = None) -> MeasuredFeatures:
        """Measure the features of points that have been read.

        Parameters
        ----------
        points : Points
        wanted : Wanted, optional
            Of this task, where it was read before.

        Raises
        ------
        PretravelError
            A feature that its points do not determine, with its label; a nominal position for
            several features.
        """
        from pretravel.measurement import points_of_features

        wanted = wanted or self.wanted()
        found: list[InspectedFeature] = []
        left_out: list[str] = []
        for name, task in wanted.tasks.items():
            by_label = task.feature == BY_LABEL
            chosen = points_of_features(points, task.select, by_prefix=task.by_prefix or by_label)
            if by_label:
                chosen, left_out = _with_names_of_features(chosen)
            _refuse_one_place_for_many(task, list(chosen))
            found += [_measured(name or label, mine, task) for label, mine in chosen.items()]
        if wanted.drawing is None:
            return replace(_result(self, tuple(found), ()), left_out=tuple(left_out))
        inspected, together = _to_datums(self, wanted.drawing, wanted.tasks, found)
        return replace(_result(self, inspected, together), left_out=wanted.left_out)


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
    """

    task: Measure
    features: tuple[InspectedFeature, ...]
    relations: tuple[FeatureRelation, ...] = ()
    together: tuple[Together, ...] = ()
    exit_code: int = 0
    left_out: tuple[str, ...] = ()

    def document(self) -> Document:
        """The report, with what the laboratory states."""
        from pretravel.drawing.tasks.measure.report import features_document
        from pretravel.task import with_laboratory

        task = self.task
        warnings = []
        if any(each.conformities for each in self.features) and not task.u_machine_um:
            warnings.append(
                "u contains the errors of probing alone; a verdict also needs those of the "
                "machine's geometry, of temperature and clamping: state u of the machine"
            )
        if any(each.conformities and each.feature.is_extreme for each in self.features):
            warnings.append(
                "the noise of the points moves an extreme feature to one side, by the amount in "
                "the note; a verdict on its size or position does not contain this"
            )
        warnings += [*self.left_out, *task.statements_left_out()]
        statements = task.statements()
        report = features_document(
            self.features,
            self.relations,
            self.together,
            points_name=task.points.name,
            statements=statements,
            warnings=warnings,
        )
        return with_laboratory(report, statements)

    def in_brief(self, report: Document) -> Document:
        """Sizes and forms with their verdicts."""
        from pretravel.drawing.tasks.measure.report import features_summary

        return features_summary(report, self.features, self.relations)

    def write(self, output: str, path: Path) -> None:
        """Write the features, quantities as columns; or the residuals of their points."""
        from pretravel.drawing.features.feature_results import features_table, residuals_table
        from pretravel.files import write_table

        if output == "residuals":
            write_table(path, residuals_table([each.feature for each in self.features]))
        else:
            write_table(path, features_table(self.features, self.relations, self.together))


def _result(
    task: Measure, features: tuple[InspectedFeature, ...], together: tuple[Together, ...]
) -> MeasuredFeatures:
    from pretravel.drawing.features.between_features import relations_between
    from pretravel.drawing.features.conformity import ConformityVerdict

    relations = relations_between([each.feature for each in features])
    # A script must not take "cannot be decided" for "conforms".
    proven = (None, ConformityVerdict.CONFORMS)
    verdicts = [each.verdict for each in features]
    verdicts += [each.conformity.verdict for each in together]
    all_proven = all(verdict in proven for verdict in verdicts)
    return MeasuredFeatures(task, features, relations, together, 0 if all_proven else ANSWER)


def _to_datums(
    task: Measure, drawing: Drawing, tasks: Mapping[str, Measure], found: Sequence[InspectedFeature]
) -> tuple[tuple[InspectedFeature, ...], tuple[Together, ...]]:
    """The features with their tolerances to datums, and the decisions about several features."""
    from pretravel.drawing.tolerances.geometric_tolerances import inspect_geometry
    from pretravel.drawing.tolerances.tolerances import Together, decided_if_known

    part = None
    if task.part is not None:
        from pretravel.surface import read_part

        part = read_part(task.part)
    placed = {
        name: _placed(each, tasks[name], part)
        for name, each in zip(drawing.names, found, strict=True)
    }
    inspected = []
    for row, each in zip(drawing.feature, found, strict=True):
        name = row.label or row.select
        try:
            results = [
                inspect_geometry([placed[name]], tolerance, placed, task.probability)
                for tolerance in row.geometric
            ]
        except PretravelError as error:
            raise PretravelError(f"{task.features}: {name}: {error}") from None
        inspected.append(each.with_geometric(results) if results else each)
    together = []
    for pattern in drawing.pattern:
        members = [placed[name] for name in pattern.features]
        try:
            result = inspect_geometry(members, pattern.tolerance, placed, task.probability)
        except PretravelError as error:
            raise PretravelError(f"{task.features}: {pattern.label}: {error}") from None
        decided = decided_if_known(result.conformity, members[0].feature)
        u_machine = task.u_machine_um * MICROMETRE
        fitted = f"{result.free} motions that the datums leave free were fitted"
        remarks = (*result.remarks, *((fitted,) if result.free else ()))
        together.append(
            Together(tuple(pattern.features), result.quantity, decided, u_machine, remarks)
        )
    together += [_between(task, drawing, index, placed) for index in range(len(drawing.between))]
    return tuple(inspected), tuple(together)


def _placed(inspected: InspectedFeature, task: Measure, part: Part | None) -> PlacedFeature:
    """A feature with its nominal place: stated, or that of the faces beneath its points."""
    import numpy as np

    from pretravel.drawing.tolerances.geometric_tolerances import nominal_of_part
    from pretravel.drawing.tolerances.tolerance_frame import PlacedFeature

    limits = task.tolerances().size
    size = task.nominal
    if size is None and limits is not None and math.isfinite(limits[0] + limits[1]):
        size = 0.5 * (limits[0] + limits[1])
    at, axis = (None if each is None else np.array(each) for each in (task.at, task.axis))
    stated = PlacedFeature(inspected.feature, at, axis, size, limits, part)
    return stated if part is None else nominal_of_part(stated, part)


def _between(
    task: Measure, drawing: Drawing, index: int, placed: dict[str, PlacedFeature]
) -> Together:
    """A distance or an angle with its tolerance."""
    from pretravel.base import DEGREE
    from pretravel.drawing.features.between_features import relations_between
    from pretravel.drawing.features.conformity import size_conformity
    from pretravel.drawing.tolerances.tolerances import Together, decided_if_known

    row = drawing.between[index]
    both = [placed[name].feature for name in row.features]
    found = [
        each.quantity for each in relations_between(both) if each.quantity.name == row.quantity
    ]
    names = " and ".join(row.features)
    if not found:
        raise PretravelError(
            f"{task.features}: {names} have no {row.quantity} (features that are not parallel have "
            "no distance, and centres no angle)"
        )
    try:
        limits = replace(
            task, features=None, size_tolerance=tolerance(row.tolerance), nominal=row.nominal
        ).tolerances().size  # fmt: skip
    except PretravelError as error:
        raise PretravelError(f"{task.features}: {names}: {error}") from None
    assert limits is not None
    scale = DEGREE if row.quantity == "angle" else 1.0
    quantity = found[0]
    decided = size_conformity(
        quantity.name,
        quantity.value,
        quantity.u,
        (limits[0] * scale, limits[1] * scale),
        task.probability,
        dof=quantity.dof,
    )
    return Together(
        row.features, quantity, decided_if_known(decided, both[0]), task.u_machine_um * MICROMETRE
    )


def _with_names_of_features(chosen: Mapping[str, Points]) -> tuple[dict[str, Points], list[str]]:
    """The groups whose labels name a feature, and what is said of the others."""
    from pretravel.measurement import named_feature

    named = {label: mine for label, mine in chosen.items() if named_feature(label)}
    if not named:
        raise PretravelError(
            f"no label begins with a feature: {', '.join(chosen)}. State the feature, or choose "
            "points by their labels",
            inputs=("feature", "select"),
        )
    others = [label for label in chosen if label not in named]
    said = [f"not measured, because the labels name no feature: {', '.join(others)}"]
    return named, said if others else []


def _refuse_one_place_for_many(task: Measure, names: Sequence[str]) -> None:
    if task.at is not None and len(names) > 1:
        raise PretravelError(
            f"a nominal position is that of one feature, and there are {len(names)}: "
            f"{', '.join(names)}. Measure them one at a time",
            inputs=("at", "select"),
        )


def _measured(label: str, points: Points, task: Measure) -> InspectedFeature:
    """One feature, inspected."""
    from pretravel.drawing.tolerances.tolerances import inspect_feature

    try:
        if task.feature != BY_LABEL:
            feature = _feature(label, points, str(task.feature), task)
            return inspect_feature(feature, task.tolerances())
        feature = _feature_of_label(label, points, task)
        tolerances = task.tolerances()
        if feature.size_name not in [each.name for each in feature.quantities]:
            tolerances = replace(tolerances, size=None)  # a plane among bores has no size
        return inspect_feature(feature, tolerances)
    except PretravelError as error:
        if not label:
            raise _with_choice(error, len(points)) from None
        raise PretravelError(f"{label}: {error}", inputs=error.inputs) from None


def _feature(label: str, points: Points, kind: str, task: Measure) -> MeasuredFeature:
    from pretravel.drawing.features.measured_feature import measure_feature

    return measure_feature(
        points,
        kind,
        axis=task.axis,
        at=task.at,
        u_machine=task.u_machine_um * MICROMETRE,
        label=label,
        association=task.association,
    )


def _feature_of_label(label: str, points: Points, task: Measure) -> MeasuredFeature:
    """The feature that the label names; a bore or boss at several heights is a cylinder."""
    from pretravel.measurement import named_feature

    kind = str(named_feature(label))
    try:
        return _feature(label, points, kind, task)
    except PretravelError as error:
        if kind not in ("bore", "boss") or error.inputs != ("axis",):
            raise
        return _feature(label, points, "cylinder", task)


def _with_choice(error: PretravelError, count: int) -> PretravelError:
    """The fault of a feature of all points: those of other features may be among them."""
    if not (isinstance(error, ConvergenceError) or error.inputs == ("axis",)):
        return error
    return PretravelError(
        f"{error}. All {count} points of the file were taken: choose those of one feature by "
        "their labels, if there are others",
        inputs=(*error.inputs, "select"),
    )
