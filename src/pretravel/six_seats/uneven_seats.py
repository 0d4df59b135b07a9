"""The six-seat probe with 18 parameters, for fitting to touches.

Touches on a sphere contain displacements only. Therefore forces are in units of the preload and
lengths in units of the tripod's radius. Seven parameters describe an ideal probe, and eleven
small ones its asymmetry (Estler).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, BoolArray, FloatArray, PretravelError
from pretravel.six_seats.response import ProbeResponse
from pretravel.six_seats.seat_frames import seat_wrenches


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

    Returns
    -------
    SixSeats

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
