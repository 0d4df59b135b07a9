"""Summaries of compensated points, which can be joined: of blocks to that of all points."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, USUAL_DELAY, FloatArray, range_text
from pretravel.maps import Origin, PretravelMap, orientation_note, tip_note
from pretravel.measurement.friction_of_part import movement_by_friction
from pretravel.measurement.gross_points import GrossPoint, gross_points, gross_points_sentence
from pretravel.measurement.point_errors import PointErrors, budget_of_variances
from pretravel.measurement.points import Points, joined_points
from pretravel.measurement.rigid_movement import MovementSums
from pretravel.measurement.scatter_on_part import ScatterOnPart
from pretravel.touches import Touches
from pretravel.uncertainty import Budget

OBLIQUE = 10.0 * DEGREE
"""Approaches at a larger angle to the normal than this are warned about. [rad]"""
FRICTION_APART = 0.2
"""Difference of friction that a report looks at: ruby on steel, and on dry aluminium."""
_OTHER_NOMINAL = 1.0
"""Root mean square that the deviations of a part are below. [mm]"""
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
        """Of points."""
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


def other_nominal_points(touches: Touches, points: Points) -> tuple[str, ...]:
    """A sentence if the nominal points of the touches lie off the nominal surface; else empty.

    Parameters
    ----------
    touches : Touches
    points : Points
        With deviations from a nominal surface, in the same frame.
    """
    if touches.nominal_points is None or points.deviation is None:
        return ()
    apart = touches.nominal_points - points.positions + points.deviation[:, None] * points.normals
    along = np.abs(np.sum(apart * points.normals, axis=1))
    whole = np.linalg.norm(apart, axis=1)
    median = float(np.median(np.where(whole**2 - along**2 < _FROM_TARGET**2, along, whole)))
    if median <= _OFF_SURFACE:
        return ()
    said = f"the nominal points of the touches lie {median:.3g} mm from the nominal surface"
    return (f"{said} (median): deviations are from the surface, these points are not used",)


_FROM_TARGET = 0.5
"""Usual distance of a touch from its target. [mm]"""
_OFF_SURFACE = 0.05
"""A face that is curved departs by less from its tangent at this distance. [mm]"""


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
        A sentence where they or the map alone state how the head is turned.
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
    def of_conditions(touches: Touches, pretravel_map: PretravelMap) -> TouchSummary:
        """Of what touches state of themselves alone: feed, spindle, tip; see `conditions`."""
        feeds = touches.feeds
        return TouchSummary(
            len(touches),
            1.0,
            None if feeds is None else (float(feeds.min()), float(feeds.max())),
            states_spindle=touches.spindle is not None,
            other_tip=tip_note(touches, pretravel_map),
        )

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
        deviation = points.deviation
        alone = pretravel_map.repeatability**2 + pretravel_map.fixed_scatter**2
        inside = pretravel_map.support.supports(pretravel_map.probe_directions(points.normals))
        return replace(
            TouchSummary.of_conditions(touches, pretravel_map),
            least_closing=float(touches.closing().min()),
            middle=None if deviation is None else float(np.median(deviation)),
            outside=int(np.sum(~inside)),
            movement=None
            if deviation is None
            else MovementSums.of(points.positions, points.normals, deviation),
            gross=()
            if deviation is None
            else gross_points(
                points.positions,
                points.normals,
                deviation,
                points.standard_uncertainty,
                touches.where,
            ),
            scatter=(points.scatter or ScatterOnPart()).with_faces(
                points.positions,
                points.normals,
                alone * touches.closing(points.normals) ** 2,
            ),
            by_friction=_beyond_u_by_friction(touches, points, pretravel_map),
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

    def warnings(self, pretravel_map: PretravelMap) -> list[str]:
        """What to know before the points are used, as sentences.

        >>> from pretravel.maps.kinds.mean import MeanBasis
        >>> from pretravel.maps.support import DirectionSupport
        >>> from pretravel.uncertainty import Covariance
        >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
        ...                     DirectionSupport([[0.0, 0.0, 1.0]]), tip_radius=3.0)
        >>> TouchSummary(count=1, least_closing=1.0).warnings(mean)
        []
        """
        warnings = []
        if self.outside:
            warnings.append(
                f"{self.outside} of {self.count} normals lie outside the map: pretravel is "
                "extrapolated there, and u does not contain the error of this"
            )
        if not pretravel_map.states_uncertainty:
            warnings.append(
                "this map is a prediction without an uncertainty: u_um contains only the tip "
                "radius (and a given repeatability), not the difference between the described "
                "probe and yours"
            )
        absent = () if pretravel_map.machine is None else pretravel_map.machine.absent
        if absent:
            warnings.append(
                f"the touches of this map did not determine the machine's {', '.join(absent)}: "
                "lengths contain this error, and u does not"
            )
        warnings += self.conditions(pretravel_map)
        obliqueness = math.acos(min(self.least_closing, 1.0))
        measured = pretravel_map.repeatability > 0.0 and pretravel_map.delay is None
        if measured and obliqueness > OBLIQUE:
            warnings.append(
                f"approaches are up to {obliqueness / DEGREE:.0f}° off the normal: a "
                "signal delay adds its travel along the approach, but a qualified map contains it "
                "as pretravel; at 45° and 12 µm of delay travel the error is 3.5 µm. Probe along "
                "the normal, or qualify at two feeds, which separates the delay"
            )
        if self.middle is not None and abs(self.middle) > 0.2 * pretravel_map.tip_radius:
            warnings.append(
                f"deviations are about {self.middle:+.3f} mm, of the size of the tip radius "
                f"({pretravel_map.tip_radius:g} mm): are the readings tip-centre positions in "
                "mm, do the normals point out of the part, is the nominal where the part is?"
            )
        elsewhere = "" if self.movement is None else self.movement.sentence()
        if not elsewhere and self.movement is not None and self.movement.rms > _OTHER_NOMINAL:
            elsewhere = (
                f"the deviations are {self.movement.rms:.3g} mm (root mean square), and no "
                "movement of the part explains them: are the nominal points those of these "
                "touches, in mm and in their frame, and do all normals point out of the part?"
            )
        stated = (elsewhere, gross_points_sentence(self.gross))
        return [*warnings, *self.scatter.sentences(), *(said for said in stated if said)]

    def conditions(self, pretravel_map: PretravelMap) -> list[str]:
        """What touches and map state of feed and tip where it differs, as sentences."""
        warnings = []
        made_at = pretravel_map.feed if pretravel_map.delay is None else None
        if made_at is not None and self.feeds is not None:
            slowest, fastest = self.feeds
            if not (slowest == fastest and abs(fastest / made_at - 1.0) < 0.01):
                at = range_text(slowest, fastest)
                warnings.append(
                    f"the map was made at {made_at:g} mm/min, these touches at {at}; the delay "
                    "travel (feed × signal delay) changes with the feed. Qualify at the feed you "
                    "measure with"
                )
        known_of_touches = self.feeds is not None
        if _delay_is_unknown(pretravel_map) and (made_at is None) == known_of_touches:
            warnings.append(_one_unknown_feed(known_of_touches=known_of_touches))
        if self.feeds is not None and not pretravel_map.states_uncertainty:
            warnings.append(
                f"the touches were made at {self.feeds[1]:g} mm/min, and a predicted map "
                "contains no signal delay: feed × delay is still in the deviations"
            )
        return [*warnings, *filter(None, [self.other_tip])]

    def notes(self, pretravel_map: PretravelMap) -> list[str]:
        """Sentences for the report if feed, orientation, friction or scatter are not known.

        Returns
        -------
        list of str
            Empty where all are known, or do not matter.
        """
        fed, turned = self.feed_note(pretravel_map), ""
        if pretravel_map.provenance.origin is Origin.QUALIFIED:
            turned = orientation_note(pretravel_map, stated=self.states_spindle)
        if fed and turned:  # one note, as they have one cause
            fed, turned = f"{fed}. {turned[0].upper()}{turned[1:]}", ""
        notes = fed, turned, self._friction_note(), self._scatter_note(pretravel_map)
        return [note for note in notes if note]

    def feed_note(self, pretravel_map: PretravelMap) -> str:
        """What holds where nobody states a feed: for the report, as nearly everybody reads it.

        Returns
        -------
        str
            Empty where a feed is stated, or none matters.
        """
        stated = self.feeds is not None or pretravel_map.feed is not None
        if stated or not _delay_is_unknown(pretravel_map):
            return ""
        return (
            "no file states a feed (column feed_mm_min): feeds that differ by 100 mm/min move "
            "points by 3.3 µm at a signal delay of 2 ms (not in U)"
        )

    def _friction_note(self) -> str:
        """What a friction of the part unlike that of the reference would do, beyond U."""
        if self.by_friction <= 0.0:
            return ""
        return (
            f"if the coefficient of friction is {FRICTION_APART:g} larger on the part than on the "
            "reference, points on inclined faces move by up to "
            f"{self.by_friction / MICROMETRE:.1f} µm, more than their U. To include this in U, "
            "give u of the friction (0.1 if part and reference are of different metals)"
        )

    def _scatter_note(self, pretravel_map: PretravelMap) -> str:
        """That u contains the scatter of the reference, where the part's own was not seen."""
        seen = self.scatter.repeats.dof > 0.0 or self.scatter.faces.dof > 0.0
        if seen or not pretravel_map.repeatability > 0.0:
            return ""
        return (
            "no place was touched twice: u contains the repeatability on the reference "
            f"({pretravel_map.repeatability / MICROMETRE:.2g} µm); that on the part is not known"
        )


def _delay_is_unknown(pretravel_map: PretravelMap) -> bool:
    """Whether a qualified map contains the delay travel of its own feed."""
    qualified = pretravel_map.provenance.origin is Origin.QUALIFIED
    return qualified and pretravel_map.delay is None


def _one_unknown_feed(*, known_of_touches: bool) -> str:
    known, unknown = ("touches", "map") if known_of_touches else ("map", "touches")
    return (
        f"the {known} {'has' if known == 'map' else 'have'} a feed, the {unknown} "
        f"do{'es' if unknown == 'map' else ''} not (column feed_mm_min): points are wrong by the "
        "difference of the feeds × signal delay. u assumes feeds within a factor of 3 of each "
        f"other: twice the known feed × {USUAL_DELAY * 1e3:g} ms. "
        + (
            "Qualify again and give the feed of the touches on the reference"
            if unknown == "map"
            else "Give the feed of these touches"
        )
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


@dataclass(frozen=True)
class CompensatedRows:
    """What reports need of a part of a long table, or of several.

    Attributes
    ----------
    points : PointsSummary
    touches : TouchSummary
    drawn : tuple of Points
        Some of the points, in equal distances, for pictures.
    variances : tuple of mapping of str to (k,) float
        Of these points along their normals, by source. [mm²]
    dof : float
        Degrees of freedom of the repeatability of the map.
    """

    points: PointsSummary
    touches: TouchSummary
    drawn: tuple[Points, ...]
    variances: tuple[Mapping[str, FloatArray], ...]
    dof: float

    @staticmethod
    def of(
        points: Points, touches: TouchSummary, errors: PointErrors, done: int, apart: int
    ) -> CompensatedRows:
        """Of the rows that come after ``done`` others; one point of ``apart`` is drawn."""
        some = np.arange(-done % apart, len(points), apart)
        return CompensatedRows(
            PointsSummary.of(points),
            touches,
            (points[some],) if len(some) else (),
            (errors.at(some).variances_along_normals,) if len(some) else (),
            errors.pretravel_map.repeatability_dof,
        )

    def joined(self, other: CompensatedRows) -> CompensatedRows:
        """Of both."""
        return CompensatedRows(
            self.points.joined(other.points),
            self.touches.joined(other.touches),
            self.drawn + other.drawn,
            self.variances + other.variances,
            self.dof,
        )

    @property
    def drawn_points(self) -> Points:
        """The points of pictures."""
        return joined_points(self.drawn)

    def budget(self) -> Budget:
        """The budget of these points on average."""
        variances = {
            name: float(np.mean(np.concatenate([part[name] for part in self.variances])))
            for name in self.variances[0]
        }
        count = sum(map(len, self.drawn))
        return budget_of_variances(variances, self.dof, f"rms of {count} of the points")
