"""A turn of the probe about its axis that touches in few directions cannot show."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, probe_rotation
from pretravel.maps import Observation, PretravelMap
from pretravel.qualification.change_tests import (
    TESTS,
    TouchesAndMap,
    noncentrality,
    touches_and_map,
    turned_value,
)

USUAL_RATE = 0.01
"""False alarms of all tests of a verification together."""

_ANGLES = np.arange(30.0, 360.0, 30.0) * DEGREE
_CLEAR = 2.0
"""A turn matters where it changes the map by so many times what one touch in the best direction
would show: nine well spread touches always show such a turn."""
_ALIKE = 0.99
"""Of the turns that change a map alike, by lobes, the smallest is taken."""


@dataclass(frozen=True)
class UnseenTurn:
    """The turn that changes a map most, if the touches do not show it.

    Attributes
    ----------
    angle : float
        [rad]
    change : float
        Largest change of the map, apart from a shift of the centre. [mm]
    """

    angle: float
    change: float

    def __str__(self) -> str:
        return (
            "in these directions a turn of the probe looks like a shift of the reference, although "
            f"a turn of {self.angle / DEGREE:.0f}° changes the map by up to "
            f"{self.change / MICROMETRE:.1f} µm"
        )


def unseen_in(observation: Observation, pretravel_map: PretravelMap) -> UnseenTurn | None:
    """The same of touches that are not compared with the map, which can be of few directions."""
    if observation.direction_count < observation.axes + 2:  # a shift fits whatever they show
        return _largest(
            pretravel_map, observation.axes, pretravel_map.repeatability, USUAL_RATE / TESTS
        )
    return unseen_turn(touches_and_map(observation, pretravel_map, 0.0), pretravel_map, USUAL_RATE)


def unseen_turn(
    compared: TouchesAndMap, pretravel_map: PretravelMap, false_alarm_rate: float
) -> UnseenTurn | None:
    """The turn that changes the map most, if the test of all directions would rarely detect it.

    Four touches at every 90° take three lobes, in whatever position, for a shifted centre.

    Parameters
    ----------
    compared : TouchesAndMap
    pretravel_map : PretravelMap
    false_alarm_rate : float
        Of all tests together.

    Returns
    -------
    UnseenTurn or None
        None also where no turn changes the map by much.
    """
    axes, rate = compared.observation.axes, false_alarm_rate / TESTS
    u_of_direction = math.sqrt(float(np.median(np.diagonal(compared.covariance))))
    largest = _largest(pretravel_map, axes, u_of_direction, rate)
    if largest is None:
        return None
    seen = turned_value(compared.observation, pretravel_map, largest.angle) - compared.value
    if seen @ compared.weights @ seen >= noncentrality(len(seen) - axes, rate):
        return None
    return largest


def _largest(
    pretravel_map: PretravelMap, axes: int, u_of_direction: float, rate: float
) -> UnseenTurn | None:
    """The turn that changes the map most; None where that is not much compared with the noise."""
    directions, value, _ = pretravel_map.over_support()
    changes = _changes(pretravel_map, directions, value, axes)
    worst = int(np.argmax(changes > _ALIKE * changes.max()))
    if changes[worst] < _CLEAR * math.sqrt(noncentrality(1, rate)) * u_of_direction:
        return None
    return UnseenTurn(float(_ANGLES[worst]), float(changes[worst]))


def _changes(
    pretravel_map: PretravelMap, directions: FloatArray, value: FloatArray, axes: int
) -> FloatArray:
    """Largest change of the map by each turn, after the best shift of the centre. [mm]"""
    turns = [probe_rotation(rotation=angle) @ pretravel_map.rotation.T for angle in _ANGLES]
    normals = np.concatenate([directions @ turn for turn in turns])
    turned = pretravel_map.pretravel(normals, extrapolate=True).reshape(len(turns), -1).T
    change, center = turned - value[:, None], directions[:, :axes]
    change = change - center @ np.linalg.lstsq(center, change, rcond=None)[0]
    return np.asarray(np.max(np.abs(change), axis=0))
