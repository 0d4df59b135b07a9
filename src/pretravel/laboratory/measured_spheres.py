"""Centre and diameter of a sphere from compensated points: GUM with a budget."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.base import FloatArray, frozen
from pretravel.maps import PretravelMap
from pretravel.measurement import REPEATABILITY, Points, point_sources
from pretravel.touches import Touches
from pretravel.uncertainty import (
    Budget,
    Component,
    Covariance,
    SphereFit,
    fit_sphere,
)


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
    """Determine centre and diameter of a sphere, with their uncertainties.

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
