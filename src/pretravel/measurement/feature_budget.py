"""Uncertainty budgets of measured features."""

from __future__ import annotations

from pretravel.measurement.feature_uncertainty import FORM_OF_PART, OWN
from pretravel.measurement.measured_feature import MeasuredFeature
from pretravel.uncertainty.gum import Budget, Component

_BY_STATISTICS = (OWN, FORM_OF_PART)


def feature_budgets(feature: MeasuredFeature) -> tuple[Budget, ...]:
    """The budget of each length of a feature: diameter, coordinates.

    Parameters
    ----------
    feature : MeasuredFeature

    Returns
    -------
    tuple of Budget
        In mm. The points do not state degrees of freedom: they are taken as infinite.
    """
    name = feature.label or feature.kind
    return tuple(
        Budget(
            tuple(
                Component(cause, "A" if cause in _BY_STATISTICS else "B", u)
                for cause, u in quantity.parts.items()
                if u > 0.0
            ),
            f"{name}, {quantity.name}",
        )
        for quantity in feature.quantities
        if not quantity.angle
    )
