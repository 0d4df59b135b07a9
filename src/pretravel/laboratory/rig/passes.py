"""What repeats of all directions together hide: passes that differ, a direction of its own."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.laboratory.rig.trace import RigTouch
from pretravel.uncertainty import COVERAGE_FACTOR, coverage_factor

_REPEAT = re.compile(r"_(\d+)$")
_FEWEST = 3
"""Directions with the same numbers of repeats, and degrees of freedom that are left."""
_BY_CHANCE = 0.05
_RARE = 0.01


@dataclass(frozen=True, eq=False)
class PassDifferences:
    """Passes that differ in all directions alike: a drift, or first touches unlike later ones.

    Attributes
    ----------
    numbers : tuple of int
        Of the repeats, from the names of the traces.
    differences : (k,) float
        Of their touches from the mean of all passes. [mm]
    u : float
        Standard uncertainty of the mean pretravel of any direction, common to all: with the
        coverage factor of its few degrees of freedom over 2. [mm]
    """

    numbers: tuple[int, ...]
    differences: FloatArray
    u: float

    @property
    def sentence(self) -> str:
        """What to know of them."""
        far = int(np.argmax(np.abs(self.differences)))
        return (
            f"repeats number {self.numbers[far]} lie {self.differences[far] / MICROMETRE:+.2g} µm "
            "from the mean of all repeats, in all directions: the probe drifts from pass to pass, "
            "or first touches differ. U contains this as an error that all directions share"
        )


def pass_differences(groups: Mapping[str, Sequence[RigTouch]]) -> PassDifferences | None:
    """The passes of touches grouped by direction; None where they do not differ beyond chance.

    Parameters
    ----------
    groups : mapping of str to sequence of RigTouch

    Notes
    -----
    Two-way analysis of variance, directions and numbers of repeats, F test at 5 %.
    """
    from scipy.special import fdtrc

    rows = [
        (place, int(found.group(1)), touch.pretravel)
        for place, group in enumerate(groups.values())
        for touch in group
        if (found := _REPEAT.search(touch.trace))
    ]
    numbers, count = np.unique([row[1] for row in rows], return_counts=True)
    kept = numbers[count >= _FEWEST]
    rows = [row for row in rows if row[1] in kept]
    if len(kept) < 2:
        return None
    directions, passes, values = (np.array(column) for column in zip(*rows, strict=True))
    own = np.equal.outer(directions, np.unique(directions)).astype(np.float64)
    of_pass = np.equal.outer(passes, kept).astype(np.float64)
    alone = values - own @ np.linalg.lstsq(own, values, rcond=None)[0]
    # In each direction the passes add up to zero: the last one is less all others.
    contrasts = of_pass[:, :-1] - of_pass[:, -1:]
    both = np.hstack([own, contrasts])
    solution, _, rank, _ = np.linalg.lstsq(both, values, rcond=None)
    dof = len(values) - int(rank)
    if rank < both.shape[1] or dof < _FEWEST:
        return None
    left = values - both @ solution
    more, squares = len(kept) - 1, float(left @ left)
    # Repeats that fall between the same samples scatter by less than the place of an edge.
    edges = _squared_edges([touch for group in groups.values() for touch in group])
    ratio = (float(alone @ alone) - squares) / more / max(squares / dof, edges, 1e-24)
    if not fdtrc(more, dof, ratio) <= _BY_CHANCE:
        return None
    effects = np.append(solution[own.shape[1] :], -np.sum(solution[own.shape[1] :]))
    single = math.sqrt(float(effects @ effects) / more)
    u = coverage_factor(float(more)) / COVERAGE_FACTOR * single / math.sqrt(len(kept))
    return PassDifferences(tuple(kept.tolist()), effects, u)


def _squared_edges(touches: Sequence[RigTouch]) -> float:
    """Variance of a pretravel by edges between samples. [mm²]"""
    known = [touch.u_pretravel for touch in touches if math.isfinite(touch.u_pretravel)]
    return float(np.mean(np.square(known))) if known else 0.0


def scatters_more(
    own_squares: float,
    own_dof: float,
    squares: float,
    dof: float,
    of: int,
    sampling: float = 0.0,
) -> bool:
    """Whether one of several directions scatters more than the others together.

    Parameters
    ----------
    own_squares, own_dof : float
        Sum of squared residuals of its repeats [mm²], and their degrees of freedom.
    squares, dof : float
        The same of all directions.
    of : int
        Number of directions.
    sampling : float
        Standard deviation by edges between samples: repeats that fall between the same ones hide
        it. [mm]

    >>> scatters_more(50.0, 2.0, 72.0, 24.0, 12), scatters_more(4.0, 2.0, 26.0, 24.0, 12)
    (True, False)
    """
    from scipy.special import fdtrc

    others = dof - own_dof
    left = max(squares - own_squares, others * sampling**2)
    if own_dof <= 0.0 or others < _FEWEST or left <= 0.0:
        return False
    ratio = (own_squares / own_dof) / (left / others)
    return bool(fdtrc(own_dof, others, ratio) < _RARE / of)
