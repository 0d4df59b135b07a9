"""Report and picture of touches with friction at the seats: hysteresis and drift."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.report.document import Column, Document, KeyFigure, Picture, Span, Table
from pretravel.report.formatting import decimals, significant
from pretravel.report.style import COLOURS, new_figure
from pretravel.trigger.friction import FrictionCycle
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def friction_document(cycle: FrictionCycle, probe_name: str) -> Document:
    """The report of repeated touches with friction at the seats.

    Parameters
    ----------
    cycle : FrictionCycle
    probe_name : str

    Returns
    -------
    Document
    """
    touches = cycle.trigger_force.shape[1]
    title = f"{probe_name}, friction {cycle.friction:g}"
    quantities = _quantities(cycle)
    return Document(
        title=title,
        verdict=f"{probe_name}, seats with friction {cycle.friction:g}, {touches} touches in "
        f"{len(cycle.directions)} directions",
        figures=tuple(
            KeyFigure(f"{name}, touch {touch}", Span.of(values), unit, decimals(3))
            for name, touch, values, unit in quantities
        ),
        tables=(_direction_table(cycle, quantities),),
        pictures=(
            Picture("Touch and return, hysteresis and drift", lambda: plot_friction(cycle, title)),
        ),
    )


def _quantities(cycle: FrictionCycle) -> list[tuple[str, int, FloatArray, str]]:
    """Name, touch, values over the directions and unit, for the first touch and the last."""
    last = cycle.trigger_force.shape[1]
    return [
        ("force", 1, cycle.trigger_force[:, 0], "N"),
        ("force", last, cycle.trigger_force[:, last - 1], "N"),
        ("hysteresis", last, cycle.hysteresis[:, last - 1] / MICROMETRE, "µm"),
        ("drift", 1, cycle.zero_drift[:, 0] / MICROMETRE, "µm"),
        ("drift", last, cycle.zero_drift[:, last - 1] / MICROMETRE, "µm"),
        ("reseat", last, cycle.reseat_error[:, last - 1] / MICROMETRE, "µm"),
    ]


def _direction_table(
    cycle: FrictionCycle, quantities: list[tuple[str, int, FloatArray, str]]
) -> Table:
    azimuth = np.mod(azimuth_angle(cycle.directions) / DEGREE, 360.0)
    return Table(
        (
            Column.of("polar", polar_angle(cycle.directions) / DEGREE, "°", significant(6)),
            Column.of("azimuth", azimuth, "°", significant(6)),
            *(
                Column.of(f"{name} {touch}", values, unit, decimals(3))
                for name, touch, values, unit in quantities
            ),
        ),
        title=f"Touch 1 and touch {cycle.trigger_force.shape[1]} in each direction",
        explanation="force: on the tip when the first seat opens; hysteresis: deflection at "
        "opening less that at reseating; drift: where the tip then rests, along the normal, "
        "against the start; reseat: distance from the rest position of the touch before.",
        detail=True,
    )


def plot_friction(cycle: FrictionCycle, title: str = "") -> Figure:
    """Force over deflection, and hysteresis and drift in each direction.

    Parameters
    ----------
    cycle : FrictionCycle
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(12.0, 5.2, title)
    loops, bars = figure.subplots(1, 2, width_ratios=[1.2, 1.0])
    _draw_loops(loops, cycle)
    _draw_bars(bars, cycle)
    return figure


def _draw_loops(axes: Axes, cycle: FrictionCycle) -> None:
    """Force over deflection in up to four directions that symmetry does not make alike."""
    azimuth = np.mod(azimuth_angle(cycle.directions) / DEGREE, 360.0)
    polar = polar_angle(cycle.directions) / DEGREE
    _, different = np.unique(np.round(cycle.trigger_force[:, -1], 4), return_index=True)
    shown = different[np.unique(np.linspace(0, len(different) - 1, 4).astype(int))]
    for colour, row in zip(COLOURS, shown, strict=False):
        axes.plot(
            cycle.deflection[row] / MICROMETRE,
            cycle.force[row],
            lw=1.2,
            color=colour,
            label=f"polar {polar[row]:.0f}°, azimuth {azimuth[row]:.0f}°",
        )
        opens = cycle.trigger_deflection[row] / MICROMETRE
        axes.plot(opens, cycle.trigger_force[row], "o", ms=4, color=colour)
    axes.set_xlabel("deflection along the normal / µm")
    axes.set_ylabel("force on the tip / N")
    axes.set_title("touch and return; dots: a seat opens", fontsize=10)
    axes.legend(fontsize=8)


def _draw_bars(axes: Axes, cycle: FrictionCycle) -> None:
    """Hysteresis and drift in each direction."""
    azimuth = np.mod(azimuth_angle(cycle.directions) / DEGREE, 360.0)
    polar = polar_angle(cycle.directions) / DEGREE
    rows, last = np.arange(len(azimuth)), cycle.trigger_force.shape[1] - 1
    groups = (
        (f"trigger hysteresis, touch {last + 1}", cycle.hysteresis[:, last]),
        ("zero drift after touch 1", cycle.zero_drift[:, 0]),
        (f"zero drift after touch {last + 1}", cycle.zero_drift[:, last]),
    )
    for place, (label, values) in enumerate(groups):
        at = rows + 0.27 * (place - 1)
        axes.bar(at, values / MICROMETRE, 0.27, color=COLOURS[place], label=label)
    labels = [f"{p:.0f}/{a:.0f}" for p, a in zip(polar, azimuth, strict=True)]
    axes.set_xticks(rows, labels, rotation=90, fontsize=7)
    axes.set_xlabel("polar / azimuth in degrees")
    axes.set_ylabel("µm")
    axes.axhline(0.0, color="k", lw=0.6)
    axes.margins(y=0.25)
    axes.legend(fontsize=8)
