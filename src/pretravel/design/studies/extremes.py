"""Least and greatest values of a design over all directions, also between those of its grid."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, from_angles, grid
from pretravel.design.studies.conditions import Case
from pretravel.design.studies.definition import Directions
from pretravel.prediction import predict

_STEP = 2.0 * DEGREE
_ROUNDS = 5
_NEAR = 9
"""Directions along each angle about an extreme; each round they are four times as near."""
_OF_OUTPUT = {
    "force": ("trigger_force",),
    "sensing-distance": ("sensing_distance",),
    "pretravel": ("pretravel",),
}


def extremes_between(
    directions: Directions, case: Case, outputs: tuple[str, ...]
) -> dict[str, float]:
    """Least and greatest values over the solid angle that a grid of directions spans.

    Parameters
    ----------
    directions : Directions
        A grid: from its smallest to its largest polar angle and azimuth; azimuths of an even circle
        span the whole circle.
    case : Case
    outputs : tuple of str
        Of a study; those that are not values of a direction are left out.

    Returns
    -------
    dict of str to float
        By the names and in the units of `MEANINGS` in `outputs`: least, greatest, and
        pretravel_range.

    Raises
    ------
    PretravelError
        A probe that never triggers in one of the directions.

    >>> from pretravel.design.studies.conditions import case_of
    >>> from pretravel.design.studies.definition import load_study
    >>> study = load_study("preload-and-seats")
    >>> found = extremes_between(study.directions, case_of(study, {}), ("force",))
    >>> sorted(found)
    ['trigger_force_greatest', 'trigger_force_least']
    """
    names = [name for output in outputs for name in _OF_OUTPUT.get(output, ())]
    if not names:
        return {}
    polar, azimuth, whole = _fine(directions)
    values = _values(case, grid(polar, azimuth))
    found = {}
    for name in names:
        for which, sign in (("least", -1.0), ("greatest", 1.0)):
            row, column = divmod(int(np.argmax(sign * values[name])), len(azimuth))
            place = float(polar[row]), float(azimuth[column])
            found[f"{name}_{which}"] = _refined(case, name, sign, place, (polar, azimuth, whole))
    if "pretravel" in names:
        found["pretravel_range"] = found["pretravel_greatest"] - found["pretravel_least"]
    return found


def _fine(directions: Directions) -> tuple[FloatArray, FloatArray, bool]:
    """Polar angles and azimuths in small steps, and whether the azimuths are a whole circle."""
    azimuth = np.sort(np.asarray(directions.azimuth))
    step = 2.0 * math.pi / len(azimuth)
    whole = len(azimuth) > 2 and np.allclose(np.diff(azimuth), step, atol=1e-6)
    last = azimuth[0] + 2.0 * math.pi if whole else azimuth[-1]
    return _steps(min(directions.polar), max(directions.polar)), _steps(azimuth[0], last), whole


def _steps(low: float, high: float) -> FloatArray:
    return np.linspace(low, high, math.ceil((high - low) / _STEP - 1e-9) + 1)


def _values(case: Case, directions: FloatArray) -> Mapping[str, FloatArray]:
    found = predict(case.probe, directions, case.prediction.model, workpiece=case.part)
    return {
        "trigger_force": found.force,
        "sensing_distance": found.sensing_distance / MICROMETRE,
        "pretravel": found.pretravel / MICROMETRE,
    }


def _refined(
    case: Case,
    name: str,
    sign: float,
    place: tuple[float, float],
    spanned: tuple[FloatArray, FloatArray, bool],
) -> float:
    """The extreme value near a polar angle and an azimuth."""
    polar, azimuth, whole = spanned
    best, reach = -math.inf, _STEP
    for _ in range(_ROUNDS):
        near = np.linspace(-reach, reach, _NEAR)
        p = np.clip(place[0] + near, polar[0], polar[-1])
        a = place[1] + near if whole else np.clip(place[1] + near, azimuth[0], azimuth[-1])
        p, a = np.repeat(p, _NEAR), np.tile(a, _NEAR)
        values = sign * _values(case, from_angles(p, a))[name]
        top = int(np.argmax(values))
        place, best, reach = (float(p[top]), float(a[top])), float(values[top]), reach / 4.0
    return sign * best
