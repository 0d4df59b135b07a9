"""Scale, squareness and backlash of a machine: what they do to a latched position.

A machine reports P where the spindle point is p. About a point of the work space,
``p = P + diag(scale) P + squareness - backlash / 2 · m``: x takes ``xy · y + xz · z``, y takes
``yz · z``, and m is the direction (-1 or 1) in which each axis moved last. A touch along -n always
ends with the backlash of its axis taken up on one side: along an axis, it looks like pretravel. It
shows on a surface that is oblique to an axis, where that axis can arrive from either side.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import (
    FloatArray,
    Placement,
    PretravelError,
    QuantityRange,
    check_numbers,
    frozen,
)
from pretravel.touches import Touches

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


@dataclass(frozen=True, eq=False)
class MachineTerms:
    """Scale, squareness and backlash of a machine that touches determined, for other touches.

    Parameters
    ----------
    values : (9,) float
        Of `TERMS`; zero where a term was not determined. [–, rad, mm]
    root : (9, t) float
        Their covariance is ``root @ root.T``: t independent errors, each of one standard
        uncertainty.
    origin : (3,) float
        Point about which positions are corrected, in the axes of the machine. [mm]
    reach : float
        A map made without these terms rests on touches at ``centre + reach n`` with outward
        normals n: of a sphere its radius and the tip's, of a ring less than zero. [mm]
    placement : Placement
        The frame of positions and normals in the machine.

    >>> terms = MachineTerms(
    ...     np.array([1e-4] + 8 * [0.0]), np.zeros((9, 0)), np.zeros(3), reach=15.5)
    >>> x = [[1.0, 0.0, 0.0]]
    >>> terms.taken_off(Touches([[200.0, 0.0, 0.0]], x)).positions.round(9).tolist()
    [[200.02, 0.0, 0.0]]
    """

    values: FloatArray
    root: FloatArray
    origin: FloatArray
    reach: float
    placement: Placement = field(default_factory=Placement)

    def __post_init__(self) -> None:
        for name, shape in (("values", (len(TERMS),)), ("origin", (3,))):
            object.__setattr__(self, name, frozen(getattr(self, name)))
            if getattr(self, name).shape != shape:
                raise PretravelError(f"terms of a machine: {name} must be {shape[0]} numbers")
        object.__setattr__(self, "root", frozen(self.root))
        if self.root.ndim != 2 or len(self.root) != len(TERMS):
            raise PretravelError(f"terms of a machine: root must have {len(TERMS)} rows")
        if not all(np.isfinite(part).all() for part in (self.values, self.root, self.origin)):
            raise PretravelError("terms of a machine must be finite")

    @property
    def absent(self) -> tuple[str, ...]:
        """Scales and squarenesses that neither touches nor a statement determined."""
        known = (self.values != 0.0) | np.any(self.root != 0.0, axis=1)
        return tuple(name for name, there in zip(TERMS[:6], known[:6], strict=True) if not there)

    def seen_from(self, part: Placement) -> MachineTerms:
        """The same terms for touches in the frame of a part."""
        return replace(self, placement=part)

    def _displacements(self, positions: FloatArray, approaches: FloatArray) -> FloatArray:
        """As `displacements`, in the frame of the touches, (n, 3, 9)."""
        place = self.placement
        moved = displacements(
            place.points(positions) - self.origin, last_moves(place.vectors(approaches))
        )
        return np.asarray(np.einsum("ab,naj->nbj", place.rotation, moved))

    def taken_off(self, touches: Touches, *, sign: float = 1.0) -> Touches:
        """Touches where the spindle point really was; a sign of -1: as the machine reports them."""
        moved = self._displacements(touches.positions, touches.approach_directions) @ self.values
        return replace(touches, positions=touches.positions + sign * moved)

    def errors_of(self, touches: Touches) -> FloatArray:
        """Movement of each spindle point for each error of the terms, (n, 3, t). [mm]"""
        found = self._displacements(touches.positions, touches.approach_directions)
        return np.asarray(found @ self.root)

    def effect(self, normals: FloatArray) -> FloatArray:
        """Change of a map for each error of the terms, (n, t), by outward normals (n, 3). [mm]

        A touch that is moved along its normal shows less pretravel. What is the same for all
        touches is a shift of the reference.
        """
        in_machine = self.placement.vectors(normals)
        moved = displacements(self.reach * in_machine, last_moves(-in_machine))
        return np.asarray(-np.einsum("na,naj->nj", in_machine, moved) @ self.root)
