"""The map of a probe in another orientation of an indexing head: its weight turns.

Seats and spring are fixed to the probe; gravity is not. What the weight of tripod and stylus does
to the forces on the seats is predicted for both orientations, and the difference goes to the map.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE, FloatArray, PretravelError, checked_unit, probe_rotation
from pretravel.design.identification.evidence import evidence_of, refuse_other_probe
from pretravel.maps import PretravelMap
from pretravel.prediction import Probe, predict
from pretravel.qualification import coefficients_of, drifted_map, spread_over_support
from pretravel.uncertainty import Covariance

DOWN = (0.0, 0.0, -1.0)
_SPREAD = 600
SHARE = 0.25
"""Standard uncertainty of the predicted difference, as a share of it: mass and height of the moving
parts are known to some tenths."""
_WORSE_THAN_NONE = 1.2
"""What a description leaves of the lobes of a map, as a share of them, from which it is of another
probe, or turned: one that has no lobes leaves 1, and noise changes this by a tenth."""


@dataclass(frozen=True, eq=False)
class TurnedMap:
    """A map in another orientation.

    Attributes
    ----------
    pretravel_map : PretravelMap
    directions : (n, 3) float
        In the probe's frame.
    difference : (n,) float
        Pretravel there, in the new orientation less that in the old one. [mm]
    missed : float
        Root mean square of what the kind of map cannot follow of it, but for a shift, which the
        centre of the reference takes; it is in u. [mm]
    share : float
        Standard uncertainty of the difference, as a share of it.
    """

    pretravel_map: PretravelMap
    directions: FloatArray
    difference: FloatArray
    missed: float
    share: float


def in_orientation(
    pretravel_map: PretravelMap,
    probe: Probe,
    axis: npt.ArrayLike,
    *,
    roll: float = 0.0,
    gravity: npt.ArrayLike = DOWN,
    model: str = "analytic",
) -> TurnedMap:
    """Predict the map of a probe after a turn of its head.

    Parameters
    ----------
    pretravel_map : PretravelMap
        Qualified in one orientation.
    probe : Probe
        Described, or identified from the map, with its moving mass. Its orientation is that of the
        map: rods and lobes belong together.
    axis : (3,) float
        The probe's +z (tip to spindle) in the new orientation, machine frame.
    roll : float
        Turn about that axis besides, after the shortest way there. [rad]
    gravity : (3,) float
        Direction of the weight, machine frame.
    model : str

    Raises
    ------
    PretravelError
        Axes, tips or lobes of map and description that differ; friction at the seats; an
        orientation in which the probe does not rest on its seats, or never triggers.

    References
    ----------
    Six-seat statics of Shen & Zhang, as used by Rodrigues 2021, section 2.9.1, with the weight.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.described_maps import described_map
    >>> same = in_orientation(described_map("omp40-2"), load_probe("omp40-2"), [0.0, 0.0, 1.0])
    >>> float(np.abs(same.difference).max())
    0.0
    """
    old_axis = pretravel_map.rotation[:, 2]
    refuse_other_probe(pretravel_map, probe)
    if probe.seats.friction > 0.0:
        raise PretravelError(
            f"{probe.name} has friction {probe.seats.friction:g} at its seats, which is not "
            "predicted together with the weight: set friction of [seats] to 0",
            inputs=("probe",),
        )
    new_axis = checked_unit(np.atleast_2d(np.asarray(axis, dtype=np.float64)), "axis")[0]
    turn = probe_rotation(new_axis, roll) @ probe_rotation(old_axis).T
    down = checked_unit(np.atleast_2d(np.asarray(gravity, dtype=np.float64)), "gravity")[0]
    directions = spread_over_support(pretravel_map, _SPREAD)
    in_probe = directions @ pretravel_map.rotation.T @ probe.orientation.matrix
    share = float(np.hypot(SHARE, _unexplained(pretravel_map, probe, down, model)))
    before, after = (
        predict(probe, in_probe, model, gravity=weight).pretravel for weight in (down, down @ turn)
    )
    difference = after - before
    change = coefficients_of(pretravel_map, directions, difference)
    if pretravel_map.states_uncertainty and pretravel_map.basis.follows_probe:
        drifted = drifted_map(pretravel_map)
        if not drifted.from_center:  # a shift belongs to the centre, by the convention of the map
            change = drifted.without_shift @ change
    missed = difference - pretravel_map.basis.design(directions) @ change
    missed = missed - directions @ np.linalg.lstsq(directions, missed, rcond=None)[0]
    lost = float(np.sqrt(np.mean(missed**2)))
    made = _changed(pretravel_map, change, share * change, lost, turn)
    return TurnedMap(made, directions, difference, lost, share)


def _unexplained(pretravel_map: PretravelMap, probe: Probe, down: FloatArray, model: str) -> float:
    """What a description leaves of the lobes of a map, as a share of them beyond the noise.

    Lobes are what remains without the mean, which contains the signal delay, and without a shift.

    Raises
    ------
    PretravelError
        A description without which more of the map is explained.
    """
    if pretravel_map.touched is None and not pretravel_map.basis.follows_probe:
        return 0.0
    evidence = evidence_of(pretravel_map)
    n = evidence.directions
    predicted = predict(probe, n @ probe.orientation.matrix, model, gravity=down).pretravel
    common = np.column_stack([np.ones(len(n)), n])

    def lobes(values: FloatArray) -> float:
        return float(
            np.mean((values - common @ np.linalg.lstsq(common, values, rcond=None)[0]) ** 2)
        )

    seen, left = lobes(evidence.value), lobes(evidence.value - predicted)
    noise = float(np.mean(np.diag(evidence.covariance)))
    if left > _WORSE_THAN_NONE**2 * max(seen, noise):
        raise PretravelError(
            f"the description does not explain the map: without mean and shift the map has lobes "
            f"of {np.sqrt(seen) / MICROMETRE:.2f} µm, and {np.sqrt(left) / MICROMETRE:.2f} µm (rms)"
            " remain after the prediction is subtracted. Rods are elsewhere, or it is another "
            "probe: identify the description from this map first",
            inputs=("probe", "map_file"),
        )
    return float(np.sqrt(max(left - noise, 0.0) / max(seen, noise)))


def _changed(
    old: PretravelMap, change: FloatArray, u: FloatArray, lost: float, turn: FloatArray
) -> PretravelMap:
    covariance = old.covariance
    if old.states_uncertainty:
        matrix = covariance.matrix + np.outer(u, u)
        covariance = Covariance.full(matrix)
    return replace(
        old,
        rotation=turn @ old.rotation,
        coefficients=old.coefficients + change,
        covariance=covariance,
        fixed_scatter=float(np.hypot(old.fixed_scatter, lost)),
        touched=None,
        provenance=replace(
            old.provenance,
            source="a map of another orientation of the head, and the weight of a described probe",
            setup=None,
            tip="",  # names of the old orientation
            orientation="",
        ),
    )
