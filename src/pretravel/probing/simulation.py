"""Touches as a machine would report them, from a probe, a surface and targets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.directions import checked_unit
from pretravel.errors import ConvergenceError, PretravelError
from pretravel.frames import probe_rotation
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.surface.shapes import Surface
from pretravel.touches import Touches
from pretravel.trigger.predict import predict
from pretravel.units import delay_travel

_SETTLED = 1e-12
"""Movement of the contact between two iterations that counts as none. [mm]"""
_MOST_ITERATIONS = 50


@dataclass(frozen=True, eq=False)
class Targets:
    """Where to touch: points of the surface, its normals there, and ways to come.

    Parameters
    ----------
    points : (n, 3) float
        On the nominal surface, machine frame. [mm]
    normals : (n, 3) float
        Outward unit normals.
    approaches : (n, 3) float, optional
        Unit directions of travel; -normals when not given.
    labels : n strings, optional

    >>> Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]).approaches.tolist()
    [[-0.0, -0.0, -1.0]]
    """

    points: FloatArray
    normals: FloatArray
    approaches: FloatArray | None = None
    labels: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        normals = checked_unit(self.normals, "target normals")
        object.__setattr__(self, "points", frozen(self.points))
        object.__setattr__(self, "normals", frozen(normals))
        approaches = (
            -normals
            if self.approaches is None
            else checked_unit(self.approaches, "target approaches")
        )
        object.__setattr__(self, "approaches", frozen(approaches))


def simulate(
    probe: Probe,
    surface: Surface,
    targets: Targets,
    *,
    model: str = "analytic",
    workpiece: Material | None = None,
    gravity: npt.ArrayLike | None = None,
    feed: float | None = None,
    delay: float = 0.0,
    noise: float = 0.0,
    seed: int | None = None,
) -> Touches:
    """Touch a surface at the targets.

    The spindle moves along the approach through the tip centre's place above the
    target. At the trigger the deflected ball, by its local compression less than its
    radius away, is tangent to the surface; where that is and which normal it has
    follow together, by iteration over all touches at once. The tip slides without
    friction.

    Parameters
    ----------
    probe : Probe
        Its orientation turns machine into probe directions.
    surface : Surface
        Machine frame.
    targets : Targets
    model : str
        See `pretravel.trigger.predict.MODELS`.
    workpiece : Material, optional
        Steel when not given.
    gravity : (3,) float, optional
        See `predict`.
    feed : float, optional
        [mm/min]
    delay : float
        Of the trigger signal; adds feed times delay to the travel. [s]
    noise : float
        Standard deviation of the travel. [mm]
    seed : int, optional
        Of the noise.

    Returns
    -------
    Touches
        With the points of first contact as nominal points.

    Raises
    ------
    PretravelError
        A target whose approach misses the surface; a delay without a feed.

    References
    ----------
    Rodrigues 2021, sections 3.2 to 3.4, as one system of equations.

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.surface.shapes import Plane
    >>> floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    >>> touches = simulate(load_probe("omp40-2"), floor, Targets([[0, 0, 0]], [[0, 0, 1]]))
    >>> bool(touches.positions[0, 2] < 3.0)
    True
    """
    if delay and feed is None:
        raise PretravelError("a signal delay adds travel only with a feed: give the feed too")
    for name, value in (("noise", noise), ("delay", delay), ("feed", feed or 0.0)):
        if not (np.isfinite(value) and value >= 0.0):
            raise PretravelError(f"the {name} is {value:g}; it cannot be negative")
    rotation = probe_rotation(probe.orientation.axis, probe.orientation.rotation)
    approaches = np.asarray(targets.approaches)
    radius = probe.tip.radius
    start = targets.points + radius * targets.normals

    first_travel, normal = surface.ball_contact(start, approaches, radius)
    _refuse_misses(first_travel, targets)
    nominal = start + first_travel[:, None] * approaches - radius * normal
    travel = first_travel
    for _ in range(_MOST_ITERATIONS):
        trigger = predict(probe, normal @ rotation, model, workpiece=workpiece, gravity=gravity)
        deflection = trigger.deflection @ rotation.T
        previous = travel
        travel, normal = surface.ball_contact(
            start + deflection, approaches, radius - trigger.tip_approach
        )
        _refuse_misses(travel, targets)
        moved = float(np.max(np.abs(travel - previous), initial=0.0))
        if moved <= _SETTLED:
            break
    else:
        raise ConvergenceError(
            f"the touches did not settle: the travel still changed by {moved:.3g} mm"
        )
    travel = travel + delay_travel(feed or 0.0, delay)
    if noise:
        travel = travel + np.random.default_rng(seed).normal(0.0, noise, len(travel))
    return Touches(
        positions=start + travel[:, None] * approaches,
        normals=targets.normals,
        approaches=approaches,
        feeds=None if feed is None else np.full(len(travel), feed),
        labels=targets.labels,
        nominal_points=nominal,
        source=None,
    )


def travel_since_contact(touches: Touches, tip_radius: float) -> FloatArray:
    """Travel along the approach from first contact with the nominal point to the latch.

    Parameters
    ----------
    touches : Touches
        With nominal points, touched along their own normals there.
    tip_radius : float
        [mm]

    Returns
    -------
    (n,) float
        [mm]

    Raises
    ------
    PretravelError
        Touches without nominal points.
    """
    if touches.nominal_points is None:
        raise PretravelError("these touches have no nominal points to take the travel from")
    contact = touches.nominal_points + tip_radius * touches.normals
    return np.asarray(np.sum((touches.positions - contact) * touches.approach_directions, axis=1))


def target_warnings(targets: Targets, surface: Surface) -> list[str]:
    """Where targets and surface do not fit together, as sentences.

    >>> from pretravel.surface.shapes import Plane
    >>> floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    >>> target_warnings(Targets([[0, 0, 5]], [[0, 0, 1]]), floor)
    ['1 of 1 targets lie off the surface, by up to 5 mm; what counts is where their approach \
meets it']
    """
    warnings = []
    distance = np.abs(surface.signed_distance(targets.points))
    if np.any(distance > 0.05):
        warnings.append(
            f"{int(np.sum(distance > 0.05))} of {len(distance)} targets lie off the surface, by up "
            f"to {distance.max():.3g} mm; what counts is where their approach meets it"
        )
    _, normal = surface.ball_contact(
        targets.points + targets.normals, np.asarray(targets.approaches), 0.0
    )
    cosine = np.sum(normal * targets.normals, axis=1)
    if np.any(cosine < math.cos(math.radians(1.0))):
        worst = math.degrees(math.acos(float(np.clip(cosine.min(), -1.0, 1.0))))
        warnings.append(
            f"the targets' normals are up to {worst:.1f}° away from the surface's: compensation "
            "along them will be wrong by about that"
        )
    return warnings


def _refuse_misses(travel: FloatArray, targets: Targets) -> None:
    missed = np.flatnonzero(~np.isfinite(travel))
    if len(missed):
        row = int(missed[0])
        label = f" ({targets.labels[row]})" if targets.labels else ""
        raise PretravelError(
            f"{len(missed)} of {len(travel)} targets cannot be touched: the approach of target "
            f"{row + 1}{label} misses the surface or leaves it; check the target's point and "
            "normal, and that the surface is where you think (x=, y=, z=)"
        )
