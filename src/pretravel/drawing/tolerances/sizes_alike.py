"""Sizes of bores and bosses that are all off alike, along the normals of their surfaces."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.drawing.tolerances.tolerances import InspectedFeature

_FEWEST = 3
_CHANCE = 0.005
"""That sizes with independent errors are off alike so much."""
_LEAST = 2.0 * MICROMETRE
"""Distance along the normals that a report speaks of. [mm]"""


def sizes_alike(features: Sequence[InspectedFeature]) -> list[str]:
    """A sentence if all sizes, inner and outer ones, differ alike from the middle of their limits.

    An error of the tip's effective radius does this, and a cutter of another radius.

    Parameters
    ----------
    features : sequence of InspectedFeature
        Those with two limits of a size, on a known side, are compared.
    """
    missing: dict[str, float] = {}
    sides = set()
    u = 0.0
    for each in features:
        own = each.feature
        limits = next((c for c in each.conformities if c.name == own.size_name), None)
        if limits is None or not own.side or not math.isfinite(limits.upper - limits.lower):
            continue
        off = 0.5 * (limits.value - 0.5 * (limits.lower + limits.upper))
        missing[own.label or own.kind] = off if own.side == "inside" else -off
        sides.add(own.side)
        u = max(u, own[own.size_name].u)
    if len(missing) < _FEWEST or len(sides) < 2:
        return []
    values = np.array(list(missing.values()))
    mean, spread = float(values.mean()), float(values.std(ddof=1))
    if abs(mean) < max(_LEAST, u) or abs(mean) < _limit(len(values)) * spread:
        return []
    low, high = sorted((abs(values.min()), abs(values.max())))
    what = "less" if mean > 0.0 else "more"
    return [
        (
            f"{', '.join(missing)}: all surfaces, inner and outer, have {low / MICROMETRE:.1f} to "
            f"{high / MICROMETRE:.1f} µm {what} material than in the middle of their limits. One "
            "cutter can have made them so. If not, the touches are not those of the map (another "
            "stylus, feed or trigger delay), or the diameter of the reference is wrong: U does not "
            "contain this"
        )
    ]


def _limit(count: int) -> float:
    """Mean over spread of independent sizes, which is larger by chance in `_CHANCE` of cases."""
    from scipy.special import stdtrit

    return float(stdtrit(count - 1, 1.0 - 0.5 * _CHANCE)) / math.sqrt(count)
