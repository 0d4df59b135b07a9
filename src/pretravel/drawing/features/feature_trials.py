"""Monte Carlo of a feature: its points drawn with their errors, and the feature fitted again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, PretravelError, frozen
from pretravel.drawing.features.feature_uncertainty import FeatureErrors
from pretravel.drawing.features.measured_feature import MeasuredFeature, Quantity
from pretravel.measurement import associate

_COVERAGE = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class QuantityByTrials:
    """A quantity of a feature over trials, and its analytic uncertainty.

    Attributes
    ----------
    quantity : Quantity
        As `measure_feature` states it.
    values : (t,) float
        [mm or rad]
    """

    quantity: Quantity
    values: FloatArray

    @property
    def u(self) -> float:
        """Standard deviation of the trials. [mm or rad]"""
        return float(self.values.std(ddof=1))

    @property
    def interval(self) -> tuple[float, float]:
        """Where 95 % of the values lie, the same share beyond each end. [mm or rad]"""
        low, high = np.quantile(self.values, _COVERAGE)
        return float(low), float(high)


def feature_by_trials(measured: MeasuredFeature, trials: int) -> tuple[QuantityByTrials, ...]:
    """Draw the points of a feature with their errors, and fit the feature again, many times.

    Parameters
    ----------
    measured : MeasuredFeature
        Of least squares. Each point has the uncertainty of its own direction where the points
        state it: that of machine and probe, if they were compensated with a separation.
    trials : int

    Returns
    -------
    tuple of QuantityByTrials
        In the order of the quantities.

    Raises
    ------
    PretravelError
        An extreme feature; points without uncertainties, or without what they have in common.

    References
    ----------
    JCGM 101, clause 7, with a stated number of trials; Nafi and Mayer 2011, section VI.

    >>> from pretravel.drawing.features.measured_feature import measure_feature
    >>> from pretravel.measurement.points import Points
    >>> angle = np.arange(8) * np.pi / 4
    >>> outward = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> one = 1e-6 * outward[:, :, None] * outward[:, None, :]     # u = 1 µm
    >>> tip = {"tip radius": np.full(8, 0.8e-3)}                   # 0.8 µm of it in common
    >>> points = Points(10.0 * outward, -outward, np.zeros(8), one, None, tuple("12345678"), tip)
    >>> size = feature_by_trials(measure_feature(points, "bore"), 2000)[0]
    >>> bool(abs(size.u / size.quantity.u - 1.0) < 0.08)           # 1.66 µm
    True
    """
    if measured.is_extreme:
        raise PretravelError(
            "trials are possible for least-squares features only; leave the association out",
            inputs=("trials", "association"),
        )
    errors = measured.errors
    if not errors.correlation_known or not measured.points.state_uncertainty:
        raise PretravelError(
            "trials need the uncertainty of each point and the errors that the points share; "
            "files of pretravel compensate contain both",
            inputs=("trials",),
        )
    generator = np.random.default_rng(1)
    found = [_fitted(measured, errors, generator) for _ in range(trials)]
    names = [quantity.name for quantity in measured.quantities]
    columns = np.array([[one[name] for name in names] for one in found])
    lengths = np.array([not quantity.angle for quantity in measured.quantities])
    columns = columns + lengths * errors.machine * generator.standard_normal(columns.shape)
    return tuple(
        QuantityByTrials(quantity, frozen(columns[:, k]))
        for k, quantity in enumerate(measured.quantities)
    )


def _fitted(
    measured: MeasuredFeature, errors: FeatureErrors, generator: np.random.Generator
) -> dict[str, float]:
    """The quantities of one trial, by name."""
    association, points = measured.association, measured.points
    positions = points.positions + _moved(errors, generator)[:, None] * association.outward
    fitted = associate(
        measured.kind, positions, axis=association.direction, at=_reference(measured)
    )
    return {
        "diameter": fitted.diameter, "width": fitted.diameter, "tube diameter": fitted.diameter,
        "ring diameter": fitted.ring_diameter, "half angle": fitted.half_angle,
        **dict(zip("xyz", fitted.point.tolist(), strict=True)),
    }  # fmt: skip


def _reference(measured: MeasuredFeature) -> FloatArray:
    """The point nearest to which an axis or plane is evaluated: the same one in all trials."""
    return measured.association.point if measured.nominal is None else measured.nominal


def _moved(errors: FeatureErrors, generator: np.random.Generator) -> FloatArray:
    """Errors of the points along the outward normals of the feature, with the part's form."""
    count = len(errors.own)
    moved = errors.own * generator.standard_normal(count)
    moved = moved + errors.form.drawn(1, generator, count)[0]
    for factors in errors.shared.values():
        moved = moved + generator.standard_normal(len(factors)) @ factors
    if errors.fixed.any():
        names, of_point = np.unique(errors.direction, return_inverse=True)
        moved = moved + generator.standard_normal(len(names))[of_point] * errors.fixed
    return np.asarray(moved)
