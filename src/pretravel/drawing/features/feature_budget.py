"""Uncertainty budgets of measured features."""

from __future__ import annotations

import math

from pretravel.drawing.features.feature_uncertainty import FORM_OF_PART, OWN
from pretravel.drawing.features.measured_feature import MeasuredFeature, Quantity
from pretravel.uncertainty import Budget, Component

_BY_STATISTICS = (OWN, FORM_OF_PART)


def feature_budgets(feature: MeasuredFeature) -> tuple[Budget, ...]:
    """The budget of each length of a feature: diameter, coordinates.

    Returns
    -------
    tuple of Budget
        In mm. The points do not state degrees of freedom. Those of the quantity come from what
        the residuals show of the form of the part; the largest source by statistics has them.
    """
    name = feature.label or feature.kind
    return tuple(
        Budget(_components(quantity), f"{name}, {quantity.name}", whole_dof=False)
        for quantity in feature.quantities
        if not quantity.angle
    )


def _components(quantity: Quantity) -> tuple[Component, ...]:
    parts = {cause: u for cause, u in quantity.parts.items() if u > 0.0}
    largest = max(_BY_STATISTICS, key=lambda cause: parts.get(cause, 0.0))
    return tuple(
        Component(
            cause,
            "A" if cause in _BY_STATISTICS else "B",
            u,
            # Welch and Satterthwaite (GUM, G.2b), solved for those of one source.
            dof=quantity.dof * (u / quantity.u) ** 4 if cause == largest else math.inf,
        )
        for cause, u in parts.items()
    )
