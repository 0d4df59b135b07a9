"""Report and pictures of a calibration on a rig."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.laboratory.rig import RigTouch, RigTrace
from pretravel.laboratory.rig_calibration import DirectionPerformance, RigCalibration, Spread
from pretravel.laboratory.rig_left_out import left_out_sentences
from pretravel.report.budget_report import budget_table, expanded_figure
from pretravel.report.document import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Section,
    Span,
    Table,
)
from pretravel.report.formatting import decimals, number_text, significant
from pretravel.report.style import COLOURS, new_figure, polar_axes
from pretravel.uncertainty.gum import Budget
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BUDGET_TITLE = "Uncertainty of the mean pretravel of the direction touched least often"
_WIDEST_GAP = 65.0 * DEGREE


def rig_document(
    calibration: RigCalibration,
    budget: Budget,
    traces: Sequence[RigTrace],
    *,
    warnings: Sequence[str] = (),
) -> Document:
    """The report of a calibration on the rig, overall and by direction.

    Parameters
    ----------
    calibration : RigCalibration
    budget : Budget
        Of the mean pretravel of the direction touched least often.
    traces : sequence of RigTrace
        Of the touches of the calibration, in their order.
    warnings : sequence of str

    Returns
    -------
    Document
    """
    title = f"{len(calibration.touches)} touches on the rig"
    left_out = len(calibration.not_used)
    return Document(
        title=title,
        verdict=f"{len(calibration.touches)} traces, {len(calibration.directions)} directions"
        + (
            f"; {left_out} trace{'s are' if left_out > 1 else ' is'} not in the results"
            if left_out
            else ""
        ),
        figures=(
            *performance_figures(calibration),
            expanded_figure("expanded U", budget, "of a direction's mean pretravel"),
            *(KeyFigure("LEFT OUT", sentence) for sentence in left_out_sentences(calibration)),
        ),
        tables=(direction_table(calibration),),
        sections=(Section(tables=(budget_table(budget, title=BUDGET_TITLE),), detail=True),),
        pictures=rig_pictures(calibration, traces, title),
        notes=(
            (
                "touches of one direction start at different places, so the repeatability is that"
                " of r1 - r0, not of r1 alone"
            ),
        )
        if calibration.starts_differ
        else (),
        warnings=tuple(warnings),
        budgets=(replace(budget, result="mean pretravel of the direction touched least often"),),
    )


def performance_figures(calibration: RigCalibration) -> tuple[KeyFigure, ...]:
    """The performance of a probe over all directions."""
    digits = decimals(3)
    low, high = (calibration.anisotropy_interval / MICROMETRE).tolist()
    readings = [t.u_pretravel for t in calibration.touches if math.isfinite(t.u_pretravel)]
    u = calibration.u_pretravel / MICROMETRE
    return (
        KeyFigure(
            "pretravel r1 - r0", calibration.pretravel / MICROMETRE, "µm", digits,
            None if math.isnan(u) else u,
            remark="mean of the directions" + ("" if math.isnan(u) else "; u from repeats alone"),
        ),
        KeyFigure(
            "anisotropy", calibration.anisotropy / MICROMETRE, "µm", digits,
            interval=None if math.isnan(low) else Span(low, high),
            remark="largest less smallest",
        ),
        _repeatability_figure(calibration.repeatability),
        KeyFigure(
            "of that, sampling", float(np.mean(readings)) / MICROMETRE, "µm", digits,
            remark="of a single pretravel: edges lie between samples", detail=True,
        ),
        KeyFigure(
            "hysteresis r3 - r0", calibration.hysteresis / MICROMETRE, "µm", digits, remark="mean"
        ),
        KeyFigure(
            "largest hysteresis", calibration.largest_hysteresis / MICROMETRE, "µm", digits
        ),
    )  # fmt: skip


def _repeatability_figure(spread: Spread) -> KeyFigure:
    if math.isnan(spread.value):
        return KeyFigure("repeatability", "unknown: nothing was repeated")
    return KeyFigure(
        "repeatability",
        spread.value / MICROMETRE,
        "µm",
        decimals(3),
        interval=Span(spread.low / MICROMETRE, spread.high / MICROMETRE),
        remark=f"{number_text(spread.dof, decimals(0))} degrees of freedom; unidirectional, pooled",
    )


def direction_table(calibration: RigCalibration) -> Table:
    """The performance of a probe in each direction."""

    def column(name: str, values: Sequence[float]) -> Column:
        return Column.of(name, [value / MICROMETRE for value in values], "µm", decimals(3))

    directions = calibration.directions
    return Table(
        (
            Column.of(
                "azimuth",
                [d.azimuth / DEGREE if math.isfinite(d.azimuth) else d.name for d in directions],
                "°",
                significant(6),
            ),
            Column.of("n", [float(d.count) for d in directions], digits=decimals(0)),
            column("pretravel", [d.pretravel for d in directions]),
            column("u", [d.u_pretravel for d in directions]),
            column("s", [d.repeatability.value for d in directions]),
            column("range", [d.pretravel_range for d in directions]),
            column("hysteresis", [d.hysteresis for d in directions]),
            column("u of hysteresis", [d.u_hysteresis for d in directions]),
        ),
        title="Performance by direction",
        explanation="n: touches; u: standard uncertainty of the mean from repeats; s: standard "
        "deviation of one touch.",
        detail=True,
    )


def rig_pictures(
    calibration: RigCalibration, traces: Sequence[RigTrace], title: str = ""
) -> tuple[Picture, ...]:
    """Pictures of all directions, where there are several touches, and of one touch.

    That touch is the one with the median pretravel.
    """
    touches = calibration.touches
    middle = int(np.argsort([touch.pretravel for touch in touches])[len(touches) // 2])
    one = Picture(
        f"One touch: {touches[middle].trace}", lambda: plot_trace(traces[middle], touches[middle])
    )
    if len(touches) == 1:
        return (one,)
    return (
        Picture(
            "Pretravel, its repeatability and hysteresis over the directions",
            lambda: plot_rig(calibration, title),
        ),
        one,
    )


def plot_rig(calibration: RigCalibration, title: str = "") -> Figure:
    """Pretravel and hysteresis over the directions of a calibration.

    Parameters
    ----------
    calibration : RigCalibration
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 5.2, title or "Calibration on the rig")
    directions = calibration.directions
    if all(math.isfinite(d.azimuth) for d in directions):
        _draw_around(figure, calibration)
        place = np.array([d.azimuth for d in directions]) / DEGREE
        label = "azimuth (°)"
    else:
        flat = figure.add_subplot(1, 2, 1)
        means = [d.pretravel / MICROMETRE for d in directions]
        flat.bar([d.name for d in directions], means, color=COLOURS[0])
        flat.set_ylabel("pretravel r1 - r0 (µm)")
        place, label = np.arange(len(directions), dtype=np.float64), "direction"
    right = figure.add_subplot(1, 2, 2)
    _draw_spreads(right, directions, place)
    right.set_xlabel(label)
    return figure


def _draw_around(figure: Figure, calibration: RigCalibration) -> None:
    """Pretravel around the circle: every touch, and the means of directions that are close."""
    directions = calibration.directions
    axes = polar_axes(figure, 1, 2, 1, "pretravel r1 - r0 (µm)")
    azimuths = np.array([d.azimuth for d in directions])
    means = np.array([d.pretravel for d in directions]) / MICROMETRE
    for k, gap in enumerate(np.mod(np.roll(azimuths, -1) - azimuths, 2.0 * np.pi)):
        if 0.0 < gap <= _WIDEST_GAP:  # a chord over more would look like data
            ends = [k, (k + 1) % len(means)]
            axes.plot(azimuths[ends], means[ends], "-", color=COLOURS[0], lw=1.2)
    for d in directions:
        own = [t for t in calibration.touches if t.trace.startswith(f"{d.name}_")]
        for used, mark in ((True, "o"), (False, "x")):
            shown = [
                t.pretravel / MICROMETRE
                for t in own
                if (t.trace not in calibration.not_used) == used
            ]
            axes.plot([d.azimuth] * len(shown), shown, mark, ms=3 if used else 6,
                      color=COLOURS[1] if used else COLOURS[3])  # fmt: skip
    axes.set_ylim(0.0, 1.1 * float(means.max()))


def _draw_spreads(
    axes: Axes, directions: Sequence[DirectionPerformance], place: FloatArray
) -> None:
    """Repeatability and hysteresis of each direction, with their intervals."""
    spread = np.array([d.repeatability.value for d in directions]) / MICROMETRE
    low = np.array([d.repeatability.low for d in directions]) / MICROMETRE
    high = np.array([d.repeatability.high for d in directions]) / MICROMETRE
    hysteresis = np.array([d.hysteresis for d in directions]) / MICROMETRE
    u = np.array([d.u_hysteresis for d in directions]) / MICROMETRE
    for name, values, errors, colour in (
        ("standard deviation of pretravel", spread, [spread - low, high - spread], COLOURS[0]),
        ("hysteresis r3 - r0", hysteresis, [2.0 * u, 2.0 * u], COLOURS[1]),
    ):
        axes.errorbar(place, values, np.array(errors), fmt="o-", ms=4, lw=1.0, capsize=2,
                      color=colour, label=name)  # fmt: skip
    # Intervals from two or three repeats reach far up; they may leave the picture.
    shown = np.concatenate([np.abs(hysteresis) + 2.0 * u, 1.5 * spread])
    highest = np.nanmax([*shown, 1e-3]) if np.any(np.isfinite(shown)) else 1.0
    axes.set_ylim(min(0.0, 1.3 * float(np.nanmin([*hysteresis, 0.0]))), 1.3 * highest)
    axes.set_ylabel("µm, 95 % intervals")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def plot_trace(trace: RigTrace, touch: RigTouch) -> Figure:
    """One trace with its events: as a whole, and near the contact.

    Parameters
    ----------
    trace : RigTrace
    touch : RigTouch
        Of this trace.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 4.6, trace.name)
    _draw_whole_trace(figure.add_subplot(1, 2, 1), trace)
    _draw_contact(figure.add_subplot(1, 2, 2), trace, touch)
    return figure


def _draw_whole_trace(axes: Axes, trace: RigTrace) -> None:
    """Push rod and tip over time, the signals below them."""
    axes.plot(trace.time, trace.ruler / MICROMETRE, label="push rod", color=COLOURS[0])
    axes.plot(trace.time, trace.laser / MICROMETRE, label="tip (laser)", color=COLOURS[1])
    top = float(np.max(trace.ruler)) / MICROMETRE
    for level, name, colour in (
        (trace.contact, "contact", COLOURS[2]),
        (trace.trigger, "trigger", COLOURS[3]),
    ):
        axes.plot(trace.time, 0.1 * top * level - 0.15 * top, lw=0.9, label=name, color=colour)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("µm; signals below")
    axes.legend(fontsize=8)


def _draw_contact(axes: Axes, trace: RigTrace, touch: RigTouch) -> None:
    """The tip over the push rod near the contact, with the four events."""
    axes.plot(trace.ruler / MICROMETRE, trace.laser / MICROMETRE, lw=0.8, color=COLOURS[1])
    for name in ("r0", "r1", "r2", "r3"):
        place = getattr(touch, name)
        if np.isfinite(place):
            axes.axvline(place / MICROMETRE, lw=0.8, ls=":", color="0.4")
            axes.annotate(name, (place / MICROMETRE, 0.97), xycoords=("data", "axes fraction"),
                          ha="center", va="top", fontsize=8)  # fmt: skip
    around = [value for value in (touch.r0, touch.r2) if np.isfinite(value)]
    if around:
        axes.set_xlim(min(around) / MICROMETRE - 3.0, max(around) / MICROMETRE + 1.0)
    axes.set_xlabel("push rod (µm)")
    axes.set_ylabel("tip (µm)")
    axes.grid(alpha=0.3)
