"""Control chart of a probe: its verifications, and its drift."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

import numpy as np
import numpy.typing as npt

from pretravel.base import FloatArray
from pretravel.files import Entry
from pretravel.qualification import DriftOverTime
from pretravel.show import (
    Axis,
    Colour,
    Dots,
    LineMark,
    Mark,
    PlaneChart,
    Rule,
    Symbol,
    View,
    interval_lines,
    series,
)
from pretravel.tasks.history.drift_report import drift_charts
from pretravel.tasks.history.entries import decision_words, entry_value


def history_view(
    entries: Sequence[Entry], title: str = "", drift: DriftOverTime | None = None
) -> View:
    """The control chart of a probe.

    Parameters
    ----------
    entries : sequence of Entry
    title : str
    drift : DriftOverTime, optional
        Its charts are below.
    """
    charts = () if drift is None else drift_charts(drift)
    return View(title or "History of a probe", (*control_charts(entries), *charts), 1)


def control_charts(entries: Sequence[Entry]) -> tuple[PlaneChart, ...]:
    """Size over the verifications, with its limits, and the tests, with theirs.

    Parameters
    ----------
    entries : sequence of Entry
        Those without a size are left out.
    """
    known = [entry for entry in entries if entry["size_um"] is not None]
    if not known:
        nothing = "no verification has determined the size"
        return (
            PlaneChart(nothing, Axis("verification"), Axis("size − size of the map", "µm"), ()),
        )
    number = np.arange(len(known), dtype=np.float64)
    return _sizes_chart(known, number), _tests_chart(known, number)


def _time_axis(entries: Sequence[Entry]) -> Axis:
    """Times of the verifications; of many only some are written."""
    times = [datetime.fromisoformat(str(entry["time"])) for entry in entries]
    one_day = len({time.date() for time in times}) == 1
    minutes = len({f"{time:%H:%M}" for time in times}) == len(times)
    form = "%Y-%m-%d" if not one_day else "%H:%M" if minutes else "%H:%M:%S"
    step = max(-(-len(entries) // 4), 1)
    names = tuple(f"{time:{form}}" if i % step == 0 else "" for i, time in enumerate(times))
    what = f"verification, {times[0]:%Y-%m-%d} (UTC)" if one_day else "verification (UTC)"
    return Axis(what, "", -0.6, len(entries) - 0.4, names)


def _labels(entries: Sequence[Entry]) -> tuple[str, ...]:
    return tuple(
        f"{str(entry['time'])[:16].replace('T', ' ')} UTC, map {entry['map']}, "
        f"{decision_words(str(entry['decision']))}"
        for entry in entries
    )


def _sizes_chart(entries: Sequence[Entry], number: FloatArray) -> PlaneChart:
    """Size against that of the map, with three standard uncertainties."""
    size, u = _values(entries, "size_um"), _values(entries, "u_size_um")
    marks: list[Mark] = [
        Rule(0.0, "size of the map"),
        interval_lines(number, size - 3.0 * u, size + 3.0 * u, "± 3 u of the size"),
    ]
    maps = np.array([str(entry["map_id"]) for entry in entries])
    for own in dict.fromkeys(maps.tolist()):  # values of different maps are not joined
        rows = maps == own
        marks.append(LineMark(number[rows], size[rows], width=1.0))
    changed = np.array([bool(entry["changed"]) for entry in entries])
    labels = _labels(entries)
    for rows, symbol, colour, name in _verdicts(changed):
        at = np.flatnonzero(rows)
        if len(at):
            marks.append(Dots(number[at], size[at], name, colour, symbol=symbol, size=6.0,
                              labels=tuple(labels[row] for row in at)))  # fmt: skip
    accepted = [i for i, entry in enumerate(entries) if str(entry["decision"]) != "kept"]
    marks += [
        Rule(i + 0.5, "" if k else "a new map was accepted", "ink", upright=True)
        for k, i in enumerate(accepted)
    ]
    return PlaneChart("size of the pretravel at each verification", _time_axis(entries),
                      Axis("size − size of the map", "µm"), tuple(marks))  # fmt: skip


def _verdicts(
    changed: npt.NDArray[np.bool_],
) -> tuple[tuple[npt.NDArray[np.bool_], Symbol, Colour, str], ...]:
    return (~changed, "dot", "series1", "no change"), (changed, "diamond", "limit", "CHANGED")


def _tests_chart(entries: Sequence[Entry], number: FloatArray) -> PlaneChart:
    """How probable differences as large are without a change: below the limit is a change."""
    limit = 100.0 / 3.0 * _values(entries, "false_alarm_rate")  # three tests share the rate
    marks: list[Mark] = [
        LineMark(np.append(number[0] - 0.6, np.append(number, number[-1] + 0.6)),
                 np.append(limit[0], np.append(limit, limit[-1])),
                 "limit: below it the probe has CHANGED", "limit", dashed=True)
    ]  # fmt: skip
    labels = _labels(entries)
    for index, (column, name, symbol) in enumerate(_TESTS):
        percent = np.maximum(100.0 * _values(entries, column), _LEAST_PERCENT)
        marks.append(Dots(number, percent, name, series((0, 4, 3)[index]), symbol=symbol,
                          size=6.0 if index == 0 else 5.0, labels=labels))  # fmt: skip
    return PlaneChart(
        "how likely such differences are by chance", _time_axis(entries),
        Axis("probability by chance", "%", 0.5 * _LEAST_PERCENT, 200.0, logarithmic=True),
        tuple(marks), note=f"Smaller values are drawn at {_LEAST_PERCENT:g} %.",
    )  # fmt: skip


_LEAST_PERCENT = 1e-4
_TESTS: tuple[tuple[str, str, Symbol], ...] = (
    ("p_form", "size, amplitude, turn", "ring"),
    ("p_map", "all directions", "diamond"),
    ("p_repeatability", "scatter of repeats", "cross"),
)


def _values(entries: Sequence[Entry], column: str) -> FloatArray:
    return np.array([entry_value(entry, column) for entry in entries])
