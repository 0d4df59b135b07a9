"""Compensation: touches to surface points with uncertainties; `embed` does the inverse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.base import (
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
    PretravelMap,
    as_map,
    refuse_other_orientation,
)
from pretravel.measurement.coarse_touches import with_step_of_touches
from pretravel.measurement.point_errors import PointErrors, errors_of_points
from pretravel.measurement.points import Points
from pretravel.measurement.scatter_on_part import scatter_of_repeats
from pretravel.measurement.touch_scatter import TouchScatter
from pretravel.touches import (
    Touches,
    TouchesLike,
    as_touches,
    refuse_glancing,
)

if TYPE_CHECKING:
    from pretravel.qualification import Qualification
    from pretravel.surface import LocalGeometry, Part, PartContacts, Reach, Surface


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
        map) is named by `TouchSummary.warnings`, not here.

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
        raise PretravelError("the nominal must be a surface: read_part or parse_surface makes it")
    touches = as_touches(touches)
    touches.refuse_several()
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
    PretravelError
        Positions, normals and approaches of different numbers.

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
    points = as_numbers(positions, "positions")
    if not points.shape == n.shape == a.shape:
        raise PretravelError(
            f"positions, normals and approaches have the shapes {points.shape}, {n.shape} and "
            f"{a.shape}: expected (n, 3) each, a row for a point"
        )
    refuse_glancing(a, n, lambda row: f"point {row + 1}")
    closing = -np.sum(a * n, axis=1)
    travel = pretravel_map.pretravel(n, extrapolate=extrapolate) / closing
    touches = Touches(
        positions=points + travel[:, None] * a + pretravel_map.tip_radius * n,
        normals=n,
        approaches=a,
        feeds=None if feeds is None else as_numbers(feeds, "feeds"),
    )
    if feeds is not None and pretravel_map.delay is not None:
        touches = touches.at_rest(-pretravel_map.delay)
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
