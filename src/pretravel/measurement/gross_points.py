"""Points far from the nominal and from their neighbours: a wrong digit, dirt, a false trigger."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pretravel.base import FEW_PLACES, MICROMETRE, FloatArray, IntArray
from pretravel.uncertainty import outlier_factor

FEWEST_TO_COMPARE = 5
"""Of fewer points none is far from the others: which one is wrong is unknown."""
MOST_GROSS = 0.2
"""Share of the points above which it is not single points that are wrong."""
_NEIGHBOURS = 8
_BEYOND_NEIGHBOURS = 4.0
"""Distance from the neighbours over their own range: surfaces of a part are of different quality.
Of 500 parts with 60 points, one side of six with 20 times the roughness of the others, two had a
good point that was named."""
_ALONE = 0.5
"""Distance from the nearest value of a neighbour, over that from the middle of all points."""
_FOR_A_MOVEMENT = 24
"""With fewer points a movement of the part, six numbers, takes up the error of a single point."""
_MOVED = 2.0
"""A movement counts where it makes the scatter this much smaller."""
_FITTED = 20_000
_ROUNDS = 20
_MAD = 1.4826
"""Standard deviation over the median absolute deviation, of a normal distribution."""
_SHOWN = 5


@dataclass(frozen=True)
class GrossPoint:
    """A point that is far from the nominal and from its neighbours.

    Attributes
    ----------
    name : str
        Of its touch.
    deviation : float
        From the nominal, along the normal. [mm]
    neighbours : float
        Median deviation of its neighbours. [mm]
    """

    name: str
    deviation: float
    neighbours: float


def gross_points(
    positions: FloatArray,
    normals: FloatArray,
    deviation: FloatArray,
    u: FloatArray,
    where: Callable[[int], str],
) -> tuple[GrossPoint, ...]:
    """Points far from the nominal, compared with all others and with their neighbours.

    Parameters
    ----------
    positions, normals : (n, 3) float
        [mm]
    deviation : (n,) float
        From the nominal, along the normals. [mm]
    u : (n,) float
        Standard uncertainty of the points along the normals. [mm]
    where : callable
        The name of a touch in messages, from its row: `Touches.where`.

    Returns
    -------
    tuple of GrossPoint
        Empty where they would be more than a fifth: the part, the nominal or its place is another.

    Notes
    -----
    The shift and turn of a part that lies elsewhere are subtracted first (least absolute
    deviations). A side of the part that lies off its nominal is none of this: its points have
    neighbours with the same deviation.

    >>> up, places = np.tile([0.0, 0.0, 1.0], (9, 1)), np.random.default_rng(1).random((9, 3))
    >>> off = np.where(np.arange(9) == 3, 0.146, 0.0)
    >>> [point.name for point in gross_points(places, up, off, np.full(9, 5e-4), str)]
    ['3']
    """
    count = len(deviation)
    if count < FEWEST_TO_COMPARE:
        return ()
    left, scatter = _left(positions, normals, deviation)
    scale = np.hypot(scatter, u)
    limit = outlier_factor(count) * scale
    suspects = np.flatnonzero(np.abs(left) > limit)
    if len(suspects) == 0 or len(suspects) > MOST_GROSS * count:
        return ()
    beside = _neighbours(positions, normals, suspects)
    own = left[suspects]
    middle = np.median(left[beside], axis=1)
    wide = _BEYOND_NEIGHBOURS * _range_without_the_farthest(left[beside], middle)
    alone = np.abs(left[beside] - own[:, None]).min(axis=1) > _ALONE * np.abs(own)
    apart = np.abs(own - middle) > np.maximum(limit[suspects], wide)
    named = np.flatnonzero(alone & apart)
    return tuple(
        GrossPoint(
            where(int(suspects[k])),
            float(deviation[suspects[k]]),
            float(np.median(deviation[beside[k]])),
        )
        for k in named
    )


def gross_points_sentence(points: tuple[GrossPoint, ...]) -> str:
    """What to know of them, as a warning; empty where there are none.

    >>> print(gross_points_sentence((GrossPoint("touch 3", 0.146, 0.0012),)))
    touch 3 lies +146.0 µm off the nominal, its neighbours about +1.2 µm: a wrong digit, dirt or \
a false trigger? It is among the points: touch there again, or leave it out
    """
    if not points:
        return ""
    names = [
        f"{point.name} lies {point.deviation / MICROMETRE:+.1f} µm off the nominal, its "
        f"neighbours about {point.neighbours / MICROMETRE:+.1f} µm"
        for point in points[:_SHOWN]
    ]
    more = f"; {len(points) - _SHOWN} more" if len(points) > _SHOWN else ""
    it, are = ("it", "It is") if len(points) == 1 else ("them", "They are")
    return (
        f"{'; '.join(names)}{more}: a wrong digit, dirt or a false trigger? {are} among the "
        f"points: touch there again, or leave {it} out"
    )


def _left(
    positions: FloatArray, normals: FloatArray, deviation: FloatArray
) -> tuple[FloatArray, float]:
    """Deviations less what most of the points have in common (n,), and their robust scatter."""
    left = deviation - np.median(deviation)
    scatter = _MAD * float(np.median(np.abs(left)))
    if len(deviation) >= _FOR_A_MOVEMENT:
        other = deviation - _of_movement(positions, normals, deviation)
        # Least absolute deviations make six of them zero.
        less = _MAD * float(np.median(np.sort(np.abs(other))[6:]))
        if _MOVED * less < scatter:
            return other, less
    return left, scatter


def _of_movement(positions: FloatArray, normals: FloatArray, deviation: FloatArray) -> FloatArray:
    """The part of deviations that a shift and a turn of the part explain, by most of the points."""
    offset = positions - np.median(positions, axis=0)
    offset = offset / max(float(np.abs(offset).max()), 1e-9)
    rows = np.column_stack([normals, np.cross(offset, normals)])
    some = slice(None, None, len(deviation) // _FITTED + 1)
    fitted, values = rows[some], deviation[some]
    weights: FloatArray = np.ones(len(values))
    solution = np.zeros(6)
    for _ in range(_ROUNDS):  # least absolute deviations by weights
        weighted = fitted * weights[:, None]
        solution = np.asarray(
            np.linalg.lstsq(weighted.T @ fitted, weighted.T @ values, rcond=1e-10)[0]
        )
        missed = np.abs(values - fitted @ solution)
        weights = 1.0 / np.maximum(missed, max(0.1 * float(np.median(missed)), 1e-9))
    return np.asarray(rows @ solution)


def _neighbours(positions: FloatArray, normals: FloatArray, rows: IntArray) -> IntArray:
    """Rows of the points nearest to each of some, without itself, (k, m): on the same side."""
    most = min(_NEIGHBOURS, len(positions) - 1)
    size = float(np.ptp(positions, axis=0).max())
    places = np.hstack([positions, size * normals])
    if len(places) <= FEW_PLACES:
        apart = np.linalg.norm(places[rows][:, None] - places, axis=2)
        found = np.argsort(apart, axis=1, kind="stable")[:, : most + 1]
    else:
        from scipy.spatial import cKDTree

        found = np.asarray(cKDTree(places).query(places[rows], k=most + 1)[1])
    # Points at one place: the point itself need not be the first.
    itself = found == rows[:, None]
    itself[~itself.any(axis=1), -1] = True
    return np.asarray(found[~itself].reshape(len(rows), most))


def _range_without_the_farthest(values: FloatArray, middle: FloatArray) -> FloatArray:
    """Range of each row without its value farthest from the middle, (k,): another gross one."""
    order = np.argsort(np.abs(values - middle[:, None]), axis=1)[:, :-1]
    kept = np.take_along_axis(values, order, axis=1)
    return np.asarray(np.ptp(kept, axis=1))
