"""Report and pictures of a study: spans of the outputs, what decides them, the best design."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import LinearNDInterpolator

from pretravel.base import PretravelError
from pretravel.design.studies.results import StudyResults
from pretravel.design.studies.sensitivity import Sensitivity, sensitivities
from pretravel.show import (
    Axis,
    Bars,
    Chart,
    Column,
    Contours,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Picture,
    PlaneChart,
    PolarChart,
    Scale,
    Span,
    Table,
    View,
    decimals,
    number_text,
    round_number,
    series,
    shown_unit,
    significant,
    words_of_key,
)
from pretravel.task import QuantityWord

_MAIN = (
    "pretravel_range",
    "pretravel_greatest",
    "sensing_distance_greatest",
    "trigger_force_least",
)
"""Outputs that the verdict speaks of: the first one that the study has."""
_OF_QUANTITY: Mapping[QuantityWord, tuple[str, ...]] = {
    "pretravel": _MAIN,
    "sensing_distance": ("sensing_distance_greatest", "sensing_distance_mean"),
    "trigger_force": ("trigger_force_greatest", "trigger_force_mean"),
}
_MOST_FACTORS = 8
"""Charts of one picture."""
_MOST_DOTS = 4000


def study_document(results: StudyResults, quantity: QuantityWord = "pretravel") -> Document:
    """The report of a study.

    Parameters
    ----------
    results : StudyResults
    quantity : str
        That the report is about; of outputs that the study does not have, another one.

    Raises
    ------
    PretravelError
        A study without outputs of this quantity.
    """
    main = main_output(results, quantity)
    failed = int(np.sum(~results.succeeded))
    title = f"{results.name}: {len(results)} designs of {results.probe}"
    if failed == len(results):
        return Document(
            title, verdict=f"{title}: none of them can be computed", tables=(_reasons(results),)
        )
    shares = sensitivities(results)
    found = next((one for one in shares if one.output == main), None)
    return Document(
        title=title,
        verdict=f"{title}: {_words(main)} {_range_text(results, main)}{_decided_by(found)}",
        figures=tuple(
            KeyFigure(_words(name), Span(*_ends(results, name)), _unit(results, name),
                      significant(4))
            for name in results.numbers if np.isfinite(results.numbers[name]).any()
        ),
        tables=(
            _best_table(results, main),
            *((_shares_table(shares),) if shares else ()),
            *((_reasons(results),) if failed else ()),
        ),
        pictures=(
            Picture(f"{_words(main)} over each factor", lambda: _factors_view(results, main)),
            *_curves_picture(results, quantity),
            *(
                ()
                if found is None
                else (Picture(f"What decides the {_words(main)}", lambda: _shares_view(found)),)
            ),
        ),
        notes=_notes(results, found),
        warnings=(
            (f"{failed} of {len(results)} designs cannot be computed; the reasons are in a table",)
            if failed else ()
        ),
    )  # fmt: skip


def main_output(results: StudyResults, quantity: QuantityWord = "pretravel") -> str:
    """The output that the report is about.

    Raises
    ------
    PretravelError
        A study without outputs of another quantity than pretravel that is wanted.
    """
    first = [name for name in _OF_QUANTITY[quantity] if name in results.numbers]
    if quantity != "pretravel" and not first:
        raise PretravelError(
            f"the study has no {quantity.replace('_', ' ')} among its outputs "
            f"({', '.join(results.numbers)}): add it to outputs of [study]",
            inputs=("quantity",),
        )
    known = [*first, *results.numbers]
    finite = [name for name in known if np.isfinite(results.numbers[name]).any()]
    return (finite or known)[0]


def _words(name: str) -> str:
    return name.replace("_", " ")


def _unit(results: StudyResults, name: str) -> str:
    return shown_unit(results.meanings[name].unit)


def _ends(results: StudyResults, name: str) -> tuple[float, float]:
    return float(np.nanmin(results.numbers[name])), float(np.nanmax(results.numbers[name]))


def _range_text(results: StudyResults, name: str) -> str:
    low, high = (number_text(value, significant(3)) for value in _ends(results, name))
    return f"{low} to {high} {_unit(results, name)}"


def _decided_by(found: Sensitivity | None) -> str:
    if found is None:
        return ""
    first = int(np.nanargmax(found.shares))
    share = min(float(found.shares[first]), 1.0)
    of, _, what = words_of_key(found.factors[first])[0].rpartition(": ")
    named = f"{what} of {of.replace(': ', ' ')}" if of else what
    return f"; {named} explains most of its variance ({number_text(100.0 * share, decimals(0))} %)"


def _notes(results: StudyResults, found: Sensitivity | None) -> tuple[str, ...]:
    notes = ["A real probe differs from its description."]
    if found is None:
        return tuple(notes)
    if results.plan == "sobol":
        notes.append(
            f"Shares are Sobol' indices from {found.samples} base samples, with intervals of 95 % "
            "by resampling: alone, and together with other factors."
        )
    elif results.plan == "latin-hypercube":
        notes.append(
            "Shares are those of a sum of one parabola for each factor; the rest to 100 % is due "
            "to interactions of factors, or not a parabola."
        )
    else:
        notes.append("Shares are main effects; the rest to 100 % is from interactions.")
    return tuple(notes)


def _best_table(results: StudyResults, main: str) -> Table:
    """The designs with the smallest and the largest value of the main output."""
    values = results.numbers[main]
    rows = [int(np.nanargmin(values)), int(np.nanargmax(values))]
    return Table(
        (
            Column("design", ("smallest", "largest")),
            Column.of(_words(main), values[rows], _unit(results, main), significant(4)),
            *(
                Column.of(words, _cells(column[rows]), unit, significant(4))
                for (words, unit), column in (
                    (words_of_key(key), column) for key, column in results.factors.items()
                )
            ),
        ),
        title=f"Designs with the smallest and the largest {_words(main)}",
    )


def _cells(values: npt.NDArray[Any]) -> list[float | str]:
    return [value if isinstance(value, str) else float(value) for value in values.tolist()]


def _shares_table(known: Sequence[Sensitivity]) -> Table:
    """For each factor its share in the variance of each output."""
    return Table(
        (
            Column("output", tuple(_words(one.output) for one in known)),
            *(
                Column.of(words_of_key(key)[0], 100.0 * np.array([o.shares[i] for o in known]),
                          "%", decimals(0))
                for i, key in enumerate(known[0].factors)
            ),
        ),
        title="Share of each factor in the variance of the outputs",
        explanation="Of Sobol' plans together with other factors, else alone.",
    )  # fmt: skip


def _reasons(results: StudyResults) -> Table:
    counted = Counter(reason for reason in results.reasons if reason).most_common()
    return Table(
        (
            Column("why it cannot be computed", tuple(reason for reason, _ in counted)),
            Column("designs", tuple(float(count) for _, count in counted), "", decimals(0)),
        ),
        title="Designs that cannot be computed",
    )


def _factors_view(results: StudyResults, main: str) -> View:
    """The main output over each factor, with the design that has the smallest one."""
    values = results.numbers[main]
    good = np.flatnonzero(np.isfinite(values))
    least = good[[np.argmin(values[good])]]
    good = good[:: max(1, len(good) // _MOST_DOTS)]
    label = Axis(_words(main), _unit(results, main))
    charts: list[Chart] = []
    together = [
        chart
        for chart in (_contours(results, values, label), _both_factors(results, values, label))
        if chart is not None
    ]
    if together:
        return View(results.name, tuple(together), 2)
    for key, column in list(results.factors.items())[:_MOST_FACTORS]:
        x, axis = _places(column[good], key)
        dots = Dots(x, values[good], "designs", size=4.0)
        at = _places(column, key)[0][least]
        best = Dots(
            at, values[least], f"smallest {label.label}", "after", symbol="diamond", size=9.0
        )
        charts.append(PlaneChart(words_of_key(key)[0], axis, label, (dots, best)))
    return View(results.name, tuple(charts))


_FEWEST_LEVELS = 3
"""Of a factor from which contours are drawn."""
_MOST_LEVELS = 8
"""Lines of one chart."""


_FINE = 41
"""Places along each axis of contours between designs that do not stand in a grid."""


def _contours(
    results: StudyResults, values: npt.NDArray[np.float64], label: Axis
) -> PlaneChart | None:
    """The main output over two factors that are numbers, with the designs.

    Between designs that do not stand in a grid it is interpolated linearly. None for other studies.
    """
    keys = list(results.factors)
    if len(keys) != 2 or any(results.factors[key].dtype == object for key in keys):
        return None
    good = np.isfinite(values)
    (x, across), (y, along) = (_places(results.factors[key], key) for key in keys)
    levels = [np.unique(column[good]) for column in (x, y)]
    if min(map(len, levels)) < _FEWEST_LEVELS:
        return None
    places = levels
    if len(levels[0]) * len(levels[1]) != len(values):
        places = [np.linspace(level[0], level[-1], _FINE) for level in levels]
    size = [np.ptp(level) for level in levels]
    surface = LinearNDInterpolator(np.column_stack([x / size[0], y / size[1]])[good], values[good])
    field = surface(*np.meshgrid(places[0] / size[0], places[1] / size[1]))
    low, high = float(values[good].min()), float(values[good].max())
    step = round_number((high - low) / 7.0)
    ends = step * np.floor(low / step), step * np.ceil(high / step)
    scale = Scale(label.label, label.unit, float(ends[0]), float(ends[1]))
    least = np.flatnonzero(good)[[np.argmin(values[good])]]
    return PlaneChart(
        f"{label.label} over both factors",
        _with_room(across, levels[0]),
        _with_room(along, levels[1]),
        (
            Contours(places[0], places[1], field, step),
            Dots(x[good], y[good], "designs", "ink", symbol="ring", size=4.0),
            Dots(
                x[least], y[least], f"smallest {label.label}", "after", symbol="diamond", size=9.0
            ),
        ),
        scale,
    )


def _with_room(axis: Axis, levels: npt.NDArray[np.float64]) -> Axis:
    """An axis on which the designs at the ends are seen whole."""
    room = 0.04 * float(np.ptp(levels))
    return replace(axis, low=float(levels[0]) - room, high=float(levels[-1]) + room)


def _both_factors(
    results: StudyResults, values: npt.NDArray[np.float64], label: Axis
) -> PlaneChart | None:
    """Two factors in every combination: over one of them, a line for each level of the other.

    None for other studies.
    """
    keys = list(results.factors)
    if len(keys) != 2:
        return None
    counts = [len(set(results.factors[key].tolist())) for key in keys]
    if min(counts) < 2 or max(counts) < 3 or counts[0] * counts[1] != len(values):
        return None
    over, lines = keys if counts[0] >= counts[1] else keys[::-1]
    if min(counts) > _MOST_LEVELS:
        return None
    x, axis = _places(results.factors[over], over)
    words, unit = words_of_key(lines)
    levels = list(dict.fromkeys(results.factors[lines].tolist()))
    marks = []
    for number, level in enumerate(levels):
        rows = np.flatnonzero(results.factors[lines] == level)
        rows = rows[np.argsort(x[rows])]
        value = level if isinstance(level, str) else number_text(float(level))
        name = " ".join(part for part in (words, str(value), unit) if part)
        marks.append(LineMark(x[rows], values[rows], name, series(number), marked=True))
    return PlaneChart(f"{label.label} over {words_of_key(over)[0]}", axis, label, tuple(marks))


def _curves_picture(results: StudyResults, quantity: QuantityWord) -> tuple[Picture, ...]:
    """The quantity over the azimuth, a curve for each design, where these are few."""
    good = np.flatnonzero(results.succeeded)
    if quantity not in results.on_walls or not 1 <= len(good) <= _MOST_LEVELS:
        return ()
    if len(results.azimuth) < 3:
        return ()
    words = quantity.replace("_", " ")
    return (Picture(f"{words} over the azimuth", lambda: _curves_view(results, quantity, good)),)


def _curves_view(results: StudyResults, quantity: QuantityWord, rows: npt.NDArray[np.intp]) -> View:
    """Force and the quantity over the azimuth on walls (Rodrigues 2021, Figures 4.27 to 4.36)."""
    names = ["trigger_force", *(() if quantity == "trigger_force" else (quantity,))]
    order = np.argsort(results.azimuth)
    closed = np.append(order, order[0])
    charts = []
    for name in names:
        unit = "N" if name == "trigger_force" else "µm"
        words = name.replace("_", " ")
        lines = tuple(
            LineMark(results.azimuth[closed], results.on_walls[name][row][closed],
                     _design_words(results, int(row)), series(number))
            for number, row in enumerate(rows)
        )  # fmt: skip
        charts.append(PolarChart(f"{words} over the azimuth", Axis(words, unit, low=0.0), lines))
    return View(results.name, tuple(charts))


def _design_words(results: StudyResults, row: int) -> str:
    """The levels of a design: preload 4 N."""
    parts = []
    for key, column in results.factors.items():
        words, unit = words_of_key(key)
        value = column[row]
        text = value if isinstance(value, str) else number_text(float(value))
        parts.append(" ".join(part for part in (words, text, unit) if part))
    return ", ".join(parts)


def _places(column: npt.NDArray[Any], key: str) -> tuple[npt.NDArray[np.float64], Axis]:
    words, unit = words_of_key(key)
    if column.dtype != object:
        return np.asarray(column, np.float64), Axis(words, unit)
    texts = list(dict.fromkeys(column.tolist()))
    places = np.array([float(texts.index(text)) for text in column])
    return places, Axis(words, categories=tuple(texts))


def _shares_view(found: Sensitivity) -> View:
    """Bars of the shares with their intervals."""
    order = np.argsort(-found.shares)
    places = np.arange(len(order), dtype=np.float64)
    both = bool(np.isfinite(found.total).any())
    above = places - 0.2 * both  # a bar alone stands at its name
    marks = [_bars(above, found.first, found.first_interval, order, "alone", "series1")]
    if both:
        marks.append(
            _bars(places + 0.2, found.total, found.total_interval, order, "with others", "series2")
        )
    names = tuple(words_of_key(found.factors[i])[0] for i in order)
    axis = Axis("share in the variance", "%", low=0.0)
    chart = PlaneChart(
        f"what decides the {_words(found.output)}", axis, Axis("", categories=names), tuple(marks)
    )
    return View(chart.title, (chart,))


def _bars(
    places: npt.NDArray[np.float64], shares: npt.NDArray[np.float64],
    interval: npt.NDArray[np.float64], order: npt.NDArray[np.intp], name: str, colour: Any,
) -> Bars:  # fmt: skip
    half = 0.5 * np.ptp(interval, axis=1)
    return Bars(
        places, 100.0 * shares[order], name, colour, width=0.35, horizontal=True,
        u=100.0 * half[order] if np.isfinite(half).all() else None,
    )  # fmt: skip
