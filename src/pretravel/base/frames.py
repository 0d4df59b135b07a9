"""Rotations between the probe's frame and the machine's.

Probe frame: +z from the tip up to the spindle. A rotation is a (3, 3) matrix R
whose columns are the probe's axes in machine coordinates: v_machine = R v_probe,
for rows of an (n, 3) array ``rows_machine = rows_probe @ R.T``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from pretravel.base.arrays import FloatArray, frozen
from pretravel.base.directions import checked_unit
from pretravel.base.errors import PretravelError
from pretravel.base.quantities import COORDINATE, NUMBER, as_numbers, checked_values
from pretravel.base.units import DEGREE

_ROUNDING = 1e-6
"""Of rotations that were computed or written with few digits."""


def probe_rotation(axis: npt.ArrayLike = (0.0, 0.0, 1.0), rotation: float = 0.0) -> FloatArray:
    """Rotation from probe to machine frame.

    The probe is first turned by `rotation` about its own axis, then tilted
    along the shortest way so that its axis points along `axis`.

    Parameters
    ----------
    axis : (3,) float
        Direction of the probe's +z (tip to spindle) in the machine; unit vector.
    rotation : float
        Turn about the probe axis, counter-clockwise seen from the spindle's
        side looking down the -z direction. [rad]

    Returns
    -------
    (3, 3) float
        Orthonormal, determinant +1.

    >>> probe_rotation((1.0, 0.0, 0.0)).round(12).tolist()
    [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    """
    a = checked_unit(np.atleast_2d(np.asarray(axis, dtype=np.float64)), "probe axis")[0]
    across = math.hypot(a[0], a[1])
    # The axis of the tilt; upside down the shortest way is not unique: then about y.
    hinge = np.array([-a[1], a[0], 0.0]) / across if across > 0.0 else np.array([0.0, 1.0, 0.0])
    tilt = turned_about_vector(math.atan2(across, a[2]) * hinge)
    return np.asarray(tilt @ turned_about_axes(0.0, 0.0, rotation))


def checked_rotation(rotation: npt.ArrayLike, of: str = "the probe") -> FloatArray:
    """A rotation from a frame to that of the machine, read-only.

    Parameters
    ----------
    rotation : (3, 3) float
    of : str
        Whose axes are its columns, for the message.

    Returns
    -------
    (3, 3) float

    Raises
    ------
    PretravelError
        Not a rotation: another shape, columns that are not perpendicular unit vectors, a mirror.

    >>> checked_rotation(2.0 * np.eye(3))
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the axes of the probe are not perpendicular unit vectors \
of a right-handed system
    """
    given = as_numbers(rotation, f"the axes of {of}")
    if (
        given.shape != (3, 3)
        or not np.all(np.abs(given) <= 1.0 + _ROUNDING)
        or np.abs(given.T @ given - np.eye(3)).max() > _ROUNDING
        or np.linalg.det(given) < 0.0
    ):
        raise PretravelError(
            f"the axes of {of} are not perpendicular unit vectors of a right-handed system"
        )
    return given


def turned_about_axes(about_x: float, about_y: float, about_z: float) -> FloatArray:
    """Rotation by turns about fixed axes x, y and z, in that order: Rz Ry Rx.

    Parameters
    ----------
    about_x, about_y, about_z : float
        Counter-clockwise. [rad]

    Returns
    -------
    (3, 3) float

    >>> turned_about_axes(0.0, 0.0, math.pi / 2).round(12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    x, y, z = (
        turned_about_vector(angle * axis)
        for angle, axis in zip((about_x, about_y, about_z), np.eye(3), strict=True)
    )
    return np.asarray(z @ y @ x)


def turned_about_vector(vector: npt.ArrayLike) -> FloatArray:
    """Rotation about a vector by its length, by the formula of Rodrigues.

    It is written out because scipy's rotations take a tenth of a second to import, in every
    command.

    Parameters
    ----------
    vector : (3,) float
        [rad]

    Returns
    -------
    (3, 3) float

    >>> turned_about_vector([0.0, 0.0, math.pi / 2]).round(12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    x, y, z = (float(c) for c in np.asarray(vector, dtype=np.float64))
    angle = math.hypot(x, y, z)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # np.sinc(t) is sin(pi t) / (pi t), also at zero.
    first, half = np.sinc(angle / math.pi), np.sinc(0.5 * angle / math.pi)
    return np.asarray(np.eye(3) + first * cross + 0.5 * half**2 * (cross @ cross))


@dataclass(frozen=True, eq=False)
class PlacementErrors:
    """The uncertainty of a measured placement.

    Attributes
    ----------
    covariance : (6, 6) float
        Of the shift of the part along the machine's axes and of its turns about them, about the
        point `about`. [mm², mm rad, rad²]
    about : (3,) float
        Machine frame. [mm]
    undetermined : (6, k) float
        Motions that the touches did not determine: shifts and turns about the part's origin, along
        the part's axes. [mm, rad]
    """

    covariance: FloatArray
    about: FloatArray
    undetermined: FloatArray

    def __post_init__(self) -> None:
        checked_values(self.covariance, "the covariance of a placement", NUMBER)
        checked_values(self.about, "the middle of a placement", COORDINATE)
        checked_values(self.undetermined, "the motions of a placement", NUMBER)
        shapes = np.shape(self.covariance), np.shape(self.about), np.shape(self.undetermined)[:1]
        if shapes != ((6, 6), (3,), (6,)):
            raise PretravelError(
                "the uncertainty of a placement needs a covariance (6, 6) of the shifts and "
                "rotations, a centre (3,) and a row for each of the six motions"
            )

    def factors(self, points: FloatArray) -> FloatArray:
        """Independent movements of points of the machine with the part, (k, n, 3). [mm]

        Each is that of one cause at one standard uncertainty.
        """
        values, vectors = np.linalg.eigh(np.asarray(self.covariance))
        roots = (vectors * np.sqrt(np.maximum(values, 0.0))).T
        roots = roots[values > 1e-9 * max(float(values[-1]), 0.0)]
        arms = points - np.asarray(self.about)
        return np.array([root[:3] + np.cross(root[3:], arms) for root in roots]).reshape(
            -1, len(points), 3
        )


@dataclass(frozen=True, eq=False)
class Placement:
    """The place of a part's frame in the machine: x_machine = rotation x_part + shift.

    Attributes
    ----------
    rotation : (3, 3) float
    shift : (3,) float
        [mm]
    errors : PlacementErrors or None
        Where it was measured.

    >>> Placement().points(np.array([[1.0, 2.0, 3.0]])).tolist()
    [[1.0, 2.0, 3.0]]
    """

    rotation: FloatArray = field(default_factory=lambda: frozen(np.eye(3)))
    shift: FloatArray = field(default_factory=lambda: frozen(np.zeros(3)))
    errors: PlacementErrors | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", checked_rotation(self.rotation, "the part"))
        shift = checked_values(self.shift, "the shift of a placement", COORDINATE)
        object.__setattr__(self, "shift", shift)

    def points(self, points: FloatArray) -> FloatArray:
        """Points of the part in the machine, (n, 3). [mm]"""
        return np.asarray(points @ self.rotation.T + self.shift)

    def vectors(self, vectors: FloatArray) -> FloatArray:
        """Directions in the part as directions in the machine, (n, 3)."""
        return np.asarray(vectors @ self.rotation.T)

    def moved(self, motion: FloatArray, about: npt.ArrayLike = (0.0, 0.0, 0.0)) -> Placement:
        """After a shift [mm] and a turn [rad], (6,), about a point of the outer frame. [mm]

        >>> Placement().moved(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.5 * math.pi])).shift.tolist()
        [1.0, 0.0, 0.0]
        """
        middle = np.asarray(about, dtype=np.float64)
        turn = turned_about_vector(motion[3:])
        left, _, right = np.linalg.svd(turn @ self.rotation)
        shift = turn @ (self.shift - middle) + middle + motion[:3]
        return Placement(frozen(left @ right), frozen(shift))

    @property
    def inverse(self) -> Placement:
        """From the machine to the part."""
        return Placement(frozen(self.rotation.T), frozen(-self.rotation.T @ self.shift))

    def typed(self) -> str:
        """A placement as it is typed: x,y,z in mm, then turns about x, y and z in degrees.

        >>> parse_placement("1,2,3,0,0,90").typed()
        '1,2,3,0,0,90'
        """
        from scipy.spatial.transform import Rotation

        angles = Rotation.from_matrix(np.array(self.rotation)).as_euler("xyz") / DEGREE
        numbers = [*(round(value, 6) for value in self.shift), *(round(a, 7) for a in angles)]
        return ",".join(f"{value + 0.0:.10g}" for value in numbers)


def parse_placement(text: str) -> Placement:
    """A placement from ``x,y,z`` or ``x,y,z,a,b,c``.

    Parameters
    ----------
    text : str
        Shift in mm, then rotations in degrees about the machine's x, y and z axes, in that order.

    Raises
    ------
    PretravelError

    >>> parse_placement("0,0,0,0,0,90").vectors(np.array([[1.0, 0.0, 0.0]])).round(9).tolist()
    [[0.0, 1.0, 0.0]]
    """
    try:
        numbers = [] if "_" in text else [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 6) or not all(math.isfinite(value) for value in numbers):
        raise PretravelError(
            f"placement '{text}': expected x,y,z in mm, or x,y,z,a,b,c with rotations in degrees; "
            "the decimal sign is a point",
            inputs=("place",),
        )
    checked_values(numbers, "placement", NUMBER)
    turn = turned_about_axes(*(angle * DEGREE for angle in numbers[3:] or (0.0, 0.0, 0.0)))
    return Placement(frozen(turn), frozen(numbers[:3]))
