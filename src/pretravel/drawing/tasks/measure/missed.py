"""Points of a feature without those that are not touches of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from pretravel.files import odd_zeros
from pretravel.measurement import MissedPoints, Points, missed_points

_FEWEST = 3
"""Points from which a name that repeats is that of a feature."""
_SHOWN = 5


def without_missed(
    points: Points, kinds: Sequence[str], axis: Sequence[float] | None
) -> tuple[Points, list[str]]:
    """Points of a feature without those far from it, and sentences that name these.

    Compensated points all stay: what is decided on them lacks none unseen.

    Parameters
    ----------
    points : Points
    kinds : sequence of str
        What the feature can be; the first that has far points says which, and none where one of
        them has all points.
    axis : (3,) float or None
        As of `associate`.

    >>> heights = np.array([0.012, 0.013, 0.011, 0.014, -2.5, 0.012, 0.010, 0.013, 0.015])
    >>> x, y = np.meshgrid([0.0, 10.0, 20.0], [0.0, 10.0, 20.0])
    >>> points = Points.plain(np.column_stack([x.ravel(), y.ravel(), heights]), tuple("abcdefghi"))
    >>> kept, said = without_missed(points, ["plane"], None)
    >>> len(kept), said
    (8, ['1 point is far from the plane of the others, a miss or a gross error, and left out: \
e (-2.512 mm)'])
    """
    for kind in kinds:
        found = missed_points(kind, points.positions, None if axis is None else np.asarray(axis))
        if found.unclear:
            return points, [_unclear(len(points), kind, found.unclear)]
        if found.rows:
            return _named(points, kind, found)
        if found.all_near:
            break
    return points, _zeros(points) if "plane" in kinds else []


def several_features(points: Points) -> list[str]:
    """A sentence about points of which the labels name several features, each several times.

    >>> points = Points.plain(np.arange(18.0).reshape(6, 3), ("B1", "B1", "B1", "B2", "B2", "B2"))
    >>> several_features(points)[0][:60]
    'the labels name 2 features, B1 (3 points), B2 (3 points), an'
    """
    counts = Counter(points.labels)
    if len(counts) < 2 or min(counts.values()) < _FEWEST:
        return []
    shown = ", ".join(f"{name} ({n} points)" for name, n in list(counts.items())[:_SHOWN])
    more = " …" if len(counts) > _SHOWN else ""
    said = f"the labels name {len(counts)} features, {shown}{more}, and all points are taken as one"
    return [f"{said}: select those of one feature by the label"]


def _zeros(points: Points) -> list[str]:
    """A sentence about heights that are exactly 0, apart from the others."""
    axis = int(np.argmin(np.ptp(points.positions, axis=0)))
    named = ", ".join(points.labels[row] for row in odd_zeros(points.positions, axis))
    said = f"the height of {named} is exactly 0, apart from the others: was it probed?"
    return [f"{said} If not, leave it out"] if named and not points.state_uncertainty else []


def _unclear(count: int, kind: str, off: float) -> str:
    return (
        f"the {count} points lie up to {off:.3f} mm from the {kind}, as with a miss or a gross "
        "error among them, and are too few to show which it is. Touch more places, or leave it out"
    )


def _named(points: Points, kind: str, found: MissedPoints) -> tuple[Points, list[str]]:
    named = ", ".join(
        f"{points.labels[row]} ({off:+.3f} mm)"
        for row, off in zip(found.rows, found.off, strict=True)
    )
    which = "point is" if len(found.rows) == 1 else "points are"
    said = f"{len(found.rows)} {which} far from the {kind} of the others"
    if points.state_uncertainty:
        question = "Is it a miss (the end of a move) or a gross error? If so, leave it out"
        return points, [f"{said}: {named}. {question}"]
    said += f", a miss or a gross error, and left out: {named}"
    return points[np.delete(np.arange(len(points)), found.rows)], [said]
