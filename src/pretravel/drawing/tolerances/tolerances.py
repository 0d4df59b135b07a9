"""The tolerances of a feature, and the decisions about it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DISTANCE, INCH, PROBABILITY, PretravelError, check_numbers
from pretravel.drawing.features.conformity import (
    DEFAULT_PROBABILITY,
    Conformity,
    ConformityVerdict,
    form_conformity,
    position_conformity,
    size_conformity,
)
from pretravel.drawing.features.extreme_association import GAUSSIAN, MINIMUM_ZONE
from pretravel.drawing.features.measured_feature import MeasuredFeature, Quantity

if TYPE_CHECKING:  # a feature alone has no frames
    from pretravel.drawing.tolerances.tolerance_frame import GeometricResult


@dataclass(frozen=True)
class FeatureTolerances:
    """What a drawing allows a feature.

    Attributes
    ----------
    size : pair of float or None
        Limits of the diameter; infinite where there is none. [mm]
    position : float or None
        Diameter of the zone (width for a plane or line) around the nominal position. [mm]
    form : float or None
        Roundness, flatness, straightness, cylindricity. [mm]
    probability : float
        At which conformity or nonconformity is proven.
    form_by : str
        Association whose form is compared: minimum-zone, as ISO 1101 defines form, or gaussian.
    """

    size: tuple[float, float] | None = None
    position: float | None = None
    form: float | None = None
    probability: float = DEFAULT_PROBABILITY
    form_by: str = MINIMUM_ZONE

    def __post_init__(self) -> None:
        if self.form_by not in (MINIMUM_ZONE, GAUSSIAN):
            raise PretravelError(
                f"a form is decided by {MINIMUM_ZONE} or {GAUSSIAN}, not by '{self.form_by}'",
                inputs=("form_association",),
            )
        check_numbers(self, position=DISTANCE, form=DISTANCE, probability=PROBABILITY)
        if self.size is not None and np.shape(self.size) != (2,):
            raise PretravelError(
                f"the limits of a size are two, the lower and the upper, not {self.size!r:.40}",
                inputs=("size_tolerance",),
            )
        if self.size is not None and self.size[1] <= 0.0:
            raise PretravelError(
                f"the upper limit of the size is {self.size[1]:g} mm; it must be larger than zero",
                inputs=("size_tolerance",),
            )

    @property
    def any_stated(self) -> bool:
        """Whether there is a tolerance at all."""
        return not (self.size is None and self.position is None and self.form is None)


@dataclass(frozen=True, eq=False)
class InspectedFeature:
    """A measured feature and the decisions about its tolerances.

    Attributes
    ----------
    feature : MeasuredFeature
    conformities : tuple of Conformity
        One for each tolerance.
    geometric : tuple of GeometricResult
        Of tolerances to datums; their conformities are among `conformities`.
    """

    feature: MeasuredFeature
    conformities: tuple[Conformity, ...]
    geometric: tuple[GeometricResult, ...] = ()

    @property
    def stated(self) -> tuple[Quantity, ...]:
        """All that is stated of the feature, with what its tolerances to datums ask."""
        return (*self.feature.stated, *(each.quantity for each in self.geometric))

    def __getitem__(self, name: str) -> Quantity:
        """A quantity by its name: ``bore["diameter"]``, ``bore["position to A|B|C"]``."""
        found = next((each.quantity for each in self.geometric if each.quantity.name == name), None)
        return self.feature[name] if found is None else found

    def with_geometric(self, results: Sequence[GeometricResult]) -> InspectedFeature:
        """With the results of its tolerances to datums."""
        decided = [decided_if_known(each.conformity, self.feature) for each in results]
        return replace(self, conformities=(*self.conformities, *decided), geometric=tuple(results))

    @property
    def verdict(self) -> ConformityVerdict | None:
        """Of all tolerances together; None without a tolerance."""
        found = Counter(conformity.verdict for conformity in self.conformities)
        for verdict in (ConformityVerdict.DOES_NOT_CONFORM, ConformityVerdict.UNDECIDED):
            if found[verdict]:
                return verdict
        return ConformityVerdict.CONFORMS if found else None


@dataclass(frozen=True, eq=False)
class Together:
    """A decision about several features: of a pattern, a distance, an angle.

    Attributes
    ----------
    labels : tuple of str
    quantity : Quantity
    conformity : Conformity
    u_machine : float
        Standard uncertainty of a length by other causes than the probe. [mm]
    remarks : tuple of str
    tolerance : str
        With its datums, as of `GeometricTolerance.name`; empty for a distance or an angle.
    """

    labels: tuple[str, ...]
    quantity: Quantity
    conformity: Conformity
    u_machine: float
    remarks: tuple[str, ...] = ()
    tolerance: str = ""

    @property
    def name(self) -> str:
        return ", ".join(self.labels)


@dataclass(frozen=True)
class OpenTolerance:
    """A tolerance of a drawing that was not decided: not measured, or of a kind that is not.

    Attributes
    ----------
    labels : tuple of str
    characteristic : str
    limits : pair of float
        Not numbers where the drawing states none. [mm, or degrees of an angle]
    reason : str
    is_measured : bool
        Whether touches can decide it; else it is of a kind that is not decided here.
    """

    labels: tuple[str, ...]
    characteristic: str
    limits: tuple[float, float]
    reason: str
    is_measured: bool = True

    @property
    def name(self) -> str:
        return ", ".join(self.labels)


def inspect_feature(feature: MeasuredFeature, tolerances: FeatureTolerances) -> InspectedFeature:
    """Compare a feature with its tolerances.

    Parameters
    ----------
    feature : MeasuredFeature
    tolerances : FeatureTolerances

    Returns
    -------
    InspectedFeature
        Its form is that of the association by which it is decided. Nothing is decided where the
        map of the points stated no uncertainty (a prediction): its error may be larger than all
        others.

    Raises
    ------
    PretravelError
        A tolerance of a quantity that the feature does not have; a position without a nominal one.
    """
    found = []
    required = tolerances.probability
    if tolerances.size is not None:
        size = feature.quantity(feature.size_name)
        refuse_other_unit(size.name, size.value, tolerances.size)
        found.append(
            size_conformity(size.name, size.value, size.u, tolerances.size, required, dof=size.dof)
        )
    _refuse_wide_zones(feature, tolerances)
    if tolerances.position is not None:
        if feature.located is None:
            raise PretravelError(
                "a tolerance of the position needs the nominal position", inputs=("at",)
            )
        position = position_conformity(
            feature.located,
            feature.located_covariance,
            tolerances.position,
            required,
            dof=feature.position_dof,
        )
        found.append(position.with_value(*feature.position))
    if tolerances.form is not None:
        if feature.association.dof < 1:
            raise PretravelError(
                f"{len(feature.points)} points determine a {feature.kind} exactly: they say "
                f"nothing about its {feature.form_name}; touch more points"
            )
        feature = feature.with_form_by(tolerances.form_by)
        found.append(form_conformity(feature.form_name, feature.form, tolerances.form, required))
    return InspectedFeature(feature, tuple(decided_if_known(each, feature) for each in found))


def _refuse_wide_zones(feature: MeasuredFeature, tolerances: FeatureTolerances) -> None:
    """Refuse zones of form and position that only a number in µm can be. [mm]"""
    extent = float(np.ptp(feature.points.positions, axis=0).max())
    for what, zone in (("position", tolerances.position), ("form", tolerances.form)):
        if zone is not None and zone > max(_WIDE, _SHARE_OF_PART * extent):
            raise PretravelError(
                f"the tolerance of the {what} is {zone:g} mm, and the touches are within "
                f"{extent:.4g} mm: were {zone:g} µm meant? Give {0.001 * zone:g}, in mm",
                inputs=(f"{what}_tolerance",),
            )


def refuse_wide_deviations(nominal: float | None, low: float | None, high: float | None) -> None:
    """Refuse deviations from a nominal size that only numbers in µm can be. [mm]

    >>> refuse_wide_deviations(6.0, -1.0, 1.0)  # of class v of ISO 2768
    >>> refuse_wide_deviations(20.0, 0.0, 21.0)
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: a deviation of 21 mm from a nominal size of 20 mm: were \
21 µm meant? Give 0.021, in mm
    """
    widest = max((abs(each) for each in (low, high) if each is not None), default=0.0)
    if nominal is not None and widest > max(_WIDE, _SHARE_OF_PART * nominal):
        raise PretravelError(
            f"a deviation of {widest:g} mm from a nominal size of {nominal:g} mm: were "
            f"{widest:g} µm meant? Give {0.001 * widest:g}, in mm",
            inputs=("size_tolerance", "nominal"),
        )


def refuse_other_unit(name: str, value: float, limits: tuple[float, float]) -> None:
    """Refuse limits of the same size in inches or µm, of a radius, or that are deviations. [mm]

    >>> refuse_other_unit("diameter", 40.0, (1.574, 1.576))
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: diameter 40.000 mm, but the limits are around 1.5750: \
they look like inches (40.0050 mm). Give them in mm
    >>> refuse_other_unit("diameter", 40.0, (19.99, 20.01))
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: diameter 40.000 mm, but the limits are around 20.0000: \
they look like those of the half, such as a radius. Give those of the whole
    """
    known = [limit for limit in limits if math.isfinite(limit)]
    if not known or limits[0] <= value <= limits[1]:
        return
    if limits[0] <= 0.0 and math.isfinite(limits[0]):
        raise PretravelError(
            f"{name} {value:.3f} mm, but the limits are {limits[0]:g} to {limits[1]:g}: a size has "
            "no limit of zero. Give the limits of the size, or the deviations (in mm) with their "
            "nominal size",
            inputs=("size_tolerance", "nominal"),
        )
    middle = sum(known) / len(known)
    narrow = len(known) == 2 and limits[1] - limits[0] < _NARROW * middle
    for factor, needs_narrow, words in (
        (INCH, False, f"they look like inches ({INCH * middle:.4f} mm). Give them in mm"),
        (1.0 / INCH, True, "the points look like inches: they must be in mm"),
        (0.001, False, f"they look like µm ({0.001 * middle:.4f} mm). Give them in mm"),
        (1000.0, False, f"they look like metres ({1000.0 * middle:.4f} mm). Give them in mm"),
        (2.0, True, "they look like those of the half, such as a radius. Give those of the whole"),
    ):
        if abs(value - factor * middle) <= _SAME_SIZE * value and (narrow or not needs_narrow):
            raise PretravelError(
                f"{name} {value:.3f} mm, but the limits are around {middle:.4f}: {words}",
                inputs=("size_tolerance", "nominal"),
            )


def refuse_other_nominal(
    nominal: float | None, limits: tuple[float, float], unit: str = " mm"
) -> None:
    """Refuse a nominal value that is far outside the limits: one of them is another one's.

    In mm, or in degrees.

    >>> refuse_other_nominal(20.0, (19.89, 19.95))  # d9: the nominal size is outside
    >>> refuse_other_nominal(41.0, (39.99, 40.01))
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the nominal value is 41 mm, and the limits are \
39.99 to 40.01 mm: one of them is wrong
    """
    if nominal is None:
        return
    low, high = limits
    if is_far_from_nominal(nominal, max(low, min(nominal, high))):
        raise PretravelError(
            f"the nominal value is {nominal:g}{unit}, and the limits are {low:g} to "
            f"{high:g}{unit}: one of them is wrong",
            inputs=("nominal", "size_tolerance"),
        )


def is_far_from_nominal(nominal: float, value: float) -> bool:
    """Whether a value is farther from its nominal one than deviations of drawings are. [mm]"""
    return abs(value - nominal) > max(_FAR_FROM_NOMINAL, _SHARE_OF_NOMINAL * nominal)


_WIDE, _SHARE_OF_PART = 1.0, 0.1
"""The widest deviations of ISO 2768 (class v) and the zones of drawings are smaller than one of
these. [mm], and of the size or the extent of the touches"""
_FAR_FROM_NOMINAL, _SHARE_OF_NOMINAL = 0.5, 0.01
"""The widest deviations of ISO 286, of a and c, are smaller. [mm], and of the nominal size"""
_SAME_SIZE = 0.02
"""Share of a size by which a part is off at most."""
_NARROW = 0.1
"""Limits of less than this share of their middle are those of one size."""


def decided_if_known(conformity: Conformity, feature: MeasuredFeature) -> Conformity:
    """The decision, or none where the points do not state the uncertainty of their map."""
    if feature.errors.map_is_stated:
        return conformity
    # What the map misses is form here, and nothing says how much of it.
    u = math.nan if conformity.of_touched_points else conformity.u
    return replace(conformity, u=u, probability=math.nan, verdict=ConformityVerdict.UNDECIDED)


def side_of_failure(conformity: Conformity, side: str) -> str:
    """In words, on which side a diameter is outside its tolerance, and what that means.

    Parameters
    ----------
    conformity : Conformity
        Of a diameter.
    side : str
        "inside" or "outside": where the surface is (`MeasuredFeature.side`).

    >>> small = size_conformity("diameter", 19.99, 0.001, (20.0, 20.021), 0.95)
    >>> side_of_failure(small, "inside")
    'too small by 10.0 µm, can be reworked'
    >>> side_of_failure(replace(small, value=14.0), "inside")
    'too small by 6.000 mm: check the feature, and that the tip radius was subtracted once'
    """
    if conformity.lower <= conformity.value <= conformity.upper:
        return ""
    small = conformity.value < conformity.lower
    by = conformity.lower - conformity.value if small else conformity.value - conformity.upper
    left = small == (side == "inside")
    if not side or math.isinf(by):
        return ""
    if is_far_from_nominal(conformity.lower if small else conformity.upper, conformity.value):
        return (
            f"too {'small' if small else 'large'} by {by:.3f} mm: check the feature, and that the "
            "tip radius was subtracted once"
        )
    return (
        f"too {'small' if small else 'large'} by {by * 1e3:.1f} µm, "
        f"{'can' if left else 'cannot'} be reworked"
    )
