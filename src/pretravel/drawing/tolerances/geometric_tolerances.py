"""Position, orientation, profile, run-out and coaxiality to datums: ISO 1101, with uncertainty.

Two kinds of zone. That of derived elements (centres, axes, median planes) contains a few located
places, whose errors follow from the parameters of the features. That of a surface contains its
touched points themselves. Motions that the datums leave free are those of the best fit of all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import PretravelError
from pretravel.drawing.features.measured_feature import BARE_SURFACE
from pretravel.drawing.tolerances.tolerance_frame import (
    FORM_KINDS,
    POSITION,
    PROFILE,
    RUN_OUT,
    TOTAL_RUN_OUT,
    DatumWord,
    GeometricResult,
    GeometricTolerance,
    PlacedFeature,
    stricter_verdict,
)
from pretravel.drawing.tolerances.tolerances_of_places import decided_places
from pretravel.drawing.tolerances.tolerances_of_surfaces import decided_surface
from pretravel.measurement import associate
from pretravel.surface import Part, feet_on_faces

_WIDEST, _SHARE_OF_EXTENT = 5.0, 0.1
"""Zones of drawings are smaller than one of these. [mm], and of the extent of the touches"""
_SAME_FACE = 1e-6  # of the part's size: a larger form of the nominal points is another shape
_WITH_PROJECTED_ZONE = ("cylinder", "cone")
_DERIVED = ("circle", "bore", "boss", "sphere", "cylinder", "cone", "torus", "slot")


def inspect_geometry(
    features: Sequence[PlacedFeature],
    tolerance: GeometricTolerance,
    datums: Mapping[str, PlacedFeature],
    required: float,
) -> GeometricResult:
    """Compare a feature, or a pattern of features, with a tolerance to datums.

    Parameters
    ----------
    features : sequence of PlacedFeature
        One, or the features of a pattern (ISO 5458): they have one common freedom.
    tolerance : GeometricTolerance
    datums : mapping of str to PlacedFeature
        By their letters.
    required : float
        Probability at which conformity or nonconformity is proven.

    Raises
    ------
    PretravelError
        A datum that was not measured; a nominal place that is missing; a feature that has no such
        tolerance.
    """
    groups = [_group(word, datums) for word in tolerance.datums]
    taken = [one for group in groups for one in group.features]
    for placed in features:
        if any(one.feature is placed.feature for one in taken):
            raise PretravelError(f"{placed.label} cannot be a datum of itself")
        _refuse_idle_words(placed, tolerance)
    _refuse_wide_zone(tolerance, [*features, *taken])
    for place, one in enumerate(taken):
        if any(one.feature is other.feature for other in taken[:place]):
            raise PretravelError(f"{one.label} is twice a datum of the same tolerance")
    if len(features) == 1 and tolerance.kind == POSITION and not groups:
        raise PretravelError(
            f"{features[0].label}: only a pattern can have a position without datums; give "
            "datums, or position_tolerance_mm for a position in the frame of the points"
        )
    if len(features) > 1 and tolerance.kind != POSITION:
        raise PretravelError(f"a pattern has a position, not a {tolerance.kind}")
    surfaces = [placed for placed in features if _is_surface(placed, tolerance)]
    if surfaces:
        if len(features) > 1:
            raise PretravelError(
                "a pattern consists of bores, bosses, slots or balls; "
                f"{surfaces[0].label} is a {surfaces[0].feature.kind}"
            )
        found = decided_surface(features[0], tolerance, groups, required)
    else:
        found = decided_places(features, tolerance, groups, required)
    remarks = (*found.remarks, *((tolerance.remark,) if tolerance.remark else ()))
    return replace(found, conformity=stricter_verdict(found.conformity, tolerance), remarks=remarks)


def nominal_of_part(placed: PlacedFeature, part: Part) -> PlacedFeature:
    """The nominal place that is not stated, from the faces of the part beneath the points.

    Parameters
    ----------
    placed : PlacedFeature
        In the frame of the part.
    part : Part

    Returns
    -------
    PlacedFeature
        What was stated stays. Where the faces beneath the points form no such feature, nothing is
        added.
    """
    found, kind = placed.feature.association, placed.feature.kind
    if kind == BARE_SURFACE:
        return placed
    feet = feet_on_faces(part, found.points)
    axis = feet.local.normal.mean(axis=0) if kind == "plane" else found.direction
    try:
        nominal = associate(kind, feet.local.point, axis=axis, at=placed.point)
    except PretravelError:
        return placed
    if nominal.form > _SAME_FACE * max(found.diameter or 0.0, part.size):
        return placed
    return replace(
        placed,
        point=nominal.point if placed.point is None else placed.point,
        direction=nominal.direction if placed.direction is None else placed.direction,
        size=nominal.diameter if placed.size is None else placed.size,
    )


def _group(word: str, datums: Mapping[str, PlacedFeature]) -> DatumWord:
    name, sign, _ = word.replace(" ", "").partition("(M)")
    letters = name.split("-") if name not in datums else [name]
    missing = [letter for letter in letters if letter not in datums]
    if missing:
        raise PretravelError(
            f"datum {missing[0]} is not among the measured features: {', '.join(datums)}"
        )
    return DatumWord(tuple(datums[letter] for letter in letters), bool(sign))


def _refuse_idle_words(placed: PlacedFeature, tolerance: GeometricTolerance) -> None:
    """Refuse what a frame states for other kinds of features than this one."""
    kind = placed.feature.kind
    if tolerance.between is not None and kind not in _WITH_PROJECTED_ZONE:
        raise PretravelError(
            f"{placed.label}: a projected zone (between_mm) is along an axis, and a {kind} has no "
            "measured axis: leave between_mm out, or measure a cylinder"
        )
    if tolerance.tangent and kind != "plane":
        raise PretravelError(
            f"{placed.label}: a tangent plane needs points of a plane, and this is a {kind}"
        )


def _refuse_wide_zone(tolerance: GeometricTolerance, placed: Sequence[PlacedFeature]) -> None:
    """Refuse a zone that only a number in µm can be: castings have zones of some millimetres."""
    points = np.concatenate([one.feature.points.positions for one in placed])
    extent = float(np.ptp(points, axis=0).max())
    if tolerance.zone > max(_WIDEST, _SHARE_OF_EXTENT * extent):
        raise PretravelError(
            f"the zone of {tolerance.name} is {tolerance.zone:g} mm, and the touches of feature "
            f"and datums are within {extent:.4g} mm: were {tolerance.zone:g} µm meant? Give "
            f"{0.001 * tolerance.zone:g}, in mm"
        )


def _is_surface(placed: PlacedFeature, tolerance: GeometricTolerance) -> bool:
    """Whether the touched points themselves must lie in the zone."""
    if tolerance.kind in (PROFILE, RUN_OUT, TOTAL_RUN_OUT, *FORM_KINDS):
        return True
    return placed.feature.kind in ("plane", "line") or placed.feature.kind not in _DERIVED
