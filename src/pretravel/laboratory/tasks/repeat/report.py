"""Report and picture of touches of one point: noise, drift, first touch, the next touch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE
from pretravel.laboratory.repeat_series import (
    RepeatSeries,
    autocorrelation,
    touches_before_drift,
)
from pretravel.show import (
    Area,
    Axis,
    Bars,
    Column,
    Digits,
    Document,
    Dots,
    KeyFigure,
    LineMark,
    Mark,
    Picture,
    PlaneChart,
    Rule,
    Table,
    View,
    decimals,
    significant,
    value_text,
)

NamedSeries: TypeAlias = tuple[str, RepeatSeries, Sequence[int]]
"""Name, what its touches say, and the line of each."""
_TWO = significant(2)
_SIGNED = Digits(2, significant=True, signed=True)
_MOST_CHARTS = 4
"""Series that the picture shows."""


def repeat_document(
    title: str,
    series: Sequence[NamedSeries],
    *,
    single: int = 0,
    along: str = "",
    warnings: tuple[str, ...] = (),
) -> Document:
    """The report of touches of one point or a few.

    Parameters
    ----------
    title : str
        The name of the file.
    series : sequence of NamedSeries
    single : int
        Touches of points that were touched too seldom.
    along : str
        The direction of the touches.
    warnings : tuple of str

    Returns
    -------
    Document
        Its answer is that of the series whose next touch is the least certain.
    """
    name, worst, lines = max(series, key=lambda one: _width(one[1]))
    figures = (*_figures(worst, lines), KeyFigure("what to do", _advice(worst)))
    notes = [f"Values are positions along {along}."] if along else []
    if single:
        notes.append(f"{single} touches are of points with fewer than five touches: not evaluated.")
    if len(series) > 1:
        notes.append(f"The figures are those of {name}, whose next touch is the least certain.")
    return Document(
        title=f"{title}: how a touch repeats",
        verdict=(f"{name}: " if len(series) > 1 else "") + answer_sentence(worst),
        figures=figures,
        tables=(_series_table(series),) if len(series) > 1 else (),
        pictures=(
            Picture(
                "Touches, contributions to their scatter, and residuals",
                lambda: repeat_view(series),
            ),
        ),
        notes=tuple(notes),
        warnings=warnings,
        data=(Table.of(repeat_columns(series), "Touches"),),
    )


def _width(judged: RepeatSeries) -> float:
    return judged.reach if math.isfinite(judged.reach) else 0.0


def answer_sentence(judged: RepeatSeries) -> str:
    """The answer to: and if I touch once more?"""
    if not math.isfinite(judged.reach):
        return (
            "the touches are equal to the last digit: the noise is below the step of the "
            "positions, which the log does not show. Give the step to get an answer"
        )
    reach = _um(judged.reach)
    expected = value_text(judged.expected, "mm", decimals(4))
    return f"the next touch will differ by less than {reach} from {expected}, in 95 % of cases"


def _figures(judged: RepeatSeries, lines: Sequence[int]) -> tuple[KeyFigure, ...]:
    plain = _um(judged.plain_deviation)
    inside = [word for word, on in (("drift", judged.drifts or judged.walks),
                                    ("the first touch", judged.first.apart),
                                    ("outliers", bool(judged.outliers)),
                                    ("a jump", bool(judged.jumps))) if on]  # fmt: skip
    contained = f", which contains {' and '.join(inside)}" if inside else ""
    return (
        KeyFigure("touches", _touches_words(judged)),
        KeyFigure("noise of a touch", judged.noise / MICROMETRE, "µm", _digits(judged.noise),
                  remark=f"standard deviation; of all touches {plain}{contained}"),
        KeyFigure("drift", judged.drift / MICROMETRE, "µm/touch",
                  _digits(judged.drift, signed=True),
                  remark=f"U = {_um(judged.drift_u95)}; {_drift_words(judged)}"),
        KeyFigure("first touch differs", _first_words(judged)),
        KeyFigure("step of the positions", _step_words(judged)),
        KeyFigure("outliers and jumps", _breaks_words(judged, lines)),
    )  # fmt: skip


def _touches_words(judged: RepeatSeries) -> str:
    count, left_out = len(judged.values), int(np.sum(~np.asarray(judged.kept)))
    if not left_out:
        return f"{count}"
    return f"{count}, of which {left_out} {'is' if left_out == 1 else 'are'} left out of the noise"


def _um(length: float) -> str:
    return value_text(length / MICROMETRE, "µm", _digits(length))


def _signed_um(length: float) -> str:
    return value_text(length / MICROMETRE, "µm", _digits(length, signed=True))


def _digits(length: float, *, signed: bool = False) -> Digits:
    """Digits of a length in µm: two that count, none finer than a nanometre."""
    size = abs(length) / MICROMETRE
    if not math.isfinite(size) or size < 1e-3:
        return Digits(3, signed=signed)
    return Digits(min(max(1 - math.floor(math.log10(size)), 0), 3), signed=signed)


def _drift_words(judged: RepeatSeries) -> str:
    if judged.drifts:
        return "a drift"
    if judged.walks:
        return "the level walks at random, not steadily"
    return "no drift is detected"


def _first_words(judged: RepeatSeries) -> str:
    first = judged.first
    if not math.isfinite(first.size):
        return "unknown: the touches before the first jump are too few"
    size = _signed_um(first.size)
    if first.apart:
        return f"yes, by {size} (u = {_um(first.u)})"
    if judged.step and 0.5 * judged.step < abs(first.size) <= 1.5 * judged.step:
        return f"no: {size} is one step of the positions, which rounding makes too"
    share = float(f"{100.0 * first.p_value:.2g}")  # 100, not 1e+02
    chance = f"by chance the first touch differs as much in {share:g} % of series"
    return f"no: {size} is within the noise ({chance})"


def _step_words(judged: RepeatSeries) -> str:
    if not judged.step:
        return "none seen"
    return f"{_um(judged.step)}, or an integer fraction of it: the resolution of one touch"


def _breaks_words(judged: RepeatSeries, lines: Sequence[int]) -> str:
    words = [
        f"{kind} at touch {one.day + 1} (line {lines[one.day]}) by " + _signed_um(one.size)
        for kind, found in (("outlier", judged.outliers), ("jump", judged.jumps))
        for one in found
    ]
    return ", ".join(words) or "none"


def _advice(judged: RepeatSeries) -> str:
    """What to do, the most useful first."""
    words = []
    if judged.first.apart:
        words.append("discard the first touch of each series")
    if judged.jumps:
        words.append("find the reason of the jump: lost steps, a loose mount, something knocked")
    if judged.drifts:
        count = touches_before_drift(judged)
        words.append(
            "wait until the drift ends, or find its reason (warming up, lost steps); a mean of "
            f"more than {count} touch{'es' if count > 1 else ''} contains more drift than noise"
        )
    elif judged.walks:
        words.append("repeats help little: the level moves between the touches")
    elif math.isfinite(judged.reach) and judged.noise > judged.step:
        words.append(
            f"the mean of 4 touches has a noise of {_um(0.5 * judged.noise)}, of 9 touches "
            f"{_um(judged.noise / 3.0)}"
        )
    else:
        words.append("one touch is enough: repeats show the step of the positions, not the noise")
    if judged.outliers:
        words.append("take the median of three touches or more: it is not moved by an outlier")
    return "; ".join(words)


def _series_table(series: Sequence[NamedSeries]) -> Table:
    judged = [one for _, one, _ in series]

    def lengths(values: Sequence[float]) -> list[float]:
        return [value / MICROMETRE for value in values]

    return Table(
        (
            Column.of("series", [name for name, _, _ in series]),
            Column.of("touches", [float(len(one.values)) for one in judged], "", decimals(0)),
            Column.of("next within", lengths([one.reach for one in judged]), "µm", _TWO),
            Column.of("noise", lengths([one.noise for one in judged]), "µm", _TWO),
            Column.of("all touches", lengths([one.plain_deviation for one in judged]), "µm", _TWO),
            Column.of("drift per touch", lengths([one.drift for one in judged]), "µm", _SIGNED),
            Column.of("U", lengths([one.drift_u95 for one in judged]), "µm", _TWO),
            Column.of("first − others", lengths([one.first.size for one in judged]), "µm",
                      _SIGNED),
            Column.of("differs", ["yes" if one.first.apart else "no" for one in judged]),
            Column.of("outliers", [float(len(one.outliers)) for one in judged], "", decimals(0)),
            Column.of("jumps", [float(len(one.jumps)) for one in judged], "", decimals(0)),
        ),
        "Each series",
        "next within: half of the interval of 95 % of the next touch; all touches: their standard "
        "deviation, with drift and first touch in it.",
    )  # fmt: skip


def repeat_columns(series: Sequence[NamedSeries]) -> dict[str, npt.ArrayLike]:
    """Columns of a file: a row for each touch.

    Returns
    -------
    mapping of str to values
        series, touch, line, position_mm, usual (1 or 0), level_mm, left_um.
    """
    found: dict[str, list[object]] = {
        name: []
        for name in ("series", "touch", "line", "position_mm", "usual", "level_mm", "left_um")
    }
    for name, one, lines in series:
        for row, value in enumerate(one.values.tolist()):
            level = float(one.line[row])
            cells = (name or "1", row + 1, int(lines[row]), value, int(one.kept[row]), level,
                     (value - level) / MICROMETRE)  # fmt: skip
            for column, cell in zip(found.values(), cells, strict=True):
                column.append(cell)
    return {
        name: [str(cell) for cell in cells] if name == "series" else np.array(cells, dtype=float)
        for name, cells in found.items()
    }


def repeat_view(series: Sequence[NamedSeries]) -> View:
    """The touches with level and next touch, their parts, the correlation of what is left.

    Parameters
    ----------
    series : sequence of NamedSeries
        Of many the first ones are shown.
    """
    charts = []
    for name, judged, _ in series[:_MOST_CHARTS]:
        title = f"{name}: " if name else ""
        charts += [_touches_chart(judged, title), _parts_chart(judged, title),
                   _correlation_chart(judged, title)]  # fmt: skip
    return View("How a touch repeats", tuple(charts), 3)


def _touches_chart(judged: RepeatSeries, title: str) -> PlaneChart:
    middle = float(np.median(judged.values))
    y = (judged.values - middle) / MICROMETRE
    number = np.arange(1.0, len(y) + 1.0)
    kept = np.asarray(judged.kept)
    line = (judged.line - middle) / MICROMETRE
    following = number >= (judged.jumps[-1].day + 1 if judged.jumps else 1)
    marks: list[Mark] = []
    if math.isfinite(judged.reach):
        reach, after = judged.reach / MICROMETRE, (judged.expected - middle) / MICROMETRE
        place = np.array([len(y) + 0.6, len(y) + 1.4])
        marks.append(Area(place, np.full(2, after - reach), np.full(2, after + reach),
                          "next touch, 95 %", "zone", 0.3))  # fmt: skip
    words = "level and drift" if judged.drifts else "level, and a drift that is not detected"
    marks += [
        LineMark(number[following], line[following], words, "reference"),
        Dots(number[kept], y[kept], "touches", "series1"),
    ]
    if not kept.all():
        marks.append(Dots(number[~kept], y[~kept], "left out", "limit", symbol="diamond", size=7.0))
    return PlaneChart(f"{title}touches", Axis("touch", "", 0.4, len(y) + 1.8),
                      Axis(f"position − {middle:.4f} mm", "µm"), tuple(marks))  # fmt: skip


def _parts_chart(judged: RepeatSeries, title: str) -> PlaneChart:
    """Sizes of what moves the touches, in addition to the plain standard deviation."""
    first = abs(judged.first.size) if math.isfinite(judged.first.size) else 0.0
    parts = (
        ("standard deviation", judged.plain_deviation),
        ("noise", judged.noise),
        (
            "drift over the series" if judged.drifts else "drift (not detected)",
            abs(judged.drift) * (len(judged.values) - 1),
        ),
        ("first touch differs" if judged.first.apart else "first touch (in the noise)", first),
        ("step", judged.step),
    )
    sizes = np.array([size / MICROMETRE for _, size in parts])
    bars = Bars(np.arange(float(len(parts))), sizes, "", "series1", horizontal=True,
                texts=tuple(_um(size) for _, size in parts))  # fmt: skip
    return PlaneChart(f"{title}scatter", Axis("size", "µm", 0.0, 1.35 * float(sizes.max()) or 1.0),
                      Axis("", categories=tuple(name for name, _ in parts)), (bars,))  # fmt: skip


def _correlation_chart(judged: RepeatSeries, title: str) -> PlaneChart:
    found = autocorrelation(judged.left)
    limit = 2.0 / math.sqrt(max(len(judged.left), 1))
    marks: tuple[Mark, ...] = (
        Bars(np.arange(1.0, len(found) + 1.0), found, "residuals", "series1"),
        Rule(limit, "95 % of independent errors", "limit"),
        Rule(-limit, "", "limit"),
        Rule(0.0),
    )
    return PlaneChart(f"{title}residuals, some touches later", Axis("touches later"),
                      Axis("correlation", "", -1.0, 1.0), marks)  # fmt: skip
