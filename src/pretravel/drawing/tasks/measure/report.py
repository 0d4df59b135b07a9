"""Report of measured features: sizes, positions and forms, before and after, and conformity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pretravel.drawing.features.between_features import FeatureRelation
from pretravel.drawing.features.conformity import (
    Conformity,
)
from pretravel.drawing.features.feature_budget import feature_budgets
from pretravel.drawing.features.measured_feature import (
    Quantity,
)
from pretravel.drawing.tasks.measure.lines import (
    TITLE_OF_LINES,
    lines_data,
    lines_table,
    tolerance_lines,
)
from pretravel.drawing.tasks.measure.notes_of_features import (
    RULE,
    notes_of,
    notes_on_datums,
    warnings_of,
)
from pretravel.drawing.tasks.measure.tables_of_features import (
    BOUNDS,
    angles_table,
    budget_section,
    conformity_table,
    data_of_features,
    lengths_table,
    relations_table,
    results_table,
)
from pretravel.drawing.tasks.measure.verdict_of_features import (
    decision_of,
    judgement_of,
    shown_name,
    verdict_of,
)
from pretravel.drawing.tolerances.compared_with_drawing import sizes_alike
from pretravel.drawing.tolerances.tolerances import (
    InspectedFeature,
    OpenTolerance,
    Together,
)
from pretravel.show import (
    Column,
    Document,
    Judgement,
    Picture,
    budget_picture,
)

if TYPE_CHECKING:
    from pretravel.files import LaboratoryStatements
    from pretravel.show import View

_MOST_BUDGETS = 6
"""Drawn as bars; a page lists all of them as tables."""


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
    """
    title = f"{points_name}, features" if points_name else "Features"

    def drawn() -> View:
        from pretravel.drawing.tasks.measure.picture import features_view

        return features_view(features, title)

    measured = [inspected.feature for inspected in features]
    lines = tolerance_lines(features, together, left_open)
    decided = [(shown_name(i.feature), i.feature.errors.machine, c)
               for i in features for c in i.conformities]  # fmt: skip
    decided += [(each.name, each.u_machine, each.conformity) for each in together]
    tables = [lines_table(lines)] if lines else []
    tables += [results_table(features, together)] if features else []
    angles = angles_table(measured)
    tables += [angles] if angles is not None else []
    tables += [relations_table(relations)] if relations else []
    tables += [conformity_table(decided)] if decided else []
    budgets = tuple(budget for feature in measured for budget in feature_budgets(feature))
    residuals = Picture("Residuals before and after compensation", drawn)
    return Document(
        title=title,
        verdict=verdict_of(features, together, lines),
        judgement=judgement_of(features, together, left_open),
        tables=tuple(tables),
        sections=tuple(budget_section(each) for each in features),
        pictures=(
            *([residuals] if features else []),
            *(budget_picture(budget, budget.result) for budget in budgets[:_MOST_BUDGETS]),
        ),
        notes=(
            *notes_of(measured, [conformity for *_, conformity in decided], statements),
            *notes_on_datums(features, together),
        ),
        warnings=(*warnings, *warnings_of(measured), *sizes_alike(features)),
        budgets=budgets,
        data=(
            *([lines_data(lines)] if lines else []),
            *data_of_features(features, relations, together),
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
    more_in: str = "--verbose or -o report.html",
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
    angles = angles_table([inspected.feature for inspected in features])
    if angles is not None and len(rows) + len(angles.columns[0].values) > _MOST_ROWS:
        angles = None
    more = len(rows) - _MOST_ROWS
    shown = rows[:_MOST_ROWS]
    given = not any(each.feature.points.state_uncertainty for each in features)
    table = lengths_table([(name, quantity) for name, quantity, _ in shown], "", given=given)
    columns = [c for c in table.columns if c.name not in ("u", BOUNDS[0])]
    if any(verdict for *_, verdict in shown):
        columns.append(Column.of("verdict", [verdict for *_, verdict in shown]))
    left = f"{more} more quantities, coordinates" if more > 0 else "coordinates"
    note = f"not shown: {left}, guard bands, budgets and notes (see {more_in})"
    lines = [each for each in document.tables if each.title == TITLE_OF_LINES]
    rest = (replace(table, columns=tuple(columns)), *((angles,) if angles else ()))
    if lines and len(features) != 1:
        rest, note = (), f"not shown: {len(rows)} quantities, {note.partition(', ')[2]}"
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
    """Sizes, forms and distances of features, without angles and positions."""
    rows = []
    for inspected in features:
        decided = {c.name: c for c in inspected.conformities}
        for quantity in inspected.stated:
            if quantity.angle or quantity.name in _PLACES:
                continue
            found = decided.get(quantity.name)
            u_machine = inspected.feature.errors.machine
            decision = None if found is None else decision_of(found, u_machine)
            rows.append(FeatureRow(shown_name(inspected.feature), quantity, found, decision))
    return rows + [
        FeatureRow(f"{r.first}, {r.second}", r.quantity) for r in relations if not r.quantity.angle
    ]


def short_report(document: Document) -> Document:
    """The report on one or two pages: the tolerances, the part, and the rule of the decisions.

    Warnings stand below them: nothing comes between the verdict and what fails.

    Parameters
    ----------
    document : Document
        The whole report.
    """
    rule = [note for note in document.notes if note.startswith(RULE)]
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
