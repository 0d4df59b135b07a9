"""Report of measured features: sizes, positions and forms, before and after, and conformity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray
from pretravel.drawing.features.between_features import FeatureRelation, covariance_of_positions
from pretravel.drawing.features.conformity import (
    AT_TOUCHED_POINTS,
    Conformity,
    ConformityVerdict,
    conformity_words,
    verdict_words,
)
from pretravel.drawing.features.extreme_association import MINIMUM_ZONE
from pretravel.drawing.features.feature_budget import feature_budgets
from pretravel.drawing.features.feature_results import features_table, residuals_table
from pretravel.drawing.features.feature_trials import QuantityByTrials
from pretravel.drawing.features.feature_uncertainty import FORM_OF_PART
from pretravel.drawing.features.measured_feature import (
    BARE_SURFACE,
    NORMALS_OFF,
    MeasuredFeature,
    Quantity,
    normals_off,
)
from pretravel.drawing.tasks.measure.lines import (
    TITLE_OF_LINES,
    VERDICT_LEVELS,
    ToleranceLine,
    count_words,
    lines_data,
    lines_table,
    tolerance_lines,
)
from pretravel.drawing.tasks.measure.picture import features_view
from pretravel.drawing.tolerances.tolerances import (
    InspectedFeature,
    OpenTolerance,
    Together,
    side_of_failure,
)
from pretravel.files import LaboratoryStatements, comparison_sentence
from pretravel.qualification import COARSE_STEP
from pretravel.show import (
    Column,
    Document,
    Judgement,
    KeyFigure,
    Picture,
    Section,
    Span,
    Table,
    budget_picture,
    decimals,
    number_text,
    signed_decimals,
    value_text,
)
from pretravel.uncertainty import COVERAGE_FACTOR

_MOST_COVARIANCES = 50  # features
_MOST_BUDGETS = 6
"""Drawn as bars; a page lists all of them as tables."""
_ASSOCIATION = (
    "features of least squares (Gaussian association): not the largest inscribed or smallest "
    "circumscribed ones. Form (roundness, flatness, …) is that of the surface at the touched "
    "points, in bounds that hold for any shape; the measured range contains the noise too. The "
    "surface between the points is not seen"
)
_FORM_BESIDE = (
    "form (roundness, flatness, …) is that of the surface at the touched points, in bounds that "
    "hold for any shape, by the minimum zone where that is given, else from the residuals of "
    "least squares; the measured range of an extreme feature is listed too and contains the noise. "
    "Extreme features are those near the one of "
    "least squares; others may exist where the form is large"
)
_BETWEEN = "Between features"
_RULE = "decisions by the default rule of"
_COMMON = (
    "Distances are those of centres (across parallel axes) or of parallel planes and lines; angles "
    "those of normals, axes or lines. Errors that both features have in common are in u as far as "
    "they change the distance."
)


def features_document(
    features: Sequence[InspectedFeature],
    relations: Sequence[FeatureRelation] = (),
    together: Sequence[Together] = (),
    *,
    left_open: Sequence[OpenTolerance] = (),
    points_name: str = "",
    statements: LaboratoryStatements | None = None,
    warnings: Sequence[str] = (),
) -> Document:
    """The report of measured features.

    Parameters
    ----------
    features : sequence of InspectedFeature
    relations : sequence of FeatureRelation
        Distances and angles between them.
    together : sequence of Together
        Decisions about several of them.
    left_open : sequence of OpenTolerance
        Tolerances whose features were not measured.
    points_name : str
        Of the file with the points.
    statements : LaboratoryStatements or None
        Of a laboratory that may have compared the rule of decisions with its standard.
    warnings : sequence of str
        In addition to those that follow from the features.

    Returns
    -------
    Document
    """
    title = f"{points_name}, features" if points_name else "Features"
    measured = [inspected.feature for inspected in features]
    lines = tolerance_lines(features, together, left_open)
    decided = [(_name(i.feature), i.feature.errors.machine, c)
               for i in features for c in i.conformities]  # fmt: skip
    decided += [(each.name, each.u_machine, each.conformity) for each in together]
    tables = [lines_table(lines)] if lines else []
    tables.append(_results_table(features, together))
    angles = _angles_table(measured)
    tables += [angles] if angles is not None else []
    tables += [_relations_table(relations)] if relations else []
    tables += [_conformity_table(decided)] if decided else []
    budgets = tuple(budget for feature in measured for budget in feature_budgets(feature))
    return Document(
        title=title,
        verdict=_verdict(features, together, lines),
        judgement=_judgement(features, together, left_open),
        tables=tuple(tables),
        sections=tuple(_budget_section(each) for each in features),
        pictures=(
            Picture(
                "Residuals before and after compensation",
                lambda: features_view(features, title),
            ),
            *(budget_picture(budget, budget.result) for budget in budgets[:_MOST_BUDGETS]),
        ),
        notes=(
            *_notes(measured, [conformity for *_, conformity in decided], statements),
            *_notes_on_datums(features, together),
        ),
        warnings=(*warnings, *_warnings(measured)),
        budgets=budgets,
        data=(
            *([lines_data(lines)] if lines else []),
            *_data(features, relations, together),
        ),
    )


_MOST_ROWS = 8
"""Of a summary: with its verdict and heads a terminal shows it at once."""
_PLACES = ("x", "y", "z")


def features_summary(
    document: Document,
    features: Sequence[InspectedFeature],
    relations: Sequence[FeatureRelation] = (),
    *,
    more_in: str = "--verbose, or -o report.html",
) -> Document:
    """The report in some lines for a terminal: sizes and forms with U and their verdicts.

    Parameters
    ----------
    document : Document
        The report.
    features : sequence of InspectedFeature
    relations : sequence of FeatureRelation
    more_in : str
        Where the rest is found.

    Returns
    -------
    Document
        Without positions, budgets and notes.
    """
    rows = [
        (row.name, row.quantity, "" if row.judgement is None else row.judgement.word)
        for row in feature_rows(features, relations)
    ]
    angles = _angles_table([inspected.feature for inspected in features])
    if angles is not None and len(rows) + len(angles.columns[0].values) > _MOST_ROWS:
        angles = None
    more = len(rows) - _MOST_ROWS
    shown = rows[:_MOST_ROWS]
    given = not any(each.feature.points.state_uncertainty for each in features)
    table = _lengths_table([(name, quantity) for name, quantity, _ in shown], "", given=given)
    columns = [c for c in table.columns if c.name not in ("u", "at least")]
    if any(verdict for *_, verdict in shown):
        columns.append(Column.of("verdict", [verdict for *_, verdict in shown]))
    left = f"{more} more quantities, positions" if more > 0 else "positions"
    note = f"{left}, decisions in numbers, budgets and notes: {more_in}"
    lines = [each for each in document.tables if each.title == TITLE_OF_LINES]
    rest = (replace(table, columns=tuple(columns)), *((angles,) if angles else ()))
    if lines and len(features) != 1:
        rest, note = (), f"{len(rows)} quantities, {note.partition(', ')[2]}"
    return replace(document, tables=(*lines, *rest), sections=(), notes=(note,))


@dataclass(frozen=True)
class FeatureRow:
    """One quantity of a feature, with the decision about it.

    Attributes
    ----------
    name : str
        Of the feature.
    quantity : Quantity
    conformity : Conformity or None
    judgement : Judgement or None
        The decision; None where there is no tolerance.
    """

    name: str
    quantity: Quantity
    conformity: Conformity | None = None
    judgement: Judgement | None = None


def feature_rows(
    features: Sequence[InspectedFeature], relations: Sequence[FeatureRelation] = ()
) -> list[FeatureRow]:
    """Sizes, forms and distances of features, without angles and positions.

    Parameters
    ----------
    features : sequence of InspectedFeature
    relations : sequence of FeatureRelation
    """
    rows = []
    for inspected in features:
        decided = {c.name: c for c in inspected.conformities}
        for quantity in inspected.stated:
            if quantity.angle or quantity.name in _PLACES:
                continue
            found = decided.get(quantity.name)
            u_machine = inspected.feature.errors.machine
            decision = None if found is None else _decision(found, u_machine)
            rows.append(FeatureRow(_name(inspected.feature), quantity, found, decision))
    return rows + [
        FeatureRow(f"{r.first}, {r.second}", r.quantity) for r in relations if not r.quantity.angle
    ]


def _data(
    features: Sequence[InspectedFeature],
    relations: Sequence[FeatureRelation],
    together: Sequence[Together],
) -> tuple[Table, ...]:
    """All values, for programs: quantities with their sources, covariances, residuals."""
    measured = [inspected.feature for inspected in features]
    nothing = np.full(3, math.nan)
    directions = [f.association.direction for f in measured]
    axes = np.array([nothing if d is None else d for d in directions])
    places = np.array([f.association.point for f in measured])
    turns = [math.nan if f.u_direction is None else f.u_direction / DEGREE for f in measured]
    each = {
        "feature": [f.label for f in measured],
        "kind": [f.kind for f in measured],
        "side": [f.side or "" for f in measured],
        "association": [f.association.criterion for f in measured],
        "carrying_points": [" ".join(f.carrying) if f.is_extreme else "" for f in measured],
        "coverage_factor": [_largest_factor(f) for f in measured],
        "u_machine_mm": [f.errors.machine for f in measured],
        "correlation_of_points_stated": [f.errors.correlation_known for f in measured],
        **{f"direction_{name}": axes[:, i] for i, name in enumerate("xyz")},
        "u_direction_deg": turns,
        **{f"{name}_mm": places[:, i] for i, name in enumerate("xyz")},
        "form_at_least_mm": [f.form.interval[0] for f in measured],
        "form_at_most_mm": [f.form.interval[1] for f in measured],
        "measured_range_mm": [f.form.measured for f in measured],
        "range_by_errors_alone_mm": [f.form.noise for f in measured],
    }
    named = [(f.label, q) for f in measured for q in f.quantities]
    named += [(i.feature.label, each.quantity) for i in features for each in i.geometric]
    named += [(each.name, each.quantity) for each in together if len(each.labels) > 2]
    named += [(f"{r.first}, {r.second}", r.quantity) for r in relations]
    sources = [
        (label, q.name, cause, u / (DEGREE if q.angle else 1.0), "deg" if q.angle else "mm")
        for label, q in named
        for cause, u in q.parts.items()
    ]
    axis_pairs = [
        (f.label, *f.association.located_along[i], *f.association.located_along[k], covariance)
        for f in measured
        for (i, k), covariance in np.ndenumerate(f.located_covariance)
    ]
    residuals = residuals_table(measured)
    residuals["residual_mm"] = MICROMETRE * np.asarray(residuals.pop("residual_um"))
    return (
        Table.of(features_table(features, relations, together), "Quantities"),
        Table.of(each, "Features"),
        _rows_data(("feature", "quantity", "source", "u", "unit"), sources, "Sources"),
        _rows_data(
            ("feature", *(f"{end}_{name}" for end in ("first", "second") for name in "xyz"),
             "covariance_mm2"),
            axis_pairs, "Covariances of positions",
        ),
        _rows_data(
            ("first", "first_coordinate", "second", "second_coordinate", "covariance_mm2"),
            _covariances_between(measured), "Covariances between features",
        ),
        Table.of(residuals, "Residuals"),
    )  # fmt: skip


def _largest_factor(feature: MeasuredFeature) -> float:
    """The largest U / u of its quantities."""
    known = [q.expanded_u / q.u for q in feature.quantities if q.u > 0.0]
    return max(known, default=COVERAGE_FACTOR)


def _covariances_between(
    features: Sequence[MeasuredFeature],
) -> list[tuple[str, str, str, str, float]]:
    """Of the coordinates of two features each, by errors that their points have in common."""
    if len(features) > _MOST_COVARIANCES:
        return []
    covariance = covariance_of_positions(features)
    return [
        (first.label, "xyz"[i], second.label, "xyz"[k], float(covariance[3 * a + i, 3 * b + k]))
        for a, first in enumerate(features)
        for b, second in enumerate(features[:a])
        for i in range(3)
        for k in range(3)
    ]


def _rows_data(names: Sequence[str], rows: Sequence[tuple[Any, ...]], title: str) -> Table:
    return Table.of({name: [row[k] for row in rows] for k, name in enumerate(names)}, title)


def _name(feature: MeasuredFeature) -> str:
    name = feature.label or feature.kind
    return f"{name} ({feature.association.criterion})" if feature.is_extreme else name


_WITHOUT_MACHINE = ". This is no statement of conformity (see the warning)"


def _decision(conformity: Conformity, u_machine: float) -> Judgement:
    return Judgement(VERDICT_LEVELS[conformity.verdict], conformity_words(conformity, u_machine))


def _judgement(
    features: Sequence[InspectedFeature],
    together: Sequence[Together],
    left_open: Sequence[OpenTolerance],
) -> Judgement | None:
    """The worst decision; None without a tolerance."""
    found = [(each.verdict, each.feature.errors.machine) for each in features]
    found += [(each.conformity.verdict, each.u_machine) for each in together]
    found += [(ConformityVerdict.UNDECIDED, 1.0) for _ in left_open]
    for verdict, level in VERDICT_LEVELS.items():
        machine = [u for each, u in found if each is verdict]
        if machine:
            words = verdict_words(verdict, min(machine))
            return Judgement(level, words[0].upper() + words[1:])
    return None


def _verdict(
    features: Sequence[InspectedFeature],
    together: Sequence[Together],
    lines: Sequence[ToleranceLine],
) -> str:
    """What was found, and what it does not state."""
    lacking = any(i.verdict is not None and not i.feature.errors.machine for i in features)
    lacking = lacking or any(not each.u_machine for each in together)
    return _found(features, together, lines) + (_WITHOUT_MACHINE if lacking else "")


def _found(
    features: Sequence[InspectedFeature],
    together: Sequence[Together],
    lines: Sequence[ToleranceLine],
) -> str:
    decided = sum(len(each.conformities) for each in features)
    if len(features) == 1 and not together and len(lines) == decided:
        return _verdict_of_one(features[0])
    if not lines:
        return f"{len(features)} features"
    machines = [each.feature.errors.machine for each in features]
    machines += [each.u_machine for each in together]
    words = count_words(lines, features, min(machines, default=0.0))
    forms = any(c.of_touched_points for i in features for c in i.conformities)
    return words + (f"; forms{AT_TOUCHED_POINTS}" if forms else "")


def _verdict_of_one(inspected: InspectedFeature) -> str:
    feature = inspected.feature
    count = f"{len(feature.points)} points"
    if inspected.verdict is None:
        lead = next((q for q in feature.quantities if q.name == feature.size_name), None)
        if lead is None:
            return f"{_name(feature)}, {count}: {_form_words(feature)}"
        return f"{_name(feature)}, {count}: {_value_words(lead)}"
    reasons = [
        c.name + (f": {words}" if (words := _failure_words(c, feature)) else "")
        for c in inspected.conformities
        if c.verdict is inspected.verdict
    ]
    why = "" if inspected.verdict is ConformityVerdict.CONFORMS else f" ({'; '.join(reasons)})"
    words = verdict_words(inspected.verdict, feature.errors.machine)
    return (
        f"{_name(feature)}, {count}: {words}{why}{_decided_value(inspected)}{_touched(inspected)}"
    )


def _value_words(quantity: Quantity) -> str:
    """A length with its U, which is 2 u or more."""
    expanded = quantity.expanded_u / MICROMETRE
    k = f"{quantity.expanded_u / quantity.u:.2g}" if quantity.u > 0.0 else "2"
    return f"{quantity.name} {quantity.value:.5f} mm, U = {expanded:.2f} µm (k = {k})"


def _form_words(feature: MeasuredFeature) -> str:
    """The form of the surface, or its bound, with the measured range."""
    if feature.association.dof < 1:
        return f"{feature.form_name} not known"
    low, high = (end / MICROMETRE for end in feature.form.interval)
    found = f"at most {high:.2f} µm" if low == 0.0 else f"{low:.2f} to {high:.2f} µm"
    measured = feature.form.measured / MICROMETRE
    zone = "minimum zone" if feature.form_by == MINIMUM_ZONE else "measured range"
    return f"{feature.form_name}{AT_TOUCHED_POINTS} {found} (95 %), {zone} {measured:.2f} µm"


def _touched(inspected: InspectedFeature) -> str:
    """What a verdict on a form among others speaks of."""
    several = len(inspected.conformities) > 1
    speaks = several and any(c.of_touched_points for c in inspected.conformities)
    inside = inspected.verdict is ConformityVerdict.CONFORMS
    return f"; {inspected.feature.form_name}{AT_TOUCHED_POINTS}" if speaks and inside else ""


def _decided_value(inspected: InspectedFeature) -> str:
    """The one value that was compared with a tolerance, with its U; nothing for several."""
    if len(inspected.conformities) != 1:
        return ""
    conformity, feature = inspected.conformities[0], inspected.feature
    if conformity.of_touched_points:
        return f"; {_form_words(feature)}"
    found = next((q for q in inspected.stated if q.name == conformity.name), None)
    return "" if found is None else f"; {_value_words(found)}"


def _failure_words(conformity: Conformity, feature: MeasuredFeature) -> str:
    if (
        conformity.name != feature.size_name
        or conformity.verdict is not ConformityVerdict.DOES_NOT_CONFORM
    ):
        return ""
    return side_of_failure(conformity, feature.side)


def _lengths_table(
    rows: Sequence[tuple[str, Quantity]], explanation: str, title: str = "", *, given: bool = False
) -> Table:
    plain = [math.nan if q.uncompensated is None else q.uncompensated for _, q in rows]
    change = [(q.value - p) / MICROMETRE for (_, q), p in zip(rows, plain, strict=True)]
    return Table(
        (
            Column.of("feature", [name for name, _ in rows]),
            Column.of("quantity", [quantity.name for _, quantity in rows]),
            *(
                (Column.of("of the given points", [q.value for _, q in rows], "mm", decimals(5)),)
                if given
                else (
                    Column.of("uncompensated", plain, "mm", decimals(5)),
                    Column.of("compensated", [q.value for _, q in rows], "mm", decimals(5)),
                    Column.of("change", change, "µm", signed_decimals(2)),
                )
            ),
            Column.of("u", [q.u / MICROMETRE for _, q in rows], "µm", decimals(3)),
            Column.of("U (95 %)", [q.expanded_u / MICROMETRE for _, q in rows], "µm", decimals(3)),
            *(
                Column.of(name, [_end(q, index) for _, q in rows], "mm", decimals(5))
                for index, name in enumerate(("at least", "at most"))
                if any(q.ends for _, q in rows)
            ),
        ),
        title=title,
        explanation=explanation,
    )


def _end(quantity: Quantity, index: int) -> float:
    """Of the interval of a form, which is not the value plus and minus U."""
    return math.nan if quantity.ends is None else quantity.ends[index]


def _results_table(features: Sequence[InspectedFeature], together: Sequence[Together]) -> Table:
    rows = [(_name(i.feature), quantity)
            for i in features for quantity in i.stated if not quantity.angle]  # fmt: skip
    known = ("distance", "angle")  # in the table between features
    rows += [(each.name, each.quantity) for each in together if each.quantity.name not in known]
    return _lengths_table(
        rows,
        explanation="uncompensated: tip centres less the tip radius along the normals. u: standard "
        "uncertainty of the compensated value. U: 2 u, or more where few residuals show the form "
        "of the part. at least, at most: the form of the surface at the touched points (95 %); the "
        "measured range contains the noise too.",
        given=not any(each.feature.points.state_uncertainty for each in features),
    )


def _relations_table(relations: Sequence[FeatureRelation]) -> Table:
    """Distances and angles, in the unit of each."""
    found = [(f"{r.first}, {r.second}", r.quantity) for r in relations]
    if not any(q.angle for _, q in found):
        return _lengths_table(found, _COMMON, _BETWEEN)
    scale = [DEGREE if q.angle else 1.0 for _, q in found]
    plain = [math.nan if q.uncompensated is None else q.uncompensated for _, q in found]
    return Table(
        (
            Column.of("features", [name for name, _ in found]),
            Column.of("quantity", [q.name for _, q in found]),
            Column.of("unit", ["°" if q.angle else "mm" for _, q in found]),
            Column.of("uncompensated", [p / s for p, s in zip(plain, scale, strict=True)], "",
                      decimals(5)),
            Column.of("compensated", [q.value / s for (_, q), s in zip(found, scale, strict=True)],
                      "", decimals(5)),
            Column.of("u", [q.u / s for (_, q), s in zip(found, scale, strict=True)], "",
                      decimals(5)),
            Column.of("U (95 %)",
                      [q.expanded_u / s for (_, q), s in zip(found, scale, strict=True)], "",
                      decimals(5)),
        ),
        title=_BETWEEN,
        explanation=_COMMON,
    )  # fmt: skip


def _angles_table(features: Sequence[MeasuredFeature]) -> Table | None:
    """Half angles, and directions with their uncertainties; None where there are none."""
    rows: list[tuple[str, str, FloatArray, tuple[float, float], float]] = []
    nothing = np.full(3, math.nan)
    for feature in features:
        for quantity in (q for q in feature.quantities if q.angle):
            before = math.nan if quantity.uncompensated is None else quantity.uncompensated
            rows.append(
                (_name(feature), quantity.name, nothing, (before, quantity.value), quantity.u)
            )
        direction, u = feature.association.direction, feature.u_direction
        if direction is not None and u is not None:
            what = "normal" if feature.kind in ("plane", "slot") else "axis"
            what = "direction" if feature.kind == "line" else what
            rows.append((_name(feature), what, direction, (math.nan, math.nan), u))
    if not rows:
        return None
    angles = [
        Column.of(name, [row[3][k] / DEGREE for row in rows], "°", decimals(5))
        for k, name in enumerate(("uncompensated", "compensated"))
        if not all(math.isnan(row[3][k]) for row in rows)
    ]
    components = [
        Column.of(name, [row[2][i] for row in rows], "", decimals(7))
        for i, name in enumerate("xyz")
    ]
    return Table(
        (
            Column.of("feature", [row[0] for row in rows]),
            Column.of("direction" if not angles else "angle", [row[1] for row in rows]),
            *components,
            *angles,
            Column.of("u", [row[4] / DEGREE for row in rows], "°", decimals(5)),
        ),
        explanation="x, y, z: unit vector of the compensated points. u: of the direction, where it "
        "is largest.",
    )


def _conformity_table(decided: Sequence[tuple[str, float, Conformity]]) -> Table:
    """Of names, standard uncertainties by the machine, and decisions."""
    conformities = [conformity for *_, conformity in decided]
    lower = [c.lower if math.isfinite(c.lower) else math.nan for c in conformities]
    upper = [c.upper if math.isfinite(c.upper) else math.nan for c in conformities]
    guard = [
        "too narrow" if math.isnan(c.guard_band) else number_text(c.guard_band / MICROMETRE)
        for c in conformities
    ]
    reject = [number_text(c.rejection_band / MICROMETRE) for c in conformities]
    return Table(
        (
            Column.of("feature", [name for name, *_ in decided]),
            Column.of("quantity", [c.name for c in conformities]),
            Column.of("value", [c.value for c in conformities], "mm", decimals(5)),
            Column.of("from", lower, "mm", decimals(4)),
            Column.of("to", upper, "mm", decimals(4)),
            Column.of("guard band", guard, "µm"),
            Column.of("rejection", reject, "µm"),
            Column.of("P", [100.0 * c.probability for c in conformities], "%", decimals(1)),
            Column.of(
                "verdict",
                [conformity_words(c, u_machine) for _, u_machine, c in decided],
            ),
        ),
        title="Conformity",
        explanation="A value conforms where it is inside the tolerance by at least the guard "
        "band, and does not conform where it is outside by more than the rejection band. P: the "
        "probability that the true value is inside.",
    )


def _budget_section(inspected: InspectedFeature) -> Section:
    """The contributions to each uncertainty, source by source."""
    feature = inspected.feature
    lengths = [q for q in feature.quantities if not q.angle]
    lengths += [each.quantity for each in inspected.geometric if each.quantity.parts]
    names = dict.fromkeys(cause for q in lengths for cause in q.parts)
    table = Table(
        (
            Column.of("source", [*names, "u"]),
            *(
                Column.of(
                    f"u({q.name})",
                    [
                        *(q.parts.get(cause, 0.0) / MICROMETRE for cause in names),
                        q.u / MICROMETRE,
                    ],
                    "µm",
                    decimals(3),
                )
                for q in lengths
            ),
        )
    )
    form = feature.form
    return Section(
        f"{_name(feature)}: sources of uncertainty",
        figures=(
            KeyFigure("range by errors", form.noise / MICROMETRE, "µm",
                      remark="mean range that the errors of the points produce alone"),
            KeyFigure("enlargement", (form.measured - form.value) / MICROMETRE, "µm",
                      remark="by which the errors of the points enlarge the measured range"),
        ),
        tables=(table,),
        detail=True,
        certificate=True,
    )  # fmt: skip


def _notes(
    features: Sequence[MeasuredFeature],
    conformities: Sequence[Conformity],
    statements: LaboratoryStatements | None,
) -> list[str]:
    notes = [_ASSOCIATION] if any(not f.is_extreme for f in features) else []
    notes += _extreme_notes([f for f in features if f.is_extreme])
    lost = [f for f in features if f.association.dof > 0 and f.form.measured <= f.form.most_noise]
    if lost:
        alone = Span.of([feature.form.noise / MICROMETRE for feature in lost])
        notes.append(
            f"{', '.join(map(_name, lost))}: the form is not distinguished from the errors of the "
            f"points, which alone produce {_range_text(alone)} on average"
        )
    rough = [feature for feature in features if feature.errors.excess > 0.0]
    if rough:
        excess = Span.of([feature.errors.excess / MICROMETRE for feature in rough])
        notes.append(
            f"{', '.join(map(_name, rough))}: the residuals scatter by {_range_text(excess)} more "
            f"than the errors of the points explain. This is {FORM_OF_PART}, or touches "
            "that scatter more than those on the reference; its effect on size and position is in "
            "u, with the correlation of the shapes that the residuals show"
        )
    if conformities:
        first = min(conformities, key=lambda each: each.of_touched_points)
        notes.append(
            f"{_RULE} ISO 14253-1:2017: proven with a probability of "
            f"{100 * first.required:g} %, at one limit {first.coverage:.3f} u. "
            + comparison_sentence("ISO 14253-1", statements)
        )
    return notes


def _extreme_notes(features: Sequence[MeasuredFeature]) -> list[str]:
    """On what extreme features rest, and what their u does not contain."""
    if not features:
        return []
    resting = [f"{_name(f)}: rests on {', '.join(f.carrying)}" for f in features]
    noise = Span.of([f.form.noise / MICROMETRE for f in features])
    known = all(f.points.state_uncertainty for f in features)
    amount = f"of {_range_text(noise)} on average" if known else "that is not known here"
    on_points = (
        f"{'; '.join(resting)}. The other points do not move it: u is that of these points, and "
        "contains no form of the part, neither at nor between the points"
    )
    one_sided = (
        "the noise of the points moves an extreme feature to one side. On a perfect surface it "
        f"makes a range {amount}: a zone is too wide by about this, an inscribed diameter too "
        "small and a circumscribed one too large by up to this, a tangent plane or line too far "
        "outside by up to half of it. This is not subtracted, and not in u"
    )
    return [on_points, one_sided, _FORM_BESIDE]


def _notes_on_datums(
    features: Sequence[InspectedFeature], together: Sequence[Together]
) -> list[str]:
    """What the datums left free, and what a material condition added."""
    found = [each for i in features for each in i.geometric]
    if not found and not any(each.remarks for each in together):
        return []
    notes = []
    for each in found:
        name = f"{', '.join(each.labels)}, {each.tolerance.name}"
        if each.bonus > 0.0:
            notes.append(f"{name}: the size adds {each.bonus / MICROMETRE:.1f} µm to the tolerance")
        notes += [f"{name}: {remark}" for remark in each.remarks]
    notes += [f"{each.name}: {remark}" for each in together for remark in each.remarks]
    notes.append(
        "tolerances to datums: each datum feature is associated as its line says, and takes the "
        "motions that those before it left (ISO 5459); what they leave free is fitted, with the "
        "least largest distance. The errors of the datums are in U. A zone of a surface contains "
        "its touched points, that of an axis its ends within the touched length"
    )
    return notes


def _range_text(span: Span) -> str:
    """A range in µm; one number where both ends are shown alike."""
    alike = number_text(span.low) == number_text(span.high)
    return value_text(span.low if alike else span, "µm")


def _coarse(features: Sequence[MeasuredFeature]) -> list[str]:
    """What to know of coordinates in coarse steps."""
    step = max(0.0 if each.errors.rounded is None else each.points.step for each in features)
    if step < COARSE_STEP:
        return []
    return [
        (
            f"the coordinates are in steps of {step / MICROMETRE:.4g} µm, which U contains: points "
            "can be rounded alike. Write the coordinates with more digits"
        )
    ]


def _warnings(features: Sequence[MeasuredFeature]) -> list[str]:
    warnings = []
    if not all(feature.points.state_uncertainty for feature in features):
        warnings.append(
            "the points have no uncertainty: u follows from their scatter about the feature "
            "alone. It lacks what they have in common, the errors of the probe (pretravel, tip) "
            "and of the machine; form and noise are not distinguished. No tolerance is decided"
        )
        warnings += _coarse(features)
    elif not all(feature.errors.correlation_known for feature in features):
        warnings.append(
            "the points do not say which errors they have in common (columns shared_…_um, which "
            "files of older versions lack): u is the largest that any correlation allows"
        )
    elif not all(feature.errors.map_is_stated for feature in features):
        warnings.append(
            "the map of these points has no uncertainty (a prediction): the "
            "difference between the described probe and yours is not in u, and no tolerance is "
            "decided. Qualify the probe"
        )
    if any(
        feature.uncompensated is None
        and feature.points.state_uncertainty
        and feature.kind != BARE_SURFACE
        for feature in features
    ):
        warnings.append("the file contains neither uncompensated points nor their pretravel")
    elif any(feature.uncompensated_is_rebuilt for feature in features):
        warnings.append(
            "the file contains no uncompensated points: they are the compensated ones moved back "
            "by their pretravel along the normal, without delay travel or oblique approach"
        )
    warnings.extend(
        f"{_name(feature)}: the normals of the points are "
        f"{normals_off(feature) / DEGREE:.1f}° off those of the feature (root mean square), as "
        "from an expected centre that is not the true one: the tip touched next to these points. "
        "Compensate again with --feature, or with touches without normals"
        for feature in features
        if normals_off(feature) > NORMALS_OFF
    )
    warnings.extend(
        f"{_name(feature)}: {len(feature.points)} points determine it exactly, so its form is not "
        "known, and a gross error would not be seen"
        for feature in features
        if feature.association.dof < 1
    )
    alike: dict[str, list[str]] = {}
    for feature in features:
        for text in feature.warnings:
            alike.setdefault(text, []).append(_name(feature))
    warnings.extend(f"{', '.join(names)}: {text}" for text, names in alike.items())
    return warnings


TRIALS = "By Monte Carlo"
"""Title of the table of trials."""


def trials_table(found: Mapping[str, Sequence[QuantityByTrials]], trials: int) -> Table:
    """Quantities by Monte Carlo and their analytic uncertainty.

    Parameters
    ----------
    found : mapping of str to sequence of QuantityByTrials
        By the name of the feature.
    trials : int

    Returns
    -------
    Table
    """
    rows = [(name, one) for name, each in found.items() for one in each]
    scale = [1.0 / DEGREE if one.quantity.angle else 1.0 for _, one in rows]
    fine = [(60.0 / DEGREE if one.quantity.angle else 1.0 / MICROMETRE) for _, one in rows]
    ends = [one.interval for _, one in rows]
    return Table(
        (
            Column.of("feature", [name for name, _ in rows]),
            Column.of("quantity", [
                f"{one.quantity.name} / {'°' if one.quantity.angle else 'mm'}" for _, one in rows
            ]),
            Column.of("value", [
                one.quantity.value * s for (_, one), s in zip(rows, scale, strict=True)
            ], "", decimals(5)),
            Column.of("u, analytic", [
                one.quantity.u * f for (_, one), f in zip(rows, fine, strict=True)
            ], "", decimals(3)),
            Column.of("u, by trials", [
                one.u * f for (_, one), f in zip(rows, fine, strict=True)
            ], "", decimals(3)),
            Column.of("95 % from", [
                low * s for (low, _), s in zip(ends, scale, strict=True)
            ], "", decimals(5)),
            Column.of("to", [
                high * s for (_, high), s in zip(ends, scale, strict=True)
            ], "", decimals(5)),
        ),
        title=TRIALS,
        explanation=f"{trials} trials: the points drawn with their errors, of their "
        "own and in common, and the form of the part; the feature fitted to each. u in µm, of "
        "angles in minutes.",
    )  # fmt: skip


def short_report(document: Document) -> Document:
    """The report on one or two pages: the tolerances, the part, and the rule of the decisions.

    Warnings stand below them: nothing comes between the verdict and what fails.

    Parameters
    ----------
    document : Document
        The whole report.
    """
    rule = [note for note in document.notes if note.startswith(_RULE)]
    asked = "all quantities, budgets, settings and hashes of files: the .html page, or --annex"
    return replace(
        document,
        tables=tuple(table for table in document.tables if table.title == TITLE_OF_LINES),
        sections=(),
        pictures=document.pictures[:1],
        notes=(*rule, *(f"Warning: {words}" for words in document.warnings), asked),
        warnings=(),
        budgets=(),
        data=(),
    )
