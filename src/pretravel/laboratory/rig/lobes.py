"""The scatter of a rig's touches without repeats: what three equal lobes leave of them."""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray

_LOBES = 3
_ORDERS = (1, 2)
"""Of what is not alike in the three lobes: offset of the probe's axis from the rig's, its tilt."""
_FEWEST_DOF = 4
_LARGEST_CONDITION = 10.0


def scatter_about_lobes(values: FloatArray, azimuths: FloatArray) -> tuple[float, int]:
    """Sum of squares that three equal lobes of any form leave, and its degrees of freedom.

    Parameters
    ----------
    values : (n,) float
        Pretravel in n directions. [mm]
    azimuths : (n,) float
        [rad]

    Returns
    -------
    squares : float
        [mm²]
    dof : int
        Zero where the directions do not determine the lobes, or an azimuth is not known.

    Notes
    -----
    Fitted are harmonics of the orders 1 and 2, and all multiples of three up to half of the number
    of directions. On equally spaced directions, their number a multiple of three, these are the
    lobes of any form, kinks included. Lobes that differ from each other are in what is left: the
    scatter is then too large.

    >>> around = np.radians(np.arange(0.0, 360.0, 15.0))
    >>> lobes = 1.0 / np.cos((around + np.pi / 3.0) % (2.0 * np.pi / 3.0) - np.pi / 3.0)
    >>> squares, dof = scatter_about_lobes(lobes, around)
    >>> round(squares, 12), dof
    (0.0, 12)
    """
    count = len(values)
    if not np.all(np.isfinite(azimuths)):
        return 0.0, 0
    orders = np.array([*_ORDERS, *range(_LOBES, count // 2 + 1, _LOBES)])
    angles = np.multiply.outer(azimuths, orders)
    design = np.concatenate([np.ones((count, 1)), np.cos(angles), np.sin(angles)], axis=1)
    vectors, sizes, _ = np.linalg.svd(design, full_matrices=False)
    # The sine of half as many periods as directions is zero at each of equally spaced ones.
    known = sizes > 1e-9 * sizes[0]
    dof = count - int(np.sum(known))
    if dof < _FEWEST_DOF or sizes[0] > _LARGEST_CONDITION * sizes[known][-1]:
        return 0.0, 0
    fitted = vectors[:, known]
    left = values - fitted @ (fitted.T @ values)
    return float(left @ left), dof
