"""Words and pictures of comparisons and verifications."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.compensation.comparison import Comparison
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.formats.probe_history import Entry
from pretravel.qualification.verification import Change, Verification
from pretravel.report.style import COLOURS, new_figure
from pretravel.report.words import table
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WHERE = {"equator": "on the equator", "all": "all directions", "part": "on the part"}


def comparison_table(result: Comparison) -> dict[str, npt.ArrayLike]:
    """One row for each method and place.

    Returns
    -------
    mapping of str to values
        method, where, directions, largest_um, rms_um.
    """
    return {
        "method": [row.method for row in result.rows],
        "where": [row.where for row in result.rows],
        "directions": [row.count for row in result.rows],
        "largest_um": [row.largest / MICROMETRE for row in result.rows],
        "rms_um": [row.rms / MICROMETRE for row in result.rows],
    }


def comparison_report(result: Comparison) -> str:
    """What corrections leave, as a table in µm: largest and root mean square."""
    places = [where for where in _WHERE if any(row.where == where for row in result.rows)]
    methods = list(dict.fromkeys(row.method for row in result.rows))
    by_name = {(row.method, row.where): row for row in result.rows}
    rows = []
    for method in methods:
        cells = [method]
        for where in places:
            own = by_name[method, where]
            cells += [f"{own.largest / MICROMETRE:.2f}", f"{own.rms / MICROMETRE:.2f}"]
        rows.append(cells)
    header = ["left by, µm", *(c for w in places for c in (f"{_WHERE[w]}: max", "rms"))]
    lines = [table(header, rows)]
    if result.u_map > 0.0:
        lines.append(
            f"\nThe full map's own standard uncertainty is {result.u_map / MICROMETRE:.2f} µm rms; "
            "the others are taken without any error of touching."
        )
    lines.append(
        "Radii of controls know one plane, and their length the axis; between them both are mixed."
    )
    return "\n".join(lines)


def plot_comparison(result: Comparison, title: str = "") -> Figure:
    """What corrections leave: over the azimuth, and as bars.

    Parameters
    ----------
    result : Comparison
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(12.0, 5.4)
    figure.suptitle(title or "What corrections leave")
    left = figure.add_subplot(1, 2, 1)
    shown = ("mean radius", "eight sectors", "eight sectors, resampled", "Woźniak", "full map")
    for i, name in enumerate(shown):
        left.plot(result.azimuth_deg, result.curves[name] / MICROMETRE, lw=1.3,
                  color=COLOURS[i % len(COLOURS)], label=name)  # fmt: skip
    left.set_xlabel("azimuth (°)")
    left.set_ylabel("correction less map, on the equator (µm)")
    left.set_xticks(range(0, 361, 60))
    left.axhline(0.0, color="0.6", lw=0.6)
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8, frameon=False)
    right = figure.add_subplot(1, 2, 2)
    places = [where for where in _WHERE if any(row.where == where for row in result.rows)]
    methods = list(dict.fromkeys(row.method for row in result.rows))
    height = 0.8 / len(places)
    for k, where in enumerate(places):
        own = {row.method: row for row in result.rows if row.where == where}
        at = np.arange(len(methods)) + (k - 0.5 * (len(places) - 1)) * height
        values = [own[method].largest / MICROMETRE for method in methods]
        right.barh(at, values, height, color=COLOURS[k], label=_WHERE[where])
    right.set_yticks(range(len(methods)), methods)
    right.invert_yaxis()
    right.set_xlabel("largest error left (µm)")
    right.legend(loc="lower right", fontsize=8)
    return figure


def verification_document(result: Verification, decision: str) -> dict[str, Any]:
    """A verification as plain values for JSON; none where something could not be tested."""

    def plain(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "changed": result.changed,
        "false_alarm_rate": result.false_alarm_rate,
        "p_form": plain(result.p_form),
        "p_map": plain(result.p_map),
        "p_repeatability": plain(result.p_repeatability),
        "size_um": plain(result.size.value / MICROMETRE),
        "u_size_um": plain(result.size.u / MICROMETRE),
        "amplitude_percent": plain(100.0 * result.amplitude.value),
        "u_amplitude_percent": plain(100.0 * result.amplitude.u),
        "turn_deg": plain(result.turn.value / DEGREE),
        "u_turn_deg": plain(result.turn.u / DEGREE),
        "repeatability_um": plain(result.repeatability / MICROMETRE),
        "largest_difference_um": plain(result.largest / MICROMETRE),
        "touches": result.touches,
        "directions": len(result.directions),
        "decision": decision,
        "warnings": list(result.warnings),
    }


def verification_report(result: Verification, decision: str) -> str:
    """What was tested, what was found, what to do."""

    def line(name: str, change: Change, unit: float, word: str) -> str:
        if not math.isfinite(change.u):
            return f"  {name:18s} cannot be seen in this map"
        return (
            f"  {name:18s} {change.value / unit:+.2f} {word}, u = {change.u / unit:.2f} {word} "
            f"({change.detectable / unit:.2f} {word} would be seen in 95 of 100)"
        )

    def told(p: float) -> str:
        return "no repeats to tell" if math.isnan(p) else f"p = {p:.2g}"

    verdict = (
        "CHANGED since it was qualified" if result.changed else "no change since it was qualified"
    )
    lines = [
        (
            f"{verdict}: {result.touches} touches in {len(result.directions)} directions, "
            f"false-alarm rate {100.0 * result.false_alarm_rate:g} %"
        ),
        line("size", result.size, MICROMETRE, "µm"),
        line("amplitude of map", result.amplitude, 0.01, "%"),
        line("turn about axis", result.turn, DEGREE, "°"),
        f"  largest difference {result.largest / MICROMETRE:.2f} µm",
    ]
    if not math.isnan(result.repeatability):
        lines.append(
            f"  {'repeatability':18s} {result.repeatability / MICROMETRE:.2f} µm "
            f"({result.repeatability_dof:.0f} degrees of freedom)"
        )
    lines.append(
        f"  tests              size, amplitude, turn: {told(result.p_form)}; all directions: "
        f"{told(result.p_map)}; repeatability: {told(result.p_repeatability)}"
    )
    if decision != "kept":
        lines.append(f"  map                {decision}")
    elif result.changed:
        lines.append(
            "  map                kept; look at stylus and mount, then touch again, or take the "
            "new touches' map: --accept new.nc"
        )
    else:
        lines.append("  map                kept")
    return "\n".join(lines)


def plot_verification(
    result: Verification, entries: Sequence[Entry] = (), title: str = ""
) -> Figure:
    """Differences by direction, and the control chart where there is a history.

    Parameters
    ----------
    result : Verification
    entries : sequence of Entry
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(12.0 if entries else 7.0, 5.0)
    figure.suptitle(title or "Verification")
    left = figure.add_subplot(1, 2 if entries else 1, 1)
    azimuth = azimuth_angle(result.directions) / DEGREE
    polar = polar_angle(result.directions) / DEGREE
    left.errorbar(azimuth, result.differences / MICROMETRE, 2.0 * result.u_differences / MICROMETRE,
                  fmt="none", ecolor="0.7", lw=0.8, zorder=1)  # fmt: skip
    dots = left.scatter(azimuth, result.differences / MICROMETRE, c=polar, cmap="viridis", s=22,
                        zorder=2)  # fmt: skip
    figure.colorbar(dots, ax=left, label="polar angle (°)")
    left.axhline(0.0, color="0.5", lw=0.6)
    left.set_xlabel("azimuth (°)")
    left.set_ylabel("pretravel less map (µm), ± 2 u")
    left.set_title("changed" if result.changed else "no change", fontsize=10)
    if entries:
        _chart(figure.add_subplot(2, 2, 2), figure.add_subplot(2, 2, 4), entries)
    return figure


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
    figure = new_figure(9.0, 6.0)
    figure.suptitle(title or "History of a probe")
    _chart(figure.add_subplot(2, 1, 1), figure.add_subplot(2, 1, 2), entries)
    return figure


def _chart(axes: Axes, tests: Axes, entries: Sequence[Entry]) -> None:
    """Size over the verifications, with limits, and below it the tests, with theirs."""
    known = [entry for entry in entries if entry["size_um"] is not None]
    number = np.arange(1, len(known) + 1)
    size = np.array([_value(entry, "size_um") for entry in known])
    u = np.array([_value(entry, "u_size_um") for entry in known])
    axes.errorbar(number, np.zeros(len(known)), 3.0 * u, fmt="none", ecolor="0.8", elinewidth=6,
                  label="± 3 u")  # fmt: skip
    maps = np.array([str(entry["map_id"]) for entry in known])
    for own in dict.fromkeys(maps.tolist()):  # values of different maps are not joined
        rows = maps == own
        axes.plot(number[rows], size[rows], "-", color=COLOURS[0], lw=1.0)
    changed = np.array([bool(entry["changed"]) for entry in known])
    for rows, mark, colour, name in (
        (~changed, "o", COLOURS[0], "no change"),
        (changed, "s", COLOURS[1], "changed"),
    ):
        if rows.any():
            axes.plot(number[rows], size[rows], mark, ms=5, color=colour, label=name)
    for i, entry in zip(number, known, strict=True):
        if str(entry["decision"]) != "kept":
            axes.axvline(i + 0.5, color="0.4", lw=0.8, ls="--")
    # Against the limit of its own false-alarm rate: below one is a change.
    names = (("p_form", "size, amplitude, turn"), ("p_map", "all directions"),
             ("p_repeatability", "scatter"))  # fmt: skip
    for (column, name), mark in zip(names, "o^v", strict=True):
        share = [
            3.0 * max(_value(entry, column), 1e-30) / _value(entry, "false_alarm_rate")
            for entry in known
        ]
        tests.plot(number, np.maximum(share, 1e-4), mark, ms=4, label=name)
    tests.axhline(1.0, color=COLOURS[1], lw=1.0)
    tests.set_yscale("log")
    tests.set_ylim(5e-5, None)
    tests.set_ylabel("p over its limit")
    tests.legend(fontsize=7, ncols=3, loc="lower left")
    step = max(-(-len(known) // 6), 1)
    dates = [f"{datetime.fromisoformat(str(entry['time'])):%Y-%m-%d\n%H:%M}" for entry in known]
    for own in (axes, tests):
        own.set_xticks(number[::step], dates[::step], fontsize=7)
        own.set_xlim(0.4, len(known) + 0.6)
    axes.tick_params(labelbottom=False)
    axes.axhline(0.0, color="0.5", lw=0.6)
    axes.set_ylabel("size less the map's (µm)")
    axes.set_title("control chart (dashed: a new map accepted)", fontsize=10)
    axes.legend(fontsize=8)


def _value(entry: Entry, column: str) -> float:
    value = entry[column]
    return math.nan if value is None else float(value)


def history_table(entries: Sequence[Entry]) -> dict[str, npt.ArrayLike]:
    """Every column of a history; empty cells where something could not be tested."""
    columns: dict[str, npt.ArrayLike] = {"number": [entry.number for entry in entries]}
    for name in entries[0].values:
        values = [entry[name] for entry in entries]
        if any(isinstance(value, str) for value in values):
            columns[name] = [str(value) for value in values]
        else:
            columns[name] = np.array([_value(entry, name) for entry in entries])
    return columns


def history_report(entries: Sequence[Entry]) -> str:
    """A line for each verification."""
    rows = [
        [
            str(entry["time"])[:16].replace("T", " "),
            str(entry["map"]),
            "CHANGED" if entry["changed"] else "no change",
            f"{_value(entry, 'size_um'):+.2f}",
            f"{_value(entry, 'amplitude_percent'):+.1f}",
            f"{_value(entry, 'turn_deg'):+.2f}",
            f"{_value(entry, 'repeatability_um'):.2f}",
            str(entry["decision"]),
        ]
        for entry in entries
    ]
    header = [
        "time (UTC)",
        "map",
        "verdict",
        "size µm",
        "amplitude %",
        "turn °",
        "repeat. µm",
        "map",
    ]
    return table(header, rows)
