"""Measured features as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE
from pretravel.drawing.features.between_features import FeatureRelation
from pretravel.drawing.features.conformity import MACHINE_NOT_IN_U, Conformity, conformity_words
from pretravel.drawing.features.measured_feature import MeasuredFeature, Quantity
from pretravel.drawing.tolerances.tolerances import InspectedFeature, Together


def feature_rows(inspected: InspectedFeature) -> list[dict[str, Any]]:
    """The quantities of a feature, each as values by column; what does not apply is None.

    Returns
    -------
    list of dict
        feature, kind, points, association, quantity, unit (mm or deg), value, u, expanded_u,
        uncompensated, interval_from_mm, interval_to_mm (95 %, of lengths), and with a tolerance
        lower, upper, guard_band, rejection_band, conformance_probability, verdict.
    """
    feature = inspected.feature
    decisions = {conformity.name: conformity for conformity in inspected.conformities}
    about = {
        "feature": feature.label,
        "kind": feature.kind,
        "points": len(feature.points),
        "association": feature.association.criterion,
    }
    return [
        {
            **about,
            **_values(q),
            **_decision(decisions.get(q.name), feature.errors.machine, angle=q.angle),
        }
        for q in inspected.stated
    ]


def relation_rows(
    relations: Sequence[FeatureRelation], features: Sequence[InspectedFeature]
) -> list[dict[str, Any]]:
    """Distances and angles between features, each as values by column as `feature_rows`."""
    counts = {each.feature.label: len(each.feature.points) for each in features}
    criteria = {each.feature.label: each.feature.association.criterion for each in features}
    kind = features[0].feature.kind
    return [
        {
            "feature": f"{relation.first}, {relation.second}",
            "kind": kind,
            "points": counts[relation.first] + counts[relation.second],
            "association": ", ".join(
                dict.fromkeys((criteria[relation.first], criteria[relation.second]))
            ),
            **_values(relation.quantity),
            **_decision(None, 0.0),
        }
        for relation in relations
    ]


def _values(quantity: Quantity) -> dict[str, Any]:
    scale = DEGREE if quantity.angle else 1.0
    plain = quantity.uncompensated
    ends = (math.nan, math.nan) if quantity.angle else quantity.interval
    return {
        "quantity": quantity.name,
        "unit": "deg" if quantity.angle else "mm",
        "value": quantity.value / scale,
        "u": _finite(quantity.u / scale),
        "expanded_u": _finite(quantity.expanded_u / scale),
        "uncompensated": None if plain is None else plain / scale,
        "interval_from_mm": _finite(ends[0]),
        "interval_to_mm": _finite(ends[1]),
    }


def _decision(
    conformity: Conformity | None, u_machine: float, *, angle: bool = False
) -> dict[str, Any]:
    if conformity is None:
        return dict.fromkeys(
            ("lower", "upper", "guard_band", "rejection_band", "conformance_probability", "verdict")
        )
    lacks = "" if u_machine > 0.0 else f", {MACHINE_NOT_IN_U}"
    scale = DEGREE if angle else 1.0
    return {
        "lower": _finite(conformity.lower / scale),
        "upper": _finite(conformity.upper / scale),
        "guard_band": _finite(conformity.guard_band / scale),
        "rejection_band": _finite(conformity.rejection_band / scale),
        "conformance_probability": _finite(conformity.probability),
        "verdict": conformity_words(conformity, u_machine) + lacks,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def together_rows(
    together: Sequence[Together], features: Sequence[InspectedFeature]
) -> list[dict[str, Any]]:
    """Decisions about several features, each as values by column as `feature_rows`."""
    known = {each.feature.label: each.feature for each in features}
    return [
        {
            "feature": each.name,
            "kind": known[each.labels[0]].kind,
            "points": sum(len(known[label].points) for label in each.labels),
            "association": known[each.labels[0]].association.criterion,
            **_values(each.quantity),
            **_decision(each.conformity, each.u_machine, angle=each.quantity.angle),
        }
        for each in together
    ]


def result_rows(
    features: Sequence[InspectedFeature],
    relations: Sequence[FeatureRelation] = (),
    together: Sequence[Together] = (),
) -> list[dict[str, Any]]:
    """All quantities, each as values by column as `feature_rows`.

    Those of features come first, then distances, angles and patterns of several features.
    """
    rows = [row for inspected in features for row in feature_rows(inspected)]
    decided = together_rows(together, features)
    known = {(row["feature"], row["quantity"]) for row in decided}
    rows += [
        row
        for row in relation_rows(relations, features)
        if (row["feature"], row["quantity"]) not in known
    ]
    return rows + decided


def features_table(
    features: Sequence[InspectedFeature],
    relations: Sequence[FeatureRelation] = (),
    together: Sequence[Together] = (),
) -> dict[str, npt.ArrayLike]:
    """The quantities of features as columns of a table; a cell that does not apply is empty.

    Columns: see `feature_rows`; rows: see `result_rows`.
    """
    rows = result_rows(features, relations, together)
    return {name: _column([row[name] for row in rows]) for name in rows[0]}


def residuals_table(features: Sequence[MeasuredFeature]) -> dict[str, npt.ArrayLike]:
    """The distance of each point from its feature, as columns of a table.

    Returns
    -------
    mapping of str to values
        feature, label, x_mm, y_mm, z_mm, residual_um: positive away from the centre or axis, of a
        plane or line along its normal.
    """
    places = [f.association.points for f in features]
    residuals = [f.association.residuals for f in features]
    positions = np.vstack(places)
    return {
        "feature": [f.label for f in features for _ in range(len(f.points))],
        "label": [label for f in features for label in f.points.labels],
        **{f"{axis}_mm": positions[:, i] for i, axis in enumerate("xyz")},
        "residual_um": np.concatenate(residuals) / MICROMETRE,
    }


def _column(values: list[Any]) -> npt.ArrayLike:
    """Numbers as numbers, where a missing one is not a number; words as words."""
    if any(isinstance(value, float) for value in values):
        return np.array([math.nan if value is None else value for value in values])
    return ["" if value is None else value for value in values]
