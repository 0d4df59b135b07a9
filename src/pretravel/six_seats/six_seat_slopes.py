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
from pretravel.six_seats.response import hertz_power_and_slope
from pretravel.six_seats.uneven_seats import (
    OF_RODS,
    OF_SEATS,
    PARAMETERS,
    SEAT_SIDES,
    SixSeats,
    six_seats,
)

_COLUMN = {parameter.name: column for column, parameter in enumerate(PARAMETERS)}
_SEATS = np.arange(6)
_OF_REACTIONS = 24
"""Numbers of a direction that are reactions: at rest, and per force along x, y, z."""


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
    in each direction, and of four deflections. Its derivatives by these are followed by those of
    these by the parameters, which are the same in all directions: one product of matrices.
    """
    change = directions @ np.swapaxes(seats.per_force, -1, -2)
    at_rest = seats.at_rest[..., None, :]
    force, opening = trigger_force(at_rest, change)
    opens = opening[..., None] == _SEATS
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):  # that never trigger
        trigger = _AtTrigger(directions, change, force, opens, at_rest)
        return _pretravel_and_slopes(seats, trigger, compression)


class _AtTrigger(NamedTuple):
    directions: FloatArray
    change: FloatArray
    """Of the reactions per unit of force, (..., n, 6)."""
    force: FloatArray
    opens: BoolArray
    """Whether a seat is the one that opens, (..., n, 6)."""
    at_rest: FloatArray
    """(..., 1, 6)"""


def _pretravel_and_slopes(
    seats: SixSeats, trigger: _AtTrigger, compression: float
) -> tuple[FloatArray, FloatArray]:
    n, change, force, opens, at_rest = trigger
    squares = n**2
    lateral = seats.lateral_compliance[..., None] * (squares[..., 0] + squares[..., 1])
    axial = seats.named["axial_deflection"][..., None] * squares[..., 2]
    # Hertz's law at the seats; rounding must not leave the one that opens above or below zero.
    pressed = np.maximum(at_rest + force[..., None] * change, 0.0)
    pressed[opens] = 0.0
    power, slope = hertz_power_and_slope(pressed)
    slope[opens] = 0.0
    hertz = seats.seat_coefficient[..., None, None]
    root = np.cbrt(at_rest)
    sunk = hertz * (power - root**2)
    steep = hertz * slope * change
    moved = np.einsum("...j,...j->...", sunk, change)
    approach = compression * seats.tip_coefficient[..., None] * np.cbrt(force**2)
    bent, pressed_in = force * lateral, force * axial
    pretravel = bent + pressed_in + moved + approach
    by_force = lateral + axial + np.einsum("...j,...j->...", steep, change)
    by_force += 2.0 / 3.0 * approach / force
    # By the reactions at rest and per force; those of the seat that opens determine the force.
    of_opening = np.where(opens, -by_force[..., None] / change, 0.0)
    rows = np.empty((*force.shape, _OF_REACTIONS + 4))
    rows[..., :6] = steep - (hertz * (2.0 / 3.0) / root) * change + of_opening
    by_change = sunk + force[..., None] * (steep + of_opening)
    for axis in range(3):
        along = slice(6 * axis + 6, 6 * axis + 12)
        np.multiply(by_change, n[..., axis, None], out=rows[..., along])
    rows[..., _OF_REACTIONS:] = np.stack([bent, pressed_in, moved, approach], axis=-1)
    return np.asarray(pretravel), np.asarray(rows @ _slopes_of_rows(seats))


def _slopes_of_rows(seats: SixSeats) -> FloatArray:
    """Derivatives by the parameters of the reactions at rest and per force along x, y, z, and of
    the deflections across and along the axis, at the seats and at the tip, (..., 28, 18).

    For W r = -w the derivative is W r' = -w' - W' r; each column of W depends on the azimuth and
    the radius of one rod and on the angle of one seat. Deflections: relative derivatives.
    """
    turned = seats.inverse @ _column_slopes(seats)  # (..., 6, 18)
    loads = np.empty((*turned.shape[:-2], 4, 1, 18))
    loads.reshape(*turned.shape[:-2], 4, 3, 6)[..., 0, :, :] = seats.at_rest[..., None, :]
    loads.reshape(*turned.shape[:-2], 4, 3, 6)[..., 1:, :, :] = np.swapaxes(
        seats.per_force, -1, -2
    )[..., None, :]
    by_geometry = (turned[..., None, :, :] * loads).reshape(-1, 18) @ _GEOMETRY
    found = np.empty((*turned.shape[:-2], _OF_REACTIONS + 4, 18))
    found[..., :_OF_REACTIONS, :] = by_geometry.reshape(*turned.shape[:-2], _OF_REACTIONS, 18)
    about_x, about_y = seats.inverse[..., 3], seats.inverse[..., 4]
    found[..., :6, _COLUMN["spring_y"]] += about_x
    found[..., :6, _COLUMN["spring_x"]] -= about_y
    lever = seats.named["lever_ratio"][..., None]
    found[..., 6:12, _COLUMN["lever_ratio"]] += lever * about_y
    found[..., 12:18, _COLUMN["lever_ratio"]] -= lever * about_x
    found[..., _OF_REACTIONS:, :] = _OF_DEFLECTIONS
    angle = seats.named["support_angle"]
    found[..., _OF_REACTIONS + 2, _COLUMN["support_angle"]] = 2.0 / 3.0 / np.tan(angle)
    return found


def _column_slopes(seats: SixSeats) -> FloatArray:
    """Derivatives of the wrenches of the seats by azimuth, radius and angle, (..., 6, 18)."""
    azimuth, radius = np.repeat(seats.azimuths, 2, axis=-1), np.repeat(seats.radii, 2, axis=-1)
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    upright, steep = np.cos(seats.angles), np.sin(seats.angles)
    flat, level = SEAT_SIDES * upright, SEAT_SIDES * steep
    # Normal: flat t + steep z; moment: radius (flat z - steep t), as in `seat_wrenches`.
    lift, push = radius * steep, radius * upright
    found = np.zeros((*azimuth.shape[:-1], 6, 3, 6))
    by_azimuth, by_radius, by_angle = (found[..., kind, :] for kind in range(3))
    np.multiply(-flat, cosine, out=by_azimuth[..., 0, :])
    np.multiply(-flat, sine, out=by_azimuth[..., 1, :])
    np.multiply(lift, cosine, out=by_azimuth[..., 3, :])
    np.multiply(lift, sine, out=by_azimuth[..., 4, :])
    np.multiply(steep, sine, out=by_radius[..., 3, :])
    np.multiply(-steep, cosine, out=by_radius[..., 4, :])
    by_radius[..., 5, :] = flat
    np.multiply(level, sine, out=by_angle[..., 0, :])
    np.multiply(-level, cosine, out=by_angle[..., 1, :])
    by_angle[..., 2, :] = upright
    np.multiply(push, sine, out=by_angle[..., 3, :])
    np.multiply(-push, cosine, out=by_angle[..., 4, :])
    np.multiply(-radius, level, out=by_angle[..., 5, :])
    return found.reshape(*azimuth.shape[:-1], 6, 18)


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


def _deflection_slopes() -> FloatArray:
    """Relative derivatives of four deflections by the parameters; not those by the angle, (4, 18).

    The lever carries the force: more of it bends more, and presses the tip.
    """
    found = np.zeros((4, len(PARAMETERS)))
    names = ("lateral_deflection", "axial_deflection", "seat_indentation", "tip_approach")
    found[np.arange(4), [_COLUMN[name] for name in names]] = 1.0
    found[0, _COLUMN["lever_ratio"]], found[3, _COLUMN["lever_ratio"]] = 1.0, 2.0 / 3.0
    return found


_GEOMETRY = -_geometry_slopes().reshape(18, -1)
_OF_DEFLECTIONS = _deflection_slopes()
