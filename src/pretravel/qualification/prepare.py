"""Touches are made ready for a fit: at rest, without the machine's part, without gross errors."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base.arrays import BoolArray, FloatArray
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.kind import KindOfMap
from pretravel.maps.kinds.harmonic import HarmonicMapFit, fit_harmonic
from pretravel.maps.observation import Observation, Scatter, scatter_of_repeats
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.delay import (
    COSTLY,
    SignalDelay,
    several_feeds,
    signal_delay,
    travel_per_second,
)
from pretravel.qualification.machine_effects import quantisation_step
from pretravel.qualification.machine_in_touches import MachineEffects, machine_effects
from pretravel.qualification.observe import observe
from pretravel.qualification.outliers import Outlier, direction_outliers, repeat_outliers
from pretravel.qualification.own_touches import touch_digests
from pretravel.touches import Touches, at_rest

_LOG = logging.getLogger(__name__)
_FEWEST_LEFT = 0.8
"""Share of the touches that must remain; else it is not single touches that are wrong."""


@dataclass(frozen=True, eq=False)
class PreparedTouches:
    """Touches on a reference that a map can be fitted to.

    Attributes
    ----------
    touches : Touches
        All, at rest and without the machine's part.
    setup : QualificationSetup
    whole : Observation
        Of all touches.
    observation : Observation
        Of the touches that are used, about the same centre.
    used : (n,) bool
        False for touches that are left out as gross errors.
    repeats : Scatter
        Of the used touches.
    outliers : tuple of Outlier
    detail : HarmonicMapFit or None
        From the search of outliers: harmonic fits begin there.
    effects : MachineEffects
    delay : SignalDelay or None
    warnings : tuple of str
    digests : str
        Of the touches that are used, as the machine latched them.
    """

    touches: Touches
    setup: QualificationSetup
    whole: Observation
    observation: Observation
    used: BoolArray
    repeats: Scatter
    outliers: tuple[Outlier, ...]
    detail: HarmonicMapFit | None
    effects: MachineEffects
    delay: SignalDelay | None
    warnings: tuple[str, ...]
    digests: str


def prepare(
    touches: Touches, setup: QualificationSetup, confirm: KindOfMap | None = None
) -> PreparedTouches:
    """Observe touches about the centre of the reference, and name those that are wrong.

    Parameters
    ----------
    touches : Touches
        In the order in which they were made.
    setup : QualificationSetup
    confirm : KindOfMap, optional
        Kind of map that must contradict a direction too before it is left out; a harmonic map
        alone can take a kink of the probe for an error.

    Returns
    -------
    PreparedTouches

    Raises
    ------
    PretravelError
        As `pretravel.qualification.observe.observe`; an impossible signal delay.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> ready = prepare(Touches(n * 15.49, n), QualificationSetup(25.0, tip_diameter=6.0))
    >>> bool(ready.used.all()), ready.delay is None
    (True, True)
    """
    rotation = probe_rotation(setup.axis)
    _LOG.info("centre of the reference")
    rest = _at_rest(touches, setup, rotation)
    _LOG.info("drift and hysteresis")
    corrected, effects = without_machine(
        rest.touches, rest.observation, setup, rotation, latched=touches.positions
    )
    whole = observe(corrected, setup, rotation) if effects.change.any() else rest.observation
    outliers: tuple[Outlier, ...] = ()
    detail: HarmonicMapFit | None = None
    used = np.ones(len(touches), dtype=bool)
    if setup.search_outliers:
        _LOG.info("search of gross errors")
        outliers, detail = _outliers(corrected, whole, effects, confirm)
        used[[row for outlier in outliers for row in outlier.rows]] = False
        if used.mean() < _FEWEST_LEFT:  # another surface, or a kind of probe that is not known
            used[:] = True
            outliers = tuple(replace(outlier, left_out=False) for outlier in outliers)
    if used.all():
        observation = whole
    else:
        again = observe(corrected.take(used), setup, rotation)
        whole = replace(whole, center=again.center, tip_radius=again.tip_radius)
        observation = whole.take(used)
    return PreparedTouches(
        touches=corrected,
        setup=setup,
        whole=whole,
        observation=observation,
        used=used,
        repeats=scatter_of_repeats(observation),
        outliers=outliers,
        detail=detail,
        effects=effects,
        delay=rest.delay,
        warnings=(*rest.warnings, *effects.warnings),
        digests=touch_digests(touches.positions[used]),
    )


def without_machine(
    touches: Touches,
    observation: Observation,
    setup: QualificationSetup,
    rotation: FloatArray,
    *,
    latched: FloatArray | None = None,
) -> tuple[Touches, MachineEffects]:
    """Touches without what the machine adds, as far as it can be subtracted.

    Parameters
    ----------
    touches : Touches
        In the order in which they were made.
    observation : Observation
        Of the same touches.
    setup : QualificationSetup
    rotation : (3, 3) float
        Probe to machine frame, of the observation.
    latched : (n, 3) float, optional
        Positions as the machine latched them; those of the touches when not given. [mm]

    Returns
    -------
    Touches
    MachineEffects
        Estimated without gross errors.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> touches, setup = Touches(n * 15.49, n), QualificationSetup(25.0, tip_diameter=6.0)
    >>> without_machine(touches, observe(touches, setup), setup, np.eye(3))[0].positions.shape
    (25, 3)
    """
    positions = touches.positions if latched is None else latched
    kept = np.ones(len(touches), dtype=bool)
    if setup.search_outliers:
        wrong = repeat_outliers(touches, observation, quantisation_step(positions))
        kept[[row for outlier in wrong for row in outlier.rows]] = False
    if kept.mean() < _FEWEST_LEFT:
        kept[:] = True
    part = observation if kept.all() else observation.take(kept)
    effects = machine_effects(part, positions[kept], setup.sphere_form)
    change = np.zeros(len(kept))
    change[kept] = effects.change
    if not change.any():
        return touches, replace(effects, change=change)
    moved = (observation.directions * change[:, None]) @ rotation.T
    corrected = replace(touches, positions=touches.positions + moved)
    return corrected, replace(effects, change=change)


def _outliers(
    touches: Touches,
    observation: Observation,
    effects: MachineEffects,
    confirm: KindOfMap | None,
) -> tuple[tuple[Outlier, ...], HarmonicMapFit]:
    found = repeat_outliers(touches, observation, effects.step)
    named = [row for outlier in found for row in outlier.rows]
    directions, detail = direction_outliers(touches, observation, named, effects, confirm)
    return (*found, *directions), detail


@dataclass(frozen=True, eq=False)
class _AtRest:
    """Touches without delay travel, where several feeds separated it."""

    touches: Touches
    observation: Observation
    delay: SignalDelay | None = None
    warnings: tuple[str, ...] = ()


def _at_rest(touches: Touches, setup: QualificationSetup, rotation: FloatArray) -> _AtRest:
    observation = observe(touches, setup, rotation)
    if not several_feeds(touches):
        return _AtRest(touches, observation)
    delay = _separated_delay(touches, observation, rotation)
    cost = delay.u_delay * float(np.mean(travel_per_second(touches)))
    if cost > COSTLY:
        warning = (
            f"the touches were made at {delay.slowest:g} to {delay.fastest:g} mm/min, which does "
            "not determine the signal delay well enough (the feeds differ little, or change with "
            "the directions): delay travel is spread over the map. Touch the same directions at "
            "two quite different feeds, or all at one"
        )
        return _AtRest(touches, observation, warnings=(warning,))
    if delay.delay < -3.0 * delay.u_delay:
        raise PretravelError(
            f"the touches give a signal delay of {delay.delay * 1e3:.3f} ms (u = "
            f"{delay.u_delay * 1e3:.3f}): a signal cannot come before its trigger. Are the "
            "feeds those of the touches, and does something else change with them?"
        )
    resting = at_rest(touches, delay.delay)
    return _AtRest(resting, observe(resting, setup, rotation), delay)


def _separated_delay(
    touches: Touches, observation: Observation, rotation: FloatArray
) -> SignalDelay:
    """The signal delay by iteration: each step removes the delay found so far and fits the rest."""
    total = 0.0
    resting, current = touches, observation
    for _ in range(6):
        found = signal_delay(resting, fit_harmonic(current), scatter_of_repeats(current))
        total += found.delay
        if math.isinf(found.u_delay) or abs(found.delay) < 0.01 * found.u_delay:
            break
        resting = at_rest(touches, total)
        current = replace(observation, positions=resting.positions @ rotation)
    return replace(found, delay=total)
