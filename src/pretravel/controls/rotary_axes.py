"""Place and direction of a rotary axis from touches of a sphere at several angles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, FloatArray, PretravelError, frozen
from pretravel.uncertainty import Covariance, coverage_factor, fit_sphere

AXIS_LETTERS: Mapping[str, int] = {"A": 0, "B": 1, "C": 2}
"""Rotary axes, and the axis of the machine along which each lies."""
FEWEST_ANGLES = 3
_FARTHEST = 0.2
"""Largest slope of a rotary axis against its axis of the machine: 11 degrees."""
_OFF_CIRCLE = 0.01
"""Of the radius of the circle, from which angles are wrong: half a degree."""
_OFF = 0.1
"""Distance from the circle that no axis and no noise has. [mm]"""
_STEPS = 60
_SAME_SENSE = 4.0
"""By so many times the sum of squares must the other sense of rotation be worse."""


@dataclass(frozen=True, eq=False)
class RotaryAxis:
    """A rotary axis of a machine.

    Attributes
    ----------
    letter : str
    point : (3,) float
        Where the axis passes the height of the middle of the spheres' centres along the machine's
        axis. [mm]
    direction : (3,) float
        Unit vector, positive along the machine's axis.
    sense : int
        1 where the sphere turns counter-clockwise about the direction at growing angles, -1 where
        it turns clockwise: tables do, the tool moves positively about the part.
    covariance : (4, 4) float
        Of the two coordinates of the point across the axis [mm²], then of the two slopes of the
        direction [rad²], each in the order of the machine's axes.
    dof : (4,) float
        Effective degrees of freedom of each of the four.
    angles : (k,) float
        [rad]
    centers : (k, 3) float
        Of the sphere at each angle. [mm]
    residuals : (k, 3) float
        Of the centres from their circle. [mm]
    radius : float
        Of the spheres. [mm]
    noise : float
        Standard deviation of a touch from its sphere. [mm]
    wander : float
        Standard deviation of a centre, each coordinate, beyond what the noise explains: run-out,
        positioning of the axis. [mm]
    """

    letter: str
    point: FloatArray
    direction: FloatArray
    sense: int
    covariance: FloatArray
    dof: FloatArray
    angles: FloatArray
    centers: FloatArray
    residuals: FloatArray
    radius: float
    noise: float
    wander: float

    @property
    def across(self) -> tuple[int, int]:
        """The two machine axes across the rotary axis: 0 is x."""
        first, second = (axis for axis in range(3) if axis != AXIS_LETTERS[self.letter])
        return first, second

    @property
    def values(self) -> FloatArray:
        """Place across the axis [mm], then slopes [rad], (4,)."""
        across = list(self.across)
        slopes = self.direction[across] / self.direction[AXIS_LETTERS[self.letter]]
        return np.concatenate([self.point[across], slopes])

    @property
    def distance(self) -> float:
        """Of the spheres' centres from the axis. [mm]"""
        across = np.cross(self.centers - self.point, self.direction)
        return float(np.mean(np.linalg.norm(across, axis=1)))

    @property
    def factors(self) -> FloatArray:
        """Coverage factors for 95 %, (4,)."""
        return np.array([coverage_factor(float(dof)) for dof in self.dof])

    @property
    def expanded(self) -> FloatArray:
        """Expanded uncertainties of `values`, (4,)."""
        return np.asarray(self.factors * np.sqrt(np.diag(self.covariance)))


def rotary_axis(
    points: Sequence[FloatArray],
    angles: Sequence[float],
    letter: str,
    common: Sequence[Covariance] = (),
) -> RotaryAxis:
    """Place and direction of a rotary axis.

    All touches are fitted with spheres of one radius. Their centres lie on a circle about the
    axis, at the angles that the axis had. What the centres scatter beyond the noise of the touches
    is that of the axis; it is estimated (Paule and Mandel) and stands in the uncertainty.

    Parameters
    ----------
    points : sequence of (n, 3) float
        Touches of the sphere at each angle: surface points, or centres of the tip. [mm]
    angles : sequence of float
        Of the axis. [rad]
    letter : str
        A, B or C: it lies along x, y or z of the machine, up to some degrees.
    common : sequence of Covariance
        Of all points along their normals, by cause, beyond their noise: the map of a probe. [mm²]

    Raises
    ------
    PretravelError
        Fewer than three angles, angles that do not determine axis or sense, an axis that does not
        lie along the machine's.

    Examples
    --------
    >>> from pretravel.base.directions import sphere_pattern_25
    >>> turns = np.arange(0.0, 6.0)
    >>> places = np.array([50 * np.cos(turns), -50 * np.sin(turns), 0 * turns]).T + [1.0, 2.0, 0.0]
    >>> axis = rotary_axis([c + 12.5 * sphere_pattern_25() for c in places], turns, "C")
    >>> axis.point[:2].round(6).tolist(), round(float(axis.direction[2]), 6), axis.sense
    ([1.0, 2.0], 1.0, -1)
    """
    if letter not in AXIS_LETTERS:
        raise PretravelError(f"axis '{letter}': it is one of A, B, C", inputs=("letter",))
    turns = np.asarray(angles, dtype=np.float64)
    if len(points) != len(turns):
        raise PretravelError(
            f"{len(points)} sets of touches and {len(turns)} angles; one angle is needed for each",
            inputs=("angles",),
        )
    check_axis_angles(turns)
    centers, radius, weights, noise, dof = _centres(points)
    along = noise**2 * weights @ weights.T
    model, first = _model(centers, turns, AXIS_LETTERS[letter])
    jacobian = model.slopes(first)
    rest = (centers - model.centers(first)).ravel()
    wander = _wander(rest, jacobian, along)
    found, gain = _weighted(rest, jacobian, along + wander**2 * np.eye(len(rest)))
    values = first + found
    own = gain @ along @ gain.T
    axis_part = wander**2 * gain @ gain.T
    shared = sum((c.carried(gain @ weights) for c in common), np.zeros_like(own))
    total = own + axis_part + shared
    point, direction = model.line(values)
    return RotaryAxis(
        letter=letter,
        point=frozen(point),
        direction=frozen(direction),
        sense=model.sense,
        covariance=frozen(total[:4, :4]),
        dof=frozen(_dof(total, own, axis_part, dof, 3 * len(turns) - 7)[:4]),
        angles=frozen(turns),
        centers=frozen(centers),
        residuals=frozen(centers - model.centers(values)),
        radius=radius,
        noise=noise,
        wander=wander,
    )


def _dof(
    total: FloatArray, own: FloatArray, axis: FloatArray, of_noise: int, of_axis: int
) -> FloatArray:
    """Effective degrees of freedom (Welch and Satterthwaite) of noise and wander of the axis.

    The wander is what the centres scatter less what the noise explains: its variance is as
    uncertain as that of both.
    """
    noise, wander = np.diag(own), np.diag(axis)
    spread = noise**2 / of_noise + np.where(wander > 0.0, (noise + wander) ** 2 / of_axis, 0.0)
    return np.asarray(np.diag(total) ** 2 / np.maximum(spread, 1e-300))


def check_axis_angles(turns: FloatArray) -> None:
    """Refuse angles [rad] that do not determine a rotary axis.

    Raises
    ------
    PretravelError
        Fewer than three different ones.
    """
    whole = np.unique(np.round(np.mod(turns, 2.0 * np.pi), 6))
    if len(whole) < FEWEST_ANGLES:
        raise PretravelError(
            f"{len(whole)} different angles: an axis needs {FEWEST_ANGLES}, and 6 all around are "
            "better",
            inputs=("angles",),
        )


def _centres(points: Sequence[FloatArray]) -> tuple[FloatArray, float, FloatArray, float, int]:
    """Centres of spheres with one radius; this; how each touch moves them; noise and its dof.

    The third is (3 k, n): the change of the centres by a change of each point along its normal.
    """
    fits = [fit_sphere(own) for own in points]
    count = len(fits)
    values = np.append(
        np.concatenate([fit.center for fit in fits]), np.mean([fit.radius for fit in fits])
    )
    rows = np.repeat(np.arange(count), [len(own) for own in points])
    every = np.vstack(points)
    for _ in range(20):
        away = every - values[:-1].reshape(-1, 3)[rows]
        size = np.linalg.norm(away, axis=1)
        jacobian = np.zeros((len(every), 3 * count + 1))
        for axis in range(3):
            jacobian[np.arange(len(every)), 3 * rows + axis] = away[:, axis] / size
        jacobian[:, -1] = 1.0
        distances = size - values[-1]
        step = np.linalg.lstsq(jacobian, distances, rcond=None)[0]
        values = values + step
        if np.max(np.abs(step)) < 1e-12:
            break
    dof = len(every) - jacobian.shape[1]
    noise = float(np.sqrt(np.sum((distances - jacobian @ step) ** 2) / dof))
    centers, moved_by = values[:-1].reshape(-1, 3), np.linalg.pinv(jacobian)[:-1]
    return frozen(centers), float(values[-1]), frozen(moved_by), noise, dof


@dataclass(frozen=True)
class _Model:
    """A sphere on an axis; values are place 2, slopes 2, centre at the angle zero 3."""

    turns: FloatArray
    axis: int
    sense: int
    height: float

    def line(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Point at the height, and direction."""
        across = [i for i in range(3) if i != self.axis]
        point, direction = np.zeros(3), np.zeros(3)
        point[across], point[self.axis] = values[:2], self.height
        direction[across], direction[self.axis] = values[2:4], 1.0
        return point, direction / np.linalg.norm(direction)

    def centers(self, values: FloatArray) -> FloatArray:
        """Centres at the angles, (k, 3)."""
        from scipy.spatial.transform import Rotation

        point, direction = self.line(values)
        rotations = Rotation.from_rotvec(self.sense * self.turns[:, None] * direction)
        return np.asarray(point + rotations.apply(values[4:] - point))

    def slopes(self, values: FloatArray) -> FloatArray:
        """Derivatives of all coordinates of the centres, (3 k, 7), by central differences."""
        step = 1e-4
        columns = [
            (self.centers(values + shift) - self.centers(values - shift)).ravel() / (2.0 * step)
            for shift in step * np.eye(len(values))
        ]
        return np.array(columns).T


def _model(centers: FloatArray, turns: FloatArray, axis: int) -> tuple[_Model, FloatArray]:
    """The better of the two senses, and its values without weights."""
    from scipy.optimize import least_squares

    fits = []
    for sense in (1, -1):
        model = _Model(turns, axis, sense, float(np.mean(centers[:, axis])))
        start = _start(centers, turns, axis, sense)

        def off(values: FloatArray, model: _Model = model) -> FloatArray:
            return np.asarray((model.centers(values) - centers).ravel())

        # The right sense needs ten steps. The wrong one has a flat minimum, far from the centres.
        fit = least_squares(
            off, start, model.slopes, method="lm", xtol=1e-13, ftol=1e-13, max_nfev=_STEPS
        )
        fits.append((float(2.0 * fit.cost), fit.x, model))
    fits.sort(key=lambda found: found[0])
    (best, values, model), (worse, _, _) = fits
    size = float(np.sum((centers - centers.mean(axis=0)) ** 2))
    off_circle = float(np.sqrt(best / len(turns)))
    if best > _OFF_CIRCLE**2 * size and off_circle > _OFF:
        raise PretravelError(
            f"the centres of the sphere lie {off_circle:.2g} mm (rms) off a circle on which they "
            "would be at these angles: are letter, angles and their order those of these touches, "
            "and was the sphere not moved?",
            inputs=("letter", "angles"),
        )
    if worse < _SAME_SENSE * best or worse < 1e-9 * size:
        raise PretravelError(
            "these angles do not show in which sense the sphere turns: add one that is not a "
            "multiple of 180 degrees from the others",
            inputs=("angles",),
        )
    if max(abs(values[2]), abs(values[3])) > _FARTHEST:
        raise PretravelError(
            f"the axis is inclined by {np.arctan(np.hypot(*values[2:4])) / DEGREE:.0f} degrees to "
            f"{'xyz'[axis]} of the machine: are letter and angles those of these touches?",
            inputs=("letter", "angles"),
        )
    return model, values


def _start(centers: FloatArray, turns: FloatArray, axis: int, sense: int) -> FloatArray:
    """A circle in the plane across the machine's axis: linear in place and first centre."""
    first, second = (i for i in range(3) if i != axis)
    # Right-handed about the axis: from the first to the second of (y, z), (z, x), (x, y).
    hand = -1.0 if axis == 1 else 1.0
    cos, sin = np.cos(turns), hand * sense * np.sin(turns)
    zero, one = np.zeros_like(cos), np.ones_like(cos)
    # centre = p + R (c0 - p): unknown p and e = c0 - p.
    top = np.array([one, zero, cos, -sin]).T
    low = np.array([zero, one, sin, cos]).T
    flat = np.concatenate([centers[:, first], centers[:, second]])
    p = np.linalg.lstsq(np.vstack([top, low]), flat, rcond=None)[0]
    values = np.zeros(7)
    values[:2] = p[:2]
    values[4 + first], values[4 + second] = p[0] + p[2], p[1] + p[3]
    values[4 + axis] = centers[:, axis].mean()
    return values


def _weighted(
    rest: FloatArray, jacobian: FloatArray, along: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Change of the values and its dependence on the centres, with a covariance of these."""
    inverse = np.linalg.pinv(along, hermitian=True)
    gain = np.linalg.solve(jacobian.T @ inverse @ jacobian, jacobian.T @ inverse)
    return frozen(gain @ rest), frozen(gain)


def _wander(rest: FloatArray, jacobian: FloatArray, along: FloatArray) -> float:
    """Standard deviation of each coordinate beyond the covariance of the noise. [mm]"""
    from scipy.optimize import brentq

    free = len(rest) - jacobian.shape[1]

    def excess(variance: float) -> float:
        covariance = along + variance * np.eye(len(rest))
        found, _ = _weighted(rest, jacobian, covariance)
        left = rest - jacobian @ found
        return float(left @ np.linalg.solve(covariance, left)) - float(free)

    if excess(0.0) <= 0.0:
        return 0.0
    high = float(np.sum(rest**2)) / free + float(np.trace(along))
    while excess(high) > 0.0:
        high *= 4.0
    return float(np.sqrt(float(brentq(excess, 0.0, high))))
