"""Charts of quantities over directions: from above, over azimuth, as a body, touch by touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    MICROMETRE,
    FloatArray,
    IntArray,
    azimuth_angle,
    from_angles,
    grid,
    polar_angle,
)
from pretravel.maps import PretravelMap, map_grid
from pretravel.show.chart import Axis, PolarChart, Scale, SpaceChart, TopView
from pretravel.show.chart_marks import Area, Dots, LineMark, SpaceMesh, SpacePoints
from pretravel.show.colours import Colour, series
from pretravel.show.formatting import angles_deg, decimals, number_text, signed_decimals
from pretravel.show.style import some_rows

_MOST_NODES = 400
"""Of more touched directions, the marks hide the map."""
_RING = 10.0
"""Directions whose polar angles differ by less lie on a ring; it has no view from above. [deg]"""
_NEAR = 12.0
"""Distance from the outermost directions to which a scattered quantity is drawn. [deg]"""
_STEP = 3.0
"""Of a grid between scattered directions. [deg]"""
_MOST_LEVELS = 4
_BESIDE = 2.2
"""Distance between repeats of a direction that are drawn side by side. [deg]"""


def is_ring(directions: FloatArray) -> bool:
    """Whether directions lie on one ring around the axis.

    Parameters
    ----------
    directions : (n, 3) float
        Probe frame.

    >>> is_ring(from_angles(0.5 * np.pi, np.array([0.0, 1.0, 2.0])))
    True
    """
    return float(np.ptp(polar_angle(directions))) / DEGREE < _RING


def direction_words(directions: FloatArray) -> list[str]:
    """Polar angle and azimuth of each direction in words, for labels.

    Parameters
    ----------
    directions : (n, 3) float

    >>> direction_words(np.array([[0.0, 1.0, 0.0]]))
    ['polar 90.0°, azimuth 90.0°']
    """
    polar, azimuth = angles_deg(directions)
    return [
        f"polar {p:.1f}°, azimuth {a:.1f}°"
        for p, a in zip(polar.tolist(), azimuth.tolist(), strict=True)
    ]


def values_on_grid(
    polar: FloatArray, azimuth: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values of directions as a table over their polar angles and azimuths.

    Parameters
    ----------
    polar, azimuth : (n,) float
        Of the directions. [deg]
    values : (n,) float

    Returns
    -------
    levels : (p,) float
        Polar angles. [deg]
    turns : (a,) float
        Azimuths. [deg]
    table : (p, a) float
        Not a number where there is no such direction.

    >>> polar, azimuth = np.array([0.0, 90.0, 90.0]), np.array([0.0, 0.0, 180.0])
    >>> levels, _, table = values_on_grid(polar, azimuth, np.ones(3))
    >>> levels.tolist(), table.tolist()
    ([0.0, 90.0], [[1.0, 1.0], [1.0, 1.0]])
    """
    levels, turns = np.unique(polar), np.unique(azimuth)
    table = np.full((len(levels), len(turns)), np.nan)
    table[np.searchsorted(levels, polar), np.searchsorted(turns, azimuth)] = values
    if levels[0] == 0.0:  # at the pole there is one direction, with any azimuth
        table[0] = values[polar == 0.0][0]
    return levels, turns, table


def azimuth_axis(frame: str = "probe") -> Axis:
    """The azimuth in the frame of the probe or the machine, all around.

    >>> azimuth_axis("machine").text
    'azimuth (0° = +X, 90° = +Y of the machine) / °'
    """
    ticks = tuple(float(tick) for tick in range(0, 361, 60))  # 45 is too dense in a narrow chart
    return Axis(f"azimuth (0° = +X, 90° = +Y of the {frame})", "°", -5.0, 365.0, ticks=ticks)


def labels_of(
    directions: FloatArray, quantities: Sequence[tuple[str, npt.ArrayLike, bool]]
) -> tuple[str, ...]:
    """What a page shows of each touch: its number, direction and some quantities in µm.

    Parameters
    ----------
    directions : (n, 3) float
    quantities : sequence of (name, (n,) float, bool)
        Values in µm; whether a positive one has its sign.

    >>> labels_of(np.array([[1.0, 0.0, 0.0]]), [("residual", [0.123], True)])
    ('touch 1: polar 90.0°, azimuth 0.0°; residual +0.12 µm',)
    """
    texts = [
        [f"; {name} {number_text(float(v), signed_decimals(2) if sign else decimals(2))} µm"
         for v in np.asarray(values, dtype=np.float64)]
        for name, values, sign in quantities
    ]  # fmt: skip
    return tuple(
        f"touch {i}: {words}" + "".join(text[i - 1] for text in texts)
        for i, words in enumerate(direction_words(directions), start=1)
    )


def top_view_grid(pretravel_map: PretravelMap) -> dict[str, FloatArray]:
    """A map on the grid of a top view; see `map_grid`."""
    return map_grid(pretravel_map, polar_step=2.0, azimuth_step=3.0)


def map_top_view(
    pretravel_map: PretravelMap,
    title: str = "pretravel from above",
    values: Mapping[str, FloatArray] | None = None,
) -> TopView:
    """A map as seen from the spindle, with the directions that it was made from.

    Parameters
    ----------
    pretravel_map : PretravelMap
    title : str
    values : mapping, optional
        Of `top_view_grid`, where they are known.
    """
    values = top_view_grid(pretravel_map) if values is None else values
    polar, azimuth = angles_deg(pretravel_map.support.nodes)
    nodes = (polar, azimuth) if len(polar) <= _MOST_NODES else (None, None)
    scale = Scale.of("pretravel", "µm", values["pretravel_um"])
    return TopView(title, values["polar_deg"], values["azimuth_deg"], values["pretravel_um"],
                   scale, "probe", *nodes)  # fmt: skip


def scattered_top_view(title: str, places: FloatArray, values: FloatArray, scale: Scale) -> TopView:
    """Values at scattered directions, linear between them, as seen from the spindle.

    Next to the outermost directions the value is that of the nearest one, up to 12° away.

    Parameters
    ----------
    title : str
    places : (m, 3) float
        Probe frame.
    values : (m,) float
        In the unit of the scale.
    scale : Scale
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import cKDTree

    polar, azimuth = angles_deg(places)
    around = np.radians(azimuth)
    plane = np.column_stack([polar * np.cos(around), polar * np.sin(around)])
    rings = np.append(np.arange(0.0, polar.max(), _STEP), polar.max())
    turns = np.arange(0.0, 360.0, _STEP)
    r, a = np.meshgrid(rings * (1.0 - 1e-9), np.radians(turns), indexing="ij")
    at = np.stack([r * np.cos(a), r * np.sin(a)], axis=-1)
    found = LinearNDInterpolator(plane, values)(at)
    apart, nearest = cKDTree(plane).query(at)
    found = np.where(np.isnan(found) & (apart <= _NEAR), values[nearest], found)
    return TopView(title, rings, turns, found, scale)


def map_body(
    pretravel_map: PretravelMap,
    touched: FloatArray | None = None,
    observed: FloatArray | None = None,
    labels: tuple[str, ...] = (),
) -> SpaceChart:
    """The pretravel of a map as a body: as far from the origin as the pretravel in that direction.

    Parameters
    ----------
    pretravel_map : PretravelMap
    touched, observed : (n, 3) and (n,) float, optional
        Touched directions in the probe's frame and pretravel seen there. [mm]
    labels : tuple of str
        Of the touches.
    """
    values = map_grid(pretravel_map, polar_step=3.0, azimuth_step=5.0)
    chart = body_chart(values["polar_deg"], values["azimuth_deg"], values["pretravel_um"])
    if touched is None or observed is None:
        return chart
    rows = some_rows(np.arange(len(touched)), 2000)
    points = SpacePoints(
        observed[rows, None] / MICROMETRE * touched[rows], "touches", "ink", size=3.0,
        labels=tuple(labels[row] for row in rows) if labels else (),
    )  # fmt: skip
    return SpaceChart(chart.title, (*chart.marks, points), "probe", "µm", chart.scale,
                      note=chart.note)  # fmt: skip


def body_chart(
    polar_deg: FloatArray,
    azimuth_deg: FloatArray,
    values: FloatArray,
    name: str = "pretravel",
    unit: str = "µm",
) -> SpaceChart:
    """Pretravel, or another quantity, over directions as a body about the origin.

    Parameters
    ----------
    polar_deg : (p,) float
    azimuth_deg : (a,) float
        Increasing, below 360°, all around.
    values : (p, a) float
        Pretravel, the distance of the body from the origin; it is not drawn where there is none,
        nor below zero. [µm]
    name, unit : str
        Of the quantity.

    >>> polar, azimuth = np.array([0.0, 90.0]), np.array([0.0, 120.0, 240.0])
    >>> body = body_chart(polar, azimuth, np.full((2, 3), 5.0))
    >>> float(np.linalg.norm(body.marks[0].vertices[4]))
    5.0
    """
    scale = Scale.of(name, unit, values)
    drawn = np.isfinite(values) & (values >= 0.0)
    directions = grid(polar_deg * DEGREE, azimuth_deg * DEGREE)
    radius = np.where(drawn, values, 0.0).ravel()
    triangles = grid_triangles(len(polar_deg), len(azimuth_deg))
    triangles = triangles[drawn.ravel()[triangles].all(axis=1)]
    mesh = SpaceMesh(radius[:, None] * directions, triangles, values=radius, outwards=True)
    below = np.isfinite(values) & (values < 0.0)
    note = f"Where the {name} is below zero there is no body." if below.any() else ""
    return SpaceChart(f"{name} as a body", (mesh,), "probe", unit, scale, note=note)


def grid_triangles(rows: int, columns: int) -> IntArray:
    """Triangles between the points of a grid that closes around, row by row.

    Parameters
    ----------
    rows, columns : int
        Point (i, j) has the number i * columns + j.

    Returns
    -------
    (t, 3) int

    >>> grid_triangles(2, 3).shape
    (6, 3)
    """
    i, j = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    here, beside = i * columns + j, i * columns + (j + 1) % columns
    lower = np.stack([here, here + columns, beside + columns], axis=-1)
    upper = np.stack([here, beside + columns, beside], axis=-1)
    return np.asarray(np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)]))


def around_marks(
    pretravel_map: PretravelMap, polar_deg: float, colour: Colour, name: str
) -> tuple[Area, LineMark] | tuple[()]:
    """Pretravel over azimuth at a polar angle, with a band of two standard uncertainties.

    Parameters
    ----------
    pretravel_map : PretravelMap
    polar_deg : float
    colour : Colour
    name : str
        For the legend.

    Returns
    -------
    tuple
        Empty where the map does not hold at that polar angle.
    """
    azimuth = np.linspace(0.0, 2.0 * np.pi, 181)
    directions = from_angles(polar_deg * DEGREE, azimuth)
    held = pretravel_map.support.supports(directions)
    if not held.any():
        return ()
    normals = directions @ pretravel_map.rotation.T
    value, u = pretravel_map.pretravel_and_uncertainty(normals, extrapolate=True)
    value = np.where(held, value, np.nan) / MICROMETRE
    band = 2.0 * u / MICROMETRE
    return (
        Area(azimuth, value - band, value + band, "", colour),
        LineMark(azimuth, value, name, colour),
    )


def touched_levels(directions: FloatArray) -> FloatArray:
    """Polar angles at which touches are drawn over the map, from the equator to the pole. [deg]

    Parameters
    ----------
    directions : (n, 3) float

    Returns
    -------
    (k,) float
        Evenly chosen where touches lie at many polar angles; below 15° azimuths are too near.

    >>> touched_levels(from_angles(np.radians([0.0, 22.5, 45.0, 90.0]), 0.0)).tolist()
    [90.0, 45.0, 22.5]
    """
    levels = np.unique(np.round(polar_angle(directions) / DEGREE / 2.5) * 2.5)[::-1]
    levels = levels[levels >= 15.0]
    chosen = np.unique(
        np.linspace(0, max(len(levels) - 1, 0), min(len(levels), _MOST_LEVELS)).round()
    )
    return np.asarray(levels[chosen.astype(np.int64)])


def map_and_touches(
    pretravel_map: PretravelMap,
    directions: FloatArray,
    observed: FloatArray,
    labels: tuple[str, ...],
) -> PolarChart:
    """The map over azimuth at up to four polar angles, with the touches near them.

    Parameters
    ----------
    pretravel_map : PretravelMap
    directions : (n, 3) float
        Of the touches, probe frame.
    observed : (n,) float
        Pretravel there. [mm]
    labels : tuple of str
        Of the touches.
    """
    polar = polar_angle(directions) / DEGREE
    marks: list[Area | LineMark | Dots] = []
    for index, level in enumerate(touched_levels(directions)):
        marks += around_marks(pretravel_map, float(level), series(index), f"polar {level:g}°")
        rows = some_rows(np.flatnonzero(np.abs(polar - level) < 1.5), 1000)
        azimuth, value = azimuth_angle(directions[rows]), observed[rows] / MICROMETRE
        own = tuple(labels[row] for row in rows)
        marks.append(Dots(azimuth, value, "", series(index), size=4.0, labels=own))
    low = 0.0 if observed.min() > 0.0 else None
    note = "Lines: map, bands: ± 2 u of the map, dots: touches."
    return PolarChart(
        "pretravel over azimuth", Axis("pretravel", "µm", low=low), tuple(marks), note=note
    )


def chart_by_place(
    directions: FloatArray,
    values: FloatArray,
    scale: Scale,
    title: str,
    *,
    labels: tuple[str, ...] = (),
    groups: IntArray | None = None,
    ringed: tuple[str, Sequence[int]] = ("", ()),
) -> PolarChart:
    """Values at touched directions, as seen from the spindle: polar angle outwards.

    Parameters
    ----------
    directions : (n, 3) float
        Probe frame.
    values : (n,) float
        In the unit of the scale.
    scale : Scale
    title : str
    labels : tuple of str
    groups : (n,) int, optional
        Which repeat each other's direction: those are drawn side by side.
    ringed : (str, sequence of int)
        Rows with a ring around them, and what they are.
    """
    polar, azimuth = angles_deg(directions)
    repeated = groups is not None and len(np.unique(groups)) < len(groups)
    if repeated and groups is not None:
        polar, azimuth = _side_by_side(polar, azimuth, groups)
    rows = some_rows(np.arange(len(values)), 3000)
    marks = [Dots(azimuth[rows] * DEGREE, polar[rows], "", values=values[rows], size=6.0,
                  labels=tuple(labels[r] for r in rows) if labels else ())]  # fmt: skip
    if len(ringed[1]):
        at = np.asarray(ringed[1], dtype=np.int64)
        marks.append(
            Dots(azimuth[at] * DEGREE, polar[at], ringed[0], "limit", symbol="ring", size=11.0)
        )
    highest = max(float(polar.max()) + 3.0, 30.0)
    rings = tuple(ring for ring in (30.0, 60.0, 90.0, 120.0, 150.0) if ring < highest)
    words = ["Repeats of a direction are side by side."] if repeated else []
    words += [f"{len(rows)} of {len(values)} touches drawn."] if len(rows) < len(values) else []
    radius = Axis("polar angle", "°", 0.0, highest, ticks=rings)
    return PolarChart(title, radius, tuple(marks), "probe", scale, " ".join(words))


def _side_by_side(
    polar: FloatArray, azimuth: FloatArray, groups: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Repeats on a small circle around their direction in the view from above."""
    order = np.argsort(groups, kind="stable")
    _, start, count = np.unique(groups[order], return_index=True, return_counts=True)
    place = np.empty(len(groups), dtype=np.int64)
    place[order] = np.arange(len(groups)) - np.repeat(start, count)
    size = np.empty(len(groups), dtype=np.int64)
    size[order] = np.repeat(count, count)
    turn = 2.0 * np.pi * place / size
    apart = np.where(size > 1, _BESIDE * np.maximum(size / 4.0, 1.0), 0.0)
    x = polar * np.cos(azimuth * DEGREE) + apart * np.cos(turn)
    y = polar * np.sin(azimuth * DEGREE) + apart * np.sin(turn)
    return np.hypot(x, y), np.arctan2(y, x) / DEGREE % 360.0
