"""Measured features as a table, and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.base.units import DEGREE
from pretravel.measurement.conformity import MACHINE_NOT_IN_U, Conformity, verdict_words
from pretravel.measurement.tolerances import InspectedFeature
from pretravel.uncertainty.gum import COVERAGE_FACTOR


def feature_rows(inspected: InspectedFeature) -> list[dict[str, Any]]:
    """The quantities of a feature, each as values by column; what does not apply is None.

    Parameters
    ----------
    inspected : InspectedFeature

    Returns
    -------
    list of dict
        feature, kind, points, quantity, unit (mm or deg), value, u, expanded_u (k = 2),
        uncompensated, and with a tolerance lower, upper, guard_band, rejection_band,
        conformance_probability, verdict.
    """
    feature = inspected.feature
    decisions = {conformity.name: conformity for conformity in inspected.conformities}
    rows = []

    def add(name: str, value: float, u: float, plain: float | None, angle: bool = False) -> None:
        scale = DEGREE if angle else 1.0
        rows.append(
            {
                "feature": feature.label,
                "kind": feature.kind,
                "points": len(feature.points),
                "quantity": name,
                "unit": "deg" if angle else "mm",
                "value": value / scale,
                "u": u / scale,
                "expanded_u": COVERAGE_FACTOR * u / scale,
                "uncompensated": None if plain is None else plain / scale,
                **_decision(decisions.get(name), feature.errors.machine),
            }
        )

    for quantity in feature.quantities:
        add(quantity.name, quantity.value, quantity.u, quantity.uncompensated, quantity.angle)
    plain = feature.uncompensated
    if feature.located is not None:
        position, u = feature.position
        add("position", position, u, feature.uncompensated_position)
    if feature.association.dof > 0:
        form = feature.form
        add(feature.form_name, form.value, form.u, None if plain is None else plain.form)
    return rows


def _decision(conformity: Conformity | None, u_machine: float) -> dict[str, Any]:
    if conformity is None:
        return dict.fromkeys(
            ("lower", "upper", "guard_band", "rejection_band", "conformance_probability", "verdict")
        )
    lacks = "" if u_machine > 0.0 else f", {MACHINE_NOT_IN_U}"
    return {
        "lower": _finite(conformity.lower),
        "upper": _finite(conformity.upper),
        "guard_band": _finite(conformity.guard_band),
        "rejection_band": _finite(conformity.rejection_band),
        "conformance_probability": _finite(conformity.probability),
        "verdict": verdict_words(conformity.verdict, u_machine) + lacks,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def features_table(features: Sequence[InspectedFeature]) -> dict[str, npt.ArrayLike]:
    """The quantities of features as columns of a table; a cell that does not apply is empty.

    Columns: see `feature_rows`.
    """
    rows = [row for inspected in features for row in feature_rows(inspected)]
    return {name: _column([row[name] for row in rows]) for name in rows[0]}


def _column(values: list[Any]) -> npt.ArrayLike:
    """Numbers as numbers, where a missing one is not a number; words as words."""
    if any(isinstance(value, float) for value in values):
        return np.array([math.nan if value is None else value for value in values])
    return ["" if value is None else value for value in values]


def features_json(features: Sequence[InspectedFeature]) -> dict[str, Any]:
    """Measured features as values of JSON: quantities with their budgets, covariance, residuals."""
    return {
        "association": "least squares (Gaussian)",
        "coverage_factor": COVERAGE_FACTOR,
        "features": [_feature_values(inspected) for inspected in features],
    }


def _feature_values(inspected: InspectedFeature) -> dict[str, Any]:
    feature = inspected.feature
    association = feature.association
    return {
        "feature": feature.label,
        "kind": feature.kind,
        "side": feature.side,
        "u_machine_mm": feature.errors.machine,
        "correlation_of_points_stated": feature.errors.correlation_known,
        "direction": None if association.direction is None else association.direction.tolist(),
        "u_direction_deg": None if feature.u_direction is None else feature.u_direction / DEGREE,
        "position_mm": association.point.tolist(),
        "position_determined_along": association.located_along.tolist(),
        "position_covariance_mm2": feature.located_covariance.tolist(),
        "form_by_errors_alone_mm": feature.form.noise,
        "form_bias_mm": feature.form.bias,
        "quantities": [
            {key: row[key] for key in row if key not in ("feature", "kind")}
            for row in feature_rows(inspected)
        ],
        "budgets": {
            q.name: {cause: u / (DEGREE if q.angle else 1.0) for cause, u in q.parts.items()}
            for q in feature.quantities
        },
        "labels": list(feature.points.labels),
        "residuals_mm": association.residuals.tolist(),
    }
