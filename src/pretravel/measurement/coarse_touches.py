"""Touches on a part in coarse steps: what the map's scatter does not contain."""

from __future__ import annotations

from dataclasses import replace

from pretravel.maps import PretravelMap
from pretravel.touches import Touches, coarse_warnings, step_of_measured


def with_step_of_touches(
    pretravel_map: PretravelMap, touches: Touches
) -> tuple[PretravelMap, tuple[str, ...]]:
    """A map for these touches: its scatter is at least that of the step of their positions.

    Parameters
    ----------
    pretravel_map : PretravelMap
    touches : Touches
        As the machine reported them: in the frame of a turned part, no step is seen.

    Returns
    -------
    PretravelMap
        A step q has the variance q²/12, which points can have in common: a bore at a round place
        has touches that are rounded alike. A map of touches in the same steps contains it.
    tuple of str
        What to know of a coarse step.

    >>> import numpy as np
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> up, rng = np.tile([0.0, 0.0, 1.0], (20, 1)), np.random.default_rng(1)
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(up), tip_radius=3.0, repeatability=3e-4)
    >>> touches = Touches(0.01 * np.round(rng.normal(3.0, 0.02, (20, 3)) / 0.01), up)
    >>> found, said = with_step_of_touches(mean, touches)
    >>> round(1e3 * float(np.hypot(found.fixed_scatter, found.repeatability)), 3), len(said)
    (2.887, 1)
    """
    step = step_of_measured(touches.positions, touches.normals)
    known = pretravel_map.repeatability**2 + pretravel_map.fixed_scatter**2
    missing = step**2 / 12.0 - known
    if missing > 0.0:
        fixed = (pretravel_map.fixed_scatter**2 + missing) ** 0.5
        pretravel_map = replace(pretravel_map, fixed_scatter=fixed)
    return pretravel_map, tuple(coarse_warnings(step))
