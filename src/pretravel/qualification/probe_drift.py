"""How a probe drifts between two checks, and what its old map says after that."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    FloatArray,
    PretravelError,
    fibonacci_cap,
    frozen,
    polar_angle,
    probe_rotation,
)
from pretravel.maps import PretravelMap
from pretravel.qualification.own_touches import refuse_table

_SPREAD = 600
"""Directions over which functions of direction are compared."""
LARGE_TURN = "the turn about the axis"
"""What has changed, among `possible_drifts`."""
DRIFT_OF_REFERENCE = "the place of the reference"
"""What has changed, among `possible_drifts`: not the probe."""
_TURN = 0.2 * DEGREE
_DEFAULT_WEIGHT = 3.0
"""Verifications that the default drift is worth in addition to those of a history."""
_SMALL_COMBINATION = 0.01
"""Share of the largest combination of functions; what follows the weight of a probe is larger."""
_NULL = 1e-11
"""Share of the largest variance below which a combination of coefficients is fixed."""


@dataclass(frozen=True)
class ProbeDrift:
    """Standard deviations of the changes of a probe between two checks.

    Attributes
    ----------
    scale : float
        Of pretravel as a share of itself: spring, stiffness. [1]
    level : float
        Common to all directions: wear of the tip, temperature of tip and reference. [mm]
    turn : float
        About the axis: seat of the probe in the spindle, stylus. [rad]
    form : float
        Of everything else, as a share of the map's variation over the directions. [1]
    source : str
        Where these numbers come from, in words.
    change : float
        Probability that something has changed by more than this drift: `possible_drifts`.
    reference : float
        Movement of the reference against the machine along each axis, from the first of the new
        touches to the last. [mm]

    Notes
    -----
    The defaults are assumptions, of a probe that stays in use for days: 1 % is a change of the
    spring's force by 1 %, which takes 30 K in a steel spring or some settling; 0.3 µm is a
    sphere of 25 mm that is 4 K warmer; 0.3° is the orientation of a spindle.

    >>> ProbeDrift().source
    'assumed'
    """

    scale: float = 0.01
    level: float = 0.3 * MICROMETRE
    turn: float = 0.3 * DEGREE
    form: float = 0.02
    source: str = "assumed"
    change: float = 0.25
    reference: float = 0.0

    def __post_init__(self) -> None:
        for name in ("scale", "level", "turn", "form", "change", "reference"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise PretravelError(f"the drift of {name} is {value:g}; it cannot be negative")


def possible_drifts(drift: ProbeDrift) -> dict[str, tuple[float, ProbeDrift]]:
    """The drift that is assumed, and larger changes next to it, with their probabilities.

    Returns
    -------
    dict of str to (float, ProbeDrift)
        By what has changed, in words; empty for the drift that is assumed, the first.

    >>> usual, *others = possible_drifts(ProbeDrift()).values()
    >>> usual[0], round(sum(probability for probability, _ in others), 9)
    (0.75, 0.25)
    """
    changes = {
        "the force of the spring, or the stylus": {"scale": 0.1, "form": 0.03},
        "the size of the tip": {"level": 2.0 * MICROMETRE},
        LARGE_TURN: {"turn": 3.0 * DEGREE},
        "one rod or one seat": {"form": 0.1},
        "several things": {"scale": 0.2, "level": 2.0 * MICROMETRE, "turn": 5.0 * DEGREE,
                           "form": 0.3},
        DRIFT_OF_REFERENCE: {"reference": 5.0 * MICROMETRE},
    }  # fmt: skip
    share = drift.change / len(changes)
    found = {"": (1.0 - drift.change, drift)}
    for name, sizes in changes.items():
        larger = {key: max(size, getattr(drift, key)) for key, size in sizes.items()}
        found[name] = (share, replace(drift, **larger))
    return {name: (weight, each) for name, (weight, each) in found.items() if weight > 0.0}


def drift_of_changes(
    level: npt.ArrayLike, u_level: npt.ArrayLike, turn: npt.ArrayLike, u_turn: npt.ArrayLike
) -> ProbeDrift:
    """The drift that earlier verifications of a probe show.

    Parameters
    ----------
    level, u_level : (n,) float
        Change of size since the map was made, and its standard uncertainty, of verifications
        that found no change. [mm]
    turn, u_turn : (n,) float
        About the axis. Not a number where it was not determined. [rad]

    Notes
    -----
    Variance of the changes less that of their uncertainties; the default counts as much as
    three verifications, so that a short history does not promise a probe without drift. Scale
    and form, which a verification hardly separates from the level, stay the default.

    >>> quiet = drift_of_changes([0.0] * 97, [0.0] * 97, [0.0] * 97, [0.0] * 97)
    >>> round(quiet.level / ProbeDrift().level, 3)  # the square root of 3 in 100
    0.173
    """
    default = ProbeDrift()
    own_level, count = _pooled(default.level, level, u_level)
    own_turn, _ = _pooled(default.turn, turn, u_turn)
    if count == 0:
        return default
    several = "s" if count > 1 else ""
    source = f"size and turn from {count} verification{several}, the rest assumed"
    return replace(default, level=own_level, turn=own_turn, source=source)


def _pooled(default: float, change: npt.ArrayLike, u: npt.ArrayLike) -> tuple[float, int]:
    """Standard deviation of changes beyond their uncertainty, and the number of known ones."""
    squares = np.asarray(change, dtype=np.float64) ** 2 - np.asarray(u, dtype=np.float64) ** 2
    known = squares[np.isfinite(squares)]
    beyond = max(float(known.sum()), 0.0)
    variance = (_DEFAULT_WEIGHT * default**2 + beyond) / (_DEFAULT_WEIGHT + len(known))
    return math.sqrt(variance), len(known)


@dataclass(frozen=True, eq=False)
class DriftedMap:
    """An old map as a prior: its coefficients after a drift of the probe.

    Attributes
    ----------
    pretravel_map : PretravelMap
        The old one.
    drift : ProbeDrift
    axes : int
        Centre coordinates that the reference determines: 3, on a ring 2.
    ways : (3, k) float
        Change of the coefficients for a drift of scale, level and turn by one unit: [mm],
        [1], [mm/rad].
    form : (k, k) float
        Root of their covariance for a change of form by the whole variation. [mm]
    shift : (k, axes) float
        Coefficients of the components of the direction, where the basis contains them; else zero.
    shift_of : (axes, k) float
        The shift that a map contains, in the convention of the old map: one for `shift`.
    from_center : bool
        What the covariance of the old map is of: of the map as seen from the centre of the
        reference that was found, errors of this centre included; else of the map without a shift.
    """

    pretravel_map: PretravelMap
    drift: ProbeDrift
    axes: int
    ways: FloatArray
    form: FloatArray
    shift: FloatArray
    shift_of: FloatArray
    from_center: bool

    @cached_property
    def covariance(self) -> FloatArray:
        """Of the coefficients after the drift that is assumed, (k, k). [mm²]"""
        return self.covariance_after(self.drift)

    def covariance_after(self, drift: ProbeDrift) -> FloatArray:
        """Of the coefficients: that of the map, and of a drift, (k, k). [mm²]"""
        by_drift = self._root_of(drift)
        return np.asarray(self.pretravel_map.covariance.matrix + by_drift @ by_drift.T)

    def root_after(self, drift: ProbeDrift) -> FloatArray:
        """Of `covariance_after`, (k, m): its product with its transpose is the covariance. [mm]

        Functions of an average are redundant, with covariances that are large and cancel: a root
        keeps what is left of them positive.
        """
        return np.hstack([self._root_of_map, self._root_of(drift)])

    def _root_of(self, drift: ProbeDrift) -> FloatArray:
        return np.hstack([self.ways.T * spread_of(drift), drift.form * self.form])

    @cached_property
    def _root_of_map(self) -> FloatArray:
        eigenvalues, vectors = np.linalg.eigh(self.pretravel_map.covariance.matrix)
        return np.asarray(vectors * np.sqrt(np.maximum(eigenvalues, 0.0)))

    @cached_property
    def without_shift(self) -> FloatArray:
        """Removes from coefficients the shift that they contain, (k, k)."""
        return np.asarray(np.eye(len(self.shift)) - self.shift @ self.shift_of)

    def variance(self, directions: FloatArray, covariance: FloatArray) -> FloatArray:
        """Variance of the map without a shift, at (n, 3) directions of the probe frame: (n,)."""
        design = self.pretravel_map.basis.design(directions) @ self.without_shift
        return np.asarray(np.maximum(np.sum((design @ covariance) * design, axis=1), 0.0))


def drifted_map(
    pretravel_map: PretravelMap, drift: ProbeDrift = ProbeDrift(), *, ring: bool = False
) -> DriftedMap:
    """What an old map says of the probe today.

    Parameters
    ----------
    pretravel_map : PretravelMap
        It states its uncertainty and follows the probe: kind harmonic, physical, or an average.
    drift : ProbeDrift
    ring : bool
        The reference is a ring.

    Raises
    ------
    PretravelError
        A map that cannot be updated.
    """
    _refuse_unusable(pretravel_map)
    axes = 2 if ring else 3
    basis, coefficients = pretravel_map.basis, pretravel_map.coefficients
    directions = spread_over_support(pretravel_map, _SPREAD)
    # An interpolating basis is its values at the nodes; others are compared over directions.
    places = pretravel_map.support.nodes if basis.interpolates else directions
    design = basis.design(places)
    to_coefficients = _to_coefficients(design)
    slope = slope_around_axis(pretravel_map, places)
    constant = basis.constant
    level = np.zeros(basis.size) if constant is None else constant
    ways = np.stack([coefficients, level, to_coefficients @ -slope])
    shift, shift_of, from_center = _gauge(pretravel_map, places[:, :axes], design, to_coefficients)
    form = _root_of_form(pretravel_map, design, shift, shift_of)
    return DriftedMap(
        pretravel_map, drift, axes, frozen(ways), frozen(form), frozen(shift), frozen(shift_of),
        from_center,
    )  # fmt: skip


def coefficients_of(
    pretravel_map: PretravelMap, directions: FloatArray, values: FloatArray
) -> FloatArray:
    """Coefficients of the map's basis that follow values over directions, (k,). [mm]

    Without combinations of functions that are small over these directions: they would follow
    rounding and kinks of the values with coefficients of millimetres that cancel.

    Parameters
    ----------
    pretravel_map : PretravelMap
    directions : (n, 3) float
        Probe frame.
    values : (n,) float
        [mm]
    """
    design = pretravel_map.basis.design(directions)
    return np.asarray(_to_coefficients(design, _SMALL_COMBINATION) @ values)


def _to_coefficients(design: FloatArray, smallest: float = 1e-9) -> FloatArray:
    """From values to coefficients by least squares, (k, n); functions are redundant in averages."""
    size = np.sqrt(np.mean(design**2, axis=0))
    scaling = 1.0 / np.where(size > 0.0, size, 1.0)
    return np.asarray(scaling[:, None] * np.linalg.pinv(design * scaling, rcond=smallest))


def spread_of(drift: ProbeDrift) -> FloatArray:
    """Standard deviations of scale, level and turn, (3,): of `DriftedMap.ways`."""
    return np.array([drift.scale, drift.level, drift.turn])


def spread_over_support(pretravel_map: PretravelMap, count: int) -> FloatArray:
    """About `count` directions spread over what a map supports, with its nodes; probe frame."""
    nodes = pretravel_map.support.nodes
    candidates = fibonacci_cap(count, float(polar_angle(nodes).max()))
    held = candidates[pretravel_map.support.supports(candidates)]
    return np.concatenate([held, nodes[: max(count, len(held))]])


def _refuse_unusable(pretravel_map: PretravelMap) -> None:
    if not pretravel_map.states_uncertainty:
        raise PretravelError(
            "the old map has no uncertainty (a prediction, or a table), so that new touches "
            "have no weight compared with it; use a map of pretravel qualify"
        )
    refuse_table(pretravel_map)
    if not pretravel_map.basis.follows_probe:
        raise PretravelError(
            f"a map of kind {pretravel_map.kind} does not follow the probe closely enough to be "
            "updated by a few touches; qualify again, with kind harmonic or physical"
        )


def slope_around_axis(pretravel_map: PretravelMap, directions: FloatArray) -> FloatArray:
    """Change of the map from direction to direction around the axis, (n,). [mm/rad]

    Parameters
    ----------
    pretravel_map : PretravelMap
    directions : (n, 3) float
        Probe frame.
    """
    basis, coefficients = pretravel_map.basis, pretravel_map.coefficients
    ahead, behind = (
        basis.value(directions @ probe_rotation(rotation=turn).T, coefficients)
        for turn in (_TURN, -_TURN)
    )
    return np.asarray((ahead - behind) / (2.0 * _TURN))


def _gauge(
    pretravel_map: PretravelMap,
    components: FloatArray,
    design: FloatArray,
    to_coefficients: FloatArray,
) -> tuple[FloatArray, FloatArray, bool]:
    """Coefficients of a shift, (k, axes); the shift that coefficients contain, (axes, k); whether
    the covariance of the map contains a shift.

    Where the covariance of the map leaves a shift out, the second is the functional that it
    leaves out: that is the convention of the map. Of several the one next to least squares.
    """
    shift = to_coefficients @ components
    if np.abs(design @ shift - components).max() > 1e-6:  # the basis contains no shift
        return np.zeros_like(shift), np.zeros_like(shift.T), False
    free = np.column_stack([np.ones(len(components)), components])
    least_squares = (np.linalg.pinv(free) @ design)[1:]
    # In units in which all functions are of one size, so that small and zero can be distinguished.
    size = np.sqrt(np.mean(design**2, axis=0))
    size[size == 0.0] = 1.0
    eigenvalues, vectors = np.linalg.eigh(pretravel_map.covariance.matrix * np.outer(size, size))
    varied = vectors[:, eigenvalues > _NULL * eigenvalues[-1]]
    # Combinations that are zero in every direction, where functions are redundant: no shift.
    singular, rows = np.linalg.svd(design / size, full_matrices=True)[1:]
    empty = rows[np.append(singular, np.zeros(len(rows) - len(singular))) < _NULL * singular[0]].T
    held = np.linalg.qr(np.column_stack([varied, empty]))[0]
    scaled = shift * size[:, None]
    outside = scaled - held @ (held.T @ scaled)
    if np.linalg.svd(outside, compute_uv=False)[-1] < 1e-3 * np.linalg.norm(scaled):
        return shift, least_squares, True
    conditions = np.column_stack([held, scaled])
    wanted = np.zeros((len(least_squares), conditions.shape[1]))
    wanted[:, held.shape[1] :] = np.eye(len(least_squares))
    change = (wanted - (least_squares / size) @ conditions) @ np.linalg.pinv(conditions)
    return shift, least_squares + change * size, False


def _root_of_form(
    pretravel_map: PretravelMap,
    design: FloatArray,
    shift: FloatArray,
    shift_of: FloatArray,
) -> FloatArray:
    """Independent changes of all coefficients, together as large as the map's variation."""
    without = np.eye(len(shift)) - shift @ shift_of
    seen = np.sqrt(np.mean((design @ without) ** 2, axis=0))
    active = seen > 1e-6 * seen.max()
    variation = float(np.std(design @ pretravel_map.coefficients))
    each = np.zeros(len(seen))
    each[active] = variation / (math.sqrt(active.sum()) * seen[active])
    return np.asarray(without * each)
