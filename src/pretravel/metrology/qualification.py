"""Qualification: touches on a reference sphere or ring in, a map of the probe out."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, IntArray, frozen
from pretravel.direction_support import DirectionSupport
from pretravel.directions import describe, polar_angle, unit
from pretravel.errors import PretravelError
from pretravel.frames import probe_rotation
from pretravel.metrology.fitting import fit_sphere
from pretravel.metrology.harmonic_regression import (
    fit_harmonics,
    ring_terms,
    sphere_terms,
)
from pretravel.pretravel_map import (
    SECTOR_NAMES,
    HarmonicBasis,
    MapBasis,
    MeanBasis,
    PretravelMap,
    SectorBasis,
)
from pretravel.touches import Touches
from pretravel.units import DEGREE, INCH, MICROMETRE

Kind = Literal["mean", "sectors", "harmonic"]
KINDS: tuple[Kind, ...] = ("mean", "sectors", "harmonic")

LARGEST_PRETRAVEL = 0.25
"""A mean pretravel above this says that a diameter is wrong. [mm]

Probes give by 1 to 80 um; a delay at high feed adds some tens."""
SMALLEST_PRETRAVEL = -0.02
"""A mean pretravel below this says the same: no probe triggers before contact. [mm]"""
NORMAL_TOLERANCE = 10.0 * DEGREE
"""How far a given normal may be from that of the fitted sphere or ring. [rad]"""
EQUATORIAL = 60.0 * DEGREE
"""Sector tables are made from touches with at least this polar angle. [rad]"""
AXIAL_PRETRAVEL = 1.0 * MICROMETRE
"""Pretravel along the probe axis that is assumed where nothing better is known. [mm]

Along its axis a probe is stiff: seats, stylus and tip contact of an OMP40-2 give 1.2 um."""
OUTLIER_LEVEL = 0.01
"""Chance of naming any touch an outlier when all are good (Bonferroni)."""

_SAME_DIRECTION = 1e-3


@dataclass(frozen=True)
class Outlier:
    """A touch that does not belong. It was named, not dropped.

    Attributes
    ----------
    row : int
        Of the touches, from 0.
    distance : float
        From the other touches of its direction, or from the map. [mm]
    limit : float
        What repeatability would let pass. [mm]
    message : str
    """

    row: int
    distance: float
    limit: float
    message: str


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


@dataclass(frozen=True, eq=False)
class _Observation:
    """Touches about a centre: what the map is fitted to. All in the probe frame."""

    positions: FloatArray
    groups: IntArray
    center: FloatArray
    reference_radius: float
    tip_radius: float
    ring: bool

    @property
    def axes(self) -> int:
        """How many coordinates of the centre the reference tells: a ring not the axis's."""
        return 2 if self.ring else 3

    @cached_property
    def _offset(self) -> FloatArray:
        return np.asarray((self.positions - self.center)[:, : self.axes])

    @cached_property
    def directions(self) -> FloatArray:
        """Contact normals, (n, 3)."""
        outward = unit(self._offset)
        if self.ring:
            return np.hstack([-outward, np.zeros((len(outward), 1))])
        return outward

    @cached_property
    def values(self) -> FloatArray:
        """Observed pretravel, (n,). [mm]"""
        distance = np.linalg.norm(self._offset, axis=1)
        if self.ring:
            return np.asarray(distance - (self.reference_radius - self.tip_radius))
        return np.asarray(self.reference_radius + self.tip_radius - distance)

    @property
    def free_terms(self) -> IntArray:
        """Harmonics that are the mean, and what a shift of the centre looks like."""
        return np.array([(0, 0), (1, 1), (1, -1), (1, 0)][: self.axes + 1], dtype=np.int64)

    @cached_property
    def free_design(self) -> FloatArray:
        """Columns 1, n_x, n_y (and n_z), (n, axes + 1)."""
        return np.hstack([np.ones((len(self.groups), 1)), self.directions[:, : self.axes]])

    @cached_property
    def to_sphere(self) -> FloatArray:
        """What a least-squares sphere makes of any values: mean, then shift, (axes + 1, n)."""
        return np.asarray(np.linalg.pinv(self.free_design))


@dataclass(frozen=True, eq=False)
class _Fit:
    """A map fitted to an observation, with the shift that the centre needs."""

    basis: MapBasis
    coefficients: FloatArray
    covariance: FloatArray
    mean: float
    u_mean: float
    shift: FloatArray
    shift_covariance: FloatArray
    residuals: FloatArray
    dof: float
    noise: float
    leverage: FloatArray
    amplitudes: FloatArray | None = None


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
    observation = _observe(touches, diameter, ring, tip_diameter, rotation)
    repeatability, repeatability_dof = _pure_error(observation)
    outliers = _repeat_outliers(touches, observation)
    told = axial_pretravel if kind == "harmonic" and tip_diameter is not None else None
    if kind == "harmonic":
        fit = _fit_harmonic(observation)
        # Once more with the contact normals about the centre that was found.
        found, _, _ = _settle(fit, observation, told)
        observation = replace(observation, center=found)
        fit = _fit_harmonic(observation, fit.amplitudes)
        if not outliers:
            outliers = _residual_outliers(touches, observation, fit)
    else:
        fit = _fit_table(observation, kind)
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
        support=DirectionSupport(_group_directions(observation)),
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
    )


def _fit_harmonic(observation: _Observation, amplitudes: FloatArray | None = None) -> _Fit:
    fit = fit_harmonics(
        observation.directions,
        observation.values,
        observation.groups,
        observation.free_terms,
        ring_terms() if observation.ring else sphere_terms(int(observation.groups.max()) + 1),
        amplitudes,
    )
    basis = HarmonicBasis(fit.terms)
    design = basis.design(observation.directions)
    mean_of, shift_of = np.split(observation.to_sphere @ design, [1])
    # What a shift of the centre explains goes from the map to the centre.
    move = np.eye(len(fit.terms))
    move[1 : observation.axes + 1] -= shift_of / math.sqrt(3.0)
    return _Fit(
        basis=basis,
        coefficients=move @ fit.coefficients,
        covariance=move @ fit.covariance @ move.T,
        mean=(mean_of @ fit.coefficients).item(),
        u_mean=math.sqrt((mean_of @ fit.covariance @ mean_of.T).item()),
        shift=shift_of @ fit.coefficients,
        shift_covariance=shift_of @ fit.covariance @ shift_of.T,
        residuals=observation.values - design @ fit.coefficients,
        dof=float(len(observation.values) - np.trace(fit.hat)),
        noise=fit.noise,
        leverage=np.diag(fit.hat),
        amplitudes=fit.amplitudes,
    )


def _fit_table(observation: _Observation, kind: Kind) -> _Fit:
    """Kinds mean and sectors: a least-squares sphere, then averages about its centre."""
    free, to_sphere = observation.free_design, observation.to_sphere
    solution = to_sphere @ observation.values
    centred = observation.values - free[:, 1:] @ solution[1:]
    basis: MapBasis = MeanBasis() if kind == "mean" else SectorBasis()
    coefficients = solution[:1] if kind == "mean" else _sector_values(observation, centred)
    residuals = centred - basis.design(observation.directions) @ coefficients
    dof = float(max(len(centred) - observation.axes - basis.size, 1))
    # One number for many directions misses most of them: what the kind leaves is its
    # uncertainty in any one direction.
    variance = float(np.sum(residuals**2)) / dof
    sphere_dof = max(len(centred) - free.shape[1], 1)
    sphere_variance = float(np.sum((centred - solution[0]) ** 2)) / sphere_dof
    sphere_covariance = to_sphere @ to_sphere.T * sphere_variance
    return _Fit(
        basis=basis,
        coefficients=coefficients,
        covariance=np.full(basis.size, variance),
        mean=float(solution[0]),
        u_mean=math.sqrt(float(sphere_covariance[0, 0])),
        shift=solution[1:],
        shift_covariance=sphere_covariance[1:, 1:],
        residuals=residuals,
        dof=dof,
        noise=math.sqrt(variance),
        leverage=np.diag(free @ to_sphere),
    )


def _settle(
    fit: _Fit, observation: _Observation, axial_pretravel: float | None
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
    if not DirectionSupport(_group_directions(observation)).supports(pole)[0]:
        return center, coefficients, gauge + " (no touch near the pole tells its height better)"
    axial = (fit.basis.design(pole) @ coefficients).item() - axial_pretravel
    coefficients[(fit.basis.terms == (1, 0)).all(axis=1)] -= axial / math.sqrt(3.0)
    center[2] -= axial
    gauge = (
        f"a centre that makes pretravel {axial_pretravel / MICROMETRE:g} µm along the axis "
        "(assumed: touches on a sphere cannot tell it) and is least-squares across"
    )
    return center, coefficients, gauge


def _observe(
    touches: Touches,
    diameter: float,
    ring: bool,
    tip_diameter: float | None,
    rotation: FloatArray,
) -> _Observation:
    what = "ring" if ring else "sphere"
    for name, value in ((f"the {what}'s diameter", diameter), ("the tip diameter", tip_diameter)):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise PretravelError(f"{name} is {value:g} mm; it must be positive")
    source = f"{touches.source}: " if touches.source else ""
    groups = _repeats(touches.normals)
    directions = int(groups.max()) + 1
    least = 4 if ring else 5
    if directions < least:
        raise PretravelError(
            f"{source}{len(touches)} touches in {directions} "
            f"direction{'s' if directions > 1 else ''} are too few: a {what} needs "
            f"touches in at least {least} directions"
            + ("" if ring else ", one of them far from the plane of the others")
        )
    in_probe = touches.positions @ rotation
    if not ring:
        _refuse_plane(touches, source)
    try:
        fit = fit_sphere(in_probe[:, :2] if ring else in_probe)
    except PretravelError as error:
        raise PretravelError(f"{source}{error}") from None
    observation = _Observation(
        positions=in_probe,
        groups=groups,
        center=np.append(fit.center, in_probe[:, 2].mean()) if ring else np.array(fit.center),
        reference_radius=0.5 * diameter,
        tip_radius=_checked_tip_radius(fit.radius, 0.5 * diameter, tip_diameter, ring, source),
        ring=ring,
    )
    _check_normals(touches, observation.directions @ rotation.T, what, source)
    return observation


def _repeats(normals: FloatArray) -> IntArray:
    """Number the directions in order of appearance; touches of one direction share it."""
    _, first, inverse = np.unique(
        np.round(normals / _SAME_DIRECTION).astype(np.int64),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.asarray(rank[inverse.ravel()], dtype=np.int64)


def _group_directions(observation: _Observation) -> FloatArray:
    count = int(observation.groups.max()) + 1
    total = np.zeros((count, 3))
    np.add.at(total, observation.groups, observation.directions)
    return unit(total)


def _refuse_plane(touches: Touches, source: str) -> None:
    spread = np.linalg.svd(touches.normals - touches.normals.mean(axis=0), full_matrices=True)
    if spread[1][-1] <= 0.02 * spread[1][0]:
        across = spread[2][-1]
        raise PretravelError(
            f"{source}all touches lie in one plane (normal to {_axis_name(across)}): the sphere's "
            "centre cannot be found across it. Touch the sphere also away from that plane, at "
            "least at the pole; for a ring gauge say --ring"
        )


def _axis_name(vector: FloatArray) -> str:
    index = int(np.argmax(np.abs(vector)))
    if abs(vector[index]) > 0.999:
        return "XYZ"[index]
    return "(" + ", ".join(f"{v:.3f}" for v in vector) + ")"


def _checked_tip_radius(
    fitted_radius: float,
    reference_radius: float,
    tip_diameter: float | None,
    ring: bool,
    source: str,
) -> float:
    """The tip radius, once fitted radius and diameters were seen to fit together."""
    what = "ring" if ring else "sphere"
    sign = -1.0 if ring else 1.0
    tip = 0.5 * tip_diameter if tip_diameter is not None else None
    expected = reference_radius + sign * (tip if tip is not None else 0.0)
    for factor, story in (
        (1.0 / INCH, "the coordinates look like inches; convert them to mm"),
        (INCH, "the diameters look like inches; give them in mm"),
    ):
        if abs(fitted_radius / (expected * factor) - 1.0) < (0.02 if tip is not None else 0.0):
            raise PretravelError(
                f"{source}the touches lie on a {what} of diameter {2 * fitted_radius:.4f}, but "
                f"{2 * expected:.4f} mm was expected, {INCH:g} times "
                f"{'as much' if factor < 1.0 else 'less'}: {story}"
            )
    implied = sign * (fitted_radius - reference_radius)
    if tip is None:
        if not 0.05 <= implied <= 0.6 * reference_radius:
            hint = (
                " The coordinates may be inches." if fitted_radius < reference_radius / 10.0 else ""
            )
            raise PretravelError(
                f"{source}the touches lie on a {what} of diameter {2 * fitted_radius:.4f} mm; with "
                f"the calibrated diameter of {2 * reference_radius:.4f} mm that would mean a tip "
                f"of {2 * implied:.4f} mm diameter. Check --diameter (a diameter, not a radius, "
                "in mm), and that the positions are those of the tip centre, not of the surface; "
                f"or give --tip-diameter.{hint}"
            )
        return implied
    pretravel = sign * (expected - fitted_radius)
    if not SMALLEST_PRETRAVEL <= pretravel <= LARGEST_PRETRAVEL:
        if abs(implied) < 0.1:
            advice = (
                "the positions look like surface points, already compensated by the tip radius; "
                "tip-centre positions are needed"
            )
        elif abs(implied - 2.0 * tip) < 0.1:
            advice = "was the tip's radius given as its diameter?"
        elif abs(fitted_radius - sign * tip - 2.0 * reference_radius) < 0.1:
            advice = f"was the {what}'s radius given as its diameter?"
        else:
            advice = (
                f"check --diameter ({2 * reference_radius:.4f}) and --tip-diameter "
                f"({2 * tip:.4f}): with this tip the {what} would measure "
                f"{2 * (fitted_radius - sign * tip):.4f} mm"
            )
        raise PretravelError(
            f"{source}the touches lie on a {what} of diameter {2 * fitted_radius:.4f} mm, which "
            f"means a mean pretravel of {pretravel / MICROMETRE:.1f} µm; probes give by 1 to 80, "
            f"and {SMALLEST_PRETRAVEL / MICROMETRE:.0f} to {LARGEST_PRETRAVEL / MICROMETRE:.0f} µm "
            f"is accepted: {advice}"
        )
    return tip


def _check_normals(touches: Touches, contact: FloatArray, what: str, source: str) -> None:
    cosine = np.sum(touches.normals * contact, axis=1)
    if np.mean(cosine) < 0.0:
        raise PretravelError(
            f"{source}the normals point the wrong way: they must point out of the {what}'s "
            "material, towards the tip"
            + (" (in a ring: towards its axis)" if what == "ring" else "")
            + ". Change the sign of nx, ny, nz"
            + ("" if what == "ring" else ", or say --ring if this is a ring gauge")
        )
    bad = np.flatnonzero(cosine < math.cos(NORMAL_TOLERANCE))
    if len(bad):
        row = int(bad[0])
        raise PretravelError(
            f"{source}{touches.where(row)}: its normal ({describe(touches.normals[row])}) is "
            f"{math.degrees(math.acos(min(max(cosine[row], -1.0), 1.0))):.0f}° away from where the "
            f"touch lies on the fitted {what} ({describe(contact[row])}); "
            f"{len(bad)} of {len(touches)} touches are more than "
            f"{NORMAL_TOLERANCE / DEGREE:.0f}° off"
        )


def _pure_error(observation: _Observation) -> tuple[float, float]:
    """Pooled standard deviation among repeats, and its degrees of freedom (0: no repeats)."""
    count = np.bincount(observation.groups).astype(np.float64)
    dof = float(len(observation.values) - len(count))
    if dof == 0.0:
        return 0.0, 0.0
    mean = np.bincount(observation.groups, observation.values) / count
    scatter = float(np.sum((observation.values - mean[observation.groups]) ** 2))
    return math.sqrt(scatter / dof), dof


def _sector_values(observation: _Observation, centred: FloatArray) -> FloatArray:
    """Each sector's mean over the touches near the equator that fall into it."""
    near = polar_angle(observation.directions) >= EQUATORIAL - 1e-6
    share = SectorBasis().design(observation.directions[near])
    weight = share.sum(axis=0)
    if np.any(weight == 0.0):
        empty = ", ".join(
            f"{name}{'°' if name.isdigit() else ''}"
            for name, w in zip(SECTOR_NAMES, weight, strict=True)
            if w == 0.0
        )
        raise PretravelError(
            f"no touch near the equator (polar 60° or more) falls into sector {empty}: a sector "
            "table needs touches at every 30° of azimuth; use kind mean or harmonic, which do not"
        )
    return np.asarray(share.T @ centred[near] / weight)


def _outlier_factor(count: int) -> float:
    from scipy.stats import norm

    # 1.2 for scales that are themselves estimated from the data.
    return 1.2 * float(norm.isf(OUTLIER_LEVEL / (2.0 * count)))


def _repeat_outliers(touches: Touches, observation: _Observation) -> list[Outlier]:
    """Touches far from the median of three or more of one direction."""
    from scipy.stats import chi2

    values, groups = observation.values, observation.groups
    count = np.bincount(groups)
    big = np.flatnonzero(count >= 3)
    if len(big) < 3:
        return []
    medians = np.array([np.median(values[groups == g]) for g in big])
    variances = np.array([np.var(values[groups == g], ddof=1) for g in big])
    # The median over directions is not moved by a few bad touches.
    unbias = np.median(chi2.ppf(0.5, count[big] - 1) / (count[big] - 1))
    limit = _outlier_factor(len(values)) * math.sqrt(float(np.median(variances) / unbias))
    limit = max(limit, 1e-9)
    found = []
    for group, median in zip(big, medians, strict=True):
        for row in np.flatnonzero(groups == group):
            distance = float(values[row] - median)
            if abs(distance) > limit:
                found.append(
                    Outlier(
                        int(row),
                        distance,
                        limit,
                        f"{touches.where(int(row))} at {describe(observation.directions[row])} "
                        f"lies {distance / MICROMETRE:+.1f} µm from the median of the "
                        f"{count[group]} touches of its direction; repeatability lets "
                        f"{limit / MICROMETRE:.1f} µm pass. It was kept: remove the line and "
                        "qualify again if it is wrong",
                    )
                )
    return found


def _residual_outliers(touches: Touches, observation: _Observation, fit: _Fit) -> list[Outlier]:
    """Touches far from the fitted map, by their studentised residuals."""
    studentised = fit.residuals / np.sqrt(np.clip(1.0 - fit.leverage, 1e-3, 1.0))
    scale = 1.4826 * float(np.median(np.abs(studentised)))
    limit = max(_outlier_factor(len(studentised)) * scale, 1e-9)
    return [
        Outlier(
            int(row),
            float(studentised[row]),
            limit,
            f"{touches.where(int(row))} at {describe(observation.directions[row])} lies "
            f"{studentised[row] / MICROMETRE:+.1f} µm from what the other directions say; "
            f"{limit / MICROMETRE:.1f} µm would pass. It was kept: remove the line and qualify "
            "again if it is wrong",
        )
        for row in np.flatnonzero(np.abs(studentised) > limit)
    ]
