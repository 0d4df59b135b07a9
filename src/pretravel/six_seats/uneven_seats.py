"""The six-seat probe with 18 parameters, for fitting to touches.

Touches on a sphere contain displacements only. Therefore forces are in units of the preload and
lengths in units of the tripod's radius. Seven parameters describe an ideal probe, and eleven
small ones its asymmetry (Estler).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, BoolArray, FloatArray, PretravelError, frozen
from pretravel.six_seats.response import ProbeResponse


class Parameter(NamedTuple):
    """One parameter of the six-seat probe, with its prior distribution."""

    name: str
    unit: str
    typical: float
    spread: float
    """Standard deviation; of the logarithm where `logarithmic`, of the tangent's where `acute`."""
    logarithmic: bool = False
    acute: bool = False
    """An angle between flat and upright: a fit seeks the logarithm of its tangent."""

    def physical(self, value: float) -> float:
        """The parameter's value, from the fitted number."""
        return math.exp(value) if self.logarithmic else value

    @property
    def prior(self) -> float:
        return math.log(self.typical) if self.logarithmic else self.typical

    @property
    def prior_of_unknown(self) -> float:
        """Of the number that a fit seeks."""
        return math.log(math.tan(self.typical)) if self.acute else self.prior


_UNKNOWN = 100.0

IDEAL: tuple[Parameter, ...] = (
    Parameter("lever_ratio", "1", 5.0, 0.7, True),
    Parameter("support_angle", "rad", 35.0 * DEGREE, 0.45, acute=True),
    Parameter("rod_azimuth", "rad", 0.0, _UNKNOWN),
    Parameter("lateral_deflection", "mm", 10.0 * MICROMETRE, 2.0, True),
    Parameter("seat_indentation", "mm", 0.25 * MICROMETRE, 0.7, True),
    Parameter("axial_deflection", "mm", 0.3 * MICROMETRE, 1.0, True),
    Parameter("tip_approach", "mm", 0.2 * MICROMETRE, 0.5, True),
)
"""Of the ideal probe: lever over tripod radius; the seats' angle from the horizontal (± 12°, and
hardly ever flat or upright: there rods wedge in their seats, or are not held sideways); azimuth
of the first rod; linear deflection of the tip under a lateral force of preload / lever_ratio;
Hertz's indentation of a seat at rest; linear deflection along the axis under the preload (the
stem's compression is 0.05 µm of it, or 0.15 µm of a steel stem; rods and body bend by more, and do
not bend by less with a shorter stylus, as it does across the axis); Hertz's approach of tip and
flat part under preload / lever_ratio."""

ASYMMETRIES: tuple[Parameter, ...] = (
    Parameter("spring_x", "tripod radius", 0.0, 0.02),
    Parameter("spring_y", "tripod radius", 0.0, 0.02),
    *(Parameter(f"rod_azimuth_{i}", "rad", 0.0, 0.01) for i in (1, 2)),
    *(Parameter(f"rod_radius_{i}", "tripod radius", 0.0, 0.01) for i in (1, 2)),
    *(Parameter(f"support_angle_{i}", "rad", 0.0, 0.01) for i in (1, 2, 3, 4, 5)),
)
"""Offset of the spring from the axis; deviations of the rods from 120° and from one radius;
differences between the angles of the seats. Two (five) contrasts for three rods (six seats): the
mean belongs to the ideal probe."""

PARAMETERS = IDEAL + ASYMMETRIES


def _contrasts(count: int) -> FloatArray:
    """Orthonormal contrasts of some numbers, (count - 1, count): rows add up to zero (Helmert)."""
    found = np.tril(np.ones((count - 1, count)))
    row = np.arange(1, count)
    found[row - 1, row] = -row
    return np.asarray(found / np.sqrt(row * (row + 1.0))[:, None])


OF_RODS, OF_SEATS = _contrasts(3), _contrasts(6)
"""Contrasts of the rods (2, 3) and of the seats (5, 6)."""


class SixSeats(NamedTuple):
    """Geometry and reactions of the six seats, in units of the tripod's radius and the preload.

    Of one probe, or of several, whose number is then the first axis of each array (...).
    """

    azimuths: FloatArray
    """Of the rods, (..., 3). [rad]"""
    radii: FloatArray
    """Of the points where the rods rest, (..., 3)."""
    angles: FloatArray
    """Of the seats' normals from the horizontal, (..., 6). [rad]"""
    inverse: FloatArray
    """Of the wrenches of the six seats, (..., 6, 6)."""
    at_rest: FloatArray
    """Reactions under the spring alone, (..., 6)."""
    per_force: FloatArray
    """Change of the reactions for a unit force on the tip along x, y, z, (..., 6, 3)."""
    named: dict[str, FloatArray]
    """The parameters by name, (...,)."""

    @property
    def hold(self) -> BoolArray:
        """Whether all six seats carry a load at rest, (...,)."""
        return np.asarray(self.at_rest.min(axis=-1) > 0.0)

    @property
    def lateral_compliance(self) -> FloatArray:
        """Displacement of the tip per unit of lateral force, (...,). [mm]"""
        return np.asarray(self.named["lateral_deflection"] * self.named["lever_ratio"])

    @property
    def seat_coefficient(self) -> FloatArray:
        """Indentation of a seat per force^(2/3), (...,). [mm]"""
        at_rest = 1.0 / (6.0 * np.sin(self.named["support_angle"]))
        return np.asarray(self.named["seat_indentation"] / at_rest ** (2.0 / 3.0))

    @property
    def tip_coefficient(self) -> FloatArray:
        """Approach of the tip and a flat part per force^(2/3), (...,). [mm]"""
        return np.asarray(self.named["tip_approach"] * self.named["lever_ratio"] ** (2.0 / 3.0))


_LOGARITHMIC = np.array([parameter.logarithmic for parameter in PARAMETERS])
_COLUMN = {parameter.name: column for column, parameter in enumerate(PARAMETERS)}
_OF_RODS = [[_COLUMN[f"{name}_{i}"] for i in (1, 2)] for name in ("rod_azimuth", "rod_radius")]
_OF_SEATS = [_COLUMN[f"support_angle_{i}"] for i in (1, 2, 3, 4, 5)]
_THIRDS = np.arange(3) * 2.0 * np.pi / 3.0


def six_seats(values: FloatArray) -> SixSeats:
    """The six seats of the probe with these numbers.

    Parameters
    ----------
    values : (18,) float
        In the order of `PARAMETERS`; logarithms of the logarithmic ones.

    Raises
    ------
    PretravelError
        Seats that do not hold the tripod.

    >>> seats = six_seats(np.array([parameter.prior for parameter in PARAMETERS]))
    >>> float((seats.at_rest @ np.sin(seats.angles)).round(12))  # they carry the preload
    1.0
    """
    seats = seats_of_probes(values)
    if not seats.hold:
        raise PretravelError("these seats do not hold the tripod: one reaction would be a tension")
    return seats


def seats_of_probes(values: FloatArray) -> SixSeats:
    """As `six_seats`, of several probes (..., 18); `SixSeats.hold` says which of them are one."""
    physical = np.where(_LOGARITHMIC, np.exp(np.where(_LOGARITHMIC, values, 0.0)), values)
    named = {name: physical[..., column] for name, column in _COLUMN.items()}
    azimuths = values[..., _OF_RODS[0]] @ OF_RODS + _THIRDS + named["rod_azimuth"][..., None]
    radii = 1.0 + values[..., _OF_RODS[1]] @ OF_RODS
    angles = named["support_angle"][..., None] + values[..., _OF_SEATS] @ OF_SEATS
    # One factorisation serves the reactions to the spring and to forces on the tip and, transposed,
    # the rigid motion that follows from the seats' indentations.
    inverse = np.asarray(np.linalg.inv(seat_wrenches(azimuths, radii, angles)), dtype=np.float64)
    across, along = named["spring_x"][..., None], named["spring_y"][..., None]
    rest = inverse[..., 2] + along * inverse[..., 3] - across * inverse[..., 4]
    # The tip is below the tripod by the lever: forces along x and y have moments.
    per_force = -inverse[..., :3]
    per_force[..., 0] += named["lever_ratio"][..., None] * inverse[..., 4]
    per_force[..., 1] -= named["lever_ratio"][..., None] * inverse[..., 3]
    return SixSeats(azimuths, radii, angles, inverse, rest, per_force, named)


def six_seat_response(values: FloatArray, tip_radius: float) -> ProbeResponse:
    """The response of the probe with these numbers.

    Parameters
    ----------
    values : (18,) float
        In the order of `PARAMETERS`; logarithms of the logarithmic ones.
    tip_radius : float
        [mm]

    Returns
    -------
    ProbeResponse
        Forces in units of the preload, not in N.

    Raises
    ------
    PretravelError
        Seats that do not hold the tripod.

    Notes
    -----
    Statics as in `pretravel.prediction.seats`, with the tripod's radius as unit of length.

    >>> ideal = np.array([parameter.prior for parameter in PARAMETERS])
    >>> response = six_seat_response(ideal, 3.0)
    >>> response.force(np.array([[0.0, 0.0, 1.0]]))[0].round(9).tolist()  # lifts at the preload
    [1.0]
    """
    seats = six_seats(values)
    return ProbeResponse(
        reaction_change=seats.per_force,
        rest_reactions=seats.at_rest,
        criterion="first_contact",
        threshold=0.0,
        compliance=np.diag([*2 * [seats.lateral_compliance], seats.named["axial_deflection"]]),
        seat_motion=seats.per_force.T,
        seat_coefficient=float(seats.seat_coefficient),
        tip_coefficient=float(seats.tip_coefficient),
        tip_radius=tip_radius,
    )


SEAT_NAMES = ("A-left", "A-right", "B-left", "B-right", "C-left", "C-right")
"""Rods A, B, C in the description's order; left is the counter-clockwise side of the
rod, as seen from the spindle, looking outward along the rod."""


SEAT_SIDES = np.array([-1.0, 1.0] * 3)
"""Sign of each seat's horizontal push, counter-clockwise being positive."""


class SeatFrame(NamedTuple):
    """A right-handed triad at each seat, probe frame."""

    points: FloatArray
    """Points of the rod axes that the seats' normals pass through, (6, 3). [mm]"""
    normals: FloatArray
    """Unit directions of the seats' push on the tripod, (6, 3)."""
    along: FloatArray
    """Unit directions along the rods, outwards, (6, 3)."""
    around: FloatArray
    """normals x along: across the rod, in the contact's plane, (6, 3)."""

    def contacts(self, rod_radius: float) -> FloatArray:
        """Points where rods and balls touch, (6, 3). [mm]"""
        return np.asarray(self.points - rod_radius * self.normals)

    @property
    def wrenches(self) -> FloatArray:
        """Columns: force and moment about the origin of a unit reaction of each seat, (6, 6)."""
        moments = np.cross(self.points, self.normals)
        return np.concatenate([self.normals, moments], axis=1).T


def seat_triads(
    rod_azimuths: npt.ArrayLike, radii: npt.ArrayLike, support_angles: npt.ArrayLike
) -> SeatFrame:
    """The seats of rods that may differ in place and in angle.

    Parameters
    ----------
    rod_azimuths : (3,) float
        [rad]
    radii : float or (3,) float
        From the probe axis to the points where the rods rest. [mm]
    support_angles : float or (6,) float
        Of the seats' normals from the horizontal. [rad]
    """
    azimuths = np.repeat(np.asarray(rod_azimuths, dtype=np.float64), 2)
    radial = np.stack([np.cos(azimuths), np.sin(azimuths), np.zeros(6)], axis=1)
    tangential = np.stack([-np.sin(azimuths), np.cos(azimuths), np.zeros(6)], axis=1)
    # A seat on the counter-clockwise side (left) pushes the rod clockwise and up.
    side = SEAT_SIDES[:, None]
    angle = np.broadcast_to(np.asarray(support_angles, dtype=np.float64), 6)[:, None]
    normals = side * np.cos(angle) * tangential + np.sin(angle) * np.array([0.0, 0.0, 1.0])
    distance = np.repeat(np.broadcast_to(np.asarray(radii, dtype=np.float64), 3), 2)[:, None]
    return SeatFrame(
        points=frozen(distance * radial),
        normals=frozen(normals),
        along=frozen(radial),
        around=frozen(np.cross(normals, radial)),
    )


def tip_wrenches(tip: FloatArray) -> FloatArray:
    """Columns: force and moment about the origin of a unit force on the tip, (6, 3)."""
    return np.concatenate([np.eye(3), np.cross(tip, np.eye(3)).T])


def seat_wrenches(azimuths: FloatArray, radii: FloatArray, angles: FloatArray) -> FloatArray:
    """Wrenches of the six seats of uneven rods, as `SeatFrame.wrenches`, in closed form.

    Parameters
    ----------
    azimuths, radii : (..., 3) float
        Of the rods. [rad], [mm]
    angles : (..., 6) float
        Of the seats' normals from the horizontal. [rad]

    Returns
    -------
    (..., 6, 6) float
        Columns: force and moment about the origin of a unit reaction.

    >>> places = np.radians([0.0, 120.0, 240.0]), np.ones(3), np.full(6, 0.6)
    >>> bool(np.allclose(seat_wrenches(*places), seat_triads(*places).wrenches, atol=1e-15))
    True
    """
    azimuth, radius = np.repeat(azimuths, 2, axis=-1), np.repeat(radii, 2, axis=-1)
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    flat, steep = SEAT_SIDES * np.cos(angles), np.sin(angles)
    # The normal is flat t + steep z, t tangential; its moment is radius (flat z - steep t).
    lever = radius * steep
    return np.stack(
        [-flat * sine, flat * cosine, steep, lever * sine, -lever * cosine, radius * flat], axis=-2
    )
