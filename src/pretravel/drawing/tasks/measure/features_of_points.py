"""Points of one label as a feature, inspected by what a task asks for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import MICROMETRE, ConvergenceError, PretravelError
from pretravel.drawing.features.measured_feature import (
    BARE_SURFACE,
    MeasuredFeature,
    measure_feature,
)
from pretravel.drawing.tasks.measure.settings_of_features import BY_LABEL, StatedSettings
from pretravel.drawing.tolerances.compared_with_drawing import far_from_places, other_axes
from pretravel.drawing.tolerances.tolerances import InspectedFeature, inspect_feature
from pretravel.files import first_few
from pretravel.measurement import FEED_NOT_KNOWN, Points, named_feature, normals_of_feature
from pretravel.touches import label_prefix

if TYPE_CHECKING:
    from pretravel.drawing.tolerances.features_file import DrawnFeature

_AT_POINT = 1.0
"""Of a target that is a point or a line: a touch farther away is another place. [mm]"""
_FEWEST_ON_LINE = 2
_SMALLEST_TIP = 0.5
"""A diameter of surface points is closer to its nominal. [mm]"""


def kinds_of(label: str, task: StatedSettings) -> tuple[str, ...]:
    """The feature of points with a label; a bore or boss may be touched at several heights."""
    if task.feature != BY_LABEL:
        return (str(task.feature),)
    kind = str(named_feature(label))
    return (kind, "cylinder") if kind in ("bore", "boss") else (kind,)


def with_names_of_features(chosen: Mapping[str, Points]) -> tuple[dict[str, Points], list[str]]:
    """The groups whose labels name a feature, and what is said of the others."""
    named = {label: mine for label, mine in chosen.items() if named_feature(label)}
    if not named:
        raise PretravelError(
            f"no label begins with a feature: {', '.join(chosen)}. Give the feature, or choose "
            "points by their labels",
            inputs=("feature", "select"),
        )
    others = [label for label in chosen if label not in named]
    said = [
        f"not measured, because these labels begin with no kind of feature: {', '.join(others)}"
    ]
    return named, said if others else []


def refuse_one_place_for_many(task: StatedSettings, names: Sequence[str]) -> None:
    """Refuse a nominal position that would be that of several features."""
    if task.at is not None and len(names) > 1:
        raise PretravelError(
            f"a nominal position is that of one feature, and there are {len(names)}: "
            f"{', '.join(names)}. Measure them one at a time",
            inputs=("at", "select"),
        )


def nominals_of(
    found: Sequence[InspectedFeature], task: StatedSettings, size: float | None = None
) -> dict[tuple[str, str], float]:
    """The nominal sizes and coordinates that a task (or a drawing) states, by quantity."""
    stated = {}
    size = task.nominal if size is None else size
    for each in found:
        label = each.feature.label
        if size is not None:
            stated[label, each.feature.size_name] = size
        if task.at is not None:
            stated |= {(label, axis): at for axis, at in zip("xyz", task.at, strict=True)}
    return stated


def of_no_feature(points: Points, used: Sequence[Points]) -> list[str]:
    """Which points no feature of a drawing has chosen."""
    taken = {place.tobytes() for each in used for place in each.positions}
    rest = [
        label_prefix(label) or label
        for label, place in zip(points.labels, points.positions, strict=True)
        if place.tobytes() not in taken
    ]
    if not rest:
        return []
    names = first_few(dict.fromkeys(rest))
    return [f"{len(rest)} of {len(points)} points belong to no feature of the drawing: {names}"]


def off_the_drawing(
    found: Mapping[str, InspectedFeature], tasks: Mapping[str, StatedSettings]
) -> list[str]:
    """Which features lie, or are directed, otherwise than the drawing states them."""
    features = {name: own.feature for name, own in found.items()}
    said = far_from_places(features, {name: tasks[name].at for name in features})
    return said + other_axes(features, {name: tasks[name].axis for name in features})


def inspected(label: str, points: Points, task: StatedSettings) -> InspectedFeature:
    """One feature, inspected."""
    try:
        if task.feature != BY_LABEL:
            feature = _feature(label, points, task.feature or BARE_SURFACE, task)
            return inspect_feature(feature, task.tolerances())
        feature = _feature_of_label(label, points, task)
        tolerances = task.tolerances()
        if feature.size_name not in [each.name for each in feature.quantities]:
            tolerances = replace(tolerances, size=None)  # a plane among bores has no size
        return inspect_feature(feature, tolerances)
    except PretravelError as error:
        if not label:
            raise _with_choice(error, len(points)) from None
        raise PretravelError(f"{label}: {error}", inputs=error.inputs) from None


def points_at_targets(points: Points, row: DrawnFeature) -> Points:
    """The touches of a datum at its targets: in areas, along lines, the one nearest to each point.

    Raises
    ------
    PretravelError
        A target without a touch, a line with one alone.
    """
    chosen: set[int] = set()
    for number, (x, y, z, diameter) in enumerate(row.targets, start=1):
        away = np.linalg.norm(points.positions - [x, y, z], axis=1)
        within = max(0.5 * diameter, _AT_POINT)
        here = np.flatnonzero(away <= within) if diameter else [int(away.argmin())]
        if not len(here) or float(away[here].min()) > within:
            raise PretravelError(
                f"no touch is at its target {number}, within {within:g} mm of x {x:g}, y {y:g}, "
                f"z {z:g}: the nearest is {float(away.min()):.3g} mm away"
            )
        chosen |= set(map(int, here))
    for number, (x, y, z, *end) in enumerate(row.target_lines, start=1):
        along = np.array(end) - [x, y, z]
        share = np.clip((points.positions - [x, y, z]) @ along / max(along @ along, 1e-12), 0, 1)
        away = np.linalg.norm(points.positions - [x, y, z] - share[:, None] * along, axis=1)
        here = np.flatnonzero(away <= _AT_POINT)
        if len(here) < _FEWEST_ON_LINE:
            raise PretravelError(
                f"{len(here)} touches are on its target line {number}, within {_AT_POINT:g} mm, "
                f"from x {x:g}, y {y:g}, z {z:g}: a line needs two, the nearest touch is "
                f"{float(away.min()):.3g} mm away"
            )
        chosen |= set(map(int, here))
    return points[sorted(chosen)]


def _feature(label: str, points: Points, kind: str, task: StatedSettings) -> MeasuredFeature:
    made = measure_feature(
        _surface_points(points, kind, task.tip_diameter),
        kind,
        axis=task.axis,
        at=task.at,
        u_machine=task.u_machine_um * MICROMETRE,
        label=label,
        association=task.association,
    )
    if task.tip_diameter is None and not points.state_uncertainty:
        _refuse_tip_centres(made, task)
    return made


def _surface_points(points: Points, kind: str, tip_diameter: float | None) -> Points:
    """Tip centres of a bore, boss or sphere moved to its surface; other points as they are."""
    if tip_diameter is None:
        return points
    normals = normals_of_feature(kind, points.positions, None)
    return replace(points, positions=points.positions - 0.5 * tip_diameter * normals)


def _refuse_tip_centres(made: MeasuredFeature, task: StatedSettings) -> None:
    """Refuse a diameter that is off its nominal by the size of a tip."""
    limits = task.tolerances().size
    size = task.nominal
    if size is None and limits is not None and math.isfinite(limits[0] + limits[1]):
        size = 0.5 * (limits[0] + limits[1])
    found = next((q.value for q in made.quantities if q.name == made.size_name), None)
    if size is None or found is None or abs(found - size) < _SMALLEST_TIP:
        return
    raise PretravelError(
        f"the {made.size_name} {found:.4f} mm is {abs(found - size):.3f} mm from its nominal "
        f"{size:g} mm. If the points are tip centres, give the tip's diameter; else check the "
        "nominal",
        inputs=("tip_diameter", "nominal"),
    )


def _feature_of_label(label: str, points: Points, task: StatedSettings) -> MeasuredFeature:
    """The feature that the label names; a bore or boss at several heights is a cylinder."""
    kind = str(named_feature(label))
    try:
        return _feature(label, points, kind, task)
    except PretravelError as error:
        if kind not in ("bore", "boss") or error.inputs != ("axis",):
            raise
        return _feature(label, points, "cylinder", task)


def _with_choice(error: PretravelError, count: int) -> PretravelError:
    """The fault of a feature of all points: those of other features may be among them."""
    if not (isinstance(error, ConvergenceError) or error.inputs == ("axis",)):
        return error
    return PretravelError(
        f"{error}. All {count} points of the file were used: if the file has several features, "
        "select the points of one by their labels",
        inputs=(*error.inputs, "select"),
    )


def other_maps(points: Points, path: Path) -> tuple[str, ...]:
    """Whether points are of several maps, or of one that has changed in the folder of the points.

    Parameters
    ----------
    points : Points
    path : Path
        Their file.

    Returns
    -------
    tuple of str
        Sentences about it.
    """
    from pretravel.files import MAPS_APART, word_of_map_file

    several = points.map_used.split(MAPS_APART)
    if len(several) > 1:
        told = f"the points were compensated with {len(several)} maps: {points.map_used}"
        return (f"{told}. Which errors these have in common is not known",)
    name = points.map_used.rpartition(" ")[0]
    beside = path.parent / name
    if not name or not beside.is_file():
        return ()
    try:
        now = word_of_map_file(beside)
    except PretravelError:
        return ()
    if now == points.map_used:
        return ()
    was, is_now = (word.rpartition(" ")[2] for word in (points.map_used, now))
    changed = f"{name} has changed since the points were compensated with it ({was}, now {is_now})"
    return (f"{changed}: compensate again, if the new map is that of these touches",)


def not_in_u(points: Points) -> tuple[str, ...]:
    """What a verdict must not pass over: touches of several files, a feed that is not known.

    >>> at, word = np.zeros((1, 3)), ("1",)
    >>> not_in_u(Points(at, at + [0.0, 0.0, 1.0], np.zeros(1), np.eye(3)[None], None, word))
    ()
    """
    said = []
    if points.files:
        said.append(
            f"the touches are of several files, {points.files}: distances and positions across "
            "these files hold only if the part was not moved or clamped again in between; U does "
            "not contain that"
        )
    if FEED_NOT_KNOWN in (points.shared or {}):
        moved = float(np.max(np.abs((points.shared or {})[FEED_NOT_KNOWN]))) / MICROMETRE
        said.append(
            "the feed of the map or of the touches on the part is not known: all sizes may be "
            "wrong by the difference of the feeds × signal delay. u of a point contains "
            f"{moved:.1f} µm for this. Before you rework or scrap, compensate again with the feed"
        )
    return tuple(said)
