"""A prediction as a picture: force and pretravel over directions, and its contributions."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, azimuth_angle
from pretravel.prediction import Trigger
from pretravel.show import (
    Area,
    Axis,
    Bars,
    Chart,
    LineMark,
    Mark,
    PlaneChart,
    PolarChart,
    View,
    angles_deg,
    azimuth_axis,
    body_chart,
    number_text,
    series,
    values_on_grid,
)
from pretravel.task import QuantityWord

_STEEP = 30.0
"""Below this polar angle force and deflection hardly depend on the azimuth, and the force grows to
that of the spring: in a diagram over azimuth it would squeeze the rest into the middle. [deg]"""
_LEVELS = 5


"""What a picture of a prediction shows in addition to the force."""


def values_of(trigger: Trigger, quantity: QuantityWord) -> tuple[str, str, FloatArray]:
    """Words, unit and values of a predicted quantity, in the unit of pictures.

    Parameters
    ----------
    trigger : Trigger
    quantity : str

    >>> from pretravel.prediction.catalogue import load_probe
    >>> from pretravel.prediction.trigger import predict
    >>> values_of(predict(load_probe("omp40-2"), [[1.0, 0.0, 0.0]]), "trigger_force")[:2]
    ('trigger force', 'N')
    """
    words = quantity.replace("_", " ")
    if quantity == "trigger_force":
        return words, "N", trigger.force
    values = trigger.pretravel if quantity == "pretravel" else trigger.sensing_distance
    return words, "µm", np.asarray(values / MICROMETRE)


def prediction_view(
    trigger: Trigger, title: str = "", quantity: QuantityWord = "pretravel"
) -> View:
    """A prediction over its directions.

    Parameters
    ----------
    trigger : Trigger
    title : str
    quantity : str
        pretravel, or the sensing distance of the thesis (the deflection across the axis): what is
        drawn in addition to the force; trigger_force: the force alone.

    Returns
    -------
    View
        Where the directions are on one ring: force, pretravel and its parts over azimuth. Else
        these at several polar angles, over the polar angle, and the pretravel as a body. The
        sensing distance is drawn over the polar angle at each azimuth, where these are few.

    References
    ----------
    Rodrigues 2021, Figures 4.7 to 4.16.
    """
    title = title or f"Prediction, model {trigger.model}"
    polar, azimuth = angles_deg(trigger.directions)
    polar, azimuth = np.round(polar, 6), np.round(azimuth, 6)
    around = levels_around(polar, azimuth)
    shown = [("trigger force", "N", trigger.force)]
    if quantity != "trigger_force":
        shown.append(values_of(trigger, quantity))
    charts: list[Chart] = []
    if len(around):
        charts = [_around_chart(*one, trigger, polar, around) for one in shown]
    with_parts = quantity == "pretravel"
    if len(np.unique(polar)) > 2:
        body = _body(polar, azimuth, shown[-1])
        charts += [] if body is None else [body]
        each = quantity == "sensing_distance" and len(np.unique(azimuth)) <= _FEW_AZIMUTHS
        charts += [
            _at_each_azimuth(*one, polar, azimuth) if each else _over_polar(*one, polar)
            for one in shown
        ]
        charts += [_shares_over_polar(trigger, polar)] if with_parts else []
    elif len(around):
        if with_parts:
            charts.append(_shares_over_azimuth(trigger, polar, float(around[0])))
    else:
        charts.append(_mean_shares(trigger))
    return View(title, tuple(charts))


_FEW_AZIMUTHS = 8


def _at_each_azimuth(
    name: str, unit: str, values: FloatArray, polar: FloatArray, azimuth: FloatArray
) -> PlaneChart:
    """Values over the polar angle, a line for each azimuth (Rodrigues 2021, Figure 4.16)."""
    lines = []
    for index, turn in enumerate(np.unique(azimuth)):
        rows = np.flatnonzero(azimuth == turn)
        rows = rows[np.argsort(polar[rows])]
        lines.append(LineMark(polar[rows], values[rows], f"azimuth {turn:g}°", series(index)))
    title = f"{name} over the polar angle, at each azimuth"
    return PlaneChart(title, polar_axis(np.unique(polar)), Axis(name, unit, 0.0), tuple(lines))


def levels_around(polar: FloatArray, azimuth: FloatArray) -> FloatArray:
    """Polar angles that are drawn over azimuth: at most five, from the equator upwards. [deg]

    Parameters
    ----------
    polar, azimuth : (n,) float
        Of the directions. [deg]

    Returns
    -------
    (k,) float
        Those with at least three azimuths; none below 30° where there are others.

    >>> angles = np.repeat([0.0, 5.0, 45.0, 90.0], 4), np.tile([0.0, 90.0, 180.0, 270.0], 4)
    >>> levels_around(*angles).tolist()
    [90.0, 45.0]
    """
    levels = np.unique(polar)[::-1]
    several = [len(np.unique(azimuth[polar == level])) >= 3 and level > 0.0 for level in levels]
    levels = levels[several]
    flat = levels[levels >= _STEEP]
    levels = flat if len(flat) else levels
    chosen = np.linspace(0, max(len(levels) - 1, 0), min(len(levels), _LEVELS)).round()
    return np.asarray(levels[np.unique(chosen).astype(np.int64)])


def _around_chart(
    name: str, unit: str, values: FloatArray, trigger: Trigger, polar: FloatArray,
    levels: FloatArray,
) -> PolarChart:  # fmt: skip
    """Values over azimuth, one line for each polar angle, closed where it goes all around."""
    azimuth = azimuth_angle(trigger.directions)
    lines = []
    for index, level in enumerate(levels):
        rows = np.flatnonzero(polar == level)
        rows = rows[np.argsort(azimuth[rows])]
        if len(rows) > 2 and np.ptp(azimuth[rows]) > 230.0 * DEGREE:
            rows = np.append(rows, rows[0])
        lines.append(LineMark(azimuth[rows], values[rows], f"polar {level:g}°", series(index),
                              marked=len(rows) < 20))  # fmt: skip
    left_out = float(polar.min()) < float(levels.min())
    note = "Smaller polar angles: see the diagram over the polar angle." if left_out else ""
    return PolarChart(f"{name} over azimuth", Axis(name, unit, low=0.0), tuple(lines), note=note)


def _body(
    polar: FloatArray, azimuth: FloatArray, shown: tuple[str, str, FloatArray]
) -> Chart | None:
    """A quantity as a body, where the directions are a grid all around."""
    name, unit, values = shown
    levels, turns, body = values_on_grid(polar, azimuth, values)
    if len(turns) < 8 or np.diff(np.append(turns, turns[0] + 360.0)).max() > 46.0:
        return None
    return None if np.isnan(body).any() else body_chart(levels, turns, body, name, unit)


def by_level(values: FloatArray, polar: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Smallest, mean and largest value at each polar angle.

    Parameters
    ----------
    values, polar : (n,) float

    Returns
    -------
    levels : (k,) float
        The polar angles.
    values : (3, k) float

    >>> by_level(np.array([1.0, 3.0, 5.0]), np.array([90.0, 90.0, 45.0]))[1].tolist()
    [[5.0, 1.0], [5.0, 2.0], [5.0, 3.0]]
    """
    levels = np.unique(polar)
    rows = [values[polar == level] for level in levels]
    return levels, np.array([[f(row) for row in rows] for f in (np.min, np.mean, np.max)])


def _over_polar(name: str, unit: str, values: FloatArray, polar: FloatArray) -> PlaneChart:
    """Smallest, mean and largest value over the azimuths, at each polar angle."""
    levels, (low, mean, high) = by_level(values, polar)
    large = bool(unit == "N" and low.min() > 0.0 and high.max() > 6.0 * low.min())
    marks = (
        Area(levels, low, high, "range over the azimuths", "series1"),
        LineMark(levels, mean, "mean over the azimuths", "series1"),
    )
    axis = Axis(name, unit, None if large else 0.0, logarithmic=large)
    return PlaneChart(f"{name} over the polar angle", polar_axis(levels), axis, marks)


def polar_axis(levels: FloatArray) -> Axis:
    """The polar angle, with a number every 15° of those that there are.

    Parameters
    ----------
    levels : (k,) float
        The polar angles that are drawn, from the smallest to the largest. [deg]
    """
    ticks = tuple(float(t) for t in np.arange(0.0, 181.0, 15.0) if levels[0] <= t <= levels[-1])
    return Axis("polar angle (0° = from above, 90° = wall)", "°", ticks=ticks)


def _names(trigger: Trigger) -> list[str]:
    """The contributions of elastic parts, the largest first."""
    return sorted(trigger.shares, key=lambda name: -float(np.mean(trigger.shares[name])))


def _shares_over_polar(trigger: Trigger, polar: FloatArray) -> PlaneChart:
    levels = np.unique(polar)
    shares = {name: by_level(trigger.shares[name], polar)[1][1] for name in _names(trigger)}
    return _stacked(shares, levels, polar_axis(levels), "contributions, mean over the azimuths")


def _shares_over_azimuth(trigger: Trigger, polar: FloatArray, level: float) -> PlaneChart:
    rows = np.flatnonzero(polar == level)
    azimuth = angles_deg(trigger.directions[rows])[1]
    order = np.argsort(azimuth)
    shares = {name: trigger.shares[name][rows[order]] for name in _names(trigger)}
    return _stacked(shares, azimuth[order], azimuth_axis(), f"contributions at polar {level:g}°")


def _stacked(shares: dict[str, FloatArray], x: FloatArray, axis: Axis, title: str) -> PlaneChart:
    """Shares above each other; their sum is the pretravel."""
    marks: list[Mark] = []
    below = np.zeros(len(x))
    for index, (name, share) in enumerate(shares.items()):
        above = below + share / MICROMETRE
        marks.append(Area(x, below, above, name.replace("_", " "), series(index), 0.6))
        below = above
    marks.append(LineMark(x, below, "pretravel", "ink"))
    return PlaneChart(title, axis, Axis("pretravel", "µm", low=0.0), tuple(marks))


def _mean_shares(trigger: Trigger) -> PlaneChart:
    names = _names(trigger)
    mean = np.array([float(np.mean(trigger.shares[name])) / MICROMETRE for name in names])
    bars = Bars(np.arange(len(names), dtype=np.float64), mean, horizontal=True,
                texts=tuple(f"{number_text(value)} µm" for value in mean))  # fmt: skip
    words = tuple(name.replace("_", " ") for name in names)
    return PlaneChart("contributions to the pretravel", Axis("mean pretravel", "µm", low=0.0),
                      Axis("", categories=words), (bars,))  # fmt: skip
