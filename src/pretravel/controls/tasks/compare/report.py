"""Report and picture of a comparison: errors that simpler corrections leave of a map."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE
from pretravel.measurement import FULL_MAP, UNCORRECTED, Comparison
from pretravel.show import (
    Area,
    Axis,
    Bars,
    Colour,
    Column,
    Document,
    KeyFigure,
    LineMark,
    Mark,
    Picture,
    PlaneChart,
    Rule,
    Table,
    View,
    azimuth_axis,
    value_text,
)

_WHERE = {"equator": "on the equator", "all": "all directions", "part": "on the part"}
_CURVES = ("mean radius", "eight sectors", "eight sectors, resampled", "Woźniak")
_COLOURS: dict[str, Colour] = {
    UNCORRECTED: "before",
    "mean radius": "series6",
    "two axis radii": "series8",
    "four directions": "series7",
    "eight sectors": "series4",
    "eight sectors, resampled": "series5",
    "Woźniak": "series3",
    FULL_MAP: "after",
}

_SHOWN = {
    UNCORRECTED: "tip radius alone",
    "mean radius": "one radius, mean around the equator",
    "eight sectors": "sector table, from touches at its angles",
    "eight sectors, resampled": "sector table, computed from the map",
    "Woźniak": "Woźniak's constant",
}
"""Names for readers; those of files and of Python stay."""


def comparison_document(result: Comparison, *, map_name: str = "") -> Document:
    """The report of a comparison of corrections.

    Parameters
    ----------
    result : Comparison
    map_name : str
        Of the file with the map.
    """
    title = f"{map_name}: errors after each correction" if map_name else "Errors left"
    place = _places(result)[-1]
    simpler = [
        row
        for row in result.rows
        if row.where == place and row.method in _COLOURS.keys() - {FULL_MAP, UNCORRECTED}
    ]
    best = min(simpler, key=lambda row: row.largest)
    u_map = KeyFigure(
        "u of the map",
        result.u_map / MICROMETRE,
        "µm",
        remark="rms; not contained in the errors in the table below",
    )
    return Document(
        title=title,
        verdict=f"The best correction simpler than the map is '{_shown(best.method)}': its error "
        f"{_WHERE[place] if place != 'all' else 'in all directions'} is up to "
        f"{value_text(best.largest / MICROMETRE, 'µm')}",
        figures=(u_map,) if result.u_map > 0.0 else (),
        tables=(_errors_table(result),),
        pictures=(Picture("Errors after each correction", lambda: comparison_view(result, title)),),
        data=(Table.of(comparison_columns(result), "Errors left"),),
    )


def _shown(method: str) -> str:
    return (
        "u of the map (max: 2 × the largest u)"
        if method == FULL_MAP
        else _SHOWN.get(method, method)
    )


def _in_pictures(method: str) -> str:
    """A shorter name, where bars lose width to long ones."""
    return {FULL_MAP: "map", "mean radius": "one radius"}.get(method) or _shown(method)


def _colour(method: str) -> Colour:
    """Of a correction that the comparison was given, such as that of a control, the last one."""
    return _COLOURS.get(method, "series1")


def _places(result: Comparison) -> list[str]:
    return [where for where in _WHERE if any(row.where == where for row in result.rows)]


def _errors_table(result: Comparison) -> Table:
    methods = list(dict.fromkeys(row.method for row in result.rows))
    by_name = {(row.method, row.where): row for row in result.rows}
    columns = [Column.of("error after", [_shown(method) for method in methods])]
    for where in _places(result):
        rows = [by_name[method, where] for method in methods]
        largest, rms = ([getattr(row, n) / MICROMETRE for row in rows] for n in ("largest", "rms"))
        if FULL_MAP in methods:  # its difference from itself is zero: its u is shown
            of_map = methods.index(FULL_MAP)
            rms[of_map] = float(np.sqrt(np.mean(result.u[where] ** 2))) / MICROMETRE or math.nan
            largest[of_map] = 2.0 * result.largest_u(where) / MICROMETRE or math.nan
        columns += [
            Column.of(f"{where}: max", largest, "µm"),
            Column.of(f"{where}: rms", rms, "µm"),
        ]
    return Table(
        tuple(columns),
        explanation="Equator: normals across the probe axis, as on vertical walls. Max, rms: "
        "largest and root-mean-square difference of each correction from the map. The row of the "
        "map has its uncertainty instead: twice the largest u, and the rms of u (empty for a "
        "prediction). A control applies its radii to walls, and its tool length to faces "
        "square to the axis. On an inclined face both act. Two axis radii: "
        "one for touches along X, one for touches along Y. Four directions: the radius "
        "touched at +X, +Y, -X or -Y, each for all normals within 45° of it. Sector "
        "table: ten radii, eight at 30, 60, 120, 150, 210, 240, 300 and 330°, and the two "
        "axis radii for normals near X and Y; from touches at these angles, or computed from the "
        "map so that the largest error is smallest. Woźniak's constant: a formula with "
        "one constant for the triangle of the probe.",
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


def comparison_view(result: Comparison, title: str = "") -> View:
    """Errors that corrections leave: over the azimuth, and the largest in each place.

    Returns
    -------
    View
        A correction has the same colour in all charts.
    """
    bars = tuple(_largest_chart(result, where) for where in _places(result))
    return View(title or "Errors that corrections leave", (_curves_chart(result), *bars), 2)


def _curves_chart(result: Comparison) -> PlaneChart:
    """Errors on the equator over the azimuth, and twice the map's uncertainty."""
    azimuth = result.azimuth_deg
    marks: list[Mark] = [Rule(0.0)]
    if result.u_map > 0.0:
        band = 2.0 * result.u["equator"] / MICROMETRE
        marks.append(Area(azimuth, -band, band, "map, ± 2 u", _COLOURS[FULL_MAP], 0.3))
    marks += [
        LineMark(azimuth, result.curves[name] / MICROMETRE, _in_pictures(name), _colour(name))
        for name in (*_CURVES, *(name for name in result.curves if name not in _COLOURS))
    ]
    return PlaneChart("errors left on the equator", azimuth_axis("machine"),
                      Axis("error left (correction − map)", "µm"), tuple(marks))  # fmt: skip


def _largest_chart(result: Comparison, where: str) -> PlaneChart:
    """The largest error of each correction in one place; of the map itself twice its largest u."""
    rows = [row for row in result.rows if row.where == where]
    known = result.u_map > 0.0
    bars: list[Mark] = []
    names: list[str] = []
    for place, row in enumerate(rows):
        length = row.largest / MICROMETRE
        text = value_text(length, "µm")
        name = row.method
        if row.method == FULL_MAP:
            length = 2.0 * result.largest_u(where) / MICROMETRE
            text = f"2 u = {value_text(length, 'µm')}" if known else "the reference, u not given"
        names.append(_in_pictures(name))
        bars.append(Bars(np.array([float(place)]), np.array([length]), "", _colour(name),
                         horizontal=True, texts=(text,)))  # fmt: skip
    longest = max(row.largest for row in rows) / MICROMETRE
    return PlaneChart(f"largest error {_WHERE[where] if where != 'all' else 'in all directions'}",
                      Axis("largest error left", "µm", 0.0, 1.45 * longest or 1.0),
                      Axis("", categories=tuple(names)), tuple(bars))  # fmt: skip
