"""Report and picture of a finite-element model of a probe and of its state at the trigger."""

from __future__ import annotations

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, azimuth_angle, polar_angle
from pretravel.design.fem.condensation import ReducedModel
from pretravel.design.fem.elastic_field import StressByDirection, TriggerField
from pretravel.design.tasks.fem.picture import trigger_field_view
from pretravel.show import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Section,
    Table,
    decimals,
    significant,
    value_text,
)
from pretravel.six_seats import SEAT_NAMES
from pretravel.tasks.predict import shares_table


def finite_elements_document(
    reduced: ReducedModel, field: TriggerField, stresses: StressByDirection, *, probe_name: str
) -> Document:
    """The report of a finite-element model and of its state at the trigger.

    Parameters
    ----------
    reduced : ReducedModel
    field : TriggerField
        Of one direction.
    stresses : StressByDirection
        Of that direction first, then of others at its polar angle.
    probe_name : str

    Returns
    -------
    Document
    """
    trigger = field.trigger
    polar = value_text(float(polar_angle(trigger.directions)[0]) / DEGREE, "°", significant(6))
    azimuth = value_text(float(azimuth_angle(trigger.directions)[0]) / DEGREE, "°", significant(6))
    return Document(
        title=f"{probe_name}, finite elements",
        verdict=f"{probe_name}, finite elements: touched at polar {polar}, azimuth {azimuth} it "
        f"triggers after {value_text(float(trigger.pretravel[0]) / MICROMETRE, 'µm', decimals(3))} "
        f"at {value_text(float(trigger.force[0]), 'N', decimals(3))}",
        figures=(
            KeyFigure("trigger force", float(trigger.force[0]), "N", decimals(4)),
            KeyFigure(
                "sensing distance", trigger.sensing_distance[0] / MICROMETRE, "µm", decimals(3)
            ),
            KeyFigure("pretravel", trigger.pretravel[0] / MICROMETRE, "µm", decimals(3)),
            KeyFigure("opened seat", " and ".join(field.opened)),
            _highest_stress(field),
        ),
        tables=(shares_table(trigger), *_stress_tables(stresses), _seat_table(field)),
        sections=(_mesh_section(reduced),),
        pictures=(
            Picture(
                "Stress at the trigger, solids and seats, forces of the seats",
                lambda: trigger_field_view(field, probe_name),
            ),
        ),
    )


def _highest_stress(field: TriggerField) -> KeyFigure:
    mesh, highest = field.elastic.mesh, int(np.argmax(field.stress))
    center = tuple(mesh.points[mesh.elements[highest]].mean(axis=0).tolist())
    return KeyFigure(
        "highest stress",
        float(field.stress[highest]),
        "MPa",
        decimals(1),
        remark=f"von Mises, in {mesh.region_names[mesh.regions[highest]]} at "
        f"{value_text(center, 'mm')}",
    )


def _stress_tables(stresses: StressByDirection) -> tuple[Table, ...]:
    """The highest stress of each part: in the direction of the touch, and over the azimuths."""
    here, around = stresses.highest[0], stresses.highest[1:]
    azimuths = azimuth_angle(stresses.directions[1:]) / DEGREE % 360.0
    columns = [
        Column.of("part", stresses.parts),
        Column.of("at rest", stresses.rest, "MPa"),
        Column.of("at trigger", here, "MPa"),
        *(Column.of(f"{axis}", stresses.places[0, :, i], "mm") for i, axis in enumerate("xyz")),
    ]
    if len(around):
        worst = around.argmax(axis=0)
        columns.append(Column.of("largest", around.max(axis=0), "MPa"))
        columns.append(Column.of("at azimuth", azimuths[worst], "°", decimals(0)))
    by_part = Table(
        tuple(columns),
        title="Highest stress of each part",
        explanation="Von Mises, preload included, and where it is at the trigger of this touch; "
        "then the largest at the trigger over the azimuths, every 30° at the same polar angle. It "
        "is the mean over an element: at edges and seats it depends on the mesh.",
    )
    if not len(around):
        return (by_part,)
    by_azimuth = Table(
        (
            Column.of("azimuth", azimuths, "°", decimals(0)),
            *(Column.of(name, around[:, i], "MPa") for i, name in enumerate(stresses.parts)),
        ),
        title="Highest stress of each part at the trigger, over the azimuth",
        detail=True,
    )
    return by_part, by_azimuth


def _seat_table(field: TriggerField) -> Table:
    digits = decimals(4)
    return Table(
        (
            Column.of("seat", SEAT_NAMES),
            Column.of("at rest", field.rest_reactions, "N", digits),
            Column.of("at trigger", field.trigger.reactions[0], "N", digits),
        ),
        title="Forces of the seats",
        detail=True,
    )


def _mesh_section(reduced: ReducedModel) -> Section:
    return Section(
        "Mesh",
        figures=(
            KeyFigure("unknowns", f"{reduced.summary['unknowns']}, {reduced.summary['elements']}"),
            KeyFigure("quality", reduced.summary["quality"]),
            *(
                KeyFigure("" if row else "sizes", size)
                for row, size in enumerate(reduced.summary["refined"].split("; "))
            ),
        ),
        detail=True,
    )
