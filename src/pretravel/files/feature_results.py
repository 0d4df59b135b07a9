"""Measured features as a table."""

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
