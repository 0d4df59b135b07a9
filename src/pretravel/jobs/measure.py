"""Measure features: compensated points to sizes, forms and conformity, and their report."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy.typing as npt

from pretravel.compensation.points import Points
from pretravel.errors import PretravelError
from pretravel.features.measured_feature import measure_feature
from pretravel.features.selection import points_of_features
from pretravel.features.tolerances import FeatureTolerances, InspectedFeature, inspect_feature


@dataclass(frozen=True)
class FeatureWish:
    """Which features are wanted of points.

    Attributes
    ----------
    kind : str
        A name of `ASSOCIATIONS`.
    select : tuple of str
        Labels with * and ?; each is one feature. Empty: all points.
    by_prefix : bool
        One feature for each name before a number.
    axis, at : (3,) float or None
        Axis, and nominal position [mm], as in `measure_feature`.
    u_machine : float
        Of a length, by the machine's geometry, temperature and clamping. [mm]
    tolerances : FeatureTolerances
    """

    kind: str
    select: tuple[str, ...] = ()
    by_prefix: bool = False
    axis: npt.ArrayLike | None = None
    at: npt.ArrayLike | None = None
    u_machine: float = 0.0
    tolerances: FeatureTolerances = field(default=FeatureTolerances())


def measure_features(points: Points, wish: FeatureWish) -> list[InspectedFeature]:
    """Measure the features of points.

    Parameters
    ----------
    points : Points
    wish : FeatureWish

    Returns
    -------
    list of InspectedFeature

    Raises
    ------
    PretravelError
        A feature that its points do not determine, with its label; a nominal position for several
        features.
    """
    chosen = points_of_features(points, wish.select, by_prefix=wish.by_prefix)
    if wish.at is not None and len(chosen) > 1:
        raise PretravelError(
            f"a nominal position is that of one feature, and there are {len(chosen)}: "
            f"{', '.join(chosen)}. Measure them one at a time",
            inputs=("at", "select"),
        )
    found = []
    for label, mine in chosen.items():
        try:
            measured = measure_feature(
                mine, wish.kind, axis=wish.axis, at=wish.at, u_machine=wish.u_machine, label=label
            )
            found.append(inspect_feature(measured, wish.tolerances))
        except PretravelError as error:
            if not label:
                raise
            raise PretravelError(f"{label}: {error}", inputs=error.inputs) from None
    return found
