"""The trigger as an event: the force at which a criterion on the reactions is met.

Reactions are linear in the force on the tip, so the force at the trigger is a
closed form and nothing has to be searched.
"""

from __future__ import annotations

import numpy as np

from pretravel.arrays import FloatArray, IntArray
from pretravel.errors import PretravelError
from pretravel.probe.description import CRITERIA

_NEVER = 1e-12  # unloading per newton below which a seat never opens
_TIE = 1e-9  # relative difference of forces that is no difference


def _first(forces: FloatArray) -> tuple[FloatArray, IntArray]:
    """Smallest force and its column; of columns that tie, the first."""
    smallest = np.min(forces, axis=1)
    tied = forces <= smallest[:, None] * (1.0 + _TIE)
    return smallest, np.asarray(np.argmax(tied, axis=1), dtype=np.int64)


def first_contact(
    rest_reactions: FloatArray, unit_reactions: FloatArray, threshold: float = 0.0
) -> tuple[FloatArray, IntArray]:
    """Force at which the first seat reaction falls to the threshold.

    Parameters
    ----------
    rest_reactions : (6,) float
        [N]
    unit_reactions : (n, 6) float
        Change per newton on the tip.
    threshold : float
        [N]

    Returns
    -------
    force : (n,) float
        Infinite where no seat is unloaded. [N]
    seat : (n,) int
        Which of the six opens.

    References
    ----------
    Rodrigues 2021, section 3.2.1; with statics this is Shen & Zhang 1997.

    >>> force, seat = first_contact(np.full(6, 2.0), np.array([[1, 1, 1, 1, 1, -4.0]]))
    >>> force.tolist(), seat.tolist()
    ([0.5], [5])
    """
    unloading = -np.asarray(unit_reactions, dtype=np.float64)
    margin = np.asarray(rest_reactions) - threshold
    with np.errstate(divide="ignore"):
        forces = np.where(unloading > _NEVER, margin / np.maximum(unloading, _NEVER), np.inf)
    return _first(forces)


def arm_lift(
    rest_reactions: FloatArray, unit_reactions: FloatArray, threshold: float = 0.0
) -> tuple[FloatArray, IntArray]:
    """Force at which a rod lifts: both its seats together carry no more than the threshold.

    Parameters and returns as in `first_contact`; the seat given is the one of the
    lifted rod's two that opened first.

    Notes
    -----
    Frictionless seats cannot hold the tripod once the first has opened; that a
    whole rod lifts later presupposes something that still holds it sideways
    (friction, a groove). The criterion then is the classical lever: the rod's
    load along the probe axis, (N_left + N_right) sin(support angle), falls away while
    the tripod tips over the other two rods. The threshold is one of the sum
    N_left + N_right. It gives the larger of the two forces, for circuits that sense
    arms and not single contacts.

    >>> rest, unit = np.full(6, 2.0), np.array([[0.5, 0.5, 1.0, 1.0, -1.0, -3.0]])
    >>> force, seat = arm_lift(rest, unit)
    >>> force.tolist(), seat.tolist()
    ([1.0], [5])
    """
    unit = np.asarray(unit_reactions, dtype=np.float64)
    unloading = -(unit[:, 0::2] + unit[:, 1::2])
    margin = np.asarray(rest_reactions)[0::2] + np.asarray(rest_reactions)[1::2] - threshold
    with np.errstate(divide="ignore"):
        forces = np.where(unloading > _NEVER, margin / np.maximum(unloading, _NEVER), np.inf)
    force, rod = _first(forces)
    rows = np.arange(len(unit))
    right_first = unit[rows, 2 * rod + 1] < unit[rows, 2 * rod]
    return force, np.asarray(2 * rod + right_first, dtype=np.int64)


def trigger_force(
    rest_reactions: FloatArray,
    unit_reactions: FloatArray,
    criterion: str = "first_contact",
    threshold: float = 0.0,
) -> tuple[FloatArray, IntArray]:
    """Trigger force and opening seat by the named criterion.

    Raises
    ------
    PretravelError
        A criterion that is not known.

    >>> trigger_force(np.full(6, 2.0), np.ones((1, 6)))[0].tolist()
    [inf]
    """
    if criterion == "first_contact":
        return first_contact(rest_reactions, unit_reactions, threshold)
    if criterion == "arm_lift":
        return arm_lift(rest_reactions, unit_reactions, threshold)
    raise PretravelError(
        f"trigger criterion '{criterion}' is not known; known are {', '.join(CRITERIA)}"
    )
