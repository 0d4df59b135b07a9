"""Report of a search: the best design and the one it started from."""

from __future__ import annotations

import math

import numpy as np

from pretravel.base import FloatArray, grid
from pretravel.design.studies.conditions import case_of
from pretravel.design.studies.definition import Factor, Level
from pretravel.design.studies.design_search import FoundDesign, TriedDesign
from pretravel.design.studies.wish import known_quantities
from pretravel.design.tasks.predict.view import prediction_view
from pretravel.prediction import predict, seat_doubts
from pretravel.show import (
    Axis,
    Column,
    Document,
    Dots,
    LineMark,
    Picture,
    PlaneChart,
    Rule,
    Table,
    View,
    decimals,
    number_text,
    shown_unit,
    significant,
)


def design_document(found: FoundDesign) -> Document:
    """The report of the best design."""
    wish = found.wish
    goal, study = wish.goal, wish.study
    before, after = (d.quantities[goal] for d in (found.start, found.best))
    unit = shown_unit(known_quantities()[goal].unit)
    share = f" ({number_text(100.0 * (after / before - 1.0), decimals(0))} %)" if before else ""
    title = f"{study.name}: the best of {found.tried} designs of {study.probe}"
    case = case_of(study, found.best.levels)
    model = case.prediction.model
    return Document(
        title=title,
        verdict=f"{title}: {_words(goal)} {number_text(after, significant(4))} {unit} "
        f"instead of {number_text(before, significant(4))} {unit}{share}",
        tables=(_free_table(found), _quantities_table(found), *_front_tables(found)),
        pictures=(
            *_front_pictures(found, title),
            Picture(
                "Force and pretravel of the best design, and the contributions to the pretravel",
                lambda: prediction_view(
                    predict(case.probe, _directions(found), model, workpiece=case.part), title
                ),
            ),
        ),
        warnings=seat_doubts(case.probe),
        notes=(
            (
                f"Predicted by model {model}. Predict the description with model fem before you "
                "build it. Where a free quantity lies at an end of its range, the range decides it."
            ),
        ),
    )


def _directions(found: FoundDesign) -> FloatArray:
    return grid(found.wish.study.directions.polar, found.wish.study.directions.azimuth)


def _words(quantity: str) -> str:
    """A quantity of a specification as a reader sees it."""
    return quantity.replace("_", " ").replace("pretravel lobes", "pretravel lobe amplitude")


def _free_table(found: FoundDesign) -> Table:
    factors = found.wish.study.factors
    return Table(
        (
            Column("free quantity", tuple(factor.key for factor in factors)),
            Column("best", tuple(_cell(found.best.levels[f.key]) for f in factors), "",
                   significant(5)),
            Column(
                "at an end of its range",
                tuple(_at_end(f, found.best.levels[f.key]) for f in factors),
            ),
        ),
        title="The best design",
    )  # fmt: skip


def _cell(value: Level) -> float | str:
    return value if isinstance(value, str) else float(value)


def _at_end(factor: Factor, value: Level) -> str:
    if factor.range is None or isinstance(value, str):
        return ""
    low, high = factor.range
    near = 1e-3 * (high - low)
    if value <= low + near:
        return "lower end of the range"
    return "upper end of the range" if value >= high - near else ""


def _quantities_table(found: FoundDesign) -> Table:
    limits = {limit.of: limit for limit in found.wish.limits}
    names = list(found.best.quantities)
    meanings = known_quantities()
    return Table(
        (
            Column("quantity", tuple(_words(name) for name in names)),
            Column("unit", tuple(shown_unit(meanings[name].unit) for name in names)),
            Column.of("start", [found.start.quantities[n] for n in names], "", significant(4)),
            Column.of("best", [found.best.quantities[n] for n in names], "", significant(4)),
            Column.of("at least", [_end(limits.get(n), "at_least") for n in names], "",
                      significant(4)),
            Column.of("at most", [_end(limits.get(n), "at_most") for n in names], "",
                      significant(4)),
            Column("limit", tuple(_reached(limits.get(n), found.best.quantities[n])
                                  for n in names)),
        ),
        title="What it does",
    )  # fmt: skip


def _end(limit: object, name: str) -> float:
    value = getattr(limit, name, math.nan)
    return value if math.isfinite(value) else math.nan


def _reached(limit: object, value: float) -> str:
    """Whether the best design lies at a limit, up to what the search leaves."""
    ends = [_end(limit, name) for name in ("at_least", "at_most")]
    return "reached" if any(abs(value - end) <= 2e-3 * abs(end) for end in ends) else ""


def _front_pictures(found: FoundDesign, title: str) -> tuple[Picture, ...]:
    """The front of two goals; the main picture where there is one."""
    if not found.front:
        return ()
    return (
        Picture(
            "Best designs between the two goals, and the design at the start",
            lambda: View(title, (front_chart(found),), columns=1),
        ),
    )


def front_chart(found: FoundDesign) -> PlaneChart:
    """The best designs between two goals (the Pareto front), and the design at the start.

    Parameters
    ----------
    found : FoundDesign
        With a second goal.
    """
    names = (found.wish.goal, found.wish.second)
    axes = [Axis(_words(name), shown_unit(known_quantities()[name].unit)) for name in names]
    x, y = (np.array([d.quantities[n] for d in found.front]) for n in names)
    start = [found.start.quantities[name] for name in names]
    labels = tuple(_levels_text(design) for design in found.front)
    kept = [
        Rule(end, "limit", upright=axis == 0)
        for axis, name in enumerate(names)
        for limit in found.wish.limits
        if limit.of == name
        for end in (limit.at_least, limit.at_most)
        if math.isfinite(end)
    ]
    return PlaneChart(
        "No design found is better in both",
        axes[0],
        axes[1],
        (
            *kept,
            LineMark(x, y, "best designs"),
            Dots(x, y, labels=labels, size=7.0),
            Dots(np.array(start[:1]), np.array(start[1:]), "start", "series2", symbol="diamond",
                 size=9.0),
        ),
    )  # fmt: skip


def _levels_text(design: TriedDesign) -> str:
    """The free quantities of a design, for who points at it."""
    shown = (
        f"{key} {value if isinstance(value, str) else number_text(float(value), significant(4))}"
        for key, value in design.levels.items()
    )
    return ", ".join(shown)


def _front_tables(found: FoundDesign) -> tuple[Table, ...]:
    if not found.front:
        return ()
    names = (found.wish.goal, found.wish.second)
    keys = [factor.key for factor in found.wish.study.factors]
    return (
        Table(
            (
                *(
                    Column.of(_words(n), [d.quantities[n] for d in found.front], "",
                              significant(4))
                    for n in names
                ),
                *(
                    Column(key, tuple(_cell(d.levels[key]) for d in found.front), "",
                           significant(4))
                    for key in keys
                ),
            ),
            title="Best designs between the two goals: none is worse than another one in both",
        ),
    )  # fmt: skip
