"""Touches on their reference in space, coloured by residual, to turn and to point at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, BoolArray, FloatArray, IntArray
from pretravel.show import (
    Scale,
    SpaceChart,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpacePoints,
    number_text,
    round_number,
    signed_decimals,
    sphere_mesh,
    whiskers,
)

_LONGEST_WHISKER = 0.3
"""Of the largest residual, as a share of the radius."""
_RINGS, _SECTORS = 19, 36
_SMALLEST_SPAN = 0.5
"""Of the scale of residuals, so that small ones do not look dramatic. [µm]"""
_NOT_USED, _OUTLIER, _USED = "left out by you", "outlier, left out", "touch"


@dataclass(frozen=True, eq=False)
class TouchesInSpace:
    """Touches on a reference, and what a fit leaves of them.

    Attributes
    ----------
    positions : (n, 3) float
        Tip centres. [mm]
    center : (3,) float
        Of the sphere through them. [mm]
    radius : float
        Of that sphere. [mm]
    residuals : (n,) float
        Pretravel less that of the fit: positive where the probe triggers late. [µm]
    outliers : (n,) bool
        Named and left out by the fit.
    left_out : (n,) bool
        Left out by the user.
    labels : tuple of str
    ring : bool
        Whether the reference is a ring, touched inside.
    """

    positions: FloatArray
    center: FloatArray
    radius: float
    residuals: FloatArray
    outliers: BoolArray
    left_out: BoolArray
    labels: tuple[str, ...]
    ring: bool = False

    def rows(self) -> tuple[IntArray, ...]:
        """Rows of the touches of each mark with points: used, outliers, left out."""
        out, named = self.left_out, self.outliers & ~self.left_out
        return tuple(np.flatnonzero(mask) for mask in (~out & ~named, named, out))


def touches_chart(
    touches: TouchesInSpace, title: str = "Touches, coloured by residual", *, unit: str = "mm"
) -> SpaceChart:
    """The reference with its touches; bars along the normal show the residuals enlarged.

    Parameters
    ----------
    touches : TouchesInSpace
    title : str
    unit : str
        Of the positions.

    Returns
    -------
    SpaceChart
        The last three marks are the touches that are used, outliers, and those that the user left
        out, in the order of `TouchesInSpace.rows`.
    """
    out = touches.positions - touches.center
    directions = out / np.linalg.norm(out, axis=1)[:, None]
    used, named, dropped = touches.rows()
    kept = touches.residuals[used]
    largest = max(float(np.max(np.abs(kept), initial=0.0)), _SMALLEST_SPAN)
    enlarged = round_number(_LONGEST_WHISKER * touches.radius / (largest * MICROMETRE))
    lengths = enlarged * MICROMETRE * touches.residuals[used]
    bars = whiskers(touches.positions[used], directions[used], lengths)
    marks: tuple[SpaceMark, ...] = (
        _circle(touches, out) if touches.ring else _sphere(touches.center, 0.985 * touches.radius),
        SpaceLines(*bars, colour="ink", width=1.2),
        _points(touches, used, _USED, with_values=True),
        _points(touches, named, _OUTLIER, with_values=False),
        _points(touches, dropped, _NOT_USED, with_values=False),
    )
    return SpaceChart(
        title,
        marks,
        unit=unit,
        scale=Scale("pretravel − fit", "µm", -largest, largest, signed=True),
        note=f"Bars show the residuals {enlarged:g} times enlarged.",
    )


def _points(
    touches: TouchesInSpace, rows: IntArray, name: str, *, with_values: bool
) -> SpacePoints:
    labels = tuple(
        f"{touches.labels[row]}: {number_text(touches.residuals[row], signed_decimals(2))} µm"
        for row in rows.tolist()
    )
    return SpacePoints(
        touches.positions[rows],
        name if len(rows) else "",
        "limit" if name == _OUTLIER else "reference",
        values=touches.residuals[rows] if with_values else None,
        symbol={_USED: "dot", _OUTLIER: "diamond", _NOT_USED: "cross"}[name],  # type: ignore[arg-type]
        size=8.0,
        labels=labels,
    )


def _circle(touches: TouchesInSpace, out: FloatArray) -> SpaceLines:
    """The circle of a ring in the plane of its touches."""
    across = np.linalg.svd(out, full_matrices=False)[2][:2]
    around = np.linspace(0.0, 2.0 * np.pi, 121)
    turns = np.stack([np.cos(around), np.sin(around)], axis=-1)
    points = touches.center + touches.radius * turns @ across
    return SpaceLines(points[:-1], points[1:], colour="body", width=2.0)


def _sphere(center: FloatArray, radius: float) -> SpaceMesh:
    return SpaceMesh(*sphere_mesh(center, radius, _RINGS, _SECTORS), opacity=0.35)
