"""Report and picture of two designs of a probe: what differs, and what it does."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, MICROMETRE, FloatArray, azimuth_angle
from pretravel.design.tasks.predict.view import by_level, polar_axis, values_of
from pretravel.prediction import Probe, Trigger
from pretravel.show import (
    Area,
    Axis,
    Bars,
    Chart,
    Colour,
    Column,
    Document,
    KeyFigure,
    LineMark,
    Mark,
    Picture,
    PlaneChart,
    PolarChart,
    Scale,
    Span,
    Table,
    TopView,
    View,
    angles_deg,
    decimals,
    number_text,
    signed_decimals,
    significant,
    values_on_grid,
)
from pretravel.task import QuantityWord

A: Colour = "series8"
B: Colour = "series5"
"""Colours of the two designs; neither of them is better as such."""


def design_comparison_document(
    probes: tuple[Probe, Probe],
    triggers: tuple[Trigger, Trigger],
    names: tuple[str, str],
    quantity: QuantityWord = "pretravel",
) -> Document:
    """The report of two designs.

    Parameters
    ----------
    probes : two Probes
    triggers : two Triggers
        Predicted for the same directions, a grid that contains polar angle 90°.
    names : two str
    quantity : str
        Of the verdict and the pictures.
    """
    title = f"A: {names[0]}, B: {names[1]}"
    first, second = (_Walls(trigger) for trigger in triggers)
    words, unit, _ = values_of(triggers[0], quantity)
    mean = [
        float(values_of(trigger, quantity)[2][walls.rows].mean())
        for trigger, walls in zip(triggers, (first, second), strict=True)
    ]
    return Document(
        title=title,
        verdict=f"{title}: on vertical walls the {words} of B is {_against(mean)} that of A: "
        f"{number_text(mean[1])} instead of {number_text(mean[0])} {unit} on average",
        figures=tuple(
            figure
            for name, one in (("A", first), ("B", second))
            for figure in (
                KeyFigure(f"trigger force on walls, {name}", Span.of(one.force), "N", decimals(3)),
                KeyFigure(f"pretravel on walls, {name}", Span.of(one.pretravel), "µm",
                          remark=f"range {number_text(float(np.ptp(one.pretravel)))} µm"),
            )
        ),
        tables=(_results_table(triggers), *_description_tables(probes)),
        pictures=(
            Picture(f"Both designs: force and {words} over directions"
                    if quantity != "pretravel"
                    else "Both designs: force and pretravel over directions, contributions",
                    lambda: design_comparison_view(triggers, names, quantity)),
        ),
        notes=(
            (
                f"Predicted by model {triggers[0].model}; a real probe differs from its "
                "description. Angles are in the frame of each probe."
            ),
        ),
        data=(Table.of(design_comparison_columns(triggers), "Predictions"),),
    )  # fmt: skip


class _Walls:
    """Force [N] and pretravel [µm] at polar angle 90°, and where."""

    def __init__(self, trigger: Trigger) -> None:
        self.rows = np.flatnonzero(np.abs(angles_deg(trigger.directions)[0] - 90.0) < 1e-6)
        self.force = trigger.force[self.rows]
        self.pretravel = trigger.pretravel[self.rows] / MICROMETRE
        self.azimuth = azimuth_angle(trigger.directions[self.rows])


def _against(mean: list[float]) -> str:
    share = 100.0 * (mean[1] / mean[0] - 1.0)
    if abs(share) < 0.05:
        return "the same as"
    return f"{number_text(abs(share), decimals(1))} % {'larger' if share > 0.0 else 'smaller'} than"


def results_of(trigger: Trigger) -> dict[str, float]:
    """What a design does, by name with unit.

    Returns
    -------
    mapping of str to float
    """
    walls = _Walls(trigger)
    pretravel = trigger.pretravel / MICROMETRE
    shares = {
        f"pretravel by {name.replace('_', ' ')}, mean on walls / µm": _rounded(
            share[walls.rows].mean()
        )
        for name, share in trigger.shares.items()
    }
    return {
        "trigger force on walls, smallest / N": float(walls.force.min()),
        "trigger force on walls, mean / N": float(walls.force.mean()),
        "trigger force on walls, largest / N": float(walls.force.max()),
        "trigger force, largest in all directions / N": float(trigger.force.max()),
        "pretravel on walls, largest / µm": float(walls.pretravel.max()),
        "pretravel on walls, mean / µm": float(walls.pretravel.mean()),
        "pretravel on walls, range / µm": float(np.ptp(walls.pretravel)),
        "pretravel in all directions, largest / µm": float(pretravel.max()),
        "pretravel in all directions, range / µm": float(np.ptp(pretravel)),
        **shares,
    }


def _rounded(length: float) -> float:
    """A length in µm; what is only rounding of the numbers is zero."""
    return float(length) / MICROMETRE if abs(length) > 1e-12 else 0.0


def _results_table(triggers: tuple[Trigger, Trigger]) -> Table:
    first, second = (results_of(trigger) for trigger in triggers)
    names = [*dict.fromkeys([*first, *second])]
    a, b = ([one.get(name, 0.0) for name in names] for one in (first, second))
    return Table(
        (
            Column.of("predicted", names),
            Column.of("A", a, digits=significant(3)),
            Column.of("B", b, digits=significant(3)),
            Column.of("B against A", _percent(a, b), "%", signed_decimals(1)),
        ),
        title="What the designs do",
    )


def elements_comparison_table(
    analytic: tuple[Trigger, Trigger],
    elements: tuple[Trigger, Trigger] | None = None,
    stresses: Sequence[Mapping[str, float]] = (),
) -> Table:
    """Two designs by the model analytic and by finite elements, next to each other.

    Parameters
    ----------
    analytic : two Triggers
    elements : two Triggers, optional
        In the same directions; without them their columns are empty.
    stresses : two mappings of str to float, optional
        `StressByDirection.figures` of each.

    Returns
    -------
    Table
        A quantity that a model does not have is an empty cell: finite elements have other
        contributions.
    """
    by_model = [
        [results_of(trigger) for trigger in analytic],
        [{}, {}] if elements is None else [results_of(trigger) for trigger in elements],
    ]
    for number, stress in enumerate(stresses):
        by_model[1][number] |= stress
    names = [*dict.fromkeys(name for model in by_model for one in model for name in one)]
    values, changes = [], []
    for words, model in zip(("", ", fem"), by_model, strict=True):
        # Of what one design alone has, such as a contact that opens, the other one has nothing.
        of_model = {name for one in model for name in one}
        a, b = (
            [one.get(name, 0.0) if name in of_model else math.nan for name in names]
            for one in model
        )
        values += [
            Column.of(f"{letter}{words}", column, digits=significant(3))
            for letter, column in (("A", a), ("B", b))
        ]
        changes.append(Column.of(f"B against A{words}", _percent(a, b), "%", signed_decimals(1)))
    beside = (values[0], values[2], values[1], values[3])
    return Table(
        (Column.of("predicted", names), *beside, *changes),
        title="Both designs, by both models",
        explanation="Columns with fem: by finite elements; the others: by the model analytic. "
        "A cell is empty where a model does not contain the quantity.",
    )


def _percent(a: list[float], b: list[float]) -> list[float]:
    return [
        100.0 * (new / old - 1.0) if old > 0.0 else math.nan for old, new in zip(a, b, strict=True)
    ]


def description_of(probe: Probe) -> dict[str, float | str]:
    """The numbers of a description that a prediction depends on, by name with unit.

    >>> from pretravel.prediction.catalogue import load_probe
    >>> description_of(load_probe("omp40-2"))["lever / mm"]
    64.4
    """
    values: dict[str, float | str] = {
        "preload / N": probe.preload,
        "lever / mm": probe.lever,
        "tripod radius / mm": probe.tripod.radius,
        "rod azimuths / °": ", ".join(f"{a / DEGREE:g}" for a in probe.tripod.rod_azimuths),
        "rod radius / mm": probe.tripod.rod_radius,
        "rods": probe.tripod.material.name,
        "support angle / °": probe.seats.support_angle / DEGREE,
        "seat ball radius / mm": probe.seats.ball_radius,
        "seat balls": probe.seats.material.name,
        "seat contact": probe.seats.contact,
        "hub offset / mm": probe.hub_offset,
        "tip diameter / mm": 2.0 * probe.tip.radius,
        "tip": probe.tip.material.name,
        "tip friction": probe.tip.friction,
        "criterion": probe.criterion,
        "threshold / N": probe.threshold,
        "contact opening / µm": "not stated" if probe.opening is None
        else probe.opening / MICROMETRE,
        "hub": "not described" if probe.hub is None else f"Ø {2.0 * probe.hub.radius:g} mm, "
        f"height {probe.hub.height:g} mm, holder Ø {probe.hub.holder_diameter:g} mm, "
        f"{probe.hub.material.name}",
        "solids": "as described" if probe.step is None else probe.step.path.name,
    }  # fmt: skip
    for number, part in enumerate(probe.stylus, start=1):
        values[f"stylus {number}"] = (
            f"{part.length:g} mm, Ø {part.diameter:g} mm, {part.material.name}"
        )
    return values


def _description_tables(probes: tuple[Probe, Probe]) -> tuple[Table, ...]:
    """The numbers of the descriptions that differ."""
    first, second = (description_of(probe) for probe in probes)
    names = [*dict.fromkeys([*first, *second])]
    differ = [name for name in names if first.get(name) != second.get(name)]
    if not differ:
        return ()
    columns = [Column.of("described", differ)]
    for name, values in (("A", first), ("B", second)):
        column = [values.get(key, "none") for key in differ]
        columns.append(Column.of(name, column, digits=significant(6)))
    return (Table(tuple(columns), title="What differs in the descriptions"),)


def design_comparison_columns(
    triggers: tuple[Trigger, Trigger],
) -> Mapping[str, npt.ArrayLike]:
    """Columns of a file: predicted quantities of both designs.

    Returns
    -------
    mapping of str to values
        quantity (with its unit), a, b.
    """
    first, second = (results_of(trigger) for trigger in triggers)
    names = [*dict.fromkeys([*first, *second])]
    return {
        "quantity": names,
        "a": [first.get(name, 0.0) for name in names],
        "b": [second.get(name, 0.0) for name in names],
    }


def design_comparison_view(
    triggers: tuple[Trigger, Trigger], names: tuple[str, str], quantity: QuantityWord = "pretravel"
) -> View:
    """Two designs overlaid.

    Parameters
    ----------
    triggers : two Triggers
        For the same directions, a grid that contains polar angle 90°.
    names : two str
    quantity : str
        In addition to the force; see `prediction_view`.

    Returns
    -------
    View
        Force and pretravel over azimuth on walls and over the polar angle, contributions on
        walls, and the difference of the pretravel over directions.

    References
    ----------
    Rodrigues 2021, Figures 4.27 to 4.36: force and sensing distance of two designs.
    """
    own = f"A: {names[0]}", f"B: {names[1]}"
    force = triggers[0].force, triggers[1].force
    if quantity != "pretravel":
        shown = [(force, Axis("trigger force", "N", low=0.0))]
        if quantity == "sensing_distance":
            words, unit, first = values_of(triggers[0], quantity)
            second = values_of(triggers[1], quantity)[2]
            shown.append(((first, second), Axis(words, unit, low=0.0)))
        return View(
            f"{own[0]}, {own[1]}",
            (
                *(_around(triggers, values, own, axis) for values, axis in shown),
                *(_over_polar(triggers, values, own, axis) for values, axis in shown),
            ),
        )
    pretravel = triggers[0].pretravel / MICROMETRE, triggers[1].pretravel / MICROMETRE
    charts: tuple[Chart, ...] = (
        _around(triggers, force, own, Axis("trigger force", "N", low=0.0)),
        _around(triggers, pretravel, own, Axis("pretravel", "µm", low=0.0)),
        _parts(triggers, own),
        _over_polar(triggers, force, own, Axis("trigger force", "N", low=0.0)),
        _over_polar(triggers, pretravel, own, Axis("pretravel", "µm", low=0.0)),
        *_difference(triggers),
    )
    return View(f"{own[0]}, {own[1]}", charts)


_Pair = tuple[FloatArray, FloatArray]


def _around(
    triggers: tuple[Trigger, Trigger], values: _Pair, names: tuple[str, str], axis: Axis
) -> PolarChart:
    lines = []
    for trigger, value, name, colour in zip(triggers, values, names, (A, B), strict=True):
        walls = _Walls(trigger)
        order = np.argsort(walls.azimuth)
        rows = walls.rows[np.append(order, order[0])]
        lines.append(LineMark(azimuth_angle(trigger.directions[rows]), value[rows], name, colour,
                              2.0, dashed=colour == B))  # fmt: skip
    return PolarChart(f"{axis.label} on walls (polar 90°)", axis, tuple(lines))


def _over_polar(
    triggers: tuple[Trigger, Trigger], values: _Pair, names: tuple[str, str], axis: Axis
) -> PlaneChart:
    """Range over the azimuths and mean, at each polar angle."""
    marks: list[Mark] = []
    for trigger, value, name, colour in zip(triggers, values, names, (A, B), strict=True):
        polar = np.round(angles_deg(trigger.directions)[0], 6)
        levels, (low, mean, high) = by_level(value, polar)
        marks.append(Area(levels, low, high, "", colour))
        marks.append(LineMark(levels, mean, name, colour, dashed=colour == B))
    note = "Lines: mean over the azimuths, bands: smallest to largest."
    return PlaneChart(
        f"{axis.label} over the polar angle", polar_axis(levels), axis, tuple(marks), note=note
    )


def _parts(triggers: tuple[Trigger, Trigger], names: tuple[str, str]) -> PlaneChart:
    """Mean share of each elastic part in the pretravel on walls."""
    rows = [_Walls(trigger).rows for trigger in triggers]
    parts = [*dict.fromkeys(name for trigger in triggers for name in trigger.shares)]
    marks: list[Mark] = []
    for place, (trigger, name, colour) in enumerate(zip(triggers, names, (A, B), strict=True)):
        none = np.zeros(len(trigger.force))
        mean = np.array([
            float(trigger.shares.get(part, none)[rows[place]].mean()) / MICROMETRE
            for part in parts
        ])  # fmt: skip
        at = np.arange(len(parts), dtype=np.float64) + 0.4 * (place - 0.5)
        marks.append(Bars(at, mean, name, colour, 0.38, horizontal=True,
                          texts=tuple(number_text(value) for value in mean)))  # fmt: skip
    words = tuple(part.replace("_", " ") for part in parts)
    longest = max(float(mark.values.max()) for mark in marks if isinstance(mark, Bars))
    return PlaneChart("contributions on walls", Axis("mean pretravel", "µm", 0.0, 1.2 * longest),
                      Axis("", categories=words), tuple(marks))  # fmt: skip


def _difference(triggers: tuple[Trigger, Trigger]) -> tuple[TopView, ...]:
    """Pretravel of B less that of A over all directions, where they are a grid."""
    polar, azimuth = (np.round(angle, 6) for angle in angles_deg(triggers[0].directions))
    change = (triggers[1].pretravel - triggers[0].pretravel) / MICROMETRE
    levels, turns, values = values_on_grid(polar, azimuth, change)
    if np.isnan(values).any() or len(levels) < 3:
        return ()
    scale = Scale.of("B − A", "µm", values, signed=True)
    return (TopView("pretravel of B − pretravel of A", levels, turns, values, scale),)
