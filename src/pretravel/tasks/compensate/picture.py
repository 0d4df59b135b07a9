"""Pictures of compensated points and of simulated touches, in space."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, Placement, azimuth_angle, polar_angle
from pretravel.measurement import Points
from pretravel.show import (
    Axis,
    Colour,
    Dots,
    FrameName,
    PolarChart,
    Scale,
    SpaceChart,
    SpaceLines,
    SpaceMark,
    SpacePoints,
    View,
    body_marks,
    magnification,
    whiskers,
)
from pretravel.surface import Part, Surface
from pretravel.touches import Touches


def points_view(
    points: Points,
    title: str = "",
    *,
    nominal: Surface | Part | None = None,
    placement: Placement | None = None,
) -> View:
    """Points before and after compensation on their part, pretravel and uncertainty.

    Parameters
    ----------
    points : Points
    title : str
    nominal : Surface, Part or None
        The faces of a CAD file are shown below the points.
    placement : Placement or None
        Of the part in the machine, where the points are in the frame of the machine.
    """
    frame: FrameName = "part" if placement is None else "machine"
    body = body_marks(nominal, placement)
    edges = body[1:]
    labels = _labels(points)
    u = points.standard_uncertainty / MICROMETRE
    pretravel = points.pretravel / MICROMETRE
    charts = []
    if points.deviation is not None:
        charts += _before_and_after(points, body, frame)
    for name, values in (("pretravel", pretravel), ("standard uncertainty u", u)):
        scale = Scale.of(name, "µm", values)
        dots = SpacePoints(points.positions, values=values, size=6.0, labels=labels)
        charts.append(SpaceChart(name, (*edges, dots), frame, scale=scale))
    return View(title or "Compensated points", tuple(charts), columns=2)


def deviation_before(points: Points) -> FloatArray | None:
    """Distance of the points without compensation from the nominal, along the normal.

    Returns
    -------
    (n,) float or None
        None: the nominal or the points without compensation are not known. [mm]
    """
    if points.deviation is None or points.uncompensated is None:
        return None
    moved = np.sum((points.uncompensated - points.positions) * points.normals, axis=1)
    return np.asarray(points.deviation + moved)


def _labels(points: Points) -> tuple[str, ...]:
    """What is shown of each point: its name and its numbers."""
    names = points.labels or tuple(f"point {row + 1}" for row in range(len(points)))
    before = deviation_before(points)
    words = []
    for row, name in enumerate(names):
        text = name or f"point {row + 1}"
        if before is not None and points.deviation is not None:
            text += f"\nbefore {before[row] / MICROMETRE:+.2f} µm, "
            text += f"after {points.deviation[row] / MICROMETRE:+.2f} µm"
        text += f"\npretravel {points.pretravel[row] / MICROMETRE:.2f} µm, "
        words.append(text + f"u {points.standard_uncertainty[row] / MICROMETRE:.2f} µm")
    return tuple(words)


def _before_and_after(
    points: Points, body: tuple[SpaceMark, ...], frame: FrameName
) -> list[SpaceChart]:
    """Deviations as whiskers along the normals, with one magnification and one scale of colours."""
    after, before = points.deviation, deviation_before(points)
    assert after is not None
    foot = points.positions - after[:, None] * points.normals
    both = after if before is None else np.concatenate([before, after])
    factor = magnification(foot, both)
    scale = Scale.of("deviation", "µm", both / MICROMETRE, signed=True)
    charts = []
    for name, deviation in (("before", before), ("after", after)):
        if deviation is None:
            continue
        colour: Colour = "before" if name == "before" else "after"
        starts, ends = whiskers(foot, points.normals, factor * deviation)
        words = f"deviation {name}, magnified {factor:g} times"
        of_whiskers = SpaceLines(starts, ends, words, colour, 1.8)
        dots = SpacePoints(ends, values=deviation / MICROMETRE, size=5.0, labels=_labels(points))
        charts.append(
            SpaceChart(
                f"{name}: {_range_text(deviation)}",
                (*body, of_whiskers, dots),
                frame,
                scale=scale,
                note="deviation from the nominal, along the normal",
            )
        )
    return charts


def _range_text(deviation: FloatArray) -> str:
    low, high = float(deviation.min()) / MICROMETRE, float(deviation.max()) / MICROMETRE
    return f"{low:.1f} to {high:.1f} µm"


def touches_view(
    touches: Touches,
    travel: FloatArray,
    title: str = "",
    surface: Surface | Part | None = None,
) -> View:
    """Simulated touches: where they are, and their travel over the azimuth.

    Parameters
    ----------
    touches : Touches
    travel : (n,) float
        From first contact to the latched point. [mm]
    title : str
    surface : Surface, Part or None
        The faces of a CAD file are shown below the touches.
    """
    length = travel / MICROMETRE
    labels = tuple(
        name or f"touch {row + 1}"
        for row, name in enumerate(touches.labels or ("",) * len(touches))
    )
    place = SpaceChart(
        "travel since first contact",
        (
            *body_marks(surface),
            SpacePoints(touches.positions, values=length, size=6.0, labels=labels),
        ),
        "part",
        scale=Scale.of("travel", "µm", length),
    )
    polar = polar_angle(touches.normals) / DEGREE
    around = PolarChart(
        "travel over the azimuth of the normal",
        Axis("travel", "µm", 0.0 if length.min() >= 0.0 else None),
        (Dots(azimuth_angle(touches.normals), length, values=polar, labels=labels),),
        "part",
        Scale("polar angle of the normal", "°", 0.0, max(float(polar.max()), 90.0)),
    )
    return View(title or "Simulated touches", (place, around), columns=2)
