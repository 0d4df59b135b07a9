"""Targets: points of a surface to touch, and the approaches to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pretravel.base import (
    COORDINATE,
    FloatArray,
    PretravelError,
    as_numbers,
    checked_unit,
    frozen,
)
from pretravel.touches.touches import refuse_glancing


def label_prefix(label: str) -> str:
    """A label without the number at its end; the label itself where nothing else is left.

    >>> label_prefix("bore1-03"), label_prefix("A7"), label_prefix("12")
    ('bore1', 'A', '12')
    """
    name = label.rstrip("0123456789")
    return (name.rstrip(" \t._:#/-") if name != label else label) or label


class PointsToTouch(Protocol):
    """What has points, normals and labels, such as an `InspectionPlan`."""

    point: FloatArray
    normal: FloatArray

    @property
    def labels(self) -> tuple[str, ...]:
        """A label for each point."""


@dataclass(frozen=True, eq=False)
class Targets:
    """Points of a surface to touch, with the normals and approaches there.

    Parameters
    ----------
    points : (n, 3) float
        On the nominal surface, machine frame. [mm]
    normals : (n, 3) float
        Outward unit normals.
    approaches : (n, 3) float, optional
        Unit directions of travel; -normals when not given.
    labels : n strings, optional
    feed : float, optional
        At which they are to be touched, where that is stated. [mm/min]
    unused : tuple of str
        Sentences on what the file states of all targets and no program uses, such as a tip.

    Raises
    ------
    PretravelError
        Arrays of different shapes; values that are not finite; vectors that are not of unit
        length; approaches that move away from the surface or along it.

    >>> Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]).approaches.tolist()
    [[-0.0, -0.0, -1.0]]
    """

    points: FloatArray
    normals: FloatArray
    approaches: FloatArray | None = None
    labels: tuple[str, ...] | None = None
    feed: float | None = None
    unused: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        points = as_numbers(self.points, "the points of the targets")
        normals = checked_unit(self.normals, "target normals")
        if points.shape != normals.shape:
            raise PretravelError(
                f"targets have points of shape {points.shape} and normals of shape {normals.shape}"
            )
        far = np.flatnonzero(~(np.abs(points) <= COORDINATE.highest).all(axis=1))
        if len(far):
            row = int(far[0])
            problem = "beyond a kilometre" if np.isfinite(points[row]).all() else "not finite"
            raise PretravelError(f"target {row + 1}: its point is {problem}")
        object.__setattr__(self, "points", frozen(points))
        object.__setattr__(self, "normals", frozen(normals))
        approaches = (
            -normals
            if self.approaches is None
            else checked_unit(self.approaches, "target approaches")
        )
        refuse_glancing(approaches, normals, self.name)
        object.__setattr__(self, "approaches", frozen(approaches))

    @classmethod
    def of(cls, plan: PointsToTouch) -> Targets:
        """The points of a plan, with approaches along their normals."""
        return cls(plan.point, plan.normal, labels=plan.labels)

    def __len__(self) -> int:
        return len(self.points)

    def name(self, row: int) -> str:
        """The name of one target in messages.

        >>> Targets([[0, 0, 0]], [[0, 0, 1]], labels=("pole",)).name(0)
        'target 1 (pole)'
        """
        label = f" ({self.labels[row]})" if self.labels and self.labels[row] else ""
        return f"target {row + 1}{label}"
