"""Qualification: touches on a reference sphere or ring in, a map of the probe out."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, IntArray, frozen
from pretravel.directions import describe, fibonacci_cap, from_angles, polar_angle
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.maps.bases import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import MARGIN, DirectionSupport
from pretravel.qualification.delay import (
    COSTLY,
    SignalDelay,
    several_feeds,
    signal_delay,
    travel_per_second,
)
from pretravel.qualification.map_fit import (
    EQUATORIAL,
    KINDS,
    HarmonicMapFit,
    Kind,
    MapFit,
    fit_harmonic,
    fit_table,
)
from pretravel.qualification.observation import Observation, observe, pure_error
from pretravel.qualification.outliers import Outlier, direction_outliers, repeat_outliers
from pretravel.qualification.wozniak import fit_wozniak
from pretravel.touches import Touches, at_rest
from pretravel.units import DEGREE, MICROMETRE

AXIAL_PRETRAVEL = 1.0 * MICROMETRE
"""Pretravel along the probe axis that is assumed where nothing better is known. [mm]

Along its axis a probe is stiff: seats, stylus and tip contact of an OMP40-2 give 1.2 um."""
MOST_PRETRAVEL = 0.1
"""A map that rises above this is warned about. [mm]"""
FitMap = Callable[[Observation, float, float], MapFit]
"""A kind of map that is fitted elsewhere: from the touches about a centre, the standard
deviation among their repeats [mm] and its degrees of freedom (0: no repeats)."""
IMPLAUSIBLE = 2.0 * MICROMETRE
"""A map that falls further below zero than this is warned about. [mm]"""


@dataclass(frozen=True, eq=False)
class Qualification:
    """What a reference sphere or ring says about a probe.

    Attributes
    ----------
    pretravel_map : PretravelMap
    center : (3,) float
        Of the reference, in the convention of `qualify`; on a ring the coordinate
        along the axis is the mean of the touches. [mm]
    center_covariance : (3, 3) float
        Zero along a ring's axis, where it is not measured. [mm²]
    effective_radius : float
        Tip radius less mean pretravel, from the least-squares sphere. [mm]
    u_effective_radius : float
        [mm]
    residuals : (n,) float
        Observed pretravel less the map's, at each touch. [mm]
    degrees_of_freedom : float
        Touches less (effective) parameters.
    repeatability : float
        Standard deviation of a touch among repeats of its direction; of the residuals
        without repeats, and where a physical model leaves nothing but scatter. [mm]
    repeatability_dof : float
    observed : (n,) float
        Pretravel of each touch about the fitted centre. [mm]
    contact_normals : (n, 3) float
        Machine frame.
    groups : (n,) int
        Which touches repeat each other's direction.
    outliers : tuple of Outlier
    delay : SignalDelay or None
        Where several feeds told it apart; `observed` and the map are then those at rest.
    fit : MapFit
        What the kind of map says of its fit beside the map.
    warnings : tuple of str
        What to know before believing the rest.
    """

    pretravel_map: PretravelMap
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
    outliers: tuple[Outlier, ...]
    delay: SignalDelay | None
    fit: MapFit
    warnings: tuple[str, ...]


def qualify(
    touches: Touches,
    diameter: float,
    *,
    kind: Kind | FitMap = "harmonic",
    ring: bool = False,
    tip_diameter: float | None = None,
    u_diameter: float = 0.0,
    axial_pretravel: float | None = AXIAL_PRETRAVEL,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
    search_outliers: bool = True,
    lobe_azimuth: float | None = None,
    transducer: str = "contact",
) -> Qualification:
    """Qualify a probe on a reference sphere or in a ring gauge.

    Every touch says how far the latched point is from the reference's centre:
    |P - c| = R + r - pretravel on a sphere, R - r + pretravel in a ring. A shift
    of the centre looks like a first harmonic of the map, and no touch on a sphere can
    tell the two apart: a convention has to. Across the axis a harmonic map has no first
    harmonic, which an even tripod's has not either (kinds mean and sectors: the
    least-squares centre). Along the axis, where
    that centre lies 5 to 15 um off (pole and equator give so differently), the map is
    made to have the pretravel `axial_pretravel` at the pole. What the convention
    misses shifts map and centre together and parts as a whole: distances between
    points, and to this reference, are right whatever it is, and stated uncertainties are
    of those.

    Touches at several feeds tell the signal delay apart: delay travel grows with the feed,
    pretravel does not. The map is then that of the probe at rest, and knows the delay.

    Parameters
    ----------
    touches : Touches
        Repeats of a direction are recognised by their normals.
    diameter : float
        Calibrated diameter of the sphere or ring. [mm]
    kind : str or callable
        mean, sectors, wozniak or harmonic; or a fit of your own. The physical kind is one
        (`pretravel.identification.kinds` takes it by name).
    ring : bool
        The reference is a ring, touched inside; its axis is the probe's.
    tip_diameter : float, optional
        [mm]. Not given: only differences of pretravel are known, the map's mean is
        zero and its tip radius the effective one. Points come out the same but for the
        height: without an absolute pretravel the axial convention has nothing to hold on
        to, and the centre is the least-squares sphere's along the axis too.
    u_diameter : float
        Standard uncertainty of the diameter. [mm]
    axial_pretravel : float or None
        Of harmonic maps at the pole, where the sphere was touched there and the tip
        diameter is known. None: the centre is the least-squares sphere's along the
        axis too. [mm]
    axis : (3,) float
        The probe's +z (tip to spindle) in the machine frame.
    search_outliers : bool
        Compare each direction with the others. It costs the kinds mean and sectors a
        harmonic fit, which also tells noise from lobing where nothing is repeated.
    lobe_azimuth : float, optional
        Of kind wozniak, where the touches do not tell it: azimuth of largest pretravel,
        opposite a rod. [rad]
    transducer : str
        Of kind wozniak: contact or piezo.

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        Too few touches, all in one plane, diameters or units that do not fit,
        normals that do not, sectors without a touch.

    References
    ----------
    The sphere as reference: Woźniak, section 4; Rodrigues 2021, equation 2.1.

    >>> from pretravel.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> touches = Touches(n * (12.5 + 3.0 - 0.010) + [100.0, 0.0, 0.0], n)
    >>> result = qualify(touches, 25.0, tip_diameter=6.0, kind="mean")
    >>> abs(result.center.round(9)).tolist(), round(result.effective_radius, 9)
    ([100.0, 0.0, 0.0], 2.99)
    """
    if not callable(kind) and kind not in KINDS:
        raise PretravelError(f"map kind '{kind}' is not known; there are {', '.join(KINDS)}")
    rotation = probe_rotation(axis)
    observation = observe(touches, diameter, ring, tip_diameter, rotation)
    delay, feed_warnings = None, []
    if several_feeds(touches):
        delay = _separated_delay(touches, observation, rotation)
        cost = delay.u_delay * float(np.mean(travel_per_second(touches)))
        if cost > COSTLY:
            feed_warnings.append(
                f"the touches were made at {delay.slowest:g} to {delay.fastest:g} mm/min, which "
                "tells the signal delay too badly to take it apart (feeds that differ little, or "
                "go with the directions): delay travel is spread over the map. Touch the same "
                "directions at two quite different feeds, or all at one"
            )
            delay = None
        elif delay.delay < -3.0 * delay.u_delay:
            raise PretravelError(
                f"the touches tell a signal delay of {delay.delay * 1e3:.3f} ms (u = "
                f"{delay.u_delay * 1e3:.3f}): a signal cannot come before its trigger. Are the "
                "feeds those of the touches, and does something else change with them?"
            )
        else:
            touches = at_rest(touches, delay.delay)
            observation = observe(touches, diameter, ring, tip_diameter, rotation)
    repeatability, repeatability_dof = pure_error(observation)
    repeated = repeatability_dof > 0.0
    outliers = repeat_outliers(touches, observation)
    told = axial_pretravel if kind == "harmonic" and tip_diameter is not None else None
    fit: MapFit
    lively: HarmonicMapFit | None = None
    if kind == "harmonic":
        first = fit_harmonic(observation)
        # Once more with the contact normals about the centre that was found.
        observation = replace(observation, center=_settle(first, observation, told).center)
        fit = lively = fit_harmonic(observation, first.posterior.amplitudes)
    else:
        if callable(kind):
            fit = kind(observation, repeatability, repeatability_dof)
        elif kind == "wozniak":
            fit = fit_wozniak(observation, lobe_azimuth=lobe_azimuth, transducer=transducer)
            # Its centre lies micrometres from the least-squares one; once more about it.
            observation = replace(observation, center=_settle(fit, observation, None).center)
            fit = fit_wozniak(observation, lobe_azimuth=lobe_azimuth, transducer=transducer)
        else:
            fit = fit_table(observation, kind)
        # What a table leaves is mostly the probe's lobing; noise and outliers show once
        # that is taken off.
        lively = fit_harmonic(observation) if search_outliers else None
    if search_outliers and lively is not None:
        named = [row for outlier in outliers for row in outlier.rows]
        outliers = outliers + direction_outliers(touches, observation, lively, named)
    if fit.noise_is_repeatability:
        repeatability, repeatability_dof = fit.noise, fit.dof
    elif repeatability_dof == 0.0:
        source = fit if lively is None else lively
        repeatability, repeatability_dof = source.noise, max(source.dof, 1.0)
    settled = _settle(fit, observation, told)
    coefficients, gauge = settled.coefficients.copy(), settled.gauge
    covariance = settled.covariance
    # The coefficients that raise the whole map by what they are raised.
    constant = np.zeros(fit.basis.size)
    raising = {"sectors": slice(None), "wozniak": slice(2, 3), "physical": slice(1, 2)}
    constant[raising.get(fit.basis.kind, slice(0, 1))] = 1.0
    offset, tip_radius = 0.0, observation.tip_radius
    if fit.tip_radius is not None:
        offset = fit.tip_radius - tip_radius
        tip_radius = fit.tip_radius
    elif tip_diameter is None:
        offset = fit.mean
        coefficients = coefficients - offset * constant
        tip_radius -= offset
        gauge += " and to its mean, since no tip diameter was given"
    feed = None if touches.feeds is None else float(np.mean(touches.feeds))
    # What one standard uncertainty more of delay does to map, centre and mean.
    effect, center_effect, mean_effect = None, np.zeros(3), 0.0
    if delay is not None:
        feed = 0.0
        mean_effect = -delay.u_delay * float(np.mean(travel_per_second(touches)))
        effect = mean_effect * constant
        if not callable(kind):
            further = replace(
                observation, positions=at_rest(touches, delay.u_delay).positions @ rotation
            )
            again = _fitted_again(kind, further, fit)
            shifted = _settle(again, further, told)
            effect = shifted.coefficients - settled.coefficients
            center_effect = shifted.center - settled.center
            mean_effect = again.mean - fit.mean
    axes = rotation[:, : observation.axes]
    count = int(observation.groups.max()) + 1
    pretravel_map = PretravelMap(
        basis=fit.basis,
        coefficients=coefficients,
        covariance=covariance,
        support=DirectionSupport(observation.group_directions),
        tip_radius=tip_radius,
        u_tip_radius=0.5 * u_diameter,
        repeatability=repeatability,
        repeatability_dof=repeatability_dof,
        rotation=rotation,
        feed=feed,
        delay=None if delay is None else delay.delay,
        u_delay=0.0 if delay is None else delay.u_delay,
        delay_effect=effect,
        provenance={
            "source": f"qualified on a {'ring' if ring else 'sphere'} of {diameter:.9g} mm",
            "touches": f"{len(touches)} in {count} directions"
            + (f", from {touches.source}" if touches.source else ""),
            "gauge": f"pretravel is relative to {gauge}",
        },
    )
    moved = (settled.center - observation.center)[: observation.axes]
    return Qualification(
        pretravel_map=pretravel_map,
        center=frozen(rotation @ settled.center),
        center_covariance=frozen(
            axes @ settled.center_covariance @ axes.T
            + np.outer(rotation @ center_effect, rotation @ center_effect)
        ),
        effective_radius=observation.tip_radius - fit.mean,
        u_effective_radius=math.hypot(fit.u_mean, 0.5 * u_diameter, mean_effect),
        residuals=frozen(fit.residuals),
        degrees_of_freedom=fit.dof,
        repeatability=repeatability,
        repeatability_dof=repeatability_dof,
        observed=frozen(
            observation.values
            + observation.free_design[:, 1:] @ moved
            + (offset if fit.tip_radius is not None else -offset)
        ),
        contact_normals=frozen(observation.directions @ rotation.T),
        groups=observation.groups,
        outliers=tuple(outliers),
        delay=delay,
        fit=fit,
        warnings=tuple(
            feed_warnings
            + _scatter_warnings(
                repeatability, repeatability_dof, repeated, fit.basis.kind, fit.noise
            )
            + _warnings(pretravel_map, observation, tip_diameter is not None)
        ),
    )


def _separated_delay(
    touches: Touches, observation: Observation, rotation: FloatArray
) -> SignalDelay:
    """The signal delay; each round with what the last one found taken off."""
    total = 0.0
    resting, seen = touches, observation
    for _ in range(6):
        found = signal_delay(resting, fit_harmonic(seen), *pure_error(seen))
        total += found.delay
        if math.isinf(found.u_delay) or abs(found.delay) < 0.01 * found.u_delay:
            break
        resting = at_rest(touches, total)
        seen = replace(observation, positions=resting.positions @ rotation)
    return replace(found, delay=total)


def _fitted_again(kind: Kind, observation: Observation, fit: MapFit) -> MapFit:
    """The same fit of slightly other touches: nothing chosen anew."""
    if isinstance(fit, HarmonicMapFit):
        return fit_harmonic(observation, fit.posterior.amplitudes)
    if isinstance(fit.basis, WozniakBasis):
        return fit_wozniak(
            observation,
            lobe_azimuth=fit.basis.lobe_azimuth,
            transducer=fit.basis.transducer,
        )
    return fit_table(observation, kind)


@dataclass(frozen=True, eq=False)
class _Settled:
    """A fit in the convention that tells its map from its centre, probe frame."""

    center: FloatArray
    center_covariance: FloatArray  # (axes, axes)
    coefficients: FloatArray
    covariance: FloatArray
    gauge: str


def _settle(fit: MapFit, observation: Observation, axial_pretravel: float | None) -> _Settled:
    # A centre moved by s adds n·s to the observed pretravel, in a ring as on a sphere.
    center = observation.center.copy()
    center[: observation.axes] -= fit.shift
    least_squares = _Settled(
        center=center,
        center_covariance=fit.shift_covariance,
        coefficients=fit.coefficients,
        covariance=fit.covariance,
        gauge=fit.gauge,
    )
    if axial_pretravel is None or observation.ring or not isinstance(fit, HarmonicMapFit):
        return least_squares
    pole = np.array([[0.0, 0.0, 1.0]])
    if not DirectionSupport(observation.group_directions).supports(pole)[0]:
        return replace(
            least_squares,
            gauge=least_squares.gauge + " (no touch near the pole tells its height better)",
        )
    at_pole = fit.basis.design(pole)[0]
    axial = float(at_pole @ fit.coefficients) - axial_pretravel
    # The map less its own value at the pole: what is subtracted scatters with the touches too.
    move = np.eye(len(fit.coefficients))
    first_zonal = (fit.basis.terms == (1, 0)).all(axis=1)
    move[first_zonal] -= at_pole / math.sqrt(3.0)
    coefficients = fit.coefficients.copy()
    coefficients[first_zonal] -= axial / math.sqrt(3.0)
    center = center.copy()
    center[2] -= axial
    along = np.array([0.0, 0.0, 1.0])
    mixed = np.outer(fit.shift_covariance_with_map @ at_pole, along)
    u_pole = math.sqrt(float(at_pole @ fit.covariance @ at_pole))
    gauge = (
        f"a centre that makes pretravel {axial_pretravel / MICROMETRE:g} µm along the axis "
        "(assumed: touches on a sphere cannot tell it) and has no first harmonic across"
    )
    if observation.directions[:, 2].max() < math.cos(MARGIN):
        gauge += (
            "; the pole was not touched, its value is interpolated "
            f"(u {u_pole / MICROMETRE:.1f} µm)"
        )
    return _Settled(
        center=center,
        center_covariance=fit.shift_covariance
        + mixed
        + mixed.T
        + u_pole**2 * np.outer(along, along),
        coefficients=coefficients,
        covariance=move @ fit.covariance @ move.T,
        gauge=gauge,
    )


def over_support(pretravel_map: PretravelMap) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A map all over the directions that it supports.

    Parameters
    ----------
    pretravel_map : PretravelMap

    Returns
    -------
    directions : (n, 3) float
        Spread over the support, probe frame, the map's own nodes among them.
    pretravel, standard_uncertainty : (n,) float each
        [mm]
    """
    nodes = pretravel_map.support.nodes
    polar = polar_angle(nodes)
    spread = fibonacci_cap(2000, float(polar.max()))
    around = from_angles(polar.max(), np.linspace(0.0, 2.0 * np.pi, 720))
    candidates = np.concatenate([spread, around])
    directions = np.concatenate([nodes, candidates[pretravel_map.support.supports(candidates)]])
    normals = directions @ pretravel_map.rotation.T
    return directions, *pretravel_map.pretravel_and_uncertainty(normals, extrapolate=True)


def _scatter_warnings(
    result_noise: float, dof: float, repeated: bool, kind: str, left: float
) -> list[str]:
    """What repeatability rests on, and whether a model leaves more than it."""
    found = []
    if not repeated and dof < 3.0:
        found.append(
            f"nothing was repeated, and so few directions say next to nothing of repeatability: "
            f"{result_noise / MICROMETRE:.2f} µm is what is usual, not measured. Touch each "
            "direction several times"
        )
    if kind == "wozniak" and left > 3.0 * result_noise:
        found.append(
            f"Woźniak's model leaves {left / MICROMETRE:.1f} µm where touches repeat to "
            f"{result_noise / MICROMETRE:.2f}: check --lobe-azimuth, or compare with --kind auto"
        )
    return found


def _warnings(pretravel_map: PretravelMap, observation: Observation, tip_known: bool) -> list[str]:
    """What is implausible or badly covered, as sentences."""
    found = []
    largest_polar = float(polar_angle(observation.directions).max())
    if not observation.ring and largest_polar < EQUATORIAL:
        found.append(
            f"the touches reach only to polar {largest_polar / DEGREE:.0f}°: from a cap, centre "
            "and effective radius are hardly known; touch the sphere down to its equator"
        )
    if not tip_known:
        found.append(
            "without --tip-diameter the map is relative to its mean, and the centre's height "
            "along the axis is that of the least-squares sphere, usually 5 to 15 µm off"
        )
    directions, value, u = over_support(pretravel_map)
    if tip_known and value.min() < -IMPLAUSIBLE - 3.0 * u[np.argmin(value)]:
        found.append(
            f"pretravel falls to {value.min() / MICROMETRE:.1f} µm at "
            f"{describe(directions[np.argmin(value)])}, but no probe triggers before contact: "
            "check --diameter, --tip-diameter and the touches there"
        )
    if value.max() > MOST_PRETRAVEL:
        found.append(
            f"pretravel rises to {value.max() / MICROMETRE:.1f} µm at "
            f"{describe(directions[np.argmax(value)])}; probes give by 1 to 80 µm: check "
            "--diameter, --tip-diameter, the feed and the touches there"
        )
    touched = observation.group_directions @ pretravel_map.rotation.T
    at_touches = pretravel_map.standard_uncertainty(touched)
    if u.max() > 5.0 * max(at_touches.max(), pretravel_map.repeatability):
        found.append(
            f"between the touches u of the map grows to {u.max() / MICROMETRE:.1f} µm, at "
            f"{describe(directions[np.argmax(u)])}: touch the reference there too"
        )
    return found
