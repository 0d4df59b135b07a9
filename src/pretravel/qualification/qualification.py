"""Qualification: touches on a reference sphere or ring in, a map of the probe out."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base.arrays import BoolArray, FloatArray, IntArray, frozen
from pretravel.base.errors import PretravelError
from pretravel.base.forms import ShownInNotebooks
from pretravel.base.frames import probe_rotation
from pretravel.base.units import MICROMETRE
from pretravel.maps.basis import values_in_blocks
from pretravel.maps.kind import CenteredFit, KindOfMap, MapFit
from pretravel.maps.kinds.harmonic import HarmonicMapFit, fit_harmonic
from pretravel.maps.observation import Scatter, scatter_of_repeats
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import Origin, Provenance, QualificationSetup
from pretravel.maps.support import DirectionSupport
from pretravel.qualification.delay import SignalDelay, travel_per_second
from pretravel.qualification.machine_in_touches import MachineEffects
from pretravel.qualification.map_warnings import (
    height_warnings,
    map_warnings,
    repeat_warnings,
    setup_warnings,
)
from pretravel.qualification.outliers import Outlier
from pretravel.qualification.prepare import PreparedTouches, prepare
from pretravel.touches import Touches, at_rest

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Qualification(ShownInNotebooks):
    """The result of touches on a reference sphere or ring.

    Attributes
    ----------
    pretravel_map : PretravelMap
    setup : QualificationSetup
        What it was made with.
    kind : KindOfMap
    center : (3,) float
        Of the reference, in the convention of `qualify`; on a ring the coordinate
        along the axis is the mean of the touches. [mm]
    center_covariance : (3, 3) float
        Zero along a ring's axis, where the centre is not measured. [mm²]
    effective_radius : float
        Tip radius less mean pretravel, from the least-squares sphere. [mm]
    u_effective_radius : float
        [mm]
    residuals : (n,) float
        Observed pretravel less the map's, at each touch, also of those that were left out. [mm]
    degrees_of_freedom : float
        Touches less (effective) parameters.
    repeatability : float
        Standard deviation of a touch among repeats of its direction; of the residuals
        without repeats, and where a physical model leaves scatter alone. [mm]
    repeatability_dof : float
    observed : (n,) float
        Pretravel of each touch about the fitted centre. [mm]
    contact_normals : (n, 3) float
        Machine frame.
    groups : (n,) int
        Which touches repeat each other's direction.
    used : (n,) bool
        False for touches that were left out as gross errors.
    outliers : tuple of Outlier
    effect_of_outliers : float
        Largest change of the map if the touches that were left out were kept. [mm]
    effects : MachineEffects
        What the machine adds to the touches.
    delay : SignalDelay or None
        Where several feeds separated it; `observed` and the map are then those at rest.
    fit : MapFit
        What the kind of map states of its fit beside the map.
    warnings : tuple of str
        What to know before the result is used.
    """

    pretravel_map: PretravelMap
    setup: QualificationSetup
    kind: KindOfMap
    center: FloatArray
    center_covariance: FloatArray
    effective_radius: float
    u_effective_radius: float
    residuals: FloatArray
    degrees_of_freedom: float
    repeatability: float
    repeatability_dof: float
    observed: FloatArray
    contact_normals: FloatArray
    groups: IntArray
    used: BoolArray
    outliers: tuple[Outlier, ...]
    effect_of_outliers: float
    effects: MachineEffects
    delay: SignalDelay | None
    fit: MapFit
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        out = int((~self.used).sum())
        return (
            f"Qualification({self.pretravel_map.kind}; {len(self.used):,} touches, {out} left out; "
            f"effective radius {self.effective_radius:.4f} mm; "
            f"repeatability {self.repeatability / MICROMETRE:.2f} µm; "
            f"{len(self.warnings)} warnings)"
        )


def qualify(touches: Touches, setup: QualificationSetup, kind: KindOfMap) -> Qualification:
    """Qualify a probe on a reference sphere or in a ring gauge.

    Every touch determines how far the latched point is from the centre of the reference:
    |P - c| = R + r - pretravel on a sphere, R - r + pretravel in a ring. A shift of the centre
    looks like a first harmonic of the map, and touches on a sphere cannot separate the two: a
    convention does. Across the axis a harmonic map has no first harmonic, as an even tripod has
    none (kinds mean and sectors: the least-squares centre). Along the axis, where that centre lies
    5 to 15 um off, because pole and equator differ so much, the map is given the pretravel
    `QualificationSetup.axial_pretravel` at the pole. The error of the convention shifts map,
    centre and parts as a whole: distances between points, and to this reference, are right in any
    case, and the stated uncertainties are of these.

    Touches at several feeds separate the signal delay: delay travel grows with the feed,
    pretravel does not. The map is then that of the probe at rest, and contains the delay.

    Parameters
    ----------
    touches : Touches
        Repeats of a direction are recognised by their normals.
    setup : QualificationSetup
        Reference, tip and conventions.
    kind : KindOfMap
        For example ``HarmonicKind()``; `pretravel.qualify` takes it by name.

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        Too few touches, all in one plane, diameters or units that do not fit,
        normals that do not fit, sectors without a touch.

    References
    ----------
    The sphere as reference: Woźniak, section 4; Rodrigues 2021, equation 2.1.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.kinds.mean import MeanKind
    >>> n = sphere_pattern_25()
    >>> touches = Touches(n * (12.5 + 3.0 - 0.010) + [100.0, 0.0, 0.0], n)
    >>> result = qualify(touches, QualificationSetup(25.0, tip_diameter=6.0), MeanKind())
    >>> abs(result.center.round(9)).tolist(), round(result.effective_radius, 9)
    ([100.0, 0.0, 0.0], 2.99)
    """
    return qualified(prepare(touches, setup, kind), kind)


def qualified(ready: PreparedTouches, kind: KindOfMap, near: MapFit | None = None) -> Qualification:
    """As `qualify`, with touches that are prepared.

    Parameters
    ----------
    ready : PreparedTouches
    kind : KindOfMap
    near : MapFit, optional
        Of this kind, to similar touches: the fit begins there.

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        Touches that do not determine this kind of map.
    """
    _LOG.info("%s map", kind.name)
    setup, rotation = ready.setup, probe_rotation(ready.setup.axis)
    fit = _fitted(kind, ready, near)
    repeatability = _repeatability(fit, ready)
    centered = kind.centered(fit, setup.axial_pretravel)
    level = _level(fit, centered)
    effect = _effect_of_delay(ready, kind, fit, centered)
    pretravel_map = _map(ready, kind, repeatability, level, effect)
    axes = rotation[:, : ready.observation.axes]
    about = replace(ready.whole, center=centered.center)
    observed = about.values + level.observed_offset
    modelled = values_in_blocks(pretravel_map.basis, about.directions, pretravel_map.coefficients)
    return Qualification(
        pretravel_map=pretravel_map,
        setup=setup,
        kind=kind,
        center=frozen(rotation @ centered.center),
        center_covariance=frozen(
            axes @ centered.center_covariance @ axes.T
            + np.outer(rotation @ effect.center, rotation @ effect.center)
        ),
        effective_radius=fit.observation.tip_radius - fit.mean,
        u_effective_radius=math.hypot(fit.u_mean, 0.5 * setup.u_reference_diameter, effect.mean),
        residuals=frozen(observed - modelled),
        degrees_of_freedom=fit.dof,
        repeatability=repeatability.deviation,
        repeatability_dof=repeatability.dof,
        observed=frozen(observed),
        contact_normals=frozen(about.directions @ rotation.T),
        groups=ready.whole.groups,
        used=ready.used,
        outliers=ready.outliers,
        effect_of_outliers=_effect_of_outliers(ready, kind, fit, centered),
        effects=ready.effects,
        delay=ready.delay,
        fit=fit,
        warnings=(
            *ready.warnings,
            *setup_warnings(setup),
            *repeat_warnings(repeatability, repeated=ready.repeats.dof > 0.0),
            *kind.warnings(fit, repeatability.deviation),
            *map_warnings(pretravel_map, ready.observation),
            *height_warnings(
                math.sqrt(centered.center_covariance[-1, -1]), pretravel_map, ring=setup.ring
            ),
        ),
    )


def _fitted(kind: KindOfMap, ready: PreparedTouches, near: MapFit | None) -> MapFit:
    observation, repeats = ready.observation, ready.repeats
    if near is None and kind.fits_harmonics and ready.detail is not None:
        near = ready.detail
    if near is None:
        first = kind.fit(observation, repeats)
    else:
        first = kind.fit_near(near, observation, repeats)
    if not kind.fits_harmonics:
        return first
    # Once more with the contact normals about the centre that was found.
    center = kind.centered(first, ready.setup.axial_pretravel).center
    return kind.refit(first, replace(observation, center=center)) or first


def _effect_of_outliers(
    ready: PreparedTouches, kind: KindOfMap, fit: MapFit, centered: CenteredFit
) -> float:
    """Largest change of the map if nothing was left out. [mm]"""
    if ready.used.all():
        return 0.0
    try:
        other = kind.fit_near(fit, ready.whole, scatter_of_repeats(ready.whole))
    except PretravelError:
        return math.inf
    directions = fit.observation.group_directions
    moved = kind.centered(other, ready.setup.axial_pretravel)
    change = other.basis.value(directions, moved.coefficients)
    change = change - fit.basis.value(directions, centered.coefficients)
    shift = (moved.center - centered.center)[: fit.observation.axes]
    return float(np.abs(change - directions[:, : len(shift)] @ shift).max())


def _repeatability(fit: MapFit, ready: PreparedTouches) -> Scatter:
    if fit.noise_is_repeatability:
        return Scatter(fit.noise, fit.dof)
    if ready.repeats.dof > 0.0:
        return ready.repeats
    # A coarse kind contains the part that it does not represent in its residuals.
    fine = fit if isinstance(fit, HarmonicMapFit) else ready.detail
    fine = fine or fit_harmonic(fit.observation)
    return Scatter(fine.noise, max(fine.dof, 1.0))


@dataclass(frozen=True, eq=False)
class _Level:
    """The level of the map and the tip radius that goes with it."""

    centered: CenteredFit
    fit: MapFit
    coefficients: FloatArray
    tip_radius: float
    gauge: str
    observed_offset: float
    """Of observed pretravel. [mm]"""


def _level(fit: MapFit, centered: CenteredFit) -> _Level:
    """Level by the tip's diameter; by the fit; else the mean of the map is zero."""
    radius = fit.observation.tip_radius
    if fit.tip_radius is not None:
        offset = fit.tip_radius - radius
        return _Level(centered, fit, centered.coefficients, fit.tip_radius, centered.gauge, offset)
    if fit.observation.tip_known:
        return _Level(centered, fit, centered.coefficients, radius, centered.gauge, 0.0)
    constant = fit.basis.constant
    assert constant is not None  # fitted maps contain one
    return _Level(
        centered,
        fit,
        centered.coefficients - fit.mean * constant,
        radius - fit.mean,
        centered.gauge + " and to its mean, since no tip diameter was given",
        -fit.mean,
    )


@dataclass(frozen=True, eq=False)
class _EffectOfDelay:
    """Changes for a signal delay longer by one standard uncertainty. [mm]"""

    coefficients: FloatArray | None
    center: FloatArray
    mean: float


def _effect_of_delay(
    ready: PreparedTouches, kind: KindOfMap, fit: MapFit, centered: CenteredFit
) -> _EffectOfDelay:
    if ready.delay is None:
        return _EffectOfDelay(None, np.zeros(3), 0.0)
    u_delay, touches = ready.delay.u_delay, ready.touches.take(ready.used)
    later = at_rest(touches, u_delay).positions @ probe_rotation(ready.setup.axis)
    again = kind.refit(fit, replace(fit.observation, positions=later))
    if again is None:
        mean = -u_delay * float(np.mean(travel_per_second(touches)))
        constant = fit.basis.constant
        assert constant is not None  # fitted maps contain one
        return _EffectOfDelay(mean * constant, np.zeros(3), mean)
    shifted = kind.centered(again, ready.setup.axial_pretravel)
    return _EffectOfDelay(
        shifted.coefficients - centered.coefficients,
        shifted.center - centered.center,
        again.mean - fit.mean,
    )


def _map(
    ready: PreparedTouches,
    kind: KindOfMap,
    repeatability: Scatter,
    level: _Level,
    effect: _EffectOfDelay,
) -> PretravelMap:
    touches, delay, fit, setup = ready.touches, ready.delay, level.fit, ready.setup
    feed = None if touches.feeds is None else float(np.mean(touches.feeds))
    count = fit.observation.direction_count
    return PretravelMap(
        basis=fit.basis,
        coefficients=level.coefficients,
        covariance=level.centered.covariance,
        support=DirectionSupport(fit.observation.group_directions),
        tip_radius=level.tip_radius,
        u_tip_radius=0.5 * setup.u_reference_diameter,
        repeatability=repeatability.deviation,
        repeatability_dof=repeatability.dof,
        fixed_scatter=math.hypot(
            max(fit.fixed_scatter, ready.effects.step_scatter), ready.effects.fixed_scatter
        ),
        rotation=probe_rotation(setup.axis),
        feed=feed if delay is None else 0.0,
        delay=None if delay is None else delay.delay,
        u_delay=0.0 if delay is None else delay.u_delay,
        delay_effect=effect.coefficients,
        provenance=Provenance(
            Origin.QUALIFIED,
            f"qualified on a {setup.reference} of {setup.diameter:.9g} mm",
            touches=f"{int(ready.used.sum())} touches in {count} directions"
            + (f", from {touches.source}" if touches.source else ""),
            touches_file=touches.source or "",
            reading=touches.reading,
            touch_digests=ready.digests,
            gauge=f"pretravel is relative to {level.gauge}",
            level_known=setup.tip_diameter is not None,
            setup=setup,
            kind_settings=dict(kind.settings()),
        ),
    )
