"""The trigger as an event: the force at which a criterion on the reactions is met.

Reactions are linear in the force on the tip, so the force at the trigger is a
closed form: no search is needed.
"""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray, IntArray, PretravelError

PIEZO_STAGE = "piezo_stage"
CRITERIA = ("first_contact", "arm_lift", PIEZO_STAGE)
_NEVER = 1e-12  # unloading per newton below which a seat never opens
_TIE = 1e-9  # relative difference of forces that is no difference


def _first(forces: FloatArray) -> tuple[FloatArray, IntArray]:
    """Smallest force and its column; of columns that tie, the first."""
    # numpy's own minimum over so short an axis takes as long as all the rest.
    smallest = forces[..., 0]
    for column in range(1, forces.shape[-1]):
        smallest = np.minimum(smallest, forces[..., column])
    tied = forces <= smallest[..., None] * (1.0 + _TIE)
    return smallest, np.asarray(tied.argmax(axis=-1), dtype=np.int64)


def watched_loads(reactions: FloatArray, criterion: str) -> FloatArray:
    """The loads that a criterion compares with its threshold.

    Parameters
    ----------
    reactions : (n, 6) float
        Of the seats, or their change per newton.
    criterion : str
        ``first_contact``: the load of each seat; ``arm_lift``: of each rod, on both its seats.

    Returns
    -------
    (n, 6) or (n, 3) float

    Raises
    ------
    PretravelError
        A criterion that is not known, or that watches no loads of seats.

    Notes
    -----
    Frictionless seats cannot hold the tripod once the first has opened. A whole rod can lift
    later only where something else still holds the tripod sideways (friction, a groove).
    ``arm_lift`` is then the classical lever: the rod's load along the probe axis,
    (N_left + N_right) sin(support angle), vanishes while the tripod tips over the other two
    rods. It results in the larger of the two forces, for circuits that sense arms and not single
    contacts.

    >>> watched_loads(np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]]), "arm_lift").tolist()
    [[3.0, 7.0, 11.0]]
    """
    if criterion == "first_contact":
        return reactions
    if criterion == "arm_lift":
        return np.asarray(reactions[:, 0::2] + reactions[:, 1::2])
    if criterion == PIEZO_STAGE:
        raise PretravelError(f"the criterion {PIEZO_STAGE} watches the force on the tip, no seats")
    raise PretravelError(
        f"trigger criterion '{criterion}' is not known; known are {', '.join(CRITERIA)}"
    )


def trigger_force(
    rest_reactions: FloatArray,
    unit_reactions: FloatArray,
    criterion: str = "first_contact",
    threshold: float = 0.0,
) -> tuple[FloatArray, IntArray]:
    """Force at which the first of the watched loads falls to the threshold.

    Parameters
    ----------
    rest_reactions : (6,) float
        [N]
    unit_reactions : (n, 6) float
        Change per newton on the tip. ``first_contact`` also takes (..., 6) of several probes.
    criterion : str
        See `watched_loads`; ``piezo_stage``: the force itself is compared with the threshold.
    threshold : float
        [N]

    Returns
    -------
    force : (n,) float
        Infinite where none of the loads decreases, and where a rod lifts before a piezo stage
        triggers. [N]
    seat : (n,) int
        Which of the six opens; of a rod that lifts, the seat that opens first; with a piezo stage
        the seat that would.

    References
    ----------
    Rodrigues 2021, section 3.2.1; with statics this is Shen & Zhang 1997.

    >>> force, seat = trigger_force(np.full(6, 2.0), np.array([[1, 1, 1, 1, 1, -4.0]]))
    >>> force.tolist(), seat.tolist()
    ([0.5], [5])
    >>> unit = np.array([[0.5, 0.5, 1.0, 1.0, -1.0, -3.0]])
    >>> force, seat = trigger_force(np.full(6, 2.0), unit, "arm_lift")
    >>> force.tolist(), seat.tolist()
    ([1.0], [5])
    """
    if criterion == PIEZO_STAGE:
        lifting, _ = trigger_force(rest_reactions, unit_reactions, "arm_lift")
        _, seat = trigger_force(rest_reactions, unit_reactions)
        return np.where(lifting > threshold, threshold, np.inf), seat
    unit = np.asarray(unit_reactions, dtype=np.float64)
    rest = np.asarray(rest_reactions, dtype=np.float64)
    if criterion != "first_contact":
        rest = np.atleast_2d(rest)
    unloading = -watched_loads(unit, criterion)
    margin = watched_loads(rest, criterion) - threshold
    forces = np.where(unloading > _NEVER, margin / np.maximum(unloading, _NEVER), np.inf)
    force, first = _first(forces)
    if criterion == "first_contact":
        return force, first
    rows = np.arange(len(unit))
    right_first = unit[rows, 2 * first + 1] < unit[rows, 2 * first]
    return force, np.asarray(2 * first + right_first, dtype=np.int64)
