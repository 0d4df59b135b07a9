"""Reports and picture of a separation of machine and probe, and of a plan for one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, IntArray
from pretravel.laboratory.separation.plan import SeparationPlan
from pretravel.laboratory.separation.ranges import ranges_of_variances
from pretravel.laboratory.separation.separation import Separation
from pretravel.laboratory.separation.separation_csv import separation_table
from pretravel.show import (
    Axis,
    Colour,
    Column,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Picture,
    PlaneChart,
    Rule,
    Section,
    Span,
    Table,
    View,
    decimals,
    interval_lines,
    number_text,
    signed_decimals,
    significant,
    value_text,
)
from pretravel.task import NotebookCard, closed_curve, polar_chart, range_figure

_SQUARE = MICROMETRE**2
_SHOWN_SETUPS = 4
_FEWEST_SHOWN = 4
"""Directions of the machine from which on a picture shows the model."""


_METHOD = (
    "After Nafi and Mayer: a reading is the error of the machine minus that of the probe, with the "
    "noise of both. Readings at several orientations of the probe determine the errors by least "
    "squares (their sum over the machine's directions is zero), and the variances of all pairs of "
    "directions from the residuals."
)


def separation_document(
    result: Separation,
    *,
    readings_name: str = "",
    pairs: Sequence[tuple[int, int]] = (),
    warnings: Sequence[str] = (),
) -> Document:
    """The report of a separation: errors and variances of machine and probe.

    Parameters
    ----------
    result : Separation
    readings_name : str
        Of the file with the readings.
    pairs : pairs of machine and probe
        Whose variance is wanted.
    warnings : sequence of str
    """
    title = f"{readings_name}: machine and probe" if readings_name else "Machine and probe"
    return Document(
        title=title,
        verdict=f"The errors of the machine have a range of {_range(result.machine_error)}, those "
        f"of the probe {_range(result.probe_error)} ({len(result.residuals)} readings, "
        f"{number_text(result.dof, decimals(0))} degrees of freedom, method {result.method})",
        figures=(
            *_side_figures("machine", result.machine_error, result.machine_variance),
            *_side_figures("probe", result.probe_error, result.probe_variance),
            *_range_figures(result),
            *(_pair_figure(result, machine, probe) for machine, probe in pairs),
            *(KeyFigure("LEFT OUT", outlier.message) for outlier in result.outliers),
            *_excluded_figure(result),
        ),
        tables=(_direction_table(result),),
        sections=(Section("Method", (_METHOD,), detail=True, certificate=True),),
        pictures=(
            Picture("Errors and variances", lambda: separation_view(result, title)),
            *_model_picture(result, title),
        ),
        notes=result.notes,
        warnings=(*(f"{each} (--clockwise)" for each in result.warnings), *warnings),
        data=_data(result),
    )


def _data(result: Separation) -> tuple[Table, ...]:
    """All values, for programs."""
    overall = {
        "method": [result.method],
        "degrees_of_freedom": [result.dof],
        "readings_used": [len(result.residuals)],
    }
    outliers = {
        "reading": [outlier.row + 1 for outlier in result.outliers],
        "machine_index": [outlier.machine for outlier in result.outliers],
        "probe_index": [outlier.probe for outlier in result.outliers],
        "distance_um": [outlier.distance / MICROMETRE for outlier in result.outliers],
        "limit_um": [outlier.limit / MICROMETRE for outlier in result.outliers],
        "message": [outlier.message for outlier in result.outliers],
    }
    pairs = {
        "machine_index": np.repeat(result.machines, len(result.probes)),
        "probe_index": np.tile(result.probes, len(result.machines)),
        "variance_um2": np.add.outer(result.machine_variance, result.probe_variance).ravel()
        / _SQUARE,
    }
    return (
        Table.of(overall, "Separation"),
        Table.of(separation_table(result), "Directions"),
        Table.of(outliers, "Outliers"),
        Table.of({"reading": [row + 1 for row in result.excluded]}, "Excluded readings"),
        Table.of(pairs, "Variances of pairs"),
    )


def _range(error: FloatArray) -> str:
    return value_text(float(np.ptp(error)) / MICROMETRE, "µm", decimals(3))


def _excluded_figure(result: Separation) -> tuple[KeyFigure, ...]:
    if not result.excluded:
        return ()
    rows = ", ".join(str(row + 1) for row in result.excluded)
    return (
        KeyFigure("LEFT OUT", f"as requested: reading{'s' * (len(result.excluded) > 1)} {rows}"),
    )


def _side_figures(side: str, error: FloatArray, variance: FloatArray) -> tuple[KeyFigure, ...]:
    return (
        KeyFigure(f"{side}, errors", float(np.ptp(error)) / MICROMETRE, "µm", decimals(3),
                  remark="largest minus smallest"),
        KeyFigure(f"{side}, variance", float(variance.mean()) / _SQUARE, "µm²", decimals(3),
                  remark="mean over the directions"),
    )  # fmt: skip


def _range_figures(result: Separation) -> tuple[KeyFigure, ...]:
    """The ranges of the variances, and whether equal variances explain them."""
    if result.used is None:
        return ()
    return tuple(
        KeyFigure(
            f"{side}, range of variance",
            found.value / _SQUARE,
            "µm²",
            decimals(3),
            remark=f"{'not explained by chance' if found.differs else 'explained by chance'}: if "
            "all variances were equal, the range would be below "
            f"{value_text(found.by_chance / _SQUARE, 'µm²', decimals(3))} in 95 % of tests; p = "
            f"{number_text(found.probability, significant(2))}",
        )
        for side, found in zip(("machine", "probe"), ranges_of_variances(result.used), strict=True)
    )


def _pair_figure(result: Separation, machine: int, probe: int) -> KeyFigure:
    variance, u = result.pair_variance(machine, probe)
    low, high = result.pair_interval(machine, probe)
    return KeyFigure(
        f"variance of pair ({machine}, {probe})",
        variance / _SQUARE,
        "µm²",
        decimals(4),
        u / _SQUARE,
        interval=Span(low / _SQUARE, high / _SQUARE),
    )


def _direction_table(result: Separation) -> Table:
    names = [
        *(f"machine {index}" for index in result.machines),
        *(f"probe {index}" for index in result.probes),
    ]
    error = np.concatenate([result.machine_error, result.probe_error])
    u_error = np.concatenate([result.u_machine_error, result.u_probe_error])
    variance = np.concatenate([result.machine_variance, result.probe_variance])
    u_variance = np.concatenate([result.u_machine_variance, result.u_probe_variance])
    return Table(
        (
            Column.of("direction", names),
            Column.of("systematic", error / MICROMETRE, "µm", signed_decimals(3)),
            Column.of("u", u_error / MICROMETRE, "µm", decimals(3)),
            Column.of("variance", variance / _SQUARE, "µm²", decimals(4)),
            Column.of("u of variance", u_variance / _SQUARE, "µm²", decimals(4)),
        ),
        title="Errors and variances by direction",
        explanation="u: standard uncertainty (k = 1).",
        detail=True,
        certificate=True,
    )


def separation_plan_document(plan: SeparationPlan) -> Document:
    """The report of a planned multi-step test."""
    turns = ", ".join(f"{360.0 * step / plan.directions:g}" for step in plan.steps)
    u_variance = (
        "not determined"
        if math.isinf(plan.u_variance)
        else value_text(100.0 * plan.u_variance, "%", decimals(0))
    )
    return Document(
        title="Plan of a multi-step test",
        verdict=f"{plan.readings} touches: {plan.directions} directions x {len(plan.steps)} "
        f"orientations x {plan.repeats} repeats",
        figures=(
            KeyFigure("turn the probe to", f"{turns}°"),
            KeyFigure("u of an error", plan.u_error / MICROMETRE, "µm", decimals(3),
                      remark="relative to the mean of all errors"),
            KeyFigure("u of a variance", u_variance,
                      remark="" if math.isinf(plan.u_variance) else
                      "relative, of one direction of machine or probe"),
        ),
    )  # fmt: skip


def _model_picture(result: Separation, title: str) -> tuple[Picture, ...]:
    if result.used is None or len(np.unique(result.used.machine)) < _FEWEST_SHOWN:
        return ()
    return (Picture("Measured and modelled errors", lambda: model_view(result, title)),)


def model_view(result: Separation, title: str = "") -> View:
    """Measured and modelled errors at some of the orientations of the probe.

    An orientation has one difference between the numbers of machine and probe. Shown are those
    with the most readings, spread over all of them.

    References
    ----------
    Nafi and Mayer 2011, Figure 3.
    """
    assert result.used is not None
    machine, probe = result.used.machine, result.used.probe
    count = max(len(result.machines), len(result.probes))
    setup = np.mod(machine - probe, count)
    turns, readings = np.unique(setup, return_counts=True)
    full = turns[readings == readings.max()]
    shown = full[np.unique(np.linspace(0, len(full) - 1, _SHOWN_SETUPS).round().astype(int))]
    modelled = result.used.errors - result.residuals
    charts = []
    for turn in shown:
        rows = np.flatnonzero(setup == turn)
        rows = rows[np.argsort(machine[rows], kind="stable")]
        at = machine[rows].astype(np.float64)
        charts.append(
            PlaneChart(
                f"probe turned by {turn} of {count} steps",
                Axis("direction of the machine, its number"),
                Axis("error", "µm"),
                (LineMark(at, modelled[rows] / MICROMETRE, "modelled", "series2"),
                 Dots(at, result.used.errors[rows] / MICROMETRE, "measured")),
            )
        )  # fmt: skip
    return View(title or "Measured and modelled errors", tuple(charts), columns=2)


def separation_view(result: Separation, title: str = "") -> View:
    """Errors and variances of machine and probe over the directions."""
    charts = []
    sides: tuple[tuple[str, IntArray, FloatArray, FloatArray, FloatArray, FloatArray, Colour], ...]
    sides = (
        ("machine", result.machines, result.machine_error, result.u_machine_error,
         result.machine_variance, result.u_machine_variance, "series1"),
        ("probe", result.probes, result.probe_error, result.u_probe_error,
         result.probe_variance, result.u_probe_variance, "series2"),
    )  # fmt: skip
    for name, indices, error, u_error, variance, u_variance, colour in sides:
        axis = Axis(f"direction of the {name}, its number")
        places = indices.astype(np.float64)
        dots = Dots(places, error / MICROMETRE, "error, bars: 2 u", colour,
                    u=2.0 * u_error / MICROMETRE)  # fmt: skip
        charts.append(
            PlaneChart(f"{name}: systematic errors", axis, Axis("error", "µm"),
                       (Rule(0.0, colour="ink"), dots))
        )  # fmt: skip
        # No variance is negative, so neither is the lower end of its bar.
        low = np.maximum(variance - 2.0 * u_variance, np.minimum(variance, 0.0))
        bars = interval_lines(places, low / _SQUARE, (variance + 2.0 * u_variance) / _SQUARE,
                              "2 u, cut at zero", colour)  # fmt: skip
        charts.append(
            PlaneChart(f"{name}: variances", axis, Axis("variance", "µm²"),
                       (bars, Dots(places, variance / _SQUARE, "variance", colour)))
        )  # fmt: skip
    return View(title or "Machine and probe", tuple(charts), columns=2)


def separation_card(result: Separation) -> NotebookCard:
    """The card of a separation in notebooks."""
    errors = (("machine", result.machine_error), ("probe", result.probe_error))
    variances = (("machine", result.machine_variance), ("probe", result.probe_variance))
    out = len(result.outliers) + len(result.excluded)
    figures = (
        KeyFigure("readings", f"{len(result.residuals):,}", remark=f"{out} left out"),
        KeyFigure(
            "directions",
            f"{len(result.machines)} of the machine, {len(result.probes)} of the probe",
        ),
        *(range_figure(f"errors of the {name}", e / MICROMETRE, "µm", 2) for name, e in errors),
        *(
            range_figure(f"variances of the {name}", v / MICROMETRE**2, "µm²", 2)
            for name, v in variances
        ),
        KeyFigure("method", result.method),
    )
    curves = [
        closed_curve(
            np.linspace(0.0, 2.0 * math.pi, len(values), endpoint=False),
            values / MICROMETRE,
            f"errors of the {name}",
            index,
        )
        for index, (name, values) in enumerate(errors)
    ]
    picture = polar_chart(
        "errors by direction, the first at the right", Axis("error", "µm"), curves,
        directions=("", ""),
    )  # fmt: skip
    return NotebookCard("Separation of machine and probe", figures, picture)
