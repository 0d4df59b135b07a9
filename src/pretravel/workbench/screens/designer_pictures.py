"""Pictures and figures of two designs beside each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.jobs.predict import PredictedProbe
from pretravel.report.chart import Axis, Bars, Dots, LineMark, PlaneChart, PolarChart
from pretravel.report.chart_plotly import PlotlyFigure, plotly_figure
from pretravel.report.colours import Colour
from pretravel.report.document import Column, Table
from pretravel.report.formatting import (
    decimals,
    number_text,
    signed_decimals,
    significant,
    value_text,
)
from pretravel.trigger.predict import Trigger
from pretravel.units import MICROMETRE

DESIGN, ELEMENTS = "B: your design", "B by finite elements"


@dataclass(frozen=True, eq=False)
class _Shown:
    name: str
    predicted: PredictedProbe
    colour: Colour
    dashed: bool = False
    dots: bool = False


def design_figures(
    other: tuple[str, PredictedProbe],
    design: PredictedProbe,
    elements: PredictedProbe | None = None,
    polar_deg: float = 90.0,
) -> Mapping[str, PlotlyFigure]:
    """Force and pretravel around, and the parts of the pretravel, as Plotly's figures.

    Parameters
    ----------
    other : (str, PredictedProbe)
        With its name for legends.
    design : PredictedProbe
    elements : PredictedProbe or None
        The design by finite elements.
    polar_deg : float
        Of the wish of all predictions.

    Returns
    -------
    mapping of str to dict
        force, pretravel, parts.
    """
    shown = [
        _Shown(*other, "series2", dashed=True),
        _Shown(DESIGN, design, "series1"),
    ]
    if elements is not None:
        shown.append(_Shown(ELEMENTS, elements, "series3", dots=True))
    return {
        "force": plotly_figure(_around("Trigger force", "N", shown, polar_deg)),
        "pretravel": plotly_figure(_around("Pretravel", "µm", shown, polar_deg)),
        "parts": plotly_figure(_parts(shown[:2], polar_deg)),
    }


def _rows(predicted: PredictedProbe, polar_deg: float) -> slice:
    """The directions of one polar angle."""
    polar = np.asarray(predicted.wish.polar_deg)
    count = len(np.asarray(predicted.wish.azimuth_deg))
    level = int(np.argmin(np.abs(polar - polar_deg)))
    return slice(level * count, (level + 1) * count)


def _values(trigger: Trigger, unit: str) -> FloatArray:
    return trigger.force if unit == "N" else trigger.pretravel / MICROMETRE


def _around(name: str, unit: str, shown: Sequence[_Shown], polar_deg: float) -> PolarChart:
    marks: list[LineMark | Dots] = []
    for one in shown:
        azimuth = np.radians(np.asarray(one.predicted.wish.azimuth_deg))
        values = _values(one.predicted.trigger, unit)[_rows(one.predicted, polar_deg)]
        if one.dots:
            marks.append(Dots(azimuth[::2], values[::2], one.name, one.colour, symbol="ring"))
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
    names = list(shown[0].predicted.trigger.shares)
    marks = []
    for offset, one in zip((-0.2, 0.2), shown, strict=True):
        rows = _rows(one.predicted, polar_deg)
        shares = one.predicted.trigger.shares
        values = np.array([shares[name][rows].mean() for name in names]) / MICROMETRE
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
        f"Elastic parts of the pretravel, polar angle {polar_deg:g}°",
        Axis("mean pretravel", "µm", low=0.0),
        Axis("", categories=tuple(name.replace("_", " ") for name in names)),
        tuple(marks),
    )


def figures_table(other: PredictedProbe, design: PredictedProbe, polar_deg: float = 90.0) -> Table:
    """Key figures of two designs with their differences."""
    rows = []
    for name, unit, count in (
        ("stylus length", "mm", 1),
        ("lever", "mm", 1),
        ("preload", "N", 2),
        ("smallest trigger force", "N", 3),
        ("largest trigger force", "N", 3),
        ("mean pretravel", "µm", 2),
        ("largest less smallest pretravel", "µm", 2),
        ("stylus bending per newton", "µm/N", 2),
    ):
        a, b = (_figure(one, name, polar_deg) for one in (other, design))
        change = number_text(100.0 * (b / a - 1.0), signed_decimals(0)) + " %" if a else ""
        rows.append(
            (
                f"{name} / {unit}",
                number_text(a, decimals(count)),
                number_text(b, decimals(count)),
                number_text(b - a, signed_decimals(count)),
                change,
            )
        )
    names = ("quantity", "A", "B", "B − A", "change")
    return Table(
        tuple(map(Column.of, names, zip(*rows, strict=True))),
        title=f"Key figures at a polar angle of {number_text(polar_deg, significant(3))}°",
    )


def _figure(one: PredictedProbe, name: str, polar_deg: float) -> float:
    from pretravel.model.beam import bending_compliance

    rows = _rows(one, polar_deg)
    force = one.trigger.force[rows]
    pretravel = one.trigger.pretravel[rows] / MICROMETRE
    return {
        "stylus length": one.probe.stylus_length,
        "lever": one.probe.lever,
        "preload": one.probe.preload,
        "smallest trigger force": float(force.min()),
        "largest trigger force": float(force.max()),
        "mean pretravel": float(pretravel.mean()),
        "largest less smallest pretravel": float(np.ptp(pretravel)),
        "stylus bending per newton": float(bending_compliance(one.probe.stylus)) / MICROMETRE,
    }[name]


def change_in_words(
    other: PredictedProbe, design: PredictedProbe, polar_deg: float = 90.0
) -> tuple[str, ...]:
    """The change of pretravel and force from one design to the other, in a line each."""
    return tuple(
        f"{name}: {number_text(_figure(other, name, polar_deg), decimals(count))} → "
        f"{value_text(_figure(design, name, polar_deg), unit, decimals(count))}"
        for name, unit, count in (
            ("mean pretravel", "µm", 2),
            ("largest trigger force", "N", 3),
        )
    )
