"""Several tips: a star stylus or a tool changer, qualified on one sphere that stays where it is.

Each tip has a map of its own, and finds the sphere's centre at another reading of the machine: the
difference of two of these is the offset of one tip from the other. A point that was touched with
any tip is then in the frame of the first one. The conventions of a map and of its centre belong
together: what they shift is the same for a tip's offset and its map, and drops out of points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.base import DEGREE, FloatArray, IntArray, PretravelError, frozen, ring_pattern
from pretravel.maps import AXIAL_PRETRAVEL, PretravelMap
from pretravel.measurement.compensation import apply
from pretravel.measurement.points import Points, joined_points
from pretravel.touches import Touches
from pretravel.uncertainty import Covariance

if TYPE_CHECKING:
    from pretravel.qualification import Qualification
    from pretravel.surface import Part, Surface

_DRAWS = 60
"""Of noise; a standard deviation from so many is right to 9 %."""
_SIDEWAYS = np.sin(10.0 * DEGREE)
"""Between the axes of a tip and of the first one, from which it is a side tip."""


@dataclass(frozen=True, eq=False)
class StarTip:
    """One tip of several.

    Attributes
    ----------
    name : str
    pretravel_map : PretravelMap
    center : (3,) float
        Reading of the machine with the tip at the centre of the sphere. [mm]
    covariance : (3, 3) float
        Of the centre together with this map: by the noise of the touches. [mm²]
    alone : (3, 3) float
        Of the centre alone, as a place: with the uncertainty of the convention that
        separates it from the map. [mm²]
    """

    name: str
    pretravel_map: PretravelMap
    center: FloatArray
    covariance: FloatArray
    alone: FloatArray


@dataclass(frozen=True, eq=False)
class StarStylus:
    """Tips that were qualified on one sphere; the first one is that which the others refer to."""

    tips: tuple[StarTip, ...]

    def __post_init__(self) -> None:
        names = [tip.name for tip in self.tips]
        double = [name for name in names if names.count(name) > 1]
        if not names or double:
            problem = f"two tips are called {double[0]}" if double else "there are no tips"
            raise PretravelError(problem)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the tips."""
        return tuple(tip.name for tip in self.tips)

    def tip(self, name: str) -> StarTip:
        """A tip by its name.

        Raises
        ------
        PretravelError
        """
        found = [tip for tip in self.tips if tip.name == name]
        if not found:
            raise PretravelError(
                f"there is no tip {name!r}; there are {', '.join(self.names)}", inputs=("map_file",)
            )
        return found[0]

    def offset(self, name: str) -> FloatArray:
        """Tip centre less that of the first tip, where the machine stands still, (3,). [mm]"""
        return np.asarray(self.tips[0].center - self.tip(name).center)

    def offset_covariance(self, name: str, *, of_points: bool = False) -> FloatArray:
        """Of an offset, (3, 3): the centre of the first tip is in all. [mm²]

        Along the axis of a tip a sphere shows the sum of the offset and the pretravel there: the
        offset as a place contains the uncertainty of this separation, points do not.

        Parameters
        ----------
        name : str
        of_points : bool
            What the offset adds to points that are compensated with the maps of the tips.
        """
        first = self.tips[0]
        if first.name == name:
            return np.zeros((3, 3))

        def of(tip: StarTip) -> FloatArray:
            return tip.covariance if of_points else tip.alone

        return np.asarray(of(first) + of(self.tip(name)))


def star_stylus(qualifications: Mapping[str, Qualification]) -> StarStylus:
    """Tips from their qualifications on one sphere, the first one first.

    Parameters
    ----------
    qualifications : mapping of str to Qualification
        All on the same sphere, which was not moved.

    Returns
    -------
    StarStylus
        The first tip is on the axis of the probe's spring, along which a probe is stiff. Along the
        axis of a side tip it is as soft as across: the place of such a tip along its own axis is
        uncertain by its pretravel across, root mean square.
    """
    springs = [one.pretravel_map.rotation[:, 2] for one in qualifications.values()][:1]
    return StarStylus(
        tuple(
            StarTip(
                name,
                one.pretravel_map,
                frozen(one.center),
                frozen(by_noise(one)),
                frozen(one.center_covariance + _of_side_tip(one, springs[0])),
            )
            for name, one in qualifications.items()
        )
    )


def _of_side_tip(made: Qualification, spring: FloatArray) -> FloatArray:
    """Covariance of a centre by the pretravel along the axis of a tip that is not the spring's."""
    rotation = made.pretravel_map.rotation
    axis = rotation[:, 2]
    stated = made.setup.axial_pretravel != AXIAL_PRETRAVEL
    if stated or made.setup.ring or np.linalg.norm(np.cross(axis, spring)) < _SIDEWAYS:
        return np.zeros((3, 3))
    around = ring_pattern([0.5 * np.pi], 36) @ rotation.T
    across = made.pretravel_map.pretravel(around, extrapolate=True)
    return np.asarray(np.mean(across**2) * np.outer(axis, axis))


def by_noise(made: Qualification) -> FloatArray:
    """Covariance of the centre by the noise of the touches, the convention held, (3, 3). [mm²]

    The touches are fitted again with drawn noise (seeded). A kind of map that cannot be fitted
    again near its fit has the whole covariance of its own centre, which is larger.
    """
    seen, noise = made.fit.observation, made.repeatability
    generator = np.random.default_rng(0)
    rotation = made.pretravel_map.rotation
    centers = []
    for _ in range(_DRAWS):
        moved = seen.directions * generator.normal(0.0, noise, len(seen.positions))[:, None]
        again = made.kind.refit(made.fit, replace(seen, positions=seen.positions + moved))
        if again is None:
            return np.asarray(made.own_center_covariance)
        centers.append(made.kind.centered(again, made.setup.axial_pretravel).center)
    return np.asarray(rotation @ np.cov(np.array(centers).T) @ rotation.T)


def rows_of_tips(touches: Touches, names: Sequence[str]) -> dict[str, IntArray]:
    """Rows of the touches of each tip, in the order of the names.

    Raises
    ------
    PretravelError
        Touches do not state their tips, or state another one.

    >>> two = Touches([[0.0, 0.0, 3.0]] * 2, [[0.0, 0.0, 1.0]] * 2, tips=("a", "b"))
    >>> {name: rows.tolist() for name, rows in rows_of_tips(two, ("b", "a")).items()}
    {'b': [1], 'a': [0]}
    """
    if touches.tips is None:
        raise PretravelError(
            f"the touches do not give their tips, and there are {', '.join(names)}: a column tip "
            "is needed"
        )
    for row, tip in enumerate(touches.tips):
        if tip not in names:
            raise PretravelError(
                f"{touches.where(row)} was made with the tip {tip!r}; there are {', '.join(names)}"
            )
    tips = np.array(touches.tips)
    return {name: np.flatnonzero(tips == name) for name in names if (tips == name).any()}


def apply_star(
    touches: Touches,
    star: StarStylus,
    *,
    nominal: Surface | Part | None = None,
    extrapolate: bool = False,
) -> Points:
    """Compensate touches of several tips, each with its map and its offset.

    Parameters
    ----------
    touches : Touches
        With `Touches.tips`.
    star : StarStylus
    nominal : Surface or Part, optional
    extrapolate : bool
        See `apply`.

    Returns
    -------
    Points
        In the order of the touches and in the frame of the first tip. `Points.shared` has the
        errors of the offsets: those of one tip move all its points together, and so a feature that
        several tips touched.

    Raises
    ------
    PretravelError
        As `rows_of_tips` and `apply`.
    """
    labels = touches.labels or tuple(str(touches.numbered_from + k) for k in range(len(touches)))
    parts, order, maps = [], [], 0
    causes: dict[str, None] = {}
    for name, rows in rows_of_tips(touches, star.names).items():
        own = replace(touches, labels=labels).take(rows)
        own = replace(own, positions=own.positions + star.offset(name))
        points = apply(own, star.tip(name).pretravel_map, nominal=nominal, extrapolate=extrapolate)
        n = points.normals
        errors = dict(points.shared or {})
        # Errors of a map are those of its tip; the sphere's size is in the radii of all tips.
        of_map = [cause for cause in errors if cause.startswith("map ")]
        moved = {f"map {maps + k + 1}": errors.pop(cause) for k, cause in enumerate(of_map)}
        moved, maps = errors | moved, maps + len(of_map)
        for mine, sign in ((star.tips[0], 1.0), (star.tip(name), -1.0)):
            if name != star.tips[0].name:
                root = Covariance.full(mine.covariance).root
                for k in range(3):
                    moved[f"centre of tip {mine.name} {k + 1}"] = sign * n @ root[:, k]
        added = star.offset_covariance(name, of_points=True)
        parts.append((replace(points, covariance=frozen(points.covariance + added)), moved))
        order.append(rows)
        causes |= dict.fromkeys(moved)
    joined = joined_points(
        [
            replace(points, shared={
                cause: frozen(moved.get(cause, np.zeros(len(points)))) for cause in causes
            })
            for points, moved in parts
        ]
    )  # fmt: skip
    return joined[np.argsort(np.concatenate(order))]
