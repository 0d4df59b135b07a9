"""Centre and diameter of a sphere from compensated points: GUM with a budget, and Monte Carlo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base.arrays import FloatArray, frozen
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.point_errors import (
    REPEATABILITY,
    point_sources,
    total_covariance,
)
from pretravel.measurement.points import Points
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from pretravel.uncertainty.fitting.sphere import SphereFit, fit_sphere
from pretravel.uncertainty.gum import Budget, Component, Propagated
from pretravel.uncertainty.monte_carlo import MonteCarlo, Validation, monte_carlo, validate

_CHUNK = 200


@dataclass(frozen=True, eq=False)
class MeasuredSphere:
    """A sphere measured with compensated touches.

    Attributes
    ----------
    fit : SphereFit
    covariance : (4, 4) float
        Of centre and radius, with the errors that are common to many points. [mm²]
    budget : Budget
        Of the diameter, by source. [mm]
    points : Points
        That were fitted.
    sources : mapping of str to Covariance
        Of these points along their normals, source by source. [mm²]
    """

    fit: SphereFit
    covariance: FloatArray
    budget: Budget
    points: Points
    sources: Mapping[str, Covariance]

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
    Errors of map, tip radius and delay are common to many points, so that no number of points
    averages them out; only repeatability is averaged out.

    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.base.directions import sphere_pattern_25
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> from pretravel.measurement.compensation import apply
    >>> n = sphere_pattern_25()
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(n), tip_radius=3.0, repeatability=3e-4)
    >>> touches = Touches(n * (12.5 + 2.990), n)
    >>> ball = measured_sphere(touches, apply(touches, mean), mean)
    >>> round(ball.diameter, 9), round(ball.budget.combined * 1e3, 3)
    (25.0, 0.28)
    """
    fit = fit_sphere(points.positions)
    sources = point_sources(touches, points, pretravel_map)
    parts = {name: fit.covariance(points.positions, along) for name, along in sources.items()}
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
    return MeasuredSphere(
        fit,
        frozen(sum(parts.values())),
        Budget(components, "diameter of the sphere, compensated"),
        points,
        sources,
    )


def sphere_by_trials(
    measured: MeasuredSphere,
    *,
    probability: float = 0.95,
    digits: int = 1,
    most_trials: int = 100_000,
    seed: int | None = 1,
) -> tuple[MonteCarlo, Validation]:
    """The distribution of the diameter by trials, and whether it confirms the GUM's interval.

    Parameters
    ----------
    measured : MeasuredSphere
    probability, digits, most_trials, seed
        As for `monte_carlo`.

    Returns
    -------
    MonteCarlo
        Of the diameter. [mm]
    Validation
    """
    along_normals = total_covariance(measured.sources)

    def draw(generator: np.random.Generator, trials: int) -> FloatArray:
        return along_normals.errors(generator, trials)

    def diameters(moved: FloatArray) -> FloatArray:
        # The sphere of every trial is fitted, by Gauss-Newton for all trials at once.
        points = measured.points
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
