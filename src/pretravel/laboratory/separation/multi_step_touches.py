"""Readings of a multi-step test from touches of the reference at each orientation of the probe."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    FloatArray,
    IntArray,
    PretravelError,
    azimuth_angle,
    frozen,
    polar_angle,
    probe_rotation,
)
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.qualification import several_feeds
from pretravel.touches import Touches, quantisation_step
from pretravel.uncertainty import fit_sphere

_ACROSS = 2.0 * DEGREE
"""Largest angle between a normal and the plane across the probe's axis. [rad]"""
_SAME = 0.5 * DEGREE
"""Within which two azimuths are the same direction. [rad]"""
FEWEST_TOUCHED = 6
"""Directions around the circle: a circle takes three numbers of each setup."""
_TURN = 2.0 * math.pi
_SMALLEST = 0.2
"""Radius of a circle of tip and reference together, or of a tip in a ring. [mm]"""
_OTHER_RADIUS = 0.2
"""Difference of radii that neither pretravel nor another qualification makes. [mm]"""


@dataclass(frozen=True, eq=False)
class MultiStepTouches:
    """The readings of a multi-step test, with the circles that they are deviations from.

    Attributes
    ----------
    readings : MultiStepReadings
        In the order of the touches; radial distances less that of the circle of their setup.
    orientations : (k,) float
        Of the probe about its axis. [rad]
    centers : (k, 2) float
        Of the circles, across the axis. [mm]
    radii : (k,) float
        [mm]
    notes : tuple of str
        Sentences on what the circles take away.
    """

    readings: MultiStepReadings
    orientations: FloatArray
    centers: FloatArray
    radii: FloatArray
    notes: tuple[str, ...]


def readings_of_touches(
    touches: Touches, *, axis: npt.ArrayLike = (0.0, 0.0, 1.0)
) -> MultiStepTouches:
    """Readings from touches around the equator of a sphere, or in a ring, at several setups.

    Parameters
    ----------
    touches : Touches
        They state the orientation of the probe about its axis (`Touches.spindle`), which differs
        by whole steps between the directions. In each setup the same directions are touched, at
        equal angles, each once or several times.
    axis : (3,) float
        The probe's +z in the machine frame.

    Raises
    ------
    PretravelError
        Touches without orientations, away from the equator, at unequal angles, in different
        directions; orientations between the steps; fewer than six directions or two setups.

    Notes
    -----
    A radial distance is that of the circle, plus the machine's error, less the probe's (equation
    1). The circle of a setup is that of a qualification made in it: its centre and radius contain
    the place of the tip, and with it all of the mean and of the first harmonic of both errors.
    These are not determined. The derivatives of the circles are in `MultiStepReadings.circles`, so
    that a separation counts what they take from each direction.

    References
    ----------
    Nafi and Mayer 2011, section II and equation 1.

    >>> step = np.arange(12) * np.pi / 6
    >>> n = np.stack([np.cos(step), np.sin(step), 0 * step], axis=1)
    >>> lobes = [1e-3 * np.cos(3 * (step - turn)) for turn in step]
    >>> positions = np.concatenate([n * (13.0 - each)[:, None] for each in lobes])
    >>> touched = Touches(positions, np.tile(n, (12, 1)), spindle=np.repeat(step, 12))
    >>> found = readings_of_touches(touched)
    >>> len(found.readings), bool(np.ptp(found.readings.errors) > 1.9e-3)
    (144, True)
    """
    if touches.spindle is None:
        raise PretravelError(
            "these touches do not give the orientation of the probe, in degrees about its axis: "
            "a multi-step test needs a column spindle_deg or readings with machine_index, "
            "probe_index and error_um"
        )
    _without_words_of_setups(touches).refuse_several(one_reference=True)
    turn = probe_rotation(axis, 0.0)
    normals, positions = touches.normals @ turn, touches.positions @ turn
    off = np.abs(polar_angle(normals) - 0.5 * math.pi)
    if off.max() > _ACROSS:
        row = int(np.argmax(off))
        raise PretravelError(
            f"{touches.where(row)} is {off[row] / DEGREE:.1f}° off the plane across the probe's "
            "axis: a multi-step test touches the equator of the reference"
        )
    inward = bool(np.median(np.sum((positions - positions.mean(axis=0)) * normals, axis=1)) < 0.0)
    first, step, direction = _directions(azimuth_angle(normals), touches)
    orientations, setup = _setups(np.asarray(touches.spindle), step)
    shift = np.rint(orientations / step).astype(np.int64)
    count = round(_TURN / step)
    _check_setups(direction, setup, orientations, count)
    errors = np.empty(len(touches))
    centers, radii = np.empty((len(orientations), 2)), np.empty(len(orientations))
    for number in range(len(orientations)):
        rows = np.flatnonzero(setup == number)
        fit = fit_sphere(positions[rows, :2])
        centers[number], radii[number] = fit.center, fit.radius
        errors[rows] = np.linalg.norm(positions[rows, :2] - fit.center, axis=1) - fit.radius
    _check_circles(radii, orientations)
    _check_feeds(touches, setup, orientations)
    if inward:  # in a ring a late trigger makes the circle larger, on a sphere smaller
        errors = -errors
    machine, probe = direction + 1, np.mod(direction - shift[setup], count) + 1
    circles = circles_of_setups(setup, np.asarray(first + direction * step))
    readings = MultiStepReadings(
        machine,
        probe,
        errors,
        circles=circles,
        first_azimuth=first,
        directions=count,
        step=quantisation_step(touches.positions),
    )
    note = (
        f"the readings are deviations from {len(orientations)} circles, one for each orientation "
        "of the probe: the mean and the first harmonic of both errors are in their radii and "
        "centres and are not determined"
    )
    return MultiStepTouches(readings, frozen(orientations), frozen(centers), frozen(radii), (note,))


def _directions(azimuth: FloatArray, touches: Touches) -> tuple[float, float, IntArray]:
    """The first azimuth, the step, and the number of each touch's direction from 0."""
    around = np.mod(azimuth, _TURN)
    order = np.sort(around)
    gaps = np.diff(np.append(order, order[0] + _TURN))
    count = int(np.sum(gaps > _SAME))
    if count < FEWEST_TOUCHED:
        raise PretravelError(
            f"the touches have {count} directions around the circle; a multi-step test needs "
            f"{FEWEST_TOUCHED} or more, better 12 to 24"
        )
    step = _TURN / count
    # The phase of all directions together, on a circle of one step.
    phase = float(np.angle(np.mean(np.exp(1j * around * count)))) / count
    first = phase if phase >= -_SAME else phase + step
    number = np.rint((around - first) / step).astype(np.int64)
    off = np.abs(around - first - number * step)
    if off.max() > _SAME:
        row = int(np.argmax(off))
        raise PretravelError(
            f"{touches.where(row)} is {off[row] / DEGREE:.1f}° off one of {count} equal steps "
            f"of {step / DEGREE:g}°: a multi-step test touches at equal angles"
        )
    return first, step, np.mod(number, count)


def _setups(spindle: FloatArray, step: float) -> tuple[FloatArray, IntArray]:
    """The orientations, and the number of each touch's setup."""
    steps = np.rint(spindle / step)
    off = np.abs(spindle - steps * step)
    if off.max() > _SAME:
        worst = float(spindle[np.argmax(off)])
        raise PretravelError(
            f"the orientation of {worst / DEGREE:g}° is not a whole step of {step / DEGREE:g}° "
            "between the directions: turn the probe by whole steps, so that each of its "
            "directions meets several of the machine's"
        )
    count = round(_TURN / step)
    turned, setup = np.unique(np.mod(steps, count), return_inverse=True)
    if len(turned) < 2:
        raise PretravelError(
            "all touches have one orientation of the probe: turn it by whole steps and touch again"
        )
    return turned * step, setup.astype(np.int64)


def _check_setups(
    direction: IntArray, setup: IntArray, orientations: FloatArray, count: int
) -> None:
    for number, angle in enumerate(orientations):
        touched = np.unique(direction[setup == number])
        if len(touched) < max(count // 2, 4):
            raise PretravelError(
                f"at the orientation of {angle / DEGREE:g}° only {len(touched)} of {count} "
                "directions were touched: they do not show the circle of this setup"
            )


def _without_words_of_setups(touches: Touches) -> Touches:
    """The touches without words of their orientation, where these are those of the setups."""
    if touches.orientations is None or touches.spindle is None:
        return touches
    pairs = {*zip(touches.orientations, touches.spindle.tolist(), strict=True)}
    several = len(pairs) > len({angle for _, angle in pairs})
    return touches if several else replace(touches, orientations=None)


def _check_circles(radii: FloatArray, orientations: FloatArray) -> None:
    """Refuse circles that no tip leaves on one reference."""
    smallest, middle = float(radii.min()), float(np.median(radii))
    if smallest < _SMALLEST:
        raise PretravelError(
            f"the touches lie on a circle with a radius of {smallest:.4g} mm: are the positions in "
            "mm?"
        )
    other = int(np.argmax(np.abs(radii - middle)))
    if abs(float(radii[other]) - middle) > _OTHER_RADIUS:
        raise PretravelError(
            f"at the orientation of {orientations[other] / DEGREE:g}° the touches lie on a circle "
            f"with a radius of {radii[other]:.3f} mm, at others of {middle:.3f} mm: a multi-step "
            "test has one reference and one tip"
        )


def _check_feeds(touches: Touches, setup: IntArray, orientations: FloatArray) -> None:
    """Refuse several feeds in one setup: the circle does not take up their delay travel."""
    for number, angle in enumerate(orientations):
        own = touches.take(setup == number)
        if own.feeds is not None and several_feeds(own):
            feeds = own.feeds
            raise PretravelError(
                f"at the orientation of {angle / DEGREE:g}° the touches are at {feeds.min():g} to "
                f"{feeds.max():g} mm/min: feed × signal delay would look like an error of single "
                "directions. Touch at one feed"
            )


def circles_of_setups(setup: IntArray, azimuth: FloatArray) -> FloatArray:
    """Derivatives of the readings by radius and centre of the circle of each setup, (n, 3 k).

    Parameters
    ----------
    setup : (n,) int
    azimuth : (n,) float
        [rad]
    """
    own = np.equal.outer(setup, np.unique(setup)).astype(np.float64)
    return np.concatenate(
        [own, own * np.cos(azimuth)[:, None], own * np.sin(azimuth)[:, None]], axis=1
    )
