"""Summaries of compensated points, which can be joined: of blocks to that of all points."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import FloatArray
from pretravel.maps import PretravelMap, tip_note
from pretravel.measurement.friction_of_part import movement_by_friction
from pretravel.measurement.gross_points import GrossPoint, gross_points
from pretravel.measurement.points import Points
from pretravel.measurement.rigid_movement import MovementSums
from pretravel.measurement.scatter_on_part import ScatterOnPart
from pretravel.touches import Touches

FRICTION_APART = 0.2
"""Difference of friction that a report looks at: ruby on steel, and on dry aluminium."""
_SOME = 500
"""Points at which the effect of friction is computed."""


@dataclass(frozen=True)
class Moments:
    """Number, range, mean and spread of values.

    Attributes
    ----------
    count : int
    low, high, mean : float
    squares : float
        Sum of the squared differences from the mean.

    >>> both = Moments.of(np.array([1.0, 3.0])).joined(Moments.of(np.array([5.0])))
    >>> both.low, both.high, both.mean, round(both.spread, 9) == round(math.sqrt(8.0 / 3.0), 9)
    (1.0, 5.0, 3.0, True)
    """

    count: int
    low: float
    high: float
    mean: float
    squares: float

    @staticmethod
    def of(values: FloatArray) -> Moments:
        """Of an array that is not empty."""
        mean = float(values.mean())
        return Moments(
            values.size,
            float(values.min()),
            float(values.max()),
            mean,
            float(np.sum((values - mean) ** 2)),
        )

    @property
    def spread(self) -> float:
        """Standard deviation, of all values as they are."""
        return math.sqrt(self.squares / self.count)

    @property
    def largest(self) -> float:
        """Largest magnitude."""
        return max(abs(self.low), abs(self.high))

    def joined(self, other: Moments) -> Moments:
        """Of both sets of values (Chan, Golub & LeVeque 1979)."""
        count = self.count + other.count
        apart = other.mean - self.mean
        return Moments(
            count,
            min(self.low, other.low),
            max(self.high, other.high),
            self.mean + apart * other.count / count,
            self.squares + other.squares + apart**2 * self.count * other.count / count,
        )

    def shifted(self, distance: float) -> Moments:
        """Of the values plus a number."""
        return replace(
            self, low=self.low + distance, high=self.high + distance, mean=self.mean + distance
        )


def _joined(one: Moments | None, other: Moments | None) -> Moments | None:
    return None if one is None or other is None else one.joined(other)


@dataclass(frozen=True)
class PointsSummary:
    """What a report states about compensated points.

    Attributes
    ----------
    pretravel, u : Moments
        Pretravel that was subtracted, and standard uncertainty along the normal. [mm]
    deviation : Moments or None
        From the nominal. [mm]
    before : Moments or None
        Deviations without compensation, by the tip radius alone; without a nominal the distances
        from the compensated points. [mm]
    """

    pretravel: Moments
    u: Moments
    deviation: Moments | None = None
    before: Moments | None = None

    @staticmethod
    def of(points: Points) -> PointsSummary:
        """Of points.

        Parameters
        ----------
        points : Points
        """
        before = None
        if points.uncompensated is not None:
            moved = np.sum((points.uncompensated - points.positions) * points.normals, axis=1)
            reached = 0.0 if points.deviation is None else points.deviation
            before = Moments.of(np.asarray(reached + moved))
        return PointsSummary(
            Moments.of(points.pretravel),
            Moments.of(points.standard_uncertainty),
            None if points.deviation is None else Moments.of(points.deviation),
            before,
        )

    def __len__(self) -> int:
        return self.pretravel.count

    def joined(self, other: PointsSummary) -> PointsSummary:
        """Of both sets of points."""
        return PointsSummary(
            self.pretravel.joined(other.pretravel),
            self.u.joined(other.u),
            _joined(self.deviation, other.deviation),
            _joined(self.before, other.before),
        )


@dataclass(frozen=True)
class TouchSummary:
    """What the warnings about a compensation depend on.

    Attributes
    ----------
    count : int
    least_closing : float
        Smallest cosine between approach and inward normal.
    feeds : pair of float or None
        Slowest and fastest. [mm/min]
    middle : float or None
        Median of the deviations; of joined summaries the mean of their medians. [mm]
    outside : int
        Normals outside the map.
    movement : MovementSums or None
        Of the deviations, from which it is seen whether the part lies elsewhere.
    gross : tuple of GrossPoint
        Points far from the nominal and from their neighbours; of joined summaries, within each.
    states_spindle : bool
        Whether the touches state the orientation of the spindle.
    other_tip : str
        A sentence where they state another tip than the map.
    scatter : ScatterOnPart
        Of repeated places and plane faces.
    by_friction : float
        Largest movement by `FRICTION_APART`, where it exceeds U of the point; zero elsewhere. [mm]
    """

    count: int
    least_closing: float
    feeds: tuple[float, float] | None = None
    middle: float | None = None
    outside: int = 0
    movement: MovementSums | None = field(default=None, compare=False)
    gross: tuple[GrossPoint, ...] = ()
    states_spindle: bool = False
    other_tip: str = ""
    scatter: ScatterOnPart = field(default_factory=ScatterOnPart, compare=False)
    by_friction: float = 0.0

    @staticmethod
    def of(touches: Touches, points: Points, pretravel_map: PretravelMap) -> TouchSummary:
        """Of touches and their points.

        Parameters
        ----------
        touches : Touches
        points : Points
        pretravel_map : PretravelMap
            As seen from the part.
        """
        feeds, deviation = touches.feeds, points.deviation
        alone = pretravel_map.repeatability**2 + pretravel_map.fixed_scatter**2
        inside = pretravel_map.support.supports(pretravel_map.probe_directions(points.normals))
        return TouchSummary(
            len(touches),
            float(touches.closing().min()),
            None if feeds is None else (float(feeds.min()), float(feeds.max())),
            None if deviation is None else float(np.median(deviation)),
            int(np.sum(~inside)),
            None
            if deviation is None
            else MovementSums.of(points.positions, points.normals, deviation),
            ()
            if deviation is None
            else gross_points(
                points.positions,
                points.normals,
                deviation,
                points.standard_uncertainty,
                touches.where,
            ),
            touches.spindle is not None,
            tip_note(touches, pretravel_map),
            (points.scatter or ScatterOnPart()).with_faces(
                points.positions,
                points.normals,
                alone * touches.closing(points.normals) ** 2,
            ),
            _beyond_u_by_friction(touches, points, pretravel_map),
        )

    def joined(self, other: TouchSummary) -> TouchSummary:
        """Of both sets of touches, of which both state the same."""
        count = self.count + other.count
        feeds = middle = movement = None
        if self.movement is not None and other.movement is not None:
            movement = self.movement.joined(other.movement)
        if self.feeds is not None and other.feeds is not None:
            feeds = min(self.feeds[0], other.feeds[0]), max(self.feeds[1], other.feeds[1])
        if self.middle is not None and other.middle is not None:
            middle = (self.count * self.middle + other.count * other.middle) / count
        return TouchSummary(
            count,
            min(self.least_closing, other.least_closing),
            feeds,
            middle,
            self.outside + other.outside,
            movement,
            self.gross + other.gross,
            self.states_spindle and other.states_spindle,
            self.other_tip or other.other_tip,
            self.scatter.joined(other.scatter),
            max(self.by_friction, other.by_friction),
        )


def _beyond_u_by_friction(touches: Touches, points: Points, pretravel_map: PretravelMap) -> float:
    """Largest movement of a point by another friction, of those that exceed U. [mm]"""
    if not pretravel_map.states_uncertainty:
        return 0.0
    some = slice(None, None, len(points) // _SOME + 1)
    moved = np.abs(
        movement_by_friction(
            pretravel_map, points.normals[some], touches.approach_directions[some], FRICTION_APART
        )
    )
    beyond = moved[moved > 2.0 * points.standard_uncertainty[some]]
    return float(beyond.max()) if len(beyond) else 0.0
