"""Report and pictures of a calibration on a rig."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, from_angles
from pretravel.laboratory.budget_report import budgets_data, expanded_figure
from pretravel.laboratory.rig.calibration import (
    DirectionPerformance,
    RigCalibration,
    Spread,
    direction_name,
)
from pretravel.laboratory.rig.left_out import left_out_sentences
from pretravel.laboratory.rig.rig_csv import rig_table
from pretravel.laboratory.rig.scale import ScaleCheck
from pretravel.laboratory.rig.trace import RigTouch, RigTrace
from pretravel.show import (
    Axis,
    Bars,
    Chart,
    Colour,
    Column,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Mark,
    Note,
    Picture,
    PlaneChart,
    PolarChart,
    Rule,
    Scale,
    Section,
    SpaceChart,
    SpaceLines,
    SpaceMesh,
    SpacePoints,
    Span,
    Symbol,
    Table,
    View,
    at_the_edge,
    budget_picture,
    decimals,
    interval_lines,
    number_text,
    series,
    significant,
    some_rows,
    sphere_mesh,
    value_text,
)
from pretravel.task import budget_table
from pretravel.uncertainty import Budget, coverage_factor

BUDGET_TITLE = "Uncertainty of the mean pretravel of a direction"
_MOST_SAMPLES = 1500
"""Of a trace in a picture."""


def rig_document(
    calibration: RigCalibration,
    budget: Budget,
    traces: Sequence[RigTrace],
    *,
    warnings: Sequence[str] = (),
    forces: Sequence[float] | None = None,
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
    forces : n floats, optional
        Trigger force of each touch, where a description of the probe determines it. [N]
    """
    title = (
        f"{len(calibration.touches)} touch{'es' if len(calibration.touches) > 1 else ''} on the rig"
    )
    left_out = len(calibration.not_used)
    return Document(
        title=title,
        verdict=f"{_counted(calibration.touches, 'trace')}, "
        + _counted(calibration.directions, "direction")
        + (
            f"; {left_out} trace{'s are' if left_out > 1 else ' is'} not in the results"
            if left_out
            else ""
        ),
        figures=(
            *performance_figures(calibration),
            *_force_figures(calibration, forces),
            expanded_figure(
                "U of a direction",
                budget,
                "of the mean pretravel of the direction with the fewest touches, with the budget",
            ),
            *(KeyFigure("LEFT OUT", sentence) for sentence in left_out_sentences(calibration)),
        ),
        tables=(direction_table(calibration, forces),),
        sections=(Section(tables=(budget_table(budget, title=BUDGET_TITLE),), detail=True),),
        pictures=(
            *rig_pictures(calibration, traces, title, forces),
            budget_picture(budget, "a direction's mean pretravel"),
        ),
        notes=(
            (
                "touches of one direction start at different positions: the repeatability is "
                "evaluated from r1 - r0, not from r1 alone"
            ),
        )
        if calibration.starts_differ
        else (),
        warnings=tuple(warnings),
        budgets=(
            replace(budget, result="mean pretravel of the direction with the fewest touches"),
        ),
    )


def _counted(things: Sequence[object], word: str) -> str:
    return f"{len(things)} {word}{'s' if len(things) > 1 else ''}"


def performance_figures(calibration: RigCalibration) -> tuple[KeyFigure, ...]:
    """The performance of a probe over all directions."""
    digits = decimals(3)
    low, high = (calibration.anisotropy_interval / MICROMETRE).tolist()
    readings = [t.u_pretravel for t in calibration.touches if math.isfinite(t.u_pretravel)]
    u, dof = calibration.u_pretravel / MICROMETRE, calibration.repeatability.dof
    source = "the scatter about the lobes" if calibration.repeatability.of_lobes else "repeats"
    return (
        KeyFigure(
            "pretravel r1 - r0", calibration.pretravel / MICROMETRE, "µm", digits,
            None if math.isnan(u) else u,
            coverage_factor=None if math.isnan(u) else coverage_factor(dof),
            remark="mean of the directions" + ("" if math.isnan(u) else f"; u from {source} alone"),
        ),
        _range_figure(
            "anisotropy", calibration.anisotropy,
            "largest minus smallest" + ("" if math.isnan(low) else f"; from {source} alone"),
            None if math.isnan(low) else Span(low, high),
        ),
        _repeatability_figure(calibration.repeatability),
        KeyFigure(
            "u by sampling", float(np.mean(readings)) / MICROMETRE, "µm", digits,
            remark="of a single pretravel, whose edges lie between two samples", detail=True,
        ),
        KeyFigure(
            "hysteresis r3 - r0", calibration.hysteresis / MICROMETRE, "µm", digits, remark="mean"
        ),
        KeyFigure(
            "largest hysteresis", calibration.largest_hysteresis / MICROMETRE, "µm", digits
        ),
        _range_figure(
            "anisotropy of hysteresis", calibration.hysteresis_anisotropy,
            "largest minus smallest mean over the directions", detail=True,
        ),
        _range_figure(
            "anisotropy of repeatability", calibration.repeatability_anisotropy,
            "largest minus smallest over the directions; few repeats differ by chance", detail=True,
        ),
    )  # fmt: skip


def with_scale_check(document: Document, checked: ScaleCheck | None) -> Document:
    """A report with the check of the ruler, where there is one (Ren 2020, Figure 9)."""
    if checked is None:
        return document
    periodic = (
        KeyFigure(
            "periodic part of the ruler",
            1e3 * checked.amplitude / MICROMETRE,
            "nm",
            decimals(1),
            remark=f"amplitude; period {number_text(checked.period)} mm",
        )
        if checked.amplitude > 0.0
        else KeyFigure("periodic part of the ruler", "none above chance")
    )
    figures = (
        KeyFigure("ruler against reference", 1e3 * checked.largest_error / MICROMETRE, "nm",
                  decimals(1), remark="largest error, each run with its own zero"),
        periodic,
        KeyFigure("slope of the ruler", 1e6 * checked.slope, "µm/m", decimals(2),
                  1e6 * checked.u_slope, detail=True),
        KeyFigure("scatter of the ruler", 1e3 * checked.scatter / MICROMETRE, "nm", decimals(2),
                  detail=True),
    )  # fmt: skip
    picture = Picture("Ruler against reference", lambda: scale_view(checked))
    return replace(
        document,
        figures=(*document.figures, *figures),
        pictures=(*document.pictures, picture),
    )


def scale_view(checked: ScaleCheck) -> View:
    """Errors of the ruler over its reading, run by run."""
    marks = []
    for place, number in enumerate(np.unique(checked.run)):
        rows = np.flatnonzero(checked.run == number)
        rows = rows[np.argsort(checked.position[rows], kind="stable")]
        error = 1e3 * checked.error[rows] / MICROMETRE
        marks.append(LineMark(checked.position[rows], error, f"run {number}", series(place)))
    return View(
        "Ruler against reference",
        (PlaneChart("error of the ruler", Axis("ruler", "mm"), Axis("error", "nm"),
                    (Rule(0.0, colour="ink"), *marks)),),
    )  # fmt: skip


def direction_forces(
    calibration: RigCalibration, forces: Sequence[float] | None
) -> list[float] | None:
    """Mean trigger force of the touches of each direction that are in the results. [N]"""
    if forces is None:
        return None
    groups: dict[str, list[float]] = {d.name: [] for d in calibration.directions}
    for touch, force in zip(calibration.touches, forces, strict=True):
        if touch.trace not in calibration.not_used and math.isfinite(force):
            groups[direction_name(touch.trace)].append(force)
    return [float(np.mean(group)) if group else math.nan for group in groups.values()]


def _force_figures(
    calibration: RigCalibration, forces: Sequence[float] | None
) -> tuple[KeyFigure, ...]:
    """The trigger force over all directions (Ren 2020, Figure 8c)."""
    found = [f for f in direction_forces(calibration, forces) or () if math.isfinite(f)]
    if not found:
        return ()
    return (
        KeyFigure("trigger force", float(np.mean(found)), "N", decimals(4),
                  remark="from pretravel and description; mean of the directions across the axis"),
        KeyFigure("anisotropy of force", max(found) - min(found), "N", decimals(4),
                  remark="largest minus smallest", detail=True),
    )  # fmt: skip


def _range_figure(
    name: str, value: float, remark: str, interval: Span | None = None, *, detail: bool = False
) -> KeyFigure:
    """A range over directions, which one direction does not show."""
    if math.isnan(value):
        return KeyFigure(name, "unknown: it needs two directions or more", detail=detail)
    return KeyFigure(
        name, value / MICROMETRE, "µm", decimals(3), interval=interval, remark=remark, detail=detail
    )


def _repeatability_figure(spread: Spread) -> KeyFigure:
    if math.isnan(spread.value):
        return KeyFigure("repeatability", "unknown: nothing was repeated")
    return KeyFigure(
        "repeatability",
        spread.value / MICROMETRE,
        "µm",
        decimals(3),
        interval=Span(spread.low / MICROMETRE, spread.high / MICROMETRE),
        remark=f"{number_text(spread.dof, decimals(0))} "
        f"degree{'' if spread.dof == 1.0 else 's'} of freedom; "
        + ("residuals of three equal lobes" if spread.of_lobes else "unidirectional, pooled")
        + (
            "; from the sampling interval, since the touches differ by less"
            if spread.of_sampling
            else ""
        ),
    )


def direction_table(calibration: RigCalibration, forces: Sequence[float] | None = None) -> Table:
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
            *_polar_column(directions),
            Column.of("n", [float(d.count) for d in directions], digits=decimals(0)),
            column("pretravel", [d.pretravel for d in directions]),
            column("u, repeats", [d.u_pretravel for d in directions]),
            column("U, repeats", [d.expanded_pretravel for d in directions]),
            column("s", [d.repeatability.value for d in directions]),
            column("range", [d.pretravel_range for d in directions]),
            column("hysteresis", [d.hysteresis for d in directions]),
            column("u of hysteresis", [d.u_hysteresis for d in directions]),
            column("U of hysteresis", [d.expanded_hysteresis for d in directions]),
            *_force_column(calibration, forces),
        ),
        title="Performance by direction",
        explanation="n: touches; u, repeats: standard uncertainty of the mean, from the repeats of "
        "all directions; U, repeats: expanded uncertainty, k u with k for 95.45 % (Student's t "
        "with the degrees of freedom of the repeats), without the budget of the rig; s: standard "
        "deviation of one touch, from the repeats of its direction.",
        detail=True,
    )


def _polar_column(directions: Sequence[DirectionPerformance]) -> tuple[Column, ...]:
    """The polar angle, where a direction is not across the axis."""
    if all(d.across or math.isnan(d.azimuth) for d in directions):
        return ()
    polar = [d.polar / DEGREE if math.isfinite(d.polar) else "" for d in directions]
    return (Column.of("polar", polar, "°", significant(6)),)


def _force_column(
    calibration: RigCalibration, forces: Sequence[float] | None
) -> tuple[Column, ...]:
    found = direction_forces(calibration, forces)
    return () if found is None else (Column.of("force", found, "N", decimals(4)),)


def rig_data(
    calibration: RigCalibration,
    touches: Sequence[RigTouch],
    budget: Budget,
    forces: Sequence[float] | None = None,
) -> tuple[Table, ...]:
    """All values of a calibration, for programs.

    Parameters
    ----------
    calibration : RigCalibration
    touches : sequence of RigTouch
        Those too that are not in the results.
    budget : Budget
        Of the mean pretravel of the direction touched least often.
    forces : n floats, optional
        As in `rig_document`.

    Returns
    -------
    tuple of Table
        Performance, without and with the outliers; Directions, Outliers, Touches, Budgets.
    """
    lost = calibration.with_outliers
    results = [calibration, *(() if lost is None else (lost,))]
    directions, outliers = calibration.directions, calibration.outliers
    overall = {
        "outliers": ["left out", "contained"][: len(results)],
        "pretravel_um": _um([r.pretravel for r in results]),
        "u_pretravel_um": _um([r.u_pretravel for r in results]),
        "anisotropy_um": _um([r.anisotropy for r in results]),
        "anisotropy_low_um": _um([r.anisotropy_interval[0] for r in results]),
        "anisotropy_high_um": _um([r.anisotropy_interval[1] for r in results]),
        **_spread_columns([r.repeatability for r in results]),
        "hysteresis_um": _um([r.hysteresis for r in results]),
        "largest_hysteresis_um": _um([r.largest_hysteresis for r in results]),
        "hysteresis_anisotropy_um": _um([r.hysteresis_anisotropy for r in results]),
        "repeatability_anisotropy_um": _um([r.repeatability_anisotropy for r in results]),
        "coverage_probability": [r.probability for r in results],
    }
    each = {
        "name": [d.name for d in directions],
        "azimuth_deg": [d.azimuth / DEGREE for d in directions],
        "polar_deg": [d.polar / DEGREE for d in directions],
        "count": [d.count for d in directions],
        "pretravel_um": _um([d.pretravel for d in directions]),
        "u_pretravel_um": _um([d.u_pretravel for d in directions]),
        "expanded_pretravel_um": _um([d.expanded_pretravel for d in directions]),
        **_spread_columns([d.repeatability for d in directions]),
        "pretravel_range_um": _um([d.pretravel_range for d in directions]),
        "trigger_range_um": _um([d.trigger_range for d in directions]),
        "hysteresis_um": _um([d.hysteresis for d in directions]),
        "u_hysteresis_um": _um([d.u_hysteresis for d in directions]),
        "expanded_hysteresis_um": _um([d.expanded_hysteresis for d in directions]),
    }
    by_direction = direction_forces(calibration, forces)
    each |= {} if by_direction is None else {"force_N": by_direction}
    left_out = {
        "trace": [outlier.trace for outlier in outliers],
        "distance_um": _um([outlier.distance for outlier in outliers]),
        "limit_um": _um([outlier.limit for outlier in outliers]),
        "message": [outlier.message for outlier in outliers],
    }
    return (
        Table.of(overall, "Performance"),
        Table.of(each, "Directions"),
        Table.of(left_out, "Outliers"),
        Table.of(rig_table(touches, calibration.not_used, forces), "Touches"),
        budgets_data([replace(budget, result="mean pretravel")]),
    )


def _um(lengths: Sequence[float]) -> list[float]:
    return [length / MICROMETRE for length in lengths]


def _spread_columns(spreads: Sequence[Spread]) -> dict[str, list[float]]:
    return {
        "repeatability_um": _um([spread.value for spread in spreads]),
        "repeatability_low_um": _um([spread.low for spread in spreads]),
        "repeatability_high_um": _um([spread.high for spread in spreads]),
        "repeatability_dof": [spread.dof for spread in spreads],
    }


def rig_pictures(
    calibration: RigCalibration,
    traces: Sequence[RigTrace],
    title: str = "",
    forces: Sequence[float] | None = None,
) -> tuple[Picture, ...]:
    """Pictures of all directions, where there are several touches, and of one touch.

    That touch is the one with the median pretravel.
    """
    touches = calibration.touches
    middle = int(np.argsort([touch.pretravel for touch in touches])[len(touches) // 2])
    one = Picture(
        f"One touch: {touches[middle].trace}", lambda: trace_view(traces[middle], touches[middle])
    )
    if len(touches) == 1:
        return (one,)
    return (
        Picture(
            "Pretravel, its repeatability and hysteresis over the directions",
            lambda: rig_view(calibration, title, forces),
        ),
        one,
    )


def rig_view(
    calibration: RigCalibration, title: str = "", forces: Sequence[float] | None = None
) -> View:
    """Pretravel, repeatability, hysteresis and force over the directions of a calibration.

    Parameters
    ----------
    calibration : RigCalibration
    title : str
    forces : n floats, optional
        Trigger force of each touch. [N]

    Returns
    -------
    View
        The directions across the axis over the azimuth, where there are three or more; all of them
        in space around a sphere of their mean, where some lie out of this plane.

    References
    ----------
    Ren 2020, Figure 8.
    """
    directions = calibration.directions
    plane = [d for d in directions if d.across]
    charts: list[Chart] = []
    if len(plane) == len(directions) or len(plane) >= _FEWEST_AROUND:
        places = np.array([d.azimuth for d in plane]) / DEGREE
        axis = Axis("azimuth", "°", -10.0, 370.0, ticks=tuple(45.0 * k for k in range(9)))
        charts.append(_around(calibration, plane))
        shown = plane
    else:
        places = np.arange(len(directions), dtype=np.float64)
        axis = Axis("direction", categories=tuple(d.name for d in directions))
        means = np.array([d.pretravel for d in directions]) / MICROMETRE
        charts.append(PlaneChart("pretravel r1 - r0", axis, Axis("pretravel", "µm", 0.0),
                                 (Bars(places, means, "mean of the direction"),)))  # fmt: skip
        shown = list(directions)
    placed = [d for d in directions if math.isfinite(d.azimuth) and math.isfinite(d.polar)]
    if len(placed) > len(plane) and len(placed) > 1:
        charts.append(_on_the_sphere(placed))
    charts += _spreads(shown, places, axis)
    by_direction = direction_forces(calibration, forces)
    if by_direction is not None:
        charts += _forces_around(calibration, by_direction)
    return View(title or "Calibration on the rig", tuple(charts))


_FEWEST_AROUND = 3
"""Directions across the axis from which on they are drawn around a circle."""


def _on_the_sphere(directions: Sequence[DirectionPerformance]) -> SpaceChart:
    """The mean pretravel of all directions in space, around a sphere of their mean."""
    values = np.array([d.pretravel for d in directions]) / MICROMETRE
    normals = from_angles(
        np.array([d.polar for d in directions]), np.array([d.azimuth for d in directions])
    )
    mean = float(np.mean(values))
    labels = tuple(f"{d.name}: {d.pretravel / MICROMETRE:.3f} µm" for d in directions)
    marks = (
        SpaceMesh(*sphere_mesh(np.zeros(3), mean, 19, 36), "mean of all directions", opacity=0.3),
        SpaceLines(mean * normals, values[:, None] * normals, colour="ink", width=1.5),
        SpacePoints(values[:, None] * normals, "mean of a direction", values=values, size=8.0,
                    labels=labels),
    )  # fmt: skip
    return SpaceChart("pretravel of all directions, on the sphere", marks, "probe", "µm",
                      Scale.of("pretravel", "µm", values),
                      note="A point is as far from the middle as its pretravel.")  # fmt: skip


def _forces_around(calibration: RigCalibration, by_direction: Sequence[float]) -> list[Chart]:
    """The mean force of each direction across the axis (Ren 2020, Figure 8c)."""
    forces = np.asarray(by_direction)
    rows = [
        row
        for row, d in enumerate(calibration.directions)
        if d.across and math.isfinite(float(forces[row]))
    ]
    if not rows:
        return []
    azimuth = np.array([calibration.directions[row].azimuth for row in rows])
    mean = float(np.mean(forces[rows]))
    return [
        PolarChart(
            "trigger force, from the pretravel",
            Axis("force", "N", 0.0),
            (Rule(mean, "mean of all directions", "reference"),
             Dots(azimuth, forces[rows], "mean of a direction", "series3", symbol="ring",
                  size=8.0)),
        )
    ]  # fmt: skip


def _around(calibration: RigCalibration, directions: Sequence[DirectionPerformance]) -> PolarChart:
    """Pretravel around the circle: every touch, and the mean of each direction.

    No line connects the directions: nothing was touched between them.
    """
    means = np.array([d.pretravel for d in directions]) / MICROMETRE
    marks: list[Dots | Rule] = [Rule(float(means.mean()), "mean of all directions", "reference")]
    for used, name, role, symbol in _USED_OR_NOT:
        azimuth, pretravel, labels = [], [], []
        for d in directions:
            for touch in calibration.touches:
                if direction_name(touch.trace) == d.name and used == (
                    touch.trace not in calibration.not_used
                ):
                    azimuth.append(d.azimuth)
                    pretravel.append(touch.pretravel / MICROMETRE)
                    value = "" if used else f": {value_text(pretravel[-1], 'µm')}"
                    labels.append(f"{touch.trace}{value}")
        if labels:
            drawn = np.array(pretravel) if used else at_the_edge(pretravel, [0.0, *means])
            marks.append(Dots(np.array(azimuth), drawn, name, role,
                              symbol=symbol, size=4.0, labels=tuple(labels)))  # fmt: skip
    names = tuple(f"mean of {d.count} touches" for d in directions)
    marks.append(Dots(np.array([d.azimuth for d in directions]), means, "mean of a direction",
                      "ink", symbol="ring", size=8.0, labels=names))  # fmt: skip
    return PolarChart("pretravel r1 - r0", Axis("pretravel", "µm", 0.0), tuple(marks))


_USED_OR_NOT: tuple[tuple[bool, str, Colour, Symbol], ...] = (
    (True, "single touches", "series1", "dot"),
    (False, "not in the results", "limit", "cross"),
)


def _spreads(
    directions: Sequence[DirectionPerformance], places: FloatArray, axis: Axis
) -> tuple[PlaneChart, PlaneChart]:
    """Repeatability and hysteresis of each direction, with all of their intervals."""
    value, low, high = (
        np.array([getattr(d.repeatability, name) for d in directions]) / MICROMETRE
        for name in ("value", "low", "high")
    )
    # Intervals from two repeats reach up thirty times: they need steps of equal ratios.
    ratios = bool(np.all(low[np.isfinite(low)] > 0.0)) and bool(np.isfinite(low).any())
    repeatability = PlaneChart(
        "repeatability",
        axis,
        Axis("standard deviation of pretravel", "µm", logarithmic=ratios),
        (interval_lines(places, low, high, "interval of 95 %"),
         Dots(places, value, "standard deviation")),
    )  # fmt: skip
    hysteresis = np.array([d.hysteresis for d in directions]) / MICROMETRE
    u = np.array([d.u_hysteresis for d in directions]) / MICROMETRE
    back = PlaneChart(
        "hysteresis r3 - r0",
        axis,
        Axis("hysteresis", "µm"),
        (Rule(0.0, colour="ink"),
         interval_lines(places, hysteresis - 2.0 * u, hysteresis + 2.0 * u, "2 u", "series2"),
         Dots(places, hysteresis, "mean of a direction", "series2")),
    )  # fmt: skip
    return repeatability, back


def trace_view(trace: RigTrace, touch: RigTouch) -> View:
    """One trace with its events: as a whole, its signals, and near the contact.

    Parameters
    ----------
    trace : RigTrace
    touch : RigTouch
        Of this trace.
    """
    return View(trace.name, (_whole_trace(trace), _signals(trace), _contact(trace, touch)))


def _whole_trace(trace: RigTrace) -> PlaneChart:
    """Push rod and tip over time."""
    rows = some_rows(np.arange(len(trace.time)), _MOST_SAMPLES)
    return PlaneChart(
        "push rod and tip",
        Axis("time", "s"),
        Axis("displacement", "µm"),
        (LineMark(trace.time[rows], trace.ruler[rows] / MICROMETRE, "push rod"),
         LineMark(trace.time[rows], trace.laser[rows] / MICROMETRE, "tip (laser)", "series2")),
    )  # fmt: skip


def _signals(trace: RigTrace) -> PlaneChart:
    """The levels of contact and trigger over time; a level is high at rest."""
    marks = []
    for place, (level, name) in enumerate(((trace.contact, "contact"), (trace.trigger, "trigger"))):
        edges = np.flatnonzero(np.diff(level.astype(np.int64)))
        rows = np.unique(np.concatenate([[0], edges, edges + 1, [len(level) - 1]]))
        marks.append(LineMark(trace.time[rows], place + 0.6 * level[rows], name, series(2 + place)))
    return PlaneChart("signals, high at rest", Axis("time", "s"),
                      Axis("", "", -0.2, 1.9, ("contact", "trigger")), tuple(marks))  # fmt: skip


def _contact(trace: RigTrace, touch: RigTouch) -> PlaneChart:
    """The tip over the push rod near the contact, with the four events."""
    events = {name: getattr(touch, name) / MICROMETRE for name in ("r0", "r1", "r2", "r3")}
    ruler, laser = trace.ruler / MICROMETRE, trace.laser / MICROMETRE
    around = [events[name] for name in ("r0", "r2") if np.isfinite(events[name])]
    low, high = (min(around) - 3.0, max(around) + 1.0) if around else (ruler.min(), ruler.max())
    near = np.flatnonzero((ruler >= low) & (ruler <= high))
    rows = some_rows(near, 2 * _MOST_SAMPLES)
    marks: list[Mark] = [LineMark(ruler[rows], laser[rows], "tip", "series2", 1.0)]
    top = float(laser[rows].max()) if len(rows) else 0.0
    for name, place in events.items():
        if np.isfinite(place):
            height = 0.9 * top if name == "r3" else top  # r3 is close to r0
            marks += [Rule(place, upright=True), Note(place, height, name)]
    return PlaneChart("near the contact: r0 contact, r1 trigger, r2 stop, r3 contact lost",
                      Axis("push rod", "µm", float(low), float(high)), Axis("tip", "µm"),
                      tuple(marks))  # fmt: skip
