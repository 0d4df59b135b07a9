"""Uncertainty of maps, points and spheres: GUM with a budget, and Monte Carlo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray, frozen
from pretravel.compensation.compensation import Points, point_sources
from pretravel.errors import PretravelError
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.fitting.sphere import SphereFit, fit_sphere
from pretravel.uncertainty.gum import Budget, Component, Propagated
from pretravel.uncertainty.monte_carlo import (
    MonteCarlo,
    Validation,
    joint_normal,
    monte_carlo,
    validate,
)
from pretravel.units import delay_travel

_CHUNK = 200


@dataclass(frozen=True, eq=False)
class MeasuredSphere:
    """A sphere measured with compensated touches.

    Attributes
    ----------
    fit : SphereFit
    covariance : (4, 4) float
        Of centre and radius, errors common to many points included. [mm²]
    budget : Budget
        Of the diameter, by source. [mm]
    """

    fit: SphereFit
    covariance: FloatArray
    budget: Budget

    @property
    def diameter(self) -> float:
        """[mm]"""
        return 2.0 * self.fit.radius

    @property
    def center(self) -> FloatArray:
        """[mm]"""
        return self.fit.center


def measured_sphere(
    touches: Touches, points: Points, pretravel_map: PretravelMap
) -> MeasuredSphere:
    """Centre and diameter of a sphere, with their uncertainties.

    Parameters
    ----------
    touches : Touches
    points : Points
        The same touches compensated with the map.
    pretravel_map : PretravelMap

    Returns
    -------
    MeasuredSphere

    Notes
    -----
    Map, tip radius and delay err alike in many points, which no number of points averages
    away; repeatability alone does so.

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.directions import sphere_pattern_25
    >>> from pretravel.maps.bases import MeanBasis
    >>> from pretravel.compensation.compensation import apply
    >>> n = sphere_pattern_25()
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), np.array([1e-8]),
    ...                     DirectionSupport(n), tip_radius=3.0, repeatability=3e-4)
    >>> touches = Touches(n * (12.5 + 2.990), n)
    >>> ball = measured_sphere(touches, apply(touches, mean), mean)
    >>> round(ball.diameter, 9), round(ball.budget.combined * 1e3, 3)
    (25.0, 0.28)
    """
    fit = fit_sphere(points.positions)
    sources = point_sources(touches, points, pretravel_map)
    parts = {
        name: fit.covariance(
            points.positions,
            Covariance.independent(along) if along.ndim == 1 else Covariance.full(along),
        )
        for name, along in sources.items()
    }
    components = tuple(
        Component(
            name,
            "A" if name == REPEATABILITY else "B",
            float(np.sqrt(max(part[3, 3], 0.0))),
            2.0,
            pretravel_map.repeatability_dof if name == REPEATABILITY else np.inf,
        )
        for name, part in parts.items()
    )
    return MeasuredSphere(fit, frozen(sum(parts.values())), Budget(components))


REPEATABILITY = "repeatability"


def sphere_by_trials(
    measured: MeasuredSphere,
    touches: Touches,
    points: Points,
    pretravel_map: PretravelMap,
    *,
    probability: float = 0.95,
    digits: int = 1,
    most_trials: int = 100_000,
    seed: int | None = 1,
) -> tuple[MonteCarlo, Validation]:
    """The diameter's distribution by trials, and whether the GUM's interval stands.

    Parameters
    ----------
    measured : MeasuredSphere
    touches, points, pretravel_map
        As for `measured_sphere`.
    probability, digits, most_trials, seed
        As for `monte_carlo`.

    Returns
    -------
    MonteCarlo
        Of the diameter. [mm]
    Validation
    """
    along = total_covariance(point_sources(touches, points, pretravel_map))
    values, vectors = np.linalg.eigh(along)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    count = len(points)

    def draw(generator: np.random.Generator, trials: int) -> FloatArray:
        return np.asarray(generator.standard_normal((trials, count)) @ root.T)

    def diameters(moved: FloatArray) -> FloatArray:
        # Every trial's sphere is fitted anew, Gauss-Newton for all trials at once.
        p = points.positions[None] + moved[:, :, None] * points.normals[None]
        return 2.0 * _sphere_radii(p, measured.fit)

    trials = monte_carlo(
        diameters,
        draw,
        probability=probability,
        digits=digits,
        share=0.2,
        most_trials=most_trials,
        seed=seed,
    )
    value = np.array([measured.diameter])
    u = measured.budget.combined
    gum = Propagated(
        value=value,
        covariance=np.array([[u**2]]),
        jacobian=np.ones((1, 1)),
        effective_dof=np.array([np.inf]),
        budgets=(measured.budget,),
    )
    return trials, validate(gum, trials, digits)


def _sphere_radii(p: FloatArray, start: SphereFit) -> FloatArray:
    """Radii of least-squares spheres through (t, n, 3) points near a fitted one, (t,)."""
    radii = np.empty(len(p))
    for first in range(0, len(p), _CHUNK * 10):
        part = p[first : first + _CHUNK * 10]
        center = np.repeat(start.center[None], len(part), axis=0)
        radius = np.full(len(part), start.radius)
        for _ in range(4):  # errors of micrometres: the third step moves below 1e-12 mm
            offset = part - center[:, None]
            distance = np.linalg.norm(offset, axis=2)
            jacobian = np.concatenate(
                [offset / distance[..., None], np.ones((*distance.shape, 1))], axis=2
            )
            normal = np.einsum("tni,tnj->tij", jacobian, jacobian)
            right = np.einsum("tni,tn->ti", jacobian, distance - radius[:, None])
            step = np.linalg.solve(normal, right[..., None])[..., 0]
            center, radius = center + step[:, :3], radius + step[:, 3]
        radii[first : first + len(part)] = radius
    return radii


def total_covariance(sources: Mapping[str, FloatArray]) -> FloatArray:
    """All sources together, (n, n), from variances (n,) and covariances (n, n). [mm²]"""
    return np.asarray(sum(np.diag(part) if part.ndim == 1 else part for part in sources.values()))


def map_by_trials(
    pretravel_map: PretravelMap,
    normals: npt.ArrayLike,
    *,
    trials: int = 10_000,
    seed: int | None = 1,
) -> FloatArray:
    """Trials of a map's values, errors that directions share in common.

    Parameters
    ----------
    pretravel_map : PretravelMap
    normals : (n, 3) float
        Machine frame.
    trials : int
    seed : int or None

    Returns
    -------
    (trials, n) float
        Their deviation is `PretravelMap.standard_uncertainty`. [mm]

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.bases import MeanBasis
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), np.array([1e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0)
    >>> bool(abs(map_by_trials(mean, up).std() / 1e-4 - 1.0) < 0.03)
    True
    """
    if trials < 2:
        raise PretravelError(f"{trials} trials say nothing of a distribution")
    generator = np.random.default_rng(seed)
    design = pretravel_map.basis.design(pretravel_map.probe_directions(normals))
    if pretravel_map.covariance.ndim == 1:
        # Errors that neighbours share wholly: one draw for all.
        moved = generator.standard_normal((trials, 1)) * (
            design @ np.sqrt(pretravel_map.covariance)
        )
    else:
        draw = joint_normal(np.zeros(design.shape[1]), Covariance.full(pretravel_map.covariance))
        moved = draw(generator, trials) @ design.T
    by_delay = pretravel_map.change_by_delay(normals)
    moved = moved + generator.standard_normal((trials, 1)) * by_delay
    return np.asarray(design @ pretravel_map.coefficients + moved)


def points_by_trials(
    touches: Touches,
    points: Points,
    pretravel_map: PretravelMap,
    *,
    trials: int = 10_000,
    seed: int | None = 1,
) -> FloatArray:
    """Trials of compensated points: repeatability, map, tip radius and delay drawn anew.

    For results of your own: put every trial through your evaluation. Each trial has one map,
    one tip radius and one delay for all points.

    Parameters
    ----------
    touches : Touches
    points : Points
        The same touches, compensated with the map.
    pretravel_map : PretravelMap
    trials : int
    seed : int or None

    Returns
    -------
    (trials, n, 3) float
        [mm]

    References
    ----------
    JCGM 102, section 7: several outputs, drawn together.
    """
    generator = np.random.default_rng(seed)
    approaches = touches.approach_directions
    closing = -np.sum(approaches * points.normals, axis=1)
    values = map_by_trials(
        replace(pretravel_map, delay_effect=None),
        points.normals,
        trials=trials,
        seed=int(generator.integers(2**31)),
    )
    # Back along the approach by more or less, in mm of travel.
    travel = (values - points.pretravel) / closing
    travel += pretravel_map.repeatability * generator.standard_normal(values.shape)
    if pretravel_map.delay is not None:
        own = delay_travel(np.asarray(touches.feeds), pretravel_map.u_delay)
        own = own + pretravel_map.change_by_delay(points.normals) / closing
        travel += generator.standard_normal((trials, 1)) * own
    radius = pretravel_map.u_tip_radius * generator.standard_normal((trials, 1, 1))
    return np.asarray(points.positions - travel[..., None] * approaches - radius * points.normals)
