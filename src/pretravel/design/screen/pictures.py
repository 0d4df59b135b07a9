"""Pictures of two designs at a chosen polar angle, which follow a slider."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.design.tasks.compare.designs_report import A, B, results_of
from pretravel.design.tasks.predict.task import PredictedProbe
from pretravel.prediction import Trigger
from pretravel.show import (
    Axis,
    Bars,
    Colour,
    Dots,
    LineMark,
    PlaneChart,
    PlotlyFigure,
    PolarChart,
    number_text,
    plotly_figure,
    value_text,
)

DESIGN = "B: your design"


@dataclass(frozen=True, eq=False)
class _Shown:
    name: str
    predicted: PredictedProbe
    colour: Colour
    dashed: bool = False
    first_ring: int | None = None
    """Of every second direction, where there are rings instead of a line."""


def design_figures(
    other: tuple[str, PredictedProbe],
    design: PredictedProbe,
    elements: tuple[PredictedProbe, PredictedProbe] | None = None,
    polar_deg: float = 90.0,
) -> Mapping[str, PlotlyFigure]:
    """Force and pretravel around, and the parts of the pretravel, as Plotly's figures.

    Parameters
    ----------
    other : (str, PredictedProbe)
        With its name for legends.
    design : PredictedProbe
    elements : two PredictedProbes or None
        The other one and the design by finite elements.
    polar_deg : float
        Of the specification of all predictions.

    Returns
    -------
    mapping of str to dict
        force, pretravel, parts.
    """
    shown = [
        _Shown(*other, A),
        _Shown(DESIGN, design, B, dashed=True),
    ]
    if elements is not None:
        # In turns: where both designs are the same, the rings of both are seen.
        shown += [
            _Shown(f"{letter} by finite elements", predicted, colour, first_ring=first)
            for first, (letter, predicted, colour) in enumerate(
                zip("AB", elements, (A, B), strict=True)
            )
        ]
    return {
        "force": plotly_figure(_around("Trigger force", "N", shown, polar_deg)),
        "pretravel": plotly_figure(_around("Pretravel", "µm", shown, polar_deg)),
        "parts": plotly_figure(_parts(shown[:2], polar_deg)),
    }


def _rows(predicted: PredictedProbe, polar_deg: float) -> slice:
    """The directions of one polar angle."""
    polar = np.asarray(predicted.task.polar.degrees)
    count = len(np.asarray(predicted.task.azimuth.degrees))
    level = int(np.argmin(np.abs(polar - polar_deg)))
    return slice(level * count, (level + 1) * count)


def _values(trigger: Trigger, unit: str) -> FloatArray:
    return trigger.force if unit == "N" else trigger.pretravel / MICROMETRE


def _around(name: str, unit: str, shown: Sequence[_Shown], polar_deg: float) -> PolarChart:
    marks: list[LineMark | Dots] = []
    for one in shown:
        azimuth = np.radians(np.asarray(one.predicted.task.azimuth.degrees))
        values = _values(one.predicted.trigger, unit)[_rows(one.predicted, polar_deg)]
        if one.first_ring is not None:
            rings = slice(one.first_ring, None, 2)
            marks.append(Dots(azimuth[rings], values[rings], one.name, one.colour, symbol="ring"))
            continue
        closed = np.append(azimuth, azimuth[0]), np.append(values, values[0])
        marks.append(LineMark(*closed, one.name, one.colour, width=2.0, dashed=one.dashed))
    # Stated, so that it follows a slider: Plotly keeps a range that it has chosen itself.
    highest = max(
        float(_values(one.predicted.trigger, unit)[_rows(one.predicted, polar_deg)].max())
        for one in shown
    )
    title = f"{name} around, polar angle {polar_deg:g}°"
    return PolarChart(title, Axis(name.lower(), unit, 0.0, 1.05 * highest), tuple(marks))


def _parts(shown: Sequence[_Shown], polar_deg: float) -> PlaneChart:
    """Mean contribution of each elastic part at a polar angle."""
    # A contact that opens is a part of one design, perhaps, and not of the other.
    names = [*dict.fromkeys(name for one in shown for name in one.predicted.trigger.shares)]
    marks = []
    for offset, one in zip((-0.2, 0.2), shown, strict=True):
        rows = _rows(one.predicted, polar_deg)
        shares, none = one.predicted.trigger.shares, np.zeros(len(one.predicted.trigger.force))
        values = np.array([shares.get(name, none)[rows].mean() for name in names]) / MICROMETRE
        marks.append(
            Bars(
                np.arange(float(len(names))) + offset,
                values,
                one.name,
                one.colour,
                width=0.36,
                horizontal=True,
                texts=tuple(number_text(value) for value in values.tolist()),
            )
        )
    return PlaneChart(
        f"Contributions to the pretravel, polar angle {polar_deg:g}°",
        Axis("mean pretravel", "µm", low=0.0),
        Axis("", categories=tuple(name.replace("_", " ") for name in names)),
        tuple(marks),
    )


def change_in_words(other: PredictedProbe, design: PredictedProbe) -> tuple[str, ...]:
    """Mean pretravel and largest force on walls, of one design and the other, in a line each."""
    before, after = results_of(other.trigger), results_of(design.trigger)
    return tuple(
        f"{words}: {number_text(before[name])} → {value_text(after[name], unit)}"
        for words, name, unit in (
            ("Pretravel", "pretravel on walls, mean / µm", "µm"),
            ("Trigger force", "trigger force on walls, largest / N", "N"),
        )
    )
