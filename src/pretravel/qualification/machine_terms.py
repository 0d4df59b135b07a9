"""Scale, squareness and backlash of a machine: what they do to a latched position.

A machine reports P where the spindle point is p. About a point of the work space,
``p = P + diag(scale) P + squareness - backlash / 2 · m``: x takes ``xy · y + xz · z``, y takes
``yz · z``, and m is the direction (-1 or 1) in which each axis moved last. A touch along -n always
ends with the backlash of its axis taken up on one side: along an axis, it looks like pretravel. It
shows on a surface that is oblique to an axis, where that axis can arrive from either side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base.arrays import FloatArray
from pretravel.base.quantities import QuantityRange, check_numbers

TERMS = (
    "scale of x", "scale of y", "scale of z",
    "squareness of x and y", "squareness of x and z", "squareness of y and z",
    "backlash of x", "backlash of y", "backlash of z",
)  # fmt: skip
"""The terms, in their order: relative, rad, mm."""
SCALES, SQUARENESSES, BACKLASHES = slice(0, 3), slice(3, 6), slice(6, 9)
WIDE = (5e-3, 5e-3, 0.2)
"""Standard deviations of scale, squareness [rad] and backlash [mm] that say nothing: a belt drive
that was never calibrated."""
_MOVED = 1e-3
"""An axis whose share of the approach is smaller did not move. The way is some millimetres long."""
_RELATIVE = QuantityRange(0.0, 0.1)
_PLAY = QuantityRange(0.0, 1.0, "mm")


@dataclass(frozen=True)
class MachinePriors:
    """What is known of a machine before it is touched with.

    Parameters
    ----------
    u_scale, u_squareness : float
        Standard uncertainties about zero; zero leaves the terms out. [–, rad]
    u_backlash : float
        The same of the backlash of an axis. [mm]

    >>> MachinePriors(u_backlash=0.0).deviations.tolist()[-3:]
    [0.0, 0.0, 0.0]
    """

    u_scale: float = WIDE[0]
    u_squareness: float = WIDE[1]
    u_backlash: float = WIDE[2]

    def __post_init__(self) -> None:
        check_numbers(self, u_scale=_RELATIVE, u_squareness=_RELATIVE, u_backlash=_PLAY)

    @property
    def deviations(self) -> FloatArray:
        """Of `TERMS`, (9,)."""
        return np.repeat([self.u_scale, self.u_squareness, self.u_backlash], 3)


def last_moves(approaches: FloatArray) -> FloatArray:
    """Direction of the last move of each axis, -1 or 1; 0 where it did not move, (n, 3).

    Parameters
    ----------
    approaches : (n, 3) float

    >>> last_moves(np.array([[-1.0, 0.02, 0.0]])).tolist()
    [[-1.0, 1.0, 0.0]]
    """
    return np.asarray(np.sign(approaches) * (np.abs(approaches) > _MOVED))


def displacements(positions: FloatArray, moves: FloatArray) -> FloatArray:
    """Displacement of the spindle point from the latched position, for a unit of each term.

    Parameters
    ----------
    positions : (n, 3) float
        About a point of the work space. [mm]
    moves : (n, 3) float
        See `last_moves`.

    Returns
    -------
    (n, 3, 9) float

    >>> displacements(np.array([[0.0, 100.0, 0.0]]), np.zeros((1, 3)))[0, :, 3].tolist()
    [100.0, 0.0, 0.0]
    """
    found = np.zeros((len(positions), 3, len(TERMS)))
    for axis in range(3):
        found[:, axis, axis] = positions[:, axis]
        found[:, axis, 6 + axis] = -0.5 * moves[:, axis]
    for term, (axis, other) in enumerate(((0, 1), (0, 2), (1, 2)), start=3):
        found[:, axis, term] = positions[:, other]
    return found


def priors_of(**stated: float | None) -> MachinePriors:
    """Priors of a machine where some are stated, as `MachinePriors` names them.

    >>> priors_of(u_scale=None, u_backlash=0.005).u_backlash
    0.005
    """
    return MachinePriors(**{name: value for name, value in stated.items() if value is not None})
