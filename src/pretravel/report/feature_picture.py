"""Pictures of measured features: residuals, magnified, before and after compensation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.features.measured_feature import MeasuredFeature
from pretravel.features.tolerances import InspectedFeature
from pretravel.report.style import COLOURS, new_figure
from pretravel.uncertainty.fitting.feature import across
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.projections.polar import PolarAxes

_MOST_PANELS = 12
_GAP = 0.5 * np.pi  # a larger one between the first and the last point is not closed by a line
_AFTER, _BEFORE, _ZONE = COLOURS[0], COLOURS[1], COLOURS[2]


def plot_features(features: Sequence[InspectedFeature], title: str = "") -> Figure:
    """Distances of the points from the compensated feature, magnified, with the tolerance.

    Parameters
    ----------
    features : sequence of InspectedFeature
    title : str

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each of the first twelve features. Features of revolution are seen along their
        axis; planes and lines along their longest extent.
    """
    shown = features[:_MOST_PANELS]
    columns = min(len(shown), 3)
    rows = math.ceil(len(shown) / columns)
    more = f" (the first {len(shown)} of {len(features)})" if len(features) > len(shown) else ""
    figure = new_figure(4.6 * columns + 0.8, 4.6 * rows + 0.5, f"{title}{more}")
    for index, inspected in enumerate(shown, start=1):
        feature = inspected.feature
        if feature.kind in ("plane", "line"):
            axes = figure.add_subplot(rows, columns, index)
            _draw_straight(axes, inspected)
        else:
            axes = figure.add_subplot(rows, columns, index, projection="polar")
            _draw_round(axes, inspected)  # type: ignore[arg-type]
        name = feature.label or feature.kind
        axes.set_title(f"{name}: deviation / µm", fontsize=10, pad=14)
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)
    return figure


def _deviations(feature: MeasuredFeature) -> tuple[FloatArray, FloatArray | None]:
    """Of compensated and uncompensated points from the compensated feature. [µm]"""
    found = feature.association
    after = found.residuals / MICROMETRE
    if feature.uncompensated is None:
        return after, None
    moved = np.sum((feature.uncompensated.points - found.points) * found.outward, axis=1)
    return after, after + moved / MICROMETRE


def _zone(inspected: InspectedFeature) -> tuple[float, float, str] | None:
    """The tolerance as deviations from the compensated feature. [µm]"""
    feature = inspected.feature
    for conformity in inspected.conformities:
        if conformity.name == "diameter" and math.isfinite(conformity.lower + conformity.upper):
            slant = (
                1.0
                if feature.association.half_angle is None
                else math.cos(feature.association.half_angle)
            )
            ends = (0.5 * slant * (x - conformity.value) / MICROMETRE
                    for x in (conformity.lower, conformity.upper))  # fmt: skip
            return (*ends, "tolerance of the diameter")  # type: ignore[return-value]
    for conformity in inspected.conformities:
        if conformity.name == feature.form_name:
            residuals = feature.association.residuals / MICROMETRE
            middle, half = 0.5 * (residuals.max() + residuals.min()), 0.5 * conformity.upper
            return (
                middle - half / MICROMETRE,
                middle + half / MICROMETRE,
                f"tolerance of {conformity.name}",
            )
    return None


def _draw_round(axes: PolarAxes, inspected: InspectedFeature) -> None:
    feature = inspected.feature
    found = feature.association
    direction = np.array([0.0, 0.0, 1.0]) if found.direction is None else found.direction
    first, second = _upright(direction)
    offset = found.points - found.point
    angle = np.arctan2(offset @ second, offset @ first)
    after, before = _deviations(feature)
    zone = _zone(inspected)
    everything = [after, np.zeros(1)] + ([] if before is None else [before])
    everything += [np.array(zone[:2])] if zone else []
    low = min(float(part.min()) for part in everything)
    high = max(float(part.max()) for part in everything)
    span = max(high - low, 1e-3)
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    if zone:
        axes.fill_between(circle, zone[0], zone[1], color=_ZONE, alpha=0.18, lw=0.0, label=zone[2])
    axes.plot(circle, np.zeros_like(circle), color="0.35", lw=0.9, label="least squares")
    order = np.argsort(angle)
    one_ring = feature.kind in ("circle", "bore", "boss")
    if one_ring and 2.0 * np.pi - np.ptp(angle) < _GAP:
        order = np.append(order, order[0])
    style = "o-" if one_ring else "o"
    if before is not None:
        axes.plot(angle[order], before[order], style, ms=3.5, lw=0.7, color=_BEFORE,
                  label="uncompensated")  # fmt: skip
    axes.plot(angle[order], after[order], style, ms=3.5, lw=0.7, color=_AFTER, label="compensated")
    axes.set_rlim(low - 0.9 * span, high + 0.1 * span)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3)


def _upright(direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two directions across an axis; x and y where it is along z."""
    x = np.array([1.0, 0.0, 0.0]) - direction[0] * direction
    if np.linalg.norm(x) < 0.1:
        first, second = across(direction)
        return first, second
    first = x / np.linalg.norm(x)
    second = np.cross(direction, first)
    return first, second * (1.0 if second[int(np.argmax(np.abs(second)))] > 0.0 else -1.0)


def _draw_straight(axes: Axes, inspected: InspectedFeature) -> None:
    feature = inspected.feature
    points = feature.association.points
    centred = points - points.mean(axis=0)
    along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
    along = along * (1.0 if along[-1] >= along[0] else -1.0)
    order = np.argsort(along)
    after, before = _deviations(feature)
    zone = _zone(inspected)
    style = "o-" if feature.kind == "line" else "o"
    if zone:
        axes.axhspan(zone[0], zone[1], color=_ZONE, alpha=0.18, lw=0.0, label=zone[2])
    axes.axhline(0.0, color="0.35", lw=0.9, label="least squares")
    if before is not None:
        axes.plot(along[order], before[order], style, ms=3.5, lw=0.7, color=_BEFORE,
                  label="uncompensated")  # fmt: skip
    axes.plot(along[order], after[order], style, ms=3.5, lw=0.7, color=_AFTER, label="compensated")
    axes.set_xlabel("along the longest extent / mm", fontsize=8)
    axes.grid(alpha=0.3)
