"""The errors of compensated points: one model, as covariances and as a budget."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pretravel.base import (
    U_OF_FRICTION,
    USUAL_DELAY,
    FloatArray,
    IntArray,
    checked,
    delay_travel,
    frozen,
)
from pretravel.maps import PretravelMap
from pretravel.measurement.friction_of_part import movement_by_friction
from pretravel.measurement.points import FIXED_SCATTER, Points
from pretravel.measurement.scatter_on_part import ScatterOnPart
from pretravel.measurement.touch_scatter import MACHINE_PART, PROBE_PART, TouchScatter
from pretravel.touches import Touches
from pretravel.uncertainty import Budget, Component, Correlation, Covariance

REPEATABILITY = "repeatability"
MACHINE_GEOMETRY = "geometry of the machine"
"""Of its scales, squarenesses and backlashes."""
FRICTION_OF_PART = "friction of the part"
SIGNAL_DELAY = "signal delay"
FEED_NOT_KNOWN = "feed that is not known"
"""Signal delay times the difference of two feeds, of which one is not stated."""
_LEFT_TO_OWN = 0.02  # share of a point's variance that the factors of a map may leave out
_BLOCK = 4096  # points whose map is evaluated at a time
_FACTORS = 16  # of a map, decomposed at a time: often a few are enough
_MOST_FACTOR_VALUES = 20_000_000  # numbers of touches times coefficients that are decomposed


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Sources of error of compensated points, and the directions in which they move a point.

    Repeatability, the map and the signal delay move a point along its approach, the map by its
    error over the cosine of the obliqueness, because an oblique approach travels further. The tip
    radius moves a point along its normal. Terms of the machine move the spindle point, and the map
    that was made with them. Map and delay come from the same touches: the error of a
    longer delay in the map and its travel cancel in part, and are one source.

    Attributes
    ----------
    pretravel_map : PretravelMap
    normals, approaches : (n, 3) float
        Unit vectors, machine frame.
    closing : (n,) float
        Cosine between approach and inward normal.
    by_delay : (n,) float
        Change of the map's pretravel for a delay longer by one standard uncertainty. [mm]
    delay_along_approach : (n,) float
        Movement of each point for a delay longer by one standard uncertainty. [mm]
    separated : mapping of str to (n,) float
        Variance of each touch along its approach, in the parts of machine and probe, where a
        separation takes the place of the map's repeatability. [mm²]
    by_machine : (n, 3, t) float, or (1, 3, 0)
        Movement of each point for each error of the terms of the machine. [mm]
    known_u_map : (n,) float, optional
        `u_map`, where it was computed with the points. [mm]
    by_friction : (n,) float, or (1,)
        Movement of each point along its approach for a friction of the part that is larger by one
        standard uncertainty. [mm]
    source_of_delay : str
        Name of the source of `delay_along_approach`.
    """

    pretravel_map: PretravelMap
    normals: FloatArray
    approaches: FloatArray
    closing: FloatArray
    by_delay: FloatArray
    delay_along_approach: FloatArray
    separated: Mapping[str, FloatArray] = field(default_factory=dict)
    by_machine: FloatArray = field(default_factory=lambda: np.zeros((1, 3, 0)))
    known_u_map: FloatArray | None = None
    by_friction: FloatArray = field(default_factory=lambda: np.zeros(1))
    source_of_delay: str = SIGNAL_DELAY

    @cached_property
    def u_map(self) -> FloatArray:
        """Standard uncertainty of the map along the normals, (n,). [mm]"""
        if self.known_u_map is not None:
            return self.known_u_map
        return self.pretravel_map.standard_uncertainty(self.normals)

    def at(self, rows: IntArray) -> PointErrors:
        """Of some of the points, (k,) rows."""
        return replace(
            self,
            normals=self.normals[rows],
            approaches=self.approaches[rows],
            closing=self.closing[rows],
            by_delay=self.by_delay[rows],
            delay_along_approach=self.delay_along_approach[rows],
            by_machine=self.by_machine[rows] if self.by_machine.size else self.by_machine,
            separated={name: variance[rows] for name, variance in self.separated.items()},
            known_u_map=self.u_map[rows],
            by_friction=self.by_friction[rows] if self.by_friction.any() else self.by_friction,
        )

    def scattering(self, seen: ScatterOnPart) -> PointErrors:
        """With the scatter of repeated places of the part, where it is larger."""
        if seen.larger is None:
            return self
        if self.separated:
            more = seen.larger.squares / seen.larger.expected
            by_source = {name: more * variance for name, variance in self.separated.items()}
            return replace(self, separated=by_source)
        own = seen.larger.deviation**2 - self.pretravel_map.fixed_scatter**2
        wider = replace(
            self.pretravel_map,
            repeatability=math.sqrt(max(own, self.pretravel_map.repeatability**2)),
            repeatability_dof=seen.larger.dof,
        )
        return replace(self, pretravel_map=wider)

    @property
    def of_touches(self) -> Mapping[str, FloatArray]:
        """Variance of each touch along its approach, by source, without fixed scatter. [mm²]"""
        own = np.full(len(self.closing), self.pretravel_map.repeatability**2)
        return self.separated or {REPEATABILITY: own}

    @property
    def single_touch(self) -> FloatArray:
        """Variance of each touch about the map, along its approach, (n,). [mm²]"""
        own = np.sum(list(self.of_touches.values()), axis=0)
        return np.asarray(own + self.pretravel_map.fixed_scatter**2)

    @property
    def of_others_in_map(self) -> FloatArray:
        """Variance of the map by delay and machine, which are sources of their own, (n,). [mm²]"""
        machine = self.pretravel_map.change_by_machine(self.normals)
        return np.asarray(self.by_delay**2 + np.sum(machine**2, axis=1))

    @property
    def machine_along_normals(self) -> FloatArray:
        """Movement of each point along its normal by the errors of the machine, (n, t). [mm]"""
        return np.asarray(np.sum(self.normals[:, :, None] * self.by_machine, axis=1))

    @property
    def _delay_matters(self) -> bool:
        return self.pretravel_map.delay is not None or bool(self.delay_along_approach.any())

    @property
    def of_map(self) -> FloatArray:
        """Variance of the map along the normals, without delay and machine, (n,). [mm²]"""
        return np.maximum(self.u_map**2 - self.of_others_in_map, 0.0)

    @property
    def covariance(self) -> FloatArray:
        """Covariance of each point alone, (n, 3, 3). [mm²]"""
        a, n = self.approaches, self.normals
        along = self.single_touch + self.of_map / self.closing**2 + self.delay_along_approach**2
        along = along + self.by_friction**2
        found = along[:, None, None] * (a[:, :, None] * a[:, None, :])
        found += self.pretravel_map.u_tip_radius**2 * (n[:, :, None] * n[:, None, :])
        found += self.by_machine @ self.by_machine.transpose(0, 2, 1)
        return np.asarray(found)

    def along_normals(self) -> dict[str, Covariance]:
        """Covariance of all points along their normals, source by source. [mm²]"""
        count = len(self.closing)
        of_map = self.pretravel_map.value_covariance(self.normals)
        by_machine = self.pretravel_map.change_by_machine(self.normals)
        of_map = of_map - np.outer(self.by_delay, self.by_delay) - by_machine @ by_machine.T
        sources = {
            REPEATABILITY: Covariance.independent(self.single_touch * self.closing**2),
            "map": Covariance(Correlation.FULL, of_map),
            "tip radius": Covariance.fully_shared(
                np.full(count, self.pretravel_map.u_tip_radius**2)
            ),
        }
        if self._delay_matters:
            moved = self.delay_along_approach * self.closing
            sources[self.source_of_delay] = Covariance(Correlation.FULL, np.outer(moved, moved))
        if self.by_friction.any():
            moved = self.by_friction * self.closing
            sources[FRICTION_OF_PART] = Covariance(Correlation.FULL, np.outer(moved, moved))
        if self.by_machine.size:
            moved = self.machine_along_normals
            sources[MACHINE_GEOMETRY] = Covariance(Correlation.FULL, moved @ moved.T)
        return sources

    @cached_property
    def variances_along_normals(self) -> Mapping[str, FloatArray]:
        """The variance of each point along its normal, (n,), source by source. [mm²]

        Their sum is the square of `Points.standard_uncertainty`. A source that the map does not
        state is zero.
        """
        made, closing = self.pretravel_map, self.closing
        machine = np.sum(self.machine_along_normals**2, axis=1)
        rubbed = self.by_friction
        return {
            **{name: own * closing**2 for name, own in self.of_touches.items()},
            FIXED_SCATTER: (made.fixed_scatter * closing) ** 2,
            "map": self.of_map,
            "tip radius": np.full(len(closing), made.u_tip_radius**2),
            self.source_of_delay: (self.delay_along_approach * closing) ** 2,
            **({FRICTION_OF_PART: (rubbed * closing) ** 2} if rubbed.any() else {}),
            **({MACHINE_GEOMETRY: machine} if self.by_machine.size else {}),
        }

    def budget(self, row: int | None = None) -> Budget:
        """The budget of a compensated point along its normal.

        Parameters
        ----------
        row : int, optional
            Of the point; not given: the root mean square over all points, in which the shares of
            the sources are those of their mean variances.

        Returns
        -------
        Budget
            In mm, without sources that are zero at all these points.

        >>> from pretravel.maps.kinds.mean import MeanBasis
        >>> from pretravel.maps.support import DirectionSupport
        >>> up = [[0.0, 0.0, 1.0]]
        >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([9e-8]),
        ...                     DirectionSupport(up), tip_radius=3.0, repeatability=4e-4)
        >>> touches = Touches([[0.0, 0.0, 2.990]], up)
        >>> budget = errors_of_points(touches, touches.normals, mean).budget()
        >>> round(budget.combined * 1e3, 9), [component.name for component in budget.components]
        (0.5, ['repeatability', 'map'])
        """
        rows = slice(None) if row is None else slice(row, row + 1)
        variances = {
            name: float(np.mean(variance[rows]))
            for name, variance in self.variances_along_normals.items()
        }
        which = f"rms of {len(self.closing)} points" if row is None else f"point {row + 1}"
        return budget_of_variances(variances, self.pretravel_map.repeatability_dof, which)

    def shared_along_normals(self) -> dict[str, FloatArray] | None:
        """The errors that points have in common, as factors; see `Points.shared`.

        The factors of the map are the principal components of its errors at these points. Those
        that make up less than a fiftieth of every point's variance are left out: `measure` takes
        the rest of a point's variance for an error of its own. None where a map of very many
        numbers and very many touches would need too much memory.
        """
        shared: dict[str, FloatArray] = {}
        if self.pretravel_map.u_tip_radius > 0.0:
            radius = np.full(len(self.closing), self.pretravel_map.u_tip_radius)
            shared["tip radius"] = frozen(radius)
        if self.pretravel_map.fixed_scatter > 0.0:
            shared[FIXED_SCATTER] = frozen(self.pretravel_map.fixed_scatter * self.closing)
        if self.delay_along_approach.any():
            shared[self.source_of_delay] = frozen(self.delay_along_approach * self.closing)
        if self.by_friction.any():
            shared[FRICTION_OF_PART] = frozen(self.by_friction * self.closing)
        for number, moved in enumerate(self.machine_along_normals.T, start=1):
            shared[f"{MACHINE_GEOMETRY} {number}"] = frozen(moved)
        if not self.pretravel_map.states_uncertainty:
            return shared
        covariance = self.pretravel_map.covariance
        if len(self.closing) * len(covariance) > _MOST_FACTOR_VALUES:
            return None
        directions, basis = (
            self.pretravel_map.probe_directions(self.normals),
            self.pretravel_map.basis,
        )
        design = np.empty((len(directions), covariance.root.shape[1]))
        left = np.empty(len(directions))
        for start in range(0, len(directions), _BLOCK):  # a block of functions fits in the cache
            part = slice(start, start + _BLOCK)
            design[part] = basis.design(directions[part]) @ covariance.root
            left[part] = np.sum(design[part] ** 2, axis=1)
        own = np.sum(list(self.of_touches.values()), axis=0) * self.closing**2
        may_be_left = _LEFT_TO_OWN * (own + sum(part**2 for part in shared.values()) + left)
        # Axes of the numbers of the map, which are fewer than the points; the largest first.
        axes = np.linalg.eigh(design.T @ design)[1].T[::-1]
        found: dict[str, FloatArray] = {}
        for first in range(0, len(axes), _FACTORS):
            for factor in axes[first : first + _FACTORS] @ design.T:  # each beside itself in memory
                # One at least: without any, the map would seem to state no uncertainty.
                if found and not np.any(left > may_be_left):
                    return shared | found
                left -= factor**2
                found[f"map {len(found) + 1}"] = frozen(factor)
        return shared | found


_SAME_FEED = 0.01  # relative
_TO_UNKNOWN_FEED = 2.0
"""Largest difference to a feed within a factor of three of the known one, in known feeds."""


def budget_of_variances(variances: Mapping[str, float], dof: float, which: str) -> Budget:
    """The budget of points from the mean variance by each source.

    Parameters
    ----------
    variances : mapping of str to float
        [mm²]
    dof : float
        Degrees of freedom of the repeatability; 0 where they are not known.
    which : str
        The points, for the title.

    Returns
    -------
    Budget
        In mm, without sources that are zero.

    >>> budget_of_variances({"repeatability": 1.6e-7, "map": 9e-8}, 24.0, "point 1").combined
    0.0005
    """
    components = tuple(
        Component(
            name,
            "A" if name in (REPEATABILITY, MACHINE_PART, PROBE_PART) else "B",
            math.sqrt(variance),
            dof=dof if name == REPEATABILITY and dof > 0.0 else math.inf,
        )
        for name, variance in variances.items()
        if variance > 0.0
    )
    return Budget(components, f"a point along its normal, {which}")


def unknown_delay_travel(touches: Touches, pretravel_map: PretravelMap) -> FloatArray:
    """Standard uncertainty of the delay travel that a map without a signal delay does not contain.

    Parameters
    ----------
    touches : Touches
    pretravel_map : PretravelMap
        Qualified, without a signal delay.

    Returns
    -------
    (n,) float
        `USUAL_DELAY` times the difference between the feeds of touch and map. Where one of the two
        is not stated, it lies within a factor of three of the other: times twice the one that is;
        zero where neither is stated. [mm]

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0, feed=60.0)
    >>> touches = Touches([[0.0, 0.0, 2.990]], up, feeds=[360.0])
    >>> unknown_delay_travel(touches, mean).round(6).tolist()
    [0.01]
    """
    made_at, feeds = pretravel_map.feed, touches.feeds
    if not pretravel_map.states_uncertainty or (made_at is None and feeds is None):
        return np.zeros(len(touches))
    if made_at is None or feeds is None:
        known = np.asarray(feeds) if made_at is None else np.full(len(touches), made_at)
        return np.asarray(delay_travel(_TO_UNKNOWN_FEED * known, USUAL_DELAY))
    apart = np.abs(np.asarray(feeds) - made_at)
    return np.asarray(delay_travel(np.where(apart > _SAME_FEED * made_at, apart, 0.0), USUAL_DELAY))


def errors_of_points(
    touches: Touches,
    normals: FloatArray,
    pretravel_map: PretravelMap,
    scatter: TouchScatter | None = None,
    u_map: FloatArray | None = None,
    u_friction: float = 0.0,
) -> PointErrors:
    """The sources of error of touches that are compensated with a map.

    Parameters
    ----------
    touches : Touches
    normals : (n, 3) float
        That the compensation used.
    pretravel_map : PretravelMap
    scatter : TouchScatter, optional
        Of single touches by direction, in the place of the map's repeatability.
    u_map : (n,) float, optional
        Standard uncertainty of the map along the normals, where it is known already. [mm]
    u_friction : float
        Standard uncertainty of the difference between the coefficients of friction of part and
        reference.

    Raises
    ------
    PretravelError
        `u_friction` is negative, not finite, or above 1.
    """
    u_friction = checked(u_friction, "u of the friction of the part", U_OF_FRICTION)
    closing = touches.closing(normals)
    by_delay = pretravel_map.change_by_delay(normals)
    moved, source = by_delay / closing, SIGNAL_DELAY
    if pretravel_map.delay is None:
        moved = moved + unknown_delay_travel(touches, pretravel_map)
        if moved.any() and (pretravel_map.feed is None or touches.feeds is None):
            source = FEED_NOT_KNOWN
    else:
        moved = moved + delay_travel(np.asarray(touches.feeds), pretravel_map.u_delay)
    machine = np.zeros((1, 3, 0))
    if pretravel_map.machine is not None:
        in_travel = pretravel_map.change_by_machine(normals) / closing[:, None]
        machine = pretravel_map.machine.errors_of(touches)
        machine = machine - touches.approach_directions[:, :, None] * in_travel[:, None, :]
    parts = () if scatter is None else scatter.variances(normals, pretravel_map)
    rubbed = np.zeros(1)
    if u_friction > 0.0:
        approaches = touches.approach_directions
        rubbed = movement_by_friction(pretravel_map, normals, approaches, u_friction) / closing
    return PointErrors(
        pretravel_map,
        normals,
        touches.approach_directions,
        closing,
        by_delay,
        moved,
        dict(zip((MACHINE_PART, PROBE_PART), parts, strict=False)),
        machine,
        u_map,
        rubbed,
        source,
    )


def point_sources(
    touches: Touches, points: Points, pretravel_map: PretravelMap
) -> dict[str, Covariance]:
    """Compute the errors of points along their normals by source, with their correlation.

    Parameters
    ----------
    touches : Touches
    points : Points
        The same touches, compensated with the map.
    pretravel_map : PretravelMap

    Returns
    -------
    dict of str to Covariance
        repeatability (independent), map, tip radius and, where the map contains it, signal delay
        (common to all points). Their sum has `Points.standard_uncertainty` squared on its
        diagonal. [mm²]

    >>> from pretravel.measurement.compensation import apply
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0, repeatability=3e-4)
    >>> touches = Touches([[0.0, 0.0, 2.990]], up)
    >>> sorted(point_sources(touches, apply(touches, mean), mean))
    ['map', 'repeatability', 'tip radius']
    """
    errors = errors_of_points(touches, points.normals, pretravel_map)
    return (errors if points.scatter is None else errors.scattering(points.scatter)).along_normals()


def total_covariance(sources: Mapping[str, Covariance]) -> Covariance:
    """The covariance of all sources together. [mm²]"""
    return Covariance(Correlation.FULL, np.asarray(sum(part.matrix for part in sources.values())))
