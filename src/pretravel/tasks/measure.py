"""Measure features: compensated points to sizes, forms and conformity, and their report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy.typing as npt

from pretravel.base.errors import ConvergenceError, PretravelError
from pretravel.files.feature_results import features_json, features_table
from pretravel.files.laboratory_file import with_laboratory_values
from pretravel.laboratory.certificate import LaboratoryStatements
from pretravel.measurement.conformity import ConformityVerdict
from pretravel.measurement.measured_feature import measure_feature
from pretravel.measurement.points import Points
from pretravel.measurement.selection import points_of_features
from pretravel.measurement.tolerances import FeatureTolerances, InspectedFeature, inspect_feature
from pretravel.show.document import Document
from pretravel.tasks.reports.feature_report import features_document
from pretravel.tasks.reports.laboratory_report import with_laboratory


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


@dataclass(frozen=True)
class MeasuredFeatures:
    """The features of points, with what was wanted.

    Attributes
    ----------
    features : tuple of InspectedFeature
    wish : FeatureWish
    """

    features: tuple[InspectedFeature, ...]
    wish: FeatureWish

    @property
    def some_fail(self) -> bool:
        """Whether a feature does not conform to its tolerances."""
        failed = ConformityVerdict.DOES_NOT_CONFORM
        return any(feature.verdict is failed for feature in self.features)

    def document(
        self,
        points_name: str = "",
        *,
        warnings: Sequence[str] = (),
        statements: LaboratoryStatements | None = None,
    ) -> Document:
        """The report, with what the laboratory states."""
        report = features_document(self.features, points_name=points_name, warnings=warnings)
        return with_laboratory(report, statements)

    def values(self, statements: LaboratoryStatements | None = None) -> dict[str, Any]:
        """The features for JSON, with what the laboratory states."""
        return with_laboratory_values(features_json(self.features), statements)

    def table(self) -> dict[str, npt.ArrayLike]:
        """The quantities of the features as columns."""
        return features_table(self.features)


def measure_features(points: Points, wish: FeatureWish) -> MeasuredFeatures:
    """Measure the features of points.

    Parameters
    ----------
    points : Points
    wish : FeatureWish

    Returns
    -------
    MeasuredFeatures

    Raises
    ------
    PretravelError
        A feature that its points do not determine, with its label; a nominal position for several
        features.
    """
    chosen = points_of_features(points, wish.select, by_prefix=wish.by_prefix)
    _refuse_one_place_for_many(wish, list(chosen))
    return MeasuredFeatures(
        tuple(_measured(label, mine, wish) for label, mine in chosen.items()), wish
    )


def _refuse_one_place_for_many(wish: FeatureWish, names: Sequence[str]) -> None:
    if wish.at is not None and len(names) > 1:
        raise PretravelError(
            f"a nominal position is that of one feature, and there are {len(names)}: "
            f"{', '.join(names)}. Measure them one at a time",
            inputs=("at", "select"),
        )


def _measured(label: str, points: Points, wish: FeatureWish) -> InspectedFeature:
    """One feature, inspected."""
    try:
        measured = measure_feature(
            points, wish.kind, axis=wish.axis, at=wish.at, u_machine=wish.u_machine, label=label
        )
        return inspect_feature(measured, wish.tolerances)
    except PretravelError as error:
        if not label:
            raise _with_choice(error, len(points)) from None
        raise PretravelError(f"{label}: {error}", inputs=error.inputs) from None


def _with_choice(error: PretravelError, count: int) -> PretravelError:
    """The fault of a feature of all points: those of other features may be among them."""
    if not (isinstance(error, ConvergenceError) or error.inputs == ("axis",)):
        return error
    return PretravelError(
        f"{error}. All {count} points of the file were taken: choose those of one feature by "
        "their labels, if there are others",
        inputs=(*error.inputs, "select"),
    )
