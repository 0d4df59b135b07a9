"""Touches as a machine would report them, from a probe, a surface and targets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.errors import PretravelError
from pretravel.frames import Placement
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.probe.catalogue import load_probe
from pretravel.probe.description import Probe
from pretravel.probe.materials import Material
from pretravel.probing.obstacles import stylus_outline
from pretravel.probing.targets import Targets
from pretravel.probing.tip import Tip, tip_of
from pretravel.probing.touching import (
    SurfaceTouches,
    TouchStatus,
    describe_failures,
    touch,
)
from pretravel.surface.cad.part import Part
from pretravel.surface.contact import ball_center
from pretravel.surface.local_geometry import Surface
from pretravel.surface.search import ContactSearch
from pretravel.surface.specification import surface_of
from pretravel.touches import Touches
from pretravel.units import delay_travel

_OFF = 1.0
"""Targets further off their surface than this are asked about. [mm]"""


def simulate(
    probe: Probe | PretravelMap | Tip | str,
    surface: Surface | Part | str,
    targets: Targets,
    *,
    model: str = "analytic",
    workpiece: Material | str | None = None,
    gravity: npt.ArrayLike | None = None,
    friction: float = 0.0,
    clearance: float = 2.0,
    stem: bool = False,
    feed: float | None = None,
    delay: float = 0.0,
    noise: float = 0.0,
    seed: int | None = None,
) -> Touches:
    """Touch a surface at the targets.

    The spindle moves along the approach through the tip centre's place above the
    target; see `pretravel.probing.touching.touch` for what happens then.

    Parameters
    ----------
    probe : Probe, PretravelMap, Tip or str
        A description (or its name in the catalogue), whose orientation turns machine into
        probe directions; or a map, of a probe that was qualified.
    surface : Surface, Part or str
        Machine frame; a specification as on the command line.
    targets : Targets
    model : str
        For a description; see `pretravel.trigger.predict.MODELS`.
    workpiece : Material or its name, optional
        Steel when not given.
    gravity : (3,) float, optional
        See `predict`.
    friction : float
        Coulomb's coefficient at the tip.
    clearance : float
        Way before the contact on which a part must not be met elsewhere. [mm]
    stem : bool
        The stylus of a description, too, must not run into the part.
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
        A target that cannot be touched, with the reason; a delay without a feed.

    >>> from pretravel.probe.catalogue import load_probe
    >>> from pretravel.surface.shapes import Plane
    >>> floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    >>> touches = simulate(load_probe("omp40-2"), floor, Targets([[0, 0, 0]], [[0, 0, 1]]))
    >>> bool(touches.positions[0, 2] < 3.0)
    True
    """
    simulated = simulate_some(
        probe,
        surface,
        targets,
        model=model,
        workpiece=workpiece,
        gravity=gravity,
        friction=friction,
        clearance=clearance,
        stem=stem,
        feed=feed,
        delay=delay,
        noise=noise,
        seed=seed,
    )
    if simulated.touches is None or len(simulated.touches) < len(targets):
        refuse(simulated.happened, targets, surface)
    assert simulated.touches is not None  # refused above
    return simulated.touches


@dataclass(frozen=True, eq=False)
class Simulated:
    """Touches that were simulated, and what happened to all of them.

    Attributes
    ----------
    touches : Touches or None
        Of the targets that could be touched; None where there is none.
    happened : SurfaceTouches
    tip_radius : float
        [mm]
    """

    touches: Touches | None
    happened: SurfaceTouches
    tip_radius: float


def simulate_some(
    probe: Probe | PretravelMap | Tip | str,
    surface: Surface | Part | str,
    targets: Targets,
    *,
    model: str = "analytic",
    workpiece: Material | str | None = None,
    gravity: npt.ArrayLike | None = None,
    friction: float = 0.0,
    clearance: float = 2.0,
    stem: bool = False,
    feed: float | None = None,
    delay: float = 0.0,
    noise: float = 0.0,
    seed: int | None = None,
    placement: Placement | None = None,
    extrapolate: bool = False,
) -> Simulated:
    """As `simulate`, but targets that cannot be touched are no error.

    Parameters
    ----------
    placement : Placement, optional
        Of the part in the machine: surface, targets and touches are in the part's
        frame, the probe's orientation and gravity in the machine's.
    extrapolate : bool
        For a map: also outside its directions.

    Other parameters as for `simulate`.

    Returns
    -------
    Simulated
    """
    check_machine(feed, delay, noise)
    surface = surface_of(surface)
    tip = tip_of(probe, model, workpiece=workpiece, gravity=gravity, extrapolate=extrapolate)
    to_part = np.eye(3) if placement is None else placement.rotation.T
    outline = None
    if isinstance(probe, str):
        probe = load_probe(probe)
    if stem:
        if not isinstance(probe, Probe):
            raise PretravelError("collisions of the stylus need a described probe, not a map")
        outline = stylus_outline(probe, to_part @ np.asarray(probe.orientation.axis))
    happened = touch(
        tip.turned(to_part),
        surface,
        targets,
        friction=friction,
        clearance=clearance,
        stylus=outline,
    )
    touches = reported(
        happened, targets, tip.radius, feed=feed, delay=delay, noise=noise, seed=seed
    )
    return Simulated(touches, happened, tip.radius)


def refuse(happened: SurfaceTouches, targets: Targets, surface: Surface | Part | str) -> None:
    """Say which targets cannot be touched, and why.

    Raises
    ------
    PretravelError
        If there are any.
    """
    surface = surface_of(surface)
    failures = describe_failures(happened, targets, surface)
    if failures:
        raise PretravelError(
            f"{int(np.sum(~happened.converged))} of {len(targets)} targets cannot be touched: "
            + "; ".join(failures)
            + ". "
            + _advice(happened, targets, surface)
        )


def _advice(happened: SurfaceTouches, targets: Targets, surface: Surface | Part) -> str:
    """What to look at, for targets that cannot be touched."""
    failed = np.flatnonzero(~happened.converged)
    if np.all(happened.status[failed] == TouchStatus.NOT_CONVERGED):
        return "The targets may be right; this is a limit of the solver: turn them by 0.001°"
    search = ContactSearch(surface, len(targets))
    search.solve(targets.points, targets.points, None, lambda _rows: ball_center(0.0))
    found = search.state()
    near = failed[found.solved[failed]]
    inwards = np.sum(found.local.normal[near] * targets.normals[near], axis=1) < 0.0
    if len(near) and np.mean(inwards) > 0.5:
        return "Their normals point into the part; they must point out of it"
    off = float(np.max(np.abs(found.length[near]), initial=0.0))
    if off > _OFF:
        return (
            f"They lie up to {off:.3g} mm off the surface: are they in mm, in the part's frame, "
            "and for this surface?"
        )
    return (
        "Check the targets' points, normals and approaches, and that the surface is where you think"
    )


def check_machine(feed: float | None, delay: float, noise: float) -> None:
    """Refuse feeds, delays and noise that cannot be.

    Raises
    ------
    PretravelError
    """
    if delay and feed is None:
        raise PretravelError("a signal delay adds travel only with a feed: give the feed too")
    for name, value in (("noise", noise), ("delay", delay), ("feed", feed or 0.0)):
        if not (np.isfinite(value) and value >= 0.0):
            raise PretravelError(f"the {name} is {value:g}; it cannot be negative")


def reported(
    happened: SurfaceTouches,
    targets: Targets,
    tip_radius: float,
    *,
    feed: float | None = None,
    delay: float = 0.0,
    noise: float = 0.0,
    seed: int | None = None,
) -> Touches | None:
    """What a machine latches of the touches that came to a trigger.

    Parameters
    ----------
    happened : SurfaceTouches
    targets : Targets
        As they were given to `touch`.
    tip_radius : float
        [mm]
    feed, delay, noise, seed
        As for `simulate`.

    Returns
    -------
    Touches or None
        Of the converged ones, in the targets' order; noise is drawn for all, so that
        leaving one out does not change the others. None if there is none.
    """
    check_machine(feed, delay, noise)
    travel = happened.travel + delay_travel(feed or 0.0, delay)
    if noise:
        travel = travel + np.random.default_rng(seed).normal(0.0, noise, len(travel))
    approaches = np.asarray(targets.approaches)
    start = targets.points + tip_radius * targets.normals
    rows = np.flatnonzero(happened.converged)
    if len(rows) == 0:
        return None
    return Touches(
        positions=(start + travel[:, None] * approaches)[rows],
        normals=targets.normals[rows],
        approaches=approaches[rows],
        feeds=None if feed is None else np.full(len(rows), feed),
        labels=None if targets.labels is None else tuple(targets.labels[i] for i in rows),
        nominal_points=happened.first_point[rows],
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


def target_warnings(targets: Targets, happened: SurfaceTouches) -> list[str]:
    """Where targets and surface do not fit together, as sentences.

    Parameters
    ----------
    targets : Targets
    happened : SurfaceTouches
        What came of them.

    Returns
    -------
    list of str
    """
    warnings = []
    rows = np.flatnonzero(happened.converged)
    off = np.linalg.norm((happened.first_point - targets.points)[rows], axis=1)
    if np.any(off > 0.05):
        warnings.append(
            f"{int(np.sum(off > 0.05))} of {len(targets)} targets are not where their approach "
            f"meets the surface, by up to {off.max():.3g} mm; what counts is where it does"
            + (
                ". Are they in mm, in the part's frame, and for this surface?"
                if off.max() > _OFF
                else ""
            )
        )
    cosine = np.sum(happened.first_normal * targets.normals, axis=1)[rows]
    if np.any(cosine < math.cos(math.radians(1.0))):
        worst = math.degrees(math.acos(float(np.clip(cosine.min(), -1.0, 1.0))))
        warnings.append(
            f"the targets' normals are up to {worst:.1f}° away from the surface's: compensation "
            "along them will be wrong by about that"
        )
    return warnings
