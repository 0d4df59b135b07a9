"""Unit directions: polar and azimuth angles, checks, and patterns of touches.

A direction is the outward unit normal of the part at the contact, a row of an
(n, 3) array. Polar is its angle from +z (the probe axis, up to the spindle),
azimuth the angle of its projection on xy, counter-clockwise from +x.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError, RowError
from pretravel.base.quantities import REAL, as_numbers, checked_values
from pretravel.base.units import DEGREE

UNIT_TOLERANCE = 1e-3
"""Largest deviation of the length of a normal from one; other normals are refused.

Controls print three or four decimals, which cause deviations up to this. Scaling such a normal
to length one does not change its direction.
"""


def from_angles(polar: npt.ArrayLike, azimuth: npt.ArrayLike) -> FloatArray:
    """Unit directions from polar and azimuth angles.

    Parameters
    ----------
    polar, azimuth : (n,) float
        They are broadcast together. [rad]

    Returns
    -------
    (n, 3) float
        Unit vectors.

    >>> from_angles(math.pi / 2, [0.0, math.pi / 2]).round(12).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    theta, phi = np.broadcast_arrays(
        np.atleast_1d(np.asarray(polar, dtype=np.float64)),
        np.atleast_1d(np.asarray(azimuth, dtype=np.float64)),
    )
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def polar_angle(directions: npt.ArrayLike) -> FloatArray:
    """Angle from +z, in [0, pi]. [rad]

    >>> polar_angle([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]).round(6).tolist()
    [0.0, 1.570796]
    """
    d = np.asarray(directions, dtype=np.float64)
    # arctan2 is accurate at the pole, where arccos loses half of its digits.
    return np.asarray(np.arctan2(np.hypot(d[..., 0], d[..., 1]), d[..., 2]))


def azimuth_angle(directions: npt.ArrayLike) -> FloatArray:
    """Angle of the projection on xy from +x, counter-clockwise, in [0, 2 pi). [rad]

    At the poles, where it is not defined, it is zero.

    >>> azimuth_angle([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]).round(6).tolist()
    [4.712389, 0.0]
    """
    d = np.asarray(directions, dtype=np.float64)
    angle = np.mod(np.arctan2(d[..., 1], d[..., 0]), 2.0 * math.pi)
    # The mod of a tiny negative angle is rounded to 2 pi.
    return np.asarray(np.where(angle >= 2.0 * math.pi, 0.0, angle))


def describe(direction: npt.ArrayLike) -> str:
    """Polar and azimuth of one direction, for messages.

    >>> describe([1.0, 0.0, 0.0])
    'polar 90.0°, azimuth 0.0°'
    """
    return (
        f"polar {float(polar_angle(direction)) / DEGREE:.1f}°, "
        f"azimuth {float(azimuth_angle(direction)) / DEGREE:.1f}°"
    )


def describe_axis(direction: npt.ArrayLike) -> str:
    """A direction without a sign, for messages: x, y, z or its components.

    >>> describe_axis([0.0, 0.0, -1.0]), describe_axis([0.6, 0.0, 0.8])
    ('z', '(0.6, 0, 0.8)')
    """
    d = np.asarray(direction, dtype=np.float64)
    for name, axis in zip("xyz", np.eye(3), strict=True):
        if abs(abs(d @ axis) - 1.0) < 1e-9:
            return name
    d = d * np.sign(d[np.argmax(np.abs(d))])
    return "(" + ", ".join(f"{value:.4g}" for value in np.round(d, 6) + 0.0) + ")"


def unit(vectors: npt.ArrayLike) -> FloatArray:
    """Vectors scaled to length one; a zero vector is an error.

    >>> unit([[0.0, 3.0, 4.0]]).tolist()
    [[0.0, 0.6, 0.8]]
    """
    v = checked_values(vectors, "a direction", REAL)
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    if not np.all(length > 0.0):
        raise PretravelError("a direction has length zero: its three components are all zero")
    return np.asarray(v / length)


def checked_unit(vectors: npt.ArrayLike, name: str = "directions") -> FloatArray:
    """Unit vectors, scaled to length one to machine precision.

    Parameters
    ----------
    vectors : (n, 3) float
        Lengths within `UNIT_TOLERANCE` of one.
    name : str
        Name of the vectors, for the message.

    Returns
    -------
    (n, 3) float
        The same directions.

    Raises
    ------
    PretravelError
        Wrong shape, not finite, or not of unit length.

    >>> checked_unit([[0.0, 0.0, 2.0]], "normals")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.RowError: normals: row 1 has length 2; unit vectors are needed
    """
    v = as_numbers(vectors, name)
    if v.ndim != 2 or v.shape[1] != 3:
        raise PretravelError(f"{name}: expected an array of shape (n, 3), got {v.shape}")
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.linalg.norm(v, axis=1)
        bad = ~(np.abs(length - 1.0) <= UNIT_TOLERANCE)
    if np.any(bad):
        row = int(np.flatnonzero(bad)[0])
        stated = f"has length {length[row]:.6g}"
        problem = "is zero" if length[row] == 0.0 else stated
        raise RowError(
            f"{name}: row {row + 1} {stated}; unit vectors are needed",
            row,
            in_file=f"{name}: the vector {problem}; a unit vector is needed",
        )
    # A vector of length one to the last digit stays as it is: a second call changes nothing.
    return np.asarray(v / np.where(np.abs(length - 1.0) <= 1e-15, 1.0, length)[:, None])


def grid(polar: npt.ArrayLike, azimuth: npt.ArrayLike) -> FloatArray:
    """All pairs of the given angles; the azimuth varies fastest.

    Parameters
    ----------
    polar : (p,) float
        [rad]
    azimuth : (a,) float
        [rad]

    Returns
    -------
    (p * a, 3) float

    >>> grid([math.pi / 2], [0.0, math.pi]).round(9).tolist()
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]
    """
    p, a = np.meshgrid(
        np.atleast_1d(np.asarray(polar, dtype=np.float64)),
        np.atleast_1d(np.asarray(azimuth, dtype=np.float64)),
        indexing="ij",
    )
    return from_angles(p.ravel(), a.ravel())


def sphere_pattern_25(*, cumulative: bool = False) -> FloatArray:
    """The 25 directions of a sphere test: pole, 4, 8, 4 and 8 points.

    There are 1 at the pole, 4 at 22.5°, 8 at 45°, 4 at 67.5° and 8 at 90° from it. Each ring is
    turned by 22.5° relative to the ring before it, which can be read in two ways.

    Parameters
    ----------
    cumulative : bool
        False: turned back and forth, so that both rings of four begin at the same azimuth. True:
        turned further each time, so that the ring at 67.5° begins 45° after that at 22.5°. The
        rings of eight are the same in both.

    Returns
    -------
    (25, 3) float

    Notes
    -----
    The pattern is that of ISO 10360-5 from memory; it was not compared with
    the text of the standard.

    >>> sphere_pattern_25().shape
    (25, 3)
    >>> cumulative = azimuth_angle(sphere_pattern_25(cumulative=True))
    >>> (cumulative[[1, 5, 13, 17]] / DEGREE).round(6).tolist()
    [0.0, 22.5, 45.0, 22.5]
    """
    fourth = 45.0 if cumulative else 0.0
    rings = [(0.0, 1, 0.0), (22.5, 4, 0.0), (45.0, 8, 22.5), (67.5, 4, fourth), (90.0, 8, 22.5)]
    return np.concatenate(
        [
            from_angles(polar * DEGREE, (start + 360.0 / count * np.arange(count)) * DEGREE)
            for polar, count, start in rings
        ]
    )


def ring_pattern(polar: npt.ArrayLike, count: int) -> FloatArray:
    """Rings around the pole, of about equal density; every other ring is rotated by half a step.

    Parameters
    ----------
    polar : (p,) float
        Polar angles of the rings; zero is the pole, with one direction. [rad]
    count : int
        Directions on the equator. A ring has this number times the sine of its polar angle, but
        at least four.

    Returns
    -------
    (n, 3) float

    Raises
    ------
    PretravelError
        Fewer than four directions on the equator; polar angles outside 0 to 180°.

    >>> ring_pattern([0.0, math.pi / 6, math.pi / 2], 12).shape
    (19, 3)
    """
    angles = np.atleast_1d(np.asarray(polar, dtype=np.float64))
    if not 4 <= count <= 10_000:
        raise PretravelError(f"{count} directions on the equator: it must be between 4 and 10000")
    if np.any((angles < 0.0) | (angles > math.pi)):
        raise PretravelError("polar angles of rings lie between 0 and 180 degrees")
    rings = []
    for index, angle in enumerate(angles):
        if math.sin(angle) < 1e-9:
            rings.append(from_angles(angle, 0.0))
            continue
        own = max(round(count * math.sin(angle)), 4)
        azimuth = 2.0 * math.pi / own * (np.arange(own) + 0.5 * (index % 2))
        rings.append(from_angles(angle, azimuth))
    return np.concatenate(rings)


def five_point_pattern() -> FloatArray:
    """Four directions on the equator, at azimuth 0, 90, 180 and 270°, and the pole, (5, 3).

    >>> five_point_pattern().round(9)[1].tolist()
    [0.0, 1.0, 0.0]
    """
    right = 90.0 * DEGREE
    return from_angles([right] * 4 + [0.0], [0.0, right, 2.0 * right, 3.0 * right, 0.0])


def fibonacci_cap(count: int, largest_polar: float = math.pi / 2) -> FloatArray:
    """Directions that are evenly distributed over a cap around +z, by the golden angle.

    Parameters
    ----------
    count : int
    largest_polar : float
        Half-angle of the cap. [rad]

    Returns
    -------
    (count, 3) float

    >>> bool(fibonacci_cap(100)[:, 2].min() > 0.0)
    True
    """
    index = np.arange(count) + 0.5
    height = 1.0 - index / count * (1.0 - math.cos(largest_polar))
    golden_angle = math.pi * (3.0 - math.sqrt(5.0))
    return from_angles(np.arccos(height), golden_angle * index)
