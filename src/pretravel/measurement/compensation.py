"""Compensation: touches to surface points with uncertainties; `embed` does the inverse."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    ExtrapolationError,
    FloatArray,
    IntArray,
    PretravelError,
    as_numbers,
    checked_unit,
    describe,
    frozen,
)
from pretravel.maps import (
    MapLike,
    Origin,
    PretravelMap,
    as_map,
    orientation_note,
    refuse_other_orientation,
)
from pretravel.measurement.coarse_touches import with_step_of_touches
from pretravel.measurement.gross_points import gross_points_sentence
from pretravel.measurement.point_errors import USUAL_DELAY, PointErrors, errors_of_points
from pretravel.measurement.points import Points
from pretravel.measurement.points_summary import FRICTION_APART, TouchSummary
from pretravel.measurement.scatter_on_part import scatter_of_repeats
from pretravel.measurement.touch_scatter import TouchScatter
from pretravel.qualification import Qualification
from pretravel.touches import (
    Touches,
    TouchesLike,
    as_touches,
    at_rest,
    refuse_glancing,
    refuse_several,
)

if TYPE_CHECKING:
    from pretravel.surface import LocalGeometry, Part, PartContacts, Reach, Surface

OBLIQUE = 10.0 * DEGREE
"""Approaches at a larger angle to the normal than this are warned about. [rad]"""


def apply(
    touches: TouchesLike,
    pretravel_map: MapLike,
    *,
    nominal: Surface | Part | None = None,
    extrapolate: bool = False,
    shared: bool = True,
    scatter: TouchScatter | None = None,
    u_friction: float = 0.0,
) -> Points:
    """Compensate touches: from the latched spindle points to the surface.

    Without a nominal surface the normals are those of the touches. Between first contact and
    trigger the spindle travels ``pretravel / |a·n|`` along the approach a. The point of first
    contact lies back by this travel, and by the tip radius along n. A map that contains the
    signal delay is that of the probe at rest; feed times delay is subtracted first.

    With a nominal surface the contact is determined on it: the deflected ball touches a surface
    parallel to the nominal one. The map is evaluated at the normal there, however far the tip has
    slid, and the distance of the two surfaces is the deviation.

    Parameters
    ----------
    touches : Touches, str, Path or (n, 6) float
        Touches, their file, or x, y, z of the tip centres in mm with the outward normals.
    pretravel_map : PretravelMap, Qualification, str or Path
        Predicted or measured; a qualification has one, a file contains one.
    nominal : Surface or Part, optional
        Not given: deviations are from the nominal points of the touches, where there are any.
    extrapolate : bool
        Also for normals outside the directions of the map.
    shared : bool
        The points state which errors they have in common (`Points.shared`). It takes time.
    scatter : TouchScatter, optional
        Of single touches by direction, from a separation of machine and probe, in the place of
        the repeatability of the map.
    u_friction : float
        Standard uncertainty of the difference between the coefficients of friction of part and
        reference; its effect on the points follows from the map.

    Returns
    -------
    Points
        Where positions are in coarse steps, their uncertainty contains the step
        (`with_step_of_touches`), and where repeated places scatter more than the touches of the
        map, this scatter (`ScatterOnPart`). What it does not contain (an unknown feed, a predicted
        map) is named by `compensation_warnings`, not here.

    Raises
    ------
    ExtrapolationError
        Normals that the map does not support.
    PretravelError
        Touches that do not touch the nominal surface; at another orientation of the spindle than
        the map, where both state one.

    References
    ----------
    Rodrigues 2021, equation 3.36; with a nominal surface iterated to the true contact.

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0, repeatability=3e-4)
    >>> points = apply(Touches([[0.0, 0.0, 2.990]], up), mean)
    >>> points.positions.round(9).tolist(), (points.standard_uncertainty * 1e3).round(3).tolist()
    ([[0.0, 0.0, 0.0]], [0.316])
    """
    return apply_with_errors(
        touches,
        pretravel_map,
        nominal=nominal,
        extrapolate=extrapolate,
        shared=shared,
        scatter=scatter,
        u_friction=u_friction,
    )[0]


def apply_with_errors(
    touches: TouchesLike,
    pretravel_map: MapLike,
    *,
    nominal: Surface | Part | None = None,
    extrapolate: bool = False,
    shared: bool = True,
    scatter: TouchScatter | None = None,
    u_friction: float = 0.0,
) -> tuple[Points, PointErrors]:
    """The points of `apply`, and the errors from which `point_budget` makes budgets.

    Parameters, errors: see `apply`.

    Returns
    -------
    Points
    PointErrors
    """
    if isinstance(nominal, str | Path):
        raise PretravelError("the nominal is a surface: read_part or parse_surface makes it")
    touches = as_touches(touches)
    refuse_several(touches)
    pretravel_map, _ = with_step_of_touches(as_map(pretravel_map), touches)
    refuse_other_orientation(touches, pretravel_map)
    given, touches = touches, pretravel_map.without_machine(touches)
    if nominal is not None:
        contact, deviation = _on_nominal(touches, pretravel_map, nominal)
        normals = contact.normal
        positions = contact.point + deviation[:, None] * normals
    else:
        normals, deviation = touches.normals, None
    with np.errstate(invalid="ignore"):  # a probe that does not trigger: refused below
        pretravel, u_map = pretravel_map.pretravel_and_uncertainty(normals, extrapolate=extrapolate)
    lost = np.flatnonzero(~np.isfinite(pretravel))
    if len(lost):
        raise ExtrapolationError(
            f"{touches.where(int(lost[0]))}: in the direction of its normal "
            f"({describe(normals[lost[0]])}) the probe of this map does not trigger "
            f"({len(lost)} such touches). Do the normals point out of the part?"
        )
    errors = errors_of_points(given, normals, pretravel_map, scatter, u_map, u_friction)
    if nominal is None:
        travel = pretravel / errors.closing
        positions = (
            touches.positions
            - travel[:, None] * errors.approaches
            - pretravel_map.tip_radius * normals
        )
        if touches.nominal_points is not None:
            deviation = np.sum((positions - touches.nominal_points) * normals, axis=1)
    alone, dof = errors.single_touch * errors.closing**2, pretravel_map.repeatability_dof
    seen = scatter_of_repeats(positions, normals, alone, dof)
    errors = replace(errors, known_u_map=u_map).scattering(seen)
    points = Points(
        positions=frozen(positions),
        normals=frozen(normals),
        pretravel=frozen(pretravel),
        covariance=frozen(errors.covariance),
        deviation=None if deviation is None else frozen(deviation),
        labels=touches.labels
        or tuple(map(str, range(touches.numbered_from, touches.numbered_from + len(touches)))),
        shared=errors.shared_along_normals() if shared else None,
        uncompensated=frozen(given.positions - pretravel_map.tip_radius * touches.normals),
        scatter=seen,
    )
    return points, errors


def _on_nominal(
    touches: Touches, pretravel_map: PretravelMap, nominal: Surface | Part
) -> tuple[LocalGeometry, FloatArray]:
    """Contact of each touch with a surface parallel to the nominal one, and their distance."""
    from pretravel.surface import ContactProblem, ContactSearch, Lines

    radius = pretravel_map.tip_radius
    search = ContactSearch(nominal, len(touches))
    near = touches.positions - radius * touches.normals
    curvatures = np.zeros((len(touches), 2))
    # Twice: the curvature of the part at the contact changes its compression a little.
    for _ in range(2):

        def reach_of(rows: IntArray, curvatures: FloatArray = curvatures) -> Reach:
            def reach(own: IntArray, local: LocalGeometry) -> FloatArray:
                # Steps on the way to the contact may leave the map; `apply` checks the end.
                moved = pretravel_map.tip_displacement(
                    local.normal, curvatures[rows[own]], extrapolate=True
                )
                return np.asarray(radius * local.normal - moved)

            return reach

        lines, against = Lines(touches.positions), touches.approach_directions
        search.solve(near, ContactProblem(lines, reach_of, against=against))
        found = search.contacts()
        if not np.all(found.solved):
            break
        curvatures = found.local.principal_curvatures
    lost = np.flatnonzero(~found.solved)
    if len(lost):
        beyond = int(np.sum(found.beyond_edge[lost]))
        names = ", ".join(touches.where(int(row)) for row in lost[:5])
        raise PretravelError(
            f"{len(lost)} of {len(touches)} touches do not touch the nominal surface"
            + (f" ({beyond} of them beyond its edges)" if beyond else "")
            + f": {names}{'…' if len(lost) > 5 else ''}. Is the nominal where the part is, in the "
            "touches' frame and in mm?"
        )
    _refuse_undetermined(touches, found, radius, nominal)
    return found.local, found.length


def _refuse_undetermined(
    touches: Touches, found: PartContacts, radius: float, nominal: Surface | Part
) -> None:
    """Refuse contacts near apexes and in hollows with the radius of the tip.

    At half the distances that a simulation keeps, so that a part with deviations passes too.
    """
    from pretravel.surface import (
        LEAST_PLAY,
        apexes_of,
        distance_from_apexes,
        faces_to_touch,
        play_of_ball,
    )

    tight = play_of_ball(radius, found.local.principal_curvatures) < 0.5 * LEAST_PLAY
    pointed = np.zeros(len(touches), dtype=bool)
    for index, face in faces_to_touch(nominal):
        mine = np.flatnonzero(found.face == index)
        if len(mine) and len(places := apexes_of(face)):
            pointed[mine] = distance_from_apexes(found.local.point[mine], places) < 0.5 * radius
    for which, where in (
        (tight, f"in a hollow with the radius of the tip ({radius:g} mm) or less"),
        (pointed, "at the tip of a cone, where the surface has no definite normal"),
    ):
        rows = np.flatnonzero(which)
        if len(rows):
            names = ", ".join(touches.where(int(row)) for row in rows[:5])
            raise PretravelError(
                f"{len(rows)} of {len(touches)} touches lie {where}: which point was touched is "
                f"not determined: {names}{'…' if len(rows) > 5 else ''}. Leave them out, or touch "
                "there with a smaller tip",
                inputs=("exclude",),
            )


def compensation_warnings(touches: TouchSummary, pretravel_map: PretravelMap) -> list[str]:
    """What to know before the points are used, as sentences.

    Parameters
    ----------
    touches : TouchSummary
    pretravel_map : PretravelMap

    Returns
    -------
    list of str

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0)
    >>> touches = Touches([[0.0, 0.0, 2.990]], up)
    >>> compensation_warnings(TouchSummary.of(touches, apply(touches, mean), mean), mean)
    []
    """
    warnings = []
    if touches.outside:
        warnings.append(
            f"{touches.outside} of {touches.count} normals lie outside the map: pretravel is "
            "extrapolated there, and u does not contain the error of this"
        )
    if not pretravel_map.states_uncertainty:
        warnings.append(
            "this map is a prediction without an uncertainty: u_um contains only the tip radius "
            "(and a given repeatability), not the difference between the described probe and "
            "yours"
        )
    made_at = pretravel_map.feed if pretravel_map.delay is None else None
    if made_at is not None and touches.feeds is not None:
        slowest, fastest = touches.feeds
        if not (slowest == fastest and abs(fastest / made_at - 1.0) < 0.01):
            at = f"{slowest:g}" if slowest == fastest else f"{slowest:g} to {fastest:g}"
            warnings.append(
                f"the map was made at {made_at:g} mm/min, these touches at {at}; the delay travel "
                "(feed × signal delay) changes with the feed. Qualify at the feed you measure with"
            )
    known_of_touches = touches.feeds is not None
    if _delay_is_unknown(pretravel_map) and (made_at is None) == known_of_touches:
        warnings.append(_one_unknown_feed(known_of_touches=known_of_touches))
    if touches.feeds is not None and not pretravel_map.states_uncertainty:
        warnings.append(
            f"the touches were made at {touches.feeds[1]:g} mm/min, and a predicted map "
            "contains no signal delay: feed × delay is still in the deviations"
        )
    obliqueness = math.acos(min(touches.least_closing, 1.0))
    if obliqueness > OBLIQUE and pretravel_map.repeatability > 0.0 and pretravel_map.delay is None:
        warnings.append(
            f"approaches are up to {obliqueness / DEGREE:.0f}° off the normal: a "
            "signal delay adds its travel along the approach, but a qualified map contains it as "
            "pretravel; at 45° and 12 µm of delay travel the error is 3.5 µm. Probe along the "
            "normal, or qualify at two feeds, which separates the delay"
        )
    if touches.middle is not None and abs(touches.middle) > 0.2 * pretravel_map.tip_radius:
        warnings.append(
            f"deviations are about {touches.middle:+.3f} mm, of the size of the tip radius "
            f"({pretravel_map.tip_radius:g} mm): are the readings tip-centre positions in "
            "mm, do the normals point out of the part, is the nominal where the part is?"
        )
    elsewhere = "" if touches.movement is None else touches.movement.sentence()
    stated = (touches.other_tip, elsewhere, gross_points_sentence(touches.gross))
    return [*warnings, *touches.scatter.sentences(), *(said for said in stated if said)]


def conditions_notes(touches: TouchSummary, pretravel_map: PretravelMap) -> list[str]:
    """What holds where nobody states feed or orientation, for the report.

    Parameters
    ----------
    touches : TouchSummary
    pretravel_map : PretravelMap

    Returns
    -------
    list of str
        Empty where both are stated, or do not matter.
    """
    fed, turned = feed_note(touches, pretravel_map), ""
    if pretravel_map.provenance.origin is Origin.QUALIFIED:
        turned = orientation_note(pretravel_map, stated=touches.states_spindle)
    if fed and turned:  # one note, as they have one cause
        fed, turned = f"{fed}. {turned[0].upper()}{turned[1:]}", ""
    notes = fed, turned, friction_note(touches)
    return [note for note in notes if note]


def feed_note(touches: TouchSummary, pretravel_map: PretravelMap) -> str:
    """What holds where nobody states a feed: for the report, as nearly everybody reads it.

    Parameters
    ----------
    touches : TouchSummary
    pretravel_map : PretravelMap

    Returns
    -------
    str
        Empty where a feed is stated, or none matters.
    """
    stated = touches.feeds is not None or pretravel_map.feed is not None
    if stated or not _delay_is_unknown(pretravel_map):
        return ""
    return (
        "neither the map nor the touches have a feed (column feed_mm_min): feeds that differ by "
        "100 mm/min cause errors of 3.3 µm (if the signal delay is 2 ms, a usual value) that are "
        "not in U"
    )


def friction_note(touches: TouchSummary) -> str:
    """What a friction of the part unlike that of the reference would do, where that exceeds U.

    Parameters
    ----------
    touches : TouchSummary

    Returns
    -------
    str
    """
    if touches.by_friction <= 0.0:
        return ""
    return (
        f"a coefficient of friction of the part {FRICTION_APART:g} larger than that of the "
        f"reference moves inclined points by up to {touches.by_friction / MICROMETRE:.1f} µm, more "
        "than their U, which does not contain it: give its uncertainty (u_friction, 0.1 for "
        "another metal)"
    )


def _delay_is_unknown(pretravel_map: PretravelMap) -> bool:
    """Whether a qualified map contains the delay travel of its own feed."""
    qualified = pretravel_map.provenance.origin is Origin.QUALIFIED
    return qualified and pretravel_map.delay is None


def _one_unknown_feed(*, known_of_touches: bool) -> str:
    known, unknown = ("touches", "map") if known_of_touches else ("map", "touches")
    return (
        f"the {known} {'has' if known == 'map' else 'have'} a feed, the {unknown} "
        f"do{'es' if unknown == 'map' else ''} not (column feed_mm_min): if the feeds differ, the "
        "points are wrong by the difference × signal delay; u contains the feed that is known × "
        f"{USUAL_DELAY * 1e3:g} ms. "
        + (
            "Qualify again and give the feed of the touches on the reference"
            if unknown == "map"
            else "Give the feed of these touches"
        )
    )


def embed(
    positions: npt.ArrayLike,
    normals: npt.ArrayLike,
    pretravel_map: MapLike,
    *,
    approaches: npt.ArrayLike | None = None,
    feeds: npt.ArrayLike | None = None,
    extrapolate: bool = False,
) -> Touches:
    """Compute the touches that a probe with this map would report at given surface points.

    The inverse of `apply`.

    Parameters
    ----------
    positions : (n, 3) float
        Points of the surface. [mm]
    normals : (n, 3) float
        Outward unit normals there.
    pretravel_map : PretravelMap
    approaches : (n, 3) float, optional
        -normals when not given.
    feeds : (n,) float, optional
        Of the touches; their delay travel is added where the map contains the delay. At rest when
        not given. [mm/min]
    extrapolate : bool

    Returns
    -------
    Touches

    Raises
    ------
    ExtrapolationError
        Normals that the map does not support.

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([0.0]),
    ...                     DirectionSupport(up), tip_radius=3.0)
    >>> embed([[0.0, 0.0, 0.0]], up, mean).positions.round(9).tolist()
    [[0.0, 0.0, 2.99]]
    """
    pretravel_map = as_map(pretravel_map)
    n = checked_unit(normals, "normals")
    a = -n if approaches is None else checked_unit(approaches, "approaches")
    refuse_glancing(a, n, lambda row: f"point {row + 1}")
    closing = -np.sum(a * n, axis=1)
    travel = pretravel_map.pretravel(n, extrapolate=extrapolate) / closing
    points = as_numbers(positions, "positions")
    touches = Touches(
        positions=points + travel[:, None] * a + pretravel_map.tip_radius * n,
        normals=n,
        approaches=a,
        feeds=None if feeds is None else as_numbers(feeds, "feeds"),
    )
    if feeds is not None and pretravel_map.delay is not None:
        touches = at_rest(touches, -pretravel_map.delay)
    machine = pretravel_map.machine
    return touches if machine is None else machine.taken_off(touches, sign=-1.0)


def distances_from_reference(
    fitted: Qualification, touches: Touches
) -> tuple[FloatArray, FloatArray]:
    """Distances of compensated touches from the sphere (or ring) that a qualification found.

    Parameters
    ----------
    fitted : Qualification
    touches : Touches
        On the same reference.

    Returns
    -------
    distance : (n,) float
        From the reference's surface, away from its centre. [mm]
    standard_uncertainty : (n,) float
        That compensation states. [mm]
    """
    points = apply(touches, fitted.pretravel_map, extrapolate=True)
    offset = points.positions - fitted.center
    if fitted.setup.ring:
        axis = fitted.pretravel_map.rotation[:, 2]
        offset = offset - (offset @ axis)[:, None] * axis
    distance = np.linalg.norm(offset, axis=1) - 0.5 * fitted.setup.diameter
    return distance, points.standard_uncertainty
