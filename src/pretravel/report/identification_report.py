"""Report and picture of a description that was identified from a map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pretravel.directions import azimuth_angle, polar_angle
from pretravel.frames import probe_rotation
from pretravel.identification.free_numbers import FREE
from pretravel.identification.probe_from_map import Identification
from pretravel.report.document import Column, Document, KeyFigure, Picture, Table
from pretravel.report.formatting import decimals, signed_decimals, significant
from pretravel.report.style import new_figure, polar_axes
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def identification_document(found: Identification, *, model: str, map_name: str = "") -> Document:
    """The report of an identification: the free numbers of the description, with uncertainties.

    Parameters
    ----------
    found : Identification
    model : str
        That was fitted to the map.
    map_name : str
        Of the file with the map.

    Returns
    -------
    Document
    """
    title = f"{map_name}, {found.probe.name}" if map_name else found.probe.name
    rms = float(np.sqrt(np.mean(found.residuals**2)))
    largest = float(np.abs(found.residuals).max())
    return Document(
        title=title,
        verdict=f"{found.probe.name}, model {model}: from {len(found.directions)} directions",
        figures=(
            KeyFigure("map less model", rms / MICROMETRE, "µm", decimals(3), remark="rms"),
            KeyFigure("largest difference", largest / MICROMETRE, "µm", decimals(3)),
            KeyFigure(
                "shift",
                tuple((found.shift / MICROMETRE).tolist()),
                "µm",
                signed_decimals(2),
                remark="between the reference of the map and that of the model",
                detail=True,
            ),
        ),
        tables=(_numbers_table(found),),
        pictures=(
            Picture(
                "Map less model over the directions", lambda: plot_identification(found, title)
            ),
        ),
        warnings=found.unknown,
    )


def _numbers_table(found: Identification) -> Table:
    units = np.array([FREE[name].unit for name in found.names])
    keys = ["lever_mm" if name == "lever" else FREE[name].key for name in found.names]
    return Table(
        (
            Column.of("number", found.names),
            Column.of("key", keys),
            Column.of("value", found.values / units, digits=significant(6)),
            Column.of("u", found.standard_uncertainty / units, digits=significant(2)),
        )
    )


def plot_identification(found: Identification, title: str = "") -> Figure:
    """Map less model of the identified description, over the directions.

    Parameters
    ----------
    found : Identification
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(6.5, 5.5)
    axes = polar_axes(figure, 1, 1, 1, title or "map less model (µm)")
    inside = found.directions @ probe_rotation(found.probe.orientation.axis)
    largest = max(float(np.abs(found.residuals).max()) / MICROMETRE, 1e-6)
    dots = axes.scatter(azimuth_angle(inside), polar_angle(inside) / DEGREE, s=22,
                        c=found.residuals / MICROMETRE, cmap="RdBu_r",
                        vmin=-largest, vmax=largest)  # fmt: skip
    figure.colorbar(dots, ax=axes, label="map less model (µm); radius: polar angle (°)", pad=0.1)
    return figure
