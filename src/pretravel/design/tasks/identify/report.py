"""Report and picture of a description that was identified from a map."""

from __future__ import annotations

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.design.identification.probe_from_map import FREE, Identification
from pretravel.show import (
    Axis,
    Column,
    Document,
    Dots,
    KeyFigure,
    Picture,
    PlaneChart,
    Rule,
    Scale,
    Table,
    View,
    angles_deg,
    chart_by_place,
    decimals,
    direction_words,
    signed_decimals,
    significant,
    value_text,
)
from pretravel.uncertainty import COVERAGE_FACTOR


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
        verdict=f"{found.probe.name}, model {model}: with the identified numbers the map and the "
        f"model differ by {value_text(rms / MICROMETRE, 'µm', decimals(3))} (rms of "
        f"{len(found.directions)} directions)",
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
                "Map less model over the directions", lambda: identification_view(found, title)
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
            Column.of(
                "U (k = 2)",
                COVERAGE_FACTOR * found.standard_uncertainty / units,
                digits=significant(2),
            ),
        ),
        title="Identified numbers",
        explanation="The key names the unit (deg: degrees). u: standard uncertainty from "
        "the scatter of the touches and the u of the reference.",
    )


def identification_view(found: Identification, title: str = "") -> View:
    """Map less model of the identified description: by place, and over the polar angle.

    Parameters
    ----------
    found : Identification
    title : str

    Returns
    -------
    View
    """
    inside = found.directions @ found.probe.orientation.matrix
    residuals = found.residuals / MICROMETRE
    labels = tuple(direction_words(inside))
    scale = Scale.of("map less model", "µm", residuals, signed=True)
    by_place = chart_by_place(inside, residuals, scale, "map less model from above", labels=labels)
    polar, azimuth = angles_deg(inside)
    over = PlaneChart(
        "map less model over the polar angle",
        Axis("polar angle (90° = wall)", "°", ticks=tuple(15.0 * k for k in range(7))),
        Axis("map less model", "µm"),
        (Rule(0.0), Dots(polar, residuals, "", values=azimuth, labels=labels)),
        Scale("azimuth", "°", 0.0, 360.0),
    )  # fmt: skip
    return View(title or "Map less model", (by_place, over), 2)
