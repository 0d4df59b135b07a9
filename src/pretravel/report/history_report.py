"""Report and control chart of the history of a probe: all its verifications."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.formats.probe_history import Entry
from pretravel.report.document import Column, Document, Picture, Table
from pretravel.report.formatting import decimals, signed_decimals
from pretravel.report.style import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def history_document(entries: Sequence[Entry], *, history_name: str = "") -> Document:
    """The report of a history: a row for each verification.

    Parameters
    ----------
    entries : sequence of Entry
    history_name : str
        Of the file.

    Returns
    -------
    Document
    """
    title = history_name or "History of a probe"
    changed = sum(bool(entry["changed"]) for entry in entries)
    return Document(
        title=title,
        verdict=f"{title}: {len(entries)} verifications, {changed} of them found a change",
        tables=(_verifications_table(entries),),
        pictures=(Picture("Control chart", lambda: plot_history(entries, title)),),
    )


def _verifications_table(entries: Sequence[Entry]) -> Table:
    def numbers(column: str) -> list[float]:
        return [_value(entry, column) for entry in entries]

    times = [str(entry["time"])[:16].replace("T", " ") for entry in entries]
    verdicts = ["CHANGED" if entry["changed"] else "no change" for entry in entries]
    return Table(
        (
            Column.of("time (UTC)", times),
            Column.of("map", [str(entry["map"]) for entry in entries]),
            Column.of("verdict", verdicts),
            Column.of("size", numbers("size_um"), "µm", signed_decimals(2)),
            Column.of("amplitude", numbers("amplitude_percent"), "%", signed_decimals(1)),
            Column.of("turn", numbers("turn_deg"), "°", signed_decimals(2)),
            Column.of("repeat.", numbers("repeatability_um"), "µm", decimals(2)),
            Column.of("decision", [str(entry["decision"]) for entry in entries]),
        )
    )


def history_columns(entries: Sequence[Entry]) -> dict[str, npt.ArrayLike]:
    """Columns of a file: all those of a history; not a number where something was not tested."""
    columns: dict[str, npt.ArrayLike] = {"number": [entry.number for entry in entries]}
    for name in entries[0].values:
        values = [entry[name] for entry in entries]
        if any(isinstance(value, str) for value in values):
            columns[name] = [str(value) for value in values]
        else:
            columns[name] = np.array([_value(entry, name) for entry in entries])
    return columns


def plot_history(entries: Sequence[Entry], title: str = "") -> Figure:
    """The control chart of a probe.

    Parameters
    ----------
    entries : sequence of Entry
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(9.0, 6.0, title or "History of a probe")
    draw_chart(figure.add_subplot(2, 1, 1), figure.add_subplot(2, 1, 2), entries)
    return figure


def draw_chart(size_axes: Axes, test_axes: Axes, entries: Sequence[Entry]) -> None:
    """Size over the verifications, with limits, and below it the tests, with theirs.

    Parameters
    ----------
    size_axes, test_axes : matplotlib Axes
    entries : sequence of Entry
        Those without a size are left out.
    """
    known = [entry for entry in entries if entry["size_um"] is not None]
    if not known:
        size_axes.set_title("no verification has determined the size", fontsize=10)
        return
    number = np.arange(1, len(known) + 1)
    _draw_sizes(size_axes, known, number)
    _draw_tests(test_axes, known, number)
    step = max(-(-len(known) // 6), 1)
    dates = [f"{datetime.fromisoformat(str(entry['time'])):%Y-%m-%d\n%H:%M}" for entry in known]
    for axes in (size_axes, test_axes):
        axes.set_xticks(number[::step], dates[::step], fontsize=7)
        axes.set_xlim(0.4, len(known) + 0.6)
    size_axes.tick_params(labelbottom=False)


def _draw_sizes(axes: Axes, entries: Sequence[Entry], number: npt.NDArray[np.int_]) -> None:
    """Size against that of the map, with three standard uncertainties."""
    size = _values(entries, "size_um")
    axes.errorbar(number, np.zeros(len(entries)), 3.0 * _values(entries, "u_size_um"), fmt="none",
                  ecolor="0.8", elinewidth=6, label="± 3 u")  # fmt: skip
    maps = np.array([str(entry["map_id"]) for entry in entries])
    for own in dict.fromkeys(maps.tolist()):  # values of different maps are not joined
        rows = maps == own
        axes.plot(number[rows], size[rows], "-", color=COLOURS[0], lw=1.0)
    changed = np.array([bool(entry["changed"]) for entry in entries])
    for rows, mark, colour, name in (
        (~changed, "o", COLOURS[0], "no change"),
        (changed, "s", COLOURS[1], "changed"),
    ):
        if rows.any():
            axes.plot(number[rows], size[rows], mark, ms=5, color=colour, label=name)
    for i, entry in zip(number, entries, strict=True):
        if str(entry["decision"]) != "kept":
            axes.axvline(i + 0.5, color="0.4", lw=0.8, ls="--")
    axes.axhline(0.0, color="0.5", lw=0.6)
    axes.set_ylabel("size less the map's (µm)")
    axes.set_title("control chart (dashed: a new map accepted)", fontsize=10)
    axes.legend(fontsize=8)


def _draw_tests(axes: Axes, entries: Sequence[Entry], number: npt.NDArray[np.int_]) -> None:
    """Each test against the limit of its own false-alarm rate: below one is a change."""
    for column, name, mark in (
        ("p_form", "size, amplitude, turn", "o"),
        ("p_map", "all directions", "^"),
        ("p_repeatability", "scatter", "v"),
    ):
        p = np.maximum(_values(entries, column), 1e-30)
        share = 3.0 * p / _values(entries, "false_alarm_rate")
        axes.plot(number, np.maximum(share, 1e-4), mark, ms=4, label=name)
    axes.axhline(1.0, color=COLOURS[1], lw=1.0)
    axes.set_yscale("log")
    axes.set_ylim(5e-5, None)
    axes.set_ylabel("p over its limit")
    axes.legend(fontsize=7, ncols=3, loc="lower left")


def _values(entries: Sequence[Entry], column: str) -> FloatArray:
    return np.array([_value(entry, column) for entry in entries])


def _value(entry: Entry, column: str) -> float:
    value = entry[column]
    return math.nan if value is None else float(value)
