"""Qualification: touches on a reference sphere or ring in, a map of the probe out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, IntArray, frozen
from pretravel.direction_support import MARGIN, DirectionSupport
from pretravel.directions import describe, fibonacci_cap, from_angles, polar_angle
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.metrology.map_fit import (
    EQUATORIAL,
    KINDS,
    Kind,
    MapFit,
    fit_harmonic,
    fit_table,
)
from pretravel.metrology.observation import Observation, observe, pure_error
from pretravel.metrology.outliers import Outlier, direction_outliers, repeat_outliers
from pretravel.pretravel_map import HarmonicBasis, PretravelMap
from pretravel.touches import Touches
from pretravel.units import DEGREE, MICROMETRE

AXIAL_PRETRAVEL = 1.0 * MICROMETRE
"""Pretravel along the probe axis that is assumed where nothing better is known. [mm]

Along its axis a probe is stiff: seats, stylus and tip contact of an OMP40-2 give 1.2 um."""
MOST_PRETRAVEL = 0.1
"""A map that rises above this is warned about. [mm]"""
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
        Standard deviation of a touch among repeats of its direction; without
        repeats, of the residuals. [mm]
    repeatability_dof : float
    observed : (n,) float
        Pretravel of each touch about the fitted centre. [mm]
    contact_normals : (n, 3) float
        Machine frame.
    groups : (n,) int
        Which touches repeat each other's direction.
    outliers : tuple of Outlier
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
    warnings: tuple[str, ...]


def qualify(
    touches: Touches,
    diameter: float,
    *,
    kind: Kind = "harmonic",
    ring: bool = False,
    tip_diameter: float | None = None,
    u_diameter: float = 0.0,
    axial_pretravel: float | None = AXIAL_PRETRAVEL,
    axis: npt.ArrayLike = (0.0, 0.0, 1.0),
) -> Qualification:
    """Qualify a probe on a reference sphere or in a ring gauge.

    Every touch says how far the latched point is from the reference's centre:
    |P - c| = R + r - pretravel on a sphere, R - r + pretravel in a ring. A shift
    of the centre looks like a first harmonic of the map, and no touch on a sphere can
    tell the two apart: a convention has to. Across the axis the centre is that of the
    least-squares sphere, which a three-lobed map does not shift. Along the axis, where
    that centre lies 5 to 15 um off (pole and equator give so differently), the map is
    made to have the pretravel `axial_pretravel` at the pole. What the convention
    misses shifts map and centre together and parts as a whole: distances between
    points, and to this reference, are right whatever it is, and stated uncertainties are
    of those.

    Parameters
    ----------
    touches : Touches
        Repeats of a direction are recognised by their normals.
    diameter : float
        Calibrated diameter of the sphere or ring. [mm]
    kind : str
        mean, sectors or harmonic.
    ring : bool
        The reference is a ring, touched inside; its axis is the probe's.
    tip_diameter : float, optional
        [mm]. Not given: only differences of pretravel are known, the map's mean is
        zero and its tip radius the effective one. Compensation is the same.
    u_diameter : float
        Standard uncertainty of the diameter. [mm]
    axial_pretravel : float or None
        Of harmonic maps at the pole, where the sphere was touched there and the tip
        diameter is known. None: the centre is the least-squares sphere's along the
        axis too. [mm]
    axis : (3,) float
        The probe's +z (tip to spindle) in the machine frame.

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
    if kind not in KINDS:
        raise PretravelError(f"map kind '{kind}' is not known; there are {', '.join(KINDS)}")
    rotation = probe_rotation(axis)
    observation = observe(touches, diameter, ring, tip_diameter, rotation)
    repeatability, repeatability_dof = pure_error(observation)
    outliers = repeat_outliers(touches, observation)
    fit: MapFit
    told = axial_pretravel if kind == "harmonic" and tip_diameter is not None else None
    if kind == "harmonic":
        first = fit_harmonic(observation)
        # Once more with the contact normals about the centre that was found.
        found, _, _ = _settle(first, observation, told)
        observation = replace(observation, center=found)
        fit = second = fit_harmonic(observation, first.posterior.amplitudes)
        outliers = outliers or direction_outliers(touches, observation, second)
    else:
        fit = fit_table(observation, kind)
    if repeatability_dof == 0.0:
        repeatability, repeatability_dof = fit.noise, max(fit.dof, 1.0)
    center, coefficients, gauge = _settle(fit, observation, told)
    offset = 0.0
    if tip_diameter is None:
        offset = fit.mean
        constant = slice(None) if kind == "sectors" else slice(0, 1)
        coefficients[constant] -= offset
        gauge += " and to its mean, since no tip diameter was given"
    axes = rotation[:, : observation.axes]
    count = int(observation.groups.max()) + 1
    pretravel_map = PretravelMap(
        basis=fit.basis,
        coefficients=coefficients,
        covariance=fit.covariance,
        support=DirectionSupport(observation.group_directions),
        tip_radius=observation.tip_radius - offset,
        u_tip_radius=0.5 * u_diameter,
        repeatability=repeatability,
        repeatability_dof=repeatability_dof,
        rotation=rotation,
        feed=None if touches.feeds is None else float(np.mean(touches.feeds)),
        provenance={
            "source": f"qualified on a {'ring' if ring else 'sphere'} of {diameter:.9g} mm",
            "touches": f"{len(touches)} in {count} directions"
            + (f", from {touches.source}" if touches.source else ""),
            "gauge": f"pretravel is relative to {gauge}",
        },
    )
    moved = (center - observation.center)[: observation.axes]
    return Qualification(
        pretravel_map=pretravel_map,
        center=frozen(rotation @ center),
        center_covariance=frozen(axes @ fit.shift_covariance @ axes.T),
        effective_radius=observation.tip_radius - fit.mean,
        u_effective_radius=math.hypot(fit.u_mean, 0.5 * u_diameter),
        residuals=frozen(fit.residuals),
        degrees_of_freedom=fit.dof,
        repeatability=repeatability,
        repeatability_dof=repeatability_dof,
        observed=frozen(observation.values + observation.free_design[:, 1:] @ moved - offset),
        contact_normals=frozen(observation.directions @ rotation.T),
        groups=observation.groups,
        outliers=tuple(outliers),
        warnings=tuple(_warnings(pretravel_map, observation, tip_diameter is not None)),
    )


def _settle(
    fit: MapFit, observation: Observation, axial_pretravel: float | None
) -> tuple[FloatArray, FloatArray, str]:
    """Centre (probe frame), coefficients that go with it, and the convention in words."""
    coefficients = fit.coefficients.copy()
    # A centre moved by s adds n·s to the observed pretravel, in a ring as on a sphere.
    center = observation.center.copy()
    center[: observation.axes] -= fit.shift
    gauge = "the reference's least-squares centre"
    if axial_pretravel is None or observation.ring or not isinstance(fit.basis, HarmonicBasis):
        return center, coefficients, gauge
    pole = np.array([[0.0, 0.0, 1.0]])
    if not DirectionSupport(observation.group_directions).supports(pole)[0]:
        return center, coefficients, gauge + " (no touch near the pole tells its height better)"
    axial = (fit.basis.design(pole) @ coefficients).item() - axial_pretravel
    coefficients[(fit.basis.terms == (1, 0)).all(axis=1)] -= axial / math.sqrt(3.0)
    center[2] -= axial
    gauge = (
        f"a centre that makes pretravel {axial_pretravel / MICROMETRE:g} µm along the axis "
        "(assumed: touches on a sphere cannot tell it) and is least-squares across"
    )
    if observation.directions[:, 2].max() < math.cos(MARGIN):
        design = fit.basis.design(pole)
        u_pole = math.sqrt((design @ fit.covariance @ design.T).item())
        gauge += (
            f"; the pole was not touched, its value interpolated (u {u_pole / MICROMETRE:.1f} µm)"
        )
    return center, coefficients, gauge


def supported_uncertainty(pretravel_map: PretravelMap) -> tuple[FloatArray, FloatArray]:
    """Standard uncertainty of a map all over the directions that it supports.

    Parameters
    ----------
    pretravel_map : PretravelMap

    Returns
    -------
    directions : (n, 3) float
        Spread over the support, probe frame, the map's own nodes among them.
    u : (n,) float
        [mm]
    """
    nodes = pretravel_map.support.nodes
    polar = polar_angle(nodes)
    spread = fibonacci_cap(2000, float(polar.max()))
    around = from_angles(polar.max(), np.linspace(0.0, 2.0 * np.pi, 720))
    candidates = np.concatenate([spread, around])
    directions = np.concatenate([nodes, candidates[pretravel_map.support.supports(candidates)]])
    return directions, pretravel_map.standard_uncertainty(directions @ pretravel_map.rotation.T)


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
    directions, _ = supported_uncertainty(pretravel_map)
    normals = directions @ pretravel_map.rotation.T
    value, u = pretravel_map.pretravel_and_uncertainty(normals, extrapolate=True)
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
