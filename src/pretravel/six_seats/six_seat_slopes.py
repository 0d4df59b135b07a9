"""Pretravel of the six-seat probe with its derivatives by all 18 parameters, in closed form.

The first seat to open determines the force at the trigger, a ratio of two linear forms of the
direction. All that follows from the force is smooth. Where two seats open together pretravel has
a kink, and the derivatives are those of one side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pretravel.base import BoolArray, FloatArray
from pretravel.six_seats.event import trigger_force
from pretravel.six_seats.response import hertz_power, hertz_slope
from pretravel.six_seats.uneven_seats import (
    OF_RODS,
    OF_SEATS,
    PARAMETERS,
    SEAT_SIDES,
    SixSeats,
    six_seats,
)

_COLUMN = {parameter.name: column for column, parameter in enumerate(PARAMETERS)}


def six_seat_slopes(
    values: FloatArray, directions: FloatArray, compression: float = 1.0
) -> FloatArray:
    """Derivatives of pretravel by each of `PARAMETERS`, (n, 18): see `six_seat_pretravel`. [mm]"""
    return six_seat_pretravel(values, directions, compression)[1]


def six_seat_pretravel(
    values: FloatArray, directions: FloatArray, compression: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Pretravel of the six-seat probe and its derivatives by the parameters.

    Parameters
    ----------
    values : (18,) float
        In the order of `pretravel.six_seats.uneven_seats.PARAMETERS`; logarithms of the logarithmic
        ones.
    directions : (n, 3) float
        Unit vectors, probe frame.
    compression : float
        Factor on the tip's approach to a flat part.

    Returns
    -------
    pretravel : (n,) float
        Not finite in directions in which the probe never triggers. [mm]
    slopes : (n, 18) float
        By the fitted numbers: by the logarithm of the logarithmic parameters. [mm]

    Raises
    ------
    PretravelError
        Seats that do not hold the tripod.

    >>> ideal = np.array([parameter.prior for parameter in PARAMETERS])
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> from pretravel.six_seats.uneven_seats import six_seat_response
    >>> pretravel, slopes = six_seat_pretravel(ideal, up)
    >>> bool(abs(pretravel[0] - six_seat_response(ideal, 3.0).pretravel(up)[0]) < 1e-15)
    True
    >>> slopes.shape
    (1, 18)
    """
    return pretravel_of_seats(six_seats(values), directions, compression)


def pretravel_of_seats(
    seats: SixSeats, directions: FloatArray, compression: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """As `six_seat_pretravel`, of several probes at once.

    Parameters
    ----------
    seats : SixSeats
        Of probes (...); what is found for one whose seats do not hold it has no meaning.
    directions : (..., n, 3) float
        Of each probe.
    compression : float

    Returns
    -------
    pretravel : (..., n) float
    slopes : (..., n, 18) float

    Notes
    -----
    Pretravel is a function of the reactions at rest and of those per force along n, twelve numbers
    in each direction. Its derivatives by these are followed by those of the reactions by the
    parameters, which are the same in all directions: one product of matrices.
    """
    change = directions @ np.swapaxes(seats.per_force, -1, -2)
    at_rest = np.broadcast_to(seats.at_rest[..., None, :], change.shape)
    force, opening = trigger_force(at_rest.reshape(-1, 6), change.reshape(-1, 6))
    opens = (opening[:, None] == np.arange(6)).reshape(change.shape)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):  # that never trigger
        trigger = _AtTrigger(
            directions, change, np.asarray(force.reshape(change.shape[:-1])), opens, at_rest
        )
        return _pretravel_and_slopes(seats, trigger, compression)


class _AtTrigger(NamedTuple):
    directions: FloatArray
    change: FloatArray
    """Of the reactions per unit of force, (..., n, 6)."""
    force: FloatArray
    opens: BoolArray
    """Whether a seat is the one that opens, (..., n, 6)."""
    at_rest: FloatArray
    """(..., n, 6)"""


def _pretravel_and_slopes(
    seats: SixSeats, trigger: _AtTrigger, compression: float
) -> tuple[FloatArray, FloatArray]:
    n, change, force, opens, at_rest = trigger
    squares = n**2
    lateral = seats.lateral_compliance[..., None] * (squares[..., 0] + squares[..., 1])
    axial = seats.named["axial_deflection"][..., None] * squares[..., 2]
    # Hertz's law at the seats; rounding must not leave the one that opens above or below zero.
    pressed = np.where(opens, 0.0, np.maximum(at_rest + force[..., None] * change, 0.0))
    hertz = seats.seat_coefficient[..., None, None]
    root = np.cbrt(at_rest)
    sunk = hertz * (hertz_power(pressed) - root**2)
    steep = hertz * np.where(opens, 0.0, hertz_slope(pressed) * change)
    moved = np.sum(sunk * change, axis=-1)
    approach = compression * seats.tip_coefficient[..., None] * np.cbrt(force**2)
    pretravel = force * (lateral + axial) + moved + approach
    by_force = lateral + axial + np.sum(steep * change, axis=-1) + 2.0 / 3.0 * approach / force
    # By the reactions at rest and per force; those of the seat that opens determine the force.
    of_opening = np.where(opens, -by_force[..., None] / change, 0.0)
    by_rest = steep - hertz * (2.0 / 3.0) / root * change + of_opening
    by_change = sunk + force[..., None] * (steep + of_opening)
    rows = [by_rest, *(by_change * n[..., axis, None] for axis in range(3))]
    at_rest_slopes = _reaction_slopes(seats)
    slopes = np.concatenate(rows, axis=-1) @ at_rest_slopes.reshape(
        *at_rest_slopes.shape[:-3], 24, -1
    )
    slopes[..., _COLUMN["lateral_deflection"]] += force * lateral
    slopes[..., _COLUMN["axial_deflection"]] += force * axial
    slopes[..., _COLUMN["seat_indentation"]] += moved
    slopes[..., _COLUMN["tip_approach"]] += approach
    slopes[..., _COLUMN["lever_ratio"]] += force * lateral + 2.0 / 3.0 * approach
    angle = seats.named["support_angle"][..., None]
    slopes[..., _COLUMN["support_angle"]] += moved * 2.0 / 3.0 / np.tan(angle)
    return np.asarray(pretravel), np.asarray(slopes)


def _reaction_slopes(seats: SixSeats) -> FloatArray:
    """Derivatives of the reactions at rest and per force along x, y, z, (..., 4, 6, 18).

    For W r = -w the derivative is W r' = -w' - W' r; each column of W depends on the azimuth and
    the radius of one rod and on the angle of one seat.
    """
    turned = seats.inverse[..., None, :, :] @ _column_slopes(seats)  # (..., 3, 6, 6)
    wide = np.concatenate([turned[..., kind, :, :] for kind in range(3)], axis=-1)
    loads = np.concatenate(
        [seats.at_rest[..., None, :], np.swapaxes(seats.per_force, -1, -2)], axis=-2
    )
    loads = np.concatenate([loads, loads, loads], axis=-1)
    found = -((wide[..., None, :, :] * loads[..., :, None, :]) @ _GEOMETRY)
    found[..., 0, :, _COLUMN["spring_y"]] += seats.inverse[..., 3]
    found[..., 0, :, _COLUMN["spring_x"]] -= seats.inverse[..., 4]
    lever = seats.named["lever_ratio"][..., None]
    found[..., 1, :, _COLUMN["lever_ratio"]] += lever * seats.inverse[..., 4]
    found[..., 2, :, _COLUMN["lever_ratio"]] -= lever * seats.inverse[..., 3]
    return np.asarray(found)


def _column_slopes(seats: SixSeats) -> FloatArray:
    """Derivatives of the wrenches of the seats by azimuth, radius and angle, (..., 3, 6, 6)."""
    azimuth, radius = np.repeat(seats.azimuths, 2, axis=-1), np.repeat(seats.radii, 2, axis=-1)
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    side, nothing = SEAT_SIDES, np.zeros_like(azimuth)
    upright, steep = np.cos(seats.angles), np.sin(seats.angles)
    flat, level = side * upright, side * steep
    # Normal: flat t + steep z; moment: radius (flat z - steep t), as in `seat_wrenches`.
    lift, push = radius * steep, radius * upright
    rows = [
        *(-flat * cosine, -flat * sine, nothing, lift * cosine, lift * sine, nothing),
        *(nothing, nothing, nothing, steep * sine, -steep * cosine, flat),
        *(level * sine, -level * cosine, upright, push * sine, -push * cosine, -radius * level),
    ]
    return np.stack(rows, axis=-2).reshape(*azimuth.shape[:-1], 3, 6, 6)


def _geometry_slopes() -> FloatArray:
    """Derivatives of each seat's azimuth, radius and angle by the parameters, (3, 6, 18)."""
    found = np.zeros((3, 6, len(PARAMETERS)))
    azimuth, radius, angle = found
    azimuth[:, _COLUMN["rod_azimuth"]] = 1.0
    angle[:, _COLUMN["support_angle"]] = 1.0
    rods = np.repeat(OF_RODS.T, 2, axis=0)
    for contrast in (1, 2):
        azimuth[:, _COLUMN[f"rod_azimuth_{contrast}"]] = rods[:, contrast - 1]
        radius[:, _COLUMN[f"rod_radius_{contrast}"]] = rods[:, contrast - 1]
    for contrast in range(1, 6):
        angle[:, _COLUMN[f"support_angle_{contrast}"]] = OF_SEATS[contrast - 1]
    return found


_GEOMETRY = _geometry_slopes().reshape(18, -1)
