"""Report and pictures of a study: spans of the outputs, what decides them, the best design."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from pretravel.design.studies.results import StudyResults
from pretravel.design.studies.sensitivity import Sensitivity, sensitivities
from pretravel.show import (
    Axis,
    Bars,
    Chart,
    Column,
    Document,
    Dots,
    KeyFigure,
    Picture,
    PlaneChart,
    Span,
    Table,
    View,
    decimals,
    number_text,
    shown_unit,
    significant,
    words_of_key,
)

_MAIN = (
    "pretravel_range",
    "pretravel_greatest",
    "sensing_distance_greatest",
    "trigger_force_least",
)
"""Outputs that the verdict speaks of: the first one that the study has."""
_MOST_FACTORS = 8
"""Charts of one picture."""
_MOST_DOTS = 4000


def study_document(results: StudyResults) -> Document:
    """The report of a study.

    Parameters
    ----------
    results : StudyResults

    Returns
    -------
    Document
    """
    main = main_output(results)
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


def main_output(results: StudyResults) -> str:
    """The output that the report is about."""
    known = [name for name in (*_MAIN, *results.numbers) if name in results.numbers]
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
    return (
        f"; {words_of_key(found.factors[first])[0]} explains most of its variance "
        f"({number_text(100.0 * share, decimals(0))} %)"
    )


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
            "Shares are those of a sum of one parabola for each factor; what is missing to 100 % "
            "is explained by factors together, or not by parabolas."
        )
    else:
        notes.append("Shares are main effects; what is missing to 100 % is of factors together.")
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
    for key, column in list(results.factors.items())[:_MOST_FACTORS]:
        x, axis = _places(column[good], key)
        dots = Dots(x, values[good], "designs", size=4.0)
        at = _places(column, key)[0][least]
        best = Dots(
            at, values[least], f"smallest {label.label}", "after", symbol="diamond", size=9.0
        )
        charts.append(PlaneChart(words_of_key(key)[0], axis, label, (dots, best)))
    return View(results.name, tuple(charts))


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
    marks = [_bars(places - 0.2, found.first, found.first_interval, order, "alone", "series1")]
    if np.isfinite(found.total).any():
        marks.append(
            _bars(places + 0.2, found.total, found.total_interval, order, "with others", "series2")
        )
    names = tuple(words_of_key(found.factors[i])[0] for i in order)
    axis = Axis("share in the variance", "%", low=0.0)
    chart = PlaneChart(
        f"what decides the {_words(found.output)}", Axis("", categories=names), axis, tuple(marks)
    )
    return View(chart.title, (chart,))


def _bars(
    places: npt.NDArray[np.float64], shares: npt.NDArray[np.float64],
    interval: npt.NDArray[np.float64], order: npt.NDArray[np.intp], name: str, colour: Any,
) -> Bars:  # fmt: skip
    half = 0.5 * np.ptp(interval, axis=1)
    return Bars(
        places, 100.0 * shares[order], name, colour, width=0.35,
        u=100.0 * half[order] if np.isfinite(half).all() else None,
    )  # fmt: skip
