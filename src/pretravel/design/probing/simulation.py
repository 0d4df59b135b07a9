"""Touches as a machine would report them, from a probe, a surface and targets."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DELAY,
    FEED,
    NOISE,
    FloatArray,
    Placement,
    PretravelError,
    check_numbers,
    delay_travel,
)
from pretravel.design.probing.obstacles import StylusOutline, stylus_outline
from pretravel.design.probing.surface_touches import SurfaceTouches, TouchStatus, describe_failures
from pretravel.design.probing.tip import TipBehaviour, tip_of
from pretravel.design.probing.touching import CLEARANCE, touch
from pretravel.maps import PretravelMap
from pretravel.prediction import Material, Probe, load_probe
from pretravel.surface import (
    ContactProblem,
    ContactSearch,
    Lines,
    Part,
    Surface,
    ball_center,
    surface_of,
)
from pretravel.touches import Targets, Touches

_FAR = 1.0
"""Distance of a target from the surface above which its unit and frame are doubtful. [mm]"""
_AWAY = math.sin(math.radians(1.0))
"""Component of normals along the stylus, beyond which a flat part meets the stem."""
_NEAR = 0.05
"""Distance of a target from the point of first contact above which a warning is given. [mm]"""


@dataclass(frozen=True)
class PartSetup:
    """The part on the machine, and how the probe may meet it.

    Parameters
    ----------
    material : Material or its name, optional
        Of the part; steel when not given.
    friction : float
        Coulomb's coefficient between tip and part.
    clearance : float
        Length of the path before the contact on which the ball must meet no other face. [mm]
    check_stylus : bool
        Whether to check that the stylus of a described probe does not meet the part either.
    placement : Placement, optional
        Of the part in the machine: surface, targets and touches are in the part's
        frame, the probe's orientation and gravity in the machine's frame. The frames are the same
        when not given.

    >>> PartSetup(friction=0.1).to_part.tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """

    material: Material | str | None = None
    friction: float = 0.0
    clearance: float = CLEARANCE
    check_stylus: bool = False
    placement: Placement | None = None

    @property
    def to_part(self) -> FloatArray:
        """Rotation from the machine's frame to the part's frame, (3, 3)."""
        return np.eye(3) if self.placement is None else np.asarray(self.placement.rotation.T)


@dataclass(frozen=True)
class Latch:
    """How the machine latches its position at the trigger.

    Parameters
    ----------
    feed : float, optional
        [mm/min]
    delay : float
        Of the trigger signal; it adds feed times delay to the travel. [s]
    noise : float
        Standard deviation of the travel. [mm]
    rng : numpy.random.Generator or int, optional
        Of the noise; the same number gives the same noise.

    Raises
    ------
    PretravelError
        A delay without a feed; values that are negative or not finite.
    """

    feed: float | None = None
    delay: float = 0.0
    noise: float = 0.0
    rng: np.random.Generator | int | None = None

    def __post_init__(self) -> None:
        if self.delay and self.feed is None:
            raise PretravelError(
                "a signal delay adds travel in proportion to the feed: give the feed too",
                inputs=("feed",),
            )
        check_numbers(self, noise=NOISE, delay=DELAY, feed=FEED)

    def latched(self, travel: FloatArray) -> FloatArray:
        """Travel at the latch, (n,), from travel at the trigger. [mm]

        >>> Latch(feed=60.0, delay=0.010).latched(np.array([1.0])).round(9).tolist()
        [1.01]
        """
        travel = travel + delay_travel(self.feed or 0.0, self.delay)
        if self.noise:
            travel = travel + np.random.default_rng(self.rng).normal(0.0, self.noise, len(travel))
        return travel


def latch_with_map(latch: Latch, pretravel_map: PretravelMap) -> Latch:
    """The latch of a machine whose probe has this map, with the signal delay that the map contains.

    Raises
    ------
    PretravelError
        A delay in addition to that of the map; a map of a probe at rest without a feed; another
        feed than that of a map whose delay is not known.
    """
    delay, feed = pretravel_map.delay, pretravel_map.feed
    if latch.delay and (delay is not None or feed):
        held = (
            f"the travel at its feed of {feed:g} mm/min"
            if delay is None
            else f"the signal delay of {1e3 * delay:.3f} ms"
        )
        raise PretravelError(
            f"the map contains {held}, and would count it twice: leave the delay out",
            inputs=("delay",),
        )
    if delay is None:
        if feed and latch.feed is not None and not math.isclose(latch.feed, feed):
            raise PretravelError(
                f"the map was made at {feed:g} mm/min, and its signal delay is not known: what it "
                f"is at {latch.feed:g} mm/min is not known either",
                inputs=("feed",),
            )
        return latch
    if latch.feed is None:
        raise PretravelError(
            f"the map is that of the probe at rest, with a signal delay of {1e3 * delay:.3f} ms, "
            "which adds travel in proportion to the feed: give the feed",
            inputs=("feed",),
        )
    return replace(latch, delay=delay)


@dataclass(frozen=True, eq=False)
class SimulationResult:
    """Simulated touches, and the outcome at every target.

    Attributes
    ----------
    touches : Touches or None
        At the targets that can be touched; None where there are none.
    outcomes : SurfaceTouches
    tip_radius : float
        [mm]
    """

    touches: Touches | None
    outcomes: SurfaceTouches
    tip_radius: float


def simulate(
    probe: Probe | PretravelMap | TipBehaviour | str,
    surface: Surface | Part | str,
    targets: Targets,
    *,
    model: str = "analytic",
    gravity: npt.ArrayLike | None = None,
    setup: PartSetup | None = None,
    latch: Latch | None = None,
) -> Touches:
    """Touch a surface at the targets.

    The spindle moves along the approach through the tip centre's place above the
    target; `pretravel.design.probing.touching.touch` describes the touch.

    Parameters
    ----------
    probe : Probe, PretravelMap, TipBehaviour or str
        A description (or its name in the catalogue), whose orientation rotates machine into
        probe directions; or a map of a qualified probe.
    surface : Surface, Part or str
        Machine frame; a str is a specification as on the command line.
    targets : Targets
    model : str
        For a description; see `pretravel.prediction.compliance.MODELS`.
    gravity : (3,) float, optional
        For a description; see `pretravel.prediction.trigger.predict`.
    setup : PartSetup, optional
        Steel without friction when not given.
    latch : Latch, optional
        Without delay and noise when not given.

    Returns
    -------
    Touches
        With the points of first contact as nominal points.

    Raises
    ------
    PretravelError
        A target that cannot be touched, with the reason.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.surface.shapes import Plane
    >>> floor = Plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    >>> touches = simulate(load_probe("omp40-2"), floor, Targets([[0, 0, 0]], [[0, 0, 1]]))
    >>> bool(touches.positions[0, 2] < 3.0)
    True
    """
    result = simulate_some(
        probe, surface, targets, model=model, gravity=gravity, setup=setup, latch=latch
    )
    if result.touches is None or len(result.touches) < len(targets):
        refuse_failures(result.outcomes, targets, surface)
    assert result.touches is not None  # refused above
    return result.touches


def simulate_some(
    probe: Probe | PretravelMap | TipBehaviour | str,
    surface: Surface | Part | str,
    targets: Targets,
    *,
    model: str = "analytic",
    gravity: npt.ArrayLike | None = None,
    setup: PartSetup | None = None,
    latch: Latch | None = None,
) -> SimulationResult:
    """As `simulate`, but targets that cannot be touched are no error.

    Parameters are those of `simulate`.
    """
    setup, latch = setup or PartSetup(), latch or Latch()
    surface = surface_of(surface)
    if isinstance(probe, str):
        probe = load_probe(probe)
    if isinstance(probe, PretravelMap):
        latch = latch_with_map(latch, probe)
    tip = tip_of(probe, model, workpiece=setup.material, gravity=gravity)
    outcomes = touch(
        tip.turned(setup.to_part),
        surface,
        targets,
        friction=setup.friction,
        clearance=setup.clearance,
        stylus=_stylus(probe, setup, surface),
    )
    return SimulationResult(reported(outcomes, targets, tip.radius, latch), outcomes, tip.radius)


def _stylus(
    probe: Probe | PretravelMap | TipBehaviour, setup: PartSetup, surface: Surface | Part
) -> StylusOutline | None:
    if not setup.check_stylus:
        return None
    if not isinstance(probe, Probe):
        raise PretravelError("collisions of the stylus need a described probe, not a map")
    if not isinstance(surface, Part):
        raise PretravelError(
            "collisions of the stylus are checked with the faces of a part (part.step), not with "
            "a single surface: leave this check out, or give the part",
            inputs=("stem", "surface"),
        )
    return stylus_outline(probe, setup.to_part @ np.asarray(probe.orientation.axis))


def refuse_failures(
    outcomes: SurfaceTouches, targets: Targets, surface: Surface | Part | str
) -> None:
    """Refuse targets that cannot be touched, with the reasons.

    Raises
    ------
    PretravelError
        If there are such targets.
    """
    surface = surface_of(surface)
    failures = describe_failures(outcomes, targets, surface)
    if failures:
        raise PretravelError(
            f"{int(np.sum(~outcomes.converged))} of {len(targets)} targets cannot be touched: "
            + "; ".join(failures)
            + ". "
            + _advice(outcomes, targets, surface)
        )


def _advice(outcomes: SurfaceTouches, targets: Targets, surface: Surface | Part) -> str:
    """Advice on what to check, for targets that cannot be touched."""
    failed = np.flatnonzero(~outcomes.converged)
    if np.all(outcomes.status[failed] == TouchStatus.NOT_CONVERGED):
        return "The targets may be correct; this is a limit of the solver: rotate them by 0.001°"
    if np.all(outcomes.status[failed] == TouchStatus.EDGE) and not isinstance(surface, Part):
        return (
            "The surface ends there: leave these targets out, or plan with a margin (the range of "
            "the parameters is the whole of this surface)"
        )
    search = ContactSearch(surface, len(targets))
    nearest = ball_center(0.0)
    search.solve(targets.points, ContactProblem(Lines(targets.points), lambda _rows: nearest))
    found = search.contacts()
    near = failed[found.solved[failed]]
    distance = float(np.max(np.abs(found.length[near]), initial=0.0))
    if distance > _FAR:
        return (
            f"They lie up to {distance:.3g} mm from the surface: are they in mm, in the part's "
            "frame, and for this surface?"
        )
    inwards = np.sum(found.local.normal[near] * targets.normals[near], axis=1) < 0.0
    if len(near) and np.mean(inwards) > 0.5:
        return "Their normals point into the part; they must point out of it"
    return "Check the points, normals and approaches of the targets, and the place of the surface"


def reported(
    outcomes: SurfaceTouches, targets: Targets, tip_radius: float, latch: Latch
) -> Touches | None:
    """The touches that a machine latches.

    Parameters
    ----------
    outcomes : SurfaceTouches
    targets : Targets
        As given to `touch`.
    tip_radius : float
        [mm]
    latch : Latch

    Returns
    -------
    Touches or None
        The converged ones, in the order of the targets; None if there are none. Noise is drawn for
        all targets, so that the omission of one does not change the others.
    """
    travel = latch.latched(outcomes.travel)
    approaches = np.asarray(targets.approaches)
    start = targets.points + tip_radius * targets.normals
    rows = np.flatnonzero(outcomes.converged)
    if len(rows) == 0:
        return None
    return Touches(
        positions=(start + travel[:, None] * approaches)[rows],
        normals=targets.normals[rows],
        approaches=approaches[rows],
        feeds=None if latch.feed is None else np.full(len(rows), latch.feed),
        labels=None if targets.labels is None else tuple(targets.labels[i] for i in rows),
        nominal_points=outcomes.first_point[rows],
        source=None,
    )


def travel_since_contact(touches: Touches, tip_radius: float) -> FloatArray:
    """Travel along the approach, from first contact at the nominal point to the latch.

    Parameters
    ----------
    touches : Touches
        With nominal points, whose surface normals are those of the touches.
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
        raise PretravelError(
            "these touches have no nominal points, from which the travel is measured"
        )
    contact = touches.nominal_points + tip_radius * touches.normals
    return np.asarray(np.sum((touches.positions - contact) * touches.approach_directions, axis=1))


def target_warnings(
    targets: Targets, outcomes: SurfaceTouches, axis: npt.ArrayLike | None = None
) -> list[str]:
    """Sentences about targets that do not agree with the surface, or that the stylus may not reach.

    Parameters
    ----------
    targets : Targets
    outcomes : SurfaceTouches
        Of the touches at them.
    axis : (3,) float, optional
        Of a stylus whose collisions with the part were not checked, from the tip to the spindle.
    """
    warnings = []
    rows = np.flatnonzero(outcomes.converged)
    off = np.linalg.norm((outcomes.first_point - targets.points)[rows], axis=1)
    if np.any(off > _NEAR):
        warnings.append(
            f"{int(np.sum(off > _NEAR))} of {len(targets)} targets are up to {off.max():.3g} mm "
            "away from the point where their approach meets the surface; that point is used"
            + (
                ". Are they in mm, in the part's frame, and for this surface?"
                if off.max() > _FAR
                else ""
            )
        )
    cosine = np.sum(outcomes.first_normal * targets.normals, axis=1)[rows]
    if np.any(cosine < math.cos(math.radians(1.0))):
        worst = math.degrees(math.acos(float(np.clip(cosine.min(), -1.0, 1.0))))
        warnings.append(
            f"the targets' normals differ from the surface's by up to {worst:.1f}°: compensation "
            "along them has a direction error of this size"
        )
    if axis is not None:
        away = targets.normals[rows] @ np.asarray(axis, dtype=np.float64) < -_AWAY
        if away.any():
            warnings.append(
                f"{int(away.sum())} of {len(targets)} targets face away from the spindle: whether "
                "the stylus meets the part there before the tip was not checked"
            )
    return warnings
