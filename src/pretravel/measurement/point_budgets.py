"""Uncertainty budgets of compensated points, of one point or of all of them on average."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pretravel.base import FloatArray
from pretravel.measurement.point_errors import (
    FRICTION_OF_PART,
    MACHINE_GEOMETRY,
    REPEATABILITY,
    PointErrors,
)
from pretravel.measurement.points import FIXED_SCATTER
from pretravel.measurement.touch_scatter import MACHINE_PART, PROBE_PART
from pretravel.uncertainty import Budget, Component


def variances_along_normals(errors: PointErrors) -> dict[str, FloatArray]:
    """The variance of each point along its normal, source by source.

    Parameters
    ----------
    errors : PointErrors

    Returns
    -------
    dict of str to (n,) float
        Their sum is the square of `Points.standard_uncertainty`. A source that the map does not
        state is zero. [mm²]
    """
    made, closing = errors.pretravel_map, errors.closing
    machine = np.sum(errors.machine_along_normals**2, axis=1)
    rubbed = errors.by_friction
    return {
        **{name: own * closing**2 for name, own in errors.of_touches.items()},
        FIXED_SCATTER: (made.fixed_scatter * closing) ** 2,
        "map": errors.of_map,
        "tip radius": np.full(len(closing), made.u_tip_radius**2),
        "signal delay": (errors.delay_along_approach * closing) ** 2,
        **({FRICTION_OF_PART: (rubbed * closing) ** 2} if rubbed.any() else {}),
        **({MACHINE_GEOMETRY: machine} if errors.by_machine.size else {}),
    }


def point_budget(errors: PointErrors, row: int | None = None) -> Budget:
    """The budget of a compensated point along its normal.

    Parameters
    ----------
    errors : PointErrors
        From `errors_of_points`.
    row : int, optional
        Of the point; not given: the root mean square over all points, in which the shares of the
        sources are those of their mean variances.

    Returns
    -------
    Budget
        In mm, without sources that are zero at all these points.

    >>> from pretravel.measurement.point_errors import errors_of_points
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.maps.pretravel_map import PretravelMap
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.touches import Touches
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up = [[0.0, 0.0, 1.0]]
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([9e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0, repeatability=4e-4)
    >>> touches = Touches([[0.0, 0.0, 2.990]], up)
    >>> budget = point_budget(errors_of_points(touches, touches.normals, mean))
    >>> round(budget.combined * 1e3, 9), [component.name for component in budget.components]
    (0.5, ['repeatability', 'map'])
    """
    rows = slice(None) if row is None else slice(row, row + 1)
    variances = {
        name: float(np.mean(variance[rows]))
        for name, variance in variances_along_normals(errors).items()
    }
    which = f"rms of {len(errors.closing)} points" if row is None else f"point {row + 1}"
    return budget_of_variances(variances, errors.pretravel_map.repeatability_dof, which)


def budget_of_variances(variances: Mapping[str, float], dof: float, which: str) -> Budget:
    """The budget of points from the mean variance by each source.

    Parameters
    ----------
    variances : mapping of str to float
        [mm²]
    dof : float
        Degrees of freedom of the repeatability; 0 where they are not known.
    which : str
        The points, for the title.

    Returns
    -------
    Budget
        In mm, without sources that are zero.

    >>> budget_of_variances({"repeatability": 1.6e-7, "map": 9e-8}, 24.0, "point 1").combined
    0.0005
    """
    components = tuple(
        Component(
            name,
            "A" if name in (REPEATABILITY, MACHINE_PART, PROBE_PART) else "B",
            math.sqrt(variance),
            dof=dof if name == REPEATABILITY and dof > 0.0 else math.inf,
        )
        for name, variance in variances.items()
        if variance > 0.0
    )
    return Budget(components, f"a point along its normal, {which}")
