"""Pretravel of the six-seat probe with its derivatives by all 18 parameters, in closed form.

The first seat to open determines the force at the trigger, a ratio of two linear forms of the
direction. All that follows from the force is smooth. Where two seats open together pretravel has
a kink, and the derivatives are those of one side.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pretravel.base import FloatArray
from pretravel.six_seats.event import trigger_force
from pretravel.six_seats.response import hertz_power, hertz_slope
from pretravel.six_seats.seat_frames import SEAT_SIDES
from pretravel.six_seats.uneven_seats import OF_RODS, OF_SEATS, PARAMETERS, SixSeats, six_seats

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
    seats = six_seats(values)
    change = directions @ seats.per_force.T
    force, opening = trigger_force(seats.at_rest, change)
    reactions = seats.at_rest + force[:, None] * change
    # Rounding must not leave the seat that opens a little above or below zero.
    reactions[np.arange(len(force)), opening] = 0.0
    with np.errstate(invalid="ignore"):  # infinite forces: directions that never trigger
        return _pretravel_and_slopes(
            seats, _AtTrigger(directions, change, force, opening, reactions), compression
        )


class _AtTrigger(NamedTuple):
    directions: FloatArray
    change: FloatArray
    """Of the reactions per unit of force, (n, 6)."""
    force: FloatArray
    opening: np.ndarray
    reactions: FloatArray


class _Change(NamedTuple):
    """Derivatives by the parameters of what a trigger consists of."""

    at_rest: FloatArray
    """(6, 18)"""
    change: FloatArray
    """(n, 6, 18)"""
    force: FloatArray
    """(n, 18)"""
    reactions: FloatArray
    """(n, 6, 18)"""


def _pretravel_and_slopes(
    seats: SixSeats, trigger: _AtTrigger, compression: float
) -> tuple[FloatArray, FloatArray]:
    slopes = _slopes(seats, trigger)
    stem, stem_slopes = _stem(seats, trigger, slopes)
    sunk, sunk_slopes = _seats(seats, trigger, slopes)
    power = np.cbrt(trigger.force**2)
    approach = compression * seats.tip_coefficient * power
    relative = 2.0 / 3.0 * slopes.force / trigger.force[:, None]
    relative[:, _COLUMN["tip_approach"]] += 1.0
    relative[:, _COLUMN["lever_ratio"]] += 2.0 / 3.0
    return stem + sunk + approach, stem_slopes + sunk_slopes + approach[:, None] * relative


def _stem(seats: SixSeats, trigger: _AtTrigger, slopes: _Change) -> tuple[FloatArray, FloatArray]:
    """Linear deflection along the normal and its derivatives."""
    squares = trigger.directions**2
    lateral = seats.lateral_compliance * (squares[:, 0] + squares[:, 1])
    axial = seats.named["axial_deflection"] * squares[:, 2]
    found = slopes.force * (lateral + axial)[:, None]
    found[:, _COLUMN["lateral_deflection"]] += trigger.force * lateral
    found[:, _COLUMN["lever_ratio"]] += trigger.force * lateral
    found[:, _COLUMN["axial_deflection"]] += trigger.force * axial
    return trigger.force * (lateral + axial), found


def _seats(seats: SixSeats, trigger: _AtTrigger, slopes: _Change) -> tuple[FloatArray, FloatArray]:
    """Motion of the tip along the normal by the seats' indentations, and its derivatives."""
    pressed = np.maximum(trigger.reactions, 0.0)
    sunk = hertz_power(pressed) - np.cbrt(seats.at_rest**2)
    coefficient = seats.seat_coefficient
    moved = coefficient * np.sum(sunk * trigger.change, axis=1)
    by_reaction = (hertz_slope(pressed) * trigger.change)[:, :, None]
    at_rest = 2.0 / 3.0 / np.cbrt(seats.at_rest)[:, None] * slopes.at_rest
    found = coefficient * (
        np.sum(by_reaction * slopes.reactions + sunk[:, :, None] * slopes.change, axis=1)
        - trigger.change @ at_rest
    )
    found[:, _COLUMN["seat_indentation"]] += moved
    angle = seats.named["support_angle"]
    found[:, _COLUMN["support_angle"]] += moved * 2.0 / 3.0 / math.tan(angle)
    return moved, np.asarray(found)


def _slopes(seats: SixSeats, trigger: _AtTrigger) -> _Change:
    """Derivatives of reactions and force; that of the seat that opens stays zero."""
    at_rest, per_force = _reaction_slopes(seats)
    change = (trigger.directions @ per_force.reshape(3, -1)).reshape(-1, *at_rest.shape)
    row, seat = np.arange(len(trigger.force)), trigger.opening
    force = -(at_rest[seat] + trigger.force[:, None] * change[row, seat])
    force /= trigger.change[row, seat][:, None]
    reactions = (
        at_rest
        + trigger.force[:, None, None] * change
        + trigger.change[:, :, None] * force[:, None, :]
    )
    reactions[row, seat] = 0.0
    return _Change(at_rest, change, force, reactions)


def _reaction_slopes(seats: SixSeats) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the reactions at rest, (6, 18), and per force on the tip, (3, 6, 18).

    For W r = -w the derivative is W r' = -w' - W' r; each column of W depends on the azimuth and
    the radius of one rod and on the angle of one seat.
    """
    moved = np.zeros((6, len(PARAMETERS)))
    moved[:, _COLUMN["spring_y"]] = seats.inverse[:, 3]
    moved[:, _COLUMN["spring_x"]] = -seats.inverse[:, 4]
    per_force = np.zeros((3, 6, len(PARAMETERS)))
    lever = seats.named["lever_ratio"]
    per_force[0, :, _COLUMN["lever_ratio"]] = lever * seats.inverse[:, 4]
    per_force[1, :, _COLUMN["lever_ratio"]] = -lever * seats.inverse[:, 3]
    turned = seats.inverse @ _column_slopes(seats)
    loads = np.concatenate([seats.at_rest[None], seats.per_force.T])
    carried = ((turned[:, None] * loads[:, None, :]) @ _GEOMETRY[:, None]).sum(axis=0)
    return moved - carried[0], per_force - carried[1:]


def _column_slopes(seats: SixSeats) -> FloatArray:
    """Derivatives of the wrenches of the seats by azimuth, radius and angle, (3, 6, 6)."""
    azimuth, radius = np.repeat(seats.azimuths, 2), np.repeat(seats.radii, 2)
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    side, nothing = SEAT_SIDES, np.zeros(6)
    upright, steep = np.cos(seats.angles), np.sin(seats.angles)
    flat, level = side * upright, side * steep
    # Normal: flat t + steep z; moment: radius (flat z - steep t), as in `seat_wrenches`.
    lift, push = radius * steep, radius * upright
    return np.array(
        [
            [-flat * cosine, -flat * sine, nothing, lift * cosine, lift * sine, nothing],
            [nothing, nothing, nothing, steep * sine, -steep * cosine, flat],
            [level * sine, -level * cosine, upright, push * sine, -push * cosine, -radius * level],
        ]
    )


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


_GEOMETRY = _geometry_slopes()
