"""Pretravel observed in directions about the centre of a reference: what maps are fitted to."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pretravel.base import (
    LARGEST_PRETRAVEL,
    MICROMETRE,
    BoolArray,
    FloatArray,
    IntArray,
    PretravelError,
    delay_travel,
    frozen,
    unit,
)
from pretravel.maps.support import DirectionSupport

_MANY = 5_000  # touches from which functions are evaluated once for each direction
_CLOSE = 1e-3  # largest distance of contact normals of one direction for that
_DETERMINED = 1e-3
"""Smallest singular value of the sphere's columns, as a share of the largest: below it, noise moves
the centre a thousand times as far."""


@dataclass(frozen=True)
class Scatter:
    """Standard deviation of a single touch, and how well it is known.

    Attributes
    ----------
    deviation : float
        [mm]
    dof : float
        Degrees of freedom; zero without repeats.
    """

    deviation: float
    dof: float


@dataclass(frozen=True, eq=False)
class Observation:
    """Touches on a reference about a centre, in the probe frame.

    Made from touches by `pretravel.qualification.observe.observe`.

    Attributes
    ----------
    positions : (n, 3) float
        Spindle points. [mm]
    groups : (n,) int
        Number of the direction of each touch; repeats share it.
    center : (3,) float
        [mm]
    reference_radius, tip_radius : float
        [mm]
    ring : bool
        The reference is a ring gauge, touched inside.
    tip_known : bool
        Whether the tip's diameter was given; else `tip_radius` is the one that the touches imply.
    u_constant : float
        Standard uncertainty of a constant part of observed pretravel: error of the reference's
        radius, travel during a signal delay that is not known. [mm]
    step_scatter : float
        Standard deviation of a direction by the step of the positions: neither repeats nor
        residuals make it smaller. [mm]
    of_means : bool
        Of means at two opposite orientations of the spindle: lobes of odd order have cancelled.
    """

    positions: FloatArray
    groups: IntArray
    center: FloatArray
    reference_radius: float
    tip_radius: float
    ring: bool
    tip_known: bool = True
    u_constant: float = 0.0
    step_scatter: float = 0.0
    of_means: bool = False

    @property
    def axes(self) -> int:
        """Number of centre coordinates that the reference determines: 3, on a ring 2."""
        return 2 if self.ring else 3

    @cached_property
    def _offset(self) -> FloatArray:
        return np.asarray((self.positions - self.center)[:, : self.axes])

    @cached_property
    def directions(self) -> FloatArray:
        """Contact normals, (n, 3)."""
        outward = unit(self._offset)
        if self.ring:
            return np.hstack([-outward, np.zeros((len(outward), 1))])
        return outward

    @cached_property
    def values(self) -> FloatArray:
        """Observed pretravel, (n,). [mm]"""
        distance = np.linalg.norm(self._offset, axis=1)
        if self.ring:
            return np.asarray(distance - (self.reference_radius - self.tip_radius))
        return np.asarray(self.reference_radius + self.tip_radius - distance)

    @property
    def direction_count(self) -> int:
        """Number of different directions."""
        return int(self.groups.max()) + 1

    def take(self, mask: BoolArray) -> Observation:
        """The touches of a mask, about the same centre."""
        groups = np.unique(self.groups[mask], return_inverse=True)[1]
        return replace(self, positions=self.positions[mask], groups=groups)

    def drawn(self, directions: int) -> Observation:
        """The touches of some directions, drawn at random (seeded); all of up to twice as many."""
        if self.direction_count <= 2 * directions:
            return self
        chosen = np.zeros(self.direction_count, dtype=bool)
        generator = np.random.default_rng(0)
        chosen[generator.permutation(self.direction_count)[:directions]] = True
        return self.take(chosen[self.groups])

    @property
    def free_terms(self) -> IntArray:
        """Harmonics of the mean and of a shift of the centre: degree and order, (axes + 1, 2)."""
        return np.array([(0, 0), (1, 1), (1, -1), (1, 0)][: self.axes + 1], dtype=np.int64)

    @cached_property
    def free_design(self) -> FloatArray:
        """Columns 1, n_x, n_y (and n_z), (n, axes + 1)."""
        return sphere_columns(self.directions, self.axes)

    @cached_property
    def to_sphere(self) -> FloatArray:
        """Least-squares sphere of any values: mean, then shift, (axes + 1, n)."""
        return np.asarray(np.linalg.pinv(self.free_design))

    @property
    def shows_variation(self) -> bool:
        """Whether the directions determine the least-squares sphere, and what it leaves."""
        sizes = np.linalg.eigvalsh(self.free_design.T @ self.free_design)
        more = self.direction_count > len(sizes)
        return bool(more and sizes[0] >= _DETERMINED**2 * sizes[-1])

    @cached_property
    def places(self) -> Places:
        """Where functions of direction are evaluated for a fit."""
        directions = self.group_directions
        if len(self.groups) > _MANY:
            apart = np.abs(self.directions - directions[self.groups]).max(initial=0.0)
            if apart < _CLOSE:
                each = np.arange(len(directions))
                return Places(directions, each, self.groups, self.step_scatter**2)
        each = np.arange(len(self.groups))
        return Places(self.directions, self.groups, each, self.step_scatter**2)

    @cached_property
    def group_means(self) -> FloatArray:
        """Mean pretravel of each direction, (g,). [mm]"""
        return np.asarray(np.bincount(self.groups, self.values) / np.bincount(self.groups))

    @cached_property
    def repeats(self) -> Scatter:
        """Pooled standard deviation among repeats of the same direction; zero without repeats.

        >>> touches = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 3.002]])
        >>> seen = Observation(touches, np.array([0, 0]), np.zeros(3), 1.0, 2.0, ring=False)
        >>> round(seen.repeats.deviation, 6), seen.repeats.dof
        (0.001414, 1.0)
        """
        count = np.bincount(self.groups).astype(np.float64)
        dof = float(len(self.values) - len(count))
        if dof == 0.0:
            return Scatter(0.0, 0.0)
        mean = np.bincount(self.groups, self.values) / count
        squares = float(np.sum((self.values - mean[self.groups]) ** 2))
        return Scatter(math.sqrt(squares / dof), dof)

    @cached_property
    def group_directions(self) -> FloatArray:
        """Mean contact normal of each direction, (g, 3)."""
        total = [np.bincount(self.groups, axis) for axis in self.directions.T]
        return unit(np.stack(total, axis=1))

    @cached_property
    def support(self) -> DirectionSupport:
        """The directions that the touches support; all kinds of map of one observation share it."""
        return DirectionSupport(self.group_directions)


@dataclass(frozen=True, eq=False)
class Places:
    """Directions in which the functions of a map are evaluated for a fit.

    Those of all touches. Of very many touches, whose contact normals differ little within a
    direction, the mean ones: a function of direction differs there from its mean over the touches
    by the square of a thousandth.

    Attributes
    ----------
    directions : (p, 3) float
    groups : (p,) int
        Direction of each place.
    of_touches : (n,) int
        Place of each touch.
    step_variance : float
        Of each direction, by the step of the positions; see `Observation.step_scatter`. [mm²]
    """

    directions: FloatArray
    groups: IntArray
    of_touches: IntArray
    step_variance: float = 0.0


def sphere_columns(directions: FloatArray, axes: int) -> FloatArray:
    """What a radius and a shift of the centre add to pretravel: 1, n_x, n_y (and n_z).

    Parameters
    ----------
    directions : (n, 3) float
    axes : int
        3, on a ring 2.

    Returns
    -------
    (n, axes + 1) float

    >>> sphere_columns(np.array([[0.0, 0.6, 0.8]]), 3).tolist()
    [[1.0, 0.0, 0.6, 0.8]]
    """
    return np.hstack([np.ones((len(directions), 1)), directions[:, :axes]])


MOST_KEPT = 5000
"""A map of more directions does not keep what was observed in each of them."""


@dataclass(frozen=True, eq=False)
class TouchedMeans:
    """Mean observed pretravel in each touched direction: the nodes of the support of a map.

    A map smooths what was observed. A model that is fitted to the touches needs the touches: their
    errors are independent, those of a map are not, and a map has no kinks between its touches.

    Parameters
    ----------
    pretravel : (n,) float
        Mean of the touches of each direction, about the centre and with the tip radius of the map.
        [mm]
    counts : (n,) float
        Number of touches of each direction.

    Raises
    ------
    PretravelError
        Shapes that differ, values that are not finite, a direction without a touch.

    >>> TouchedMeans(np.array([0.010, 0.012]), np.array([3, 3])).counts.tolist()
    [3.0, 3.0]
    """

    pretravel: FloatArray
    counts: FloatArray

    def __post_init__(self) -> None:
        pretravel, counts = frozen(self.pretravel), frozen(self.counts)
        if pretravel.ndim != 1 or pretravel.shape != counts.shape:
            raise PretravelError(
                "observed pretravel and numbers of touches must be of the same directions, got "
                f"{pretravel.shape} and {counts.shape}"
            )
        if not (np.all(np.isfinite(pretravel)) and np.all(np.isfinite(counts))):
            raise PretravelError("observed pretravel and numbers of touches must be finite")
        if not np.all(counts >= 1.0):
            raise PretravelError("each touched direction has one touch at least")
        object.__setattr__(self, "pretravel", pretravel)
        object.__setattr__(self, "counts", counts)

    @staticmethod
    def of(observation: Observation, center: FloatArray, tip_radius: float) -> TouchedMeans | None:
        """What was observed in each direction, about the centre and with the tip radius of a map.

        None of more than some thousand directions.

        Parameters
        ----------
        observation : Observation
        center : (3,) float
            [mm]
        tip_radius : float
            [mm]
        """
        if observation.direction_count > MOST_KEPT:
            return None
        observed = replace(observation, center=center).group_means
        counts = np.bincount(observation.groups).astype(np.float64)
        return TouchedMeans(observed + (tip_radius - observation.tip_radius), counts)


IMPLAUSIBLE_PRETRAVEL = 0.1
"""A map that rises above this is warned about: probes deflect by 1 to 80 um. [mm]"""
LONGEST_DELAY = 0.03
"""Signal delay whose travel is accepted on top, where the feed is stated. [s]"""
SMALLEST_PRETRAVEL = -0.02
"""A mean pretravel below this is impossible: no probe triggers before contact. [mm]"""
BEFORE_CONTACT = 2.0 * MICROMETRE
"""A rig whose touches are further below zero than this is refused. [mm]"""


def largest_plausible(feed: float | None) -> float:
    """The largest pretravel that is accepted at a feed.

    Parameters
    ----------
    feed : float or None
        None: not stated. [mm/min]

    Returns
    -------
    float
        [mm]

    >>> largest_plausible(None), largest_plausible(60.0)
    (0.15, 0.18)
    """
    return LARGEST_PRETRAVEL + (0.0 if feed is None else delay_travel(feed, LONGEST_DELAY))


_SAME_TIP = 0.18
"""Effective diameters are smaller by twice the pretravel, up to 0.16 mm; tips on sale differ by 0.2
mm and more. [mm]"""


def same_tip(diameter: float, other: float) -> bool:
    """Whether two diameters can be those of one tip, nominal or effective.

    Parameters
    ----------
    diameter, other : float
        [mm]

    >>> same_tip(6.0, 5.85), same_tip(0.3, 0.5)
    (True, False)
    """
    return abs(diameter - other) <= _SAME_TIP
