"""Report and picture of a description that was identified from a map."""

from __future__ import annotations

import numpy as np

from pretravel.base import MICROMETRE
from pretravel.design.identification.free_numbers import FREE
from pretravel.design.identification.probe_from_map import Identification
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

_UNITS = {"deg": "°", "mm": "mm", "N": "N"}
"""Units by the endings of keys."""
_NEGLIGIBLE = 1e-6
"""Share of u below which a value is only rounding of the numbers."""


def identification_document(found: Identification, *, model: str, map_name: str = "") -> Document:
    """The report of an identification: the free numbers of the description, with uncertainties.

    Parameters
    ----------
    found : Identification
    model : str
        That was fitted to the map.
    map_name : str
        Of the file with the map.
    """
    title = f"{map_name}, {found.probe.name}" if map_name else found.probe.name
    if not len(found.directions):
        return _of_forces(found, title, model)
    rms = float(np.sqrt(np.mean(found.residuals**2)))
    largest = float(np.abs(found.residuals).max())
    return Document(
        title=title,
        verdict=f"{found.probe.name}, model {model}: with the identified quantities the map and "
        f"the model differ by {value_text(rms / MICROMETRE, 'µm', decimals(3))} (rms of "
        f"{len(found.directions)} directions)",
        figures=(
            KeyFigure("map − model", rms / MICROMETRE, "µm", decimals(3), remark="rms"),
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
        tables=(_numbers_table(found), *_force_table(found)),
        pictures=(
            Picture("Map − model over the directions", lambda: identification_view(found, title)),
            *_force_picture(found, title),
        ),
        notes=(_PRELOAD_OF_MAP,) if "preload" in found.names and found.forces is None else (),
        warnings=found.unknown,
    )


_PRELOAD_OF_MAP = (
    "a map alone gives the preload only as far as the lengths and stiffnesses of the description "
    "are right: U does not contain their errors. Measured forces give it without them"
)


def _of_forces(found: Identification, title: str, model: str) -> Document:
    """The report of an identification from forces alone."""
    rms = float(np.sqrt(np.mean(found.force_residuals**2)))
    largest = float(np.abs(found.force_residuals).max())
    return Document(
        title=title,
        verdict=f"{found.probe.name}, model {model}: with the identified quantities the measured "
        f"and the predicted forces differ by {value_text(rms, 'N', decimals(4))} (rms of "
        f"{len(found.force_residuals)} directions)",
        figures=(
            KeyFigure("measured − predicted", rms, "N", decimals(4), remark="rms"),
            KeyFigure("largest difference", largest, "N", decimals(4)),
        ),
        tables=(_numbers_table(found), *_force_table(found)),
        pictures=_force_picture(found, title),
        warnings=found.unknown,
    )


def _force_table(found: Identification) -> tuple[Table, ...]:
    """The forces with their residuals, by direction."""
    if found.forces is None:
        return ()
    polar, azimuth = angles_deg(found.forces.directions)
    forces, residuals = found.forces, found.force_residuals
    return (
        Table(
            (
                Column.of("polar", polar, "°", decimals(1)),
                Column.of("azimuth", azimuth, "°", decimals(1)),
                Column.of("measured", forces.force, "N", decimals(4)),
                Column.of("u", forces.u, "N", decimals(4)),
                Column.of("predicted", forces.force - residuals, "N", decimals(4)),
                Column.of("difference", residuals, "N", signed_decimals(4)),
                Column.of("in u", residuals / forces.u, "", signed_decimals(1)),
            ),
            title="Measured trigger forces",
        ),
    )


def _force_picture(found: Identification, title: str) -> tuple[Picture, ...]:
    if found.forces is None:
        return ()
    return (Picture("Measured and predicted forces", lambda: forces_view(found, title)),)


def forces_view(found: Identification, title: str = "") -> View:
    """Measured and predicted trigger forces over the azimuth, and their differences.

    Parameters
    ----------
    found : Identification
        With forces.
    title : str
    """
    assert found.forces is not None
    forces, residuals = found.forces, found.force_residuals
    _, azimuth = angles_deg(forces.directions)
    labels = tuple(direction_words(forces.directions))
    axis = Axis("azimuth", "°")
    both = PlaneChart(
        "trigger force", axis, Axis("force", "N"),
        (Dots(azimuth, forces.force, "measured, bars: 2 u", "series1", u=2.0 * forces.u,
              labels=labels),
         Dots(azimuth, forces.force - residuals, "predicted", "series2", labels=labels)),
    )  # fmt: skip
    difference = PlaneChart(
        "measured − predicted", axis, Axis("difference", "N"),
        (Rule(0.0), Dots(azimuth, residuals, "bars: 2 u", "series1", u=2.0 * forces.u,
                         labels=labels)),
    )  # fmt: skip
    return View(title or "Trigger forces", (both, difference), 2)


def _key(name: str, found: Identification) -> str:
    """Table and key of a quantity; of the stem with the number of its segment."""
    number = FREE[name]
    table = number.table
    if table == "stylus":
        table += f".{found.probe.stylus.index(found.probe.stem) + 1}"
    return f"{table}.{number.key}" + (" + stylus length" if name == "lever" else "")


def _numbers_table(found: Identification) -> Table:
    units = np.array([FREE[name].unit for name in found.names])
    keys = [_key(name, found) for name in found.names]
    endings = [FREE[name].key.partition("[")[0].rpartition("_")[2] for name in found.names]
    values, u = found.values / units, found.standard_uncertainty / units
    # Of a quantity that is not determined u is larger than any value: the value stays as it is.
    values = np.where(np.abs(values) < _NEGLIGIBLE * np.minimum(u, 1.0), 0.0, values)
    described = (
        (Column.of("described", found.described / units, digits=significant(5)),)
        if len(found.described) else ()
    )  # fmt: skip
    return Table(
        (
            Column.of("quantity", found.names),
            Column.of("key of the description", keys),
            *described,
            Column.of("value", values, digits=significant(5)),
            Column.of("u", u, digits=significant(2)),
            Column.of("U (k = 2)", COVERAGE_FACTOR * u, digits=significant(2)),
            Column.of("unit", [_UNITS.get(ending, "") for ending in endings]),
        ),
        title="Identified quantities",
        explanation="u: standard uncertainty from the scatter of the touches and the u of the "
        "reference, and from u of measured forces.",
    )


def identification_view(found: Identification, title: str = "") -> View:
    """Map − model of the identified description: by place, and over the polar angle."""
    inside = found.directions @ found.probe.orientation.matrix
    residuals = found.residuals / MICROMETRE
    labels = tuple(direction_words(inside))
    scale = Scale.of("map − model", "µm", residuals, signed=True)
    by_place = chart_by_place(inside, residuals, scale, "map − model from above", labels=labels)
    polar, azimuth = angles_deg(inside)
    over = PlaneChart(
        "map − model over the polar angle",
        Axis("polar angle (90° = wall)", "°", ticks=tuple(15.0 * k for k in range(7))),
        Axis("map − model", "µm"),
        (Rule(0.0), Dots(polar, residuals, "", values=azimuth, labels=labels)),
        Scale("azimuth", "°", 0.0, 360.0),
    )  # fmt: skip
    return View(title or "Map − model", (by_place, over), 2)
