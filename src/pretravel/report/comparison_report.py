"""Report and picture of a comparison: errors that simpler corrections leave of a map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.compensation.comparison import Comparison
from pretravel.report.document import Column, Document, KeyFigure, Picture, Table
from pretravel.report.formatting import value_text
from pretravel.report.style import COLOURS, new_figure
from pretravel.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WHERE = {"equator": "on the equator", "all": "all directions", "part": "on the part"}
_FULL = "full map"
_CURVES = ("mean radius", "eight sectors", "eight sectors, resampled", "Woźniak", _FULL)


def comparison_document(result: Comparison, *, map_name: str = "") -> Document:
    """The report of a comparison of corrections.

    Parameters
    ----------
    result : Comparison
    map_name : str
        Of the file with the map.

    Returns
    -------
    Document
    """
    title = f"{map_name}: errors that corrections leave" if map_name else "Errors left"
    place = _places(result)[-1]
    simpler = [row for row in result.rows if row.where == place and row.method != _FULL]
    best = min(simpler, key=lambda row: row.largest)
    u_map = KeyFigure("u of the full map", result.u_map / MICROMETRE, "µm",
                      remark="rms; the others are taken without any error of touching")  # fmt: skip
    return Document(
        title=title,
        verdict=f"Of the corrections simpler than the map, {best.method} leaves the smallest error "
        f"{_WHERE[place] if place != 'all' else 'in all directions'}: up to "
        f"{value_text(best.largest / MICROMETRE, 'µm')}",
        figures=(u_map,) if result.u_map > 0.0 else (),
        tables=(_errors_table(result),),
        pictures=(Picture("Errors left by corrections", lambda: plot_comparison(result, title)),),
    )


def _places(result: Comparison) -> list[str]:
    return [where for where in _WHERE if any(row.where == where for row in result.rows)]


def _errors_table(result: Comparison) -> Table:
    methods = list(dict.fromkeys(row.method for row in result.rows))
    by_name = {(row.method, row.where): row for row in result.rows}
    columns = [Column.of("left by", methods)]
    for where in _places(result):
        rows = [by_name[method, where] for method in methods]
        largest, rms = ([getattr(row, n) / MICROMETRE for row in rows] for n in ("largest", "rms"))
        columns += [Column.of(f"{_WHERE[where]}: max", largest, "µm"), Column.of("rms", rms, "µm")]
    return Table(
        tuple(columns),
        explanation="The radii of a control describe one plane, and the length of its tool the "
        "axis; between plane and axis the control mixes both.",
    )


def comparison_columns(result: Comparison) -> dict[str, npt.ArrayLike]:
    """Columns of a file: one row for each method and place.

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


def plot_comparison(result: Comparison, title: str = "") -> Figure:
    """Errors that corrections leave: over the azimuth, and as bars.

    Parameters
    ----------
    result : Comparison
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(12.0, 5.4, title or "Errors that corrections leave")
    _draw_curves(figure.add_subplot(1, 2, 1), result)
    _draw_bars(figure.add_subplot(1, 2, 2), result)
    return figure


def _draw_curves(axes: Axes, result: Comparison) -> None:
    """Errors on the equator over the azimuth."""
    for i, name in enumerate(_CURVES):
        axes.plot(result.azimuth_deg, result.curves[name] / MICROMETRE, lw=1.3,
                  color=COLOURS[i % len(COLOURS)], label=name)  # fmt: skip
    axes.set_xlabel("azimuth (°)")
    axes.set_ylabel("correction less map, on the equator (µm)")
    axes.set_xticks(range(0, 361, 60))
    axes.axhline(0.0, color="0.6", lw=0.6)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=8, frameon=False)


def _draw_bars(axes: Axes, result: Comparison) -> None:
    """The largest error of each correction in each place."""
    places = _places(result)
    methods = list(dict.fromkeys(row.method for row in result.rows))
    height = 0.8 / len(places)
    for k, where in enumerate(places):
        own = {row.method: row for row in result.rows if row.where == where}
        at = np.arange(len(methods)) + (k - 0.5 * (len(places) - 1)) * height
        values = [own[method].largest / MICROMETRE for method in methods]
        axes.barh(at, values, height, color=COLOURS[k], label=_WHERE[where])
    axes.set_yticks(range(len(methods)), methods)
    axes.invert_yaxis()
    axes.set_xlabel("largest error left (µm)")
    axes.legend(loc="lower right", fontsize=8)
