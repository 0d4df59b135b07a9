"""What a picture shows, as frozen values: computed once, drawn for files, pages and the workbench.

A `View` has charts side by side. A chart is a plane (`PlaneChart`), polar (`PolarChart`), a map
seen along the probe's axis (`TopView`) or in space (`SpaceChart`); it contains marks. Numbers are
in the unit that the axis names. `chart_files` draws with matplotlib, `chart_plotly` makes Plotly's
JSON.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray
from pretravel.show.chart_marks import (
    Area,
    Dots,
    FrozenArrays,
    LineMark,
    Mark,
    Rule,
    SpaceArrow,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    SpaceNotes,
    SpacePoints,
)

FrameName: TypeAlias = Literal["probe", "machine", "part", ""]


@dataclass(frozen=True)
class Axis:
    """An axis with its unit.

    Attributes
    ----------
    label, unit : str
    low, high : float or None
        Ends; None: from the data.
    categories : tuple of str
        Names at the places 0, 1, … instead of numbers.
    logarithmic : bool
    ticks : tuple of float
        Where numbers stand; none: chosen by the program that draws.
    tick_names : tuple of str
        Words at the ticks, such as dates, instead of numbers.

    >>> Axis("pretravel", "µm").text
    'pretravel / µm'
    """

    label: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    categories: tuple[str, ...] = ()
    logarithmic: bool = False
    ticks: tuple[float, ...] = ()
    tick_names: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """Label and unit."""
        return f"{self.label} / {self.unit}" if self.unit else self.label


@dataclass(frozen=True)
class Scale:
    """What the colours of marks mean.

    Attributes
    ----------
    label, unit : str
    low, high : float
    signed : bool
        Whether zero is in the middle, in white.
    logarithmic : bool
        Whether equal steps of colour are equal ratios; `low` is above zero then.
    """

    label: str
    unit: str
    low: float
    high: float
    signed: bool = False
    logarithmic: bool = False

    @staticmethod
    def of(label: str, unit: str, values: npt.ArrayLike, *, signed: bool = False) -> Scale:
        """A scale for values, which does not make small differences look large.

        Positive values that differ by less than half of the largest begin at zero.

        >>> Scale.of("u", "µm", [0.33, 0.4]).low, Scale.of("pretravel", "µm", [4.0, 10.0]).low
        (0.0, 4.0)
        """
        array = np.asarray(values, dtype=np.float64)
        array = array[np.isfinite(array)]
        if not len(array):
            return Scale(label, unit, 0.0, 1.0, signed)
        low, high = float(array.min()), float(array.max())
        if signed:
            high = max(abs(low), abs(high)) or 1.0
            return Scale(label, unit, -high, high, signed)
        if low >= 0.0 and high - low < 0.5 * high:
            low = 0.0
        return Scale(label, unit, low, high if high > low else low + 1.0, signed)

    @property
    def text(self) -> str:
        """Label and unit."""
        return f"{self.label} / {self.unit}" if self.unit else self.label


@dataclass(frozen=True)
class Moment:
    """A plane chart at another time: marks of the same kinds in the same order, other values.

    Attributes
    ----------
    name : str
        Next to the slider.
    marks : tuple of Mark
    """

    name: str
    marks: tuple[Mark, ...]


@dataclass(frozen=True)
class PlaneChart:
    """Marks over two straight axes.

    Attributes
    ----------
    title : str
    x, y : Axis
    marks : tuple of Mark
        Later ones are drawn above earlier ones.
    scale : Scale or None
        Of points with values.
    equal : bool
        Whether a unit is equally long along both axes.
    note : str
        Below the chart.
    moments : tuple of Moment
        Pages show them one after the other, by a slider. The first one has the marks of the chart;
        files show it alone.
    """

    title: str
    x: Axis
    y: Axis
    marks: tuple[Mark, ...]
    scale: Scale | None = None
    equal: bool = False
    note: str = ""
    moments: tuple[Moment, ...] = ()


@dataclass(frozen=True)
class PolarChart:
    """Marks over azimuth; +X is to the right, +Y upwards, as seen from the spindle.

    Attributes
    ----------
    title : str
    radius : Axis
    marks : tuple of LineMark, Dots, Area or Rule
    frame : str
        That the azimuth is in.
    scale : Scale or None
    note : str
    directions : pair of str
        Names of the directions to the right and upwards.
    """

    title: str
    radius: Axis
    marks: tuple[LineMark | Dots | Area | Rule, ...]
    frame: FrameName = "probe"
    scale: Scale | None = None
    note: str = ""
    directions: tuple[str, str] = ("+X", "+Y")


@dataclass(frozen=True, eq=False)
class TopView(FrozenArrays):
    """A quantity over directions: azimuth around, polar angle outwards, seen from the spindle.

    Attributes
    ----------
    title : str
    polar_deg : (p,) float
        Increasing.
    azimuth_deg : (a,) float
        Increasing, below 360°, all around.
    values : (p, a) float
        Not a number where there is none.
    scale : Scale
    frame : str
    node_polar_deg, node_azimuth_deg : (n,) float or None
        Directions that were touched.
    node_name : str
        What they are, for the legend.
    node_labels : tuple of str
        What a page shows of each when it is pointed at.
    numbered : bool
        Whether the nodes have the numbers 1, 2, … next to them.
    note : str
    """

    title: str
    polar_deg: FloatArray
    azimuth_deg: FloatArray
    values: FloatArray
    scale: Scale
    frame: FrameName = "probe"
    node_polar_deg: FloatArray | None = None
    node_azimuth_deg: FloatArray | None = None
    node_name: str = "touched"
    node_labels: tuple[str, ...] = ()
    numbered: bool = False
    note: str = ""


@dataclass(frozen=True)
class SpaceChart:
    """Marks in space; a unit is equally long along all axes.

    Attributes
    ----------
    title : str
    marks : tuple of SpaceMark
    frame : str
        That x, y and z are of.
    unit : str
        Of the axes.
    scale : Scale or None
    elevation, azimuth : float
        Where it is looked at from. [deg]
    note : str
    bare : bool
        Without axes: the body fills the picture, and a file leaves out what the body hides.
    """

    title: str
    marks: tuple[SpaceMark, ...]
    frame: FrameName = "machine"
    unit: str = "mm"
    scale: Scale | None = None
    elevation: float = 25.0
    azimuth: float = -55.0
    note: str = ""
    bare: bool = False


COMPASS = ("+X", "45°", "+Y", "135°", "-X", "225°", "-Y", "315°")
"""Names of the directions around, from 0° in steps of 45°."""


def compass_of(right: str, up: str) -> tuple[str, ...]:
    """Names of the directions around, from 0° in steps of 45°, from those at 0° and at 90°.

    >>> compass_of("+X", "-Z")
    ('+X', '45°', '-Z', '135°', '-X', '225°', '+Z', '315°')
    """
    other = str.maketrans("+-", "-+")
    return (right, "45°", up, "135°", right.translate(other), "225°", up.translate(other), "315°")


def rings_to(largest: float) -> list[float]:
    """The polar angles that a view from above names. [deg]

    >>> rings_to(100.0)
    [30.0, 60.0, 90.0, 100.0]
    """
    return [ring for ring in (30.0, 60.0, 90.0, 120.0, 150.0) if ring < largest - 5.0] + [
        round(largest, 1)
    ]


Chart: TypeAlias = PlaneChart | PolarChart | TopView | SpaceChart


def title_and_frame(chart: Chart) -> str:
    """The title of a chart, and below it the frame that its directions are in."""
    frame = "" if isinstance(chart, PlaneChart) else chart.frame
    return f"{chart.title}\nframe of the {frame}" if frame else chart.title


@dataclass(frozen=True)
class View:
    """Charts side by side.

    Attributes
    ----------
    title : str
    charts : tuple of Chart
    columns : int
        Charts in a row of a file.
    """

    title: str
    charts: tuple[Chart, ...]
    columns: int = 3

    @property
    def is_bare(self) -> bool:
        """A body alone, which fills the width of a page."""
        first = self.charts[0] if len(self.charts) == 1 else None
        return isinstance(first, SpaceChart) and first.bare


def corners_of(chart: SpaceChart) -> FloatArray:
    """All points of the marks of a chart in space, (n, 3)."""
    parts = [np.empty((0, 3))]
    for mark in chart.marks:
        match mark:
            case SpacePoints() | SpaceNotes():
                parts.append(mark.positions)
            case SpaceLines():
                parts += [mark.starts, mark.ends]
            case SpaceMesh():
                parts.append(mark.vertices)
            case SpaceArrow():
                parts += [mark.start[None], (mark.start + mark.vector)[None]]
    points = np.vstack(parts)
    points = points[np.all(np.isfinite(points), axis=1)]
    return points if len(points) else np.zeros((1, 3))


def box_of(chart: SpaceChart) -> tuple[FloatArray, FloatArray]:
    """Middle and sides of the box around all marks; no side is below 15 % of the longest.

    >>> low, high = np.zeros((1, 3)), np.array([[2.0, 1.0, 0.0]])
    >>> middle, sides = box_of(SpaceChart("", (SpaceLines(low, high),)))
    >>> middle.tolist(), sides.tolist()
    ([1.0, 0.5, 0.0], [2.0, 1.0, 0.3])
    """
    points = corners_of(chart)
    low, high = points.min(axis=0), points.max(axis=0)
    sides = high - low
    return 0.5 * (low + high), np.maximum(sides, 0.15 * max(float(sides.max()), 1e-9))
