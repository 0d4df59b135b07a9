"""Report and pictures of a prediction: trigger force and pretravel of a described probe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.probe.description import Probe
from pretravel.report.document import Column, Document, KeyFigure, Picture, Span, Table
from pretravel.report.formatting import decimals, number_text, value_text
from pretravel.report.probe_report import plot_probe
from pretravel.report.style import COLOURS, legend_below, new_figure, polar_axes
from pretravel.trigger.predict import Trigger
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def prediction_document(trigger: Trigger, probe: Probe) -> Document:
    """The report of a prediction.

    Parameters
    ----------
    trigger : Trigger
    probe : Probe
        That the prediction is of.

    Returns
    -------
    Document
    """
    title = f"{probe.name}, model {trigger.model}"
    lowest, highest = int(np.argmin(trigger.pretravel)), int(np.argmax(trigger.pretravel))
    where = f"{_direction(trigger, lowest)}; {_direction(trigger, highest)}; in the probe's frame"
    return Document(
        title=title,
        verdict=f"{title}, {len(trigger.force)} directions",
        figures=(
            KeyFigure("trigger force", Span.of(trigger.force), "N", decimals(3)),
            KeyFigure("sensing distance", Span.of(trigger.sensing_distance / MICROMETRE), "µm"),
            KeyFigure("pretravel", Span.of(trigger.pretravel / MICROMETRE), "µm", remark=where),
        ),
        tables=(shares_table(trigger),),
        pictures=(
            Picture("Force, pretravel, its parts", lambda: plot_prediction(trigger, title)),
            Picture("The probe", lambda: plot_probe(probe)),
        ),
    )  # fmt: skip


def shares_table(trigger: Trigger) -> Table:
    """The mean contribution of each elastic part to the pretravel, the largest first."""
    total = trigger.pretravel.mean()
    mean = {name.replace("_", " "): share.mean() for name, share in trigger.shares.items()}
    names = sorted(mean, key=lambda name: -float(mean[name]))
    one = len(trigger.force) == 1
    return Table(
        (
            Column.of("part", names),
            Column.of(
                "pretravel" if one else "mean pretravel",
                [float(mean[name]) / MICROMETRE for name in names],
                "µm",
                decimals(3),
            ),
            Column.of(
                "share", [100.0 * float(mean[name] / total) for name in names], "%", decimals(0)
            ),
        ),
        title="Elastic parts of the pretravel",
        detail=True,
    )


def _direction(trigger: Trigger, row: int) -> str:
    polar = float(polar_angle(trigger.directions)[row]) / DEGREE
    azimuth = float(azimuth_angle(trigger.directions)[row]) / DEGREE
    return (
        f"polar {value_text(polar, '°', decimals(0))}, "
        f"azimuth {value_text(azimuth, '°', decimals(0))}"
    )


def plot_prediction(trigger: Trigger, title: str = "") -> Figure:
    """Plot trigger force and pretravel against azimuth, and the shares of the compliances.

    There is one line for each polar angle. Angles are in the probe's frame.

    Parameters
    ----------
    trigger : Trigger
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    title = title or f"Prediction, model {trigger.model}"
    figure = new_figure(13.0, 4.8, f"{title}; azimuth in the probe's frame")
    polar = np.round(polar_angle(trigger.directions) / DEGREE, 6)
    levels = np.unique(polar)[::-1]
    around = levels[levels > 0.0]  # at the pole there is no azimuth to draw over
    shown = around[np.unique(np.linspace(0, len(around) - 1, min(len(around), 6)).astype(int))]
    at_pole = np.flatnonzero(polar == 0.0)[:1]
    for place, (name, values) in enumerate(
        (
            ("trigger force / N", trigger.force),
            ("pretravel / µm", trigger.pretravel / MICROMETRE),
        ),
        start=1,
    ):
        name += "".join(f" (at the pole {number_text(float(values[row]))})" for row in at_pole)
        axes = polar_axes(figure, 1, 3, place, name)
        _draw_levels(axes, trigger, values, polar, shown)
        axes.set_ylim(bottom=0.0, top=None if len(shown) else 1.0)
        if place == 1 and len(shown):
            legend_below(axes, 3)
    _draw_shares(figure.add_subplot(1, 3, 3), trigger, polar, levels)
    return figure


def _draw_levels(
    axes: Axes, trigger: Trigger, values: FloatArray, polar: FloatArray, shown: FloatArray
) -> None:
    """Values over azimuth, one line per polar angle, closed where it goes all around."""
    azimuth = azimuth_angle(trigger.directions)
    for colour, level in zip(COLOURS, shown, strict=False):
        rows = np.flatnonzero(polar == level)
        rows = rows[np.argsort(azimuth[rows])]
        if len(rows) > 2 and np.ptp(azimuth[rows]) > 300.0 * DEGREE:
            rows = np.append(rows, rows[0])
        style: dict[str, Any] = {
            "color": colour,
            "lw": 1.6,
            "marker": "." if len(rows) < 20 else "",
        }
        axes.plot(azimuth[rows], values[rows], label=f"polar {level:g}°", **style)


def _draw_shares(axes: Axes, trigger: Trigger, polar: FloatArray, levels: FloatArray) -> None:
    """Mean contribution of each elastic part, over the polar angle where there are several."""
    mean = {
        name: np.array([share[polar == level].mean() for level in levels]) / MICROMETRE
        for name, share in trigger.shares.items()
    }
    if len(levels) > 1:
        labels = [name.replace("_", " ") for name in mean]
        axes.stackplot(levels, *mean.values(), labels=labels, colors=COLOURS)
        axes.set_xlabel("polar angle / °")
        axes.legend(fontsize=8, loc="upper left")
    else:
        axes.bar(
            [name.replace("_", "\n") for name in mean],
            [values[0] for values in mean.values()],
            color=COLOURS[: len(mean)],
        )
    axes.set_ylabel("mean pretravel / µm")
    axes.set_title("elastic parts", fontsize=11)
